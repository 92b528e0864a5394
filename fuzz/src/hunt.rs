//! A target over its corpus and mutations of it.

use crate::bounds::{Taken, Watchdog, measured};
use crate::mutation::mutated;
use crate::targets::overwrite;
use crate::{Reached, Spoiling, Target};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Processor time that one input may take: a program of the development profile, on an old machine.
const TIME: Duration = Duration::from_secs(5);
/// Time by the clock after which an input counts as one that does not end.
const HANGS: Duration = Duration::from_secs(180);
/// Memory that one input may take, bytes.
const MEMORY: usize = 256 << 20;
/// Failures after which a hunt ends.
const MOST: usize = 5;

/// The result of a hunt.
#[derive(Debug, Default)]
pub struct Report {
    /// Inputs tried, and those of them that were read.
    pub inputs: usize,
    /// See `inputs`.
    pub read: usize,
    /// The most that one of them took.
    pub most: Taken,
    /// Processor time that all of them took.
    pub time: Duration,
    /// Failures, each with the file that its input is kept in.
    pub failures: Vec<String>,
}

/// Runs a target over its seeds and so many mutations of them; inputs that fail are kept in `folder`.
pub fn hunt(target: &Target, mutations: usize, seed: u64, folder: &Path) -> Report {
    let current = folder.join(format!("{}.input", target.name));
    let watchdog = Watchdog::new(HANGS, format!("{}, given {},", target.name, current.display()));
    let mut hunt = Hunt { target, folder, current, watchdog, report: Report::default() };
    let seeds = (target.seeds)();
    for seed in &seeds {
        let reached = hunt.one(&seed.bytes, &seed.name);
        if seed.good && reached == Some(Reached::Refused) {
            hunt.fail(&seed.bytes, &format!("{} does not get past the reader", seed.name));
        }
    }
    let read = hunt.report.read;
    if read == 0 {
        hunt.report.failures.push(format!("{}: none of its seeds is read", target.name));
    }
    let mut random = Pcg64::seed_from_u64(seed);
    for k in 0..mutations {
        if hunt.report.failures.len() >= MOST {
            break;
        }
        hunt.one(&mutated(target, &seeds, &mut random), &format!("mutation {k} of seed {seed}"));
    }
    if mutations >= 100 && (hunt.report.read - read) * 50 < mutations {
        let few = format!("{}: only {} of {mutations} mutations are read", target.name, hunt.report.read - read);
        hunt.report.failures.push(few);
    }
    let _ = std::fs::remove_file(&hunt.current);
    hunt.report
}

/// Called by libFuzzer before the first input: it ends the program at any panic, also at those that a reader catches
/// and tells as a damaged file, so [`fuzz`] does that for those that get out.
pub fn told_once() {
    std::panic::set_hook(Box::new(|panic| eprintln!("{panic}")));
}

/// Called by libFuzzer with each input.
pub fn fuzz(name: &str, bytes: &[u8]) {
    let Some(target) = crate::target(name) else { return };
    if catch_unwind(|| (target.run)(bytes)).is_err() {
        std::process::abort();
    }
}

struct Hunt<'a> {
    target: &'a Target,
    folder: &'a Path,
    /// Where the input that is under way stands.
    current: PathBuf,
    watchdog: Watchdog,
    report: Report,
}

impl Hunt<'_> {
    /// How far an input gets; none if it fails.
    fn one(&mut self, bytes: &[u8], name: &str) -> Option<Reached> {
        // Where the program ends with it, a stack that overflows say, it is still to be had.
        let _ = overwrite(&self.current, bytes);
        self.watchdog.alive();
        let (reached, taken) = measured(|| catch_unwind(AssertUnwindSafe(|| (self.target.run)(bytes))));
        let report = &mut self.report;
        report.inputs += 1;
        report.time += taken.time;
        report.most.time = report.most.time.max(taken.time);
        report.most.memory = report.most.memory.max(taken.memory);
        report.read += usize::from(matches!(reached, Ok(Reached::Read)));
        if let Err(panic) = &reached {
            let told = panic.downcast_ref::<String>().map(String::as_str);
            let told = told.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
            self.fail(bytes, &format!("{name} panics: {told}"));
        }
        if taken.time > TIME {
            self.fail(bytes, &format!("{name} takes {:.1} s of a processor", taken.time.as_secs_f64()));
        }
        if taken.memory > MEMORY {
            self.fail(bytes, &format!("{name} takes {} MiB of memory", taken.memory >> 20));
        }
        reached.ok()
    }

    fn fail(&mut self, bytes: &[u8], what: &str) {
        let file = self.folder.join(format!("{}-{}.failure", self.target.name, self.report.failures.len()));
        let _ = std::fs::write(&file, bytes);
        let shown = if self.target.kind == Spoiling::Text { 2000 } else { 200 };
        let begin: String = String::from_utf8_lossy(bytes).chars().take(shown).collect();
        self.report.failures.push(format!("{}: {what}\n  kept in {}\n{begin:?}", self.target.name, file.display()));
    }
}
