//! A machine as data: bodies, springs between them, drives on them, and columns of results.
//!
//! With the bodies' coordinates q, each spring's length is a row of lever arms times q, and everything else follows:
//!
//! ```text
//! s = A q,   f = K s + C ṡ,   M q̈ = −Aᵀ f + G i − F_f(q̇) + F
//! ```
//!
//! Friction, limits, slack and play make this piecewise linear; within one [`Mode`] it is linear, and
//! [`Mechanism::equations`] gives it. [`crate::machine`] defines the bodies and their names.

mod drive;
mod elements;
mod equations;
mod form;
mod layout;
mod mode;
mod nudge;
mod phases;
mod power;
mod ride;
#[cfg(test)]
pub(crate) mod testing;
mod transition;

pub use drive::{Amplifier, AmplifierMode, GearPlay, Motor, Stepper};
pub use equations::Equations;
pub use form::Form;
pub use form::ROUNDING;
pub use layout::{Layout, Replaced};
pub use mode::{Cause, Contact, DriveMode, Guard, Limit, Mode, Part, Status, Switch, What};
pub use phases::{PhaseRate, Phases, Steady};
pub use power::Power;
pub use ride::{Ridden, Ride, RideLaw, Riding};
pub use transition::{After, Next, Resets, StateQuantity, Then, Transition};

use crate::calculator::{Calculator, Evaluation};
use crate::friction::Friction;
use crate::polyline::Polyline;
use std::borrow::Cow;
use std::sync::Arc;

/// Maximum number of bodies.
pub const BODIES: usize = 6;
/// Maximum number of springs: six spans, the bearings of a yaw, and two ends and two lines of forces of the slides.
pub(crate) const SPRINGS: usize = 11;
/// Maximum number of drives.
pub const DRIVES: usize = 3;
/// Maximum of both together for the exact solver: three drives allow one body less than two drives.
pub(crate) const BODIES_AND_DRIVES: usize = BODIES + 2;
/// Maximum number of currents that are states: one for each brushed motor, two for each of two steppers.
pub const CURRENTS: usize = 4;
/// Maximum number of steppers of a machine, each with two currents.
pub const STEPPERS: usize = CURRENTS / 2;

/// Names of a part, as a key and in messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Label {
    /// In column headings and keys.
    pub key: &'static str,
    /// In messages.
    pub name: &'static str,
}

/// An inertia that turns or slides.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Body {
    /// Its name.
    pub label: Label,
    /// Rotary (rad) or linear (m).
    pub kind: MotionKind,
    /// Moment of inertia, kg m², or mass, kg, without the rotor.
    pub inertia: f64,
    /// Its friction, N m over rad/s or N over m/s.
    pub friction: Friction,
    /// A constant torque or force on it, N m or N.
    pub force: f64,
    /// Factor on its dry friction over its coordinate, if it varies.
    pub along: Option<Polyline>,
    /// The body that it moves with, and the ratio of their displacements; itself and 1 if it moves independently.
    pub leader: (usize, f64),
    /// True if it is the rotor of a drive, connected by the gear alone.
    pub is_rotor: bool,
}

/// Kind of motion of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MotionKind {
    /// It turns; the belt runs over it at this pitch radius, m.
    Rotary {
        /// m
        radius: f64,
    },
    /// It slides.
    Linear,
}

impl MotionKind {
    /// Displacement at the belt per displacement of the body: its pitch radius, or 1.
    pub fn lever(self) -> f64 {
        match self {
            MotionKind::Rotary { radius } => radius,
            MotionKind::Linear => 1.0,
        }
    }

    /// Units of position, speed and force (or torque) of the body.
    pub fn units(self) -> [&'static str; 3] {
        match self {
            MotionKind::Rotary { .. } => ["rad", "rad/s", "N m"],
            MotionKind::Linear => ["m", "m/s", "N"],
        }
    }
}

/// Something between bodies that has a length: a span of the belt, a gear, an end stop.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Spring {
    /// Its name.
    pub label: Label,
    /// A row of A: elongation per displacement of each body.
    pub arms: Vec<(usize, f64)>,
    /// Stiffness, N/m or N m/rad.
    pub stiffness: f64,
    /// Damping, N s/m or N m s/rad.
    pub damping: f64,
    /// Its force law.
    pub law: SpringLaw,
    /// Dependence of its stiffness on coordinates, if there is one.
    pub follows: Option<Follows>,
}

