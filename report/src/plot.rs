//! A figure as SVG. `plot.js` draws the same on a page after a zoom; keep the two alike.

use super::axis::{Scale, in_range};
use super::decimate::decimate;
use super::figure::{Figure, Marker, Series, Style};
use super::layout::{Layout, PanelPlace, RIGHT, scales, within};
use super::svg::{self, Anchor, Svg, n, text_width};
use std::fmt::Write;

const WIDTH: f64 = 760.0;

impl Figure {
    /// The figure as an SVG file with its title, light and dark.
    pub fn svg(&self) -> String {
        svg(self, true)
    }
}

/// The whole picture, with the title in it or without.
pub(crate) fn svg(figure: &Figure, with_title: bool) -> String {
    let (x, ys) = scales(figure);
    let titled = with_title && !figure.title.is_empty();
    let layout = Layout::new(figure, (&x, &ys), WIDTH, if titled { 40.0 } else { 8.0 });
    let (left, width) = (layout.left, layout.wide);
    let mut out = Svg::new(WIDTH, layout.height);
    out.margin = if with_title { 12.0 } else { 0.0 };
    if titled {
        let title = svg::fit(&figure.title, 15.5, width);
        out.text((left, 20.0), 15.0, Anchor::Start, svg::INK, " font-weight=\"600\"", &title);
    }
    let across = |v: f64| left + width * x.place(v);
    for (i, ((panel, y), place)) in figure.panels.iter().zip(&ys).zip(&layout.panels).enumerate() {
        let &PanelPlace { top, height, ref ticks, heading, .. } = place;
        let up = |v: f64| top + height * (1.0 - y.place(v));
        out.text((left, heading), 13.0, Anchor::Start, svg::INK, "", &panel.y.heading());
        legend(&mut out, &panel.series, place);
        for (v, text) in ticks {
            let at = up(*v);
            out.line((left, at), (left + width, at), svg::GRID, 1.0);
            out.text((left - 8.0, at + 4.2), 12.0, Anchor::End, svg::GREY, "", text);
        }
        for (v, _) in &layout.x_ticks {
            out.line((across(*v), top), (across(*v), top + height), svg::GRID, 1.0);
        }
        markers(&mut out, figure, i == 0, &across, (&x, left, left + width), (top, height));
        // Curves end at the frame where only a part of them is shown.
        let clipped = figure.view.is_some();
        if clipped {
            out.open_window((left, top - 2.0), (width, height + 4.0));
        }
        for series in &panel.series {
            curve(&mut out, series, (figure.x.factor, panel.y.factor), (&x, y), &across, &up, width);
        }
        if clipped {
            out.close_window();
        }
        for Marker { at, label } in &panel.horizontals {
            let at = up(at * panel.y.factor);
            dashed(&mut out, (left, at), (left + width, at));
            // Above its line, unless the frame is too near.
            let base = if at - top < 16.0 { at + 14.0 } else { at - 5.0 };
            out.text((left + width - 4.0, base), 12.0, Anchor::End, svg::MARK, "", label);
        }
        out.line((left, top + height), (left + width, top + height), svg::AXIS, 1.2);
    }
    if let Some(last) = layout.panels.last() {
        x_axis(&mut out, figure, &layout, &across, last.top + last.height);
    }
    out.finish(if figure.title.is_empty() { "Figure" } else { &figure.title })
}

/// Ticks and heading below the last panel.
fn x_axis(out: &mut Svg, figure: &Figure, layout: &Layout, across: &dyn Fn(f64) -> f64, bottom: f64) {
    for (v, text) in &layout.x_ticks {
        let at = across(*v);
        out.line((at, bottom), (at, bottom + 4.0), svg::AXIS, 1.2);
        let wide = text_width(text, 12.0, false);
        let middle = within(at, wide, layout.width) + 0.5 * wide;
        out.text((middle, bottom + 18.0), 12.0, Anchor::Middle, svg::GREY, "", text);
    }
    let middle = layout.left + layout.wide / 2.0;
    out.text((middle, bottom + 38.0), 13.0, Anchor::Middle, svg::INK, "", &figure.x.heading());
}

fn legend(out: &mut Svg, series: &[Series], place: &PanelPlace) {
    for entry in &place.legend {
        let &Series { style, colour, .. } = &series[entry.series];
        let (y, paint) = (entry.y - 4.3, colour.paint());
        if style.is_symbol() {
            symbols(out, style, &[(entry.x + 10.0, y)], paint);
        } else {
            out.path(&format!("M{} {}h20", n(entry.x), n(y)), paint, 2.0, dash(style));
        }
        out.text((entry.x + 26.0, entry.y), 12.5, Anchor::Start, svg::INK, "", &entry.name);
    }
}

/// Vertical lines; their labels stand above the first panel, each ending where the next begins.
fn markers(
    out: &mut Svg,
    figure: &Figure,
    labelled: bool,
    across: &dyn Fn(f64) -> f64,
    (scale, left, right): (&Scale, f64, f64),
    (top, height): (f64, f64),
) {
    let shown = |at: f64| at.is_finite() && (-1e-6..=1.0 + 1e-6).contains(&scale.place(at * figure.x.factor));
    let mut sorted: Vec<_> = figure.verticals.iter().filter(|m| shown(m.at)).collect();
    sorted.sort_by(|a, b| a.at.total_cmp(&b.at));
    let mut free = left - 20.0;
    for Marker { at, label } in sorted {
        let at = across(at * figure.x.factor);
        dashed(out, (at, top), (at, top + height));
        let wide = text_width(label, 12.0, false);
        let start = (at - wide / 2.0).clamp(left, (right + RIGHT - 2.0 - wide).max(left));
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
        Style::Solid | Style::Points | Style::Crosses | Style::Rings => "",
        Style::Dashed => " stroke-dasharray=\"7 4\"",
        Style::Dotted => " stroke-dasharray=\"0.1 4\" stroke-linecap=\"round\"",
    }
}

/// Points by themselves, as one path; of a curve they are drawn as strokes, so that thousands weigh little.
fn symbols(out: &mut Svg, style: Style, points: &[(f64, f64)], paint: &svg::Paint) {
    let mut d = String::new();
    for (x, y) in points {
        let (x, y) = (n1(*x), n1(*y));
        let _ = match style {
            Style::Crosses => write!(d, "M{x} {y}m-4-4l8 8m0-8l-8 8"),
            Style::Rings => write!(d, "M{x} {y}m-4 0a4 4 0 1 0 8 0a4 4 0 1 0-8 0"),
            Style::Points | Style::Solid | Style::Dashed | Style::Dotted => write!(d, "M{x} {y}h0"),
        };
    }
    let width = if matches!(style, Style::Crosses | Style::Rings) { 1.6 } else { 4.4 };
    out.path(&d, paint, width, " stroke-linecap=\"round\"");
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
        let shown = in_range(x) && in_range(y) && (!sx.log || x > 0.0) && (!sy.log || y > 0.0);
        shown.then(|| (across(x), up(y)))
    });
    let points: Vec<Option<(f64, f64)>> = points.collect();
    if series.style.is_symbol() {
        let points: Vec<(f64, f64)> = points.into_iter().flatten().collect();
        symbols(out, series.style, &points, paint);
        return;
    }
    let mut d = String::new();
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
