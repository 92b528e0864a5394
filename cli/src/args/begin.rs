//! The paper, the beginning of a case, the studio, and what the program tells of itself.

use crate::command::Common;
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

/// Open a page in the browser where the axis is alive: seen, dragged, compared.
///
/// Serves this computer alone, until Ctrl-C ends it. The first line printed is the address of the page, with the token
/// that lets a browser in.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  taut studio\n  taut studio axis.toml\n  taut studio axis.toml --port 8080 --no-open"
)]
pub struct Studio {
    /// The case file, which the page can save; or a link that a studio gave
    #[arg(value_name = "CASE|LINK")]
    pub case: Option<String>,
    /// Port of the server; a free one if not said
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
    /// Which one; without a name they are listed
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
    /// The folder for one page for each command; it is made if it is not there
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Write a commented case file to start from.
///
/// The file describes a complete machine and two experiments, and simulates as it stands; its remarks name what can be
/// added.
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
    /// Start from data sheets: a machine of this sort, by the keys that data sheets have
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
    /// An axis of a printer: a motor by its K_v, a GT2 belt
    Printer,
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
}

/// Say what follows from the numbers of a case: masses, stiffness, frequencies, limits.
///
/// Prints the moved mass with all that turns as seen at the cart, the stiffness of the spans and how much the cart
/// gives way per newton, natural frequencies with their damping along the travel, the voltage at which the axis breaks
/// away, the largest force, acceleration and speed, and what is left of teeth and tension where the belt's type says
/// what they bear. Nothing is simulated. With --out it writes show.json and a report.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = SHOW)]
pub struct Show {
    /// The case file; - is standard input
    pub case: PathBuf,
    #[command(flatten)]
    pub common: Common,
}

const SHOW: &str = "\
Examples:
  taut show axis.toml
  taut show axis.toml --set belt.pretension=\"80 N\" --set amplifier.voltage_limit=\"24 V\"
  taut show axis.toml --json | jq '.groups[].rows[] | {key, value, unit}'";
