//! The options that all commands share, and reading a case by them.

use crate::interrupt;
use std::io::Read;
use std::path::{Path, PathBuf};
use taut::case::{Accepted, Case, Files, LARGEST_FILE};
use taut::{Error, Result};

/// The options of every command that has a result.
#[derive(Debug, Clone, clap::Args)]
pub struct Common {
    /// The folder to write results into; it is made if it is not there
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Override one value of the case; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub changes: Vec<String>,
    /// Leave out the report and the plots
    #[arg(long)]
    pub no_report: bool,
    /// Also write each plot as a PNG
    #[arg(long, requires = "out", conflicts_with = "no_report")]
    pub png: bool,
    /// Print the result as JSON, the same as in the file that --out writes; an error too
    #[arg(long)]
    pub json: bool,
    /// Print nothing but errors
    #[arg(long, short, conflicts_with = "json")]
    pub quiet: bool,
}

impl Common {
    /// Reads the case of any machine at `path` with all its files; `-` is standard input.
    pub fn open(&self, path: &Path) -> Result<Case> {
        self.whole(path, Accepted::All)
    }

    /// Opens the case of a machine whose motors are commanded by voltage or current, with all its files.
    pub fn open_motors(&self, path: &Path) -> Result<Case> {
        self.whole(path, Accepted::Motors)
    }

    fn whole(&self, path: &Path, accepted: Accepted) -> Result<Case> {
        let case = self.accepting(path, (Files::All, accepted))?;
        case.complete()?;
        Ok(case)
    }

    /// Opens the case of one of these machines, with these files.
    pub fn accepting(&self, path: &Path, (files, accepted): (Files, Accepted)) -> Result<Case> {
        match is_standard_input(path) {
            true => Case::from_text_accepting(path, &standard_input()?, &self.changes(), (files, accepted)),
            false => Case::read_accepting(path, &self.changes(), (files, accepted)),
        }
    }

    /// Opens a case with the files of these experiments; a missing file is an error only for its own experiment.
    pub fn open_for(&self, path: &Path, files: Files) -> Result<Case> {
        self.accepting(path, (files, Accepted::All))
    }

    fn changes(&self) -> Vec<&str> {
        self.changes.iter().map(String::as_str).collect()
    }

    /// True if a report is made: where there is a folder for it, and time to draw it.
    pub fn reports(&self) -> bool {
        self.out.is_some() && self.draws()
    }

    /// True if a report is wanted. After a signal the result itself comes first, and there may be no time for more.
    pub fn draws(&self) -> bool {
        !self.no_report && interrupt::came().is_none()
    }
}

/// True if this is the word for standard input.
pub fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == "-"
}

fn standard_input() -> Result<String> {
    let mut bytes = Vec::new();
    // A little more than a case may have: what is too long is told by its reader, as of a file.
    let read = std::io::stdin().lock().take(LARGEST_FILE as u64 + 1).read_to_end(&mut bytes);
    read.map_err(|e| Error::new(format!("standard input cannot be read: {e}")).in_file("-"))?;
    String::from_utf8(bytes).map_err(|_| Error::new("standard input is not UTF-8 text").in_file("-"))
}
