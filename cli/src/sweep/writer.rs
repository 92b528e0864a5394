//! A file of rows under way.

use std::path::Path;
use taut::Result;
#[cfg(feature = "parquet")]
use taut::trajectory::ParquetWriter;
use taut::trajectory::{CsvWriter, Trajectory};

/// A file of rows.
pub enum Writer {
    Csv(CsvWriter),
    #[cfg(feature = "parquet")]
    Parquet(Box<ParquetWriter>),
}

impl Writer {
    /// Begins the file `path`, in the form that its ending says.
    pub fn create(path: &Path) -> Result<Self> {
        match path.extension() {
            #[cfg(feature = "parquet")]
            Some(ending) if ending.eq_ignore_ascii_case("parquet") => {
                ParquetWriter::create(path).map(|writer| Self::Parquet(Box::new(writer)))
            }
            _ => CsvWriter::create(path).map(Self::Csv),
        }
    }

    /// Adds rows.
    pub fn write(&mut self, table: &Trajectory) -> Result<()> {
        match self {
            Self::Csv(writer) => writer.write(table),
            #[cfg(feature = "parquet")]
            Self::Parquet(writer) => writer.write(table),
        }
    }

    /// Gives it its name.
    pub fn finish(self) -> Result<()> {
        match self {
            Self::Csv(writer) => writer.finish(),
            #[cfg(feature = "parquet")]
            Self::Parquet(writer) => writer.finish(),
        }
    }
}
