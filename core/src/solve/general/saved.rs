//! The general solver's machine as plain numbers, and with other numbers of its mechanism.

use super::{Core, Field, Known, Model, Stretch};
use crate::mechanism::Mechanism;
use crate::solve::check;
use crate::solve::inputs::Pieces;
use crate::solve::rules::Between;
use crate::solve::saved::{Pass, Passed};
use std::sync::Arc;

impl Core {
    /// Passes the state as plain numbers. The caller ensures that another machine has the same equations.
    pub(super) fn pass(&mut self, pass: &mut Pass) -> Passed {
        if self.rules.trouble.is_some() {
            return None;
        }
        let start = *self.coordinates.start();
        pass.numbers(&mut self.y)?;
        self.coordinates.pass(pass)?;
        self.rules.pass(pass)?;
        let mut pieces = self.stretch.pieces();
        pass.pieces(&mut pieces)?;
        let mut end = self.stretch.end;
        pass.number(&mut end)?;
        self.stretch = Stretch::new(pieces, f64::INFINITY);
        self.stretch.end = end;
        pass.number(&mut self.tau)?;
        pass.numbers(&mut self.torque)?;
        pass.number(&mut self.end)?;
        pass.bits(&mut self.taken)?;
        pass.number(&mut self.step)?;
        self.make_ready();
        (*self.coordinates.start() == start).then_some(())
    }

    /// Continues with other parameters of the same mechanism.
    pub(super) fn replace(&mut self, mechanism: &Mechanism) {
        let model = Arc::clone(&self.model);
        let seen = mechanism.seen_from(&model.layout, self.coordinates.start());
        seen.take_over(&model.mechanism, &mut self.rules.mode, |body| self.y[model.speed(body)]);
        (self.moment, self.step) = (1.0 / check::fastest_rate(&seen), f64::INFINITY);
        self.model = Arc::new(Model::new(Arc::new(seen), model.layout.clone()));
        let field = Arc::new(Field::new(&self.model, &self.rules.mode));
        (self.known, self.present) = (vec![Known { field, sets: Vec::new() }], 0);
        self.take_up_mode();
    }

    /// Its inputs held from `time` on.
    pub(super) fn hold_inputs(&mut self, inputs: &[f64], time: f64) {
        let passed = f64::max(time - self.time(), 0.0);
        self.rules.since_change += passed;
        (self.stretch, self.tau) = (Stretch::new(Pieces::held(inputs, time, f64::INFINITY), f64::INFINITY), 0.0);
    }
}
