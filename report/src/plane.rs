//! A plane at one scale: the path of a cart, a map of what changes from place to place.

use super::axis::Scale;
use super::figure::{Axis, Series};
use super::svg::{self, Anchor, Svg, n};
use std::fmt::Write;

/// Largest size of the plot area, pixels.
const AREA: (f64, f64) = (620.0, 460.0);

/// The shorter side is at least this share of the longer one.
const SLIMMEST: f64 = 0.3;

/// Paths and a map in a plane, both of whose ways are lengths at one scale.
///
/// ```
/// use taut_report::{Axis, Plane, Series};
/// let ways = || (Axis::new("Cart y", "m").shown_as("mm", 1e3), Axis::new("Bridge x", "m").shown_as("mm", 1e3));
/// let (across, up) = ways();
/// let plane = Plane::new("The way of the cart", across, up).path(Series::new("", vec![0.0, 0.1], vec![0.0, 0.05]));
/// assert!(plane.svg().starts_with("<svg"));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Plane {
    /// Stands above it.
    pub title: String,
    /// The caption.
    pub caption: String,
    /// The axis to the right, and the one upward.
    axes: [Axis; 2],
    paths: Vec<Series>,
    map: Option<Map>,
    bounds: Option<[(f64, f64); 2]>,
}

/// Values over a grid of places.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// The quantity that is shown.
    pub value: Axis,
    /// Places to the right, rising.
    pub across: Vec<f64>,
    /// Places upward, rising.
    pub up: Vec<f64>,
    /// Values by place upward, then by place to the right.
    pub values: Vec<Vec<f64>>,
}

/// From the least value to the greatest: light enough everywhere for dark lines on it.
const COLOURS: [[f64; 3]; 5] =
    [[250.0, 244.0, 203.0], [190.0, 226.0, 190.0], [126.0, 200.0, 196.0], [92.0, 168.0, 207.0], [104.0, 140.0, 200.0]];

/// Dark lines on the map, in light and dark.
const LINE: &str = "#20262c";

impl Plane {
    /// An empty plane.
    pub fn new(title: impl Into<String>, across: Axis, up: Axis) -> Self {
        let (caption, axes) = (String::new(), [across, up]);
        Self { title: title.into(), caption, axes, paths: Vec::new(), map: None, bounds: None }
    }

