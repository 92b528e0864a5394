//! A simulation: `taut simulate --json`, `summary.json`.

use super::fit::score;
use crate::case::{Case, Experiment};
use crate::fit::LogFit;
use crate::machine::{AmplifierMode, Machine, axis};
use crate::mechanism::Mechanism;
use crate::metrics::{self, Peak, SteadySpeed};
use crate::reduction::Reduction;
use crate::solve::{self, Method, Outcome, Solver};
use serde::Serialize;
use serde_json::{Value, json};

/// Events listed; the rest is in the events' own file.
pub(super) const MOST_EVENTS: usize = 10_000;

/// One experiment after it ran.
#[derive(Debug, Clone, Copy)]
pub struct Simulated<'a> {
    /// The experiment as the case has it.
    pub experiment: &'a Experiment,
    /// Events, ending and cost.
    pub outcome: &'a Outcome,
    /// Its key figures.
    pub metrics: &'a metrics::Metrics,
    /// How far its model is from the elastic one, where it is a reduced one.
    pub reduction: Option<Reduction>,
    /// The band of the machines of a posterior.
    pub band: Option<Band>,
    /// The run beside the log of its experiment, where it has one.
    pub log: Option<&'a LogFit>,
    /// Its files.
    pub files: &'a [String],
}

/// The whole summary.
#[derive(Debug, Serialize)]
pub struct Simulation {
    schema: String,
    title: String,
    version: &'static str,
    solver: SolverUsed,
    stage: StageFigures,
    experiments: Vec<ExperimentFigures>,
}

#[derive(Debug, Serialize)]
pub(super) struct SolverUsed {
    name: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    tolerance: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    step_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    method: Option<&'static str>,
}

#[derive(Debug, Serialize)]
struct StageFigures {
    pulley_radius_m: f64,
    cart_mass_kg: f64,
    drive_pulley_inertia_kg_m2: f64,
    idler_pulley_inertia_kg_m2: f64,
    rotor_inertia_at_pulley_kg_m2: f64,
    /// Everything that moves, as if it were at the drive pulley.
    total_inertia_kg_m2: f64,
    gear_ratio: f64,
    belt_stiffness_newton_per_m: [f64; 3],
}

#[derive(Debug, Serialize)]
struct ExperimentFigures {
    name: String,
    files: Vec<String>,
    ending: EndingTold,
    metrics: Metrics,
    /// None for the elastic model.
    #[serde(skip_serializing_if = "Option::is_none")]
    reduction: Option<ReductionTold>,
    /// With --draws.
    #[serde(skip_serializing_if = "Option::is_none")]
    band: Option<Band>,
    /// Where the experiment has a log.
    #[serde(skip_serializing_if = "Option::is_none")]
    log: Option<Value>,
    /// By how much r φ₁, x and r φ₃ may be off.
    position_error_m: Option<f64>,
    position_error_basis: Option<&'static str>,
    /// Whether numbers of 64 bits determine the motion to a thousandth of itself.
    is_determined: Option<bool>,
    decided_within_rounding: Vec<TieTold>,
    events: Vec<Event>,
    events_not_listed: usize,
    cost: CostTold,
}

/// Where machines drawn from a posterior end: 2.5 %, 50 % and 97.5 % of them below.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Band {
    /// Machines that reached the end.
    pub machines: usize,
    /// Machines that did not.
    pub machines_left_out: usize,
    /// φ₁, rad.
    pub final_drive_angle_rad: [f64; 3],
    /// x, m.
    pub final_cart_position_m: [f64; 3],
    /// r φ₁ − x, m.
    pub final_drive_travel_minus_cart_m: [f64; 3],
}

#[derive(Debug, Serialize)]
pub(super) struct EndingTold {
    word: &'static str,
    time_s: f64,
}

/// The key figures of a run.
#[derive(Debug, Serialize)]
pub struct Metrics {
    end_time_s: f64,
    final_drive_angle_rad: f64,
    final_drive_travel_m: f64,
    final_cart_position_m: f64,
    final_cart_speed_m_s: f64,
    #[serde(rename = "peak_cart_speed_m_s")]
    cart_speed: PeakTold,
    #[serde(rename = "peak_drive_speed_m_s")]
    drive_speed: PeakTold,
    steady_speed: Option<SteadyTold>,
    #[serde(rename = "peak_span_stretch_m")]
    stretch: [PeakTold; 3],
    #[serde(rename = "peak_span_force_N")]
    force: [PeakTold; 3],
    #[serde(rename = "peak_motor_current_A")]
    current: PeakTold,
    #[serde(rename = "peak_drive_travel_minus_cart_m")]
    encoder_error: PeakTold,
    final_drive_travel_minus_cart_m: f64,
    stop_time_s: Option<f64>,
    settled: bool,
    event_counts: [CountTold; 3],
}

