//! A figure as SVG. `plot.js` draws the same on a page after a zoom; keep the two alike.

use super::axis::{Scale, in_range};
use super::decimate::decimate;
use super::figure::{Figure, Marker, Panel, Series, Style};
use super::svg::{self, Anchor, Svg, n, text_width};
use std::fmt::Write;

const WIDTH: f64 = 760.0;
const RIGHT: f64 = 16.0;
const LEGEND_ROW: f64 = 19.0;

/// The scales of a figure: x, and y of each panel; in shown units.
pub(crate) fn scales(figure: &Figure) -> (Scale, Vec<Scale>) {
    let series = || figure.panels.iter().flat_map(|p| &p.series);
    let x = series()
        .flat_map(|s| s.x.iter().zip(&s.y).map(|(x, _)| x))
        .chain(figure.verticals.iter().map(|m| &m.at))
        .map(|v| v * figure.x.factor);
    let ys = figure.panels.iter().map(|p| {
        let values = p.series.iter().flat_map(|s| s.x.iter().zip(&s.y).map(|(_, y)| y));
        let values = values.chain(p.horizontals.iter().map(|m| &m.at)).map(|v| v * p.y.factor);
        Scale::covering(values, p.y.log, false)
    });
    (Scale::covering(x, figure.x.log, true), ys.collect())
}

/// Height of a panel's plot area in pixels.
pub(crate) fn panel_height(figure: &Figure, panel: &Panel) -> f64 {
    let base = if figure.panels.len() > 1 { 150.0 } else { 270.0 };
    base * if panel.weight.is_finite() { panel.weight.clamp(0.2, 5.0) } else { 1.0 }
}

/// The whole picture, with the title in it or without.
pub(crate) fn svg(figure: &Figure, with_title: bool) -> String {
    let (x, ys) = scales(figure);
    let ticks: Vec<_> = figure
        .panels
        .iter()
        .zip(&ys)
        .map(|(p, y)| y.ticks((panel_height(figure, p) / 40.0).round() as usize))
        .collect();
    let widest = ticks.iter().flatten().map(|(_, t)| text_width(t, 12.0, false)).fold(0.0, f64::max);
    let left = (widest + 16.0).max(44.0);
    let width = WIDTH - left - RIGHT;

    // First everything's place from top to bottom, then the drawing.
    let mut top = if with_title && !figure.title.is_empty() { 40.0 } else { 8.0 };
    let marked = figure.verticals.iter().any(|m| !m.label.is_empty());
    let mut places = Vec::new();
    for (i, panel) in figure.panels.iter().enumerate() {
        let legend = legend(panel, left, width);
        let rows = legend.last().map_or(0, |l| l.row) + 1;
        top += rows as f64 * LEGEND_ROW + 6.0 + if i == 0 && marked { 15.0 } else { 0.0 };
        let height = panel_height(figure, panel);
        places.push((top, height, legend));
        top += height + if i + 1 < figure.panels.len() { 16.0 } else { 0.0 };
    }
    let total = top + 48.0;

    let mut out = Svg::new(WIDTH, total);
    out.margin = if with_title { 12.0 } else { 0.0 };
    if with_title && !figure.title.is_empty() {
        let title = svg::fit(&figure.title, 15.5, width);
        out.text((left, 20.0), 15.0, Anchor::Start, svg::INK, " font-weight=\"600\"", &title);
    }
    let x_ticks = x.ticks((width / 90.0).round() as usize);
    let across = |v: f64| left + width * x.place(v);
    for (i, (((panel, y), ticks), (top, height, legend))) in
        figure.panels.iter().zip(&ys).zip(&ticks).zip(&places).enumerate()
    {
        let (top, height, last) = (*top, *height, i + 1 == figure.panels.len());
        let up = |v: f64| top + height * (1.0 - y.place(v));
        let lift = if i == 0 && marked { 15.0 } else { 0.0 };
        draw_legend(&mut out, panel, legend, top - lift);
        for (v, text) in ticks {
            let at = up(*v);
            out.line((left, at), (left + width, at), svg::GRID, 1.0);
            out.text((left - 8.0, at + 4.2), 12.0, Anchor::End, svg::GREY, "", text);
        }
        for (v, _) in &x_ticks {
            out.line((across(*v), top), (across(*v), top + height), svg::GRID, 1.0);
        }
        markers(&mut out, figure, i == 0, &across, (left, left + width), (top, height));
        for series in &panel.series {
            curve(&mut out, series, (figure.x.factor, panel.y.factor), (&x, y), &across, &up, width);
        }
        for Marker { at, label } in &panel.horizontals {
            let at = up(at * panel.y.factor);
            dashed(&mut out, (left, at), (left + width, at));
            // Above its line, unless the frame is too near.
            let base = if at - top < 16.0 { at + 14.0 } else { at - 5.0 };
            out.text((left + width - 4.0, base), 12.0, Anchor::End, svg::MARK, "", label);
        }
        out.line((left, top + height), (left + width, top + height), svg::AXIS, 1.2);
        if last {
            for (v, text) in &x_ticks {
                let at = across(*v);
                out.line((at, top + height), (at, top + height + 4.0), svg::AXIS, 1.2);
                out.text((at, top + height + 18.0), 12.0, Anchor::Middle, svg::GREY, "", text);
            }
            let heading = figure.x.heading();
            out.text((left + width / 2.0, top + height + 38.0), 13.0, Anchor::Middle, svg::INK, "", &heading);
        }
    }
    out.finish(if figure.title.is_empty() { "Figure" } else { &figure.title })
}

