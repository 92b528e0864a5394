//! A move run in closed loop, and what it shows.

use super::rest::Swing;
use super::sampled::{Added, Controller, Loop, Sample};
use super::sampling::Sampled;
use super::standard::Standard;
use crate::case::Experiment;
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::machine::axis::{CART, DRIVE};
use crate::mechanism::{Limit, Mode, State};
use crate::metrics::{Meter, Metrics, Peak};
use crate::signal::Signal;
use crate::signal::profile::Profile;
use crate::solve::{self, Curve, Detail, Flow, Gap, Observe, Polynomial, Solver, TERMS, reading};
use crate::trajectory::{Column, Trajectory};

/// A difference over time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deviation {
    /// Its largest magnitude, with its sign, m.
    pub peak: Peak,
    /// Its root mean square over the time of the run, m.
    pub rms: f64,
    /// At the end, m.
    pub last: f64,
}

/// The key figures of a move: peaks over all instants and not only over rows, integrals over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figures {
    /// r φ₁ − y: the drive pulley from the cart's reference. A controller that makes up for the belt's stretch means
    /// part of it.
    pub following: Deviation,
    /// x − y: the cart from its reference.
    pub cart: Deviation,
    /// x − y at the end, m.
    pub final_cart_error: f64,
    /// From the end of the profile, a shaper apart, until the cart stays within the window around its target, s; none
    /// if it does not.
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
    /// Its key figures.
    pub figures: Figures,
    /// The key figures of any run.
    pub metrics: Metrics,
    /// Events, ending and cost.
    pub outcome: solve::Outcome,
    /// Samples taken by the controller, those held back by its limit, and the samples themselves where they were to be
    /// kept.
    pub samples: (u64, u64),
    /// The samples, if asked for.
    pub kept: Vec<Sample>,
    /// The swing of the command after the profile.
    pub swing: Swing,
}

/// Everything that a closed loop needs.
#[derive(Debug, Clone, Copy)]
pub struct Setup<'a> {
    /// The axis.
    pub machine: &'a Machine,
    /// The machine that the controller assumes; mostly the same.
    pub model: &'a Machine,
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
    close(setup.machine, &mut controller, &timing, &profile, setup.until, setup.window, setup.solver)
}

/// The same of a search that runs it a thousand times, with a controller and a shaped profile that are made once: of the
/// figures the cart's error, settling and the root mean square of the current, equal to those of [`closed_loop`] (root
/// mean squares to rounding, the others to the last bit), and how it ended.
pub fn closed_loop_briefly(
    machine: &Machine,
    controller: &mut Standard,
    timing: &Loop,
    profile: &Profile,
    (until, window): (f64, f64),
    solver: Solver,
) -> Result<(Figures, solve::Ending)> {
    timing.check(until)?;
    let experiment = at_rest(machine, profile, until, timing.every.min(until));
    let mut gauge = Gauge { is_brief: true, ..Gauge::new(machine, &experiment, profile, window) };
    let outcome =
        unrecorded((machine, &experiment), controller, (timing, profile), solver, Some(&mut gauge), |_, _, _| {})?;
    Ok((gauge.finish(&outcome.events).0, outcome.ending))
}

/// Runs a controller along a profile without rows; `see` is shown its samples, as [`Sampled::drive`] says.
pub(super) fn unrecorded(
    (machine, experiment): (&Machine, &Experiment),
    controller: &mut Standard,
    (timing, profile): (&Loop, &Profile),
    solver: Solver,
    observer: Option<&mut impl Observe>,
    see: impl FnMut(f64, &State, f64),
) -> Result<solve::Outcome> {
    controller.reset();
    let mut sampled = Sampled::new(machine, controller, *timing, profile, false).until(experiment.until);
    let sink = &mut |_: &Trajectory| Flow::Continue;
    let observer = observer.map(|observer| observer as &mut dyn Observe);
    let mut run = solve::Run::new(machine, experiment, solver, Detail::None, observer, sink)?;
    sampled.drive(&mut run, experiment.until, see);
    Ok(run.finish())
}

