//! From states to the columns that a user sees, block by block.

use super::{Flow, Grid};
use crate::friction::Motion;
use crate::plant::{Body, Plant, place};
use crate::stage::{AmplifierMode, EncoderPlace};
use crate::trajectory::{Column, Trajectory};
use std::f64::consts::PI;

/// Rows handed on at a time; small enough to stay in the processor's cache.
const BLOCK: usize = 256;

/// Collects rows of states and hands them on as blocks of columns.
pub(crate) struct Recorder<'a> {
    plant: &'a Plant,
    grid: Grid,
    /// States in the order of [`place`], then the input.
    raw: Vec<[f64; place::COUNT + 1]>,
    motion: Vec<[Motion; 3]>,
    block: Trajectory,
    sink: &'a mut dyn FnMut(&Trajectory) -> Flow,
    /// Rows handed on.
    pub(crate) rows: u64,
    /// What the receiver answered last.
    pub(crate) flow: Flow,
}

impl<'a> Recorder<'a> {
    pub(crate) fn new(plant: &'a Plant, grid: Grid, sink: &'a mut dyn FnMut(&Trajectory) -> Flow) -> Self {
        Self {
            plant,
            grid,
            raw: Vec::with_capacity(BLOCK),
            motion: Vec::with_capacity(BLOCK),
            block: Trajectory { columns: headings(plant) },
            sink,
            rows: 0,
            flow: Flow::Continue,
        }
    }

    /// Rows received so far: the number of the next one.
    pub(crate) fn next_row(&self) -> u64 {
        self.rows + self.raw.len() as u64
    }

    /// Adds the next row: states, then the input.
    #[inline]
    pub(crate) fn push(&mut self, row: [f64; place::COUNT + 1], motion: [Motion; 3]) {
        self.raw.push(row);
        self.motion.push(motion);
        if self.raw.len() == BLOCK {
            self.hand_on();
        }
    }

    /// Hands on what is left.
    pub(crate) fn finish(&mut self) {
        if !self.raw.is_empty() {
            self.hand_on();
        }
    }

    fn hand_on(&mut self) {
        self.fill();
        self.rows += self.raw.len() as u64;
        if self.flow == Flow::Continue {
            self.flow = (self.sink)(&self.block);
        }
        self.raw.clear();
        self.motion.clear();
    }

