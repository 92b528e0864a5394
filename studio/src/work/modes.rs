//! How the machine swings: the page of `taut modes`.

use super::Context;
use super::case::opened;
use crate::message::{Reply, Request};
use serde_json::json;
use taut::case::Opened;
use taut::error::Result;
use taut::linear::{Analysis, GantryAnalysis, Question};
use taut_report::modes;

/// Poles, zeros, frequency responses, and how they change along the travel, as a part of a page and as data.
pub fn modes(request: &Request, context: &Context) -> Result<Reply> {
    let (page, result) = match &opened(request, context)? {
        Opened::Axis(case) => {
            let analysis = Analysis::of(case, &Question::default())?;
            let figures = modes::figures(&analysis);
            (modes::page(&analysis, &figures), taut::json::modes(&analysis))
        }
        Opened::Gantry(case) => {
            let analysis = GantryAnalysis::of(case)?;
            let figures = modes::gantry::planes(&analysis);
            (modes::gantry::page(&analysis, &figures), taut::json::gantry_modes(&analysis))
        }
    };
    Ok(Reply::of(json!({ "html": page.body(), "result": result })))
}
