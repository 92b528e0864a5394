//! Claims of names: of two programs that would write the same result, the second is refused before it does any work.

use super::{cannot_write, target, temporary, unfinished};
use crate::error::Error;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How the names of locks end; they begin with a point.
const ENDING: &str = ".taut.lock";

/// How often a name that is taken is tried again, and after which time: whoever looks whether a lock is held has it for
/// a moment.
const TRIES: u32 = 10;
const PAUSE: Duration = Duration::from_millis(10);

/// Most bytes that are read of a lock.
const MOST_BYTES: u64 = 1 << 20;

/// Names of results that only this process may write, until it is dropped.
///
/// The lock of a file is `.NAME.taut.lock` beside it, that of a folder `.taut.lock` in it. Each holds the number of the
/// process and its command line, and is locked by the operating system, so that a process that was killed claims
/// nothing. Links and relative paths lead to the same lock. A folder and a file in it that the folder's owner will
/// write exclude each other.
#[derive(Debug, Default)]
pub struct Claim {
    locks: Vec<Lock>,
    /// Folders that were made for this claim; those that are empty in the end are removed.
    made: Vec<PathBuf>,
    /// Why names could not be locked, on a file system without locks.
    unlocked: Option<String>,
}

#[derive(Debug)]
struct Lock {
    path: PathBuf,
    /// Holds the lock.
    _file: File,
}

/// Why a name could not be claimed.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Refusal {
    /// The error for the person who named it.
    pub error: Error,
    /// True if another name has to be given; false if the same name may be had later.
    pub is_name_wrong: bool,
}

impl From<Refusal> for Error {
    fn from(refusal: Refusal) -> Self {
        refusal.error
    }
}

/// The owner that a lock names.
#[derive(Default)]
struct Owner {
    process: Option<u32>,
    host: String,
    command: String,
    /// Files of a folder that the owner will write; none if it cannot be told.
    names: Option<Vec<String>>,
}

impl Claim {
    /// Claims a file; its folder exists.
    pub fn file(path: impl AsRef<Path>) -> Result<Self, Refusal> {
        let mut claim = Self::default();
        claim.add(path)?;
        Ok(claim)
    }

    /// Claims one more file; one that it has already it keeps.
    pub fn add(&mut self, path: impl AsRef<Path>) -> Result<(), Refusal> {
        let shown = path.as_ref();
        let path = target(shown).map_err(wrong)?;
        let name = path.file_name().ok_or_else(|| wrong(cannot_write(shown, &ErrorKind::IsADirectory.into())))?;
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        // The whole path of the folder, so that the lock is found again whatever becomes of links.
        let folder = fs::canonicalize(folder).map_err(|e| refused(shown, &e))?;
        let lock = folder.join(temporary::hidden(name, ENDING));
        if self.locks.iter().any(|own| own.path == lock) {
            return Ok(());
        }
        self.lock(lock, shown, &[])?;
        // Whoever has the folder may be about to write this very file.
        let own = |owner: &Owner| {
            owner.names.as_ref().is_none_or(|names| names.iter().any(|one| one == &*name.to_string_lossy()))
        };
        match held(&folder.join(ENDING)) {
            Some(owner) if own(&owner) => Err(taken(shown, &owner)),
            _ => Ok(()),
        }
    }

    /// Claims a folder, which is made if it is not there; `names` are files that will be written in it.
    pub fn folder(path: impl AsRef<Path>, names: &[String]) -> Result<Self, Refusal> {
        let (mut claim, shown) = (Self::default(), path.as_ref());
        for attempt in 0.. {
            claim.make(shown)?;
            let locked = fs::canonicalize(shown)
                .map_err(|e| refused(shown, &e))
                .and_then(|folder| claim.lock(folder.join(ENDING), shown, names).map(|()| folder));
            match locked {
                Ok(folder) => {
                    let lock = |name: &String| folder.join(temporary::hidden(name.as_ref(), ENDING));
                    let other = names
                        .iter()
                        .filter(|name| !name.contains('/'))
                        .find_map(|name| Some((name, held(&lock(name))?)));
                    return other.map_or(Ok(claim), |(name, owner)| Err(taken(&shown.join(name), &owner)));
                }
                // Whoever made it has just removed it, for nothing was written into it.
                Err(_) if !shown.exists() && attempt < TRIES => {}
                Err(refusal) => return Err(refusal),
            }
        }
        unreachable!("the loop ends by returning")
    }

