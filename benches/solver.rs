//! The cost of the solvers: of the exact one on the paper's machine, per sample, per event, per edge; of the general
//! one per friction law.
//!
//! `cargo bench --package taut`; rivals (SciPy, CVODE) are timed beside it by `authorities/speed.py`.

#[path = "../tests/common/mod.rs"]
mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use taut::case::Experiment;
use taut::friction::{Friction, Law, Shape};
use taut::machine::axis::{CART, DRIVE};
use taut::machine::{BeltMake, Machine, Travel};
use taut::mechanism::Shown;
use taut::signal::{Hold, Signal};
use taut::solve::{Bench, Differentiated, Flow, Solver, simulate, stream};

fn pulse() -> Signal {
    Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 }
}

fn streamed(machine: &Machine, experiment: &Experiment) -> usize {
    streamed_by(Solver::Exact, machine, experiment)
}

fn streamed_by(solver: Solver, machine: &Machine, experiment: &Experiment) -> usize {
    let outcome = stream(machine, experiment, solver, &mut |block| {
        black_box(block);
        Flow::Continue
    });
    outcome.expect("the machine is sound").events.len()
}

/// Table 4, 5 V for 0.25 s, one second, 1000 intervals, every column.
fn table4(c: &mut Criterion) {
    let (machine, experiment) = (common::table4(), common::experiment(pulse(), 1.0));
    let mut group = c.benchmark_group("table 4, 5 V pulse, 1 s, 1001 rows, 15 events");
    group.bench_function("taut, handed on in blocks", |b| b.iter(|| streamed(&machine, &experiment)));
    group.bench_function("taut, kept in memory", |b| {
        b.iter(|| simulate(&machine, &experiment, Solver::Exact).expect("the machine is sound"));
    });
    group.finish();
}

fn rows(c: &mut Criterion) {
    let machine = common::table4();
    let mut group = c.benchmark_group("against the number of rows");
    for rows in [100_i32, 1_000, 10_000, 100_000] {
        let experiment = Experiment { every: 1.0 / f64::from(rows), ..common::experiment(pulse(), 1.0) };
        group.throughput(Throughput::Elements(rows as u64));
        group.bench_with_input(BenchmarkId::from_parameter(rows), &experiment, |b, e| b.iter(|| streamed(&machine, e)));
    }
    group.finish();
}

/// A triangle wave that sticks and slips all the time, with hardly any rows: the throughput is events.
fn events(c: &mut Criterion) {
    let machine = common::table4();
    let input = Signal::Triangle { amplitude: 3.0, frequency: 10.0 };
    let experiment = Experiment { every: 0.1, ..common::experiment(input, 1.0) };
    let mut group = c.benchmark_group("events of a triangle wave, 11 rows");
    group.throughput(Throughput::Elements(streamed(&machine, &experiment) as u64));
    group.bench_function("3 V, 10 Hz", |b| b.iter(|| streamed(&machine, &experiment)));
    group.finish();
}

/// A recorded input of 10 kHz, held and joined, on rows of 1 kHz.
fn edges(c: &mut Criterion) {
    let machine = common::table4();
    let times: Vec<f64> = (0..10_000).map(|k| f64::from(k) * 1e-4 + 3e-5).collect();
    let values: Vec<f64> = times.iter().map(|t| 4.0 * (20.0 * t).sin() + 2.0 * (313.0 * t).sin()).collect();
    let mut group = c.benchmark_group("edges of a sampled input");
    group.throughput(Throughput::Elements(10_000));
    for (name, hold) in [("held", Hold::Zero), ("joined", Hold::Linear)] {
        let input = Signal::Sampled { times: times.clone(), values: values.clone(), hold };
        let experiment = common::experiment(input, 1.0);
        group.bench_function(name, |b| b.iter(|| streamed(&machine, &experiment)));
    }
    group.finish();
}

/// The general solver with its default tolerance: the same pulse with what the exact solver knows, and with what it
/// does not.
fn general(c: &mut Criterion) {
    let experiment = common::experiment(pulse(), 1.0);
    let dry = |law: Law| {
        let mut machine = common::table4();
        let r = machine.pulley_radius;
        machine.cart.friction = Friction::with_breakaway(19.0424, 0.2, 0.26).following(law);
        let pulley = Friction::with_breakaway(0.0016, 0.015, 0.0195);
        (machine.drive_pulley.friction, machine.idler_pulley.friction) = (pulley, pulley);
        if let Law::Stribeck { velocity, shape } = law {
            let law = Law::Stribeck { velocity: velocity / r, shape };
            (machine.drive_pulley.friction.law, machine.idler_pulley.friction.law) = (law, law);
        }
        machine
    };
    let mut follows = common::table4();
    let make = BeltMake { modulus: 8.335e9, section: 5.5626e-6, spans: [0.34925, 0.34925, 0.7874].into() };
    (follows.belt.make, follows.belt.follows_cart) = (Some(make), true);
    follows.cart.travel = Some(Travel { min: -0.3, max: 0.3, stop: None });
    let curve = Law::Stribeck { velocity: 0.05, shape: Shape::Gaussian };
    let bristles = Law::LuGre { stiffness: 1e4, damping: 60.0, velocity: 0.01 };
    let cases = [
        ("Coulomb", common::table4()),
        ("Stribeck", dry(curve)),
        ("smooth, on the cart", dry(Law::Smooth { breakaway_velocity: 0.01 })),
        ("LuGre, on the cart", dry(bristles)),
        ("spans that follow the cart", follows),
    ];
    let mut group = c.benchmark_group("general, 5 V pulse, 1 s, 1001 rows");
    for (name, machine) in &cases {
        group.bench_function(*name, |b| b.iter(|| streamed_by(Solver::GENERAL, machine, &experiment)));
    }
    group.finish();
}

/// The derivatives of two columns by ten numbers of the machine, and the run that they belong to.
fn derivatives(c: &mut Criterion) {
    let (machine, experiment) = (common::table4(), common::experiment(pulse(), 1.0));
    let variables = common::ten_variables(&machine, &experiment);
    let outputs = [Shown::Position(DRIVE, 1.0), Shown::Position(CART, 1.0)].map(Differentiated::Shown);
    let mut group = c.benchmark_group("derivatives, 5 V pulse, 1 s, 1001 rows");
    group.bench_function("the run alone", |b| b.iter(|| streamed(&machine, &experiment)));
    group.bench_function("two columns by ten parameters", |b| {
        b.iter(|| {
            let mut bench = Bench::default();
            bench.mount(&machine).expect("the machine is sound");
            bench.sensitivities(&experiment, &variables, &outputs).expect("the machine is sound").is_some()
        });
    });
    group.finish();
}

criterion_group!(benches, table4, rows, events, edges, general, derivatives);
criterion_main!(benches);
