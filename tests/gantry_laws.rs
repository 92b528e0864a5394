//! Laws that hold for any gantry, on random ones.

use crate::common;
use proptest::prelude::*;
use taut::case::{Case, Experiment};
use taut::friction::Friction;
use taut::linear::{Natural, Operation, Root, System};
use taut::machine::{Belt, DriveUnit, Machine, MachineKind, Pulley, Slide, Spans};
use taut::mechanism::{Amplifier, AmplifierMode, Motor, State};
use taut::signal::Signal;
use taut::solve::{Ending, Solution, Solver, simulate};

/// A motor without gear play, and its amplifier.
fn motor() -> impl Strategy<Value = Motor> {
    (0.01..0.1_f64, 0.3..3.0_f64, prop_oneof![Just(0.0), 1e-4..2e-3_f64], 0.0..1e-5_f64, 1.0..6.0_f64).prop_map(
        |(constant, resistance, inductance, rotor_inertia, gear_ratio)| Motor {
            inductance,
            rotor_inertia,
            gear_ratio,
            ..Motor::brushed(constant, resistance)
        },
    )
}

/// Friction of about this size, the same both ways.
fn dry(viscous: f64, coulomb: f64) -> impl Strategy<Value = Friction> {
    (0.0..viscous, 0.0..coulomb, 1.0..1.5_f64)
        .prop_map(|(viscous, coulomb, over)| Friction::with_breakaway(viscous, coulomb, over * coulomb))
}

fn slide(mass: f64) -> impl Strategy<Value = Slide> {
    (0.3 * mass..3.0 * mass, dry(30.0, 1.0)).prop_map(|(mass, friction)| Slide::new(mass, friction))
}

/// Gantries of any kind with one motor for all drives.
fn gantry() -> impl Strategy<Value = Machine> {
    let stiffness = || prop::collection::vec(2e4..3e5_f64, 6);
    let damping = prop_oneof![Just(vec![0.0; 6]), prop::collection::vec(0.0..50.0_f64, 6)];
    let kinds = prop::sample::select(vec![MachineKind::HFrame, MachineKind::CoreXy, MachineKind::DualBelt]);
    let pulley = (1e-5..2e-4_f64, dry(2e-3, 0.02)).prop_map(|(inertia, friction)| Pulley { inertia, friction });
    (kinds, motor(), 0.005..0.03_f64, pulley, slide(0.8), slide(0.4), stiffness(), damping).prop_map(
        |(kind, motor, pulley_radius, drive_pulley, bridge, cart, mut stiffness, mut damping)| {
            stiffness.truncate(kind.geometry().spans.len());
            damping.truncate(kind.geometry().spans.len());
            let (stiffness, damping): (Spans, Spans) = (stiffness.into_iter().collect(), damping.into_iter().collect());
            Machine {
                kind,
                drives: vec![
                    DriveUnit { motor, amplifier: Amplifier::ideal(AmplifierMode::Voltage, 1.0) };
                    kind.geometry().drives.len()
                ],
                pulley_radius,
                drive_pulley,
                idler_pulley: Pulley { inertia: 0.0, friction: Friction::default() },
                bridge: Some(bridge),
                yaw: None,
                cart,
                belt: Belt::given(stiffness, damping),
                encoder: None,
                scale: None,
            }
        },
    )
}

fn inputs() -> impl Strategy<Value = [Signal; 2]> {
    let pulse = || {
        (-12.0..12.0_f64, 0.02..0.1_f64, 0.0..0.05_f64).prop_map(|(value, duration, at)| Signal::Pulse {
            value,
            duration,
            at,
        })
    };
    (pulse(), pulse()).prop_map(|(left, right)| [left, right])
}

