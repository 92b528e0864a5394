//! A run in words: rows of a name and a value, for page and terminal alike.

use super::SimulatedExperiment;
use super::band::Band;
use crate::fit::outputs;
use taut::machine::{BeltModel, DriveAt, Geometry, Machine, Slide, SlideAt};
use taut::mechanism::Part;
use taut::metrics::{Balance, LostSteps, Metrics, OfLoad, Peak};
use taut::number;
use taut::reduction::Reduction;
use taut::solve::{Cost, Ending, ErrorEstimate, Event, Method, Outcome, PositionError, Solver, Tie};

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

/// How a run of this machine ended that did not reach its end.
pub fn early_end(run: &SimulatedExperiment, machine: &Machine) -> Option<String> {
    // Whichever is nearest to an end of its travel, or beyond.
    let left = |(slide, load): &(&Slide, &OfLoad)| {
        slide.travel.map_or(f64::INFINITY, |travel| (load.position - travel.min).min(travel.max - load.position))
    };
    let loads = machine.slides().zip(&run.metrics.loads).map(|pair| left(&pair));
    let nearest = loads.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(place, _)| place);
    let geometry = machine.geometry();
    ended_early(&run.outcome.ending, geometry.label(geometry.slides[nearest].body).name)
}

/// Sentence on an early end; `load` is the body that leaves its travel.
pub fn ended_early(ending: &Ending, load: &str) -> Option<String> {
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
            Some(format!("ended at {}: the {load} leaves its travel there, and nothing stops it", time(at)))
        }
        Ending::Interrupted { time: at } => Some(format!("was interrupted at {}", time(at))),
    }
}

/// Lengths (m), speeds (m/s), forces (N) and currents (A) up to these are shown as nothing: less than rounding makes of
/// a symmetric motion.
const LEAST: f64 = 1e-13;
const LEAST_FORCE: f64 = 1e-9;

/// A machine in a line.
pub fn machine(machine: &Machine) -> String {
    let short = |value: f64, unit: &str| number::engineering_typed(value, unit, 4);
    let stiffness: Vec<String> = machine.belt.stiffness.iter().map(|k| short(*k, "N/m")).collect();
    let parts = machine.geometry().slides.iter().zip(machine.slides());
    let parts =
        parts.map(|(at, slide)| format!("{} {}", machine.geometry().label(at.body).name, short(slide.mass, "kg")));
    let follow = match (machine.belt.follows_cart, machine.bridge.is_some()) {
        (false, _) => "",
        (true, false) => " at x = 0, following the cart",
        (true, true) => " at x = y = 0, following bridge and cart",
    };
    format!(
        "{}, {}: {}, r = {}, spans {}{follow}",
        machine.kind.name(),
        machine.geometry().belts,
        parts.collect::<Vec<_>>().join(", "),
        short(machine.pulley_radius, "m"),
        stiffness.join(", "),
    )
}

/// Words for a peak: its value, and when that was.
fn at(peak: Peak, unit: &str, text: String) -> String {
    let least = if unit == "N" { LEAST_FORCE } else { LEAST };
    match peak.value.abs() <= least {
        true => format!("0 {unit}"),
        false => format!("{text} at {}", time(peak.time)),
    }
}

