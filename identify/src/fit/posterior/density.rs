//! Posterior density of a least-squares problem, on unbounded variables of about unit width.
//!
//! With ψ the residuals after the loss, T the inflation that the covariance has, π the priors and x(u) the change of
//! variables:
//!
//! ```text
//! ln p(u) = −Σ ρ(rᵢ(x)) / T + Σⱼ ln πⱼ(xⱼ) + Σⱼ ln |dxⱼ/duⱼ|        u = u₀ + S z
//! ```
//!
//! x = l + eᵘ above a bound, h − eᵘ below one, l + (h − l)/(1 + e⁻ᵘ) between two, and u without any; S Sᵀ is the
//! covariance at the fit, so that z is nearly standard normal. A path is a leapfrog along gradients; any gradient that
//! depends on the position alone leaves the draws unbiased (Neal 2011, "MCMC using Hamiltonian dynamics", section 5.5),
//! since they are accepted by the density itself. So gradients are Jᵀψ with J = J₀ + Σ zₖ ∂J/∂zₖ around the fit, one
//! simulation each, if that is accurate enough.
//!
//! Otherwise a random walk draws from the density alone, in x itself, and rejects steps beyond a bound. The cost may
//! have kinks, where sticks and slips change their order, at which paths along gradients turn back; and correlated
//! parameters, such as a delay that may be zero and a gain, have a long, narrow ridge that is straight in x: the
//! logarithm of the distance to a bound curves it, so that no step length suits it.

use super::nuts::{Draws, Effort, LogDensity, Watch, sample, walk};
use crate::chance::normal;
use crate::fit::asked::residuals::{Bounds, Differences, Residuals};
use crate::fit::limits::{FELT, MOST_BENT, PAST_KINKS, SLOPE_PLACES, SLOPES_OFF};
use nalgebra::{DMatrix, DVector};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use std::sync::Mutex;

/// Logarithm of a variable's prior density, and its derivative.
pub type Prior<'a> = Box<dyn Fn(f64) -> (f64, f64) + Sync + 'a>;

/// The parts of the density.
pub struct Ingredients<'a, R> {
    /// The residuals.
    pub problem: R,
    /// The fit.
    pub at: Vec<f64>,
    /// The Jacobian there.
    pub jacobian: DMatrix<f64>,
    /// Bounds of the variables.
    pub bounds: Bounds,
    /// The priors; flat without.
    pub priors: Vec<Option<Prior<'a>>>,
    /// The divisor of the sum of squares.
    pub inflation: f64,
    /// Residuals beyond this count linearly.
    pub huber: f64,
}

/// The draws.
pub struct Sampled {
    /// Values of the variables.
    pub draws: Draws,
    /// True if gradients by the Jacobian of the fit were used; a random walk otherwise.
    pub fixed: bool,
}

/// Transformation of an unbounded variable to a bounded one.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Change {
    None,
    Above(f64),
    Below(f64),
    Between(f64, f64),
}

impl Change {
    /// For a variable at `x` ± `deviation`.
    fn new(x: f64, deviation: f64, low: f64, high: f64) -> Self {
        match (x - low < FELT * deviation, high - x < FELT * deviation) {
            (false, false) => Change::None,
            (true, false) => Change::Above(low),
            (false, true) => Change::Below(high),
            (true, true) => Change::Between(low, high),
        }
    }

    /// x(u), dx/du, ln |dx/du| and its slope.
    fn at(self, u: f64) -> [f64; 4] {
        match self {
            Change::None => [u, 1.0, 0.0, 0.0],
            Change::Above(low) => [low + u.exp(), u.exp(), u, 1.0],
            Change::Below(high) => [high - u.exp(), -u.exp(), u, 1.0],
            Change::Between(low, high) => {
                let (share, rest) = (1.0 / (1.0 + (-u).exp()), 1.0 / (1.0 + u.exp()));
                let slope = (high - low) * share * rest;
                [low + (high - low) * share, slope, slope.ln(), rest - share]
            }
        }
    }

    /// u(x)
    fn variable(self, x: f64) -> f64 {
        match self {
            Change::None => x,
            Change::Above(low) => (x - low).ln(),
            Change::Below(high) => (high - x).ln(),
            Change::Between(low, high) => ((x - low) / (high - x)).ln(),
        }
    }
}

