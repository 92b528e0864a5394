//! Columns from Parquet files.

use super::csv::{near, shown};
use super::lines::unreadable;
use super::sheet::{ColumnId, Request, Sheet};
use crate::error::{Error, Result};
use ::parquet::basic::{LogicalType, TimeUnit, Type};
use ::parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use ::parquet::data_type::DataType;
use ::parquet::errors::{ParquetError, Result as ParquetResult};
use ::parquet::file::reader::{FileReader, SerializedFileReader};
use ::parquet::schema::types::ColumnDescriptor;
use std::fs::File;
use std::path::Path;

/// Most rows.
const MOST_ROWS: i64 = 1 << 27;

/// Reads the wanted columns.
pub(super) fn read(file: &Path, request: &Request<'_>) -> Result<Sheet> {
    let input = File::open(file).map_err(|error| unreadable(file, &error))?;
    let reader = SerializedFileReader::new(input).map_err(|error| damaged(file, &error))?;
    let metadata = reader.metadata().file_metadata();
    let schema = metadata.schema_descr();
    if metadata.num_rows() > MOST_ROWS {
        let error = Error::new(format!("the file has {} rows", metadata.num_rows())).in_file(file);
        return Err(error.allowed(format!("up to {MOST_ROWS}")).next("save a part of it, or every n-th row"));
    }
    if metadata.num_rows() == 0 {
        let error = Error::new("the file names its columns but has no rows").in_file(file);
        return Err(error.allowed("at least one row of numbers").next("check that the recording was saved"));
    }
    let places = request.all_columns().map(|id| find(file, schema.columns(), id)).collect::<Result<Vec<_>>>()?;
    let names: Vec<String> = places.iter().map(|&k| shown(&schema.column(k).path().string())).collect();
    let mut columns = Vec::new();
    for (&place, name) in places.iter().zip(&names) {
        check_kind(file, &schema.column(place), name)?;
        columns.push(column(&reader, place).map_err(|error| damaged(file, &error))?);
    }
    let wanted = request.columns.len();
    let mut sheet = Sheet::from_columns(file, names[..wanted].to_vec(), &columns, request)?;
    for (unit, &place) in sheet.units.iter_mut().zip(&places) {
        let key = format!("unit.{}", schema.column(place).path().string());
        let written = metadata.key_value_metadata().into_iter().flatten().find(|pair| pair.key == key);
        let written = written.and_then(|pair| pair.value.clone()).filter(|unit| !unit.is_empty());
        *unit = stamp(&schema.column(place)).map(str::to_string).or(written);
    }
    Ok(sheet)
}

fn damaged(file: &Path, error: &ParquetError) -> Error {
    Error::new(format!("this Parquet file cannot be read: {error}"))
        .in_file(file)
        .next("write it again, with compression snappy, gzip, lz4, zstd or none; or as CSV")
}

/// Where a column stands.
fn find(file: &Path, columns: &[std::sync::Arc<ColumnDescriptor>], id: &ColumnId) -> Result<usize> {
    let names: Vec<String> = columns.iter().map(|column| column.path().string()).collect();
    match id {
        ColumnId::Number(k) if (1..=names.len()).contains(k) => Ok(k - 1),
        ColumnId::Number(k) => Err(Error::new(format!("there is no column {k}"))
            .in_file(file)
            .allowed(format!("columns 1 to {}", names.len()))
            .next("correct the column's number in the case file")),
        ColumnId::Name(name) => names.iter().position(|n| n == name).ok_or_else(|| {
            let mut list: Vec<String> = names.iter().take(10).map(|n| shown(n)).collect();
            if names.len() > list.len() {
                list.push(format!("and {} more", names.len() - list.len()));
            }
            let error =
                Error::new(format!("there is no column {}", shown(name))).in_file(file).allowed(list.join(", "));
            match near(name, names.iter().map(String::as_str)) {
                Some(near) => error.next(format!("did you mean {}?", shown(near))),
                None => error.next("name one of these columns"),
            }
        }),
    }
}

/// Only plain columns of numbers are read.
fn check_kind(file: &Path, column: &ColumnDescriptor, name: &str) -> Result<()> {
    let kind = match (column.physical_type(), column.logical_type_ref()) {
        _ if column.max_rep_level() > 0 => "lists",
        (Type::BYTE_ARRAY | Type::FIXED_LEN_BYTE_ARRAY | Type::INT96, _) => "text or another kind of bytes",
        (_, Some(LogicalType::Decimal(_))) => "decimals",
        _ => return Ok(()),
    };
    Err(Error::new(format!("column {name} holds {kind}"))
        .in_file(file)
        .allowed("whole or floating-point numbers, truth values, time stamps")
        .next("convert it to numbers before writing the file"))
}

/// The unit of a column of time stamps.
fn stamp(column: &ColumnDescriptor) -> Option<&'static str> {
    match column.logical_type_ref()? {
        LogicalType::Timestamp(stamp) | LogicalType::Time(stamp) => Some(match stamp.unit {
            TimeUnit::MILLIS => "ms",
            TimeUnit::MICROS => "us",
            TimeUnit::NANOS => "ns",
        }),
        _ => None,
    }
}

/// All values of a column; NaN where there is none. Time stamps count from the first, so that a double holds them.
fn column(reader: &SerializedFileReader<File>, place: usize) -> ParquetResult<Vec<f64>> {
    let schema = reader.metadata().file_metadata().schema_descr();
    let descriptor = schema.column(place);
    let is_stamp = stamp(&descriptor).is_some();
    let mut first = None;
    let mut values = Vec::new();
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group)?;
        let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
        let most = descriptor.max_def_level();
        match group.get_column_reader(place)? {
            ColumnReader::BoolColumnReader(column) => {
                append(column, rows, most, &mut values, |x| f64::from(u8::from(*x)))?;
            }
            ColumnReader::Int32ColumnReader(column) => append(column, rows, most, &mut values, |x| f64::from(*x))?,
            ColumnReader::Int64ColumnReader(column) => append(column, rows, most, &mut values, |x| {
                let zero = if is_stamp { *first.get_or_insert(*x) } else { 0 };
                x.wrapping_sub(zero) as f64
            })?,
            ColumnReader::FloatColumnReader(column) => append(column, rows, most, &mut values, |x| f64::from(*x))?,
            ColumnReader::DoubleColumnReader(column) => append(column, rows, most, &mut values, |x| *x)?,
            _ => return Err(ParquetError::General("a column does not hold numbers".into())),
        }
    }
    Ok(values)
}

fn append<T: DataType>(
    mut column: ColumnReaderImpl<T>,
    rows: usize,
    most: i16,
    values: &mut Vec<f64>,
    mut number: impl FnMut(&T::T) -> f64,
) -> ParquetResult<()> {
    let (mut numbers, mut levels) = (Vec::new(), Vec::new());
    let there = (most > 0).then_some(&mut levels);
    let (records, ..) = column.read_records(rows, there, None, &mut numbers)?;
    if records != rows {
        return Err(ParquetError::General("a column has fewer rows than its file".into()));
    }
    let mut numbers = numbers.iter();
    let mut next = || numbers.next().map_or(f64::NAN, &mut number);
    match most {
        0 => values.extend((0..rows).map(|_| next())),
        _ => values.extend(levels.iter().map(|&level| if level == most { next() } else { f64::NAN })),
    }
    Ok(())
}
