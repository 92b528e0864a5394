//! The report: one HTML file.

use super::rows::{head, lines, trials};
use crate::simulate::figures_table;
use crate::{Callout, Cell, Figure, Page, Table};
use taut::case::{Case, Move};
use taut::learning::Learned;

/// The page.
pub fn page(case: &Case, motion: &Move, found: &Learned, figures: &[(String, Figure)]) -> Page {
    let mut page = Page::new(case.title.clone())
        .subtitle(format!("The next feed-forward signal of the move \"{}\", learned from its log.", motion.name));
    page.callout(Callout::Holds, "Learning converges", format!("{}.", head(found, &case.machine)));
    page.table(&figures_table(lines(found, &case.machine)));
    let caption = "Errors of the repetitions to come, each learned from the one before: on the machine of the file, and \
                   the largest of the family.";
    let mut table = Table::new(caption);
    for name in ["Repetition", "File, rms", "File, peak", "Worst, rms", "Worst, peak"] {
        table = table.column(name, "");
    }
    trials(found, &case.machine).into_iter().for_each(|row| table.row(row.map(Cell::from)));
    page.table(&table);
    for (_, figure) in figures {
        page.figure(figure);
    }
    page.embed("Case file", &case.text);
    page.version();
    page
}
