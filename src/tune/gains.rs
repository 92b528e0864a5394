//! The gains of a design as numbers with names, for a search and for the case file.

use super::placement::commands_current;
use crate::design::{Design, Filter, Structure};
use crate::parameter::{find, unit_for};
use crate::stage::{AmplifierMode, Stage};

/// Digits that a gain is given with behind its first one.
const DIGITS: usize = 3;

/// Highest frequency of a filter that is searched for, in samples per second.
const HIGHEST: f64 = 0.45;

/// A gain.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    /// Its key in the case file.
    pub key: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
    /// Whether a search changes it.
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

/// The design with its searched gains, and frequencies and widths of its filters from number `own` on, multiplied by e
/// to these powers.
pub fn shaped(design: &Design, own: usize, powers: &[f64]) -> Design {
    let count = searched(design, own) - filter_knobs(design, own);
    let (gains, filters) = powers.split_at(count.min(powers.len()));
    let mut other = scaled(design, gains);
    let most = HIGHEST / design.every;
    let mut powers = filters.iter();
    for filter in other.filters.iter_mut().skip(own) {
        let mut times = |value: &mut f64, low: f64, high: f64| {
            *value = (*value * powers.next().copied().unwrap_or_default().exp()).clamp(low, high);
        };
        match filter {
            Filter::Notch { frequency, damping, .. } => {
                times(frequency, f64::MIN_POSITIVE, most);
                times(damping, 0.05, 2.0);
            }
            Filter::LowPass { frequency, .. } => times(frequency, f64::MIN_POSITIVE, most),
        }
    }
    other
}

/// How many powers [`shaped`] takes.
pub fn searched(design: &Design, own: usize) -> usize {
    let mut copy = design.clone();
    fields(&mut copy).iter().filter(|(_, value, searched)| **value != 0.0 && *searched).count()
        + filter_knobs(design, own)
}

fn filter_knobs(design: &Design, own: usize) -> usize {
    let knobs = |filter: &Filter| match filter {
        Filter::Notch { .. } => 2,
        Filter::LowPass { .. } => 1,
    };
    design.filters.iter().skip(own).map(knobs).sum()
}

/// The design with gains and filters of four digits, as they are written.
pub fn rounded(design: &Design) -> Design {
    let mut other = design.clone();
    for (_, value, _) in fields(&mut other) {
        *value = four(*value);
    }
    for filter in &mut other.filters {
        match filter {
            Filter::Notch { frequency, depth, damping } => {
                (*frequency, *depth, *damping) = (four(*frequency), four(*depth), four(*damping));
            }
            Filter::LowPass { frequency, damping } => (*frequency, *damping) = (four(*frequency), four(*damping)),
        }
    }
    other
}

/// With four digits; through text, so that it is the number that will be read.
fn four(value: f64) -> f64 {
    if value.is_finite() { format!("{value:.DIGITS$e}").parse().unwrap_or(value) } else { value }
}

/// The filters as the case file has them.
pub fn filters_text(filters: &[Filter]) -> String {
    let one = |filter: &Filter| match filter {
        Filter::Notch { frequency, depth, damping } => {
            format!("{{ notch = \"{frequency} Hz\", depth = {depth}, damping = {damping} }}")
        }
        Filter::LowPass { frequency, damping } => format!("{{ low_pass = \"{frequency} Hz\", damping = {damping} }}"),
    };
    format!("[{}]", filters.iter().map(one).collect::<Vec<_>>().join(", "))
}

fn fields(design: &mut Design) -> Vec<(&'static str, &mut f64, bool)> {
    match &mut design.structure {
        Structure::Pid(pid) => {
            let has_derivative = pid.derivative != 0.0;
            vec![
                ("controller.pid.proportional", &mut pid.proportional, true),
                ("controller.pid.integral", &mut pid.integral, true),
                ("controller.pid.derivative", &mut pid.derivative, true),
                ("controller.pid.filter", &mut pid.filter, has_derivative),
            ]
        }
        Structure::Cascade(cascade) => {
            let mut all = vec![
                ("controller.cascade.position", &mut cascade.position, true),
                ("controller.cascade.speed", &mut cascade.speed, true),
                ("controller.cascade.speed_integral", &mut cascade.speed_integral, true),
                ("controller.cascade.filter", &mut cascade.filter, true),
            ];
            if let Some(inner) = &mut cascade.current {
                all.push(("controller.cascade.current.proportional", &mut inner.proportional, true));
                all.push(("controller.cascade.current.integral", &mut inner.integral, true));
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
