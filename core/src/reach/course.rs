//! Peaks along references: instants in each segment on which the references are smooth, and refinement between them.

use crate::machine::rigid::{REST_ACCELERATION, REST_SPEED};
use crate::signal::profile::Profile;

/// Number of intervals of a segment: a requirement is nearly a polynomial of up to fourth degree on it.
const INTERVALS: usize = 8;
/// The same on an arc, whose coordinates are sines; at most a whole turn is one segment.
const ON_ARC: usize = 48;
/// Smallest number of intervals over all segments where a force follows a line with corners.
const WITH_LINES: f64 = 4000.0;

/// Distance of the outermost instants from the ends of a segment, relative to its length: there, derivatives may jump.
const INSIDE: f64 = 1e-7;
/// Segments shorter than this, relative to the whole, are rounding of times.
const ROUNDING: f64 = 1e-11;

/// Relative accuracy of a peak.
const ACCURACY: f64 = 1e-9;
/// Largest number of evaluations that refine a peak, and the closest that two of them are, relative to their interval.
const REFINEMENTS: usize = 50;
const CLOSEST: f64 = 1e-4;
/// Largest number of times that a segment is divided at changes of direction.
const DIVISIONS: usize = 8;

/// A quantity at an instant of references.
pub(super) trait AtInstant {
    /// s
    fn time(&self) -> f64;

    /// Speeds and accelerations whose signs determine the direction of friction and the losses of a gear.
    fn motions(&self) -> [[f64; 2]; 3];
}

/// A limit, and the quantity that it bounds.
pub(super) type Limit<'l, T> = (f64, &'l dyn Fn(&T) -> f64);

/// Values along references.
pub(super) struct Course<'a, T> {
    at: Box<dyn Fn(f64) -> T + 'a>,
    /// Those at the instants of each segment.
    segments: Vec<Vec<T>>,
}

impl<'a, T: AtInstant> Course<'a, T> {
    /// Values `at` the instants of these references, shapers included; `has_lines` if a force of the machine depends on
    /// position or speed by a line.
    pub fn new(profiles: &[Profile], has_lines: bool, at: impl Fn(f64) -> T + 'a) -> Self {
        let mut course = Self { at: Box::new(at), segments: Vec::new() };
        course.segments.push(vec![(course.at)(0.0)]);
        for (ends, intervals) in smooth(profiles, has_lines) {
            course.add(ends, intervals, DIVISIONS);
        }
        course.segments.push(vec![(course.at)(Profile::last_rest(profiles))]);
        course
    }

    /// True if a value `at` the instants of these references exceeds its limit somewhere. Segments behind the first one
    /// with such a value are not evaluated.
    pub fn exceeds((profiles, has_lines): (&[Profile], bool), at: impl Fn(f64) -> T + 'a, limits: &[Limit<T>]) -> bool {
        let ends = [0.0, Profile::last_rest(profiles)].map(|time| vec![at(time)]);
        let mut course = Self { at: Box::new(at), segments: ends.into() };
        let is_beyond = |course: &Self| limits.iter().any(|(limit, of)| course.is_beyond(*limit, of));
        is_beyond(&course)
            || smooth(profiles, has_lines).into_iter().any(|(ends, intervals)| {
                course.segments.clear();
                course.add(ends, intervals, DIVISIONS);
                is_beyond(&course)
            })
    }

    /// Adds a segment, divided where the direction changes.
    fn add(&mut self, [begin, end]: [f64; 2], intervals: usize, divisions: usize) {
        let length = end - begin;
        let [first, last] =
            [(begin, 1.0), (end, -1.0)].map(|(time, sign)| time + sign * self.margin(time, sign * length));
        let time = |k: usize| first + (last - first) * k as f64 / intervals as f64;
        let values: Vec<T> = (0..=intervals).map(|k| (self.at)(time(k))).collect();
        let change = values.windows(2).find_map(|pair| {
            let mut both = pair[0].motions().into_iter().zip(pair[1].motions());
            let is_moving = |speed: f64| speed.abs() > REST_SPEED;
            let turns = |[a, b]: [f64; 2]| is_moving(a) && is_moving(b) && (a < 0.0) != (b < 0.0);
            let which = both.position(|([before, _], [after, _])| turns([before, after]))?;
            Some((which, pair[0].time(), pair[1].time()))
        });
        if let (Some((which, mut low, mut high)), true) = (change, divisions > 0) {
            let speed = |time: f64| (self.at)(time).motions()[which][0];
            let side = speed(low) > 0.0;
            while high - low > ROUNDING * length {
                let middle = 0.5 * (low + high);
                *if (speed(middle) > 0.0) == side { &mut low } else { &mut high } = middle;
            }
            self.add([begin, high], intervals, divisions - 1);
            self.add([high, end], intervals, divisions - 1);
            return;
        }
        self.segments.push(values);
    }

