//! Where a parameter sits in a machine, how it is read there and how it is set.

use crate::friction::{Friction, Law, Shape, decay_of_velocity, velocity_of_decay};
use crate::machine::gantry::{Gantry, Slide};
use crate::machine::{Belt, BeltModel, Machine, SimpleDrive};

/// Where a parameter sits in a machine of one kind: an axis, or a [`Gantry`].
#[derive(Debug)]
pub enum Field<M = Machine> {
    /// In no machine: it is a number of a run, a recorder, a controller, a method, or of a machine of the other kind.
    Elsewhere,
    /// In a machine.
    Machine(Accessor<M>),
    /// In a machine, where it is another form of the number with this key.
    Form(&'static str, Accessor<M>),
    /// The number with this key is computed from it and from others, and the machine keeps the result alone.
    PartOf(&'static str),
}

/// Reads and sets a number of a machine, or each of a list.
#[derive(Debug)]
pub struct Accessor<M = Machine> {
    /// How its elements are named.
    pub(super) list: List,
    /// How many it has.
    pub(super) count: fn(&M) -> usize,
    /// The value at a place in the list; none where the machine has no such part, or computes it from others.
    pub(super) get: fn(&M, usize) -> Option<f64>,
    /// Sets it, and what is computed from it; does nothing where the machine has no such part.
    pub(super) set: fn(&mut M, usize, f64),
}

// By hand, as a derived one would ask the same of the machine.
impl<M> Clone for Accessor<M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M> Copy for Accessor<M> {}

impl<M> Clone for Field<M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M> Copy for Field<M> {}

/// How the elements of a parameter are named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum List {
    /// It is a single number.
    None,
    /// `belt.stiffness.0`
    Numbers,
    /// `cart.friction.along.0.factor`: a list of points.
    Points,
    /// `left_drive.motor.resistance`, `right_drive.motor.resistance`: one of each drive. `motor.resistance` is both.
    Drives,
    /// `bridge.mass`, `cart.mass`: one of each thing that slides, with the key of the bridge's in the table.
    Slides,
}

/// The drives of a gantry in keys, before the key of an axis.
pub(super) const DRIVES: [&str; 2] = ["left_drive.", "right_drive."];

/// The sliding bodies of a gantry, as keys begin.
pub(super) const SLIDES: [&str; 2] = ["bridge.", "cart."];

impl List {
    /// The key of an element, as `--set` names it, of the parameter with this key.
    pub(super) fn key(self, key: &str, index: usize) -> String {
        match self {
            List::None => key.to_string(),
            List::Numbers => format!("{key}.{index}"),
            List::Points => match key.rsplit_once('.') {
                Some((points, name)) => format!("{points}.{index}.{name}"),
                None => key.to_string(),
            },
            List::Drives => format!("{}{key}", DRIVES.get(index).copied().unwrap_or_default()),
            List::Slides => match (SLIDES.get(index), key.strip_prefix(SLIDES[0])) {
                (Some(slide), Some(rest)) => format!("{slide}{rest}"),
                _ => key.to_string(),
            },
        }
    }

    /// Whether the parameter's own key names all elements together.
    pub(super) fn has_whole(self) -> bool {
        self != List::Slides
    }
}

impl<M> Accessor<M> {
    const fn new(
        list: List,
        count: fn(&M) -> usize,
        get: fn(&M, usize) -> Option<f64>,
        set: fn(&mut M, usize, f64),
    ) -> Self {
        Self { list, count, get, set }
    }
}

impl<M> Field<M> {
    /// A number that a machine may have.
    pub(super) const fn number(get: fn(&M, usize) -> Option<f64>, set: fn(&mut M, usize, f64)) -> Self {
        Self::Machine(Accessor::new(List::None, |_| 1, get, set))
    }

    /// Another form of the number with the key `of`.
    const fn form(self, of: &'static str) -> Self {
        match self {
            Self::Machine(accessor) | Self::Form(_, accessor) => Self::Form(of, accessor),
            Self::Elsewhere => Self::Elsewhere,
            Self::PartOf(whole) => Self::PartOf(whole),
        }
    }

