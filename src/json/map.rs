//! The force along the travel: `taut learn --map --json`, `map.json`.

use super::number;
use crate::case::Case;
use crate::fit::map::{Component, ForceMap, Origin, Point};
use serde_json::{Value, json};

/// A map, and how well it is known.
pub fn map(case: &Case, found: &ForceMap) -> Value {
    let origin = |one: &Origin| json!({ "words": one.words(), "period_m": one.period() });
    let component = |one: &Component| {
        json!({
            "period_m": one.period[0],
            "period_error_m": number(one.period[1]),
            "amplitude_N": one.amplitude[0],
            "amplitude_error_N": number(one.amplitude[1]),
            "chance": number(one.chance),
            "origins": one.origins.iter().map(origin).collect::<Vec<_>>(),
        })
    };
    let points = |of: fn(&Point) -> f64| found.points.iter().map(of).collect::<Vec<_>>();
    let line = |part: usize| -> Vec<f64> {
        found.line.iter().flat_map(|line| line.points()).map(|point| point[part]).collect()
    };
    json!({
        "schema": super::identity("map"),
        "title": case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "passes": { "forward": found.passes[0], "backward": found.passes[1] },
        "speed_m_s": found.speed,
        "is_significant": found.is_significant,
        "mean_N": found.mean,
        "friction_N": found.friction,
        "visible_N": number(found.visible),
        "resolution_m": number(found.resolution),
        "limited_by": found.limit.words(),
        "components": found.components.iter().map(component).collect::<Vec<_>>(),
        "may_be_eccentric": found.may_be_eccentric(),
        "too_long": found.too_long.iter().map(origin).collect::<Vec<_>>(),
        "position_m": points(|point| point.position),
        "force_N": points(|point| point.force),
        "low_N": points(|point| point.band[0]),
        "high_N": points(|point| point.band[1]),
        "forward_N": points(|point| point.sides[0]),
        "backward_N": points(|point| point.sides[1]),
        "force_along": { "position_m": line(0), "force_N": line(1) },
    })
}
