//! Ctrl-C while the interpreter waits for Rust.

use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

/// How long Ctrl-C may wait, ms.
const PATIENCE: u64 = 50;

/// Asks Python now and then whether a signal has come; safe to share with the threads of a long work.
pub struct Interrupt {
    begin: Instant,
    asked: AtomicU64,
    stopped: AtomicBool,
    /// True if a thread asks by itself, and nobody else need.
    watched: AtomicBool,
    raised: Mutex<Option<PyErr>>,
}

impl Interrupt {
    /// Begins to listen.
    pub fn listen() -> Self {
        Self {
            begin: Instant::now(),
            asked: AtomicU64::new(0),
            stopped: AtomicBool::new(false),
            watched: AtomicBool::new(false),
            raised: Mutex::new(None),
        }
    }

    /// True if to stop.
    pub fn stop(&self) -> bool {
        if self.stopped.load(Ordering::Relaxed) || self.watched.load(Ordering::Relaxed) {
            return self.stopped.load(Ordering::Relaxed);
        }
        let now = self.begin.elapsed().as_millis() as u64;
        if now < self.asked.load(Ordering::Relaxed) + PATIENCE {
            return false;
        }
        self.asked.store(now, Ordering::Relaxed);
        self.ask();
        self.stopped.load(Ordering::Relaxed)
    }

    fn ask(&self) {
        if let Err(signal) = Python::attach(|py| py.check_signals()) {
            self.raise(signal);
        }
    }

    /// Does `work`, which has threads of its own, on one more thread: Python tells signals to the calling one alone,
    /// which listens meanwhile.
    pub fn beside<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        let (done, wait) = std::sync::mpsc::channel();
        // Another thread that asked would be told of no signal, and keep this one from asking.
        self.watched.store(true, Ordering::Relaxed);
        let result = std::thread::scope(|scope| {
            scope.spawn(move || {
                // The receiver waits until it has come.
                let _ = done.send(catch_unwind(AssertUnwindSafe(work)));
            });
            loop {
                match wait.recv_timeout(Duration::from_millis(PATIENCE)) {
                    Ok(result) => break result,
                    Err(RecvTimeoutError::Timeout) => self.ask(),
                    Err(RecvTimeoutError::Disconnected) => break Err(Box::new("the work has ended without a result")),
                }
            }
        });
        self.watched.store(false, Ordering::Relaxed);
        // A panic goes on where it would have gone without a thread between.
        result.unwrap_or_else(|panic| resume_unwind(panic))
    }

    /// Stops with this exception.
    pub fn raise(&self, exception: PyErr) {
        if let Ok(mut raised) = self.raised.lock() {
            raised.get_or_insert(exception);
        }
        self.stopped.store(true, Ordering::Relaxed);
    }

    /// The exception, if one came.
    pub fn finish(self) -> PyResult<()> {
        match self.raised.into_inner() {
            Ok(Some(exception)) => Err(exception),
            _ => Ok(()),
        }
    }
}
