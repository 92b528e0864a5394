//! A machine stepped from outside goes where it goes in one run, however it is stepped, and so does a copy of it.

use crate::common;
use common::random::{self, Dry};
use proptest::prelude::*;

use taut::case::Case;
use taut::machine::Machine;
use taut::mechanism::{Mechanism, State};
use taut::signal::Signal;
use taut::solve::{Course, Detail, Event, Flow, Simulator, Solver, simulate, stream_mechanism};
use taut::trajectory::Trajectory;

const UNTIL: f64 = 0.2;

/// The last row of one run, by the names of its columns, and its events.
fn in_one_go(stage: &Machine, input: &Signal, solver: Solver) -> (Vec<(String, f64)>, Vec<Event>) {
    let experiment = common::experiment(input.clone(), UNTIL);
    let solution = simulate(stage, &experiment, solver).unwrap();
    let last = |column: &taut::trajectory::Column| (column.name.clone(), *column.values.last().unwrap());
    (solution.trajectory.columns.iter().map(last).collect(), solution.outcome.events)
}

/// Steps a machine to the end by these shares of the time, each piece of its inputs as it begins. With `copies`, now
/// and then a copy goes on in its place, after the machine itself has gone astray.
fn stepped(
    mut machine: Simulator,
    inputs: &[Signal],
    until: f64,
    shares: &[f64],
    copies: bool,
) -> (Simulator, Vec<Event>) {
    let mut times: Vec<f64> = shares.iter().map(|share| share * until).collect();
    times.push(until);
    for input in inputs {
        let mut seam = input.piece(0.0).end;
        while seam < until {
            times.push(seam);
            seam = input.piece(seam).end;
        }
    }
    times.sort_by(f64::total_cmp);
    let mut events = Vec::new();
    let set = |machine: &mut Simulator| {
        for (drive, input) in inputs.iter().enumerate() {
            machine.set_input(drive, &input.piece(machine.time())).unwrap();
        }
    };
    set(&mut machine);
    for (k, time) in times.into_iter().enumerate() {
        if copies && k % 3 == 1 {
            let saved = machine.clone();
            machine.set_input(0, &Signal::Step { value: 7.0, at: 0.0 }.piece(machine.time())).unwrap();
            machine.advance(machine.time() + 0.03, &mut Vec::new()).unwrap();
            machine = saved;
        }
        machine.advance(time, &mut events).unwrap();
        // At a seam the next piece begins.
        let begins = |input: &Signal| {
            let mut seam = 0.0;
            while seam < time {
                seam = input.piece(seam).end;
            }
            seam == time
        };
        if time < until && inputs.iter().any(begins) {
            set(&mut machine);
        }
    }
    (machine, events)
}

fn same(a: &[Event], b: &[Event], tolerance: f64) -> Result<(), TestCaseError> {
    let told = |e: &Event| (e.part.key(), e.from.code(), e.to.code());
    prop_assert_eq!(a.iter().map(told).collect::<Vec<_>>(), b.iter().map(told).collect::<Vec<_>>());
    for (a, b) in a.iter().zip(b) {
        prop_assert!((a.time - b.time).abs() <= tolerance, "{a:?}\n{b:?}");
    }
    Ok(())
}

fn shares() -> impl Strategy<Value = Vec<f64>> {
    // Whole intervals, halves, and anything.
    let share = prop_oneof![
        (1..200_u32).prop_map(|k| f64::from(k) / 200.0),
        (1..800_u32).prop_map(|k| f64::from(k) / 800.0),
        0.0..1.0_f64
    ];
    prop::collection::vec(share, 1..40)
}

/// Largest difference of the columns, angles and lengths each in its unit.
fn apart(machine: &Simulator, last: &[(String, f64)]) -> f64 {
    let mut outputs = vec![0.0; machine.columns().len()];
    machine.outputs(&mut outputs);
    let mut worst: f64 = 0.0;
    for (heading, have) in machine.columns().iter().zip(outputs) {
        let (_, want) = last.iter().find(|(name, _)| *name == heading.name).unwrap();
        if heading.name.ends_with("angle") || heading.name.ends_with("position") {
            worst = worst.max((have - want).abs());
        }
    }
    worst
}

proptest! {
    #![proptest_config(random::cases(300))]

    #[test]
    fn any_steps_lead_to_the_same_end(
        stage in random::machine(Dry::Any), input in random::input(), shares in shares(), copies in any::<bool>(),
    ) {
        let (last, events) = in_one_go(&stage, &input, Solver::Exact);
        let machine = Simulator::new(&stage, Solver::Exact).unwrap();
        let (machine, stepped) = stepped(machine, &[input], UNTIL, &shares, copies);
        prop_assert!((machine.time() - UNTIL).abs() < 1e-15);
        same(&stepped, &events, 1e-10)?;
        // Angles of up to some radians on a radius of some centimetres.
        prop_assert!(apart(&machine, &last) < 1e-11, "{}", apart(&machine, &last));
    }
}

