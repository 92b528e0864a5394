//! Writing results so that nobody ever sees half of one, and none takes the place of what it was made from.

mod batch;
mod claim;
mod csv;
mod inputs;
pub mod memory;
#[cfg(feature = "parquet")]
mod parquet;
#[cfg(not(target_family = "wasm"))]
mod reading;
mod replacing;
mod temporary;
mod unfinished;

pub use batch::{Batch, MARKER, shown};
pub use claim::{Claim, Refusal};
pub use csv::CsvWriter;
pub use inputs::Inputs;
#[cfg(target_family = "wasm")]
pub use memory::{Source, open, read};
#[cfg(feature = "parquet")]
pub use parquet::ParquetWriter;
#[cfg(not(target_family = "wasm"))]
pub use reading::{Source, open, read};
pub use temporary::remove_abandoned;
pub use unfinished::abandon;

use replacing::{like, target};

use crate::error::{Error, Result};
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Writes `bytes` to `path`, whose folder exists: first under a temporary name beside it, then renamed.
///
/// A reader sees the old content or the new, and a failed write leaves the old in place. A symbolic link stays, and the
/// file that it leads to is replaced; a file that is replaced keeps its permissions, and its owner and group where this
/// process may give them. It does not wait for the disk: after a power cut the newest files may be missing, as with any
/// ordinary write.
pub fn write_atomically(path: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> Result<()> {
    let mut draft = Draft::create(path)?;
    draft.write(bytes.as_ref())?;
    draft.finish()
}

/// A file that is being written under a temporary name beside its own; dropped unfinished, it is removed. Of a symbolic
/// link, that is beside the file that it leads to.
///
/// The temporary name is `.NAME.K.taut.tmp`, with K from 0. It is locked as long as its program runs: the next draft of
/// the same file removes those that a killed program left, and no others.
#[derive(Debug)]
pub struct Draft {
    path: PathBuf,
    /// The file itself, where `path` is a link.
    target: PathBuf,
    temporary: PathBuf,
    file: Option<File>,
}

impl Draft {
    /// Begins a file that will be called `path`; its folder exists.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let target = target(path)?;
        let name = target.file_name().ok_or_else(|| cannot_write(path, &ErrorKind::IsADirectory.into()))?;
        let create = |candidate: &Path| like(&target, candidate);
        let (temporary, file) = temporary::claim(|k| target.with_file_name(temporary::name(name, k)), create)
            .map_err(|e| cannot_write(path, &e))?;
        Ok(Self { path: path.to_path_buf(), target, temporary, file: Some(file) })
    }

    /// The name that the file will have.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds `bytes`.
    pub fn write(&mut self, bytes: &[u8]) -> Result<()> {
        let Some(file) = &mut self.file else { return Ok(()) };
        file.write_all(bytes).map_err(|e| cannot_write(&self.path, &e))
    }

    /// Gives the file its name.
    pub fn finish(mut self) -> Result<()> {
        let mut file = self.file.take();
        // Closed later, so that it is locked until it has its name; but some systems do not rename an open file.
        if cfg!(not(unix)) {
            file = None;
        }
        let renamed = unfinished::complete(&self.temporary, || {
            let renamed = fs::rename(&self.temporary, &self.target);
            if renamed.is_err() {
                let _ = fs::remove_file(&self.temporary);
            }
            renamed
        });
        drop(file);
        renamed.map_err(|e| cannot_write(&self.path, &e))
    }

    /// The open file, for writers that want to own one; [`Draft::finish`] is still to be called.
    #[cfg(feature = "parquet")]
    pub(crate) fn file(&self) -> Result<File> {
        let file = self.file.as_ref().ok_or(std::io::Error::from(ErrorKind::NotFound));
        file.and_then(File::try_clone).map_err(|e| cannot_write(&self.path, &e))
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if let Some(file) = self.file.take() {
            let _ = unfinished::complete(&self.temporary, || fs::remove_file(&self.temporary));
            drop(file);
        }
    }
}

