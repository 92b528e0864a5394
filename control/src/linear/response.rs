//! Frequency response with continuous phase.

use super::eigen::{balance, scaled};
use super::zeros::Zeros;
use super::{Root, StateSpace};
use crate::error::Result;
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::PI;

/// Frequency response of one output.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Response {
    /// Angular frequency, rad/s.
    pub frequency: Vec<f64>,
    /// G(jω), in units of the output per unit of the input.
    pub value: Vec<Complex<f64>>,
    /// Phase, rad: continuous, and in the limit of zero frequency above −2π and at most 0.
    pub phase: Vec<f64>,
}

impl Response {
    /// |G|.
    pub fn magnitude(&self) -> Vec<f64> {
        self.value.iter().map(|g| g.norm()).collect()
    }

    /// 20 lg |G|, dB relative to one unit of the output per unit of the input.
    pub fn decibels(&self) -> Vec<f64> {
        self.value.iter().map(|g| 20.0 * g.norm().log10()).collect()
    }

    /// The phase in degrees.
    pub fn degrees(&self) -> Vec<f64> {
        self.phase.iter().map(|phase| phase.to_degrees()).collect()
    }
}

/// The poles with the zeros and the gain of one output.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Transfer {
    /// Poles, 1/s.
    pub poles: Vec<Complex<f64>>,
    /// Zeros and gain.
    pub zeros: Zeros,
}

impl Transfer {
    /// Integrators N from input to output (negative: it differentiates), and lim s^N G(s) for s → 0: the gain at zero
    /// frequency where N is zero, the steady slope per unit of the input where N is one.
    pub fn low_frequency(&self) -> (i32, f64) {
        let zero = |values: &[Complex<f64>]| values.iter().filter(|v| v.norm() == 0.0).count() as i32;
        let order = zero(&self.poles) - zero(&self.zeros.values);
        // k ∏ (−z) / ∏ (−p), factors in turn so that nothing overflows
        let mut gain = Complex::new(self.zeros.gain, 0.0);
        let mut poles = self.poles.iter().filter(|p| p.norm() > 0.0);
        let mut zeros = self.zeros.values.iter().filter(|z| z.norm() > 0.0);
        loop {
            match (zeros.next(), poles.next()) {
                (None, None) => return (order, gain.re),
                (z, p) => {
                    gain *= z.map_or(Complex::new(1.0, 0.0), |z| -z);
                    gain /= p.map_or(Complex::new(1.0, 0.0), |p| -p);
                }
            }
        }
    }

    /// Phase at ω > 0, rad, continued from ω = 0: every zero of the left half plane turns by +π/2, every pole by −π/2.
    pub fn phase(&self, omega: f64) -> f64 {
        let turned = |omega: f64| -> f64 {
            let sum = |values: &[Complex<f64>]| -> f64 { values.iter().map(|v| turn(*v, omega)).sum() };
            sum(&self.zeros.values) - sum(&self.poles) + if self.zeros.gain < 0.0 { PI } else { 0.0 }
        };
        let start = turned(0.0);
        // From −2π, exclusive, to 0; a limit that is 0 within rounding is 0.
        let whole = (start / (2.0 * PI) - 1e-9).ceil();
        turned(omega) - 2.0 * PI * whole
    }
}

/// Angle of jω − v, continuous in ω ≥ 0; a root on the imaginary axis counts as in the left half plane.
fn turn(v: Complex<f64>, omega: f64) -> f64 {
    if v.norm() == 0.0 {
        return 0.5 * PI;
    }
    let across = if v.re.abs() <= 1e-12 * v.norm() { 0.0 } else { -v.re };
    match across {
        a if a >= 0.0 => (omega - v.im).atan2(a),
        a => PI - (omega - v.im).atan2(-a),
    }
}

/// A range of frequencies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Lowest, rad/s.
    pub from: f64,
    /// Highest, rad/s.
    pub to: f64,
    /// Number of points on a logarithmic scale; more are added around resonances.
    pub points: usize,
}

