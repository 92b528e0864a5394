//! Geometry of a machine: its bodies, the course of the belt, and the motion by the drives.

use crate::mechanism::Label;

/// The geometry of a kind of machine.
#[derive(Debug)]
#[non_exhaustive]
pub struct Geometry {
    /// Its name in the case file.
    pub word: &'static str,
    /// Name in messages.
    pub name: &'static str,
    /// Its belts, in words.
    pub belts: &'static str,
    /// The drives.
    pub drives: &'static [DriveAt],
    /// The bodies other than rotors, by their numbers: drive pulleys first, in the order of the drives.
    pub bodies: &'static [BodyAt],
    /// The spans of the belt, by their numbers.
    pub spans: &'static [SpanAt],
    /// The sliding parts, by their numbers: a row of coordinates.
    pub slides: &'static [SlideAt],
}

/// A drive.
#[derive(Debug)]
#[non_exhaustive]
pub struct DriveAt {
    /// Its name.
    pub label: Label,
    /// The name of its limit of voltage; its key is the column of the voltage.
    pub voltage: Label,
    /// The name of its limit of current.
    pub current: Label,
    /// The column of its current.
    pub current_column: &'static str,
    /// The body that its gear turns.
    pub pulley: usize,
    /// Its gear, if compliant.
    pub gear: Label,
    /// Its rotor, if the gear is compliant.
    pub rotor: Label,
    /// Prefix of its keys: `left_drive.`.
    pub key: &'static str,
    /// Prefix of its columns: `left_`; without the underscore, the name of its input.
    pub prefix: &'static str,
    /// Key of the column of its input in a log.
    pub input: &'static str,
}

/// The drive of a gantry on this side, whose gear turns this body.
macro_rules! drive {
    ($side:literal, $pulley:expr) => {
        DriveAt {
            label: Label { key: concat!($side, "_drive"), name: concat!($side, " drive") },
            voltage: Label { key: concat!($side, "_voltage"), name: concat!($side, " voltage limit") },
            current: Label { key: concat!($side, "_current"), name: concat!($side, " current limit") },
            current_column: concat!($side, "_current"),
            pulley: $pulley,
            gear: Label { key: concat!($side, "_gear"), name: concat!($side, " gear") },
            rotor: Label { key: concat!($side, "_rotor"), name: concat!($side, " rotor") },
            key: concat!($side, "_drive."),
            prefix: concat!($side, "_"),
            input: concat!($side, "_input"),
        }
    };
}
pub(super) use drive;

/// A body.
#[derive(Debug)]
#[non_exhaustive]
pub struct BodyAt {
    /// Its name.
    pub label: Label,
    /// Its part of a machine.
    pub part: Part,
    /// Its position without strain as a weighted sum over the slides' positions; divided by the radius, an angle.
    pub by_slides: &'static [f64],
}

/// The part of a machine that a body is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Part {
    /// A pulley at a motor.
    DrivePulley,
    /// The pulley at the far end of an axis.
    IdlerPulley,
    /// The bridge, with the cart that rides on it.
    Bridge,
    /// The cart.
    Cart,
}

/// A span of the belt: a row of A.
#[derive(Debug)]
#[non_exhaustive]
pub struct SpanAt {
    /// Its name.
    pub label: Label,
    /// Prefix of the columns of its force and slack.
    pub column: &'static str,
    /// Elongation per displacement of each body.
    pub arms: &'static [(usize, Lever)],
    /// Its elongation per displacement a ψ of the bridge's right end by yaw, with ψ the yaw and a half the distance of
    /// the belts: the way of the end that it hangs on.
    pub on_yaw: f64,
    /// Change of its length from end to end per displacement of each slide; empty if its ends are fixed.
    pub follows: &'static [(usize, f64)],
    /// Its elongation as a sum over those of `Geometry::telling_spans`, without yaw: the spans of a belt add up to
    /// zero.
    pub by_others: &'static [(usize, f64)],
}

/// A lever arm.
#[derive(Debug, Clone, Copy)]
pub enum Lever {
    /// A multiple of the pulleys' radius.
    Radius(f64),
    /// A number.
    One(f64),
}

impl Lever {
    /// Its length on pulleys of radius `r`.
    pub fn factor(self, r: f64) -> f64 {
        match self {
            Lever::Radius(weight) => weight * r,
            Lever::One(weight) => weight,
        }
    }
}

/// A slide: a coordinate of the machine.
#[derive(Debug)]
#[non_exhaustive]
pub struct SlideAt {
    /// Its body.
    pub body: usize,
    /// Its end stops.
    pub stop: Label,
    /// Column and name of a force along its travel.
    pub force_along: Label,
    /// Column of a force that depends on its speed.
    pub force_by_speed: Label,
    /// Its position by the drives as a weighted sum over r φ of their pulleys.
    pub by_drives: &'static [f64],
    /// Position by the drives minus true position, without yaw, as a sum over span elongations: (span, weight).
    pub error: &'static [(usize, f64)],
}

impl DriveAt {
    /// Its side, as in names of inputs and commands: `left`, or the name of the only input of an axis.
    pub fn side(&self) -> &'static str {
        self.prefix.strip_suffix('_').unwrap_or(self.prefix)
    }
}

impl Geometry {
    /// Sides of the drives, as in names of inputs and commands.
    pub fn sides(&self) -> impl Iterator<Item = &'static str> {
        self.drives.iter().map(DriveAt::side)
    }

    /// Key of a drive in results: its side, or its pulley if it is the only drive.
    pub fn drive_key(&self, drive: &DriveAt) -> &'static str {
        if drive.side().is_empty() { self.label(drive.pulley).key } else { drive.side() }
    }

    /// The name of a slide's or drive pulley's body.
    pub fn label(&self, body: usize) -> Label {
        self.bodies[body].label
    }

    /// The names of the spans.
    pub fn span_labels(&self) -> impl Iterator<Item = Label> {
        self.spans.iter().map(|span| span.label)
    }

    /// The body of the cart.
    pub fn cart(&self) -> usize {
        self.slides[self.slides.len() - 1].body
    }

    /// Spans pulled by this drive alone: of its own belt, or of its side of a common one.
    pub fn spans_of(&self, drive: usize) -> impl Iterator<Item = usize> {
        let is_pulley = |body: usize| self.drives.iter().any(|drive| drive.pulley == body);
        let own = self.drives[drive].pulley;
        let is_own = move |span: &SpanAt| {
            let mut pulleys = span.arms.iter().map(|(body, _)| *body).filter(|body| is_pulley(*body)).peekable();
            pulleys.peek().is_some() && pulleys.all(|pulley| pulley == own)
        };
        self.spans.iter().enumerate().filter(move |(_, span)| is_own(span)).map(|(index, _)| index)
    }

    /// Change by yaw of a sum over span elongations that is `own` per a ψ, without the elongations of the spans.
    pub fn left_to_yaw(&self, own: f64, sum: &[(usize, f64)]) -> f64 {
        own - sum.iter().map(|&(span, weight)| weight * self.spans[span].on_yaw).sum::<f64>()
    }

    /// Spans whose elongations determine the position errors of all drives and the elongations of all other spans.
    pub(crate) fn telling_spans(&self) -> impl Iterator<Item = usize> {
        let tells = |span: &usize| self.slides.iter().any(|slide| slide.error.iter().any(|(own, _)| own == span));
        (0..self.spans.len()).filter(tells)
    }
}
