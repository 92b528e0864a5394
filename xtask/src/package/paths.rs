//! Folders of whoever builds a program, kept out of it; and the C library that it needs.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Compiler flags that replace these folders.
pub fn flags() -> Result<Vec<String>, String> {
    let flag = |(folder, name): &(PathBuf, &str)| format!("--remap-path-prefix={}={name}", folder.display());
    Ok(folders()?.iter().map(flag).collect())
}

/// Errors: a file that holds a path of this machine, or cannot be read.
pub fn check(file: &Path) -> Result<Vec<u8>, String> {
    let bytes = std::fs::read(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let found: Vec<String> = (folders()?.iter().map(|(folder, _)| folder.display().to_string()))
        .filter(|folder| bytes.windows(folder.len()).any(|window| window == folder.as_bytes()))
        .collect();
    match &found[..] {
        [] => Ok(bytes),
        found => Err(format!("{} holds paths of this machine: {}", file.display(), found.join(", "))),
    }
}

/// The newest version of glibc that a program names.
pub fn glibc(bytes: &[u8]) -> Option<(u32, u32)> {
    const MARK: &[u8] = b"GLIBC_";
    let places = bytes.windows(MARK.len()).enumerate().filter(|(_, window)| *window == MARK).map(|(place, _)| place);
    let version = |place: usize| {
        let text: String = bytes[place + MARK.len()..].iter().take(8).map(|byte| char::from(*byte)).collect();
        let mut numbers = text.split(|c: char| !c.is_ascii_digit());
        Some((numbers.next()?.parse().ok()?, numbers.next()?.parse().ok()?))
    };
    places.filter_map(version).collect::<BTreeSet<(u32, u32)>>().last().copied()
}

/// Folders of this machine that may be in a program, and what stands for them; of several that fit, the last one counts.
fn folders() -> Result<Vec<(PathBuf, &'static str)>, String> {
    let home = std::env::var_os(if cfg!(windows) { "USERPROFILE" } else { "HOME" }).map(PathBuf::from);
    let home = home.ok_or("the home folder is not known; set HOME")?;
    let cargo = std::env::var_os("CARGO_HOME").map_or_else(|| home.join(".cargo"), PathBuf::from);
    let source = std::env::current_dir().map_err(|e| format!("the present folder: {e}"))?;
    Ok(vec![(home, "home"), (source, "taut"), (cargo.join("registry").join("src"), "packages")])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_version_counts_by_its_numbers() {
        assert_eq!(glibc(b"..GLIBC_2.4\0GLIBC_2.17\0GLIBC_2.2.5\0GLIBC_PRIVATE\0"), Some((2, 17)));
        assert_eq!(glibc(b"static"), None);
    }
}
