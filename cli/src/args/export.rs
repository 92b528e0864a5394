//! `export`.

use super::values::{metres, seconds};
use crate::common::Common;
use clap::ValueEnum;
use std::path::PathBuf;

/// Export a machine or controller: FMU, C, Structured Text, MATLAB, Python, JSON.
///
/// Without a target it lists all targets. A path in --out with the ending of the target's files names the file, and
/// further files are written beside it under the same name; any other path is a folder, whose files have the name of
/// the case. Without --out it lists the files that it would write.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXPORT, mut_arg("out", |out| out.value_name("PATH").help(
    "The file to write, or the folder for it and for those that belong to it"
)), mut_arg("no_report", |arg| arg.hide(true)), mut_arg("png", |arg| arg.hide(true)))]
pub struct Export {
    /// Target of the export; without one, all are listed
    #[arg(value_enum)]
    pub target: Option<TargetName>,
    /// The case file; - is standard input
    #[arg(required_if_eq_any([
        ("target", "fmu"), ("target", "c"), ("target", "st"), ("target", "matlab"), ("target", "python"),
        ("target", "json"),
    ]))]
    pub case: Option<PathBuf>,
    /// Part of the case to export [default: st: controller; fmu: plant; else both where the case has a controller]
    #[arg(long, value_enum)]
    pub part: Option<PartName>,
    /// C only: floating-point type [default: double]
    #[arg(long, value_enum)]
    pub real: Option<RealName>,
    /// C, MATLAB and Python only: time step of the plant [default: 1 ms]
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub step: Option<f64>,
    /// C, MATLAB and Python only: position of the cart for which spans that follow it are held [default: 0 m]
    #[arg(long, value_name = "POSITION", value_parser = metres, allow_hyphen_values = true)]
    pub at: Option<f64>,
    /// C, MATLAB and Python only: position of the bridge of a gantry for which spans are held [default: 0 m]
    #[arg(long, value_name = "POSITION", value_parser = metres, allow_hyphen_values = true)]
    pub bridge: Option<f64>,
    /// FMU only: version of FMI [default: 3]
    #[arg(long, value_name = "VERSION", value_parser = clap::value_parser!(u8).range(2..=3))]
    pub fmi: Option<u8>,
    #[command(flatten)]
    pub common: Common,
}

const EXPORT: &str = "\
Examples:
  taut export
  taut export c axis.toml --out firmware/axis.c --real float
  taut export matlab stages/sollmann-jouaneh/table4.toml --out model
  taut export st stages/sollmann-jouaneh/controllers/pid.toml --out pid.st
  taut export json axis.toml --json | jq .linear";

/// Targets of an export.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum TargetName {
    /// A functional mock-up unit: one file for any tool that imports FMI
    Fmu,
    /// Two files of C99 without dependencies: plant and controller
    C,
    /// The controller as function blocks of IEC 61131-3
    St,
    /// Functions and a MAT-file for MATLAB and Octave
    Matlab,
    /// A script with NumPy, SciPy and python-control
    Python,
    /// The whole model as data
    Json,
}

/// A part of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PartName {
    /// The machine, its command as input
    Plant,
    /// The controller, reference and measurement as inputs
    Controller,
    /// Both
    Both,
}

/// Numbers of C.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RealName {
    /// 32 bits
    Float,
    /// 64 bits
    Double,
}
