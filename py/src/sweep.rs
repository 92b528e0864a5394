//! Many runs: rows by number, on threads of this machine.

use crate::case::Case;
use crate::columns::{self, Columns};
use crate::error::{IntoPython, unlocked};
use crate::interrupt::Interrupt;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use rayon::prelude::*;
use taut::trajectory::Trajectory;

/// Runs that a thread does before it takes the next ones.
const CHUNK: u64 = 64;

/// The sweep of a case.
#[pyclass(frozen, module = "taut._native")]
pub struct Sweep {
    inner: taut::sweep::Sweep,
}

#[pymethods]
impl Sweep {
    #[new]
    fn new(py: Python<'_>, case: &Case) -> PyResult<Self> {
        let planned = || taut::sweep::Sweep::new(&case.inner);
        let inner = unlocked(py, || planned().map_err(|error| error.in_file(&case.path)))?;
        Ok(Self { inner: inner.told(py)? })
    }

    /// How many runs there are.
    #[getter]
    fn runs(&self) -> u64 {
        self.inner.runs()
    }

    /// Name, unit and heading of each column.
    fn names(&self) -> Vec<(&str, &str, String)> {
        self.inner.columns().iter().map(|c| (c.name.as_str(), c.unit.as_str(), c.heading())).collect()
    }

    /// The rows of `count` runs from `first` on: columns by name, and name, unit and heading of each. The same bits for
    /// any number of threads; 0 is one for each processor.
    fn rows(&self, py: Python<'_>, first: u64, count: u64, threads: usize) -> PyResult<(Py<PyDict>, Py<PyList>)> {
        let rows = count.min(self.inner.runs().saturating_sub(first));
        let piecewise = "taut.sweep_tables hands the rows on piece by piece";
        columns::fit(py, rows as f64, self.inner.columns().len(), piecewise)?;
        let interrupt = Interrupt::listen();
        let table = unlocked(py, || self.table(first, count, threads, &interrupt));
        interrupt.finish()?;
        let columns = Columns::new(py, table?.map_err(PyRuntimeError::new_err)?)?;
        Ok((columns.arrays, columns.names))
    }
}

impl Sweep {
    fn table(&self, first: u64, count: u64, threads: usize, interrupt: &Interrupt) -> Result<Trajectory, String> {
        let stop = || interrupt.stop();
        let end = first.saturating_add(count).min(self.inner.runs());
        let rows = |from: u64, to: u64| match stop() {
            true => Trajectory::default(),
            false => self.inner.rows(from, (to - from) as usize, &stop).unwrap_or_default(),
        };
        if threads == 1 {
            return Ok(rows(first.min(end), end));
        }
        let begins: Vec<u64> = (first..end).step_by(CHUNK as usize).collect();
        // More threads than processors or pieces would only wait.
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = if threads == 0 { processors } else { threads.min(processors) }.min(begins.len().max(1));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|e| format!("the threads cannot be started: {e}"))?;
        let part = |from: u64| rows(from, (from + CHUNK).min(end));
        let parts: Vec<Trajectory> = interrupt.beside(|| pool.install(|| begins.into_par_iter().map(part).collect()));
        let mut table = Trajectory::with_capacity(self.inner.columns(), end.saturating_sub(first) as usize);
        parts.iter().for_each(|part| table.append(part));
        Ok(table)
    }
}
