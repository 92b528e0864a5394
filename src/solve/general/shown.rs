//! The view of an observer on a run: each step of the formula as the polynomial that it is.

use super::Core;
use super::fall::{NODES, through};
use super::model::{Field, Model, Vector};
use super::run::Rows;
use crate::mechanism::{DRIVES, Mechanism, Mode, Shown as Quantity};
use crate::solve::machine::Engine;
use crate::solve::observe::{Curve, Gap, QUANTITIES, Reading, Readout};

/// The readings in a mode, for the mode that was entered last.
pub(super) struct Shown {
    mode: Mode,
    readout: Readout,
}

impl Shown {
    fn of<'s>(known: &'s mut Option<Self>, mechanism: &Mechanism, mode: &Mode) -> &'s Readout {
        let fits = known.as_ref().is_some_and(|known| known.mode == *mode);
        if !fits {
            *known = None;
        }
        &known.get_or_insert_with(|| Self { mode: *mode, readout: Readout::new(mechanism, mode) }).readout
    }
}

impl Rows<'_> {
    /// Shows the step from `from` to `until`.
    pub(super) fn show(
        &mut self,
        core: &Core,
        field: &Field,
        (from, until): (f64, f64),
        begin: &Vector,
        at: &dyn Fn(f64) -> Vector,
    ) {
        if self.recorder.observer.is_none() {
            return;
        }
        let (model, mode) = (&*core.model, &core.mode);
        let readout = Shown::of(&mut self.shown, &model.mechanism, mode);
        let mut nodes = [[0.0; QUANTITIES]; NODES];
        for (node, values) in nodes.iter_mut().enumerate() {
            let tau = from + (until - from) * node as f64 / (NODES - 1) as f64;
            let y = if node == 0 { *begin } else { at(tau) };
            *values = read(readout, model, mode, &y, &field.input(tau));
        }
        let (begin, length) = (field.stretch.begin + from, until - from);
        let bow = [f64::INFINITY; QUANTITIES];
        let gap = Gap { begin, length, from: &nodes[0], to: &nodes[NODES - 1], bow: &bow, mode };
        let Some(observer) = &mut self.recorder.observer else { return };
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

    /// The run has ended.
    pub(super) fn end_shown(&mut self, core: &Core) {
        let (model, mode) = (&*core.model, &core.mode);
        let (state, time) = (core.state(), core.time());
        let Some(observer) = &mut self.recorder.observer else { return };
        let readout = Shown::of(&mut self.shown, &model.mechanism, mode);
        let now = read(readout, model, mode, &core.y, &core.input());
        let bow = [0.0; QUANTITIES];
        observer.pass(&Gap { begin: time, length: 0.0, from: &now, to: &now, bow: &bow, mode });
        observer.end(time, &state, mode);
    }
}

/// The readings, with the additions of springs that follow the bodies.
fn read(readout: &Readout, model: &Model, mode: &Mode, y: &Vector, input: &[f64; DRIVES]) -> Reading {
    let inner = model.inner(y);
    let mechanism = &model.mechanism;
    let mut values = readout.read(&model.layout, &inner, &mechanism.origin, input);
    if model.adds {
        let extra = model.extra(mode, y);
        for (value, shown) in values.iter_mut().zip(&mechanism.readings) {
            if let Quantity::Force(spring, factor) = *shown {
                *value += factor * extra.force[spring];
            }
        }
    }
    values
}
