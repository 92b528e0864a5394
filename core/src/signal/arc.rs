//! Circular arcs of a path in the plane of two coordinates.
//!
//! With s(t) the length gone along a circle of radius R about c, each coordinate is
//!
//! ```text
//! x(t) = c + R cos(φ + κ s(t)),  κ = ±1/R
//! ```
//!
//! φ being the angle at which it begins, less a quarter of a turn for the second coordinate.

use super::reference::{Limits, Reference};
use crate::error::{Error, Result};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// An arc of a circle from where a path is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Its end, m; of a whole turn where it begins.
    pub to: [f64; 2],
    /// Its centre, m.
    pub center: [f64; 2],
    /// Its sense, with the first coordinate to the right and the second upward.
    pub clockwise: bool,
}

/// Largest difference of the radii at both ends, m, or as a share of them: what a file with three or four digits
/// leaves.
const UNLIKE: (f64, f64) = (1e-5, 1e-3);

/// Error of the polynomials that an arc is taken for between two seams, m.
const ERROR: f64 = 1e-13;

/// A circle, and the part of it that an arc covers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Circle {
    center: [f64; 2],
    radius: f64,
    /// Angle of its beginning, rad, and the turn from there to its end, above zero counterclockwise.
    begin: f64,
    turn: f64,
}

impl Arc {
    /// The circle of this arc from a point. The centre is moved onto the line that is as far from both ends.
    pub(super) fn circle(&self, from: [f64; 2]) -> Result<Circle> {
        let away = |point: [f64; 2], from: [f64; 2]| [point[0] - from[0], point[1] - from[1]];
        let length = |[x, y]: [f64; 2]| f64::hypot(x, y);
        let radii = [from, self.to].map(|end| length(away(end, self.center)));
        let most = radii[0].max(radii[1]);
        let finite = from.iter().chain(&self.to).chain(&self.center).all(|x| x.is_finite() && x.abs() <= 1e9);
        if !finite || radii.contains(&0.0) {
            return Err(Error::new("an arc about one of its own ends").allowed("a centre away from both ends"));
        }
        if (radii[0] - radii[1]).abs() > UNLIKE.0.max(UNLIKE.1 * most) {
            return Err(Error::new(format!(
                "the centre of the arc is {:.6} mm from its beginning and {:.6} mm from its end",
                1e3 * radii[0],
                1e3 * radii[1]
            ))
            .allowed("radii that differ by at most 0.01 mm or 0.1 %")
            .next("correct the centre or the end of the arc"));
        }
        let chord = away(self.to, from);
        let center = match length(chord) {
            0.0 => self.center,
            far => {
                let middle = [0.5 * (from[0] + self.to[0]), 0.5 * (from[1] + self.to[1])];
                let normal = [-chord[1] / far, chord[0] / far];
                let off = away(self.center, middle);
                let along = normal[0] * off[0] + normal[1] * off[1];
                [middle[0] + along * normal[0], middle[1] + along * normal[1]]
            }
        };
        let angle = |point: [f64; 2]| {
            let [x, y] = away(point, center);
            y.atan2(x)
        };
        let (begin, end) = (angle(from), angle(self.to));
        let sense = if self.clockwise { -1.0 } else { 1.0 };
        let turn = match (sense * (end - begin)).rem_euclid(TAU) {
            // To where it begins: a whole turn.
            0.0 => TAU,
            turn => turn,
        };
        Ok(Circle { center, radius: length(away(from, center)), begin, turn: sense * turn })
    }
}

impl Circle {
    /// Length of the arc, m.
    pub fn length(&self) -> f64 {
        self.radius * self.turn.abs()
    }

    /// Limits along the arc with a speed at which it also keeps them across: v²/R, v³/R² and v⁴/R³.
    pub fn within(&self, limits: &Limits) -> Limits {
        let r = self.radius;
        let of_jerk = limits.jerk.map(|jerk| (jerk * r * r).cbrt());
        let of_snap = limits.snap.map(|snap| (snap * r * r * r).sqrt().sqrt());
        let across = [Some((limits.acceleration * r).sqrt()), of_jerk, of_snap];
        Limits { speed: across.into_iter().flatten().fold(limits.speed, f64::min), ..*limits }
    }

    /// One coordinate along it, within these limits.
    pub fn coordinate(&self, k: usize, limits: &Limits) -> Turn {
        let per_length = 1.0_f64.copysign(self.turn) / self.radius;
        let quarter = if k == 0 { 0.0 } else { FRAC_PI_2 };
        let mut turn = Turn {
            center: self.center[k],
            radius: self.radius,
            phase: self.begin - quarter,
            per_length,
            length: self.length(),
            step: 0.0,
        };
        turn.step = turn.longest_piece(limits);
        turn
    }
}

