//! Tests whether another friction law explains the residuals.
//!
//! If friction falls with speed, or differs between the directions, and the fit has neither, its parameters absorb part
//! of the difference: residuals stay small, and the errors of the estimates are far larger than noise suggests. Laws
//! that the case does not have are therefore tried as a further column of the Jacobian. With the residuals r, the
//! columns J of the fit, the column j of the amplitude a of such a law and A = (JᵀJ)⁻¹
//!
//! ```text
//! j⊥ = j − J A Jᵀ j      a = −j⊥·r / j⊥·j⊥      d = −a A Jᵀ j
//! ```
//!
//! d is the change of the parameters with the law: omitted-variable bias. If a is significant, and a run with the law
//! and the parameters moved by d confirms the predicted gain, intervals are widened by d, and the law is reported.

use super::doubts::{OtherLaw, falling};
use super::uncertainty::Judged;
use crate::fit::asked::drifting;
use crate::fit::asked::problem::Problem;
use crate::fit::asked::run::FittedLog;
use crate::fit::limits::{
    DRIFT_PARTS, FILE_ROUNDING, LAW_DUST, LAW_FIRST, LAW_KEEPS, LAW_LEAST, LAW_MOST, LAW_ROUNDS, LAW_SHARES, LAW_SHOWN,
    NORMAL, STRIBECK_SHARES,
};
use crate::fit::noise::{half_width, spreads};
use crate::fit::search::starts::Searched;
use crate::fit::search::triangle::inverse_of_square;
use crate::friction::{Friction, Law, Shape};
use crate::log::Quantity;
use crate::machine::Machine;
use crate::number::engineering_typed;
use crate::solve::Bench;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// A body of an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Body {
    Drive,
    Cart,
    Idler,
}

impl Body {
    const ALL: [Body; 3] = [Body::Cart, Body::Drive, Body::Idler];

    fn key(self) -> &'static str {
        match self {
            Body::Drive => "drive_pulley",
            Body::Cart => "cart",
            Body::Idler => "idler_pulley",
        }
    }

    /// Units of its friction and of its speed.
    fn units(self) -> (&'static str, &'static str) {
        match self {
            Body::Drive | Body::Idler => ("N m", "rad/s"),
            Body::Cart => ("N", "m/s"),
        }
    }

    fn friction(self, machine: &mut Machine) -> &mut Friction {
        match self {
            Body::Drive => &mut machine.drive_pulley.friction,
            Body::Cart => &mut machine.cart.friction,
            Body::Idler => &mut machine.idler_pulley.friction,
        }
    }
}

/// A law that a body might have.
#[derive(Debug, Clone, Copy, PartialEq)]
enum AlternativeLaw {
    /// Friction that falls with speed, with this Stribeck velocity.
    Stribeck(f64),
    /// More Coulomb friction forward, and as much less backward.
    Sided,
    /// All friction less at the start of each log, and equally more at its end, relative.
    Drift,
    /// All friction by one sine along each log, relative.
    Sway,
}

impl AlternativeLaw {
    /// Its name in results.
    fn key(self) -> &'static str {
        match self {
            AlternativeLaw::Stribeck(_) => "stribeck",
            AlternativeLaw::Sided => "sided",
            AlternativeLaw::Drift => "drift",
            AlternativeLaw::Sway => "sway",
        }
    }

    /// True for a drift along the log, whose amplitude is relative to friction.
    fn is_along(self) -> bool {
        matches!(self, AlternativeLaw::Drift | AlternativeLaw::Sway)
    }
}

#[derive(Debug, Clone, Copy)]
struct Candidate {
    body: Body,
    kind: AlternativeLaw,
    /// Coulomb friction of the body as fitted.
    coulomb: f64,
}

impl Candidate {
    /// The amplitude tried first.
    fn first(self) -> f64 {
        LAW_FIRST * if self.kind.is_along() { 1.0 } else { self.coulomb }
    }

