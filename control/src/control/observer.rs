//! Disturbance observer.

use crate::calculator::{Calculator, Slot, Slots, less};
use crate::machine::rigid::Rigid;
use nalgebra::{Matrix3, RowVector3, Vector3};

/// Estimates position, speed and a constant disturbance of an axis of one mass from its measured position.
#[derive(Debug, Clone)]
pub struct DisturbanceObserver {
    /// Of s⁺ = A s + b u + L (y − s₁).
    a: Matrix3<f64>,
    b: Vector3<f64>,
    gain: Vector3<f64>,
    state: [Slot; 3],
    began: Slot,
}

impl DisturbanceObserver {
    /// With all poles at `bandwidth`, Hz; none if the axis is not observable.
    pub fn new(slots: &mut Slots, bandwidth: f64, rigid: &Rigid, every: f64) -> Option<Self> {
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
        if !gain.iter().all(|g| g.is_finite()) {
            return None;
        }
        let began = slots.add("observing", "1 once the observer has begun");
        let state = [("position", "m"), ("speed", "m/s"), ("disturbance", "as a command")]
            .map(|(of, about)| slots.add(format!("observed_{of}"), about));
        Some(Self { a, b, gain, state, began })
    }

    /// Estimated disturbance at the command, V or A.
    pub fn disturbance<C: Calculator>(&self, c: &mut C) -> C::N {
        c.memory(self.state[2])
    }

    /// Updates the estimate by a measured position and the command that acts from then on.
    pub fn step<C: Calculator>(&self, c: &mut C, position: C::N, command: C::N) {
        let one = c.number(1.0);
        let [first, speed, disturbance] = self.state.map(|slot| c.memory(slot));
        let began = c.memory(self.began);
        let first = c.choose(less(began, 0.5), position, first);
        c.keep(self.began, one);
        let surprise = c.name("surprise", position - first);
        for (i, slot) in self.state.into_iter().enumerate() {
            let [a, b, d] = [0, 1, 2].map(|j| self.a[(i, j)]);
            let next = first * a + speed * b + disturbance * d + command * self.b[i] + surprise * self.gain[i];
            c.keep(slot, next);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, TEMPLATE};

    /// v = (1 − e^(−x)) F/d and its integral, by their series, on both sides of the change between formulas.
    #[test]
    fn a_mass_with_drag_is_predicted_exactly() {
        let rigid = Rigid::new(&Case::from_text("axis.toml", TEMPLATE).unwrap().machine);
        let (rate, push) = (rigid.drag() / rigid.mass, rigid.force_per_command() / rigid.mass);
        for x in [1e-6, 9e-4, 1.1e-3, 0.3] {
            let every = x / rate;
            let observer = DisturbanceObserver::new(&mut Slots::default(), 0.1 * rate, &rigid, every).unwrap();
            // Σ (−x)^k/(k + order)!
            let series = |order: u32| -> f64 {
                let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
                (0..12).map(|k| (-x).powi(k) / factorial(k as u32 + order)).sum()
            };
            let expected = [push * every * every * series(2), push * every * series(1), 0.0];
            for (found, expected) in observer.b.iter().zip(expected) {
                assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{x}: {found} for {expected}");
            }
        }
    }
}
