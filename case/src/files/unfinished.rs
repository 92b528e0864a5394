//! The files of this process that are not results yet: temporary files, hidden folders, locks. A program that has to
//! end at once removes them with [`abandon`].

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::{Duration, Instant};

/// How their names end; they begin with a point.
pub(super) const ENDING: &str = ".taut.tmp";

/// Temporary files, hidden folders and locks that exist now, and folders that were made for results.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Held while a batch gives its files their places: they get them together or not at all.
static PLACING: Mutex<()> = Mutex::new(());

/// Maximum time that [`abandon`] waits for a batch being placed; after that, the marker in its folder reports it as
/// incomplete.
const LONGEST_PLACING: Duration = Duration::from_secs(2);

/// Adds a path that is to be removed if the process has to end now.
pub(super) fn add(path: &Path) {
    list().push(path.to_path_buf());
}

/// Renames, removes or otherwise completes `path`, which is then no longer on the list. Nothing is completed once
/// [`abandon`] has begun.
pub(super) fn complete<T>(path: &Path, work: impl FnOnce() -> T) -> T {
    let mut list = list();
    let done = work();
    if let Some(place) = list.iter().rposition(|one| one == path) {
        list.swap_remove(place);
    }
    done
}

/// Excludes [`abandon`] until the guard is dropped.
pub(super) fn placing() -> MutexGuard<'static, ()> {
    PLACING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes all temporary files, hidden folders and locks of this process, so that it can end at once and leave each
/// result as it was. Threads that would complete a file after that wait for ever: end the process.
pub fn abandon() {
    let begin = Instant::now();
    let placing = loop {
        match PLACING.try_lock() {
            Ok(guard) => break Some(guard),
            Err(TryLockError::Poisoned(poisoned)) => break Some(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) if begin.elapsed() > LONGEST_PLACING => break None,
            Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(2)),
        }
    };
    let list = list();
    // The last that was made first: a folder that was made for results is empty by then, or stays.
    for path in list.iter().rev() {
        remove(path);
    }
    std::mem::forget((list, placing));
}

/// Removes a file, a hidden folder with what is in it, or another folder if it is empty.
fn remove(path: &Path) {
    let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().ends_with(ENDING));
    match fs::symlink_metadata(path) {
        Ok(data) if !data.is_dir() => drop(fs::remove_file(path)),
        // Another thread may be writing a file in it.
        Ok(_) if is_hidden => {
            for _ in 0..5 {
                if fs::remove_dir_all(path).is_ok() {
                    break;
                }
            }
        }
        Ok(_) => drop(fs::remove_dir(path)),
        Err(_) => {}
    }
}

fn list() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}