/// The density, shared by the chains.
struct Density<'a, R> {
    /// A problem for each running chain.
    pool: Mutex<Vec<R>>,
    ingredients: &'a Ingredients<'a, R>,
    changes: Vec<Change>,
    centre: DVector<f64>,
    spread: DMatrix<f64>,
    /// The fit, a little away from bounds.
    inside: Vec<f64>,
    /// Standard errors.
    errors: Vec<f64>,
    /// L of the correlations.
    correlation: DMatrix<f64>,
    /// The Jacobian at the fit, and its derivatives by z; `None` if these do not approximate the density.
    fixed: Option<Vec<DMatrix<f64>>>,
}

/// Draws from the density. Returns an error if the density is zero at the starts.
pub fn draw<R: Residuals + Clone + Send + Sync>(
    ingredients: &Ingredients<R>,
    effort: Effort,
    watch: &Watch,
) -> crate::error::Result<Sampled> {
    let mut density = Density::new(ingredients);
    let mut random = Pcg64::seed_from_u64(effort.seed ^ 0x5eed);
    if !density.is_straight(&mut random) {
        density.walk();
    }
    density.draws(&mut random, effort, watch)
}

impl<R: Residuals + Clone + Send + Sync> Density<'_, R> {
    /// Draws along gradients, or by a walk.
    fn draws(&self, random: &mut Pcg64, effort: Effort, watch: &Watch) -> crate::error::Result<Sampled> {
        let starts: Vec<Vec<f64>> = (0..effort.chains.max(1)).map(|_| self.start(random)).collect();
        let log: &LogDensity = &|z, gradient| self.log(z, Some(gradient));
        let mut draws = match self.fixed.is_some() {
            true => sample(log, &starts, effort, watch)?,
            false => walk(&|z| self.log(z, None), &starts, effort, watch)?,
        };
        for draw in draws.chains.iter_mut().flatten() {
            *draw = self.place(draw).iter().map(|place| place[0]).collect();
        }
        Ok(Sampled { draws, fixed: self.fixed.is_some() })
    }
}

