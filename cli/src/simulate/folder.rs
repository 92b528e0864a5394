//! The folder of results. Every file is written under a temporary name and renamed when it is whole.

use super::run::{Run, Setting};
use super::{page, plots};
use std::collections::HashMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use taut::case::Case;
use taut::files::write_atomically;
use taut::solve::Event;
use taut::{Error, Result};

/// Where the results go.
pub struct Folder {
    root: PathBuf,
}

impl Folder {
    /// Makes the folder if it is not there.
    pub fn create(root: &Path) -> Result<Self> {
        std::fs::create_dir_all(root).map_err(|e| {
            let what = if root.is_file() { "this is a file, not a folder".into() } else { told(&e) };
            Error::new(what).in_file(root).next("name a folder that you may write to")
        })?;
        Ok(Self { root: root.to_path_buf() })
    }

    /// A path in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }

    /// How the user named it.
    pub fn shown(&self) -> String {
        self.root.display().to_string()
    }

    /// The events as CSV; returns the file's name.
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

    /// Copies the files that the case's inputs are read from into `inputs/`; returns the text that names them there.
    pub fn bring_inputs(&self, case: &Case) -> Result<String> {
        let mut names: HashMap<PathBuf, String> = HashMap::new();
        for file in &case.files {
            if names.contains_key(&file.path) {
                continue;
            }
            let bytes = std::fs::read(&file.path).map_err(|e| Error::new(e.to_string()).in_file(&file.path))?;
            let own = file.path.file_name().unwrap_or_default().to_string_lossy();
            let free = |name: &String| names.values().all(|other| !other.eq_ignore_ascii_case(name));
            let name =
                std::iter::once(format!("inputs/{own}")).chain((2..).map(|k| format!("inputs/{k}-{own}"))).find(free);
            let name = name.unwrap_or_default();
            self.make("inputs")?;
            write_atomically(self.path(&name), bytes)?;
            names.insert(file.path.clone(), name);
        }
        Ok(case.text_with(|file| names.get(&file.path).cloned().unwrap_or_default()))
    }

    /// Makes a folder in it.
    pub fn make(&self, name: &str) -> Result<()> {
        let path = self.path(name);
        std::fs::create_dir_all(&path).map_err(|e| Error::new(told(&e)).in_file(&path).next("remove what has its name"))
    }

    /// What belongs to all experiments: summary, case, report and plots.
    pub fn write_common(&self, setting: &Setting, summary: &str, runs: &[Run]) -> Result<()> {
        let case = setting.case;
        write_atomically(self.path("summary.json"), summary)?;
        let text = self.bring_inputs(case)?;
        write_atomically(self.path("case.toml"), &text)?;
        if setting.args.no_report {
            return Ok(());
        }
        let figures: Vec<_> = runs.iter().map(|run| plots::figures(case, run)).collect();
        page::page(case, &text, setting.solver, runs, &figures).write(self.path("report.html"))?;
        self.make("plots")?;
        plots::write(&self.path("plots"), runs, &figures)
    }
}

fn told(error: &std::io::Error) -> String {
    format!("this folder cannot be made: {error}")
}