    /// Adds the law with this amplitude to a machine, at this fraction of a log.
    fn put(self, machine: &mut Machine, amplitude: f64, share: f64) {
        let friction = self.body.friction(machine);
        match self.kind {
            AlternativeLaw::Stribeck(velocity) => {
                friction.law = Law::Stribeck { velocity, shape: Shape::Gaussian };
                for side in [&mut friction.forward, &mut friction.backward] {
                    side.breakaway = side.coulomb + amplitude;
                }
            }
            AlternativeLaw::Sided => {
                for (side, sign) in [(&mut friction.forward, 1.0), (&mut friction.backward, -1.0)] {
                    side.coulomb += sign * amplitude;
                    side.breakaway = side.breakaway.max(side.coulomb);
                }
            }
            AlternativeLaw::Drift | AlternativeLaw::Sway => {
                let along = if self.kind == AlternativeLaw::Drift { 2.0 * share - 1.0 } else { (TAU * share).sin() };
                let factor = 1.0 + amplitude * along;
                for side in [&mut friction.forward, &mut friction.backward] {
                    side.viscous *= factor;
                    side.coulomb *= factor;
                    side.breakaway *= factor;
                }
            }
        }
    }

    /// Range of the law's amplitude.
    fn range(self) -> (f64, f64) {
        match self.kind {
            AlternativeLaw::Stribeck(_) => (LAW_LEAST * self.coulomb, LAW_MOST * self.coulomb),
            AlternativeLaw::Sided => (-0.9 * self.coulomb, 0.9 * self.coulomb),
            AlternativeLaw::Drift | AlternativeLaw::Sway => (-0.9, 0.9),
        }
    }

    fn words(self, amplitude: f64) -> String {
        let shown = |value, unit| engineering_typed(value, unit, 2);
        let (force, speed) = self.body.units();
        let whose = self.body.key().replace('_', " ");
        match self.kind {
            AlternativeLaw::Stribeck(velocity) => {
                falling(self.body.key(), &shown(amplitude, force), &shown(velocity, speed))
            }
            AlternativeLaw::Sided => format!(
                "Coulomb friction of the {whose} that is {} {} forward than backward",
                shown(2.0 * amplitude.abs(), force),
                if amplitude > 0.0 { "greater" } else { "less" }
            ),
            AlternativeLaw::Drift => format!(
                "friction of the {whose} that {} by {} % from the beginning of each log to its end",
                if amplitude > 0.0 { "rises" } else { "falls" },
                percent(200.0 * amplitude.abs())
            ),
            AlternativeLaw::Sway => format!(
                "friction of the {whose} that {} along each log by a sine of ±{} %",
                if amplitude > 0.0 { "rises and falls" } else { "falls and rises" },
                percent(100.0 * amplitude.abs())
            ),
        }
    }
}

/// Per cent in two digits.
fn percent(value: f64) -> String {
    if value >= 0.1 {
        format!("{:.*}", if value < 1.0 { 2 } else { usize::from(value < 10.0) }, value)
    } else {
        format!("{value:.1e}")
    }
}

/// A candidate with its column and its effect.
struct Tried {
    candidate: Candidate,
    amplitude: f64,
    /// ∂r/∂a
    column: DVector<f64>,
    /// A Jᵀ j
    along: DVector<f64>,
    /// Reduction of Σ r².
    gain: f64,
}

/// The end of the fit, shared by all candidates.
struct EndOfFit<'a> {
    problem: &'a Problem<'a>,
    x: &'a [f64],
    /// The variables that are not at a bound, a column of the Jacobian each.
    free: Vec<usize>,
    residuals: DVector<f64>,
    jacobian: DMatrix<f64>,
    inverse: DMatrix<f64>,
}

/// The law that the residuals suggest most; `None` if none is significant or too little is determined.
pub(crate) fn other_law(found: &Searched, judged: &Judged) -> Option<OtherLaw> {
    let (problem, best) = (&found.problem, &found.best);
    let g = problem.globals();
    if problem.is_stopped()
        || problem.runs.iter().any(FittedLog::is_closed)
        || !judged.identifiability.complete()
        || best.at_bound[..g].contains(&true)
    {
        return None;
    }
    let candidates = candidates(problem, &best.x);
    if candidates.is_empty() {
        return None;
    }
    let place = EndOfFit::new(found)?;
    let tried = candidates.into_iter().filter_map(|candidate| place.attempt(candidate, candidate.first()));
    let tried = tried.max_by(|a, b| a.gain.total_cmp(&b.gain))?;
    // Independent residuals must show it, too.
    if tried.gain.sqrt() < LAW_SHOWN * judged.covariance.deviation {
        return None;
    }
    place.judged(&place.again(tried)?, judged)
}

