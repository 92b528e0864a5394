//! Cases and what is done with them.

use crate::columns::Columns;
use crate::error::{Told, guarded, unlocked};
use crate::interrupt::Interrupt;
use crate::{modes, runs, value};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::PathBuf;
use std::sync::Arc;
use taut::case::{Plan, TEMPLATE};
use taut::files::{Inputs, write_atomically};
use taut::fit::{Posterior, Profile, check, fit, posterior, profiles};
use taut::json;
use taut::linear::Analysis;
use taut::posterior::Effort;
use taut::solve::{Choice, Flow, Kind, Method};

/// Draws that tune a chain.
const TUNE: usize = 400;

/// A case that was read.
#[pyclass(frozen, module = "taut._native")]
pub struct Case {
    /// As the library has it.
    pub inner: Arc<taut::case::Case>,
    /// Where it lies, or would: paths in it are relative to its folder.
    pub path: PathBuf,
}

/// The files that a case names, which nothing is written over.
pub fn inputs(case: &taut::case::Case) -> Inputs {
    Inputs::new(case.files.iter().map(|file| &file.path))
}

#[pymethods]
impl Case {
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf, changes: Vec<String>) -> PyResult<Self> {
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let inner = unlocked(py, || taut::case::Case::read_with(&path, &changes))?.told(py)?;
        Ok(Self { inner: Arc::new(inner), path })
    }

    #[staticmethod]
    fn from_text(py: Python<'_>, path: PathBuf, text: &str, changes: Vec<String>) -> PyResult<Self> {
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let inner = unlocked(py, || taut::case::Case::from_text_with(&path, text, &changes))?.told(py)?;
        Ok(Self { inner: Arc::new(inner), path })
    }

    /// The same with changes, each as KEY=VALUE.
    fn changed(&self, py: Python<'_>, changes: Vec<String>) -> PyResult<Self> {
        Self::from_text(py, self.path.clone(), &self.inner.text, changes)
    }

    #[getter]
    fn title(&self) -> &str {
        &self.inner.title
    }

    #[getter]
    fn text(&self) -> &str {
        &self.inner.text
    }

    #[getter]
    fn path(&self) -> String {
        self.path.display().to_string()
    }

    #[getter]
    fn experiments(&self) -> Vec<&str> {
        self.inner.experiments.iter().map(|experiment| experiment.name.as_str()).collect()
    }

    #[getter]
    fn moves(&self) -> Vec<&str> {
        self.inner.moves.iter().map(|motion| motion.name.as_str()).collect()
    }

    /// What stands under a key, in SI units.
    fn value<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyAny>> {
        value::given(py, &guarded(|| self.inner.value(key))?.told(py)?)
    }

    /// Writes the text, under a temporary name first; over the file it was read from, but over no log or input of it.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        unlocked(py, || inputs(&self.inner).check(&path).and_then(|()| write_atomically(path, &self.inner.text)))?
            .told(py)
    }

    #[pyo3(signature = (names, solver, tolerance, step, method))]
    fn simulate(
        &self,
        py: Python<'_>,
        names: Vec<String>,
        solver: Option<&str>,
        tolerance: Option<f64>,
        step: Option<f64>,
        method: Option<&str>,
    ) -> PyResult<Vec<runs::Run>> {
        let kinds = [("exact", Kind::Exact), ("general", Kind::General), ("table3", Kind::Table3)];
        let methods = [("rk4", Method::RungeKutta4), ("dp5", Method::DormandPrince5)];
        let solver = solver.map(|name| one_of("solver", name, &kinds)).transpose()?;
        let method = method.map(|name| one_of("method", name, &methods)).transpose()?;
        let solver = guarded(|| Choice { solver, tolerance, step, method }.solver(&self.inner.stage))?.told(py)?;
        runs::simulate(py, self, &names, solver)
    }

    /// Runs moves; timing is every, delay, limit of a controller in Python.
    fn run_moves(
        &self,
        py: Python<'_>,
        names: Vec<String>,
        controller: Option<&Bound<'_, PyAny>>,
        timing: runs::Timing,
        spread: Option<f64>,
    ) -> PyResult<Vec<runs::Run>> {
        runs::motion(py, self, &names, controller, timing, spread)
    }

    fn check<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let plan = self.inner.fit_plan(&self.path).told(py)?;
        let found = unlocked(py, || check(&self.inner, &plan))?.told(py)?;
        value::json(py, &guarded(|| json::check(&self.inner, &found))?)
    }

    /// Fits, and draws from the posterior if so many draws and chains are asked for.
    fn fit(&self, py: Python<'_>, effort: Option<(usize, usize)>, profiled: bool) -> PyResult<Fit> {
        let plan = self.inner.fit_plan(&self.path).told(py)?;
        let effort = effort.map(|(draws, chains)| Effort { chains, draws, tune: TUNE, seed: plan.seed });
        // Before the fit, which may take long.
        effort.map_or(Ok(()), |effort| effort.check()).told(py)?;
        let interrupt = Interrupt::listen();
        let found = unlocked(py, || self.fitted(&plan, effort, profiled, &interrupt));
        interrupt.finish()?;
        let (fit, profiles, drawn) = found?.told(py)?;
        let text = guarded(|| fit.case_text(&self.inner, &self.path))?.told(py)?;
        let case = Self::from_text(py, self.path.clone(), &text, Vec::new())?;
        let told = guarded(|| json::fit(&self.inner, &fit, &profiles, drawn.as_ref().map(json::posterior)))?;
        let draws = drawn.map(|drawn| Columns::of(py, drawn.table())).transpose()?;
        Ok(Fit { data: value::json(py, &told)?.unbind(), case: Py::new(py, case)?, draws })
    }

    #[allow(clippy::too_many_arguments)] // each is an option of the command line
    fn modes<'py>(
        &self,
        py: Python<'py>,
        at: Option<f64>,
        speed: Option<f64>,
        stuck: Vec<String>,
        sample_time: Option<f64>,
        hold: Option<&str>,
        delay: Option<f64>,
        from: Option<f64>,
        to: Option<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let question = modes::question(at, speed, &stuck, sample_time, hold, delay, from, to)?;
        let analysis = unlocked(py, || Analysis::of(&self.inner, &question))?.told(py)?;
        modes::answers(py, &analysis)
    }
}

