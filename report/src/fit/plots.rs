//! Model and log side by side.

use super::value::value;
use crate::{Axis, Colour, Figure, Panel, Series, Style};
use taut::fit::{Estimate, Fit, LogFit, OutputFit, Posterior, Profile, ResidualForce};
use taut::log::{Quantity, step_of};

/// Logs drawn; the numbers of the rest are in the tables.
pub const MOST_LOGS: usize = 6;

/// Logs in one overlay.
const MOST_OVERLAID: usize = 60;

/// The logs that are drawn: those whose residuals are largest beside what the fit takes as their deviation, the worst
/// first.
pub fn worst<'a>(logs: &'a [LogFit], noise: &[(Quantity, f64)]) -> Vec<&'a LogFit> {
    let mut logs: Vec<(f64, &LogFit)> = logs.iter().map(|log| (misfit(log, noise), log)).collect();
    logs.sort_by(|a, b| b.0.total_cmp(&a.0));
    logs.into_iter().take(MOST_LOGS).map(|(_, log)| log).collect()
}

/// The largest RMSE of a log's outputs, each over the deviation of its quantity; infinite where the model does not
/// reach the end.
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
    axis_of(output.quantity, label)
}

fn axis_of(quantity: Quantity, label: &str) -> Axis {
    let unit = quantity.unit();
    match unit {
        "m" => Axis::new(label, unit).shown_as("mm", 1e3),
        "m/s" => Axis::new(label, unit).shown_as("mm/s", 1e3),
        _ => Axis::new(label, unit),
    }
}

/// Steps longer than this many usual intervals are gaps.
const GAP: f64 = 1.75;

/// A curve over time that is broken where samples are missing, and not drawn across.
fn broken(time: &[f64], values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    let usual = if steps.is_empty() { 0.0 } else { *steps.select_nth_unstable_by(middle, f64::total_cmp).1 };
    let (mut x, mut y) = (Vec::with_capacity(time.len()), Vec::with_capacity(time.len()));
    for (k, (&at, &value)) in time.iter().zip(values).enumerate() {
        if k > 0 && at - time[k - 1] > GAP * usual {
            x.push(time[k - 1]);
            y.push(f64::NAN);
        }
        x.push(at);
        y.push(value);
    }
    (x, y)
}

/// The deviation of the residuals of a quantity.
fn deviation_of(noise: &[(Quantity, f64)], quantity: Quantity) -> Option<f64> {
    noise.iter().find(|(own, _)| *own == quantity).map(|(_, deviation)| *deviation)
}

/// A panel of residuals with the band in which 95 % of them are by chance.
fn with_band(panel: Panel, deviation: Option<f64>) -> Panel {
    match deviation {
        Some(deviation) => panel.horizontal(NORMAL * deviation, "95 % of chance").horizontal(-NORMAL * deviation, ""),
        None => panel,
    }
}

/// The step of a log's values where rounding to it explains at least half of the residuals' variance.
fn rounding(output: &OutputFit, deviation: Option<f64>) -> Option<f64> {
    // An error of rounding is evenly distributed: q/√12.
    let explains = |step: &f64| deviation.is_some_and(|deviation| step * step / 12.0 > 0.5 * deviation * deviation);
    step_of(&output.seen).filter(explains)
}

/// One output of a log: what was seen, what the model says, what is between them, with the band that chance has by the
/// deviation of the fit's residuals.
pub fn overlay(log: &LogFit, output: &OutputFit, noise: &[(Quantity, f64)]) -> Figure {
    let residual: Vec<f64> = output.model.iter().zip(&output.seen).map(|(model, seen)| model - seen).collect();
    let deviation = deviation_of(noise, output.quantity);
    let line = |name: &str, values: &[f64]| {
        let (x, y) = broken(&log.time, values);
        Series::new(name, x, y)
    };
    let below = Panel::new(axis(output, "Model − log")).series(line("model − log", &residual)).horizontal(0.0, "");
    let caption = match rounding(output, deviation) {
        None => "Above log and model, below what is between them.".to_string(),
        Some(step) => format!(
            "Above log and model, below what is between them: mostly the rounding of the log to steps of {}.",
            value(step, output.quantity.unit(), 3)
        ),
    };
    let name = output.quantity.name().replace('_', " ");
    let mut figure = Figure::new(format!("{}: {name}", log.name), Axis::new("Time", "s"))
        .panel(
            Panel::new(axis(output, "Value"))
                .series(line("log", &output.seen).style(Style::Solid))
                .series(line("model", &output.model).style(Style::Dashed).colour(Colour::Vermillion))
                .weight(2.0),
        )
        .panel(with_band(below, deviation))
        .caption(caption);
    if log.fitted_rows > 0 && log.fitted_rows < log.time.len() {
        figure = figure.vertical(log.time[log.fitted_rows], "held out from here");
    }
    figure
}

