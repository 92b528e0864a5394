//! The summary for machines.

use super::Work;
use serde_json::{Value, json};
use std::f64::consts::PI;
use taut::tune::{Margins, Verdict};

/// As JSON; numbers to the last bit, null for what is infinite.
pub fn text(work: &Work) -> String {
    let tuned = work.tuned;
    let gains: Vec<Value> = tuned
        .changes()
        .into_iter()
        .map(|(gain, after)| json!({ "key": gain.key, "unit": gain.unit, "before": gain.value, "after": after }))
        .collect();
    let value = json!({
        "title": work.case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "structure": tuned.after.design.structure.name(),
        "cost": work.tuning.cost.map_or("none", |cost| cost.word()),
        "limits": { "sensitivity": work.tuning.sensitivity, "complementary": work.tuning.complementary },
        "began_with_Hz": tuned.placed,
        "holds": tuned.holds,
        "rounds": tuned.work.0,
        "designs": tuned.work.1,
        "gains": gains,
        "before": verdict(work, &tuned.before),
        "after": verdict(work, &tuned.after),
    });
    taut::json::text(&value)
}

fn margins(m: &Margins) -> Value {
    json!({
        "stable": m.stable,
        "sensitivity": m.sensitivity,
        "sensitivity_at_Hz": m.at / (2.0 * PI),
        "complementary": m.complementary,
        "gain_margin": m.gain,
        "phase_margin_rad": m.phase,
        "crossover_Hz": m.crossover / (2.0 * PI),
        "bandwidth_Hz": m.bandwidth / (2.0 * PI),
    })
}

fn verdict(work: &Work, verdict: &Verdict) -> Value {
    let corner = &verdict.corner;
    let off: serde_json::Map<String, Value> = work
        .tuned
        .family
        .unknowns
        .iter()
        .zip(&corner.off)
        .map(|(unknown, off)| (unknown.name.clone(), json!(off)))
        .collect();
    let moves: Vec<Value> = verdict
        .moves
        .iter()
        .map(|m| {
            json!({
                "name": m.name,
                "cart_error": { "peak_m": m.cart.peak.value, "rms_m": m.cart.rms, "last_m": m.cart.last },
                "settling_s": m.settling,
                "worst": { "cart_error_m": m.worst.0, "axis": m.worst.1.replace('\u{a0}', " "), "settled": m.settled.0, "axes": m.settled.1 },
            })
        })
        .collect();
    json!({
        "nominal": margins(&verdict.nominal),
        "worst": {
            "margins": margins(&verdict.worst),
            "place_m": corner.place,
            "load_kg": corner.load,
            "off": off,
            "words": work.tuned.family.words(corner).replace('\u{a0}', " "),
        },
        "moves": moves,
        "hunting": verdict.hunt.as_ref().map(|hunt| json!({
            "amplitude_m": hunt.amplitude, "period_s": hunt.period, "needs": hunt.needs, "watched_s": hunt.watched,
        })),
    })
}
