//! Pole placement: gains from bandwidth and damping for the axis as one mass with viscous drag.

use super::Design;
use crate::machine::{AmplifierMode, Machine};
use std::f64::consts::PI;

/// Bandwidth of each inner loop of a cascade relative to the loop around it.
pub(crate) const CASCADE: f64 = 4.0;

/// The design with gains that place the poles of M ẍ + d ẋ = g u by `bandwidth` (Hz) and `damping` ζ, without delay and
/// sampling; none for a structure without such gains. A gain that is zero in the design stays zero.
///
/// PID of a stepper, whose field is a spring k: K_i/(1 + K_p) = ω₀, and K_d damps the mass on the spring by ζ; K_p
/// stays. PID of other motors: with an integral all three poles, (s + ζω₀)(s² + 2ζω₀ s + ω₀²), ω₀ = 2π f; without one
/// s² + 2ζω₀ s + ω₀².
/// Cascade: K_v = ω₀, the speed loop s² + 2ζω_v s + ω_v² with ω_v = 4 ω₀ (without its integral the pole −ω_v), and the
/// current loop −4 ω_v, or −1/(2 (T/2 + delay)) if sampling limits it. If the drag of the axis alone exceeds the
/// damping, the gain is a twentieth, as a start for a search.
pub fn place(design: &Design, machine: &Machine, bandwidth: f64, damping: f64) -> Option<Design> {
    let structure = design.structure.tunable().placed(design, machine, bandwidth, damping)?;
    Some(Design { structure, ..design.clone() })
}

/// Damping that a loop adds to the drag of the axis to reach `wanted`.
pub(super) fn least(wanted: f64, drag: f64) -> f64 {
    (wanted - drag).max(0.05 * wanted)
}

/// Initial bandwidth, Hz: well below the first anti-resonance `swing` (Hz) and the limits from delay and sampling.
pub fn first(design: &Design, swing: Option<f64>) -> f64 {
    let late = 0.5 * design.every + design.delay;
    let of_delay = 1.0 / (2.0 * PI * 8.0 * late.max(f64::MIN_POSITIVE));
    swing.map_or(of_delay, |swing| of_delay.min(swing / 6.0))
}

/// Unit of the quantity that the structure commands: A of the amplifier or of an inner loop, V, or m of a stepper.
pub fn commanded_unit(design: &Design, machine: &Machine) -> &'static str {
    match machine.drives[0].amplifier.mode {
        AmplifierMode::Voltage if design.structure.tunable().commands_current() => "A",
        mode => mode.unit(),
    }
}
