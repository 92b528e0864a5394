//! Finished rows, in chunks: each a file that appears whole, so that an interrupted sweep resumes.
//!
//! Beside the file of the rows stands a folder `….parts` with a manifest, which says of which sweep these parts are,
//! and a file for each chunk: its columns one after another as doubles, little end first. The folder goes when the rows
//! are written.

use super::Work;
use super::options::{self, PARTS, beside};
use crate::folder::Target;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;
use taut::files::{remove_abandoned, write_atomically};
use taut::trajectory::{Column, Trajectory};
use taut::{Error, Result};

/// About how long a chunk should take, s: what an end at any moment can lose on each thread.
const CHUNK_TIME: f64 = 0.5;

/// Runs of a chunk at most.
const LARGEST: u64 = 8192;

/// Whose the parts are.
#[derive(Serialize, Deserialize, PartialEq)]
struct Manifest {
    /// The version of this program.
    version: String,
    /// A fingerprint of the case as it is run, and of all files that it reads.
    fingerprint: String,
    /// All runs.
    runs: u64,
    /// Runs of a chunk.
    chunk: u64,
}

/// The chunks of a sweep.
pub struct Store {
    folder: Option<PathBuf>,
    /// Where there is no folder; and which chunks are done.
    kept: Mutex<BTreeMap<u64, Option<Trajectory>>>,
    headings: Vec<Column>,
    runs: u64,
    chunk: u64,
}

impl Store {
    /// Takes up what is there of this very sweep, or begins.
    pub fn open(work: &Work, target: &Target, threads: usize) -> Result<Self> {
        let sweep = work.sweep;
        let (headings, runs) = (sweep.columns().to_vec(), sweep.runs());
        let folder = options::rows(target).map(|rows| beside(&rows, PARTS));
        let mut store = Self { folder, kept: Mutex::default(), headings, runs, chunk: 1 };
        let Some(folder) = store.folder.clone() else {
            store.chunk = chunk(work, threads);
            return Ok(store);
        };
        let path = folder.join("manifest.json");
        let mut manifest = Manifest {
            version: env!("CARGO_PKG_VERSION").to_string(),
            fingerprint: fingerprint(work)?,
            runs,
            chunk: 0,
        };
        if let Ok(text) = fs::read_to_string(&path) {
            let known: Option<Manifest> = serde_json::from_str(&text).ok();
            let known =
                known.ok_or_else(|| Error::new("this manifest cannot be read").in_file(&path).next(remove(&folder)))?;
            manifest.chunk = known.chunk;
            if known != manifest || known.chunk == 0 {
                return Err(Error::new("this folder has an unfinished sweep of another case, plan or version")
                    .in_file(&folder)
                    .next(format!("finish that one by its own command, name another --out, or {}", remove(&folder))));
            }
            store.chunk = known.chunk;
            store.look(&folder)?;
            return Ok(store);
        }
        fs::create_dir_all(&folder)
            .map_err(|e| Error::new(format!("this folder cannot be made: {e}")).in_file(&folder))?;
        manifest.chunk = chunk(work, threads);
        store.chunk = manifest.chunk;
        write_atomically(&path, serde_json::to_string_pretty(&manifest).unwrap_or_default())?;
        Ok(store)
    }

    /// Notes the parts that are there, and takes away what a killed run left half written.
    fn look(&self, folder: &Path) -> Result<()> {
        let told = |e: std::io::Error| Error::new(format!("this folder cannot be read: {e}")).in_file(folder);
        let mut kept = self.kept.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        for entry in fs::read_dir(folder).map_err(told)? {
            let entry = entry.map_err(told)?;
            let name = entry.file_name().to_string_lossy().into_owned();
            if name.ends_with(".taut.tmp") {
                remove_abandoned(&entry.path());
            }
            let Some(chunk) = name.strip_suffix(".part").and_then(|number| number.parse::<u64>().ok()) else {
                continue;
            };
            let bytes = 8 * self.headings.len() * self.range(chunk).1;
            if chunk < self.chunks() && entry.metadata().is_ok_and(|data| data.len() == bytes as u64) {
                kept.insert(chunk, None);
            }
        }
        Ok(())
    }

    /// Number of chunks.
    pub fn chunks(&self) -> u64 {
        self.runs.div_ceil(self.chunk)
    }

    /// First run of a chunk, and how many there are in it.
    pub fn range(&self, chunk: u64) -> (u64, usize) {
        let first = chunk.saturating_mul(self.chunk).min(self.runs);
        (first, (self.runs - first).min(self.chunk) as usize)
    }

