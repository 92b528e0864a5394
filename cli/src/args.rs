//! The command line, and its help.

use crate::command::Common;
use clap::{Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use taut::control::recommendation::Damping;
use taut::control::shaper::{Firmware, Form};
use taut::fit::experiment_design::{Criterion, Kind as InputKind};
use taut::quantity;
use taut::solve::{Choice, Kind as SolverKind, Method, Solver};
use taut::stage::{Channel, Quantity, Stage};

/// Belt-driven axes: described in a file, simulated exactly.
#[derive(Debug, Parser)]
#[command(name = "taut", version = VERSION, max_term_width = 100, after_help = STATUS)]
pub struct Args {
    #[command(subcommand)]
    pub command: Command,
}

/// The version, and what this program was built from.
const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("TAUT_BUILT_FROM"), ")");

const STATUS: &str = "\
Start with:
  taut init axis.toml
  taut simulate axis.toml --out results
  taut studio axis.toml

Exit status: 0 done, 1 the work could not be done or its result is not to be relied on,
2 the input was wrong, 130 ended by Ctrl-C.";

#[derive(Debug, Subcommand)]
pub enum Command {
    Paper(Paper),
    Init(Init),
    Show(Show),
    Simulate(Simulate),
    Move(Move),
    Tune(Tune),
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
    /// Whether the result, and an error, is wanted as JSON.
    pub fn json(&self) -> bool {
        match self {
            Self::Paper(args) => args.common.json,
            Self::Show(args) => args.common.json,
            Self::Simulate(args) => args.common.json,
            Self::Move(args) => args.common.json,
            Self::Tune(args) => args.common.json,
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
    /// The case file; - is standard input. Several are run one after the other, each into a folder of its own name in --out
    #[arg(required = true)]
    pub cases: Vec<PathBuf>,
    /// Run only the experiment of this name, as often as needed
    #[arg(long = "experiment", value_name = "NAME")]
    pub experiments: Vec<String>,
    /// How the equations are solved [default: exact, or general where the stage needs it]
    #[arg(long, value_enum)]
    pub solver: Option<SolverName>,
    /// About what positions are off by with --solver general, m [default: 1e-9]
    #[arg(long, value_name = "NUMBER")]
    pub tolerance: Option<f64>,
    /// Step of --solver table3 [default: 0.1 ms]
    #[arg(long, value_name = "TIME", value_parser = step)]
    pub step: Option<f64>,
    /// Formula of --solver table3 [default: rk4]
    #[arg(long, value_enum)]
    pub method: Option<MethodName>,
    /// Formats of the quantities over time, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', value_name = "FORMAT", default_value = "csv")]
    pub format: Vec<Format>,
    /// Also write each run as a recorder logs it: [encoder] and [measurement] of the case
    #[arg(long, requires = "out")]
    pub as_measured: bool,
    /// Also run machines drawn by `taut fit --posterior`, and write the band that 95 % of them stay in
    #[arg(long, value_name = "FILE")]
    pub draws: Option<PathBuf>,
    /// How many of them to run
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
  taut simulate axis.toml --solver table3 --step 1ms --out as-printed

Ctrl-C ends a run early: what was computed until then is written and reported, with exit status 130.";

/// Run the moves of a case in closed loop: the controller sampled, the axis exact.
///
/// Prints for each move how far the drive pulley and the cart are from where the cart should be, when the cart settles,
/// by how much it overshoots, and what belt and motor take. With --out it also writes, for each move, every quantity
/// over time and the controller's samples as CSV, the events and the plots, and for all of them a report and a summary
/// as JSON. With several cases it prints one table for each move, to compare controllers.
#[derive(Debug, clap::Args)]
#[command(after_help = MOVE)]
pub struct Move {
    /// The case file; several to compare them
    #[arg(required = true)]
    pub case: Vec<PathBuf>,
    /// Run only the move of this name, as often as needed
    #[arg(long = "move", value_name = "NAME")]
    pub moves: Vec<String>,
    /// Also run with each parameter of the axis wrong by this share, the controller knowing nothing of it: 20%
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub spread: Option<f64>,
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

/// Find gains and filters for the controller in a case, good for the machines that it may meet
///
/// Makes settling, cart error and current of the moves small, at worst over a family of machines (parameters off,
/// loads, places), while the sampled loop keeps its limits of sensitivity there. Says in its first line whether the
/// moves became better or worse. Prints gains, margins, moves and limit cycles before and after.
#[derive(Debug, clap::Args)]
#[command(after_help = TUNE, mut_arg("out", |out| out.value_name("FILE or DIR").help(
    "The case file to write (ends in .toml), or the folder for it, a summary, a report and plots"
)))]
pub struct Tune {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// Write the gains into the case file itself, unless they make a move worse
    #[arg(long, conflicts_with = "out")]
    pub in_place: bool,
    /// With --in-place: write them even if they make a move worse
    #[arg(long, requires = "in_place")]
    pub anyway: bool,
    /// Judge the gains of the file without a search
    #[arg(long, conflicts_with_all = ["in_place", "out"])]
    pub evaluate: bool,
    /// Let all parameters be at their worst ends at once, and leave no axis out
    #[arg(long)]
    pub corners: bool,
    /// Let each parameter of the axis be off by this share, whatever the file says: 20%
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub spread: Option<f64>,
    /// Take the machines from the draws of `taut fit --posterior`, whatever the file says of how far they are off
    #[arg(long, value_name = "FILE", conflicts_with = "spread")]
    pub draws: Option<PathBuf>,
    #[command(flatten)]
    pub common: Common,
}

