//! Times one run of the Table 4 machine: 5 V for 0.25 s, one simulated second, 1000 output intervals, every column;
//! prints JSON.
//!
//! `cargo run --release --package taut --example speed [-- RUNS]`: the exact solver first, then all of `runs`: Coulomb
//! friction, a Stribeck curve on top of it (30 % of Coulomb friction, gone with 0.05 m/s at the belt), bristles under
//! the cart (σ₀ = 1e4 and 1e7 N/m), spans that follow the cart; what each costs, and how far it is from a run at 1e-13.
//!
//! `… -- PROBLEM exact|TOLERANCE RUNS`: one solver for `authorities/speed.py`, which compares it with others: the best
//! time in seconds and the number of events, then φ₁, x and φ₃ of every row.

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;
use std::time::Instant;
use taut::case::Experiment;
use taut::machine::Machine;
use taut::signal::Signal;
use taut::solve::{Flow, Solution, Solver, simulate, stream};

/// The cart's rest position with Coulomb friction by independent solutions, m: close reading of the paper, golden
/// numbers.
const CART_AT_REST: f64 = 0.053746653033;

/// Problems by name.
fn problems() -> [(&'static str, Machine); 5] {
    let table4 = common::table4;
    [
        ("coulomb", table4()),
        ("stribeck", common::with_stribeck(table4())),
        ("lugre-1e4", common::with_bristles(table4(), 1e4)),
        ("lugre-1e7", common::with_bristles(table4(), 1e7)),
        ("follows", common::with_following_spans(table4())),
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

fn seconds(machine: &Machine, experiment: &Experiment, solver: Solver, calls: u32) -> f64 {
    best(calls, &|| {
        black_box(stream(machine, experiment, solver, &mut |block| {
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
            let found = problems().into_iter().find(|(name, _)| name == problem);
            let (_, machine) = found.expect("coulomb, stribeck, lugre-1e4, lugre-1e7 or follows");
            let solver = match solver.as_str() {
                "exact" => Solver::Exact,
                tolerance => Solver::General { tolerance: tolerance.parse().expect("exact or a tolerance") },
            };
            let calls = runs.parse().expect("a number of runs");
            rows(&machine, &experiment, solver, calls);
        }
        _ => summary(&experiment, arguments.first().and_then(|runs| runs.parse().ok()).unwrap_or(2000)),
    }
}

/// The same lines that authorities/cvode.c prints.
fn rows(machine: &Machine, experiment: &Experiment, solver: Solver, calls: u32) {
    let solution = simulate(machine, experiment, solver).expect("the machine is sound");
    println!("{:e} {}", seconds(machine, experiment, solver, calls), solution.outcome.events.len());
    let [drive, cart, idler] = ["drive_angle", "cart_position", "idler_angle"]
        .map(|name| solution.trajectory.get(name).expect("in every run"));
    for ((drive, cart), idler) in drive.iter().zip(cart).zip(idler) {
        println!("{drive:e} {cart:e} {idler:e}");
    }
}

/// The largest difference at the belt, m.
fn apart(machine: &Machine, a: &Solution, b: &Solution) -> f64 {
    let arms = [("drive_angle", machine.pulley_radius), ("cart_position", 1.0), ("idler_angle", machine.pulley_radius)];
    let worst = arms.map(|(name, arm)| {
        let column = |solution: &Solution| solution.trajectory.get(name).expect("in every run").to_vec();
        column(a).iter().zip(column(b)).fold(0.0, |worst: f64, (a, b)| worst.max(arm * (a - b).abs()))
    });
    worst.into_iter().fold(0.0, f64::max)
}

fn summary(experiment: &Experiment, calls: u32) {
    let run = |machine: &Machine, solver: Solver| simulate(machine, experiment, solver).expect("the machine is sound");
    let table4 = common::table4();
    let exact = run(&table4, Solver::Exact);
    let cart = exact.trajectory.get("cart_position").expect("every run has it");
    let error = (cart[cart.len() - 1] - CART_AT_REST).abs();
    let streamed = seconds(&table4, experiment, Solver::Exact, calls);
    let kept = best(calls, &|| _ = black_box(run(&table4, Solver::Exact)));
    let mut texts = Vec::new();
    for (name, machine) in problems() {
        let tight = run(&machine, Solver::General { tolerance: 1e-13 });
        for tolerance in [1e-4, 1e-6, 1e-9] {
            let solver = Solver::General { tolerance };
            let solution = run(&machine, solver);
            let (error, time) = (apart(&machine, &solution, &tight), seconds(&machine, experiment, solver, calls / 10));
            let (events, cost) = (solution.outcome.events.len(), solution.outcome.cost);
            texts.push(format!(
                "{{\"problem\": \"{name}\", \"tolerance\": {tolerance:e}, \"seconds_per_run\": {time:e}, \
                 \"differs_from_1e-13_m\": {error:.1e}, \"events\": {events}, \"steps\": {}, \"evaluations\": {}, \
                 \"modes\": {}, \"sets\": {}, \"looks\": {}}}",
                cost.steps, cost.evaluations, cost.modes, cost.propagators, cost.looks
            ));
        }
    }
    println!(
        "{{\"seconds_per_run\": {streamed:e}, \"seconds_per_run_kept\": {kept:e}, \"position_error_m\": {error:e}, \
         \"events\": {}, \"runs\": [\n  {}\n]}}",
        exact.outcome.events.len(),
        texts.join(",\n  ")
    );
}
