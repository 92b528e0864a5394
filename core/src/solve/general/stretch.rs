//! The present inputs of a machine: polynomials from a beginning to an end.

use super::step::Inputs;
use crate::mechanism::DRIVES;
use crate::signal::{DEGREE, shifted};
use crate::solve::inputs::Pieces;

/// One piece of the inputs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    /// Begin, s.
    pub(super) begin: f64,
    /// End, s.
    pub(super) end: f64,
    pieces: Pieces,
    /// The highest power of time.
    pub(super) degree: usize,
}

impl Stretch {
    /// One piece, up to `end` at most.
    pub(super) fn new(pieces: Pieces, end: f64) -> Self {
        Self { begin: pieces.start, end: pieces.end.min(end), pieces, degree: pieces.degree() }
    }

    /// The inputs along it.
    pub(super) fn pieces(&self) -> Pieces {
        self.pieces
    }

    pub(super) fn length(&self) -> f64 {
        self.end - self.begin
    }

    /// The inputs at `tau` after the beginning.
    #[inline]
    pub(super) fn input(&self, tau: f64) -> [f64; DRIVES] {
        self.pieces.values(tau, self.degree)
    }

    /// The inputs of a step of length `h` from `tau` on, by powers of its share.
    pub(super) fn inputs(&self, tau: f64, h: f64) -> Inputs {
        let mut inputs = [[0.0; DEGREE + 1]; DRIVES];
        if self.degree == 0 {
            for (own, coefficients) in inputs.iter_mut().zip(&self.pieces.coefficients) {
                own[0] = coefficients[0];
            }
            return inputs;
        }
        for (own, coefficients) in inputs.iter_mut().zip(&self.pieces.coefficients) {
            *own = shifted(coefficients, tau);
            let mut power = 1.0;
            for value in own.iter_mut() {
                *value *= power;
                power *= h;
            }
        }
        inputs
    }
}
