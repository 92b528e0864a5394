//! Runs that somebody ends: Ctrl-C, and a reader who has seen enough; and results that are not to be relied on.
#![cfg(unix)]

use crate::common::{names, stage};
use crate::faults::by_default;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A case whose run takes a minute and more.
fn long(folder: &Path) -> PathBuf {
    let case = stage("sollmann-jouaneh/table4.toml");
    let text = fs::read_to_string(case).unwrap();
    let path = folder.join("long.toml");
    fs::write(&path, text.replacen("until = \"1 s\"\nevery = \"1 ms\"", "until = \"900 s\"\nevery = \"1 us\"", 1))
        .unwrap();
    path
}

fn taut(folder: &Path) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("taut"));
    command.current_dir(folder).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    by_default(&mut command);
    command
}

#[test]
fn ctrl_c_keeps_what_there_is_and_leaves_nothing_half_written() {
    let folder = TempDir::new().unwrap();
    let case = long(folder.path());
    let out = folder.path().join("out");
    let mut child =
        taut(folder.path()).arg("simulate").arg(case).args(["--out", "out", "--no-report"]).spawn().unwrap();
    // It is under way when its table has begun, under a temporary name.
    let begin = Instant::now();
    let temporary = out.join(".0.taut.tmp/.5-v-pulse.csv.0.taut.tmp");
    while fs::metadata(&temporary).map_or(0, |file| file.len()) == 0 {
        assert!(begin.elapsed() < Duration::from_secs(60), "it never began");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(!out.join("5-v-pulse.csv").exists());
    assert!(Command::new("kill").arg("-INT").arg(child.id().to_string()).status().unwrap().success());
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(130));
    assert_eq!(names(&out), ["5-v-pulse.csv", "5-v-pulse.events.csv", "case.toml", "files.json", "summary.json"]);
    let csv = fs::read_to_string(out.join("5-v-pulse.csv")).unwrap();
    assert!(csv.ends_with('\n') && csv.lines().all(|line| line.split(',').count() == 18));
    let summary: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["experiments"][0]["ending"]["word"], "interrupted");
    let mut told = String::new();
    child.stderr.take().unwrap().read_to_string(&mut told).unwrap();
    assert!(told.starts_with("error: the run \"5 V pulse\" was interrupted at "), "{told}");
}

#[test]
fn a_closed_pipe_is_no_error() {
    let folder = TempDir::new().unwrap();
    let case = stage("sollmann-jouaneh/table4.toml");
    for args in [vec!["--json"], vec![], vec!["--help"]] {
        let mut child = taut(folder.path()).arg("simulate").arg(&case).args(&args).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{args:?}: {output:?}");
        assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

fn bundled(folder: &Path, name: &str) -> PathBuf {
    let case = stage("sollmann-jouaneh/controllers").join(name);
    fs::copy(case, folder.join(name)).unwrap();
    folder.join(name)
}

/// A loop that stood at its limit in 3014 of 3201 samples was reported like any other, with exit status 0.
#[test]
fn an_unstable_move_is_called_unstable() {
    let folder = TempDir::new().unwrap();
    bundled(folder.path(), "pid.toml");
    let mut command = taut(folder.path());
    command.args(["move", "pid.toml", "--json", "--set", "controller.pid.proportional=30 V/mm"]);
    let output = command.output().unwrap();
    let (data, told) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("warning: the move \"short fast\" is not to be relied on: the loop is unstable"), "{told}");
    assert!(told.contains(" Hz") && data.contains("\"kind\": \"unstable\"") && data.contains("frequency_Hz"), "{told}");
    let output = taut(folder.path()).args(["move", "pid.toml", "--quiet"]).output().unwrap();
    assert_eq!((output.status.code(), output.stderr.len()), (Some(0), 0));
}

/// `taut tune` wrote gains that made every move worse, and said in green that the limits hold.
#[test]
fn worse_gains_are_called_worse_and_written_in_place_only_if_told() {
    let folder = TempDir::new().unwrap();
    let path = bundled(folder.path(), "pid.toml");
    let before = fs::read_to_string(&path).unwrap();
    let soft = ["tune", "pid.toml", "--set", "tune.cost=none", "--set", "tune.bandwidth=1Hz", "--in-place"];
    let output = taut(folder.path()).args(soft).output().unwrap();
    let (shown, told) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(shown.starts_with("WORSE than the gains of the file: short fast: worst-case error "), "{shown}");
    assert!(told.contains("error: the case file was not changed"), "{told}");
    assert_eq!(fs::read_to_string(&path).unwrap(), before);
    assert_eq!(taut(folder.path()).args(soft).arg("--anyway").output().unwrap().status.code(), Some(1));
    assert_ne!(fs::read_to_string(&path).unwrap(), before);
    let output = taut(folder.path()).args(["tune", "pid.toml", "--evaluate", "--json"]).output().unwrap();
    let data = String::from_utf8(output.stdout).unwrap();
    for key in ["\"schema\": \"taut/tune/1\"", "\"verdict\": \"unchanged\"", "\"forced_by\": null", "\"objective\""] {
        assert!(data.contains(key), "{key}: {data}");
    }
}
