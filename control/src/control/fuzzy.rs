//! A fuzzy controller with its table of rules (A. Kulkarni, M. A. El-Sharkawi, "Intelligent precision position control
//! of elastic drive systems", IEEE Transactions on Energy Conversion 16, 2001).

use super::memory::Memory;
use super::sampled::Speed;
use crate::design::Fuzzy;
use crate::signal::profile::Reference;

/// Triangular sets at equal distances that add up to 1, products of memberships, and the mean of the rules' values they
/// weigh.
#[derive(Debug, Clone)]
pub struct FuzzyState {
    rules: Fuzzy,
    every: f64,
    speed: Speed,
    command: f64,
}

impl FuzzyState {
    /// Stepped every `every` s.
    pub fn new(rules: &Fuzzy, every: f64) -> Self {
        Self { rules: rules.clone(), every, speed: Speed::new(every, rules.filter), command: 0.0 }
    }

    /// The next command.
    pub fn step(&mut self, target: &Reference, position: f64) -> f64 {
        let error = target.position - position;
        let rate = target.speed - self.speed.step(position);
        let value = self.rules.command * infer(&self.rules.rules, error / self.rules.error, rate / self.rules.rate);
        self.command = if self.rules.incremental { self.command + self.every * value } else { value };
        self.command
    }

    /// An incremental command goes on from where the limit left it.
    pub fn limited(&mut self, excess: f64) {
        if self.rules.incremental {
            self.command += excess;
        }
    }

    /// Forgets.
    pub fn reset(&mut self) {
        self.speed.reset();
        self.command = 0.0;
    }

    /// Shows its memory to a function that takes all of it.
    pub(super) fn memory(&mut self, memory: &mut Memory) -> Option<()> {
        self.speed.memory(memory)?;
        memory(&mut self.command)
    }
}

/// The output of the rules for an error and its rate, both from −1 to 1; beyond that the outermost sets hold.
pub fn infer(rules: &[Vec<f64>], error: f64, rate: f64) -> f64 {
    // Two sets overlap at any place: which is the lower, and how far the upper holds.
    let place = |value: f64, size: usize| {
        let position = (0.5 * (value.clamp(-1.0, 1.0) + 1.0)) * (size.max(2) - 1) as f64;
        let lower = (position as usize).min(size.saturating_sub(2));
        (lower, position - lower as f64)
    };
    let (i, a) = place(error, rules.len());
    let (j, b) = place(rate, rules.first().map_or(0, Vec::len));
    let rule = |i: usize, j: usize| rules.get(i).and_then(|row| row.get(j)).copied().unwrap_or(0.0);
    (1.0 - a) * ((1.0 - b) * rule(i, j) + b * rule(i, j + 1))
        + a * ((1.0 - b) * rule(i + 1, j) + b * rule(i + 1, j + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_hold_at_their_sets_and_blend_between_them() {
        let rules = vec![vec![-1.0, -0.5, 0.0], vec![-0.5, 0.0, 0.5], vec![0.0, 0.5, 1.0]];
        assert_eq!(infer(&rules, 0.0, 0.0), 0.0);
        assert_eq!(infer(&rules, 1.0, 1.0), 1.0);
        assert_eq!(infer(&rules, -3.0, -1.0), -1.0);
        assert_eq!(infer(&rules, 0.5, 0.0), 0.25);
        assert_eq!(infer(&rules, 1.0, -1.0), 0.0);
    }
}
