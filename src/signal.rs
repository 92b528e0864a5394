//! Inputs: step, pulse, ramp, triangle, square, sine, chirp, multisine, PRBS, tables, and sums and sequences of them.
//!
//! Every signal is a chain of polynomial pieces; the solver stops at each seam, so no edge is ever stepped over.

/// Highest power of time in a [`Piece`].
pub const DEGREE: usize = 7;

/// A stretch of time on which the input is a polynomial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Where it begins, s; powers count from here.
    pub start: f64,
    /// Where it ends, s; the next piece holds from there on. `f64::INFINITY` for the last.
    pub end: f64,
    /// u(t) = Σ c_k (t − start)ᵏ.
    pub coefficients: [f64; DEGREE + 1],
}

/// An input over time, in units of the amplifier's input (V unless the case says otherwise).
#[derive(Debug, Clone, PartialEq)]
pub enum Signal {
    /// Zero before `at`, `value` from then on.
    Step { value: f64, at: f64 },
}
