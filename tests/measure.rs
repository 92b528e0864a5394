//! Logs of simulated runs: right where they should be exact, and wrong by what their devices make of it.

use std::path::Path;
use taut::case::{Case, Experiment, TEMPLATE};
use taut::log::read_columns;
use taut::machine::{Channel, Encoder, EncoderPlace, Machine, MachineKind, Measurement, Quantity};
use taut::measure::measure;
use taut::solve::{Solver, simulate};
use taut::trajectory::{CsvWriter, Trajectory};

/// The template's axis, its first experiment, and this measurement of it.
fn case(changes: &[&str]) -> (Machine, Measurement, Experiment) {
    let case = Case::from_text_with("axis.toml", TEMPLATE, changes).unwrap_or_else(|error| panic!("{error}"));
    (case.machine, case.measurement.unwrap_or_default(), case.experiments[0].clone())
}

fn log((machine, measurement, experiment): &(Machine, Measurement, Experiment)) -> Trajectory {
    measure(machine, measurement, experiment, Solver::Exact).unwrap().trajectory
}

/// A column of the run itself, with a row every `every` seconds up to `until`.
fn exact(
    (machine, _, experiment): &(Machine, Measurement, Experiment),
    every: f64,
    until: f64,
    name: &str,
) -> Vec<f64> {
    let experiment = Experiment { every, until, ..experiment.clone() };
    simulate(machine, &experiment, Solver::Exact).unwrap().trajectory.get(name).unwrap().to_vec()
}

fn column<'a>(log: &'a Trajectory, name: &str) -> &'a [f64] {
    log.get(name).unwrap_or_else(|| panic!("no {name}"))
}

/// An exact converter of this quantity.
fn ideal(quantity: Quantity) -> Channel {
    Channel { quantity, step: None, noise: 0.0, range: None }
}

#[test]
fn an_ideal_recorder_shows_the_run_to_the_last_bit() {
    // With a compliant gear, so that there is a rotor to look at.
    let mut setting = case(&["motor.rotor_inertia=4e-6", "motor.gear_stiffness=300"]);
    setting.0.encoder = None;
    // A recorder has no accelerometer.
    let quantities = Quantity::for_kind(MachineKind::Axis)
        .iter()
        .copied()
        .filter(|quantity| *quantity != Quantity::CartAcceleration);
    setting.1.channels = quantities.clone().map(ideal).collect();
    let log = log(&setting);
    assert_eq!(log.len() as u64, setting.2.samples());
    let run = simulate(&setting.0, &setting.2, Solver::Exact).unwrap().trajectory;
    for quantity in quantities {
        let name = quantity.name().replace("motor_voltage", "voltage");
        assert_eq!(column(&log, quantity.name()), run.get(&name).unwrap(), "{name}");
    }
    assert_eq!(column(&log, "time"), run.get("time").unwrap());
    assert_eq!(column(&log, "voltage"), run.get("voltage").unwrap());
}

#[test]
fn a_count_is_within_half_a_step_and_follows_the_position() {
    for (at, lines) in [(EncoderPlace::Motor, 512.0), (EncoderPlace::DrivePulley, 16.0), (EncoderPlace::Cart, 6264.775)]
    {
        let mut setting = case(&["motor.gear_ratio=5.9"]);
        setting.0.encoder = Some(Encoder { at, lines });
        let log = log(&setting);
        let cart = at == EncoderPlace::Cart;
        let (place, per_unit) = match at {
            EncoderPlace::Motor => ("drive_angle", 2048.0 * 5.9 / std::f64::consts::TAU),
            EncoderPlace::DrivePulley => ("drive_angle", 64.0 / std::f64::consts::TAU),
            EncoderPlace::Cart => ("cart_position", 4.0 * 6264.775),
        };
        let exact = exact(&setting, 1e-3, 1.0, place);
        let (counts, shown) = (column(&log, "encoder_count"), column(&log, place));
        for (k, exact) in exact.iter().enumerate() {
            assert!(counts[k].fract() == 0.0);
            assert!((counts[k] / per_unit - exact).abs() <= 0.5 / per_unit * (1.0 + 1e-9), "{at:?} {k}");
            assert!((shown[k] - counts[k] / per_unit).abs() <= 1e-12, "{at:?} {k}");
        }
        for k in 1..exact.len() {
            let (moved, counted) = (exact[k] - exact[k - 1], counts[k] - counts[k - 1]);
            assert!(moved * counted >= 0.0, "{at:?} counts against the motion at {k}");
        }
        let headings: Vec<String> = log.columns.iter().map(|c| c.heading()).collect();
        let position = if cart { "cart_position_m" } else { "drive_angle_rad" };
        assert_eq!(headings, ["time_s", "voltage_V", "encoder_count", position]);
    }
}

