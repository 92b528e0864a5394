//! `taut learn` as a user runs it.

use crate::common::{root, taut};
use serde_json::Value;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A loop that is stable on the whole family.
const SHAPED: &str = "stages/sollmann-jouaneh/controllers/pid-shaped.toml";

/// The error of the cart, rms, of a move that was run with what was learned on a machine that the case does not know.
#[test]
fn a_move_is_repeated_and_learned() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let hidden = ["--set", "cart.mass=0.4 kg", "--set", "cart.friction.coulomb=0.25 N"];
    let mut errors = Vec::new();
    let mut added: Option<String> = None;
    for k in 0..4 {
        let (out, learned) = (at(&format!("trial-{k}")), at(&format!("learned-{k}")));
        let given: Vec<&str> = added.iter().flat_map(|file| ["--added", file.as_str()]).collect();
        let run =
            [&["move", SHAPED, "--move", "short fast", "--no-report", "--out", &out][..], &hidden, &given].concat();
        assert!(matches!(taut(&run).status.code(), Some(0 | 1)));
        let log = format!("{out}/short-fast.csv");
        let learn =
            [&["learn", SHAPED, "--move", "short fast", "--log", &log, "--out", &learned, "--json"][..], &given]
                .concat();
        let output = taut(&learn);
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!((output.status.code(), &told["schema"]), (Some(0), &"taut/learn/1".into()), "{told}");
        errors.push(told["loads"][0]["error"]["rms_m"].as_f64().unwrap());
        for name in ["learn.json", "next.csv", "report.html", "plots/learned.svg", "plots/convergence.svg"] {
            assert!(Path::new(&learned).join(name).is_file(), "{name}");
        }
        let written: Value = serde_json::from_slice(&fs::read(format!("{learned}/learn.json")).unwrap()).unwrap();
        assert_eq!(written, told);
        added = Some(format!("{learned}/next.csv"));
    }
    assert!(errors[3] < 0.5 * errors[0], "{errors:?}");
}

#[test]
fn what_cannot_be_learned_is_told() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let out = at("trial");
    taut(&["move", SHAPED, "--move", "short fast", "--no-report", "--out", &out]);
    let log = format!("{out}/short-fast.csv");
    let short = at("short.csv");
    let lines: Vec<String> = fs::read_to_string(&log).unwrap().lines().take(50).map(String::from).collect();
    fs::write(&short, lines.join("\n")).unwrap();
    let gone = at("gone.csv");
    let usual = ["learn", SHAPED, "--move", "short fast", "--log", &log];
    let square = ["learn", "stages/core-xy/square.toml", "--move", "square", "--log", &log];
    let cases: [(Vec<&str>, i32, &str); 13] = [
        (vec!["learn", SHAPED, "--log", &log], 2, "the case has 3 moves, and a log is of one"),
        (vec!["learn", SHAPED, "--move", "gone", "--log", &log], 2, "gone"),
        (vec!["learn", SHAPED, "--move", "short fast", "--log", &gone], 2, "there is no such file"),
        (vec!["learn", SHAPED, "--move", "short fast", "--log", &short], 2, "short.csv: the log ends at"),
        ([&usual[..], &["--position", "nowhere"]].concat(), 2, "nowhere"),
        ([&usual[..], &["--unit", "V"]].concat(), 2, "a unit of length is needed"),
        ([&usual[..], &["--added", &log]].concat(), 2, "added_V"),
        (
            [&usual[..], &["--set", "controller.pid.proportional=300 V/mm"]].concat(),
            1,
            "pid-shaped.toml: the loop is not stable",
        ),
        (square.to_vec(), 2, "bridge_position_m"),
        (
            [&square[..], &["--position", "cart_position_m"]].concat(),
            2,
            "2, separated by commas, in the order bridge, cart",
        ),
        ([&square[..], &["--encoder"]].concat(), 2, "name 2 with --position, in the order left, right"),
        (vec!["move", "stages/core-xy/square.toml", "--move", "square", "--added", &log], 2, "left_added_V"),
        (vec!["move", SHAPED, "--added", &log], 2, "a signal is of one move, and the case has 3"),
    ];
    for (args, status, words) in cases {
        let output = taut(&args);
        let told = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(status) && told.contains(words), "{args:?}: {:?} {told}", output.status);
        assert!(["next: ", "allowed: ", "--help"].iter().any(|word| told.contains(word)), "{args:?}: {told}");
    }
}

/// Slow motion on a machine with a force along the travel: its map, the case with it, and what is refused.
#[test]
fn a_force_along_the_travel_is_mapped() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (axis, out) = (at("axis.toml"), at("mapped"));
    let root = root();
    let text = fs::read_to_string(root.join(SHAPED)).unwrap();
    let log = r#"{ file = "slow/slow.csv", time = "time_s", input = "voltage_V", drive_angle = "drive_angle_rad" }"#;
    fs::write(&axis, format!("{text}\n[[experiment]]\nname = \"slow\"\nlog = {log}\n")).unwrap();
    let slow = "move=[{ name = 'slow', points = ['300 mm', '0 mm'], speed = '60 mm/s', acceleration = '0.5 m/s^2', \
                until = '11 s', window = '1 mm' }]";
    let bump = r#"cart.force_along=[["50 mm", "0 N"], ["100 mm", "1.5 N"], ["200 mm", "-1 N"], ["250 mm", "0 N"]]"#;
    taut(&["move", &axis, "--set", slow, "--set", bump, "--no-report", "--quiet", "--out", &at("slow")]);
    let output = taut(&["learn", &axis, "--map", "--out", &out, "--json"]);
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((output.status.code(), &told["schema"]), (Some(0), &"taut/map/1".into()), "{told}");
    assert_eq!((&told["is_significant"], &told["passes"]["forward"]), (&true.into(), &1.into()), "{told}");
    for name in ["map.json", "mapped.toml", "report.html", "plots/map.svg"] {
        assert!(Path::new(&out).join(name).is_file(), "{name}");
    }
    let largest = told["force_N"].as_array().unwrap().iter().filter_map(Value::as_f64).fold(0.0, f64::max);
    assert!((largest - 1.5).abs() < 0.15, "{largest}");
    // The case with the map leads to the log from where it lies, and has nothing left to learn.
    let mapped = format!("{out}/mapped.toml");
    let again: Value = serde_json::from_slice(&taut(&["learn", &mapped, "--map", "--json"]).stdout).unwrap();
    let left = again["force_N"].as_array().unwrap().iter().filter_map(Value::as_f64);
    assert!(left.map(f64::abs).fold(0.0, f64::max) < 0.1, "{again}");
    let cases: [(&[&str], &str); 4] = [
        (&["learn", &axis, "--map", "--log", "slow.csv"], "cannot be used with"),
        (&["learn", &axis], "--log <FILE>"),
        (&["learn", SHAPED, "--map"], &format!("error: {SHAPED}: no experiment has a log")),
        (
            &["learn", "stages/core-xy/core-xy.toml", "--map"],
            "core-xy.toml: a force along the travel is mapped on an axis",
        ),
    ];
    for (args, words) in cases {
        let output = taut(args);
        let told = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && told.contains(words), "{args:?}: {:?} {told}", output.status);
    }
}
