//! Hard cases: extreme parameters, loads exactly at breakaway, edges anywhere, contacts that only graze. They end
//! correctly or with a clear word; they never hang and never put out what is no number.

use crate::common;
use common::random::decades;
use common::{experiment, table4};
use proptest::prelude::*;
use std::time::Instant;
use taut::case::Experiment;
use taut::friction::{Friction, Motion, Side};
use taut::machine::axis::{BODIES, CART, DRIVE, IDLER};
use taut::machine::{Amplifier, AmplifierMode, Belt, GearPlay, Machine};
use taut::signal::{Hold, Signal, Slot};
use taut::solve::{Ending, Flow, Solution, Solver, simulate, stream};
use taut::trajectory::Trajectory;

const STATES: [&str; 6] = ["drive_angle", "drive_speed", "cart_position", "cart_speed", "idler_angle", "idler_speed"];

fn run(machine: &Machine, experiment: &Experiment) -> Solution {
    let solution = simulate(machine, experiment, Solver::Exact).unwrap();
    for column in &solution.trajectory.columns {
        assert!(column.values.iter().all(|v| v.is_finite()), "{} is not finite", column.name);
    }
    solution
}

fn complete(machine: &Machine, experiment: &Experiment) -> Solution {
    let solution = run(machine, experiment);
    assert_eq!(solution.outcome.ending, Ending::Complete);
    solution
}

fn last(solution: &Solution, name: &str) -> f64 {
    *solution.trajectory.get(name).unwrap().last().unwrap()
}

fn pulse(value: f64) -> Signal {
    Signal::Pulse { value, duration: 0.25, at: 0.0 }
}

fn friction(machine: &mut Machine) -> [&mut Friction; 3] {
    [&mut machine.drive_pulley.friction, &mut machine.cart.friction, &mut machine.idler_pulley.friction]
}

fn set_friction(machine: &mut Machine, laws: [Friction; 3]) {
    for (to, law) in friction(machine).into_iter().zip(laws) {
        *to = law;
    }
}

/// The input at which the motor's torque on the standing drive pulley is `torque`.
fn voltage_of(machine: &Machine, torque: f64) -> f64 {
    torque * machine.drives[0].motor.resistance / machine.drives[0].motor.torque_constant
}

/// The torque that a voltage puts on the standing drive pulley.
fn load_at(machine: &Machine, voltage: f64) -> f64 {
    machine.drives[0].motor.torque_constant * (voltage / machine.drives[0].motor.resistance)
}

// --- extreme parameters ---------------------------------------------------------------------------------------------

proptest! {
    #![proptest_config(common::random::cases(150))]

    /// Stiffness from 1 to 1e9 N/m, masses from a gram to a tonne, inductance none to 1 mH: complete, and finite.
    #[test]
    fn any_decade(
        stiffness in [decades(1.0, 1e9), decades(1.0, 1e9), decades(1.0, 1e9)],
        mass in decades(1e-3, 1e3),
        inertia in [decades(1e-8, 1e-1), decades(1e-8, 1e-1)],
        inductance in prop_oneof![Just(0.0), Just(1e-12), Just(1e-6), Just(1e-3)],
        viscous in prop_oneof![Just(0.0), decades(1e-3, 1e3)],
        coulomb in prop_oneof![Just(0.0), decades(1e-3, 1e2)],
        value in decades(0.1, 100.0),
        kind in 0..3,
    ) {
        let mut machine = table4();
        machine.belt.stiffness = stiffness.into();
        machine.cart.mass = mass;
        machine.drive_pulley.inertia = inertia[0];
        machine.idler_pulley.inertia = inertia[1];
        machine.drives[0].motor.inductance = inductance;
        let pulley = Friction::symmetric(viscous * 1e-4, coulomb * 0.02);
        set_friction(&mut machine, [pulley, Friction::symmetric(viscous, coulomb), pulley]);
        let input = match kind {
            0 => Signal::Pulse { value, duration: 0.02, at: 0.0 },
            1 => Signal::Triangle { amplitude: value, frequency: 40.0 },
            _ => Signal::Sine { amplitude: value, frequency: 25.0, phase: 0.0, offset: 0.0 },
        };
        let mut experiment = experiment(input, 0.04);
        experiment.every = 1e-3;
        let begin = Instant::now();
        let solution = run(&machine, &experiment);
        let took = begin.elapsed().as_secs_f64();
        prop_assert_eq!(solution.outcome.ending, Ending::Complete);
        prop_assert_eq!(solution.trajectory.len(), 41);
        if took > 0.5 {
            println!("{took:.2} s, {} events, {:?}: {machine:?}", solution.outcome.events.len(), solution.outcome.cost);
        }
    }
}

