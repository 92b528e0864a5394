//! The paper, the beginning of a case, the studio, and what the program tells of itself.

use crate::common::Common;
use clap::ValueEnum;
use std::path::PathBuf;

/// Recompute the paper of Sollmann and Jouaneh (2011): every table, figure and claim.
///
/// Writes report.html, claims.json, each figure as SVG and its curves as CSV into out/paper, or where --out says, and
/// prints each claim with its verdict.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  taut paper --out out/paper")]
pub struct Paper {
    #[command(flatten)]
    pub common: Common,
}

/// Open an interactive view of the axis in the browser.
///
/// Serves this computer only, until Ctrl-C ends it. The first line printed is the address of the page, with the token
/// that a browser needs.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  taut studio\n  taut studio axis.toml\n  taut studio axis.toml --port 8080 --no-open"
)]
pub struct Studio {
    /// The case file, which the page can save, or a link copied from the studio
    #[arg(value_name = "CASE|LINK")]
    pub case: Option<String>,
    /// Port of the server [default: a free one]
    #[arg(long, value_name = "N")]
    pub port: Option<u16>,
    /// Do not open a browser
    #[arg(long)]
    pub no_open: bool,
}

/// Print the JSON Schema of the case file or of a result, so that editors complete and check.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  taut schema\n  taut schema case > taut-case.schema.json")]
pub struct Schema {
    /// Name of the schema; without one, all are listed
    pub name: Option<String>,
}

/// Print the completions of the command line for a shell.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  taut completions bash > ~/.local/share/bash-completion/completions/taut")]
pub struct Completions {
    /// The shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// Print the manual page, or write that of every command into a folder.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  taut man | man -l -\n  taut man --out ~/.local/share/man/man1")]
pub struct Man {
    /// Folder for one page per command; created if missing
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Write a commented case file to start from.
///
/// The file describes a complete machine and two experiments, and runs as it is; its comments name further keys.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  taut init axis.toml\n  taut init --template stage stage.toml\n  taut init --kind core-xy gantry.toml"
)]
pub struct Init {
    /// The file to write, such as axis.toml
    pub file: PathBuf,
    /// Kind of machine
    #[arg(long, value_enum, default_value = "axis")]
    pub kind: KindName,
    /// Write a template with the values that data sheets have
    #[arg(long, value_enum, conflicts_with = "kind")]
    pub template: Option<TemplateName>,
    /// Replace the file if it exists
    #[arg(long)]
    pub force: bool,
}

/// A machine to start from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum TemplateName {
    /// A linear stage: a rated motor, an AT5 belt
    Stage,
    /// An axis of a printer: a stepper, a GT2 belt
    Printer,
    /// An axis of a printer: a servo motor by its K_v, a GT2 belt
    PrinterServo,
    /// A CoreXY gantry with GT2 belts
    Gantry,
}

/// A kind of machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum KindName {
    /// One motor, two pulleys, a cart
    Axis,
    /// Two motors and one belt move a cart in a plane
    HFrame,
    /// Two motors, each with a belt of its own, move a cart in a plane
    CoreXy,
    /// Two motors with a belt each move a bridge, a third motor the cart on it
    DualBelt,
}

/// Compute masses, stiffness, frequencies and limits from the numbers of a case, without a simulation.
///
/// Prints the moved mass, the compliance of the belt at the cart, the lowest natural frequency, the breakaway voltage,
/// the largest force, acceleration and speed, and the safety of teeth and tension for a known belt type. --verbose adds
/// the contribution of each part, and stiffness, frequencies and damping along the travel. With --out it writes
/// show.json and a report with everything.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = SHOW)]
pub struct Show {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// Print every row, and how stiffness and resonances change along the travel
    #[arg(long, conflicts_with = "quiet")]
    pub verbose: bool,
    #[command(flatten)]
    pub common: Common,
}

const SHOW: &str = "\
Examples:
  taut show axis.toml
  taut show axis.toml --set belt.pretension=\"80 N\" --set amplifier.voltage_limit=\"24 V\"
  taut show axis.toml --json | jq '.groups[].rows[] | {key, value, unit}'";
