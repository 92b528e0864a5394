//! The machines that come with the program.

use crate::Context;
use crate::message::{Reply, Request};
use serde_json::{Value, json};
use taut::case::Case;
use taut::error::Result;
use taut::stages::STAGES;
use taut_report::simulate;

/// One of the controllers stands for all.
const CONTROLLER: &str = "sollmann-jouaneh/controllers/pid.toml";

/// All of them: path, title, text, and what their pictures need.
pub fn gallery(_: &Request, _: &Context) -> Result<Reply> {
    let one = |(path, text): &(&str, &str)| {
        let case = Case::from_text_with(path, text, &[])?;
        Ok(json!({ "path": path, "title": case.title.as_str(), "text": text, "scene": simulate::scene(&case) }))
    };
    let is_shown = |(path, _): &&(&str, &str)| !path.contains("/controllers/") || *path == CONTROLLER;
    let stages = STAGES.iter().filter(is_shown).map(one).collect::<Result<Vec<Value>>>()?;
    Ok(Reply::new(json!({ "stages": stages })))
}