/// One entry of a legend: which series, where, in which row.
struct Entry {
    series: usize,
    x: f64,
    row: usize,
}

/// Places the legend behind the axis heading, in as many rows as it needs.
fn legend(panel: &Panel, left: f64, width: f64) -> Vec<Entry> {
    let start = left + text_width(&panel.y.heading(), 13.0, false) * 1.06 + 22.0;
    let (mut x, mut row) = (start, 0);
    let mut entries = Vec::new();
    for (i, series) in panel.series.iter().enumerate().filter(|(_, s)| !s.name.is_empty()) {
        let needed = 26.0 + text_width(&series.name, 12.5, false) + 18.0;
        if x + needed > left + width + 18.0 && x > left {
            x = left;
            row += 1;
        }
        entries.push(Entry { series: i, x, row });
        x += needed;
    }
    entries
}

fn draw_legend(out: &mut Svg, panel: &Panel, legend: &[Entry], top: f64) {
    let rows = legend.last().map_or(0, |l| l.row);
    let base = |row: usize| top - 10.0 - (rows - row) as f64 * LEGEND_ROW;
    let heading = panel.y.heading();
    let left = legend.iter().find(|e| e.row == 0).map_or(0.0, |e| e.x);
    // The heading stands where the legend left room for it.
    let heading_left = left - (text_width(&heading, 13.0, false) * 1.06 + 22.0);
    let heading_left = if legend.is_empty() { 44.0 } else { heading_left };
    out.text((heading_left, base(0)), 13.0, Anchor::Start, svg::INK, "", &heading);
    for entry in legend {
        let series = &panel.series[entry.series];
        let y = base(entry.row) - 4.3;
        let paint = series.colour.paint();
        match series.style {
            Style::Points => out.circle((entry.x + 10.0, y), 2.6, paint, paint, 0.0),
            style => out.path(&format!("M{} {}h20", n(entry.x), n(y)), paint, 2.0, dash(style)),
        }
        out.text((entry.x + 26.0, base(entry.row)), 12.5, Anchor::Start, svg::INK, "", &series.name);
    }
}

/// Vertical lines; their labels stand above the first panel, each ending where the next begins.
fn markers(
    out: &mut Svg,
    figure: &Figure,
    labelled: bool,
    across: &dyn Fn(f64) -> f64,
    (left, right): (f64, f64),
    (top, height): (f64, f64),
) {
    let mut sorted: Vec<_> = figure.verticals.iter().filter(|m| m.at.is_finite()).collect();
    sorted.sort_by(|a, b| a.at.total_cmp(&b.at));
    let mut free = left - 20.0;
    for Marker { at, label } in sorted {
        let at = across(at * figure.x.factor);
        dashed(out, (at, top), (at, top + height));
        let wide = text_width(label, 12.0, false);
        let start = (at - wide / 2.0).clamp(left, (right - wide).max(left));
        if labelled && start >= free {
            out.text((start, top - 5.0), 12.0, Anchor::Start, svg::MARK, "", label);
            free = start + wide + 8.0;
        }
    }
}

