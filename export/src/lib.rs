//! Machines and controllers for other tools: C, Structured Text, MATLAB, Python.
//!
//! Exports are made of the mechanism's own equations ([`crate::mechanism::Mechanism::equations`]), written out as
//! tables: [`Tables`]. The texts around them are in the folder of each target.

// Paths below `crate` are those of the facade: a module is named alike wherever it lives.
use taut_case::*;
use taut_control::*;
use taut_core::*;

mod c;
mod controller;
pub mod fmu;
mod matlab;
mod packed;
mod place;
mod program;
mod python;
mod st;
mod tables;

pub use place::Destination;
pub use tables::{Does, Element, ElementKind, Row, StateName, TableGuard, Tables, Then};

use crate::case::Case;
use crate::error::{Error, Result};
use crate::linear::{Operation, System, placed, within_travel};
use crate::machine::Machine;
use crate::number::engineering_typed;
use std::borrow::Cow;

/// A target whose files are made here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Target {
    /// C99.
    C,
    /// IEC 61131-3 Structured Text.
    StructuredText,
    /// MATLAB and Octave.
    Matlab,
    /// Python.
    Python,
}

impl Target {
    /// The ending of its main file.
    pub fn ending(self) -> &'static str {
        match self {
            Target::C => "c",
            Target::StructuredText => "st",
            Target::Matlab => "m",
            Target::Python => "py",
        }
    }
}

/// A part of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Part {
    /// The machine.
    Plant,
    /// The controller.
    Controller,
    /// Both.
    Both,
}

impl Part {
    /// True if the plant is in it.
    pub(crate) fn has_plant(self) -> bool {
        self != Part::Controller
    }

    /// True if the controller is in it.
    pub(crate) fn has_controller(self) -> bool {
        self != Part::Plant
    }
}

/// The numbers that exported C computes in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Real {
    /// 32 bits.
    Float,
    /// 64 bits.
    #[default]
    Double,
}

impl Real {
    /// The largest finite number.
    pub(crate) fn largest(self) -> f64 {
        match self {
            Real::Float => f64::from(f32::MAX),
            Real::Double => f64::MAX,
        }
    }
}

/// Options of an export.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Options {
    /// Which part; none for what the target has by itself.
    pub part: Option<Part>,
    /// The numbers of C.
    pub real: Real,
    /// Step of the plant, s; none for 1 ms.
    pub step: Option<f64>,
    /// Where the cart is, m, and the bridge of a gantry, for which spans that follow them are held; none for zero.
    pub at: Option<f64>,
    /// See `at`.
    pub bridge: Option<f64>,
}

/// The step of a plant where none is named, s.
pub const STEP: f64 = 1e-3;

/// The files of a target.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Exported {
    /// Names and contents; the first is what the others belong to.
    pub files: Vec<(String, Vec<u8>)>,
    /// Figures of it: what, and how much.
    pub facts: Vec<(String, String)>,
    /// Notes that a user should read.
    pub notes: Vec<String>,
}

/// A name as C, Structured Text, MATLAB and Python take it: letters, digits and `_`, a letter first.
pub(crate) fn identifier(name: &str) -> String {
    let mut plain = String::new();
    for c in name.chars() {
        match c {
            c if c.is_ascii_alphanumeric() => plain.push(c.to_ascii_lowercase()),
            _ if plain.ends_with('_') || plain.is_empty() => {}
            _ => plain.push('_'),
        }
    }
    let plain = plain.trim_end_matches('_');
    // 31 letters are what compilers tell apart, with room for what is put behind.
    let plain = &plain[..plain.len().min(20)];
    match plain.chars().next() {
        Some(c) if c.is_ascii_alphabetic() => plain.to_string(),
        _ => format!("axis_{plain}").trim_end_matches('_').to_string(),
    }
}

/// The controller of a case, of a gantry that of each motor. Errors: a case without one; what to do about it is the
/// caller's to say.
pub fn controller(case: &Case) -> Result<(&Case, &crate::design::Design)> {
    match &case.controller {
        Some(design) if design.is_open_loop() => {
            Err(Error::new("a stepper in open loop follows its command without a controller"))
        }
        Some(design) => Ok((case, design)),
        None => Err(Error::new("this case has no controller")),
    }
}

/// The next step where a controller is missing: to add one, where the case can have one, or `instead`.
fn without_controller(case: &Case, error: Error, instead: &str) -> Error {
    error.next(match case.is_axis() {
        _ if case.machine.stepper().is_some() => {
            format!("add pid to [controller], as in docs/stepper.md, or {instead}")
        }
        true => format!("add a [controller], as in docs/control.md, or {instead}"),
        false => instead.to_string(),
    })
}

/// The part that is asked for, or else what there is: a controller that is asked for must be there.
pub fn part(case: &Case, asked: Option<Part>) -> Result<Part> {
    let part = asked.unwrap_or(match controller(case) {
        Ok(_) => Part::Both,
        Err(_) => Part::Plant,
    });
    if part.has_controller() {
        // C takes no curves.
        let instead = match mechanism(case).is_piecewise_linear() || case.machine.stepper().is_some() {
            true => "leave --part out for the machine alone",
            false => "take the machine with `taut export fmu`",
        };
        controller(case).map_err(|error| without_controller(case, error, instead))?;
    }
    Ok(part)
}

