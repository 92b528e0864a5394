//! The independent solver: Taylor series of order 32 in numbers of 106 bits, from one change of mode to the next.
//!
//! A condition of the present mode is a polynomial on each step; its first fall, found to the last bit, ends the mode.
//! At that
//! instant everything settles, limits, gear, spans and stops before bodies: a condition that is zero but for rounding
//! is judged by
//! the first term of its series that is not, and what fails changes, one after the other, until all hold.

use crate::double::Double;
use crate::input::{self, Piece};
use crate::law::{Change, Guard, Law, Limit, Mode, Motion, Touch};
use crate::machine::{CURRENT, Machine, ROTOR, SPEED, State, Taken, WAY};
use crate::root::{self, Polynomial};
use crate::series::{Noise, ORDER, Series, Size};
use std::collections::HashMap;
use std::rc::Rc;
use taut::case::Experiment;
use taut::stage::Stage;

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
    /// 0, 1, 2.
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
pub struct Run {
    /// r φ₁, x, r φ₃ less the start of the cart, m, at the times asked for, as far as it went.
    pub rows: Vec<[Double; 3]>,
    /// Changes of bodies.
    pub events: Vec<Event>,
    /// How it ended.
    pub ending: Ending,
    /// Taylor series computed.
    pub steps: usize,
}

/// How the numbers of a case become ours.
pub struct Numbers<'a> {
    /// Those of the machine and its start.
    pub machine: Taken<'a>,
    /// Those of the input.
    pub input: Taken<'a>,
    /// The rounding of a state after each step, as if it were kept in fewer bits.
    pub kept: Option<Taken<'a>>,
}

/// Runs `experiment` on `stage` with its numbers as they are and gives the ways at `times`, which grow.
pub fn run(stage: &Stage, experiment: &Experiment, times: &[f64]) -> Result<Run, String> {
    let numbers = Numbers { machine: &mut Double::from, input: &mut Double::from, kept: None };
    run_with(stage, experiment, times, numbers)
}

/// The same with other numbers.
pub fn run_with(stage: &Stage, experiment: &Experiment, times: &[f64], numbers: Numbers) -> Result<Run, String> {
    let end = times.last().copied().unwrap_or(0.0);
    let machine = Machine::new(stage, experiment, numbers.machine);
    let chain = input::chain(&experiment.input, end, numbers.input)?;
    let mut solver = Solver::new(&machine, times, numbers.kept);
    for (i, piece) in chain.iter().enumerate() {
        let until = chain.get(i + 1).map_or(Double::from(end), |next| next.start);
        solver.settle(piece);
        solver.advance(piece, until);
        if solver.ending != Ending::Complete {
            break;
        }
    }
    solver.record_up_to(solver.time, None);
    Ok(Run { rows: solver.rows, events: solver.events, ending: solver.ending, steps: solver.steps })
}

/// A law and the length of step that suits it.
struct Prepared {
    law: Law,
    step: std::cell::Cell<f64>,
}

struct Solver<'a, 'b> {
    machine: &'a Machine,
    times: &'a [f64],
    kept: Option<Taken<'b>>,
    z: State,
    /// Largest values so far.
    size: Size,
    time: Double,
    mode: Mode,
    laws: HashMap<Mode, Rc<Prepared>>,
    rows: Vec<[Double; 3]>,
    events: Vec<Event>,
    instants: usize,
    /// Where the last change was, and how many there have been there.
    last_change: (Double, usize),
    ending: Ending,
    steps: usize,
}

