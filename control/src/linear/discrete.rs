//! Discrete-time models of a machine for a sampled controller.

use super::StateSpace;
use super::eigen::norm;
use super::response::solve;
use super::zeros::{Zeros, relative_degree, zeros};
use crate::error::{Error, Result};
use nalgebra::{Complex, DMatrix, DVector};

/// The input between samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Hold {
    /// Zero-order hold, as of a converter. Exact.
    #[default]
    Zero,
    /// First-order hold, linear between samples (triangle hold); exact for such inputs.
    First,
    /// The bilinear rule s = (2/T) (z − 1)/(z + 1): an approximation.
    Tustin,
}

impl Hold {
    /// Its name, and a remark if it is approximate.
    pub fn words(self) -> &'static str {
        match self {
            Hold::Zero => "zero-order hold, exact",
            Hold::First => "first-order hold, exact for such inputs",
            Hold::Tustin => "Tustin's rule, an approximation",
        }
    }
}

/// Maximum delay of an input, in samples.
const MOST_DELAY: f64 = 100.0;

/// `x[k+1] = A x[k] + b u[k]`, `y[k] = C x[k] + d u[k]`.
///
/// With a first-order hold or Tustin's rule, x is not the state of the machine at the sample (it contains a part of the
/// input, or has another scale); y is its output.
#[derive(Debug, Clone)]
pub struct Discrete {
    /// T, s.
    pub sample_time: f64,
    /// Interpolation of the input between samples.
    pub hold: Hold,
    /// Delay of the input, s.
    pub delay: f64,
    /// Names of the states: those of the machine, then pending inputs, the latest first.
    pub states: Vec<String>,
    /// A.
    pub a: DMatrix<f64>,
    /// b.
    pub b: DVector<f64>,
    /// C.
    pub c: DMatrix<f64>,
    /// d.
    pub d: DVector<f64>,
    /// A − I, b and C in inner coordinates, balanced.
    inner: (DMatrix<f64>, DVector<f64>, DMatrix<f64>),
    poles: Vec<Complex<f64>>,
}

