//! Logs: `check`, `fit`, `frf`, and the experiment to make next, `design`.

use super::values::{amperes, channel, count, count_or_none, delay, length, metres, seconds, seed, share};
use crate::common::Common;
use clap::ValueEnum;
use std::path::PathBuf;
use taut::fit::experiment_design::{Criterion, Excitation, VERIFIED};
use taut::machine::Channel;

/// Check which [fit] parameters the logs of a case determine.
///
/// Prints a survey of each log, the expected accuracy of each parameter, the combinations that the logs cannot
/// separate, and the experiments that would separate them.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  taut check axis.toml\n\nExit status 1: the logs determine none of the parameters.")]
pub struct Check {
    /// The case file; - is standard input
    pub case: PathBuf,
    #[command(flatten)]
    pub common: Common,
}

/// Find the parameters in [fit] of a case from its logs.
///
/// Prints the estimates with 95 % intervals and the error of each log. With --out it also writes fitted.toml, a case
/// that simulates with the estimates, fit.json, and a report with model and log side by side; with --posterior also the
/// draws, posterior.csv.
#[derive(Debug, clap::Args)]
#[command(after_help = FIT)]
pub struct Fit {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// Also draw from the posterior, with the priors in [fit.priors], if linearised intervals are too simple
    #[arg(long)]
    pub posterior: bool,
    /// Compare friction laws and windows by their error on held-out parts of the logs, and fit with the best
    #[arg(long, conflicts_with_all = ["posterior", "drift"])]
    pub compare: bool,
    /// Laws to compare, separated by commas: viscous, coulomb, asymmetric, stribeck, along, force-along,
    /// force-by-speed, lugre [default: the first five]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "compare")]
    pub laws: Vec<String>,
    /// Windows to compare, separated by commas: lengths such as 2s, and whole for whole logs
    #[arg(long, value_name = "LENGTHS", value_delimiter = ',', requires = "compare")]
    pub windows: Vec<String>,
    /// Find the single change of the machine that explains the logs best, such as logs of another day
    #[arg(long, conflicts_with = "posterior")]
    pub drift: bool,
    /// Write the results in spite of warnings
    #[arg(long)]
    pub anyway: bool,
    /// Draws to keep of each chain
    #[arg(long, value_name = "N", default_value_t = 1000, requires = "posterior", value_parser = count)]
    pub draws: usize,
    /// Number of chains, each with its own start
    #[arg(long, value_name = "N", default_value_t = 4, requires = "posterior", value_parser = count)]
    pub chains: usize,
    #[command(flatten)]
    pub common: Common,
}

const FIT: &str = "\
Examples:
  taut fit axis.toml --out fitted
  taut fit axis.toml --set fit.starts=8 --json | jq .parameters
  taut fit axis.toml --posterior --draws 2000 --out fitted
  taut fit axis.toml --compare --laws coulomb,asymmetric,along --windows whole,2s --out compared
  taut fit april.toml --drift
  taut simulate fitted/fitted.toml --draws fitted/posterior.csv --out band

A `warning:` means that the result is not reliable: the exit status is 1, and nothing is written without --anyway.
Undetermined parameters are shown as ± ∞, with exit status 1; among the machines that fit equally well,
fitted.toml has the one nearest to the case.
Ctrl-C ends a fit early: the best estimates so far are written and marked as not converged, with exit status 130.";

/// Measure a frequency response: from the logs of a case, without a model, with coherence and intervals.
///
/// Averages segments of every log after Welch, or whole periods with --period. A log with a reference is taken as made
/// in closed loop: the response is the ratio of the responses of output and input to the reference. A gantry has a
/// response from each motor to each output; logs of motors that move one after the other are taken together. Prints the
/// coherent frequencies of each output, fits stiffness and damping of the belt and the delay, and computes the margins
/// of the case's controller with the measured response. With --out it also writes frf.json, frf.csv and a report.
#[derive(Debug, clap::Args)]
#[command(after_help = FRF)]
pub struct Frf {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// Length of a segment, such as "0.5 s" [default: about 16 segments]
    #[arg(long, value_name = "TIME", value_parser = seconds, conflicts_with = "period")]
    pub segment: Option<f64>,
    /// Period of the input, such as "1 s": averages whole periods except the first
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub period: Option<f64>,
    /// Position of the cart, for the model [default: 0 m]
    #[arg(long, value_name = "POSITION", value_parser = metres, allow_hyphen_values = true)]
    pub at: Option<f64>,
    /// Position of the bridge, for the model of a gantry [default: 0 m]
    #[arg(long, value_name = "POSITION", value_parser = metres, allow_hyphen_values = true)]
    pub bridge: Option<f64>,
    /// Input delay of the model, the start value of its fit [default: that of the controller]
    #[arg(long, value_name = "TIME", value_parser = delay)]
    pub delay: Option<f64>,
    #[command(flatten)]
    pub common: Common,
}

