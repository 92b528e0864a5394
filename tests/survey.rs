//! Surveys of logs: of measured ones, and of a simulated one with a known fault.

use crate::common;
use std::f64::consts::TAU;
use taut::case::{Case, TEMPLATE};
use taut::log::{Log, Output, Quantity, Severity, Survey};
use taut::machine::Machine;
use taut::signal::{Hold, Signal};
use taut::solve::{Solver, simulate};

/// The paper's machine on a square wave of ±5 V: a clean log of angle, position, speed and current every millisecond.
fn clean() -> (Machine, Log) {
    let stage = common::table4();
    let input = Signal::Square { amplitude: 5.0, frequency: 1.0, duty: 0.5 };
    let experiment = common::experiment(input.clone(), 2.0);
    let run = simulate(&stage, &experiment, Solver::Exact).unwrap().trajectory;
    let column = |name: &str| run.get(name).unwrap().to_vec();
    let output = |quantity: Quantity| Output { quantity, absolute: false, values: column(quantity.name()) };
    let time = column("time");
    let quantities = [Quantity::DriveAngle, Quantity::CartPosition, Quantity::CartSpeed, Quantity::MotorCurrent];
    let log = Log {
        name: "square".into(),
        file: "square.csv".into(),
        inputs: vec![time.iter().map(|&t| input.value(t)).collect()],
        time,
        hold: Hold::Zero,
        added: None,
        reference: None,
        outputs: quantities.into_iter().map(output).collect(),
        ended: None,
    };
    (stage, log)
}

/// The log with only this output.
fn only(log: &Log, quantity: Quantity) -> Log {
    Log { outputs: vec![log.output(quantity).unwrap().clone()], ..log.clone() }
}

fn values(log: &mut Log, quantity: Quantity) -> &mut Vec<f64> {
    &mut log.outputs.iter_mut().find(|output| output.quantity == quantity).unwrap().values
}

/// Noise of standard deviation one, nearly Gaussian.
fn gaussian() -> impl Iterator<Item = f64> {
    let mut seed = 1u64;
    let mut uniform = move || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    std::iter::repeat_with(move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0)
}

#[track_caller]
fn says(log: &Log, code: &str, words: &str) {
    let survey = Survey::new(log, &clean().0);
    let found = survey.notes.iter().any(|note| note.code == code && note.text.contains(words));
    assert!(found, "no `{code}` with {words:?} in\n{survey}");
}

#[test]
fn a_clean_log_raises_no_suspicion() {
    let (stage, log) = clean();
    let survey = Survey::new(&log, &stage);
    println!("{survey}");
    assert!(survey.notes.iter().all(|note| note.severity == Severity::Fact), "{survey}");
    let motion = survey.motion.as_ref().unwrap();
    assert!(motion.moves && motion.begins_at_rest);
    assert_eq!(motion.reversals.len(), 3);
    for (turn, expected) in motion.reversals.iter().zip([0.5, 1.0, 1.5]) {
        assert!((turn - expected).abs() < 0.02, "{turn}");
    }
    assert!((motion.steady[0].speed - 0.22362).abs() < 2e-4 && motion.steady[0].input == 5.0);
    for quantity in [Quantity::DriveAngle, Quantity::CartSpeed] {
        let survey = Survey::new(&only(&log, quantity), &stage);
        assert!(survey.notes.iter().all(|note| note.severity == Severity::Fact), "{survey}");
    }
}

