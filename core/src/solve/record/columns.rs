//! A block of rows, column by column: states as received, and everything that follows from them.
//!
//! Every column is a form of earlier columns and is computed for all rows of one mode at once, so that the loops become
//! vector instructions; like those of [`crate::solve::propagator`], they are compiled twice and give the same bits.

use super::sheet::{Elements, Held, Sheets};
use super::sum::{Places, Sum, Values};
use super::{BLOCK, Detail, Extra, Segment};
use crate::mechanism::{DRIVES, Heading, Layout, Mechanism, Shown};
use crate::solve::coordinates::Coordinates;
use crate::solve::widest::widest;
use crate::trajectory::{Grid, Trajectory};
use std::ops::Range;

/// Consecutive rows with the same [`Elements`], and the index of these.
pub(super) type Stretch = (Range<usize>, usize);

/// The columns of a block.
pub(super) struct Columns {
    /// The rows as received.
    raw: Vec<f64>,
    values: Vec<Values>,
    pub(super) places: Places,
    detail: Detail,
    /// Lengths of the springs from the coordinates.
    stretches: Vec<Sum>,
}

/// The rows to fill.
pub(super) struct Block<'b> {
    pub(super) mechanism: &'b Mechanism,
    pub(super) sheets: &'b Sheets,
    pub(super) segments: &'b [Segment],
    /// [`stretches`] of them.
    pub(super) stretches: &'b [Stretch],
    pub(super) extra: &'b [Extra],
    /// Number of rows in the columns; those up to `count` equal the last of them.
    pub(super) written: usize,
    pub(super) count: usize,
    pub(super) grid: Grid,
    /// The number of the first row.
    pub(super) first: u64,
}

impl Columns {
    /// Columns of rows of `stride` numbers, a multiple of four.
    pub(super) fn new(
        mechanism: &Mechanism,
        layout: &Layout,
        (stride, inputs): (usize, [usize; DRIVES]),
        detail: Detail,
    ) -> Self {
        assert!(stride.is_multiple_of(4));
        let (bodies, springs, drives) = (mechanism.bodies.len(), mechanism.springs.len(), mechanism.drives.len());
        let places = Places { bodies, springs, drives, stride, inputs, layout: layout.clone() };
        let stretch = |spring: usize| {
            let mut sum = Sum::constant(0.0);
            layout.weights(spring).for_each(|(body, weight)| sum.add(places.coordinate(body), weight));
            sum
        };
        let stretches = (0..places.springs).map(stretch).collect();
        let (raw, values) = match detail {
            Detail::None => (Vec::new(), Vec::new()),
            _ => (vec![0.0; BLOCK * stride], vec![[0.0; BLOCK]; places.count()]),
        };
        Self { raw, values, detail, stretches, places }
    }

    /// Buffer for rows from `first` to the end of the block.
    #[inline]
    pub(super) fn rows<const N: usize>(&mut self, first: usize) -> &mut [[f64; N]] {
        debug_assert_eq!(N, self.places.stride);
        self.raw.as_chunks_mut().0.split_at_mut(first).1
    }

    /// Repeats the last row before `from` up to `until`.
    pub(super) fn repeat(&mut self, from: usize, until: usize) {
        let stride = self.places.stride;
        (from..until).for_each(|row| self.raw.copy_within((from - 1) * stride..from * stride, row * stride));
    }

    /// The next block begins with a row of the last one.
    pub(super) fn begin_with(&mut self, row: usize) {
        let stride = self.places.stride;
        self.raw.copy_within(row * stride..(row + 1) * stride, 0);
    }

    /// Transposes the rows into columns, four by four. −0 + 0 is 0.
    #[inline(always)]
    fn turn(&mut self, rows: usize) {
        let groups = self.places.stride / 4;
        let fours = self.raw.as_chunks::<4>().0;
        for block in 0..rows.div_ceil(4) {
            for group in 0..groups {
                let row = |j: usize| fours[(4 * block + j) * groups + group];
                let rows = [row(0), row(1), row(2), row(3)];
                for (c, column) in self.values[4 * group..4 * group + 4].iter_mut().enumerate() {
                    column[4 * block..4 * block + 4].copy_from_slice(&rows.map(|row| row[c] + 0.0));
                }
            }
        }
    }

    widest! {
        /// Computes all columns, and writes those that are shown to `out`.
        pub(super) fn fill(&mut self, block: &Block, out: &mut Trajectory) = fill_by_any, fill_by_avx2;
    }