impl<'a, R: Residuals + Clone + Send> Density<'a, R> {
    fn new(ingredients: &'a Ingredients<'a, R>) -> Self {
        let Ingredients { bounds, at, .. } = ingredients;
        let n = at.len();
        // Standard errors, then the Jacobian over about one of them, then both again with that Jacobian.
        let errors = deviations(&covariance(ingredients, &ingredients.jacobian));
        let inside: Vec<f64> = (0..n)
            .map(|j| {
                let (low, high) = (bounds.low[j], bounds.high[j]);
                let room = f64::min(0.5 * errors[j], 0.25 * (high - low));
                at[j].clamp(low + room, high - room)
            })
            .collect();
        let mut problem = ingredients.problem.clone();
        let mut residuals = vec![0.0; problem.rows()];
        let mut jacobian = ingredients.jacobian.clone();
        if problem.evaluate(&inside, &mut residuals) {
            let how = Differences::Coarse(errors.clone());
            jacobian = problem.jacobian(&inside, &residuals, bounds, &how).unwrap_or(jacobian);
        }
        let covariance = covariance(ingredients, &jacobian);
        let errors = deviations(&covariance);
        let correlation = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] / (errors[i] * errors[j]));
        let correlation = correlation.cholesky().map_or_else(|| DMatrix::identity(n, n), |found| found.l());
        let mut density = Self {
            pool: Mutex::new(vec![problem]),
            ingredients,
            changes: Vec::new(),
            centre: DVector::zeros(n),
            spread: correlation.clone(),
            inside,
            errors,
            correlation,
            fixed: None,
        };
        let near = |j: usize| Change::new(density.inside[j], density.errors[j], bounds.low[j], bounds.high[j]);
        density.change((0..n).map(near).collect());
        density.fixed = Some(density.bent(jacobian));
        density
    }

    /// Switches to a walk in the variables themselves.
    fn walk(&mut self) {
        self.fixed = None;
        self.change(vec![Change::None; self.inside.len()]);
    }

    /// Sets these changes of variables.
    fn change(&mut self, changes: Vec<Change>) {
        self.centre = DVector::from_fn(changes.len(), |j, _| changes[j].variable(self.inside[j]));
        self.spread = self.correlation.clone();
        for (j, change) in changes.iter().enumerate() {
            let slope = change.at(self.centre[j])[1].abs();
            // Near a bound a standard error reaches beyond it.
            let wide = if *change == Change::None { self.errors[j] } else { f64::min(self.errors[j] / slope, 2.0) };
            self.spread.row_mut(j).scale_mut(wide);
        }
        self.changes = changes;
    }

    /// The Jacobian at the fit and, if available, its derivatives along each z, over a standard error to each side.
    fn bent(&self, jacobian: DMatrix<f64>) -> Vec<DMatrix<f64>> {
        let n = self.errors.len();
        let mut problem = self.ingredients.problem.clone();
        let mut at = |k: usize, side: f64| {
            let mut z = vec![0.0; n];
            z[k] = side;
            let x: Vec<f64> = self.place(&z).iter().map(|place| place[0]).collect();
            self.measured(&mut problem, &x).map(|(_, jacobian)| jacobian)
        };
        let all: Option<Vec<DMatrix<f64>>> = match n <= MOST_BENT {
            true => (0..n).map(|k| Some((at(k, 1.0)? - at(k, -1.0)?) * 0.5)).collect(),
            false => None,
        };
        std::iter::once(jacobian).chain(all.unwrap_or_default()).collect()
    }

    /// Residuals and their Jacobian, over steps of a part of a standard error.
    fn measured(&self, problem: &mut R, x: &[f64]) -> Option<(Vec<f64>, DMatrix<f64>)> {
        let mut residuals = vec![0.0; problem.rows()];
        if !problem.evaluate(x, &mut residuals) {
            return None;
        }
        let steps = self.errors.iter().map(|error| PAST_KINKS * error).collect();
        let jacobian = problem.jacobian(x, &residuals, &self.ingredients.bounds, &Differences::Coarse(steps))?;
        Some((residuals, jacobian))
    }

    /// Each variable's x, dx/du, ln |dx/du| and its slope.
    fn place(&self, z: &[f64]) -> Vec<[f64; 4]> {
        let u = &self.centre + &self.spread * DVector::from_column_slice(z);
        self.changes.iter().zip(u.iter()).map(|(change, u)| change.at(*u)).collect()
    }

    /// ln p and, if requested, its gradient.
    fn log(&self, z: &[f64], gradient: Option<&mut [f64]>) -> Option<f64> {
        self.log_with(self.fixed.as_deref(), z, gradient)
    }

    fn log_with(&self, fixed: Option<&[DMatrix<f64>]>, z: &[f64], gradient: Option<&mut [f64]>) -> Option<f64> {
        let own = self.pool.lock().ok()?.pop();
        let mut problem = own.unwrap_or_else(|| self.ingredients.problem.clone());
        let result = self.log_of(&mut problem, fixed, z, gradient);
        self.pool.lock().ok()?.push(problem);
        result
    }

    fn log_of(
        &self,
        problem: &mut R,
        fixed: Option<&[DMatrix<f64>]>,
        z: &[f64],
        gradient: Option<&mut [f64]>,
    ) -> Option<f64> {
        let Ingredients { bounds, priors, inflation, huber, .. } = self.ingredients;
        let places = self.place(z);
        let x: Vec<f64> = places.iter().map(|place| place[0]).collect();
        // Rounding may put it onto a bound, and inactive bounds still hold.
        if x.iter().zip(bounds.low.iter().zip(&bounds.high)).any(|(x, (low, high))| !(low <= x && x <= high)) {
            return None;
        }
        let (mut residuals, measured) = match (fixed, &gradient) {
            (None, Some(_)) => self.measured(problem, &x).map(|(residuals, jacobian)| (residuals, Some([jacobian])))?,
            (Some(_), _) | (_, None) => {
                let mut residuals = vec![0.0; problem.rows()];
                if !problem.evaluate(&x, &mut residuals) {
                    return None;
                }
                (residuals, None)
            }
        };
        // ρ = ½ r², from k on k |r| − ½ k²; ψ = ρ′
        let mut cost = 0.0;
        for r in &mut residuals {
            let size = r.abs();
            cost += if size > *huber { huber * (size - 0.5 * huber) } else { 0.5 * size * size };
            *r = r.clamp(-huber, *huber);
        }
        let mut log = -cost / inflation;
        let of_priors: Vec<(f64, f64)> =
            priors.iter().zip(&x).map(|(prior, x)| prior.as_ref().map_or((0.0, 0.0), |prior| prior(*x))).collect();
        for ((own, _), [_, _, log_dx, _]) in of_priors.iter().zip(&places) {
            log += own + log_dx;
        }
        let Some(gradient) = gradient else { return Some(log).filter(|log| log.is_finite()) };
        // −(J₀ + Σ zₖ ∂J/∂zₖ)ᵀ ψ / T
        let jacobians = fixed.or(measured.as_ref().map(|own| &own[..]))?;
        let psi = DVector::from_column_slice(&residuals);
        let mut slopes = DVector::zeros(x.len());
        for (jacobian, factor) in jacobians.iter().zip(std::iter::once(&1.0).chain(z)) {
            slopes.gemv_tr(-factor / inflation, jacobian, &psi, 1.0);
        }
        for (j, ([_, dx, _, slope_of_log], (_, slope))) in places.into_iter().zip(of_priors).enumerate() {
            slopes[j] = (slopes[j] + slope) * dx + slope_of_log;
        }
        gradient.copy_from_slice(self.spread.tr_mul(&slopes).as_slice());
        Some(log).filter(|log| log.is_finite() && gradient.iter().all(|slope| slope.is_finite()))
    }

    /// True if gradients with the Jacobian at the fit are close to measured ones in the region of the draws.
    fn is_straight(&self, random: &mut Pcg64) -> bool {
        let n = self.errors.len();
        let (mut squares, mut count) = (0.0, 0);
        for _ in 0..SLOPE_PLACES {
            let z: Vec<f64> = (0..n).map(|_| normal(random)).collect();
            let (mut a, mut b) = (vec![0.0; n], vec![0.0; n]);
            if self.log(&z, Some(&mut a)).is_some() && self.log_with(None, &z, Some(&mut b)).is_some() {
                squares += a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
                count += n;
            }
        }
        count > 0 && squares <= SLOPES_OFF * SLOPES_OFF * count as f64
    }

    /// A random start, drawn from the covariance at the fit.
    fn start(&self, random: &mut Pcg64) -> Vec<f64> {
        let n = self.errors.len();
        for attempt in 0..20 {
            let size = 0.9f64.powi(attempt);
            let z: Vec<f64> = (0..n).map(|_| size * normal(random)).collect();
            if self.log(&z, None).is_some() {
                return z;
            }
        }
        vec![0.0; n]
    }
}

