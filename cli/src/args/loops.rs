//! Vibrations and controllers: `modes`, `tune`, `shape`.

use super::values::{
    Shapers, acceleration, corner_speed, damping, delay, effort, hertz, jerk, metre_unit, metres, metres_per_second,
    reserve, seconds, shapers, share, smoothing, speed, uncertainty, vibrations,
};
use crate::common::Common;
use clap::ValueEnum;
use std::path::PathBuf;
use taut::control::recommendation::Damping;
use taut::control::shaper::Firmware;
use taut::machine::Machine;
use taut::{Error, Result};

/// Find gains and filters for the controller of a case that hold over a family of machines
///
/// Minimises settling time, cart error and current of the moves in the worst case over a family of machines (other
/// parameters, loads, positions), within limits on the sensitivity of the sampled loop. The first line is the verdict:
/// better, unchanged or worse. Prints gains and worst margins before and after; --verbose adds all margins, moves,
/// machines and limit cycles.
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
    /// Add all combinations of extreme parameters, and exclude no machine from the worst case
    #[arg(long)]
    pub corners: bool,
    /// Relative uncertainty of each parameter, in place of the file's, such as 20%
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub spread: Option<f64>,
    /// Take the machines from the draws of `taut fit --posterior`
    #[arg(long, value_name = "FILE", conflicts_with = "spread")]
    pub draws: Option<PathBuf>,
    /// Multiply the search budget by this factor; improves the gains by some per cent
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = effort, conflicts_with = "evaluate")]
    pub effort: f64,
    /// Print all margins, each move, the choices, the axes and the limit cycles, too
    #[arg(long, conflicts_with = "quiet")]
    pub verbose: bool,
    #[command(flatten)]
    pub common: Common,
}

const TUNE: &str = "\
Examples:
  taut tune stages/sollmann-jouaneh/controllers/pid.toml --out tuned
  taut tune axis.toml --set tune.sensitivity=1.6 --set 'tune.load=[0, \"1 kg\"]' --out axis-tuned.toml
  taut tune axis.toml --set tune.cost=none --set tune.bandwidth=8Hz
  taut tune axis.toml --evaluate --json | jq .before.objective

Exit status 1: a move is worse than with the gains of the file (the limits may force that), or the limits do
not hold. Ctrl-C ends a search early with the best gains so far, with exit status 130.";

/// Plan the fastest moves that the machine can make.
///
/// Finds for each move of a case the speed, acceleration, jerk and snap with which the cart stays in its window
/// soonest, on the slowest of the family of machines of `taut tune`, within the limits of voltage, current, span
/// tension and teeth. Jerk times are multiples of the periods of the belt's modes. Prints the planned limits beside the
/// file's, and the least time of the axis as one mass. With --out FILE.toml it writes the case with the planned limits.
#[derive(Debug, clap::Args)]
#[command(after_help = PLAN, mut_arg("out", |out| out.value_name("FILE or DIR").help(
    "The case file to write (ends in .toml), or the folder for it, a summary, a report and plots"
)))]
pub struct Plan {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// Plan only the move of this name; may be repeated
    #[arg(long = "move", value_name = "NAME")]
    pub moves: Vec<String>,
    /// Largest speed, in addition to the limits of the machine: "0.5 m/s"
    #[arg(long, value_name = "SPEED", value_parser = speed)]
    pub speed: Option<f64>,
    /// Largest acceleration: "20 m/s^2"
    #[arg(long, value_name = "ACCELERATION", value_parser = acceleration)]
    pub acceleration: Option<f64>,
    /// Largest jerk: "500 m/s^3"
    #[arg(long, value_name = "JERK", value_parser = jerk)]
    pub jerk: Option<f64>,
    /// Share of voltage and current, or of the pull-out torque of a stepper, that is reserved
    #[arg(long, value_name = "SHARE", default_value = "10%", value_parser = reserve, allow_hyphen_values = true)]
    pub reserve: f64,
    #[command(flatten)]
    pub common: Common,
}

const PLAN: &str = "\
Examples:
  taut plan stages/sollmann-jouaneh/controllers/pid-elastic.toml --out planned.toml
  taut plan axis.toml --move fine --jerk '500 m/s^3' --reserve 20%
  taut plan axis.toml --json | jq .moves[0].arrival.in_window_worst_s

Exit status 1: a move has no plan, or its cart does not stay in its window.";

