//! Marginal least-squares problem, without the variables that only shift the outputs of a run: its start and offsets.
//!
//! With the columns C of the shifts y of a run, which do not depend on y, a factorisation C = Q R, and the divisor T of
//! the sum of squares
//!
//! ```text
//! r(x, y) = r(x, 0) + C y        ∫ e^{−|r|²/2T} dy ∝ e^{−|P r|²/2T},   P = 1 − Q Qᵀ
//! y given x is normal with mean ŷ = −R⁻¹ Qᵀ r(x, 0) and covariance T R⁻¹ R⁻ᵀ
//! ```
//!
//! so draws of x are those of a problem with the residuals P r, and y is drawn for each of them. A run with one shift
//! between near bounds l and h, with s = √T/R, has an additional residual:
//!
//! ```text
//! ∫ₗʰ e^{−|r|²/2T} dy ∝ e^{−|P r|²/2T} ΔΦ,   ΔΦ = Φ((h − ŷ)/s) − Φ((l − ŷ)/s)        ρ = √(−2 T ln ΔΦ)
//! ```
//!
//! Several shifts with a near bound, and shifts with a prior, are not integrated over: they stay variables.

use crate::chance::{normal, normal_quantile, uniform};
use crate::fit::asked::problem::Problem;
use crate::fit::asked::residuals::{Bounds, Differences, Residuals};
use crate::fit::limits::{FAR_BOUND, FAR_TAIL};
use nalgebra::{DMatrix, DVector};
use rand_pcg::Pcg64;
use std::borrow::Cow;
use std::f64::consts::{PI, SQRT_2};

/// The problem in the variables that stay.
#[derive(Clone)]
pub(crate) struct Marginal<'a> {
    problem: Problem<'a>,
    /// A point and bounds in all variables.
    at: Vec<f64>,
    bounds: Bounds,
    /// T
    variance: f64,
    /// The variables that stay.
    kept: Vec<usize>,
    /// Variables that only shift an output, by run.
    shifts: Vec<Shifts>,
    /// Their columns, if no free pulley radius scales them.
    fixed: Option<Vec<Columns>>,
}

/// Nuisance variables of a run that are integrated out: start of its residuals, the variables, and true if a bound is
/// near.
#[derive(Clone)]
struct Shifts {
    run: usize,
    first: usize,
    own: Vec<usize>,
    is_bounded: bool,
}

/// The columns of a run's shifts at a point.
#[derive(Clone)]
struct Columns {
    q: DMatrix<f64>,
    r: DMatrix<f64>,
}

impl<'a> Marginal<'a> {
    /// About a point, with the divisor T and the standard deviations of all variables; without what `stays`.
    pub fn new(
        problem: Problem<'a>,
        (at, bounds): (&[f64], &Bounds),
        variance: f64,
        deviations: &[f64],
        stays: &dyn Fn(usize) -> bool,
    ) -> Self {
        let is_far = |j: usize| {
            let room = FAR_BOUND * deviations[j];
            at[j] - bounds.low[j] > room && bounds.high[j] - at[j] > room
        };
        let stages = problem.stages(at);
        let mut shifts = Vec::new();
        for (run, own) in problem.runs.iter().enumerate() {
            let own: Vec<usize> = problem.own_shifts(run, &stages[own.part]).into_iter().map(|(j, _)| j).collect();
            let is_bounded = !own.iter().all(|&j| is_far(j));
            if !own.is_empty() && !own.iter().any(|&j| stays(j)) && (own.len() == 1 || !is_bounded) {
                shifts.push(Shifts { run, first: problem.first_row(run), own, is_bounded });
            }
        }
        let kept = (0..at.len()).filter(|j| !shifts.iter().any(|shifts| shifts.own.contains(j))).collect();
        let radius = stages[0].pulley_radius;
        let is_turned = |j: usize| {
            let mut moved = at.to_vec();
            moved[j] += 1e-3 * (1.0 + at[j].abs());
            problem.stages(&moved)[0].pulley_radius != radius
        };
        let is_fixed = !(0..problem.parameters.len()).any(is_turned);
        let mut all = Self { problem, at: at.to_vec(), bounds: bounds.clone(), variance, kept, shifts, fixed: None };
        all.fixed = is_fixed.then(|| all.columns(at).into_owned());
        all
    }

