//! The tests themselves: small changes of the source, drawn by seed, each of which a test should notice.
//!
//! All of them are built into one copy of the repository, each behind a switch that a variable of the environment
//! turns, so the tests are built once. Each test then runs by itself and lists the changes that it reaches; a changed
//! comparison counts as reached only where its result differs. A change is tried with the tests that reach it, the
//! quickest first, until one fails: first all changes with the tests of at most a second, then those that are left with
//! tests of at most 4 s, and so on. A change that does not compile is drawn again. What was found is kept in a file.

mod change;
mod copy;
mod record;

use change::Change;
use copy::{Ended, Test, Tree};
use record::Record;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// The places that are changed, in two groups, of each of which the same number of changes is drawn.
const GROUPS: [[&str; 4]; 2] = [
    ["core/src/solve", "core/src/mechanism", "core/src/friction", "core/src/quantity"],
    ["identify/src/fit", "control/src/tune", "control/src/control", "export/src"],
];

/// Which changes are tried, and how.
pub struct Wanted<'a> {
    /// Changes of each group.
    pub count: usize,
    pub seed: u64,
    /// Folders whose changes are tried; all areas where none is named.
    pub areas: &'a [String],
    /// Programs of tests; all where none is named.
    pub programs: &'a [String],
    /// Numbers of the changes; all where none is named.
    pub only: &'a [usize],
    /// Tests that take longer without a change are left out.
    pub longest: Duration,
    /// Tests of a change end after this time together.
    pub spend: Duration,
    /// Changes and tests tried side by side.
    pub threads: usize,
    /// Shows the changes and tries none.
    pub list: bool,
}

pub fn run(wanted: &Wanted) -> Result<(), String> {
    let areas = || GROUPS.iter().flatten();
    if let Some(unknown) = wanted.areas.iter().find(|area| areas().all(|folder| folder != *area)) {
        let known = areas().copied().collect::<Vec<_>>().join(", ");
        return Err(format!("{unknown} is not an area of changes; allowed: {known}"));
    }
    let (mut drawn, mut groups) = (Vec::new(), Vec::new());
    for group in GROUPS {
        let begin = drawn.len();
        group.iter().try_for_each(|folder| change::all(folder, &mut drawn))?;
        change::shuffle(&mut drawn[begin..], wanted.seed);
        groups.push(begin..drawn.len());
        let possible = drawn.len() - begin;
        println!("{}: {possible} changes, {} drawn with seed {}", group.join(", "), wanted.count, wanted.seed);
    }
    let copy = Tree::make(&drawn)?;
    let chosen = copy.build(&drawn, &groups, wanted.count)?;
    let is_wanted = |(k, change): &(usize, &Change)| {
        (wanted.only.is_empty() || wanted.only.contains(k))
            && (wanted.areas.is_empty() || wanted.areas.iter().any(|area| change.is_in(area)))
    };
    let changes: Vec<(usize, &Change)> = (1..).zip(&chosen).filter(is_wanted).collect();
    if wanted.list {
        changes.iter().for_each(|(k, change)| println!("{k:3}  {change}"));
        return Ok(());
    }
    let crew = Crew::new(wanted.threads)?;
    let mut tests = copy.tests(wanted.programs)?;
    let record = Record::open(Path::new("target/mutants/records"), &copy.source, &chosen)?;
    record.recall(&mut tests);
    let mut trials: Vec<Trial> = changes.iter().map(|(k, change)| record.trial(*k, change)).collect();
    let begin = Instant::now();
    let mut longest = Duration::from_secs(1).min(wanted.longest);
    loop {
        measure(&mut tests, longest, &record, &crew);
        attempt(&mut trials, &tests, longest, wanted.spend, &record, &crew);
        let left = trials.iter().filter(|trial| trial.noticed.is_none()).count();
        println!("tests of at most {} s: {left} of {} changes are left", longest.as_secs(), trials.len());
        if crew.is_stopped() || left == 0 || longest == wanted.longest {
            break;
        }
        longest = (4 * longest).min(wanted.longest);
    }
    let left_out = tests.iter().filter(|test| test.took.is_none()).count();
    println!("\n{:.0} min; {} tests, {left_out} left out", begin.elapsed().as_secs_f64() / 60.0, tests.len());
    tell(&trials, &tests);
    if crew.is_stopped() { Err("ended before all changes were tried; the same command goes on".into()) } else { Ok(()) }
}

/// A change and what is known of it.
pub struct Trial<'a> {
    k: usize,
    change: &'a Change,
    /// Tests that do not fail with it.
    passed: Vec<String>,
    /// The test that fails or does not end, and how it ended.
    noticed: Option<(Ended, String)>,
}

/// Runs the tests that may end within `longest` for the first time, or with more time than before.
fn measure(tests: &mut [Test], longest: Duration, record: &Record, crew: &Crew) {
    let unknown: Vec<Mutex<&mut Test>> =
        tests.iter_mut().filter(|test| test.took.is_none() && test.longer_than < longest).map(Mutex::new).collect();
    crew.each(&unknown, |test| {
        let mut test = test.lock().unwrap();
        let list = record.list(&test);
        let ended = test.reach(&list, longest);
        if ended == Ended::Badly {
            if !crew.is_stopped() {
                println!("{test} fails without any change, and is left out");
            }
            test.longer_than = Duration::MAX;
        } else if !crew.is_stopped() {
            record.keep_test(&test);
        }
    });
}