// --- breakaway ------------------------------------------------------------------------------------------------------

/// A load equal to breakaway holds; so does what rounding could make of it (1e-14 of the forces in play); beyond, it
/// moves.
#[test]
fn breakaway_is_passed_only_above_it() {
    for volts in [0.3, 0.4630434782608695, 1.0, 7.7] {
        let mut machine = table4();
        let load = load_at(&machine, volts);
        for (breakaway, moves) in [
            (load, false),
            (load.next_up(), false),
            (load.next_down(), false),
            (load * (1.0 + 1e-12), false),
            (load * (1.0 - 1e-12), true),
            (load * (1.0 + 1e-9), false),
            (load * (1.0 - 1e-9), true),
        ] {
            for sign in [1.0, -1.0] {
                machine.drive_pulley.friction = Friction::with_breakaway(0.0016, 0.5 * load, breakaway);
                let solution = complete(&machine, &experiment(Signal::Step { value: sign * volts, at: 0.0 }, 0.01));
                assert_eq!(!solution.outcome.events.is_empty(), moves, "breakaway {breakaway:e} under {load:e}");
                if !moves {
                    assert!(STATES.iter().all(|s| solution.trajectory.get(s).unwrap().iter().all(|&v| v == 0.0)));
                } else {
                    assert!(last(&solution, "drive_angle") * sign > 0.0);
                }
            }
        }
    }
}

/// Each body held by itself under a load beside its breakaway: that of the drive pulley comes from the motor, that of
/// cart and idler from a belt strained at the start.
#[test]
fn beside_each_breakaway() {
    let all = table4();
    let r = all.pulley_radius;
    let [k1, k2, k3] = all.belt.stiffness.three();
    for factor in [0.98, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.02] {
        for body in 0..BODIES {
            let mut machine = all.clone();
            // Only this one may leave.
            for (j, law) in friction(&mut machine).into_iter().enumerate() {
                if j != body {
                    *law = Friction::with_breakaway(law.forward.viscous, law.forward.coulomb, 1e3);
                }
            }
            let mut experiment = experiment(Signal::Step { value: 0.0, at: 0.0 }, 0.02);
            match body {
                DRIVE => {
                    experiment.inputs[0] = Signal::Step { value: factor * voltage_of(&all, 0.015), at: 0.0 };
                }
                // −(k₁ + k₂) x = F
                CART => experiment.initial.position[CART] = -factor * 0.2 / (k1 + k2),
                // −r² (k₂ + k₃) φ₃ = τ
                _ => experiment.initial.position[IDLER] = -factor * 0.015 / (r * r * (k2 + k3)),
            }
            let solution = complete(&machine, &experiment);
            let first = solution.outcome.events.first();
            if factor > 1.0 {
                let first = first.unwrap_or_else(|| panic!("{body:?} stays at {factor}"));
                assert!(first.body() == Some(body) && first.time == 0.0 && first.to == Motion::Forward, "{first:?}");
            } else {
                assert!(first.is_none(), "{body:?} leaves at {factor}: {first:?}");
            }
        }
    }
}

// --- stopping -------------------------------------------------------------------------------------------------------

