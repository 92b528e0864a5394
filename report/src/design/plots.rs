//! The designed run over time.

use crate::{Axis, Colour, Figure, Panel, Series, Style};
use taut::Result;
use taut::case::Case;
use taut::fit::experiment_design::Designed;
use taut::solve::{Solver, simulate};

/// Inputs, what slides, and currents of the experiment on the machine of the case.
pub fn figure(case: &Case, found: &Designed) -> Result<Figure> {
    const COLOURS: [Colour; 3] = [Colour::Amber, Colour::Blue, Colour::Green];
    let geometry = case.machine.geometry();
    let experiment = found.experiment();
    let run = simulate(&case.machine, &experiment, Solver::for_machine(&case.machine))?.trajectory;
    let column = |name: &str| run.get(name).unwrap_or_default().to_vec();
    let time = column("time");
    let line = |name: &str, values: Vec<f64>, colour| {
        Series::new(name, time.clone(), values).colour(colour).style(Style::Solid)
    };
    let (mut inputs, mut currents) =
        (Panel::new(Axis::new("Input", found.unit)), Panel::new(Axis::new("Current", "A")));
    for (drive, (at, signal)) in geometry.drives.iter().zip(&experiment.inputs).enumerate() {
        let colour = if geometry.drives.len() == 1 { Colour::Ink } else { COLOURS[drive % COLOURS.len()] };
        let values = time.iter().map(|&t| signal.value(t)).collect();
        inputs = inputs.series(line(at.side(), values, COLOURS[drive % COLOURS.len()]));
        currents = currents.series(line(at.side(), column(at.current_column), colour));
    }
    let mut figure = Figure::new("The designed experiment", Axis::new("Time", "s")).panel(inputs);
    for (slide, (label, _)) in case.machine.travels().enumerate() {
        let [from, to] = found.reached.positions[slide];
        let free = 0.5 * (found.limits.travel[slide].0 - (to - from)).max(0.0);
        let name = match label.key {
            "cart" => "Cart",
            _ => "Bridge",
        };
        figure = figure.panel(
            Panel::new(Axis::new(name, "m").shown_as("mm", 1e3))
                .series(line("", column(&format!("{}_position", label.key)), Colour::Blue))
                .horizontal(from - free, "end of the way")
                .horizontal(to + free, ""),
        );
    }
    let caption = match case.machine.has_one_coordinate() {
        true => "On the machine of the case, with the travel available to the cart.",
        false => "On the machine of the case, with the travel available to bridge and cart.",
    };
    Ok(figure.panel(currents).caption(caption))
}
