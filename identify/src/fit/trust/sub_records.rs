//! Tests whether parts of the logs agree with the whole, beyond noise.
//!
//! Drifting friction, or friction of another law, leaves residuals that the parameters partly absorb: the estimates
//! minimise the integrated error, and noise does not show their distance from the truth. The logs are therefore cut
//! into windows, each but the first of a log with a start of its own, in which errors cannot accumulate, and the same
//! parameters are fitted to all of them. With ĝ_c = J_cᵀ r_c of window c and A = (JᵀJ)⁻¹ the windows disagree by
//!
//! ```text
//! V = A (Σ_c ĝ_c ĝ_cᵀ) A G/(G−1)           (K.-Y. Liang and S. L. Zeger 1986)
//! ```
//!
//! and with the whole logs by d. If either is significant, intervals are widened by both.

use super::doubts::Disagreement;
use super::uncertainty::Judged;
use crate::case::{Case, Plan};
use crate::fit::asked::problem::Problem;
use crate::fit::asked::run::FittedLog;
use crate::fit::limits::{FEWEST_WINDOWS, REFIT_TOLERANCE, WINDOW_SAMPLES, WINDOWS_OFF};
use crate::fit::noise::student::student;
use crate::fit::search::least_squares::minimise;
use crate::fit::search::point::{Ending, Minimum, Options};
use crate::fit::search::starts::Searched;
use crate::fit::search::triangle::inverse_of_square;
use crate::log::Quantity;
use crate::solve::Flow;
use nalgebra::{DMatrix, DVector};

/// Compares windows with the whole; `None` if they agree within noise, or contain too little information.
pub(crate) fn disagreement(case: &Case, plan: &Plan, found: &Searched, judged: &Judged) -> Option<Disagreement> {
    let whole = &found.problem;
    let g = whole.globals();
    let skipped = plan.windows.is_some() || plan.closed_loop || plan.until.is_some() || !judged.is_coloured();
    // A window without a turn contains no information on the play of a sensor.
    let skipped = skipped || plan.nuisance.sensor_play.is_some();
    if skipped || whole.is_stopped() || !judged.identifiability.complete() || found.best.at_bound[..g].contains(&true) {
        return None;
    }
    let lengths = whole.runs.iter().map(FittedLog::length);
    let total: f64 = lengths.clone().sum();
    let shortest = lengths.fold(f64::INFINITY, f64::min);
    let samples = whole.runs.iter().map(|run| run.time.len()).sum::<usize>() as f64;
    let length = (total / FEWEST_WINDOWS).min(0.5 * shortest).max(WINDOW_SAMPLES * total / samples);
    let (problem, best) = in_windows(case, plan, found, length, (&found.noise, f64::INFINITY))?;
    if best.at_bound[..g].contains(&true) {
        return None;
    }
    // Windows with starts of their own fit at least as well as the whole; otherwise the search has not converged.
    if best.cost > found.best.cost {
        return None;
    }
    let noise = Judged::new(&problem, &best.residuals, &best.jacobian, &best.x, &best.at_bound)?;
    // A window in which the cart rests contains no information on its initial speed.
    let shows = |j: usize| best.jacobian.column(j).iter().any(|v| *v != 0.0);
    let free: Vec<usize> = (0..best.x.len()).filter(|&j| !best.at_bound[j] && (j < g || shows(j))).collect();
    let inverse = inverse_of_square(&best.jacobian.select_columns(&free))?;
    let inverse = inverse.view((0, 0), (g, g)).into_owned();
    let mut squares = DMatrix::zeros(g, g);
    let mut windows = 0;
    for (index, run) in problem.runs.iter().enumerate() {
        let (first, rows) = (problem.first_row(index), run.rows());
        let own = best.jacobian.view((first, 0), (rows, g));
        let residuals = DVector::from_column_slice(&best.residuals[first..first + rows]);
        let gradient = own.tr_mul(&residuals);
        windows += usize::from(gradient.norm() > 0.0);
        squares += &gradient * gradient.transpose();
    }
    if windows < 3 {
        return None;
    }
    let clusters = windows as f64;
    let between = &inverse * squares * &inverse * (clusters / (clusters - 1.0));
    let shift = DVector::from_fn(g, |j, _| best.x[j] - found.best.x[j]);
    // The variance between G windows has a relative standard error of √(2/(G − 1)).
    let most = 1.0 + WINDOWS_OFF * (2.0 / (clusters - 1.0)).sqrt();
    let off: Vec<f64> = (0..g)
        .map(|j| {
            let error = noise.covariance.error(j).unwrap_or(f64::INFINITY);
            f64::max(shift[j].abs() / error, WINDOWS_OFF * (between[(j, j)].sqrt() / error / most))
        })
        .collect();
    if !off.iter().all(|off| off.is_finite()) || off.iter().all(|off| *off < WINDOWS_OFF) {
        return None;
    }
    let wider = (student(windows - 1) / student(1_000_000)).powi(2);
    // (|d| + h)² ≤ 2 (d² + h²), with the half-width d of an interval; windows are still long enough for one and a half
    // times that.
    let added = (&shift * shift.transpose() / student(1_000_000).powi(2) + between * wider) * 3.0;
    Some(Disagreement { windows, length, off, added })
}

/// The search continued from the end of another one, in windows of this length, s, each with a start of its own: with
/// these deviations of the quantities, and this threshold of Huber's loss. `None` if it fails.
pub(super) fn in_windows<'a>(
    case: &Case,
    plan: &Plan,
    found: &Searched<'a>,
    length: f64,
    (noise, huber): (&[(Quantity, f64)], f64),
) -> Option<(Problem<'a>, Minimum)> {
    let mut problem = Problem::new(case, &Plan { windows: Some(length), ..plan.clone() }).ok()?;
    problem.swings = found.problem.swings;
    problem.weigh_by(noise);
    let (mut start, bounds, g) = (problem.start(), problem.bounds(), found.problem.globals());
    start[..g].copy_from_slice(&found.best.x[..g]);
    let rounding = problem.rounding();
    let options = Options { iterations: 30, tolerance: REFIT_TOLERANCE, huber, rounding, ..Options::default() };
    let best = minimise(&mut problem, &start, &bounds, &options, &mut |_, _| Flow::Continue);
    (!matches!(best.ending, Ending::Failed | Ending::Interrupted)).then_some((problem, best))
}
