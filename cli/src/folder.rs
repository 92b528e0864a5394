//! The folder of results. Its files are written in a hidden folder within it and get their places together, at the end;
//! none takes the place of a file that the command reads.

use crate::common::Common;
use crate::failure::Failure;
use crate::listing::{self, Left, Listing};
use crate::terminal;
use std::collections::HashMap;
use std::ffi::OsStr;
use std::fmt::Write;
use std::path::{Component, Path, PathBuf};
use taut::case::{self, Case, Files, InputFile};
use taut::control::Added;
use taut::files::{Batch, Claim, Inputs, MARKER, write_atomically};
use taut::log::read_samples;
use taut::machine::Machine;
use taut::solve::Event;
use taut::{Error, Result, files};

/// Where the results of a command go that may write one file instead of a folder.
pub enum Target {
    Nowhere,
    /// One file: a tuned case, the rows of a sweep.
    File(PathBuf, Claim),
    /// All files, report and plots.
    Folder(Folder),
}

impl Target {
    /// The place that `--out` names for a case that was made of another: a file that is not there yet where it ends in
    /// `.toml`, else a folder for files of these names, a report and what the case refers to.
    pub fn of_case(
        path: &Path,
        case: &Case,
        common: &Common,
        names: [&str; 2],
        besides: &str,
    ) -> std::result::Result<Self, Failure> {
        let Some(out) = &common.out else { return Ok(Self::Nowhere) };
        let inputs = inputs(path, &case.files);
        if !out.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
            let report = (!common.no_report).then(|| "report.html".to_string());
            let names = names.map(str::to_string).into_iter().chain(report);
            return Folder::create(out, inputs, names.chain(brought(&case.files).into_values())).map(Self::Folder);
        }
        Inputs::new([path]).check(out).map_err(|error| error.next(format!("name another --out{besides}")))?;
        inputs.check(out)?;
        let claim = claim(out)?;
        if out.exists() {
            return Err(Error::new(format!("{} is there already", out.display()))
                .in_file("--out")
                .next(format!("name another file, or a folder{besides}"))
                .into());
        }
        leading(&case.text, &case.files, parent(out))?;
        Ok(Self::File(out.clone(), claim))
    }
}

/// The folder that a file is in.
fn parent(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The text of the case at `from` for another place: paths in it lead from there to the same files.
pub fn moved(text: &str, from: &Path, to: &Path) -> Result<String> {
    leading(text, &files_of(from, text)?, parent(to))
}

/// A folder of results.
pub struct Folder {
    root: PathBuf,
    inputs: Inputs,
    // Dropped before the claim, which removes the folder if nothing was written into it.
    batch: Batch,
    _claim: Claim,
}

/// Claims a file that results go to, before the work for them.
pub fn claim(path: &Path) -> std::result::Result<Claim, Failure> {
    Ok(noted(Claim::file(path)?))
}

/// The claim, with a note if it keeps nobody out.
pub fn noted(claim: Claim) -> Claim {
    if let Some(note) = claim.unlocked() {
        terminal::show_note(&note);
    }
    claim
}

/// The files that a command reads: the case and those that it names.
pub fn inputs(path: &Path, files: &[InputFile]) -> Inputs {
    inputs_with(path, None, files)
}

/// The files that a command reads: the case, others of the command line, and those that the case names.
pub fn inputs_with<'a>(path: &'a Path, others: impl IntoIterator<Item = &'a Path>, files: &'a [InputFile]) -> Inputs {
    let files = files.iter().map(|file| file.path.as_path());
    Inputs::new(std::iter::once(path).chain(others).chain(files))
}

/// The columns of a file of signals that are added to commands, one for each drive: `added_V`, or `left_added_V`.
pub fn added_columns(machine: &Machine) -> impl Iterator<Item = String> {
    let drives = machine.geometry().drives.iter().zip(&machine.drives);
    drives.map(|(at, drive)| format!("{}added_{}", at.prefix, drive.amplifier.mode.unit()))
}

