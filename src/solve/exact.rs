//! The exact solver: modes and matrix exponentials.
//!
//! Within a mode the stage is linear and a step is a product with e^{A h}. A mode may be left only when one of its guards
//! becomes negative, so the solver moves in the largest steps on which no guard can, by a bound that holds for
//! certain, and looks closer (halves the step, and at last expands the state into a Taylor series) only where the bound does not decide.
//!
//! The bound. y = ż obeys ẏ = A y + b u̇, and friction, resistance and damping only take energy away, so its energy
//! V(y) = ½ Σ m a² + ½ Σ k (Δv)² + ½ w L (di/dt)² can only grow by the input's rate: √(2V)(τ) ≤ √(2V)(0) + |b|·|u̇|·τ. A guard
//! g = w·z therefore changes no faster than |w|·√(2V), |w| being the norm dual to V; and likewise its slope, with ẏ.

mod change;
mod shown;

use super::coordinates::{Coordinates, stretches};
use super::law::{Law, Size, Watch, chain, highest, states};
use super::observe::Output;
use super::pace::{Pace, STEPS_BETWEEN_QUESTIONS};
use super::propagator::SERIES_ORDER;
use super::record::{Recorder, Row};
use super::roots;
use super::rounding::Rounding;
use super::{Cost, Detail, Ending, Event, Flow, Grid, Outcome, Source, held};
use crate::case::Experiment;
use crate::plant::{Cause, Form, Mode, Plant, State, place};
use crate::signal::Piece;
use shown::Watching;
use std::rc::Rc;

/// For so small a part of the series' reach a speed that has left zero is still told by its series alone.
const SOON: f64 = 1e-6;

/// Intervals looked at closer after which a bound is made anew.
const OFTEN: usize = 8;

/// What runs of one plant can share: the modes that were made ready.
#[derive(Default)]
pub(super) struct Laws {
    straight: Vec<Rc<Law<8, 10>>>,
    rotor: Vec<Rc<Law<12, 14>>>,
    smooth: Vec<Rc<Law<16, 18>>>,
}

impl Laws {
    /// Forgets all of them: another plant.
    pub(super) fn clear(&mut self) {
        self.straight.clear();
        self.rotor.clear();
        self.smooth.clear();
    }
}

/// Runs the experiment with the laws of this plant that are known so far.
pub(super) fn run(plant: &Plant, experiment: &Experiment, source: Source, laws: &mut Laws, output: Output) -> Outcome {
    let plant = &*plant.seen_from(experiment.initial.cart_position);
    // Eight moving quantities (three positions, three speeds, current, input) serve straight inputs; smooth ones carry
    // their derivatives along.
    // A rotor that turns by itself adds two.
    match (source.degree() <= 1, plant.has_rotor()) {
        (true, false) => Run::new(plant, experiment, &mut laws.straight, output.within()).finish(source),
        (true, true) => Run::new(plant, experiment, &mut laws.rotor, output.within()).finish(source),
        (false, _) => Run::new(plant, experiment, &mut laws.smooth, output.within()).finish(source),
    }
}

