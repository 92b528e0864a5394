//! Pairs of shapers in series, which convolves their impulses. Their remaining vibrations multiply, so a pair
//! suppresses two modes, or both ends of one mode's range along the travel, where a single shaper would have to be long
//! to cover both.
//!
//! W. Singhose, E. Crain, W. Seering, "Convolved and simultaneous two-mode input shapers", *IEE Proceedings - Control
//! Theory and Applications* 144 (1997) 515-520.

use super::criterion::{Criterion, Target, score};
use super::shaper::{Form, Pattern, Shaper, smoothing};

/// Number of frequencies tried for each shaper, at equal ratios.
const GRID: usize = 40;

/// Halvings of the step in the refinement of the best pair.
const HALVINGS: usize = 7;

/// Vibration that counts as near the least: relative and absolute excess.
const MORE: f64 = 1.1;
const HARDLY: f64 = 0.0005;

/// Number of pairs kept.
const KEPT: usize = 3;

/// Two shapers, convolved.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Pair {
    /// The shaper of the lower frequency first.
    pub parts: [Shaper; 2],
    /// Remaining vibration relative to that without a shaper, 0 to 1: see [`Target::remaining`].
    pub vibration: f64,
    /// Smoothing at the criterion's corner, m.
    pub smoothing: f64,
    /// Greatest acceleration with at most [`super::criterion::ALLOWED_SMOOTHING`] that the motors give, m/s².
    pub max_acceleration: f64,
    /// The score, to be compared with that of single shapers: smaller is better.
    pub score: f64,
}

impl Pair {
    /// Time (s, from 0, ascending) and amplitude of each impulse; the amplitudes are positive and sum to 1.
    pub fn impulses(&self) -> Vec<(f64, f64)> {
        convolved(&self.parts[0], &self.parts[1])
    }

    /// Both names with their frequencies.
    pub fn name(&self) -> String {
        let one = |shaper: &Shaper| format!("{} at {:.1} Hz", shaper.form.name(), shaper.frequency);
        format!("{} with {}", one(&self.parts[0]), one(&self.parts[1]))
    }

    /// The line for `[controller]` of a case file.
    pub fn line(&self) -> String {
        let one = |(t, a): &(f64, f64)| format!("[\"{} s\", {}]", digits(*t), digits(*a));
        format!("shaper = [{}]", self.impulses().iter().map(one).collect::<Vec<_>>().join(", "))
    }
}

/// Ten digits: amplitudes must add up to 1 to within a millionth.
fn digits(value: f64) -> f64 {
    format!("{value:.9e}").parse().unwrap_or(value)
}

/// Impulses of two shapers in series.
fn convolved(one: &Shaper, other: &Shaper) -> Vec<(f64, f64)> {
    let of = |&(t, a): &(f64, f64)| other.impulses().iter().map(move |&(s, b)| (t + s, a * b));
    let mut all: Vec<(f64, f64)> = one.impulses().iter().flat_map(of).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Impulses of two equal shapers coincide.
    let near = 1e-9 * all.last().map_or(0.0, |last| last.0);
    all.dedup_by(|next, before| {
        let is_same = next.0 - before.0 <= near;
        if is_same {
            before.1 += next.1;
        }
        is_same
    });
    all
}

/// A form over its frequencies, with its remaining vibration at all points of the target.
struct Tabled {
    pattern: Pattern,
    shapers: Vec<(Shaper, Vec<f64>)>,
}

/// The best pair of any two forms, in descending order.
pub(super) fn pairs(target: Target, criterion: &Criterion) -> Vec<Pair> {
    let tables: Vec<Tabled> = criterion.candidates.iter().filter_map(|form| table(target, criterion, *form)).collect();
    let mut found: Vec<Pair> = Vec::new();
    for (place, one) in tables.iter().enumerate() {
        found.extend(tables[place..].iter().filter_map(|other| best(target, criterion, one, other)));
    }
    found.sort_by(|a, b| rank(a, criterion).total_cmp(&rank(b, criterion)));
    found.truncate(KEPT);
    found
}

/// Its score; pairs with more than the desired vibration come last, ordered by vibration.
fn rank(pair: &Pair, criterion: &Criterion) -> f64 {
    let beyond = criterion.max_vibrations.map_or(0.0, |most| (pair.vibration - most).max(0.0));
    pair.score + if beyond > 0.0 { 1e6 * (1.0 + beyond) } else { 0.0 }
}

