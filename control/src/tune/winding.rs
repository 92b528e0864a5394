//! Stability of a sampled loop by Nyquist's criterion.

use super::plant::Plant;
use crate::control::feedback::{Feedback, Turn};
use nalgebra::Complex;
use std::f64::consts::PI;

/// Nyquist's criterion: F(z) = det (1 + L)(1 − 1/z)^m, with m poles at z = 1, turns by π (P − Z) from θ = 0 to π, for P
/// poles of machine and controllers and Z poles of the closed loop outside.
pub(super) struct Winding {
    unstable: f64,
    /// The first two values of ω and det (1 + L), from which m follows.
    first: Option<(f64, Complex<f64>, Turn)>,
    poles: i32,
    /// First and present F, complete turns between them, and true if all values are finite.
    start: Complex<f64>,
    now: Complex<f64>,
    turns: f64,
    is_number: bool,
}

impl Winding {
    pub fn new(plant: &Plant, feedback: &Feedback, drives: usize) -> Self {
        let zero = Complex::ZERO;
        let unstable = (plant.unstable + drives * feedback.unstable()) as f64;
        Self { unstable, first: None, poles: 0, start: zero, now: zero, turns: 0.0, is_number: true }
    }

    /// Continues with the next frequency.
    pub fn go_on(&mut self, omega: f64, difference: Complex<f64>, turn: &Turn) {
        self.is_number &= difference.re.is_finite() && difference.im.is_finite() && difference != Complex::ZERO;
        let Some((w0, begin, at)) = self.first else {
            self.first = Some((omega, difference, *turn));
            return;
        };
        if self.start == Complex::ZERO {
            // |F| ~ ω^−m
            self.poles = -((difference.norm() / begin.norm()).ln() / (omega / w0).ln()).round() as i32;
            self.start = begin * at.lag().powi(self.poles);
            self.now = self.start;
        }
        let (was, is) = (self.now, difference * turn.lag().powi(self.poles));
        // The segment crosses the negative real axis if its ends are on opposite sides of the real axis and by their
        // cross product zero is to the right.
        let cross = was.re * is.im - is.re * was.im;
        match (was.im < 0.0, is.im < 0.0) {
            (false, true) if cross > 0.0 => self.turns += 1.0,
            (true, false) if cross < 0.0 => self.turns -= 1.0,
            _ => {}
        }
        self.now = is;
    }

    /// True if no pole of the closed loop is outside.
    pub fn is_stable(&self) -> bool {
        let arg = |v: Complex<f64>| (v.im + 0.0).atan2(v.re);
        // It begins on the real axis.
        let start = arg(if self.start.re < 0.0 { -self.start } else { self.start });
        let sum = start + arg(self.now) - arg(self.start) + 2.0 * PI * self.turns;
        let outside = self.unstable - (sum / PI).round();
        self.is_number && self.first.is_some() && start.abs() < 0.5 && outside == 0.0
    }
}
