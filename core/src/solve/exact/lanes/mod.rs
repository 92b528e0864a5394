//! Machines side by side: many runs of one structure at once, one in each lane of a vector.
//!
//! A sweep runs thousands of machines that differ in their numbers alone. Here eight of them are stepped together:
//! every number is a row of [`wide::Lanes`], one for each machine, and an operation is one vector instruction. Each
//! lane has its own time, step, mode and machine; one whose run has come to its end takes the next from the queue.
//!
//! A step ([`flight`]) is a Taylor series of [`part::TERMS`] terms over at most h = 1.3/‖A‖. What happens within it
//! follows from its ends:
//!
//! - A guard, or a quantity whose peak is sought, deviates from the cubic of its values and slopes at both ends by at
//!   most 16 R s² (1 − s)², R = h⁴ max|q⁗|/384, and a cubic lies within its control points. The fourth derivative is
//!   bounded by the energy of z⁗ at the beginning, which friction and resistance can only lower (as in [`super`]):
//!   R = √(2V)(h⁴ z⁗/24) |w|/16.
//! - In a lane whose guards are not safe by that, the first fall is found along its series. The machine then passes
//!   through the event by the exact solver's own rules ([`crate::solve::rules`]): events are settled and told there, by
//!   no second text.
//! - A step that may have a peak is kept ([`peak`]). At the end of a run the cubics tell how high the peaks are at
//!   least; the few steps that may be higher are expanded again.
//!
//! Every machine has its state, mode and rules in a [`Core`] of the exact solver, to which its lane returns the state
//! at events and ends. All lanes do the same operations in the same order, without fused products, and none depends on
//! another: the same bits for any vectors, neighbours and order of the queue.
//!
//! Left to the exact solver are machines that [`takes`] refuses, runs of more than [`MOST_STEPS`] steps, runs with a
//! mode in which no spring bounds a quantity that is sought, and states that are no longer finite.

mod flight;
mod law;
mod part;
mod peak;
mod wide;

use super::kernel::Modes;
use super::{Core, ModeMatrices, SOON, Space};
use crate::mechanism::{AmplifierMode, Mechanism};
use crate::plan::Experiment;
use crate::solve::inputs::Pieces;
use crate::solve::observe::{Extremes, NEWS};
use crate::solve::polynomial::Polynomial;
use crate::solve::propagator::SERIES_TERMS;
use crate::solve::{Ending, Grid, Outcome, check, roots};
use flight::{Flight, Moving, Width, numbers};
use law::{Law, Parts, Plan, ReadingSlot, Readings, Rows, Slots, all_slide, reads_alike};
use part::{INNER, Part, TERMS};
use peak::{Later, Start};
use std::cell::RefCell;
use std::sync::Arc;
use wide::LANES;

/// Steps of a run, in all and for each row, beyond which it is left to the exact solver, whose steps are as long as the
/// rows are apart.
const MOST_STEPS: f64 = 20_000.0;
const STEPS_PER_ROW: f64 = 10.0;

/// A machine, and its experiments, each with its observer.
pub struct Job<'a, E> {
    /// Its number, for the receiver.
    pub number: usize,
    /// The mechanism.
    pub mechanism: Arc<Mechanism>,
    /// Its runs.
    pub runs: Vec<(&'a Experiment, E)>,
}

/// The receiver of runs: the machine's number, the number of the run among its own, and the outcome with the observer;
/// none for a run that is left to the exact solver.
pub type Receive<'a, E> = dyn FnMut(usize, usize, Option<(Outcome, E)>) + 'a;

/// An observer of any kind, and where its run is received: lanes are compiled once for all kinds.
trait Watcher {
    fn observer(&mut self) -> &mut dyn Extremes;
    fn observed(&self) -> &dyn Extremes;
    /// The run has ended, or is left to the exact solver.
    fn receive(self: Box<Self>, outcome: Option<Outcome>);
}

struct Watching<'r, 'j, E> {
    observer: E,
    number: usize,
    run: usize,
    receive: &'r RefCell<&'j mut Receive<'j, E>>,
}

impl<E: Extremes> Watcher for Watching<'_, '_, E> {
    fn observer(&mut self) -> &mut dyn Extremes {
        &mut self.observer
    }

    fn observed(&self) -> &dyn Extremes {
        &self.observer
    }

    fn receive(self: Box<Self>, outcome: Option<Outcome>) {
        let Self { observer, number, run, receive } = *self;
        (receive.borrow_mut())(number, run, outcome.map(|outcome| (outcome, observer)));
    }
}

/// An experiment, and its observer.
type RunOf<'a> = (&'a Experiment, Box<dyn Watcher + 'a>);