    /// The variables that stay, of all.
    pub fn kept(&self) -> &[usize] {
        &self.kept
    }

    /// The values of those that stay.
    pub fn select<T: Clone>(&self, all: &[T]) -> Vec<T> {
        self.kept.iter().map(|&j| all[j].clone()).collect()
    }

    /// The bounds of those that stay.
    pub fn bounds_of(&self, all: &Bounds) -> Bounds {
        Bounds { low: self.select(&all.low), high: self.select(&all.high) }
    }

    fn whole(&self, x: &[f64]) -> Vec<f64> {
        let mut all = self.at.clone();
        self.kept.iter().zip(x).for_each(|(&j, x)| all[j] = *x);
        all
    }

    /// The columns of the shifts of each run, at a point in all variables.
    fn columns(&self, all: &[f64]) -> Cow<'_, [Columns]> {
        if let Some(fixed) = &self.fixed {
            return Cow::Borrowed(fixed);
        }
        let stages = self.problem.stages(all);
        let of = |shifts: &Shifts| {
            let run = &self.problem.runs[shifts.run];
            let machine = &stages[run.part];
            let mut matrix = DMatrix::zeros(run.rows(), shifts.own.len());
            let extras = self.problem.own_shifts(shifts.run, machine);
            for ((_, extra), mut column) in extras.iter().zip(matrix.column_iter_mut()) {
                run.shift(machine, extra, column.as_mut_slice());
            }
            let (q, r) = matrix.qr().unpack();
            Columns { q, r }
        };
        Cow::Owned(self.shifts.iter().map(of).collect())
    }

    /// Projects residuals at a point in all variables, and their derivatives, to those of the remaining variables.
    fn project(&self, all: &[f64], residuals: &mut [f64], mut jacobian: Option<&mut DMatrix<f64>>) {
        let mut more = self.problem.rows();
        for (shifts, columns) in self.shifts.iter().zip(self.columns(all).iter()) {
            let rows = shifts.first..shifts.first + columns.q.nrows();
            let along = columns.project(&mut residuals[rows.clone()]);
            let mut slopes = Vec::new();
            if let Some(jacobian) = &mut jacobian {
                let one = |mut column: nalgebra::DVectorViewMut<f64>| {
                    columns.project(&mut column.as_mut_slice()[rows.clone()])
                };
                slopes = jacobian.column_iter_mut().map(one).collect();
            }
            if shifts.is_bounded {
                let between = self.between(shifts, columns, &along);
                residuals[more] = (-2.0 * self.variance * between.log()).sqrt();
                for (j, slope) in slopes.iter().enumerate() {
                    // dρ/dx = −T/ρ d ln ΔΦ/dŷ dŷ/dx
                    let by = columns.step(slope).map_or(0.0, |step| step[0]) * between.slope();
                    let value = -self.variance * by / residuals[more];
                    if let Some(jacobian) = &mut jacobian {
                        jacobian[(more, j)] = if value.is_finite() { value } else { 0.0 };
                    }
                }
                more += 1;
            }
        }
    }

    /// The only shift of a run between its bounds, in standard deviations from its mean.
    fn between(&self, shifts: &Shifts, columns: &Columns, along: &DVector<f64>) -> Between {
        let j = shifts.own[0];
        let deviation = self.variance.sqrt() / columns.r[(0, 0)].abs();
        let mean = self.at[j] + columns.step(along).map_or(0.0, |step| step[0]);
        let of = |bound: f64| (bound - mean) / deviation;
        Between { low: of(self.bounds.low[j]), high: of(self.bounds.high[j]), mean, deviation }
    }

    /// All variables for these, with shifts drawn from their conditional distribution; those of the fit if the
    /// simulation fails.
    pub fn completed(&mut self, x: &[f64], random: &mut Pcg64) -> Vec<f64> {
        let mut all = self.whole(x);
        let mut residuals = vec![0.0; self.problem.rows()];
        if self.shifts.is_empty() || !self.problem.evaluate(&all, &mut residuals) {
            return all;
        }
        for (shifts, columns) in self.shifts.iter().zip(self.columns(&all).iter()) {
            let along = columns.project(&mut residuals[shifts.first..shifts.first + columns.q.nrows()]);
            if shifts.is_bounded {
                let j = shifts.own[0];
                // Rounding may put it beyond a bound.
                let drawn = self.between(shifts, columns, &along).draw(random);
                all[j] = drawn.clamp(self.bounds.low[j], self.bounds.high[j]);
                continue;
            }
            // y = y₀ − R⁻¹ (Qᵀ r(x, y₀) + √T ξ)
            let noise = DVector::from_fn(along.len(), |_, _| self.variance.sqrt() * normal(random));
            let step = columns.step(&(along + noise));
            shifts.own.iter().zip(step.iter().flatten()).for_each(|(&j, step)| all[j] += step);
        }
        all
    }
}

