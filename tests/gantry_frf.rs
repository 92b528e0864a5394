//! Frequency responses of gantries from logs of all motors: against the model's, on logs of the solvers and of the
//! sampled model, and what is said of inputs that cannot be told apart.

use crate::common::chance::Chance;
use nalgebra::{Complex, DVector};
use std::f64::consts::{PI, TAU};
use taut::case::Case;
use taut::control::feedback::Feedback;
use taut::frf::{Cut, Frf, Known, estimate_all, fit, measure};
use taut::linear::{Discrete, Hold, Operation, System};
use taut::log::{Log, Output, Quantity};
use taut::machine::Machine;
use taut::solve::{Solver, simulate};
use taut::tune::{Plant, loops};

const EVERY: f64 = 1e-3;
const AT_HOME: Known = Known { place: 0.0, bridge: 0.0, delay: 0.0 };
const SECOND: Cut = Cut { segment: Some(1.024), period: None };

const GANTRIES: [(&str, &[f64]); 3] = [
    ("stages/h-frame/h-frame.toml", &[-6.0, 2.0]),
    ("stages/core-xy/core-xy.toml", &[6.0, 2.0]),
    ("stages/dual-belt/dual-belt.toml", &[4.0, 4.0, 4.0]),
];

/// Angles of the drive pulleys, then the positions of bridge and cart.
fn quantities(machine: &Machine) -> Vec<Quantity> {
    let geometry = machine.geometry();
    let angles = geometry.drives.iter().map(|drive| format!("{}_angle", geometry.label(drive.pulley).key));
    let names: Vec<String> = angles.chain(["bridge_position".into(), "cart_position".into()]).collect();
    let of = |name: &String| *machine.quantities().iter().find(|quantity| quantity.name() == name).unwrap();
    names.iter().map(of).collect()
}

fn log(name: &str, time: Vec<f64>, inputs: Vec<Vec<f64>>, outputs: Vec<(Quantity, Vec<f64>)>) -> Log {
    let output = |(quantity, values)| Output { quantity, absolute: false, values };
    Log {
        name: name.into(),
        file: Default::default(),
        time,
        inputs,
        added: None,
        hold: taut::signal::Hold::Zero,
        reference: None,
        outputs: outputs.into_iter().map(output).collect(),
        ended: None,
    }
}

/// A run of the solvers with friction, sliding under noise on every motor, as encoders of 40 000 counts and scales with
/// 5 µm of noise see it.
fn simulated(machine: &Machine, volts: &[f64], noise: &[f64], until: f64) -> Log {
    let side = |(drive, side): (usize, &str)| {
        let (steady, size, seed) = (volts[drive], noise[drive], 3 + 5 * drive);
        format!("{side} = {{ sum = [{{ step = {steady} }}, {{ prbs = {size}, bit = 0.001, seed = {seed} }}] }}")
    };
    let inputs: Vec<String> = machine.geometry().sides().enumerate().map(side).collect();
    let file = GANTRIES.iter().find(|(file, _)| Case::read(file).unwrap().machine.kind == machine.kind).unwrap().0;
    let changes = [
        format!("experiment.0.input={{ {} }}", inputs.join(", ")),
        format!("experiment.0.until={until}"),
        "experiment.0.every=1ms".into(),
    ];
    let case = Case::read_with(file, &changes.each_ref().map(|change| &**change)).unwrap();
    let mut endless = machine.clone();
    endless.cart.travel = None;
    endless.bridge.iter_mut().for_each(|bridge| bridge.travel = None);
    let run = simulate(&endless, &case.experiments[0], Solver::for_machine(machine)).unwrap().trajectory;
    // Once everything slides.
    let column = |name: &str| run.get(name).unwrap()[1000..].to_vec();
    let mut chance = Chance::new(4);
    let count = TAU / 40_000.0;
    let mut seen = |quantity: &Quantity| -> (Quantity, Vec<f64>) {
        let values = column(quantity.name());
        let of = |value: f64| match quantity.unit() {
            "rad" => count * (value / count).floor(),
            _ => value + 5e-6 * chance.normal(),
        };
        (*quantity, values.into_iter().map(of).collect())
    };
    let outputs = quantities(machine).iter().map(&mut seen).collect();
    let volts = machine.geometry().sides().map(|side| column(&format!("{side}_voltage"))).collect();
    log("noise", column("time"), volts, outputs)
}

