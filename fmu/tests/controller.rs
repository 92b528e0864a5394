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
    let name = format!("sollmann-jouaneh/controllers/{name}.toml");
    let case = Case::read(machine(&name)).unwrap();
    let (design, shown) = (case.controller.as_ref().unwrap(), &case.moves[0]);
    let unit = Unit::of(&name, true);
    // Into the stroke, before its end, and at rest; steps of a sample, and of a third of one.
    for (milliseconds, parts) in [(30, 1), (80, 3), (600, 1), (600, 3)] {
        let until = f64::from(milliseconds) * 1e-3;
        let setup = Setup {
            machine: &case.machine,
            model: &case.machine,
            design,
            profiles: &shown.profiles,
            until,
            window: shown.window,
            solver: Solver::Exact,
        };
        let wanted = closed_loop(&setup).unwrap().figures.cart().error.last;
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
            put("reference", shown.profile().at(time));
            if ahead {
                put("reference_ahead", shown.profile().at(time + unit.model.lead().unwrap()));
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
        let is = one.get("error");
        assert!((is - wanted).abs() <= most, "{name}, {milliseconds} ms: {is} instead of {wanted}");
    }
}
