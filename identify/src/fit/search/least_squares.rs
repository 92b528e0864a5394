//! Bounded non-linear least squares: Levenberg and Marquardt's method with an active set for the bounds.
//!
//! min ½ Σ ρ(rᵢ(x)) with l ≤ x ≤ u. Each step solves
//!
//! ```text
//! min ‖J d + r‖² + λ ‖D d‖²        D = greatest column norms of J so far (Moré 1978)
//! ```
//!
//! by QR, with variables that would leave the box held at its edge. Nothing counts as converged but what passes the
//! test of the projected gradient: the Gauss-Newton step in the variables that are free to move promises less than
//! `tolerance` of a standard error, and no variable at its bound is pushed inwards.
//!
//! Logs with dry friction make the cost kinked where sticks and slips change their order. Where no damped step helps
//! and the test is not passed, a bundle of exact gradients goes on (`bundle.rs`), which knows a minimum on kinks. Where
//! gradients are none or do not lead there, derivatives over longer steps are tried, and then an evolution strategy
//! that needs none, before it is called stalled.

use super::bundle::{self, Coordinates};
use super::cmaes;
use super::point::{Ending, Minimum, Options, cost_of};
use super::triangle::shortened;
use crate::fit::asked::residuals::{Bounds, Differences, Residuals};
use crate::solve::Flow;
use nalgebra::{DMatrix, DVector};

/// Steps of coarse derivatives, in standard errors of a variable by itself, tried one after the other.
const COARSER: [f64; 2] = [1.0, 10.0];

/// So many standard errors from where it leads, a search takes derivatives over this part of a standard error: where
/// the cost has kinks, they see past the small ones; where it has none, they are as good as others.
const NEAR: f64 = 1.0;
const FINE: f64 = 0.3;

/// Most variables that are searched by evolution.
const MOST_EVOLVED: usize = 16;

/// Generations without a gain that shows, after which an evolution ends.
const BARREN: usize = 8;

/// Where the cost has kinks, the standard errors that the last step may promise: all the gradients around together, or
/// one by itself, and no step of any length fulfilled it.
const KINK: f64 = 0.1;

/// Two steps after each other that gain less than this many standard errors, and little of what they promised, are at a
/// kink; and so are steps after which twice that is still promised.
const SHOWS: f64 = 0.1;