/// (JᵀJ/T + curvature of the priors + 12/(h − l)²)⁻¹, with the information of flat priors between bounds.
fn covariance<R>(ingredients: &Ingredients<R>, jacobian: &DMatrix<f64>) -> DMatrix<f64> {
    let mut precision = jacobian.tr_mul(jacobian) / ingredients.inflation;
    for (j, prior) in ingredients.priors.iter().enumerate() {
        let (x, wide) = (ingredients.at[j], ingredients.bounds.high[j] - ingredients.bounds.low[j]);
        let h = 1e-4 * x.abs().max(1.0);
        let curvature = prior.as_ref().map_or(0.0, |prior| (prior(x - h).1 - prior(x + h).1) / (2.0 * h));
        let curvature = if curvature.is_finite() { curvature.max(0.0) } else { 0.0 };
        precision[(j, j)] += curvature + (12.0 / (wide * wide)).max(1e-20);
    }
    let n = precision.nrows();
    // In variables of equal magnitude, to reduce rounding.
    let sizes: Vec<f64> = (0..n).map(|j| precision[(j, j)].sqrt()).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| precision[(i, j)] / (sizes[i] * sizes[j]));
    let inverse = scaled.cholesky().map_or_else(|| DMatrix::identity(n, n), |found| found.inverse());
    DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] / (sizes[i] * sizes[j]))
}