/// A machine, and its runs.
type Queued<'a> = (Arc<Mechanism>, Vec<RunOf<'a>>);

/// True if machines of this mechanism run in lanes with inputs of this degree: piecewise linear ones without lossy
/// gears, and without rotors of their own, whose rest is followed along the run.
pub(in crate::solve) fn takes(mechanism: &Mechanism, degree: usize) -> bool {
    degree <= 1
        && check::piecewise_linear(mechanism).is_ok()
        && mechanism.bodies.iter().all(|body| !body.is_rotor)
        && mechanism.drives.iter().all(|drive| drive.amplifier.mode != AmplifierMode::Position)
}

/// Runs machines of the structure of `mechanism` side by side, with inputs of at most this degree.
pub(in crate::solve) fn run_beside<'a, 'j, E: Extremes>(
    mechanism: &Mechanism,
    degree: usize,
    jobs: &mut dyn Iterator<Item = Job<'a, E>>,
    receive: &'j mut Receive<'j, E>,
) {
    let receive = RefCell::new(receive);
    let mut jobs = jobs.map(|Job { number, mechanism, runs }| -> Queued<'_> {
        let watching = |(run, (experiment, observer))| -> RunOf<'_> {
            (experiment, Box::new(Watching { observer, number, run, receive: &receive }))
        };
        (mechanism, runs.into_iter().enumerate().map(watching).collect())
    });
    run_queue(mechanism, degree, &mut jobs);
}

fn run_queue<'a>(mechanism: &Mechanism, degree: usize, jobs: &mut dyn Iterator<Item = Queued<'a>>) {
    let space = Space::new(mechanism, degree);
    let parts = Parts::new(mechanism, &space);
    // For a vector of the exact solver, speeds and currents, lengths and straight inputs: an axis; one with ramps,
    // inductance or ends, or a gantry; anything else.
    match (space.size(), parts.s.len(), parts.d.len()) {
        (..=8, ..=3, ..=2) => Fleet::<8, 3, 2>::run(jobs, degree, parts),
        (..=12, ..=4, ..=4) => Fleet::<12, 4, 4>::run(jobs, degree, parts),
        (..=40, ..=6, ..=8) => Fleet::<40, 6, 8>::run(jobs, degree, parts),
        _ => jobs.for_each(|(_, runs)| runs.into_iter().for_each(|(_, watcher)| watcher.receive(None))),
    }
}

/// Data kept between the runs of a machine.
struct Kept<const N: usize, const S: usize, const D: usize> {
    mechanism: Arc<Mechanism>,
    space: Arc<Space>,
    known: Modes<N>,
    laws: Vec<Law<N, S, D>>,
    /// Steps in a second of the fastest mode.
    fastest: f64,
    /// By the quantities of the observer.
    seen: Vec<ReadingSlot>,
    /// Readings for every mode, if none depends on it.
    readings: Option<Arc<Readings<S, D>>>,
}

/// The machine of a lane.
struct Seat<'a, const N: usize, const S: usize, const D: usize> {
    core: Core<N>,
    plan: Arc<Plan<N>>,
    kept: Kept<N, S, D>,
    experiment: &'a Experiment,
    watcher: Box<dyn Watcher + 'a>,
    /// Further runs, the last one first.
    next: Vec<RunOf<'a>>,
    /// Number of the law of the present mode, if the lane has it.
    law: Option<usize>,
    /// True if the lane has the readings, which no mode changes.
    reads: bool,
    /// The constant parts of z by the pieces of the inputs, the last one being the present.
    held: Vec<[f64; N]>,
    starts: Vec<Start<S, D>>,
    later: Vec<Later>,
    /// The largest magnitudes so far, by the slots of quantities.
    tops: Vec<f64>,
    pieces: Pieces,
    /// Ends of the present piece of the inputs and of the run, s.
    piece_end: f64,
    end: f64,
    steps: f64,
}

