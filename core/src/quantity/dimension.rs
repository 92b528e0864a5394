//! Dimensions: exponents of kilogram, metre, second, ampere and angle, with common names.

use std::fmt;

/// The dimension of a quantity, whatever unit it is given in.
///
/// The angle is kept as a fifth dimension, so that `deg` and `rev` convert and `rpm` differs from `Hz`; see
/// [`read`](super::read) for cases in which it may be omitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Dimension {
    /// Exponent of the kilogram.
    pub mass: i8,
    /// Exponent of the metre.
    pub length: i8,
    /// Exponent of the second.
    pub time: i8,
    /// Exponent of the ampere.
    pub current: i8,
    /// Exponent of the radian.
    pub angle: i8,
}

/// Largest exponent in a dimension: more than physics needs, less than would overflow.
const LARGEST_EXPONENT: i8 = 30;

impl Dimension {
    /// A pure number.
    pub const NONE: Self = Self::new(0, 0, 0, 0, 0);

    /// From the exponents of kg, m, s, A and rad.
    pub const fn new(mass: i8, length: i8, time: i8, current: i8, angle: i8) -> Self {
        Self { mass, length, time, current, angle }
    }

    /// `self` · `other`ⁿ, or none if an exponent becomes too large.
    pub fn times(self, other: Self, n: i8) -> Option<Self> {
        let add = |a: i8, b: i8| {
            let sum = a.checked_add(b.checked_mul(n)?)?;
            (sum.abs() <= LARGEST_EXPONENT).then_some(sum)
        };
        Some(Self {
            mass: add(self.mass, other.mass)?,
            length: add(self.length, other.length)?,
            time: add(self.time, other.time)?,
            current: add(self.current, other.current)?,
            angle: add(self.angle, other.angle)?,
        })
    }

    /// The dimension without its angle.
    pub fn without_angle(self) -> Self {
        Self { angle: 0, ..self }
    }

    /// Its name in messages, with its unit: `a mass (kg)`.
    pub fn describe(self) -> String {
        let exact = NAMES.iter().find(|(d, ..)| *d == self);
        let name = exact.or_else(|| NAMES.iter().find(|(d, ..)| d.without_angle() == self && self != Self::NONE));
        match name {
            Some((_, name, "")) => (*name).to_string(),
            Some((_, name, unit)) => format!("{name} ({unit})"),
            None => format!("in {self}"),
        }
    }
}

impl fmt::Display for Dimension {
    /// As a product of base units: `kg m^2/s^2` is `kg m^2 s^-2`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [("kg", self.mass), ("m", self.length), ("s", self.time), ("A", self.current), ("rad", self.angle)];
        let mut first = true;
        for (unit, power) in parts.into_iter().filter(|&(_, power)| power != 0) {
            if !first {
                write!(f, " ")?;
            }
            first = false;
            match power {
                1 => write!(f, "{unit}")?,
                _ => write!(f, "{unit}^{power}")?,
            }
        }
        if first { write!(f, "1") } else { Ok(()) }
    }
}

/// Dimensions with common names, and the unit quoted beside each.
const NAMES: &[(Dimension, &str, &str)] = &[
    (Dimension::NONE, "a pure number", ""),
    (Dimension::new(1, 0, 0, 0, 0), "a mass", "kg"),
    (Dimension::new(0, 1, 0, 0, 0), "a length", "m"),
    (Dimension::new(0, 0, 1, 0, 0), "a time", "s"),
    (Dimension::new(0, 0, 0, 1, 0), "a current", "A"),
    (Dimension::new(0, 0, 0, 0, 1), "an angle", "rad"),
    (Dimension::new(0, 0, -1, 0, 0), "a frequency", "Hz"),
    (Dimension::new(0, 0, -1, 0, 1), "an angular speed", "rad/s"),
    (Dimension::new(0, 0, -2, 0, 1), "an angular acceleration", "rad/s^2"),
    (Dimension::new(0, 1, -1, 0, 0), "a speed", "m/s"),
    (Dimension::new(0, 1, -2, 0, 0), "an acceleration", "m/s^2"),
    (Dimension::new(0, 1, -3, 0, 0), "a jerk", "m/s^3"),
    (Dimension::new(0, 2, 0, 0, 0), "an area", "m^2"),
    (Dimension::new(0, 3, 0, 0, 0), "a volume", "m^3"),
    (Dimension::new(0, -1, 0, 0, 0), "a number per length", "1/m"),
    (Dimension::new(0, 0, 0, 0, -1), "a number per angle", "1/rad"),
    (Dimension::new(0, 1, 0, 0, -1), "a travel per angle", "m/rad"),
    (Dimension::new(1, -3, 0, 0, 0), "a density", "kg/m^3"),
    (Dimension::new(1, -1, 0, 0, 0), "a mass per length", "kg/m"),
    (Dimension::new(1, 2, 0, 0, 0), "a moment of inertia", "kg m^2"),
    (Dimension::new(1, 1, 0, 0, 0), "a mass times a length", "kg m"),
    (Dimension::new(1, 1, -2, 0, 0), "a force", "N"),
    (Dimension::new(1, 2, -2, 0, 0), "a torque", "N m"),
    (Dimension::new(1, 2, -2, 0, -1), "a torsional stiffness", "N m/rad"),
    (Dimension::new(1, 2, -3, 0, 0), "a power", "W"),
    (Dimension::new(1, 0, -2, 0, 0), "a stiffness", "N/m"),
    (Dimension::new(1, -1, -2, 0, 0), "a pressure or a modulus", "Pa"),
    (Dimension::new(1, 0, -1, 0, 0), "viscous friction of something that slides", "N s/m"),
    (Dimension::new(1, 2, -1, 0, -1), "viscous friction of something that turns", "N m s/rad"),
    (Dimension::new(1, 1, -1, 0, 0), "a momentum", "N s"),
    (Dimension::new(1, 2, -3, -1, 0), "a voltage", "V"),
    (Dimension::new(1, 2, -3, -2, 0), "a resistance", "ohm"),
    (Dimension::new(1, 2, -2, -2, 0), "an inductance", "H"),
    (Dimension::new(1, 2, -2, -1, 0), "a torque constant", "N m/A"),
    (Dimension::new(1, 2, -2, -1, -1), "a back-EMF constant", "V s/rad"),
    (Dimension::new(-1, -2, 2, 1, 1), "a speed per voltage", "rad/s/V"),
    (Dimension::new(0, 0, 1, 1, 0), "a charge", "A s"),
];
