//! Every quantity over time of every run, in one file.

use super::Work;
use super::writer::Writer;
use taut::solve::Flow;
use taut::sweep::Sweep;
use taut::trajectory::{Column, Trajectory};
use taut::{Error, Result};

/// Most runs whose trajectories are kept.
const MOST: u64 = 10_000;

/// Refuses what would fill the disk.
pub fn check(sweep: &Sweep) -> Result<()> {
    if sweep.runs() > MOST {
        return Err(Error::new(format!(
            "the trajectories of {} runs would fill the disk: each takes about 150 kB for 1000 rows",
            sweep.runs()
        ))
        .in_file("--trajectories")
        .allowed(format!("up to {MOST} runs"))
        .next("sweep without --trajectories first, then repeat the interesting runs"));
    }
    match sweep.groups().iter().all(|group| group.is_move) {
        true => Err(Error::new("moves in closed loop have no trajectories here")
            .in_file("--trajectories")
            .next("run `taut move` with the machine in question")),
        false => Ok(()),
    }
}

/// Writes them with the number of the run and of the experiment in front; false where it was interrupted.
pub fn write(work: &Work, writer: &mut Writer) -> Result<bool> {
    let mut wide = Trajectory::default();
    for run in 0..work.sweep.runs() {
        let experiments = work.sweep.groups().iter().filter(|group| !group.is_move).count();
        for number in 0..experiments {
            let mut failed = None;
            let outcome = work.sweep.stream(run, number, &mut |block| {
                widen(&mut wide, run as f64, number as f64, block);
                match writer.write(&wide) {
                    Ok(()) if work.interrupt.signal().is_none() => Flow::Continue,
                    Ok(()) => Flow::Stop,
                    Err(error) => {
                        failed = Some(error);
                        Flow::Stop
                    }
                }
            });
            match failed {
                Some(error) => return Err(error),
                // A machine that cannot be run has a row of its own that says so, and no trajectory.
                None if outcome.is_err() => {}
                None if work.interrupt.signal().is_some() => return Ok(false),
                None => {}
            }
        }
    }
    Ok(true)
}

/// The block with two numbers in front, in the columns of the first block.
fn widen(wide: &mut Trajectory, run: f64, experiment: f64, block: &Trajectory) {
    if wide.columns.is_empty() {
        let bare = block.columns.iter().map(|column| Column::new(column.name.clone(), column.unit.clone()));
        wide.columns = [Column::new("run", ""), Column::new("experiment", "")].into_iter().chain(bare).collect();
    }
    for column in &mut wide.columns {
        column.values.clear();
        match (column.name.as_str(), block.get(&column.name)) {
            ("run", _) => column.values.resize(block.len(), run),
            ("experiment", _) => column.values.resize(block.len(), experiment),
            (_, Some(values)) => column.values.extend_from_slice(values),
            (_, None) => column.values.resize(block.len(), f64::NAN),
        }
    }
}
