//! The places of everything in a figure: plot areas, ticks with their texts, legends. The picture and `plot.js` use the
//! same ones.

use super::axis::{Scale, in_range};
use super::figure::{Axis, Figure, Panel, Series, Style};
use super::svg::{fit, text_width};

/// Room to the right of the plot areas.
pub(crate) const RIGHT: f64 = 16.0;
/// Height of a row of the legend.
const LEGEND_ROW: f64 = 19.0;
/// Room above the first panel for the names of vertical lines.
const MARKS: f64 = 15.0;
/// Width of an entry of the legend before its name, and behind it.
const SAMPLE: f64 = 26.0;
const AFTER: f64 = 18.0;
/// A plot area with equal axes is at most this part as high as it is wide.
const STEEPEST: f64 = 0.72;

/// Everything's place in a picture of one width, in pixels.
pub(crate) struct Layout {
    pub width: f64,
    pub height: f64,
    /// Left edge and width of the plot areas.
    pub left: f64,
    pub wide: f64,
    pub x_ticks: Vec<(f64, String)>,
    pub panels: Vec<PanelPlace>,
}

/// A panel's place.
pub(crate) struct PanelPlace {
    /// Of the plot area.
    pub top: f64,
    pub height: f64,
    pub ticks: Vec<(f64, String)>,
    /// Where the axis' heading stands.
    pub heading: f64,
    pub legend: Vec<Entry>,
}

/// One entry of a legend.
pub(crate) struct Entry {
    pub series: usize,
    /// Left end, base line, width with its surroundings.
    pub x: f64,
    pub y: f64,
    pub width: f64,
    pub name: String,
}

/// The scales of a figure as it is shown first: x, and y of each panel; in shown units.
pub(crate) fn scales(figure: &Figure) -> (Scale, Vec<Scale>) {
    let seen = |x: f64| figure.view.is_none_or(|(from, to)| (from..=to).contains(&x));
    let shown = |s: &'_ Series| -> Vec<(f64, f64)> {
        s.x.iter().zip(&s.y).map(|(x, y)| (*x, *y)).filter(|(x, _)| seen(*x)).collect()
    };
    let ends = figure.view.map(|(from, to)| [from, to]);
    let xs = figure.panels.iter().flat_map(|p| &p.series).flat_map(shown).map(|(x, _)| x);
    let xs = xs.chain(figure.verticals.iter().map(|m| m.at).filter(|at| seen(*at))).chain(ends.into_iter().flatten());
    // A curve may begin and end at the frame; a cross there would be half a cross.
    let crosses = figure.panels.iter().flat_map(|p| &p.series).any(|s| s.style == Style::Crosses);
    let mut x = Scale::covering(xs.map(|v| v * figure.x.factor), figure.x.log, !figure.equal && !crosses);
    x.degrees = is_degrees(&figure.x);
    let ys = figure.panels.iter().map(|p| {
        let values = p.series.iter().flat_map(shown).map(|(_, y)| y);
        let values = values.chain(p.horizontals.iter().map(|m| m.at)).map(|v| v * p.y.factor);
        let mut scale = Scale::covering(values, p.y.log, false);
        scale.degrees = is_degrees(&p.y);
        scale
    });
    let mut ys: Vec<Scale> = ys.collect();
    if let (true, [y]) = (figure.equal, &mut ys[..]) {
        level(&mut x, y);
    }
    (x, ys)
}

fn is_degrees(axis: &Axis) -> bool {
    axis.unit == "°"
}

/// Widens the range of one of two scales, so that a plot area of a comfortable form shows both with equal units.
fn level(x: &mut Scale, y: &mut Scale) {
    let widen = |scale: &mut Scale, length: f64| {
        let more = 0.5 * (length - (scale.hi - scale.lo)).max(0.0);
        (scale.lo, scale.hi) = (scale.lo - more, scale.hi + more);
    };
    widen(x, (y.hi - y.lo) / STEEPEST);
    widen(y, 0.4 * (x.hi - x.lo));
}

