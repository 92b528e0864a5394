//! Choice of a shaper and its frequency by Klipper's criterion, on a spectrum or on the modes of a model.
//!
//! At every frequency of a grid a shaper leaves some vibration and costs some smoothing. For each kind the frequency
//! with the best score among those near the least vibration is chosen, and of all kinds the one with a clearly better
//! score.

use super::criterion::score;
pub use super::criterion::{ALLOWED_SMOOTHING, Criterion, Target};
use super::pairs::{Pair, pairs};
use super::shaper::{Firmware, Pattern, Shaper, ShaperKind};
use crate::error::{Error, Result};
use crate::quantity::rounded;

/// A shaper at its best frequency.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Fitted {
    /// The shaper.
    pub shaper: Shaper,
    /// Remaining vibration relative to that without a shaper, 0 to 1: see [`Target::remaining`].
    pub vibration: f64,
    /// Smoothing at the criterion's corner, m.
    pub smoothing: f64,
    /// Greatest acceleration with at most [`ALLOWED_SMOOTHING`] that the motors give, m/s².
    pub max_acceleration: f64,
    /// Score, smaller is better: smoothing in mm times a measure of the vibration.
    pub score: f64,
    /// True if it may be recommended.
    pub is_candidate: bool,
    /// True if its frequency is the lowest tried; a lower one might leave less vibration with more smoothing.
    pub is_lowest: bool,
}

/// All kinds at their best frequency, and the recommended one.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// In the order of the criterion's forms, without those that `max_smoothing` excludes or that do not exist for its
    /// damping ratio.
    pub fitted: Vec<Fitted>,
    /// Index of the recommended one.
    pub recommended: usize,
    /// Reason for it.
    pub reason: String,
    /// Convolved pairs of shapers, the best first; empty if not requested.
    pub pairs: Vec<Pair>,
    /// True if the first of them is clearly better than the recommended shaper.
    pub is_pair_better: bool,
}

impl Choice {
    /// The recommended shaper.
    pub fn best(&self) -> &Fitted {
        &self.fitted[self.recommended]
    }
}

/// Fits every form, and recommends one.
pub fn choose(target: Target<'_>, criterion: &Criterion) -> Result<Choice> {
    if let Target::Modes { modes: [], .. } = target {
        return Err(Error::new("there is no mode to shape for").next("give a model whose belt stretches"));
    }
    let (mut fitted, mut refused) = (Vec::new(), None);
    for form in &criterion.forms {
        match Pattern::new(*form, criterion.firmware, criterion.damping) {
            Ok(pattern) => fitted.extend(Tried::all(target, &pattern, criterion)),
            Err(error) => refused = Some(error),
        }
    }
    let candidates: Vec<usize> =
        (0..fitted.len()).filter(|&i| criterion.candidates.contains(&fitted[i].pattern.form)).collect();
    let Some(&first) = candidates.first() else {
        if let (Some(error), true) = (refused, fitted.is_empty()) {
            return Err(error);
        }
        let limit = rounded(criterion.max_smoothing.unwrap_or_default() * 1e3);
        let error = Error::new(format!("no shaper has a smoothing of at most {limit} mm"));
        return Err(error.next("allow more smoothing, or more kinds of shapers"));
    };
    let recommended = match criterion.firmware {
        Firmware::Klipper202508 => candidates.iter().copied().skip(1).fold(first, |best, i| {
            if is_clearly_better(fitted[i].taken().rank(), fitted[best].taken().rank()) { i } else { best }
        }),
        Firmware::Klipper => {
            let is_measured = !matches!(target, Target::Modes { .. });
            recommended(&mut fitted, &candidates, criterion.max_vibrations, is_measured)
        }
    };
    let fitted: Vec<Fitted> = fitted.iter().map(|one| one.fitted(criterion)).collect();
    let reason = reason(&fitted, recommended);
    let pairs = if criterion.pairs { pairs(target, criterion) } else { Vec::new() };
    let best = &fitted[recommended];
    let is_pair_better = pairs.first().is_some_and(|pair| {
        let quieter = criterion.max_vibrations.is_some_and(|most| best.vibration > most);
        is_clearly_better((pair.score, pair.smoothing), (best.score, best.smoothing))
            || quieter && pair.vibration < best.vibration
    });
    Ok(Choice { fitted, recommended, reason, pairs, is_pair_better })
}

/// A shaper at one frequency.
#[derive(Debug, Clone)]
struct Point {
    shaper: Shaper,
    vibration: f64,
    smoothing: f64,
    score: f64,
}

impl Point {
    /// Score and smoothing.
    fn rank(&self) -> (f64, f64) {
        (self.score, self.smoothing)
    }
}

/// A form at all frequencies, ascending, and the chosen one.
struct Tried {
    pattern: Pattern,
    points: Vec<Point>,
    taken: usize,
    lowest: Option<f64>,
}

/// By score and smoothing; a longer shaper must be clearly better: by a fifth, or by a twentieth with a tenth less
/// smoothing.
fn is_clearly_better(one: (f64, f64), other: (f64, f64)) -> bool {
    1.2 * one.0 < other.0 || 1.05 * one.0 < other.0 && 1.1 * one.1 < other.1
}

