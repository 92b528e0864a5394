//! Runs of experiments and moves.

use crate::columns::{self, Columns};
use crate::controller::Own;
use crate::error::{IntoPython, guarded, unlocked};
use crate::interrupt::Interrupt;
use crate::value;
use pyo3::exceptions::PyRecursionError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use serde_json::Value;
use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use taut::case::{Case, Experiment};
use taut::control::{Accuracy, Controller, Loop, MoveRun, Rows, Standard, Worst, each, stream, worst};
use taut::files::Inputs;
use taut::json::{self, Moved, Simulated, Simulation};
use taut::metrics::{Meter, Metrics};
use taut::reach::feasible::Shortfall;
use taut::reduction::Reduction;
use taut::solve::{self, Flow, Outcome, Solver};
use taut::trajectory::{CsvWriter, ParquetWriter, Trajectory};
use taut::tune::trouble::{Trouble, trouble};

/// An experiment or a move that was run, everything in memory.
#[pyclass(frozen, module = "taut._native")]
pub struct Run {
    columns: Columns,
    what: What,
    /// Seconds that Rust took.
    #[pyo3(get)]
    took: f64,
}

/// The kind of run.
enum What {
    Experiment {
        case: Arc<Case>,
        index: usize,
        solver: Solver,
        outcome: Outcome,
        metrics: Box<Metrics>,
        reduction: Option<Reduction>,
    },
    Move {
        case: Arc<Case>,
        index: usize,
        run: Box<MoveRun>,
        worst: Option<Worst>,
        structure: String,
        timing: Loop,
    },
}

#[pymethods]
impl Run {
    /// Name to array.
    #[getter]
    fn arrays(&self, py: Python<'_>) -> Py<PyDict> {
        self.columns.arrays.clone_ref(py)
    }

    /// Name, unit and heading of each column.
    #[getter]
    fn names(&self, py: Python<'_>) -> Py<PyList> {
        self.columns.names.clone_ref(py)
    }

    #[getter]
    fn addresses(&self) -> Vec<usize> {
        self.columns.addresses.clone()
    }

    /// The experiment's or the move's.
    #[getter]
    fn name(&self) -> &str {
        match &self.what {
            What::Experiment { case, index, .. } => &case.experiments[*index].name,
            What::Move { case, index, .. } => &case.moves[*index].name,
        }
    }

    /// How it ended, in a word, and when, s.
    #[getter]
    fn ending(&self) -> (&'static str, f64) {
        let end = match &self.what {
            What::Experiment { metrics, .. } => metrics.end,
            What::Move { run, .. } => run.metrics.end,
        };
        json::ending(self.outcome().ending, end)
    }

    /// By how much positions may be off, m, where it is known.
    #[getter]
    fn position_error(&self) -> Option<f64> {
        self.outcome().error.map(|error| error.value)
    }

    /// When what a body does was decided within rounding, s, and which body.
    #[getter]
    fn decided_within_rounding(&self) -> Vec<(f64, &'static str)> {
        self.outcome().ties.iter().map(|tie| (tie.time, tie.part.key())).collect()
    }

    /// The key figures.
    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let told = guarded(|| match &self.what {
            What::Experiment { case, metrics, .. } => json::figures(metrics, &case.machine),
            What::Move { case, index, run, worst, .. } => {
                let moved = Moved {
                    machine: &case.machine,
                    motion: &case.moves[*index],
                    run,
                    worst: worst.as_ref(),
                    trouble: None,
                    shortfalls: &[],
                    files: &[],
                };
                in_closed_loop(json::figures(&run.metrics, &case.machine), json::motion(&moved))
            }
        });
        value::json(py, &told?)
    }

    /// Every event.
    fn events<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let list = &self.outcome().events;
        let mechanism = self.case().machine.mechanism();
        let events = || -> Vec<json::Event> { list.iter().map(|event| json::Event::on(&mechanism, event)).collect() };
        value::json(py, &guarded(|| serde_json::to_value(events()).unwrap_or_default())?)
    }

    /// Files that the case names, which nothing is written over.
    #[getter]
    fn inputs(&self) -> Vec<&Path> {
        self.case().files.iter().map(|file| file.path.as_path()).collect()
    }
}

