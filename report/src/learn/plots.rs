//! The plots of a learned signal.

use crate::{Axis, Colour, Figure, Panel, Series, Style};
use taut::learning::Learned;
use taut::machine::Machine;

/// Error and signal over time, and convergence over frequency.
pub fn figures(found: &Learned, machine: &Machine) -> Vec<(String, Figure)> {
    let unit = machine.drives[0].amplifier.mode.unit();
    let count = found.slides.first().map_or(0, |slide| slide.error.len());
    let time: Vec<f64> = (0..count).map(|k| k as f64 * found.every).collect();
    let over = |name: &str, values: &[f64], colour: Colour, style: Style| {
        Series::new(name, time.clone(), values.to_vec()).colour(colour).style(style)
    };
    let mut motion = Figure::new("Error and signal", Axis::new("Time", "s"));
    for ((label, _), slide) in machine.travels().zip(&found.slides) {
        let name = match (machine.has_one_coordinate(), label.key) {
            (true, _) => "Error",
            (_, "cart") => "Error of the cart",
            _ => "Error of the bridge",
        };
        motion = motion.panel(
            Panel::new(Axis::new(name, "m").shown_as("µm", 1e6))
                .series(over("log", &slide.error, Colour::Blue, Style::Dashed))
                .series(over("expected next", &slide.expected, Colour::Vermillion, Style::Solid)),
        );
    }
    for (at, drive) in machine.geometry().drives.iter().zip(&found.drives) {
        let name = match at.side() {
            "" => "Added to the command".to_string(),
            side => format!("Added to the {side} command"),
        };
        motion = motion.panel(
            Panel::new(Axis::new(name, unit))
                .series(over("log", &drive.before, Colour::Blue, Style::Dashed))
                .series(over("next", &drive.next, Colour::Vermillion, Style::Solid)),
        );
    }
    let motion = motion.caption(
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
