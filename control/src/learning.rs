//! Iterative learning control: from the log of a repeated move, the signal to add to the command at its next
//! repetition.
//!
//! With the error e = r − y of a trial, the signal w that was added to the command, and the closed-loop response T from
//! w to y, the next signal is
//!
//! ```text
//! w⁺ = Q (w + L e),  L = s T₀*/(|T₀|² + ρ²)                    (T₀ of the machine of the file)
//! ```
//!
//! Signals are finite and completely known, so L and Q need not be causal: both act on their transforms. On a machine
//! with the response T the next error is e − T (w⁺ − w), and the distance of w from its limit shrinks in each
//! repetition by at least
//!
//! ```text
//! max |Q (1 − L T)| ≤ γ < 1                            (M. Norrlöf, S. Gunnarsson 2002)
//! ```
//!
//! in its root sum of squares, also if the signal is cut to the time of the move. At frequencies where s = 1 would
//! leave more than γ on a machine of the family, s is reduced, to zero where one machine would keep all of its error or
//! more: then |1 − L T| ≤ 1 on all of them, and the final error, (1 − Q)/(1 − Q (1 − L T)) times that without learning,
//! does not increase at any frequency. Q is the largest gain of at most 1 with which the bound holds, and falls to zero
//! where T₀ is too small to be inverted; there only feedback acts.
//!
//! For a gantry, e and w are vectors: the errors of bridge and cart, and the signals that move one of them alone, which
//! give the motors B w with r φ = B q. T is a 2 × 2 matrix, and
//!
//! ```text
//! L = s T̃₀ᴴ (T̃₀ T̃₀ᴴ + 1)⁻¹ R⁻¹,  T̃₀ = R⁻¹ T₀,  R = diag ρ_i          (ρ_i of the largest row i of T₀)
//! ```
//!
//! with largest singular values instead of magnitudes, and the smallest of T̃₀ for its inversion.
//!
//! For a stepper, w corrects the commanded position: T is the response of the machine to its command, around which an
//! encoder may close a loop.
//!
//! M. Norrlöf, S. Gunnarsson, "Time and frequency domain convergence properties in iterative learning control", *Int.
//! J. Control* 75 (2002) 1114-1126. D. Bristow, M. Tharayil, A. Alleyne, "A survey of iterative learning control",
//! *IEEE Control Systems Magazine* 26 (2006) 96-114.

use crate::case::{Case, Move};
use crate::control::Added;
use crate::control::feedback::Feedback;
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::{Geometry, Machine};
use crate::quantity::rounded;
use crate::tune::{Corner, Family, Peaks, from_commands, inverse, largest, over, smallest};
use nalgebra::{Complex, SMatrix, SVector};
use rustfft::{Fft, FftPlanner};
use std::f64::consts::PI;
use std::sync::Arc;

/// γ: largest fraction of the distance from the limit that remains after each repetition.
pub const CONTRACTION: f64 = 0.8;

/// ρ over the largest |T₀|, and multiples of ρ between which Q rises from 0 to 1.
const INVERTIBLE: f64 = 0.05;
const KEPT_FROM: f64 = 3.0;

/// Number of predicted repetitions.
const PREDICTED: usize = 8;

/// Maximum number of samples of a trial, and minimum number at rest after the move.
const MOST_SAMPLES: usize = 1 << 17;
const LEAST_REST: usize = 10;

/// Maximum number of controller samples between two rows of a log.
const COARSEST: f64 = 2.5;

/// The measured position of a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum At {
    /// Sliding parts: the cart; for a gantry, bridge and cart.
    Cart,
    /// The measurements of the controllers of all drives, along the belt.
    Encoder,
}

/// A repetition of a move.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Times from the start of the move, s, increasing.
    pub time: Vec<f64>,
    /// Positions of each sliding part, or of each drive, m.
    pub positions: Vec<Vec<f64>>,
    /// The measured position.
    pub at: At,
}

/// The size of an error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Size {
    /// Root mean square, m.
    pub rms: f64,
    /// Largest magnitude, m.
    pub peak: f64,
}

impl Size {
    fn new(error: &[f64]) -> Self {
        let sum: f64 = error.iter().map(|e| e * e).sum();
        let peak = error.iter().fold(0.0_f64, |most, e| most.max(e.abs()));
        Self { rms: (sum / error.len().max(1) as f64).sqrt(), peak }
    }