const TUNE: &str = "\
Examples:
  taut tune stages/sollmann-jouaneh/controllers/pid.toml --out tuned
  taut tune axis.toml --set tune.sensitivity=1.6 --set 'tune.load=[0, \"1 kg\"]' --out axis-tuned.toml
  taut tune axis.toml --set tune.cost=none --set tune.bandwidth=8Hz
  taut tune axis.toml --evaluate --json | jq .before.objective

Exit status 1: a move became worse than with the gains of the file (the limits may force that), or the limits
do not hold. Ctrl-C ends a search early with the best gains so far, with exit status 130.";

/// Run a case many times with its parameters varied.
///
/// Prints how each key figure is spread and which parameters it depends on. With --out FILE it writes a row for each
/// run, as Parquet (units in its metadata) or CSV; with --out DIR also a summary, a report and plots. The same command
/// resumes an interrupted or killed one. Rows are the same, bit for bit, on any number of threads.
#[derive(Debug, clap::Args)]
#[command(after_help = SWEEP, mut_arg("out", |out| out.value_name("FILE or DIR").help(
    "The file of the rows (ends in .parquet or .csv), or the folder for it, a summary, a report and plots"
)))]
pub struct Sweep {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// How many machines to run
    #[arg(long, value_name = "N")]
    pub runs: Option<String>,
    /// How a parameter varies, as often as needed; `all` is every number of the machine that is not zero
    #[arg(long, value_name = "KEY=HOW")]
    pub vary: Vec<String>,
    /// How machines are chosen: random, latin-hypercube, sobol, grid or one-at-a-time [default: random]
    #[arg(long, value_name = "DESIGN")]
    pub design: Option<String>,
    /// Which draws: a whole number from 0 to 9223372036854775807 [default: 1]
    #[arg(long, value_name = "NUMBER")]
    pub seed: Option<u64>,
    /// Also compute Sobol' indices: N (k + 2) runs for k parameters
    #[arg(long)]
    pub indices: bool,
    /// Figures to tell, by the names of their columns, separated by commas: others are not sought [default: all]
    #[arg(long, value_name = "A,B,...", value_delimiter = ',')]
    pub figures: Vec<String>,
    /// Interval between the rows of --trajectories; figures do not depend on it [default: the experiment's]
    #[arg(long, value_name = "TIME")]
    pub interval: Option<String>,
    /// Also write every quantity over time of every run
    #[arg(long, requires = "out")]
    pub trajectories: bool,
    /// How many threads [default: as many as there are processors]
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
grid(FROM, TO, COUNT) or factors(A, B, ...). What is varied can stand in the case instead, as [sweep].

Ctrl-C keeps what is done, with exit status 130; the same command then goes on.";

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
    /// Laws to compare, separated by commas: viscous, coulomb, asymmetric, stribeck, along, lugre [default: all but
    /// lugre]
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
What is not determined is ± ∞ and keeps its value in fitted.toml; the exit status is 1, too.
Ctrl-C ends a fit early: the best so far is written and said not to be converged, with exit status 130.";

/// Recommend an input shaper, from a measured spectrum or from a model.
///
/// Takes a spectrum (Klipper's resonances_*.csv, calibration_data_*.csv), raw accelerometer samples (raw_data_*.csv),
/// or a case file, whose resonances along the travel are computed. Prints for each shaper the best frequency, the
/// vibration that remains, smoothing and the greatest acceleration, which one to take, and the lines for Klipper's
/// configuration. A second spectrum is compared with the first; with --together one shaper is chosen for all.
#[derive(Debug, clap::Args)]
#[command(after_help = SHAPE)]
pub struct Shape {
    /// A spectrum, accelerometer samples, or a case file (.toml)
    pub spectrum: PathBuf,
    /// Another one to compare: the other belt, or after a change; with --together any number
    pub others: Vec<PathBuf>,
    /// One shaper for all of the spectra: of each the one counts of which most remains
    #[arg(long)]
    pub together: bool,
    /// Whose definitions of shapers, and whose rule to choose one [default: klipper, as it is since 2026-03]
    #[arg(long, value_enum, default_value_t, hide_default_value = true)]
    pub firmware: FirmwareName,
    /// Axis of the accelerometer [default: the sum of x, y and z]
    #[arg(long, value_enum)]
    pub axis: Option<AxisName>,
    /// Damping ratio that shapers are designed for, or "fitted" for that of a spectrum's highest peak [default: 0.1, or
    /// the model's]
    #[arg(long, value_name = "RATIO", value_parser = damping)]
    pub damping: Option<Damping>,
    /// Most smoothing that is allowed, such as "0.1 mm" [default: any]
    #[arg(long, value_name = "LENGTH", value_parser = smoothing)]
    pub max_smoothing: Option<f64>,
    /// Most vibration that is wanted, in per cent of that without a shaper; a quieter shaper is then taken although it
    /// smooths more
    #[arg(long, value_name = "PERCENT", value_parser = vibrations)]
    pub max_vibrations: Option<f64>,
    /// Speed at right-angled corners, of which smoothing is computed [default: "5 mm/s"]
    #[arg(long, value_name = "SPEED", value_parser = corner_speed)]
    pub corner_speed: Option<f64>,
    /// Shapers to choose from, separated by commas: zv, mzv, zvd, ei, 2hump_ei, 3hump_ei, mzv(n=4,t=0.9), ei(v_tol=0.1)
    /// [default: all but zvd]
    #[arg(long, value_name = "NAMES", value_parser = shapers)]
    pub shapers: Option<Shapers>,
    /// Look at pairs of shapers, too, one behind the other: for two modes, or for a mode that moves far along the travel
    #[arg(long)]
    pub pairs: bool,
    /// Of a case file: by which part its frequencies may be wrong [default: 0.1]
    #[arg(long, value_name = "PART", value_parser = uncertainty)]
    pub uncertainty: Option<f64>,
    /// Of a case file: what the motor does [default: held]
    #[arg(long, value_enum)]
    pub motor: Option<MotorName>,
    #[command(flatten)]
    pub common: Common,
}

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

/// Take a machine, or its controller, to other tools: FMU, C, Structured Text, MATLAB, Python, JSON.
///
/// Without a name it lists what there is. A path in --out that ends as the target's files do names the file, and the
/// others of the target stand beside it under the same name; any other path is a folder, and the files in it are called
/// after the case. Without --out it says what would be written.
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
    /// Which part of the case [default: st: controller; fmu: plant; else both where the case has a controller]
    #[arg(long, value_enum)]
    pub part: Option<PartName>,
    /// Of c: the numbers that it computes in [default: double]
    #[arg(long, value_enum)]
    pub real: Option<RealName>,
    /// Of c, matlab and python: the step of the plant [default: 1 ms]
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub step: Option<f64>,
    /// Of fmu: the version of the standard [default: 3]
    #[arg(long, value_name = "VERSION", value_parser = clap::value_parser!(u8).range(2..=3))]
    pub fmi: Option<u8>,
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
    /// Two files of C99 with nothing below them: plant and controller
    C,
    /// The controller as function blocks of IEC 61131-3
    St,
    /// Functions and a MAT-file for MATLAB and Octave
    Matlab,
    /// A script on NumPy, SciPy and python-control
    Python,
    /// All about the model as data
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

/// Say how a machine swings: poles, zeros, frequency response, resonance along the travel.
///
/// Linearises the stage of a case while everything slides, and prints its poles with frequency and damping, the gain
/// and the zeros of each output, and resonance and anti-resonance along the travel; with --sample-time also its
/// discrete-time model. With --out it also writes modes.json with the matrices, frequency-response.csv, and a report
/// with a Bode diagram, a map of the travel and a map of poles and zeros.
///
/// Of a gantry it prints rigid and elastic modes with frequency, damping and shape, and their frequencies over the
/// working area; with --out it writes modes.json, map.csv and a report with the maps.
#[derive(Debug, clap::Args)]
#[command(after_help = MODES)]
pub struct Modes {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// Where the cart is; matters to spans that follow it and to friction along the travel [default: 0 m]
    #[arg(long, value_name = "POSITION", value_parser = metres, allow_hyphen_values = true)]
    pub at: Option<f64>,
    /// Speed of the cart at which everything slides; 0 is at rest, below 0 backward [default: 0.1 m/s]
    #[arg(long, value_name = "SPEED", value_parser = metres_per_second, allow_hyphen_values = true)]
    pub speed: Option<f64>,
    /// Bodies that stick and are held where they are, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', value_name = "BODY")]
    pub stuck: Vec<BodyName>,
    /// Also give the discrete-time model for this sample time
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub sample_time: Option<f64>,
    /// Input between samples [default: zero]
    #[arg(long, value_enum, requires = "sample_time")]
    pub hold: Option<HoldName>,
    /// By how much the input is late, computing time for one [default: 0 s]
    #[arg(long, value_name = "TIME", value_parser = delay, requires = "sample_time")]
    pub delay: Option<f64>,
    /// Lowest frequency of the response, in Hz [default: below the slowest pole or zero]
    #[arg(long, value_name = "FREQUENCY", value_parser = hertz)]
    pub from: Option<f64>,
    /// Highest frequency of the response, in Hz [default: above the fastest resonance]
    #[arg(long, value_name = "FREQUENCY", value_parser = hertz)]
    pub to: Option<f64>,
    #[command(flatten)]
    pub common: Common,
}

const SHAPE: &str = "\
Examples:
  taut shape resonances_x_20210821_152037.csv --out shaped
  taut shape raw_data_x.csv --axis x --max-smoothing \"0.15 mm\"
  taut shape belt_a.csv belt_b.csv
  taut shape --together raw_data_x_left.csv raw_data_x_middle.csv raw_data_x_right.csv
  taut shape raw_data_x.csv --shapers \"mzv(n=4,t=0.9),ei(v_tol=0.02)\" --max-vibrations 2
  taut shape axis.toml --set cart.mass=\"0.5 kg\" --json | jq .recommended";

const FRF: &str = "\
Examples:
  taut frf axis.toml
  taut frf axis.toml --segment 0.5s --out response
  taut frf axis.toml --period 1s --json | jq .fit.stiffness";

/// Shapers with their parameters.
#[derive(Debug, Clone)]
pub struct Shapers(pub Vec<Form>);

/// Whose shapers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum FirmwareName {
    /// Klipper as it is since 2026-03: shapers of 2025-09, choice of 2025-10, parameters of mzv and ei
    #[default]
    Klipper,
    /// Klipper until 2025-08
    #[value(name = "klipper-2025-08")]
    Klipper202508,
}

