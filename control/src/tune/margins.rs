//! Margins of a sampled loop: sensitivity over all frequencies, and stability.
//!
//! The loop is broken at the command and, if the controller uses more than one measurement, at each of them, with the
//! others closed (`loops.rs`); the worst break counts for every figure. Held commands, delay and filters are included
//! exactly.
//!
//! The loops of several drives form one loop: it is stable if det (1 + L) satisfies Nyquist's criterion, and |S| and
//! |T| are largest singular values. Gain and phase margin are the worst of one drive's loop with the others closed, as
//! in a measurement.
//!
//! The peaks of |S| and |T| are at poles of the closed loop, which are unknown to the grid. So a grid that is dense
//! around the poles of the axis is first refined wherever the phase of one L or 1 + L changes much from one point to
//! the next, as it does around every lightly damped pole of the closed loop; then every local maximum and every
//! crossing is located exactly.

use super::loops::{Break, Open, breaks, smallest};
use super::plant::{Plant, Sampled, Square, by_drives};
use super::winding::Winding;
use crate::control::feedback::{Feedback, Turn};
use crate::machine::MachineKind;
use nalgebra::Complex;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Largest phase change of L or 1 + L from one point to the next, rad.
const TURN: f64 = 0.4;

/// Maximum number of added points, and the least relative distance of two frequencies.
const ADDED: usize = 4000;
const NEAREST: f64 = 1e-12;

/// Lowest frequency of a disturbance, Hz.
const SLOWEST: f64 = 0.1;

/// Steps of a search for a maximum or a crossing.
const STEPS: usize = 60;

/// Relative imaginary part of an L that counts as real, and relative difference of |L| between the lowest two
/// frequencies that counts as constant towards zero.
const REAL: f64 = 1e-6;
const LEVEL: f64 = 1e-6;

/// Local maxima below this fraction of the highest one are not refined.
const HIGH: f64 = 0.7;

/// The break at which each margin is worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Breaks {
    /// Break of M_s.
    pub sensitivity: Break,
    /// Break of M_t.
    pub complementary: Break,
    /// Break of the gain margin.
    pub gain: Break,
    /// Break of the phase margin.
    pub phase: Break,
    /// Index of the drive with the smallest gain margin.
    pub gain_drive: usize,
    /// Index of the drive with the smallest phase margin.
    pub phase_drive: usize,
}

/// Margins of a sampled loop, each at its worst break.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Margins {
    /// True if every pole of the closed loop lies within the unit circle, by Nyquist's criterion.
    pub stable: bool,
    /// M_s = max |S|, S = 1/(1 + L); infinite if it is not stable.
    pub sensitivity: f64,
    /// Its frequency, rad/s; also the frequency of the largest |S| of an unstable loop, at which it oscillates.
    pub at: f64,
    /// M_t = max |T|, T = L/(1 + L).
    pub complementary: f64,
    /// Its frequency, rad/s.
    pub complementary_at: f64,
    /// Gain margin: factor on the gain at the stability limit.
    pub gain: f64,
    /// Phase margin: angle between L and −1 at |L| = 1, rad.
    pub phase: f64,
    /// Breaks at which these are worst.
    pub breaks: Breaks,
    /// True if the loop is the same at every break, since the controller of a drive uses a single measurement.
    pub has_one_loop: bool,
    /// The kind of machine, whose drives these are.
    pub kind: MachineKind,
    /// First frequency at which |L| of the loop that follows the reference falls below 1, rad/s.
    pub crossover: f64,
    /// First frequency at which |S| of that loop rises above 1/√2, rad/s.
    pub bandwidth: f64,
    /// First frequency at which the response from reference to cart, T x/y without feed-forward, falls below 1/√2,
    /// rad/s.
    pub tracking: f64,
    /// √(1/π ∫ |S G/ω|² dω) from 2π 0.1 Hz on: root of the integral over time of the squared cart position, m √s, after
    /// a step of 1 V or 1 A at the command.
    pub disturbance: f64,
    /// √(1/π ∫ |S/ω|² dω) from 2π 0.1 Hz on, √s: the same for the error after a reference step of 1 m, per metre,
    /// without feed-forward.
    pub following: f64,
}