/// Laws to try: for bodies with free friction of Coulomb's law.
fn candidates(problem: &Problem, x: &[f64]) -> Vec<Candidate> {
    let mut machine = problem.stage_at(x);
    let mut all = Vec::new();
    // Pulley and cart are the bodies of an axis.
    if !machine.has_torque_balance() {
        return all;
    }
    for body in Body::ALL {
        let prefix = format!("{}.friction.", body.key());
        let is_free = problem.parameters.iter().flat_map(|own| &own.keys).any(|(key, _)| key.starts_with(&prefix));
        let friction = *body.friction(&mut machine);
        let (forward, backward) = (friction.forward, friction.backward);
        let coulomb = f64::min(forward.coulomb, backward.coulomb);
        let alike = forward == backward && forward.breakaway <= forward.coulomb;
        if !is_free || friction.law != Law::Coulomb || !alike || coulomb <= 0.0 {
            continue;
        }
        let fastest = fastest(problem, x, body);
        all.extend(STRIBECK_SHARES.map(|share| Candidate {
            body,
            kind: AlternativeLaw::Stribeck(share * fastest),
            coulomb,
        }));
        all.extend([AlternativeLaw::Sided, AlternativeLaw::Drift, AlternativeLaw::Sway].map(|kind| Candidate {
            body,
            kind,
            coulomb,
        }));
    }
    all
}

/// Largest speed of a body in the logs by the model.
fn fastest(problem: &Problem, x: &[f64], body: Body) -> f64 {
    let quantity = if body == Body::Cart { Quantity::CartSpeed } else { Quantity::DriveSpeed };
    let mut bench = Bench::default();
    let mut most: f64 = 0.0;
    let mut speeds = [Vec::new()];
    for (index, run) in problem.runs.iter().enumerate() {
        let machine = problem.stage_of(run.part, x);
        if run.predict(&mut bench, &machine, &problem.extras_of(index, x), &[quantity], &mut speeds) {
            most = speeds[0].iter().fold(most, |most, v| most.max(v.abs()));
        }
    }
    most
}

impl<'a> EndOfFit<'a> {
    fn new(found: &'a Searched<'a>) -> Option<Self> {
        let (problem, best) = (&found.problem, &found.best);
        let free: Vec<usize> = (0..best.x.len()).filter(|&j| !best.at_bound[j]).collect();
        let jacobian = best.jacobian.select_columns(&free);
        let inverse = inverse_of_square(&jacobian)?;
        let residuals = DVector::from_column_slice(&best.residuals);
        Some(Self { problem, x: &best.x, free, residuals, jacobian, inverse })
    }

    /// The residuals at `x` with this amplitude of a law; `None` if the model fails with it.
    fn with(&self, candidate: Candidate, amplitude: f64, x: &[f64]) -> Option<DVector<f64>> {
        let mut residuals = vec![0.0; self.residuals.len()];
        let mut bench = Bench::default();
        for (index, run) in self.problem.runs.iter().enumerate() {
            let first = self.problem.first_row(index);
            let extras = self.problem.extras_of(index, x);
            let machine = self.problem.stage_of(run.part, x);
            let with = |share: f64| {
                let mut machine = machine.clone();
                candidate.put(&mut machine, amplitude, share);
                machine
            };
            let rows = &mut residuals[first..first + run.rows()];
            let good = match candidate.kind {
                AlternativeLaw::Drift | AlternativeLaw::Sway => {
                    let stages: Vec<Machine> =
                        (0..DRIFT_PARTS).map(|k| with((k as f64 + 0.5) / DRIFT_PARTS as f64)).collect();
                    drifting::residuals(run, &stages, &extras, rows)
                }
                AlternativeLaw::Stribeck(_) | AlternativeLaw::Sided => {
                    run.residuals(&mut bench, &with(0.5), &extras, rows)
                }
            };
            if !good {
                return None;
            }
        }
        Some(DVector::from_vec(residuals))
    }

