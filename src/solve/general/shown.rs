//! What an observer is shown of a run: each step of the formula as the polynomial that it is.

use super::fall::{NODES, through};
use super::model::{Field, Model, Vector};
use super::stretch::Stretch;
use super::{Observer, Run};
use crate::plant::{Mode, Plant};
use crate::solve::observe::{Curve, Gap, QUANTITIES, Reading, Readout, reading};

/// What is read off in a mode, for the mode that was entered last.
pub(super) struct Shown {
    mode: Mode,
    readout: Readout,
}

impl Shown {
    fn of<'s>(known: &'s mut Option<Self>, plant: &Plant, mode: Mode) -> &'s Readout {
        let fits = known.as_ref().is_some_and(|known| known.mode == mode);
        if !fits {
            *known = None;
        }
        &known.get_or_insert_with(|| Self { mode, readout: Readout::new(plant, &mode) }).readout
    }
}

impl Observer<'_, '_> {
    /// Shows the step from `from` to `until`.
    pub(super) fn show(&mut self, from: f64, until: f64, begin: &Vector, at: &impl Fn(f64) -> Vector) {
        if self.run.recorder.observer.is_none() {
            return;
        }
        let (model, mode, field) = (self.run.model, self.run.mode, self.field);
        let readout = Shown::of(&mut self.run.shown, model.plant, mode);
        let mut nodes = [[0.0; QUANTITIES]; NODES];
        for (node, values) in nodes.iter_mut().enumerate() {
            let tau = from + (until - from) * node as f64 / (NODES - 1) as f64;
            let y = if node == 0 { *begin } else { at(tau) };
            *values = read(readout, model, &mode, &y, field.input(tau));
        }
        let (begin, length) = (field.stretch.begin + from, until - from);
        let bow = [f64::INFINITY; QUANTITIES];
        let gap = Gap { begin, length, from: &nodes[0], to: &nodes[NODES - 1], bow: &bow, mode: &mode };
        let Some(observer) = &mut self.run.recorder.observer else { return };
        if observer.pass(&gap) && length > 0.0 {
            let mut terms = [[0.0; QUANTITIES]; NODES];
            for q in 0..QUANTITIES {
                for (term, value) in terms.iter_mut().zip(through(&nodes.map(|node| node[q]))) {
                    term[q] = value;
                }
            }
            observer.see(&Curve { begin, length, terms });
        }
    }
}

impl Run<'_> {
    /// The run has ended.
    pub(super) fn end_shown(&mut self, stretch: &Stretch) {
        let (model, mode) = (self.model, self.mode);
        let state = self.coordinates.state(&model.inner(&self.y));
        let time = stretch.begin + self.tau;
        let Some(observer) = &mut self.recorder.observer else { return };
        let field = Field::new(model, mode, stretch);
        let now = read(Shown::of(&mut self.shown, model.plant, mode), model, &mode, &self.y, field.input(self.tau));
        let bow = [0.0; QUANTITIES];
        observer.pass(&Gap { begin: time, length: 0.0, from: &now, to: &now, bow: &bow, mode: &mode });
        observer.end(time, &state, &mode);
    }
}

/// What is read, with what a belt whose spans follow the cart adds.
fn read(readout: &Readout, model: &Model, mode: &Mode, y: &Vector, input: f64) -> Reading {
    let inner = model.inner(y);
    let span = model.extra(&mode.motion, &inner, y).0.span;
    let mut values = readout.read(&inner, model.origin, input);
    values[reading::FORCE] += span[0];
    values[reading::FORCE + 1] += span[1];
    values
}
