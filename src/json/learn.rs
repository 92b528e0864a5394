//! The learned signal of a repeated move: `taut learn --json`, `learn.json`.

use super::number;
use crate::case::{Case, Move};
use crate::learning::{At, Learned, Size};
use serde_json::{Value, json};

/// The next signal, and what it does.
pub fn learned(case: &Case, motion: &Move, at: At, found: &Learned) -> Value {
    json!({
        "schema": super::identity("learn"),
        "title": case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "move": motion.name,
        "measured": match at { At::Cart => "cart", At::Encoder => "encoder" },
        "unit": case.machine.drives[0].amplifier.mode.unit(),
        "every_s": found.every,
        "axes": found.axes,
        "contraction": number(found.contraction),
        "from_Hz": found.band[0],
        "to_Hz": found.band[1],
        "share": number(found.share),
        "error": size(&found.now),
        "predicted": found.predicted.iter().map(|one| json!({
            "nominal": size(&one.nominal),
            "worst": size(&one.worst),
        })).collect::<Vec<_>>(),
        "largest": found.largest(),
        "added": found.next,
        "added_before": found.before,
        "error_m": found.error,
        "expected_m": found.expected,
        "frequency_Hz": found.points.iter().map(|point| point.frequency).collect::<Vec<_>>(),
        "left": found.points.iter().map(|point| number(point.left)).collect::<Vec<_>>(),
        "kept": found.points.iter().map(|point| number(point.kept)).collect::<Vec<_>>(),
    })
}

fn size(size: &Size) -> Value {
    json!({ "rms_m": number(size.rms), "peak_m": number(size.peak) })
}
