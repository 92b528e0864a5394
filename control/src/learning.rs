//! Iterative learning: from the log of a repeated move the signal to add to the command at its next repetition.
//!
//! With the error e = r − y of a trial, the signal w that was added to the command, and the closed loop's response T
//! from there to y, the next signal is
//!
//! ```text
//! w⁺ = Q (w + L e),  L = s T₀*/(|T₀|² + ρ²)                    (T₀ of the machine of the file)
//! ```
//!
//! Signals are finite and known whole, so L and Q need not be causal: both act on their transforms. On a machine with
//! the response T the next error is e − T (w⁺ − w), and the distance of w from its limit shrinks in each repetition by
//! at least
//!
//! ```text
//! max |Q (1 − L T)| ≤ γ < 1                            (M. Norrlöf, S. Gunnarsson 2002)
//! ```
//!
//! in the root of its sum of squares, also where the signal is cut to the time of the move. Where s = 1 would leave
//! more than γ on a machine of the family, s falls, to zero where one would be left with all of its error or more: then
//! |1 − L T| ≤ 1 on all of them, and the error at the limit, (1 − Q)/(1 − Q (1 − L T)) of that without learning, is
//! larger at no frequency. Q is the largest gain of at most 1 with which the bound holds, and falls to zero where T₀ is
//! too small to be inverted; there the feedback is left alone.
//!
//! M. Norrlöf, S. Gunnarsson, "Time and frequency domain convergence properties in iterative learning control", *Int.
//! J. Control* 75 (2002) 1114-1126. D. Bristow, M. Tharayil, A. Alleyne, "A survey of iterative learning control",
//! *IEEE Control Systems Magazine* 26 (2006) 96-114.

use crate::case::{Case, Move};
use crate::control::Added;
use crate::control::feedback::Feedback;
use crate::design::Design;
use crate::error::{Error, Result};
use crate::quantity::rounded;
use crate::tune::{Corner, Family, Peaks, from_command};
use nalgebra::Complex;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::PI;
use std::sync::Arc;

/// γ: the share of the distance from the limit that is left by each repetition at most.
pub const CONTRACTION: f64 = 0.8;

/// ρ over the largest |T₀|, and multiples of ρ between which Q rises from 0 to 1.
const INVERTIBLE: f64 = 0.05;
const KEPT_FROM: f64 = 3.0;

/// Repetitions that are predicted.
const PREDICTED: usize = 8;

/// Most samples of a trial, and least of its rest after the move.
const MOST_SAMPLES: usize = 1 << 17;
const LEAST_REST: usize = 10;

/// Most samples of the controller between two rows of a log.
const COARSEST: f64 = 2.5;

/// The position that a trial was measured by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum At {
    /// The cart.
    Cart,
    /// The controller's measurement, along the belt.
    Encoder,
}

/// A repetition of a move.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// s from the beginning of the move, increasing.
    pub time: Vec<f64>,
    /// m.
    pub position: Vec<f64>,
    /// The measured place.
    pub at: At,
}

/// The size of an error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Size {
    /// Root mean square, m.
    pub rms: f64,
    /// Largest magnitude, m.
    pub peak: f64,
}

impl Size {
    fn of(error: &[f64]) -> Self {
        let sum: f64 = error.iter().map(|e| e * e).sum();
        let peak = error.iter().fold(0.0_f64, |most, e| most.max(e.abs()));
        Self { rms: (sum / error.len().max(1) as f64).sqrt(), peak }
    }

    fn or_larger(self, other: Self) -> Self {
        Self { rms: self.rms.max(other.rms), peak: self.peak.max(other.peak) }
    }
}

/// A repetition to come: on the machine of the file, and the largest over the family.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Predicted {
    /// On the machine of the file.
    pub nominal: Size,
    /// Largest over the family.
    pub worst: Size,
}

/// The learning at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Hz.
    pub frequency: f64,
    /// |1 − L T|, the largest of the family.
    pub left: f64,
    /// Q.
    pub kept: f64,
}

/// The next signal, and what it does.
#[derive(Debug, Clone, PartialEq)]
pub struct Learned {
    /// Between values, s: the controller's sample time.
    pub every: f64,
    /// The signal of the trial, V or A.
    pub before: Vec<f64>,
    /// The next one, V or A.
    pub next: Vec<f64>,
    /// The error of the trial, m: reference less position.
    pub error: Vec<f64>,
    /// The next one on the machine of the file, m.
    pub expected: Vec<f64>,
    /// Size of the error of the trial.
    pub now: Size,
    /// The repetitions to come.
    pub predicted: Vec<Predicted>,
    /// max |Q (1 − L T)| over frequencies and family.
    pub contraction: f64,
    /// Lowest and highest frequency with Q = 1, Hz.
    pub band: [f64; 2],
    /// Share of the squared error of the trial at frequencies with Q = 1.
    pub share: f64,
    /// Along the frequencies.
    pub points: Vec<Point>,
    /// Machines of the family.
    pub axes: usize,
}

