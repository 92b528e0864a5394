//! The summary on the terminal.

use super::summary::MOST_VALUES;
use super::{Work, shown};
use crate::terminal::{bold, columns};
use std::fmt::Write;
use std::time::Duration;
use taut::sweep::{Measured, Summary};
use taut_report::sweep::{endings, influence, influence_heading, number, plan};

/// Figures of an experiment that are printed without `--verbose`.
const MAIN: usize = 5;

/// Text on the terminal.
pub fn text(work: &Work, summary: &Summary, took: Duration, run: u64) -> String {
    let mut text = format!("{}\n{}\n", bold(work.case.title.as_str()), plan(work.sweep));
    for group in &summary.groups {
        let _ = writeln!(text, "\n{}", bold(&group.name));
        if let Some(endings) = endings(group) {
            let _ = writeln!(text, "  {endings}");
        }
        if let Some(lost) = group.lost_steps() {
            let _ = writeln!(text, "  {}", lost.words());
        }
        let mut rows =
            vec![["".to_string(), "5 %".into(), "50 %".into(), "95 %".into(), influence_heading(work.sweep).into()]];
        // Counts of events are for the report.
        let shown = |measured: &&Measured| measured.varies() && !measured.unit.is_empty();
        let left_out = group.measures.len() - group.measures.iter().filter(shown).count();
        let most = if work.args.verbose { usize::MAX } else { MAIN };
        let more = group.measures.iter().filter(shown).count().saturating_sub(most);
        for measured in group.measures.iter().filter(shown).take(most) {
            let Some(spread) = &measured.spread else { continue };
            let [_, low, middle, high, _] = spread.quantiles.map(|value| number(value, measured.unit));
            rows.push([measured.words.to_string(), low, middle, high, influence(summary, measured, 3)]);
        }
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        let widths = [0, 1, 2, 3, 4].map(width);
        // Two columns of space before each; where that is too wide, the last column gets lines of its own.
        let is_wide = widths.iter().map(|wide| wide + 2).sum::<usize>() > columns();
        for [name, low, middle, high, most] in &rows {
            let [a, b, c, d, _] = widths;
            let line = format!("  {name:<a$}  {low:>b$}  {middle:>c$}  {high:>d$}");
            let _ = match is_wide {
                true => writeln!(text, "{line}\n      {most}"),
                false => writeln!(text, "{}", format!("{line}  {most}").trim_end()),
            };
        }
        if more > 0 {
            let _ = writeln!(text, "  and {more} more figures: --verbose");
        } else if left_out > 0 {
            let _ = writeln!(text, "  and {left_out} figures that count events, or are the same in all runs: --json");
        }
    }
    if summary.every > 1 {
        let _ = writeln!(text, "\nShares are those of every {}th run: {MOST_VALUES} values at most", summary.every);
    }
    let rate = run as f64 * work.sweep.groups().len() as f64 / took.as_secs_f64().max(1e-9);
    let _ = match run {
        0 => writeln!(text, "\n  took no time: all runs were already done"),
        _ => writeln!(text, "\n  took {}: {run} runs, {rate:.0} simulations a second", shown(took)),
    };
    text.replace('\u{a0}', " ")
}
