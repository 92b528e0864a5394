//! Frequency responses from logs, without a model: Welch's averages or whole periods, with coherence and intervals, in
//! open and closed loop.
//!
//! Segments of the log are transformed under a window. With U, Y and R the transforms of input, output and reference,
//! and sums over K segments,
//!
//! ```text
//! G = Σ Y R* / Σ U R*                                  the joint input-output method; in open loop R = U
//! γ² = |Σ Y R*|² / (Σ |Y|² Σ |R|²)                     coherence
//! E|ΔG|² = Σ |Y − G U|² Σ |R|² / ((K_e − 1) |Σ U R*|²)  what noise at the output does to G
//! |ΔG| ≤ √(E|ΔG|² F₂,ν(0.95)),  ν = 2 (K_e − 1)          the circle that holds it in 95 of 100
//! ```
//!
//! A window smears: a sum over segments is that of the spectrum about a line, (2/3, 1/6, 1/6) of it from the line and its
//! neighbours under Hann's. Where the input's spectrum rises within that, as Σ U R* does in closed loop towards low
//! frequencies, G would be off by 2 G′ Φ′/(6 Φ) of the lines' distance; so both sums are taken less a sixth of their
//! second difference, which makes the window's second moment zero and E|ΔG|² 1.44 times as large.
//!
//! In closed loop Σ Y U*/Σ |U|² would tend to −1/C where noise is strong, as the controller answers it; the reference
//! knows nothing of noise. Segments overlap by half under Hann's window, which makes K_e = 0.95 K of them count. Of a
//! periodic input segments are whole periods without a window, the first one left out, and only lines that are excited
//! count. All signals are taken as first differences, which leaves G as it is, and keeps the integrator of a position
//! from leaking over the spectrum.
//!
//! J. S. Bendat, A. G. Piersol, *Random Data*, 4th ed., Wiley 2010, chapters 9 and 11; L. Ljung, *System
//! Identification*, 2nd ed., Prentice Hall 1999, section 13.5; R. Pintelon, J. Schoukens, *System Identification: A
//! Frequency Domain Approach*, 2nd ed., Wiley 2012, chapter 2.

mod fit;
mod margins;

pub use fit::{FrfFit, Known, fit};
pub use margins::{Measured, measured};

use crate::case::Case;
use crate::control::measures_cart;
use crate::error::{Error, Result};
use crate::log::{Log, Quantity};
use crate::machine::EncoderPlace;
use nalgebra::Complex;
use rustfft::FftPlanner;
use std::f64::consts::PI;

/// Segments that a record is cut into where nothing is said.
const SEGMENTS: f64 = 16.0;

/// Fewest segments or periods.
const FEWEST: usize = 4;

/// Longest and shortest segment, samples.
const LONGEST: usize = 1 << 16;
const SHORTEST: usize = 16;

/// Share of independent segments among those that overlap by half under Hann's window.
const INDEPENDENT: f64 = 0.947;

/// Share of their second difference over the lines that sums over segments are taken less of: half of the second moment
/// of the power of Hann's window, 1/3 of a line squared.
const SMEARED: f64 = 1.0 / 6.0;

/// Effect on the variance: neighbouring lines are alike by 4/9, the next by 1/36, so that
/// (1 + 2/6)² + 2/36 − 4 (4/3) (1/6) (4/9) + 2/36² = 1.44.
const NOISIER: f64 = 1.44;

/// Least coherence of a point that a fit, a margin or a peak may use.
pub const COHERENT: f64 = 0.5;

/// How a record is cut.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cut {
    /// Length of a segment, s.
    pub segment: Option<f64>,
    /// Period of the input, s: whole periods are averaged.
    pub period: Option<f64>,
}

/// A point of a frequency response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// rad/s.
    pub omega: f64,
    /// G, units of the output per unit of the input.
    pub value: Complex<f64>,
    /// Radius of the circle that holds the true one in 95 of 100 logs.
    pub radius: f64,
    /// √E|ΔG|².
    pub deviation: f64,
    /// γ².
    pub coherence: f64,
}

