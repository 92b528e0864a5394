//! Saves the case of the command line, and nothing else.

use crate::Context;
use crate::message::{Reply, Request};
use serde_json::json;
use taut::error::Result;

/// Writes `text` into the file of the command line.
pub fn save(request: &Request, context: &Context) -> Result<Reply> {
    let path = context.host.save(request.text("text")?)?;
    Ok(Reply::new(json!({ "saved": path.display().to_string() })))
}
