//! Shared by all commands: their options, how a case is read, and how a command ends.
//!
//! A command is arguments → work → [`Finished`]; [`Finished::finish`] writes, prints and gives the exit status.

use crate::failure::{Failure, Outcome, Status};
use crate::folder::Folder;
use crate::{interrupt, terminal};
use rayon::prelude::*;
use std::io::Read;
use std::path::{Path, PathBuf};
use taut::case::{Accepted, Case, Files, LARGEST_FILE};
use taut::files::write_atomically;
use taut::{Error, Result};
use taut_report::{Page, Picture};

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

    /// Opens the case of a machine whose motors are commanded by voltage or current, with the files of its experiments.
    pub fn open_motors_for(&self, path: &Path, files: Files) -> Result<Case> {
        self.accepting(path, (files, Accepted::Motors))
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

/// A result, to be written and printed.
pub struct Finished {
    /// The command.
    pub command: &'static str,
    /// The result as data, and the name of its file in a folder of results.
    pub json: (&'static str, String),
    /// The result for people.
    pub text: String,
    /// Other texts of the folder with their names: a case, a table.
    pub files: Vec<(String, String)>,
    /// The report, where one is made.
    pub report: Option<Report>,
    /// Files outside of the folder that are written already.
    pub written: Vec<String>,
    /// How to keep the result: "add --out DIR for …"; empty where nothing can be kept.
    pub advice: &'static str,
    /// Further lines for standard error.
    pub remarks: Vec<Remark>,
    /// How it ended.
    pub status: Status,
}

/// The page of a result, and its pictures with their names in file names.
pub struct Report {
    pub page: Page,
    pub pictures: Vec<(String, Picture)>,
}

/// A line on standard error; its first word says how grave it is.
pub enum Remark {
    Error(String),
    Warning(String),
    Note(String),
}

impl Remark {
    fn show(&self) {
        match self {
            Self::Error(told) => terminal::show_error(told),
            Self::Warning(told) => terminal::show_warning(told),
            Self::Note(told) => terminal::show_note(told),
        }
    }
}

impl Finished {
    /// A result as data and for people, all done, and nothing else to write or to say.
    pub fn new(command: &'static str, json: (&'static str, String), text: String, advice: &'static str) -> Self {
        Self {
            command,
            json,
            text,
            files: Vec::new(),
            report: None,
            written: Vec::new(),
            advice,
            remarks: Vec::new(),
            status: Status::Done,
        }
    }

    /// Writes what belongs into the folder, gives all of it its place, prints, and says how it ended.
    pub fn finish(mut self, common: &Common, folder: Option<Folder>) -> Outcome {
        if let Some(folder) = folder {
            self.write(common, &folder).map_err(Failure::work)?;
            let names = folder.place(self.command, common.quiet)?;
            self.written.push(listed(&folder, &names));
        }
        if !self.written.is_empty() {
            interrupt::written();
        }
        if common.json {
            terminal::show(&self.json.1);
        } else if !common.quiet {
            let end = match &self.written[..] {
                [] if self.advice.is_empty() => String::new(),
                [] => format!("nothing was written: {}\n", self.advice),
                written => format!("wrote {}\n", written.join("\nwrote ")),
            };
            terminal::show(&terminal::wrapped(&format!("{}{end}", self.text)));
        }
        self.remarks.iter().for_each(Remark::show);
        if matches!(self.status, Status::Interrupted(_))
            && common.out.is_some()
            && !common.no_report
            && self.report.is_none()
        {
            terminal::show_note(&"the report was left out because the command was interrupted");
        }
        Ok(self.status)
    }

    fn write(&self, common: &Common, folder: &Folder) -> Result<()> {
        write_atomically(folder.path(self.json.0), &self.json.1)?;
        for (name, text) in &self.files {
            write_atomically(folder.path(name), text)?;
        }
        let Some(Report { page, pictures }) = &self.report else { return Ok(()) };
        if !pictures.is_empty() {
            folder.make("plots")?;
        }
        let picture = |(name, picture): &(String, Picture)| {
            write_atomically(folder.path(format!("plots/{name}.svg")), picture.svg())?;
            match common.png {
                true => write_atomically(folder.path(format!("plots/{name}.png")), picture.png()?),
                false => Ok(()),
            }
        };
        let page = || page.write(folder.path("report.html"));
        let (pictures, page) = rayon::join(|| pictures.par_iter().try_for_each(picture), page);
        pictures.and(page)
    }
}

/// The folder and what is in it now; of pictures and inputs, their folders.
fn listed(folder: &Folder, names: &[PathBuf]) -> String {
    let mut shown: Vec<String> = Vec::new();
    for name in names {
        let mut parts = name.components();
        let first = parts.next().map(|part| part.as_os_str().to_string_lossy().into_owned()).unwrap_or_default();
        let first = if parts.next().is_some() { format!("{first}/") } else { first };
        if !shown.contains(&first) {
            shown.push(first);
        }
    }
    format!("in {}:\n  {}", folder.shown(), shown.join("  "))
}