    /// Why other programs cannot be kept from writing here, if they cannot.
    pub fn unlocked(&self) -> Option<&str> {
        self.unlocked.as_deref()
    }

    fn make(&mut self, folder: &Path) -> Result<(), Refusal> {
        let missing: Vec<&Path> =
            folder.ancestors().filter(|path| !path.as_os_str().is_empty()).take_while(|path| !path.exists()).collect();
        fs::create_dir_all(folder).map_err(|e| {
            let what = match folder.is_file() {
                true => "this is a file, not a folder".into(),
                false => format!("this folder cannot be made: {e}"),
            };
            let error = Error::new(what).in_file(folder).next("name a folder that you may write to");
            Refusal { error, is_name_wrong: is_name_wrong(&e) }
        })?;
        for path in missing.into_iter().rev() {
            unfinished::add(path);
            self.made.push(path.to_path_buf());
        }
        Ok(())
    }

    /// Takes the lock `path` of the result `shown`.
    fn lock(&mut self, path: PathBuf, shown: &Path, names: &[String]) -> Result<(), Refusal> {
        self.lock_by(path, shown, names, File::try_lock)
    }

    fn lock_by(
        &mut self,
        path: PathBuf,
        shown: &Path,
        names: &[String],
        try_lock: impl Fn(&File) -> Result<(), TryLockError>,
    ) -> Result<(), Refusal> {
        for attempt in 0.. {
            let mut options = OpenOptions::new();
            let mut file = options
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .open(&path)
                .map_err(|e| refused(shown, &e))?;
            match try_lock(&file) {
                Ok(()) if temporary::stands_at(&path, &file) => {}
                // Removed by whoever had it until now.
                Ok(()) => continue,
                Err(TryLockError::WouldBlock) if attempt < TRIES => {
                    std::thread::sleep(PAUSE);
                    continue;
                }
                Err(TryLockError::WouldBlock) => return Err(taken(shown, &Owner::read(&file))),
                Err(TryLockError::Error(e)) => {
                    self.unlocked = Some(format!(
                        "{}: this file system has no locks ({e}): make sure that no other taut writes here at the same \
                         time",
                        shown.display()
                    ));
                    let _ = fs::remove_file(&path);
                    return Ok(());
                }
            }
            unfinished::add(&path);
            let written = file.set_len(0).and_then(|()| file.write_all(Owner::own(names).as_bytes()));
            self.locks.push(Lock { path, _file: file });
            return written.map_err(|e| refused(shown, &e));
        }
        unreachable!("the loop ends by returning")
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // Removed before it is closed: who opens it from now on makes another.
        for lock in &self.locks {
            let _ = unfinished::complete(&lock.path, || fs::remove_file(&lock.path));
        }
        for folder in self.made.iter().rev() {
            let _ = unfinished::complete(folder, || fs::remove_dir(folder));
        }
    }
}

impl Owner {
    /// The text of this process' lock.
    fn own(names: &[String]) -> String {
        let command: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().replace('\n', " ")).collect();
        let mut text = format!("{}\n{}\n{}\n", std::process::id(), host(), command.join(" "));
        names.iter().for_each(|name| text.extend([name, "\n"]));
        text
    }

    fn read(mut file: &File) -> Self {
        let mut text = String::new();
        let read = file.seek(SeekFrom::Start(0)).and_then(|_| file.take(MOST_BYTES).read_to_string(&mut text));
        let mut lines = text.lines();
        let Some(process) = lines.next().and_then(|line| line.parse().ok()).filter(|_| read.is_ok()) else {
            return Self::default();
        };
        let (host, command) = (lines.next().unwrap_or_default().into(), lines.next().unwrap_or_default().into());
        Self { process: Some(process), host, command, names: Some(lines.map(str::to_string).collect()) }
    }
}

