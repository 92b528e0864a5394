//! Writing a result so that nobody ever sees half of it.

use crate::error::{Error, Result};
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Writes `bytes` to `path`, whose folder exists: first under a temporary name beside it, then renamed.
///
/// A reader sees the old content or the new, and a failed write leaves the old in place. It does not
/// wait for the disk: after a power cut the newest files may be missing, as with any ordinary write.
pub fn write_atomically(path: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> Result<()> {
    let mut draft = Draft::create(path)?;
    draft.write(bytes.as_ref())?;
    draft.finish()
}

/// A file that is being written under a temporary name beside its own; dropped unfinished, it is removed.
#[derive(Debug)]
pub struct Draft {
    path: PathBuf,
    temporary: PathBuf,
    file: Option<File>,
}

impl Draft {
    /// Begins a file that will be called `path`; its folder exists.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let name = path.file_name().ok_or_else(|| cannot_write(path, &ErrorKind::IsADirectory.into()))?;
        // Two writers of one file must not share a temporary name: take the first that is free.
        for k in 0.. {
            let mut candidate = OsString::from(".");
            candidate.push(name);
            candidate.push(format!(".{k}.tmp"));
            let temporary = path.with_file_name(candidate);
            match OpenOptions::new().write(true).create_new(true).open(&temporary) {
                Ok(file) => return Ok(Self { path: path.to_path_buf(), temporary, file: Some(file) }),
                Err(e) if e.kind() == ErrorKind::AlreadyExists && k < 1000 => {}
                Err(e) => return Err(cannot_write(path, &e)),
            }
        }
        unreachable!("the search ends with a file or an error")
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
        // Closed first: some systems do not rename an open file.
        drop(self.file.take());
        fs::rename(&self.temporary, &self.path).map_err(|e| {
            let _ = fs::remove_file(&self.temporary);
            cannot_write(&self.path, &e)
        })
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
        if self.file.take().is_some() {
            let _ = fs::remove_file(&self.temporary);
        }
    }
}

fn cannot_write(path: &Path, e: &std::io::Error) -> Error {
    let next = match e.kind() {
        ErrorKind::NotFound => "create the folder first, or name another",
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => "choose a folder that you may write to",
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "free some space, or choose another folder",
        _ => "free the name or the space, or choose another folder",
    };
    Error::new(format!("cannot write this file: {e}")).in_file(path).next(next)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_and_leaves_nothing_behind() {
        let folder = std::env::temp_dir().join(format!("taut-files-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("a.txt");
        write_atomically(&path, "one").unwrap();
        write_atomically(&path, "two").unwrap();
        let mut unfinished = Draft::create(&path).unwrap();
        unfinished.write(b"three").unwrap();
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
        drop(unfinished);
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(&folder).unwrap();
        let error = write_atomically(&path, "four").unwrap_err();
        assert!(error.next.unwrap().contains("folder"));
    }
}
