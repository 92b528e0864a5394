//! Quartics of time through the values of a step at its beginning and its nodes: signs, crossings, slowest places.

use super::radau::{Lane, NODES, PLACES, POINTS, SLOPES, monomials};

/// A step that begins this near a kink, as a share of how far it goes from there, begins at it.
pub(super) const AT_KINK: f64 = 1e-8;

/// Number of parts of the interval between two nodes in which a quartic is examined for a change of sign.
const PARTS: usize = 4;

/// Halvings of a part of a step in which such a place is found. Near its least value a speed hardly changes.
const HALVINGS: usize = 12;

/// Σ c_k sᵏ.
#[inline(always)]
pub(super) fn polynomial(powers: &[f64; POINTS], s: f64) -> f64 {
    powers.iter().rev().fold(0.0, |sum, power| sum * s + power)
}

/// True if a speed with these values at the points of a step can be slowest between two of them: it does not grow or
/// fall all the way, nor at its ends.
#[inline(always)]
pub(super) fn has_slowest(speeds: &[f64; POINTS]) -> bool {
    let slope = |weights: &[f64; POINTS]| weights.iter().zip(speeds).fold(0.0, |sum, (weight, v)| sum + weight * v);
    let (begin, end) = (slope(&SLOPES[0]), slope(&SLOPES[1]));
    let mut changes = speeds.windows(2).map(|pair| pair[1] - pair[0]).chain([begin, end]);
    !(changes.clone().all(|change| change >= 0.0) || changes.all(|change| change <= 0.0))
}

/// The largest difference of two values.
#[inline(always)]
pub(super) fn spread(values: &[f64; POINTS]) -> f64 {
    let (least, most) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (l.min(*v), m.max(*v)));
    most - least
}

/// True if |v| passes `width` between two points of a step.
#[inline(always)]
pub(super) fn passes(speeds: &[f64; POINTS], width: f64) -> bool {
    let below = speeds.map(|v| v.abs() < width);
    below.contains(&true) && below.contains(&false)
}

/// Calls `each` with every share of a step at which `is` changes, and its value after that.
pub(super) fn places(is: impl Fn(f64) -> bool, mut each: impl FnMut(f64, bool)) {
    const COUNT: usize = NODES * PARTS;
    let mut before = (0.0, is(0.0));
    for part in 1..=COUNT {
        let s = part as f64 / COUNT as f64;
        let (mut low, mut high, now) = (before.0, s, is(s));
        if now != before.1 {
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if is(middle) == now { high = middle } else { low = middle }
            }
            each(0.5 * (low + high), now);
        }
        before = (s, now);
    }
}

/// An argument at the points of a step.
#[inline(always)]
pub(super) fn course(begin: f64, [a, b, c, d]: &Lane) -> [f64; POINTS] {
    [begin, *a, *b, *c, *d]
}

/// The share of a step at which a quartic through these values first changes its sign, also between two nodes and back,
/// if it goes farther than `negligible` from zero, and not where it begins.
#[inline(always)]
pub(super) fn crossing(values: &[f64; POINTS], negligible: f64) -> Option<f64> {
    let farthest = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    if farthest <= negligible || stays_on_its_side(values) {
        return None;
    }
    let powers = monomials(values);
    let at = |s: f64| powers.iter().rev().fold(0.0, |sum, power| sum * s + power);
    let between = (0..NODES).flat_map(|pair| {
        let (begin, length) = (PLACES[pair], PLACES[pair + 1] - PLACES[pair]);
        (0..PARTS).map(move |part| (pair, part, begin + length * part as f64 / PARTS as f64))
    });
    let places = between.map(|(pair, part, s)| (s, if part == 0 { values[pair] } else { at(s) }));
    // If it begins at zero, it has no sign yet.
    let mut places = places.chain([(1.0, values[NODES])]).skip_while(|(_, value)| value.abs() <= AT_KINK * farthest);
    let (mut low, side) = places.next()?;
    for (mut high, value) in places {
        if value * side >= 0.0 {
            low = high;
            continue;
        }
        for _ in 0..52 {
            let middle = 0.5 * (low + high);
            if at(middle) * side > 0.0 { low = middle } else { high = middle }
        }
        return Some(0.5 * (low + high));
    }
    None
}

/// True if a quartic through these values surely keeps their sign: it goes beyond them by less than they differ.
#[inline(always)]
fn stays_on_its_side(values: &[f64; POINTS]) -> bool {
    let (least, most) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (l.min(*v), m.max(*v)));
    most - least < least.max(-most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ends_of_an_interval_as_long_as_a_part_are_found() {
        let count = (NODES * PARTS) as f64;
        let near = 0.5_f64.powi(HALVINGS as i32) / count;
        for part in 1..NODES * PARTS {
            let (from, to) = ((part as f64 - 0.4) / count, (part as f64 + 0.3) / count);
            let mut found = Vec::new();
            places(|s| s > from && s < to, |s, now| found.push((s, now)));
            let [(rises, true), (falls, false)] = found[..] else { panic!("{part}: {found:?}") };
            assert!((rises - from).abs() < near && (falls - to).abs() < near, "{part}: {found:?}");
        }
    }
}
