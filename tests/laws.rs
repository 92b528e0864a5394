//! Laws that hold for any stage and any input, tried on random ones.

use crate::common;
use common::random::{self, Dry};
use proptest::prelude::*;
use taut::case::Experiment;
use taut::friction::Motion;
use taut::machine::axis::{CART, DRIVE, IDLER, LABELS, ROTOR, SPANS};
use taut::machine::{AmplifierMode, Machine};
use taut::mechanism::{Contact, Limit, Mode, Power, State};
use taut::signal::Signal;
use taut::solve::{Ending, Solution, Solver, simulate};
use taut::trajectory::Trajectory;

const STATES: [&str; 6] = ["drive_angle", "drive_speed", "cart_position", "cart_speed", "idler_angle", "idler_speed"];

fn run(machine: &Machine, input: &Signal, until: f64, every: f64) -> Solution {
    let experiment = Experiment { every, ..common::experiment(input.clone(), until) };
    let solution = simulate(machine, &experiment, Solver::Exact).unwrap();
    assert_eq!(solution.outcome.ending, Ending::Complete);
    solution
}

fn state(trajectory: &Trajectory, row: usize) -> State {
    let get = |name: &str| trajectory.get(name).unwrap()[row];
    let mut state = State::default();
    state.position[..3].copy_from_slice(&[get("drive_angle"), get("cart_position"), get("idler_angle")]);
    state.speed[..3].copy_from_slice(&[get("drive_speed"), get("cart_speed"), get("idler_speed")]);
    state.current[0] = get("motor_current");
    state
}

fn motion(code: f64) -> Motion {
    match code as i8 {
        -1 => Motion::Backward,
        0 => Motion::Stuck,
        1 => Motion::Forward,
        _ => Motion::Free,
    }
}

/// The largest excursion of any of the states, to measure differences against: m or rad, and per second.
fn extents(trajectory: &Trajectory) -> [f64; 2] {
    let largest = |names: [&str; 3]| {
        names
            .iter()
            .flat_map(|name| trajectory.get(name).unwrap())
            .fold(1e-12, |largest: f64, value| largest.max(value.abs()))
    };
    [largest([STATES[0], STATES[2], STATES[4]]), largest([STATES[1], STATES[3], STATES[5]])]
}

