//! Bode diagram, map of the travel, map of poles and zeros.

use super::rows::words;
use crate::{Axis, Colour, Figure, Map, Panel, Picture, Plane, Series, Style};
use nalgebra::Complex;
use std::f64::consts::PI;
use taut::linear::{Analysis, ByInput, ResonanceMap, ResonancesAt, Response, Root, StateSpace};
use taut::machine::{Machine, Part};
use taut::number::engineering;

/// Figures of an analysis, each with its name in file names.
#[derive(Default)]
pub struct Pictures {
    /// Responses of each input, in the order of the drives.
    pub bode: Vec<Vec<(String, Figure)>>,
    /// Resonance and anti-resonance along the travel of an axis.
    pub travel: Option<Figure>,
    /// A map of each elastic mode over the working area of a gantry.
    pub maps: Vec<(String, Plane)>,
    /// Poles and zeros of each input.
    pub roots: Vec<(String, Figure)>,
}

impl Pictures {
    /// All of them, by the names of their files.
    pub fn into_files(self) -> Vec<(String, Picture)> {
        let figures = self.bode.into_iter().flatten();
        let figures = figures.chain(self.travel.map(|figure| ("travel".to_string(), figure)));
        let figures = figures.chain(self.roots).map(|(name, figure)| (name, figure.into()));
        figures.chain(self.maps.into_iter().map(|(name, plane)| (name, plane.into()))).collect()
    }
}

/// All of them.
pub fn pictures(analysis: &Analysis) -> Pictures {
    let machine = &analysis.case.machine;
    // One input needs no name.
    let several = analysis.inputs.len() > 1;
    let named = |one: &ByInput, name: &str| match several {
        true => format!("{name}-{}", one.system.input.name.replace('_', "-")),
        false => name.to_string(),
    };
    let of_input = |one: &ByInput| -> Vec<(String, Figure)> {
        let title = |to: &str| match several {
            true => format!("{} to {to}", words(&one.system.input.name)),
            false => to.to_string(),
        };
        let group = |(name, to, outputs): Group| {
            let figure = response(&one.system, &one.responses, machine.pulley_radius, &title(to), &outputs);
            figure.map(|figure| (named(one, name), figure))
        };
        groups(machine).into_iter().filter_map(group).collect()
    };
    Pictures {
        bode: analysis.inputs.iter().map(of_input).collect(),
        travel: analysis.travel.as_deref().map(along),
        maps: analysis.map.as_ref().map(maps).unwrap_or_default(),
        roots: analysis.inputs.iter().map(|one| (named(one, "poles-and-zeros"), roots(analysis, one))).collect(),
    }
}

/// The name of a figure, its title, and the outputs in it with what they are called there.
type Group = (&'static str, &'static str, Vec<(String, String)>);

/// Outputs drawn together, each with what it is called there: the name of the figure, its title, the outputs. Angles
/// and their rates are taken at the belt, so that they compare with what slides.
fn groups(machine: &Machine) -> [Group; 3] {
    let geometry = machine.geometry();
    let slides = geometry.slides.iter().zip(["x", "y"]).map(|(slide, symbol)| (slide.body, symbol));
    let pulleys = geometry.bodies.iter().enumerate().filter(|(_, body)| body.part == Part::DrivePulley);
    let of = |angle: &str, position: &str, dot: &str| -> Vec<(String, String)> {
        let pulleys =
            pulleys.clone().map(|(_, body)| (body, format!("{}_{angle}", body.label.key), format!("r φ{dot}")));
        let slides = slides.clone().map(|(body, symbol)| {
            let body = &geometry.bodies[body];
            (body, format!("{}_{position}", body.label.key), format!("{symbol}{dot}"))
        });
        pulleys.chain(slides).map(|(body, name, symbol)| (name, format!("{} {symbol}", body.label.name))).collect()
    };
    let spans = geometry.spans.iter().map(|span| (format!("{}_force", span.column), span.label.name.to_string()));
    [
        ("bode-position", "positions", of("angle", "position", "")),
        ("bode-speed", "speeds", of("speed", "speed", "\u{307}")),
        ("bode-force", "span forces", spans.collect()),
    ]
}