/// A rigid translation whose bodies all decelerate alike, the belt unstrained: all three stop in one instant.
#[test]
fn all_three_stop_at_once() {
    for deceleration in [0.3, 1.0, 7.0] {
        for viscous in [0.0, 2.0] {
            for direction in [1.0, -1.0] {
                let mut machine = table4();
                let r = machine.pulley_radius;
                machine.drives[0].motor.torque_constant = 1e-300; // no brake
                machine.drives[0].motor.back_emf_constant = 1e-300;
                let (j, m) = (machine.drive_pulley.inertia, machine.cart.mass);
                // c = a m of each, on its own axis: r a of a pulley is a J/r; b v likewise
                let pulley = Friction::symmetric(viscous * j, deceleration * j / r);
                set_friction(&mut machine, [pulley, Friction::symmetric(viscous * m, deceleration * m), pulley]);
                let speed = 0.1 * direction;
                let mut experiment = experiment(Signal::Step { value: 0.0, at: 0.0 }, 1.0);
                experiment.initial = machine.without_strain(&[0.0], &[speed]);
                let solution = complete(&machine, &experiment);
                // v̇ = −a − b v / m
                let stop = if viscous == 0.0 {
                    0.1 / deceleration
                } else {
                    (1.0 + viscous * 0.1 / deceleration).ln() / viscous
                };
                let events = &solution.outcome.events;
                assert!(events.len() >= 3 && events.len() < 20, "{events:?}");
                for event in events {
                    assert!((event.time - stop).abs() < 1e-9, "{event:?}, {stop}");
                }
                for column in ["drive_state", "cart_state", "idler_state"] {
                    assert_eq!(last(&solution, column), 0.0);
                }
                let way = if viscous == 0.0 { 0.005 / deceleration } else { (0.1 - deceleration * stop) / viscous };
                let got = last(&solution, "cart_position") * direction;
                assert!((got - way).abs() < 1e-12, "{got} {way}");
                assert!((last(&solution, "drive_angle") * r - got * direction).abs() < 1e-12);
            }
        }
    }
}

/// Without any friction or motor the bodies swing for ever: momentum and energy stay.
#[test]
fn no_friction_at_all() {
    let mut machine = table4();
    set_friction(&mut machine, [Friction::default(); 3]);
    machine.drives[0].motor.torque_constant = 1e-300;
    machine.drives[0].motor.back_emf_constant = 1e-300;
    let mut experiment = experiment(Signal::Step { value: 0.0, at: 0.0 }, 10.0);
    experiment.initial.speed[DRIVE] = 10.0;
    let solution = complete(&machine, &experiment);
    assert!(solution.outcome.events.is_empty());
    let r = machine.pulley_radius;
    let (j, m) = (machine.drive_pulley.inertia, machine.cart.mass);
    for row in [0, 1, 777, 10_000] {
        let get = |name: &str| solution.trajectory.get(name).unwrap()[row];
        let momentum = (get("drive_speed") + get("idler_speed")) * j / r + get("cart_speed") * m;
        // A stiffness times a position of 0.5 m, rounded: a force of 1e-11 N, for 10 s.
        assert!((momentum - 10.0 * j / r).abs() < 1e-7 * 10.0 * j / r, "{momentum}");
        let mut state = taut::mechanism::State::default();
        for body in 0..BODIES {
            (state.position[body], state.speed[body]) = (get(STATES[2 * body]), get(STATES[2 * body + 1]));
        }
        let energy = machine.mechanism().energy(&state);
        assert!((energy - 50.0 * j).abs() < 1e-7 * 50.0 * j, "{energy}");
    }
}

// --- limits ---------------------------------------------------------------------------------------------------------

