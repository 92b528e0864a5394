//! Files that are not part of the project. A test that lacks one does nothing, and is counted as ignored by
//! `cargo xtask test`.

use super::ignored::ignored;
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

/// True if the measurements that a case file of `stages` names are there.
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
