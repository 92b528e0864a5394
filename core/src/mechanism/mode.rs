//! Modes: the linear equations in force, their guards, and the next mode.

use super::{BODIES, DRIVES, Form, Label, Mechanism, SPRINGS, Transition};
use crate::friction::Motion;

/// Mode: the state of each body, spring and drive, within which the equations are linear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct Mode {
    /// Motion of each body.
    pub motion: [Motion; BODIES],
    /// True if a spring that only pulls is slack.
    pub slack: [bool; SPRINGS],
    /// Side of each one-sided spring that is in contact.
    pub contact: [Contact; SPRINGS],
    /// Index of the piece of each piecewise linear spring.
    pub piece: [u8; SPRINGS],
    /// The state of each drive.
    pub drive: [DriveMode; DRIVES],
}

/// The states of the parts of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct DriveMode {
    /// True if the torque through the gear is positive; matters only for a lossy gear.
    pub torque_positive: bool,
    /// State of the voltage limit.
    pub voltage: Limit,
    /// State of the current limit.
    pub current: Limit,
    /// Tooth pitches by which a stepper's rotor has fallen behind its command.
    pub slipped: i32,
}

impl DriveMode {
    /// Drive within its limits, with positive gear torque.
    pub(crate) const ORDINARY: Self =
        Self { torque_positive: true, voltage: Limit::Inside, current: Limit::Inside, slipped: 0 };
}

impl Mode {
    /// Mode with these motions of the bodies, in order, and all other parts in their ordinary case; further bodies are
    /// free.
    pub fn new(motion: impl IntoIterator<Item = Motion>) -> Self {
        let mut mode = Self {
            motion: [Motion::Free; BODIES],
            slack: [false; SPRINGS],
            contact: [Contact::Apart; SPRINGS],
            piece: [0; SPRINGS],
            drive: [DriveMode::ORDINARY; DRIVES],
        };
        for (own, motion) in mode.motion.iter_mut().zip(motion) {
            *own = motion;
        }
        mode
    }

    /// The same mode with this sign of all gear torques.
    pub fn with_torque(mut self, positive: bool) -> Self {
        self.drive.iter_mut().for_each(|drive| drive.torque_positive = positive);
        self
    }

    /// The state of a part.
    pub fn status(&self, what: What) -> Status {
        match what {
            What::Body(body) => Status::Motion(self.motion[body]),
            What::Span(spring) => Status::Slack(self.slack[spring]),
            What::Gap(spring) => Status::Contact(self.contact[spring]),
            What::Line(spring) => Status::Piece(self.piece[spring]),
            What::Voltage(drive) => Status::Limit(self.drive[drive].voltage),
            What::Current(drive) => Status::Limit(self.drive[drive].current),
            What::Field(drive) => Status::Slipped(self.drive[drive].slipped),
        }
    }

    /// Switches a part other than a body.
    pub(crate) fn switch(&mut self, to: Switch) {
        match to {
            Switch::Span(spring, slack) => self.slack[spring] = slack,
            Switch::Gap(spring, contact) => self.contact[spring] = contact,
            Switch::Line(spring, piece) => self.piece[spring] = piece,
            Switch::Voltage(drive, limit) => self.drive[drive].voltage = limit,
            Switch::Current(drive, limit) => self.drive[drive].current = limit,
            Switch::Field(drive, slipped) => self.drive[drive].slipped = slipped,
        }
    }
}

/// State of a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Limit {
    /// At the negative limit.
    Low,
    /// Within the limits.
    #[default]
    Inside,
    /// At the positive limit.
    High,
}

impl Limit {
    /// −1, 0 or 1.
    pub fn sign(self) -> f64 {
        match self {
            Limit::Low => -1.0,
            Limit::Inside => 0.0,
            Limit::High => 1.0,
        }
    }
}

/// State of two elastic flanks. A flank only pushes: one that its damper delays carries no force, although it has not
/// separated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Contact {
    /// The negative side carries.
    Low,
    /// The negative side is in contact without force.
    LowLoose,
    /// Neither side.
    #[default]
    Apart,
    /// The positive side is in contact without force.
    HighLoose,
    /// The positive side carries.
    High,
}

impl Contact {
    /// The side that carries: −1, 0 or 1.
    pub fn code(self) -> i8 {
        match self {
            Contact::Low => -1,
            Contact::High => 1,
            _ => 0,
        }
    }
}

/// Part of a mechanism, by index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum What {
    /// A body.
    Body(usize),
    /// A spring that only pulls.
    Span(usize),
    /// A spring that only pushes: flanks of a gear, end stops.
    Gap(usize),
    /// A spring whose force is a line.
    Line(usize),
    /// A drive's voltage limit.
    Voltage(usize),
    /// A drive's current limit.
    Current(usize),
    /// The field of a stepper, which its rotor follows.
    Field(usize),
}

