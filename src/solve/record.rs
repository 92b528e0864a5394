//! From states to the columns that a user sees, block by block.

use super::coordinates::{Coordinates, stretches};
use super::observe::{Observe, Output};
use super::{Detail, Flow, Grid};
use crate::friction::{Law, Motion};
use crate::plant::{Body, Form, Mode, Part, Plant, SPEEDS, STRETCHES, State, place};
use crate::stage::{AmplifierMode, BeltModel, EncoderPlace};
use crate::trajectory::{Column, Trajectory};

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

/// A row as the solver has it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    /// In angles and positions.
    pub(crate) state: State,
    /// r φ₁ − x, x − r φ₃ (m), φ_r − φ₁ (rad) and x − x₀ (m), as accurate as the solver has them.
    pub(crate) stretch: [f64; 4],
    pub(crate) input: f64,
}

impl Row {
    /// A state in the solver's coordinates.
    #[inline]
    pub(crate) fn new(coordinates: &Coordinates, inner: &State, input: f64) -> Self {
        let [d1, d2, _, twist, way] = stretches(inner);
        Self { state: coordinates.state(inner), stretch: [d1, d2, twist, way], input }
    }
}

/// Collects rows of states and hands them on as blocks of columns.
pub(crate) struct Recorder<'a> {
    plant: &'a Plant,
    grid: Grid,
    pub(crate) detail: Detail,
    raw: Vec<Row>,
    modes: Vec<Mode>,
    /// One for each row, or none at all where the linear equations say everything.
    extra: Vec<Extra>,
    /// Columns that are only needed on the way: stretches, rotor, current and input, gear torque and force of the stops.
    scratch: [Vec<f64>; 10],
    block: Trajectory,
    sink: &'a mut dyn FnMut(&Trajectory) -> Flow,
    /// Whoever sees what is between the rows, too.
    pub(crate) observer: Option<&'a mut dyn Observe>,
    /// Rows handed on.
    pub(crate) rows: u64,
    /// What the receiver answered last.
    pub(crate) flow: Flow,
}

impl<'a> Recorder<'a> {
    pub(crate) fn new(plant: &'a Plant, grid: Grid, Output { detail, sink, observer }: Output<'a>) -> Self {
        Self {
            plant,
            grid,
            detail,
            raw: Vec::with_capacity(BLOCK),
            modes: Vec::with_capacity(BLOCK),
            extra: Vec::new(),
            scratch: Default::default(),
            block: Trajectory { columns: headings(plant, detail) },
            sink,
            observer,
            rows: 0,
            flow: Flow::Continue,
        }
    }

    /// Rows received so far: the number of the next one.
    pub(crate) fn next_row(&self) -> u64 {
        self.rows + self.raw.len() as u64
    }

    /// Adds the next row.
    #[inline]
    pub(crate) fn push(&mut self, row: Row, mode: Mode) {
        if self.detail == Detail::None {
            self.rows += 1;
            return;
        }
        self.raw.push(row);
        self.modes.push(mode);
        if self.raw.len() == BLOCK {
            self.hand_on();
        }
    }

    /// Adds the next row with what its state does not tell.
    pub(crate) fn push_with(&mut self, row: Row, mode: Mode, extra: Extra) {
        if self.detail != Detail::None {
            self.extra.push(extra);
        }
        self.push(row, mode);
    }

    /// Counts so many rows that nobody is to see.
    pub(crate) fn skip(&mut self, rows: u64) {
        self.rows += rows;
    }