impl<'a, 'b> Solver<'a, 'b> {
    fn new(machine: &'a Machine, times: &'a [f64], kept: Option<Taken<'b>>) -> Self {
        let z = machine.start;
        let motion = [0, 1, 2].map(|body| {
            let leader = machine.leader(body);
            match z[SPEED[leader]] {
                _ if !machine.is_dry(leader) => Motion::Free,
                v if v > Double::ZERO => Motion::Forward,
                v if v < Double::ZERO => Motion::Backward,
                _ => Motion::Stuck,
            }
        });
        let mode = Mode {
            motion,
            gear_positive: true,
            slack: [false; 3],
            gear: Touch::Apart,
            stop: Touch::Apart,
            passed: [0; 2],
            voltage: Limit::Within,
            current: Limit::Within,
        };
        Self {
            machine,
            times,
            kept,
            z,
            size: Size { states: z.map(|z| z.high.abs()), input: 0.0 },
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

    fn prepared(&mut self) -> Rc<Prepared> {
        let machine = self.machine;
        let prepare = |mode: Mode| {
            let law = Law::new(machine, mode);
            let step = 1.7 / law.rates.fastest();
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
    fn advance(&mut self, piece: &Piece, until: Double) {
        while self.time < until && self.ending == Ending::Complete {
            self.steps += 1;
            if self.steps > MOST_STEPS {
                self.give_up("too many steps");
            }
            let prepared = self.prepared();
            let law = &prepared.law;
            let rest = until - self.time;
            let mut step = prepared.step.get().min(piece.reach());
            let (series, h, reach) = loop {
                let h = if step >= rest.high { rest } else { Double::from(step) };
                let series = Series::new(&law.rates, &self.z, piece.series(self.time, h), h);
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
            self.size.input = self.size.input.max(series.input_size());
            let part = reach.min(1.0);
            let fall = self.first_fall(law, &series, part, h);
            let s = fall.as_ref().map_or(Double::from(part), |(s, _)| *s);
            let after = if whole && part == 1.0 && fall.is_none() { until } else { self.time + h * s };
            self.record_up_to(after, Some((&series, h)));
            self.z = series.at(s);
            self.time = after;
            self.keep();
            for (size, z) in self.size.states.iter_mut().zip(&self.z) {
                *size = size.max(z.high.abs());
            }
            if let Some((_, change)) = fall {
                self.fire(change, piece);
            }
        }
    }

    /// Rounds what moves as if it were kept in fewer bits: stretches, the cart's way, speeds, the current.
    fn keep(&mut self) {
        let Some(kept) = &mut self.kept else { return };
        let mut change = |value: Double| kept(value.high) - Double::from(value.high);
        let moves = self.mode.motion.map(|motion| motion != Motion::Stuck);
        let common = change(self.z[WAY[1]]);
        let [drive, cart, idler] = WAY.map(|way| self.z[way]);
        let strain = [change(drive - cart), Double::ZERO, change(idler - cart)];
        for body in (0..3).filter(|&body| moves[body]) {
            self.z[WAY[body]] += common + strain[body];
            let speed = self.z[SPEED[body]];
            self.z[SPEED[body]] += change(speed);
        }
        for place in [CURRENT, ROTOR[1]] {
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
            self.rows.push([0, 1, 2].map(|body| z[WAY[body]] + self.machine.beyond[body]));
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
                if c.high.abs() > noise.of(row, k) {
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
    fn fire(&mut self, change: Change, piece: &Piece) {
        let before = self.mode.motion;
        self.make(change);
        self.settle_from(before, piece);
    }

    /// Changes, without time passing, until every condition holds.
    fn settle(&mut self, piece: &Piece) {
        self.settle_from(self.mode.motion, piece);
    }

    fn settle_from(&mut self, before: [Motion; 3], piece: &Piece) {
        while self.ending == Ending::Complete {
            let Some(change) = self.first_broken(piece) else { break };
            self.make(change);
        }
        for body in (0..3).filter(|&body| self.machine.leader(body) == body) {
            let (from, to) = (before[body], self.mode.motion[body]);
            if from != to {
                self.events.push(Event { time: self.time.high, body, from, to });
            }
        }
    }

    /// The first condition that does not hold at this instant and just after.
    fn first_broken(&mut self, piece: &Piece) -> Option<Change> {
        let prepared = self.prepared();
        let law = &prepared.law;
        let step = prepared.step.get().min(piece.reach());
        let h = Double::from(if step.is_finite() { step } else { 1.0 });
        let series = Series::new(&law.rates, &self.z, piece.series(self.time, h), h);
        let mut noise = None;
        let broken = |guard: &&Guard| {
            let now = series.value(&guard.row).high;
            if now > series.change(&guard.row) {
                return false;
            }
            let noise = noise.get_or_insert_with(|| Noise::new(&law.rates, &series, h.high, &self.size));
            let c = series.polynomial(&guard.row);
            let told = c.iter().enumerate().find(|&(k, c)| c.high.abs() > noise.of(&guard.row, k));
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
            Change::Voltage(limit) => mode.voltage = limit,
            Change::Current(limit) => {
                mode.current = limit;
                let stands = self.machine.current_moves() && !self.machine.current_mode;
                if let (true, Some(bound)) = (stands, self.machine.current_limit) {
                    match limit {
                        Limit::High => self.z[CURRENT] = bound,
                        Limit::Low => self.z[CURRENT] = -bound,
                        Limit::Within => {}
                    }
                }
            }
            Change::GearSign => mode.gear_positive = !mode.gear_positive,
            Change::Span(j, slack) => mode.slack[j] = slack,
            Change::Gear(touch) => mode.gear = touch,
            Change::Stop(touch) => mode.stop = touch,
            Change::Passed(which, points) => mode.passed[which] = points,
            Change::Leave => self.ending = Ending::LeftTravel(self.time.high),
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
