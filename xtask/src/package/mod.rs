//! `cargo xtask package`: everything that a release consists of, built and tried out in folders of its own.
//!
//! - The crates as they would be published. They are installed from a registry that has nothing but them and the
//!   packages that they need, into an empty folder, by a cargo without a configuration.
//! - The program for a glibc of 2.17 and later, with completions, manual pages, the licences of all packages in it and
//!   a bill of materials (CycloneDX), in one archive.
//! - The Python wheel, for the same C library, installed into empty environments.
//! - The interface of the libraries, which may change only as far as the version allows since the last release.
//!
//! The two programs and the wheel must give equal results. A run that failed can be repeated: what was built from the
//! same source is kept in `target/package-work`. The run ends with a list of its results, each with its figure, and of
//! the targets that it did not build.

mod crates;
mod glibc;
mod interface;
mod others;
mod paths;
mod program;
mod trial;
mod wheel;

use crate::{Counts, compiler, host, output, python, write};
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

pub use paths::flags;

pub const USAGE: &str = "cargo xtask package [--part interface|crates|program|wheel]... [--since COMMIT] \
                         [--target TRIPLE] [--twice] [--python PROGRAM]... [--fresh]";

/// Packages of Python that have to be installed, to the digit.
const REQUIREMENTS: &str = "xtask/requirements.txt";

/// The oldest glibc that programs run with.
const GLIBC: (u32, u32) = (2, 17);

/// Arguments of the command.
#[derive(Debug, Default, PartialEq)]
struct Asked {
    parts: Vec<Part>,
    /// The commit whose interface is compared with; none: the last release.
    since: Option<String>,
    /// The target of program and wheel; none: this machine.
    target: Option<String>,
    /// True if the program is built a second time in another folder, and both builds must be equal byte by byte.
    twice: bool,
    /// Further versions of Python that the wheel is tried with.
    pythons: Vec<String>,
    /// True if nothing of earlier runs is kept.
    fresh: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Part {
    Interface,
    Crates,
    Program,
    Wheel,
}

/// Folders of the work.
struct Places {
    /// Output folder of the release.
    out: PathBuf,
    /// Folder for builds and trials.
    work: PathBuf,
    /// Tools of Python.
    tools: PathBuf,
}

/// Claims shown by a run with their figures, in order.
#[derive(Default)]
struct Claims(Vec<(String, String)>);

impl Claims {
    /// Adds one and prints it.
    fn add(&mut self, claim: &str, figure: String) {
        println!("{claim}: {figure}");
        self.0.push((claim.to_string(), figure));
    }

