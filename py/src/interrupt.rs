//! Ctrl-C while the interpreter waits for Rust.

use pyo3::prelude::*;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

/// How long Ctrl-C may wait, ms.
const PATIENCE: u64 = 50;

/// Asks Python now and then whether a signal has come; safe to share with the threads of a long work.
pub struct Interrupt {
    begin: Instant,
    asked: AtomicU64,
    stopped: AtomicBool,
    raised: Mutex<Option<PyErr>>,
}

impl Interrupt {
    /// Begins to listen.
    pub fn listen() -> Self {
        Self {
            begin: Instant::now(),
            asked: AtomicU64::new(0),
            stopped: AtomicBool::new(false),
            raised: Mutex::new(None),
        }
    }

    /// Whether to stop.
    pub fn stop(&self) -> bool {
        if self.stopped.load(Ordering::Relaxed) {
            return true;
        }
        let now = self.begin.elapsed().as_millis() as u64;
        if now < self.asked.load(Ordering::Relaxed) + PATIENCE {
            return false;
        }
        self.asked.store(now, Ordering::Relaxed);
        if let Err(signal) = Python::attach(|py| py.check_signals()) {
            self.raise(signal);
        }
        self.stopped.load(Ordering::Relaxed)
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
