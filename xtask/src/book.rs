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
        [] => built()?,
        ["--program", program] => std::path::absolute(program).map_err(|error| format!("{program}: {error}"))?,
        _ => return Err(format!("usage: {USAGE}")),
    };
    let html = make(&program, false)?;
    println!("the book begins at {}", html.join("index.html").display());
    Ok(())
}

/// Builds the book for a folder of the studio, in which its examples can be opened; its folder.
pub fn beside_studio(program: &Path) -> Result<PathBuf, String> {
    make(program, true)
}

fn make(program: &Path, has_studio: bool) -> Result<PathBuf, String> {
    let mdbook = installed("mdbook", VERSION, &["--no-default-features", "--features", "search"])?;
    let folder = crate::host::target().join("book");
    let _ = fs::remove_dir_all(&folder);
    let pages = folder.join("docs");
    copy(Path::new("docs"), &pages)?;
    write(&folder.join("book.toml"), &read(Path::new("book.toml"))?)?;
    let mut examples = has_studio.then(|| studio::Links::new(program, folder.join("tried")));
    for page in files(&pages)?.iter().filter(|path| path.extension().is_some_and(|e| e == "md")) {
        write(page, linked(&generated::filled(&read(page)?, program)?, &pages, examples.as_mut())?)?;
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

/// A page whose links lead to copies of files of the repository and, from its examples, to the studio.
fn linked(text: &str, pages: &Path, examples: Option<&mut studio::Links>) -> Result<String, String> {
    // In this order: the studio is no file of the repository.
    let text = links::within(text, pages)?;
    match examples {
        Some(examples) => examples.below(&text),
        None => Ok(text),
    }
}

/// Path of the program `taut`, which is built first.
fn built() -> Result<PathBuf, String> {
    match crate::cargo(&["build", "--quiet", "--package", "taut-cli", "--bin", "taut"]).status() {
        Ok(status) if status.success() => Ok(crate::program()),
        Ok(_) => Err("the program taut could not be built".into()),
        Err(error) => Err(format!("cargo cannot be started: {error}")),
    }
}

/// A program from cargo's registry, in this version, under `target`; installed first, with these `options`, if missing.
pub fn installed(name: &str, version: &str, options: &[&str]) -> Result<PathBuf, String> {
    let root = crate::host::target().join(name);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The link to the studio was taken for one to a file of the repository, and `cargo xtask web` failed.
    #[test]
    #[cfg(unix)]
    fn a_page_leads_to_copies_of_files_and_to_the_studio() {
        let pages = std::env::temp_dir().join(format!("taut-xtask-book-{}", std::process::id()));
        let page = "[manifest](../Cargo.toml)\n```toml\n[motor]\n[cart]\n```\n";
        // The program `true` opens every case.
        let mut examples = studio::Links::new(Path::new("true"), pages.join("tried"));
        let linked = linked(page, &pages, Some(&mut examples)).unwrap();
        assert!(linked.starts_with("[manifest](repository/Cargo.toml)"), "{linked}");
        assert!(linked.contains(&format!("[Open this case in the studio]({}#state=", studio::PAGE)), "{linked}");
        fs::remove_dir_all(pages).unwrap();
    }
}
