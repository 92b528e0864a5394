//! The disk space and the time that a sweep will take, told before it begins.

use super::options::{self, PARTS, beside};
use super::{Work, shown};
use crate::failure::Failure;
use crate::folder::Target;
use crate::terminal;
use std::path::Path;
use std::time::{Duration, Instant};
use taut::Error;

/// Most runs of a sweep.
const MOST_RUNS: u64 = 10_000_000_000;

/// A sweep that takes more room or more time than this is told before it begins: bytes, s.
const NOTABLE: (f64, f64) = (1e9, 600.0);

/// Bytes that a number takes: in a part; as a row of Parquet at most; as text of CSV, as good as at most.
const PART: f64 = 8.0;
const PARQUET: f64 = 8.2;
const CSV: f64 = 19.0;

/// Says how large the files of a sweep will be and how long it will take, where that is much; refuses what cannot be.
pub fn told(work: &Work, target: &Target, threads: usize) -> Result<(), Failure> {
    let Some(rows) = options::rows(target) else { return Ok(()) };
    let parquet = rows.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("parquet"));
    let room = DiskSpace::new(work.sweep.runs(), work.sweep.columns().len(), if parquet { PARQUET } else { CSV });
    let folder = rows.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    room.check(folder, free(folder).map(|free| free + size(&beside(&rows, PARTS))))?;
    let begin = Instant::now();
    let _ = work.sweep.rows(0, 1, &|| false);
    let seconds = begin.elapsed().as_secs_f64() * room.runs as f64 / threads as f64;
    if !work.args.common.quiet && (room.all > NOTABLE.0 || seconds > NOTABLE.1) {
        let time = Duration::try_from_secs_f64(seconds).map_or_else(|_| "ages".to_string(), shown);
        let threads = if threads == 1 { "one thread".to_string() } else { format!("{threads} threads") };
        terminal::show_note(&format!("{}; it takes roughly {time} on {threads}", room.words()));
    }
    Ok(())
}

/// Disk space of a sweep.
struct DiskSpace {
    runs: u64,
    /// The file of the rows, bytes.
    file: f64,
    /// Size with the parts, which are kept until the file is complete, bytes.
    all: f64,
}

impl DiskSpace {
    /// Of so many runs, with rows of so many numbers of `each` bytes.
    fn new(runs: u64, columns: usize, each: f64) -> Self {
        let numbers = runs as f64 * columns as f64;
        Self { runs, file: numbers * each, all: numbers * (each + PART) }
    }

    fn words(&self) -> String {
        let Self { runs, file, all } = self;
        format!("{runs} runs make a file of about {}, and up to {} while it is written", bytes(*file), bytes(*all))
    }

    /// Refuses more runs than there may be, and more than there is room for.
    fn check(&self, folder: &Path, free: Option<f64>) -> Result<(), Failure> {
        if self.runs > MOST_RUNS {
            return Err(Error::new(self.words())
                .in_file("--runs")
                .allowed(format!("up to {MOST_RUNS} runs"))
                .next("sweep fewer runs: a million determine a share to 0.1 %")
                .into());
        }
        match free.filter(|&free| self.all > free) {
            None => Ok(()),
            Some(free) => Err(Failure::work(
                Error::new(format!("{}; {} are free", self.words(), bytes(free)))
                    .in_file(folder)
                    .next("sweep fewer runs, or name an --out on a larger disk"),
            )),
        }
    }
}

/// Size of the files of a folder, bytes.
fn size(folder: &Path) -> f64 {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    files.filter_map(|file| file.metadata().ok()).map(|data| data.len() as f64).sum()
}

/// Free space on the disk of a folder, bytes; none where the system does not say.
#[cfg(unix)]
fn free(folder: &Path) -> Option<f64> {
    let told = rustix::fs::statvfs(folder).ok()?;
    Some(told.f_bavail as f64 * told.f_frsize as f64)
}

#[cfg(not(unix))]
fn free(_: &Path) -> Option<f64> {
    None
}

/// A number of bytes for people.
fn bytes(count: f64) -> String {
    let [kilo, mega, giga, tera] = [1e3, 1e6, 1e9, 1e12];
    let (value, unit) = match count {
        n if n < mega => (n / kilo, "kB"),
        n if n < giga => (n / mega, "MB"),
        n if n < tera => (n / giga, "GB"),
        n => (n / tera, "TB"),
    };
    format!("{} {unit}", taut::number::significant(value, 3))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `--runs 1e12` began to write, and would have filled the disk after hours.
    #[test]
    fn what_does_not_fit_is_refused_before_it_begins() {
        let room = DiskSpace::new(1_000_000_000, 30, PARQUET);
        let failure = room.check(Path::new("out"), Some(100e9)).unwrap_err();
        assert_eq!(failure.status, 1);
        assert_eq!(
            failure.error.to_string(),
            "out: 1000000000 runs make a file of about 246 GB, and up to 486 GB while it is written; 100 GB are \
             free\n  \
             next: sweep fewer runs, or name an --out on a larger disk"
        );
        assert!(room.check(Path::new("out"), Some(500e9)).is_ok() && room.check(Path::new("out"), None).is_ok());
        assert_eq!(DiskSpace::new(MOST_RUNS + 1, 1, CSV).check(Path::new("out"), None).unwrap_err().status, 2);
    }
}
