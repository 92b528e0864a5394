//! The controller inside does what `taut move` shows of it.

use crate::unit::{OK, Unit, machine};
use taut::case::Case;
use taut::control::{Setup, closed_loop};
use taut::solve::Solver;

#[test]
fn the_loop_inside_is_the_loop_of_a_move() {
    is_that_of_a_move("pid", 1e-12);
}

/// Jerk and snap of the reference could not be told: feed-forward inside put the cart up to 53 µm from where that of a
/// move does. What is left comes of looking ahead across a seam of the profile, where snap jumps: less than 4 µm.
#[test]
fn feed_forward_inside_is_that_of_a_move() {
    is_that_of_a_move("pid-elastic", 5e-6);
    is_that_of_a_move("pid-rigid", 5e-6);
}

fn is_that_of_a_move(name: &str, most: f64) {
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
            profile: &shown.profile,
            until,
            window: shown.window,
            solver: Solver::Exact,
        };
        let wanted = closed_loop(&setup).unwrap().figures.final_cart_error;
        let one = unit.three(false, false);
        one.start();
        let refer = |time: f64| {
            let reference = shown.profile.at(time);
            assert_eq!(one.set("reference", reference.position), OK);
            assert_eq!(one.set("reference_speed", reference.speed), OK);
            assert_eq!(one.set("reference_acceleration", reference.acceleration), OK);
            assert_eq!(one.set("reference_jerk", reference.jerk), OK);
            assert_eq!(one.set("reference_snap", reference.snap), OK);
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
