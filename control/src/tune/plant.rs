//! The sampled axis over frequency: what a controller measures per command.

use crate::control::feedback::Turn;
use crate::control::measures_cart;
use crate::design::Design;
use crate::error::Result;
use crate::linear::{Discrete, Hold, Operation, Range, StateSpace};
use crate::machine::{EncoderPlace, Machine};
use nalgebra::Complex;
use std::f64::consts::PI;

/// Points of the grid on each of its decades, those about resonances apart.
const POINTS: f64 = 90.0;
/// Lowest frequency, as a share of half the sampling rate, and points on each decade of where nothing turns.
const LOWEST: f64 = 1e-8;
const SPARSE: f64 = 12.0;

/// The answer to a command at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// Measured position, m per V or A.
    pub position: Complex<f64>,
    /// Motor current, A per V or A, as it is when it is sampled.
    pub current: Complex<f64>,
    /// The cart's position, m per V or A.
    pub cart: Complex<f64>,
}

/// A sampled axis over frequency: what the controller measures per command.
#[derive(Debug, Clone)]
pub struct Plant {
    /// ω, rad/s, up to half the sampling rate.
    pub frequency: Vec<f64>,
    /// The answers to a command there.
    pub answers: Vec<Answer>,
    /// The frequencies in terms of the sampled loop.
    turns: Vec<Turn>,
    model: Discrete,
    /// Outputs of the model: what is measured, the cart, the current; and metres per unit of the first.
    outputs: [usize; 3],
    length: f64,
    pub(super) every: f64,
    /// Poles outside the unit circle.
    pub(super) unstable: usize,
}

impl Plant {
    /// Sampled plant with the cart at `place`, m, for the controller of `design`.
    pub fn of(machine: &Machine, place: f64, design: &Design, corners: &[f64]) -> Result<Self> {
        let t = design.every;
        let system = StateSpace::of(machine, Operation { position: place, ..Operation::default() })?;
        let model = system.discrete(t, Hold::Zero, design.delay)?;
        let frequency = grid(&model, t, corners);
        let output = match machine.encoder.map(|encoder| encoder.at) {
            _ if measures_cart(machine) => "cart_position",
            Some(EncoderPlace::DrivePulley) => "drive_angle",
            _ => "rotor_angle",
        };
        let length = if measures_cart(machine) { 1.0 } else { machine.pulley_radius };
        let measured = system.output(output).or(system.output("drive_angle")).unwrap_or_default();
        let of = |name: &str| system.output(name).unwrap_or_default();
        let outputs = [measured, of("cart_position"), of("motor_current")];
        let unstable = model.poles().iter().filter(|z| z.norm() > 1.0 + 1e-9).count();
        let turns = frequency.iter().map(|&omega| Turn::of(omega, t)).collect();
        let mut plant = Self { frequency, answers: Vec::new(), turns, model, outputs, length, every: t, unstable };
        plant.answers = plant.frequency.iter().map(|&omega| plant.at(omega)).collect();
        Ok(plant)
    }

    /// Frequencies, the answers to a command there, and the frequencies as a sampled loop sees them.
    pub(super) fn seen(&self) -> impl Iterator<Item = (f64, &Answer, &Turn)> {
        let all = self.frequency.iter().zip(&self.answers).zip(&self.turns);
        all.map(|((&omega, answer), turn)| (omega, answer, turn))
    }

    /// The answer to a command at ω, rad/s.
    pub fn at(&self, omega: f64) -> Answer {
        let all = self.model.at(omega);
        let [measured, cart, motor] = self.outputs;
        // What is sampled is the current of the command before.
        let lag = Complex::new(0.0, -omega * self.every).exp() - 1.0;
        Answer {
            position: all[measured] * self.length,
            current: all[motor] + lag * self.model.d[motor],
            cart: all[cart],
        }
    }
}

/// Frequencies up to half the sampling rate, dense about the poles of the axis and the controller's corners.
fn grid(model: &Discrete, t: f64, corners: &[f64]) -> Vec<f64> {
    let most = PI / t;
    // Where poles turn, folded to below half the sampling rate.
    let mut roots: Vec<Complex<f64>> = model.poles().iter().filter(|z| z.norm() > 0.0).map(|z| z.ln() / t).collect();
    roots.extend(corners.iter().map(|omega| Complex::new(-0.3 * omega, *omega)));
    let slowest = roots.iter().map(|s| s.norm()).filter(|w| *w > 1e-9 * most).fold(most, f64::min);
    let from = (0.01 * slowest).clamp(10.0 * LOWEST * most, 1e-3 * most);
    let points = (POINTS * (most / from).log10()) as usize;
    // Far below a slow integral, so that what it does to the phase is seen whole.
    let below = (LOWEST * most / from).log10().abs();
    let count = (SPARSE * below).ceil();
    let mut frequency: Vec<f64> =
        (0..count as usize).map(|k| LOWEST * most * 10f64.powf(below * k as f64 / count)).collect();
    frequency.extend(Range { from, to: most, points }.frequencies(&roots));
    // Where L is real, whatever rounding makes of the highest point.
    frequency.retain(|omega| *omega < most * (1.0 - 1e-12));
    frequency.push(most);
    frequency
}
