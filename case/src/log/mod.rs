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
pub use crate::plan::{Log, Output};
pub use accelerometer::{Accelerometer, read_accelerometer};
pub use guess::{FileColumn, Guess, Looked, look};
pub use mapping::{Clock, Fed, Mapping, Source, Unit};
pub use presets::{End, In, PRESETS, Pick, Preset};
pub use sheet::{ColumnId, Dialect, Filter};
pub use survey::{
    Channel, Clipped, Gap, Held, Jump, Motion, Note, Outlier, Remedy, Severity, Steady, Survey, Timing, jumps_text,
    step_of,
};

use crate::error::Result;
use sheet::Request;
use std::path::Path;

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
