//! Runs that somebody ends: Ctrl-C, and a reader who has seen enough.
#![cfg(unix)]

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A case whose run takes a minute and more.
fn long(folder: &Path) -> PathBuf {
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("../stages/sollmann-jouaneh/table4.toml");
    let text = fs::read_to_string(case).unwrap();
    let path = folder.join("long.toml");
    fs::write(&path, text.replacen("until = \"1 s\"\nevery = \"1 ms\"", "until = \"900 s\"\nevery = \"1 us\"", 1))
        .unwrap();
    path
}

fn taut(folder: &Path) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("taut"));
    command.current_dir(folder).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).map(|entries| entries.flatten().collect()).unwrap_or_else(|_| Vec::new());
    let mut names: Vec<String> = entries.into_iter().map(|entry| entry.file_name().into_string().unwrap()).collect();
    names.sort();
    names
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
    assert_eq!(names(&out), ["5-v-pulse.csv", "5-v-pulse.events.csv", "case.toml", "summary.json"]);
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
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("../stages/sollmann-jouaneh/table4.toml");
    for args in [vec!["--json"], vec![], vec!["--help"]] {
        let mut child = taut(folder.path()).arg("simulate").arg(&case).args(&args).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{args:?}: {output:?}");
        assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}
