//! Stepping: step lengths by error, guards, events.

use super::calm::FAR;
use super::fall;
use super::field::Field;
use super::linear::{EIGHTHS, Set};
use super::model::Vector;
use super::radau::{POINTS, REACH, TERMS};
use super::sources::SOURCES;
use super::step::{ARGUMENTS, Begin, Guess, Lanes, Step, StepBuffers};
use super::stretch::Stretch;
use super::{Core, Hit, STEPS_BETWEEN_QUESTIONS, StepAdvance, Witness};
use crate::mechanism::{Cause, Transition};
use crate::solve::{Ending, rules};
use std::cell::RefCell;
use std::sync::Arc;

/// Allowed error of a step, as a multiple of the tolerance: positions of a whole run then have an error of at most the
/// tolerance in metres, for most machines of a tenth or less of it (`tests/collocation.rs`). Part of the error of a
/// speed decays before it becomes one of position.
const EASE: f64 = 10.0;

/// Factor on the step length that the error allows, and limits of its change in one step.
const SAFETY: f64 = 0.85;
const SHRINK: f64 = 0.1;
const GROW: f64 = 4.0;

/// Steps of one length after which columns for it are worth making.
const WORTH: u32 = 6;

/// The first step of the second run of an estimate on a piece of the input that one step could cover, as a share of it.
const PART_OF_PIECE: f64 = 0.6;

/// Halvings of a step in which an event is located again.
const HALVINGS: usize = 60;

/// Solutions of a step that is to end at a kink, and how near to its end that has to be, as a share of it.
const SOLUTIONS: usize = 6;
const NEAR_KINK: f64 = 1e-11;

/// Largest ‖A‖ h of a step in which a quartic describes the zero crossing of a free motion.
const NEAR_QUARTIC: f64 = 1.0;

/// Lengths of steps of one mode that are kept.
const KEPT: usize = 48;

/// The guard that falls first in a step: where, as a share of it, and which; and what is forgiven it.
struct Fall {
    share: f64,
    index: usize,
    slack: f64,
}

/// A step up to an event: the error of the step that ends there, as a multiple of the allowed one, infinite if that
/// step has no solution; and true if the condition of the event does not hold at its time.
struct Part {
    hit: Hit,
    error: f64,
    is_unmet: bool,
}

/// A step whose part up to an event has a larger error than allowed: the length of that part, s, and its error.
struct Inexact {
    h: f64,
    error: f64,
}

/// The check of an event: which guard, its slack, and how far its value may be off because the event's time is rounded.
struct Check {
    index: usize,
    slack: f64,
    change: f64,
}

/// A length that a step may have, and where it ends; whether it is one of those that are met again.
struct Length {
    h: f64,
    to: f64,
    regular: bool,
}

impl Core {
    /// Advances to the end of the stretch, event by event.
    pub(super) fn reach(&mut self, witness: &mut dyn Witness) {
        while self.tau < self.stretch.length() && self.rules.trouble.is_none() {
            let Some(hit) = self.integrate(witness) else { continue };
            (self.y, self.tau) = (hit.y, hit.tau);
            rules::change(self, hit.fallen);
            rules::settle(self);
        }
    }

    /// Advances to the end of the stretch, or to the first guard that falls.
    fn integrate(&mut self, witness: &mut dyn Witness) -> Option<Hit> {
        let (field, stretch) = (self.field(), self.stretch);
        let mut room = self.room.take().unwrap_or_else(|| Box::new(StepBuffers::new()));
        let evaluations = room.evaluations;
        // The forces begin anew with each mode.
        let mut guess = Guess::Constant;
        let mut forces = [0.0; SOURCES];
        field.forces(&stretch.input(self.tau), &self.y, &mut forces);
        room.begin(&forces);
        let mut hit = None;
        while hit.is_none() && self.rules.trouble.is_none() {
            if stretch.length() - self.tau <= 64.0 * f64::EPSILON * stretch.length() {
                // The remaining time is rounding, not a step.
                self.tau = stretch.length();
                break;
            }
            if self.comes_to_rest(&field, &stretch) {
                self.rest(&stretch, witness);
                break;
            }
            hit = self.step(&field, &stretch, &mut room, &mut guess, witness);
        }
        self.cost.evaluations += room.evaluations - evaluations;
        self.room = Some(room);
        hit
    }

