//! The effect of rounding on a run, and its limits: far from the origin, on stiff belts, at rest on an edge.

use crate::common;
use common::table4;
use taut::case::{Case, Experiment};
use taut::friction::{Friction, Law, Motion, Shape, Side};
use taut::machine::axis::{CART, DRIVE, IDLER, LABELS};
use taut::machine::{Amplifier, AmplifierMode, Machine};
use taut::signal::Signal;
use taut::solve::{Ending, ErrorEstimate, Event, Flow, Solution, Solver, simulate, stream};

fn complete(machine: &Machine, experiment: &Experiment, solver: Solver) -> Solution {
    let solution = simulate(machine, experiment, solver).unwrap();
    assert_eq!(solution.outcome.ending, Ending::Complete);
    solution
}

fn experiment(input: Signal, until: f64, every: f64) -> Experiment {
    Experiment { every, ..common::experiment(input, until) }
}

/// An experiment from rest at `start`, the pulleys turned to where the belt is not strained.
fn from(start: f64, machine: &Machine, input: Signal, until: f64) -> Experiment {
    let initial = machine.at_rest(start);
    Experiment { initial, ..experiment(input, until, 1e-3) }
}

/// Largest difference of r φ₁, x and r φ₃ (m), each counted from where it began.
fn apart(machine: &Machine, a: &Solution, b: &Solution) -> f64 {
    let columns =
        [("drive_angle", machine.pulley_radius), ("cart_position", 1.0), ("idler_angle", machine.pulley_radius)];
    let mut worst: f64 = 0.0;
    for (name, lever) in columns {
        let (a, b) = (a.trajectory.get(name).unwrap(), b.trajectory.get(name).unwrap());
        for (x, y) in a.iter().zip(b) {
            worst = worst.max(lever * ((x - a[0]) - (y - b[0])).abs());
        }
    }
    worst
}

fn bodies(events: &[Event]) -> Vec<(usize, i8, i8)> {
    events.iter().filter_map(|e| Some((e.body()?, e.from.code(), e.to.code()))).collect()
}

// --- far away and stiff ---------------------------------------------------------------------------------------------

/// Forces carried k ε |x|: 1 km from the origin 1 g on 1e8 N/m shook by itself, and events were listed that are none.
#[test]
fn a_start_far_from_the_origin_cost_accuracy() {
    let mut machine = table4();
    machine.belt.stiffness = [1e8, 1e8, 5e7].into();
    machine.cart.mass = 1e-3;
    let input = Signal::Pulse { value: 2.0, duration: 0.05, at: 0.0 };
    let near = complete(&machine, &from(0.0, &machine, input.clone(), 0.2), Solver::Exact);
    for start in [1.0, 1e3, -1e3] {
        let far = complete(&machine, &from(start, &machine, input.clone(), 0.2), Solver::Exact);
        // A position at 1 km is told to 1.1e-13 m.
        let worst = apart(&machine, &near, &far);
        assert!(worst < 1e-9, "{worst:e} m, from {start} m");
        assert_eq!(bodies(&near.outcome.events), bodies(&far.outcome.events), "from {start} m");
        let error = far.outcome.error.unwrap();
        assert!(worst <= error.value && error.is_exact(), "{worst:e} m against a bound of {error:?}");
    }
}

/// k = 1e11 N/m at 1 m was off by 2e-8 m, 1e13 by 1.3e-6 m, and 1e14 gave 25 events that are none.
#[test]
fn stiff_belts_lost_accuracy_far_from_the_origin() {
    for stiffness in [1e11, 1e13] {
        let mut machine = table4();
        machine.belt.stiffness = [stiffness, stiffness, 0.5 * stiffness].into();
        let mut rigid = machine.clone();
        rigid.belt.model = taut::machine::BeltModel::Rigid;
        let input = Signal::Pulse { value: 10.0, duration: 0.25, at: 0.0 };
        let near = complete(&machine, &from(0.0, &machine, input.clone(), 0.5), Solver::Exact);
        let far = complete(&machine, &from(1.0, &machine, input.clone(), 0.5), Solver::Exact);
        let limit = complete(&rigid, &from(0.0, &rigid, input, 0.5), Solver::Exact);
        let worst = apart(&machine, &near, &far);
        assert!(worst < 1e-9, "{stiffness:e} N/m: {worst:e} m");
        // Breakaway equals Coulomb friction, so the elastic axis tends to the rigid one.
        let limit = apart(&machine, &near, &limit);
        assert!(limit < 1e-7, "{stiffness:e} N/m: {limit:e} m from the rigid axis");
    }
}

