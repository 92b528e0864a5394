//! Distances from a path in a plane.

use super::figures::Deviation;
use super::quadrature::larger;
use crate::golden;
use crate::metrics::Peak;
use crate::signal::arc::Turn;
use crate::signal::profile::{Passage, Profile};
use crate::solve::{Curve, Polynomial, TERMS, integral};
use std::f64::consts::TAU;

/// Along the path, the nearest point of a slide is at most this many times its largest distance from the profiles,
/// without shaper, away from them: on a half circle π/2 times, around a right angle √2 times.
const LAG: f64 = 2.0;

/// The same, least, m.
const LEAST: f64 = 1e-9;

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
    /// The coordinate that moves farther.
    passage: Passage,
    /// Length of the path up to it, and its own, m.
    before: f64,
    length: f64,
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

    /// The point at this fraction of the leg, m.
    fn at(&self, share: f64) -> [f64; 2] {
        match &self.arc {
            None => std::array::from_fn(|k| self.from[k] + share * (self.to[k] - self.from[k])),
            Some((turn, center)) => {
                let angle = turn.phase + turn.per_length * share * turn.length;
                [turn.center + turn.radius * angle.cos(), center + turn.radius * angle.sin()]
            }
        }
    }

    /// Nearest point of the part of the leg between two fractions.
    fn nearest(&self, point: [f64; 2], [least, most]: [f64; 2]) -> Foot {
        let (share, left) = self.beside(point);
        let is_beside = (least..=most).contains(&share);
        let far = |share: f64| far(point, self.at(share));
        let distance = match is_beside {
            true => left,
            false => far(least).min(far(most)).copysign(left),
        };
        Foot { distance, leg: None, is_beside }
    }
}

/// The point of a path nearest to another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Foot {
    /// Distance of the other point, m, positive to the left.
    pub distance: f64,
    /// Index of its leg, if there is one.
    leg: Option<usize>,
    /// True if it is no end of the part of the leg that may be the nearest.
    is_beside: bool,
}

impl Contour {
    /// Path of two profiles, without their shapers; none for another number of profiles.
    pub fn along(profiles: &[Profile]) -> Option<Self> {
        let [x, y] = profiles else { return None };
        let mut before = 0.0;
        let leg = |(x, y): (&Passage, &Passage)| {
            let (from, to) = ([x.from, y.from], [x.to, y.to]);
            let arc = x.turn.zip(y.turn.map(|turn| turn.center));
            let length = arc.map_or((to[0] - from[0]).hypot(to[1] - from[1]), |(turn, _)| turn.length);
            let is_x = arc.is_some() || (x.to - x.from).abs() >= (y.to - y.from).abs();
            let passage = if is_x { x.clone() } else { y.clone() };
            let course = Course { begin: x.begin, passage, before, length, from, to, arc };
            before += length;
            course
        };
        let legs = x.passages().iter().zip(y.passages()).map(leg);
        let legs = legs.filter(|leg| leg.arc.is_some() || leg.from != leg.to).collect();
        Some(Self { legs, start: [x.start(), y.start()] })
    }

    /// Nearest point of the path at `time`, s, between two lengths along it, m.
    fn nearest(&self, time: f64, point: [f64; 2], [least, most]: [f64; 2]) -> Foot {
        // None is reached before its time, but that of the next leg at its corner.
        let now = self.legs.partition_point(|leg| leg.begin <= time);
        let first = self.legs.partition_point(|leg| leg.before + leg.length < least);
        let last = self.legs.partition_point(|leg| leg.before <= most).min(now + 1).min(self.legs.len());
        let mut best: Option<Foot> = None;
        for (number, leg) in self.legs.iter().enumerate().take(last).skip(first.min(last.saturating_sub(1))) {
            let share = |along: f64| ((along - leg.before) / leg.length).clamp(0.0, 1.0);
            let foot = Foot { leg: Some(number), ..leg.nearest(point, [share(least), share(most)]) };
            if best.is_none_or(|best| foot.distance.abs() < best.distance.abs()) {
                best = Some(foot);
            }
        }
        best.unwrap_or(Foot { distance: far(point, self.start), leg: None, is_beside: false })
    }

