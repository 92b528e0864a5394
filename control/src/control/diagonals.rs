//! The looser of the two belts of a CoreXY from two spectra, each shaken by one motor while the other holds.
//!
//! Belt A is stretched by x + y less the motion a of its motor, belt B by x − y less that of its own. With the masses
//! m_x and m_y moved along x and y, stiffnesses k and dampings c of the belts, dampings d of the rails, and motor A
//! moved,
//!
//! ```text
//! (K + jωC − ω²M) X = (k_A + jω c_A) (1, 1)ᵀ a,  K = k_A [1 1; 1 1] + k_B [1 −1; −1 1]
//! C = c_A [1 1; 1 1] + c_B [1 −1; −1 1] + diag(d_x, d_y),  M = diag(m_x, m_y)
//! P_x = S f^(2 + p) |X_x/a|² + n_x
//! ```
//!
//! With motor B the force is (k_B + jω c_B) (1, −1)ᵀ b. Klipper's tests have an acceleration proportional to the
//! frequency, so P is that of the acceleration with p = 0 and a common S; n is noise. Belts that are alike give spectra
//! that are alike, whatever the masses. Otherwise, with ε = (k_A − k_B)/(k_A + k_B) and μ = m_y/m_x, the amplitudes of
//! both tests differ by the factors 1 − 2εμ/(1 − μ) at the resonance of x and 1 + 2ε/(1 − μ) at that of y, to the first
//! order in ε.
//!
//! The densities of x and y in both tests are fitted by least squares of their logarithms, with the curves seen through
//! the window of Welch's method. Weights of Cauchy's kind bound the influence of vibrations that the model lacks.

use super::belts::{Belts, Sides};
use super::damping::{REACH, kernel};
use super::spectrum::{Axis, LOWEST, Spectrum};
use crate::chance::quantile;
use crate::number::significant;
use nalgebra::{SMatrix, SVector};
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;

/// Number of variables.
const N: usize = 13;
/// ln of √((k_A + k_B)/m_x)/2π, Hz: the frequency of x with belts that are alike.
const FREQUENCY: usize = 0;
/// ln μ
const MASS: usize = 1;
/// ln(k_B/k_A)
const RATIO: usize = 2;
/// ln S
const LEVEL: usize = 3;
/// ln of S of the second test over that of the first.
const LEVELS: usize = 4;
/// ln of the damping ratio of the belts at the frequency of x.
const BELT: usize = 5;
/// ln((c_B/k_B)/(c_A/k_A))
const BELTS: usize = 6;
/// ln of the damping ratios of the rails along x and y.
const RAIL: [usize; 2] = [7, 8];
/// Angle of the accelerometer about z, rad.
const SKEW: usize = 9;
/// ln of n_x and n_y over the greatest density of their axis.
const NOISE: [usize; 2] = [10, 11];
/// p
const TILT: usize = 12;

type Variables = [f64; N];

/// Variables that spectra may leave open, with the mean and the standard deviation that are expected of them. Both
/// tests are commanded alike, so their levels differ by friction only.
const EXPECTED: [(usize, f64, f64); 9] = [
    (MASS, -0.7, 1.0),
    (RATIO, 0.0, 0.5),
    (LEVELS, 0.0, 0.1),
    (BELT, -3.5, 1.0),
    (BELTS, 0.0, 0.3),
    (RAIL[0], -3.5, 1.0),
    (RAIL[1], -3.5, 1.0),
    (SKEW, 0.0, 0.05),
    (TILT, 0.0, 0.2),
];

