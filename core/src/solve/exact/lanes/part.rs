//! A quantity within a step, by its ends.

use crate::solve::polynomial::Polynomial;
use crate::solve::roots::only_extremum;

/// Terms of a series.
pub(super) const TERMS: usize = 20;

/// 16 s² (1 − s)² ≤ 4/3 (B₁ + B₂) ≤ 16/3 B₂ with Bernstein's cubics: by how much a rest moves inner control points, in
/// units of it.
pub(super) const INNER: f64 = 4.0 / 3.0;

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
        a.abs().max(b.abs()) + INNER * self.rest
    }

    fn cubic(&self) -> [f64; 4] {
        let ([a, b], [s, t]) = (self.values, self.slopes);
        [a, s, 3.0 * (b - a) - 2.0 * s - t, s + t - 2.0 * (b - a)]
    }

    /// The least and the greatest value of the cubic.
    fn extremes(&self) -> (f64, f64) {
        let [a, s, c2, c3] = self.cubic();
        let [from, to] = self.values;
        let (mut least, mut greatest) = (from.min(to), from.max(to));
        let square = c2 * c2 - 3.0 * c3 * s;
        if square > 0.0 {
            let q = -(c2 + square.sqrt().copysign(c2));
            for x in [s / q, q / (3.0 * c3)] {
                if x > 0.0 && x < 1.0 {
                    let value = a + x * (s + x * (c2 + x * c3));
                    (least, greatest) = (least.min(value), greatest.max(value));
                }
            }
        }
        (least, greatest)
    }

    /// The largest magnitude of the cubic.
    pub(super) fn highest(&self) -> f64 {
        let (least, greatest) = self.extremes();
        greatest.max(-least)
    }

    /// True if it certainly rises or falls throughout: its slope is off that of the cubic by 3.1 `rest` at most.
    pub(super) fn is_monotone(&self) -> bool {
        let ([a, b], [s, t]) = (self.values, self.slopes);
        let middle = 3.0 * (b - a) - s - t;
        let (least, greatest) = (s.min(t).min(middle), s.max(t).max(middle));
        least > 3.2 * self.rest || greatest < -3.2 * self.rest
    }

    /// The sign of its curvature, which is off that of the cubic by 32 `rest` at most; zero if that is not certain.
    fn bends(&self) -> f64 {
        let [_, _, c2, c3] = self.cubic();
        let (left, right) = (2.0 * c2, 2.0 * c2 + 6.0 * c3);
        match () {
            () if left.min(right) > 32.0 * self.rest => 1.0,
            () if left.max(right) < -32.0 * self.rest => -1.0,
            () => 0.0,
        }
    }

    /// True if it certainly passes zero once, from above.
    pub(super) fn falls_once(&self) -> bool {
        self.values[0] > 0.0 && self.values[1] < 0.0 && (self.is_monotone() || self.bends() != 0.0)
    }

    /// Bounds of its values.
    pub(super) fn range(&self) -> (f64, f64) {
        if self.is_monotone() {
            let [from, to] = self.values;
            return (from.min(to), from.max(to));
        }
        let (least, greatest) = self.extremes();
        (least - self.rest, greatest + self.rest)
    }

    /// Where the course has its largest magnitude within, and the value there; none if that is at an end.
    pub(super) fn peak(&self, course: &Polynomial<TERMS>) -> Option<(f64, f64)> {
        // With a curvature of one sign, there is one top.
        let side = -self.bends();
        if side != 0.0 {
            let [s, t] = self.slopes.map(|slope| side * slope);
            return (s > 0.0 && t < 0.0).then(|| only_extremum(&course.0, side, self.slopes));
        }
        Some(course.largest(0.0, 1.0))
    }

    /// The least and the greatest value of the course from a fraction of the part on.
    pub(super) fn extremes_from(&self, course: &Polynomial<TERMS>, from: f64) -> (f64, f64) {
        let side = -self.bends();
        if side == 0.0 && !self.is_monotone() {
            return course.extremes(from, 1.0);
        }
        let (begin, end) = (if from > 0.0 { course.at(from) } else { self.values[0] }, self.values[1]);
        let (least, greatest) = (begin.min(end), begin.max(end));
        let [s, t] = self.slopes.map(|slope| side * slope);
        if !(s > 0.0 && t < 0.0) {
            return (least, greatest);
        }
        match only_extremum(&course.0, side, self.slopes) {
            (place, top) if place > from => (least.min(top), greatest.max(top)),
            _ => (least, greatest),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// f = 2 − 7 s + 4 s² + 3 s³ in Bernstein's form: the middle is (f(0) + 3 a + 3 b + f(1))/8.
    #[test]
    fn inner_coefficients_are_those_of_the_cubic() {
        let part = Part { values: [2.0, 2.0], slopes: [-7.0, 10.0], rest: 0.0 };
        assert_eq!(part.cubic(), [2.0, -7.0, 4.0, 3.0]);
        let [a, b] = part.inner();
        assert!((a + 1.0 / 3.0).abs() < 1e-15 && (b + 4.0 / 3.0).abs() < 1e-15, "{a} {b}");
        assert!((0.125 * (2.0 + 3.0 * a + 3.0 * b + 2.0) - (2.0 - 3.5 + 1.0 + 0.375)).abs() < 1e-15);
        // Convex at 0 and beyond.
        assert_eq!(part.bends(), 1.0);
    }
}