    /// Sets the caption.
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = caption.into();
        self
    }

    /// Adds a path.
    pub fn path(mut self, path: Series) -> Self {
        self.paths.push(path);
        self
    }

    /// Shows values in colours.
    pub fn map(mut self, map: Map) -> Self {
        self.map = Some(map);
        self
    }

    /// Draws the rectangle that may be gone to.
    pub fn bounds(mut self, across: (f64, f64), up: (f64, f64)) -> Self {
        self.bounds = Some([across, up]);
        self
    }

    /// The picture as an SVG file with its title, light and dark.
    pub fn svg(&self) -> String {
        self.draw(true)
    }

    /// The plane without its title, for a page that has one.
    pub(super) fn bare(&self) -> String {
        self.draw(false)
    }

    /// Scales in shown units, and the size of the plot area at one scale.
    fn scales(&self) -> ([Scale; 2], (f64, f64)) {
        let [across, up] = &self.axes;
        let tight = self.map.is_some();
        let ends = |way: usize| self.bounds.map(|bounds| [bounds[way].0, bounds[way].1]).into_iter().flatten();
        let grid = |map: &Map, way: usize| if way == 0 { map.across.clone() } else { map.up.clone() };
        let of = |way: usize, values: fn(&Series) -> &Vec<f64>, factor: f64| {
            let paths = self.paths.iter().flat_map(values).copied();
            let map = self.map.iter().flat_map(|map| grid(map, way));
            Scale::covering(paths.chain(map).chain(ends(way)).map(|v| v * factor), false, tight)
        };
        let mut scales = [of(0, |s| &s.x, across.factor), of(1, |s| &s.y, up.factor)];
        // In one unit
        let factors = [across.factor, up.factor];
        let lengths = [0, 1].map(|k| (scales[k].hi - scales[k].lo) / factors[k]);
        let longest = lengths[0].max(lengths[1]);
        for k in 0..2 {
            let missing = (SLIMMEST * longest - lengths[k]).max(0.0) * factors[k];
            (scales[k].lo, scales[k].hi) = (scales[k].lo - 0.5 * missing, scales[k].hi + 0.5 * missing);
        }
        let lengths = lengths.map(|length| length.max(SLIMMEST * longest));
        let per = (AREA.0 / lengths[0]).min(AREA.1 / lengths[1]);
        (scales, (lengths[0] * per, lengths[1] * per))
    }

    fn draw(&self, with_title: bool) -> String {
        let ([sx, sy], (wide, high)) = self.scales();
        let left = 76.0;
        let top = if with_title && !self.title.is_empty() { 64.0 } else { 32.0 };
        let mut out = Svg::new(760.0, top + high + 52.0);
        out.margin = if with_title { 12.0 } else { 0.0 };
        if with_title && !self.title.is_empty() {
            let title = svg::fit(&self.title, 15.5, 700.0);
            out.text((left, 20.0), 15.0, Anchor::Start, svg::INK, " font-weight=\"600\"", &title);
        }
        let across = |v: f64| left + wide * sx.place(v);
        let up = |v: f64| top + high * (1.0 - sy.place(v));
        let [x_axis, y_axis] = &self.axes;
        if let Some(map) = &self.map {
            map.draw(&mut out, (x_axis.factor, y_axis.factor), &across, &up, (left + wide + 26.0, top, high));
        }
        for (v, text) in sx.ticks((wide / 80.0).round() as usize) {
            let at = across(v);
            if self.map.is_none() {
                out.line((at, top), (at, top + high), svg::GRID, 1.0);
            }
            out.line((at, top + high), (at, top + high + 4.0), svg::AXIS, 1.2);
            out.text((at, top + high + 18.0), 12.0, Anchor::Middle, svg::GREY, "", &text);
        }
        for (v, text) in sy.ticks((high / 50.0).round() as usize) {
            let at = up(v);
            if self.map.is_none() {
                out.line((left, at), (left + wide, at), svg::GRID, 1.0);
            }
            out.text((left - 8.0, at + 4.2), 12.0, Anchor::End, svg::GREY, "", &text);
        }
        if let Some([(x0, x1), (y0, y1)]) = self.bounds {
            let [x0, x1, y0, y1] = [
                across(x0 * x_axis.factor),
                across(x1 * x_axis.factor),
                up(y0 * y_axis.factor),
                up(y1 * y_axis.factor),
            ];
            let d = format!("M{} {}H{}V{}H{}Z", n(x0), n(y0), n(x1), n(y1), n(x0));
            out.path(&d, svg::MARK, 1.1, " stroke-dasharray=\"1.5 3\"");
        }
        for path in &self.paths {
            let points: Vec<(f64, f64)> = path
                .x
                .iter()
                .zip(&path.y)
                .filter(|(x, y)| x.is_finite() && y.is_finite())
                .map(|(x, y)| (across(x * x_axis.factor), up(y * y_axis.factor)))
                .collect();
            let mut d = String::new();
            for (i, (x, y)) in points.iter().enumerate() {
                let _ = write!(d, "{}{} {}", if i == 0 { "M" } else { "L" }, n(*x), n(*y));
            }
            let paint = path.colour.paint();
            out.path(&d, paint, 1.8, " stroke-linecap=\"round\"");
            // Where it begins, and where it ends.
            if let (Some(first), Some(last)) = (points.first(), points.last()) {
                out.circle(*first, 4.5, svg::PAPER, paint, 1.8);
                out.circle(*last, 4.5, paint, paint, 1.8);
            }
        }
        out.line((left, top + high), (left + wide, top + high), svg::AXIS, 1.2);
        out.line((left, top), (left, top + high), svg::AXIS, 1.2);
        out.text((left + wide / 2.0, top + high + 38.0), 13.0, Anchor::Middle, svg::INK, "", &x_axis.heading());
        out.text((left - 44.0, top - 12.0), 13.0, Anchor::Start, svg::INK, "", &y_axis.heading());
        out.finish(if self.title.is_empty() { "A plane" } else { &self.title })
    }
}

