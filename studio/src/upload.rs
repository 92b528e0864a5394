//! Files that a page sends: they lie in a folder of the server's own until it ends.

use crate::state::State;
use axum::body::to_bytes;
use axum::extract::{Request, State as Shared};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use std::sync::Arc;
use std::time::Duration;
use taut_acts::sent::{self, ALL, FILE};

/// How long a file may take.
const PATIENCE: Duration = Duration::from_secs(30);

/// Takes the body as a file; answers with its path, as a case can name it.
pub async fn take(Shared(state): Shared<Arc<State>>, request: Request) -> Response {
    let length = request.headers().get(header::CONTENT_LENGTH).and_then(|value| value.to_str().ok()?.parse().ok());
    if length.is_some_and(|length: usize| length > FILE) {
        return too_large();
    }
    // What is on its way counts as well: it is in memory until it is written.
    let Some(room) = state.room(length.unwrap_or(FILE), ALL) else { return too_large() };
    let query = request.uri().query().unwrap_or_default();
    let name = sent::name(query.split('&').find_map(|pair| pair.strip_prefix("name=")).unwrap_or_default());
    let body = match tokio::time::timeout(PATIENCE, to_bytes(request.into_body(), FILE)).await {
        Err(_) => return (StatusCode::REQUEST_TIMEOUT, "the file came too slowly\n").into_response(),
        Ok(Err(_)) => return too_large(),
        Ok(Ok(body)) => body,
    };
    let write = || {
        let folder = state.uploads()?;
        // Each in a folder of its own, so that two of the same name do not meet.
        let place = (0..).map(|k| folder.join(k.to_string())).find(|place| std::fs::create_dir(place).is_ok());
        let path = place.unwrap_or(folder).join(name);
        std::fs::write(&path, &body).map(|()| path)
    };
    match write() {
        Ok(path) => {
            room.keep(body.len());
            axum_json(&serde_json::json!({ "path": path.display().to_string() }))
        }
        Err(e) => (StatusCode::INSUFFICIENT_STORAGE, format!("the file cannot be kept: {e}\n")).into_response(),
    }
}

fn axum_json(value: &serde_json::Value) -> Response {
    ([(header::CONTENT_TYPE, "application/json")], value.to_string()).into_response()
}

fn too_large() -> Response {
    (StatusCode::PAYLOAD_TOO_LARGE, sent::too_large() + "\n").into_response()
}
