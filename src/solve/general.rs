//! The general solver: any friction law, and spans that follow the cart.
//!
//! Between mode changes and edges of the input the equations are smooth, and an adaptive formula of order eight (Dormand and
//! Prince's DOP853, from a library) integrates them. The modes and their guards are those of the exact solver. Each
//! step's dense output is a polynomial, and so are the guards along it: their first fall is searched for as the exact solver does, so
//! that two crossings within a step are seen; the step is then taken again up to the event.

mod fall;
mod model;
mod shown;
mod stretch;

use super::coordinates::Coordinates;
use super::observe::Output;
use super::pace::{Pace, STEPS_BETWEEN_QUESTIONS};
use super::record::{Recorder, Row};
use super::{Cost, Ending, Event, Flow, Grid, Outcome, Source, check, held};
use crate::case::Experiment;
use crate::error::{Error, Result};
use crate::friction::{Law, Motion};
use crate::plant::{Body, Cause, Limit, Mode, Part, Plant, State, Status, Switch, place};
use crate::stage::AmplifierMode;
use fall::NODES;
use ivp::dense::StepInterpolant;
use ivp::methods::{DOP853, Tolerance};
use ivp::prelude::FirstOrderSystem;
use ivp::solout::{ControlFlag, SolOut};
use model::{Field, MOST, Model, Vector};
use stretch::Stretch;

/// Events allowed at once, and per simulated second: more is an accumulation, not a machine.
const EVENTS_AT_LEAST: f64 = 1e5;
const EVENTS_PER_SECOND: f64 = 1e7;

/// Mode changes allowed at one instant.
const CHANGES_AT_ONCE: usize = 100;

/// Turns of a body at one instant after which it is taken to rest.
const TURNS_AT_ONCE: usize = 20;

/// Most steps of a run, by what is known beforehand of its fastest rate.
const MOST_STEPS: f64 = 1e10;

/// Runs the experiment; `tolerance` is the error allowed in each step, relative and, of small quantities, absolute.
pub(super) fn run(
    plant: &Plant,
    experiment: &Experiment,
    source: Source,
    tolerance: f64,
    output: Output,
) -> Result<Outcome> {
    if !(1e-14..=1e-2).contains(&tolerance) {
        return Err(Error::new(format!("a tolerance of {tolerance:e} is of no use"))
            .allowed("from 1e-14 to 0.01")
            .next("take 1e-9, the default"));
    }
    let fastest = check::fastest_rate(plant.stage());
    let steps = fastest * experiment.until / REACH;
    if steps > MOST_STEPS {
        return Err(Error::new(format!(
            "the general solver would need some {steps:.0e} steps: something here changes within {:.0e} s",
            1.0 / fastest
        ))
        .allowed(format!("up to {MOST_STEPS:e} steps"))
        .next("leave out the inductance, the damping or the friction that is as fast as that, or shorten the run"));
    }
    let start = experiment.initial.state(plant);
    let (coordinates, inner) = Coordinates::new(plant, &start);
    let plant = &*plant.seen_from(coordinates.origin());
    let model = Model::new(plant, coordinates.origin());
    let mode = plant.first_mode(&start);
    let start = (coordinates, inner, mode);
    Ok(Run::new(&model, start, experiment, tolerance, FIRST / fastest, output.within()).finish(source))
}

/// h·|λ| up to which the formula is stable.
const REACH: f64 = 6.0;

/// h·|λ| of the first step after an event or an edge.
const FIRST: f64 = 0.3;

/// A run under way.
struct Run<'a> {
    model: &'a Model<'a>,
    coordinates: Coordinates,
    grid: Grid,
    recorder: Recorder<'a>,
    solver: DOP853,
    /// The step to begin with after an event or an edge, s.
    first_step: f64,
    relative: f64,
    absolute: Vector,
    y: Vector,
    mode: Mode,
    /// Where the run stands, counted from the beginning of the present stretch, s.
    tau: f64,
    /// By how much the load on a stuck body may pass its limit before it counts, and for a moment after it has changed what any
    /// other part is watched by.
    slack: [f64; Cause::KINDS],
    /// The same for a gear's torque.
    torque_slack: f64,
    /// The largest torque that the gear has carried, N m at the motor's shaft.
    torque: f64,
    changed_at: f64,
    changes: usize,
    pace: Pace,
    events: Vec<Event>,
    modes: Vec<Mode>,
    shown: Option<shown::Shown>,
    cost: Cost,
    trouble: Option<Ending>,
}

