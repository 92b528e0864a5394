//! The files of a sweep.

use super::options::{Target, trajectories};
use super::store::Store;
use super::summary::Summary;
use super::{Work, figures, page, trajectories};
use crate::failure::Failure;
use crate::folder::Folder;
use crate::simulate::plots;
use std::path::{Path, PathBuf};
use taut::Result;
use taut::files::write_atomically;
#[cfg(feature = "parquet")]
use taut::trajectory::ParquetWriter;
use taut::trajectory::{CsvWriter, Trajectory};

/// Writes what was asked for; returns the names, or none where it was interrupted.
pub fn write(
    work: &Work,
    target: &Target,
    store: &Store,
    summary: &Summary,
    json: &str,
) -> std::result::Result<Option<Vec<String>>, Failure> {
    let Some(rows) = target.rows() else { return Ok(Some(Vec::new())) };
    let mut files = vec![rows.clone()];
    files.extend(work.args.trajectories.then(|| trajectories(&rows)));
    // In a folder all files get their places together.
    let begun = |file: &PathBuf| match target {
        Target::Folder(folder) => folder.path(file.file_name().unwrap_or_default()),
        Target::File(_) | Target::Nowhere => file.clone(),
    };
    let Some(tables) = tables(work, store, &files.iter().map(begun).collect::<Vec<_>>()).map_err(Failure::work)? else {
        return Ok(None);
    };
    tables.into_iter().try_for_each(Writer::finish).map_err(Failure::work)?;
    let mut names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    if let Target::Folder(folder) = target {
        let written = others(work, folder, summary, json).map_err(Failure::work)?;
        folder.place()?;
        let shown = folder.shown();
        names.extend(written.into_iter().map(|name| format!("{shown}/{name}")));
    }
    Ok(Some(names))
}

/// What a folder holds beside the rows; returns the names.
fn others(work: &Work, folder: &Folder, summary: &Summary, json: &str) -> Result<Vec<&'static str>> {
    let names = folder.bring(work.case.files())?;
    let text = work.case.text_with(|file| names.get(&file.path).cloned().unwrap_or_default());
    write_atomically(folder.path("sweep.json"), json)?;
    write_atomically(folder.path("case.toml"), &text)?;
    let mut written = vec!["sweep.json", "case.toml"];
    if !work.args.no_report {
        let figures = figures::all(work, summary);
        page::page(work, summary, &text, &figures).write(folder.path("report.html"))?;
        folder.make("plots")?;
        for (name, figure) in &figures {
            plots::write_both(&folder.path("plots").join(name), figure)?;
        }
        written.extend(["report.html", "plots/"]);
    }
    Ok(written)
}

/// The rows, and the trajectories where they are wanted, whole but without their names; none where it was interrupted.
fn tables(work: &Work, store: &Store, files: &[PathBuf]) -> Result<Option<Vec<Writer>>> {
    let mut writers = files.iter().map(|file| Writer::create(file)).collect::<Result<Vec<_>>>()?;
    let [rows, rest @ ..] = &mut writers[..] else { return Ok(Some(writers)) };
    for chunk in 0..store.chunks() {
        if work.interrupt.signal().is_some() {
            return Ok(None);
        }
        rows.write(&store.table(chunk)?)?;
    }
    for writer in rest {
        if !trajectories::write(work, writer)? {
            return Ok(None);
        }
    }
    Ok(Some(writers))
}

/// A file of rows.
pub enum Writer {
    Csv(CsvWriter),
    #[cfg(feature = "parquet")]
    Parquet(Box<ParquetWriter>),
}

impl Writer {
    /// Begins the file `path`, in the form that its ending says.
    fn create(path: &Path) -> Result<Self> {
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
    fn finish(self) -> Result<()> {
        match self {
            Self::Csv(writer) => writer.finish(),
            #[cfg(feature = "parquet")]
            Self::Parquet(writer) => writer.finish(),
        }
    }
}
