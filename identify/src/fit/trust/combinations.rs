//! Determined combinations of undetermined parameters: their sums, ratios and products, with names and intervals.

use super::directions::Directions;
use crate::fit::asked::problem::Problem;
use crate::fit::limits::{NORMAL, WHOLE_POWER};
use nalgebra::{DMatrix, DVector};

/// A combination of parameters that the logs determine.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Combination {
    /// In symbols of the keys: `cart.friction.viscous / amplifier.gain`.
    pub name: String,
    /// SI unit; empty if it has no name.
    pub unit: String,
    /// Its value.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
}

/// Determined combinations of `members`, of which `lost` directions are not determined: each of them with the one that
/// moves most along the lost direction, or with the two that do for two lost directions.
pub(crate) fn combinations(
    problem: &Problem,
    directions: &Directions,
    names: &[String],
    members: &[usize],
    lost: &[usize],
    x: &[f64],
    of: &dyn Fn(&[f64]) -> f64,
) -> Vec<Combination> {
    let v = &directions.v;
    let n = v.nrows();
    // Relative changes of the members along the lost directions.
    let hidden = DMatrix::from_fn(members.len(), lost.len(), |a, d| v[(members[a], lost[d])]);
    let kept: Vec<usize> = (0..directions.alive).filter(|i| !lost.contains(i)).collect();
    let mut found: Vec<Combination> = Vec::new();
    for a in 0..members.len() {
        for b in 0..members.len() {
            if a == b {
                continue;
            }
            // c_a, c_b with c · h = 0 along all lost directions.
            let (ha, hb) = (hidden.row(a), hidden.row(b));
            let (size_a, size_b) = (ha.norm(), hb.norm());
            if size_a < 1e-3 || size_b < 1e-3 || ha.dot(&hb).abs() < 0.999 * size_a * size_b {
                continue;
            }
            let ratio = size_a / size_b * ha.dot(&hb).signum();
            let (ja, jb) = (members[a], members[b]);
            let Some((name, unit, value, wa, wb)) = named(problem, names, ja, jb, ratio, x, a < b) else { continue };
            if found.iter().any(|other| other.name == name) {
                continue;
            }
            // In terms of the determined directions.
            let mut c = DVector::zeros(n);
            (c[ja], c[jb]) = (wa, wb);
            let mut along = vec![0.0; directions.alive];
            for &i in &kept {
                along[i] = (0..n).map(|j| c[j] * v[(j, i)]).sum();
            }
            let error = of(&along) * value.abs();
            let reach = NORMAL * error;
            if error.is_finite() {
                found.push(Combination { name, unit, value, error, interval: [value - reach, value + reach] });
            }
        }
    }
    found
}

/// The combination of two parameters that does not change when the second changes by 1 % and the first by `ratio` times
/// that: its name, unit, value, and its relative change per relative change of each.
fn named(
    problem: &Problem,
    names: &[String],
    a: usize,
    b: usize,
    ratio: f64,
    x: &[f64],
    first: bool,
) -> Option<(String, String, f64, f64, f64)> {
    let m = problem.parameters.len();
    if a >= m || b >= m {
        return None;
    }
    let (va, vb) = (problem.value(a, x[a]), problem.value(b, x[b]));
    let (ua, ub) = (problem.parameters[a].unit, problem.parameters[b].unit);
    let machine = problem.stage_at(x);
    // Relative changes refer to `whole`, which exceeds the value of small parameters.
    let relative = |j: usize, value: f64| problem.slope(j, value) * problem.whole(&machine, j, x[j]) / value;
    let (ra, rb) = (relative(a, va), relative(b, vb));
    if va == 0.0 || vb == 0.0 || !ra.is_finite() || !rb.is_finite() {
        return None;
    }
    // d ln a = power d ln b
    let power = ratio * ra / rb;
    let near = |to: f64| (power / to - 1.0).abs() < WHOLE_POWER;
    if near(1.0) {
        // The gain of an amplifier, or the drive, in the denominator.
        let below = |j: usize| names[j].starts_with("amplifier") || names[j].starts_with("motor");
        if below(a) && !below(b) || (below(a) == below(b) && !first) {
            return None;
        }
        return Some((format!("{} / {}", names[a], names[b]), over(ua, ub), va / vb, ra, -rb));
    }
    if near(-1.0) && first {
        return Some((format!("{} × {}", names[a], names[b]), times(ua, ub), va * vb, ra, rb));
    }
    if !first {
        return None;
    }
    // a + k b with da = −k db.
    let k = -power * va / vb;
    if k > 0.0 {
        let value = va + k * vb;
        let factor = crate::quantity::rounded((1e4 * k / scale(k)).round() / 1e4 * scale(k));
        let name = format!("{} + {factor} × {}", names[a], names[b]);
        return Some((name, ua.to_string(), value, ra * va / value, k * rb * vb / value));
    }
    let name = format!("{} / {}^{power:.3}", names[a], names[b]);
    Some((name, String::new(), va / vb.abs().powf(power), ra, -power * rb))
}

/// The power of ten of a number.
fn scale(k: f64) -> f64 {
    10f64.powf(k.abs().log10().floor())
}

fn over(a: &str, b: &str) -> String {
    match (a, b) {
        _ if a == b => String::new(),
        (a, "") => a.to_string(),
        ("", b) => format!("1/({b})"),
        _ => format!("{a}/({b})"),
    }
}

fn times(a: &str, b: &str) -> String {
    match (a, b) {
        (a, "") => a.to_string(),
        ("", b) => b.to_string(),
        _ => format!("{a} {b}"),
    }
}