impl From<FirmwareName> for Firmware {
    fn from(name: FirmwareName) -> Self {
        match name {
            FirmwareName::Klipper => Firmware::Klipper,
            FirmwareName::Klipper202508 => Firmware::Klipper202508,
        }
    }
}

/// An axis of the accelerometer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum AxisName {
    /// x alone
    X,
    /// y alone
    Y,
    /// z alone
    Z,
}

/// State of the motor while the cart vibrates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MotorName {
    /// It follows its command, as a stepper motor or a stiff position loop makes it
    Held,
    /// It is free, as with a commanded voltage or current
    Free,
}

const MODES: &str = "\
Examples:
  taut modes axis.toml
  taut modes axis.toml --out modes --sample-time 1ms --delay 0.5ms
  taut modes axis.toml --at \"120 mm\" --speed \"20 mm/s\"
  taut modes axis.toml --stuck cart,idler --json | jq .poles";

/// A body that can be held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BodyName {
    /// The drive pulley
    Drive,
    /// The cart
    Cart,
    /// The idler pulley
    Idler,
}

/// Input between samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum HoldName {
    /// It stands: what a converter puts out
    #[default]
    Zero,
    /// It goes straight from sample to sample
    First,
    /// The bilinear rule, an approximation
    Tustin,
}

