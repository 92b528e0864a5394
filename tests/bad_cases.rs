//! Every wrong case file we could think of, with the exact message it must give.
//!
//! `UPDATE_EXPECT=1 cargo test -p taut --test all bad_cases::` writes the messages anew; read each of them aloud before
//! keeping it.

use crate::common::wrong;
use std::fs;
use std::path::Path;
use taut::case::{Case, Opened};

#[test]
fn every_wrong_case_gives_its_message() {
    compare("case");
}

/// Logs that cannot be used, and tables that say wrongly what a log holds.
#[test]
fn every_wrong_log_of_a_case_gives_its_message() {
    compare("mapping");
}

/// Gantries, as the commands that take both kinds read them.
#[test]
fn every_wrong_gantry_gives_its_message() {
    messages("gantry", 25, |path| Opened::read_with(path, &[]).err());
}

fn compare(folder: &str) {
    messages(folder, 60, |path| Case::read(path).err());
}

fn messages(folder: &str, least: usize, read: impl Fn(&Path) -> Option<taut::Error>) {
    let folder = format!("tests/bad/{folder}");
    wrong::every_message(&folder, "toml", least, |path| {
        // Messages name the file as the user does; here that is from within the folder.
        Some(read(path)?.to_string().replace(&format!("{folder}/"), ""))
    });
}

#[test]
fn no_message_is_left_without_its_file() {
    for folder in ["case", "gantry", "mapping"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad").join(folder);
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            assert!(path.with_extension("toml").exists(), "{}", path.display());
        }
    }
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
