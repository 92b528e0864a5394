//! The readers as functions of bytes. A broken law of what they read is a panic.

use crate::Reached;
use std::cell::RefCell;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use taut::case::{Case, Experiment, Move, TEMPLATE};
use taut::control::spectrum::{Axis, Spectrum};
use taut::control::{Loop, Rows, Standard, each};
use taut::fit;
use taut::linear::{Analysis, Operation, Question, StateSpace};
use taut::log::{Accelerometer, ColumnId, Dialect, Filter, Log, Mapping, Quantity, Source, Survey, read_accelerometer};
use taut::machine::Machine;
use taut::metrics::Meter;
use taut::signal::Signal;
use taut::signal::gcode::legs;
use taut::signal::profile::{Limits, Passage, Profile};
use taut::solve::{self, Course, Detail, Ending, Flow, Outcome, Solver};
use taut::sweep::Sweep;
use taut::{Error, quantity};

/// Rows of a run, at most.
const ROWS: f64 = 200.0;
/// Length of a run, s, at most.
const LONGEST: f64 = 0.1;
/// Phase that the fastest mode may turn through in a run, rad: how stiff it may be.
const PHASE: f64 = 2000.0;
/// Pieces of an input in a run, at most; a period of a sine has 26.
const PIECES: usize = 1000;

/// Cases, and everything that they name, are looked for from here.
pub(crate) fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The case whose fit the draws are of, in the folder of its logs.
pub(crate) fn fitted() -> &'static Case {
    static CASE: OnceLock<Case> = OnceLock::new();
    CASE.get_or_init(|| {
        let path = repository().join("stages/sollmann-jouaneh/identification/nonlinear.toml");
        Case::read(path).unwrap_or_else(|error| panic!("{error}"))
    })
}

/// Checks an error: it has some words, and is not a book.
fn refused(error: &Error) -> Reached {
    let told = error.to_string();
    assert!(!error.what.is_empty() && told.len() < 20_000, "a message of {} bytes", told.len());
    Reached::Refused
}

/// Gives a file other bytes. Many file systems wait for the disk when a file is cut to nothing and written again; so it
/// is not.
pub(crate) fn overwrite(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = fs::OpenOptions::new().write(true).create(true).truncate(false).open(path)?;
    file.write_all(bytes)?;
    file.set_len(bytes.len() as u64)
}

/// A file with these bytes, used and gone.
fn with_file<T>(bytes: &[u8], read: impl FnOnce(&Path) -> T) -> T {
    thread_local! {
        static FOLDER: RefCell<Option<tempfile::TempDir>> = const { RefCell::new(None) };
    }
    let path = FOLDER.with_borrow_mut(|folder| {
        let folder = folder.get_or_insert_with(|| tempfile::tempdir().expect("a folder for the inputs"));
        folder.path().join("input")
    });
    overwrite(&path, bytes).expect("an input is written");
    read(&path)
}

/// A case file: what it says is run, shortly.
pub(crate) fn case(bytes: &[u8]) -> Reached {
    let Ok(text) = std::str::from_utf8(bytes) else { return Reached::Refused };
    let name = repository().join("stages/sollmann-jouaneh/identification/input.toml");
    let case = match Case::from_text_with(&name, text, &[]) {
        Ok(case) if !case.is_axis() => return gantry(&name, &case),
        Ok(case) => case,
        Err(error) => return refused(&error),
    };
    let again = Case::from_text(&name, &case.text).unwrap_or_else(|error| panic!("its own text is refused: {error}"));
    assert!(again.text == case.text && again.machine == case.machine, "its own text reads otherwise");
    let Some(longest) = longest(&case.machine) else { return Reached::Read };
    if let Some(experiment) = case.experiments.first() {
        run(&case.machine, experiment, longest);
    }
    if let (Some(design), Some(motion)) = (&case.controller, case.moves.first()) {
        drive(&case.machine, design, motion, longest);
    }
    if case.sweep.is_some() {
        match Sweep::new(&case) {
            Ok(sweep) => drop(sweep.machine(sweep.runs().saturating_sub(1))),
            Err(error) => drop(refused(&error)),
        }
    }
    Reached::Read
}

/// A gantry: its modes are found, and it is run, shortly.
fn gantry(name: &Path, case: &Case) -> Reached {
    let again = Case::from_text_with(name, &case.text, &[]);
    let again = again.unwrap_or_else(|error| panic!("its own text is refused: {error}"));
    assert!(again.text == case.text && again.machine == case.machine, "its own text reads otherwise");
    let Ok(analysis) = Analysis::new(case, &Question::default()) else { return Reached::Read };
    let fastest = analysis.poles.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
    let (Some(experiment), true) = (case.experiments.first(), fastest.is_finite()) else { return Reached::Read };
    let mechanism = case.machine.mechanism();
    let mut course = Course::new(&mechanism, experiment);
    course.until = course.until.min(LONGEST.min(PHASE / fastest.max(1e-300))).min(end_of_pieces(&course.inputs));
    course.every = course.every.min(course.until).max(course.until / ROWS);
    let mut meter = Meter::new(&case.machine, experiment);
    let mut finite = true;
    let shown = (Detail::Full, Some(&mut meter as &mut dyn solve::Observe));
    let outcome = solve::stream_mechanism(&mechanism, &course, Solver::of_mechanism(&mechanism), shown, &mut |rows| {
        for name in ["time", "bridge_position", "cart_position", "left_angle"] {
            finite &= rows.get(name).is_some_and(|values| values.iter().all(|value| value.is_finite()));
        }
        Flow::Continue
    });
    if let Ok(outcome) = &outcome {
        meter.finish(&outcome.events);
    }
    judge(outcome, finite);
    Reached::Read
}