/// The residuals of all logs over each other, one figure for each quantity.
pub fn together(fit: &Fit) -> Vec<Figure> {
    let mut quantities: Vec<Quantity> = Vec::new();
    for output in fit.logs.iter().flat_map(|log| &log.outputs) {
        if !quantities.contains(&output.quantity) {
            quantities.push(output.quantity);
        }
    }
    let one = |quantity: Quantity| {
        let mut panel = Panel::new(axis_of(quantity, "Model − log"));
        for (held, name, colour) in [(false, "fitted", Colour::Blue), (true, "held out", Colour::Vermillion)] {
            let (mut x, mut y) = (Vec::new(), Vec::new());
            for log in fit.logs.iter().filter(|log| log.held_out == held).take(MOST_OVERLAID) {
                for output in log.outputs.iter().filter(|output| output.quantity == quantity) {
                    let residual: Vec<f64> = output.model.iter().zip(&output.seen).map(|(m, seen)| m - seen).collect();
                    let (time, residual) = broken(&log.time, &residual);
                    x.extend(time);
                    y.extend(residual);
                    // A gap between one log and the next.
                    x.push(0.0);
                    y.push(f64::NAN);
                }
            }
            if !x.is_empty() {
                panel = panel.series(Series::new(name, x, y).colour(colour));
            }
        }
        let name = quantity.name().replace('_', " ");
        Figure::new(format!("All logs: {name}"), Axis::new("Time", "s"))
            .panel(with_band(panel.horizontal(0.0, ""), deviation_of(&fit.noise, quantity)))
            .caption("Model minus log, all logs over each other.")
    };
    quantities.into_iter().map(one).collect()
}

/// How far each log is missed, in the case's order.
pub fn by_log(logs: &[LogFit], quantity: Quantity) -> Option<Figure> {
    let of = |held: bool| -> (Vec<f64>, Vec<f64>) {
        let scores = logs.iter().enumerate().filter_map(|(k, log)| {
            let output = log.outputs.iter().find(|output| output.quantity == quantity)?;
            let score = if held { output.held_out } else { output.fitted }?;
            Some(((k + 1) as f64, score.rmse))
        });
        scores.unzip()
    };
    let (fitted, held) = (of(false), of(true));
    if fitted.0.len() + held.0.len() < 3 {
        return None;
    }
    let name = quantity.name().replace('_', " ");
    let mut panel = Panel::new(axis_of(quantity, "RMSE"));
    for (name, (x, y), colour) in [("fitted", fitted, Colour::Blue), ("held out", held, Colour::Vermillion)] {
        if !x.is_empty() {
            panel = panel.series(Series::new(name, x, y).style(Style::Points).colour(colour));
        }
    }
    let figure = Figure::new(format!("Error of each log: {name}"), Axis::new("Log, in the order of the case", ""));
    Some(
        figure
            .panel(panel.horizontal(0.0, ""))
            .caption("Root mean square of model minus log; the table says which is which."),
    )
}

/// Half-width of a 95 % interval of a normal distribution, in standard deviations.
const NORMAL: f64 = 1.96;

/// Bins of a residual force.
const BINS: usize = 40;

/// Means of a force over bins of what it is drawn beside, with no number in those with few values: no line crosses
/// them.
fn binned(x: &[f64], force: &[f64], chosen: impl Fn(usize) -> bool) -> (Vec<f64>, Vec<f64>) {
    let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
    let mut sums = [(0.0, 0.0, 0usize); BINS];
    let wide = (high - low).max(f64::MIN_POSITIVE) / BINS as f64;
    for k in (0..x.len()).filter(|&k| chosen(k)) {
        let bin = &mut sums[(((x[k] - low) / wide) as usize).min(BINS - 1)];
        *bin = (bin.0 + x[k], bin.1 + force[k], bin.2 + 1);
    }
    let fewest = (x.len() / (20 * BINS)).max(3);
    let mean = |(bin, (x, f, n)): (usize, &(f64, f64, usize))| match *n >= fewest {
        true => (x / *n as f64, f / *n as f64),
        false => (low + (bin as f64 + 0.5) * wide, f64::NAN),
    };
    sums.iter().enumerate().map(mean).unzip()
}

