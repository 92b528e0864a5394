//! A controller as a linear filter of what it measures, for margins and stability: within its limit, without reference
//! and counts.

use super::compensation::Rigid;
use super::filter::Biquad;
use super::observer::DisturbanceState;
use super::state_feedback::{Parts, StateFeedbackState};
use crate::design::{Cascade, Design, Pid, Structure};
use crate::error::{Error, Result};
use crate::linear::{SMALL, solve_shifted};
use crate::stage::Stage;
use nalgebra::{Complex, DVector};
use std::f64::consts::PI;

/// The controller of a design as D u = −(N_y y + N_i i), with y the measured position and i the measured current at a
/// sample.
#[derive(Debug, Clone)]
pub struct Feedback {
    every: f64,
    core: Core,
    filters: Vec<Biquad>,
    observer: Option<DisturbanceState>,
}

#[derive(Debug, Clone)]
enum Core {
    Pid(Pid),
    Cascade(Cascade),
    StateFeedback(Box<Parts>),
}

/// N_y, N_i and D at one frequency. D has no poles but stable ones: unstable controllers show as zeros of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Terms {
    /// N_y, V/m or A/m.
    pub position: Complex<f64>,
    /// N_i, V/A; zero without a current loop.
    pub current: Complex<f64>,
    /// D.
    pub own: Complex<f64>,
}

impl Feedback {
    /// That of a design for a model of the axis; fails for structures that are not linear.
    pub fn new(design: &Design, model: &Stage) -> Result<Self> {
        let core = match &design.structure {
            Structure::Pid(gains) => Core::Pid(*gains),
            Structure::Cascade(gains) => Core::Cascade(*gains),
            Structure::StateFeedback(weights) => {
                Core::StateFeedback(Box::new(StateFeedbackState::new(weights, model, design)?.parts()))
            }
            other => {
                return Err(Error::new(format!("{} is no linear controller: it has no margins", other.name()))
                    .allowed("pid, cascade and state_feedback"));
            }
        };
        let observer = match design.disturbance_observer {
            None => None,
            Some(observer) => DisturbanceState::new(observer.bandwidth, &Rigid::of(model), design.every),
        };
        let filters = design.filters.iter().map(|filter| Biquad::new(filter, design.every)).collect();
        Ok(Self { every: design.every, core, filters, observer })
    }

    /// At z = e^{jωT}; ω in rad/s, above zero.
    pub fn at(&self, omega: f64) -> Terms {
        let t = self.every;
        let z = Complex::new(0.0, omega * t).exp();
        let one = Complex::new(1.0, 0.0);
        // z − 1 without the loss of a difference
        let change = Complex::new(0.0, 2.0 * (0.5 * omega * t).sin()) * Complex::new(0.0, 0.5 * omega * t).exp();
        let filter = self.filters.iter().fold(one, |product, filter| product * filter.at(z));
        let (position, current, own) = match &self.core {
            Core::Pid(gains) => (pid(gains, t, z, change), Complex::ZERO, (one, Complex::ZERO)),
            Core::Cascade(gains) => {
                let (position, current) = cascade(gains, t, z, change);
                (position, current, (one, Complex::ZERO))
            }
            Core::StateFeedback(parts) => {
                let (position, delayed, input) = parts.at(z, change);
                (position, Complex::ZERO, (delayed, input))
            }
        };
        // w = W_u u + W_y y, and u = H v − w with v D₀ = −(N y + N_i i + N_u u)
        let [on_command, on_position] = self.observer.as_ref().map_or([Complex::ZERO; 2], |observer| observer.at(z));
        let (delayed, input) = own;
        Terms {
            position: filter * position + delayed * on_position,
            current: filter * current,
            own: delayed * (one + on_command) + filter * input,
        }
    }

    /// Frequencies at which it changes quickly, rad/s.
    pub fn corners(&self) -> Vec<f64> {
        self.filters.iter().map(|filter| filter.frequency(self.every)).collect()
    }
}

/// K_p + K_i T z/(z − 1) + K_d (z − 1)/(T_f (z − 1) + T z), backward differences
fn pid(gains: &Pid, t: f64, z: Complex<f64>, change: Complex<f64>) -> Complex<f64> {
    let time = 1.0 / (2.0 * PI * gains.filter);
    let slope = change / (change * time + z * t);
    let integral = if gains.integral == 0.0 { Complex::ZERO } else { z * (gains.integral * t) / change };
    slope * gains.derivative + integral + gains.proportional
}

/// (K_s + K_si T z/(z − 1)) (K_v + V(z)), V the filtered difference; with a current loop that times its own controller.
fn cascade(gains: &Cascade, t: f64, z: Complex<f64>, change: Complex<f64>) -> (Complex<f64>, Complex<f64>) {
    let summed = |proportional: f64, integral: f64| match integral {
        0.0 => Complex::new(proportional, 0.0),
        _ => z * (integral * t) / change + proportional,
    };
    let keep = (-2.0 * PI * gains.filter * t).exp();
    // v = (1 − a) z/(z − a) · (1 − 1/z)/T y
    let speed = change * ((1.0 - keep) / t) / (z - keep);
    let outer = summed(gains.speed, gains.speed_integral) * (speed + gains.position);
    match gains.current {
        None => (outer, Complex::ZERO),
        Some(inner) => {
            let inner = summed(inner.proportional, inner.integral);
            (outer * inner, inner)
        }
    }
}

impl Parts {
    /// N_y, D₀ and N_u of the command before filters: v D₀ = −(N_y y + N_u u).
    fn at(&self, z: Complex<f64>, change: Complex<f64>) -> (Complex<f64>, Complex<f64>, Complex<f64>) {
        let n = self.estimate.nrows();
        let inverse = z.inv();
        // x̂⁺ = (I − L m) x̂ + L y,  z x̂ = Φ x̂⁺ + Γ₀ z^{−d} u + Γ₁ z^{−d−1} u
        let lag = inverse.powi(self.lag as i32);
        // kᵀ (I − L m) (z I − Φ (I − L m))⁻¹, a row for both that it is asked of
        let row = self.resolved(z);
        let seen = |from: &dyn Fn(usize) -> Complex<f64>| (0..n).map(|i| row[i] * from(i)).sum::<Complex<f64>>();
        let mut position = seen(&|i| Complex::new(self.corrected[i], 0.0)) + self.direct;
        if let Some(integral) = self.integral {
            position += Complex::new(integral * self.every, 0.0) / change;
        }
        let mut delayed = Complex::new(1.0, 0.0);
        for i in 0..self.pending {
            delayed += inverse.powi(i as i32 + 1) * self.gain[n + i];
        }
        (position, delayed, seen(&|i| lag * self.now[i] + lag * inverse * self.before[i]))
    }

    /// The row kᵀ (I − L m) times the resolvent of the estimate; no numbers on a pole.
    fn resolved(&self, z: Complex<f64>) -> Vec<Complex<f64>> {
        let n = self.estimate.nrows();
        let mut row: Vec<Complex<f64>> = self.row.iter().map(|v| Complex::new(*v, 0.0)).collect();
        let solved = match n <= SMALL {
            true => solve_shifted(&self.estimate, z, true, &mut row),
            false => {
                let mut shifted = self.estimate.transpose().map(|v| Complex::new(-v, 0.0));
                (0..n).for_each(|i| shifted[(i, i)] += z);
                let found = shifted.lu().solve(&DVector::from_column_slice(&row));
                row = found.iter().flat_map(|found| found.iter().copied()).collect();
                row.len() == n
            }
        };
        if solved { row } else { vec![Complex::new(f64::NAN, f64::NAN); n] }
    }
}