/// How the equations are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SolverName {
    /// Exact to rounding: stick, slip and matrix exponentials
    Exact,
    /// Collocation with steps by the error: any friction law, spans that follow the cart
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
    /// Text, with every digit that matters
    Csv,
    /// Columns of doubles with their units
    #[cfg(feature = "parquet")]
    Parquet,
}

impl Simulate {
    /// The solver that is asked for, or else the one for this stage.
    pub fn solver(&self, stage: &Stage) -> taut::Result<Solver> {
        self.choice().solver(stage)
    }

    /// The solver that is asked for, with its settings.
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

/// A number of draws or chains.
fn count(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(number @ 1..=1_000_000) => Ok(number),
        _ => Err("a whole number from 1 to 1000000 is needed".into()),
    }
}

fn share(text: &str) -> Result<f64, String> {
    let share = match text.parse() {
        Ok(number) => number,
        Err(_) => quantity::read(text, "").map_err(|e| e.to_string())?,
    };
    if (0.0..1.0).contains(&share) { Ok(share) } else { Err("a share from 0 to below 1 is needed, such as 20%".into()) }
}

/// A number in the SI unit, or with a unit of its own.
fn number(text: &str, unit: &str) -> Result<f64, String> {
    let value = match text.parse() {
        Ok(number) => number,
        Err(_) => quantity::read(text, unit).map_err(|e| e.to_string())?,
    };
    if f64::is_finite(value) { Ok(value) } else { Err("a finite number is needed".into()) }
}