/// The signal of each drive from a file that `taut learn` wrote, in V or A.
pub fn read_added(file: &Path, machine: &Machine) -> Result<Vec<Added>> {
    let of_drive = |column: String| {
        let (times, values) = read_samples(file, "time_s", &column)?;
        Ok(Added { times, values })
    };
    added_columns(machine).map(of_drive).collect()
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

    /// Claims the folder, which is made if it is not there. `names` are files that will be written: one that is among
    /// the inputs is told before the work; all others, before the first file gets its place.
    pub fn create<N: AsRef<Path>>(
        root: &Path,
        inputs: Inputs,
        names: impl IntoIterator<Item = N>,
    ) -> std::result::Result<Self, Failure> {
        let names: Vec<String> = names.into_iter().map(|name| name.as_ref().to_string_lossy().into_owned()).collect();
        names.iter().try_for_each(|name| inputs.check(&root.join(name)))?;
        let claim = noted(Claim::folder(root, &names)?);
        let marker = root.join(MARKER);
        if marker.is_file() {
            terminal::show_note(&format!(
                "{}: an earlier run was interrupted while it replaced these results: some may be from the run before \
                 it",
                marker.display()
            ));
        }
        let batch = Batch::begin(root).map_err(Failure::work)?;
        Ok(Self { root: root.to_path_buf(), inputs, batch, _claim: claim })
    }

    /// Where a file of it is written, until it gets its place.
    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.batch.path(name)
    }

    /// Gives all files their places, with a list of them, and removes what `command` listed in an earlier run and did
    /// not write in this one; what somebody changed since stays, and is named. Returns the names of what was written.
    pub fn place(&self, command: &str, quiet: bool) -> std::result::Result<Vec<PathBuf>, Failure> {
        let mut names = self.batch.names().map_err(Failure::work)?;
        let mut list = Listing::new(command, &self.batch.path(""), &names).map_err(Failure::work)?;
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
                "{}: files of an earlier run that were changed since are kept: {}",
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

    /// Copies the files that a case names into `inputs/`; returns its text with their names there. Of those that are
    /// missing, and that nobody needed, the paths lead to where they should be.
    pub fn bring(&self, text: &str, files: &[InputFile]) -> Result<String> {
        let mut names = brought(files);
        for (file, name) in &names {
            let bytes = files::read(file, usize::MAX).map_err(|e| Error::new(e.to_string()).in_file(file))?;
            self.make("inputs")?;
            write_atomically(self.path(name), bytes)?;
        }
        for file in files.iter().filter(|file| !file.path.is_file()) {
            names.insert(file.path.clone(), between(&self.root, &file.path)?);
        }
        Ok(case::text_with(text, files, |file| names.get(&file.path).cloned().unwrap_or_default()))
    }

    /// Makes a folder in it.
    pub fn make(&self, name: &str) -> Result<()> {
        let path = self.path(name);
        std::fs::create_dir_all(&path).map_err(|e| Error::new(told(&e)).in_file(self.root.join(name)))
    }
}

/// The files that the text of a case names, read or not.
pub fn files_of(name: &Path, text: &str) -> Result<Vec<InputFile>> {
    Ok(Case::from_text_for(name, text, &[], Files::Nothing)?.files)
}

/// Existing files of a case with their names in a folder of results: unchanged, or with a number if the name is taken.
pub fn brought(files: &[InputFile]) -> HashMap<PathBuf, String> {
    let mut names: HashMap<PathBuf, String> = HashMap::new();
    for file in files {
        if names.contains_key(&file.path) || !file.path.is_file() {
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
    let (from, to) = (whole(folder), whole(file));
    let (from, to): (Vec<Component>, Vec<Component>) = (from.components().collect(), to.components().collect());
    let same = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let word = |part: &OsStr| {
        let error = || Error::new("the path of this file is not UTF-8, so a case file cannot name it").in_file(file);
        part.to_str().map(str::to_string).ok_or_else(|| error().next("rename the file or its folder"))
    };
    if same == 0 {
        return word(file.as_os_str());
    }
    let up = std::iter::repeat_n(Ok("..".to_string()), from.len() - same);
    let down = to[same..].iter().map(|part| word(part.as_os_str()));
    Ok(up.chain(down).collect::<Result<Vec<_>>>()?.join("/"))
}

/// A path from the root on, without links as far as it is there.
fn whole(path: &Path) -> PathBuf {
    if let Ok(path) = std::fs::canonicalize(path) {
        return path;
    }
    match (path.parent(), path.file_name()) {
        (Some(folder), Some(name)) if folder.as_os_str().is_empty() => whole(Path::new(".")).join(name),
        (Some(folder), Some(name)) => whole(folder).join(name),
        _ => path.to_path_buf(),
    }
}

fn told(error: &std::io::Error) -> String {
    format!("this folder cannot be made: {error}")
}
