//! Planned moves: `taut plan --json`, `plan.json`.

use super::moves::shortfall;
use super::number;
use crate::case::Case;
use crate::planning::{Arrival, Planned, Plans, Tried};
use crate::reach::feasible::Load;
use crate::reach::quickest::Wanted;
use crate::signal::profile::Limits;
use serde_json::{Value, json};

/// The plans of a case.
pub fn plan(case: &Case, wanted: &Wanted, plans: &Plans) -> Value {
    json!({
        "schema": super::identity("plan"),
        "title": case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "axes": plans.family.machines.len(),
        "modes_Hz": plans.modes,
        "reserve": wanted.reserve,
        "moves": plans.moves.iter().map(planned).collect::<Vec<_>>(),
    })
}

fn planned(planned: &Planned) -> Value {
    let mut value = tried(&planned.best);
    value["name"] = json!(planned.name);
    value["kept"] = json!(planned.is_kept);
    value["window_m"] = json!(planned.window);
    value["fastest_rigid_s"] = planned.bound.map_or(Value::Null, number);
    value["given"] = json!({
        "arrival": arrival(&planned.given),
        "shortfalls": planned.shortfalls.iter().map(shortfall).collect::<Vec<_>>(),
    });
    value["loads"] = planned.loads.iter().map(load).collect();
    value["tried"] = planned.tried.iter().map(tried).collect();
    value
}

fn tried(tried: &Tried) -> Value {
    json!({
        "limits": limits(&tried.limits),
        "periods": { "jerk": tried.periods[0], "snap": tried.periods[1] },
        "share": tried.share,
        "arrival": arrival(&tried.arrival),
    })
}

fn limits(limits: &Limits) -> Value {
    json!({
        "speed_m_s": limits.speed, "acceleration_m_s2": limits.acceleration, "jerk_m_s3": limits.jerk,
        "snap_m_s4": limits.snap,
    })
}

fn arrival(arrival: &Arrival) -> Value {
    json!({
        "duration_s": arrival.duration, "in_window_s": arrival.nominal, "in_window_worst_s": arrival.worst,
        "axes": arrival.axes, "settled": arrival.settled, "cart_error_m": number(arrival.cart_error),
        "saturated_s": arrival.saturated,
    })
}

fn load(load: &Load) -> Value {
    json!({ "limit": load.limit, "unit": load.unit, "needed": load.needed, "allowed": load.allowed })
}