/// Note on the references of controllers of several motors.
fn drives_note(case: &Case) -> Option<String> {
    let slides = controller::slides(&case.machine);
    (!slides.is_empty())
        .then(|| format!("one controller for each motor; each takes the references of {}", slides.join(" and ")))
}

/// Note that a controller is exported without its input shaper: how many impulses, and what to do.
fn shaper_note(design: &crate::design::Design) -> Option<String> {
    let impulses = &design.shaper;
    (!impulses.is_empty()).then(|| {
        format!("the input shaper of {} impulses is not included: shape the reference before it", impulses.len())
    })
}

/// Note that the command of a stepper's controller is a correction.
fn correction_note(machine: &Machine) -> Option<String> {
    machine.stepper().map(|_| {
        "the command is a correction: add it to the reference of the motor's part of the belt and command the sum"
            .into()
    })
}

/// Use of the command and the shaper with its impulses, as lines of a comment.
fn remarks(machine: &Machine, design: &crate::design::Design) -> Vec<String> {
    let of = |[time, amplitude]: &[f64; 2]| format!("  {amplitude:?} of the reference {time:?} s ago");
    let shaper = shaper_note(design).map(|note| format!("{note}, to the sum of"));
    correction_note(machine).into_iter().chain(shaper).chain(design.shaper.iter().map(of)).collect()
}

/// The files of a target, called `stem`. Errors: what the target cannot do, and what can be done instead.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::export::{Options, Real, Target, export};
///
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let exported = export(&case, Target::C, "axis", &Options { real: Real::Float, ..Options::default() })?;
/// assert!(exported.files.iter().any(|(name, _)| name == "axis.c"));
/// # Ok::<(), taut::Error>(())
/// ```
pub fn export(case: &Case, target: Target, stem: &str, options: &Options) -> Result<Exported> {
    let has_plant = match target {
        Target::C => part(case, options.part)?.has_plant(),
        Target::StructuredText => false,
        Target::Matlab | Target::Python => true,
    };
    let (held, note) = match has_plant {
        true => with_spans_held(case, options)?,
        false => (Cow::Borrowed(case), None),
    };
    let case = &*held;
    let mut exported = match target {
        Target::C => c::export(case, part(case, options.part)?, stem, options),
        Target::StructuredText => st::export(case, options.part, stem),
        Target::Matlab => matlab::export(plant_of(case, options.part)?, stem, options),
        Target::Python => python::export(plant_of(case, options.part)?, stem, options),
    }?;
    exported.notes.extend(note);
    Ok(exported)
}

/// The linear model with everything sliding at its usual speed; steppers whose supply does not suffice for that are at
/// rest on a full step.
fn linear(machine: &Machine) -> Result<System> {
    let usual = Operation::default();
    System::new(machine, usual).or_else(|error| match machine.stepper() {
        Some(_) => System::new(machine, Operation { speed: 0.0, ..usual }),
        None => Err(error),
    })
}

/// The case with spans that do not follow cart and bridge but are as they are at a place, and a note that says so.
fn with_spans_held<'a>(case: &'a Case, options: &Options) -> Result<(Cow<'a, Case>, Option<String>)> {
    within_travel(&case.machine, options.at, options.bridge)?;
    if case.machine.belt.following().is_none() {
        let given = [("--at", options.at), ("--bridge", options.bridge)].into_iter().find(|(_, at)| at.is_some());
        return match given {
            Some((option, _)) => {
                Err(Error::new("spans of this belt do not follow the cart: it is the same everywhere")
                    .in_file(option)
                    .next("leave it out"))
            }
            None => Ok((Cow::Borrowed(case), None)),
        };
    }
    let place = |at: Option<f64>| engineering_typed(at.unwrap_or(0.0), "m", 6);
    let (cart, bridge) =
        (format!("the cart at {}", place(options.at)), format!("the bridge at {}", place(options.bridge)));
    let (slides, words) = match case.is_axis() {
        true => (vec![options.at], cart),
        false => (vec![options.bridge, options.at], format!("{bridge} and {cart}")),
    };
    let slides: Vec<f64> = slides.into_iter().map(Option::unwrap_or_default).collect();
    let mut held = case.clone();
    held.machine = placed(&case.machine, Operation::at(&slides))?;
    held.title = format!("{} (spans held as with {words})", case.title);
    let note = format!(
        "spans do not follow the cart here, but are held as with {words}: --at names another place, and `taut export fmu` \
         has them follow"
    );
    Ok((Cow::Owned(held), Some(note)))
}

/// The mechanism of a case.
pub fn mechanism(case: &Case) -> crate::mechanism::Mechanism {
    case.machine.mechanism()
}

