//! The summary for people: a small table for each experiment.

use super::folder::Folder;
use super::run::Run;
use crate::terminal::bold;
use std::fmt::Write;
use std::time::Duration;
use taut::case::Case;
use taut::metrics::{Metrics, largest};
use taut::number;
use taut::plant::Body;
use taut::solve::{Ending, Method, Solver};

/// The text on the terminal.
pub fn text(case: &Case, solver: Solver, runs: &[Run], folder: Option<&Folder>) -> String {
    let mut text = format!("{}\n{}\n", bold(&case.title), solver_words(solver));
    for run in runs {
        let _ = write!(text, "\n{}\n", bold(&run.experiment.name));
        if let Some(told) = early_end(&run.outcome.ending) {
            let _ = writeln!(text, "  {:<16}{told}", "ended early");
        }
        for (name, value) in lines(run, solver) {
            let _ = writeln!(text, "  {name:<16}{value}");
        }
    }
    text.push('\n');
    match folder {
        Some(folder) => text.push_str(&written(folder, runs)),
        None => text.push_str("nothing was written: add --out DIR for files and a report\n"),
    }
    text
}

/// A value with its unit for people, spaces and signs as a terminal and `grep` like them.
pub fn value(value: f64, unit: &str) -> String {
    number::engineering(value, unit, 5).replace(['\u{a0}', '\u{202f}'], " ").replace('−', "-")
}

/// How a run ended that did not reach its end.
pub fn early_end(ending: &Ending) -> Option<String> {
    match *ending {
        Ending::Complete => None,
        Ending::TooManyEvents { time } => Some(format!(
            "ended at {}: bodies stick and slip without end there, more often than a machine does",
            value(time, "s")
        )),
        Ending::Diverged { time } => {
            Some(format!("ended at {}: its state is no number any more; a smaller --step may help", value(time, "s")))
        }
        Ending::Interrupted { time } => Some(format!("was interrupted at {}", value(time, "s"))),
    }
}

/// The key figures of a run with their names.
pub fn lines(run: &Run, solver: Solver) -> Vec<(&'static str, String)> {
    let metrics = &run.metrics;
    let (span, stretch) = largest(&metrics.peak_stretch);
    let (force_span, force) = largest(&metrics.peak_force);
    let error = metrics.peak_encoder_error;
    let left = metrics.final_drive_travel - metrics.final_cart_position;
    vec![
        (
            "final position",
            format!("cart {}, r φ₁ {}", value(metrics.final_cart_position, "m"), value(metrics.final_drive_travel, "m")),
        ),
        ("steady speed", steady(metrics)),
        (
            "peak speed",
            format!(
                "cart {} at {}",
                value(metrics.peak_cart_speed.value, "m/s"),
                value(metrics.peak_cart_speed.time, "s")
            ),
        ),
        ("peak stretch", format!("{} in span {span} at {}", value(stretch.value, "m"), value(stretch.time, "s"))),
        ("peak force", format!("{} in span {force_span} at {}", value(force.value, "N"), value(force.time, "s"))),
        (
            "peak current",
            format!("{} at {}", value(metrics.peak_current.value, "A"), value(metrics.peak_current.time, "s")),
        ),
        ("stop time", stop(metrics, solver)),
        ("events", events(metrics, solver)),
        (
            "r φ₁ - cart",
            format!("at most {} at {}, {} at the end", value(error.value, "m"), value(error.time, "s"), value(left, "m")),
        ),
        ("cost", cost(run)),
    ]
}

fn steady(metrics: &Metrics) -> String {
    let Some(steady) = metrics.steady_speed else {
        return "none: no constant input lasts 20 samples".into();
    };
    let balance = match steady.analytic {
        Some(speed) => format!("forces balance at {}", value(speed, "m/s")),
        None => "nothing limits the speed".into(),
    };
    if steady.reached {
        format!("{}; {balance}", value(steady.value, "m/s"))
    } else {
        let (speed, change) = (value(steady.value, "m/s"), value(steady.change, "m/s"));
        format!("not reached: {speed}, and {change} of it in the last tenth; {balance}")
    }
}

fn stop(metrics: &Metrics, solver: Solver) -> String {
    match metrics.stop_time {
        Some(0.0) if metrics.events.iter().all(|count| count.total() == 0) => "nothing moved".into(),
        Some(time) => value(time, "s"),
        None if matches!(solver, Solver::Table3 { .. }) => {
            format!("none: Table 3 freezes speeds and creeps on, cart at {}", value(metrics.final_cart_speed, "m/s"))
        }
        None => format!("still moving at the end, cart at {}", value(metrics.final_cart_speed, "m/s")),
    }
}

fn events(metrics: &Metrics, solver: Solver) -> String {
    if matches!(solver, Solver::Table3 { .. }) {
        return "none: a fixed step locates none".into();
    }
    let total: u64 = metrics.events.iter().map(|count| count.total()).sum();
    if total == 0 {
        return "none".into();
    }
    let each: Vec<String> = Body::ALL
        .iter()
        .map(|body| (body, metrics.events[body.index()].total()))
        .filter(|(_, count)| *count > 0)
        .map(|(body, count)| format!("{} {count}", body.name()))
        .collect();
    format!("{total}: {}", each.join(", "))
}

fn cost(run: &Run) -> String {
    let cost = run.outcome.cost;
    let work = match cost.evaluations {
        0 => format!("{} steps, {} modes", cost.steps, cost.modes),
        n => format!("{} steps, {n} evaluations", cost.steps),
    };
    format!("{} rows, {work}, {}", cost.samples, duration(run.took))
}

fn duration(took: Duration) -> String {
    let digits = number::engineering(took.as_secs_f64(), "s", 3);
    digits.replace('\u{a0}', " ")
}

fn solver_words(solver: Solver) -> String {
    match solver {
        Solver::Exact => "solved exactly".into(),
        Solver::Table3 { step, method } => {
            let method = match method {
                Method::RungeKutta4 => "Runge-Kutta 4",
                Method::DormandPrince5 => "Dormand-Prince 5",
            };
            format!("the paper's Table 3, {method}, step {}: a reproduction, not exact", value(step, "s"))
        }
    }
}

fn written(folder: &Folder, runs: &[Run]) -> String {
    let mut text = format!("wrote in {}:\n", folder.shown());
    for run in runs {
        let _ = writeln!(text, "  {}", run.files.join("  "));
    }
    text.push_str("  summary.json  case.toml");
    if runs.iter().any(|run| run.curves.is_some()) {
        text.push_str("  report.html  plots/");
    }
    text.push('\n');
    text
}
