//! Fits: certified least-squares problems, machines whose truth is known, and what logs cannot tell.

use crate::common::chance;
use crate::common::logged;
use chance::Chance;
use logged::{fitted_in_steps, logged, of_loop};
use nalgebra::DMatrix;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use taut::case::{Case, Nuisances, Plan, Scope, TEMPLATE};
use taut::control::{Loop, Rows, Standard, stream};
use taut::design;
use taut::fit::least_squares::{Bounds, Differences, Ending, Options, Residuals, minimise};
use taut::fit::{Estimate, Fit, Nuisance, Problem, check, fit, inverse_of_square, profiles};
use taut::parameter::{Free, values};
use taut::signal::Signal;
use taut::signal::profile::{Leg, Limits, Profile};
use taut::solve::{Flow, Solver, simulate};
use taut::trajectory::Trajectory;

/// A problem of NIST's Statistical Reference Datasets (nonlinear regression), with its certified answer.
struct Nist {
    name: &'static str,
    x: &'static [f64],
    y: &'static [f64],
    model: fn(&[f64], f64) -> f64,
    starts: &'static [&'static [f64]],
    certified: &'static [[f64; 2]],
    squares: f64,
}

const NIST: &[Nist] = &[
    Nist {
        name: "Misra1a",
        x: &[77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0],
        y: &[10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78],
        model: |b, x| b[0] * (1.0 - (-b[1] * x).exp()),
        starts: &[&[500.0, 0.0001], &[250.0, 0.0005]],
        certified: &[[2.3894212918e2, 2.7070075241e0], [5.5015643181e-4, 7.2668688436e-6]],
        squares: 1.2455138894e-1,
    },
    Nist {
        name: "MGH09",
        x: &[4.0, 2.0, 1.0, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625],
        y: &[0.1957, 0.1947, 0.1735, 0.1600, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246],
        model: |b, x| b[0] * (x * x + x * b[1]) / (x * x + x * b[2] + b[3]),
        starts: &[&[0.25, 0.39, 0.415, 0.39]],
        certified: &[
            [1.9280693458e-1, 1.1435312227e-2],
            [1.9128232873e-1, 1.9633220911e-1],
            [1.2305650693e-1, 8.0842031232e-2],
            [1.3606233068e-1, 9.0025542308e-2],
        ],
        squares: 3.0750560385e-4,
    },
    Nist {
        name: "Rat42",
        x: &[9.0, 14.0, 21.0, 28.0, 42.0, 57.0, 63.0, 70.0, 79.0],
        y: &[8.930, 10.800, 18.590, 22.330, 39.350, 56.110, 61.730, 64.620, 67.080],
        model: |b, x| b[0] / (1.0 + (b[1] - b[2] * x).exp()),
        starts: &[&[100.0, 1.0, 0.1], &[75.0, 2.5, 0.07]],
        certified: &[
            [7.2462237576e1, 1.7340283401e0],
            [2.6180768402e0, 8.8295217536e-2],
            [6.7359200066e-2, 3.4465663377e-3],
        ],
        squares: 8.0565229338e0,
    },
];

/// Variables in units of where they start, as a fit has them.
struct Scaled<'a>(&'a Nist, &'a [f64]);

impl Residuals for Scaled<'_> {
    fn rows(&self) -> usize {
        self.0.x.len()
    }

    fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
        let b: Vec<f64> = x.iter().zip(self.1).map(|(x, unit)| x * unit).collect();
        for (r, (x, y)) in r.iter_mut().zip(self.0.x.iter().zip(self.0.y)) {
            *r = (self.0.model)(&b, *x) - y;
        }
        r.iter().all(|r| r.is_finite())
    }
}

#[test]
fn certified_problems_of_nist_are_met() {
    for problem in NIST {
        for start in problem.starts {
            let n = start.len();
            let options = Options { tolerance: 1e-8, iterations: 1000, ..Options::default() };
            let found =
                minimise(&mut Scaled(problem, start), &vec![1.0; n], &Bounds::none(n), &options, &mut |_, _| {
                    Flow::Continue
                });
            let name = problem.name;
            assert_eq!(found.ending, Ending::Converged, "{name}");
            assert!((2.0 * found.cost / problem.squares - 1.0).abs() < 1e-9, "{name}: {}", 2.0 * found.cost);
            let inverse = inverse_of_square(&found.jacobian).unwrap();
            let variance = 2.0 * found.cost / (problem.x.len() - n) as f64;
            for (j, [value, error]) in problem.certified.iter().enumerate() {
                let mine = found.x[j] * start[j];
                let own = (variance * inverse[(j, j)]).sqrt() * start[j];
                assert!((mine / value - 1.0).abs() < 1e-6, "{name} b{}: {mine} {value}", j + 1);
                assert!((own / error - 1.0).abs() < 1e-5, "{name} error of b{}: {own} {error}", j + 1);
            }
        }
    }
}

