//! Maps of a force along the travel: axes that are simulated with a known force give it back within the band, noise
//! gives none, and a controller that feeds the map forward follows better.

use rand_pcg::Pcg64;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use taut::case::{Case, Experiment};
use taut::chance::{normal, uniform};
use taut::control::{Controller, Loop, Rows, Standard, stream};
use taut::fit::map::{ForceMap, Limit, Origin, map};
use taut::log::{Log, Output, Quantity};
use taut::mechanism::State;
use taut::signal::Hold;
use taut::solve::{Flow, Solver};

/// PID with rigid feed-forward; a slow motion over 300 mm there and back, twice, and a move.
const MOVES: &str = "move=[
    { name = 'slow', points = ['300 mm', '0 mm', '300 mm', '0 mm'], speed = '60 mm/s', acceleration = '0.5 m/s^2', \
        jerk = '20 m/s^3', until = '22 s', window = '1 mm' },
    { name = 'far', to = '280 mm', speed = '0.15 m/s', acceleration = '1 m/s^2', jerk = '50 m/s^3', until = '2.5 s', \
        window = '1 mm' },
]";

fn case(changes: &[&str]) -> Case {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("stages/sollmann-jouaneh/controllers/pid-shaped.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let usual = [MOVES, "controller.feed_forward={ model = \"rigid\" }"];
    Case::from_text_with(&file, &text, &[&usual[..], changes].concat()).unwrap_or_else(|error| panic!("{error}"))
}

/// 0.4 N, a sine per turn of the pulley and one per turn of the motor.
fn force(case: &Case, phases: [f64; 2], x: f64) -> f64 {
    let turn = 2.0 * PI * case.machine.pulley_radius;
    let motor = turn / case.machine.drives[0].motor.gear_ratio;
    0.4 + 1.0 * (2.0 * PI * x / turn + phases[0]).sin() + 0.5 * (2.0 * PI * x / motor + phases[1]).sin()
}

/// The case with that force.
fn with_force(plain: &Case, phases: [f64; 2]) -> Case {
    let point = |k: usize| (k as f64 / 99.0) * 0.32 - 0.01;
    let points: Vec<String> = (0..100).map(|k| format!("[{}, {}]", point(k), force(plain, phases, point(k)))).collect();
    case(&[&format!("cart.force_along=[{}]", points.join(", "))])
}

/// Simulates a move on the machine of `truth` with the controller of `case`: columns at the controller's rate.
fn moved<const N: usize>(case: &Case, truth: &Case, name: &str, columns: [&str; N]) -> [Vec<f64>; N] {
    let design = case.controller.as_ref().unwrap();
    let motion = case.moves.iter().find(|one| one.name == name).unwrap();
    let mut controllers = Standard::of_drives(design, &case.machine).unwrap();
    let mut each: Vec<&mut dyn Controller> = controllers.iter_mut().map(|one| one as &mut dyn Controller).collect();
    let (timing, profiles) = (Loop::new(design), motion.references(design));
    let rows = Rows { until: motion.until, every: design.every, window: motion.window };
    let mut all = [const { Vec::new() }; N];
    let mut sink = |block: &taut::trajectory::Trajectory| {
        for (name, values) in columns.iter().zip(&mut all) {
            let column = block.get(name).unwrap_or_else(|| panic!("{name}"));
            values.extend_from_slice(column);
        }
        Flow::Continue
    };
    let solver = Solver::for_machine(&truth.machine);
    stream(&truth.machine, &mut each, &timing, &profiles, &rows, solver, false, &mut sink).unwrap();
    all
}

/// The log of a recorder: whole counts of the motor's encoder, and a command with noise.
fn log(case: &Case, [time, angle, voltage]: [Vec<f64>; 3], noise: f64, seed: u64) -> Log {
    let mut random = Pcg64::new(31, u128::from(seed));
    let count = 2.0 * PI / (4.0 * 512.0 * case.machine.drives[0].motor.gear_ratio);
    // An edge between two counts stands anywhere.
    let start = uniform(&mut random);
    let counted = |angle: &f64| ((angle / count + start).floor() + 0.5 - start) * count;
    Log {
        name: "slow".into(),
        file: PathBuf::new(),
        inputs: vec![voltage.iter().map(|value| value + noise * normal(&mut random)).collect()],
        added: None,
        hold: Hold::Zero,
        reference: None,
        outputs: vec![Output {
            quantity: Quantity::DriveAngle,
            absolute: false,
            values: angle.iter().map(counted).collect(),
        }],
        ended: None,
        time,
    }
}

/// The case with a log in place of its experiments.
fn logged(case: &Case, log: Log) -> Case {
    let until = *log.time.last().unwrap();
    let experiment = Experiment {
        name: log.name.clone(),
        inputs: log.signals(),
        until,
        every: 1e-3,
        initial: State::default(),
        log: Some(Arc::new(log)),
    };
    Case { experiments: vec![experiment], ..case.clone() }
}

fn learned(plain: &Case, truth: &Case, seed: u64) -> ForceMap {
    let rows = moved(plain, truth, "slow", ["time", "drive_angle", "voltage"]);
    map(&logged(plain, log(plain, rows, 0.1, seed))).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_hidden_force_is_found() {
    let plain = case(&[]);
    let (mut inside, mut all) = (0, 0);
    for seed in 0..20 {
        let mut random = Pcg64::new(32, seed);
        let phases = [0.0; 2].map(|_| 2.0 * PI * uniform(&mut random));
        let truth = with_force(&plain, phases);
        let found = learned(&plain, &truth, seed as u64);
        let line = truth.machine.cart.forces.along.as_ref().unwrap();
        let is_inside = |p: &&taut::fit::map::Point| (p.band[0]..=p.band[1]).contains(&line.value(p.position));
        let own = found.points.iter().filter(is_inside).count();
        (inside, all) = (inside + own, all + found.points.len());
        let named = |at: usize| found.components.get(at).map_or(&[][..], |one| &one.origins[..]);
        println!("{seed}: {own} of {}", found.points.len());
        found.components.iter().for_each(|one| println!("  {:?} {:?} {:?}", one.period, one.amplitude, one.origins));
        assert!(found.is_significant && found.may_be_eccentric());
        assert!(
            matches!(named(0), [Origin::Pulley { count: 1, .. }])
                && matches!(named(1), [Origin::Motor { count: 1, .. }])
        );
        assert!(found.friction.abs() < 0.02 && found.components.len() < 4, "{found:?}");
    }
    println!("{inside} of {all}");
    assert!(inside as f64 >= 0.9 * all as f64, "{inside} of {all}");
}

/// Where the passes differ at the period of the largest sine, its side lobes were less probable, and named in its
/// place.
#[test]
fn the_largest_sine_is_named_first() {
    let slow = ["move.0.speed=30 mm/s", "move.0.points=['285 mm', '0 mm']", "move.0.until=22 s"];
    let plain = case(&slow);
    for (seed, (period, phase)) in [(20.3e-3, 2.5), (22e-3, 1.0), (35e-3, 2.5)].into_iter().enumerate() {
        let at = |x: f64| 0.4 * (2.0 * PI * x / period + phase).sin();
        let point = |k: usize| (k as f64 / 99.0) * 0.3 - 0.007;
        let points: Vec<String> = (0..100).map(|k| format!("[{}, {}]", point(k), at(point(k)))).collect();
        let line = format!("cart.force_along=[{}]", points.join(", "));
        let truth = case(&[&slow[..], &[&line]].concat());
        let found = learned(&plain, &truth, seed as u64);
        let first = found.components.first().unwrap_or_else(|| panic!("{period}: nothing"));
        assert!((first.period[0] / period - 1.0).abs() < 0.01, "{period} {phase}: {:#?}", found.components);
        assert!((first.amplitude[0] / 0.4 - 1.0).abs() < 0.1, "{period} {phase}: {:#?}", found.components);
    }
}

/// `taut move` writes the end of a move that is no multiple of the interval as a last row; such logs were refused.
#[test]
fn a_last_row_off_the_grid_is_left_out() {
    let plain = case(&[]);
    let truth = with_force(&plain, [0.3, 1.0]);
    let rows = moved(&plain, &truth, "slow", ["time", "drive_angle", "voltage"]);
    let even = map(&logged(&plain, log(&plain, rows.clone(), 0.0, 1))).unwrap();
    let mut log = log(&plain, rows, 0.0, 1);
    let last = |values: &[f64]| *values.last().unwrap();
    let (time, angle, voltage) = (last(&log.time), last(&log.outputs[0].values), last(&log.inputs[0]));
    log.time.push(time + 0.4e-3);
    log.outputs[0].values.push(angle);
    log.inputs[0].push(voltage);
    let found = map(&logged(&plain, log.clone())).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(found.points, even.points);
    // Within the log, an uneven row is refused.
    let middle = log.time.len() / 2;
    log.time[middle] += 0.4e-3;
    assert!(map(&logged(&plain, log)).unwrap_err().to_string().contains("evenly"));
}

/// Sines of 8.55, 4.39 and 4.35 N that nearly cancel were named in a map of 1 N: a sine per turn, and one that the
/// points of the map just resolve.
#[test]
fn sines_that_cancel_are_not_named() {
    let plain = case(&[]);
    for seed in 0..6 {
        let mut random = Pcg64::new(33, seed);
        let [one, two] = [0.0; 2].map(|_| 2.0 * PI * uniform(&mut random));
        let short = 0.019 + 0.008 * uniform(&mut random);
        let turn = 2.0 * PI * plain.machine.pulley_radius;
        let at = |x: f64| 0.6 * (2.0 * PI * x / turn + one).sin() + 0.45 * (2.0 * PI * x / short + two).sin();
        let point = |k: usize| (k as f64 / 99.0) * 0.32 - 0.01;
        let points: Vec<String> = (0..100).map(|k| format!("[{}, {}]", point(k), at(point(k)))).collect();
        let found = learned(&plain, &case(&[&format!("cart.force_along=[{}]", points.join(", "))]), seed as u64);
        for one in &found.components {
            let period = one.period[0];
            let amplitude = if (period / turn - 1.0).abs() < 0.02 { 0.6 } else { 0.45 };
            let is_there = (period / turn - 1.0).abs() < 0.02 || (period / short - 1.0).abs() < 0.02;
            assert!(is_there && one.amplitude[0] < 1.1 * amplitude, "{seed}: {:#?}", found.components);
        }
    }
}

/// A force that goes up and down one and a half times along the travel changes the map and is not called periodic.
#[test]
fn what_does_not_repeat_has_no_period() {
    let plain = case(&[]);
    let length = 0.19;
    let point = |k: u32| f64::from(k) / 99.0 * 0.32 - 0.01;
    let force = |x: f64| 1.2 * (2.0 * PI * x / length).sin();
    let points: Vec<String> = (0..100).map(|k| format!("[{}, {}]", point(k), force(point(k)))).collect();
    let truth = case(&[&format!("cart.force_along=[{}]", points.join(", "))]);
    let found = learned(&plain, &truth, 3);
    assert!(found.is_significant);
    assert!(found.components.is_empty(), "{:?}", found.components);
}

/// A controller that knows the map errs less; one of a machine without a force has nothing to learn.
#[test]
fn feed_forward_of_a_map_reduces_the_error() {
    let plain = case(&[]);
    let truth = with_force(&plain, [0.3, 1.7]);
    let found = learned(&plain, &truth, 77);
    let text = found.case_text(&plain, Path::new("axis.toml")).unwrap().unwrap();
    let mapped = Case::from_text("axis.toml", &text).unwrap();
    let rms = |case: &Case| {
        let [time, reference, cart] = moved(case, &truth, "far", ["time", "reference", "cart_position"]);
        let errors: Vec<f64> = reference.iter().zip(&cart).map(|(r, x)| r - x).collect();
        let until = time.partition_point(|t| *t < case.moves[1].end());
        (errors[..until].iter().map(|e| e * e).sum::<f64>() / until as f64).sqrt()
    };
    let [before, after, ideal] = [&plain, &mapped, &truth].map(rms);
    println!(
        "{:.1} um without, {:.1} um with the map, {:.1} um with the true force",
        1e6 * before,
        1e6 * after,
        1e6 * ideal
    );
    assert!(after < 0.5 * before, "{before} {after} {ideal}");
}

#[test]
fn a_machine_without_such_a_force_has_an_empty_map() {
    let plain = case(&[]);
    for seed in 0..3 {
        let found = learned(&plain, &plain, seed);
        assert!(!found.is_significant && found.line.is_none() && found.components.is_empty(), "{seed}: {found:?}");
        assert!(found.case_text(&plain, Path::new("axis.toml")).unwrap().is_none());
        assert!(found.visible < 0.3, "{}", found.visible);
    }
}

/// A log of uniform motion there and back, with noise of the command that is white, slow or both.
fn noise(case: &Case, passes: usize, seed: u64) -> Log {
    let mut random = Pcg64::new(33, u128::from(seed));
    let (h, speed, travel) = (2e-3, 0.06, 0.3);
    let each = (travel / speed / h) as usize;
    let (slow, decay) = (0.3 * uniform(&mut random), (-h / (0.02 + uniform(&mut random))).exp());
    let (mut time, mut angle, mut voltage, mut drift) = (Vec::new(), Vec::new(), Vec::new(), 0.0);
    for k in 0..passes * each {
        let (pass, share) = (k / each, (k % each) as f64 / each as f64);
        let x = travel * if pass % 2 == 0 { share } else { 1.0 - share };
        drift = decay * drift + (1.0 - decay * decay).sqrt() * slow * normal(&mut random);
        time.push(k as f64 * h);
        angle.push(x / case.machine.pulley_radius);
        voltage.push(if pass % 2 == 0 { 1.0 } else { -1.0 } + drift + 0.2 * normal(&mut random));
    }
    log(case, [time, angle, voltage], 0.0, seed)
}

/// Of a hundred machines without a force at most four get a map, whatever the colour of the noise.
#[test]
fn noise_makes_no_map() {
    let plain = case(&[]);
    for passes in [2, 4] {
        let is_alarm = |seed: &u64| map(&logged(&plain, noise(&plain, passes, *seed))).unwrap().is_significant;
        let alarms: Vec<u64> = (0..100).filter(is_alarm).collect();
        println!("{passes} passes: {alarms:?}");
        assert!(alarms.len() < 5, "{passes} passes: {alarms:?}");
    }
}

#[test]
fn logs_without_a_map_are_refused() {
    let plain = case(&[]);
    let whole = noise(&plain, 2, 1);
    let told = |change: &dyn Fn(&mut Log)| {
        let mut log = whole.clone();
        change(&mut log);
        map(&logged(&plain, log)).map(|found| found.passes).unwrap_err().to_string()
    };
    let cut = |log: &mut Log, rows: usize| {
        log.time.truncate(rows);
        log.inputs[0].truncate(rows);
        log.outputs[0].values.truncate(rows);
    };
    assert!(told(&|log| cut(log, 2400)).contains("the logs move forward only"), "{}", told(&|log| cut(log, 2400)));
    let none = told(&|log| log.outputs[0].quantity = Quantity::MotorCurrent);
    assert!(none.contains("it has no position") && none.contains("drive_angle"), "{none}");
    assert!(told(&|log| log.time[9] += 1e-3).contains("not evenly spaced"));
    assert!(told(&|log| log.outputs[0].values[9] = f64::NAN).contains("missing"));
    assert!(told(&|log| cut(log, 40)).contains("too few"), "{}", told(&|log| cut(log, 40)));
    let still = told(&|log| log.outputs[0].values.fill(1.0));
    assert!(still.contains("do not move"), "{still}");
    let empty = map(&plain).map(|found| found.passes).unwrap_err().to_string();
    assert!(empty.contains("no experiment has a log"), "{empty}");
    // Of a short travel no period of a turn is named.
    let short = case(&["drive_pulley.pitch=\"6 mm\""]);
    let found = map(&logged(&short, noise(&short, 2, 2))).unwrap();
    assert!(matches!(found.too_long[..], [Origin::Pulley { .. }, ..]), "{:?}", found.too_long);
    assert!(found.resolution > 0.0 && found.limit == Limit::Points, "{:?}", found.limit);
}