/// When the first input has had [`PIECES`], s.
fn end_of_pieces(inputs: &[Signal]) -> f64 {
    let of_one = |input: &Signal| {
        let next = |end: &f64| Some(input.piece(*end).end).filter(|_| end.is_finite());
        std::iter::successors(Some(0.0), next).take(PIECES).last().unwrap_or(f64::INFINITY)
    };
    inputs.iter().map(of_one).fold(f64::INFINITY, f64::min)
}

/// How long a machine may run, s; none where its equations say nothing.
fn longest(stage: &Machine) -> Option<f64> {
    let poles = StateSpace::new(stage, Operation::default()).and_then(|model| model.poles()).ok()?;
    let fastest = poles.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
    fastest.is_finite().then(|| LONGEST.min(PHASE / fastest.max(1e-300)))
}

fn run(stage: &Machine, experiment: &Experiment, longest: f64) {
    let until = experiment.until.min(longest).min(end_of_pieces(&experiment.inputs));
    let every = experiment.every.min(until).max(until / ROWS);
    let short = Experiment { until, every, ..experiment.clone() };
    let mut finite = true;
    let outcome = solve::stream(stage, &short, Solver::for_machine(stage), &mut |rows| {
        for name in ["time", "cart_position", "drive_angle"] {
            finite &= rows.get(name).is_some_and(|values| values.iter().all(|value| value.is_finite()));
        }
        Flow::Continue
    });
    judge(outcome, finite);
}

/// Rows are numbers, or the run says that they are not.
fn judge(outcome: Result<Outcome, Error>, finite: bool) {
    match outcome {
        Ok(outcome) => {
            let diverged = matches!(outcome.ending, Ending::Diverged { .. });
            assert!(finite || diverged, "rows that are no numbers, and the ending is {:?}", outcome.ending);
        }
        Err(error) => {
            refused(&error);
        }
    }
}

fn drive(stage: &Machine, design: &taut::design::Design, motion: &Move, longest: f64) {
    let until = motion.until.min(longest).min(ROWS * design.every);
    let rows = Rows { until, every: motion.every.min(until).max(until / ROWS), window: motion.window };
    let done = Standard::of_drives(design, stage).and_then(|mut controllers| {
        let profiles = motion.references(design);
        let (timing, solver) = (Loop::new(design), Solver::for_machine(stage));
        let controllers = &mut each(&mut controllers);
        taut::control::stream(stage, controllers, &timing, &profiles, &rows, solver, false, &mut |_| Flow::Continue)
    });
    if let Err(error) = done {
        refused(&error);
    }
}

/// A quantity: what is read is a number, and as it is written it reads back.
pub(crate) fn quantity(bytes: &[u8]) -> Reached {
    let Ok(text) = std::str::from_utf8(bytes) else { return Reached::Refused };
    for unit in ["m", "N m s/rad", "Hz", ""] {
        match quantity::read(text, unit) {
            Ok(value) => {
                assert!(value.is_finite(), "{value}");
                let written = quantity::write(value, unit);
                let again = quantity::read(&written, unit).map(f64::to_bits);
                assert!(unit.is_empty() || again == Ok(value.to_bits()), "{written} reads back as {again:?}");
            }
            Err(error) => {
                refused(&error);
            }
        }
    }
    match quantity::parse(text) {
        Ok(read) => {
            assert!(read.value.is_finite(), "{}", read.value);
            Reached::Read
        }
        Err(error) => refused(&error),
    }
}

/// Names that the columns of a log may have.
fn mappings(file: &Path) -> [Mapping; 4] {
    let named = |time: &str, input: &str, output: (Quantity, &str)| {
        let mut mapping = Mapping::new(file, Source::column(time));
        mapping.fed_by(Source::column(input));
        mapping.outputs = vec![(output.0, Source::column(output.1))];
        mapping
    };
    let short = named("t", "u", (Quantity::CartPosition, "x"));
    let long = named("time_s", "voltage_V", (Quantity::DriveAngle, "drive_angle_rad"));
    let mut part = short.clone();
    part.filter = Some(Filter { column: ColumnId::from("run"), values: vec!["1".into(), "2".into()], keep: true });
    part.split = Some(ColumnId::from("run"));
    let mut numbered = short.clone();
    let number = |k| Source { column: ColumnId::Number(k), ..Source::column("") };
    numbered.time = taut::log::Clock::Column(number(1));
    numbered.fed_by(number(2));
    numbered.outputs = vec![(Quantity::CartSpeed, number(3))];
    numbered.dialect = Dialect { separator: None, decimal_comma: true };
    [part, short, long, numbered]
}

