//! The experiment that determines parameters best: an input within travel, input and current that makes their standard
//! errors small.
//!
//! With the derivatives J of the weighted outputs with respect to relative changes of the parameters, nuisance
//! parameters projected out, and a prior of 100 % on each parameter, the covariance of the relative changes is
//!
//! ```text
//! C = (JᵀJ + I)⁻¹        D-optimal: least det C^(1/2k)        A-optimal: least (tr C / k)^(1/2)
//! ```
//!
//! for the k parameters in the criterion; the others are also free. J is that of a fit to a log simulated by the model.

mod candidates;
mod criterion;
mod driven;
mod limits;
mod search;
mod text;
mod trial;
mod verify;

pub use crate::fit::limits::VERIFIED;
pub use candidates::{Excitation, Shape};
pub use driven::Driven;
pub use limits::{Limits, Origin, Reached};
pub use search::{Alternative, Designed, Own, Promise};
pub use verify::{Verified, verify};

use crate::case::{Case, Plan, parameters};
use crate::error::{Error, Result};
use crate::fit::asked::problem::{Problem, Stop};
use crate::fit::limits::{DESIGN_MODEL_ERROR, DURATION, MOST_ROWS, SAMPLE_INTERVAL};
use crate::fit::trust::identify::Group;
use crate::log::Quantity;
use crate::machine::{Channel, Machine, Measurement};

/// The measure that is minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Criterion {
    /// The volume of the confidence ellipsoid: the geometric mean of the errors along its axes.
    #[default]
    D,
    /// The mean square of the errors.
    A,
}

impl Criterion {
    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::D => "D-optimal",
            Self::A => "A-optimal",
        }
    }
}

/// A request for an experiment; defaults follow from the case.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The parameters of the criterion; if empty, the free ones of `[fit]`.
    pub names: Vec<String>,
    /// The kinds of inputs to choose from; all if empty.
    pub kinds: Vec<Excitation>,
    /// The driven motors to choose from, by the names of [`Driven::all`]; all if empty.
    pub driven: Vec<String>,
    /// The measure that is minimised.
    pub criterion: Criterion,
    /// Length, s.
    pub duration: f64,
    /// Sample interval, s.
    pub every: Option<f64>,
    /// Fraction of each limit that is kept free.
    pub margin: f64,
    /// Relative error of each free parameter within which the limits must still hold.
    pub doubt: f64,
    /// Relative error of the model, a lower bound of each predicted error.
    pub model_error: f64,
    /// Greatest input, V or A.
    pub input: Option<f64>,
    /// Greatest current, A.
    pub current: Option<f64>,
    /// Length of the travel, m; for a gantry, of bridge and cart.
    pub travel: Option<f64>,
    /// Measured outputs; by default those of the case's encoder and recorder.
    pub measured: Vec<Channel>,
    /// Seed of the search and the noise.
    pub seed: u64,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            names: Vec::new(),
            kinds: Vec::new(),
            driven: Vec::new(),
            criterion: Criterion::D,
            duration: DURATION,
            every: None,
            margin: 0.1,
            doubt: 0.2,
            model_error: DESIGN_MODEL_ERROR,
            input: None,
            current: None,
            travel: None,
            measured: Vec::new(),
            seed: 1,
        }
    }
}

impl Request {
    /// Checks the ranges of its numbers.
    fn checked(&self) -> Result<()> {
        let sizes = [
            ("duration", Some(self.duration)),
            ("interval between samples", self.every),
            ("greatest input", self.input),
            ("greatest current", self.current),
            ("travel", self.travel),
        ];
        for (name, value) in sizes.iter().filter_map(|(name, value)| value.map(|value| (name, value))) {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::new(format!("a {name} of {value} cannot be")).allowed("above 0"));
            }
        }
        for (name, value) in [("margin", self.margin), ("doubt", self.doubt), ("model error", self.model_error)] {
            if !(0.0..=0.9).contains(&value) {
                return Err(Error::new(format!("a {name} of {value} cannot be")).allowed("0 to 0.9"));
            }
        }
        Ok(())
    }
}

/// A request completed by the case.
pub(super) struct Task<'a> {
    pub case: Case,
    pub plan: Plan,
    /// Indices of the parameters in the criterion, among those of the problem.
    pub wanted: Vec<usize>,
    pub names: Vec<String>,
    pub driven: Vec<Driven>,
    pub criterion: Criterion,
    pub duration: f64,
    pub every: f64,
    pub doubt: f64,
    pub model_error: f64,
    pub limits: Limits,
    pub measured: Vec<Channel>,
    pub seed: u64,
    pub stop: Stop<'a>,
}