/// The owner of a lock, if it is held by a running process.
fn held(path: &Path) -> Option<Owner> {
    let file = File::open(path).ok()?;
    for attempt in 0.. {
        match file.try_lock_shared() {
            Err(TryLockError::WouldBlock) if attempt < TRIES && temporary::stands_at(path, &file) => {
                std::thread::sleep(PAUSE)
            }
            Err(TryLockError::WouldBlock) if temporary::stands_at(path, &file) => return Some(Owner::read(&file)),
            _ => return None,
        }
    }
    None
}

/// The name of this computer, where it is known without asking a library.
fn host() -> String {
    fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default().trim().to_string()
}

fn taken(shown: &Path, owner: &Owner) -> Refusal {
    let who = match owner.process {
        Some(process) if process == std::process::id() && owner.host == host() => "this program".to_string(),
        Some(process) => {
            let place = if owner.host == host() { String::new() } else { format!(" on {}", owner.host) };
            format!("process {process}{place} (`{}`)", owner.command)
        }
        None => "another program".to_string(),
    };
    let next = "wait until it is done, end it, or name another place for this result";
    Refusal {
        error: Error::new(format!("{who} is writing this result; nothing was done")).in_file(shown).next(next),
        is_name_wrong: false,
    }
}

fn wrong(error: Error) -> Refusal {
    Refusal { error, is_name_wrong: true }
}

fn refused(shown: &Path, e: &io::Error) -> Refusal {
    Refusal { error: cannot_write(shown, e), is_name_wrong: is_name_wrong(e) }
}

/// True if another name would help; a full disk may have space later.
fn is_name_wrong(e: &io::Error) -> bool {
    !matches!(e.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge)
}

#[cfg(all(test, unix))]
mod tests {
    use super::super::tests::{self as in_tests, names};
    use super::*;
    use std::os::unix::fs::symlink;

    fn folder(name: &str) -> PathBuf {
        let folder = in_tests::folder(&format!("claim-{name}"));
        fs::create_dir(folder.join("far")).unwrap();
        folder
    }

