//! The independent solver: Taylor series of order 32 in numbers of 106 bits, from one change of mode to the next.
//!
//! A condition of the present mode is a polynomial on each step; its first fall, found to the last bit, ends the mode.
//! At that
//! instant everything settles, limits, gear, spans and stops before bodies: a condition that is zero but for rounding
//! is judged by
//! the first term of its series that is not, and what fails changes, one after the other, until all hold.

use crate::double::Double;
use crate::input::Piece;
use crate::law::{Change, Guard, Law, Limit, Mode, Motion, Touch};
use crate::machine::{BODIES, BRISTLE, CURRENT, DRIVES, Model, ROTOR, SPANS, SPEED, STATES, State, Taken, WAY};
use crate::root::{self, Polynomial};
use crate::series::{Noise, Series, Size};
use crate::terms::{ORDER, PLACES};
use std::collections::HashMap;
use std::rc::Rc;

/// Changes at one instant, and instants with changes in a run, after which it gives up.
const MOST_AT_ONCE: usize = 200;
const MOST_EVENTS: usize = 20_000;

/// Steps after which it gives up.
const MOST_STEPS: usize = 400_000;

/// A body that changed what it does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// When, s.
    pub time: f64,
    /// Its number.
    pub body: usize,
    /// The motion before.
    pub from: Motion,
    /// The motion after.
    pub to: Motion,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// At the end.
    Complete,
    /// The cart left its travel.
    LeftTravel(f64),
    /// More events or steps than are worth the time.
    GaveUp(f64, String),
}

/// A run.
#[derive(Debug, Clone)]
pub struct IndependentRun {
    /// Positions along the belt less those of the start, m, at the times asked for, as far as it went.
    pub rows: Vec<[Double; BODIES]>,
    /// Changes of bodies.
    pub events: Vec<Event>,
    /// How it ended.
    pub ending: Ending,
    /// Taylor series computed.
    pub steps: usize,
}

/// The inputs of the drives from one moment on.
pub type Pieces = [Piece; DRIVES];

/// Runs a machine under these chains of inputs, a chain for each drive, and gives the positions at `times`, which grow.
/// `kept` rounds the state after each step, as if it were kept in fewer bits.
pub fn run(machine: &Model, chains: &[Vec<Piece>], times: &[f64], kept: Option<Taken>) -> IndependentRun {
    let end = times.last().copied().unwrap_or(0.0);
    let mut solver = Solver::new(machine, times, kept);
    let mut starts: Vec<Double> = chains.iter().flatten().map(|piece| piece.start).collect();
    starts.sort_by(|a, b| a.partial_cmp(b).expect("times are numbers"));
    starts.dedup();
    for (i, &start) in starts.iter().enumerate() {
        let until = starts.get(i + 1).copied().unwrap_or(Double::from(end));
        let pieces = std::array::from_fn(|drive| {
            let chain = chains.get(drive).map_or(&[][..], |chain| chain);
            chain.iter().rev().find(|piece| piece.start <= start).cloned().unwrap_or_default()
        });
        solver.go(&pieces, until);
        if solver.ending != Ending::Complete {
            break;
        }
    }
    solver.finish()
}

/// A law and the length of step that suits it.
struct Prepared {
    law: Law,
    step: std::cell::Cell<f64>,
}

/// A machine under way.
pub struct Solver<'a, 'b> {
    machine: &'a Model,
    times: &'a [f64],
    kept: Option<Taken<'b>>,
    z: State,
    /// Largest values so far.
    size: Size,
    time: Double,
    mode: Mode,
    laws: HashMap<Mode, Rc<Prepared>>,
    rows: Vec<[Double; BODIES]>,
    events: Vec<Event>,
    instants: usize,
    /// Where the last change was, and how many there have been there.
    last_change: (Double, usize),
    ending: Ending,
    steps: usize,
}

