//! Margins of a sampled loop: what its sensitivity is over all frequencies, and whether it is stable.
//!
//! The loop is broken at the measured position, a current loop being closed, and with a scale beside the encoder at the
//! scale; with either the loop broken at the command counts as well. Held commands, delay and filters are in it exactly.
//!
//! The peaks of |S| and |T| stand at poles of the closed loop, which no grid knows beforehand. So a grid that is dense
//! about the poles of the axis is first divided wherever L or 1 + L turns by much from one point to the next, which it
//! does about every lightly damped pole of the closed loop; then every local maximum is followed to its top, and every
//! crossing to where it is.

use crate::control::feedback::{Feedback, Terms, Turn};
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
    /// The same frequencies as a sampled loop sees them.
    turns: Vec<Turn>,
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
        let turns = frequency.iter().map(|&omega| Turn::of(omega, t)).collect();
        let mut plant = Self { frequency, answers: Vec::new(), turns, model, outputs, length, every: t, unstable };
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
        let mut margins = curve.margins();
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
        beyond([self.sensitivity, self.complementary], [sensitivity, complementary])
    }
}

/// The larger of two peaks, each as part of its limit.
fn beyond(peaks: [f64; 2], limits: [f64; 2]) -> f64 {
    let excess = (peaks[0] / limits[0]).max(peaks[1] / limits[1]);
    if excess.is_nan() { f64::INFINITY } else { excess }
}

/// M_s and M_t of a loop, both infinite if it is not stable: all of [`Margins`] that limits are asked of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peaks {
    /// M_s and M_t.
    pub peaks: [f64; 2],
}

impl Peaks {
    /// Of a controller on an axis, the same as those of [`Margins::of`].
    pub fn of(plant: &Plant, feedback: &Feedback) -> Self {
        let mut curve = Curve::on_grid(plant, feedback);
        curve.divide();
        let peaks = [curve.highest(&Open::sensitivity).0, curve.highest(&Open::complementary).0];
        let is_stable = curve.is_stable() && peaks[0].is_finite();
        Self { peaks: if is_stable { peaks } else { [f64::INFINITY; 2] } }
    }

    /// Whether the loop is stable.
    pub fn is_stable(&self) -> bool {
        self.peaks[0].is_finite()
    }

    /// How far they are beyond their limits: above 1 one passes.
    pub fn excess(&self, sensitivity: f64, complementary: f64) -> f64 {
        beyond(self.peaks, [sensitivity, complementary])
    }
}

/// A loop on the grid alone, in one pass: its peaks may be higher by some per cent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rough {
    /// M_s and M_t; infinite if it is not stable.
    pub peaks: Peaks,
    /// As of [`Margins`].
    pub disturbance: f64,
    /// As of [`Margins`].
    pub following: f64,
}

impl Rough {
    /// Of a controller on an axis.
    pub fn of(plant: &Plant, feedback: &Feedback) -> Self {
        let mut most = [0.0_f64; 2];
        let mut sums = [0.0; 2];
        let mut winding = Winding::new(plant);
        let mut before: Option<(f64, [f64; 2])> = None;
        for ((&omega, answer), turn) in plant.frequency.iter().zip(&plant.answers).zip(&plant.turns) {
            let terms = feedback.at_turn(turn);
            let (inner, outer) = parted(&terms, answer);
            let difference = inner + outer;
            winding.go_on(omega, difference, turn);
            // |S|², |T|² and |x/v|², in which 1 + L = difference/inner
            let least = difference.norm_sqr().recip();
            let followed = inner.norm_sqr() * least;
            let own = terms.own.norm_sqr() * least;
            let both = if terms.has_one_loop() { followed } else { followed.max(own) };
            most = [most[0].max(both), most[1].max(outer.norm_sqr() * least)];
            let parts = [answer.cart.norm_sqr() * own / omega, followed / omega];
            if let Some((last, was)) = before.filter(|(last, _)| *last >= 2.0 * PI * SLOWEST) {
                let way = 0.5 * (omega / last).ln();
                for (sum, (a, b)) in sums.iter_mut().zip(was.iter().zip(parts)) {
                    *sum += way * (a + b);
                }
            }
            before = Some((omega, parts));
        }
        if !winding.is_stable() || !most[0].is_finite() {
            let peaks = Peaks { peaks: [f64::INFINITY; 2] };
            return Self { peaks, disturbance: f64::INFINITY, following: f64::INFINITY };
        }
        let [disturbance, following] = sums.map(|sum| (sum / PI).sqrt());
        Self { peaks: Peaks { peaks: most.map(f64::sqrt) }, disturbance, following }
    }
}

