//! Known units and prefixes with exact factors.

use super::Dimension;

/// A factor to SI, kept exact: numerator / denominator · 10^exponent · π^pi · rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Factor {
    pub numerator: u128,
    pub denominator: u128,
    pub exponent: i32,
    pub pi: i32,
    /// Remaining factor that does not fit the integers; 1 for all common units.
    pub rest: f64,
}

impl Factor {
    pub const ONE: Self = Self::decimal(1, 0);

    const fn decimal(numerator: u128, exponent: i32) -> Self {
        Self { numerator, denominator: 1, exponent, pi: 0, rest: 1.0 }
    }

    const fn ratio(numerator: u128, denominator: u128, pi: i32) -> Self {
        Self { numerator, denominator, exponent: 0, pi, rest: 1.0 }
    }

    fn inverse(self) -> Self {
        Self {
            numerator: self.denominator,
            denominator: self.numerator,
            exponent: -self.exponent,
            pi: -self.pi,
            rest: 1.0 / self.rest,
        }
    }

    /// `self` · `other`ⁿ.
    pub fn times(self, other: Self, n: i8) -> Self {
        let other = if n < 0 { other.inverse() } else { other };
        let mut product = self;
        for _ in 0..n.unsigned_abs() {
            match product.numerator.checked_mul(other.numerator) {
                Some(numerator) => product.numerator = numerator,
                None => product.rest *= other.numerator as f64,
            }
            match product.denominator.checked_mul(other.denominator) {
                Some(denominator) => product.denominator = denominator,
                None => product.rest /= other.denominator as f64,
            }
            product.exponent = product.exponent.saturating_add(other.exponent);
            product.pi = product.pi.saturating_add(other.pi);
            product.rest *= other.rest;
        }
        product.reduced()
    }

    /// In lowest terms, with twos and fives of the denominator turned into powers of ten.
    pub fn reduced(mut self) -> Self {
        let (mut a, mut b) = (self.numerator, self.denominator);
        while b != 0 {
            (a, b) = (b, a % b);
        }
        if a > 1 {
            self.numerator /= a;
            self.denominator /= a;
        }
        for (prime, other) in [(2, 5), (5, 2)] {
            while self.denominator.is_multiple_of(prime) {
                let Some(numerator) = self.numerator.checked_mul(other) else { break };
                self.numerator = numerator;
                self.denominator /= prime;
                self.exponent = self.exponent.saturating_sub(1);
            }
        }
        self
    }
}

/// A unit with all its spellings, the preferred one first.
pub(super) struct Unit {
    pub names: &'static [&'static str],
    pub dimension: Dimension,
    pub factor: Factor,
    /// True if SI prefixes are allowed.
    pub prefixes: bool,
}

const fn unit(names: &'static [&'static str], dimension: Dimension, factor: Factor, prefixes: bool) -> Unit {
    Unit { names, dimension, factor, prefixes }
}

use Dimension as D;
use Factor as F;

const FORCE: Dimension = D::new(1, 1, -2, 0, 0);
const TORQUE: Dimension = D::new(1, 2, -2, 0, 0);
const PRESSURE: Dimension = D::new(1, -1, -2, 0, 0);
const LENGTH: Dimension = D::new(0, 1, 0, 0, 0);
const MASS: Dimension = D::new(1, 0, 0, 0, 0);
const TIME: Dimension = D::new(0, 0, 1, 0, 0);
const ANGLE: Dimension = D::new(0, 0, 0, 0, 1);
const ANGULAR_SPEED: Dimension = D::new(0, 0, -1, 0, 1);

