//! The program as it is handed out: built by the profile `dist`, without the folders of whoever builds it in it, for a
//! C library that is as old as can be.

use crate::Counts;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::Command;

pub const USAGE: &str = "cargo xtask dist";

/// Builds it, and looks into it for paths of this machine. Errors: a path that it holds, or a build that fails.
pub fn run(words: &[&str]) -> Result<(), String> {
    if !words.is_empty() {
        return Err(format!("dist takes no words; usage: {USAGE}"));
    }
    let (folders, flags) = (folders()?, flags()?);
    // Other flags than those of daily work: a folder of its own keeps either from being built anew each time.
    let target = crate::python::target().join("dist-build");
    let mut build = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    build.args(["build", "--locked", "--profile", "dist", "--bin", "taut", "--target-dir"]).arg(&target);
    build.env("CARGO_ENCODED_RUSTFLAGS", flags.join("\u{1f}"));
    if !crate::run(build, &mut Counts::default())? {
        return Err("the program was not built".into());
    }
    let program = target.join("dist").join(format!("taut{}", std::env::consts::EXE_SUFFIX));
    let bytes = std::fs::read(&program).map_err(|e| format!("{}: {e}", program.display()))?;
    println!("{}, {} bytes", program.display(), bytes.len());
    if let Some((major, minor)) = glibc(&bytes).last() {
        println!("needs glibc {major}.{minor}, as the machine that it was built on has it");
    }
    let found: Vec<String> = (folders.iter().map(|(folder, _)| folder.display().to_string()))
        .filter(|folder| bytes.windows(folder.len()).any(|window| window == folder.as_bytes()))
        .collect();
    match &found[..] {
        [] => Ok(()),
        found => Err(format!("{} holds paths of this machine: {}", program.display(), found.join(", "))),
    }
}

/// Compiler flags that replace these folders.
pub fn flags() -> Result<Vec<String>, String> {
    let flag = |(folder, name): &(PathBuf, &str)| format!("--remap-path-prefix={}={name}", folder.display());
    Ok(folders()?.iter().map(flag).collect())
}

/// Folders of this machine that may be in a program, and what stands for them; of several that fit, the last one counts.
fn folders() -> Result<Vec<(PathBuf, &'static str)>, String> {
    let home = std::env::var_os(if cfg!(windows) { "USERPROFILE" } else { "HOME" }).map(PathBuf::from);
    let home = home.ok_or("the home folder is not known; set HOME")?;
    let cargo = std::env::var_os("CARGO_HOME").map_or_else(|| home.join(".cargo"), PathBuf::from);
    let source = std::env::current_dir().map_err(|e| format!("the present folder: {e}"))?;
    Ok(vec![(home, "home"), (source, "taut"), (cargo.join("registry").join("src"), "packages")])
}

/// Versions of glibc that a program names.
fn glibc(bytes: &[u8]) -> BTreeSet<(u32, u32)> {
    const MARK: &[u8] = b"GLIBC_";
    let places = bytes.windows(MARK.len()).enumerate().filter(|(_, window)| *window == MARK).map(|(place, _)| place);
    let version = |place: usize| {
        let text: String = bytes[place + MARK.len()..].iter().take(8).map(|byte| char::from(*byte)).collect();
        let mut numbers = text.split(|c: char| !c.is_ascii_digit());
        Some((numbers.next()?.parse().ok()?, numbers.next()?.parse().ok()?))
    };
    places.filter_map(version).collect()
}