/// Searches from `start` for the least cost. `watch` sees the best point and its cost after each step, and may end it.
pub fn minimise(
    problem: &mut dyn Residuals,
    start: &[f64],
    bounds: &Bounds,
    options: &Options,
    watch: &mut dyn FnMut(&[f64], f64) -> Flow,
) -> Minimum {
    let (n, rows) = (start.len(), problem.rows());
    let inside = |x: f64, j: usize| x.clamp(bounds.low[j], bounds.high[j]);
    let x: Vec<f64> = start.iter().enumerate().map(|(j, &x)| inside(x, j)).collect();
    let mut best = Minimum {
        residuals: vec![0.0; rows],
        cost: f64::INFINITY,
        jacobian: DMatrix::zeros(rows, n),
        decrement: f64::INFINITY,
        at_bound: vec![false; n],
        ending: Ending::Failed,
        coarse: 0.0,
        pieces: 1,
        evolved: 0,
        iterations: 0,
        evaluations: 1,
        x,
    };
    if !problem.evaluate(&best.x, &mut best.residuals) || !best.residuals.iter().all(|r| r.is_finite()) {
        return best;
    }
    best.cost = cost_of(&best.residuals, options.huber);
    let mut how = if options.frugal { Differences::Forward } else { Differences::Central };
    let mut lambda: Option<f64> = None;
    let mut grow = 2.0;
    let mut scale = DVector::zeros(n);
    let mut trial = vec![0.0; rows];
    let (mut evolved, mut coarser, mut slow) = (0, 0, 0);
    let mut balanced = false;
    // The Jacobian at a trial point that was taken, and whether trial points are likely to be.
    let (mut ahead, mut likely): (Option<DMatrix<f64>>, bool) = (None, true);
    loop {
        if watch(&best.x, best.cost) == Flow::Stop {
            best.ending = Ending::Interrupted;
            return best;
        }
        let own = ahead.take().or_else(|| problem.jacobian(&best.x, &best.residuals, bounds, &how));
        let Some(jacobian) = own else {
            best.ending = Ending::Stalled;
            return best;
        };
        best.iterations += 1;
        best.jacobian = jacobian;
        let is_exact = problem.is_exact();
        let model = Linear::new(&best, options.huber);
        for j in 0..n {
            scale[j] = f64::max(scale[j], model.norm(j));
        }
        let gradient = model.gradient();
        // At a bound and pushed outwards: not free.
        let held: Vec<bool> = (0..n)
            .map(|j| {
                (best.x[j] <= bounds.low[j] && gradient[j] >= 0.0)
                    || (best.x[j] >= bounds.high[j] && gradient[j] <= 0.0)
            })
            .collect();
        best.at_bound.clone_from(&held);
        let newton = model.step(&held, &scale, 0.0);
        let freedom = (rows.saturating_sub(n)).max(1) as f64;
        let spread = (2.0 * best.cost / freedom).sqrt();
        // What is left of logs that a model made is what rounding made of them.
        let exact = spread <= options.rounding;
        let deviation = if exact { options.rounding } else { spread * inflation(&best.residuals, n) };
        best.decrement = model.reach(&newton) / deviation.max(f64::MIN_POSITIVE);
        let tiny = (0..n).all(|j| newton[j].abs() <= 1e-11 * best.x[j].abs().max(1.0));
        if best.decrement <= options.tolerance || tiny {
            if how == Differences::Central || coarser > 0 || is_exact {
                best.ending = Ending::Converged;
                return best;
            }
            how = Differences::Central;
            continue;
        }
        if best.decrement < NEAR && how == Differences::Forward && !is_exact {
            let errors = model.errors(&held, deviation);
            how = Differences::Coarse(errors.iter().map(|error| FINE * error).collect());
        } else if best.decrement < 100.0 * options.tolerance && coarser == 0 {
            how = Differences::Central;
        }
        if best.iterations >= options.iterations {
            best.ending = Ending::OutOfIterations;
            return best;
        }

        let mut damping = lambda.unwrap_or(1e-3);
        let mut accepted = false;
        for _ in 0..30 {
            let step = within(&model, &best.x, bounds, &held, &scale, damping);
            let x: Vec<f64> = (0..n).map(|j| inside(best.x[j] + step[j], j)).collect();
            let promised = model.promise(&step);
            if promised <= 0.0 || x == best.x {
                damping = (damping * grow).max(1e-12);
                grow *= 2.0;
                if x == best.x {
                    break;
                }
                continue;
            }
            best.evaluations += 1;
            // Exact derivatives come with the residuals, for little more than these.
            let mut with = None;
            let good = if is_exact && likely {
                with = problem.linearised(&x, &mut trial, bounds, &how);
                with.is_some()
            } else {
                problem.evaluate(&x, &mut trial)
            };
            let cost = if good { cost_of(&trial, options.huber) } else { f64::INFINITY };
            let gain = (best.cost - cost) / promised;
            likely = cost < best.cost && gain > 1e-4;
            if likely {
                ahead = with.filter(|_| problem.is_exact());
                // λ shrinks the better the linear model was (Nielsen 1999).
                damping *= f64::max(1.0 / 5.0, 1.0 - (2.0 * gain - 1.0).powi(3));
                grow = 2.0;
                // Less than shows, far less than was promised: a kink is near.
                let shows = 0.5 * (SHOWS * deviation).powi(2);
                let fallen = best.cost - cost;
                slow = if fallen < shows && (gain < 0.25 || best.decrement > 2.0 * SHOWS) { slow + 1 } else { 0 };
                best.x = x;
                best.cost = cost;
                std::mem::swap(&mut best.residuals, &mut trial);
                accepted = slow < 2;
                break;
            }
            damping *= grow;
            grow *= 2.0;
            if damping > 1e16 {
                break;
            }
        }
        lambda = Some(damping.clamp(1e-12, 1e8));
        grow = grow.min(8.0);
        if accepted {
            continue;
        }
        (slow, ahead) = (0, None);
        if coarser == 0 && how != Differences::Central && !is_exact {
            // The cheap derivatives may be to blame.
            (how, lambda) = (Differences::Central, None);
            continue;
        }
        if best.decrement <= KINK {
            best.ending = Ending::Converged;
            return best;
        }
        if is_exact && !balanced {
            balanced = true;
            let free = (0..n).filter(|&j| !held[j] && model.norm(j) > 0.0).collect();
            let at = Coordinates::new(&best, &model.r, free, bounds, (deviation, options.huber));
            if let Some(found) = bundle::descend(problem, &mut best, &at, (KINK, options.iterations), watch) {
                (best.decrement, best.jacobian, best.pieces) = (found.promise, found.jacobian, found.pieces);
                if found.promise <= KINK {
                    best.ending = Ending::Converged;
                    return best;
                }
            }
        } else if coarser < COARSER.len() {
            let errors = model.errors(&held, deviation);
            how = Differences::Coarse(errors.iter().map(|error| COARSER[coarser] * error).collect());
            best.coarse = COARSER[coarser];
            coarser += 1;
        } else if best.decrement > 1.0
            && evolved < options.evolutions
            && evolve(problem, &mut best, bounds, &model, &held, deviation, options.huber)
        {
            evolved += 1;
            best.evolved = evolved;
            coarser = COARSER.len() - 1;
        } else {
            best.ending = Ending::Stalled;
            return best;
        }
        (lambda, grow) = (None, 2.0);
    }
}

