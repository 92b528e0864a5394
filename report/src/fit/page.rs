//! The report: one HTML file.

use super::{FitResults, plots, posterior, rows as told, value};
use crate::{Callout, Cell, Page, Table};
use taut::case::Case;
use taut::fit::{Fit, Grade, LogFit, Profile, ResidualForce, Score, residual_force};
use taut::log::Quantity;

/// The page; `text` is the case with the estimates.
pub fn page(case: &Case, found: &FitResults, text: &str) -> Page {
    page_with(case, found, text, |_| {})
}

/// The page of a fit with a part before it.
pub fn page_with(case: &Case, found: &FitResults, text: &str, first: impl FnOnce(&mut Page)) -> Page {
    let fit = &found.fit;
    let mut page = Page::new(case.title.clone()).subtitle("Parameters from logs.");
    first(&mut page);
    page.section("How it ended");
    let kind = if fit.is_converged() { Callout::Holds } else { Callout::Fails };
    page.callout(kind, fit.ending_word().replace('_', " "), format!("{}.", told::ending(fit)));
    for told in told::findings(fit.findings.iter()) {
        let (grade, text) = told.split_once(": ").unwrap_or(("note", &told));
        let kind = if grade == Grade::Warning.word() { Callout::Fails } else { Callout::Note };
        page.callout(kind, grade, text.to_string());
    }
    page.prose(format!(
        "{} values, {} variables, {} steps, {} simulated logs{}.",
        fit.values,
        fit.variables,
        fit.work.iterations,
        fit.work.simulations,
        told::past_kinks(fit)
    ));
    parameters(&mut page, fit);
    correlations(&mut page, fit);
    profiles(&mut page, &found.profiles);
    if let Some(drawn) = &found.drawn {
        posterior::section(&mut page, fit, drawn);
    }
    logs(&mut page, fit);
    if fit.logs.len() > plots::MOST_LOGS {
        for overlay in plots::together(fit) {
            page.figure(&overlay);
        }
        page.prose(format!(
            "The {} logs that the model meets worst, by RMSE over the deviation of their residuals, the worst first; the others are in the tables \
             above.",
            plots::MOST_LOGS
        ));
    }
    let few = fit.logs.len() <= plots::MOST_LOGS;
    for log in plots::worst(&fit.logs, &fit.noise) {
        for output in &log.outputs {
            page.figure(&plots::overlay(log, output, &fit.noise));
            // Of many logs, that of the worst.
            if let Some(figure) = plots::memory(log, output).filter(|_| few) {
                page.figure(&figure);
            }
        }
    }
    residual(&mut page, fit);
    page.section("The case with the estimates");
    page.embed("fitted.toml", text);
    page.version();
    page
}

fn parameters(page: &mut Page, fit: &Fit) {
    page.section("Parameters");
    let mut rows = Table::new("Estimates with standard errors and 95 % intervals.");
    for heading in ["Parameter", "Estimate", "Standard error", "Interval", "Start"] {
        rows = rows.column(heading, "");
    }
    for estimate in &fit.estimates {
        let [value, error, interval] = told::words(estimate);
        let start = value::value(estimate.start, estimate.unit, 5);
        rows.row([estimate.name.clone(), value, error, interval, start].map(Cell::from));
    }
    page.table(&rows);
    if let Some(belts) = fit.belts() {
        page.prose(format!("Belts: {}.", belts.words()));
    }
}

fn profiles(page: &mut Page, profiles: &[Profile]) {
    if profiles.is_empty() {
        return;
    }
    page.subsection("Profiles");
    page.prose(match told::crooked(profiles) {
        names if names.is_empty() => "Each parameter held off its estimate and all others fitted anew: the cost grows as the intervals say, to both sides.".to_string(),
        names => format!(
            "Each parameter held off its estimate and all others fitted anew. Not as a linear model has it: {}; `--posterior` makes intervals that do not need that.",
            names.join(", ")
        ),
    });
    for profile in profiles {
        page.figure(&plots::profile(profile));
    }
}