/// As the inductance goes to zero the motion goes to that without one, the difference in proportion.
#[test]
fn small_inductance_is_nearly_none() {
    let without = complete(&table4(), &experiment(pulse(5.0), 0.5));
    let mut before = None;
    for inductance in [1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-12, 1e-13] {
        let mut machine = table4();
        machine.drives[0].motor.inductance = inductance;
        let with = complete(&machine, &experiment(pulse(5.0), 0.5));
        let (a, b) = (with.trajectory.get("cart_position").unwrap(), without.trajectory.get("cart_position").unwrap());
        let difference = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("L {inductance:e}: {difference:e} m, {:?}", with.outcome.cost);
        // The electrical time constant is a delay of the torque: L/R at a speed of 0.1 m/s or so.
        assert!(difference < 1.0 * inductance / 0.71 + 1e-11, "{inductance:e}: {difference:e}");
        if let Some(before) = before
            && difference > 1e-10
        {
            let ratio: f64 = before / difference;
            assert!((8.0..12.0).contains(&ratio), "{inductance:e}: {ratio}");
        }
        before = Some(difference);
    }
}

/// One rigid degree of freedom: m v̇ = F − b v − c, and where and when it stops.
struct Rigid {
    mass: f64,
    viscous: f64,
    coulomb: f64,
}

impl Rigid {
    fn new(machine: &Machine) -> Self {
        let r = machine.pulley_radius;
        let motor = &machine.drives[0].motor;
        let brake = motor.torque_constant * motor.back_emf_constant / motor.resistance;
        let side = |f: &Friction| f.forward;
        let (drive, cart, idler) =
            (side(&machine.drive_pulley.friction), side(&machine.cart.friction), side(&machine.idler_pulley.friction));
        Self {
            mass: (machine.drive_pulley.inertia + machine.idler_pulley.inertia) / (r * r) + machine.cart.mass,
            viscous: (drive.viscous + idler.viscous + brake) / (r * r) + cart.viscous,
            coulomb: (drive.coulomb + idler.coulomb) / r + cart.coulomb,
        }
    }

    /// Position and speed after `t` under the force `f`, moving forward.
    fn slide(&self, x: f64, v: f64, f: f64, t: f64) -> (f64, f64) {
        let (a, steady) = (self.viscous / self.mass, (f - self.coulomb) / self.viscous);
        let decay = (-a * t).exp();
        (x + steady * t + (v - steady) * (1.0 - decay) / a, steady + (v - steady) * decay)
    }

    /// Final position after a pulse of force.
    fn pulse(&self, f: f64, duration: f64) -> f64 {
        let (x, v) = self.slide(0.0, 0.0, f, duration);
        let steady = self.coulomb / self.viscous;
        let stop = (1.0 + v / steady).ln() * self.mass / self.viscous;
        self.slide(x, v, 0.0, stop).0
    }
}

/// The stiffer the belt, the nearer to one rigid mass. Dry friction of bodies that leave their rest one after another
/// makes the error of the final position fall with the time this takes, as 1/√k.
#[test]
fn a_stiff_belt_is_rigid() {
    for decade in [1e5, 1e6, 1e7, 1e8, 1e9] {
        let mut machine = table4();
        machine.belt.stiffness = [decade, decade, 0.5 * decade].into();
        // Damped, so that no swing is left to stop on.
        let damping = 2.0 * 0.3 * (decade * 0.1_f64).sqrt();
        machine.belt.damping = [damping; 3].into();
        let rigid = Rigid::new(&machine);
        let solution = complete(&machine, &experiment(pulse(5.0), 0.6));
        let force = load_at(&machine, 5.0) / machine.pulley_radius;
        let want = rigid.pulse(force, 0.25);
        let got = last(&solution, "cart_position");
        println!(
            "k {decade:e}: {got:.12} m, rigid {want:.12} m, difference {:e}; {:?}",
            got - want,
            solution.outcome.cost
        );
        assert!((got - want).abs() < 2e-3 / decade.sqrt(), "{decade:e}: {got} {want}");
    }
}

// --- edges, rows, events --------------------------------------------------------------------------------------------

