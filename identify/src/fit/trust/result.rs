//! Result at a minimum: estimates with their intervals, and the agreement with each log.

use super::found::{Estimate, Fit};
use super::held_out::{Known, met};
use super::scores::compared;
use super::uncertainty::Judged;
use crate::fit::asked::run::Nuisance;
use crate::fit::noise::student::student;
use crate::fit::search::starts::Searched;
use crate::fit::search::triangle::inverse_of_square;
use nalgebra::DVector;

/// The complete result at a minimum.
pub(crate) fn result(found: &Searched, judged: Option<&Judged>) -> Fit {
    let Searched { problem, best, noise, starts, work, .. } = found;
    let bounds = problem.bounds();
    let covariance = judged.map(|judged| &judged.covariance);
    let identifiability = judged.map(|judged| judged.identifiability.clone());
    let t = covariance.map_or(student(1), |c| c.reach);
    let determined = |j: usize| identifiability.as_ref().is_some_and(|found| found.error[j].is_finite());
    let error = |j: usize| match covariance {
        Some(covariance) if j >= problem.globals() || determined(j) => covariance.error(j),
        _ if best.at_bound[j] => None,
        _ => Some(f64::INFINITY),
    };
    // All variables without their bounds, if one is at its bound.
    let beyond = if best.at_bound.contains(&true) {
        let free = vec![false; best.at_bound.len()];
        let free = Judged::new(problem, &best.residuals, &best.jacobian, &best.x, &free);
        // d = −(JᵀJ)⁻¹ Jᵀ r
        let step = inverse_of_square(&best.jacobian)
            .map(|inverse| -inverse * best.jacobian.tr_mul(&DVector::from_column_slice(&best.residuals)));
        free.zip(step)
    } else {
        None
    };
    let mut estimates = Vec::new();
    for (j, parameter) in problem.parameters.iter().enumerate() {
        let (x, value) = (best.x[j], problem.value(j, best.x[j]));
        let error = if best.at_bound[j] { None } else { error(j) };
        let end = |x: f64| problem.value(j, x).clamp(parameter.low, parameter.high);
        let interval = match error {
            Some(e) if e.is_finite() => Some([end(x - t * e), end(x + t * e)]),
            Some(_) => Some([f64::NEG_INFINITY, f64::INFINITY]),
            // Its value without the bound, but at most a standard error away.
            None => beyond.as_ref().filter(|(judged, _)| judged.identifiability.error[j].is_finite()).map(
                |(judged, step)| {
                    let e = judged.covariance.error(j).unwrap_or(f64::INFINITY);
                    let x = x + step[j].clamp(-e, e);
                    [end(x - t * e), end(x + t * e)]
                },
            ),
        };
        estimates.push(Estimate {
            name: parameter.name.clone(),
            unit: parameter.unit,
            start: parameter.start,
            value,
            error: error.map(|e| e * problem.slope(j, value)),
            interval,
            bounds: [parameter.low, parameter.high],
            at_bound: best.at_bound[j],
            part: problem.of[j],
            sets: parameter.keys.iter().map(|(key, factor)| (key.clone(), factor * value)).collect(),
        });
    }
    for (i, extra) in problem.shared.iter().enumerate() {
        let j = problem.parameters.len() + i;
        let value = extra.start + extra.unit * best.x[j];
        let error = if best.at_bound[j] { None } else { error(j).map(|e| e * extra.unit) };
        estimates.push(Estimate {
            name: extra.what.name(&problem.machine),
            unit: extra.what.unit(&problem.machine),
            start: extra.start,
            value,
            error,
            interval: error.map(|e| [(value - t * e).max(extra.low), (value + t * e).min(extra.high)]),
            bounds: [extra.low, extra.high],
            at_bound: best.at_bound[j] && bounds.low[j] < bounds.high[j],
            part: None,
            sets: Vec::new(),
        });
    }
    let n = problem.globals();
    let correlation = (0..n)
        .map(|i| (0..n).map(|j| covariance.and_then(|c| c.correlation(i, j)).unwrap_or(f64::NAN)).collect())
        .collect();
    let stages = problem.stages(&best.x);
    let mut logs = Vec::new();
    for (index, run) in problem.runs.iter().enumerate() {
        let extras = problem.extras_of(index, &best.x);
        let mut told = Vec::new();
        let own = problem.own_variables(index);
        for (extra, &value) in run.extras.iter().zip(&extras) {
            let j = own.iter().find(|(_, other)| other.what == extra.what).map(|(j, _)| *j);
            // Prior knowledge is not a result.
            if let (Some(j), None) = (j, extra.known) {
                told.push((extra.what, value, error(j).map(|e| e * extra.unit)));
            }
        }
        logs.push(compared(run, &stages[run.part], &extras, told));
    }
    let known = known(found);
    logs.extend(problem.held_out.iter().map(|run| met(run, &stages[run.part], &known, 1.0)));
    Fit {
        parts: problem.parts.iter().cloned().zip(stages.iter().cloned()).collect(),
        machine: stages[0].clone(),
        estimates,
        correlation,
        noise: noise.clone(),
        logs,
        choices: identifiability
            .iter()
            .flat_map(|found| found.groups.iter().map(|group| found.choices(problem, group)))
            .collect(),
        identifiability,
        disagreement: judged.and_then(|judged| judged.disagreement.clone()),
        other_law: judged.and_then(|judged| judged.other_law.clone()),
        cause: judged.and_then(|judged| judged.cause.clone()),
        waves: judged.iter().flat_map(|judged| &judged.spreads).flat_map(|spread| spread.waves.clone()).collect(),
        oscillations: judged.map_or(Vec::new(), |judged| judged.oscillations(problem)),
        times_noise: 0.0,
        findings: Vec::new(),
        point: best.x.clone(),
        ending: best.ending,
        strategy: best.strategy,
        decrement: best.decrement,
        cost: best.cost,
        starts: starts.clone(),
        pieces: best.pieces,
        evolved: best.evolved,
        values: problem.counted(),
        variables: problem.variables(),
        work: *work,
    }
}

/// Results of the fitted logs other than parameters, for held-out logs.
pub(crate) fn known<'a>(found: &'a Searched) -> Known<'a> {
    let Searched { problem, best, noise, .. } = found;
    let mut sums: Vec<(Nuisance, f64, usize)> = Vec::new();
    for (index, run) in problem.runs.iter().enumerate() {
        for (extra, value) in run.extras.iter().zip(problem.extras_of(index, &best.x)) {
            match sums.iter_mut().find(|(what, ..)| *what == extra.what) {
                Some((_, sum, count)) => (*sum, *count) = (*sum + value, *count + 1),
                None => sums.push((extra.what, value, 1)),
            }
        }
    }
    Known {
        noise,
        means: sums.iter().map(|(what, sum, count)| (*what, sum / *count as f64)).collect(),
        shared: problem.shared.iter().copied().zip(problem.shared_values(&best.x)).collect(),
    }
}