/// Writes columns as `taut simulate` does, to .csv or .parquet, but not over one of these files.
#[pyfunction]
pub fn write(
    py: Python<'_>,
    arrays: &Bound<'_, PyDict>,
    names: &Bound<'_, PyList>,
    inputs: Vec<PathBuf>,
    path: PathBuf,
) -> PyResult<()> {
    let trajectory = columns::read(arrays, names)?;
    unlocked(py, || Inputs::new(inputs).check(&path).and_then(|()| written(&trajectory, &path)))?.told(py)
}

/// Key figures of a move: those of any run, and those of the loop. What both have is the loop's.
fn in_closed_loop(mut figures: Value, told: Value) -> Value {
    if let (Value::Object(figures), Value::Object(told)) = (&mut figures, told) {
        let about = ["name", "files", "ending", "events", "trouble", "shortfalls"];
        figures.extend(told.into_iter().filter(|(key, _)| !about.contains(&key.as_str())));
    }
    figures
}

impl Run {
    fn case(&self) -> &Case {
        match &self.what {
            What::Experiment { case, .. } | What::Move { case, .. } => case,
        }
    }

    fn outcome(&self) -> &Outcome {
        match &self.what {
            What::Experiment { outcome, .. } => outcome,
            What::Move { run, .. } => &run.outcome,
        }
    }
}

fn written(trajectory: &Trajectory, path: &Path) -> taut::Result<()> {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("csv") => {
            let mut writer = CsvWriter::create(path)?;
            writer.write(trajectory)?;
            writer.finish()
        }
        Some("parquet") => {
            let mut writer = ParquetWriter::create(path)?;
            writer.write(trajectory)?;
            writer.finish()
        }
        _ => Err(taut::Error::new("the ending of this name says no format").in_file(path).allowed(".csv or .parquet")),
    }
}

/// Runs experiments of a case that lies there.
pub fn simulate(py: Python<'_>, case: &Arc<Case>, path: &Path, names: &[String], solver: Solver) -> PyResult<Vec<Run>> {
    let experiments = case.experiments_named(path, names).told(py)?;
    experiments.into_iter().map(|experiment| one(py, case, experiment, solver)).collect()
}

/// About as many columns as a run has.
const COLUMNS: usize = 24;

const FEWER: &str = "take a longer interval `every`, or write rows to a file as they come: `taut simulate --out DIR`";

fn one(py: Python<'_>, case: &Arc<Case>, experiment: &Experiment, solver: Solver) -> PyResult<Run> {
    let machine = &case.machine;
    columns::fit(py, experiment.samples() as f64, COLUMNS, FEWER)?;
    let interrupt = Interrupt::listen();
    let found = unlocked(py, || {
        let begin = Instant::now();
        let mut meter = Meter::new(machine, experiment);
        let mut trajectory = Trajectory::default();
        let rows = experiment.samples().min(1 << 20) as usize + 1;
        let outcome = solve::stream_observed(machine, experiment, solver, &mut meter, &mut |block| {
            if trajectory.columns.is_empty() {
                trajectory = Trajectory::with_capacity(&block.columns, rows);
            }
            trajectory.append(block);
            if interrupt.stop() { Flow::Stop } else { Flow::Continue }
        });
        let found = outcome.and_then(|outcome| {
            let metrics = meter.finish(&outcome.events);
            let reduction = Reduction::new(machine, experiment, solver)?;
            Ok((trajectory, outcome, metrics, reduction))
        });
        (found, begin.elapsed().as_secs_f64())
    });
    interrupt.finish()?;
    let (found, took) = found?;
    let (trajectory, outcome, metrics, reduction) = found.told(py)?;
    let index = case.experiments.iter().position(|other| std::ptr::eq(other, experiment)).unwrap_or_default();
    let metrics = Box::new(metrics);
    let what = What::Experiment { case: Arc::clone(case), index, solver, outcome, metrics, reduction };
    Ok(Run { columns: Columns::new(py, trajectory)?, what, took })
}

