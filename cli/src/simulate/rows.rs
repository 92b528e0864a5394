//! Where rows go: files in the formats that are asked for.

use crate::args::Format;
use crate::folder::Folder;
use taut::Result;
#[cfg(feature = "parquet")]
use taut::trajectory::ParquetWriter;
use taut::trajectory::{CsvWriter, Trajectory};

/// A file in each format for the experiment of this file name; none without a folder.
pub fn writers(folder: Option<&Folder>, name: &str, asked: &[Format]) -> Result<Vec<Writer>> {
    let Some(folder) = folder else { return Ok(Vec::new()) };
    let formats = asked.iter().enumerate().filter(|&(k, format)| !asked[..k].contains(format)).map(|(_, f)| f);
    let create = |format: &Format| match format {
        Format::Csv => CsvWriter::create(folder.path(format!("{name}.csv"))).map(Writer::Csv),
        #[cfg(feature = "parquet")]
        Format::Parquet => {
            let path = folder.path(format!("{name}.parquet"));
            ParquetWriter::create(path).map(|writer| Writer::Parquet(Box::new(writer)))
        }
    };
    formats.map(create).collect()
}

/// A file that rows go to.
pub enum Writer {
    Csv(CsvWriter),
    #[cfg(feature = "parquet")]
    Parquet(Box<ParquetWriter>),
}

impl Writer {
    /// Adds rows.
    pub fn write(&mut self, block: &Trajectory) -> Result<()> {
        match self {
            Writer::Csv(writer) => writer.write(block),
            #[cfg(feature = "parquet")]
            Writer::Parquet(writer) => writer.write(block),
        }
    }

    /// Closes it.
    pub fn finish(self) -> Result<()> {
        match self {
            Writer::Csv(writer) => writer.finish(),
            #[cfg(feature = "parquet")]
            Writer::Parquet(writer) => writer.finish(),
        }
    }

    /// How its name ends.
    pub fn ending(&self) -> &'static str {
        match self {
            Writer::Csv(_) => "csv",
            #[cfg(feature = "parquet")]
            Writer::Parquet(_) => "parquet",
        }
    }
}
