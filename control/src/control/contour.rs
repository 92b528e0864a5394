//! Distances from a path in a plane.

use super::figures::Deviation;
use super::quadrature::{integral, larger};
use crate::golden;
use crate::metrics::Peak;
use crate::signal::arc::Turn;
use crate::signal::profile::{Passage, Profile};
use crate::solve::{Curve, Polynomial, TERMS};
use std::f64::consts::TAU;

/// Maximum number of earlier legs that may be the nearest, since the slides lag their references.
const LEGS_BEHIND: usize = 16;

/// The path that two profiles on one clock describe, leg by leg.
#[derive(Debug, Clone)]
pub(super) struct Contour {
    legs: Vec<Course>,
    /// Its start, m.
    start: [f64; 2],
}

/// A leg of a path.
#[derive(Debug, Clone)]
struct Course {
    /// s
    begin: f64,
    /// m
    from: [f64; 2],
    to: [f64; 2],
    /// For an arc, its first coordinate and the centre of the second.
    arc: Option<(Turn, f64)>,
}

impl Course {
    /// Fraction of the leg nearest to a point, within 0..1 unless that is an end, and the point's distance from the
    /// complete line or circle, m, positive to the left.
    fn beside(&self, point: [f64; 2]) -> (f64, f64) {
        let Some((turn, center)) = &self.arc else {
            let away = |point: [f64; 2]| [point[0] - self.from[0], point[1] - self.from[1]];
            let (along, off) = (away(self.to), away(point));
            let length = along[0].hypot(along[1]);
            let share = (along[0] * off[0] + along[1] * off[1]) / (length * length);
            return (share, (along[0] * off[1] - along[1] * off[0]) / length);
        };
        let off = [point[0] - turn.center, point[1] - center];
        let sense = turn.per_length.signum();
        // Angle from the beginning, in the sense of the arc, from 0 to one turn.
        let angle = (sense * (off[1].atan2(off[0]) - turn.phase)).rem_euclid(TAU);
        // The centre is to the left of a counterclockwise arc.
        (angle * turn.radius / turn.length, sense * (turn.radius - off[0].hypot(off[1])))
    }
}

impl Contour {
    /// Path of two profiles, without their shapers; none for another number of profiles.
    pub fn along(profiles: &[Profile]) -> Option<Self> {
        let [x, y] = profiles else { return None };
        let leg = |(x, y): (&Passage, &Passage)| Course {
            begin: x.begin,
            from: [x.from, y.from],
            to: [x.to, y.to],
            arc: x.turn.zip(y.turn.map(|turn| turn.center)),
        };
        let legs = x.passages().iter().zip(y.passages()).map(leg);
        let legs = legs.filter(|leg| leg.arc.is_some() || leg.from != leg.to).collect();
        Some(Self { legs, start: [x.start(), y.start()] })
    }

    /// Distance of a point from the path at `time`, s, positive to the left; the index of the nearest leg, and true if
    /// its nearest point is not an end.
    pub fn nearest(&self, time: f64, point: [f64; 2]) -> (f64, Option<usize>, bool) {
        let now = self.legs.partition_point(|leg| leg.begin <= time);
        let legs = now.saturating_sub(LEGS_BEHIND)..(now + 1).min(self.legs.len());
        let mut best = (f64::INFINITY, None, false);
        for number in legs {
            let leg = &self.legs[number];
            let (share, left) = leg.beside(point);
            let is_beside = (0.0..=1.0).contains(&share);
            let far = |end: [f64; 2]| (point[0] - end[0]).hypot(point[1] - end[1]);
            let distance = match (is_beside, &leg.arc) {
                (true, _) => left,
                (false, None) => far(if share > 1.0 { leg.to } else { leg.from }).copysign(left),
                (false, Some(_)) => far(leg.to).min(far(leg.from)).copysign(left),
            };
            if distance.abs() < best.0.abs() {
                best = (distance, Some(number), is_beside);
            }
        }
        match best {
            (_, None, _) => ((point[0] - self.start[0]).hypot(point[1] - self.start[1]), None, false),
            best => best,
        }
    }

    /// Distance from a straight leg of a point that moves along these polynomials; none for an arc.
    fn beside(&self, leg: usize, places: &[Polynomial]) -> Option<Polynomial> {
        let Course { from, to, arc: None, .. } = self.legs[leg] else { return None };
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].hypot(along[1]);
        // n·(q − from), n to the left of the leg
        let normal = [-along[1] / length, along[0] / length];
        let mut sum = [0.0; TERMS];
        for (k, term) in sum.iter_mut().enumerate() {
            *term = normal[0] * places[0].0[k] + normal[1] * places[1].0[k];
        }
        sum[0] -= normal[0] * from[0] + normal[1] * from[1];
        Some(Polynomial(sum))
    }
}

/// Gathers the distance from a path.
pub(super) struct ContourGauge {
    path: Contour,
    seen: Deviation,
    /// ∫ of its square.
    square: f64,
}

/// Number of points on 0..1 at which the nearest leg is determined.
const PLACES: usize = 9;

/// A point within this fraction of the largest distance so far may hide a larger one beside it.
const NEAR: f64 = 0.05;

/// Steps of the golden section.
const STEPS: usize = 40;

impl ContourGauge {
    pub fn new(path: Contour) -> Self {
        Self { path, seen: Deviation::default(), square: 0.0 }
    }

