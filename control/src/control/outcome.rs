//! A move run in closed loop, and what it shows.

use super::contour::{Contour, ContourGauge};
use super::rest::Swing;
use super::sampled::{Added, Controller, Loop, Sample};
use super::sampling::Sampled;
use super::standard::Standard;
use crate::case::Experiment;
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::{Machine, SlideAt};
use crate::mechanism::{Limit, Mechanism, Mode, Shown, State};
use crate::metrics::{Held, Meter, Metrics, Peak, Sought};
use crate::signal::Signal;
use crate::signal::profile::Profile;
use crate::solve::{self, Curve, Detail, Flow, Gap, Observe, Polynomial, Solver, TERMS};
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

/// The key figures of a move, by the role of the parts: peaks over all instants and not only over rows, integrals over
/// time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figures {
    /// Of what slides: the cart of an axis, bridge and cart of a gantry.
    pub loads: Vec<LoadFigures>,
    /// Of the drives.
    pub drives: Vec<DriveFigures>,
    /// Distance from the path, to its left above zero, of a machine with two coordinates. Exact where the nearest leg is
    /// the same for a while; about corners its peak is sought between nine places of each piece of the motion.
    pub contour: Option<Deviation>,
    /// From the end of the profile, a shaper apart, until all that slides stays within the window around its target, s;
    /// none if it does not.
    pub settling: Option<f64>,
}

impl Figures {
    /// The figures of the cart.
    pub fn cart(&self) -> LoadFigures {
        self.loads.last().copied().unwrap_or_default()
    }

    /// The figures of the first drive.
    pub fn drive(&self) -> DriveFigures {
        self.drives.first().copied().unwrap_or_default()
    }
}

/// Key figures of what slides.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LoadFigures {
    /// x − y: its difference from its reference.
    pub error: Deviation,
    /// By how much it passes its target after the beginning of the last stroke, m.
    pub overshoot: f64,
}

/// Key figures of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DriveFigures {
    /// r φ − y: its pulley from the reference of its part of the belt. A controller that makes up for the belt's stretch
    /// means part of it.
    pub following: Deviation,
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
    /// The swing of each drive's command after the profile.
    pub swings: Vec<Swing>,
}

/// Everything that a closed loop needs.
#[derive(Debug, Clone, Copy)]
pub struct Setup<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The machine that the controller assumes; mostly the same.
    pub model: &'a Machine,
    /// The controller of each drive.
    pub design: &'a Design,
    /// The reference of each coordinate.
    pub profiles: &'a [Profile],
    /// End of the run, s.
    pub until: f64,
    /// Half the width of the window in which the cart counts as settled, m.
    pub window: f64,
    /// How the equations are solved.
    pub solver: Solver,
}

/// Runs a design along a profile: pure, and as cheap as a run of the axis, so that a search can call it often.
pub fn closed_loop(setup: &Setup) -> Result<MoveRun> {
    let &Setup { machine, model, design, profiles, until, window, solver } = setup;
    let shaped: Vec<Profile> = profiles.iter().map(|profile| profile.clone().shaped(&design.shaper)).collect();
    let mut controllers = Standard::of_drives(design, model)?;
    close(machine, &mut each(&mut controllers), &Loop::of(design), &shaped, until, window, solver)
}

/// Controllers of a design as [`close`] and [`stream`] take them.
pub fn each(controllers: &mut [Standard]) -> Vec<&mut dyn Controller> {
    controllers.iter_mut().map(|controller| controller as &mut dyn Controller).collect()
}