/// A reduced model beside the elastic one.
#[derive(Debug, Serialize)]
struct ReductionTold {
    #[serde(rename = "peak_cart_difference_m")]
    cart: PeakTold,
    #[serde(rename = "peak_drive_travel_difference_m")]
    drive: PeakTold,
    final_cart_difference_m: f64,
    #[serde(rename = "elastic_peak_drive_travel_minus_cart_m")]
    encoder_error: PeakTold,
    #[serde(rename = "elastic_peak_span_stretch_m")]
    stretch: PeakTold,
}

#[derive(Debug, Serialize)]
pub(super) struct PeakTold {
    value: f64,
    time_s: f64,
}

#[derive(Debug, Serialize)]
struct SteadyTold {
    cart_speed_m_s: f64,
    change_m_s: f64,
    reached: bool,
    analytic_m_s: Option<f64>,
    input: f64,
    input_unit: &'static str,
    from_s: f64,
    to_s: f64,
}

#[derive(Debug, Serialize)]
pub(super) struct CountTold {
    body: &'static str,
    stops: u64,
    starts: u64,
    reversals: u64,
}

/// A change of what a part of the axis does.
#[derive(Debug, Serialize)]
pub struct Event {
    time_s: f64,
    part: &'static str,
    from: &'static str,
    to: &'static str,
    load: f64,
    load_unit: &'static str,
    by_rounding: bool,
}

#[derive(Debug, Serialize)]
pub(super) struct CostTold {
    samples: u64,
    input_pieces: u64,
    modes: u64,
    propagators: u64,
    steps: u64,
    looks: u64,
    series: u64,
    evaluations: u64,
}

impl Simulation {
    /// The summary of these runs.
    pub fn new(case: &Case, solver: Solver, runs: &[Simulated]) -> Self {
        Self {
            schema: super::identity("simulate"),
            title: case.title.clone(),
            version: env!("CARGO_PKG_VERSION"),
            solver: SolverUsed::of(solver),
            stage: StageFigures::of(&case.machine),
            experiments: runs
                .iter()
                .map(|run| ExperimentFigures::of(run, case.machine.drives[0].amplifier.mode, solver))
                .collect(),
        }
    }
}

impl SolverUsed {
    pub(super) fn of(solver: Solver) -> Self {
        match solver {
            Solver::Exact => Self { name: "exact", tolerance: None, step_s: None, method: None },
            Solver::General { tolerance } => {
                Self { name: "general", tolerance: Some(tolerance), step_s: None, method: None }
            }
            Solver::Table3 { step, method } => {
                let method = match method {
                    Method::RungeKutta4 => "rk4",
                    Method::DormandPrince5 => "dp5",
                };
                Self { name: "table3", tolerance: None, step_s: Some(step), method: Some(method) }
            }
        }
    }
}

impl StageFigures {
    fn of(machine: &Machine) -> Self {
        let (n, r) = (machine.drives[0].motor.gear_ratio, machine.pulley_radius);
        let rotor = n * n * machine.drives[0].motor.rotor_inertia;
        let (j1, j2, m) = (machine.drive_pulley.inertia, machine.idler_pulley.inertia, machine.cart.mass);
        Self {
            pulley_radius_m: r,
            cart_mass_kg: m,
            drive_pulley_inertia_kg_m2: j1,
            idler_pulley_inertia_kg_m2: j2,
            rotor_inertia_at_pulley_kg_m2: rotor,
            total_inertia_kg_m2: j1 + j2 + rotor + m * r * r,
            gear_ratio: n,
            belt_stiffness_newton_per_m: machine.belt.stiffness.three(),
        }
    }
}

impl ExperimentFigures {
    fn of(run: &Simulated, mode: AmplifierMode, solver: Solver) -> Self {
        let (metrics, outcome) = (run.metrics, run.outcome);
        Self {
            name: run.experiment.name.clone(),
            files: run.files.to_vec(),
            ending: EndingTold::of(outcome, metrics.end),
            metrics: Metrics::of(metrics, mode),
            reduction: run.reduction.map(|reduction| ReductionTold {
                cart: reduction.cart.into(),
                drive: reduction.drive.into(),
                final_cart_difference_m: reduction.final_cart,
                encoder_error: reduction.encoder_error.into(),
                stretch: reduction.stretch.into(),
            }),
            band: run.band,
            log: run.log.map(beside),
            position_error_m: run.outcome.error.map(|error| error.value),
            position_error_basis: error_basis(outcome, solver),
            is_determined: is_determined(outcome),
            decided_within_rounding: TieTold::of(outcome),
            events: outcome.events.iter().take(MOST_EVENTS).map(Event::of).collect(),
            events_not_listed: outcome.events.len().saturating_sub(MOST_EVENTS),
            cost: CostTold::of(outcome),
        }
    }
}

