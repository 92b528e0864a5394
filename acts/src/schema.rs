//! The JSON Schema of the case file, by which the page completes and explains what is typed.

use crate::Context;
use crate::message::{Reply, Request};
use serde_json::json;
use taut::error::Result;

/// The schema of case files, as `taut schema case` prints it.
pub fn schema(_: &Request, _: &Context) -> Result<Reply> {
    Ok(Reply::new(json!({ "schema": taut::json::case_schema() })))
}