impl Margins {
    /// Name of a drive, if there are several.
    pub fn drive_name(&self, drive: usize) -> Option<&'static str> {
        let drives = self.kind.geometry().drives;
        if drives.len() > 1 { Some(drives[drive].label.name) } else { None }
    }

    /// Margins of a controller on an axis, with exact peaks and crossings.
    pub fn new(plant: &Plant, feedback: &Feedback) -> Self {
        let mut margins = by_drives!(plant, |sampled| {
            let mut curve = Curve::on_grid(plant, sampled, feedback);
            curve.divide();
            curve.margins()
        });
        if !margins.stable {
            margins.spoil();
        }
        margins
    }

    /// Sets the margins of an unstable loop.
    fn spoil(&mut self) {
        (self.sensitivity, self.complementary) = (f64::INFINITY, f64::INFINITY);
        (self.gain, self.phase) = (1.0, 0.0);
        (self.disturbance, self.following) = (f64::INFINITY, f64::INFINITY);
        (self.bandwidth, self.tracking) = (f64::NAN, f64::NAN);
    }

    /// Each figure where it is worst among `all`, the worst `left_out` of it excluded.
    pub(super) fn at_worst(all: &[Self], left_out: usize) -> Option<Self> {
        // What is no number belongs to an unstable loop.
        let worst = |bad: fn(&Self) -> f64| {
            let mut order: Vec<&Self> = all.iter().collect();
            let bad = |margins: &Self| if bad(margins).is_nan() { f64::INFINITY } else { bad(margins) };
            order.sort_by(|a, b| bad(b).total_cmp(&bad(a)));
            order.get(left_out.min(order.len().saturating_sub(1))).copied()
        };
        let (peak, complementary) = (worst(|m| m.sensitivity)?, worst(|m| m.complementary)?);
        let (gain, phase) = (worst(|m| -m.gain)?, worst(|m| -m.phase)?);
        Some(Self {
            sensitivity: peak.sensitivity,
            at: peak.at,
            complementary: complementary.complementary,
            complementary_at: complementary.complementary_at,
            gain: gain.gain,
            phase: phase.phase,
            breaks: Breaks {
                sensitivity: peak.breaks.sensitivity,
                complementary: complementary.breaks.complementary,
                gain: gain.breaks.gain,
                phase: phase.breaks.phase,
                gain_drive: gain.breaks.gain_drive,
                phase_drive: phase.breaks.phase_drive,
            },
            crossover: worst(|m| -m.crossover)?.crossover,
            bandwidth: worst(|m| -m.bandwidth)?.bandwidth,
            tracking: worst(|m| -m.tracking)?.tracking,
            disturbance: worst(|m| m.disturbance)?.disturbance,
            following: worst(|m| m.following)?.following,
            ..*peak
        })
    }

    /// Largest figure relative to its limit: above 1 a limit is exceeded. NaN counts as far beyond.
    pub fn excess(&self, sensitivity: f64, complementary: f64) -> f64 {
        beyond([self.sensitivity, self.complementary], [sensitivity, complementary])
    }
}

/// The larger of two peaks, each relative to its limit.
fn beyond(peaks: [f64; 2], limits: [f64; 2]) -> f64 {
    let excess = (peaks[0] / limits[0]).max(peaks[1] / limits[1]);
    if excess.is_nan() { f64::INFINITY } else { excess }
}

/// M_s and M_t of a loop, both infinite if it is unstable: the part of [`Margins`] that has limits.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Peaks {
    /// M_s and M_t.
    pub peaks: [f64; 2],
}

impl Peaks {
    /// Peaks of a controller on an axis, equal to those of [`Margins::new`].
    pub fn new(plant: &Plant, feedback: &Feedback) -> Self {
        let (peaks, is_stable) = by_drives!(plant, |sampled| {
            let mut curve = Curve::on_grid(plant, sampled, feedback);
            curve.divide();
            let peaks = [curve.highest(Open::sensitivity).value, curve.highest(Open::complementary).value];
            (peaks, curve.is_stable() && peaks[0].is_finite())
        });
        Self { peaks: if is_stable { peaks } else { [f64::INFINITY; 2] } }
    }

