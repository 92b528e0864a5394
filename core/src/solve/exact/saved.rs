//! Saved states of the exact solver, and a change of the mechanism's parameters.

use super::{Core, ModeMatrices};
use crate::mechanism::Mechanism;
use crate::solve::rules::Between;
use crate::solve::saved::{Pass, Passed};
use std::sync::Arc;

impl<const N: usize> Core<N> {
    /// Passes the state as plain numbers. The caller ensures that another machine has the same equations.
    pub(super) fn pass(&mut self, pass: &mut Pass) -> Passed {
        let common = &mut self.common;
        if common.rules.trouble.is_some() {
            return None;
        }
        let start = *common.coordinates.start();
        pass.numbers(&mut self.z)?;
        pass.numbers(&mut self.largest)?;
        common.coordinates.pass(pass)?;
        common.rules.pass(pass)?;
        pass.numbers(&mut common.input_rate)?;
        pass.numbers(&mut common.input_curvature)?;
        let times = [&mut common.base, &mut common.offset, &mut common.end];
        times.into_iter().try_for_each(|time| pass.number(time))?;
        pass.bits(&mut common.taken)?;
        pass.bits(&mut common.cost.steps)?;
        pass.bits(&mut common.cost.series)?;
        common.rounding.pass(pass)?;
        if let Some(errors) = &mut self.errors {
            errors.pass(pass)?;
        }
        if *common.coordinates.start() != start {
            return None;
        }
        let (mechanism, space) = (&common.mechanism, &common.space);
        self.matrices = ModeMatrices::from_known(&mut self.known, mechanism, space, &common.rules.mode, common.h).0;
        Some(())
    }

    /// Continues with other parameters of the same mechanism.
    pub(super) fn replace(&mut self, mechanism: &Mechanism) {
        let common = &mut self.common;
        let seen = mechanism.seen_from(&common.space.layout, common.coordinates.start());
        seen.take_over(&common.mechanism, &mut common.rules.mode, |body| self.z[common.space.layout.speed[body]]);
        common.mechanism = Arc::new(seen);
        self.known = Vec::new();
        self.common.rules.refreshed();
        self.take_up_mode();
    }
}
