//! Listens on this computer alone, serves, and ends.

use crate::state::State;
use crate::{address, guard, socket};
use axum::Router;
use axum::middleware::from_fn_with_state;
use axum::routing::{get, post};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::io::Write;
use std::net::Ipv4Addr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use taut::error::{Error, Result};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;

/// Connections at a time; one more is closed at once.
const CONNECTIONS: usize = 512;

/// How long a client may take for the head of a request.
const HEAD: Duration = Duration::from_secs(10);

/// How long open connections have when it ends.
const GRACE: Duration = Duration::from_millis(400);

/// Options of the command line.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The case that is opened, and the only file that the page may save to.
    pub case: Option<PathBuf>,
    /// The state that is opened: the part of a link from `#` on.
    pub fragment: Option<String>,
    /// The port; a free one where none is said.
    pub port: Option<u16>,
    /// True if a browser is opened.
    pub open: bool,
    /// Numbers of signals that do not end the server: those that were ignored when the program started.
    pub ignored: Vec<i32>,
}

/// Serves until Ctrl-C, or until it is asked to end.
pub fn serve(options: Options) -> Result<()> {
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(|e| cannot("start", &e))?;
    let done = runtime.block_on(run(options));
    // Threads that still compute have been told to stop; nobody waits for them.
    runtime.shutdown_timeout(Duration::from_millis(100));
    done
}

async fn run(options: Options) -> Result<()> {
    let port = options.port.unwrap_or(0);
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).await.map_err(|e| {
        let error = Error::new(format!("port {port} cannot be taken: {e}")).in_file("--port");
        error.next("leave --port away for a free one, or name another")
    })?;
    let port = listener.local_addr().map_err(|e| cannot("listen", &e))?.port();
    let state = Arc::new(State::new(options.case, port)?);
    // Browsers keep the fragment to themselves, and take it along when the token is exchanged.
    let address =
        format!("http://127.0.0.1:{port}/?token={}{}", state.keys.token, options.fragment.unwrap_or_default());
    tell(&address, &state);
    if options.open {
        address::open(&address);
    }
    let ended = ended(options.ignored);
    tokio::pin!(ended);
    let places = Arc::new(Semaphore::new(CONNECTIONS));
    let service = TowerToHyperService::new(router(&state));
    loop {
        let stream = tokio::select! {
            () = &mut ended => break,
            accepted = listener.accept() => match accepted {
                Ok((stream, _)) => stream,
                // Out of file descriptors, say: those that end will make room.
                Err(_) => {
                    tokio::time::sleep(Duration::from_millis(50)).await;
                    continue;
                }
            },
        };
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else { continue };
        let connection = connection(stream, service.clone());
        tokio::spawn(async move {
            connection.await;
            drop(place);
        });
    }
    drop(listener);
    state.end();
    // Sockets say goodbye.
    tokio::time::sleep(if state.sockets_open() > 0 { GRACE } else { Duration::ZERO }).await;
    state.remove_uploads();
    Ok(())
}

/// Serves one connection to its end.
async fn connection(stream: TcpStream, service: TowerToHyperService<Router>) {
    // Small frames go at once.
    let _ = stream.set_nodelay(true);
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(HEAD).max_headers(64).max_buf_size(64 * 1024);
    // A mistake of a client ends its connection, and nothing else.
    let _ = http.serve_connection(TokioIo::new(stream), service).with_upgrades().await;
}

fn router(state: &Arc<State>) -> Router {
    Router::new()
        .route("/socket", get(socket::upgrade))
        .route("/upload", post(crate::upload::take))
        .fallback(get(crate::assets::serve))
        .layer(from_fn_with_state(Arc::clone(state), guard::check))
        .with_state(Arc::clone(state))
}

/// The first line is the address.
fn tell(address: &str, state: &State) {
    let case = state.case.as_ref().map(|case| format!("{}; ", case.path.display())).unwrap_or_default();
    let mut out = std::io::stdout().lock();
    let _ = writeln!(out, "{address}");
    let _ = writeln!(out, "{case}for this computer alone, until Ctrl-C ends it");
    let _ = out.flush();
}

/// Waits for Ctrl-C or a request to terminate, but for signals that are ignored.
#[cfg(unix)]
async fn ended(ignored: Vec<i32>) {
    use tokio::signal::unix::{SignalKind, signal};
    let one = async |kind: SignalKind| {
        if !ignored.contains(&kind.as_raw_value())
            && let Ok(mut signal) = signal(kind)
        {
            signal.recv().await;
            return;
        }
        std::future::pending::<()>().await;
    };
    tokio::select! {
        () = one(SignalKind::interrupt()) => {}
        () = one(SignalKind::terminate()) => {}
        () = one(SignalKind::hangup()) => {}
    }
}

#[cfg(not(unix))]
async fn ended(_: Vec<i32>) {
    let _ = tokio::signal::ctrl_c().await;
}

fn cannot(what: &str, error: &std::io::Error) -> Error {
    Error::new(format!("the server cannot {what}: {error}"))
}
