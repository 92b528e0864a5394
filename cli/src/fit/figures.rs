//! Model and log side by side.

use taut::fit::{Estimate, LogFit, OutputFit, Posterior, Profile};
use taut::log::Quantity;
use taut_report::{Axis, Colour, Figure, Panel, Series, Style};

/// Logs drawn; the numbers of the rest are in the tables.
pub const MOST_LOGS: usize = 12;

/// The logs that are drawn: those whose residuals are largest beside what the fit takes as their deviation, the worst first.
pub fn worst<'a>(logs: &'a [LogFit], noise: &[(Quantity, f64)]) -> Vec<&'a LogFit> {
    let mut logs: Vec<(f64, &LogFit)> = logs.iter().map(|log| (misfit(log, noise), log)).collect();
    logs.sort_by(|a, b| b.0.total_cmp(&a.0));
    logs.into_iter().take(MOST_LOGS).map(|(_, log)| log).collect()
}

/// The largest RMSE of a log's outputs, each over the deviation of its quantity; infinite where the model does not reach the end.
fn misfit(log: &LogFit, noise: &[(Quantity, f64)]) -> f64 {
    if !log.complete {
        return f64::INFINITY;
    }
    let relative = log.outputs.iter().flat_map(|output| {
        let deviation = noise.iter().find(|(quantity, _)| *quantity == output.quantity).map_or(1.0, |(_, d)| *d);
        [output.fitted, output.held_out].into_iter().flatten().map(move |score| score.rmse / deviation)
    });
    relative.filter(|value| !value.is_nan()).fold(0.0, f64::max)
}

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
                .series(
                    Series::new("model", log.time.clone(), output.model.clone())
                        .style(Style::Dashed)
                        .colour(Colour::Vermillion),
                )
                .weight(2.0),
        )
        .panel(Panel::new(axis(output, "Model − log")).line("model − log", &log.time, &residual).horizontal(0.0, ""))
        .caption("Above log and model, below what is between them.");
    if log.fitted_rows > 0 && log.fitted_rows < log.time.len() {
        figure = figure.vertical(log.time[log.fitted_rows], "held out from here");
    }
    figure
}

/// The autocorrelation of residuals over lags.
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
        Figure::new(format!("{}: autocorrelation of residuals", log.name), Axis::new("Lag", "s"))
            .panel(
                Panel::new(Axis::new("Autocorrelation", ""))
                    .line("", &at, &correlation)
                    .horizontal(chance, "95 % of chance")
                    .horizontal(-chance, ""),
            )
            .caption("White noise stays between the two lines; what does not is left over by the model."),
    )
}

/// How much worse the logs are met with a parameter held off its estimate.
pub fn profile(profile: &Profile) -> Figure {
    Figure::new(format!("{}: profile", profile.name), Axis::new(&profile.name, profile.unit))
        .panel(
            Panel::new(Axis::new("√ growth", "standard errors"))
                .series(Series::new("fitted anew", profile.values.clone(), profile.growth.clone()))
                .series(
                    Series::new("a linear model", profile.values.clone(), profile.linear.clone())
                        .style(Style::Dashed)
                        .colour(Colour::Vermillion),
                )
                .horizontal(1.96, "95 %"),
        )
        .caption("With this parameter held and all others fitted anew; where both lines agree, the interval is as long as it should be.")
}

/// Bars of a histogram.
const BARS: usize = 40;

/// How the draws of a variable are spread, and how the fit alone would have it.
pub fn histogram(drawn: &Posterior, j: usize, estimate: Option<&Estimate>) -> Option<Figure> {
    let variable = &drawn.variables[j];
    let sorted = drawn.draws.sorted(j);
    let (low, high) = (*sorted.first()?, *sorted.last()?);
    let wide = (high - low) / BARS as f64;
    if sorted.len() < 2 * BARS || wide <= 0.0 || !wide.is_finite() {
        return None;
    }
    // Densities, in steps.
    let (mut x, mut y) = (vec![low], vec![0.0]);
    for bar in 0..BARS {
        let (from, to) = (low + bar as f64 * wide, low + (bar + 1) as f64 * wide);
        let count = sorted.partition_point(|v| *v < to) - sorted.partition_point(|v| *v < from);
        let density = count as f64 / (sorted.len() as f64 * wide);
        x.extend([from, to]);
        y.extend([density, density]);
    }
    x.push(high);
    y.push(0.0);
    let mut panel = Panel::new(Axis::new("Density", "")).series(Series::new("draws", x, y));
    if let Some((value, error)) = estimate.and_then(|e| Some((e.value, e.error.filter(|error| *error > 0.0)?))) {
        let x: Vec<f64> = (0..=200).map(|k| low + (high - low) * f64::from(k) / 200.0).collect();
        let normal = |x: &f64| (-0.5 * ((x - value) / error).powi(2)).exp() / (error * std::f64::consts::TAU.sqrt());
        let y: Vec<f64> = x.iter().map(normal).collect();
        panel = panel.series(Series::new("the fit alone", x, y).style(Style::Dashed).colour(Colour::Vermillion));
    }
    let [from, to] = variable.interval;
    let figure = Figure::new(format!("{}: posterior", variable.name), Axis::new(&variable.name, variable.unit))
        .panel(panel)
        .vertical(from, "2.5 %")
        .vertical(to, "97.5 %")
        .caption("How the draws are spread, and the normal distribution that the fit stands for.");
    Some(figure)
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut::fit::Score;

    /// A log of angle and current, met with these errors; held out if `held`.
    fn log(name: &str, [angle, current]: [f64; 2], held: bool) -> LogFit {
        let output = |quantity, rmse| {
            let score = Some(Score { count: 9, rmse, worst: rmse, percent: 90.0, memory: 0.0 });
            let (fitted, held_out) = if held { (None, score) } else { (score, None) };
            OutputFit { quantity, seen: Vec::new(), model: Vec::new(), fitted, held_out }
        };
        LogFit {
            name: name.into(),
            window: 0,
            held_out: held,
            time: Vec::new(),
            fitted_rows: 0,
            outputs: vec![output(Quantity::DriveAngle, angle), output(Quantity::MotorCurrent, current)],
            extras: Vec::new(),
            complete: true,
        }
    }

    /// Of 42 logs the first twelve were drawn, and those that were met badly were not seen.
    #[test]
    fn the_worst_logs_are_drawn() {
        let noise = [(Quantity::DriveAngle, 1e-3), (Quantity::MotorCurrent, 0.1)];
        let mut logs: Vec<LogFit> = (0..20).map(|k| log(&format!("even {k}"), [1e-3, 0.1], false)).collect();
        logs.push(log("angle", [2e-3, 0.1], false));
        logs.push(log("current", [1e-3, 0.3], false));
        logs.push(log("held out", [1e-2, 0.1], true));
        logs.push(LogFit { complete: false, ..log("broken off", [1e-3, 0.1], false) });
        let drawn: Vec<&str> = worst(&logs, &noise).iter().map(|log| log.name.as_str()).collect();
        assert_eq!(drawn.len(), MOST_LOGS);
        assert_eq!(drawn[..5], ["broken off", "held out", "current", "angle", "even 0"]);
    }
}