/// The key figures of a run of this machine with their names.
pub fn lines(run: &SimulatedExperiment, machine: &Machine, solver: Solver) -> Vec<(&'static str, String)> {
    let (metrics, geometry) = (&run.metrics, machine.geometry());
    let one_drive = metrics.drives.len() == 1;
    let labels: Vec<&str> = geometry.slides.iter().map(|slide| geometry.label(slide.body).name).collect();
    let of_loads = |words: &dyn Fn(&OfLoad) -> String| {
        let each = labels.iter().zip(&metrics.loads).map(|(name, load)| format!("{name} {}", words(load)));
        each.collect::<Vec<_>>().join(", ")
    };
    let place = |metres: f64| travel(if metres.abs() <= LEAST { 0.0 } else { metres });
    let stiff = machine.belt.model == BeltModel::Rigid;
    let mut lines = Vec::new();
    let positions = of_loads(&|load| place(load.position));
    if one_drive {
        lines.push(("final position", format!("{positions}, r φ₁ {}", place(metrics.cart().by_drives))));
        lines.push(("steady speed", steady(metrics)));
    } else {
        lines.push(("final position", positions));
        lines.push(("by the drives", of_loads(&|load| place(load.by_drives))));
    }
    lines.push(("peak speed", of_loads(&|load| at(load.peak_speed, "m/s", speed(load.peak_speed.value)))));
    if !stiff {
        // Nothing stretches in a rigid belt.
        let (span, stretch) = metrics.largest_stretch();
        let name = geometry.spans[span].label.name;
        lines.push(("peak stretch", at(stretch, "m", format!("{} in {name}", value(stretch.value, "m")))));
        lines.push(("peak force", forces(metrics, geometry)));
    }
    if let Some(yaw) = metrics.yaw {
        let end = value(yaw.angle, "rad");
        lines.push((
            "yaw",
            format!("{}, {end} at the end", at(yaw.peak, "rad", format!("at most {}", value(yaw.peak.value, "rad")))),
        ));
    }
    lines.push(("peak current", currents(metrics, geometry)));
    lines.extend(lost_steps(metrics, geometry).map(|words| ("lost steps", words)));
    lines.push(("stop time", stop(metrics, &labels, solver)));
    lines.push(("events", events(&run.outcome.events, solver)));
    if !stiff {
        lines.push((if one_drive { "r φ₁ - x" } else { "drives' error" }, errors(metrics, &labels)));
    }
    if !matches!(solver, Solver::Table3 { .. }) {
        lines.push(("accuracy", accuracy(&run.outcome, ErrorEstimate::basis(solver, false))));
    }
    if let Some(log) = &run.log {
        lines.push(("against its log", outputs(log)));
    }
    if let Some(band) = &run.band {
        lines.push(("band", band_words(band)));
    }
    if let Some(reduction) = run.reduction {
        lines.push(("reduced model", reduced(&reduction)));
    }
    lines.push(("cost", cost(run.outcome.cost)));
    lines
}

/// Steps that steppers lost, and the position error that remains; none of other motors.
pub fn lost_steps(metrics: &Metrics, geometry: &Geometry) -> Option<String> {
    let lost: Vec<LostSteps> = metrics.drives.iter().filter_map(|drive| drive.lost_steps).collect();
    let of_drive = |(own, at): (&LostSteps, &DriveAt)| {
        let first = own.first_slip?;
        let by = if lost.len() > 1 { format!(" by the {}", at.label.name) } else { String::new() };
        let slips = if own.slips == 1 { "slip" } else { "slips" };
        Some(format!("{}{by} at the end, in {} {slips} of 4, first at {}", own.at_end, own.slips, value(first, "s")))
    };
    let slipped: Vec<String> = lost.iter().zip(geometry.drives).filter_map(of_drive).collect();
    let of_load = |(load, at): (&OfLoad, &SlideAt)| {
        let error = value(load.command_error?, "m");
        let name = if metrics.loads.len() > 1 { format!("{} ", geometry.label(at.body).name) } else { String::new() };
        Some(format!("{name}{error}"))
    };
    let errors: Vec<String> = metrics.loads.iter().zip(geometry.slides).filter_map(of_load).collect();
    let steps = if slipped.is_empty() { "none".to_string() } else { slipped.join(", ") };
    (!lost.is_empty()).then(|| format!("{steps}; position error {}", errors.join(", ")))
}

/// The largest force of a machine with one drive; that of each span of one with several.
fn forces(metrics: &Metrics, geometry: &Geometry) -> String {
    if metrics.drives.len() == 1 {
        let (span, force) = metrics.largest_force();
        return at(force, "N", format!("{} in {}", value(force.value, "N"), geometry.spans[span].label.name));
    }
    let each = geometry.span_labels().zip(&metrics.spans).map(|(span, of)| {
        let words = at(of.peak_force, "N", value(of.peak_force.value, "N"));
        format!("{} {words}", span.name.trim_end_matches(" span"))
    });
    each.collect::<Vec<_>>().join(", ")
}

fn currents(metrics: &Metrics, geometry: &Geometry) -> String {
    let words = |peak: Peak| at(peak, "A", value(peak.value, "A"));
    if let [only] = &metrics.drives[..] {
        return words(only.peak_current);
    }
    let each = geometry
        .drives
        .iter()
        .zip(&metrics.drives)
        .map(|(at, drive)| format!("{} {}", at.label.name.trim_end_matches(" drive"), words(drive.peak_current)));
    each.collect::<Vec<_>>().join(", ")
}

