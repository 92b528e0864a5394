//! Runs: `simulate`, `move`, `sweep`.

use super::values::{count, seed, share, step};
use crate::common::Common;
use clap::ValueEnum;
use std::path::PathBuf;
use taut::machine::Machine;
use taut::solve::{Choice, Method, Solver, SolverKind};

/// Run the experiments of a case file.
///
/// Prints the key figures of each experiment. With --out it also writes, for each experiment, every quantity over time
/// (CSV, Parquet), its stick and slip events and its plots, and for all of them a report, a summary as JSON, and the
/// case file that repeats the run.
///
/// A length, a force or a time on the command line is written as in the case file: "0.5 kg", 0.1ms, "24 V".
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = SIMULATE)]
pub struct Simulate {
    /// The case file; - is standard input. Several are run one after the other, each into a folder of its own name in
    /// --out
    #[arg(required = true)]
    pub cases: Vec<PathBuf>,
    /// Run only the experiment of this name; may be repeated
    #[arg(long = "experiment", value_name = "NAME")]
    pub experiments: Vec<String>,
    /// Solver [default: exact, or general if the machine needs it]
    #[arg(long, value_enum)]
    pub solver: Option<SolverName>,
    /// Position tolerance of --solver general, m [default: 1e-9]
    #[arg(long, value_name = "NUMBER")]
    pub tolerance: Option<f64>,
    /// Step of --solver table3 [default: 0.1 ms]
    #[arg(long, value_name = "TIME", value_parser = step)]
    pub step: Option<f64>,
    /// Integration formula of --solver table3 [default: rk4]
    #[arg(long, value_enum)]
    pub method: Option<MethodName>,
    /// Formats of the quantities over time, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', value_name = "FORMAT", default_value = "csv")]
    pub format: Vec<Format>,
    /// Also write each run as a recorder logs it: [encoder] and [measurement] of the case
    #[arg(long, requires = "out")]
    pub as_measured: bool,
    /// Put the machine in motion into the report, for each experiment
    #[arg(long, requires = "out", conflicts_with = "no_report")]
    pub live: bool,
    /// Also run machines drawn by `taut fit --posterior`, and write the 95 % band of their motion
    #[arg(long, value_name = "FILE")]
    pub draws: Option<PathBuf>,
    /// Number of drawn machines to run
    #[arg(long, value_name = "N", default_value_t = 200, requires = "draws", value_parser = count)]
    pub machines: usize,
    #[command(flatten)]
    pub common: Common,
}

const SIMULATE: &str = "\
Examples:
  taut simulate axis.toml
  taut simulate axis.toml --out results
  taut simulate axis.toml --set cart.mass=\"0.5 kg\" --set experiment.0.until=2s
  taut simulate axis.toml --experiment \"5 V pulse\" --json | jq .experiments[0].metrics
  taut simulate axis.toml --as-measured --out results
  taut simulate axis.toml --live --out results
  taut simulate axis.toml --solver table3 --step 1ms --out as-printed

Ctrl-C ends a run early: the results so far are written and reported, with exit status 130.";

/// Run the moves of a case in closed loop: the controller sampled, the axis exact.
///
/// Prints for each move the errors of cart and drive pulley, settling time, overshoot, and the load on belt and motor.
/// With --out it also writes, for each move, every quantity over time and the controller's samples as CSV, the events
/// and the plots, and for all of them a report and a summary as JSON. With several cases it prints one table for each
/// move, to compare controllers.
#[derive(Debug, clap::Args)]
#[command(after_help = MOVE)]
pub struct Move {
    /// The case file; several to compare them
    #[arg(required = true)]
    pub case: Vec<PathBuf>,
    /// Run only the move of this name; may be repeated
    #[arg(long = "move", value_name = "NAME")]
    pub moves: Vec<String>,
    /// Also run with each parameter of the axis off by this share, unknown to the controller: 20%
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub spread: Option<f64>,
    /// Add the signal of this file to the command, as `taut learn` wrote it: time_s and added_V or added_A
    /// (left_added_V and so on of a gantry); one case and
    /// one move
    #[arg(long, value_name = "FILE")]
    pub added: Option<PathBuf>,
    /// Also print feed-forward gains for WPILib, LinuxCNC, ODrive and Beckhoff, from the model
    #[arg(long)]
    pub drives: bool,
    #[command(flatten)]
    pub common: Common,
}

