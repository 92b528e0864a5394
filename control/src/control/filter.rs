//! Filters on the command.

use crate::calculator::{Calculator, Slot, Slots};
use crate::design::Filter;
use std::f64::consts::PI;

/// A second-order filter, stepped once a sample.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Biquad {
    b: [f64; 3],
    a: [f64; 2],
    state: [Slot; 2],
}

impl Biquad {
    /// Sampled every `every` s by Tustin's rule, exact at the filter's own frequency.
    pub fn new(slots: &mut Slots, filter: &Filter, every: f64) -> Self {
        let (frequency, zeros, poles) = match *filter {
            Filter::Notch { frequency, depth, damping } => (frequency, [1.0, 2.0 * depth, 1.0], damping),
            Filter::LowPass { frequency, damping } => (frequency, [0.0, 0.0, 1.0], damping),
        };
        // s → ω/tan(ω T/2) (z − 1)/(z + 1); frequencies are clipped below half the sampling rate.
        let angle = (PI * frequency * every).min(0.49 * PI);
        let c = 1.0 / angle.tan();
        // With s̃ = s/ω = c (1 − q)/(1 + q), q = 1/z:  n₂ s̃² + n₁ s̃ + n₀ over s̃² + 2 ζ s̃ + 1
        let [n2, n1, n0] = zeros;
        let over =
            |n2: f64, n1: f64, n0: f64| [n2 * c * c + n1 * c + n0, 2.0 * (n0 - n2 * c * c), n2 * c * c - n1 * c + n0];
        let [a0, a1, a2] = over(1.0, 2.0 * poles, 1.0);
        let about = match filter {
            Filter::Notch { .. } => "of a notch",
            Filter::LowPass { .. } => "of a low-pass",
        };
        let state = [slots.add("filter", about), slots.add("filter", about)];
        Self { b: over(n2, n1, n0).map(|b| b / a0), a: [a1 / a0, a2 / a0], state }
    }

    /// The next value.
    pub fn step<C: Calculator>(&self, c: &mut C, input: C::N) -> C::N {
        // Transposed direct form II: (b₀ + b₁ q + b₂ q²)/(1 + a₁ q + a₂ q²), q = 1/z.
        let [first, second] = self.state;
        let input = c.name("unfiltered", input);
        let output = input * self.b[0] + c.memory(first);
        let output = c.name("filtered", output);
        let next = input * self.b[1] - output * self.a[0] + c.memory(second);
        c.keep(first, next);
        c.keep(second, input * self.b[2] - output * self.a[1]);
        output
    }

    /// Frequency of its poles, rad/s, sampled every `every` s.
    pub fn frequency(&self, every: f64) -> f64 {
        // z² + a₁ z + a₂ with |z|² = a₂ and Re z = −a₁/2
        (-0.5 * self.a[0] / self.a[1].abs().sqrt().max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0).acos() / every
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calculator::Evaluation;

    fn gain(filter: &Filter, frequency: f64) -> f64 {
        let every = 1e-3;
        let mut slots = Slots::default();
        let biquad = Biquad::new(&mut slots, filter, every);
        let mut memory = vec![0.0; slots.count()];
        let (mut re, mut im) = (0.0, 0.0);
        for k in 0..20_000 {
            let phase = 2.0 * PI * frequency * every * k as f64;
            let y = biquad.step(&mut Evaluation::on(&mut memory), phase.sin());
            if k >= 10_000 {
                re += y * phase.sin() / 5_000.0;
                im += y * phase.cos() / 5_000.0;
            }
        }
        f64::hypot(re, im)
    }

    #[test]
    fn a_notch_takes_out_its_frequency_and_leaves_others() {
        let notch = Filter::Notch { frequency: 50.0, depth: 0.05, damping: 0.5 };
        assert!((gain(&notch, 50.0) - 0.1).abs() < 1e-6, "{}", gain(&notch, 50.0));
        assert!((gain(&notch, 1.0) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_low_pass_of_critical_damping_halves_at_its_frequency() {
        let low = Filter::LowPass { frequency: 50.0, damping: 1.0 };
        assert!((gain(&low, 50.0) - 0.5).abs() < 1e-6);
        assert!(gain(&low, 400.0) < 0.01);
    }
}