/// A part of a mechanism that changes between modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct Part {
    /// Which.
    pub what: What,
    /// Its name.
    pub label: Label,
}

impl Part {
    /// A part of a mechanism, with its name.
    pub fn new(mechanism: &Mechanism, what: What) -> Self {
        let label = match what {
            What::Body(body) => mechanism.bodies[body].label,
            What::Span(spring) | What::Gap(spring) | What::Line(spring) => mechanism.springs[spring].label,
            What::Voltage(drive) => mechanism.drives[drive].voltage,
            What::Current(drive) => mechanism.drives[drive].current,
            What::Field(drive) => mechanism.drives[drive].label,
        };
        Self { what, label }
    }

    /// Its name for people.
    pub fn name(self) -> &'static str {
        self.label.name
    }

    /// Its name in column headings and keys.
    pub fn key(self) -> &'static str {
        self.label.key
    }
}

/// The state of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Status {
    /// State of a body.
    Motion(Motion),
    /// State of a span: true if slack.
    Slack(bool),
    /// State of a limit.
    Limit(Limit),
    /// State of a gear or an end stop.
    Contact(Contact),
    /// State of a line: index of its piece.
    Piece(u8),
    /// State of a stepper: tooth pitches, four full steps each, by which its rotor is behind.
    Slipped(i32),
}

impl Status {
    /// As in the result files: a body −1 backward, 0 stuck, 1 forward, 2 free; a span 1 if slack; a limit, gear or stop
    /// the side that binds or carries, or 0; a line always 0, since its force is continuous between pieces.
    pub fn code(self) -> i8 {
        match self {
            Status::Motion(motion) => motion.code(),
            Status::Slack(slack) => i8::from(slack),
            Status::Limit(limit) => limit.sign() as i8,
            Status::Contact(contact) => contact.code(),
            Status::Piece(_) => 0,
            Status::Slipped(pitches) => pitches.clamp(i32::from(i8::MIN), i32::from(i8::MAX)) as i8,
        }
    }

    /// True if both have the same code in results.
    pub(crate) fn shows_as(self, other: Status) -> bool {
        match (self, other) {
            (Status::Slipped(own), Status::Slipped(other)) => own == other,
            _ => self.code() == other.code(),
        }
    }

    /// The word for it.
    pub fn word(self) -> &'static str {
        match self {
            Status::Motion(motion) => motion.word(),
            Status::Slack(true) => "slack",
            Status::Slack(false) => "taut",
            Status::Limit(Limit::Inside) => "within",
            Status::Limit(Limit::High) => "at the positive limit",
            Status::Limit(Limit::Low) => "at the negative limit",
            Status::Contact(contact) => ["negative side", "apart", "positive side"][(contact.code() + 1) as usize],
            Status::Piece(_) => "on a piece of its line",
            Status::Slipped(0) => "in step",
            Status::Slipped(1..) => "behind by lost steps",
            Status::Slipped(_) => "ahead by lost steps",
        }
    }
}

impl PartialEq<Motion> for Status {
    fn eq(&self, other: &Motion) -> bool {
        *self == Status::Motion(*other)
    }
}

/// A condition of a mode: the mode holds while `form` ≥ 0.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Guard {
    /// The form that must not become negative.
    pub form: Form,
    /// Consequence of its sign change.
    pub transition: Transition,
}

/// Cause of the end of a mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// A sliding body reaches zero speed.
    Stop(usize),
    /// The load on a stuck body exceeds its forward breakaway.
    BreakForward(usize),
    /// The load on a stuck body exceeds its backward breakaway.
    BreakBackward(usize),
    /// The torque through the gear of a drive changes sign.
    GearTorque(usize),
    /// Another part switches.
    Switch(Switch),
    /// The length of a spring leaves its bounds.
    Leave(usize),
}

impl Cause {
    /// Number of kinds that [`Cause::kind`] distinguishes: two for each body, one for each gear, three each for a
    /// drive's limits and for a spring, two for a stepper's field.
    pub(crate) const KINDS: usize = 2 * BODIES + 9 * DRIVES + 3 * SPRINGS;

    /// The body whose motion it concerns; none of gears and other parts.
    pub(crate) fn body(self) -> Option<usize> {
        match self {
            Cause::Stop(body) | Cause::BreakForward(body) | Cause::BreakBackward(body) => Some(body),
            Cause::GearTorque(_) | Cause::Switch(_) | Cause::Leave(_) => None,
        }
    }

