//! Cases and what is done with them.

use crate::columns::Columns;
use crate::error::{IntoPython, guarded, unlocked};
use crate::interrupt::Interrupt;
use crate::{fmu, logs, modes, runs, value};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::PathBuf;
use std::sync::Arc;
use taut::Error;
use taut::case::{Files, InputFile, Plan, TEMPLATE};
use taut::control::Added;
use taut::export::{Destination, Exported, Options, Part, Real, Target, export};
use taut::files::{Inputs, write_atomically};
use taut::fit::Effort;
use taut::fit::compare::{ComparisonOptions, FrictionLaw, compare};
use taut::fit::experiment_design::{Criterion, Excitation, Request, design, verify};
use taut::fit::map::map;
use taut::fit::{Posterior, Profile, check_watched, drift, fit, posterior, profiles};
use taut::frf::{Cut, Known, measure};
use taut::json;
use taut::learning::{At, Trial, learn};
use taut::linear::Analysis;
use taut::machine::Channel;
use taut::overview::Overview;
use taut::planning::plan;
use taut::reach::quickest::Wanted;
use taut::solve::{Choice, Flow, Method, SolverKind};
use taut::tune::{evaluate, tune};

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

/// The part of a case that a word names.
fn exported_part(word: Option<&str>) -> PyResult<Option<Part>> {
    match word {
        None => Ok(None),
        Some("plant") => Ok(Some(Part::Plant)),
        Some("controller") => Ok(Some(Part::Controller)),
        Some("both") => Ok(Some(Part::Both)),
        Some(other) => Err(PyValueError::new_err(format!("part: expected plant, controller or both, found {other:?}"))),
    }
}

/// The numbers of C that a word names.
fn exported_real(word: &str) -> PyResult<Real> {
    match word {
        "float" => Ok(Real::Float),
        "double" => Ok(Real::Double),
        other => Err(PyValueError::new_err(format!("real: expected float or double, found {other:?}"))),
    }
}

/// The files that a case names, which nothing is written over.
pub fn inputs(files: &[InputFile]) -> Inputs {
    Inputs::new(files.iter().map(|file| &file.path))
}

