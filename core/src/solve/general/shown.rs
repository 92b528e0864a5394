//! The view of an observer on a run: each step as a polynomial.

use super::model::{Model, Vector};
use super::radau::inverse;
use super::rows::{Rows, Shown};
use super::{Core, StepAdvance};
use crate::mechanism::{DRIVES, Mode, Shown as Quantity};
use crate::solve::engine::Engine;
use crate::solve::observe::{Curve, FEW, Gap, QUANTITIES, Reading, Readout};
use crate::solve::polynomial::TERMS;

/// Places within a step at which it is shown, its ends among them: as many as a curve has terms.
const PLACES: usize = TERMS;

/// Most parts of a step that are shown one by one: steps are as long as four radians.
const MOST_PARTS: f64 = 4.0;

/// From values at k/7 to the coefficients of the polynomial through them.
const COEFFICIENTS: [[f64; PLACES]; PLACES] = {
    let mut places = [0.0; PLACES];
    let mut k = 0;
    while k < PLACES {
        places[k] = k as f64 / (PLACES - 1) as f64;
        k += 1;
    }
    inverse(places)
};

/// The polynomial through values at k/7, made from their differences from the first one: the table's rounding, 1e-11 of
/// what it is applied to, must not bend what is constant.
fn through(values: &[f64; PLACES]) -> [f64; PLACES] {
    let begin = values[0];
    let mut terms = COEFFICIENTS.map(|row| row.iter().zip(values).fold(0.0, |sum, (c, v)| sum + c * (v - begin)));
    terms[0] = begin;
    terms
}

impl Rows<'_> {
    /// Shows a step.
    pub(super) fn show(&mut self, core: &Core, way: &StepAdvance) {
        if self.recorder.observer.is_none() {
            return;
        }
        let (model, mode) = (&*core.model, &core.rules.mode);
        let readout = Shown::readout(&mut self.shown, &model.mechanism, mode);
        // A polynomial of degree seven follows what swings by a radian to 1e-9 of itself.
        let parts = ((way.until - way.from) / core.moment).ceil().clamp(1.0, MOST_PARTS);
        let place = |part: f64| way.from + (way.until - way.from) * (part / parts);
        for part in 0..parts as usize {
            let (from, until) = (place(part as f64), place((part + 1) as f64));
            let mut nodes = [[0.0; QUANTITIES]; PLACES];
            for (node, values) in nodes.iter_mut().enumerate() {
                let tau = from + (until - from) * node as f64 / (PLACES - 1) as f64;
                let y = if part == 0 && node == 0 { *way.begin } else { (way.dense)(tau) };
                *values = read(readout, model, mode, &y, &way.stretch.input(tau));
            }
            let (begin, length) = (way.stretch.begin + from, until - from);
            let (bow, few) = (readout.unknown_bow(), readout.few);
            let gap = Gap { begin, length, from: &nodes[0], to: &nodes[PLACES - 1], bow: &bow, mode, few };
            let Some(observer) = &mut self.recorder.observer else { return };
            if observer.pass(&gap) && length > 0.0 {
                let mut terms = [[0.0; QUANTITIES]; PLACES];
                for q in 0..if few { FEW } else { QUANTITIES } {
                    for (term, value) in terms.iter_mut().zip(through(&nodes.map(|node| node[q]))) {
                        term[q] = value;
                    }
                }
                observer.see(&Curve { begin, length, terms, few });
            }
        }
    }

    /// The run has ended.
    pub(super) fn end_shown(&mut self, core: &Core) {
        let (model, mode) = (&*core.model, &core.rules.mode);
        let (state, time) = (core.state(), core.time());
        let Some(observer) = &mut self.recorder.observer else { return };
        let readout = Shown::readout(&mut self.shown, &model.mechanism, mode);
        let now = read(readout, model, mode, &core.y, &core.input());
        let (bow, few) = ([0.0; QUANTITIES], readout.few);
        observer.pass(&Gap { begin: time, length: 0.0, from: &now, to: &now, bow: &bow, mode, few });
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
