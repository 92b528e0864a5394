//! Requests that are met, and those that are refused with what can be done instead.

use super::tools::{file, taut};
use std::path::Path;

fn told(words: &[&str]) -> (Option<i32>, String, String) {
    let folder = tempfile::tempdir().unwrap();
    let output = taut(folder.path(), words);
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn without_a_name_it_lists_what_there_is() {
    let (code, shown, _) = told(&["export"]);
    assert_eq!(code, Some(0));
    let names: Vec<&str> = shown.lines().skip(1).map(|line| line.split_whitespace().next().unwrap()).collect();
    assert_eq!(names, ["fmu", "c", "st", "matlab", "python", "json"]);
    assert!(shown.lines().all(|line| line.split_whitespace().count() > 4), "{shown}");
}

#[test]
fn wrong_requests_are_refused_with_what_can_be_done_instead() {
    let (table4, pid) =
        (file("stages/sollmann-jouaneh/table4.toml"), file("stages/sollmann-jouaneh/controllers/pid.toml"));
    let core = file("stages/core-xy/core-xy.toml");
    let curved =
        ["--set", "cart.friction={ coulomb = \"0.2 N\", stribeck = { force = \"0.1 N\", velocity = \"0.02 m/s\" } }"];
    let mut words = vec!["export", "c", &table4];
    words.extend(curved);
    let (code, _, error) = told(&words);
    assert_eq!(code, Some(2), "{error}");
    assert!(error.contains("the friction of the cart is a curve") && error.contains("taut export fmu"), "{error}");
    assert!(!error.contains("--part controller"), "there is none: {error}");
    words[2] = &pid;
    let (_, _, error) = told(&words);
    assert!(error.contains("taut export fmu") && error.contains("--part controller"), "{error}");
    let cases: [(&[&str], &[&str]); 11] = [
        (&["export", "c", &table4, "--at", "1 mm"], &["--at: spans of this belt do not follow", "leave it out"]),
        (&["export", "c", &table4, "--bridge", "1 mm"], &["--bridge: this machine has no bridge"]),
        (&["export", "st", &pid, "--at", "1 mm"], &["--at means nothing to st", "c, matlab and python"]),
        (&["export", "c", &table4, "--part", "controller"], &["no controller", "[controller]", "leave --part out"]),
        (&["export", "st", &table4], &["no controller", "[controller]", "export fmu"]),
        (&["export", "c", &core, "--part", "both"], &["this case has no controller", "leave --part out"]),
        (&["export", "st", &pid, "--part", "plant"], &["only a controller", "export fmu"]),
        (&["export", "st", &pid, "--real", "float"], &["--real means nothing to st", "with c"]),
        (&["export", "c", &table4, "--fmi", "2"], &["--fmi means nothing to c", "with fmu"]),
        (&["export", "json", &table4, "--step", "1 ms"], &["--step means nothing to json", "c, matlab and python"]),
        (&["export", "c", &table4, "--step", "100 s"], &["series", "steps of up to", "shorter --step"]),
    ];
    for (words, parts) in cases {
        let (code, _, error) = told(words);
        assert_eq!(code, Some(2), "{words:?}: {error}");
        for part in parts {
            assert!(error.contains(part), "{words:?}: {error} lacks {part}");
        }
    }
    let (code, _, error) = told(&["export", "c"]);
    assert_eq!(code, Some(2));
    assert!(error.contains("CASE"), "{error}");
}

/// Advice was given that the next call refused: `--part plant` for Structured Text, a controller for MATLAB, which
/// takes none. Every request that is refused for its part is followed by one with --part as the message has it, or
/// without.
#[test]
fn advice_about_parts_is_taken_by_the_next_call() {
    let pid = file("stages/sollmann-jouaneh/controllers/pid.toml");
    let machines = ["sollmann-jouaneh/table4", "core-xy/core-xy", "core-xy/follows"]
        .map(|name| file(&format!("stages/{name}.toml")));
    let cases = machines.into_iter().chain([pid]).collect::<Vec<_>>();
    let mut refused = 0;
    for case in &cases {
        for target in ["c", "st", "matlab", "python", "fmu"] {
            for part in ["plant", "controller", "both"] {
                let (code, _, error) = told(&["export", target, case, "--part", part]);
                if code == Some(0) {
                    continue;
                }
                refused += 1;
                let next = error.split_once("next: ").unwrap_or_else(|| panic!("no advice: {error}")).1;
                assert!(!next.contains(&format!("--part {part}")), "{error}");
                if next.contains("leave --part out") {
                    assert_eq!(told(&["export", target, case]).0, Some(0), "{target} {case} {part}: {error}");
                }
                for other in ["plant", "controller", "both"] {
                    if next.contains(&format!("--part {other}")) {
                        let words = ["export", target, case, "--part", other];
                        assert_eq!(told(&words).0, Some(0), "{target} {case} {part}: {error}");
                    }
                }
                for other in ["c", "fmu", "st"] {
                    if next.contains(&format!("`taut export {other}`")) {
                        assert_eq!(told(&["export", other, case]).0, Some(0), "{target} {case} {part}: {error}");
                    }
                }
                // A controller is only asked for where it would be taken.
                assert!(!(next.contains("[controller]") && ["matlab", "python"].contains(&target)), "{error}");
            }
        }
    }
    assert!(refused > 15, "{refused}");
}

#[test]
fn options_of_another_target_are_named_once() {
    let (_, _, error) =
        told(&["export", "st", &file("stages/sollmann-jouaneh/controllers/pid.toml"), "--real", "float"]);
    assert_eq!(error.matches("--real").count(), 1, "{error}");
}

/// The commands of a case with an input shaper are those of the controller behind it, and nothing said so.
#[test]
fn a_shaper_that_is_left_out_is_told() {
    let shaped = file("stages/sollmann-jouaneh/controllers/pid-shaped.toml");
    for (target, path) in [("c", "x.h"), ("st", "x.st")] {
        let folder = tempfile::tempdir().unwrap();
        let out = format!("x.{target}");
        let output = taut(folder.path(), &["export", target, &shaped, "--out", &out]);
        let shown = String::from_utf8(output.stdout).unwrap();
        assert!(shown.contains("the input shaper of 2 impulses is not included"), "{shown}");
        let text = std::fs::read_to_string(folder.path().join(path)).unwrap();
        assert!(
            text.contains("the input shaper of 2 impulses") && text.contains("of the reference 0.0 s ago"),
            "{text}"
        );
        let pid = file("stages/sollmann-jouaneh/controllers/pid.toml");
        let output = taut(folder.path(), &["export", target, &pid, "--out", &out]);
        assert!(!String::from_utf8(output.stdout).unwrap().contains("shaper"));
    }
}

#[test]
fn a_path_that_ends_so_names_the_file_and_any_other_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let names = |path: &Path| {
        let mut names: Vec<String> =
            std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    };
    let case = file("stages/sollmann-jouaneh/table4.toml");
    let output = taut(folder.path(), &["export", "c", &case, "--out", "axis.c"]);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(names(folder.path()), ["axis.c", "axis.h"]);
    let output = taut(folder.path(), &["export", "c", &case, "--out", "folder", "--json"]);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(names(&folder.path().join("folder")), ["export.json", "files.json", "table4.c", "table4.h"]);
    let data: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&data["schema"], &data["target"]), (&"taut/exported/1".into(), &"c".into()));
    // Nothing is written where no place is named, and a case is never written over.
    std::fs::copy(&case, folder.path().join("here.json")).unwrap();
    let output = taut(folder.path(), &["export", "json", "here.json", "--out", "here.json"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    let quiet = taut(folder.path(), &["export", "c", &case, "--quiet"]);
    assert!(quiet.stdout.is_empty() && quiet.status.success());
}

#[test]
fn spans_that_follow_the_cart_are_held_where_it_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str| {
        let done = taut(folder.path(), &["init", "--template", name, &format!("{name}.toml")]);
        assert!(done.status.success());
    };
    ["stage", "printer-servo", "gantry"].into_iter().for_each(write);
    let exported = |words: &[&str]| {
        let done = taut(folder.path(), &[&["export"], words].concat());
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (done.status.code(), text(done.stdout), text(done.stderr))
    };
    for name in ["stage", "printer-servo", "gantry"] {
        let case = format!("{name}.toml");
        for target in ["c", "matlab", "python"] {
            let out = format!("{name}-{target}");
            let (code, shown, error) = exported(&[target, &case, "--out", &out, "--at", "50 mm"]);
            assert_eq!(code, Some(0), "{name}, {target}: {error}");
            let words = shown.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(words.contains("the cart at 50 mm: --at names another place"), "{name}, {target}: {shown}");
            let files = std::fs::read_dir(folder.path().join(&out)).unwrap().flatten();
            let says = |path: std::path::PathBuf| std::fs::read(path).unwrap();
            let mut texts = files.map(|file| String::from_utf8_lossy(&says(file.path())).into_owned());
            assert!(texts.any(|text| text.contains("spans held as with")), "{name}, {target}");
        }
        let (code, _, error) = exported(&["c", &case, "--at", "3 m"]);
        assert_eq!(code, Some(2), "{name}");
        assert!(error.contains("3 m is outside the travel"), "{error}");
    }
}
