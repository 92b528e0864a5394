//! Modes: which linear equations hold, what ends them, and what follows.

use super::{Body, Form};
use crate::friction::Motion;

/// Which linear equations hold: what each body, each span, the gear, the amplifier and the end stops do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Mode {
    /// Motion of drive pulley, cart, idler pulley.
    pub motion: [Motion; 3],
    /// Whether the torque through the gear is positive; matters only where the gear loses power.
    pub gear_torque_positive: bool,
    /// Whether spans 1, 2, 3 are slack.
    pub slack: [bool; 3],
    /// Which flank of the gear touches.
    pub gear: Contact,
    /// Whether the voltage limit binds.
    pub voltage: Limit,
    /// Whether the current limit binds.
    pub current: Limit,
    /// Which end stop the cart touches.
    pub stop: Contact,
}

impl Mode {
    /// Bodies that move so, and nothing else out of the ordinary.
    pub fn of(motion: [Motion; 3]) -> Self {
        Self {
            motion,
            gear_torque_positive: true,
            slack: [false; 3],
            gear: Contact::Apart,
            voltage: Limit::Inside,
            current: Limit::Inside,
            stop: Contact::Apart,
        }
    }

    /// What `part` does.
    pub fn status(&self, part: Part) -> Status {
        match part {
            Part::Body(body) => Status::Motion(self.motion[body.index()]),
            Part::Span(span) => Status::Slack(self.slack[span]),
            Part::Voltage => Status::Limit(self.voltage),
            Part::Current => Status::Limit(self.current),
            Part::Gear => Status::Contact(self.gear),
            Part::Stop => Status::Contact(self.stop),
        }
    }

    /// Makes a part other than a body do something else.
    pub(crate) fn switch(&mut self, to: Switch) {
        match to {
            Switch::Span(span, slack) => self.slack[span] = slack,
            Switch::Voltage(limit) => self.voltage = limit,
            Switch::Current(limit) => self.current = limit,
            Switch::Gear(contact) => self.gear = contact,
            Switch::Stop(contact) => self.stop = contact,
        }
    }
}

/// Whether a limit binds, and on which side.
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

/// Whether two elastic flanks touch, and on which side. A flank only pushes: one that its damper holds back from following
/// carries nothing, though it has not left.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Contact {
    /// The negative side carries.
    Low,
    /// The negative side is within reach and carries nothing.
    LowLoose,
    /// Neither side.
    #[default]
    Apart,
    /// The positive side is within reach and carries nothing.
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

/// A part of the stage that can change what it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Part {
    /// One of the three inertias.
    Body(Body),
    /// Span 1, 2 or 3 as 0, 1, 2.
    Span(usize),
    /// The amplifier's voltage limit.
    Voltage,
    /// The amplifier's current limit.
    Current,
    /// The flanks of a gear with play.
    Gear,
    /// The end stops.
    Stop,
}

impl Part {
    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Part::Body(body) => body.name(),
            Part::Span(span) => ["span 1", "span 2", "span 3"][span],
            Part::Voltage => "voltage limit",
            Part::Current => "current limit",
            Part::Gear => "gear",
            Part::Stop => "end stop",
        }
    }

    /// Its place in lists: bodies, spans, gear, limits, end stops.
    pub fn order(self) -> usize {
        match self {
            Part::Body(body) => body.index(),
            Part::Span(span) => 3 + span,
            Part::Gear => 6,
            Part::Voltage => 7,
            Part::Current => 8,
            Part::Stop => 9,
        }
    }

    /// Its name in column headings and keys.
    pub fn key(self) -> &'static str {
        match self {
            Part::Body(body) => body.key(),
            Part::Span(span) => ["span_1", "span_2", "span_3"][span],
            Part::Voltage => "voltage",
            Part::Current => "current",
            Part::Gear => "gear",
            Part::Stop => "stop",
        }
    }
}