const MOVE: &str = "\
Examples:
  taut move stages/sollmann-jouaneh/controllers/pid.toml --out results
  taut move axis.toml --set controller.delay=1ms --json | jq .moves[0].cart_error
  taut move stages/sollmann-jouaneh/controllers/*.toml --spread 20%";

/// Run a case many times with its parameters varied.
///
/// Prints the distribution of the main figures and the parameters that each depends on, with --verbose of all that
/// vary. With --out FILE it writes a row for each run, as Parquet (units in its metadata) or CSV; with --out DIR also a
/// summary, a report and plots. The same command resumes an interrupted or killed one. Rows are the same, bit for bit,
/// on any number of threads.
#[derive(Debug, clap::Args)]
#[command(after_help = SWEEP, mut_arg("out", |out| out.value_name("FILE or DIR").help(
    "The file of the rows (ends in .parquet or .csv), or the folder for it, a summary, a report and plots"
)))]
pub struct Sweep {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// Print all figures that vary instead of the first five of each experiment
    #[arg(long, conflicts_with = "quiet")]
    pub verbose: bool,
    /// Number of machines to run
    #[arg(long, value_name = "N")]
    pub runs: Option<String>,
    /// Distribution of a parameter; may be repeated; `all` is every number of the machine that is not zero
    #[arg(long, value_name = "KEY=HOW")]
    pub vary: Vec<String>,
    /// Design of the runs: random, latin-hypercube, sobol, grid or one-at-a-time [default: random]
    #[arg(long, value_name = "DESIGN")]
    pub design: Option<String>,
    /// Seed of the random numbers, from 0 to 9223372036854775807 [default: 1]
    #[arg(long, value_name = "NUMBER", value_parser = seed)]
    pub seed: Option<u64>,
    /// Also compute Sobol' indices: N (k + 2) runs for k parameters
    #[arg(long)]
    pub indices: bool,
    /// Figures to compute, by the names of their columns, separated by commas [default: all]
    #[arg(long, value_name = "A,B,...", value_delimiter = ',')]
    pub figures: Vec<String>,
    /// Solver: lanes, many machines side by side where that is faster, or exact, one by one [default: lanes]
    #[arg(long, value_name = "SOLVER")]
    pub solver: Option<String>,
    /// Interval between the rows of --trajectories; figures do not depend on it [default: the experiment's]
    #[arg(long, value_name = "TIME")]
    pub interval: Option<String>,
    /// Also write every quantity over time of every run
    #[arg(long, requires = "out")]
    pub trajectories: bool,
    /// Number of threads [default: number of processors]
    #[arg(long, value_name = "T", value_parser = count)]
    pub threads: Option<usize>,
    #[command(flatten)]
    pub common: Common,
}

const SWEEP: &str = "\
Examples:
  taut sweep axis.toml --runs 10000 --vary all=20% --out runs.parquet
  taut sweep axis.toml --runs 10000 --vary 'cart.mass=uniform(0.3 kg, 0.6 kg)' \\
      --vary 'cart.friction.coulomb=normal(0.2 N, 0.02 N)' --design sobol --out results
  taut sweep axis.toml --runs 1024 --vary all=10% --design sobol --indices --out results
  taut sweep axis.toml --design one-at-a-time --vary 'all=factors(2, 0.5)' --out tornado
  taut sweep fit/fitted.toml --runs 1000 --set sweep.from=uncertainty

HOW is a share such as 20%, uniform(LEAST, MOST), normal(MEAN, DEVIATION), log-normal(MEDIAN, DEVIATION), values(A, B, ...),
grid(FROM, TO, COUNT) or factors(A, B, ...). The case can contain distributions instead, in [sweep].

Ctrl-C keeps the finished runs, with exit status 130; the same command then continues.";

/// How the equations are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SolverName {
    /// Exact to rounding: stick, slip and matrix exponentials
    Exact,
    /// Adaptive collocation: any friction law, spans that follow the cart
    General,
    /// The friction function of the paper's Table 3 with a fixed step, to reproduce the paper
    Table3,
}

/// A fixed-step formula.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum MethodName {
    /// The classical Runge-Kutta formula of order 4
    #[default]
    Rk4,
    /// The Dormand-Prince formula of order 5
    Dp5,
}

/// A format of the quantities over time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Text with full precision
    Csv,
    /// Columns of doubles with their units
    #[cfg(feature = "parquet")]
    Parquet,
}

impl Simulate {
    /// The requested solver, or else the one that the machine needs.
    pub fn solver(&self, machine: &Machine) -> taut::Result<Solver> {
        self.choice().solver(machine)
    }

    /// The requested solver, with its settings.
    pub fn choice(&self) -> Choice {
        let kind = |name: SolverName| match name {
            SolverName::Exact => SolverKind::Exact,
            SolverName::General => SolverKind::General,
            SolverName::Table3 => SolverKind::Table3,
        };
        let method = |name: MethodName| match name {
            MethodName::Rk4 => Method::RungeKutta4,
            MethodName::Dp5 => Method::DormandPrince5,
        };
        let (tolerance, step) = (self.tolerance, self.step);
        Choice { solver: self.solver.map(kind), tolerance, step, method: self.method.map(method) }
    }
}
