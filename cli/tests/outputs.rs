//! Output of the commands: never over a file that they read, whole folders or none, and under every name that a user
//! may choose.

use crate::common::{stage_text, taut_in};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Everything in a folder: paths and contents.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => folders.push(path),
                false => {
                    all.insert(path.clone(), fs::read(&path).unwrap());
                }
            }
        }
    }
    all
}

/// Runs a command that must be refused, name the file that is read, and leave everything as it was.
fn refused(folder: &Path, args: &[&str], read: &str) {
    let before = contents(folder);
    let output = taut_in(folder).args(args).output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {told}");
    assert!(told.contains("made from, and nothing was written"), "{args:?}: {told}");
    assert!(told.contains(read) && told.contains("\n  next: "), "{args:?}: {told}");
    assert_eq!(contents(folder), before, "{args:?}");
}

/// A case that reads a log, has a move, and something to fit; its folder.
fn with_a_log(log: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    let rows: String = (0..200).map(|k| format!("{},{},{}\n", 0.001 * f64::from(k), 5, 1e-4 * f64::from(k))).collect();
    fs::write(folder.path().join(log), format!("time_s,voltage_V,angle_rad\n{rows}")).unwrap();
    let mut text = stage_text("sollmann-jouaneh/table4.toml");
    text = text[..text.find("[[experiment]]").unwrap()].to_string();
    text += &format!(
        r#"
[[experiment]]
name = "5 V pulse"
log = {{ file = "{log}", time = "time_s", input = "voltage_V", drive_angle = "angle_rad" }}

[controller]
every = "1 ms"
pid = {{ proportional = "1 V/mm", derivative = "10 V s/m" }}

[[move]]
name = "short"
to = "10 mm"
speed = "100 mm/s"
acceleration = "1 m/s^2"
until = "0.5 s"

[fit]
free = ["cart.friction.viscous"]

[sweep]
runs = 4
[sweep.vary]
"cart.mass" = "10 %"
"#
    );
    fs::write(folder.path().join("rig.toml"), text).unwrap();
    folder
}

/// `taut simulate rig.toml --out .` replaced the measured log `5-v-pulse.csv` by the simulation of it, with exit status
/// 0.
#[test]
fn a_simulation_does_not_replace_its_log() {
    let folder = with_a_log("5-v-pulse.csv");
    let at = folder.path();
    refused(at, &["simulate", "rig.toml", "--out", "."], "5-v-pulse.csv");
    refused(at, &["simulate", "././rig.toml", "--out", "."], "5-v-pulse.csv");
    // The log of another format is no output of this run.
    fs::rename(at.join("5-v-pulse.csv"), at.join("5-v-pulse.events.csv")).unwrap();
    let text = fs::read_to_string(at.join("rig.toml")).unwrap().replace("5-v-pulse.csv", "5-v-pulse.events.csv");
    fs::write(at.join("rig.toml"), text).unwrap();
    refused(at, &["simulate", "rig.toml", "--out", "."], "5-v-pulse.events.csv");
    // Elsewhere it may.
    taut_in(at).args(["simulate", "rig.toml", "--out", "out", "--no-report"]).assert().success();
    // A result folder simulated into itself would replace its case and its inputs.
    refused(at, &["simulate", "out/case.toml", "--out", "out"], "case.toml");
}

/// The name of an output says little: links lead to the same file.
#[cfg(unix)]
#[test]
fn links_do_not_hide_what_is_read() {
    use std::os::unix::fs::symlink;
    let folder = with_a_log("measured.csv");
    let at = folder.path();
    fs::create_dir_all(at.join("out")).unwrap();
    symlink("../measured.csv", at.join("out/5-v-pulse.csv")).unwrap();
    refused(at, &["simulate", "rig.toml", "--out", "out"], "measured.csv");
    fs::remove_file(at.join("out/5-v-pulse.csv")).unwrap();
    fs::hard_link(at.join("measured.csv"), at.join("out/summary.json")).unwrap();
    refused(at, &["simulate", "rig.toml", "--out", "out"], "measured.csv");
    fs::remove_file(at.join("out/summary.json")).unwrap();
    // The case through a link, the folder through another.
    fs::create_dir_all(at.join("far")).unwrap();
    symlink("far", at.join("near")).unwrap();
    fs::rename(at.join("rig.toml"), at.join("far/case.toml")).unwrap();
    fs::copy(at.join("measured.csv"), at.join("far/measured.csv")).unwrap();
    symlink("far/case.toml", at.join("link.toml")).unwrap();
    refused(at, &["simulate", "far/case.toml", "--out", "near"], "far/case.toml");
    refused(at, &["simulate", "link.toml", "--out", "near"], "link.toml");
    // A plot, which is known only when it is drawn.
    fs::create_dir_all(at.join("out/plots")).unwrap();
    fs::hard_link(at.join("measured.csv"), at.join("out/plots/5-v-pulse-input.svg")).unwrap();
    refused(at, &["simulate", "link.toml", "--out", "out"], "measured.csv");
}

