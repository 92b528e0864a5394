//! The report: one HTML file.

use super::summary::Summary;
use super::{Work, table};
use taut_report::{Callout, Cell, Figure, Page, Table};

/// The page; `text` is the case.
pub fn page(work: &Work, summary: &Summary, text: &str, figures: &[(String, Figure)]) -> Page {
    let mut page = Page::new(work.case.title()).subtitle(format!("Sweep: {}.", table::plan(work)));
    for group in &summary.groups {
        if let Some(endings) = table::endings(group) {
            page.callout(Callout::Fails, format!("{}: not all runs came to their end", group.name), endings);
        }
    }
    page.section("What was varied");
    let mut parameters =
        Table::new("").column("Parameter", "").column("Least", "").column("Median", "").column("Greatest", "");
    for parameter in &summary.parameters {
        let shown = |place: usize| {
            let value = parameter.spread.as_ref().map_or(f64::NAN, |spread| spread.quantiles[place]);
            Cell::from(table::number(value, &parameter.unit))
        };
        parameters.row([Cell::from(parameter.name.clone()), shown(0), shown(2), shown(4)]);
    }
    page.table(&parameters);
    let mut figures = figures.iter();
    for group in &summary.groups {
        page.section(&group.name);
        let mut rows = Table::new("").column("Figure", "");
        for heading in ["5 %", "50 %", "95 %", table::influence_heading(work)] {
            rows = rows.column(heading, "");
        }
        for measured in group.measures.iter().filter(|measured| measured.varies()) {
            let Some(spread) = &measured.spread else { continue };
            let shown = |place: usize| Cell::from(table::number(spread.quantiles[place], measured.unit));
            let most = Cell::from(table::influence(summary, measured, 3));
            rows.row([Cell::from(measured.words.to_string()), shown(1), shown(2), shown(3), most]);
        }
        page.table(&rows);
        let own = format!("{}: ", group.name);
        while let Some((_, figure)) = figures.clone().next().filter(|(_, figure)| figure.title.starts_with(&own)) {
            page.figure(figure);
            figures.next();
        }
    }
    page.section("The case");
    page.prose("This text repeats the sweep.");
    page.embed("case.toml", text);
    page.footer(format!("taut {}", env!("CARGO_PKG_VERSION")));
    page
}
