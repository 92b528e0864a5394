//! The drawing of a machine beside its motion: lengths that do not change.

use serde_json::{Value, json};
use taut::case::Opened;
use taut::machine::Travel;
use taut::machine::gantry::Routing;

/// Kind, radius and travels, m.
pub fn scene(case: &Opened) -> Value {
    let travel = |travel: Option<Travel>| travel.map(|travel| [travel.min, travel.max]);
    match case {
        Opened::Axis(case) => {
            let machine = &case.machine;
            json!({
                "kind": "axis",
                "radius": machine.pulley_radius,
                "x": travel(machine.travel),
                "spans": ["span1_force", "span2_force", "span3_force"],
                "pretension": machine.belt.pretension,
            })
        }
        Opened::Gantry(case) => {
            let gantry = &case.gantry;
            let spans: Vec<String> =
                gantry.routing.spans().iter().map(|label| format!("{}_force", label.key)).collect();
            json!({
                "kind": match gantry.routing {
                    Routing::HFrame => "h-frame",
                    Routing::CoreXy => "core-xy",
                },
                "radius": gantry.pulley_radius,
                "x": travel(gantry.bridge.travel),
                "y": travel(gantry.cart.travel),
                "spans": spans,
                "pretension": gantry.belts.pretension,
            })
        }
    }
}
