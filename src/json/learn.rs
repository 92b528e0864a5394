//! The learned signal of a repeated move: `taut learn --json`, `learn.json`.

use super::number;
use crate::case::{Case, Move};
use crate::learning::{At, DriveSignal, Learned, Size, SlideError};
use serde_json::{Value, json};

/// The next signal, and what it does.
pub fn learned(case: &Case, motion: &Move, at: At, found: &Learned) -> Value {
    let geometry = case.machine.geometry();
    let drive = |(at, one): (&crate::machine::DriveAt, &DriveSignal)| {
        json!({
            "name": geometry.drive_key(at),
            "largest": one.largest(),
            "added": one.next,
            "added_before": one.before,
        })
    };
    let slide = |(at, one): (&crate::machine::SlideAt, &SlideError)| {
        json!({
            "name": geometry.label(at.body).key,
            "error": size(&one.now),
            "predicted": one.predicted.iter().map(|one| json!({
                "nominal": size(&one.nominal),
                "worst": size(&one.worst),
            })).collect::<Vec<_>>(),
            "error_m": one.error,
            "expected_m": one.expected,
        })
    };
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
        "drives": geometry.drives.iter().zip(&found.drives).map(drive).collect::<Vec<_>>(),
        "loads": geometry.slides.iter().zip(&found.slides).map(slide).collect::<Vec<_>>(),
        "frequency_Hz": found.points.iter().map(|point| point.frequency).collect::<Vec<_>>(),
        "left": found.points.iter().map(|point| number(point.left)).collect::<Vec<_>>(),
        "kept": found.points.iter().map(|point| number(point.kept)).collect::<Vec<_>>(),
    })
}

fn size(size: &Size) -> Value {
    json!({ "rms_m": number(size.rms), "peak_m": number(size.peak) })
}
