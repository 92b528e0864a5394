//! Input shapers for files of vibration: spectra, samples of an accelerometer, or the modes of a case; two spectra
//! compared.

use super::compare::{Comparison, compare};
use super::damping::{FittedMode, fitted};
use super::diagonals::Diagonals;
use super::shaper::{Firmware, Form, residual_vibration};
use super::shaping::{Choice, Criterion, Target, choose};
use super::spectrum::{Axis, Spectrum};
use crate::case::{Accepted, Case, Files};
use crate::error::{Error, Result};
use crate::log::read_accelerometer;
use crate::mechanism::Label;
use crate::parameter;
use crate::reach::quickest::within_pull_out;
use crate::reach::resonance::{Drive, Reach, Resonance, reaches, resonances};
use std::path::{Path, PathBuf};

/// Default relative uncertainty of a model's frequencies: masses are known to about 20 %.
const UNCERTAINTY: f64 = 0.1;

/// The vibration that a shaper is chosen for.
#[derive(Debug, Clone)]
pub enum Source {
    /// A measured spectrum.
    Spectrum(Spectrum),
    /// Several of them, with their files.
    Spectra(Vec<(PathBuf, Spectrum)>),
    /// The modes of a case along its travel.
    Model {
        /// Title of the case.
        title: String,
        /// The coordinate to come to rest, for a machine with several.
        coordinate: Option<Coordinate>,
        /// State of the motor.
        drive: Drive,
        /// Modes at all positions.
        modes: Vec<Resonance>,
        /// Largest acceleration that steppers give, m/s²: [`within_pull_out`], rounded down to 0.1 m/s²; `None` for
        /// other motors.
        acceleration: Option<f64>,
    },
}

/// A coordinate of a machine with several.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Coordinate {
    /// Its name.
    pub label: Label,
    /// Its letter: x of the bridge, y of the cart.
    pub letter: &'static str,
}

/// A file with its shapers.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct ShaperFile {
    /// The file.
    pub file: PathBuf,
    /// Further files read with it.
    pub also: Vec<PathBuf>,
    /// Relative uncertainty of a model's frequencies.
    pub uncertainty: f64,
    /// Its vibration.
    pub source: Source,
    /// The criterion of the choice.
    pub criterion: Criterion,
    /// The shapers, and the one that is recommended.
    pub choice: Choice,
    /// The curve through the highest peak.
    pub mode: Option<FittedMode>,
}

/// The shapers of each file, and the comparison of two spectra.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Findings {
    /// Result for each file.
    pub each: Vec<ShaperFile>,
    /// Comparison of two spectra.
    pub comparison: Option<Comparison>,
    /// The looser of two belts, if it was asked for.
    pub belts: Option<Diagonals>,
}

/// Options of a recommendation; see `taut shape`.
#[derive(Debug, Clone, Default)]
pub struct Question {
    /// Changes of a case, each as `KEY=VALUE`.
    pub changes: Vec<String>,
    /// One shaper for all files.
    pub together: bool,
    /// Firmware whose shapers, rule and parameters apply.
    pub firmware: Firmware,
    /// The axis of the accelerometer; all by default.
    pub axis: Option<Axis>,
    /// The damping ratio that shapers are designed for.
    pub damping: Option<Damping>,
    /// Largest smoothing, m.
    pub max_smoothing: Option<f64>,
    /// Largest vibration, as a fraction.
    pub max_vibrations: Option<f64>,
    /// Speed at corners, m/s.
    pub corner_speed: Option<f64>,
    /// The shapers to choose among; those of the firmware by default.
    pub forms: Option<Vec<Form>>,
    /// Relative uncertainty of a model's frequencies.
    pub uncertainty: Option<f64>,
    /// The motor while the cart vibrates.
    pub drive: Option<Drive>,
    /// True if convolved pairs of shapers are also tried.
    pub pairs: bool,
    /// True if the two spectra are those of belts A and B of a CoreXY.
    pub belts: bool,
}

/// A damping ratio that is given, or fitted to the highest peak.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Damping {
    /// As given.
    Ratio(f64),
    /// Fitted to the highest peak.
    Fitted,
}