/// Tries each change that is left with the tests of at most `longest` that reach it.
///
/// A test that noticed n other changes of the same file is taken as 1 + n times quicker than it is.
fn attempt(trials: &mut [Trial], tests: &[Test], longest: Duration, spend: Duration, record: &Record, crew: &Crew) {
    let mut successes: BTreeMap<(String, String), u32> = BTreeMap::new();
    for trial in trials.iter() {
        if let Some((_, test)) = &trial.noticed {
            *successes.entry((trial.change.file.clone(), test.clone())).or_default() += 1;
        }
    }
    let successes = Mutex::new(successes);
    let left: Vec<Mutex<&mut Trial>> =
        trials.iter_mut().filter(|trial| trial.noticed.is_none()).map(Mutex::new).collect();
    crew.each(&left, |trial| {
        let trial = &mut **trial.lock().unwrap();
        let (k, change) = (trial.k, trial.change);
        let reaching = tests.iter().filter(|test| test.reached.contains(&k));
        let mut reaching: Vec<(String, Duration, &Test)> = reaching
            .filter_map(|test| Some((test.to_string(), test.took.filter(|took| *took <= longest)?, test)))
            .collect();
        let is_new = |trial: &Trial, name: &String| !trial.passed.contains(name);
        let mut spent: Duration =
            reaching.iter().filter(|(name, ..)| !is_new(trial, name)).map(|(_, took, _)| took).sum();
        reaching.retain(|(name, ..)| is_new(trial, name));
        while !reaching.is_empty() && spent < spend && !crew.is_stopped() {
            let rank = |(name, took, _): &(String, Duration, &Test)| {
                let key = (change.file.clone(), name.clone());
                *took / (1 + successes.lock().unwrap().get(&key).copied().unwrap_or(0))
            };
            let next = (0..reaching.len()).min_by_key(|&k| rank(&reaching[k])).unwrap_or(0);
            let (name, took, test) = reaching.swap_remove(next);
            let ended = test.run(k);
            spent += took;
            // What ends the hunt ends its tests, too.
            if crew.is_stopped() {
                break;
            }
            record.keep(k, ended, &name);
            if ended == Ended::Well {
                trial.passed.push(name);
                continue;
            }
            println!("{k:3}  {change}\n     {name} {}", if ended == Ended::Badly { "fails" } else { "does not end" });
            *successes.lock().unwrap().entry((change.file.clone(), name.clone())).or_default() += 1;
            trial.noticed = Some((ended, name));
            break;
        }
    });
}

/// Prints how many changes of each area are noticed, and those that are not.
fn tell(trials: &[Trial], tests: &[Test]) {
    println!(
        "\n| changes in | tried | noticed | of them endless | survive | of them not reached |\n|---|---|---|---|---|---|"
    );
    let reaching = |trial: &Trial| tests.iter().filter(|test| test.reached.contains(&trial.k)).count();
    for area in GROUPS.iter().flatten().copied().chain([""]) {
        let of_area: Vec<&Trial> = trials.iter().filter(|trial| trial.change.file.starts_with(area)).collect();
        let noticed = of_area.iter().filter(|trial| trial.noticed.is_some()).count();
        let endless = of_area.iter().filter(|trial| matches!(trial.noticed, Some((Ended::Not, _)))).count();
        let unreached = of_area
            .iter()
            .filter(|trial| trial.noticed.is_none() && trial.passed.is_empty() && reaching(trial) == 0)
            .count();
        if !of_area.is_empty() {
            let (name, tried) = (if area.is_empty() { "all" } else { area }, of_area.len());
            let share = 100.0 * noticed as f64 / tried as f64;
            println!("| {name} | {tried} | {noticed} ({share:.0} %) | {endless} | {} | {unreached} |", tried - noticed);
        }
    }
    println!();
    for trial in trials.iter().filter(|trial| trial.noticed.is_none()) {
        let is_untried = |test: &&Test| test.reached.contains(&trial.k) && !trial.passed.contains(&test.to_string());
        let untried = match tests.iter().filter(is_untried).count() {
            0 => String::new(),
            count => format!("; {count} more reach it"),
        };
        println!("{:3}  {}: survives {} tests{untried}", trial.k, trial.change, trial.passed.len());
    }
}

/// Threads that share a job, until it is done or Ctrl-C or SIGTERM ends it.
struct Crew {
    threads: usize,
    stop: Arc<AtomicBool>,
}

impl Crew {
    fn new(threads: usize) -> Result<Self, String> {
        let stop = Arc::new(AtomicBool::new(false));
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            let registered = signal_hook::flag::register(signal, Arc::clone(&stop));
            registered.map_err(|error| format!("signal {signal} cannot be handled: {error}"))?;
        }
        Ok(Self { threads, stop })
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Does `work` for each of them, several at a time.
    fn each<T: Sync>(&self, all: &[T], work: impl Fn(&T) + Sync) {
        let next = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..self.threads {
                scope.spawn(|| {
                    while let Some(one) = all.get(next.fetch_add(1, Ordering::Relaxed)).filter(|_| !self.is_stopped()) {
                        work(one);
                    }
                });
            }
        });
    }
}
