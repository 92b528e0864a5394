//! Sweeps: the same rows however they are split, distributions, designs, metrics, sensitivity indices.

mod common;

use taut::case::{Case, Sampling};
use taut::sweep::{DIMENSIONS, Sobol, Sweep, normal_quantile};
use taut::trajectory::Trajectory;

const TABLE4: &str = include_str!("../stages/sollmann-jouaneh/table4.toml");

fn sweep(changes: &[&str]) -> Sweep {
    let case = Case::from_text_with("table4.toml", TABLE4, changes).unwrap_or_else(|error| panic!("{error}"));
    Sweep::new(&case).unwrap_or_else(|error| panic!("{error}"))
}

fn rows(sweep: &Sweep, first: u64, count: usize) -> Trajectory {
    sweep.rows(first, count, &|| false).expect("nobody stops it")
}

/// The bits of every number.
fn bits(table: &Trajectory) -> Vec<Vec<u64>> {
    table.columns.iter().map(|column| column.values.iter().map(|value| value.to_bits()).collect()).collect()
}

#[test]
fn rows_are_the_same_however_they_are_split() {
    for design in ["random", "latin-hypercube", "sobol"] {
        for indices in ["false", "true"] {
            let design = format!("sweep.design={design}");
            let indices = format!("sweep.indices={indices}");
            let sweep = sweep(&[&design, &indices, "sweep.runs=60", "sweep.vary.all=20 %"]);
            assert_eq!(sweep.parameters().len(), 16);
            let whole = rows(&sweep, 0, 24);
            assert_eq!(whole.len(), 24);
            let mut pieces = Trajectory::default();
            // Backwards, and by a copy: nothing is remembered from one piece to the next.
            let parts: Vec<Trajectory> =
                [(17, 7), (4, 13), (0, 4)].map(|(first, count)| rows(&sweep, first, count)).into();
            parts.iter().rev().for_each(|part| pieces.append(part));
            assert_eq!(bits(&whole), bits(&pieces), "{design} {indices}");
            let mut inputs = whole.clone();
            inputs.columns.truncate(sweep.inputs());
            assert_eq!(bits(&inputs), bits(&sweep.values(0, 24)));
        }
    }
}

#[test]
fn what_lies_beyond_the_last_run_is_left_out() {
    let sweep = sweep(&["sweep.runs=10", "sweep.vary.\"cart.mass\"=5 %"]);
    assert_eq!((sweep.values(8, 5).len(), sweep.values(10, 5).len(), sweep.values(u64::MAX, 5).len()), (2, 0, 0));
    assert!(sweep.rows(0, 10, &|| true).is_none());
}

#[test]
fn sampling_is_what_it_says() {
    let sweep = sweep(&[
        "sweep.design=grid",
        "sweep.vary.\"cart.mass\"=values(0.3 kg, 0.4 kg)",
        "sweep.vary.\"motor.resistance\"=grid(0.5 ohm, 1 ohm, 3)",
    ]);
    assert_eq!((sweep.runs(), sweep.sampling()), (6, Sampling::Grid));
    let table = sweep.values(0, 10);
    let column = |j: usize| table.columns[j].values.clone();
    assert_eq!(column(1), [0.3, 0.3, 0.3, 0.4, 0.4, 0.4]);
    assert_eq!(column(2), [0.5, 0.75, 1.0, 0.5, 0.75, 1.0]);
    let _ = (DIMENSIONS, Sobol::new(1, 0), normal_quantile(0.5));
}