impl EndingTold {
    /// `end` is when it was, s, where nothing ended it early.
    pub(super) fn of(outcome: &Outcome, end: f64) -> Self {
        let (word, time_s) = super::ending(outcome.ending, end);
        Self { word, time_s }
    }
}

/// A decision within rounding.
#[derive(Debug, Serialize)]
pub(super) struct TieTold {
    time_s: f64,
    part: &'static str,
}

impl TieTold {
    pub(super) fn of(outcome: &Outcome) -> Vec<Self> {
        outcome.ties.iter().map(|tie| Self { time_s: tie.time, part: tie.part.key() }).collect()
    }
}

/// Whether errors leave the motion determined, where they are known.
pub(super) fn is_determined(outcome: &Outcome) -> Option<bool> {
    outcome.error.map(|error| !error.hides_motion())
}

/// The basis of the error of a run's positions.
pub(super) fn error_basis(outcome: &Outcome, solver: Solver) -> Option<&'static str> {
    match (solver, outcome.error) {
        (_, None) => None,
        (Solver::Exact, _) => Some("bound of rounding"),
        _ => Some("a second run with a hundred times the tolerance"),
    }
}

impl CostTold {
    pub(super) fn of(outcome: &Outcome) -> Self {
        let cost = outcome.cost;
        Self {
            samples: cost.samples,
            input_pieces: cost.pieces,
            modes: cost.modes,
            propagators: cost.propagators,
            steps: cost.steps,
            looks: cost.looks,
            series: cost.series,
            evaluations: cost.evaluations,
        }
    }
}

impl CountTold {
    pub(super) fn of(body: &'static str, count: metrics::EventCount) -> Self {
        Self { body, stops: count.stops, starts: count.starts, reversals: count.reversals }
    }
}

impl Metrics {
    /// As seen by a meter on a stage whose amplifier works in this way.
    pub fn of(metrics: &metrics::Metrics, mode: AmplifierMode) -> Self {
        let count = |body: usize| CountTold::of(axis::LABELS[body].key, metrics.events[body]);
        Self {
            end_time_s: metrics.end,
            final_drive_angle_rad: metrics.final_drive_angle,
            final_drive_travel_m: metrics.final_drive_travel,
            final_cart_position_m: metrics.final_cart_position,
            final_cart_speed_m_s: metrics.final_cart_speed,
            cart_speed: metrics.peak_cart_speed.into(),
            drive_speed: metrics.peak_drive_speed.into(),
            steady_speed: metrics.steady_speed.map(|steady| SteadyTold::of(steady, mode)),
            stretch: metrics.peak_stretch.map(PeakTold::from),
            force: metrics.peak_force.map(PeakTold::from),
            current: metrics.peak_current.into(),
            encoder_error: metrics.peak_encoder_error.into(),
            final_drive_travel_minus_cart_m: metrics.final_drive_travel - metrics.final_cart_position,
            stop_time_s: metrics.stop_time,
            settled: metrics.settled,
            event_counts: std::array::from_fn(count),
        }
    }
}

impl From<Peak> for PeakTold {
    fn from(peak: Peak) -> Self {
        Self { value: peak.value, time_s: peak.time }
    }
}

impl SteadyTold {
    fn of(steady: SteadySpeed, mode: AmplifierMode) -> Self {
        Self {
            cart_speed_m_s: steady.value,
            change_m_s: steady.change,
            reached: steady.reached,
            analytic_m_s: steady.analytic.speed(),
            input: steady.input,
            input_unit: if mode == AmplifierMode::Current { "A" } else { "V" },
            from_s: steady.stretch.0,
            to_s: steady.stretch.1,
        }
    }
}

impl Event {
    /// As the solver found it on an axis.
    pub fn of(event: &solve::Event) -> Self {
        Self::with(event, load_unit)
    }

    /// The same on any mechanism.
    pub fn on(mechanism: &Mechanism, event: &solve::Event) -> Self {
        Self::with(event, |body| mechanism.bodies[body].kind.units()[2])
    }

    fn with(event: &solve::Event, unit: impl Fn(usize) -> &'static str) -> Self {
        Self {
            time_s: event.time,
            part: event.part.key(),
            from: event.from.word(),
            to: event.to.word(),
            load: event.load,
            load_unit: event.body().map_or("", unit),
            by_rounding: event.by_rounding,
        }
    }
}

/// The unit of an event's load: a force at the cart, a torque at a pulley.
pub fn load_unit(body: usize) -> &'static str {
    if body == axis::CART { "N" } else { "N m" }
}

/// The run beside the log of its experiment.
fn beside(log: &LogFit) -> Value {
    let outputs = log.outputs.iter().map(
        |output| json!({ "quantity": output.quantity.name(), "unit": output.quantity.unit(), "score": score(output.fitted) }),
    );
    json!({ "complete": log.complete, "outputs": outputs.collect::<Vec<_>>() })
}
