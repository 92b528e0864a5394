//! Problems of a move by the model of its loop and its run: unstable, saturated, howling, lost steps.

use super::margins::Margins;
use super::plant::Plant;
use crate::case::Move;
use crate::control::MoveRun;
use crate::control::feedback::Feedback;
use crate::design::Design;
use crate::linear::{Operation, travel};
use crate::machine::{AmplifierMode, DriveAt, Machine};
use crate::metrics::OfDrive;
use crate::quantity::show;
use crate::signal::profile::Profile;
use std::f64::consts::PI;

/// Fraction of samples at the limit above which a command counts as saturated.
const SATURATED: f64 = 0.5;

/// Amplitude of the command of a howling loop at rest relative to the limit, and its least number of cycles.
const LOUD: f64 = 0.25;
const CYCLES: f64 = 4.0;

/// Ratio of that amplitude between both halves of the rest above which it grows, and its least value relative to the
/// limit.
const GROWS: f64 = 1.5;
const LEAST: f64 = 0.1;

/// Relative distance of a frequency from a mode that belongs to it.
const NEAR: f64 = 0.2;

/// Kind of problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum TroubleKind {
    /// The sampled loop has poles outside the unit circle, or its oscillation grows.
    Unstable,
    /// The command is at its limit most of the time.
    Saturated,
    /// The command oscillates at rest.
    Howling,
    /// A stepper lost steps.
    LostSteps,
}

impl TroubleKind {
    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Unstable => "unstable",
            Self::Saturated => "saturated",
            Self::Howling => "howling",
            Self::LostSteps => "out of step",
        }
    }
}

/// Problem of an unreliable move.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Trouble {
    /// The kind.
    pub kind: TroubleKind,
    /// Frequency of its oscillation, Hz, if any.
    pub frequency: Option<f64>,
    /// Cause, in words.
    pub cause: String,
    /// Complete description in a sentence.
    pub words: String,
}

/// The problem of a run move, if any.
pub fn trouble(machine: &Machine, design: &Design, run: &MoveRun, motion: &Move) -> Option<Trouble> {
    // A loop that has arrived has made up for lost steps.
    if (design.is_open_loop() || run.figures.settling.is_none())
        && let Some(trouble) = lost_steps(machine, design, run, motion)
    {
        return Some(trouble);
    }
    if design.is_open_loop() {
        return None;
    }
    let targets: Vec<f64> = motion.profiles.iter().map(Profile::target).collect();
    let at = Operation::at(&targets);
    let model = unstable(machine, design, at);
    let (samples, limited) = run.samples;
    let swing = run.swings.iter().copied().reduce(|a, b| if b.late > a.late { b } else { a }).unwrap_or_default();
    let limit = limit(machine, design).unwrap_or(f64::INFINITY);
    let cycles = swing.cycles >= CYCLES;
    let loud = swing.late > LOUD * limit && cycles;
    let grows = swing.late > GROWS * swing.early && cycles && (swing.late > LEAST * limit || limit.is_infinite());
    let is_saturated = samples > 0 && limited as f64 > SATURATED * samples as f64;
    let seen = (swing.frequency > 0.0).then_some(swing.frequency);
    // Dry friction can stop a loop that would oscillate if everything slid, so only problems visible in the run are
    // reported.
    let swings = is_saturated || grows || swing.late > LEAST * limit && cycles;
    let (kind, frequency) = match model {
        Some(hertz) if swings => (TroubleKind::Unstable, Some(hertz)),
        _ if grows => (TroubleKind::Unstable, seen),
        _ if is_saturated => (TroubleKind::Saturated, seen),
        _ if loud => (TroubleKind::Howling, seen),
        _ => return None,
    };
    let cause = cause(machine, design, kind, frequency, at);
    let place = frequency.map_or(String::new(), |hertz| format!(" at {hertz:.1} Hz"));
    let what = match kind {
        TroubleKind::Unstable => format!("the loop is unstable and oscillates{place}"),
        TroubleKind::Saturated if frequency.is_some() => format!("the command is saturated and oscillates{place}"),
        TroubleKind::Saturated => "the command is saturated".into(),
        TroubleKind::Howling | TroubleKind::LostSteps => format!("the loop howls{place}"),
    };
    let held = if limited > 0 { format!("; {limited} of {samples} samples at the limit") } else { String::new() };
    Some(Trouble { kind, frequency, words: format!("{what}: {cause}{held}"), cause })
}

