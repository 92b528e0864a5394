//! Held and straight signals: what they are between their seams.

use super::clock::Now;
use super::smooth::product;
use super::{Hold, Part};

pub(super) fn step(now: Now, value: f64, at: f64) -> Part {
    if now.reached(at) { Part::held(value, f64::INFINITY) } else { Part::held(0.0, at) }
}

/// Nothing at all if `duration` is not positive.
pub(super) fn pulse(now: Now, value: f64, duration: f64, at: f64) -> Part {
    let end = at + duration;
    if now.reached(end) || duration.is_nan() || duration <= 0.0 {
        Part::held(0.0, f64::INFINITY)
    } else if now.reached(at) {
        Part::held(value, end)
    } else {
        Part::held(0.0, at)
    }
}

/// A step if `over` is not positive.
pub(super) fn ramp(now: Now, value: f64, over: f64, at: f64) -> Part {
    let slope = value / over;
    let end = at + over;
    if !now.reached(at) {
        Part::held(0.0, at)
    } else if now.reached(end) || !slope.is_finite() {
        Part::held(value, f64::INFINITY)
    } else {
        Part::line(slope * (now.t - at), slope, end)
    }
}

pub(super) fn ramp_value(now: Now, value: f64, over: f64, at: f64) -> f64 {
    if !now.reached(at) {
        0.0
    } else if now.reached(at + over) || !(value / over).is_finite() {
        value
    } else {
        value * ((now.t - at) / over)
    }
}

/// Its seams are the peaks, (2k − 1)/(4f) for k ≥ 1; piece k crosses zero at k/(2f). Zero without a frequency.
pub(super) fn triangle(now: Now, amplitude: f64, frequency: f64) -> Part {
    let (amplitude, f) = if frequency < 0.0 { (-amplitude, -frequency) } else { (amplitude, frequency) };
    if f.is_nan() || f == 0.0 || !now.resolves(0.5 / f) {
        return Part::held(0.0, f64::INFINITY);
    }
    let peak = |k: f64| if k > 0.0 { (2.0 * k - 1.0) / (4.0 * f) } else { 0.0 };
    let k = now.cell(2.0 * f * now.t + 0.5, peak);
    let rise = if k % 2.0 == 0.0 { 4.0 * amplitude } else { -4.0 * amplitude };
    // u = (−1)ᵏ 4 a (f t − k/2)
    let (turns, rest) = product(f, now.t);
    Part::line(rise * ((turns - 0.5 * k) + rest), rise * f, peak(k + 1.0))
}

pub(super) fn triangle_value(now: Now, amplitude: f64, frequency: f64) -> f64 {
    if frequency == 0.0 || !now.resolves(0.5 / frequency.abs()) {
        return 0.0;
    }
    // The share s of a period since the last upward crossing of zero, −½ to ½: u = 4 a s up to the peak at ¼, and so
    // on.
    let (turns, rest) = product(frequency, now.t);
    let s = (turns - turns.round()) + rest;
    let s = if s > 0.25 {
        0.5 - s
    } else if s < -0.25 {
        -0.5 - s
    } else {
        s
    };
    4.0 * amplitude * s
}

/// Its seams are k/f, where it goes up, and (k + duty)/f, where it goes down. High for ever without a frequency.
pub(super) fn square(now: Now, amplitude: f64, frequency: f64, duty: f64) -> Part {
    let f = frequency.abs();
    if duty.is_nan() || duty <= 0.0 {
        return Part::held(-amplitude, f64::INFINITY);
    }
    if duty >= 1.0 || f == 0.0 {
        return Part::held(amplitude, f64::INFINITY);
    }
    if !now.resolves(1.0 / f) {
        return Part::held(amplitude * (2.0 * duty - 1.0), f64::INFINITY);
    }
    let up = |k: f64| k / f;
    let k = now.cell(f * now.t, up);
    let down = (k + duty) / f;
    if now.reached(down) { Part::held(-amplitude, up(k + 1.0)) } else { Part::held(amplitude, down) }
}

