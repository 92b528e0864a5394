//! A figure's data as `plot.js` reads them, and curves for `live.js`: exact enough to zoom by a million, small enough
//! for twenty plots.

use super::decimate::decimate;
use super::figure::{Axis, Figure, Marker, Panel, Series, Style};
use super::layout::{Layout, ratio, scales};
use super::svg::{self, Colour};
use std::fmt::Write;

/// Points of one unevenly spaced curve that a page carries; longer curves are decimated.
const LIMIT: usize = 6000;

/// Points of an evenly spaced curve: without places they weigh half.
const EVEN_LIMIT: usize = 2 * LIMIT;

/// Widths in pixels for which a page has places; between two of them the plot areas of the narrower one are stretched.
const WIDTHS: [f64; 4] = [300.0, 420.0, 560.0, 740.0];

/// The figure as JSON that may stand in a script element.
///
/// Curves share arrays. An evenly spaced array is its start and step; any other is its least value,
/// a unit of 2⁻³² of its range, and 32-bit counts in base64: 5.3 characters a number, and a position
/// of 0.05 m is known to 12 picometres.
pub(crate) fn json(figure: &Figure) -> String {
    let (x, ys) = scales(figure);
    let mut arrays = Arrays::default();
    let panels: Vec<String> = figure
        .panels
        .iter()
        .zip(&ys)
        .map(|(panel, y)| {
            let series: Vec<String> = panel.series.iter().map(|s| series(s, figure, panel, &mut arrays)).collect();
            format!(
                "{{{},\"range\":[{},{}],\"marks\":{},\"series\":[{}]}}",
                axis(&panel.y, y.degrees),
                number(y.lo),
                number(y.hi),
                marks(&panel.horizontals, panel.y.factor),
                series.join(",")
            )
        })
        .collect();
    let layouts = WIDTHS.map(|width| layout(&Layout::new(figure, (&x, &ys), width, 8.0)));
    format!(
        "{{\"x\":{{{},\"range\":[{},{}]}},\"ratio\":{},\"part\":{},\"marks\":{},\"panels\":[{}],\"layouts\":[{}],\"arrays\":[{}]}}",
        axis(&figure.x, x.degrees),
        number(x.lo),
        number(x.hi),
        number(ratio(figure, &x, &ys).unwrap_or(f64::NAN)),
        figure.view.is_some(),
        marks(&figure.verticals, figure.x.factor),
        panels.join(","),
        layouts.join(","),
        arrays.joined()
    )
}

/// One curve; where it is thinned, from how many samples.
fn series(s: &Series, figure: &Figure, panel: &Panel, arrays: &mut Arrays) -> String {
    let samples = s.x.len().min(s.y.len());
    let even = samples <= EVEN_LIMIT && spacing(&s.x[..samples]).is_some();
    let (xs, ys) = decimate(&s.x, &s.y, if even { EVEN_LIMIT } else { LIMIT });
    let style = match s.style {
        Style::Solid => "solid",
        Style::Dashed => "dashed",
        Style::Dotted => "dotted",
        Style::Points => "points",
        Style::Crosses => "crosses",
        Style::Rings => "rings",
    };
    let all = samples.max(s.thinned_from);
    let of = if all > xs.len() { format!(",\"of\":{all}") } else { String::new() };
    format!(
        "{{\"name\":{},\"x\":{},\"y\":{},\"style\":\"{style}\",\"colour\":\"{}\"{of}}}",
        text(&s.name),
        arrays.index(xs, figure.x.factor),
        arrays.index(ys, panel.y.factor),
        colour(s.colour)
    )
}

/// The places of one width. Lengths go to a tenth of a pixel, ticks as value and text, entries of a legend as number of
/// the series, left end, base line, width and name.
fn layout(layout: &Layout) -> String {
    let pixels = |v: f64| svg::n((10.0 * v).round() / 10.0);
    let ticks = |ticks: &[(f64, String)]| -> String {
        ticks.iter().map(|(v, t)| format!("[{},{}]", number(*v), text(t))).collect::<Vec<_>>().join(",")
    };
    let panels = layout.panels.iter().map(|place| {
        let legend = place
            .legend
            .iter()
            .map(|e| format!("[{},{},{},{},{}]", e.series, pixels(e.x), pixels(e.y), pixels(e.width), text(&e.name)));
        format!(
            "{{\"top\":{},\"height\":{},\"heading\":{},\"ticks\":[{}],\"legend\":[{}]}}",
            pixels(place.top),
            pixels(place.height),
            pixels(place.heading),
            ticks(&place.ticks),
            legend.collect::<Vec<_>>().join(",")
        )
    });
    format!(
        "{{\"width\":{},\"height\":{},\"left\":{},\"ticks\":[{}],\"panels\":[{}]}}",
        layout.width,
        pixels(layout.height),
        pixels(layout.left),
        ticks(&layout.x_ticks),
        panels.collect::<Vec<_>>().join(",")
    )
}

fn axis(axis: &Axis, degrees: bool) -> String {
    let (label, unit, heading) = (text(&axis.label), text(&axis.unit), text(&axis.heading()));
    format!("\"label\":{label},\"unit\":{unit},\"heading\":{heading},\"log\":{},\"degrees\":{degrees}", axis.log)
}

