//! Descent across kinks by a proximal bundle method (C. Lemaréchal 1975; K. C. Kiwiel 1990; for costs that are not
//! convex, M. M. Mäkelä and P. Neittaanmäki 1992).
//!
//! Between two changes in the order of sticks and slips the cost is smooth, and its gradient exact; across them it has
//! a kink. At a minimum on kinks no gradient is zero: those of the pieces that meet there balance. So the gradients gₖ
//! at nearby points yₖ are kept, in coordinates u in units of the standard error, in which each smooth piece has the
//! second derivative I, and each piece is extrapolated to the present point:
//!
//! ```text
//! φₖ(d) = φ − αₖ + g̃ₖ·d + ½ ‖d‖²       g̃ₖ = gₖ − (yₖ − u)       αₖ = φ − φ(yₖ) − gₖ·(u − yₖ) − ½ ‖u − yₖ‖²
//! min over d of max over k of φₖ(d):     d = −Σ λₖ g̃ₖ with min ½ ‖Σ λₖ g̃ₖ‖² + Σ λₖ αₖ, λ ≥ 0, Σ λₖ = 1
//! ```
//!
//! A step that achieves a part of the predicted gain is accepted; otherwise the gradient at its end adds information
//! about the kink. If the predicted gain is negligible, the pieces balance: this is the minimum, and Σ λₖ Jₖ the
//! Jacobian with Jᵀr ≈ 0 there.

use super::point::{Minimum, Point, Strategy, cost_of};
use super::rung::{Climb, Rung, Watch};
use crate::fit::asked::residuals::{Bounds, Differences, Residuals};
use crate::fit::limits::{CONTRADICTS, FIRM, HALVINGS, KEPT, KINK, SPARE_PIECES};
use crate::solve::Flow;
use nalgebra::{DMatrix, DVector};

/// Descent past the kinks around a point, once in a search.
#[derive(Default)]
pub(crate) struct Bundle {
    is_spent: bool,
}

impl Rung for Bundle {
    fn strategy(&self) -> Strategy {
        Strategy::Bundle
    }

    fn applies(&self, at: &Point) -> bool {
        at.is_exact && !self.is_spent
    }

    fn climb(&mut self, at: &mut Point, problem: &mut dyn Residuals, watch: &mut Watch) -> Climb {
        self.is_spent = true;
        let units = (at.deviation, at.options.huber);
        let coordinates = Coordinates::new(&at.best, &at.model.r, at.free(), at.bounds, units);
        let limits = (KINK, at.options.iterations);
        if let Some(found) = descend(problem, &mut at.best, &coordinates, limits, watch) {
            (at.best.decrement, at.best.jacobian, at.best.pieces) = (found.promise, found.jacobian, found.pieces);
            if found.promise <= KINK {
                return Climb::Converged;
            }
        }
        Climb::Lowered
    }
}

/// End of a descent.
struct Balanced {
    /// Predicted gain of the next step, in standard errors.
    promise: f64,
    /// Σ λₖ Jₖ
    jacobian: DMatrix<f64>,
    /// Number of points in it.
    pieces: usize,
}

/// The coordinates of a search: u = R (x − x₀)/σ over the variables that are free.
struct Coordinates<'a> {
    free: Vec<usize>,
    r: DMatrix<f64>,
    deviation: f64,
    bounds: &'a Bounds,
    huber: f64,
    start: Vec<f64>,
}

/// A smooth piece of the cost, by a point on it.
struct Piece {
    x: Vec<f64>,
    y: DVector<f64>,
    /// Cost there, in units of σ².
    cost: f64,
    gradient: DVector<f64>,
}

impl Piece {
    /// g̃ and α relative to a point with this cost.
    fn seen_from(&self, u: &DVector<f64>, cost: f64) -> (DVector<f64>, f64) {
        let away = &self.y - u;
        let own = self.cost - self.gradient.dot(&away) + 0.5 * away.norm_squared();
        // If the cost is not convex, a piece may lie above it: its weight decreases with distance.
        (&self.gradient - &away, (cost - own).abs())
    }
}

