//! Wrong files with the messages that they must give, each in a `.txt` beside its file.

use std::fs;
use std::path::{Path, PathBuf};

/// Every file of `folder` with this extension, of which there are at least so many, gives exactly its message; `None`
/// is no message. `UPDATE_EXPECT=1` writes the messages again.
pub fn every_message(folder: &str, extension: &str, least: usize, message: impl Fn(&Path) -> Option<String>) {
    let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == extension));
    files.sort();
    assert!(files.len() >= least, "only {} wrong files", files.len());

    let update = std::env::var_os("UPDATE_EXPECT").is_some();
    let mut wrong = Vec::new();
    for file in files {
        let Some(message) = message(&file).map(|message| message + "\n") else {
            wrong.push(format!("── {}\nwas read without a complaint\n", file.display()));
            continue;
        };
        let expected = file.with_extension("txt");
        if update {
            fs::write(&expected, &message).unwrap();
        }
        if fs::read_to_string(&expected).unwrap_or_default() != message {
            wrong.push(format!("── {}\n{message}", file.display()));
        }
    }
    assert!(wrong.is_empty(), "these messages are not the expected ones:\n{}", wrong.join("\n"));
}