    /// True if the loop is stable.
    pub(crate) fn is_stable(&self) -> bool {
        self.peaks[0].is_finite()
    }

    /// Largest peak relative to its limit: above 1 a limit is exceeded.
    pub fn excess(&self, sensitivity: f64, complementary: f64) -> f64 {
        beyond(self.peaks, [sensitivity, complementary])
    }
}

/// A loop on the grid alone, in one pass: true peaks may be higher by some per cent.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Rough {
    /// M_s and M_t; infinite if it is unstable.
    pub peaks: Peaks,
    /// As of [`Margins`].
    pub disturbance: f64,
    /// As of [`Margins`].
    pub following: f64,
}

impl Rough {
    /// Rough margins of a controller on an axis.
    pub fn new(plant: &Plant, feedback: &Feedback) -> Self {
        by_drives!(plant, |sampled| Self::of_sampled(plant, sampled, feedback))
    }

    fn of_sampled<const N: usize>(plant: &Plant, sampled: &Sampled<N>, feedback: &Feedback) -> Self {
        let mut most = [0.0_f64; 2];
        let mut sums = [0.0; 2];
        let mut winding = Winding::new(plant, feedback, N);
        let mut before: Option<(f64, [f64; 2])> = None;
        let breaks = breaks(feedback);
        for (omega, answer, turn) in plant.seen(sampled) {
            let open = Open::new(sampled, answer, feedback, turn);
            winding.go_on(omega, open.difference, turn);
            // |S|² and |T|², |x/v|² and |S|² of what follows the reference
            let squares = open.squares(breaks);
            most = [most[0].max(squares[0]), most[1].max(squares[1])];
            let parts = [all_squares(&open.pushed) / omega, open.following().powi(2) / omega];
            if let Some((last, was)) = before.filter(|(last, _)| *last >= 2.0 * PI * SLOWEST) {
                let way = 0.5 * (omega / last).ln();
                for (sum, (a, b)) in sums.iter_mut().zip(was.iter().zip(parts)) {
                    *sum += way * (a + b);
                }
            }
            before = Some((omega, parts));
        }
        if !winding.is_stable() || !most[0].is_finite() {
            let peaks = Peaks { peaks: [f64::INFINITY; 2] };
            return Self { peaks, disturbance: f64::INFINITY, following: f64::INFINITY };
        }
        let [disturbance, following] = sums.map(|sum| (sum / PI).sqrt());
        Self { peaks: Peaks { peaks: most.map(f64::sqrt) }, disturbance, following }
    }
}

/// The loops along the frequencies.
struct Curve<'a, const N: usize> {
    plant: &'a Plant,
    sampled: &'a Sampled<N>,
    feedback: &'a Feedback,
    breaks: &'static [Break],
    points: Vec<(f64, Open<N>)>,
}

/// A maximum of |S| or |T|.
#[derive(Clone, Copy)]
struct Top {
    value: f64,
    /// rad/s
    omega: f64,
    at: Break,
}

/// Value of a loop broken at one point.
type Of<const N: usize> = fn(&Open<N>, Break) -> f64;

/// Σ |a|² over a matrix.
fn all_squares<const N: usize>(a: &Square<N>) -> f64 {
    a.iter().map(Complex::norm_sqr).sum()
}

impl<'a, const N: usize> Curve<'a, N> {
    fn on_grid(plant: &'a Plant, sampled: &'a Sampled<N>, feedback: &'a Feedback) -> Self {
        let open = |(omega, answer, turn)| (omega, Open::new(sampled, answer, feedback, turn));
        let points = plant.seen(sampled).map(open).collect();
        Self { plant, sampled, feedback, breaks: breaks(feedback), points }
    }

    fn at(&self, omega: f64) -> Open<N> {
        Open::new(self.sampled, &self.sampled.at(omega), self.feedback, &Turn::new(omega, self.plant.every))
    }