/// The sampled model of each input.
fn models(machine: &Machine) -> Vec<Discrete> {
    let system = System::new(machine, Operation::default()).unwrap();
    (0..machine.drives.len()).map(|drive| system.input(drive).discrete(EVERY, Hold::Zero, 0.0).unwrap()).collect()
}

fn truth(machine: &Machine, models: &[Discrete], frf: &Frf) -> Vec<Complex<f64>> {
    let output = System::new(machine, Operation::default()).unwrap().input(0).output(frf.quantity.name()).unwrap();
    frf.points.iter().map(|point| models[frf.drive].at(point.omega)[output]).collect()
}

/// A log of the sampled model, without noise.
fn made(name: &str, machine: &Machine, inputs: Vec<Vec<f64>>) -> Log {
    let samples = inputs[0].len();
    let system = System::new(machine, Operation::default()).unwrap().input(0);
    let quantities = quantities(machine);
    let mut outputs: Vec<(Quantity, Vec<f64>)> = quantities.iter().map(|q| (*q, vec![0.0; samples])).collect();
    for (model, input) in models(machine).iter().zip(&inputs) {
        let mut x = DVector::zeros(model.a.nrows());
        for (k, u) in input.iter().enumerate() {
            for (quantity, values) in &mut outputs {
                values[k] += (model.c.row(system.output(quantity.name()).unwrap()) * &x)[(0, 0)];
            }
            x = &model.a * &x + &model.b * *u;
        }
    }
    log(name, (0..samples).map(|k| k as f64 * EVERY).collect(), inputs, outputs)
}

fn white(seed: u64, samples: usize) -> Vec<f64> {
    let mut chance = Chance::new(seed);
    (0..samples).map(|_| 3.0 * (chance.uniform() - 0.5).signum()).collect()
}

fn core_xy() -> Machine {
    Case::read("stages/core-xy/core-xy.toml").unwrap().machine
}

/// Every response of each kind, from 5 Hz to 150 Hz: circles hold the model's, and the mean of the errors is half a per
/// cent and what noise makes of it, at most.
#[test]
fn circles_hold_the_response_of_the_model() {
    for (file, volts) in GANTRIES {
        let machine = Case::read(file).unwrap().machine;
        let log = simulated(&machine, volts, &[3.0; 3], 40.0);
        let (frfs, warnings) = estimate_all(machine.kind, &[&log], &SECOND).unwrap();
        let drives = machine.drives.len();
        assert!(frfs.len() == drives * (drives + 2) && warnings.is_empty(), "{file}: {warnings:?}");
        let models = models(&machine);
        let (mut holds, mut all) = (0, 0);
        for frf in &frfs {
            assert!(frf.alike < 0.1, "{file} {}: {}", frf.title(), frf.alike);
            let truth = truth(&machine, &models, frf);
            let points = frf.points.iter().zip(&truth).filter(|(point, _)| {
                (5.0..150.0).contains(&(point.omega / TAU)) && point.coherence > taut::frf::COHERENT
            });
            let errors: Vec<Complex<f64>> =
                points.clone().map(|(point, truth)| (point.value - truth) / truth).collect();
            let noise: f64 = points.clone().map(|(point, truth)| (point.deviation / truth.norm()).powi(2)).sum();
            holds += points.filter(|(point, truth)| (point.value - **truth).norm() <= point.radius).count();
            all += errors.len();
            // What is hardly moved is coherent nowhere.
            if errors.len() > 50 {
                let off = errors.iter().sum::<Complex<f64>>().norm() / errors.len() as f64;
                let most = 0.005 + 3.0 * noise.sqrt() / errors.len() as f64;
                assert!(off < most, "{file} {}: {off} of {}, {most}", frf.title(), errors.len());
            }
        }
        let share = holds as f64 / all as f64;
        println!("{file}: {share} of {all}");
        assert!(all > 500 && share > 0.93, "{file}: {share} of {all}");
    }
}

