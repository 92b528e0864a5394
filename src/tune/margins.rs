//! Margins of a sampled loop: what its sensitivity is over all frequencies, and whether it is stable.
//!
//! The loop is broken at the measured position, a current loop being closed; with a current loop the loop broken at the command counts
//! as well. Held commands, delay and filters are in it exactly.

use crate::control::feedback::Feedback;
use crate::control::measures_cart;
use crate::design::Design;
use crate::error::Result;
use crate::linear::{Hold, Operation, Range, StateSpace};
use crate::stage::{EncoderPlace, Stage};
use nalgebra::Complex;
use std::f64::consts::PI;

/// Points of the grid on each of its decades, those about resonances apart.
const POINTS: f64 = 90.0;

/// Lowest frequency, as a share of half the sampling rate, and points on each decade of where nothing turns.
const LOWEST: f64 = 1e-8;
const SPARSE: f64 = 12.0;

/// A sampled axis over frequency: what the controller measures per command.
#[derive(Debug, Clone)]
pub struct Plant {
    /// ω, rad/s, up to half the sampling rate.
    pub frequency: Vec<f64>,
    /// Measured position, m per V or A.
    pub position: Vec<Complex<f64>>,
    /// Motor current, A per V or A, as it is when it is sampled.
    pub current: Vec<Complex<f64>>,
    every: f64,
    /// Poles outside the unit circle.
    unstable: usize,
}

impl Plant {
    /// That of `stage` with the cart at `place`, as the controller of `design` samples it.
    pub fn of(stage: &Stage, place: f64, design: &Design, corners: &[f64]) -> Result<Self> {
        let t = design.every;
        let system = StateSpace::of(stage, Operation { position: place, ..Operation::default() })?;
        let model = system.discrete(t, Hold::Zero, design.delay)?;
        let most = PI / t;
        // Where poles turn, folded to below half the sampling rate.
        let mut roots: Vec<Complex<f64>> =
            model.poles().iter().filter(|z| z.norm() > 0.0).map(|z| z.ln() / t).collect();
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
        let output = match stage.encoder.map(|encoder| encoder.at) {
            _ if measures_cart(stage) => "cart_position",
            Some(EncoderPlace::DrivePulley) => "drive_angle",
            _ => "rotor_angle",
        };
        let length = if measures_cart(stage) { 1.0 } else { stage.pulley_radius };
        let measured = system.output(output).or(system.output("drive_angle")).unwrap_or_default();
        let motor = system.output("motor_current").unwrap_or_default();
        let (mut position, mut current) = (Vec::new(), Vec::new());
        for &omega in &frequency {
            let all = model.at(omega);
            position.push(all[measured] * length);
            // What is sampled is the current of the command before.
            let lag = Complex::new(0.0, -omega * t).exp() - 1.0;
            current.push(all[motor] + lag * model.d[motor]);
        }
        let unstable = model.poles().iter().filter(|z| z.norm() > 1.0 + 1e-9).count();
        Ok(Self { frequency, position, current, every: t, unstable })
    }
}

/// What a loop's frequency response says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// Whether every pole of the closed loop lies within the unit circle, by Nyquist's criterion.
    pub stable: bool,
    /// M_s = max |S|, S = 1/(1 + L); infinite if it is not stable.
    pub sensitivity: f64,
    /// Where, rad/s.
    pub at: f64,
    /// M_t = max |T|, T = L/(1 + L).
    pub complementary: f64,
    /// Factor by which the gain can grow until the loop swings.
    pub gain: f64,
    /// Phase at the crossover above −π, rad.
    pub phase: f64,
    /// Where |L| falls below 1, the first time, rad/s.
    pub crossover: f64,
    /// Where |S| rises above 1/√2, the first time, rad/s.
    pub bandwidth: f64,
}

