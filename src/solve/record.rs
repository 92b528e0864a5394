//! From states to the columns that a user sees, block by block.

use super::coordinates::Coordinates;
use super::observe::{Observe, Output};
use super::{Detail, Flow, Grid};
use crate::friction::Motion;
use crate::mechanism::{BODIES, DRIVES, DriveMode, Form, Heading, Layout, Mechanism, Mode, SPRINGS, Shown, SpringLaw};
use crate::mechanism::{State, What};
use crate::trajectory::{Column, Trajectory};
use std::ops::Range;
use std::sync::Arc;

/// Rows handed on at a time; small enough to stay in the processor's cache.
const BLOCK: usize = 256;

/// What a row shows that does not follow from its state by the linear equations.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Extra {
    /// Friction beyond b v ± F_c, N or N m.
    pub(crate) friction: [f64; BODIES],
    /// Forces of springs beyond those with the stiffness at the origin, N.
    pub(crate) force: [f64; SPRINGS],
    /// Deflection of the bristles, m or rad.
    pub(crate) bristle: [f64; BODIES],
}

/// A row as the solver has it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    /// In angles and positions.
    pub(crate) state: State,
    /// Lengths of the springs, as accurate as the solver has them.
    pub(crate) stretch: [f64; SPRINGS],
    pub(crate) input: [f64; DRIVES],
}

impl Row {
    /// A state in the solver's coordinates.
    #[inline]
    pub(crate) fn new(layout: &Layout, coordinates: &Coordinates, inner: &State, input: [f64; DRIVES]) -> Self {
        Self { state: coordinates.state(layout, inner), stretch: layout.stretches(inner), input }
    }
}

/// Collects rows of states and hands them on as blocks of columns.
pub(crate) struct Recorder<'a> {
    mechanism: Arc<Mechanism>,
    grid: Grid,
    pub(crate) detail: Detail,
    /// The columns that are put out.
    columns: Vec<Heading>,
    raw: Vec<Row>,
    modes: Vec<Mode>,
    /// One for each row, or none at all where the linear equations say everything.
    extra: Vec<Extra>,
    source: Source,
    block: Trajectory,
    sink: &'a mut dyn FnMut(&Trajectory) -> Flow,
    /// Whoever sees what is between the rows, too.
    pub(crate) observer: Option<&'a mut dyn Observe>,
    /// Rows handed on.
    pub(crate) rows: u64,
    /// What the receiver answered last.
    pub(crate) flow: Flow,
}

/// What columns are made of.
#[derive(Default)]
struct Source {
    stretch: [Vec<f64>; SPRINGS],
    speed: [Vec<f64>; BODIES],
    armature: [Vec<f64>; DRIVES],
    input: [Vec<f64>; DRIVES],
    /// Forces of the springs and currents of the drives, which follow from those.
    force: [Vec<f64>; SPRINGS],
    current: [Vec<f64>; DRIVES],
    load: Vec<(f64, f64)>,
}

