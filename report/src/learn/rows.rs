//! A learned signal in words.

use crate::motion::length;
use crate::simulate::value;
use taut::learning::{Learned, SlideError};
use taut::machine::Machine;

/// The answer in a line.
pub fn head(found: &Learned, machine: &Machine) -> String {
    let one = |(name, slide): (String, &SlideError)| {
        let next = slide.predicted.first().map_or(slide.now, |predicted| predicted.worst);
        let now = length(slide.now.rms);
        format!("{name} {now} rms now, at most {} after the next repetition", length(next.rms))
    };
    errors(found, machine).map(one).collect::<Vec<_>>().join("; ")
}

/// The errors with their names.
fn errors<'a>(found: &'a Learned, machine: &Machine) -> impl Iterator<Item = (String, &'a SlideError)> {
    let names: Vec<String> = match machine.has_one_coordinate() {
        true => vec!["error".into()],
        false => machine.travels().map(|(label, _)| format!("{} error", label.name)).collect(),
    };
    names.into_iter().zip(&found.slides)
}

/// Convergence and signal with their names; `unit` is that of the signal.
pub fn lines(found: &Learned, machine: &Machine) -> Vec<(String, String)> {
    let ([from, to], unit) = (found.band, machine.drives[0].amplifier.mode.unit());
    let mut lines: Vec<(String, String)> = errors(found, machine)
        .map(|(name, slide)| (name, format!("{} rms, {} at most", length(slide.now.rms), length(slide.now.peak))))
        .collect();
    lines.push((
        "learned".into(),
        format!("{} to {}, {:.1} % of the error", value(from, "Hz"), value(to, "Hz"), 100.0 * found.share),
    ));
    lines.push((
        "converges".into(),
        format!("each repetition leaves at most {:.0} % on {} axes", 100.0 * found.contraction, found.axes),
    ));
    for (at, drive) in machine.geometry().drives.iter().zip(&found.drives) {
        let name = if at.side().is_empty() { "signal".into() } else { format!("{} signal", at.side()) };
        let (count, every) = (drive.next.len(), value(found.every, "s"));
        lines.push((name, format!("at most {}, {count} values every {every}", value(drive.largest(), unit))));
    }
    lines
}

/// The repetitions to come: number, of a gantry what slides, rms and peak on the machine of the file, and the largest
/// of the family.
pub fn trials(found: &Learned, machine: &Machine) -> Vec<[String; 5]> {
    let count = found.slides.first().map_or(0, |slide| slide.predicted.len());
    let row = |trial: usize, (label, slide): (taut::mechanism::Label, &SlideError)| {
        let one = &slide.predicted[trial];
        let [a, b, c, d] = [one.nominal.rms, one.nominal.peak, one.worst.rms, one.worst.peak].map(length);
        let number = match machine.has_one_coordinate() {
            true => format!("{}", trial + 1),
            false => format!("{} {}", trial + 1, label.name),
        };
        [number, a, b, c, d]
    };
    let of_trial = |trial: usize| {
        let slides = machine.travels().map(|(label, _)| label).zip(&found.slides);
        slides.map(move |one| row(trial, one)).collect::<Vec<_>>()
    };
    (0..count).flat_map(of_trial).collect()
}