/// A valley along b = a² whose sides meet at a kink, with exact derivatives; least at (1, 1).
struct Kinked;

impl Residuals for Kinked {
    fn rows(&self) -> usize {
        30
    }

    fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
        r.fill(1.0);
        (r[0], r[1]) = (10.0 + 4.0 * (x[1] - x[0] * x[0]).abs(), 3.0 * (1.0 - x[0]));
        true
    }

    fn is_exact(&self) -> bool {
        true
    }

    fn jacobian(&mut self, x: &[f64], _: &[f64], _: &Bounds, _: &Differences) -> Option<DMatrix<f64>> {
        let mut jacobian = DMatrix::zeros(30, 2);
        let side = 4.0 * (x[1] - x[0] * x[0]).signum();
        (jacobian[(0, 0)], jacobian[(0, 1)], jacobian[(1, 0)]) = (-2.0 * side * x[0], side, -3.0);
        Some(jacobian)
    }
}

/// A fit of EMPS ended where its sticks change their order, and was called stalled there: on a kink no gradient is
/// zero, but at its minimum those of both sides balance.
#[test]
fn a_minimum_on_a_kink_is_one() {
    let options = Options::default();
    for start in [[0.6, 0.9], [1.5, 1.0], [3.0, 2.0]] {
        let found = minimise(&mut Kinked, &start, &Bounds::none(2), &options, &mut |_, _| Flow::Continue);
        assert_eq!(found.ending, Ending::Converged, "{start:?}: {} {:?}", found.decrement, found.x);
        assert!(found.pieces > 1 && found.decrement < 0.1, "{start:?}: {} {}", found.pieces, found.decrement);
        // A standard error along the valley is 0.9.
        let [off, aside] = [found.x[0] - 1.0, found.x[1] - found.x[0] * found.x[0]];
        assert!(off.abs() < 0.18 && aside.abs() < 1e-2, "{start:?}: {:?}", found.x);
        let push = found.jacobian.tr_mul(&nalgebra::DVector::from_vec(found.residuals));
        assert!(push.norm() < 1.5, "{push}");
    }
}

/// A search may ask for a breakaway below Coulomb friction; the machine then breaks away at Coulomb friction, and that
/// is told: 0.26 N beside 21 N could not be read back.
#[test]
fn a_breakaway_is_never_told_below_coulomb_friction() {
    let truth = ["cart.friction.viscous=24", "cart.friction.coulomb=0.6"];
    for seed in 1..5 {
        let mut case = with_logs_of(recorded(&truth, seed, 2e-3));
        case.machine.cart.friction.forward.breakaway = 0.3;
        case.machine.cart.friction.backward.breakaway = 0.3;
        let keys = ["cart.friction.viscous", "cart.friction.coulomb", "cart.friction.static"];
        let found = fit(&case, &plan(&keys), None, &mut |_| Flow::Continue).unwrap();
        let value = |key: &str| found.estimates.iter().find(|one| one.name == key).unwrap().value;
        assert!(
            value("cart.friction.static") >= value("cart.friction.coulomb") * (1.0 - 1e-9),
            "{:?}",
            found.estimates
        );
    }
}

/// The machine of the template with some numbers changed, and the logs of both pulses that its encoder makes of an
/// angle that trembles with this deviation, rad.
fn recorded(changes: &[&str], seed: u64, noise: f64) -> Case {
    let mut case = Case::from_text_with("axis.toml", TEMPLATE, changes).unwrap();
    let step = std::f64::consts::TAU / 2048.0;
    let mut chance = Chance::new(seed);
    for experiment in &mut case.experiments {
        let run = simulate(&case.machine, experiment, Solver::for_machine(&case.machine)).unwrap().trajectory;
        let angle = run.get("drive_angle").unwrap().iter();
        let values = angle.map(|v| step * ((v + noise * chance.normal()) / step).round()).collect();
        experiment.log = Some(logged(&experiment.name, &run, values));
    }
    case
}

/// The case of the file, with the logs of another machine.
fn with_logs_of(truth: Case) -> Case {
    let mut case = Case::from_text("axis.toml", TEMPLATE).unwrap();
    for (own, other) in case.experiments.iter_mut().zip(truth.experiments) {
        own.log = other.log;
    }
    case
}

fn plan(free: &[&str]) -> Plan {
    Plan { free: free.iter().map(|key| key.to_string()).collect(), ..Plan::default() }
}