/// The step with the largest predicted gain for all pieces together.
struct Promise {
    weights: Vec<f64>,
    /// −d
    mean: DVector<f64>,
    /// Decrease of the cost, in units of σ².
    fall: f64,
}

impl Promise {
    fn new(pieces: &[Piece], u: &DVector<f64>, cost: f64) -> Self {
        let seen: Vec<(DVector<f64>, f64)> = pieces.iter().map(|piece| piece.seen_from(u, cost)).collect();
        let weights = balance(&seen);
        let (mut mean, mut beyond) = (DVector::zeros(u.len()), 0.0);
        for ((g, alpha), weight) in seen.iter().zip(&weights) {
            mean += g * *weight;
            beyond += alpha * weight;
        }
        let fall = 0.5 * mean.norm_squared() + beyond;
        Self { weights, mean, fall }
    }

    /// True if a piece contradicts the prediction for that step.
    fn is_contradicted(&self, (g, alpha): &(DVector<f64>, f64)) -> bool {
        -alpha - g.dot(&self.mean) + 0.5 * self.mean.norm_squared() >= -CONTRADICTS * self.fall
    }
}

/// Descends from `best`, which is changed, until the pieces balance to within `tolerance` standard errors, or after
/// `most` gradients; `None` if the model fails or the search is stopped.
fn descend(
    problem: &mut dyn Residuals,
    best: &mut Minimum,
    at: &Coordinates,
    (tolerance, most): (f64, usize),
    watch: &mut Watch,
) -> Option<Balanced> {
    let unit = 1.0 / (at.deviation * at.deviation);
    let mut u = DVector::zeros(at.free.len());
    let first = problem.jacobian(&best.x, &best.residuals, at.bounds, &Differences::Central)?;
    let mut pieces = vec![at.piece(best, &first)?];
    let mut trial = best.clone();
    let (mut taken, mut is_stuck) = (1, false);
    loop {
        let cost = unit * best.cost;
        let promise = Promise::new(&pieces, &u, cost);
        let expected = (2.0 * promise.fall).sqrt();
        if expected <= tolerance || taken >= most || is_stuck {
            best.iterations += taken;
            return at.mean_jacobian(problem, &pieces, (&promise.weights, expected));
        }
        if watch(&best.x, best.cost) == Flow::Stop {
            return None;
        }
        let (mut length, known) = (1.0, pieces.len());
        for _ in 0..HALVINGS {
            taken += 1;
            best.evaluations += 1;
            trial.x = at.place(&(&u - &promise.mean * length));
            let how = Differences::Central;
            let Some(jacobian) = problem.linearised(&trial.x, &mut trial.residuals, at.bounds, &how) else {
                length *= 0.5;
                continue;
            };
            trial.cost = cost_of(&trial.residuals, at.huber);
            let piece = at.piece(&trial, &jacobian)?;
            let (y, seen) = (piece.y.clone(), piece.seen_from(&u, cost));
            pieces.push(piece);
            if unit * (best.cost - trial.cost) >= KEPT * length * promise.fall {
                best.x.clone_from(&trial.x);
                best.residuals.copy_from_slice(&trial.residuals);
                best.cost = trial.cost;
                u = y;
                break;
            }
            if promise.is_contradicted(&seen) {
                break;
            }
            length *= 0.5;
        }
        // The model cannot be run at any of these points: the same pieces promise the same step again.
        is_stuck = pieces.len() == known;
        forget(&mut pieces, &u, unit * best.cost, &promise.weights);
    }
}

/// Keeps the pieces closest to the cost, and those that determined the last step.
fn forget(pieces: &mut Vec<Piece>, u: &DVector<f64>, cost: f64, weights: &[f64]) {
    let most = u.len() + SPARE_PIECES;
    if pieces.len() <= most {
        return;
    }
    let mut order: Vec<usize> = (0..pieces.len()).collect();
    let rank = |k: usize| match weights.get(k) {
        Some(weight) if *weight > 0.0 => -1.0,
        None => -1.0,
        Some(_) => pieces[k].seen_from(u, cost).1,
    };
    order.sort_by(|&a, &b| rank(a).total_cmp(&rank(b)));
    let mut kept = order[..most].to_vec();
    kept.sort_unstable();
    let mut index = 0;
    pieces.retain(|_| {
        index += 1;
        kept.contains(&(index - 1))
    });
}