impl StateSpace {
    /// Model for a sample time T > 0, s, and an input delay ≥ 0, s, which requires a zero-order hold.
    ///
    /// With a zero-order hold A is e^{A T} and b is ∫ e^{A t} b dt, from one matrix exponential. A delayed input acts
    /// in two parts: u[k − l − 1] until the delay is over, u[k − l] from then on.
    pub fn discrete(&self, sample_time: f64, hold: Hold, delay: f64) -> Result<Discrete> {
        let t = sample_time;
        let allowed = |what: String, allowed: &str| Err(Error::new(what).allowed(allowed));
        if !(t > 0.0 && t.is_finite()) {
            return allowed(format!("a sample time of {t} s is invalid"), "above zero");
        }
        if !(0.0..=MOST_DELAY * t).contains(&delay) {
            return allowed(format!("an input cannot be late by {delay} s"), "from 0 to 100 sample times");
        }
        if delay > 0.0 && hold != Hold::Zero {
            return allowed(
                "a delay requires an input that is held between samples".into(),
                "a zero-order hold with a delay",
            );
        }
        let n = self.a.nrows();
        if n == 0 {
            return allowed("no body can move, so there is nothing to sample".into(), "a stage of which a body moves");
        }
        let (a, b, c, scale) = self.balanced();
        let (change, input, output, direct) = match hold {
            Hold::Zero => {
                let (change, gamma, _) = held(&a, &b, t);
                (change, gamma, c, self.d.clone())
            }
            Hold::First => {
                // Franklin, Powell & Workman: Γ₁ + (Φ − I) Γ₂ and d + C Γ₂, Γ₂ = ∫∫ e^{A t} b / T
                let (change, gamma, ramp) = held(&a, &b, t);
                let ramp = ramp / t;
                let input = gamma + &change * &ramp;
                (change, input, c.clone(), &self.d + &c * ramp)
            }
            Hold::Tustin => {
                // (I − A T/2)⁻¹ A T = Φ − I, (I − A T/2)⁻¹ b T, C (I − A T/2)⁻¹, d + C b/2
                let Some(inverse) = (DMatrix::identity(n, n) - &a * (0.5 * t)).try_inverse() else {
                    return allowed(format!("a sample time of {t} s puts a pole at infinity"), "another one");
                };
                let input = &inverse * &b * t;
                let output = &c * &inverse;
                let direct = &self.d + &c * &input * 0.5;
                (&inverse * &a * t, input, output, direct)
            }
        };
        let poles = self.poles()?;
        let poles = poles.into_iter().map(|s| match hold {
            Hold::Tustin => (Complex::new(1.0, 0.0) + s * (0.5 * t)) / (Complex::new(1.0, 0.0) - s * (0.5 * t)),
            _ => (s * t).exp(),
        });
        let poles: Vec<Complex<f64>> = poles.collect();
        let outer = |m: &DMatrix<f64>| {
            let back = DMatrix::from_fn(n, n, |i, j| m[(i, j)] * scale[i] / scale[j]);
            &self.inner.outward * back * &self.inner.inward
        };
        let out = |v: &DVector<f64>| &self.inner.outward * v.component_mul(&scale);
        let c_outer = match hold {
            Hold::Tustin => DMatrix::from_fn(output.nrows(), n, |i, j| output[(i, j)] / scale[j]) * &self.inner.inward,
            _ => self.c.clone(),
        };
        let mut model = Discrete {
            sample_time: t,
            hold,
            delay,
            states: self.states.iter().map(|state| state.name.to_string()).collect(),
            a: DMatrix::identity(n, n) + outer(&change),
            b: out(&input),
            c: c_outer,
            d: direct,
            inner: (change, input, output),
            poles,
        };
        if delay > 0.0 {
            let whole = (delay / t * (1.0 + 1e-12)).floor();
            let rest = delay - whole * t;
            let rest = if rest > 1e-12 * t { rest } else { 0.0 };
            // From kT on the input is u[k−l−1] for the rest of the delay, then u[k−l]:
            // x[k+1] = Φ x + Φ(T − m) Γ(m) u[k−l−1] + Γ(T − m) u[k−l]
            let (later, new, _) = held(&a, &b, t - rest);
            let (_, gamma, _) = held(&a, &b, rest);
            let old = &gamma + later * &gamma;
            let rest = (rest > 0.0).then_some(old);
            model.delayed(whole as usize, rest.as_ref().map(|old| (old, &new)), &out);
        }
        Ok(model)
    }
}

/// e^{A t} − I, ∫₀ᵗ e^{A s} b ds and ∫₀ᵗ ∫₀ˢ e^{A q} b dq ds.
fn held(a: &DMatrix<f64>, b: &DVector<f64>, t: f64) -> (DMatrix<f64>, DVector<f64>, DVector<f64>) {
    let n = a.nrows();
    // ẋ = A x + b u, u̇ = w, ẇ = 0, with u and w in units that give entries of similar size
    let size = norm(a).max(1.0 / t.max(f64::MIN_POSITIVE)).log2().round().exp2();
    let unit = if b.amax() > 0.0 { (b.amax() / size).log2().round().exp2() } else { 1.0 };
    let mut whole = DMatrix::zeros(n + 2, n + 2);
    whole.view_mut((0, 0), (n, n)).copy_from(a);
    whole.view_mut((0, n), (n, 1)).copy_from(&(b / unit));
    whole[(n, n + 1)] = size;
    let change = exponential(&whole, t);
    let column = |j: usize| -> DVector<f64> { change.view((0, j), (n, 1)).column(0).into_owned() };
    (change.view((0, 0), (n, n)).into_owned(), column(n) * unit, column(n + 1) * (unit / size))
}

/// e^{A t} − I: a Taylor sum at t/2^k, ‖A‖ t/2^k ≤ 1/4, and k doublings P ← 2 P + P², which keep the relative accuracy
/// of small changes.
fn exponential(matrix: &DMatrix<f64>, t: f64) -> DMatrix<f64> {
    let doublings = (4.0 * norm(matrix) * t).log2().ceil().clamp(0.0, 1000.0) as i32;
    let x = matrix * (t / f64::from(doublings).exp2());
    // X (I + X/2 (I + X/3 (…)))
    let mut sum = DMatrix::identity(x.nrows(), x.ncols());
    for k in (2..=15).rev() {
        sum = DMatrix::identity(x.nrows(), x.ncols()) + &x * sum / f64::from(k);
    }
    let mut change = x * sum;
    for _ in 0..doublings {
        change = &change * 2.0 + &change * &change;
    }
    change
}