/// A frequency response from one log.
#[derive(Debug, Clone)]
pub struct Frf {
    /// Of the log.
    pub name: String,
    /// The measured quantity.
    pub quantity: Quantity,
    /// Between samples, s.
    pub every: f64,
    /// Segments or periods.
    pub segments: usize,
    /// Samples in each.
    pub length: usize,
    /// True if those are periods.
    pub periodic: bool,
    /// True if a reference was used.
    pub closed: bool,
    /// By frequency.
    pub points: Vec<Point>,
}

impl Frf {
    /// Points that a fit can use.
    pub fn coherent(&self) -> impl Iterator<Item = &Point> {
        self.points.iter().filter(|point| point.coherence >= COHERENT && point.radius < point.value.norm())
    }

    /// Number of the line that a point is.
    fn line(&self, point: &Point) -> f64 {
        (point.omega * self.length as f64 * self.every / (2.0 * PI)).round()
    }
}

/// The frequency responses of a log, one for each of its outputs that has a sign.
pub fn estimate(log: &Log, cut: &Cut) -> Result<Vec<Frf>> {
    let every = log.interval();
    let uneven = log.time.windows(2).find(|pair| ((pair[1] - pair[0]) / every - 1.0).abs() > 0.01);
    let wrong = |what: String| Error::new(what).in_file(format!("log \"{}\"", log.name));
    if let Some(pair) = uneven {
        return Err(wrong(format!("the samples at {:.6} s and {:.6} s are not {every:.6} s apart", pair[0], pair[1]))
            .allowed("even samples, to 1 %")
            .next("resample the log, or cut it where samples are missing"));
    }
    let (length, step) =
        segments(log.len(), every, cut).map_err(|error| error.in_file(format!("log \"{}\"", log.name)))?;
    let periodic = cut.period.is_some();
    // Of periods the first is the machine taking up its swing.
    let first = if periodic { length } else { 0 };
    let reference = log.reference.as_deref();
    let excitation = reference.unwrap_or(&log.inputs[0]);
    let mut all = Vec::new();
    for output in log.outputs.iter().filter(|output| !output.absolute) {
        if let Some(place) = output.values.iter().position(|value| !value.is_finite()) {
            return Err(wrong(format!("{} has no value at {:.6} s", output.quantity.name(), log.time[place]))
                .next("cut the log where values are missing"));
        }
        let signals = [&log.inputs[0][..], &output.values[..], excitation].map(differences);
        let [u, y, r] = signals.map(|signal| transforms(&signal, first, length, step, periodic));
        if u.len() < FEWEST {
            return Err(wrong(format!("{} segments of {length} samples", u.len()))
                .allowed(format!("at least {FEWEST}"))
                .next("give a shorter --segment, or log for longer"));
        }
        let points = points(&u, &y, &r, every, length, periodic);
        if points.is_empty() {
            return Err(wrong("the input does not change".into())
                .next("excite the axis with a sweep, noise or several sines at once"));
        }
        let (segments, closed) = (u.len(), reference.is_some());
        let (name, quantity) = (log.name.clone(), output.quantity);
        all.push(Frf { name, quantity, every, segments, length, periodic, closed, points });
    }
    if all.is_empty() {
        return Err(wrong("no output has a sign".into()).next("log a position or a speed"));
    }
    Ok(all)
}

/// Samples of a segment, and from one to the next.
fn segments(samples: usize, every: f64, cut: &Cut) -> Result<(usize, usize)> {
    if let Some(period) = cut.period {
        let length = (period / every).round() as usize;
        let is_whole = ((length as f64 * every) / period - 1.0).abs() <= 1e-4;
        if !is_whole || !(SHORTEST..=LONGEST).contains(&length) {
            return Err(Error::new(format!("a period of {period} s is no whole number of samples of {every} s"))
                .allowed(format!("{SHORTEST} to {LONGEST} samples"))
                .next("give the period of the input exactly"));
        }
        return Ok((length, length));
    }
    let wanted = cut.segment.map_or(2.0 * samples as f64 / (SEGMENTS + 1.0), |segment| segment / every);
    let length = match cut.segment {
        // The longest power of two that leaves as many segments.
        None => 1 << (wanted.max(1.0).log2().floor() as usize),
        Some(_) => wanted.round() as usize,
    };
    let length = length & !1;
    if !(SHORTEST..=LONGEST).contains(&length) {
        return Err(Error::new(format!("segments of {length} samples"))
            .allowed(format!("{SHORTEST} to {LONGEST}"))
            .next("give --segment, or a longer log"));
    }
    Ok((length, length / 2))
}

