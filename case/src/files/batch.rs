//! Files that belong together: written in a hidden folder, and given their places one right after the other.

use super::{Draft, cannot_write, replacing, target, temporary, unfinished, write_atomically};
use crate::error::{Error, Result};
use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// The file that stands in a folder while its results are being replaced; what ends then leaves it there.
pub const MARKER: &str = "unfinished.txt";

const MARKED: &str = "\
taut was interrupted while it replaced the results in this folder: some of the files are new, and some may be from an
earlier run. Run the same command again; this file disappears once all files are in place.
";

/// Files that are being written for one folder. Dropped before [`Batch::place`], they are removed, and what stands in
/// the folder still stands.
///
/// They lie in a hidden folder `.K.taut.tmp` within it, locked as long as the program runs: the next batch for the
/// folder removes what a killed program left.
#[derive(Debug)]
pub struct Batch {
    root: PathBuf,
    hidden: PathBuf,
    /// Holds the lock.
    _open: File,
}

impl Batch {
    /// Begins files for the folder `root`, which exists.
    pub fn begin(root: &Path) -> Result<Self> {
        let name = |k: usize| root.join(format!(".{k}{}", unfinished::ENDING));
        let (hidden, open) = temporary::claim(name, create).map_err(|e| cannot_write(root, &e))?;
        Ok(Self { root: root.to_path_buf(), hidden, _open: open })
    }

    /// Where the file `name` is to be written now; `name` may lead through folders, which are made there first.
    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.hidden.join(name)
    }

    /// The files that are whole, as paths from the folder on, sorted.
    pub fn names(&self) -> Result<Vec<PathBuf>> {
        let mut names = Vec::new();
        list(&self.hidden, Path::new(""), &mut names).map_err(|e| cannot_write(&self.root, &e))?;
        names.sort();
        Ok(names)
    }

    /// Gives all files their places, and removes `stale` ones that stand in the folder, with a marker beside them
    /// meanwhile.
    pub fn place(&self, stale: &[PathBuf]) -> Result<()> {
        let _placing = unfinished::placing();
        let names = self.names()?;
        let places: Vec<PathBuf> = names.iter().map(|name| self.root.join(name)).collect();
        if let Some(taken) = places.iter().find(|place| place.is_dir()) {
            return Err(cannot_write(taken, &ErrorKind::IsADirectory.into()));
        }
        let marker = self.root.join(MARKER);
        write_atomically(&marker, MARKED)?;
        for (name, to) in names.iter().zip(&places) {
            if let Some(folder) = to.parent() {
                fs::create_dir_all(folder).map_err(|e| {
                    let error = Error::new(format!("this folder cannot be made: {e}")).in_file(folder);
                    error.next("remove what has its name")
                })?;
            }
            put(&self.hidden.join(name), to, &target(to)?).map_err(|e| cannot_write(to, &e))?;
        }
        for path in stale.iter().map(|name| self.root.join(name)) {
            match fs::remove_file(&path) {
                Err(e) if e.kind() != ErrorKind::NotFound => return Err(cannot_write(&path, &e)),
                _ => {}
            }
            // A folder that is empty now goes, too; one that is not says so and stays.
            let _ = path.parent().filter(|parent| *parent != self.root).map(fs::remove_dir);
        }
        fs::remove_file(&marker).map_err(|e| cannot_write(&marker, &e))
    }
}

impl Drop for Batch {
    fn drop(&mut self) {
        let _ = unfinished::complete(&self.hidden, || fs::remove_dir_all(&self.hidden));
    }
}

/// A path as it is told to people: without the hidden folder that its file is written in.
pub fn shown(path: &Path) -> PathBuf {
    let hidden = |part: &OsStr| {
        let digits = part.to_str().and_then(|part| part.strip_prefix('.')?.strip_suffix(unfinished::ENDING));
        digits.is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()))
    };
    path.components().filter(|part| !hidden(part.as_os_str())).collect()
}

/// Makes the hidden folder and opens it, to be locked.
#[cfg(unix)]
fn create(path: &Path) -> io::Result<File> {
    fs::create_dir(path)?;
    File::open(path)
}

/// Folders cannot be opened here: a file in it is locked, and what a killed program leaves stays.
#[cfg(not(unix))]
fn create(path: &Path) -> io::Result<File> {
    fs::create_dir(path)?;
    File::create(path.join(format!(".lock{}", unfinished::ENDING)))
}

fn list(folder: &Path, below: &Path, names: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let below = below.join(&name);
        if entry.file_type()?.is_dir() {
            list(&entry.path(), &below, names)?;
        } else if !name.to_string_lossy().ends_with(unfinished::ENDING) {
            names.push(below);
        }
    }
    Ok(())
}

/// Renames to the file `target` that `to` leads to; where that is on another disk, behind a link, copies.
fn put(from: &Path, to: &Path, target: &Path) -> io::Result<()> {
    replacing::adopt(target, from)?;
    match fs::rename(from, target) {
        Err(e) if e.kind() == ErrorKind::CrossesDevices => copy(from, to),
        renamed => renamed,
    }
}

fn copy(from: &Path, to: &Path) -> io::Result<()> {
    let other = |error: Error| io::Error::other(error.what);
    let mut draft = Draft::create(to).map_err(other)?;
    let (mut input, mut bytes) = (File::open(from)?, vec![0; 1 << 20]);
    loop {
        match input.read(&mut bytes)? {
            0 => return draft.finish().map_err(other),
            n => draft.write(&bytes[..n]).map_err(other)?,
        }
    }
}