/// Machines under way.
struct Fleet<'a, 'j, const N: usize, const S: usize, const D: usize> {
    jobs: &'j mut dyn Iterator<Item = Queued<'a>>,
    plan: Arc<Plan<N>>,
    degree: usize,
    width: Width,
    slots: Slots,
    flight: Box<Flight<S, D>>,
    seats: [Option<Box<Seat<'a, N, S, D>>>; LANES],
    /// Begin of the present piece of the inputs, s.
    clock: [f64; LANES],
    /// Times within the piece between which a lane's last quantity is followed, s.
    watched: [(f64, f64); LANES],
    columns: Columns<S, D>,
    /// Room of runs that have ended, and of laws of machines that have.
    spare: Vec<(Vec<Start<S, D>>, Vec<Later>)>,
    rows: Vec<Rows<S, D>>,
}

/// The series of one lane.
type Columns<const S: usize, const D: usize> = [Moving<f64, S, D>; TERMS];

impl<'a, 'j, const N: usize, const S: usize, const D: usize> Fleet<'a, 'j, N, S, D> {
    /// Runs all jobs.
    fn run(jobs: &'j mut dyn Iterator<Item = Queued<'a>>, degree: usize, parts: Parts) {
        let plan = Plan::new(parts);
        let ways: Vec<usize> = plan.parts.ways.iter().map(|(_, speed)| *speed).collect();
        let mut fleet = Self {
            jobs,
            plan: Arc::new(plan),
            degree,
            width: Width::widest(),
            slots: Slots::new(),
            flight: Box::new(Flight::new(&ways)),
            seats: [const { None }; LANES],
            clock: [0.0; LANES],
            watched: [(f64::INFINITY, 0.0); LANES],
            columns: [Moving::all(0.0); TERMS],
            spare: Vec::with_capacity(LANES),
            rows: Vec::new(),
        };
        (0..LANES).for_each(|lane| fleet.load(lane));
        while fleet.seats.iter().any(Option::is_some) {
            fleet.step();
        }
    }

    /// One step of every lane.
    fn step(&mut self) {
        let calls = self.flight.fly(self.width);
        let mut ended = 0;
        let taken = (0..LANES).fold(0, |bits, lane| bits | u32::from(self.seats[lane].is_some()) << lane);
        for lane in numbers(calls.look & taken) {
            ended |= u32::from(self.look(lane)) << lane;
        }
        let within = self.flight.land(self.width, ended);
        for lane in numbers(within) {
            self.keep_for_later(lane);
        }
        for lane in 0..LANES {
            let (late, over) = self.watched[lane];
            if self.flight.time.0[lane] >= late && ended >> lane & 1 == 0 {
                let begin = self.flight.time.0[lane] - self.flight.h.0[lane];
                if begin <= over {
                    self.watch_step(lane, begin);
                }
            }
        }
        for lane in numbers(calls.over & taken & !ended) {
            self.hand_over(lane);
            ended |= 1 << lane;
        }
        for lane in numbers(ended) {
            self.attend(lane);
        }
    }

    // ---- machines take their lanes ----

    /// Gives a lane the next machine; none if there is none.
    fn load(&mut self, lane: usize) {
        self.seats[lane] = None;
        while let Some((mechanism, mut next)) = self.jobs.next() {
            // Lengths of springs weigh angles by the radii of this machine.
            let space = Arc::new(Space::new(&mechanism, self.degree));
            if !takes(&mechanism, self.degree) || Parts::new(&mechanism, &space) != self.plan.parts {
                next.into_iter().for_each(|(_, watcher)| watcher.receive(None));
                continue;
            }
            next.reverse();
            let (known, laws, seen) = (Vec::new(), Vec::new(), Vec::new());
            let kept = Kept { mechanism, space, known, laws, fastest: 0.0, seen, readings: None };
            if self.begin(lane, kept, next) {
                return;
            }
        }
        self.flight.idle(lane);
        self.watched[lane] = (f64::INFINITY, 0.0);
    }

    /// Begins the next run of a machine; false if there is none, or none for lanes.
    fn begin(&mut self, lane: usize, mut kept: Kept<N, S, D>, mut next: Vec<RunOf<'a>>) -> bool {
        let Some((experiment, watcher)) = next.pop() else {
            self.rows.extend(kept.laws.into_iter().map(Law::into_rows));
            return false;
        };
        let start = experiment.start(&kept.mechanism);
        let grid = Grid::new(start.every, start.until);
        let seen = kept.mechanism.seen_by(&kept.space.layout, &start.state);
        let known = std::mem::take(&mut kept.known);
        let mut core = Core::new(seen, Arc::clone(&kept.space), &start.state, (grid.interval(), grid.end()), known);
        if kept.seen.is_empty() && self.prepare(&mut core, &mut kept, watcher.observed()).is_none() {
            return Self::leave(watcher, next);
        }
        let steps = kept.fastest * grid.end();
        if steps > MOST_STEPS || steps > STEPS_PER_ROW * grid.intervals() as f64 {
            watcher.receive(None);
            kept.known = core.known;
            return self.begin(lane, kept, next);
        }
        let pieces = Pieces::new(&experiment.inputs, 0.0);
        let (piece_end, end) = (pieces.end.min(grid.end()), grid.end());
        let (law, held, steps) = (None, Vec::with_capacity(4), 0.0);
        let (starts, later) = self.spare.pop().unwrap_or_default();
        let slots = kept.seen.iter().map(|seen| seen.slot + 1).max().unwrap_or(0);
        let mut tops = vec![f64::INFINITY; slots];
        for seen in &kept.seen[..watcher.observed().sought()] {
            tops[seen.slot] = 0.0;
        }
        let seat = Seat {
            core,
            plan: Arc::clone(&self.plan),
            kept,
            experiment,
            watcher,
            next,
            law,
            reads: false,
            held,
            starts,
            later,
            tops,
            pieces,
            piece_end,
            end,
            steps,
        };
        self.seats[lane] = Some(Box::new(seat));
        self.flight.begin(lane);
        self.take_input(lane);
        self.attend(lane);
        true
    }