/// A belt so stiff that rounding hides the motion was called solved exactly.
#[test]
fn what_rounding_hides_is_told() {
    let mut machine = table4();
    machine.belt.stiffness = [1e15, 1e15, 1e15].into();
    machine.cart.mass = 1e-9;
    machine.drive_pulley.inertia = 1e-13;
    machine.idler_pulley.inertia = 1e-13;
    let step = Signal::Step { value: 5.0, at: 0.0 };
    let solution = complete(&machine, &experiment(step, 1e-6, 1e-7), Solver::Exact);
    let error = solution.outcome.error.unwrap();
    assert!(error.value > 0.0 && error.way > 0.0, "{error:?}");
    // The bound grows with the radians of the fastest swing.
    let table4 = complete(&table4(), &experiment(Signal::Step { value: 5.0, at: 0.0 }, 1.0, 1e-3), Solver::Exact);
    let usual = table4.outcome.error.unwrap();
    assert!(usual.value / usual.way < error.value / error.way, "{usual:?}, {error:?}");
    assert!(usual.is_exact() && !usual.hides_motion());
}

/// "About 1e-11 m" was 1.1e-8 m in the worst of 1500 runs: each run of the general solver now estimates its own error.
#[test]
fn the_error_of_the_general_solver_was_stated_for_all() {
    let mut curved = table4();
    curved.cart.friction =
        Friction::with_breakaway(19.0, 0.2, 0.4).following(Law::Stribeck { velocity: 0.01, shape: Shape::Gaussian });
    let square = || Signal::Square { amplitude: 8.0, frequency: 11.0, duty: 0.4 };
    let pulse = || Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 };
    for (machine, input, tolerance) in [
        (table4(), pulse(), 1e-6),
        (table4(), square(), 1e-6),
        (table4(), square(), 1e-9),
        (curved.clone(), pulse(), 1e-6),
        (curved.clone(), square(), 1e-6),
        (curved, square(), 1e-9),
    ] {
        let experiment = experiment(input, 0.5, 1e-3);
        let exact = Solver::for_machine(&machine) == Solver::Exact;
        let best = if exact { Solver::Exact } else { Solver::General { tolerance: 1e-13 } };
        let best = complete(&machine, &experiment, best);
        let mut estimate = ErrorEstimate::new(&machine, &experiment);
        let solver = Solver::General { tolerance };
        let outcome = stream(&machine, &experiment, solver, &mut |rows| {
            estimate.take(rows);
            Flow::Continue
        })
        .unwrap();
        let error =
            estimate.finish(&machine, &experiment, tolerance, &outcome, &mut || Flow::Continue).unwrap().unwrap();
        let general = complete(&machine, &experiment, solver);
        let true_error = apart(&machine, &best, &general);
        // Of dry friction nothing is left but rounding.
        let said = error.value + 1e-15;
        assert!(true_error <= said, "{tolerance:e}: off by {true_error:e} m, said {error:?}");
        assert!(error.value < 1e4 * tolerance, "{tolerance:e}: {error:?}");
    }
}

// --- on the edge ----------------------------------------------------------------------------------------------------

/// An axis with a lossy gear, an inductance and a rotor, whose drive pulley has viscous friction only.
fn geared() -> Machine {
    let mut machine = table4();
    machine.pulley_radius = 0.02;
    machine.drives[0].motor.gear_efficiency = 0.94;
    machine.drives[0].motor.gear_ratio = 3.0;
    machine.drives[0].motor.rotor_inertia = 5e-6;
    machine.drives[0].motor.inductance = 1e-3;
    machine.drive_pulley.friction = Friction::symmetric(1e-3, 0.0);
    machine.cart.friction = Friction::with_breakaway(10.0, 0.3, 0.5);
    machine.idler_pulley.friction = Friction::symmetric(1e-3, 0.002);
    machine
}

