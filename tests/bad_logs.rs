//! Every wrong log in `tests/bad/log` gives exactly its message; `UPDATE_EXPECT=1` writes the messages anew.

use crate::common::wrong;
use std::fs;
use std::path::Path;
use taut::log::{read_columns, read_samples};

fn message(file: &Path) -> Option<String> {
    Some(read_samples(file, "time_s", "voltage_V").err()?.to_string())
}

#[test]
fn wrong_logs_are_told_what_is_wrong_with_them() {
    wrong::every_message("tests/bad/log", 30, |wrong| message(&wrong.path));
}

#[test]
fn a_missing_file_and_a_folder() {
    assert_eq!(
        message(Path::new("tests/bad/log/nowhere.csv")).unwrap(),
        "tests/bad/log/nowhere.csv: there is no such file\n  next: check the name and the folder it is in"
    );
    let folder = message(Path::new("tests/bad/log")).unwrap();
    assert!(folder.starts_with("tests/bad/log: "), "{folder}");
}

/// A log with its rows and columns swapped has a column for each sample; the answer must not take the memory of all.
#[test]
fn a_million_columns_are_refused_at_once() {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("million-columns.csv");
    let row: String = (0..1_000_000).map(|k| format!("c{k},")).collect();
    fs::write(&file, format!("{row}\n{row}\n")).unwrap();
    let begin = std::time::Instant::now();
    let error = read_columns(&file, &["c5"]).unwrap_err();
    assert!(begin.elapsed().as_secs_f64() < 1.0);
    assert_eq!(error.what, "line 1 has more than 10,000 columns");
    // Names so short that the line is within its limit.
    fs::write(&file, "a,".repeat(10_001) + "b\n").unwrap();
    assert_eq!(read_columns(&file, &["b"]).unwrap_err().what, "line 1 has more than 10,000 columns");
    fs::write(&file, "a,".repeat(9_999) + "b\n" + &"1,".repeat(9_999) + "2\n").unwrap();
    assert_eq!(read_columns(&file, &["b"]), Ok(vec![vec![2.0]]));
    fs::write(&file, "a".repeat(3 << 20)).unwrap();
    assert_eq!(read_columns(&file, &["b"]).unwrap_err().what, "line 1 is longer than 1 MiB");
    fs::remove_file(&file).unwrap();
}
