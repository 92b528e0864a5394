//! The axis as a sampled linear system for observers and regulators: everything slides, without dry friction.

use super::measures_cart;
use crate::machine::axis::{CART, DRIVE, SPANS};
use crate::machine::{EncoderPlace, Machine};
use crate::mechanism::{BODIES, Contact, Form, Mode, State};
use nalgebra::{DMatrix, DVector, RowDVector};

/// ẋ = A x + B u + E w, with w a force on the cart; measured position and the cart's position and speed from x. SI
/// units.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Linear {
    /// A.
    pub a: DMatrix<f64>,
    /// B: of the command.
    pub b: DVector<f64>,
    /// E: of a force on the cart, N.
    pub e: DVector<f64>,
    /// Measured position, m along the belt.
    pub measured: RowDVector<f64>,
    /// Cart position by an additional scale, m.
    pub scale: Option<RowDVector<f64>>,
    /// Position of the cart, m.
    pub cart: RowDVector<f64>,
    /// Its speed, m/s.
    pub cart_speed: RowDVector<f64>,
    /// The quantity of each state.
    pub states: Vec<Quantity>,
}

/// A quantity that is a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Position of a body.
    Position(usize),
    /// Speed of a body.
    Speed(usize),
    /// Current of the motor.
    Current,
}

impl Quantity {
    fn value(self, row: &State) -> f64 {
        match self {
            Quantity::Position(body) => row.position[body],
            Quantity::Speed(body) => row.speed[body],
            Quantity::Current => row.current[0],
        }
    }
}

impl Linear {
    /// Model of a machine.
    pub fn new(machine: &Machine) -> Self {
        let mechanism = machine.mechanism();
        let r = machine.pulley_radius;
        let mut mode = Mode::new([]);
        if mechanism.drives[0].has_rotor() {
            // Flanks of a gear with play touch.
            mode.contact[SPANS] = Contact::High;
        }
        let equations = mechanism.equations(mode);
        let pair = |body: usize| [Quantity::Position(body), Quantity::Speed(body)];
        let (held, rotors): (Vec<_>, Vec<_>) = mechanism.leaders().partition(|&body| !mechanism.bodies[body].is_rotor);
        let mut states: Vec<Quantity> = held.into_iter().flat_map(pair).collect();
        if mechanism.drives[0].has_current_state() {
            states.push(Quantity::Current);
        }
        states.extend(rotors.into_iter().flat_map(pair));
        let n = states.len();
        // A form of the complete state as one of these; followers move with their leader.
        let row = |whole: &State| {
            let mut led = State { position: [0.0; BODIES], speed: [0.0; BODIES], ..*whole };
            for body in 0..mechanism.bodies.len() {
                let (leader, ratio) = mechanism.bodies[body].leader;
                led.position[leader] += ratio * whole.position[body];
                led.speed[leader] += ratio * whole.speed[body];
            }
            RowDVector::from_fn(n, |_, j| states[j].value(&led))
        };
        let of_form = |form: &Form| row(&form.on_state(&mechanism));
        let (mut a, mut b, mut e) = (DMatrix::zeros(n, n), DVector::zeros(n), DVector::zeros(n));
        for (i, &state) in states.iter().enumerate() {
            let form = match state {
                Quantity::Current => equations.current_rate[0],
                Quantity::Position(body) => Form::speed(body),
                Quantity::Speed(body) => equations.acceleration[body],
            };
            a.set_row(i, &of_form(&form));
            b[i] = form.input[0];
            if state == Quantity::Speed(CART) {
                e[i] = 1.0 / machine.cart.mass;
            }
        }
        let at = |body: usize| row(&unit(body));
        let measured = match machine.encoder.map(|encoder| encoder.at) {
            _ if measures_cart(machine) => at(CART),
            Some(EncoderPlace::DrivePulley) => at(DRIVE) * r,
            _ => at(mechanism.drives[0].shaft) * r,
        };
        let cart_speed = of_form(&Form::speed(CART));
        let scale = machine.scale.map(|_| at(CART));
        Self { a, b, e, measured, scale, cart: at(CART), cart_speed, states }
    }

    /// The transition over `time` (s) with inputs held: e^{A t} and ∫ e^{A s} ds [B E].
    pub fn sampled(&self, time: f64) -> (DMatrix<f64>, DMatrix<f64>) {
        let n = self.a.nrows();
        let mut whole = DMatrix::zeros(n + 2, n + 2);
        whole.view_mut((0, 0), (n, n)).copy_from(&self.a);
        whole.view_mut((0, n), (n, 1)).copy_from(&self.b);
        whole.view_mut((0, n + 1), (n, 1)).copy_from(&self.e);
        let done = exponential(&(whole * time));
        (done.view((0, 0), (n, n)).into_owned(), done.view((0, n), (n, 2)).into_owned())
    }
}

/// The position of a body as a form of the complete state.
fn unit(body: usize) -> State {
    let mut state = State::default();
    state.position[body] = 1.0;
    state
}

/// e^X by a Taylor series of X/2^k and squaring of e^X − I.
pub fn exponential(x: &DMatrix<f64>) -> DMatrix<f64> {
    let n = x.nrows();
    let norm = (0..n).map(|j| x.column(j).iter().map(|v| v.abs()).sum::<f64>()).fold(0.0, f64::max);
    let halvings = if norm > 0.25 { (norm / 0.25).log2().ceil() as i32 } else { 0 };
    let small = x * 0.5_f64.powi(halvings);
    let (mut term, mut sum) = (small.clone(), small.clone());
    for k in 2..=16 {
        term = &term * &small / f64::from(k);
        sum += &term;
    }
    for _ in 0..halvings {
        // P(2h) = 2 P + P²
        sum = &sum * 2.0 + &sum * &sum;
    }
    sum + DMatrix::identity(n, n)
}
