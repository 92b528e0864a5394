//! Compilers of Rust for other targets. If rustup cannot provide the standard library of a target, Debian's compiler
//! for browsers, which has LLVM for all processors and the source of the library, is unpacked under `target/web`,
//! without being installed; cargo then compiles the library too.

use crate::{host, succeeds};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Time limit of rustup.
const PATIENCE: Duration = Duration::from_secs(60);

/// A compiler for a target.
#[derive(Debug)]
pub enum Compiler {
    /// The compiler of the project, with the target installed.
    Own,
    /// Debian's compiler for browsers, unpacked in this folder; it compiles the standard library too.
    Debian(PathBuf),
}

impl Compiler {
    /// Has a cargo command, and those that it starts, use this compiler.
    pub fn set(&self, build: &mut Command) -> Result<(), String> {
        if let Self::Debian(root) = self {
            build.env("CARGO_UNSTABLE_BUILD_STD", "std,panic_abort").env("RUSTC_BOOTSTRAP", "1");
            build.env("RUSTC", root.join("usr/bin/rustc")).env("LD_LIBRARY_PATH", libraries(root)?);
        }
        Ok(())
    }
}

/// Finds or fetches a compiler for a target. Errors: what is missing.
pub fn find(target: &str) -> Result<Compiler, String> {
    if let Some(compiler) = installed(target) {
        return Ok(compiler);
    }
    let missing = format!(
        "the standard library of Rust for {target} (rustup target add {target}; or on Debian 12 what apt-get download \
         fetches: rustc-web, rust-web-src)"
    );
    if !is_known(target) {
        return Err(format!("a name that rustc --print target-list prints, and {missing}"));
    }
    let rustup = Command::new("rustup").args(["target", "add", target]).stderr(Stdio::null()).spawn();
    if rustup.is_ok_and(|rustup| succeeds_within(PATIENCE, rustup)) && has_target(target) {
        return Ok(Compiler::Own);
    }
    if host::path_of("apt-get").is_some() && unpack(&debian()).is_ok() && answers(&debian()) {
        return Ok(Compiler::Debian(debian()));
    }
    Err(missing)
}

/// Returns the compiler for a target that is on this computer, if any.
pub fn installed(target: &str) -> Option<Compiler> {
    if has_target(target) {
        return Some(Compiler::Own);
    }
    Some(debian()).filter(|root| is_known(target) && answers(root)).map(Compiler::Debian)
}

/// True if the compiler of the project knows a target by this name.
fn is_known(target: &str) -> bool {
    let listed = Command::new("rustc").args(["--print", "target-list"]).output();
    listed.is_ok_and(|answer| String::from_utf8_lossy(&answer.stdout).lines().any(|line| line == target))
}

/// The folder of Debian's compiler.
fn debian() -> PathBuf {
    host::target().join("web/debian/root")
}

/// True if the compiler of the project has the standard library of a target.
fn has_target(target: &str) -> bool {
    let asked = Command::new("rustc").args(["--print", "target-libdir", "--target", target]).output();
    let folder = asked.map(|answer| PathBuf::from(String::from_utf8_lossy(&answer.stdout).trim())).unwrap_or_default();
    fs::read_dir(folder)
        .is_ok_and(|files| files.flatten().any(|file| file.file_name().as_encoded_bytes().starts_with(b"libstd-")))
}

/// True if a program succeeds within this time; after that it is killed.
fn succeeds_within(limit: Duration, mut program: Child) -> bool {
    let begun = Instant::now();
    while begun.elapsed() < limit {
        match program.try_wait() {
            Ok(None) => std::thread::sleep(Duration::from_millis(50)),
            Ok(Some(status)) => return status.success(),
            Err(_) => return false,
        }
    }
    let _ = program.kill();
    let _ = program.wait();
    false
}

/// True if this folder holds Debian's compiler and the source of the standard library, and the compiler runs.
fn answers(root: &Path) -> bool {
    let Ok(libraries) = libraries(root) else { return false };
    let mut rustc = Command::new(root.join("usr/bin/rustc"));
    rustc.arg("--version").env("LD_LIBRARY_PATH", libraries).stdout(Stdio::null()).stderr(Stdio::null());
    rustc.status().is_ok_and(|status| status.success())
        && root.join("usr/lib/rustlib/src/rust/library/std/Cargo.toml").exists()
}

/// The folder of its shared libraries: `usr/lib/x86_64-linux-gnu`, say.
fn libraries(root: &Path) -> Result<PathBuf, String> {
    let lib = root.join("usr/lib");
    let folders = fs::read_dir(&lib).map_err(|error| format!("{}: {error}", lib.display()))?;
    let has_driver = |folder: &PathBuf| {
        fs::read_dir(folder).is_ok_and(|files| {
            files.flatten().any(|file| file.file_name().as_encoded_bytes().starts_with(b"librustc_driver"))
        })
    };
    let found = folders.flatten().map(|entry| entry.path()).find(has_driver);
    found.ok_or_else(|| format!("{} has no compiler", lib.display()))
}

/// Downloads and unpacks Debian's compiler.
fn unpack(root: &Path) -> Result<(), String> {
    let folder = root.with_extension("packages");
    fs::create_dir_all(&folder).and_then(|()| fs::create_dir_all(root)).map_err(|error| error.to_string())?;
    let depends = Command::new("apt-cache")
        .args(["depends", "--recurse", "--no-recommends", "--no-suggests", "--no-conflicts", "--no-breaks"])
        .args(["--no-replaces", "--no-enhances", "rustc-web"])
        .output()
        .map_err(|error| error.to_string())?;
    // The other dependencies are installed on every Debian.
    let is_wanted = |name: &&str| ["rustc-web", "libstd-rust-web", "libllvm"].iter().any(|part| name.starts_with(part));
    let text = String::from_utf8_lossy(&depends.stdout);
    let mut download = Command::new("apt-get");
    download.args(["download", "--quiet", "rust-web-src"]).args(text.lines().filter(is_wanted)).current_dir(&folder);
    if !succeeds(&mut download)? {
        return Err("apt-get download failed".into());
    }
    let files = fs::read_dir(&folder).map_err(|error| error.to_string())?;
    for file in files.flatten() {
        if !succeeds(Command::new("dpkg").arg("-x").arg(file.path()).arg(root))? {
            return Err(format!("{} cannot be unpacked", file.path().display()));
        }
    }
    let _ = fs::remove_dir_all(folder);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_that_does_not_exist_is_refused_without_fetching_anything() {
        let refused = find("pdp11-unknown-unix").unwrap_err();
        assert!(refused.starts_with("a name that rustc --print target-list prints"), "{refused}");
    }

    #[test]
    #[cfg(unix)]
    fn a_program_that_hangs_is_killed() {
        let spawn = |words: &[&str]| Command::new(words[0]).args(&words[1..]).spawn().unwrap();
        let begun = Instant::now();
        assert!(!succeeds_within(Duration::from_millis(200), spawn(&["sleep", "60"])));
        assert!(begun.elapsed() < Duration::from_secs(30));
        assert!(succeeds_within(Duration::from_secs(30), spawn(&["true"])));
        assert!(!succeeds_within(Duration::from_secs(30), spawn(&["false"])));
    }

    #[test]
    fn a_folder_without_a_compiler_is_none() {
        let folder = std::env::temp_dir().join(format!("taut-xtask-compiler-{}", std::process::id()));
        fs::create_dir_all(folder.join("usr/lib/rustlib")).unwrap();
        assert!(!answers(&folder) && !answers(&folder.join("nothing")));
        fs::remove_dir_all(folder).unwrap();
    }
}
