//! Gains, margins and errors on the terminal.

use crate::terminal::bold;
use std::fmt::Write;
use taut::tune::{Judgement, Verdict};
use taut_report::tune::{
    CHOICES, Row, Work, ahead, axes, certificate, choices, family, gains, given, goal, hunt, in_drives, limiting,
    margins, moves, verdict,
};

fn rows(text: &mut String, title: &str, rows: &[Row]) {
    let width = |pick: fn(&Row) -> &String| rows.iter().map(|row| pick(row).chars().count()).max().unwrap_or(0);
    let (first, second) = (width(|row| &row.0), width(|row| &row.1).max(6));
    let _ = writeln!(text, "\n{}", bold(title));
    for (name, before, after) in rows {
        let _ = writeln!(text, "  {name:<first$}  {before:<second$}  → {after}");
    }
}

fn table(text: &mut String, title: &str, headings: &[&str], rows: Vec<Vec<String>>) {
    let all: Vec<Vec<String>> = std::iter::once(headings.iter().map(|h| h.to_string()).collect()).chain(rows).collect();
    let width = |column: usize| all.iter().filter_map(|row| Some(row.get(column)?.chars().count())).max().unwrap_or(0);
    let widths: Vec<usize> = (0..headings.len()).map(width).collect();
    let _ = writeln!(text, "\n{}", bold(title));
    for row in &all {
        let line: String = row.iter().zip(&widths).map(|(cell, width)| format!("  {cell:<width$}")).collect();
        let _ = writeln!(text, "{}", line.trim_end());
    }
}

/// Number of margins that are printed without `--verbose`: Ms, Mt, gain and phase margin.
const MAIN_MARGINS: usize = 4;

/// Text on the terminal: verdict, gains and worst margins, or everything.
pub fn text(work: &Work, is_verbose: bool) -> String {
    let tuned = work.tuned;
    let (before, after): (&Verdict, &Verdict) = (&tuned.before, &tuned.after);
    let mut text = head(work);
    rows(&mut text, "Gains", &gains(work));
    let in_drives = in_drives(work);
    if !in_drives.is_empty() {
        rows(&mut text, "Gains as drives have them", &in_drives);
    }
    if is_verbose {
        rows(&mut text, "The axis as the file has it", &margins(&before.nominal, &after.nominal));
    }
    let worst = margins(&before.worst, &after.worst);
    rows(&mut text, "At worst", if is_verbose { &worst } else { &worst[..MAIN_MARGINS.min(worst.len())] });
    if is_verbose {
        let [first, second] = limiting(work);
        let _ = writeln!(text, "  before on {first}, after on {second}");
    }
    if let Some(mode) = tuned.undamped {
        let told = "the belt has no damping: near its modes, from";
        let _ = writeln!(
            text,
            "note: {told} {mode:.0} Hz on, Ms is limited by undamped modes; give belt.damping if it is known"
        );
    }
    let _ = writeln!(text, "\n{}\n  {}", bold("Certificate"), certificate(work).join("\n  "));
    // The verdict on other gains compares the moves itself.
    let is_compared = tuned.searched && tuned.judgement != Judgement::Unchanged;
    if is_verbose || !is_compared {
        rows(&mut text, "Moves", &moves(work));
    }
    if is_verbose {
        details(&mut text, work);
    } else if after.hunt.is_some() {
        let _ = writeln!(text, "\n{}\n  {}", bold("Limit cycle at rest"), hunt(&after.hunt));
    }
    let verdict = if tuned.holds { "the limits hold at worst" } else { "the limits do NOT hold at worst" };
    let _ = match tuned.searched {
        true => writeln!(text, "\n{verdict}; {} designs tried in {} rounds", tuned.work.1, tuned.work.0),
        false => writeln!(text, "\n{verdict}"),
    };
    if !is_verbose {
        let _ = writeln!(text, "more on margins, moves, choices, axes and limit cycles: --verbose");
    }
    text.replace('\u{a0}', " ")
}

/// The verdict, and what was tuned for.
fn head(work: &Work) -> String {
    let (tuned, case) = (work.tuned, work.case);
    let mut text = String::new();
    if tuned.searched {
        let _ = writeln!(text, "{}", bold(&verdict(work)));
    }
    for told in [ahead(work), given(work)].into_iter().flatten() {
        let _ = writeln!(text, "{told}");
    }
    let _ = writeln!(text, "\n{}\n{}\n{}", bold(&case.title), tuned.after.design.structure.name(), goal(work));
    let _ = writeln!(text, "over {}", family(work));
    if case.moves.is_empty() {
        let _ = writeln!(text, "The case has no moves: a standard set for its travel and limits.");
    }
    text
}

/// Objective, choices, axes and limit cycles.
fn details(text: &mut String, work: &Work) {
    let (before, after) = (&work.tuned.before, &work.tuned.after);
    let objective = |verdict: &Verdict| format!("{:.4}", verdict.objective.exp());
    rows(text, "Objective", &[("J".to_string(), objective(before), objective(after))]);
    if !work.tuned.choices.is_empty() {
        table(text, "Choices, at worst", &CHOICES, choices(work));
    }
    let _ = writeln!(text, "\n{}", bold("Axes"));
    for [name, off] in axes(work) {
        let _ = writeln!(text, "  {name}: {off}");
    }
    let _ = writeln!(text, "\n{}", bold("Limit cycles at rest"));
    let _ = writeln!(text, "  before: {}\n  after: {}", hunt(&before.hunt), hunt(&after.hunt));
}