fn differences(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

/// Transforms of the segments from `first` on, at frequencies above zero up to half the sampling rate.
fn transforms(values: &[f64], first: usize, length: usize, step: usize, periodic: bool) -> Vec<Vec<Complex<f64>>> {
    let transform = FftPlanner::new().plan_fft_forward(length);
    let window = |k: usize| match periodic {
        true => 1.0,
        false => 0.5 - 0.5 * (2.0 * PI * k as f64 / length as f64).cos(),
    };
    let window: Vec<f64> = (0..length).map(window).collect();
    let mut all = Vec::new();
    let mut begin = first;
    while begin + length <= values.len() {
        let segment = &values[begin..begin + length];
        let mean = if periodic { 0.0 } else { segment.iter().sum::<f64>() / length as f64 };
        let mut buffer: Vec<Complex<f64>> =
            segment.iter().zip(&window).map(|(value, w)| Complex::new((value - mean) * w, 0.0)).collect();
        transform.process(&mut buffer);
        all.push(buffer[1..length / 2].to_vec());
        begin += step;
    }
    all
}

/// Sums over segments without the second moment of the window; those of whole periods as they are.
fn sharpened(sums: Vec<Complex<f64>>, periodic: bool) -> Vec<Complex<f64>> {
    let mut sharp = sums.clone();
    for k in (1..sums.len().saturating_sub(1)).filter(|_| !periodic) {
        sharp[k] -= (sums[k + 1] - sums[k] * 2.0 + sums[k - 1]) * SMEARED;
    }
    sharp
}

/// G, coherence and interval at every frequency that is excited.
fn points(
    u: &[Vec<Complex<f64>>],
    y: &[Vec<Complex<f64>>],
    r: &[Vec<Complex<f64>>],
    every: f64,
    length: usize,
    periodic: bool,
) -> Vec<Point> {
    let lines = u.first().map_or(0, Vec::len);
    let sum = |a: &[Vec<Complex<f64>>], b: &[Vec<Complex<f64>>], k: usize| -> Complex<f64> {
        a.iter().zip(b).map(|(a, b)| a[k] * b[k].conj()).sum()
    };
    let power: Vec<f64> = (0..lines).map(|k| sum(r, r, k).re).collect();
    // What a difference leaves of a line, |1 − e^{−jωT}|², is no lack of excitation.
    let plain = |k: usize| power[k] / (2.0 * (PI * (k + 1) as f64 / length as f64).sin()).powi(2);
    let most = (0..lines).map(plain).fold(0.0, f64::max);
    // Lines of a multisine stand out; of noise every one is excited.
    let least = if periodic { 1e-4 * most } else { 1e-12 * most };
    let count = u.len() as f64 * if periodic { 1.0 } else { INDEPENDENT };
    let freedom = 2.0 * (count - 1.0);
    // F of 2 and ν degrees of freedom at 95 %: (ν/2) (0.05^(−2/ν) − 1)
    let quantile = 0.5 * freedom * (0.05f64.powf(-2.0 / freedom) - 1.0);
    let crossed = |a: &[Vec<Complex<f64>>]| sharpened((0..lines).map(|k| sum(a, r, k)).collect(), periodic);
    let (yr, ur) = (crossed(y), crossed(u));
    let noisier = if periodic { 1.0 } else { NOISIER };
    // Hann's window spreads the mean that is taken away into the first two lines.
    let first = if periodic { 0 } else { 2 };
    let mut all = Vec::new();
    for k in first..lines {
        let (seen, yr, ur, rr) = (sum(y, r, k), yr[k], ur[k], power[k]);
        if plain(k).is_nan() || plain(k) <= least || ur.norm() == 0.0 {
            continue;
        }
        let g = yr / ur;
        let left: f64 = u.iter().zip(y).map(|(u, y)| (y[k] - g * u[k]).norm_sqr()).sum();
        let variance = noisier * left * rr / ((count - 1.0) * ur.norm_sqr());
        let yy = sum(y, y, k).re;
        all.push(Point {
            omega: 2.0 * PI * (k + 1) as f64 / (length as f64 * every),
            value: g,
            radius: (variance * quantile).sqrt(),
            deviation: variance.sqrt(),
            coherence: if yy > 0.0 { (seen.norm_sqr() / (yy * rr)).min(1.0) } else { 0.0 },
        });
    }
    all
}

/// A response beside the model's.
#[derive(Debug, Clone)]
pub struct Response {
    /// As it was measured.
    pub frf: Frf,
    /// Of the model as the file has it, at the same points; empty where the model has no such quantity.
    pub model: Vec<Complex<f64>>,
    /// Of the model with what was fitted; empty without a fit.
    pub fitted: Vec<Complex<f64>>,
    /// Margins of the case's controller, of the position that it measures.
    pub margins: Option<Measured>,
}

/// All that the logs of a case say.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// Where the model was asked.
    pub known: Known,
    /// By log and output.
    pub responses: Vec<Response>,
    /// Stiffness, damping, delay; or why not.
    pub fit: Result<FrfFit>,
}

