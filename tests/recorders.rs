//! Logs as recorders write them, read with their presets.
//!
//! No file here came from a machine: each is made by a generator below, which follows the public definition of its
//! format, from a run of the model.

use crate::common;
use flate2::{Compression, write::GzEncoder};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use taut::case::{Case, Experiment, Plan, TEMPLATE};
use taut::fit::fit;
use taut::log::{In, Log, PRESETS, Pick, Quantity, Survey};
use taut::machine::Machine;
use taut::signal::Signal;
use taut::solve::{Flow, Solver, simulate};
use taut::trajectory::Trajectory;

/// An experiment, which a case has to have.
const STEP: &str = "[[experiment]]\nname = \"step\"\ninput = { step = \"5 V\" }\nuntil = \"0.5 s\"\nevery = \"1 ms\"\n";

/// The machine of the template, its motor with a gear of 2:1.
fn machine() -> String {
    let machine = &TEMPLATE[..TEMPLATE.find("[[experiment]]").unwrap()];
    machine.replacen("[motor]", "[motor]\ngear_ratio = 2", 1)
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("recorders-{name}"));
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// The motion of the machine: half a second to and fro.
fn to_and_fro() -> Signal {
    let square = |t: f64| if ((t / 0.1) as u64).is_multiple_of(2) { 5.0 } else { -5.0 };
    let times: Vec<f64> = (0..500).map(|k| f64::from(k) * 1e-3).collect();
    Signal::Sampled { values: times.iter().map(|t| square(*t)).collect(), times, hold: taut::signal::Hold::Zero }
}

/// A run of it, every millisecond.
fn run(stage: &Machine) -> Trajectory {
    let experiment = Experiment { every: 1e-3, ..common::experiment(to_and_fro(), 0.5) };
    simulate(stage, &experiment, Solver::Exact).unwrap().trajectory
}

fn stage() -> Machine {
    Case::from_text("case.toml", &format!("{}\n{STEP}", machine())).unwrap_or_else(|error| panic!("{error}")).machine
}

fn read(folder: &Path, log: &str) -> Result<Case, String> {
    let text = format!("{}\n[[experiment]]\nname = \"run\"\nlog = {{ {log} }}\n", machine());
    Case::from_text(folder.join("case.toml"), &text).map_err(|error| error.to_string())
}

#[track_caller]
fn log(folder: &Path, log: &str) -> Log {
    let case = read(folder, log).unwrap_or_else(|error| panic!("{error}"));
    case.experiments[0].log.as_deref().unwrap().clone()
}

/// Each value is that of the run within `within`.
#[track_caller]
fn agrees(log: &Log, quantity: Quantity, run: &[f64], within: f64) {
    let values = &log.output(quantity).unwrap_or_else(|| panic!("no {}", quantity.name())).values;
    for (k, (value, expected)) in values.iter().zip(run).enumerate() {
        assert!((value - expected).abs() <= within, "{} in row {k}: {value} for {expected}", quantity.name());
    }
}

/// A generator of RepRapFirmware's closed-loop data: heading and formats as in ClosedLoop.cpp, the columns of a
/// firmware with 24 channels; `end` is its last line.
fn reprapfirmware(stage: &Machine, run: &Trajectory, end: &str) -> String {
    let column = |name: &str| run.get(name).unwrap();
    let mut text = String::from(
        "Sample,Timestamp,Raw Encoder Reading,Measured Motor Steps,Target Motor Steps,Current Error,PID Control Signal,PID P Term,\
         PID I Term,PID D Term,PID J Term,PID V Term,PID A Term,Measured Velocity,Desired Step Phase,Measured Step Phase,\
         Phase Shift,Phase Current A,Phase Current B,Phase Current C,Current D,Current Q,Voltage D,Voltage Q\n",
    );
    for k in 0..run.len() {
        let steps = column("drive_angle")[k] * stage.drives[0].motor.gear_ratio * 400.0 / TAU;
        let [t, u, i] = ["time", "voltage", "motor_current"].map(|name| column(name)[k]);
        let _ = writeln!(
            text,
            "{k},{:.2},{},{steps:.4},{steps:.4},0.0000,{u:.2},0,0,0,0,0,0,{:.2},0,0,0,0,0,0,0.000,{i:.3},0.00,{u:.2}",
            1e3 * t + 17.0,
            (steps * 41.0) as i64,
            0.0
        );
    }
    text + end
}

