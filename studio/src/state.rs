//! The state that all connections of a server share.

use crate::guard::Keys;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use taut::case::Opened;
use taut::error::{Error, Result};
use tokio::sync::{Semaphore, watch};

/// Pages at a time; one more is refused.
const SOCKETS: usize = 128;

/// The state of a server.
pub struct State {
    /// The token that opens it.
    pub keys: Keys,
    /// The case of the command line.
    pub case: Option<CaseFile>,
    /// The threads that answer drags.
    pub pool: crate::work::pool::Pool,
    /// Long works at a time.
    pub long: Arc<AtomicUsize>,
    /// Room for pages.
    pub sockets: Arc<Semaphore>,
    /// Files that pages sent, removed in the end.
    uploads: Mutex<Option<PathBuf>>,
    /// Bytes of them.
    pub uploaded: AtomicUsize,
    ending: watch::Sender<bool>,
}

/// The case file of the command line.
pub struct CaseFile {
    /// Where it is.
    pub path: PathBuf,
    /// Its bytes as last read or saved: it is replaced only while it still holds them.
    known: Mutex<Vec<u8>>,
}

impl State {
    /// The state of a server at this port; errors: what is wrong with the case.
    pub fn new(case: Option<PathBuf>, port: u16) -> Result<Self> {
        Ok(Self {
            keys: Keys::new(port)?,
            case: case.map(CaseFile::read).transpose()?,
            pool: crate::work::pool::Pool::new(),
            long: Arc::default(),
            sockets: Arc::new(Semaphore::new(SOCKETS)),
            uploads: Mutex::default(),
            uploaded: AtomicUsize::new(0),
            ending: watch::channel(false).0,
        })
    }

    /// Tells every page that the server ends.
    pub fn end(&self) {
        let _ = self.ending.send(true);
    }

    /// Becomes true when the server ends.
    pub fn ending(&self) -> watch::Receiver<bool> {
        self.ending.subscribe()
    }

    /// Pages that are open.
    pub fn sockets_open(&self) -> usize {
        SOCKETS - self.sockets.available_permits()
    }

    /// The name that a case of the page has: it decides where relative paths in its text lead.
    pub fn name(&self) -> &Path {
        self.case.as_ref().map_or(Path::new("studio.toml"), |case| &case.path)
    }

    /// The folder of files that pages send, which others cannot read; it is made when the first one comes.
    pub fn uploads(&self) -> std::io::Result<PathBuf> {
        let mut folder = lock(&self.uploads);
        if let Some(folder) = folder.as_ref() {
            return Ok(folder.clone());
        }
        let made = std::env::temp_dir().join(format!("taut-studio-{}-{}", std::process::id(), &self.keys.token[..16]));
        let mut builder = std::fs::DirBuilder::new();
        #[cfg(unix)]
        std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
        builder.create(&made)?;
        Ok(folder.insert(made).clone())
    }

    /// Removes what was sent.
    pub fn remove_uploads(&self) {
        if let Some(folder) = lock(&self.uploads).take() {
            let _ = std::fs::remove_dir_all(folder);
        }
    }

    /// Takes a place for long work, of which there are as many as processors; none where all are taken.
    pub fn begin_long(&self) -> Option<Place> {
        let most = std::thread::available_parallelism().map_or(2, usize::from).max(2);
        let taken = self.long.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| (n < most).then_some(n + 1));
        taken.ok().map(|_| Place(Arc::clone(&self.long)))
    }
}

/// The place of a long work; dropped, it is free again.
pub struct Place(Arc<AtomicUsize>);

impl Drop for Place {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// A value is as whole after a panic of another thread as before: each lock guards one.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl CaseFile {
    fn read(path: PathBuf) -> Result<Self> {
        // Mistakes in it are shown at their line on the page; a file that is no text at all is told now.
        match Opened::read_with(&path, &[]) {
            Err(error) if error.place.as_ref().is_none_or(|place| place.span.is_none()) => return Err(error),
            _ => {}
        }
        let bytes = std::fs::read(&path).map_err(|e| Error::new(format!("it cannot be read: {e}")).in_file(&path))?;
        Ok(Self { path, known: Mutex::new(bytes) })
    }

    /// Its text as last read or saved.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&lock(&self.known)).into_owned()
    }

    /// Writes it whole, unless somebody else changed it meanwhile.
    pub fn save(&self, text: &str) -> Result<()> {
        let mut known = lock(&self.known);
        let now = std::fs::read(&self.path).ok();
        if now.as_ref() != Some(&*known) {
            let what = match now {
                Some(_) => "this file was changed by something else since it was opened, and nothing was written",
                None => "this file is not there any more, and nothing was written",
            };
            let next = "download the text, compare the two, and start the studio again with the one that counts";
            return Err(Error::new(what).in_file(&self.path).next(next));
        }
        taut::files::write_atomically(&self.path, text)?;
        *known = text.as_bytes().to_vec();
        Ok(())
    }
}