/// An edge on a row, 1e-15 s beside it, twice at one time, or two edges closer than 1e-12 s: the same motion.
#[test]
fn edges_anywhere() {
    let final_of = |input: Signal| last(&complete(&table4(), &experiment(input, 0.6)), "cart_position");
    let want = final_of(pulse(5.0));
    let at = |t: f64| Signal::Table { points: vec![[0.0, 5.0], [t, 5.0], [t, 0.0]] };
    let slot = |signal: Signal, lasts: f64| Slot { signal, lasts };
    let five = || Signal::Step { value: 5.0, at: 0.0 };
    for (name, input) in [
        ("table", at(0.25)),
        ("just after", at(0.25 + 1e-15)),
        ("just before", at(0.25 - 1e-15)),
        ("near", at(0.25 + 1e-13)),
        (
            "two edges",
            Signal::Sum(vec![five(), Signal::Step { value: -2.0, at: 0.25 }, Signal::Step { value: -3.0, at: 0.25 }]),
        ),
        (
            "close edges",
            Signal::Sum(vec![
                five(),
                Signal::Step { value: -9.0, at: 0.25 },
                Signal::Step { value: 4.0, at: 0.25 + 5e-13 },
            ]),
        ),
        ("sequence", Signal::sequence(vec![slot(five(), 0.25), slot(Signal::Step { value: 0.0, at: 0.0 }, 1.0)])),
        ("sampled", Signal::Sampled { times: vec![0.0, 0.25], values: vec![5.0, 0.0], hold: Hold::Zero }),
    ] {
        let got = final_of(input);
        assert!((got - want).abs() < 1e-12, "{name}: {got} {want}");
    }
}

#[test]
fn intervals_of_any_length() {
    let run = |until: f64, every: f64| complete(&table4(), &Experiment { until, every, ..experiment(pulse(5.0), 1.0) });
    let want = last(&run(0.6, 1e-3), "cart_position");
    for (until, every, rows) in [(0.6, 0.6, 2), (1e6, 1e6, 2), (2e6, 1e6, 3), (1e4, 10.0, 1001)] {
        let solution = run(until, every);
        assert_eq!(solution.trajectory.len(), rows);
        assert!((last(&solution, "cart_position") - want).abs() < 1e-12);
    }
    assert_eq!(run(1e-5, 1e-9).trajectory.len(), 10_001);
    // A run shorter than its interval ended where it began.
    assert_eq!(run(0.3, 1.0).trajectory.len(), 2);
}

/// A million rows through a sink that keeps none.
#[test]
fn many_rows_are_streamed() {
    let experiment = Experiment { every: 1e-6, ..experiment(pulse(5.0), 1.0) };
    let (mut rows, mut largest) = (0, 0);
    let mut sink = |block: &Trajectory| {
        rows += block.len();
        largest = largest.max(block.len());
        Flow::Continue
    };
    let outcome = stream(&table4(), &experiment, Solver::Exact, &mut sink).unwrap();
    assert_eq!(outcome.ending, Ending::Complete);
    assert!(rows == 1_000_001 && largest <= 1024, "{rows} rows, {largest} at once");
}

/// A light pulley that a fast square wave turns back 2e8 times a second: a clear word, not a hang.
#[test]
fn too_many_events_are_told() {
    let mut machine = table4();
    machine.drive_pulley.inertia = 1e-12;
    let input = Signal::Square { amplitude: 5.0, frequency: 1e8, duty: 0.5 };
    let solution = run(&machine, &experiment(input, 0.002));
    assert!(matches!(solution.outcome.ending, Ending::TooManyEvents { .. }), "{:?}", solution.outcome.ending);
}

#[test]
fn a_metre_of_stretch() {
    for x in [1.0, -1.0] {
        let mut experiment = experiment(Signal::Step { value: 0.0, at: 0.0 }, 1.0);
        experiment.initial.position[CART] = x;
        complete(&table4(), &experiment);
    }
}