fn table(target: Target, criterion: &Criterion, form: Form) -> Option<Tabled> {
    let pattern = Pattern::new(form, criterion.firmware, criterion.damping).ok()?;
    let grid = target.grid(form.kind(), criterion.firmware);
    let (low, high) = (*grid.first()?, *grid.last()?);
    let shapers = (0..GRID).map(|k| {
        let shaper = pattern.at(low * (high / low).powf(k as f64 / (GRID - 1) as f64));
        let mut left = Vec::new();
        target.weighed(&criterion.tested, &mut |f, zeta| {
            left.push(shaper.residual_vibration(f, zeta));
            0.0
        });
        (shaper, left)
    });
    let shapers = shapers.collect();
    Some(Tabled { pattern, shapers })
}

/// Two shapers as a pair with this remaining `vibration`; none with too much smoothing.
fn pair(one: &Shaper, other: &Shaper, vibration: f64, criterion: &Criterion) -> Option<Pair> {
    let impulses = convolved(one, other);
    let smoothing = smoothing(&impulses, &criterion.corner);
    if criterion.max_smoothing.is_some_and(|most| smoothing > most) {
        return None;
    }
    let mut parts = [one.clone(), other.clone()];
    parts.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    let max_acceleration = criterion.max_acceleration(&impulses);
    Some(Pair { parts, vibration, smoothing, max_acceleration, score: score(smoothing, vibration) })
}

/// The best pair of two forms, by the rule for single ones: the best score among those near the least vibration. Found
/// on a grid, then refined.
fn best(target: Target, criterion: &Criterion, one: &Tabled, other: &Tabled) -> Option<Pair> {
    let mut on_grid: Vec<Pair> = Vec::new();
    for (a, left) in &one.shapers {
        for (b, right) in &other.shapers {
            let mut both = left.iter().zip(right).map(|(v, w)| v * w);
            let vibration = target.weighed(&criterion.tested, &mut |_, _| both.next().unwrap_or(1.0));
            on_grid.extend(pair(a, b, vibration, criterion));
        }
    }
    let range = |table: &Tabled| Some([table.shapers.first()?.0.frequency, table.shapers.last()?.0.frequency]);
    let ranges = [range(one)?, range(other)?];
    let look = |at: [f64; 2]| {
        if at.iter().zip(ranges).any(|(f, [low, high])| !(low..=high).contains(f)) {
            return None;
        }
        let (a, b) = (one.pattern.at(at[0]), other.pattern.at(at[1]));
        let mut left = |f: f64, zeta: f64| a.residual_vibration(f, zeta) * b.residual_vibration(f, zeta);
        pair(&a, &b, target.weighed(&criterion.tested, &mut left), criterion)
    };
    let vibration = |pair: &Pair| pair.vibration;
    let quietest = on_grid.iter().min_by(|a, b| a.vibration.total_cmp(&b.vibration))?;
    let least = moved(quietest.clone(), (one, other), &look, &vibration);
    let most = MORE * least.vibration + HARDLY;
    let score = |pair: &Pair| if pair.vibration <= most { pair.score } else { f64::INFINITY };
    on_grid.push(least);
    let first = on_grid.into_iter().min_by(|a, b| score(a).total_cmp(&score(b)))?;
    Some(moved(first, (one, other), &look, &score))
}

/// Minimises `value` from a pair along each frequency by steps that are halved.
fn moved(
    from: Pair,
    (one, other): (&Tabled, &Tabled),
    look: &dyn Fn([f64; 2]) -> Option<Pair>,
    value: &dyn Fn(&Pair) -> f64,
) -> Pair {
    // The parts are in the order of their frequencies.
    let is_turned = from.parts[0].form != one.pattern.form;
    let mut at = from.parts.each_ref().map(|part| part.frequency);
    if is_turned {
        at.reverse();
    }
    let spread = |table: &Tabled| table.shapers[1].0.frequency / table.shapers[0].0.frequency;
    let mut step = 0.5 * spread(one).max(spread(other)).ln();
    let mut best = from;
    for _ in 0..HALVINGS {
        let mut is_moved = true;
        while is_moved {
            is_moved = false;
            for (part, way) in [(0, step), (0, -step), (1, step), (1, -step)] {
                let mut next = at;
                next[part] *= way.exp();
                if let Some(found) = look(next).filter(|found| value(found) < value(&best)) {
                    (at, best, is_moved) = (next, found, true);
                }
            }
        }
        step *= 0.5;
    }
    best
}
