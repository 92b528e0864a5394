//! One experiment of a gantry: its rows go to files, meter and plots as they come, and none is kept.

use super::super::rows::writers;
use crate::args::Simulate;
use crate::failure::Failure;
use crate::folder::Folder;
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use std::time::Instant;
use taut::Error;
use taut::case::{Case, Experiment};
use taut::mechanism::Mechanism;
use taut::metrics::GantryMeter;
use taut::solve::{self, Course, Detail, ErrorEstimate, Flow, Solver, stream_mechanism};
use taut::trajectory::Trajectory;
use taut_report::simulate::gantry::{Run, curves};

/// Settings that all runs of a command share.
pub struct Setting<'a> {
    pub args: &'a Simulate,
    pub case: &'a Case,
    pub mechanism: &'a Mechanism,
    pub solver: Solver,
    pub folder: Option<&'a Folder>,
    pub interrupt: &'a Interrupt,
}

impl<'a> Setting<'a> {
    /// Runs `experiment`.
    pub fn run(&self, experiment: &'a Experiment) -> Result<Run<'a>, Failure> {
        let begin = Instant::now();
        let course = Course::of(&self.mechanism, experiment);
        let name = experiment.file_name();
        let mut writers = writers(self.folder, &name, &self.args.format).map_err(Failure::work)?;
        let mut meter = GantryMeter::new(&self.case.machine);
        let plotted = self.folder.is_some() && !self.args.common.no_report;
        let mut curves = plotted.then(|| curves(&self.case.machine));
        let progress = Progress::new(&experiment.name, Some(experiment.samples()), self.args.common.quiet);
        let mut trouble: Option<Error> = None;
        let mut estimate = match self.solver {
            Solver::General { tolerance } => Some((ErrorEstimate::of_mechanism(self.mechanism, &course), tolerance)),
            Solver::Exact | Solver::Table3 { .. } => None,
        };

        let mut take = |block: &Trajectory| {
            if let Some((estimate, _)) = &mut estimate {
                estimate.take(block);
            }
            if let Some((curves, way)) = &mut curves {
                curves.take(block);
                way.take(block);
            }
            trouble = writers.iter_mut().find_map(|writer| writer.write(block).err());
            progress.add(block.len() as u64);
            if trouble.is_some() || self.interrupt.signal().is_some() { Flow::Stop } else { Flow::Continue }
        };
        let shown = (Detail::Full, Some(&mut meter as &mut dyn solve::Observe));
        let mut outcome = stream_mechanism(self.mechanism, &course, self.solver, shown, &mut take)?;
        if let Some((estimate, tolerance)) = estimate {
            let mut go_on = || if self.interrupt.signal().is_some() { Flow::Stop } else { Flow::Continue };
            outcome.error = estimate.finish_mechanism(self.mechanism, &course, tolerance, &outcome, &mut go_on)?;
        }
        progress.clear();
        if let Some(trouble) = trouble {
            return Err(Failure::work(trouble));
        }

        let mut files = Vec::new();
        for writer in writers {
            files.push(format!("{name}.{}", writer.ending()));
            writer.finish().map_err(Failure::work)?;
        }
        if let Some(folder) = self.folder {
            files.push(folder.write_events(&name, &outcome.events).map_err(Failure::work)?);
        }
        let metrics = meter.finish(&outcome.events);
        Ok(Run { experiment, outcome, metrics, curves, files, took: begin.elapsed() })
    }
}