/// The pulse's second half is bisected to where the drive pulley only just does not stop: on both sides the same
/// motion.
#[test]
fn grazing() {
    let solve = |low: f64| {
        let points = vec![[0.0, 5.0], [0.25, 5.0], [0.25, low], [0.3, low], [0.3, 0.0]];
        complete(&table4(), &experiment(Signal::Table { points }, 0.6))
    };
    let stops = |solution: &Solution| {
        solution.outcome.events.iter().any(|e| e.body() == Some(DRIVE) && e.time > 0.25 && e.time < 0.3)
    };
    let (mut low, mut high) = (0.0, 5.0);
    assert!(stops(&solve(low)) && !stops(&solve(high)));
    while let middle = 0.5 * (low + high)
        && middle > low
        && middle < high
    {
        if stops(&solve(middle)) { low = middle } else { high = middle }
    }
    let (a, b) = (solve(low), solve(high));
    let difference = (last(&a, "cart_position") - last(&b, "cart_position")).abs();
    println!("grazes at {low} V: {difference:e} m");
    assert!(difference < 1e-9, "{difference:e}");
}

// --- what a program may build by itself -----------------------------------------------------------------------------

#[test]
fn no_machine_is_refused() {
    let refused = |change: fn(&mut Machine)| {
        let mut machine = table4();
        change(&mut machine);
        simulate(&machine, &experiment(pulse(5.0), 0.1), Solver::Exact).unwrap_err();
    };
    refused(|s| s.cart.mass = f64::NAN);
    refused(|s| s.cart.mass = 0.0);
    refused(|s| s.drive_pulley.inertia = -1.0);
    refused(|s| s.belt.stiffness[1] = f64::INFINITY);
    refused(|s| s.belt.damping[1] = -1.0);
    refused(|s| s.drives[0].motor.inductance = 1e-30);
    refused(|s| s.drives[0].motor.resistance = 1e-300);
    refused(|s| s.drives[0].motor.gear_efficiency = 2.0);
    refused(|s| s.cart.friction.forward.breakaway = 0.1);
    for (until, every) in
        [(f64::NAN, 1e-3), (1.0, f64::NAN), (f64::INFINITY, 1.0), (1.0, 0.0), (1.0, -1.0), (1.0, 1e-300)]
    {
        let experiment = Experiment { until, every, ..experiment(pulse(5.0), 1.0) };
        simulate(&table4(), &experiment, Solver::Exact).unwrap_err();
    }
    let mut experiment = experiment(Signal::Step { value: f64::NAN, at: 0.0 }, 0.1);
    let solution = simulate(&table4(), &experiment, Solver::Exact).unwrap();
    assert!(matches!(solution.outcome.ending, Ending::Diverged { .. }));
    experiment.initial.speed[CART] = f64::NAN;
    simulate(&table4(), &experiment, Solver::Exact).unwrap_err();
}

#[test]
fn table3_that_runs_away_is_told() {
    let solver = Solver::Table3 { step: 0.01, method: taut::solve::Method::RungeKutta4 };
    let experiment = Experiment { every: 0.01, ..experiment(pulse(5.0), 1.0) };
    let solution = simulate(&table4(), &experiment, solver).unwrap();
    assert!(matches!(solution.outcome.ending, Ending::Diverged { .. }), "{:?}", solution.outcome.ending);
    assert!(solution.trajectory.get("cart_position").unwrap().iter().all(|x| x.abs() <= 1e9));
}

