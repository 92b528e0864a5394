//! The files of a sweep.

use super::options::{self, trajectories};
use super::store::Store;
use super::writer::Writer;
use super::{Work, trajectories};
use crate::failure::Failure;
use crate::folder::Target;
use std::path::PathBuf;
use taut::Result;

/// Writes the rows and what is written beside them; returns the names of those that have their places, or none where it
/// was interrupted.
pub fn write(work: &Work, target: &Target, store: &Store) -> std::result::Result<Option<Vec<String>>, Failure> {
    let Some(rows) = options::rows(target) else { return Ok(Some(Vec::new())) };
    let mut files = vec![rows.clone()];
    files.extend(work.args.trajectories.then(|| trajectories(&rows)));
    // In a folder all files get their places together.
    let begun = |file: &PathBuf| match target {
        Target::Folder(folder) => folder.path(file.file_name().unwrap_or_default()),
        Target::File(..) | Target::Nowhere => file.clone(),
    };
    let Some(tables) = tables(work, store, &files.iter().map(begun).collect::<Vec<_>>()).map_err(Failure::work)? else {
        return Ok(None);
    };
    tables.into_iter().try_for_each(Writer::finish).map_err(Failure::work)?;
    Ok(Some(match target {
        Target::Folder(_) => Vec::new(),
        Target::File(..) | Target::Nowhere => files.iter().map(|file| file.display().to_string()).collect(),
    }))
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
