//! Output of the rows of a run, and of the motion between them.

use super::Core;
use super::model::Vector;
use crate::mechanism::{DRIVES, Mechanism, Mode};
use crate::solve::Grid;
use crate::solve::observe::Readout;
use crate::solve::record::Recorder;

/// Receiver of rows, and of the motion between them.
pub(super) struct Rows<'a> {
    pub(super) grid: Grid,
    pub(super) recorder: Recorder<'a>,
    pub(super) shown: Option<Shown>,
}

/// The readings in a mode, for the mode that was entered last.
pub(super) struct Shown {
    mode: Mode,
    readout: Readout,
}

impl Shown {
    pub(super) fn readout<'s>(known: &'s mut Option<Self>, mechanism: &Mechanism, mode: &Mode) -> &'s Readout {
        let fits = known.as_ref().is_some_and(|known| known.mode == *mode);
        if !fits {
            *known = None;
        }
        &known.get_or_insert_with(|| Self { mode: *mode, readout: Readout::new(mechanism, mode) }).readout
    }
}

impl Rows<'_> {
    /// Puts out a row.
    pub(super) fn put_out(&mut self, core: &Core, input: &[f64; DRIVES], y: &Vector) {
        let model = &core.model;
        self.recorder.segment(core.taken, &core.coordinates, &core.rules.mode);
        let extra = model.adds.then(|| model.extra(&core.rules.mode, y));
        self.recorder.push_state(&model.inner(y), input, extra);
    }
}