    /// Decrease of Σ r² by a law at x + s d, with the best of the shares s; `None` if it is below [`LAW_KEEPS`] of the
    /// predicted decrease.
    fn gained(&self, tried: &Tried) -> Option<f64> {
        let bounds = self.problem.bounds();
        let own = |share: &f64| {
            let amplitude = share * tried.amplitude;
            let mut x = self.x.to_vec();
            for (&j, along) in self.free.iter().zip(tried.along.iter()) {
                x[j] = (x[j] - amplitude * along).clamp(bounds.low[j], bounds.high[j]);
            }
            let left = self.with(tried.candidate, amplitude, &x)?;
            Some(self.residuals.norm_squared() - left.norm_squared())
        };
        let gain = LAW_SHARES.iter().filter_map(own).fold(0.0, f64::max);
        (gain >= LAW_KEEPS * tried.gain).then_some(gain)
    }

    /// The estimated amplitude of a law, from the change of the residuals by an amplitude of `step`; `None` if the
    /// model fails with it, or if the parameters have the same effect.
    fn attempt(&self, candidate: Candidate, step: f64) -> Option<Tried> {
        let moved = self.with(candidate, step, self.x)?;
        let column = (moved - &self.residuals) / step;
        let along = &self.inverse * self.jacobian.tr_mul(&column);
        let beside = &column - &self.jacobian * &along;
        let square = beside.norm_squared();
        if square <= 1e-6 * column.norm_squared() || !square.is_finite() {
            return None;
        }
        let product = beside.dot(&self.residuals);
        let (least, most) = candidate.range();
        let amplitude = -product / square;
        let gain = if amplitude < least { 0.0 } else { product * product / square };
        Some(Tried { candidate, amplitude: amplitude.clamp(least, most), column, along, gain })
    }

    /// A law whose column is taken again at its amplitude.
    fn again(&self, mut tried: Tried) -> Option<Tried> {
        for _ in 1..LAW_ROUNDS {
            tried = self.attempt(tried.candidate, tried.amplitude)?;
        }
        Some(tried)
    }

    /// Judges a law against noise, with the columns of fit and law together.
    fn judged(&self, tried: &Tried, judged: &Judged) -> Option<OtherLaw> {
        let (g, n) = (self.problem.globals(), self.jacobian.ncols());
        let mut columns = DMatrix::zeros(self.jacobian.nrows(), n + 1);
        columns.columns_mut(0, g).copy_from(&self.jacobian.columns(0, g));
        columns.set_column(g, &tried.column);
        columns.columns_mut(g + 1, n - g).copy_from(&self.jacobian.columns(g, n - g));
        // In logs without noise, any law explains a part of the rounding errors.
        let moved = (&tried.column * tried.amplitude).amax();
        if moved < LAW_DUST / FILE_ROUNDING * self.problem.rounding() {
            return None;
        }
        let inverse = inverse_of_square(&columns)?;
        let left = &self.residuals + &tried.column * tried.amplitude;
        let spreads = spreads(self.problem, left.as_slice(), &columns, g + 1, &inverse);
        let unit = |j: usize| DVector::from_fn(g + 1, |k, _| f64::from(u8::from(k == j)));
        let error = half_width(&spreads, &unit(g)) / NORMAL;
        let standard_errors = tried.amplitude.abs() / error;
        if !standard_errors.is_finite() || standard_errors < LAW_SHOWN {
            return None;
        }
        let shift = tried.along.rows(0, g) * -tried.amplitude;
        let off = (0..g).map(|j| shift[j].abs() / judged.covariance.error(j).unwrap_or(f64::INFINITY)).collect();
        // (|d| + h)² ≤ 2 (d² + h²), with the half-width d of an interval and the effect h of noise on both; the true
        // law may have one and a half times the effect of the one tried.
        let square = &shift * shift.transpose();
        let added = &square * (3.0 / (NORMAL * NORMAL)) + square * (error / tried.amplitude).powi(2);
        let Candidate { body, kind, .. } = tried.candidate;
        let gain = self.gained(tried)?;
        let explained = gain / self.residuals.norm_squared();
        let words = tried.candidate.words(tried.amplitude);
        Some(OtherLaw { key: kind.key(), body: body.key(), words, explained, standard_errors, gain, off, added })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, TEMPLATE};
    use crate::fit::asked::problem::tests::case;
    use crate::fit::search::starts::tests::at_start;
    use crate::signal::Signal;

