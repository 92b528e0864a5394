//! The report: one HTML file.

use super::{Found, figures, posterior, table};
use taut::case::Case;
use taut::fit::{Fit, Grade, Profile};
use taut_report::{Callout, Cell, Page, Table};

/// The page; `text` is the case with the estimates.
pub fn page(case: &Case, found: &Found, text: &str) -> Page {
    let fit = &found.fit;
    let mut page = Page::new(case.title.clone()).subtitle("Parameters from logs.");
    page.section("How it ended");
    let kind = if fit.is_converged() { Callout::Holds } else { Callout::Fails };
    page.callout(kind, fit.ending_word().replace('_', " "), format!("{}.", table::ending(fit)));
    for finding in &fit.findings {
        let kind = if finding.grade == Grade::Warning { Callout::Fails } else { Callout::Note };
        page.callout(kind, finding.grade.word(), finding.to_string());
    }
    page.prose(format!(
        "{} values, {} variables, {} steps, {} simulated logs.",
        fit.values, fit.variables, fit.work.iterations, fit.work.simulations
    ));
    parameters(&mut page, fit);
    correlations(&mut page, fit);
    profiles(&mut page, &found.profiles);
    if let Some(drawn) = &found.drawn {
        posterior::section(&mut page, fit, drawn);
    }
    logs(&mut page, fit);
    if fit.logs.len() > figures::MOST_LOGS {
        page.prose(format!(
            "The {} logs that the model meets worst, by RMSE over the deviation of their residuals, the worst first; the other {} are in the table \
             above.",
            figures::MOST_LOGS,
            fit.logs.len() - figures::MOST_LOGS
        ));
    }
    for log in figures::worst(&fit.logs, &fit.noise) {
        for output in &log.outputs {
            page.figure(&figures::overlay(log, output));
            if let Some(figure) = figures::memory(log, output) {
                page.figure(&figure);
            }
        }
    }
    page.section("The case with the estimates");
    page.embed("fitted.toml", text);
    page.footer(format!("taut {}", env!("CARGO_PKG_VERSION")));
    page
}

fn parameters(page: &mut Page, fit: &Fit) {
    page.section("Parameters");
    let mut rows = Table::new("Estimates with standard errors and 95 % intervals.");
    for heading in ["Parameter", "Estimate", "Standard error", "Interval", "Start"] {
        rows = rows.column(heading, "");
    }
    for estimate in &fit.estimates {
        let [value, error, interval] = table::words(estimate);
        let start = table::value(estimate.start, estimate.unit, 5);
        rows.row([estimate.name.clone(), value, error, interval, start].map(Cell::from));
    }
    page.table(&rows);
}

fn profiles(page: &mut Page, profiles: &[Profile]) {
    if profiles.is_empty() {
        return;
    }
    page.subsection("Profiles");
    page.prose(match table::crooked(profiles) {
        names if names.is_empty() => "Each parameter held off its estimate and all others fitted anew: the cost grows as the intervals say, to both sides.".to_string(),
        names => format!(
            "Each parameter held off its estimate and all others fitted anew. Not as a linear model has it: {}; `--posterior` makes intervals that do not need that.",
            names.join(", ")
        ),
    });
    for profile in profiles {
        page.figure(&figures::profile(profile));
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
    let mut rows = Table::new("How each log is met.");
    for heading in ["Log", "Quantity", "Rows", "RMSE", "Largest", "Fit", "Neighbours' correlation"] {
        rows = rows.column(heading, "");
    }
    for log in &fit.logs {
        for output in &log.outputs {
            let unit = output.quantity.unit();
            for (word, score) in [("fitted", output.fitted), ("held out", output.held_out)] {
                let Some(score) = score else { continue };
                rows.row(
                    [
                        log.name.clone(),
                        format!("{}, {word}", output.quantity.name().replace('_', " ")),
                        score.count.to_string(),
                        table::value(score.rmse, unit, 4),
                        table::value(score.worst, unit, 4),
                        format!("{:.2} %", score.percent),
                        format!("{:.3}", score.memory),
                    ]
                    .map(Cell::from),
                );
            }
        }
    }
    page.table(&rows);
}
