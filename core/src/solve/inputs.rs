//! The inputs of all drives at once: stretches of time on which each is one polynomial.

use crate::mechanism::DRIVES;
use crate::signal::{DEGREE, Piece, Signal};

/// One polynomial for each input, from `start` to `end`; what is not there is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pieces {
    /// Where they begin, s; powers count from here.
    pub start: f64,
    /// Where the first of them ends, s.
    pub end: f64,
    /// u_i(t) = Σ c_ik (t − start)ᵏ.
    pub coefficients: [[f64; DEGREE + 1]; DRIVES],
}

impl Pieces {
    /// Values and derivatives of these signals at `time`, s.
    pub fn of(signals: &[Signal], time: f64) -> Self {
        let mut pieces = Self { start: time, end: f64::INFINITY, coefficients: [[0.0; DEGREE + 1]; DRIVES] };
        for (signal, coefficients) in signals.iter().zip(&mut pieces.coefficients) {
            let piece = signal.piece(time);
            pieces.end = pieces.end.min(piece.end);
            *coefficients = piece.coefficients;
        }
        pieces
    }

    /// These values, held from `start` to `end`; those that would not end after they begin have no end.
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
            *coefficients = Self::shifted(coefficients, by);
        }
        pieces
    }

    /// Coefficients in powers of (τ − `by`) of Σ c_k τᵏ: Horner's rule, again and again.
    pub(super) fn shifted(coefficients: &[f64; DEGREE + 1], by: f64) -> [f64; DEGREE + 1] {
        let mut shifted = *coefficients;
        if by != 0.0 && coefficients[1..].iter().any(|&c| c != 0.0) {
            for i in 0..DEGREE {
                for k in (i..DEGREE).rev() {
                    shifted[k] += by * shifted[k + 1];
                }
            }
        }
        shifted
    }

    /// The highest power of time in any of them.
    pub fn degree(&self) -> usize {
        self.pieces().map(|piece| piece.degree()).max().unwrap_or(0)
    }

    /// The inputs at `tau` after the start, no power of time being above `degree`.
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
