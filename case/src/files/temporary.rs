//! Temporary files and folders: locked while their program runs, so that those of a killed one can be told and removed.

use super::unfinished::{self, ENDING};
use std::ffi::{OsStr, OsString};
use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// Longest name that a file may have on the usual file systems, bytes.
const LONGEST: usize = 255;

/// So many names behind the one that is taken are looked through for what was left.
const LOOK: usize = 4;

/// Most writers of one file at the same time.
const MOST: usize = 1000;

/// The k-th temporary name of a file: `.NAME.K.taut.tmp`.
pub(super) fn name(of: &OsStr, k: usize) -> OsString {
    hidden(of, &format!(".{k}{ENDING}"))
}

/// The hidden name of something that belongs to a file: `.NAME` and `ending`, with a hash in place of a name that would
/// be too long.
pub(super) fn hidden(of: &OsStr, ending: &str) -> OsString {
    let mut name = OsString::from(".");
    if of.as_encoded_bytes().len() + ENDING.len() + 6 <= LONGEST {
        name.push(of);
    } else {
        name.push(format!("{:016x}", crate::chance::hash(of.as_encoded_bytes().iter().copied())));
    }
    name.push(ending);
    name
}

/// Creates a temporary file or folder under the first of the names that is free, and locks it. Names that a killed
/// program left are free.
pub(super) fn claim(
    name: impl Fn(usize) -> PathBuf,
    create: impl Fn(&Path) -> io::Result<File>,
) -> io::Result<(PathBuf, File)> {
    let mut k = 0;
    loop {
        let candidate = name(k);
        let created = match create(&candidate) {
            Err(e) if e.kind() == ErrorKind::AlreadyExists && remove_abandoned(&candidate) => create(&candidate),
            created => created,
        };
        match created {
            Ok(file) if keeps(&candidate, &file) => {
                unfinished::add(&candidate);
                (k + 1..=k + LOOK).for_each(|k| {
                    remove_abandoned(&name(k));
                });
                return Ok((candidate, file));
            }
            // Another program took it for abandoned before it was locked.
            Ok(_) if k < MOST => k += 1,
            Err(e) if e.kind() == ErrorKind::AlreadyExists && k < MOST => k += 1,
            Ok(_) => return Err(ErrorKind::AlreadyExists.into()),
            Err(e) => return Err(e),
        }
    }
}

/// Locks what was just created; false if it has gone meanwhile.
fn keeps(path: &Path, file: &File) -> bool {
    match file.try_lock() {
        Ok(()) => stands_at(path, file),
        Err(TryLockError::WouldBlock) => false,
        // A file system without locks: nobody can tell what is abandoned there, and nothing is removed.
        Err(TryLockError::Error(_)) => true,
    }
}

/// Removes the temporary file or folder `path` if no running program has it locked; false if it stays.
pub fn remove_abandoned(path: &Path) -> bool {
    // Where folders cannot be opened they are never removed.
    let Ok(file) = File::open(path) else { return false };
    // Who holds the lock is the only one to remove it, so the name still leads to what is locked when it is removed.
    if file.try_lock().is_err() || !stands_at(path, &file) {
        return false;
    }
    match file.metadata() {
        Ok(data) if data.is_dir() => fs::remove_dir_all(path).is_ok(),
        Ok(_) => fs::remove_file(path).is_ok(),
        Err(_) => false,
    }
}

/// True if `path` is the name of this open file.
#[cfg(unix)]
pub(super) fn stands_at(path: &Path, file: &File) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (fs::symlink_metadata(path), file.metadata()) {
        (Ok(there), Ok(here)) => (there.dev(), there.ino()) == (here.dev(), here.ino()),
        _ => false,
    }
}

#[cfg(not(unix))]
pub(super) fn stands_at(path: &Path, _: &File) -> bool {
    path.exists()
}
