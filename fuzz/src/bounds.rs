//! Bounds of memory and processor time, which a wrong file must not pass.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::io::Write;
use std::time::{Duration, Instant};

/// Beyond this a thread ends the program at once, bytes: the machine is to survive the test.
const HARD: isize = 3 << 30;

thread_local! {
    static LIVE: Cell<isize> = const { Cell::new(0) };
    static PEAK: Cell<isize> = const { Cell::new(0) };
}

/// The system's allocator, which counts what each thread holds. To be the program's global allocator.
pub struct Counting;

impl Counting {
    fn add(bytes: isize) {
        let _ = LIVE.try_with(|live| {
            let now = live.get() + bytes;
            live.set(now);
            let _ = PEAK.try_with(|peak| peak.set(peak.get().max(now)));
            if now > HARD {
                let _ = std::io::stderr()
                    .write_all(b"an input takes more than 3 GiB; it stands in the .input file of its target\n");
                std::process::abort();
            }
        });
    }
}

// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::add(layout.size() as isize);
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Self::add(layout.size() as isize);
        // SAFETY: the caller's promise.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        Self::add(-(layout.size() as isize));
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Self::add(size as isize - layout.size() as isize);
        // SAFETY: the caller's promise.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

/// Time and memory that a piece of work took.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Taken {
    /// Processor time of its thread.
    pub time: Duration,
    /// Bytes that its thread held at once, beyond what it held before; 0 where the allocator is not [`Counting`].
    pub memory: usize,
}

/// Does a piece of work on this thread, and says what it took.
pub fn measured<T>(work: impl FnOnce() -> T) -> (T, Taken) {
    let before = LIVE.get();
    PEAK.set(before);
    let begin = ProcessorTime::now();
    let result = work();
    let time = begin.elapsed();
    (result, Taken { time, memory: (PEAK.get() - before).max(0) as usize })
}

/// The time that this thread has spent on a processor, or, where the system does not tell, the time of the clock.
struct ProcessorTime {
    #[cfg(unix)]
    begin: Duration,
    #[cfg(not(unix))]
    begin: Instant,
}

impl ProcessorTime {
    #[cfg(unix)]
    fn now() -> Self {
        let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        Self { begin: Duration::new(now.tv_sec as u64, now.tv_nsec as u32) }
    }

    #[cfg(unix)]
    fn elapsed(&self) -> Duration {
        Self::now().begin.saturating_sub(self.begin)
    }

    #[cfg(not(unix))]
    fn now() -> Self {
        Self { begin: Instant::now() }
    }

    #[cfg(not(unix))]
    fn elapsed(&self) -> Duration {
        self.begin.elapsed()
    }
}

/// Ends the program where one input takes longer than `limit` by the clock: a loop that does not end cannot be ended
/// otherwise.
pub struct Watchdog {
    limit: Duration,
    state: std::sync::Arc<std::sync::Mutex<State>>,
}

struct State {
    since: Instant,
    what: String,
    over: bool,
}

impl Watchdog {
    /// Begins to watch; `what` says what hangs.
    pub fn new(limit: Duration, what: String) -> Self {
        let state = State { since: Instant::now(), what, over: false };
        let state = std::sync::Arc::new(std::sync::Mutex::new(state));
        let watched = state.clone();
        std::thread::spawn(move || {
            loop {
                std::thread::sleep(Duration::from_millis(200));
                let Ok(state) = watched.lock() else { return };
                if state.over {
                    return;
                }
                if state.since.elapsed() > limit {
                    let told = format!("{} has not ended after {limit:?}\n", state.what);
                    let _ = std::io::stderr().write_all(told.as_bytes());
                    std::process::exit(101);
                }
            }
        });
        Self { limit, state }
    }

    /// Another input begins.
    pub fn alive(&self) {
        if let Ok(mut state) = self.state.lock() {
            state.since = Instant::now();
        }
    }

    /// How long an input may take by the clock.
    pub fn limit(&self) -> Duration {
        self.limit
    }
}

impl Drop for Watchdog {
    fn drop(&mut self) {
        if let Ok(mut state) = self.state.lock() {
            state.over = true;
        }
    }
}
