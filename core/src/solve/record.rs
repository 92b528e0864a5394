//! Conversion of states to output columns, block by block.

mod columns;
mod sheet;
mod sum;

use super::coordinates::Coordinates;
use super::observe::{Observe, Output};
use super::{Detail, Flow, Grid};
use crate::mechanism::{BODIES, DRIVES, Heading, Layout, Mechanism, Mode, SPRINGS, State};
use crate::trajectory::{Column, Trajectory};
use columns::{Block, Columns};
use sheet::Sheets;
use std::sync::Arc;

/// Rows passed on at a time; small enough to stay in the processor's cache.
const BLOCK: usize = 256;

/// Size of a state followed by the inputs, for any mechanism; a multiple of four.
pub(crate) const STATE: usize = (2 * BODIES + 2 * DRIVES).next_multiple_of(4);

/// The values of a row that do not follow from its state by the linear equations.
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
    /// Index of the first row in the block.
    start: usize,
    /// Index of its sheet.
    sheet: usize,
    /// The coordinates from which angles follow.
    coordinates: Coordinates,
}

/// Collects rows of states and passes them on as blocks of columns.
pub(crate) struct Recorder<'a> {
    mechanism: Arc<Mechanism>,
    layout: Layout,
    grid: Grid,
    pub(crate) detail: Detail,
    columns: Columns,
    /// Indices of the inputs in a row.
    inputs: [usize; DRIVES],
    /// Number of rows; those beyond the stored ones equal the last stored one.
    count: usize,
    written: usize,
    /// Index of the last row of the previous block.
    last: usize,
    segments: Vec<Segment>,
    /// Mode of the last segment.
    taken: Option<u64>,
    /// One for each row; empty if the linear equations determine everything.
    extra: Vec<Extra>,
    /// Extra values of the last row of the previous block.
    last_extra: Option<Extra>,
    sheets: Sheets,
    block: Trajectory,
    sink: &'a mut dyn FnMut(&Trajectory) -> Flow,
    /// Observer of the motion between rows.
    pub(crate) observer: Option<&'a mut dyn Observe>,
    /// Number of rows passed on.
    pub(crate) rows: u64,
    /// The last answer of the receiver.
    pub(crate) flow: Flow,
}

impl<'a> Recorder<'a> {
    /// Recorder of rows of `stride` numbers: states as in the layout, inputs from index `input`.
    pub(crate) fn new(
        mechanism: &Arc<Mechanism>,
        layout: &Layout,
        (stride, input): (usize, &dyn Fn(usize) -> usize),
        grid: Grid,
        Output { detail, sink, observer }: Output<'a>,
    ) -> Self {
        let mut inputs = [0; DRIVES];
        inputs.iter_mut().enumerate().take(layout.inputs).for_each(|(drive, place)| *place = input(drive));
        let shown = |heading: &&Heading| columns::is_shown(heading, detail);
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
            columns: Columns::new(mechanism, layout, (stride, inputs), detail),
            inputs,
            count: 0,
            written: 0,
            last: 0,
            segments: Vec::new(),
            taken: None,
            extra: Vec::new(),
            last_extra: None,
            sheets: Sheets::default(),
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

    /// Following rows are in this mode; `taken` identifies it.
    #[inline]
    pub(crate) fn segment(&mut self, taken: u64, coordinates: &Coordinates, mode: &Mode) {
        if self.detail != Detail::None && self.taken != Some(taken) {
            self.taken = Some(taken);
            let sheet = self.sheets.index(&self.mechanism, &self.columns.places, mode);
            self.segments.push(Segment { start: self.count, sheet, coordinates: coordinates.clone() });
        }
    }

    /// Adds the next row: a state in the solver's coordinates by the indices of the layout, with the inputs.
    #[inline]
    pub(crate) fn push<const N: usize>(&mut self, row: &[f64; N]) {
        if self.detail == Detail::None {
            self.rows += 1;
            return;
        }
        self.room::<N>()[0] = *row;
        self.take(1);
    }

    /// Buffer for rows up to the end of the block, at least one; [`Recorder::take`] accepts the rows written there.
    #[inline]
    pub(crate) fn room<const N: usize>(&mut self) -> &mut [[f64; N]] {
        if self.written != self.count {
            self.write_out();
        }
        self.columns.rows(self.count)
    }

    /// Takes `count` rows from the buffer.
    #[inline]
    pub(crate) fn take(&mut self, rows: usize) {
        self.count += rows;
        self.written = self.count;
        if self.count == BLOCK {
            self.hand_on();
        }
    }

    /// Outputs repetitions of the last row.
    #[cold]
    fn write_out(&mut self) {
        self.columns.repeat(self.written, self.count);
        self.written = self.count;
        if let Some(last) = self.extra.last().copied() {
            self.extra.resize(self.count, last);
        }
    }

    /// Repeats the last row `times` times, with increasing time, or until the receiver stops; returns the number of
    /// rows.
    pub(crate) fn repeat(&mut self, times: u64) -> u64 {
        let mut left = times;
        while left > 0 && self.flow == Flow::Continue {
            if self.count == 0 {
                // The last row has just been passed on, and its values are still stored.
                self.columns.begin_with(self.last);
                self.written = 1;
                self.extra.extend(self.last_extra);
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

    /// Adds the next row: a complete state, for a recorder of rows of [`STATE`] numbers.
    pub(crate) fn push_state(&mut self, inner: &State, input: &[f64; DRIVES], extra: Option<Extra>) {
        if self.detail != Detail::None {
            if self.written != self.count {
                self.write_out();
            }
            self.extra.extend(extra);
        }
        let mut row = [0.0; STATE];
        for body in 0..self.layout.bodies() {
            row[self.layout.coordinate[body]] = inner.position[body];
            row[self.layout.speed[body]] = inner.speed[body];
        }
        for (place, current) in self.layout.current.iter().zip(inner.current) {
            if let Some(place) = place {
                row[*place] = current;
            }
        }
        (0..self.layout.inputs).for_each(|drive| row[self.inputs[drive]] = input[drive]);
        self.push(&row);
    }

    /// Counts rows without output.
    pub(crate) fn skip(&mut self, rows: u64) {
        self.rows += rows;
    }

    /// Passes on the present rows, even none, and asks the receiver to continue.
    pub(crate) fn ask(&mut self) {
        if self.count > 0 {
            self.hand_on();
        } else if self.flow == Flow::Continue {
            self.block.columns.iter_mut().for_each(|column| column.values.clear());
            self.flow = (self.sink)(&self.block);
        }
    }

    /// Passes on the remaining rows.
    pub(crate) fn finish(&mut self) {
        if self.count > 0 {
            self.hand_on();
        }
    }

    fn hand_on(&mut self) {
        self.columns.fill(
            &Block {
                mechanism: &self.mechanism,
                sheets: &self.sheets,
                segments: &self.segments,
                stretches: &columns::stretches(&self.segments, &self.sheets, self.written),
                extra: &self.extra,
                written: self.written,
                count: self.count,
                grid: self.grid,
                first: self.rows,
            },
            &mut self.block,
        );
        self.rows += self.count as u64;
        if self.flow == Flow::Continue {
            self.flow = (self.sink)(&self.block);
        }
        self.last = self.written - 1;
        (self.count, self.written) = (0, 0);
        // The following rows are in the mode of the last segment.
        self.segments.drain(..self.segments.len().saturating_sub(1));
        self.segments.iter_mut().for_each(|segment| segment.start = 0);
        self.last_extra = self.extra.last().copied();
        self.extra.clear();
    }
}
