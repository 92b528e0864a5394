//! A run in words: rows of a name and a value.

use super::Run;
use crate::simulate::rows::{self, accuracy, cost, events, speed, time, travel, value};
use taut::machine::{Kind, Machine};
use taut::metrics::{GantryMetrics, Peak};
use taut::number::engineering_typed;
use taut::solve::{Ending, Solver};

/// Lengths (m) and forces (N) up to these are shown as nothing: less than rounding makes of a symmetric motion.
const LEAST_LENGTH: f64 = 1e-13;
const LEAST_FORCE: f64 = 1e-9;

/// The machine in a line.
pub fn machine(gantry: &Machine) -> String {
    let belts = if gantry.kind == Kind::HFrame { "one belt round both drives" } else { "a belt for each drive" };
    let short = |value: f64, unit: &str| engineering_typed(value, unit, 4);
    let stiffness: Vec<String> = gantry.belt.stiffness.iter().map(|k| short(*k, "N/m")).collect();
    let follow = if gantry.belt.follows_cart { " at x = y = 0, following bridge and cart" } else { "" };
    format!(
        "{}, {belts}: bridge {}, cart {}, r = {}, spans {}{follow}",
        gantry.kind.name(),
        short(gantry.first_slide().mass, "kg"),
        short(gantry.cart.mass, "kg"),
        short(gantry.pulley_radius, "m"),
        stiffness.join(", "),
    )
}

/// How a run ended that did not reach its end.
pub fn early_end(run: &Run, gantry: &Machine) -> Option<String> {
    let Ending::LeftTravel { time: at } = run.outcome.ending else { return rows::early_end(&run.outcome.ending) };
    // Whichever is nearer to an end of its travel, or beyond.
    let [x, y] = run.metrics.final_position;
    let left = |position: f64, travel: Option<taut::machine::Travel>| {
        travel.map_or(f64::INFINITY, |travel| (position - travel.min).min(travel.max - position))
    };
    let which = if left(x, gantry.first_slide().travel) <= left(y, gantry.cart.travel) { "bridge" } else { "cart" };
    Some(format!("ended at {}: the {which} leaves its travel there, and nothing stops it", time(at)))
}

/// The key figures of a run with their names.
pub fn lines(run: &Run, gantry: &Machine, solver: Solver) -> Vec<(&'static str, String)> {
    let metrics = &run.metrics;
    let two = |[bridge, cart]: [String; 2]| format!("bridge {bridge}, cart {cart}");
    let sides = |[left, right]: [String; 2]| format!("left {left}, right {right}");
    // What rounding leaves of nothing is nothing.
    let none = |peak: Peak, unit: &str| peak.value.abs() <= if unit == "N" { LEAST_FORCE } else { LEAST_LENGTH };
    let at = |peak: Peak, unit: &str, text: String| match none(peak, unit) {
        true => format!("0 {unit}"),
        false => format!("{text} at {}", time(peak.time)),
    };
    let spans = gantry.kind.geometry().span_labels().zip(&metrics.peak_force).map(|(span, force)| {
        format!("{} {}", span.name.trim_end_matches(" span"), at(*force, "N", value(force.value, "N")))
    });
    let error = |k: usize| {
        let left = metrics.final_by_drives[k] - metrics.final_position[k];
        let left = if left.abs() <= LEAST_LENGTH { 0.0 } else { left };
        match metrics.peak_error[k] {
            most if none(most, "m") => "0 m".to_string(),
            most => format!("{}, {} at the end", at(most, "m", value(most.value, "m")), value(left, "m")),
        }
    };
    let place = |metres: f64| travel(if metres.abs() <= LEAST_LENGTH { 0.0 } else { metres });
    vec![
        ("final position", two(metrics.final_position.map(place))),
        ("by the drives", two(metrics.final_by_drives.map(place))),
        ("peak speed", two(metrics.peak_speed.map(|peak| at(peak, "m/s", speed(peak.value))))),
        ("peak current", sides(metrics.peak_current.map(|peak| at(peak, "A", value(peak.value, "A"))))),
        ("peak force", spans.collect::<Vec<_>>().join(", ")),
        ("drives' error", format!("bridge at most {}; cart at most {}", error(0), error(1))),
        ("stop time", stop(metrics)),
        ("events", events(&run.outcome.events, solver)),
        ("accuracy", accuracy(&run.outcome, solver)),
        ("cost", cost(run.outcome.cost)),
    ]
}

fn stop(metrics: &GantryMetrics) -> String {
    match metrics.stop_time {
        Some(0.0) if metrics.events.iter().all(|count| count.total() == 0) => "nothing moved".into(),
        Some(at) => time(at),
        None if metrics.bodies_rest => "a rotor still turns at the end".into(),
        None => {
            let [bridge, cart] = metrics.final_speed.map(speed);
            format!("still moving at the end, bridge at {bridge}, cart at {cart}")
        }
    }
}