#[test]
fn wrong_units_are_suspected_aloud() {
    let (_, log) = clean();
    let scaled = |quantity: Quantity, factor: f64| {
        let mut log = only(&log, quantity);
        values(&mut log, quantity).iter_mut().for_each(|x| *x *= factor);
        log
    };
    says(&scaled(Quantity::CartPosition, 1e3), "unit", "units = { cart_position = \"mm\" }");
    says(&scaled(Quantity::DriveAngle, 180.0 / std::f64::consts::PI), "unit", "units = { drive_angle = \"deg\" }");
    says(&scaled(Quantity::CartSpeed, 1e3), "unit", "units = { cart_speed = \"mm/s\" }");
    says(&scaled(Quantity::CartPosition, 1e-3), "unit", "1/1");
    let mut two = log.clone();
    values(&mut two, Quantity::MotorCurrent).iter_mut().for_each(|x| *x *= 1e3);
    says(&two, "unit", "units = { motor_current = \"mA\" }");
    let mut two = log.clone();
    values(&mut two, Quantity::CartPosition).iter_mut().for_each(|x| *x *= 1e3);
    says(&two, "unit", "drive_angle reports for the same position");
    let mut input = log.clone();
    input.inputs[0].iter_mut().for_each(|u| *u *= 1e3);
    says(&input, "unit", "units = { input = \"mV\" }");
    let mut time = log.clone();
    time.time.iter_mut().for_each(|t| *t *= 1e3);
    says(&time, "time-unit", "units = { time = \"ms\" }");
    says(&time, "unit", "cart_speed adds up to");
}

/// A gain in newtons was answered with "it reaches 317.6 A, beyond any drive of this kind: is the column in mA?".
#[test]
fn newtons_are_no_amperes() {
    let (mut machine, log) = clean();
    let note = |machine: &Machine, log: &Log| {
        let survey = Survey::new(&only(log, Quantity::CartPosition), machine);
        survey
            .notes
            .iter()
            .find(|note| note.column == Some("input") && note.code == "unit")
            .map(|note| note.text.clone())
    };
    machine.drives[0].amplifier.mode = taut::machine::AmplifierMode::Current;
    machine.drives[0].amplifier.gain = 100.0;
    // A column that is not in amperes by itself: the gain is as likely to be wrong as a unit.
    let text = note(&machine, &log).unwrap();
    assert!(text.contains("500 A") && text.contains("amplifier.gain") && !text.contains("mA"), "{text}");
    let mut large = log.clone();
    large.inputs[0].iter_mut().for_each(|u| *u *= 100.0);
    machine.drives[0].amplifier.gain = 1.0;
    assert!(note(&machine, &large).unwrap().contains("units = { input = \"mA\" }"));
    // One newton per ampere: a force.
    let motor = &mut machine.drives[0].motor;
    motor.torque_constant = machine.pulley_radius / motor.gear_ratio / motor.gear_efficiency;
    assert_eq!(note(&machine, &large), None);
}

/// A rotor's angle before the gear was taken for degrees, or for nothing that has a name.
#[test]
fn a_gear_ratio_is_tried() {
    let (mut machine, log) = clean();
    machine.drives[0].motor.gear_ratio = 40.0;
    machine.drives[0].motor.torque_constant /= 40.0;
    machine.drives[0].motor.back_emf_constant /= 40.0;
    let mut own = only(&log, Quantity::DriveAngle);
    own.outputs[0].values.iter_mut().for_each(|x| *x *= 40.0);
    let survey = Survey::new(&own, &machine);
    assert!(survey.notes.iter().any(|note| note.text.contains("scale = { drive_angle = 0.025 }")), "{survey}");
    // Beside the cart's position the ratio is exact, and so is the gear's.
    let mut both = log.clone();
    both.outputs.truncate(2);
    values(&mut both, Quantity::DriveAngle).iter_mut().for_each(|x| *x *= 40.0);
    let survey = Survey::new(&both, &machine);
    assert!(survey.notes.iter().any(|note| note.text.contains("that is the gear ratio")), "{survey}");
    values(&mut both, Quantity::DriveAngle).iter_mut().for_each(|x| *x *= 2.5);
    let survey = Survey::new(&both, &machine);
    assert!(survey.notes.iter().any(|note| note.text.contains("that is a power of ten")), "{survey}");
}

