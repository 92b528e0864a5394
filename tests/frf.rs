//! Frequency responses from logs: against the sampled model that made them, in open and closed loop, and what is said
//! of logs that have none.

use nalgebra::{Complex, DVector};
use std::f64::consts::PI;
use std::sync::Arc;
use taut::case::Case;
use taut::frf::{Cut, Frf, Known, estimate, fit, measure, measured};
use taut::linear::{Discrete, Hold, Operation, StateSpace};
use taut::log::{Log, Output, Quantity};
use taut::machine::Machine;

const EVERY: f64 = 1e-3;

fn stage() -> Machine {
    let mut stage = Case::read("stages/sollmann-jouaneh/table4.toml").unwrap().machine;
    stage.belt.make = None;
    stage.belt.damping = stage.belt.stiffness.map(|k| 5e-5 * k);
    stage
}

fn model(stage: &Machine, delay: f64) -> (Discrete, usize) {
    let system = StateSpace::new(stage, Operation::default()).unwrap();
    let output = system.output("drive_angle").unwrap();
    (system.discrete(EVERY, Hold::Zero, delay).unwrap(), output)
}

/// Numbers from −1 to 1.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        2.0 * ((self.0 >> 11) as f64 / (1u64 << 53) as f64) - 1.0
    }
}

/// A log of the sampled model: open loop, or with u = K (r − y). `noise` is uniform on the angle.
fn log(model: &(Discrete, usize), input: &dyn Fn(usize) -> f64, gain: Option<f64>, noise: f64, samples: usize) -> Log {
    let (discrete, output) = model;
    let mut chance = Chance(7);
    let mut x = DVector::zeros(discrete.a.nrows());
    let (mut time, mut u, mut y, mut r) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for k in 0..samples {
        let row = discrete.c.row(*output);
        let seen = (row * &x)[(0, 0)] + noise * chance.next();
        let command = gain.map_or(input(k), |gain| gain * (input(k) - seen));
        time.push(k as f64 * EVERY);
        u.push(command);
        y.push(seen);
        r.push(input(k));
        x = &discrete.a * &x + &discrete.b * command;
    }
    Log {
        added: None,
        ended: None,
        name: "made".into(),
        file: "made.csv".into(),
        time,
        inputs: vec![u],
        hold: taut::signal::Hold::Zero,
        reference: gain.map(|_| r),
        outputs: vec![Output { quantity: Quantity::DriveAngle, absolute: false, values: y }],
    }
}

fn white(samples: usize, size: f64) -> impl Fn(usize) -> f64 {
    let mut chance = Chance(3);
    let values: Vec<f64> = (0..samples).map(|_| size * chance.next().signum()).collect();
    move |k| values[k]
}

/// Share of the coherent points between two frequencies whose circle holds the truth, how many there are, and the mean
/// relative error.
fn held(frf: &Frf, truth: &(Discrete, usize), hertz: [f64; 2]) -> (f64, usize, f64) {
    let mut off = Complex::new(0.0, 0.0);
    let (mut holds, mut count) = (0, 0);
    for point in frf.coherent().filter(|point| (hertz[0]..hertz[1]).contains(&(point.omega / (2.0 * PI)))) {
        let exact = truth.0.at(point.omega)[truth.1];
        holds += usize::from((point.value - exact).norm() <= point.radius);
        off += (point.value - exact) / exact;
        count += 1;
    }
    (holds as f64 / count as f64, count, off.norm() / count as f64)
}

#[test]
fn open_loop_circles_hold_the_truth() {
    let truth = model(&stage(), 0.6e-3);
    let log = log(&truth, &white(60_000, 3.0), None, 2e-5, 60_000);
    let cut = Cut { segment: Some(1.024), period: None };
    let frf = &estimate(&log, &cut).unwrap()[0];
    assert!(!frf.closed && frf.segments > 100);
    let (share, count, off) = held(frf, &truth, [5.0, 120.0]);
    assert!(count > 100 && (0.9..=1.0).contains(&share) && off < 0.01, "{share} of {count}, {off}");
}

/// A controller answers noise: what input and output then have in common is in part −1/C. By the reference it is not.
#[test]
fn closed_loop_by_the_reference() {
    let truth = model(&stage(), 0.6e-3);
    let log = log(&truth, &white(80_000, 1e-3), Some(25.0), 2e-3, 80_000);
    let cut = Cut { segment: Some(1.024), period: None };
    let joint = &estimate(&log, &cut).unwrap()[0];
    assert!(joint.closed);
    let direct = &estimate(&Log { reference: None, ..log.clone() }, &cut).unwrap()[0];
    let error = |frf: &Frf| -> f64 {
        let near = frf.points.iter().filter(|point| (1.0..10.0).contains(&(point.omega / (2.0 * PI))));
        let all: Vec<Complex<f64>> =
            near.map(|point| (point.value / truth.0.at(point.omega)[truth.1]) - Complex::new(1.0, 0.0)).collect();
        (all.iter().sum::<Complex<f64>>() / all.len() as f64).norm()
    };
    assert!(error(joint) < 0.3 * error(direct), "{} {}", error(joint), error(direct));
}