    /// True if everything has come to rest until the input changes; what still oscillated has no speed then.
    fn comes_to_rest(&mut self, field: &Field, stretch: &Stretch) -> bool {
        let Some(calm) = field.calm.as_ref().filter(|_| stretch.degree == 0) else { return false };
        let input = stretch.input(self.tau);
        let is_far = |(index, value): (usize, &f64)| *value > FAR * field.size(index, &input, &self.y);
        let is_at_rest = calm.holds(&self.y, &self.absolute, || field.rate(&input, &self.y))
            && field.guards(&input, &self.y).iter().take(field.watches.len()).enumerate().all(is_far);
        if is_at_rest {
            calm.speeds().for_each(|speed| self.y[speed] = 0.0);
        }
        is_at_rest
    }

    /// Stays where it is until the end of the stretch.
    fn rest(&mut self, stretch: &Stretch, witness: &mut dyn Witness) {
        let (begin, from, until) = (self.y, self.tau, stretch.length());
        self.cost.steps += 1;
        self.rules.since_change += until - from;
        let way = StepAdvance { stretch, from, until, to: until, begin: &begin, rests: true, dense: &|_| begin };
        witness.see(self, &way);
        self.tau = until;
    }

    /// Takes one step; the guard that fell in it, if one did.
    fn step(
        &mut self,
        field: &Field,
        stretch: &Stretch,
        room: &mut StepBuffers,
        guess: &mut Guess,
        witness: &mut dyn Witness,
    ) -> Option<Hit> {
        let (begin, from) = (self.y, self.tau);
        let strict = self.strict(field);
        loop {
            let mut length = self.length(field, stretch);
            let (mut set, mut whole) = self.set(field, &length);
            let mut start =
                Begin { y: &begin, input: stretch.inputs(from, set.h), degree: stretch.degree, strict: &strict };
            let number = self.present as u64;
            let mut error = room.solve(&Step { field, number, set: &set, begin: &start, whole }, guess.predict(set.h));
            // No step crosses a kink of a force, which quartics cannot describe.
            let mut is_cut = false;
            for _ in 0..SOLUTIONS {
                let step = Step { field, number, set: &set, begin: &start, whole };
                let Some(share) = error.and_then(|_| room.kink(&step)).filter(|share| *share < 1.0 - NEAR_KINK) else {
                    break;
                };
                let (h, longer) = (share * set.h, set.h);
                if h <= 256.0 * f64::EPSILON * (stretch.begin + from).max(self.moment) {
                    break;
                }
                length = Length { h, to: from + h, regular: false };
                (set, whole, is_cut) = (Arc::new(Set::new(&field.linear, h, stretch.degree)), false, true);
                start.input = stretch.inputs(from, h);
                let step = Step { field, number, set: &set, begin: &start, whole };
                error = room.solve(&step, Guess::Within(longer).predict(h));
            }
            let step = Step { field, number, set: &set, begin: &start, whole };
            let end = error.map(|_| room.end);
            let least = set.h <= 256.0 * f64::EPSILON * (stretch.begin + from).max(self.moment);
            match (error, end) {
                (Some(error), Some(end)) if (error <= 1.0 || least) && end.iter().sum::<f64>().is_finite() => {
                    let reversing = room.reversing(field);
                    let taken = self.take(room, (stretch, &step), (from, length.to), (end, least), witness);
                    let hit = match taken {
                        Ok(hit) => hit,
                        Err(Inexact { h, error }) => {
                            self.step = h * shrink(error);
                            *guess = Guess::Within(h);
                            continue;
                        }
                    };
                    *guess = Guess::After(set.h);
                    room.keep(set.h, field.sources.len());
                    // The error is of sixth order. A short step predicts little about much longer ones.
                    self.step = (SAFETY * set.h * error.powf(-1.0 / 6.0)).min(self.step.max(GROW * set.h));
                    if is_cut && hit.is_none() {
                        // Values before a kink do not predict those after it.
                        let model = &*self.model;
                        for body in (0..model.mechanism.bodies.len()).filter(|&body| reversing[body]) {
                            let leader = model.mechanism.leader(body);
                            model.mechanism.followers(leader).for_each(|body| self.y[model.speed(body)] = 0.0);
                        }
                        let mut forces = [0.0; SOURCES];
                        field.forces(&stretch.input(self.tau), &self.y, &mut forces);
                        room.begin(&forces);
                        *guess = Guess::Constant;
                    }
                    return hit;
                }
                (Some(error), Some(_)) if error > 1.0 && !least => {
                    self.step = set.h * shrink(error);
                    *guess = Guess::Within(set.h);
                }
                _ if least => {
                    // Not even the smallest step will do: this is no motion any more.
                    self.rules.trouble = Some(Ending::Diverged { time: stretch.begin + from });
                    return None;
                }
                _ => {
                    self.step = 0.25 * set.h;
                    *guess = Guess::Constant;
                }
            }
        }
    }

