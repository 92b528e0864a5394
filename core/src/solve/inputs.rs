//! Inputs of all drives: intervals on which each is one polynomial.

use super::roots::first_fall;
use crate::mechanism::{DRIVES, Mechanism};
use crate::signal::{DEGREE, Piece, Signal, shifted};

/// Inputs of all drives at `time` (s) as they apply them: rounded to microsteps for a stepper.
pub(crate) fn applied(signals: &[Signal], mechanism: &Mechanism, time: f64) -> [f64; DRIVES] {
    Pieces::new(signals, time).applied(mechanism, time).values(0.0, 0)
}

/// One polynomial for each input, from `start` to `end`; missing inputs are zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pieces {
    /// Begin of the pieces, s; powers count from here.
    pub start: f64,
    /// End of the first piece, s.
    pub end: f64,
    /// u_i(t) = Σ c_ik (t − start)ᵏ.
    pub coefficients: [[f64; DEGREE + 1]; DRIVES],
}

impl Pieces {
    /// Values and derivatives of these signals at `time`, s.
    pub fn new(signals: &[Signal], time: f64) -> Self {
        let mut pieces = Self { start: time, end: f64::INFINITY, coefficients: [[0.0; DEGREE + 1]; DRIVES] };
        for (signal, coefficients) in signals.iter().zip(&mut pieces.coefficients) {
            let piece = signal.piece(time);
            pieces.end = pieces.end.min(piece.end);
            *coefficients = piece.coefficients;
        }
        pieces
    }

    /// These inputs with a constant added to each.
    pub fn plus(mut self, added: &[f64]) -> Self {
        self.coefficients.iter_mut().zip(added).for_each(|(coefficients, added)| coefficients[0] += added);
        self
    }

    /// These values, held from `start` to `end`; without an end unless `end` is after `start`.
    pub fn held(values: &[f64], start: f64, end: f64) -> Self {
        let end = if end > start { end } else { f64::INFINITY };
        let mut pieces = Self { start, end, coefficients: [[0.0; DEGREE + 1]; DRIVES] };
        for (value, coefficients) in values.iter().zip(&mut pieces.coefficients) {
            coefficients[0] = *value;
        }
        pieces
    }

    /// These inputs as polynomials that begin at `time`.
    pub fn since(&self, time: f64) -> Self {
        let by = time - self.start;
        let mut pieces = Self { start: time, ..*self };
        for coefficients in &mut pieces.coefficients {
            *coefficients = shifted(coefficients, by);
        }
        pieces
    }

    /// These pieces with one input rounded to a multiple of `step`, as by a driver of microsteps, up to the time at
    /// which the nearest multiple changes, or to `until`.
    fn stepped(&self, input: usize, step: f64, until: f64) -> Self {
        let powers = &self.coefficients[input];
        let at = |tau: f64| powers.iter().rev().fold(0.0, |sum, c| sum * tau + c);
        // On the edge between two steps, its direction of motion decides.
        let begin = AHEAD + 16.0 * f64::EPSILON * self.start;
        let whole = (at(begin) / step).round();
        let mut pieces = *self;
        pieces.coefficients[input] = [0.0; DEGREE + 1];
        pieces.coefficients[input][0] = whole * step + 0.0;
        let length = self.end.min(until) - self.start;
        let edges = [-1.0, 1.0].map(|side| first_beyond(powers, (whole + 0.5 * side) * step, side, begin..length));
        if let Some(first) = edges.into_iter().flatten().reduce(f64::min) {
            pieces.end = pieces.end.min(self.start + first);
        }
        pieces
    }

    /// These pieces as the drives of a mechanism apply them: rounded to microsteps for a stepper.
    pub fn applied(self, mechanism: &Mechanism, until: f64) -> Self {
        (0..mechanism.drives.len()).fold(self, |pieces, drive| match mechanism.microstep(drive) {
            Some(step) => pieces.stepped(drive, step, until),
            None => pieces,
        })
    }

    /// The highest power of time in any of them.
    pub fn degree(&self) -> usize {
        self.pieces().map(|piece| piece.degree()).max().unwrap_or(0)
    }

    /// The inputs at `tau` after the start, of at most this `degree`.
    #[inline]
    pub fn values(&self, tau: f64, degree: usize) -> [f64; DRIVES] {
        let mut values = [0.0; DRIVES];
        for (value, coefficients) in values.iter_mut().zip(&self.coefficients) {
            *value = coefficients[..=degree].iter().rev().fold(0.0, |sum, c| sum * tau + c);
        }
        values
    }

    /// One by one.
    pub fn pieces(&self) -> impl Iterator<Item = Piece> + '_ {
        self.coefficients.iter().map(|&coefficients| Piece { start: self.start, end: self.end, coefficients })
    }
}

/// Time ahead at which a command is evaluated to find its microstep, s; much less than the duration of a microstep.
const AHEAD: f64 = 1e-9;

/// First time in `within` at which a polynomial is beyond `level`, above or below it by `side`; its start if it is
/// beyond there.
fn first_beyond(powers: &[f64; DEGREE + 1], level: f64, side: f64, within: std::ops::Range<f64>) -> Option<f64> {
    let length = within.end - within.start;
    if length <= 0.0 {
        return None;
    }
    // Remainder up to the level, over the fraction of `within`.
    let mut left = shifted(powers, within.start);
    left[0] -= level;
    let mut scale = -side;
    for power in &mut left {
        *power *= scale;
        scale *= length;
    }
    first_fall(&left).map(|share| within.start + share * length)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A command that rises and falls: at any time the nearest microstep, without a negative zero.
    #[test]
    fn a_driver_of_microsteps_applies_the_nearest_one() {
        let step = 0.05;
        let mut pieces = Pieces::held(&[-0.013], 2.0, 3.0);
        pieces.coefficients[0][1] = 1.1;
        pieces.coefficients[0][2] = -1.3;
        let command = |time: f64| -0.013 + 1.1 * (time - 2.0) - 1.3 * (time - 2.0) * (time - 2.0);
        let (mut rest, mut count) = (pieces, 0);
        while rest.start < 3.0 {
            let applied = rest.stepped(0, step, 3.0);
            let value = applied.coefficients[0][0];
            assert!(
                applied.coefficients[0][1..].iter().all(|c| *c == 0.0) && (value != 0.0 || value.is_sign_positive())
            );
            assert!(applied.end > rest.start, "{applied:?}");
            let end = applied.end.min(3.0);
            for k in 1..50 {
                let time = rest.start + (end - rest.start) * f64::from(k) / 50.0;
                assert!((value - command(time)).abs() <= 0.5 * step + 1e-8, "{time}: {value} {}", command(time));
            }
            count += 1;
            rest = Pieces { end: 3.0, ..pieces.since(end) };
        }
        // Up from 0 to 0.2, down to −0.2.
        assert_eq!(count, 13);
    }
}
