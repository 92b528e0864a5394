//! A figure as data, said once for SVG, PNG and the page.

use super::svg::Colour;

/// One or more panels above a common x axis.
///
/// ```
/// use taut_report::{Axis, Figure, Panel};
/// let (time, position) = ([0.0, 0.1, 0.2], [0.0, 0.01, 0.03]);
/// let figure = Figure::new("Cart", Axis::new("Time", "s"))
///     .panel(Panel::new(Axis::new("Position", "m").shown_as("mm", 1e3)).line("x", &time, &position))
///     .vertical(0.15, "voltage off");
/// assert!(figure.svg().starts_with("<svg"));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Stands above the figure.
    pub title: String,
    /// The caption: stands below the figure on a page.
    pub caption: String,
    /// The x axis, usually time.
    pub x: Axis,
    /// From top to bottom.
    pub panels: Vec<Panel>,
    /// Vertical lines through all panels: "voltage off".
    pub verticals: Vec<Marker>,
    /// True if a unit is as long upward as to the right, as a circle needs it; of figures with one panel.
    pub equal: bool,
    /// The part of the x axis that is shown first, in the units of the data; the rest is reached by zooming out.
    pub view: Option<(f64, f64)>,
}

/// The quantity and the scale of an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The quantity: `Position`.
    pub label: String,
    /// The unit that is shown: `mm`; empty for a pure number.
    pub unit: String,
    /// Shown units per unit of the data.
    pub factor: f64,
    /// Logarithmic; values that are not positive are left out.
    pub log: bool,
}

/// A plot area with its own y axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// The y axis.
    pub y: Axis,
    /// The curves; the last is drawn on top.
    pub series: Vec<Series>,
    /// Horizontal lines: "breakaway".
    pub horizontals: Vec<Marker>,
    /// Height of the plot area relative to the other panels; 1 unless set.
    pub weight: f64,
}

/// One curve; in the units of the data, before the axis' factor.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name in the legend; empty for none.
    pub name: String,
    /// Where.
    pub x: Vec<f64>,
    /// How much; a value that is not finite makes a gap.
    pub y: Vec<f64>,
    /// How it is drawn.
    pub style: Style,
    /// In which colour.
    pub colour: Colour,
    /// Samples that it was thinned out from; 0 if these are all.
    pub thinned_from: usize,
}

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Style {
    /// A continuous line.
    #[default]
    Solid,
    /// Dashes, for the second of a pair.
    Dashed,
    /// Dots, for references and inputs.
    Dotted,
    /// Points alone, for measurements.
    Points,
    /// Crosses, for poles and for a place to note.
    Crosses,
    /// Open circles, for zeros and for what begins.
    Rings,
}

impl Style {
    /// True if it shows points by themselves, not a line through them.
    pub(crate) fn is_symbol(self) -> bool {
        match self {
            Style::Points | Style::Crosses | Style::Rings => true,
            Style::Solid | Style::Dashed | Style::Dotted => false,
        }
    }
}

/// A line across the plot with a word to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Marker {
    /// Where, in the units of the data.
    pub at: f64,
    /// Its label; may be empty.
    pub label: String,
}

impl Axis {
    /// A linear axis; `unit` may be written `m/s^2`.
    pub fn new(label: impl Into<String>, unit: &str) -> Self {
        Self { label: label.into(), unit: taut::number::pretty_unit(unit), factor: 1.0, log: false }
    }

    /// Shows the data in another unit, of which `factor` make one of the data's: `("mm", 1e3)` for metres.
    pub fn shown_as(mut self, unit: &str, factor: f64) -> Self {
        self.unit = taut::number::pretty_unit(unit);
        self.factor = factor;
        self
    }

    /// Makes it logarithmic.
    pub fn logarithmic(mut self) -> Self {
        self.log = true;
        self
    }

    /// Label and unit as they stand at the axis: `Position, mm`.
    pub fn heading(&self) -> String {
        if self.unit.is_empty() { self.label.clone() } else { format!("{}, {}", self.label, self.unit) }
    }
}

impl Series {
    /// A solid blue line.
    pub fn new(name: impl Into<String>, x: impl Into<Vec<f64>>, y: impl Into<Vec<f64>>) -> Self {
        Self { name: name.into(), x: x.into(), y: y.into(), style: Style::Solid, colour: Colour::Blue, thinned_from: 0 }
    }

    /// Draws it that way.
    pub fn style(mut self, style: Style) -> Self {
        self.style = style;
        self
    }

    /// Says that it was thinned out from so many samples.
    pub fn thinned_from(mut self, samples: usize) -> Self {
        self.thinned_from = if samples > self.x.len() { samples } else { 0 };
        self
    }

    /// Gives it that colour.
    pub fn colour(mut self, colour: Colour) -> Self {
        self.colour = colour;
        self
    }
}

impl Panel {
    /// An empty panel.
    pub fn new(y: Axis) -> Self {
        Self { y, series: Vec::new(), horizontals: Vec::new(), weight: 1.0 }
    }

    /// Adds a solid line in the next colour.
    pub fn line(self, name: impl Into<String>, x: &[f64], y: &[f64]) -> Self {
        let colour = Colour::CYCLE[self.series.len() % Colour::CYCLE.len()];
        self.series(Series::new(name, x, y).colour(colour))
    }

    /// Adds a curve as it is.
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Adds a horizontal line.
    pub fn horizontal(mut self, at: f64, label: impl Into<String>) -> Self {
        self.horizontals.push(Marker { at, label: label.into() });
        self
    }

    /// Makes it higher or lower than the others.
    pub fn weight(mut self, weight: f64) -> Self {
        self.weight = weight;
        self
    }
}

impl Figure {
    /// A figure without panels.
    pub fn new(title: impl Into<String>, x: Axis) -> Self {
        Self {
            title: title.into(),
            caption: String::new(),
            x,
            panels: Vec::new(),
            verticals: Vec::new(),
            equal: false,
            view: None,
        }
    }

    /// Sets the caption.
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = caption.into();
        self
    }

    /// Adds a panel below those there are.
    pub fn panel(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// Adds a vertical line through all panels.
    pub fn vertical(mut self, at: f64, label: impl Into<String>) -> Self {
        self.verticals.push(Marker { at, label: label.into() });
        self
    }

    /// Makes a unit as long upward as to the right.
    pub fn equal(mut self) -> Self {
        self.equal = true;
        self
    }

    /// Shows this part of the x axis first.
    pub fn view(mut self, from: f64, to: f64) -> Self {
        self.view = Some((from, to)).filter(|_| from < to);
        self
    }
}
