//! The tests themselves: 100 small changes of the source, drawn by seed, each of which a test should notice.
//!
//! All of them are built into one copy of the library, each behind a switch that a variable of the environment turns;
//! so the copy is built once, and the tests that concern a change are run with it alone. A change that does not compile
//! is drawn again.

mod change;
mod copy;

use change::Change;
use copy::{Ended, Program, Tree};
use std::time::Instant;

/// The places that are changed, and the programs of tests that concern them, the quickest to fail first. `lib` are the
/// tests within the library.
const AREAS: [(&str, &[&str]); 4] = [
    ("src/solve", SOLVER),
    ("src/friction", SOLVER),
    ("src/fit", &["lib", "fit", "posterior"]),
    ("src/quantity", &["lib", "quantity", "case", "bad_cases", "logs"]),
];

const SOLVER: &[&str] = &[
    "lib",
    "cost",
    "table3",
    "elements",
    "instant",
    "rounding",
    "reference",
    "published",
    "metrics",
    "lugre",
    "general",
    "stages",
    "laws",
    "hard",
    "authorities",
    "control",
    "sweep",
];

pub fn run(count: usize, seed: u64, only: Option<usize>, list: bool) -> Result<(), String> {
    let mut drawn = Vec::new();
    for (folder, _) in AREAS {
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
    let programs = copy.programs(AREAS.iter().flat_map(|(_, tests)| *tests).copied())?;
    let mut score = Score::default();
    let begin = Instant::now();
    for (k, change) in chosen.iter().enumerate().map(|(k, change)| (k + 1, change)) {
        if only.is_none_or(|only| only == k) {
            score.take(k, change, &programs);
        }
    }
    println!("\n{} in {:.0} min", score.told(), begin.elapsed().as_secs_f64() / 60.0);
    score.survivors.iter().for_each(|line| println!("{line}"));
    Ok(())
}

/// The score of the tests.
#[derive(Default)]
struct Score {
    failed: usize,
    endless: usize,
    survivors: Vec<String>,
}

impl Score {
    fn take(&mut self, k: usize, change: &Change, programs: &[Program]) {
        let concerned = AREAS.iter().find(|(folder, _)| change.file.starts_with(folder)).map_or(&[][..], |area| area.1);
        let named = |name: &&str| programs.iter().find(|program| program.name == **name);
        for program in concerned.iter().filter_map(named) {
            let (noticed, count) = match program.run(k) {
                Ended::Well => continue,
                Ended::Badly => ("fails", &mut self.failed),
                Ended::Not => ("does not end", &mut self.endless),
            };
            *count += 1;
            println!("{k:3}  {change}\n     {} {noticed}", program.name);
            return;
        }
        println!("{k:3}  {change}\n     SURVIVES");
        self.survivors.push(format!("{k:3}  {change}"));
    }

    fn told(&self) -> String {
        let noticed = self.failed + self.endless;
        let all = noticed + self.survivors.len();
        let share = 100.0 * noticed as f64 / all.max(1) as f64;
        format!(
            "{noticed} of {all} changes are noticed ({share:.0} %), {} of them by a run that does not end",
            self.endless
        )
    }
}