    /// How a machine's number is read and set.
    pub(super) fn accessor(&self) -> Option<&Accessor<M>> {
        match self {
            Self::Machine(accessor) | Self::Form(_, accessor) => Some(accessor),
            Self::Elsewhere | Self::PartOf(_) => None,
        }
    }
}

impl Field {
    /// A number of each span.
    pub(super) const fn spans(get: fn(&Machine, usize) -> Option<f64>, set: fn(&mut Machine, usize, f64)) -> Self {
        Self::Machine(Accessor::new(List::Numbers, |_| 3, get, set))
    }

    /// A number of each point of a line.
    pub(super) const fn points(
        count: fn(&Machine) -> usize,
        get: fn(&Machine, usize) -> Option<f64>,
        set: fn(&mut Machine, usize, f64),
    ) -> Self {
        Self::Machine(Accessor::new(List::Points, count, get, set))
    }
}

impl Field<Gantry> {
    /// A number of each span.
    pub(super) const fn gantry_spans(get: fn(&Gantry, usize) -> Option<f64>, set: fn(&mut Gantry, usize, f64)) -> Self {
        Self::Machine(Accessor::new(List::Numbers, |gantry| gantry.belts.stiffness.len(), get, set))
    }

    /// A number of each drive.
    pub(super) const fn drives(get: fn(&Gantry, usize) -> Option<f64>, set: fn(&mut Gantry, usize, f64)) -> Self {
        Self::Machine(Accessor::new(List::Drives, |_| 2, get, set))
    }

    /// A number of bridge and cart.
    pub(super) const fn slides(get: fn(&Gantry, usize) -> Option<f64>, set: fn(&mut Gantry, usize, f64)) -> Self {
        Self::Machine(Accessor::new(List::Slides, |_| 2, get, set))
    }
}

/// Where a parameter sits in machines of either kind.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub axis: Field,
    pub gantry: Field<Gantry>,
}

impl Place {
    /// In an axis alone.
    pub const fn axis(axis: Field) -> Self {
        Self { axis, gantry: Field::Elsewhere }
    }

    /// In a gantry alone.
    pub const fn gantry(gantry: Field<Gantry>) -> Self {
        Self { axis: Field::Elsewhere, gantry }
    }

    /// Another form of the number with the key `of`.
    pub const fn form(self, of: &'static str) -> Self {
        Self { axis: self.axis.form(of), gantry: self.gantry.form(of) }
    }

    /// The same in an axis alone.
    pub const fn part_of_axis(whole: &'static str) -> Self {
        Self::axis(Field::PartOf(whole))
    }

    /// In neither: the number with the key `whole` is computed from it.
    pub const fn part_of(whole: &'static str) -> Self {
        Self { axis: Field::PartOf(whole), gantry: Field::PartOf(whole) }
    }
}

/// The thing that slides with this number: 0 for the bridge, 1 for the cart.
pub(super) fn slide(gantry: &Gantry, index: usize) -> &Slide {
    if index == 0 { &gantry.bridge } else { &gantry.cart }
}

pub(super) fn slide_mut(gantry: &mut Gantry, index: usize) -> &mut Slide {
    if index == 0 { &mut gantry.bridge } else { &mut gantry.cart }
}

/// A number that every axis has.
macro_rules! always {
    (|$machine:ident| $($place:tt)*) => {
        Place::axis(Field::number(|$machine, _| Some($($place)*), |$machine, _, value| $($place)* = value))
    };
}

/// A number that every axis and every gantry has, in the same place.
macro_rules! everywhere {
    (|$machine:ident| $($place:tt)*) => {
        Place {
            gantry: Field::number(|$machine, _| Some($($place)*), |$machine, _, value| $($place)* = value),
            ..always!(|$machine| $($place)*)
        }
    };
}

/// A number of a part that stands in an `Option`.
macro_rules! part {
    (both |$machine:ident| $part:expr, $reach:expr => $name:ident) => {
        Place {
            axis: part!(field |$machine| $part, $reach => $name),
            gantry: part!(field |$machine| $part, $reach => $name),
        }
    };
    (field |$machine:ident| $part:expr, $reach:expr => $name:ident) => {
        Field::number(
            |$machine, _| $part.map(|part| part.$name),
            |$machine, _, value| {
                if let Some(part) = $reach {
                    part.$name = value;
                }
            },
        )
    };
    (|$machine:ident| $part:expr, $reach:expr => $name:ident) => {
        Place::axis(part!(field |$machine| $part, $reach => $name))
    };
}