    /// Where the profiles are at `time`, s, and the length of the path up to there, m.
    fn reached(&self, time: f64) -> ([f64; 2], f64) {
        let now = self.legs.partition_point(|leg| leg.begin <= time);
        let leg = now.checked_sub(1).map(|number| &self.legs[number]);
        leg.map_or((self.start, 0.0), |leg| {
            let share = leg.passage.share(time);
            (leg.at(share), leg.before + share * leg.length)
        })
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

/// Follows a point along a path: other parts of the path that pass nearby (lines of a hatching, crossings) do not
/// count.
pub(super) struct Follower {
    path: Contour,
    /// Largest distance from the profiles so far, m.
    lag: f64,
}

impl Follower {
    pub fn new(path: Contour) -> Self {
        Self { path, lag: 0.0 }
    }

    /// Nearest point of the path at `time`, s.
    pub fn nearest(&self, time: f64, point: [f64; 2]) -> Foot {
        let (reference, along) = self.path.reached(time);
        let reach = LAG * self.lag.max(far(point, reference)) + LEAST;
        self.path.nearest(time, point, [along - reach, along + reach])
    }

    /// The same; the point has come there.
    pub fn follow(&mut self, time: f64, point: [f64; 2]) -> Foot {
        self.lag = self.lag.max(far(point, self.path.reached(time).0));
        self.nearest(time, point)
    }
}

/// Distance between two points, m.
fn far(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Gathers the distance from a path.
pub(super) struct ContourGauge {
    follower: Follower,
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
        Self { follower: Follower::new(path), seen: Deviation::default(), square: 0.0 }
    }

    /// Adds the motion on a part of a curve; exact if one straight leg is the nearest on all of it.
    pub fn track(&mut self, curve: &Curve, part: (f64, f64), places: &[Polynomial]) {
        let time = |s: f64| curve.begin + s * curve.length;
        let point = |s: f64| [places[0].at(s), places[1].at(s)];
        let follower = &self.follower;
        let at = |s: f64| follower.nearest(time(s), point(s));
        let spread = |k: usize| part.0 + (part.1 - part.0) * k as f64 / (PLACES - 1) as f64;
        let seen: [_; PLACES] = std::array::from_fn(|k| at(spread(k)));
        let leg = seen[0].leg;
        let same = seen.iter().all(|foot| foot.is_beside && foot.leg == leg);
        if let Some(distance) = leg.filter(|_| same).and_then(|leg| follower.path.beside(leg, places)) {
            self.square += curve.length * integral(part, |s| distance.at(s).powi(2));
            larger(&mut self.seen.peak, &distance, part, curve);
        } else {
            self.square += curve.length * integral(part, |s| at(s).distance.powi(2));
            let size = |k: usize| seen[k].distance.abs();
            let most = (1..PLACES).fold(0, |most, k| if size(k) > size(most) { k } else { most });
            if size(most) > (1.0 - NEAR) * self.seen.peak.value.abs() {
                let between = [most.saturating_sub(1), (most + 1).min(PLACES - 1)].map(spread);
                let s = golden::top(between, STEPS, |s| at(s).distance.abs());
                let value = if at(s).distance.abs() > size(most) { at(s).distance } else { seen[most].distance };
                if value.abs() > self.seen.peak.value.abs() {
                    self.seen.peak = Peak { value, time: time(s) };
                }
            }
        }
        self.follower.follow(time(part.1), point(part.1));
    }

    /// The run has ended there.
    pub fn end(&mut self, time: f64, point: [f64; 2]) {
        self.seen.last = self.follower.follow(time, point).distance;
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

    /// All of a path.
    const WHOLE: [f64; 2] = [0.0, f64::INFINITY];

    #[test]
    fn distances_are_those_of_the_nearest_point() {
        let path = corner();
        let foot = path.nearest(0.05, [0.03, 0.002], WHOLE);
        assert_eq!((foot.leg, foot.is_beside), (Some(0), true));
        assert!((foot.distance - 0.002).abs() < 1e-15);
        // Beyond the corner, which it cuts to the right of neither leg.
        let foot = path.nearest(10.0, [0.103, -0.004], WHOLE);
        assert!((foot.distance.abs() - 0.005).abs() < 1e-15);
        // Behind its reference, the cart is still on the first leg.
        let foot = path.nearest(10.0, [0.05, 0.0], WHOLE);
        assert_eq!((foot.distance, foot.leg), (0.0, Some(0)));
    }

    #[test]
    fn the_distance_at_the_end_is_that_of_the_last_point() {
        let mut gauge = ContourGauge::new(corner());
        gauge.end(10.0, [0.097, 0.05]);
        // To the left of the second leg.
        assert!((gauge.finish(10.0).last - 0.003).abs() < 1e-15);
    }

    /// Two lines there and back, closer to each other than the cart is to its own: it lags, deviates and swings.
    #[test]
    fn lines_that_were_left_do_not_count() {
        let limits = Limits { speed: 0.5, acceleration: 5.0, jerk: None, snap: None };
        for spacing in [2e-5, 1e-4, 3e-4, 2e-3] {
            let legs = [[0.05, 0.0], [0.05, spacing], [0.0, spacing]].map(|to| Leg::To(to.to_vec(), limits));
            let profiles = Profile::along(&[0.0, 0.0], &legs).unwrap();
            let mut follower = Follower::new(Contour::along(&profiles).unwrap());
            let back = profiles[0].passages()[2].begin;
            for k in 0..=10_000 {
                let time = profiles[0].end() * f64::from(k) / 1e4;
                let at = |time: f64| profiles.iter().map(|profile| profile.at(time).position).collect::<Vec<_>>();
                let lagging = at(time - 2e-3);
                let wave = 4e-4 * (300.0 * time).sin();
                let point = [lagging[0], lagging[1] + wave];
                let foot = follower.follow(time, point);
                // To the left of the way back is down.
                let way = [lagging[0], 0.05 - lagging[0]].into_iter().fold(f64::MAX, f64::min);
                let (on_first, on_last) = (time < back, time > back + 2e-3);
                if way > 4e-3 && (on_first || on_last) {
                    let off = if on_first { point[1] } else { spacing - point[1] };
                    assert!((foot.distance - off).abs() < 1e-12, "{spacing} {time}: {foot:?} {off}");
                }
            }
        }
    }

    #[test]
    fn a_path_without_legs_is_its_start() {
        let still = Profile::new(0.25, &[Leg::Wait(1.0)]).unwrap();
        let path = Contour::along(&[still.clone(), still.clone()]).unwrap();
        assert_eq!(path.nearest(0.5, [0.25, 0.35], WHOLE).distance, 0.35 - 0.25);
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
            let distance = path.nearest(10.0, point, WHOLE).distance;
            // The points are up to 1 µm apart.
            assert!((-1e-12..1e-6).contains(&(least - distance.abs())), "{point:?}: {distance} {least}");
        }
        // Inside a counterclockwise circle is to the left of it, inside a clockwise one to the right.
        let side = |time: f64, point: [f64; 2]| path.nearest(time, point, WHOLE).distance;
        assert!(side(0.0, [0.0, 0.009]) > 0.0 && side(10.0, [0.0, 0.019]) < 0.0);
    }
}
