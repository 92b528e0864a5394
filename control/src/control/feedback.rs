//! A controller as a linear filter of what it measures, for margins and stability: within its limit, without reference
//! and counts.

use super::filter::Biquad;
use super::observer::DisturbanceState;
use super::standard::observed;
use super::state_feedback::{Law, StateFeedbackState};
use crate::design::{Cascade, Design, Pid, Structure};
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::machine::rigid::Rigid;
use nalgebra::{Complex, DMatrix, DVector, Schur};
use std::f64::consts::PI;

/// Steps of the QR algorithm that Schur's form of an estimate may take: a few for each state do.
const TURNS: usize = 1000;

/// The controller of a design as D u = −(N_y y + N_x x + N_i i), with y the measured position, x the cart on a scale
/// beside that and i the measured current at a sample.
#[derive(Debug, Clone)]
pub struct Feedback {
    every: f64,
    core: Core,
    filters: Vec<Biquad>,
    observer: Option<DisturbanceState>,
    /// Whether there is a scale, and what the observer sees of encoder and scale.
    has_scale: bool,
    weights: [f64; 2],
}

#[derive(Debug, Clone)]
enum Core {
    Pid(Pid),
    Cascade(Cascade),
    StateFeedback(Box<Observed>),
}

/// N_y, N_x, N_i and D at one frequency. D has no poles but stable ones: unstable controllers show as zeros of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Terms {
    /// N_y, V/m or A/m.
    pub position: Complex<f64>,
    /// N_x, V/m or A/m; zero without a scale.
    pub scale: Complex<f64>,
    /// N_i, V/A; zero without a current loop.
    pub current: Complex<f64>,
    /// D.
    pub own: Complex<f64>,
}

/// A frequency as a sampled loop sees it.
#[derive(Debug, Clone, Copy)]
pub struct Turn {
    /// z = e^{jωT}.
    z: Complex<f64>,
    /// z − 1, without the loss of a difference.
    change: Complex<f64>,
}

impl Turn {
    /// That of ω (rad/s) at a sample time T (s).
    pub fn of(omega: f64, t: f64) -> Self {
        let half = Complex::new(0.0, 0.5 * omega * t).exp();
        let change = Complex::new(0.0, 2.0 * half.im) * half;
        Self { z: Complex::new(0.0, omega * t).exp(), change }
    }

    /// (1 − 1/z)/|1 − 1/z| = j e^{−jωT/2}, for the angle of 1 − 1/z.
    pub(crate) fn lag(&self) -> Complex<f64> {
        let whole = self.change / self.z;
        whole / whole.norm()
    }
}