#[test]
fn swapped_columns_and_signs_are_suspected() {
    let (_, log) = clean();
    let mut swapped = log.clone();
    swapped.outputs.remove(3);
    swapped.outputs.remove(2);
    let angle = swapped.outputs[0].values.clone();
    swapped.outputs[0].values = std::mem::replace(&mut swapped.outputs[1].values, angle);
    says(&swapped, "swapped", "exchanged, they agree with the pulley's radius of 19.4 mm");
    let mut exchanged = only(&log, Quantity::CartPosition);
    std::mem::swap(&mut exchanged.inputs[0], &mut exchanged.outputs[0].values);
    says(&exchanged, "swapped", "as an input does");
    let mut sign = only(&log, Quantity::CartPosition);
    sign.outputs[0].values.iter_mut().for_each(|x| *x = -*x);
    says(&sign, "sign", "against its input");
    let mut one = log.clone();
    values(&mut one, Quantity::CartSpeed).iter_mut().for_each(|x| *x = -*x);
    says(&one, "sign", "it moves against cart_speed");
}

#[test]
fn clocks() {
    let (_, log) = clean();
    let mut gaps = log.clone();
    let cut = |values: &mut Vec<f64>| drop(values.drain(300..340));
    cut(&mut gaps.time);
    cut(&mut gaps.inputs[0]);
    gaps.outputs.iter_mut().for_each(|output| cut(&mut output.values));
    says(&gaps, "gaps", "one gap of 41 ms after 0.299 s, where 40 samples are missing");
    let mut jitter = log.clone();
    jitter.time.iter_mut().enumerate().for_each(|(k, t)| *t += 2e-4 * (k as f64 * 1.7).sin());
    says(&jitter, "jitter", "intervals differ by 21 %");
    let mut coarse = log.clone();
    coarse.time.iter_mut().for_each(|t| *t = (*t * 3.3e3).round() / 1e3);
    says(&coarse, "coarse-clock", "steps of 1 ms");
    let few = Log {
        time: log.time[..30].to_vec(),
        inputs: vec![log.inputs[0][..30].to_vec()],
        outputs: vec![Output { values: log.outputs[0].values[..30].to_vec(), ..log.outputs[0].clone() }],
        ..log.clone()
    };
    says(&few, "few-samples", "30 samples");
}

/// A last time of 1e308, such as a damaged file has, made the number of samples that are missing overflow.
#[test]
fn a_time_beyond_all_others_is_a_gap() {
    let (_, mut log) = clean();
    let last = log.time.len() - 1;
    log.time[last] = 1e308;
    says(&log, "gaps", "one gap of 1e308 s after 1.999 s");
    log.time[last - 1] = 1e300;
    says(&log, "gaps", "2 gaps");
}

#[test]
fn faults_of_single_columns() {
    let (_, log) = clean();
    let mut position = only(&log, Quantity::CartPosition);
    values(&mut position, Quantity::CartPosition)[700] += 0.05;
    values(&mut position, Quantity::CartPosition)[900] -= 0.04;
    says(&position, "outliers", "2 samples stand out from their neighbours; the first is");
    for end in [0, 1] {
        let mut position = only(&log, Quantity::CartPosition);
        let at = end * (position.time.len() - 1);
        values(&mut position, Quantity::CartPosition)[at] += 0.05;
        says(&position, "outliers", "one sample stands out");
    }
    let mut clipped = only(&log, Quantity::MotorCurrent);
    values(&mut clipped, Quantity::MotorCurrent).iter_mut().for_each(|i| *i = i.clamp(-3.0, 3.0));
    says(&clipped, "no-motion", "electrical");
    let mut stop = only(&log, Quantity::CartPosition);
    values(&mut stop, Quantity::CartPosition).iter_mut().for_each(|x| *x = x.min(0.08));
    says(&stop, "saturation", "80 mm");
    let mut missing = only(&log, Quantity::CartPosition);
    values(&mut missing, Quantity::CartPosition)[1000..1030].fill(f64::NAN);
    says(&missing, "missing", "30 samples have no value (1.5 %), at most 30 in a row, from 1 s on");
    let mut constant = log.clone();
    values(&mut constant, Quantity::DriveAngle).fill(0.5);
    says(&constant, "constant", "0.5 rad throughout");
    let mut still = only(&log, Quantity::CartPosition);
    values(&mut still, Quantity::CartPosition).iter_mut().zip(gaussian()).for_each(|(x, n)| *x = 1e-6 * n);
    says(&still, "still", "does not move");
    let mut wraps = only(&log, Quantity::DriveAngle);
    values(&mut wraps, Quantity::DriveAngle).iter_mut().for_each(|phi| *phi = (*phi + 3.0).rem_euclid(TAU));
    says(&wraps, "wraps", "a full turn");
    let mut lost = only(&log, Quantity::DriveAngle);
    values(&mut lost, Quantity::DriveAngle)[700..].iter_mut().for_each(|phi| *phi -= 0.02);
    says(&lost, "jumps", "mrad at 0.7 s");
    let mut coarse = only(&log, Quantity::CartPosition);
    values(&mut coarse, Quantity::CartPosition).iter_mut().for_each(|x| *x = (*x / 0.01).round() * 0.01);
    says(&coarse, "quantisation", "steps of 10 mm");
    let mut absolute = only(&log, Quantity::CartSpeed);
    absolute.outputs[0].absolute = true;
    says(&absolute, "negative", "declared absolute");
}

