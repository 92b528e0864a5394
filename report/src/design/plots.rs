//! The designed run over time.

use crate::{Axis, Colour, Figure, Panel, Series, Style};
use taut::Result;
use taut::case::Case;
use taut::fit::experiment_design::Designed;
use taut::solve::{Solver, simulate};

/// Input, cart and current of the experiment on the machine of the case.
pub fn figure(case: &Case, found: &Designed) -> Result<Figure> {
    let run = simulate(&case.machine, &found.experiment(), Solver::of(&case.machine))?.trajectory;
    let column = |name: &str| run.get(name).unwrap_or_default().to_vec();
    let time = column("time");
    let input: Vec<f64> = time.iter().map(|&t| found.shape.signal().value(t)).collect();
    let [from, to] = found.reached.positions;
    let free = 0.5 * (found.limits.travel.0 - (to - from)).max(0.0);
    let line = |values: Vec<f64>, colour| Series::new("", time.clone(), values).colour(colour).style(Style::Solid);
    Ok(Figure::new("The designed experiment", Axis::new("Time", "s"))
        .panel(Panel::new(Axis::new("Input", found.unit)).series(line(input, Colour::Amber)))
        .panel(
            Panel::new(Axis::new("Cart", "m").shown_as("mm", 1e3))
                .series(line(column("cart_position"), Colour::Blue))
                .horizontal(from - free, "end of the way")
                .horizontal(to + free, ""),
        )
        .panel(Panel::new(Axis::new("Current", "A")).series(line(column("motor_current"), Colour::Ink)))
        .caption("On the machine of the case, with the travel available to the cart."))
}