    /// Two sweeps into one file mixed their rows.
    #[test]
    fn a_name_is_had_once_by_whatever_way_one_comes_to_it() {
        let folder = folder("ways");
        let at = |name: &str| folder.join(name);
        symlink("rows.csv", at("link.csv")).unwrap();
        symlink("..", at("far/up")).unwrap();
        symlink(&folder, at("here")).unwrap();
        let ways = ["rows.csv", "link.csv", "./rows.csv", "far/../rows.csv", "far/up/rows.csv", "here/here/link.csv"];
        for first in ways {
            let claim = Claim::file(at(first)).unwrap();
            for second in ways {
                let refusal = Claim::file(at(second)).unwrap_err();
                assert!(!refusal.is_name_wrong);
                let told = refusal.error.to_string();
                assert!(told.contains("this program is writing this result") && told.contains("next: wait"), "{told}");
            }
            assert!(Claim::file(at("other.csv")).is_ok() && Claim::file(at("far/rows.csv")).is_ok());
            drop(claim);
        }
        let claim = Claim::folder(at("far/up/new"), &[]).unwrap();
        assert!(Claim::folder(at("here/new"), &[]).is_err());
        drop(claim);
        assert_eq!(names(&folder), ["far", "here", "link.csv"]);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_folder_and_a_file_that_is_written_in_it_exclude_each_other() {
        let folder = folder("both");
        let rows = ["rows.csv".to_string()];
        let whole = Claim::folder(&folder, &rows).unwrap();
        assert!(Claim::file(folder.join("rows.csv")).is_err());
        assert!(Claim::file(folder.join("notes.csv")).is_ok());
        drop(whole);
        let file = Claim::file(folder.join("rows.csv")).unwrap();
        assert!(Claim::folder(&folder, &rows).unwrap_err().error.to_string().contains("rows.csv"));
        assert!(Claim::folder(&folder, &["other.csv".to_string()]).is_ok());
        drop(file);
        assert!(Claim::folder(&folder, &rows).is_ok());
        fs::remove_dir_all(&folder).unwrap();
    }

    /// A lock that nobody holds is what a killed program leaves.
    #[test]
    fn a_killed_owner_claims_nothing() {
        let folder = folder("killed");
        fs::write(folder.join(".rows.csv.taut.lock"), "1\nhost\ntaut sweep\n").unwrap();
        fs::write(folder.join(ENDING), "1\nhost\ntaut sweep\nrows.csv\n").unwrap();
        let claim = Claim::file(folder.join("rows.csv")).unwrap();
        let text = fs::read_to_string(folder.join(".rows.csv.taut.lock")).unwrap();
        assert!(text.starts_with(&format!("{}\n", std::process::id())), "{text}");
        drop(claim);
        drop(Claim::folder(&folder, &["rows.csv".to_string()]).unwrap());
        assert_eq!(names(&folder), ["far"]);
        fs::remove_dir_all(&folder).unwrap();
    }

    /// Of many threads that begin at once, again and again, never two have a name; and each gets it in the end.
    #[test]
    fn of_many_at_once_one_has_the_name() {
        use std::sync::atomic::{AtomicUsize, Ordering};
        let folder = folder("many");
        let (owners, had) = (AtomicUsize::new(0), AtomicUsize::new(0));
        std::thread::scope(|scope| {
            for k in 0..8 {
                let (folder, owners, had) = (&folder, &owners, &had);
                scope.spawn(move || {
                    let mut own = 0;
                    while own < 5 {
                        let claim = match k % 2 {
                            0 => Claim::file(folder.join("far/../rows.csv")),
                            _ => Claim::folder(folder.join("new"), &["rows.csv".into()]),
                        };
                        // Files and folders are counted apart.
                        let Ok(claim) = claim else { continue };
                        let one = if k % 2 == 0 { 1 } else { 1 << 16 };
                        let before = owners.fetch_add(one, Ordering::SeqCst);
                        assert_eq!(before & if k % 2 == 0 { 0xffff } else { !0xffff }, 0);
                        std::thread::sleep(Duration::from_millis(2));
                        owners.fetch_sub(one, Ordering::SeqCst);
                        drop(claim);
                        own += 1;
                        had.fetch_add(1, Ordering::SeqCst);
                    }
                });
            }
        });
        assert_eq!(had.into_inner(), 40);
        assert_eq!(names(&folder), ["far"]);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_file_system_without_locks_is_told() {
        let folder = folder("none");
        let mut claim = Claim::default();
        let none = |_: &File| Err(TryLockError::Error(ErrorKind::Unsupported.into()));
        claim.lock_by(folder.join(".rows.csv.taut.lock"), &folder.join("rows.csv"), &[], none).unwrap();
        assert!(claim.unlocked().unwrap().contains("has no locks"), "{claim:?}");
        assert_eq!(names(&folder), ["far"]);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_place_that_is_not_there_is_a_wrong_name() {
        let folder = folder("wrong");
        assert!(Claim::file(folder.join("none/rows.csv")).unwrap_err().is_name_wrong);
        fs::write(folder.join("file"), "").unwrap();
        assert!(Claim::folder(folder.join("file"), &[]).unwrap_err().error.what.contains("this is a file"));
        assert!(Claim::file(folder.join("file/rows.csv")).unwrap_err().is_name_wrong);
        fs::remove_dir_all(&folder).unwrap();
    }
}