fn deviations(covariance: &DMatrix<f64>) -> Vec<f64> {
    covariance.diagonal().iter().map(|variance| variance.sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[derive(Clone)]
    struct Straight {
        matrix: DMatrix<f64>,
        values: DVector<f64>,
    }

    impl Residuals for Straight {
        fn rows(&self) -> usize {
            self.values.len()
        }

        fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
            r.copy_from_slice((&self.matrix * DVector::from_column_slice(x) - &self.values).as_slice());
            true
        }
    }

    fn straight() -> Straight {
        // y = a + b t with unit noise at t = 0 … 19.
        let matrix = DMatrix::from_fn(20, 2, |i, j| if j == 0 { 1.0 } else { i as f64 });
        let values = DVector::from_fn(20, |i, _| 2.0 + 0.5 * i as f64 + (i as f64 * 2.1).sin());
        Straight { matrix, values }
    }

    fn ingredients<'a>(low: f64, priors: Vec<Option<Prior<'a>>>, inflation: f64) -> Ingredients<'a, Straight> {
        let problem = straight();
        let bounds = Bounds { low: vec![low, f64::NEG_INFINITY], high: vec![f64::INFINITY; 2] };
        let jacobian = problem.matrix.clone();
        let at = (jacobian.tr_mul(&jacobian)).try_inverse().unwrap() * jacobian.tr_mul(&problem.values);
        Ingredients {
            problem,
            at: vec![at[0].max(low), at[1]],
            jacobian,
            bounds,
            priors,
            inflation,
            huber: f64::INFINITY,
        }
    }

    fn drawn(ingredients: &Ingredients<Straight>) -> Sampled {
        let effort = Effort { draws: 1500, tune: 300, ..Effort::default() };
        draw(ingredients, effort, &|_| true).unwrap()
    }

    /// A linear model with normal noise and a normal prior has a normal posterior, whose mean and covariance are known.
    #[test]
    fn a_linear_model_has_the_posterior_of_the_textbook() {
        for (prior, inflation) in [(None, 1.0), (Some([3.0, 0.2]), 1.0), (Some([3.0, 0.2]), 4.0)] {
            let of = |[mean, deviation]: [f64; 2]| -> Prior {
                Box::new(move |x| (-0.5 * ((x - mean) / deviation).powi(2), -(x - mean) / deviation.powi(2)))
            };
            let all = ingredients(f64::NEG_INFINITY, vec![prior.map(of), None], inflation);
            // (JᵀJ/T + 1/s²)⁻¹ and that times (Jᵀy/T + m/s²)
            let mut precision = all.jacobian.tr_mul(&all.jacobian) / inflation;
            let mut right = all.jacobian.tr_mul(&all.problem.values) / inflation;
            if let Some([mean, deviation]) = prior {
                precision[(0, 0)] += 1.0 / (deviation * deviation);
                right[0] += mean / (deviation * deviation);
            }
            let covariance = precision.try_inverse().unwrap();
            let mean = &covariance * right;
            let Sampled { draws, fixed } = drawn(&all);
            assert!(fixed);
            for j in 0..2 {
                let error = covariance[(j, j)].sqrt();
                assert!((draws.mean(j) - mean[j]).abs() < 0.06 * error, "{} {}", draws.mean(j), mean[j]);
                assert!((draws.deviation(j) / error - 1.0).abs() < 0.06, "{} {error}", draws.deviation(j));
                assert!(draws.r_hat(j) < 1.01 && draws.effective(j) > 400.0);
            }
        }
    }

    /// With a bound through its middle, the quantiles are those of the truncated normal distribution.
    #[test]
    fn a_bound_cuts_the_posterior_off() {
        let free = ingredients(f64::NEG_INFINITY, vec![None, None], 1.0);
        let (middle, error) =
            (free.at[0], (free.jacobian.tr_mul(&free.jacobian)).try_inverse().unwrap()[(0, 0)].sqrt());
        let Sampled { draws, .. } = drawn(&ingredients(middle, vec![None, None], 1.0));
        // Half-normal: median 0.6745, 97.5 % at 2.2414 standard errors.
        for (share, want) in [(0.025, 0.0313), (0.5, 0.6745), (0.975, 2.2414)] {
            let found = (draws.quantile(0, share) - middle) / error;
            assert!((found - want).abs() < 0.1, "{share}: {found} instead of {want}");
        }
        assert!(draws.divergences < 30, "{}", draws.divergences);
    }

    /// A delay that may be zero and a correlated gain, 300 times more closely correlated than either is known; the
    /// gradient along both has a kink at 0.7.
    #[derive(Clone)]
    struct Ridge;

    impl Ridge {
        fn along(delay: f64) -> f64 {
            delay - 0.5 + 0.8 * (delay - 0.7).abs()
        }
    }

    impl Residuals for Ridge {
        fn rows(&self) -> usize {
            2
        }

        fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
            (r[0], r[1]) = (300.0 * (x[0] - x[1]), Self::along(x[0]));
            true
        }
    }

    /// Sampling a delay and a gain gave no draw in four minutes: in the logarithm of the delay their ridge was curved,
    /// and steps as short as it was narrow made no progress.
    #[test]
    fn a_narrow_ridge_that_ends_at_a_bound_is_drawn_from() {
        let ingredients = Ingredients {
            problem: Ridge,
            at: vec![0.3, 0.3],
            jacobian: DMatrix::from_row_slice(2, 2, &[300.0, -300.0, 0.2, 0.0]),
            bounds: Bounds { low: vec![0.0, f64::NEG_INFINITY], high: vec![f64::INFINITY; 2] },
            priors: vec![None, None],
            inflation: 1.0,
            huber: f64::INFINITY,
        };
        let effort = Effort { draws: 2000, ..Effort::default() };
        let mut density = Density::new(&ingredients);
        density.walk();
        let Sampled { draws, .. } = density.draws(&mut Pcg64::seed_from_u64(1), effort, &|_| true).unwrap();
        assert!(draws.evaluations < 100_000, "{}", draws.evaluations);
        // The gain does not affect the probability of a delay.
        let density = |delay: f64| (-0.5 * Ridge::along(delay).powi(2)).exp();
        let points: Vec<f64> = (0..40_000).map(|k| 1e-4 * (f64::from(k) + 0.5)).collect();
        let all: f64 = points.iter().map(|d| density(*d)).sum();
        for j in 0..2 {
            assert!(draws.r_hat(j) < 1.01 && draws.effective(j) > 400.0, "{} {}", draws.r_hat(j), draws.effective(j));
            for share in [0.025, 0.5, 0.975] {
                let found = draws.quantile(j, share);
                let below: f64 = points.iter().filter(|d| **d < found).map(|d| density(*d)).sum();
                let allowed = 5.0 * (share * (1.0 - share) / draws.effective(j)).sqrt() + 0.003;
                assert!((below / all - share).abs() < allowed, "{j} {share}: {found} {}", below / all);
            }
        }
    }

    #[test]
    fn the_changes_of_variables_have_their_slopes() {
        for change in [Change::None, Change::Above(1.0), Change::Below(2.0), Change::Between(-1.0, 3.0)] {
            for u in [-2.0, 0.1, 1.5] {
                let [x, dx, log, slope] = change.at(u);
                let (h, near) = (1e-6, |u: f64| change.at(u));
                assert!(((near(u + h)[0] - near(u - h)[0]) / (2.0 * h) - dx).abs() < 1e-8);
                assert!(((near(u + h)[2] - near(u - h)[2]) / (2.0 * h) - slope).abs() < 1e-8);
                assert!((log - dx.abs().ln()).abs() < 1e-12 && (change.variable(x) - u).abs() < 1e-9);
            }
        }
    }

    /// Variables of unit width, each with a residual of its own: x + b x².
    #[derive(Clone)]
    struct Bent {
        variables: usize,
        bend: f64,
        evaluations: Arc<AtomicUsize>,
    }

    impl Residuals for Bent {
        fn rows(&self) -> usize {
            self.variables
        }

        fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
            self.evaluations.fetch_add(1, Ordering::Relaxed);
            r.iter_mut().zip(x).for_each(|(r, x)| *r = x + self.bend * x * x);
            true
        }
    }

    /// True if so many variables with this b count as straight, and the evaluations that the answer took.
    fn straightness(variables: usize, bend: f64) -> (bool, usize) {
        let problem = Bent { variables, bend, evaluations: Arc::default() };
        let ingredients = Ingredients {
            problem: problem.clone(),
            at: vec![0.0; variables],
            jacobian: DMatrix::identity(variables, variables),
            bounds: Bounds::none(variables),
            priors: (0..variables).map(|_| None).collect(),
            inflation: 1.0,
            huber: f64::INFINITY,
        };
        let density = Density::new(&ingredients);
        let before = problem.evaluations.load(Ordering::Relaxed);
        let is_straight = density.is_straight(&mut Pcg64::seed_from_u64(1));
        (is_straight, problem.evaluations.load(Ordering::Relaxed) - before)
    }

    /// The Jacobian of a parabola is a straight line, whose slopes are measured where there are few of them.
    #[test]
    fn paths_of_few_variables_are_bent_as_the_model_is() {
        assert!(straightness(16, 0.15).0);
        assert!(!straightness(17, 0.15).0);
    }

    /// Without them, slopes are off by 2b z² of a standard normal z: 0.17 in the mean square, or 0.52.
    #[test]
    fn slopes_that_are_off_by_half_are_not_used() {
        assert!(straightness(17, 0.05).0);
        assert!(!straightness(17, 0.15).0);
    }

    /// At each of six places: the residuals, and again with central differences of 17 variables.
    #[test]
    fn slopes_are_compared_for_the_price_of_six_jacobians() {
        assert_eq!(straightness(17, 0.05).1, 6 * (1 + 1 + 2 * 17));
    }
}
