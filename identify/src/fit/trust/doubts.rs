//! Reasons to widen intervals beyond noise: parts of the logs that disagree, and another friction law.

use nalgebra::DMatrix;

/// Parts of the logs that disagree with the whole.
#[derive(Debug, Clone, PartialEq)]
pub struct Disagreement {
    /// Windows that were compared.
    pub windows: usize,
    /// Their length, s.
    pub length: f64,
    /// By how many standard errors of noise each of the parameters is off in them.
    pub off: Vec<f64>,
    /// The addition to the covariance of the variables that concern all runs.
    pub(crate) added: DMatrix<f64>,
}

/// A friction law that the residuals speak for.
#[derive(Debug, Clone, PartialEq)]
pub struct OtherLaw {
    /// The body, as the case file has it.
    pub body: &'static str,
    /// In words, with its size.
    pub words: String,
    /// Its amplitude in standard errors.
    pub standard_errors: f64,
    /// Amount that it takes off the sum of the squared residuals.
    pub(crate) gain: f64,
    /// By how many of its standard errors each parameter would move.
    pub off: Vec<f64>,
    /// The addition to the covariance of the variables that concern all runs.
    pub(crate) added: DMatrix<f64>,
}
