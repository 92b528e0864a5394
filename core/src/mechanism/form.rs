//! Linear forms of the state: forces in the notation of the paper that can be evaluated, differentiated and bounded.

use super::{BODIES, CURRENTS, DRIVES, Layout, Mechanism, SPRINGS, State};
use std::ops::{Add, Mul, Neg, Sub};

/// A force, torque, current or rate as a linear form of the springs' lengths, speeds, currents, inputs, and one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Form {
    /// Coefficients of the springs' lengths s = A q.
    pub stretch: [f64; SPRINGS],
    /// Coefficients of the bodies' speeds.
    pub speed: [f64; BODIES],
    /// Coefficients of the armature currents that are states.
    pub current: [f64; CURRENTS],
    /// Coefficients of the inputs.
    pub input: [f64; DRIVES],
    /// The constant part.
    pub constant: f64,
}

impl Form {
    /// The form that is always zero.
    pub const ZERO: Form = Form {
        stretch: [0.0; SPRINGS],
        speed: [0.0; BODIES],
        current: [0.0; CURRENTS],
        input: [0.0; DRIVES],
        constant: 0.0,
    };

    /// The length of a spring.
    pub fn stretch(spring: usize) -> Form {
        let mut form = Form::ZERO;
        form.stretch[spring] = 1.0;
        form
    }

    /// The speed of a body.
    pub fn speed(body: usize) -> Form {
        let mut form = Form::ZERO;
        form.speed[body] = 1.0;
        form
    }

    /// A current as a state, by its number.
    pub fn current(number: usize) -> Form {
        let mut form = Form::ZERO;
        form.current[number] = 1.0;
        form
    }

    /// The input of a drive.
    pub fn input(drive: usize) -> Form {
        let mut form = Form::ZERO;
        form.input[drive] = 1.0;
        form
    }

    /// A number.
    pub fn constant(value: f64) -> Form {
        Form { constant: value, ..Form::ZERO }
    }

    /// Subtracts `factor` times another form.
    pub(super) fn subtract(&mut self, factor: f64, other: &Form) {
        fn off<const N: usize>(own: &mut [f64; N], factor: f64, other: &[f64; N]) {
            own.iter_mut().zip(other).for_each(|(own, other)| *own -= other * factor);
        }
        off(&mut self.stretch, factor, &other.stretch);
        off(&mut self.speed, factor, &other.speed);
        off(&mut self.current, factor, &other.current);
        off(&mut self.input, factor, &other.input);
        self.constant -= other.constant * factor;
    }

    /// Its coefficients with respect to positions, speeds and currents of a complete state.
    pub fn on_state(&self, mechanism: &Mechanism) -> State {
        let mut row = State { position: [0.0; BODIES], speed: self.speed, current: self.current };
        for (spring, factor) in mechanism.springs.iter().zip(self.stretch) {
            for &(body, arm) in &spring.arms {
                row.position[body] += factor * arm;
            }
        }
        row
    }

    /// Its value, from elongations rather than large positions, to avoid cancellation.
    pub fn value(&self, mechanism: &Mechanism, state: &State, input: &[f64; DRIVES]) -> f64 {
        let mut stretch = [0.0; SPRINGS];
        for (index, stretch) in stretch.iter_mut().enumerate().take(mechanism.springs.len()) {
            *stretch = mechanism.length(index, &state.position);
        }
        self.value_at(&stretch, state, input)
    }

    /// Its value at these lengths, with speeds and currents from `state` in any coordinates.
    #[inline]
    pub(crate) fn value_at(&self, stretch: &[f64; SPRINGS], state: &State, input: &[f64; DRIVES]) -> f64 {
        fn add(sum: f64, coefficients: &[f64], values: &[f64]) -> f64 {
            coefficients.iter().zip(values).fold(sum, |sum, (coefficient, value)| sum + coefficient * value)
        }
        let sum = add(0.0, &self.stretch, stretch);
        let sum = add(sum, &self.speed, &state.speed);
        add(add(sum, &self.current, &state.current), &self.input, input) + self.constant
    }

    /// An estimate of the rounding error of its value; `inner` is a state in the solvers' coordinates.
    pub(crate) fn noise(&self, layout: &Layout, inner: &State, input: &[f64; DRIVES]) -> f64 {
        fn sizes(coefficients: &[f64], values: &[f64]) -> f64 {
            coefficients.iter().zip(values).map(|(coefficient, value)| (coefficient * value).abs()).sum()
        }
        let row = layout.on_coordinates(self);
        let size = self.constant.abs()
            + sizes(&self.input, input)
            + sizes(&row.position, &inner.position)
            + sizes(&row.speed, &inner.speed)
            + sizes(&row.current, &inner.current);
        ROUNDING * size
    }
}