    /// Distance from the end of a segment to its outermost instant, s. At rest a direction is undefined, so that it is
    /// taken where the motion has one.
    fn margin(&self, time: f64, length: f64) -> f64 {
        let inside = INSIDE * length.abs();
        let motions = (self.at)(time + INSIDE * length).motions();
        let leaving = (motions.into_iter())
            .filter(|[speed, acceleration]| speed.abs() <= REST_SPEED && acceleration.abs() > REST_ACCELERATION)
            .map(|[_, acceleration]| 2.0 * REST_SPEED / acceleration.abs());
        leaving.fold(inside, f64::max).min(0.25 * length.abs())
    }

    /// Values at all instants, in order of time.
    pub fn values(&self) -> impl Iterator<Item = &T> {
        self.segments.iter().flatten()
    }

    /// The last value of each segment and the first of the next one.
    pub fn seams(&self) -> impl Iterator<Item = (&T, &T)> {
        self.segments.windows(2).filter_map(|pair| pair[0].last().zip(pair[1].first()))
    }

    /// Value at the instant at which `of` is largest.
    pub fn most(&self, of: impl Fn(&T) -> f64) -> T {
        let (mut best, mut peaks) = self.scanned(&of);
        peaks.sort_by(|a, b| b.bound.total_cmp(&a.bound));
        for peak in peaks {
            let tolerance = tolerance(best.value);
            if peak.bound <= best.value + tolerance {
                break;
            }
            let refined = peak.refined(|time| of(&(self.at)(time)), tolerance);
            if refined.value > best.value {
                best = refined;
            }
        }
        (self.at)(best.time)
    }

    /// True if `of` exceeds this limit in one of the segments.
    fn is_beyond(&self, limit: f64, of: impl Fn(&T) -> f64) -> bool {
        let (best, peaks) = self.scanned(&of);
        let refined = |peak: &Peak| peak.refined(|time| of(&(self.at)(time)), tolerance(limit)).value;
        best.value > limit || peaks.iter().filter(|peak| peak.bound > limit).any(|peak| refined(peak) > limit)
    }

    /// The largest value at the instants, and all peaks.
    fn scanned(&self, of: impl Fn(&T) -> f64) -> (Point, Vec<Peak>) {
        let mut best = Point { time: 0.0, value: f64::NEG_INFINITY };
        let mut peaks = Vec::new();
        for segment in &self.segments {
            let points: Vec<Point> = segment.iter().map(|at| Point { time: at.time(), value: of(at) }).collect();
            best = points.iter().fold(best, |best, point| if point.value > best.value { *point } else { best });
            peaks.extend(Peak::of_segment(&points));
        }
        (best, peaks)
    }
}

/// Ends of the segments on which references are smooth, s, and the number of their intervals.
fn smooth(profiles: &[Profile], has_lines: bool) -> Vec<([f64; 2], usize)> {
    let (seams, end) = (Profile::seams(profiles), Profile::last_rest(profiles));
    let intervals = if profiles.iter().any(Profile::is_sampled) {
        1
    } else if profiles.iter().flat_map(Profile::passages).any(|passage| passage.turn.is_some()) {
        ON_ARC
    } else {
        INTERVALS
    };
    let (mut all, mut begin) = (Vec::new(), 0.0);
    for seam in seams.into_iter().chain([end]) {
        if seam - begin > ROUNDING * end {
            let by_lines = if has_lines { (WITH_LINES * (seam - begin) / end).ceil() as usize } else { 0 };
            all.push(([begin, seam], intervals.max(by_lines)));
            begin = seam;
        }
    }
    all
}

