//! A part of a log in which the machine does not follow its input as elsewhere: a motor that is off or limited,
//! something in the way, a sensor that stands still, lost samples.
//!
//! The error of such a part lasts to the end of a run, and estimates absorb some of it. In short windows, each with a
//! start of its own, it does not last, and by Huber's loss the same parameters for all windows are those of the other
//! parts: there the residuals of one part stand far above those of all others, whereas a wrong law of friction or noise
//! leaves some in many windows.

use super::finding::{Finding, Grade};
use super::sub_records::in_windows;
use crate::case::{Case, Plan};
use crate::fit::asked::run::FittedLog;
use crate::fit::asked::straight::has_exact_derivatives;
use crate::fit::limits::{
    HUBER, INTERRUPTED, INTERRUPTED_SHARE, INTERRUPTED_WINDOWS, LEAST_INTERRUPTED, UNEXPLAINED_NOISE, UNINTERRUPTED,
    WINDOW_SAMPLES,
};
use crate::fit::search::starts::Searched;
use crate::number::{engineering_typed, significant};

/// A warning for each log with such a part.
pub(super) fn interruptions(case: &Case, plan: &Plan, found: &Searched) -> Vec<Finding> {
    // Parts with parameters of their own have machines of their own.
    let skipped = plan.windows.is_some() || plan.closed_loop || plan.until.is_some() || !plan.separate.is_empty();
    if skipped || found.problem.is_stopped() || !has_exact_derivatives(&case.machine) {
        return Vec::new();
    }
    // A model that explains the logs to their noise has no such part.
    if found.times_noise().all(|(_, times)| times <= UNEXPLAINED_NOISE) {
        return Vec::new();
    }
    by_windows(case, plan, found, window(&found.problem.runs)).unwrap_or_default()
}

/// Length of the windows, s.
fn window(runs: &[FittedLog]) -> f64 {
    let total: f64 = runs.iter().map(FittedLog::length).sum();
    let samples = runs.iter().map(|run| run.time.len()).sum::<usize>() as f64;
    let longest = runs.iter().map(FittedLog::length).fold(0.0, f64::max);
    (longest / INTERRUPTED_WINDOWS).max(WINDOW_SAMPLES * total / samples)
}

/// Residuals in windows of this length, s, and what stands out.
fn by_windows(case: &Case, plan: &Plan, found: &Searched, window: f64) -> Option<Vec<Finding>> {
    let noise = found.problem.noise();
    let noise: Vec<_> =
        found.problem.quantities().into_iter().map(|quantity| (quantity, noise.deviation(quantity))).collect();
    let (problem, best) = in_windows(case, plan, found, window, (&noise, HUBER))?;
    // Root mean square of each window's residuals, log by log.
    let mut logs: Vec<(&str, Vec<(f64, f64)>)> = Vec::new();
    let mut from = 0.0;
    for (index, run) in problem.runs.iter().enumerate() {
        let (first, rows) = (problem.first_row(index), run.rows());
        let squares: f64 = best.residuals[first..first + rows].iter().map(|r| r * r).sum();
        let size = (squares / rows.max(1) as f64).sqrt();
        match logs.last_mut().filter(|(name, _)| run.window > 0 && *name == run.name) {
            Some((_, windows)) => windows.push((from, size)),
            None => {
                from = 0.0;
                logs.push((&run.name, vec![(from, size)]));
            }
        }
        from += run.length();
    }
    Some(logs.iter().filter_map(|(name, windows)| interruption(name, windows, window)).collect())
}

/// Of a log with these windows: their beginnings, s, and the sizes of their residuals.
fn interruption(name: &str, windows: &[(f64, f64)], length: f64) -> Option<Finding> {
    let mut sizes: Vec<f64> = windows.iter().map(|(_, size)| *size).collect();
    sizes.sort_by(f64::total_cmp);
    let usual = sizes[sizes.len() / 2].max(LEAST_INTERRUPTED);
    let is_off = |(_, size): &(f64, f64)| *size > INTERRUPTED * usual;
    let (first, last) = (windows.iter().position(is_off)?, windows.iter().rposition(is_off)?);
    let most = (INTERRUPTED_SHARE * windows.len() as f64).max(2.0) as usize;
    let part = &windows[first..=last];
    let others = windows[..first].iter().chain(&windows[last + 1..]);
    if part.len() > most || others.clone().any(|(_, size)| *size > UNINTERRUPTED * usual) {
        return None;
    }
    let largest = part.iter().map(|(_, size)| *size).fold(0.0, f64::max);
    let at = |time: f64| engineering_typed(time, "s", 3);
    let text = format!(
        "from {} to {} the outputs differ from the model {} times as much as elsewhere, the start of that part being \
         fitted: the machine does not follow its input there (a motor that is off or limited, something in the way, a \
         sensor that stands still, lost samples); leave that part out, with `from` and `to` in two experiments",
        at(part[0].0),
        at(windows.get(last + 1).map_or(windows[last].0 + length, |(time, _)| *time)),
        significant(largest / usual, 2)
    );
    Some(Finding { grade: Grade::Warning, code: "interruption", log: Some(name.to_string()), text })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::problem::Problem;
    use crate::fit::asked::problem::tests::case;

    /// Short windows show short parts, but too few samples fit any start.
    #[test]
    fn a_long_log_has_24_windows_and_a_short_one_windows_of_100_samples() {
        let (case, plan) = case(false);
        let mut runs = Problem::new(&case, &plan).unwrap().runs;
        let mut count = |samples: u32| {
            runs[0].time = (0..samples).map(|k| 1e-3 * f64::from(k)).collect();
            (runs[0].length() / window(&runs)).round()
        };
        assert_eq!([20_000, 4800, 1200, 300].map(&mut count), [24.0, 24.0, 12.0, 3.0]);
    }

    #[test]
    fn a_part_that_is_off_is_an_interruption_up_to_a_quarter_of_the_log() {
        let told = |off: u32| {
            let windows: Vec<_> = (0..24).map(|k| (f64::from(k), if k < off { 50.0 } else { 2.0 })).collect();
            interruption("a", &windows, 1.0).map(|finding| finding.text)
        };
        assert!(told(6).is_some_and(|text| text.contains("from 0 s to 6 s")), "{:?}", told(6));
        assert!(told(0).is_none() && told(7).is_none(), "{:?}", told(7));
    }
}
