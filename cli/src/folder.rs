//! The folder of results. Its files are written in a hidden folder within it and get their places together, at the end;
//! none takes the place of a file that the command reads.

use crate::command::Common;
use crate::failure::Failure;
use crate::listing::{self, Left, Listing};
use crate::terminal;
use std::collections::HashMap;
use std::ffi::OsStr;
use std::fmt::Write;
use std::path::{Component, Path, PathBuf};
use taut::case::{self, InputFile};
use taut::files::{Batch, Inputs, MARKER, write_atomically};
use taut::solve::Event;
use taut::{Error, Result};

/// Where the results of a command go that may write one file instead of a folder.
pub enum Target {
    Nowhere,
    /// One file: a tuned case, the rows of a sweep.
    File(PathBuf),
    /// All files, report and plots.
    Folder(Folder),
}

/// A folder of results.
pub struct Folder {
    root: PathBuf,
    inputs: Inputs,
    batch: Batch,
}

/// The files that a command reads: the case and those that it names.
pub fn inputs(path: &Path, files: &[InputFile]) -> Inputs {
    Inputs::new(std::iter::once(path).chain(files.iter().map(|file| file.path.as_path())))
}

impl Folder {
    /// The folder of `--out`, made as [`Folder::create`] makes it; none where none is asked for.
    pub fn wanted<N: AsRef<Path>>(
        common: &Common,
        inputs: impl FnOnce() -> Inputs,
        names: impl IntoIterator<Item = N>,
    ) -> std::result::Result<Option<Self>, Failure> {
        common.out.as_deref().map(|root| Self::create(root, inputs(), names)).transpose()
    }

    /// Makes the folder if it is not there. `names` are files that will be written: one that is among the inputs is
    /// told before the work; all others, before the first file gets its place.
    pub fn create<N: AsRef<Path>>(
        root: &Path,
        inputs: Inputs,
        names: impl IntoIterator<Item = N>,
    ) -> std::result::Result<Self, Failure> {
        names.into_iter().try_for_each(|name| inputs.check(&root.join(name)))?;
        std::fs::create_dir_all(root).map_err(|e| {
            let what = if root.is_file() { "this is a file, not a folder".into() } else { told(&e) };
            Error::new(what).in_file(root).next("name a folder that you may write to")
        })?;
        let marker = root.join(MARKER);
        if marker.is_file() {
            terminal::show_note(&format!(
                "{}: an earlier run was ended while it replaced these results: some may be of the run before it",
                marker.display()
            ));
        }
        let batch = Batch::begin(root).map_err(Failure::work)?;
        Ok(Self { root: root.to_path_buf(), inputs, batch })
    }