/// The force that the model lacks, beside position, speed and force of the motor: `all` over all logs.
pub fn residual_forces(all: &ResidualForce) -> Vec<Figure> {
    let force = || Axis::new("Residual force", "N");
    let beside = |title: &str, x: Axis, values: &[f64], caption: &str| {
        let mut panel = Panel::new(force());
        for (name, forward, colour) in [("forward", true, Colour::Blue), ("backward", false, Colour::Vermillion)] {
            let (x, y) = binned(values, &all.force, |k| (all.speed[k] > 0.0) == forward);
            if y.iter().filter(|force| force.is_finite()).count() > 2 {
                panel = panel.series(Series::new(name, x, y).colour(colour));
            }
        }
        Figure::new(title, x).panel(panel.horizontal(0.0, "")).caption(caption)
    };
    vec![
        beside(
            "Residual force beside position",
            Axis::new("Position", "m").shown_as("mm", 1e3),
            &all.position,
            "Means over all logs, each direction by itself. What repeats along the travel with opposite signs is friction that changes along it; with \
             the same sign it is a force that depends on the place.",
        ),
        beside(
            "Residual force beside speed",
            Axis::new("Speed", "m/s"),
            &all.speed,
            "A curve near zero is a Stribeck curve; different slopes or heights on both sides are friction that differs by direction.",
        ),
        beside(
            "Residual force beside the motor's force",
            Axis::new("Force of the motor", "N"),
            &all.drive,
            "A slope is a gain, or friction that grows with load.",
        ),
    ]
}

/// Residual force over time, for one log.
pub fn residual_over_time(log: &LogFit, own: &ResidualForce) -> Figure {
    let (time, force) = broken(&own.time, &own.force);
    Figure::new(format!("{}: residual force", log.name), Axis::new("Time", "s"))
        .panel(Panel::new(Axis::new("Residual force", "N")).line("", &time, &force).horizontal(0.0, ""))
        .caption("What would have to act on the cart beside the model, so that it followed the log; stretches at rest are left out. A mean that wanders is a drift.")
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
    let chance = NORMAL / (n as f64).sqrt();
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
                .horizontal(NORMAL, "95 %"),
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
        .caption("Distribution of the draws, and the normal distribution of the fit.");
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
            inputs: vec![Vec::new()],
            fitted_rows: 0,
            outputs: vec![output(Quantity::DriveAngle, angle), output(Quantity::MotorCurrent, current)],
            extras: Vec::new(),
            complete: true,
        }
    }

    /// Lines were drawn across gaps of a log and across speeds at which it never was, as if something had been measured
    /// there.
    #[test]
    fn no_line_crosses_what_was_not_measured() {
        let time = [0.0, 1.0, 2.0, 7.0, 8.0];
        let (x, y) = broken(&time, &[1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(x, [0.0, 1.0, 2.0, 2.0, 7.0, 8.0]);
        assert!(y[3].is_nan() && y.iter().filter(|value| value.is_nan()).count() == 1);
        // Speeds near −1 and 1 alone.
        let speeds: Vec<f64> = (0..400).map(|k| if k < 200 { -1.0 } else { 1.0 } + 1e-3 * f64::from(k % 100)).collect();
        let (x, y) = binned(&speeds, &speeds, |_| true);
        assert_eq!(x.len(), BINS);
        assert!(y[BINS / 2].is_nan() && y[0].is_finite() && y[BINS - 1].is_finite());
    }

    /// Residuals that are the rounding of an encoder are called so, and have a band; others have a band alone.
    #[test]
    fn rounding_is_named_and_residuals_have_a_band() {
        let step = 0.25;
        let model: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k * k % 331)).collect();
        let seen: Vec<f64> = model.iter().map(|value| (value / step).round() * step).collect();
        let mut log = log("counts", [0.07, 0.1], false);
        log.time = (0..200).map(f64::from).collect();
        let output = OutputFit { seen, model, ..log.outputs[0].clone() };
        let drawn = |deviation: f64| overlay(&log, &output, &[(Quantity::DriveAngle, deviation)]);
        let figure = drawn(step / 12f64.sqrt());
        assert!(figure.caption.contains("rounding of the log to steps of 0.25"), "{}", figure.caption);
        let band: Vec<f64> = figure.panels[1].horizontals.iter().map(|marker| marker.at).collect();
        let edge = NORMAL * step / 12f64.sqrt();
        assert_eq!(band.len(), 3);
        assert!(band.iter().zip([0.0, edge, -edge]).all(|(at, wanted)| (at - wanted).abs() < 1e-15), "{band:?}");
        assert!(!drawn(1.0).caption.contains("rounding"));
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