fn correlations(page: &mut Page, fit: &Fit) {
    if fit.estimates.len() < 2 {
        return;
    }
    page.subsection("Correlations");
    page.prose("Near 1 or −1 the logs tell one combination of the two far better than each.");
    let mut rows = Table::new("").column("", "");
    for estimate in &fit.estimates {
        rows = rows.column(&estimate.name, "");
    }
    for (estimate, row) in fit.estimates.iter().zip(&fit.correlation) {
        let cells = row.iter().map(|value| match value.is_finite() {
            true => Cell::from(format!("{value:.2}").replace('-', "−")),
            false => Cell::from("–"),
        });
        rows.row(std::iter::once(Cell::from(estimate.name.clone())).chain(cells));
    }
    page.table(&rows);
}

fn logs(page: &mut Page, fit: &Fit) {
    page.section("Logs");
    let mut quantities: Vec<Quantity> = Vec::new();
    for output in fit.logs.iter().flat_map(|log| &log.outputs) {
        if !quantities.contains(&output.quantity) {
            quantities.push(output.quantity);
        }
    }
    for quantity in quantities {
        table_of(page, fit, quantity);
        if let Some(figure) = plots::by_log(&fit.logs, quantity) {
            page.figure(&figure);
        }
    }
}

/// How each log is met in one quantity, the worst first, in one unit.
fn table_of(page: &mut Page, fit: &Fit, quantity: Quantity) {
    let mut scores: Vec<(usize, &LogFit, &str, Score)> = Vec::new();
    for (k, log) in fit.logs.iter().enumerate() {
        for output in log.outputs.iter().filter(|output| output.quantity == quantity) {
            let both = [("fitted", output.fitted), ("held out", output.held_out)];
            scores.extend(both.into_iter().filter_map(|(word, score)| Some((k, log, word, score?))));
        }
    }
    let many = scores.len() > 2;
    if many {
        scores.sort_by(|a, b| b.3.rmse.total_cmp(&a.3.rmse));
    }
    let (unit, factor) = told::unit_for(scores.iter().map(|(.., score)| score.rmse), quantity.unit());
    let name = quantity.name().replace('_', " ");
    let order = if many { ", the worst first; numbers are those of the picture below" } else { "" };
    let mut rows = Table::new(format!("How each log is met in its {name}{order}."))
        .column("Log", "")
        .column("", "")
        .column("", "")
        .column("Rows", "")
        .column("RMSE", &unit)
        .column("Largest", &unit)
        .column("Fit", "%")
        .column("Neighbours' correlation", "");
    for (k, log, word, score) in scores {
        let number = |value: f64, decimals: usize| Cell::Number(format!("{value:.decimals$}"));
        rows.row([
            Cell::Number((k + 1).to_string()),
            Cell::Text(told::name(log)),
            Cell::Text(word.into()),
            Cell::Number(score.count.to_string()),
            number(factor * score.rmse, 3),
            number(factor * score.worst, 3),
            number(score.percent, 2),
            number(score.memory, 3),
        ]);
    }
    page.table(&rows);
    let experiments = told::by_experiment(fit).into_iter().filter(|one| one.quantity == quantity);
    let experiments: Vec<_> = experiments.collect();
    if !experiments.is_empty() {
        let mut rows = Table::new("By experiment.")
            .column("Experiment", "")
            .column("", "")
            .column("Logs", "")
            .column("RMSE", &unit);
        for one in experiments {
            let word = if one.held_out { "held out" } else { "fitted" };
            let rmse = Cell::Number(format!("{:.3}", factor * one.rmse));
            rows.row([Cell::Text(one.name.clone()), word.into(), Cell::Number(one.logs.to_string()), rmse]);
        }
        page.table(&rows);
    }
}

/// The force that the model lacks.
fn residual(page: &mut Page, fit: &Fit) {
    let mut all = ResidualForce::default();
    for log in &fit.logs {
        if let Some(own) = residual_force(&fit.machine, log) {
            all.join(&own);
        }
    }
    if all.force.len() < 100 {
        return;
    }
    page.section("What the model lacks, as a force");
    for figure in plots::residual_forces(&all) {
        page.figure(&figure);
    }
    let worst = plots::worst(&fit.logs, &fit.noise).into_iter();
    if let Some((log, own)) = worst.filter_map(|log| Some((log, residual_force(&fit.machine, log)?))).next() {
        page.figure(&plots::residual_over_time(log, &own));
    }
}
