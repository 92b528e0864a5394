//! Tools that are not part of the project: a test that lacks one does nothing, and is counted as ignored by
//! `cargo xtask test`, which installs them where it may; with `TAUT_REQUIRE=all` it fails instead.

use crate::ignored::ignored;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// True if all of these programs are there.
pub fn are_there(programs: &[&str]) -> bool {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let is_there = |name: &&&str| std::env::split_paths(&paths).any(|folder| folder.join(name).is_file());
    match programs.iter().find(|name| !is_there(name)) {
        None => true,
        Some(name) => {
            ignored(&format!("{name}, which `cargo xtask export` installs"));
            false
        }
    }
}

/// The Python of the environment that `cargo xtask export` makes.
pub fn python() -> Option<PathBuf> {
    let target = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    let target = target.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../target"));
    let python = std::path::absolute(target.join("export/bin/python")).unwrap();
    if python.is_file() {
        return Some(python);
    }
    ignored("the Python environment that `cargo xtask export` makes");
    None
}

/// Runs a command in a folder; it must succeed.
pub fn run(folder: &Path, program: impl AsRef<Path>, words: &[&str]) -> String {
    let output = try_to(folder, program.as_ref(), words);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{} {words:?}: {told}", program.as_ref().display());
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Runs a command in a folder.
pub fn try_to(folder: &Path, program: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(program);
    command.current_dir(folder).args(words).env("PYTHONDONTWRITEBYTECODE", "1");
    command.output().unwrap_or_else(|e| panic!("{}: {e}", program.display()))
}

/// The program `taut`.
pub fn taut(folder: &Path, words: &[&str]) -> Output {
    try_to(folder, &assert_cmd::cargo::cargo_bin("taut"), words)
}

/// A file of this repository.
pub fn file(name: &str) -> String {
    let path = std::path::absolute(Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name)).unwrap();
    path.to_str().unwrap().to_string()
}

/// Numbers of a file of doubles.
pub fn doubles(path: &Path) -> Vec<f64> {
    std::fs::read(path).unwrap().chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
}

/// Writes a file of doubles.
pub fn write_doubles(path: &Path, values: impl IntoIterator<Item = f64>) {
    let bytes: Vec<u8> = values.into_iter().flat_map(f64::to_le_bytes).collect();
    std::fs::write(path, bytes).unwrap();
}
