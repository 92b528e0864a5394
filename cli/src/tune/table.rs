//! Gains, margins and errors for people.

use super::Work;
use crate::terminal::bold;
use std::f64::consts::PI;
use std::fmt::Write;
use taut::control::Deviation;
use taut::number::engineering;
use taut::tune::{Hunt, Margins, Source, Verdict};

/// A length in µm.
fn length(metres: f64) -> String {
    if metres.is_finite() { format!("{:.1} µm", 1e6 * metres) } else { "does not end".into() }
}

/// Before and after, with a name.
pub type Row = (String, String, String);

/// A value with four digits in its unit, spaces as on a keyboard.
fn number(value: f64, unit: &str) -> String {
    engineering(value, unit, 4).replace('\u{a0}', " ")
}

/// The gains.
pub fn gains(work: &Work) -> Vec<Row> {
    let name = |key: &str| key.trim_start_matches("controller.").to_string();
    work.tuned
        .changes()
        .into_iter()
        .map(|(gain, after)| (name(gain.key), number(gain.value, gain.unit), number(after, gain.unit)))
        .collect()
}

/// Margins before and after, one row each.
pub fn margins(before: &Margins, after: &Margins) -> Vec<Row> {
    let hertz = |omega: f64| if omega.is_finite() { format!("{:.2} Hz", omega / (2.0 * PI)) } else { "none".into() };
    let factor = |m: &Margins| match m.gain {
        _ if !m.stable => "none".into(),
        gain if gain.is_infinite() => "any".into(),
        gain => format!("{gain:.2} ({:.1} dB)", 20.0 * gain.log10()),
    };
    type Shown<'a> = Box<dyn Fn(&Margins) -> String + 'a>;
    let peak = |value: f64| if value.is_finite() { format!("{value:.3}") } else { "not stable".into() };
    let rows: [(&str, Shown); 6] = [
        ("Ms", Box::new(move |m| peak(m.sensitivity))),
        ("Mt", Box::new(move |m| peak(m.complementary))),
        ("gain margin", Box::new(factor)),
        (
            "phase margin",
            Box::new(|m| if m.phase.is_finite() { format!("{:.1}°", m.phase.to_degrees()) } else { "any".into() }),
        ),
        ("crossover", Box::new(move |m| hertz(m.crossover))),
        ("bandwidth", Box::new(move |m| hertz(m.bandwidth))),
    ];
    rows.iter().map(|(name, shown)| (name.to_string(), shown(before), shown(after))).collect()
}

/// The moves before and after.
pub fn moves(work: &Work) -> Vec<Row> {
    let (before, after) = (&work.tuned.before.moves, &work.tuned.after.moves);
    let cart = |cart: &Deviation| format!("{}, {} rms", length(cart.peak.value.abs()), length(cart.rms));
    let settles = |time: Option<f64>| time.map_or("not".into(), |time| format!("after {:.0} ms", 1e3 * time));
    let mut rows = Vec::new();
    for (was, is) in before.iter().zip(after) {
        rows.push((format!("{}: cart error", was.name), cart(&was.cart), cart(&is.cart)));
        rows.push(("  settles".into(), settles(was.settling), settles(is.settling)));
        rows.push(("  at worst".into(), length(was.worst.0), length(is.worst.0)));
        let of = |(settled, all): (usize, usize)| format!("{settled} of {all}");
        rows.push(("  axes that settle".into(), of(was.settled), of(is.settled)));
    }
    rows
}

/// A limit cycle in words.
pub fn hunt(hunt: &Option<Hunt>) -> String {
    match hunt {
        None => "none after a slow reversal".into(),
        Some(hunt) => format!(
            "cart ± {} every {} s; {}",
            length(hunt.amplitude),
            number(hunt.period, ""),
            match &hunt.needs[..] {
                [] => "whatever is left out".into(),
                needs => format!("not without {}", needs.join(", nor without ")),
            }
        ),
    }
}

/// What the limits had to hold over.
pub fn family(work: &Work) -> String {
    let family = &work.tuned.family;
    let off = match family.source {
        Source::Fit => format!("{} parameters within the 95 % intervals of the fit", family.unknowns.len()),
        Source::Spread(share) => format!("{} parameters ± {} %", family.unknowns.len(), number(100.0 * share, "")),
    };
    let places = match &family.places[..] {
        [first, .., last] => {
            format!(", {} places from {:.0} mm to {:.0} mm", family.places.len(), 1e3 * first, 1e3 * last)
        }
        _ => String::new(),
    };
    let loads = if family.loads.len() > 1 { format!(", {} loads", family.loads.len()) } else { String::new() };
    format!("{off}{loads}{places}, all at once")
}

/// What was looked for.
pub fn goal(work: &Work) -> String {
    let tuning = work.tuning;
    let limits = format!("Ms ≤ {}, Mt ≤ {}", tuning.sensitivity, tuning.complementary);
    let placed = work.tuned.placed.map(|hertz| format!("{} Hz, damping {}", number(hertz, ""), tuning.damping));
    match (tuning.cost, placed) {
        (None, placed) => format!("placed for {}; limits are {limits}", placed.unwrap_or_default()),
        (Some(cost), Some(placed)) => format!("cost \"{}\" with {limits}; began with {placed}", cost.word()),
        (Some(cost), None) => format!("cost \"{}\" with {limits}; began with the weights of the file", cost.word()),
    }
}

fn rows(text: &mut String, title: &str, rows: &[Row]) {
    let width = |pick: fn(&Row) -> &String| rows.iter().map(|row| pick(row).chars().count()).max().unwrap_or(0);
    let (first, second) = (width(|row| &row.0), width(|row| &row.1).max(6));
    let _ = writeln!(text, "\n{}", bold(title));
    for (name, before, after) in rows {
        let _ = writeln!(text, "  {name:<first$}  {before:<second$}  → {after}");
    }
}

/// Text on the terminal.
pub fn text(work: &Work) -> String {
    let (tuned, case) = (work.tuned, work.case);
    let (before, after): (&Verdict, &Verdict) = (&tuned.before, &tuned.after);
    let mut text = format!("{}\n{}\n", bold(&case.title), after.design.structure.name());
    let _ = writeln!(text, "{}", goal(work));
    let _ = writeln!(text, "over {}", family(work));
    rows(&mut text, "Gains", &gains(work));
    rows(&mut text, "The axis as the file has it", &margins(&before.nominal, &after.nominal));
    rows(&mut text, "The worst axis", &margins(&before.worst, &after.worst));
    let _ = writeln!(text, "  before: {}", tuned.family.words(&before.corner));
    let _ = writeln!(text, "  after: {}", tuned.family.words(&after.corner));
    if !after.moves.is_empty() {
        rows(&mut text, "Moves", &moves(work));
        for motion in &after.moves {
            let _ = writeln!(text, "  {} at worst after: {}", motion.name, motion.worst.1);
        }
    }
    let _ = writeln!(text, "\n{}", bold("Limit cycles at rest"));
    let _ = writeln!(text, "  before: {}\n  after: {}", hunt(&before.hunt), hunt(&after.hunt));
    let verdict =
        if tuned.holds { "the limits hold on the worst axis" } else { "the limits do NOT hold on the worst axis" };
    let _ = writeln!(text, "\n{verdict}; {} designs tried in {} rounds", tuned.work.1, tuned.work.0);
    text.replace('\u{a0}', " ")
}
