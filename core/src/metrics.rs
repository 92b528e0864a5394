//! Key figures of a run: final positions, peak speeds, loads on belt and motor, stop time, and the difference between
//! the encoder's pulley and the cart.
//!
//! A [`Meter`] observes a run without storing it, so that memory does not depend on its length. It evaluates the motion
//! between rows and on both sides of every event and jump of the input: except for rounding, its figures do not depend
//! on the output interval. For the paper's Table 3 it evaluates the steps.

mod figures;
mod meter;
mod rotor;
mod steady;

pub use figures::{Extras, FIGURES, Figure, FigureRow, Only, Role, Seek, Worth, figures};
pub use meter::{Meter, Sought};
pub use steady::{Balance, Held, SteadySpeed, balanced_speed};

use crate::friction::Motion;
use crate::solve::{Event, NEWS};

/// The key figures of one run, by the role of the parts. SI units; r is the pulleys' pitch radius, φ the angle of a
/// drive pulley.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Metrics {
    /// End of the run, s.
    pub end: f64,
    /// The sliding parts: the cart of an axis, bridge and cart of a gantry.
    pub loads: Vec<OfLoad>,
    /// The drives, in the order of the inputs.
    pub drives: Vec<OfDrive>,
    /// The spans of the belt, in the order of [`Geometry::spans`](crate::machine::Geometry).
    pub spans: Vec<OfSpan>,
    /// Yaw of the bridge, if it yaws.
    pub yaw: Option<OfYaw>,
    /// Events of each body other than rotors.
    pub bodies: Vec<EventCount>,
    /// Steady speed of the cart under constant input; none if no non-zero input lasts a fiftieth of the run, if the run
    /// ended before that input did, or for several drives.
    pub steady_speed: Option<SteadySpeed>,
    /// Time at which everything came to rest, s: the last event of a body, or the last time at which an independent
    /// rotor was faster than a millionth of its largest speed, whichever is later; 0 if nothing moved. None while
    /// anything moves, for a body without dry friction, and for a solver that locates no events (`table3` freezes
    /// speeds and creeps on).
    pub stop_time: Option<f64>,
    /// True if everything is at rest at the end: bodies and rotors.
    pub settled: bool,
    /// True if all bodies other than rotors are stuck at the end, at a speed of exactly zero.
    pub bodies_rest: bool,
    /// True if no rotor turns at the end, with a threshold of a millionth of its largest speed for a compliant gear.
    /// Always true for stiff gears, whose rotors are part of their pulleys.
    pub rotors_rest: bool,
}

/// Yaw of a bridge.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct OfYaw {
    /// At the end, rad.
    pub angle: f64,
    /// The largest, rad.
    pub peak: Peak,
}

/// Steps that a stepper lost.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct LostSteps {
    /// Full steps by which the rotor is behind its field at the end: four for each tooth pitch.
    pub at_end: i64,
    /// Number of times that the rotor fell to another tooth.
    pub slips: u64,
    /// Time of the first one, s.
    pub first_slip: Option<f64>,
}

/// Figures of a sliding part.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct OfLoad {
    /// Final position, m.
    pub position: f64,
    /// Its speed at the end, m/s.
    pub speed: f64,
    /// Final position by the angles of the drive pulleys without stretch of the belt, m: r φ of an
    /// axis.
    pub by_drives: f64,
    /// Peak speed, m/s.
    pub peak_speed: Peak,
    /// Peak of the position by the drives minus the true position, m: the error of an encoder at the drive
    /// pulley as a measurement of the cart.
    pub peak_error: Peak,
    /// Final commanded position minus true position, m; none without steppers.
    pub command_error: Option<f64>,
}

/// Figures of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct OfDrive {
    /// The angle of its pulley at the end, rad.
    pub angle: f64,
    /// Final speed of its motor divided by the gear ratio, rad/s: the pulley's speed if the gear is stiff.
    pub shaft_speed: f64,
    /// Peak of r φ̇ of its pulley, m/s; only for a machine with one drive.
    pub peak_belt_speed: Option<Peak>,
    /// Peak speed of its motor divided by the gear ratio, rad/s.
    pub peak_speed: Peak,
    /// Peak current, A.
    pub peak_current: Peak,
    /// Lost steps; none unless it is a stepper.
    pub lost_steps: Option<LostSteps>,
}

