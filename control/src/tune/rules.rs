//! Gains to begin a search with, by several rules, and filters that may pay.

use crate::design::placement::{first, place};
use crate::design::{Design, Filter, Pid, StateFeedback, Structure};
use crate::machine::rigid::Rigid;
use crate::machine::{AmplifierMode, Machine};
use std::f64::consts::PI;

/// Damping ratios of placements beside that of the file.
const DAMPINGS: [f64; 2] = [0.6, 1.0];

/// Shares of the disturbance that a Kalman filter expects.
const SLOWER: [f64; 2] = [0.3, 0.1];

/// A notch that is added: its depth and width.
const DEPTH: f64 = 0.1;
const WIDTH: f64 = 0.7;

/// Most notches, those of the file with them.
const NOTCHES: usize = 2;

/// Starts for a design: placements about `bandwidth` (Hz), and for a PID Skogestad's rule. State feedback begins with
/// its own weights and slower filters.
pub fn starts(
    design: &Design,
    machine: &Machine,
    swing: Option<f64>,
    bandwidth: Option<f64>,
    damping: f64,
) -> Vec<(Design, Option<f64>)> {
    let hertz = bandwidth.unwrap_or(first(design, swing));
    let dampings = std::iter::once(damping).chain(DAMPINGS);
    let mut all: Vec<(Design, Option<f64>)> =
        dampings.filter_map(|damping| Some((place(design, machine, hertz, damping)?, Some(hertz)))).collect();
    all.extend(simc(design, machine).map(|design| (design, None)));
    if let Structure::StateFeedback(weights) = &design.structure {
        // A slower filter of the same regulator.
        all.extend(SLOWER.map(|share| {
            let weights = StateFeedback { disturbance: share * weights.disturbance, ..*weights };
            (Design { structure: Structure::StateFeedback(weights), ..design.clone() }, None)
        }));
    }
    all
}

/// Skogestad's rule for k e^{−θs}/(s (τ s + 1)) with τ_c = θ: K_c = 1/(2 k θ), τ_I = 8 θ, τ_D = τ, in series.
///
/// S. Skogestad, "Simple analytic rules for model reduction and PID controller tuning", Journal of Process Control 13
/// (2003).
fn simc(design: &Design, machine: &Machine) -> Option<Design> {
    let Structure::Pid(old) = &design.structure else { return None };
    let rigid = Rigid::of(machine);
    let late = design.delay + 0.5 * design.every + 1.0 / (2.0 * PI * old.filter);
    let (drag, push) = (rigid.drag(), rigid.force_per_command());
    // M ẍ + d ẋ = g u:  k = g/d, τ = M/d; without drag k/τ is what counts.
    let (lag, gain) = match machine.drives[0].amplifier.mode {
        _ if drag <= 0.0 => return None,
        AmplifierMode::Voltage | AmplifierMode::Current => (rigid.mass / drag, push / drag),
    };
    let (c, integral, derivative) = (0.5 / (gain * late), 8.0 * late, lag.min(8.0 * late));
    // From series to parallel form.
    let factor = 1.0 + derivative / integral;
    let kept = |old: f64, new: f64| if old == 0.0 { 0.0 } else { new };
    let structure = Structure::Pid(Pid {
        proportional: c * factor,
        integral: kept(old.integral, c / integral),
        derivative: kept(old.derivative, c * derivative),
        ..*old
    });
    Some(Design { structure, ..design.clone() })
}

/// The design with filters added in the ways that are tried, the plain one first: `modes` are frequencies of the axis
/// below half the sampling rate, Hz, the lowest first.
pub fn layouts(design: &Design, modes: &[f64]) -> Vec<Design> {
    let mut all = vec![design.clone()];
    let notch = |frequency: f64| Filter::Notch { frequency, depth: DEPTH, damping: WIDTH };
    let there = design.filters.iter().filter(|filter| matches!(filter, Filter::Notch { .. })).count();
    let room = NOTCHES.saturating_sub(there);
    let low_pass = design.filters.iter().any(|filter| matches!(filter, Filter::LowPass { .. }));
    let low = Filter::LowPass { frequency: modes.first().copied().unwrap_or(0.2 / design.every), damping: 0.7 };
    let mut add = |filters: Vec<Filter>| {
        let mut other = design.clone();
        other.filters.extend(filters);
        all.push(other);
    };
    if !low_pass {
        add(vec![low]);
    }
    if let (Some(&one), true) = (modes.first(), room > 0) {
        add(vec![notch(one)]);
        if let (Some(&two), true) = (modes.get(1), room > 1) {
            add(vec![notch(one), notch(two)]);
        }
        if !low_pass {
            add(vec![notch(one), low]);
        }
    }
    all
}
