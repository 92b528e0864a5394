//! Results keep their bits, on any machine, until a change of the solvers is meant: `UPDATE_EXPECT=1 cargo test
//! --package taut --test all golden::` writes `tests/golden.txt` anew. Everywhere else tolerances are lengths and
//! times.

use std::fmt::Write;
use taut::case::Case;
use taut::chance::hash;
use taut::solve::{Flow, Solver, stream};
use taut::trajectory::Trajectory;

const CASES: [&str; 5] = [
    "stages/sollmann-jouaneh/table4.toml",
    "stages/printer-axis/printer-axis.toml",
    "stages/laser-gantry/laser-gantry.toml",
    "stages/h-frame/h-frame.toml",
    "stages/core-xy/core-xy.toml",
];

/// A hash of the bits of all columns.
fn bits(rows: &Trajectory) -> u64 {
    hash(rows.columns.iter().flat_map(|column| &column.values).flat_map(|value| value.to_bits().to_le_bytes()))
}

fn lines(path: &str) -> String {
    let case = Case::read_with(path, &[]).unwrap();
    let mut text = String::new();
    let mut told = |name: &str, rows: &Trajectory| {
        let _ = writeln!(text, "{path} {name:?}: {} rows, {:016x}", rows.len(), bits(rows));
    };
    for experiment in &case.experiments {
        let mut rows = Trajectory::default();
        let mut take = |block: &Trajectory| {
            rows.append(block);
            Flow::Continue
        };
        stream(&case.machine, experiment, Solver::for_machine(&case.machine), &mut take).unwrap();
        told(&experiment.name, &rows);
    }
    text
}

#[test]
fn results_keep_their_bits() {
    let now: String = CASES.iter().map(|path| lines(path)).collect();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden.txt");
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::write(path, &now).unwrap();
    }
    let kept = std::fs::read_to_string(path).unwrap();
    assert_eq!(now, kept, "UPDATE_EXPECT=1 writes them anew, if the change is meant");
}
