//! Histograms, scatter, sensitivity indices, and the tornado.

use super::rows::short;
use crate::{Axis, Colour, Figure, Panel, Series, Style};
use taut::case::file_name;
use taut::number::engineering;
use taut::sweep::{Measured, Shown, Summary, Sweep};

/// Figures that are drawn of each experiment, where they vary.
const DRAWN: [&str; 13] = [
    "final_bridge_position",
    "final_cart_position",
    "peak_bridge_speed",
    "peak_cart_speed",
    "peak_belt_force",
    "peak_motor_current",
    "peak_left_current",
    "peak_right_current",
    "peak_cart_current",
    "stop_time",
    "peak_cart_error",
    "settling_time",
    "overshoot",
];

/// Parameters that a picture of influences shows.
const MOST: usize = 12;

/// All of them, with names for files.
pub fn figures(sweep: &Sweep, summary: &Summary) -> Vec<(String, Figure)> {
    let mut figures = Vec::new();
    for group in &summary.groups {
        let drawn = DRAWN.iter().filter_map(|name| group.measures.iter().find(|measured| measured.name == *name));
        for measured in drawn.filter(|measured| measured.varies()) {
            let name = format!("{}-{}", file_name(&group.name), measured.name.replace('_', "-"));
            if !measured.tornado.is_empty() {
                figures.push((format!("{name}-tornado"), tornado(summary, group, measured)));
                continue;
            }
            figures.push((format!("{name}-histogram"), histogram(group, measured)));
            figures.extend(scatter(sweep, summary, group, measured).map(|figure| (format!("{name}-scatter"), figure)));
            figures.extend(indices(summary, group, measured).map(|figure| (format!("{name}-indices"), figure)));
        }
    }
    figures
}

fn title(group: &Shown, measured: &Measured) -> String {
    format!("{}: {}", group.name, measured.words)
}

fn axis(measured: &Measured) -> Axis {
    let axis = Axis::new(capital(&measured.words), measured.unit);
    match measured.unit {
        "m" => axis.shown_as("mm", 1e3),
        "s" => axis.shown_as("ms", 1e3),
        _ => axis,
    }
}

fn capital(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// How often each value comes, with the shares of 5, 50 and 95 %.
fn histogram(group: &Shown, measured: &Measured) -> Figure {
    let (mut x, mut y) = (Vec::new(), Vec::new());
    let mut figure = Figure::new(title(group, measured), axis(measured));
    if let Some(spread) = &measured.spread {
        for (edges, count) in spread.edges.windows(2).zip(&spread.counts) {
            x.extend([edges[0], edges[0], edges[1], edges[1]]);
            y.extend([0.0, *count as f64, *count as f64, 0.0]);
        }
        let [_, low, middle, high, _] = spread.quantiles;
        for (at, word) in [(low, "5 %"), (middle, "50 %"), (high, "95 %")] {
            figure = figure.vertical(at, word);
        }
        figure = figure.caption(format!(
            "{} runs; mean {}, standard deviation {}.",
            spread.count,
            engineering(spread.mean, measured.unit, 4),
            engineering(spread.deviation, measured.unit, 3)
        ));
    }
    figure.panel(Panel::new(Axis::new("Runs", "")).series(Series::new("", x, y)))
}

/// The figure over the parameter that matters most.
fn scatter(sweep: &Sweep, summary: &Summary, group: &Shown, measured: &Measured) -> Option<Figure> {
    let (place, much) = *measured.influence().first()?;
    let parameter = &summary.parameters[place];
    let points = Series::new("", parameter.points.clone(), measured.points.clone()).style(Style::Points);
    let by = if sweep.indices() { "total index" } else { "rank correlation" };
    let caption = format!(
        "{} depends most on {} ({by} {}); up to 1500 runs are shown.",
        capital(&measured.words),
        parameter.name,
        taut::number::fixed(much, 2)
    );
    let figure = Figure::new(title(group, measured), Axis::new(parameter.name.clone(), &parameter.unit));
    Some(figure.panel(Panel::new(axis(measured)).series(points)).caption(caption))
}

/// The corners of a lying bar from `from` to `to` at height `y`, behind those that are there.
fn bar((xs, ys): &mut (Vec<f64>, Vec<f64>), from: f64, to: f64, y: f64, half: f64) {
    xs.extend([from, to, to, from, from, f64::NAN]);
    ys.extend([y - half, y - half, y + half, y + half, y - half, f64::NAN]);
}

/// First and total order, with the intervals of the total.
fn indices(summary: &Summary, group: &Shown, measured: &Measured) -> Option<Figure> {
    let indices = measured.indices.as_ref()?;
    let (mut first, mut total, mut whiskers) = <((_, _), (_, _), (Vec<f64>, Vec<f64>))>::default();
    let mut panel = Panel::new(Axis::new("Parameter, the most important on top", "")).weight(2.0);
    let shown: Vec<(usize, f64)> = measured.influence().into_iter().take(MOST).collect();
    for (row, (place, _)) in shown.iter().enumerate() {
        let y = (shown.len() - row) as f64;
        let index = indices[*place];
        bar(&mut total, 0.0, index.total.value, y, 0.32);
        bar(&mut first, 0.0, index.first.value, y, 0.18);
        whiskers.0.extend([index.total.interval[0], index.total.interval[1], f64::NAN]);
        whiskers.1.extend([y, y, f64::NAN]);
        panel = panel.horizontal(y, short(&summary.parameters[*place].name));
    }
    let panel = panel
        .series(Series::new("total order", total.0, total.1).colour(Colour::Blue))
        .series(Series::new("first order", first.0, first.1).colour(Colour::Vermillion))
        .series(Series::new("95 %", whiskers.0, whiskers.1).colour(Colour::Green));
    let caption =
        "Sobol' indices: the share of the variance that a parameter makes by itself, and that it takes part in.";
    Some(Figure::new(title(group, measured), Axis::new("Share of the variance", "")).panel(panel).caption(caption))
}

/// One bar for each parameter, from where the figure goes with its first value to where it goes with its last.
fn tornado(summary: &Summary, group: &Shown, measured: &Measured) -> Figure {
    let (mut up, mut down) = <((_, _), (_, _))>::default();
    let mut panel = Panel::new(Axis::new("Parameter, the most important on top", "")).weight(2.0);
    let shown: Vec<(usize, f64)> = measured.influence().into_iter().take(MOST).collect();
    for (row, (place, _)) in shown.iter().enumerate() {
        let y = (shown.len() - row) as f64;
        for (value, figure) in &measured.tornado[*place] {
            let more = summary.parameters[*place].points.first().is_none_or(|nominal| value > nominal);
            bar(if more { &mut up } else { &mut down }, measured.nominal, *figure, y, 0.3);
        }
        panel = panel.horizontal(y, short(&summary.parameters[*place].name));
    }
    let panel = panel
        .series(Series::new("more of it", up.0, up.1).colour(Colour::Vermillion))
        .series(Series::new("less of it", down.0, down.1).colour(Colour::Blue));
    Figure::new(title(group, measured), axis(measured))
        .panel(panel)
        .vertical(measured.nominal, "as it is")
        .caption("One parameter at a time; all others as the case has them.")
}
