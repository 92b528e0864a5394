//! How the machine swings: the page of `taut modes`.

use super::case::opened_for;
use super::{Context, friction};
use crate::message::{Reply, Request};
use serde_json::json;
use taut::case::Files;
use taut::error::Result;
use taut::linear::{Analysis, GantryAnalysis, Question};
use taut_report::modes;

/// Poles, zeros, frequency responses, and how they change along the travel, as a part of a page and as data; and
/// friction over speed, up to `speed`, m/s.
pub fn modes(request: &Request, context: &Context) -> Result<Reply> {
    let case = opened_for(request, context, Files::Nothing)?;
    let speed = request.number("speed").filter(|speed| *speed > 0.0).unwrap_or(1.0);
    let friction = friction::page(&case, speed);
    let (page, result) = match &case {
        case if case.is_axis() => {
            let analysis = Analysis::of(case, &Question::default())?;
            let figures = modes::figures(&analysis);
            (modes::page(&analysis, &figures), taut::json::modes(&analysis))
        }
        case => {
            let analysis = GantryAnalysis::of(case)?;
            let figures = modes::gantry::planes(&analysis);
            (
                modes::gantry::page(&analysis, &figures, &modes::gantry::responses(&analysis)),
                taut::json::gantry_modes(&analysis),
            )
        }
    };
    Ok(Reply::of(json!({ "html": format!("{}{}", page.body(), friction.body()), "result": result })))
}