/// How far the drives are off what slides.
fn errors(metrics: &Metrics, labels: &[&str]) -> String {
    let words = |load: &OfLoad| {
        let left = load.by_drives - load.position;
        let left = if left.abs() <= LEAST { 0.0 } else { left };
        let most = at(load.peak_error, "m", value(load.peak_error.value, "m"));
        format!("at most {most}, {} at the end", value(left, "m"))
    };
    if let [only] = &metrics.loads[..] {
        return words(only);
    }
    labels
        .iter()
        .zip(&metrics.loads)
        .map(|(name, load)| format!("{name} {}", words(load)))
        .collect::<Vec<_>>()
        .join("; ")
}

/// By how much positions may be off; `basis` is what that is based on.
pub fn accuracy(outcome: &Outcome, basis: &str) -> String {
    let Some(error) = outcome.error else { return "not estimated".into() };
    let rounded = number::engineering_typed(error.value, "m", 2);
    let positions = match basis {
        _ if error.is_undetermined() => "not determined: errors of rounding grow to more than the motion".into(),
        _ if basis.starts_with("bound") => format!("positions within {rounded}, by a {basis}"),
        _ => format!("positions within some {rounded}, by {basis}"),
    };
    positions + &ties(&outcome.ties)
}

/// Ties that are named on the terminal.
const TIES: usize = 3;

/// When what a body does was decided within rounding.
fn ties(ties: &[Tie]) -> String {
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

/// The yaw of a bridge from which on its equations, of first order in it, are too coarse, rad: its square is then a
/// hundredth.
const LARGE_YAW: f64 = 0.1;

/// The word for a run whose bridge yaws beyond its model.
pub fn yawed(name: &str, metrics: &Metrics) -> Option<String> {
    let peak = metrics.yaw.map(|yaw| yaw.peak.value.abs()).filter(|peak| *peak > LARGE_YAW)?;
    let [peak, most] = [peak, LARGE_YAW].map(|angle| value(angle, "rad"));
    Some(format!(
        "the run \"{name}\" is not to be relied on: the bridge yaws by up to {peak}, and its equations are for less than \
         {most}; check the stiffness and damping of its bearings"
    ))
}

/// The word for a result of a "run" or a "move" of this machine that its error hides.
pub fn hidden(what: &str, name: &str, machine: &Machine, outcome: &Outcome) -> Option<String> {
    let error = outcome.error.filter(|error| error.hides_motion())?;
    // Errors that have grown beyond the motion itself are no lengths any more.
    let off = match error.is_undetermined() {
        true => format!(
            "numbers of 64 bits do not determine the positions of the {what} \"{name}\", which moves by {}",
            value(error.way, "m")
        ),
        false => {
            let [off, way] = [error.value, error.way].map(|length| value(length, "m"));
            format!("positions of the {what} \"{name}\" may be wrong by {off}, and its motion is at most {way}")
        }
    };
    let next = match machine.rattles() {
        true => "the flanks of a gear without gear_damping rattle, which amplifies rounding: give it one",
        false => "shorten the run, or leave out what is so stiff or feeds the motion",
    };
    Some(format!("{off}: this result is not to be relied on; {next}"))
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

fn stop(metrics: &Metrics, labels: &[&str], solver: Solver) -> String {
    let speeds = || {
        let each = labels.iter().zip(&metrics.loads).map(|(name, load)| format!("{name} at {}", speed(load.speed)));
        each.collect::<Vec<_>>().join(", ")
    };
    match metrics.stop_time {
        Some(0.0) if metrics.bodies.iter().all(|count| count.total() == 0) => "nothing moved".into(),
        Some(at) => time(at),
        None if matches!(solver, Solver::Table3 { .. }) => {
            format!("none: Table 3 freezes speeds and creeps on, {}", speeds())
        }
        None if metrics.bodies_rest => {
            let fastest =
                metrics.drives.iter().map(|drive| drive.shaft_speed).max_by(|a, b| a.abs().total_cmp(&b.abs()));
            format!("the rotor still turns at the end, at {}", value(fastest.unwrap_or_default(), "rad/s"))
        }
        None if metrics.is_still() => "it does not move at the end, and no friction holds it".into(),
        None => format!("still moving at the end, {}", speeds()),
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
