//! The wanted columns of a file, whatever its kind, and where each of their values stands.

use super::locator::Locator;
use super::presets::Preset;
use super::words::shown;
use crate::error::{Error, Result};
use crate::quantity::shortest;
use std::path::{Path, PathBuf};

/// Most values of a column that a message lists.
const LISTED: usize = 10;

/// Most numbers that are read from one file: 256 MiB, and a few times as much while they become logs.
const MOST_NUMBERS: usize = 1 << 25;

/// Refuses more numbers than that.
pub(super) fn check_numbers(file: &Path, columns: usize, rows: usize) -> Result<()> {
    if columns.saturating_mul(rows) <= MOST_NUMBERS {
        return Ok(());
    }
    let what = match columns {
        1 => format!("{rows} rows are too many"),
        n => format!("{rows} rows of {n} columns are too many"),
    };
    Err(Error::new(what)
        .in_file(file)
        .allowed(format!("up to {} rows of that many columns", MOST_NUMBERS / columns.max(1)))
        .next("save a part of the recording, every n-th row of it, or fewer columns"))
}

/// A column of a file.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum ColumnId {
    /// By its name.
    Name(String),
    /// By its place, from 1.
    Number(usize),
}

impl From<&str> for ColumnId {
    fn from(name: &str) -> Self {
        Self::Name(name.trim().to_string())
    }
}

/// How a text file is written, where that cannot be seen from itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dialect {
    /// The separator of the columns; found out where it is not said. A space stands for any number of blanks.
    pub separator: Option<char>,
    /// True if numbers have decimal commas.
    pub decimal_comma: bool,
}

/// Rows to keep, by their value in one column.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    /// The column.
    pub column: ColumnId,
    /// The values; as text, numbers as they are written.
    pub values: Vec<String>,
    /// True if rows with one of the values are kept, or all others.
    pub keep: bool,
}

impl Filter {
    pub(super) fn keeps(&self, text: &str) -> bool {
        self.values.iter().any(|value| same(value, text)) == self.keep
    }
}

/// True if two texts are the same, as numbers if they are such.
fn same(a: &str, b: &str) -> bool {
    match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}

/// The columns that are wanted from a file.
pub(super) struct Request<'a> {
    /// Columns of numbers.
    pub columns: &'a [ColumnId],
    /// How many of them, from the first on, must have a value in every row.
    pub complete: usize,
    /// True if the first column has to increase: rows behind the first one that breaks this may then be missing.
    pub ordered: bool,
    /// True if a row under the header may name the units.
    pub units_row: bool,
    pub dialect: Dialect,
    pub filter: Option<&'a Filter>,
    /// The column that tells runs apart.
    pub split: Option<&'a ColumnId>,
    /// The recorder that made the file, if it is known.
    pub preset: Option<&'static Preset>,
}

impl<'a> Request<'a> {
    /// These columns, with a value in every row.
    pub fn complete(columns: &'a [ColumnId]) -> Self {
        let complete = columns.len();
        Self {
            columns,
            complete,
            ordered: false,
            units_row: false,
            dialect: Dialect::default(),
            filter: None,
            split: None,
            preset: None,
        }
    }

    /// The wanted columns, then that of the filter, then that of the split.
    pub fn all_columns(&self) -> impl Iterator<Item = &'a ColumnId> {
        self.columns.iter().chain(self.filter.map(|filter| &filter.column)).chain(self.split)
    }
}

/// The columns that were asked for.
#[derive(Debug, Default)]
pub(super) struct Sheet {
    pub file: PathBuf,
    /// True if a row is a line in messages: a line of a text file has a text to show.
    pub is_text: bool,
    /// The names of the wanted columns.
    pub names: Vec<String>,
    /// The units that the file gives them.
    pub units: Vec<Option<String>>,
    /// A value per row; NaN where it is missing.
    pub columns: Vec<Vec<f64>>,
    /// The number of each row in its file, from 1: in a text file that of its line.
    pub rows: Vec<usize>,
    /// The runs, in the file's order.
    pub runs: Vec<LabelledRows>,
    /// In a text file, what it takes to find a field again.
    pub fields: Option<Locator>,
    /// The values seen in the column of the filter, a few of them.
    pub filtered: Vec<String>,
    /// The words with which the recorder ended the file early.
    pub ended: Option<String>,
}

/// Rows one after another with the same value in the column that tells runs apart.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LabelledRows {
    pub label: String,
    /// Its first row, counted among the rows that were read.
    pub begin: usize,
}