    /// Index of its condition; forward breakaway shares that of the body, backward breakaway, which may have a very
    /// different size, has its own.
    pub fn kind(self) -> usize {
        const GEAR: usize = 2 * BODIES;
        const LIMITS: usize = GEAR + DRIVES;
        const SPRING: usize = LIMITS + 6 * DRIVES;
        const FIELD: usize = SPRING + 3 * SPRINGS;
        let limit = |limit| match limit {
            Limit::Inside => 0,
            Limit::High => 1,
            Limit::Low => 2,
        };
        let contact = |contact| match contact {
            Contact::Apart => 0,
            Contact::High | Contact::HighLoose => 1,
            Contact::Low | Contact::LowLoose => 2,
        };
        match self {
            Cause::Stop(body) | Cause::BreakForward(body) => body,
            Cause::BreakBackward(body) => BODIES + body,
            Cause::GearTorque(drive) => GEAR + drive,
            Cause::Switch(Switch::Voltage(drive, to)) => LIMITS + 6 * drive + limit(to),
            Cause::Switch(Switch::Current(drive, to)) => LIMITS + 6 * drive + 3 + limit(to),
            Cause::Switch(Switch::Span(spring, _)) | Cause::Leave(spring) => SPRING + 3 * spring,
            Cause::Switch(Switch::Gap(spring, to)) => SPRING + 3 * spring + contact(to),
            // The neighbours of a number differ by two.
            Cause::Switch(Switch::Field(drive, to)) => FIELD + 2 * drive + usize::from(to.rem_euclid(4) >= 2),
            // The previous, this and the next piece have different indices.
            Cause::Switch(Switch::Line(spring, to)) => SPRING + 3 * spring + usize::from(to % 3),
        }
    }

    /// Order in which simultaneous events are settled: limits, flanks, spans and stops, which depend on state and input
    /// alone; then gear torques, which depend on these; then bodies, whose breakaway depends on all of them.
    pub fn rank(self) -> u8 {
        match self {
            Cause::Leave(_) => 0,
            Cause::Switch(_) => 1,
            Cause::GearTorque(_) => 2,
            Cause::Stop(_) | Cause::BreakForward(_) | Cause::BreakBackward(_) => 3,
        }
    }

    /// True if both belong to the same part and it is not a body.
    pub(crate) fn is_of_same_part(self, other: Cause) -> bool {
        match (self, other) {
            (Cause::GearTorque(a), Cause::GearTorque(b)) => a == b,
            (Cause::Switch(a), Cause::Switch(b)) => a.what() == b.what(),
            _ => false,
        }
    }
}

/// The next state of a part other than a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Switch {
    /// A spring that only pulls goes slack, or is taut again.
    Span(usize, bool),
    /// A spring that only pushes makes or loses contact.
    Gap(usize, Contact),
    /// A piecewise linear spring changes its piece.
    Line(usize, u8),
    /// The voltage limit of a drive.
    Voltage(usize, Limit),
    /// The current limit of a drive.
    Current(usize, Limit),
    /// The rotor of a stepper falls to another tooth; pitches behind the field.
    Field(usize, i32),
}

impl Switch {
    /// The part.
    pub fn what(self) -> What {
        match self {
            Switch::Span(spring, _) => What::Span(spring),
            Switch::Gap(spring, _) => What::Gap(spring),
            Switch::Line(spring, _) => What::Line(spring),
            Switch::Voltage(drive, _) => What::Voltage(drive),
            Switch::Current(drive, _) => What::Current(drive),
            Switch::Field(drive, _) => What::Field(drive),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_that_hold_together_have_different_numbers() {
        let limits = [Limit::Inside, Limit::High, Limit::Low];
        let mut kinds: Vec<usize> = Vec::new();
        for body in 0..BODIES {
            kinds.extend([Cause::Stop(body), Cause::BreakBackward(body)].map(Cause::kind));
        }
        for drive in 0..DRIVES {
            kinds.push(Cause::GearTorque(drive).kind());
            kinds.extend(limits.map(|to| Cause::Switch(Switch::Voltage(drive, to)).kind()));
            kinds.extend(limits.map(|to| Cause::Switch(Switch::Current(drive, to)).kind()));
            kinds.extend([1, 3].map(|to| Cause::Switch(Switch::Field(drive, to)).kind()));
        }
        for spring in 0..SPRINGS {
            let contacts = [Contact::Apart, Contact::High, Contact::Low];
            kinds.extend(contacts.map(|to| Cause::Switch(Switch::Gap(spring, to)).kind()));
        }
        let count = kinds.len();
        kinds.sort_unstable();
        kinds.dedup();
        assert_eq!((kinds.len(), kinds.last()), (count, Some(&(Cause::KINDS - 1))));
    }
}
