//! Check before a fit: contents of the logs, identifiable parameters, and proposals of experiments.

use crate::case::{Case, Plan};
use crate::error::Result;
use crate::fit::asked::problem::Stop;
use crate::fit::search::regression::{Balance, regression};
use crate::fit::trust::found::{Estimate, Fit};
use crate::fit::trust::identify::{Group, Identifiability};
use crate::fit::trust::nearest::{Assessed, search};
use crate::fit::trust::proposals::{Proposal, proposals};
use crate::log::Survey;
use crate::number::engineering_typed;
use crate::solve::Flow;

/// The result of a check before a fit.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Check {
    /// The survey of each log.
    pub logs: Vec<Survey>,
    /// The torque balance of a rigid axis, by regression; `None` if the logs do not allow it.
    pub balance: Option<Balance>,
    /// The identifiability of the parameters from all logs; `None` if every free parameter ended at a bound.
    pub identifiability: Option<Identifiability>,
    /// Advice for each group that is not determined.
    pub choices: Vec<Vec<String>>,
    /// Noise for which this holds.
    pub noise_words: String,
    /// Proposals of one more experiment, the best first.
    pub experiments: Vec<Proposal>,
    /// The fit on which this is based.
    pub fit: Fit,
}

impl Check {
    /// True if the logs determine a parameter or a combination, or if nothing is free.
    pub fn tells(&self) -> bool {
        let is_known = |estimate: &Estimate| !estimate.at_bound && estimate.is_determined();
        let estimates = &self.fit.estimates;
        estimates.is_empty() || estimates.iter().any(is_known) || self.fit.combinations().next().is_some()
    }

    /// Groups of undetermined parameters, with advice for each.
    pub fn groups(&self) -> impl Iterator<Item = (&Group, &Vec<String>)> {
        self.identifiability.iter().flat_map(|known| &known.groups).zip(&self.choices)
    }
}

/// Checks the logs of a case by a fit.
///
/// ```no_run
/// use taut::case::Case;
/// use taut::fit::check;
///
/// let case = Case::read("axis.toml")?; // with logs and [fit]
/// let checked = check(&case, &case.fit.clone().unwrap_or_default())?;
/// for (_, choices) in checked.groups() {
///     println!("the logs do not distinguish {}", choices.join(", "));
/// }
/// # Ok::<(), taut::Error>(())
/// ```
pub fn check(case: &Case, plan: &Plan) -> Result<Check> {
    check_watched(case, plan, None, &mut |_, _| Flow::Continue)
}

/// Checks a case; `watch` receives variables and cost after each step, and `stop` ends the search with the best so far.
pub fn check_watched(
    case: &Case,
    plan: &Plan,
    stop: Option<Stop>,
    watch: &mut dyn FnMut(&[f64], f64) -> Flow,
) -> Result<Check> {
    let settled = search(case, plan, stop, watch)?;
    let Assessed { fit, surveys, judged } = settled.assessed(case, plan);
    let found = settled.searched;
    let experiments = judged.as_ref().map_or(Vec::new(), |judged| proposals(&found, judged));
    let noise: Vec<String> = found
        .noise
        .iter()
        .map(|(quantity, sigma)| {
            let sigma = engineering_typed(*sigma, quantity.unit(), 2);
            format!("{} {sigma}", quantity.name())
        })
        .collect();
    let alike = judged.as_ref().map_or(String::new(), |judged| format!(", {}", judged.slow_words(&found.problem)));
    let noise_words = format!("residual noise: {}{alike}", noise.join(", "));
    let balance = regression(&found.problem);
    Ok(Check {
        balance,
        logs: surveys,
        identifiability: judged.map(|judged| judged.identifiability),
        choices: fit.choices.clone(),
        noise_words,
        experiments,
        fit,
    })
}