impl Sheet {
    /// From whole columns: the wanted ones, then that of the filter, then that of the split.
    pub fn from_columns(
        file: &Path,
        names: Vec<String>,
        mut columns: Vec<Vec<f64>>,
        request: &Request<'_>,
    ) -> Result<Self> {
        let mut sheet = Self { file: file.to_path_buf(), names, ..Self::default() };
        sheet.begin(request);
        let rows = columns.first().map_or(0, Vec::len);
        let others = columns.split_off(request.columns.len());
        for row in 0..rows {
            let mut rest = others.iter().map(|column| shortest(column[row]));
            if let Some(filter) = request.filter {
                let value = rest.next().unwrap_or_default();
                sheet.note_filtered(&value);
                if !filter.keeps(&value) {
                    continue;
                }
            }
            if request.split.is_some() {
                sheet.note_run(&rest.next().unwrap_or_default());
            }
            for (i, theirs) in columns.iter().enumerate() {
                let value = theirs[row];
                if value.is_infinite() || (value.is_nan() && i < request.complete) {
                    let what = if value.is_nan() { "has no value" } else { "is infinite" };
                    let error = Error::new(format!("row {} of {} {what}", row + 1, sheet.names[i])).in_file(file);
                    let next = match i < request.complete {
                        true => "fill in the value, or leave out the row",
                        false => "write NaN where there is no value",
                    };
                    return Err(error.allowed("a finite number").next(next));
                }
            }
            sheet.rows.push(row + 1);
        }
        for column in &mut columns {
            sheet.rows.iter().enumerate().for_each(|(k, row)| column[k] = column[row - 1]);
            column.truncate(sheet.rows.len());
        }
        sheet.columns = columns;
        Ok(sheet)
    }

    pub fn begin(&mut self, request: &Request<'_>) {
        self.columns = vec![Vec::new(); request.columns.len()];
        self.units.resize(request.columns.len(), None);
    }

    /// Of a row that will follow.
    pub fn note_run(&mut self, label: &str) {
        if self.runs.last().is_none_or(|run| run.label != label) {
            self.runs.push(LabelledRows { label: label.to_string(), begin: self.rows.len() });
        }
    }

    pub fn note_filtered(&mut self, value: &str) {
        if self.filtered.len() <= LISTED && !self.filtered.iter().any(|known| known == value) {
            self.filtered.push(value.to_string());
        }
    }

    pub fn nothing_left(&self, filter: &Filter) -> Error {
        let column = filter.column.shown();
        let list: Vec<String> = filter.values.iter().map(|value| shown(value)).collect();
        let list = list.join(", ");
        let what = match filter.keep {
            true => format!("no row has {list} in column {column}"),
            false => format!("every row has {list} in column {column}"),
        };
        let mut seen: Vec<String> = self.filtered.iter().take(LISTED).map(|value| shown(value)).collect();
        if self.filtered.len() > LISTED {
            seen.push("and more".into());
        }
        let error = Error::new(what).in_file(&self.file);
        error.allowed(seen.join(", ")).next("correct `where` in the case file, or leave it out")
    }

    /// `line 7` or `row 7`.
    pub fn row(&self, row: usize) -> String {
        let word = if self.is_text { "line" } else { "row" };
        format!("{word} {}", self.rows[row])
    }

    /// An error at the value of the i-th column in a row, counted among those read.
    pub fn error(&self, i: usize, row: usize, what: impl Into<String>) -> Error {
        let error = Error::new(what);
        match self.fields.as_ref().and_then(|fields| fields.place(&self.file, self.rows[row], i)) {
            Some(place) => error.at(place),
            None => error.in_file(&self.file),
        }
    }

    /// An error at the name of the i-th column.
    pub fn heading_error(&self, i: usize, what: impl Into<String>) -> Error {
        let error = Error::new(what);
        match self.fields.as_ref().and_then(|fields| fields.heading(&self.file, i)) {
            Some(place) => error.at(place),
            None => error.in_file(&self.file),
        }
    }
}

impl ColumnId {
    pub(super) fn name(&self) -> Option<&str> {
        match self {
            Self::Name(name) => Some(name),
            Self::Number(_) => None,
        }
    }

    pub(super) fn number(&self) -> Option<usize> {
        match self {
            Self::Name(_) => None,
            Self::Number(number) => Some(*number),
        }
    }

    /// As messages show it.
    pub(super) fn shown(&self) -> String {
        match self {
            Self::Name(name) => shown(name),
            Self::Number(number) => number.to_string(),
        }
    }
}
