//! Measured responses over those of the model, and coherence.

use crate::{Axis, Colour, Figure, Panel, Series, Style};
use nalgebra::Complex;
use std::f64::consts::PI;
use taut::frf::{COHERENT, Measurement, Response};
use taut::machine::Machine;

/// One for each response.
pub fn figures(found: &Measurement, machine: &Machine) -> Vec<(String, Figure)> {
    let one = |(k, response): (usize, &Response)| (format!("response-{}", k + 1), bode(response, machine));
    found.responses.iter().enumerate().map(one).collect()
}

fn bode(one: &Response, machine: &Machine) -> Figure {
    let frf = &one.frf;
    let unit = machine.drives[frf.drive].amplifier.mode.unit();
    let hertz: Vec<f64> = frf.points.iter().map(|point| point.omega / (2.0 * PI)).collect();
    let decibels = |value: f64| 20.0 * value.max(1e-300).log10();
    let measured: Vec<Complex<f64>> = frf.points.iter().map(|point| point.value).collect();
    let edge = |sign: f64| -> Vec<f64> {
        let of = |point: &taut::frf::Point| match point.value.norm() + sign * point.radius {
            size if size > 0.0 => decibels(size),
            _ => f64::NAN,
        };
        frf.points.iter().map(of).collect()
    };
    let mut magnitude = Panel::new(Axis::new(format!("Magnitude, dB of 1/{unit}"), "")).weight(1.6);
    let mut phase = Panel::new(Axis::new("Phase", "°"));
    let curves = [
        ("model of the file", &one.model, Colour::Amber, Style::Dashed),
        ("model as fitted", &one.fitted, Colour::Blue, Style::Solid),
        ("measured", &measured, Colour::Ink, Style::Points),
    ];
    for (name, values, colour, style) in curves {
        if values.is_empty() {
            continue;
        }
        let sizes: Vec<f64> = values.iter().map(|value| decibels(value.norm())).collect();
        let angles: Vec<f64> = values.iter().map(|value| value.arg().to_degrees()).collect();
        magnitude = magnitude.series(Series::new(name, hertz.clone(), sizes).colour(colour).style(style));
        phase = phase.series(Series::new("", hertz.clone(), angles).colour(colour).style(style));
    }
    for (name, sign) in [("95 %", 1.0), ("", -1.0)] {
        let series = Series::new(name, hertz.clone(), edge(sign)).colour(Colour::Ink).style(Style::Dotted);
        magnitude = magnitude.series(series);
    }
    let coherence: Vec<f64> = frf.points.iter().map(|point| point.coherence).collect();
    let below = Panel::new(Axis::new("Coherence", ""))
        .series(Series::new("", hertz, coherence).colour(Colour::Ink))
        .horizontal(COHERENT, "");
    Figure::new(frf.title(), Axis::new("Frequency", "Hz").logarithmic())
        .panel(magnitude)
        .panel(phase)
        .panel(below)
        .caption(
            "The response without a model, between dotted lines that hold it in 95 of 100 logs, over that of the sampled model. Points below \
             the line of coherence are used for nothing.",
        )
}