/// Figures of a span of the belt.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OfSpan {
    /// Peak elongation, m; negative if it is shorter than at rest, which assumes sufficient pretension.
    pub peak_stretch: Peak,
    /// Peak force, N, damping included.
    pub peak_force: Peak,
}

impl Metrics {
    /// The figures of the cart.
    pub fn cart(&self) -> OfLoad {
        self.loads.last().copied().unwrap_or_default()
    }

    /// The figures of the first drive.
    pub fn drive(&self) -> OfDrive {
        self.drives.first().copied().unwrap_or_default()
    }

    /// True if neither loads nor shafts move at the end.
    pub fn is_still(&self) -> bool {
        self.loads.iter().all(|load| load.speed == 0.0) && self.drives.iter().all(|drive| drive.shaft_speed == 0.0)
    }

    /// True if no stepper lost a step.
    pub fn in_step(&self) -> bool {
        self.drives.iter().all(|drive| drive.lost_steps.is_none_or(|lost| lost.slips == 0))
    }

    /// Largest elongation of a span, and its index.
    pub fn largest_stretch(&self) -> (usize, Peak) {
        largest(self.spans.iter().map(|span| span.peak_stretch))
    }

    /// Largest force in a span, and its index.
    pub fn largest_force(&self) -> (usize, Peak) {
        largest(self.spans.iter().map(|span| span.peak_force))
    }
}

/// Value of largest magnitude, with its sign and time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Peak {
    /// The value, in the unit of its quantity.
    pub value: f64,
    /// Time, s.
    pub time: f64,
}

/// Numbers of stops, starts and reversals of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct EventCount {
    /// It came to rest.
    pub stops: u64,
    /// It started to slide.
    pub starts: u64,
    /// It reversed without a rest.
    pub reversals: u64,
}

impl EventCount {
    /// Total number.
    pub fn total(&self) -> u64 {
        self.stops + self.starts + self.reversals
    }

    /// Counts an event of the body.
    fn add(&mut self, event: &Event) {
        if event.to == Motion::Stuck {
            self.stops += 1;
        } else if event.from == Motion::Stuck {
            self.starts += 1;
        } else {
            self.reversals += 1;
        }
    }
}

impl Peak {
    /// Updates the peak by a larger value, and its time and sign if it is larger by more than [`NEWS`].
    fn take(&mut self, value: f64, time: f64) {
        let (new, old) = (value.abs(), self.value.abs());
        if new > old * (1.0 + NEWS) {
            *self = Peak { value, time };
        } else if new > old {
            self.value = new.copysign(self.value);
        }
    }

    /// Updates the peak by the value at the end of an approach: of values equal within [`NEWS`], the last one counts.
    /// Near a steady value, only rounding would decide where it is largest.
    fn come_to(&mut self, value: f64, time: f64) {
        let (new, old) = (value.abs(), self.value.abs());
        if new > old * (1.0 + NEWS) {
            *self = Peak { value, time };
        } else if new > 0.0 && new >= old * (1.0 - NEWS) {
            let last = if time >= self.time { value } else { self.value };
            *self = Peak { value: new.max(old).copysign(last), time: self.time.max(time) };
        }
    }

    /// Updates the peak by the values at both ends of an interval; `holds` is true if a limit holds the value on all of
    /// it.
    fn pass(&mut self, [from, to]: [f64; 2], (begin, end): (f64, f64), holds: bool) {
        self.take(from, begin);
        if !holds {
            self.come_to(to, end);
        }
    }
}

/// Largest of these peaks, with its index; the first of equal ones.
fn largest(peaks: impl Iterator<Item = Peak>) -> (usize, Peak) {
    let larger =
        |best: (usize, Peak), one: (usize, Peak)| if one.1.value.abs() > best.1.value.abs() { one } else { best };
    peaks.enumerate().reduce(larger).unwrap_or_default()
}
