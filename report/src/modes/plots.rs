//! Bode diagram, map of the travel, map of poles and zeros.

use super::rows::words;
use crate::simulate::Named;
use crate::{Axis, Colour, Figure, Panel, Series, Style};
use nalgebra::Complex;
use std::f64::consts::PI;
use taut::linear::{Analysis, Place, Response, Root, StateSpace};

/// Outputs drawn together, with the name of the figure.
const GROUPS: [(&str, &str, &[&str]); 3] = [
    ("bode-position", "positions", &["drive_angle", "cart_position"]),
    ("bode-speed", "speeds", &["drive_speed", "cart_speed"]),
    ("bode-force", "span forces", &["span1_force", "span2_force", "span3_force"]),
];

/// All of them.
pub fn figures(analysis: &Analysis) -> Vec<Named> {
    let mut figures: Vec<Named> = GROUPS
        .iter()
        .filter_map(|(name, title, outputs)| bode(analysis, title, outputs).map(|figure| (*name, figure)))
        .collect();
    figures.extend(analysis.travel.as_ref().map(|travel| ("travel", map(travel))));
    figures.push(("poles-and-zeros", roots(analysis)));
    figures
}

/// Magnitude and phase over frequency; angles and their rates as they are at the belt, so that the two can be compared.
fn bode(analysis: &Analysis, title: &str, outputs: &[&str]) -> Option<Figure> {
    let label = |name: &str| match name {
        "drive_angle" => "drive pulley r φ₁".into(),
        "drive_speed" => "drive pulley r φ̇₁".into(),
        "cart_position" => "cart x".into(),
        "cart_speed" => "cart ẋ".into(),
        name => words(name),
    };
    let radius = analysis.case.machine.pulley_radius;
    response(&analysis.system, &analysis.responses, radius, title, outputs, &label)
}

/// The responses of these outputs; those of pulleys are taken at the pitch circle.
pub(super) fn response(
    system: &StateSpace,
    responses: &[Response],
    radius: f64,
    title: &str,
    outputs: &[&str],
    label: &dyn Fn(&str) -> String,
) -> Option<Figure> {
    let unit = match outputs.first()? {
        name if name.contains("force") => "N",
        name if name.contains("speed") => "m/s",
        _ => "m",
    };
    let input = system.input.unit;
    let mut magnitude = Panel::new(Axis::new(format!("Magnitude, dB of 1 {unit} per {input}"), "")).weight(1.3);
    let mut phase = Panel::new(Axis::new("Phase", "°"));
    let mut drawn = 0;
    for (name, style) in outputs.iter().zip([Style::Solid, Style::Solid, Style::Dashed, Style::Dashed]) {
        let Some(index) = system.output(name) else { continue };
        let response = &responses[index];
        let turns = system.outputs[index].unit.starts_with("rad");
        let shift = if turns { 20.0 * radius.log10() } else { 0.0 };
        let hertz: Vec<f64> = response.frequency.iter().map(|omega| omega / (2.0 * PI)).collect();
        let decibels: Vec<f64> = response.decibels().iter().map(|value| value + shift).collect();
        let colour = Colour::CYCLE[drawn % Colour::CYCLE.len()];
        magnitude = magnitude.series(Series::new(label(name), hertz.clone(), decibels).colour(colour).style(style));
        phase = phase.series(Series::new("", hertz, response.degrees()).colour(colour).style(style));
        drawn += 1;
    }
    (drawn > 0).then(|| {
        Figure::new(format!("Frequency response: {title}"), Axis::new("Frequency", "Hz").logarithmic())
            .panel(magnitude)
            .panel(phase)
            .caption(
                "Phases run on without jumps from the limit of zero frequency, which is taken above −360° and at most 0°.",
            )
    })
}

/// Resonance and anti-resonance over the cart's position.
fn map(travel: &[Place]) -> Figure {
    let mut panel = Panel::new(Axis::new("Frequency", "Hz").logarithmic()).weight(1.4);
    let mut damping = Panel::new(Axis::new("Damping ratio", ""));
    let count = travel.iter().map(|place| place.resonances.len().max(place.antiresonances.len())).max().unwrap_or(0);
    let position = || -> Vec<f64> { travel.iter().map(|place| place.position).collect() };
    for (pick, word, style) in [
        ((|place| &place.resonances) as fn(&Place) -> &Vec<Root>, "resonance", Style::Solid),
        (|place| &place.antiresonances, "anti-resonance", Style::Dashed),
    ] {
        for k in 0..count {
            let value = |of: fn(Root) -> f64| -> Vec<f64> {
                travel.iter().map(|place| pick(place).get(k).map_or(f64::NAN, |root| of(*root))).collect()
            };
            let hertz = value(|root| root.hertz().unwrap_or(f64::NAN));
            if hertz.iter().all(|v| v.is_nan()) {
                continue;
            }
            let ratio = value(|root| if let Root::Pair { damping, .. } = root { damping } else { f64::NAN });
            let colour = Colour::CYCLE[k % Colour::CYCLE.len()];
            let name = format!("{word} {}", k + 1);
            panel = panel.series(Series::new(name, position(), hertz).colour(colour).style(style));
            damping = damping.series(Series::new("", position(), ratio).colour(colour).style(style));
        }
    }
    Figure::new("Along the travel", Axis::new("Cart position", "m").shown_as("mm", 1e3))
        .panel(panel)
        .panel(damping)
        .caption("Natural frequencies of the poles, and of the zeros of the drive angle, with the cart at each place.")
}

/// Poles and zeros in the upper half plane; distances from zero are drawn on a scale that shows slow and fast ones.
fn roots(analysis: &Analysis) -> Figure {
    // asinh: straight near zero, logarithmic far out.
    let squeeze = |v: f64| v.asinh() / std::f64::consts::LN_10;
    let points = |values: &[Complex<f64>]| -> (Vec<f64>, Vec<f64>) {
        values.iter().map(|v| (squeeze(v.re), squeeze(v.im))).unzip()
    };
    let mut panel = Panel::new(Axis::new("Im s as sgn · lg(2 |Im|)", "")).weight(1.4);
    let mut add = |name: String, values: &[Complex<f64>], colour, style| {
        let (x, y) = points(values);
        let panel_now = std::mem::replace(&mut panel, Panel::new(Axis::new("", "")));
        panel = panel_now.series(Series::new(name, x, y).style(style).colour(colour));
    };
    let wanted = [("drive_angle", Colour::Blue), ("cart_position", Colour::Green), ("span1_force", Colour::Amber)];
    if let Some(transfer) = analysis.transfers.first() {
        add("poles".into(), &transfer.poles, Colour::Vermillion, Style::Crosses);
    }
    for (name, colour) in wanted {
        if let Some(index) = analysis.system.output(name) {
            add(format!("zeros of {}", words(name)), &analysis.transfers[index].zeros.values, colour, Style::Rings);
        }
    }
    Figure::new("Poles and zeros", Axis::new("Re s as sgn · lg(2 |Re|), 1/s", ""))
        .panel(panel)
        .vertical(0.0, "")
        .caption("Both axes are drawn as asinh(v)/ln 10: 3 is about 500 1/s, 4 about 5000 1/s; on the right grows what is there.")
}