/// Measures the responses of all logs of a case, and what follows from them.
pub fn measure(case: &Case, cut: &Cut, known: Known) -> Result<Measurement> {
    case.complete()?;
    let machine = &case.machine;
    let mut frfs = Vec::new();
    for log in case.experiments.iter().filter_map(|experiment| experiment.log.as_ref()) {
        frfs.extend(estimate(log, cut)?);
    }
    if frfs.is_empty() {
        return Err(Error::new("this case has no log to measure a response from").next(
            "give an experiment log = { file = \"log.csv\", time = \"t\", input = \"u\", drive_angle = \"phi\" }",
        ));
    }
    let kinematic: Vec<Frf> = frfs.iter().filter(|frf| is_kinematic(frf.quantity)).cloned().collect();
    let fit = fit(machine, &known, &kinematic);
    let mut fitted = fit.as_ref().map(|fit| fit.curves.clone()).unwrap_or_default().into_iter();
    let place = match (machine.encoder, measures_cart(machine)) {
        (_, true) => Quantity::CartPosition,
        (Some(encoder), _) if encoder.at != EncoderPlace::DrivePulley => Quantity::RotorAngle,
        _ => Quantity::DriveAngle,
    };
    let mut responses = Vec::new();
    for frf in frfs {
        // Without play in a gear the rotor's angle, divided by its ratio, is that of the pulley.
        let is_own = frf.quantity == place || place == Quantity::RotorAngle && frf.quantity == Quantity::DriveAngle;
        let length = if measures_cart(machine) { 1.0 } else { machine.pulley_radius };
        let margins = match &case.controller {
            Some(design) if is_own => measured(&frf, design, machine, length).ok(),
            _ => None,
        };
        let model = fit::model(machine, known.place, known.delay, &frf).unwrap_or_default();
        let fitted = if is_kinematic(frf.quantity) { fitted.next().unwrap_or_default() } else { Vec::new() };
        responses.push(Response { frf, model, fitted, margins });
    }
    Ok(Measurement { known, responses, fit })
}

/// True if a quantity is a position or a speed.
fn is_kinematic(quantity: Quantity) -> bool {
    quantity.is_position() || quantity.is_speed()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::normal;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    /// Intervals of the delay held 92.5 % for 95 %: the fit took noise at neighbouring lines for independent.
    #[test]
    fn noise_at_neighbouring_lines_is_alike_by_what_the_fit_takes() {
        let mut random = Pcg64::seed_from_u64(6);
        let mut sums = [0.0; 4];
        for _ in 0..100 {
            let mut white = || -> Vec<f64> { (0..4096).map(|_| normal(&mut random)).collect() };
            let [u, y] = [white(), white()].map(|values| transforms(&values, 0, 256, 128, false));
            let points = points(&u, &y, &u, 1e-3, 256, false);
            for (distance, sum) in sums.iter_mut().enumerate() {
                let pairs = points.iter().zip(&points[distance..]);
                *sum += pairs.map(|(a, b)| (a.value / a.deviation * (b.value / b.deviation).conj()).re).sum::<f64>()
                    / (points.len() - distance) as f64;
            }
        }
        for (distance, rho) in [(1, fit::ALIKE[0]), (2, fit::ALIKE[1]), (3, 0.0)] {
            let seen = sums[distance] / sums[0];
            assert!((seen - rho).abs() < 0.02, "{distance}: {seen} {rho}");
        }
    }
}
