//! Every reader over its corpus and 20,000 mutations of it in all: no panic, no broken law, within bounds of time and
//! memory.
//!
//! `TAUT_MUTATIONS=…` tries more of each, `TAUT_SEED=…` others; what fails is kept under `target/tmp`.

use std::path::Path;
use std::time::Duration;
use taut_fuzz::bounds::{Counting, measured};
use taut_fuzz::{Reached, TARGETS, corpus, hunt, target};

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Of all readers together.
const MUTATIONS: usize = 20_000;

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

#[track_caller]
fn withstands(name: &str) {
    let target = target(name).unwrap();
    let mutations = number("TAUT_MUTATIONS").map_or(MUTATIONS.div_ceil(TARGETS.len()), |n| n as usize);
    let report =
        hunt::hunt(target, mutations, number("TAUT_SEED").unwrap_or(1), Path::new(env!("CARGO_TARGET_TMPDIR")));
    println!(
        "{name}: {} of {} inputs read in {:.1} s of a processor, at most {:.2} s and {} KiB for one",
        report.read,
        report.inputs,
        report.time.as_secs_f64(),
        report.most.time.as_secs_f64(),
        report.most.memory >> 10
    );
    assert!(report.failures.is_empty(), "{}", report.failures.join("\n"));
}

macro_rules! readers {
    ($($name:ident),*) => {
        $(#[test]
        fn $name() {
            withstands(stringify!($name));
        })*

        #[test]
        fn all_readers_are_here() {
            assert_eq!([$(stringify!($name)),*], TARGETS.map(|target| target.name));
        }
    };
}

readers!(case, quantity, csv, parquet, matlab, samples, spectrum, gcode, draws);

/// A MATLAB file of 1.4 MB, all zeros packed, took 4.7 GB to be refused: its times are looked at before the rest is
/// unpacked.
#[test]
fn a_small_file_that_unpacks_to_much_takes_little() {
    let file = corpus::much_of_nothing();
    assert!(file.len() < 500_000);
    let (reached, taken) = measured(|| (target("matlab").unwrap().run)(&file));
    assert_eq!(reached, Reached::Refused);
    assert!(taken.memory < 1 << 30, "{} MiB", taken.memory >> 20);
    assert!(taken.time < Duration::from_secs(5), "{:?}", taken.time);
}
