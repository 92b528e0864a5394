//! Derivatives of the columns of a running machine with respect to time, of any order, in its present mode.
//!
//! In a mode of a machine that is linear between events, every column is a linear form of lengths s, speeds v, currents
//! i, inputs u and one. So are the rates of these, so each derivative follows from the previous one:
//!
//! ```text
//! s⁽ⁿ⁺¹⁾ = A v⁽ⁿ⁾      v⁽ⁿ⁺¹⁾ = a·(s, v, i, u)⁽ⁿ⁾      i⁽ⁿ⁺¹⁾ = e·(s, v, i, u)⁽ⁿ⁾
//! ```

use super::simulator::Simulator;
use crate::friction::Motion;
use crate::mechanism::{DRIVES, Equations, Form, SPRINGS, Shown, State};
use crate::signal::DEGREE;

/// Derivatives of one order of all quantities in columns; of order zero, the values.
#[derive(Clone, Copy)]
struct Level {
    order: usize,
    stretch: [f64; SPRINGS],
    /// Speeds and currents.
    state: State,
    input: [f64; DRIVES],
}

impl Level {
    /// Derivative of a form, whose constant has none.
    fn value(&self, form: &Form) -> f64 {
        let form = if self.order == 0 { *form } else { Form { constant: 0.0, ..*form } };
        form.value_at(&self.stretch, &self.state, &self.input)
    }
}

impl Simulator {
    /// Derivatives of `order`, one or more, of each of [`Simulator::columns`] with respect to time, just after the
    /// present time; `into` has an element for each. Returns `None`, without an effect, for a machine that is not
    /// linear between events.
    pub fn derivatives(&self, order: usize, into: &mut [f64]) -> Option<()> {
        let mechanism = self.mechanism();
        if order == 0 || !mechanism.is_piecewise_linear() {
            return None;
        }
        let engine = self.engine();
        let equations = mechanism.equations(*engine.mode());
        let now = self.level();
        let mut before = now;
        let mut level = self.after(&now, &equations);
        for _ in 1..order {
            before = level;
            level = self.after(&before, &equations);
        }
        let mode = engine.mode();
        for (into, heading) in into.iter_mut().zip(&mechanism.columns) {
            *into = match heading.shown {
                Shown::Time => f64::from(u8::from(order == 1)),
                Shown::Input(drive) => level.input[drive],
                Shown::Voltage(drive) => level.value(&mechanism.voltage(drive, mode)),
                Shown::Current(drive) => level.value(&mechanism.current(drive, mode)),
                Shown::SecondPhase(drive) => level.state.current[mechanism.first_current(drive) + 1],
                Shown::Position(body, factor) => before.state.speed[body] * factor,
                Shown::Speed(body, factor) => level.state.speed[body] * factor,
                Shown::Stretch(spring) => level.stretch[spring],
                Shown::Force(spring, factor) => level.value(&mechanism.spring_force(spring, mode)) * factor,
                Shown::Friction(body) => self.friction_rate(body, &now, &level),
                // They are constant between events; a linear machine has no bristles.
                Shown::Motion(_) | Shown::Contact(_) | Shown::Counts(..) | Shown::Bristle(_) => 0.0,
            } + 0.0;
        }
        Some(())
    }

    /// The values now.
    fn level(&self) -> Level {
        let engine = self.engine();
        let stretch = std::array::from_fn(|spring| match spring < engine.mechanism().springs.len() {
            true => engine.value(&Form::stretch(spring)),
            false => 0.0,
        });
        Level { order: 0, stretch, state: engine.state(), input: engine.input() }
    }

    /// The derivatives of the next order.
    fn after(&self, level: &Level, equations: &Equations) -> Level {
        let (mechanism, order) = (self.mechanism(), level.order + 1);
        let mut next = Level { order, stretch: [0.0; SPRINGS], state: State::default(), input: [0.0; DRIVES] };
        for (stretch, spring) in next.stretch.iter_mut().zip(&mechanism.springs) {
            *stretch = spring.arms.iter().map(|&(body, arm)| arm * level.state.speed[body]).sum();
        }
        for (body, speed) in next.state.speed.iter_mut().enumerate().take(mechanism.bodies.len()) {
            *speed = level.value(&equations.acceleration[body]);
        }
        for (drive, current) in next.state.current.iter_mut().enumerate().take(mechanism.drives.len()) {
            *current = level.value(&equations.current_rate[drive]);
        }
        // u⁽ⁿ⁾ = n! c_n, powers counted from now
        let factorial: f64 = (1..=order).map(|k| k as f64).product();
        for (input, coefficients) in next.input.iter_mut().zip(self.input_coefficients()) {
            *input = if order <= DEGREE { factorial * coefficients[order] } else { 0.0 };
        }
        next
    }

    /// Derivative of the friction on a body; at rest, of the load that its gear does not hold.
    fn friction_rate(&self, body: usize, now: &Level, level: &Level) -> f64 {
        let (mechanism, mode) = (self.mechanism(), self.engine().mode());
        let law = mechanism.friction(body);
        match mode.motion[body] {
            // F_f = b v ± F_c                                                   (15)
            Motion::Free | Motion::Forward => law.forward.viscous * level.state.speed[body],
            Motion::Backward => law.backward.viscous * level.state.speed[body],
            Motion::Stuck if mechanism.leader(body) != body => 0.0,
            Motion::Stuck => {
                let ways = [(true, true), (true, false), (false, true), (false, false)];
                let loads = ways.map(|(positive, forward)| {
                    let form = mechanism.load(body, forward, &mode.with_torque(positive));
                    (now.value(&form), level.value(&form))
                });
                let least = loads.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0));
                let most = loads.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0));
                let least = least.filter(|(load, _)| *load > 0.0).map_or(0.0, |(_, rate)| rate);
                let most = most.filter(|(load, _)| *load < 0.0).map_or(0.0, |(_, rate)| rate);
                least + most
            }
        }
    }
}