    /// Hands on what there is, be it nothing, to hear whether to go on.
    pub(crate) fn ask(&mut self) {
        if !self.raw.is_empty() {
            self.hand_on();
        } else if self.flow == Flow::Continue {
            self.block.columns.iter_mut().for_each(|column| column.values.clear());
            self.flow = (self.sink)(&self.block);
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
        self.modes.clear();
        self.extra.clear();
    }

    /// Computes every column of the block from the states, column by column so that the loops become vector instructions.
    fn fill(&mut self) {
        let plant = self.plant;
        let stage = plant.stage();
        let (raw, modes, extras) = (&self.raw, &self.modes, &self.extra);
        let rows = raw.len();
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
        for (j, row) in raw.iter().enumerate() {
            let [phi1, omega1, position, speed, phi3, omega3, ..] = row.state;
            // −0 + 0 is 0.
            p1[j] = phi1 + 0.0;
            w1[j] = omega1 + 0.0;
            x[j] = position + 0.0;
            v[j] = speed + 0.0;
            p3[j] = phi3 + 0.0;
            w3[j] = omega3 + 0.0;
        }
        let (w1, v, w3) = (&*w1, &*v, &*w3);
        let r = stage.pulley_radius;
        let [d1, d2, d3, twist, way, rotor, armature, input, torque, stop] = &mut self.scratch;
        let sized = |column: &mut Vec<f64>| column.resize(rows, 0.0);
        [&mut *d1, d2, d3, twist, way, rotor, armature, input, torque, stop].into_iter().for_each(sized);
        put(d1, |j| raw[j].stretch[0]);
        put(d2, |j| raw[j].stretch[1]);
        put(d3, |j| -(raw[j].stretch[0] + raw[j].stretch[1]));
        if stage.travel.is_some() {
            put(way, |j| raw[j].stretch[3]);
        }
        put(input, |j| raw[j].input + 0.0);
        if plant.has_current_state() {
            put(armature, |j| raw[j].state[place::CURRENT]);
        }
        if plant.has_rotor() {
            put(twist, |j| raw[j].stretch[2]);
            put(rotor, |j| raw[j].state[place::ROTOR_SPEED]);
        }
        let source = Source { stretch: [d1, d2, d3, twist, way], speed: [w1, v, w3, rotor], current: armature, input };
        let (current, f1, f2, f3) = (next(), next(), next(), next());
        let alike = |same: fn(&Mode, &Mode) -> bool| {
            modes.chunk_by(same).scan(0, |start, rows| {
                *start += rows.len();
                Some((*start - rows.len()..*start, &rows[0]))
            })
        };
        // Amplifier, gear, belt and stops: rows in the same state of all of them follow one formula.
        let elements =
            |a: &Mode, b: &Mode| Mode { motion: b.motion, gear_torque_positive: b.gear_torque_positive, ..*a } == *b;
        for (rows, mode) in alike(elements) {
            source.put(&mut voltage[rows.clone()], rows.start, &plant.voltage(mode));
            source.put(&mut current[rows.clone()], rows.start, &plant.current(mode));
            for (force, form) in [&mut *f1, &mut *f2, &mut *f3].into_iter().zip(plant.span_forces(mode)) {
                source.put(&mut force[rows.clone()], rows.start, &form);
            }
        }
        for (j, extra) in extras.iter().enumerate() {
            f1[j] += extra.span[0];
            f2[j] += extra.span[1];
        }
        // What a limit holds is not beyond it by one bit.
        for (column, limit) in
            [(&mut *voltage, stage.amplifier.voltage_limit), (&mut *current, stage.amplifier.current_limit)]
        {
            if let Some(limit) = limit {
                column.iter_mut().for_each(|value| *value = value.clamp(-limit, limit));
            }
        }
        if self.detail != Detail::Full {
            for body in 0..3 {
                put(next(), |j| f64::from(modes[j].motion[body].code()));
            }
            if shows_input(plant) {
                next().copy_from_slice(input);
            }
            return;
        }
        let (current, f1, f2, f3) = (&*current, &*f1, &*f2, &*f3);
        for (column, there, form) in [
            (&mut *torque, plant.has_rotor(), Plant::gear_torque as fn(&Plant, &Mode) -> Form),
            (&mut *stop, stage.travel.is_some(), Plant::stop_force),
        ] {
            if there {
                for (rows, mode) in alike(elements) {
                    source.put(&mut column[rows.clone()], rows.start, &form(plant, mode));
                }
            }
        }
        let (torque, stop) = (&*torque, &*stop);

        let constant = stage.cart.constant_force();
        // What acts on each body beside friction, the least and the most of it: the inner brackets of (16)-(18)
        let own = |body: Body, j: usize| match body {
            Body::DrivePulley => {
                let pull = r * f3[j] - r * f1[j];
                let (least, most) =
                    if plant.has_rotor() { (torque[j], torque[j]) } else { plant.holding_torque(current[j]) };
                (least + pull, most + pull)
            }
            Body::Cart => {
                let load = f1[j] - f2[j] + (constant + stop[j]);
                (load, load)
            }
            Body::IdlerPulley => {
                let load = r * f2[j] - r * f3[j];
                (load, load)
            }
        };
        let alone = stage.belt.model == BeltModel::Elastic;
        for body in Body::ALL {
            let friction = next();
            let speed = source.speed[body.index()];
            let mut start = 0;
            for same in modes.chunk_by(|a, b| a.motion[body.index()] == b.motion[body.index()]) {
                let motion = same[0].motion[body.index()];
                let out = &mut friction[start..start + same.len()];
                match motion {
                    Motion::Stuck if alone => {
                        put(out, |j| plant.friction_value(body, motion, 0.0, own(body, start + j)) + 0.0);
                    }
                    Motion::Stuck => put(out, |j| {
                        let sum = |(least, most): (f64, f64), follower| {
                            let (load, ratio) = (own(follower, start + j), plant.ratio(follower));
                            (least + ratio * load.0, most + ratio * load.1)
                        };
                        plant.friction_value(body, motion, 0.0, plant.followers(body).fold((0.0, 0.0), sum)) + 0.0
                    }),
                    _ => put(out, |j| plant.friction_value(body, motion, speed[start + j], (0.0, 0.0)) + 0.0),
                }
                start += same.len();
            }
            for (value, extra) in friction.iter_mut().zip(extras) {
                *value += extra.friction[body.index()];
            }
        }
        for body in 0..3 {
            put(next(), |j| f64::from(modes[j].motion[body].code()));
        }
        if shows_input(plant) {
            next().copy_from_slice(input);
        }
        if plant.has_rotor() {
            put(next(), |j| raw[j].state[place::ROTOR_ANGLE] + 0.0);
            next().copy_from_slice(rotor);
            next().copy_from_slice(torque);
            put(next(), |j| f64::from(modes[j].gear.code()));
        }
        if stage.belt.pretension.is_some() {
            for span in 0..3 {
                put(next(), |j| f64::from(modes[j].status(Part::Span(span)).code()));
            }
        }
        if shows_stop(plant) {
            next().copy_from_slice(stop);
        }
        if let Some(encoder) = stage.encoder {
            let place = match encoder.at {
                EncoderPlace::Motor => place::ROTOR_ANGLE,
                EncoderPlace::DrivePulley => place::DRIVE_ANGLE,
                EncoderPlace::Cart => place::CART_POSITION,
            };
            let counts = encoder.counts_per_unit(stage.motor.gear_ratio);
            put(next(), |j| (raw[j].state[place] * counts).round() + 0.0);
        }
        for body in bristles(plant) {
            put(next(), |j| extras[j].bristle[body.index()]);
        }
    }
}

/// What forms are made of, row by row.
struct Source<'a> {
    stretch: [&'a [f64]; STRETCHES],
    speed: [&'a [f64]; SPEEDS],
    current: &'a [f64],
    input: &'a [f64],
}

impl Source<'_> {
    /// The values of a form in the rows from `start` on.
    fn put(&self, out: &mut [f64], start: usize, form: &Form) {
        let mut first = true;
        let mut add = |factor: f64, column: &[f64]| {
            if factor == 0.0 {
                return;
            }
            let terms = out.iter_mut().zip(&column[start..]);
            if first {
                terms.for_each(|(out, value)| *out = factor * value + form.constant);
            } else {
                terms.for_each(|(out, value)| *out += factor * value);
            }
            first = false;
        };
        self.stretch.iter().zip(form.stretch).for_each(|(column, factor)| add(factor, column));
        self.speed.iter().zip(form.speed).for_each(|(column, factor)| add(factor, column));
        add(form.current, self.current);
        add(form.input, self.input);
        if first {
            out.fill(form.constant);
        }
    }
}

/// column[j] = value(j).
#[inline(always)]
fn put(column: &mut [f64], value: impl Fn(usize) -> f64) {
    column.iter_mut().enumerate().for_each(|(j, entry)| *entry = value(j));
}

/// Whether the amplifier's input differs from the column of voltages and is worth a column of its own.
fn shows_input(plant: &Plant) -> bool {
    let amplifier = &plant.stage().amplifier;
    amplifier.gain != 1.0
        || amplifier.mode == AmplifierMode::Current
        || amplifier.voltage_limit.is_some()
        || amplifier.current_limit.is_some()
}

/// Whether there are end stops to show the force of.
fn shows_stop(plant: &Plant) -> bool {
    plant.stage().travel.is_some_and(|travel| travel.stop.is_some())
}

/// The bodies whose friction is that of bristles.
fn bristles(plant: &Plant) -> impl Iterator<Item = Body> {
    Body::ALL.into_iter().filter(|body| matches!(plant.friction(*body).law, Law::LuGre { .. }))
}

/// The columns of a run on this stage, without rows.
fn headings(plant: &Plant, detail: Detail) -> Vec<Column> {
    let full = detail == Detail::Full;
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
    .into_iter()
    .filter(|(name, _)| full || !name.ends_with("_friction"))
    .map(|(name, unit)| Column { values: Vec::with_capacity(BLOCK), ..Column::new(name, unit) })
    .collect();
    if shows_input(plant) {
        let unit = if plant.stage().amplifier.mode == AmplifierMode::Current { "A" } else { "V" };
        columns.push(Column::new("input", unit));
    }
    if !full {
        return columns;
    }
    if plant.has_rotor() {
        for (name, unit) in
            [("rotor_angle", "rad"), ("rotor_speed", "rad/s"), ("gear_torque", "N m"), ("gear_state", "")]
        {
            columns.push(Column::new(name, unit));
        }
    }
    if plant.stage().belt.pretension.is_some() {
        columns.extend(["span1_slack", "span2_slack", "span3_slack"].map(|name| Column::new(name, "")));
    }
    if shows_stop(plant) {
        columns.push(Column::new("stop_force", "N"));
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
