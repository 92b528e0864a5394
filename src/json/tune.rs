//! A tuned controller: `taut tune --json`, `tune.json`.

use super::moves::shortfall;
use super::number;
use crate::case::{Case, Move, Tuning};
use crate::design::{Design, InDrives};
use crate::tune::{
    Ahead, AtWorst, Certificate, Choice, Corner, Family, Least, Margins, MoveVerdict, Tuned, Unknown, Verdict, gains,
};
use serde_json::{Value, json};
use std::f64::consts::PI;

/// The tuning of a case; numbers to the last bit, null for what is infinite.
pub fn tuned(case: &Case, tuning: &Tuning, tuned: &Tuned) -> Value {
    let change = |(gain, after): (crate::tune::Gain, f64)| json!({ "key": gain.key, "unit": gain.unit, "before": gain.value, "after": after });
    let filters = tuned.filters().map(|[before, after]| json!({ "before": before, "after": after }));
    let forced = tuned.forced.map(|forced| {
        json!({
            "limit": forced.limit.word(), "standing": forced.standing.word(), "break": forced.at.word(),
            "mode_Hz": number(forced.mode), "place_m": forced.place,
        })
    });
    json!({
        "schema": super::identity("tune"),
        "title": case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "structure": tuned.after.design.structure.name(),
        "verdict": tuned.judgement.word(),
        "forced_by": forced,
        "advice": tuned.advice,
        "feed_forward": tuned.ahead.as_ref().map(feed_forward),
        "least_worse": tuned.least.as_ref().map(|least| least_worse(tuned, least)),
        "cost": tuning.cost.map_or("none", |cost| cost.word()),
        "limits": { "sensitivity": tuning.sensitivity, "complementary": tuning.complementary },
        "family": {
            "machines": tuned.family.machines.len(),
            "corners": tuned.family.corners,
            "left_out": tuned.family.left_out(tuned.family.machines.len()),
            "varies": tuned.family.unknowns.iter().map(varies).collect::<Vec<_>>(),
        },
        "shortfalls": case.shortfalls().iter().map(|(name, limits)| {
            json!({ "move": name, "limits": limits.iter().map(shortfall).collect::<Vec<_>>() })
        }).collect::<Vec<_>>(),
        "standard_moves": case.moves.is_empty(),
        "certificate": certificate(&tuned.family, &tuned.certificate),
        "undamped_mode_Hz": tuned.undamped,
        "began_with_Hz": tuned.placed,
        "holds": tuned.holds,
        "effort": tuning.effort,
        "rounds": tuned.work.0,
        "designs": tuned.work.1,
        "gains": tuned.changes().into_iter().map(change).collect::<Vec<_>>(),
        "filters": filters,
        "in_drives": {
            "before": tuned.before.design.in_drives().into_iter().map(in_drives).collect::<Vec<_>>(),
            "after": tuned.after.design.in_drives().into_iter().map(in_drives).collect::<Vec<_>>(),
        },
        "before": verdict(tuned, &tuned.before),
        "after": verdict(tuned, &tuned.after),
        "pareto": tuned.choices.iter().map(|one| choice(tuned, one)).collect::<Vec<_>>(),
    })
}

/// A gain as drives have it.
fn in_drives(gain: InDrives) -> Value {
    json!({ "name": gain.name, "value": number(gain.value), "unit": gain.unit })
}

/// Feed-forward that pays; its moves without it are those of `after`.
fn feed_forward(ahead: &Ahead) -> Value {
    let motion = |one: &MoveVerdict| {
        json!({
            "name": one.name, "cart_error_m": number(one.cart.peak.value.abs()), "worst_m": number(one.worst.0),
            "settled": one.settled.0,
        })
    };
    json!({
        "setting": ahead.text(),
        "objective": number(ahead.verdict.objective.exp()),
        "moves": ahead.verdict.moves.iter().map(motion).collect::<Vec<_>>(),
    })
}

/// A parameter that is not known exactly; a factor without a unit where it was never fitted.
fn varies(unknown: &Unknown) -> Value {
    json!({
        "name": unknown.name,
        "low": number(unknown.low),
        "high": number(unknown.high),
        "unit": unknown.unit(),
        "fitted": unknown.is_fitted,
    })
}

fn margins(m: &Margins) -> Value {
    json!({
        "stable": m.stable,
        "sensitivity": number(m.sensitivity),
        "sensitivity_at_Hz": number(m.at / (2.0 * PI)),
        "sensitivity_break": m.breaks.sensitivity.word(),
        "complementary": number(m.complementary),
        "complementary_at_Hz": number(m.complementary_at / (2.0 * PI)),
        "complementary_break": m.breaks.complementary.word(),
        "gain_margin": number(m.gain),
        "gain_margin_break": m.breaks.gain.word(),
        "gain_margin_drive": m.drive_name(m.breaks.gain_drive),
        "phase_margin_rad": number(m.phase),
        "phase_margin_break": m.breaks.phase.word(),
        "phase_margin_drive": m.drive_name(m.breaks.phase_drive),
        "crossover_Hz": number(m.crossover / (2.0 * PI)),
        "bandwidth_Hz": number(m.bandwidth / (2.0 * PI)),
        "tracking_bandwidth_Hz": number(m.tracking / (2.0 * PI)),
        "disturbance": number(m.disturbance),
        "following": number(m.following),
    })
}