impl Range {
    /// From a third of the slowest to three times the fastest of poles and zeros, to the full decade.
    pub fn new(poles: &[Complex<f64>], zeros: &[Zeros]) -> Self {
        let all = || poles.iter().chain(zeros.iter().flat_map(|z| &z.values)).map(|v| v.norm()).filter(|v| *v > 0.0);
        // Distant zeros of a lightly damped belt and poles of bristles are not included by default.
        let swings = Root::from_values(poles).into_iter().filter_map(|root| match root {
            Root::Pair { frequency, .. } => Some(frequency),
            _ => None,
        });
        let (low, high) = (all().fold(f64::INFINITY, f64::min), swings.fold(0.0, f64::max));
        let high = if high > 0.0 { high } else { all().fold(0.0, f64::max) };
        let decade = |hertz: f64, round: fn(f64) -> f64| 2.0 * PI * 10f64.powf(round(hertz.log10()));
        match high > 0.0 && low.is_finite() {
            true => Self {
                from: decade((low / 3.0 / (2.0 * PI)).max(1e-3), f64::floor),
                to: decade(high * 3.0 / (2.0 * PI), f64::ceil),
                points: 1000,
            },
            false => Self { from: 0.02 * PI, to: 2000.0 * PI, points: 1000 },
        }
    }

    /// Frequency range for transfers with common poles, and their poles and zeros.
    pub(super) fn of_transfers(transfers: &[Transfer]) -> (Self, Vec<Complex<f64>>) {
        let poles = transfers.first().map_or(&[][..], |transfer| &transfer.poles);
        let zeros: Vec<_> = transfers.iter().map(|transfer| transfer.zeros.clone()).collect();
        let roots = poles.iter().chain(zeros.iter().flat_map(|zeros| &zeros.values)).copied().collect();
        (Self::new(poles, &zeros), roots)
    }

    /// The frequencies, rad/s, ascending; each pair among `roots` has additional points, so that its peak or dip is
    /// resolved.
    pub fn frequencies(&self, roots: &[Complex<f64>]) -> Vec<f64> {
        let (low, high) = (self.from.ln(), self.to.ln());
        let count = self.points.max(2);
        let mut all: Vec<f64> =
            (0..count).map(|i| (low + (high - low) * i as f64 / (count - 1) as f64).exp()).collect();
        // The requested ends, without rounding.
        (all[0], all[count - 1]) = (self.from, self.to);
        for root in roots.iter().filter(|root| root.im > 0.0) {
            let width = (root.re.abs() / root.im).clamp(1e-9, 1.0);
            for k in -12..=12 {
                let away = f64::from(k).signum() * (0.1 * (f64::from(k).abs() * 0.5).exp2() - 0.1).min(4.0) * width;
                all.push(root.im * (1.0 + away));
            }
        }
        all.retain(|omega| *omega >= self.from && *omega <= self.to);
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }
}

impl StateSpace {
    /// G(jω) of every output; ω in rad/s, not on a pole.
    pub fn at(&self, omega: f64) -> Vec<Complex<f64>> {
        let (a, b, c, _) = self.balanced();
        solve(&a, &b, &c, &self.d, Complex::new(0.0, omega))
    }

    /// The responses of the outputs whose `transfers` are given, in the same order, at frequencies in rad/s.
    pub fn responses(&self, transfers: &[Transfer], frequencies: &[f64]) -> Vec<Response> {
        let (a, b, c, _) = self.balanced();
        let at = |omega: &f64| solve(&a, &b, &c, &self.d, Complex::new(0.0, *omega));
        let values: Vec<Vec<Complex<f64>>> = frequencies.iter().map(at).collect();
        let response = |(output, transfer): (usize, &Transfer)| {
            let value: Vec<Complex<f64>> = values.iter().map(|all| all[output]).collect();
            let phase = value.iter().zip(frequencies).map(|(g, omega)| {
                // The angle itself, on the branch determined by the roots.
                let turn = 2.0 * PI;
                g.arg() + turn * ((transfer.phase(*omega) - g.arg()) / turn).round()
            });
            Response { frequency: frequencies.to_vec(), phase: phase.collect(), value }
        };
        transfers.iter().enumerate().map(response).collect()
    }