/// Steps that steppers lost, if any did.
fn lost_steps(machine: &Machine, design: &Design, run: &MoveRun, motion: &Move) -> Option<Trouble> {
    let drives = machine.geometry().drives.iter().zip(&run.metrics.drives);
    let of_drive = |(at, drive): (&DriveAt, &OfDrive)| {
        let (lost, first) = drive.lost_steps.and_then(|lost| Some((lost.at_end, lost.first_slip?)))?;
        let side = if lost < 0 { "ahead" } else { "behind" };
        let (drive, first, lost) = (at.label.name, show(first, "s"), lost.abs());
        Some(format!("the {drive} loses steps at {first} and is {lost} full steps {side} at the end"))
    };
    let lost: Vec<String> = drives.filter_map(of_drive).collect();
    if lost.is_empty() {
        return None;
    }
    // No plan of a move breaks the load away with less.
    let is_held = motion.shortfalls(machine, design).iter().any(|short| short.limit == "breakaway");
    let cause = match is_held {
        true => "its torque does not break the load away, however slow the move: a stronger motor, or less friction",
        false => "its torque does not suffice for this speed and acceleration: `taut plan` finds what does",
    };
    let words = format!("{}: {cause}", lost.join(", and "));
    Some(Trouble { kind: TroubleKind::LostSteps, frequency: None, words, cause: cause.into() })
}

/// Frequency of oscillation of an unstable sampled loop, Hz; none also for nonlinear structures.
fn unstable(machine: &Machine, design: &Design, at: Operation) -> Option<f64> {
    let feedback = Feedback::new(design, machine).ok().filter(Feedback::is_linear)?;
    let plant = Plant::new(machine, at, design, &feedback.corners()).ok()?;
    let margins = Margins::new(&plant, &feedback);
    (!margins.stable).then_some(margins.at / (2.0 * PI))
}

/// The tighter limit of the command, of the controller or the amplifier, in units of the input.
pub(super) fn limit(machine: &Machine, design: &Design) -> Option<f64> {
    let amplifier = match machine.drives[0].amplifier.mode {
        AmplifierMode::Voltage => machine.drives[0].amplifier.voltage_limit,
        AmplifierMode::Current | AmplifierMode::Position => machine.drives[0].amplifier.current_limit,
    };
    let amplifier = amplifier.map(|limit| limit / machine.drives[0].amplifier.gain.abs());
    [design.limit, amplifier].into_iter().flatten().reduce(f64::min)
}

fn cause(machine: &Machine, design: &Design, kind: TroubleKind, frequency: Option<f64>, at: Operation) -> String {
    let Some(hertz) = frequency else {
        return match kind {
            TroubleKind::Saturated => "the move asks for more than the limit of the command allows".into(),
            TroubleKind::Unstable | TroubleKind::Howling | TroubleKind::LostSteps => "its gains are too high".into(),
        };
    };
    let places = travel(machine, at, &[at.position]).unwrap_or_default();
    let mut modes = places.iter().flat_map(|place| place.undamped_resonances.iter().copied());
    if let Some(mode) = modes.find(|mode| (mode / hertz).ln().abs() < NEAR) {
        return format!(
            "the mode of the axis at {mode:.1} Hz is driven by the controller; a lower gain, a low-pass or a notch there"
        );
    }
    let late = design.delay + 0.5 * design.every;
    // Delay and hold shift the phase by 360° f `late`.
    if 360.0 * hertz * late > 20.0 {
        return format!("too much gain for a delay of {:.2} ms, half a sample with it", 1e3 * late);
    }
    "too much integral or too little derivative gain for this axis".into()
}
