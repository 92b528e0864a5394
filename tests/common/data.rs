//! Files that are not part of the project. A test that lacks one does nothing, and is counted as ignored by
//! `cargo xtask test`: its name is appended to the file that `TAUT_IGNORED` names. With `TAUT_REQUIRE=all` it fails
//! instead.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Measurements of others in `data/`, each of these files; none where one is absent.
pub fn data<const N: usize>(files: [impl AsRef<str>; N]) -> Option<[PathBuf; N]> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let paths = files.each_ref().map(|file| folder.join(file.as_ref()));
    match files.iter().zip(&paths).find(|(_, path)| !path.is_file()) {
        None => Some(paths),
        Some((file, _)) => {
            ignored(&format!("data/{}, which `cargo xtask data` fetches", file.as_ref()));
            None
        }
    }
}

/// Whether the measurements that a case file of `stages` names are there.
pub fn of_case(path: &Path) -> bool {
    let text = std::fs::read_to_string(path).unwrap();
    let named = text.split("file = \"../../data/").skip(1).filter_map(|rest| rest.split('"').next());
    named.into_iter().all(|file| data([file]).is_some())
}

/// The trajectories that `authorities/verify.py` compares with, too: in the folder that `TAUT_REFERENCE` names, or
/// `data/reference`.
pub fn reference() -> Option<PathBuf> {
    let here = || Path::new(env!("CARGO_MANIFEST_DIR")).join("data/reference");
    let folder = std::env::var_os("TAUT_REFERENCE").map_or_else(here, PathBuf::from);
    if !folder.is_dir() {
        ignored("the reference trajectories in data/reference, or in the folder that TAUT_REFERENCE names");
        return None;
    }
    Some(folder)
}

fn ignored(needs: &str) {
    let thread = std::thread::current();
    let name = thread.name().unwrap_or("a test");
    assert!(std::env::var_os("TAUT_REQUIRE").is_none_or(|all| all != "all"), "{name} needs {needs}");
    println!("ignored: {name}: needs {needs}");
    if let Some(list) = std::env::var_os("TAUT_IGNORED") {
        let mut list = OpenOptions::new().append(true).create(true).open(list).unwrap();
        list.write_all(format!("{name}: needs {needs}\n").as_bytes()).unwrap();
    }
}
