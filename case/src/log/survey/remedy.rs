//! Remedies for a log, each to be tested by running a model with and without it.

use super::Jump;
use crate::log::{Log, Quantity};

/// A change of a log with which a suspicion would be gone.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Remedy {
    /// Another sign of what went in.
    Reverse,
    /// Another sign of an output.
    Flip(Quantity),
    /// A factor on an output.
    Scale(Quantity, f64),
    /// Another unit of an output that is implausible for the machine of the case.
    Unit(Quantity, f64),
    /// Of two outputs the first is this many times the second.
    Ratio(Quantity, Quantity, f64),
    /// Two outputs change places.
    Exchange(Quantity, Quantity),
    /// An output that is a magnitude.
    Magnitude(Quantity),
    /// Jumps of this size taken out of an output.
    Unwrap(Quantity, f64),
    /// Jumps taken out of an output.
    Step(Quantity, Vec<Jump>),
    /// Samples of an output that do not count.
    Leave(Quantity, Vec<usize>),
    /// The inputs so many samples later than it is logged; earlier if negative.
    Shift(isize),
    /// A factor on the inputs.
    Drive(f64),
}

impl Remedy {
    /// Changes a log. Of a ratio, it is the first output that changes.
    pub fn apply(&self, log: &mut Log) {
        let mut of = |quantity: &Quantity, change: &mut dyn FnMut(&mut Vec<f64>)| {
            for output in log.outputs.iter_mut().filter(|output| output.quantity == *quantity) {
                change(&mut output.values);
            }
        };
        let scaled = |values: &mut Vec<f64>, factor: f64| values.iter_mut().for_each(|value| *value *= factor);
        match self {
            Self::Reverse => {
                for output in log.outputs.iter_mut().filter(|output| !output.absolute) {
                    scaled(&mut output.values, -1.0);
                }
            }
            Self::Flip(quantity) => of(quantity, &mut |values| scaled(values, -1.0)),
            Self::Scale(quantity, factor) | Self::Unit(quantity, factor) => {
                of(quantity, &mut |values| scaled(values, *factor));
            }
            Self::Ratio(quantity, _, ratio) => of(quantity, &mut |values| scaled(values, 1.0 / ratio)),
            Self::Exchange(a, b) => {
                for output in &mut log.outputs {
                    output.quantity = match output.quantity {
                        quantity if quantity == *a => *b,
                        quantity if quantity == *b => *a,
                        quantity => quantity,
                    };
                }
            }
            Self::Magnitude(quantity) => {
                log.outputs.iter_mut().filter(|output| output.quantity == *quantity).for_each(|o| o.absolute = true);
            }
            Self::Unwrap(quantity, turn) => of(quantity, &mut |values| unwrap(values, *turn)),
            Self::Step(quantity, jumps) => of(quantity, &mut |values| {
                for &Jump { sample, size, .. } in jumps {
                    values.iter_mut().skip(sample).for_each(|value| *value -= size);
                }
            }),
            Self::Shift(rows) => {
                for input in &mut log.inputs {
                    let last = input.len().saturating_sub(1);
                    let at = |k: usize| input[k.saturating_add_signed(-rows).min(last)];
                    *input = (0..input.len()).map(at).collect();
                }
            }
            Self::Drive(factor) => log.inputs.iter_mut().for_each(|input| scaled(input, *factor)),
            Self::Leave(quantity, samples) => of(quantity, &mut |values| {
                for &k in samples {
                    values[k] = f64::NAN;
                }
            }),
        }
    }
}

/// Takes jumps of about `turn` out.
fn unwrap(values: &mut [f64], turn: f64) {
    let (mut off, mut last) = (0.0, f64::NAN);
    for value in values.iter_mut() {
        let own = *value;
        // The nearest number of turns, where there is a jump at all.
        let jump = ((own - last) / turn).round();
        if jump.is_finite() {
            off -= jump * turn;
        }
        last = own;
        *value = own + off;
    }
}

#[cfg(test)]
mod tests {
    use super::{Remedy, unwrap};
    use crate::log::Log;
    use crate::signal::Hold;

    #[test]
    fn a_shifted_input_keeps_its_ends() {
        let shifted = |rows: isize| {
            let mut log = Log {
                name: "log".into(),
                file: "log.csv".into(),
                time: vec![0.0, 1.0, 2.0, 3.0],
                inputs: vec![vec![1.0, 2.0, 3.0, 4.0]],
                added: None,
                hold: Hold::Zero,
                reference: None,
                outputs: Vec::new(),
                ended: None,
            };
            Remedy::Shift(rows).apply(&mut log);
            log.inputs.remove(0)
        };
        assert_eq!(shifted(1), [1.0, 1.0, 2.0, 3.0]);
        assert_eq!(shifted(-2), [3.0, 4.0, 4.0, 4.0]);
        assert_eq!(shifted(9), [1.0; 4]);
    }

    #[test]
    fn an_angle_that_wraps_goes_on() {
        let turn = std::f64::consts::TAU;
        let straight: Vec<f64> = (0..400).map(|k| 0.1 * f64::from(k) - 0.0005 * f64::from(k * k)).collect();
        let mut values: Vec<f64> = straight.iter().map(|v| (v + 3.0).rem_euclid(turn)).collect();
        unwrap(&mut values, turn);
        for (value, straight) in values.iter().zip(&straight) {
            assert!((value - 3.0 - straight).abs() < 1e-12);
        }
    }
}