fn dashed(out: &mut Svg, from: (f64, f64), to: (f64, f64)) {
    let d = format!("M{} {}L{} {}", n(from.0), n(from.1), n(to.0), n(to.1));
    out.path(&d, svg::MARK, 1.1, " stroke-dasharray=\"1.5 3\"");
}

fn dash(style: Style) -> &'static str {
    match style {
        Style::Solid | Style::Points => "",
        Style::Dashed => " stroke-dasharray=\"7 4\"",
        Style::Dotted => " stroke-dasharray=\"0.1 4\" stroke-linecap=\"round\"",
    }
}

fn curve(
    out: &mut Svg,
    series: &Series,
    (fx, fy): (f64, f64),
    (sx, sy): (&Scale, &Scale),
    across: &dyn Fn(f64) -> f64,
    up: &dyn Fn(f64) -> f64,
    width: f64,
) {
    let (x, y) = decimate(&series.x, &series.y, 4 * width as usize);
    let paint = series.colour.paint();
    let points = x.iter().zip(&y).map(|(&x, &y)| {
        let (x, y) = (x * fx, y * fy);
        // The scales cover all that is shown, so nothing needs to be clipped.
        let shown = in_range(x) && in_range(y) && (!sx.log || x > 0.0) && (!sy.log || y > 0.0);
        shown.then(|| (across(x), up(y)))
    });
    let points: Vec<Option<(f64, f64)>> = points.collect();
    let mut d = String::new();
    if series.style == Style::Points {
        for (x, y) in points.into_iter().flatten() {
            let _ = write!(d, "M{} {}h0", n1(x), n1(y));
        }
        out.path(&d, paint, 4.4, " stroke-linecap=\"round\"");
        return;
    }
    for run in points.split(Option::is_none).filter(|run| !run.is_empty()) {
        let run: Vec<(f64, f64)> = run.iter().flatten().copied().collect();
        for (i, (x, y)) in thin(&run).into_iter().enumerate() {
            let _ = write!(d, "{}{} {}", if i == 0 { "M" } else { "L" }, n1(x), n1(y));
        }
        if run.len() == 1 {
            d.push_str("h0");
        }
    }
    let ends = if series.style == Style::Solid { " stroke-linecap=\"round\"" } else { "" };
    out.path(&d, paint, 1.8, &format!("{}{ends}", dash(series.style)));
}

/// A coordinate of a curve, to a tenth of a pixel.
fn n1(value: f64) -> String {
    n((value.clamp(-1e6, 1e6) * 10.0).round() / 10.0)
}

/// Leaves out the points that lie within 0.06 pixels of the line between their neighbours (Douglas and Peucker).
fn thin(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() < 3 {
        return points.to_vec();
    }
    let mut keep = vec![false; points.len()];
    keep[0] = true;
    keep[points.len() - 1] = true;
    let mut open = vec![(0, points.len() - 1)];
    while let Some((a, b)) = open.pop() {
        let ((ax, ay), (bx, by)) = (points[a], points[b]);
        let (dx, dy) = (bx - ax, by - ay);
        let length = dx.hypot(dy);
        let mut far = (0.06, None);
        for (i, (x, y)) in points.iter().enumerate().take(b).skip(a + 1) {
            let distance =
                if length > 0.0 { ((x - ax) * dy - (y - ay) * dx).abs() / length } else { (x - ax).hypot(y - ay) };
            if distance > far.0 {
                far = (distance, Some(i));
            }
        }
        if let Some(i) = far.1 {
            keep[i] = true;
            open.push((a, i));
            open.push((i, b));
        }
    }
    points.iter().zip(keep).filter(|(_, keep)| *keep).map(|(p, _)| *p).collect()
}