/// Force law of a spring.
#[derive(Debug, Clone, PartialEq)]
pub enum SpringLaw {
    /// Always.
    TwoSided,
    /// It only pulls: its force counts from a tension T₀, N, and it goes slack when its tension is zero.
    Tension {
        /// T₀, N
        pretension: f64,
    },
    /// It only pushes, beyond either end of a gap: flanks of a gear, end stops.
    Gap {
        /// Length at which the negative side begins to push.
        low: f64,
        /// Length at which the positive side begins to push.
        high: f64,
    },
    /// Force over its length or rate, piecewise linear: the same in both directions, without stored
    /// energy.
    Line {
        /// Its x.
        over: Over,
        /// Force, N or N m.
        line: Polyline,
    },
    /// No force; a run ends when its length leaves these bounds.
    Bounds {
        /// Least length.
        low: f64,
        /// Greatest length.
        high: f64,
    },
    /// No force: its length is the angle of a stepper's rotor, rad.
    Angle {
        /// The angle where the length is zero.
        at: f64,
    },
    /// No force: its length is only observed.
    None,
}

impl SpringLaw {
    /// The steepest slope of its line: as a stiffness and as a damping, N/m and N s/m or the like.
    pub(crate) fn steepest(&self) -> (f64, f64) {
        let SpringLaw::Line { over, line } = self else { return (0.0, 0.0) };
        let slopes = (0..=line.points().len()).map(|piece| line.piece(piece)[1].abs());
        let most = slopes.fold(0.0, f64::max);
        if *over == Over::Length { (most, 0.0) } else { (0.0, most) }
    }
}

/// The argument of a force line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Over {
    /// The length of a spring.
    Length,
    /// The rate of it.
    Rate,
}

/// A span whose length, and so its stiffness, changes with the positions of bodies: k = E A/(l + Σ a_j q_j).
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Follows {
    /// E A, N.
    pub rigidity: f64,
    /// l: its length at the origin, m.
    pub length: f64,
    /// a_j: change of its length per displacement of each body.
    pub arms: Vec<(usize, f64)>,
}

impl Follows {
    /// k = E A / l                                                                  (11)
    pub fn stiffness(&self, position: impl Fn(usize) -> f64) -> f64 {
        self.stiffness_by(&mut Evaluation::plain(), |body| Some(position(body)))
    }

    /// As [`Follows::stiffness`], for any calculator; bodies without a position are at zero.
    pub(crate) fn stiffness_by<C: Calculator>(&self, c: &mut C, position: impl Fn(usize) -> Option<C::N>) -> C::N {
        let change = self.arms.iter().filter_map(|&(body, arm)| Some(position(body)? * arm)).reduce(|sum, of| sum + of);
        let (rigidity, length) = (c.number(self.rigidity), c.number(self.length));
        rigidity / change.map_or(length, |change| length + change)
    }
}

/// A motor with gear and amplifier that turns a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// Its name.
    pub label: Label,
    /// The name of its voltage limit.
    pub voltage: Label,
    /// The name of its current limit.
    pub current: Label,
    /// The body behind the gear.
    pub pulley: usize,
    /// The body that the motor's shaft turns with: the pulley, or the rotor if the gear is compliant.
    pub shaft: usize,
    /// The motor.
    pub motor: Motor,
    /// The amplifier that feeds it.
    pub amplifier: Amplifier,
}

impl Drive {
    /// True if the rotor is an inertia of its own.
    pub fn has_rotor(&self) -> bool {
        self.shaft != self.pulley
    }

    /// True if its gear loses power.
    pub fn loses(&self) -> bool {
        self.motor.gear_efficiency < 1.0
    }

    /// True if the armature current is a state of its own.
    pub fn has_current_state(&self) -> bool {
        match self.amplifier.mode {
            AmplifierMode::Voltage => self.motor.inductance > 0.0,
            AmplifierMode::Current => self.amplifier.bandwidth.is_some(),
            AmplifierMode::Position => true,
        }
    }

    /// Number of windings with currents of their own.
    pub fn windings(&self) -> usize {
        if self.motor.stepper.is_some() { 2 } else { 1 }
    }

    /// True if its input differs from its terminal voltage and so has a column.
    pub(crate) fn shows_input(&self) -> bool {
        let amplifier = &self.amplifier;
        amplifier.gain != 1.0
            || amplifier.mode != AmplifierMode::Voltage
            || amplifier.voltage_limit.is_some()
            || amplifier.current_limit.is_some()
    }
}

