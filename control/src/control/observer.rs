//! An observer of the disturbance at the command.

use super::memory::{Memory, optional};
use crate::machine::rigid::Rigid;
use nalgebra::{Complex, Matrix3, RowVector3, Vector3};

/// Estimates position, speed and a constant disturbance of an axis of one mass from its measured position.
#[derive(Debug, Clone)]
pub struct DisturbanceState {
    a: Matrix3<f64>,
    b: Vector3<f64>,
    gain: Vector3<f64>,
    state: Option<Vector3<f64>>,
}

impl DisturbanceState {
    /// With all poles at `bandwidth`, Hz; none where the axis cannot be observed so.
    pub fn new(bandwidth: f64, rigid: &Rigid, every: f64) -> Option<Self> {
        // v̇ = −(d/M) v + (g/M)(u + w), ẇ = 0, held inputs
        let (rate, push) = (rigid.drag() / rigid.mass, rigid.force_per_command() / rigid.mass);
        let x = rate * every;
        // (1 − e^(−x))/x and (x − 1 + e^(−x))/x², by series where they cancel
        let (first, second) = if x < 1e-3 {
            (1.0 - x / 2.0 + x * x / 6.0, 0.5 - x / 6.0 + x * x / 24.0)
        } else {
            (-(-x).exp_m1() / x, (x + (-x).exp_m1()) / (x * x))
        };
        let (speed, way) = (push * every * first, push * every * every * second);
        let a = Matrix3::new(1.0, every * first, way, 0.0, (-x).exp(), speed, 0.0, 0.0, 1.0);
        let b = Vector3::new(way, speed, 0.0);
        // Ackermann's formula: L = p(A) O⁻¹ (0 0 1)ᵀ with p(z) = (z − e^(−2π f T))³
        let c = RowVector3::new(1.0, 0.0, 0.0);
        let observability = Matrix3::from_rows(&[c, c * a, c * a * a]);
        let pole = (-2.0 * std::f64::consts::PI * bandwidth * every).exp();
        let shifted = a - Matrix3::identity() * pole;
        let gain = shifted * shifted * shifted * observability.try_inverse()? * Vector3::new(0.0, 0.0, 1.0);
        gain.iter().all(|g| g.is_finite()).then_some(Self { a, b, gain, state: None })
    }

    /// A, b and the gain L of s⁺ = A s + b u + L (y − s₁).
    pub fn matrices(&self) -> ([[f64; 3]; 3], [f64; 3], [f64; 3]) {
        let row = |i: usize| std::array::from_fn(|j| self.a[(i, j)]);
        (std::array::from_fn(row), self.b.into(), self.gain.into())
    }

    /// The disturbance, V or A, that acts along with the command.
    pub fn disturbance(&self) -> f64 {
        self.state.map_or(0.0, |state| state[2])
    }

    /// Takes a measured position and the command that acts from there on.
    pub fn step(&mut self, position: f64, command: f64) {
        let state = self.state.unwrap_or(Vector3::new(position, 0.0, 0.0));
        self.state = Some(self.a * state + self.b * command + self.gain * (position - state[0]));
    }

    /// Its transfer at z from a command and from a position: w = W_u u + W_y y.
    pub(super) fn at(&self, z: Complex<f64>) -> [Complex<f64>; 2] {
        // s⁺ = (A − L c) s + b u + L y,  w = s₃: the third row of (z I − A + L c)⁻¹ by its minors
        let own = self.a - self.gain * RowVector3::new(1.0, 0.0, 0.0);
        let n = |i: usize, j: usize| if i == j { z - own[(i, j)] } else { Complex::new(-own[(i, j)], 0.0) };
        let row = [
            n(1, 0) * n(2, 1) - n(1, 1) * n(2, 0),
            n(0, 1) * n(2, 0) - n(0, 0) * n(2, 1),
            n(0, 0) * n(1, 1) - n(0, 1) * n(1, 0),
        ];
        let inverse = (n(0, 2) * row[0] + n(1, 2) * row[1] + n(2, 2) * row[2]).inv();
        [self.b, self.gain].map(|from| (row[0] * from[0] + row[1] * from[1] + row[2] * from[2]) * inverse)
    }

    /// Forgets.
    pub fn reset(&mut self) {
        self.state = None;
    }

    /// Shows its memory to a function that takes all of it.
    pub(super) fn memory(&mut self, memory: &mut Memory) -> Option<()> {
        let mut state = self.state.map(|state| [state[0], state[1], state[2]]);
        optional(&mut state, memory)?;
        self.state = state.map(Vector3::from);
        Some(())
    }
}
