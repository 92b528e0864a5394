//! Times one run of the Table 4 machine: 5 V for 0.25 s, one second, 1000 output intervals; prints JSON.
#[path = "../tests/common/mod.rs"]
mod common;
use std::time::Instant;
use taut::signal::Signal;
use taut::solve::{Flow, Solver, simulate, stream};

fn main() {
    let stage = common::table4();
    let experiment = common::experiment(Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 }, 1.0);
    let mut best = f64::INFINITY;
    let mut best2 = f64::INFINITY;
    for _ in 0..20 {
        let start = Instant::now();
        for _ in 0..100 {
            std::hint::black_box(simulate(&stage, &experiment, Solver::Exact).unwrap());
        }
        best = best.min(start.elapsed().as_secs_f64() / 100.0);
        let start = Instant::now();
        for _ in 0..100 {
            std::hint::black_box(stream(&stage, &experiment, Solver::Exact, &mut |_| Flow::Continue).unwrap());
        }
        best2 = best2.min(start.elapsed().as_secs_f64() / 100.0);
    }
    println!("{{\"seconds_per_run\": {best:e}, \"stream\": {best2:e}}}");
}
