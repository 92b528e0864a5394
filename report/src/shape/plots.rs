//! Spectra with and without shapers, what shapers leave at each frequency, and modes along the travel.

use crate::{Axis, Colour, Figure, Panel, Series, Style};
use taut::control::diagonals::Curve;
use taut::control::recommendation::{Findings, ShaperFile, Source, damping};
use taut::control::shaping::Target;
use taut::control::spectrum::Spectrum;
use taut::reach::resonance::Resonance;

/// All figures, with the names of their files.
pub fn figures(found: &Findings) -> Vec<(String, Figure)> {
    let mut figures = Vec::new();
    for (i, one) in found.each.iter().enumerate() {
        let name = if i == 0 { "spectrum" } else { "spectrum-2" };
        match &one.source {
            Source::Spectrum(spectrum) => {
                figures.push((name.to_string(), shaped(one, one.name(), spectrum)));
                figures.push((name.replace("spectrum", "axes"), axes(one, spectrum)));
            }
            Source::Spectra(spectra) => {
                for (k, (file, spectrum)) in spectra.iter().enumerate() {
                    let title = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
                    let name = if k == 0 { name.to_string() } else { format!("spectrum-of-{}", k + 1) };
                    figures.push((name, shaped(one, title, spectrum)));
                }
            }
            Source::Model { modes, .. } => figures.push((name.replace("spectrum", "modes"), model(one, modes))),
        }
    }
    if let [a, b] = found.each.as_slice()
        && let (Source::Spectrum(first), Source::Spectrum(second)) = (&a.source, &b.source)
    {
        figures.push(("compared".into(), compared(found, first, second)));
    }
    if let Some(model) = found.belts.as_ref().and_then(|belts| belts.model.as_ref()) {
        for (curve, letter) in model.curves.iter().zip(["a", "b"]) {
            figures.push((format!("{BELT}{letter}"), belt(letter, curve)));
        }
    }
    figures
}

/// How names of figures of belts begin.
pub const BELT: &str = "belt-";

/// Measured and fitted densities along x and y while one belt is shaken.
fn belt(letter: &str, curve: &Curve) -> Figure {
    let mut figure = Figure::new(format!("Belt {}", letter.to_uppercase()), Axis::new("Frequency", "Hz"));
    for (axis, name) in ["x", "y"].iter().enumerate() {
        let series = |name: String, values: &[f64]| Series::new(name, curve.frequency.clone(), values.to_vec());
        let measured = series(format!("measured along {name}"), &curve.measured[axis]).colour(Colour::Ink);
        let fitted = series(format!("CoreXY along {name}"), &curve.fitted[axis]).colour(colour(0)).style(Style::Dashed);
        figure = figure.panel(Panel::new(Axis::new("Density", "(mm/s^2)^2/Hz")).series(measured).series(fitted));
    }
    figure.caption(
        "The acceleration while the motor of this belt shakes and the other holds, and the curve of the CoreXY.",
    )
}

fn density() -> Axis {
    Axis::new("Density / frequency", "(mm/s^2)^2/Hz^2")
}

/// The spectrum, what the recommended shaper leaves of it, and what each shaper leaves at each frequency.
fn shaped(one: &ShaperFile, title: String, spectrum: &Spectrum) -> Figure {
    let f = &spectrum.frequency;
    let best = one.choice.best();
    let mut above = Panel::new(density())
        .series(Series::new("measured", f.clone(), spectrum.density.clone()).colour(Colour::Ink))
        .weight(1.4);
    for (i, fitted) in one.choice.fitted.iter().enumerate() {
        let left = Target::left(spectrum, &fitted.shaper, &one.criterion.tested);
        let is_best = i == one.choice.recommended;
        let name = format!("{} {:.1} Hz", fitted.shaper.form.name(), fitted.shaper.frequency);
        let style = if is_best { Style::Solid } else { Style::Dashed };
        above = above.series(Series::new(name, f.clone(), left).colour(colour(i)).style(style));
    }
    Figure::new(title, Axis::new("Frequency", "Hz"))
        .panel(above)
        .panel(responses(one, f, &one.criterion.tested))
        .vertical(best.shaper.frequency, "")
        .caption(format!(
            "Above the spectrum as measured and behind each shaper, below the part of the vibration that each leaves, \
             both at the worst of the evaluated damping ratios. Recommended: {} at {:.1} Hz, the solid line; the \
             vertical line is its frequency.",
            best.shaper.form.name(),
            best.shaper.frequency
        ))
}