/// The template's stage, in lengths: within 1e-12 m of one go; with forces that are lines, too, whose pieces a copy and
/// what is saved remember.
#[test]
fn a_thousand_patterns_of_steps_end_within_a_picometre() {
    let case = taut::case::Case::from_text("axis.toml", taut::case::TEMPLATE).unwrap();
    let lines = [
        "cart.force_along=[[-0.01, 0.5], [0.0, 0.0], [0.005, -1.0], [0.02, 0.4]]",
        "cart.force_by_speed=[[-0.2, 0.4], [-0.05, 0.0], [0.1, -0.6], [0.2, 0.1]]",
    ];
    let lined = taut::case::Case::from_text_with("axis.toml", taut::case::TEMPLATE, &lines).unwrap();
    let input = Signal::Square { amplitude: 8.0, frequency: 13.0, duty: 0.4 };
    for stage in [&case.machine, &lined.machine] {
        steps_end_where_one_go_does(stage, &input);
    }
}

fn steps_end_where_one_go_does(stage: &Machine, input: &Signal) {
    let (last, events) = in_one_go(stage, input, Solver::Exact);
    assert!(events.len() > 10);
    let mut runner = proptest::test_runner::TestRunner::new(random::cases(1000));
    runner
        .run(&(shares(), any::<bool>()), |(shares, copies)| {
            let machine = Simulator::new(stage, Solver::Exact).unwrap();
            let (machine, stepped) = stepped(machine, std::slice::from_ref(input), UNTIL, &shares, copies);
            same(&stepped, &events, 1e-11)?;
            let at = |name: &str| last.iter().find(|(column, _)| column == name).unwrap().1;
            let state = machine.state();
            let off = [
                stage.pulley_radius * (state.position[0] - at("drive_angle")),
                state.position[1] - at("cart_position"),
                stage.pulley_radius * (state.position[2] - at("idler_angle")),
            ];
            prop_assert!(off.iter().all(|off| off.abs() < 1e-12), "{off:?}");
            Ok(())
        })
        .unwrap();
}

/// The outputs of a stopped machine are the last row of a run, friction and forces too.
#[test]
fn outputs_are_the_row_of_a_run() {
    for name in ["stages/printer-axis/printer-axis.toml", "stages/laser-gantry/laser-gantry.toml"] {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        let case = taut::case::Case::read(path).unwrap();
        let input = Signal::Pulse { value: 2.0, duration: 0.05, at: 0.0 };
        let solver = Solver::for_machine(&case.machine);
        let (last, _) = in_one_go(&case.machine, &input, solver);
        let (machine, _) = stepped(Simulator::new(&case.machine, solver).unwrap(), &[input], UNTIL, &[0.1, 0.37], true);
        let mut outputs = vec![0.0; machine.columns().len()];
        machine.outputs(&mut outputs);
        for (heading, have) in machine.columns().iter().zip(outputs) {
            let (_, want) = last.iter().find(|(column, _)| *column == heading.name).unwrap();
            assert!((have - want).abs() <= 1e-7 * want.abs().max(1e-3), "{name}: {}: {have} {want}", heading.name);
        }
    }
}

/// The outputs at the instant of a jump are those behind it: a limit that it meets is met already.
#[test]
fn outputs_after_a_jump_are_those_that_follow() {
    let mut limited = common::table4();
    let amplifier = &mut limited.drives[0].amplifier;
    (amplifier.mode, amplifier.voltage_limit) = (taut::machine::AmplifierMode::Current, Some(2.0));
    let jump = Signal::Step { value: 20.0, at: 0.0 };
    for solver in [Solver::Exact, Solver::GENERAL] {
        let rows = simulate(&limited, &common::experiment(jump.clone(), UNTIL), solver).unwrap().trajectory;
        let mut machine = Simulator::new(&limited, solver).unwrap();
        machine.set_input(0, &jump.piece(0.0)).unwrap();
        machine.advance(0.0, &mut Vec::new()).unwrap();
        let mut outputs = vec![0.0; machine.columns().len()];
        machine.outputs(&mut outputs);
        for (heading, have) in machine.columns().iter().zip(outputs) {
            let want = rows.get(&heading.name).unwrap()[0];
            assert!((have - want).abs() <= 1e-12 * want.abs(), "{solver:?}, {}: {have} {want}", heading.name);
        }
    }
}

