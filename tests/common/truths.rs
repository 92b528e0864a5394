//! Machines that a rigid axis with viscous and Coulomb friction is not, integrated here: nothing is shared with taut's
//! solvers.
//!
//! Two masses with a spring or play between them, in steps of [`STEP`]; a position moves by the mean of the speeds
//! before and behind a step. A step in which a speed changes its sign is cut there: an error of a step in the time
//! of each turn would be as large as the noise of an average over the log.

use super::chance::Chance;
use super::logged::{columns, output};
use std::f64::consts::TAU;
use taut::case::Case;
use taut::log::Quantity;
use taut::signal::{Hold, Signal};

pub const EVERY: f64 = 1e-3;
pub const COUNT: usize = 4001;

/// Steps of the integration between two samples.
const STEPS: usize = 300;
const STEP: f64 = EVERY / STEPS as f64;

/// A machine in current mode: mass, viscous and Coulomb friction, all at the cart.
pub const AXIS: &str = r#"
[motor]
torque_constant = 1
back_emf_constant = 0
resistance = 1
[amplifier]
mode = "current"
[drive_pulley]
radius = 1
inertia = 1e-6
[idler_pulley]
inertia = 1e-6
[belt]
model = "rigid"
[cart]
mass = "1 kg"
friction = { viscous = "10 N s/m", coulomb = "1.5 N" }
[[experiment]]
name = "log"
input = { step = "1 A" }
until = "1 s"
every = "1 ms"
[fit]
free = ["cart.mass", "cart.friction.viscous", "cart.friction.coulomb"]
"#;

/// The element that the model lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Truth {
    /// Nothing.
    Right,
    /// A spring of 17 Hz between motor and cart, the position read at the cart.
    Spring,
    /// The same, the position read at the motor.
    SpringAtMotor,
    /// Play of 0.3 mm, positions in counts of 50 µm.
    Play,
    /// Play of 0.3 mm between the machine and the sensor alone.
    SensorPlay,
    /// Samples taken 0 to 0.8 ms after their stamps.
    Late,
    /// Bristles.
    LuGre,
    /// A drag of 0.3 b v² beside the friction.
    Drag,
    /// An amplifier that gives at most 8 A where up to 15 A are asked for.
    Limited,
    /// All friction goes by one sine of ±10 % along the log.
    Drift,
    /// Nothing; noise of second order at 15 Hz, ζ = 0.05, of 1 mm.
    NarrowBand,
}

impl Truth {
    pub const ALL: [Self; 11] = [
        Self::Right,
        Self::Spring,
        Self::SpringAtMotor,
        Self::Play,
        Self::SensorPlay,
        Self::Late,
        Self::LuGre,
        Self::Drag,
        Self::Limited,
        Self::Drift,
        Self::NarrowBand,
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Right => "nothing",
            Self::Spring => "a spring of 17 Hz between motor and cart",
            Self::SpringAtMotor => "the same, the position read at the motor",
            Self::Play => "play of 0.3 mm, counts of 50 µm",
            Self::SensorPlay => "play of 0.3 mm between the machine and its sensor",
            Self::Late => "samples taken 0 to 0.8 ms after their stamps",
            Self::LuGre => "LuGre",
            Self::Drag => "a drag of 0.3 b v²",
            Self::Limited => "an amplifier that gives 8 A of up to 15 A",
            Self::Drift => "friction drifts by one sine of ±10 %",
            Self::NarrowBand => "nothing; noise at 15 Hz, ζ = 0.05",
        }
    }
}

/// Mass, viscous and Coulomb friction.
type Values = [f64; 3];

/// Random levels of force, N, for each sample.
pub fn forces(chance: &mut Chance) -> Vec<f64> {
    let mut input = vec![0.0; COUNT];
    let (mut k, mut sign) = (50, 1.0);
    while k + 400 < COUNT {
        let next = k + 100 + (200.0 * chance.uniform()) as usize;
        input[k..next].fill(sign * (5.0 + 10.0 * chance.uniform()));
        (k, sign) = (next + (60.0 * chance.uniform()) as usize, -sign);
    }
    input
}

