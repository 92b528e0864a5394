//! The files of the page, carried by the program.

use axum::body::Body;
use axum::http::header::{self, HeaderValue};
use axum::http::{StatusCode, Uri};
use axum::response::Response;
use std::borrow::Cow;
use taut_report::page::MODULES;

/// Name, type and content.
type Asset = (&'static str, &'static str, &'static str);

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

macro_rules! page {
    ($($path:literal: $kind:expr),* $(,)?) => {
        &[$(($path, $kind, include_str!(concat!("../page/", $path)))),*]
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
    "long-work.js": SCRIPT,
    "main.js": SCRIPT,
    "modes.js": SCRIPT,
    "motion.js": SCRIPT,
    "parameters.js": SCRIPT,
    "picture.js": SCRIPT,
    "plots.js": SCRIPT,
    "shape.js": SCRIPT,
    "stops.js": SCRIPT,
    "socket.js": SCRIPT,
    "sweep.js": SCRIPT,
    "tour.js": SCRIPT,
    "tune.js": SCRIPT,
    "wire.js": SCRIPT,
    "worker.js": SCRIPT,
    "workers.js": SCRIPT,
];

/// All files: name, type and content.
pub fn files() -> impl Iterator<Item = (&'static str, &'static str, Cow<'static, str>)> {
    let modules = MODULES.iter().map(|(name, content)| (*name, SCRIPT, *content));
    let files = ASSETS.iter().copied().chain(modules).map(|(name, kind, content)| (name, kind, content.into()));
    files.chain(std::iter::once_with(|| ("report.css", CSS, taut_report::page::style().into())))
}

/// The file at a path; `/` is the page itself.
pub async fn serve(uri: Uri) -> Response {
    let name = if uri.path() == "/" { "index.html" } else { uri.path().strip_prefix('/').unwrap_or_default() };
    let (status, kind, content) = match files().find(|(known, _, _)| *known == name) {
        Some((_, kind, content)) => (StatusCode::OK, kind, from_folder(name).map_or(content, Cow::Owned)),
        None => {
            (StatusCode::NOT_FOUND, HTML, "<!DOCTYPE html><title>taut studio</title><p>There is no such page.\n".into())
        }
    };
    let mut response = Response::new(Body::from(content.into_owned()));
    *response.status_mut() = status;
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(kind));
    response
}

/// The same file from the folder that `TAUT_STUDIO_PAGE` names, so that whoever writes the page need not build: in
/// builds for debugging alone, and only under the names of [`files`].
fn from_folder(name: &str) -> Option<String> {
    let folder = std::env::var_os("TAUT_STUDIO_PAGE").filter(|_| cfg!(debug_assertions))?;
    std::fs::read_to_string(std::path::Path::new(&folder).join(name)).ok()
}

#[cfg(test)]
mod tests {
    use super::files;

    #[test]
    fn the_files_of_the_page_have_lines_of_120_columns_at_most() {
        // The report's style is made by a program.
        for (name, _, content) in files().filter(|(name, _, _)| !["icon.svg", "report.css"].contains(name)) {
            for (k, line) in content.lines().enumerate() {
                assert!(line.chars().count() <= 120, "{name}, line {}: {line}", k + 1);
            }
        }
    }
}