    fn or_larger(self, other: Self) -> Self {
        Self { rms: self.rms.max(other.rms), peak: self.peak.max(other.peak) }
    }
}

/// Predicted errors of a repetition: on the nominal machine, and the largest over the family.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Predicted {
    /// On the machine of the file.
    pub nominal: Size,
    /// Largest over the family.
    pub worst: Size,
}

/// The learning at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Point {
    /// Hz.
    pub frequency: f64,
    /// |1 − L T|, largest over the family.
    pub left: f64,
    /// Q.
    pub kept: f64,
}

/// The signal of a drive.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct DriveSignal {
    /// Signal of the trial, V or A; m for a stepper.
    pub before: Vec<f64>,
    /// The next signal, V or A; m for a stepper.
    pub next: Vec<f64>,
}

impl DriveSignal {
    /// Largest magnitude of the next signal, V or A; m for a stepper.
    pub fn largest(&self) -> f64 {
        self.next.iter().fold(0.0, |most, w| most.max(w.abs()))
    }
}

/// Error of a sliding part.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SlideError {
    /// Error of the trial, m: reference minus position.
    pub error: Vec<f64>,
    /// Predicted error of the next repetition on the nominal machine, m.
    pub expected: Vec<f64>,
    /// Size of the error of the trial.
    pub now: Size,
    /// Predicted repetitions.
    pub predicted: Vec<Predicted>,
}

/// The next signal, and its predicted effect.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Learned {
    /// Interval between values, s: the controller's sample time.
    pub every: f64,
    /// The signal of each drive.
    pub drives: Vec<DriveSignal>,
    /// The error of each sliding part.
    pub slides: Vec<SlideError>,
    /// max |Q (1 − L T)| over frequencies and family.
    pub contraction: f64,
    /// Lowest and highest frequency with Q = 1, Hz.
    pub band: [f64; 2],
    /// Fraction of the squared error of the trial at frequencies with Q = 1.
    pub share: f64,
    /// Points over frequency.
    pub points: Vec<Point>,
    /// Number of machines of the family.
    pub axes: usize,
}

impl Learned {
    /// Largest magnitude of the next signals, V or A; m for steppers.
    pub fn largest(&self) -> f64 {
        self.drives.iter().map(DriveSignal::largest).fold(0.0, f64::max)
    }

    /// The next signal of each drive, as an addition to its command.
    pub fn added(&self) -> Vec<Added> {
        self.drives.iter().map(|drive| Added::new(self.every, drive.next.clone())).collect()
    }

    /// True if the next repetition may not reduce the RMS error on the worst machine.
    pub fn is_near_its_limit(&self) -> bool {
        let sum = |of: &dyn Fn(&SlideError) -> f64| self.slides.iter().map(|slide| of(slide).powi(2)).sum::<f64>();
        let next = |slide: &SlideError| slide.predicted.first().map_or(0.0, |next| next.worst.rms);
        sum(&next) >= sum(&|slide: &SlideError| slide.now.rms)
    }
}

/// Next signal of a move from its last repetition, in which `before` was added to the command of each drive. Errors: a
/// log that does not cover the move, a nonlinear controller, a loop that is unstable on a machine of the family, or a
/// family for which learning would not converge.
pub fn learn(
    case: &Case,
    motion: &Move,
    trial: &Trial,
    before: Option<&[Added]>,
    stop: &dyn Fn() -> bool,
) -> Result<Learned> {
    match case.machine.has_one_coordinate() {
        true => learned::<1>(case, motion, trial, before, stop),
        false => learned::<2>(case, motion, trial, before, stop),
    }
}

