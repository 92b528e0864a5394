//! The summary for machines.

use super::{Done, Tried};
use serde_json::{Value, json};
use taut::control::Deviation;
use taut::metrics::Peak;
use taut::solve::Ending;

/// As JSON: one object for one case, a list of them for several; numbers to the last bit.
pub fn text(tried: &[Tried]) -> String {
    let value = match tried {
        [one] => case(one),
        several => Value::Array(several.iter().map(case).collect()),
    };
    let mut text = serde_json::to_string_pretty(&value).unwrap_or_default();
    text.push('\n');
    text
}

fn case(tried: &Tried) -> Value {
    json!({
        "title": tried.case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "structure": tried.design.structure.name(),
        "every_s": tried.design.every,
        "delay_s": tried.design.delay,
        "moves": tried.done.iter().map(motion).collect::<Vec<_>>(),
    })
}

fn peak(peak: Peak) -> Value {
    json!({ "value": peak.value, "time_s": peak.time })
}

fn deviation(deviation: Deviation) -> Value {
    json!({ "peak_m": deviation.peak.value, "time_s": deviation.peak.time, "rms_m": deviation.rms, "last_m": deviation.last })
}

fn motion(done: &Done) -> Value {
    let (run, figures) = (&done.run, &done.run.figures);
    let (ending, time) = match run.outcome.ending {
        Ending::Complete => ("complete", run.metrics.end),
        Ending::TooManyEvents { time } => ("too_many_events", time),
        Ending::LeftTravel { time } => ("left_travel", time),
        Ending::Diverged { time } => ("diverged", time),
        Ending::Interrupted { time } => ("interrupted", time),
    };
    let mut value = json!({
        "name": done.motion.name,
        "files": done.files,
        "ending": { "word": ending, "time_s": time },
        "profile_end_s": done.motion.profile.end(),
        "target_m": done.motion.profile.target(),
        "cart_error": deviation(figures.cart),
        "following_error": deviation(figures.following),
        "window_m": done.motion.window,
        "settling_s": figures.settling,
        "overshoot_m": figures.overshoot,
        "peak_stretch": run.metrics.peak_stretch.map(peak),
        "peak_force_N": run.metrics.peak_force.map(peak),
        "peak_current_A": peak(figures.current.0),
        "rms_current_A": figures.current.1,
        "peak_voltage_V": peak(figures.voltage.0),
        "rms_voltage_V": figures.voltage.1,
        "limited_s": figures.limited,
        "amplifier_limited_s": figures.amplifier_limited,
        "energy_in_J": figures.energy.0,
        "energy_back_J": figures.energy.1,
        "command_turns_per_s": figures.restlessness,
        "samples": run.samples.0,
        "limited_samples": run.samples.1,
        "events": run.outcome.events.len(),
    });
    if let (Some(worst), Value::Object(object)) = (&done.worst, &mut value) {
        object.insert(
            "spread".into(),
            json!({
                "cart_error_m": worst.error, "axis": worst.axis, "last_m": worst.last,
                "settled": worst.settled, "axes": worst.axes,
            }),
        );
    }
    value
}
