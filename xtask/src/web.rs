//! `cargo xtask web`: the studio as a folder of files for any server of static files, with its commands as a
//! WebAssembly module, and the book in `book`, whose examples open in the studio.
//!
//! Compiling the module requires the standard library for `wasm32-unknown-unknown`. If rustup cannot provide it,
//! Debian's compiler for browsers and the source of the library are unpacked under `target/web`, without being
//! installed.

use crate::{book, browser, package, python};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

pub const USAGE: &str = "cargo xtask web [--out FOLDER]";

const TARGET: &str = "wasm32-unknown-unknown";

/// The name of the module in the folder.
const MODULE: &str = "taut.wasm";

/// Time limit of rustup.
const PATIENCE: Duration = Duration::from_secs(60);

/// The compiler of the module.
pub enum Compiler {
    /// The compiler of the project, with the target installed.
    Own,
    /// Debian's compiler for browsers, unpacked in this folder; it compiles the standard library too.
    Debian(PathBuf),
}

/// Makes the folder.
pub fn run(words: &[&str]) -> Result<(), String> {
    let folder = match *words {
        [] => default_folder(),
        ["--out", folder] => PathBuf::from(folder),
        _ => return Err(format!("`{}` is not understood\nusage: {USAGE}", words.join(" "))),
    };
    let compiler = compiler().map_err(|needs| format!("the module needs {needs}"))?;
    let bytes = make(&folder, &compiler)?;
    book::copy(&book::beside_studio()?, &folder.join("book"))?;
    println!("{}: serve it by any server of static files; {MODULE} has {bytes} bytes", folder.display());
    Ok(())
}

/// The folder without `--out`.
pub fn default_folder() -> PathBuf {
    python::target().join("web").join("page")
}

/// Makes the folder, and returns the size of the module, bytes.
pub fn make(folder: &Path, compiler: &Compiler) -> Result<u64, String> {
    let failed = |error: std::io::Error| format!("{} cannot be written: {error}", folder.display());
    fs::create_dir_all(folder).map_err(failed)?;
    let module = module(compiler)?;
    // Of the whole workspace, as the tests build it: of one package alone, the library is built with other features.
    if !succeeds(&mut crate::cargo(&["build", "--quiet", "--workspace", "--example", "folder"]))? {
        return Err("the program that writes the page was not built".into());
    }
    let example = python::target().join("debug/examples").join(format!("folder{}", std::env::consts::EXE_SUFFIX));
    if !succeeds(Command::new(example).arg(folder))? {
        return Err("the files of the page were not written".into());
    }
    fs::copy(module, folder.join(MODULE)).map_err(failed)
}

/// The compiled module.
fn module(compiler: &Compiler) -> Result<PathBuf, String> {
    let target = build_folder();
    let mut build = crate::cargo(&["build", "--locked", "--profile", "web", "--package", "taut-web", "--lib"]);
    build.args(["--target", TARGET, "--target-dir"]).arg(&target);
    // Paths of the machine that builds it do not belong in a published file.
    build.env("CARGO_ENCODED_RUSTFLAGS", package::flags()?.join("\u{1f}"));
    if let Compiler::Debian(root) = compiler {
        build.args(["-Z", "build-std=std,panic_abort"]).env("RUSTC_BOOTSTRAP", "1");
        build.env("RUSTC", root.join("usr/bin/rustc")).env("LD_LIBRARY_PATH", libraries(root)?);
        build.env("CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER", linker()?);
    }
    if !succeeds(&mut build)? {
        return Err("the module was not built".into());
    }
    Ok(built(&target))
}

/// The folder in which cargo builds the module.
fn build_folder() -> PathBuf {
    python::target().join("web").join("build")
}

/// The module in that folder.
fn built(target: &Path) -> PathBuf {
    target.join(TARGET).join("web").join("taut_web.wasm")
}

/// Finds or fetches a compiler for the module. Errors: what is missing.
pub fn compiler() -> Result<Compiler, String> {
    if let Some(compiler) = installed() {
        return Ok(compiler);
    }
    let rustup = Command::new("rustup").args(["target", "add", TARGET]).stderr(Stdio::null()).spawn();
    if rustup.is_ok_and(|rustup| succeeds_within(PATIENCE, rustup)) && has_target() {
        return Ok(Compiler::Own);
    }
    if browser::path_of("apt-get").is_some() && unpack(&debian()).is_ok() && answers(&debian()) {
        return Ok(Compiler::Debian(debian()));
    }
    Err(format!(
        "the standard library of Rust for {TARGET} (rustup target add {TARGET}; or on Debian 12 what apt-get download \
         fetches: rustc-web, rust-web-src)"
    ))
}

/// Returns a compiler for tests, which download none and do not compile the standard library for the first time.
pub fn compiler_for_tests() -> Result<Compiler, String> {
    let can_build = |compiler: &Compiler| matches!(compiler, Compiler::Own) || built(&build_folder()).exists();
    installed().filter(can_build).ok_or_else(|| {
        format!("the target {TARGET} of Rust, or a module that `cargo xtask web` has built once, which fetches it")
    })
}

/// Returns the compiler that is on this computer, if any.
fn installed() -> Option<Compiler> {
    if has_target() { Some(Compiler::Own) } else { Some(debian()).filter(|root| answers(root)).map(Compiler::Debian) }
}

/// The folder of Debian's compiler.
fn debian() -> PathBuf {
    python::target().join("web/debian/root")
}

/// True if the compiler of the project has the target.
fn has_target() -> bool {
    let asked = Command::new("rustc").args(["--print", "target-libdir", "--target", TARGET]).output();
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

/// True if a command succeeds.
fn succeeds(command: &mut Command) -> Result<bool, String> {
    let name = command.get_program().to_string_lossy().into_owned();
    command.status().map(|status| status.success()).map_err(|error| format!("{name} cannot be started: {error}"))
}

/// The linker: Rust's own, which supports all targets, or LLVM's.
fn linker() -> Result<PathBuf, String> {
    let folder = Command::new("rustc").args(["--print", "target-libdir"]).output();
    let folder = folder.map(|answer| String::from_utf8_lossy(&answer.stdout).trim().to_string()).unwrap_or_default();
    let own = Path::new(&folder).with_file_name("bin").join("rust-lld");
    let found = Some(own).filter(|own| own.is_file()).or_else(|| browser::path_of("wasm-ld"));
    found.ok_or_else(|| "rust-lld, which comes with Rust of rustup, or wasm-ld (Debian: apt-get install lld)".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_words_are_an_error() {
        for words in [&["--fast"] as &[&str], &["--out"], &["--out", "a", "b"]] {
            assert!(run(words).unwrap_err().contains(USAGE), "{words:?}");
        }
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
        let folder = std::env::temp_dir().join(format!("taut-xtask-web-{}", std::process::id()));
        fs::create_dir_all(folder.join("usr/lib/rustlib")).unwrap();
        assert!(!answers(&folder) && !answers(&folder.join("nothing")));
        fs::remove_dir_all(folder).unwrap();
    }
}
