//! Measured files in: logs of a machine from CSV, Parquet and MATLAB files, and every mistake told with its line.

mod accelerometer;
mod csv;
mod formats;
mod guess;
#[cfg(feature = "json")]
mod klipper;
mod lines;
mod locator;
mod mapping;
mod matlab;
#[cfg(feature = "parquet")]
mod parquet;
mod presets;
mod sheet;
mod survey;
mod words;

pub use crate::machine::Quantity;
pub use accelerometer::{Accelerometer, read_accelerometer};
pub use guess::{Guess, Looked, Seen, look};
pub use mapping::{Clock, Mapping, Source, Unit};
pub use presets::{End, In, PRESETS, Pick, Preset};
pub use sheet::{ColumnId, Dialect, Filter};
pub(crate) use survey::jumps_text;
pub use survey::{Channel, Clipped, Gap, Jump, Motion, Note, Outlier, Remedy, Severity, Steady, Survey, Timing};

use crate::error::Result;
use crate::signal::{Hold, Signal};
use sheet::Request;
use std::path::{Path, PathBuf};

/// A measured run: what went in and what was seen, at its own times.
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    /// Its experiment's name.
    pub name: String,
    /// The file that it was read from.
    pub file: PathBuf,
    /// Times, s: increasing, not always evenly. Zero is the log's first row, or where its window begins.
    pub time: Vec<f64>,
    /// The input of the amplifier at those times, V or A before its gain; with any input that was added to it.
    pub input: Vec<f64>,
    /// The part of it that was added behind the controller, if the log says so: a known disturbance.
    pub added: Option<Vec<f64>>,
    /// The input between them.
    pub hold: Hold,
    /// Where the cart should have been at those times, m, if the log was made in closed loop and says so.
    pub reference: Option<Vec<f64>>,
    /// The outputs; at least one.
    pub outputs: Vec<Output>,
    /// With which words the recorder ended the file early.
    pub ended: Option<String>,
}

/// One measured quantity over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// The quantity.
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

/// The columns called `names` of a file, in that order; numbers as they stand, in whatever unit the file has.
pub fn read_columns(file: &Path, names: &[&str]) -> Result<Vec<Vec<f64>>> {
    let ids: Vec<ColumnId> = names.iter().map(|name| ColumnId::from(*name)).collect();
    Ok(formats::read(file, &Request::complete(&ids))?.columns)
}

/// The columns called `time` and `column` of a file; the times must increase from row to row.
pub fn read_samples(file: &Path, time: &str, column: &str) -> Result<(Vec<f64>, Vec<f64>)> {
    let ids = [time, column].map(ColumnId::from);
    let mut sheet = formats::read(file, &Request { ordered: true, ..Request::complete(&ids) })?;
    let times = &sheet.columns[0];
    for (before, row) in (1..times.len()).enumerate() {
        let (t, last) = (times[row], times[before]);
        if t > last {
            continue;
        }
        let (here, there) = (sheet.row(row), sheet.row(before));
        let (what, next) = match t == last {
            true => (format!("time {t} in {here} repeats that of {there}"), "keep one row of each time"),
            false => (
                format!("time {t} in {here} is before {last} in {there}"),
                "sort the rows by time, or cut the file where a second recording begins",
            ),
        };
        return Err(sheet.error(0, row, what).allowed("times that increase from row to row").next(next));
    }
    let values = sheet.columns.pop().unwrap_or_default();
    Ok((sheet.columns.pop().unwrap_or_default(), values))
}