/// A number of the belt's make, from which its stiffness is computed.
macro_rules! make {
    (material, |$make:ident| $($place:tt)*) => {
        Place {
            axis: Field::number(
                |stage, _| stage.belt.make.filter(|_| !stage.belt.sheet.is_specific).map(|$make| $($place)*),
                |stage, _, value| {
                    if let Some($make) = stage.belt.make.as_mut().filter(|_| !stage.belt.sheet.is_specific) {
                        $($place)* = value;
                        // k = A E / l                                                      (11)
                        stage.belt.stiffness = $make.stiffness();
                    }
                },
            ),
            gantry: Field::number(
                |gantry, _| {
                    gantry.belts.make.as_ref().filter(|_| !gantry.belts.sheet.is_specific).map(|$make| $($place)*)
                },
                |gantry, _, value| {
                    if let Some($make) = gantry.belts.make.as_mut().filter(|_| !gantry.belts.sheet.is_specific) {
                        $($place)* = value;
                        gantry.belts.follow_make();
                    }
                },
            ),
        }
    };
    (specific) => {
        Place {
            axis: Field::number(
                |stage, _| stage.belt.make.filter(|_| stage.belt.sheet.is_specific).map(|make| make.modulus),
                |stage, _, value| {
                    if let Some(make) = stage.belt.make.as_mut().filter(|_| stage.belt.sheet.is_specific) {
                        make.modulus = value;
                        stage.belt.stiffness = make.stiffness();
                    }
                },
            ),
            gantry: Field::number(
                |gantry, _| {
                    gantry.belts.make.as_ref().filter(|_| gantry.belts.sheet.is_specific).map(|make| make.modulus)
                },
                |gantry, _, value| {
                    if let Some(make) = gantry.belts.make.as_mut().filter(|_| gantry.belts.sheet.is_specific) {
                        make.modulus = value;
                        gantry.belts.follow_make();
                    }
                },
            ),
        }
    };
    (spans, |$make:ident, $span:pat_param| $($place:tt)*) => {
        Place {
            axis: make!(axis spans, |$make, $span| $($place)*),
            gantry: make!(gantry gantry_spans, |$make, $span| $($place)*),
        }
    };
    (axis $constructor:ident, |$make:ident, $span:pat_param| $($place:tt)*) => {
        Field::$constructor(
            |stage, $span| stage.belt.make.map(|$make| $($place)*),
            |stage, $span, value| {
                if let Some($make) = &mut stage.belt.make {
                    $($place)* = value;
                    // k = A E / l                                                      (11)
                    stage.belt.stiffness = $make.stiffness();
                }
            },
        )
    };
    (gantry $constructor:ident, |$make:ident, $span:pat_param| $($place:tt)*) => {
        Field::$constructor(
            |gantry, $span| gantry.belts.make.as_ref().map(|$make| $($place)*),
            |gantry, $span, value| {
                if let Some($make) = &mut gantry.belts.make {
                    $($place)* = value;
                    gantry.belts.follow_make();
                }
            },
        )
    };
}

/// A number of the motor or the amplifier, of which a gantry has two.
macro_rules! of_drive {
    ($one:ident, $each:ident, |$part:ident| $get:expr, |$new:ident, $value:ident| $set:expr) => {
        Place {
            axis: Field::number(
                |stage, _| {
                    let $part = &stage.$one;
                    $get
                },
                |stage, _, $value| {
                    let $new = &mut stage.$one;
                    $set
                },
            ),
            gantry: Field::drives(
                |gantry, drive| {
                    let $part = gantry.$each.get(drive)?;
                    $get
                },
                |gantry, drive, $value| {
                    if let Some($new) = gantry.$each.get_mut(drive) {
                        $set
                    }
                },
            ),
        }
    };
}

/// A number of the motor.
macro_rules! motor {
    ($name:ident) => {
        of_drive!(motor, motors, |motor| (!motor.is_simple).then_some(motor.$name), |motor, value| {
            if !motor.is_simple {
                motor.$name = value;
            }
        })
    };
    (play $name:ident) => {
        of_drive!(motor, motors, |motor| motor.gear_play.map(|play| play.$name), |motor, value| {
            if let Some(play) = &mut motor.gear_play {
                play.$name = value;
            }
        })
    };
}