fn learned<const M: usize>(
    case: &Case,
    motion: &Move,
    trial: &Trial,
    before: Option<&[Added]>,
    stop: &dyn Fn() -> bool,
) -> Result<Learned> {
    let Some(design) = &case.controller else {
        return Err(Error::new("there is no controller whose moves could be learned").next("add [controller]"));
    };
    let feedback = Feedback::new(design, &case.machine)?;
    if !feedback.is_linear() {
        return Err(Error::new("the controller is not linear: no response of its loop exists to learn with")
            .next("learn with a linear structure, such as pid or cascade"));
    }
    let geometry = case.machine.geometry();
    if let Some(signals) = before.filter(|signals| signals.len() != geometry.drives.len()) {
        return Err(Error::new(format!("there are {} signals that were added", signals.len()))
            .allowed(format!("{}: one for each drive", geometry.drives.len())));
    }
    let errors = errors(geometry, motion, design, trial)?;
    let (n, every) = (errors[0].len(), design.every);
    let signal = |drive: usize| -> Vec<f64> {
        let value = |k: usize| before.map_or(0.0, |added| added[drive].at((k as f64 + 1e-3) * every).0);
        (0..n).map(value).collect()
    };
    let before: Vec<Vec<f64>> = (0..geometry.drives.len()).map(signal).collect();
    let signals: Vec<Vec<f64>> = geometry.slides.iter().map(|slide| weighed(&before, slide.by_drives, n)).collect();
    let transform = Transform::new(n, every);
    let family = Family::new(case, &case.tune.clone().unwrap_or_default())?;
    let responses = responses(&family, (design, &feedback), trial.at, &transform, stop)?;
    // A commanded position moves its slide by as much, however high the resonance of the field.
    let most = if case.machine.stepper().is_some() { 1.0 } else { f64::INFINITY };
    let rule = Rule::<M>::new(&responses, most)?;
    let taper = taper(n, motion.end() / every);
    let predictions = rule.predicted(&responses, &transform, (&errors, &signals), &taper);
    let squared = |is_chosen: &dyn Fn(usize) -> bool| -> f64 {
        errors.iter().map(|error| transform.squared(error, is_chosen)).sum()
    };
    let kept = squared(&|k| rule.kept[k] >= 1.0) / squared(&|_| true);
    let within = |k: &usize| rule.kept[*k] >= 1.0;
    let hertz = |k: usize| transform.omega(k) / (2.0 * PI);
    let frequencies = || (0..transform.bins()).filter(within);
    // Each drive gets its share of the belt's travel.
    let shares = case.machine.belt_shares();
    let next = |drive: usize| weighed(&predictions.next, shares[drive], n);
    let drives = before.into_iter().enumerate().map(|(drive, before)| DriveSignal { before, next: next(drive) });
    let of_slide = |(slide, error): (usize, &Vec<f64>)| SlideError {
        now: Size::new(error),
        error: error.clone(),
        expected: predictions.expected[slide].clone(),
        predicted: predictions.sizes[slide].clone(),
    };
    Ok(Learned {
        every,
        drives: drives.collect(),
        slides: errors.iter().enumerate().map(of_slide).collect(),
        share: if kept.is_finite() { kept } else { 0.0 },
        band: [frequencies().next().map_or(0.0, hertz), frequencies().next_back().map_or(0.0, hertz)],
        contraction: rule.contraction(),
        points: (0..transform.bins())
            .map(|k| Point { frequency: hertz(k), left: rule.left[k], kept: rule.kept[k] })
            .collect(),
        axes: responses.len(),
    })
}

/// A sum of signals of `n` values with these weights.
fn weighed(signals: &[Vec<f64>], weights: &[f64], n: usize) -> Vec<f64> {
    (0..n).map(|k| signals.iter().zip(weights).map(|(signal, weight)| weight * signal[k]).sum()).collect()
}

impl Trial {
    /// Errors: columns, rows or a duration that do not fit this move of this machine.
    pub fn check(&self, machine: &Machine, motion: &Move, design: &Design) -> Result<()> {
        self.samples(machine.geometry(), motion, design).map(|_| ())
    }

