//! The first request of a page: the case of the command line, or a case to start from.

use crate::Context;
use crate::message::{Reply, Request};
use serde_json::json;
use taut::case::TEMPLATE;
use taut::error::Result;

/// The case and where it can be saved.
pub fn open(_: &Request, context: &Context) -> Result<Reply> {
    let case = context.host.opened();
    let (path, text) = case.unzip();
    Ok(Reply::new(json!({
        "version": env!("CARGO_PKG_VERSION"),
        "text": text.unwrap_or_else(|| TEMPLATE.to_string()),
        "path": path.map(|path| path.display().to_string()),
        "name": context.host.name().file_name().unwrap_or_default().to_string_lossy(),
    })))
}
