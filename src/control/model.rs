//! The axis as a sampled linear system, for observers and regulators: everything slides, dry friction apart.

use super::measures_cart;
use crate::friction::Motion;
use crate::plant::{Body, Contact, Form, Mode, Plant, ROTOR, place};
use crate::stage::{EncoderPlace, Stage};
use nalgebra::{DMatrix, DVector, RowDVector};

/// ẋ = A x + B u + E w, with w a force on the cart; measured position and the cart's position and speed from x. SI units.
#[derive(Debug, Clone)]
pub struct Linear {
    /// A.
    pub a: DMatrix<f64>,
    /// B: of the command.
    pub b: DVector<f64>,
    /// E: of a force on the cart, N.
    pub e: DVector<f64>,
    /// Measured position, m along the belt.
    pub measured: RowDVector<f64>,
    /// Position of the cart, m.
    pub cart: RowDVector<f64>,
    /// Its speed, m/s.
    pub cart_speed: RowDVector<f64>,
    /// What each state is, as places of the whole state.
    pub states: Vec<usize>,
}

impl Linear {
    /// That of `stage`.
    pub fn of(stage: &Stage) -> Self {
        let plant = Plant::new(stage);
        let r = stage.pulley_radius;
        let mode = Mode {
            // Flanks of a gear with play touch.
            gear: if plant.has_rotor() { Contact::High } else { Contact::Apart },
            ..Mode::of([Motion::Free; 3])
        };
        let equations = plant.equations(mode);
        let mut states: Vec<usize> = plant.leaders().flat_map(|b| [b.speed_place() - 1, b.speed_place()]).collect();
        if plant.has_current_state() {
            states.push(place::CURRENT);
        }
        if plant.has_rotor() {
            states.extend([place::ROTOR_ANGLE, place::ROTOR_SPEED]);
        }
        // The whole state from these: what follows goes with its leader, a rotor without play with its pulley.
        let n = states.len();
        let mut whole = DMatrix::zeros(place::COUNT, n);
        for (j, &state) in states.iter().enumerate() {
            whole[(state, j)] = 1.0;
        }
        for body in Body::ALL {
            let leader = plant.leader(body);
            if leader != body {
                for offset in [0, 1] {
                    let from = states.iter().position(|&s| s == leader.speed_place() - offset);
                    if let Some(j) = from {
                        whole[(body.speed_place() - offset, j)] = plant.ratio(body);
                    }
                }
            }
        }
        if !plant.has_rotor() {
            for j in 0..n {
                whole[(place::ROTOR_ANGLE, j)] = whole[(place::DRIVE_ANGLE, j)];
                whole[(place::ROTOR_SPEED, j)] = whole[(place::DRIVE_SPEED, j)];
            }
        }
        let row = |form: &Form| RowDVector::from_row_slice(&form.on_state(r)) * &whole;
        let (mut a, mut b, mut e) = (DMatrix::zeros(n, n), DVector::zeros(n), DVector::zeros(n));
        for (i, &state) in states.iter().enumerate() {
            let form = match state {
                place::CURRENT => equations.current_rate,
                place::ROTOR_ANGLE => Form::speed(ROTOR),
                place::ROTOR_SPEED => equations.acceleration[ROTOR],
                place if place % 2 == 0 => Form::speed(place / 2),
                place => equations.acceleration[place / 2],
            };
            a.set_row(i, &row(&form));
            b[i] = form.input;
            if state == place::CART_SPEED {
                e[i] = 1.0 / stage.cart.mass;
            }
        }
        let at = |place: usize| whole.row(place).into_owned();
        let measured = match stage.encoder.map(|encoder| encoder.at) {
            _ if measures_cart(stage) => at(place::CART_POSITION),
            Some(EncoderPlace::DrivePulley) => at(place::DRIVE_ANGLE) * r,
            _ => at(place::ROTOR_ANGLE) * r,
        };
        Self { a, b, e, measured, cart: at(place::CART_POSITION), cart_speed: at(place::CART_SPEED), states }
    }

    /// What happens in `time` (s) with inputs held: e^{A t} and ∫ e^{A s} ds [B E].
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
