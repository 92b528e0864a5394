//! Steps that may have a peak, kept until it is known how high the others are.

use super::flight::{Moving, TERMS};
use crate::solve::observe::Polynomial;
use crate::solve::roots::{EXTREMUM, only_extremum};

const _: () = assert!(TERMS == EXTREMUM);

/// A step within which a quantity may have its peak.
pub(super) struct Later<const S: usize, const D: usize> {
    /// Numbers of the law and of the inputs, and the slot of the quantity.
    pub(super) law: usize,
    pub(super) held: usize,
    pub(super) slot: usize,
    /// Where it begins, and its length, s.
    pub(super) z: Moving<f64, S, D>,
    pub(super) begin: f64,
    pub(super) length: f64,
    pub(super) part: Part,
    /// A bound of the magnitude.
    pub(super) upper: f64,
}

/// A quantity over a part of a run: values and slopes (over its length) at both ends. It is off their cubic by at most
/// 16 `rest` s² (1 − s)².
#[derive(Clone, Copy)]
pub(super) struct Part {
    pub(super) values: [f64; 2],
    pub(super) slopes: [f64; 2],
    pub(super) rest: f64,
}

impl Part {
    fn inner(&self) -> [f64; 2] {
        [self.values[0] + self.slopes[0] * (1.0 / 3.0), self.values[1] - self.slopes[1] * (1.0 / 3.0)]
    }

    /// A bound of its magnitude between the ends.
    pub(super) fn bound(&self) -> f64 {
        let [a, b] = self.inner();
        a.abs().max(b.abs()) + super::flight::INNER * self.rest
    }

    /// Bounds of its values.
    pub(super) fn range(&self) -> (f64, f64) {
        let ([a, b], [from, to], rest) = (self.inner(), self.values, super::flight::INNER * self.rest);
        (from.min(to).min(a.min(b) - rest), from.max(to).max(a.max(b) + rest))
    }

    fn cubic(&self) -> [f64; 4] {
        let ([a, b], [s, t]) = (self.values, self.slopes);
        [a, s, 3.0 * (b - a) - 2.0 * s - t, s + t - 2.0 * (b - a)]
    }

    /// The largest magnitude of the cubic.
    pub(super) fn highest(&self) -> f64 {
        let [a, s, c2, c3] = self.cubic();
        let at = |x: f64| if x > 0.0 && x < 1.0 { (a + x * (s + x * (c2 + x * c3))).abs() } else { 0.0 };
        let most = self.values[0].abs().max(self.values[1].abs());
        let square = c2 * c2 - 3.0 * c3 * s;
        if square <= 0.0 {
            return most;
        }
        let q = -(c2 + square.sqrt().copysign(c2));
        let (first, second) = (at(s / q), at(q / (3.0 * c3)));
        most.max(first).max(second)
    }

    /// Where the course has its largest magnitude within, and the value there; none if that is at an end.
    pub(super) fn peak(&self, course: &Polynomial<TERMS>) -> Option<(f64, f64)> {
        let [_, _, c2, c3] = self.cubic();
        let (left, right) = (2.0 * c2, 2.0 * c2 + 6.0 * c3);
        // The curvature is off that of the cubic by 32 `rest` at most: of one sign, there is one top.
        let side = if left < 0.0 { 1.0 } else { -1.0 };
        if f64::max(side * left, side * right) < -32.0 * self.rest {
            let [s, t] = self.slopes.map(|slope| side * slope);
            return (s > 0.0 && t < 0.0).then(|| only_extremum(&course.0, side, self.slopes));
        }
        Some(course.largest(0.0, 1.0))
    }
}