/// Most points that one piece goes past.
const MOST_ALIKE: usize = 1000;

/// Points in time, joined or held: tables and samples.
pub(super) struct Points<'a> {
    from: Source<'a>,
    hold: Hold,
}

enum Source<'a> {
    Table(&'a [[f64; 2]]),
    Samples(&'a [f64], &'a [f64]),
}

/// The place of the time that comes next, looked for where it is if times are even.
fn near(now: Now, times: &[f64]) -> Option<usize> {
    let (first, last) = (*times.first()?, *times.last()?);
    let guess = ((now.t - first) / (last - first) * (times.len() - 1) as f64) as usize;
    let next = |&i: &usize| {
        let after = i.checked_sub(1).is_none_or(|i| times.get(i).is_some_and(|&t| now.reached(t)));
        after && times.get(i).is_none_or(|&t| !now.reached(t))
    };
    // A guess is off by one where rounding has it so.
    (guess..=guess.saturating_add(2)).find(next)
}

impl<'a> Points<'a> {
    /// A table; two points of the same time are a jump.
    pub fn of_table(points: &'a [[f64; 2]]) -> Self {
        Self { from: Source::Table(points), hold: Hold::Linear }
    }

    /// Samples; times without a value and values without a time do not count.
    pub fn of_samples(times: &'a [f64], values: &'a [f64], hold: Hold) -> Self {
        let n = times.len().min(values.len());
        Self { from: Source::Samples(&times[..n], &values[..n]), hold }
    }

    fn get(&self, i: usize) -> Option<[f64; 2]> {
        match self.from {
            Source::Table(points) => points.get(i).copied(),
            Source::Samples(times, values) => Some([*times.get(i)?, *values.get(i)?]),
        }
    }

    /// The place of the point that comes next.
    fn next(&self, now: Now) -> usize {
        match self.from {
            Source::Table(points) => points.partition_point(|p| now.reached(p[0])),
            Source::Samples(times, _) => near(now, times).unwrap_or_else(|| times.partition_point(|&t| now.reached(t))),
        }
    }

    /// The point that came last and the one that comes next, if any.
    fn around(&self, next: usize) -> (Option<[f64; 2]>, Option<[f64; 2]>) {
        (next.checked_sub(1).and_then(|i| self.get(i)), self.get(next))
    }

    /// When a value that is held from before point `next` may change: equal values after each other are one piece.
    fn held_until(&self, value: f64, mut next: usize, mut end: f64) -> f64 {
        for _ in 0..MOST_ALIKE {
            let (Some([_, here]), Some([time, after])) = (self.get(next), self.get(next + 1)) else { break };
            // A straight line ends at the last of them, a held value lasts until the first other one.
            let alike = here == value && (self.hold == Hold::Zero || after == value);
            if !alike || time <= end {
                break;
            }
            (next, end) = (next + 1, time);
        }
        end
    }

    pub fn part(&self, now: Now) -> Part {
        let next = self.next(now);
        match self.around(next) {
            (None, None) => Part::held(0.0, f64::INFINITY),
            (None, Some([next, _])) => Part::held(0.0, next),
            (Some([_, v]), None) => Part::held(v, f64::INFINITY),
            (Some([t0, v0]), Some([t1, v1])) => {
                let slope = (v1 - v0) / (t1 - t0);
                if self.hold == Hold::Zero || slope == 0.0 {
                    Part::held(v0, self.held_until(v0, next, t1))
                } else if !slope.is_finite() {
                    Part::held(v0, t1)
                } else {
                    Part::line(v0 + slope * (now.t - t0), slope, t1)
                }
            }
        }
    }

    pub fn value(&self, now: Now) -> f64 {
        match self.around(self.next(now)) {
            (None, _) => 0.0,
            (Some([_, v]), None) => v,
            (Some([t0, v0]), Some([t1, v1])) => {
                if self.hold == Hold::Zero || !((v1 - v0) / (t1 - t0)).is_finite() {
                    v0
                } else {
                    v0 + (v1 - v0) * ((now.t - t0) / (t1 - t0))
                }
            }
        }
    }
}
