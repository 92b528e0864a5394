//! Table of key figures, by the role of their part. Columns of sweeps, keys of results, tables of reports and views of
//! the studio are made from it: a new figure is one row here.

use super::{Metrics, Peak};
use crate::machine::{DriveAt, Geometry, Machine, MachineKind};
use crate::mechanism::Label;

/// The role of a part of a machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// A sliding part.
    Load,
    /// A pulley that a drive turns.
    Pulley,
    /// A motor.
    Motor,
    /// The shaft of a motor.
    Shaft,
    /// A span of the belt.
    Span,
    /// A body other than rotors.
    Body,
    /// The whole machine.
    Whole,
}

/// The value of a figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Worth {
    /// A number; NaN where a run has none.
    Number(f64),
    /// Value of largest magnitude, with its sign and time.
    Peak(Peak),
    /// Time of a peak, which the peak itself also contains.
    TimeOfPeak(f64),
    /// A truth value.
    Flag(bool),
}

impl Worth {
    /// As a number. Peaks are magnitudes: after a motion there and back the sign of the larger peak is arbitrary, and
    /// quantiles of signed peaks would be meaningless.
    pub fn number(self) -> f64 {
        match self {
            Worth::Number(value) | Worth::TimeOfPeak(value) => value,
            Worth::Peak(peak) => peak.value.abs(),
            Worth::Flag(flag) => f64::from(u8::from(flag)),
        }
    }
}

/// A reason for a [`Meter`](super::Meter) to follow the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Seek {
    /// The peak speed of what slides.
    LoadSpeed,
    /// Peak of the position by the drives minus the true position.
    LoadError,
    /// The peak of r φ̇ of the only drive's pulley.
    BeltSpeed,
    /// The peak speed of a motor.
    ShaftSpeed,
    /// The peak current of a motor.
    Current,
    /// The peak stretch of a span.
    Stretch,
    /// The peak force of a span.
    Force,
    /// The steady speed.
    SteadySpeed,
    /// The peak yaw of a bridge.
    Yaw,
    /// When everything came to rest.
    StopTime,
}

impl Seek {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::LoadSpeed,
        Self::LoadError,
        Self::BeltSpeed,
        Self::ShaftSpeed,
        Self::Current,
        Self::Stretch,
        Self::Force,
        Self::SteadySpeed,
        Self::Yaw,
        Self::StopTime,
    ];
}

/// The machines that have a figure, if not all have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Only {
    /// Those with a single drive.
    OneDrive,
    /// Those with steppers.
    Steppers,
    /// Those whose bridge yaws.
    Yaw,
}

/// Optional properties of a machine beside the parts of its kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Extras {
    /// Steppers.
    pub stepper: bool,
    /// A bridge that yaws.
    pub yaw: bool,
}

impl Extras {
    /// Those of a machine.
    pub fn new(machine: &Machine) -> Self {
        Self { stepper: machine.stepper().is_some(), yaw: machine.yaw.is_some() }
    }
}

/// A row of the list: a figure of each part of a role.
#[derive(Debug)]
#[non_exhaustive]
pub struct FigureRow {
    /// The role of the parts that have it.
    pub role: Role,
    /// Its name as a column, `*` standing for the part.
    pub name: &'static str,
    /// Its SI unit; empty for a pure number.
    pub unit: &'static str,
    /// Its name for people, `*` standing for the part.
    pub words: &'static str,
    /// Its name as a column and for people on an axis, where that has names of its own for it.
    pub of_axis: Option<[&'static str; 2]>,
    /// True if it repeats another figure on an axis, so that sweeps of axes omit it.
    pub again_on_an_axis: bool,
    /// The machines that have it, if not all.
    pub only: Option<Only>,
    /// Its value for the part with this index.
    pub of: fn(&Metrics, usize) -> Worth,
    /// Quantity that a meter follows for it; for a figure of the whole machine, of all parts.
    pub seek: Option<Seek>,
}

type Of = fn(&Metrics, usize) -> Worth;

const fn row(role: Role, name: &'static str, unit: &'static str, words: &'static str, of: Of) -> FigureRow {
    FigureRow { role, name, unit, words, of_axis: None, again_on_an_axis: false, only: None, of, seek: None }
}

impl FigureRow {
    const fn seeking(self, seek: Seek) -> Self {
        Self { seek: Some(seek), ..self }
    }

    const fn on_an_axis(self, name: &'static str, words: &'static str) -> Self {
        Self { of_axis: Some([name, words]), ..self }
    }

