//! A run of the general solver: a machine, and a recorder of its rows.

use super::rows::Rows;
use super::stretch::Stretch;
use super::{Core, StepAdvance, Witness};
use crate::mechanism::{Layout, Mechanism, State};
use crate::solve::engine::Engine;
use crate::solve::inputs::Pieces;
use crate::solve::observe::Output;
use crate::solve::record::{Recorder, STATE};
use crate::solve::running::{Running, Start};
use crate::solve::{Detail, Ending, Flow, Grid, Outcome};

/// A run in progress.
pub(in crate::solve) struct GeneralRun<'a> {
    core: Core,
    rows: Rows<'a>,
}

impl<'a> GeneralRun<'a> {
    /// A run that begins in `start`; `fastest` is the machine's fastest rate, 1/s.
    pub(in crate::solve) fn new(
        mechanism: &Mechanism,
        start: &Start,
        (tolerance, fastest): (f64, f64),
        output: Output<'a>,
    ) -> Self {
        let grid = Grid::new(start.every, start.until);
        let (layout, steps) = (Layout::new(mechanism), (grid.interval(), grid.end()));
        let mut core = Core::new(mechanism, layout, &start.state, (tolerance, fastest), steps);
        core.noise.size = start.noise;
        let layout = &core.model.layout;
        let input = |drive| layout.states + drive;
        let recorder = Recorder::new(&core.model.mechanism, layout, (STATE, &input), grid, output);
        Self { core, rows: Rows { grid, recorder, shown: None } }
    }

    /// Ends the run if the receiver stops.
    fn heed(&mut self) {
        if self.rows.recorder.flow == Flow::Stop && self.core.rules.trouble.is_none() {
            self.core.rules.trouble = Some(Ending::Interrupted { time: self.core.time() });
        }
    }
}

impl Running for GeneralRun<'_> {
    fn set_input(&mut self, pieces: &Pieces) {
        self.core.take_up(Stretch::new(*pieces, self.rows.grid.end()));
    }

    fn told(&self, pieces: Pieces) -> Pieces {
        pieces.applied(&self.core.model.mechanism, self.rows.grid.end())
    }

    fn advance(&mut self, until: f64) -> bool {
        if self.core.rules.trouble.is_none() {
            let whole = self.core.stretch.end;
            self.core.stretch.end = until.min(whole);
            self.core.reach(&mut self.rows);
            self.core.stretch.end = whole;
        }
        self.heed();
        self.core.rules.trouble.is_none()
    }

    fn state(&self) -> State {
        self.core.state()
    }

    fn current(&self, drive: usize) -> f64 {
        self.core.value(&self.core.model.mechanism.current(drive, &self.core.rules.mode))
    }

    fn finish(&mut self, is_at_end: bool) -> Outcome {
        if self.core.rules.trouble.is_none() && !is_at_end {
            self.core.rules.trouble = Some(Ending::Interrupted { time: self.core.time() });
        }
        if self.core.rules.trouble.is_none() {
            let core = &self.core;
            self.rows.put_out(core, &core.input(), &core.y);
            self.heed();
        }
        self.rows.end_shown(&self.core);
        self.rows.recorder.finish();
        let core = &mut self.core;
        core.cost.samples = self.rows.recorder.rows;
        let ending = match (core.rules.trouble, self.rows.recorder.flow) {
            (Some(trouble), _) => trouble,
            (None, Flow::Stop) => Ending::Interrupted { time: core.time() },
            (None, Flow::Continue) => Ending::Complete,
        };
        let events = std::mem::take(&mut core.rules.events);
        Outcome { events, ties: Vec::new(), ending, cost: core.cost, error: None, unmet: core.unmet }
    }
}

impl Witness for Rows<'_> {
    fn see(&mut self, core: &mut Core, way: &StepAdvance) {
        self.show(core, way);
        // A row on an edge or an event shows what comes after it.
        let stretch = way.stretch;
        let near = (8.0 * f64::EPSILON * stretch.end).min(1e-9 * self.grid.interval());
        let grid = self.grid;
        let is_within = |row: u64| {
            let tau = grid.time(row) - stretch.begin;
            (row <= grid.intervals() && tau < way.until - near).then_some(tau)
        };
        while let Some(tau) = is_within(self.recorder.next_row()) {
            let y = if tau <= way.from + near { *way.begin } else { (way.dense)(tau) };
            self.put_out(core, &stretch.input(tau), &y);
            if way.rests {
                // One row, again and again.
                let row = self.recorder.next_row();
                let more = (row..).take_while(|row| is_within(*row).is_some()).count() as u64;
                match self.recorder.detail {
                    Detail::None => self.recorder.skip(more),
                    Detail::Full | Detail::Lean => _ = self.recorder.repeat(more),
                }
                break;
            }
        }
        if self.recorder.flow == Flow::Stop && core.rules.trouble.is_none() {
            core.rules.trouble = Some(Ending::Interrupted { time: stretch.begin + way.to });
        }
    }

    fn ask(&mut self) -> bool {
        self.recorder.ask();
        self.recorder.flow == Flow::Continue
    }
}
