//! Tests whether the controller of a case made a log: its output for the logged positions, beside the
//! logged input.

use crate::case::Case;
use crate::control::{Controller, Loop, Observation, Standard};
use crate::log::{Log, Quantity};
use crate::machine::{EncoderPlace, Machine};
use crate::signal::profile::Profile;

/// Fit of the output û of the controller of `case`, for reference and position of a log, to the logged input u, per
/// cent: 100 (1 − ‖u − û‖/‖u − ū‖). `None` without a controller, a reference or a position.
pub(crate) fn reproduced(case: &Case, log: &Log) -> Option<f64> {
    let (design, reference) = (case.controller.as_ref()?, log.reference.as_ref()?);
    let position = position(&case.machine, log)?;
    let scale = match case.machine.scale {
        Some(_) => Some(filled(log, Quantity::CartPosition, 1.0)?),
        None => None,
    };
    let mut controller = Standard::new(design, &case.machine).ok()?;
    let profile = Profile::sampled(&log.time, reference).shaped(&design.shaper);
    let timing = Loop::new(design);
    let end = *log.time.last()?;
    // Straight lines between samples.
    let at = |values: &[f64], t: f64| {
        let after = log.time.partition_point(|time| *time <= t).clamp(1, log.time.len() - 1);
        let (a, b) = (log.time[after - 1], log.time[after]);
        let share = ((t - a) / (b - a)).clamp(0.0, 1.0);
        values[after - 1] + share * (values[after] - values[after - 1])
    };
    let current = log.output(Quantity::MotorCurrent);
    let late = 0.1 * log.interval().min(timing.every);
    let (mut made, mut logged) = (Vec::new(), Vec::new());
    let mut k = 0u64;
    loop {
        let time = k as f64 * timing.every;
        if time + timing.delay > end || k > 100_000_000 {
            break;
        }
        let seen = Observation {
            time,
            reference: profile.at(time),
            ahead: profile.at(time + timing.lead),
            position: at(&position, time),
            scale: scale.as_ref().map(|scale| at(scale, time)),
            current: current.map_or(0.0, |output| at(&output.values, time)),
        };
        let asked = controller.step(&seen);
        let given = timing.limit.map_or(asked, |limit| asked.clamp(-limit, limit));
        controller.limited(given);
        // The input at the time at which the command acts; clocks of logs deviate a little.
        let acts = time + timing.delay + late;
        let row = log.time.partition_point(|time| *time <= acts).checked_sub(1)?;
        made.push(given);
        logged.push(log.inputs[0][row] - log.added.as_ref().map_or(0.0, |added| added[row]));
        k += 1;
    }
    let mean = logged.iter().sum::<f64>() / logged.len().max(1) as f64;
    let left: f64 = made.iter().zip(&logged).map(|(made, logged)| (made - logged).powi(2)).sum();
    let whole: f64 = logged.iter().map(|logged| (logged - mean).powi(2)).sum();
    let percent = 100.0 * (1.0 - (left / whole).sqrt());
    percent.is_finite().then_some(percent)
}

/// The position measured by the controller's encoder along a log, m along the belt, with missing values interpolated.
fn position(machine: &Machine, log: &Log) -> Option<Vec<f64>> {
    let cart = filled(log, Quantity::CartPosition, 1.0);
    let angle = filled(log, Quantity::DriveAngle, machine.pulley_radius);
    match machine.encoder.map(|encoder| encoder.at) {
        Some(EncoderPlace::Cart) => cart.or(angle),
        Some(EncoderPlace::DrivePulley | EncoderPlace::Motor) | None => angle.or(cart),
    }
}

/// A quantity of a log times `arm`, with missing values interpolated.
fn filled(log: &Log, quantity: Quantity, arm: f64) -> Option<Vec<f64>> {
    let output = log.output(quantity).filter(|output| !output.absolute)?;
    let mut last = output.values.iter().copied().find(|value| value.is_finite())?;
    let filled = output.values.iter().map(|value| {
        last = if value.is_finite() { *value } else { last };
        arm * last
    });
    Some(filled.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Output;
    use crate::signal::Hold;

    /// A log that deviates from its mean twice as much as the controller's output: half of it is reproduced.
    #[test]
    fn an_input_is_reproduced_by_the_share_of_its_deviation() {
        let file = format!("{}/../stages/sollmann-jouaneh/controllers/pid.toml", env!("CARGO_MANIFEST_DIR"));
        let case = Case::read_with(&file, &["controller.delay=\"0 s\"", "controller.limit=\"1000 V\""]).unwrap();
        let design = case.controller.as_ref().unwrap();
        let (every, r) = (design.every, case.machine.pulley_radius);
        let time: Vec<f64> = (0..300).map(|k| every * f64::from(k)).collect();
        let reference: Vec<f64> = time.iter().map(|t| 0.01 * (20.0 * t).sin()).collect();
        let position: Vec<f64> = time.iter().map(|t| 0.009 * (20.0 * t - 0.1).sin()).collect();
        let profile = Profile::sampled(&time, &reference);
        let (mut controller, lead) = (Standard::new(design, &case.machine).unwrap(), Loop::new(design).lead);
        let commands: Vec<f64> = time
            .iter()
            .zip(&position)
            .map(|(&time, &position)| {
                let (reference, ahead) = (profile.at(time), profile.at(time + lead));
                controller.step(&Observation { time, reference, ahead, position, ..Observation::default() })
            })
            .collect();
        let angle = position.iter().map(|x| x / r).collect();
        let mean = commands.iter().sum::<f64>() / commands.len() as f64;
        let log = |share: f64| Log {
            name: "a".into(),
            file: Default::default(),
            time: time.clone(),
            inputs: vec![commands.iter().map(|command| mean + (command - mean) / share).collect()],
            added: None,
            hold: Hold::Zero,
            reference: Some(reference.clone()),
            outputs: vec![Output { quantity: Quantity::DriveAngle, absolute: false, values: Vec::clone(&angle) }],
            ended: None,
        };
        for (share, percent) in [(1.0, 100.0), (0.5, 50.0), (0.8, 80.0)] {
            let found = reproduced(&case, &log(share)).unwrap();
            assert!((found - percent).abs() < 1e-6, "{share}: {found}");
        }
    }
}
