//! Features of all commands: errors as data, a case from standard input, completions, manual pages.

use crate::common::{stage_text, taut_in};
use serde_json::Value;
use std::fs;
use tempfile::TempDir;

const TABLE4: &str = "sollmann-jouaneh/table4.toml";

#[test]
fn an_error_under_json_is_data_too() {
    let folder = TempDir::new().unwrap();
    let text = stage_text(TABLE4).replacen("0.362 kg", "0.362 m", 1);
    fs::write(folder.path().join("wrong.toml"), &text).unwrap();
    let line = text.lines().position(|line| line.contains("0.362 m")).unwrap() + 1;
    for command in ["show", "simulate", "modes", "sweep", "move", "tune", "check", "fit"] {
        let output = taut_in(folder.path()).args([command, "wrong.toml", "--json"]).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{command}");
        let told: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{command}: {e}"));
        assert_eq!((told["schema"].as_str(), told["status"].as_u64()), (Some("taut/error/1"), Some(2)), "{command}");
        let error = &told["error"];
        assert_eq!((error["file"].as_str(), error["line"].as_u64()), (Some("wrong.toml"), Some(line as u64)));
        assert!(error["what"].as_str().unwrap().contains("0.362 m"), "{command}: {error}");
        // A person who looks at the terminal reads it there.
        let shown = String::from_utf8(output.stderr).unwrap();
        assert!(shown.starts_with("error: wrong.toml:"), "{command}: {shown}");
    }
    let output = taut_in(folder.path()).args(["simulate", "none.toml", "--json"]).output().unwrap();
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(told["error"]["line"].is_null() && told["error"]["next"].as_str().unwrap().contains("taut init"));
}

#[test]
fn a_case_comes_from_standard_input() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("table4.toml"), stage_text(TABLE4)).unwrap();
    for command in ["show", "simulate", "modes"] {
        let of = |args: &[&str], input: &str| {
            let output = taut_in(folder.path()).arg(command).args(args).write_stdin(input).output().unwrap();
            assert_eq!(output.status.code(), Some(0), "{command} {args:?}: {output:?}");
            output.stdout
        };
        let piped = of(&["-", "--json", "--set", "cart.mass=0.5"], &stage_text(TABLE4));
        assert_eq!(piped, of(&["table4.toml", "--json", "--set", "cart.mass=0.5"], ""), "{command}");
    }
    let wrong = taut_in(folder.path()).args(["simulate", "-"]).write_stdin("cart = 1").output().unwrap();
    assert_eq!(wrong.status.code(), Some(2));
    assert!(String::from_utf8(wrong.stderr).unwrap().starts_with("error: -: [motor] is missing"));
    let binary = taut_in(folder.path()).args(["simulate", "-"]).write_stdin(&b"\xff\xfe"[..]).output().unwrap();
    assert_eq!(String::from_utf8(binary.stderr).unwrap(), "error: -: standard input is not UTF-8 text\n");
    let pid = stage_text("sollmann-jouaneh/controllers/pid.toml");
    let output = taut_in(folder.path()).args(["tune", "-", "--in-place"]).write_stdin(pid).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8(output.stderr).unwrap().contains("standard input cannot be written to"));
}

#[test]
fn shells_and_readers_get_what_the_command_line_is() {
    let folder = TempDir::new().unwrap();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = taut_in(folder.path()).args(["completions", shell]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success() && text.contains("simulate") && text.contains("as-measured"), "{shell}");
    }
    taut_in(folder.path()).args(["completions", "tcl"]).assert().code(2);
    let page = taut_in(folder.path()).arg("man").output().unwrap();
    assert!(String::from_utf8(page.stdout).unwrap().contains(".TH taut 1"));
    taut_in(folder.path()).args(["man", "--out", "man"]).assert().success();
    let page = fs::read_to_string(folder.path().join("man/taut-simulate.1")).unwrap();
    assert!(page.contains(".TH taut-simulate 1") && page.contains("\\-\\-as\\-measured"), "{page}");
    let pages = fs::read_dir(folder.path().join("man")).unwrap().count();
    let help = String::from_utf8(taut_in(folder.path()).arg("--help").output().unwrap().stdout).unwrap();
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    // `help` has no page; the program itself has one.
    assert_eq!(pages, commands.filter(|line| line.starts_with("  ") && !line.starts_with("   ")).count());
    fs::write(folder.path().join("file"), "").unwrap();
    taut_in(folder.path()).args(["man", "--out", "file"]).assert().code(2);
}

#[test]
fn the_version_says_what_it_was_built_from() {
    let folder = TempDir::new().unwrap();
    let output = taut_in(folder.path()).arg("--version").output().unwrap();
    let told = String::from_utf8(output.stdout).unwrap();
    let from = told.strip_prefix(concat!("taut ", env!("CARGO_PKG_VERSION"), " (")).unwrap();
    assert!(from.ends_with(")\n") && (from.contains("debug") || from.contains("release")), "{told}");
}

/// Tables were 170 columns wide wherever they were read.
#[test]
fn no_line_is_wider_than_the_environment_says() {
    let folder = TempDir::new().unwrap();
    for (name, text) in
        [("pid.toml", stage_text("sollmann-jouaneh/controllers/pid.toml")), ("table4.toml", stage_text(TABLE4))]
    {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let commands: [&[&str]; 4] = [
        &["simulate", "table4.toml"],
        &["modes", "table4.toml"],
        &["sweep", "table4.toml", "--runs", "20", "--vary", "all=10%"],
        &["move", "pid.toml"],
    ];
    for (columns, most) in [("60", 60), ("120", 120), ("nonsense", 100)] {
        for args in commands {
            let output = taut_in(folder.path()).args(args).env("COLUMNS", columns).output().unwrap();
            let text = String::from_utf8(output.stdout).unwrap();
            let widest = text.lines().max_by_key(|line| line.chars().count()).unwrap();
            assert!(widest.chars().count() <= most, "{args:?} {columns}: {widest}");
        }
    }
}
