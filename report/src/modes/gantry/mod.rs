//! The same for a gantry: rigid and elastic modes, and the resonances over the working area.

mod page;
mod rows;

pub use page::page;
pub use rows::{elastic, over_the_area, rigid, slow};

use super::plots::response;
use super::rows::words;
use crate::{Axis, Figure, Map, Plane};
use taut::linear::{ByInput, GantryAnalysis};
use taut::number::engineering;

/// A plane and its name in file names.
pub type Named = (String, Plane);

/// Responses of bridge, cart and pulleys to each drive.
pub fn responses(analysis: &GantryAnalysis) -> Vec<(String, Figure)> {
    let radius = analysis.case.machine.pulley_radius;
    let outputs = ["bridge_position", "cart_position", "left_angle", "right_angle"];
    let label = |name: &str| match name {
        "bridge_position" => "bridge x".into(),
        "cart_position" => "cart y".into(),
        "left_angle" => "left pulley r φ".into(),
        "right_angle" => "right pulley r φ".into(),
        name => words(name),
    };
    let of_input = |one: &ByInput| {
        let name = words(&one.system.input.name);
        let figure = response(&one.system, &one.responses, radius, &format!("{name} to positions"), &outputs, &label);
        figure.map(|figure| (format!("bode-{}", name.replace(' ', "-")), figure))
    };
    analysis.by_input.iter().filter_map(of_input).collect()
}

/// A map of each elastic mode, seen as the drawing is.
pub fn planes(analysis: &GantryAnalysis) -> Vec<Named> {
    let Some(map) = &analysis.map else { return Vec::new() };
    let millimetres = |name: &str| Axis::new(name, "m").shown_as("mm", 1e3);
    let plane = |(k, hertz): (usize, &Vec<Vec<f64>>)| {
        let [(least, at), (most, to)] = map.range(k);
        let place = |(x, y): (f64, f64)| format!("x = {}, y = {}", engineering(x, "m", 3), engineering(y, "m", 3));
        let caption = format!(
            "Undamped frequency with the bridge at x and the cart at y: from {} at {} to {} at {}.",
            engineering(least, "Hz", 4),
            place(at),
            engineering(most, "Hz", 4),
            place(to)
        );
        let shown = Map {
            value: Axis::new("Frequency", "Hz"),
            across: map.cart.clone(),
            up: map.bridge.clone(),
            values: hertz.clone(),
        };
        let plane = Plane::new(format!("Elastic mode {}", k + 1), millimetres("Cart y"), millimetres("Bridge x"));
        (format!("elastic-{}", k + 1), plane.map(shown).caption(caption))
    };
    map.hertz.iter().enumerate().map(plane).collect()
}