/// A guard that fell.
struct Hit {
    tau: f64,
    y: Vector,
    cause: Cause,
}

impl<'a> Run<'a> {
    fn new(
        model: &'a Model<'a>,
        (mut coordinates, start, mode): (Coordinates, State, Mode),
        experiment: &Experiment,
        tolerance: f64,
        first_step: f64,
        output: Output<'a>,
    ) -> Self {
        let plant = model.plant;
        let grid = Grid::new(experiment.every, experiment.until);
        coordinates.hold(&mode, &start);
        let mut y = [0.0; MOST];
        y[..place::CURRENT].copy_from_slice(&start[..place::CURRENT]);
        if let Some(current) = model.current {
            y[current] = start[place::CURRENT];
        }
        if let Some(rotor) = model.rotor {
            y[rotor..rotor + 2].copy_from_slice(&start[place::ROTOR_ANGLE..=place::ROTOR_SPEED]);
        }
        // An angle of 1 rad is as much as r at the belt.
        let r = plant.stage().pulley_radius;
        let mut absolute = [tolerance; MOST];
        for place in [place::DRIVE_ANGLE, place::CART_POSITION, place::CART_SPEED, place::IDLER_ANGLE] {
            absolute[place] *= r;
        }
        for body in Body::ALL {
            let friction = plant.friction(body);
            if let (Some(place), Law::LuGre { stiffness, .. }) = (model.bristle[body.index()], friction.law) {
                // Bristles bend by F_b/σ₀ at most.
                absolute[place] = tolerance * friction.forward.breakaway.max(friction.backward.breakaway) / stiffness;
            }
        }
        Self {
            model,
            coordinates,
            grid,
            recorder: Recorder::new(plant, grid, output),
            // It is stopped from outside: by its observer.
            solver: DOP853 {
                max_steps: usize::MAX - 1,
                stiff_test: usize::MAX,
                first_step: Some(first_step),
                ..DOP853::default()
            },
            first_step,
            relative: tolerance,
            absolute,
            y,
            mode,
            tau: 0.0,
            slack: [0.0; Cause::KINDS],
            torque_slack: 0.0,
            torque: 0.0,
            changed_at: f64::NEG_INFINITY,
            changes: 0,
            pace: Pace::default(),
            events: Vec::new(),
            modes: vec![mode],
            shown: None,
            cost: Cost::default(),
            trouble: None,
        }
    }

    /// The recipe: from edge to edge of the input, event by event, to the end.
    fn finish(mut self, mut source: Source) -> Outcome {
        let end = self.grid.end();
        let mut time = 0.0;
        let mut stretch = self.stretch(&mut source, time, 0.0);
        loop {
            self.cost.pieces += stretch.pieces() as u64;
            self.tau = 0.0;
            self.resolve(&stretch);
            if self.trouble.is_none() && time >= end {
                let field = Field::new(self.model, self.mode, &stretch);
                let y = self.y;
                self.put_out(&field, 0.0, &y);
            }
            if self.trouble.is_some() || time >= end {
                break;
            }
            self.reach(&stretch);
            time = stretch.begin + self.tau;
            if self.trouble.is_some() {
                break;
            }
            time = stretch.end;
            let next = self.stretch(&mut source, time, stretch.input(stretch.length()));
            if !next.continues(&stretch) {
                self.solver.first_step = Some(self.first_step);
            }
            stretch = next;
        }
        self.end_shown(&stretch);
        self.recorder.finish();
        self.cost.samples = self.recorder.rows;
        self.cost.modes = self.modes.len() as u64;
        let ending = match (self.trouble, self.recorder.flow) {
            (Some(trouble), _) => trouble,
            (None, Flow::Stop) => Ending::Interrupted { time },
            (None, Flow::Continue) => Ending::Complete,
        };
        Outcome { events: self.events, ending, cost: self.cost, error: None }
    }

