//! How a command ends.
//!
//! A command is arguments → work → [`Finished`]; [`Finished::finish`] writes, prints and gives the exit status.

use crate::common::Common;
use crate::failure::{Failure, Outcome, Status};
use crate::folder::Folder;
use crate::{interrupt, terminal};
use rayon::prelude::*;
use std::path::PathBuf;
use taut::Result;
use taut::files::write_atomically;
use taut_report::{Page, Picture};

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
