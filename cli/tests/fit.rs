//! `taut check`, `taut fit` and the band of `taut simulate` as a user runs them, on a log that was simulated.

use crate::common::taut_in;
use serde_json::Value;
use std::path::Path;
use tempfile::TempDir;

/// A folder with `mine.toml`: the template, and the log that its encoder makes of the pulse.
fn with_a_log() -> TempDir {
    let folder = TempDir::new().unwrap();
    taut_in(folder.path()).args(["init", "axis.toml"]).assert().success();
    let arguments = ["simulate", "axis.toml", "--experiment", "5 V pulse", "--as-measured", "--out", "made", "--quiet"];
    taut_in(folder.path()).args(arguments).assert().success();
    let mut text = std::fs::read_to_string(folder.path().join("axis.toml")).unwrap();
    text += "\n[[experiment]]\nname = \"log\"\nlog = { file = \"made/5-v-pulse.measured.csv\", time = \"time_s\", input = \"voltage_V\", drive_angle = \"drive_angle_rad\" }\n";
    text += "\n[fit]\nfree = [\"cart.friction.viscous\", \"cart.friction.coulomb\"]\n";
    std::fs::write(folder.path().join("mine.toml"), text).unwrap();
    folder
}

fn json(folder: &Path, file: &str) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join(file)).unwrap()).unwrap()
}