/// Design an experiment: the input that determines parameters best within travel, input and current.
///
/// Searches among trapezoids, successive sines, chirps, multisines and binary sequences for the input whose log gives
/// the smallest standard errors of the parameters, with the encoder and recorder of the case. Prints the experiment for
/// the case file, the predicted standard error of each parameter, and the parameters that it cannot determine. With
/// --out it writes designed.toml, the case with the experiment, design.json and a report.
#[derive(Debug, clap::Args)]
#[command(after_help = DESIGN)]
pub struct Design {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// Parameters to determine, separated by commas [default: the free ones of [fit]]
    #[arg(long = "for", value_name = "KEY", value_delimiter = ',')]
    pub names: Vec<String>,
    /// Kinds of input to try, separated by commas [default: all]
    #[arg(long = "input", value_enum, value_name = "INPUT", value_delimiter = ',')]
    pub kinds: Vec<InputName>,
    /// Gantries only: what the input drives, separated by commas: left, right or another motor alone, bridge or cart,
    /// or all motors alike [default: all of these are tried]
    #[arg(long = "drive", value_name = "NAME", value_delimiter = ',')]
    pub driven: Vec<String>,
    /// Criterion to minimise: volume of the confidence ellipsoid, or mean square of the errors
    #[arg(long, value_enum, default_value = "d")]
    pub criterion: CriterionName,
    /// Length of the experiment
    #[arg(long, value_name = "TIME", value_parser = seconds, default_value = "4s")]
    pub duration: f64,
    /// Sample interval [default: that of [measurement] or the experiments, or 1 ms]
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub every: Option<f64>,
    /// Relative margin to each limit
    #[arg(long, value_name = "SHARE", value_parser = share, default_value = "10%")]
    pub margin: f64,
    /// Parameter uncertainty within which the limits must still hold
    #[arg(long, value_name = "SHARE", value_parser = share, default_value = "20%")]
    pub doubt: f64,
    /// Largest input, such as "5 V" [default: the amplifier's limit, or the largest of the experiments]
    #[arg(long, value_name = "INPUT")]
    pub amplitude: Option<String>,
    /// Largest current, such as "3 A" [default: amplifier.current_limit]
    #[arg(long, value_name = "CURRENT", value_parser = amperes)]
    pub current: Option<f64>,
    /// Travel available to the cart, of a gantry to bridge and cart each, such as "0.4 m" [default: [travel], or the
    /// largest of the experiments]
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pub travel: Option<f64>,
    /// Measured quantity and standard deviation of its noise, such as drive_angle=1mrad; may be
    /// repeated [default: [encoder] and [measurement], or the noise of the logs]
    #[arg(long = "measure", value_name = "QUANTITY=NOISE", value_parser = channel)]
    pub measured: Vec<Channel>,
    /// Relative error of the model, which no predicted error is below
    #[arg(long, value_name = "SHARE", value_parser = share, default_value = "1%")]
    pub model_error: f64,
    /// Number of machines, off by up to --doubt, on which a log is simulated and fitted to verify the predicted errors;
    /// 0 for none
    #[arg(long, value_name = "MACHINES", value_parser = count_or_none, default_value_t = VERIFIED)]
    pub verify: usize,
    /// Seed of the starting points of the search
    #[arg(long, value_name = "N", value_parser = seed, default_value_t = 1)]
    pub seed: u64,
    #[command(flatten)]
    pub common: Common,
}

/// An input to choose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum InputName {
    /// There and back
    Trapezoid,
    /// Sines one after another
    Sweep,
    /// A sine of changing frequency
    Chirp,
    /// A sum of sines
    Multisine,
    /// A pseudo-random binary sequence
    Prbs,
}

impl InputName {
    /// For the library.
    pub fn kind(self) -> Excitation {
        match self {
            Self::Trapezoid => Excitation::Trapezoid,
            Self::Sweep => Excitation::Sweep,
            Self::Chirp => Excitation::Chirp,
            Self::Multisine => Excitation::Multisine,
            Self::Prbs => Excitation::Prbs,
        }
    }
}

/// Measures that a design makes small.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum CriterionName {
    /// The volume of the confidence ellipsoid
    D,
    /// The mean square of the relative errors
    A,
}

impl CriterionName {
    /// For the library.
    pub fn criterion(self) -> Criterion {
        match self {
            Self::D => Criterion::D,
            Self::A => Criterion::A,
        }
    }
}

const DESIGN: &str = "\
Examples:
  taut design axis.toml
  taut design axis.toml --for cart.mass,cart.friction.coulomb --travel \"0.4 m\" --amplitude \"6 V\" --out designed
  taut design axis.toml --input trapezoid --duration 2s --verify 20
  taut design axis.toml --json | jq '.parameters[] | {name, relative_error}'

Exit status 1: the best experiment does not determine all parameters in --for.";

const FRF: &str = "\
Examples:
  taut frf axis.toml
  taut frf axis.toml --segment 0.5s --out response
  taut frf axis.toml --period 1s --json | jq .fit.stiffness
  taut frf gantry.toml --bridge \"-100 mm\"";