/// The timing of a loop with a controller in Python, where it is not the case's.
pub type Timing = (Option<f64>, Option<f64>, Option<f64>);

/// True if it is a list of controllers, one for each drive.
fn is_several(object: &Bound<'_, PyAny>) -> bool {
    object.is_instance_of::<PyList>() || object.is_instance_of::<PyTuple>()
}

/// Runs moves of a case that lies there in closed loop, with its own controller or one in Python.
pub fn motion(
    py: Python<'_>,
    case: &Arc<Case>,
    path: &Path,
    names: &[String],
    controller: Option<&Bound<'_, PyAny>>,
    (every, delay, limit): Timing,
    share: Option<f64>,
) -> PyResult<Vec<Run>> {
    let (design, moves) = case.moves_named(path, names).told(py)?;
    let (machine, solver) = (&case.machine, Solver::for_machine(&case.machine));
    let usual = Loop::new(design);
    let timing = Loop {
        every: every.unwrap_or(usual.every),
        delay: delay.unwrap_or(usual.delay),
        limit: limit.or(usual.limit),
        ..usual
    };
    let structure = match controller {
        None => design.structure.name().to_string(),
        Some(object) => {
            let first = if is_several(object) { object.get_item(0)? } else { object.clone() };
            let name = first.getattr("__name__").or_else(|_| first.get_type().getattr("__name__"))?;
            name.str()?.to_string_lossy().into_owned()
        }
    };
    let _inside = match controller {
        Some(_) => Some(Inside::enter()?),
        None => None,
    };
    let mut runs = Vec::new();
    for motion in moves {
        let profiles = motion.references(design);
        let rows = Rows { until: motion.until, every: motion.every, window: motion.window };
        columns::fit(py, rows.until / rows.every, COLUMNS, FEWER)?;
        let interrupt = Interrupt::listen();
        let mut trajectory = Trajectory::default();
        let mut take = |block: &Trajectory| {
            trajectory.append(block);
            if interrupt.stop() { Flow::Stop } else { Flow::Continue }
        };
        let begin = Instant::now();
        let run = match controller {
            Some(object) => {
                let objects = if is_several(object) { object.extract()? } else { vec![object.clone()] };
                let mut own = objects.iter().map(|one| Own::new(one, &interrupt)).collect::<PyResult<Vec<_>>>()?;
                let controllers = &mut own.iter_mut().map(|one| one as &mut dyn Controller).collect::<Vec<_>>();
                guarded(|| stream(machine, controllers, &timing, &profiles, &rows, solver, false, &mut take))
            }
            None => unlocked(py, || {
                let mut own = Standard::of_drives(design, machine)?;
                let controllers = &mut each(&mut own);
                let mut accuracy = Accuracy::new(machine, &timing, &profiles, &rows, solver);
                let mut take = |block: &Trajectory| {
                    accuracy.take(block);
                    take(block)
                };
                let mut run = stream(machine, controllers, &timing, &profiles, &rows, solver, false, &mut take)?;
                let mut go_on = || if interrupt.stop() { Flow::Stop } else { Flow::Continue };
                run.outcome.error = accuracy.finish(&run, controllers, &mut go_on)?;
                Ok(run)
            }),
        };
        interrupt.finish()?;
        let run = run?.told(py)?;
        let worst = match share {
            Some(share) => {
                let interrupt = Interrupt::listen();
                let found = unlocked(py, || worst(machine, design, motion, share, solver, &|| interrupt.stop()));
                interrupt.finish()?;
                found?.told(py)?
            }
            None => None,
        };
        let took = begin.elapsed().as_secs_f64();
        let index = case.moves.iter().position(|other| std::ptr::eq(other, motion)).unwrap_or_default();
        let (case, structure) = (Arc::clone(case), structure.clone());
        let what = What::Move { case, index, run: Box::new(run), worst, structure, timing };
        runs.push(Run { columns: Columns::new(py, trajectory)?, what, took });
    }
    Ok(runs)
}