/// Learn the next feed-forward signal of a repeated move, or the force along the travel, from logs.
///
/// Iterative learning: from the position that a repetition of a move logged, and the signal that was added to the
/// command meanwhile, computes the signal to add in the next repetition. Learns only at frequencies at which this
/// converges on every machine of the family of `taut tune`, and prints how fast, with the errors of the next eight
/// repetitions. With --out DIR it writes next.csv (time_s and added_V or added_A; left_added_V
/// and so on of a gantry), learn.json and a report.
///
/// With --map: from the logs of the case, slow motion over the travel in both directions, the force that depends on the
/// position (cogging), with an uncertainty and its periods. With --out DIR it writes mapped.toml, the case with this
/// force in cart.force_along, map.json and a report.
#[derive(Debug, clap::Args)]
#[command(after_help = LEARN)]
pub struct Learn {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// Log of the repetition (CSV, Parquet, MATLAB), with times from the beginning of the move on
    #[arg(long, value_name = "FILE", required_unless_present = "map")]
    pub log: Option<PathBuf>,
    /// Map the force along the travel from the logs of the case
    #[arg(long, conflicts_with_all = ["log", "moves", "added", "time", "position", "unit", "encoder"])]
    pub map: bool,
    /// The move of the log, if the case has several
    #[arg(long = "move", value_name = "NAME")]
    pub moves: Vec<String>,
    /// Signal that was added to the command of the log, as --out wrote it [default: none]
    #[arg(long, value_name = "FILE")]
    pub added: Option<PathBuf>,
    /// Column of the times, s
    #[arg(long, value_name = "COLUMN", default_value = "time_s")]
    pub time: String,
    /// Column of the position [default: cart_position_m, or measured_m with --encoder]; of a gantry those of bridge and
    /// cart, separated by a comma [default: bridge_position_m,cart_position_m], or with --encoder one for each motor
    #[arg(long, value_name = "COLUMN", value_delimiter = ',')]
    pub position: Vec<String>,
    /// Unit of the position
    #[arg(long, value_name = "UNIT", default_value = "m", value_parser = metre_unit)]
    pub unit: f64,
    /// The position is the one that the controller measures, along the belt, and not that of the cart
    #[arg(long)]
    pub encoder: bool,
    #[command(flatten)]
    pub common: Common,
}

impl Learn {
    /// The columns of the position: of what slides, or of each drive's encoder.
    pub fn columns(&self, machine: &Machine) -> Result<Vec<String>> {
        let geometry = machine.geometry();
        let wanted = if self.encoder { geometry.drives.len() } else { geometry.slides.len() };
        if self.position.is_empty() {
            return match (self.encoder, geometry.drives.len()) {
                (true, 1) => Ok(vec!["measured_m".into()]),
                (true, _) => Err(Error::new("each motor's encoder has a column of its own, and none is named")
                    .in_file("--encoder")
                    .next(format!("name {wanted} with --position, in the order {}", sides(machine)))),
                (false, _) => Ok(machine.travels().map(|(label, _)| format!("{}_position_m", label.key)).collect()),
            };
        }
        if self.position.len() != wanted {
            let whose: Vec<&str> = machine.travels().map(|(label, _)| label.key).collect();
            let whose = if self.encoder { sides(machine) } else { whose.join(", ") };
            let what = format!("there are {} columns of positions", self.position.len());
            let error = Error::new(what).in_file("--position");
            return Err(error.allowed(match geometry.drives.len() {
                1 => "one".into(),
                _ => format!("{wanted}, separated by commas, in the order {whose}"),
            }));
        }
        Ok(self.position.clone())
    }
}

/// The drives of a gantry, in their order.
fn sides(machine: &Machine) -> String {
    machine.geometry().sides().collect::<Vec<_>>().join(", ")
}

const LEARN: &str = "\
Examples:
  taut move axis.toml --move long --out trial-0
  taut learn axis.toml --move long --log trial-0/long.csv --out learned-1
  taut move axis.toml --move long --added learned-1/next.csv --out trial-1
  taut learn axis.toml --move long --log trial-1/long.csv --added learned-1/next.csv --out learned-2
  taut learn gantry.toml --move square --log trial-0/square.csv --out learned-1
  taut learn fit/fitted.toml --map --out mapped

Exit status 1: learning would not converge on a machine of the family, or the signal exceeds the controller's limit.";