/// Motors that are moved one after the other, in logs of their own, tell the same.
#[test]
fn logs_of_one_motor_after_the_other_are_taken_together() {
    let machine = core_xy();
    let [left, right] = [[3.0, 0.0], [0.0, 3.0]].map(|noise| simulated(&machine, &[6.0, 2.0], &noise, 20.0));
    let logs = [Log { name: "left".into(), ..left }, Log { name: "right".into(), ..right }];
    let (frfs, warnings) = estimate_all(machine.kind, &logs.each_ref(), &SECOND).unwrap();
    assert!(frfs.len() == 8 && warnings.is_empty() && frfs[0].name == "left, right", "{warnings:?}");
    let models = models(&machine);
    let (mut holds, mut all) = (0, 0);
    for frf in &frfs {
        let truth = truth(&machine, &models, frf);
        let used = frf.points.iter().zip(&truth).filter(|(point, _)| point.coherence > 0.5 && point.omega < 900.0);
        holds += used.clone().filter(|(point, truth)| (point.value - **truth).norm() <= point.radius).count();
        all += used.count();
    }
    assert!(all > 300 && holds as f64 > 0.93 * all as f64, "{holds} of {all}");
    // One of the logs tells of its own motor alone.
    let (frfs, warnings) = estimate_all(machine.kind, &[&logs[0]], &SECOND).unwrap();
    assert!(frfs.len() == 4 && frfs.iter().all(|frf| frf.input == "left_input"));
    assert_eq!(warnings, ["left: no change of right_input; it has no response"]);
}

/// Of whole periods in which each motor has lines of its own, each has a response at these; without noise the model's.
#[test]
fn periods_with_lines_of_their_own() {
    let machine = core_xy();
    let sines = |first: usize| -> Vec<f64> {
        let lines: Vec<usize> = (0..70).map(|k| first + 4 * k).collect();
        let one = |t: f64| -> f64 {
            let sine = |(i, line): (usize, &usize)| (TAU * *line as f64 * t - PI * (i * i) as f64 / 70.0).cos();
            lines.iter().enumerate().map(sine).sum()
        };
        (0..12_000).map(|k| 0.2 * one((k % 1000) as f64 * EVERY)).collect()
    };
    let log = made("periods", &machine, vec![sines(2), sines(4)]);
    let (frfs, warnings) = estimate_all(machine.kind, &[&log], &Cut { segment: None, period: Some(1.0) }).unwrap();
    assert!(frfs.len() == 8 && warnings.is_empty(), "{warnings:?}");
    let models = models(&machine);
    for frf in &frfs {
        assert_eq!((frf.points.len(), frf.alike), (70, 0.0), "{}", frf.title());
        for (point, truth) in frf.points.iter().zip(truth(&machine, &models, frf)) {
            assert!((point.value / truth - 1.0).norm() < 0.02, "{}: {point:?} {truth}", frf.title());
        }
    }
}

#[test]
fn inputs_that_are_alike_are_refused_and_said() {
    let machine = core_xy();
    let told = |inputs: Vec<Vec<f64>>| {
        let log = made("both", &machine, inputs);
        estimate_all(machine.kind, &[&log], &Cut::default()).unwrap_err().to_string()
    };
    let [one, other] = [3, 8].map(|seed| white(seed, 8000));
    let same = told(vec![one.clone(), one.clone()]);
    assert!(same.contains("left_input and right_input cannot be told apart: their coherence is 1.000"), "{same}");
    assert!(same.contains("at most 0.95") && same.contains("move one motor after the other"), "{same}");
    let against = told(vec![one.clone(), one.iter().map(|u| -0.5 * u).collect()]);
    assert!(against.contains("cannot be told apart"), "{against}");
    let still = told(vec![vec![1.0; 8000], vec![0.0; 8000]]);
    assert!(still.contains("no change of left_input and right_input"), "{still}");
    // With much in common they are told apart, and it is said how much.
    let mixed = one.iter().zip(&other).map(|(a, b)| a + 0.7 * b).collect();
    let log = made("both", &machine, vec![one.clone(), mixed]);
    let (frfs, warnings) = estimate_all(machine.kind, &[&log], &Cut::default()).unwrap();
    assert!(warnings.is_empty() && (0.55..0.85).contains(&frfs[0].alike), "{} {warnings:?}", frfs[0].alike);
    // Of three motors two that are alike do not hide the third.
    let dual = Case::read("stages/dual-belt/dual-belt.toml").unwrap().machine;
    let log = made("sides", &dual, vec![one.clone(), one, other]);
    let (frfs, warnings) = estimate_all(dual.kind, &[&log], &Cut::default()).unwrap();
    assert!(frfs.iter().all(|frf| frf.input == "cart_input") && frfs.len() == 5);
    assert!(warnings[0].contains("left_input and right_input cannot be told apart"), "{warnings:?}");
}