/// By how much standard errors are greater than those of as many independent residuals, roughly: √((1 + ρ)/(1 − ρ))
/// with ρ the correlation of neighbours, as if no fewer than ten residuals for each variable were independent.
fn inflation(residuals: &[f64], variables: usize) -> f64 {
    let own: f64 = residuals.iter().map(|r| r * r).sum();
    let next: f64 = residuals.windows(2).map(|pair| pair[0] * pair[1]).sum();
    let rho = if own > 0.0 { (next / own).clamp(0.0, 0.999_999) } else { 0.0 };
    let most = residuals.len() as f64 / (10.0 * variables.max(1) as f64);
    ((1.0 + rho) / (1.0 - rho)).min(most.max(1.0)).sqrt()
}

/// Searches around a kink by CMA-ES in coordinates in which the smooth part of the cost is a sphere with the standard
/// error for its unit; whether that lowered the cost by more than rounding.
fn evolve(
    problem: &mut dyn Residuals,
    best: &mut Minimum,
    bounds: &Bounds,
    model: &Linear,
    held: &[bool],
    deviation: f64,
    huber: f64,
) -> bool {
    let free: Vec<usize> = (0..held.len()).filter(|&j| !held[j] && model.norm(j) > 0.0).collect();
    let n = free.len();
    if n == 0 || n > MOST_EVOLVED {
        return false;
    }
    let r = model.r.select_columns(&free).qr().unpack_r();
    let Some(unit) = r.solve_upper_triangular(&DMatrix::identity(n, n)) else { return false };
    let unit = unit * deviation;
    let before = best.cost;
    let centre = best.x.clone();
    let sigma = best.decrement.clamp(0.3, 10.0) / (n as f64).sqrt();
    let mut trial = vec![0.0; best.residuals.len()];
    let shows = 0.5 * (SHOWS * deviation).powi(2);
    cmaes::search(n, sigma, BARREN, &mut |point| {
        let step = &unit * point;
        let mut x = centre.clone();
        for (i, &j) in free.iter().enumerate() {
            x[j] = (x[j] + step[i]).clamp(bounds.low[j], bounds.high[j]);
        }
        best.evaluations += 1;
        let good = problem.evaluate(&x, &mut trial);
        let cost = if good { cost_of(&trial, huber) } else { f64::INFINITY };
        let is_better = cost < best.cost;
        let is_fruitful = is_better && best.cost - cost > shows;
        if is_better {
            best.cost = cost;
            best.x = x;
            best.residuals.copy_from_slice(&trial);
        }
        (cost, is_fruitful)
    });
    best.cost < before * (1.0 - 1e-6)
}

/// The step that keeps within the box: what would leave it is put on its edge, and the rest solved anew.
fn within(
    model: &Linear,
    x: &[f64],
    bounds: &Bounds,
    held: &[bool],
    scale: &DVector<f64>,
    damping: f64,
) -> DVector<f64> {
    let n = x.len();
    let mut fixed: Vec<Option<f64>> = held.iter().map(|&held| held.then_some(0.0)).collect();
    loop {
        let step = model.step_with(&fixed, scale, damping);
        let mut left = false;
        for j in 0..n {
            if fixed[j].is_none() {
                let to = x[j] + step[j];
                if to < bounds.low[j] || to > bounds.high[j] {
                    fixed[j] = Some(to.clamp(bounds.low[j], bounds.high[j]) - x[j]);
                    left = true;
                }
            }
        }
        if !left {
            return step;
        }
    }
}