impl Map {
    fn draw(
        &self,
        out: &mut Svg,
        (fx, fy): (f64, f64),
        across: &dyn Fn(f64) -> f64,
        up: &dyn Fn(f64) -> f64,
        bar: (f64, f64, f64),
    ) {
        let shown = || self.values.iter().flatten().map(|v| v * self.value.factor);
        let scale = Scale::covering(shown(), false, true);
        let edges = |places: &[f64]| -> Vec<(f64, f64)> {
            let middle = |k: usize| 0.5 * (places[k] + places[k + 1]);
            let last = places.len() - 1;
            (0..=last)
                .map(|k| {
                    (if k == 0 { places[0] } else { middle(k - 1) }, if k == last { places[last] } else { middle(k) })
                })
                .collect()
        };
        let (columns, rows) = (edges(&self.across), edges(&self.up));
        for ((low, high), values) in rows.iter().zip(&self.values) {
            for ((left, right), value) in columns.iter().zip(values) {
                let (x0, x1) = (across(left * fx), across(right * fx));
                let (y0, y1) = (up(high * fy), up(low * fy));
                out.cell((x0, y0), (x1 - x0, y1 - y0), &colour(scale.place(value * self.value.factor)));
            }
        }
        let levels = scale.ticks(7);
        for (level, _) in &levels {
            out.stroke(&self.contour(level / self.value.factor, (fx, fy), across, up), LINE, 0.9);
        }
        // The scale of colours
        let (x, top, high) = bar;
        const STEPS: usize = 48;
        for k in 0..STEPS {
            let y = top + high * (1.0 - (k + 1) as f64 / STEPS as f64);
            out.cell((x, y), (14.0, high / STEPS as f64 + 0.5), &colour((k as f64 + 0.5) / STEPS as f64));
        }
        for (level, text) in &levels {
            let y = top + high * (1.0 - scale.place(*level));
            out.stroke(&format!("M{} {}h14", n(x), n(y)), LINE, 0.9);
            out.text((x + 20.0, y + 4.2), 12.0, Anchor::Start, svg::GREY, "", text);
        }
        out.text((x, top - 12.0), 13.0, Anchor::Start, svg::INK, "", &self.value.heading());
    }

    /// Where the values are `level`: in each cell of the grid straight lines between the sides that it crosses.
    fn contour(
        &self,
        level: f64,
        (fx, fy): (f64, f64),
        across: &dyn Fn(f64) -> f64,
        up: &dyn Fn(f64) -> f64,
    ) -> String {
        let mut d = String::new();
        for (j, rows) in self.values.windows(2).enumerate() {
            for i in 0..self.across.len() - 1 {
                // Corners in turn: place and value.
                let corner = |(i, j): (usize, usize), value: f64| (self.across[i], self.up[j], value - level);
                let corners = [
                    corner((i, j), rows[0][i]),
                    corner((i + 1, j), rows[0][i + 1]),
                    corner((i + 1, j + 1), rows[1][i + 1]),
                    corner((i, j + 1), rows[1][i]),
                ];
                let mut crossings = Vec::new();
                for k in 0..4 {
                    let ((x0, y0, a), (x1, y1, b)) = (corners[k], corners[(k + 1) % 4]);
                    if (a < 0.0) != (b < 0.0) {
                        let s = a / (a - b);
                        crossings.push((x0 + s * (x1 - x0), y0 + s * (y1 - y0)));
                    }
                }
                for pair in crossings.chunks_exact(2) {
                    for (k, (x, y)) in pair.iter().enumerate() {
                        let _ = write!(d, "{}{} {}", if k == 0 { "M" } else { "L" }, n(across(x * fx)), n(up(y * fy)));
                    }
                }
            }
        }
        d
    }
}

/// The colour at a share of the scale.
fn colour(share: f64) -> String {
    let along = share.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let k = (along as usize).min(COLOURS.len() - 2);
    let s = along - k as f64;
    let [r, g, b] = [0, 1, 2].map(|c| ((1.0 - s) * COLOURS[k][c] + s * COLOURS[k + 1][c]).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}
