//! The tests themselves: 100 small changes of the source, drawn by seed, each of which a test should notice.
//!
//! All of them are built into one copy of the repository, each behind a switch that a variable of the environment
//! turns, so the tests are built once. Each test then runs by itself and lists the changes that it reaches. A change is
//! tried with the tests that reach it, the quickest first, until one fails. A change that does not compile is drawn
//! again.

mod change;
mod copy;

use change::Change;
use copy::{Ended, Test, Tree};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// The places that are changed.
const AREAS: [&str; 8] = [
    "core/src/solve",
    "core/src/mechanism",
    "core/src/friction",
    "core/src/quantity",
    "identify/src/fit",
    "control/src/tune",
    "control/src/control",
    "export/src",
];

/// Which changes are tried, and how.
pub struct Wanted<'a> {
    pub count: usize,
    pub seed: u64,
    /// Folders that are changed; all areas where none is named.
    pub areas: &'a [String],
    /// Programs of tests; all where none is named.
    pub programs: &'a [String],
    /// Numbers of the changes; all where none is named.
    pub only: &'a [usize],
    /// Tests that take longer without a change are left out.
    pub longest: Duration,
    /// Changes and tests tried side by side.
    pub threads: usize,
    /// Shows the changes and tries none.
    pub list: bool,
}

pub fn run(wanted: &Wanted) -> Result<(), String> {
    let mut drawn = Vec::new();
    if let Some(unknown) = wanted.areas.iter().find(|area| AREAS.iter().all(|folder| folder != *area)) {
        return Err(format!("{unknown} is not an area of changes; allowed: {}", AREAS.join(", ")));
    }
    let is_wanted = |folder: &&&str| wanted.areas.is_empty() || wanted.areas.iter().any(|area| area == *folder);
    for folder in AREAS.iter().filter(is_wanted) {
        change::all(folder, &mut drawn)?;
    }
    println!("{} changes are possible; {} are drawn with seed {}", drawn.len(), wanted.count, wanted.seed);
    change::shuffle(&mut drawn, wanted.seed);
    let copy = Tree::make(&drawn)?;
    let chosen = copy.build(drawn, wanted.count)?;
    if wanted.list {
        chosen.iter().enumerate().for_each(|(k, change)| println!("{:3}  {change}", k + 1));
        return Ok(());
    }
    let crew = Crew::new(wanted.threads)?;
    let tests = copy.tests(wanted.programs, wanted.longest, &crew)?;
    let begin = Instant::now();
    let changes: Vec<(usize, &Change)> =
        (1..).zip(&chosen).filter(|(k, _)| wanted.only.is_empty() || wanted.only.contains(k)).collect();
    let fates = Mutex::new(Vec::new());
    crew.each(&changes, |(k, change)| {
        let fate = fate(*k, &tests);
        // What ends the hunt ends its tests, too.
        if !crew.is_stopped() {
            println!("{k:3}  {change}\n     {}", fate.text());
            fates.lock().unwrap().push((*k, *change, fate));
        }
    });
    let mut fates = fates.into_inner().unwrap();
    fates.sort_by_key(|(k, ..)| *k);
    tell(&fates, changes.len(), begin.elapsed());
    if crew.is_stopped() { Err("ended before all changes were tried".into()) } else { Ok(()) }
}

/// Prints how many changes of each area are noticed, and those that are not.
fn tell(fates: &[(usize, &Change, Fate)], asked: usize, took: Duration) {
    let minutes = took.as_secs_f64() / 60.0;
    println!("\n{} of {asked} changes tried in {minutes:.0} min\n", fates.len());
    println!("| changes in | tried | noticed | of them endless | survive |\n|---|---|---|---|---|");
    for area in AREAS.iter().copied().chain([""]) {
        let of_area: Vec<&Fate> =
            fates.iter().filter(|(_, change, _)| change.file.starts_with(area)).map(|(.., fate)| fate).collect();
        let count = |of: fn(&Fate) -> bool| of_area.iter().filter(|fate| of(fate)).count();
        let (survive, endless) =
            (count(|fate| matches!(fate, Fate::Survived(_))), count(|fate| matches!(fate, Fate::Endless(_))));
        if !of_area.is_empty() {
            let (name, noticed) = (if area.is_empty() { "all" } else { area }, of_area.len() - survive);
            let share = 100.0 * noticed as f64 / of_area.len() as f64;
            println!("| {name} | {} | {noticed} ({share:.0} %) | {endless} | {survive} |", of_area.len());
        }
    }
    println!();
    for (k, change, fate) in fates.iter().filter(|(.., fate)| matches!(fate, Fate::Survived(_))) {
        println!("{k:3}  {change}: {}", fate.text());
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

/// The fate of a change.
enum Fate {
    /// The first test that failed.
    Failed(String),
    /// The first test that did not end.
    Endless(String),
    /// No test of those that reach it failed; how many do.
    Survived(usize),
}

/// Tries a change with the tests that reach it, the quickest first.
fn fate(k: usize, tests: &[Test]) -> Fate {
    let reaching: Vec<&Test> = tests.iter().filter(|test| test.reached.contains(&k)).collect();
    for test in &reaching {
        match test.run(k) {
            Ended::Well => {}
            Ended::Badly => return Fate::Failed(test.to_string()),
            Ended::Not => return Fate::Endless(test.to_string()),
        }
    }
    Fate::Survived(reaching.len())
}

impl Fate {
    fn text(&self) -> String {
        match self {
            Fate::Failed(test) => format!("{test} fails"),
            Fate::Endless(test) => format!("{test} does not end"),
            Fate::Survived(count) => format!("SURVIVES {count} tests that reach it"),
        }
    }
}
