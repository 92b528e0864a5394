//! Result of a fit with its uncertainty.

use super::combinations::Combination;
use super::doubts::{Cause, Disagreement, OtherLaw};
use super::finding::{Finding, Grade};
use super::identify::Identifiability;
use super::scores::LogFit;
use crate::control::belts::Belts;
use crate::fit::limits::{BELTS_DOUBTFUL, CAUSE_SETTLES};
use crate::fit::noise::Wave;
use crate::fit::search::point::{Ending, Strategy};
use crate::fit::search::starts::Work;
use crate::log::Quantity;
use crate::machine::Machine;

/// The result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The machine with the estimates; among machines that fit the logs equally well, the nearest to that of the case.
    pub machine: Machine,
    /// The machine of each campaign, or log, with separate parameters, of which `machine` is the first. Empty without
    /// separate parameters.
    pub parts: Vec<(String, Machine)>,
    /// The estimates: free parameters, then what all logs share.
    pub estimates: Vec<Estimate>,
    /// Correlations of the estimates, row by row; NaN where one is at a bound.
    pub correlation: Vec<Vec<f64>>,
    /// The standard deviation of each quantity's residuals.
    pub noise: Vec<(Quantity, f64)>,
    /// Agreement with each log: those fitted, then those held out.
    pub logs: Vec<LogFit>,
    /// The information of the logs at the estimates.
    pub identifiability: Option<Identifiability>,
    /// Advice for each group of parameters that is not determined.
    pub choices: Vec<Vec<String>>,
    /// Parts of the logs that disagree with the whole by more than noise.
    pub disagreement: Option<Disagreement>,
    /// A friction law that the case does not have and the residuals suggest.
    pub other_law: Option<OtherLaw>,
    /// A missing element that the logs show, from a fit with it.
    pub cause: Option<Cause>,
    /// Errors of an output that repeat with position.
    pub waves: Vec<Wave>,
    /// Outputs whose noise oscillates, with its frequency, Hz.
    pub(crate) oscillations: Vec<(Quantity, f64)>,
    /// The residuals of the worst output, as a multiple of the noise of the logs; 0 without a search.
    pub(crate) times_noise: f64,
    /// Findings on logs and search, warnings first.
    pub findings: Vec<Finding>,
    /// The variables of the search where it ended.
    pub point: Vec<f64>,
    /// End of the search.
    pub ending: Ending,
    /// Its last strategy; `None` without a search.
    pub strategy: Option<Strategy>,
    /// Predicted gain of the last step, in standard errors.
    pub decrement: f64,
    /// ½ Σ r² of the weighted residuals.
    pub cost: f64,
    /// Final cost of each start, in the first weights; the first start is that of the case, or that of a regression if
    /// better.
    pub starts: Vec<f64>,
    /// Number of gradients around the estimates that balance; more than one at a kink.
    pub pieces: usize,
    /// Number of uses of an evolution strategy.
    pub evolved: usize,
    /// Number of counted values.
    pub values: usize,
    /// Number of variables, including nuisance parameters.
    pub variables: usize,
    /// The effort.
    pub work: Work,
}

/// One parameter's estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Its key, or those of a tie, or the name of a group.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// Start of the search.
    pub start: f64,
    /// The estimate.
    pub value: f64,
    /// Its standard error; infinite if it is not determined, `None` at a bound.
    pub error: Option<f64>,
    /// 95 % interval; infinite if it is not determined. At a bound it extends from the bound to the limit of the
    /// interval without the bound; `None` if that is unknown.
    pub interval: Option<[f64; 2]>,
    /// Its bounds.
    pub bounds: [f64; 2],
    /// True if it ended at one of them.
    pub at_bound: bool,
    /// Index of the part of the logs that it belongs to; `None` for all logs.
    pub part: Option<usize>,
    /// The keys that it sets in the case file, with their values.
    pub sets: Vec<(String, f64)>,
}

impl Estimate {
    /// True if the logs determine it, or it is at a bound.
    pub fn is_determined(&self) -> bool {
        self.at_bound || self.error.is_some_and(f64::is_finite)
    }
}

impl Fit {
    /// True if all free parameters are determined and there is no warning.
    pub fn is_reliable(&self) -> bool {
        self.is_complete() && self.warnings().next().is_none()
    }

    /// True if all free parameters are determined.
    pub fn is_complete(&self) -> bool {
        self.estimates.iter().all(Estimate::is_determined)
    }

    /// The findings that make the result unreliable.
    pub fn warnings(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| finding.grade == Grade::Warning)
    }

    /// True if the search ended at a minimum within the bounds without warnings.
    pub fn is_converged(&self) -> bool {
        self.ending == Ending::Converged
            && !self.estimates.iter().any(|estimate| estimate.at_bound)
            && self.is_reliable()
    }

    /// The word for its end in files.
    pub fn ending_word(&self) -> &'static str {
        match self.ending {
            Ending::Converged if self.estimates.iter().any(|estimate| estimate.at_bound) => "at_bound",
            Ending::Converged if !self.is_complete() => "not_determined",
            Ending::Converged if !self.is_reliable() => "doubtful",
            ending => ending.word(),
        }
    }

    /// The comparison of the belts of two drives; `None` for a machine with one drive, or if no free parameter changes
    /// them. Where a missing element explains nearly all of the residuals, it is that of the fit with it, since the fit
    /// without it may have ended anywhere. Undetermined if the fit is doubtful for another reason than residuals a
    /// little above the noise, or a missing element, for which intervals are widened.
    pub fn belts(&self) -> Option<Belts> {
        let stated = self.identifiability.as_ref()?.belts.as_ref()?.belts.clone();
        if let Some(cause) = self.cause.as_ref().filter(|cause| cause.explained >= CAUSE_SETTLES) {
            let with = cause.belts.clone().unwrap_or(stated);
            let is_far = cause.times_noise > BELTS_DOUBTFUL;
            return Some(if is_far { Belts { error: f64::INFINITY, ..with } } else { with });
        }
        let element = self.cause.as_ref().map(|cause| cause.key);
        let is_far = self.times_noise > BELTS_DOUBTFUL;
        let mut warnings = self.warnings().filter(|finding| Some(finding.code) != element);
        let is_doubtful = warnings.any(|finding| finding.code != "noise" || is_far);
        Some(if is_doubtful { Belts { error: f64::INFINITY, ..stated } } else { stated })
    }

    /// The combinations of undetermined parameters that are determined.
    pub fn combinations(&self) -> impl Iterator<Item = &Combination> {
        self.identifiability.iter().flat_map(|found| &found.groups).flat_map(|group| &group.combinations)
    }
}
