//! A move run in closed loop, and what it shows.

use super::sampled::{Controller, Loop, Sample, Sampled};
use super::standard::Standard;
use crate::case::{Experiment, Initial};
use crate::design::Design;
use crate::error::{Error, Result};
use crate::metrics::{Meter, Metrics, Peak};
use crate::signal::Signal;
use crate::signal::profile::Profile;
use crate::solve::{self, Flow, Solver};
use crate::stage::Stage;
use crate::trajectory::{Column, Trajectory};

/// A difference over time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deviation {
    /// Its largest magnitude, with its sign, m.
    pub peak: Peak,
    /// Its root mean square over the run, m.
    pub rms: f64,
    /// In the last row, m.
    pub last: f64,
}

/// What a move shows. All but the counts of samples are seen at rows: a row each sample shows what is held in between.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figures {
    /// r φ₁ − y: the drive pulley from the cart's reference. A controller that makes up for the belt's stretch means part of it.
    pub following: Deviation,
    /// x − y: the cart from its reference.
    pub cart: Deviation,
    /// x − y at the end, m.
    pub final_cart_error: f64,
    /// From the end of the profile, a shaper apart, until the cart stays within the window around its target, s; none if it does not.
    pub settling: Option<f64>,
    /// By how much the cart passes its target after the beginning of the last stroke, m.
    pub overshoot: f64,
    /// Motor current: largest and root mean square, A.
    pub current: (Peak, f64),
    /// Motor voltage: largest and root mean square, V.
    pub voltage: (Peak, f64),
    /// Time during which the controller's own limit held its command back, s.
    pub limited: f64,
    /// Time during which the amplifier stood at its limit of voltage or current, s.
    pub amplifier_limited: f64,
    /// Electrical energy taken in and given back, J.
    pub energy: (f64, f64),
    /// Changes of direction of the command per second: what hunting sounds like.
    pub restlessness: f64,
}

/// A move that was run.
#[derive(Debug, Clone)]
pub struct MoveRun {
    /// What it shows.
    pub figures: Figures,
    /// What every run shows.
    pub metrics: Metrics,
    /// Events, ending and cost.
    pub outcome: solve::Outcome,
    /// Samples taken by the controller, those held back by its limit, and the samples themselves where they were to be kept.
    pub samples: (u64, u64),
    /// The samples, if asked for.
    pub kept: Vec<Sample>,
}

/// Everything that a closed loop needs.
#[derive(Debug, Clone, Copy)]
pub struct Setup<'a> {
    /// The axis.
    pub stage: &'a Stage,
    /// What the controller takes it for; mostly the same.
    pub model: &'a Stage,
    /// The controller.
    pub design: &'a Design,
    /// The reference of the cart.
    pub profile: &'a Profile,
    /// End of the run, s.
    pub until: f64,
    /// Half the width of the window in which the cart counts as settled, m.
    pub window: f64,
    /// How the equations are solved.
    pub solver: Solver,
}

/// Runs a design along a profile: pure, and as cheap as a run of the axis, so that a search can call it often.
pub fn closed_loop(setup: &Setup) -> Result<MoveRun> {
    let mut controller = Standard::new(setup.design, setup.model)?;
    let profile = setup.profile.clone().shaped(&setup.design.shaper);
    let timing = Loop::of(setup.design);
    close(setup.stage, &mut controller, &timing, &profile, setup.until, setup.window, setup.solver)
}

/// Runs any controller along a profile, from rest at its start, for `until` s; the cart has settled within `window` (m) of its target.
pub fn close(
    stage: &Stage,
    controller: &mut dyn Controller,
    timing: &Loop,
    profile: &Profile,
    until: f64,
    window: f64,
    solver: Solver,
) -> Result<MoveRun> {
    let rows = Rows { until, every: timing.every.min(until), window };
    stream(stage, controller, timing, profile, &rows, solver, false, &mut |_| Flow::Continue)
}

/// Which rows are put out, and the window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rows {
    /// End of the run, s.
    pub until: f64,
    /// Interval between rows, s.
    pub every: f64,
    /// Half the width of the window in which the cart counts as settled, m.
    pub window: f64,
}