#[test]
fn a_machine_is_found_again() {
    let truth = [("cart.friction.viscous", 24.0), ("cart.friction.coulomb", 0.6), ("cart.mass", 0.5)];
    let changes: Vec<String> = truth.iter().map(|(key, value)| format!("{key}={value}")).collect();
    let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
    let case = with_logs_of(recorded(&changes, 1, 0.0));
    let keys: Vec<&str> = truth.iter().map(|(key, _)| *key).collect();
    let found = fit(&case, &plan(&keys), None, &mut |_| Flow::Continue).unwrap();
    assert_eq!(found.ending, Ending::Converged);
    for (estimate, (key, value)) in found.estimates.iter().zip(truth) {
        let error = estimate.error.unwrap();
        assert!((estimate.value - value).abs() < 4.0 * error, "{key}: {} ± {error}, is {value}", estimate.value);
        assert!(error < 0.05 * value, "{key}: ± {error}");
    }
    // What is written is what was found, to the digits that are known.
    let text = found.case_text(&case, "axis.toml".as_ref()).unwrap();
    let again = Case::from_text("fitted.toml", &text).unwrap();
    let mass = &found.estimates[2];
    assert!((again.machine.cart.mass - mass.value).abs() < 0.05 * mass.error.unwrap(), "{text}");
}

/// The case of the file with the logs of `truth`, which answers so many rows late.
fn late(mut truth: Case, rows: usize) -> Case {
    for experiment in &mut truth.experiments {
        let values = &mut Arc::make_mut(experiment.log.as_mut().unwrap()).outputs[0].values;
        let first = values[0];
        values.rotate_right(rows);
        values[..rows].fill(first);
    }
    let mut case = with_logs_of(truth);
    for experiment in &mut case.experiments {
        let log = experiment.log.as_ref().unwrap();
        experiment.inputs[0] =
            Signal::Sampled { times: log.time.clone(), values: log.inputs[0].clone(), hold: log.hold };
    }
    case
}

/// Cut into windows, a log showed no delay: each of its windows had no input until the delay had passed.
#[test]
fn a_delay_is_found_in_windows_as_in_the_whole_log() {
    let truth = recorded(&["cart.friction.viscous=24", "cart.mass=0.5"], 1, 1e-3);
    let case = late(truth, 9);
    let nuisance = Nuisances { delay: Scope::Shared, ..Nuisances::default() };
    for windows in [None, Some(0.3), Some(0.1)] {
        let plan = Plan { nuisance, windows, ..plan(&["cart.friction.viscous", "cart.mass"]) };
        let found = fitted_in_steps(&case, &plan, None).unwrap();
        for (estimate, truth) in found.estimates.iter().zip([24.0, 0.5, 9e-3]) {
            let (value, error) = (estimate.value, estimate.error.unwrap());
            assert!(
                (value - truth).abs() < 4.0 * error,
                "{windows:?} {}: {value} ± {error}, is {truth}",
                estimate.name
            );
            assert!(error < 0.15 * truth, "{windows:?} {}: ± {error}", estimate.name);
        }
    }
}

/// Stopped while it looked for a start with a delay, a fit ended without a result.
#[test]
fn a_fit_that_is_stopped_at_its_first_steps_keeps_the_best() {
    let case = late(recorded(&["cart.friction.viscous=24", "cart.mass=0.5"], 1, 1e-3), 9);
    let nuisance = Nuisances { delay: Scope::Shared, ..Nuisances::default() };
    let plan = Plan { nuisance, ..plan(&["cart.friction.viscous", "cart.mass"]) };
    for steps in 1..4 {
        let watched = AtomicUsize::new(0);
        let stop = || watched.load(Relaxed) >= steps;
        let found = fit(&case, &plan, Some(&stop), &mut |_| {
            watched.fetch_add(1, Relaxed);
            if stop() { Flow::Stop } else { Flow::Continue }
        });
        let found = found.unwrap_or_else(|error| panic!("after {steps} steps: {error}"));
        assert_eq!(found.ending, Ending::Interrupted, "after {steps} steps");
        assert!(found.estimates.len() == 3 && found.estimates.iter().all(|estimate| estimate.value.is_finite()));
    }
}

