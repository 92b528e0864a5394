//! Reasons to widen intervals beyond noise: parts of the logs that disagree, another friction law, and a missing
//! element.

use crate::control::belts::Belts;
use nalgebra::DMatrix;

/// Parts of the logs that disagree with the whole.
#[derive(Debug, Clone, PartialEq)]
pub struct Disagreement {
    /// Number of compared windows.
    pub windows: usize,
    /// Their length, s.
    pub length: f64,
    /// Deviation of each parameter in them, in standard errors of noise.
    pub off: Vec<f64>,
    /// The addition to the covariance of the variables that concern all runs.
    pub(crate) added: DMatrix<f64>,
}

/// A friction law that the residuals suggest.
#[derive(Debug, Clone, PartialEq)]
pub struct OtherLaw {
    /// Its key: `stribeck`, `sided`, `drift`, `sway`.
    pub key: &'static str,
    /// The key of the body in the case file.
    pub body: &'static str,
    /// In words, with its size.
    pub words: String,
    /// Explained fraction of the sum of squared residuals.
    pub explained: f64,
    /// Its amplitude in standard errors.
    pub standard_errors: f64,
    /// Reduction of the sum of squared residuals.
    pub(crate) gain: f64,
    /// Change of each parameter, in standard errors.
    pub off: Vec<f64>,
    /// The addition to the covariance of the variables that concern all runs.
    pub(crate) added: DMatrix<f64>,
}

/// An element that the model lacks and the logs show.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// Its key: `spring`, `play`, `sensor_play`, `sensor_scale`, `drive`, `delay`, `limit`, `inductance`, `drag`,
    /// `stribeck`, `breakaway`, `lugre`, `load`, `apart`, `yaw`, `drive_delay`.
    pub key: &'static str,
    /// In words, with its size.
    pub words: String,
    /// Explained fraction of the sum of squared residuals.
    pub explained: f64,
    /// Its size in standard errors.
    pub standard_errors: f64,
    /// Its parameters.
    pub parameters: Vec<Size>,
    /// The estimates of the fit with it, in their order; `None` if the fit with it has no such value.
    pub estimates: Vec<Option<Size>>,
    /// The comparison of the belts by the fit with it.
    pub belts: Option<Belts>,
    /// The residuals of the worst output with it, as a multiple of the noise of the logs.
    pub(crate) times_noise: f64,
    /// The change of the case file that adds it.
    pub add: String,
    /// Number of held-out parts of the logs that it predicts better, and of all parts.
    pub better: [usize; 2],
    /// The addition to the covariance of the variables that concern all runs.
    pub(crate) added: DMatrix<f64>,
}

/// A value with its standard error.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Size {
    /// The parameter.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

/// Friction of a body that falls by a force or torque up to this speed, in words.
pub(super) fn falling(body: &str, force: &str, speed: &str) -> String {
    format!("friction of the {} that falls by {force} within some {speed}", body.replace('_', " "))
}