/// A gear's torque that is zero counted as negative by its last bits, whichever way the gear carried, and the run went
/// back and forth at one instant until it gave up.
#[test]
fn a_gear_whose_torque_is_zero_but_for_rounding() {
    let side = |viscous, coulomb, breakaway| Side { viscous, coulomb, breakaway };
    let mut machine = table4();
    machine.drives[0].motor.torque_constant = 0.05208461186091644;
    machine.drives[0].motor.rotor_inertia = 7.803031526692751e-7;
    machine.drives[0].motor.gear_efficiency = 0.954513808626461;
    machine.drives[0].amplifier = Amplifier::ideal(AmplifierMode::Current, 1.0460908509847053);
    machine.pulley_radius = 0.005046775092618381;
    machine.drive_pulley.inertia = 0.00042132278224457344;
    machine.cart.mass = 0.4559614569640354;
    machine.idler_pulley.inertia = 0.00013362595977205803;
    machine.belt.stiffness = [12617.547858467795, 15616.28024091606, 67333.92593411065].into();
    let laws = [
        (
            side(0.0029053388374507983, 0.01642142650741023, 0.01642142650741023),
            side(0.0, 0.02043414567247829, 0.02043414567247829),
        ),
        (
            side(0.0, 0.0639291791947865, 0.100642839423133),
            side(4.864983687527905, 0.5758776930608349, 0.7421612231061537),
        ),
        (side(0.0, 0.075, 0.075), side(0.001497581210236506, 0.01693911090990089, 0.022323434819222106)),
    ];
    set_friction(&mut machine, laws.map(|(forward, backward)| Friction::sided(forward, backward)));
    let input = Signal::Triangle { amplitude: -1.9295822438179058, frequency: 27.727307116916247 };
    complete(&machine, &Experiment { every: 0.01, ..experiment(input, 0.3) });
}

/// The bound of a gear that gives way and loses power took the torque on its rotor, T/e, for that on the pulley: the
/// parting of its flanks was seen 8 µs late, at the end of the interval looked at, and rows of some intervals were 0.7
/// nm off.
#[test]
fn a_gear_that_gives_way_and_loses_power_parts_when_it_does() {
    let mut machine = table4();
    machine.drives[0].motor.torque_constant = 0.017822451212881535;
    machine.drives[0].motor.back_emf_constant = 0.014257960970305229;
    machine.drives[0].motor.resistance = 3.705478161157106;
    machine.drives[0].amplifier.gain = 1.1422442272322024;
    machine.drives[0].motor.rotor_inertia = 1.5853980855471624e-6;
    machine.drives[0].motor.gear_efficiency = 0.5303047401379443;
    machine.drives[0].motor.gear_play =
        Some(GearPlay { backlash: 0.0040151766291686465, stiffness: 77.28461755195906, damping: 0.0 });
    machine.pulley_radius = 0.027357644336011414;
    machine.drive_pulley.inertia = 0.00017305296445412391;
    machine.idler_pulley.inertia = 0.00018001301078886188;
    machine.cart.mass = 0.1582856021577527;
    machine.cart.load = 1.7505221994316564;
    let one_way = |viscous: f64, coulomb: f64, breakaway: f64| {
        let mut friction = Friction::symmetric(0.0, 0.0);
        friction.forward = Side { viscous, coulomb, breakaway };
        friction
    };
    machine.drive_pulley.friction = one_way(0.001991154854383248, 0.005628679256048761, 0.005842646265053341);
    machine.cart.friction = one_way(0.0, 0.5677712144542374, 0.5677712144542374);
    machine.idler_pulley.friction = one_way(0.0011521033948317448, 0.0, 0.0);
    machine.belt = Belt::given([8710.378407135133, 91374.4855975486, 41394.706151733386], [1.0, 0.0, 0.0]);
    let input = Signal::Table {
        points: vec![[0.04814496182410192, -1.488502439088769], [0.054835734233441166, -1.2427537126632635]],
    };
    let events = |every: f64| {
        let every_so_often = Experiment { every, ..experiment(input.clone(), 0.06) };
        simulate(&machine, &every_so_often, Solver::Exact).unwrap().outcome.events
    };
    let coarse = events(0.01);
    assert!(coarse.len() >= 20, "{}", coarse.len());
    for every in [5e-3, 1.25e-3, 6.25e-4, 3e-4, 1e-4, 3e-5] {
        let fine = events(every);
        assert_eq!(coarse.len(), fine.len(), "{every}");
        for (a, b) in coarse.iter().zip(&fine) {
            assert!((a.time - b.time).abs() < 1e-12, "{every}: {a:?} and {b:?}");
        }
    }
}