#[test]
fn reprapfirmware_counts_in_steps_of_the_motor_and_says_when_data_were_lost() {
    let (folder, stage) = (folder("reprapfirmware"), stage());
    let run = run(&stage);
    for (end, ended) in
        [("", None), ("Data lost\n", Some("Data lost")), ("Buffer overflowed", Some("Buffer overflowed"))]
    {
        fs::write(folder.join("log.csv"), reprapfirmware(&stage, &run, end)).unwrap();
        let log = log(&folder, r#"file = "log.csv", preset = "reprapfirmware", steps_per_turn = 400"#);
        assert_eq!((log.len(), log.ended.as_deref()), (run.len(), ended));
        agrees(&log, Quantity::DriveAngle, run.get("drive_angle").unwrap(), 1e-6);
        agrees(&log, Quantity::MotorCurrent, run.get("motor_current").unwrap(), 1e-3);
        assert!((log.time[100] - 0.1).abs() < 1e-9 && log.inputs[0][50] == 5.0 && log.inputs[0][150] == -5.0);
        let reference = &log.reference.as_ref().unwrap()[400];
        let angle = run.get("drive_angle").unwrap()[400];
        assert!((reference - angle * stage.pulley_radius).abs() < 1e-6);
        assert_eq!(Survey::new(&log, &stage).has("ended"), ended.is_some());
    }
    let older = reprapfirmware(&stage, &run, "").replacen("Measured Motor Steps", "Current Motor Steps", 1);
    fs::write(folder.join("older.csv"), older).unwrap();
    let older = log(
        &folder,
        r#"file = "older.csv", preset = "reprapfirmware", steps_per_turn = 400, scale = { drive_angle = -1 }"#,
    );
    let turned: Vec<f64> = run.get("drive_angle").unwrap().iter().map(|angle| -angle).collect();
    agrees(&older, Quantity::DriveAngle, &turned, 1e-6);
}

/// A window before the end has lost nothing.
#[test]
fn a_window_before_the_end_has_lost_nothing() {
    let (folder, stage) = (folder("window"), stage());
    fs::write(folder.join("log.csv"), reprapfirmware(&stage, &run(&stage), "Data lost\n")).unwrap();
    let log = log(&folder, r#"file = "log.csv", preset = "reprapfirmware", to = "0.3 s""#);
    assert_eq!(log.ended, None);
}

/// A generator of the messages of Klipper's data_logger.py: those that readlog.py reads, and an answer that it passes
/// over.
fn klipper(stage: &Machine, run: &Trajectory, acceleration: &[f64]) -> Vec<u8> {
    let column = |name: &str| run.get(name).unwrap();
    let mut text = String::from("{\"q\":\"status\",\"params\":{\"eventtime\":1.5,\"status\":{}}}\u{3}");
    let begin = 100.0;
    for rows in (0..run.len()).collect::<Vec<_>>().chunks(50) {
        let counts = |k: &usize| {
            let turns = column("drive_angle")[*k] * stage.drives[0].motor.gear_ratio / TAU;
            format!("[{:.6},{}]", begin + column("time")[*k], (turns * 65536.0).round())
        };
        let rates = |k: &usize| format!("[{:.6},{:.3},0,9806.65]", begin + column("time")[*k], 1e3 * acceleration[*k]);
        for (name, data) in [
            ("angle:shaft", rows.iter().map(counts).collect::<Vec<_>>()),
            ("adxl345:hotend", rows.iter().map(rates).collect()),
        ] {
            let _ = write!(text, "{{\"q\":\"{name}\",\"params\":{{\"errors\":0,\"data\":[{}]}}}}\u{3}", data.join(","));
        }
    }
    let moves =
        "[[100.0,0.1,0.0,2000.0,[10.0,0.0,5.0],[1.0,0.0,0.0]],[100.1,0.2,200.0,0.0,[20.0,0.0,5.0],[1.0,0.0,0.0]]]";
    let _ = write!(text, "{{\"q\":\"trapq:toolhead\",\"params\":{{\"data\":{moves}}}}}\u{3}");
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(text.as_bytes()).unwrap();
    packed.finish().unwrap()
}

/// The rate of a column of a run.
fn rate(run: &Trajectory, name: &str) -> Vec<f64> {
    let (time, values) = (run.get("time").unwrap(), run.get(name).unwrap());
    (0..run.len())
        .map(|k| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(run.len() - 1));
            (values[b] - values[a]) / (time[b] - time[a])
        })
        .collect()
}

