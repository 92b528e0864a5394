//! Where exported files go: beside a file that was named, or into a folder.

use super::Exported;
use crate::error::Result;
use crate::files::{Batch, Claim, Inputs, Refusal, write_atomically};
use std::path::{Path, PathBuf};

/// Where the files of a target go, and what they are called.
#[derive(Debug, Clone, PartialEq)]
pub struct Destination {
    /// The folder.
    pub folder: PathBuf,
    /// True if a file was named and no folder.
    pub is_file: bool,
    /// The name that all files share.
    pub stem: String,
}

impl Destination {
    /// Place of a path: a file if it ends in `ending`, else a folder with files named `own`.
    pub fn new(path: &Path, ending: &str, own: &str) -> Self {
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        match path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending)) {
            true => {
                let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
                Self { folder: folder.unwrap_or(Path::new(".")).into(), is_file: true, stem }
            }
            false => Self { folder: path.into(), is_file: false, stem: own.into() },
        }
    }

    /// Claims the main file, or the folder, which is made if it is not there: of two programs that would write the same
    /// files, the second is refused.
    pub fn claim(&self, ending: &str) -> std::result::Result<Claim, Refusal> {
        let main = format!("{}.{ending}", self.stem);
        match self.is_file {
            true => Claim::file(self.folder.join(main)),
            false => Claim::folder(&self.folder, &[main]),
        }
    }

    /// Writes the files, all of them or none, over none of `inputs`, and returns where they are.
    pub fn write(&self, exported: &Exported, inputs: &Inputs, claim: &mut Claim) -> Result<Vec<PathBuf>> {
        let paths: Vec<PathBuf> = exported.files.iter().map(|(name, _)| self.folder.join(name)).collect();
        paths.iter().try_for_each(|path| inputs.check(path))?;
        if self.is_file {
            paths.iter().try_for_each(|path| claim.add(path))?;
        }
        let batch = Batch::begin(&self.folder)?;
        for (name, content) in &exported.files {
            write_atomically(batch.path(name), content)?;
        }
        batch.place(&[])?;
        Ok(paths)
    }
}
