//! Which reader a file is for, by how it begins.

use super::presets::{In, Pick, Preset, found};
use super::sheet::{ColumnId, Request, Sheet};
use super::words::shown;
use super::{csv, lines, matlab};
use crate::error::{Error, Result};
use std::path::Path;

/// How Parquet files and packed messages begin.
const PARQUET: &[u8] = b"PAR1";
const GZIP: &[u8] = &[0x1f, 0x8b];

/// Reads the wanted columns of a file of any format.
pub(super) fn read(file: &Path, request: &Request<'_>) -> Result<Sheet> {
    let beginning = lines::beginning(file)?;
    let mut sheet = match () {
        () if matlab::is_matlab(file, &beginning) => matlab::read(file, &beginning, request)?,
        () if beginning.starts_with(PARQUET) => parquet::read(file, request)?,
        () if request.preset.is_some_and(|preset| is_packed(preset, &beginning)) => messages::read(file, request)?,
        () => csv::read(file, request)?,
    };
    sheet.file = file.to_path_buf();
    if sheet.rows.is_empty()
        && let Some(filter) = request.filter
    {
        return Err(sheet.nothing_left(filter));
    }
    Ok(sheet)
}

/// The columns of a file of any format.
pub(super) fn names(file: &Path) -> Result<Vec<ColumnId>> {
    let beginning = lines::beginning(file)?;
    match () {
        () if matlab::is_matlab(file, &beginning) => matlab::names(file, &beginning),
        () if beginning.starts_with(PARQUET) => parquet::names(file),
        () if cfg!(feature = "json") && beginning.starts_with(GZIP) => {
            Ok(messages::names(file)?.into_iter().map(ColumnId::Name).collect())
        }
        () => csv::names(file),
    }
}

impl Preset {
    /// The columns of this recorder that a file has: key of the log's table, column, unit.
    pub fn columns_of(&self, file: &Path) -> Result<Vec<(&'static str, ColumnId, In)>> {
        let (names, unit) = match self.time {
            (Pick::Number(number), unit) => return Ok(vec![("time", ColumnId::Number(number), In::Unit(unit))]),
            (Pick::Name(names), unit) => (names, unit),
        };
        let there = match is_packed(self, &lines::beginning(file)?) {
            true => messages::names(file)?,
            false => csv::heading(file, names)?.unwrap_or_default(),
        };
        let Some(time) = found(names, &there) else {
            let names: Vec<String> = names.iter().map(|name| shown(name)).collect();
            let what = format!("no line names the column {}, as those of {} do", names.join(" or "), self.title);
            let next = "check that the file is what this recorder wrote, or name its columns without `preset`";
            return Err(Error::new(what).in_file(file).next(next));
        };
        let mut columns = vec![("time", ColumnId::Name(time), In::Unit(unit))];
        for (key, names, of) in self.columns {
            columns.extend(found(names, &there).map(|name| (*key, ColumnId::Name(name), *of)));
        }
        Ok(columns)
    }
}

/// True if a file that begins like this holds packed messages of this recorder.
fn is_packed(preset: &Preset, beginning: &[u8]) -> bool {
    preset.is_messages && beginning.starts_with(GZIP)
}

#[cfg(feature = "json")]
use super::klipper as messages;
#[cfg(feature = "parquet")]
use super::parquet;

/// Stands in for the reader of packed messages in a build without it.
#[cfg(not(feature = "json"))]
mod messages {
    use super::*;

    pub fn read(file: &Path, _: &Request<'_>) -> Result<Sheet> {
        Err(refused(file))
    }

    pub fn names(file: &Path) -> Result<Vec<String>> {
        Err(refused(file))
    }

    fn refused(file: &Path) -> Error {
        Error::new("this is a file of packed messages, and this build of the program does not read them")
            .in_file(file)
            .allowed("CSV, Parquet and MATLAB files")
            .next("use a build with the feature `json`")
    }
}

/// Stands in for the reader of Parquet files in a build without it.
#[cfg(not(feature = "parquet"))]
mod parquet {
    use super::*;

    pub fn read(file: &Path, _: &Request<'_>) -> Result<Sheet> {
        Err(refused(file))
    }

    pub fn names(file: &Path) -> Result<Vec<ColumnId>> {
        Err(refused(file))
    }

    fn refused(file: &Path) -> Error {
        Error::new("this is a Parquet file, and this build of the program does not read them")
            .in_file(file)
            .next("export the data as CSV, or use `taut` itself, which reads them if built with the feature `parquet`")
    }
}
