//! PID, and cascades of P and PI.
//!
//! With the weight c of the reference speed: c = 1 differentiates the error, c = 0 the measurement alone.

use super::law::{Last, Law, LawInputs, Speed};
use crate::calculator::{Calculator, Slot, Slots};
use crate::design::{Cascade, Pid};

/// A PID controller: u = K_p e + K_i ∫e dt + K_d (c ẏ* − ẏ).
#[derive(Debug, Clone)]
pub(crate) struct PidLaw {
    gains: Pid,
    every: f64,
    integral: Slot,
    slope: Slot,
    last: Last,
}

impl PidLaw {
    /// Stepped every `every` s.
    pub fn new(slots: &mut Slots, gains: &Pid, every: f64) -> Self {
        let integral = slots.add("integral", "integral of the error, as a command");
        let slope = slots.add("slope", "filtered derivative, m/s");
        let last = Last::new(slots, "last", "what was differentiated at the last sample, m");
        Self { gains: *gains, every, integral, slope, last }
    }
}

impl Law for PidLaw {
    fn about(&self) -> &'static str {
        "PID"
    }

    fn commands_current(&self) -> bool {
        false
    }

    fn is_linear(&self) -> bool {
        true
    }

    fn step<C: Calculator>(&self, c: &mut C, seen: &LawInputs<C::N>) -> C::N {
        let Pid { proportional, integral, derivative, filter, reference_speed, .. } = self.gains;
        let (target, position, every) = (&seen.target, seen.position, self.every);
        let error = c.name("error", target.position - position);
        // T_f ḋ + d = c ẏ* − ẏ by backward differences
        let time = 1.0 / (2.0 * std::f64::consts::PI * filter);
        let weighed = c.name("weighed", target.position * reference_speed - position);
        let change = weighed - self.last.step(c, weighed);
        let slope = (c.memory(self.slope) * time + change) / (time + every);
        let slope = c.name("new_slope", slope);
        c.keep(self.slope, slope);
        let sum = c.memory(self.integral) + error * (integral * every);
        let sum = c.name("sum", sum);
        c.keep(self.integral, sum);
        error * proportional + sum + slope * derivative
    }

    /// Back-calculation of the integral. None with zero gain, since nothing would ever discharge it.
    fn limited<C: Calculator>(&self, c: &mut C, excess: C::N, _: C::N) {
        if self.gains.integral != 0.0 {
            let sum = c.memory(self.integral) + excess * (self.every / self.gains.tracking).min(1.0);
            c.keep(self.integral, sum);
        }
    }
}

/// A position loop around a speed loop, around a current loop if there is one.
#[derive(Debug, Clone)]
pub(crate) struct CascadeLaw {
    gains: Cascade,
    every: f64,
    speed: Speed,
    speed_integral: Slot,
    current_integral: Slot,
}

impl CascadeLaw {
    /// Stepped every `every` s.
    pub fn new(slots: &mut Slots, gains: &Cascade, every: f64) -> Self {
        Self {
            gains: *gains,
            every,
            speed: Speed::new(slots, every, gains.filter),
            speed_integral: slots.add("speed_integral", "integral of the speed loop"),
            current_integral: slots.add("current_integral", "integral of the current loop, V"),
        }
    }

    /// Adds to the speed loop's integral, unless its gain is zero, since nothing would ever discharge it.
    fn push_speed<C: Calculator>(&self, c: &mut C, change: C::N) {
        if self.gains.speed_integral != 0.0 {
            let sum = c.memory(self.speed_integral) + change;
            c.keep(self.speed_integral, sum);
        }
    }

    fn share(&self) -> f64 {
        (self.every / self.gains.tracking).min(1.0)
    }
}

impl Law for CascadeLaw {
    fn about(&self) -> &'static str {
        "position loop around speed loop"
    }

    fn commands_current(&self) -> bool {
        self.gains.current.is_some()
    }

    fn is_linear(&self) -> bool {
        true
    }

    fn step<C: Calculator>(&self, c: &mut C, seen: &LawInputs<C::N>) -> C::N {
        let gains = &self.gains;
        // With a scale, the position loop is closed at the cart with the cart's reference.
        let (aim, load) = match seen.scale {
            None => (&seen.target, seen.position),
            Some(scale) => (&seen.reference, scale),
        };
        let speed = self.speed.step(c, seen.position);
        // v* = K_v (y* − y) + c ẏ*
        let wanted = (aim.position - load) * gains.position + aim.speed * gains.reference_speed;
        let error = c.name("error", wanted - speed);
        let sum = c.memory(self.speed_integral) + error * (gains.speed_integral * self.every);
        let sum = c.name("sum", sum);
        c.keep(self.speed_integral, sum);
        let output = error * gains.speed + sum;
        let Some(inner) = gains.current else { return output };
        let asked = seen.forward.map_or(output, |forward| output + forward);
        let asked = c.name("current_asked", asked);
        let mut held = asked;
        if let Some(limit) = inner.limit {
            held = c.within(asked, -limit, limit);
            held = c.name("current_held", held);
            self.push_speed(c, (held - asked) * self.share());
        }
        let error = c.name("current_error", held - seen.current);
        let sum = c.memory(self.current_integral) + error * (inner.integral * self.every);
        let sum = c.name("current_sum", sum);
        c.keep(self.current_integral, sum);
        error * inner.proportional + sum
    }

    /// Back-calculation in the innermost loop.
    fn limited<C: Calculator>(&self, c: &mut C, excess: C::N, _: C::N) {
        let share = c.name("share", excess * self.share());
        let Some(inner) = self.gains.current else { return self.push_speed(c, share) };
        if inner.integral != 0.0 {
            let sum = c.memory(self.current_integral) + share;
            c.keep(self.current_integral, sum);
        }
        if inner.proportional != 0.0 {
            self.push_speed(c, share / inner.proportional);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calculator::Evaluation;

    /// Of what a limit takes from the command, the integrals lose T/T_t in a sample, and never more than all.
    #[test]
    fn integrals_follow_a_limit_with_their_tracking_time() {
        let every = 1e-3;
        for (tracking, share) in [(2e-2, 0.05), (1e-3, 1.0), (1e-4, 1.0)] {
            let mut slots = Slots::default();
            let cascade = Cascade { speed_integral: 3.0, tracking, ..Cascade::new(10.0, 2.0) };
            let law = CascadeLaw::new(&mut slots, &cascade, every);
            let mut memory = vec![0.0; slots.count()];
            law.limited(&mut Evaluation::on(&mut memory), -4.0, 0.0);
            let sum = Evaluation::on(&mut memory).memory(law.speed_integral);
            assert!((sum + 4.0 * share).abs() < 1e-12, "{tracking}: {sum}");

            let mut slots = Slots::default();
            let law = PidLaw::new(&mut slots, &Pid { integral: 3.0, tracking, ..Pid::new(10.0) }, every);
            let mut memory = vec![0.0; slots.count()];
            law.limited(&mut Evaluation::on(&mut memory), -4.0, 0.0);
            let sum = Evaluation::on(&mut memory).memory(law.integral);
            assert!((sum + 4.0 * share).abs() < 1e-12, "{tracking}: {sum}");
        }
    }
}