impl<'a, 'b> Solver<'a, 'b> {
    /// At its start.
    pub fn new(machine: &'a Model, times: &'a [f64], kept: Option<Taken<'b>>) -> Self {
        let z = machine.start;
        let mut motion = [Motion::Free; BODIES];
        for (body, motion) in motion.iter_mut().enumerate().take(machine.bodies) {
            let leader = machine.leader(body);
            *motion = match z[SPEED[leader]] {
                _ if !machine.is_dry(leader) && !machine.is_curved(leader) => Motion::Free,
                v if v > Double::ZERO => Motion::Forward,
                v if v < Double::ZERO => Motion::Backward,
                _ if !machine.is_dry(leader) => Motion::Forward,
                _ => Motion::Stuck,
            };
        }
        let mode = Mode {
            motion,
            gear_positive: [true; DRIVES],
            slack: [false; SPANS],
            gear: [Touch::Apart; DRIVES],
            stop: [Touch::Apart; BODIES],
            passed: [0; 3],
            voltage: [Limit::Within; DRIVES],
            current: [Limit::Within; DRIVES],
        };
        let mut states = [0.0; PLACES];
        states[..STATES].copy_from_slice(&z.map(|z| z.high.abs()));
        Self {
            machine,
            times,
            kept,
            z,
            size: Size { states, input: [0.0; DRIVES] },
            time: Double::ZERO,
            mode,
            laws: HashMap::new(),
            rows: Vec::new(),
            events: Vec::new(),
            instants: 0,
            last_change: (Double::from(-1.0), 0),
            ending: Ending::Complete,
            steps: 0,
        }
    }

    /// Takes up these inputs and goes on until then.
    pub fn go(&mut self, pieces: &Pieces, until: Double) {
        self.settle(pieces);
        self.advance(pieces, until);
    }

    /// The state now.
    pub fn state(&self) -> &State {
        &self.z
    }

    /// How it ended so far.
    pub fn ending(&self) -> &Ending {
        &self.ending
    }

    /// The current of a drive now, under inputs that act already.
    pub fn current(&mut self, drive: usize, pieces: &Pieces) -> Double {
        let prepared = self.prepared();
        let inputs = std::array::from_fn(|drive| pieces[drive].series(self.time, Double::ONE));
        prepared.law.current(drive, &self.z, &inputs)
    }

    /// The run so far.
    pub fn finish(mut self) -> IndependentRun {
        self.record_up_to(self.time, None);
        IndependentRun { rows: self.rows, events: self.events, ending: self.ending, steps: self.steps }
    }

    fn prepared(&mut self) -> Rc<Prepared> {
        let (machine, size) = (self.machine, &mut self.size);
        let mut prepare = |mode: Mode| {
            let law = Law::new(machine, mode);
            let step = 1.7 / law.rates.fastest();
            for (place, scale) in law.rates.scales() {
                size.states[place] = size.states[place].max(scale);
            }
            Rc::new(Prepared { law, step: std::cell::Cell::new(step) })
        };
        Rc::clone(self.laws.entry(self.mode).or_insert_with_key(|&mode| prepare(mode)))
    }

    fn give_up(&mut self, why: &str) {
        if self.ending == Ending::Complete {
            self.ending = Ending::GaveUp(self.time.high, why.into());
        }
    }

    /// Goes on to the end of a piece of the input.
    fn advance(&mut self, pieces: &Pieces, until: Double) {
        while self.time < until && self.ending == Ending::Complete {
            self.steps += 1;
            if self.steps > MOST_STEPS {
                self.give_up("too many steps");
            }
            let prepared = self.prepared();
            let law = &prepared.law;
            let rest = until - self.time;
            let mut step = prepared.step.get().min(reach_of(pieces));
            let (series, h, reach) = loop {
                let h = if step >= rest.high { rest } else { Double::from(step) };
                let series = Series::new(&law.rates, &self.z, inputs(pieces, self.time, h), h);
                let reach = series.reach(&self.size);
                // What is a small part of the step says little about where its series ends.
                if reach.is_nan() || reach > 0.3 {
                    break (series, h, reach);
                }
                step = h.high * (2.0 * reach).clamp(1e-9, 0.5);
            };
            if reach.is_nan() {
                self.give_up("it diverges");
                return;
            }
            let whole = h == rest;
            let next = h.high * (0.95 * reach).clamp(0.2, 2.0);
            prepared.step.set(if whole { next.max(step) } else { next });
            for (size, input) in self.size.input.iter_mut().zip(series.input_size()) {
                *size = size.max(input);
            }
            let part = reach.min(1.0);
            let fall = self.first_fall(law, &series, part, h);
            let s = fall.as_ref().map_or(Double::from(part), |(s, _)| *s);
            let after = if whole && part == 1.0 && fall.is_none() { until } else { self.time + h * s };
            self.record_up_to(after, Some((&series, h)));
            self.z = series.at(s);
            self.time = after;
            self.keep();
            for (size, z) in self.size.states.iter_mut().zip(self.z.iter().chain(&series.terms[0][STATES..])) {
                *size = size.max(z.high.abs());
            }
            if let Some((_, change)) = fall {
                self.fire(change, pieces);
            }
        }
    }