    /// Number of the controller's samples that the log covers.
    fn samples(&self, geometry: &Geometry, motion: &Move, design: &Design) -> Result<usize> {
        let Trial { time, positions, at } = self;
        let every = design.every;
        let wanted = match at {
            At::Cart => geometry.slides.len(),
            At::Encoder => geometry.drives.len(),
        };
        if positions.len() != wanted {
            return Err(Error::new(format!("the log has {} columns of positions", positions.len())).allowed(
                match at {
                    At::Cart => format!("{wanted}: one for each part that slides"),
                    At::Encoder => format!("{wanted}: one for the encoder of each drive"),
                },
            ));
        }
        let (Some(&first), Some(&last)) = (time.first(), time.last()) else {
            return Err(Error::new("the log has no rows"));
        };
        let is_whole = |position: &Vec<f64>| position.len() == time.len() && position.iter().all(|x| x.is_finite());
        if time.iter().any(|value| !value.is_finite()) || !positions.iter().all(is_whole) {
            return Err(Error::new("the log has values that are no numbers").next("keep complete rows"));
        }
        if first > every {
            return Err(Error::new(format!("the log begins {} s after the move", rounded(first)))
                .next("log from the beginning of the move on, with times counted from it"));
        }
        let spacing = (last - first) / (time.len().max(2) - 1) as f64;
        if spacing > COARSEST * every {
            return Err(Error::new(format!("the rows of the log are {} s apart", rounded(spacing)))
                .allowed(format!("up to {} s: the controller samples every {every} s", rounded(COARSEST * every)))
                .next("log at the controller's rate"));
        }
        let n = (last.min(motion.until) / every * (1.0 + 1e-12)).floor() as usize + 1;
        if n > MOST_SAMPLES {
            return Err(Error::new(format!("the move has {n} samples")).allowed(format!("up to {MOST_SAMPLES}")));
        }
        let end = motion.end();
        if (n as f64) < end / every + LEAST_REST as f64 {
            return Err(Error::new(format!("the log ends at {} s, and the move at {} s", rounded(last), rounded(end)))
                .allowed(format!("a rest of at least {LEAST_REST} samples after the move"))
                .next("log a little longer, or give the move a longer `until`"));
        }
        Ok(n)
    }
}

/// Reference minus position of each sliding part at the controller's samples, m.
fn errors(geometry: &Geometry, motion: &Move, design: &Design, trial: &Trial) -> Result<Vec<Vec<f64>>> {
    let n = trial.samples(geometry, motion, design)?;
    let Trial { time, positions, at } = trial;
    let every = design.every;
    let profiles = motion.references(design);
    let one = |slide: usize| -> Vec<f64> {
        let position = |row: usize| match at {
            At::Cart => positions[slide][row],
            At::Encoder => {
                let by_drives = geometry.slides[slide].by_drives;
                positions.iter().zip(by_drives).map(|(position, weight)| weight * position[row]).sum()
            }
        };
        let mut row = 0;
        let at = |k: usize| {
            let t = k as f64 * every;
            while row + 2 < time.len() && time[row + 1] <= t {
                row += 1;
            }
            let next = (row + 1).min(time.len() - 1);
            let share = if next > row { ((t - time[row]) / (time[next] - time[row])).clamp(0.0, 1.0) } else { 0.0 };
            profiles[slide].at(t).position - (position(row) + share * (position(next) - position(row)))
        };
        (0..n).map(at).collect()
    };
    Ok((0..geometry.slides.len()).map(one).collect())
}

/// 1 during the move, then half a cosine to 0 over the rest, since a stuck cart does not respond as T does.
fn taper(n: usize, end: f64) -> Vec<f64> {
    let rest = (n as f64 - end).max(1.0);
    let at = |k: usize| ((k as f64 - end) / rest).clamp(0.0, 1.0);
    (0..n).map(|k| 0.5 * (1.0 + (PI * at(k)).cos())).collect()
}

/// Transforms of signals of a trial's length, padded with as many zeros.
struct Transform {
    n: usize,
    length: usize,
    every: f64,
    there: Arc<dyn Fft<f64>>,
    back: Arc<dyn Fft<f64>>,
}

type Spectrum = Vec<Complex<f64>>;

/// Matrix and vector at a frequency, over slides and the signals that move them.
type Matrix<const M: usize> = SMatrix<Complex<f64>, M, M>;
type Vector<const M: usize> = SVector<Complex<f64>, M>;

impl Transform {
    fn new(n: usize, every: f64) -> Self {
        let length = (2 * n).next_power_of_two();
        let mut planner = FftPlanner::new();
        Self { n, length, every, there: planner.plan_fft_forward(length), back: planner.plan_fft_inverse(length) }
    }

    /// Number of frequencies from 0 to half the sampling rate.
    fn bins(&self) -> usize {
        self.length / 2 + 1
    }

    /// rad/s; a tiny value for the first, at which an integrator has no finite response.
    fn omega(&self, k: usize) -> f64 {
        let step = 2.0 * PI / (self.length as f64 * self.every);
        if k == 0 { 1e-3 * step } else { k as f64 * step }
    }

    fn apply(&self, signal: &[f64]) -> Spectrum {
        let mut all = vec![Complex::new(0.0, 0.0); self.length];
        all.iter_mut().zip(signal).for_each(|(place, value)| place.re = *value);
        self.there.process(&mut all);
        all.truncate(self.bins());
        all
    }

