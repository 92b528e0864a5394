//! The program as tests run it, and the files of the project that they give it.

use assert_cmd::Command;
use std::path::{Path, PathBuf};
use std::process::Output;

/// The folder of the project.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// A file or folder of `stages`.
pub fn stage(name: &str) -> PathBuf {
    root().join("stages").join(name)
}

/// The text of a file of the project.
pub fn read(name: &str) -> String {
    std::fs::read_to_string(root().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The text of a file of `stages`.
pub fn stage_text(name: &str) -> String {
    read(&format!("stages/{name}"))
}

/// The program in this folder.
pub fn taut_in(folder: impl AsRef<Path>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_taut"));
    command.current_dir(folder);
    command
}

/// Runs the program in the folder of the project.
pub fn taut(args: &[&str]) -> Output {
    taut_in(root()).args(args).output().unwrap()
}

/// Text that the program wrote.
pub fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// Names of everything in a folder, sorted; none if there is no folder.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}