    /// The transfer of every output: poles, zeros, gain.
    pub fn transfers(&self) -> Result<Vec<Transfer>> {
        let poles = self.poles()?;
        let each = (0..self.outputs.len()).filter_map(|output| self.zeros(output));
        each.map(|zeros| Ok(Transfer { poles: poles.clone(), zeros: zeros? })).collect()
    }

    /// The balanced inner system: A, b, C, and the scale of each state.
    pub(super) fn balanced(&self) -> (DMatrix<f64>, DVector<f64>, DMatrix<f64>, DVector<f64>) {
        let scale = balance(&self.inner.a);
        let c = DMatrix::from_fn(self.inner.c.nrows(), self.inner.c.ncols(), |i, j| self.inner.c[(i, j)] * scale[j]);
        (scaled(&self.inner.a, &scale), self.inner.b.component_div(&scale), c, scale)
    }
}

/// Maximum number of states of a system solved without allocation, since it is evaluated at hundreds of thousands of
/// frequencies.
const SMALL: usize = 12;

/// Replaces x by (s I − A)⁻¹ x by elimination with partial pivoting; false on a pole. For up to [`SMALL`] states.
fn solve_shifted(a: &DMatrix<f64>, s: Complex<f64>, x: &mut [Complex<f64>]) -> bool {
    let n = a.nrows();
    let mut rows = [[Complex::ZERO; SMALL]; SMALL];
    for i in 0..n {
        for j in 0..n {
            rows[i][j] = Complex::new(-a[(i, j)], 0.0);
        }
        rows[i][i] += s;
    }
    for k in 0..n {
        let size = |row: &[Complex<f64>; SMALL]| row[k].norm_sqr();
        let pivot = (k..n).max_by(|&i, &j| size(&rows[i]).total_cmp(&size(&rows[j]))).unwrap_or(k);
        rows.swap(k, pivot);
        x.swap(k, pivot);
        let lead = rows[k][k];
        // NaN is not a pivot either.
        if lead.norm_sqr().partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
            return false;
        }
        let inverse = lead.inv();
        let (above, below) = rows.split_at_mut(k + 1);
        for (row, i) in below.iter_mut().zip(k + 1..n) {
            let factor = row[k] * inverse;
            if factor != Complex::ZERO {
                for j in k + 1..n {
                    row[j] -= factor * above[k][j];
                }
                let own = factor * x[k];
                x[i] -= own;
            }
        }
    }
    for k in (0..n).rev() {
        let mut value = x[k];
        for j in k + 1..n {
            value -= rows[k][j] * x[j];
        }
        x[k] = value / rows[k][k];
    }
    true
}

/// C (s I − A)⁻¹ b + d; NaN on a pole.
pub(super) fn solve(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    c: &DMatrix<f64>,
    d: &DVector<f64>,
    s: Complex<f64>,
) -> Vec<Complex<f64>> {
    let n = a.nrows();
    if n == 0 {
        return d.iter().map(|d| Complex::new(*d, 0.0)).collect();
    }
    if n <= SMALL {
        let mut x = [Complex::ZERO; SMALL];
        x.iter_mut().zip(b.iter()).for_each(|(x, b)| *x = Complex::new(*b, 0.0));
        return match solve_shifted(a, s, &mut x[..n]) {
            true => (0..d.len()).map(|i| (0..n).map(|j| x[j] * c[(i, j)]).sum::<Complex<f64>>() + d[i]).collect(),
            false => vec![Complex::new(f64::NAN, f64::NAN); d.len()],
        };
    }
    let mut shifted = a.map(|v| Complex::new(-v, 0.0));
    for i in 0..a.nrows() {
        shifted[(i, i)] += s;
    }
    let complex = |v: f64| Complex::new(v, 0.0);
    match shifted.lu().solve(&b.map(complex)) {
        Some(x) => (c.map(complex) * x + d.map(complex)).iter().copied().collect(),
        None => vec![Complex::new(f64::NAN, f64::NAN); d.len()],
    }
}