/// The same as [`closed_loop`] of a search that runs it a thousand times, with controllers and shaped profiles that are made once: of the
/// figures the error of what slides, settling and the root mean square of the current, equal to those of [`closed_loop`]
/// (root mean squares to rounding, the others to the last bit), and how it ended.
pub fn closed_loop_briefly(
    machine: &Machine,
    controllers: &mut [&mut dyn Controller],
    timing: &Loop,
    profiles: &[Profile],
    (until, window): (f64, f64),
    solver: Solver,
) -> Result<(Figures, solve::Ending)> {
    timing.check(until)?;
    let experiment = at_rest(machine, profiles, until, timing.every.min(until));
    let mut gauge = Gauge { is_brief: true, ..Gauge::new(machine, &experiment, profiles, window) };
    let outcome =
        unrecorded((machine, &experiment), controllers, (timing, profiles), solver, Some(&mut gauge), |_, _, _| {})?;
    Ok((gauge.finish(&outcome.events).0, outcome.ending))
}

/// Runs controllers along their profiles without rows; `see` is shown its samples, as [`Sampled::drive`] says.
pub(super) fn unrecorded(
    (machine, experiment): (&Machine, &Experiment),
    controllers: &mut [&mut dyn Controller],
    (timing, profiles): (&Loop, &[Profile]),
    solver: Solver,
    observer: Option<&mut impl Observe>,
    see: impl FnMut(f64, &State, f64),
) -> Result<solve::Outcome> {
    controllers.iter_mut().for_each(|controller| controller.reset());
    let mut sampled = Sampled::new(machine, controllers, *timing, profiles, false).until(experiment.until);
    let sink = &mut |_: &Trajectory| Flow::Continue;
    let observer = observer.map(|observer| observer as &mut dyn Observe);
    let mut run = solve::Run::reading(read(machine), experiment, solver, Detail::None, observer, sink)?;
    sampled.drive(&mut run, experiment.until, see);
    Ok(run.finish())
}

/// A machine, and its mechanism with the readings of a move.
fn read(machine: &Machine) -> (&Machine, Mechanism) {
    let mut mechanism = machine.mechanism();
    mechanism.readings = machine.readings_of_move(&mechanism);
    (machine, mechanism)
}

/// A run from rest at the start of the profiles, without inputs of its own.
pub(super) fn at_rest(machine: &Machine, profiles: &[Profile], until: f64, every: f64) -> Experiment {
    let starts: Vec<f64> = profiles.iter().map(Profile::start).collect();
    Experiment {
        name: String::new(),
        inputs: vec![Signal::Step { value: 0.0, at: 0.0 }; machine.drives.len()],
        until,
        every,
        initial: machine.without_strain(&starts, &[]),
        log: None,
    }
}

