//! Times one run of the Table 4 machine: 5 V for 0.25 s, one simulated second, 1000 output intervals, every column; prints JSON.
//!
//! `cargo run --release --package taut --example speed [-- RUNS]`

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;
use std::time::Instant;
use taut::signal::Signal;
use taut::solve::{Flow, Solver, simulate, stream};

/// The cart's rest position of an independent solution (close reading of the paper, golden numbers), m.
const CART_AT_REST: f64 = 0.053746653033;

fn main() {
    let runs: u32 = std::env::args().nth(1).and_then(|runs| runs.parse().ok()).unwrap_or(2000);
    let stage = common::table4();
    let experiment = common::experiment(Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 }, 1.0);
    let seconds = |work: &dyn Fn()| {
        // The best of twenty groups: what the machine can do when nothing else disturbs it.
        let group = (runs / 20).max(1);
        let timed = (0..20).map(|_| {
            let start = Instant::now();
            (0..group).for_each(|_| work());
            start.elapsed().as_secs_f64() / f64::from(group)
        });
        timed.fold(f64::INFINITY, f64::min)
    };
    let streamed = seconds(&|| {
        black_box(stream(&stage, &experiment, Solver::Exact, &mut |block| {
            black_box(block);
            Flow::Continue
        }))
        .expect("the machine is sound");
    });
    let kept = seconds(&|| {
        black_box(simulate(&stage, &experiment, Solver::Exact)).expect("the machine is sound");
    });
    let solution = simulate(&stage, &experiment, Solver::Exact).expect("the machine is sound");
    let cart = solution.trajectory.get("cart_position").expect("every run has it");
    let error = (cart[cart.len() - 1] - CART_AT_REST).abs();
    println!(
        "{{\"seconds_per_run\": {streamed:e}, \"seconds_per_run_kept\": {kept:e}, \"position_error_m\": {error:e}, \"events\": {}}}",
        solution.outcome.events.len()
    );
}
