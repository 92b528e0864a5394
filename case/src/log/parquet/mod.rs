//! Columns from Parquet files.

mod pages;

use super::lines::unreadable;
use super::sheet::{ColumnId, Request, Sheet, check_numbers};
use super::words::{near, shown};
use crate::error::{Error, Result};
use ::parquet::basic::{LogicalType, TimeUnit, Type};
use ::parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use ::parquet::data_type::DataType;
use ::parquet::errors::{ParquetError, Result as ParquetResult};
use ::parquet::file::reader::{FileReader, SerializedFileReader};
use ::parquet::schema::types::ColumnDescriptor;
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Rows that are read at a time.
const BLOCK: usize = 8192;

/// The names of all columns.
pub(super) fn names(file: &Path) -> Result<Vec<ColumnId>> {
    let input = crate::files::open(file).map_err(|error| unreadable(file, &error))?;
    let reader = SerializedFileReader::new(input).map_err(|error| damaged(file, &error))?;
    let schema = reader.metadata().file_metadata().schema_descr();
    Ok(schema.columns().iter().map(|column| ColumnId::Name(column.path().string())).collect())
}

/// Reads the wanted columns.
pub(super) fn read(file: &Path, request: &Request<'_>) -> Result<Sheet> {
    let input = crate::files::open(file).map_err(|error| unreadable(file, &error))?;
    let reader = SerializedFileReader::new(input).map_err(|error| damaged(file, &error))?;
    let metadata = reader.metadata().file_metadata();
    let schema = metadata.schema_descr();
    // What the whole file says of its rows may differ from what its groups say, and those are read.
    let groups = reader.metadata().row_groups().iter().map(|group| usize::try_from(group.num_rows()).unwrap_or(0));
    let rows = groups.fold(0, usize::saturating_add);
    if rows == 0 {
        let error = Error::new("the file names its columns but has no rows").in_file(file);
        return Err(error.allowed("at least one row of numbers").next("check that the recording was saved"));
    }
    let places = request.all_columns().map(|id| find(file, schema.columns(), id)).collect::<Result<Vec<_>>>()?;
    check_numbers(file, places.len(), rows)?;
    let names: Vec<String> = places.iter().map(|&k| shown(&schema.column(k).path().string())).collect();
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut length = rows;
    for (k, (&place, name)) in places.iter().zip(&names).enumerate() {
        check_kind(file, &schema.column(place), name)?;
        pages::check(file, reader.metadata(), place)?;
        let ordered = request.ordered && k == 0;
        // The library behind this does not withstand every damage: what it cannot read ends as an error all the same.
        let read = catch_unwind(AssertUnwindSafe(|| column(&reader, place, length, ordered)));
        let read = read.unwrap_or_else(|_| Err(ParquetError::General("it is damaged".into())));
        columns.push(read.map_err(|error| damaged(file, &error))?);
        length = columns[k].len();
    }
    let wanted = request.columns.len();
    let mut sheet = Sheet::from_columns(file, names[..wanted].to_vec(), columns, request)?;
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

/// The first values of a column; NaN where there is none. Time stamps count from the first, so that a double holds
/// them. Where they have to increase, they end with the first that does not.
fn column(reader: &SerializedFileReader<File>, place: usize, length: usize, ordered: bool) -> ParquetResult<Vec<f64>> {
    let schema = reader.metadata().file_metadata().schema_descr();
    let descriptor = schema.column(place);
    let is_stamp = stamp(&descriptor).is_some();
    let mut first = None;
    let most = descriptor.max_def_level();
    let mut values = Values { values: Vec::new(), length, ordered };
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group)?;
        let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
        match group.get_column_reader(place)? {
            ColumnReader::BoolColumnReader(column) => values.append(column, rows, most, |x| f64::from(u8::from(*x)))?,
            ColumnReader::Int32ColumnReader(column) => values.append(column, rows, most, |x| f64::from(*x))?,
            ColumnReader::Int64ColumnReader(column) => values.append(column, rows, most, |x| {
                let zero = if is_stamp { *first.get_or_insert(*x) } else { 0 };
                x.wrapping_sub(zero) as f64
            })?,
            ColumnReader::FloatColumnReader(column) => values.append(column, rows, most, |x| f64::from(*x))?,
            ColumnReader::DoubleColumnReader(column) => values.append(column, rows, most, |x| *x)?,
            _ => return Err(ParquetError::General("a column does not hold numbers".into())),
        }
        if values.values.len() == values.length {
            break;
        }
    }
    Ok(values.values)
}

/// Values of a column, as far as they are read.
struct Values {
    values: Vec<f64>,
    /// So many are wanted.
    length: usize,
    /// True if they have to increase.
    ordered: bool,
}

impl Values {
    /// Adds those of a group, a block at a time.
    fn append<T: DataType>(
        &mut self,
        mut column: ColumnReaderImpl<T>,
        rows: usize,
        most: i16,
        mut number: impl FnMut(&T::T) -> f64,
    ) -> ParquetResult<()> {
        let (mut numbers, mut levels) = (Vec::new(), Vec::new());
        let mut left = rows.min(self.length - self.values.len());
        while left > 0 {
            numbers.clear();
            levels.clear();
            let count = left.min(BLOCK);
            let there = (most > 0).then_some(&mut levels);
            let (records, ..) = column.read_records(count, there, None, &mut numbers)?;
            if records != count {
                return Err(ParquetError::General("a column has fewer rows than its file".into()));
            }
            let mut numbers = numbers.iter();
            let mut next = || numbers.next().map_or(f64::NAN, &mut number);
            let known = self.values.len();
            match most {
                0 => self.values.extend((0..count).map(|_| next())),
                _ => self.values.extend(levels.iter().map(|&level| if level == most { next() } else { f64::NAN })),
            }
            if self.ordered {
                let values = &self.values;
                if let Some(end) = (known.max(1)..values.len()).find(|&i| values[i] <= values[i - 1]) {
                    self.length = end + 1;
                    self.values.truncate(end + 1);
                    return Ok(());
                }
            }
            left -= count;
        }
        Ok(())
    }
}
