//! The list of what a folder of results holds, `files.json`: with it a later run removes what it does not write again.

use crate::interrupt;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};
use taut::{Error, Result};

/// Its name in the folder.
pub const NAME: &str = "files.json";

/// The most that is read of one: some 100,000 files.
const MOST_BYTES: u64 = 16 << 20;

/// Largest file that is read again after a signal, bytes.
const QUICK: u64 = 32 << 20;

/// The word that a list begins with.
const SCHEMA: &str = "taut/files/1";

/// The files that a run wrote into a folder.
#[derive(Debug, Serialize, Deserialize)]
pub struct Listing {
    schema: String,
    /// The version of taut that wrote them.
    version: String,
    files: Vec<Entry>,
}

#[derive(Debug, Serialize, Deserialize)]
struct Entry {
    /// From the folder on, parts separated by `/`.
    path: String,
    bytes: u64,
    sha256: String,
    /// The command that wrote it: each removes its own alone.
    command: String,
}

/// Of the files that an earlier run listed and this one does not write.
#[derive(Debug, Default, PartialEq)]
pub struct Left {
    /// They are as they were written: they go.
    pub stale: Vec<PathBuf>,
    /// Somebody changed them: they stay.
    pub changed: Vec<PathBuf>,
}

impl Listing {
    /// Of these files, written below `at` by `command`.
    pub fn new(command: &str, at: &Path, names: &[PathBuf]) -> Result<Self> {
        let entry = |name: &PathBuf| {
            let (bytes, sha256) = fingerprint(&at.join(name))
                .map_err(|e| Error::new(format!("this file cannot be read back: {e}")).in_file(name))?;
            let parts: Vec<_> = name.components().map(|part| part.as_os_str().to_string_lossy()).collect();
            Ok(Entry { path: parts.join("/"), bytes, sha256, command: command.into() })
        };
        // After a signal there is no time to read a large file again: it is there, but not on the list.
        let is_listed = |name: &&PathBuf| {
            interrupt::came().is_none() || std::fs::metadata(at.join(name)).is_ok_and(|data| data.len() <= QUICK)
        };
        // Large files take longer to hash than to write: one on each processor.
        let files = names.par_iter().filter(is_listed).map(entry).collect::<Result<_>>()?;
        Ok(Self { schema: SCHEMA.into(), version: env!("CARGO_PKG_VERSION").into(), files })
    }

    /// Takes over what other commands listed, but for what this one writes anew.
    pub fn with_others(mut self, command: &str, earlier: Self) -> Self {
        let is_new = |entry: &Entry| self.files.iter().all(|own| own.path != entry.path);
        let others: Vec<Entry> =
            earlier.files.into_iter().filter(|entry| entry.command != command && is_new(entry)).collect();
        self.files.extend(others);
        self
    }

    /// As the file holds it.
    pub fn text(&self) -> String {
        taut::json::text(self)
    }

    /// List of an earlier run in this folder; none if it does not exist or cannot be read.
    pub fn read(folder: &Path) -> Option<Self> {
        let mut text = String::new();
        File::open(folder.join(NAME)).ok()?.take(MOST_BYTES).read_to_string(&mut text).ok()?;
        serde_json::from_str(&text).ok().filter(|list: &Self| list.schema == SCHEMA)
    }

    /// Files that `command` wrote before and that are there still, but for those of these names.
    pub fn left(&self, command: &str, folder: &Path, names: &[PathBuf]) -> Left {
        let mut left = Left::default();
        for entry in self.files.iter().filter(|entry| entry.command == command) {
            let path = PathBuf::from(&entry.path);
            // A list that leads out of the folder is not one of ours.
            let inside = path.components().all(|part| matches!(part, Component::Normal(_)));
            if !inside || names.contains(&path) || path == Path::new(NAME) {
                continue;
            }
            let whole = folder.join(&path);
            if !std::fs::symlink_metadata(&whole).is_ok_and(|data| data.is_file()) {
                continue;
            }
            match fingerprint(&whole) {
                Ok((bytes, sha256)) if bytes == entry.bytes && sha256 == entry.sha256 => left.stale.push(path),
                _ => left.changed.push(path),
            }
        }
        left
    }
}

/// Length and SHA-256 of a file.
fn fingerprint(path: &Path) -> std::io::Result<(u64, String)> {
    let (mut file, mut hash, mut bytes) = (File::open(path)?, Sha256::new(), vec![0; 1 << 16]);
    let mut length = 0;
    loop {
        match file.read(&mut bytes)? {
            0 => break,
            n => {
                length += n as u64;
                hash.update(&bytes[..n]);
            }
        }
    }
    Ok((length, hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_was_written_and_is_as_it_was_goes() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        ["kept.csv", "stale.csv", "changed.csv", "gone.csv"].iter().for_each(|name| write(name, name));
        let names = ["kept.csv", "stale.csv", "changed.csv", "gone.csv"].map(PathBuf::from);
        let mut list = Listing::new("simulate", folder.path(), &names).unwrap();
        let outside =
            Entry { path: "../outside.csv".into(), bytes: 0, sha256: String::new(), command: "simulate".into() };
        list.files.push(outside);
        write(NAME, &list.text());
        write("changed.csv", "by hand");
        write("own.csv", "never listed");
        std::fs::remove_file(folder.path().join("gone.csv")).unwrap();
        let list = Listing::read(folder.path()).unwrap();
        let left = list.left("simulate", folder.path(), &["kept.csv".into()]);
        assert_eq!(left, Left { stale: vec!["stale.csv".into()], changed: vec!["changed.csv".into()] });
        // Another command leaves them all alone, and lists them still.
        assert_eq!(list.left("modes", folder.path(), &[]), Left::default());
        let both = Listing::new("modes", folder.path(), &["kept.csv".into()]).unwrap().with_others("modes", list);
        assert_eq!(both.files.iter().filter(|entry| entry.path == "kept.csv").count(), 1);
        assert_eq!(both.files.len(), 5);
    }

    #[test]
    fn without_a_list_nothing_goes() {
        let folder = tempfile::tempdir().unwrap();
        assert!(Listing::read(folder.path()).is_none());
        std::fs::write(folder.path().join(NAME), "{\"schema\": \"another\", \"version\": \"1\", \"files\": []}")
            .unwrap();
        assert!(Listing::read(folder.path()).is_none());
    }
}
