//! Saves the case of the command line, and nothing else.

use super::Context;
use crate::message::{Reply, Request};
use serde_json::json;
use taut::error::{Error, Result};

/// Writes `text` into the file of the command line.
pub fn save(request: &Request, context: &Context) -> Result<Reply> {
    let text = request.text("text")?;
    let Some(case) = &context.state.case else {
        let error = Error::new("no case was named on the command line, and the page writes no other file");
        return Err(error.next("download the text instead, or start with `taut studio CASE`"));
    };
    case.save(text)?;
    Ok(Reply::of(json!({ "saved": case.path.display().to_string() })))
}