    /// Prepares what all runs of a machine need; none if it is not for lanes.
    fn prepare(&self, core: &mut Core<N>, kept: &mut Kept<N, S, D>, observer: &dyn Extremes) -> Option<()> {
        let (mechanism, space) = (&core.common.mechanism, &core.common.space);
        let mode = all_slide(&core.common.rules.mode, mechanism);
        let (matrices, _) = ModeMatrices::from_known(&mut core.known, mechanism, space, &mode, core.common.h);
        let alike = reads_alike(mechanism);
        let shown = matrices.shown(mechanism, space);
        let (readings, seen) = Readings::from_shown(shown, observer.quantities(), &self.plan, alike)?;
        kept.readings = alike.then(|| Arc::new(readings));
        kept.seen = seen;
        kept.fastest = matrices.norm(mechanism, &space.layout) / flight::REACH;
        Some(())
    }

    /// Leaves this run and all further ones of a machine to the exact solver.
    fn leave(watcher: Box<dyn Watcher + 'a>, next: Vec<RunOf<'a>>) -> bool {
        watcher.receive(None);
        next.into_iter().rev().for_each(|(_, watcher)| watcher.receive(None));
        false
    }

    /// Takes up the present piece of the inputs.
    fn take_input(&mut self, lane: usize) {
        let Some(seat) = &mut self.seats[lane] else { return };
        seat.core.note_ties();
        seat.core.set_input(&seat.pieces);
        seat.core.resolve();
        seat.core.note_ties();
        seat.held.push(seat.core.z);
        (seat.law, seat.reads) = (None, false);
    }

    /// Ends a run whose inputs changed at its end, where the values after the change are seen, too.
    fn end_changed(&mut self, lane: usize) {
        if !self.take_up(lane) {
            return self.give_up(lane);
        }
        if let Some(seat) = &mut self.seats[lane] {
            seat.see_values(seat.end);
        }
        self.end_run(lane);
    }

    /// Brings a machine to where its lane can go on, or to the end of its runs.
    fn attend(&mut self, lane: usize) {
        loop {
            let Some(seat) = &mut self.seats[lane] else { return };
            let core = &mut seat.core;
            if core.common.rules.trouble.is_some() {
                return self.end_run(lane);
            }
            if !core.is_finite() || seat.steps > MOST_STEPS {
                return self.give_up(lane);
            }
            let near = (8.0 * f64::EPSILON * seat.piece_end).min(1e-9 * core.common.h);
            let length = seat.piece_end - core.common.base;
            if length - core.common.offset <= near {
                core.count_from(seat.piece_end);
                let is_over = seat.piece_end >= seat.end;
                if is_over && seat.pieces.end > seat.end {
                    return self.end_run(lane);
                }
                seat.pieces = Pieces::new(&seat.experiment.inputs, seat.piece_end);
                seat.piece_end = seat.pieces.end.min(seat.end);
                self.take_input(lane);
                if is_over {
                    return self.end_changed(lane);
                }
                continue;
            }
            if !self.take_up(lane) {
                return self.give_up(lane);
            }
            if !self.rests(lane, length) {
                return self.take_off(lane, length);
            }
        }
    }

