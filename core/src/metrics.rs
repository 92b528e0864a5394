//! The key figures of a run: where it ended, how fast it went, the load on belt and motor, when it stopped, and how far
//! the encoder's pulley and the cart were apart.
//!
//! A [`Meter`] observes a run as it goes on and keeps nothing of it, so that a run of any length needs the same memory.
//! It sees the motion between rows, on both sides of every event and jump of the input: what it reports does not depend
//! on the output interval but for rounding. Of the paper's Table 3 it sees the steps.

mod figures;
mod meter;
mod rotor;
mod steady;

pub use figures::{FIGURES, Figure, FigureRow, Role, Seek, Worth, figures};
pub use meter::{Meter, Sought};
pub use steady::{Balance, Held, SteadySpeed, balanced_speed};

use crate::friction::Motion;
use crate::solve::Event;

/// The key figures of one run, by the role of the parts. SI units; r is the pulleys' pitch radius, φ the angle of a
/// drive pulley.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Metrics {
    /// When the run ended, s.
    pub end: f64,
    /// The sliding parts: the cart of an axis, bridge and cart of a gantry.
    pub loads: Vec<OfLoad>,
    /// The drives, in the order of the inputs.
    pub drives: Vec<OfDrive>,
    /// The spans of the belt, in the order of [`Geometry::spans`](crate::machine::Geometry).
    pub spans: Vec<OfSpan>,
    /// Events of each body other than rotors.
    pub bodies: Vec<EventCount>,
    /// The speed that the cart settles at under constant input; none if no input but zero lasts a fiftieth of the run,
    /// or the run ended before that input did, and none of a machine with several drives.
    pub steady_speed: Option<SteadySpeed>,
    /// When everything came to rest, s, if it has: the time of the last event of a body, or when a rotor that turns by
    /// itself was last faster than a millionth of its largest speed, whichever is later; 0 if nothing ever moved. None
    /// while anything moves, where a body has no dry friction to stick by, and for a solver that locates no events
    /// (`table3` freezes speeds and creeps on).
    pub stop_time: Option<f64>,
    /// True if everything is at rest at the end: bodies and rotors.
    pub settled: bool,
    /// True if all bodies other than rotors are stuck at the end, at a speed of exactly zero.
    pub bodies_rest: bool,
    /// True if no rotor turns at the end: that of a gear with play turns no faster than a millionth of its largest
    /// speed. True for stiff gears, whose rotors are part of their pulleys.
    pub rotors_rest: bool,
}

/// Steps that a stepper lost.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LostSteps {
    /// Full steps by which the rotor is behind its field at the end: four for each tooth pitch.
    pub at_end: i64,
    /// How often the rotor fell to another tooth.
    pub slips: u64,
    /// When it did so first, s.
    pub first_slip: Option<f64>,
}

/// Figures of what slides.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OfLoad {
    /// Final position, m.
    pub position: f64,
    /// Its speed at the end, m/s.
    pub speed: f64,
    /// Final position by the angles of the drive pulleys without stretch of the belt, m: r φ of an
    /// axis.
    pub by_drives: f64,
    /// Its speed of largest magnitude, m/s.
    pub peak_speed: Peak,
    /// Peak of the position by the drives minus the true position, m: the error of an encoder at the drive
    /// pulley as a measurement of the cart.
    pub peak_error: Peak,
    /// Position commanded of the steppers at the end minus its own, m; none without steppers.
    pub command_error: Option<f64>,
}

/// Figures of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OfDrive {
    /// The angle of its pulley at the end, rad.
    pub angle: f64,
    /// The speed of its motor at the end, seen from behind the gear, rad/s: that of the pulley where the gear is stiff.
    pub shaft_speed: f64,
    /// r φ̇ of its pulley, of largest magnitude, m/s; of a machine with one drive.
    pub peak_belt_speed: Option<Peak>,
    /// The speed of its motor behind the gear, of largest magnitude, rad/s.
    pub peak_speed: Peak,
    /// Its current of largest magnitude, A.
    pub peak_current: Peak,
    /// Steps that it lost; none of a motor that is no stepper.
    pub lost_steps: Option<LostSteps>,
}

/// Figures of a span of the belt.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OfSpan {
    /// Its stretch of largest magnitude, m; negative where it is shorter than at rest (a belt that is tensioned by more
    /// than that is meant).
    pub peak_stretch: Peak,
    /// Its force of largest magnitude, N, damping included.
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

    /// True if no stepper lost a step.
    pub fn in_step(&self) -> bool {
        self.drives.iter().all(|drive| drive.lost_steps.is_none_or(|lost| lost.slips == 0))
    }

    /// The largest stretch of a span, and the span's place.
    pub fn largest_stretch(&self) -> (usize, Peak) {
        largest(self.spans.iter().map(|span| span.peak_stretch))
    }

    /// The largest force in a span, and the span's place.
    pub fn largest_force(&self) -> (usize, Peak) {
        largest(self.spans.iter().map(|span| span.peak_force))
    }
}

/// The value of largest magnitude, with its sign, and when that was.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Peak {
    /// The value, in the unit of what was looked at.
    pub value: f64,
    /// When, s.
    pub time: f64,
}

/// Numbers of stops, starts and reversals of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EventCount {
    /// It came to rest.
    pub stops: u64,
    /// It started to slide.
    pub starts: u64,
    /// It turned back without a rest.
    pub reversals: u64,
}

impl EventCount {
    /// All of them.
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
    /// Takes a value that is larger, and its time and sign where it is larger by more than [`NEWS`].
    fn take(&mut self, value: f64, time: f64) {
        let (new, old) = (value.abs(), self.value.abs());
        if new > old * (1.0 + NEWS) {
            *self = Peak { value, time };
        } else if new > old {
            self.value = new.copysign(self.value);
        }
    }

    /// Takes the value that something has come to: of values that are the same to [`NEWS`], the last one counts. On the
    /// way to a steady value only rounding tells where it is largest, and it is largest at its end.
    fn come_to(&mut self, value: f64, time: f64) {
        let (new, old) = (value.abs(), self.value.abs());
        if new > old * (1.0 + NEWS) {
            *self = Peak { value, time };
        } else if new > 0.0 && new >= old * (1.0 - NEWS) {
            let last = if time >= self.time { value } else { self.value };
            *self = Peak { value: new.max(old).copysign(last), time: self.time.max(time) };
        }
    }

    /// Takes the values at both ends of an interval; `holds` says that a limit holds the value on all of it.
    fn pass(&mut self, [from, to]: [f64; 2], (begin, end): (f64, f64), holds: bool) {
        self.take(from, begin);
        if !holds {
            self.come_to(to, end);
        }
    }
}

/// A bound that passes a peak by no more than this share of it is no reason to look closer, and values that differ by
/// no more are one. The peak itself is the top of a polynomial that is good to 1e-9 of the largest value, the share
/// that peaks are stated to; its time is off by the square root of that, as a share of the time in which the quantity
/// bends.
const NEWS: f64 = 1e-12;

/// The largest of these peaks, with its place; the first of equal ones.
fn largest(peaks: impl Iterator<Item = Peak>) -> (usize, Peak) {
    let larger =
        |best: (usize, Peak), one: (usize, Peak)| if one.1.value.abs() > best.1.value.abs() { one } else { best };
    peaks.enumerate().reduce(larger).unwrap_or_default()
}