#[test]
fn no_other_command_replaces_what_it_reads() {
    let folder = with_a_log("log.csv");
    let at = folder.path();
    let put = |name: &str| fs::copy(at.join("rig.toml"), at.join(name)).map(|_| ()).unwrap();
    let text = fs::read_to_string(at.join("rig.toml")).unwrap();
    let with_log = |name: &str| {
        fs::copy(at.join("log.csv"), at.join(name)).unwrap();
        fs::write(at.join("rig.toml"), text.replace("log.csv", name)).unwrap();
    };
    put("case.toml");
    refused(at, &["simulate", "case.toml", "--out", "."], "case.toml");
    refused(at, &["move", "case.toml", "--out", "."], "case.toml");
    refused(at, &["sweep", "case.toml", "--out", "."], "case.toml");
    put("fitted.toml");
    refused(at, &["fit", "fitted.toml", "--out", "."], "fitted.toml");
    put("tuned.toml");
    refused(at, &["tune", "tuned.toml", "--out", "."], "tuned.toml");
    refused(at, &["tune", "rig.toml", "--out", "rig.toml"], "rig.toml");
    with_log("short.samples.csv");
    refused(at, &["move", "rig.toml", "--out", "."], "short.samples.csv");
    with_log("fit.json");
    refused(at, &["fit", "rig.toml", "--out", "."], "fit.json");
    with_log("tune.json");
    refused(at, &["tune", "rig.toml", "--out", "."], "tune.json");
    with_log("runs.parquet");
    refused(at, &["sweep", "rig.toml", "--out", "."], "runs.parquet");
    refused(at, &["sweep", "rig.toml", "--out", "runs.parquet"], "runs.parquet");
    with_log("runs-trajectories.csv");
    refused(at, &["sweep", "rig.toml", "--out", "runs.csv", "--trajectories"], "runs-trajectories.csv");
    with_log("modes.json");
    refused(at, &["modes", "rig.toml", "--out", "."], "modes.json");
    with_log("shape.json");
    refused(at, &["shape", "rig.toml", "--out", "."], "shape.json");
    // A file whose name only the figures tell.
    with_log("poles-and-zeros.svg");
    fs::create_dir_all(at.join("plots")).unwrap();
    fs::rename(at.join("poles-and-zeros.svg"), at.join("plots/poles-and-zeros.svg")).unwrap();
    fs::write(at.join("rig.toml"), text.replace("log.csv", "plots/poles-and-zeros.svg")).unwrap();
    refused(at, &["modes", "rig.toml", "--out", "."], "plots/poles-and-zeros.svg");
}

#[test]
fn a_shaper_is_not_written_over_its_spectrum() {
    let folder = TempDir::new().unwrap();
    let rows: String = (1..400)
        .map(|k| {
            let f = 0.5 * f64::from(k);
            let peak = 1e4 / (1.0 + (f - 60.0).powi(2));
            format!("{f},{peak},{peak},{peak},{}\n", 3.0 * peak)
        })
        .collect();
    fs::write(folder.path().join("shape.json"), format!("freq,psd_x,psd_y,psd_z,psd_xyz\n{rows}")).unwrap();
    refused(folder.path(), &["shape", "shape.json", "--out", "."], "shape.json");
}

