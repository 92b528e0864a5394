//! A run: a machine, and a recorder of its rows.

use super::matrices::can_grow;
use super::shown::{ROWS, Watching};
use super::{Core, ModeMatrices, Space};
use crate::mechanism::{Mechanism, SpringLaw, State};
use crate::solve::inputs::Pieces;
use crate::solve::known::Known;
use crate::solve::observe::Output;
use crate::solve::record::Recorder;
use crate::solve::running::{Running, Start};
use crate::solve::{Detail, Ending, Flow, Grid, Outcome};
use std::sync::Arc;

/// A run in progress.
pub(in crate::solve) struct ExactRun<'a, const N: usize> {
    pub(super) core: Core<N>,
    grid: Grid,
    /// The present row, or the last one passed.
    row: u64,
    pub(super) recorder: Recorder<'a>,
    pub(super) watching: Watching<N>,
    known: Known,
}

impl<'a, const N: usize> ExactRun<'a, N> {
    /// A run that begins in `start`.
    pub(in crate::solve) fn new(
        mechanism: &Arc<Mechanism>,
        space: Space,
        start: &Start,
        mut known: Known,
        output: Output<'a>,
    ) -> Self {
        let grid = Grid::new(start.every, start.until);
        let seen = mechanism.seen_by(&space.layout, &start.state);
        let list = std::mem::take(known.list::<Arc<ModeMatrices<N>>>());
        let inputs = |drive| space.chain(drive, 0);
        let recorder = Recorder::new(&seen, &space.layout, (N, &inputs), grid, output);
        let mut core = Core::new(seen, Arc::new(space), &start.state, (grid.interval(), grid.end()), list);
        // A run without rows needs no error bound, only a check that it is determined, which only a force line that
        // feeds the motion can prevent.
        let feeds = |law: &SpringLaw| matches!(law, SpringLaw::Line { .. });
        if recorder.detail == Detail::None && !core.common.mechanism.springs.iter().any(|spring| feeds(&spring.law)) {
            core.errors = None;
        }
        let watching = Watching::new(recorder.observer.as_deref());
        Self { core, grid, row: 0, recorder, watching, known }
    }

    /// Advances to `offset` behind row `row`, event by event.
    fn reach(&mut self, row: u64, offset: f64) {
        while (self.row < row || (self.row == row && self.core.common.offset < offset)) && self.goes() {
            self.core.check();
            let mut looked = false;
            if self.core.common.offset == 0.0 {
                self.put_out();
                if self.row < row && self.goes() {
                    if self.take_safe_intervals(row - self.row) {
                        continue;
                    }
                    looked = true;
                }
            }
            let ahead = if self.row < row { self.grid.interval() } else { offset };
            match self.advance_shown(ahead - self.core.common.offset, looked) {
                Some(fallen) => {
                    self.core.go_through(fallen);
                    self.jumped();
                }
                // Paused within an interval: it continues there.
                None if self.core.common.asks => self.ask_receiver(),
                None if !self.goes() => {}
                None if self.row < row => self.go_to(self.row + 1),
                None => self.core.common.offset = offset,
            }
        }
    }

    fn go_to(&mut self, row: u64) {
        self.row = row;
        self.core.count_from(self.grid.time(row));
    }

    /// Asks the receiver to continue.
    fn ask_receiver(&mut self) {
        self.core.common.asks = false;
        self.recorder.ask();
        self.heed();
    }

    fn goes(&self) -> bool {
        self.core.common.rules.trouble.is_none()
    }

    /// Ends the run if the receiver stops.
    #[inline]
    fn heed(&mut self) {
        if self.recorder.flow == Flow::Stop && self.core.common.rules.trouble.is_none() {
            self.core.common.rules.trouble = Some(Ending::Interrupted { time: self.time() });
        }
    }

    fn time(&self) -> f64 {
        self.grid.time(self.row) + self.core.common.offset
    }

    /// Outputs the present row, once, and checks the state.
    fn put_out(&mut self) {
        if !self.core.is_finite() {
            self.core.common.rules.trouble = Some(Ending::Diverged { time: self.time() });
        }
        if self.recorder.next_row() == self.row && self.core.common.rules.trouble.is_none() {
            let core = &mut self.core;
            core.see();
            self.recorder.segment(core.common.taken, &core.common.coordinates, &core.common.rules.mode);
            self.recorder.push(&core.z);
        }
        self.heed();
    }

    /// Advances by the number of complete intervals, up to `most`, on which no guard can become negative; false if
    /// there is none.
    fn take_safe_intervals(&mut self, most: u64) -> bool {
        let law = Arc::clone(&self.core.matrices);
        let (safe, resting) = self.core.safe_intervals(&law, most);
        if safe == 0 {
            return false;
        }
        let h = self.grid.interval();
        if resting && self.is_observed() {
            let (begin, z) = (self.core.time(), self.core.z);
            self.show_way(&law, z, &[z], (begin, safe as f64 * h));
        }
        self.core.common.rules.since_change += safe as f64 * h;
        if resting && self.recorder.detail == Detail::None {
            self.recorder.skip(safe - 1);
            self.go_to(self.row + safe);
            return true;
        }
        if resting {
            // The same row repeatedly.
            self.row += self.recorder.repeat(safe - 1);
            self.heed();
            if self.goes() {
                self.row += 1;
            }
            self.go_to(self.row);
            return true;
        }
        self.take_rows(&law, safe);
        self.go_to(self.row);
        true
    }

