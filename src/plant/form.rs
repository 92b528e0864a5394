//! Linear forms of the state: forces written as the paper writes them, and evaluated, differentiated and bounded by machine.

use super::{Plant, State, place};
use std::ops::{Add, Mul, Neg, Sub};

/// A force, torque, current or rate as a linear form of the three stretches, the three speeds, the current, the input, and one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Form {
    /// Coefficients of the stretches r φ₁ − x, x − r φ₃, r φ₃ − r φ₁ (m).
    pub stretch: [f64; 3],
    /// Coefficients of φ̇₁, ẋ, φ̇₃.
    pub speed: [f64; 3],
    /// Coefficient of the armature current, where it is a state.
    pub current: f64,
    /// Coefficient of the input.
    pub input: f64,
    /// The constant part.
    pub constant: f64,
}

impl Form {
    /// The form that is always zero.
    pub const ZERO: Form = Form { stretch: [0.0; 3], speed: [0.0; 3], current: 0.0, input: 0.0, constant: 0.0 };

    /// The stretch of span `index` + 1.
    pub fn stretch(index: usize) -> Form {
        let mut form = Form::ZERO;
        form.stretch[index] = 1.0;
        form
    }

    /// The speed of body `index`.
    pub fn speed(index: usize) -> Form {
        let mut form = Form::ZERO;
        form.speed[index] = 1.0;
        form
    }

    /// The armature current as a state.
    pub fn current() -> Form {
        Form { current: 1.0, ..Form::ZERO }
    }

    /// The input.
    pub fn input() -> Form {
        Form { input: 1.0, ..Form::ZERO }
    }

    /// A number.
    pub fn constant(value: f64) -> Form {
        Form { constant: value, ..Form::ZERO }
    }

    /// Coefficients with respect to the state vector, for pulleys of radius `r`.
    pub fn on_state(&self, r: f64) -> State {
        let [d1, d2, d3] = self.stretch;
        let mut row = [0.0; place::COUNT];
        row[place::DRIVE_ANGLE] = r * (d1 - d3);
        row[place::CART_POSITION] = d2 - d1;
        row[place::IDLER_ANGLE] = r * (d3 - d2);
        row[place::DRIVE_SPEED] = self.speed[0];
        row[place::CART_SPEED] = self.speed[1];
        row[place::IDLER_SPEED] = self.speed[2];
        row[place::CURRENT] = self.current;
        row
    }

    /// Its value, from stretches rather than from large positions, so that little is lost to cancellation.
    #[inline]
    pub fn value(&self, plant: &Plant, state: &State, input: f64) -> f64 {
        let stretch = stretches(plant.stage().pulley_radius, state);
        let mut sum = 0.0;
        for (&coefficient, stretch) in self.stretch.iter().zip(stretch) {
            sum += coefficient * stretch;
        }
        for (index, &coefficient) in self.speed.iter().enumerate() {
            sum += coefficient * state[2 * index + 1];
        }
        sum + self.current * state[place::CURRENT] + self.input * input + self.constant
    }
}

/// What rounding may do to the value of a form, as a share of its largest parts.
pub(crate) const ROUNDING: f64 = 5e-15;

impl Form {
    /// An estimate of the rounding error of its value at this state.
    pub fn noise(&self, plant: &Plant, state: &State, input: f64) -> f64 {
        let r = plant.stage().pulley_radius;
        let row = self.on_state(r);
        let mut size = (self.input * input).abs() + self.constant.abs();
        for (coefficient, value) in row.iter().zip(state) {
            size += (coefficient * value).abs();
        }
        ROUNDING * size
    }
}

/// The stretches of the three spans, m.
pub fn stretches(r: f64, state: &State) -> [f64; 3] {
    let (p1, x, p3) = (r * state[place::DRIVE_ANGLE], state[place::CART_POSITION], r * state[place::IDLER_ANGLE]);
    [p1 - x, x - p3, p3 - p1]
}

fn zip(a: [f64; 3], b: [f64; 3], f: impl Fn(f64, f64) -> f64) -> [f64; 3] {
    [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2])]
}

impl Add for Form {
    type Output = Form;
    fn add(self, other: Form) -> Form {
        Form {
            stretch: zip(self.stretch, other.stretch, |a, b| a + b),
            speed: zip(self.speed, other.speed, |a, b| a + b),
            current: self.current + other.current,
            input: self.input + other.input,
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
            current: self.current * factor,
            input: self.input * factor,
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