#[pymethods]
impl Case {
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf, changes: Vec<String>) -> PyResult<Self> {
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let inner = unlocked(py, || taut::case::Case::read_for(&path, &changes, Files::All))?.told(py)?;
        Ok(Self { inner: Arc::new(inner), path })
    }

    #[staticmethod]
    fn from_text(py: Python<'_>, path: PathBuf, text: &str, changes: Vec<String>) -> PyResult<Self> {
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let inner = unlocked(py, || taut::case::Case::from_text_for(&path, text, &changes, Files::All))?.told(py)?;
        Ok(Self { inner: Arc::new(inner), path })
    }

    /// A copy with changes, each as KEY=VALUE.
    fn changed(&self, py: Python<'_>, changes: Vec<String>) -> PyResult<Self> {
        Self::from_text(py, self.path.clone(), self.text(), changes)
    }

    /// As the case file has it.
    #[getter]
    fn kind(&self) -> &str {
        self.inner.machine.kind.word()
    }

    /// The names of its drives, of a gantry their sides.
    #[getter]
    fn drives(&self) -> Vec<&'static str> {
        let geometry = self.inner.machine.geometry();
        geometry.drives.iter().map(|drive| geometry.drive_key(drive)).collect()
    }

    /// The names of what slides.
    #[getter]
    fn slides(&self) -> Vec<&'static str> {
        self.inner.machine.travels().map(|(label, _)| label.key).collect()
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

    /// Experiments that were left out, each with the reason: name, error.
    #[getter]
    fn left_out(&self) -> Vec<(&str, String)> {
        self.inner.left_out().into_iter().map(|(name, error)| (name, error.to_string())).collect()
    }

    /// Raises the error of an experiment of this name that was left out.
    fn require(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        let left_out = self.inner.unread.iter().find(|one| one.holds(name));
        left_out.map_or(Ok(()), |one| Err(one.error.clone())).told(py)
    }

    #[getter]
    fn moves(&self) -> Vec<&str> {
        self.inner.moves.iter().map(|motion| motion.name.as_str()).collect()
    }

    /// The value under a key, in SI units.
    fn value<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyAny>> {
        let found = guarded(|| self.inner.value(key));
        value::given(py, &found?.told(py)?)
    }

    /// Writes the text, under a temporary name first; over the file it was read from, but over no log or input of it.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        unlocked(py, || inputs(self.files()).check(&path).and_then(|()| write_atomically(path, self.text())))?.told(py)
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
        let kinds = [("exact", SolverKind::Exact), ("general", SolverKind::General), ("table3", SolverKind::Table3)];
        let methods = [("rk4", Method::RungeKutta4), ("dp5", Method::DormandPrince5)];
        let solver = solver.map(|name| one_of("solver", name, &kinds)).transpose()?;
        let method = method.map(|name| one_of("method", name, &methods)).transpose()?;
        let choice = Choice { solver, tolerance, step, method };
        let solver = guarded(|| choice.solver(&self.inner.machine))?.told(py)?;
        runs::simulate(py, &self.inner, &self.path, &names, solver)
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
        runs::motion(py, &self.inner, &self.path, &names, controller, timing, spread)
    }

    fn check<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let case = &self.inner;
        let plan = case.fit_plan(&self.path).told(py)?;
        let interrupt = Interrupt::listen();
        let watch = &mut |_: &[f64], _: f64| if interrupt.stop() { Flow::Stop } else { Flow::Continue };
        let found = unlocked(py, || check_watched(case, &plan, Some(&|| interrupt.stop()), watch));
        interrupt.finish()?;
        let found = found?.told(py)?;
        value::json(py, &guarded(|| json::check(case, &found))?)
    }

    /// Fits, and draws from the posterior if so many draws and chains are asked for.
    fn fit(&self, py: Python<'_>, effort: Option<(usize, usize)>, profiled: bool) -> PyResult<Fit> {
        let case = &self.inner;
        let plan = case.fit_plan(&self.path).told(py)?;
        let effort = effort.map(|(draws, chains)| Effort { chains, draws, tune: TUNE, seed: plan.seed });
        // Before the fit, which may take long.
        effort.map_or(Ok(()), |effort| effort.check()).told(py)?;
        let interrupt = Interrupt::listen();
        let found = unlocked(py, || fitted(case, &plan, effort, profiled, &interrupt));
        interrupt.finish()?;
        let (fit, profiles, drawn) = found?.told(py)?;
        let text = guarded(|| fit.case_text(case, &self.path))?.told(py)?;
        let estimated = Self::from_text(py, self.path.clone(), &text, Vec::new())?;
        let told = guarded(|| json::fit(case, &fit, &profiles, drawn.as_ref().map(json::posterior)))?;
        let draws = drawn.map(|drawn| Columns::new(py, drawn.table())).transpose()?;
        let logs = fit.logs.into_iter().map(|log| logs::met(py, log)).collect::<PyResult<_>>()?;
        Ok(Fit { data: value::json(py, &told)?.unbind(), case: Py::new(py, estimated)?, draws, logs })
    }

    /// Frequency responses from the logs, as `--json` prints them.
    fn frf<'py>(
        &self,
        py: Python<'py>,
        segment: Option<f64>,
        period: Option<f64>,
        at: Option<f64>,
        bridge: Option<f64>,
        delay: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let case = &self.inner;
        let (cut, known) = (Cut { segment, period }, Known::new(case, at, bridge, delay).told(py)?);
        let found = unlocked(py, || measure(case, &cut, known))?.map_err(|error| error.in_file(&self.path)).told(py)?;
        value::json(py, &guarded(|| json::frf(case, &found))?)
    }

    /// Designs an experiment: what `--json` prints, and the case with the experiment in it.
    #[allow(clippy::too_many_arguments)]
    fn design(
        &self,
        py: Python<'_>,
        names: Vec<String>,
        inputs: (Vec<String>, Vec<String>),
        criterion: &str,
        times: (f64, Option<f64>),
        shares: (f64, f64, f64),
        limits: (Option<f64>, Option<f64>, Option<f64>),
        measured: Vec<(String, f64)>,
        verified: u32,
        seed: u64,
    ) -> PyResult<(Py<PyAny>, Py<Self>)> {
        let case = &self.inner;
        let kind = |word: &String| {
            let kinds = Excitation::ALL.map(Excitation::word).join(", ");
            let found = Excitation::ALL.into_iter().find(|kind| kind.word() == word);
            found.ok_or_else(|| Error::new(format!("there is no input \"{word}\"")).allowed(kinds))
        };
        let channel = |(name, noise): &(String, f64)| {
            let names = case.machine.quantities().iter().map(|quantity| quantity.name()).collect::<Vec<_>>().join(", ");
            let quantity = case.machine.quantities().iter().copied().find(|quantity| quantity.name() == name);
            let quantity = quantity
                .ok_or_else(|| Error::new(format!("there is no measured quantity \"{name}\"")).allowed(names))?;
            match *noise > 0.0 && noise.is_finite() {
                true => Ok(Channel { quantity, step: None, noise: *noise, range: None }),
                false => Err(Error::new(format!("{noise} is no standard deviation of {name}")).allowed("above 0")),
            }
        };
        let criterion = match criterion {
            "d" => Ok(Criterion::D),
            "a" => Ok(Criterion::A),
            other => Err(Error::new(format!("there is no criterion \"{other}\"")).allowed("d, a")),
        };
        let ((duration, every), (margin, doubt, model_error), (input, current, travel)) = (times, shares, limits);
        let (inputs, driven) = inputs;
        let request = Request {
            names,
            kinds: inputs.iter().map(kind).collect::<taut::Result<_>>().told(py)?,
            driven,
            criterion: criterion.told(py)?,
            duration,
            every,
            margin,
            doubt,
            model_error,
            input,
            current,
            travel,
            measured: measured.iter().map(channel).collect::<taut::Result<_>>().told(py)?,
            seed,
        };
        let interrupt = Interrupt::listen();
        let stop = || interrupt.stop();
        let found = unlocked(py, || {
            let found = design(case, &request, &stop, &mut |_| {})?;
            let checked = verify(case, &request, &found, verified as usize, &stop)?;
            Ok((found, checked))
        });
        interrupt.finish()?;
        let (found, checked) = found?.map_err(|error: Error| error.in_file(&self.path)).told(py)?;
        let text = guarded(|| found.case_text(case, &self.path))?.told(py)?;
        let changed = Self::from_text(py, self.path.clone(), &text, Vec::new())?;
        let told = guarded(|| json::design(case, &found, &checked))?;
        Ok((value::json(py, &told)?.unbind(), Py::new(py, changed)?))
    }

    /// Tunes the controller, or judges it as it is: what `--json` prints, and the case with the gains that were found.
    fn tune(
        &self,
        py: Python<'_>,
        spread: Option<f64>,
        corners: bool,
        judged: bool,
        draws: Option<PathBuf>,
        effort: f64,
    ) -> PyResult<(Py<PyAny>, Py<Case>)> {
        let case = &self.inner;
        let mut tuning = case.tune.clone().unwrap_or_default();
        tuning.spread = spread.or(tuning.spread);
        tuning.corners = corners;
        tuning.draws = draws;
        tuning.effort = effort;
        let interrupt = Interrupt::listen();
        let found = unlocked(py, || match judged {
            true => evaluate(case, &tuning),
            false => tune(case, &tuning, &|| interrupt.stop()),
        });
        interrupt.finish()?;
        let tuned = found?.map_err(|error| error.in_file(&self.path)).told(py)?;
        let text = guarded(|| tuned.case_text(case, &self.path))?.told(py)?;
        let changed = Self::from_text(py, self.path.clone(), &text, Vec::new())?;
        let told = guarded(|| json::tuned(case, &tuning, &tuned))?;
        Ok((value::json(py, &told)?.unbind(), Py::new(py, changed)?))
    }

    /// Plans moves: what `--json` prints, and the case with the planned limits.
    fn plan(
        &self,
        py: Python<'_>,
        names: Vec<String>,
        limits: (Option<f64>, Option<f64>, Option<f64>),
        reserve: f64,
    ) -> PyResult<(Py<PyAny>, Py<Self>)> {
        let case = &self.inner;
        let (_, moves) = case.moves_named(&self.path, &names).told(py)?;
        let places: Vec<usize> =
            (0..case.moves.len()).filter(|&k| moves.iter().any(|one| one.name == case.moves[k].name)).collect();
        let (speed, acceleration, jerk) = limits;
        let wanted = Wanted { speed, acceleration, jerk, reserve };
        wanted.check().told(py)?;
        let interrupt = Interrupt::listen();
        let found = unlocked(py, || plan(case, &places, &wanted, &|| interrupt.stop()));
        interrupt.finish()?;
        let plans = found?.map_err(|error| error.in_file(&self.path)).told(py)?;
        let text = guarded(|| plans.case_text(case, &self.path))?.told(py)?;
        let changed = Self::from_text(py, self.path.clone(), &text, Vec::new())?;
        let told = guarded(|| json::plan(case, &wanted, &plans))?;
        Ok((value::json(py, &told)?.unbind(), Py::new(py, changed)?))
    }

    /// Learns from a repetition of a move: what `--json` prints.
    fn learn<'py>(
        &self,
        py: Python<'py>,
        names: Vec<String>,
        time: Vec<f64>,
        positions: Vec<Vec<f64>>,
        added: Option<Vec<Vec<f64>>>,
        encoder: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let case = &self.inner;
        let (design, moves) = case.moves_named(&self.path, &names).told(py)?;
        let [motion] = moves[..] else {
            let error = Error::new(format!("the case has {} moves, and a log is of one", moves.len()));
            return Err(error.next("name the move of the log: move=\"...\"")).told(py);
        };
        let at = if encoder { At::Encoder } else { At::Cart };
        let before: Option<Vec<Added>> =
            added.map(|signals| signals.into_iter().map(|values| Added::new(design.every, values)).collect());
        let trial = Trial { time, positions, at };
        let interrupt = Interrupt::listen();
        let found = unlocked(py, || learn(case, motion, &trial, before.as_deref(), &|| interrupt.stop()));
        interrupt.finish()?;
        let found = found?.map_err(|error| error.in_file(&self.path)).told(py)?;
        value::json(py, &guarded(|| json::learned(case, motion, at, &found))?)
    }

    /// The force along the travel from the logs: what `--json` prints, and the case with it, if it is significant.
    fn force_map(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, Option<Py<Self>>)> {
        let case = &self.inner;
        let found = unlocked(py, || map(case))?.map_err(|error| error.in_file(&self.path)).told(py)?;
        let text = guarded(|| found.case_text(case, &self.path))?.told(py)?;
        let mapped = text.map(|text| Self::from_text(py, self.path.clone(), &text, Vec::new()));
        let mapped = mapped.transpose()?.map(|mapped| Py::new(py, mapped)).transpose()?;
        Ok((value::json(py, &guarded(|| json::map(case, &found))?)?.unbind(), mapped))
    }

    /// Compares friction laws and windows: the comparison as JSON, and the case with the estimates of the chosen ones.
    fn compare(
        &self,
        py: Python<'_>,
        laws: Vec<String>,
        windows: Option<Vec<Option<f64>>>,
    ) -> PyResult<(Py<PyAny>, Py<Self>)> {
        let case = &self.inner;
        let plan = case.fit_plan(&self.path).told(py)?;
        let mut setting = ComparisonOptions::usual(case, &plan);
        if !laws.is_empty() {
            setting.laws = laws.iter().map(|law| FrictionLaw::named(law)).collect::<taut::Result<_>>().told(py)?;
        }
        if let Some(windows) = windows.filter(|windows| !windows.is_empty()) {
            setting.windows = windows;
        }
        let interrupt = Interrupt::listen();
        let stop = || interrupt.stop();
        let watch = &mut |_: &str| if interrupt.stop() { Flow::Stop } else { Flow::Continue };
        let found = unlocked(py, || compare(case, &self.path, &plan, &setting, Some(&stop), watch));
        interrupt.finish()?;
        let found = found?.told(py)?;
        let text = guarded(|| found.fit.case_text(&found.case, &self.path))?.told(py)?;
        let estimated = Self::from_text(py, self.path.clone(), &text, Vec::new())?;
        let told = guarded(|| json::comparison(&found))?;
        Ok((value::json(py, &told)?.unbind(), Py::new(py, estimated)?))
    }

    /// Which single change explains the logs, as JSON.
    fn drift(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let case = &self.inner;
        let plan = case.fit_plan(&self.path).told(py)?;
        let interrupt = Interrupt::listen();
        let stop = || interrupt.stop();
        let watch = &mut |_: &str| if interrupt.stop() { Flow::Stop } else { Flow::Continue };
        let found = unlocked(py, || drift(case, &plan, Some(&stop), watch));
        interrupt.finish()?;
        let told = found?.told(py)?;
        Ok(value::json(py, &guarded(|| json::drift(case, &told))?)?.unbind())
    }

    #[allow(clippy::too_many_arguments)] // each is an option of the command line
    fn modes<'py>(
        &self,
        py: Python<'py>,
        at: Option<f64>,
        bridge: Option<f64>,
        speed: Option<f64>,
        stuck: Vec<String>,
        sample_time: Option<f64>,
        hold: Option<&str>,
        delay: Option<f64>,
        from: Option<f64>,
        to: Option<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let question = modes::question(at, bridge, speed, &stuck, sample_time, hold, delay, from, to)?;
        let analysis = unlocked(py, || Analysis::new(&self.inner, &question))?.told(py)?;
        modes::answers(py, &analysis)
    }

    /// The overview, as `taut show --json` has it.
    fn show<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let overview = unlocked(py, || Overview::new(&self.inner))?.told(py)?;
        value::json(py, &guarded(|| json::show(&overview))?)
    }

    /// Writes the files of a target, as `taut export` does, and says where they are and what should be known besides.
    /// `how` is the part, the numbers of C, the step, s, the places of cart and bridge, m, and the version of FMI.
    fn export(
        &self,
        py: Python<'_>,
        target: &str,
        out: PathBuf,
        how: (Option<String>, String, Option<f64>, Option<f64>, Option<f64>, u32),
    ) -> PyResult<(Vec<PathBuf>, Vec<String>)> {
        let (part, real, step, at, bridge, fmi) = how;
        let opened = &*self.inner;
        let part = exported_part(part.as_deref())?;
        let options = Options { part, real: exported_real(&real)?, step, at, bridge };
        let own = self.path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let made = unlocked(py, || {
            let inputs = inputs(&opened.files);
            let text = |target: Target| {
                let place = Destination::new(&out, target.ending(), &own);
                let mut claim = place.claim(target.ending())?;
                let exported = export(opened, target, &place.stem, &options)?;
                Ok((place.write(&exported, &inputs, &mut claim)?, exported.notes))
            };
            match target {
                "c" => text(Target::C),
                "st" => text(Target::StructuredText),
                "matlab" => text(Target::Matlab),
                "python" => text(Target::Python),
                "fmu" => {
                    let place = Destination::new(&out, "fmu", &own);
                    let mut claim = place.claim("fmu")?;
                    let exported = fmu::export(opened, options.part, fmi, &place.stem)?;
                    Ok((place.write(&exported, &inputs, &mut claim)?, exported.notes))
                }
                "json" => {
                    let place = Destination::new(&out, "json", &own);
                    let mut claim = place.claim("json")?;
                    let content = json::text(&json::export(opened)?).into_bytes();
                    let files = vec![(format!("{}.json", place.stem), content)];
                    let exported = Exported { files, ..Exported::default() };
                    Ok((place.write(&exported, &inputs, &mut claim)?, Vec::new()))
                }
                other => Err(taut::Error::new(format!("there is no target \"{other}\" here"))
                    .allowed("fmu, c, st, matlab, python or json")),
            }
        });
        made?.told(py)
    }
}

