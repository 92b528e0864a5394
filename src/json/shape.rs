//! Input shapers: `taut shape --json`, `shape.json`.

use super::fit;
use super::number;
use crate::control::belts::{Belts, Sides};
use crate::control::compare::{Comparison, Pair};
use crate::control::diagonals::{Curve, Diagonals, Model};
use crate::control::pairs;
use crate::control::recommendation::{Findings, Left, ShaperFile, Source};
use crate::control::shaper::Shaper;
use crate::control::shaping::Fitted;
use crate::control::spectrum::Spectrum;
use crate::reach::resonance::{Drive, Resonance};
use serde_json::{Value, json};
use std::path::PathBuf;

/// The shapers of the first file, with those of the second and the comparison under keys of their own.
pub fn shape(found: &Findings) -> Value {
    let mut value = one(&found.each[0]);
    value["schema"] = json!(super::identity("shape"));
    value["version"] = json!(env!("CARGO_PKG_VERSION"));
    value["second"] = found.each.get(1).map_or(Value::Null, one);
    value["comparison"] = found.comparison.as_ref().map_or(Value::Null, comparison);
    value["belts"] = found.belts.as_ref().map_or(Value::Null, belts);
    value
}

fn one(found: &ShaperFile) -> Value {
    let best = found.choice.best();
    let criterion = &found.criterion;
    let mut value = json!({
        "file": found.file.display().to_string(),
        "told": found.told(),
        "recommended": {
            "shaper": best.shaper.form.name(),
            "frequency": best.shaper.frequency,
            "damping": best.shaper.damping,
            "reason": found.choice.reason,
            "lines": found.lines(),
        },
        "firmware": criterion.firmware.word(),
        "fitted_mode": found.mode.map(|mode| json!({
            "frequency": mode.frequency, "damping": mode.damping, "interval": mode.interval, "error": mode.error,
        })),
        "shapers": found.choice.fitted.iter().map(fitted).collect::<Vec<_>>(),
        "pairs": found.choice.pairs.iter().map(pair).collect::<Vec<_>>(),
        "recommended_pair": found.choice.pairs.first().filter(|_| found.choice.is_pair_better).map(|pair| json!({
            "told": found.pair_told(), "line": pair.line(),
        })),
        "criterion": {
            "design_damping": criterion.damping,
            "tested_dampings": match &found.source {
                // Each mode has the damping of the model.
                Source::Model { modes, .. } => modes.iter().map(|mode| mode.damping).collect(),
                _ => criterion.tested.clone(),
            },
            "corner_acceleration": criterion.corner.acceleration,
            "corner_speed": criterion.corner.speed,
            "motor_acceleration": criterion.motor_acceleration,
            "max_smoothing": criterion.max_smoothing,
            "max_vibrations": criterion.max_vibrations,
        },
    });
    match &found.source {
        Source::Spectrum(spectrum) => {
            value["peaks"] = peaks(&spectrum.peaks());
            value["spectrum"] =
                json!({ "axis": spectrum.axis.word(), "frequency": spectrum.frequency, "density": spectrum.density });
        }
        Source::Spectra(spectra) => {
            let one = |(file, spectrum): &(PathBuf, Spectrum)| {
                json!({
                    "file": file.display().to_string(),
                    "peaks": peaks(&spectrum.peaks()),
                    "axis": spectrum.axis.word(),
                    "frequency": spectrum.frequency,
                    "density": spectrum.density,
                })
            };
            value["spectra"] = spectra.iter().map(one).collect();
        }
        Source::Model { title, coordinate, drive, modes, .. } => {
            let mode = |mode: &Resonance| json!({ "position": mode.position, "frequency": mode.frequency, "damping": mode.damping, "share": mode.share });
            let drive = if *drive == Drive::Held { "held" } else { "free" };
            value["model"] = json!({
                "title": title,
                "coordinate": coordinate.map(|coordinate| coordinate.label.key),
                "motor": drive,
                "modes": modes.iter().map(mode).collect::<Vec<_>>(),
                "uncertainty": found.uncertainty,
                "along_travel": found.left().iter().map(left).collect::<Vec<_>>(),
            });
        }
    }
    value
}

fn fitted(fitted: &Fitted) -> Value {
    let impulses: Vec<[f64; 2]> = fitted.shaper.impulses().iter().map(|(t, a)| [*t, *a]).collect();
    json!({
        "shaper": fitted.shaper.form.name(),
        "frequency": fitted.shaper.frequency,
        "vibration": fitted.vibration,
        "smoothing": fitted.smoothing,
        "max_acceleration": fitted.max_acceleration,
        "score": fitted.score,
        "candidate": fitted.is_candidate,
        "lowest_tried": fitted.is_lowest,
        "impulses": impulses,
    })
}

fn pair(pair: &pairs::Pair) -> Value {
    let part = |shaper: &Shaper| json!({ "shaper": shaper.form.name(), "frequency": shaper.frequency });
    let impulses: Vec<[f64; 2]> = pair.impulses().iter().map(|(t, a)| [*t, *a]).collect();
    json!({
        "parts": pair.parts.iter().map(part).collect::<Vec<_>>(),
        "vibration": pair.vibration,
        "smoothing": pair.smoothing,
        "max_acceleration": pair.max_acceleration,
        "score": pair.score,
        "impulses": impulses,
    })
}

fn left(left: &Left) -> Value {
    json!({
        "frequency": left.reach.frequency,
        "damping": left.reach.damping,
        "share": left.reach.share,
        "shapers": left.shapers,
        "pairs": left.pairs,
    })
}

fn peaks(peaks: &[(f64, f64)]) -> Value {
    peaks.iter().map(|(f, p)| json!({ "frequency": f, "density": p })).collect()
}

/// The statement in the form that fits have, with its model.
fn belts(found: &Diagonals) -> Value {
    let open = Belts { sides: Sides::Belts, ratio: f64::NAN, error: f64::INFINITY };
    let mut value = fit::belts(found.stated.as_ref().unwrap_or(&open));
    value["words"] = json!(found.words());
    value["refusal"] = json!(found.stated.as_ref().err());
    value["model"] = found.model.as_ref().map_or(Value::Null, |model| {
        let Model { frequencies, mass_ratio, misfit, turned, curves } = model;
        let curve = |Curve { frequency, measured, fitted }: &Curve| json!({ "frequency": frequency, "measured": measured, "fitted": fitted });
        json!({
            "frequencies": frequencies,
            "mass_ratio": number(*mass_ratio),
            "misfit": number(*misfit),
            "turned": number(*turned),
            "curves": curves.each_ref().map(curve),
        })
    });
    value
}

fn comparison(comparison: &Comparison) -> Value {
    let pair = |pair: &Pair| json!({ "first": pair.first.0, "second": pair.second.0, "stiffness_per_mass": pair.stiffness_per_mass() });
    json!({
        "similarity": comparison.similarity,
        "level": comparison.level,
        "resolution": comparison.resolution,
        "main_peaks": comparison.main.as_ref().map(pair),
        "common_peaks": comparison.pairs.iter().map(pair).collect::<Vec<_>>(),
        "only_first": peaks(&comparison.only_first),
        "only_second": peaks(&comparison.only_second),
        "suggests": comparison.suggestions(),
    })
}
