//! The key figures of moves in closed loop that a sweep keeps, as tables. Those of experiments are
//! [`FIGURES`](crate::metrics::FIGURES).

use crate::control::MoveRun;
use crate::machine::{DriveAt, MachineKind};
use crate::mechanism::Label;
use crate::metrics;

/// A key figure, as a column has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    /// Its name, as a column.
    pub name: String,
    /// Its SI unit; empty for a pure number.
    pub unit: &'static str,
    /// Its name for people.
    pub words: String,
}

impl Figure {
    pub(super) fn of_move(measure: &Measure) -> Self {
        Self { name: measure.name.clone(), unit: measure.unit, words: measure.words.clone() }
    }

    pub(super) fn of_experiment(figure: &metrics::Figure) -> Self {
        Self { name: figure.name.clone(), unit: figure.unit, words: figure.words.clone() }
    }
}

/// A key figure of a move, and how it is had from a run.
#[derive(Debug, Clone)]
pub struct Measure {
    /// Its name, as a column.
    pub name: String,
    /// Its SI unit; empty for a pure number.
    pub unit: &'static str,
    /// Its name for people.
    pub words: String,
    part: usize,
    of: fn(&MoveRun, usize) -> f64,
}

impl Measure {
    /// Its value; NaN where a run has none.
    pub fn value(&self, run: &MoveRun) -> f64 {
        (self.of)(run, self.part)
    }
}

/// The parts that a figure of moves belongs to.
#[derive(Clone, Copy, PartialEq)]
enum Per {
    Load,
    Drive,
    /// The whole machine.
    Whole,
    /// The whole of a machine whose cart moves in a plane.
    Plane,
    /// A drive with a stepper, and a machine with steppers.
    Stepper,
    Steppers,
}

/// A figure of moves: its name and words on an axis, and those of each part of a machine with several, `*` being the
/// part.
struct Row {
    names: [&'static str; 2],
    unit: &'static str,
    words: [&'static str; 2],
    per: Per,
    of: fn(&MoveRun, usize) -> f64,
}

const fn row(
    names: [&'static str; 2],
    unit: &'static str,
    words: [&'static str; 2],
    per: Per,
    of: fn(&MoveRun, usize) -> f64,
) -> Row {
    Row { names, unit, words, per, of }
}

/// Name of the figure that is 1 if no step is lost, and 0 otherwise.
pub(super) const IN_STEP: &str = "in_step";

/// Those of a move in closed loop, in the order of the columns.
#[rustfmt::skip]
const OF_MOVE: &[Row] = &[
    row(["peak_cart_error", "peak_*_error"], "m", ["largest cart error y − x", "largest error of the *"], Per::Load, |m, k| m.figures.loads[k].error.peak.value.abs()),
    row(["rms_cart_error", "rms_*_error"], "m", ["rms of the cart error", "rms of the error of the *"], Per::Load, |m, k| m.figures.loads[k].error.rms),
    row(["final_cart_error", "final_*_error"], "m", ["cart error at the end", "error of the * at the end"], Per::Load, |m, k| m.figures.loads[k].error.last),
    row(["peak_contour_error"; 2], "m", ["largest distance from the path"; 2], Per::Plane, |m, _| m.figures.contour.map_or(f64::NAN, |contour| contour.peak.value.abs())),
    row(["rms_contour_error"; 2], "m", ["rms of the distance from the path"; 2], Per::Plane, |m, _| m.figures.contour.map_or(f64::NAN, |contour| contour.rms)),
    row(["peak_following_error", "peak_*_following_error"], "m", ["largest following error y − r φ₁", "largest following error of the *"], Per::Drive, |m, k| m.figures.drives[k].following.peak.value.abs()),
    row(["rms_following_error", "rms_*_following_error"], "m", ["rms of the following error", "rms of the following error of the *"], Per::Drive, |m, k| m.figures.drives[k].following.rms),
    row(["settling_time"; 2], "s", ["settling time after the profile"; 2], Per::Whole, |m, _| m.figures.settling.unwrap_or(f64::NAN)),
    row(["overshoot", "*_overshoot"], "m", ["overshoot of the cart", "overshoot of the *"], Per::Load, |m, k| m.figures.loads[k].overshoot),
    row(["peak_motor_current", "peak_*_current"], "A", ["peak motor current", "peak current of the *"], Per::Drive, |m, k| m.figures.drives[k].current.0.value.abs()),
    row(["rms_motor_current", "rms_*_current"], "A", ["rms motor current", "rms current of the *"], Per::Drive, |m, k| m.figures.drives[k].current.1),
    row(["peak_motor_voltage", "peak_*_voltage"], "V", ["peak motor voltage", "peak voltage of the *"], Per::Drive, |m, k| m.figures.drives[k].voltage.0.value.abs()),
    row(["limited_time", "*_limited_time"], "s", ["time at the controller's limit", "time of the * at the controller's limit"], Per::Drive, |m, k| m.figures.drives[k].limited),
    row(["energy_taken", "*_energy_taken"], "J", ["electrical energy taken in", "electrical energy that the * takes in"], Per::Drive, |m, k| m.figures.drives[k].energy.0),
    row(["restlessness", "*_restlessness"], "Hz", ["changes of direction of the command per second", "changes of direction of the command of the * per second"], Per::Drive, |m, k| m.figures.drives[k].restlessness),
    row(["lost_steps", "*_lost_steps"], "", ["full steps lost at the end", "full steps lost by the * at the end"], Per::Stepper, |m, k| m.metrics.drives[k].lost_steps.map_or(f64::NAN, |own| own.at_end as f64)),
    row([IN_STEP; 2], "", ["in step all the way"; 2], Per::Steppers, |m, _| f64::from(u8::from(m.metrics.in_step()))),
    row(["peak_belt_force"; 2], "N", ["largest force in the belt"; 2], Per::Whole, |m, _| m.metrics.largest_force().1.value.abs()),
];

/// The figures of moves of a kind of machine, with or without steppers.
pub fn of_move(kind: MachineKind, has_steppers: bool) -> Vec<Measure> {
    let geometry = kind.geometry();
    let loads: Vec<Label> = geometry.slides.iter().map(|slide| geometry.label(slide.body)).collect();
    let side = |drive: &DriveAt| Label { key: geometry.drive_key(drive), name: drive.label.name };
    let drives: Vec<Label> = geometry.drives.iter().map(side).collect();
    let of_row = |row: &'static Row| -> Vec<Measure> {
        let &Row { names, unit, words, per, of } = row;
        let one = |part: usize, label: Label, place: usize| Measure {
            name: names[place].replace('*', label.key),
            unit,
            words: words[place].replace('*', label.name),
            part,
            of,
        };
        let parts = match per {
            Per::Load => &loads,
            Per::Stepper | Per::Steppers if !has_steppers => return Vec::new(),
            Per::Drive | Per::Stepper => &drives,
            Per::Plane if loads.len() < 2 => return Vec::new(),
            Per::Whole | Per::Plane | Per::Steppers => return vec![one(0, Label { key: "", name: "" }, 0)],
        };
        let place = usize::from(parts.len() > 1);
        parts.iter().enumerate().map(|(part, label)| one(part, *label, place)).collect()
    };
    OF_MOVE.iter().flat_map(of_row).collect()
}