/// The general solver within what it says of itself, and a gantry by both.
#[test]
fn the_general_solver_and_gantries_step_too() {
    let case = taut::case::Case::from_text("axis.toml", taut::case::TEMPLATE).unwrap();
    let input = Signal::Sine { amplitude: 8.0, frequency: 5.0, phase: 0.3, offset: 0.0 };
    for solver in [Solver::Exact, Solver::GENERAL] {
        let (last, events) = in_one_go(&case.machine, &input, solver);
        let machine = Simulator::new(&case.machine, solver).unwrap();
        let (machine, own) = stepped(machine, std::slice::from_ref(&input), UNTIL, &[0.03, 0.5, 0.51, 0.777], true);
        same(&own, &events, 1e-7).unwrap();
        assert!(apart(&machine, &last) < if solver == Solver::Exact { 1e-11 } else { 1e-7 });
    }
    let file: serde_json::Value = serde_json::from_str(include_str!("authorities/gantry.json")).unwrap();
    for told in file["cases"].as_array().unwrap().iter().step_by(7) {
        let case = Case::from_text_with("gantry.toml", told["case"].as_str().unwrap(), &[]).unwrap();
        let (mechanism, experiment) = (case.machine.mechanism(), &case.experiments[0]);
        let course = Course {
            inputs: experiment.inputs.to_vec(),
            start: experiment.initial,
            until: experiment.until,
            every: experiment.every,
        };
        let (state, events) = whole(&mechanism, &course);
        let machine = Simulator::of_mechanism(&mechanism, &course.start, Solver::Exact, 1e-3).unwrap();
        let (machine, own) = stepped(machine, &course.inputs, course.until, &[0.1, 0.123, 0.5, 0.9], true);
        same(&own, &events, 1e-11).unwrap();
        let off = (0..4).map(|b| (machine.state().position[b] - state.position[b]).abs()).fold(0.0, f64::max);
        assert!(off < 1e-11, "{}: {off:e}", told["name"]);
    }
}

/// Bodies that gain or lose dry friction while they move go on as in a machine that begins there with it.
#[test]
fn dry_friction_comes_and_goes_while_a_machine_runs() {
    let case = Case::from_text("axis.toml", taut::case::TEMPLATE).unwrap();
    let (dry, smooth) = (case.machine.mechanism(), common::without_dry_friction(case.machine.clone()).mechanism());
    let advance = |machine: &mut Simulator, volts: f64, length: f64| {
        machine.set_input(0, &Signal::Step { value: volts, at: 0.0 }.piece(machine.time())).unwrap();
        machine.advance(machine.time() + length, &mut Vec::new()).unwrap();
    };
    for solver in [Solver::Exact, Solver::GENERAL] {
        for (first, then) in [(&dry, &smooth), (&smooth, &dry)] {
            for volts in [5.0, -8.0] {
                let mut machine = Simulator::of_mechanism(first, &State::default(), solver, 1e-3).unwrap();
                advance(&mut machine, volts, 0.05);
                machine.replace(then);
                let mut fresh = Simulator::of_mechanism(then, &machine.state(), solver, 1e-3).unwrap();
                advance(&mut machine, 0.0, 0.2);
                advance(&mut fresh, 0.0, 0.2);
                let (one, other) = (machine.state(), fresh.state());
                for body in 0..3 {
                    let off = (one.position[body] - other.position[body]).abs();
                    assert!(off < 1e-8, "{solver:?}, {volts} V: body {body} is off by {off:e}");
                }
            }
        }
    }
}

fn whole(mechanism: &Mechanism, course: &Course) -> (State, Vec<Event>) {
    let mut last = State::default();
    let sink = &mut |rows: &Trajectory| {
        for (body, name) in ["left_angle", "right_angle", "bridge_position", "cart_position"].into_iter().enumerate() {
            last.position[body] = *rows.get(name).unwrap().last().unwrap();
        }
        Flow::Continue
    };
    let outcome = stream_mechanism(mechanism, course, Solver::Exact, (Detail::Full, None), sink).unwrap();
    (last, outcome.events)
}

#[test]
fn what_cannot_be_stepped_is_told() {
    let case = taut::case::Case::from_text("axis.toml", taut::case::TEMPLATE).unwrap();
    let mut machine = Simulator::new(&case.machine, Solver::Exact).unwrap();
    let held = Signal::Step { value: 1.0, at: 0.0 }.piece(0.0);
    assert!(machine.set_input(1, &held).unwrap_err().to_string().contains("there is no drive 1"));
    let mut late = held;
    late.start = 1.0;
    assert!(machine.set_input(0, &late).is_err());
    late = held;
    late.coefficients[0] = f64::NAN;
    assert!(machine.set_input(0, &late).is_err());
    // Back in time it stays where it is.
    machine.advance(0.1, &mut Vec::new()).unwrap();
    machine.advance(0.05, &mut Vec::new()).unwrap();
    assert_eq!(machine.time(), 0.1);
    assert!(Simulator::of_mechanism(&case.machine.mechanism(), &State::default(), Solver::Exact, 0.0).is_err());
    fn is_send<T: Send + Clone>() {}
    is_send::<Simulator>();
}

/// A run that is finished before its end said that it was complete, at its end.
#[test]
fn a_run_that_is_finished_early_was_called_complete() {
    let case = taut::case::Case::from_text("axis.toml", taut::case::TEMPLATE).unwrap();
    let experiment = &case.experiments[0];
    for solver in [Solver::Exact, Solver::GENERAL] {
        let mut rows = 0;
        let sink = &mut |block: &Trajectory| {
            rows += block.len();
            Flow::Continue
        };
        let mut run = taut::solve::Run::new(&case.machine, experiment, solver, Detail::Full, None, sink).unwrap();
        assert!(run.hold(&[5.0], 0.1) && run.time() == 0.1);
        let outcome = run.finish();
        assert_eq!(outcome.ending, taut::solve::Ending::Interrupted { time: 0.1 }, "{solver:?}");
        assert!(rows <= 101, "{rows} rows");
    }
}
