//! The stiffness of two belts from two spectra: a CoreXY shaken by either motor while the other holds.
//!
//! Belt A is stretched by x + y less its motor's way a, belt B by x − y. With masses m_x and m_y, stiffnesses k_A and
//! k_B, dampings c, viscous rails d, and the motor of belt A moved by a(ω),
//!
//! ```text
//! (K + jωC − ω²M) X = (k_A + jω c_A) (1, 1)ᵀ a,  K = k_A [1 1; 1 1] + k_B [1 −1; −1 1],  C alike + diag(d_x, d_y)
//! P_x = S f² |X_x/a|² + n_x
//! ```
//!
//! and for belt B (k_B + jω c_B) (1, −1)ᵀ b: Klipper's tests have an acceleration in proportion to the frequency. Two
//! belts alike give two spectra alike, whatever the masses. The logarithms of the densities of x and y of both tests are
//! fitted (Levenberg-Marquardt, with weights that bound the influence of what the model lacks), as seen through the
//! window of Welch's method.

use super::damping::kernel;
use super::spectrum::{LOWEST, Spectrum};
use nalgebra::{DMatrix, DVector};
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;

/// Variables of the fit.
const N: usize = 13;
/// ln of the frequency of x with uncoupled belts, Hz: √((k_A + k_B)/m_x)/2π.
const FREQUENCY: usize = 0;
/// ln m_y/m_x.
const MASS: usize = 1;
/// ln k_B/k_A.
const RATIO: usize = 2;
/// ln S of the first test.
const LEVEL: usize = 3;
/// ln S of the second over that of the first.
const LEVELS: usize = 4;
/// ln of the belts' damping ratio at that frequency.
const BELT: usize = 5;
/// ln of c_B/k_B over c_A/k_A.
const BELTS: usize = 6;
/// ln of the damping ratios of the rails.
const RAIL: [usize; 2] = [7, 8];
/// Angle of the accelerometer about z, rad.
const SKEW: usize = 9;
/// ln of the noise of x and y, relative to the greatest density of each.
const NOISE: [usize; 2] = [10, 11];
/// Power of the frequency by which S f² is off.
const TILT: usize = 12;

/// Expected value and standard deviation of variables that spectra may leave open.
const PRIORS: [(usize, f64, f64); 9] = [
    (MASS, -0.7, 1.0),
    (LEVELS, 0.0, 0.1),
    (BELT, -3.5, 1.0),
    (BELTS, 0.0, 0.3),
    (RAIL[0], -3.5, 1.0),
    (RAIL[1], -3.5, 1.0),
    (SKEW, 0.0, 0.05),
    (TILT, 0.0, 0.2),
    (RATIO, 0.0, 0.5),
];

/// Limits of the variables relative to their start, by the search.
const FLOOR: f64 = 0.01;

/// Steps of the grid between two bins.
const PER_BIN: usize = 4;

/// The densities of x and y of both tests, by [test][axis], in the bins that are fitted.
pub struct Data {
    pub frequency: Vec<f64>,
    pub width: f64,
    pub density: [[Vec<f64>; 2]; 2],
    pub greatest: [f64; 2],
    kernel: Vec<f64>,
    grid: Vec<f64>,
    weights_at: Vec<usize>,
}

impl Data {
    pub fn new(first: &Spectrum, second: &Spectrum, low: f64, high: f64) -> Self {
        let f = &first.frequency;
        let width = (f[f.len() - 1] - f[0]) / (f.len() - 1) as f64;
        let rows: Vec<usize> = (0..f.len()).filter(|&k| f[k] >= low && f[k] <= high).collect();
        let frequency: Vec<f64> = rows.iter().map(|&k| f[k]).collect();
        let of = |spectrum: &Spectrum, axis: usize| -> Vec<f64> {
            rows.iter().map(|&k| spectrum.axes[axis][k] * (spectrum.frequency[k] + 0.1)).collect()
        };
        let density = [[of(first, 0), of(first, 1)], [of(second, 0), of(second, 1)]];
        let greatest =
            [0, 1].map(|axis: usize| density.iter().flat_map(|test| &test[axis]).copied().fold(0.0, f64::max));
        let reach = 3 * PER_BIN;
        let start = frequency[0] - reach as f64 * width / PER_BIN as f64;
        let count = (frequency.len() - 1) * PER_BIN + 2 * reach + 1;
        let step = (frequency[frequency.len() - 1] - frequency[0]) / ((frequency.len() - 1) * PER_BIN) as f64;
        let grid = (0..count).map(|k| (start + k as f64 * step).max(0.1)).collect();
        let weights_at = (0..frequency.len()).map(|k| k * PER_BIN).collect();
        Self { frequency, width, density, greatest, kernel: kernel(reach, PER_BIN), grid, weights_at }
    }