/// How many moves with a controller in Python run within each other on this thread.
struct Inside;

thread_local! {
    static DEPTH: Cell<usize> = const { Cell::new(0) };
}

impl Inside {
    /// A controller that runs moves with itself would go on until the stack is full, which ends the interpreter.
    fn enter() -> PyResult<Self> {
        const DEEPEST: usize = 16;
        match DEPTH.get() {
            depth if depth >= DEEPEST => Err(PyRecursionError::new_err(format!(
                "moves are nested {DEEPEST} deep: a controller runs a move whose controller runs a move, and so on"
            ))),
            depth => {
                DEPTH.set(depth + 1);
                Ok(Self)
            }
        }
    }
}

impl Drop for Inside {
    fn drop(&mut self) {
        DEPTH.set(DEPTH.get() - 1);
    }
}

/// The JSON that `taut simulate --json` prints of these runs.
#[pyfunction]
pub fn simulation<'py>(py: Python<'py>, runs: Vec<PyRef<'py, Run>>) -> PyResult<Bound<'py, PyAny>> {
    let beside: Vec<_> = runs
        .iter()
        .map(|run| match &run.what {
            What::Experiment { case, index, .. } => taut::fit::beside_log(&case.machine, &case.experiments[*index]),
            What::Move { .. } => None,
        })
        .collect();
    let axis: Vec<Simulated> = runs
        .iter()
        .zip(&beside)
        .filter_map(|(run, log)| match &run.what {
            What::Experiment { case, index, outcome, metrics, reduction, .. } => Some(Simulated {
                experiment: &case.experiments[*index],
                outcome,
                metrics,
                reduction: *reduction,
                band: None,
                log: log.as_ref(),
                files: &[],
            }),
            What::Move { .. } => None,
        })
        .collect();
    let told = runs.iter().find_map(|run| match &run.what {
        What::Experiment { case, solver, .. } => {
            Some(guarded(|| serde_json::to_value(Simulation::new(case, *solver, &axis)).unwrap_or_default()))
        }
        What::Move { .. } => None,
    });
    match told {
        Some(told) => value::json(py, &told?),
        None => Ok(py.None().into_bound(py)),
    }
}

/// The JSON that `taut move --json` prints of these runs.
#[pyfunction]
pub fn moves<'py>(py: Python<'py>, runs: Vec<PyRef<'py, Run>>) -> PyResult<Bound<'py, PyAny>> {
    let judged: Vec<(Option<Trouble>, Vec<Shortfall>)> = runs
        .iter()
        .map(|run| match &run.what {
            What::Move { case, index, run: moved, .. } => {
                let (design, motion) = (case.controller.as_ref(), &case.moves[*index]);
                let trouble = design.and_then(|design| trouble(&case.machine, design, moved, motion));
                (trouble, design.map_or(Vec::new(), |design| motion.shortfalls(&case.machine, design)))
            }
            What::Experiment { .. } => (None, Vec::new()),
        })
        .collect();
    let told: Vec<Moved> = runs
        .iter()
        .zip(&judged)
        .filter_map(|(run, (trouble, shortfalls))| match &run.what {
            What::Move { case, index, run: moved, worst, .. } => Some(Moved {
                machine: &case.machine,
                motion: &case.moves[*index],
                run: moved,
                worst: worst.as_ref(),
                trouble: trouble.as_ref(),
                shortfalls,
                files: &[],
            }),
            What::Experiment { .. } => None,
        })
        .collect();
    let first = runs.iter().find_map(|run| match &run.what {
        What::Move { case, structure, timing, .. } => Some((case, structure, timing)),
        What::Experiment { .. } => None,
    });
    let Some((case, structure, timing)) = first else { return Ok(py.None().into_bound(py)) };
    value::json(py, &guarded(|| json::moves(&case.title, structure, timing, &case.machine, &told))?)
}
