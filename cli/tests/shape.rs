//! `taut shape` as a user runs it.

use crate::common::{root, taut_in};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn json(arguments: &[&str]) -> Value {
    let output = taut_in(root()).arg("shape").args(arguments).arg("--json").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A spectrum with one resonance at 40 Hz, as Klipper writes it.
fn spectrum(folder: &Path, name: &str, peak: f64) -> PathBuf {
    let mut text = String::from("freq,psd_x,psd_y,psd_z,psd_xyz\n");
    for k in 0..125 {
        let f = 1.6 * f64::from(k);
        let p = 1e6 / (1.0 + ((f - peak) / 3.0).powi(2));
        text += &format!("{f:.1},{p:.3e},0,0,{p:.3e}\n");
    }
    let file = folder.join(name);
    std::fs::write(&file, text).unwrap();
    file
}

#[test]
fn a_spectrum_a_second_one_and_their_files() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = [("a.csv", 40.0), ("b.csv", 48.0)].map(|(name, peak)| spectrum(folder.path(), name, peak));
    let out = folder.path().join("out");
    let [a, b, to] = [&a, &b, &out].map(|path| path.to_str().unwrap());
    let value = json(&[a, b, "--out", to]);
    let frequency = value["recommended"]["frequency"].as_f64().unwrap();
    assert!((frequency - 40.0).abs() < 8.0, "{frequency}");
    assert_eq!(value["shapers"].as_array().unwrap().len(), 6);
    let main = &value["comparison"]["main_peaks"];
    assert_eq!((main["first"].as_f64(), main["second"].as_f64()), (Some(40.0), Some(48.0)));
    assert!((main["stiffness_per_mass"].as_f64().unwrap() - 1.44).abs() < 1e-12);
    let wanted = ["shape.json", "report.html", "plots/spectrum.svg", "plots/spectrum-2.svg", "plots/compared.svg"];
    assert!(wanted.iter().all(|name| out.join(name).metadata().unwrap().len() > 500));
    let written: Value = serde_json::from_slice(&std::fs::read(out.join("shape.json")).unwrap()).unwrap();
    assert_eq!(written, value);
    // One axis alone, which has everything; the others have nothing.
    assert_eq!(json(&[a, "--axis", "x"])["recommended"], json(&[a])["recommended"]);
    taut_in(root()).args(["shape", a, "--axis", "z"]).assert().code(2);
}

#[test]
fn a_model_and_its_options() {
    let case = "stages/printer-axis/printer-axis.toml";
    let held = json(&[case]);
    let frequency = |value: &Value| value["model"]["modes"][0]["frequency"].as_f64().unwrap();
    let heavier = json(&[case, "--set", "cart.mass=0.8 kg"]);
    assert!(frequency(&heavier) < frequency(&held) && frequency(&held) < frequency(&json(&[case, "--motor", "free"])));
    assert_eq!(json(&[case, "--uncertainty", "0"])["recommended"]["shaper"], "zv");
    let only = json(&[case, "--shapers", "zvd,3hump_ei", "--damping", "0.05"]);
    let shapers = only["shapers"].as_array().unwrap();
    assert!(shapers.len() == 2 && shapers.iter().all(|one| one["candidate"] == true));
    assert_eq!(only["recommended"]["damping"], 0.05);
}

/// Pairs are looked at where they are asked for, with what they leave of each mode.
#[test]
fn pairs_of_shapers() {
    let case = "stages/sollmann-jouaneh/table4.toml";
    assert!(json(&[case])["pairs"].as_array().unwrap().is_empty());
    let found = json(&[case, "--pairs"]);
    let pairs = found["pairs"].as_array().unwrap();
    assert_eq!(pairs.len(), 3);
    let along = found["model"]["along_travel"].as_array().unwrap();
    let shapers = found["shapers"].as_array().unwrap().len();
    for mode in along {
        assert_eq!(mode["shapers"].as_array().unwrap().len(), shapers);
        assert_eq!(mode["pairs"].as_array().unwrap().len(), 3);
    }
    // What is left of the strongest at worst is what is left of all.
    let worst = |kind: &str, k: usize| {
        let of = |mode: &Value| mode[kind][k].as_f64().unwrap() * mode["share"].as_f64().unwrap();
        along.iter().map(of).fold(0.0, f64::max)
    };
    assert!((worst("pairs", 0) - pairs[0]["vibration"].as_f64().unwrap()).abs() < 1e-9);
    let told = taut_in(root()).args(["shape", case, "--pairs"]).output().unwrap();
    let told = String::from_utf8(told.stdout).unwrap();
    assert!(told.contains("\nPairs\n") && told.contains("mode along the travel"), "{told}");
}