/// Every unit. Pound, inch and standard gravity by their definitions.
pub(super) const UNITS: &[Unit] = &[
    unit(&["m", "metre", "meter", "metres", "meters"], LENGTH, F::ONE, true),
    unit(&["g", "gram", "grams"], MASS, F::decimal(1, -3), true),
    unit(&["s", "sec", "second", "seconds"], TIME, F::ONE, true),
    unit(&["A", "amp", "amps", "ampere", "amperes"], D::new(0, 0, 0, 1, 0), F::ONE, true),
    unit(&["N", "newton", "newtons"], FORCE, F::ONE, true),
    unit(&["V", "volt", "volts"], D::new(1, 2, -3, -1, 0), F::ONE, true),
    unit(&["W", "watt", "watts"], D::new(1, 2, -3, 0, 0), F::ONE, true),
    unit(&["J", "joule", "joules"], TORQUE, F::ONE, true),
    unit(&["H", "henry"], D::new(1, 2, -2, -2, 0), F::ONE, true),
    unit(&["ohm", "Ohm", "ohms", "Ω", "\u{2126}"], D::new(1, 2, -3, -2, 0), F::ONE, true),
    unit(&["Pa", "pascal"], PRESSURE, F::ONE, true),
    unit(&["bar"], PRESSURE, F::decimal(1, 5), true),
    unit(&["Hz", "hertz"], D::new(0, 0, -1, 0, 0), F::ONE, true),
    unit(&["rad", "radian", "radians"], ANGLE, F::ONE, true),
    unit(&["deg", "°", "degree", "degrees"], ANGLE, F::ratio(1, 180, 1), true),
    unit(&["rev", "turn", "revs", "turns"], ANGLE, F::ratio(2, 1, 1), false),
    unit(&["arcmin"], ANGLE, F::ratio(1, 180 * 60, 1), false),
    unit(&["arcsec"], ANGLE, F::ratio(1, 180 * 3600, 1), true),
    unit(&["rpm", "RPM"], ANGULAR_SPEED, F::ratio(2, 60, 1), true),
    unit(&["rps"], ANGULAR_SPEED, F::ratio(2, 1, 1), false),
    unit(&["min", "minute", "minutes"], TIME, F::decimal(60, 0), false),
    unit(&["h", "hour", "hours"], TIME, F::decimal(3600, 0), false),
    unit(&["t", "tonne", "tonnes"], MASS, F::decimal(1, 3), false),
    // Common combinations that count as units.
    unit(&["Nm"], TORQUE, F::ONE, true),
    unit(&["Ncm"], TORQUE, F::decimal(1, -2), false),
    unit(&["Nmm"], TORQUE, F::decimal(1, -3), false),
    unit(&["Ns"], D::new(1, 1, -1, 0, 0), F::ONE, false),
    unit(&["Vs"], D::new(1, 2, -2, -1, 0), F::ONE, true),
    // Inch and pound, and gravity's forces.
    unit(&["in", "inch", "inches", "\"", "″"], LENGTH, F::decimal(254, -4), false),
    unit(&["ft", "foot", "feet"], LENGTH, F::decimal(3048, -4), false),
    unit(&["mil", "thou", "mils"], LENGTH, F::decimal(254, -7), false),
    unit(&["micron", "microns"], LENGTH, F::decimal(1, -6), false),
    unit(&["lb", "lbs", "lbm"], MASS, F::decimal(45_359_237, -8), false),
    unit(&["oz"], MASS, F::decimal(28_349_523_125, -12), false),
    unit(&["kgf", "kp"], FORCE, F::decimal(980_665, -5), false),
    unit(&["gf"], FORCE, F::decimal(980_665, -8), false),
    unit(&["lbf"], FORCE, F::decimal(45_359_237 * 980_665, -13), false),
    unit(&["ozf"], FORCE, F::decimal(28_349_523_125 * 980_665, -17), false),
    // lbf / in² = 4.448… N / (2.54e-2 m)²
    unit(&["psi"], PRESSURE, Factor { denominator: 254 * 254, ..F::decimal(45_359_237 * 980_665, -5) }, true),
    unit(&["ksi"], PRESSURE, Factor { denominator: 254 * 254, ..F::decimal(45_359_237 * 980_665, -2) }, false),
    unit(&["%", "percent"], D::NONE, F::decimal(1, -2), false),
];

/// SI prefixes with their powers of ten, the most common first.
pub(super) const PREFIXES: &[(&str, i32)] = &[
    ("k", 3),
    ("m", -3),
    ("µ", -6),
    ("u", -6),
    ("c", -2),
    ("M", 6),
    ("G", 9),
    ("n", -9),
    ("\u{3bc}", -6),
    ("d", -1),
    ("da", 1),
    ("h", 2),
    ("T", 12),
    ("P", 15),
    ("E", 18),
    ("Z", 21),
    ("Y", 24),
    ("R", 27),
    ("Q", 30),
    ("p", -12),
    ("f", -15),
    ("a", -18),
    ("z", -21),
    ("y", -24),
    ("r", -27),
    ("q", -30),
];

/// Number of [`PREFIXES`] tried when a name is split into units.
const COMMON_PREFIXES: usize = 9;

/// The unit called `name`, with the power of ten of its prefix.
pub(super) fn find(name: &str) -> Option<(&'static Unit, i32)> {
    find_among(name, PREFIXES)
}

fn find_among(name: &str, prefixes: &[(&str, i32)]) -> Option<(&'static Unit, i32)> {
    if let Some(unit) = UNITS.iter().find(|u| u.names.contains(&name)) {
        return Some((unit, 0));
    }
    prefixes.iter().find_map(|&(prefix, power)| {
        let rest = name.strip_prefix(prefix)?;
        UNITS.iter().find(|u| u.prefixes && u.names.contains(&rest)).map(|u| (u, power))
    })
}

/// A unit that may have been meant by `name`.
pub(super) fn suggest(name: &str) -> Option<String> {
    const LONGEST: usize = 24;
    if name.chars().count() > LONGEST {
        return None;
    }
    let prefixed = PREFIXES.iter().flat_map(|(prefix, _)| {
        UNITS.iter().filter(|u| u.prefixes).flat_map(move |u| u.names.iter().map(move |name| format!("{prefix}{name}")))
    });
    let known = || UNITS.iter().flat_map(|u| u.names.iter().map(ToString::to_string)).chain(prefixed.clone());

    if let Some(same) = known().find(|k| k.to_lowercase() == name.to_lowercase()) {
        return Some(same);
    }
    let mut splits = Vec::new();
    split(name, &mut Vec::new(), &mut splits);
    splits.sort_by_key(|parts| parts.len());
    if !splits.is_empty() {
        let shown: Vec<String> = splits.iter().take(2).map(|parts| parts.join(" ")).collect();
        return Some(shown.join(", or "));
    }
    let allowed = if name.chars().count() <= 3 { 1 } else { 2 };
    known()
        .map(|k| (strsim::damerau_levenshtein(&k, name), k))
        .filter(|(distance, k)| *distance <= allowed && *distance < k.chars().count())
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, k)| k)
}

/// All splits of `name` into two to four units.
fn split<'a>(name: &'a str, before: &mut Vec<&'a str>, found: &mut Vec<Vec<&'a str>>) {
    const MOST_PARTS: usize = 4;
    if name.is_empty() {
        if before.len() > 1 {
            found.push(before.clone());
        }
        return;
    }
    if before.len() == MOST_PARTS {
        return;
    }
    for (end, _) in name.char_indices().skip(1).map(|(i, _)| (i, ())).chain([(name.len(), ())]) {
        let (part, rest) = name.split_at(end);
        if find_among(part, &PREFIXES[..COMMON_PREFIXES]).is_some() {
            before.push(part);
            split(rest, before, found);
            before.pop();
        }
    }
}
