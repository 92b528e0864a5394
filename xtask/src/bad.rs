//! `cargo xtask bad`: the wrong inputs of `tests/bad` as whole files, each with the message that it must give.

use crate::host;
use std::fs;
use std::path::{Path, PathBuf};

#[path = "../../tests/common/wrong.rs"]
#[allow(dead_code)]
mod wrong;

/// Writes all of them, and says where.
pub fn run() -> Result<(), String> {
    println!("{}", write()?.display());
    Ok(())
}

/// Writes all of them into a folder that is made anew; paths in the cases lead to copies of the logs.
pub fn write() -> Result<PathBuf, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().ok_or("the project has no folder")?;
    let new = host::target().join("tests");
    let _ = fs::remove_dir_all(&new);
    copy(&root.join("tests/logs"), &new.join("logs"))?;
    for folder in ["log", "shape", "case", "mapping", "gantry"].map(|name| Path::new("bad").join(name)) {
        let (from, to) = (root.join("tests").join(&folder), new.join(&folder));
        copy(&from, &to)?;
        for wrong in wrong::read(&from)? {
            let path = to.join(wrong.path.file_name().unwrap_or_default());
            put(&path.with_extension("txt"), wrong.message.as_bytes())?;
            put(&path, &wrong.bytes())?;
        }
    }
    Ok(new.join("bad"))
}

/// Copies the files of a folder but for the lists of sections.
fn copy(from: &Path, to: &Path) -> Result<(), String> {
    fs::create_dir_all(to).map_err(|error| format!("{}: {error}", to.display()))?;
    let entries = fs::read_dir(from).map_err(|error| format!("{}: {error}", from.display()))?;
    for path in entries.flatten().map(|entry| entry.path()).filter(|path| path.is_file()) {
        if path.extension().is_none_or(|extension| extension != "txt") {
            let bytes = fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
            put(&to.join(path.file_name().unwrap_or_default()), &bytes)?;
        }
    }
    Ok(())
}

fn put(path: &Path, bytes: &[u8]) -> Result<(), String> {
    fs::write(path, bytes).map_err(|error| format!("{}: {error}", path.display()))
}
