//! An encoder at the motor and a scale at the cart, both in one loop.

use crate::common::stability::{LINEAR, is_that_of_runs};
use nalgebra::Complex;
use std::f64::consts::PI;
use taut::case::Case;
use taut::control::feedback::Feedback;
use taut::control::{Controller, MoveRun, Observation, Setup, Standard, closed_loop, reads_scale};
use taut::design::Design;
use taut::linear::Operation;
use taut::machine::Measurement;
use taut::measure::measure;
use taut::signal::profile::Reference;
use taut::solve::{Solver, simulate};
use taut::tune::{Margins, Plant};

const SCALE: &str = "scale={ lines = 1e9 }";
const NO_FORWARD: &str = "controller.feed_forward={ model = \"none\" }";

fn case(name: &str, changes: &[&str]) -> Case {
    Case::read_with(format!("stages/sollmann-jouaneh/{name}.toml"), changes).unwrap_or_else(|error| panic!("{error}"))
}

/// The first move, of which the controller knows all but the load on the cart.
fn run(case: &Case, until: f64) -> MoveRun {
    let motion = &case.moves[0];
    let mut model = case.machine.clone();
    model.cart.load = 0.0;
    closed_loop(&Setup {
        machine: &case.machine,
        model: &model,
        design: case.controller.as_ref().unwrap(),
        profiles: &motion.profiles,
        until,
        window: motion.window,
        solver: Solver::for_machine(&case.machine),
    })
    .unwrap()
}

/// An encoder at the motor alone cannot see that a load holds the belt stretched: the cart stayed away by F/k for ever.
#[test]
fn a_scale_takes_away_the_stretch_that_the_motor_does_not_see() {
    let [load, smooth, fine] = ["cart.load=-8", "cart.friction={ viscous = 19, coulomb = 0 }", "encoder.lines=1e6"];
    let both = case("two-sensors/cascade", &[load, smooth, fine]);
    let one = case("controllers/cascade", &[load, smooth, fine, "controller.feed_forward={ model = \"elastic\" }"]);
    assert!(reads_scale(both.controller.as_ref().unwrap(), &both.machine) && one.machine.scale.is_none());
    // f = k₁ (y₁ − x) + k₂ k₃/(k₂ + k₃) (y₁ − x) = 8 N
    let [k1, k2, k3] = one.machine.belt.stiffness.three();
    let stretch = 8.0 / (k1 + k2 * k3 / (k2 + k3));
    let [with, without] = [&both, &one].map(|case| run(case, 3.0).figures.cart().error.last);
    assert!((without.abs() / stretch - 1.0).abs() < 0.15, "{without} {stretch}");
    // One count of the scale is 5 µm.
    assert!(with.abs() < 10e-6 && with.abs() < 0.25 * without.abs(), "{with} {without}");
}

/// The answer of a controller to sines at one of its two sensors is that of its linear view of that sensor.
#[test]
fn the_linear_view_has_both_sensors() {
    for (name, changes) in [
        ("cascade", vec!["controller.cascade.speed_integral=0"]),
        ("cascade-current", vec!["controller.cascade.speed_integral=0", "controller.cascade.current.integral=0"]),
        ("lqg", vec![]),
        ("lqg", vec!["controller.delay=1.7 ms"]),
        ("pid-observer", vec!["controller.disturbance_observer={ bandwidth = \"8 Hz\" }"]),
    ] {
        let all: Vec<&str> = changes.iter().copied().chain([NO_FORWARD, SCALE]).collect();
        let case = case(&format!("controllers/{name}"), &all);
        let design = Design { limit: None, ..case.controller.clone().unwrap() };
        let feedback = Feedback::new(&design, &case.machine).unwrap();
        for hertz in [4.0, 40.0, 170.0, 430.0] {
            for at_cart in [false, true] {
                let omega = 2.0 * PI * hertz;
                let terms = feedback.at(omega);
                let told = -if at_cart { terms.scale } else { terms.position } / terms.own;
                let found = response(&case, &design, omega, at_cart);
                let apart = (found - told).norm() / told.norm();
                let bound = if design.disturbance_observer.is_some() { 2e-2 } else { 1e-6 };
                assert!(told.norm() > 0.0 && apart < bound, "{name} {changes:?} {hertz} Hz {at_cart}: {found} {told}");
            }
        }
    }
}