/// Least and greatest ln of the noise.
const NOISES: [f64; 2] = [-14.0, -1.0];
/// Added to measured and fitted densities before their logarithm, relative to the greatest of the axis: lower densities
/// hardly count.
const FLOOR: f64 = 0.01;
/// Steps of the curves between two bins.
const PER_BIN: usize = 4;
/// Bins from the lower of the highest peaks of x and y over this, to the higher one times this.
const RANGE: [f64; 2] = [1.6, 1.35];
/// Lowest and highest frequency that is fitted, Hz. Klipper's sweep goes from 5 to 133 Hz by default, and a bin
/// contains its neighbours.
const FITTED: [f64; 2] = [12.0, 128.0];
/// Fewest bins of a spectrum.
const FEWEST: usize = 12;
/// Residuals beyond this many standard deviations lose weight.
const CUT: f64 = 3.0;
/// Standard deviation of the logarithms: at the start of the search, and the least and greatest that it may find.
const DEVIATION: f64 = 0.3;
const DEVIATIONS: [f64; 2] = [0.01, 0.5];
/// Iterations from each start, and from the best of them.
const BRIEF: usize = 12;
const THOROUGH: usize = 30;
/// Standard error of ln(k_B/k_A) that the model's simplifications add: a constant, and relative to the residual. Chosen
/// so that intervals hold with dry friction and modes of frame and mount (`cargo xtask faults`).
const MODEL_ERROR: [f64; 2] = [0.01, 0.2];
/// Greatest root mean square of the residual logarithms.
const MISFIT: f64 = 0.4;
/// Greatest angle of the accelerometer, rad.
const TURNED: f64 = 0.2;

/// Frequencies (Hz), measured and fitted densities along x and y of a test: of acceleration, in the unit of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Frequencies of the bins, Hz.
    pub frequency: Vec<f64>,
    /// Measured densities along x and y.
    pub measured: [Vec<f64>; 2],
    /// Fitted densities along x and y.
    pub fitted: [Vec<f64>; 2],
}

/// A model of both tests.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Natural frequencies, Hz, ascending.
    pub frequencies: [f64; 2],
    /// m_y/m_x
    pub mass_ratio: f64,
    /// Root mean square of ln(measured/fitted).
    pub misfit: f64,
    /// Angle of the accelerometer about z, rad.
    pub turned: f64,
    /// Both tests.
    pub curves: [Curve; 2],
}

/// The belts of a CoreXY from two spectra.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Diagonals {
    /// The statement, or the reason why there is none.
    pub stated: Result<Belts, String>,
    /// The fitted model; none if there was nothing to fit.
    pub model: Option<Model>,
}

impl Diagonals {
    /// Fits the spectra of belts A and B.
    pub fn new(first: &Spectrum, second: &Spectrum) -> Self {
        let refused = |why: String| Self { stated: Err(why), model: None };
        let along = [0, 1].map(|axis: usize| tops([first, second], axis));
        let mut range = [f64::INFINITY, 0.0f64];
        for (tops, axis) in along.iter().zip([Axis::X, Axis::Y]) {
            let Some(&top) = tops.first() else { return refused(format!("there is no peak along {}", axis.word())) };
            if !(FITTED[0]..FITTED[1]).contains(&top) {
                return refused(format!(
                    "the highest peak along {} is at {} Hz; from {} to {} Hz can be fitted, within Klipper's sweep",
                    axis.word(),
                    significant(top, 3),
                    FITTED[0],
                    FITTED[1]
                ));
            }
            range = [range[0].min(top), range[1].max(top)];
        }
        let range = [(range[0] / RANGE[0]).max(FITTED[0]), (range[1] * RANGE[1]).min(FITTED[1])];
        let tests = [first, second].map(|spectrum| Test::new(spectrum, range));
        if let Some(test) = tests.iter().find(|test| test.frequency.len() < FEWEST) {
            let [low, high] = range.map(|f| significant(f, 3));
            return refused(format!(
                "{} frequencies from {low} to {high} Hz are too few: at least {FEWEST} are necessary",
                test.frequency.len()
            ));
        }
        let upright: f64 = tests.iter().map(|test| test.along_z).sum();
        let flat: f64 = tests.iter().flat_map(|test| test.density.iter().flatten()).sum();
        if upright > flat {
            return refused("most of the vibration is along z, which no belt drives".into());
        }
        let data = Data::new(tests);
        let Some((v, error)) = data.searched(&along) else {
            return refused("no model of a CoreXY fits the spectra".into());
        };
        let model = data.model(&v);
        let belts = Belts { sides: Sides::Belts, ratio: v[RATIO].exp(), error };
        let stated = match () {
            () if model.misfit > MISFIT => Err(format!(
                "the curves of a CoreXY with two belts miss the spectra by {} % (at most {} %)",
                significant(100.0 * model.misfit.exp_m1(), 2),
                significant(100.0 * MISFIT.exp_m1(), 2)
            )),
            () if model.turned.abs() > TURNED => Err(format!(
                "the curves of a CoreXY fit only with an accelerometer that is turned by {}° about z (at most {}°)",
                significant(model.turned.abs().to_degrees(), 2),
                significant(TURNED.to_degrees(), 2)
            )),
            () => Ok(belts),
        };
        Self { stated, model: Some(model) }
    }

