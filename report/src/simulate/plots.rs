//! The plots of a run.

use super::SimulatedExperiment;
use super::curves::{Curves, Samples};
use super::{in_plane, marks};
use crate::{Axis, Colour, Figure, Panel, Picture, Plane, Series, Style};
use taut::case::Case;

/// A figure and its name in file names.
pub type Named = (&'static str, Figure);

/// Every plot of a run, in the order of a report; none if its curves were not kept.
pub fn figures(case: &Case, run: &SimulatedExperiment) -> Vec<Named> {
    if !case.is_axis() {
        return in_plane::figures(case, run);
    }
    let Some(curves) = &run.curves else { return Vec::new() };
    let figure = |name: &str| Figure::new(format!("{}: {name}", run.experiment.name), Axis::new("Time", "s"));
    let millimetres = || Axis::new("Position", "m").shown_as("mm", 1e3);
    let plot = Plot { curves, samples: run.samples.as_ref() };

    let mut input = figure("input");
    if curves.get("input").is_some() {
        let axis = Axis::new("Input", case.machine.drives[0].amplifier.mode.unit());
        input = input.panel(plot.panel(axis, &[("input", "u")]));
    }
    // The phases of a stepper have voltages of their own.
    if curves.get("voltage").is_some() {
        input =
            input.panel(plot.measured(Axis::new("Voltage", "V"), &[("voltage", "motor voltage")], &["motor_voltage"]));
    }
    input = input
        .panel(plot.measured(Axis::new("Current", "A"), &[("current", "motor current")], &["motor_current"]))
        .caption("What the motor gets, and the current it draws.");

    let bodies = [("drive", "drive pulley r φ₁"), ("cart", "cart x"), ("idler", "idler pulley r φ₃")];
    let events = &run.outcome.events;
    let marked = |panel: Panel, names: [&str; 3]| marks::marked(panel, events, &names.map(|name| curves.get(name)));
    let position = plot.measured(millimetres(), &bodies, &["drive_angle", "cart_position"]).weight(2.0);
    let positions = figure("positions")
        .panel(marked(position, ["drive", "cart", "idler"]))
        .panel(plot.panel(Axis::new("r φ₁ − x", "m").shown_as("µm", 1e6), &[("stretch 1", "r φ₁ − x")]))
        .caption(
            "Positions along the belt, and by how much an encoder at the drive pulley misses the cart. \
             The three positions nearly coincide: zoom in to see them part. Where a body sticks and slips is marked.",
        );
    let speeds = [("drive speed", "drive pulley r φ̇₁"), ("cart speed", "cart ẋ"), ("idler speed", "idler pulley r φ̇₃")];
    let speed = Axis::new("Speed", "m/s").shown_as("mm/s", 1e3);
    let speed = plot.measured(speed, &speeds, &["drive_speed", "cart_speed"]);
    let speeds = figure("speeds")
        .panel(marked(speed, ["drive speed", "cart speed", "idler speed"]))
        .caption("Speeds along the belt.");
    let spans = [("stretch 1", "span 1"), ("stretch 2", "span 2"), ("stretch 3", "span 3")];
    let stretch = figure("stretch").panel(plot.panel(Axis::new("Stretch", "m").shown_as("µm", 1e6), &spans)).caption(
        "Stretch of the spans: 1 from drive pulley to cart, 2 from cart to idler pulley, 3 from idler to drive pulley. \
             Negative means shorter than at rest.",
    );
    let spans = [("force 1", "span 1"), ("force 2", "span 2"), ("force 3", "span 3")];
    let forces = figure("forces")
        .panel(plot.panel(Axis::new("Force", "N"), &spans))
        .caption("Forces in the spans, without the belt's pretension.");
    let pulleys = [("drive friction", "drive pulley"), ("idler friction", "idler pulley")];
    let states = [("drive state", "drive pulley"), ("cart state", "cart"), ("idler state", "idler pulley")];
    let friction = figure("friction")
        .panel(plot.panel(Axis::new("Torque", "N m").shown_as("mN m", 1e3), &pulleys))
        .panel(plot.panel(Axis::new("Force", "N"), &[("cart friction", "cart")]))
        .panel(plot.panel(Axis::new("State", ""), &states))
        .caption(
            "What friction takes or holds, and the states: 1 forward, 0 stuck, −1 backward, 2 without dry friction.",
        );
    let mut all = vec![
        ("input", input),
        ("positions", positions),
        ("speeds", speeds),
        ("stretch", stretch),
        ("forces", forces),
        ("friction", friction),
    ];
    if let Some(band) = &run.band {
        all.insert(2, ("band", band.figure(run.experiment)));
    }
    all
}

struct Plot<'a> {
    curves: &'a Curves,
    samples: Option<&'a Samples>,
}

impl Plot<'_> {
    /// A panel with these curves, and what was logged of these columns as points, which the thinner curves cross.
    fn measured(&self, axis: Axis, curves: &[(&str, &str)], columns: &[&str]) -> Panel {
        let mut panel = self.panel(axis, curves);
        let logged = |column: &&str| self.samples.and_then(|samples| samples.get(column));
        for (column, colour) in columns.iter().zip([Colour::Amber, Colour::Sky]) {
            if let Some((x, y)) = logged(column) {
                let name = match *column {
                    "drive_angle" | "drive_speed" => "measured at the drive pulley",
                    "cart_position" | "cart_speed" => "measured at the cart",
                    _ => "measured",
                };
                panel.series.insert(0, Series::new(name, x, y).colour(colour).style(Style::Points));
            }
        }
        panel
    }

    /// A panel with these curves and their names in the legend.
    fn panel(&self, axis: Axis, curves: &[(&str, &str)]) -> Panel {
        let colours = [Colour::Blue, Colour::Vermillion, Colour::Green];
        let styles = [Style::Solid, Style::Solid, Style::Dashed];
        let mut panel = Panel::new(axis);
        for (i, (curve, name)) in curves.iter().enumerate() {
            if let Some((x, y)) = self.curves.get(curve) {
                let name = if curves.len() > 1 { *name } else { "" };
                panel = panel.series(
                    Series::new(name, x, y)
                        .colour(colours[i % 3])
                        .style(styles[i % 3])
                        .thinned_from(self.curves.rows()),
                );
            }
        }
        panel
    }
}

/// The way of the cart in its plane; none if it has none, or its curves were not kept.
pub fn way(case: &Case, run: &SimulatedExperiment) -> Option<Plane> {
    if case.is_axis() { None } else { in_plane::way(case, run) }
}

/// The figures of runs of these file names, each called after its run.
pub fn named(runs: impl Iterator<Item = String>, figures: Vec<Vec<Named>>) -> Vec<(String, Picture)> {
    let named = runs.zip(figures).flat_map(|(run, figures)| {
        figures.into_iter().map(move |(name, figure)| (format!("{run}-{name}"), figure.into()))
    });
    named.collect()
}
