//! Distances from a path in a plane.

use super::figures::Deviation;
use super::quadrature::{integral, larger};
use crate::golden;
use crate::metrics::Peak;
use crate::signal::profile::Profile;
use crate::solve::{Curve, Polynomial, TERMS};

/// Most legs before the present one that may be the nearest: what slides is behind its reference.
const LEGS_BEHIND: usize = 16;

/// The path that two profiles on one clock describe, leg by leg.
#[derive(Debug, Clone)]
pub(super) struct Contour {
    /// Begin (s), start and end (m) of each leg.
    legs: Vec<(f64, [f64; 2], [f64; 2])>,
    /// Where it begins, m.
    start: [f64; 2],
}

impl Contour {
    /// Path of two profiles, without their shapers; none for another number of profiles.
    pub fn along(profiles: &[Profile]) -> Option<Self> {
        let [x, y] = profiles else { return None };
        let leg = |((begin, x, along_x, _), (_, y, along_y, _)): (Stroke, Stroke)| {
            (begin, [x, y], [x + along_x, y + along_y])
        };
        let legs = x.strokes().zip(y.strokes()).map(leg).filter(|(_, from, to)| from != to).collect();
        Some(Self { legs, start: [x.start(), y.start()] })
    }

    /// The distance of a point from the path at `time`, s, above zero to the left of it; the nearest leg's number, and
    /// whether the nearest point of it is none of its ends.
    pub fn nearest(&self, time: f64, point: [f64; 2]) -> (f64, Option<usize>, bool) {
        let now = self.legs.partition_point(|(begin, ..)| *begin <= time);
        let legs = now.saturating_sub(LEGS_BEHIND)..(now + 1).min(self.legs.len());
        let mut best = (f64::INFINITY, None, false);
        for number in legs {
            let (_, from, to) = self.legs[number];
            let (along, off) = ([to[0] - from[0], to[1] - from[1]], [point[0] - from[0], point[1] - from[1]]);
            let length = along[0].hypot(along[1]);
            let share = (along[0] * off[0] + along[1] * off[1]) / (length * length);
            let left = (along[0] * off[1] - along[1] * off[0]) / length;
            let is_beside = (0.0..=1.0).contains(&share);
            let distance = match is_beside {
                true => left,
                false => {
                    let end = if share > 1.0 { to } else { from };
                    (point[0] - end[0]).hypot(point[1] - end[1]).copysign(left)
                }
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

    /// The distance from a leg of a point that moves on these polynomials.
    fn beside(&self, leg: usize, places: &[Polynomial]) -> Polynomial {
        let (_, from, to) = self.legs[leg];
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].hypot(along[1]);
        // n·(q − from), n to the left of the leg
        let normal = [-along[1] / length, along[0] / length];
        let mut sum = [0.0; TERMS];
        for (k, term) in sum.iter_mut().enumerate() {
            *term = normal[0] * places[0].0[k] + normal[1] * places[1].0[k];
        }
        sum[0] -= normal[0] * from[0] + normal[1] * from[1];
        Polynomial(sum)
    }
}

/// A stroke of a profile: begin, start, distance and duration.
type Stroke = (f64, f64, f64, f64);

/// Gathers the distance from a path.
pub(super) struct ContourGauge {
    path: Contour,
    seen: Deviation,
    /// ∫ of its square.
    square: f64,
}

/// Places on 0..1 at which the nearest leg is asked for.
const PLACES: usize = 9;

/// A place as near the largest distance so far, as a share of it, may hide a larger one beside it.
const NEAR: f64 = 0.05;

/// Steps of the golden section.
const STEPS: usize = 40;

impl ContourGauge {
    pub fn new(path: Contour) -> Self {
        Self { path, seen: Deviation::default(), square: 0.0 }
    }

    /// Adds the motion on a part of a curve: exactly where one leg is the nearest on all of it.
    pub fn track(&mut self, curve: &Curve, part: (f64, f64), places: &[Polynomial]) {
        let time = |s: f64| curve.begin + s * curve.length;
        let at = |s: f64| self.path.nearest(time(s), [places[0].at(s), places[1].at(s)]);
        let spread = |k: usize| part.0 + (part.1 - part.0) * k as f64 / (PLACES - 1) as f64;
        let seen: [_; PLACES] = std::array::from_fn(|k| at(spread(k)));
        let (_, leg, _) = seen[0];
        let same = seen.iter().all(|&(_, other, is_beside)| is_beside && other == leg);
        if let Some(leg) = leg.filter(|_| same) {
            let distance = self.path.beside(leg, places);
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
}