/// Refuses a controller where only the plant is exported.
fn plant_of(case: &Case, asked: Option<Part>) -> Result<&Case> {
    if asked.is_some_and(Part::has_controller) {
        let error = Error::new("only the machine is exported to this").in_file("--part");
        return Err(error.next(match controller(case) {
            _ if !mechanism(case).is_piecewise_linear() => "take the machine with `taut export fmu`",
            Ok(_) => "leave --part out; `taut export c` and `taut export st` have the controller",
            Err(_) => "leave --part out",
        }));
    }
    Ok(case)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::TEMPLATE;
    use crate::linear::StateSpace;

    fn stage(name: &str) -> Case {
        Case::read_with(format!("{}/../stages/{name}", env!("CARGO_MANIFEST_DIR")), &[]).unwrap()
    }

    fn text(exported: &Exported) -> String {
        exported.files.iter().map(|(_, bytes)| String::from_utf8_lossy(bytes)).collect()
    }

    fn fact(exported: &Exported, name: &str) -> usize {
        exported.facts.iter().find(|(own, _)| own == name).and_then(|(_, value)| value.parse().ok()).unwrap()
    }

    #[test]
    fn positions_change_by_their_speeds_and_no_pole_is_faster_than_the_bound() {
        let case = Case::from_text("axis.toml", TEMPLATE).unwrap();
        let tables = Tables::new(&mechanism(&case)).unwrap();
        let is_length = |k: &usize| ["m", "rad"].contains(&tables.states[*k].unit);
        let places: Vec<usize> = (0..tables.states.len()).filter(is_length).collect();
        assert_eq!(places.len(), 3);
        // A stretch of a span changes by the speeds of both bodies.
        for place in places {
            for weights in &tables.rates[place].weights {
                let moved: Vec<&str> =
                    (0..weights.len()).filter(|&k| weights[k] != 0.0).map(|k| tables.states[k].unit).collect();
                let name = &tables.states[place].name;
                assert!(
                    [1, 2].contains(&moved.len()) && moved.iter().all(|unit| unit.ends_with("/s")),
                    "{name}: {moved:?}"
                );
            }
        }
        let poles = StateSpace::new(&case.machine, Operation::default()).unwrap().poles().unwrap();
        let fastest = poles.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
        assert!((1.0..10.0).contains(&(tables.fastest / fastest)), "{} for {fastest}", tables.fastest);
    }

    #[test]
    fn each_rule_of_a_fuzzy_controller_is_in_its_program() {
        let case = stage("sollmann-jouaneh/controllers/fuzzy-pd.toml");
        let exported = export(&case, Target::StructuredText, "fuzzy", &Options::default()).unwrap();
        let text = text(&exported).replace(['(', ')'], "");
        // Of the 5 × 5 rules each cell between four, behind a zero.
        assert_eq!(text.matches("high_high := ").count(), 4 * 4 + 1);
        for rule in ["low_low := -1.0;", "low_high := -0.8;", "high_low := 0.7;", "high_high := 1.0;"] {
            assert!(text.contains(rule), "{rule} in\n{text}");
        }
    }

    /// The fields may turn by 2π, as an electrical angle twice, in a step of any length; a series covers 2.
    #[test]
    fn a_short_step_of_a_stepper_has_the_series_of_half_a_turn() {
        let options = Options { part: Some(Part::Plant), step: Some(1e-7), ..Options::default() };
        let exported = export(&stage("stepper-axis/stepper-axis.toml"), Target::C, "axis", &options).unwrap();
        assert_eq!(fact(&exported, "series in a step without an event"), 4);
        let products = fact(&exported, "products and quotients in a step at most");
        assert!(products > 4 * fact(&exported, "states") * fact(&exported, "order of a Taylor series"), "{products}");
    }

    #[test]
    fn the_longest_step_is_the_longest_one_that_is_exported() {
        let case = Case::from_text("axis.toml", TEMPLATE).unwrap();
        let longest = c::longest_step(&Tables::new(&mechanism(&case)).unwrap());
        let with = |step: f64| {
            let options = Options { part: Some(Part::Plant), step: Some(step), ..Options::default() };
            export(&case, Target::C, "axis", &options)
        };
        assert!(with(0.999 * longest).is_ok(), "{longest} s");
        assert!(with(1.001 * longest).is_err(), "{longest} s");
    }

    #[test]
    fn an_fmu_describes_its_columns_and_has_the_lead_of_its_feed_forward() {
        let file = format!("{}/../stages/sollmann-jouaneh/controllers/pid-rigid.toml", env!("CARGO_MANIFEST_DIR"));
        let model = |lead: &str| {
            let change = format!("controller.feed_forward={{ model = \"rigid\"{lead} }}");
            fmu::Model::new(&Case::read_with(&file, &[&change]).unwrap(), true).unwrap()
        };
        let variables = model("").variables;
        let about: Vec<&str> = variables.iter().map(|variable| &*variable.description).collect();
        assert!(about.iter().any(|about| about.starts_with("Way of the cart")), "{about:?}");
        assert!(about.iter().all(|about| !about.contains(", times 1.")), "{about:?}");
        // The delay and half a sample, unless it is given.
        assert!(model("").lead().is_some_and(|lead| (lead - 1e-3).abs() < 1e-12));
        assert_eq!(model(", lead = \"0 s\"").lead(), None);
    }
}
