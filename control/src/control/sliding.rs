//! Sliding mode with a boundary layer, and the condition under which it reaches its surface.

use super::memory::Memory;
use super::sampled::Speed;
use crate::design::SlidingMode;
use crate::machine::rigid::Rigid;
use crate::signal::profile::Reference;

/// A sliding-mode controller on the side of the encoder: σ = ė + λ e + κ ∫e dt (A. Hace et al., "Robust motion control
/// and trajectory planning for planar laser cutting system", 2005, for belts).
///
/// With V = σ²/2 and M σ̇ = −M K sat(σ/Φ) + Δ the surface is reached, σ σ̇ < 0 for |σ| ≥ Φ, if K > |Δ|/M: [`required`].
#[derive(Debug, Clone)]
pub struct SlidingState {
    gains: SlidingMode,
    rigid: Rigid,
    every: f64,
    speed: Speed,
    integral: f64,
}

impl SlidingState {
    /// Stepped every `every` s, on an axis of one mass.
    pub fn new(gains: &SlidingMode, rigid: &Rigid, every: f64) -> Self {
        let speed = Speed::new(every, gains.filter);
        Self { gains: *gains, rigid: *rigid, every, speed, integral: 0.0 }
    }

    /// The next command beside feed-forward, which is the rest of the equivalent control.
    pub fn step(&mut self, target: &Reference, position: f64) -> f64 {
        let SlidingMode { bandwidth, reaching, boundary, integral, .. } = self.gains;
        let error = target.position - position;
        let rate = target.speed - self.speed.step(position);
        self.integral += self.every * error;
        let sigma = rate + bandwidth * error + integral * self.integral;
        // M (λ ė + κ e + K sat(σ/Φ))
        let acceleration = bandwidth * rate + integral * error + reaching * (sigma / boundary).clamp(-1.0, 1.0);
        self.rigid.mass * acceleration / self.rigid.force_per_command()
    }

    /// Without effect of its own the integral does not grow.
    pub fn limited(&mut self, excess: f64) {
        if excess != 0.0 && self.gains.integral > 0.0 {
            let force = excess * self.rigid.force_per_command() / self.rigid.mass;
            let gain = self.gains.integral * self.gains.reaching / self.gains.boundary;
            self.integral += (self.gains.bandwidth * self.every).min(1.0) * force / gain;
        }
    }

    /// Forgets.
    pub fn reset(&mut self) {
        *self = Self::new(&self.gains, &self.rigid, self.every);
    }

    /// Shows its memory to a function that takes all of it.
    pub(super) fn memory(&mut self, memory: &mut Memory) -> Option<()> {
        self.speed.memory(memory)?;
        memory(&mut self.integral)
    }
}

/// The reaching gain K, m/s², that Lyapunov's condition needs while mass and friction of the axis are known to a share
/// `spread` each, at up to this speed (m/s) and acceleration (m/s²) of the reference.
///
/// |Δ| ≤ s (M (a + λ Φ) + b v + F_c) with λ Φ for the motion within the layer, and K > |Δ|/M.
pub fn required(gains: &SlidingMode, rigid: &Rigid, spread: f64, speed: f64, acceleration: f64) -> f64 {
    let most = |pair: [f64; 2]| pair[0].max(pair[1]);
    let known = rigid.mass * (acceleration + gains.bandwidth * gains.boundary)
        + most(rigid.viscous) * speed
        + most(rigid.coulomb);
    spread * known / rigid.mass
}
