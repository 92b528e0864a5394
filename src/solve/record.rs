//! From states to the columns that a user sees, block by block.

use super::{Flow, Grid};
use crate::friction::{Law, Motion};
use crate::plant::{Body, Plant, place};
use crate::stage::{AmplifierMode, EncoderPlace};
use crate::trajectory::{Column, Trajectory};
use std::f64::consts::PI;

/// Rows handed on at a time; small enough to stay in the processor's cache.
const BLOCK: usize = 256;

/// What a row shows that does not follow from its state by the linear equations.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Extra {
    /// Friction beyond b v ± F_c, N or N m.
    pub(crate) friction: [f64; 3],
    /// Forces of spans 1 and 2 beyond those with the stiffness at x = 0, N.
    pub(crate) span: [f64; 2],
    /// Deflection of the bristles, m or rad.
    pub(crate) bristle: [f64; 3],
}

/// Collects rows of states and hands them on as blocks of columns.
pub(crate) struct Recorder<'a> {
    plant: &'a Plant,
    grid: Grid,
    /// States in the order of [`place`], then the input.
    raw: Vec<[f64; place::COUNT + 1]>,
    motion: Vec<[Motion; 3]>,
    /// One for each row, or none at all where the linear equations say everything.
    extra: Vec<Extra>,
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
            extra: Vec::new(),
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

    /// Adds the next row with what its state does not tell.
    pub(crate) fn push_with(&mut self, row: [f64; place::COUNT + 1], motion: [Motion; 3], extra: Extra) {
        self.extra.push(extra);
        self.push(row, motion);
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
        self.extra.clear();
    }

    /// Computes every column of the block from the states, column by column so that the loops become vector instructions.
    fn fill(&mut self) {
        let raw = &self.raw;
        let rows = raw.len();
        let stage = self.plant.stage();
        let motor = &stage.motor;
        let r = stage.pulley_radius;
        let gain = stage.amplifier.gain;
        let mut columns = self.block.columns.iter_mut().map(|column| &mut column.values);
        let mut next = || {
            let values = columns.next().expect("one column for each heading");
            values.resize(rows, 0.0);
            &mut values[..rows]
        };
        let first = self.rows;
        put(next(), |j| self.grid.time(first + j as u64));
        let voltage = next();
        let (p1, w1, x, v, p3, w3) = (next(), next(), next(), next(), next(), next());
        for (j, &[phi1, omega1, position, speed, phi3, omega3, ..]) in raw.iter().enumerate() {
            p1[j] = phi1;
            w1[j] = omega1;
            x[j] = position;
            v[j] = speed;
            p3[j] = phi3;
            w3[j] = omega3;
        }
        let (p1, w1, x, v, p3, w3) = (&*p1, &*w1, &*x, &*v, &*p3, &*w3);
        let kn = motor.back_emf_constant * motor.gear_ratio;
        let current = next();
        match stage.amplifier.mode {
            AmplifierMode::Voltage => {
                put(voltage, |j| gain * raw[j][INPUT]);
                if self.plant.has_current_state() {
                    put(current, |j| raw[j][place::CURRENT]);
                } else {
                    // i = (V_in − K_e n φ̇₁) / R                                  in (4)
                    put(current, |j| (gain * raw[j][INPUT] - kn * w1[j]) / motor.resistance);
                }
            }
            AmplifierMode::Current => {
                put(current, |j| gain * raw[j][INPUT]);
                // What the terminals show at this current, the inductance apart: R i + K_e n φ̇₁
                put(voltage, |j| motor.resistance * current[j] + kn * w1[j]);
            }
        }
        let current = &*current;
        let [k1, k2, k3] = stage.belt.stiffness;
        let [c1, c2, c3] = stage.belt.damping;
        // f₁, f₂, f₃ after (1)-(3)
        let (f1, f2, f3) = (next(), next(), next());
        put(f1, |j| k1 * (r * p1[j] - x[j]) + c1 * (r * w1[j] - v[j]));
        put(f2, |j| k2 * (x[j] - r * p3[j]) + c2 * (v[j] - r * w3[j]));
        put(f3, |j| k3 * (r * p3[j] - r * p1[j]) + c3 * (r * w3[j] - r * w1[j]));
        for (j, extra) in self.extra.iter().enumerate() {
            f1[j] += extra.span[0];
            f2[j] += extra.span[1];
        }
        let (f1, f2, f3) = (&*f1, &*f2, &*f3);

        let one = |load: f64| (load, load);
        for (body, speed) in Body::ALL.into_iter().zip([w1, v, w3]) {
            let friction = next();
            // Stretches of rows in the same motion follow one formula.
            let mut start = 0;
            for same in self.motion.chunk_by(|a, b| a[body.index()] == b[body.index()]) {
                let stretch = start..start + same.len();
                let motion = same[0][body.index()];
                let law = |j: usize, load| self.plant.friction_value(body, motion, speed[j], load);
                let out = &mut friction[stretch];
                match (motion, body) {
                    (Motion::Stuck, Body::DrivePulley) => put(out, |j| {
                        let j = start + j;
                        let (least, most) = self.plant.holding_torque(current[j]);
                        let pull = r * f3[j] - r * f1[j];
                        law(j, (least + pull, most + pull))
                    }),
                    (Motion::Stuck, Body::Cart) => put(out, |j| law(start + j, one(f1[start + j] - f2[start + j]))),
                    (Motion::Stuck, Body::IdlerPulley) => {
                        put(out, |j| law(start + j, one(r * f2[start + j] - r * f3[start + j])))
                    }
                    _ => put(out, |j| law(start + j, (0.0, 0.0))),
                }
                start += same.len();
            }
            for (value, extra) in friction.iter_mut().zip(&self.extra) {
                *value += extra.friction[body.index()];
            }
        }
        for body in 0..3 {
            put(next(), |j| f64::from(self.motion[j][body].code()));
        }
        if shows_input(self.plant) {
            put(next(), |j| raw[j][INPUT]);
        }
        if let Some(encoder) = stage.encoder {
            // In quadrature every line gives four counts; the nearest count is shown.
            let (position, counts) = match encoder.at {
                EncoderPlace::Motor => (p1, 4.0 * encoder.lines * motor.gear_ratio / (2.0 * PI)),
                EncoderPlace::DrivePulley => (p1, 4.0 * encoder.lines / (2.0 * PI)),
                EncoderPlace::Cart => (x, 4.0 * encoder.lines),
            };
            put(next(), |j| (position[j] * counts).round());
        }
        for body in bristles(self.plant) {
            put(next(), |j| self.extra[j].bristle[body.index()]);
        }
    }
}

