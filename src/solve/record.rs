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

/// Room for a state with the inputs behind it, whatever the mechanism.
pub(crate) const STATE: usize = 2 * BODIES + 2 * DRIVES;

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

/// Rows in one mode.
#[derive(Clone)]
struct Segment {
    /// The first of them, in the block.
    start: usize,
    mode: Mode,
    /// What angles follow from.
    coordinates: Coordinates,
}

/// Collects rows of states and hands them on as blocks of columns.
pub(crate) struct Recorder<'a> {
    mechanism: Arc<Mechanism>,
    layout: Layout,
    grid: Grid,
    pub(crate) detail: Detail,
    /// States in the solver's coordinates with the inputs among them or behind them, row after row.
    raw: Vec<f64>,
    /// How many numbers a row has, and where the inputs stand.
    stride: usize,
    inputs: [usize; DRIVES],
    /// How many rows there are; those behind the ones that are written out are like the last of them.
    count: usize,
    segments: Vec<Segment>,
    /// Which mode the last one is of.
    taken: Option<u64>,
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
    position: [Vec<f64>; BODIES],
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
    /// That of rows of `stride` numbers, states in the places of the layout and inputs where `input` says.
    pub(crate) fn new(
        mechanism: &Arc<Mechanism>,
        layout: &Layout,
        (stride, input): (usize, &dyn Fn(usize) -> usize),
        grid: Grid,
        Output { detail, sink, observer }: Output<'a>,
    ) -> Self {
        let mut inputs = [0; DRIVES];
        inputs.iter_mut().enumerate().take(layout.inputs).for_each(|(drive, place)| *place = input(drive));
        let shown = |heading: &&Heading| is_shown(heading, detail);
        let empty = |heading: &Heading| Column {
            values: Vec::with_capacity(BLOCK),
            ..Column::new(heading.name.as_ref(), heading.unit)
        };
        Self {
            mechanism: Arc::clone(mechanism),
            layout: layout.clone(),
            grid,
            detail,
            block: Trajectory { columns: mechanism.columns.iter().filter(shown).map(empty).collect() },
            raw: Vec::with_capacity(if detail == Detail::None { 0 } else { BLOCK * stride }),
            stride,
            inputs,
            count: 0,
            segments: Vec::new(),
            taken: None,
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
        self.rows + self.count as u64
    }

    /// Rows from here on are in this mode; `taken` tells one from another.
    #[inline]
    pub(crate) fn segment(&mut self, taken: u64, coordinates: &Coordinates, mode: &Mode) {
        if self.detail != Detail::None && self.taken != Some(taken) {
            self.taken = Some(taken);
            let (start, mode, coordinates) = (self.count, *mode, coordinates.clone());
            self.segments.push(Segment { start, mode, coordinates });
        }
    }

    /// Adds the next row: a state in the solver's coordinates, in the places of the layout, with the inputs.
    #[inline]
    pub(crate) fn push<const N: usize>(&mut self, row: &[f64; N]) {
        if self.detail == Detail::None {
            self.rows += 1;
            return;
        }
        debug_assert_eq!(N, self.stride);
        if self.raw.len() != self.count * N {
            self.write_out();
        }
        self.raw.extend_from_slice(row);
        self.count += 1;
        if self.count == BLOCK {
            self.hand_on();
        }
    }

    /// Writes out rows that are like the one before, or forgets those that were handed on.
    #[cold]
    fn write_out(&mut self) {
        if self.count == 0 {
            self.raw.clear();
        }
        let last = self.raw.len().saturating_sub(self.stride);
        while self.raw.len() < self.count * self.stride {
            self.raw.extend_from_within(last..last + self.stride);
        }
    }

    /// Adds the last row so many times more, or until the receiver wants no more; says how often. Nothing but time goes on.
    pub(crate) fn repeat(&mut self, times: u64) -> u64 {
        let mut left = times;
        while left > 0 && self.flow == Flow::Continue {
            if self.count == 0 {
                // The last row has just been handed on: its numbers stand yet.
                self.raw.drain(..self.raw.len() - self.stride);
            }
            let more = left.min((BLOCK - self.count) as u64);
            self.count += more as usize;
            left -= more;
            if self.count == BLOCK {
                self.hand_on();
            }
        }
        times - left
    }

    /// Adds the next row: a whole state, of a recorder of rows of [`STATE`] numbers.
    pub(crate) fn push_state(&mut self, inner: &State, input: &[f64; DRIVES], extra: Option<Extra>) {
        if self.detail != Detail::None {
            self.extra.extend(extra);
        }
        let mut row = [0.0; STATE];
        for body in 0..self.layout.bodies() {
            row[self.layout.coordinate[body]] = inner.position[body];
            row[self.layout.speed[body]] = inner.speed[body];
        }
        for drive in 0..self.layout.inputs {
            row[self.layout.current[drive]] = inner.current[drive];
            row[self.inputs[drive]] = input[drive];
        }
        self.push(&row);
    }

    /// Counts so many rows that nobody is to see.
    pub(crate) fn skip(&mut self, rows: u64) {
        self.rows += rows;
    }

    /// Hands on what there is, be it nothing, to hear whether to go on.
    pub(crate) fn ask(&mut self) {
        if self.count > 0 {
            self.hand_on();
        } else if self.flow == Flow::Continue {
            self.block.columns.iter_mut().for_each(|column| column.values.clear());
            self.flow = (self.sink)(&self.block);
        }
    }

    /// Hands on what is left.
    pub(crate) fn finish(&mut self) {
        if self.count > 0 {
            self.hand_on();
        }
    }

    fn hand_on(&mut self) {
        self.fill();
        self.rows += self.count as u64;
        if self.flow == Flow::Continue {
            self.flow = (self.sink)(&self.block);
        }
        self.count = 0;
        // What comes next is in the mode of the last.
        self.segments.drain(..self.segments.len().saturating_sub(1));
        self.segments.iter_mut().for_each(|segment| segment.start = 0);
        self.extra.clear();
    }

    /// Computes every column of the block from the states, column by column so that the loops become vector instructions.
    fn fill(&mut self) {
        let mechanism = &*self.mechanism;
        let rows = Rows {
            layout: &self.layout,
            raw: &self.raw,
            stride: self.stride,
            inputs: self.inputs,
            count: self.raw.len() / self.stride,
        };
        let ends = self.segments.iter().skip(1).map(|segment| segment.start).chain([rows.count]);
        let segments: Vec<(Range<usize>, &Segment)> =
            self.segments.iter().zip(ends).map(|(segment, end)| (segment.start..end, segment)).collect();
        // Amplifiers, gears, belt and stops: rows in the same state of all of them follow one formula.
        let mut alike: Vec<(Range<usize>, &Mode)> = Vec::with_capacity(segments.len());
        for (range, segment) in &segments {
            match alike.last_mut() {
                Some((last, mode)) if same_elements(mode, &segment.mode) => last.end = range.end,
                _ => alike.push((range.clone(), &segment.mode)),
            }
        }
        let extra = &self.extra[..];
        self.source.take(mechanism, &rows, extra, &segments, &alike);
        let (source, grid, first) = (&mut self.source, self.grid, self.rows);
        let detail = self.detail;
        let headings = mechanism.columns.iter().filter(|heading| is_shown(heading, detail));
        for (heading, column) in headings.zip(&mut self.block.columns) {
            column.values.resize(rows.count, 0.0);
            let out = &mut column.values[..rows.count];
            // −0 + 0 is 0.
            match heading.shown {
                // Below: it goes on where all else stands.
                Shown::Time => {}
                Shown::Input(drive) => out.copy_from_slice(&source.input[drive]),
                Shown::Voltage(drive) => {
                    for (rows, mode) in &alike {
                        source.put(&mut out[rows.clone()], rows.start, &mechanism.voltage(drive, mode));
                    }
                    // What a limit holds is not beyond it by one bit.
                    clamp(out, mechanism.drives[drive].amplifier.voltage_limit);
                }
                Shown::Current(drive) => out.copy_from_slice(&source.current[drive]),
                Shown::Position(body, factor) => {
                    out.iter_mut().zip(&source.position[body]).for_each(|(out, way)| *out = way * factor + 0.0)
                }
                Shown::Speed(body, factor) => {
                    out.iter_mut().zip(&source.speed[body]).for_each(|(out, speed)| *out = speed * factor + 0.0)
                }
                Shown::Stretch(spring) => out.copy_from_slice(&source.stretch[spring]),
                Shown::Force(spring, factor) => {
                    out.iter_mut().zip(&source.force[spring]).for_each(|(out, force)| *out = force * factor);
                }
                Shown::Friction(body) => source.friction(mechanism, body, &segments, extra, out),
                Shown::Motion(body) => {
                    for (range, segment) in &segments {
                        out[range.clone()].fill(f64::from(segment.mode.motion[body].code()));
                    }
                }
                Shown::Contact(spring) => {
                    let what = match mechanism.springs[spring].law {
                        SpringLaw::Tension { .. } => What::Span(spring),
                        _ => What::Gap(spring),
                    };
                    for (range, mode) in &alike {
                        out[range.clone()].fill(f64::from(mode.status(what).code()));
                    }
                }
                Shown::Counts(body, counts) => {
                    let way = &source.position[body];
                    put(out, |j| (way[j] * counts).round() + 0.0);
                }
                Shown::Bristle(body) => put(out, |j| extra.get(j).map_or(0.0, |extra| extra.bristle[body])),
            }
            let last = column.values.last().copied().unwrap_or(0.0);
            column.values.resize(self.count, last);
            if heading.shown == Shown::Time {
                put(&mut column.values, |j| grid.time(first + j as u64));
            }
        }
    }
}

