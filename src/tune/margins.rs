//! Margins of a sampled loop: what its sensitivity is over all frequencies, and whether it is stable.
//!
//! The loop is broken at the measured position, a current loop being closed; with a current loop the loop broken at the
//! command counts as well. Held commands, delay and filters are in it exactly.
//!
//! The peaks of |S| and |T| stand at poles of the closed loop, which no grid knows beforehand. So a grid that is dense
//! about the poles of the axis is first divided wherever L or 1 + L turns by much from one point to the next, which it
//! does about every lightly damped pole of the closed loop; then every local maximum is followed to its top, and every
//! crossing to where it is.

use crate::control::feedback::Feedback;
use crate::control::measures_cart;
use crate::design::Design;
use crate::error::Result;
use crate::linear::{Discrete, Hold, Operation, Range, StateSpace};
use crate::stage::{EncoderPlace, Stage};
use nalgebra::Complex;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Points of the grid on each of its decades, those about resonances apart.
const POINTS: f64 = 90.0;

/// Lowest frequency, as a share of half the sampling rate, and points on each decade of where nothing turns.
const LOWEST: f64 = 1e-8;
const SPARSE: f64 = 12.0;

/// Angle by which L or 1 + L may turn from one point to the next, rad.
const TURN: f64 = 0.4;

/// Points that are added at most, and the least share of a frequency by which two differ.
const ADDED: usize = 4000;
const NEAREST: f64 = 1e-12;

/// From where on a disturbance counts, Hz.
const SLOWEST: f64 = 0.1;

/// Steps of a search for a top or a crossing.
const STEPS: usize = 60;

/// Local maxima below this share of the highest one are left as the grid has them.
const HIGH: f64 = 0.7;

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
    model: Discrete,
    /// Outputs of the model: what is measured, the cart, the current; and metres per unit of the first.
    outputs: [usize; 3],
    length: f64,
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
        let frequency = grid(&model, t, corners);
        let output = match stage.encoder.map(|encoder| encoder.at) {
            _ if measures_cart(stage) => "cart_position",
            Some(EncoderPlace::DrivePulley) => "drive_angle",
            _ => "rotor_angle",
        };
        let length = if measures_cart(stage) { 1.0 } else { stage.pulley_radius };
        let measured = system.output(output).or(system.output("drive_angle")).unwrap_or_default();
        let of = |name: &str| system.output(name).unwrap_or_default();
        let outputs = [measured, of("cart_position"), of("motor_current")];
        let unstable = model.poles().iter().filter(|z| z.norm() > 1.0 + 1e-9).count();
        let mut plant = Self { frequency, answers: Vec::new(), model, outputs, length, every: t, unstable };
        plant.answers = plant.frequency.iter().map(|&omega| plant.at(omega)).collect();
        Ok(plant)
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

/// The margins of a loop's frequency response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// Whether every pole of the closed loop lies within the unit circle, by Nyquist's criterion.
    pub stable: bool,
    /// M_s = max |S|, S = 1/(1 + L); infinite if it is not stable.
    pub sensitivity: f64,
    /// Where, rad/s; where |S| is largest in a loop that is not stable, too: there it swings.
    pub at: f64,
    /// M_t = max |T|, T = L/(1 + L).
    pub complementary: f64,
    /// Where, rad/s.
    pub complementary_at: f64,
    /// Factor by which the gain can grow until the loop swings.
    pub gain: f64,
    /// Phase at the crossover above −π, rad.
    pub phase: f64,
    /// Where |L| falls below 1, the first time, rad/s.
    pub crossover: f64,
    /// Where |S| rises above 1/√2, the first time, rad/s.
    pub bandwidth: f64,
    /// Where the way from the reference to the cart, T x/y without feed-forward, falls below 1/√2, the first time,
    /// rad/s.
    pub tracking: f64,
    /// √(1/π ∫ |S G/ω|² dω) from 2π 0.1 Hz on: root of the integral over time of the squared cart position, m √s, after
    /// a step of 1 V or 1 A at the command.
    pub disturbance: f64,
    /// √(1/π ∫ |S/ω|² dω) from 2π 0.1 Hz on, √s: the same of the error after a step of 1 m of the reference, per metre,
    /// without feed-forward.
    pub following: f64,
}

