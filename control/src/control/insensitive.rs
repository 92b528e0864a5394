//! Extra-insensitive shapers for a damped mode, from the equations that define them.
//!
//! With s = ζ + j√(1 − ζ²) and time in undamped periods of the mode designed for, impulses A_i at t_i leave of a mode
//! at x times its frequency, with the same damping ratio,
//!
//! ```text
//! V(x) = |S(x)|,  S(x) = Σ A_i e^{2π s x (t_i − t_n)}                                       (Singer & Seering 1990)
//! ```
//!
//! Their sum is 1, and the tolerance V is reached at the humps, between which S vanishes:
//!
//! | shaper | unknowns | equations |
//! |---|---|---|
//! | EI, three impulses, the last after one damped period | A₁, A₂, t₂, two zeros | S = 0 at both zeros, V(1) = V |
//! | two humps, four impulses | A₁…A₃, t₂…t₄, two zeros, two humps | S = 0 there and at 1, V = V and V′ = 0 at each hump |
//! | three humps, five impulses | A₁…A₄, t₂…t₅, four zeros, two humps | S = 0 at each zero, V = V and V′ = 0 at each hump and at 1 |
//!
//! (W. Singhose, W. Seering, N. Singer 1994; W. Singhose, L. Porter, T. Tuttle, N. Singer 1997.) Without damping the
//! solution is known: V(x) = V T_m(β cos πx/2) with Chebyshev's polynomial. From there Newton's method follows it as
//! the damping grows.

use super::shaper::Kind;
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::PI;

/// By how much the damping ratio grows from one solution to the next.
const STEP: f64 = 0.02;

/// Most iterations of Newton's method, and what is left of the equations when they are solved.
const ITERATIONS: usize = 40;
const SOLVED: f64 = 1e-12;

/// The equations of one shaper at one damping ratio.
struct Equations {
    kind: Kind,
    tolerance: f64,
    /// s = ζ + j√(1 − ζ²).
    decay: Complex<f64>,
}

impl Equations {
    /// Impulses of the shaper.
    fn count(&self) -> usize {
        match self.kind {
            Kind::TwoHumpEi => 4,
            Kind::ThreeHumpEi => 5,
            Kind::Zv | Kind::Mzv | Kind::Zvd | Kind::Ei => 3,
        }
    }

    /// Impulses (time in undamped periods, amplitude) of a vector of unknowns: amplitudes but the last, times but the
    /// first (of EI but the last, too), and frequencies.
    fn impulses(&self, unknown: &DVector<f64>) -> Vec<(f64, f64)> {
        let n = self.count();
        let mut amplitudes: Vec<f64> = unknown.iter().take(n - 1).copied().collect();
        amplitudes.push(1.0 - amplitudes.iter().sum::<f64>());
        let mut times = vec![0.0];
        match self.kind {
            Kind::Ei => times.extend([unknown[2], 1.0 / self.decay.im]),
            Kind::TwoHumpEi | Kind::ThreeHumpEi => times.extend(unknown.iter().skip(n - 1).take(n - 1)),
            Kind::Zv | Kind::Mzv | Kind::Zvd => {}
        }
        times.into_iter().zip(amplitudes).collect()
    }

    /// S and dS/dx.
    fn left(&self, impulses: &[(f64, f64)], x: f64) -> (Complex<f64>, Complex<f64>) {
        let last = impulses.last().map_or(0.0, |impulse| impulse.0);
        let (mut s, mut slope) = (Complex::ZERO, Complex::ZERO);
        for &(t, a) in impulses {
            let rate = self.decay * (2.0 * PI * (t - last));
            let one = (rate * x).exp() * a;
            s += one;
            slope += one * rate;
        }
        (s, slope)
    }

