//! A figure together with the columns from which it is drawn.

use taut_report::{Axis, Colour, Figure, Panel, Series, Style};

/// A figure, its file's name, and its data in SI units.
pub struct Plot {
    /// File name without ending: `figure-04`.
    pub file: String,
    /// The picture.
    pub figure: Figure,
    /// Headings and values, the common x first.
    pub columns: Vec<(String, Vec<f64>)>,
    /// How many rows are drawn; the file of data has all.
    pub shown: usize,
}

/// One curve of a plot.
pub struct Curve<'a> {
    /// In the legend; empty for none.
    pub name: String,
    /// In the file of data, with the unit.
    pub heading: String,
    /// SI.
    pub values: &'a [f64],
    /// How.
    pub style: Style,
    /// Which colour.
    pub colour: Colour,
}

impl<'a> Curve<'a> {
    /// A solid line.
    pub fn new(name: impl Into<String>, heading: impl Into<String>, values: &'a [f64], colour: Colour) -> Self {
        Self { name: name.into(), heading: heading.into(), values, style: Style::Solid, colour }
    }

    /// Another style.
    pub fn style(mut self, style: Style) -> Self {
        self.style = style;
        self
    }
}

impl Plot {
    /// A plot without panels.
    pub fn new(file: impl Into<String>, title: impl Into<String>, x: Axis, heading: &str, values: &[f64]) -> Self {
        Self {
            file: file.into(),
            figure: Figure::new(title, x),
            columns: vec![(heading.into(), values.to_vec())],
            shown: values.len(),
        }
    }

    /// Draws only up to this x.
    pub fn up_to(mut self, x: f64) -> Self {
        self.shown = self.columns[0].1.iter().take_while(|v| **v <= x).count();
        self
    }

    /// Adds a panel with its curves.
    pub fn panel(mut self, y: Axis, weight: f64, curves: Vec<Curve<'_>>) -> Self {
        let mut panel = Panel::new(y).weight(weight);
        for curve in curves {
            let x = &self.columns[0].1[..self.shown];
            let series =
                Series::new(curve.name, x, &curve.values[..self.shown]).style(curve.style).colour(curve.colour);
            panel = panel.series(series);
            self.columns.push((curve.heading, curve.values.to_vec()));
        }
        self.figure = self.figure.panel(panel);
        self
    }

    /// Says what there is to see.
    pub fn caption(mut self, text: impl Into<String>) -> Self {
        self.figure = self.figure.caption(text);
        self
    }

    /// A vertical line.
    pub fn vertical(mut self, at: f64, label: &str) -> Self {
        self.figure = self.figure.vertical(at, label);
        self
    }

    /// The data as CSV: numbers that read back to the same bits, nothing where there is no number.
    pub fn csv(&self) -> String {
        use std::fmt::Write;
        let headings: Vec<&str> = self.columns.iter().map(|(heading, _)| heading.as_str()).collect();
        let mut out = headings.join(",") + "\n";
        for row in 0..self.columns[0].1.len() {
            for (i, (_, values)) in self.columns.iter().enumerate() {
                let comma = if i == 0 { "" } else { "," };
                match values.get(row) {
                    Some(v) if v.is_finite() => write!(out, "{comma}{v}"),
                    _ => write!(out, "{comma}"),
                }
                .expect("a string takes everything");
            }
            out.push('\n');
        }
        out
    }
}