impl Columns {
    /// r ← P r; Qᵀ r.
    fn project(&self, r: &mut [f64]) -> DVector<f64> {
        let along = self.q.tr_mul(&nalgebra::DVectorView::from_slice(r, r.len()));
        for (column, along) in self.q.column_iter().zip(along.iter()) {
            r.iter_mut().zip(column.iter()).for_each(|(r, q)| *r -= along * q);
        }
        along
    }

    /// −R⁻¹ Qᵀ r, of these Qᵀ r.
    fn step(&self, along: &DVector<f64>) -> Option<DVector<f64>> {
        self.r.solve_upper_triangular(along).map(|step| -step)
    }
}

/// A normal variable between bounds in standard deviations from its mean.
#[derive(Debug, Clone, Copy)]
struct Between {
    low: f64,
    high: f64,
    mean: f64,
    deviation: f64,
}

impl Between {
    /// ln ΔΦ
    fn log(self) -> f64 {
        // Intervals above the mean are mirrored, which loses less to rounding.
        let (a, b) = if self.low > 0.0 { (-self.high, -self.low) } else { (self.low, self.high) };
        let (below, above) = (log_share(a), log_share(b));
        (above + (-(below - above).exp()).ln_1p()).min(0.0)
    }

    /// d ln ΔΦ/dŷ = (φ(l) − φ(h))/(s ΔΦ)
    fn slope(self) -> f64 {
        let log = self.log();
        let share = |z: f64| (-0.5 * z * z - 0.5 * (2.0 * PI).ln() - log).exp();
        (share(self.low) - share(self.high)) / self.deviation
    }

    /// A draw by the inverse of its distribution; in the far tail it falls as e^{−|z| Δz}.
    fn draw(self, random: &mut Pcg64) -> f64 {
        let (sign, a, b) = if self.low > 0.0 { (-1.0, -self.high, -self.low) } else { (1.0, self.low, self.high) };
        let z = if b > FAR_TAIL {
            let (below, above) = (log_share(a).exp(), log_share(b).exp());
            normal_quantile(below + uniform(random) * (above - below))
        } else {
            // φ(z) ≈ φ(b) e^{−|b| (b − z)}
            b + (1.0 - uniform(random)).ln() / -b
        };
        let z = z.clamp(a, b);
        self.mean + sign * z * self.deviation
    }
}

/// ln Φ(z); far below zero by Φ(z) ≈ φ(z)/|z| (1 − 1/z²).
fn log_share(z: f64) -> f64 {
    if z > FAR_TAIL {
        return (0.5 * libm::erfc(-z / SQRT_2)).ln();
    }
    -0.5 * z * z - (-z).ln() - 0.5 * (2.0 * PI).ln() + (-1.0 / (z * z)).ln_1p()
}