/// J itself, not its logarithm.
fn objective(logarithm: f64) -> Value {
    number(logarithm.exp())
}

fn at_worst(one: &AtWorst, axes: usize) -> serde_json::Map<String, Value> {
    let (settles, is_settled) = one.settles;
    let Value::Object(object) = json!({
        "cart_error_m": number(one.error.0),
        "rms_error_m": number(one.rms),
        "settling_s": is_settled.then_some(settles),
        "rms_current_A": number(one.current),
        "settled": one.settled,
        "axes": axes,
    }) else {
        return serde_json::Map::new();
    };
    object
}

fn motion(m: &MoveVerdict) -> Value {
    let mut worst = at_worst(&m.at_worst, m.settled.1);
    worst.insert("axis".into(), json!(m.worst.1.replace('\u{a0}', " ")));
    json!({
        "name": m.name,
        "cart_error": { "peak_m": m.cart.peak.value, "rms_m": m.cart.rms, "last_m": m.cart.last },
        "settling_s": m.settling,
        "rms_current_A": number(m.current),
        "worst": worst,
    })
}

/// A machine of a family and its margins.
fn machine(family: &Family, corner: &Corner, own: &Margins) -> Value {
    let off = |(unknown, off): (&Unknown, &f64)| (unknown.name.clone(), json!(off));
    let off: serde_json::Map<String, Value> = family.unknowns.iter().zip(&corner.off).map(off).collect();
    json!({
        "margins": margins(own),
        "place_m": corner.place,
        "bridge_m": family.machine.bridge.as_ref().map(|_| corner.bridge),
        "load_kg": corner.load,
        "off": off,
        "words": family.words(corner).replace('\u{a0}', " "),
    })
}

/// Certificate of the loop for every machine of the family.
fn certificate(family: &Family, own: &Certificate) -> Value {
    let bounds = own
        .bounds
        .map(|[sensitivity, complementary]| json!({ "sensitivity": sensitivity, "complementary": complementary }));
    let violation = own.violation.as_ref().map(|violation| {
        json!({ "factor": violation.factor, "machine": machine(family, &violation.corner, &violation.margins) })
    });
    let ends = |unknown: &Unknown| {
        let [low, high] = unknown.within(own.factor);
        json!({ "name": unknown.name, "low": number(low), "high": number(high), "unit": unknown.unit() })
    };
    json!({
        "factor": own.factor,
        "box": family.unknowns.iter().map(ends).collect::<Vec<_>>(),
        "bounds": bounds,
        "violation": violation,
        "reason": own.reason,
    })
}

fn verdict(tuned: &Tuned, verdict: &Verdict) -> Value {
    json!({
        "objective": objective(verdict.objective),
        "nominal": margins(&verdict.nominal),
        "worst": machine(&tuned.family, &verdict.corner, &verdict.worst),
        "unstable": { "axes": verdict.unstable.0, "of": verdict.unstable.1 },
        "moves": verdict.moves.iter().map(motion).collect::<Vec<_>>(),
        "hunting": verdict.hunt.as_ref().map(|hunt| json!({
            "amplitude_m": number(hunt.amplitude), "period_s": number(hunt.period),
            "slips_every_s": number(hunt.slips_every), "irregular": hunt.irregular, "needs": hunt.needs, "watched_s": hunt.watched,
        })),
    })
}

/// The gains of a design.
fn values(tuned: &Tuned, design: &Design) -> Vec<Value> {
    let gain = |gain: crate::tune::Gain| json!({ "key": gain.key, "unit": gain.unit, "value": gain.value });
    gains(design, &tuned.family.machine).into_iter().map(gain).collect()
}

fn least_worse(tuned: &Tuned, least: &Least) -> Value {
    let worse = &least.worse;
    json!({
        "move": worse.motion.map(|motion| &tuned.moves[motion].name),
        "figure": worse.figure.word(),
        "before": number(worse.before),
        "after": number(worse.after),
        "by": number(worse.by),
        "objective": objective(least.objective),
        "gains": values(tuned, &least.design),
        "filters": least.design.filters.len(),
    })
}

fn choice(tuned: &Tuned, choice: &Choice) -> Value {
    let axes = tuned.after.moves.first().map_or(0, |one| one.settled.1);
    let one = |(motion, worst): (&Move, &AtWorst)| {
        let mut object = at_worst(worst, axes);
        object.insert("name".into(), json!(motion.name));
        Value::Object(object)
    };
    json!({
        "name": choice.name,
        "chosen": choice.chosen,
        "objective": objective(choice.objective),
        "gains": values(tuned, &choice.design),
        "filters": choice.design.filters.len(),
        "worst": tuned.moves.iter().zip(&choice.worst).map(one).collect::<Vec<_>>(),
    })
}