    /// The statement, or the refusal with its reason, in a sentence.
    pub fn words(&self) -> String {
        match &self.stated {
            Ok(belts) => belts.words(),
            Err(why) => format!("the spectra do not determine which belt is looser: {why}"),
        }
    }

    /// The fitted model, in a sentence.
    pub fn model_words(&self) -> Option<String> {
        let model = self.model.as_ref()?;
        let [low, high] = model.frequencies.map(|f| significant(f, 3));
        Some(format!(
            "a CoreXY with modes of {low} and {high} Hz and {} times the mass along y that it has along x goes through both \
             spectra, {} % off",
            significant(model.mass_ratio, 2),
            significant(100.0 * model.misfit.exp_m1(), 2)
        ))
    }
}

/// Frequencies of the highest peak of an axis in both tests, and of the next one that is separate from it, Hz.
fn tops(tests: [&Spectrum; 2], axis: usize) -> Vec<f64> {
    let mut peaks = Vec::new();
    for test in tests {
        // The density of acceleration; a spectrum is divided by the frequency.
        let points: Vec<(f64, f64)> = test.frequency.iter().zip(&test.axes[axis]).map(|(f, p)| (*f, p * f)).collect();
        let is_peak = |near: &&[(f64, f64)]| near[1].1 > near[0].1 && near[1].1 >= near[2].1;
        peaks.extend(points.windows(3).filter(is_peak).map(|near| near[1]).filter(|peak| peak.0 >= 2.0 * LOWEST));
    }
    peaks.sort_by(|a: &(f64, f64), b| b.1.total_cmp(&a.1));
    let highest = peaks.first().map(|peak| peak.0);
    let next = peaks.iter().map(|peak| peak.0).find(|f| highest.is_some_and(|top| (f / top - 1.0).abs() > 0.1));
    highest.into_iter().chain(next).collect()
}

/// The bins of a test.
struct Test {
    /// Hz
    frequency: Vec<f64>,
    /// Densities of acceleration along x and y.
    density: [Vec<f64>; 2],
    /// Sum of those along z.
    along_z: f64,
    /// Frequencies of the curves, Hz.
    fine: Vec<f64>,
}

impl Test {
    fn new(spectrum: &Spectrum, [low, high]: [f64; 2]) -> Self {
        let rows: Vec<usize> =
            (0..spectrum.frequency.len()).filter(|&k| (low..=high).contains(&spectrum.frequency[k])).collect();
        // A spectrum has P/(f + 0.1 Hz).
        let of = |axis: usize| rows.iter().map(|&k| spectrum.axes[axis][k] * (spectrum.frequency[k] + 0.1)).collect();
        let frequency: Vec<f64> = rows.iter().map(|&k| spectrum.frequency[k]).collect();
        let density: [Vec<f64>; 3] = [0, 1, 2].map(of);
        let along_z = density[2].iter().sum();
        let [x, y, _] = density;
        let margin = reach();
        let first = frequency.first().copied().unwrap_or(low);
        let last = frequency.last().copied().unwrap_or(high);
        let inside = frequency.len().saturating_sub(1).max(1) * PER_BIN;
        let step = (last - first) / inside as f64;
        let at = |k: usize| (first + (k as f64 - margin as f64) * step).max(0.1);
        let fine = (0..=inside + 2 * margin).map(at).collect();
        Self { frequency, density: [x, y], along_z, fine }
    }
}

