//! `cargo xtask package`: everything that a release consists of, built and tried out in folders of its own.
//!
//! - The crates as they would be published. They are installed from a registry that has nothing but them and the
//!   packages that they need, into an empty folder, by a cargo without a configuration.
//! - The program for a glibc of 2.17 and later, with completions, manual pages, the licences of all packages in it and a
//!   bill of materials (CycloneDX), in one archive.
//! - The Python wheel, for the same C library, installed into an empty environment.
//!
//! The two programs and the wheel must give equal results.

mod crates;
mod paths;
mod program;
mod wheel;

use crate::{Counts, output, python, write};
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

pub use paths::flags;

pub const USAGE: &str = "cargo xtask package [--part crates|program|wheel]... [--target TRIPLE] [--twice]";

/// Packages of Python that have to be installed, to the digit.
const REQUIREMENTS: &str = "xtask/requirements.txt";

/// The oldest glibc that programs run with.
const GLIBC: (u32, u32) = (2, 17);

/// What is asked for.
#[derive(Debug, PartialEq)]
struct Asked {
    parts: Vec<Part>,
    /// The target of program and wheel; none: this machine.
    target: Option<String>,
    /// True if the program is built twice, and both builds must be equal byte by byte.
    twice: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Part {
    Crates,
    Program,
    Wheel,
}

/// Folders of the work.
struct Places {
    /// What is handed out.
    out: PathBuf,
    /// What it is built and tried in.
    work: PathBuf,
    /// Tools of Python.
    tools: PathBuf,
}

/// Builds and tries all of it. Errors: a build that fails, or what was built does not work.
pub fn run(words: &[&str]) -> Result<(), String> {
    let asked = Asked::new(words)?;
    let target = python::target();
    let tools = python::environment("package-tools", REQUIREMENTS)?;
    let places = Places { out: target.join("package").join("release"), work: target.join("package-work"), tools };
    // What lies there from an earlier run must not be taken for a part of this one.
    let _ = fs::remove_dir_all(&places.out);
    let mut programs = Vec::new();
    for part in &asked.parts {
        match part {
            Part::Crates => programs.push(crates::make(&places)?),
            Part::Program => programs.extend(program::make(&places, &asked)?),
            Part::Wheel => wheel::make(&places, &asked, programs.first().map(PathBuf::as_path))?,
        }
    }
    if let [first, second] = &programs[..] {
        same(first, second, &places.work)?;
    }
    sums(&places.out)
}

impl Asked {
    fn new(words: &[&str]) -> Result<Self, String> {
        let mut asked = Self { parts: Vec::new(), target: None, twice: false };
        let mut words = words.iter();
        while let Some(word) = words.next() {
            match (*word, words.as_slice().first().copied()) {
                ("--twice", _) => asked.twice = true,
                ("--target", Some(triple)) => asked.target = Some(triple.to_string()),
                ("--part", Some("crates")) => asked.parts.push(Part::Crates),
                ("--part", Some("program")) => asked.parts.push(Part::Program),
                ("--part", Some("wheel")) => asked.parts.push(Part::Wheel),
                _ => return Err(format!("`{word}` is not understood\nusage: {USAGE}")),
            }
            if *word != "--twice" {
                words.next();
            }
        }
        if asked.parts.is_empty() {
            asked.parts = vec![Part::Crates, Part::Program, Part::Wheel];
        }
        Ok(asked)
    }
}

/// Runs a command and shows its output. Errors: it fails.
fn must(command: Command) -> Result<(), String> {
    let shown = format!("{command:?}");
    match crate::run(command, &mut Counts::default())? {
        true => Ok(()),
        false => Err(format!("failed: {shown}")),
    }
}

/// What cargo says of the members of the workspace.
fn members() -> Result<Vec<Value>, String> {
    let listed = output(crate::cargo(&["metadata", "--no-deps", "--format-version", "1"]))?;
    let mut listed: Value = serde_json::from_slice(&listed).map_err(|e| format!("cargo metadata: {e}"))?;
    Ok(listed["packages"].as_array_mut().map(std::mem::take).unwrap_or_default())
}

/// Errors: two programs differ in what they compute, or one carries no object for FMUs.
fn same(first: &Path, second: &Path, work: &Path) -> Result<(), String> {
    if tried(first, work)? != tried(second, work)? {
        return Err(format!("{} and {} give different results", first.display(), second.display()));
    }
    println!("{} and {} give the same results", first.display(), second.display());
    Ok(())
}

/// Tries a program in an empty folder: a case file, its simulation and its FMU. Returns what `simulate --json` prints.
fn tried(program: &Path, work: &Path) -> Result<Vec<u8>, String> {
    let folder = work.join("tried");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let taut = |words: &[&str]| {
        let mut command = Command::new(program);
        command.args(words).current_dir(&folder).env_clear();
        output(command)
    };
    taut(&["init", "axis.toml"])?;
    let result = taut(&["simulate", "axis.toml", "--json"])?;
    taut(&["export", "fmu", "axis.toml", "--out", "axis.fmu"])?;
    Ok(result)
}

/// Writes SHA256SUMS of the files that are handed out, and lists them.
fn sums(out: &Path) -> Result<(), String> {
    let cannot = |e: std::io::Error| format!("{}: {e}", out.display());
    let mut names: Vec<PathBuf> =
        fs::read_dir(out).map_err(cannot)?.flatten().map(|entry| entry.path()).filter(|path| path.is_file()).collect();
    names.sort();
    let mut text = String::new();
    for path in &names {
        let bytes = fs::read(path).map_err(cannot)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        println!("{:>12} bytes  {name}", bytes.len());
        text += &format!("{}  {name}\n", hash(&bytes));
    }
    write(&out.join("SHA256SUMS"), text)?;
    println!("{}", out.display());
    Ok(())
}

/// SHA-256 in hexadecimal digits.
fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_understood_or_refused() {
        let all = vec![Part::Crates, Part::Program, Part::Wheel];
        assert_eq!(Asked::new(&[]), Ok(Asked { parts: all, target: None, twice: false }));
        let words = ["--part", "program", "--twice", "--target", "aarch64-unknown-linux-gnu"];
        let target = Some("aarch64-unknown-linux-gnu".to_string());
        assert_eq!(Asked::new(&words), Ok(Asked { parts: vec![Part::Program], target, twice: true }));
        for wrong in [&["--part"][..], &["--part", "all"], &["--target"], &["twice"]] {
            assert!(Asked::new(wrong).unwrap_err().contains("is not understood"), "{wrong:?}");
        }
    }
}
