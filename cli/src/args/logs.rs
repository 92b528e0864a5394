//! Logs: `check`, `fit`, `frf`, and the experiment to make next, `design`.

use super::values::{amperes, channel, count, delay, length, metres, seconds, share};
use crate::command::Common;
use clap::ValueEnum;
use std::path::PathBuf;
use taut::fit::experiment_design::{Criterion, Kind as InputKind};
use taut::machine::Channel;

/// Say what the logs of a case can tell of the parameters in its [fit], before any fit.
///
/// Prints what each log shows, how well each parameter would be known, the combinations that nothing tells apart, and
/// what one more experiment would tell.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  taut check axis.toml")]
pub struct Check {
    /// The case file; - is standard input
    pub case: PathBuf,
    #[command(flatten)]
    pub common: Common,
}

/// Find the parameters in [fit] of a case from its logs.
///
/// Prints the estimates with 95 % intervals and how each log is met. With --out it also writes fitted.toml, a case that
/// simulates with the estimates, fit.json, and a report with model and log side by side; with --posterior also the
/// draws, posterior.csv.
#[derive(Debug, clap::Args)]
#[command(after_help = FIT)]
pub struct Fit {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// Also draw from the posterior, with the priors in [fit.priors]: intervals where those of the fit are too simple
    #[arg(long)]
    pub posterior: bool,
    /// Compare friction laws and windows by the error on parts of the logs that are held out, and fit with the best
    #[arg(long, conflicts_with_all = ["posterior", "drift"])]
    pub compare: bool,
    /// Laws to compare, separated by commas: viscous, coulomb, asymmetric, stribeck, along, force-along, force-by-speed,
    /// lugre [default: the first five]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "compare")]
    pub laws: Vec<String>,
    /// Windows to compare, separated by commas: lengths such as 2s, and whole for whole logs
    #[arg(long, value_name = "LENGTHS", value_delimiter = ',', requires = "compare")]
    pub windows: Vec<String>,
    /// Say which single change of the machine explains the logs best, such as those of another day
    #[arg(long, conflicts_with = "posterior")]
    pub drift: bool,
    /// Write the results although something warns that they are not to be relied on
    #[arg(long)]
    pub anyway: bool,
    /// Draws of each chain that are kept
    #[arg(long, value_name = "N", default_value_t = 1000, requires = "posterior", value_parser = count)]
    pub draws: usize,
    /// Chains, each from a start of its own
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

Lines that begin with `warning:` say what makes a result not to be relied on: the exit status is 1, and nothing is written without --anyway.
What is not determined is ± ∞: of the machines that meet the logs alike, fitted.toml is the nearest to the case. The exit status is 1, too.
Ctrl-C ends a fit early: the best so far is written and said not to be converged, with exit status 130.";

/// Measure a frequency response: from the logs of a case, without a model, with coherence and intervals.
///
/// Takes every experiment with a log. Segments of it are averaged after Welch, or whole periods with --period; where
/// the log has a reference, it was made in closed loop, and the response is that from the reference to output and
/// input, divided. Prints for each output where it is coherent, fits stiffness and damping of the belt and the delay to
/// the responses, and computes the margins of the case's controller around what was measured. With --out it also writes
/// frf.json, frf.csv and a report with the responses over the model's.
#[derive(Debug, clap::Args)]
#[command(after_help = FRF)]
pub struct Frf {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// Length of a segment, such as "0.5 s" [default: some 16 segments]
    #[arg(long, value_name = "TIME", value_parser = seconds, conflicts_with = "period")]
    pub segment: Option<f64>,
    /// Period of the input, such as "1 s", of which whole ones are averaged; the first is left out
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub period: Option<f64>,
    /// Where the cart was, for the model [default: 0 m]
    #[arg(long, value_name = "POSITION", value_parser = metres, allow_hyphen_values = true)]
    pub at: Option<f64>,
    /// Delay of the model's input, where a fit of it begins [default: that of the controller]
    #[arg(long, value_name = "TIME", value_parser = delay)]
    pub delay: Option<f64>,
    #[command(flatten)]
    pub common: Common,
}

/// Design an experiment: the input that determines parameters best within travel, input and current.
///
/// Searches among trapezoids there and back, sines one after another, a sine of changing frequency, sums of sines and
/// binary sequences for the input whose log makes the standard errors of the parameters smallest: as a fit of such a log
/// would say, with the encoder and the recorder of the case. Prints the experiment as the case file has it, the
/// standard error that it promises of each parameter, and what it cannot determine. With --out it writes designed.toml,
/// the case with the experiment in it, design.json and a report.
#[derive(Debug, clap::Args)]
#[command(after_help = DESIGN)]
pub struct Design {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// The parameters that count, separated by commas [default: the free ones of [fit]]
    #[arg(long = "for", value_name = "KEY", value_delimiter = ',')]
    pub names: Vec<String>,
    /// The inputs to choose among, separated by commas [default: all of them]
    #[arg(long = "input", value_enum, value_name = "INPUT", value_delimiter = ',')]
    pub kinds: Vec<InputName>,
    /// The measure that is made small: the volume of the confidence ellipsoid, or the mean square of the errors
    #[arg(long, value_enum, default_value = "d")]
    pub criterion: CriterionName,
    /// Length of the experiment
    #[arg(long, value_name = "TIME", value_parser = seconds, default_value = "4s")]
    pub duration: f64,
    /// Between samples [default: as [measurement] or the experiments say, or 1 ms]
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub every: Option<f64>,
    /// Share of each limit that is left free
    #[arg(long, value_name = "SHARE", value_parser = share, default_value = "10%")]
    pub margin: f64,
    /// By which share each free parameter may be off, and the limits still hold
    #[arg(long, value_name = "SHARE", value_parser = share, default_value = "20%")]
    pub doubt: f64,
    /// Greatest input, such as "5 V" [default: the amplifier's limit, or the most of the case's experiments]
    #[arg(long, value_name = "INPUT")]
    pub amplitude: Option<String>,
    /// Greatest current, such as "3 A" [default: amplifier.current_limit]
    #[arg(long, value_name = "CURRENT", value_parser = amperes)]
    pub current: Option<f64>,
    /// Way that the cart may take, such as "0.4 m" [default: [travel], or the most of the case's experiments]
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pub travel: Option<f64>,
    /// A quantity that is measured, and the standard deviation of its noise, such as drive_angle=1mrad, as often as
    /// needed [default: [encoder] and [measurement], or what the logs show]
    #[arg(long = "measure", value_name = "QUANTITY=NOISE", value_parser = channel)]
    pub measured: Vec<Channel>,
    /// Also simulate so many logs and fit each: whether the promises hold
    #[arg(long, value_name = "LOGS", value_parser = count)]
    pub verify: Option<usize>,
    /// Which points the search begins with
    #[arg(long, value_name = "N", default_value_t = 1)]
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
    pub fn kind(self) -> InputKind {
        match self {
            Self::Trapezoid => InputKind::Trapezoid,
            Self::Sweep => InputKind::Sweep,
            Self::Chirp => InputKind::Chirp,
            Self::Multisine => InputKind::Multisine,
            Self::Prbs => InputKind::Prbs,
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

Exit status 1: a parameter that counts is not determined by the best experiment that was found.";

const FRF: &str = "\
Examples:
  taut frf axis.toml
  taut frf axis.toml --segment 0.5s --out response
  taut frf axis.toml --period 1s --json | jq .fit.stiffness";