/// column[j] = value(j).
#[inline(always)]
fn put(column: &mut [f64], value: impl Fn(usize) -> f64) {
    column.iter_mut().enumerate().for_each(|(j, entry)| *entry = value(j));
}

/// Where the input stands in a row, behind the states.
const INPUT: usize = place::COUNT;

/// Whether the amplifier's input differs from the column of voltages and is worth a column of its own.
fn shows_input(plant: &Plant) -> bool {
    let amplifier = &plant.stage().amplifier;
    amplifier.gain != 1.0 || amplifier.mode == AmplifierMode::Current
}

/// The bodies whose friction is that of bristles.
fn bristles(plant: &Plant) -> impl Iterator<Item = Body> {
    Body::ALL.into_iter().filter(|body| matches!(plant.friction(*body).law, Law::LuGre { .. }))
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
    .map(|(name, unit)| Column { values: Vec::with_capacity(BLOCK), ..Column::new(name, unit) })
    .into();
    if shows_input(plant) {
        let unit = if plant.stage().amplifier.mode == AmplifierMode::Current { "A" } else { "V" };
        columns.push(Column::new("input", unit));
    }
    if plant.stage().encoder.is_some() {
        columns.push(Column::new("encoder_count", ""));
    }
    for body in bristles(plant) {
        let unit = if body == Body::Cart { "m" } else { "rad" };
        columns.push(Column::new(format!("{}_bristle", body.key()), unit));
    }
    columns
}