    const fn again(self) -> Self {
        Self { again_on_an_axis: true, ..self }
    }

    const fn only(self, only: Only) -> Self {
        Self { only: Some(only), ..self }
    }
}

use Role::{Body, Load, Motor, Pulley, Shaft, Span, Whole};
use Worth::{Flag, Number, TimeOfPeak};

/// The key figures.
#[rustfmt::skip]
pub static FIGURES: &[FigureRow] = &[
    row(Pulley, "final_*_angle", "rad", "angle of the * at the end", |m, k| Number(m.drives[k].angle)).again(),
    row(Load, "final_*_by_drives", "m", "* position at the end, by the drives", |m, k| Number(m.loads[k].by_drives))
        .on_an_axis("final_drive_travel", "drive travel r φ₁ at the end"),
    row(Load, "final_*_position", "m", "* position at the end", |m, k| Number(m.loads[k].position)),
    row(Load, "final_*_speed", "m/s", "* speed at the end", |m, k| Number(m.loads[k].speed)),
    row(Load, "final_drives_minus_*", "m", "drives minus * at the end", |m, k| Number(m.loads[k].by_drives - m.loads[k].position))
        .on_an_axis("final_drive_travel_minus_cart", "drive travel minus cart at the end"),
    row(Load, "peak_*_speed", "m/s", "peak * speed", |m, k| Worth::Peak(m.loads[k].peak_speed)).seeking(Seek::LoadSpeed),
    row(Load, "peak_*_speed_time", "s", "time of the peak * speed", |m, k| TimeOfPeak(m.loads[k].peak_speed.time)).seeking(Seek::LoadSpeed),
    row(Load, "peak_drives_minus_*", "m", "largest drives minus *", |m, k| Worth::Peak(m.loads[k].peak_error)).seeking(Seek::LoadError)
        .on_an_axis("peak_drive_travel_minus_cart", "largest drive travel minus cart").again(),
    row(Pulley, "peak_*_speed", "m/s", "peak speed r φ′ of the *", |m, k| Worth::Peak(m.drives[k].peak_belt_speed.unwrap_or_default()))
        .seeking(Seek::BeltSpeed).only(Only::OneDrive).on_an_axis("peak_drive_speed", "peak drive speed r φ₁′"),
    row(Shaft, "peak_*_speed", "rad/s", "peak speed of the *", |m, k| Worth::Peak(m.drives[k].peak_speed)).seeking(Seek::ShaftSpeed).again(),
    row(Whole, "steady_speed", "m/s", "steady cart speed", |m, _| Number(m.steady_speed.map_or(f64::NAN, |steady| steady.value)))
        .seeking(Seek::SteadySpeed).only(Only::OneDrive),
    row(Span, "peak_*_stretch", "m", "peak stretch of *", |m, k| Worth::Peak(m.spans[k].peak_stretch)).seeking(Seek::Stretch),
    row(Span, "peak_*_force", "N", "peak force in *", |m, k| Worth::Peak(m.spans[k].peak_force)).seeking(Seek::Force),
    row(Whole, "peak_belt_force", "N", "largest force in the belt", |m, _| Worth::Peak(m.largest_force().1)).seeking(Seek::Force),
    row(Motor, "peak_*_current", "A", "peak current of the *", |m, k| Worth::Peak(m.drives[k].peak_current)).seeking(Seek::Current)
        .on_an_axis("peak_motor_current", "peak motor current"),
    row(Motor, "*_lost_steps", "", "full steps lost by the * at the end", |m, k| Number(m.drives[k].lost_steps.map_or(f64::NAN, |own| own.at_end as f64)))
        .only(Only::Steppers).on_an_axis("lost_steps", "full steps lost at the end"),
    row(Whole, "in_step", "", "in step all the way", |m, _| Flag(m.in_step())).only(Only::Steppers),
    row(Load, "*_position_error", "m", "commanded minus * position at the end", |m, k| Number(m.loads[k].command_error.unwrap_or(f64::NAN)))
        .only(Only::Steppers).on_an_axis("position_error", "commanded minus cart position at the end"),
    row(Whole, "final_yaw", "rad", "yaw of the bridge at the end", |m, _| Number(m.yaw.unwrap_or_default().angle)).only(Only::Yaw),
    row(Whole, "peak_yaw", "rad", "largest yaw of the bridge", |m, _| Worth::Peak(m.yaw.unwrap_or_default().peak)).seeking(Seek::Yaw).only(Only::Yaw),
    row(Whole, "stop_time", "s", "time of the last stop", |m, _| Number(m.stop_time.unwrap_or(f64::NAN))).seeking(Seek::StopTime),
    row(Whole, "settled", "", "at rest at the end", |m, _| Flag(m.settled)),
    row(Body, "*_stops", "", "stops of the *", |m, k| Number(m.bodies[k].stops as f64)),
    row(Body, "*_reversals", "", "reversals of the *", |m, k| Number(m.bodies[k].reversals as f64)),
];

/// A key figure of a machine: a row of [`FIGURES`], for one part.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Its name as a column.
    pub name: String,
    /// Its name by role, if different.
    pub by_role: String,
    /// Its SI unit; empty for a pure number.
    pub unit: &'static str,
    /// Its name in messages.
    pub words: String,
    /// Index of its part among those of the role.
    pub place: usize,
    /// The key of its part.
    pub part: &'static str,
    /// Its row of the table.
    pub row: &'static FigureRow,
}