fn follow(gantry: &Machine, inputs: &[Signal; 2]) -> Solution {
    // A third drive, which moves the cart alone, gets half of the second one's input.
    let third = || {
        let Signal::Pulse { value, duration, at } = inputs[1] else { unreachable!("only pulses are drawn") };
        Signal::Pulse { value: 0.5 * value, duration, at }
    };
    let inputs = inputs.iter().cloned().chain([third()]).take(gantry.drives.len()).collect();
    let solution = simulate(gantry, &experiment(inputs, 0.15), Solver::Exact).unwrap();
    assert_eq!(solution.outcome.ending, Ending::Complete);
    solution
}

/// From rest, with a row every millisecond.
fn experiment(inputs: Vec<Signal>, until: f64) -> Experiment {
    Experiment { inputs, ..common::experiment(Signal::Step { value: 0.0, at: 0.0 }, until) }
}

fn negative(signal: &Signal) -> Signal {
    let Signal::Pulse { value, duration, at } = *signal else { unreachable!("only pulses are drawn") };
    Signal::Pulse { value: -value, duration, at }
}

/// Every value of a column of one run is `factor` times that of a column of the other.
fn proportional(a: (&Solution, &str), b: (&Solution, &str), factor: f64, tolerance: f64) -> Result<(), TestCaseError> {
    let (a, b) = (a.0.trajectory.get(a.1).unwrap(), b.0.trajectory.get(b.1).unwrap());
    prop_assert_eq!(a.len(), b.len());
    for (row, (a, b)) in a.iter().zip(b).enumerate() {
        prop_assert!((a - factor * b).abs() <= tolerance, "row {row}: {a} and {b}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(common::random::cases(200))]

    /// A belt is closed: what one span gains the others lose; and a motion that keeps all lengths stores nothing.
    #[test]
    fn belts_are_closed(gantry in gantry(), x in -0.3..0.3_f64, y in -0.3..0.3_f64) {
        let mechanism = gantry.mechanism();
        let belts: &[&[usize]] = match gantry.kind {
            MachineKind::HFrame => &[&[0, 1, 2]],
            MachineKind::Axis | MachineKind::CoreXy => &[&[0, 1], &[2, 3]],
            MachineKind::DualBelt => &[&[0, 1], &[2, 3], &[4, 5]],
        };
        for belt in belts {
            let mut sum = [0.0; 5];
            for span in *belt {
                mechanism.springs[*span].arms.iter().for_each(|(body, arm)| sum[*body] += arm);
            }
            prop_assert_eq!(sum, [0.0; 5]);
        }
        let mut state = gantry.without_strain(&[x, y], &[]);
        let stiffest = gantry.belt.stiffness.iter().fold(0.0, |most: f64, k| most.max(*k));
        prop_assert!(mechanism.energy(&state) <= stiffest * (1e-15_f64).powi(2));
        state.position[0] += 1e-3;
        prop_assert!(mechanism.energy(&state) > 0.0);
    }

    /// Power that comes in goes into heat or is stored, in any state and mode.
    #[test]
    fn power_is_balanced(
        gantry in gantry(), speeds in prop::collection::vec(-2.0..2.0_f64, 5), ways in prop::collection::vec(-1e-4..1e-4_f64, 5),
        volts in prop::collection::vec(-12.0..12.0_f64, 3),
    ) {
        let mechanism = gantry.mechanism();
        let mut state = State::default();
        for body in 0..mechanism.bodies.len() {
            let lever = mechanism.bodies[body].kind.lever();
            (state.position[body], state.speed[body]) = (ways[body] / lever, speeds[body] / lever);
        }
        for (current, drive) in state.current.iter_mut().zip(&mechanism.drives) {
            *current = if drive.has_current_state() { 1.5 } else { 0.0 };
        }
        let power = mechanism.power(mechanism.first_mode(&state), &state, &[volts[0], volts[1], volts[2]]);
        prop_assert!(power.imbalance().abs() <= 1e-12 * power.scale(), "{power:?}");
        prop_assert!(power.friction.iter().chain(&power.spring).all(|&loss| loss >= 0.0), "{power:?}");
    }

    /// Without sticking, a run solves the linear equations, whose exponential another library computes: all final
    /// outputs agree, and the poles are those of the modes.
    #[test]
    fn the_linear_system_is_the_machine(gantry in gantry(), volts in prop::collection::vec(-12.0..12.0_f64, 3)) {
        let volts = &volts[..gantry.drives.len()];
        let mut gantry = gantry;
        let smooth = |friction: Friction| Friction::with_breakaway(friction.forward.viscous, 0.0, 0.0);
        gantry.drive_pulley.friction = smooth(gantry.drive_pulley.friction);
        gantry.cart.friction = smooth(gantry.cart.friction);
        if let Some(bridge) = &mut gantry.bridge {
            bridge.friction = smooth(bridge.friction);
        }
        let system = System::new(&gantry, Operation::default()).unwrap();
        prop_assert_eq!(system.inputs.iter().map(|input| input.name.as_str()).collect::<Vec<_>>(),
            ["left_voltage_command", "right_voltage_command", "cart_voltage_command"][..volts.len()].to_vec());
        let (until, n) = (0.02, system.a.nrows());
        let u = nalgebra::DVector::from_row_slice(volts);
        // d/dt (x, 1) = [A, B u; 0, 0] (x, 1)
        let mut whole = nalgebra::DMatrix::zeros(n + 1, n + 1);
        whole.view_mut((0, 0), (n, n)).copy_from(&system.a);
        whole.view_mut((0, n), (n, 1)).copy_from(&(&system.b * &u));
        let x = (whole * until).exp().view((0, n), (n, 1)).into_owned();
        let y = &system.c * x.column(0) + &system.d * &u;
        let mechanism = gantry.mechanism();
        let inputs = volts.iter().map(|value| Signal::Step { value: *value, at: 0.0 }).collect();
        let experiment = Experiment { every: until / 200.0, ..experiment(inputs, until) };
        let Solution { trajectory: rows, outcome } = simulate(&gantry, &experiment, Solver::Exact).unwrap();
        prop_assert_eq!(outcome.ending, Ending::Complete);
        for (output, y) in system.outputs.iter().zip(y.iter()) {
            let column = rows.get(&output.name).unwrap_or_else(|| panic!("no column {}", output.name));
            let largest = column.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            let last = column[column.len() - 1];
            prop_assert!((last - y).abs() <= 1e-9 * largest.max(1e-9), "{}: {last} and {y}", output.name);
        }
        // Poles: without an inductance those of M, C and K.
        if gantry.drives[0].motor.inductance == 0.0 {
            let natural = Natural::new(&mechanism, &[0.0; 6]).unwrap();
            let fast = |roots: Vec<Root>| roots.into_iter().filter_map(Root::hertz).collect::<Vec<_>>();
            let (a, b) = (fast(Root::from_values(&system.input(0).poles().unwrap())), fast(natural.poles));
            prop_assert_eq!(a.len(), b.len());
            for (a, b) in a.iter().zip(&b) {
                prop_assert!((a - b).abs() <= 1e-9 * b, "{a} Hz and {b} Hz");
            }
        }
    }

    /// u → −u turns the motion around, bit for bit.
    #[test]
    fn mirrored_inputs_mirror_the_motion(gantry in gantry(), inputs in inputs()) {
        let (there, back) = (follow(&gantry, &inputs), follow(&gantry, &inputs.each_ref().map(negative)));
        for column in ["left_angle", "right_angle", "bridge_position", "cart_position", "cart_speed"] {
            proportional((&there, column), (&back, column), -1.0, 0.0)?;
        }
        prop_assert_eq!(there.outcome.events.len(), back.outcome.events.len());
    }

    /// Left and right are each other's mirror: with springs and inputs exchanged, y turns around and x does not.
    #[test]
    fn left_and_right_mirror_each_other(gantry in gantry(), inputs in inputs()) {
        let mut mirrored = gantry.clone();
        let order: &[usize] = match gantry.kind {
            MachineKind::HFrame => &[1, 0, 2],
            MachineKind::Axis | MachineKind::CoreXy => &[2, 3, 0, 1],
            MachineKind::DualBelt => &[2, 3, 0, 1, 4, 5],
        };
        mirrored.belt.stiffness = order.iter().map(|span| gantry.belt.stiffness[*span]).collect();
        mirrored.belt.damping = order.iter().map(|span| gantry.belt.damping[*span]).collect();
        // r φ₁ = −x − y and r φ₂ = x − y: the pulleys of an H-frame turn against each other, those of CoreXY alike.
        let sign = if gantry.kind == MachineKind::HFrame { -1.0 } else { 1.0 };
        let [left, right] = &inputs;
        let exchanged = match gantry.kind {
            MachineKind::HFrame => [negative(right), negative(left)],
            MachineKind::Axis | MachineKind::CoreXy | MachineKind::DualBelt => [right.clone(), left.clone()],
        };
        let (a, b) = (follow(&gantry, &inputs), follow(&mirrored, &exchanged));
        proportional((&a, "bridge_position"), (&b, "bridge_position"), 1.0, 1e-12)?;
        // The cart of a dual belt has a drive of its own, whose input is another one here.
        if gantry.kind != MachineKind::DualBelt {
            proportional((&a, "cart_position"), (&b, "cart_position"), -1.0, 1e-12)?;
        }
        proportional((&a, "left_angle"), (&b, "right_angle"), sign, 1e-10)?;
    }

    /// The bridge of a dual belt, pulled alike on both sides, moves as that of a CoreXY whose motors turn alike does.
    #[test]
    fn a_dual_belt_moves_its_bridge_as_a_core_xy_does(gantry in gantry(), inputs in inputs()) {
        let [k, c] = [gantry.belt.stiffness, gantry.belt.damping].map(|all| [all[0], all[1], all[0], all[1]]);
        let unit = gantry.drives[0];
        let core = Machine { kind: MachineKind::CoreXy, drives: vec![unit; 2], belt: Belt::given(Spans::from(k), Spans::from(c)), ..gantry.clone() };
        let six = |of: [f64; 4]| -> Spans { of.into_iter().chain([of[0], of[1]]).collect() };
        let belt = Belt::given(six(k), six(c));
        let dual = Machine { kind: MachineKind::DualBelt, drives: vec![unit; 3], belt, ..gantry };
        let alike = [inputs[0].clone(), inputs[0].clone()];
        let (a, b) = (follow(&core, &alike), follow(&dual, &alike));
        for column in ["bridge_position", "left_angle", "right_angle"] {
            proportional((&a, column), (&b, column), 1.0, 1e-11)?;
        }
    }

    /// A machine with all its inertias, stiffnesses, frictions and torques ten times as large moves alike.
    #[test]
    fn scaled_machines_move_alike(gantry in gantry(), inputs in inputs()) {
        let mut large = gantry.clone();
        let scale = |value: &mut f64| *value *= 10.0;
        for motor in large.drives.iter_mut().map(|unit| &mut unit.motor) {
            scale(&mut motor.torque_constant);
            scale(&mut motor.rotor_inertia);
        }
        scale(&mut large.drive_pulley.inertia);
        let bridge = large.bridge.as_mut().unwrap();
        scale(&mut bridge.mass);
        scale(&mut large.cart.mass);
        large.belt.stiffness.iter_mut().chain(&mut large.belt.damping).for_each(scale);
        for friction in [&mut large.drive_pulley.friction, &mut bridge.friction, &mut large.cart.friction] {
            for side in [&mut friction.forward, &mut friction.backward] {
                [&mut side.viscous, &mut side.coulomb, &mut side.breakaway].into_iter().for_each(scale);
            }
        }
        let (a, b) = (follow(&gantry, &inputs), follow(&large, &inputs));
        for column in ["bridge_position", "cart_position"] {
            proportional((&a, column), (&b, column), 1.0, 1e-11)?;
        }
        prop_assert_eq!(a.outcome.events.len(), b.outcome.events.len());
    }

    /// x and y of an H-frame are coupled through k_l − k_r alone, where nothing sticks.
    #[test]
    fn equal_spans_do_not_couple(gantry in gantry(), volts in 1.0..12.0_f64) {
        let mut gantry = common::without_dry_friction(Machine { kind: MachineKind::HFrame, ..gantry });
        gantry.drives.truncate(2);
        gantry.belt.stiffness = [1e5, 1e5, 6e4].into();
        gantry.belt.damping = [3.0, 3.0, 1.0].into();
        let step = |value: f64| Signal::Pulse { value, duration: 0.1, at: 0.0 };
        let across = follow(&gantry, &[step(-volts), step(volts)]);
        proportional((&across, "cart_position"), (&across, "cart_position"), 0.0, 1e-12)?;
        prop_assert!(across.trajectory.get("bridge_position").unwrap().last().unwrap().abs() > 1e-4);
        let along = follow(&gantry, &[step(-volts), step(-volts)]);
        proportional((&along, "bridge_position"), (&along, "bridge_position"), 0.0, 1e-12)?;
    }
}

/// The exact solver and the general one agree where both can be asked; spans that follow the cart are taken by the
/// general one.
#[test]
fn spans_that_follow_the_cart_are_as_stiff_as_they_are_long() {
    let text = |belt: &str| {
        format!(
            "kind = \"h-frame\"\n\
             motor = {{ torque_constant = 0.05, back_emf_constant = 0.05, resistance = 1 }}\n\
             drive_pulley = {{ radius = 0.01, inertia = 2e-5 }}\n\
             bridge = {{ mass = 0.8, friction = {{ coulomb = 0.5 }}, travel = {{ min = -0.2, max = 0.2 }} }}\n\
             cart = {{ mass = 0.4, friction = {{ coulomb = 0.3 }}, travel = {{ min = -0.2, max = 0.2 }} }}\n\
             belt = {{ {belt} }}\n\
             [[experiment]]\nname = \"pulse\"\nuntil = 0.3\nevery = 1e-3\n\
             input = {{ left = {{ pulse = -9, for = 0.1 }}, right = {{ pulse = 3, for = 0.1 }} }}\n\
             initial = {{ bridge_position = 0.05 }}\n"
        )
    };
    let read = |belt: &str| Case::from_text_with("frame.toml", &text(belt), &[]).unwrap();
    let make = "modulus = \"8 GPa\", section = \"6 mm^2\", spans = [0.5, 0.6, 1.3]";
    let (fixed, follows) = (read(make), read(&format!("{make}, follows_cart = true")));
    assert!(fixed.machine.mechanism().is_piecewise_linear() && !follows.machine.mechanism().is_piecewise_linear());
    let (exact, general) = (common::complete(&fixed, Solver::Exact), common::complete(&fixed, Solver::GENERAL));
    let apart = |a: &Solution, b: &Solution, column: &str| {
        let pairs = a.trajectory.get(column).unwrap().iter().zip(b.trajectory.get(column).unwrap());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    assert!(apart(&exact, &general, "cart_position") < 1e-9);
    let following = common::complete(&follows, Solver::GENERAL);
    assert!(apart(&exact, &following, "cart_position") > 1e-7);
    // k = E A / l, with l_left + x + y: the force per stretch in every row.
    let [x, y, phi, force] = ["bridge_position", "cart_position", "left_angle", "left_span_force"]
        .map(|c| following.trajectory.get(c).unwrap());
    for row in (0..x.len()).step_by(10) {
        let stiffness = 8e9 * 6e-6 / (0.5 + x[row] + y[row]);
        let stretch = 0.01 * phi[row] + x[row] + y[row];
        assert!((force[row] - stiffness * stretch).abs() < 1e-8, "row {row}: {} {}", force[row], stiffness * stretch);
    }
}