    /// Computes every column of the block from the states.
    fn fill(&mut self) {
        let raw = &self.raw;
        let stage = self.plant.stage();
        let motor = &stage.motor;
        let r = stage.pulley_radius;
        let gain = stage.amplifier.gain;
        let mut columns = self.block.columns.iter_mut().map(|column| &mut column.values);
        let mut next = || {
            let values = columns.next().expect("one column for each heading");
            values.clear();
            values
        };

        next().extend((0..raw.len() as u64).map(|j| self.grid.time(self.rows + j)));
        let kn = motor.back_emf_constant * motor.gear_ratio;
        let current = |&[_, w1, _, _, _, _, i, u]: &[f64; 8]| match stage.amplifier.mode {
            AmplifierMode::Current => gain * u,
            AmplifierMode::Voltage if motor.inductance > 0.0 => i,
            // i = (V_in − K_e n φ̇₁) / R                                          in (4)
            AmplifierMode::Voltage => (gain * u - kn * w1) / motor.resistance,
        };
        match stage.amplifier.mode {
            AmplifierMode::Voltage => next().extend(raw.iter().map(|row| gain * row[INPUT])),
            // What the terminals show at this current, the inductance apart: R i + K_e n φ̇₁
            AmplifierMode::Current => {
                next().extend(raw.iter().map(|row| motor.resistance * current(row) + kn * row[place::DRIVE_SPEED]))
            }
        }
        for state in 0..place::CURRENT {
            next().extend(raw.iter().map(|row| row[state]));
        }
        next().extend(raw.iter().map(current));
        let [k1, k2, k3] = stage.belt.stiffness;
        let [c1, c2, c3] = stage.belt.damping;
        let spans = |&[p1, w1, x, v, p3, w3, ..]: &[f64; 8]| {
            let (p1, w1, p3, w3) = (r * p1, r * w1, r * p3, r * w3);
            // f₁, f₂, f₃ after (1)-(3)
            [k1 * (p1 - x) + c1 * (w1 - v), k2 * (x - p3) + c2 * (v - w3), k3 * (p3 - p1) + c3 * (w3 - w1)]
        };
        let [force1, force2, force3] = std::array::from_fn(|_| next());
        let [drive, cart, idler] = std::array::from_fn(|_| next());
        for (row, &[m1, m2, m3]) in raw.iter().zip(&self.motion) {
            let [f1, f2, f3] = spans(row);
            force1.push(f1);
            force2.push(f2);
            force3.push(f3);
            let [w1, v, w3] = [row[place::DRIVE_SPEED], row[place::CART_SPEED], row[place::IDLER_SPEED]];
            let (least, most) = self.plant.holding_torque(current(row));
            let pull = r * f3 - r * f1;
            drive.push(self.plant.friction_value(Body::DrivePulley, m1, w1, (least + pull, most + pull)));
            cart.push(self.plant.friction_value(Body::Cart, m2, v, (f1 - f2, f1 - f2)));
            let pull = r * f2 - r * f3;
            idler.push(self.plant.friction_value(Body::IdlerPulley, m3, w3, (pull, pull)));
        }
        for body in 0..3 {
            next().extend(self.motion.iter().map(|motion| f64::from(motion[body].code())));
        }
        if shows_input(self.plant) {
            next().extend(raw.iter().map(|row| row[INPUT]));
        }
        if let Some(encoder) = stage.encoder {
            // In quadrature every line gives four counts; the nearest count is shown.
            let (position, counts) = match encoder.at {
                EncoderPlace::Motor => (place::DRIVE_ANGLE, 4.0 * encoder.lines * motor.gear_ratio / (2.0 * PI)),
                EncoderPlace::DrivePulley => (place::DRIVE_ANGLE, 4.0 * encoder.lines / (2.0 * PI)),
                EncoderPlace::Cart => (place::CART_POSITION, 4.0 * encoder.lines),
            };
            next().extend(raw.iter().map(|row| (row[position] * counts).round()));
        }
    }
}

/// Where the input stands in a row, behind the states.
const INPUT: usize = place::COUNT;

/// Whether the amplifier's input differs from the column of voltages and is worth a column of its own.
fn shows_input(plant: &Plant) -> bool {
    let amplifier = &plant.stage().amplifier;
    amplifier.gain != 1.0 || amplifier.mode == AmplifierMode::Current
}

/// The columns of a run on this stage, without rows.
pub(crate) fn headings(plant: &Plant) -> Vec<Column> {
    let mut columns: Vec<Column> = [
        ("time", "s"),
        ("voltage", "V"),
        ("drive_angle", "rad"),
        ("drive_speed", "rad/s"),
        ("cart_position", "m"),
        ("cart_speed", "m/s"),
        ("idler_angle", "rad"),
        ("idler_speed", "rad/s"),
        ("motor_current", "A"),
        ("span1_force", "N"),
        ("span2_force", "N"),
        ("span3_force", "N"),
        ("drive_friction", "N m"),
        ("cart_friction", "N"),
        ("idler_friction", "N m"),
        ("drive_state", ""),
        ("cart_state", ""),
        ("idler_state", ""),
    ]
    .map(|(name, unit)| Column::new(name, unit))
    .into();
    if shows_input(plant) {
        let unit = if plant.stage().amplifier.mode == AmplifierMode::Current { "A" } else { "V" };
        columns.push(Column::new("input", unit));
    }
    if plant.stage().encoder.is_some() {
        columns.push(Column::new("encoder_count", ""));
    }
    columns
}