/// A log, by whichever names its columns have; what was read is looked at as `taut check` does.
pub(crate) fn log(bytes: &[u8]) -> Reached {
    with_file(bytes, |file| {
        let mut reached = Reached::Refused;
        for mapping in mappings(file) {
            match mapping.read() {
                Ok(runs) => {
                    runs.iter().for_each(|(_, log)| surveyed(log));
                    reached = Reached::Read;
                }
                Err(error) => {
                    refused(&error);
                }
            }
        }
        reached
    })
}

fn surveyed(log: &Log) {
    static STAGE: OnceLock<Machine> = OnceLock::new();
    let stage = STAGE.get_or_init(|| Case::from_text("axis.toml", TEMPLATE).expect("the template is a case").machine);
    assert!(log.time.windows(2).all(|pair| pair[0] < pair[1]), "times that do not increase");
    assert!(log.time.iter().chain(&log.inputs[0]).all(|value| value.is_finite()), "a time or an input is no number");
    assert!(log.outputs.iter().all(|output| output.values.len() == log.len()), "columns of different lengths");
    let survey = Survey::new(log, stage);
    assert!(survey.to_string().len() < 1_000_000);
}

/// A file of an accelerometer: its spectrum has frequencies that ascend and densities that are not negative.
pub(crate) fn accelerometer(bytes: &[u8]) -> Reached {
    with_file(bytes, |file| {
        let data = match read_accelerometer(file) {
            Ok(data) => data,
            Err(error) => return refused(&error),
        };
        // A recording of hours at a high rate is no wrong file, and not for a test.
        if let Accelerometer::Samples { time, .. } = &data
            && (time.len() as f64) / (time[time.len() - 1] - time[0]) > 1e5
        {
            return Reached::Read;
        }
        let spectrum = Spectrum::new(&data, Axis::All);
        assert!(spectrum.frequency.windows(2).all(|pair| pair[0] < pair[1]), "frequencies that do not ascend");
        assert!(spectrum.density.iter().all(|density| *density >= 0.0), "a density below zero, or none");
        for (frequency, _) in spectrum.peaks() {
            let _ = spectrum.main_axis(frequency);
        }
        Reached::Read
    })
}

/// A list of moves: the reference begins and ends where it says, at rest, and is a number in between.
pub(crate) fn gcode(bytes: &[u8]) -> Reached {
    let Ok(text) = std::str::from_utf8(bytes) else { return Reached::Refused };
    let limits = Limits { speed: 0.5, acceleration: 5.0, jerk: Some(200.0), snap: None };
    let of = |start: &[f64]| legs(text, start, &limits).and_then(|legs| Profile::along(start, &legs));
    let in_plane = of(&[0.01, 0.01]);
    if let Ok(profiles) = &in_plane {
        profiles.iter().for_each(|profile| runs_from_rest_to_rest(profile, &limits));
    }
    match of(&[0.01]) {
        Ok(profiles) => runs_from_rest_to_rest(&profiles[0], &limits),
        // What an axis refuses may be for a plane.
        Err(error) if in_plane.is_err() => return refused(&error),
        Err(_) => {}
    }
    Reached::Read
}

fn runs_from_rest_to_rest(profile: &Profile, limits: &Limits) {
    assert_eq!(profile.at(-1.0).position, 0.01);
    let places = profile.passages().iter().flat_map(Passage::extremes);
    // A moment is known to its rounding only, and so is where the cart is then.
    let farthest = places.fold(1.0, |most: f64, place| most.max(place.abs()));
    let rounding = 1e-12 * farthest + 4.0 * f64::EPSILON * profile.end() * limits.speed;
    let last = profile.at(profile.end()).position;
    assert!((last - profile.target()).abs() <= rounding, "it ends at {last} and should at {}", profile.target());
    for k in 0..50 {
        let now = profile.at(profile.end() * f64::from(k) / 50.0);
        let parts = [now.position, now.speed, now.acceleration, now.jerk];
        assert!(parts.iter().all(|part| part.is_finite()), "{now:?}");
    }
}

/// Draws from a posterior: each is a machine.
pub(crate) fn draws(bytes: &[u8]) -> Reached {
    let case = fitted();
    let Some(plan) = &case.fit else { unreachable!("the case has a fit") };
    with_file(bytes, |file| match fit::machines(case, plan, file) {
        Ok(machines) => {
            assert!(!machines.is_empty());
            assert!(machines.iter().all(|machine| machine.cart.mass > 0.0));
            Reached::Read
        }
        Err(error) => refused(&error),
    })
}
