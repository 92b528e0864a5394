//! The files of the page, carried by the program.

use axum::body::Body;
use axum::http::header::{self, HeaderValue};
use axum::http::{StatusCode, Uri};
use axum::response::Response;

/// Path, type and content.
type Asset = (&'static str, &'static str, &'static str);

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

macro_rules! page {
    ($($path:literal: $kind:expr),* $(,)?) => {
        &[$((concat!("/", $path), $kind, include_str!(concat!("../page/", $path)))),*]
    };
}

const ASSETS: &[Asset] = page![
    "index.html": HTML,
    "style.css": CSS,
    "icon.svg": "image/svg+xml",
    "app.js": SCRIPT,
    "cases.js": SCRIPT,
    "drop.js": SCRIPT,
    "editor.js": SCRIPT,
    "film.js": SCRIPT,
    "format.js": SCRIPT,
    "gallery.js": SCRIPT,
    "gif.js": SCRIPT,
    "hints.js": SCRIPT,
    "layout.js": SCRIPT,
    "link.js": SCRIPT,
    "logs.js": SCRIPT,
    "main.js": SCRIPT,
    "modes.js": SCRIPT,
    "motion.js": SCRIPT,
    "parameters.js": SCRIPT,
    "picture.js": SCRIPT,
    "player.js": SCRIPT,
    "plots.js": SCRIPT,
    "shape.js": SCRIPT,
    "stage.js": SCRIPT,
    "stops.js": SCRIPT,
    "socket.js": SCRIPT,
    "sweep.js": SCRIPT,
    "tour.js": SCRIPT,
    "tune.js": SCRIPT,
    "wire.js": SCRIPT,
    "worker.js": SCRIPT,
    "workers.js": SCRIPT,
];

/// The files that the report's style and scripts are served as.
const REPORT: [&str; 3] = ["/report.css", "/pen.js", "/plot.js"];

/// The paths of all files.
pub fn paths() -> impl Iterator<Item = &'static str> {
    ASSETS.iter().map(|(path, _, _)| *path).chain(REPORT)
}

/// Type and content of the file at a path.
pub fn file(path: &str) -> Option<(&'static str, String)> {
    let [style, pen, plot] = REPORT;
    match path {
        path if path == style => Some((CSS, taut_report::page::style())),
        path if path == pen => Some((SCRIPT, taut_report::page::PEN.to_string())),
        path if path == plot => Some((SCRIPT, taut_report::page::PLOT.to_string())),
        path => {
            let found = ASSETS.iter().find(|(known, _, _)| *known == path);
            found.map(|(_, kind, content)| (*kind, (*content).to_string()))
        }
    }
}

/// The file at a path; `/` is the page itself.
pub async fn serve(uri: Uri) -> Response {
    let path = if uri.path() == "/" { "/index.html" } else { uri.path() };
    let (status, kind, content) = match file(path) {
        Some((kind, content)) => (StatusCode::OK, kind, from_folder(path).unwrap_or(content)),
        None => {
            (StatusCode::NOT_FOUND, HTML, "<!DOCTYPE html><title>taut studio</title><p>There is no such page.\n".into())
        }
    };
    let mut response = Response::new(Body::from(content));
    *response.status_mut() = status;
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(kind));
    response
}

/// The same file from the folder that `TAUT_STUDIO_PAGE` names, so that whoever writes the page need not build: in
/// builds for debugging alone, and only under the names of [`ASSETS`].
fn from_folder(path: &str) -> Option<String> {
    let folder = std::env::var_os("TAUT_STUDIO_PAGE").filter(|_| cfg!(debug_assertions))?;
    std::fs::read_to_string(std::path::Path::new(&folder).join(path.trim_start_matches('/'))).ok()
}

#[cfg(test)]
mod tests {
    use super::ASSETS;

    #[test]
    fn the_files_of_the_page_have_lines_of_120_columns_at_most() {
        for (path, _, content) in ASSETS.iter().filter(|(path, _, _)| !path.ends_with(".svg")) {
            for (k, line) in content.lines().enumerate() {
                assert!(line.chars().count() <= 120, "{path}, line {}: {line}", k + 1);
            }
        }
    }
}