    #[inline(always)]
    fn fill_by_any(&mut self, block: &Block, out: &mut Trajectory) {
        self.turn(block.written);
        self.ways(block);
        self.forces(block);
        let shown = block.mechanism.columns.iter().filter(|heading| is_shown(heading, self.detail));
        for (heading, column) in shown.zip(&mut out.columns) {
            let values = &mut column.values;
            if values.len() != block.count {
                values.resize(block.count, 0.0);
            }
            if heading.shown == Shown::Time {
                block.grid.times(block.first, values);
                continue;
            }
            let (written, rest) = values.split_at_mut(block.written);
            self.show(block, heading, written);
            rest.fill(written.last().copied().unwrap_or(0.0));
        }
    }

    /// Lengths of the springs, and positions of the bodies.
    #[inline(always)]
    fn ways(&mut self, block: &Block) {
        let (places, rows) = (&self.places, 0..block.written);
        for (spring, sum) in self.stretches.iter().enumerate() {
            let (from, to) = self.values.split_at_mut(places.stretch(spring));
            sum.put(from, rows.clone(), &mut to[0][rows.clone()]);
        }
        for body in 0..places.bodies {
            let (from, to) = self.values.split_at_mut(places.way(body));
            to[0][rows.clone()].copy_from_slice(&from[places.coordinate(body)][rows.clone()]);
        }
        for replaced in &self.places.layout.replaced {
            let (before, own) = self.values[places.way(0)..].split_at_mut(replaced.body);
            let (own, behind) = own.split_first_mut().expect("a body's own column");
            let way = |body: usize| -> &Values {
                if body < replaced.body { &before[body] } else { &behind[body - replaced.body - 1] }
            };
            for (rows, segment) in block.segments() {
                segment.coordinates.place(replaced, &mut own[rows.clone()], |body| &way(body)[rows.clone()]);
            }
        }
        let origin = block.segments.first().map_or([0.0; _], |segment| *Coordinates::origin(&segment.coordinates));
        for (body, origin) in origin.into_iter().enumerate().take(places.bodies).filter(|(_, origin)| *origin != 0.0) {
            self.values[places.way(body)][rows.clone()].iter_mut().for_each(|way| *way += origin);
        }
    }

    /// Forces of springs and currents of drives.
    #[inline(always)]
    fn forces(&mut self, block: &Block) {
        for spring in 0..self.places.springs {
            let (from, to) = self.values.split_at_mut(self.places.force(spring));
            for (rows, elements) in block.elements() {
                elements.force[spring].put(from, rows.clone(), &mut to[0][rows]);
            }
            to[0].iter_mut().zip(block.extra).for_each(|(force, extra)| *force += extra.force[spring]);
        }
        for (index, drive) in block.mechanism.drives.iter().enumerate() {
            let (from, to) = self.values.split_at_mut(self.places.current(index));
            for (rows, elements) in block.elements() {
                elements.current[index].put(from, rows.clone(), &mut to[0][rows]);
            }
            clamp(&mut to[0][..block.written], drive.amplifier.current_limit);
        }
    }

    /// The values of a heading. −0 + 0 is 0.
    #[inline(always)]
    fn show(&self, block: &Block, heading: &Heading, out: &mut [f64]) {
        let places = &self.places;
        let column = |place: usize| &self.values[place][..block.written];
        let times = |out: &mut [f64], place: usize, factor: f64| {
            out.iter_mut().zip(column(place)).for_each(|(out, value)| *out = value * factor + 0.0);
        };
        match heading.shown {
            // In repeated rows, only time changes.
            Shown::Time => {}
            Shown::Input(drive) => out.copy_from_slice(column(places.input(drive))),
            Shown::Voltage(drive) => {
                for (rows, elements) in block.elements() {
                    elements.voltage[drive].put(&self.values, rows.clone(), &mut out[rows]);
                }
                // A limited value does not exceed its limit by a bit.
                clamp(out, block.mechanism.drives[drive].amplifier.voltage_limit);
            }
            Shown::Current(drive) => out.copy_from_slice(column(places.current(drive))),
            Shown::SecondPhase(drive) => {
                let place = places.layout.current[block.mechanism.first_current(drive) + 1];
                out.copy_from_slice(column(place.unwrap_or(places.current(drive))));
            }
            Shown::Position(body, factor) => times(out, places.way(body), factor),
            Shown::Speed(body, factor) => times(out, places.speed(body), factor),
            Shown::Stretch(spring) => out.copy_from_slice(column(places.stretch(spring))),
            Shown::Force(spring, factor) => {
                out.iter_mut().zip(column(places.force(spring))).for_each(|(out, force)| *out = force * factor);
            }
            Shown::Friction(body) => self.friction(block, body, out),
            Shown::Motion(body) => {
                for (rows, segment) in block.segments() {
                    out[rows].fill(f64::from(block.sheets.sheets[segment.sheet].mode.motion[body].code()));
                }
            }
            Shown::Contact(spring) => {
                block.elements().for_each(|(rows, elements)| out[rows].fill(elements.contact[spring]));
            }
            Shown::Counts(body, counts) => {
                let way = column(places.way(body));
                out.iter_mut().zip(way).for_each(|(out, way)| *out = (way * counts).round() + 0.0);
            }
            Shown::Bristle(body) => {
                let extra = |j: usize| block.extra.get(j).map_or(0.0, |extra| extra.bristle[body]);
                out.iter_mut().enumerate().for_each(|(j, out)| *out = extra(j));
            }
        }
    }