/// Steps from rest under slow noise. To see whether parts of the logs agree with the whole, each was cut into windows
/// with starts of their own, the first among them: there a speed at the start did what a delay does, and the delay was
/// said to be off by 27 standard errors and known to ± 74 ms.
#[test]
fn a_log_that_begins_at_rest_does_so_in_its_first_window() {
    let mut case = Case::from_text("axis.toml", TEMPLATE).unwrap();
    case.experiments.clear();
    for (volts, seed) in [(6.0, 1), (-6.0, 2), (10.0, 3), (-10.0, 4)] {
        // It acts 12 ms after the log has it.
        let change = format!("experiment.0.input={{ step = {volts}, at = \"12 ms\" }}");
        let mut truth = recorded(&[&change, "cart.friction.viscous=24"], seed, 1e-3);
        let mut experiment = truth.experiments.swap_remove(0);
        let log = Arc::make_mut(experiment.log.as_mut().unwrap());
        let mut chance = Chance::new(seed);
        let mut slow = 3e-3 * chance.normal();
        for value in &mut log.outputs[0].values {
            *value += slow;
            slow = 0.99 * slow + 3e-3 * 0.0199f64.sqrt() * chance.normal();
        }
        log.inputs[0].fill(volts);
        experiment.inputs[0] =
            Signal::Sampled { times: log.time.clone(), values: log.inputs[0].clone(), hold: log.hold };
        experiment.name = format!("step of {volts} V");
        case.experiments.push(experiment);
    }
    let nuisance = Nuisances { delay: Scope::Shared, ..Nuisances::default() };
    let plan = Plan { nuisance, ..plan(&["amplifier.gain", "cart.friction.viscous", "cart.friction.coulomb"]) };
    let found = fit(&case, &plan, None, &mut |_| Flow::Continue).unwrap();
    assert!(found.disagreement.is_none(), "{:?}", found.disagreement);
    for (estimate, truth) in found.estimates.iter().zip([1.0, 24.0, 0.2, 12e-3]) {
        let (value, error) = (estimate.value, estimate.error.unwrap());
        assert!((value - truth).abs() < 4.0 * error, "{}: {value} ± {error}, is {truth}", estimate.name);
    }
    assert!(found.estimates[3].error.unwrap() < 2e-3, "{:?}", found.estimates[3].error);
    let windows = Plan { windows: Some(0.3), ..plan };
    for run in Problem::new(&case, &windows).unwrap().runs {
        let is_free = run.extras.iter().any(|extra| extra.what == Nuisance::StartSpeed(0));
        assert_eq!(is_free, run.window > 0, "{} {}", run.name, run.window);
    }
}

/// The offset of a current that all logs share was shown in volts.
#[test]
fn a_shared_offset_of_the_input_has_the_unit_of_what_the_amplifier_commands() {
    let current = [
        "amplifier.mode=current",
        "experiment.0.input={ pulse = 1, for = 0.25 }",
        "experiment.1.input={ pulse = 1.5, for = 0.25 }",
    ];
    for (changes, unit) in [(&current[..], "A"), (&[], "V")] {
        let case = recorded(changes, 3, 1e-3);
        let nuisance = Nuisances { input_offset: Scope::Shared, ..Nuisances::default() };
        let found = fit(&case, &Plan { nuisance, ..plan(&["cart.mass"]) }, None, &mut |_| Flow::Continue).unwrap();
        let offset = found.estimates.iter().find(|estimate| estimate.name == "input_offset").unwrap();
        assert_eq!(offset.unit, unit);
        assert!(offset.value.abs() < 0.1, "{}", offset.value);
    }
}