    /// One over what each argument may be off by in a step.
    fn strict(&self, field: &Field) -> Lanes<f64> {
        let mut strict = [0.0; ARGUMENTS];
        for (strict, &(place, weight)) in strict.iter_mut().zip(&field.measured) {
            let allowed = self.absolute[place] + self.relative * self.y[place].abs();
            *strict = 1.0 / (EASE * allowed * weight.abs());
        }
        strict
    }

    /// The length of the next step: halves, quarters, doubles of the interval that end on multiples of themselves, or
    /// what is left to such a multiple or to the end of the stretch.
    fn length(&self, field: &Field, stretch: &Stretch) -> Length {
        let left = stretch.length() - self.tau;
        let is_one_sided = field.sources.iter().any(|source| source.is_one_sided(&field.model));
        let reach = if is_one_sided { NEAR_QUARTIC } else { REACH };
        let most = self.step.min(reach / field.linear.norm);
        let regular = self.interval * power_of_two_below(most / self.interval);
        let time = stretch.begin + self.tau;
        let near = 8.0 * f64::EPSILON * time + 1e-9 * regular;
        let mut to = ((time + near) / regular).floor() * regular + regular;
        let mut h = to - time;
        if h < 0.25 * regular && h + regular <= most {
            (to, h) = (to + regular, h + regular);
        }
        if h >= left - near {
            if self.noise.size > 0.0 && self.tau == 0.0 {
                // Inputs of short pieces would give both runs the same steps.
                let part = PART_OF_PIECE * left;
                return Length { h: part, to: part, regular: false };
            }
            let is_whole = (left - regular).abs() <= near.min(1e-12 * regular + 8.0 * f64::EPSILON * time);
            return Length { h: if is_whole { regular } else { left }, to: stretch.length(), regular: is_whole };
        }
        // Rounding of the sum of times.
        let is_whole = (h - regular).abs() <= 8.0 * f64::EPSILON * (time + h);
        Length { h: if is_whole { regular } else { h }, to: to - stretch.begin, regular: is_whole }
    }

    /// The matrices of the mode for steps of this length, and whether they are worth their columns.
    fn set(&mut self, field: &Field, length: &Length) -> (Arc<Set>, bool) {
        let (known, degree) = (&mut self.known[self.present].sets, self.stretch.degree);
        let near = 8.0 * f64::EPSILON * (self.stretch.begin + self.tau).max(length.h);
        let is_near = |h: f64| match length.regular {
            true => h == length.h,
            false => (h - length.h).abs() <= near.min(1e-9 * length.h),
        };
        let fits = |set: &Set| set.degree == degree && is_near(set.h);
        if let Some((set, times)) = known.iter_mut().find(|(set, _)| fits(set)) {
            *times += 1;
            return (Arc::clone(set), *times > WORTH);
        }
        let set = Arc::new(Set::new(&field.linear, length.h, degree));
        self.cost.propagators += 1;
        if known.len() == KEPT {
            known.remove(0);
        }
        known.push((Arc::clone(&set), 1));
        (set, false)
    }