/// A run under way.
struct Run<'a, const R: usize, const C: usize> {
    plant: &'a Plant,
    coordinates: Coordinates,
    grid: Grid,
    /// Output interval.
    h: f64,
    /// State in the solver's coordinates, input and its derivatives, and a one.
    z: [f64; C],
    mode: Mode,
    law: Rc<Law<R, C>>,
    laws: &'a mut Vec<Rc<Law<R, C>>>,
    /// Matrices that were there before.
    shared: u64,
    /// How many leading Taylor coefficients of a sliding body's speed are zero by definition, because it starts from rest:
    /// 1 where it is accelerated, 2 where the load has only just reached its friction. The same for all else that is watched.
    fresh: [usize; Cause::KINDS],
    /// By how much the load on a stuck body may pass its breakaway before it counts: what rounding can do to the load.
    /// Without it a body that comes to rest just at its limit would chatter on the last bit. The same for all else that is
    /// watched where it is zero but for rounding, and would count as wrong in either state.
    slack: [f64; Cause::KINDS],
    /// Whether the input has changed, and what rounding does to the loads on stuck bodies is to be looked at anew.
    at_edge: bool,
    /// Bounds of |u̇| and |ü| on the present piece.
    input_rate: f64,
    input_curvature: f64,
    /// Where the run stands: so far behind row `row`.
    row: u64,
    offset: f64,
    recorder: Recorder<'a>,
    watching: Watching,
    events: Vec<Event>,
    /// Where the last mode change was, and how many there have been there.
    changed_at: (u64, f64),
    changes: usize,
    cost: Cost,
    rounding: Rounding,
    /// Intervals crossed or halved, and how fast the run gets on by them.
    questions: u64,
    pace: Pace,
    trouble: Option<Ending>,
}

/// What a look at an interval tells.
enum Look<const C: usize> {
    /// No guard falls; here is the end, if it was computed.
    Safe(Option<[f64; C]>),
    /// Look closer.
    Unsure,
}

impl<'a, const R: usize, const C: usize> Run<'a, R, C> {
    fn new(plant: &'a Plant, experiment: &Experiment, laws: &'a mut Vec<Rc<Law<R, C>>>, output: Output<'a>) -> Self {
        let grid = Grid::new(experiment.every, experiment.until);
        let h = grid.interval();
        let start = experiment.initial.state(plant);
        let (mut coordinates, inner) = Coordinates::new(plant, &start);
        let mut z = [0.0; C];
        z[..states::<R>()].copy_from_slice(&inner[..states::<R>()]);
        z[C - 1] = 1.0;
        let mode = plant.first_mode(&start);
        coordinates.hold(&mode, &inner);
        let shared = propagators(laws);
        let (law, is_new) = Law::of(laws, plant, mode, h);
        Self {
            plant,
            coordinates,
            grid,
            h,
            z,
            mode,
            laws,
            shared,
            law,
            fresh: [0; Cause::KINDS],
            slack: [0.0; Cause::KINDS],
            at_edge: true,
            input_rate: 0.0,
            input_curvature: 0.0,
            row: 0,
            offset: 0.0,
            recorder: Recorder::new(plant, grid, output),
            watching: Watching::new(),
            events: Vec::new(),
            changed_at: (0, 0.0),
            changes: 0,
            cost: Cost { modes: u64::from(is_new), ..Cost::default() },
            rounding: Rounding::default(),
            questions: 0,
            pace: Pace::default(),
            trouble: None,
        }
    }

    /// The recipe: piece by piece of the input, to the end.
    fn finish(mut self, mut source: Source) -> Outcome {
        let end = self.grid.end();
        let mut time = 0.0;
        while self.trouble.is_none() {
            let piece = match &mut source {
                Source::Signal(signal) => signal.piece(time),
                Source::Decided(decide) => {
                    let current = self.value(&self.plant.current(&self.mode));
                    let (value, until) = decide.decide(time, &self.state(), current);
                    held(value, time, until)
                }
            };
            self.set_input(&piece);
            self.resolve();
            self.jumped();
            if time >= end {
                // Behind a last, shorter interval it stands at the last row, too.
                (self.row, self.offset) = (self.grid.intervals(), 0.0);
                self.put_out();
                break;
            }
            let (row, offset) = self.locate(piece.end.min(end));
            self.reach(row, offset);
            time = piece.end.min(end);
        }
        self.end_shown();
        self.recorder.finish();
        self.cost.samples = self.recorder.rows;
        let ending = match (self.trouble, self.recorder.flow) {
            (Some(trouble), _) => trouble,
            (None, Flow::Stop) => Ending::Interrupted { time: self.time() },
            (None, Flow::Continue) => Ending::Complete,
        };
        self.cost.propagators = propagators(self.laws) - self.shared;
        self.rounding.swing(self.law.swing, self.time());
        let steps = self.cost.steps + self.cost.series;
        let error = Some(self.rounding.bound(steps, self.time(), self.coordinates.origin()));
        Outcome { events: self.events, ending, cost: self.cost, error }
    }

