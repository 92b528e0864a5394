//! The report: one HTML file.

use super::rows::{belt, head, lines};
use crate::motion::length;
use crate::simulate::{figures_table, time, value};
use crate::{Callout, Cell, Figure, Page, Table};
use taut::case::Case;
use taut::planning::{Planned, Plans};

/// The page; `text` is the case with the planned limits.
pub fn page(case: &Case, plans: &Plans, text: &str, figures: &[(String, Figure)]) -> Page {
    let mut page = Page::new(case.title.clone()).subtitle(format!("Planned moves, {}.", belt(plans)));
    for (planned, (_, figure)) in plans.moves.iter().zip(figures) {
        page.section(&planned.name);
        let arrives = planned.best.arrival.settled == planned.best.arrival.axes;
        let kind = if arrives { Callout::Holds } else { Callout::Fails };
        page.callout(kind, "When the cart arrives", format!("{}.", head(planned)));
        page.table(&figures_table(lines(planned)));
        page.figure(figure);
        page.table(&tried(planned));
    }
    page.case("This text makes the planned moves.", "planned.toml", text);
    page
}

/// All plans that were tried, the soonest first.
fn tried(planned: &Planned) -> Table {
    let mut table = Table::new("Plans that were tried, the soonest first; only those at the top were run on all axes.");
    for name in ["Periods", "Share", "Speed", "Acceleration", "Reference", "Arrives", "At worst", "Cart error"] {
        table = table.column(name, "");
    }
    let told = |at: Option<f64>| at.map_or("not".to_string(), time);
    for one in &planned.tried {
        let [jerk, snap] = one.periods;
        table.row(
            [
                format!("{jerk}, {snap}"),
                format!("{:.0} %", 100.0 * one.share),
                value(one.limits.speed, "m/s"),
                value(one.limits.acceleration, "m/s^2"),
                time(one.arrival.duration),
                told(one.arrival.nominal),
                if one.arrival.axes > 1 { told(one.arrival.worst) } else { String::new() },
                length(one.arrival.cart_error),
            ]
            .map(Cell::from),
        );
    }
    table
}