#[test]
fn steps_and_noise_are_measured() {
    let (stage, log) = clean();
    let mut counted = only(&log, Quantity::DriveAngle);
    let step = TAU / 2048.0;
    values(&mut counted, Quantity::DriveAngle).iter_mut().for_each(|x| *x = (*x / step).round() * step);
    let channel = Survey::new(&counted, &stage).channel("drive_angle").unwrap().clone();
    assert!((channel.step.unwrap() / step - 1.0).abs() < 1e-6, "{channel:?}");
    // Printed to so few digits that the steps are uneven.
    values(&mut counted, Quantity::DriveAngle).iter_mut().for_each(|x| *x = (*x * 1e4).round() / 1e4);
    let channel = Survey::new(&counted, &stage).channel("drive_angle").unwrap().clone();
    assert!((channel.step.unwrap() / step - 1.0).abs() < 1e-3, "{channel:?}");
    let mut noisy = only(&log, Quantity::CartPosition);
    values(&mut noisy, Quantity::CartPosition).iter_mut().zip(gaussian()).for_each(|(x, n)| *x += 2e-4 * n);
    let channel = Survey::new(&noisy, &stage).channel("cart_position").unwrap().clone();
    assert!((channel.noise / 2e-4 - 1.0).abs() < 0.1, "{channel:?}");
    assert_eq!(channel.step, None);
}

/// The survey of the machines whose logs are published raises no wrong suspicion.
#[test]
fn measured_data_of_others() {
    let files = ["pendulepi/february.csv", "emps/estimation.mat", "ced/DATAUNIF.csv", "ced/DATAPRBS.csv"];
    if common::data::data(files).is_none() {
        return;
    }
    let data = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let machine = &TEMPLATE[..TEMPLATE.find("[[experiment]]").unwrap()];
    for log in [
        r#"file = "pendulepi/february.csv", time = "time_us", input = "pwm", cart_position = "position", units = { time = "us" }, scale = { input = "12/255" }, split = "pwm", where = { column = "pwm", is = [-250, -50, 50, 100] }"#,
        r#"file = "emps/estimation.mat", time = "t", input = "vir", cart_position = "qm""#,
        r#"file = "ced/DATAUNIF.csv", time = { every = "20 ms" }, input = "u11", drive_speed = "z11", absolute = ["drive_speed"]"#,
        r#"file = "ced/DATAPRBS.csv", time = { every = "20 ms" }, input = "u3", drive_speed = "z3", absolute = ["drive_speed"]"#,
    ] {
        let text = format!("{machine}[[experiment]]\nname = \"run\"\nlog = {{ {log} }}\n");
        let case = Case::from_text(data.join("case.toml"), &text).unwrap_or_else(|error| panic!("{error}"));
        for experiment in case.experiments {
            let survey = Survey::new(experiment.log.as_ref().unwrap(), &case.machine);
            println!("{survey}\n");
            assert!(survey.motion.as_ref().unwrap().moves, "{survey}");
            assert!(!survey.has("swapped") && !survey.has("sign") && !survey.has("unit"), "{survey}");
        }
    }
}
