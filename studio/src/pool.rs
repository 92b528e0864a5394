//! The threads that do quick works.

use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

type Work = Box<dyn FnOnce() + Send>;

/// Threads that take works in turn. There are no more works than pages.
pub struct Pool {
    works: Mutex<Sender<Work>>,
}

impl Pool {
    /// One thread for each processor, at least two.
    pub fn new() -> Self {
        let (works, next) = channel::<Work>();
        let next = Arc::new(Mutex::new(next));
        let threads = std::thread::available_parallelism().map_or(2, usize::from).clamp(2, 8);
        for _ in 0..threads {
            let next = Arc::clone(&next);
            std::thread::spawn(move || {
                loop {
                    let work = lock(&next).recv();
                    let Ok(work) = work else { return };
                    work();
                }
            });
        }
        Self { works: Mutex::new(works) }
    }

    /// Has a work done.
    pub fn add(&self, work: Work) {
        // All threads live as long as the pool.
        let _ = lock(&self.works).send(work);
    }
}

/// A value is as whole after a panic of another thread as before: each lock guards one.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
