//! A machine in motion: its drawing, and the rows of a run that move it.

use super::curves::Curves;
use crate::decimate;
use crate::embed::{Arrays, spacing};
use serde_json::{Value, json};
use taut::case::Case;
use taut::machine::{Machine, MachineKind, Travel};

/// Rows of a curve that a page holds for its machine. A screen shows fewer pictures in 8 s, the time of a first look.
const ROWS: usize = 2000;

/// Data for `live.js`: the scene, the end of the run in s, and the curves that `stage.js` needs, each with at most
/// [`ROWS`] rows. None if the run has no rows.
pub(super) fn live(case: &Case, curves: &Curves) -> Option<String> {
    let (times, _) = curves.get(if case.is_axis() { "cart" } else { "cart_position" })?;
    let mut arrays = Arrays::default();
    let moved = moved(&case.machine).into_iter().filter_map(|(key, curve, weight)| {
        let (x, y) = chosen(curves.get(&curve)?);
        Some(json!({ "name": key, "x": arrays.index(x, 1.0), "y": arrays.index(y, weight) }))
    });
    let moved = Value::Array(moved.collect());
    let (scene, until) = (scene(case), times.last()?);
    Some(format!("{{\"scene\":{scene},\"until\":{until:e},\"curves\":{moved},\"arrays\":[{}]}}", arrays.joined()))
}

/// Every so many rows where they are evenly spaced, which weigh half; otherwise the least and the greatest of as many.
fn chosen((x, y): (Vec<f64>, Vec<f64>)) -> (Vec<f64>, Vec<f64>) {
    if spacing(&x).is_none() {
        return decimate(&x, &y, ROWS);
    }
    let every = x.len().div_ceil(ROWS);
    let kept = |values: Vec<f64>| values.into_iter().step_by(every).collect();
    (kept(x), kept(y))
}

/// Quantities of the drawing, each with the curve of the report that gives it and a factor.
fn moved(machine: &Machine) -> Vec<(String, String, f64)> {
    let own = |key: String| (key.clone(), key, 1.0);
    if machine.kind != MachineKind::Axis {
        let geometry = machine.geometry();
        let angles = geometry.drives.iter().map(|drive| format!("{}_angle", geometry.label(drive.pulley).key));
        let spans = geometry.span_labels().map(|label| format!("{}_force", label.key));
        let states = geometry.bodies.iter().map(|body| format!("{}_state", body.label.key));
        let slides = ["bridge_position", "cart_position"].map(String::from).into_iter();
        // Curves of a report are what the drives say minus the place, the drawing shows the opposite.
        let errors =
            [("x_error", "x error"), ("y_error", "y error")].map(|(key, curve)| (key.into(), curve.into(), -1.0));
        return slides.chain(angles).chain(spans).chain(states).map(own).chain(errors).collect();
    }
    let per_radius = 1.0 / machine.pulley_radius;
    let mut moved = vec![
        ("cart_position", "cart", 1.0),
        ("drive_travel", "drive", 1.0),
        ("idler_angle", "idler", per_radius),
        // Stretch of span 1 is r φ₁ − x.
        ("error", "stretch 1", -1.0),
        ("drive_state", "drive state", 1.0),
        ("cart_state", "cart state", 1.0),
        ("idler_state", "idler state", 1.0),
    ];
    moved.extend([("stretch1", "stretch 1", 1.0), ("stretch2", "stretch 2", 1.0), ("stretch3", "stretch 3", 1.0)]);
    moved.extend([("span1_force", "force 1", 1.0), ("span2_force", "force 2", 1.0), ("span3_force", "force 3", 1.0)]);
    moved.into_iter().map(|(key, curve, weight)| (key.into(), curve.into(), weight)).collect()
}

/// The drawing: kind, radius and travels, m, which do not change.
pub fn scene(case: &Case) -> Value {
    let travel = |travel: Option<Travel>| travel.map(|travel| [travel.min, travel.max]);
    match case {
        case if case.is_axis() => {
            let machine = &case.machine;
            json!({
                "kind": "axis",
                "radius": machine.pulley_radius,
                "x": travel(machine.cart.travel),
                "spans": ["span1_force", "span2_force", "span3_force"],
                "pretension": machine.belt.pretension,
            })
        }
        case => {
            let gantry = &case.machine;
            let spans: Vec<String> =
                gantry.kind.geometry().span_labels().map(|label| format!("{}_force", label.key)).collect();
            json!({
                "kind": gantry.kind.word(),
                "radius": gantry.pulley_radius,
                "x": travel(gantry.first_slide().travel),
                "y": travel(gantry.cart.travel),
                "spans": spans,
                "pretension": gantry.belt.pretension,
            })
        }
    }
}
