//! How the machine swings: the page of `taut modes`.

use crate::case::opened_for;
use crate::message::{Reply, Request};
use crate::{Context, friction};
use serde_json::json;
use taut::case::Files;
use taut::error::Result;
use taut::linear::{Analysis, Question};
use taut_report::modes;

/// Poles, zeros, frequency responses, and how they change along the travel, as a part of a page and as data; and
/// friction over speed, up to `speed`, m/s.
pub fn modes(request: &Request, context: &Context) -> Result<Reply> {
    let case = opened_for(request, context, Files::Nothing)?;
    let speed = request.number("speed").filter(|speed| *speed > 0.0).unwrap_or(1.0);
    let friction = friction::page(&case, speed);
    let analysis = Analysis::new(&case, &Question::default())?;
    let page = modes::page(&analysis, &modes::pictures(&analysis));
    let result = taut::json::modes(&analysis);
    Ok(Reply::new(json!({ "html": format!("{}{}", page.body(), friction.body()), "result": result })))
}
