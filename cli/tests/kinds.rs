//! Every kind of machine through every command: each pair runs, or is refused by one sentence that is known here.

use crate::common::{root, taut_in};
use std::path::Path;
use tempfile::TempDir;

/// The outcome of a command with a kind of machine.
enum Ends {
    /// It runs.
    Runs,
    /// It is refused with status 2, and these words are in what it says.
    Refused(&'static str),
}
use Ends::{Refused, Runs};

const AXIS: &str = "stages/sollmann-jouaneh/table4.toml";
const PID: &str = "stages/sollmann-jouaneh/controllers/pid.toml";
/// A loop that is stable on the whole family.
const SHAPED: &str = "stages/sollmann-jouaneh/controllers/pid-shaped.toml";
const LOGS: &str = "stages/sollmann-jouaneh/identification/separate.toml";
const GANTRIES: [&str; 3] =
    ["stages/h-frame/h-frame.toml", "stages/core-xy/core-xy.toml", "stages/dual-belt/dual-belt.toml"];
/// Gantries with a controller and moves.
const IN_LOOP: [&str; 3] = ["stages/h-frame/square.toml", "stages/core-xy/square.toml", "stages/dual-belt/square.toml"];

/// Gantries with a log of both motors.
const WITH_LOGS: [&str; 2] = ["stages/h-frame/belts.toml", "stages/core-xy/belts.toml"];

/// An axis and a gantry whose motors are commanded positions.
const STEPPERS: [&str; 2] = ["stages/stepper-axis/stepper-axis.toml", "stages/printer-core-xy/printer.toml"];
/// The axis with an encoder that corrects its positions.
const CLOSED_LOOP: &str = "stages/stepper-axis/closed-loop.toml";
/// Its move, shorter.
const SHORT: &str = "move=[{ name = \"there and back\", points = [\"5 mm\", \"0 mm\"], speed = \"0.2 m/s\", \
                     acceleration = \"4 m/s^2\", jerk = \"400 m/s^3\", until = \"0.25 s\" }]";

/// Commands that take a stepper; all others refuse it.
const WITH_STEPPER: [&str; 15] = [
    "show",
    "simulate",
    "modes",
    "sweep",
    "move",
    "plan",
    "learn",
    "check",
    "shape",
    "frf",
    "export c",
    "export json",
    "export fmu",
    "export matlab",
    "export python",
];

/// A stepper without feedback, where a controller is needed.
const OPEN_LOOP: Ends = Refused("a stepper in open loop");

/// Of whatever does not.
const NO_MOTOR: Ends = Refused("this needs a motor that is commanded by voltage or current");

/// Commands without a machine.
const OTHERS: [&str; 6] = ["paper", "init", "schema", "completions", "man", "help"];

/// A command, the options behind the case, the case of an axis that it runs with, and what becomes of a gantry.
const TABLE: &[(&str, &[&str], &str, Ends)] = &[
    ("show", &[], AXIS, Runs),
    ("simulate", &[], AXIS, Runs),
    ("modes", &[], AXIS, Runs),
    ("sweep", &["--runs", "3", "--vary", "cart.mass=5 %"], AXIS, Runs),
    ("move", &[], PID, Runs),
    ("tune", &["--evaluate"], PID, Runs),
    ("plan", &["--move", "short fast"], PID, Runs),
    ("learn", &["--move", "short fast", "--log", "trial.csv", "--set", "title=calm"], SHAPED, Runs),
    ("check", &[], LOGS, Runs),
    ("fit", &[], LOGS, Runs),
    ("shape", &[], PID, Runs),
    ("frf", &["--segment", "0.128s"], LOGS, Runs),
    (
        "design",
        &[
            "--for",
            "cart.mass",
            "--measure",
            "motor_current=10mA",
            "--input",
            "trapezoid",
            "--duration",
            "0.3s",
            "--verify",
            "1",
        ],
        AXIS,
        Runs,
    ),
    ("export c", &[], AXIS, Runs),
    ("export matlab", &["--out", "there/"], AXIS, Runs),
    ("export python", &[], AXIS, Runs),
    ("export json", &[], AXIS, Runs),
    ("export fmu", &["--out", "there/"], AXIS, Runs),
    ("export st", &[], PID, Refused("this case has no controller")),
    // It serves until it is ended.
    ("studio", &["--port", "none"], AXIS, Refused("--port")),
];

/// Gains for a repeated move of an example gantry, stable on every machine of the family.
const CALM: &str =
    "controller.pid={ proportional = \"5 V/mm\", integral = \"20 V/(mm s)\", derivative = \"40 V s/m\" }";

/// The log of a repeated move of a case, in this folder.
fn trial(case: &str, options: &[&str], folder: &Path) -> String {
    let out = folder.join("trial").display().to_string();
    let name = options.iter().skip_while(|option| **option != "--move").nth(1).unwrap();
    let is_changed = |option: &&&str| option.contains("controller.pid") || **option == SHORT;
    let changes = options.iter().filter(is_changed).flat_map(|option| ["--set", option]);
    let _ = taut_in(root())
        .args(["move", case, "--move", name, "--no-report", "--out", &out])
        .args(changes)
        .output()
        .unwrap();
    format!("{out}/{}.csv", name.replace(' ', "-"))
}

/// The machine of a stepper's case with a log of it, in this folder: it slides, with noise on each command.
fn logged(case: &str, folder: &Path) -> String {
    let whole = std::fs::read_to_string(Path::new("..").join(case)).unwrap();
    let machine = whole.split("[[experiment]]").next().unwrap();
    let sliding = |way: f64, seed: u32| {
        format!(
            "{{ sum = [{{ ramp = \"{way} mm\", over = \"0.42 s\" }}, \
             {{ prbs = \"5 um\", bit = \"2 ms\", seed = {seed} }}] }}"
        )
    };
    let [input, columns, outputs] = match case != STEPPERS[1] {
        true => [sliding(20.0, 1), "input = \"input_m\"".into(), "cart_position = \"cart_position_m\"".into()],
        false => [
            format!("{{ left = {}, right = {} }}", sliding(30.0, 1), sliding(10.0, 2)),
            "left_input = \"left_input_m\", right_input = \"right_input_m\"".into(),
            "left_angle = \"left_angle_rad\", cart_position = \"cart_position_m\"".into(),
        ],
    };
    let path = folder.join("logged.toml").display().to_string();
    let run =
        format!("{machine}[[experiment]]\nname = \"noise\"\ninput = {input}\nuntil = \"0.42 s\"\nevery = \"1 ms\"\n");
    std::fs::write(&path, run).unwrap();
    let out = folder.display().to_string();
    let smooth = "stepper.interpolate=true";
    taut_in(root()).args(["simulate", &path, "--no-report", "--out", &out, "--set", smooth]).assert().success();
    let log = format!(
        "{machine}[[experiment]]\nname = \"noise\"\n\
         log = {{ file = \"noise.csv\", time = \"time_s\", hold = \"linear\", {columns}, {outputs} }}\n\
         [fit]\nfree = [\"stepper.holding_torque\"]\n"
    );
    std::fs::write(&path, log).unwrap();
    path
}

#[test]
fn every_command_is_in_the_table() {
    let output = taut_in(root()).arg("--help").output().unwrap();
    let help = String::from_utf8(output.stdout).unwrap();
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names = listed.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    for name in names.filter_map(|line| line.split_whitespace().next()) {
        let has = TABLE.iter().any(|(command, ..)| command.split(' ').next() == Some(name));
        assert!(has != OTHERS.contains(&name), "{name}");
    }
    let targets = String::from_utf8(taut_in(root()).args(["export", "--help"]).output().unwrap().stdout).unwrap();
    for target in ["fmu", "c", "st", "matlab", "python", "json"] {
        assert!(targets.contains(target) && TABLE.iter().any(|row| row.0 == format!("export {target}")), "{target}");
    }
}

#[test]
fn every_kind_goes_through_every_command() {
    for (command, options, axis, of_gantry) in TABLE {
        let words: Vec<&str> = command.split(' ').collect();
        let run = |case: &str, ends: &Ends| {
            let folder = TempDir::new().unwrap();
            let there = format!("{}/", folder.path().display());
            let own: Vec<&str> = options
                .iter()
                .map(|option| match *option {
                    "there/" => there.as_str(),
                    "short fast" if case == STEPPERS[0] || case == CLOSED_LOOP => "there and back",
                    "title=calm" if case == CLOSED_LOOP => SHORT,
                    "short fast" if case != *axis => "square",
                    "title=calm" if case != *axis && !STEPPERS.contains(&case) => CALM,
                    "motor_current=10mA" if GANTRIES.contains(&case) => "left_current=10mA",
                    option => option,
                })
                .collect();
            let log = if own.contains(&"trial.csv") { trial(case, &own, folder.path()) } else { String::new() };
            let options = own.iter().map(|option| if *option == "trial.csv" { &log } else { *option });
            let is_closed = case == CLOSED_LOOP;
            let has_stepper = (is_closed || STEPPERS.contains(&case)) && WITH_STEPPER.contains(command);
            let of_log = has_stepper && ["check", "frf"].contains(command);
            let case = if of_log { &logged(case, folder.path()) } else { case };
            // Fine microsteps and a whole family of machines cost time here, and show nothing more.
            let coarse: &[&str] = match has_stepper {
                _ if is_closed && !of_log && *command != "learn" => {
                    &["--set", SHORT, "--set", "tune={ spread = 0, places = 1 }"]
                }
                true if *command == "plan" => &["--set", "stepper.microsteps=1", "--set", "tune={ spread = 0 }"],
                true if of_log => &["--set", "stepper.interpolate=true"],
                true => &["--set", "stepper.microsteps=1"],
                false => &[],
            };
            let output = taut_in(root()).args(&words).arg(case).args(options).args(coarse).output().unwrap();
            let [told, said] =
                [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
            match ends {
                // What was found may be nothing to rely on: status 1.
                Runs => {
                    assert!(matches!(output.status.code(), Some(0 | 1)) && !told.is_empty(), "{command} {case}: {said}")
                }
                Refused(words) => {
                    assert_eq!(output.status.code(), Some(2), "{command} {case}: {said}");
                    assert!(said.starts_with("error: ") && said.contains(words), "{command} {case}: {said}");
                    assert!(
                        said.contains("next: ") || said.contains("--help"),
                        "{command} {case} does not say what to do: {said}"
                    );
                }
            }
        };
        match *command {
            "studio" => run(axis, of_gantry),
            _ => run(axis, &Runs),
        }
        match *command {
            // Its case needs a log.
            "studio" | "fit" => {}
            "tune" | "export st" => run(CLOSED_LOOP, &Runs),
            taken if WITH_STEPPER.contains(&taken) => run(CLOSED_LOOP, &Runs),
            _ => run(CLOSED_LOOP, &NO_MOTOR),
        }
        match *command {
            "studio" => {}
            // Its case needs a log.
            "fit" => {}
            "tune" | "export st" => STEPPERS.iter().for_each(|case| run(case, &OPEN_LOOP)),
            taken if WITH_STEPPER.contains(&taken) => STEPPERS.iter().for_each(|case| run(case, &Runs)),
            _ => STEPPERS.iter().for_each(|case| run(case, &NO_MOTOR)),
        }
        let gantries = match *command {
            "move" | "tune" | "plan" | "learn" => &IN_LOOP[..],
            "check" | "fit" | "frf" => &WITH_LOGS,
            _ => &GANTRIES,
        };
        gantries.iter().for_each(|case| run(case, of_gantry));
    }
}