/// Reads files of vibration (spectra, samples of an accelerometer, or cases), chooses shapers, and compares two
/// spectra, with `belts` for the looser belt of a CoreXY. Errors: more than two files that are not taken together,
/// files that cannot be read, options that do not fit them or the firmware.
///
/// ```no_run
/// use taut::control::recommendation::{Question, recommend};
/// let found = recommend(&Question::default(), &["calibration_data_x.csv".into()])?;
/// println!("{}", found.each[0].choice.best().shaper.frequency);
/// # Ok::<(), taut::Error>(())
/// ```
pub fn recommend(args: &Question, files: &[PathBuf]) -> Result<Findings> {
    let Some(_) = files.first() else {
        return Err(Error::new("no file was given").next("name a spectrum, samples of an accelerometer, or a case"));
    };
    if args.belts {
        are_of_belts(args, files)?;
    }
    if files.len() > 2 && !args.together {
        let error = Error::new(format!("{} files, of which two can be compared", files.len())).in_file("taut shape");
        return Err(error.next("say --together to choose one shaper for all of them"));
    }
    if args.max_vibrations.is_some() && args.firmware == Firmware::Klipper202508 {
        let error = Error::new("Klipper until 2025-08 chooses without a limit of the vibration");
        return Err(error.in_file("--max-vibrations").next("leave it out, or take --firmware klipper"));
    }
    let each = match args.together {
        true => vec![together(args, files)?],
        false => files.iter().map(|file| find(args, files, file)).collect::<Result<Vec<_>>>()?.concat(),
    };
    let comparison = match each.as_slice() {
        [ShaperFile { source: Source::Spectrum(first), .. }, ShaperFile { source: Source::Spectrum(second), .. }] => {
            Some(compare(first, second))
        }
        _ => None,
    };
    let belts = match each.as_slice() {
        [
            a @ ShaperFile { source: Source::Spectrum(first), .. },
            b @ ShaperFile { source: Source::Spectrum(second), .. },
        ] if args.belts => {
            moves_along_both(&a.file, first)?;
            moves_along_both(&b.file, second)?;
            if first.axes == second.axes {
                let error = Error::new(format!("the same values as in {}", a.file.display())).in_file(&b.file);
                return Err(error.allowed("a second test").next(format!("give {DIAGONALS}")));
            }
            Some(Diagonals::new(first, second))
        }
        _ => None,
    };
    Ok(Findings { each, comparison, belts })
}

/// The two tests of `--belts`, for messages.
const DIAGONALS: &str = "the spectra of TEST_RESONANCES AXIS=1,1 and AXIS=1,-1, in this order";

/// Checks that exactly two spectra were given, without options that contradict.
fn are_of_belts(args: &Question, files: &[PathBuf]) -> Result<()> {
    if let Some(file) = files.iter().find(|file| is_case(file)) {
        let error = Error::new("a case file has no spectra of two belts").in_file(file);
        return Err(error.next(format!("leave --belts out, or give {DIAGONALS}")));
    }
    let contradicts = [
        ("--together", args.together, "--belts compares two spectra, --together joins them"),
        ("--axis", args.axis.is_some(), "--belts evaluates x and y of each spectrum"),
    ];
    if let Some((option, _, what)) = contradicts.into_iter().find(|(_, given, _)| *given) {
        return Err(Error::new(what).in_file(option).next(format!("leave {option} out")));
    }
    if files.len() != 2 {
        let count = if files.len() == 1 { "1 file".into() } else { format!("{} files", files.len()) };
        let error = Error::new(format!("{count} for two belts")).in_file("--belts").allowed("two spectra");
        return Err(error.next(format!("give {DIAGONALS}")));
    }
    Ok(())
}

/// Checks that x and y have a content.
fn moves_along_both(file: &Path, spectrum: &Spectrum) -> Result<()> {
    for (axis, values) in [Axis::X, Axis::Y].into_iter().zip(&spectrum.axes) {
        if values.iter().all(|value| *value <= 0.0) {
            let what = format!("no vibration along {} from 5 to 200 Hz", axis.word());
            let error = Error::new(what).in_file(file).allowed("densities above 0 along x and y for --belts");
            return Err(error.next(format!("give {DIAGONALS}, of an accelerometer on the toolhead")));
        }
    }
    Ok(())
}

