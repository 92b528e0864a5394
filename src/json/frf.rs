//! Measured frequency responses: `taut frf --json`, `frf.json`.

use super::number;
use crate::case::Case;
use crate::frf::{Measurement, Response};
use nalgebra::Complex;
use serde_json::{Value, json};
use std::f64::consts::PI;

/// Responses, fit and margins.
pub fn frf(case: &Case, found: &Measurement) -> Value {
    let pair =
        |(value, [low, high]): (f64, [f64; 2])| json!({ "value": value, "interval": [number(low), number(high)] });
    let fit = found.fit.as_ref().ok().map(|fit| {
        json!({
            "stiffness": pair(fit.stiffness),
            "damping_s": pair(fit.damping),
            "delay_s": pair(fit.delay),
            "gain": pair(fit.gain),
            "spans_N_per_m": fit.spans.to_vec(),
            "chi": number(fit.chi),
            "points": fit.points,
            "mode_Hz": fit.mode.map(|mode| mode.1),
            "mode_damping_ratio": fit.mode.map(|mode| mode.0),
        })
    });
    json!({
        "schema": super::identity("frf"),
        "title": case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "place_m": found.known.place,
        "bridge_m": case.machine.bridge.as_ref().map(|_| found.known.bridge),
        "delay_s": found.known.delay,
        "responses": found.responses.iter().map(response).collect::<Vec<_>>(),
        "warnings": found.warnings,
        "fit": fit,
        "fit_words": found.fit.as_ref().err().map(|error| error.what.clone()),
    })
}

fn response(one: &Response) -> Value {
    let frf = &one.frf;
    let column = |of: &dyn Fn(&crate::frf::Point) -> f64| -> Vec<f64> { frf.points.iter().map(of).collect() };
    let parts = |values: &[Complex<f64>]| -> [Vec<f64>; 2] {
        [values.iter().map(|v| v.re).collect(), values.iter().map(|v| v.im).collect()]
    };
    let ([model_real, model_imaginary], [fitted_real, fitted_imaginary]) = (parts(&one.model), parts(&one.fitted));
    let margins = one.margins.map(|m| {
        json!({
            "sensitivity": m.sensitivity.0,
            "sensitivity_at_Hz": m.sensitivity.1 / (2.0 * PI),
            "sensitivity_at_most": number(m.sensitivity_at_most),
            "phase_margin_rad": m.phase.map(|phase| phase.0),
            "gain_margin": m.gain.map(|gain| gain.0),
            "added_delay_s": m.late,
            "from_Hz": m.range[0] / (2.0 * PI),
            "to_Hz": m.range[1] / (2.0 * PI),
        })
    });
    json!({
        "log": frf.name,
        "input": frf.input,
        "quantity": frf.quantity.name(),
        "input_coherence": frf.alike,
        "closed_loop": frf.closed,
        "periodic": frf.periodic,
        "segments": frf.segments,
        "samples": frf.length,
        "every_s": frf.every,
        "frequency_Hz": column(&|point| point.omega / (2.0 * PI)),
        "real": column(&|point| point.value.re),
        "imaginary": column(&|point| point.value.im),
        "radius": column(&|point| point.radius),
        "coherence": column(&|point| point.coherence),
        "model_real": model_real,
        "model_imaginary": model_imaginary,
        "fitted_real": fitted_real,
        "fitted_imaginary": fitted_imaginary,
        "margins": margins,
    })
}
