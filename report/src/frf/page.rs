//! The report: one HTML file.

use super::rows::{lines, quality};
use crate::{Callout, Cell, Figure, Page, Table};
use taut::case::Case;
use taut::frf::Measurement;

/// The page.
pub fn page(case: &Case, found: &Measurement, figures: &[(String, Figure)]) -> Page {
    let mut page = Page::new(case.title.clone()).subtitle("Frequency responses from logs, without a model.");
    for warning in &found.warnings {
        page.callout(Callout::Note, "An input without a response", format!("{warning}."));
    }
    match &found.fit {
        Ok(fit) => {
            let kind = if fit.chi < 3.0 { Callout::Holds } else { Callout::Note };
            let head = format!("The belt is {:.3} times as stiff as the file says", fit.stiffness.0);
            let [low, high] = fit.stiffness.1;
            page.callout(kind, head, format!("{low:.3} to {high:.3} with 95 %; {}.", quality(fit)));
            let mut rows = Table::new("What was fitted to the responses.").column("", "").column("Value", "");
            rows = rows.column("From", "").column("To", "");
            for (name, value, [low, high]) in fit.rows() {
                rows.row([name.to_string(), value, low, high].map(Cell::from));
            }
            page.table(&rows);
        }
        Err(error) => page.callout(Callout::Note, "Nothing was fitted", error.what.clone()),
    }
    for (one, (_, figure)) in found.responses.iter().zip(figures) {
        page.section(&one.frf.title());
        for line in lines(&one.frf) {
            page.prose(format!("{line}."));
        }
        if let Some(margins) = &one.margins {
            page.prose(format!("With the case's controller: {}.", margins.words()));
        }
        page.figure(figure);
    }
    page.embed("Case file", &case.text);
    page.version();
    page
}
