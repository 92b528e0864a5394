//! Riccati equations by structured doubling.
//!
//! The discrete one, X = Aᵀ X A − Aᵀ X B (R + Bᵀ X B)⁻¹ Bᵀ X A + Q, by the doubling algorithm of E. K.-W. Chu, H.-Y.
//! Fan, W.-W. Lin and C.-S. Wang, "Structure-preserving algorithms for periodic discrete-time algebraic Riccati
//! equations", International Journal of Control 77, 2004; the continuous one, Aᵀ X + X A − X G X + Q = 0, through
//! Cayley's transform (the same, Linear Algebra and its Applications 396, 2005). States are scaled until X has a
//! diagonal of ones, and the result is refined by Newton's method.

use crate::error::{Error, Result};
use crate::linear::eigen::{balance, scaled as balanced};
use nalgebra::{DMatrix, DVector};

/// Largest residual of a solution, relative to the largest term of the equation.
pub(crate) const ACCURACY: f64 = 1e-10;

/// The stabilising solution of a Riccati equation.
#[derive(Debug, Clone)]
pub struct Solution {
    /// X.
    pub x: DMatrix<f64>,
    /// K: the feedback u = −K x.
    pub gain: DMatrix<f64>,
    /// The residual of the equation, relative to the largest of its terms, in scaled states.
    pub residual: f64,
}

const MOST_DOUBLINGS: usize = 100;
const MOST_SCALINGS: usize = 4;

/// The discrete equation; Q and R symmetric, Q not negative, R positive.
pub fn discrete(a: &DMatrix<f64>, b: &DMatrix<f64>, q: &DMatrix<f64>, r: &DMatrix<f64>) -> Result<Solution> {
    let n = a.nrows();
    fits(a, b, q)?;
    if r.shape() != (b.ncols(), b.ncols()) {
        return Err(shapes());
    }
    let Some(inverse) = r.clone().cholesky().map(|r| r.inverse()) else {
        return Err(Error::new("the weight of the command is not positive").allowed("above zero"));
    };
    let mut scale = first_scale(a, q);
    let mut best: Option<Solution> = None;
    for _ in 0..MOST_SCALINGS {
        // x = S x̃
        let (sa, sb, sq) = scaled(a, b, q, &scale);
        let g = &sb * &inverse * sb.transpose();
        let Some(mut x) = doubled(sa.clone(), g, sq.clone()) else { break };
        for _ in 0..3 {
            let residual = discrete_residual(&sa, &sb, &sq, r, &x);
            if best.as_ref().is_none_or(|best| residual < best.residual)
                && let Some(gain) = feedback(&sa, &sb, r, &x)
            {
                let back = DVector::from_fn(n, |i, _| 1.0 / scale[i]);
                best = Some(Solution { x: both_sides(&x, &back), gain: columns(&gain, &back), residual });
            }
            // Newton: X = A_cᵀ X A_c + Q + Kᵀ R K
            let Some(gain) = feedback(&sa, &sb, r, &x) else { break };
            let Some(next) = stein(&(&sa - &sb * &gain), &(&sq + gain.transpose() * r * &gain)) else { break };
            x = next;
        }
        let done = (0..n).all(|i| (0.25..4.0).contains(&x[(i, i)]));
        for i in 0..n {
            if x[(i, i)] > 0.0 {
                // X̃ = S X S has a diagonal of ones.
                scale[i] /= x[(i, i)].sqrt();
            }
        }
        if done {
            break;
        }
    }
    accepted(best)
}

/// The continuous equation with G = B R⁻¹ Bᵀ; the gain is that of `b` and `r`.
pub fn continuous(a: &DMatrix<f64>, b: &DMatrix<f64>, q: &DMatrix<f64>, r: &DMatrix<f64>) -> Result<Solution> {
    let n = a.nrows();
    fits(a, b, q)?;
    let Some(inverse) = r.clone().cholesky().filter(|_| r.nrows() == b.ncols()).map(|r| r.inverse()) else {
        return Err(Error::new("the weight of the command is not positive").allowed("above zero"));
    };
    let mut scale = first_scale(a, q);
    let mut best: Option<Solution> = None;
    for _ in 0..MOST_SCALINGS {
        let (sa, sb, sq) = scaled(a, b, q, &scale);
        let g = &sb * &inverse * sb.transpose();
        // The transform's γ: slightly above all rates of the system, so that A − γ I is regular.
        let gamma = 1.5 * sa.norm().max((g.norm() * sq.norm()).sqrt()).max(f64::MIN_POSITIVE);
        let identity = DMatrix::identity(n, n);
        let shifted = &sa - &identity * gamma;
        let Some(inverse_shifted) = shifted.clone().try_inverse() else { break };
        // W = A_γ + G A_γ⁻ᵀ Q;  A₀ = I + 2γ W⁻¹, G₀ = 2γ A_γ⁻¹ G W⁻ᵀ, H₀ = 2γ W⁻ᵀ Q A_γ⁻¹
        let w = &shifted + &g * inverse_shifted.transpose() * &sq;
        let Some(w) = w.try_inverse() else { break };
        let a0 = &identity + &w * (2.0 * gamma);
        let g0 = &inverse_shifted * &g * w.transpose() * (2.0 * gamma);
        let h0 = w.transpose() * &sq * &inverse_shifted * (2.0 * gamma);
        let Some(x) = doubled(a0, symmetric(g0), symmetric(h0)) else { break };
        let parts = [sa.transpose() * &x, &x * &g * &x, sq.clone()];
        let rest = &parts[0] + parts[0].transpose() - &parts[1] + &parts[2];
        let residual = rest.amax() / parts.iter().map(|p| p.amax()).fold(f64::MIN_POSITIVE, f64::max);
        if best.as_ref().is_none_or(|best| residual < best.residual) {
            let back = DVector::from_fn(n, |i, _| 1.0 / scale[i]);
            let gain = &inverse * sb.transpose() * &x;
            best = Some(Solution { x: both_sides(&x, &back), gain: columns(&gain, &back), residual });
        }
        for i in 0..n {
            if x[(i, i)] > 0.0 {
                scale[i] /= x[(i, i)].sqrt();
            }
        }
    }
    accepted(best)
}