    fn time(&self) -> f64 {
        self.grid.time(self.row) + self.offset
    }

    /// The row at or before `time` and how far behind it; next to a row means on it.
    fn locate(&self, time: f64) -> (u64, f64) {
        let last = self.grid.even();
        let mut row = ((time / self.h) as u64).min(last);
        while row > 0 && self.grid.time(row) > time {
            row -= 1;
        }
        while row < last && self.grid.time(row + 1) <= time {
            row += 1;
        }
        let offset = time - self.grid.time(row);
        // What a sum of decimal times may be off by; no part of the interval, which may be long.
        let near = (8.0 * f64::EPSILON * time).min(1e-9 * self.h);
        // The last interval may be shorter: what is left of the run behind the last row at this distance.
        let length = if row < last { self.h } else { self.grid.rest() };
        match (row < last, length - offset <= near) {
            _ if offset <= near => (row, 0.0),
            (true, true) => (row + 1, 0.0),
            (false, true) => (row, length),
            (_, false) => {
                // Halves, quarters and eighths of the interval, for which there are matrices, are hit to the last bit.
                let eighth = 0.125 * self.h;
                let snapped = (offset / eighth).round() * eighth;
                (row, if (offset - snapped).abs() <= near { snapped } else { offset })
            }
        }
    }

    fn set_input(&mut self, piece: &Piece) {
        self.cost.pieces += 1;
        self.fresh = [0; Cause::KINDS];
        self.at_edge = true;
        self.take_up(piece);
    }

    /// Puts the input's value and derivatives where the state has them.
    fn take_up(&mut self, piece: &Piece) {
        if piece.coefficients[1..].iter().all(|&c| c == 0.0) {
            (0..=highest::<R>()).for_each(|k| self.z[chain::<R>(k)] = 0.0);
            self.z[chain::<R>(0)] = piece.coefficients[0];
            (self.input_rate, self.input_curvature) = (0.0, 0.0);
            return;
        }
        let length = if piece.end.is_finite() { piece.end - piece.start } else { 0.0 };
        let (mut factorial, mut rate, mut curvature) = (1.0, 0.0, 0.0);
        let (mut power1, mut power2) = (1.0, 1.0);
        for (k, &c) in piece.coefficients.iter().enumerate() {
            let order = k as f64;
            if k >= 1 {
                factorial *= order;
                rate += order * c.abs() * power1;
                power1 *= length;
            }
            if k >= 2 {
                curvature += order * (order - 1.0) * c.abs() * power2;
                power2 *= length;
            }
            if k <= highest::<R>() {
                // u⁽ᵏ⁾ = k! c_k
                self.z[chain::<R>(k)] = c * factorial;
            }
        }
        self.input_rate = rate;
        self.input_curvature = curvature;
    }

    /// Advances to `offset` behind row `row`, event by event.
    fn reach(&mut self, row: u64, offset: f64) {
        while (self.row < row || (self.row == row && self.offset < offset)) && self.trouble.is_none() {
            self.check();
            if self.offset == 0.0 {
                self.put_out();
                if self.row < row && self.hop(row - self.row) {
                    continue;
                }
            }
            let ahead = if self.row < row { self.h } else { offset };
            match self.advance_shown(ahead - self.offset) {
                Some(cause) => {
                    self.change(cause);
                    self.resolve();
                    self.jumped();
                }
                None if self.row < row => {
                    self.row += 1;
                    self.offset = 0.0;
                }
                None => self.offset = offset,
            }
        }
    }

