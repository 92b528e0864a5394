//! When two times are one instant, which cell of a lattice of seams a time lies in, and whose turn it is.

use super::{Signal, Slot};

/// A moment on some signal's clock.
#[derive(Debug, Clone, Copy)]
pub(super) struct Now {
    /// Time on this clock, s.
    pub t: f64,
    /// Seams up to this much later count as reached, s. Comes from the outermost clock, whose rounding it covers.
    pub slack: f64,
}

impl Now {
    /// The time `t` on the outermost clock.
    pub fn at(t: f64) -> Self {
        Self { t, slack: 8.0 * f64::EPSILON * t }
    }

    /// This moment with the clock at `t`.
    fn showing(self, t: f64) -> Self {
        Self { t: t.max(0.0), ..self }
    }

    /// True if it is `seam` or later.
    pub fn reached(self, seam: f64) -> bool {
        seam <= self.t + self.slack
    }

    /// True if seams `spacing` apart can be told apart; false also for a spacing that is not a positive number.
    pub(crate) fn resolves(self, spacing: f64) -> bool {
        spacing > 1e-30 && spacing > 16.0 * self.slack
    }

    /// The k ≥ 0 with seam(k) reached and seam(k + 1) not; `guess` is k to within rounding.
    ///
    /// Only the computed seams decide, so a time that is one of them always falls to the cell it begins. Call it only
    /// for spacings that the clock resolves.
    pub fn cell(self, guess: f64, seam: impl Fn(f64) -> f64) -> f64 {
        let mut k = guess.floor().max(0.0);
        // Rounding puts the guess off by one; the bound is there for lattices that overflow.
        for _ in 0..4 {
            if k > 0.0 && !self.reached(seam(k)) {
                k -= 1.0;
            } else if self.reached(seam(k + 1.0)) {
                k += 1.0;
            } else {
                break;
            }
        }
        k
    }
}

/// Signals one after another, each on its own clock; the last goes on.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    slots: Vec<Slot>,
    /// When each turn begins, on the sequence's clock, s; and what rounding left over of it.
    starts: Vec<(f64, f64)>,
}

impl Sequence {
    /// These turns in this order; those that last no time are passed over.
    pub fn new(slots: Vec<Slot>) -> Self {
        // The running sum of the turns is start + rest, so that ten turns of 0.1 s end at 1 s.
        let mut sum = (0.0, 0.0);
        let mut begin = |slot: &Slot| {
            let start = sum;
            let (next, error) = two_sum(sum.0, slot.lasts.max(0.0));
            sum = two_sum(next, sum.1 + error);
            start
        };
        let starts = slots.iter().map(&mut begin).collect();
        Self { slots, starts }
    }

    /// The turns.
    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// Whose turn it is `now`, found by halving: a look-up costs the logarithm of the number of turns. None without
    /// turns.
    pub(super) fn turn(&self, now: Now) -> Option<Turn<'_>> {
        // The first turn whose end, the start of the next, is not reached.
        let ends = self.starts.get(1..)?;
        let place = ends.partition_point(|(end, _)| now.reached(*end));
        let (slot, &(start, rest)) = (self.slots.get(place)?, self.starts.get(place)?);
        let end = ends.get(place).map_or(f64::INFINITY, |(end, _)| *end);
        Some(Turn { signal: &slot.signal, now: now.showing((now.t - start) - rest), start, rest, end })
    }

    /// When all turns are over, s; none if the last one has no end.
    pub(super) fn duration(&self) -> Option<f64> {
        let (Some(last), Some((start, _))) = (self.slots.last(), self.starts.last()) else { return Some(0.0) };
        Some(start + if last.lasts.is_finite() { last.lasts.max(0.0) } else { last.signal.duration()? })
    }
}

/// A slot's turn in a sequence.
pub(super) struct Turn<'a> {
    /// Whose turn it is.
    pub signal: &'a Signal,
    /// The moment on its own clock.
    pub now: Now,
    /// When the turn began, on the sequence's clock, s; and what rounding left over of it.
    start: f64,
    rest: f64,
    /// When it ends; infinite for the last.
    pub end: f64,
}

impl Turn<'_> {
    /// A time on the slot's clock, read on the sequence's.
    pub fn outside(&self, t: f64) -> f64 {
        self.start + (t + self.rest)
    }
}

/// a + b, rounded, and the error of that.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let part = sum - a;
    let error = (a - (sum - part)) + (b - part);
    (sum, if error.is_finite() { error } else { 0.0 })
}