/// One coordinate of an arc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// Of the circle, m.
    pub center: f64,
    /// m
    pub radius: f64,
    /// Angle at the beginning, rad; the coordinate is `center` + `radius` cos(angle).
    pub phase: f64,
    /// Angle per length, ±1/R, rad/m; above zero counterclockwise.
    pub per_length: f64,
    /// Length of the arc, m.
    pub length: f64,
    /// The longest that a polynomial of fourth degree stands for it, s.
    step: f64,
}

impl Turn {
    /// Position and derivatives where the length gone, m, and its derivatives are `gone`.
    pub fn at(&self, gone: &Reference) -> Reference {
        let (sin, cos) = (self.phase + self.per_length * gone.position).sin_cos();
        let (r, k) = (self.radius, self.per_length);
        // Derivatives by the length.
        let [f1, f2, f3, f4] = [-r * k * sin, -r * k * k * cos, r * k * k * k * sin, r * k * k * k * k * cos];
        let [s1, s2, s3, s4] = [gone.speed, gone.acceleration, gone.jerk, gone.snap];
        // Faà di Bruno's formula.
        Reference {
            position: self.center + r * cos,
            speed: f1 * s1,
            acceleration: f2 * s1 * s1 + f1 * s2,
            jerk: f3 * s1 * s1 * s1 + 3.0 * f2 * s1 * s2 + f1 * s3,
            snap: f4 * s1.powi(4) + 6.0 * f3 * s1 * s1 * s2 + f2 * (4.0 * s1 * s3 + 3.0 * s2 * s2) + f1 * s4,
        }
    }

    /// How long a Taylor polynomial of fourth degree from some time on is right, s: |x⁽⁵⁾| h⁵/5! ≤ the error.
    pub(super) fn step(&self) -> f64 {
        self.step
    }

    fn longest_piece(&self, limits: &Limits) -> f64 {
        let k = self.per_length.abs();
        let [w1, w2] = [k * limits.speed, k * limits.acceleration];
        let [w3, w4] = [limits.jerk, limits.snap].map(|limit| k * limit.unwrap_or(0.0));
        // Bell's polynomial of five: what a cosine of a polynomial has at most as its fifth derivative.
        let fifth = self.radius
            * (w1.powi(5)
                + 10.0 * w1.powi(3) * w2
                + 15.0 * w1 * w2 * w2
                + 10.0 * w1 * w1 * w3
                + 10.0 * w2 * w3
                + 5.0 * w1 * w4);
        (120.0 * ERROR / fifth).powf(0.2)
    }