impl<'a> Coordinates<'a> {
    /// Bundle around `best`; `r` is R of the QR decomposition of its Jacobian, over the variables that are free; σ is
    /// the unit of residuals, beyond `huber` of which they count linearly.
    fn new(
        best: &Minimum,
        r: &DMatrix<f64>,
        free: Vec<usize>,
        bounds: &'a Bounds,
        (deviation, huber): (f64, f64),
    ) -> Self {
        let own = r.select_columns(&free);
        let firm = DMatrix::from_diagonal(&DVector::from_fn(free.len(), |j, _| FIRM * own.column(j).norm()));
        let mut stacked = own.clone().resize_vertically(own.nrows() + free.len(), 0.0);
        stacked.view_mut((own.nrows(), 0), firm.shape()).copy_from(&firm);
        Self { free, r: stacked.qr().unpack_r(), deviation, bounds, huber, start: best.x.clone() }
    }

    /// x(u), within the box.
    fn place(&self, u: &DVector<f64>) -> Vec<f64> {
        let mut x = self.start.clone();
        let Some(step) = self.r.solve_upper_triangular(&(u * self.deviation)) else { return x };
        for (&j, by) in self.free.iter().zip(&step) {
            x[j] = (x[j] + by).clamp(self.bounds.low[j], self.bounds.high[j]);
        }
        x
    }

    /// The piece of the cost at a point with this Jacobian.
    fn piece(&self, at: &Minimum, jacobian: &DMatrix<f64>) -> Option<Piece> {
        let n = self.free.len();
        let moved = DVector::from_fn(n, |i, _| at.x[self.free[i]] - self.start[self.free[i]]);
        // ρ′(r)
        let influence = at.residuals.iter().map(|r| r.clamp(-self.huber, self.huber));
        let influence = DVector::from_iterator(at.residuals.len(), influence);
        // dφ/du = R⁻ᵀ Jᵀρ′/σ
        let slope = DVector::from_fn(n, |i, _| jacobian.column(self.free[i]).dot(&influence));
        let gradient = self.r.tr_solve_upper_triangular(&slope)? / self.deviation;
        let cost = at.cost / (self.deviation * self.deviation);
        Some(Piece { x: at.x.clone(), y: &self.r * moved / self.deviation, cost, gradient })
    }

    /// Σ λₖ Jₖ, with the remaining predicted gain.
    fn mean_jacobian(
        &self,
        problem: &mut dyn Residuals,
        pieces: &[Piece],
        (weights, promise): (&[f64], f64),
    ) -> Option<Balanced> {
        let mut residuals = vec![0.0; problem.rows()];
        let mut jacobian = DMatrix::zeros(residuals.len(), self.start.len());
        let counting = || pieces.iter().zip(weights).filter(|(_, weight)| **weight > 0.0);
        for (piece, weight) in counting() {
            let own = problem.linearised(&piece.x, &mut residuals, self.bounds, &Differences::Central)?;
            jacobian += own * *weight;
        }
        Some(Balanced { promise, jacobian, pieces: counting().count() })
    }
}

