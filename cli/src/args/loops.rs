//! Vibrations and controllers: `modes`, `tune`, `shape`.

use super::values::{
    Shapers, acceleration, corner_speed, damping, delay, effort, hertz, jerk, metres, metres_per_second, reserve,
    seconds, shapers, share, smoothing, speed, uncertainty, vibrations,
};
use crate::command::Common;
use clap::ValueEnum;
use std::path::PathBuf;
use taut::control::recommendation::Damping;
use taut::control::shaper::Firmware;

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
    /// Let the search take so many times as long: the gains it finds get better by some per cent
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = effort, conflicts_with = "evaluate")]
    pub effort: f64,
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

/// Plan the fastest moves that the machine can make.
///
/// Finds for each move of a case the speed, acceleration, jerk and snap with which its cart stays in its window soonest,
/// at worst over the family of machines of `taut tune`, while voltage, current, span tension and teeth keep their
/// limits. Jerk times are tried on the zeros of the belt's modes. Prints the planned limits beside the file's, and the
/// least time of the axis as one mass. With --out FILE.toml it writes the case with them.
#[derive(Debug, clap::Args)]
#[command(after_help = PLAN, mut_arg("out", |out| out.value_name("FILE or DIR").help(
    "The case file to write (ends in .toml), or the folder for it, a summary, a report and plots"
)))]
pub struct Plan {
    /// The case file; - is standard input
    pub case: PathBuf,
    /// Plan only the move of this name, as often as needed
    #[arg(long = "move", value_name = "NAME")]
    pub moves: Vec<String>,
    /// Most speed, besides what the machine allows: "0.5 m/s"
    #[arg(long, value_name = "SPEED", value_parser = speed)]
    pub speed: Option<f64>,
    /// Most acceleration: "20 m/s^2"
    #[arg(long, value_name = "ACCELERATION", value_parser = acceleration)]
    pub acceleration: Option<f64>,
    /// Most jerk: "500 m/s^3"
    #[arg(long, value_name = "JERK", value_parser = jerk)]
    pub jerk: Option<f64>,
    /// Share of voltage and current that is left to the loop
    #[arg(long, value_name = "SHARE", default_value = "10%", value_parser = reserve)]
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

/// Say how a machine swings: poles, zeros, frequency response, resonances.
///
/// Linearises the machine of a case while everything slides, and prints its poles with frequency and damping, the
/// shapes of its rigid and elastic modes, the gain and the zeros of each output from each drive, and the resonances
/// along the travel of an axis or over the working area of a gantry; with --sample-time also its discrete-time model.
/// With --out it also writes modes.json with the matrices, frequency-response.csv, map.csv (a gantry whose spans
/// follow bridge and cart), and a report with Bode diagrams, maps, and poles and zeros.
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
    /// Where the bridge of a gantry is [default: 0 m]
    #[arg(long, value_name = "POSITION", value_parser = metres, allow_hyphen_values = true)]
    pub bridge: Option<f64>,
    /// Bodies that stick and are held where they are, separated by commas: drive, cart or idler; left, right, bridge
    /// or cart of a gantry
    #[arg(long, value_delimiter = ',', value_name = "BODY")]
    pub stuck: Vec<String>,
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
  taut modes axis.toml --stuck cart,idler --json | jq .poles
  taut modes gantry.toml --at \"50 mm\" --bridge \"-100 mm\"";

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
