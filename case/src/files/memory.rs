//! Files in memory, which take the place of the file system in a browser.

use std::collections::BTreeMap;
use std::io::{self, Cursor, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// An open file.
pub type Source = Cursor<Arc<[u8]>>;

static HELD: Mutex<BTreeMap<PathBuf, Arc<[u8]>>> = Mutex::new(BTreeMap::new());

/// Stores a file under a path, and replaces an earlier one.
pub fn hold(path: impl Into<PathBuf>, bytes: Vec<u8>) {
    all().insert(path.into(), bytes.into());
}

/// True if a file is stored under this path.
pub fn is_held(path: impl AsRef<Path>) -> bool {
    all().contains_key(path.as_ref())
}

/// Total size of the stored files, bytes.
pub fn held() -> usize {
    all().values().map(|bytes| bytes.len()).sum()
}

/// Opens a stored file.
pub fn open(path: impl AsRef<Path>) -> io::Result<Source> {
    let missing = "this page has no file system and reads only files that were dropped on it";
    let found = all().get(path.as_ref()).cloned();
    found.map(Cursor::new).ok_or_else(|| io::Error::new(ErrorKind::Unsupported, missing))
}

/// The first `most` bytes of a stored file.
pub fn read(path: impl AsRef<Path>, most: usize) -> io::Result<Vec<u8>> {
    let bytes = open(path)?.into_inner();
    Ok(bytes[..bytes.len().min(most)].to_vec())
}

fn all() -> MutexGuard<'static, BTreeMap<PathBuf, Arc<[u8]>>> {
    HELD.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Seek, SeekFrom};

    #[test]
    fn what_is_held_is_read_and_nothing_else() {
        let before = held();
        hold("/held/log.csv", b"1,2\n3,4\n".to_vec());
        hold("/held/log.csv", b"time,x\n".to_vec());
        assert!(is_held("/held/log.csv") && !is_held("/held") && held() == before + 7);
        assert_eq!(read("/held/log.csv", 4).unwrap(), b"time");
        assert_eq!(read("/held/log.csv", 400).unwrap(), b"time,x\n");
        let (mut source, mut text) = (open("/held/log.csv").unwrap(), String::new());
        source.seek(SeekFrom::Start(5)).unwrap();
        source.read_to_string(&mut text).unwrap();
        assert_eq!(text, "x\n");
        for path in ["/held/other.csv", "log.csv", "", "/etc/passwd"] {
            assert_eq!(open(path).unwrap_err().kind(), ErrorKind::Unsupported, "{path}");
        }
    }
}