impl Case {
    fn fitted(
        &self,
        plan: &Plan,
        effort: Option<Effort>,
        profiled: bool,
        interrupt: &Interrupt,
    ) -> taut::Result<(taut::fit::Fit, Vec<Profile>, Option<Posterior>)> {
        let stop = || interrupt.stop();
        let flow = |stop: bool| if stop { Flow::Stop } else { Flow::Continue };
        let found = fit(&self.inner, plan, Some(&stop), &mut |_| flow(interrupt.stop()))?;
        let profiles = if profiled { profiles(&self.inner, plan, &found, Some(&stop))? } else { Vec::new() };
        let drawn = match effort.filter(|_| !interrupt.stop()) {
            Some(effort) => {
                let watch = |_| !interrupt.stop();
                Some(interrupt.beside(|| posterior(&self.inner, plan, &found, effort, &watch))?)
            }
            None => None,
        };
        Ok((found, profiles, drawn))
    }
}

fn one_of<T: Copy>(what: &str, name: &str, known: &[(&str, T)]) -> PyResult<T> {
    known.iter().find(|(word, _)| *word == name).map(|(_, value)| *value).ok_or_else(|| {
        let words: Vec<&str> = known.iter().map(|(word, _)| *word).collect();
        PyValueError::new_err(format!("{what}: \"{name}\" is none of {}", words.join(", ")))
    })
}

/// What a fit found.
#[pyclass(frozen, module = "taut._native")]
pub struct Fit {
    /// As `--json` has it.
    #[pyo3(get)]
    data: Py<PyAny>,
    /// With the estimates.
    #[pyo3(get)]
    case: Py<Case>,
    draws: Option<Columns>,
}

#[pymethods]
impl Fit {
    /// The draws by name; None if none were asked for.
    #[getter]
    fn draws(&self, py: Python<'_>) -> Option<(Py<PyDict>, Py<PyList>)> {
        self.draws.as_ref().map(|draws| (draws.arrays.clone_ref(py), draws.names.clone_ref(py)))
    }
}

/// The case that `taut init` writes.
#[pyfunction]
pub fn template() -> &'static str {
    TEMPLATE
}
