//! `taut show`: what follows from the numbers, and files that begin with data sheets.

use crate::common::{read, root, taut, taut_in};
use serde_json::Value;
use std::f64::consts::PI;
use tempfile::TempDir;

fn shown(args: &[&str]) -> Value {
    let output = taut(&[&["show"], args, &["--json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn rows(shown: &Value) -> Vec<&Value> {
    shown["groups"].as_array().unwrap().iter().flat_map(|group| group["rows"].as_array().unwrap()).collect()
}

fn value(shown: &Value, key: &str) -> f64 {
    let row = rows(shown).into_iter().find(|row| row["key"] == key).unwrap_or_else(|| panic!("no {key}"));
    row["value"].as_f64().unwrap()
}

fn codes(shown: &Value) -> Vec<&str> {
    shown["notes"].as_array().unwrap().iter().map(|note| note["code"].as_str().unwrap()).collect()
}

fn near(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-9 * b.abs(), "{a} and {b}");
}

const TABLE4: &str = "stages/sollmann-jouaneh/table4.toml";

/// By hand from Table 4: r = 19.4 mm, J = 6.3e-5 kg m², M = 0.362 kg, K = 23 mN m/A, R = 0.71 ohm.
#[test]
fn the_papers_machine_as_one_computes_it_by_hand() {
    let shown = shown(&[TABLE4]);
    let (r, j, k) = (0.0194, 6.3e-5, 0.023);
    let mass = 0.362 + 2.0 * j / (r * r);
    near(value(&shown, "total_mass"), mass);
    near(value(&shown, "force_per_input"), k / (0.71 * r));
    near(value(&shown, "drag"), k * k / (0.71 * r * r));
    near(value(&shown, "travel_per_turn"), 2.0 * PI * r);
    // 0.2 N at the cart, 15 mN m at each pulley.
    let friction = 0.2 + 2.0 * 0.015 / r;
    near(value(&shown, "breakaway_input"), friction * 0.71 * r / k);
    let stiffness = 132_760.0 + 132_760.0 * 58_885.0 / (132_760.0 + 58_885.0);
    near(value(&shown, "stretch_per_force"), 1.0 / stiffness);
    // Its experiments command 10 V at most.
    let force = 10.0 * k / (0.71 * r);
    near(value(&shown, "largest_force"), force);
    near(value(&shown, "largest_acceleration"), (force - friction) / mass);
    let slope = 19.0424 + 2.0 * 0.0016 / (r * r) + k * k / (0.71 * r * r);
    near(value(&shown, "largest_speed"), (force - friction) / slope);
    assert!(codes(&shown).contains(&"no-damping"), "{:?}", codes(&shown));
    assert_eq!(shown["depends_on_place"], false);
}

/// The breakaway had the force along the travel, the largest acceleration and speed had not.
#[test]
fn a_force_along_the_travel_acts_as_a_load() {
    let along = "cart.force_along=[[\"-0.1 m\", \"0.5 N\"], [\"0 m\", \"0.5 N\"], [\"0.1 m\", \"0.5 N\"]]";
    let [along, load] = [along, "cart.load=0.5 N"].map(|change| shown(&[TABLE4, "--set", change]));
    for row in ["largest_acceleration", "largest_speed", "breakaway_input"] {
        for key in [row.to_string(), format!("{row}_backward")] {
            near(value(&along, &key), value(&load, &key));
            assert_ne!(value(&along, &key), value(&shown(&[TABLE4]), row));
        }
    }
}

/// Frequencies and damping are those of `taut modes`.
#[test]
fn frequencies_are_those_of_the_modes() {
    for machine in ["stages/laser-gantry/laser-gantry.toml", "stages/h-frame/h-frame.toml"] {
        let shown = shown(&[machine]);
        let output = taut(&["modes", machine, "--json"]);
        let modes: Value = serde_json::from_slice(&output.stdout).unwrap();
        let first = match modes.get("elastic") {
            Some(elastic) => elastic[0]["frequency_Hz"].as_f64().unwrap(),
            None => modes["here"]["undamped_resonances_Hz"][0].as_f64().unwrap(),
        };
        near(value(&shown, "resonance1"), first);
    }
}

#[test]
fn templates_begin_with_data_sheets_and_run_as_they_stand() {
    let folder = TempDir::new().unwrap();
    for name in ["stage", "printer-servo", "gantry"] {
        let file = folder.path().join(format!("{name}.toml"));
        let file = file.to_str().unwrap();
        let told = taut(&["init", "--template", name, file]);
        assert_eq!(String::from_utf8(told.stdout).unwrap(), format!("wrote {file}\nnext: taut show {file}\n"));
        let found = shown(&[file]);
        for key in ["largest_force", "tension_safety", "teeth_in_mesh"] {
            assert!(value(&found, key) > 1.0, "{name}: {key} is {}", value(&found, key));
        }
        assert_eq!(codes(&found), ["belt-source"], "{name}");
        assert_eq!(found["depends_on_place"], true, "{name}");
        // The ratio that the file asks for is that of the slowest mode, and friction and motor add to it.
        assert!(value(&found, "resonance1_damping") > 0.0199, "{name}");
        let out = folder.path().join(name);
        taut_in(root()).args(["show", file, "--out", out.to_str().unwrap(), "--quiet"]).assert().success().stdout("");
        for file in ["show.json", "report.html", "files.json"] {
            assert!(out.join(file).exists(), "{name}: {file}");
        }
        taut_in(root()).args(["simulate", file, "--quiet"]).assert().success();
    }
    let refused = taut(&["init", "--template", "stage", "--kind", "h-frame", "x.toml"]);
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn the_template_of_a_printer_has_a_stepper_and_goes_through_its_commands() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("printer.toml");
    let file = file.to_str().unwrap();
    taut_in(root()).args(["init", "--template", "printer", file]).assert().success();
    let found = shown(&[file]);
    assert_eq!(value(&found, "holding_torque"), 0.45);
    for command in ["simulate", "move", "shape"] {
        taut_in(root()).args([command, file, "--quiet"]).assert().success();
    }
    // Its loop is open; its repetitions are learned from, if there is a log.
    let learn = ["learn", "--move", "80 mm", "--log", "trial.csv"];
    for (command, words) in [(&["tune"][..], "has no gains to tune"), (&learn, "there is no such file")] {
        let refused = taut(&[command, &[file]].concat());
        let said = String::from_utf8(refused.stderr).unwrap();
        assert!(refused.status.code() == Some(2) && said.contains(words), "{said}");
    }
}

#[test]
fn what_nothing_bounds_is_said() {
    let torque = "stages/laser-gantry/laser-gantry.toml";
    let text = read(torque);
    let text = text.replace("[[experiment]]", "[[other]]");
    let begin = text.find("[[other]]").unwrap();
    let text = format!("{}[controller]\nevery = \"1 ms\"\npid = {{ proportional = 1 }}\n", &text[..begin]);
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("bare.toml");
    std::fs::write(&file, &text).unwrap();
    let found = shown(&[file.to_str().unwrap()]);
    assert!(codes(&found).contains(&"no-limit"), "{:?}", codes(&found));
    assert!(rows(&found).iter().all(|row| row["key"] != "largest_force"));
}

/// A gantry is described as an axis is; values by hand from the numbers of the CoreXY, both motors for each direction.
#[test]
fn a_gantry_is_answered_as_an_axis_is() {
    let square = "stages/core-xy/square.toml";
    let found = shown(&[square, "--set", "controller.limit=12 V"]);
    let (r, k, ohm) = (0.0194, 0.023, 0.71);
    near(value(&found, "largest_force"), 12.0 * k / (ohm * r));
    near(value(&found, "breakaway_input_x"), (2.0 * 0.015 / r + 0.7) * ohm * r / (2.0 * k));
    near(value(&found, "total_mass_y"), value(&found, "cart_mass") + value(&found, "turning_mass"));
    let both = 2.0 * value(&found, "largest_force");
    near(value(&found, "largest_stretch_x"), both * value(&found, "stretch_per_force_x"));
    assert!(codes(&found).iter().all(|code| *code != "move-out-of-reach"), "{:?}", codes(&found));
    // 0.5 V move nothing, and no move can be made with them.
    let weak = shown(&[square, "--set", "controller.limit=0.5 V"]);
    let codes = codes(&weak);
    assert!(codes.contains(&"does-not-move") && codes.contains(&"move-out-of-reach"), "{codes:?}");
}

#[test]
fn a_belt_that_is_too_weak_is_told_with_both_forces() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("printer.toml");
    let file = file.to_str().unwrap();
    taut_in(root()).args(["init", "--template", "printer-servo", file]).assert().success();
    let found = shown(&[file, "--set", "motor.speed_constant=60 rpm/V", "--set", "belt.width=3 mm"]);
    assert!(codes(&found).contains(&"belt-overloaded"), "{:?}", codes(&found));
    assert!(value(&found, "tension_safety") < 1.0);
}

#[test]
fn wrong_input_is_told_with_its_place() {
    let told = |args: &[&str]| {
        let output = taut(&[&["show"], args].concat());
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    assert_eq!(
        told(&["none.toml"]),
        (Some(2), "error: none.toml: this case file cannot be read: there is no such file\n  next: check the path, or write a new case with `taut init`\n".into())
    );
    assert_eq!(
        told(&[TABLE4, "--set", "cart.mass=0 kg"]),
        (
            Some(2),
            "error: --set:1:11: cart.mass: 0 kg has to be above zero\n  1 | cart.mass=0 kg\n    |           ^^^^\n  allowed: from 1e-15 kg to 1e15 kg\n".into()
        )
    );
    let (status, error) = told(&[]);
    assert_eq!(status, Some(2));
    assert!(error.contains("required arguments were not provided"), "{error}");
}

/// The answer comes first: details were 60 lines of `show` and 90 of `tune` before anybody asked for them.
#[test]
fn details_are_printed_only_if_asked_for() {
    let printed = |args: &[&str]| {
        let output = taut(args);
        assert_eq!(output.stderr, b"", "{args:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    for machine in [TABLE4, "stages/printer-axis/printer-axis.toml", "stages/core-xy/follows.toml"] {
        let (short, long) = (printed(&["show", machine]), printed(&["show", machine, "--verbose"]));
        let found = shown(&[machine]);
        let names = |text: &str| rows(&found).iter().filter(|row| named(text, row["name"].as_str().unwrap())).count();
        assert_eq!(names(&long), rows(&found).len(), "{machine}: {long}");
        assert!(names(&short) < names(&long) && short.lines().count() <= 32, "{machine}: {short}");
        assert!(short.contains("more rows") && short.contains("--verbose") && !long.contains("more rows"), "{short}");
        assert!(named(&short, "resonance 1") || named(&short, "elastic mode 1"), "{machine}: {short}");
    }
    let pid = "stages/sollmann-jouaneh/controllers/pid.toml";
    let judged = ["tune", pid, "--evaluate"];
    let run = |more: &[&str]| {
        let output = taut(&[&judged[..], more].concat());
        String::from_utf8(output.stdout).unwrap()
    };
    let (short, long) = (run(&[]), run(&["--verbose"]));
    for heading in ["The axis as the file has it", "Objective", "Axes", "Limit cycles at rest"] {
        assert!(!short.contains(heading) && long.contains(heading), "{heading}: {short}\n{long}");
    }
    for heading in ["Gains", "At worst", "Moves"] {
        assert!(short.contains(heading) && long.contains(heading), "{heading}: {short}\n{long}");
    }
    let output = taut(&["show", TABLE4, "--verbose", "--quiet"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8(output.stderr).unwrap().contains("cannot be used with"));
}

/// True if a line of a text begins with a name.
fn named(text: &str, name: &str) -> bool {
    text.lines().any(|line| line.trim_start().starts_with(name))
}

/// A supply below what rated current needs was mentioned by no command.
#[test]
fn a_low_supply_of_a_stepper_is_a_warning_of_all_commands_that_run_it() {
    let case = "stages/stepper-axis/stepper-axis.toml";
    for (command, changes) in [("show", &[][..]), ("simulate", &["--experiment", "20 mm in 33 ms"]), ("move", &[])] {
        let said = |supply: &str| {
            let output = taut(&[&[command, case, "--set", supply], changes].concat());
            format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
        };
        let low = said("stepper.supply=3 V").split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            low.contains("warning: the supply of 3 V is below the 3.96 V that the rated current"),
            "{command}: {low}"
        );
        assert!(!said("stepper.supply=24 V").contains("the supply of"), "{command}");
    }
}