fn metres(text: &str) -> Result<f64, String> {
    number(text, "m")
}

fn length(text: &str) -> Result<f64, String> {
    positive(text, "m", "length above zero, such as \"0.4 m\",")
}

fn amperes(text: &str) -> Result<f64, String> {
    positive(text, "A", "current above zero, such as \"3 A\",")
}

/// A measured quantity and its noise: `drive_angle=1mrad`.
fn channel(text: &str) -> Result<Channel, String> {
    let names = || Quantity::ALL.map(Quantity::name).join(", ");
    let (name, noise) = text.split_once('=').ok_or("a quantity and its noise are needed, such as drive_angle=1mrad")?;
    let quantity = Quantity::ALL.into_iter().find(|quantity| quantity.name() == name.trim());
    let quantity =
        quantity.ok_or_else(|| format!("`{}` is no measured quantity; there are {}", name.trim(), names()))?;
    let noise = positive(noise.trim(), quantity.unit(), "standard deviation above zero")?;
    Ok(Channel { quantity, step: None, noise, range: None })
}

fn metres_per_second(text: &str) -> Result<f64, String> {
    number(text, "m/s")
}

fn positive(text: &str, unit: &str, needed: &str) -> Result<f64, String> {
    match number(text, unit)? {
        value if value > 0.0 => Ok(value),
        _ => Err(format!("a {needed} is needed")),
    }
}

