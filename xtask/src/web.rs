//! `cargo xtask web`: the studio as a folder of files for any server of static files, with its commands as a
//! WebAssembly module, and the book in `book`, whose examples open in the studio.
//!
//! Compiling the module requires a compiler for `wasm32-unknown-unknown`.

use crate::compiler::{self, Compiler};
use crate::{book, host, package, succeeds};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

pub const USAGE: &str = "cargo xtask web [--out FOLDER]";

const TARGET: &str = "wasm32-unknown-unknown";

/// The name of the module in the folder.
const MODULE: &str = "taut.wasm";

/// Makes the folder.
pub fn run(words: &[&str]) -> Result<(), String> {
    let folder = match *words {
        [] => default_folder(),
        ["--out", folder] => PathBuf::from(folder),
        _ => return Err(format!("`{}` is not understood\nusage: {USAGE}", words.join(" "))),
    };
    let compiler = compiler::find(TARGET).map_err(|needs| format!("the module needs {needs}"))?;
    let bytes = make(&folder, &compiler)?;
    book::copy(&book::beside_studio(&crate::program())?, &folder.join("book"))?;
    println!("{}: serve it by any server of static files; {MODULE} has {bytes} bytes", folder.display());
    Ok(())
}

/// The folder without `--out`.
pub fn default_folder() -> PathBuf {
    host::target().join("web").join("page")
}

/// Makes the folder, and with it the program `taut`, and returns the size of the module, bytes.
pub fn make(folder: &Path, compiler: &Compiler) -> Result<u64, String> {
    let failed = |error: std::io::Error| format!("{} cannot be written: {error}", folder.display());
    fs::create_dir_all(folder).map_err(failed)?;
    let module = module(compiler)?;
    // Of the whole workspace, as the tests build it: of one package alone, the library is built with other features.
    let all = ["build", "--quiet", "--workspace", "--example", "folder", "--bin", "taut"];
    if !succeeds(&mut crate::cargo(&all))? {
        return Err("the programs that write page and book were not built".into());
    }
    let example = host::target().join("debug/examples").join(format!("folder{}", std::env::consts::EXE_SUFFIX));
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
    // Paths of the machine that builds it do not belong in a published file. All browsers have vectors since Safari
    // 16.4.
    let mut flags = package::flags(Path::new("."))?;
    flags.push("-Ctarget-feature=+simd128".into());
    build.env("CARGO_ENCODED_RUSTFLAGS", flags.join("\u{1f}"));
    compiler.set(&mut build)?;
    if matches!(compiler, Compiler::Debian(_)) {
        build.env("CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER", linker()?);
    }
    if !succeeds(&mut build)? {
        return Err("the module was not built".into());
    }
    Ok(built(&target))
}

/// The folder in which cargo builds the module.
fn build_folder() -> PathBuf {
    host::target().join("web").join("build")
}

/// The module in that folder.
fn built(target: &Path) -> PathBuf {
    target.join(TARGET).join("web").join("taut_web.wasm")
}

/// Returns a compiler for tests, which download none and do not compile the standard library for the first time.
pub fn compiler_for_tests() -> Result<Compiler, String> {
    let can_build = |compiler: &Compiler| matches!(compiler, Compiler::Own) || built(&build_folder()).exists();
    compiler::installed(TARGET).filter(can_build).ok_or_else(|| {
        format!("the target {TARGET} of Rust, or a module that `cargo xtask web` has built once, which fetches it")
    })
}

/// The linker: Rust's own, which supports all targets, or LLVM's.
fn linker() -> Result<PathBuf, String> {
    let folder = Command::new("rustc").args(["--print", "target-libdir"]).output();
    let folder = folder.map(|answer| String::from_utf8_lossy(&answer.stdout).trim().to_string()).unwrap_or_default();
    let own = Path::new(&folder).with_file_name("bin").join("rust-lld");
    let found = Some(own).filter(|own| own.is_file()).or_else(|| host::path_of("wasm-ld"));
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
}
