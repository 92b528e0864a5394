//! Random stages and inputs for the laws that hold for any of them.

use proptest::prelude::*;
use taut::friction::{Friction, Side};
use taut::signal::Signal;
use taut::stage::{Amplifier, AmplifierMode, Belt, Cart, Motor, Pulley, Stage};

/// A value spread evenly over the decades between `low` and `high`.
pub fn decades(low: f64, high: f64) -> impl Strategy<Value = f64> + Clone {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

/// What the random friction may look like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dry {
    /// The same both ways, breakaway at or above Coulomb.
    Symmetric,
    /// Each side its own.
    Any,
}

fn side(viscous: f64, coulomb: f64) -> impl Strategy<Value = Side> {
    (
        prop_oneof![1 => Just(0.0), 4 => decades(viscous / 5.0, viscous * 5.0)],
        prop_oneof![1 => Just(0.0), 4 => decades(coulomb / 5.0, coulomb * 5.0)],
        prop_oneof![Just(1.0), 1.0..1.8],
    )
        .prop_map(|(viscous, coulomb, over)| Side { viscous, coulomb, breakaway: coulomb * over })
}

fn friction(viscous: f64, coulomb: f64, dry: Dry) -> BoxedStrategy<Friction> {
    let one = side(viscous, coulomb);
    match dry {
        Dry::Symmetric => one.prop_map(|side| Friction::sided(side, side)).boxed(),
        Dry::Any => {
            (one, side(viscous, coulomb)).prop_map(|(forward, backward)| Friction::sided(forward, backward)).boxed()
        }
    }
}

/// Machines within a decade or so of the paper's, with every feature now and then.
pub fn stage(dry: Dry) -> impl Strategy<Value = Stage> {
    let motor = (
        decades(0.005, 0.1),
        prop_oneof![3 => Just(1.0), 1 => 0.8..1.2],
        decades(0.2, 4.0),
        prop_oneof![2 => Just(0.0), 1 => decades(1e-5, 5e-3)],
        prop_oneof![1 => Just(0.0), 1 => decades(1e-7, 1e-4)],
        prop_oneof![2 => Just(1.0), 1 => 0.5..8.0],
        prop_oneof![2 => Just(1.0), 1 => 0.5..1.0],
    )
        .prop_map(|(kt, ke, resistance, inductance, rotor_inertia, gear_ratio, gear_efficiency)| Motor {
            torque_constant: kt,
            back_emf_constant: kt * ke,
            resistance,
            inductance,
            rotor_inertia,
            gear_ratio,
            gear_efficiency,
        });
    let amplifier = (prop_oneof![5 => Just(AmplifierMode::Voltage), 1 => Just(AmplifierMode::Current)], 0.5..2.0)
        .prop_map(|(mode, gain)| Amplifier { mode, gain });
    let pulley = move || {
        (decades(1e-5, 5e-4), friction(0.0016, 0.015, dry)).prop_map(|(inertia, friction)| Pulley { inertia, friction })
    };
    let cart = (decades(0.05, 3.0), friction(19.0, 0.2, dry)).prop_map(|(mass, friction)| Cart {
        mass,
        friction,
        along: None,
    });
    let stiffness = || decades(2e3, 5e5);
    let damping = || prop_oneof![2 => Just(0.0), 1 => decades(0.1, 30.0)];
    let belt = ([stiffness(), stiffness(), stiffness()], [damping(), damping(), damping()])
        .prop_map(|(stiffness, damping)| Belt { stiffness, damping, make: None, follows_cart: false });
    (motor, amplifier, decades(0.005, 0.04), pulley(), cart, pulley(), belt).prop_map(
        |(motor, amplifier, pulley_radius, drive_pulley, cart, idler_pulley, belt)| Stage {
            motor,
            amplifier,
            pulley_radius,
            drive_pulley,
            cart,
            idler_pulley,
            belt,
            travel: None,
            encoder: None,
        },
    )
}

/// Inputs made of straight pieces whose edges fall anywhere.
pub fn input() -> impl Strategy<Value = Signal> {
    let value = || (-12.0..12.0_f64).prop_filter("not too small", |v| v.abs() > 0.1);
    prop_oneof![
        (value(), 0.01..0.3, 0.0..0.1).prop_map(|(value, duration, at)| Signal::Pulse { value, duration, at }),
        (value(), 0.02..0.5, 0.0..0.1).prop_map(|(value, over, at)| Signal::Ramp { value, over, at }),
        (value(), 2.0..30.0).prop_map(|(amplitude, frequency)| Signal::Triangle { amplitude, frequency }),
        (value(), 2.0..30.0, 0.2..0.8).prop_map(|(amplitude, frequency, duty)| Signal::Square {
            amplitude,
            frequency,
            duty
        }),
        prop::collection::vec((0.003..0.1_f64, value()), 2..8).prop_map(|steps| {
            let mut time = 0.0;
            let points = steps
                .into_iter()
                .map(|(wait, value)| {
                    time += wait;
                    [time, value]
                })
                .collect();
            Signal::Table { points }
        }),
    ]
}

/// The same input with its sign turned.
pub fn mirrored(signal: &Signal) -> Signal {
    match signal.clone() {
        Signal::Pulse { value, duration, at } => Signal::Pulse { value: -value, duration, at },
        Signal::Ramp { value, over, at } => Signal::Ramp { value: -value, over, at },
        Signal::Triangle { amplitude, frequency } => Signal::Triangle { amplitude: -amplitude, frequency },
        Signal::Square { amplitude, frequency, duty } => Signal::Square { amplitude: -amplitude, frequency, duty },
        Signal::Table { points } => Signal::Table { points: points.into_iter().map(|[t, v]| [t, -v]).collect() },
        other => unreachable!("{other:?} is not among the random inputs"),
    }
}