/// D and what is closed inside the loop that is looked at, and that loop: D u = −(N_y y + N_x x + N_i i) is broken at
/// the measured position, L = N_y G_y/(D + N_i G_i), and with a scale there: L = N_x G_x/(D + N_y G_y + N_i G_i).
fn parted(terms: &Terms, answer: &Answer) -> (Complex<f64>, Complex<f64>) {
    let inner = terms.own + terms.current * answer.current;
    let outer = terms.position * answer.position;
    match terms.scale == Complex::ZERO {
        true => (inner, outer),
        false => (inner + outer, terms.scale * answer.cart),
    }
}

/// The loops at one frequency.
#[derive(Debug, Clone, Copy)]
pub struct Open {
    /// L broken at the measured position; with a scale there.
    pub position: Complex<f64>,
    /// |S| of the loop broken at the command; 0 where it is the same.
    command: f64,
    /// 1 + L, times what has stable poles.
    difference: Complex<f64>,
    /// The cart's position per measured position, and per command.
    cart: Complex<f64>,
    pushed: Complex<f64>,
}

impl Open {
    fn of(answer: &Answer, feedback: &Feedback, turn: &Turn) -> Self {
        let terms = feedback.at_turn(turn);
        let (inner, outer) = parted(&terms, answer);
        let difference = inner + outer;
        let command = if terms.has_one_loop() { 0.0 } else { (terms.own / difference).norm() };
        // x = G_x D/(D + N_y G_y + N_x G_x + N_i G_i) v for a step v beside the command
        let pushed = answer.cart * terms.own / difference;
        // What follows the reference is the cart itself where it is measured.
        let follows = if terms.scale == Complex::ZERO { answer.position } else { answer.cart };
        Self { position: outer / inner, command, difference, cart: answer.cart / follows, pushed }
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
    let one = |(turn, answer): (&Turn, &Answer)| Open::of(answer, feedback, turn);
    plant.turns.iter().zip(&plant.answers).map(one).collect()
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
        Open::of(&self.plant.at(omega), self.feedback, &Turn::of(omega, self.plant.every))
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

    /// Whether the closed loop is stable.
    fn is_stable(&self) -> bool {
        let mut winding = Winding::new(self.plant);
        for (omega, open) in &self.points {
            winding.go_on(*omega, open.difference, &Turn::of(*omega, self.plant.every));
        }
        winding.is_stable()
    }

    /// The margins of the curve, with every top and crossing followed to where it is.
    fn margins(&self) -> Margins {
        let stable = self.is_stable();
        let (sensitivity, at) = self.highest(&Open::sensitivity);
        let (complementary, complementary_at) = self.highest(&Open::complementary);
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
                let (omega, open) = self.crossing(pair, &|open| open.position.norm().ln());
                // The angle from the negative axis; the nearest of all crossings counts.
                margins.phase = margins.phase.min((-open.position).arg().abs());
                if margins.crossover.is_nan() && a.norm() > 1.0 {
                    margins.crossover = omega;
                }
            }
            if a.im * b.im < 0.0 && a.re < 0.0 && b.re < 0.0 {
                margins.cross(-self.crossing(pair, &|open| open.position.im).1.position.re);
            }
            let level = |value: f64| value.ln() - FRAC_1_SQRT_2.ln();
            let of_s = |open: &Open| level((open.position + 1.0).inv().norm());
            if margins.bandwidth.is_nan() && of_s(&was) < 0.0 && of_s(&is) >= 0.0 {
                margins.bandwidth = self.crossing(pair, &of_s).0;
            }
            let of_t = |open: &Open| level(open.tracking());
            if margins.tracking.is_nan() && of_t(&was) >= 0.0 && of_t(&is) < 0.0 {
                margins.tracking = self.crossing(pair, &of_t).0;
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
    fn highest(&self, value: &dyn Fn(&Open) -> f64) -> (f64, f64) {
        let values: Vec<f64> = self.points.iter().map(|(_, open)| value(open)).collect();
        let mut best = (0.0, 0.0);
        for (&v, &(omega, _)) in values.iter().zip(&self.points) {
            if v > best.0 || v.is_nan() {
                best = (if v.is_nan() { f64::INFINITY } else { v }, omega);
            }
        }
        let level = HIGH * best.0;
        for k in (1..values.len().saturating_sub(1)).filter(|_| level.is_finite()) {
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
    fn crossing(&self, pair: &[(f64, Open)], of: &dyn Fn(&Open) -> f64) -> (f64, Open) {
        let (mut low, mut high) = ((pair[0], of(&pair[0].1)), (pair[1], of(&pair[1].1)));
        for step in 0..STEPS {
            // The straight line, and every other time the middle.
            let line = (low.1 / (low.1 - high.1)).clamp(0.0, 1.0);
            let share = if step % 2 == 1 || !line.is_finite() { 0.5 } else { line };
            let omega = low.0.0 + share * (high.0.0 - low.0.0);
            let open = self.at(omega);
            let value = of(&open);
            if value == 0.0 || high.0.0 - low.0.0 <= 1e-12 * omega {
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

/// Nyquist's criterion: F(z) = (1 + L)(1 − 1/z)^m, with m poles at z = 1, turns by π (P − Z) from θ = 0 to π, P poles
/// of the axis and Z of the closed loop being outside.
struct Winding {
    unstable: f64,
    /// The first two of ω and 1 + L, of which m is known.
    first: Option<(f64, Complex<f64>, Turn)>,
    poles: i32,
    /// F where it begins and where it is, whole turns between, and whether all were numbers.
    start: Complex<f64>,
    now: Complex<f64>,
    turns: f64,
    is_number: bool,
}

impl Winding {
    fn new(plant: &Plant) -> Self {
        let zero = Complex::ZERO;
        let unstable = plant.unstable as f64;
        Self { unstable, first: None, poles: 0, start: zero, now: zero, turns: 0.0, is_number: true }
    }

    /// On to the next frequency.
    fn go_on(&mut self, omega: f64, difference: Complex<f64>, turn: &Turn) {
        self.is_number &= difference.re.is_finite() && difference.im.is_finite() && difference != Complex::ZERO;
        let Some((w0, begin, at)) = self.first else {
            self.first = Some((omega, difference, *turn));
            return;
        };
        if self.start == Complex::ZERO {
            // |F| ~ ω^−m
            self.poles = -((difference.norm() / begin.norm()).ln() / (omega / w0).ln()).round() as i32;
            self.start = begin * at.lag().powi(self.poles);
            self.now = self.start;
        }
        let (was, is) = (self.now, difference * turn.lag().powi(self.poles));
        // The way from one to the next crosses the negative real axis where both are on other sides of the axis and
        // their cross product tells that zero is to the right.
        let cross = was.re * is.im - is.re * was.im;
        match (was.im < 0.0, is.im < 0.0) {
            (false, true) if cross > 0.0 => self.turns += 1.0,
            (true, false) if cross < 0.0 => self.turns -= 1.0,
            _ => {}
        }
        self.now = is;
    }

    /// Whether no pole of the closed loop is outside.
    fn is_stable(&self) -> bool {
        let arg = |v: Complex<f64>| (v.im + 0.0).atan2(v.re);
        // It begins on the real axis.
        let start = arg(if self.start.re < 0.0 { -self.start } else { self.start });
        let sum = start + arg(self.now) - arg(self.start) + 2.0 * PI * self.turns;
        let outside = self.unstable - (sum / PI).round();
        self.is_number && self.first.is_some() && start.abs() < 0.5 && outside == 0.0
    }
}
