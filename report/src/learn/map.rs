//! The force along the travel as a person sees it.

use crate::motion::length;
use crate::simulate::figures_table;
use crate::{Axis, Callout, Colour, Figure, Page, Panel, Series, Style};
use taut::case::Case;
use taut::fit::map::{Component, ForceMap, Point};
use taut::number::engineering_typed;

/// Three digits are what a map is worth.
fn shown(value: f64, unit: &str) -> String {
    engineering_typed(value, unit, 3)
}

/// The answer in a line.
pub fn head(found: &ForceMap) -> String {
    if !found.is_significant {
        return format!(
            "no force along the travel is significant: the map is empty; a periodic one of {} or more would have been \
             found",
            shown(found.visible, "N")
        );
    }
    let forces = || found.points.iter().map(|point| point.force);
    let (low, high) = (forces().fold(f64::INFINITY, f64::min), forces().fold(f64::NEG_INFINITY, f64::max));
    format!("a force along the travel from {} to {}", shown(low, "N"), shown(high, "N"))
}

/// Properties of the map, by name.
pub fn lines(found: &ForceMap) -> Vec<(String, String)> {
    let [forward, backward] = found.passes;
    let (first, last) = (found.points.first(), found.points.last());
    let position = |point: Option<&Point>| length(point.map_or(0.0, |point| point.position));
    let half = |point: &Point| 0.5 * (point.band[1] - point.band[0]);
    let wide = found.points.iter().map(half).sum::<f64>() / found.points.len().max(1) as f64;
    let mut lines = vec![
        ("passes".into(), format!("{forward} forward, {backward} backward, up to {}", shown(found.speed, "m/s"))),
        (
            "map".into(),
            format!(
                "{} points from {} to {}, ± {} on average (95 %)",
                found.points.len(),
                position(first),
                position(last),
                shown(wide, "N")
            ),
        ),
        ("mean".into(), shown(found.mean, "N")),
        (
            "friction".into(),
            format!("{} beyond that of the case; it is not part of the map", shown(found.friction, "N")),
        ),
        ("resolution".into(), format!("periods from {} on, by {}", length(found.resolution), found.limit.words())),
    ];
    lines.extend(found.components.iter().map(|one| ("period".into(), component(one))));
    lines
}

fn component(one: &Component) -> String {
    let names: Vec<String> =
        one.origins.iter().map(|origin| format!("{} ({})", origin.words(), length(origin.period()))).collect();
    let whose = if names.is_empty() { "matches nothing known of the machine".into() } else { names.join(" or ") };
    let [[period, period_error], [amplitude, error]] = [one.period, one.amplitude];
    format!(
        "{} ± {}, amplitude {} ± {}: {whose}",
        length(period),
        length(1.96 * period_error),
        shown(amplitude, "N"),
        shown(1.96 * error, "N")
    )
}

/// Remarks on the map.
pub fn notes(found: &ForceMap) -> Vec<String> {
    let mut notes = Vec::new();
    if found.may_be_eccentric() {
        notes.push(
            "a component has the period of a turn of the pulley: force alone cannot tell an eccentric pulley from \
             cogging; a scale at the cart shows whether its position is off with the same period"
                .into(),
        );
    }
    for origin in &found.too_long {
        notes.push(format!(
            "the travel is shorter than two periods of {} ({} each): a component of that period is not named",
            origin.words(),
            length(origin.period())
        ));
    }
    notes
}

/// The force over the travel, and the passes in each direction.
pub fn figure(found: &ForceMap) -> Figure {
    let x: Vec<f64> = found.points.iter().map(|point| point.position).collect();
    let over = |name: &str, of: &dyn Fn(&Point) -> f64, colour: Colour, style: Style| {
        Series::new(name, x.clone(), found.points.iter().map(of).collect::<Vec<_>>()).colour(colour).style(style)
    };
    let force = || Axis::new("Force", "N");
    Figure::new("Force along the travel", Axis::new("Position", "m").shown_as("mm", 1e3))
        .panel(
            Panel::new(force())
                .series(over("force", &|point| point.force, Colour::Blue, Style::Solid))
                .series(over("95 %", &|point| point.band[0], Colour::Blue, Style::Dotted))
                .series(over("", &|point| point.band[1], Colour::Blue, Style::Dotted)),
        )
        .panel(
            Panel::new(force())
                .series(over("forward", &|point| point.sides[0], Colour::Green, Style::Solid))
                .series(over("backward", &|point| point.sides[1], Colour::Vermillion, Style::Dashed)),
        )
        .caption(
            "Above, the force on the cart beside that of the case, positive towards larger positions; below, what the \
             passes in each direction lack, with friction.",
        )
}

/// The report.
pub fn page(case: &Case, found: &ForceMap) -> Page {
    let mut page = Page::new(case.title.clone())
        .subtitle("The force that depends on the position of the cart, from slow motion in both directions.");
    let (kind, title) = match found.is_significant {
        true => (Callout::Holds, "The force changes along the travel"),
        false => (Callout::Note, "No force along the travel"),
    };
    page.callout(kind, title, format!("{}.", head(found)));
    page.table(&figures_table(lines(found)));
    for note in notes(found) {
        page.callout(Callout::Note, "Note", format!("{note}."));
    }
    page.figure(&figure(found));
    page.embed("Case file", &case.text);
    page.version();
    page
}
