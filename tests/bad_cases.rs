//! Every wrong case file we could think of, with the exact message it must give.
//!
//! `UPDATE_EXPECT=1 cargo test -p taut --features json --test all bad_cases::` writes the messages anew; read each of
//! them aloud before keeping it.

use crate::common::wrong::{self, Wrong};
use std::fs;
use std::path::Path;
use taut::case::Case;

#[test]
fn every_wrong_case_gives_its_message() {
    messages("tests/bad/case", 400, case);
}

/// Logs that cannot be used, and tables that say wrongly what a log holds.
#[test]
#[cfg_attr(not(feature = "json"), ignore = "the messages of Klipper's logs need the feature json")]
fn every_wrong_log_of_a_case_gives_its_message() {
    messages("tests/bad/mapping", 90, case);
}

/// Gantries, as the commands that take both kinds read them.
#[test]
fn every_wrong_gantry_gives_its_message() {
    messages("tests/bad/gantry", 25, opened);
}

/// The text that is changed is right itself: a mistake in it would hide those that are tested.
#[test]
fn every_base_is_read() {
    let mut count = 0;
    for entry in fs::read_dir("tests/bad/base").unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            Case::read_with(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
            count += 1;
        }
    }
    assert!(count >= 8);
}

fn case(wrong: &Wrong) -> Option<taut::Error> {
    match &wrong.text {
        Some(text) => Case::from_text(&wrong.path, text).err(),
        None => Case::read(&wrong.path).err(),
    }
}

fn opened(wrong: &Wrong) -> Option<taut::Error> {
    match &wrong.text {
        Some(text) => Case::from_text_with(&wrong.path, text, &[]).err(),
        None => Case::read_with(&wrong.path, &[]).err(),
    }
}

fn messages(folder: &str, least: usize, error: fn(&Wrong) -> Option<taut::Error>) {
    wrong::every_message(folder, least, |wrong| {
        // Messages name the file as the user does; here that is from within the folder.
        Some(error(wrong)?.to_string().replace(&format!("{folder}/"), ""))
    });
}

/// Mistakes in the files of `tests/bad` themselves, each with what it says.
#[test]
fn a_section_that_is_wrong_itself_is_refused() {
    let read = |text: &str| {
        let base = |name: &str| (name == "b").then(|| "t = 1\n\n[cart]\nmass = 2\nlength = 3\n".to_string());
        wrong::sections(Path::new("tests/bad/case/x.txt"), text, base)
    };
    let section = |change: &str| format!("base: b\n\n## one\n{change}\n---\nmessage\n");
    for (change, text) in [
        ("cart.mass = 4", "t = 1\n\n[cart]\nmass = 4\nlength = 3\n"),
        ("cart.width = 4", "t = 1\n\n[cart]\nmass = 2\nlength = 3\nwidth = 4\n"),
        ("kind = 4", "t = 1\nkind = 4\n\n[cart]\nmass = 2\nlength = 3\n"),
        ("cart.mass => mess: 4", "t = 1\n\n[cart]\nmess: 4\nlength = 3\n"),
        ("cart => [[cart]]", "t = 1\n\n[[cart]]\nmass = 2\nlength = 3\n"),
        ("cart.mass + mass = 4", "t = 1\n\n[cart]\nmass = 2\nmass = 4\nlength = 3\n"),
        ("t + [belt]\nbelt.x = 4", "t = 1\n\n[belt]\nx = 4\n\n[cart]\nmass = 2\nlength = 3\n"),
        ("+ [belt]\n+ x = 4", "t = 1\n\n[cart]\nmass = 2\nlength = 3\n\n[belt]\nx = 4\n"),
        ("- cart.mass", "t = 1\n\n[cart]\nlength = 3\n"),
        ("- cart", "t = 1\n\n"),
    ] {
        let wrong = read(&section(change)).unwrap_or_else(|told| panic!("{told}"));
        assert_eq!(wrong[0].text.as_deref(), Some(text), "{change}");
        assert_eq!(wrong[0].message, "message\n");
    }
    for (change, told) in [
        ("cart.mass = 2", "4: `cart.mass = 2` changes nothing"),
        ("cart.mass = 4\ncart.mass = 4", "5: `cart.mass = 4` changes nothing"),
        ("cat.mass = 4", "4: there is no `cat.mass`"),
        ("cart.mess => mass = 4", "4: there is no `cart.mess`"),
        ("cart = 4", "4: `cart` is a table"),
        ("- belt", "4: there is no `belt`"),
        ("cart.mass: 4", "4: `cart.mass: 4` is none of `KEY = VALUE`, `KEY => LINE`, `KEY + LINE`, `+ LINE`, `- KEY`"),
        ("base: c\nt = 2", "3: there is no base `c`"),
    ] {
        let Err(error) = read(&section(change)) else { panic!("{change}") };
        assert_eq!(error, format!("tests/bad/case/x.txt:{told}"));
    }
    for (text, told) in [
        ("base: b\n\n## one\n---\nmessage\n", "3: `one` changes nothing"),
        ("base: b\n\n## one\nt = 2\n\n## two\nt = 3\n---\nmessage", "3: `one` has no `---` above its message"),
        ("base: b\n\n## one", "3: `one` has no `---` above its message"),
        ("## one\nt = 2\n---\nmessage\n", "1: no `base: NAME` here or above all sections"),
        ("## one.csv\n---\nmessage\n", "1: there is no file `one.csv`"),
        ("## one.csv\nt = 2\n---\nmessage\n", "2: `one.csv` is a file as it is, and has no changes"),
    ] {
        let Err(error) = read(text) else { panic!("{text}") };
        assert_eq!(error, format!("tests/bad/case/x.txt:{told}"));
    }
}

/// Two sections of one name, and a file that no section names, would be tested by half.
#[test]
fn every_file_has_its_section_and_every_section_its_name() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bad/log");
    fs::create_dir_all(&folder).unwrap();
    let told = |text: &str| {
        fs::write(folder.join("x.txt"), text).unwrap();
        let told = wrong::read(&folder).map(|all| all.len()).unwrap_err();
        told.replace(&format!("{}/", folder.display()), "")
    };
    fs::write(folder.join("a.csv"), "").unwrap();
    assert_eq!(told("## a.csv\n---\none\n\n## a.csv\n---\ntwo\n"), "x.txt:5: `a.csv` stands at x.txt:1, too");
    assert_eq!(told(""), "a.csv: no section reads this file");
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_file_that_is_not_there_and_a_folder() {
    let error = Case::read("no/such/axis.toml").unwrap_err().to_string();
    assert_eq!(
        error,
        "no/such/axis.toml: this case file cannot be read: there is no such file\n  next: check the path, or write a new case with `taut init`"
    );
    let error = Case::read("tests").unwrap_err().to_string();
    assert_eq!(error, "tests: this case file cannot be read: it is a folder");
}