    /// Advances by `intervals`, shows the motion, and outputs all rows but the last.
    fn take_rows(&mut self, law: &Arc<ModeMatrices<N>>, intervals: u64) {
        let (step, observed) = (law.step(0), self.is_observed());
        let most = if observed { ROWS } else { usize::MAX };
        let (mut left, h) = (intervals, self.grid.interval());
        while left > 0 {
            // The hold of a controller is often a single interval.
            let (mut one, mut several) = ([[0.0; N]], None);
            let room = match self.recorder.detail {
                Detail::None if left == 1 => &mut one[..],
                Detail::None => &mut several.insert([[0.0; N]; ROWS])[..],
                _ => self.recorder.room(),
            };
            let rows = left.min(room.len().min(most) as u64) as usize;
            let core = &mut self.core;
            let (begin, largest) = (core.z, core.largest);
            step.advance_rows(&mut core.z, &mut core.largest, &mut room[..rows]);
            if !core.is_finite() {
                // The last finite row.
                let good = room.iter().take_while(|row| row.iter().sum::<f64>().is_finite()).count();
                (core.z, core.largest) = (begin, largest);
                step.advance_rows(&mut core.z, &mut core.largest, &mut room[..good]);
                self.passed(good, good);
                step.advance(&mut self.core.z);
                self.row += 1;
                self.core.common.rules.trouble = Some(Ending::Diverged { time: self.grid.time(self.row) });
                return;
            }
            left -= rows as u64;
            if observed {
                let common = &self.core.common;
                let shown = law.shown(&common.mechanism, &common.space);
                self.watching.read(shown, common.coordinates.origin(), &begin, &room[..rows]);
                let first = room[0];
                self.show_stretch(law, [begin, first], (self.grid.time(self.row), h));
            }
            if !self.passed(rows, if left > 0 { rows } else { rows - 1 }) {
                return;
            }
        }
    }

    /// Advances by `rows`, and outputs the first `put` of them; false if the receiver stops.
    fn passed(&mut self, rows: usize, put: usize) -> bool {
        self.row += rows as u64;
        self.core.common.cost.steps += rows as u64;
        match self.recorder.detail {
            Detail::None => self.recorder.skip(put as u64),
            _ => self.recorder.take(put),
        }
        self.core.count_from(self.grid.time(self.row));
        self.heed();
        self.goes()
    }
}

impl<const N: usize> Running for ExactRun<'_, N> {
    fn set_input(&mut self, pieces: &Pieces) {
        self.core.note_ties();
        self.core.set_input(pieces);
        self.core.resolve();
        self.core.note_ties();
        self.jumped();
    }

    fn advance(&mut self, until: f64) -> bool {
        let end = self.grid.end();
        if self.core.common.rules.trouble.is_none() {
            let (row, offset) = locate(&self.grid, self.row, until.min(end));
            self.reach(row, offset);
        }
        self.core.common.rules.trouble.is_none()
    }

    fn state(&self) -> State {
        self.core.state()
    }

    fn current(&self, drive: usize) -> f64 {
        let common = &self.core.common;
        self.core.matrices.current(&common.mechanism, &common.space, drive).value(&self.core.z)
    }

    fn finish(&mut self, is_at_end: bool) -> Outcome {
        self.core.note_ties();
        if self.core.common.rules.trouble.is_none() {
            if is_at_end {
                // After a last, shorter interval the run is at the last row, too.
                self.go_to(self.grid.intervals());
                self.put_out();
            } else {
                self.core.common.rules.trouble = Some(Ending::Interrupted { time: self.time() });
            }
        }
        self.end_shown();
        self.recorder.finish();
        self.core.common.cost.samples = self.recorder.rows;
        let ending = match (self.core.common.rules.trouble, self.recorder.flow) {
            (Some(trouble), _) => trouble,
            (None, Flow::Stop) => Ending::Interrupted { time: self.core.time() },
            (None, Flow::Continue) => Ending::Complete,
        };
        let core = &mut self.core;
        core.common.cost.propagators = super::propagators(&core.known) - core.shared;
        let is_followed = core.errors.is_some() || !can_grow(&core.common.mechanism);
        let error = is_followed.then(|| core.bound_of_rounding());
        Outcome {
            events: std::mem::take(&mut core.common.rules.events),
            ties: std::mem::take(&mut core.common.rules.ties),
            ending,
            cost: std::mem::take(&mut core.common.cost),
            error,
            unmet: 0,
        }
    }

    fn known(&mut self) -> Known {
        *self.known.list() = std::mem::take(&mut self.core.known);
        std::mem::take(&mut self.known)
    }
}

/// The row of `grid` at or before `time`, from row `now` on, and the offset from it; an offset within rounding is zero.
pub(super) fn locate(grid: &Grid, now: u64, time: f64) -> (u64, f64) {
    let (last, h) = (grid.even(), grid.interval());
    // The next row, as for samples that coincide with rows.
    if now < last && grid.time(now + 1) == time {
        return (now + 1, 0.0);
    }
    // Correct except for rounding.
    let mut row = ((time / h) as u64).min(last);
    if row > 0 && grid.time(row) > time {
        row -= 1;
    } else if row < last && grid.time(row + 1) <= time {
        row += 1;
    }
    let offset = time - grid.time(row);
    // Rounding of a sum of decimal times; not a fraction of the interval, which may be long.
    let near = (8.0 * f64::EPSILON * time).min(1e-9 * h);
    // The last interval may be shorter: the rest of the run after the last complete one.
    let length = if row < last { h } else { grid.rest() };
    match (row < last, length - offset <= near) {
        _ if offset <= near => (row, 0.0),
        (true, true) => (row + 1, 0.0),
        (false, true) => (row, length),
        (_, false) => {
            // Halves, quarters and eighths of the interval, which have matrices, are met to the last bit.
            let eighth = 0.125 * h;
            let snapped = (offset / eighth).round() * eighth;
            (row, if (offset - snapped).abs() <= near { snapped } else { offset })
        }
    }
}
