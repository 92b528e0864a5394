//! When two times are one instant, which cell of a lattice of seams a time lies in, and whose turn it is.

use super::{Signal, Slot};

/// A moment on some signal's clock.
#[derive(Debug, Clone, Copy)]
pub(super) struct Now {
    /// Time on this clock, s.
    pub t: f64,
    /// Seams up to this much later count as reached, s. Comes from the outermost clock, whose rounding it covers.
    slack: f64,
}

impl Now {
    /// The time `t` on the outermost clock.
    pub fn at(t: f64) -> Self {
        Self { t, slack: 8.0 * f64::EPSILON * t }
    }

    /// The same moment where the clock shows `t`.
    fn showing(self, t: f64) -> Self {
        Self { t: t.max(0.0), ..self }
    }

    /// Whether it is `seam` or later.
    pub fn reached(self, seam: f64) -> bool {
        seam <= self.t + self.slack
    }

    /// Whether seams `spacing` apart can be told apart; false also for a spacing that is not a positive number.
    pub fn resolves(self, spacing: f64) -> bool {
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

/// A slot's turn in a sequence.
pub(super) struct Turn<'a> {
    /// Whose turn it is.
    pub signal: &'a Signal,
    /// The moment on its own clock.
    pub now: Now,
    /// When the turn began, on the sequence's clock, s; and what rounding left over of it.
    pub start: f64,
    rest: f64,
    /// When it ends; infinite for the last.
    pub end: f64,
}

impl<'a> Turn<'a> {
    fn new(slot: &'a Slot, now: Now, (start, rest): (f64, f64), end: f64) -> Self {
        Self { signal: &slot.signal, now: now.showing((now.t - start) - rest), start, rest, end }
    }

    /// A time on the slot's clock, read on the sequence's.
    pub fn outside(&self, t: f64) -> f64 {
        self.start + (t + self.rest)
    }
}

/// Whose turn it is `now`; slots that last no time are passed over, the last goes on. None without slots.
pub(super) fn turn(slots: &[Slot], now: Now) -> Option<Turn<'_>> {
    let (last, earlier) = slots.split_last()?;
    // The running sum of the turns is start + rest, so that ten turns of 0.1 s end at 1 s.
    let (mut start, mut rest) = (0.0, 0.0);
    for slot in earlier {
        let (next, error) = two_sum(start, slot.lasts.max(0.0));
        let (next, next_rest) = two_sum(next, rest + error);
        if !now.reached(next) {
            return Some(Turn::new(slot, now, (start, rest), next));
        }
        (start, rest) = (next, next_rest);
    }
    Some(Turn::new(last, now, (start, rest), f64::INFINITY))
}

/// a + b, rounded, and the error of that.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let part = sum - a;
    let error = (a - (sum - part)) + (b - part);
    (sum, if error.is_finite() { error } else { 0.0 })
}