    /// The signal of a spectrum within the time of the trial.
    fn signal(&self, spectrum: &[Complex<f64>]) -> Vec<f64> {
        let mut all = spectrum.to_vec();
        // The ends of the spectrum of a real signal are real.
        all[0].im = 0.0;
        all[self.length / 2].im = 0.0;
        all.extend((1..self.length / 2).rev().map(|k| spectrum[k].conj()));
        self.back.process(&mut all);
        all.iter().take(self.n).map(|value| value.re / self.length as f64).collect()
    }

    /// Σ |X|² over chosen frequencies.
    fn squared(&self, signal: &[f64], is_chosen: &dyn Fn(usize) -> bool) -> f64 {
        self.apply(signal).iter().enumerate().filter(|(k, _)| is_chosen(*k)).map(|(_, x)| x.norm_sqr()).sum()
    }
}

/// Response T of each machine of the family, the nominal one first.
fn responses<const M: usize>(
    family: &Family,
    (design, feedback): (&Design, &Feedback),
    at: At,
    transform: &Transform,
    stop: &dyn Fn() -> bool,
) -> Result<Vec<Vec<Matrix<M>>>> {
    let mut corners: Vec<Corner> = vec![family.nominal()];
    for corner in family.machines.iter().cloned().chain(family.ends()) {
        if !corners.contains(&corner) {
            corners.push(corner);
        }
    }
    let mut all = Vec::with_capacity(corners.len());
    for corner in &corners {
        if stop() {
            return Err(Error::new("interrupted before anything was learned"));
        }
        let plant = family.plant(corner, design, &feedback.corners())?;
        if !Peaks::new(&plant, feedback).is_stable() {
            return Err(Error::new(format!(
                "the loop is not stable on an axis of the family: {}",
                family.words(corner)
            ))
            .next("tune the controller first: `taut tune`; or reduce tune.spread"));
        }
        let response = |k: usize| {
            let [slides, by_drives] = from_commands(&plant, feedback, transform.omega(k));
            match at {
                At::Cart => slides,
                At::Encoder => by_drives,
            }
        };
        all.push((0..transform.bins()).map(response).collect());
    }
    Ok(all)
}

/// L and Q.
struct Rule<const M: usize> {
    gain: Vec<Matrix<M>>,
    kept: Vec<f64>,
    /// |1 − L T|, largest over the family.
    left: Vec<f64>,
}

/// For each sliding part, the next signal that moves it alone, and predicted repetitions.
struct Predictions {
    next: Vec<Vec<f64>>,
    expected: Vec<Vec<f64>>,
    sizes: Vec<Vec<Predicted>>,
}

impl<const M: usize> Rule<M> {
    /// `most` is the largest response relative to which small ones are not inverted.
    fn new(responses: &[Vec<Matrix<M>>], most: f64) -> Result<Self> {
        let own = &responses[0];
        let largest_of = |row: usize| own.iter().map(|t| t.row(row).norm()).fold(0.0, f64::max);
        let rho: [f64; M] = std::array::from_fn(|row| INVERTIBLE * largest_of(row).min(most));
        // T̃₀ = R⁻¹ T₀
        let scaled = |t: &Matrix<M>| Matrix::<M>::from_fn(|row, column| t[(row, column)] / rho[row]);
        // L = s T̃₀ᴴ (T̃₀ T̃₀ᴴ + 1)⁻¹ R⁻¹
        let whole_gain = |t: &Matrix<M>| {
            let t = scaled(t);
            let (adjugate, determinant) = inverse(&(t * t.adjoint() + Matrix::<M>::identity()));
            let gain = over(&t.adjoint(), &adjugate, determinant);
            Matrix::<M>::from_fn(|row, column| gain[(row, column)] / rho[column])
        };
        let mut gain: Vec<Matrix<M>> = own.iter().map(whole_gain).collect();
        let left_of = |gain: &Matrix<M>, k: usize| {
            responses.iter().map(|t| largest(&(Matrix::<M>::identity() - gain * t[k]))).fold(0.0, f64::max)
        };
        let whole: Vec<f64> = gain.iter().enumerate().map(|(k, gain)| left_of(gain, k)).collect();
        for (gain, left) in gain.iter_mut().zip(&whole) {
            *gain *= Complex::from(((1.0 - left) / (1.0 - CONTRACTION)).clamp(0.0, 1.0));
        }
        let left: Vec<f64> = gain.iter().enumerate().map(|(k, gain)| left_of(gain, k)).collect();
        let rise = |t: &Matrix<M>| {
            let share = (smallest(&scaled(t)).ln() / KEPT_FROM.ln()).clamp(0.0, 1.0);
            (0.5 * PI * share).sin().powi(2)
        };
        let kept: Vec<f64> = own.iter().zip(&left).map(|(t, left)| rise(t) * (CONTRACTION / left).min(1.0)).collect();
        if !kept.iter().any(|kept| *kept >= 1.0) {
            let least = whole.iter().copied().fold(f64::INFINITY, f64::min);
            return Err(Error::new(format!(
                "learning would not converge: at every frequency an axis of the family keeps {:.0} % of the error or \
                 more, |1 − L T|",
                100.0 * least
            ))
            .allowed(format!("at most {:.0} %", 100.0 * CONTRACTION))
            .next("reduce tune.spread to what is uncertain after a fit, or fit the machine first: `taut fit`"));
        }
        Ok(Self { gain, kept, left })
    }