    /// Adds points between those whose L or 1 + L differ in phase by more than [`TURN`].
    fn divide(&mut self) {
        let turns = |a: &Open<N>, b: &Open<N>| a.turns(b, self.breaks, TURN);
        let mut done: Vec<(f64, Open<N>)> = Vec::with_capacity(2 * self.points.len());
        let mut waiting: Vec<(f64, Open<N>)> = self.points.iter().rev().copied().collect();
        let mut added = 0;
        done.extend(waiting.pop());
        while let (Some(last), Some(next)) = (done.last(), waiting.last()) {
            if added < ADDED && next.0 - last.0 > NEAREST * next.0 && turns(&last.1, &next.1) {
                let middle = 0.5 * (last.0 + next.0);
                waiting.push((middle, self.at(middle)));
                added += 1;
            } else {
                done.extend(waiting.pop());
            }
        }
        self.points = done;
    }

    /// True if the closed loop is stable.
    fn is_stable(&self) -> bool {
        let mut winding = Winding::new(self.plant, self.feedback, N);
        for (omega, open) in &self.points {
            winding.go_on(*omega, open.difference, &Turn::new(*omega, self.plant.every));
        }
        winding.is_stable()
    }

    /// Margins of the curve, with every maximum and crossing located exactly.
    fn margins(&self) -> Margins {
        let stable = self.is_stable();
        let (top, complementary) = (self.highest(Open::sensitivity), self.highest(Open::complementary));
        let first = self.breaks[0];
        let mut margins = Margins {
            stable: stable && top.value.is_finite(),
            sensitivity: top.value,
            at: top.omega,
            complementary: complementary.value,
            complementary_at: complementary.omega,
            gain: f64::INFINITY,
            phase: f64::INFINITY,
            breaks: Breaks {
                sensitivity: top.at,
                complementary: complementary.at,
                gain: first,
                phase: first,
                gain_drive: 0,
                phase_drive: 0,
            },
            has_one_loop: self.breaks.len() == 1,
            kind: self.plant.kind,
            crossover: f64::NAN,
            bandwidth: f64::NAN,
            tracking: f64::NAN,
            disturbance: self.squared(&|open| all_squares(&open.pushed)),
            following: self.squared(&|open| open.following().powi(2)),
        };
        for &at in self.breaks {
            (0..N).for_each(|drive| self.cross(at, drive, &mut margins));
        }
        for pair in self.points.windows(2) {
            let [(_, was), (_, is)] = [pair[0], pair[1]];
            let falls = |of: &dyn Fn(&Open<N>) -> f64| of(&was) >= 0.0 && of(&is) < 0.0;
            let level = |value: f64| value.ln() - FRAC_1_SQRT_2.ln();
            let of_l = |open: &Open<N>| {
                (0..N).map(|drive| open.broken_at(open.outer(), drive).norm()).fold(0.0, f64::max).ln()
            };
            if margins.crossover.is_nan() && falls(&of_l) {
                margins.crossover = self.crossing(pair, &of_l).0;
            }
            let of_s = |open: &Open<N>| -level(open.following());
            if margins.bandwidth.is_nan() && falls(&of_s) {
                margins.bandwidth = self.crossing(pair, &of_s).0;
            }
            let of_t = |open: &Open<N>| level(smallest(&open.reference_to_slides()));
            if margins.tracking.is_nan() && falls(&of_t) {
                margins.tracking = self.crossing(pair, &of_t).0;
            }
        }
        margins
    }

