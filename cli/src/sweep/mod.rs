//! `taut sweep`: many runs with parameters varied, which go on where they were left.

mod forecast;
mod options;
mod output;
mod store;
mod summary;
mod table;
mod trajectories;
mod writer;

use crate::args::Sweep as Args;
use crate::command::{Finished, Report};
use crate::failure::{Failure, Outcome};
use crate::folder::Target;
use crate::interrupt::{Interrupt, interrupted};
use crate::progress::Progress;
use crate::terminal;
use rayon::prelude::*;
use std::time::{Duration, Instant};
use store::Store;
use summary::summary;
use taut::case::Case;
use taut::json;
use taut::sweep::Sweep;
use taut::{Error, Result};
use taut_report::sweep::{figures, page};

/// Most runs that are kept in memory, where nothing is written.
const MOST_KEPT: u64 = 100_000;

/// A sweep that is asked for.
pub struct Work<'a> {
    pub args: &'a Args,
    pub case: &'a Case,
    pub sweep: &'a Sweep,
    pub interrupt: &'a Interrupt,
}

/// Reads the case, runs what is not there yet, sums up, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let common = options::with_changes(args)?;
    let case = common.open(&args.case)?;
    let sweep = Sweep::new(&case).map_err(|error| error.in_file(&args.case))?;
    let target = options::target(args, &case)?;
    if args.trajectories {
        trajectories::check(&sweep)?;
    }
    if matches!(target, Target::Nowhere) && sweep.runs() > MOST_KEPT {
        return Err(Failure::from(
            Error::new(format!("{} runs are too many to keep in memory", sweep.runs()))
                .allowed(format!("up to {MOST_KEPT} without --out"))
                .next("write them: --out runs.parquet"),
        ));
    }
    let interrupt = Interrupt::listen();
    let work = Work { args, case: &case, sweep: &sweep, interrupt: &interrupt };
    let threads = threads(args, &sweep);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Failure::work(Error::new(format!("the threads cannot be started: {e}"))))?;
    forecast::told(&work, &target, threads)?;
    let store = Store::open(&work, &target, threads)?;
    let begin = Instant::now();
    let before = store.done();
    pool.install(|| rows(&work, &store)).map_err(Failure::work)?;
    let took = begin.elapsed();
    if let Some(signal) = interrupt.signal() {
        return Err(left_at(&work, &store, signal));
    }
    let summary = pool.install(|| summary(&work, &store)).map_err(Failure::work)?;
    let json = ("sweep.json", json::text(&json::sweep(&case, &sweep, &summary)));
    let text = table::text(&work, &summary, took, sweep.runs() - before);
    let mut finished = Finished::new("sweep", json, text, "add --out FILE.parquet or --out DIR");
    let Some(written) = output::write(&work, &target, &store)? else {
        return Err(left_at(&work, &store, interrupt.signal().unwrap_or(2)));
    };
    finished.written = written;
    let folder = match target {
        Target::Nowhere | Target::File(..) => None,
        Target::Folder(folder) => {
            let text = folder.bring(case.text.as_str(), &case.files).map_err(Failure::work)?;
            if common.draws() {
                let figures = figures(&sweep, &summary);
                let page = page(case.title.as_str(), &sweep, &summary, &text, &figures);
                let pictures = figures.into_iter().map(|(name, figure)| (name, figure.into())).collect();
                finished.report = Some(Report { page, pictures });
            }
            finished.files.push(("case.toml".into(), text));
            Some(folder)
        }
    };
    let status = pool.install(|| finished.finish(&common, folder))?;
    store.remove().map_err(Failure::work)?;
    Ok(status)
}

/// How many threads: no more than there are processors, or runs.
fn threads(args: &Args, sweep: &Sweep) -> usize {
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let useful = processors.min(usize::try_from(sweep.runs()).unwrap_or(usize::MAX)).max(1);
    if let Some(asked) = args.threads.filter(|&asked| asked > useful && !args.common.quiet) {
        let runs = if useful < processors { format!("{useful} runs") } else { format!("{processors} processors") };
        terminal::show_note(&format!("--threads {asked}: {useful} are started, because there are {runs}"));
    }
    args.threads.unwrap_or(processors).min(useful)
}

/// Runs the chunks that are not there yet, each written when it is whole.
fn rows(work: &Work, store: &Store) -> Result<()> {
    let pending = store.pending();
    let progress = Progress::new("runs", Some(work.sweep.runs()), work.args.common.quiet).with_done(store.done());
    let stop = || work.interrupt.signal().is_some();
    pending.into_par_iter().try_for_each(|chunk| {
        let (first, count) = store.range(chunk);
        // None where it was interrupted.
        let Some(table) = work.sweep.rows(first, count, &stop) else { return Ok::<(), Error>(()) };
        store.put(chunk, table)?;
        progress.add(count as u64);
        Ok(())
    })?;
    progress.clear();
    Ok(())
}

/// The end of a sweep that a signal ended.
fn left_at(work: &Work, store: &Store, signal: u8) -> Failure {
    let done = store.done();
    let what = match store.folder() {
        Some(folder) => format!(
            "interrupted: {done} of {} runs are done and kept in {}; the same command continues from there",
            work.sweep.runs(),
            folder.display()
        ),
        None => format!("interrupted after {done} of {} runs; with --out they would be kept", work.sweep.runs()),
    };
    interrupted(signal, &what)
}

/// A time for people.
pub fn shown(time: Duration) -> String {
    match time.as_secs_f64() {
        seconds if seconds < 100.0 => format!("{seconds:.1} s"),
        seconds if seconds < 6000.0 => format!("{:.0} min", seconds / 60.0),
        seconds if seconds < 3e5 => format!("{:.1} h", seconds / 3600.0),
        seconds => format!("{:.0} days", seconds / 86400.0),
    }
}