    /// Sets the numbers of the present mode in a lane; false if a quantity is bounded by no spring of it.
    #[inline(never)]
    fn take_up(&mut self, lane: usize) -> bool {
        let Self { seats, plan, slots, flight, rows, .. } = self;
        let Some(seat) = &mut seats[lane] else { return true };
        let Seat { core, kept, watcher, law: present, reads, .. } = &mut **seat;
        let laws = &mut kept.laws;
        let number = match laws.iter().position(|law| Arc::ptr_eq(&law.matrices, &core.matrices)) {
            Some(number) => number,
            None => {
                let readings = match &kept.readings {
                    Some(readings) => Arc::clone(readings),
                    None => {
                        let shown = core.matrices.shown(&core.common.mechanism, &core.common.space);
                        let own = Readings::from_shown(shown, watcher.observed().quantities(), plan, false);
                        let Some((own, _)) = own else { return false };
                        Arc::new(own)
                    }
                };
                laws.push(Law::new(core, readings, plan, slots, rows.pop().unwrap_or_default()));
                laws.len() - 1
            }
        };
        let law = &laws[number];
        if *present != Some(number) {
            flight.make_room(0, law.readings.slots(), law.energy().len());
            flight.rates.put(lane, &law.rates(&core.z));
            let none = Moving::all(0.0);
            let energy = law.energy().iter().chain(std::iter::repeat(&none));
            flight.energy.iter_mut().zip(energy).for_each(|(own, form)| own.put(lane, form));
            if !std::mem::replace(reads, kept.readings.is_some()) {
                for (slot, own) in flight.quantities.iter_mut().enumerate().take(law.readings.slots()) {
                    own.put(lane, &law.readings.with(slot, &core.z));
                }
            }
            (flight.longest.0[lane], flight.grow.0[lane]) = (law.longest, law.grow);
            watcher.observer().moves(&law.matrices.mode);
            *present = Some(number);
        }
        flight.make_room(slots.len(), 0, 0);
        let others = flight.guards.iter_mut().enumerate().filter(|(slot, _)| !law.has(*slot));
        others.for_each(|(_, guard)| guard.clear(lane));
        for (slot, guard) in law.guards(core, plan) {
            flight.is_fresh |= guard.fresh > 0.0;
            flight.guards[slot].put(lane, &guard);
        }
        true
    }

    /// Goes to the end of the piece of the inputs if nothing moves.
    fn rests(&mut self, lane: usize, length: f64) -> bool {
        let Some(seat) = &mut self.seats[lane] else { return false };
        let Some(law) = seat.law.map(|law| &seat.kept.laws[law]).filter(|law| law.is_still) else { return false };
        let matrices = Arc::clone(&law.matrices);
        let (safe, resting) = seat.core.safe_intervals(&matrices, u64::MAX);
        if safe < u64::MAX || !resting {
            return false;
        }
        let (base, begin) = (seat.core.common.base, seat.core.common.offset);
        seat.core.common.rules.since_change += length - begin;
        seat.core.common.offset = length;
        // Values that are held have no peaks but those at the beginning.
        seat.see_values(base + begin);
        if seat.watcher.observed().steady().is_some() {
            let seen = *seat.kept.seen.last().expect("a last quantity");
            let quantity = seat.law().readings.with(seen.slot, &seat.core.z);
            let value = seen.reading(quantity.form.value(&seat.plan.moving_part(&seat.core.z)));
            let _ = seat.watcher.observer().pass_steady((base + begin, base + length), [value; 2], (value, value));
        }
        true
    }

    /// The lane goes on from where its machine stands.
    #[inline(never)]
    fn take_off(&mut self, lane: usize, length: f64) {
        let Self { seats, plan, flight, .. } = self;
        let Some(seat) = &mut seats[lane] else { return };
        let Some(law) = seat.law.map(|law| &seat.kept.laws[law]) else { return };
        let core = &seat.core;
        let (z, now) = (plan.moving_part(&core.z), core.common.base + core.common.offset);
        let rate = law.rates(&core.z).rate(&z);
        flight.set(lane, &z, &rate);
        for (way, (place, _)) in flight.ways.iter_mut().zip(&plan.parts.ways) {
            way.1.0[lane] = core.z[*place];
        }
        flight.time.0[lane] = core.common.offset;
        flight.length.0[lane] = length;
        self.clock[lane] = core.common.base;
        self.watched[lane] = match seat.watcher.observed().steady() {
            Some((late, over)) => (late - core.common.base, over - core.common.base),
            None => (f64::INFINITY, 0.0),
        };
        for slot in 0..seat.tops.len() {
            seat.see_value(slot, flight.from.quantities[slot][0].0[lane], now);
            let heights = &mut flight.heights[slot];
            heights.peak.0[lane] = seat.tops[slot];
            heights.when.0[lane] = f64::NEG_INFINITY;
        }
        for heights in &mut flight.heights[seat.tops.len()..] {
            heights.peak.0[lane] = f64::INFINITY;
        }
    }

