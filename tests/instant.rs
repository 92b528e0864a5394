//! Events of one instant: limits, gear, spans and stops are settled before bodies break away.

use crate::common;
use common::random::{self, Dry};
use proptest::prelude::*;
use taut::case::Case;
use taut::friction::Motion;
use taut::machine::axis::{CART, DRIVE};
use taut::machine::{AmplifierMode, BeltModel, Machine};
use taut::signal::Signal;
use taut::solve::{Ending, Event, Solution, Solver, simulate};

const SOLVERS: [Solver; 2] = [Solver::Exact, Solver::General { tolerance: 1e-11 }];
const POSITIONS: [&str; 3] = ["drive_angle", "cart_position", "idler_angle"];

/// A rigid axis that 0.5 V cannot move: at most 0.835 N at the belt, against 1.5 N of breakaway and 0.2 N of Coulomb
/// friction.
const CLIPPED: &str = r#"
    [motor]
    torque_constant = 0.023
    back_emf_constant = 0.023
    resistance = 0.71
    [amplifier]
    voltage_limit = 0.5
    [drive_pulley]
    radius = 0.0194
    inertia = 6.3e-5
    [idler_pulley]
    inertia = 6.3e-5
    [cart]
    mass = 0.362
    friction = { viscous = 1, coulomb = 0.2, static = 1.5 }
    [belt]
    model = "rigid"
    [[experiment]]
    name = "clipped"
    input = { pulse = 5, for = 0.25 }
    until = 1
    every = 1e-3
"#;

fn clipped(changes: &[&str]) -> Case {
    Case::from_text_with("clipped.toml", CLIPPED, changes).unwrap()
}

fn run(machine: &Machine, input: &Signal, until: f64, solver: Solver) -> Solution {
    let experiment = common::experiment(input.clone(), until);
    simulate(machine, &experiment, solver).unwrap()
}

fn of_bodies(events: &[Event]) -> Vec<(usize, Motion, Motion)> {
    let motions = [Motion::Backward, Motion::Stuck, Motion::Forward, Motion::Free];
    let motion = |code: i8| motions.into_iter().find(|motion| motion.code() == code).unwrap();
    events.iter().filter_map(|e| Some((e.body()?, motion(e.from.code()), motion(e.to.code())))).collect()
}

/// A pulse of 5 V behind a limit of 0.5 V moved the cart by 35.6 mm: it broke away with torque that never was.
#[test]
fn a_body_broke_away_with_a_voltage_that_the_amplifier_cannot_give() {
    // An elastic belt overshoots: 0.4 V pull the cart with 1.34 N at most.
    let elastic = ["belt.model=elastic", "belt.stiffness=[1e5, 1e5, 5e4]", "amplifier.voltage_limit=0.4"];
    // The current limit alone; a commanded current behind a voltage limit; a jump from one limit to the other.
    let cases: [&[&str]; 5] = [
        &[],
        &elastic,
        &["amplifier.voltage_limit=10", "amplifier.current_limit=0.7"],
        &["amplifier.mode=current"],
        &["experiment.clipped.input={ square = 5, frequency = 4 }"],
    ];
    for changes in cases {
        let case = clipped(changes);
        for solver in SOLVERS {
            let solution = simulate(&case.machine, &case.experiments[0], solver).unwrap();
            let moved = solution.trajectory.get("cart_position").unwrap().iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            // An elastic belt gives way to the pulley until the cart holds it.
            let most = if changes == elastic { 1e-4 } else { 0.0 };
            assert!(moved <= most, "{changes:?}, {solver:?}: the cart moves {moved} m");
            let cart = of_bodies(&solution.outcome.events).into_iter().filter(|(body, ..)| *body == CART);
            assert_eq!(cart.count(), 0, "{changes:?}, {solver:?}: {:?}", solution.outcome.events);
        }
    }
}

/// A span that is slack at time zero pulled at the bodies for an instant: a pair of events that is not there, or a
/// slide.
#[test]
fn a_span_that_is_slack_at_time_zero_moved_bodies() {
    let changes = [
        "belt.model=elastic",
        "belt.stiffness=[1e5, 1e5, 5e4]",
        "belt.pretension=2",
        "drive_pulley.friction={ coulomb = 0.05, static = 0.06 }",
        "idler_pulley.friction={ coulomb = 0.05, static = 0.06 }",
        "experiment.clipped.input={ step = 0 }",
        // Span 1 is 0.1 mm too long: taut it would push with 10 N, slack it leaves the 2 N of the others.
        "experiment.clipped.initial={ drive_angle = -0.005154639175257732 }",
        "cart.friction={ coulomb = 2.1, static = 3 }",
    ];
    let case = clipped(&changes);
    for solver in SOLVERS {
        let solution = simulate(&case.machine, &case.experiments[0], solver).unwrap();
        let at_once = |e: &&Event| e.time == 0.0 && e.body() == Some(CART);
        let cart = solution.outcome.events.iter().find(at_once);
        assert!(cart.is_none(), "{solver:?}: {cart:?}");
    }
}