    fn contraction(&self) -> f64 {
        self.kept.iter().zip(&self.left).map(|(kept, left)| kept * left).fold(0.0, f64::max)
    }

    /// w⁺ = Q (w + L e)
    fn next(&self, transform: &Transform, errors: &[Vec<f64>], signals: &[Vec<f64>], taper: &[f64]) -> Vec<Vec<f64>> {
        let tapered = |error: &Vec<f64>| -> Vec<f64> { error.iter().zip(taper).map(|(e, share)| e * share).collect() };
        let e: Vec<Spectrum> = errors.iter().map(|error| transform.apply(&tapered(error))).collect();
        let w: Vec<Spectrum> = signals.iter().map(|signal| transform.apply(signal)).collect();
        let next = |k: usize| (vector(&w, k) + self.gain[k] * vector(&e, k)) * Complex::from(self.kept[k]);
        parted((0..transform.bins()).map(next), transform)
    }

    /// Predicted repetitions on each machine.
    fn predicted(
        &self,
        responses: &[Vec<Matrix<M>>],
        transform: &Transform,
        (errors, signals): (&[Vec<f64>], &[Vec<f64>]),
        taper: &[f64],
    ) -> Predictions {
        let next = self.next(transform, errors, signals, taper);
        let mut predictions = Predictions { next: next.clone(), expected: Vec::new(), sizes: vec![Vec::new(); M] };
        for (number, response) in responses.iter().enumerate() {
            let (mut e, mut w, mut after) = (errors.to_vec(), signals.to_vec(), next.clone());
            for trial in 0..PREDICTED {
                // e⁺ = e − T (w⁺ − w)
                let change = |(next, before): (&Vec<f64>, &Vec<f64>)| -> Spectrum {
                    transform.apply(&next.iter().zip(before).map(|(next, before)| next - before).collect::<Vec<_>>())
                };
                let change: Vec<Spectrum> = after.iter().zip(&w).map(change).collect();
                let moved = parted((0..transform.bins()).map(|k| response[k] * vector(&change, k)), transform);
                for (e, moved) in e.iter_mut().zip(moved) {
                    e.iter_mut().zip(moved).for_each(|(e, moved)| *e -= moved);
                }
                for (e, sizes) in e.iter().zip(&mut predictions.sizes) {
                    let size = Size::new(e);
                    match sizes.get_mut(trial) {
                        Some(predicted) => predicted.worst = predicted.worst.or_larger(size),
                        None => sizes.push(Predicted { nominal: size, worst: size }),
                    }
                }
                if (number, trial) == (0, 0) {
                    predictions.expected = e.clone();
                }
                w = after;
                after = self.next(transform, &e, &w, taper);
            }
        }
        predictions
    }
}

/// The values of spectra at a frequency.
fn vector<const M: usize>(spectra: &[Spectrum], k: usize) -> Vector<M> {
    Vector::from_fn(|row, _| spectra[row][k])
}

/// Signals of spectra given frequency by frequency.
fn parted<const M: usize>(all: impl Iterator<Item = Vector<M>>, transform: &Transform) -> Vec<Vec<f64>> {
    let mut spectra: Vec<Spectrum> = vec![Vec::with_capacity(transform.bins()); M];
    for values in all {
        spectra.iter_mut().zip(values.iter()).for_each(|(spectrum, value)| spectrum.push(*value));
    }
    spectra.iter().map(|spectrum| transform.signal(spectrum)).collect()
}
