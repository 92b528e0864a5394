//! The tests themselves: 100 small changes of the source, drawn by seed, each of which a test should notice.
//!
//! All of them are built into one copy of the repository, each behind a switch that a variable of the environment turns,
//! so the tests are built once. Each test then runs by itself and lists the changes that it reaches. A change is tried
//! with the tests that reach it, the quickest first, until one fails. A change that does not compile is drawn again.

mod change;
mod copy;

use change::Change;
use copy::{Ended, Test, Tree};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

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

/// Changes and tests tried side by side.
const WORKERS: usize = 2;

pub fn run(
    count: usize,
    seed: u64,
    (areas, programs): (&[String], &[String]),
    only: &[usize],
    list: bool,
) -> Result<(), String> {
    let mut drawn = Vec::new();
    if let Some(unknown) = areas.iter().find(|area| AREAS.iter().all(|folder| folder != *area)) {
        return Err(format!("{unknown} is not an area of changes; allowed: {}", AREAS.join(", ")));
    }
    for folder in AREAS.iter().filter(|folder| areas.is_empty() || areas.iter().any(|area| area == *folder)) {
        change::all(folder, &mut drawn)?;
    }
    println!("{} changes are possible; {count} are drawn with seed {seed}", drawn.len());
    change::shuffle(&mut drawn, seed);
    let copy = Tree::make()?;
    let chosen = copy.build(drawn, count)?;
    if list {
        chosen.iter().enumerate().for_each(|(k, change)| println!("{:3}  {change}", k + 1));
        return Ok(());
    }
    let tests = copy.tests(programs)?;
    let begin = Instant::now();
    let changes: Vec<(usize, &Change)> =
        (1..).zip(&chosen).filter(|(k, _)| only.is_empty() || only.contains(k)).collect();
    let fates = Mutex::new(Vec::new());
    side_by_side(&changes, |(k, change)| {
        let fate = fate(*k, &tests);
        println!("{k:3}  {change}\n     {}", fate.text());
        fates.lock().unwrap().push((*k, *change, fate));
    });
    let mut fates = fates.into_inner().unwrap();
    fates.sort_by_key(|(k, ..)| *k);
    let count = |of: fn(&Fate) -> bool| fates.iter().filter(|(.., fate)| of(fate)).count();
    let noticed = count(|fate| !matches!(fate, Fate::Survived(_)));
    println!(
        "\n{noticed} of {} changes are noticed ({:.0} %), {} of them by a run that does not end, in {:.0} min",
        fates.len(),
        100.0 * noticed as f64 / fates.len().max(1) as f64,
        count(|fate| matches!(fate, Fate::Endless(_))),
        begin.elapsed().as_secs_f64() / 60.0
    );
    for (k, change, fate) in fates.iter().filter(|(.., fate)| matches!(fate, Fate::Survived(_))) {
        println!("{k:3}  {change}: {}", fate.text());
    }
    Ok(())
}

/// Does `work` for each of them, two at a time.
fn side_by_side<T: Sync>(all: &[T], work: impl Fn(&T) + Sync) {
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..WORKERS {
            scope.spawn(|| {
                while let Some(one) = all.get(next.fetch_add(1, Ordering::Relaxed)) {
                    work(one);
                }
            });
        }
    });
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