    /// Densities of the model at the bins.
    pub fn model(&self, v: &[f64; N]) -> [[Vec<f64>; 2]; 2] {
        let (mu, r) = (v[MASS].exp(), v[RATIO].exp());
        let ws = TAU * v[FREQUENCY].exp();
        let total = ws * ws;
        let k = [total / (1.0 + r), total * r / (1.0 + r)];
        let of_belt = 2.0 * v[BELT].exp() / ws;
        let c = [k[0] * of_belt * (-0.5 * v[BELTS]).exp(), k[1] * of_belt * (0.5 * v[BELTS]).exp()];
        let d = [2.0 * v[RAIL[0]].exp() * ws, 2.0 * v[RAIL[1]].exp() * ws * mu.sqrt()];
        let (sine, cosine) = v[SKEW].sin_cos();
        let mut fine: [[Vec<f64>; 2]; 2] = Default::default();
        for test in &mut fine {
            for axis in test {
                axis.reserve(self.grid.len());
            }
        }
        for f in &self.grid {
            let w = TAU * f;
            let belt = [Complex::new(k[0], w * c[0]), Complex::new(k[1], w * c[1])];
            let xx = belt[0] + belt[1] + Complex::new(-w * w, w * d[0]);
            let yy = belt[0] + belt[1] + Complex::new(-w * w * mu, w * d[1]);
            let xy = belt[0] - belt[1];
            let determinant = xx * yy - xy * xy;
            for (i, sign) in [1.0, -1.0].into_iter().enumerate() {
                let level = v[LEVEL] + if i == 1 { v[LEVELS] } else { 0.0 } + (2.0 + v[TILT]) * f.ln();
                let g = belt[i] / determinant;
                let (x, y) = (g * (yy - xy * sign), g * (xx * sign - xy));
                let seen = [x * cosine + y * sine, y * cosine - x * sine];
                for axis in 0..2 {
                    fine[i][axis].push(level.exp() * seen[axis].norm_sqr());
                }
            }
        }
        let smeared = |fine: &[f64], axis: usize| -> Vec<f64> {
            let noise = self.greatest[axis] * v[NOISE[axis]].exp();
            let at = |&k: &usize| {
                self.kernel.iter().zip(&fine[k..]).map(|(weight, value)| weight * value).sum::<f64>() + noise
            };
            self.weights_at.iter().map(at).collect()
        };
        [0, 1].map(|test: usize| [0, 1].map(|axis: usize| smeared(&fine[test][axis], axis)))
    }

    /// ln of measured over modelled densities, both with a part of the greatest added, which reduces what is low.
    pub fn residuals(&self, v: &[f64; N]) -> Vec<f64> {
        let model = self.model(v);
        let mut all = Vec::with_capacity(4 * self.frequency.len());
        for test in 0..2 {
            for axis in 0..2 {
                let floor = FLOOR * self.greatest[axis];
                for (p, m) in self.density[test][axis].iter().zip(&model[test][axis]) {
                    all.push(((p + floor) / (m + floor)).ln());
                }
            }
        }
        all
    }
}

/// Result of the search.
pub struct Fitted {
    pub v: [f64; N],
    pub cost: f64,
    pub sigma: f64,
    pub rms: f64,
    pub error: f64,
    pub inflation: f64,
    pub v_error: [f64; N],
}

fn cost(r: &[f64], v: &[f64; N], sigma: f64, cut: f64) -> f64 {
    // Cauchy's: ρ(z) = c² ln(1 + z²/c²)
    let data: f64 = r.iter().map(|r| cut * cut * (1.0 + (r / (sigma * cut)).powi(2)).ln()).sum();
    data + PRIORS.iter().map(|(i, mean, sd)| ((v[*i] - mean) / sd).powi(2)).sum::<f64>()
}

const CUT: f64 = 3.0;

fn normal(data: &Data, v: &[f64; N], sigma: f64) -> (Vec<f64>, DMatrix<f64>, Vec<f64>) {
    let r = data.residuals(v);
    let mut jacobian = DMatrix::zeros(r.len(), N);
    for i in 0..N {
        let h = 1e-4;
        let mut moved = *v;
        moved[i] += h;
        let up = data.residuals(&moved);
        for (k, (u, r)) in up.iter().zip(&r).enumerate() {
            jacobian[(k, i)] = (u - r) / h;
        }
    }
    let w = r.iter().map(|r| 1.0 / (1.0 + (r / (sigma * CUT)).powi(2)) / (sigma * sigma)).collect();
    (r, jacobian, w)
}

fn information(jacobian: &DMatrix<f64>, w: &[f64], share: f64) -> DMatrix<f64> {
    let mut weighted = jacobian.clone();
    for (k, w) in w.iter().enumerate() {
        weighted.row_mut(k).scale_mut(*w);
    }
    let mut a = jacobian.transpose() * weighted;
    for (i, _, sd) in PRIORS {
        a[(i, i)] += share / (sd * sd);
    }
    a
}