/// Designs an experiment for a case. `stop` is called from time to time and ends the search with the best input so far;
/// `watch` receives each kind of input.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::fit::experiment_design::{Excitation, Request, design};
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let names = ["cart.mass", "cart.friction.coulomb"].map(String::from).to_vec();
/// let request = Request { names, kinds: vec![Excitation::Trapezoid], duration: 1.0, ..Request::default() };
/// let found = design(&case, &request, &|| false, &mut |_| {})?;
/// assert!(found.promises.iter().all(|promise| promise.relative < 0.05));
/// assert!(found.case_text(&case, "axis.toml".as_ref())?.contains("designed"));
/// # Ok::<(), taut::Error>(())
/// ```
pub fn design(case: &Case, request: &Request, stop: Stop, watch: &mut dyn FnMut(&str)) -> Result<Designed> {
    let task = Task::new(case, request, stop)?;
    search::best(&task, case, &request.kinds, watch)
}

impl<'a> Task<'a> {
    /// The same task on another machine.
    fn on(&self, machine: Machine) -> Self {
        Self {
            case: Case { machine, ..self.case.clone() },
            plan: self.plan.clone(),
            wanted: self.wanted.clone(),
            names: self.names.clone(),
            driven: self.driven.clone(),
            limits: self.limits.clone(),
            measured: self.measured.clone(),
            ..*self
        }
    }

    fn new(case: &Case, request: &Request, stop: Stop<'a>) -> Result<Self> {
        request.checked()?;
        crate::case::needs_motors(&case.machine)?;
        let modes = || case.machine.drives.iter().map(|drive| drive.amplifier.mode.unit());
        if let Some(other) = modes().find(|unit| Some(*unit) != modes().next()) {
            return Err(Error::new(format!("one amplifier is commanded in {other} and another one is not"))
                .allowed("amplifiers of one mode: an input has one unit"));
        }
        let every = request.every.unwrap_or_else(|| usual_interval(case));
        if request.duration < 10.0 * every || request.duration / every > MOST_ROWS {
            return Err(Error::new(format!(
                "an experiment of {} s with a sample every {every} s has {} of them",
                request.duration,
                crate::quantity::rounded((request.duration / every).floor())
            ))
            .allowed(format!("10 to {MOST_ROWS}"))
            .next("choose another --duration or --every"));
        }
        case.complete()?;
        let plan = plan_of(case, request)?;
        let all: Vec<String> = parameters(&case.machine, &plan, &[])?.into_iter().map(|free| free.name).collect();
        let named = request.names.iter().map(|name| {
            all.iter()
                .position(|own| own == name || own.split(" = ").any(|key| key == name))
                .ok_or_else(|| Error::new(format!("`{name}` is not a parameter of this fit")).allowed(all.join(", ")))
        });
        let mut wanted = named.collect::<Result<Vec<_>>>()?;
        if wanted.is_empty() {
            wanted = (0..all.len()).collect();
        }
        wanted.sort_unstable();
        wanted.dedup();
        let measured = measured(case, request)?;
        let limits = Limits::new(case, request)?;
        let driven = Driven::named(&case.machine, &request.driven)?;
        let mut own = case.clone();
        own.experiments.clear();
        let names = wanted.iter().map(|&j| all[j].clone()).collect();
        Ok(Self {
            case: own,
            plan,
            wanted,
            names,
            driven,
            criterion: request.criterion,
            duration: request.duration,
            every,
            doubt: request.doubt,
            model_error: request.model_error,
            limits,
            measured,
            seed: request.seed,
            stop,
        })
    }
}

/// Plan of the fit that the experiment is for: that of the case with the named parameters also free, without existing
/// logs.
fn plan_of(case: &Case, request: &Request) -> Result<Plan> {
    let mut plan = case.fit.clone().unwrap_or_default();
    let known: Vec<String> =
        plan.names().flat_map(|name| name.split(" = ").map(String::from).collect::<Vec<_>>()).collect();
    for name in request.names.iter().filter(|name| !known.contains(name)) {
        let sum = crate::parameter::Sum::ALL.iter().any(|sum| sum.name() == name);
        if sum { plan.lumped.push(name.clone()) } else { plan.free.push(name.clone()) }
    }
    if plan.names().next().is_none() {
        return Err(Error::new("there is nothing to determine: the case has no [fit]")
            .next("name parameters with --for cart.mass,cart.friction.coulomb, or add [fit] with free = [...]"));
    }
    Ok(Plan {
        separate: Vec::new(),
        held_out: Vec::new(),
        until: None,
        windows: None,
        closed_loop: false,
        huber: false,
        starts: 1,
        ..plan
    })
}