/// Starts where r φ and x differ in the last bit ended as "too many events" at 1e-35 s, or listed a pair of events that
/// is not there: the sign of the gear's torque turned with every term of the series that is nothing but rounding.
#[test]
fn a_gear_turned_its_sign_without_a_moment_passing() {
    let machine = geared();
    let inputs = [
        Signal::Ramp { value: 4.0, over: 0.2, at: 0.0 },
        Signal::Sine { amplitude: 4.0, frequency: 5.0, phase: 0.0, offset: 0.0 },
        Signal::Triangle { amplitude: 4.0, frequency: 5.0 },
    ];
    for input in inputs {
        let wanted =
            bodies(&complete(&machine, &from(0.0, &machine, input.clone(), 0.1), Solver::Exact).outcome.events);
        assert!(!wanted.is_empty());
        for k in 0..300_i64 {
            let start = 0.0705 + 1e-3 * (k - 150) as f64;
            let mut experiment = from(start, &machine, input.clone(), 0.1);
            // Next to the angle that fits, on either side.
            let near = |angle: f64, off: i64| f64::from_bits((angle.to_bits() as i64 + off) as u64);
            experiment.initial.position[DRIVE] = near(experiment.initial.position[DRIVE], k % 3 - 1);
            experiment.initial.position[IDLER] = near(experiment.initial.position[IDLER], k % 5 - 2);
            let solution = complete(&machine, &experiment, Solver::Exact);
            assert_eq!(bodies(&solution.outcome.events), wanted, "from {start} m, {input:?}");
        }
    }
}

/// A gear's torque that is zero, strained by less than rounding, while nothing comes in: nothing happens.
#[test]
fn a_gear_at_rest_has_no_events() {
    let machine = geared();
    let mut experiment = from(0.07, &machine, Signal::Step { value: 0.0, at: 0.0 }, 0.1);
    experiment.initial.position[DRIVE] = 3.5000000000000004;
    let solution = complete(&machine, &experiment, Solver::Exact);
    assert!(solution.outcome.events.is_empty(), "{:?}", solution.outcome.events);
}

/// An overdamped body without Coulomb friction approaches rest for ever; where rounding ends that, the event says so.
#[test]
fn a_stop_that_rounding_decides_is_marked() {
    let mut machine = table4();
    for friction in [&mut machine.drive_pulley.friction, &mut machine.idler_pulley.friction] {
        *friction = Friction::symmetric(1e-3, 0.0);
    }
    // It holds when it rests, and nothing but oil brakes it while it moves.
    let side = Side { viscous: 60.0, coulomb: 0.0, breakaway: 0.1 };
    machine.cart.friction = Friction::sided(side, side);
    machine.belt.model = taut::machine::BeltModel::Rigid;
    let pulse = Signal::Pulse { value: 5.0, duration: 0.1, at: 0.0 };
    let solution = complete(&machine, &experiment(pulse.clone(), 60.0, 0.1), Solver::Exact);
    let stops: Vec<_> = solution.outcome.events.iter().filter(|e| e.to == Motion::Stuck).collect();
    assert!(!stops.is_empty() && stops.iter().all(|e| e.by_rounding), "{stops:?}");

    // Where Coulomb friction brakes to the end, nothing is left to rounding.
    let solution = complete(&table4(), &experiment(pulse, 1.0, 1e-3), Solver::Exact);
    assert!(solution.outcome.events.len() > 4 && solution.outcome.events.iter().all(|e| !e.by_rounding));
}

/// The tolerance at a breakaway held only for bodies that had come to rest, not for one at rest from the start.
#[test]
fn a_load_at_breakaway_but_for_rounding_broke_it_at_time_zero() {
    let mut machine = table4();
    machine.drives[0].amplifier = Amplifier::ideal(AmplifierMode::Voltage, 1.0);
    for k in 0..200 {
        let breakaway = 0.01 + 0.0013 * f64::from(k);
        machine.drive_pulley.friction = Friction::with_breakaway(1e-3, 0.5 * breakaway, breakaway);
        let at = breakaway * machine.drives[0].motor.resistance / machine.drives[0].motor.torque_constant;
        for value in [at, at * (1.0 + 2.0 * f64::EPSILON), at * (1.0 - 2.0 * f64::EPSILON)] {
            let solution = complete(&machine, &experiment(Signal::Step { value, at: 0.0 }, 0.01, 1e-3), Solver::Exact);
            assert!(solution.outcome.events.is_empty(), "{value} V: {:?}", solution.outcome.events);
        }
        let above = Signal::Step { value: at * (1.0 + 1e-12), at: 0.0 };
        assert!(!complete(&machine, &experiment(above, 0.01, 1e-3), Solver::Exact).outcome.events.is_empty());
    }
}

// --- runs that died, and runs that would not end --------------------------------------------------------------------

