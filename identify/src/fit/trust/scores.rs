//! Comparison of model and log.

use super::uncertainty;
use crate::case::Experiment;
use crate::fit::asked::run::{FittedLog, LogOptions, Nuisance};
use crate::log::Quantity;
use crate::machine::Machine;
use crate::solve::Bench;

/// Agreement with a log.
#[derive(Debug, Clone)]
pub struct LogFit {
    /// The experiment.
    pub name: String,
    /// Index of its window.
    pub window: usize,
    /// True if none of it was fitted.
    pub held_out: bool,
    /// Times, s.
    pub time: Vec<f64>,
    /// The input of each drive as logged.
    pub inputs: Vec<Vec<f64>>,
    /// First row that was not fitted.
    pub fitted_rows: usize,
    /// Each output.
    pub outputs: Vec<OutputFit>,
    /// The nuisances: name, value, standard error.
    pub extras: Vec<(Nuisance, f64, Option<f64>)>,
    /// True if the model reached the end of it.
    pub complete: bool,
}

/// Agreement with an output.
#[derive(Debug, Clone)]
pub struct OutputFit {
    /// The quantity.
    pub quantity: Quantity,
    /// The measured values.
    pub seen: Vec<f64>,
    /// The model's values.
    pub model: Vec<f64>,
    /// Score over the fitted rows.
    pub fitted: Option<Score>,
    /// Score over the held-out rows.
    pub held_out: Option<Score>,
}

/// Deviation of model and log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Number of compared values.
    pub count: usize,
    /// Root mean square of the residuals.
    pub rmse: f64,
    /// Largest residual.
    pub worst: f64,
    /// 100 (1 − ‖y − ŷ‖/‖y − ȳ‖)
    pub percent: f64,
    /// Correlation of neighbouring residuals.
    pub memory: f64,
}

/// A run compared with the log of its experiment without a fit: it starts as the experiment does, and sensors have no
/// offset. None if the experiment has no log.
pub fn beside_log(machine: &Machine, experiment: &Experiment) -> Option<LogFit> {
    let log = experiment.log.as_ref()?;
    let run = FittedLog::all(experiment, log, &LogOptions::default()).pop()?;
    Some(compared(&run, machine, &[], Vec::new()))
}

/// Compares model and log.
pub(crate) fn compared(
    run: &FittedLog,
    machine: &Machine,
    extras: &[f64],
    told: Vec<(Nuisance, f64, Option<f64>)>,
) -> LogFit {
    let quantities: Vec<Quantity> = run.seen.iter().map(|seen| seen.quantity).collect();
    let mut columns = vec![Vec::new(); quantities.len()];
    let complete = run.predict(&mut Bench::default(), machine, extras, &quantities, &mut columns);
    let n = run.time.len();
    let outputs = run
        .seen
        .iter()
        .zip(columns)
        .enumerate()
        .map(|(i, (seen, column))| {
            let mut model = run.read(i, &column, extras);
            model.resize(n, f64::NAN);
            OutputFit {
                quantity: seen.quantity,
                fitted: score(&seen.values, &model, 0..run.fitted_rows.min(n)),
                held_out: score(&seen.values, &model, run.fitted_rows.min(n)..n),
                seen: seen.values.clone(),
                model,
            }
        })
        .collect();
    LogFit {
        name: run.name.clone(),
        window: run.window,
        held_out: run.held_out,
        time: run.time.clone(),
        inputs: run.logged.clone(),
        fitted_rows: run.fitted_rows,
        outputs,
        extras: told,
        complete,
    }
}

