//! Random stages and inputs for the laws that hold for any of them.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use taut::friction::{Friction, Side};
use taut::machine::{
    Amplifier, AmplifierMode, Belt, BeltModel, DriveUnit, EndStop, GearPlay, Machine, MachineKind, Motor, Pulley,
    Slide, SlideForces, Travel,
};
use taut::polyline::Polyline;
use taut::signal::Signal;

/// As many random cases, the same ones in every run: of a law on sensitive machines a few in a hundred thousand miss
/// their tolerance because an error of the last bit has grown. `PROPTEST_RNG_SEED=…` draws others, `TAUT_CASES=…` more.
pub fn cases(count: u32) -> ProptestConfig {
    let from_environment = ProptestConfig::default();
    ProptestConfig {
        cases: std::env::var("TAUT_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(count),
        failure_persistence: None,
        rng_seed: match from_environment.rng_seed {
            RngSeed::Random => RngSeed::Fixed(1),
            fixed => fixed,
        },
        ..from_environment
    }
}

/// A value spread evenly over the decades between `low` and `high`.
pub fn decades(low: f64, high: f64) -> impl Strategy<Value = f64> + Clone {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

/// The kinds of random friction.
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
pub fn machine(dry: Dry) -> impl Strategy<Value = Machine> {
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
            gear_play: None,
            is_simple: false,
            stepper: None,
        });
    let amplifier = (prop_oneof![5 => Just(AmplifierMode::Voltage), 1 => Just(AmplifierMode::Current)], 0.5..2.0)
        .prop_map(|(mode, gain)| Amplifier::ideal(mode, gain));
    let pulley = move || {
        (decades(1e-5, 5e-4), friction(0.0016, 0.015, dry)).prop_map(|(inertia, friction)| Pulley { inertia, friction })
    };
    let cart = (decades(0.05, 3.0), friction(19.0, 0.2, dry)).prop_map(|(mass, friction)| Slide::new(mass, friction));
    let stiffness = || decades(2e3, 5e5);
    let damping = || prop_oneof![2 => Just(0.0), 1 => decades(0.1, 30.0)];
    let belt = ([stiffness(), stiffness(), stiffness()], [damping(), damping(), damping()])
        .prop_map(|(stiffness, damping)| Belt::given(stiffness, damping));
    (motor, amplifier, decades(0.005, 0.04), pulley(), cart, pulley(), belt).prop_map(
        |(motor, amplifier, pulley_radius, drive_pulley, cart, idler_pulley, belt)| Machine {
            kind: MachineKind::Axis,
            drives: vec![DriveUnit { motor, amplifier }],
            bridge: None,
            yaw: None,
            pulley_radius,
            drive_pulley,
            cart,
            idler_pulley,
            belt,
            encoder: None,
            scale: None,
        },
    )
}

fn now_and_then<T: std::fmt::Debug + Clone>(value: impl Strategy<Value = T>) -> impl Strategy<Value = Option<T>> {
    prop::option::weighted(0.4, value)
}

/// Lines over what lies between −`most` and `most`, or so, with values up to `value` either way; odd ones where a
/// machine has to have a mirror image.
fn line(most: f64, value: f64, dry: Dry) -> BoxedStrategy<Polyline> {
    let points = prop::collection::vec((0.05..1.0_f64, -1.0..1.0_f64), 1..5);
    let through = move |steps: Vec<(f64, f64)>, middle: Option<f64>| {
        let all: f64 = steps.iter().map(|(step, _)| step).sum();
        let mut x = 0.0;
        let half: Vec<[f64; 2]> = steps
            .iter()
            .map(|(step, y)| {
                x += step / all * most;
                [x, y * value]
            })
            .collect();
        let points = match middle {
            None => half.iter().rev().map(|[x, y]| [-x, -y]).chain(half.iter().copied()).collect(),
            Some(shift) => half.into_iter().map(|[x, y]| [2.0 * x - shift * most, y]).collect(),
        };
        Polyline::new(points).expect("x grows")
    };
    match dry {
        Dry::Symmetric => points.prop_map(move |steps| through(steps, None)).boxed(),
        Dry::Any => (points, 0.0..2.0).prop_map(move |(steps, shift)| through(steps, Some(shift))).boxed(),
    }
}

/// Such machines with limits, backlash, slack spans, end stops, and reduced models; with `Symmetric` ones that have a
/// mirror image.
pub fn equipped(dry: Dry) -> impl Strategy<Value = Machine> {
    let limits = (now_and_then(0.5..10.0_f64), now_and_then(decades(0.3, 6.0)), now_and_then(decades(20.0, 2000.0)));
    let gear = now_and_then((
        prop_oneof![1 => Just(0.0), 3 => decades(1e-4, 5e-2)],
        decades(5.0, 500.0),
        prop_oneof![1 => Just(0.0), 1 => decades(1e-3, 0.1)],
        decades(1e-6, 1e-4),
    ));
    let stops =
        now_and_then((decades(1e-3, 5e-2), decades(1e3, 1e5), prop_oneof![1 => Just(0.0), 1 => decades(1.0, 100.0)]));
    let model = prop_oneof![3 => Just(BeltModel::Elastic), 1 => Just(BeltModel::TwoMass), 1 => Just(BeltModel::Rigid)];
    let more = (now_and_then(decades(0.2, 30.0)), now_and_then(-2.0..2.0_f64), model);
    (machine(dry), limits, gear, stops, more).prop_map(move |(mut machine, limits, gear, stops, more)| {
        let (voltage_limit, current_limit, bandwidth) = limits;
        let DriveUnit { amplifier, motor } = &mut machine.drives[0];
        amplifier.voltage_limit = voltage_limit;
        amplifier.current_limit = current_limit;
        if amplifier.mode == AmplifierMode::Current {
            amplifier.bandwidth = bandwidth;
            if voltage_limit.is_some() && bandwidth.is_some() != (motor.inductance > 0.0) {
                amplifier.voltage_limit = None;
            }
        }
        if let Some((backlash, stiffness, damping, rotor)) = gear {
            motor.gear_play = Some(GearPlay { backlash, stiffness, damping });
            motor.rotor_inertia = rotor;
        }
        machine.cart.travel = stops.map(|(end, stiffness, damping)| Travel {
            min: -end,
            max: end,
            stop: Some(EndStop { stiffness, damping }),
        });
        let (pretension, load, model) = more;
        machine.belt.model = model;
        // A belt pulls and does not push: the image of a slack span is a tight one.
        machine.belt.pretension = pretension.filter(|_| model != BeltModel::Rigid && dry == Dry::Any);
        if dry == Dry::Any {
            machine.cart.load = load.unwrap_or(0.0);
        }
        machine
    })
}

/// Such machines with forces that are lines over the cart's way and speed.
pub fn lined(dry: Dry) -> impl Strategy<Value = Machine> {
    (equipped(dry), now_and_then(line(0.05, 1.0, dry)), now_and_then(line(0.5, 1.0, dry))).prop_map(
        |(mut machine, along, by_speed)| {
            machine.cart.forces = SlideForces { along, by_speed };
            machine
        },
    )
}

/// True if flanks, spans or end stops may strike again and again, so that an error grows tenfold every few strikes.
pub fn rattles(machine: &Machine) -> bool {
    machine.drives[0].motor.gear_play.is_some() || machine.cart.travel.is_some() || machine.belt.pretension.is_some()
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