/// A trial step past zero speed made e^(−v/v_s) overflow: 70 of 120 such runs ended as "no number any more".
#[test]
fn an_exponential_stribeck_curve_overflowed_past_zero_speed() {
    for share in [1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 2e-2] {
        let law = Law::Stribeck { velocity: 0.5 * share, shape: Shape::Exponential };
        for value in [3.0, 5.0, 10.0] {
            let mut machine = table4();
            machine.cart.friction = Friction::with_breakaway(19.0, 0.2, 0.4).following(law);
            let turn = Law::Stribeck { velocity: 25.0 * share, shape: Shape::Exponential };
            machine.drive_pulley.friction = Friction::with_breakaway(1.6e-3, 0.015, 0.02).following(turn);
            let input = Signal::Square { amplitude: value, frequency: 5.0, duty: 0.5 };
            let solution = complete(&machine, &experiment(input, 0.3, 1e-3), Solver::GENERAL);
            assert!(!solution.outcome.events.is_empty());
        }
    }
}

/// A drive pulley of 1000 km on a geared stage kept the program busy for minutes, deaf to Ctrl-C.
#[test]
fn a_run_that_would_not_end_is_told_and_can_be_stopped() {
    let text = taut::case::TEMPLATE;
    let changes =
        ["drive_pulley.radius=1e9 mm", "motor.gear_ratio=5", "motor.gear_efficiency=0.9", "motor.rotor_inertia=1e-5"];
    let case = Case::from_text_with("axis.toml", text, &changes).unwrap();
    let (machine, experiment) = (&case.machine, &case.experiments[0]);
    match simulate(machine, experiment, Solver::Exact) {
        Err(_) => {}
        Ok(solution) => {
            let ending = solution.outcome.ending;
            assert!(
                matches!(ending, Ending::Complete | Ending::TooStiff { .. } | Ending::TooManyEvents { .. }),
                "{ending:?}"
            );
        }
    }
    // Whoever asks it to stop is heard before the first row is full.
    let mut machine = table4();
    machine.belt.stiffness = [1e13, 1e13, 1e13].into();
    machine.drives[0].motor.back_emf_constant = 1e3;
    let mut asked = 0;
    let sine = Signal::Sine { amplitude: 5.0, frequency: 3.0, phase: 0.0, offset: 0.0 };
    let long = self::experiment(sine, 100.0, 10.0);
    for solver in [Solver::Exact, Solver::General { tolerance: 1e-9 }] {
        let outcome = stream(&machine, &long, solver, &mut |_| {
            asked += 1;
            Flow::Stop
        });
        if let Ok(outcome) = outcome {
            assert!(matches!(outcome.ending, Ending::Interrupted { time } if time < 1.0), "{:?}", outcome.ending);
        }
    }
    assert!(asked > 0);
}

/// Cases that the hunt against an independent solver found: runs that ended early, bodies that broke away late or
/// never. By now both solvers come to the same positions and let the same bodies go.
#[test]
fn what_the_hunt_found_stays_found() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hunted");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(files.len() >= 8, "{files:?}");
    let mut faults = Vec::new();
    for file in files {
        let name = file.file_name().unwrap().to_string_lossy().into_owned();
        let case = Case::read(&file).unwrap();
        let (machine, experiment) = (&case.machine, &case.experiments[0]);
        let exact = complete(machine, experiment, Solver::Exact);
        let general = complete(machine, experiment, Solver::General { tolerance: 1e-11 });
        let worst = apart(machine, &exact, &general);
        if worst > 1e-8 {
            faults.push(format!("{name}: {worst:e} m apart"));
        }
        for (body, label) in LABELS.into_iter().enumerate() {
            let first =
                |solution: &Solution| solution.outcome.events.iter().find(|e| e.body() == Some(body)).map(|e| e.time);
            let moved = |solution: &Solution| bodies(&solution.outcome.events).iter().any(|(b, ..)| *b == body);
            if moved(&exact) != moved(&general)
                || first(&exact).is_some_and(|t| t < 1e-12) != first(&general).is_some_and(|t| t < 1e-12)
            {
                faults.push(format!("{name}: {} begins at {:?} and {:?}", label.name, first(&exact), first(&general)));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The cart of this case holds nothing forward, and begins to slide at once.
#[test]
fn a_breakaway_was_forgiven_what_rounding_does_to_the_other_side() {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hunted/one-sided-breakaway-2786.toml");
    let case = Case::read(file).unwrap();
    for solver in [Solver::Exact, Solver::GENERAL] {
        let solution = complete(&case.machine, &case.experiments[0], solver);
        let first = solution.outcome.events.iter().find(|e| e.body() == Some(CART)).unwrap();
        assert!(first.time < 1e-12, "{solver:?}: {first:?}");
    }
}