/// Recommend an input shaper, from a measured spectrum or from a model.
///
/// Takes a spectrum (Klipper's resonances_*.csv, calibration_data_*.csv), raw accelerometer samples (raw_data_*.csv),
/// or a case file, whose resonances along the travel are computed. Prints for each shaper the best frequency, the
/// remaining vibration, the smoothing and the largest acceleration, then the recommended shaper as lines for Klipper's
/// configuration. A second spectrum is compared with the first; with --together one shaper is chosen for all.
#[derive(Debug, clap::Args)]
#[command(after_help = SHAPE)]
pub struct Shape {
    /// A spectrum, accelerometer samples, or a case file (.toml)
    pub spectrum: PathBuf,
    /// A second spectrum to compare with; with --together any number
    pub others: Vec<PathBuf>,
    /// Choose one shaper for all spectra, by the largest remaining vibration
    #[arg(long)]
    pub together: bool,
    /// Firmware whose shapers and selection rule are used [default: klipper, of 2026]
    #[arg(long, value_enum, default_value_t, hide_default_value = true)]
    pub firmware: FirmwareName,
    /// Axis of the accelerometer [default: the sum of x, y and z]
    #[arg(long, value_enum)]
    pub axis: Option<AxisName>,
    /// Damping ratio that shapers are designed for, or "fitted" for that of a spectrum's highest peak [default: 0.1, or
    /// the model's]
    #[arg(long, value_name = "RATIO", value_parser = damping)]
    pub damping: Option<Damping>,
    /// Largest smoothing, such as "0.1 mm" [default: any]
    #[arg(long, value_name = "LENGTH", value_parser = smoothing)]
    pub max_smoothing: Option<f64>,
    /// Largest vibration, in per cent of that without a shaper; a longer shaper is chosen if necessary
    #[arg(long, value_name = "PERCENT", value_parser = vibrations)]
    pub max_vibrations: Option<f64>,
    /// Speed at right-angled corners, for the smoothing [default: "5 mm/s"]
    #[arg(long, value_name = "SPEED", value_parser = corner_speed)]
    pub corner_speed: Option<f64>,
    /// Shapers to choose from, separated by commas: zv, mzv, zvd, ei, 2hump_ei, 3hump_ei, mzv(n=4,t=0.9), ei(v_tol=0.1)
    /// [default: all but zvd]
    #[arg(long, value_name = "NAMES", value_parser = shapers)]
    pub shapers: Option<Shapers>,
    /// Also try pairs of shapers in series: for two modes, or for a mode that varies along the travel
    #[arg(long)]
    pub pairs: bool,
    /// Two spectra of a CoreXY, TEST_RESONANCES AXIS=1,1 (belt A) and AXIS=1,-1 (belt B): report which belt is looser
    /// and by how much
    #[arg(long)]
    pub belts: bool,
    /// Case files only: relative uncertainty of the frequencies [default: 0.1]
    #[arg(long, value_name = "PART", value_parser = uncertainty)]
    pub uncertainty: Option<f64>,
    /// Case files only: state of the motor [default: held]
    #[arg(long, value_enum)]
    pub motor: Option<MotorName>,
    #[command(flatten)]
    pub common: Common,
}

/// Vibration analysis: poles, zeros, frequency response, resonances.
///
/// Linearises the machine of a case while everything slides, and prints the resonances along the travel of an axis or
/// over the working area of a gantry, rigid and elastic modes, and poles with frequency and damping; with --sample-time
/// also the discrete-time model. --verbose adds gain and zeros from each drive to each output. With --out it also
/// writes modes.json with the matrices, frequency-response.csv, map.csv (a gantry whose spans follow bridge and cart),
/// and a report with Bode diagrams, maps, and poles and zeros.
#[derive(Debug, clap::Args)]
#[command(after_help = MODES)]
pub struct Modes {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// Print gain and zeros of each output, too
    #[arg(long, conflicts_with = "quiet")]
    pub verbose: bool,
    /// Position of the cart, for spans that follow it and friction along the travel [default: 0 m]
    #[arg(long, value_name = "POSITION", value_parser = metres, allow_hyphen_values = true)]
    pub at: Option<f64>,
    /// Speed of the cart at which everything slides; 0 is at rest, below 0 backward [default: 0.1 m/s]
    #[arg(long, value_name = "SPEED", value_parser = metres_per_second, allow_hyphen_values = true)]
    pub speed: Option<f64>,
    /// Position of the bridge of a gantry [default: 0 m]
    #[arg(long, value_name = "POSITION", value_parser = metres, allow_hyphen_values = true)]
    pub bridge: Option<f64>,
    /// Bodies that stick, separated by commas: drive, cart or idler; left, right, cart_pulley,
    /// bridge or cart of a gantry
    #[arg(long, value_delimiter = ',', value_name = "BODY")]
    pub stuck: Vec<String>,
    /// Also give the discrete-time model for this sample time
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub sample_time: Option<f64>,
    /// Input between samples [default: zero]
    #[arg(long, value_enum, requires = "sample_time")]
    pub hold: Option<HoldName>,
    /// Input delay, such as computing time [default: 0 s]
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
  taut shape --belts resonances_belt_a.csv resonances_belt_b.csv
  taut shape --together raw_data_x_left.csv raw_data_x_middle.csv raw_data_x_right.csv
  taut shape raw_data_x.csv --shapers \"mzv(n=4,t=0.9),ei(v_tol=0.02)\" --max-vibrations 2
  taut shape axis.toml --set cart.mass=\"0.5 kg\" --json | jq .recommended";

/// Whose shapers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum FirmwareName {
    /// Klipper of 2026: shapers of 2025-09, choice of 2025-10, parameters of mzv and ei, up to 200 Hz
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
    /// Follows its command, as with a stepper motor or a stiff position loop
    Held,
    /// Free, as with a commanded voltage or current
    Free,
}

const MODES: &str = "\
Examples:
  taut modes axis.toml
  taut modes axis.toml --out modes --sample-time 1ms --delay 0.5ms
  taut modes axis.toml --at \"120 mm\" --speed \"20 mm/s\"
  taut modes axis.toml --stuck cart,idler --json | jq .poles
  taut modes gantry.toml --at \"50 mm\" --bridge \"-100 mm\"";

/// Input between samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum HoldName {
    /// Zero-order hold, as of a converter
    #[default]
    Zero,
    /// First-order hold: straight from sample to sample
    First,
    /// Tustin's bilinear rule, an approximation
    Tustin,
}