#[test]
fn klipper_gives_shaft_accelerometer_and_commands_on_one_clock() {
    let (folder, stage) = (folder("klipper"), stage());
    let run = run(&stage);
    let acceleration = rate(&run, "cart_speed");
    let packed = klipper(&stage, &run, &acceleration);
    fs::write(folder.join("log.json.gz"), &packed).unwrap();
    let text = format!(
        "{}\n[[experiment]]\nname = \"run\"\nuntil = \"0.5 s\"\nevery = \"1 ms\"\ninput = {{ step = \"5 V\" }}\n\
         log = {{ file = \"log.json.gz\", preset = \"klipper\" }}\n",
        machine()
    );
    let case = Case::from_text(folder.join("case.toml"), &text).unwrap_or_else(|error| panic!("{error}"));
    let log = case.experiments[0].log.as_deref().unwrap();
    assert_eq!(log.len(), run.len());
    agrees(log, Quantity::DriveAngle, run.get("drive_angle").unwrap(), TAU / 65536.0);
    agrees(log, Quantity::CartAcceleration, &acceleration, 1e-3);
    let reference = log.reference.as_ref().unwrap();
    // 10 mm; half of 2 m/s² for 50 ms; 0.1 s at 0.2 m/s behind 20 mm; the end of the last move
    for (k, expected) in [(0, 10e-3), (50, 12.5e-3), (200, 40e-3), (450, 60e-3)] {
        assert!((reference[k] - expected).abs() < 1e-6, "{k}: {}", reference[k]);
    }
    // What a logger that was killed leaves.
    fs::write(folder.join("cut.json.gz"), &packed[..packed.len() * 3 / 4]).unwrap();
    let text = text.replace("log.json.gz", "cut.json.gz").replace("until = \"0.5 s\"\n", "");
    let case = Case::from_text(folder.join("case.toml"), &text).unwrap_or_else(|error| panic!("{error}"));
    let len = case.experiments[0].log.as_deref().unwrap().len();
    assert!((50..run.len()).contains(&len), "{len}");
}