/// Whatever was fitted, and however the file has it: the file that is written is the machine that was found.
#[test]
fn what_is_written_is_the_machine_that_was_found() {
    const TEXT: &str = r#"
motor = { torque_constant = "23 mN m/A", back_emf_constant = "23 mV s/rad", resistance = "0.71 ohm" }
drive_pulley = { teeth = 60, pitch = "2.03 mm", inertia = "6.3e-5 kg m^2", friction = { coulomb = "15 mN m", stribeck = { force = "5 mN m", decay = "4 s^2/rad^2" } } }
travel = { min = "-0.2 m", max = "0.2 m", stop_stiffness = "20 kN/m" }

[idler_pulley] # remark
inertia  = { outer_diameter = "38.3 mm", bore_diameter = "6.35 mm", width = "12.7 mm", density = "2.7 g/cm^3" }
friction = { viscous = 0.001, viscous_backward = 0.001, coulomb = "15 mN m", static = "15 mN m" }

[cart]
mass     = "0.362 kg"
friction = { coulomb = "0.2 N", static = "0.3 N", lugre = { stiffness = "100 kN/m", damping = "190 N s/m", velocity = "10 mm/s" }, along = [["-0.1 m", 1], ["0 m", 1.5], ["0.1 m", 1]] }

[belt]
BELT

[[experiment]]
name  = "pulse"
input = { pulse = "5 V", for = "0.25 s" }
until = "1 s"
every = "1 ms"
"#;
    let plain = recorded(&[], 1, 1e-4);
    let mut found = fit(&plain, &plan(&["cart.mass"]), None, &mut |_| Flow::Continue).unwrap();
    let estimate = found.estimates.remove(0);
    for belt in [
        "stiffness = [\"132 kN/m\", \"132 kN/m\", \"58 kN/m\"]",
        "modulus = [{ share = 0.5, modulus = \"6 GPa\" }, { share = 0.5, modulus = \"10 GPa\" }]\n\
         section = { plain = \"5.5 mm^2\", toothed = \"10.4 mm^2\", toothed_share = 0.5 }\n\
         spans = [\"0.35 m\", \"0.35 m\", \"0.8 m\"]\ndamping = [1, 1, 2]",
    ] {
        let case = Case::from_text("axis.toml", &TEXT.replace("BELT", belt)).unwrap_or_else(|error| panic!("{error}"));
        let whole = ["belt.stiffness", "belt.damping", "belt.spans", "cart.friction.along.factor"];
        let keys = values(&case.machine).into_iter().map(|(key, _)| key).chain(whole.map(str::to_string));
        for key in keys {
            let Ok(free) = Free::new(&case.machine, &key, &[], &[]) else { continue };
            let value = if free.start == 0.0 { 0.01 } else { 0.99 * free.start };
            found.machine = case.machine.clone();
            free.set(&mut found.machine, value);
            let sets = free.keys.iter().map(|(key, factor)| (key.clone(), factor * value)).collect();
            // Without an error all digits are written.
            found.estimates = vec![Estimate { name: key.clone(), value, error: None, sets, ..estimate.clone() }];
            let text = found.case_text(&case, "axis.toml".as_ref()).unwrap_or_else(|error| panic!("{key}: {error}"));
            let written = Case::from_text("fitted.toml", &text).unwrap_or_else(|error| panic!("{key}: {error}"));
            for ((name, wanted), (_, own)) in values(&found.machine).into_iter().zip(values(&written.machine)) {
                assert!(
                    (own - wanted).abs() <= 1e-12 * wanted.abs(),
                    "{key}: {name} is {own} and not {wanted}\n{text}"
                );
            }
            assert!(text.contains("[idler_pulley] # remark"));
        }
    }
}

/// A missing force that turns its sign with the direction and goes in straight lines along the travel is
/// `along`, whose factors are found like any other number.
#[test]
fn friction_that_changes_along_the_travel_is_found_again() {
    let friction = |factors: [f64; 3]| {
        let [low, middle, high] = factors;
        format!(
            "cart.friction={{ viscous = 19, coulomb = 1.5, along = [[0, {low}], [0.03, {middle}], [0.06, {high}]] }}"
        )
    };
    let made = recorded(&[&friction([0.6, 1.0, 1.5])], 1, 1e-3);
    let mut case = Case::from_text_with("axis.toml", TEMPLATE, &[&friction([1.0; 3])]).unwrap();
    for (own, other) in case.experiments.iter_mut().zip(made.experiments) {
        own.log = other.log;
    }
    let keys = ["cart.friction.along.0.factor", "cart.friction.along.2.factor", "cart.friction.viscous"];
    let found = fit(&case, &plan(&keys), None, &mut |_| Flow::Continue).unwrap();
    for (estimate, truth) in found.estimates.iter().zip([0.6, 1.5, 19.0]) {
        let (value, error) = (estimate.value, estimate.error.unwrap());
        assert!((value - truth).abs() < 4.0 * error, "{}: {value} ± {error}, is {truth}", estimate.name);
        assert!(error < 0.1 * truth, "{}: ± {error}", estimate.name);
    }
}

/// A residual that keeps its sign with the direction is a force of its own, over the travel or over the speed, found
/// from nothing.
#[test]
fn forces_that_are_lines_are_found_again() {
    let line = |key: &str, over: [f64; 3], forces: [f64; 3]| {
        let [[a, b, c], [x, y, z]] = [over, forces];
        format!("cart.{key}=[[{a}, {x}], [{b}, {y}], [{c}, {z}]]")
    };
    let truth = [0.5, -1.0, 0.8];
    for (key, over) in [("force_along", [0.0, 0.03, 0.06]), ("force_by_speed", [0.05, 0.15, 0.3])] {
        let made = recorded(&[&line(key, over, truth)], 1, 1e-3);
        let mut case = Case::from_text_with("axis.toml", TEMPLATE, &[&line(key, over, [0.0; 3])]).unwrap();
        for (own, other) in case.experiments.iter_mut().zip(made.experiments) {
            own.log = other.log;
        }
        let keys: Vec<String> = (0..3).map(|point| format!("cart.{key}.{point}.force")).collect();
        let mut keys: Vec<&str> = keys.iter().map(String::as_str).collect();
        keys.push("cart.mass");
        let found = fit(&case, &plan(&keys), None, &mut |_| Flow::Continue).unwrap();
        assert_eq!(found.ending, Ending::Converged, "{key}");
        for (estimate, truth) in found.estimates.iter().zip(truth.into_iter().chain([0.362])) {
            let (value, error) = (estimate.value, estimate.error.unwrap());
            assert!((value - truth).abs() < 4.0 * error, "{}: {value} ± {error}, is {truth}", estimate.name);
            assert!(error < 0.2 * truth.abs(), "{}: ± {error}", estimate.name);
        }
        // What is written is the machine that was found.
        let text = found.case_text(&case, "axis.toml".as_ref()).unwrap();
        let again = Case::from_text("fitted.toml", &text).unwrap().machine.cart.forces;
        let written = again.along.or(again.by_speed).unwrap();
        for (point, estimate) in written.points().iter().zip(&found.estimates) {
            assert!((point[1] - estimate.value).abs() < 0.05 * estimate.error.unwrap(), "{text}");
        }
    }
}

