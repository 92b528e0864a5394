//! Times one run of the Table 4 machine: 5 V for 0.25 s, one simulated second, 1000 output intervals, every column;
//! prints JSON.
//!
//! `cargo run --release --package taut --example speed [-- RUNS]`: the exact solver first, then all of `runs`, with
//! Coulomb friction and with a Stribeck curve on top of it (30 % of Coulomb friction, gone with 0.05 m/s at the belt).
//!
//! `… -- coulomb|stribeck exact|TOLERANCE RUNS`: one solver for `authorities/speed.py`, which compares it with others:
//! the best time in seconds and the number of events, then φ₁, x and φ₃ of every row.

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;
use std::time::Instant;
use taut::case::Experiment;
use taut::signal::Signal;
use taut::solve::{Flow, Solver, simulate, stream};
use taut::stage::Stage;

/// The cart's rest position by independent solutions, m: with Coulomb friction (close reading of the paper, golden
/// numbers), and with the Stribeck curve (`authorities/output/speed.txt`).
const CART_AT_REST: [f64; 2] = [0.053746653033, 0.053607946139];

/// A run, and the place where the cart comes to rest.
struct Problem {
    name: &'static str,
    stage: Stage,
    at_rest: f64,
}

fn problems() -> [Problem; 2] {
    let [coulomb, stribeck] = [common::table4(), common::with_stribeck(common::table4())];
    [
        Problem { name: "coulomb", stage: coulomb, at_rest: CART_AT_REST[0] },
        Problem { name: "stribeck", stage: stribeck, at_rest: CART_AT_REST[1] },
    ]
}

/// Seconds per call, the best: what the machine can do when nothing else disturbs it.
fn best(calls: u32, work: &dyn Fn()) -> f64 {
    let timed = (0..calls.max(1)).map(|_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    });
    timed.fold(f64::INFINITY, f64::min)
}

fn seconds(stage: &Stage, experiment: &Experiment, solver: Solver, calls: u32) -> f64 {
    best(calls, &|| {
        black_box(stream(stage, experiment, solver, &mut |block| {
            black_box(block);
            Flow::Continue
        }))
        .expect("the machine is sound");
    })
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let experiment = common::experiment(Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 }, 1.0);
    match &arguments[..] {
        [problem, solver, runs] => {
            let problem = problems().into_iter().find(|p| p.name == problem).expect("coulomb or stribeck");
            let solver = match solver.as_str() {
                "exact" => Solver::Exact,
                tolerance => Solver::General { tolerance: tolerance.parse().expect("exact or a tolerance") },
            };
            let calls = runs.parse().expect("a number of runs");
            rows(&problem.stage, &experiment, solver, calls);
        }
        _ => summary(&experiment, arguments.first().and_then(|runs| runs.parse().ok()).unwrap_or(2000)),
    }
}

/// The same lines that authorities/cvode.c prints.
fn rows(stage: &Stage, experiment: &Experiment, solver: Solver, calls: u32) {
    let solution = simulate(stage, experiment, solver).expect("the machine is sound");
    println!("{:e} {}", seconds(stage, experiment, solver, calls), solution.outcome.events.len());
    let [drive, cart, idler] = ["drive_angle", "cart_position", "idler_angle"]
        .map(|name| solution.trajectory.get(name).expect("in every run"));
    for ((drive, cart), idler) in drive.iter().zip(cart).zip(idler) {
        println!("{drive:e} {cart:e} {idler:e}");
    }
}

fn summary(experiment: &Experiment, calls: u32) {
    let problems = problems();
    let general = |tolerance| Solver::General { tolerance };
    let all = [(0, Solver::Exact), (0, general(1e-4)), (0, Solver::GENERAL), (1, general(1e-4)), (1, Solver::GENERAL)];
    let runs = all.map(|(problem, solver)| {
        let Problem { name, stage, at_rest } = &problems[problem];
        let (word, tolerance) = match solver {
            Solver::General { tolerance } => ("general", format!("{tolerance:e}")),
            _ => ("exact", "null".to_string()),
        };
        let calls = if word == "exact" { calls } else { calls / 10 };
        let solution = simulate(stage, experiment, solver).expect("the machine is sound");
        let cart = solution.trajectory.get("cart_position").expect("every run has it");
        let error = (cart[cart.len() - 1] - at_rest).abs();
        let (time, events) = (seconds(stage, experiment, solver, calls), solution.outcome.events.len());
        let text = format!(
            "{{\"problem\": \"{name}\", \"solver\": \"{word}\", \"tolerance\": {tolerance}, \"seconds_per_run\": {time:e}, \
             \"position_error_m\": {error:e}, \"events\": {events}, \"evaluations\": {}}}",
            solution.outcome.cost.evaluations
        );
        (text, time, error, events)
    });
    let kept = best(calls, &|| {
        black_box(simulate(&problems[0].stage, experiment, Solver::Exact)).expect("the machine is sound");
    });
    let (_, streamed, error, events) = &runs[0];
    let texts: Vec<&str> = runs.iter().map(|(text, ..)| text.as_str()).collect();
    println!(
        "{{\"seconds_per_run\": {streamed:e}, \"seconds_per_run_kept\": {kept:e}, \"position_error_m\": {error:e}, \"events\": {events}, \
         \"runs\": [\n  {}\n]}}",
        texts.join(",\n  ")
    );
}