impl Learned {
    /// Largest magnitude of the next signal, V or A.
    pub fn largest(&self) -> f64 {
        self.next.iter().fold(0.0, |most, w| most.max(w.abs()))
    }

    /// The next signal as something to add to a command.
    pub fn added(&self) -> Added {
        Added::new(self.every, self.next.clone())
    }
}

/// The next signal of a move from its last repetition, in which `before` was added to the command. Errors: a log that
/// does not cover the move, a controller that is not linear, a loop that is unstable on a machine of the family, a
/// family on which learning would not converge.
pub fn learn(
    case: &Case,
    motion: &Move,
    trial: &Trial,
    before: Option<&Added>,
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
    let error = errors(motion, design, trial)?;
    let (n, every) = (error.len(), design.every);
    let signal = |k: usize| before.map_or(0.0, |added| added.at((k as f64 + 1e-3) * every).0);
    let before: Vec<f64> = (0..n).map(signal).collect();
    let transform = Transform::new(n, every);
    let family = Family::of(case, &case.tune.clone().unwrap_or_default())?;
    let responses = responses(&family, (design, &feedback), trial.at, &transform, stop)?;
    let rule = Rule::new(&responses)?;
    let taper = taper(n, motion.end() / every);
    let predictions = rule.predicted(&responses, &transform, (&error, &before), &taper);
    let now = Size::of(&error);
    let kept = transform.squared(&error, &|k| rule.kept[k] >= 1.0) / transform.squared(&error, &|_| true);
    let within = |k: &usize| rule.kept[*k] >= 1.0;
    let hertz = |k: usize| transform.omega(k) / (2.0 * PI);
    let frequencies = || (0..transform.bins()).filter(within);
    Ok(Learned {
        every,
        now,
        share: if kept.is_finite() { kept } else { 0.0 },
        band: [frequencies().next().map_or(0.0, hertz), frequencies().next_back().map_or(0.0, hertz)],
        contraction: rule.contraction(),
        points: (0..transform.bins())
            .map(|k| Point { frequency: hertz(k), left: rule.left[k], kept: rule.kept[k] })
            .collect(),
        axes: responses.len(),
        next: predictions.next,
        expected: predictions.expected,
        predicted: predictions.sizes,
        before,
        error,
    })
}

/// Reference less position at the controller's samples, m.
fn errors(motion: &Move, design: &Design, trial: &Trial) -> Result<Vec<f64>> {
    let Trial { time, position, .. } = trial;
    let every = design.every;
    let (Some(&first), Some(&last)) = (time.first(), time.last()) else {
        return Err(Error::new("the log has no rows"));
    };
    if time.len() != position.len() || time.iter().chain(position).any(|value| !value.is_finite()) {
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
    let profile = &motion.references(design)[0];
    let mut row = 0;
    let at = |k: usize| {
        let t = k as f64 * every;
        while row + 2 < time.len() && time[row + 1] <= t {
            row += 1;
        }
        let next = (row + 1).min(time.len() - 1);
        let share = if next > row { ((t - time[row]) / (time[next] - time[row])).clamp(0.0, 1.0) } else { 0.0 };
        profile.at(t).position - (position[row] + share * (position[next] - position[row]))
    };
    Ok((0..n).map(at).collect())
}

/// 1 during the move, then down to 0 over the rest, half a cosine: a cart that sticks does not answer as T does.
fn taper(n: usize, end: f64) -> Vec<f64> {
    let rest = (n as f64 - end).max(1.0);
    let at = |k: usize| ((k as f64 - end) / rest).clamp(0.0, 1.0);
    (0..n).map(|k| 0.5 * (1.0 + (PI * at(k)).cos())).collect()
}

/// Transforms of signals as long as a trial, with as much silence behind them.
struct Transform {
    n: usize,
    length: usize,
    every: f64,
    there: Arc<dyn Fft<f64>>,
    back: Arc<dyn Fft<f64>>,
}

type Spectrum = Vec<Complex<f64>>;

impl Transform {
    fn new(n: usize, every: f64) -> Self {
        let length = (2 * n).next_power_of_two();
        let mut planner = FftPlanner::new();
        Self { n, length, every, there: planner.plan_fft_forward(length), back: planner.plan_fft_inverse(length) }
    }

    /// Frequencies from 0 to half the sampling rate.
    fn bins(&self) -> usize {
        self.length / 2 + 1
    }

    /// rad/s; of the first, at which an integrator has no response, next to nothing.
    fn omega(&self, k: usize) -> f64 {
        let step = 2.0 * PI / (self.length as f64 * self.every);
        if k == 0 { 1e-3 * step } else { k as f64 * step }
    }

    fn of(&self, signal: &[f64]) -> Spectrum {
        let mut all = vec![Complex::new(0.0, 0.0); self.length];
        all.iter_mut().zip(signal).for_each(|(place, value)| place.re = *value);
        self.there.process(&mut all);
        all.truncate(self.bins());
        all
    }

    /// The signal of a spectrum within the time of the trial.
    fn signal(&self, spectrum: &[Complex<f64>]) -> Vec<f64> {
        let mut all = spectrum.to_vec();
        // Ends of the spectrum of a real signal are real.
        all[0].im = 0.0;
        all[self.length / 2].im = 0.0;
        all.extend((1..self.length / 2).rev().map(|k| spectrum[k].conj()));
        self.back.process(&mut all);
        all.iter().take(self.n).map(|value| value.re / self.length as f64).collect()
    }

    /// Σ |X|² over chosen frequencies.
    fn squared(&self, signal: &[f64], is_chosen: &dyn Fn(usize) -> bool) -> f64 {
        self.of(signal).iter().enumerate().filter(|(k, _)| is_chosen(*k)).map(|(_, x)| x.norm_sqr()).sum()
    }
}

/// The response T of each machine of the family, that of the file first.
fn responses(
    family: &Family,
    (design, feedback): (&Design, &Feedback),
    at: At,
    transform: &Transform,
    stop: &dyn Fn() -> bool,
) -> Result<Vec<Spectrum>> {
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
        if !Peaks::of(&plant, feedback).is_stable() {
            return Err(Error::new(format!(
                "the loop is not stable on an axis of the family: {}",
                family.words(corner)
            ))
            .next("tune the controller first: `taut tune`; or reduce tune.spread"));
        }
        let response = |k: usize| {
            from_command(&plant, feedback, transform.omega(k)).map(|[cart, encoder]| match at {
                At::Cart => cart,
                At::Encoder => encoder,
            })
        };
        let found: Option<Spectrum> = (0..transform.bins()).map(response).collect();
        all.push(found.ok_or_else(|| Error::new("learning needs a single axis"))?);
    }
    Ok(all)
}

