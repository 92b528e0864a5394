//! `taut design` as a user runs it.

use crate::common::taut;
use serde_json::Value;
use std::fs;

const TABLE4: &str = "stages/sollmann-jouaneh/table4.toml";

const QUICK: [&str; 4] = ["--input", "trapezoid", "--duration", "1s"];
const ANGLE: [&str; 2] = ["--measure", "drive_angle=1mrad"];

#[test]
fn an_experiment_in_the_case() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("designed");
    let names = ["design", TABLE4, "--for", "cart.mass,cart.friction.viscous", "--out", out.to_str().unwrap()];
    let told = taut(&[&names[..], &QUICK, &ANGLE, &["--verify", "2"]].concat());
    let text = String::from_utf8(told.stdout).unwrap();
    assert!(told.status.success(), "{text}");
    assert!(text.contains("[[experiment]]\nname = \"designed\"\n") && text.contains("there and back"), "{text}");
    for name in ["designed.toml", "design.json", "report.html", "plots/designed.svg", "files.json"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    let value: Value = serde_json::from_str(&fs::read_to_string(out.join("design.json")).unwrap()).unwrap();
    assert_eq!((&value["complete"], value["parameters"].as_array().unwrap().len()), (&Value::Bool(true), 2));
    assert_eq!(value["verified"][0]["fits"], 2);
    // It is a case like any other: its experiment goes as far as was said.
    let case = out.join("designed.toml");
    let run = taut(&["simulate", case.to_str().unwrap(), "--experiment", "designed", "--json"]);
    let run: Value = serde_json::from_slice(&run.stdout).unwrap();
    let speed = run["experiments"][0]["metrics"]["peak_cart_speed_m_s"]["value"].as_f64().unwrap();
    let said = value["reached"]["speed_m_per_s"].as_f64().unwrap();
    assert!((speed.abs() / said - 1.0).abs() < 1e-2, "{speed} {said}");
    // Another design does not take the name of the first.
    let again = taut(&[&["design", case.to_str().unwrap(), "--for", "cart.mass"][..], &QUICK, &ANGLE].concat());
    assert!(String::from_utf8(again.stdout).unwrap().contains("name = \"designed 2\""));
}

#[test]
fn what_it_cannot_do_it_says() {
    let name = ["--for", "cart.mass"];
    for (args, told, status) in [
        (vec![], "there is nothing to determine: the case has no [fit]", 2),
        (vec!["--for", "cart.mas"], "`cart.mas`", 2),
        (vec!["--for", "cart.mass"], "nothing is measured in this case", 2),
        ([&name[..], &["--measure", "angle=1mrad"]].concat(), "`angle` is not a measured quantity; available are", 2),
        ([&name[..], &["--measure", "drive_angle"]].concat(), "such as drive_angle=1mrad", 2),
        ([&name[..], &["--measure", "drive_angle=-1"]].concat(), "a standard deviation above zero is needed", 2),
        ([&name[..], &ANGLE, &["--amplitude", "5 A"]].concat(), "--amplitude: \"5 A\" is a current", 2),
        ([&name[..], &ANGLE, &["--amplitude", "-5 V"]].concat(), "unexpected argument", 2),
        ([&name[..], &ANGLE, &["--amplitude=-5 V"]].concat(), "--amplitude -5 V is no size", 2),
        ([&name[..], &ANGLE, &["--travel", "0 m"]].concat(), "a length above zero", 2),
        ([&name[..], &ANGLE, &["--margin", "100%"]].concat(), "a share from 0 to below 1", 2),
        ([&name[..], &ANGLE, &["--duration", "2 ms"]].concat(), "has 2 of them", 2),
        ([&name[..], &ANGLE, &["--input", "square"]].concat(), "possible values: trapezoid, sweep", 2),
    ] {
        let args = [vec!["design", TABLE4], args].concat();
        let output = taut(&args);
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(text.contains(told) && output.status.code() == Some(status), "{args:?}: {:?} {text}", output.status);
    }
    let gantry = ["design", "stages/core-xy/core-xy.toml", "--for", "cart.mass"];
    for (args, words) in [
        (vec![], "--measure left_angle=1mrad --measure right_angle=1mrad"),
        (vec!["--measure", "drive_angle=1mrad"], "`drive_angle` is no measured quantity of this machine"),
        (vec!["--measure", "left_angle=1mrad", "--drive", "middle"], "allowed: left, right, bridge, cart"),
    ] {
        let output = taut(&[&gantry[..], &args].concat());
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(text.contains(words) && output.status.code() == Some(2), "{args:?}: {text}");
    }
    let axis = taut(&[&["design", TABLE4, "--for", "cart.mass", "--drive", "left"][..], &ANGLE].concat());
    assert!(String::from_utf8(axis.stderr).unwrap().contains("this machine has one drive"));
}

#[test]
fn what_is_not_determined_ends_with_status_one() {
    // Of a belt that does not stretch the friction of both pulleys acts as one.
    let names = ["--set", "belt.model=rigid", "--for", "drive_pulley.friction.viscous,idler_pulley.friction.viscous"];
    let told = taut(&[&["design", TABLE4, "--json"][..], &names, &QUICK, &ANGLE].concat());
    let value: Value = serde_json::from_slice(&told.stdout).unwrap();
    assert_eq!((told.status.code(), &value["complete"]), (Some(1), &Value::Bool(false)), "{value}");
    assert_eq!(value["not_determined"][0]["parameters"].as_array().unwrap().len(), 2);
}