    /// What the input does from `time` on, having been `before`.
    fn stretch(&self, source: &mut Source, time: f64, before: f64) -> Stretch {
        let end = self.grid.end();
        match source {
            Source::Signal(signal) => Stretch::new(signal, time, end),
            Source::Decided(decide) => {
                let inner = self.model.inner(&self.y);
                let current = self.model.value(&self.model.plant.current(&self.mode), &inner, before);
                let (value, until) = decide.decide(time, &self.coordinates.state(&inner), current);
                Stretch::of(held(value, time, until), end)
            }
        }
    }

    /// Advances to the end of the stretch, event by event.
    fn reach(&mut self, stretch: &Stretch) {
        while self.tau < stretch.length() && self.trouble.is_none() {
            let Some(hit) = self.integrate(stretch) else { continue };
            self.y = hit.y;
            self.tau = hit.tau;
            self.solver.first_step = Some(self.first_step);
            self.change(hit.cause, stretch);
            self.resolve(stretch);
        }
    }

    /// Integrates to the end of the stretch, or to the first guard that falls.
    fn integrate(&mut self, stretch: &Stretch) -> Option<Hit> {
        let field = Field::new(self.model, self.mode, stretch);
        let length = stretch.length();
        if length - self.tau <= 64.0 * f64::EPSILON * length {
            // What is left is no step, but rounding.
            self.tau = length;
            return None;
        }
        let mut solver = DOP853 { max_step: Some(stretch.longest_step()), ..self.solver.clone() };
        solver.first_step = solver.first_step.map(|step| step.min(length - self.tau));
        let (relative, absolute, y) = (self.relative(), self.absolute(), self.y);
        let (from, size) = (self.tau, self.model.size);
        let mut observer = Observer { watches: field.watches(), run: self, field: &field, hit: None };
        let result = solver.solve(&field, from, &y[..size], length, relative, absolute, Some(&mut observer));
        let hit = observer.hit;
        self.cost.evaluations += field.evaluations();
        match result {
            Ok(result) if result.is_ok() && hit.is_none() && self.trouble.is_none() => {
                self.tau = length;
                self.solver.first_step = Some(result.h.abs().max(self.first_step));
            }
            Ok(result) if result.is_ok() => {}
            // Not even the smallest step will do: this is no motion any more.
            _ => self.trouble = Some(Ending::Diverged { time: stretch.begin + self.tau }),
        }
        hit
    }

    fn relative(&self) -> Tolerance {
        Tolerance::Scalar(self.relative)
    }

    fn absolute(&self) -> Tolerance {
        Tolerance::Vector(self.absolute[..self.model.size].to_vec())
    }

    /// Puts out the row that is at `tau`.
    fn put_out(&mut self, field: &Field, tau: f64, y: &Vector) {
        let inner = self.model.inner(y);
        let row = Row::new(&self.coordinates, &inner, field.input(tau));
        if self.model.adds {
            let (extra, _) = self.model.extra(&self.mode.motion, &inner, y);
            self.recorder.push_with(row, self.mode, extra);
        } else {
            self.recorder.push(row, self.mode);
        }
    }

    /// What a body at zero speed does under its present load.
    fn decide(&self, body: Body, input: f64) -> Motion {
        let (model, state) = (self.model, self.model.inner(&self.y));
        let (mode, noise) = (&self.mode, model.noise(body, &self.mode, &state, input));
        if model.load(body, true, mode, &state, input) > model.breakaway(body, true, &state) + noise {
            Motion::Forward
        } else if model.load(body, false, mode, &state, input) < -model.breakaway(body, false, &state) - noise {
            Motion::Backward
        } else {
            Motion::Stuck
        }
    }

