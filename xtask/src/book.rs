//! `cargo xtask book [--program TAUT]`: builds the documents as a book under `target/book/html` and checks every link.
//!
//! The pages of `docs` are copied to `target/book/docs`. Lines `<!-- generated: ... -->` are replaced there by tables
//! of the JSON schemas, the Python API and a C header, which the program and the package themselves provide. The
//! program is built first, unless a built one is named.

mod generated;
mod links;
mod studio;

use crate::write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

pub const USAGE: &str = "cargo xtask book [--program TAUT]";

/// The version of mdBook that is installed under `target/mdbook`.
const VERSION: &str = "0.5.4";

/// Builds the book and checks its links.
pub fn run(words: &[&str]) -> Result<(), String> {
    let program = match words {
        [] => built(&crate::python::target())?,
        ["--program", program] => std::path::absolute(program).map_err(|error| format!("{program}: {error}"))?,
        _ => return Err(format!("usage: {USAGE}")),
    };
    let html = make(&program, false)?;
    println!("the book begins at {}", html.join("index.html").display());
    Ok(())
}

/// Builds the book for a folder of the studio, in which its examples can be opened; its folder.
pub fn beside_studio() -> Result<PathBuf, String> {
    make(&built(&crate::python::target())?, true)
}

fn make(program: &Path, has_studio: bool) -> Result<PathBuf, String> {
    let mdbook = installed("mdbook", VERSION, &["--no-default-features", "--features", "search"])?;
    let folder = crate::python::target().join("book");
    let _ = fs::remove_dir_all(&folder);
    let pages = folder.join("docs");
    copy(Path::new("docs"), &pages)?;
    write(&folder.join("book.toml"), &read(Path::new("book.toml"))?)?;
    let mut examples = studio::Links::new(program);
    for page in files(&pages)?.iter().filter(|path| path.extension().is_some_and(|e| e == "md")) {
        let mut text = generated::filled(&read(page)?, program)?;
        if has_studio {
            text = examples.below(&text)?;
        }
        write(page, &links::within(&text, &pages)?)?;
    }
    let html = folder.join("html");
    let built = Command::new(&mdbook).arg("build").arg(&folder).arg("--dest-dir").arg(&html).status();
    match built {
        Ok(status) if status.success() => {}
        Ok(_) => return Err("mdbook could not build the book".into()),
        Err(error) => return Err(format!("{} cannot be started: {error}", mdbook.display())),
    }
    let (checked, broken) = links::check(&html)?;
    if !broken.is_empty() {
        return Err(format!("broken links:\n{}", broken.join("\n")));
    }
    println!("{checked} links lead somewhere");
    Ok(html)
}

/// Path of the program `taut`, which is built first.
fn built(target: &Path) -> Result<PathBuf, String> {
    match crate::cargo(&["build", "--quiet", "--package", "taut-cli", "--bin", "taut"]).status() {
        Ok(status) if status.success() => {
            Ok(target.join("debug").join(format!("taut{}", std::env::consts::EXE_SUFFIX)))
        }
        Ok(_) => Err("the program taut could not be built".into()),
        Err(error) => Err(format!("cargo cannot be started: {error}")),
    }
}

/// A program from cargo's registry, in this version, under `target`; installed first, with these `options`, if missing.
pub fn installed(name: &str, version: &str, options: &[&str]) -> Result<PathBuf, String> {
    let root = crate::python::target().join(name);
    let program = root.join("bin").join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    let mark = root.join("version.txt");
    if fs::read_to_string(&mark).is_ok_and(|there| there == version) && program.is_file() {
        return Ok(program);
    }
    println!("installing {name} {version} under {}", root.display());
    let mut install = crate::cargo(&["install", "--locked", "--force", "--version", version, name]);
    install.args(options).arg("--root").arg(&root).arg("--target-dir").arg(root.join("build"));
    match install.status() {
        Ok(status) if status.success() => write(&mark, version).map(|()| program),
        Ok(_) => Err(format!("{name} {version} could not be installed under {}", root.display())),
        Err(error) => Err(format!("cargo cannot be started: {error}")),
    }
}

fn read(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|error| format!("{} cannot be read: {error}", path.display()))
}

/// All files below a folder, in the order of their paths.
pub fn files(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let cannot = |error: std::io::Error| format!("{} cannot be read: {error}", folder.display());
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(cannot)? {
        let path = entry.map_err(cannot)?.path();
        if path.is_dir() {
            found.extend(files(&path)?);
        } else {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Copies a folder with everything in it.
pub fn copy(from: &Path, to: &Path) -> Result<(), String> {
    for path in files(from)? {
        let name = path.strip_prefix(from).map_err(|error| error.to_string())?;
        copy_file(&path, &to.join(name))?;
    }
    Ok(())
}

fn copy_file(from: &Path, to: &Path) -> Result<(), String> {
    let copied = to.parent().map_or(Ok(()), fs::create_dir_all).and_then(|()| fs::copy(from, to).map(drop));
    copied.map_err(|error| format!("{} cannot be copied to {}: {error}", from.display(), to.display()))
}
