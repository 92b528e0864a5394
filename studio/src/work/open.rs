//! The first request of a page: the case of the command line, or a case to start from.

use super::Context;
use crate::message::{Reply, Request};
use serde_json::json;
use taut::case::TEMPLATE;
use taut::error::Result;

/// The case and where it can be saved.
pub fn open(_: &Request, context: &Context) -> Result<Reply> {
    let case = context.state.case.as_ref();
    Ok(Reply::of(json!({
        "version": env!("CARGO_PKG_VERSION"),
        "text": case.map_or_else(|| TEMPLATE.to_string(), |case| case.text.as_str()),
        "path": case.map(|case| case.path.display().to_string()),
        "name": case.and_then(|case| case.path.file_name()).map_or("studio.toml".into(), |name| name.to_string_lossy().into_owned()),
    })))
}