    /// Prints all.
    fn print(&self) {
        println!("\n== shown");
        let width = self.0.iter().map(|(claim, _)| claim.chars().count()).max().unwrap_or(0);
        for (claim, figure) in &self.0 {
            println!("{claim:width$}  {figure}");
        }
    }
}

/// Builds and tries all of it. Errors: a build that fails, or what was built does not work.
pub fn run(words: &[&str]) -> Result<(), String> {
    let asked = Asked::new(words)?;
    asked.pythons.iter().try_for_each(|program| python::is_new_enough(program))?;
    let own = program::own_target()?;
    let triple = asked.target.clone().unwrap_or_else(|| own.clone());
    others::refuse_static(&triple)?;
    let compiler = compiler::find(&triple).map_err(|needs| format!("{triple} needs {needs}"))?;
    if asked.twice {
        committed()?;
    }
    let target = host::target();
    let work = target.join("package-work");
    if asked.fresh {
        let _ = fs::remove_dir_all(&work);
    }
    let tools = python::environment("package-tools", REQUIREMENTS)?;
    let places = Places { out: target.join("package").join("release"), work, tools };
    // What lies there from an earlier run must not be taken for a part of this one.
    let _ = fs::remove_dir_all(&places.out);
    fs::create_dir_all(&places.out).map_err(|error| format!("{}: {error}", places.out.display()))?;
    let mut claims = Claims::default();
    let mut programs = Vec::new();
    for part in &asked.parts {
        match part {
            Part::Interface => interface::make(asked.since.as_deref(), &mut claims)?,
            Part::Crates => programs.push(crates::make(&places, &mut claims)?),
            Part::Program => {
                let build = program::Build { places: &places, triple: &triple, compiler: &compiler };
                programs.extend(program::make(&build, asked.twice, &mut claims)?);
            }
            Part::Wheel => {
                let build = program::Build { places: &places, triple: &triple, compiler: &compiler };
                wheel::make(&build, &asked.pythons, programs.first(), &mut claims)?;
            }
        }
    }
    if let [first, second] = &programs[..] {
        let files = trial::same(first, second)?;
        let names = format!("{} and {}", first.name, second.name);
        claims.add(
            "equal results",
            format!("{names}: {files} equal files of the trial, the FMU but its object included"),
        );
    }
    sums(&places.out)?;
    claims.print();
    others::print(&triple);
    Ok(())
}

impl Asked {
    fn new(words: &[&str]) -> Result<Self, String> {
        let mut asked = Self::default();
        let mut words = words.iter();
        while let Some(word) = words.next() {
            match (*word, words.as_slice().first().copied()) {
                ("--twice", _) => asked.twice = true,
                ("--fresh", _) => asked.fresh = true,
                ("--target", Some(triple)) => asked.target = Some(triple.to_string()),
                ("--python", Some(program)) => asked.pythons.push(program.to_string()),
                ("--since", Some(commit)) => asked.since = Some(commit.to_string()),
                ("--part", Some("interface")) => asked.parts.push(Part::Interface),
                ("--part", Some("crates")) => asked.parts.push(Part::Crates),
                ("--part", Some("program")) => asked.parts.push(Part::Program),
                ("--part", Some("wheel")) => asked.parts.push(Part::Wheel),
                _ => return Err(format!("`{word}` is not understood\nusage: {USAGE}")),
            }
            if !["--twice", "--fresh"].contains(word) {
                words.next();
            }
        }
        if asked.parts.is_empty() {
            asked.parts = match asked.target {
                // Interface and crates are the same for every target.
                Some(_) => vec![Part::Program, Part::Wheel],
                None => vec![Part::Interface, Part::Crates, Part::Program, Part::Wheel],
            };
        }
        Ok(asked)
    }
}

/// Errors: files that are not in the commit, from which the second build is made.
fn committed() -> Result<(), String> {
    let mut status = Command::new("git");
    status.args(["status", "--porcelain"]);
    match String::from_utf8_lossy(&output(status)?).trim_end() {
        "" => Ok(()),
        files => Err(format!("--twice builds the last commit a second time; commit these files first:\n{files}")),
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

/// Members of the workspace according to `cargo metadata`.
fn members() -> Result<Vec<Value>, String> {
    let listed = output(crate::cargo(&["metadata", "--no-deps", "--format-version", "1"]))?;
    let mut listed: Value = serde_json::from_slice(&listed).map_err(|e| format!("cargo metadata: {e}"))?;
    Ok(listed["packages"].as_array_mut().map(std::mem::take).unwrap_or_default())
}

/// Writes SHA256SUMS of the files that are handed out, and lists them.
fn sums(out: &Path) -> Result<(), String> {
    let cannot = |e: std::io::Error| format!("{}: {e}", out.display());
    let mut names: Vec<PathBuf> =
        fs::read_dir(out).map_err(cannot)?.flatten().map(|entry| entry.path()).filter(|path| path.is_file()).collect();
    names.sort();
    let mut text = String::new();
    println!("\n== {}", out.display());
    for path in &names {
        let bytes = fs::read(path).map_err(cannot)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        println!("{:>12} bytes  {name}", bytes.len());
        text += &format!("{}  {name}\n", hash(&bytes));
    }
    write(&out.join("SHA256SUMS"), text)
}

/// SHA-256 in hexadecimal digits.
fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Reads a file.
fn read(path: &Path) -> Result<Vec<u8>, String> {
    fs::read(path).map_err(|error| format!("{}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_understood_or_refused() {
        let all = vec![Part::Interface, Part::Crates, Part::Program, Part::Wheel];
        assert_eq!(Asked::new(&[]), Ok(Asked { parts: all, ..Asked::default() }));
        let words = "--part program --since v0.1.0 --twice --target aarch64-unknown-linux-gnu --python p --fresh";
        let words: Vec<&str> = words.split(' ').collect();
        let asked = Asked {
            parts: vec![Part::Program],
            since: Some("v0.1.0".into()),
            target: Some("aarch64-unknown-linux-gnu".into()),
            twice: true,
            pythons: vec!["p".into()],
            fresh: true,
        };
        assert_eq!(Asked::new(&words), Ok(asked));
        let of_target = Asked::new(&["--target", "aarch64-unknown-linux-gnu"]).unwrap();
        assert_eq!(of_target.parts, [Part::Program, Part::Wheel]);
        for wrong in ["--part", "--part all", "--target", "twice", "--python", "--fresh a", "--since"] {
            let wrong: Vec<&str> = wrong.split(' ').collect();
            assert!(Asked::new(&wrong).unwrap_err().contains("is not understood"), "{wrong:?}");
        }
    }

    #[test]
    fn a_target_that_rust_does_not_know_is_refused_before_anything_is_built() {
        let refused = run(&["--target", "pdp11-unknown-unix"]).unwrap_err();
        assert!(refused.starts_with("pdp11-unknown-unix needs"), "{refused}");
        let refused = run(&["--target", "x86_64-unknown-linux-musl"]).unwrap_err();
        assert!(refused.starts_with("x86_64-unknown-linux-musl has no shared objects"), "{refused}");
    }

    #[test]
    fn a_python_that_does_not_run_is_refused_before_anything_is_built() {
        let refused = run(&["--python", "python-of-nobody"]).unwrap_err();
        assert!(refused.starts_with("python-of-nobody is not Python 3.10 or later"), "{refused}");
    }
}
