//! Shared by several tests: the paper's machine, and measurements of others.
#![allow(dead_code)]

pub mod chance;
pub mod data;
pub mod document;
pub mod gantries;
pub mod ignored;
pub mod logged;
pub mod loops;
pub mod random;
pub mod shaken;
pub mod stability;
pub mod truths;
pub mod wrong;

use std::sync::Arc;
use taut::case::{Case, Experiment};
use taut::friction::{Friction, Law, Shape};
use taut::machine::{
    Amplifier, AmplifierMode, Belt, BeltMake, DriveUnit, Machine, MachineKind, Motor, Pulley, Slide, Spans, Travel,
};
use taut::mechanism::State;
use taut::signal::Signal;
use taut::solve::{Begun, Ending, Solution, Solver, Variable, simulate};

/// Ten numbers of an axis, each with the machine as it is when that number alone is another.
pub fn ten_variables(machine: &Machine, experiment: &Experiment) -> [Variable; 10] {
    let changes: [fn(&mut Machine, f64); 10] = [
        |machine, by| machine.drives[0].motor.resistance *= 1.0 + by,
        |machine, by| machine.drives[0].motor.torque_constant *= 1.0 + by,
        |machine, by| machine.drives[0].motor.back_emf_constant *= 1.0 + by,
        |machine, by| machine.drive_pulley.inertia *= 1.0 + by,
        |machine, by| machine.idler_pulley.inertia *= 1.0 + by,
        |machine, by| machine.cart.mass *= 1.0 + by,
        |machine, by| machine.belt.stiffness[0] *= 1.0 + by,
        |machine, by| machine.belt.stiffness[1] *= 1.0 + by,
        |machine, by| machine.belt.stiffness[2] *= 1.0 + by,
        |machine, by| machine.pulley_radius *= 1.0 + by,
    ];
    changes.map(|change| {
        Variable::central(1e-5, |by| {
            let mut machine = machine.clone();
            change(&mut machine, by);
            let mechanism = Arc::new(machine.mechanism());
            Begun { start: mechanism.begun(&experiment.initial), mechanism }
        })
    })
}

/// A stage with the paper's motor and radius.
pub fn paper_stage(stiffness: impl Into<Spans>, inertia: f64, pulley: Friction, cart: Friction) -> Machine {
    let pulley = Pulley { inertia, friction: pulley };
    Machine {
        kind: MachineKind::Axis,
        drives: vec![DriveUnit {
            motor: Motor::brushed(0.023, 0.71),
            amplifier: Amplifier::ideal(AmplifierMode::Voltage, 1.0),
        }],
        bridge: None,
        yaw: None,
        pulley_radius: 0.0194,
        drive_pulley: pulley,
        idler_pulley: pulley,
        cart: Slide::new(0.362, cart),
        belt: Belt::given(stiffness, [0.0; 3]),
        encoder: None,
        scale: None,
    }
}

/// Table 1.
pub fn table1() -> Machine {
    let viscous = (Friction::symmetric(0.0042, 0.0), Friction::symmetric(40.6518, 0.0));
    paper_stage([2.6552e5, 2.6552e5, 11.777e4], 7e-5, viscous.0, viscous.1)
}

/// Table 2.
pub fn table2() -> Machine {
    let viscous = (Friction::symmetric(0.0021, 0.0), Friction::symmetric(20.3259, 0.0));
    paper_stage([1.3276e5, 1.3276e5, 5.8885e4], 6.3e-5, viscous.0, viscous.1)
}

/// Friction of Table 4, the rest of Table 2.
pub fn table4() -> Machine {
    let dry = (Friction::symmetric(0.0016, 0.015), Friction::symmetric(19.0424, 0.2));
    paper_stage([1.3276e5, 1.3276e5, 5.8885e4], 6.3e-5, dry.0, dry.1)
}

/// An experiment from rest with an output every millisecond.
pub fn experiment(input: Signal, until: f64) -> Experiment {
    Experiment { name: "test".into(), inputs: vec![input], until, every: 1e-3, initial: State::default(), log: None }
}

/// The result of the first experiment of a case, which runs to its end.
pub fn complete(case: &Case, solver: Solver) -> Solution {
    let solution = simulate(&case.machine, &case.experiments[0], solver).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(solution.outcome.ending, Ending::Complete);
    solution
}

/// One step of length h of Runge and Kutta's method of fourth order.
pub fn runge_kutta<Y: AsRef<[f64]> + AsMut<[f64]> + Clone>(y: &mut Y, h: f64, mut rate: impl FnMut(&Y) -> Y) {
    let along = |y: &Y, by: f64, k: &Y| {
        let mut moved = y.clone();
        moved.as_mut().iter_mut().zip(k.as_ref()).for_each(|(y, k)| *y += by * k);
        moved
    };
    let a = rate(y);
    let b = rate(&along(y, 0.5 * h, &a));
    let c = rate(&along(y, 0.5 * h, &b));
    let d = rate(&along(y, h, &c));
    let [a, b, c, d] = [&a, &b, &c, &d].map(AsRef::as_ref);
    for (i, y) in y.as_mut().iter_mut().enumerate() {
        *y += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
    }
}

/// The machine with viscous friction alone.
pub fn without_dry_friction(mut machine: Machine) -> Machine {
    let bridge = machine.bridge.as_mut().map(|bridge| &mut bridge.friction);
    let pulleys = [&mut machine.drive_pulley.friction, &mut machine.idler_pulley.friction];
    for friction in pulleys.into_iter().chain([&mut machine.cart.friction]).chain(bridge) {
        *friction = Friction::symmetric(friction.forward.viscous, 0.0);
    }
    machine
}

/// F_s = 0.3 F_c on top of each body's Coulomb friction, v_s = 0.05 m/s at the belt.
pub fn with_stribeck(mut machine: Machine) -> Machine {
    let r = machine.pulley_radius;
    let bodies = [
        (&mut machine.drive_pulley.friction, 0.05 / r),
        (&mut machine.cart.friction, 0.05),
        (&mut machine.idler_pulley.friction, 0.05 / r),
    ];
    for (friction, velocity) in bodies {
        friction.forward.breakaway = 1.3 * friction.forward.coulomb;
        friction.backward.breakaway = 1.3 * friction.backward.coulomb;
        friction.law = Law::Stribeck { velocity, shape: Shape::Gaussian };
    }
    machine
}

/// Bristles under the cart: breakaway 30 % above its Coulomb friction, v_s = 0.01 m/s, σ₁ = 60 N s/m.
pub fn with_bristles(mut machine: Machine, stiffness: f64) -> Machine {
    let friction = &mut machine.cart.friction;
    friction.forward.breakaway = 1.3 * friction.forward.coulomb;
    friction.backward.breakaway = 1.3 * friction.backward.coulomb;
    friction.law = Law::LuGre { stiffness, damping: 60.0, velocity: 0.01 };
    machine
}

/// A belt of the paper's lengths whose spans follow the cart.
pub fn with_following_spans(mut machine: Machine) -> Machine {
    let make = BeltMake { modulus: 8.335e9, section: 5.5626e-6, spans: [0.34925, 0.34925, 0.7874].into() };
    (machine.belt.make, machine.belt.follows_cart) = (Some(make), true);
    machine.belt.stiffness = make.stiffness();
    machine.cart.travel = Some(Travel { min: -0.3, max: 0.3, stop: None });
    machine
}
