//! Trajectories out as Parquet.

use crate::error::{Error, Result};
use crate::files::Draft;
use crate::trajectory::{Column, Trajectory};
use parquet::basic::{Repetition, Type as PhysicalType};
use parquet::data_type::DoubleType;
use parquet::errors::Result as ParquetResult;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{Type, TypePtr};
use std::fs::File;
use std::path::Path;
use std::sync::Arc;

/// Rows of a row group, which is held in memory until it is full: 19 MB for 18 columns.
const GROUP: usize = 1 << 17;

/// Writes a trajectory block by block: a column of doubles for each, named as in CSV.
///
/// The file's key-value metadata holds each column's unit, as `unit.cart_position_m` = `m`. Like the CSV, the file has
/// a temporary name until [`ParquetWriter::finish`], and is removed if that is never called.
pub struct ParquetWriter {
    draft: Draft,
    writer: Option<SerializedFileWriter<File>>,
    group: Trajectory,
}

impl ParquetWriter {
    /// Begins the file; its folder exists.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        Ok(Self { draft: Draft::create(path)?, writer: None, group: Trajectory::default() })
    }

    /// Adds the rows of `block`; every block has the same columns.
    pub fn write(&mut self, block: &Trajectory) -> Result<()> {
        if self.writer.is_none() {
            let file = self.draft.file()?;
            self.writer = Some(begin(file, &block.columns).map_err(|e| self.told(&e))?);
            self.group = Trajectory::with_capacity(&block.columns, GROUP);
        }
        self.group.append(block);
        if self.group.len() >= GROUP {
            self.flush()?;
        }
        Ok(())
    }

    /// Writes what is left and gives the file its name.
    pub fn finish(mut self) -> Result<()> {
        self.flush()?;
        if let Some(writer) = self.writer.take() {
            writer.close().map_err(|e| self.told(&e))?;
        }
        self.draft.finish()
    }

    fn flush(&mut self) -> Result<()> {
        let Some(writer) = self.writer.as_mut().filter(|_| !self.group.is_empty()) else { return Ok(()) };
        let written = write_group(writer, &self.group);
        self.group.columns.iter_mut().for_each(|column| column.values.clear());
        written.map_err(|e| self.told(&e))
    }

    fn told(&self, error: &parquet::errors::ParquetError) -> Error {
        Error::new(format!("cannot write this file: {error}"))
            .in_file(self.draft.path())
            .next("free some space, or choose another folder")
    }
}

fn begin(file: File, columns: &[Column]) -> ParquetResult<SerializedFileWriter<File>> {
    let fields: ParquetResult<Vec<TypePtr>> = columns.iter().map(field).collect();
    let schema = Type::group_type_builder("trajectory").with_fields(fields?).build()?;
    let unit = |column: &Column| KeyValue::new(format!("unit.{}", column.heading()), column.unit.clone());
    let properties = WriterProperties::builder()
        .set_created_by(concat!("taut ", env!("CARGO_PKG_VERSION")).to_string())
        .set_key_value_metadata(Some(columns.iter().map(unit).collect()))
        .build();
    SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))
}

fn field(column: &Column) -> ParquetResult<TypePtr> {
    let heading = column.heading();
    let builder = Type::primitive_type_builder(&heading, PhysicalType::DOUBLE);
    Ok(Arc::new(builder.with_repetition(Repetition::REQUIRED).build()?))
}

fn write_group(writer: &mut SerializedFileWriter<File>, group: &Trajectory) -> ParquetResult<()> {
    let mut rows = writer.next_row_group()?;
    for column in &group.columns {
        if let Some(mut out) = rows.next_column()? {
            out.typed::<DoubleType>().write_batch(&column.values, None, None)?;
            out.close()?;
        }
    }
    rows.close().map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    /// A trajectory of so many rows, in blocks; and its file, read by the library's own reader.
    #[test]
    fn a_file_reads_back_to_the_same_bits() {
        let rows = 2 * GROUP + 1000;
        let path = std::env::temp_dir().join(format!("taut-{}.parquet", std::process::id()));
        let mut writer = ParquetWriter::create(&path).unwrap();
        let mut block = Trajectory { columns: vec![Column::new("time", "s"), Column::new("cart_speed", "m/s")] };
        let value = |row: usize| (row as f64 * 0.7).sin() * 1e-9;
        for row in 0..rows {
            block.columns[0].values.push(row as f64 * 1e-3);
            block.columns[1].values.push(value(row));
            if block.len() == 256 || row + 1 == rows {
                writer.write(&block).unwrap();
                block.columns.iter_mut().for_each(|c| c.values.clear());
            }
        }
        assert!(!path.exists(), "it has a temporary name until it is whole");
        writer.finish().unwrap();

        let file = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
        let metadata = file.metadata();
        assert_eq!(metadata.num_row_groups(), 3);
        let units: Vec<String> = metadata.file_metadata().key_value_metadata().unwrap()[..2]
            .iter()
            .map(|pair| format!("{}={}", pair.key, pair.value.as_deref().unwrap_or_default()))
            .collect();
        assert_eq!(units, ["unit.time_s=s", "unit.cart_speed_m_s=m/s"]);
        let mut count = 0;
        for (row, record) in file.get_row_iter(None).unwrap().enumerate() {
            let record = record.unwrap();
            assert_eq!(record.get_double(0).unwrap().to_bits(), (row as f64 * 1e-3).to_bits());
            assert_eq!(record.get_double(1).unwrap().to_bits(), value(row).to_bits());
            count += 1;
        }
        assert_eq!(count, rows);
        std::fs::remove_file(&path).unwrap();
    }
}
