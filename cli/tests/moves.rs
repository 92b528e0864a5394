//! Moves that the machine cannot make.

use crate::common::root;
use serde_json::Value;

/// `taut` in the repository: exit status, standard output, standard error.
fn run(arguments: &[&str]) -> (Option<i32>, String, String) {
    crate::missing_logs::run(&root(), arguments)
}

const PID: &str = "stages/sollmann-jouaneh/controllers/pid-elastic.toml";

/// A move of 2.4 mm error with 152 saturated samples of 901 ended with status 0.
#[test]
fn a_move_that_cannot_be_followed_is_told_with_its_limit() {
    let (status, out, err) = run(&["move", PID]);
    assert_eq!(status, Some(0), "{err}");
    assert!(!out.contains("out of reach"), "{out}");
    let little = "amplifier.voltage_limit=3V";
    let (status, out, err) = run(&["move", PID, "--set", little]);
    assert_eq!(status, Some(1), "{out}");
    assert!(out.contains("out of reach") && err.contains("cannot be followed") && err.contains("reach 0.111"), "{err}");
    let (status, out, err) = run(&["show", PID, "--set", little]);
    assert_eq!(status, Some(0), "{err}");
    assert!(out.contains("cannot be followed"), "{out}");
    let (status, out, _) = run(&["move", PID, "--set", little, "--json"]);
    assert_eq!(status, Some(1));
    let result: Value = serde_json::from_str(&out).unwrap();
    let short = result["moves"][0]["shortfalls"].as_array().unwrap();
    let voltage = short.iter().find(|short| short["limit"] == "voltage").unwrap();
    assert!(voltage["allowed"] == 3.0 && voltage["needed"].as_f64().unwrap() > 3.0, "{voltage}");
}