impl Discrete {
    /// Poles z = e^{s T} (different for Tustin's rule), then those at zero of a delayed input.
    pub fn poles(&self) -> &[Complex<f64>] {
        &self.poles
    }

    /// Zeros z of an output, and its gain; none for an unknown output.
    pub fn zeros(&self, output: usize) -> Option<Result<Zeros>> {
        let d = *self.d.get(output)?;
        let (change, input, rows) = &self.inner;
        // In terms of z − 1, the eigenvalues of A − I.
        let row = rows.row(output).transpose();
        let found = zeros(change, input, &row, d, relative_degree(change, input, &row, d));
        Some(found.map(|found| Zeros { values: found.values.into_iter().map(|v| v + 1.0).collect(), gain: found.gain }))
    }

    /// G(e^{jωT}) of every output; ω in rad/s.
    pub fn at(&self, omega: f64) -> Vec<Complex<f64>> {
        // e^{jθ} − 1 = 2 j sin(θ/2) e^{jθ/2}
        let half = 0.5 * omega * self.sample_time;
        let shift = Complex::new(0.0, 2.0 * half.sin()) * Complex::new(0.0, half).exp();
        let (change, input, rows) = &self.inner;
        solve(change, input, rows, &self.d, shift)
    }

    /// Delays the input by `whole` samples, and by a part of one more if `parts` gives the effects of the older and the
    /// newer input.
    fn delayed(
        &mut self,
        whole: usize,
        parts: Option<(&DVector<f64>, &DVector<f64>)>,
        out: &dyn Fn(&DVector<f64>) -> DVector<f64>,
    ) {
        let n = self.a.nrows();
        let late = whole + usize::from(parts.is_some());
        if late == 0 {
            // Less than rounding.
            return;
        }
        let outputs = self.c.nrows();
        // States u[k−1], u[k−2], … u[k−late]
        let extended =
            |a: &DMatrix<f64>, b: &DVector<f64>, c: &DMatrix<f64>, ends: Option<[DVector<f64>; 2]>, less: f64| {
                let mut big = DMatrix::zeros(n + late, n + late);
                big.view_mut((0, 0), (n, n)).copy_from(a);
                let mut input = DVector::zeros(n + late);
                let mut rows = DMatrix::zeros(outputs, n + late);
                rows.view_mut((0, 0), (outputs, n)).copy_from(c);
                let [older, newer] = ends.unwrap_or([b.clone(), DVector::zeros(n)]);
                big.view_mut((0, n + late - 1), (n, 1)).copy_from(&older);
                if late >= 2 {
                    let sum = big.view((0, n + late - 2), (n, 1)) + newer;
                    big.view_mut((0, n + late - 2), (n, 1)).copy_from(&sum);
                } else {
                    input.rows_mut(0, n).copy_from(&newer);
                }
                input[n] = 1.0;
                for i in 0..late {
                    big[(n + i, n + i)] -= less;
                    if i > 0 {
                        big[(n + i, n + i - 1)] = 1.0;
                    }
                }
                (big, input, rows)
            };
        let ends = parts.map(|(older, newer)| [older.clone(), newer.clone()]);
        let outer_ends = parts.map(|(older, newer)| [out(older), out(newer)]);
        let (change, input, rows) = &self.inner;
        let mut inner = extended(change, input, rows, ends, 1.0);
        let (a, b, c) = extended(&self.a, &self.b, &self.c, outer_ends, 0.0);
        (self.a, self.b, self.c) = (a, b, c);
        for output in 0..outputs {
            // The output at a sample contains the input acting at that time.
            let direct = std::mem::take(&mut self.d[output]);
            self.c[(output, n + late - 1)] += direct;
            inner.2[(output, n + late - 1)] += direct;
        }
        self.inner = inner;
        self.states.extend((1..=late).map(|k| format!("input_{k}_samples_ago")));
        self.poles.extend(std::iter::repeat_n(Complex::new(0.0, 0.0), late));
    }
}