fn step(text: &str) -> Result<f64, String> {
    positive(text, "s", "step above zero, such as 0.1ms,")
}

fn delay(text: &str) -> Result<f64, String> {
    match number(text, "s")? {
        value if value >= 0.0 => Ok(value),
        _ => Err("a time of 0 s or more is needed, such as 0.1ms".into()),
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    positive(text, "s", "time above zero, such as 0.1ms,")
}

fn hertz(text: &str) -> Result<f64, String> {
    positive(text, "Hz", "frequency above zero, such as 10Hz,")
}

fn smoothing(text: &str) -> Result<f64, String> {
    if text.trim().parse::<f64>().is_ok() {
        return Err("a length with its unit is needed, such as \"0.1 mm\"".into());
    }
    let length = quantity::read(text, "m").map_err(|e| e.to_string())?;
    if (1e-7..=0.1).contains(&length) {
        return Ok(length);
    }
    Err("a length from 0.0001 mm to 100 mm is needed, such as \"0.1 mm\"".into())
}

fn corner_speed(text: &str) -> Result<f64, String> {
    if text.trim().parse::<f64>().is_ok() {
        return Err("a speed with its unit is needed, such as \"5 mm/s\"".into());
    }
    let speed = quantity::read(text, "m/s").map_err(|e| e.to_string())?;
    if (0.0..=10.0).contains(&speed) {
        Ok(speed)
    } else {
        Err("a speed from 0 to 10 m/s is needed, such as \"5 mm/s\"".into())
    }
}

fn shapers(text: &str) -> Result<Shapers, String> {
    // A comma within parentheses parts parameters.
    let (mut all, mut depth, mut from) = (Vec::new(), 0, 0);
    for (place, character) in text.char_indices().chain([(text.len(), ',')]) {
        match character {
            '(' => depth += 1,
            ')' => depth -= 1,
            ',' if depth <= 0 || place == text.len() => {
                all.push(Form::read(&text[from..place]).map_err(|e| e.to_string())?);
                from = place + 1;
            }
            _ => {}
        }
    }
    Ok(Shapers(all))
}

fn damping(text: &str) -> Result<Damping, String> {
    match text.trim() {
        "fitted" => Ok(Damping::Fitted),
        text => {
            text.parse().map(Damping::Ratio).map_err(|_| "a damping ratio such as 0.08 is needed, or \"fitted\"".into())
        }
    }
}

fn vibrations(text: &str) -> Result<f64, String> {
    match text.trim().trim_end_matches('%').trim_end().parse::<f64>() {
        Ok(percent) if (0.1..=100.0).contains(&percent) => Ok(0.01 * percent),
        _ => Err("per cent from 0.1 to 100 are needed, such as 5".into()),
    }
}

fn uncertainty(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(part) if (0.0..=0.5).contains(&part) => Ok(part),
        _ => Err("a part from 0 to 0.5 is needed, such as 0.1 for 10 %".into()),
    }
}