    /// The state of a lane goes to its machine, its peaks to the observer.
    #[inline(never)]
    fn hand_over(&mut self, lane: usize) {
        let Self { seats, plan, flight, clock, .. } = self;
        let Some(seat) = &mut seats[lane] else { return };
        let core = &mut seat.core;
        plan.put(&flight.from.z.lane(lane), &mut core.z);
        for (way, (place, _)) in flight.ways.iter().zip(&plan.parts.ways) {
            core.z[*place] = way.1.0[lane];
        }
        let moved = flight.time.0[lane] - core.common.offset;
        if moved <= 0.0 {
            return;
        }
        let mut largest = core.largest;
        plan.put(&flight.largest.lane(lane), &mut largest);
        for (farthest, (place, _)) in flight.farthest.iter().zip(&plan.parts.ways) {
            largest[*place] = farthest.0[lane];
        }
        core.largest.iter_mut().zip(largest).for_each(|(own, other)| *own = own.max(other));
        core.move_on(moved);
        core.common.offset = flight.time.0[lane];
        let steps = std::mem::take(&mut flight.steps[lane]);
        core.common.cost.steps += steps;
        seat.steps += steps as f64;
        if moved > SOON * core.matrices.reach() {
            core.common.rules.refreshed();
        }
        for (slot, heights) in flight.heights.iter_mut().enumerate().take(seat.tops.len()) {
            let when = std::mem::replace(&mut heights.when.0[lane], f64::NEG_INFINITY);
            if when > f64::NEG_INFINITY {
                seat.come_to(slot, heights.peak.0[lane], clock[lane] + when);
            }
        }
    }

    // ---- what happens within a step ----

    /// Looks for the first guard that falls within the present step, and passes through the event; false if there is
    /// none.
    #[inline(never)]
    fn look(&mut self, lane: usize) -> bool {
        if !self.flight.to.z.lane(lane).iter().sum::<f64>().is_finite() {
            // No lane is loaded before the others have landed.
            self.seats[lane].iter_mut().for_each(|seat| seat.steps = f64::INFINITY);
            return true;
        }
        let h = self.flight.h.0[lane];
        let Self { seats, plan, flight, columns, .. } = self;
        let Some(seat) = &mut seats[lane] else { return false };
        let Some(law) = seat.law.map(|law| &seat.kept.laws[law]) else { return false };
        columns.iter_mut().zip(flight.terms.iter()).for_each(|(column, terms)| *column = terms.lane(lane));
        let core = &mut seat.core;
        let matrices = &law.matrices;
        // Guards are looked at in the state at the beginning.
        plan.put(&columns[0], &mut core.z);
        core.look(matrices);
        let mut open = super::Lanes::NONE;
        law.open(|slot| flight.unsafe_sides(slot, lane)).for_each(|index| open.set(index, true));
        if flight.time.0[lane] - core.common.offset > SOON * matrices.reach() {
            core.common.rules.refreshed();
        }
        let values = &core.room.value;
        let coefficients = &mut core.room.coefficients;
        let rules = &core.common.rules;
        let along = |index: usize, room: &mut [f64; SERIES_TERMS]| {
            let weights = law.weights(index);
            for (coefficient, terms) in room.iter_mut().zip(columns.iter()) {
                *coefficient = weights.dot(terms);
            }
            room[0] = values[index];
            TERMS
        };
        let fall = |index: usize, coefficients: &[f64]| {
            let (slot, side) = law.slot(index);
            let part = flight.guard(slot, lane, side);
            match coefficients[0] > 0.0 && part.falls_once() {
                true => Some(roots::only_fall(coefficients, part.values[1])),
                false => roots::first_fall(coefficients),
            }
        };
        let first = super::first_fallen(rules, matrices, (&core.z, h), open, coefficients, (along, fall));
        let Some((s, fallen)) = first else { return false };

        self.hand_over(lane);
        let Self { seats, plan, flight, columns, clock, .. } = self;
        let Some(seat) = &mut seats[lane] else { return false };
        let core = &mut seat.core;
        let mut end = Moving::all(0.0);
        columns[1..].iter().rev().for_each(|terms| end.add_scaled(terms, s));
        end.add_scaled(&columns[0], 1.0);
        plan.put(&end, &mut core.z);
        for (place, speed) in &plan.parts.ways {
            // ∫ Σ w_k sᵏ h ds
            let sum = columns
                .iter()
                .enumerate()
                .rev()
                .fold(0.0, |sum, (k, terms)| sum * s + terms.s[*speed] * flight::RECIPROCAL[k + 1]);
            core.z[*place] += sum * (s * h);
        }
        core.common.cost.series += 1;
        core.move_on(s * h);
        if s * h > SOON * core.matrices.reach() {
            core.common.rules.refreshed();
        }
        core.check();
        core.see();
        if s > 0.0 {
            let rest = flight.rest.0[lane] * (1.0 / INNER) * (s * s) * (s * s);
            seat.see_part(flight, lane, (&columns[0], &end), (clock[lane] + flight.time.0[lane], s * h), rest);
        }
        seat.core.go_through(fallen);
        true
    }

