//! Draws from the posterior: made with progress, and told on the terminal and in the report.

use super::{figures, table};
use crate::args::Fit as Args;
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::terminal::bold;
use std::fmt::Write;
use taut::Result;
use taut::case::{Case, Plan};
use taut::fit::{Credible, Fit, Posterior, posterior};
use taut::nuts::Effort;
use taut_report::{Callout, Cell, Page, Table};

/// Draws that tune a chain.
const TUNE: usize = 400;

/// Histograms drawn.
const MOST_FIGURES: usize = 12;

/// Draws; Ctrl-C keeps those there are.
pub fn draw(args: &Args, case: &Case, plan: &Plan, fit: &Fit, interrupt: &Interrupt) -> Result<Posterior> {
    let effort = Effort { chains: args.chains, draws: args.draws, tune: TUNE, seed: plan.seed };
    let all = (effort.chains * (effort.tune + effort.draws)) as u64;
    let progress = Progress::new("draws; Ctrl-C keeps those there are", Some(all), args.common.quiet);
    let watch = |made: usize| {
        progress.set(made as u64);
        interrupt.signal().is_none()
    };
    posterior(case, plan, fit, effort, &watch)
}

/// How it ended, in a sentence.
pub fn ending(drawn: &Posterior) -> String {
    let doubts = drawn.doubts();
    if doubts.is_empty() { "converged".into() } else { format!("not converged: {}", doubts.join("; ")) }
}

/// What it was drawn with, in a sentence.
fn effort(drawn: &Posterior) -> String {
    let slopes = if drawn.fixed_slopes { "slopes of the fit" } else { "slopes measured at each place" };
    let memory = match drawn.inflation {
        factor if factor > 1.0 + 1e-3 => {
            format!("; residuals are autocorrelated, so the logarithm of the likelihood is divided by {factor:.2}")
        }
        _ => String::new(),
    };
    format!(
        "{} draws of {} chains, {} divergences, {} evaluations with {slopes}{memory}",
        drawn.count(),
        drawn.draws.chains.len(),
        drawn.draws.divergences,
        drawn.draws.evaluations,
    )
}

/// Both intervals of each estimate, what stands beside the linear one, and its diagnostics.
fn words(fit: Option<&Fit>, j: usize, variable: &Credible) -> [String; 5] {
    let shown = |[low, high]: [f64; 2]| {
        format!("{} to {}", table::value(low, variable.unit, 4), table::value(high, variable.unit, 4))
    };
    let linear = fit.and_then(|fit| fit.estimates.get(j)?.interval);
    [
        table::value(variable.median, variable.unit, 5),
        shown(variable.interval),
        linear.map_or_else(|| "–".to_string(), shown),
        format!("{:.3}", variable.r_hat),
        format!("{:.0}", variable.effective),
    ]
}

/// The lines on the terminal.
pub fn text(drawn: &Posterior, wide: usize) -> String {
    let mut text = format!("\n{}: {}\n", bold("Posterior"), ending(drawn));
    for (j, variable) in drawn.variables.iter().take(drawn.globals).enumerate() {
        let [median, interval, _, r_hat, effective] = words(None, j, variable);
        let _ = writeln!(
            text,
            "  {:<wide$}  {median:>14}   95 %: {interval}; R\u{302} {r_hat}, {effective} effective",
            variable.name
        );
    }
    let _ = writeln!(text, "  {}", effort(drawn));
    text
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
        if let Some(figure) = figures::histogram(drawn, j, fit.estimates.get(j)) {
            page.figure(&figure);
        }
    }
}
