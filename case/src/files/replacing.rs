//! Properties kept of a file that is replaced: the links that lead to it, its permissions and its owner.

use super::cannot_write;
use crate::error::{Error, Result};
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// Most links that are followed after each other, as on Linux.
const MOST_LINKS: usize = 40;

/// The file that `path` leads to by symbolic links, whether that exists or not; refuses pipes, sockets and devices,
/// which a file would take the place of.
pub(super) fn target(path: &Path) -> Result<PathBuf> {
    let mut at = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        let kind = match fs::symlink_metadata(&at) {
            Ok(data) => data.file_type(),
            // What is wrong with the path is told by the one who creates the file.
            Err(_) => return Ok(at),
        };
        if kind.is_symlink() {
            let leads_to = fs::read_link(&at).map_err(|e| cannot_write(path, &e))?;
            at = at.parent().unwrap_or(Path::new("")).join(leads_to);
        } else if kind.is_file() || kind.is_dir() {
            return Ok(at);
        } else {
            let error = Error::new("this is a pipe, a socket or a device, not a file").in_file(path);
            return Err(error.next("name a file; --json prints the result on standard output"));
        }
    }
    Err(Error::new("too many symbolic links lead to each other here").in_file(path).next("name the file itself"))
}

/// Creates the new file `path` with the permissions and the owner of `old`, if that exists; never readable for more
/// people than `old` is, at any time.
pub(super) fn like(old: &Path, path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    if let Some(kept) = Kept::read(old)? {
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, kept.mode & 0o700 | 0o600);
        let file = options.open(path)?;
        return kept.give(&file).map(|()| file);
    }
    let _ = old;
    options.open(path)
}

/// Gives the file `path` the permissions and the owner of `old`, if that exists.
pub(super) fn adopt(old: &Path, path: &Path) -> io::Result<()> {
    #[cfg(unix)]
    if let Some(kept) = Kept::read(old)? {
        return kept.give(&File::open(path)?);
    }
    let _ = (old, path, ErrorKind::NotFound);
    Ok(())
}

/// Permissions, owner and group.
#[cfg(unix)]
struct Kept {
    mode: u32,
    owner: u32,
    group: u32,
}

#[cfg(unix)]
impl Kept {
    /// Attributes of a file; none if it does not exist.
    fn read(path: &Path) -> io::Result<Option<Self>> {
        use std::os::unix::fs::MetadataExt;
        match fs::metadata(path) {
            Ok(data) if data.is_file() => {
                Ok(Some(Self { mode: data.mode() & 0o7777, owner: data.uid(), group: data.gid() }))
            }
            Ok(_) => Ok(None),
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
            Err(e) => Err(e),
        }
    }

    /// Gives them to an open file. Where this process may not give it the owner or the group, it keeps its own, without
    /// the permissions that were for the others.
    fn give(&self, file: &File) -> io::Result<()> {
        use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
        let own = file.metadata()?;
        let mut mode = self.mode;
        if own.uid() != self.owner && fchown(file, Some(self.owner), None).is_err() {
            mode &= 0o0777;
        }
        if own.gid() != self.group && fchown(file, None, Some(self.group)).is_err() {
            // The group is another one now: it gets what everybody has.
            mode = mode & 0o0707 | (mode & 0o007) << 3;
        }
        file.set_permissions(fs::Permissions::from_mode(mode))
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::super::{Batch, write_atomically};
    use super::*;
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("taut-replacing-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(folder.join("far")).unwrap();
        folder
    }

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().mode() & 0o7777
    }

    /// Saving replaced a symbolic link by a file, and a file that only its owner could read by one for everybody.
    #[test]
    fn links_permissions_and_owners_of_what_is_replaced_are_kept() {
        let folder = folder("kept");
        let at = |name: &str| folder.join(name);
        fs::write(at("far/file"), "old").unwrap();
        symlink("far/file", at("link")).unwrap();
        symlink("link", at("to-link")).unwrap();
        symlink("far/new", at("dangling")).unwrap();
        for (k, mode_) in [0o600, 0o640, 0o444, 0o755].into_iter().enumerate() {
            fs::set_permissions(at("far/file"), fs::Permissions::from_mode(mode_)).unwrap();
            // Root may give it away, others write what is theirs.
            let owner = if std::os::unix::fs::chown(at("far/file"), Some(1234), Some(4321)).is_ok() {
                1234
            } else {
                fs::metadata(at("far")).unwrap().uid()
            };
            match k % 2 {
                0 => write_atomically(at("to-link"), format!("new {k}")).unwrap(),
                _ => {
                    let batch = Batch::begin(&folder).unwrap();
                    write_atomically(batch.path("to-link"), format!("new {k}")).unwrap();
                    batch.place(&[]).unwrap();
                }
            }
            assert_eq!(fs::read_to_string(at("far/file")).unwrap(), format!("new {k}"));
            assert_eq!((mode(&at("far/file")), fs::metadata(at("far/file")).unwrap().uid()), (mode_, owner));
            assert!(["link", "to-link"].iter().all(|name| fs::symlink_metadata(at(name)).unwrap().is_symlink()));
        }
        write_atomically(at("dangling"), "new").unwrap();
        assert_eq!(fs::read_to_string(at("far/new")).unwrap(), "new");
        assert_eq!(fs::read_dir(&folder).unwrap().count() + fs::read_dir(at("far")).unwrap().count(), 4 + 2);
        fs::remove_dir_all(&folder).unwrap();
    }

    /// A device would have been replaced by a file.
    #[test]
    fn devices_and_loops_of_links_are_refused() {
        let folder = folder("refused");
        let at = |name: &str| folder.join(name);
        symlink("a", at("b")).unwrap();
        symlink("b", at("a")).unwrap();
        assert!(write_atomically(at("a"), "1").unwrap_err().what.contains("links"));
        assert!(write_atomically("/dev/null", "1").unwrap_err().what.contains("device"));
        fs::remove_dir_all(&folder).unwrap();
    }
}
