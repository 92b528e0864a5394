//! Location of a parameter in a machine, with access to it.

use crate::friction::{Friction, Law, Shape, decay_of_velocity, velocity_of_decay};
use crate::machine::{Amplifier, AmplifierMode, Belt, BeltModel, Machine, MachineKind, Motor, SimpleDrive, Slide};

/// Location of a parameter in a machine.
#[derive(Debug, Clone, Copy)]
pub enum Field {
    /// In no machine: a number of a run, recorder, controller or method.
    Elsewhere,
    /// In a machine.
    Machine(Accessor),
    /// In a machine, as another form of the number with this key.
    Form(&'static str, Accessor),
    /// Used to compute the number with this key; the machine stores the result only.
    PartOf(&'static str),
}

/// Getter and setter of a number of a machine, or of each of its parts of a kind.
#[derive(Debug, Clone, Copy)]
pub struct Accessor {
    /// Owner of the number.
    pub(super) of: Of,
    /// Value for a part; none if the machine lacks the part, or computes the value from others.
    pub(super) get: fn(&Machine, usize) -> Option<f64>,
    /// Sets it and everything computed from it; does nothing if the machine lacks the part.
    pub(super) set: fn(&mut Machine, usize, f64),
}

/// Owner of a parameter.
#[derive(Debug, Clone, Copy)]
pub(super) enum Of {
    /// The machine: a single number.
    Machine,
    /// A machine with one drive and one slide: others have one row for each slide, or lack the part.
    Axis,
    /// A machine with several slides.
    Gantry,
    /// Each drive.
    Drive,
    /// Each slide of a machine with several.
    Slide,
    /// Each span.
    Span,
    /// Each point of a line of an axis; the function gives their number.
    Point(fn(&Machine) -> usize),
    /// Each point of a line of each slide of a machine with several; the function gives their number on a slide.
    SlidePoint(fn(&Slide) -> usize),
}

impl Accessor {
    /// Naming and number of its elements in this machine; none if the machine lacks it.
    pub(super) fn listed(&self, machine: &Machine) -> Option<(List, usize)> {
        let (drives, slides) = (machine.drives.len(), machine.slides().count());
        match self.of {
            Of::Machine => Some((List::None, 1)),
            Of::Axis => (slides == 1).then_some((List::None, 1)),
            Of::Gantry => (slides > 1).then_some((List::None, 1)),
            Of::Drive if drives == 1 => Some((List::None, 1)),
            Of::Drive => Some((List::Drives(machine.kind), drives)),
            Of::Slide => (slides > 1).then_some((List::Slides, slides)),
            Of::Span => Some((List::Numbers, machine.belt.stiffness.len())),
            Of::Point(count) => (slides == 1).then(|| (List::Points, count(machine))),
            Of::SlidePoint(count) => (slides > 1).then(|| {
                let counts: Vec<usize> = machine.slides().map(count).collect();
                (List::SlidePoints(counts[0]), counts.iter().sum())
            }),
        }
    }
}

/// Naming of the elements of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum List {
    /// It is a single number.
    None,
    /// `belt.stiffness.0`
    Numbers,
    /// `cart.friction.along.0.factor`: a list of points.
    Points,
    /// `left_drive.motor.resistance`, `right_drive.motor.resistance`: one for each drive. `motor.resistance` sets all.
    Drives(MachineKind),
    /// `bridge.mass`, `cart.mass`: one for each slide, with the bridge's key in the table.
    Slides,
    /// `bridge.force_by_speed.0.force`, `cart.force_by_speed.0.force`: a list of points for each slide, this number of
    /// them on the bridge.
    SlidePoints(usize),
}

/// Sliding bodies of a gantry, as prefixes of keys.
pub(super) const SLIDES: [&str; 2] = ["bridge.", "cart."];

impl List {
    /// Key of an element for `--set`, of the parameter with this key.
    pub(super) fn key(self, key: &str, index: usize) -> String {
        match self {
            List::None => key.to_string(),
            List::Numbers => format!("{key}.{index}"),
            List::Points => match key.rsplit_once('.') {
                Some((points, name)) => format!("{points}.{index}.{name}"),
                None => key.to_string(),
            },
            List::Drives(kind) => {
                format!("{}{key}", kind.geometry().drives.get(index).map_or("", |drive| drive.key))
            }
            List::Slides => match (SLIDES.get(index), key.strip_prefix(SLIDES[0])) {
                (Some(slide), Some(rest)) => format!("{slide}{rest}"),
                _ => key.to_string(),
            },
            List::SlidePoints(of_bridge) => {
                let (slide, point) = if index < of_bridge { (0, index) } else { (1, index - of_bridge) };
                List::Points.key(&List::Slides.key(key, slide), point)
            }
        }
    }