/// What a part does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Of a body.
    Motion(Motion),
    /// Of a span: whether it is slack.
    Slack(bool),
    /// Of a limit.
    Limit(Limit),
    /// Of gear and end stops.
    Contact(Contact),
}

impl Status {
    /// As in the result files: a body −1 backward, 0 stuck, 1 forward, 2 free; a span 1 if slack; a limit, gear or stop the
    /// side that binds or carries, or 0.
    pub fn code(self) -> i8 {
        match self {
            Status::Motion(motion) => motion.code(),
            Status::Slack(slack) => i8::from(slack),
            Status::Limit(limit) => limit.sign() as i8,
            Status::Contact(contact) => contact.code(),
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
pub struct Guard {
    /// What must not become negative.
    pub form: Form,
    /// What it means when it does.
    pub cause: Cause,
}

/// Why a mode ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// A sliding body comes to zero speed.
    Stop(Body),
    /// The load on a stuck body passes its breakaway forward.
    BreakForward(Body),
    /// The load on a stuck body passes its breakaway backward.
    BreakBackward(Body),
    /// The torque through the gear changes sign.
    GearTorque,
    /// Another part begins to do something else.
    Switch(Switch),
    /// The cart leaves its travel.
    LeaveTravel,
}

impl Cause {
    /// Number of kinds that [`Cause::kind`] tells apart: on the three bodies, the gear's torque, three spans, for each of gear, voltage,
    /// current and end stop one for each state that it may lead to, and on the three bodies once more.
    pub(crate) const KINDS: usize = 7 + 4 * 3 + 3;

    /// Which condition it belongs to; breakaway forward stands with the body, breakaway backward, which may be of quite another size,
    /// by itself.
    pub(crate) fn kind(self) -> usize {
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
            Cause::Stop(body) | Cause::BreakForward(body) => body.index(),
            Cause::BreakBackward(body) => 19 + body.index(),
            Cause::GearTorque => 3,
            Cause::Switch(Switch::Span(span, _)) => 4 + span,
            Cause::Switch(Switch::Gear(to)) => 7 + contact(to),
            Cause::Switch(Switch::Voltage(to)) => 10 + limit(to),
            Cause::Switch(Switch::Current(to)) => 13 + limit(to),
            Cause::Switch(Switch::Stop(to)) => 16 + contact(to),
            Cause::LeaveTravel => 16,
        }
    }

    /// Which of several conditions that have fallen at one instant is settled first: limits, flanks, spans and stops, which
    /// follow from the state and the input alone; then the gear's torque, which follows from them; then bodies, which break away
    /// with the load that all of these leave.
    pub(crate) fn rank(self) -> u8 {
        match self {
            Cause::LeaveTravel => 0,
            Cause::Switch(_) => 1,
            Cause::GearTorque => 2,
            Cause::Stop(_) | Cause::BreakForward(_) | Cause::BreakBackward(_) => 3,
        }
    }

    /// Whether both are of the same part, and it is no body.
    pub(crate) fn is_of_same_part(self, other: Cause) -> bool {
        match (self, other) {
            (Cause::GearTorque, Cause::GearTorque) => true,
            (Cause::Switch(a), Cause::Switch(b)) => a.part() == b.part(),
            _ => false,
        }
    }
}

/// What a part other than a body does next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Switch {
    /// A span goes slack, or is taut again.
    Span(usize, bool),
    /// The voltage limit.
    Voltage(Limit),
    /// The current limit.
    Current(Limit),
    /// The gear's flanks.
    Gear(Contact),
    /// The end stops.
    Stop(Contact),
}

impl Switch {
    /// The part.
    pub fn part(self) -> Part {
        match self {
            Switch::Span(span, _) => Part::Span(span),
            Switch::Voltage(_) => Part::Voltage,
            Switch::Current(_) => Part::Current,
            Switch::Gear(_) => Part::Gear,
            Switch::Stop(_) => Part::Stop,
        }
    }
}