impl Margins {
    /// Of a controller on an axis; peaks and crossings where they are, not where a grid has a point.
    pub fn of(plant: &Plant, feedback: &Feedback) -> Self {
        let mut curve = Curve::on_grid(plant, feedback);
        curve.divide();
        let mut margins = curve.margins(true);
        if !margins.stable {
            margins.spoil();
        }
        margins
    }

    /// The same on the grid alone: peaks may be higher by some per cent.
    pub fn roughly(plant: &Plant, feedback: &Feedback) -> Self {
        let mut margins = Curve::on_grid(plant, feedback).margins(false);
        if !margins.stable {
            margins.spoil();
        }
        margins
    }

    /// Those of a loop that is not stable.
    fn spoil(&mut self) {
        (self.sensitivity, self.complementary) = (f64::INFINITY, f64::INFINITY);
        (self.gain, self.phase) = (1.0, 0.0);
        (self.disturbance, self.following) = (f64::INFINITY, f64::INFINITY);
        (self.bandwidth, self.tracking) = (f64::NAN, f64::NAN);
    }

    /// How far it is beyond its limits: above 1 it passes one. What is no number passes them by far.
    pub fn excess(&self, sensitivity: f64, complementary: f64) -> f64 {
        let excess = (self.sensitivity / sensitivity).max(self.complementary / complementary);
        if excess.is_nan() { f64::INFINITY } else { excess }
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
    /// The cart's position per measured position, and per command.
    cart: Complex<f64>,
    pushed: Complex<f64>,
}

impl Open {
    fn of(answer: &Answer, feedback: &Feedback, omega: f64) -> Self {
        let terms = feedback.at(omega);
        let &Answer { position: y, current: i, cart } = answer;
        // D u = −(N_y y + N_i i):  L_y = N_y G_y/(D + N_i G_i)
        let inner = terms.own + terms.current * i;
        let difference = inner + terms.position * y;
        let command = if terms.current == Complex::ZERO { 0.0 } else { (terms.own / difference).norm() };
        // x = G_x D/(D + N_y G_y + N_i G_i) v for a step v beside the command
        let pushed = cart * terms.own / difference;
        Self { position: terms.position * y / inner, command, difference, cart: cart / y, pushed }
    }

    /// |S|, of the worse of both loops.
    fn sensitivity(&self) -> f64 {
        (self.position + 1.0).inv().norm().max(self.command)
    }

    /// |T|.
    fn complementary(&self) -> f64 {
        (self.position / (self.position + 1.0)).norm()
    }

    /// T x/y: from the reference to the cart, without feed-forward.
    pub fn reference_to_cart(&self) -> Complex<f64> {
        self.position / (self.position + 1.0) * self.cart
    }

    /// |T x/y|.
    fn tracking(&self) -> f64 {
        self.reference_to_cart().norm()
    }
}

/// The loops at all frequencies of the axis.
pub fn loops(plant: &Plant, feedback: &Feedback) -> Vec<Open> {
    let one = |(&omega, answer): (&f64, &Answer)| Open::of(answer, feedback, omega);
    plant.frequency.iter().zip(&plant.answers).map(one).collect()
}

/// The loops along the frequencies.
struct Curve<'a> {
    plant: &'a Plant,
    feedback: &'a Feedback,
    points: Vec<(f64, Open)>,
}

impl<'a> Curve<'a> {
    fn on_grid(plant: &'a Plant, feedback: &'a Feedback) -> Self {
        let points = plant.frequency.iter().copied().zip(loops(plant, feedback)).collect();
        Self { plant, feedback, points }
    }

    fn at(&self, omega: f64) -> Open {
        Open::of(&self.plant.at(omega), self.feedback, omega)
    }

    /// Puts points between those from one of which to the next L or 1 + L turns by more than [`TURN`].
    fn divide(&mut self) {
        let turns = |a: &Open, b: &Open| {
            let turn = |a: Complex<f64>, b: Complex<f64>| (b / a).arg().abs();
            turn(a.difference, b.difference).max(turn(a.position, b.position)) > TURN
        };
        let mut done: Vec<(f64, Open)> = Vec::with_capacity(2 * self.points.len());
        let mut waiting: Vec<(f64, Open)> = self.points.iter().rev().copied().collect();
        let mut added = 0;
        done.extend(waiting.pop());
        while let (Some(last), Some(next)) = (done.last(), waiting.last()) {
            if added < ADDED && next.0 - last.0 > NEAREST * next.0 && turns(&last.1, &next.1) {
                let middle = 0.5 * (last.0 + next.0);
                waiting.push((middle, self.at(middle)));
                added += 1;
            } else {
                done.extend(waiting.pop());
            }
        }
        self.points = done;
    }

