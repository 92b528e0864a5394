//! Draws from the posterior, in words and as a section of the report.

use super::plots::histogram;
use super::value::value;
use crate::{Callout, Cell, Page, Table};
use taut::fit::{Credible, Fit, Posterior};

/// Histograms drawn.
const MOST_FIGURES: usize = 12;

/// How it ended, in a sentence.
pub fn ending(drawn: &Posterior) -> String {
    let doubts = drawn.doubts();
    if doubts.is_empty() { "converged".into() } else { format!("not converged: {}", doubts.join("; ")) }
}

/// The effort of the draws, in a sentence.
pub fn effort(drawn: &Posterior) -> String {
    let slopes = if drawn.fixed_slopes { "with slopes of the fit" } else { "of a random walk" };
    let memory = match drawn.inflation {
        factor if factor > 1.0 + 1e-3 => {
            format!("; residuals are autocorrelated, so the logarithm of the likelihood is divided by {factor:.2}")
        }
        _ => String::new(),
    };
    format!(
        "{} draws of {} chains, {} divergences, {} evaluations {slopes}{memory}",
        drawn.count(),
        drawn.draws.chains.len(),
        drawn.draws.divergences,
        drawn.draws.evaluations,
    )
}

/// Both intervals of each estimate, what stands beside the linear one, and its diagnostics.
pub fn words(fit: Option<&Fit>, j: usize, variable: &Credible) -> [String; 5] {
    let shown =
        |[low, high]: [f64; 2]| format!("{} to {}", value(low, variable.unit, 4), value(high, variable.unit, 4));
    let linear = fit.and_then(|fit| fit.estimates.get(j)?.interval);
    [
        value(variable.median, variable.unit, 5),
        shown(variable.interval),
        linear.map_or_else(|| "–".to_string(), shown),
        format!("{:.3}", variable.r_hat),
        format!("{:.0}", variable.effective),
    ]
}

/// The section of the report.
pub fn section(page: &mut Page, fit: &Fit, drawn: &Posterior) {
    page.section("Posterior");
    let doubts = drawn.doubts();
    let (kind, word) =
        if doubts.is_empty() { (Callout::Holds, "converged") } else { (Callout::Fails, "not converged") };
    page.callout(kind, word, format!("{}.", ending(drawn)));
    page.prose(format!("{}.", effort(drawn)));
    let mut rows = Table::new("What the draws say, beside the intervals of the fit.");
    for heading in ["Parameter", "Median", "95 % of the draws", "95 % of the fit", "R\u{302}", "Effective draws"] {
        rows = rows.column(heading, "");
    }
    for (j, variable) in drawn.variables.iter().enumerate() {
        let own = (j < drawn.globals).then_some(fit);
        let cells = words(own, j, variable).map(Cell::from);
        rows.row(std::iter::once(Cell::from(variable.name.clone())).chain(cells));
    }
    page.table(&rows);
    for j in 0..drawn.globals.min(MOST_FIGURES) {
        if let Some(figure) = histogram(drawn, j, fit.estimates.get(j)) {
            page.figure(&figure);
        }
    }
}