/// The same, handing each block of rows on to `sink`, with columns `reference` and `cart_error` behind the others.
#[allow(clippy::too_many_arguments)] // each is one thing, and the functions above leave most out
pub fn stream(
    stage: &Stage,
    controller: &mut dyn Controller,
    timing: &Loop,
    profile: &Profile,
    rows: &Rows,
    solver: Solver,
    keep: bool,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<MoveRun> {
    timing.check(rows.until)?;
    if !(rows.window > 0.0 && rows.window.is_finite()) {
        return Err(Error::new(format!("the cart cannot settle within {:?} m", rows.window)).allowed("above zero"));
    }
    let start = profile.start();
    let angle = start / stage.pulley_radius;
    let experiment = Experiment {
        name: String::new(),
        input: Signal::Step { value: 0.0, at: 0.0 },
        until: rows.until,
        every: rows.every,
        initial: Initial { drive_angle: angle, cart_position: start, idler_angle: angle, ..Initial::default() },
        log: None,
    };
    controller.reset();
    let mut sampled = Sampled::new(stage, controller, *timing, profile, keep);
    let mut meter = Meter::new(stage);
    let mut gauge = Gauge::new(stage, profile, rows);
    let mut wide = Trajectory::default();
    let outcome = solve::stream_decided(stage, &experiment, &mut sampled, solver, &mut |block| {
        meter.take(block);
        gauge.take(block);
        gauge.widen(block, &mut wide);
        sink(&wide)
    })?;
    let mut figures = gauge.finish();
    figures.limited = sampled.limited as f64 * timing.every;
    let metrics = meter.finish(&outcome.events);
    let samples = (sampled.samples, sampled.limited);
    Ok(MoveRun { figures, metrics, outcome, samples, kept: sampled.kept.unwrap_or_default() })
}

/// Puts the controller of a design, made for `model`, through an experiment along a reference that is shaped already; its input is not
/// asked for. Positions are read exactly: a count more or less at a sample would make what comes out jump as parameters change.
pub(crate) fn follow(
    stage: &Stage,
    model: &Stage,
    design: &Design,
    profile: &Profile,
    experiment: &Experiment,
    solver: Solver,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<solve::Outcome> {
    let mut controller = Standard::new(design, model)?;
    let mut sampled = Sampled::new(stage, &mut controller, Loop::of(design), profile, false).exactly();
    solve::stream_decided(&Stage { encoder: None, ..stage.clone() }, experiment, &mut sampled, solver, sink)
}

/// Gathers the figures row by row.
struct Gauge<'a> {
    profile: &'a Profile,
    rows: Rows,
    radius: f64,
    limits: [Option<f64>; 2],
    last_stroke: (f64, f64),
    target: f64,
    seen: Figures,
    squares: [f64; 4],
    count: f64,
    outside: Option<f64>,
    reference: Vec<f64>,
    error: Vec<f64>,
    way: f64,
    turns: f64,
    command: f64,
    end: f64,
}

impl<'a> Gauge<'a> {
    fn new(stage: &Stage, profile: &'a Profile, rows: &Rows) -> Self {
        let last = profile.strokes().last().map_or((0.0, 0.0), |(begin, _, distance, _)| (begin, distance));
        Self {
            profile,
            rows: *rows,
            radius: stage.pulley_radius,
            limits: [stage.amplifier.voltage_limit, stage.amplifier.current_limit],
            last_stroke: last,
            target: profile.target(),
            seen: Figures::default(),
            squares: [0.0; 4],
            count: 0.0,
            outside: None,
            reference: Vec::new(),
            error: Vec::new(),
            way: 0.0,
            turns: 0.0,
            command: 0.0,
            end: 0.0,
        }
    }

    fn take(&mut self, block: &Trajectory) {
        let column = |name: &str| block.get(name).unwrap_or(&[]);
        let [time, drive, cart] = ["time", "drive_angle", "cart_position"].map(column);
        let [voltage, current] = ["voltage", "motor_current"].map(column);
        let command = block.get("input").unwrap_or(voltage);
        self.reference.clear();
        self.error.clear();
        let (every, window) = (self.rows.every, self.rows.window);
        let done = self.profile.end();
        let peak = |peak: &mut Peak, value: f64, time: f64| {
            if value.abs() > peak.value.abs() {
                *peak = Peak { value, time };
            }
        };
        let seen = &mut self.seen;
        for row in 0..block.len() {
            let (t, y) = (time[row], self.profile.at(time[row]).position);
            let (following, error) = (self.radius * drive[row] - y, cart[row] - y);
            let (v, i) = (voltage[row], current[row]);
            self.reference.push(y);
            self.error.push(error);
            peak(&mut seen.following.peak, following, t);
            peak(&mut seen.cart.peak, error, t);
            peak(&mut seen.voltage.0, v, t);
            peak(&mut seen.current.0, i, t);
            for (sum, value) in self.squares.iter_mut().zip([following, error, v, i]) {
                *sum += value * value;
            }
            (seen.following.last, seen.cart.last) = (following, error);
            let power = v * i;
            if power > 0.0 {
                seen.energy.0 += power * every
            } else {
                seen.energy.1 -= power * every
            }
            let at = |limit: Option<f64>, value: f64| limit.is_some_and(|limit| value.abs() >= limit * (1.0 - 1e-12));
            if at(self.limits[0], v) || at(self.limits[1], i) {
                seen.amplifier_limited += every;
            }
            if t >= self.last_stroke.0 && self.last_stroke.1 != 0.0 {
                seen.overshoot = seen.overshoot.max(self.last_stroke.1.signum() * (cart[row] - self.target));
            }
            if t >= done && (cart[row] - self.target).abs() > window {
                self.outside = Some(t);
            }
            let change = command[row] - self.command;
            if change * self.way < 0.0 {
                self.turns += 1.0;
            }
            if change != 0.0 {
                self.way = change;
            }
            self.command = command[row];
            self.end = t;
            self.count += 1.0;
        }
    }

    /// The block with reference and error behind its own columns.
    fn widen(&self, block: &Trajectory, wide: &mut Trajectory) {
        let own = block.columns.len();
        if wide.columns.len() != own + 2 {
            wide.columns.clone_from(&block.columns);
            wide.columns.push(Column::new("reference", "m"));
            wide.columns.push(Column::new("cart_error", "m"));
        }
        let sources = block.columns.iter().map(|column| &column.values).chain([&self.reference, &self.error]);
        for (to, from) in wide.columns.iter_mut().zip(sources) {
            to.values.clone_from(from);
        }
    }

    fn finish(self) -> Figures {
        let mut seen = self.seen;
        let [following, cart, voltage, current] = self.squares.map(|sum| (sum / self.count.max(1.0)).sqrt());
        (seen.following.rms, seen.cart.rms, seen.voltage.1, seen.current.1) = (following, cart, voltage, current);
        seen.final_cart_error = seen.cart.last;
        let done = self.profile.end();
        seen.settling = match self.outside {
            _ if self.end < done => None,
            None => Some(0.0),
            // It has settled if a row inside followed.
            Some(last) if last + 0.5 * self.rows.every < self.end => Some(last + self.rows.every - done),
            Some(_) => None,
        };
        seen.restlessness = self.turns / self.end.max(f64::MIN_POSITIVE);
        seen
    }
}