    /// Where a file of it is written, until it gets its place.
    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.batch.path(name)
    }

    /// Gives all files their places, with a list of them, and removes what `command` listed in an earlier run and did
    /// not write in this one; what somebody changed since stays, and is named. Returns the names of what was written.
    pub fn place(&self, command: &str, quiet: bool) -> std::result::Result<Vec<PathBuf>, Failure> {
        let mut names = self.batch.names().map_err(Failure::work)?;
        let mut list = Listing::of(command, &self.batch.path(""), &names).map_err(Failure::work)?;
        let mut left = Left::default();
        if let Some(earlier) = Listing::read(&self.root) {
            left = earlier.left(command, &self.root, &names);
            list = list.with_others(command, earlier);
        }
        write_atomically(self.batch.path(listing::NAME), list.text()).map_err(Failure::work)?;
        names.push(listing::NAME.into());
        names.iter().try_for_each(|name| self.inputs.check(&self.root.join(name)))?;
        left.stale.retain(|name| self.inputs.check(&self.root.join(name)).is_ok());
        self.batch.place(&left.stale).map_err(Failure::work)?;
        if !left.changed.is_empty() && !quiet {
            let changed: Vec<String> = left.changed.iter().map(|name| name.display().to_string()).collect();
            terminal::show_note(&format!(
                "{}: of an earlier run, and changed since it was written, so it stays: {}",
                self.root.display(),
                changed.join(", ")
            ));
        }
        Ok(names)
    }

    /// The folder itself.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// How the user named it.
    pub fn shown(&self) -> String {
        self.root.display().to_string()
    }

    /// The events as CSV.
    pub fn write_events(&self, name: &str, events: &[Event]) -> Result<String> {
        let mut text = String::from("time_s,part,from,to,load,by_rounding\n");
        for e in events {
            // Rust's own form of a number reads back to the same bits.
            let Event { time, part, from, to, load, by_rounding } = e;
            let (part, from, to) = (part.key(), from.word(), to.word());
            let _ = writeln!(text, "{time},{part},{from},{to},{load},{}", u8::from(*by_rounding));
        }
        let name = format!("{name}.events.csv");
        write_atomically(self.path(&name), text)?;
        Ok(name)
    }

    /// Copies the files that a case names into `inputs/`; returns its text with their names there.
    pub fn bring(&self, text: &str, files: &[InputFile]) -> Result<String> {
        let names = brought(files);
        for (file, name) in &names {
            let bytes = std::fs::read(file).map_err(|e| Error::new(e.to_string()).in_file(file))?;
            self.make("inputs")?;
            write_atomically(self.path(name), bytes)?;
        }
        Ok(case::text_with(text, files, |file| names.get(&file.path).cloned().unwrap_or_default()))
    }

    /// Makes a folder in it.
    pub fn make(&self, name: &str) -> Result<()> {
        let path = self.path(name);
        std::fs::create_dir_all(&path).map_err(|e| Error::new(told(&e)).in_file(self.root.join(name)))
    }
}

/// The files of a case, and what they are called in a folder of results: as they are, with a number where that is
/// taken.
pub fn brought(files: &[InputFile]) -> HashMap<PathBuf, String> {
    let mut names: HashMap<PathBuf, String> = HashMap::new();
    for file in files {
        if names.contains_key(&file.path) {
            continue;
        }
        let own = file.path.file_name().unwrap_or_default().to_string_lossy();
        let free = |name: &String| names.values().all(|other| !other.eq_ignore_ascii_case(name));
        let name =
            std::iter::once(format!("inputs/{own}")).chain((2..).map(|k| format!("inputs/{k}-{own}"))).find(free);
        names.insert(file.path.clone(), name.unwrap_or_default());
    }
    names
}

/// The text of a case for the folder `from`: paths in it lead from there to the same files.
pub fn leading(text: &str, files: &[InputFile], from: &Path) -> Result<String> {
    let ways = files.iter().map(|file| Ok((&file.path, between(from, &file.path)?)));
    let ways = ways.collect::<Result<HashMap<_, _>>>()?;
    Ok(case::text_with(text, files, |file| ways.get(&file.path).cloned().unwrap_or_default()))
}

/// The way from a folder to a file, with `/` between the parts.
fn between(folder: &Path, file: &Path) -> Result<String> {
    let whole = |path: &Path| -> PathBuf { std::fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf()) };
    let (from, to) = (whole(folder), whole(file));
    let (from, to): (Vec<Component>, Vec<Component>) = (from.components().collect(), to.components().collect());
    let same = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let word = |part: &OsStr| {
        let error = || Error::new("a case file is UTF-8 and cannot name this file, whose path is not").in_file(file);
        part.to_str().map(str::to_string).ok_or_else(|| error().next("rename it, or what it lies in"))
    };
    if same == 0 {
        return word(file.as_os_str());
    }
    let up = std::iter::repeat_n(Ok("..".to_string()), from.len() - same);
    let down = to[same..].iter().map(|part| word(part.as_os_str()));
    Ok(up.chain(down).collect::<Result<Vec<_>>>()?.join("/"))
}

fn told(error: &std::io::Error) -> String {
    format!("this folder cannot be made: {error}")
}
