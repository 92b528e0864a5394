//! Uncertainty of estimates: their covariance for the noise of the residuals.
//!
//! For white residuals it is s² (JᵀJ)⁻¹. Correlated residuals contain less information: with the covariance Σ of the
//! noise it is (JᵀJ)⁻¹ Jᵀ Σ J (JᵀJ)⁻¹, for every Σ that the residuals allow ([`crate::fit::noise`]).

use super::directions::Directions;
use super::doubts::{Cause, Disagreement, OtherLaw};
use super::identify::Identifiability;
use crate::fit::asked::problem::Problem;
use crate::fit::limits::{COLOURED, NORMAL};
use crate::fit::noise::{self, Slow, Spread, Wave, half_width};
use crate::fit::search::triangle::inverse_of_square;
use crate::log::Quantity;
use crate::number::engineering_typed;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Covariance of the free variables, in their order; exists only if they are determined.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Covariance {
    /// Variables that are free.
    pub free: Vec<usize>,
    /// Their covariance.
    pub matrix: DMatrix<f64>,
    /// Standard deviation of the weighted residuals.
    pub deviation: f64,
    /// Independent values minus variables.
    pub freedom: usize,
    /// Half-width of a 95 % interval, in standard errors; these include the effect of few degrees of freedom.
    pub reach: f64,
}

/// Information of the logs at a point: determined parameters and their accuracy.
#[derive(Debug, Clone)]
pub(crate) struct Judged {
    pub identifiability: Identifiability,
    pub covariance: Covariance,
    /// Ratio of the errors to those with white noise of the same size.
    pub inflation: f64,
    /// The slow noises of each quantity, by its index in the problem.
    pub spreads: Vec<Spread>,
    /// Parts of the logs that disagree.
    pub disagreement: Option<Disagreement>,
    /// The law that the residuals suggest.
    pub other_law: Option<OtherLaw>,
    /// The missing element.
    pub cause: Option<Cause>,
}

impl Judged {
    /// True if residuals may hide another model: slow noise is more probable than white, and widens the errors.
    pub fn is_coloured(&self) -> bool {
        self.inflation >= COLOURED && self.spreads.iter().any(Spread::is_coloured)
    }

    /// The uncertainty at `x` with these residuals and this Jacobian, without the `held` variables; `None` if numbers
    /// fail.
    pub fn new(
        problem: &Problem,
        residuals: &[f64],
        jacobian: &DMatrix<f64>,
        x: &[f64],
        held: &[bool],
    ) -> Option<Self> {
        let globals = problem.globals();
        let free: Vec<usize> = (0..held.len()).filter(|&j| !held[j]).collect();
        let own: Vec<usize> = free.iter().copied().filter(|&j| j < globals).collect();
        let directions = Directions::new(problem, jacobian, x, &own)?;
        let alive = directions.alive;
        let freedom = (problem.independent() - free.len() as f64).max(1.0);
        let squares: f64 = residuals.iter().map(|r| r * r).sum();
        let deviation = (squares / freedom).sqrt();

        // In terms of the directions, whose columns can be inverted for any logs.
        let mut turned = DMatrix::zeros(globals, alive);
        for i in 0..alive {
            for j in 0..globals {
                turned[(j, i)] = directions.whole[j] * directions.v[(j, i)];
            }
        }
        let locals: Vec<usize> = free.iter().copied().filter(|&j| j >= globals).collect();
        let mut columns = DMatrix::zeros(jacobian.nrows(), alive + locals.len());
        columns.columns_mut(0, alive).copy_from(&(jacobian.columns(0, globals) * &turned));
        for (place, &j) in locals.iter().enumerate() {
            columns.set_column(alive + place, &jacobian.column(j));
        }
        // A variable of one run without an effect there has prior knowledge only.
        let shown: Vec<usize> =
            (0..columns.ncols()).filter(|&c| c < alive || columns.column(c).iter().any(|v| *v != 0.0)).collect();
        let columns = columns.select_columns(&shown);
        let inverse = inverse_of_square(&columns)?;
        let spreads = noise::spreads(problem, residuals, &columns, alive, &inverse);
        let error = |c: &[f64]| half_width(&spreads, &DVector::from_column_slice(c)) / NORMAL;
        let off: Vec<f64> =
            (0..alive).map(|i| error(&(0..alive).map(|k| f64::from(k == i)).collect::<Vec<_>>())).collect();
        let identifiability = Identifiability::told(problem, &directions, x, deviation, &off, &error);

        // Each variable by itself; their correlations are those of the mean of all kinds of noise.
        let mut middle = DMatrix::zeros(alive, alive);
        for spread in &spreads {
            middle += &spread.covariance;
        }
        let middle = &turned * middle * turned.transpose();
        let each: Vec<f64> =
            (0..globals).map(|j| error(&(0..alive).map(|i| turned[(j, i)]).collect::<Vec<_>>())).collect();
        let white = &turned * inverse.view((0, 0), (alive, alive)) * turned.transpose() * (deviation * deviation);
        let wider: Vec<f64> = own.iter().map(|&j| each[j] / white[(j, j)].sqrt()).filter(|f| f.is_finite()).collect();
        let inflation =
            if wider.is_empty() { 1.0 } else { (wider.iter().map(|f| f.ln()).sum::<f64>() / wider.len() as f64).exp() };
        let place_of = |j: usize| {
            let place = locals.iter().position(|&own| own == j)? + alive;
            shown.iter().position(|&c| c == place)
        };
        let places: Vec<Option<usize>> = free.iter().map(|&j| if j < globals { None } else { place_of(j) }).collect();
        let matrix = DMatrix::from_fn(free.len(), free.len(), |a, b| match (places[a], places[b]) {
            (None, None) if free[a] < globals && free[b] < globals => {
                let (i, j) = (free[a], free[b]);
                let correlation = middle[(i, j)] / (middle[(i, i)] * middle[(j, j)]).sqrt();
                each[i] * each[j] * if i == j { 1.0 } else { correlation }
            }
            (Some(a), Some(b)) => inverse[(a, b)] * (deviation * inflation).powi(2),
            _ if a == b => f64::INFINITY,
            _ => 0.0,
        });
        let covariance = Covariance { free, matrix, deviation, freedom: freedom.round() as usize, reach: NORMAL };
        Some(Self { identifiability, covariance, inflation, spreads, disagreement: None, other_law: None, cause: None })
    }
}

