//! A simulation: `taut simulate --json`, `summary.json`.

use super::fit::score;
use crate::case::{Case, Experiment};
use crate::fit::LogFit;
use crate::machine::{AmplifierMode, Machine, MachineKind, Motor, axis};
use crate::mechanism::{Mechanism, STEPPERS};
use crate::metrics::{
    self, EventCount, Extras, Figure, Metrics, OfDrive, OfLoad, OfSpan, Peak, Role, Seek, SteadySpeed, Worth,
};
use crate::reduction::Reduction;
use crate::solve::{self, ErrorEstimate, Method, Outcome, Solver};
use serde::Serialize;
use serde_json::{Map, Value, json};

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
    pub metrics: &'a Metrics,
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
    kind: &'static str,
    solver: SolverUsed,
    machine: MachineFigures,
    /// Of an axis alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    stage: Option<StageFigures>,
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

/// The machine, by the role of its parts.
#[derive(Debug, Serialize)]
struct MachineFigures {
    pulley_radius_m: f64,
    drive_pulley_inertia_kg_m2: f64,
    /// Of each drive, with the gear's ratio squared.
    rotor_inertia_at_pulley_kg_m2: Vec<f64>,
    gear_ratio: Vec<f64>,
    /// Mass of each body that slides.
    #[serde(flatten)]
    masses: Map<String, Value>,
    /// By span, with what slides at zero.
    span_stiffness_newton_per_m: Map<String, Value>,
    spans_follow: bool,
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
    metrics: Value,
    /// None for the elastic model.
    #[serde(skip_serializing_if = "Option::is_none")]
    reduction: Option<ReductionTold>,
    /// With --draws.
    #[serde(skip_serializing_if = "Option::is_none")]
    band: Option<Band>,
    /// Where the experiment has a log.
    #[serde(skip_serializing_if = "Option::is_none")]
    log: Option<Value>,
    /// By how much positions at the belt may be off.
    position_error_m: Option<f64>,
    position_error_basis: Option<&'static str>,
    /// True if numbers of 64 bits determine the motion to a thousandth of itself.
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
        let mechanism = case.machine.mechanism();
        Self {
            schema: super::identity("simulate"),
            title: case.title.clone(),
            version: env!("CARGO_PKG_VERSION"),
            kind: case.machine.kind.word(),
            solver: SolverUsed::new(solver),
            machine: MachineFigures::new(&case.machine),
            stage: case.is_axis().then(|| StageFigures::new(&case.machine)),
            experiments: runs
                .iter()
                .map(|run| ExperimentFigures::new(run, (&case.machine, &mechanism), solver))
                .collect(),
        }
    }
}