    /// Chunks that are still to be run.
    pub fn pending(&self) -> Vec<u64> {
        let kept = self.kept.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        (0..self.chunks()).filter(|chunk| !kept.contains_key(chunk)).collect()
    }

    /// Runs that are done.
    pub fn done(&self) -> u64 {
        let kept = self.kept.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        kept.keys().map(|chunk| self.range(*chunk).1 as u64).sum()
    }

    /// The folder of the parts.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// Keeps a chunk.
    pub fn put(&self, chunk: u64, table: Trajectory) -> Result<()> {
        let table = match &self.folder {
            None => Some(table),
            Some(folder) => {
                let values = table.columns.iter().flat_map(|column| &column.values);
                let bytes: Vec<u8> = values.flat_map(|value| value.to_le_bytes()).collect();
                write_atomically(part(folder, chunk), bytes)?;
                None
            }
        };
        self.kept.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).insert(chunk, table);
        Ok(())
    }

    /// The rows of a chunk that is done.
    pub fn table(&self, chunk: u64) -> Result<Trajectory> {
        let mut table = Trajectory { columns: self.headings.clone() };
        for (place, column) in table.columns.iter_mut().enumerate() {
            column.values = self.values(chunk, place)?;
        }
        Ok(table)
    }

    /// The values of column `place` in a chunk.
    fn values(&self, chunk: u64, place: usize) -> Result<Vec<f64>> {
        let rows = self.range(chunk).1;
        let Some(folder) = &self.folder else {
            let kept = self.kept.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            let table = kept.get(&chunk).and_then(Option::as_ref);
            return Ok(table
                .and_then(|table| table.columns.get(place))
                .map_or(Vec::new(), |column| column.values.clone()));
        };
        let path = part(folder, chunk);
        let mut bytes = vec![0; 8 * rows];
        let read = File::open(&path).and_then(|mut file| {
            file.seek(SeekFrom::Start((8 * rows * place) as u64))?;
            file.read_exact(&mut bytes)
        });
        read.map_err(|e| {
            Error::new(format!("this part cannot be read: {e}")).in_file(&path).next("run the same command again")
        })?;
        Ok(bytes.chunks_exact(8).map(|eight| f64::from_le_bytes(eight.try_into().unwrap_or_default())).collect())
    }

    /// Column `place`: of blocks of so many runs the first of every `every`.
    pub fn column(&self, place: usize, block: u64, every: u64) -> Result<Vec<f64>> {
        let mut column = Vec::new();
        for chunk in 0..self.chunks() {
            let first = self.range(chunk).0;
            let values = self.values(chunk, place)?;
            column.extend(
                (first..).zip(values).filter(|(run, _)| (run / block).is_multiple_of(every)).map(|(_, value)| value),
            );
        }
        Ok(column)
    }

    /// Takes the parts away: all is written.
    pub fn remove(&self) -> Result<()> {
        match &self.folder {
            None => Ok(()),
            Some(folder) => fs::remove_dir_all(folder)
                .map_err(|e| Error::new(format!("the finished parts cannot be removed: {e}")).in_file(folder)),
        }
    }
}

fn part(folder: &Path, chunk: u64) -> PathBuf {
    folder.join(format!("{chunk:010}.part"))
}

fn remove(folder: &Path) -> String {
    format!("remove {}", folder.display())
}

/// Runs of a chunk: as many as take about half a second, and enough chunks for all threads.
fn chunk(work: &Work, threads: usize) -> u64 {
    let begin = Instant::now();
    let _ = work.sweep.rows(0, 1, &|| false);
    let each = begin.elapsed().as_secs_f64().max(1e-6);
    let fair = (work.sweep.runs() / (8 * threads as u64)).max(1);
    ((CHUNK_TIME / each) as u64).clamp(1, LARGEST).min(fair).next_power_of_two()
}

/// A hash of everything that rows follow from: the text of the case with what the command line changed, and the files
/// it names.
fn fingerprint(work: &Work) -> Result<String> {
    let mut bytes = work.case.text.as_bytes().to_vec();
    for path in work.case.files.iter().map(|file| &file.path) {
        bytes.extend(taut::files::read(path, usize::MAX).map_err(|e| Error::new(e.to_string()).in_file(path))?);
    }
    work.sweep.columns().iter().for_each(|column| bytes.extend(column.heading().into_bytes()));
    Ok(format!("{:016x}", taut::chance::hash(bytes)))
}
