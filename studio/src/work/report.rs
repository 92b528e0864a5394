//! The one-file report of all experiments: the page of `taut simulate`.

use super::Context;
use super::case::opened;
use super::run::{Keep, simulate_axis, simulate_gantry};
use crate::message::{Reply, Request};
use serde_json::json;
use taut::error::Result;
use taut::solve::Solver;
use taut_report::simulate;

/// The page as text.
pub fn report(request: &Request, context: &Context) -> Result<Reply> {
    let page = match &opened(request, context)? {
        case if case.is_axis() => {
            let solver = Solver::of(&case.machine);
            let experiments = case.experiments.iter();
            let runs = experiments.map(|one| simulate_axis(case, one, solver, context, &mut Keep::Curves));
            let runs = runs.collect::<Result<Vec<_>>>()?;
            let figures: Vec<_> = runs.iter().map(|run| simulate::figures(case, run)).collect();
            simulate::page(case, &case.text, solver, &runs, &figures)
        }
        case => {
            let solver = Solver::of_mechanism(&case.machine.mechanism());
            let experiments = case.experiments.iter();
            let runs =
                experiments.map(|one| simulate_gantry(case, one, context, &mut Keep::Curves).map(|(run, _)| run));
            let runs = runs.collect::<Result<Vec<_>>>()?;
            let figures: Vec<_> = runs.iter().map(|run| simulate::gantry::figures(case, run)).collect();
            let ways: Vec<_> = runs.iter().map(|run| simulate::gantry::way(case, run)).collect();
            simulate::gantry::page(case, &case.text, solver, &runs, &figures, &ways)
        }
    };
    Ok(Reply::of(json!({ "html": page.html() })))
}
