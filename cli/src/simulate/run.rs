//! One experiment: its rows go to files, meter and plots as they come, and none is kept.

use super::band;
use super::rows::writers;
use super::setting::RunSettings;
use crate::failure::Failure;
use crate::folder::Folder;
use crate::progress::Progress;
use std::time::Instant;
use taut::Error;
use taut::case::{Case, Experiment};
use taut::fit::beside_log;
use taut::measure;
use taut::metrics::Meter;
use taut::reduction::Reduction;
use taut::solve::{self, ErrorEstimate, Flow, Solver};
use taut::trajectory::{CsvWriter, Trajectory};
use taut_report::simulate::{Curves, Samples, SimulatedExperiment};

impl<'a> RunSettings<'a> {
    /// Runs `experiment`.
    pub fn run(&self, experiment: &'a Experiment) -> std::result::Result<SimulatedExperiment<'a>, Failure> {
        let begin = Instant::now();
        let machine = &self.case.machine;
        let mut writers = writers(self.folder, &experiment.file_name(), &self.args.format).map_err(Failure::work)?;
        let mut meter = Meter::new(machine, experiment);
        let mut curves = (self.folder.is_some() && !self.args.common.no_report).then(|| Curves::new(machine));
        let progress = Progress::new(&experiment.name, Some(experiment.samples()), self.args.common.quiet);
        let mut trouble: Option<Error> = None;
        let mut estimate = match self.solver {
            Solver::General { tolerance } => Some((ErrorEstimate::new(machine, experiment), tolerance)),
            Solver::Exact | Solver::Table3 { .. } => None,
        };

        let mut take = |block: &Trajectory| {
            if let Some((estimate, _)) = &mut estimate {
                estimate.take(block);
            }
            if let Some(curves) = &mut curves {
                curves.take(block);
            }
            trouble = writers.iter_mut().find_map(|writer| writer.write(block).err());
            progress.add(block.len() as u64);
            if trouble.is_some() || self.interrupt.signal().is_some() { Flow::Stop } else { Flow::Continue }
        };
        let mut outcome = solve::stream_observed(machine, experiment, self.solver, &mut meter, &mut take)?;
        if let Some((estimate, tolerance)) = estimate {
            let mut go_on = || if self.interrupt.signal().is_some() { Flow::Stop } else { Flow::Continue };
            outcome.error = estimate.finish(machine, experiment, tolerance, &outcome, &mut go_on)?;
        }
        progress.clear();
        if let Some(trouble) = trouble {
            return Err(Failure::work(trouble));
        }

        let mut files = Vec::new();
        for writer in writers {
            files.push(format!("{}.{}", experiment.file_name(), writer.ending()));
            writer.finish().map_err(Failure::work)?;
        }
        if let Some(folder) = self.folder {
            files.push(folder.write_events(&experiment.file_name(), &outcome.events).map_err(Failure::work)?);
        }
        let mut samples = None;
        if let Some(folder) = self.folder.filter(|_| self.args.as_measured && self.interrupt.signal().is_none()) {
            samples = Some(self.record(experiment, folder)?).filter(|_| curves.is_some());
            files.push(log_name(experiment));
        }
        let mut band = None;
        if !self.machines.is_empty() && self.interrupt.signal().is_none() {
            band = band::band(self, self.machines, experiment)?;
            if let Some(band) = &band {
                files.extend(band::write(band, self, experiment).map_err(Failure::work)?);
            }
        }
        let metrics = meter.finish(&outcome.events);
        let took = begin.elapsed();
        let (mut reduction, mut log) = (None, None);
        if self.interrupt.signal().is_none() {
            reduction = Reduction::new(machine, experiment, self.solver)?;
            log = beside_log(machine, experiment);
        }
        Ok(SimulatedExperiment { experiment, outcome, metrics, curves, samples, band, log, reduction, files, took })
    }

    /// Runs it once more, as its recorder sees it, and writes the log.
    fn record(&self, experiment: &Experiment, folder: &Folder) -> std::result::Result<Samples, Failure> {
        let Case { machine, measurement, .. } = self.case;
        let mut writer = CsvWriter::create(folder.path(log_name(experiment))).map_err(Failure::work)?;
        let mut samples = Samples::new(machine);
        let mut trouble: Option<Error> = None;
        let mut take = |block: &Trajectory| {
            samples.take(block);
            trouble = writer.write(block).err();
            if trouble.is_some() || self.interrupt.signal().is_some() { Flow::Stop } else { Flow::Continue }
        };
        measure::stream(machine, &measurement.clone().unwrap_or_default(), experiment, self.solver, &mut take)?;
        match trouble {
            Some(trouble) => Err(Failure::work(trouble)),
            None => writer.finish().map(|()| samples).map_err(Failure::work),
        }
    }
}

/// The file of an experiment's log.
fn log_name(experiment: &Experiment) -> String {
    format!("{}.measured.csv", experiment.file_name())
}