/// The recorder's interval, otherwise the shortest of the experiments.
fn usual_interval(case: &Case) -> f64 {
    let recorder = case.measurement.as_ref().and_then(|measurement| measurement.every);
    // The interval of a log is a difference of its times, with their rounding.
    let written = |every: f64| format!("{every:.9e}").parse().unwrap_or(every);
    let shortest = case.experiments.iter().map(|experiment| written(experiment.every)).reduce(f64::min);
    recorder.or(shortest).unwrap_or(SAMPLE_INTERVAL)
}

/// Measured outputs and their noise: as requested, else by the encoder and the recorder of the case, else the outputs
/// of its logs with their noise.
fn measured(case: &Case, request: &Request) -> Result<Vec<Channel>> {
    let own = case.machine.quantities();
    if let Some(channel) = request.measured.iter().find(|channel| !own.contains(&channel.quantity)) {
        let names: Vec<&str> = own.iter().map(|quantity| quantity.name()).collect();
        return Err(Error::new(format!("`{}` is no measured quantity of this machine", channel.quantity.name()))
            .allowed(names.join(", ")));
    }
    if !request.measured.is_empty() {
        return Ok(request.measured.clone());
    }
    let mut all = Vec::new();
    if let Some(encoder) = case.machine.encoder {
        let step = Some(1.0 / encoder.counts_per_unit(case.machine.drives[0].motor.gear_ratio));
        let counted = case.machine.counted().filter(|quantity| !quantity.is_of_rotor());
        all.extend(counted.map(|quantity| Channel { quantity, step, noise: 0.0, range: None }));
    }
    let of_recorder = case.measurement.iter().flat_map(|Measurement { channels, .. }| channels.iter().copied());
    all.extend(of_recorder);
    if all.is_empty() && case.experiments.iter().any(|experiment| experiment.log.is_some()) {
        let plan = Plan { held_out: Vec::new(), ..case.fit.clone().unwrap_or_default() };
        let problem = Problem::new(case, &plan)?;
        let of = |(quantity, noise): &(Quantity, f64)| Channel {
            quantity: *quantity,
            step: None,
            noise: *noise,
            range: None,
        };
        all.extend(problem.noise().0.iter().map(of));
    }
    let exact = all.iter().find(|channel| channel.step.is_none() && channel.noise == 0.0);
    if let Some(channel) = exact {
        return Err(Error::new(format!(
            "{} is recorded without any error: every standard error would be zero",
            channel.quantity.name()
        ))
        .next(
            "give it a step or a noise in [measurement], or name what is measured with --measure drive_angle=1mrad",
        ));
    }
    let such_as = match case.machine.has_one_coordinate() {
        true => "--measure drive_angle=1mrad --measure motor_current=10mA",
        false => "--measure left_angle=1mrad --measure right_angle=1mrad",
    };
    match all.is_empty() {
        true => Err(Error::new("nothing is measured in this case: there is no [encoder], no [measurement] and no log")
            .next(format!("add [encoder], or name what is measured and its noise: {such_as}"))),
        false => Ok(all),
    }
}

/// Groups of parameters that the experiment cannot distinguish, each with remedies.
pub type Undetermined = Vec<(Group, Vec<String>)>;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::TEMPLATE;

    #[test]
    fn an_experiment_of_a_machine_alone_has_4001_samples() {
        let machine = TEMPLATE.split("[[experiment]]").next().unwrap();
        let case = Case::from_text("axis.toml", machine).unwrap();
        let names = vec!["cart.mass".into()];
        let request = Request { names, input: Some(6.0), travel: Some(0.1), ..Request::default() };
        let task = Task::new(&case, &request, &|| false).unwrap();
        let times = trial::samples(task.every, task.duration);
        assert!(times.len() == 4001 && (times[4000] - 4.0).abs() < 1e-9, "{} {:?}", times.len(), times.last());
    }
}
