//! The gains of a design as numbers with names, for a search and for the case file.

use super::placement::commands_current;
use crate::design::{Design, Structure};
use crate::parameter::{find, unit_for};
use crate::stage::{AmplifierMode, Stage};

/// Digits that a gain is given with.
const DIGITS: i32 = 4;

/// A gain.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    /// Its key in the case file.
    pub key: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
    /// Whether a search changes it; a current loop's gains follow from its placement alone.
    pub searched: bool,
}

/// The gains of a design that are not zero, in the order of the case file.
pub fn gains(design: &Design, stage: &Stage) -> Vec<Gain> {
    let mut copy = design.clone();
    let amperes = commands_current(design, stage);
    let amplifier = if stage.amplifier.mode == AmplifierMode::Current { "A" } else { "V" };
    let input = if amperes && matches!(design.structure, Structure::Cascade(_)) { "A" } else { amplifier };
    let gain = |(key, value, searched): (&'static str, &mut f64, bool)| Gain {
        key,
        unit: find(key).map_or("", |row| unit_for(row.unit, input)),
        value: *value,
        searched,
    };
    fields(&mut copy).into_iter().map(gain).filter(|gain| gain.value != 0.0).collect()
}

/// The design with its searched gains multiplied, in the order of [`gains`], by e to these powers.
pub fn scaled(design: &Design, powers: &[f64]) -> Design {
    let mut other = design.clone();
    let searched = fields(&mut other).into_iter().filter(|(_, value, searched)| **value != 0.0 && *searched);
    for ((_, value, _), power) in searched.zip(powers) {
        *value *= power.exp();
    }
    other
}

/// State feedback with weights that make its bandwidth about √`soft` of what it is: of the integral, which has a time in it, more so.
pub fn softer(design: &Design, stage: &Stage, soft: f64) -> Design {
    let power = |gain: Gain| match gain.key {
        key if key.ends_with(".integral") => -2.0 * soft.ln(),
        key if key.ends_with(".disturbance") => 0.0,
        _ => -soft.ln(),
    };
    scaled(design, &gains(design, stage).into_iter().map(power).collect::<Vec<_>>())
}

/// The design with gains of four digits, as they are written.
pub fn rounded(design: &Design) -> Design {
    let mut other = design.clone();
    for (_, value, _) in fields(&mut other) {
        if *value != 0.0 && value.is_finite() {
            let decimals = DIGITS - 1 - value.abs().log10().floor() as i32;
            // Through text, so that it is the number that will be read.
            *value = match decimals {
                0.. => format!("{value:.*}", decimals as usize).parse().unwrap_or(*value),
                _ => (*value * 10f64.powi(decimals)).round() * 10f64.powi(-decimals),
            };
        }
    }
    other
}

fn fields(design: &mut Design) -> Vec<(&'static str, &mut f64, bool)> {
    match &mut design.structure {
        Structure::Pid(pid) => vec![
            ("controller.pid.proportional", &mut pid.proportional, true),
            ("controller.pid.integral", &mut pid.integral, true),
            ("controller.pid.derivative", &mut pid.derivative, true),
        ],
        Structure::Cascade(cascade) => {
            let mut all = vec![
                ("controller.cascade.position", &mut cascade.position, true),
                ("controller.cascade.speed", &mut cascade.speed, true),
                ("controller.cascade.speed_integral", &mut cascade.speed_integral, true),
            ];
            if let Some(inner) = &mut cascade.current {
                all.push(("controller.cascade.current.proportional", &mut inner.proportional, false));
                all.push(("controller.cascade.current.integral", &mut inner.integral, false));
            }
            all
        }
        Structure::StateFeedback(weights) => {
            let mut all = vec![("controller.state_feedback.position", &mut weights.position, true)];
            all.extend(weights.speed.as_mut().map(|v| ("controller.state_feedback.speed", v, true)));
            all.extend(weights.integral.as_mut().map(|v| ("controller.state_feedback.integral", v, true)));
            all.push(("controller.state_feedback.disturbance", &mut weights.disturbance, true));
            all
        }
        _ => Vec::new(),
    }
}
