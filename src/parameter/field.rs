//! Where a parameter sits in a machine, how it is read there and how it is set.

use crate::friction::{Friction, Law, Shape, decay_of_velocity, velocity_of_decay};
use crate::stage::{Belt, BeltModel, Stage};

/// Where a parameter sits.
#[derive(Debug, Clone, Copy)]
pub enum Field {
    /// In no machine: it is a number of a run, a recorder, a controller or a method.
    Elsewhere,
    /// In a machine.
    Machine(Accessor),
    /// In a machine, where it is another form of the number with this key.
    Form(&'static str, Accessor),
    /// The number with this key is computed from it and from others, and the machine keeps the result alone.
    PartOf(&'static str),
}

/// Reads and sets a number of a machine, or each of a list.
#[derive(Debug, Clone, Copy)]
pub struct Accessor {
    /// How its elements are named.
    pub(super) list: List,
    /// How many it has.
    pub(super) count: fn(&Stage) -> usize,
    /// The value at a place in the list; none where the machine has no such part, or computes it from others.
    pub(super) get: fn(&Stage, usize) -> Option<f64>,
    /// Sets it, and what is computed from it; does nothing where the machine has no such part.
    pub(super) set: fn(&mut Stage, usize, f64),
}

/// How the elements of a parameter are named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum List {
    /// It is a single number.
    None,
    /// `belt.stiffness.0`
    Numbers,
    /// `cart.friction.along.0.factor`: a list of points.
    Points,
}

impl Accessor {
    const fn number(get: fn(&Stage, usize) -> Option<f64>, set: fn(&mut Stage, usize, f64)) -> Self {
        Self { list: List::None, count: |_| 1, get, set }
    }
}

impl Field {
    /// A number that a machine may have.
    pub(super) const fn number(get: fn(&Stage, usize) -> Option<f64>, set: fn(&mut Stage, usize, f64)) -> Self {
        Self::Machine(Accessor::number(get, set))
    }

    /// Another form of the number with the key `of`.
    pub(super) const fn form(
        of: &'static str,
        get: fn(&Stage, usize) -> Option<f64>,
        set: fn(&mut Stage, usize, f64),
    ) -> Self {
        Self::Form(of, Accessor::number(get, set))
    }

    /// A number of each span.
    pub(super) const fn spans(get: fn(&Stage, usize) -> Option<f64>, set: fn(&mut Stage, usize, f64)) -> Self {
        Self::Machine(Accessor { list: List::Numbers, count: |_| 3, get, set })
    }

    /// A number of each point of the cart's friction along the travel: the first or the second.
    pub(super) const fn points(get: fn(&Stage, usize) -> Option<f64>, set: fn(&mut Stage, usize, f64)) -> Self {
        let count = |stage: &Stage| stage.cart.along.as_ref().map_or(0, |along| along.points().len());
        Self::Machine(Accessor { list: List::Points, count, get, set })
    }

    /// How a machine's number is read and set.
    pub(super) fn accessor(&self) -> Option<&Accessor> {
        match self {
            Self::Machine(accessor) | Self::Form(_, accessor) => Some(accessor),
            Self::Elsewhere | Self::PartOf(_) => None,
        }
    }
}

/// A number that every machine has.
macro_rules! always {
    (|$stage:ident| $($place:tt)*) => {
        Field::number(|$stage, _| Some($($place)*), |$stage, _, value| $($place)* = value)
    };
}

/// A number that stands in an `Option`.
macro_rules! optional {
    (|$stage:ident| $($place:tt)*) => {
        Field::number(|$stage, _| $($place)*, |$stage, _, value| $($place)* = $($place)*.map(|_| value))
    };
}

/// A number of a part that stands in an `Option`.
macro_rules! part {
    (|$stage:ident| $part:expr, $reach:expr => $name:ident) => {
        Field::number(
            |$stage, _| $part.map(|part| part.$name),
            |$stage, _, value| {
                if let Some(part) = $reach {
                    part.$name = value;
                }
            },
        )
    };
}

/// A number of the belt's make, from which its stiffness is computed.
macro_rules! make {
    ($constructor:ident, |$make:ident, $span:pat_param| $($place:tt)*) => {
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
}

pub(super) use {always, make, optional, part};

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

/// A number of the friction law that `$law` stands for.
macro_rules! of_law {
    ($body:ident, $law:ident, $name:ident) => {
        Field::number(
            |stage, _| match stage.$body.friction.law {
                Law::$law { $name, .. } => Some($name),
                _ => None,
            },
            |stage, _, value| {
                if let Law::$law { $name, .. } = &mut stage.$body.friction.law {
                    *$name = value;
                }
            },
        )
    };
}

pub(super) use of_law;

/// A number of a point of the cart's friction along the travel: 0 for the position, 1 for the factor.
pub(super) fn of_point(stage: &Stage, point: usize, part: usize) -> Option<f64> {
    stage.cart.along.as_ref()?.points().get(point).map(|point| point[part])
}

pub(super) fn set_of_point(stage: &mut Stage, point: usize, part: usize, value: f64) {
    if let Some(along) = &mut stage.cart.along {
        along.set(point, part, value);
    }
}