fn marks(markers: &[Marker], factor: f64) -> String {
    let mut sorted: Vec<_> = markers.iter().filter(|m| m.at.is_finite()).collect();
    sorted.sort_by(|a, b| a.at.total_cmp(&b.at));
    let items = sorted.iter().map(|m| format!("{{\"at\":{},\"label\":{}}}", number(m.at * factor), text(&m.label)));
    format!("[{}]", items.collect::<Vec<_>>().join(","))
}

fn colour(colour: Colour) -> &'static str {
    colour.paint().class
}

/// The arrays of one figure or machine, each once.
#[derive(Default)]
pub(crate) struct Arrays {
    done: Vec<(Vec<f64>, String)>,
}

impl Arrays {
    /// All of them, separated by commas.
    pub(crate) fn joined(&self) -> String {
        self.done.iter().map(|(_, text)| text.as_str()).collect::<Vec<_>>().join(",")
    }

    /// The number of the array of these values, each multiplied by `factor`.
    pub(crate) fn index(&mut self, values: Vec<f64>, factor: f64) -> usize {
        let values: Vec<f64> = values.into_iter().map(|v| v * factor).collect();
        let same =
            |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        if let Some(i) = self.done.iter().position(|(known, _)| same(known, &values)) {
            return i;
        }
        let text = encode(&values);
        self.done.push((values, text));
        self.done.len() - 1
    }
}

fn encode(values: &[f64]) -> String {
    let n = values.len();
    if let Some(step) = spacing(values) {
        return format!("{{\"n\":{n},\"o\":{},\"s\":{}}}", number(values[0]), number(step));
    }
    let (lo, hi) = least_and_greatest(values);
    const TOP: f64 = 4294967294.0; // the value above is the gap
    let unit = if lo <= hi { (hi / (TOP - 1.0) - lo / (TOP - 1.0)).max(f64::MIN_POSITIVE) } else { 1.0 };
    // Zero among the values is a multiple of the unit away, so that it reads back as zero.
    let lo = if lo > hi {
        0.0
    } else if lo < 0.0 && hi >= 0.0 {
        -(-lo / unit).ceil() * unit
    } else {
        lo
    };
    let bytes: Vec<u8> = values
        .iter()
        .flat_map(|v| {
            let count = if v.is_finite() { ((v - lo) / unit).round().clamp(0.0, TOP) as u32 } else { u32::MAX };
            count.to_le_bytes()
        })
        .collect();
    format!("{{\"n\":{n},\"o\":{},\"s\":{},\"d\":\"{}\"}}", number(lo), number(unit), base64(&bytes))
}

/// The step from each value to the next, if it is the same everywhere.
pub(crate) fn spacing(values: &[f64]) -> Option<f64> {
    let (lo, hi) = least_and_greatest(values);
    let (first, last) = (*values.first()?, *values.last()?);
    let step = if values.len() > 1 { (last - first) / (values.len() - 1) as f64 } else { 0.0 };
    let even = |(i, v): (usize, &f64)| (first + i as f64 * step - v).abs() <= 1e-12 * (hi - lo);
    values.iter().enumerate().all(even).then_some(step)
}

fn least_and_greatest(values: &[f64]) -> (f64, f64) {
    let finite = values.iter().filter(|v| v.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &v| (lo.min(v), hi.max(v)))
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word = chunk.iter().fold(0u32, |w, &b| w << 8 | u32::from(b)) << (8 * (3 - chunk.len()));
        for k in 0..4 {
            out.push(if k <= chunk.len() { DIGITS[(word >> (18 - 6 * k)) as usize & 63] as char } else { '=' });
        }
    }
    out
}

/// A number that JSON can carry; it reads back to the same bits.
fn number(value: f64) -> String {
    if value.is_finite() { format!("{value:e}") } else { "null".into() }
}

/// A JSON string that cannot end the script element it stands in.
fn text(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' | '<' | '>' | '&' | '\u{2028}' | '\u{2029}' | '\0'..='\x1f' => {
                let _ = write!(out, "\\u{:04x}", c as u32);
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_as_the_standard_says() {
        let cases =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("fooba", "Zm9vYmE=")];
        for (plain, coded) in cases {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn even_times_cost_nothing() {
        let t: Vec<f64> = (0..1001).map(|i| f64::from(i) * 1e-3).collect();
        assert!(encode(&t).len() < 60);
        assert!(encode(&[1.0, f64::NAN]).contains("\"d\""));
    }

    /// A force of nothing was shown as 10⁻¹⁰ N.
    #[test]
    fn zero_reads_back_as_zero() {
        for values in [[-0.3, 0.0, 17.0], [-1e-7, 0.0, 3e5], [-5.0, -2.0, 0.0], [0.0, 0.1, 7.7]] {
            let text = encode(&values);
            let number = |key: &str| -> f64 {
                let rest = text.split(&format!("\"{key}\":")).nth(1).unwrap();
                rest.split([',', '}']).next().unwrap().parse().unwrap()
            };
            let (start, unit) = (number("o"), number("s"));
            let count = (-start / unit).round();
            assert_eq!(start + count * unit, 0.0, "{text}");
            assert!((start - values[0]).abs() <= unit && start + 4294967294.0 * unit >= values[2] - unit, "{text}");
        }
    }
}
