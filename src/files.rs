//! Writing a result so that nobody ever sees half of it.

use crate::error::{Error, Result};
use std::ffi::OsString;
use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Writes `bytes` to `path`, whose folder exists: first under a temporary name beside it, then renamed.
///
/// A reader sees the old content or the new, and a failed write leaves the old in place. It does not
/// wait for the disk: after a power cut the newest files may be missing, as with any ordinary write.
pub fn write_atomically(path: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> Result<()> {
    let path = path.as_ref();
    let failed = |e: std::io::Error| {
        let next = match e.kind() {
            ErrorKind::NotFound => "create the folder first, or name another",
            ErrorKind::PermissionDenied => "choose a folder that you may write to",
            _ => "free the name or the space, or choose another folder",
        };
        Error::new(format!("cannot write this file: {e}")).in_file(path).next(next)
    };
    let name = path.file_name().ok_or_else(|| failed(ErrorKind::IsADirectory.into()))?;
    // Two writers of one file must not share a temporary name: take the first that is free.
    let (temporary, mut file) = (0..)
        .find_map(|k| {
            let mut candidate = OsString::from(".");
            candidate.push(name);
            candidate.push(format!(".{k}.tmp"));
            let candidate = path.with_file_name(candidate);
            match OpenOptions::new().write(true).create_new(true).open(&candidate) {
                Ok(file) => Some(Ok((candidate, file))),
                Err(e) if e.kind() == ErrorKind::AlreadyExists && k < 1000 => None,
                Err(e) => Some(Err(failed(e))),
            }
        })
        .expect("the search ends with a file or an error")?;
    let done = file.write_all(bytes.as_ref()).and_then(|()| fs::rename(&temporary, path));
    done.map_err(|e| {
        let _ = fs::remove_file(&temporary);
        failed(e)
    })
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
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(&folder).unwrap();
        let error = write_atomically(&path, "three").unwrap_err();
        assert!(error.next.unwrap().contains("folder"));
    }
}
