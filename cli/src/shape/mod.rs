//! `taut shape`: an input shaper from a measured spectrum or from the model, and two spectra compared.

mod figures;
mod json;
mod page;
mod table;

use crate::args::{AxisName, MotorName, Shape as Args};
use crate::command::{Finished, Report};
use crate::failure::Outcome;
use crate::folder::Folder;
use std::path::{Path, PathBuf};
use taut::control::compare::{Comparison, compare};
use taut::control::resonance::{Drive, Resonance, resonances};
use taut::control::shaping::{Choice, Criterion, Target, choose};
use taut::control::spectrum::{Axis, Spectrum};
use taut::files::Inputs;
use taut::log::read_accelerometer;
use taut::{Error, Result};

/// By how much a model's frequencies may be wrong where the user does not say: masses are known to some 20 %.
const UNCERTAINTY: f64 = 0.1;

/// What a shaper is looked for.
enum Source {
    Spectrum(Spectrum),
    Model { title: String, drive: Drive, modes: Vec<Resonance> },
}

/// A file with what was found for it.
pub struct Found {
    file: PathBuf,
    /// What a case names besides, and is read with it.
    also: Vec<PathBuf>,
    source: Source,
    criterion: Criterion,
    choice: Choice,
}

/// The whole result.
pub struct Findings {
    each: Vec<Found>,
    comparison: Option<Comparison>,
}

/// Reads the files, chooses, compares, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let files = std::iter::once(&args.spectrum).chain(&args.second);
    let each = files.map(|file| find(args, file)).collect::<Result<Vec<Found>>>()?;
    let comparison = match each.as_slice() {
        [Found { source: Source::Spectrum(first), .. }, Found { source: Source::Spectrum(second), .. }] => {
            Some(compare(first, second))
        }
        _ => None,
    };
    let found = Findings { each, comparison };
    let common = &args.common;
    let inputs = || Inputs::new(found.each.iter().flat_map(|one| std::iter::once(&one.file).chain(&one.also)));
    let folder = Folder::wanted(common, inputs, ["shape.json", "report.html"])?;
    let advice = "add --out DIR for a report, pictures and shape.json";
    let mut finished = Finished::new("shape", ("shape.json", json::text(&found)), table::text(&found), advice);
    if common.reports() {
        let figures = figures::figures(&found);
        let page = page::page(&found, &figures);
        let pictures = figures.into_iter().map(|(name, figure)| (name, figure.into())).collect();
        finished.report = Some(Report { page, pictures });
    }
    finished.finish(common, folder)
}

fn find(args: &Args, file: &Path) -> Result<Found> {
    let mut criterion = Criterion { max_smoothing: args.max_smoothing, ..Criterion::default() };
    if !args.shapers.is_empty() {
        criterion = criterion.with_kinds(&args.shapers);
    }
    if let Some(speed) = args.corner_speed {
        criterion.corner.speed = speed;
    }
    let is_case = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    let (source, also) = if is_case { model(args, file)? } else { (measured(args, file)?, Vec::new()) };
    // What the model knows is better than a guess; what the user says, better still.
    let known = match &source {
        Source::Model { modes, .. } => Some(damping(modes)),
        Source::Spectrum(_) => None,
    };
    if let Some(damping) = args.damping.or(known) {
        let option = |e: Error| if args.damping.is_some() { e.in_file("--damping") } else { e };
        criterion = criterion.with_damping(damping).map_err(option)?;
    }
    let target = match &source {
        Source::Spectrum(spectrum) => Target::Spectrum(spectrum),
        Source::Model { modes, .. } => Target::Modes { modes, uncertainty: args.uncertainty.unwrap_or(UNCERTAINTY) },
    };
    let choice = choose(target, &criterion).map_err(|e| e.in_file(file))?;
    Ok(Found { file: file.to_path_buf(), also, source, criterion, choice })
}

