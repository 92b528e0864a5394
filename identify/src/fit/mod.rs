//! Parameters from logs, and what the logs cannot tell.
//!
//! Output error: the model is put through every log's input, and what it would have shown is compared with what was
//! seen, all logs at once. The recipe is [`fit`]; before it, [`check`] says what the logs can determine.

mod acceleration;
mod bundle;
mod case_text;
mod check;
mod cmaes;
mod combinations;
pub mod compare;
mod controller;
mod density;
mod drift;
mod drifting;
pub mod experiment_design;
mod findings;
mod found;
mod held_out;
mod identify;
pub mod least_squares;
mod marginal;
mod nearest;
mod noise;
mod other_laws;
mod posterior;
mod problem;
mod profile;
mod proposals;
mod regression;
mod residual_force;
mod result;
mod run;
mod scores;
mod search;
mod sensitivity;
mod sub_records;
mod trials;
mod triangle;
mod uncertainty;

pub use crate::case::{drawn, machines};
pub use check::{Check, check, check_watched};
pub use combinations::Combination;
pub use drift::{Change, Drift, drift};
pub use findings::{Finding, Grade};
pub use found::{Estimate, Fit, Work};
pub use identify::{Group, Identifiability, LIMIT, MODEL, SHOWS};
pub use least_squares::Ending;
pub use noise::Wave;
pub use other_laws::OtherLaw;
pub use posterior::{Credible, EFFECTIVE, Posterior, R_HAT, posterior};
pub use problem::{Problem, Stop};
pub use profile::{Profile, profiles};
pub use proposals::Proposal;
pub use regression::{Balance, regression};
pub use residual_force::{ResidualForce, residual_force};
pub use run::{Extra, MeasuredOutput, Nuisance, Run};
pub use scores::{LogFit, OutputFit, Score, Together, beside_log, together};
use search::{HUBER, Searched, search};
pub use sub_records::Disagreement;
use uncertainty::Judged;
pub use uncertainty::{Covariance, inverse_of_square, student};

use crate::case::{Case, Plan};
use crate::error::Result;
use crate::solve::Flow;

/// Finds the parameters of `plan` from the logs of `case`.
///
/// `watch` sees the cost after each step; `stop` ends the search, which then gives the best so far.
pub fn fit(case: &Case, plan: &Plan, stop: Option<Stop>, watch: &mut dyn FnMut(f64) -> Flow) -> Result<Fit> {
    fit_watched(case, plan, stop, &mut |_, cost| watch(cost))
}

/// The same; `watch` sees the variables after each step, too, as a [`Problem`] of this case and plan has them.
pub fn fit_watched(
    case: &Case,
    plan: &Plan,
    stop: Option<Stop>,
    watch: &mut dyn FnMut(&[f64], f64) -> Flow,
) -> Result<Fit> {
    let found = search(case, plan, stop, watch)?;
    let judged = found.judged(case, plan);
    Ok(told(case, plan, &found, judged.as_ref()))
}

/// The result, and what is to be known of it.
fn told(case: &Case, plan: &Plan, found: &Searched, judged: Option<&Judged>) -> Fit {
    let mut fit = result::result(found, judged);
    fit.findings = findings::findings(case, plan, found, &fit);
    fit
}
