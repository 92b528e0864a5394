//! Ctrl-C and requests to terminate: one flag that all work looks at, and one thread that ends the program within a
//! second whatever it is doing.
//!
//! A command that keeps what there is calls [`Interrupt::listen`] and has [`GRACE`] from the first signal on; any other
//! ends at once, as does every command at a second signal. Ending removes the temporary files and locks of the program:
//! each result is as it was before or as it will be. Signals that are ignored when the program starts (under `nohup`,
//! in the background of a script) stay ignored.

use crate::failure::Failure;
use crate::terminal;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;
use taut::Error;

/// Time from a signal to the end of a command that keeps what there is.
const GRACE: Duration = Duration::from_millis(600);

/// The signal that came; 0 as long as none has.
static CAME: AtomicUsize = AtomicUsize::new(0);

/// True once the command looks at the flag.
static IS_HEEDED: AtomicBool = AtomicBool::new(false);

/// True once the results have their places.
static IS_WRITTEN: AtomicBool = AtomicBool::new(false);

/// True once the program has ended by itself, or is being ended.
static IS_ENDED: AtomicBool = AtomicBool::new(false);

/// A command that ends in order when a signal comes.
#[derive(Debug, Clone)]
pub struct Interrupt(());

impl Interrupt {
    /// From now on a signal sets the flag, and the command has some time to keep what there is.
    pub fn listen() -> Self {
        IS_HEEDED.store(true, Ordering::SeqCst);
        Self(())
    }

    /// The signal that came, if one did.
    pub fn signal(&self) -> Option<u8> {
        came()
    }
}

/// The signal that came, if one did.
pub fn came() -> Option<u8> {
    u8::try_from(CAME.load(Ordering::Relaxed)).ok().filter(|&signal| signal != 0)
}

/// Signals that end the program.
#[cfg(unix)]
const SIGNALS: [i32; 3] = [libc::SIGINT, libc::SIGTERM, libc::SIGHUP];

/// Signals that were ignored when the program started.
#[cfg(unix)]
pub fn ignored() -> Vec<i32> {
    SIGNALS.into_iter().filter(|&signal| is_ignored(signal)).collect()
}

#[cfg(not(unix))]
pub fn ignored() -> Vec<i32> {
    Vec::new()
}

/// Starts the thread that waits for signals; `json` for errors as JSON. If it cannot be started, signals keep their
/// default actions.
#[cfg(unix)]
pub fn watch(json: bool) {
    use signal_hook::iterator::Signals;

    let ignored = ignored();
    let signals: Vec<i32> = SIGNALS.into_iter().filter(|signal| !ignored.contains(signal)).collect();
    let (ready, wait) = std::sync::mpsc::channel();
    let thread = std::thread::Builder::new().name("signals".into()).spawn(move || {
        let signals = Signals::new(signals);
        let _ = ready.send(());
        let Ok(mut signals) = signals else { return };
        for signal in signals.forever() {
            let first = CAME.compare_exchange(0, signal as usize, Ordering::SeqCst, Ordering::SeqCst).is_ok();
            if !first || !IS_HEEDED.load(Ordering::SeqCst) {
                end(signal, json);
            }
            let later = move || {
                std::thread::sleep(GRACE);
                end(signal, json);
            };
            if std::thread::Builder::new().spawn(later).is_err() {
                end(signal, json);
            }
        }
    });
    if thread.is_ok() {
        let _ = wait.recv();
    }
}

/// Elsewhere the first signal sets the flag, and the second ends the program at once.
#[cfg(not(unix))]
pub fn watch(_json: bool) {
    use signal_hook::consts::{SIGINT, SIGTERM};
    for signal in [SIGINT, SIGTERM] {
        // SAFETY: an atomic is all that the handler uses, and `exit` is made for handlers.
        let first = move || {
            let is_first = CAME.compare_exchange(0, signal as usize, Ordering::SeqCst, Ordering::SeqCst).is_ok();
            if !is_first || !IS_HEEDED.load(Ordering::SeqCst) {
                signal_hook::low_level::exit(128 + signal);
            }
        };
        let _ = unsafe { signal_hook::low_level::register(signal, first) };
    }
}

/// Writing beyond a limit on the size of files is an error like any other, and not the end without a word.
#[cfg(unix)]
pub fn outlive_file_limits() {
    let flag = std::sync::Arc::new(AtomicBool::new(false));
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, flag);
}

#[cfg(not(unix))]
pub fn outlive_file_limits() {}

/// The results have their places; they stay there if a signal ends the program while it prints.
pub fn written() {
    IS_WRITTEN.store(true, Ordering::SeqCst);
}

/// The program ends by itself: from now on a signal does not end it otherwise. False if it is being ended already.
pub fn finish() -> bool {
    !IS_ENDED.swap(true, Ordering::SeqCst)
}

/// Ends the program now; every result stays as it is.
#[cfg(unix)]
fn end(signal: i32, json: bool) {
    if IS_ENDED.swap(true, Ordering::SeqCst) {
        return;
    }
    taut::files::abandon();
    let told = match IS_WRITTEN.load(Ordering::SeqCst) {
        true => "interrupted; the results are written",
        false => "interrupted; nothing was written",
    };
    let failure = interrupted(signal as u8, told);
    terminal::clear_line();
    if json && !terminal::has_shown() {
        terminal::show(&failure.json());
    }
    terminal::show_error(&failure.error);
    signal_hook::low_level::exit(128 + signal);
}

/// The end of a command that a signal ended before there was a result.
pub fn interrupted(signal: u8, told: &str) -> Failure {
    Failure { error: Error::new(told), status: 128_u8.saturating_add(signal) }
}

/// The end of a command that failed: if a signal came before, that is why its input seems wrong.
pub fn explained(mut failure: Failure) -> Failure {
    match came() {
        Some(signal) if failure.status == 2 => interrupted(signal, "interrupted; nothing was written"),
        Some(signal) if failure.status == 1 => {
            failure.status = 128_u8.saturating_add(signal);
            failure
        }
        _ => failure,
    }
}

/// True if the program was started with this signal ignored.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let mut action = std::mem::MaybeUninit::<libc::sigaction>::zeroed();
    // SAFETY: with no new action sigaction only reads, and it fills in the old one wherever it succeeds.
    unsafe {
        libc::sigaction(signal, std::ptr::null(), action.as_mut_ptr()) == 0
            && action.assume_init().sa_sigaction == libc::SIG_IGN
    }
}