    /// The smallest and the largest value on the arc, m.
    pub fn extremes(&self) -> [f64; 2] {
        let ends = [self.phase, self.phase + self.per_length * self.length];
        let values = ends.map(|angle| self.radius * angle.cos());
        let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        // True if the angle or a whole number of turns from it lies within.
        let passes = |angle: f64| angle + TAU * ((low - angle) / TAU).ceil() <= high;
        let least = if passes(PI) { -self.radius } else { values[0].min(values[1]) };
        let most = if passes(0.0) { self.radius } else { values[0].max(values[1]) };
        [self.center + least, self.center + most]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::uniform;
    use crate::signal::profile::{Leg, Profile};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    const NO_JERK: Limits = Limits { speed: 0.2, acceleration: 4.0, jerk: None, snap: None };

    /// A drawn arc from where it begins, its radius, and limits of any order.
    fn drawn(random: &mut Pcg64) -> ([f64; 2], Arc, f64, Limits) {
        let mut draw = |low: f64, high: f64| low + (high - low) * uniform(random);
        let radius = 10f64.powf(draw(-3.0, -0.5));
        let center = [draw(-0.2, 0.2), draw(-0.2, 0.2)];
        let [begin, end] = [draw(0.0, TAU), draw(0.0, TAU)];
        let on = |angle: f64| [center[0] + radius * angle.cos(), center[1] + radius * angle.sin()];
        let is_whole = draw(0.0, 1.0) < 0.2;
        let arc = Arc { to: if is_whole { on(begin) } else { on(end) }, center, clockwise: draw(0.0, 1.0) < 0.5 };
        let jerk = (draw(0.0, 1.0) < 0.7).then(|| draw(50.0, 500.0));
        let snap = jerk.filter(|_| draw(0.0, 1.0) < 0.5).map(|jerk| 100.0 * jerk);
        (on(begin), arc, radius, Limits { speed: draw(0.01, 1.0), acceleration: draw(0.5, 20.0), jerk, snap })
    }

    #[test]
    fn an_arc_stays_on_its_circle_within_its_limits() {
        let mut random = Pcg64::seed_from_u64(33);
        for _ in 0..300 {
            let (from, arc, radius, limits) = drawn(&mut random);
            let path = Profile::along(&from, &[Leg::Around(arc, limits)]).unwrap();
            let end = path[0].end();
            let at = |t: f64| [path[0].at(t), path[1].at(t)];
            assert_eq!(at(end).map(|reference| reference.position), arc.to);
            let (mut turned, mut last) = (0.0, (from[1] - arc.center[1]).atan2(from[0] - arc.center[0]));
            for k in 1..=400 {
                let [x, y] = at(end * f64::from(k) / 400.0);
                let off = [x.position - arc.center[0], y.position - arc.center[1]];
                assert!((off[0].hypot(off[1]) - radius).abs() < 1e-14);
                let speed = x.speed.hypot(y.speed);
                assert!(speed <= limits.speed * (1.0 + 1e-9));
                assert!(speed * speed / radius <= limits.acceleration * (1.0 + 1e-9));
                let along = (x.speed * x.acceleration + y.speed * y.acceleration) / speed.max(1e-12);
                assert!(along.abs() <= limits.acceleration * (1.0 + 1e-9));
                let angle = off[1].atan2(off[0]);
                turned += (angle - last + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
                last = angle;
            }
            assert!(turned == 0.0 || (turned < 0.0) == arc.clockwise);
            for (k, profile) in path.iter().enumerate() {
                let [low, high] = profile.passages()[0].extremes();
                let seen = (0..=4000).map(|i| profile.at(end * f64::from(i) / 4000.0).position);
                let (least, most) = seen.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
                assert!(low <= least + 1e-15 && most <= high + 1e-15, "{k}: {low} {least} {most} {high}");
                assert!(least - low < 1e-4 * radius && high - most < 1e-4 * radius);
            }
        }
    }

    #[test]
    fn polynomials_are_the_arc_to_the_stated_error() {
        let mut random = Pcg64::seed_from_u64(34);
        for _ in 0..100 {
            let (from, arc, _, limits) = drawn(&mut random);
            let path = Profile::along(&from, &[Leg::Around(arc, limits)]).unwrap();
            for profile in &path {
                let (mut time, mut pieces) = (0.0, 0);
                while time < profile.end() {
                    let (c, until) = profile.piece(time);
                    assert!(until > time);
                    for share in [0.3, 0.9999] {
                        let h = share * (until.min(profile.end()) - time);
                        let value = c[0] + h * (c[1] + h * (c[2] + h * (c[3] + h * c[4])));
                        let off = (value - profile.at(time + h).position).abs();
                        assert!(off < 2.0 * ERROR, "{off:e} m after {h:e} s of {}: {arc:?} {limits:?}", until - time);
                    }
                    (time, pieces) = (until, pieces + 1);
                }
                assert!(pieces < 200_000, "{pieces}");
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_position() {
        let arc = Arc { to: [0.0, 0.02], center: [0.0, 0.0], clockwise: false };
        let limits = Limits { jerk: Some(200.0), snap: Some(2e4), ..NO_JERK };
        let path = Profile::along(&[0.02, 0.0], &[Leg::Around(arc, limits)]).unwrap();
        let h = 1e-5;
        for k in 1..50 {
            let t = path[0].end() * f64::from(k) / 50.3;
            for profile in &path {
                let [before, now, after] = [t - h, t, t + h].map(|t| profile.at(t));
                let slope = |of: fn(&Reference) -> f64| (of(&after) - of(&before)) / (2.0 * h);
                assert!((slope(|r| r.position) - now.speed).abs() < 1e-7);
                assert!((slope(|r| r.speed) - now.acceleration).abs() < 1e-4);
                assert!((slope(|r| r.acceleration) - now.jerk).abs() < 0.3);
            }
        }
    }

    #[test]
    fn the_centre_of_rounded_numbers_is_moved_and_a_wrong_one_refused() {
        let arc = Arc { to: [0.0, 0.01], center: [0.000_003, -0.000_002], clockwise: false };
        let path = Profile::along(&[0.01, 0.0], &[Leg::Around(arc, NO_JERK)]).unwrap();
        let turn = path[0].passages()[0].turn.unwrap();
        let middle = Profile::at(&path[1], 0.5 * path[1].end()).position;
        assert!((turn.length - TAU / 4.0 * 0.01).abs() < 1e-5 && (middle - 0.01 / 2f64.sqrt()).abs() < 1e-5);
        let wrong = Arc { center: [0.002, 0.0], ..arc };
        let error = Profile::along(&[0.01, 0.0], &[Leg::Around(wrong, NO_JERK)]).unwrap_err();
        assert!(error.what.contains("8.000000 mm from its beginning and 10.198039 mm"), "{}", error.what);
        let none = Arc { center: [0.01, 0.0], ..arc };
        assert!(Profile::along(&[0.01, 0.0], &[Leg::Around(none, NO_JERK)]).is_err());
        assert!(Profile::new(0.01, &[Leg::Around(arc, NO_JERK)]).is_err());
    }
}
