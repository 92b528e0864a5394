//! A run in words: rows of a name and a value, for page and terminal alike.

use super::Run;
use super::band::Band;
use crate::fit::outputs;
use taut::machine::BeltModel;
use taut::mechanism::Part;
use taut::metrics::{Balance, Metrics, largest};
use taut::number;
use taut::reduction::Reduction;
use taut::solve::{Cost, Ending, Event, Method, Outcome, PositionError, Solver, Tie};

/// A value with its unit for people, spaces and signs as a terminal and `grep` like them.
pub fn value(value: f64, unit: &str) -> String {
    number::engineering_typed(value, unit, 5)
}

/// A number with so many decimals, and never `-0.00`.
pub fn plain(value: f64, decimals: usize) -> String {
    number::typed(&number::fixed(value, decimals))
}

/// A length of travel in mm, far ones in m.
pub fn travel(metres: f64) -> String {
    match metres.abs() {
        m if m < 1e-4 && m > 0.0 => value(metres, "m"),
        m if m < 10.0 => format!("{} mm", plain(metres * 1e3, 4)),
        _ => value(metres, "m"),
    }
}

/// A speed in mm/s, fast ones in m/s.
pub fn speed(metres_per_second: f64) -> String {
    match metres_per_second.abs() {
        v if v < 1e-3 && v > 0.0 => value(metres_per_second, "m/s"),
        v if v < 10.0 => format!("{} mm/s", plain(metres_per_second * 1e3, 2)),
        _ => value(metres_per_second, "m/s"),
    }
}

/// A time in ms, long ones in s.
pub fn time(seconds: f64) -> String {
    match seconds.abs() {
        s if s < 1e-3 && s > 0.0 => value(seconds, "s"),
        s if s < 1.0 => format!("{} ms", number::fixed(seconds * 1e3, 3).trim_end_matches('0').trim_end_matches('.')),
        _ => value(seconds, "s"),
    }
}

/// How a run ended that did not reach its end.
pub fn early_end(ending: &Ending) -> Option<String> {
    match *ending {
        Ending::Complete => None,
        Ending::TooManyEvents { time: at } => Some(format!(
            "ended at {}: sticks, slips and strikes pile up there, more often than a machine has them",
            time(at)
        )),
        Ending::Diverged { time: at } => Some(format!("ended at {}: its state has grown beyond all numbers", time(at))),
        Ending::TooStiff { time: at, steps } => Some(format!(
            "ended at {}: too stiff, it would need some {steps:.0e} steps; leave out what changes so fast \
             (an inductance, a light body, stiff friction), or shorten the run",
            time(at)
        )),
        Ending::LeftTravel { time: at } => {
            Some(format!("ended at {}: the cart leaves its travel there, and nothing stops it", time(at)))
        }
        Ending::Interrupted { time: at } => Some(format!("was interrupted at {}", time(at))),
    }
}

/// The key figures of a run with their names.
pub fn lines(run: &Run, solver: Solver) -> Vec<(&'static str, String)> {
    let metrics = &run.metrics;
    let (span, stretch) = largest(&metrics.peak_stretch);
    let (force_span, force) = largest(&metrics.peak_force);
    let error = metrics.peak_encoder_error;
    let left = metrics.final_drive_travel - metrics.final_cart_position;
    let mut lines = vec![
        (
            "final position",
            format!("cart {}, r φ₁ {}", travel(metrics.final_cart_position), travel(metrics.final_drive_travel)),
        ),
        ("steady speed", steady(metrics)),
        (
            "peak speed",
            format!("cart {} at {}", speed(metrics.peak_cart_speed.value), time(metrics.peak_cart_speed.time)),
        ),
        ("peak stretch", format!("{} in span {span} at {}", value(stretch.value, "m"), time(stretch.time))),
        ("peak force", format!("{} in span {force_span} at {}", value(force.value, "N"), time(force.time))),
        ("peak current", format!("{} at {}", value(metrics.peak_current.value, "A"), time(metrics.peak_current.time))),
        ("stop time", stop(metrics, solver)),
        ("events", events(&run.outcome.events, solver)),
        (
            "r φ₁ - x",
            format!("at most {} at {}, {} at the end", value(error.value, "m"), time(error.time), value(left, "m")),
        ),
        ("accuracy", accuracy(&run.outcome, solver)),
        ("cost", cost(run.outcome.cost)),
    ];
    if matches!(solver, Solver::Table3 { .. }) {
        lines.retain(|(name, _)| *name != "accuracy");
    }
    if run.model == BeltModel::Rigid {
        // Nothing stretches in it.
        lines.retain(|(name, _)| !["peak stretch", "peak force", "r φ₁ - x"].contains(name));
    }
    if let Some(log) = &run.log {
        lines.insert(lines.len() - 1, ("against its log", outputs(log)));
    }
    if let Some(band) = &run.band {
        lines.insert(lines.len() - 1, ("band", band_words(band)));
    }
    if let Some(reduction) = run.reduction {
        lines.insert(lines.len() - 1, ("reduced model", reduced(&reduction)));
    }
    lines
}

/// By how much positions may be off.
pub fn accuracy(outcome: &Outcome, solver: Solver) -> String {
    let Some(error) = outcome.error else { return "not estimated".into() };
    let rounded = number::engineering_typed(error.value, "m", 2);
    let positions = match solver {
        _ if error.is_undetermined() => "not determined: errors of rounding grow to more than the motion".into(),
        Solver::Exact => format!("positions within {rounded}, by a bound of rounding"),
        _ => format!("positions within some {rounded}, by a second run with a hundred times the tolerance"),
    };
    positions + &ties(&outcome.ties)
}

/// Ties that are named on the terminal.
const TIES: usize = 3;