/// A number of a drive that is given by force and drag.
macro_rules! of_simple {
    ($name:ident) => {
        Place::axis(Field::number(
            |stage, _| simple(stage).map(|drive| drive.$name),
            |stage, _, value| set_simple(stage, |drive| drive.$name = value),
        ))
    };
}

/// A number of the amplifier that it need not have.
macro_rules! amplifier {
    ($name:ident) => {
        of_drive!(amplifier, amplifiers, |amplifier| amplifier.$name, |amplifier, value| {
            amplifier.$name = amplifier.$name.map(|_| value)
        })
    };
}

/// A number of what slides in a gantry.
macro_rules! of_slide {
    (|$part:ident| $get:expr, |$new:ident, $value:ident| $set:expr) => {
        Place::gantry(Field::slides(
            |gantry, index| {
                let $part = slide(gantry, index);
                $get
            },
            |gantry, index, $value| {
                let $new = slide_mut(gantry, index);
                $set
            },
        ))
    };
}

/// A number of a body's friction: of the drive pulley in both kinds of machine, of what slides in a gantry, or of
/// another body of an axis.
macro_rules! of_friction {
    (field $body:ident, |$law:ident| $get:expr, |$new:ident, $value:ident| $set:expr) => {
        Field::number(
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
    (drive_pulley, $($how:tt)*) => {
        Place { axis: of_friction!(field drive_pulley, $($how)*), gantry: of_friction!(field drive_pulley, $($how)*) }
    };
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
    ($body:ident, $($how:tt)*) => {
        Place::axis(of_friction!(field $body, $($how)*))
    };
}

/// A number of the friction law that `$law` stands for.
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

pub(super) use {always, amplifier, everywhere, make, motor, of_drive, of_friction, of_law, of_simple, of_slide, part};

/// The drive that is given by force and drag, if it is.
pub(super) fn simple(stage: &Machine) -> Option<SimpleDrive> {
    SimpleDrive::of(&stage.motor, stage.pulley_radius)
}

/// Sets the radius; a drive that is given by its force keeps it.
pub(super) fn set_radius(stage: &mut Machine, radius: f64) {
    let drive = simple(stage);
    stage.pulley_radius = radius;
    if let Some(drive) = drive {
        stage.motor = drive.motor(radius);
    }
}

pub(super) fn set_simple(stage: &mut Machine, change: impl FnOnce(&mut SimpleDrive)) {
    if let Some(mut drive) = simple(stage) {
        change(&mut drive);
        stage.motor = drive.motor(stage.pulley_radius);
    }
}

/// The stiffness of a span, where it is given as such.
pub(super) fn stiffness(belt: &Belt, span: usize) -> Option<f64> {
    let stiffness = belt.stiffness.get(span).copied()?;
    let left_out = belt.model == BeltModel::Rigid && stiffness == f64::INFINITY;
    (belt.make.is_none() && !left_out).then_some(stiffness)
}

/// Sets Coulomb friction of one direction. Of a Stribeck curve the force is kept, by which the breakaway exceeds it.
pub(super) fn set_coulomb(friction: &mut Friction, forward: bool, coulomb: f64) {
    let law = friction.law;
    let side = if forward { &mut friction.forward } else { &mut friction.backward };
    if let Law::Stribeck { .. } = law {
        let force = side.breakaway - side.coulomb;
        side.breakaway = coulomb + force;
    }
    side.coulomb = coulomb;
}

/// The breakaway of one direction, where it is not that of a Stribeck curve.
pub(super) fn breakaway(friction: &Friction, forward: bool) -> Option<f64> {
    let stribeck = matches!(friction.law, Law::Stribeck { .. });
    (!stribeck).then_some(friction.side(forward).breakaway)
}

/// By how much the breakaway of a Stribeck curve exceeds Coulomb friction.
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

/// A number of each point of a line of the cart: 0 for what it is over, 1 for the value.
macro_rules! points {
    ($part:literal, |$stage:ident| $($line:tt)*) => {
        Place::axis(Field::points(
            |$stage| $($line)*.as_ref().map_or(0, |line| line.points().len()),
            |$stage, point| $($line)*.as_ref()?.points().get(point).map(|point| point[$part]),
            |$stage, point, value| {
                if let Some(line) = &mut $($line)* {
                    line.set(point, $part, value);
                }
            },
        ))
    };
}
pub(super) use points;
