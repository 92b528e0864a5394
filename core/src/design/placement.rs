//! Gains from bandwidth and damping: poles of the axis taken as one mass with its drag.

use super::Design;
use crate::machine::{AmplifierMode, Machine};
use std::f64::consts::PI;

/// By what factor each inner loop of a cascade is quicker than the one around it.
pub const CASCADE: f64 = 4.0;

/// The design with the gains that put the poles of M ẍ + d ẋ = g u where `bandwidth` (Hz) and `damping` ζ say, delay
/// and sampling apart; none for a structure that has no such gains. A gain that is zero in the design stays zero.
///
/// PID: with an integral all three poles, (s + ζω₀)(s² + 2ζω₀ s + ω₀²), ω₀ = 2π f; without one s² + 2ζω₀ s + ω₀².
/// Cascade: K_v = ω₀, the speed loop s² + 2ζω_v s + ω_v² with ω_v = 4 ω₀ (without its integral the pole −ω_v), and the
/// current loop −4 ω_v, or −1/(2 (T/2 + delay)) where sampling allows no more. A damping that the drag of the axis
/// exceeds by itself takes a twentieth of the gain, for a search to change.
pub fn place(design: &Design, machine: &Machine, bandwidth: f64, damping: f64) -> Option<Design> {
    let structure = design.structure.tunable().placed(design, machine, bandwidth, damping)?;
    Some(Design { structure, ..design.clone() })
}

/// The addition of a loop to the drag of the axis that makes `wanted`.
pub(super) fn least(wanted: f64, drag: f64) -> f64 {
    (wanted - drag).max(0.05 * wanted)
}

/// A bandwidth to begin with, Hz: well below the first anti-resonance `swing` (Hz) and what delay and sampling allow.
pub fn first(design: &Design, swing: Option<f64>) -> f64 {
    let late = 0.5 * design.every + design.delay;
    let of_delay = 1.0 / (2.0 * PI * 8.0 * late.max(f64::MIN_POSITIVE));
    swing.map_or(of_delay, |swing| of_delay.min(swing / 6.0))
}

/// True if a current is commanded, by amplifier or inner loop.
pub fn commands_current(design: &Design, machine: &Machine) -> bool {
    machine.drives[0].amplifier.mode == AmplifierMode::Current || design.structure.tunable().commands_current()
}