/// When what a body does was decided within rounding.
pub(crate) fn ties(ties: &[Tie]) -> String {
    if ties.is_empty() {
        return String::new();
    }
    let each = ties.iter().take(TIES).map(|tie| format!("{} ({})", time(tie.time), tie.part.name()));
    let more = match ties.len().saturating_sub(TIES) {
        0 => String::new(),
        n => format!(" and {n} more times"),
    };
    format!("; decided within rounding at {}{more}", each.collect::<Vec<_>>().join(", "))
}

/// The word for a result that its error hides.
pub fn hidden(name: &str, outcome: &Outcome) -> Option<String> {
    let error = outcome.error.filter(|error| error.hides_motion())?;
    // Errors that have grown beyond the motion itself are no lengths any more.
    let off = match error.is_undetermined() {
        true => format!(
            "numbers of 64 bits do not determine the positions of the run \"{name}\", which moves by {}",
            value(error.way, "m")
        ),
        false => {
            let [off, way] = [error.value, error.way].map(|length| value(length, "m"));
            format!("positions of the run \"{name}\" may be off by {off}, and it moves by no more than {way}")
        }
    };
    Some(format!(
        "{off}: this result is not to be relied on; shorten the run, or leave out what is so stiff or feeds the motion"
    ))
}

/// Where the machines of --draws end.
fn band_words(band: &Band) -> String {
    let ([low, _, high], [left_low, _, left_high]) = (band.end(1), band.end(2));
    let failed = match band.failed {
        0 => String::new(),
        n => format!("; {n} more do not reach the end"),
    };
    format!(
        "95 % of {} machines end with the cart from {} to {}, r φ₁ - x from {} to {}{failed}",
        band.machines,
        travel(low),
        travel(high),
        value(left_low, "m"),
        value(left_high, "m"),
    )
}

/// How far a reduced model is from the elastic one.
fn reduced(reduction: &Reduction) -> String {
    format!(
        "cart at most {} from the elastic model's, at {}; {} at the end; the elastic model's r φ₁ - x is up to {}",
        value(reduction.cart.value.abs(), "m"),
        time(reduction.cart.time),
        value(reduction.final_cart, "m"),
        value(reduction.encoder_error.value.abs(), "m"),
    )
}

fn steady(metrics: &Metrics) -> String {
    let Some(steady) = metrics.steady_speed else {
        return "none: no constant input lasts a fiftieth of the run".into();
    };
    let balance = match steady.analytic {
        Balance::At(balance) => format!("forces balance at {}", speed(balance)),
        Balance::Never => "nothing limits the speed".into(),
        Balance::Changing => "no balance computed: it changes along the travel".into(),
    };
    if steady.reached {
        format!("{}; {balance}", speed(steady.value))
    } else {
        let (reached, change) = (speed(steady.value), speed(steady.change));
        format!("not reached: {reached} at the end, {change} of it in the last tenth; {balance}")
    }
}

fn stop(metrics: &Metrics, solver: Solver) -> String {
    match metrics.stop_time {
        Some(0.0) if metrics.events.iter().all(|count| count.total() == 0) => "nothing moved".into(),
        Some(at) => time(at),
        None if matches!(solver, Solver::Table3 { .. }) => {
            format!("none: Table 3 freezes speeds and creeps on, cart at {}", speed(metrics.final_cart_speed))
        }
        None if metrics.bodies_rest => {
            format!("the rotor still turns at the end, at {}", value(metrics.final_rotor_speed, "rad/s"))
        }
        None => format!("still moving at the end, cart at {}", speed(metrics.final_cart_speed)),
    }
}

/// How many there are, by part.
pub fn events(events: &[Event], solver: Solver) -> String {
    if matches!(solver, Solver::Table3 { .. }) {
        return "none: a fixed step locates none".into();
    }
    if events.is_empty() {
        return "none".into();
    }
    let mut counts: Vec<(Part, usize)> = Vec::new();
    for event in events {
        match counts.iter_mut().find(|(part, _)| *part == event.part) {
            Some((_, count)) => *count += 1,
            None => counts.push((event.part, 1)),
        }
    }
    counts.sort_by_key(|(part, _)| part.what);
    let each: Vec<String> = counts.iter().map(|(part, count)| format!("{} {count}", part.name())).collect();
    let by_rounding = match events.iter().filter(|event| event.by_rounding).count() {
        0 => String::new(),
        n => format!("; of {n} rounding decides when"),
    };
    format!("{}: {}{by_rounding}", events.len(), each.join(", "))
}

/// The cost of computing it.
pub fn cost(cost: Cost) -> String {
    let work = match cost.evaluations {
        0 if cost.modes == 1 => format!("{} steps, 1 mode", cost.steps),
        0 => format!("{} steps, {} modes", cost.steps, cost.modes),
        n => format!("{} steps, {n} evaluations", cost.steps),
    };
    format!("{} rows, {work}", cost.samples)
}

/// How it was solved.
pub fn solver_words<'a>(solver: Solver, mut outcomes: impl Iterator<Item = &'a Outcome>) -> String {
    match solver {
        Solver::Exact if outcomes.all(|outcome| outcome.error.is_some_and(PositionError::is_exact)) => {
            "solved exactly".into()
        }
        Solver::Exact => "solved with matrix exponentials; rounding shows, see the accuracy".into(),
        Solver::General { tolerance } => format!("the general solver, tolerance {tolerance:e}"),
        Solver::Table3 { step, method } => {
            let method = match method {
                Method::RungeKutta4 => "Runge-Kutta 4",
                Method::DormandPrince5 => "Dormand-Prince 5",
            };
            format!("the paper's Table 3, {method}, step {}: a reproduction, not exact", value(step, "s"))
        }
    }
}