#[test]
fn a_fit_its_posterior_and_the_band_of_its_machines() {
    let folder = with_a_log();
    let at = folder.path();
    let output = taut_in(at)
        .args(["fit", "mine.toml", "--posterior", "--draws", "100", "--chains", "2", "--out", "found", "--json"])
        .args(["--set", "cart.friction.viscous=10"])
        .output()
        .unwrap();
    // So few draws may be doubted, which the exit status says.
    assert!(matches!(output.status.code(), Some(0 | 1)), "{}", String::from_utf8_lossy(&output.stderr));
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(value, json(at, "found/fit.json"));
    let viscous = &value["parameters"][0];
    assert_eq!(viscous["name"], "cart.friction.viscous");
    let (value_of, error) = (viscous["value"].as_f64().unwrap(), viscous["standard_error"].as_f64().unwrap());
    // The template's friction made the log.
    assert!((value_of - 19.0424).abs() < 4.0 * error && error < 0.2, "{value_of} ± {error}");
    assert_eq!(value["profiles"].as_array().unwrap().len(), 2);
    assert_eq!(value["posterior"]["draws"], 200);
    let median = value["posterior"]["parameters"][0]["median"].as_f64().unwrap();
    assert!((median - value_of).abs() < 2.0 * error, "{median}");
    let page = std::fs::read_to_string(at.join("found/report.html")).unwrap();
    assert!(page.contains("Profiles") && page.contains("Posterior") && page.contains("fitted.toml"));

    // What was written is a case that simulates, with its own draws as a band.
    taut_in(at).args(["simulate", "found/fitted.toml", "--experiment", "5 V pulse", "--quiet"]).assert().success();
    let arguments = ["simulate", "found/fitted.toml", "--experiment", "5 V pulse", "--draws", "found/posterior.csv"];
    taut_in(at).args(arguments).args(["--bands", "20", "--out", "band", "--quiet"]).assert().code(2);
    taut_in(at).args(arguments).args(["--machines", "20", "--out", "band", "--quiet"]).assert().success();
    let names: Vec<String> = std::fs::read_dir(at.join("band"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    assert!(names.iter().any(|name| name.contains("band")), "{names:?}");
}

/// `fit` refused with status 2 what `check` called determined in part, and said nothing of the rest.
#[test]
fn what_is_not_determined_ends_with_status_1_and_keeps_its_value() {
    let folder = with_a_log();
    let free = "fit.free=[\"drive_pulley.friction.viscous\", \"cart.friction.viscous\"]";
    let output = taut_in(folder.path())
        .env("COLUMNS", "1000")
        .args(["fit", "mine.toml", "--out", "found", "--set", free])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(told.contains("B₁ + r² b + B₂ + K_t K_e/R") && told.contains("- fix one"), "{told}");
    assert!(told.contains("± ∞") && told.contains("drive_pulley.friction.viscous + "), "{told}");
    let fit = json(folder.path(), "found/fit.json");
    assert_eq!((&fit["converged"], &fit["ending"]), (&Value::Bool(false), &Value::from("not_determined")));
    assert_eq!(fit["not_determined"][0]["combinations"].as_array().unwrap().len(), 1, "{fit}");
    let text = std::fs::read_to_string(folder.path().join("found/fitted.toml")).unwrap();
    assert!(text.contains("known = \"not determined\""), "{text}");
    let output = taut_in(folder.path()).args(["check", "mine.toml", "--json", "--set", free]).output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(value["complete"], false);
    assert_eq!(value["not_determined"][0]["combinations_determined"], 1);
    assert!(value["experiments"].as_array().unwrap().iter().any(|one| one["determined"] == 2), "{value}");
    assert_eq!(value["logs"][0]["samples"], 1001);
    let notes = value["logs"][0]["notes"].as_array().unwrap();
    assert!(notes.iter().any(|note| note["severity"] == "warning"), "{notes:?}");
}

/// A flipped sign "converged" with status 0; what warns is written with --anyway alone.
#[test]
fn a_fit_that_warns_writes_nothing_unless_told() {
    let folder = with_a_log();
    let flipped = "experiment.2.log.scale={ drive_angle = -1 }";
    let run = |more: &[&str]| {
        let arguments = ["fit", "mine.toml", "--out", "found", "--no-report", "--set", flipped];
        taut_in(folder.path()).args(arguments).args(more).output().unwrap()
    };
    let output = run(&[]);
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(told.lines().any(|line| line.starts_with("warning: ") && line.contains("against")), "{told}");
    assert!(told.contains("--anyway") && !told.contains("\nconverged"), "{told}");
    assert!(!folder.path().join("found/fitted.toml").exists());
    let output = run(&["--anyway"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(folder.path().join("found/fitted.toml").exists());
}

/// The standard error of a command, and its exit status.
fn told(folder: &Path, args: &[&str]) -> (Option<i32>, String) {
    let output = taut_in(folder).args(args).output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

#[test]
fn laws_and_windows_that_are_none_are_refused() {
    let folder = with_a_log();
    let told = |args: &[&str]| told(folder.path(), &[&["fit", "mine.toml"], args].concat());
    let (status, text) = told(&["--compare", "--laws", "dry"]);
    assert_eq!(status, Some(2), "{text}");
    assert!(text.contains("there is no friction law \"dry\" to compare"), "{text}");
    assert!(
        text.contains("allowed: viscous, coulomb, asymmetric, stribeck, along, force-along, force-by-speed, lugre"),
        "{text}"
    );
    for window in ["0s", "-1s", "long", "1 m"] {
        let (status, text) = told(&["--compare", &format!("--windows={window}")]);
        assert_eq!(status, Some(2), "{window}: {text}");
        assert!(text.contains(&format!("\"{window}\" is not a length of windows")), "{text}");
        assert!(text.contains("allowed: whole, or a time above zero such as 2s"), "{text}");
    }
    for args in [&["--laws", "coulomb"][..], &["--compare", "--drift"], &["--drift", "--posterior"]] {
        assert_eq!(told(args).0, Some(2), "{args:?}");
    }
}

/// Campaigns with a friction of their own: a case file for each of them, and errors by experiment.
#[test]
fn each_campaign_has_its_file() {
    let folder = with_a_log();
    let at = folder.path();
    let mut text = std::fs::read_to_string(at.join("mine.toml")).unwrap();
    text = text.replace("name = \"log\"", "name = \"log\"\ncampaign = \"february\"");
    let again = "\n[[experiment]]\nname = \"again\"\ncampaign = \"april\"\nlog = { file = \"made/5-v-pulse.measured.csv\", time = \"time_s\", input = \"voltage_V\", drive_angle = \"drive_angle_rad\" }\n";
    text = text.replace("\n[fit]\n", &format!("{again}\n[fit]\nseparate = [\"cart.friction.coulomb\"]\n"));
    std::fs::write(at.join("two.toml"), &text).unwrap();
    taut_in(at).args(["fit", "two.toml", "--out", "found", "--anyway", "--no-report", "--quiet"]).output().unwrap();
    let value = json(at, "found/fit.json");
    let names: Vec<&str> =
        value["parameters"].as_array().unwrap().iter().map(|row| row["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["cart.friction.viscous", "cart.friction.coulomb [february]", "cart.friction.coulomb [april]"]);
    for file in ["found/fitted.toml", "found/fitted-april.toml"] {
        taut_in(at).args(["simulate", file, "--experiment", "5 V pulse", "--quiet"]).assert().success();
    }
    let (status, text) = told(at, &["fit", "two.toml", "--posterior"]);
    assert_eq!(status, Some(2), "{text}");
    assert!(text.contains("draws are of one machine, and `separate` makes one for each campaign"), "{text}");
    // Of no campaign.
    let lost =
        std::fs::read_to_string(at.join("two.toml")).unwrap().replace("campaign = \"april\"\n", "campaign = \"may\"\n");
    let lost = lost.replace("[[experiment]]\nname = \"again\"\ncampaign = \"may\"\n", "[[experiment]]\nname = \"third\"\ncampaign = \"may\"\nlog = { file = \"made/5-v-pulse.measured.csv\", time = \"time_s\", input = \"voltage_V\", drive_angle = \"drive_angle_rad\" }\n\n[[experiment]]\nname = \"again\"\n");
    std::fs::write(at.join("lost.toml"), lost).unwrap();
    let (status, text) = told(at, &["fit", "lost.toml"]);
    assert_eq!(status, Some(2), "{text}");
    assert!(text.contains("\"again\" is of no campaign, so these parameters have no value for it"), "{text}");
}

#[test]
fn nothing_to_search_for_gives_errors_alone() {
    let folder = with_a_log();
    let output = taut_in(folder.path()).args(["fit", "mine.toml", "--set", "fit.free=[]"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("no search: errors of the case as it is"), "{text}");
    assert!(text.contains("log  drive_angle: RMSE") && !text.contains("Parameters"), "{text}");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

/// A case whose cart is more than twice as heavy as that of the log: what explains it stands first, and the mass is
/// found.
#[test]
fn a_drift_is_a_table_that_begins_with_what_explains_most() {
    let folder = with_a_log();
    let output = taut_in(folder.path())
        .args(["fit", "mine.toml", "--drift", "--set", "cart.mass=0.8", "--out", "drift", "--json"])
        .output()
        .unwrap();
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(value, json(folder.path(), "drift/drift.json"));
    let changes = value["changes"].as_array().unwrap();
    let left: Vec<f64> = changes.iter().map(|change| change["left"].as_f64().unwrap_or(f64::INFINITY)).collect();
    assert!(left.windows(2).all(|pair| pair[0] <= pair[1]) && left[0] < 0.05, "{left:?}");
    let mass = changes.iter().find(|change| change["name"] == "cart.mass").unwrap();
    assert!((mass["to"].as_f64().unwrap() - 0.362).abs() < 0.02, "{mass}");
    let page = std::fs::read_to_string(folder.path().join("drift/report.html")).unwrap();
    assert!(page.contains("Single changes") && page.contains("cart.mass"));
}
