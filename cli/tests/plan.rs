//! `taut plan` as a user runs it.

use crate::common::taut;
use serde_json::Value;
use std::fs;
use tempfile::TempDir;

/// The same with feed-forward, which follows a plan without saturation.
const ELASTIC: &str = "stages/sollmann-jouaneh/controllers/pid-elastic.toml";
const PID: &str = "stages/sollmann-jouaneh/controllers/pid.toml";

#[test]
fn a_plan_is_written_and_moves() {
    let folder = TempDir::new().unwrap();
    let planned = folder.path().join("planned.toml");
    let planned = planned.to_str().unwrap();
    let output = taut(&["plan", PID, "--move", "long", "--out", planned, "--json"]);
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((output.status.code(), &told["schema"]), (Some(0), &"taut/plan/1".into()));
    let one = &told["moves"][0];
    assert!(one["arrival"]["in_window_s"].as_f64() > one["fastest_rigid_s"].as_f64(), "{one}");
    // The case that was written moves as was told.
    let moved = taut(&["move", planned, "--move", "long", "--json"]);
    let moved: Value = serde_json::from_slice(&moved.stdout).unwrap();
    let motion = &moved["moves"][0];
    let arrives = motion["profile_end_s"].as_f64().unwrap() + motion["settling_s"].as_f64().unwrap();
    assert!((arrives - one["arrival"]["in_window_s"].as_f64().unwrap()).abs() < 1e-9, "{motion}");
    assert_eq!(motion["shortfalls"], serde_json::json!([]));
    // Nothing is written over.
    let before = fs::read(planned).unwrap();
    let again = taut(&["plan", PID, "--move", "long", "--out", planned]);
    assert_eq!((again.status.code(), fs::read(planned).unwrap()), (Some(2), before));
    // The folder has a report.
    let out = folder.path().join("out");
    let done = taut(&["plan", PID, "--move", "long", "--set", "tune.spread=0", "--out", out.to_str().unwrap()]);
    assert_eq!(done.status.code(), Some(0));
    for name in ["planned.toml", "plan.json", "report.html", "files.json"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    // For one machine it is quicker, and the loop without feed-forward saturates for a moment: `move` warns of it, too.
    let told: Value = serde_json::from_slice(&fs::read(out.join("plan.json")).unwrap()).unwrap();
    let note = String::from_utf8_lossy(&done.stderr);
    assert!(
        told["moves"][0]["arrival"]["saturated_s"].as_f64() > Some(0.0) && note.contains("saturates for"),
        "{note}"
    );
    let moved = taut(&["move", out.join("planned.toml").to_str().unwrap(), "--move", "long"]);
    assert!(String::from_utf8_lossy(&moved.stderr).contains("saturates"), "{moved:?}");
}

#[test]
fn what_cannot_be_planned_is_told() {
    let cases: [(&[&str], i32, &str); 10] = [
        (&["stages/sollmann-jouaneh/table4.toml"], 2, "move"),
        (&[PID, "--move", "gone"], 2, "gone"),
        (&[PID, "--reserve", "95%"], 2, "a share from 0 to 90% is needed"),
        (&[PID, "--speed", "0"], 2, "speed above zero"),
        (&[PID, "--jerk", "5 m/s"], 2, "m/s^3"),
        (&[PID, "--move", "long", "--set", "cart.friction.static=1 kN"], 1, "breakaway requires"),
        (
            &[PID, "--move", "long", "--set", "cart.friction.static=1 kN", "--set", "cart.friction.coulomb=1 kN"],
            1,
            "there is no plan: breakaway requires",
        ),
        (&[PID, "--move", "long", "--set", "controller.limit=0.5 V"], 1, "there is no plan"),
        (&["stages/core-xy/core-xy.toml"], 2, "no move and no controller"),
        (
            &["stages/core-xy/square.toml", "--move", "square", "--set", "controller.limit=0.1 V"],
            1,
            "there is no plan: bridge: breakaway requires",
        ),
    ];
    for (plan, besides, part) in [
        ("{ speed = 0 }", "motor.resistance=1", "has to be above zero"),
        ("{ sped = 1 }", "motor.resistance=1", "did you mean `speed`?"),
        ("{ reserve = 0.95 }", "motor.resistance=1", "from 0 to 0.9"),
        ("{}, speed = 1", "motor.resistance=1", "the move has a plan already"),
        ("3", "motor.resistance=1", "expected a table"),
        ("{}", "cart.friction.static=1 kN", "there is no plan: breakaway requires"),
        ("{}", "motor.resistance=1", ""),
    ] {
        let planned = format!("move=[{{ name = \"long\", to = \"40 mm\", plan = {plan}, until = \"1 s\" }}]");
        let output = taut(&["move", ELASTIC, "--set", &planned, "--set", besides]);
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(if part.is_empty() { 0 } else { 2 }), "{plan}: {told}");
        assert!(told.contains(part), "{plan}: {told}");
    }
    for (words, status, part) in cases {
        let output = taut(&[&["plan"], words].concat());
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(status), "{words:?}: {told}");
        assert!(told.starts_with("error: ") && told.contains(part), "{words:?}: {told}");
    }
}