    /// Adds the motion on a part of a curve; exact if one straight leg is the nearest on all of it.
    pub fn track(&mut self, curve: &Curve, part: (f64, f64), places: &[Polynomial]) {
        let time = |s: f64| curve.begin + s * curve.length;
        let at = |s: f64| self.path.nearest(time(s), [places[0].at(s), places[1].at(s)]);
        let spread = |k: usize| part.0 + (part.1 - part.0) * k as f64 / (PLACES - 1) as f64;
        let seen: [_; PLACES] = std::array::from_fn(|k| at(spread(k)));
        let (_, leg, _) = seen[0];
        let same = seen.iter().all(|&(_, other, is_beside)| is_beside && other == leg);
        if let Some(distance) = leg.filter(|_| same).and_then(|leg| self.path.beside(leg, places)) {
            self.square += curve.length * integral(part, |s| distance.at(s).powi(2));
            larger(&mut self.seen.peak, &distance, part, curve);
            return;
        }
        self.square += curve.length * integral(part, |s| at(s).0.powi(2));
        let size = |k: usize| seen[k].0.abs();
        let Some(most) = (0..PLACES).max_by(|a, b| size(*a).total_cmp(&size(*b))) else { return };
        if size(most) > (1.0 - NEAR) * self.seen.peak.value.abs() {
            let between = [most.saturating_sub(1), (most + 1).min(PLACES - 1)].map(spread);
            let s = golden::top(between, STEPS, |s| at(s).0.abs());
            let value = if at(s).0.abs() > size(most) { at(s).0 } else { seen[most].0 };
            if value.abs() > self.seen.peak.value.abs() {
                self.seen.peak = Peak { value, time: time(s) };
            }
        }
    }

    /// The run has ended there.
    pub fn end(&mut self, time: f64, point: [f64; 2]) {
        self.seen.last = self.path.nearest(time, point).0;
    }

    /// Contour error of a run that ended at `end`, s.
    pub fn finish(mut self, end: f64) -> Deviation {
        self.seen.rms = (self.square / end.max(f64::MIN_POSITIVE)).sqrt();
        self.seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::arc::Arc;
    use crate::signal::profile::{Leg, Limits};

    /// 100 mm along, then 50 mm across.
    fn corner() -> Contour {
        let limits = Limits { speed: 0.5, acceleration: 5.0, jerk: None, snap: None };
        let legs = [Leg::To(vec![0.1, 0.0], limits), Leg::To(vec![0.1, 0.05], limits)];
        Contour::along(&Profile::along(&[0.0, 0.0], &legs).unwrap()).unwrap()
    }

    #[test]
    fn distances_are_those_of_the_nearest_point() {
        let path = corner();
        let (distance, leg, is_beside) = path.nearest(0.05, [0.03, 0.002]);
        assert_eq!((leg, is_beside), (Some(0), true));
        assert!((distance - 0.002).abs() < 1e-15);
        // Beyond the corner, which it cuts to the right of neither leg.
        let (distance, ..) = path.nearest(10.0, [0.103, -0.004]);
        assert!((distance.abs() - 0.005).abs() < 1e-15);
        // Behind its reference, the cart is still on the first leg.
        let (distance, leg, _) = path.nearest(10.0, [0.05, 0.0]);
        assert_eq!((distance, leg), (0.0, Some(0)));
    }

    #[test]
    fn a_path_without_legs_is_its_start() {
        let still = Profile::new(0.25, &[Leg::Wait(1.0)]).unwrap();
        let path = Contour::along(&[still.clone(), still.clone()]).unwrap();
        assert_eq!(path.nearest(0.5, [0.25, 0.35]).0, 0.35 - 0.25);
        assert!(Contour::along(&[still]).is_none());
    }

    /// Compares with the nearest of many points of the path.
    #[test]
    fn distances_from_arcs_are_those_of_the_nearest_point() {
        let limits = Limits { speed: 0.5, acceleration: 5.0, jerk: None, snap: None };
        let arc = |to, clockwise| Leg::Around(Arc { to, center: [0.0, 0.0], clockwise }, limits);
        // Three quarters to the left, a line, a whole circle to the right.
        let legs = [arc([0.0, -0.01], false), Leg::To(vec![0.0, -0.02], limits), arc([0.0, -0.02], true)];
        let profiles = Profile::along(&[0.01, 0.0], &legs).unwrap();
        let path = Contour::along(&profiles).unwrap();
        let points: Vec<[f64; 2]> = (0..=200_000)
            .map(|k| profiles[0].end() * f64::from(k) / 2e5)
            .map(|t| [profiles[0].at(t).position, profiles[1].at(t).position])
            .collect();
        for k in 0..60 {
            let angle = 0.7 * f64::from(k);
            let far = 0.004 + 0.0005 * f64::from(k);
            let point = [far * angle.cos(), far * angle.sin()];
            let least = points.iter().map(|p| (p[0] - point[0]).hypot(p[1] - point[1])).fold(f64::MAX, f64::min);
            let (distance, ..) = path.nearest(10.0, point);
            // The points are up to 1 µm apart.
            assert!((-1e-12..1e-6).contains(&(least - distance.abs())), "{point:?}: {distance} {least}");
        }
        // Inside a counterclockwise circle is to the left of it, inside a clockwise one to the right.
        assert!(path.nearest(0.0, [0.0, 0.009]).0 > 0.0 && path.nearest(10.0, [0.0, 0.019]).0 < 0.0);
    }
}
