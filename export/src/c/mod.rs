//! C99: a header and a source, with nothing below them.

mod controller;
mod plant;

use super::{Exported, Options, Part, Real, STEP, Tables, identifier};
use crate::case::Case;
use crate::error::Result;

/// The files `STEM.h` and `STEM.c`.
pub(super) fn export(case: &Case, part: Part, stem: &str, options: &Options) -> Result<Exported> {
    named(case, part, (stem, &identifier(stem)), options)
}

/// C source whose names begin with `stem`.
pub(super) fn named(case: &Case, part: Part, (stem, name): (&str, &str), options: &Options) -> Result<Exported> {
    let writer = Writer { name: name.to_string(), real: options.real, local: "" };
    let (mut header, mut source) = (String::new(), String::new());
    let (mut facts, mut notes) = (Vec::new(), Vec::new());
    if part.has_plant() {
        let tables = Tables::with_steppers(&super::mechanism(case)).map_err(|error| match super::controller(case) {
            Ok(_) => error.next("`taut export fmu` takes it as it is, and --part controller leaves the machine out"),
            Err(_) => error,
        })?;
        let plant = plant::Plant::new(&tables, options.step.unwrap_or(STEP), options.real)?;
        header += &plant.header(&writer, case.title.as_str());
        source += &plant.source(&writer);
        facts.extend(plant.facts());
    }
    let whole = |writer: &Writer, stem: &str, header: &str, source: &str| {
        let (header, source) = (writer.header(case.title.as_str(), header), writer.source(stem, source));
        [(format!("{stem}.c"), source.into_bytes()), (format!("{stem}.h"), header.into_bytes())]
    };
    let mut of_drives = Vec::new();
    if part.has_controller() {
        let (case, design) = super::controller(case)?;
        let drives = case.machine.geometry().drives;
        for (number, at) in drives.iter().enumerate() {
            let controller = controller::Controller::new(design, &case.machine, number, options.real)?;
            match drives {
                [_] => {
                    header += &controller.header(&writer);
                    source += &controller.source(&writer);
                }
                // All state is static: a file for each motor.
                _ => {
                    let side = at.prefix.trim_end_matches('_');
                    let own = Writer { name: format!("{name}_{side}"), ..writer };
                    let stem = format!("{stem}_{side}");
                    of_drives.extend(whole(&own, &stem, &controller.header(&own), &controller.source(&own)));
                }
            }
            if number == 0 {
                facts.extend(controller.facts());
            }
        }
        notes.extend(super::drives_note(case));
        notes.extend(super::correction_note(&case.machine));
        notes.extend(super::shaper_note(design));
    }
    let own = (!source.is_empty()).then(|| whole(&writer, stem, &header, &source));
    let files = own.into_iter().flatten().chain(of_drives).collect();
    Ok(Exported { files, facts, notes })
}

/// Header and source of a plant that others are written around: `local` is what its static variables are declared with.
pub(super) fn plant(
    tables: &Tables,
    (title, name): (&str, &str),
    step: f64,
    local: &'static str,
) -> Result<[String; 2]> {
    let writer = Writer { name: name.to_string(), real: Real::Double, local };
    let plant = plant::Plant::new(tables, step, writer.real)?;
    let header = writer.header(title, &plant.header(&writer, title));
    Ok([header, writer.source(name, &plant.source(&writer))])
}

/// The longest step that a plant can have, s.
pub(super) fn longest_step(tables: &Tables) -> f64 {
    plant::Plant::longest_step(tables)
}

/// Names and numbers that all parts of the files have in common.
pub(super) struct Writer {
    /// The beginning of every name outside.
    pub name: String,
    pub real: Real,
    /// The word before the types of static variables: that of threads, or nothing.
    pub local: &'static str,
}

const HEADER: &str = include_str!("whole.h");
const SOURCE: &str = include_str!("whole.c");

impl Writer {
    /// A template with its names.
    pub(super) fn fill(&self, template: &str, parts: &[(&str, &str)]) -> String {
        let text = template.replace("@local@", self.local).replace("@NAME@", &self.name.to_uppercase());
        let mut text = text.replace("@name@", &self.name);
        for (place, part) in parts {
            text = text.replace(place, part);
        }
        text
    }

    /// A number as C has it, in the numbers that are asked for.
    pub(super) fn number(&self, value: f64) -> String {
        number(self.real, value)
    }

    fn header(&self, title: &str, parts: &str) -> String {
        let real = match self.real {
            Real::Float => "float",
            Real::Double => "double",
        };
        self.fill(HEADER, &[("@real@", real), ("@title@", &plain(title)), ("@version@", version()), ("@parts@", parts)])
    }

    fn source(&self, stem: &str, parts: &str) -> String {
        let suffix = match self.real {
            Real::Float => "x##F",
            Real::Double => "x",
        };
        self.fill(SOURCE, &[("@header@", &format!("{stem}.h")), ("@suffix@", suffix), ("@parts@", parts)])
    }
}

fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

/// A text as a comment can hold it.
pub(crate) fn plain(text: &str) -> String {
    // Neither an end nor a trigraph.
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    text.replace("*/", "* /").replace("??", "? ?").replace("??", "? ?")
}

/// A number as C has it.
pub(super) fn number(real: Real, value: f64) -> String {
    match real {
        Real::Float => format!("{:?}F", value as f32),
        Real::Double => format!("{value:?}"),
    }
}