/// Height over width of the plot area of a figure with equal axes.
pub(crate) fn ratio(figure: &Figure, x: &Scale, ys: &[Scale]) -> Option<f64> {
    match ys {
        [y] if figure.equal && !x.log && !y.log => Some((y.hi - y.lo) / (x.hi - x.lo)).filter(|r| in_range(*r)),
        _ => None,
    }
}

/// Height of a panel's plot area whose axes are free of each other.
fn panel_height(figure: &Figure, panel: &Panel) -> f64 {
    let base = if figure.panels.len() > 1 { 150.0 } else { 270.0 };
    base * if panel.weight.is_finite() { panel.weight.clamp(0.2, 5.0) } else { 1.0 }
}

impl Layout {
    /// The places in a picture of this width that has `above` pixels for its title.
    pub fn new(figure: &Figure, (x, ys): (&Scale, &[Scale]), width: f64, above: f64) -> Self {
        let ratio = ratio(figure, x, ys);
        let ticks_of = |height: f64, y: &Scale| y.ticks((height / 40.0).round() as usize);
        // A first guess is enough for the number of ticks on axes of equal units.
        let height = |panel: &Panel, wide: f64| ratio.map_or(panel_height(figure, panel), |r| (r * wide).round());
        let panels = || figure.panels.iter().zip(ys);
        let ticks: Vec<_> = panels().map(|(panel, y)| ticks_of(height(panel, width - 60.0), y)).collect();
        let widest = ticks.iter().flatten().map(|(_, t)| text_width(t, 12.0, false)).fold(0.0, f64::max);
        let left = (widest + 16.0).max(if width < 480.0 { 34.0 } else { 44.0 }).min(0.4 * width);
        let wide = width - left - RIGHT;
        let marked = figure.verticals.iter().any(|m| !m.label.is_empty());

        let (mut top, mut places) = (above, Vec::new());
        for (i, (panel, ticks)) in figure.panels.iter().zip(ticks).enumerate() {
            let (mut legend, rows) = legend(panel, left, wide);
            let lift = if i == 0 && marked { MARKS } else { 0.0 };
            top += rows as f64 * LEGEND_ROW + 6.0 + lift;
            let heading = top - lift - 10.0 - (rows - 1) as f64 * LEGEND_ROW;
            legend.iter_mut().for_each(|entry| entry.y += heading);
            let height = height(panel, wide);
            places.push(PanelPlace { top, height, ticks, heading, legend });
            top += height + if i + 1 < figure.panels.len() { 16.0 } else { 0.0 };
        }
        let x_ticks = x.ticks((wide / 80.0).round() as usize);
        Self { width, height: top + 48.0, left, wide, x_ticks, panels: places }
    }
}

/// Where a text of this width begins that should stand about `at`, without leaving the picture.
pub(crate) fn within(at: f64, text: f64, width: f64) -> f64 {
    (at - 0.5 * text).min(width - text - 1.0).max(1.0)
}

/// Places the legend behind the axis' heading, in as many rows as it needs; base lines count from the heading's.
fn legend(panel: &Panel, left: f64, wide: f64) -> (Vec<Entry>, usize) {
    let (mut x, mut row) = (left + text_width(&panel.y.heading(), 13.0, false) * 1.06 + 22.0, 0);
    let mut entries = Vec::new();
    for (series, s) in panel.series.iter().enumerate().filter(|(_, s)| !s.name.is_empty()) {
        let name = fit(&s.name, 12.5, wide + RIGHT - SAMPLE);
        let width = SAMPLE + text_width(&name, 12.5, false) + AFTER;
        if x + width > left + wide + AFTER && x > left {
            x = left;
            row += 1;
        }
        entries.push(Entry { series, x, y: row as f64 * LEGEND_ROW, width, name });
        x += width;
    }
    (entries, row + 1)
}