impl Margins {
    /// Of a controller on an axis.
    pub fn of(plant: &Plant, feedback: &Feedback) -> Self {
        let loops = loops(plant, feedback);
        let stable = stable(plant, &loops);
        let mut margins = Self {
            stable,
            sensitivity: 0.0,
            at: 0.0,
            complementary: 0.0,
            gain: f64::INFINITY,
            phase: f64::INFINITY,
            crossover: f64::NAN,
            bandwidth: f64::NAN,
        };
        let mut before: Option<(f64, Complex<f64>, f64)> = None;
        for (&omega, open) in plant.frequency.iter().zip(&loops) {
            let (l, s) = (open.position, (open.position + 1.0).inv());
            let size = s.norm().max(open.command);
            if size > margins.sensitivity {
                (margins.sensitivity, margins.at) = (size, omega);
            }
            margins.complementary = margins.complementary.max((l * s).norm());
            if let Some((last, was, was_s)) = before {
                let share = |from: f64, to: f64, level: f64| ((level / from).ln() / (to / from).ln()).clamp(0.0, 1.0);
                if was.norm() >= 1.0 && l.norm() < 1.0 {
                    let part = share(was.norm(), l.norm(), 1.0);
                    let omega = last * (omega / last).powf(part);
                    // The angle above the negative axis; the nearest of all crossovers counts.
                    let turned = (-was).arg() + part * (l / was).arg();
                    margins.phase = margins.phase.min(turned.abs());
                    if margins.crossover.is_nan() {
                        margins.crossover = omega;
                    }
                }
                if was.im * l.im < 0.0 && l.re < 0.0 && was.re < 0.0 {
                    let part = was.im / (was.im - l.im);
                    let crossing = -(was.re + part * (l.re - was.re));
                    if crossing < 1.0 {
                        margins.gain = margins.gain.min(1.0 / crossing);
                    }
                }
                let level = std::f64::consts::FRAC_1_SQRT_2;
                if was_s < level && s.norm() >= level && margins.bandwidth.is_nan() {
                    margins.bandwidth = last * (omega / last).powf(share(was_s, s.norm(), level));
                }
            }
            before = Some((omega, l, s.norm()));
        }
        if !stable || !margins.sensitivity.is_finite() {
            (margins.sensitivity, margins.complementary) = (f64::INFINITY, f64::INFINITY);
            (margins.gain, margins.phase, margins.bandwidth) = (1.0, 0.0, f64::NAN);
        }
        margins
    }

    /// How far it is beyond its limits: above 1 it passes one.
    pub fn excess(&self, sensitivity: f64, complementary: f64) -> f64 {
        (self.sensitivity / sensitivity).max(self.complementary / complementary)
    }
}

/// The loops at one frequency.
#[derive(Debug, Clone, Copy)]
pub struct Open {
    /// L broken at the measured position.
    pub position: Complex<f64>,
    /// |S| of the loop broken at the command; 0 without a current loop, where it is the same.
    command: f64,
    /// 1 + L, times what has stable poles.
    difference: Complex<f64>,
}

/// The loops at all frequencies of the axis.
pub fn loops(plant: &Plant, feedback: &Feedback) -> Vec<Open> {
    let one = |((&omega, &y), &i): ((&f64, &Complex<f64>), &Complex<f64>)| {
        let terms = feedback.at(omega);
        // D u = −(N_y y + N_i i):  L_y = N_y G_y/(D + N_i G_i)
        let inner = terms.own + terms.current * i;
        let difference = inner + terms.position * y;
        let command = if terms.current == Complex::ZERO { 0.0 } else { (terms.own / difference).norm() };
        Open { position: terms.position * y / inner, command, difference }
    };
    plant.frequency.iter().zip(&plant.position).zip(&plant.current).map(one).collect()
}

/// Nyquist's criterion: F(z) = (1 + L)(1 − 1/z)^m, with m poles at z = 1, turns by π (P − Z) from θ = 0 to π, P poles of the axis
/// and Z of the closed loop being outside.
fn stable(plant: &Plant, loops: &[Open]) -> bool {
    let f: Vec<Complex<f64>> = loops.iter().map(|open| open.difference).collect();
    let [first, second, ..] = &f[..] else { return false };
    let (w0, w1) = (plant.frequency[0], plant.frequency[1]);
    if f.iter().any(|v| !(v.re.is_finite() && v.im.is_finite()) || *v == Complex::ZERO) {
        return false;
    }
    // |F| ~ ω^−m
    let m = -((second.norm() / first.norm()).ln() / (w1 / w0).ln()).round();
    let turned = |omega: f64, value: &Complex<f64>| {
        // 1 − e^{−jθ} = 2 j sin(θ/2) e^{−jθ/2}: its angle is π/2 − θ/2
        let angle = m * (0.5 * PI - 0.5 * omega * plant.every);
        value * Complex::new(0.0, angle).exp()
    };
    let mut before = turned(w0, first);
    // It begins on the real axis.
    let start = if before.re < 0.0 { -before } else { before }.arg();
    let mut sum = start;
    for (omega, value) in plant.frequency.iter().zip(&f).skip(1) {
        let now = turned(*omega, value);
        sum += (now / before).arg();
        before = now;
    }
    let outside = plant.unstable as f64 - (sum / PI).round();
    start.abs() < 0.5 && outside == 0.0
}
