//! The plots of a run whose cart moves in a plane.

use super::Run;
use super::marks;
use crate::{Axis, Colour, Figure, Panel, Plane, Series, Style};
use taut::case::Case;

/// Every plot of a run over time, in the order of a report; none if its curves were not kept.
pub fn figures(case: &Case, run: &Run) -> Vec<(&'static str, Figure)> {
    let Some(curves) = &run.curves else { return Vec::new() };
    let figure = |name: &str| Figure::new(format!("{}: {name}", run.experiment.name), Axis::new("Time", "s"));
    let panel = |axis: Axis, names: &[(&str, &str)]| {
        let colours = [Colour::Blue, Colour::Vermillion, Colour::Green, Colour::Purple];
        let styles = [Style::Solid, Style::Solid, Style::Dashed, Style::Dashed];
        let mut panel = Panel::new(axis);
        for (k, (curve, name)) in names.iter().enumerate() {
            if let Some((x, y)) = curves.get(curve) {
                panel = panel.series(
                    Series::new(*name, x, y).colour(colours[k % 4]).style(styles[k % 4]).thinned_from(curves.rows()),
                );
            }
        }
        panel
    };
    let gantry = &case.machine;
    let sides = |quantity: &str| [format!("left_{quantity}"), format!("right_{quantity}")];
    let two = |axis: Axis, quantity: &str| {
        let [left, right] = sides(quantity);
        panel(axis, &[(&left, "left"), (&right, "right")])
    };

    let mut drives = figure("drives");
    if curves.get("left_input").is_some() || curves.get("right_input").is_some() {
        drives = drives.panel(two(Axis::new("Input", gantry.drives[0].amplifier.mode.unit()), "input"));
    }
    let drives = drives
        .panel(two(Axis::new("Voltage", "V"), "voltage"))
        .panel(two(Axis::new("Current", "A"), "current"))
        .caption("What the motors get, and the currents they draw.");

    // Bodies two and three are bridge and cart; a pulley is at no place of its own.
    let marked = |panel: Panel, [bridge, cart]: [&str; 2]| {
        marks::marked(panel, &run.outcome.events, &[None, None, curves.get(bridge), curves.get(cart)])
    };
    let position = panel(
        Axis::new("Position", "m").shown_as("mm", 1e3),
        &[("bridge_position", "bridge x"), ("cart_position", "cart y")],
    );
    let positions = figure("positions")
        .panel(marked(position, ["bridge_position", "cart_position"]).weight(1.6))
        .panel(panel(Axis::new("Drives − true", "m").shown_as("µm", 1e6), &[("x error", "x"), ("y error", "y")]))
        .caption(
            "Where bridge and cart are, and by how much the drives miss them: x and y as the angles of the pulleys say, with belts that \
             do not stretch, minus what they are. Where bridge and cart stick and slip is marked.",
        );
    let speed = panel(
        Axis::new("Speed", "m/s").shown_as("mm/s", 1e3),
        &[("bridge_speed", "bridge ẋ"), ("cart_speed", "cart ẏ")],
    );
    let speeds = figure("speeds")
        .panel(marked(speed, ["bridge_speed", "cart_speed"]))
        .panel(two(Axis::new("Pulleys", "rad/s"), "speed"))
        .caption("Speeds of bridge and cart, and of the drive pulleys.");
    let spans: Vec<(String, &str)> =
        gantry.kind.geometry().span_labels().map(|span| (format!("{}_force", span.key), span.name)).collect();
    let spans: Vec<(&str, &str)> = spans.iter().map(|(column, name)| (column.as_str(), *name)).collect();
    let forces = figure("forces").panel(panel(Axis::new("Force", "N"), &spans)).caption(match gantry.belt.pretension {
        Some(_) => "Forces in the spans beyond pretension.",
        None => "Forces in the spans, without the belt's pretension.",
    });
    let of_bodies = |suffix: &str| -> Vec<(String, &str)> {
        let labels = gantry.geometry().bodies.iter().map(|body| body.label);
        labels.map(|label| (format!("{}_{suffix}", label.key), label.name)).collect()
    };
    let friction = of_bodies("friction");
    let states = of_bodies("state");
    let of = |axis: Axis, list: &[(String, &str)]| {
        let names: Vec<(&str, &str)> = list.iter().map(|(column, name)| (column.as_str(), *name)).collect();
        panel(axis, &names)
    };
    let friction_figure = figure("friction")
        .panel(of(Axis::new("Torque", "N m").shown_as("mN m", 1e3), &friction[..2]))
        .panel(of(Axis::new("Force", "N"), &friction[2..]))
        .panel(of(Axis::new("State", ""), &states[..2]).weight(0.6))
        .panel(of(Axis::new("State", ""), &states[2..]).weight(0.6))
        .caption(
            "What friction takes or holds, and the states: 1 forward, 0 stuck, −1 backward, 2 without dry friction.",
        );
    vec![
        ("drives", drives),
        ("positions", positions),
        ("speeds", speeds),
        ("forces", forces),
        ("friction", friction_figure),
    ]
}

/// The way of the cart in the plane; none if it was not kept.
pub fn way(case: &Case, run: &Run) -> Option<Plane> {
    let (y, x) = run.curves.as_ref()?.way()?;
    let millimetres = |name: &str| Axis::new(name, "m").shown_as("mm", 1e3);
    let mut plane = Plane::new(format!("{}: path", run.experiment.name), millimetres("Cart y"), millimetres("Bridge x"))
        .path(Series::new("", y, x).colour(Colour::Blue))
        .caption(
            "The way of the cart in the plane, at one scale for both directions and seen as the drawing is: x upward, y to the right. \
             It begins at the open circle.",
        );
    if let (Some(bridge), Some(cart)) = (case.machine.first_slide().travel, case.machine.cart.travel) {
        plane = plane.bounds((cart.min, cart.max), (bridge.min, bridge.max));
        plane.caption += " The dotted frame is the travel of both.";
    }
    Some(plane)
}
