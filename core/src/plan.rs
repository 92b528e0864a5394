//! Experiments and their logs as plain data: what a simulation runs, and what a fit compares it with.

use crate::chance::hash;
use crate::machine::Quantity;
use crate::mechanism::State;
use crate::signal::{Hold, Signal};
use crate::trajectory::Grid;
use std::path::PathBuf;
use std::sync::Arc;

/// Longest name of an experiment's files, in bytes: file systems allow 255, and `-peak-motor-current-histogram.svg`
/// follows.
const LONGEST_FILE_NAME: usize = 200;

/// One run of the machine.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Its name, unique within the case.
    pub name: String,
    /// The input of each drive's amplifier, in the order of the machine's drives.
    pub inputs: Vec<Signal>,
    /// End of the run, s.
    pub until: f64,
    /// Output interval, s.
    pub every: f64,
    /// Initial state: rotors are in the middle of their play, and currents that are not states are ignored.
    pub initial: State,
    /// Its log, if the file names one. Its times are the experiment's.
    pub log: Option<Arc<Log>>,
}

impl Experiment {
    /// A run from rest at the origin, with an input for each drive, to the time `until` (s), with a row after each
    /// interval `every` (s).
    pub fn new(name: impl Into<String>, inputs: Vec<Signal>, until: f64, every: f64) -> Self {
        Self { name: name.into(), inputs, until, every, initial: State::default(), log: None }
    }

    /// Its name as a file name without ending: in lower case, with `-` for everything but letters and digits.
    pub fn file_name(&self) -> String {
        file_name(&self.name)
    }

    /// Number of rows of its result, the first at time zero, the last at its end.
    pub fn samples(&self) -> u64 {
        Grid::new(self.every, self.until).intervals().saturating_add(1)
    }
}

/// A name as a file name: `5 V pulse` becomes `5-v-pulse`. The end of a name that is too long becomes a hash.
pub fn file_name(name: &str) -> String {
    let plain: String = name.to_lowercase().chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
    if plain.len() <= LONGEST_FILE_NAME {
        return plain;
    }
    let hash = format!("-{:016x}", hash(name.bytes()));
    format!("{}{hash}", &plain[..plain.floor_char_boundary(LONGEST_FILE_NAME - hash.len())])
}

/// A measured run: inputs and outputs at its own times.
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    /// Its experiment's name.
    pub name: String,
    /// The file that it was read from.
    pub file: PathBuf,
    /// Times, s: increasing, not necessarily equidistant. Zero is the log's first row, or the start of its window.
    pub time: Vec<f64>,
    /// Input of each drive's amplifier at those times, V or A before its gain, including any added signal.
    pub inputs: Vec<Vec<f64>>,
    /// Part of an axis' input that was added after the controller, if logged: a known disturbance.
    pub added: Option<Vec<f64>>,
    /// Interpolation of the inputs between them.
    pub hold: Hold,
    /// Logged reference of the cart at those times, m, if there is one.
    pub reference: Option<Vec<f64>>,
    /// The outputs; at least one.
    pub outputs: Vec<Output>,
    /// Message with which the recorder ended the file early.
    pub ended: Option<String>,
}

/// One measured quantity over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// The quantity.
    pub quantity: Quantity,
    /// True if only the magnitude was logged, as by a pulse counter; it is compared with absolute values.
    pub absolute: bool,
    /// A value for each time, SI; NaN if missing.
    pub values: Vec<f64>,
}

impl Log {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// True without samples.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// The output of that quantity, if it was measured.
    pub fn output(&self, quantity: Quantity) -> Option<&Output> {
        self.outputs.iter().find(|output| output.quantity == quantity)
    }

    /// The inputs as signals, to be fed into a model.
    pub fn signals(&self) -> Vec<Signal> {
        let signal =
            |values: &Vec<f64>| Signal::Sampled { times: self.time.clone(), values: values.clone(), hold: self.hold };
        self.inputs.iter().map(signal).collect()
    }

    /// Median interval between samples, s, which a few gaps do not change.
    pub fn interval(&self) -> f64 {
        let mut steps: Vec<f64> = self.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if steps.is_empty() {
            return 0.0;
        }
        let middle = steps.len() / 2;
        *steps.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}