#[test]
fn the_profile_of_what_is_well_known_is_that_of_a_linear_model() {
    let case = recorded(&[], 1, 1e-3);
    let plan = plan(&["cart.friction.viscous", "cart.friction.coulomb"]);
    let found = fit(&case, &plan, None, &mut |_| Flow::Continue).unwrap();
    let profiles = profiles(&case, &plan, &found, None).unwrap();
    assert_eq!(profiles.len(), 2);
    for profile in &profiles {
        assert!(profile.values.is_sorted() && profile.values.len() == 7, "{profile:?}");
        assert!(profile.bends().into_iter().all(|bend| bend.is_some()), "{profile:?}");
        // Residuals of which more than noise is left widen the interval, and the growth falls behind by as much.
        for (grown, linear) in profile.growth.iter().zip(&profile.linear) {
            assert!((grown - linear).abs() <= 0.2 * linear, "{profile:?}");
        }
    }
    // What is asked to stop leaves out what it has not.
    assert!(taut::fit::profiles(&case, &plan, &found, Some(&|| true)).unwrap().is_empty());
}

/// Tied parameters stay within the bounds of each of their keys.
#[test]
fn bounds_hold_for_all_that_is_tied() {
    let machine = Case::from_text("axis.toml", TEMPLATE).unwrap().machine;
    let keys = ["drive_pulley.friction.viscous", "cart.friction.viscous"];
    let ratio = machine.cart.friction.forward.viscous / machine.drive_pulley.friction.forward.viscous;
    let parameter = |bounds: &[(&str, [f64; 2])]| {
        let bounds: Vec<(String, [f64; 2])> = bounds.iter().map(|(key, ends)| (key.to_string(), *ends)).collect();
        Free::new(&machine, &keys.join(" = "), &[], &bounds)
    };
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
    let second = parameter(&[(keys[1], [10.0, 30.0])]).unwrap();
    near(second.low, 10.0 / ratio);
    near(second.high, 30.0 / ratio);
    let both = parameter(&[(keys[0], [0.001, 0.002]), (keys[1], [18.0, 100.0])]).unwrap();
    near(both.low, 18.0 / ratio);
    near(both.high, 0.002);
    assert!(parameter(&[(keys[1], [30.0, 40.0])]).is_err());
}

/// A current without inductance jumps with its input, and with it the cost wherever the delay passes a whole interval:
/// fits of a controller's samples ended at one of these jumps, 9 ms early with twice the mass.
#[test]
fn a_delay_beside_a_current_is_fitted_from_parameters_that_are_off() {
    let path = "stages/sollmann-jouaneh/controllers/pid-elastic.toml";
    let truth = [
        ("cart.mass", 0.1914),
        ("cart.friction.viscous", 35.575),
        ("cart.friction.coulomb", 0.328),
        ("motor.resistance", 0.5011),
    ];
    let changes = truth.map(|(key, value)| format!("{key}={value}"));
    let real = Case::read_with(path, &changes.each_ref().map(String::as_str)).unwrap();
    let mut case = Case::read(path).unwrap();
    let mut chance = Chance::new(12);
    let logs = case.moves[..2].iter().map(|motion| of_loop(&case, motion, &real.machine, || 0.02 * chance.normal()));
    case.experiments = logs.collect::<Result<_, _>>().unwrap();
    let nuisance = Nuisances { delay: Scope::Shared, ..Nuisances::default() };
    let plan = Plan { nuisance, ..plan(&truth.map(|(key, _)| key)) };
    let found = fit(&case, &plan, None, &mut |_| Flow::Continue).unwrap();
    assert_eq!(found.ending, Ending::Converged);
    let known = truth.into_iter().chain([("delay", 0.5e-3)]);
    for (estimate, (key, value)) in found.estimates.iter().zip(known) {
        let error = estimate.error.unwrap();
        assert!((estimate.value - value).abs() < 4.0 * error, "{key}: {} ± {error}, is {value}", estimate.value);
        assert!(error < 0.01 * value, "{key}: ± {error}");
    }
}

