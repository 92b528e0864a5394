//! Results as data: what `--json` prints, the files of results hold, and the Python package hands out (feature `json`).
//!
//! Everything is in SI units, and the keys name them.

mod case_schema;
mod check;
mod comparison;
mod design;
mod drift;
mod export;
mod fit;
mod frf;
mod learn;
mod map;
mod modes;
mod moves;
mod plan;
mod posterior;
mod result_schema;
mod shape;
mod show;
mod simulation;
mod sweep;
mod tune;

pub use case_schema::case_schema;
pub use check::check;
pub use comparison::comparison;
pub use design::design;
pub use drift::drift;
pub use export::{export, exported};
pub use fit::fit;
pub use frf::frf;
pub use learn::learned;
pub use map::map;
pub use modes::modes;
pub use moves::{Moved, motion, moves};
pub use plan::plan;
pub use posterior::posterior;
pub use result_schema::{identity, schema, schemas};
pub use shape::shape;
pub use show::show;
pub use simulation::{Band, Event, Simulated, Simulation, figures, load_unit};
pub use sweep::sweep;
pub use tune::tuned;

use crate::metrics::Peak;
use crate::solve::Ending;
use serde::Serialize;
use serde_json::{Value, json};

/// As a file holds it: indented, numbers to the last bit, a line end behind it.
pub fn text(value: &impl Serialize) -> String {
    let mut text = serde_json::to_string_pretty(value).unwrap_or_default();
    text.push('\n');
    text
}

/// Numbers that JSON has no word for are null.
fn number(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { Value::Null }
}

/// How a run ended in a word, and when: at `end` (s) where nothing ended it early.
pub fn ending(ending: Ending, end: f64) -> (&'static str, f64) {
    match ending {
        Ending::Complete => ("complete", end),
        Ending::TooManyEvents { time } => ("too_many_events", time),
        Ending::LeftTravel { time } => ("left_travel", time),
        Ending::Diverged { time } => ("diverged", time),
        Ending::TooStiff { time, .. } => ("too_stiff", time),
        Ending::Interrupted { time } => ("interrupted", time),
    }
}

fn peak(peak: Peak) -> Value {
    json!({ "value": peak.value, "time_s": peak.time })
}

/// The URI of a schema.
fn address(name: &str) -> String {
    format!("urn:taut:{name}:{}", result_schema::version(name))
}
