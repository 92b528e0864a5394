//! The state that all connections of a server share.

use crate::keys::Keys;
use crate::pool::{Pool, lock};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;
use taut::case::{Case, Files};
use taut::error::{Error, Result};
use taut_acts::Host;
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
    pub pool: Pool,
    /// Long works at a time.
    pub long: Arc<AtomicUsize>,
    /// Room for pages.
    pub sockets: Arc<Semaphore>,
    /// Files that pages sent, removed in the end.
    uploads: Mutex<Option<PathBuf>>,
    /// Bytes of them, and of those that are on their way.
    uploaded: AtomicUsize,
    ending: watch::Sender<bool>,
    begun: Instant,
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
            pool: Pool::new(),
            long: Arc::default(),
            sockets: Arc::new(Semaphore::new(SOCKETS)),
            uploads: Mutex::default(),
            uploaded: AtomicUsize::new(0),
            ending: watch::channel(false).0,
            begun: Instant::now(),
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

    /// Takes room for a file of so many bytes before they are received; none where all files together would have more
    /// than `most`.
    pub fn room(self: &Arc<Self>, bytes: usize, most: usize) -> Option<UploadReservation> {
        let add = |n: usize| n.checked_add(bytes).filter(|sum| *sum <= most);
        let taken = self.uploaded.fetch_update(Ordering::Relaxed, Ordering::Relaxed, add);
        taken.ok().map(|_| UploadReservation { state: Arc::clone(self), bytes })
    }

    /// Takes a place for long work, of which there are as many as processors; none where all are taken.
    pub fn begin_long(&self) -> Option<JobSlot> {
        let most = std::thread::available_parallelism().map_or(2, usize::from).max(2);
        let taken = self.long.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| (n < most).then_some(n + 1));
        taken.ok().map(|_| JobSlot(Arc::clone(&self.long)))
    }
}

impl Host for State {
    fn seconds(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    fn threads(&self) -> usize {
        std::thread::available_parallelism().map_or(2, usize::from).clamp(1, 16)
    }

    fn name(&self) -> &Path {
        self.case.as_ref().map_or(Path::new(taut_acts::NAME), |case| &case.path)
    }

    fn opened(&self) -> Option<(&Path, String)> {
        self.case.as_ref().map(|case| (&*case.path, case.text()))
    }

    fn save(&self, text: &str) -> Result<PathBuf> {
        let Some(case) = &self.case else {
            let error = Error::new("no case was named on the command line, and the page writes no other file");
            return Err(error.next("download the text instead, or start with `taut studio CASE`"));
        };
        case.save(text)?;
        Ok(case.path.clone())
    }

    fn sent(&self, path: &str) -> Result<PathBuf> {
        let folder = self.uploads().ok().and_then(|folder| folder.canonicalize().ok());
        let file = Path::new(path).canonicalize().ok();
        match (folder, file) {
            (Some(folder), Some(file)) if file.starts_with(&folder) => Ok(file),
            _ => Err(taut_acts::sent::unknown()),
        }
    }
}

/// Room for a file that is on its way; dropped, it is free again.
pub struct UploadReservation {
    state: Arc<State>,
    bytes: usize,
}

impl UploadReservation {
    /// Takes it for good, for a file that turned out to have so many bytes.
    pub fn keep(mut self, bytes: usize) {
        self.bytes -= bytes.min(self.bytes);
    }
}

impl Drop for UploadReservation {
    fn drop(&mut self) {
        self.state.uploaded.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

/// The place of a long work; dropped, it is free again.
pub struct JobSlot(Arc<AtomicUsize>);

impl Drop for JobSlot {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

impl CaseFile {
    fn read(path: PathBuf) -> Result<Self> {
        // Mistakes in it are shown at their line on the page; a file that is no text at all is told now.
        match Case::read_for(&path, &[], Files::Nothing) {
            Err(error) if error.place.as_ref().is_none_or(|place| place.span.is_none()) => return Err(error),
            _ => {}
        }
        let bytes = taut::files::read(&path, taut::case::LARGEST_FILE)
            .map_err(|e| Error::new(format!("it cannot be read: {e}")).in_file(&path))?;
        Ok(Self { path, known: Mutex::new(bytes) })
    }

    /// Its text as last read or saved.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&lock(&self.known)).into_owned()
    }

    /// Writes it whole, unless somebody else changed it meanwhile.
    pub fn save(&self, text: &str) -> Result<()> {
        let mut known = lock(&self.known);
        // Nobody else saves between the look and the writing, nor tunes this file in place.
        let _claim = taut::files::Claim::file(&self.path)?;
        let now = taut::files::read(&self.path, usize::MAX).ok();
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
