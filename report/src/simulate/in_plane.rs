//! The plots of a run whose cart moves in a plane.

use super::SimulatedExperiment;
use super::marks;
use crate::{Axis, Colour, Figure, Panel, Plane, Series, Style};
use taut::case::Case;
use taut::machine::DriveAt;

/// Every plot of a run over time, in the order of a report; none if its curves were not kept.
pub fn figures(case: &Case, run: &SimulatedExperiment) -> Vec<(&'static str, Figure)> {
    let Some(curves) = &run.curves else { return Vec::new() };
    let figure = |name: &str| Figure::new(format!("{}: {name}", run.experiment.name), Axis::new("Time", "s"));
    let panel = |axis: Axis, names: &[(&str, &str)]| {
        let colours = [Colour::Blue, Colour::Vermillion, Colour::Green, Colour::Purple];
        let styles = [Style::Solid, Style::Solid, Style::Dashed, Style::Dashed];
        let mut panel = Panel::new(axis);
        for (k, (curve, name)) in names.iter().enumerate() {
            if let Some((x, y)) = curves.get(curve) {
                panel = panel.series(
                    Series::new(*name, x, y)
                        .colour(colours[k % 4])
                        .style(styles[(k + 2 * (k / 4)) % 4])
                        .thinned_from(curves.rows()),
                );
            }
        }
        panel
    };
    let gantry = &case.machine;
    let geometry = gantry.geometry();
    let of_drives = |axis: Axis, column: &dyn Fn(&DriveAt) -> String| {
        let names: Vec<(String, &str)> = geometry.drives.iter().map(|drive| (column(drive), drive.side())).collect();
        let names: Vec<(&str, &str)> = names.iter().map(|(column, name)| (column.as_str(), *name)).collect();
        panel(axis, &names)
    };
    let input = |drive: &DriveAt| format!("{}input", drive.prefix);

    let mut drives = figure("drives");
    if geometry.drives.iter().any(|drive| curves.get(&input(drive)).is_some()) {
        drives = drives.panel(of_drives(Axis::new("Input", gantry.drives[0].amplifier.mode.unit()), &input));
    }
    if gantry.stepper().is_none() {
        // The phases of a stepper have voltages of their own.
        drives = drives.panel(of_drives(Axis::new("Voltage", "V"), &|drive| drive.voltage.key.to_string()));
    }
    let drives = drives
        .panel(of_drives(Axis::new("Current", "A"), &|drive| drive.current_column.to_string()))
        .caption("What the motors get, and the currents they draw.");

    // A pulley is at no place of its own.
    let marked = |panel: Panel, names: [&str; 2]| {
        let mut of_bodies = vec![None; geometry.bodies.len()];
        for (slide, name) in geometry.slides.iter().zip(names) {
            of_bodies[slide.body] = curves.get(name);
        }
        marks::marked(panel, &run.outcome.events, &of_bodies)
    };
    let position = panel(
        Axis::new("Position", "m").shown_as("mm", 1e3),
        &[("bridge_position", "bridge x"), ("cart_position", "cart y")],
    );
    let mut positions = figure("positions")
        .panel(marked(position, ["bridge_position", "cart_position"]).weight(1.6))
        .panel(panel(Axis::new("Drives − true", "m").shown_as("µm", 1e6), &[("x error", "x"), ("y error", "y")]))
        .caption(
            "Where bridge and cart are, and by how much the drives miss them: x and y as the angles of the pulleys say, with belts that \
             do not stretch, minus what they are. Where bridge and cart stick and slip is marked.",
        );
    if gantry.yaw.is_some() {
        positions = positions.panel(panel(Axis::new("Yaw", "rad").shown_as("µrad", 1e6), &[("yaw_angle", "bridge ψ")]));
    }
    let speed = panel(
        Axis::new("Speed", "m/s").shown_as("mm/s", 1e3),
        &[("bridge_speed", "bridge ẋ"), ("cart_speed", "cart ẏ")],
    );
    let speeds = figure("speeds")
        .panel(marked(speed, ["bridge_speed", "cart_speed"]))
        .panel(of_drives(Axis::new("Pulleys", "rad/s"), &|drive| format!("{}_speed", geometry.label(drive.pulley).key)))
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
    // Drive pulleys are the first bodies.
    let pulleys = geometry.drives.len();
    let of = |axis: Axis, list: &[(String, &str)]| {
        let names: Vec<(&str, &str)> = list.iter().map(|(column, name)| (column.as_str(), *name)).collect();
        panel(axis, &names)
    };
    let friction_figure = figure("friction")
        .panel(of(Axis::new("Torque", "N m").shown_as("mN m", 1e3), &friction[..pulleys]))
        .panel(of(Axis::new("Force", "N"), &friction[pulleys..]))
        .panel(of(Axis::new("State", ""), &states[..pulleys]).weight(0.6))
        .panel(of(Axis::new("State", ""), &states[pulleys..]).weight(0.6))
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
pub fn way(case: &Case, run: &SimulatedExperiment) -> Option<Plane> {
    let (y, x) = run.curves.as_ref()?.way()?;
    let millimetres = |name: &str| Axis::new(name, "m").shown_as("mm", 1e3);
    let mut plane = Plane::new(
        format!("{}: path", run.experiment.name),
        millimetres("Cart y"),
        millimetres("Bridge x"),
    )
    .path(Series::new("", y, x).colour(Colour::Blue))
    .caption(
        "Path of the cart in the plane, at one scale for both directions and oriented as the drawing: x upward, y \
             to the right. It begins at the open circle.",
    );
    if let (Some(bridge), Some(cart)) = (case.machine.first_slide().travel, case.machine.cart.travel) {
        plane = plane.bounds((cart.min, cart.max), (bridge.min, bridge.max));
        plane.caption += " The dotted frame is the travel of both.";
    }
    Some(plane)
}
