//! The one-file report of all experiments: the page of `taut simulate`.

use crate::Context;
use crate::case::opened;
use crate::message::{Reply, Request};
use crate::run::{Keep, simulated};
use serde_json::json;
use taut::error::Result;
use taut::solve::Solver;
use taut_report::simulate;

/// The page as text; a report of all experiments needs all of their files.
pub fn report(request: &Request, context: &Context) -> Result<Reply> {
    let case = &opened(request, context)?;
    case.complete()?;
    let solver = Solver::for_machine(&case.machine);
    let experiments = case.experiments.iter();
    let runs = experiments.map(|one| simulated(case, one, solver, context, &mut Keep::Curves));
    let (page, _) = simulate::report(case, &case.text, solver, &runs.collect::<Result<Vec<_>>>()?, false);
    Ok(Reply::new(json!({ "html": page.html() })))
}