impl Residuals for Marginal<'_> {
    fn rows(&self) -> usize {
        self.problem.rows() + self.shifts.iter().filter(|shifts| shifts.is_bounded).count()
    }

    fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
        let all = self.whole(x);
        let rows = self.problem.rows();
        let is_good = self.problem.evaluate(&all, &mut r[..rows]);
        if is_good {
            self.project(&all, r, None);
        }
        is_good
    }

    fn jacobian(&mut self, x: &[f64], _: &[f64], bounds: &Bounds, how: &Differences) -> Option<DMatrix<f64>> {
        // The given residuals are projected; differences refer to those before.
        let mut own = vec![0.0; self.rows()];
        self.linearised(x, &mut own, bounds, how)
    }

    fn linearised(&mut self, x: &[f64], r: &mut [f64], bounds: &Bounds, how: &Differences) -> Option<DMatrix<f64>> {
        let all = self.whole(x);
        let mut wide = self.bounds.clone();
        for (place, &j) in self.kept.iter().enumerate() {
            (wide.low[j], wide.high[j]) = (bounds.low[place], bounds.high[place]);
        }
        let how = match how {
            Differences::Coarse(steps) => {
                // Shifts have no differences.
                let mut own = vec![1.0; all.len()];
                self.kept.iter().zip(steps).for_each(|(&j, step)| own[j] = *step);
                Differences::Coarse(own)
            }
            other => other.clone(),
        };
        let rows = self.problem.rows();
        let jacobian = self.problem.linearised(&all, &mut r[..rows], &wide, &how)?;
        let mut jacobian = jacobian.select_columns(&self.kept).resize_vertically(self.rows(), 0.0);
        // P depends on a free pulley radius only; gradients neglect this.
        self.project(&all, r, Some(&mut jacobian));
        Some(jacobian)
    }

    fn is_exact(&self) -> bool {
        self.problem.is_exact()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::problem::tests::case;
    use rand_pcg::rand_core::SeedableRng;

    const T: f64 = 1.7;

    /// ½ |r|²/T at a point, all variables in it.
    fn cost<R: Residuals>(problem: &mut R, x: &[f64]) -> f64 {
        let mut r = vec![0.0; problem.rows()];
        assert!(problem.evaluate(x, &mut r));
        0.5 * r.iter().map(|r| r * r).sum::<f64>() / T
    }

    /// Bounds of a start that contain it, and bounds that exclude most of its distribution.
    #[test]
    fn what_stays_has_the_density_of_quadrature() {
        let (case, plan) = case(false);
        let mut problem = Problem::new(&case, &plan).unwrap();
        let (at, wide) = (problem.start(), problem.bounds());
        let far = Bounds { low: vec![wide.low[0], -1e9], high: vec![wide.high[0], 1e9] };
        let mut middle = Marginal::new(problem.clone(), (&at, &far), 0.0, &[0.1, 100.0], &|_| false);
        let mean = middle.completed(&at[..1], &mut Pcg64::seed_from_u64(1))[1];
        let deviation = T.sqrt() / middle.columns(&at)[0].r[(0, 0)].abs();
        for bounds in [[-8.0, 8.0], [-0.5, 1.0], [2.0, 5.0], [-6.0, -4.0]] {
            let [low, high] = bounds.map(|bound| mean + bound * deviation);
            let bounds = Bounds { low: vec![wide.low[0], low], high: vec![wide.high[0], high] };
            let mut marginal = Marginal::new(problem.clone(), (&at, &bounds), T, &[0.1, 100.0], &|_| false);
            assert_eq!(marginal.kept(), [0]);
            let h = 1e-3 * (high - low);
            let points: Vec<f64> = (0..1000).map(|k| low + h * (f64::from(k) + 0.5)).collect();
            let offset = [0.0, -3e-3, 2e-3].map(|by| {
                let x = at[0] + by;
                let least =
                    points.iter().step_by(10).map(|y| cost(&mut problem, &[x, *y])).fold(f64::INFINITY, f64::min);
                let terms: Vec<f64> = points.iter().map(|y| (least - cost(&mut problem, &[x, *y])).exp()).collect();
                let all: f64 = terms.iter().sum();
                // Its draws have the mean of the quadrature.
                let mean = points.iter().zip(&terms).map(|(y, term)| y * term).sum::<f64>() / all;
                let square = points.iter().zip(&terms).map(|(y, term)| y * y * term).sum::<f64>() / all - mean * mean;
                let mut random = Pcg64::seed_from_u64(1);
                let drawn: Vec<f64> = (0..2000).map(|_| marginal.completed(&[x], &mut random)[1]).collect();
                assert!(drawn.iter().all(|y| (low..=high).contains(y)));
                let found = drawn.iter().sum::<f64>() / 2000.0;
                assert!((found - mean).abs() < 5.0 * (square / 2000.0).sqrt(), "{found} {mean}");
                (all * h).ln() - least + cost(&mut marginal, &[x])
            });
            // Up to a common factor.
            assert!(offset.iter().all(|o| (o - offset[0]).abs() < 1e-4), "{low} {high}: {offset:?}");
        }
    }

    #[test]
    fn slopes_are_those_of_differences() {
        let (case, plan) = case(false);
        let problem = Problem::new(&case, &plan).unwrap();
        let (at, wide) = (problem.start(), problem.bounds());
        let bounds = Bounds { low: vec![wide.low[0], -0.3], high: vec![wide.high[0], 0.4] };
        let mut marginal = Marginal::new(problem, (&at, &bounds), T, &[0.1, 100.0], &|_| false);
        let own = marginal.bounds_of(&bounds);
        let mut r = vec![0.0; marginal.rows()];
        let jacobian = marginal.linearised(&at[..1], &mut r, &own, &Differences::Central).unwrap();
        let mut at_sides = [-1e-5, 1e-5].map(|by| {
            let mut r = r.clone();
            assert!(marginal.evaluate(&[at[0] + by], &mut r));
            r
        });
        let high = at_sides[1].split_off(0);
        for (k, (low, high)) in at_sides[0].iter().zip(&high).enumerate() {
            let slope = (high - low) / 2e-5;
            assert!((slope - jacobian[(k, 0)]).abs() < 1e-4 * (1.0 + slope.abs()), "{k}: {slope} {}", jacobian[(k, 0)]);
        }
    }

    /// A start and an offset of the same run: the integrand is least where both are best.
    #[test]
    fn several_shifts_of_a_run_go_together() {
        let (case, plan) = case(true);
        let mut problem = Problem::new(&case, &plan).unwrap();
        let (at, bounds) = (problem.start(), problem.bounds());
        assert_eq!(at.len(), 3);
        let far = Bounds { low: vec![bounds.low[0], -1e9, -1e9], high: vec![bounds.high[0], 1e9, 1e9] };
        let mut marginal = Marginal::new(problem.clone(), (&at, &far), T, &[0.1; 3], &|_| false);
        assert_eq!(marginal.kept(), [0]);
        marginal.variance = 0.0;
        let best = marginal.completed(&at[..1], &mut Pcg64::seed_from_u64(1));
        let least = cost(&mut problem, &best);
        assert!((cost(&mut marginal, &at[..1]) - least).abs() < 1e-9 * least);
        for (j, by) in [(1, 0.1), (1, -0.1), (2, 0.1), (2, -0.1)] {
            let mut beside = best.clone();
            beside[j] += by;
            assert!(cost(&mut problem, &beside) > least);
        }
        // One of them has a prior: both stay.
        assert_eq!(Marginal::new(problem, (&at, &far), T, &[0.1; 3], &|j| j == 2).kept(), [0, 1, 2]);
    }

    #[test]
    fn shares_far_out_have_their_logarithms() {
        // ln Φ(−30) = −454.321243956343 and ln Φ(−40) = −804.608442013754 (R, pnorm(z, log.p = TRUE))
        for (z, log) in [(-30.000001, -454.32127396), (-40.0, -804.608442013754)] {
            assert!((log_share(z) - log).abs() < 1e-5, "{z}: {}", log_share(z));
        }
        let far = Between { low: 50.0, high: 60.0, mean: -50.0, deviation: 1.0 };
        assert!((0.0..0.5).contains(&far.draw(&mut Pcg64::seed_from_u64(1))));
        assert!(far.log() < -1250.0 && far.log().is_finite());
    }
}
