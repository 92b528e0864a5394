//! A simulation of a gantry: `taut simulate --json`, `summary.json`.

use super::simulation::{
    CostTold, CountTold, EndingTold, Event, MOST_EVENTS, PeakTold, SolverUsed, TieTold, error_basis, is_determined,
};
use crate::case::{Case, Experiment};
use crate::machine::{Kind, Machine, Motor};
use crate::mechanism::Mechanism;
use crate::metrics::{GantryMetrics, Peak};
use crate::solve::{Outcome, Solver};
use serde::Serialize;
use serde_json::{Map, Value};

/// One experiment after it ran.
#[derive(Debug, Clone, Copy)]
pub struct GantrySimulated<'a> {
    /// The experiment as the case has it.
    pub experiment: &'a Experiment,
    /// Events, ending and cost.
    pub outcome: &'a Outcome,
    /// Its key figures.
    pub metrics: &'a GantryMetrics,
    /// Its files.
    pub files: &'a [String],
}

/// The whole summary.
#[derive(Debug, Serialize)]
pub struct GantrySimulation {
    schema: String,
    title: String,
    version: &'static str,
    kind: &'static str,
    solver: SolverUsed,
    machine: MachineFigures,
    experiments: Vec<ExperimentFigures>,
}

#[derive(Debug, Serialize)]
struct MachineFigures {
    pulley_radius_m: f64,
    drive_pulley_inertia_kg_m2: f64,
    /// Left and right, with the gear's ratio squared.
    rotor_inertia_at_pulley_kg_m2: Vec<f64>,
    gear_ratio: Vec<f64>,
    bridge_mass_kg: f64,
    cart_mass_kg: f64,
    /// By span, with bridge and cart at zero.
    span_stiffness_newton_per_m: Map<String, Value>,
    spans_follow: bool,
}

#[derive(Debug, Serialize)]
struct ExperimentFigures {
    name: String,
    files: Vec<String>,
    ending: EndingTold,
    metrics: MetricsTold,
    /// By how much positions at the belt may be off.
    position_error_m: Option<f64>,
    position_error_basis: Option<&'static str>,
    is_determined: Option<bool>,
    decided_within_rounding: Vec<TieTold>,
    events: Vec<Event>,
    events_not_listed: usize,
    cost: CostTold,
}

#[derive(Debug, Serialize)]
struct MetricsTold {
    end_time_s: f64,
    final_bridge_position_m: f64,
    final_cart_position_m: f64,
    final_bridge_speed_m_s: f64,
    final_cart_speed_m_s: f64,
    final_bridge_by_drives_m: f64,
    final_cart_by_drives_m: f64,
    peak_bridge_speed_m_s: PeakTold,
    peak_cart_speed_m_s: PeakTold,
    #[serde(rename = "peak_left_current_A")]
    left_current: PeakTold,
    #[serde(rename = "peak_right_current_A")]
    right_current: PeakTold,
    #[serde(rename = "peak_left_speed_rad_s")]
    left_speed: PeakTold,
    #[serde(rename = "peak_right_speed_rad_s")]
    right_speed: PeakTold,
    peak_drives_minus_bridge_m: PeakTold,
    peak_drives_minus_cart_m: PeakTold,
    #[serde(rename = "peak_span_stretch_m")]
    stretch: Map<String, Value>,
    #[serde(rename = "peak_span_force_N")]
    force: Map<String, Value>,
    stop_time_s: Option<f64>,
    settled: bool,
    event_counts: Vec<CountTold>,
}

/// The key figures of one run.
pub fn gantry_metrics(metrics: &GantryMetrics, kind: Kind) -> Value {
    serde_json::to_value(MetricsTold::of(metrics, kind)).unwrap_or_default()
}

impl GantrySimulation {
    /// Of the runs of a case.
    pub fn new(case: &Case, solver: Solver, runs: &[GantrySimulated]) -> Self {
        let mechanism = case.machine.mechanism();
        let kind = case.machine.kind;
        Self {
            schema: super::identity("gantry-simulate"),
            title: case.title.clone(),
            version: env!("CARGO_PKG_VERSION"),
            kind: kind.word(),
            solver: SolverUsed::of(solver),
            machine: MachineFigures::of(&case.machine),
            experiments: runs.iter().map(|run| ExperimentFigures::of(run, &mechanism, kind, solver)).collect(),
        }
    }
}