    /// Keeps the step that a lane has just taken: quantities may have a peak in it.
    #[inline(never)]
    fn keep_for_later(&mut self, lane: usize) {
        let Self { seats, flight, clock, .. } = self;
        let Some(seat) = &mut seats[lane] else { return };
        let Some(law) = seat.law else { return };
        let (h, rest) = (flight.h.0[lane], flight.rest.0[lane] * (1.0 / INNER));
        let mut start = None;
        for (slot, heights) in flight.heights.iter().enumerate() {
            if heights.within >> lane & 1 == 1 {
                let part = flight.part(slot, lane, (h, rest));
                let start = *start.get_or_insert_with(|| {
                    let (held, begin) = (seat.held.len() - 1, clock[lane] + flight.time.0[lane] - h);
                    seat.starts.push(Start { law, held, z: flight.to.z.lane(lane), begin, length: h });
                    seat.starts.len() - 1
                });
                seat.later.push(Later { start, slot, upper: part.bound(), part });
            }
        }
    }

    /// Shows the step that a lane has just taken, and that began at `begin` within the piece, to an observer of what
    /// becomes steady.
    #[inline(never)]
    fn watch_step(&mut self, lane: usize, begin: f64) {
        let Self { seats, flight, clock, .. } = self;
        let Some(seat) = &mut seats[lane] else { return };
        let slot = seat.kept.seen.last().expect("a last quantity").slot;
        let (h, rest) = (flight.h.0[lane], flight.rest.0[lane] * (1.0 / INNER));
        let (z, part) = (flight.to.z.lane(lane), flight.part(slot, lane, (h, rest)));
        let times = (clock[lane] + begin, clock[lane] + flight.time.0[lane]);
        seat.watch(times, &z, part);
    }

    // ---- ends ----

    /// A state that is no longer finite, a quantity without a bound, or too many steps: from its start by the exact
    /// solver.
    fn give_up(&mut self, lane: usize) {
        if let Some(seat) = self.seats[lane].take() {
            Self::leave(seat.watcher, seat.next);
        }
        self.load(lane);
    }

    /// A run has ended: its peaks are settled, and the next one begins.
    fn end_run(&mut self, lane: usize) {
        let Some(mut seat) = self.seats[lane].take() else { return };
        self.spare.push(seat.settle());
        let Seat { mut core, mut kept, mut watcher, next, .. } = *seat;
        core.note_ties();
        watcher.observer().end(core.time(), &core.state(), &core.common.rules.mode);
        let error = Some(core.bound_of_rounding());
        let outcome = Outcome {
            events: std::mem::take(&mut core.common.rules.events),
            ties: std::mem::take(&mut core.common.rules.ties),
            ending: core.common.rules.trouble.unwrap_or(Ending::Complete),
            cost: std::mem::take(&mut core.common.cost),
            error,
            unmet: 0,
        };
        watcher.receive(Some(outcome));
        kept.known = std::mem::take(&mut core.known);
        if !self.begin(lane, kept, next) {
            self.load(lane);
        }
    }
}

impl<const N: usize, const S: usize, const D: usize> Seat<'_, N, S, D> {
    fn law(&self) -> &Law<N, S, D> {
        &self.kept.laws[self.law.expect("taken up")]
    }

    /// Takes the values of all slots now.
    fn see_values(&mut self, now: f64) {
        for slot in 0..self.tops.len() {
            let quantity = self.law().readings.with(slot, &self.core.z);
            let value = quantity.form.value(&self.plan.moving_part(&self.core.z));
            self.see_value(slot, value, now);
        }
    }

    /// Takes the value of a slot now, if it is the largest so far.
    fn see_value(&mut self, slot: usize, value: f64, now: f64) {
        if value.abs() > self.tops[slot] {
            self.each((slot, value), |observer, quantity, value| observer.take(quantity, value, now));
        }
    }

    /// Takes the largest value that a slot has come to, and its time.
    fn come_to(&mut self, slot: usize, value: f64, time: f64) {
        self.each((slot, value), |observer, quantity, value| observer.come_to(quantity, value, time));
    }

    /// Tells the observer of each quantity in a slot.
    fn each(&mut self, (slot, value): (usize, f64), mut tell: impl FnMut(&mut dyn Extremes, usize, f64)) {
        self.tops[slot] = self.tops[slot].max(value.abs());
        let observer = self.watcher.observer();
        let sought = observer.sought();
        for (quantity, seen) in self.kept.seen.iter().enumerate().take(sought).filter(|(_, seen)| seen.slot == slot) {
            tell(observer, quantity, seen.reading(value));
        }
    }