fn shapes() -> Error {
    Error::new("these matrices do not fit each other")
        .allowed("A and Q of n rows and columns, B of n rows, R as B has columns")
}

fn fits(a: &DMatrix<f64>, b: &DMatrix<f64>, q: &DMatrix<f64>) -> Result<()> {
    let n = a.nrows();
    let fits = n > 0 && a.ncols() == n && b.nrows() == n && q.shape() == (n, n);
    if fits { Ok(()) } else { Err(shapes()) }
}

fn accepted(best: Option<Solution>) -> Result<Solution> {
    match best {
        Some(best) if best.residual <= ACCURACY => Ok(best),
        best => Err(Error::new(match best {
            Some(best) => format!("the Riccati equation was solved to {:.0e} only", best.residual),
            None => "the Riccati equation has no stabilising solution".into(),
        })
        .allowed(format!("a residual of up to {ACCURACY:e}"))
        .next("a state without weight, or that the command does not affect, does not decay: give it a weight")),
    }
}

/// The scale that balances A, with the largest weight of a state at 1.
fn first_scale(a: &DMatrix<f64>, q: &DMatrix<f64>) -> DVector<f64> {
    let (n, scale) = (a.nrows(), balance(a));
    let size = (0..n).map(|i| (q[(i, i)] * scale[i] * scale[i]).abs()).fold(0.0, f64::max);
    if size > 0.0 { scale / size.sqrt() } else { scale }
}

fn scaled(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    q: &DMatrix<f64>,
    scale: &DVector<f64>,
) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
    let sb = DMatrix::from_fn(a.nrows(), b.ncols(), |i, j| b[(i, j)] / scale[i]);
    (balanced(a, scale), sb, both_sides(q, scale))
}

fn both_sides(x: &DMatrix<f64>, scale: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(x.nrows(), x.ncols(), |i, j| x[(i, j)] * scale[i] * scale[j])
}

fn columns(gain: &DMatrix<f64>, scale: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(gain.nrows(), gain.ncols(), |i, j| gain[(i, j)] * scale[j])
}

fn symmetric(x: DMatrix<f64>) -> DMatrix<f64> {
    (&x + x.transpose()) * 0.5
}

/// The limit H of the doubling; none if it does not converge.
fn doubled(mut a: DMatrix<f64>, mut g: DMatrix<f64>, mut h: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = a.nrows();
    for _ in 0..MOST_DOUBLINGS {
        // W = I + G H;  A ← A W⁻¹ A,  G ← G + A W⁻¹ G Aᵀ,  H ← H + Aᵀ H W⁻¹ A
        let w = (DMatrix::identity(n, n) + &g * &h).lu();
        let (wa, wg) = (w.solve(&a)?, w.solve(&g)?);
        let more = symmetric(a.transpose() * &h * &wa);
        g = symmetric(&g + &a * wg * a.transpose());
        a = &a * wa;
        h += &more;
        if !h.iter().all(|v| v.is_finite()) {
            return None;
        }
        if more.amax() <= 1e-17 * h.amax() {
            return Some(h);
        }
    }
    None
}

/// X = Aᵀ X A + Q by squaring; none if A is not stable.
fn stein(a: &DMatrix<f64>, q: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let (mut a, mut x) = (a.clone(), symmetric(q.clone()));
    for _ in 0..MOST_DOUBLINGS {
        let more = symmetric(a.transpose() * &x * &a);
        x += &more;
        a = &a * &a;
        if !x.iter().all(|v| v.is_finite()) {
            return None;
        }
        if more.amax() <= 1e-17 * x.amax() {
            return Some(x);
        }
    }
    None
}

/// K = (R + Bᵀ X B)⁻¹ Bᵀ X A
fn feedback(a: &DMatrix<f64>, b: &DMatrix<f64>, r: &DMatrix<f64>, x: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let bx = b.transpose() * x;
    (r + &bx * b).cholesky().map(|inner| inner.solve(&(&bx * a)))
}

fn discrete_residual(a: &DMatrix<f64>, b: &DMatrix<f64>, q: &DMatrix<f64>, r: &DMatrix<f64>, x: &DMatrix<f64>) -> f64 {
    let Some(gain) = feedback(a, b, r, x) else { return f64::INFINITY };
    let parts = [a.transpose() * x * a, a.transpose() * x * b * gain, q.clone(), x.clone()];
    let rest = &parts[0] - &parts[1] + &parts[2] - &parts[3];
    rest.amax() / parts.iter().map(|p| p.amax()).fold(f64::MIN_POSITIVE, f64::max)
}
