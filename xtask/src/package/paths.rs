//! Folders of whoever builds a program, kept out of it.

use super::read;
use std::path::{Path, PathBuf};

/// Compiler flags that replace these folders in what is built from `source`.
pub fn flags(source: &Path) -> Result<Vec<String>, String> {
    let flag = |(folder, name): &(PathBuf, &str)| format!("--remap-path-prefix={}={name}", folder.display());
    Ok(folders(source)?.iter().map(flag).collect())
}

/// Returns the content of a file. Errors: it holds a path of this machine, or cannot be read.
pub fn check(file: &Path) -> Result<Vec<u8>, String> {
    let bytes = read(file)?;
    let mut paths: Vec<PathBuf> = folders(Path::new("."))?.into_iter().map(|(folder, _)| folder).collect();
    paths.push(crate::host::target());
    let found = held(&bytes, &paths);
    match &found[..] {
        [] => Ok(bytes),
        found => Err(format!("{} holds paths of this machine: {}", file.display(), found.join(", "))),
    }
}

/// The files in a folder. Errors: one of them holds a path of this machine, or cannot be read.
pub fn checked(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let files = crate::book::files(folder)?;
    files.iter().try_for_each(|file| check(file).map(drop))?;
    Ok(files)
}

/// The paths that are in a file.
fn held(bytes: &[u8], paths: &[PathBuf]) -> Vec<String> {
    let is_in = |path: &String| bytes.windows(path.len()).any(|window| window == path.as_bytes());
    paths.iter().map(|path| path.display().to_string()).filter(is_in).collect()
}

/// Folders of this machine that may be in a program, and their replacements; the last one that matches counts.
fn folders(source: &Path) -> Result<Vec<(PathBuf, &'static str)>, String> {
    let home = std::env::var_os(if cfg!(windows) { "USERPROFILE" } else { "HOME" }).map(PathBuf::from);
    let home = home.ok_or("the home folder is not known; set HOME")?;
    let cargo = std::env::var_os("CARGO_HOME").map_or_else(|| home.join(".cargo"), PathBuf::from);
    let source = std::path::absolute(source).map_err(|e| format!("{}: {e}", source.display()))?;
    Ok(vec![(home, "home"), (source, "taut"), (cargo.join("registry").join("src"), "packages")])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_found_wherever_it_is() {
        let paths = [PathBuf::from("/home/me"), PathBuf::from("/build")];
        assert_eq!(held(b"..\0/home/me/taut/src/lib.rs\0..", &paths), ["/home/me"]);
        assert!(held(b"taut/src/lib.rs", &paths).is_empty());
    }
}