/// Steps of the curves that the window reaches.
fn reach() -> usize {
    REACH as usize * PER_BIN
}

/// Both tests.
struct Data {
    tests: [Test; 2],
    /// Greatest density of each axis.
    greatest: [f64; 2],
    /// The window's weights.
    window: Vec<f64>,
}

/// Residuals, their derivatives with respect to the variables, and their weights.
struct Linear {
    residuals: Vec<f64>,
    slopes: Vec<SVector<f64, N>>,
    weights: Vec<f64>,
}

impl Data {
    fn new(tests: [Test; 2]) -> Self {
        let top = |axis: usize| tests.iter().flat_map(|test| &test.density[axis]).copied().fold(0.0, f64::max);
        let greatest = [0, 1].map(top);
        let window = kernel(reach() as i32).into_iter().map(|(_, weight)| weight).collect();
        Self { tests, greatest, window }
    }

    /// Fitted densities along x and y of a test.
    fn curve(&self, v: &Variables, which: usize) -> [Vec<f64>; 2] {
        let test = &self.tests[which];
        let (mu, r) = (v[MASS].exp(), v[RATIO].exp());
        // Divided by m_x.
        let omega = TAU * v[FREQUENCY].exp();
        let k = [1.0, r].map(|part| omega * omega * part / (1.0 + r));
        let of_belts = 2.0 * v[BELT].exp() / omega;
        let c = [k[0] * of_belts * (-0.5 * v[BELTS]).exp(), k[1] * of_belts * (0.5 * v[BELTS]).exp()];
        let d = [2.0 * v[RAIL[0]].exp() * omega, 2.0 * v[RAIL[1]].exp() * omega * mu.sqrt()];
        let level = v[LEVEL] + if which == 1 { v[LEVELS] } else { 0.0 };
        let sign = [1.0, -1.0][which];
        let (sine, cosine) = v[SKEW].sin_cos();
        let mut fine = [Vec::with_capacity(test.fine.len()), Vec::with_capacity(test.fine.len())];
        for f in &test.fine {
            let w = TAU * f;
            let [a, b] = [0, 1].map(|i: usize| Complex::new(k[i], w * c[i]));
            // K + jωC − ω²M = [xx xy; xy yy]
            let xx = a + b + Complex::new(-w * w, w * d[0]);
            let yy = a + b + Complex::new(-w * w * mu, w * d[1]);
            let xy = a - b;
            let force = [a, b][which] / (xx * yy - xy * xy);
            let (x, y) = (force * (yy - xy * sign), force * (xx * sign - xy));
            // S f^(2 + p)
            let excited = (level + (2.0 + v[TILT]) * f.ln()).exp();
            fine[0].push(excited * (x * cosine + y * sine).norm_sqr());
            fine[1].push(excited * (y * cosine - x * sine).norm_sqr());
        }
        [0, 1].map(|axis: usize| {
            let noise = self.greatest[axis] * v[NOISE[axis]].exp();
            let seen = |near: &[f64]| near.iter().zip(&self.window).map(|(p, weight)| p * weight).sum::<f64>() + noise;
            fine[axis].windows(self.window.len()).step_by(PER_BIN).map(seen).collect()
        })
    }

    /// ln(measured/fitted) for x and y of both tests, one after the other.
    fn residuals(&self, v: &Variables) -> Vec<f64> {
        let mut all = Vec::new();
        for (which, test) in self.tests.iter().enumerate() {
            for (axis, fitted) in self.curve(v, which).iter().enumerate() {
                let floor = FLOOR * self.greatest[axis];
                all.extend(test.density[axis].iter().zip(fitted).map(|(p, m)| ((p + floor) / (m + floor)).ln()));
            }
        }
        all
    }

