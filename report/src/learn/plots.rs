//! The plots of a learned signal.

use crate::{Axis, Colour, Figure, Panel, Series, Style};
use taut::learning::Learned;

/// Error and signal over time, and convergence over frequency.
pub fn figures(found: &Learned, unit: &str) -> Vec<(String, Figure)> {
    let time: Vec<f64> = (0..found.error.len()).map(|k| k as f64 * found.every).collect();
    let over = |name: &str, values: &[f64], colour: Colour, style: Style| {
        Series::new(name, time.clone(), values.to_vec()).colour(colour).style(style)
    };
    let motion = Figure::new("Error and signal", Axis::new("Time", "s"))
        .panel(
            Panel::new(Axis::new("Error", "m").shown_as("µm", 1e6))
                .series(over("log", &found.error, Colour::Blue, Style::Dashed))
                .series(over("expected next", &found.expected, Colour::Vermillion, Style::Solid)),
        )
        .panel(
            Panel::new(Axis::new("Added to the command", unit))
                .series(over("log", &found.before, Colour::Blue, Style::Dashed))
                .series(over("next", &found.next, Colour::Vermillion, Style::Solid)),
        )
        .caption(
            "The error of the log and the next one on the machine of the file; the signal of the log and the next one.",
        );
    // The first frequency is as good as zero.
    let points = || found.points.iter().skip(1);
    let hertz: Vec<f64> = points().map(|point| point.frequency).collect();
    let curve = |name: &str, values: Vec<f64>, colour: Colour| Series::new(name, hertz.clone(), values).colour(colour);
    let convergence = Figure::new("Convergence", Axis::new("Frequency", "Hz").logarithmic())
        .panel(
            Panel::new(Axis::new("Share", ""))
                .series(curve("|1 − L T|", points().map(|point| point.left).collect(), Colour::Blue))
                .series(curve("Q", points().map(|point| point.kept).collect(), Colour::Green))
                .series(curve(
                    "|Q (1 − L T)|",
                    points().map(|point| point.kept * point.left).collect(),
                    Colour::Vermillion,
                )),
        )
        .caption("Share of the error that a repetition leaves, on the worst machine of the family at each frequency.");
    vec![("learned".into(), motion), ("convergence".into(), convergence)]
}
