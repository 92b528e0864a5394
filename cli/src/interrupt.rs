//! Ctrl-C and a request to terminate: the first ends the run in order, the second at once (and may then leave a hidden
//! file whose name ends in `.tmp`, never half a result under its own name).

use signal_hook::consts::{SIGINT, SIGTERM};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Tells whether a signal has come.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<AtomicUsize>);

impl Interrupt {
    /// Listens from now on.
    pub fn listen() -> Self {
        let interrupt = Self::default();
        let twice = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // In this order: what the first signal sets, the second finds set. If the system refuses, the signal ends
            // the program as it always does.
            let _ = signal_hook::flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&twice));
            let _ = signal_hook::flag::register(signal, Arc::clone(&twice));
            let _ = signal_hook::flag::register_usize(signal, Arc::clone(&interrupt.0), signal as usize);
        }
        interrupt
    }

    /// The signal that came, if one did.
    pub fn signal(&self) -> Option<u8> {
        u8::try_from(self.0.load(Ordering::Relaxed)).ok().filter(|&signal| signal != 0)
    }
}