/// The mean damping ratio of the modes that move the cart most, over the travel.
fn damping(modes: &[Resonance]) -> f64 {
    let main: Vec<f64> = modes.iter().filter(|mode| mode.share == 1.0).map(|mode| mode.damping).collect();
    main.iter().sum::<f64>() / main.len().max(1) as f64
}

fn model(args: &Args, file: &Path) -> Result<(Source, Vec<PathBuf>)> {
    if args.axis.is_some() {
        let error = Error::new("a case file has no accelerometer").in_file("--axis");
        return Err(error.next("leave --axis out, or give a spectrum"));
    }
    let case = args.common.case(file)?;
    let drive = match args.motor {
        Some(MotorName::Free) => Drive::Free,
        Some(MotorName::Held) | None => Drive::Held,
    };
    let modes = resonances(&case.stage, drive).map_err(|e| e.in_file(file))?;
    let also = case.files.into_iter().map(|file| file.path).collect();
    Ok((Source::Model { title: case.title, drive, modes }, also))
}

fn measured(args: &Args, file: &Path) -> Result<Source> {
    let only_models = [
        ("--set", !args.common.changes.is_empty()),
        ("--motor", args.motor.is_some()),
        ("--uncertainty", args.uncertainty.is_some()),
    ];
    let both_measured = |path: &Path| path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("toml"));
    let no_case = both_measured(&args.spectrum) && args.second.as_deref().is_none_or(both_measured);
    if let (true, Some((option, _))) = (no_case, only_models.into_iter().find(|(_, given)| *given)) {
        let error = Error::new("a measured spectrum has no case file to change").in_file(option);
        return Err(error.next(format!("leave {option} out, or give a case file, .toml")));
    }
    let axis = match args.axis {
        None => Axis::All,
        Some(AxisName::X) => Axis::X,
        Some(AxisName::Y) => Axis::Y,
        Some(AxisName::Z) => Axis::Z,
    };
    let spectrum = Spectrum::new(&read_accelerometer(file)?, axis);
    if spectrum.greatest() <= 0.0 {
        let error = Error::new(format!("there is no vibration along {} from 5 to 200 Hz", axis.word())).in_file(file);
        return Err(error.next("choose another axis, or leave --axis out"));
    }
    Ok(Source::Spectrum(spectrum))
}

impl Found {
    /// The file's name without its folder.
    fn name(&self) -> String {
        self.file.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// What was looked at, in a sentence.
    fn told(&self) -> String {
        match &self.source {
            Source::Spectrum(spectrum) => {
                let peak = |peak: &(f64, f64)| match spectrum.main_axis(peak.0) {
                    Some((axis, part)) if spectrum.axis == Axis::All => {
                        format!("{:.1} Hz ({:.0} % along {})", peak.0, 100.0 * part, axis.word())
                    }
                    _ => format!("{:.1} Hz", peak.0),
                };
                let peaks: Vec<String> = spectrum.peaks().iter().map(peak).collect();
                format!("{}; axis {}; peaks at {}", spectrum.origin, spectrum.axis.word(), peaks.join(", "))
            }
            Source::Model { title, drive, modes } => {
                let word = match drive {
                    Drive::Held => "held on its command",
                    Drive::Free => "free to give way",
                };
                let main = modes.iter().filter(|mode| mode.share == 1.0);
                let (mut low, mut high) = (f64::INFINITY, 0.0f64);
                for mode in main {
                    (low, high) = (low.min(mode.frequency), high.max(mode.frequency));
                }
                let range = match high - low {
                    d if d < 0.05 => format!("{high:.1} Hz wherever the cart is"),
                    _ => format!("{low:.1} to {high:.1} Hz along the travel"),
                };
                let damping = damping(modes);
                format!(
                    "the model of \"{title}\", motor {word}; the cart vibrates at {range}, damping ratio {damping:.3}"
                )
            }
        }
    }
}
