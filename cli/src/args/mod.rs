//! The command line, and its help: a file for each kind of command.

mod begin;
mod export;
mod logs;
mod loops;
mod runs;
mod values;

pub use self::{begin::*, export::*, logs::*, loops::*, runs::*};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

/// Belt-driven axes: described in a file, simulated exactly.
#[derive(Debug, Parser)]
#[command(name = "taut", version = VERSION, max_term_width = 100, after_help = STATUS)]
pub struct Args {
    #[command(subcommand)]
    pub command: Command,
}

impl Args {
    /// Reads the command line. A negative number is the value of the option before it, whose own error tells what is
    /// allowed.
    pub fn read() -> Result<Self, clap::Error> {
        let with_numbers = |arg: clap::Arg| match arg.get_action().takes_values() {
            true => arg.allow_negative_numbers(true),
            false => arg,
        };
        let command = Self::command().mut_subcommands(|command| command.mut_args(with_numbers));
        command.try_get_matches().and_then(|matches| Self::from_arg_matches(&matches))
    }
}

/// The version, and what this program was built from.
const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("TAUT_BUILT_FROM"), ")");

const STATUS: &str = "\
Start with:
  taut init axis.toml
  taut simulate axis.toml --out results
  taut studio axis.toml

Exit status: 0 success, 1 failure or unreliable result, 2 invalid input, 130 ended by Ctrl-C.";

#[derive(Debug, Subcommand)]
pub enum Command {
    Paper(Paper),
    Init(Init),
    Show(Show),
    Simulate(Simulate),
    Move(Move),
    Tune(Tune),
    Plan(Plan),
    Learn(Learn),
    Sweep(Sweep),
    Check(Check),
    Fit(Fit),
    Shape(Shape),
    Modes(Modes),
    Frf(Frf),
    Design(Design),
    Studio(Studio),
    Export(Export),
    Schema(Schema),
    Completions(Completions),
    Man(Man),
}

impl Command {
    /// True if the result, and an error, is wanted as JSON.
    pub fn json(&self) -> bool {
        match self {
            Self::Paper(args) => args.common.json,
            Self::Show(args) => args.common.json,
            Self::Simulate(args) => args.common.json,
            Self::Move(args) => args.common.json,
            Self::Tune(args) => args.common.json,
            Self::Plan(args) => args.common.json,
            Self::Learn(args) => args.common.json,
            Self::Sweep(args) => args.common.json,
            Self::Check(args) => args.common.json,
            Self::Fit(args) => args.common.json,
            Self::Shape(args) => args.common.json,
            Self::Modes(args) => args.common.json,
            Self::Frf(args) => args.common.json,
            Self::Design(args) => args.common.json,
            Self::Export(args) => args.common.json,
            Self::Init(_) | Self::Studio(_) | Self::Schema(_) | Self::Completions(_) | Self::Man(_) => false,
        }
    }
}