/// Of whole periods nothing leaks: without noise the response is the model's.
/// Of logs in closed loop only 78 % of the circles below 20 Hz held the truth: the window smears the way from the
/// reference to the input, which rises there, by some per cent, of which circles of noise know nothing.
#[test]
fn circles_at_low_frequencies_in_closed_loop_hold_the_truth() {
    let truth = model(&stage(), 0.6e-3);
    let log = log(&truth, &white(60_000, 0.05), Some(25.0), 5e-5, 60_000);
    let cut = Cut { segment: Some(1.024), period: None };
    let frf = &estimate(&log, &cut).unwrap()[0];
    let (share, count, off) = held(frf, &truth, [2.9, 20.0]);
    assert!(frf.closed && count >= 15 && share >= 0.85 && off < 0.004, "{share} of {count}, {off}");
}

#[test]
fn periods_are_exact() {
    let truth = model(&stage(), 0.6e-3);
    // Every third line of a second, with phases that keep it low.
    let lines: Vec<usize> = (1..150).map(|k| 3 * k).collect();
    let multisine = move |k: usize| -> f64 {
        let t = (k % 1000) as f64 * EVERY;
        let one = |(i, line): (usize, &usize)| (2.0 * PI * *line as f64 * t - PI * (i * i) as f64 / 149.0).cos();
        0.2 * lines.iter().enumerate().map(one).sum::<f64>()
    };
    let log = log(&truth, &multisine, None, 0.0, 12_000);
    let frf = &estimate(&log, &Cut { segment: None, period: Some(1.0) }).unwrap()[0];
    assert_eq!(frf.points.len(), 149);
    for point in frf.points.iter().filter(|point| point.omega < 2.0 * PI * 400.0) {
        let exact = truth.0.at(point.omega)[truth.1];
        assert!((point.value / exact - 1.0).norm() < 0.02, "{} Hz: {} {exact}", point.omega / (2.0 * PI), point.value);
    }
}

/// Stiffness, damping and delay of the machine that made the log, from a file that is off in all three.
#[test]
fn stiffness_damping_and_delay() {
    let mut machine = stage();
    machine.belt.stiffness = machine.belt.stiffness.map(|k| 1.3 * k);
    machine.belt.damping = machine.belt.stiffness.map(|k| 6e-5 * k);
    let truth = model(&machine, 0.9e-3);
    let log = log(&truth, &white(60_000, 3.0), None, 2e-6, 60_000);
    let frfs = estimate(&log, &Cut { segment: Some(1.024), period: None }).unwrap();
    let found = fit(&stage(), &Known { place: 0.0, bridge: 0.0, delay: 0.2e-3 }, &frfs).unwrap();
    let near = |(value, _): (f64, [f64; 2]), truth: f64, within: f64| (value / truth - 1.0).abs() < within;
    assert!(
        near(found.stiffness, 1.3, 0.01) && near(found.delay, 0.9e-3, 0.02),
        "{:?} {:?}",
        found.stiffness,
        found.delay
    );
    assert!(near(found.damping, 6e-5, 0.1) && near(found.gain, 1.0, 0.01), "{:?} {:?}", found.damping, found.gain);
    let [low, high] = found.stiffness.1;
    assert!(low < 1.3 && 1.3 < high && high - low < 0.05, "{low} {high}");
}

/// Delays of many samples were states of the model, of which there were as many as the fit tried: it did not end on
/// logs that are late, early or of the other sign.
#[test]
fn long_delays_are_found_and_early_or_negated_outputs_are_named() {
    let truth = model(&stage(), 20.4e-3);
    let made = log(&truth, &white(20_000, 3.0), None, 2e-6, 20_000);
    let fitted = |log: &Log| {
        let frfs = estimate(log, &Cut { segment: Some(1.024), period: None }).unwrap();
        fit(&stage(), &Known { place: 0.0, bridge: 0.0, delay: 0.0 }, &frfs)
    };
    let found = fitted(&made).unwrap();
    let (delay, [low, high]) = found.delay;
    assert!(
        (delay - 20.4e-3).abs() < 0.05e-3 && low <= delay && delay <= high && !found.is_far(),
        "{delay} {}",
        found.chi
    );
    assert!((found.stiffness.0 - 1.0).abs() < 0.01, "{:?}", found.stiffness);
    let changed = |change: &dyn Fn(&mut Vec<f64>)| {
        let mut log = made.clone();
        change(&mut log.outputs[0].values);
        fitted(&log).unwrap_err().to_string()
    };
    let early = changed(&|values| {
        values.drain(..40);
        values.extend([0.0; 40]);
    });
    // 40 ms before an answer that is 20.4 ms late, within half a sample.
    assert!(early.contains("19.5") && early.contains("before the input"), "{early}");
    let negated = changed(&|values| values.iter_mut().for_each(|value| *value = -*value));
    assert!(negated.contains("the sign of made: drive_angle is opposite to the model's"), "{negated}");
    let mut turned = stage();
    turned.drives[0].amplifier.gain = -1.0;
    let frfs = estimate(&made, &Cut { segment: Some(1.024), period: None }).unwrap();
    let error = fit(&turned, &Known { place: 0.0, bridge: 0.0, delay: 0.0 }, &frfs).unwrap_err().to_string();
    assert!(error.contains("opposite"), "{error}");
}

