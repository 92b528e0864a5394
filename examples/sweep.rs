//! Times the kernel of a sweep: the Table 4 machine, all of its parameters by ±20 %, 5 V and 10 V for 0.25 s, one
//! simulated second at 1 kHz; prints JSON.
//!
//! `cargo run --release --package taut --example sweep [-- RUNS [THREADS [FIGURES] [KEY=VALUE ...]]]`, FIGURES as in
//! `taut sweep --figures`, KEY=VALUE as in `--set`: `sweep.solver=exact`, say

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;
use taut::Result;
use taut::case::Case;
use taut::sweep::Sweep;

/// Runs of a piece of work.
const CHUNK: u64 = 256;

fn main() -> Result<()> {
    let number = |place: usize, default: u64| {
        std::env::args().nth(place).and_then(|number| number.parse().ok()).unwrap_or(default)
    };
    let (runs, threads) = (number(1, 2000), number(2, 1));
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/stages/sollmann-jouaneh/table4.toml");
    let count = format!("sweep.runs={runs}");
    let mut plan = vec![count, "sweep.design=sobol".to_string(), "sweep.vary.all=20 %".to_string()];
    for more in std::env::args().skip(3) {
        plan.push(match more.contains('=') {
            true => more,
            false => format!("sweep.figures={:?}", more.split(',').collect::<Vec<_>>()),
        });
    }
    let case = Case::read_with(file, &plan.iter().map(String::as_str).collect::<Vec<_>>())?;
    let sweep = Sweep::new(&case)?;
    let (next, bits) = (AtomicU64::new(0), AtomicU64::new(0));
    let work = || loop {
        let first = next.fetch_add(CHUNK, Ordering::Relaxed);
        let Some(table) = sweep.rows(first, CHUNK as usize, &|| false).filter(|table| !table.is_empty()) else {
            return;
        };
        // Depends on every bit, and not on the order of the chunks.
        let values = table.columns.iter().flat_map(|column| &column.values);
        bits.fetch_add(values.fold(first, |sum, value| sum.rotate_left(1) ^ value.to_bits()), Ordering::Relaxed);
    };
    let begin = Instant::now();
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    let seconds = begin.elapsed().as_secs_f64();
    let simulations = runs * sweep.groups().len() as u64;
    println!(
        "{{\"runs\": {runs}, \"threads\": {threads}, \"simulations\": {simulations}, \"seconds\": {seconds:.4}, \
         \"simulations_per_second\": {:.0}, \"bits\": \"{:016x}\"}}",
        simulations as f64 / seconds,
        bits.into_inner()
    );
    Ok(())
}