/// Accuracy of a peak of about this value.
fn tolerance(value: f64) -> f64 {
    ACCURACY * value.abs().max(f64::MIN_POSITIVE)
}

/// A value at a time, s.
#[derive(Clone, Copy)]
struct Point {
    time: f64,
    value: f64,
}

/// A largest value among its neighbours.
struct Peak {
    /// Three neighbours, in order of time; the largest is the middle one, or the first or last of the segment.
    points: [Point; 3],
    /// Index of the largest.
    top: usize,
    /// Upper bound of the value between them.
    bound: f64,
}

impl Peak {
    /// Peaks of the values at the equidistant instants of a segment.
    fn of_segment(points: &[Point]) -> Vec<Self> {
        let last = points.len() - 1;
        if last < 2 {
            return Vec::new();
        }
        let value = |k: usize| points[k].value;
        let is_top = |k: usize| (k == 0 || value(k - 1) <= value(k)) && (k == last || value(k + 1) <= value(k));
        let peak = |k: usize| {
            let [a, b, c] = [0, 1, 2].map(|i| k.clamp(1, last - 1) + i - 1);
            // A parabola exceeds the largest of three values by at most an eighth of their second difference, two lines
            // that meet in a corner by at most the whole.
            let bound = value(k) + (value(a) - 2.0 * value(b) + value(c)).abs();
            Self { points: [points[a], points[b], points[c]], top: k - a, bound }
        };
        (0..=last).filter(|k| is_top(*k)).map(peak).collect()
    }

    /// The top between the points: by parabolas, and by division of the longer side where these narrow it slowly.
    fn refined(&self, of: impl Fn(f64) -> f64, tolerance: f64) -> Point {
        let at = |time: f64| Point { time, value: of(time) };
        let [mut a, mut b, mut c] = self.points;
        // At an end of a segment, the top may lie between its first or last two instants.
        if self.top != 1 {
            let end = self.points[self.top];
            let inner = at(end.time + CLOSEST * (b.time - end.time));
            if inner.value <= end.value {
                return end;
            }
            if self.top == 0 { (b, c) = (inner, b) } else { (a, b) = (b, inner) }
        }
        let (mut gain, mut narrows) = (f64::INFINITY, true);
        for _ in 0..REFINEMENTS {
            let (width, is_left) = (c.time - a.time, b.time - a.time > c.time - b.time);
            let top = vertex([a, b, c]).filter(|top| a.time < top.time && top.time < c.time);
            // Neither the last step nor the next one adds anything.
            if top.is_some_and(|top| top.value - b.value <= tolerance) && gain <= tolerance {
                break;
            }
            let (longer, side) = if is_left { (b.time - a.time, -1.0) } else { (c.time - b.time, 1.0) };
            let mut time = top.filter(|_| narrows).map_or(b.time + 0.38 * side * longer, |top| top.time);
            // Two equal times have no parabola.
            if (time - b.time).abs() < CLOSEST * width {
                time = b.time + side * CLOSEST * width;
            }
            let point = at(time);
            gain = (point.value - b.value).abs();
            match (point.value > b.value, point.time < b.time) {
                (true, true) => (b, c) = (point, b),
                (true, false) => (a, b) = (b, point),
                (false, true) => a = point,
                (false, false) => c = point,
            }
            narrows = c.time - a.time < 0.6 * width;
        }
        b
    }
}