    /// Goes into the mode that follows when `cause` ends the present one.
    fn change(&mut self, cause: Cause, stretch: &Stretch) {
        let time = stretch.begin + self.tau;
        let at_once = time - self.changed_at <= 1e-15 + 4.0 * f64::EPSILON * time;
        self.changes = if at_once { self.changes + 1 } else { 0 };
        self.changed_at = time;
        if self.changes > CHANGES_AT_ONCE {
            self.trouble = Some(Ending::TooManyEvents { time });
        }
        let again = self.changes > TURNS_AT_ONCE;
        let input = stretch.input(self.tau);
        let by_rounding = self.is_by_tolerance(cause, stretch);
        let (body, to) = match cause {
            Cause::GearTorque => {
                self.mode.gear_torque_positive = !self.mode.gear_torque_positive;
                // Where rounding calls it negative either way it is zero.
                self.torque_slack = if again { f64::INFINITY } else { self.relative * self.torque };
                self.enter();
                return;
            }
            Cause::Switch(switch) => {
                self.switch(switch, stretch);
                return;
            }
            Cause::LeaveTravel => {
                self.trouble = Some(Ending::LeftTravel { time });
                return;
            }
            Cause::Stop(body) => {
                for follower in self.model.plant.followers(body) {
                    self.y[follower.speed_place()] = 0.0;
                }
                (body, if again { Motion::Stuck } else { self.decide(body, input) })
            }
            Cause::BreakForward(body) => (body, Motion::Forward),
            Cause::BreakBackward(body) => (body, Motion::Backward),
        };
        let (index, state) = (body.index(), self.model.inner(&self.y));
        let from = self.mode.motion[index];
        let side = if to == Motion::Stuck { from } else { to };
        let forward = side != Motion::Backward;
        let load = self.model.load(body, forward, &self.mode, &state, input);
        for (cause, tolerance) in self.tolerances_at_rest(body, input) {
            self.slack[cause.kind()] = if again { 10.0 } else { 1.0 } * tolerance;
        }
        for follower in self.model.plant.followers(body) {
            self.mode.motion[follower.index()] = to;
        }
        let (part, from, to) = (Part::Body(body), Status::Motion(from), Status::Motion(to));
        Event { time, part, from, to, load, by_rounding }.note(&mut self.events);
        self.enter();
    }

    /// By how much the load on a body at rest may pass its breakaway on either side before it counts: what rounding may do to it.
    fn tolerances_at_rest(&self, body: Body, input: f64) -> [(Cause, f64); 2] {
        let inner = self.model.inner(&self.y);
        let noise = 2.0 * self.model.noise(body, &self.mode, &inner, input);
        [(Cause::BreakForward(body), true), (Cause::BreakBackward(body), false)]
            .map(|(cause, forward)| (cause, noise.max(1e-12 * self.model.breakaway(body, forward, &inner))))
    }

    /// Whether a body stops where the tolerance decides: what still slows it down is less than the formula may be off by.
    fn is_by_tolerance(&self, cause: Cause, stretch: &Stretch) -> bool {
        let Cause::Stop(body) = cause else { return false };
        let field = Field::new(self.model, self.mode, stretch);
        let mut rate = [0.0; MOST];
        field.derivative(self.tau, &self.y, &mut rate[..self.model.size]);
        let place = body.speed_place();
        // Within the time in which the fastest of it changes.
        rate[place].abs() * self.first_step / FIRST <= self.absolute[place]
    }

    /// Lets a part other than a body do something else.
    fn switch(&mut self, switch: Switch, stretch: &Stretch) {
        let time = stretch.begin + self.tau;
        let from = self.mode.status(switch.part());
        self.mode.switch(switch);
        let to = self.mode.status(switch.part());
        Event { time, part: switch.part(), from, to, load: 0.0, by_rounding: false }.note(&mut self.events);
        let amplifier = &self.model.plant.stage().amplifier;
        if let (Switch::Current(side), Some(place), AmplifierMode::Voltage) =
            (switch, self.model.current, amplifier.mode)
            && side != Limit::Inside
        {
            // It stands at its limit, to the last bit.
            self.y[place] = side.sign() * amplifier.current_limit.unwrap_or(0.0);
        }
        self.enter();
        // What has just become a condition on this part is zero but for what the integrator may be off by.
        let field = Field::new(self.model, self.mode, stretch);
        let guards = field.guards(self.tau, &self.y);
        for (index, cause) in field.watches().into_iter().enumerate() {
            if cause.is_of_same_part(Cause::Switch(switch)) {
                let error = self.relative * field.size(index, self.tau, &self.y);
                let error = if self.changes > TURNS_AT_ONCE { 10.0 * error } else { error };
                let zero = guards[index].abs() <= 4.0 * error;
                self.slack[cause.kind()] = if zero { f64::max(-guards[index], 0.0) + error } else { 0.0 };
            }
        }
    }

