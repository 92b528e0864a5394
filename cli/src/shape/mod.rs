//! `taut shape`: an input shaper from a measured spectrum or from the model, and two spectra compared.

mod figures;
mod json;
mod page;
mod table;

use crate::args::{AxisName, Damping, MotorName, Shape as Args};
use crate::command::{Finished, Report};
use crate::failure::Outcome;
use crate::folder::Folder;
use std::path::{Path, PathBuf};
use taut::control::compare::{Comparison, compare};
use taut::control::damping::{FittedMode, fitted};
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
    Spectra(Vec<(PathBuf, Spectrum)>),
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
    /// The curve through the highest peak.
    mode: Option<FittedMode>,
}

/// The whole result.
pub struct Findings {
    each: Vec<Found>,
    comparison: Option<Comparison>,
}

/// Reads the files, chooses, compares, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let files: Vec<&PathBuf> = std::iter::once(&args.spectrum).chain(&args.others).collect();
    if files.len() > 2 && !args.together {
        let error = Error::new(format!("{} files, of which two can be compared", files.len())).in_file("taut shape");
        return Err(error.next("say --together to choose one shaper for all of them").into());
    }
    let each = match args.together {
        true => vec![together(args, &files)?],
        false => files.iter().map(|file| find(args, file)).collect::<Result<Vec<Found>>>()?,
    };
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

/// One shaper for all files.
fn together(args: &Args, files: &[&PathBuf]) -> Result<Found> {
    if let Some(file) = files.iter().find(|file| is_case(file)) {
        let error = Error::new("a case file has no spectrum to put together with others").in_file(file);
        return Err(error.next("leave --together out; a case is looked at along its whole travel anyway"));
    }
    let mut spectra = Vec::new();
    for file in files {
        if let Source::Spectrum(spectrum) = measured(args, file)? {
            spectra.push(((*file).clone(), spectrum));
        }
    }
    chosen(args, files[0], Source::Spectra(spectra), files[1..].iter().map(|file| (*file).clone()).collect())
}

fn is_case(file: &Path) -> bool {
    file.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

fn find(args: &Args, file: &Path) -> Result<Found> {
    let (source, also) = if is_case(file) { model(args, file)? } else { (measured(args, file)?, Vec::new()) };
    chosen(args, file, source, also)
}

fn chosen(args: &Args, file: &Path, source: Source, also: Vec<PathBuf>) -> Result<Found> {
    let mut criterion = Criterion {
        max_smoothing: args.max_smoothing,
        max_vibrations: args.max_vibrations,
        firmware: args.firmware.into(),
        ..Criterion::default()
    };
    if let Some(shapers) = &args.shapers {
        criterion = criterion.with_forms(&shapers.0);
    }
    if let Some(speed) = args.corner_speed {
        criterion.corner.speed = speed;
    }
    let mode = match &source {
        Source::Spectrum(spectrum) => fitted(spectrum),
        Source::Spectra(spectra) => {
            let all = spectra.iter().filter_map(|(_, spectrum)| fitted(spectrum));
            all.min_by(|a, b| a.damping.total_cmp(&b.damping))
        }
        Source::Model { .. } => None,
    };
    // What the model knows is better than a guess; what the user says, better still.
    let known = match (&source, args.damping) {
        (_, Some(Damping::Ratio(damping))) => Some(damping),
        (Source::Model { modes, .. }, _) => Some(damping(modes)),
        (Source::Spectrum(_) | Source::Spectra(_), Some(Damping::Fitted)) => {
            let error = || {
                let error = Error::new("no curve of one mode goes through the highest peak").in_file("--damping");
                error.next("give a damping ratio, such as --damping 0.1")
            };
            Some(mode.ok_or_else(error)?.damping)
        }
        (Source::Spectrum(_) | Source::Spectra(_), None) => None,
    };
    if let Some(damping) = known {
        let option = |e: Error| if args.damping.is_some() { e.in_file("--damping") } else { e };
        criterion = criterion.with_damping(damping).map_err(option)?;
    }
    let spectra: Vec<Spectrum>;
    let target = match &source {
        Source::Spectrum(spectrum) => Target::Spectrum(spectrum),
        Source::Spectra(all) => {
            spectra = all.iter().map(|(_, spectrum)| spectrum.clone()).collect();
            Target::Spectra(&spectra)
        }
        Source::Model { modes, .. } => Target::Modes { modes, uncertainty: args.uncertainty.unwrap_or(UNCERTAINTY) },
    };
    let choice = choose(target, &criterion).map_err(|e| e.in_file(file))?;
    Ok(Found { file: file.to_path_buf(), also, source, criterion, choice, mode })
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
    let no_case = !is_case(&args.spectrum) && args.others.iter().all(|file| !is_case(file));
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
    let spectrum = Spectrum::by(&read_accelerometer(file)?, axis, args.firmware.into());
    if spectrum.greatest() <= 0.0 {
        let error = Error::new(format!("there is no vibration along {} from 5 to 200 Hz", axis.word())).in_file(file);
        return Err(error.next("choose another axis, or leave --axis out"));
    }
    Ok(Source::Spectrum(spectrum))
}

impl Found {
    /// The damping of the highest peak, in a sentence.
    fn damping_told(&self) -> Option<String> {
        let mode = self.mode?;
        Some(format!(
            "a mode of {:.1} Hz with a damping ratio of {:.3} ({:.3} to {:.3}) goes through the highest peak, {:.0} % off",
            mode.frequency,
            mode.damping,
            mode.interval[0],
            mode.interval[1],
            100.0 * mode.error
        ))
    }

    /// Lines for Klipper's configuration, of the axis that the option or the file's name says.
    fn lines(&self) -> Vec<String> {
        let name = self.name();
        let named = ["x", "y", "z"].into_iter().find(|axis| name.contains(&format!("_{axis}_")));
        let axis = match &self.source {
            Source::Spectrum(Spectrum { axis, .. }) if *axis != Axis::All => axis.word(),
            Source::Spectrum(_) | Source::Spectra(_) | Source::Model { .. } => named.unwrap_or("x"),
        };
        let shaper = &self.choice.best().shaper;
        vec![
            "[input_shaper]".into(),
            format!("shaper_type_{axis}: {}", shaper.form.name()),
            format!("shaper_freq_{axis}: {:.1}", shaper.frequency),
            format!("damping_ratio_{axis}: {}", taut::quantity::rounded(shaper.damping)),
        ]
    }

    /// The file's name without its folder.
    fn name(&self) -> String {
        self.file.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// What was looked at, in a sentence.
    fn told(&self) -> String {
        match &self.source {
            Source::Spectra(spectra) => {
                let one = |(file, spectrum): &(PathBuf, Spectrum)| {
                    let peaks: Vec<String> = spectrum.peaks().iter().map(|peak| format!("{:.1} Hz", peak.0)).collect();
                    let name = file.file_name().unwrap_or_default().to_string_lossy();
                    format!("{name} with peaks at {}", peaks.join(", "))
                };
                let all: Vec<String> = spectra.iter().map(one).collect();
                let count = spectra.len();
                format!("{count} spectra together, the one counts of which most remains: {}", all.join("; "))
            }
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