impl Feedback {
    /// That of a design for a model of the axis; fails for structures that are not linear.
    pub fn new(design: &Design, model: &Machine) -> Result<Self> {
        let core = match &design.structure {
            Structure::Pid(gains) => Core::Pid(*gains),
            Structure::Cascade(gains) => Core::Cascade(*gains),
            Structure::StateFeedback(weights) => {
                let state = StateFeedbackState::new(weights, model, design)?;
                Core::StateFeedback(Box::new(Observed::of(state.law())))
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
        let weights = observed(model, &Rigid::of(model));
        Ok(Self { every: design.every, core, filters, observer, has_scale: model.scale.is_some(), weights })
    }

    /// At z = e^{jωT}; ω in rad/s, above zero.
    pub fn at(&self, omega: f64) -> Terms {
        self.at_turn(&Turn::of(omega, self.every))
    }

    /// The same where what belongs to the frequency is known already.
    pub fn at_turn(&self, &Turn { z, change }: &Turn) -> Terms {
        let t = self.every;
        let one = Complex::new(1.0, 0.0);
        let filter = self.filters.iter().fold(one, |product, filter| product * filter.at(z));
        let zero = Complex::ZERO;
        let (position, scale, current, own) = match &self.core {
            Core::Pid(gains) => (pid(gains, t, z, change), zero, zero, (one, zero)),
            Core::Cascade(gains) => {
                let ([speed, position], current) = cascade(gains, t, z, change);
                match self.has_scale {
                    true => (speed, position, current, (one, zero)),
                    false => (speed + position, zero, current, (one, zero)),
                }
            }
            Core::StateFeedback(observed) => {
                let ([position, scale], delayed, input) = observed.at(z, change);
                (position, scale, zero, (delayed, input))
            }
        };
        // w = W_u u + W_y (a y + b x), and u = H v − w with v D₀ = −(N_y y + N_x x + N_i i + N_u u)
        let [on_command, on_position] = self.observer.as_ref().map_or([zero; 2], |observer| observer.at(z));
        let (delayed, input) = own;
        let [encoder, cart] = self.weights.map(|weight| delayed * on_position * weight);
        Terms {
            position: filter * position + encoder,
            scale: filter * scale + cart,
            current: filter * current,
            own: delayed * (one + on_command) + filter * input,
        }
    }

    /// True if it uses the scale beside the encoder: N_x is not zero.
    pub fn uses_scale(&self) -> bool {
        self.has_scale && (!matches!(self.core, Core::Pid(_)) || self.observer.is_some())
    }

    /// True if it closes a current loop: N_i is not zero.
    pub fn uses_current(&self) -> bool {
        matches!(&self.core, Core::Cascade(Cascade { current: Some(_), .. }))
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

/// (K_s + K_si T z/(z − 1)) times V(z), the filtered difference, and times K_v; with a current loop that times its own
/// controller.
fn cascade(gains: &Cascade, t: f64, z: Complex<f64>, change: Complex<f64>) -> ([Complex<f64>; 2], Complex<f64>) {
    let summed = |proportional: f64, integral: f64| match integral {
        0.0 => Complex::new(proportional, 0.0),
        _ => z * (integral * t) / change + proportional,
    };
    let keep = (-2.0 * PI * gains.filter * t).exp();
    // v = (1 − a) z/(z − a) · (1 − 1/z)/T y
    let speed = change * ((1.0 - keep) / t) / (z - keep);
    let outer = summed(gains.speed, gains.speed_integral);
    let outer = [outer * speed, outer * gains.position];
    match gains.current {
        None => (outer, Complex::ZERO),
        Some(inner) => {
            let inner = summed(inner.proportional, inner.integral);
            (outer.map(|outer| outer * inner), inner)
        }
    }
}

/// The Kalman filter and the regulator as a filter of what is measured, from [`Law`], in coordinates in which the
/// resolvent of the estimate costs least: (Φ C)ᵀ = Q T Qᵀ, T upper triangular but for a pair of rows for each two complex
/// poles (Schur's real form).
#[derive(Debug, Clone)]
struct Observed {
    law: Law,
    /// T, by its poles or pairs of them; of the estimate from one sample to the next, C = Π (I − L_i m_i).
    estimate: Vec<Part>,
    /// Qᵀ Cᵀ k, of the estimate before a sample to the command.
    row: DVector<f64>,
    /// Of encoder and scale: Qᵀ Φ G, of the measured position to the estimate, and k G, straight to the command; G_i =
    /// Π_{j>i} (I − L_j m_j) L_i.
    sensors: Vec<(DVector<f64>, f64)>,
    /// Qᵀ Γ₀ and Qᵀ Γ₁, of commands.
    now: DVector<f64>,
    before: DVector<f64>,
}

/// The column of T of a pole, or both columns of two complex ones, as far as above the block on the diagonal.
#[derive(Debug, Clone)]
enum Part {
    One { pole: f64, above: Vec<f64> },
    Two { block: [[f64; 2]; 2], above: Vec<[f64; 2]> },
}

impl Observed {
    fn of(law: &Law) -> Self {
        let n = law.phi.nrows();
        let own = law.gain.rows(0, n);
        let mut corrected = DMatrix::identity(n, n);
        let mut gains: Vec<DVector<f64>> = Vec::new();
        for sensor in &law.sensors {
            let correct = DMatrix::identity(n, n) - &sensor.kalman * sensor.measured.transpose();
            gains.iter_mut().for_each(|gain| *gain = &correct * &*gain);
            gains.push(sensor.kalman.clone());
            corrected = correct * corrected;
        }
        let turned = Schur::try_new((&law.phi * &corrected).transpose(), f64::EPSILON, TURNS);
        // What has no numbers answers with none.
        let none = || (DMatrix::identity(n, n), DMatrix::from_element(n, n, f64::NAN));
        let (q, t) = turned.map_or_else(none, Schur::unpack);
        let mut estimate = Vec::new();
        let mut i = 0;
        while i < n {
            if i + 1 < n && t[(i + 1, i)] != 0.0 {
                let block = [[t[(i, i)], t[(i, i + 1)]], [t[(i + 1, i)], t[(i + 1, i + 1)]]];
                estimate.push(Part::Two { block, above: (0..i).map(|k| [t[(k, i)], t[(k, i + 1)]]).collect() });
                i += 2;
            } else {
                estimate.push(Part::One { pole: t[(i, i)], above: (0..i).map(|k| t[(k, i)]).collect() });
                i += 1;
            }
        }
        Self {
            estimate,
            row: q.tr_mul(&corrected.tr_mul(&own)),
            sensors: gains.iter().map(|gain| (q.tr_mul(&(&law.phi * gain)), own.dot(gain))).collect(),
            now: q.tr_mul(&law.now),
            before: q.tr_mul(&law.before),
            law: law.clone(),
        }
    }

    /// N_y and N_x, D₀ and N_u of the command before filters: v D₀ = −(N_y y + N_x x + N_u u).
    fn at(&self, z: Complex<f64>, change: Complex<f64>) -> ([Complex<f64>; 2], Complex<f64>, Complex<f64>) {
        let law = &self.law;
        let n = self.row.len();
        let inverse = z.inv();
        // x̂⁺ = C x̂ + G y,  z x̂ = Φ x̂⁺ + Γ₀ z^{−d} u + Γ₁ z^{−d−1} u
        let lag = inverse.powi(law.lag() as i32);
        // kᵀ C (z I − Φ C)⁻¹, a row for all that it is asked of
        let row = self.resolved(z);
        let seen = |from: &DVector<f64>| row.iter().zip(from).map(|(row, from)| row * *from).sum::<Complex<f64>>();
        let mut positions = [Complex::ZERO; 2];
        for (position, (corrected, direct)) in positions.iter_mut().zip(&self.sensors) {
            *position = seen(corrected) + *direct;
        }
        if let Some(integral) = law.integral() {
            positions[self.sensors.len().min(2) - 1] += Complex::new(integral * law.every, 0.0) / change;
        }
        let mut delayed = Complex::new(1.0, 0.0);
        for i in 0..law.pending {
            delayed += inverse.powi(i as i32 + 1) * law.gain[n + i];
        }
        (positions, delayed, lag * (seen(&self.now) + inverse * seen(&self.before)))
    }

    /// The row kᵀ C times the resolvent of the estimate; no numbers on a pole.
    fn resolved(&self, z: Complex<f64>) -> Vec<Complex<f64>> {
        let mut row: Vec<Complex<f64>> = self.row.iter().map(|v| Complex::new(*v, 0.0)).collect();
        let mut end = row.len();
        for part in self.estimate.iter().rev() {
            match part {
                Part::One { pole, above } => {
                    let (before, own) = row[..end].split_at_mut(end - 1);
                    let x = own[0] / (z - pole);
                    own[0] = x;
                    before.iter_mut().zip(above).for_each(|(row, t)| *row += x * *t);
                    end -= 1;
                }
                Part::Two { block: [[a, b], [c, d]], above } => {
                    let (before, own) = row[..end].split_at_mut(end - 2);
                    // (z I − block)⁻¹ by its adjugate
                    let scale = ((z - a) * (z - d) - b * c).inv();
                    let x = ((z - d) * own[0] + own[1] * *b) * scale;
                    let y = (own[0] * *c + (z - a) * own[1]) * scale;
                    own.copy_from_slice(&[x, y]);
                    before.iter_mut().zip(above).for_each(|(row, [s, t])| *row += x * *s + y * *t);
                    end -= 2;
                }
            }
        }
        row
    }
}