impl Case {
    fn files(&self) -> &[InputFile] {
        &self.inner.files
    }
}

fn fitted(
    case: &taut::case::Case,
    plan: &Plan,
    effort: Option<Effort>,
    profiled: bool,
    interrupt: &Interrupt,
) -> taut::Result<(taut::fit::Fit, Vec<Profile>, Option<Posterior>)> {
    let stop = || interrupt.stop();
    let flow = |stop: bool| if stop { Flow::Stop } else { Flow::Continue };
    let found = fit(case, plan, Some(&stop), &mut |_| flow(interrupt.stop()))?;
    let profiles = if profiled { profiles(case, plan, &found, Some(&stop))? } else { Vec::new() };
    let drawn = match effort.filter(|_| !interrupt.stop()) {
        Some(effort) => {
            let watch = |_| !interrupt.stop();
            Some(interrupt.beside(|| posterior(case, plan, &found, effort, &watch))?)
        }
        None => None,
    };
    Ok((found, profiles, drawn))
}

fn one_of<T: Copy>(what: &str, name: &str, known: &[(&str, T)]) -> PyResult<T> {
    known.iter().find(|(word, _)| *word == name).map(|(_, value)| *value).ok_or_else(|| {
        let words: Vec<&str> = known.iter().map(|(word, _)| *word).collect();
        PyValueError::new_err(format!("{what}: \"{name}\" is none of {}", words.join(", ")))
    })
}

/// The result of a fit.
#[pyclass(frozen, module = "taut._native")]
pub struct Fit {
    /// As `--json` has it.
    #[pyo3(get)]
    data: Py<PyAny>,
    /// With the estimates.
    #[pyo3(get)]
    case: Py<Case>,
    draws: Option<Columns>,
    /// How each log is met, as dictionaries.
    #[pyo3(get)]
    logs: Vec<Py<PyDict>>,
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