/// A log that a controller made is met with the input as logged, and with the controller following its reference again.
#[test]
fn a_loop_is_closed_again() {
    let text = format!(
        "{TEMPLATE}\n[controller]\nevery = \"1 ms\"\ndelay = \"0.5 ms\"\nlimit = \"12 V\"\npid = {{ proportional = \"600 V/m\", integral = \"3000 V/(m s)\", derivative = \"5 V s/m\" }}\n"
    );
    let truth = [("cart.friction.viscous", 24.0), ("cart.friction.coulomb", 0.6), ("cart.mass", 0.5)];
    let keys: Vec<&str> = truth.iter().map(|(key, _)| *key).collect();
    let changes: Vec<String> = truth.iter().map(|(key, value)| format!("{key}={value}")).collect();
    let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
    let real = Case::from_text_with("axis.toml", &text, &changes).unwrap();
    let mut case = Case::from_text("axis.toml", &text).unwrap();
    let design = case.controller.clone().unwrap();

    let limits = Limits { speed: 0.25, acceleration: 3.0, jerk: Some(100.0), snap: None };
    let profile =
        Profile::new(0.0, &[Leg::To(0.08, limits), Leg::Wait(0.1), Leg::To(0.02, limits), Leg::Wait(0.2)]).unwrap();
    let rows = Rows { until: profile.end(), every: 1e-3, window: 1e-4 };
    let mut controller = Standard::new(&design, &case.machine).unwrap();
    let mut run = Trajectory::default();
    let timing = Loop::new(&design);
    stream(&real.machine, &mut [&mut controller], &timing, &[profile], &rows, Solver::Exact, false, &mut |block| {
        run.append(block);
        Flow::Continue
    })
    .unwrap();
    let step = std::f64::consts::TAU / 2048.0;
    let mut chance = Chance::new(5);
    let angle = run.get("drive_angle").unwrap().iter();
    let values = angle.map(|v| step * ((v + 1e-3 * chance.normal()) / step).round()).collect();
    case.experiments.truncate(1);
    case.experiments[0].log = Some(logged("move", &run, values));
    let closed = Plan { closed_loop: true, ..plan(&keys) };
    let found = fit(&case, &closed, None, &mut |_| Flow::Continue).unwrap();
    for (estimate, (key, value)) in found.estimates.iter().zip(truth) {
        let error = estimate.error.unwrap();
        // The loop that made the log saw counts, the one that is closed again does not.
        assert!(
            (estimate.value - value).abs() < 4.0 * error + 0.02 * value,
            "{key}: {} ± {error}, is {value}",
            estimate.value
        );
        assert!(error < 0.2 * value, "{key}: ± {error}");
    }
    let rmse = found.logs[0].outputs[0].fitted.unwrap().rmse;
    assert!(rmse < 2.0 * step, "{rmse} rad");
    // A controller that is told something else does something else.
    let mut other = case.clone();
    let design::Structure::Pid(gains) = &mut other.controller.as_mut().unwrap().structure else { panic!() };
    gains.proportional *= 0.5;
    let wrong = fit(&other, &closed, None, &mut |_| Flow::Continue).unwrap();
    assert!(wrong.logs[0].outputs[0].fitted.unwrap().rmse > 3.0 * rmse);
}

/// P7: an encoder at the motor does not tell the friction of the cart from that of the pulleys; what else is searched
/// for is told.
#[test]
fn what_an_encoder_cannot_tell_is_said_in_words() {
    let case = with_logs_of(recorded(&[], 1, 0.0));
    let plan = plan(&["drive_pulley.friction.viscous", "cart.friction.viscous", "cart.friction.coulomb"]);
    let fitted = fit(&case, &plan, None, &mut |_| Flow::Continue).unwrap();
    let told = &fitted.identifiability.as_ref().unwrap().groups[0].words;
    assert!(told.contains("B₁ + r² b + B₂ + K_t K_e/R"), "{told}");
    let choices = fitted.choices.concat().join("; ");
    assert!(choices.contains("total.viscous") && choices.contains("fix one"), "{choices}");
    assert!(!fitted.is_reliable() && fitted.ending_word() == "not_determined");
    assert!(fitted.estimates[0].error == Some(f64::INFINITY) && fitted.estimates[2].error.unwrap() < 0.02);
    let found = check(&case, &plan).unwrap();
    assert_eq!(found.identifiability.as_ref().unwrap().groups.len(), 1);
    assert_eq!(found.identifiability.as_ref().unwrap().groups[0].determined, 1);
    assert!(
        found.identifiability.as_ref().unwrap().error[0].is_infinite()
            && found.identifiability.as_ref().unwrap().error[2].is_finite()
    );
}

