//! A run of the general solver: a machine, and a recorder of its rows.

use super::model::{Field, Vector};
use super::shown::Shown;
use super::stretch::Stretch;
use super::{Core, Witness};
use crate::mechanism::{Layout, Mechanism, State};
use crate::signal::Signal;
use crate::solve::inputs::Pieces;
use crate::solve::machine::Engine;
use crate::solve::observe::Output;
use crate::solve::record::{Recorder, STATE};
use crate::solve::run::{Running, Start};
use crate::solve::{Ending, Flow, Grid, Outcome};

/// A run under way.
pub(in crate::solve) struct Run<'a> {
    core: Core,
    rows: Rows<'a>,
    /// Whether an input has been taken up.
    has_input: bool,
}

/// Where the rows go, and what is shown.
pub(super) struct Rows<'a> {
    grid: Grid,
    pub(super) recorder: Recorder<'a>,
    pub(super) shown: Option<Shown>,
}

impl<'a> Run<'a> {
    /// A run that begins in `start`; `fastest` is the machine's fastest rate, 1/s.
    pub(in crate::solve) fn new(
        mechanism: &Mechanism,
        start: &Start,
        (tolerance, fastest): (f64, f64),
        output: Output<'a>,
    ) -> Self {
        let grid = Grid::new(start.every, start.until);
        let core = Core::new(mechanism, Layout::new(mechanism), &start.state, (tolerance, fastest, grid.end()));
        let layout = &core.model.layout;
        let input = |drive| layout.states + drive;
        let recorder = Recorder::new(&core.model.mechanism, layout, (STATE, &input), grid, output);
        Self { core, rows: Rows { grid, recorder, shown: None }, has_input: false }
    }

    fn take_up(&mut self, stretch: Stretch) {
        let continues = self.has_input && stretch.continues(&self.core.stretch);
        self.has_input = true;
        self.core.take_up(stretch, continues);
    }

    /// Notices that the receiver wants no more.
    fn heed(&mut self) {
        if self.rows.recorder.flow == Flow::Stop && self.core.trouble.is_none() {
            self.core.trouble = Some(Ending::Interrupted { time: self.core.time() });
        }
    }
}

impl Running for Run<'_> {
    fn set_input(&mut self, pieces: &Pieces) {
        self.take_up(Stretch::of(*pieces, self.rows.grid.end()));
    }

    fn set_signals(&mut self, signals: &[Signal], time: f64) -> f64 {
        self.take_up(Stretch::new(signals, time, self.rows.grid.end()));
        self.core.stretch.end
    }

    fn advance(&mut self, until: f64) -> bool {
        if self.core.trouble.is_none() {
            let whole = self.core.stretch.end;
            self.core.stretch.end = until.min(whole);
            self.core.reach(&mut self.rows);
            self.core.stretch.end = whole;
        }
        self.heed();
        self.core.trouble.is_none()
    }

    fn state(&self) -> State {
        self.core.state()
    }

    fn current(&self, drive: usize) -> f64 {
        self.core.value(&self.core.model.mechanism.current(drive, &self.core.mode))
    }

    fn finish(&mut self, is_at_end: bool) -> Outcome {
        if self.core.trouble.is_none() && !is_at_end {
            self.core.trouble = Some(Ending::Interrupted { time: self.core.time() });
        }
        if self.core.trouble.is_none() {
            let core = &self.core;
            let field = Field::new(&core.model, &core.mode, &core.stretch);
            let (tau, y) = (core.tau, core.y);
            self.rows.put_out(core, &field, tau, &y);
            self.heed();
        }
        self.rows.end_shown(&self.core);
        self.rows.recorder.finish();
        let core = &mut self.core;
        core.cost.samples = self.rows.recorder.rows;
        core.cost.modes = core.modes.len() as u64;
        let ending = match (core.trouble, self.rows.recorder.flow) {
            (Some(trouble), _) => trouble,
            (None, Flow::Stop) => Ending::Interrupted { time: core.time() },
            (None, Flow::Continue) => Ending::Complete,
        };
        Outcome { events: std::mem::take(&mut core.events), ending, cost: core.cost, error: None }
    }
}

impl Rows<'_> {
    /// Puts out the row that is at `tau`.
    fn put_out(&mut self, core: &Core, field: &Field, tau: f64, y: &Vector) {
        let model = &core.model;
        self.recorder.segment(core.taken, &core.coordinates, &core.mode);
        let extra = model.adds.then(|| model.extra(&core.mode, y));
        self.recorder.push_state(&model.inner(y), &field.input(tau), extra);
    }
}

impl Witness for Rows<'_> {
    fn see(
        &mut self,
        core: &mut Core,
        field: &Field,
        (from, until, to): (f64, f64, f64),
        begin: &Vector,
        at: &dyn Fn(f64) -> Vector,
    ) {
        self.show(core, field, (from, until), begin, at);
        // A row on an edge or an event shows what comes after it.
        let stretch = field.stretch;
        let near = (8.0 * f64::EPSILON * stretch.end).min(1e-9 * self.grid.interval());
        let until = if until >= stretch.length() { stretch.length() - near } else { until };
        loop {
            let row = self.recorder.next_row();
            let tau = self.grid.time(row) - stretch.begin;
            if row > self.grid.intervals() || tau >= until {
                break;
            }
            let y = if tau <= from { *begin } else { at(tau) };
            self.put_out(core, field, tau, &y);
        }
        if self.recorder.flow == Flow::Stop && core.trouble.is_none() {
            core.trouble = Some(Ending::Interrupted { time: stretch.begin + to });
        }
    }

    fn ask(&mut self) -> bool {
        self.recorder.ask();
        self.recorder.flow == Flow::Continue
    }
}