fn score(seen: &[f64], model: &[f64], rows: std::ops::Range<usize>) -> Option<Score> {
    let rows: Vec<usize> = rows.filter(|&k| seen[k].is_finite() && model[k].is_finite()).collect();
    if rows.is_empty() {
        return None;
    }
    let n = rows.len() as f64;
    let residuals: Vec<f64> = rows.iter().map(|&k| model[k] - seen[k]).collect();
    let squares: f64 = residuals.iter().map(|r| r * r).sum();
    let mean = rows.iter().map(|&k| seen[k]).sum::<f64>() / n;
    let spread: f64 = rows.iter().map(|&k| (seen[k] - mean).powi(2)).sum();
    let places: Vec<usize> = (0..residuals.len()).collect();
    Some(Score {
        count: rows.len(),
        rmse: (squares / n).sqrt(),
        worst: residuals.iter().fold(0.0, |most: f64, r| most.max(r.abs())),
        percent: 100.0 * (1.0 - (squares / spread.max(f64::MIN_POSITIVE)).sqrt()),
        memory: uncertainty::memory_of(&residuals, &places),
    })
}

/// Agreement with several logs together.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Together {
    /// The name that they share; empty for all logs.
    pub name: String,
    /// Number of logs and windows.
    pub logs: usize,
    /// The measured values.
    pub quantity: Quantity,
    /// True for held-out rows.
    pub held_out: bool,
    /// Number of compared values.
    pub count: usize,
    /// RMS of the residuals; infinite if the model does not reach the end of a log.
    pub rmse: f64,
}

/// Agreement with the logs of each `name`, in the order of their first occurrence.
pub fn together(logs: &[LogFit], name: impl Fn(&LogFit) -> String) -> Vec<Together> {
    let mut all: Vec<Together> = Vec::new();
    for log in logs {
        let name = name(log);
        for output in &log.outputs {
            let of = |score: Option<Score>, held_out| {
                score.map(|score| (score.rmse.powi(2) * score.count as f64, score.count, held_out))
            };
            let mut parts: Vec<_> =
                [of(output.fitted, false), of(output.held_out, true)].into_iter().flatten().collect();
            if !log.complete {
                // Values that the model does not reach count as an infinite error.
                parts = vec![(f64::INFINITY, output.seen.len(), log.held_out)];
            }
            for (squares, count, held_out) in parts {
                let quantity = output.quantity;
                let same = |one: &Together| one.name == name && one.quantity == quantity && one.held_out == held_out;
                let place = all.iter().position(same).unwrap_or_else(|| {
                    all.push(Together { name: name.clone(), logs: 0, quantity, held_out, count: 0, rmse: 0.0 });
                    all.len() - 1
                });
                let one = &mut all[place];
                one.rmse = ((one.rmse.powi(2) * one.count as f64 + squares) / (one.count + count).max(1) as f64).sqrt();
                (one.count, one.logs) = (one.count + count, one.logs + 1);
            }
        }
    }
    all
}

impl LogFit {
    /// Experiment of the log; for a log split into runs, the common part of their names.
    pub fn experiment(&self) -> &str {
        self.name.split_once('/').map_or(&self.name, |(experiment, _)| experiment)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A model that is the mean of a log explains nothing of it, one that deviates by half as much half.
    #[test]
    fn percentages_are_shares_of_the_deviation_from_the_mean() {
        let seen = [1.0, 2.0, f64::NAN, 3.0, 6.0];
        let percent = |share: f64| {
            let model: Vec<f64> = seen.iter().map(|seen| 3.0 + share * (seen - 3.0)).collect();
            let own = score(&seen, &model, 0..5).unwrap();
            assert_eq!(own.count, 4);
            // Σ (y − 3)² = 4 + 1 + 0 + 9
            assert!((own.rmse - (1.0 - share).abs() * (14.0_f64 / 4.0).sqrt()).abs() < 1e-12, "{own:?}");
            assert!((own.worst - 3.0 * (1.0 - share).abs()).abs() < 1e-12, "{own:?}");
            own.percent
        };
        for (share, known) in [(1.0, 100.0), (0.5, 50.0), (0.0, 0.0), (-1.0, -100.0)] {
            assert!((percent(share) - known).abs() < 1e-9, "{share}");
        }
        assert!(score(&[f64::NAN], &[1.0], 0..1).is_none());
    }
}
