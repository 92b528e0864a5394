//! The report: one HTML file.

use super::plots::BELT;
use super::rows::{mode_words, pair_words, remark, words};
use crate::{Callout, Cell, Figure, Page, Table};
use taut::control::compare::Comparison;
use taut::control::recommendation::{Findings, ShaperFile};

/// The page.
pub fn page(found: &Findings, figures: &[(String, Figure)]) -> Page {
    let title = found.each.iter().map(ShaperFile::name).collect::<Vec<_>>().join(" and ");
    let mut page = Page::new(title).subtitle("Input shapers for what vibrates.");
    for (i, one) in found.each.iter().enumerate() {
        page.section(&one.name());
        let best = one.choice.best();
        let recommended = format!("{} at {:.1} Hz", best.shaper.form.name(), best.shaper.frequency);
        page.callout(Callout::Note, recommended, format!("{}.", one.choice.reason));
        page.prose(format!("{}.", one.told()));
        if let Some(told) = one.damping_told() {
            page.prose(format!("{told}."));
        }
        page.embed("Lines for Klipper's configuration", &one.lines().join("\n"));
        shapers(&mut page, one);
        pairs(&mut page, one);
        modes(&mut page, one);
        for (name, figure) in figures.iter().filter(|(name, _)| name != "compared" && !name.starts_with(BELT)) {
            if name.ends_with("-2") == (i == 1) {
                page.figure(figure);
            }
        }
        impulses(&mut page, one);
    }
    if let Some(comparison) = &found.comparison {
        compared(&mut page, comparison);
    }
    for (_, figure) in figures.iter().filter(|(name, _)| name == "compared") {
        page.figure(figure);
    }
    if let Some(belts) = &found.belts {
        page.section("Belts");
        page.prose(format!("{}.", belts.words()));
        if let Some(told) = belts.model_words() {
            page.prose(format!("{told}."));
        }
    }
    for (_, figure) in figures.iter().filter(|(name, _)| name.starts_with(BELT)) {
        page.figure(figure);
    }
    page.version();
    page
}

fn shapers(page: &mut Page, one: &ShaperFile) {
    let corner = &one.criterion.corner;
    let mut rows = Table::new(format!(
        "Each shaper at its best frequency. Smoothing is at {} mm/s² and {} mm/s at corners; the acceleration is what smooths by \
         0.12 mm, whether or not the motor can do it.",
        1e3 * corner.acceleration,
        taut::quantity::rounded(1e3 * corner.speed)
    ));
    rows = rows.column("Shaper", "").column("Frequency", "Hz").column("Vibration left", "%").column("Smoothing", "mm");
    rows = rows.column("Acceleration up to", "mm/s^2").column("", "");
    for (i, fitted) in one.choice.fitted.iter().enumerate() {
        let word = match () {
            () if i == one.choice.recommended => Cell::Badge(Callout::Holds, "recommended".into()),
            () => Cell::from(remark(fitted)),
        };
        let name = Cell::from(fitted.shaper.form.name());
        let numbers = words(fitted).map(Cell::Number);
        rows.row(std::iter::once(name).chain(numbers).chain([word]));
    }
    page.table(&rows);
}

fn pairs(page: &mut Page, one: &ShaperFile) {
    let Some(told) = one.pair_told() else { return };
    page.prose(format!("{told}."));
    let Some(best) = one.choice.pairs.first() else { return };
    let mut rows = Table::new("The best pairs of shapers, one behind the other.");
    rows = rows.column("Pair", "").column("Vibration left", "%").column("Smoothing", "mm");
    rows = rows.column("Acceleration up to", "mm/s^2");
    for pair in &one.choice.pairs {
        rows.row(std::iter::once(Cell::from(pair.name())).chain(pair_words(pair).map(Cell::Number)));
    }
    page.table(&rows);
    page.embed("The best pair for [controller] of a case", &best.line());
}

fn modes(page: &mut Page, one: &ShaperFile) {
    let left = one.left();
    if left.is_empty() {
        return;
    }
    let mut rows = Table::new(format!(
        "Modes along the travel, and what is left of each at worst, its frequency being off by up to {} %.",
        taut::quantity::rounded(100.0 * one.uncertainty)
    ));
    rows = rows.column("Frequency", "Hz").column("Damping ratio", "").column("Motion of the cart", "");
    rows = rows.column("Recommended leaves", "%");
    let has_pairs = !one.choice.pairs.is_empty();
    if has_pairs {
        rows = rows.column("Best pair leaves", "%");
    }
    for left in &left {
        let words = mode_words(left, one.choice.recommended).into_iter().take(if has_pairs { 5 } else { 4 });
        rows.row(words.map(Cell::Number));
    }
    page.table(&rows);
}

fn impulses(page: &mut Page, one: &ShaperFile) {
    let best = one.choice.best();
    let mut rows = Table::new(format!("The impulses of {}.", best.shaper.form.name()));
    rows = rows.column("Time", "ms").column("Amplitude", "");
    for (time, amplitude) in best.shaper.impulses() {
        rows.row([Cell::fixed(1e3 * time, 4), Cell::fixed(*amplitude, 6)]);
    }
    page.table(&rows);
}

fn compared(page: &mut Page, comparison: &Comparison) {
    page.section("Compared");
    for sentence in comparison.suggestions() {
        page.prose(sentence);
    }
    if comparison.pairs.is_empty() {
        return;
    }
    let mut rows = Table::new("Peaks that both have. Stiffness over mass is the square of the frequencies' ratio.");
    rows = rows.column("First", "Hz").column("Second", "Hz").column("Stiffness over mass", "%");
    for pair in &comparison.pairs {
        let change = 100.0 * (pair.stiffness_per_mass() - 1.0);
        rows.row([Cell::fixed(pair.first.0, 1), Cell::fixed(pair.second.0, 1), Cell::fixed(change, 0)]);
    }
    page.table(&rows);
}