#[test]
fn logs_that_do_not_belong_together_are_refused() {
    let machine = core_xy();
    let [one, rest] = [white(3, 8000), vec![0.0; 8000]];
    let left = made("left", &machine, vec![one.clone(), rest.clone()]);
    let right = made("right", &machine, vec![rest, one]);
    let told = |other: &Log| estimate_all(machine.kind, &[&left, other], &Cut::default()).unwrap_err().to_string();
    let slow = Log { time: right.time.iter().map(|t| 2.0 * t).collect(), ..right.clone() };
    assert!(
        told(&slow).contains("\"left\" has a sample every 0.001000 s, \"right\" every 0.002000 s"),
        "{}",
        told(&slow)
    );
    let outputs = vec![Output { quantity: Quantity::LeftCurrent, ..right.outputs[0].clone() }];
    let other = told(&Log { outputs, ..right.clone() });
    assert!(other.contains("they have no output in common"), "{other}");
    let short = told(&made("short", &machine, vec![white(1, 20); 2]));
    assert!(short.contains("segments of 2 samples"), "{short}");
}

/// Stiffness and delay of a CoreXY whose belts are 1.2 times as stiff as the file says.
#[test]
fn stiffness_of_all_belts() {
    let mut stiffer = core_xy();
    stiffer.belt.stiffness = stiffer.belt.stiffness.map(|k| 1.2 * k);
    stiffer.belt.damping = stiffer.belt.stiffness.map(|k| 4e-5 * k);
    let log = made("both", &stiffer, vec![white(3, 40_000), white(8, 40_000)]);
    let (frfs, _) = estimate_all(stiffer.kind, &[&log], &SECOND).unwrap();
    let found = fit(&core_xy(), &AT_HOME, &frfs).unwrap();
    let (stiffness, [low, high]) = found.stiffness;
    assert!((stiffness - 1.2).abs() < 0.01 && low < high, "{stiffness} {low} {high}");
    assert!(
        (found.damping.0 / 4e-5 - 1.0).abs() < 0.1 && found.delay.0 < 2e-5,
        "{:?} {:?}",
        found.damping,
        found.delay
    );
    assert_eq!(found.spans.len(), 4);
}

/// Margins of both loops around what was measured are those around the model.
#[test]
fn measured_margins_of_both_loops() {
    let gains = "controller.pid={ proportional = \"3 V/mm\", derivative = \"20 V s/m\" }";
    let mut case = Case::read_with("stages/core-xy/square.toml", &[gains]).unwrap();
    let log = made("both", &case.machine, vec![white(3, 120_000), white(8, 120_000)]);
    let mut experiment = Case::read("stages/core-xy/belts.toml").unwrap().experiments.remove(0);
    experiment.log = Some(log.into());
    case.experiments = vec![experiment];
    let known = Known::new(&case, None, None, None).unwrap();
    let found = measure(&case, &Cut { segment: Some(2.048), period: None }, known).unwrap();
    let design = case.controller.clone().unwrap();
    let plant = Plant::new(&case.machine, Operation::default(), &design, &[]).unwrap();
    let all = loops(&plant, &Feedback::new(&design, &case.machine).unwrap());
    // Of each drive the response of what it measures, and of nothing else.
    let own: Vec<_> = found.responses.iter().filter_map(|one| Some((one.frf.title(), one.margins?))).collect();
    assert!(own.len() == 2 && own[0].0 == "both: left_input to left_angle", "{own:?}");
    for (_, margins) in own {
        let [low, high] = margins.range;
        let seen = plant.frequency.iter().zip(&all).filter(|(omega, _)| (low..high).contains(*omega));
        let exact = seen.map(|(_, loops)| loops.sensitivity()).fold(0.0, f64::max);
        assert!((margins.sensitivity.0 / exact - 1.0).abs() < 0.1, "{margins:?} {exact}");
        assert!(margins.sensitivity_at_most >= margins.sensitivity.0);
    }
}

#[test]
fn a_place_that_is_none_is_refused() {
    let gantry = Case::read("stages/core-xy/belts.toml").unwrap();
    let axis = Case::read("stages/sollmann-jouaneh/table4.toml").unwrap();
    let told = Known::new(&axis, None, Some(0.1), None).unwrap_err().to_string();
    assert!(told.contains("this machine has no bridge"), "{told}");
    assert!(Known::new(&gantry, Some(0.1), Some(-0.2), None).is_ok());
    let stage = Case::read("stages/core-xy/core-xy.toml").unwrap();
    let told = Known::new(&stage, None, Some(1.0), None).unwrap_err().to_string();
    assert!(told.contains("outside the travel"), "{told}");
    let told = measure(&stage, &Cut::default(), AT_HOME).unwrap_err();
    assert!(told.next.unwrap().contains("left_input = \"u1\", right_input"));
}