/// A log whose input is straight between samples, for which the model of a held one would be 17 % too stiff.
#[test]
fn a_straight_input_is_modelled_as_such() {
    let mut machine = stage();
    machine.belt.stiffness = machine.belt.stiffness.map(|k| 1.2 * k);
    let system = StateSpace::new(&machine, Operation::default()).unwrap();
    let discrete = system.discrete(EVERY, Hold::First, 0.0).unwrap();
    let output = system.output("drive_angle").unwrap();
    let (input, samples) = (white(60_000, 3.0), 60_000);
    let mut x = DVector::zeros(discrete.a.nrows());
    let mut made = log(&model(&machine, 0.0), &input, None, 0.0, samples);
    made.hold = taut::signal::Hold::Linear;
    let mut chance = Chance(9);
    for (k, seen) in made.outputs[0].values.iter_mut().enumerate() {
        *seen = (discrete.c.row(output) * &x)[(0, 0)] + discrete.d[output] * input(k) + 2e-6 * chance.next();
        x = &discrete.a * &x + &discrete.b * input(k);
    }
    let cut = Cut { segment: Some(1.024), period: None };
    let known = Known { place: 0.0, bridge: 0.0, delay: 0.0 };
    let found = |log: &Log| fit(&stage(), &known, &estimate(log, &cut).unwrap()).unwrap();
    let right = found(&made);
    let (stiffness, [low, high]) = right.stiffness;
    assert!((stiffness / 1.2 - 1.0).abs() < 0.01 && low < 1.2 && 1.2 < high, "{:?}", right.stiffness);
    assert!(right.delay.0 < 1e-5 && !right.is_far(), "{:?}, {}", right.delay, right.chi);
    // Its response is not that of a controller's held command.
    let design = Case::read("stages/sollmann-jouaneh/controllers/pid.toml").unwrap().controller.unwrap();
    let frf = &estimate(&made, &cut).unwrap()[0];
    let refused = measured(&[vec![frf]], 0, &design, &machine, (machine.pulley_radius, 0.0)).unwrap_err();
    assert!(refused.what.contains("straight"), "{refused}");
    // Taken as held, it is not described, which is said.
    let wrong = found(&Log { hold: taut::signal::Hold::Zero, ..made });
    assert!(wrong.is_far() && !(wrong.stiffness.1[0]..wrong.stiffness.1[1]).contains(&1.2), "{:?}", wrong.stiffness);
}

/// A controller's delay that is not in the log is in its margins: they are those of a log that has it.
#[test]
fn a_delay_that_the_log_lacks_counts_in_margins() {
    let stage = stage();
    let text = include_str!("../stages/sollmann-jouaneh/controllers/pid.toml");
    let design = text.split("[controller]").nth(1).unwrap().split("[[move]]").next().unwrap();
    let machine = include_str!("../stages/sollmann-jouaneh/table4.toml").split("[[experiment]]").next().unwrap();
    let margins = |delay_of_log: f64| {
        let log = log(&model(&stage, delay_of_log), &white(60_000, 3.0), None, 1e-6, 60_000);
        let case = format!(
            "{machine}\n[encoder]\nat = \"drive_pulley\"\nlines = 500000\n[controller]{design}\n[[experiment]]\nname = \"log\"\n\
             input = {{ step = 0.0 }}\nuntil = 1.0\nevery = 1e-3\n"
        );
        let mut case = Case::from_text("case.toml", &case).unwrap();
        case.machine.belt.damping = stage.belt.damping;
        case.controller.as_mut().unwrap().delay = 0.5e-3;
        case.experiments[0].log = Some(Arc::new(log));
        let cut = Cut { segment: Some(1.024), period: None };
        let found = measure(&case, &cut, Known::new(&case, None, None, None).unwrap()).unwrap();
        found.responses[0].margins.expect("the encoder's own angle")
    };
    let [without, with] = [0.0, 0.5e-3].map(margins);
    assert!((without.late - 0.5e-3).abs() < 1e-5 && with.late.abs() < 1e-5, "{} {}", without.late, with.late);
    assert!((without.sensitivity.0 / with.sensitivity.0 - 1.0).abs() < 0.02, "{without:?} {with:?}");
}