/// Runs controllers, one for each drive, along profiles, one for each coordinate, from rest at their start, for `until`
/// s; what slides has settled within `window` (m) of its target.
pub fn close(
    machine: &Machine,
    controllers: &mut [&mut dyn Controller],
    timing: &Loop,
    profiles: &[Profile],
    until: f64,
    window: f64,
    solver: Solver,
) -> Result<MoveRun> {
    let rows = Rows { until, every: timing.every.min(until), window };
    run(machine, controllers, timing, profiles, &rows, solver, (Detail::None, false), &mut |_| Flow::Continue)
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

/// The same, handing each block of rows on to `sink`, with columns of references and errors behind the others:
/// `reference` and `cart_error` of an axis, `bridge_reference`, `cart_reference`, `bridge_error` and `cart_error` of a
/// gantry.
#[allow(clippy::too_many_arguments)] // each is one thing, and the functions above leave most out
pub fn stream(
    machine: &Machine,
    controllers: &mut [&mut dyn Controller],
    timing: &Loop,
    profiles: &[Profile],
    rows: &Rows,
    solver: Solver,
    keep: bool,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<MoveRun> {
    let mut wide = Wide::of(machine);
    let sink = &mut |block: &Trajectory| sink(wide.widened(profiles, block));
    run(machine, controllers, timing, profiles, rows, solver, (Detail::Full, keep), sink)
}

#[allow(clippy::too_many_arguments)]
fn run(
    machine: &Machine,
    controllers: &mut [&mut dyn Controller],
    timing: &Loop,
    profiles: &[Profile],
    rows: &Rows,
    solver: Solver,
    (detail, keep): (Detail, bool),
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<MoveRun> {
    timing.check(rows.until)?;
    if !(rows.window > 0.0 && rows.window.is_finite()) {
        return Err(Error::new(format!("the cart cannot settle within {:?} m", rows.window)).allowed("above zero"));
    }
    let (loads, drives) = (machine.geometry().slides.len(), machine.drives.len());
    if profiles.len() != loads || controllers.len() != drives {
        let what = format!("{} controllers and {} profiles", controllers.len(), profiles.len());
        return Err(Error::new(what).allowed(format!("{drives} controllers, one for each drive, and {loads} profiles")));
    }
    let experiment = at_rest(machine, profiles, rows.until, rows.every);
    controllers.iter_mut().for_each(|controller| controller.reset());
    let mut sampled = Sampled::new(machine, controllers, *timing, profiles, keep).until(rows.until);
    let mut gauge = Gauge::new(machine, &experiment, profiles, rows.window);
    let mut run = solve::Run::reading(read(machine), &experiment, solver, detail, Some(&mut gauge), sink)?;
    sampled.drive(&mut run, experiment.until, |_, _, _| {});
    let outcome = run.finish();
    let (mut figures, metrics) = gauge.finish(&outcome.events);
    for (drive, told) in figures.drives.iter_mut().zip(&sampled.told) {
        drive.limited = told.held_back;
        drive.restlessness = told.turns as f64 / metrics.end.max(f64::MIN_POSITIVE);
    }
    let samples = (sampled.samples, sampled.limited);
    let swings = sampled.told.iter().take(drives).map(|told| told.at_rest.swing()).collect();
    Ok(MoveRun { figures, metrics, outcome, samples, kept: sampled.kept.unwrap_or_default(), swings })
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
    let (mut controllers, profiles) = ([&mut controller as &mut dyn Controller], std::slice::from_ref(profile));
    let sampled = Sampled::new(machine, &mut controllers, Loop::of(design), profiles, false);
    let mut sampled = sampled.exactly().with(added);
    let machine = Machine { encoder: None, ..machine.clone() };
    let mut run = solve::Run::new(&machine, experiment, solver, Detail::Full, None, sink)?;
    sampled.drive(&mut run, experiment.until, |_, _, _| {});
    Ok(run.finish())
}

/// Gathers the figures of a move that it observes.
struct Gauge<'a> {
    meter: Meter,
    profiles: &'a [Profile],
    window: f64,
    loads: Vec<LoadGauge>,
    drives: Vec<DriveGauge>,
    contour: Option<ContourGauge>,
    end: f64,
    /// Whether the errors of what slides, settling and current are all that is asked for.
    is_brief: bool,
}

/// What is gathered of something that slides.
struct LoadGauge {
    body: usize,
    /// The reading of its position.
    position: usize,
    /// Its largest speed, of a machine whose readings have none.
    peak_speed: Option<Peak>,
    /// Where the drives have it minus where it is, as a sum of stretches: reading and weight.
    stretches: Vec<(usize, f64)>,
    /// Begin and direction of the last stroke that goes anywhere.
    last_stroke: (f64, f64),
    target: f64,
    /// ∫ of the square of its error.
    square: f64,
    /// When it was outside its window for the last time after the profile, and whether it is now.
    outside: Option<f64>,
    is_outside: bool,
    seen: LoadFigures,
}

/// What is gathered of a drive.
struct DriveGauge {
    pulley: usize,
    /// The reading of its current.
    current: usize,
    voltage: Voltage,
    /// Weights of the coordinates in the position of its part of the belt.
    shares: &'static [f64],
    /// ∫ of the squares of following error, voltage and current.
    squares: [f64; 3],
    /// Whether its amplifier stands at a limit where it is now.
    saturated: bool,
    seen: DriveFigures,
}

/// The voltage at a motor's terminals.
enum Voltage {
    /// A reading.
    Read(usize),
    /// R i + L di/dt + K_e n φ̇ of the reading of the shaft's speed behind the gear.
    Computed { speed: usize, resistance: f64, inductance: f64, back_emf: f64 },
}

impl Voltage {
    fn on(&self, curve: &Curve, current: &Polynomial) -> Polynomial {
        match *self {
            Self::Read(q) => curve.of(q),
            Self::Computed { speed, resistance, inductance, back_emf } => {
                let (rate, speed) = (slope(current, curve.length), curve.of(speed));
                let sum = |k: usize| resistance * current.0[k] + inductance * rate.0[k] + back_emf * speed.0[k];
                Polynomial(std::array::from_fn(sum))
            }
        }
    }
}

/// The derivative by time of a quantity on a curve of this length, s.
fn slope(quantity: &Polynomial, length: f64) -> Polynomial {
    let term = |k: usize| if k + 1 < TERMS { (k + 1) as f64 * quantity.0[k + 1] / length } else { 0.0 };
    Polynomial(std::array::from_fn(term))
}

impl LoadGauge {
    fn new((slide, profile): (&SlideAt, &Profile), mechanism: &Mechanism) -> Self {
        let find = |shown: Shown| mechanism.readings.iter().position(|reading| *reading == shown);
        let strokes = profile.strokes().filter(|(_, _, distance, _)| *distance != 0.0);
        let stretch = |&(span, weight): &(usize, f64)| Some((find(Shown::Stretch(span))?, weight));
        Self {
            body: slide.body,
            position: find(Shown::Position(slide.body, 1.0)).unwrap_or_default(),
            peak_speed: match find(Shown::Speed(slide.body, 1.0)) {
                Some(_) => None,
                None => Some(Peak::default()),
            },
            stretches: slide.error.iter().filter_map(stretch).collect(),
            last_stroke: strokes.last().map_or((0.0, 0.0), |(begin, _, distance, _)| (begin, distance)),
            target: profile.target(),
            square: 0.0,
            outside: None,
            is_outside: false,
            seen: LoadFigures::default(),
        }
    }

    /// Where it is from its target, once the last stroke and the profile, which ends at `end`, have passed.
    fn settle(&mut self, curve: &Curve, end: f64, window: f64) {
        let mut away = curve.of(self.position);
        away.0[0] -= self.target;
        let share = |time: f64| ((time - curve.begin) / curve.length).max(0.0);
        let (last, done) = (share(self.last_stroke.0), share(end));
        if last < 1.0 && self.last_stroke.1 != 0.0 {
            let beyond = if self.last_stroke.1 > 0.0 { away } else { away.negative() };
            if beyond.bound() > self.seen.overshoot {
                self.seen.overshoot = self.seen.overshoot.max(beyond.greatest(last, 1.0).1);
            }
        }
        self.is_outside = done < 1.0 && away.at(1.0).abs() > window;
        if done < 1.0 && away.bound() > window {
            if self.is_outside {
                self.outside = Some(curve.begin + curve.length);
                return;
            }
            let edges = [-window, window].map(|edge| {
                let mut beyond = away;
                beyond.0[0] -= edge;
                beyond.zeros(done, 1.0).last().copied()
            });
            if let Some(s) = edges.into_iter().flatten().reduce(f64::max) {
                self.outside = Some(curve.begin + s * curve.length);
            }
        }
    }
}

impl DriveGauge {
    fn new(machine: &Machine, mechanism: &Mechanism, drive: usize) -> Self {
        let find = |shown: Shown| mechanism.readings.iter().position(|reading| *reading == shown);
        let mechanisms_drive = &mechanism.drives[drive];
        let motor = &mechanisms_drive.motor;
        Self {
            pulley: mechanisms_drive.pulley,
            current: find(Shown::Current(drive)).unwrap_or_default(),
            voltage: match find(Shown::Voltage(drive)) {
                Some(q) => Voltage::Read(q),
                None => Voltage::Computed {
                    speed: find(Shown::Speed(mechanisms_drive.shaft, 1.0)).unwrap_or_default(),
                    resistance: motor.resistance,
                    inductance: motor.inductance,
                    back_emf: motor.gear_ratio * motor.back_emf_constant,
                },
            },
            shares: machine.belt_shares()[drive],
            squares: [0.0; 3],
            saturated: false,
            seen: DriveFigures::default(),
        }
    }

    /// Adds voltage and current over a curve.
    fn power(&mut self, curve: &Curve, is_brief: bool) {
        let i = curve.of(self.current);
        if is_brief {
            self.squares[2] += curve.length * integral((0.0, 1.0), |s| i.at(s).powi(2));
            return;
        }
        let v = self.voltage.on(curve, &i);
        larger(&mut self.seen.voltage.0, &v, (0.0, 1.0), curve);
        larger(&mut self.seen.current.0, &i, (0.0, 1.0), curve);
        let h = curve.length;
        let (volts, amperes) = (at_places(&v), at_places(&i));
        self.squares[1] += h * product(&volts, &volts);
        self.squares[2] += h * product(&amperes, &amperes);
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
}

impl<'a> Gauge<'a> {
    fn new(machine: &Machine, experiment: &Experiment, profiles: &'a [Profile], window: f64) -> Self {
        let (_, mechanism) = read(machine);
        let loads = machine.geometry().slides.iter().zip(profiles);
        Self {
            meter: Meter::with(machine, &Sought::all(machine, &mechanism), Held::last(experiment)),
            profiles,
            window,
            loads: loads.map(|load| LoadGauge::new(load, &mechanism)).collect(),
            drives: (0..machine.drives.len()).map(|drive| DriveGauge::new(machine, &mechanism, drive)).collect(),
            contour: Contour::along(profiles).map(ContourGauge::new),
            end: 0.0,
            is_brief: false,
        }
    }

    /// Adds the motion over the part of a curve on which the references are one polynomial each.
    fn track(&mut self, curve: &Curve, part: (f64, f64), references: &[Polynomial]) {
        let mut errors = [Polynomial([0.0; TERMS]); SLIDES];
        let mut places = [Polynomial([0.0; TERMS]); SLIDES];
        for ((load, reference), (error, place)) in
            self.loads.iter_mut().zip(references).zip(errors.iter_mut().zip(&mut places))
        {
            let x = curve.of(load.position);
            *place = x;
            // x − y
            *error = Polynomial(std::array::from_fn(|k| x.0[k] - reference.0[k]));
            larger(&mut load.seen.error.peak, error, part, curve);
            load.square += curve.length * square(error, part);
            if let (Some(peak), false) = (&mut load.peak_speed, self.is_brief) {
                larger(peak, &slope(&x, curve.length), part, curve);
            }
        }
        if self.is_brief {
            return;
        }
        for drive in &mut self.drives {
            // r φ − y as a sum over x − y and the stretches between; r φ₁ − y = x − y + d₁ of an axis
            let mut following = Polynomial([0.0; TERMS]);
            for ((load, error), share) in self.loads.iter().zip(&errors).zip(drive.shares) {
                following.0.iter_mut().zip(error.0).for_each(|(sum, term)| *sum += share * term);
                for &(stretch, weight) in &load.stretches {
                    let stretch = curve.of(stretch);
                    following.0.iter_mut().zip(stretch.0).for_each(|(sum, term)| *sum += share * weight * term);
                }
            }
            larger(&mut drive.seen.following.peak, &following, part, curve);
            drive.squares[0] += curve.length * square(&following, part);
        }
        if let Some(contour) = &mut self.contour {
            contour.track(curve, part, &places);
        }
    }

    fn finish(self, events: &[solve::Event]) -> (Figures, Metrics) {
        let end = self.profiles.first().map_or(0.0, Profile::end);
        let mean = |sum: f64| (sum / self.end.max(f64::MIN_POSITIVE)).sqrt();
        let mut metrics = self.meter.finish(events);
        for (load, peak) in metrics.loads.iter_mut().zip(self.loads.iter().map(|load| load.peak_speed)) {
            load.peak_speed = peak.unwrap_or(load.peak_speed);
        }
        let left = self.loads.iter().filter_map(|load| load.outside).reduce(f64::max);
        let is_outside = self.loads.iter().any(|load| load.is_outside);
        let figures = Figures {
            settling: match left {
                _ if self.end < end || is_outside => None,
                None => Some(0.0),
                Some(last) => Some(last - end),
            },
            contour: self.contour.map(|contour| contour.finish(self.end)),
            loads: self
                .loads
                .into_iter()
                .map(|mut load| {
                    load.seen.error.rms = mean(load.square);
                    load.seen
                })
                .collect(),
            drives: self
                .drives
                .into_iter()
                .map(|mut drive| {
                    let [following, voltage, current] = drive.squares.map(mean);
                    let seen = &mut drive.seen;
                    (seen.following.rms, seen.voltage.1, seen.current.1) = (following, voltage, current);
                    drive.seen
                })
                .collect(),
        };
        (figures, metrics)
    }
}

/// The integral of the square of a polynomial over a part of 0..1.
fn square(quantity: &Polynomial, part: (f64, f64)) -> f64 {
    match part {
        (0.0, 1.0) => {
            let values = at_places(quantity);
            product(&values, &values)
        }
        _ => integral(part, |s| quantity.at(s).powi(2)),
    }
}

impl Observe for Gauge<'_> {
    fn pass(&mut self, gap: &Gap) -> bool {
        if self.is_brief {
            return true;
        }
        self.meter.pass(gap);
        for (number, drive) in self.drives.iter_mut().enumerate() {
            let mode = &gap.mode.drive[number];
            drive.saturated = mode.voltage != Limit::Inside || mode.current != Limit::Inside;
            let current = Some((&mut drive.seen.current.0, drive.current));
            let voltage = match drive.voltage {
                Voltage::Read(q) => Some((&mut drive.seen.voltage.0, q)),
                Voltage::Computed { .. } => None,
            };
            for (peak, q) in [voltage, current].into_iter().flatten() {
                for (value, time) in [(gap.from[q], gap.begin), (gap.to[q], gap.begin + gap.length)] {
                    if value.abs() > peak.value.abs() {
                        *peak = Peak { value, time };
                    }
                }
            }
        }
        true
    }

    fn see(&mut self, curve: &Curve) {
        if !self.is_brief {
            self.meter.see(curve);
        }
        for drive in &mut self.drives {
            drive.power(curve, self.is_brief);
        }
        // A seam that is as near as rounding is behind.
        let shortest = SHORTEST + 16.0 * f64::EPSILON * (curve.begin + curve.length) / curve.length;
        let mut from = 0.0;
        while from < 1.0 {
            let begin = curve.begin + from * curve.length;
            let (mut references, mut seam) = ([Polynomial([0.0; TERMS]); SLIDES], f64::INFINITY);
            for (reference, profile) in references.iter_mut().zip(self.profiles) {
                let (coefficients, until) = profile.piece(begin);
                *reference = shifted(&coefficients, from, curve.length);
                seam = seam.min(until);
            }
            let to = ((seam - curve.begin) / curve.length).max(from + shortest).min(1.0);
            self.track(curve, (from, to), &references);
            from = to;
        }
        let end = self.profiles.first().map_or(0.0, Profile::end);
        for load in &mut self.loads {
            load.settle(curve, end, self.window);
        }
    }

    fn sees_all(&self) -> bool {
        true
    }

    fn end(&mut self, time: f64, state: &State, mode: &Mode) {
        self.meter.end(time, state, mode);
        self.end = time;
        let mut references = [0.0; SLIDES];
        for ((load, profile), reference) in self.loads.iter_mut().zip(self.profiles).zip(&mut references) {
            *reference = profile.at(time).position;
            load.seen.error.last = state.position[load.body] - *reference;
        }
        let radius = self.meter.machine().pulley_radius;
        for drive in &mut self.drives {
            let y: f64 = drive.shares.iter().zip(references).map(|(share, reference)| share * reference).sum();
            drive.seen.following.last = radius * state.position[drive.pulley] - y;
        }
        if let (Some(contour), [x, y]) = (&mut self.contour, &self.loads[..]) {
            contour.end(time, [x.body, y.body].map(|body| state.position[body]));
        }
    }
}

/// Most coordinates of a machine.
pub(super) const SLIDES: usize = 2;

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
pub(super) fn larger(peak: &mut Peak, quantity: &Polynomial, part: (f64, f64), curve: &Curve) {
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
pub(super) fn at_places(polynomial: &Polynomial) -> [f64; PLACES] {
    let mut values = [0.0; PLACES];
    for (c, powers) in polynomial.0.iter().zip(&POWERS) {
        values.iter_mut().zip(powers).for_each(|(value, power)| *value += c * power);
    }
    values
}

/// The integral over 0..1 of the product of two polynomials, of which these are the values.
pub(super) fn product(a: &[f64; PLACES], b: &[f64; PLACES]) -> f64 {
    let weighted = |(j, (_, w)): (usize, &(f64, f64))| w * (a[2 * j] * b[2 * j] + a[2 * j + 1] * b[2 * j + 1]);
    0.5 * GAUSS.iter().enumerate().map(weighted).sum::<f64>()
}

/// The integral over s on a part of 0..1.
pub(super) fn integral((from, to): (f64, f64), value: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    GAUSS.iter().map(|(x, w)| w * (value(middle - half * x) + value(middle + half * x))).sum::<f64>() * half
}

/// Blocks of rows with references and errors behind their own columns.
struct Wide {
    block: Trajectory,
    /// Columns of the positions, and names of the references and errors that go with them.
    loads: Vec<[String; 3]>,
}

impl Wide {
    fn of(machine: &Machine) -> Self {
        let slides = machine.geometry().slides;
        let names = |slide: &SlideAt| {
            let key = machine.geometry().label(slide.body).key;
            let reference = if slides.len() == 1 { "reference".to_string() } else { format!("{key}_reference") };
            [format!("{key}_position"), reference, format!("{key}_error")]
        };
        Self { block: Trajectory::default(), loads: slides.iter().map(names).collect() }
    }

    fn widened(&mut self, profiles: &[Profile], block: &Trajectory) -> &Trajectory {
        let (own, loads) = (block.columns.len(), self.loads.len());
        let contour = Contour::along(profiles);
        let added = 2 * loads + usize::from(contour.is_some());
        if self.block.columns.len() != own + added {
            self.block.columns.clone_from(&block.columns);
            let names = self.loads.iter().map(|names| &names[1]).chain(self.loads.iter().map(|names| &names[2]));
            self.block.columns.extend(names.map(|name| Column::new(name.as_str(), "m")));
            if contour.is_some() {
                self.block.columns.push(Column::new("contour_error", "m"));
            }
        }
        let time = block.get("time").unwrap_or(&[]);
        let place = |names: &[String; 3]| block.get(&names[0]).unwrap_or(&[]);
        let references: Vec<Vec<f64>> =
            profiles.iter().map(|profile| time.iter().map(|&t| profile.at(t).position).collect()).collect();
        let error = |(names, reference): (&[String; 3], &Vec<f64>)| -> Vec<f64> {
            place(names).iter().zip(reference).map(|(x, y)| x - y).collect()
        };
        let errors: Vec<Vec<f64>> = self.loads.iter().zip(&references).map(error).collect();
        let away: Option<Vec<f64>> = match (contour, &self.loads[..]) {
            (Some(contour), [x, y]) => {
                let points = place(x).iter().zip(place(y)).zip(time);
                Some(points.map(|((x, y), time)| contour.nearest(*time, [*x, *y]).0).collect())
            }
            _ => None,
        };
        let own = block.columns.iter().map(|column| &column.values);
        let sources = own.chain(&references).chain(&errors).chain(&away);
        for (to, from) in self.block.columns.iter_mut().zip(sources) {
            to.values.clone_from(from);
        }
        &self.block
    }
}
