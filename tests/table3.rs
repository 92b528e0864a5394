//! The paper's Table 3 with its fixed steps: the formulas have their order, and the friction is the printed one.

use crate::common;
use common::experiment;
use taut::case::Experiment;
use taut::friction::Friction;
use taut::machine::Machine;
use taut::signal::Signal;
use taut::solve::{Ending, Method, Solver, simulate};
use taut::trajectory::Trajectory;

fn run(machine: &Machine, experiment: &Experiment, solver: Solver) -> Trajectory {
    let solution = simulate(machine, experiment, solver).unwrap();
    assert_eq!(solution.outcome.ending, Ending::Complete);
    solution.trajectory
}

fn last(run: &Trajectory, column: &str) -> f64 {
    *run.get(column).unwrap().last().unwrap()
}

/// The largest difference of any position (m) or speed (m/s) at the end from the exact one.
fn error(machine: &Machine, experiment: &Experiment, method: Method, step: f64) -> f64 {
    let exact = run(machine, experiment, Solver::Exact);
    let stepped = run(machine, experiment, Solver::Table3 { step, method });
    let r = machine.pulley_radius;
    let columns =
        [("drive_angle", r), ("drive_speed", r), ("cart_position", 1.0), ("cart_speed", 1.0), ("idler_angle", r)];
    let difference = |(name, scale): (&str, f64)| scale * (last(&exact, name) - last(&stepped, name)).abs();
    columns.into_iter().map(difference).fold(0.0, f64::max)
}

/// With half the step the error falls by 2⁴ and by 2⁵, where friction is viscous and the input a ramp; with the
/// armature's current as a state as well.
#[test]
fn the_formulas_have_their_order() {
    let ramp = experiment(Signal::Ramp { value: 20.0, over: 0.02, at: 0.0 }, 0.02);
    let mut slow = common::table2();
    slow.drives[0].motor.inductance = 1e-3;
    for machine in [common::table2(), slow] {
        for (method, order) in [(Method::RungeKutta4, 4), (Method::DormandPrince5, 5)] {
            let [coarse, middle, fine] = [2e-4, 1e-4, 5e-5].map(|step| error(&machine, &ramp, method, step));
            // Without damping, a part of the error may fall sooner.
            for found in [(coarse / middle).log2(), (middle / fine).log2()] {
                assert!(found > f64::from(order) - 0.5, "{method:?}: order {found}");
            }
            assert!(middle < 1e-5, "{method:?}: {middle}");
        }
    }
}

/// While all bodies slide, Table 3 is Coulomb's law; below 0.01 rad/s and 0.01 m/s it freezes what should stop, so that
/// the cart creeps on.
#[test]
fn friction_is_coulombs_above_the_band_and_frozen_within() {
    let machine = common::table4();
    let pulse = experiment(Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 }, 1.0);
    let exact = run(&machine, &pulse, Solver::Exact);
    let stepped = run(&machine, &pulse, Solver::Table3 { step: 1e-5, method: Method::RungeKutta4 });
    let at = |run: &Trajectory, column: &str, row: usize| run.get(column).unwrap()[row];
    // Row 200 is 0.2 s: all slide.
    let apart = (at(&exact, "cart_position", 200) - at(&stepped, "cart_position", 200)).abs();
    assert!(apart < 1e-5, "{apart}");
    assert_eq!(at(&stepped, "cart_state", 200), 1.0);
    // The friction that is shown is b v + F_c.
    let speed = at(&stepped, "cart_speed", 200);
    assert!((at(&stepped, "cart_friction", 200) - (19.0424 * speed + 0.2)).abs() < 1e-9);
    // At the end the exact cart stands, and this one creeps at a constant speed within the band.
    assert_eq!(last(&exact, "cart_speed"), 0.0);
    assert_eq!(last(&stepped, "cart_state"), 0.0);
    let crept = at(&stepped, "cart_position", 1000) - at(&stepped, "cart_position", 900);
    let speed = last(&stepped, "cart_speed");
    assert!(speed != 0.0 && speed.abs() <= 0.01 && (crept - 0.1 * speed).abs() < 1e-6, "{speed} m/s, {crept} m");
}

/// The other way round it is the same with the other sign.
#[test]
fn backward_is_the_mirror_image() {
    let machine = common::table4();
    let [there, back] = [5.0, -5.0].map(|value| {
        let pulse = experiment(Signal::Pulse { value, duration: 0.25, at: 0.0 }, 0.5);
        run(&machine, &pulse, Solver::Table3 { step: 1e-4, method: Method::DormandPrince5 })
    });
    for column in ["cart_position", "cart_speed", "drive_state", "idler_friction"] {
        let mirrored = there.get(column).unwrap().iter().zip(back.get(column).unwrap()).all(|(a, b)| *a == -*b);
        assert!(mirrored, "{column}");
    }
}

#[test]
fn what_the_table_does_not_know_is_refused() {
    let told = |change: &dyn Fn(&mut Machine)| {
        let mut machine = common::table4();
        change(&mut machine);
        let pulse = experiment(Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 }, 1.0);
        let solver = Solver::Table3 { step: 1e-4, method: Method::RungeKutta4 };
        simulate(&machine, &pulse, solver).unwrap_err().what
    };
    let breakaway = |friction: &mut Friction| {
        let mut side = friction.forward;
        side.breakaway *= 1.5;
        *friction = Friction::sided(side, friction.backward);
    };
    assert!(
        told(&|machine| breakaway(&mut machine.cart.friction)).contains("does not support the friction of the cart")
    );
    assert!(told(&|machine| machine.drives[0].motor.gear_efficiency = 0.9).contains("gear efficiency below 1"));
    assert!(
        told(&|machine| machine.drives[0].amplifier.voltage_limit = Some(3.0)).contains("Table 3 does not support")
    );
}

/// A step too long for the belt's swing: that the state is none of a machine is told at the first row where it is.
#[test]
fn a_step_too_long_is_told_at_once() {
    let slow = Experiment { every: 0.5, ..experiment(Signal::Step { value: 5.0, at: 0.0 }, 2.0) };
    let solver = Solver::Table3 { step: 0.01, method: Method::RungeKutta4 };
    let solution = simulate(&common::table2(), &slow, solver).unwrap();
    assert_eq!(solution.outcome.ending, Ending::Diverged { time: 0.5 });
    assert_eq!(solution.trajectory.len(), 1);
}
