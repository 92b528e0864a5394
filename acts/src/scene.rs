//! The drawing of a machine beside its motion: lengths that do not change.

use serde_json::{Value, json};
use taut::case::Case;
use taut::machine::Travel;

/// Kind, radius and travels, m.
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