/// Rounding error of the value of a form relative to its largest terms.
pub const ROUNDING: f64 = 5e-15;

impl Add for Form {
    type Output = Form;
    fn add(self, other: Form) -> Form {
        Form {
            stretch: std::array::from_fn(|j| self.stretch[j] + other.stretch[j]),
            speed: std::array::from_fn(|j| self.speed[j] + other.speed[j]),
            current: std::array::from_fn(|j| self.current[j] + other.current[j]),
            input: std::array::from_fn(|j| self.input[j] + other.input[j]),
            constant: self.constant + other.constant,
        }
    }
}

impl Mul<f64> for Form {
    type Output = Form;
    fn mul(self, factor: f64) -> Form {
        Form {
            stretch: self.stretch.map(|c| c * factor),
            speed: self.speed.map(|c| c * factor),
            current: self.current.map(|c| c * factor),
            input: self.input.map(|c| c * factor),
            constant: self.constant * factor,
        }
    }
}

impl Neg for Form {
    type Output = Form;
    fn neg(self) -> Form {
        self * -1.0
    }
}

impl Sub for Form {
    type Output = Form;
    fn sub(self, other: Form) -> Form {
        self + -other
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::uniform;
    use crate::mechanism::testing::{body, spring};
    use rand_pcg::Pcg64;

    /// Two bodies on a spring.
    fn mechanism() -> Mechanism {
        let spring = spring(&[(0, 1.0), (1, -1.0)], 1e4);
        Mechanism::new(vec![body(0, 1.0), body(1, 1.0)], vec![spring], Vec::new())
    }

    #[test]
    fn a_stretch_is_the_sum_of_positions_times_their_arms() {
        let mut mechanism = mechanism();
        mechanism.springs[0].arms = vec![(0, 0.02), (1, -1.0)];
        let form = Form::stretch(0) * 3.0;
        let row = form.on_state(&mechanism);
        assert!((row.position[0] - 0.06).abs() < 1e-15 && row.position[1] == -3.0, "{row:?}");
        let mut state = State::default();
        state.position[..2].copy_from_slice(&[50.0, 0.4]);
        assert!((form.value(&mechanism, &state, &[0.0; DRIVES]) - 3.0 * (0.02 * 50.0 - 0.4)).abs() < 1e-12);
    }

    /// The remainder of terms that cancel is rounding, at most the noise, for any order of the terms.
    #[test]
    fn noise_is_at_least_the_remainder_of_parts_that_cancel() {
        let layout = Layout::new(&mechanism());
        let mut random = Pcg64::new(11, 1);
        let mut number = || (uniform(&mut random) - 0.5) * 10.0_f64.powf(8.0 * uniform(&mut random) - 4.0);
        let mut rounded = 0;
        for part in (0..5).cycle().take(2000) {
            let mut inner = State::default();
            inner.position[..2].copy_from_slice(&[number(), number()]);
            inner.speed[..2].copy_from_slice(&[number(), number()]);
            inner.current[0] = number();
            let mut input = [0.0; DRIVES];
            input[0] = number();
            let mut form = Form::ZERO;
            form.stretch[0] = number();
            form.speed[..2].copy_from_slice(&[number(), number()]);
            (form.current[0], form.input[0], form.constant) = (number(), number(), number());
            // One term cancels the sum of the others.
            let (place, value): (fn(&mut Form) -> &mut f64, f64) = match part {
                0 => (|form| &mut form.stretch[0], layout.stretches(&inner)[0]),
                1 => (|form| &mut form.speed[0], inner.speed[0]),
                2 => (|form| &mut form.current[0], inner.current[0]),
                3 => (|form| &mut form.input[0], input[0]),
                _ => (|form| &mut form.constant, 1.0),
            };
            *place(&mut form) = 0.0;
            *place(&mut form) = -layout.value(&form, &inner, &input) / value;
            let (left, noise) = (layout.value(&form, &inner, &input).abs(), form.noise(&layout, &inner, &input));
            assert!(left <= noise, "{part}: {left:e} remains, the noise is {noise:e}");
            rounded += usize::from(left > 0.0);
        }
        assert!(rounded > 500);
    }
}