/// The folder of the parts is removed in the end, and with it would have been the case.
#[test]
fn a_sweep_does_not_remove_its_case_with_its_parts() {
    let folder = with_a_log("log.csv");
    let at = folder.path();
    fs::create_dir(at.join("runs.csv.parts")).unwrap();
    fs::rename(at.join("rig.toml"), at.join("runs.csv.parts/rig.toml")).unwrap();
    fs::rename(at.join("log.csv"), at.join("runs.csv.parts/log.csv")).unwrap();
    let output = taut_in(at).args(["sweep", "runs.csv.parts/rig.toml", "--out", "runs.csv"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(
        String::from_utf8_lossy(&output.stderr),
        "error: runs.csv.parts: runs.csv.parts/rig.toml is read and is in this folder, which would be removed at the \
         end; nothing was written\n  next: move that file, or write to another place\n"
    );
    assert_eq!(contents(at).len(), 2);
}

/// Draws from a posterior are read as well.
#[test]
fn the_draws_are_not_replaced_by_the_band() {
    let folder = with_a_log("log.csv");
    let at = folder.path();
    let header = "cart.friction.viscous_N_s_m";
    fs::write(at.join("5-v-pulse.band.csv"), format!("{header}\n19\n20\n")).unwrap();
    refused(at, &["simulate", "rig.toml", "--draws", "5-v-pulse.band.csv", "--out", "."], "5-v-pulse.band.csv");
}

/// Paths that are not UTF-8 were written by their replacement characters: half a folder, then an error.
#[cfg(target_os = "linux")]
#[test]
fn a_folder_whose_name_is_not_utf_8_is_written_whole() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = with_a_log("log.csv");
    let at = folder.path();
    let odd = |name: &[u8]| OsStr::from_bytes(name).to_os_string();
    for (command, name, last) in [
        ("simulate", &b"s\xff"[..], "plots/5-v-pulse-speeds.svg"),
        ("move", b"m\xff", "plots/short-motion.svg"),
        ("modes", b"l\xff", "report.html"),
        ("shape", b"i\xff", "report.html"),
        ("fit", b"f\xff", "report.html"),
        ("sweep", b"w\xff", "plots"),
        ("tune", b"t\xff", "tuned.toml"),
    ] {
        let out = odd(name);
        let mut run = taut_in(at);
        run.arg(command).arg("rig.toml").arg("--out").arg(&out);
        if command == "fit" {
            run.arg("--anyway");
        }
        if command == "tune" {
            run.args(["--no-report", "--set", "tune.cost=none", "--set", "tune.bandwidth=8Hz"]);
        }
        let output = run.output().unwrap();
        assert!(matches!(output.status.code(), Some(0 | 1)), "{command}: {output:?}");
        assert!(at.join(&out).join(last).exists(), "{command}: {:?}", contents(&at.join(&out)).keys());
        assert!(!contents(at).keys().any(|path| path.to_string_lossy().contains(".taut.tmp")));
    }
    let rows = odd(b"rows\xff.csv");
    taut_in(at).args(["sweep", "rig.toml", "--trajectories", "--quiet", "--out"]).arg(&rows).assert().success();
    assert!(at.join(odd(b"rows\xff-trajectories.csv")).exists());
    // A path in a case file is UTF-8: what cannot be said is refused before it is computed.
    let inner = at.join(odd(b"in\xff"));
    fs::create_dir(&inner).unwrap();
    for file in ["rig.toml", "log.csv"] {
        fs::copy(at.join(file), inner.join(file)).unwrap();
    }
    let output = taut_in(at).arg("fit").arg(inner.join("rig.toml")).args(["--out", "found"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(told.contains("the path of this file is not UTF-8, so a case file cannot name it"), "{told}");
    assert!(!at.join("found").exists());
}

/// A name of 100 letters of three bytes passed the check of the case and failed as a file, after the run.
#[test]
fn long_names_of_many_bytes_have_files() {
    let folder = TempDir::new().unwrap();
    let at = folder.path();
    let long = "轴".repeat(100);
    let text = stage_text("sollmann-jouaneh/table4.toml").replacen("5 V pulse", &long, 1);
    let text = text.replacen("10 V pulse", &format!("{}带", "轴".repeat(99)), 1);
    fs::write(at.join("case.toml"), text).unwrap();
    taut_in(at)
        .args(["simulate", "case.toml", "--out", "out", "--as-measured", "--set", "encoder.at=\"motor\""])
        .args(["--set", "encoder.lines=512"])
        .assert()
        .success();
    let names: Vec<String> =
        fs::read_dir(at.join("out")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    assert!(names.iter().all(|name| name.len() <= 255));
    assert_eq!(names.iter().filter(|name| name.ends_with(".measured.csv") && name.starts_with("轴轴")).count(), 2);
}

/// After a kill in the middle, new files stood beside old ones and nothing said so.
#[test]
fn a_folder_that_was_left_half_replaced_says_so() {
    let folder = with_a_log("log.csv");
    let at = folder.path();
    let run = || taut_in(at).args(["simulate", "rig.toml", "--out", "out", "--no-report"]).output().unwrap();
    assert!(run().stderr.is_empty());
    // What a kill within the replacement leaves; see the test of `taut::files::Batch`.
    fs::write(at.join("out/unfinished.txt"), "").unwrap();
    let second = run();
    assert!(second.status.success());
    let told = String::from_utf8_lossy(&second.stderr).into_owned();
    assert_eq!(
        told.replace('\\', "/"),
        "note: out/unfinished.txt: an earlier run was interrupted while it replaced these results: some may be from \
         the run before it\n"
    );
    assert!(!at.join("out/unfinished.txt").exists() && run().stderr.is_empty());
}

/// An experiment that failed left the files of those before it beside the old ones of those behind it.
#[test]
fn a_run_that_fails_leaves_the_results_as_they_were() {
    let folder = with_a_log("log.csv");
    let at = folder.path();
    taut_in(at).args(["simulate", "rig.toml", "--out", "out"]).assert().success();
    let report = at.join("out/report.html");
    fs::remove_file(&report).unwrap();
    fs::create_dir_all(report.join("taken")).unwrap();
    let before = contents(at);
    let output = taut_in(at).args(["simulate", "rig.toml", "--out", "out", "--set", "cart.mass=1"]).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(told.starts_with("error: out/report.html: "), "{told}");
    assert_eq!(contents(at), before);
}

/// A full disk at standard output went unseen where it met the help.
#[cfg(target_os = "linux")]
#[test]
fn what_cannot_be_printed_is_an_error() {
    let folder = with_a_log("log.csv");
    let commands: [&[&str]; 10] = [
        &["--help"],
        &["--version"],
        &["sweep", "--help"],
        &["help", "fit"],
        &["init", "new.toml"],
        &["simulate", "rig.toml"],
        &["move", "rig.toml", "--json"],
        &["fit", "rig.toml"],
        &["modes", "rig.toml"],
        &["shape", "rig.toml"],
    ];
    for args in commands {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let mut run = std::process::Command::new(assert_cmd::cargo::cargo_bin("taut"));
        let output = run.current_dir(folder.path()).args(args).stdout(full).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{args:?}");
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(told.contains("error: the results cannot be written to standard output: "), "{args:?}: {told}");
    }
}

/// A second run of a command left the files of the first one beside its own: `10-v-pulse.csv` of another case file.
#[test]
fn a_later_run_takes_away_what_it_wrote_before_and_nothing_else() {
    let folder = with_a_log("log.csv");
    let at = folder.path();
    let out = at.join("out");
    let run = |args: &[&str]| {
        let done = taut_in(at).args(args).args(["--out", "out"]).output().unwrap();
        assert!(matches!(done.status.code(), Some(0..=2)), "{done:?}");
        String::from_utf8(done.stderr).unwrap()
    };
    run(&["simulate", "rig.toml", "--png"]);
    run(&["modes", "rig.toml", "--no-report"]);
    fs::write(out.join("mine.txt"), "by hand").unwrap();
    fs::write(out.join("5-v-pulse.events.csv"), "changed by hand").unwrap();
    assert!(out.join("plots/5-v-pulse-speeds.png").exists());
    let told = run(&["simulate", "rig.toml", "--no-report", "--format", "csv", "--experiment", "nothing of the kind"]);
    assert!(
        told.contains("nothing of the kind") && out.join("5-v-pulse.csv").exists(),
        "what failed removes nothing: {told}"
    );
    let told = run(&["simulate", "rig.toml", "--no-report", "--set", "experiment.0.name=another"]);
    assert!(
        told.contains("out: files of an earlier run that were changed since are kept: 5-v-pulse.events.csv"),
        "{told}"
    );
    for gone in ["report.html", "plots", "5-v-pulse.csv"] {
        assert!(!out.join(gone).exists(), "{gone}");
    }
    for there in
        ["mine.txt", "another.csv", "modes.json", "frequency-response.csv", "5-v-pulse.events.csv", "files.json"]
    {
        assert!(out.join(there).exists(), "{there}");
    }
}