    /// Puts out the present row, once, and looks whether all is well.
    fn put_out(&mut self) {
        self.check();
        if self.recorder.next_row() == self.row && self.trouble.is_none() {
            let inner = self.inner();
            self.rounding.see(self.plant.stage().pulley_radius, &inner);
            self.recorder.push(Row::new(&self.coordinates, &inner, self.input()), self.mode);
        }
        if self.recorder.flow == Flow::Stop {
            self.trouble = Some(Ending::Interrupted { time: self.time() });
        }
    }

    /// Notices a state that is no number any more.
    fn check(&mut self) {
        if !self.z.iter().sum::<f64>().is_finite() {
            self.trouble = Some(Ending::Diverged { time: self.time() });
        }
    }

    /// Moves as many whole intervals, up to `most`, as no guard can fall on; false if not even one.
    fn hop(&mut self, most: u64) -> bool {
        let law = Rc::clone(&self.law);
        let y = law.rate(&self.z);
        let mut safe = most;
        if !law.guards.is_empty() {
            self.cost.looks += 1;
            let size = law.size(&y);
            let push = law.forcing * self.input_rate * 0.5;
            let mut time = f64::INFINITY;
            for guard in &law.guards {
                // g(τ) ≥ g − (|w| √2V + |w_u| |u̇|) τ − |w| |b| |u̇| τ²/2
                let g = self.standing(guard);
                let grow = law.growth_factor();
                let slope = grow * law.steepness(guard, size, 0.0) + guard.input.abs() * self.input_rate;
                let bend = grow * law.steepness(guard, Size::ZERO, push);
                let moves = slope > 0.0 || bend > 0.0;
                if g < 0.0 || (g == 0.0 && moves) || self.fresh_order(guard.cause) > 0 {
                    time = 0.0;
                } else if moves {
                    time = f64::min(time, 2.0 * g / (slope + (slope * slope + 4.0 * bend * g).sqrt()));
                }
            }
            time = time.min(law.growth_time());
            // A float that is too large becomes the largest integer.
            safe = safe.min((time / self.h * 0.999) as u64);
        }
        if safe == 0 {
            return false;
        }
        let resting = y.iter().all(|&rate| rate == 0.0);
        let mut bow = self.is_observed().then(|| self.bow(&law, self.h, safe as f64 * self.h));
        if let (true, Some(bow)) = (resting, &bow) {
            let (begin, z) = (self.time(), self.z);
            self.move_shown(&law, begin, safe as f64 * self.h, z, bow);
        }
        if resting && self.recorder.detail == Detail::None {
            self.recorder.skip(safe - 1);
            self.row += safe;
            return true;
        }
        let step = law.step(0);
        let mut closer = 0;
        for j in 0..safe {
            if j > 0 {
                self.put_out();
                if self.trouble.is_some() {
                    return true;
                }
            }
            match &mut bow {
                _ if resting => {}
                Some(bow) => {
                    let mut end = self.z;
                    step.advance(&mut end);
                    closer += usize::from(self.move_shown(&law, self.grid.time(self.row), self.h, end, bow));
                    if closer == OFTEN {
                        // What swings has died down since.
                        closer = 0;
                        *bow = self.bow(&law, self.h, (safe - j) as f64 * self.h);
                    }
                }
                None => step.advance(&mut self.z),
            }
            self.row += 1;
        }
        self.cost.steps += if resting { 0 } else { safe };
        true
    }

    /// Value of a guard, with what rounding alone may have made negative forgiven.
    fn standing(&self, guard: &Watch<C>) -> f64 {
        guard.standing(&self.z)
            + match guard.cause {
                Cause::Stop(_) => 0.0,
                cause => self.slack[cause.kind()],
            }
    }

    fn fresh_order(&self, cause: Cause) -> usize {
        match cause {
            Cause::BreakForward(_) | Cause::BreakBackward(_) => 0,
            cause => self.fresh[cause.kind()],
        }
    }

