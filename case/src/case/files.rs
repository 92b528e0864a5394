//! The files that the experiments of a case name: which are read, and what is told where one cannot be.

use super::reader::{Field, Table};
use super::told;
use crate::error::{Error, Result};
use crate::mechanism::State;
use std::cell::{Cell, RefCell};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The experiments whose files are read: logs, and inputs that are columns of files.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Files<'a> {
    /// The files of all experiments.
    All,
    /// The files of the experiments with these names.
    Of(&'a [String]),
    /// None: the machine, its controller and its moves are all that is wanted.
    Nothing,
}

/// A file that an input or a log is read from.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct InputFile {
    /// Where it is: the path in the text, from the case's folder on.
    pub path: PathBuf,
    /// Where the text names it, quotes included.
    pub place: Range<usize>,
}

/// An experiment whose files were not read.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Unread {
    /// Its name; runs of a log that is split have names that begin with it and `/`.
    pub name: String,
    /// Its place among the experiments of the text, from 0.
    pub place: usize,
    /// Where it starts from.
    pub initial: State,
    /// End and output interval, as far as the text says so, s.
    pub times: [Option<f64>; 2],
    /// Why it was not read, with the line of the case that names the file.
    pub error: Error,
}

impl Unread {
    /// End and output interval, where the text says both, s.
    pub fn span(&self) -> Option<[f64; 2]> {
        let [until, every] = self.times;
        Some([until?, every?])
    }

    /// True if an experiment of this name is meant: itself, or a run of its log.
    pub fn holds(&self, name: &str) -> bool {
        name == self.name || name.strip_prefix(self.name.as_str()).is_some_and(|rest| rest.starts_with('/'))
    }
}

/// Where the paths of a case begin, and the files that it names.
pub(super) struct Folder<'a> {
    path: &'a Path,
    named: RefCell<Vec<InputFile>>,
    wanted: Files<'a>,
    /// The name of the experiment that is being read.
    experiment: RefCell<String>,
    /// True if a file of it was not read.
    failed: Cell<bool>,
}

impl<'a> Folder<'a> {
    /// Reader of the files that the case file `name` refers to.
    pub fn new(name: &'a Path, wanted: Files<'a>) -> Self {
        let path = name.parent().unwrap_or(Path::new(""));
        Self { path, wanted, named: RefCell::default(), experiment: RefCell::default(), failed: Cell::new(false) }
    }

    /// The path of a file that the text names.
    pub fn join(&self, path: impl AsRef<Path>) -> PathBuf {
        self.path.join(path)
    }

    /// The files that are named, in the text's order.
    pub fn files(self) -> Vec<InputFile> {
        let mut files = self.named.into_inner();
        files.sort_by_key(|file| file.place.start);
        files.dedup();
        files
    }

    /// Takes note of the file that `field` names, and gives its path.
    pub fn name(&self, field: &Field) -> Result<PathBuf> {
        let path = self.join(field.text()?);
        self.named.borrow_mut().push(InputFile { path: path.clone(), place: field.node.span.clone() });
        Ok(path)
    }

    /// Reads the file that `field` names, at `path`, if it is wanted and there.
    pub fn read<T>(&self, field: &Field, path: &Path, read: impl FnOnce() -> Result<T>) -> Result<T> {
        let name = self.experiment.borrow().clone();
        self.failed.set(true);
        if !self.wants(&name) {
            return Err(field.fail(format!("the files of \"{name}\" were not read")));
        }
        if let Some(why) = unreadable(path) {
            let what = format!("a file of the experiment \"{name}\" cannot be read: {}: {why}", path.display());
            return Err(field.fail(what).next("check the path, which begins at the folder of the case file"));
        }
        let found = read().map_err(|error| {
            // A mistake in the file is told with its line there; this is where the file is named.
            let place = field.fail("").place;
            let line = place.as_ref().and_then(|place| Some((place.file.display(), place.span.as_ref()?.line)));
            let at = line.map(|(file, line)| format!(", {file}:{line}")).unwrap_or_default();
            Error { what: format!("{} (experiment \"{name}\"{at})", error.what), ..error }
        })?;
        self.failed.set(false);
        Ok(found)
    }

    /// An experiment of the text, or what is known of it where one of its files was not read.
    pub fn experiment<T>(
        &self,
        (place, name): (usize, &str),
        table: &Table,
        read: impl FnOnce() -> Result<T>,
        initial: impl FnOnce() -> Result<State>,
    ) -> Result<std::result::Result<T, Unread>> {
        self.experiment.replace(name.to_string());
        self.failed.set(false);
        match read() {
            Err(error) if self.failed.get() => {
                let times = [table.number_if_given("until")?, table.number_if_given("every")?];
                Ok(Err(Unread { name: name.to_string(), place, initial: initial()?, times, error }))
            }
            found => found.map(Ok),
        }
    }

    fn wants(&self, name: &str) -> bool {
        let is_of =
            |wanted: &String| wanted == name || wanted.strip_prefix(name).is_some_and(|rest| rest.starts_with('/'));
        match self.wanted {
            Files::All => true,
            Files::Of(names) => names.iter().any(is_of),
            Files::Nothing => false,
        }
    }
}

/// Why a file cannot be read. A pipe would be waited for, and a device may have no end.
fn unreadable(path: &Path) -> Option<String> {
    crate::files::open(path).err().map(|error| told(&error))
}