    /// True if the parameter's own key sets all elements together.
    pub(super) fn has_whole(self) -> bool {
        !matches!(self, List::Slides | List::SlidePoints(_))
    }
}

impl Field {
    /// An optional number of the machine.
    pub(super) const fn number(get: fn(&Machine, usize) -> Option<f64>, set: fn(&mut Machine, usize, f64)) -> Self {
        Self::new(Of::Machine, get, set)
    }

    /// A number of each of these owners.
    pub(super) const fn new(
        of: Of,
        get: fn(&Machine, usize) -> Option<f64>,
        set: fn(&mut Machine, usize, f64),
    ) -> Self {
        Self::Machine(Accessor { of, get, set })
    }

    /// Another form of the number with the key `of`.
    pub(super) const fn form(self, of: &'static str) -> Self {
        match self {
            Self::Machine(accessor) | Self::Form(_, accessor) => Self::Form(of, accessor),
            Self::Elsewhere => Self::Elsewhere,
            Self::PartOf(whole) => Self::PartOf(whole),
        }
    }

    /// Its getter and setter in a machine.
    pub(super) fn accessor(&self) -> Option<&Accessor> {
        match self {
            Self::Machine(accessor) | Self::Form(_, accessor) => Some(accessor),
            Self::Elsewhere | Self::PartOf(_) => None,
        }
    }
}

/// A number that every machine, or every axis, has.
macro_rules! always {
    ($of:ident, |$machine:ident| $($place:tt)*) => {
        Field::new(Of::$of, |$machine, _| Some($($place)*), |$machine, _, value| $($place)* = value)
    };
}

/// A number of an optional part.
macro_rules! part {
    ($of:ident, |$machine:ident| $part:expr, $reach:expr => $name:ident) => {
        Field::new(
            Of::$of,
            |$machine, _| $part.map(|part| part.$name),
            |$machine, _, value| {
                if let Some(part) = $reach {
                    part.$name = value;
                }
            },
        )
    };
}

/// A number of the belt's make, from which its stiffness is computed; `specific` is true if E A is given instead of E
/// and A.
macro_rules! make {
    ($of:ident, |$belt:ident| $applies:expr, |$make:ident, $span:pat_param| $($place:tt)*) => {
        Field::new(
            Of::$of,
            |machine, $span| {
                let $belt = &machine.belt;
                $belt.make.filter(|_| $applies).map(|$make| $($place)*)
            },
            |machine, $span, value| {
                let $belt = &mut machine.belt;
                let applies = $applies;
                if let Some($make) = $belt.make.as_mut().filter(|_| applies) {
                    $($place)* = value;
                    // k = A E / l                                                      (11)
                    machine.belt.follow_make();
                }
            },
        )
    };
}

/// A number of each motor or amplifier.
macro_rules! of_drive {
    ($part:ident, |$old:ident| $get:expr, |$new:ident, $value:ident| $set:expr) => {
        Field::new(
            Of::Drive,
            |machine, drive| {
                let $old = &machine.drives.get(drive)?.$part;
                $get
            },
            |machine, drive, $value| {
                if let Some(unit) = machine.drives.get_mut(drive) {
                    let $new = &mut unit.$part;
                    $set
                }
            },
        )
    };
}

/// A number of each brushed motor.
macro_rules! motor {
    ($name:ident) => {
        of_drive!(motor, |motor| is_brushed(motor).then_some(motor.$name), |motor, value| {
            if is_brushed(motor) {
                motor.$name = value;
            }
        })
    };
    (play $name:ident) => {
        of_drive!(motor, |motor| motor.gear_play.map(|play| play.$name), |motor, value| {
            if let Some(play) = &mut motor.gear_play {
                play.$name = value;
            }
        })
    };
}

/// A number of each stepper: of its motor, or for steppers only.
macro_rules! stepper {
    ($name:ident) => {
        of_drive!(motor, |motor| motor.stepper.map(|stepper| stepper.$name), |motor, value| {
            if let Some(stepper) = &mut motor.stepper {
                stepper.$name = value;
            }
        })
    };
    (motor $name:ident) => {
        of_drive!(motor, |motor| motor.stepper.map(|_| motor.$name), |motor, value| {
            if motor.stepper.is_some() {
                motor.$name = value;
            }
        })
    };
}

/// A number of a drive that is given by force and drag.
macro_rules! of_simple {
    ($name:ident) => {
        Field::new(
            Of::Axis,
            |machine, _| simple(machine).map(|drive| drive.$name),
            |machine, _, value| set_simple(machine, |drive| drive.$name = value),
        )
    };
}

/// An optional number of each amplifier.
macro_rules! amplifier {
    ($name:ident) => {
        of_drive!(amplifier, |amplifier| amplifier.$name.filter(|_| is_amplifier(amplifier)), |amplifier, value| {
            if is_amplifier(amplifier) {
                amplifier.$name = amplifier.$name.map(|_| value)
            }
        })
    };
}

/// A number of each of several slides.
macro_rules! of_slide {
    (|$part:ident| $get:expr, |$new:ident, $value:ident| $set:expr) => {
        Field::new(
            Of::Slide,
            |machine, index| {
                let $part = machine.slide(index)?;
                $get
            },
            |machine, index, $value| {
                if let Some($new) = machine.slide_mut(index) {
                    $set
                }
            },
        )
    };
    (travel $name:ident) => {
        of_slide!(|slide| slide.travel.map(|travel| travel.$name), |slide, value| {
            if let Some(travel) = &mut slide.travel {
                travel.$name = value;
            }
        })
    };
    (stop $name:ident) => {
        of_slide!(|slide| slide.travel.and_then(|travel| travel.stop).map(|stop| stop.$name), |slide, value| {
            if let Some(stop) = slide.travel.as_mut().and_then(|travel| travel.stop.as_mut()) {
                stop.$name = value;
            }
        })
    };
}

/// A number of a body's friction: of the drive pulleys, of each of several slides (`bridge`), or of a body of an axis.
macro_rules! of_friction {
    (bridge, |$law:ident| $get:expr, |$new:ident, $value:ident| $set:expr) => {
        of_slide!(
            |slide| {
                let $law = &slide.friction;
                $get
            },
            |slide, $value| {
                let $new = &mut slide.friction;
                $set
            }
        )
    };
    (drive_pulley, $($how:tt)*) => {
        of_friction!(Machine drive_pulley, $($how)*)
    };
    ($body:ident, $($how:tt)*) => {
        of_friction!(Axis $body, $($how)*)
    };
    ($of:ident $body:ident, |$law:ident| $get:expr, |$new:ident, $value:ident| $set:expr) => {
        Field::new(
            Of::$of,
            |machine, _| {
                let $law = &machine.$body.friction;
                $get
            },
            |machine, _, $value| {
                let $new = &mut machine.$body.friction;
                $set
            },
        )
    };
}

/// A number of the friction law `$law`.
macro_rules! of_law {
    ($body:ident, $law:ident, $name:ident) => {
        of_friction!(
            $body,
            |friction| match friction.law {
                Law::$law { $name, .. } => Some($name),
                _ => None,
            },
            |friction, value| {
                if let Law::$law { $name, .. } = &mut friction.law {
                    *$name = value;
                }
            }
        )
    };
}

pub(super) use {always, amplifier, make, motor, of_drive, of_friction, of_law, of_simple, of_slide, part, stepper};

/// True if a motor has the numbers of `[motor]`.
pub(super) fn is_brushed(motor: &Motor) -> bool {
    !motor.is_simple && motor.stepper.is_none()
}

/// True if an amplifier has the numbers of `[amplifier]`; the driver of a stepper has its own.
pub(super) fn is_amplifier(amplifier: &Amplifier) -> bool {
    amplifier.mode != AmplifierMode::Position
}

/// Sets the rated current of a stepper and keeps its holding torque at that current.
pub(super) fn set_rated_current(motor: &mut Motor, value: f64) {
    let torque = motor.holding_torque();
    if let (Some(stepper), Some(torque)) = (&mut motor.stepper, torque) {
        stepper.rated_current = value;
        motor.set_holding_torque(torque);
    }
}

/// The drive of an axis given by force and drag, if any.
pub(super) fn simple(machine: &Machine) -> Option<SimpleDrive> {
    SimpleDrive::new(&machine.drives.first()?.motor, machine.pulley_radius)
}

/// Sets the radius; a drive given by its force keeps that force.
pub(super) fn set_radius(machine: &mut Machine, radius: f64) {
    let drive = simple(machine);
    machine.pulley_radius = radius;
    if let (Some(drive), Some(unit)) = (drive, machine.drives.first_mut()) {
        unit.motor = drive.motor(radius);
    }
}

pub(super) fn set_simple(machine: &mut Machine, change: impl FnOnce(&mut SimpleDrive)) {
    if let Some(mut drive) = simple(machine) {
        change(&mut drive);
        machine.drives[0].motor = drive.motor(machine.pulley_radius);
    }
}

/// The stiffness of a span, if given directly.
pub(super) fn stiffness(belt: &Belt, span: usize) -> Option<f64> {
    let stiffness = belt.stiffness.get(span).copied()?;
    let left_out = belt.model == BeltModel::Rigid && stiffness == f64::INFINITY;
    (belt.make.is_none() && !left_out).then_some(stiffness)
}

/// Sets Coulomb friction of one direction. A Stribeck curve keeps the excess of its breakaway.
pub(super) fn set_coulomb(friction: &mut Friction, forward: bool, coulomb: f64) {
    let law = friction.law;
    let side = if forward { &mut friction.forward } else { &mut friction.backward };
    if let Law::Stribeck { .. } = law {
        let force = side.breakaway - side.coulomb;
        side.breakaway = coulomb + force;
    }
    side.coulomb = coulomb;
}

/// The breakaway of one direction, unless it belongs to a Stribeck curve.
pub(super) fn breakaway(friction: &Friction, forward: bool) -> Option<f64> {
    let stribeck = matches!(friction.law, Law::Stribeck { .. });
    (!stribeck).then_some(friction.side(forward).breakaway)
}

/// Excess of the breakaway of a Stribeck curve over Coulomb friction.
pub(super) fn stribeck_force(friction: &Friction) -> Option<f64> {
    let stribeck = matches!(friction.law, Law::Stribeck { .. });
    stribeck.then_some(friction.forward.breakaway - friction.forward.coulomb)
}

pub(super) fn set_stribeck_force(friction: &mut Friction, force: f64) {
    for side in [&mut friction.forward, &mut friction.backward] {
        side.breakaway = side.coulomb + force;
    }
}

pub(super) fn stribeck_velocity(friction: &Friction) -> Option<f64> {
    match friction.law {
        Law::Stribeck { velocity, .. } => Some(velocity),
        _ => None,
    }
}

pub(super) fn set_stribeck_velocity(friction: &mut Friction, value: f64) {
    if let Law::Stribeck { velocity, .. } = &mut friction.law {
        *velocity = value;
    }
}

/// F_τ of eq. (14), which makes a gaussian curve.
pub(super) fn stribeck_decay(friction: &Friction) -> Option<f64> {
    match friction.law {
        Law::Stribeck { velocity, shape: Shape::Gaussian } => Some(decay_of_velocity(velocity)),
        _ => None,
    }
}

pub(super) fn set_stribeck_decay(friction: &mut Friction, decay: f64) {
    set_stribeck_velocity(friction, velocity_of_decay(decay));
}

/// A number of each point of a line of the cart, or of each slide: 0 for the argument, 1 for the value.
macro_rules! points {
    (slide $part:literal, |$slide:ident| $($line:tt)*) => {{
        const COUNT: fn(&Slide) -> usize = |$slide| $($line)*.as_ref().map_or(0, |line| line.points().len());
        Field::new(
            Of::SlidePoint(COUNT),
            |machine, index| {
                let (slide, point) = slide_point(machine, COUNT, index)?;
                let $slide = machine.slide(slide)?;
                $($line)*.as_ref()?.points().get(point).map(|point| point[$part])
            },
            |machine, index, value| {
                let Some((slide, point)) = slide_point(machine, COUNT, index) else { return };
                if let Some($slide) = machine.slide_mut(slide)
                    && let Some(line) = &mut $($line)*
                {
                    line.set(point, $part, value);
                }
            },
        )
    }};
    ($part:literal, |$machine:ident| $($line:tt)*) => {
        Field::new(
            Of::Point(|$machine| $($line)*.as_ref().map_or(0, |line| line.points().len())),
            |$machine, point| $($line)*.as_ref()?.points().get(point).map(|point| point[$part]),
            |$machine, point, value| {
                if let Some(line) = &mut $($line)* {
                    line.set(point, $part, value);
                }
            },
        )
    };
}
/// A slide of a machine with several, and the index of one of its points, by the index of the point among those of all.
pub(super) fn slide_point(machine: &Machine, count: fn(&Slide) -> usize, index: usize) -> Option<(usize, usize)> {
    let mut first = 0;
    machine.slides().map(count).enumerate().find_map(|(slide, points)| {
        let own = index.checked_sub(first).filter(|own| *own < points);
        first += points;
        own.map(|own| (slide, own))
    })
}
pub(super) use points;