    /// The margins of the curve; `finely` with every top and crossing followed to where it is.
    fn margins(&self, finely: bool) -> Margins {
        let stable = stable(self.plant, &self.points);
        let (sensitivity, at) = self.highest(&Open::sensitivity, finely);
        let (complementary, complementary_at) = self.highest(&Open::complementary, finely);
        let mut margins = Margins {
            stable: stable && sensitivity.is_finite(),
            sensitivity,
            at,
            complementary,
            complementary_at,
            gain: f64::INFINITY,
            phase: f64::INFINITY,
            crossover: f64::NAN,
            bandwidth: f64::NAN,
            tracking: f64::NAN,
            disturbance: self.squared(&|open| open.pushed.norm_sqr()),
            following: self.squared(&|open| (open.position + 1.0).inv().norm_sqr()),
        };
        for pair in self.points.windows(2) {
            let [(_, was), (_, is)] = [pair[0], pair[1]];
            let (a, b) = (was.position, is.position);
            if (a.norm() - 1.0) * (b.norm() - 1.0) <= 0.0 && a.norm() != 1.0 {
                let (omega, open) = self.crossing(pair, &|open| open.position.norm().ln(), finely);
                // The angle from the negative axis; the nearest of all crossings counts.
                margins.phase = margins.phase.min((-open.position).arg().abs());
                if margins.crossover.is_nan() && a.norm() > 1.0 {
                    margins.crossover = omega;
                }
            }
            if a.im * b.im < 0.0 && a.re < 0.0 && b.re < 0.0 {
                margins.cross(-self.crossing(pair, &|open| open.position.im, finely).1.position.re);
            }
            let level = |value: f64| value.ln() - FRAC_1_SQRT_2.ln();
            let of_s = |open: &Open| level((open.position + 1.0).inv().norm());
            if margins.bandwidth.is_nan() && of_s(&was) < 0.0 && of_s(&is) >= 0.0 {
                margins.bandwidth = self.crossing(pair, &of_s, finely).0;
            }
            let of_t = |open: &Open| level(open.tracking());
            if margins.tracking.is_nan() && of_t(&was) >= 0.0 && of_t(&is) < 0.0 {
                margins.tracking = self.crossing(pair, &of_t, finely).0;
            }
        }
        // At half the sampling rate L is real.
        if let Some((_, last)) = self.points.last()
            && last.position.im.abs() <= 1e-6 * last.position.norm()
        {
            margins.cross(-last.position.re);
        }
        margins
    }

    /// The highest value over all frequencies, and where.
    fn highest(&self, value: &dyn Fn(&Open) -> f64, finely: bool) -> (f64, f64) {
        let values: Vec<f64> = self.points.iter().map(|(_, open)| value(open)).collect();
        let mut best = (0.0, 0.0);
        for (&v, &(omega, _)) in values.iter().zip(&self.points) {
            if v > best.0 || v.is_nan() {
                best = (if v.is_nan() { f64::INFINITY } else { v }, omega);
            }
        }
        let level = HIGH * best.0;
        for k in (1..values.len().saturating_sub(1)).filter(|_| finely && level.is_finite()) {
            if values[k] >= level && values[k] >= values[k - 1] && values[k] >= values[k + 1] {
                let (top, omega) = self.top(self.points[k - 1].0, self.points[k + 1].0, value);
                if top > best.0 {
                    best = (top, omega);
                }
            }
        }
        best
    }

    /// The top between two frequencies, by the golden section.
    fn top(&self, mut low: f64, mut high: f64, value: &dyn Fn(&Open) -> f64) -> (f64, f64) {
        let share = 0.5 * (5f64.sqrt() - 1.0);
        let look = |omega: f64| (value(&self.at(omega)), omega);
        let (mut left, mut right) = (look(high - share * (high - low)), look(low + share * (high - low)));
        for _ in 0..STEPS {
            if high - low <= 1e-13 * high || (left.0 - right.0).abs() <= 1e-12 * left.0 && high - low <= 1e-6 * high {
                break;
            }
            if left.0 > right.0 {
                (high, right) = (right.1, left);
                left = look(high - share * (high - low));
            } else {
                (low, left) = (left.1, right);
                right = look(low + share * (high - low));
            }
        }
        if left.0 > right.0 { left } else { right }
    }

