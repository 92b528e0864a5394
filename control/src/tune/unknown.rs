//! Parameters of a machine that are not known exactly.

use crate::chance::normal_quantile;
use crate::machine::Machine;
use crate::number::engineering;
use crate::parameter::{Free, kinds_without};

/// Default relative spread of parameters.
pub const SPREAD: f64 = 0.2;

/// A parameter that is not known exactly.
#[derive(Debug, Clone)]
pub struct Unknown {
    /// Its name.
    pub name: String,
    /// Lower end: a factor if it was not fitted, a value in SI units if it was.
    pub low: f64,
    /// Upper end, likewise.
    pub high: f64,
    /// True if its interval is that of a fit or its draws, with a normal distribution; uniform within a spread.
    pub is_fitted: bool,
    pub(super) free: Free,
    /// The first unknown that it varies with: the two constants of one motor, both pulleys.
    pub(super) with: usize,
}

impl Unknown {
    /// A parameter with a relative spread to either side.
    pub fn spread(free: Free, share: f64) -> Self {
        let [low, high] = [1.0 - share, 1.0 + share].map(|factor| factor * free.start);
        Self { name: free.name.clone(), low, high, is_fitted: false, free, with: 0 }
    }

    /// A parameter with the interval of a fit.
    pub fn fitted(free: Free, [low, high]: [f64; 2]) -> Self {
        Self { name: free.name.clone(), low, high, is_fitted: true, free, with: 0 }
    }

    /// Its SI unit; empty for a factor.
    pub fn unit(&self) -> &'static str {
        self.free.unit
    }

    /// Its value: `low` at −1, `high` at 1, the nominal value at 0.
    pub(super) fn value(&self, off: f64) -> f64 {
        let end = if off < 0.0 { self.low } else { self.high };
        let value = self.free.start + off.abs() * (end - self.free.start);
        // Draws of a fit exceed the ends of its interval, but do not change sign.
        if self.free.start > 0.0 { value.max(1e-3 * self.free.start) } else { value }
    }

    /// Lowest and highest value with at most this part of its half-widths.
    pub fn within(&self, part: f64) -> [f64; 2] {
        [-part, part].map(|off| self.value(off))
    }

    /// Deviation for this value, the argument of [`Unknown::value`].
    pub(super) fn off(&self, value: f64) -> f64 {
        let from = value - self.free.start;
        if from < 0.0 { from / (self.free.start - self.low) } else { from / (self.high - self.free.start) }
    }

    /// Deviation at this quantile.
    pub(super) fn quantile(&self, u: f64) -> f64 {
        match self.is_fitted {
            true => normal_quantile(u) / normal_quantile(0.975),
            false => 2.0 * u - 1.0,
        }
    }

    /// Deviation in words: its value if it was fitted, otherwise a percentage.
    pub(super) fn words(&self, off: f64) -> String {
        let value = self.value(off);
        match self.is_fitted {
            true => format!("{} {}", self.name, engineering(value, self.free.unit, 4)),
            false => format!("{} {:+.0} %", self.name, 100.0 * (value / self.free.start - 1.0)),
        }
    }
}

/// Name of the group that a parameter varies with: K_t and K_e of one motor are one number in SI units, and pulleys of
/// one make are equal.
fn kin(name: &str) -> String {
    let first = name.split(" = ").next().unwrap_or(name);
    first.replace("back_emf_constant", "torque_constant").replace("idler_pulley.", "drive_pulley.")
}

/// Ties unknowns of one group.
pub(super) fn tie(unknowns: &mut [Unknown]) {
    let names: Vec<String> = unknowns.iter().map(|unknown| kin(&unknown.name)).collect();
    for (unknown, name) in unknowns.iter_mut().zip(&names) {
        unknown.with = names.iter().position(|other| other == name).unwrap_or_default();
    }
}

/// Parameters that no fit has estimated keep their default spread. If one of a motor's two constants was not fitted, it
/// has the relative deviation of the other.
pub(super) fn with_the_rest(mut fitted: Vec<Unknown>, machine: &Machine) -> Vec<Unknown> {
    let frees: Vec<&Free> = fitted.iter().map(|unknown| &unknown.free).collect();
    let rest = kinds_without(machine, &frees).into_iter().map(|free| {
        let is_constant =
            |name: &str| name.contains("motor.torque_constant") || name.contains("motor.back_emf_constant");
        let own = |name: &str| is_constant(name).then(|| kin(name));
        let same = fitted.iter().find(|other| own(&free.name).is_some() && own(&other.name) == own(&free.name));
        match same {
            Some(same) => {
                let share = |value: f64| value / same.free.start * free.start;
                let (low, high) = (share(same.low), share(same.high));
                Unknown { low, high, is_fitted: same.is_fitted, ..Unknown::spread(free, SPREAD) }
            }
            None => Unknown::spread(free, SPREAD),
        }
    });
    let rest: Vec<Unknown> = rest.collect();
    fitted.extend(rest);
    fitted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, TEMPLATE};

    /// K_t and K_e of a motor are one number: the one that was not fitted has the deviation of the other, and all else
    /// its default spread.
    #[test]
    fn what_was_not_fitted_has_its_default_spread_or_that_of_its_kin() {
        let machine = Case::from_text("axis.toml", TEMPLATE).unwrap().machine;
        let free = Free::new(&machine, "motor.torque_constant", &[], &[]).unwrap();
        let ends = [0.9, 1.3].map(|part| part * free.start);
        let fitted = vec![Unknown::fitted(free, ends)];
        let all = with_the_rest(fitted, &machine);
        assert!(all[0].name == "motor.torque_constant" && all.len() > 3);
        let mut count = 0;
        for unknown in &all[1..] {
            let parts = [unknown.low, unknown.high].map(|value| value / unknown.free.start);
            let is_kin = unknown.name.contains("motor.back_emf_constant");
            count += usize::from(is_kin);
            let known = if is_kin { [0.9, 1.3] } else { [1.0 - SPREAD, 1.0 + SPREAD] };
            assert!(parts.iter().zip(known).all(|(part, known)| (part - known).abs() < 1e-12), "{unknown:?}");
            assert_eq!(unknown.is_fitted, is_kin, "{}", unknown.name);
        }
        assert_eq!(count, 1);
    }
}
