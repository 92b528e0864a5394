//! Times the kernel of a sweep on one thread: the Table 4 machine, all of its parameters by ±20 %, 5 V and 10 V for 0.25 s, one
//! simulated second at 1 kHz; prints JSON.
//!
//! `cargo run --release --package taut --example sweep [-- RUNS]`

use std::time::Instant;
use taut::Result;
use taut::case::Case;
use taut::sweep::Sweep;

fn main() -> Result<()> {
    let runs: usize = std::env::args().nth(1).and_then(|runs| runs.parse().ok()).unwrap_or(2000);
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/stages/sollmann-jouaneh/table4.toml");
    let count = format!("sweep.runs={runs}");
    let case = Case::read_with(file, &[&count, "sweep.design=sobol", "sweep.vary.all=20 %"])?;
    let sweep = Sweep::new(&case)?;
    let begin = Instant::now();
    let table = sweep.rows(0, runs, &|| false).unwrap_or_default();
    let seconds = begin.elapsed().as_secs_f64();
    let simulations = runs * sweep.experiments().len();
    // Anything that depends on every bit.
    let bits = table
        .columns
        .iter()
        .flat_map(|column| &column.values)
        .fold(0u64, |sum, value| sum.rotate_left(1) ^ value.to_bits());
    println!(
        "{{\"runs\": {runs}, \"simulations\": {simulations}, \"seconds\": {seconds:.4}, \"simulations_per_second\": {:.0}, \"bits\": \"{bits:016x}\"}}",
        simulations as f64 / seconds
    );
    Ok(())
}