/// The responses of these outputs; those of pulleys are taken at the pitch circle.
fn response(
    system: &StateSpace,
    responses: &[Response],
    radius: f64,
    title: &str,
    outputs: &[(String, String)],
) -> Option<Figure> {
    let unit = match &outputs.first()?.0 {
        name if name.contains("force") => "N",
        name if name.contains("speed") => "m/s",
        _ => "m",
    };
    let input = system.input.unit;
    let mut magnitude = Panel::new(Axis::new(format!("Magnitude, dB of 1 {unit} per {input}"), "")).weight(1.3);
    let mut phase = Panel::new(Axis::new("Phase", "°"));
    let mut drawn = 0;
    for ((name, label), style) in outputs.iter().zip([Style::Solid, Style::Solid, Style::Dashed, Style::Dashed]) {
        let Some(index) = system.output(name) else { continue };
        let response = &responses[index];
        let turns = system.outputs[index].unit.starts_with("rad");
        let shift = if turns { 20.0 * radius.log10() } else { 0.0 };
        let hertz: Vec<f64> = response.frequency.iter().map(|omega| omega / (2.0 * PI)).collect();
        let decibels: Vec<f64> = response.decibels().iter().map(|value| value + shift).collect();
        let colour = Colour::CYCLE[drawn % Colour::CYCLE.len()];
        magnitude = magnitude.series(Series::new(label.clone(), hertz.clone(), decibels).colour(colour).style(style));
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
fn along(travel: &[ResonancesAt]) -> Figure {
    let mut panel = Panel::new(Axis::new("Frequency", "Hz").logarithmic()).weight(1.4);
    let mut damping = Panel::new(Axis::new("Damping ratio", ""));
    let count = travel.iter().map(|place| place.resonances.len().max(place.antiresonances.len())).max().unwrap_or(0);
    let position = || -> Vec<f64> { travel.iter().map(|place| place.position).collect() };
    for (pick, word, style) in [
        ((|place| &place.resonances) as fn(&ResonancesAt) -> &Vec<Root>, "resonance", Style::Solid),
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
fn roots(analysis: &Analysis, one: &ByInput) -> Figure {
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
    add("poles".into(), &analysis.poles, Colour::Vermillion, Style::Crosses);
    let groups = groups(&analysis.case.machine);
    let wanted = groups[0].2.iter().chain(groups[2].2.first()).map(|(name, _)| name);
    for (name, colour) in wanted.zip([Colour::Blue, Colour::Green, Colour::Amber].into_iter().cycle()) {
        if let Some(index) = one.system.output(name) {
            add(format!("zeros of {}", words(name)), &one.transfers[index].zeros.values, colour, Style::Rings);
        }
    }
    Figure::new("Poles and zeros", Axis::new("Re s as sgn · lg(2 |Re|), 1/s", ""))
        .panel(panel)
        .vertical(0.0, "")
        .caption("Both axes are drawn as asinh(v)/ln 10: 3 is about 500 1/s, 4 about 5000 1/s; on the right grows what is there.")
}

/// A map of each elastic mode, seen as the drawing is.
fn maps(map: &ResonanceMap) -> Vec<(String, Plane)> {
    let millimetres = |name: &str| Axis::new(name, "m").shown_as("mm", 1e3);
    let plane = |(k, hertz): (usize, &Vec<Vec<f64>>)| {
        let [(least, at), (most, to)] = map.range(k);
        let place = |(x, y): (f64, f64)| format!("x = {}, y = {}", engineering(x, "m", 3), engineering(y, "m", 3));
        let caption = format!(
            "Undamped frequency with the bridge at x and the cart at y: from {} at {} to {} at {}.",
            engineering(least, "Hz", 4),
            place(at),
            engineering(most, "Hz", 4),
            place(to)
        );
        let shown = Map {
            value: Axis::new("Frequency", "Hz"),
            across: map.cart.clone(),
            up: map.bridge.clone(),
            values: hertz.clone(),
        };
        let plane = Plane::new(format!("Elastic mode {}", k + 1), millimetres("Cart y"), millimetres("Bridge x"));
        (format!("elastic-{}", k + 1), plane.map(shown).caption(caption))
    };
    map.hertz.iter().enumerate().map(plane).collect()
}