/// Columns called as the properties and registers of these drives: tables that somebody's script writes.
#[test]
fn odrive_and_moteus_go_by_the_names_of_their_properties() {
    let (folder, stage) = (folder("drives"), stage());
    let run = run(&stage);
    let column = |name: &str| run.get(name).unwrap();
    let mut odrive =
        String::from("time,axis0.controller.Iq_setpoint,axis0.pos_estimate,axis0.vel_estimate,axis0.Iq_measured\n");
    let mut moteus = String::from("timestamp,position,velocity,q_current,command_q_current\n");
    for k in 0..run.len() {
        let [t, angle, speed, i, u] =
            ["time", "drive_angle", "drive_speed", "motor_current", "voltage"].map(|name| column(name)[k]);
        let _ = writeln!(odrive, "{t},{u},{},{},{i}", angle * 2.0 / TAU, speed * 2.0 / TAU);
        let _ = writeln!(moteus, "{t},{},{},{i},{u}", angle / TAU, speed / TAU);
    }
    for (preset, text) in [("odrive", odrive), ("moteus", moteus)] {
        fs::write(folder.join("log.csv"), text).unwrap();
        // Their commands are currents; this machine has an amplifier of voltages.
        let error = read(&folder, &format!(r#"file = "log.csv", preset = "{preset}""#)).unwrap_err();
        assert!(error.contains("log.preset: its input is in A; expected V"), "{error}");
        let log = log(&folder, &format!(r#"file = "log.csv", preset = "{preset}", units = {{ input = "V" }}"#));
        agrees(&log, Quantity::DriveAngle, column("drive_angle"), 1e-9);
        agrees(&log, Quantity::DriveSpeed, column("drive_speed"), 1e-9);
        agrees(&log, Quantity::MotorCurrent, column("motor_current"), 1e-12);
    }
}

/// A generator of what TwinCAT Scope exports: tabs, a name and rows of what is known of each channel, then times in ms.
#[test]
fn twincat_scope_has_rows_about_its_channels_above_the_numbers() {
    let (folder, stage) = (folder("twincat"), stage());
    let run = run(&stage);
    let column = |name: &str| run.get(name).unwrap();
    let mut text = String::from(
        "Name\tYT Scope Project\r\nFile\tC:\\scope.tcscopex\r\nStarttime of export\t132223104000000000\r\n\r\n",
    );
    text += "Name\tfVoltage\tName\tfPosition\r\nSymbolComment\t\tSymbolComment\tthe cart\r\nData-Type\tREAL64\tData-Type\tREAL64\r\n";
    text += "SampleTime[ms]\t1\tSampleTime[ms]\t1\r\nVariableSize\t8\tVariableSize\t8\r\nUnit\t(None)\tUnit\t(None)\r\n\r\n";
    for k in 0..run.len() {
        let [t, u, x] = ["time", "voltage", "cart_position"].map(|name| column(name)[k]);
        let _ = write!(text, "{}\t{u}\t{}\t{}\r\n", 1e3 * t, 1e3 * t, 1e3 * x);
    }
    text += "EOF\r\n";
    fs::write(folder.join("log.csv"), text).unwrap();
    let log = log(
        &folder,
        r#"file = "log.csv", preset = "twincat-scope", input = "fVoltage", cart_position = "fPosition", units = { cart_position = "mm" }"#,
    );
    assert_eq!((log.len(), log.ended.as_deref()), (run.len(), None));
    agrees(&log, Quantity::CartPosition, column("cart_position"), 1e-12);
    assert!((log.time[7] - 7e-3).abs() < 1e-12);
}

/// A generator of a table of AdvantageScope: the time in the first column, a column for each field.
#[test]
fn wpilib_has_its_time_in_the_first_column() {
    let (folder, stage) = (folder("wpilib"), stage());
    let run = run(&stage);
    let column = |name: &str| run.get(name).unwrap();
    let mut text = String::from("Timestamp,NT:/arm/voltage,NT:/arm/position\n");
    for k in 0..run.len() {
        let _ = writeln!(text, "{},{},{}", column("time")[k], column("voltage")[k], column("cart_position")[k]);
    }
    fs::write(folder.join("log.csv"), text).unwrap();
    let log = log(
        &folder,
        r#"file = "log.csv", preset = "wpilib", input = "NT:/arm/voltage", cart_position = "NT:/arm/position""#,
    );
    agrees(&log, Quantity::CartPosition, column("cart_position"), 0.0);
}

/// An accelerometer tells the belt's stiffness, which the motor's angle alone hardly does.
#[test]
fn an_accelerometer_beside_the_angle_is_fitted() {
    let folder = folder("accelerometer");
    let belt = "[belt]\nstiffness = [\"132.76 kN/m\", \"132.76 kN/m\", \"58.885 kN/m\"]";
    let softer = "[belt]\nstiffness = [\"119.484 kN/m\", \"119.484 kN/m\", \"52.9965 kN/m\"]\ndamping = [\"5 N s/m\", \"5 N s/m\", \"5 N s/m\"]";
    let machine = &TEMPLATE[..TEMPLATE.find("[[experiment]]").unwrap()];
    let start = machine.find("[belt]").unwrap();
    let [before, behind] = [&machine[..start], &machine[machine.find("[encoder]").unwrap()..]];
    let case = |belt: &str, end: &str| {
        let text = format!("{before}{belt}\n\n{behind}\n{end}");
        Case::from_text(folder.join("case.toml"), &text).unwrap_or_else(|error| panic!("{error}"))
    };
    let truth = case(softer, STEP).machine;
    let experiment = Experiment { every: 1e-5, ..common::experiment(to_and_fro(), 0.5) };
    let run = simulate(&truth, &experiment, Solver::Exact).unwrap().trajectory;
    let acceleration = rate(&run, "cart_speed");
    let column = |name: &str| run.get(name).unwrap();
    let mut text = String::from("t,u,phi,a\n");
    for k in (0..run.len()).step_by(50) {
        let input = to_and_fro().value(column("time")[k] + 1e-9);
        let _ = writeln!(text, "{},{input},{},{:.4}", column("time")[k], column("drive_angle")[k], acceleration[k]);
    }
    fs::write(folder.join("log.csv"), text).unwrap();
    let log = "[[experiment]]\nname = \"run\"\nlog = { file = \"log.csv\", time = \"t\", input = \"u\", drive_angle = \"phi\", cart_acceleration = \"a\" }\n";
    let logged = case(&softer.replace("119.484", "132.76").replace("52.9965", "58.885"), log);
    let survey = Survey::new(logged.experiments[0].log.as_deref().unwrap(), &logged.machine);
    assert!(!survey.has("wraps") && !survey.has("outliers") && !survey.has("unit"), "{survey}");
    let plan = Plan { free: vec!["belt.stiffness".into()], ..Plan::default() };
    let found = fit(&logged, &plan, None, &mut |_| Flow::Continue).unwrap();
    let value = found.estimates[0].value;
    assert!((value / 0.9 - 1.0).abs() < 5e-3 || (value / 119_484.0 - 1.0).abs() < 5e-3, "{value}");
    let error = case_error(&folder, &format!("{before}{}\nmodel = \"rigid\"\n\n{behind}\n{log}", belt));
    assert!(error.contains("a rigid belt has no force at the cart"), "{error}");
}

fn case_error(folder: &Path, text: &str) -> String {
    Case::from_text(folder.join("case.toml"), text).unwrap_err().to_string()
}

/// The tables of `docs/logs.md` are those of the code; `UPDATE_EXPECT=1` writes them anew.
#[test]
fn the_page_on_logs_has_every_preset() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/logs.md");
    let text = fs::read_to_string(&path).unwrap();
    let mut updated = text.clone();
    for (name, table) in [("presets", columns()), ("sources of presets", sources())] {
        let begin = format!("<!-- {name} -->\n");
        let from = updated.find(&begin).unwrap() + begin.len();
        let to = from + updated[from..].find("<!-- end -->").unwrap();
        updated.replace_range(from..to, &table);
    }
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        fs::write(&path, &updated).unwrap();
    }
    assert!(std::env::var_os("UPDATE_EXPECT").is_some() || text == updated, "UPDATE_EXPECT=1 writes the tables anew");
}

fn columns() -> String {
    let mut text = String::from("| preset | key | columns | in |\n|---|---|---|---|\n");
    for preset in PRESETS {
        let listed = |names: &[&str]| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        let time = match preset.time.0 {
            Pick::Name(names) => listed(names),
            Pick::Number(number) => format!("column {number}"),
        };
        text += &format!("| `{}` | `time` | {time} | {} |\n", preset.name, preset.time.1);
        for (key, names, of) in preset.columns {
            let of = match of {
                In::Own => "as the file or `units` say",
                In::Unit(unit) => unit,
                In::MotorTurns => "turns of the motor, before the gear",
                In::MotorSteps => "full steps of the motor",
            };
            text += &format!("| | `{key}` | {} | {of} |\n", listed(names));
        }
    }
    text
}

fn sources() -> String {
    let row = |preset: &taut::log::Preset| format!("| {} | {} |\n", preset.title, preset.source);
    String::from("| recorder | defined in |\n|---|---|\n") + &PRESETS.iter().map(row).collect::<String>()
}