    const DRIFT: Candidate = Candidate { body: Body::Cart, kind: AlternativeLaw::Drift, coulomb: 0.2 };

    /// Friction that drifts rises along a log, one that sways rises first, and one with sides is larger forward.
    #[test]
    fn a_positive_amplitude_is_more_friction_late_early_or_forward() {
        let machine = Case::from_text("axis.toml", TEMPLATE).unwrap().machine;
        let coulomb = |kind: AlternativeLaw, share: f64| {
            let mut machine = machine.clone();
            Candidate { body: Body::Cart, kind, coulomb: 1.0 }.put(&mut machine, 0.1, share);
            let friction = &machine.cart.friction;
            [friction.forward.coulomb, friction.backward.coulomb]
        };
        let own = machine.cart.friction.forward.coulomb;
        assert!(own > 0.0);
        let is = |found: [f64; 2], known: [f64; 2]| found.iter().zip(known).all(|(a, b)| (a - b).abs() < 1e-12);
        for (share, factor) in [(0.0, 0.9), (0.5, 1.0), (1.0, 1.1)] {
            assert!(is(coulomb(AlternativeLaw::Drift, share), [factor * own; 2]), "{share}");
        }
        for (share, factor) in [(0.0, 1.0), (0.25, 1.1), (0.75, 0.9)] {
            assert!(is(coulomb(AlternativeLaw::Sway, share), [factor * own; 2]), "{share}");
        }
        assert!(is(coulomb(AlternativeLaw::Sided, 0.3), [own + 0.1, own - 0.1]));
    }

    /// The end of a fit to a log whose input is sampled.
    fn sampled() -> Searched<'static> {
        let (mut case, plan) = case(false);
        let log = case.experiments[0].log.clone().unwrap();
        let (times, values) = (log.time.clone(), log.inputs[0].clone());
        case.experiments[0].inputs[0] = Signal::Sampled { times, values, hold: log.hold };
        at_start(Problem::new(&case, &plan).unwrap())
    }

    /// Friction that drifts with every sample of the log moves the cart as that of ten segments.
    #[test]
    fn friction_that_drifts_in_segments_moves_a_cart_as_one_that_drifts_with_time() {
        let found = sampled();
        let (place, run) = (EndOfFit::new(&found).unwrap(), &found.problem.runs[0]);
        let stage = |k: usize| {
            let mut machine = found.problem.machine.clone();
            DRIFT.put(&mut machine, 0.5, (k as f64 + 0.5) / 50.0);
            machine
        };
        let stages: Vec<Machine> = (0..50).map(stage).collect();
        let mut known = place.residuals.clone();
        assert!(drifting::residuals(run, &stages, &found.problem.extras_of(0, place.x), known.as_mut_slice()));
        let off = place.with(DRIFT, 0.5, place.x).unwrap() - &known;
        let share = off.norm() / (known.clone() - &place.residuals).norm();
        assert!(share < 0.01, "{share}");
    }

    /// Friction that rises threefold along a log moves a cart out of proportion to its amplitude.
    #[test]
    fn the_amplitude_of_a_law_is_found_though_its_effect_bends() {
        let mut found = sampled();
        let moved = EndOfFit::new(&found).unwrap().with(DRIFT, 0.5, &found.best.x).unwrap();
        let run = &mut found.problem.runs[0];
        for (seen, moved) in run.seen.iter_mut().zip(moved.as_slice().chunks(run.time.len())) {
            for ((value, weight), moved) in seen.values.iter_mut().zip(&seen.weights).zip(moved) {
                *value += moved / weight;
            }
        }
        let found = at_start(found.problem);
        let place = EndOfFit::new(&found).unwrap();
        let first = place.attempt(DRIFT, DRIFT.first()).unwrap();
        let own = first.amplitude;
        let amplitude = place.again(first).unwrap().amplitude;
        assert!((own - 0.5).abs() > 0.05 && (amplitude - 0.5).abs() < 0.01, "{own} {amplitude}");
    }
}