/// A message, and nothing on the standard output; with `--pairs` as without.
#[test]
fn mistakes_have_their_messages() {
    let case = "stages/printer-axis/printer-axis.toml";
    for (arguments, message) in [
        (vec![case, "--pairs=3"], "error: unexpected value '3' for '--pairs' found; no more were expected\n"),
        (
            vec!["tests/bad/shape/density-nan.csv", "--pairs"],
            "error: tests/bad/shape/density-nan.csv:9:26: `nan` in column `psd_z` is not a finite number\n",
        ),
        (
            vec!["stages/emps/emps.toml", "--pairs"],
            "error: stages/emps/emps.toml: a rigid belt has no resonance\n  allowed: belt.model = \"elastic\" or \"two-mass\"\n",
        ),
        // It was ignored.
        (
            vec![case, "--firmware", "klipper-2025-08", "--max-vibrations", "2"],
            "error: --max-vibrations: Klipper until 2025-08 chooses without a limit of the vibration\n",
        ),
    ] {
        let output = taut_in(root()).arg("shape").args(&arguments).output().unwrap();
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {told}");
        assert!(output.stdout.is_empty() && told.starts_with(message), "{arguments:?}: {told}");
    }
}

#[path = "../../tests/common/chance.rs"]
#[allow(dead_code)]
mod chance;
#[path = "../../tests/common/shaken.rs"]
#[allow(dead_code)]
mod shaken;

/// Spectra of two belts, of which the second is looser: on the terminal, as JSON, and in the report.
#[test]
fn the_looser_of_two_belts() {
    let mut chance = chance::Chance::new(5);
    let machine = shaken::Machine::drawn(&mut chance, 0.82, shaken::Disturbed::Little);
    let folder = tempfile::tempdir().unwrap();
    let files = ["a.csv", "b.csv"].map(|name| folder.path().join(name));
    for (belt, file) in files.iter().enumerate() {
        std::fs::write(file, machine.file(belt, &mut chance)).unwrap();
    }
    let out = folder.path().join("out");
    let [a, b, to] = [&files[0], &files[1], &out].map(|path| path.to_str().unwrap());
    let value = json(&["--belts", a, b, "--out", to]);
    assert_eq!(value["belts"]["looser"], "belt B");
    let ratio = value["belts"]["stiffness_ratio"].as_f64().unwrap();
    assert!((ratio / 0.82 - 1.0).abs() < 0.02, "{ratio}");
    assert!(["plots/belt-a.svg", "plots/belt-b.svg"].iter().all(|name| out.join(name).is_file()));
    let words = value["belts"]["words"].as_str().unwrap();
    // Quantities stand in elements of their own.
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    let report = report.replace("<span class=\"q\">", "").replace("</span>", "");
    assert!(words.starts_with("belt B is looser than belt A: ") && report.contains(words), "{words}");
    // Without the option nothing is stated.
    assert!(json(&[a, b])["belts"].is_null());
    // One spectrum given twice has no second belt.
    let twice = taut_in(root()).args(["shape", "--belts", a, a]).output().unwrap();
    let told = String::from_utf8_lossy(&twice.stderr);
    assert!(twice.status.code() == Some(2) && told.contains("the same values as in"), "{told}");
}

#[test]
fn mistakes_end_with_status_2() {
    let case = "stages/printer-axis/printer-axis.toml";
    let bad = "tests/bad/shape/density-nan.csv";
    for arguments in [
        vec!["no-such-file.csv"],
        vec![bad],
        vec!["stages/emps/emps.toml"],
        vec![case, "--axis", "x"],
        vec![case, "--damping", "1.5"],
        vec![case, "--max-smoothing", "0.1"],
        vec![case, "--max-smoothing", "0.0001 mm"],
        vec![case, "--corner-speed", "5 mm"],
        vec![case, "--shapers", "zw"],
        vec![case, "--uncertainty", "10"],
        vec![bad, "--motor", "free"],
        vec![case, "--belts"],
    ] {
        let output = taut_in(root()).arg("shape").args(&arguments).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty() && output.stderr.starts_with(b"error: "), "{arguments:?}");
    }
}
