//! The conversation with one page.
//!
//! Quick works, such as the run that a slider asks for, go one at a time, and of those that wait the newest of each
//! kind alone is done: what the page shows last is what it asked for last. Long works have a thread each, tell how far
//! they are, and are stopped by `cancel`. When the page goes, all of its works are told to stop.

use crate::state::State;
use axum::extract::State as Shared;
use axum::extract::ws::{CloseFrame, Message, WebSocket, WebSocketUpgrade, close_code};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use taut::error::Error;
use taut_acts::{Context, Pace, Reply, Request};
use tokio::sync::mpsc;

/// Bytes of a message: twice what a case file may have.
const MESSAGE: usize = 4 << 20;

/// How long a page may take to receive one answer.
const PATIENCE: Duration = Duration::from_secs(20);

/// Makes a socket of a request.
pub async fn upgrade(Shared(state): Shared<Arc<State>>, socket: WebSocketUpgrade) -> Response {
    let Ok(place) = Arc::clone(&state.sockets).try_acquire_owned() else {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many pages are open\n").into_response();
    };
    let socket = socket.max_message_size(MESSAGE).max_frame_size(MESSAGE).read_buffer_size(16 * 1024);
    socket.on_upgrade(move |socket| async move {
        Page::new(state).talk(socket).await;
        drop(place);
    })
}

/// A finished work.
struct Done {
    id: u64,
    frame: Vec<u8>,
    /// True if it was the quick one.
    was_quick: bool,
}

/// One page.
struct Page {
    state: Arc<State>,
    /// Quick works that wait, the newest of each kind.
    waiting: Vec<Request>,
    /// Stops the quick work under way.
    quick: Option<Arc<AtomicBool>>,
    /// Stops each long work under way.
    long: HashMap<u64, Arc<AtomicBool>>,
    done: mpsc::Sender<Done>,
    progress: mpsc::Sender<Vec<u8>>,
    results: Option<(mpsc::Receiver<Done>, mpsc::Receiver<Vec<u8>>)>,
}

impl Drop for Page {
    fn drop(&mut self) {
        self.quick.iter().chain(self.long.values()).for_each(|stop| stop.store(true, Ordering::Relaxed));
    }
}

impl Page {
    fn new(state: Arc<State>) -> Self {
        // One quick work and as many long ones as a server does at a time: nobody waits long for room.
        let (done, results) = mpsc::channel(16);
        let (progress, steps) = mpsc::channel(4);
        let results = Some((results, steps));
        Self { state, waiting: Vec::new(), quick: None, long: HashMap::new(), done, progress, results }
    }

    /// Until the page goes, or the server ends.
    async fn talk(mut self, mut socket: WebSocket) {
        let mut ending = self.state.ending();
        let Some((mut results, mut steps)) = self.results.take() else { return };
        loop {
            let frame = tokio::select! {
                _ = ending.changed() => break,
                Some(done) = results.recv() => self.finished(done),
                Some(step) = steps.recv() => Some(step),
                message = socket.recv() => match message {
                    Some(Ok(Message::Text(text))) => self.asked(text.as_str()),
                    Some(Ok(Message::Ping(_) | Message::Pong(_))) => None,
                    Some(Ok(Message::Binary(_))) => break,
                    Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                },
            };
            let Some(frame) = frame else { continue };
            let sent = tokio::time::timeout(PATIENCE, socket.send(Message::Binary(frame.into()))).await;
            // A page that takes nothing, or has gone.
            if !matches!(sent, Ok(Ok(()))) {
                return;
            }
        }
        let goodbye = CloseFrame { code: close_code::AWAY, reason: "".into() };
        let _ = tokio::time::timeout(Duration::from_millis(200), socket.send(Message::Close(Some(goodbye)))).await;
    }

    /// Takes a request up; the answer, where there is one at once.
    fn asked(&mut self, text: &str) -> Option<Vec<u8>> {
        let request = match Request::read(text) {
            Ok(request) => request,
            Err(error) => return Some(Reply::error(&error).frame(None)),
        };
        if request.act == "cancel" {
            let of = request.body.get("of").and_then(Value::as_u64);
            let stop = of.and_then(|of| self.long.get(&of));
            stop.inspect(|stop| stop.store(true, Ordering::Relaxed));
            return Some(Reply::new(json!({ "cancelled": stop.is_some() })).frame(Some(request.id)));
        }
        match taut_acts::pace(&request.act) {
            None => Some(taut_acts::unknown(&request.act).frame(Some(request.id))),
            Some(Pace::Long) => self.begin_long(request),
            Some(Pace::Quick) => {
                let same = self.waiting.iter().position(|waiting| waiting.act == request.act);
                let replaced = same.map(|place| self.waiting.remove(place).id);
                self.waiting.push(request);
                self.begin_quick();
                replaced.map(|id| Reply::new(json!({ "replaced": true })).frame(Some(id)))
            }
        }
    }

    /// Takes up the next quick work, if none is under way.
    fn begin_quick(&mut self) {
        if self.quick.is_some() || self.waiting.is_empty() {
            return;
        }
        let request = self.waiting.remove(0);
        let stop = Arc::new(AtomicBool::new(false));
        self.quick = Some(Arc::clone(&stop));
        let work = self.work(request, stop, true);
        self.state.pool.add(work);
    }

    fn begin_long(&mut self, request: Request) -> Option<Vec<u8>> {
        let Some(place) = self.state.begin_long() else {
            let error = Error::new("as many long works are under way as this computer has processors");
            return Some(Reply::error(&error.next("stop one of them, or wait")).frame(Some(request.id)));
        };
        let stop = Arc::new(AtomicBool::new(false));
        self.long.insert(request.id, Arc::clone(&stop));
        let work = self.work(request, stop, false);
        std::thread::spawn(move || {
            work();
            drop(place);
        });
        None
    }

    /// A work as threads take it: its answer comes back through `done`.
    fn work(&self, request: Request, stop: Arc<AtomicBool>, was_quick: bool) -> Box<dyn FnOnce() + Send> {
        let (state, done, progress) = (Arc::clone(&self.state), self.done.clone(), self.progress.clone());
        Box::new(move || {
            let id = request.id;
            let tell = |step: Value| {
                // A page that is behind misses a step, and gets the next.
                progress.try_send(Reply::new(json!({ "progress": step })).frame(Some(id))).is_ok()
            };
            let is_stopped = || stop.load(Ordering::Relaxed);
            let context = Context::new(&*state, &is_stopped, &tell);
            let frame = taut_acts::answer(&request, &context).frame(Some(id));
            let _ = done.blocking_send(Done { id, frame, was_quick });
        })
    }

    fn finished(&mut self, done: Done) -> Option<Vec<u8>> {
        if done.was_quick {
            self.quick = None;
            self.begin_quick();
        } else {
            self.long.remove(&done.id);
        }
        Some(done.frame)
    }
}
