//! A fuzzy controller with its table of rules (A. Kulkarni, M. A. El-Sharkawi, "Intelligent precision position control
//! of elastic drive systems", IEEE Transactions on Energy Conversion 16, 2001).

use super::law::{Law, LawInputs, Speed};
use crate::calculator::{Calculator, Slot, Slots};
use crate::design::Fuzzy;

/// Evenly spaced triangular sets that add up to 1, products of memberships, and the weighted mean of the rules' values.
#[derive(Debug, Clone)]
pub(crate) struct FuzzyLaw {
    rules: Fuzzy,
    every: f64,
    speed: Speed,
    command: Slot,
}

impl FuzzyLaw {
    /// Stepped every `every` s.
    pub fn new(slots: &mut Slots, rules: &Fuzzy, every: f64) -> Self {
        let speed = Speed::new(slots, every, rules.filter);
        Self { rules: rules.clone(), every, speed, command: slots.add("so_far", "the command so far") }
    }
}

impl Law for FuzzyLaw {
    fn about(&self) -> &'static str {
        "table of rules"
    }

    fn commands_current(&self) -> bool {
        false
    }

    fn is_linear(&self) -> bool {
        false
    }

    fn step<C: Calculator>(&self, c: &mut C, seen: &LawInputs<C::N>) -> C::N {
        let rules = &self.rules;
        let error = seen.target.position - seen.position;
        let rate = seen.target.speed - self.speed.step(c, seen.position);
        let value = infer(c, &rules.rules, error / rules.error, rate / rules.rate) * rules.command;
        if !rules.incremental {
            return value;
        }
        let command = c.memory(self.command) + value * self.every;
        let command = c.name("command", command);
        c.keep(self.command, command);
        command
    }

    /// An incremental command continues from the limited value.
    fn limited<C: Calculator>(&self, c: &mut C, excess: C::N, _: C::N) {
        if self.rules.incremental {
            let command = c.memory(self.command) + excess;
            c.keep(self.command, command);
        }
    }
}

/// The output of the rules for an error and its rate, both from −1 to 1; beyond that the outermost sets hold.
pub(crate) fn infer<C: Calculator>(c: &mut C, rules: &[Vec<f64>], error: C::N, rate: C::N) -> C::N {
    // Two sets overlap at any point: index of the lower one, and membership of the upper one.
    let size = rules.len();
    let mut place = |[value, set, share]: [&'static str; 3], of: C::N| {
        let of = c.name(value, of);
        let within = c.within(of, -1.0, 1.0);
        let place = c.name(value, (within + 1.0) * 0.5 * (size.max(2) - 1) as f64);
        let whole = c.whole(place);
        let lower = c.within(whole, 0.0, size.saturating_sub(2) as f64);
        let lower = c.name(set, lower);
        (lower, c.name(share, place - lower))
    };
    let (i, a) = place(["error", "error_set", "error_share"], error);
    let (j, b) = place(["rate", "rate_set", "rate_share"], rate);
    let [ll, lh, hl, hh] = c.neighbours(rules, i, j);
    let low = (-a + 1.0) * ((-b + 1.0) * ll + b * lh);
    let high = a * ((-b + 1.0) * hl + b * hh);
    low + high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calculator::Evaluation;

    #[test]
    fn rules_hold_at_their_sets_and_blend_between_them() {
        let rules = vec![vec![-1.0, -0.5, 0.0], vec![-0.5, 0.0, 0.5], vec![0.0, 0.5, 1.0]];
        assert_eq!(infer(&mut Evaluation::plain(), &rules, 0.0, 0.0), 0.0);
        assert_eq!(infer(&mut Evaluation::plain(), &rules, 1.0, 1.0), 1.0);
        assert_eq!(infer(&mut Evaluation::plain(), &rules, -3.0, -1.0), -1.0);
        assert_eq!(infer(&mut Evaluation::plain(), &rules, 0.5, 0.0), 0.25);
        assert_eq!(infer(&mut Evaluation::plain(), &rules, 1.0, -1.0), 0.0);
    }
}
