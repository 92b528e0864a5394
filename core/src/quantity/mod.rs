//! Quantities as an engineer types them: `"19.4 mm"` becomes 0.0194 m, with the dimension checked.
//!
//! This is the only place where units are converted. A quantity is a number and a unit expression:
//!
//! - numbers: `19.4`, `1.5e-3`, `5.5626×10^-6`, `2/3`; the decimal point is a point;
//! - units with SI prefixes: `mm`, `kN`, `µH`, `GPa`, and workshop units: `in`, `lbf`, `ozf`, `rpm`, `deg`, `psi`;
//! - products by a space, `*`, `·`, `.` or `-`; powers as `m^2`, `m²`, `m2` or `s^-1`;
//! - a `/` divides by the one factor that follows it, so `N m/rad/s` is N m rad⁻¹ s⁻¹; after a `/` a product must be in
//!   brackets: `V/(rad s)`. `V/rad s` is ambiguous between `V/(rad s)` and `V s/rad`, so it is rejected.
//!
//! Powers of ten are applied to the digits of the number itself: `"19.4 mm"` gives the same bits as the literal
//! `0.0194`.

mod cursor;
mod dimension;
mod numeral;
mod product;
mod units;

pub use dimension::Dimension;

use crate::error::{Error, Result};
use cursor::Cursor;
use numeral::Number;
use product::Product;
use std::f64::consts::PI;

/// Advice for a text that is not a quantity.
pub const SUCH_AS: &str = "write a number with its unit, such as \"19.4 mm\"";

/// A number with its unit, in SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// The value in SI units.
    pub value: f64,
    /// Its dimension.
    pub dimension: Dimension,
    /// The unit as typed; empty for a pure number.
    pub unit: String,
    /// Power of `Hz` in that unit: a frequency counts turns, an angular speed radians.
    pub hertz: i8,
}

/// Reads a quantity of any dimension.
///
/// ```
/// use taut::quantity::{parse, Dimension};
/// let inertia = parse("6.3e-5 kg·m²")?;
/// assert_eq!(inertia.value, 6.3e-5);
/// assert_eq!(inertia.dimension, Dimension::new(1, 2, 0, 0, 0));
/// # Ok::<(), taut::Error>(())
/// ```
pub fn parse(text: &str) -> Result<Quantity> {
    let mut cursor = Cursor::new(text)?;
    let number = cursor.number()?;
    let begin = cursor.position();
    let unit = cursor.product(0, false)?;
    cursor.end()?;
    let value = number.in_si(unit.factor, text)?;
    let typed = cursor.from(begin);
    Ok(Quantity { value, dimension: unit.dimension, unit: typed.trim().to_string(), hertz: unit.hertz })
}

/// Reads a quantity in `unit` or a convertible unit; the result is in SI.
///
/// Radians may be omitted, as usual: `N m s` is accepted for `N m s/rad`. Turns and radians are distinguished: 5 Hz is
/// not accepted as an angular speed, nor 31.4 rad/s as a frequency.
///
/// ```
/// use taut::quantity::read;
/// assert_eq!(read("19.4 mm", "m")?, 0.0194);
/// let error = read("0.362 kg", "m").unwrap_err();
/// assert_eq!(error.what, "\"0.362 kg\" is a mass (kg); expected a length (m)");
/// # Ok::<(), taut::Error>(())
/// ```
pub fn read(text: &str, unit: &str) -> Result<f64> {
    let given = parse(text)?;
    let wanted = parse_unit(unit)?;
    let text = text.trim();
    let (is, want) = (given.dimension, wanted.dimension);
    if is.without_angle() == want.without_angle() {
        if wanted.hertz == 1 && is.angle == 1 {
            return Err(Error::new(format!("\"{text}\" is an angular speed; expected a frequency (Hz)"))
                .next(format!("{text} is {} Hz", rounded(given.value / (2.0 * PI)))));
        }
        if given.hertz != 0 && want.angle != 0 {
            let error = Error::new(format!("\"{text}\" is given in hertz; expected {}", expected(want)));
            return Err(match (given.hertz, want.angle) {
                (1, 1) => error.next(format!("{text} is {} rad/s", rounded(given.value * 2.0 * PI))),
                _ => error.next("give it per rad/s or per rpm, so that turns and radians are distinct"),
            });
        }
        if given.unit.is_empty() && want != Dimension::NONE {
            return Err(Error::new(format!("\"{text}\" has no unit; expected {}", expected(want)))
                .next("add the unit, such as deg, rad or rev"));
        }
        if is.angle == want.angle || is.angle == 0 {
            return Ok(given.value);
        }
    }
    if given.unit.is_empty() {
        return Err(Error::new(format!("\"{text}\" has no unit; expected {}", expected(want)))
            .next("add the unit, or leave the quotes away if the number is in SI units"));
    }
    let error = Error::new(format!("\"{text}\" is {}; expected {}", is.describe(), expected(want)));
    // Pounds and kilograms as forces: the dimension lacks exactly one acceleration.
    let as_force = is.times(Dimension::new(0, 1, -2, 0, 0), 1).map(Dimension::without_angle);
    if as_force == Some(want.without_angle()) {
        return Err(error.next("a weight as a force is lbf, ozf, kgf or gf; lb, oz, kg and g are masses"));
    }
    // Motors are sold by K_v in rpm/V, and modelled by K_e in V s/rad.
    let inverse = Dimension::NONE.times(is, -1).map(Dimension::without_angle);
    Err(match inverse == Some(want.without_angle()) && given.value != 0.0 {
        true => {
            error.next(format!("this is the inverse of the expected quantity: write {}", show(1.0 / given.value, unit)))
        }
        false => error,
    })
}

/// A dimension as the object of "expected".
fn expected(want: Dimension) -> String {
    let words = want.describe();
    if words.starts_with("in ") { format!("a quantity {words}") } else { words }
}

/// An SI value in `unit`, as in `show(0.0194, "mm")`, which is `19.4 mm`; to six digits, for messages.
pub fn show(value: f64, unit: &str) -> String {
    match parse_unit(unit) {
        Ok(parsed) if !unit.is_empty() => {
            let scale = Number::ONE.in_si(parsed.factor, unit).unwrap_or(1.0);
            format!("{} {unit}", rounded(value / scale))
        }
        _ => rounded(value),
    }
}

/// An SI value as text that [`read`] converts back to the same bits; `unit` must be an SI unit without prefix.
pub fn write(value: f64, unit: &str) -> String {
    let number = shortest(value);
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}

/// Dimension of a unit expression, and its factor to SI.
pub fn conversion(unit: &str) -> Result<(Dimension, f64)> {
    let parsed = parse_unit(unit)?;
    Ok((parsed.dimension, Number::ONE.in_si(parsed.factor, unit)?))
}

/// A number with at most six significant digits, as short as possible.
pub fn rounded(value: f64) -> String {
    if !value.is_finite() {
        return value.to_string();
    }
    shortest(format!("{value:.5e}").parse().unwrap_or(value))
}

/// The shortest text that reads back to the same bits.
pub fn shortest(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 || (1e-4..1e7).contains(&magnitude) { format!("{value}") } else { format!("{value:e}") }
}

fn parse_unit(text: &str) -> Result<Product> {
    let mut cursor = Cursor::new(text)?;
    let unit = cursor.product(0, false)?;
    cursor.end()?;
    Ok(unit)
}