/// Margins around what was measured are those around the model that made it.
#[test]
fn measured_margins() {
    let case = Case::read("stages/sollmann-jouaneh/controllers/pid-elastic.toml").unwrap();
    let mut design = case.controller.clone().unwrap();
    design.delay = 0.5e-3;
    let truth = model(&stage(), design.delay);
    let log = log(&truth, &white(120_000, 3.0), None, 1e-7, 120_000);
    let frf = &estimate(&log, &Cut { segment: Some(2.048), period: None }).unwrap()[0];
    let stage = stage();
    let found = measured(&[vec![frf]], 0, &design, &stage, (stage.pulley_radius, 0.0)).unwrap();
    let feedback = taut::control::feedback::Feedback::new(&design, &stage).unwrap();
    let [low, high] = found.range;
    let exact = (0..4000).map(|k| low + (high - low) * f64::from(k) / 4000.0).map(|omega| {
        let terms = feedback.at(omega);
        let l = terms.position / terms.own * truth.0.at(omega)[truth.1] * stage.pulley_radius;
        1.0 / (l + 1.0).norm()
    });
    let exact = exact.fold(0.0, f64::max);
    assert!((found.sensitivity.0 / exact - 1.0).abs() < 0.25, "{found:?} {exact}");
    assert!(found.sensitivity_at_most >= found.sensitivity.0);
}

#[test]
fn what_cannot_be_measured_is_told() {
    let truth = model(&stage(), 0.0);
    let good = log(&truth, &white(4000, 1.0), None, 0.0, 4000);
    let told = |log: &Log, cut: Cut| estimate(log, &cut).unwrap_err().to_string();
    let plain = Cut::default();
    let segment = |segment: f64| Cut { segment: Some(segment), period: None };
    assert!(told(&good, segment(3.0)).contains("1 segments of 3000 samples"), "{}", told(&good, segment(3.0)));
    assert!(told(&good, segment(0.004)).contains("segments of 4 samples"), "{}", told(&good, segment(0.004)));
    let period = Cut { segment: None, period: Some(0.1234) };
    let of_period = told(&good, Cut { period: Some(0.03333), ..period });
    assert!(of_period.contains("a period of 0.03333 s is no whole number of samples of"), "{of_period}");
    let mut uneven = good.clone();
    uneven.time[2000..].iter_mut().for_each(|t| *t += 0.01);
    assert!(told(&uneven, plain).contains("are not 0.001000 s apart"), "{}", told(&uneven, plain));
    let mut missing = good.clone();
    missing.outputs[0].values[17] = f64::NAN;
    assert!(told(&missing, plain).contains("drive_angle has no value at 0.017000 s"), "{}", told(&missing, plain));
    let still = Log { inputs: vec![vec![1.0; 4000]], ..good.clone() };
    assert!(told(&still, plain).contains("the input does not change"), "{}", told(&still, plain));
    let mut signless = good.clone();
    signless.outputs[0].absolute = true;
    assert!(told(&signless, plain).contains("no output has a sign"), "{}", told(&signless, plain));
    let rigid = Case::read("stages/emps/emps.toml").unwrap().machine;
    let frfs = estimate(&good, &plain).unwrap();
    let known = Known { place: 0.0, bridge: 0.0, delay: 0.0 };
    assert!(fit(&rigid, &known, &frfs).unwrap_err().what.contains("a rigid belt has no stiffness"));
    let empty = Case::read("stages/sollmann-jouaneh/table4.toml").unwrap();
    let none = measure(&empty, &plain, known);
    assert!(none.unwrap_err().what.contains("no log to measure a response from"));
}

/// A period of 1e300 s asked for more memory than there is, which ended the program.
#[test]
fn a_period_longer_than_any_log_is_refused() {
    let time: Vec<f64> = (0..2000).map(|k| 1e-3 * f64::from(k)).collect();
    let input: Vec<f64> = time.iter().map(|t| (40.0 * t).sin()).collect();
    let log = Log {
        name: "made".into(),
        file: "made.csv".into(),
        outputs: vec![Output { quantity: Quantity::DriveAngle, absolute: false, values: input.clone() }],
        time,
        inputs: vec![input],
        added: None,
        hold: taut::signal::Hold::Zero,
        reference: None,
        ended: None,
    };
    for cut in [
        Cut { segment: None, period: Some(1e300) },
        Cut { segment: None, period: Some(1e9) },
        Cut { segment: Some(1e300), period: None },
    ] {
        let error = estimate(&log, &cut).unwrap_err().to_string();
        assert!(error.contains("65536"), "{error}");
    }
}