    /// Rounds the state as if it were kept in fewer bits: positions of the machine, strains, speeds, currents,
    /// bristles.
    fn keep(&mut self) {
        let Some(kept) = &mut self.kept else { return };
        let mut change = |value: Double| kept(value.high) - Double::from(value.high);
        let ways = WAY.map(|way| self.z[way]);
        let place = &self.machine.place;
        let common: Vec<Double> = place.iter().map(|(body, _)| change(ways[*body])).collect();
        for body in (0..self.machine.bodies).filter(|&body| self.mode.motion[body] != Motion::Stuck) {
            let mut strain = ways[body];
            for ((at, of), common) in place.iter().zip(&common) {
                strain = strain - ways[*at] * of[body];
                self.z[WAY[body]] += *common * of[body];
            }
            if place.iter().all(|(at, _)| *at != body) {
                self.z[WAY[body]] += change(strain);
            }
            let speed = self.z[SPEED[body]];
            self.z[SPEED[body]] += change(speed);
        }
        for place in CURRENT.into_iter().chain(ROTOR.map(|rotor| rotor[1])).chain(BRISTLE) {
            let value = self.z[place];
            self.z[place] += change(value);
        }
    }

    /// Rows up to a time, from the series that holds until then.
    fn record_up_to(&mut self, after: Double, series: Option<(&Series, Double)>) {
        while let Some(&row) = self.times.get(self.rows.len()) {
            let row = Double::from(row);
            if row > after || (row == after && series.is_some()) {
                break;
            }
            let z = match series {
                Some((series, h)) => series.at((row - self.time) / h),
                None => self.z,
            };
            self.rows.push(std::array::from_fn(|body| z[WAY[body]] + self.machine.beyond[body]));
        }
    }

    /// Where, in parts of h, the first condition falls up to `part`, and what follows.
    fn first_fall(&self, law: &Law, series: &Series, part: f64, h: Double) -> Option<(Double, Change)> {
        let mut first: Option<(Double, Change)> = None;
        let mut noise = None;
        for Guard { row, change } in &law.guards {
            let now = series.value(row).high;
            if now > series.change(row) * 1.000001 {
                continue;
            }
            let mut c = series.polynomial(row);
            let noise = noise.get_or_insert_with(|| Noise::new(&law.rates, series, h.high, &self.size));
            // What is zero but for rounding is zero.
            for (k, c) in c.iter_mut().enumerate() {
                if c.high.abs() > noise.deviation(row, k) {
                    break;
                }
                *c = Double::ZERO;
            }
            let fall = match c.iter().position(|&c| c != Double::ZERO) {
                None => None,
                Some(zeros) => {
                    let mut power = 1.0;
                    let mut rest: Polynomial = [Double::ZERO; ORDER + 1];
                    for (rest, &c) in rest.iter_mut().zip(&c[zeros..]) {
                        *rest = c * power;
                        power *= part;
                    }
                    root::first_fall(&rest)
                }
            };
            if let Some(s) = fall.map(|s| s * part)
                && first.as_ref().is_none_or(|(earliest, _)| s < *earliest)
            {
                first = Some((s, *change));
            }
        }
        first
    }

    /// Makes a change, and what follows at the same instant.
    fn fire(&mut self, change: Change, pieces: &Pieces) {
        let before = self.mode.motion;
        self.make(change);
        self.settle_from(before, pieces);
    }