    /// The residual of the equations.
    fn residual(&self, unknown: &DVector<f64>) -> DVector<f64> {
        let impulses = self.impulses(unknown);
        let frequencies: Vec<f64> = unknown.iter().skip(self.knobs()).copied().collect();
        let mut left = Vec::with_capacity(unknown.len());
        let (zeros, humps): (Vec<f64>, Vec<f64>) = match self.kind {
            Kind::TwoHumpEi => (vec![1.0, frequencies[0], frequencies[1]], frequencies[2..].to_vec()),
            Kind::ThreeHumpEi => (frequencies[..4].to_vec(), vec![1.0, frequencies[4], frequencies[5]]),
            Kind::Zv | Kind::Mzv | Kind::Zvd | Kind::Ei => (frequencies, Vec::new()),
        };
        if self.kind == Kind::Ei {
            left.push(self.left(&impulses, 1.0).0.norm_sqr() - self.tolerance * self.tolerance);
        }
        for x in zeros {
            let s = self.left(&impulses, x).0;
            left.extend([s.re, s.im]);
        }
        for x in humps {
            let (s, slope) = self.left(&impulses, x);
            // d|S|²/dx = 2 Re(S* S′)
            left.extend([s.norm_sqr() - self.tolerance * self.tolerance, 2.0 * (s.conj() * slope).re]);
        }
        DVector::from_vec(left)
    }

    /// Unknown amplitudes and times.
    fn knobs(&self) -> usize {
        if self.kind == Kind::Ei { 3 } else { 2 * (self.count() - 1) }
    }

    /// By Newton's method with differences.
    fn solve(&self, mut unknown: DVector<f64>) -> Option<DVector<f64>> {
        for _ in 0..ITERATIONS {
            let left = self.residual(&unknown);
            if !left.amax().is_finite() {
                return None;
            }
            if left.amax() < SOLVED {
                return Some(unknown);
            }
            let n = unknown.len();
            let mut jacobian = DMatrix::zeros(n, n);
            for j in 0..n {
                let h = 1e-6;
                let at = |by: f64| {
                    let mut moved = unknown.clone();
                    moved[j] += by;
                    self.residual(&moved)
                };
                jacobian.set_column(j, &((at(h) - at(-h)) / (2.0 * h)));
            }
            unknown -= jacobian.lu().solve(&left)?;
        }
        None
    }
}

/// The unknowns without damping: V(x) = V T_m(β cos πx/2), m the number of zeros.
fn undamped(kind: Kind, tolerance: f64, amplitudes: &[f64]) -> DVector<f64> {
    let n = amplitudes.len();
    let m = (n - 1) as f64;
    let beta = ((1.0 / tolerance).acosh() / m).cosh();
    let at = |angle: f64| 2.0 / PI * (angle.cos() / beta).acos();
    let zeros: Vec<f64> = (0..n - 1).map(|k| at((2 * k + 1) as f64 * PI / (2.0 * m))).collect();
    let humps: Vec<f64> = (1..n - 1).map(|k| at(k as f64 * PI / m)).collect();
    let mut unknown: Vec<f64> = amplitudes[..n - 1].to_vec();
    match kind {
        Kind::TwoHumpEi => {
            unknown.extend([0.5, 1.0, 1.5, zeros[0], zeros[2]]);
            unknown.extend(humps);
        }
        Kind::ThreeHumpEi => {
            unknown.extend([0.5, 1.0, 1.5, 2.0]);
            unknown.extend(zeros);
            unknown.extend([humps[0], humps[2]]);
        }
        Kind::Zv | Kind::Mzv | Kind::Zvd | Kind::Ei => {
            unknown.push(0.5);
            unknown.extend(zeros);
        }
    }
    DVector::from_vec(unknown)
}

/// Impulses (time in undamped periods, amplitude) of an extra-insensitive shaper whose amplitudes without damping are
/// `amplitudes`; none where the equations have no solution with positive impulses in that order.
pub(super) fn impulses(kind: Kind, tolerance: f64, damping: f64, amplitudes: &[f64]) -> Option<Vec<(f64, f64)>> {
    let mut unknown = undamped(kind, tolerance, amplitudes);
    let steps = (damping / STEP).ceil().max(1.0) as usize;
    let mut found = Vec::new();
    for k in 0..=steps {
        let zeta = damping * k as f64 / steps as f64;
        let decay = Complex::new(zeta, (1.0 - zeta * zeta).sqrt());
        let equations = Equations { kind, tolerance, decay };
        unknown = equations.solve(unknown)?;
        found = equations.impulses(&unknown);
    }
    let is_ordered = found.windows(2).all(|pair| pair[0].0 < pair[1].0);
    (is_ordered && found.iter().all(|impulse| impulse.1 > 0.0)).then_some(found)
}