fn search(data: &Data, start: [f64; N], sigma: f64, steps: usize) -> ([f64; N], f64) {
    let mut v = start;
    let mut lambda = 1e-2;
    let mut best = cost(&data.residuals(&v), &v, sigma, CUT);
    for _ in 0..steps {
        let (r, jacobian, w) = normal(data, &v, sigma);
        let a = information(&jacobian, &w, 1.0);
        let mut g = DVector::zeros(N);
        for i in 0..N {
            g[i] = -jacobian.column(i).iter().zip(&r).zip(&w).map(|((j, r), w)| j * r * w).sum::<f64>();
        }
        for (i, mean, sd) in PRIORS {
            g[i] -= (v[i] - mean) / (sd * sd);
        }
        let mut is_better = false;
        let before = best;
        for _ in 0..8 {
            let mut damped = a.clone();
            for i in 0..N {
                damped[(i, i)] += lambda * a[(i, i)] + 1e-9;
            }
            let Some(step) = damped.cholesky().map(|c| c.solve(&g)) else {
                lambda *= 10.0;
                continue;
            };
            let mut next = v;
            for i in 0..N {
                next[i] += step[i].clamp(-0.5, 0.5);
            }
            for i in NOISE {
                next[i] = next[i].clamp(-14.0, -1.0);
            }
            let value = cost(&data.residuals(&next), &next, sigma, CUT);
            if value < best {
                (v, best) = (next, value);
                lambda = (lambda * 0.2).max(1e-7);
                is_better = true;
                break;
            }
            lambda *= 5.0;
        }
        if !is_better || before - best < 1e-4 {
            break;
        }
    }
    (v, best)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The highest peaks of an axis, both tests together.
pub fn tops(first: &Spectrum, second: &Spectrum, axis: usize) -> Vec<(f64, f64)> {
    let f = &first.frequency;
    let p: Vec<f64> = (0..f.len())
        .map(|k| if f[k] < 2.0 * LOWEST { 0.0 } else { (first.axes[axis][k] + second.axes[axis][k]) * f[k] })
        .collect();
    let mut peaks: Vec<(f64, f64)> =
        (1..p.len() - 1).filter(|&k| p[k] > p[k - 1] && p[k] >= p[k + 1]).map(|k| (f[k], p[k])).collect();
    peaks.sort_by(|a, b| b.1.total_cmp(&a.1));
    peaks.truncate(2);
    peaks
}

pub fn fit(first: &Spectrum, second: &Spectrum) -> Option<(Data, Fitted)> {
    let (along_x, along_y) = (tops(first, second, 0), tops(first, second, 1));
    let all = [along_x[0].0, along_y[0].0];
    let low = (all[0].min(all[1]) / 1.6).max(12.0);
    let high = (all[0].max(all[1]) * 1.35).min(128.0);
    let data = Data::new(first, second, low, high);
    if data.frequency.len() < 12 {
        return None;
    }
    let mut found: Vec<([f64; N], f64)> = Vec::new();
    for (fx, _) in &along_x {
        for (fy, _) in &along_y {
            for r in [-0.25, 0.0, 0.25] {
                let mut v = [0.0; N];
                v[FREQUENCY] = fx.ln();
                v[MASS] = 2.0 * (fx / fy).ln();
                v[RATIO] = r;
                v[BELT] = -3.5;
                (v[RAIL[0]], v[RAIL[1]]) = (-3.5, -3.5);
                (v[NOISE[0]], v[NOISE[1]]) = (-8.0, -8.0);
                let r = data.residuals(&v);
                v[LEVEL] = median(r);
                found.push(search(&data, v, 0.3, 12));
            }
        }
    }
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut v = search(&data, found[0].0, 0.3, 30).0;
    let mut sigma = 0.3;
    for _ in 0..4 {
        let r = data.residuals(&v);
        sigma = (1.4826 * median(r.iter().map(|r| r.abs()).collect())).clamp(0.01, 0.5);
        v = search(&data, v, sigma, 30).0;
    }
    let (r, jacobian, w) = normal(&data, &v, sigma);
    let n = data.frequency.len();
    let weighted: Vec<f64> = r.iter().zip(&w).map(|(r, w)| r * w.sqrt()).collect();
    let total: f64 = weighted.iter().map(|r| r * r).sum();
    let mut inflation = 1.0;
    for lag in 1..=6 {
        let sum: f64 = weighted.chunks(n).flat_map(|c| c.iter().zip(&c[lag.min(n)..]).map(|(a, b)| a * b)).sum();
        if sum <= 0.0 {
            break;
        }
        inflation += 2.0 * sum / total;
    }
    let scale = (total / (4.0 * n as f64 - N as f64)).max(1.0);
    let a = information(&jacobian, &w, inflation * scale);
    let covariance = a.try_inverse()?.scale(inflation * scale);
    let rms = (r.iter().map(|r| r * r).sum::<f64>() / r.len() as f64).sqrt();
    let error = covariance[(RATIO, RATIO)].sqrt();
    let v_error = std::array::from_fn(|i| covariance[(i, i)].sqrt());
    Some((data, Fitted { v, cost: 0.0, sigma, rms, error, inflation, v_error }))
}