impl Figure {
    /// Its value.
    pub fn value(&self, metrics: &Metrics) -> Worth {
        (self.row.of)(metrics, self.place)
    }

    /// Quantity that a meter follows for it, and the part's index.
    pub fn seek(&self) -> Option<(super::Seek, Option<usize>)> {
        self.row.seek.map(|seek| (seek, (self.row.role != Role::Whole).then_some(self.place)))
    }
}

/// Name of a motor, by the prefix of its current's column.
fn motor(drive: &DriveAt) -> Label {
    Label { key: drive.current_column.trim_end_matches("_current"), name: drive.label.name }
}

/// Parts of a role: their keys in columns, and their names.
fn parts(geometry: &Geometry, role: Role) -> Vec<(&'static str, String)> {
    let labels: Vec<Label> = match role {
        Role::Load => geometry.slides.iter().map(|slide| geometry.label(slide.body)).collect(),
        Role::Pulley => geometry.drives.iter().map(|drive| geometry.label(drive.pulley)).collect(),
        Role::Motor => geometry.drives.iter().map(motor).collect(),
        Role::Shaft => {
            // Slides also have a speed.
            let slides = |key: &str| geometry.slides.iter().any(|slide| geometry.label(slide.body).key == key);
            let label = |drive: &DriveAt| if slides(motor(drive).key) { drive.label } else { motor(drive) };
            geometry.drives.iter().map(label).collect()
        }
        Role::Span => geometry.spans.iter().map(|span| Label { key: span.column, name: span.label.name }).collect(),
        Role::Body => geometry.bodies.iter().map(|body| body.label).collect(),
        Role::Whole => vec![Label { key: "", name: "" }],
    };
    // "span 1" without, "the left span" with an article.
    let article = |name: &str| role == Role::Span && !name.starts_with("span");
    let named = |name: &str| if article(name) { format!("the {name}") } else { name.to_string() };
    labels.into_iter().map(|label| (label.key, named(label.name))).collect()
}

/// The key figures of a kind of machine with these extras, in the order of the list, then of the parts.
pub fn figures(kind: MachineKind, extras: Extras) -> Vec<Figure> {
    let geometry = kind.geometry();
    let has = move |row: &&FigureRow| match row.only {
        None => true,
        Some(Only::OneDrive) => geometry.drives.len() == 1,
        Some(Only::Steppers) => extras.stepper,
        Some(Only::Yaw) => extras.yaw,
    };
    let rows = FIGURES.iter().filter(has);
    let of_parts = |row: &'static FigureRow| {
        parts(geometry, row.role).into_iter().enumerate().map(move |(place, (part, name))| {
            let by_role = row.name.replace('*', part);
            let own = row.of_axis.filter(|_| kind == MachineKind::Axis);
            Figure {
                name: own.map_or_else(|| by_role.clone(), |[name, _]| name.to_string()),
                by_role,
                unit: row.unit,
                words: own.map_or_else(|| row.words.replace('*', &name), |[_, words]| words.to_string()),
                place,
                part,
                row,
            }
        })
    };
    rows.flat_map(of_parts).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cart of a dual belt and its motor each have a peak speed; both were named `peak_cart_speed`.
    #[test]
    fn no_two_figures_of_a_kind_share_a_name() {
        for kind in MachineKind::ALL {
            let mut names: Vec<String> =
                figures(kind, Extras { stepper: true, yaw: true }).into_iter().map(|figure| figure.name).collect();
            let count = names.len();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), count, "{}", kind.word());
        }
    }
}