/// Stages whose breakaway is above their Coulomb friction, so that it matters which load decides.
fn sticky() -> impl Strategy<Value = Machine> {
    (random::equipped(Dry::Any), 1.2..4.0_f64).prop_map(|(mut machine, over)| {
        for friction in
            [&mut machine.drive_pulley.friction, &mut machine.cart.friction, &mut machine.idler_pulley.friction]
        {
            friction.forward.breakaway *= over;
            friction.backward.breakaway *= over;
        }
        machine
    })
}

/// Inputs that are constant by pieces.
fn held() -> impl Strategy<Value = Signal> {
    let value = || (0.5..15.0_f64, any::<bool>()).prop_map(|(v, negative)| if negative { -v } else { v });
    prop_oneof![
        (value(), 2.0..30.0_f64, 0.2..0.8_f64).prop_map(|(amplitude, frequency, duty)| Signal::Square {
            amplitude,
            frequency,
            duty
        }),
        (value(), 0.01..0.1_f64, 0.0..0.05_f64).prop_map(|(value, duration, at)| Signal::Pulse { value, duration, at }),
    ]
}

fn clamped(signal: &Signal, most: f64) -> Signal {
    match *signal {
        Signal::Square { amplitude, frequency, duty } => {
            Signal::Square { amplitude: amplitude.clamp(-most, most), frequency, duty }
        }
        Signal::Pulse { value, duration, at } => Signal::Pulse { value: value.clamp(-most, most), duration, at },
        _ => unreachable!("not among these inputs"),
    }
}

proptest! {
    #![proptest_config(random::cases(400))]

    /// Where the current follows at once, an input beyond the voltage limit is the limit itself.
    #[test]
    fn beyond_the_voltage_limit_is_at_the_limit(machine in sticky(), input in held(), limit in 0.2..5.0_f64) {
        let mut machine = machine;
        machine.drives[0].amplifier.mode = AmplifierMode::Voltage;
        machine.drives[0].amplifier.bandwidth = None;
        machine.drives[0].motor.inductance = 0.0;
        machine.drives[0].amplifier.voltage_limit = Some(limit);
        // The same machine without the limit, asked for no more than that.
        let mut plain = machine.clone();
        plain.drives[0].amplifier.voltage_limit = None;
        let asked = clamped(&input, limit / machine.drives[0].amplifier.gain);
        let until = if random::rattles(&machine) { 0.05 } else { 0.15 };
        for solver in SOLVERS {
            let (a, b) = (run(&machine, &input, until, solver), run(&plain, &asked, until, solver));
            let (mut events, mut wanted) = (of_bodies(&a.outcome.events), of_bodies(&b.outcome.events));
            if solver != Solver::Exact {
                // Which of two bodies that start within its tolerance is first is chance.
                [&mut events, &mut wanted].into_iter().for_each(|list| list.sort_by_key(|(body, ..)| *body));
            }
            // So is which way a flank that touches within it pushes first a pulley that nothing holds.
            if solver == Solver::Exact || !random::rattles(&machine) {
                prop_assert_eq!(events, wanted, "{:?}", solver);
            }
            let tolerance = if solver == Solver::Exact { 1e-12 } else { 1e-9 };
            for name in POSITIONS {
                let lever = if name == "cart_position" { 1.0 } else { machine.pulley_radius };
                let (a, b) = (a.trajectory.get(name).unwrap(), b.trajectory.get(name).unwrap());
                for (row, (a, b)) in a.iter().zip(b).enumerate() {
                    prop_assert!(lever * (a - b).abs() <= tolerance, "{solver:?}, {name} at row {row}: {a:e}, {b:e}");
                }
            }
        }
    }

    /// A body leaves rest only where the load that the limits, spans and stops leave passes its breakaway.
    #[test]
    fn bodies_break_away_with_loads_that_exist(machine in sticky(), input in held(), limit in 0.05..3.0_f64) {
        let mut machine = machine;
        machine.drives[0].amplifier.current_limit = Some(limit);
        for solver in SOLVERS {
            let solution = run(&machine, &input, 0.05, solver);
            prop_assert_eq!(solution.outcome.ending, Ending::Complete);
            for event in &solution.outcome.events {
                let Some(body) = event.body() else { continue };
                let forward = event.to == Motion::Forward;
                if event.from != Motion::Stuck || event.to == Motion::Stuck || machine.belt.model != BeltModel::Elastic {
                    continue;
                }
                let friction = match body {
                    DRIVE => machine.drive_pulley.friction,
                    CART => machine.cart.friction,
                    _ => machine.idler_pulley.friction,
                };
                let holds = friction.breakaway(forward);
                let load = if forward { event.load } else { -event.load };
                let tolerance = if solver == Solver::Exact { 1e-12 } else { 1e-9 };
                prop_assert!(load >= holds * (1.0 - tolerance) - tolerance, "{solver:?}: {event:?} holds {holds}");
            }
        }
    }
}