proptest! {
    #![proptest_config(random::cases(1000))]

    /// The energy that comes in goes into heat or is stored, over every interval without an event: by quadrature of
    /// the powers along the computed motion, so that it is the motion that is tested.
    #[test]
    fn power_is_balanced(machine in random::machine(Dry::Any), input in random::input()) {
        let mechanism = machine.mechanism();
        // Boole's rule over eight samples; the fastest swing of these stages is resolved many times over.
        let motor = &machine.drives[0].motor;
        let kn2 = motor.torque_constant * motor.back_emf_constant * motor.gear_ratio.powi(2);
        let inertia = machine.drive_pulley.inertia;
        let fastest = match motor.inductance {
            0.0 => kn2 / (motor.resistance * inertia),
            inductance => motor.resistance / inductance + (kn2 / (inductance * inertia)).sqrt(),
        };
        let every = f64::min(2e-6, 0.01 / fastest);
        let solution = run(&machine, &input, 2000.0 * every, every);
        let trajectory = &solution.trajectory;
        let (time, gain) = (trajectory.get("time").unwrap(), machine.drives[0].amplifier.gain);
        let input_at = |row: usize| match machine.drives[0].amplifier.mode {
            AmplifierMode::Voltage => trajectory.get("voltage").unwrap()[row] / gain,
            AmplifierMode::Current => trajectory.get("motor_current").unwrap()[row] / gain,
            AmplifierMode::Position => unreachable!("no stepper is drawn"),
        };
        let power = |row: usize| {
            let codes = LABELS.map(|b| trajectory.get(&format!("{}_state", b.key)).unwrap()[row]);
            let mode = |positive| Mode::new(codes.map(motion)).with_torque(positive);
            let state = state(trajectory, row);
            // The sign of the gear's torque is the one that is consistent with itself.
            let both = [true, false].map(|positive| mechanism.power(mode(positive), &state, &[input_at(row), 0.0, 0.0]));
            let loss = |p: &Power| p.gear;
            let power = if loss(&both[0]) >= 0.0 { both[0] } else { both[1] };
            prop_assert!(power.imbalance().abs() <= 1e-9 * power.scale().max(1e-12), "{power:?}");
            prop_assert!(power.gear >= -1e-12 * power.scale(), "the gear adds power: {power:?}");
            prop_assert!(power.friction.iter().all(|&f| f >= 0.0), "friction adds power: {power:?}");
            prop_assert!(power.spring.iter().all(|&s| s >= 0.0) && power.copper >= 0.0);
            Ok((power.stored, power.scale()))
        };
        let disturbed = |from: f64, to: f64| {
            solution.outcome.events.iter().any(|e| e.time >= from - every && e.time <= to + every)
        };
        for first in (0..trajectory.len() - 9).step_by(160) {
            let last = first + 8;
            let seam = input.piece(time[first]).end;
            if disturbed(time[first], time[last]) || (machine.drives[0].motor.gear_efficiency < 1.0) || seam < time[last] + every {
                continue;
            }
            let mut integral = 0.0;
            let mut scale: f64 = 0.0;
            // Boole's rule on two groups of four intervals
            for (k, weight) in [7.0, 32.0, 12.0, 32.0, 14.0, 32.0, 12.0, 32.0, 7.0].iter().enumerate() {
                let (stored, size) = power(first + k)?;
                integral += weight * stored * every * 2.0 / 45.0;
                scale = scale.max(size);
            }
            let change = mechanism.energy(&state(trajectory, last)) - mechanism.energy(&state(trajectory, first));
            let energy = mechanism.energy(&state(trajectory, last));
            prop_assert!(
                (change - integral).abs() <= 1e-9 * (scale * 8.0 * every) + 1e-13 * energy,
                "energy changed by {change:e}, the powers say {integral:e}, of {energy:e} (scale {:e})", scale * 8.0 * every
            );
        }
    }

    /// The same balance at every row with limits, backlash, slack spans and end stops; limits hold to the last bit, and
    /// what is slack or apart carries nothing.
    #[test]
    fn every_element_keeps_the_balance(machine in random::lined(Dry::Any), input in random::input()) {
        let mechanism = machine.mechanism();
        let solution = run(&machine, &input, 0.2, 1e-3);
        let trajectory = &solution.trajectory;
        for row in 0..trajectory.len() {
            let at = |name: &str| trajectory.get(name).map(|values| values[row]);
            let mut state = state(trajectory, row);
            state.position[3] = at("rotor_angle").unwrap_or(0.0);
            state.speed[3] = at("rotor_speed").unwrap_or(0.0);
            let (voltage, current) = (at("voltage").unwrap(), at("motor_current").unwrap());
            let limit = |value: f64, limit: Option<f64>| match limit {
                Some(limit) if value >= limit => Limit::High,
                Some(limit) if value <= -limit => Limit::Low,
                _ => Limit::Inside,
            };
            let side = |value: f64| match value {
                v if v > 0.0 => Contact::High,
                v if v < 0.0 => Contact::Low,
                _ => Contact::Apart,
            };
            let amplifier = &machine.drives[0].amplifier;
            let command = at("input").map_or(voltage, |input| amplifier.gain * input);
            let commanded = |bound| limit(command, bound);
            let (voltage_mode, current_mode) = match amplifier.mode {
                AmplifierMode::Voltage => (commanded(amplifier.voltage_limit), limit(current, amplifier.current_limit)),
                AmplifierMode::Current => (limit(voltage, amplifier.voltage_limit), commanded(amplifier.current_limit)),
                AmplifierMode::Position => unreachable!("no stepper is drawn"),
            };
            let mut mode = Mode::new(LABELS.map(|b| motion(at(&format!("{}_state", b.key)).unwrap())));
            for (span, slack) in mode.slack.iter_mut().enumerate().take(SPANS) {
                *slack = at(&format!("span{}_slack", span + 1)) == Some(1.0);
            }
            if machine.drives[0].motor.gear_play.is_some() {
                mode.contact[SPANS] = side(at("gear_state").unwrap_or(0.0));
                // A gear with losses holds a rotor that does not turn.
                if machine.drives[0].motor.gear_efficiency < 1.0 {
                    mode.motion[ROTOR] = motion(state.speed[ROTOR].partial_cmp(&0.0).map_or(0.0, |way| f64::from(way as i8)));
                }
            }
            mode.contact[mechanism.springs.len() - 1] = side(-at("stop_force").unwrap_or(0.0));
            (mode.drive[0].voltage, mode.drive[0].current) = (voltage_mode, current_mode);
            prop_assert!(amplifier.voltage_limit.is_none_or(|limit| voltage.abs() <= limit), "{voltage:e} V");
            prop_assert!(amplifier.current_limit.is_none_or(|limit| {
                amplifier.bandwidth.is_some() && amplifier.mode == AmplifierMode::Current || current.abs() <= limit
            }), "{current:e} A");
            let pretension = machine.belt.pretension.unwrap_or(0.0);
            for (span, slack) in (1..=3).zip(mode.slack) {
                let force = at(&format!("span{span}_force")).unwrap();
                if slack {
                    prop_assert!(force == -pretension, "span {span} is slack and carries {:e} N", force + pretension);
                }
                prop_assert!(
                    machine.belt.pretension.is_none() || force >= -pretension * (1.0 + 1e-12) - 1e-9,
                    "span {span} pushes: {force:e} N"
                );
            }
            if let (Some(0.0), Some(torque)) = (at("gear_state"), at("gear_torque"))
                && machine.drives[0].motor.gear_play.is_some_and(|play| play.backlash > 0.0)
            {
                prop_assert!(torque == 0.0);
            }
            let both = [true, false]
                .map(|positive| mechanism.power(mode.with_torque(positive), &state, &[command / amplifier.gain, 0.0, 0.0]));
            let power = if both[0].gear >= 0.0 { both[0] } else { both[1] };
            // What a spring at its very end stores is known to the rounding of where it is.
            prop_assert!(power.imbalance().abs() <= 1e-8 * power.scale().max(1e-6), "row {row}: {power:?}\n{mode:?}");
            prop_assert!(power.gear >= -1e-9 * power.scale().max(1e-9), "the gear adds power: {power:?}");
            prop_assert!(power.spring.iter().all(|&s| s >= -1e-9 * power.scale().max(1e-9)), "springs add power: {power:?}");
            prop_assert!(power.friction.iter().all(|&f| f >= -1e-12 * power.scale()), "friction adds power: {power:?}");
        }
    }

    /// u → −u turns the motion around, bit for bit.
    #[test]
    fn the_mirror_image_moves_as_the_image(
        machine in prop_oneof![random::machine(Dry::Symmetric).boxed(), random::lined(Dry::Symmetric).boxed()],
        input in random::input()
    ) {
        let there = run(&machine, &input, 0.3, 1e-3);
        let back = run(&machine, &random::mirrored(&input), 0.3, 1e-3);
        for name in STATES {
            let (a, b) = (there.trajectory.get(name).unwrap(), back.trajectory.get(name).unwrap());
            for (a, b) in a.iter().zip(b) {
                prop_assert!(*a == -b, "{name}: {a:e} and {b:e}");
            }
        }
        prop_assert_eq!(there.outcome.events.len(), back.outcome.events.len());
        for (a, b) in there.outcome.events.iter().zip(&back.outcome.events) {
            prop_assert!(a.time == b.time && a.load == -b.load && a.part == b.part, "{a:?} and {b:?}");
        }
    }

    /// Rows more or less often: the same motion. (Where a load only just reaches its limit, the moment of the event is
    /// hardly determined, the motion is; moments are compared on given machines in `reference.rs` and
    /// `authorities.rs`.)
    #[test]
    fn the_output_interval_changes_nothing(
        machine in prop_oneof![random::machine(Dry::Any).boxed(), random::lined(Dry::Any).boxed()],
        input in random::input()
    ) {
        // Flanks and spans that rattle undamped are chaotic: an error of the last bit grows tenfold every few impacts.
        let until = if random::rattles(&machine) { 0.06 } else { 0.3 };
        let coarse = run(&machine, &input, until, 0.01);
        let fine = run(&machine, &input, until, 0.01 / 16.0);
        let [length, speed] = extents(&fine.trajectory);
        for name in STATES {
            let tolerance = 1e-9 * if name.ends_with("speed") { speed } else { length };
            for (row, a) in coarse.trajectory.get(name).unwrap().iter().enumerate() {
                let b = fine.trajectory.get(name).unwrap()[row * 16];
                prop_assert!((a - b).abs() <= tolerance, "{name} at row {row}: {a:e} and {b:e}");
            }
        }
    }

    /// Stiffness, inertia, mass, friction and torque constant by one factor: the same motion.
    #[test]
    fn scaling_all_forces_changes_nothing(machine in random::machine(Dry::Any), input in random::input(), factor in 0.1..10.0_f64) {
        let mut scaled = machine.clone();
        let side = |s: &mut taut::friction::Side| {
            s.viscous *= factor;
            s.coulomb *= factor;
            s.breakaway *= factor;
        };
        for friction in [&mut scaled.drive_pulley.friction, &mut scaled.cart.friction, &mut scaled.idler_pulley.friction] {
            side(&mut friction.forward);
            side(&mut friction.backward);
        }
        scaled.belt.stiffness.iter_mut().chain(&mut scaled.belt.damping).for_each(|k| *k *= factor);
        scaled.drive_pulley.inertia *= factor;
        scaled.idler_pulley.inertia *= factor;
        scaled.drives[0].motor.rotor_inertia *= factor;
        scaled.cart.mass *= factor;
        scaled.drives[0].motor.torque_constant *= factor;
        let (a, b) = (run(&machine, &input, 0.3, 1e-3), run(&scaled, &input, 0.3, 1e-3));
        let [length, speed] = extents(&a.trajectory);
        for name in STATES {
            let tolerance = 1e-8 * if name.ends_with("speed") { speed } else { length };
            for (a, b) in a.trajectory.get(name).unwrap().iter().zip(b.trajectory.get(name).unwrap()) {
                prop_assert!((a - b).abs() <= tolerance, "{name}: {a:e} and {b:e}");
            }
        }
    }

    /// A load inside breakaway moves nothing by one bit, for ever.
    #[test]
    fn at_rest_nothing_moves(machine in random::machine(Dry::Any), share in -0.999..0.999_f64, until in random::decades(1e-3, 1e6)) {
        let mut machine = machine;
        let law = &mut machine.drive_pulley.friction;
        law.forward.coulomb = law.forward.coulomb.max(1e-3);
        law.backward.coulomb = law.backward.coulomb.max(1e-3);
        law.forward.breakaway = law.forward.breakaway.max(law.forward.coulomb);
        law.backward.breakaway = law.backward.breakaway.max(law.backward.coulomb);
        // The input that a forward (or backward) load just inside breakaway needs; a lossy gear only holds more.
        let breakaway = if share > 0.0 { law.forward.breakaway } else { law.backward.breakaway };
        let torque_per_unit = machine.drives[0].motor.torque_constant * machine.drives[0].motor.gear_ratio * machine.drives[0].amplifier.gain;
        let value = share * breakaway / torque_per_unit
            * if machine.drives[0].amplifier.mode == AmplifierMode::Voltage { machine.drives[0].motor.resistance } else { 1.0 };
        let solution = run(&machine, &Signal::Step { value, at: 0.0 }, until, until / 50.0);
        prop_assert!(solution.outcome.events.is_empty(), "{:?}", solution.outcome.events);
        for name in STATES {
            prop_assert!(solution.trajectory.get(name).unwrap().iter().all(|&v| v == 0.0), "{name}");
        }
    }

    /// Nothing coming in, the energy never grows.
    #[test]
    fn energy_decays_by_itself(machine in random::machine(Dry::Any), speeds in [-20.0..20.0_f64, -0.4..0.4, -20.0..20.0], offset in -1e-4..1e-4_f64) {
        // A motor whose two constants differ is no passive machine.
        let mut machine = machine;
        machine.drives[0].motor.back_emf_constant = machine.drives[0].motor.torque_constant;
        let mechanism = machine.mechanism();
        let mut initial = State::default();
        initial.position[CART] = offset;
        for (body, speed) in [DRIVE, CART, IDLER].into_iter().zip(speeds) {
            initial.speed[body] = speed;
        }
        let experiment =
            Experiment { name: "law".into(), inputs: vec![Signal::Step { value: 0.0, at: 0.0 }], until: 0.3, every: 1e-3, initial, log: None };
        let solution = simulate(&machine, &experiment, Solver::Exact).unwrap();
        let first = mechanism.energy(&state(&solution.trajectory, 0));
        let mut before = f64::INFINITY;
        for row in 0..solution.trajectory.len() {
            let energy = mechanism.energy(&state(&solution.trajectory, row));
            prop_assert!(energy <= before + 1e-12 * first, "row {row}: {before:e} J, then {energy:e} J");
            before = energy;
        }
    }
}
