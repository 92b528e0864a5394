//! Model and log side by side.

use taut::fit::{LogFit, OutputFit};
use taut::report::{Axis, Figure, Panel, Series, Style};

/// Logs drawn; the numbers of the rest are in the tables.
pub const MOST_LOGS: usize = 12;

/// A quantity's axis, in a unit that suits it.
fn axis(output: &OutputFit, label: &str) -> Axis {
    let unit = output.quantity.unit();
    match unit {
        "m" => Axis::new(label, unit).shown_as("mm", 1e3),
        "m/s" => Axis::new(label, unit).shown_as("mm/s", 1e3),
        _ => Axis::new(label, unit),
    }
}

/// One output of a log: what was seen, what the model says, what is between them.
pub fn overlay(log: &LogFit, output: &OutputFit) -> Figure {
    let residual: Vec<f64> = output.model.iter().zip(&output.seen).map(|(model, seen)| model - seen).collect();
    let name = output.quantity.name().replace('_', " ");
    let mut figure = Figure::new(format!("{}: {name}", log.name), Axis::new("Time", "s"))
        .panel(
            Panel::new(axis(output, "Value"))
                .series(Series::new("log", log.time.clone(), output.seen.clone()).style(Style::Solid))
                .series(Series::new("model", log.time.clone(), output.model.clone()).style(Style::Dashed))
                .weight(2.0),
        )
        .panel(Panel::new(axis(output, "Model − log")).line("model − log", &log.time, &residual).horizontal(0.0, ""))
        .caption("Above log and model, below what is between them.");
    if log.fitted_rows > 0 && log.fitted_rows < log.time.len() {
        figure = figure.vertical(log.time[log.fitted_rows], "held out from here");
    }
    figure
}

/// How residuals remember: their correlation over lags.
pub fn memory(log: &LogFit, output: &OutputFit) -> Option<Figure> {
    let rows = if log.held_out { 0..output.seen.len() } else { 0..log.fitted_rows };
    let residual: Vec<f64> = rows.map(|k| output.model[k] - output.seen[k]).filter(|r| r.is_finite()).collect();
    let n = residual.len();
    let own: f64 = residual.iter().map(|r| r * r).sum();
    if n < 20 || own == 0.0 {
        return None;
    }
    let lags = (n / 4).min(400);
    let correlation: Vec<f64> =
        (0..=lags).map(|lag| residual.iter().zip(&residual[lag..]).map(|(a, b)| a * b).sum::<f64>() / own).collect();
    let interval = (log.time[log.time.len() - 1] - log.time[0]) / (log.time.len() - 1) as f64;
    let at: Vec<f64> = (0..=lags).map(|lag| lag as f64 * interval).collect();
    let chance = 1.96 / (n as f64).sqrt();
    Some(
        Figure::new(format!("{}: what residuals remember", log.name), Axis::new("Lag", "s"))
            .panel(
                Panel::new(Axis::new("Autocorrelation", ""))
                    .line("", &at, &correlation)
                    .horizontal(chance, "95 % of chance")
                    .horizontal(-chance, ""),
            )
            .caption("White noise stays between the two lines; what does not is left over by the model."),
    )
}
