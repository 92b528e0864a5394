//! Linear forms of the state: forces written as the paper writes them, and evaluated, differentiated and bounded by machine.

use super::{Plant, State, place};
use std::ops::{Add, Mul, Neg, Sub};

/// A force, torque, current or rate as a linear form of stretches, speeds, the current, the input, and one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Form {
    /// Coefficients of the stretches r φ₁ − x, x − r φ₃, r φ₃ − r φ₁ (m), of the gear's twist φ_r − φ₁ (rad), and of x (m).
    pub stretch: [f64; STRETCHES],
    /// Coefficients of φ̇₁, ẋ, φ̇₃, φ̇_r.
    pub speed: [f64; SPEEDS],
    /// Coefficient of the armature current, where it is a state.
    pub current: f64,
    /// Coefficient of the input.
    pub input: f64,
    /// The constant part.
    pub constant: f64,
}

/// Number of stretches: three spans, the gear's twist, and where the cart is.
pub(crate) const STRETCHES: usize = 5;
/// The gear's twist among the stretches.
pub(crate) const TWIST: usize = 3;
/// The cart's position among the stretches.
pub(crate) const POSITION: usize = 4;
/// Number of speeds: three bodies and the rotor.
pub(crate) const SPEEDS: usize = 4;
/// The rotor among the speeds.
pub(crate) const ROTOR: usize = 3;

/// Where each speed stands in the state.
const SPEED_PLACE: [usize; SPEEDS] = [place::DRIVE_SPEED, place::CART_SPEED, place::IDLER_SPEED, place::ROTOR_SPEED];

/// What each stretch is, as coefficients of φ₁, x, φ₃ and φ_r, for pulleys of radius `r`.
pub(crate) fn arms(r: f64) -> [[f64; SPEEDS]; STRETCHES] {
    [[r, -1.0, 0.0, 0.0], [0.0, 1.0, -r, 0.0], [-r, 0.0, r, 0.0], [-1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]]
}

impl Form {
    /// The form that is always zero.
    pub const ZERO: Form =
        Form { stretch: [0.0; STRETCHES], speed: [0.0; SPEEDS], current: 0.0, input: 0.0, constant: 0.0 };

    /// A stretch: of span `index` + 1, the gear's twist, or the cart's position.
    pub fn stretch(index: usize) -> Form {
        let mut form = Form::ZERO;
        form.stretch[index] = 1.0;
        form
    }

    /// The speed of body `index`, or of the rotor.
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
        let [d1, d2, d3, twist, position] = self.stretch;
        let mut row = [0.0; place::COUNT];
        row[place::DRIVE_ANGLE] = r * (d1 - d3) - twist;
        row[place::CART_POSITION] = d2 - d1 + position;
        row[place::IDLER_ANGLE] = r * (d3 - d2);
        row[place::ROTOR_ANGLE] = twist;
        for (place, speed) in SPEED_PLACE.into_iter().zip(self.speed) {
            row[place] = speed;
        }
        row[place::CURRENT] = self.current;
        row
    }

    /// Its coefficients in the solvers' coordinates, in which stretches stand in the places of angles; r φ₃ − r φ₁ is −d₁ − d₂.
    pub(crate) fn on_stretches(&self) -> State {
        let [d1, d2, d3, twist, position] = self.stretch;
        let mut row = [0.0; place::COUNT];
        row[place::DRIVE_ANGLE] = d1 - d3;
        row[place::IDLER_ANGLE] = d2 - d3;
        row[place::CART_POSITION] = position;
        row[place::ROTOR_ANGLE] = twist;
        for (place, speed) in SPEED_PLACE.into_iter().zip(self.speed) {
            row[place] = speed;
        }
        row[place::CURRENT] = self.current;
        row
    }

    /// Its value, from stretches rather than from large positions, so that little is lost to cancellation.
    #[inline]
    pub fn value(&self, plant: &Plant, state: &State, input: f64) -> f64 {
        self.value_at(&stretches(plant.stage().pulley_radius, state), state, input)
    }

    /// Its value at these stretches; speeds and current from `state`, in whichever coordinates.
    #[inline]
    pub(crate) fn value_at(&self, stretch: &[f64; STRETCHES], state: &State, input: f64) -> f64 {
        let mut sum = 0.0;
        for (&coefficient, stretch) in self.stretch.iter().zip(stretch) {
            sum += coefficient * stretch;
        }
        for (place, &coefficient) in SPEED_PLACE.into_iter().zip(&self.speed) {
            sum += coefficient * state[place];
        }
        sum + self.current * state[place::CURRENT] + self.input * input + self.constant
    }
}

/// What rounding may do to the value of a form, as a share of its largest parts.
pub(crate) const ROUNDING: f64 = 5e-15;

impl Form {
    /// An estimate of the rounding error of its value; `inner` is a state in the solvers' coordinates.
    pub(crate) fn noise(&self, inner: &State, input: f64) -> f64 {
        let mut size = (self.input * input).abs() + self.constant.abs();
        for (coefficient, value) in self.on_stretches().iter().zip(inner) {
            size += (coefficient * value).abs();
        }
        ROUNDING * size
    }
}

/// The stretches at `state`: of the three spans (m), of the gear (rad), and the cart's position (m).
pub(crate) fn stretches(r: f64, state: &State) -> [f64; STRETCHES] {
    let (p1, x, p3) = (r * state[place::DRIVE_ANGLE], state[place::CART_POSITION], r * state[place::IDLER_ANGLE]);
    [p1 - x, x - p3, p3 - p1, state[place::ROTOR_ANGLE] - state[place::DRIVE_ANGLE], x]
}

/// The rates of the stretches at `state`.
pub(crate) fn rates(r: f64, state: &State) -> [f64; STRETCHES] {
    let [w1, v, w3, rotor] = SPEED_PLACE.map(|place| state[place]);
    [r * w1 - v, v - r * w3, r * w3 - r * w1, rotor - w1, v]
}

impl Add for Form {
    type Output = Form;
    fn add(self, other: Form) -> Form {
        Form {
            stretch: std::array::from_fn(|j| self.stretch[j] + other.stretch[j]),
            speed: std::array::from_fn(|j| self.speed[j] + other.speed[j]),
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