fn cannot_write(path: &Path, e: &std::io::Error) -> Error {
    let next = match e.kind() {
        ErrorKind::NotFound => "create the folder first, or name another",
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => "choose a folder that you may write to",
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "free some space, or choose another folder",
        ErrorKind::FileTooLarge => "raise the limit on the size of files (`ulimit -f`), or write fewer rows",
        _ => "free the name or the space, or choose another folder",
    };
    Error::new(format!("cannot write this file: {e}")).in_file(shown(path)).next(next)
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("taut-files-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    pub(super) fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn replaces_and_leaves_nothing_behind() {
        let folder = folder("replaces");
        let path = folder.join("a.txt");
        write_atomically(&path, "one").unwrap();
        write_atomically(&path, "two").unwrap();
        let mut unfinished = Draft::create(&path).unwrap();
        unfinished.write(b"three").unwrap();
        assert_eq!(names(&folder), [".a.txt.0.taut.tmp", "a.txt"]);
        drop(unfinished);
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        assert_eq!(names(&folder), ["a.txt"]);
        fs::remove_dir_all(&folder).unwrap();
        let error = write_atomically(&path, "four").unwrap_err();
        assert!(error.next.unwrap().contains("folder"));
    }

    /// Temporary files of a killed run stayed for ever, and each later one took the next number.
    #[cfg(unix)]
    #[test]
    fn temporary_files_of_killed_runs_go_and_those_of_live_ones_stay() {
        let folder = folder("killed");
        let path = folder.join("a.txt");
        // As after kill -9: there, and locked by nobody.
        fs::write(folder.join(".a.txt.0.taut.tmp"), "half").unwrap();
        fs::write(folder.join(".a.txt.1.taut.tmp"), "half").unwrap();
        fs::write(folder.join(".b.txt.0.taut.tmp"), "of another file").unwrap();
        fs::write(folder.join(".a.txt.0.tmp"), "of another program").unwrap();
        let mut live = Draft::create(&path).unwrap();
        live.write(b"live").unwrap();
        assert_eq!(names(&folder), [".a.txt.0.taut.tmp", ".a.txt.0.tmp", ".b.txt.0.taut.tmp"]);
        write_atomically(&path, "other").unwrap();
        assert_eq!(fs::read(folder.join(".a.txt.0.taut.tmp")).unwrap(), b"live");
        live.finish().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"live");
        assert_eq!(names(&folder), [".a.txt.0.tmp", ".b.txt.0.taut.tmp", "a.txt"]);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_name_as_long_as_a_file_system_allows_has_a_temporary_one_too() {
        let folder = folder("long");
        let path = folder.join("ü".repeat(127));
        write_atomically(&path, "one").unwrap();
        assert_eq!(names(&folder).len(), 1);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_batch_gets_its_names_together_and_clears_what_a_killed_one_left() {
        let folder = folder("batch");
        fs::create_dir(folder.join(".0.taut.tmp")).unwrap();
        fs::write(folder.join(".0.taut.tmp/a.txt"), "half").unwrap();
        fs::write(folder.join("a.txt"), "old").unwrap();
        let batch = Batch::begin(&folder).unwrap();
        let other = Batch::begin(&folder).unwrap();
        write_atomically(batch.path("a.txt"), "new").unwrap();
        fs::create_dir(batch.path("plots")).unwrap();
        write_atomically(batch.path("plots/b.svg"), "new").unwrap();
        assert_eq!(names(&folder), [".0.taut.tmp", ".1.taut.tmp", "a.txt"]);
        assert_eq!(fs::read(folder.join("a.txt")).unwrap(), b"old");
        assert_eq!(batch.names().unwrap(), [Path::new("a.txt"), Path::new("plots/b.svg")]);
        batch.place(&[]).unwrap();
        drop((batch, other));
        assert_eq!(names(&folder), ["a.txt", "plots"]);
        assert_eq!(fs::read(folder.join("a.txt")).unwrap(), b"new");
        assert_eq!(fs::read(folder.join("plots/b.svg")).unwrap(), b"new");
        fs::remove_dir_all(&folder).unwrap();
    }

    /// A run that ended while it replaced the files of a folder left new ones beside old ones, and nothing said so.
    #[test]
    fn a_batch_that_cannot_place_all_its_files_leaves_the_marker() {
        let folder = folder("marker");
        fs::write(folder.join("plots"), "a file, where a folder is wanted").unwrap();
        let batch = Batch::begin(&folder).unwrap();
        write_atomically(batch.path("a.txt"), "new").unwrap();
        fs::create_dir(batch.path("plots")).unwrap();
        write_atomically(batch.path("plots/b.svg"), "new").unwrap();
        let error = batch.place(&[]).unwrap_err();
        assert!(error.to_string().contains("plots"), "{error}");
        drop(batch);
        assert!(fs::read_to_string(folder.join(MARKER)).unwrap().contains("the same command"));
        fs::remove_dir_all(&folder).unwrap();
    }
}