    /// Friction on a body: by its law while it slides, the holding force while it is stuck.
    #[inline(always)]
    fn friction(&self, block: &Block, body: usize, out: &mut [f64]) {
        for (rows, segment) in block.segments() {
            match &block.sheets.sheets[segment.sheet].friction[body] {
                Held::Form(sum) => {
                    sum.put(&self.values, rows.clone(), &mut out[rows.clone()]);
                    out[rows].iter_mut().for_each(|value| *value += 0.0);
                }
                Held::Between => {
                    for j in rows {
                        let (least, most) = self.load(block.mechanism, body, j);
                        out[j] = least.max(0.0) + most.min(0.0) + 0.0;
                    }
                }
            }
        }
        out.iter_mut().zip(block.extra).for_each(|(value, extra)| *value += extra.friction[body]);
    }

    /// The least and the largest load without friction on a body at rest in a row.
    fn load(&self, mechanism: &Mechanism, leader: usize, row: usize) -> (f64, f64) {
        let mut load = (0.0, 0.0);
        for body in mechanism.followers(leader) {
            let ratio = mechanism.ratio(body);
            for (index, drive) in mechanism.drives.iter().enumerate().filter(|(_, drive)| drive.shaft == body) {
                let current = self.values[self.places.current(index)][row];
                let torque = drive.motor.gear_ratio * drive.motor.torque_constant * current;
                let (least, most) = match drive.has_rotor() {
                    true => (torque, torque),
                    false => mechanism.holding_torque(index, current),
                };
                load = (load.0 + ratio * least, load.1 + ratio * most);
            }
            for (spring, part) in mechanism.springs.iter().enumerate().rev() {
                let force = self.values[self.places.force(spring)][row];
                for &(_, arm) in part.arms.iter().filter(|(other, _)| *other == body) {
                    load = (load.0 - ratio * arm * force, load.1 - ratio * arm * force);
                }
            }
            let constant = ratio * mechanism.bodies[body].force;
            load = (load.0 + constant, load.1 + constant);
        }
        load
    }
}

impl Block<'_> {
    /// The rows of each segment.
    #[inline(always)]
    fn segments(&self) -> impl Iterator<Item = (Range<usize>, &Segment)> {
        rows_of(self.segments, self.written)
    }

    #[inline(always)]
    fn elements(&self) -> impl Iterator<Item = (Range<usize>, &Elements)> {
        self.stretches.iter().map(|(rows, elements)| (rows.clone(), &self.sheets.elements[*elements]))
    }
}

/// The rows of each segment; `written` is the total number.
#[inline(always)]
fn rows_of(segments: &[Segment], written: usize) -> impl Iterator<Item = (Range<usize>, &Segment)> {
    let ends = segments.iter().skip(1).map(move |segment| segment.start.min(written)).chain([written]);
    segments.iter().zip(ends).map(|(segment, end)| (segment.start.min(end)..end, segment))
}

/// Consecutive rows with the same case of amplifiers, gears, belt and stops.
pub(super) fn stretches(segments: &[Segment], sheets: &Sheets, written: usize) -> Vec<Stretch> {
    let mut stretches: Vec<Stretch> = Vec::new();
    for (rows, segment) in rows_of(segments, written) {
        let own = sheets.sheets[segment.sheet].elements;
        match stretches.last_mut() {
            Some((before, elements)) if *elements == own => before.end = rows.end,
            _ => stretches.push((rows, own)),
        }
    }
    stretches
}

/// True if a column is output.
pub(super) fn is_shown(heading: &Heading, detail: Detail) -> bool {
    detail == Detail::Full || heading.lean
}

#[inline(always)]
fn clamp(column: &mut [f64], limit: Option<f64>) {
    if let Some(limit) = limit {
        column.iter_mut().for_each(|value| *value = value.clamp(-limit, limit));
    }
}