    fn enter(&mut self) {
        self.coordinates.hold(&self.mode, &self.model.inner(&self.y));
        if !self.modes.contains(&self.mode) {
            self.modes.push(self.mode);
        }
    }

    /// Changes modes, without time passing, until every load that is held can be.
    fn resolve(&mut self, stretch: &Stretch) {
        let time = stretch.begin + self.tau;
        if self.tau == 0.0 {
            // After an edge of the input too, a load that passes a breakaway by rounding alone does not break it.
            let plant = self.model.plant;
            for body in plant.leaders().filter(|body| self.mode.motion[body.index()] == Motion::Stuck) {
                for (cause, tolerance) in self.tolerances_at_rest(body, stretch.input(0.0)) {
                    let own = &mut self.slack[cause.kind()];
                    *own = own.max(tolerance);
                }
            }
        }
        for _ in 0..CHANGES_AT_ONCE {
            let field = Field::new(self.model, self.mode, stretch);
            let guards = field.guards(self.tau, &self.y);
            let falls = |&(cause, value): &(Cause, f64)| match cause {
                // A speed tells by itself, over the next step.
                Cause::Stop(_) => false,
                Cause::GearTorque => value < -self.torque_slack,
                cause => value < -self.slack[cause.kind()],
            };
            let fallen = field.watches().into_iter().zip(guards).filter(falls).min_by_key(|(cause, _)| cause.rank());
            match fallen {
                Some((cause, _)) => {
                    self.change(cause, stretch);
                    if self.trouble.is_some() {
                        return;
                    }
                }
                None => {
                    if self.events.len() as f64 > EVENTS_AT_LEAST + EVENTS_PER_SECOND * time {
                        self.trouble = Some(Ending::TooManyEvents { time });
                    }
                    return;
                }
            }
        }
        self.trouble = Some(Ending::TooManyEvents { time });
    }
}

/// Looks at every step: finds the guard that falls first, and puts out the rows until there.
struct Observer<'r, 'a> {
    run: &'r mut Run<'a>,
    field: &'r Field<'r>,
    watches: Vec<Cause>,
    hit: Option<Hit>,
}

impl SolOut for Observer<'_, '_> {
    fn solout(&mut self, from: f64, to: &mut f64, y: &mut [f64], dense: Option<&StepInterpolant<'_>>) -> ControlFlag {
        let (to, Some(dense)) = (*to, dense) else { return ControlFlag::Continue };
        let size = y.len();
        let mut end = [0.0; MOST];
        end[..size].copy_from_slice(y);
        if !end.iter().sum::<f64>().is_finite() {
            self.run.trouble = Some(Ending::Diverged { time: self.field.stretch.begin + from });
            return ControlFlag::Interrupt;
        }
        self.run.cost.steps += 1;
        if self.run.cost.steps.is_multiple_of(STEPS_BETWEEN_QUESTIONS) {
            self.run.recorder.ask();
            self.run.trouble =
                self.run.pace.too_stiff(self.run.cost.steps, self.field.stretch.begin + to, self.run.grid.end());
        }
        let begin = self.run.y;
        let at = |tau: f64| {
            let mut y = [0.0; MOST];
            dense.interpolate(tau, &mut y[..size]);
            y
        };
        self.hit = self.first_fall(from, to, &begin, &end, &at);
        let until = self.hit.as_ref().map_or(to, |hit| hit.tau);
        self.show(from, until, &begin, &at);
        // A row on an edge or an event shows what comes after it.
        let stretch = self.field.stretch;
        let near = (8.0 * f64::EPSILON * stretch.end).min(1e-9 * self.run.grid.interval());
        let until = if until >= stretch.length() { stretch.length() - near } else { until };
        loop {
            let row = self.run.recorder.next_row();
            let tau = self.run.grid.time(row) - stretch.begin;
            if row > self.run.grid.intervals() || tau >= until {
                break;
            }
            let y = if tau <= from { begin } else { at(tau) };
            self.run.put_out(self.field, tau, &y);
        }
        if self.run.recorder.flow == Flow::Stop {
            self.run.trouble = Some(Ending::Interrupted { time: stretch.begin + to });
        }
        self.run.y = end;
        self.run.tau = to;
        if self.hit.is_some() || self.run.trouble.is_some() { ControlFlag::Interrupt } else { ControlFlag::Continue }
    }
}