    /// Where a quantity passes zero between two points.
    fn crossing(&self, pair: &[(f64, Open)], of: &dyn Fn(&Open) -> f64, finely: bool) -> (f64, Open) {
        let (mut low, mut high) = ((pair[0], of(&pair[0].1)), (pair[1], of(&pair[1].1)));
        for step in 0..if finely { STEPS } else { 1 } {
            // The straight line, and every other time the middle.
            let line = (low.1 / (low.1 - high.1)).clamp(0.0, 1.0);
            let share = if step % 2 == 1 || !line.is_finite() { 0.5 } else { line };
            let omega = low.0.0 + share * (high.0.0 - low.0.0);
            let open = match finely {
                true => self.at(omega),
                false => between(&low.0.1, &high.0.1, share),
            };
            let value = of(&open);
            if value == 0.0 || !finely || high.0.0 - low.0.0 <= 1e-12 * omega {
                return (omega, open);
            }
            if (value > 0.0) == (low.1 > 0.0) { low = ((omega, open), value) } else { high = ((omega, open), value) }
        }
        if low.1.abs() < high.1.abs() { low.0 } else { high.0 }
    }

    /// √(1/π ∫ v/ω² dω) of a squared magnitude v, by trapezia on the logarithm of ω.
    fn squared(&self, value: &dyn Fn(&Open) -> f64) -> f64 {
        let slowest = 2.0 * PI * SLOWEST;
        let part = |(omega, open): &(f64, Open)| value(open) / omega;
        let sum: f64 = self
            .points
            .windows(2)
            .filter(|pair| pair[0].0 >= slowest)
            .map(|pair| 0.5 * (part(&pair[0]) + part(&pair[1])) * (pair[1].0 / pair[0].0).ln())
            .sum();
        (sum / PI).sqrt()
    }
}

impl Margins {
    /// L passes the negative real axis at −`size`.
    fn cross(&mut self, size: f64) {
        if size > 0.0 && size < 1.0 {
            self.gain = self.gain.min(1.0 / size);
        }
    }
}

/// Part of the way from one point to the next.
fn between(a: &Open, b: &Open, share: f64) -> Open {
    let mix = |a: Complex<f64>, b: Complex<f64>| a + (b - a) * share;
    Open {
        position: mix(a.position, b.position),
        command: a.command + share * (b.command - a.command),
        difference: mix(a.difference, b.difference),
        cart: mix(a.cart, b.cart),
        pushed: mix(a.pushed, b.pushed),
    }
}

/// Nyquist's criterion: F(z) = (1 + L)(1 − 1/z)^m, with m poles at z = 1, turns by π (P − Z) from θ = 0 to π, P poles
/// of the axis and Z of the closed loop being outside.
fn stable(plant: &Plant, points: &[(f64, Open)]) -> bool {
    let [(w0, first), (w1, second), ..] = points else { return false };
    let is_number = |v: Complex<f64>| v.re.is_finite() && v.im.is_finite() && v != Complex::ZERO;
    if !points.iter().all(|(_, open)| is_number(open.difference)) {
        return false;
    }
    // |F| ~ ω^−m
    let m = -((second.difference.norm() / first.difference.norm()).ln() / (w1 / w0).ln()).round();
    let turned = |(omega, open): &(f64, Open)| {
        // 1 − e^{−jθ} = 2 j sin(θ/2) e^{−jθ/2}: its angle is π/2 − θ/2
        let angle = m * (0.5 * PI - 0.5 * omega * plant.every);
        open.difference * Complex::new(0.0, angle).exp()
    };
    let mut before = turned(&points[0]);
    // It begins on the real axis.
    let start = if before.re < 0.0 { -before } else { before }.arg();
    let mut sum = start;
    for point in &points[1..] {
        let now = turned(point);
        sum += (now / before).arg();
        before = now;
    }
    let outside = plant.unstable as f64 - (sum / PI).round();
    start.abs() < 0.5 && outside == 0.0
}