/// The top of the parabola through three points; none if it has no top.
fn vertex([a, b, c]: [Point; 3]) -> Option<Point> {
    let slope = |a: Point, b: Point| (b.value - a.value) / (b.time - a.time);
    // f = f_a + s (t − a) + q (t − a)(t − b)
    let s = slope(a, b);
    let q = (slope(b, c) - s) / (c.time - a.time);
    let time = 0.5 * (a.time + b.time) - 0.5 * s / q;
    let value = a.value + (time - a.time) * (s + q * (time - b.time));
    (q < 0.0).then_some(Point { time, value })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::uniform;
    use crate::signal::profile::{Leg, Limits, Reference};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    struct At(f64, Reference);

    impl AtInstant for At {
        fn time(&self) -> f64 {
            self.0
        }

        fn motions(&self) -> [[f64; 2]; 3] {
            [[self.1.speed, self.1.acceleration], [0.0; 2], [0.0; 2]]
        }
    }

    fn profile(distance: f64, limits: Limits, shaper: &[[f64; 2]]) -> Profile {
        Profile::new(0.0, &[Leg::To(distance, limits), Leg::To(0.3 * distance, limits)]).unwrap().shaped(shaper)
    }

    /// A requirement with a peak within a jerk ramp of 1 ms was missed by instants every few milliseconds.
    #[test]
    fn peaks_are_those_of_dense_instants() {
        let mut random = Pcg64::seed_from_u64(32);
        let mut draw = |low: f64, high: f64| low * (high / low).powf(uniform(&mut random));
        for number in 0..40 {
            let jerk = draw(1e2, 1e4);
            let (snap, is_third) = (jerk * draw(1e2, 1e3), number % 4 == 3);
            let limits = Limits {
                speed: draw(0.2, 2.0),
                acceleration: draw(1.0, 30.0),
                jerk: Some(jerk),
                snap: if is_third { None } else { Some(snap) },
            };
            let shaper: &[[f64; 2]] = if number % 2 == 0 { &[] } else { &[[0.0, 0.6], [7.3e-3, 0.4]] };
            let profiles = [profile(draw(1e-3, 0.5), limits, shaper)];
            let [b, m, l, c] = [draw(0.1, 10.0), draw(0.03, 3.0), draw(1e-4, 1e-2), draw(1e-6, 1e-4)];
            // Of voltage: speed, acceleration, an inductance, the snap of an elastic belt, and friction that jumps.
            let needed = |at: &At| {
                let y = &at.1;
                let dry = if y.speed.abs() > REST_SPEED { y.speed.signum() } else { 0.0 };
                (b * y.speed + m * y.acceleration + l * y.jerk + c * y.snap + dry).abs()
            };
            let at = |time: f64| At(time, profiles[0].at(time));
            let course = Course::new(&profiles, false, at);
            let most = needed(&course.most(needed));
            let rest = profiles[0].rest();
            let dense = (0..=200_000).map(|k| needed(&at(rest * f64::from(k) / 2e5))).fold(0.0, f64::max);
            assert!(dense <= most * (1.0 + 1e-6), "{number}: {most}, {dense} at some instant");
            assert!(most <= dense * 1.05, "{number}: {most}, {dense} at some instant");
            let exceeds = |limit: f64| Course::exceeds((&profiles, false), at, &[(limit, &needed)]);
            assert!(exceeds(most * (1.0 - 1e-8)) && !exceeds(most * (1.0 + 1e-8)));
            assert!(course.values().count() < 2500, "{}", course.values().count());
        }
    }

    #[test]
    fn tops_of_curves_and_corners_are_found_with_few_evaluations() {
        let mut random = Pcg64::seed_from_u64(33);
        let mut most = 0;
        for number in 0..200 {
            let top = if number % 3 == 2 { 0.15 + 0.7 * uniform(&mut random) } else { uniform(&mut random) };
            let [steep, flat] = [1.0 + uniform(&mut random), 0.1 + uniform(&mut random)];
            let curve = |t: f64| {
                let d = t - top;
                match number % 3 {
                    0 => 2.0 - d * d * (1.0 + 0.4 * steep * d),
                    1 => 2.0 - flat * d * d * (1.0 + 0.3 * d * d),
                    _ => 2.0 - if d < 0.0 { -steep * d } else { flat * d },
                }
            };
            let points: Vec<Point> =
                (0..=8).map(|k| f64::from(k) / 8.0).map(|time| Point { time, value: curve(time) }).collect();
            let count = std::cell::Cell::new(0);
            let counted = |time: f64| {
                count.set(count.get() + 1);
                curve(time)
            };
            let peaks = Peak::of_segment(&points);
            assert!(peaks.iter().any(|peak| peak.bound >= 2.0 - 1e-12), "{number}");
            let refined = peaks.iter().map(|peak| peak.refined(counted, 1e-9).value).fold(0.0, f64::max);
            assert!((refined - 2.0).abs() < 1e-8, "{number}: {refined} {top}");
            if number % 3 < 2 {
                most = most.max(count.get());
            }
        }
        assert!(most <= 20, "{most} evaluations");
    }
}