/// The results of many fits.
#[derive(Debug, Default)]
struct Coverage {
    /// Intervals that hold the truth, by parameter.
    held: [usize; 3],
    /// Intervals.
    all: usize,
    /// Estimates without one: at a bound, or not determined.
    lost: usize,
    /// Fits that were refused, as the log does not determine all.
    refused: usize,
    /// Fits that the truth as a start would have led further down, by more than 0.1 % of the residuals.
    astray: usize,
    /// Σ ((estimate − truth)/error)², by parameter.
    squares: [f64; 3],
}

impl Coverage {
    /// Share of the intervals of parameter `j` that hold the truth.
    fn share(&self, j: usize) -> f64 {
        3.0 * self.held[j] as f64 / self.all as f64
    }

    fn told(&self) -> String {
        let each = |j: usize| {
            let rms = (3.0 * self.squares[j] / self.all as f64).sqrt();
            format!("{} {:.1} % (errors {:.2} standard errors)", KEYS[j], 100.0 * self.share(j), rms)
        };
        let Self { lost, refused, astray, .. } = self;
        format!("{}, {}, {}; {lost} without an interval, {refused} refused, {astray} astray", each(0), each(1), each(2))
    }
}

const KEYS: [&str; 3] = ["cart.friction.viscous", "cart.friction.coulomb", "cart.mass"];

/// 95 % intervals of so many random machines, of which the encoder's shaft trembles by `noise`, rad.
fn coverage(machines: u64, noise: f64) -> Coverage {
    let mut result = Coverage::default();
    for seed in 1..=machines {
        let mut chance = Chance::new(1_000_000 + seed);
        let mut between = |low: f64, high: f64| low + (high - low) * chance.uniform();
        let truth = [between(10.0, 35.0), between(0.1, 1.5), between(0.2, 1.0)];
        let changes: Vec<String> = KEYS.iter().zip(truth).map(|(key, value)| format!("{key}={value}")).collect();
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let own = recorded(&changes, seed, noise);
        let from_truth = fit(&own, &plan(&KEYS), None, &mut |_| Flow::Continue);
        let found = fit(&with_logs_of(own), &plan(&KEYS), None, &mut |_| Flow::Continue);
        let (Ok(from_truth), Ok(found)) = (from_truth, found) else {
            result.refused += 1;
            continue;
        };
        let far = |fit: &Fit| -> f64 { fit.logs.iter().map(|log| log.outputs[0].fitted.unwrap().rmse.powi(2)).sum() };
        result.astray += usize::from(far(&found) > 1.002 * far(&from_truth));
        for (j, (estimate, value)) in found.estimates.iter().zip(truth).enumerate() {
            match (estimate.interval, estimate.error) {
                (Some([low, high]), error) if low.is_finite() => {
                    result.all += 1;
                    result.held[j] += usize::from(low <= value && value <= high);
                    // At a bound the interval is one-sided.
                    let error = error.unwrap_or((high - low) / 1.96);
                    result.squares[j] += ((estimate.value - value) / error).powi(2);
                }
                _ => result.lost += 1,
            }
        }
    }
    result
}

/// 40 machines; with `TAUT_CASES=1000`, that many at each noise, or at the one that `TAUT_NOISE` names, rad.
#[test]
fn intervals_hold_the_truth_about_as_often_as_they_say() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<f64>().ok());
    let Some(machines) = number("TAUT_CASES").map(|n| n as u64) else {
        let found = coverage(40, 1e-3);
        let share = (0..3).map(|j| found.share(j)).sum::<f64>() / 3.0;
        let all = found.lost + found.refused + found.astray == 0;
        return assert!((0.88..=1.0).contains(&share) && all, "{}", found.told());
    };
    let mut good = true;
    let only = number("TAUT_NOISE");
    for noise in [0.0, 1e-3, 3e-3, 1e-2].into_iter().filter(|noise| only.is_none_or(|only| only == *noise)) {
        let found = coverage(machines, noise);
        println!("{noise} rad: {}", found.told());
        // Without any noise the errors of rounding go with the motion; with three counts of noise, some logs tell too
        // little.
        let (least, most) = if [0.0, 1e-2].contains(&noise) { (0.9, 0.05) } else { (0.93, 0.01) };
        good &= (0..3).all(|j| (least..=0.97).contains(&found.share(j)));
        good &= found.astray.max(found.lost).max(found.refused) as f64 <= most * machines as f64;
    }
    assert!(good);
}