/// A run from rest at the start of a profile, without an input of its own.
pub(super) fn at_rest(machine: &Machine, profile: &Profile, until: f64, every: f64) -> Experiment {
    let start = profile.start();
    Experiment {
        name: String::new(),
        inputs: vec![Signal::Step { value: 0.0, at: 0.0 }],
        until,
        every,
        initial: machine.at_rest(start),
        log: None,
    }
}

/// Runs any controller along a profile, from rest at its start, for `until` s; the cart has settled within `window` (m)
/// of its target.
pub fn close(
    machine: &Machine,
    controller: &mut dyn Controller,
    timing: &Loop,
    profile: &Profile,
    until: f64,
    window: f64,
    solver: Solver,
) -> Result<MoveRun> {
    let rows = Rows { until, every: timing.every.min(until), window };
    run(machine, controller, timing, profile, &rows, solver, (Detail::None, false), &mut |_| Flow::Continue)
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
    machine: &Machine,
    controller: &mut dyn Controller,
    timing: &Loop,
    profile: &Profile,
    rows: &Rows,
    solver: Solver,
    keep: bool,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<MoveRun> {
    let mut wide = Wide::default();
    let sink = &mut |block: &Trajectory| sink(wide.of(profile, block));
    run(machine, controller, timing, profile, rows, solver, (Detail::Full, keep), sink)
}

#[allow(clippy::too_many_arguments)]
fn run(
    machine: &Machine,
    controller: &mut dyn Controller,
    timing: &Loop,
    profile: &Profile,
    rows: &Rows,
    solver: Solver,
    (detail, keep): (Detail, bool),
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<MoveRun> {
    timing.check(rows.until)?;
    if !(rows.window > 0.0 && rows.window.is_finite()) {
        return Err(Error::new(format!("the cart cannot settle within {:?} m", rows.window)).allowed("above zero"));
    }
    let experiment = at_rest(machine, profile, rows.until, rows.every);
    controller.reset();
    let mut sampled = Sampled::new(machine, controller, *timing, profile, keep).until(rows.until);
    let mut gauge = Gauge::new(machine, &experiment, profile, rows.window);
    let mut run = solve::Run::new(machine, &experiment, solver, detail, Some(&mut gauge), sink)?;
    sampled.drive(&mut run, experiment.until, |_, _, _| {});
    let outcome = run.finish();
    let (mut figures, metrics) = gauge.finish(&outcome.events);
    figures.limited = sampled.held_back;
    figures.restlessness = sampled.turns as f64 / metrics.end.max(f64::MIN_POSITIVE);
    let samples = (sampled.samples, sampled.limited);
    let swing = sampled.at_rest.swing();
    Ok(MoveRun { figures, metrics, outcome, samples, kept: sampled.kept.unwrap_or_default(), swing })
}

/// Puts the controller of a design, made for `model`, through an experiment along a reference that is shaped already;
/// its input is not asked for. Positions are read exactly: a count more or less at a sample would make what comes out
/// jump as parameters change.
pub fn follow(
    machine: &Machine,
    model: &Machine,
    design: &Design,
    (profile, added): (&Profile, Option<&Added>),
    experiment: &Experiment,
    solver: Solver,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<solve::Outcome> {
    let mut controller = Standard::new(design, model)?;
    let mut sampled = Sampled::new(machine, &mut controller, Loop::of(design), profile, false).exactly().with(added);
    let machine = Machine { encoder: None, ..machine.clone() };
    let mut run = solve::Run::new(&machine, experiment, solver, Detail::Full, None, sink)?;
    sampled.drive(&mut run, experiment.until, |_, _, _| {});
    Ok(run.finish())
}

/// Gathers the figures of a move that it observes.
struct Gauge<'a> {
    meter: Meter,
    profile: &'a Profile,
    window: f64,
    radius: f64,
    /// Begin and direction of the last stroke.
    last_stroke: (f64, f64),
    target: f64,
    seen: Figures,
    /// ∫ of the squares of following error, cart error, voltage and current.
    squares: [f64; 4],
    /// When the cart was outside its window for the last time after the profile, and whether it is now.
    outside: Option<f64>,
    is_outside: bool,
    /// Whether the amplifier stands at a limit where it is now.
    saturated: bool,
    end: f64,
    /// Whether the cart's error, settling and current are all that is asked for.
    is_brief: bool,
}

impl<'a> Gauge<'a> {
    fn new(machine: &Machine, experiment: &Experiment, profile: &'a Profile, window: f64) -> Self {
        let last = profile.strokes().last().map_or((0.0, 0.0), |(begin, _, distance, _)| (begin, distance));
        Self {
            meter: Meter::new(machine, experiment),
            profile,
            window,
            radius: machine.pulley_radius,
            last_stroke: last,
            target: profile.target(),
            seen: Figures::default(),
            squares: [0.0; 4],
            outside: None,
            is_outside: false,
            saturated: false,
            end: 0.0,
            is_brief: false,
        }
    }

    /// Adds voltage and current over a curve.
    fn power(&mut self, curve: &Curve) {
        let (v, i) = (curve.of(reading::VOLTAGE), curve.of(reading::CURRENT));
        if self.is_brief {
            self.squares[3] += curve.length * integral((0.0, 1.0), |s| i.at(s).powi(2));
            return;
        }
        larger(&mut self.seen.voltage.0, &v, (0.0, 1.0), curve);
        larger(&mut self.seen.current.0, &i, (0.0, 1.0), curve);
        let h = curve.length;
        let (volts, amperes) = (at_places(&v), at_places(&i));
        self.squares[2] += h * product(&volts, &volts);
        self.squares[3] += h * product(&amperes, &amperes);
        // Energy that goes in and energy that comes back, parted where either changes its sign.
        let mut count = |energy: f64| {
            if energy > 0.0 { self.seen.energy.0 += energy } else { self.seen.energy.1 -= energy }
        };
        if v.keeps_its_sign() && i.keeps_its_sign() {
            count(h * product(&volts, &amperes));
        } else {
            let mut seams = vec![0.0, 1.0];
            for turning in [v, i].iter().filter(|quantity| !quantity.keeps_its_sign()) {
                seams.extend(turning.zeros(0.0, 1.0));
            }
            seams.sort_by(f64::total_cmp);
            for pair in seams.windows(2) {
                count(h * integral((pair[0], pair[1]), |s| v.at(s) * i.at(s)));
            }
        }
        if self.saturated {
            self.seen.amplifier_limited += h;
        }
    }

    /// Adds the cart's motion over the part of a curve on which the reference is one polynomial.
    fn track(&mut self, curve: &Curve, part: (f64, f64), reference: &Polynomial) {
        let (x, stretch) = (curve.of(reading::CART_POSITION), curve.of(reading::STRETCH));
        // x − y and r φ₁ − y = x − y + d₁
        let error = Polynomial(std::array::from_fn(|k| x.0[k] - reference.0[k]));
        if self.is_brief {
            larger(&mut self.seen.cart.peak, &error, part, curve);
            self.squares[1] += curve.length * integral(part, |s| error.at(s).powi(2));
            return;
        }
        let following = Polynomial(std::array::from_fn(|k| error.0[k] + stretch.0[k]));
        larger(&mut self.seen.cart.peak, &error, part, curve);
        larger(&mut self.seen.following.peak, &following, part, curve);
        for (sum, quantity) in self.squares.iter_mut().zip([following, error]) {
            let square = match part {
                (0.0, 1.0) => {
                    let values = at_places(&quantity);
                    product(&values, &values)
                }
                _ => integral(part, |s| quantity.at(s).powi(2)),
            };
            *sum += curve.length * square;
        }
    }

    /// Where the cart is from its target, once the last stroke and the profile have passed.
    fn settle(&mut self, curve: &Curve) {
        let mut away = curve.of(reading::CART_POSITION);
        away.0[0] -= self.target;
        let share = |time: f64| ((time - curve.begin) / curve.length).max(0.0);
        let (last, done) = (share(self.last_stroke.0), share(self.profile.end()));
        if last < 1.0 && self.last_stroke.1 != 0.0 {
            let beyond = if self.last_stroke.1 > 0.0 { away } else { away.negative() };
            if beyond.bound() > self.seen.overshoot {
                self.seen.overshoot = self.seen.overshoot.max(beyond.greatest(last, 1.0).1);
            }
        }
        self.is_outside = done < 1.0 && away.at(1.0).abs() > self.window;
        if done < 1.0 && away.bound() > self.window {
            if self.is_outside {
                self.outside = Some(curve.begin + curve.length);
                return;
            }
            let edges = [-self.window, self.window].map(|edge| {
                let mut beyond = away;
                beyond.0[0] -= edge;
                beyond.zeros(done, 1.0).last().copied()
            });
            if let Some(s) = edges.into_iter().flatten().reduce(f64::max) {
                self.outside = Some(curve.begin + s * curve.length);
            }
        }
    }

    fn finish(mut self, events: &[solve::Event]) -> (Figures, Metrics) {
        let seen = &mut self.seen;
        let [following, cart, voltage, current] =
            self.squares.map(|sum| (sum / self.end.max(f64::MIN_POSITIVE)).sqrt());
        (seen.following.rms, seen.cart.rms, seen.voltage.1, seen.current.1) = (following, cart, voltage, current);
        seen.final_cart_error = seen.cart.last;
        let done = self.profile.end();
        seen.settling = match self.outside {
            _ if self.end < done || self.is_outside => None,
            None => Some(0.0),
            Some(last) => Some(last - done),
        };
        (self.seen, self.meter.finish(events))
    }
}

impl Observe for Gauge<'_> {
    fn pass(&mut self, gap: &Gap) -> bool {
        if self.is_brief {
            return true;
        }
        self.meter.pass(gap);
        let drive = &gap.mode.drive[0];
        self.saturated = drive.voltage != Limit::Inside || drive.current != Limit::Inside;
        for (peak, q) in [(&mut self.seen.voltage.0, reading::VOLTAGE), (&mut self.seen.current.0, reading::CURRENT)] {
            for (value, time) in [(gap.from[q], gap.begin), (gap.to[q], gap.begin + gap.length)] {
                if value.abs() > peak.value.abs() {
                    *peak = Peak { value, time };
                }
            }
        }
        true
    }

    fn see(&mut self, curve: &Curve) {
        if !self.is_brief {
            self.meter.see(curve);
        }
        self.power(curve);
        // A seam that is as near as rounding is behind.
        let shortest = SHORTEST + 16.0 * f64::EPSILON * (curve.begin + curve.length) / curve.length;
        let mut from = 0.0;
        while from < 1.0 {
            let begin = curve.begin + from * curve.length;
            let (coefficients, until) = self.profile.piece(begin);
            let to = ((until - curve.begin) / curve.length).max(from + shortest).min(1.0);
            self.track(curve, (from, to), &shifted(&coefficients, from, curve.length));
            from = to;
        }
        self.settle(curve);
    }

    fn sees_all(&self) -> bool {
        true
    }

    fn end(&mut self, time: f64, state: &State, mode: &Mode) {
        self.meter.end(time, state, mode);
        let y = self.profile.at(time).position;
        self.end = time;
        self.seen.cart.last = state.position[CART] - y;
        self.seen.following.last = self.radius * state.position[DRIVE] - y;
    }
}

/// Least share of a curve that a piece of the reference is looked at.
const SHORTEST: f64 = 1e-9;

/// Σ c_k τᵏ, τ = (s − `from`) · `length`, in powers of s.
fn shifted(coefficients: &[f64; 5], from: f64, length: f64) -> Polynomial {
    let mut terms = [0.0; TERMS];
    terms[..5].copy_from_slice(coefficients);
    let mut power = 1.0;
    for term in &mut terms {
        *term *= power;
        power *= length;
    }
    // Horner, again and again: in powers of s instead of s − from.
    if from != 0.0 {
        for i in 0..4 {
            for j in (i..4).rev() {
                terms[j] -= from * terms[j + 1];
            }
        }
    }
    Polynomial(terms)
}

/// Takes the largest magnitude on a part of a curve, if it is news.
fn larger(peak: &mut Peak, quantity: &Polynomial, part: (f64, f64), curve: &Curve) {
    if quantity.bound() > peak.value.abs() {
        let (s, value) = quantity.largest(part.0, part.1);
        if value.abs() > peak.value.abs() {
            *peak = Peak { value, time: curve.begin + s * curve.length };
        }
    }
}

/// Places and weights of Gauss and Legendre's rule of eight places on −1..1, one half of them: exact for polynomials of
/// degree 15, and products of two [`Polynomial`]s have degree 14.
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Powers of the places of that rule on 0..1, by powers and places; and the weights.
const POWERS: [[f64; PLACES]; TERMS] = {
    let (mut powers, mut k) = ([[1.0; PLACES]; TERMS], 1);
    while k < TERMS {
        let mut j = 0;
        while j < PLACES {
            let (x, _) = GAUSS[j / 2];
            let place = if j % 2 == 0 { 0.5 - 0.5 * x } else { 0.5 + 0.5 * x };
            powers[k][j] = powers[k - 1][j] * place;
            j += 1;
        }
        k += 1;
    }
    powers
};

const PLACES: usize = 2 * GAUSS.len();

/// The values of a polynomial at the places on 0..1.
fn at_places(polynomial: &Polynomial) -> [f64; PLACES] {
    let mut values = [0.0; PLACES];
    for (c, powers) in polynomial.0.iter().zip(&POWERS) {
        values.iter_mut().zip(powers).for_each(|(value, power)| *value += c * power);
    }
    values
}

/// The integral over 0..1 of the product of two polynomials, of which these are the values.
fn product(a: &[f64; PLACES], b: &[f64; PLACES]) -> f64 {
    let weighted = |(j, (_, w)): (usize, &(f64, f64))| w * (a[2 * j] * b[2 * j] + a[2 * j + 1] * b[2 * j + 1]);
    0.5 * GAUSS.iter().enumerate().map(weighted).sum::<f64>()
}

/// The integral over s on a part of 0..1.
fn integral((from, to): (f64, f64), value: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    GAUSS.iter().map(|(x, w)| w * (value(middle - half * x) + value(middle + half * x))).sum::<f64>() * half
}

/// Blocks of rows with reference and error behind their own columns.
#[derive(Default)]
struct Wide {
    block: Trajectory,
}

impl Wide {
    fn of(&mut self, profile: &Profile, block: &Trajectory) -> &Trajectory {
        let own = block.columns.len();
        if self.block.columns.len() != own + 2 {
            self.block.columns.clone_from(&block.columns);
            self.block.columns.push(Column::new("reference", "m"));
            self.block.columns.push(Column::new("cart_error", "m"));
        }
        let column = |name: &str| block.get(name).unwrap_or(&[]);
        let reference: Vec<f64> = column("time").iter().map(|&t| profile.at(t).position).collect();
        let error: Vec<f64> = column("cart_position").iter().zip(&reference).map(|(x, y)| x - y).collect();
        let sources = block.columns.iter().map(|column| &column.values).chain([&reference, &error]);
        for (to, from) in self.block.columns.iter_mut().zip(sources) {
            to.values.clone_from(from);
        }
        &self.block
    }
}