/// The command over the position at one sensor, while the other stands still.
fn response(case: &Case, design: &Design, omega: f64, at_cart: bool) -> Complex<f64> {
    let mut controller = Standard::new(design, &case.machine).unwrap();
    // Whole periods: 1000 samples at 1 kHz and whole Hz.
    let (n, from) = (1000, 4000);
    let mut samples = Vec::new();
    for k in 0..from + n {
        let phase = omega * design.every * k as f64;
        let swing = 1e-5 * phase.cos();
        let [position, scale] = if at_cart { [0.0, swing] } else { [swing, 0.0] };
        let at = Reference::default();
        let time = design.every * k as f64;
        let seen = Observation { time, reference: at, ahead: at, position, scale: Some(scale), current: 0.0 };
        let command = controller.step(&seen);
        controller.limited(command);
        if k >= from {
            samples.push((phase, swing, command));
        }
    }
    // The loop around an observer's integrator drifts: a straight line is taken out.
    let mean = |part: &[(f64, f64, f64)]| part.iter().map(|s| s.2).sum::<f64>() / part.len() as f64;
    let slope = 2.0 * (mean(&samples[n / 2..]) - mean(&samples[..n / 2])) / n as f64;
    let (mut sum, mut seen) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
    for (i, (phase, swing, command)) in samples.iter().enumerate() {
        let turn = Complex::new(0.0, -phase).exp();
        sum += turn * (command - slope * i as f64);
        seen += turn * *swing;
    }
    sum / seen
}

/// Nyquist's criterion with the loop broken at the scale agrees with the loop run in time, on either side of the limit.
#[test]
fn stability_with_two_sensors_is_that_of_a_run() {
    for name in ["cascade", "cascade-current", "lqi", "pid-observer"] {
        let changes = [&LINEAR[..], &[SCALE, NO_FORWARD]].concat();
        is_that_of_runs(name, &case(&format!("controllers/{name}"), &changes), 3);
    }
}

/// With both sensors the Kalman filter knows the cart better than with either: its estimate of a cart that a force
/// holds off is the cart's place, where the motor's encoder alone has the belt stretched by what it believes.
#[test]
fn the_kalman_filter_weighs_both_sensors() {
    let changes = ["cart.load=-8", "cart.friction={ viscous = 19, coulomb = 0 }"];
    let one = case("controllers/lqi", &changes);
    let both = case("controllers/lqi", &[changes[0], changes[1], "scale={ lines = 50000 }"]);
    let [with, without] = [&both, &one].map(|case| run(case, 3.0).figures.cart().error.last.abs());
    assert!(with < 10e-6 && without > 3.0 * with, "{with} {without}");
}

/// The common motion of motor and cart has no belt in it: a disturbance observer of both sensors can be quicker than
/// one that sees the motor swing.
#[test]
fn a_disturbance_observer_of_both_sensors_keeps_more_margin() {
    let quick = "controller.disturbance_observer={ bandwidth = \"25 Hz\" }";
    let peak = |changes: &[&str]| {
        let case = case("controllers/pid-observer", changes);
        let design = case.controller.clone().unwrap();
        let feedback = Feedback::new(&design, &case.machine).unwrap();
        let plant = Plant::new(&case.machine, Operation::default(), &design, &feedback.corners()).unwrap();
        Margins::new(&plant, &feedback)
    };
    let softer = "controller.pid={ proportional = 1500, integral = 0, derivative = 5, filter = 200 }";
    let [with, without] = [peak(&[quick, softer, SCALE]), peak(&[quick, softer])];
    println!("{with:?}\n{without:?}");
    assert!(with.stable && with.sensitivity < without.sensitivity, "{with:?} {without:?}");
}

/// A run shows the scale's counts beside the encoder's, and so does a recorder.
#[test]
fn counts_of_both_sensors_are_shown() {
    let table = case("table4", &["encoder={ at = \"motor\", lines = 512 }", "scale={ counts = 200000 }"]);
    assert_eq!(table.machine.scale.map(|scale| scale.lines), Some(50_000.0));
    let experiment = &table.experiments[0];
    let run = simulate(&table.machine, experiment, Solver::Exact).unwrap();
    let [counts, cart] = ["scale_count", "cart_position"].map(|name| run.trajectory.get(name).unwrap());
    assert!(cart.iter().any(|x| x.abs() > 0.01));
    assert!(counts.iter().zip(cart).all(|(count, x)| *count == (x * 200_000.0).round()));
    let log = measure(&table.machine, &Measurement::default(), experiment, Solver::Exact).unwrap().trajectory;
    let recorded = log.get("scale_count").unwrap();
    assert!(recorded.iter().any(|count| count.abs() > 2000.0) && log.get("encoder_count").is_some());
}