/// The rule since 2025-10: as before from shorter to longer; a longer one is also taken if the best so far exceeds the
/// desired vibration and it leaves less; each is moved to a frequency with less vibration and smoothing than the best
/// so far, if one exists; and a ZV is replaced by the first that leaves a tenth less, unless the vibration is known
/// from a model.
fn recommended(fitted: &mut [Tried], candidates: &[usize], wanted: Option<f64>, is_measured: bool) -> usize {
    let mut best = candidates[0];
    for &i in candidates {
        let (one, other) = (fitted[i].taken().clone(), fitted[best].taken().clone());
        let quieter = wanted.is_some_and(|most| other.vibration > most) && one.vibration < other.vibration;
        if i != best && (is_clearly_better(one.rank(), other.rank()) || quieter) {
            best = i;
        }
        let mut least = (fitted[best].taken().vibration, fitted[best].taken().smoothing);
        for place in 0..fitted[i].points.len() {
            let point = &fitted[i].points[place];
            if point.vibration < least.0 && point.smoothing < least.1 {
                least = (point.vibration, point.smoothing);
                (best, fitted[i].taken) = (i, place);
            }
        }
    }
    if is_measured && fitted[best].pattern.form.kind() == ShaperKind::Zv {
        let left = fitted[best].taken().vibration;
        let other = candidates
            .iter()
            .copied()
            .find(|&i| fitted[i].pattern.form.kind() != ShaperKind::Zv && 1.1 * fitted[i].taken().vibration < left);
        best = other.unwrap_or(best);
    }
    best
}

impl Tried {
    /// A form at every frequency; none if smoothing is always too large.
    fn all(target: Target<'_>, pattern: &Pattern, criterion: &Criterion) -> Option<Self> {
        let grid = target.grid(pattern.form.kind(), criterion.firmware);
        let point = |frequency: f64| {
            let shaper = pattern.at(frequency);
            let smoothing = shaper.smoothing(&criterion.corner);
            if criterion.max_smoothing.is_some_and(|most| smoothing > most) {
                return None;
            }
            let v = target.remaining(&shaper, &criterion.tested);
            let score = score(smoothing, v);
            Some(Point { shaper, vibration: v, smoothing, score })
        };
        let points: Vec<Point> = grid.iter().copied().filter_map(point).collect();
        // The least vibration; among equals the highest frequency, which has the least smoothing.
        let (mut taken, least) =
            points.iter().enumerate().rev().min_by(|a, b| a.1.vibration.total_cmp(&b.1.vibration))?;
        let least = least.vibration;
        // Slightly more vibration is acceptable with a better score.
        let (more, is_loud) = match criterion.firmware {
            Firmware::Klipper202508 => (0.0, false),
            Firmware::Klipper => (0.0005, criterion.max_vibrations.is_some_and(|most| least > most)),
        };
        // If frequencies were excluded by smoothing, the least vibration is chosen.
        let is_cut = criterion.firmware == Firmware::Klipper && points.len() < grid.len();
        if !is_cut {
            for (place, point) in points.iter().enumerate() {
                if point.vibration < 1.1 * least + more && (point.score < points[taken].score || is_loud) {
                    taken = place;
                }
            }
        }
        Some(Self { pattern: pattern.clone(), points, taken, lowest: grid.first().copied() })
    }

    fn taken(&self) -> &Point {
        &self.points[self.taken]
    }

    fn fitted(&self, criterion: &Criterion) -> Fitted {
        let point = self.taken();
        Fitted {
            shaper: point.shaper.clone(),
            vibration: point.vibration,
            smoothing: point.smoothing,
            max_acceleration: criterion.max_acceleration(point.shaper.impulses()),
            score: point.score,
            is_candidate: criterion.candidates.contains(&self.pattern.form),
            is_lowest: self.lowest == Some(point.shaper.frequency),
        }
    }
}

fn reason(fitted: &[Fitted], recommended: usize) -> String {
    let best = &fitted[recommended];
    let told = |one: &Fitted| {
        format!("leaves {:.1} % of the vibration and smooths by {:.3} mm", 100.0 * one.vibration, 1e3 * one.smoothing)
    };
    let name = |one: &Fitted| one.shaper.form.name();
    let other = |i: &usize| *i != recommended && fitted[*i].is_candidate;
    let next = (0..fitted.len()).filter(other).min_by(|a, b| fitted[*a].score.total_cmp(&fitted[*b].score));
    let Some(next) = next.map(|i| &fitted[i]) else {
        return format!("{} {}; no other is a candidate", name(best), told(best));
    };
    let ratio = next.score / best.score;
    let words = match ratio {
        r if r >= 1.2 => {
            format!("the next best, {}, {}, and its score is {r:.2} times as high", name(next), told(next))
        }
        r if r >= 1.0 => {
            format!("{} is nearly as good: it {}, and its score is {r:.2} times as high", name(next), told(next))
        }
        r => format!(
            "{} {}, and its score is {r:.2} of that: too little gained for a longer one",
            name(next),
            told(next)
        ),
    };
    format!("{} {}; {words}", name(best), told(best))
}