/// min ½ ‖Σ λₖ gₖ‖² + Σ λₖ αₖ over λ ≥ 0 with Σ λₖ = 1, by exchange between the two that gain most by it.
fn balance(seen: &[(DVector<f64>, f64)]) -> Vec<f64> {
    let n = seen.len();
    let products = DMatrix::from_fn(n, n, |i, j| seen[i].0.dot(&seen[j].0));
    let mut weights = vec![0.0; n];
    // Starts with the best one alone.
    let alone = |k: usize| 0.5 * products[(k, k)] + seen[k].1;
    let first = (0..n).min_by(|&a, &b| alone(a).total_cmp(&alone(b))).unwrap_or(0);
    weights[first] = 1.0;
    let mut slopes: Vec<f64> = (0..n).map(|k| products[(k, first)] + seen[k].1).collect();
    for _ in 0..1000 * n {
        let Some(to) = (0..n).min_by(|&a, &b| slopes[a].total_cmp(&slopes[b])) else { break };
        let Some(from) = (0..n).filter(|&k| weights[k] > 0.0).max_by(|&a, &b| slopes[a].total_cmp(&slopes[b])) else {
            break;
        };
        let gain = slopes[from] - slopes[to];
        let bend = products[(from, from)] + products[(to, to)] - 2.0 * products[(from, to)];
        if gain <= 1e-10 * slopes[from].abs().max(f64::MIN_POSITIVE) {
            break;
        }
        let by = if bend > 0.0 { f64::min(gain / bend, weights[from]) } else { weights[from] };
        weights[to] += by;
        weights[from] = if by < weights[from] { weights[from] - by } else { 0.0 };
        for k in 0..n {
            slopes[k] += by * (products[(k, to)] - products[(k, from)]);
        }
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::search::point::Options;

    /// A piece of second derivative I is a parabola: φ(u + d) = φ − α + g̃·d + ½ ‖d‖² for any u and d.
    #[test]
    fn a_piece_is_the_same_parabola_from_every_point() {
        let minimum = DVector::from_vec(vec![0.3, -1.2]);
        let value = |at: &DVector<f64>| 2.0 + 0.5 * (at - &minimum).norm_squared();
        let y = DVector::from_vec(vec![1.5, 0.7]);
        let piece = Piece { x: Vec::new(), cost: value(&y), gradient: &y - &minimum, y };
        for k in 0..10 {
            let at =
                |phase: f64| DVector::from_vec(vec![(phase + f64::from(k)).sin(), (2.0 * phase - f64::from(k)).cos()]);
            let (u, d) = (at(0.2), at(1.9));
            // The present cost lies above the piece, as at a kink.
            let cost = value(&u) + 0.4;
            let (gradient, below) = piece.seen_from(&u, cost);
            assert!((below - 0.4).abs() < 1e-12, "{k}: {below}");
            let own = cost - below + gradient.dot(&d) + 0.5 * d.norm_squared();
            assert!((own - value(&(&u + &d))).abs() < 1e-12, "{k}: {own}");
        }
    }

    /// A slope that can be walked down by a thousandth of the way to its foot: there the model fails.
    struct Walled;

    impl Residuals for Walled {
        fn rows(&self) -> usize {
            30
        }

        fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
            r.fill(1.0);
            r[0] = 10.0 * x[0];
            x[0] > 0.999
        }
    }

    /// The whole step and its halves down to 1/2048 are tried: 1/1024 succeeds, and a further 1/65536 would.
    #[test]
    fn a_step_is_halved_until_the_model_can_be_run() {
        let (bounds, options) = (Bounds::none(1), Options::default());
        let mut at = Point::new(&mut Walled, &[1.0], &bounds, &options).unwrap();
        assert!(at.linearise(&mut Walled, &Differences::Central, None));
        Bundle::default().climb(&mut at, &mut Walled, &mut |_, _| Flow::Continue);
        assert!((at.best.x[0] - (1.0 - 1.0 / 1024.0)).abs() < 1e-6, "{}", at.best.x[0]);
        // At the wall the same steps are not tried again.
        assert!(at.best.evaluations < 30, "{}", at.best.evaluations);
    }

    /// Of thirty pieces, two variables leave twelve: the new one, the one that determined the last step, and those
    /// nearest to the cost.
    #[test]
    fn pieces_far_from_the_cost_are_forgotten() {
        let piece = |below: usize| Piece {
            x: vec![below as f64],
            y: DVector::zeros(2),
            cost: 100.0 - below as f64,
            gradient: DVector::zeros(2),
        };
        let mut pieces: Vec<Piece> = (0..30).map(piece).collect();
        let mut weights = vec![0.0; 29];
        weights[20] = 1.0;
        forget(&mut pieces, &DVector::zeros(2), 100.0, &weights);
        let kept: Vec<usize> = pieces.iter().map(|piece| piece.x[0] as usize).collect();
        assert_eq!(kept, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 20, 29]);
    }
}