    /// Updates gain and phase margin by a drive's loop broken there, if they are smaller.
    fn cross(&self, at: Break, drive: usize, margins: &mut Margins) {
        let of = |open: &Open<N>| open.broken_at(at, drive);
        // −L on the positive real axis
        let mut grow = |size: f64| {
            if size > 0.0 && size < 1.0 && 1.0 / size < margins.gain {
                (margins.gain, margins.breaks.gain, margins.breaks.gain_drive) = (1.0 / size, at, drive);
            }
        };
        for pair in self.points.windows(2) {
            let (a, b) = (of(&pair[0].1), of(&pair[1].1));
            if a.im * b.im < 0.0 && a.re < 0.0 && b.re < 0.0 {
                grow(-of(&self.crossing(pair, &|open| of(open).im).1).re);
            }
            if (a.norm() - 1.0) * (b.norm() - 1.0) <= 0.0 && a.norm() != 1.0 {
                let open = self.crossing(pair, &|open| of(open).norm().ln()).1;
                // The angle from the negative axis; the nearest of all crossings counts.
                let angle = (-of(&open)).arg().abs();
                if angle < margins.phase {
                    (margins.phase, margins.breaks.phase, margins.breaks.phase_drive) = (angle, at, drive);
                }
            }
        }
        // L is real at half the sampling rate, and at zero frequency if it is constant towards it.
        let is_real = |l: Complex<f64>| l.im.abs() <= REAL * l.norm();
        if let Some(last) = self.points.last().map(|(_, open)| of(open)).filter(|l| is_real(*l)) {
            grow(-last.re);
        }
        if let [(_, first), (_, second), ..] = &self.points[..]
            && is_real(of(first))
            && (of(second).norm() / of(first).norm() - 1.0).abs() < LEVEL
        {
            grow(-of(first).re);
        }
    }

    /// The highest value over all frequencies and breaks.
    fn highest(&self, value: Of<N>) -> Top {
        let of = |at: Break| -> Vec<f64> { self.points.iter().map(|(_, open)| value(open, at)).collect() };
        let values: Vec<(Break, Vec<f64>)> = self.breaks.iter().map(|&at| (at, of(at))).collect();
        let mut best = Top { value: 0.0, omega: 0.0, at: self.breaks[0] };
        for (at, values) in &values {
            for (&v, &(omega, _)) in values.iter().zip(&self.points) {
                if v > best.value || v.is_nan() {
                    best = Top { value: if v.is_nan() { f64::INFINITY } else { v }, omega, at: *at };
                }
            }
        }
        let level = HIGH * best.value;
        for (at, values) in values.iter().filter(|_| level.is_finite()) {
            for k in 1..values.len().saturating_sub(1) {
                if values[k] >= level && values[k] >= values[k - 1] && values[k] >= values[k + 1] {
                    let of = |open: &Open<N>| value(open, *at);
                    let (top, omega) = self.top(self.points[k - 1].0, self.points[k + 1].0, &of);
                    if top > best.value {
                        best = Top { value: top, omega, at: *at };
                    }
                }
            }
        }
        best
    }

    /// Maximum between two frequencies, by golden section.
    fn top(&self, mut low: f64, mut high: f64, value: &dyn Fn(&Open<N>) -> f64) -> (f64, f64) {
        let share = 0.5 * (5f64.sqrt() - 1.0);
        let look = |omega: f64| (value(&self.at(omega)), omega);
        let (mut left, mut right) = (look(high - share * (high - low)), look(low + share * (high - low)));
        for _ in 0..STEPS {
            if high - low <= 1e-13 * high || (left.0 - right.0).abs() <= 1e-12 * left.0 && high - low <= 1e-6 * high {
                break;
            }
            if left.0 > right.0 {
                (high, right) = (right.1, left);
                left = look(high - share * (high - low));
            } else {
                (low, left) = (left.1, right);
                right = look(low + share * (high - low));
            }
        }
        if left.0 > right.0 { left } else { right }
    }

    /// Zero of a quantity between two points.
    fn crossing(&self, pair: &[(f64, Open<N>)], of: &dyn Fn(&Open<N>) -> f64) -> (f64, Open<N>) {
        let (mut low, mut high) = ((pair[0], of(&pair[0].1)), (pair[1], of(&pair[1].1)));
        for step in 0..STEPS {
            // Linear interpolation, alternating with bisection.
            let line = (low.1 / (low.1 - high.1)).clamp(0.0, 1.0);
            let share = if step % 2 == 1 || !line.is_finite() { 0.5 } else { line };
            let omega = low.0.0 + share * (high.0.0 - low.0.0);
            let open = self.at(omega);
            let value = of(&open);
            if value == 0.0 || high.0.0 - low.0.0 <= 1e-12 * omega {
                return (omega, open);
            }
            if (value > 0.0) == (low.1 > 0.0) { low = ((omega, open), value) } else { high = ((omega, open), value) }
        }
        if low.1.abs() < high.1.abs() { low.0 } else { high.0 }
    }