impl MachineFigures {
    fn of(gantry: &Machine) -> Self {
        let of_motors = |number: fn(&Motor) -> f64| gantry.drives.iter().map(|unit| number(&unit.motor)).collect();
        let stiffness = gantry.belt.stiffness.iter().map(|k| super::number(*k));
        Self {
            pulley_radius_m: gantry.pulley_radius,
            drive_pulley_inertia_kg_m2: gantry.drive_pulley.inertia,
            rotor_inertia_at_pulley_kg_m2: of_motors(|motor| motor.gear_ratio.powi(2) * motor.rotor_inertia),
            gear_ratio: of_motors(|motor| motor.gear_ratio),
            bridge_mass_kg: gantry.first_slide().mass,
            cart_mass_kg: gantry.cart.mass,
            span_stiffness_newton_per_m: by_span(gantry.kind, stiffness),
            spans_follow: gantry.belt.follows_cart,
        }
    }
}

impl ExperimentFigures {
    fn of(run: &GantrySimulated, mechanism: &Mechanism, kind: Kind, solver: Solver) -> Self {
        let outcome = run.outcome;
        Self {
            name: run.experiment.name.clone(),
            files: run.files.to_vec(),
            ending: EndingTold::of(outcome, run.metrics.end),
            metrics: MetricsTold::of(run.metrics, kind),
            position_error_m: outcome.error.map(|error| error.value),
            position_error_basis: error_basis(outcome, solver),
            is_determined: is_determined(outcome),
            decided_within_rounding: TieTold::of(outcome),
            events: outcome.events.iter().take(MOST_EVENTS).map(|event| Event::on(mechanism, event)).collect(),
            events_not_listed: outcome.events.len().saturating_sub(MOST_EVENTS),
            cost: CostTold::of(outcome),
        }
    }
}

impl MetricsTold {
    fn of(metrics: &GantryMetrics, kind: Kind) -> Self {
        let [bridge, cart] = metrics.final_position;
        let [bridge_speed, cart_speed] = metrics.final_speed;
        let [bridge_by_drives, cart_by_drives] = metrics.final_by_drives;
        let [peak_bridge_speed, peak_cart_speed] = metrics.peak_speed.map(PeakTold::from);
        let [bridge_error, cart_error] = metrics.peak_error.map(PeakTold::from);
        let [left_speed, right_speed] = metrics.peak_drive_speed.map(PeakTold::from);
        let peaks = |peaks: &[Peak]| by_span(kind, peaks.iter().map(|peak| super::peak(*peak)));
        let [left_current, right_current] = metrics.peak_current.map(PeakTold::from);
        Self {
            end_time_s: metrics.end,
            final_bridge_position_m: bridge,
            final_cart_position_m: cart,
            final_bridge_speed_m_s: bridge_speed,
            final_cart_speed_m_s: cart_speed,
            final_bridge_by_drives_m: bridge_by_drives,
            final_cart_by_drives_m: cart_by_drives,
            peak_bridge_speed_m_s: peak_bridge_speed,
            peak_cart_speed_m_s: peak_cart_speed,
            left_current,
            right_current,
            left_speed,
            right_speed,
            peak_drives_minus_bridge_m: bridge_error,
            peak_drives_minus_cart_m: cart_error,
            stretch: peaks(&metrics.peak_stretch),
            force: peaks(&metrics.peak_force),
            stop_time_s: metrics.stop_time,
            settled: metrics.settled,
            event_counts: kind
                .geometry()
                .bodies
                .iter()
                .zip(metrics.events)
                .map(|(body, count)| CountTold::of(body.label.key, count))
                .collect(),
        }
    }
}

/// Values of the spans by their keys.
fn by_span(kind: Kind, values: impl Iterator<Item = Value>) -> Map<String, Value> {
    kind.geometry().span_labels().map(|span| span.key.to_string()).zip(values).collect()
}