impl Judged {
    /// Adds the disagreement of parts of the logs, and the effects of another law and of a missing element.
    pub fn widen(&mut self, disagreement: Option<Disagreement>, other_law: Option<OtherLaw>, cause: Option<Cause>) {
        let added = disagreement.iter().map(|found| &found.added).chain(other_law.iter().map(|found| &found.added));
        let added = added.chain(cause.iter().map(|found| &found.added));
        for added in added {
            let globals = added.nrows();
            if let Some(belts) = &mut self.identifiability.belts {
                belts.widen(added);
            }
            for (a, &i) in self.covariance.free.iter().enumerate().filter(|(_, i)| **i < globals) {
                for (b, &j) in self.covariance.free.iter().enumerate().filter(|(_, j)| **j < globals) {
                    self.covariance.matrix[(a, b)] += added[(i, j)];
                }
            }
        }
        (self.disagreement, self.other_law, self.cause) = (disagreement, other_law, cause);
    }

    /// Outputs whose noise oscillates, with its frequency, Hz.
    pub fn oscillations(&self, problem: &Problem) -> Vec<(Quantity, f64)> {
        let of = |spread: &Spread| spread.slow.iter().map(|slow| slow.frequency).find(|frequency| *frequency > 0.0);
        let all = self.spreads.iter().zip(problem.quantities());
        all.filter_map(|(spread, quantity)| Some((quantity, of(spread)? / TAU))).collect()
    }

    /// The autocorrelation of the residuals, in words.
    pub fn slow_words(&self, problem: &Problem) -> String {
        let quantities = problem.quantities();
        let shown = |value: f64, unit| engineering_typed(value, unit, 2);
        let told_time = |slow: &Slow| match slow.frequency > 0.0 {
            true => format!("oscillations of {}", shown(slow.frequency / TAU, "Hz")),
            false => shown(slow.time, "s"),
        };
        let mut told = Vec::new();
        for (spread, quantity) in self.spreads.iter().zip(&quantities) {
            let own: Vec<String> = spread.slow.iter().map(told_time).collect();
            if !own.is_empty() {
                told.push(format!("{} over {}", quantity.name(), own.join(" and ")));
            }
        }
        let mut words = match told.is_empty() {
            true => "white".to_string(),
            false => format!("correlated in time: {}", told.join(", ")),
        };
        for (spread, quantity) in self.spreads.iter().zip(&quantities).filter(|(spread, _)| spread.unevenness > 1.0) {
            words.push_str(&format!(
                "; {} is up to {:.1} times larger in some parts than in others",
                quantity.name(),
                spread.unevenness
            ));
        }
        for Wave { quantity, length, amplitude } in self.spreads.iter().flat_map(|spread| &spread.waves) {
            let (length, amplitude) = (shown(*length, quantity.unit()), shown(*amplitude, quantity.unit()));
            words.push_str(&format!("; {} repeats by ±{amplitude} every {length}", quantity.name()));
        }
        if words.contains("correlated") || words.contains(';') {
            words.push_str(&format!(": errors are {:.1} times those of independent residuals", self.inflation));
        }
        words
    }
}

impl Covariance {
    /// The covariance at a minimum with these residuals and this Jacobian, without variables at bounds; `None` if they
    /// are not determined.
    pub fn new(problem: &Problem, residuals: &[f64], jacobian: &DMatrix<f64>, at_bound: &[bool]) -> Option<Self> {
        let free: Vec<usize> = (0..at_bound.len()).filter(|&j| !at_bound[j]).collect();
        inverse_of_square(&jacobian.select_columns(&free))?;
        // The directions do not depend on the point, except for the sizes of parameters that may be zero.
        let x = problem.start();
        Some(Judged::new(problem, residuals, jacobian, &x, at_bound)?.covariance)
    }

    /// Standard deviation of variable `j`; `None` at a bound.
    pub fn error(&self, j: usize) -> Option<f64> {
        let place = self.free.iter().position(|&free| free == j)?;
        Some(self.matrix[(place, place)].max(0.0).sqrt())
    }

    /// Correlation of two variables.
    pub fn correlation(&self, i: usize, j: usize) -> Option<f64> {
        let place = |j: usize| self.free.iter().position(|&free| free == j);
        let (a, b) = (place(i)?, place(j)?);
        let own = (self.matrix[(a, a)] * self.matrix[(b, b)]).sqrt();
        if own > 0.0 { Some((self.matrix[(a, b)] / own).clamp(-1.0, 1.0)) } else { None }
    }
}

/// Correlation of neighbouring residuals.
pub fn memory_of(residuals: &[f64], rows: &[usize]) -> f64 {
    let (mut own, mut next) = (0.0, 0.0);
    for pair in rows.windows(2) {
        next += residuals[pair[0]] * residuals[pair[1]];
    }
    for &row in rows {
        own += residuals[row] * residuals[row];
    }
    if own > 0.0 { next / own } else { 0.0 }
}