/// One shaper for all files.
fn together(args: &Question, files: &[PathBuf]) -> Result<ShaperFile> {
    if let Some(file) = files.iter().find(|file| is_case(file)) {
        let error = Error::new("a case file has no spectrum to put together with others").in_file(file);
        return Err(error.next("leave --together out; a case is evaluated along its whole travel anyway"));
    }
    let mut spectra = Vec::new();
    for file in files {
        if let Source::Spectrum(spectrum) = measured(args, files, file)? {
            spectra.push((file.clone(), spectrum));
        }
    }
    chosen(args, &files[0], Source::Spectra(spectra), files[1..].to_vec())
}

fn is_case(file: &Path) -> bool {
    file.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// Recommendations for a file: one, or one for each coordinate of a machine.
fn find(args: &Question, files: &[PathBuf], file: &Path) -> Result<Vec<ShaperFile>> {
    if !is_case(file) {
        return Ok(vec![chosen(args, file, measured(args, files, file)?, Vec::new())?]);
    }
    let (sources, also) = model(args, file)?;
    if sources.len() > 1 && files.len() > 1 {
        let error = Error::new("a gantry has a shaper for each coordinate, and cannot be compared").in_file(file);
        return Err(error.next("name this case alone"));
    }
    sources.into_iter().map(|source| chosen(args, file, source, also.clone())).collect()
}

fn chosen(args: &Question, file: &Path, source: Source, also: Vec<PathBuf>) -> Result<ShaperFile> {
    let mut criterion = Criterion {
        max_smoothing: args.max_smoothing,
        max_vibrations: args.max_vibrations,
        firmware: args.firmware,
        pairs: args.pairs,
        ..Criterion::default()
    };
    if let Some(forms) = &args.forms {
        criterion = criterion.with_forms(forms);
    }
    if let Some(speed) = args.corner_speed {
        criterion.corner.speed = speed;
    }
    if let Source::Model { acceleration, .. } = &source {
        criterion.motor_acceleration = *acceleration;
    }
    let mode = match &source {
        Source::Spectrum(spectrum) => fitted(spectrum),
        Source::Spectra(spectra) => {
            let all = spectra.iter().filter_map(|(_, spectrum)| fitted(spectrum));
            all.min_by(|a, b| a.damping.total_cmp(&b.damping))
        }
        Source::Model { .. } => None,
    };
    // A user's value precedes that of the model, which precedes the default.
    let known = match (&source, args.damping) {
        (_, Some(Damping::Ratio(damping))) => Some(damping),
        (Source::Model { modes, .. }, _) => Some(damping(modes)),
        (Source::Spectrum(_) | Source::Spectra(_), Some(Damping::Fitted)) => {
            let error = || {
                let error =
                    Error::new("the response of a single mode does not fit the highest peak").in_file("--damping");
                error.next("give a damping ratio, such as --damping 0.1")
            };
            Some(mode.ok_or_else(error)?.damping)
        }
        (Source::Spectrum(_) | Source::Spectra(_), None) => None,
    };
    if let Some(damping) = known {
        let option = |e: Error| if args.damping.is_some() { e.in_file("--damping") } else { e };
        let is_guess = !matches!(source, Source::Model { .. }) && matches!(args.damping, Some(Damping::Ratio(_)));
        criterion = match is_guess {
            true => criterion.designed_for(damping).map_err(option)?,
            false => criterion.with_damping(damping).map_err(option)?,
        };
    }
    let spectra: Vec<Spectrum>;
    let uncertainty = args.uncertainty.unwrap_or(UNCERTAINTY);
    let target = match &source {
        Source::Spectrum(spectrum) => Target::Spectrum(spectrum),
        Source::Spectra(all) => {
            spectra = all.iter().map(|(_, spectrum)| spectrum.clone()).collect();
            Target::Spectra(&spectra)
        }
        Source::Model { modes, .. } => Target::Modes { modes, uncertainty },
    };
    let choice = choose(target, &criterion).map_err(|e| e.in_file(file))?;
    Ok(ShaperFile { file: file.to_path_buf(), also, uncertainty, source, criterion, choice, mode })
}

/// The mean damping ratio of the modes that move the cart most, over the travel.
pub fn damping(modes: &[Resonance]) -> f64 {
    let main: Vec<f64> = modes.iter().filter(|mode| mode.share == 1.0).map(|mode| mode.damping).collect();
    main.iter().sum::<f64>() / main.len().max(1) as f64
}

/// The model of each coordinate, and further files of the case.
fn model(args: &Question, file: &Path) -> Result<(Vec<Source>, Vec<PathBuf>)> {
    if args.axis.is_some() {
        let error = Error::new("a case file has no accelerometer").in_file("--axis");
        return Err(error.next("leave --axis out, or give a spectrum"));
    }
    let changes: Vec<&str> = args.changes.iter().map(String::as_str).collect();
    let case = Case::read_accepting(file, &changes, (Files::All, Accepted::All))?;
    let drive = args.drive.unwrap_or(Drive::Held);
    let labels: Vec<Label> = case.machine.travels().map(|(label, _)| label).collect();
    let of_coordinate = |(number, (label, letter)): (usize, (&Label, &'static str))| {
        let modes = resonances(&case.machine, drive, number).map_err(|e| e.in_file(file))?;
        let coordinate = (labels.len() > 1).then_some(Coordinate { label: *label, letter });
        // Suggested accelerations are printed to 100 mm/s².
        let reserve = parameter::default_of("move.plan.reserve").unwrap_or_default();
        let acceleration = within_pull_out(&case.machine, number, reserve).map(|most| (10.0 * most).floor() / 10.0);
        Ok(Source::Model { title: case.title.clone(), coordinate, drive, modes, acceleration })
    };
    let sources = labels.iter().zip(["x", "y"]).enumerate().map(of_coordinate).collect::<Result<_>>()?;
    Ok((sources, case.files.iter().map(|file| file.path.clone()).collect()))
}

fn measured(args: &Question, files: &[PathBuf], file: &Path) -> Result<Source> {
    let only_models = [
        ("--set", !args.changes.is_empty()),
        ("--motor", args.drive.is_some()),
        ("--uncertainty", args.uncertainty.is_some()),
    ];
    let no_case = files.iter().all(|file| !is_case(file));
    if let (true, Some((option, _))) = (no_case, only_models.into_iter().find(|(_, given)| *given)) {
        let error = Error::new("a measured spectrum has no case file to change").in_file(option);
        return Err(error.next(format!("leave {option} out, or give a case file, .toml")));
    }
    let axis = args.axis.unwrap_or(Axis::All);
    let spectrum = Spectrum::by(&read_accelerometer(file)?, axis, args.firmware);
    if spectrum.greatest() <= 0.0 {
        let error = Error::new(format!("no vibration along {} from 5 to 200 Hz", axis.word())).in_file(file);
        return Err(error.next("choose another axis, or leave --axis out"));
    }
    Ok(Source::Spectrum(spectrum))
}

/// A mode of a model along the travel, and its worst remaining vibration.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Left {
    /// Its frequencies, without uncertainty.
    pub reach: Reach,
    /// With each shaper, in the order of the choice, relative to that without one.
    pub shapers: Vec<f64>,
    /// With each pair.
    pub pairs: Vec<f64>,
}

impl ShaperFile {
    /// Each mode of a model along the travel, the strongest first; none of a measured spectrum.
    pub fn left(&self) -> Vec<Left> {
        let Source::Model { modes, .. } = &self.source else { return Vec::new() };
        let one = |reach: Reach| {
            let own: Vec<Resonance> = modes.iter().filter(|mode| reach.has(mode)).copied().collect();
            let target = Target::Modes { modes: &own, uncertainty: self.uncertainty };
            let pair =
                |impulses: Vec<(f64, f64)>| target.weighed(&[], &mut |f, zeta| residual_vibration(&impulses, f, zeta));
            Left {
                reach,
                shapers: self.choice.fitted.iter().map(|fitted| target.remaining(&fitted.shaper, &[])).collect(),
                pairs: self.choice.pairs.iter().map(|one| pair(one.impulses())).collect(),
            }
        };
        reaches(modes).into_iter().map(one).collect()
    }

    /// The verdict on pairs, in a sentence; none if pairs were not tried.
    pub fn pair_told(&self) -> Option<String> {
        let Some(pair) = self.choice.pairs.first() else {
            return self.criterion.pairs.then(|| "no pair of shapers smooths as little as is allowed".into());
        };
        let best = self.choice.best();
        let told = format!(
            "{} leaves {:.1} % of the vibration and smooths by {:.3} mm, its score is {:.2} of that of {} alone",
            pair.name(),
            100.0 * pair.vibration,
            1e3 * pair.smoothing,
            pair.score / best.score,
            best.shaper.form.name()
        );
        Some(match self.choice.is_pair_better {
            true => format!("better in series: {told}; Klipper has no pairs, but [controller] of a case has"),
            false => format!("no pair is clearly better: {told}"),
        })
    }

    /// The damping of the highest peak, in a sentence.
    pub fn damping_told(&self) -> Option<String> {
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

    /// Lines for Klipper's configuration, for the axis given by the option or the file's name.
    pub fn lines(&self) -> Vec<String> {
        let name = self.name();
        let named = ["x", "y", "z"].into_iter().find(|axis| name.contains(&format!("_{axis}_")));
        let axis = match &self.source {
            Source::Spectrum(Spectrum { axis, .. }) if *axis != Axis::All => axis.word(),
            Source::Model { coordinate: Some(coordinate), .. } => coordinate.letter,
            Source::Spectrum(_) | Source::Spectra(_) | Source::Model { .. } => named.unwrap_or("x"),
        };
        let shaper = &self.choice.best().shaper;
        vec![
            "[input_shaper]".into(),
            format!("shaper_type_{axis}: {}", shaper.form.name()),
            format!("shaper_freq_{axis}: {:.1}", shaper.frequency),
            format!("damping_ratio_{axis}: {}", crate::quantity::rounded(shaper.damping)),
        ]
    }

    /// The body whose vibration is reduced: the cart, unless the model has several coordinates.
    pub fn load(&self) -> &'static str {
        match self.source {
            Source::Model { coordinate: Some(coordinate), .. } => coordinate.label.name,
            _ => "cart",
        }
    }

    /// The file's name without its folder, and the coordinate of a model with several.
    pub fn name(&self) -> String {
        let file = self.file.file_name().unwrap_or_default().to_string_lossy();
        match &self.source {
            Source::Model { coordinate: Some(coordinate), .. } => format!("{file}, {}", coordinate.label.name),
            _ => file.into_owned(),
        }
    }

    /// The source, in a sentence.
    pub fn told(&self) -> String {
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
            Source::Model { title, coordinate, drive, modes, acceleration } => {
                let (motor, load) = match coordinate {
                    None => ("motor", "cart".to_string()),
                    Some(Coordinate { label, letter }) => ("motors", format!("{} ({letter})", label.name)),
                };
                let word = match (drive, coordinate) {
                    (Drive::Held, None) => "held on its command",
                    (Drive::Held, Some(_)) => "held on their commands",
                    (Drive::Free, _) => "free to give way",
                };
                let main = modes.iter().filter(|mode| mode.share == 1.0);
                let (mut low, mut high) = (f64::INFINITY, 0.0f64);
                for mode in main {
                    (low, high) = (low.min(mode.frequency), high.max(mode.frequency));
                }
                let range = match high - low {
                    d if d < 0.05 => format!("{high:.1} Hz at every cart position"),
                    _ => format!("{low:.1} to {high:.1} Hz along the travel"),
                };
                let damping = damping(modes);
                let gives = acceleration.map(|most| {
                    let give = if coordinate.is_some() { "give" } else { "gives" };
                    format!("; the {motor} {give} {most:.1} m/s² over the travel, with the reserve of a plan")
                });
                format!(
                    "the model of \"{title}\", {motor} {word}; the {load} vibrates at {range}, damping ratio {damping:.3}{}",
                    gives.unwrap_or_default()
                )
            }
        }
    }
}
