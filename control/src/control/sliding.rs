//! Sliding mode with a boundary layer, and its reaching condition.

use super::law::{Law, LawInputs, Speed};
use crate::calculator::{Calculator, Slot, Slots};
use crate::design::SlidingMode;
use crate::machine::rigid::Rigid;

/// Sliding-mode controller on the side of the encoder: σ = ė + λ e + κ ∫e dt (A. Hace et al., "Robust motion control
/// and trajectory planning for planar laser cutting system", 2005, for belts).
///
/// With V = σ²/2 and M σ̇ = −M K sat(σ/Φ) + Δ the surface is reached, σ σ̇ < 0 for |σ| ≥ Φ, if K > |Δ|/M: [`required`].
#[derive(Debug, Clone)]
pub(crate) struct SlidingLaw {
    gains: SlidingMode,
    mass: f64,
    force_per_command: f64,
    every: f64,
    speed: Speed,
    integral: Slot,
}

impl SlidingLaw {
    /// Stepped every `every` s, on an axis of one mass.
    pub fn new(slots: &mut Slots, gains: &SlidingMode, rigid: &Rigid, every: f64) -> Self {
        let speed = Speed::new(slots, every, gains.filter);
        let integral = slots.add("integral", "integral of the error, m s");
        let (mass, force_per_command) = (rigid.mass, rigid.force_per_command());
        Self { gains: *gains, mass, force_per_command, every, speed, integral }
    }
}

impl Law for SlidingLaw {
    fn about(&self) -> &'static str {
        "sliding mode with a boundary layer"
    }

    fn commands_current(&self) -> bool {
        false
    }

    fn is_linear(&self) -> bool {
        false
    }

    /// Feed-forward is the rest of the equivalent control.
    fn step<C: Calculator>(&self, c: &mut C, seen: &LawInputs<C::N>) -> C::N {
        let SlidingMode { bandwidth, reaching, boundary, integral, .. } = self.gains;
        let error = c.name("error", seen.target.position - seen.position);
        let rate = seen.target.speed - self.speed.step(c, seen.position);
        let rate = c.name("rate", rate);
        let mut sigma = rate + error * bandwidth;
        let mut acceleration = rate * bandwidth;
        if integral != 0.0 {
            let sum = c.memory(self.integral) + error * self.every;
            let sum = c.name("sum", sum);
            c.keep(self.integral, sum);
            sigma = sigma + sum * integral;
            acceleration = acceleration + error * integral;
        }
        // M (λ ė + κ e + K sat(σ/Φ))
        let share = c.name("share", sigma / boundary);
        let layer = c.within(share, -1.0, 1.0);
        let layer = c.name("layer", layer);
        (acceleration + layer * reaching) * self.mass / self.force_per_command
    }

    /// The integral does not grow without an effect.
    fn limited<C: Calculator>(&self, c: &mut C, excess: C::N, _: C::N) {
        let SlidingMode { bandwidth, reaching, boundary, integral, .. } = self.gains;
        if integral > 0.0 {
            let force = excess * self.force_per_command / self.mass;
            let change = force * (bandwidth * self.every).min(1.0) / (integral * reaching / boundary);
            let sum = c.memory(self.integral) + change;
            c.keep(self.integral, sum);
        }
    }
}

/// Reaching gain K, m/s², by Lyapunov's condition, for mass and friction known within a relative `spread`, up to this
/// speed (m/s) and acceleration (m/s²) of the reference.
///
/// |Δ| ≤ s (M (a + λ Φ) + b v + F_c) with λ Φ for the motion within the layer, and K > |Δ|/M.
pub fn required(gains: &SlidingMode, rigid: &Rigid, spread: f64, speed: f64, acceleration: f64) -> f64 {
    let most = |pair: [f64; 2]| pair[0].max(pair[1]);
    let known = rigid.mass * (acceleration + gains.bandwidth * gains.boundary)
        + most(rigid.viscous) * speed
        + most(rigid.coulomb);
    spread * known / rigid.mass
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use crate::design::Structure;

    /// σ σ̇ < 0 at the layer's edge for each mass and friction within the spread.
    #[test]
    fn the_reaching_gain_exceeds_what_the_model_is_off_by() {
        let file = format!("{}/../stages/sollmann-jouaneh/controllers/sliding.toml", env!("CARGO_MANIFEST_DIR"));
        let case = Case::read_with(&file, &[]).unwrap();
        let Structure::SlidingMode(gains) = case.controller.unwrap().structure else { panic!("no sliding mode") };
        let rigid = Rigid::new(&case.machine);
        let (spread, speed, acceleration) = (0.2, 0.3, 4.0);
        let gain = required(&gains, &rigid, spread, speed, acceleration);
        let ends = [1.0 - spread, 1.0 + spread];
        let mut worst = 0.0_f64;
        for mass in ends {
            for viscous in ends {
                for coulomb in ends {
                    let inertial = (mass - 1.0) * rigid.mass * (acceleration + gains.bandwidth * gains.boundary);
                    let viscous = (viscous - 1.0) * rigid.viscous[0].max(rigid.viscous[1]) * speed;
                    let coulomb = (coulomb - 1.0) * rigid.coulomb[0].max(rigid.coulomb[1]);
                    worst = worst.max((inertial + viscous + coulomb).abs() / rigid.mass);
                }
            }
        }
        assert!((gain / worst - 1.0).abs() < 1e-12, "{gain} {worst}");
    }
}
