//! From a file's columns to logs: what each column is, in which unit, and which rows belong to which run.

use super::csv;
use super::{Log, Output, Quantity};
use crate::error::{Error, Result};
use crate::signal::Hold;
use std::path::PathBuf;

/// What the columns of a file are.
#[derive(Debug, Clone, PartialEq)]
pub struct Mapping {
    /// The file.
    pub file: PathBuf,
    /// The column of times.
    pub time: Source,
    /// The column of what was fed into the amplifier, unless it is known otherwise.
    pub input: Option<Source>,
    /// The columns of what was seen.
    pub outputs: Vec<(Quantity, Source)>,
    /// Quantities whose sign was lost.
    pub absolute: Vec<Quantity>,
    /// What the input did between its samples.
    pub hold: Hold,
}

/// A column and how its numbers become SI: value = `scale` · `unit` · number + `offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// The column's name.
    pub column: String,
    /// What one of its unit is in SI; none where the file says it or it is SI.
    pub unit: Option<f64>,
    /// A factor beside the unit, such as −1.
    pub scale: f64,
    /// What is added in the end, SI.
    pub offset: f64,
}

impl Source {
    fn convert(&self, numbers: &[f64]) -> Vec<f64> {
        let factor = self.scale * self.unit.unwrap_or(1.0);
        numbers.iter().map(|x| factor * x + self.offset).collect()
    }
}

impl Mapping {
    /// Reads the runs; the first of each pair is what tells a run of a split file from the others.
    pub fn read(&self) -> Result<Vec<(Option<String>, Log)>> {
        let (times, _) = csv::read_samples(&self.file, &self.time.column, &self.time.column)?;
        let mut names: Vec<&str> = self.outputs.iter().map(|(_, source)| source.column.as_str()).collect();
        names.extend(self.input.iter().map(|source| source.column.as_str()));
        let columns = csv::read_columns(&self.file, &names)?;
        let time = self.time.convert(&times);
        let [first, .., _] = time[..] else {
            return Err(Error::new("the log has a single row").in_file(&self.file).allowed("at least two rows"));
        };
        let input = match (&self.input, columns.last()) {
            (Some(source), Some(numbers)) => source.convert(numbers),
            _ => vec![0.0; time.len()],
        };
        let outputs = self.outputs.iter().zip(&columns).map(|((quantity, source), numbers)| Output {
            quantity: *quantity,
            absolute: self.absolute.contains(quantity),
            values: source.convert(numbers),
        });
        let log = Log {
            name: String::new(),
            file: self.file.clone(),
            input,
            hold: self.hold,
            outputs: outputs.collect(),
            time: time.iter().map(|t| t - first).collect(),
        };
        Ok(vec![(None, log)])
    }
}