    /// True if the frequencies of x and y are among the bins.
    fn holds(&self, v: &Variables) -> bool {
        let bins = &self.tests[0].frequency;
        let within = bins[0].ln()..=bins[bins.len() - 1].ln();
        [v[FREQUENCY], v[FREQUENCY] - 0.5 * v[MASS]].iter().all(|f| within.contains(f))
    }

    /// Σ C² ln(1 + r²/(Cσ)²) + Σ ((v − mean)/deviation)²
    fn cost(&self, v: &Variables, deviation: f64) -> f64 {
        if !self.holds(v) {
            return f64::INFINITY;
        }
        let of_residual = |r: &f64| CUT * CUT * (r / (CUT * deviation)).powi(2).ln_1p();
        let expected = EXPECTED.iter().map(|(i, mean, own)| ((v[*i] - mean) / own).powi(2)).sum::<f64>();
        self.residuals(v).iter().map(of_residual).sum::<f64>() + expected
    }

    fn linear(&self, v: &Variables, deviation: f64) -> Linear {
        const STEP: f64 = 1e-4;
        let residuals = self.residuals(v);
        let mut slopes = vec![SVector::<f64, N>::zeros(); residuals.len()];
        for i in 0..N {
            let mut moved = *v;
            moved[i] += STEP;
            for ((slope, there), here) in slopes.iter_mut().zip(self.residuals(&moved)).zip(&residuals) {
                slope[i] = (there - here) / STEP;
            }
        }
        let weight = |r: &f64| 1.0 / (1.0 + (r / (CUT * deviation)).powi(2)) / (deviation * deviation);
        let weights = residuals.iter().map(weight).collect();
        Linear { residuals, slopes, weights }
    }

    /// Levenberg-Marquardt from a start; returns the variables with their cost.
    fn descended(&self, start: Variables, deviation: f64, iterations: usize) -> (Variables, f64) {
        let (mut v, mut damping) = (start, 1e-2);
        let mut least = self.cost(&v, deviation);
        for _ in 0..iterations {
            let linear = self.linear(&v, deviation);
            let information = linear.information(1.0);
            let mut downhill = SVector::<f64, N>::zeros();
            for ((slope, r), weight) in linear.slopes.iter().zip(&linear.residuals).zip(&linear.weights) {
                downhill -= slope * (r * weight);
            }
            for (i, mean, own) in EXPECTED {
                downhill[i] -= (v[i] - mean) / (own * own);
            }
            let before = least;
            for _ in 0..8 {
                let mut damped = information;
                for i in 0..N {
                    damped[(i, i)] += damping * information[(i, i)] + 1e-9;
                }
                let mut next = v;
                if let Some(solved) = damped.cholesky() {
                    let step = solved.solve(&downhill);
                    (0..N).for_each(|i| next[i] += step[i].clamp(-0.5, 0.5));
                    NOISE.iter().for_each(|&i| next[i] = next[i].clamp(NOISES[0], NOISES[1]));
                }
                let cost = self.cost(&next, deviation);
                if cost < least {
                    (v, least) = (next, cost);
                    damping = (0.2 * damping).max(1e-7);
                    break;
                }
                damping *= 5.0;
            }
            if before - least < 1e-4 {
                break;
            }
        }
        (v, least)
    }