    /// Changes, without time passing, until every condition holds.
    fn settle(&mut self, pieces: &Pieces) {
        self.settle_from(self.mode.motion, pieces);
    }

    fn settle_from(&mut self, before: [Motion; BODIES], pieces: &Pieces) {
        while self.ending == Ending::Complete {
            let Some(change) = self.first_broken(pieces) else { break };
            self.make(change);
        }
        for body in self.machine.leaders().filter(|&body| self.machine.is_dry(body)) {
            let (from, to) = (before[body], self.mode.motion[body]);
            if from != to {
                self.events.push(Event { time: self.time.high, body, from, to });
            }
        }
    }

    /// The first condition that does not hold at this instant and just after.
    fn first_broken(&mut self, pieces: &Pieces) -> Option<Change> {
        let prepared = self.prepared();
        let law = &prepared.law;
        let step = prepared.step.get().min(reach_of(pieces));
        let h = Double::from(if step.is_finite() { step } else { 1.0 });
        let series = Series::new(&law.rates, &self.z, inputs(pieces, self.time, h), h);
        let mut noise = None;
        let broken = |guard: &&Guard| {
            let now = series.value(&guard.row).high;
            if now > series.change(&guard.row) {
                return false;
            }
            let noise = noise.get_or_insert_with(|| Noise::new(&law.rates, &series, h.high, &self.size));
            let c = series.polynomial(&guard.row);
            let told = c.iter().enumerate().find(|&(k, c)| c.high.abs() > noise.deviation(&guard.row, k));
            told.is_some_and(|(_, c)| *c < Double::ZERO)
        };
        let guard = law.guards.iter().find(broken)?;
        Some(guard.change)
    }

    fn make(&mut self, change: Change) {
        if self.last_change.0 == self.time {
            self.last_change.1 += 1;
        } else {
            self.last_change = (self.time, 0);
            self.instants += 1;
        }
        if self.last_change.1 > MOST_AT_ONCE {
            self.give_up(&format!("too many changes at once, the last {change:?}"));
        }
        if self.instants > MOST_EVENTS {
            self.give_up("too many events");
        }
        let mode = &mut self.mode;
        match change {
            Change::Voltage(drive, limit) => mode.voltage[drive] = limit,
            Change::Current(drive, limit) => {
                mode.current[drive] = limit;
                let of = &self.machine.drives[drive];
                if let (true, Some(bound)) = (of.current_moves() && !of.current_mode, of.current_limit) {
                    match limit {
                        Limit::High => self.z[CURRENT[drive]] = bound,
                        Limit::Low => self.z[CURRENT[drive]] = -bound,
                        Limit::Within => {}
                    }
                }
            }
            Change::GearSign(drive) => mode.gear_positive[drive] = !mode.gear_positive[drive],
            Change::Span(j, slack) => mode.slack[j] = slack,
            Change::Gear(drive, touch) => mode.gear[drive] = touch,
            Change::Stop(body, touch) => mode.stop[body] = touch,
            Change::Passed(which, points) => mode.passed[which] = points,
            Change::Leave => self.ending = Ending::LeftTravel(self.time.high),
            Change::Turn(leader) => {
                let turned = match mode.motion[leader] {
                    Motion::Forward => Motion::Backward,
                    _ => Motion::Forward,
                };
                for body in self.machine.followers(leader) {
                    mode.motion[body] = turned;
                }
            }
            Change::Rest(leader) => {
                for body in self.machine.followers(leader) {
                    mode.motion[body] = Motion::Stuck;
                    self.z[SPEED[body]] = Double::ZERO;
                }
            }
            Change::Break(leader, motion) => {
                for body in self.machine.followers(leader) {
                    mode.motion[body] = motion;
                }
            }
        }
    }
}

/// Terms of the inputs from a time on.
fn inputs(pieces: &Pieces, time: Double, h: Double) -> [Polynomial; DRIVES] {
    std::array::from_fn(|drive| pieces[drive].series(time, h))
}

/// How far a Taylor series of the inputs serves.
fn reach_of(pieces: &Pieces) -> f64 {
    pieces.iter().map(Piece::reach).fold(f64::INFINITY, f64::min)
}
