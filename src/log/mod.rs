//! Measured files in: logs of a machine, and every mistake told with its line.

mod csv;
mod lines;
mod mapping;

pub use crate::stage::Quantity;
pub use csv::{read_columns, read_samples};
pub use mapping::{Mapping, Source};

use crate::signal::{Hold, Signal};
use std::path::PathBuf;

/// A measured run: what went in and what was seen, at its own times.
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    /// Its experiment's name.
    pub name: String,
    /// The file that it was read from.
    pub file: PathBuf,
    /// Times, s: increasing, not always evenly. Zero is the log's first row, or where its window begins.
    pub time: Vec<f64>,
    /// What was fed into the amplifier at those times, V or A before its gain.
    pub input: Vec<f64>,
    /// What the input did between them.
    pub hold: Hold,
    /// What was seen; at least one.
    pub outputs: Vec<Output>,
}

/// One measured quantity over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// What it is.
    pub quantity: Quantity,
    /// Whether its sign was lost, as by a counter of pulses: then it is to be compared with an absolute value.
    pub absolute: bool,
    /// A value for each time, SI; NaN where one is missing.
    pub values: Vec<f64>,
}

impl Log {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// The output of that quantity, if it was measured.
    pub fn output(&self, quantity: Quantity) -> Option<&Output> {
        self.outputs.iter().find(|output| output.quantity == quantity)
    }

    /// The input as a signal, to be fed into a model.
    pub fn signal(&self) -> Signal {
        Signal::Sampled { times: self.time.clone(), values: self.input.clone(), hold: self.hold }
    }

    /// The usual interval between samples, s: the median, which a few gaps do not change.
    pub fn interval(&self) -> f64 {
        let mut steps: Vec<f64> = self.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if steps.is_empty() {
            return 0.0;
        }
        let middle = steps.len() / 2;
        *steps.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}
