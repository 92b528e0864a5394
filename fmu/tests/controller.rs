//! The controller inside does what `taut move` shows of it.

use crate::unit::{OK, Unit, machine};
use taut::case::Case;
use taut::control::{Setup, closed_loop};
use taut::signal::profile::Reference;
use taut::solve::Solver;

#[test]
fn the_loop_inside_is_the_loop_of_a_move() {
    is_that_of_a_move("pid", false, 1e-12);
}

/// Jerk and snap of the reference could not be set: feed-forward inside put the cart up to 53 µm from where that of a
/// move does, and 3.5 µm remained of that when they could, because the snap jumps within the lead. With the reference
/// ahead of time the two are the same.
#[test]
fn feed_forward_inside_is_that_of_a_move() {
    is_that_of_a_move("pid-elastic", true, 1e-12);
    is_that_of_a_move("pid-rigid", true, 1e-12);
}

/// An importer that sets no reference ahead of time has it extrapolated; the snap jumps at seams of the profile.
#[test]
fn feed_forward_inside_extrapolates_the_reference_where_none_is_set_ahead() {
    is_that_of_a_move("pid-elastic", false, 5e-6);
    is_that_of_a_move("pid-rigid", false, 5e-6);
}

fn is_that_of_a_move(name: &str, ahead: bool, most: f64) {
    is_that_of(&format!("sollmann-jouaneh/controllers/{name}.toml"), &[], ahead, most);
}

/// The loops of all motors of a gantry, with and without feed-forward and compensated stretch.
#[test]
fn the_loops_inside_a_gantry_are_those_of_its_move() {
    let smooth = "move=[{ name = \"smooth\", points = [[0.04, 0.02], [0.01, 0.035]], speed = 0.3, acceleration = 5, \
                  jerk = 200, snap = 20000, until = 0.8 }]";
    let pid = "every = \"1 ms\", limit = \"24 V\", pid = { proportional = 5000, integral = 20000, derivative = 40 }";
    let cascade = "every = \"1 ms\", delay = \"0.4 ms\", limit = \"24 V\", cascade = { position = 20, speed = 1.5, \
                   speed_integral = 0.05, current = { proportional = 2, integral = 500, limit = 15 } }";
    for kind in ["h-frame", "core-xy", "dual-belt"] {
        for (structure, feed_forward) in [
            (pid, ""),
            (pid, ", feed_forward = { model = \"rigid\" }"),
            (cascade, ", feed_forward = { model = \"elastic\", compensate_stretch = true }"),
        ] {
            let controller = format!("controller={{ {structure}{feed_forward} }}");
            is_that_of(&format!("{kind}/square.toml"), &[smooth, &controller], true, 1e-12);
        }
    }
}

fn is_that_of(name: &str, changes: &[&str], ahead: bool, most: f64) {
    let case = Case::read_with(machine(name), changes).unwrap();
    let (design, shown) = (case.controller.as_ref().unwrap(), &case.moves[0]);
    let unit = Unit::with(name, changes, true);
    let slides: &[&str] = if case.machine.drives.len() == 1 { &[""] } else { &["bridge_", "cart_"] };
    // Into the stroke, before its end, and at rest; steps of a sample, and of a third of one.
    for (milliseconds, parts) in [(30, 1), (80, 3), (600, 1), (600, 3)] {
        let until = f64::from(milliseconds) * 1e-3;
        let setup = Setup {
            window: shown.window,
            solver: Solver::Exact,
            ..Setup::new(&case.machine, design, &shown.profiles, until)
        };
        let wanted: Vec<f64> = closed_loop(&setup).unwrap().figures.loads.iter().map(|load| load.error.last).collect();
        assert_eq!(wanted.len(), slides.len());
        let one = unit.three(false, false);
        one.start();
        let put = |name: &str, reference: Reference| {
            let Reference { position, speed, acceleration, jerk, snap } = reference;
            let endings = ["", "_speed", "_acceleration", "_jerk", "_snap"];
            for (end, value) in endings.into_iter().zip([position, speed, acceleration, jerk, snap]) {
                assert_eq!(one.set(&format!("{name}{end}"), value), OK);
            }
        };
        let refer = |time: f64| {
            for (slide, profile) in slides.iter().zip(&shown.profiles) {
                put(&format!("{slide}reference"), profile.at(time));
                if let (Some(lead), true) = (unit.model.lead(), ahead) {
                    put(&format!("{slide}reference_ahead"), profile.at(time + lead));
                }
            }
        };
        for k in 0..milliseconds {
            let (begin, end) = (f64::from(k) * 1e-3, f64::from(k + 1) * 1e-3);
            refer(begin);
            let mut time = begin;
            for part in 1..=parts {
                let next = if part == parts { end } else { begin + 1e-3 * f64::from(part) / f64::from(parts) };
                time = one.step(time, next - time).last;
            }
        }
        refer(until);
        for (slide, wanted) in slides.iter().zip(wanted) {
            let is = one.get(&format!("{slide}error"));
            assert!((is - wanted).abs() <= most, "{name} {changes:?}, {milliseconds} ms: {is} instead of {wanted}");
        }
    }
}
