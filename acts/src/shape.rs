//! Input shapers from spectra that were sent: the page of `taut shape`.

use crate::Context;
use crate::message::{Reply, Request};
use serde_json::{Value, json};
use std::path::PathBuf;
use taut::control::recommendation::{Question, recommend};
use taut::control::spectrum::Axis;
use taut::error::Result;
use taut_report::shape::{figures, page};

/// Chooses shapers for one file, or compares two: `paths`; `axis`, of the accelerometer; `together`.
pub fn shape(request: &Request, context: &Context) -> Result<Reply> {
    let paths = request.list("paths").iter().filter_map(Value::as_str);
    let files = paths.map(|path| context.host.sent(path)).collect::<Result<Vec<PathBuf>>>()?;
    let axis = match request.body.get("axis").and_then(Value::as_str) {
        Some("x") => Some(Axis::X),
        Some("y") => Some(Axis::Y),
        Some("z") => Some(Axis::Z),
        _ => None,
    };
    let question = Question { axis, together: request.flag("together"), ..Question::default() };
    let found = recommend(&question, &files)?;
    let page = page(&found, &figures(&found));
    Ok(Reply::new(json!({ "html": page.body(), "result": taut::json::shape(&found) })))
}