    /// Takes a solved step up to the first guard that falls. Errors: the part up to there has a larger error than
    /// allowed, and nothing was taken; the smallest step is taken all the same.
    fn take(
        &mut self,
        room: &mut StepBuffers,
        (stretch, step): (&Stretch, &Step),
        (from, to): (f64, f64),
        (end, least): (Vector, bool),
        witness: &mut dyn Witness,
    ) -> Result<Option<Hit>, Inexact> {
        let (field, start) = (step.field, *step.begin);
        let time = stretch.begin + to;
        let mut dense =
            Dense { field, start, set: step.set, h: step.set.h, whole: step.whole, is_expanded: !step.whole };
        let fall = self.first_fall(room, &mut dense);
        let part = fall.map(|fall| self.up_to(room, &mut dense, (from, to), &fall));
        if let Some(Part { error, .. }) = part
            && error > 1.0
            && !least
        {
            return Err(Inexact { h: dense.h, error });
        }
        let hit = part.map(|Part { hit, is_unmet, .. }| {
            self.unmet += u64::from(is_unmet);
            hit
        });
        self.cost.steps += 1;
        if self.cost.steps.is_multiple_of(STEPS_BETWEEN_QUESTIONS) {
            self.rules.trouble = self.pace.too_stiff(self.cost.steps, time, self.end);
        }
        let until = hit.as_ref().map_or(to, |hit| hit.tau);
        self.rules.since_change += until - from;
        let rests = end == *start.y
            && stretch.degree == 0
            && field.rate(&stretch.input(from), start.y).iter().all(|rate| *rate == 0.0);
        {
            let inside = RefCell::new((&mut *room, dense));
            let at = |tau: f64| {
                let (room, dense) = &mut *inside.borrow_mut();
                let share = (tau - from) / dense.h;
                dense.at(room, share)
            };
            witness.see(self, &StepAdvance { stretch, from, until, to, begin: start.y, rests, dense: &at });
        }
        let asks = self.cost.steps.is_multiple_of(STEPS_BETWEEN_QUESTIONS);
        if (asks || self.rules.trouble.is_some()) && !witness.ask() && self.rules.trouble.is_none() {
            self.rules.trouble = Some(Ending::Interrupted { time });
        }
        (self.y, self.tau) = (end, to);
        self.shake();
        Ok(hit)
    }

    /// Changes speeds at random, as coarser rounding would: those of bodies that move together by the same factor.
    fn shake(&mut self) {
        if self.noise.size > 0.0 {
            let model = &*self.model;
            for leader in model.mechanism.leaders() {
                let factor = 1.0 + self.noise.next();
                model.mechanism.followers(leader).for_each(|body| self.y[model.speed(body)] *= factor);
            }
        }
    }

    /// The first guard to fall in a step.
    fn first_fall(&mut self, room: &mut StepBuffers, dense: &mut Dense) -> Option<Fall> {
        let (field, start) = (dense.field, dense.start);
        let mut first: Option<Fall> = None;
        let mut coefficients = [0.0; TERMS];
        let is_told = dense.whole;
        if is_told {
            room.tell_guards(field, dense.set, &start);
        }
        for (index, &Transition { cause, .. }) in field.watches.iter().enumerate() {
            let shift = if field.shifted { field.shift(cause, start.y) } else { 0.0 };
            let values: [f64; POINTS] = match is_told {
                true => room.told[index].map(|value| value + shift),
                false => {
                    dense.guard(room, index, shift, &mut coefficients);
                    StepBuffers::at_points(&coefficients, room.series.order)
                }
            };
            if let Cause::GearTorque(drive) = cause {
                self.torque[drive] = values.iter().fold(self.torque[drive], |most, value| most.max(value.abs()));
                // The step decides what rounding had decided before.
                self.rules.tolerance[cause.kind()] = self.relative * self.torque[drive];
            }
            let slack = self.forgiven(cause);
            let own = &mut self.rules.tolerance[cause.kind()];
            if matches!(cause, Cause::Switch(_)) && values[POINTS - 1] > 10.0 * *own {
                // A part that has clearly left its limit is guarded to the last bit again.
                *own = 0.0;
            }
            if !fall::may_fall(&values.map(|value| value + slack)) {
                continue;
            }
            self.cost.looks += 1;
            if is_told {
                dense.guard(room, index, shift, &mut coefficients);
            }
            coefficients[0] = (coefficients[0] + slack).max(0.0);
            if let Some(share) = fall::first_fall(&coefficients, room.series.order)
                && first.as_ref().is_none_or(|earliest| share < earliest.share)
            {
                first = Some(Fall { share, index, slack });
            }
        }
        first
    }