    /// Takes the part of a step of its lane up to an event.
    #[inline(never)]
    fn see_part(
        &mut self,
        flight: &Flight<S, D>,
        lane: usize,
        (from, to): (&Moving<f64, S, D>, &Moving<f64, S, D>),
        (begin, length): (f64, f64),
        rest: f64,
    ) {
        let (law, held) = (self.law.expect("taken up"), self.held.len() - 1);
        let rate = self.law().rates(&self.core.z).rate(to);
        let mut start = None;
        let steady = self.kept.seen.last().expect("a last quantity").slot;
        for slot in 0..self.tops.len() {
            let quantity = self.law().readings.with(slot, &self.core.z);
            let [value, slope] = flight.from.quantities[slot].map(|numbers| numbers.0[lane]);
            let part = Part {
                values: [value, quantity.form.value(to)],
                slopes: [length * slope, length * quantity.form.change(&rate)],
                rest: rest * quantity.dual,
            };
            let is_held = part.values[0] == part.values[1] && part.slopes == [0.0; 2];
            if !is_held && part.values[1].abs() >= self.tops[slot] * (1.0 - NEWS) {
                self.come_to(slot, part.values[1], begin + length);
            }
            let upper = part.bound();
            if upper > self.tops[slot] * (1.0 + NEWS) && !part.is_monotone() {
                let start = *start.get_or_insert_with(|| {
                    self.starts.push(Start { law, held, z: *from, begin, length });
                    self.starts.len() - 1
                });
                self.later.push(Later { start, slot, part, upper });
            }
            if steady == slot {
                self.watch((begin, begin + length), from, part);
            }
        }
    }

    /// Shows a part of the run to an observer of what becomes steady.
    fn watch(&mut self, times: (f64, f64), z: &Moving<f64, S, D>, part: Part) {
        let Some((late, over)) = self.watcher.observed().steady() else { return };
        if times.1 < late || times.0 > over {
            return;
        }
        let seen = *self.kept.seen.last().expect("a last quantity");
        let (low, high) = part.range();
        let (low, high) = (seen.factor * low, seen.factor * high);
        let values = part.values.map(|value| seen.reading(value));
        if self.watcher.observer().pass_steady(times, values, (low.min(high), low.max(high))) {
            let (law, held) = (self.law.expect("taken up"), self.held.len() - 1);
            let start = Start { law, held, z: *z, begin: times.0, length: times.1 - times.0 };
            let course = self.course(seen.slot, &start);
            self.watcher.observer().see_steady(times, &|from| {
                let (least, greatest) = part.extremes_from(&course, from);
                let [a, b] = [seen.reading(least), seen.reading(greatest)];
                (a.min(b), a.max(b))
            });
        }
    }

    /// The course of a slot from a start on.
    fn course(&self, slot: usize, start: &Start<S, D>) -> Polynomial<TERMS> {
        let (law, held) = (&self.kept.laws[start.law], &self.held[start.held]);
        let rates = law.rates(held);
        let mut terms = [Moving::all(0.0); TERMS];
        rates.series(start.length, (&start.z, &rates.rate(&start.z)), &mut terms);
        let form = law.readings.with(slot, held).form;
        let mut course = Polynomial::default();
        for (c, terms) in course.0.iter_mut().zip(&terms) {
            *c = form.of.dot(terms);
        }
        course.0[0] += form.constant;
        course
    }

    /// Settles the peaks that were kept, and returns their room: the cubics tell how high they are at least, and steps
    /// that may be higher are expanded again, the highest first.
    #[inline(never)]
    fn settle(&mut self) -> (Vec<Start<S, D>>, Vec<Later>) {
        let mut later = std::mem::take(&mut self.later);
        let mut least = self.tops.clone();
        for Later { slot, part, upper, .. } in &mut later {
            if *upper > least[*slot] {
                let highest = part.highest();
                least[*slot] = least[*slot].max(highest - part.rest);
                *upper = highest + part.rest;
            }
        }
        later.retain(|later| later.upper >= least[later.slot]);
        later.sort_by(|a, b| b.upper.total_cmp(&a.upper));
        for Later { start, slot, part, upper } in &later {
            if *upper <= self.tops[*slot] * (1.0 + NEWS) {
                continue;
            }
            let start = &self.starts[*start];
            let (begin, length) = (start.begin, start.length);
            if let Some((s, value)) = part.peak(&self.course(*slot, start)) {
                self.see_value(*slot, value, begin + s * length);
            }
        }
        let mut starts = std::mem::take(&mut self.starts);
        starts.clear();
        later.clear();
        (starts, later)
    }
}