fn colour(i: usize) -> Colour {
    Colour::CYCLE[i % Colour::CYCLE.len()]
}

fn responses(one: &ShaperFile, f: &[f64], dampings: &[f64]) -> Panel {
    let mut panel = Panel::new(Axis::new("Vibration left", "%").shown_as("%", 100.0));
    let (low, high) = (f.first().copied().unwrap_or(0.0), f.last().copied().unwrap_or(200.0));
    let fine: Vec<f64> = (0..=800).map(|k| low + (high - low) * f64::from(k) / 800.0).collect();
    for (i, fitted) in one.choice.fitted.iter().enumerate() {
        let left = |f: &f64| dampings.iter().map(|z| fitted.shaper.residual_vibration(*f, *z)).fold(0.0, f64::max);
        let curve: Vec<f64> = fine.iter().map(left).collect();
        let style = if i == one.choice.recommended { Style::Solid } else { Style::Dashed };
        panel = panel.series(Series::new("", fine.clone(), curve).colour(colour(i)).style(style));
    }
    panel.horizontal(0.05, "5 %")
}

/// The axes of the accelerometer.
fn axes(one: &ShaperFile, spectrum: &Spectrum) -> Figure {
    let mut panel = Panel::new(density());
    for (name, values) in ["x", "y", "z"].iter().zip(&spectrum.axes) {
        panel = panel.line(*name, &spectrum.frequency, values);
    }
    Figure::new(format!("{}: axes", one.name()), Axis::new("Frequency", "Hz"))
        .panel(panel)
        .caption("Each axis of the accelerometer.")
}

/// Frequencies of a model, and what shapers leave there.
fn model(one: &ShaperFile, modes: &[Resonance]) -> Figure {
    let high = modes.iter().filter(|mode| mode.share > 0.05).map(|mode| mode.frequency).fold(0.0, f64::max);
    // A line for each mode, from zero up.
    let (mut at, mut height) = (Vec::new(), Vec::new());
    for mode in modes.iter().filter(|mode| mode.frequency <= 1.5 * high) {
        at.extend([mode.frequency; 3]);
        height.extend([0.0, mode.share, f64::NAN]);
    }
    let lines = Series::new("modes", at, height);
    let above = Panel::new(Axis::new("Motion of the cart", "")).series(lines.colour(Colour::Ink));
    let mut legend = responses(one, &[0.0, 1.5 * high], &[damping(modes)]);
    for (series, fitted) in legend.series.iter_mut().zip(&one.choice.fitted) {
        series.name = format!("{} {:.1} Hz", fitted.shaper.form.name(), fitted.shaper.frequency);
    }
    Figure::new(one.name(), Axis::new("Frequency", "Hz"))
        .panel(above.weight(0.6))
        .panel(legend)
        .vertical(one.choice.best().shaper.frequency, "")
        .caption(
            "Above the modes at all places of the travel, by how far each moves the cart, of the strongest; below what each \
             shaper leaves of a mode with the strongest ones' mean damping ratio. The solid line is the recommended one.",
        )
}

/// Both spectra, each of its own height and to one scale.
fn compared(found: &Findings, first: &Spectrum, second: &Spectrum) -> Figure {
    let [a, b] = [&found.each[0], &found.each[1]].map(ShaperFile::name);
    Figure::new("Compared", Axis::new("Frequency", "Hz"))
        .panel(Panel::new(density()).line(a, &first.frequency, &first.density).line(
            b,
            &second.frequency,
            &second.density,
        ))
        .caption("Both spectra to one scale.")
}
