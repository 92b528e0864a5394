//! Frequency responses in words.

use std::f64::consts::PI;
use taut::frf::{Frf, FrfFit};

/// How it was measured, and where it is coherent.
pub fn lines(frf: &Frf) -> Vec<String> {
    let what = match (frf.closed, frf.periodic) {
        (true, true) => "closed loop, by the reference; periods",
        (true, false) => "closed loop, by the reference; segments",
        (false, true) => "open loop; periods",
        (false, false) => "open loop; segments",
    };
    let seconds = frf.length as f64 * frf.every;
    let mut lines =
        vec![format!("{what}: {} of {seconds:.3} s, {:.2} Hz between frequencies", frf.segments, 1.0 / seconds)];
    if frf.input != "input" {
        lines.push(format!("coherence of this input with the others {:.3} in the median", frf.alike));
    }
    let coherent: Vec<_> = frf.coherent().collect();
    lines.push(match (coherent.first(), coherent.last()) {
        (Some(first), Some(last)) => {
            let mut errors: Vec<f64> = coherent.iter().map(|point| point.radius / point.value.norm()).collect();
            errors.sort_by(f64::total_cmp);
            format!(
                "coherent at {} of {} frequencies, from {:.2} to {:.2} Hz; there known to {:.1} % in the median",
                coherent.len(),
                frf.points.len(),
                first.omega / (2.0 * PI),
                last.omega / (2.0 * PI),
                100.0 * errors[errors.len() / 2]
            )
        }
        _ => "coherent nowhere: noise, friction or play hide the response".into(),
    });
    lines
}

/// How well the fit explains them.
pub fn quality(fit: &FrfFit) -> String {
    let mode = fit.mode.map_or(String::new(), |(damping, hertz)| {
        format!("; the first mode then is at {hertz:.2} Hz with a damping ratio of {damping:.4}")
    });
    format!("{} points, squares per degree of freedom {:.2} (1: residuals are noise){mode}", fit.points, fit.chi)
}