    /// The same as [`Run::advance`], and shows the way to whoever observes.
    fn advance_shown(&mut self, distance: f64) -> Option<Cause> {
        if !self.is_observed() {
            return self.advance(distance);
        }
        let (law, before, begin, offset) = (Rc::clone(&self.law), self.z, self.time(), self.offset);
        let cause = self.advance(distance);
        let (after, length) = (self.z, self.offset - offset);
        self.z = before;
        let bow = self.bow(&law, length, length);
        self.move_shown(&law, begin, length, after, &bow);
        cause
    }

    /// Advances by `distance`, at most an interval; stops at the first guard that falls and says why.
    fn advance(&mut self, mut distance: f64) -> Option<Cause> {
        let law = Rc::clone(&self.law);
        if self.fresh != [0; Cause::KINDS] && distance > 0.0 {
            // A speed that starts from zero is told apart from one that falls to zero by its series.
            let first = distance.min(law.reach());
            if let Some(cause) = self.creep(&law, first) {
                return Some(cause);
            }
            distance -= first;
        }
        for level in 0..=law.finest {
            while distance >= law.length(level) && self.trouble.is_none() {
                if let Some(cause) = self.cross(&law, level) {
                    return Some(cause);
                }
                distance -= law.length(level);
            }
        }
        if distance > 0.0 { self.creep(&law, distance) } else { None }
    }

    /// Crosses an interval of h/2^level.
    fn cross(&mut self, law: &Law<R, C>, level: usize) -> Option<Cause> {
        if !self.goes_on() {
            return None;
        }
        let length = law.length(level);
        match self.look(law, length, Some(level)) {
            Look::Safe(end) => {
                match end {
                    Some(end) => self.z = end,
                    None => law.step(level).advance(&mut self.z),
                }
                self.cost.steps += 1;
                self.offset += length;
                None
            }
            Look::Unsure if level < law.finest => self.cross(law, level + 1).or_else(|| self.cross(law, level + 1)),
            Look::Unsure => self.creep(law, length),
        }
    }

    /// Asks now and then whether to go on, and whether this leads anywhere; false if not.
    fn goes_on(&mut self) -> bool {
        self.questions += 1;
        if self.questions.is_multiple_of(STEPS_BETWEEN_QUESTIONS) && self.trouble.is_none() {
            self.recorder.ask();
            if self.recorder.flow == Flow::Stop {
                self.trouble = Some(Ending::Interrupted { time: self.time() });
            } else {
                self.trouble = self.pace.too_stiff(self.questions, self.time(), self.grid.end());
            }
        }
        self.trouble.is_none()
    }

    /// Decides, if it can, that no guard falls within `length`.
    fn look(&mut self, law: &Law<R, C>, length: f64, level: Option<usize>) -> Look<C> {
        if law.guards.is_empty() {
            return Look::Safe(None);
        }
        self.cost.looks += 1;
        let y = law.rate(&self.z);
        let grow = law.growth_over(length);
        let (size, push) = (law.size(&y), law.forcing * self.input_rate * length);
        let steepness =
            |guard: &Watch<C>| grow * law.steepness(guard, size, push) + guard.input.abs() * self.input_rate;
        let undecided = |g: f64, steepness: f64| !(g > steepness * length || (g >= 0.0 && steepness == 0.0));
        if !law.guards.iter().any(|guard| undecided(self.standing(guard), steepness(guard))) {
            return Look::Safe(None);
        }

        let second = law.rate_of_rate(&y);
        let (size, push) = (law.size(&second), law.forcing * self.input_curvature * length);
        let mut falling = false;
        for guard in &law.guards {
            let g = self.standing(guard);
            if !undecided(g, steepness(guard)) {
                continue;
            }
            let slope = guard.slope(&y);
            let bend = grow * law.steepness(guard, size, push) + guard.input.abs() * self.input_curvature;
            // g(τ) ≥ g + ġ τ − |g̈| τ²/2
            let stays = g >= 0.0 && g + slope.min(0.0) * length - 0.5 * bend * length * length > 0.0;
            let rises = g >= 0.0 && slope > bend * length;
            let falls = g > 0.0 && slope < -bend * length;
            match (stays || rises, falls) {
                (true, _) => {}
                (false, true) => falling = true,
                (false, false) => return Look::Unsure,
            }
        }
        let Some(level) = level.filter(|_| falling) else { return Look::Safe(None) };
        // What falls all the way has not fallen through if it is still positive at the end.
        let mut end = self.z;
        law.step(level).advance(&mut end);
        if law.guards.iter().all(|guard| guard.value(&end) > 0.0) { Look::Safe(Some(end)) } else { Look::Unsure }
    }