/// Whether a column is put out.
fn is_shown(heading: &Heading, detail: Detail) -> bool {
    detail == Detail::Full || heading.lean
}

fn same_elements(a: &Mode, b: &Mode) -> bool {
    let limits = |drive: &DriveMode| (drive.voltage, drive.current);
    a.slack == b.slack && a.contact == b.contact && a.drive.iter().map(limits).eq(b.drive.iter().map(limits))
}

/// Rows as they were pushed.
struct Rows<'r> {
    layout: &'r Layout,
    raw: &'r [f64],
    stride: usize,
    inputs: [usize; DRIVES],
    count: usize,
}

impl Rows<'_> {
    /// Puts what stands at a place of each row into a column.
    fn column(&self, place: usize, out: &mut Vec<f64>) {
        out.resize(self.count, 0.0);
        // −0 + 0 is 0.
        out.iter_mut().zip(self.raw.chunks_exact(self.stride)).for_each(|(out, row)| *out = row[place] + 0.0);
    }
}

impl Source {
    /// Takes what the rows show of themselves, and the forces and currents that follow.
    fn take(
        &mut self,
        mechanism: &Mechanism,
        rows: &Rows,
        extra: &[Extra],
        segments: &[(Range<usize>, &Segment)],
        alike: &[(Range<usize>, &Mode)],
    ) {
        let layout = rows.layout;
        for body in 0..mechanism.bodies.len() {
            rows.column(layout.coordinate[body], &mut self.position[body]);
            rows.column(layout.speed[body], &mut self.speed[body]);
        }
        for spring in 0..mechanism.springs.len() {
            let out = &mut self.stretch[spring];
            out.clear();
            out.resize(rows.count, 0.0);
            for (body, weight) in layout.weights(spring) {
                out.iter_mut().zip(&self.position[body]).for_each(|(out, way)| *out += weight * way);
            }
        }
        // From coordinates to ways, where they differ.
        for replaced in &layout.replaced {
            let mut own = std::mem::take(&mut self.position[replaced.body]);
            for (range, segment) in segments {
                segment.coordinates.place(replaced, &mut own, &self.position, range.clone());
            }
            self.position[replaced.body] = own;
        }
        if let Some((_, segment)) = segments.first() {
            for (body, position) in self.position.iter_mut().enumerate().take(mechanism.bodies.len()) {
                let origin = segment.coordinates.origin()[body];
                if origin != 0.0 {
                    position.iter_mut().for_each(|way| *way += origin);
                }
            }
        }
        for (index, drive) in mechanism.drives.iter().enumerate() {
            rows.column(rows.inputs[index], &mut self.input[index]);
            match drive.has_current_state() {
                true => rows.column(layout.current[index], &mut self.armature[index]),
                false => self.armature[index].resize(rows.count, 0.0),
            }
        }
        let rows = rows.count;
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
    fn friction(
        &mut self,
        mechanism: &Mechanism,
        body: usize,
        segments: &[(Range<usize>, &Segment)],
        extra: &[Extra],
        out: &mut [f64],
    ) {
        for (rows, segment) in segments {
            let (motion, out) = (segment.mode.motion[body], &mut out[rows.clone()]);
            if motion == Motion::Stuck && mechanism.leader(body) == body {
                self.load(mechanism, body, rows.clone());
                put(out, |j| mechanism.friction_value(body, motion, 0.0, self.load[j]) + 0.0);
            } else {
                let speed = &self.speed[body][rows.clone()];
                put(out, |j| mechanism.friction_value(body, motion, speed[j], (0.0, 0.0)) + 0.0);
            }
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
