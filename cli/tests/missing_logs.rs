//! A case of which a log is missing: who needs the log is told its line, and everybody else works.

use crate::common::taut_in;
use std::path::Path;
use tempfile::TempDir;

/// `taut` in a folder: exit status, standard output, standard error.
pub fn run(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = taut_in(folder).args(arguments).timeout(std::time::Duration::from_secs(120)).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// The template with a controller, a move, and two experiments with logs, of which the second is `gone.csv`.
fn with_logs() -> TempDir {
    let folder = TempDir::new().unwrap();
    let at = folder.path();
    assert_eq!(run(at, &["init", "axis.toml"]).0, Some(0));
    let arguments = ["simulate", "axis.toml", "--experiment", "5 V pulse", "--as-measured", "--out", "made", "--quiet"];
    assert_eq!(run(at, &arguments).0, Some(0));
    let mut text = std::fs::read_to_string(at.join("axis.toml")).unwrap();
    for (name, file) in [("good", "made/5-v-pulse.measured.csv"), ("gone", "gone.csv")] {
        text += &format!(
            "\n[[experiment]]\nname = \"{name}\"\nlog = {{ file = \"{file}\", time = \"time_s\", input = \"voltage_V\", drive_angle = \"drive_angle_rad\" }}\n"
        );
    }
    text += "\n[fit]\nfree = [\"cart.friction.viscous\"]\nheld_out = [\"gone\"]\n";
    std::fs::write(at.join("mine.toml"), text).unwrap();
    folder
}

/// One log that was not there blocked `show`, `modes`, `tune`, `export` and the simulation of other experiments.
#[test]
fn a_missing_log_is_told_to_those_who_need_it() {
    let folder = with_logs();
    let at = folder.path();
    let text = std::fs::read_to_string(at.join("mine.toml")).unwrap();
    let line = 1 + text.lines().position(|line| line.contains("gone.csv")).unwrap();
    type Make = fn(&Path);
    let kinds: [(&str, Make); 4] = [
        ("there is no such file", |_| {}),
        ("it is a folder", |path| std::fs::create_dir(path).unwrap()),
        ("this is a pipe or a device, not a file", |path| {
            assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success());
        }),
        ("column", |path| std::fs::write(path, "nothing\n1\n2\n").unwrap()),
    ];
    for (why, make) in kinds {
        let gone = at.join("gone.csv");
        make(&gone);
        let good: [&[&str]; 7] = [
            &["show", "mine.toml"],
            &["modes", "mine.toml"],
            &["modes", "mine.toml", "--out", "modes"],
            &["simulate", "mine.toml", "--experiment", "5 V pulse"],
            &["simulate", "mine.toml", "--experiment", "good", "--out", "run"],
            &["export", "json", "mine.toml", "--out", "machine.json"],
            &["export", "c", "mine.toml", "--out", "machine"],
        ];
        for arguments in good {
            let (status, _, told) = run(at, arguments);
            assert_eq!(status, Some(0), "{why}: {arguments:?}: {told}");
        }
        let (_, _, told) = run(at, &["show", "mine.toml"]);
        assert!(told.contains("note: \"gone\" is left out"), "{told}");
        let bad: [&[&str]; 5] = [
            &["check", "mine.toml"],
            &["fit", "mine.toml", "--out", "fitted"],
            &["frf", "mine.toml"],
            &["simulate", "mine.toml"],
            &["simulate", "mine.toml", "--experiment", "gone"],
        ];
        for arguments in bad {
            let (status, _, told) = run(at, arguments);
            assert_eq!(status, Some(2), "{why}: {arguments:?}: {told}");
            assert!(told.contains(&format!("mine.toml:{line}")), "{why}: {arguments:?}: {told}");
            assert!(told.contains("experiment \"gone\"") && told.contains(why), "{why}: {arguments:?}: {told}");
        }
        assert!(!at.join("fitted").exists());
        // The case that a run leaves behind leads to the file that is missing.
        if gone.is_dir() {
            std::fs::remove_dir(&gone).unwrap();
        } else if gone.exists() {
            std::fs::remove_file(&gone).unwrap();
        }
    }
    let brought = std::fs::read_to_string(at.join("run/case.toml")).unwrap();
    assert!(brought.contains("inputs/5-v-pulse.measured.csv"), "{brought}");
}

/// Columns of files that are inputs are read as logs are, of gantries, too.
#[test]
fn a_missing_input_of_a_gantry_is_told_to_those_who_need_it() {
    let folder = TempDir::new().unwrap();
    let at = folder.path();
    assert_eq!(run(at, &["init", "frame.toml", "--kind", "h-frame"]).0, Some(0));
    let mut text = std::fs::read_to_string(at.join("frame.toml")).unwrap();
    let first = text.lines().find_map(|line| line.trim().strip_prefix("name")).unwrap();
    let first = first.split('"').nth(1).unwrap().to_string();
    text += "\n[[experiment]]\nname = \"gone\"\ninput = { left = { file = \"gone.csv\", time = \"t\", column = \"u\" } }\nuntil = 1\nevery = 1e-3\n";
    std::fs::write(at.join("mine.toml"), &text).unwrap();
    let line = 1 + text.lines().position(|line| line.contains("gone.csv")).unwrap();
    for arguments in
        [&["show", "mine.toml"][..], &["modes", "mine.toml"], &["simulate", "mine.toml", "--experiment", &first]]
    {
        let (status, _, told) = run(at, arguments);
        assert_eq!(status, Some(0), "{arguments:?}: {told}");
    }
    for arguments in [&["simulate", "mine.toml"][..], &["simulate", "mine.toml", "--experiment", "gone"]] {
        let (status, _, told) = run(at, arguments);
        assert_eq!(status, Some(2), "{arguments:?}: {told}");
        assert!(told.contains(&format!("mine.toml:{line}")) && told.contains("experiment \"gone\""), "{told}");
    }
}