    /// Advances by a `distance` within the reach of the Taylor series, to the first guard that falls.
    fn creep(&mut self, law: &Law<R, C>, distance: f64) -> Option<Cause> {
        self.cost.series += 1;
        let series = law.series(&self.z, distance);
        let mut sizes = None;
        let mut first: Option<(f64, Cause)> = None;
        // Term 1 of the series is ż · distance: most guards are too far away to fall, as in `look`.
        let change = std::array::from_fn(|j| series[1][j]);
        let (size, push) = (law.size(&change), law.forcing * self.input_rate * distance * distance);
        let grow = law.growth_over(distance);
        for guard in &law.guards {
            let fall = grow * law.steepness(guard, size, push) + guard.input.abs() * self.input_rate * distance;
            if self.standing(guard) > fall {
                continue;
            }
            let mut coefficients: [f64; SERIES_ORDER + 1] = std::array::from_fn(|k| guard.value(&series[k]));
            coefficients[0] = self.standing(guard);
            let mut order = self.fresh_order(guard.cause);
            if order > 0 || coefficients[0] == 0.0 {
                let sizes = sizes.get_or_insert_with(|| law.sizes(&self.z, distance));
                order = guard.first_term(&coefficients, sizes, order.max(1));
            }
            let sooner = |s: f64| {
                first.is_none_or(|(earliest, cause)| {
                    s < earliest || (s == earliest && guard.cause.rank() < cause.rank())
                })
            };
            if let Some(s) = roots::first_fall(&coefficients[order..])
                && sooner(s)
            {
                first = Some((s, guard.cause));
            }
        }
        let s = first.map_or(1.0, |(s, _)| s);
        for j in 0..R {
            let change = series[1..].iter().rev().fold(0.0, |sum, term| (sum + term[j]) * s);
            self.z[j] += change;
        }
        self.offset += s * distance;
        if s * distance > SOON * law.reach() {
            self.fresh = [0; Cause::KINDS];
        }
        first.map(|(_, cause)| cause)
    }

    /// The state in the solver's coordinates.
    fn inner(&self) -> State {
        inner_of::<R, C>(self.plant, &self.z)
    }

    fn state(&self) -> State {
        self.coordinates.state(&self.inner())
    }

    fn input(&self) -> f64 {
        self.z[chain::<R>(0)]
    }

    /// What rounding may have done to the value of a form.
    fn noise(&self, form: &Form) -> f64 {
        form.noise(&self.inner(), self.input())
    }

    fn value(&self, form: &Form) -> f64 {
        let inner = self.inner();
        form.value_at(&stretches(&inner), &inner, self.input())
    }
}

/// The state in the solver's coordinates that `z` stands for.
fn inner_of<const R: usize, const C: usize>(plant: &Plant, z: &[f64; C]) -> State {
    let mut inner: State = std::array::from_fn(|j| if j < states::<R>() { z[j] } else { 0.0 });
    if states::<R>() < place::COUNT || !plant.has_rotor() {
        // The rotor turns with the drive pulley.
        (inner[place::ROTOR_ANGLE], inner[place::ROTOR_SPEED]) = (0.0, z[place::DRIVE_SPEED]);
    }
    inner
}

/// Matrices computed so far.
fn propagators<const R: usize, const C: usize>(laws: &[Rc<Law<R, C>>]) -> u64 {
    laws.iter().map(|law| law.propagators()).sum()
}
