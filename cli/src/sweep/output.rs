//! The files of a sweep.

use super::options::{Target, beside};
use super::store::Store;
use super::summary::Summary;
use super::{Work, figures, page, trajectories};
use crate::simulate::folder::Folder;
use std::fs;
use std::path::Path;
use taut::files::write_atomically;
#[cfg(feature = "parquet")]
use taut::trajectory::ParquetWriter;
use taut::trajectory::{CsvWriter, Trajectory};
use taut::{Error, Result};

/// Writes what was asked for; returns the names, or none where it was interrupted.
pub fn write(
    work: &Work,
    target: &Target,
    store: &Store,
    summary: &Summary,
    json: &str,
) -> Result<Option<Vec<String>>> {
    let (Some(rows), Some(parts)) = (target.rows(), store.folder()) else { return Ok(Some(Vec::new())) };
    let mut names = vec![rows.display().to_string()];
    if !assemble(work, store, parts, &rows)? {
        return Ok(None);
    }
    if work.args.trajectories {
        let stem = rows.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let ending = rows.extension().unwrap_or_default().to_string_lossy().into_owned();
        let path = rows.with_file_name(format!("{stem}-trajectories.{ending}"));
        if !trajectories::write(work, parts, &path)? {
            return Ok(None);
        }
        names.push(path.display().to_string());
    }
    if let Target::Folder(folder) = target {
        let folder = Folder::create(folder)?;
        let text = folder.bring_inputs(work.case)?;
        write_atomically(folder.path("sweep.json"), json)?;
        write_atomically(folder.path("case.toml"), &text)?;
        let mut written = vec!["sweep.json", "case.toml"];
        if !work.args.no_report {
            let figures = figures::all(work, summary);
            page::page(work, summary, &text, &figures).write(folder.path("report.html"))?;
            folder.make("plots")?;
            for (name, figure) in &figures {
                let path = folder.path("plots").join(name);
                figure.write_svg(beside(&path, ".svg"))?;
                figure.write_png(beside(&path, ".png"))?;
            }
            written.extend(["report.html", "plots/"]);
        }
        let shown = folder.shown();
        names.extend(written.into_iter().map(|name| format!("{shown}/{name}")));
    }
    Ok(Some(names))
}

/// Writes all chunks one behind another; false where it was interrupted.
fn assemble(work: &Work, store: &Store, parts: &Path, rows: &Path) -> Result<bool> {
    // Within the folder of the parts, so that what a killed run leaves of it goes with them.
    let mut rows_out = Writer::create(parts, rows)?;
    for chunk in 0..store.chunks() {
        if work.interrupt.signal().is_some() {
            return Ok(false);
        }
        rows_out.write(&store.table(chunk)?)?;
    }
    rows_out.finish()?;
    Ok(true)
}

/// A file of rows that is written in one folder and moved to another when it is whole.
pub struct Writer {
    kind: Kind,
    draft: std::path::PathBuf,
    path: std::path::PathBuf,
}

enum Kind {
    Csv(CsvWriter),
    #[cfg(feature = "parquet")]
    Parquet(ParquetWriter),
}

impl Writer {
    /// Begins the file `path`, in the form that its ending says, in the folder `parts`.
    pub fn create(parts: &Path, path: &Path) -> Result<Self> {
        let name = path.file_name().unwrap_or_default();
        let draft = parts.join(name);
        let kind = match path.extension() {
            #[cfg(feature = "parquet")]
            Some(ending) if ending.eq_ignore_ascii_case("parquet") => Kind::Parquet(ParquetWriter::create(&draft)?),
            _ => Kind::Csv(CsvWriter::create(&draft)?),
        };
        Ok(Self { kind, draft, path: path.to_path_buf() })
    }

    /// Adds rows.
    pub fn write(&mut self, table: &Trajectory) -> Result<()> {
        match &mut self.kind {
            Kind::Csv(writer) => writer.write(table),
            #[cfg(feature = "parquet")]
            Kind::Parquet(writer) => writer.write(table),
        }
    }

    /// Gives it its place.
    pub fn finish(self) -> Result<()> {
        match self.kind {
            Kind::Csv(writer) => writer.finish()?,
            #[cfg(feature = "parquet")]
            Kind::Parquet(writer) => writer.finish()?,
        }
        fs::rename(&self.draft, &self.path)
            .map_err(|e| Error::new(format!("this file cannot be put in its place: {e}")).in_file(&self.path))
    }
}
