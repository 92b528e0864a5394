//! Where exported files go: beside a file that was named, or into a folder.

use super::Exported;
use crate::error::{Error, Result};
use crate::files::{Batch, Inputs, write_atomically};
use std::path::{Path, PathBuf};

/// Where the files of a target go, and what they are called.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// The folder.
    pub folder: PathBuf,
    /// Whether a file was named and no folder.
    pub is_file: bool,
    /// The name that all files share.
    pub stem: String,
}

impl Place {
    /// That of a path: a file where it ends in `ending`, else a folder, with files called `own`.
    pub fn of(path: &Path, ending: &str, own: &str) -> Self {
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        match path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending)) {
            true => {
                let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
                Self { folder: folder.unwrap_or(Path::new(".")).into(), is_file: true, stem }
            }
            false => Self { folder: path.into(), is_file: false, stem: own.into() },
        }
    }

    /// Writes the files, all of them or none, over none of `inputs`, and returns where they are.
    pub fn write(&self, exported: &Exported, inputs: &Inputs) -> Result<Vec<PathBuf>> {
        let paths: Vec<PathBuf> = exported.files.iter().map(|(name, _)| self.folder.join(name)).collect();
        paths.iter().try_for_each(|path| inputs.check(path))?;
        if !self.is_file {
            std::fs::create_dir_all(&self.folder).map_err(|e| {
                let error = Error::new(format!("this folder cannot be made: {e}")).in_file(&self.folder);
                error.next("name a folder that you may write to")
            })?;
        }
        let batch = Batch::begin(&self.folder)?;
        for (name, content) in &exported.files {
            write_atomically(batch.path(name), content)?;
        }
        batch.place(&[])?;
        Ok(paths)
    }
}
