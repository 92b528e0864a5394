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
    assert!(
        error.contains("the friction of the cart is a curve")
            && error.contains("taut export fmu")
            && error.contains("--part controller"),
        "{error}"
    );
    let cases: [(&[&str], &[&str]); 8] = [
        (&["export", "c", &table4, "--part", "controller"], &["no controller", "[controller]", "--part plant"]),
        (&["export", "st", &table4], &["no controller", "[controller]"]),
        (&["export", "c", &core, "--part", "both"], &["a gantry has no controller", "--part plant"]),
        (&["export", "st", &pid, "--part", "plant"], &["only a controller", "export c"]),
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