/// L and Q.
struct Rule {
    gain: Spectrum,
    kept: Vec<f64>,
    /// |1 − L T|, the largest of the family.
    left: Vec<f64>,
}

/// The next signal, and the repetitions to come.
struct Predictions {
    next: Vec<f64>,
    expected: Vec<f64>,
    sizes: Vec<Predicted>,
}

impl Rule {
    fn new(responses: &[Spectrum]) -> Result<Self> {
        let own = &responses[0];
        let rho = INVERTIBLE * own.iter().map(|t| t.norm()).fold(0.0, f64::max);
        // L = s T₀*/(|T₀|² + ρ²)
        let mut gain: Spectrum = own.iter().map(|t| t.conj() / (t.norm_sqr() + rho * rho)).collect();
        let left_of =
            |gain: &Complex<f64>, k: usize| responses.iter().map(|t| (1.0 - gain * t[k]).norm()).fold(0.0, f64::max);
        let whole: Vec<f64> = gain.iter().enumerate().map(|(k, gain)| left_of(gain, k)).collect();
        for (gain, left) in gain.iter_mut().zip(&whole) {
            *gain *= ((1.0 - left) / (1.0 - CONTRACTION)).clamp(0.0, 1.0);
        }
        let left: Vec<f64> = gain.iter().enumerate().map(|(k, gain)| left_of(gain, k)).collect();
        let rise = |t: &Complex<f64>| {
            let share = ((t.norm() / rho).ln() / KEPT_FROM.ln()).clamp(0.0, 1.0);
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
    fn next(&self, transform: &Transform, error: &[f64], signal: &[f64], taper: &[f64]) -> Vec<f64> {
        let error: Vec<f64> = error.iter().zip(taper).map(|(e, share)| e * share).collect();
        let (e, w) = (transform.of(&error), transform.of(signal));
        let next = |k: usize| (w[k] + self.gain[k] * e[k]) * self.kept[k];
        transform.signal(&(0..transform.bins()).map(next).collect::<Spectrum>())
    }

    /// The repetitions to come on each machine.
    fn predicted(
        &self,
        responses: &[Spectrum],
        transform: &Transform,
        (error, signal): (&[f64], &[f64]),
        taper: &[f64],
    ) -> Predictions {
        let next = self.next(transform, error, signal, taper);
        let mut predictions = Predictions { next: next.clone(), expected: Vec::new(), sizes: Vec::new() };
        for (number, response) in responses.iter().enumerate() {
            let (mut e, mut w, mut after) = (error.to_vec(), signal.to_vec(), next.clone());
            for trial in 0..PREDICTED {
                // e⁺ = e − T (w⁺ − w)
                let change: Vec<f64> = after.iter().zip(&w).map(|(next, before)| next - before).collect();
                let moved: Spectrum = transform.of(&change).iter().zip(response).map(|(w, t)| w * t).collect();
                e.iter_mut().zip(transform.signal(&moved)).for_each(|(e, moved)| *e -= moved);
                let size = Size::of(&e);
                match predictions.sizes.get_mut(trial) {
                    Some(predicted) => predicted.worst = predicted.worst.or_larger(size),
                    None => predictions.sizes.push(Predicted { nominal: size, worst: size }),
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