impl Observer<'_, '_> {
    /// The first guard to fall between `from` and `to`, and the state there.
    fn first_fall(
        &mut self,
        from: f64,
        to: f64,
        begin: &Vector,
        end: &Vector,
        at: &impl Fn(f64) -> Vector,
    ) -> Option<Hit> {
        if self.watches.is_empty() {
            return None;
        }
        self.run.cost.looks += 1;
        let mut values = [[0.0; NODES]; model::MOST_GUARDS];
        for node in 0..NODES {
            let tau = from + (to - from) * node as f64 / (NODES - 1) as f64;
            let guards = match node {
                0 => self.field.guards(from, begin),
                7 => self.field.guards(to, end),
                _ => self.field.guards(tau, &at(tau)),
            };
            for (values, guard) in values.iter_mut().zip(guards) {
                values[node] = guard;
            }
        }
        if let Some(gear) = self.watches.iter().position(|watch| *watch == Cause::GearTorque) {
            let run = &mut self.run;
            run.torque = values[gear].iter().fold(run.torque, |most, value| most.max(value.abs()));
            // What was told by nothing but rounding is told by the step.
            run.torque_slack = run.relative * run.torque;
        }
        let mut first: Option<(f64, f64, usize, f64)> = None;
        for (index, watch) in self.watches.iter().enumerate() {
            let run = &self.run;
            let slack = match *watch {
                // What the integrator may be off by is no stop, least of all where a body has just begun to slide.
                Cause::Stop(body) => run.absolute[body.speed_place()],
                Cause::GearTorque => run.torque_slack,
                cause => run.slack[cause.kind()],
            };
            if let Some((s, slope)) = fall::first_fall(&values[index].map(|value| value + slack))
                && first.is_none_or(|(earliest, ..)| s < earliest)
            {
                first = Some((s, slope, index, slack));
            }
        }
        if first.is_none() {
            // A part that has clearly left its edge is watched to the last bit again.
            for (index, cause) in self.watches.iter().enumerate() {
                let slack = &mut self.run.slack[cause.kind()];
                if matches!(cause, Cause::Switch(_)) && values[index][NODES - 1] > 10.0 * *slack {
                    *slack = 0.0;
                }
            }
        }
        let (s, slope, index, slack) = first?;
        // A speed that has fallen through is looked for where it was zero.
        let slack = if matches!(self.watches[index], Cause::Stop(_)) { 0.0 } else { slack };
        let mut tau = from + s * (to - from);
        let mut y = self.leap(from, begin, tau);
        // Newton's method along the formula itself, which is more accurate than its dense output.
        for _ in 0..3 {
            let value = self.field.guards(tau, &y)[index] + slack;
            let change = -value * (to - from) / slope;
            if !(slope < 0.0 && change.abs() <= 0.01 * (to - from)) || change.abs() <= 1e-15 + f64::EPSILON * tau {
                break;
            }
            tau = (tau + change).clamp(from, to);
            y = self.leap(from, begin, tau);
        }
        Some(Hit { tau, y, cause: self.watches[index] })
    }

    /// One step of the formula to where it is wanted.
    fn leap(&self, from: f64, begin: &Vector, to: f64) -> Vector {
        if to <= from {
            return *begin;
        }
        let solver = DOP853 { first_step: Some(to - from), dense_output: true, ..self.run.solver.clone() };
        let mut arrival = Arrival(*begin);
        let y = &begin[..self.run.model.size];
        let (relative, absolute) = (self.run.relative(), self.run.absolute());
        let _ = solver.solve(self.field, from, y, to, relative, absolute, Some(&mut arrival));
        arrival.0
    }
}

/// Keeps the state at the end of a step.
struct Arrival(Vector);

impl SolOut for Arrival {
    fn solout(&mut self, _: f64, _: &mut f64, y: &mut [f64], _: Option<&StepInterpolant<'_>>) -> ControlFlag {
        self.0[..y.len()].copy_from_slice(y);
        ControlFlag::Continue
    }
}