/// The position that is read, m, in steps of [`STEP`].
fn positions(truth: Truth, [mass, viscous, coulomb]: Values, input: &[f64], share: f64) -> Vec<f64> {
    let (before, behind) = match truth {
        Truth::Spring | Truth::SpringAtMotor | Truth::Play => (share * mass, (1.0 - share) * mass),
        _ => (0.0, mass),
    };
    let reduced = before * behind / mass;
    let frequency = if truth == Truth::Play { 120.0 } else { 17.0 };
    let stiffness = reduced * (TAU * frequency).powi(2);
    let damping = 2.0 * if truth == Truth::Play { 0.3 } else { 0.03 } * (stiffness * reduced).sqrt();
    let half = if truth == Truth::Play { 0.15e-3 } else { 0.0 };
    let (mut x, mut v, mut xm, mut vm, mut z) = (0.0f64, 0.0f64, 0.0f64, 0.0f64, 0.0f64);
    let mut all = Vec::with_capacity(input.len() * STEPS);
    for k in 0..(input.len() - 1) * STEPS + 1 {
        all.push(if truth == Truth::SpringAtMotor { xm } else { x });
        let time = k as f64 * STEP;
        let drift = match truth {
            Truth::Drift => 1.0 + 0.1 * (TAU * time / (COUNT as f64 * EVERY)).sin(),
            _ => 1.0,
        };
        let asked = input[(k / STEPS).min(input.len() - 1)];
        let force = if truth == Truth::Limited { asked.clamp(-8.0, 8.0) } else { asked };
        let pull = if before > 0.0 {
            let stretch = xm - x;
            let beyond = stretch.signum() * (stretch.abs() - half).max(0.0);
            let own = stiffness * beyond + if beyond != 0.0 { damping * (vm - v) } else { 0.0 };
            let last = vm;
            vm += STEP * (force - own) / before;
            xm += 0.5 * STEP * (last + vm);
            own
        } else {
            force
        };
        let drag = if truth == Truth::Drag { 0.3 * viscous * v * v.abs() } else { 0.0 };
        let last = v;
        if truth == Truth::LuGre {
            // ż = v − σ₀ |v|/g z,  F = σ₀ z + σ₁ ż + b v
            let (stiff, calm) = (coulomb / 0.1e-3, (coulomb / 0.1e-3 * mass).sqrt());
            let g = coulomb * (1.0 + 0.5 * (-(v / 0.05).powi(2)).exp());
            let rate = v - stiff * v.abs() / g * z;
            z += STEP * rate;
            v += STEP * (pull - stiff * z - calm * rate - viscous * v) / behind;
        } else {
            let (force, dry) = (pull - drag, drift * coulomb);
            // M (v′ − v)/h = F − b (v + v′)/2 − C sgn v
            let slide = |v: f64, sign: f64, h: f64| {
                let (half, per_mass) = (0.5 * h * drift * viscous / behind, h / behind);
                ((1.0 - half) * v + per_mass * (force - sign * dry)) / (1.0 + half)
            };
            let from_rest = |h: f64| if force.abs() > dry { slide(0.0, force.signum(), h) } else { 0.0 };
            if v == 0.0 {
                v = from_rest(STEP);
            } else {
                v = slide(v, v.signum(), STEP);
                if v * last < 0.0 {
                    // It turns, or stops, within the step.
                    let turns = STEP * last / (last - v);
                    v = from_rest(STEP - turns);
                    x += 0.5 * (turns * last + (STEP - turns) * v) - 0.5 * STEP * (last + v);
                }
            }
        }
        x += 0.5 * STEP * (last + v);
    }
    all
}

/// A case with a log of such a machine, and its values.
pub fn drawn(seed: u64, truth: Truth) -> (Case, Values) {
    let mut chance = Chance::new(seed);
    let mut case = Case::from_text("axis.toml", AXIS).unwrap();
    let mut off = || 2f64.powf(chance.uniform() - 0.5);
    let values = [off(), 10.0 * off(), 1.5 * off()];
    let share = 0.3 + 0.3 * chance.uniform();
    let input = forces(&mut chance);
    let mut position = positions(truth, values, &input, share);
    let narrow = narrow(&mut chance);
    if truth == Truth::SensorPlay {
        behind_play(&mut position, 0.3e-3, chance.uniform());
    }
    let count = if truth == Truth::Play { 50e-6 } else { 1e-6 };
    let read = |k: usize, chance: &mut Chance| {
        let late = if truth == Truth::Late { (0.8 * chance.uniform() * STEPS as f64) as usize } else { 0 };
        let noise = if truth == Truth::NarrowBand { 1e-3 * narrow[k] } else { 0.0 };
        let value = position[(k * STEPS + late).min(position.len() - 1)] + noise + 1e-5 * chance.normal();
        (value / count).round() * count
    };
    let seen: Vec<f64> = (0..COUNT).map(|k| read(k, &mut chance)).collect();
    let time: Vec<f64> = (0..COUNT).map(|k| k as f64 * EVERY).collect();
    let experiment = &mut case.experiments[0];
    (experiment.until, experiment.every) = ((COUNT - 1) as f64 * EVERY, EVERY);
    experiment.inputs[0] = Signal::Sampled { times: time.clone(), values: input.clone(), hold: Hold::Zero };
    experiment.log = Some(columns("log", time, input, vec![output(Quantity::CartPosition, seen)]));
    (case, values)
}

/// Positions as a sensor reads them behind play of this width, of which this share lies ahead at first.
pub fn behind_play(positions: &mut [f64], width: f64, ahead: f64) {
    let mut read = positions[0];
    for position in positions {
        read = read.clamp(*position - ahead * width, *position + (1.0 - ahead) * width);
        *position = read;
    }
}

/// Noise of second order at 15 Hz, damped by 0.05, of deviation 1.
pub fn narrow(chance: &mut Chance) -> Vec<f64> {
    // x_k = 2 ρ cos(ω h) x_{k−1} − ρ² x_{k−2} + e_k
    let (zeta, omega) = (0.05f64, TAU * 15.0);
    let rho = (-zeta * omega * EVERY).exp();
    let (a, b) = (2.0 * rho * (omega * (1.0 - zeta * zeta).sqrt() * EVERY).cos(), -rho * rho);
    let (mut last, mut before) = (0.0, 0.0);
    let mut all: Vec<f64> = Vec::new();
    for _ in 0..COUNT + 2000 {
        let next = a * last + b * before + chance.normal();
        (last, before) = (next, last);
        all.push(next);
    }
    all.drain(..2000);
    let size = (all.iter().map(|v| v * v).sum::<f64>() / COUNT as f64).sqrt();
    all.iter().map(|v| v / size).collect()
}
