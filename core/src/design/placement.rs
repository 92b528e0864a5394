//! Gains from bandwidth and damping: poles of the axis taken as one mass with its drag.

use super::{Cascade, CurrentLoop, Design, Pid, Structure};
use crate::machine::rigid::Rigid;
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
    let rigid = Rigid::of(machine);
    let (mass, w) = (rigid.mass, 2.0 * PI * bandwidth);
    let sign = rigid.force_per_command().signum();
    let structure = match &design.structure {
        Structure::Pid(old) => {
            let (drag, push) = (rigid.drag(), rigid.force_per_command().abs());
            // s³ + (d + g K_d)/M s² + g K_p/M s + g K_i/M
            let real = if old.integral == 0.0 { 0.0 } else { damping * w };
            let gain = |coefficient: f64| sign * mass * coefficient / push;
            Structure::Pid(Pid {
                proportional: gain(w * w + 2.0 * damping * w * real),
                integral: gain(real * w * w),
                derivative: match old.derivative {
                    0.0 => 0.0,
                    _ => sign * least(mass * (2.0 * damping * w + real), drag) / push,
                },
                ..*old
            })
        }
        Structure::Cascade(old) => {
            let speed = CASCADE * w;
            let current = old.current.map(|inner| {
                let late = 0.5 * design.every + design.delay;
                let pole = (CASCADE * speed).min(0.5 / late.max(f64::MIN_POSITIVE));
                let gain = machine.drives[0].amplifier.gain;
                CurrentLoop {
                    proportional: pole * machine.drives[0].motor.inductance / gain,
                    integral: pole * machine.drives[0].motor.resistance / gain,
                    ..inner
                }
            });
            // Around a current the axis has no back-EMF.
            let (drag, push) = match current {
                Some(_) => (rigid.viscous[0], rigid.force_per_ampere.abs()),
                None => (rigid.drag(), rigid.force_per_command().abs()),
            };
            let sign = if current.is_some() { rigid.force_per_ampere.signum() } else { sign };
            let middle = if old.speed_integral == 0.0 { speed } else { 2.0 * damping * speed };
            Structure::Cascade(Cascade {
                position: w,
                speed: sign * least(mass * middle, drag) / push,
                speed_integral: if old.speed_integral == 0.0 { 0.0 } else { sign * mass * speed * speed / push },
                current,
                ..*old
            })
        }
        _ => return None,
    };
    Some(Design { structure, ..design.clone() })
}

/// The addition of a loop to the drag of the axis that makes `wanted`.
fn least(wanted: f64, drag: f64) -> f64 {
    (wanted - drag).max(0.05 * wanted)
}

/// A bandwidth to begin with, Hz: well below the first anti-resonance `swing` (Hz) and what delay and sampling allow.
pub fn first(design: &Design, swing: Option<f64>) -> f64 {
    let late = 0.5 * design.every + design.delay;
    let of_delay = 1.0 / (2.0 * PI * 8.0 * late.max(f64::MIN_POSITIVE));
    swing.map_or(of_delay, |swing| of_delay.min(swing / 6.0))
}

/// Whether a current is commanded, by amplifier or inner loop.
pub fn commands_current(design: &Design, machine: &Machine) -> bool {
    machine.drives[0].amplifier.mode == AmplifierMode::Current
        || matches!(&design.structure, Structure::Cascade(Cascade { current: Some(_), .. }))
}