    /// √(1/π ∫ v/ω² dω) of a squared magnitude v, by trapezia on the logarithm of ω.
    fn squared(&self, value: &dyn Fn(&Open<N>) -> f64) -> f64 {
        let slowest = 2.0 * PI * SLOWEST;
        let part = |(omega, open): &(f64, Open<N>)| value(open) / omega;
        let sum: f64 = self
            .points
            .windows(2)
            .filter(|pair| pair[0].0 >= slowest)
            .map(|pair| 0.5 * (part(&pair[0]) + part(&pair[1])) * (pair[1].0 / pair[0].0).ln())
            .sum();
        (sum / PI).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use crate::linear::Operation;

    const PID: &str = "sollmann-jouaneh/controllers/pid.toml";

    /// The belt is rigid: an undamped resonance makes the loop unstable.
    fn read(delay: &str) -> (Plant, Feedback) {
        let file = format!("{}/../stages/{PID}", env!("CARGO_MANIFEST_DIR"));
        let delay = format!("controller.delay=\"{delay}\"");
        let case = Case::read_with(file, &[&delay, "belt.model=\"rigid\""]).unwrap();
        let design = case.controller.as_ref().unwrap();
        let feedback = Feedback::new(design, &case.machine).unwrap();
        (Plant::new(&case.machine, Operation::default(), design, &feedback.corners()).unwrap(), feedback)
    }

    #[test]
    fn a_loop_that_is_late_by_many_samples_has_infinite_peaks() {
        let (plant, feedback) = read("0.5 ms");
        let (peaks, margins) = (Peaks::new(&plant, &feedback), Margins::new(&plant, &feedback));
        assert!(peaks.is_stable() && margins.stable);
        assert_eq!(peaks.peaks, [margins.sensitivity, margins.complementary]);
        let (plant, feedback) = read("20 ms");
        assert!(!Peaks::new(&plant, &feedback).is_stable() && !Margins::new(&plant, &feedback).stable);
    }

    /// The peak of a grid is lower than that beside it.
    #[test]
    fn no_frequency_beside_a_peak_has_a_larger_value() {
        for delay in ["0.1 ms", "0.5 ms", "1.3 ms", "2 ms", "2.7 ms", "3.1 ms"] {
            let (plant, feedback) = read(delay);
            by_drives!(&plant, |sampled| {
                let mut curve = Curve::on_grid(&plant, sampled, &feedback);
                curve.divide();
                for of in [Open::sensitivity, Open::complementary] {
                    let top = curve.highest(of);
                    let beside = (1..400).map(|k| 1e-5 * f64::from(k)).flat_map(|off| [1.0 - off, 1.0 + off]);
                    for omega in beside.map(|factor| factor * top.omega) {
                        let value = of(&curve.at(omega), top.at);
                        assert!(value <= top.value * (1.0 + 1e-12), "{delay}: {value} at {omega}, {}", top.value);
                    }
                }
            });
        }
    }

    #[test]
    fn a_rough_look_has_the_figures_of_an_exact_one_within_some_per_cent() {
        for delay in ["0.1 ms", "0.5 ms", "2 ms"] {
            let (plant, feedback) = read(delay);
            let (rough, exact) = (Rough::new(&plant, &feedback), Margins::new(&plant, &feedback));
            let pairs = [
                (rough.peaks.peaks[0], exact.sensitivity),
                (rough.peaks.peaks[1], exact.complementary),
                (rough.disturbance, exact.disturbance),
                (rough.following, exact.following),
            ];
            assert!(pairs.iter().all(|(rough, exact)| (rough / exact - 1.0).abs() < 0.05), "{delay}: {pairs:?}");
        }
        let (plant, feedback) = read("20 ms");
        let rough = Rough::new(&plant, &feedback);
        assert_eq!((rough.peaks.peaks, rough.disturbance), ([f64::INFINITY; 2], f64::INFINITY));
    }
}