impl SolverUsed {
    pub(super) fn new(solver: Solver) -> Self {
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

impl MachineFigures {
    fn new(machine: &Machine) -> Self {
        let of_motors = |number: fn(&Motor) -> f64| machine.drives.iter().map(|unit| number(&unit.motor)).collect();
        let geometry = machine.geometry();
        let mass = |(at, slide): (&crate::machine::SlideAt, &crate::machine::Slide)| {
            (format!("{}_mass_kg", geometry.label(at.body).key), json!(slide.mass))
        };
        let stiffness = machine.belt.stiffness.iter().map(|k| super::number(*k));
        Self {
            pulley_radius_m: machine.pulley_radius,
            drive_pulley_inertia_kg_m2: machine.drive_pulley.inertia,
            rotor_inertia_at_pulley_kg_m2: of_motors(|motor| motor.gear_ratio.powi(2) * motor.rotor_inertia),
            gear_ratio: of_motors(|motor| motor.gear_ratio),
            masses: geometry.slides.iter().zip(machine.slides()).map(mass).collect(),
            span_stiffness_newton_per_m: geometry
                .span_labels()
                .map(|span| span.key.to_string())
                .zip(stiffness)
                .collect(),
            spans_follow: machine.belt.follows_cart,
        }
    }
}

impl StageFigures {
    fn new(machine: &Machine) -> Self {
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
    fn new(run: &Simulated, (machine, mechanism): (&Machine, &Mechanism), solver: Solver) -> Self {
        let (metrics, outcome) = (run.metrics, run.outcome);
        Self {
            name: run.experiment.name.clone(),
            files: run.files.to_vec(),
            ending: EndingTold::new(outcome, metrics.end),
            metrics: figures(metrics, machine),
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
            decided_within_rounding: TieTold::from_outcome(outcome),
            events: outcome.events.iter().take(MOST_EVENTS).map(|event| Event::on(mechanism, event)).collect(),
            events_not_listed: outcome.events.len().saturating_sub(MOST_EVENTS),
            cost: CostTold::new(outcome),
        }
    }
}

impl EndingTold {
    /// `end` is when it was, s, where nothing ended it early.
    pub(super) fn new(outcome: &Outcome, end: f64) -> Self {
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
    pub(super) fn from_outcome(outcome: &Outcome) -> Vec<Self> {
        outcome.ties.iter().map(|tie| Self { time_s: tie.time, part: tie.part.key() }).collect()
    }
}

/// True if errors leave the motion determined, where they are known.
pub(super) fn is_determined(outcome: &Outcome) -> Option<bool> {
    outcome.error.map(|error| !error.hides_motion())
}

/// The basis of the error of a run's positions.
pub(super) fn error_basis(outcome: &Outcome, solver: Solver) -> Option<&'static str> {
    outcome.error.map(|_| ErrorEstimate::basis(solver, false))
}

impl CostTold {
    pub(super) fn new(outcome: &Outcome) -> Self {
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
    pub(super) fn new(body: &'static str, count: metrics::EventCount) -> Self {
        Self { body, stops: count.stops, starts: count.starts, reversals: count.reversals }
    }
}

/// The key figures of a run of this machine: the rows of [`FIGURES`](metrics::FIGURES), each under its key by role and,
/// where an axis has another name for it, under that one, too.
pub fn figures(metrics: &Metrics, machine: &Machine) -> Value {
    let geometry = machine.geometry();
    let mut told = Map::new();
    told.insert("end_time_s".into(), json!(metrics.end));
    for figure in metrics::figures(machine.kind, Extras::new(machine)) {
        let value = match figure.value(metrics) {
            Worth::Number(_) if figure.row.seek == Some(Seek::SteadySpeed) => {
                let steady =
                    metrics.steady_speed.map(|steady| SteadyTold::new(steady, machine.drives[0].amplifier.mode));
                json!(steady)
            }
            Worth::Number(value) => super::number(value),
            Worth::Peak(peak) => super::peak(peak),
            Worth::Flag(flag) => json!(flag),
            Worth::TimeOfPeak(_) => continue,
        };
        match key(&figure) {
            Key::Whole(keys) => keys.into_iter().for_each(|key| {
                told.insert(key, value.clone());
            }),
            Key::OfSpan(key) => {
                let spans = told.entry(key).or_insert_with(|| json!({}));
                spans[geometry.spans[figure.place].label.key] = value;
            }
            Key::OfBody => {}
        }
    }
    let counts =
        geometry.bodies.iter().zip(&metrics.bodies).map(|(body, count)| CountTold::new(body.label.key, *count));
    told.insert("event_counts".into(), json!(counts.collect::<Vec<_>>()));
    Value::Object(told)
}

/// Where a result holds a figure.
enum Key {
    /// Under these keys.
    Whole(Vec<String>),
    /// Under this key, in a map by spans.
    OfSpan(String),
    /// Among the counts of events.
    OfBody,
}

fn key(figure: &Figure) -> Key {
    let of = |name: &str| match figure.row.seek {
        Some(Seek::SteadySpeed) => name.to_string(),
        _ => format!("{name}{}", unit_key(figure.unit)),
    };
    match figure.row.role {
        Role::Body => Key::OfBody,
        Role::Span => Key::OfSpan(of(&figure.row.name.replace('*', "span"))),
        _ if figure.name == figure.by_role => Key::Whole(vec![of(&figure.name)]),
        _ => Key::Whole(vec![of(&figure.by_role), of(&figure.name)]),
    }
}

/// A unit as the end of a key.
fn unit_key(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!("_{}", unit.replace('/', "_")) }
}

/// The lines of the table of a schema that stand for the key figures: path below the metrics, type and meaning.
pub(super) fn figure_lines() -> Vec<[String; 3]> {
    let mut lines: Vec<[String; 3]> = Vec::new();
    let mut add = |path: String, kind: &str, words: &str| {
        if lines.iter().all(|line| line[0] != path) {
            lines.push([path, kind.into(), words.into()]);
        }
    };
    let machine = |kind: MachineKind| {
        let drives = kind.geometry().drives.len();
        let extras = Extras { stepper: drives <= STEPPERS, yaw: drives > 1 };
        [(kind, Extras::default()), (kind, extras)]
    };
    let machines: Vec<(MachineKind, Extras)> = MachineKind::ALL.into_iter().flat_map(machine).collect();
    // Of more parts than any machine has.
    let nothing = Metrics {
        loads: vec![OfLoad::default(); 8],
        drives: vec![OfDrive::default(); 8],
        spans: vec![OfSpan::default(); 8],
        bodies: vec![EventCount::default(); 8],
        ..Metrics::default()
    };
    for figure in machines.iter().flat_map(|&(kind, extras)| metrics::figures(kind, extras)) {
        let has = |(kind, extras): &(MachineKind, Extras), name: &str| {
            metrics::figures(*kind, *extras).iter().any(|one| one.by_role == name || one.name == name)
        };
        let of_all = |name: &str| machines.iter().all(|machine| has(machine, name));
        let ends: &[(&str, &str)] = match figure.value(&nothing) {
            Worth::Number(_) if figure.row.seek == Some(Seek::SteadySpeed) => continue,
            Worth::TimeOfPeak(_) => continue,
            Worth::Number(_) if figure.row.seek == Some(Seek::StopTime) => &[("", "number?")],
            Worth::Number(_) => &[("", "number")],
            Worth::Peak(_) => &[(".value", "number"), (".time_s", "number")],
            Worth::Flag(_) => &[("", "flag")],
        };
        let words = figure.words.replace(figure.part, "*");
        let words = if figure.row.role == Role::Span { figure.row.words.replace('*', "each span") } else { words };
        let keys = match key(&figure) {
            Key::Whole(keys) => {
                let bare = |key: &str| key.trim_end_matches(&unit_key(figure.unit)).to_string();
                keys.into_iter().map(|key| if of_all(&bare(&key)) { key } else { format!("{key}?") }).collect()
            }
            Key::OfSpan(key) => vec![format!("{key}.*")],
            Key::OfBody => continue,
        };
        for key in keys {
            for (end, kind) in ends {
                add(format!("{key}{end}"), kind, &words);
            }
        }
    }
    lines
}

impl From<Peak> for PeakTold {
    fn from(peak: Peak) -> Self {
        Self { value: peak.value, time_s: peak.time }
    }
}

impl SteadyTold {
    fn new(steady: SteadySpeed, mode: AmplifierMode) -> Self {
        Self {
            cart_speed_m_s: steady.value,
            change_m_s: steady.change,
            reached: steady.reached,
            analytic_m_s: steady.analytic.speed(),
            input: steady.input,
            input_unit: mode.unit(),
            from_s: steady.stretch.0,
            to_s: steady.stretch.1,
        }
    }
}

impl Event {
    /// As the solver found it on an axis.
    pub fn new(event: &solve::Event) -> Self {
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