    /// The state at a fall: the step is taken again up to there, until it ends at the fall. The nodes of the whole step
    /// can miss what a force does near the event, such as the peak of a narrow Stribeck curve where the speed is zero;
    /// those of the shorter one do not, so that its own error counts.
    fn up_to(&self, room: &mut StepBuffers, dense: &mut Dense, (from, to): (f64, f64), fall: &Fall) -> Part {
        let (field, stretch, fallen) = (dense.field, self.stretch, dense.field.watches[fall.index]);
        let cause = fallen.cause;
        let (begin, length) = (dense.start.y, to - from);
        let shift = if field.shifted { field.shift(cause, begin) } else { 0.0 };
        // A speed that has passed zero is located at its zero.
        let slack = if matches!(cause, Cause::Stop(_)) { 0.0 } else { fall.slack };
        let mut coefficients = [0.0; TERMS];
        dense.guard(room, fall.index, shift + slack, &mut coefficients);
        let order = room.series.order;
        // The change of the guard over the step, and by it what it may be off by because its time is.
        let change: f64 = coefficients[1..=order].iter().map(|c| c.abs()).sum();
        let change = change * (self.relative + 8.0 * f64::EPSILON * (stretch.begin + to) / length);
        let mut share = fall::zero_near(&coefficients, order, fall.share);
        let mut error = 0.0;
        for _ in 0..4 {
            let h = share * dense.h;
            if (share - 1.0).abs() < 1e-4 || h <= 64.0 * f64::EPSILON * from.max(self.moment) {
                break;
            }
            let sources = field.sources.len();
            let mut there = [0.0; SOURCES];
            field.forces(&stretch.input(from + h), &dense.at(room, share), &mut there);
            if room.forces[..sources].iter().flatten().chain(&there[..sources]).all(|force| *force == 0.0) {
                // The step is linear.
                break;
            }
            error = dense.shorten(room, &stretch, self.present as u64, (from, h));
            if error == f64::INFINITY {
                break;
            }
            dense.guard(room, fall.index, shift + slack, &mut coefficients);
            share = fall::zero_near(&coefficients, room.series.order, 1.0);
        }
        let span = (share * dense.h).min(length);
        let hit = Hit { tau: from + span, y: dense.at(room, span / dense.h), fallen };
        let check = Check { index: fall.index, slack, change };
        if self.off(field, &check, &hit).abs() <= 1.0 {
            Part { hit, error, is_unmet: false }
        } else {
            self.locate(room, dense, (from, length), &check, hit)
        }
    }

