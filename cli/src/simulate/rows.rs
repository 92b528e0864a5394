//! Where rows go: files in the formats that are asked for, and a bar that tells how many there are.

use crate::args::Format;
use crate::folder::Folder;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};
use taut::Result;
#[cfg(feature = "parquet")]
use taut::trajectory::ParquetWriter;
use taut::trajectory::{CsvWriter, Trajectory};

/// How long a run may take before its progress is shown.
const PATIENCE: Duration = Duration::from_secs(1);

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

/// A bar on standard error, for runs that take longer than one likes to wait.
pub struct Progress {
    bar: Option<ProgressBar>,
    name: String,
    rows: u64,
    all: u64,
    wanted: bool,
}

impl Progress {
    /// Of a run of this name with so many rows.
    pub fn new(name: &str, all: u64, quiet: bool) -> Self {
        let wanted = !quiet && std::io::stderr().is_terminal();
        Self { bar: None, name: name.to_string(), rows: 0, all, wanted }
    }

    /// So many more rows are there of what began then.
    pub fn advance(&mut self, rows: u64, begin: Instant) {
        self.rows += rows;
        if self.bar.is_none() && self.wanted && begin.elapsed() > PATIENCE {
            let bar = ProgressBar::new(self.all);
            if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent} %, {eta} left") {
                bar.set_style(style);
            }
            bar.set_message(self.name.clone());
            self.bar = Some(bar);
        }
        if let Some(bar) = &self.bar {
            bar.set_position(self.rows);
        }
    }

    /// Takes it away.
    pub fn clear(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