/// A quantity in a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shown {
    /// Time, s.
    Time,
    /// Input of a drive, V or A.
    Input(usize),
    /// Voltage at a motor's terminals, V.
    Voltage(usize),
    /// Current of a motor, A; of the first phase of a stepper.
    Current(usize),
    /// Current of a stepper's second phase, A.
    SecondPhase(usize),
    /// Position of a body, times a factor.
    Position(usize, f64),
    /// Speed of a body, times a factor.
    Speed(usize, f64),
    /// Length of a spring; zero if both its ends are on one body.
    Stretch(usize),
    /// Force of a spring, times a factor.
    Force(usize, f64),
    /// Friction on a body.
    Friction(usize),
    /// The motion of a body, by [`Status::code`].
    Motion(usize),
    /// Deflection of the bristles of a body.
    Bristle(usize),
    /// State of a one-sided spring: slack, or the side that pushes.
    Contact(usize),
    /// Encoder counts of a body, with the counts per unit of its position.
    Counts(usize, f64),
}

/// A column of a run.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Heading {
    /// Its name.
    pub name: Cow<'static, str>,
    /// Its unit.
    pub unit: &'static str,
    /// The quantity in it.
    pub shown: Shown,
    /// True if it is also part of a lean run, for controllers and comparisons.
    pub lean: bool,
}

/// Positions and speeds of the bodies and currents of the drives, by their numbers; missing ones are zero.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// rad or m
    pub position: [f64; BODIES],
    /// rad/s or m/s
    pub speed: [f64; BODIES],
    /// A; only if the current is a state. In the order of the drives; a stepper has two in a row.
    pub current: [f64; CURRENTS],
}

/// Roles of parts, by index: loads, drives and spans. Metrics use them, with keys and names from
/// the labels.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Roles {
    /// Loads: bodies that the machine is meant to move.
    pub loads: Vec<usize>,
    /// Springs that carry the drives' motion to them.
    pub spans: Vec<usize>,
}

/// Bodies, springs and drives.
#[derive(Debug, Clone, PartialEq)]
pub struct Mechanism {
    /// The inertias; rotors come last.
    pub bodies: Vec<Body>,
    /// The springs between them.
    pub springs: Vec<Spring>,
    /// The drives, each with one input.
    pub drives: Vec<Drive>,
    /// The columns of a run.
    pub columns: Vec<Heading>,
    /// The readings of an observer, in their order: no more than [`crate::solve::QUANTITIES`].
    pub readings: Vec<Shown>,
    /// The roles of its parts.
    pub roles: Roles,
    /// A cart that rides on a bridge that yaws, if there is one.
    pub ride: Option<Ride>,
    /// Coordinates of the origin, for parts that depend on them.
    pub origin: [f64; BODIES],
    /// Linear part of the friction of each body and its followers, and whether it sticks.
    friction: Vec<(Friction, bool)>,
}

impl Mechanism {
    /// The mechanism of these parts. Rotors come last, and no list exceeds its maximum.
    pub fn new(bodies: Vec<Body>, springs: Vec<Spring>, drives: Vec<Drive>) -> Self {
        assert!(bodies.len() <= BODIES && springs.len() <= SPRINGS && drives.len() <= DRIVES);
        assert!(bodies.iter().is_sorted_by_key(|body| body.is_rotor));
        assert!(drives.iter().map(Drive::windings).sum::<usize>() <= CURRENTS);
        let mut friction = vec![(Friction::default(), Friction::default()); bodies.len()];
        for part in &bodies {
            let ((leader, ratio), mut own) = (part.leader, part.friction);
            let (all, sticking) = &mut friction[leader];
            if own.law.never_sticks() {
                // Only b v belongs to the linear equations.
                for side in [&mut own.forward, &mut own.backward] {
                    (side.coulomb, side.breakaway) = (0.0, 0.0);
                }
            } else {
                sticking.add(&own, ratio);
            }
            all.add(&own, ratio);
        }
        let friction = friction.into_iter().map(|(all, sticking)| (all, !sticking.is_linear())).collect();
        let (columns, readings, roles) = (Vec::new(), Vec::new(), Roles::default());
        Self { bodies, springs, drives, columns, readings, roles, ride: None, origin: [0.0; BODIES], friction }
    }

    /// Initial state of a run for a given one: rotors in the middle of their play, and zero for currents that are not
    /// states.
    pub fn begun(&self, given: &State) -> State {
        let mut state = *given;
        for drive in &self.drives {
            state.position[drive.shaft] = given.position[drive.pulley];
            state.speed[drive.shaft] = given.speed[drive.pulley];
        }
        for (number, current) in state.current.iter_mut().enumerate() {
            *current = if self.drive_of_current(number).is_some() { *current } else { 0.0 };
        }
        self.energise(&mut state);
        state
    }

    /// The first current of a drive, by its number.
    pub fn first_current(&self, drive: usize) -> usize {
        self.drives[..drive].iter().map(Drive::windings).sum()
    }

