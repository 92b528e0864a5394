//! Parameters from logs, and their identifiability.
//!
//! Output error method: the model is driven by every log's input, and its outputs are compared with the measured ones,
//! all logs at once. The entry point is [`fit`]; before it, [`check`] reports what the logs can determine.

mod asked;
mod case_text;
mod check;
pub mod compare;
mod design;
mod limits;
pub mod map;
mod noise;
mod posterior;
mod search;
mod trust;

/// The experiment that determines parameters best.
pub mod experiment_design {
    pub use super::design::*;
}

/// Bounded non-linear least squares.
pub mod least_squares {
    pub use super::asked::residuals::{Bounds, Differences, Residuals, Step};
    pub use super::search::least_squares::minimise;
    pub use super::search::point::{Ending, Minimum, Options, Strategy};
}

pub use crate::case::{drawn, machines};
pub use crate::control::belts::Belts;
pub use asked::problem::{Problem, Stop};
pub use asked::run::{Extra, FittedLog, MeasuredOutput, Nuisance};
pub use check::{Check, check, check_watched};
pub use compare::drift::{Change, Drift, drift};
pub use limits::{EFFECTIVE, LEAST_SHOWN, MODEL_ERROR, R_HAT, UNDETERMINED};
pub use noise::Wave;
pub use noise::student::student;
pub use posterior::nuts::Effort;
pub use posterior::{Credible, Posterior, posterior};
pub use search::point::{Ending, Strategy};
pub use search::regression::{Balance, regression};
pub use search::starts::Work;
pub use search::triangle::inverse_of_square;
pub use trust::combinations::Combination;
pub use trust::doubts::{Cause, Disagreement, OtherLaw, Size};
pub use trust::finding::{Finding, Grade};
pub use trust::found::{Estimate, Fit};
pub use trust::identify::{Group, Identifiability};
pub use trust::profile::{Profile, profiles};
pub use trust::proposals::Proposal;
pub use trust::residual_force::{ResidualForce, residual_force};
pub use trust::scores::{LogFit, OutputFit, Score, Together, beside_log, together};
pub use trust::uncertainty::Covariance;

use crate::case::{Case, Plan};
use crate::error::Result;
use crate::solve::Flow;
use trust::nearest::search;

/// Finds the parameters of `plan` from the logs of `case`.
///
/// `watch` receives the cost after each step; `stop` ends the search, which then returns the best point so far.
///
/// ```no_run
/// use taut::case::Case;
/// use taut::fit::fit;
/// use taut::solve::Flow;
///
/// let case = Case::read("axis.toml")?; // with logs and [fit]
/// let plan = case.fit.clone().unwrap_or_default();
/// let found = fit(&case, &plan, None, &mut |_| Flow::Continue)?;
/// for estimate in &found.estimates {
///     println!("{} = {} ± {:?} {}", estimate.name, estimate.value, estimate.error, estimate.unit);
/// }
/// # Ok::<(), taut::Error>(())
/// ```
pub fn fit(case: &Case, plan: &Plan, stop: Option<Stop>, watch: &mut dyn FnMut(f64) -> Flow) -> Result<Fit> {
    fit_watched(case, plan, stop, &mut |_, cost| watch(cost))
}

/// Fits a case; `watch` receives the variables of the [`Problem`] after each step.
pub fn fit_watched(
    case: &Case,
    plan: &Plan,
    stop: Option<Stop>,
    watch: &mut dyn FnMut(&[f64], f64) -> Flow,
) -> Result<Fit> {
    let settled = search(case, plan, stop, watch)?;
    Ok(settled.assessed(case, plan).fit)
}