    /// The best variables from several starts, and the standard error of ln(k_B/k_A). `along` has the frequencies of
    /// peaks along x and y.
    fn searched(&self, along: &[Vec<f64>; 2]) -> Option<(Variables, f64)> {
        let mut best: Option<(Variables, f64)> = None;
        for (x, y) in along[0].iter().flat_map(|x| along[1].iter().map(move |y| (x, y))) {
            for ratio in [-0.25, 0.0, 0.25] {
                let mut v = [0.0; N];
                (v[FREQUENCY], v[MASS], v[RATIO]) = (x.ln(), 2.0 * (x / y).ln(), ratio);
                [BELT, RAIL[0], RAIL[1]].iter().for_each(|&i| v[i] = -3.5);
                NOISE.iter().for_each(|&i| v[i] = -8.0);
                v[LEVEL] = middle(self.residuals(&v));
                let found = self.descended(v, DEVIATION, BRIEF);
                if found.1 < best.map_or(f64::INFINITY, |best| best.1) {
                    best = Some(found);
                }
            }
        }
        let mut v = self.descended(best?.0, DEVIATION, THOROUGH).0;
        let mut deviation = DEVIATION;
        for _ in 0..4 {
            // σ = 1.4826 median |r|, of a normal distribution
            let sizes = self.residuals(&v).iter().map(|r| r.abs()).collect();
            deviation = (1.4826 * middle(sizes)).clamp(DEVIATIONS[0], DEVIATIONS[1]);
            v = self.descended(v, deviation, THOROUGH).0;
        }
        let linear = self.linear(&v, deviation);
        let growth = linear.growth(&self.tests);
        let variance = linear.information(growth).try_inverse()?[(RATIO, RATIO)] * growth;
        let added = MODEL_ERROR[0] + MODEL_ERROR[1] * root_mean_square(&linear.residuals);
        (variance >= 0.0).then(|| (v, variance.sqrt().hypot(added)))
    }

    fn model(&self, v: &Variables) -> Model {
        let (mu, r) = (v[MASS].exp(), v[RATIO].exp());
        // det(K − λM) = 0 with K divided by (2πf_x)² m_x: μλ² − (1 + μ)λ + 1 − ε² = 0
        let epsilon = (1.0 - r) / (1.0 + r);
        let root = ((1.0 - mu).powi(2) + 4.0 * mu * epsilon * epsilon).sqrt();
        let frequencies =
            [-1.0, 1.0].map(|sign| v[FREQUENCY].exp() * ((1.0 + mu + sign * root) / (2.0 * mu)).max(0.0).sqrt());
        let curves = [0, 1].map(|which: usize| {
            let test = &self.tests[which];
            let (frequency, measured) = (test.frequency.clone(), test.density.clone());
            Curve { frequency, measured, fitted: self.curve(v, which) }
        });
        let misfit = root_mean_square(&self.residuals(v));
        Model { frequencies, mass_ratio: mu, misfit, turned: v[SKEW], curves }
    }
}

impl Linear {
    /// Σ w s sᵀ + `growth` diag(1/deviation²) of expected variables.
    fn information(&self, growth: f64) -> SMatrix<f64, N, N> {
        let mut sum = SMatrix::<f64, N, N>::zeros();
        for (slope, weight) in self.slopes.iter().zip(&self.weights) {
            sum.ger(*weight, slope, slope, 1.0);
        }
        for (i, _, own) in EXPECTED {
            sum[(i, i)] += growth / (own * own);
        }
        sum
    }

    /// Factor on the variances: the reduced squares, at least 1, times that of correlated neighbours, 1 + 2 Σ ρ_k up to
    /// the first negative ρ_k.
    fn growth(&self, tests: &[Test; 2]) -> f64 {
        let weighted: Vec<f64> =
            self.residuals.iter().zip(&self.weights).map(|(r, weight)| r * weight.sqrt()).collect();
        let total: f64 = weighted.iter().map(|r| r * r).sum();
        let mut parts = Vec::new();
        let mut rest = weighted.as_slice();
        for test in tests {
            for _ in 0..2 {
                let (part, behind) = rest.split_at(test.frequency.len());
                parts.push(part);
                rest = behind;
            }
        }
        let at_lag = |lag: usize| {
            let sum: f64 =
                parts.iter().flat_map(|part| part.iter().zip(part.iter().skip(lag))).map(|(a, b)| a * b).sum();
            sum / total.max(f64::MIN_POSITIVE)
        };
        let correlated: f64 = (1..=6).map(at_lag).take_while(|correlation| *correlation > 0.0).sum();
        (total / (weighted.len() - N) as f64).max(1.0) * (1.0 + 2.0 * correlated)
    }
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

fn middle(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    quantile(&values, 0.5)
}