#[test]
fn a_converter_rounds_to_half_a_step_and_stops_at_its_range() {
    let changes = [
        "measurement.cart_speed={ step = \"3 mm/s\" }",
        "measurement.motor_current={ step = \"0.4 A\", range = \"6.3 A\" }",
        "measurement.cart_position={ range = \"20 mm\" }",
    ];
    let setting = case(&changes);
    let log = log(&setting);
    for (shown, exact) in column(&log, "cart_speed").iter().zip(exact(&setting, 1e-3, 1.0, "cart_speed")) {
        assert!((shown - exact).abs() <= 1.5e-3 * (1.0 + 1e-12));
        assert!(((shown / 3e-3) - (shown / 3e-3).round()).abs() < 1e-9);
    }
    // 15 whole steps of 0.4 A fit into 6.3 A.
    let current = exact(&setting, 1e-3, 1.0, "motor_current");
    let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    assert!(largest(&current) > 7.0);
    assert_eq!(largest(column(&log, "motor_current")), 15.0 * 0.4);
    for (shown, exact) in column(&log, "motor_current").iter().zip(current).filter(|(_, exact)| exact.abs() < 6.0) {
        assert!((shown - exact).abs() <= 0.2 * (1.0 + 1e-12));
    }
    for (shown, exact) in column(&log, "cart_position").iter().zip(exact(&setting, 1e-3, 1.0, "cart_position")) {
        assert_eq!(*shown, exact.min(0.02));
    }
}

#[test]
fn a_delay_shows_what_was_then_and_before_the_start_what_stood_still() {
    // Rolling at the start: without an input the motor brakes, and that is what its current showed before.
    let changes = [
        "measurement.delay=2.25 ms",
        "measurement.cart_position={}",
        "measurement.motor_current={}",
        "experiment.0.initial={ cart_position = \"10 mm\", drive_speed = \"2 rad/s\", cart_speed = \"38.8 mm/s\" }",
    ];
    let setting = case(&changes);
    let log = log(&setting);
    let position = exact(&setting, 0.25e-3, 1.0, "cart_position");
    let current = exact(&setting, 0.25e-3, 1.0, "motor_current");
    for k in 0..log.len() {
        let shown = (column(&log, "cart_position")[k], column(&log, "motor_current")[k]);
        let then = (4 * k).checked_sub(9);
        let wanted = then.map_or((0.01, -0.023 * 2.0 / 0.71), |then| (position[then], current[then]));
        assert!((shown.0 - wanted.0).abs() < 1e-13 && (shown.1 - wanted.1).abs() < 1e-10, "{k}: {shown:?} {wanted:?}");
        // The commanded input is known when it is given.
        assert_eq!(column(&log, "voltage")[k], if k < 250 { 5.0 } else { 0.0 });
    }
}

#[test]
fn an_awkward_delay_is_joined_by_lines_within_the_stated_bound() {
    let setting = case(&["measurement.delay=0.7310203 ms", "measurement.cart_position={}"]);
    let log = log(&setting);
    // 0.7310203 ms is 7310203 of 10 000 000 parts of an interval: no raster of up to 1000 points has it.
    let fine = exact(&setting, 1e-7, 0.06, "cart_position");
    // Acceleration is at most about 7.4 N on 0.362 kg.
    let bound = 0.05e-3_f64.powi(2) * (7.4 / 0.362) / 8.0;
    for k in 1..60 {
        let then = k as f64 * 1e4 - 7310.203;
        let (floor, part) = (then.floor() as usize, then.fract());
        let wanted = fine[floor] + part * (fine[floor + 1] - fine[floor]);
        assert!((column(&log, "cart_position")[k] - wanted).abs() < bound, "{k}");
    }
}

#[test]
fn jitter_has_the_deviation_that_was_asked_for_and_keeps_the_order() {
    // Coasting without friction: position is time, so what the log shows is when it was taken.
    let mut changes = vec![
        "measurement.jitter=50 us",
        "measurement.delay=0.3 ms",
        "measurement.cart_position={}",
        "motor.torque_constant=0",
        "motor.back_emf_constant=0",
        "drive_pulley.friction={}",
        "idler_pulley.friction={}",
        "cart.friction={}",
        "drive_pulley.radius=1",
        "experiment.0.until=5 s",
        "experiment.0.initial={ drive_speed = 1, cart_speed = 1, idler_speed = 1 }",
    ];
    let late = |changes: &[&str]| -> Vec<f64> {
        let log = log(&case(changes));
        let taken = column(&log, "cart_position");
        assert!(taken.windows(2).all(|pair| pair[0] <= pair[1] + 1e-12));
        taken.iter().zip(column(&log, "time")).skip(1).map(|(taken, time)| taken - (time - 0.3e-3)).collect()
    };
    let (mean, deviation) = moments(&late(&changes));
    assert!(mean.abs() < 50e-6 * 4.0 / 5000f64.sqrt() && (deviation / 50e-6 - 1.0).abs() < 0.04, "{mean} {deviation}");
    changes[0] = "measurement.jitter=0.25 ms";
    let farthest = late(&changes).iter().fold(0.0, |most: f64, late| most.max(late.abs()));
    assert!((farthest - 0.5e-3).abs() < 1e-8, "{farthest}");
}

fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt())
}

/// An axis at rest shows noise alone, here of deviation 1.
fn noise(name: &str, seed: u64, rows: f64) -> Vec<f64> {
    let mut setting = case(&["experiment.0.input={ step = 0 }", "measurement.cart_speed={ noise = 1 }"]);
    setting.1.seed = seed;
    setting.2 = Experiment { name: name.into(), until: rows * 1e-3, ..setting.2 };
    column(&log(&setting), "cart_speed").to_vec()
}

#[test]
fn noise_is_white_and_gaussian() {
    let rows = 1e5;
    let values = noise("rest", 1, rows);
    let (mean, deviation) = moments(&values);
    let moment = |power: i32| values.iter().map(|v| v.powi(power)).sum::<f64>() / rows;
    let within = |limit: f64| values.iter().filter(|v| v.abs() < limit).count() as f64 / rows;
    let along = |lag: usize| values.iter().zip(&values[lag..]).map(|(a, b)| a * b).sum::<f64>() / rows;
    // Four standard errors each.
    let near = |value: f64, wanted: f64, deviation: f64| (value - wanted).abs() < 4.0 * deviation / rows.sqrt();
    assert!(near(mean, 0.0, 1.0) && near(deviation, 1.0, 0.71), "{mean} {deviation}");
    assert!(near(moment(3), 0.0, 15f64.sqrt()) && near(moment(4), 3.0, 96f64.sqrt()));
    for (limit, share) in [(1.0, 0.682_689_5), (2.0, 0.954_499_7), (3.0, 0.997_300_2)] {
        assert!(near(within(limit), share, f64::sqrt(share * (1.0 - share))), "{limit}");
    }
    assert!((1..20).all(|lag| near(along(lag), 0.0, 1.0)));
    let other = noise("another", 1, rows);
    assert!(near(values.iter().zip(&other).map(|(a, b)| a * b).sum::<f64>() / rows, 0.0, 1.0));
}

#[test]
fn the_same_seed_gives_the_same_bits_whatever_else_is_recorded() {
    let changes = ["measurement.jitter=20 us", "measurement.motor_current={ noise = \"50 mA\" }"];
    let alone = log(&case(&changes));
    assert_eq!(alone, log(&case(&changes)));
    let more = [&changes[..], &["measurement.cart_speed={ noise = \"1 mm/s\" }"]].concat();
    let more = log(&case(&more));
    assert_eq!(column(&alone, "motor_current"), column(&more, "motor_current"));
    let other = log(&case(&[&changes[..], &["measurement.seed=2"]].concat()));
    assert_ne!(column(&alone, "motor_current"), column(&other, "motor_current"));
    // The same on every machine and in every version: old logs can be made again.
    assert_eq!(noise("rest", 1, 3.0), FIRST);
}

/// The first numbers of seed 1.
const FIRST: [f64; 4] = [0.46863511444632877, -0.3447139877983875, -0.1532959599641288, -0.6580502147064756];

#[test]
fn a_log_reads_back() {
    let changes = [
        "measurement.every=2 ms",
        "measurement.delay=1 ms",
        "measurement.motor_current={ step = \"10 mA\", noise = \"20 mA\", range = \"10 A\" }",
        "measurement.cart_speed={ noise = \"1 mm/s\" }",
    ];
    let log = log(&case(&changes));
    assert_eq!(log.len(), 501);
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("measured.csv");
    let mut writer = CsvWriter::create(&path).unwrap();
    writer.write(&log).unwrap();
    writer.finish().unwrap();
    let headings: Vec<String> = log.columns.iter().map(|c| c.heading()).collect();
    let names: Vec<&str> = headings.iter().map(String::as_str).collect();
    assert_eq!(names, ["time_s", "voltage_V", "encoder_count", "drive_angle_rad", "motor_current_A", "cart_speed_m_s"]);
    let read = read_columns(&path, &names).unwrap();
    for (read, written) in read.iter().zip(&log.columns) {
        assert_eq!(read, &written.values, "{}", written.name);
    }
}

#[test]
fn a_commanded_current_is_logged_as_one() {
    let changes =
        ["amplifier={ mode = \"current\", gain = 2 }", "experiment.0.input={ step = \"1 A\" }", "measurement={}"];
    let setting = case(&[&changes[..2], &["experiment.1.input={ step = 0 }", changes[2]]].concat());
    let log = log(&setting);
    assert_eq!(log.columns[1].heading(), "current_A");
    assert!(column(&log, "current").iter().all(|&input| input == 1.0));
}

#[test]
fn nothing_to_record_is_an_error() {
    let mut setting = case(&[]);
    setting.0.encoder = None;
    let error = measure(&setting.0, &setting.1, &setting.2, Solver::Exact).unwrap_err().to_string();
    assert!(error.starts_with("nothing is recorded: ") && error.contains("add [encoder]"), "{error}");
}
