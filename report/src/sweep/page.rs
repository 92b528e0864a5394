//! The report: one HTML file.

use super::rows::{endings, influence, influence_heading, number, plan};
use crate::figure::Figure;
use crate::page::{Callout, Cell, Page, Table};
use taut::sweep::{Summary, Sweep};

/// The page; `text` is the case.
pub fn page(title: &str, sweep: &Sweep, summary: &Summary, text: &str, figures: &[(String, Figure)]) -> Page {
    let mut page = Page::new(title).subtitle(format!("Sweep: {}.", plan(sweep)));
    for group in &summary.groups {
        if let Some(endings) = endings(group) {
            page.callout(Callout::Fails, format!("{}: not all runs came to their end", group.name), endings);
        }
        if let Some(lost) = group.lost_steps() {
            let callout = if lost.lost > 0 { Callout::Fails } else { Callout::Holds };
            page.callout(callout, group.name.clone(), format!("{}.", lost.words()));
        }
    }
    page.section("What was varied");
    let mut parameters =
        Table::new("").column("Parameter", "").column("Least", "").column("Median", "").column("Greatest", "");
    for parameter in &summary.parameters {
        let shown = |place: usize| {
            let value = parameter.spread.as_ref().map_or(f64::NAN, |spread| spread.quantiles[place]);
            Cell::from(number(value, &parameter.unit))
        };
        parameters.row([Cell::from(parameter.name.clone()), shown(0), shown(2), shown(4)]);
    }
    page.table(&parameters);
    let mut figures = figures.iter();
    for group in &summary.groups {
        page.section(&group.name);
        let mut rows = Table::new("").column("Figure", "");
        for heading in ["5 %", "50 %", "95 %", influence_heading(sweep)] {
            rows = rows.column(heading, "");
        }
        for measured in group.measures.iter().filter(|measured| measured.varies()) {
            let Some(spread) = &measured.spread else { continue };
            let shown = |place: usize| Cell::from(number(spread.quantiles[place], measured.unit));
            let most = Cell::from(influence(summary, measured, 3));
            rows.row([Cell::from(measured.words.to_string()), shown(1), shown(2), shown(3), most]);
        }
        page.table(&rows);
        let own = format!("{}: ", group.name);
        while let Some((_, figure)) = figures.clone().next().filter(|(_, figure)| figure.title.starts_with(&own)) {
            page.figure(figure);
            figures.next();
        }
    }
    page.case("This text repeats the sweep.", "case.toml", text);
    page
}