impl<'a> Recorder<'a> {
    pub(crate) fn new(mechanism: &Arc<Mechanism>, grid: Grid, Output { detail, sink, observer }: Output<'a>) -> Self {
        let shown = |heading: &&Heading| detail == Detail::Full || heading.lean;
        let columns: Vec<Heading> = mechanism.columns.iter().filter(shown).cloned().collect();
        let empty = |heading: &Heading| Column {
            values: Vec::with_capacity(BLOCK),
            ..Column::new(heading.name.clone(), heading.unit)
        };
        Self {
            mechanism: Arc::clone(mechanism),
            grid,
            detail,
            block: Trajectory { columns: columns.iter().map(empty).collect() },
            columns,
            raw: Vec::with_capacity(BLOCK),
            modes: Vec::with_capacity(BLOCK),
            extra: Vec::new(),
            source: Source::default(),
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
    pub(crate) fn push(&mut self, row: Row, mode: &Mode) {
        if self.detail == Detail::None {
            self.rows += 1;
            return;
        }
        self.raw.push(row);
        self.modes.push(*mode);
        if self.raw.len() == BLOCK {
            self.hand_on();
        }
    }

    /// Adds the next row with what its state does not tell.
    pub(crate) fn push_with(&mut self, row: Row, mode: &Mode, extra: Extra) {
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
        let mechanism = &*self.mechanism;
        let (raw, modes, extra) = (&self.raw[..], &self.modes[..], &self.extra[..]);
        // Amplifiers, gears, belt and stops: rows in the same state of all of them follow one formula.
        let mut alike: Vec<(Range<usize>, &Mode)> = Vec::new();
        for rows in modes.chunk_by(same_elements) {
            let start = alike.last().map_or(0, |(range, _)| range.end);
            alike.push((start..start + rows.len(), &rows[0]));
        }
        self.source.take(mechanism, raw, extra, &alike);
        let (source, grid, first) = (&mut self.source, self.grid, self.rows);
        for (heading, column) in self.columns.iter().zip(&mut self.block.columns) {
            column.values.resize(raw.len(), 0.0);
            let out = &mut column.values[..raw.len()];
            // −0 + 0 is 0.
            match heading.shown {
                Shown::Time => put(out, |j| grid.time(first + j as u64)),
                Shown::Input(drive) => out.copy_from_slice(&source.input[drive]),
                Shown::Voltage(drive) => {
                    for (rows, mode) in &alike {
                        source.put(&mut out[rows.clone()], rows.start, &mechanism.voltage(drive, mode));
                    }
                    // What a limit holds is not beyond it by one bit.
                    clamp(out, mechanism.drives[drive].amplifier.voltage_limit);
                }
                Shown::Current(drive) => out.copy_from_slice(&source.current[drive]),
                Shown::Position(body, factor) => put(out, |j| raw[j].state.position[body] * factor + 0.0),
                Shown::Speed(body, factor) => put(out, |j| raw[j].state.speed[body] * factor + 0.0),
                Shown::Stretch(spring) => out.copy_from_slice(&source.stretch[spring]),
                Shown::Force(spring, factor) => {
                    out.iter_mut().zip(&source.force[spring]).for_each(|(out, force)| *out = force * factor);
                }
                Shown::Friction(body) => source.friction(mechanism, body, modes, extra, out),
                Shown::Motion(body) => put(out, |j| f64::from(modes[j].motion[body].code())),
                Shown::Contact(spring) => {
                    let what = match mechanism.springs[spring].law {
                        SpringLaw::Tension { .. } => What::Span(spring),
                        _ => What::Gap(spring),
                    };
                    put(out, |j| f64::from(modes[j].status(what).code()));
                }
                Shown::Counts(body, counts) => put(out, |j| (raw[j].state.position[body] * counts).round() + 0.0),
                Shown::Bristle(body) => put(out, |j| extra.get(j).map_or(0.0, |extra| extra.bristle[body])),
            }
        }
    }
}

fn same_elements(a: &Mode, b: &Mode) -> bool {
    let limits = |drive: &DriveMode| (drive.voltage, drive.current);
    a.slack == b.slack && a.contact == b.contact && a.drive.iter().map(limits).eq(b.drive.iter().map(limits))
}

impl Source {
    /// Takes what the rows show of themselves, and the forces and currents that follow.
    fn take(&mut self, mechanism: &Mechanism, raw: &[Row], extra: &[Extra], alike: &[(Range<usize>, &Mode)]) {
        let rows = raw.len();
        for spring in 0..mechanism.springs.len() {
            self.stretch[spring].resize(rows, 0.0);
            put(&mut self.stretch[spring], |j| raw[j].stretch[spring]);
        }
        for body in 0..mechanism.bodies.len() {
            self.speed[body].resize(rows, 0.0);
            put(&mut self.speed[body], |j| raw[j].state.speed[body] + 0.0);
        }
        for (index, drive) in mechanism.drives.iter().enumerate() {
            self.input[index].resize(rows, 0.0);
            put(&mut self.input[index], |j| raw[j].input[index] + 0.0);
            self.armature[index].resize(rows, 0.0);
            if drive.has_current_state() {
                put(&mut self.armature[index], |j| raw[j].state.current[index]);
            }
        }
        for index in 0..mechanism.springs.len() {
            let mut force = std::mem::take(&mut self.force[index]);
            force.resize(rows, 0.0);
            for (rows, mode) in alike {
                self.put(&mut force[rows.clone()], rows.start, &mechanism.spring_force(index, mode));
            }
            for (force, extra) in force.iter_mut().zip(extra) {
                *force += extra.force[index];
            }
            self.force[index] = force;
        }
        for index in 0..mechanism.drives.len() {
            let mut current = std::mem::take(&mut self.current[index]);
            current.resize(rows, 0.0);
            for (rows, mode) in alike {
                self.put(&mut current[rows.clone()], rows.start, &mechanism.current(index, mode));
            }
            clamp(&mut current, mechanism.drives[index].amplifier.current_limit);
            self.current[index] = current;
        }
    }

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
        self.armature.iter().zip(form.current).for_each(|(column, factor)| add(factor, column));
        self.input.iter().zip(form.input).for_each(|(column, factor)| add(factor, column));
        if first {
            out.fill(form.constant);
        }
    }

    /// Friction on a body: what its law gives while it slides, what holds it while it is stuck.
    fn friction(&mut self, mechanism: &Mechanism, body: usize, modes: &[Mode], extra: &[Extra], out: &mut [f64]) {
        let mut start = 0;
        for same in modes.chunk_by(|a, b| a.motion[body] == b.motion[body]) {
            let (motion, rows) = (same[0].motion[body], start..start + same.len());
            let out = &mut out[rows.clone()];
            if motion == Motion::Stuck && mechanism.leader(body) == body {
                self.load(mechanism, body, rows);
                put(out, |j| mechanism.friction_value(body, motion, 0.0, self.load[j]) + 0.0);
            } else {
                let speed = &self.speed[body][start..];
                put(out, |j| mechanism.friction_value(body, motion, speed[j], (0.0, 0.0)) + 0.0);
            }
            start += same.len();
        }
        for (value, extra) in out.iter_mut().zip(extra) {
            *value += extra.friction[body];
        }
    }

    /// What acts on a body at rest beside friction, the least and the most of it: the inner brackets of (16)-(18).
    fn load(&mut self, mechanism: &Mechanism, leader: usize, rows: Range<usize>) {
        self.load.clear();
        self.load.resize(rows.len(), (0.0, 0.0));
        for body in mechanism.followers(leader) {
            let ratio = mechanism.ratio(body);
            for (index, drive) in mechanism.drives.iter().enumerate().filter(|(_, drive)| drive.shaft == body) {
                let current = &self.current[index][rows.clone()];
                for (load, current) in self.load.iter_mut().zip(current) {
                    let torque = drive.motor.gear_ratio * drive.motor.torque_constant * current;
                    let (least, most) = match drive.has_rotor() {
                        true => (torque, torque),
                        false => mechanism.holding_torque(index, *current),
                    };
                    *load = (load.0 + ratio * least, load.1 + ratio * most);
                }
            }
            for (spring, part) in mechanism.springs.iter().enumerate().rev() {
                for &(_, arm) in part.arms.iter().filter(|(other, _)| *other == body) {
                    let arm = ratio * arm;
                    for (load, force) in self.load.iter_mut().zip(&self.force[spring][rows.clone()]) {
                        *load = (load.0 - arm * force, load.1 - arm * force);
                    }
                }
            }
            let constant = ratio * mechanism.bodies[body].force;
            self.load.iter_mut().for_each(|load| *load = (load.0 + constant, load.1 + constant));
        }
    }
}

fn clamp(column: &mut [f64], limit: Option<f64>) {
    if let Some(limit) = limit {
        column.iter_mut().for_each(|value| *value = value.clamp(-limit, limit));
    }
}

/// column[j] = value(j).
#[inline(always)]
fn put(column: &mut [f64], value: impl Fn(usize) -> f64) {
    column.iter_mut().enumerate().for_each(|(j, entry)| *entry = value(j));
}