/// J and r by their QR decomposition: J = Q R, Qᵀ r.
struct Linear {
    r: DMatrix<f64>,
    qtr: DVector<f64>,
}

impl Linear {
    fn new(at: &Minimum, huber: f64) -> Self {
        let n = at.x.len();
        let mut jacobian = at.jacobian.clone();
        let mut residual = DVector::from_column_slice(&at.residuals);
        if huber.is_finite() {
            // ρ′(r) = ψ: rows of weight √(k/|r|) have the same gradient.
            for i in 0..residual.len() {
                let size = residual[i].abs();
                if size > huber {
                    let weight = (huber / size).sqrt();
                    residual[i] *= weight;
                    jacobian.row_mut(i).scale_mut(weight);
                }
            }
        }
        if jacobian.nrows() < n {
            return Self { r: jacobian, qtr: residual };
        }
        let mut beside = jacobian.insert_column(n, 0.0);
        beside.set_column(n, &residual);
        let short = shortened(&beside);
        let mut residual = short.column(n).into_owned();
        let qr = short.remove_column(n).qr();
        qr.q_tr_mul(&mut residual);
        Self { r: qr.unpack_r(), qtr: residual.rows(0, n).into_owned() }
    }

    fn norm(&self, j: usize) -> f64 {
        self.r.column(j).norm()
    }

    fn gradient(&self) -> DVector<f64> {
        self.r.tr_mul(&self.qtr)
    }

    fn step(&self, held: &[bool], scale: &DVector<f64>, damping: f64) -> DVector<f64> {
        let fixed: Vec<Option<f64>> = held.iter().map(|&held| held.then_some(0.0)).collect();
        self.step_with(&fixed, scale, damping)
    }

    /// min ‖R d + Qᵀ r‖² + λ ‖D d‖² over the variables that are not fixed.
    fn step_with(&self, fixed: &[Option<f64>], scale: &DVector<f64>, damping: f64) -> DVector<f64> {
        let n = fixed.len();
        let free: Vec<usize> = (0..n).filter(|&j| fixed[j].is_none()).collect();
        let mut step = DVector::from_iterator(n, fixed.iter().map(|fixed| fixed.unwrap_or(0.0)));
        if free.is_empty() {
            return step;
        }
        let rows = self.r.nrows();
        let right = -(&self.qtr + &self.r * &step);
        let mut matrix = DMatrix::zeros(rows + free.len(), free.len());
        let mut wanted = DVector::zeros(rows + free.len());
        wanted.rows_mut(0, rows).copy_from(&right);
        for (column, &j) in free.iter().enumerate() {
            // In units of D the columns are of like size. A little damping keeps what the rows do not determine at
            // rest.
            let unit = if scale[j] > 0.0 { 1.0 / scale[j] } else { 1.0 };
            matrix.view_mut((0, column), (rows, 1)).copy_from(&(self.r.column(j) * unit));
            matrix[(rows + column, column)] = f64::max(damping.sqrt(), 1e-11);
        }
        let qr = matrix.qr();
        qr.q_tr_mul(&mut wanted);
        let solved = qr.unpack_r().solve_upper_triangular(&wanted.rows(0, free.len()).into_owned());
        if let Some(solved) = solved {
            for (column, &j) in free.iter().enumerate() {
                step[j] = solved[column] / if scale[j] > 0.0 { scale[j] } else { 1.0 };
            }
        }
        step
    }

    /// ‖J d‖.
    fn reach(&self, step: &DVector<f64>) -> f64 {
        (&self.r * step).norm()
    }

    /// By how much the linear model says that the cost falls.
    fn promise(&self, step: &DVector<f64>) -> f64 {
        let moved = &self.r * step;
        -(moved.dot(&self.qtr) + 0.5 * moved.norm_squared())
    }

    /// Standard errors of the variables that are free, for residuals of this deviation; of one alone where they are not
    /// determined together.
    fn errors(&self, held: &[bool], deviation: f64) -> Vec<f64> {
        (0..held.len()).map(|j| if held[j] || self.norm(j) == 0.0 { 0.0 } else { deviation / self.norm(j) }).collect()
    }
}