    /// Locates an event again whose condition is not at its limit there: by halving, between a time of the step at
    /// which the condition holds and one at which it does not.
    fn locate(
        &self,
        room: &mut StepBuffers,
        dense: &mut Dense,
        (from, length): (f64, f64),
        check: &Check,
        first: Hit,
    ) -> Part {
        let (field, stretch, number) = (dense.field, self.stretch, self.present as u64);
        let (mut low, mut high, mut best) = (0.0, length, first);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if dense.shorten(room, &stretch, number, (from, middle)) == f64::INFINITY {
                break;
            }
            let there = Hit { tau: from + middle, y: dense.at(room, 1.0), fallen: best.fallen };
            let off = self.off(field, check, &there);
            if off.abs() < self.off(field, check, &best).abs() {
                best = there;
            }
            if off.abs() <= 1.0 {
                break;
            }
            (low, high) = if off < 0.0 { (low, middle) } else { (middle, high) };
        }
        let is_between = low > 0.0 && high < length;
        // It was due before this step, or does not happen in it.
        let is_unmet = !is_between && self.off(field, check, &best).abs() > 1.0;
        let mut error = 0.0;
        if best.tau > from {
            // Rows up to the event are of a step that ends there.
            error = dense.shorten(room, &stretch, number, (from, best.tau - from));
        }
        Part { hit: best, error, is_unmet }
    }

    /// Deviation of the condition of an event from its limit, at this state and the present inputs, as a multiple of
    /// tolerance and rounding.
    fn off(&self, field: &Field, check: &Check, hit: &Hit) -> f64 {
        let input = self.stretch.input(hit.tau);
        let value = field.guards(&input, &hit.y)[check.index] + check.slack;
        let allowed = self.relative * field.size(check.index, &input, &hit.y) + check.change;
        let allowed = match hit.fallen.cause {
            Cause::Stop(body) => allowed.max(self.absolute[self.model.speed(body)]),
            Cause::BreakForward(_)
            | Cause::BreakBackward(_)
            | Cause::GearTorque(_)
            | Cause::Switch(_)
            | Cause::Leave(_) => allowed,
        };
        value / allowed.max(f64::MIN_POSITIVE)
    }
}

/// Factor on the length of a step with an error above the allowed one, for the next try.
fn shrink(error: f64) -> f64 {
    (SAFETY * error.powf(-1.0 / 6.0)).clamp(SHRINK, 0.9)
}

/// The largest power of two that is not above `ratio`, a positive number: its bits without those of the fraction.
fn power_of_two_below(ratio: f64) -> f64 {
    f64::from_bits(ratio.clamp(1e-300, 1e300).to_bits() & (0x7ff << 52))
}

/// A step that was solved, at any place.
struct Dense<'a> {
    field: &'a Field,
    start: Begin<'a>,
    set: &'a Set,
    h: f64,
    /// True if it was taken by the columns of the whole step.
    whole: bool,
    /// True if the room has its series.
    is_expanded: bool,
}

impl Dense<'_> {
    /// Solves it again from the same beginning over `h` alone, and its series with the inputs of that length. Returns
    /// its error as a multiple of the allowed one; infinity, and nothing has changed, if there is no solution.
    fn shorten(&mut self, room: &mut StepBuffers, stretch: &Stretch, number: u64, (from, h): (f64, f64)) -> f64 {
        let field = self.field;
        let before = room.clone();
        let set = Set::new(&field.linear, h, stretch.degree);
        let start = Begin { input: stretch.inputs(from, h), ..self.start };
        let step = Step { field, number, set: &set, begin: &start, whole: false };
        let Some(error) = room.solve(&step, Guess::Within(self.h).predict(h)) else {
            *room = before;
            return f64::INFINITY;
        };
        room.expand(field, h, &start);
        (self.start, self.h, self.is_expanded) = (start, h, true);
        error
    }

    fn expand(&mut self, room: &mut StepBuffers) {
        if !self.is_expanded {
            room.expand(self.field, self.h, &self.start);
            self.is_expanded = true;
        }
    }

    /// The state at the share `s`.
    fn at(&mut self, room: &mut StepBuffers, s: f64) -> Vector {
        let eighths = s * EIGHTHS as f64;
        let is_eighth = (eighths - eighths.round()).abs() < 1e-9 && (0.5..EIGHTHS as f64 - 0.5).contains(&eighths);
        if self.whole && self.h == self.set.h && is_eighth {
            return room.at_eighth(self.field, self.set, &self.start, eighths.round() as usize);
        }
        self.expand(room);
        let states = room.series.at(self.field.linear.size, s);
        room.with_bristles(self.field, self.start.y, &states, s)
    }

    /// A guard along the step, by powers of its share.
    fn guard(&mut self, room: &mut StepBuffers, index: usize, shift: f64, coefficients: &mut [f64; TERMS]) {
        self.expand(room);
        room.guard_along(self.field, &self.start, index, coefficients);
        coefficients[0] += shift;
    }
}