    /// The drive whose winding carries the current of this number, if that is a state.
    pub fn drive_of_current(&self, number: usize) -> Option<usize> {
        let ends = self.drives.iter().scan(0, |end, drive| {
            *end += drive.windings();
            Some(*end)
        });
        let drive = ends.take_while(|end| *end <= number).count();
        (drive < self.drives.len() && self.drives[drive].has_current_state()).then_some(drive)
    }

    /// The body that this one moves with; itself if it is independent.
    pub fn leader(&self, body: usize) -> usize {
        self.bodies[body].leader.0
    }

    /// Displacement of this body per displacement of its leader.
    pub fn ratio(&self, body: usize) -> f64 {
        self.bodies[body].leader.1
    }

    /// Independent bodies.
    pub fn leaders(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.bodies.len()).filter(|&body| self.leader(body) == body)
    }

    /// Bodies that move with `leader`, itself included.
    pub fn followers(&self, leader: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.bodies.len()).filter(move |&body| self.leader(body) == leader)
    }

    /// Bodies other than rotors.
    pub fn held_bodies(&self) -> std::ops::Range<usize> {
        0..self.bodies.iter().take_while(|body| !body.is_rotor).count()
    }

    /// Friction of a body and its followers in the equations of a mode: b v ± F_c and a breakaway, or only b v for one
    /// that never sticks. Zero for a follower.
    pub fn friction(&self, body: usize) -> &Friction {
        &self.friction[body].0
    }

    /// True if a body can stick or has a direction-dependent law, so that its motion has modes at all.
    pub fn has_modes(&self, body: usize) -> bool {
        let leader = self.leader(body);
        let by_gear = |drive: &Drive| drive.loses() && self.leader(drive.shaft) == leader;
        self.friction[leader].1 || self.drives.iter().any(by_gear)
    }

    /// True if its equations are linear except for changes of mode, as the exact solver requires.
    pub fn is_piecewise_linear(&self) -> bool {
        let straight = |body: &Body| body.friction.is_piecewise_linear() && body.along.is_none();
        self.bodies.iter().all(straight)
            && self.springs.iter().all(|spring| spring.follows.is_none())
            && self.drives.iter().all(|drive| drive.motor.stepper.is_none())
            && self.ride.is_none()
    }

    /// Length of a spring.
    pub fn length(&self, spring: usize, position: &[f64; BODIES]) -> f64 {
        self.springs[spring].arms.iter().map(|&(body, arm)| arm * position[body]).sum()
    }

    /// Change of a spring's length per displacement of each independent body; zero if one body carries both its ends.
    pub fn leading_arms(&self, spring: usize) -> [f64; BODIES] {
        let (mut arms, mut size) = ([0.0; BODIES], 0.0);
        for &(body, arm) in &self.springs[spring].arms {
            let arm = arm * self.ratio(body);
            arms[self.leader(body)] += arm;
            size += arm.abs();
        }
        // r · (1/r) is 1 except for rounding.
        arms.map(|arm| if arm.abs() <= 1e-12 * size { 0.0 } else { arm })
    }

    /// The rate of a spring's length.
    pub(crate) fn stretch_rate(&self, spring: usize) -> Form {
        let mut rate = Form::ZERO;
        for &(body, arm) in &self.springs[spring].arms {
            rate.speed[body] += arm;
        }
        rate
    }

    /// [`Mechanism::seen_from`], or this mechanism if its coordinates begin at zero already.
    pub(crate) fn seen_by(self: &Arc<Self>, layout: &Layout, start: &State) -> Arc<Self> {
        if layout.origin(start) == self.origin { Arc::clone(self) } else { Arc::new(self.seen_from(layout, start)) }
    }

    /// This mechanism with positions counted from `start`: ends and bounds are shifted before any multiplication.
    pub(crate) fn seen_from(&self, layout: &Layout, start: &State) -> Self {
        let mut seen = self.clone();
        seen.origin = layout.origin(start);
        for (index, spring) in seen.springs.iter_mut().enumerate() {
            let shift = layout.shift(index, &seen.origin);
            match &mut spring.law {
                SpringLaw::Gap { low, high } | SpringLaw::Bounds { low, high } => {
                    (*low, *high) = (*low - shift, *high - shift);
                }
                SpringLaw::Line { over: Over::Length, line } => *line = line.shifted(shift),
                SpringLaw::Angle { at } => *at += shift,
                SpringLaw::Line { over: Over::Rate, .. }
                | SpringLaw::TwoSided
                | SpringLaw::Tension { .. }
                | SpringLaw::None => {}
            }
        }
        seen
    }
}
