//! Quickest moves of a machine: speed, acceleration, jerk and snap within its limits, for a gantry along its path, with
//! jerk and snap times at the zeros of the belt's modes.

use super::feasible::{Load, Shortfall, along_path, limits, loads, shortfalls};
use super::resonance::{Drive, reaches, resonances};
use crate::design::{Bounds, Design};
use crate::error::{Error, Result};
use crate::golden;
use crate::machine::{BeltModel, Machine};
use crate::signal::arc::Arc;
use crate::signal::profile::{Leg, Limits, Passage, Profile};

/// Number of instants of a reference that a search evaluates.
pub const INSTANTS: usize = 160;
/// Number of instants at which a plan is checked.
pub const CLOSELY: usize = 4000;

/// Number of cruising speeds on the grid, steps of golden section after it, and bisections of the acceleration.
const SPEEDS: usize = 10;
const NARROWED: usize = 8;
const BISECTIONS: usize = 14;

/// Jerk and snap time without a mode, in samples of the controller.
const SHORTEST: [f64; 2] = [4.0, 1.0];

/// Maximum number of times that a plan is slowed down because a machine of the family exceeds a limit.
const CORRECTIONS: usize = 6;

/// Relative difference up to which two frequencies are one mode.
const SAME: f64 = 1e-6;

/// Accelerations between which the largest within the pull-out torque is searched for, m/s², and halvings of their
/// ratio.
const ACCELERATIONS: [f64; 2] = [1e-3, 1e4];
const HALVINGS: usize = 24;

/// Way of a coordinate without limits of its travel over which the motor turns slowly, m.
const SHORT_WAY: f64 = 1e-4;

/// Smallest cruising speed tried, as a fraction of the largest for the path.
const SLOWEST: f64 = 0.02;

/// Limits of a plan besides those of the machine, and the reserve of voltage and current for the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// m/s
    pub speed: Option<f64>,
    /// m/s²
    pub acceleration: Option<f64>,
    /// m/s³
    pub jerk: Option<f64>,
    /// 0 to 0.9.
    pub reserve: f64,
}

impl Wanted {
    /// Errors: a limit that is not positive and finite, or a reserve above 90 %.
    pub fn check(&self) -> Result<()> {
        let limits = [("speed", self.speed), ("acceleration", self.acceleration), ("jerk", self.jerk)];
        for (name, value) in limits {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
                return Err(Error::new(format!("{value} is not a valid limit of {name}")).allowed("above 0"));
            }
        }
        match (0.0..=0.9).contains(&self.reserve) {
            true => Ok(()),
            false => Err(Error::new(format!("a reserve of {}", self.reserve)).allowed("from 0 to 0.9")),
        }
    }

    /// Those of the limits of speed, acceleration and jerk that references exceed.
    pub fn exceeded_by(&self, profiles: &[Profile]) -> Vec<Shortfall> {
        let limits =
            [("speed", "m/s", self.speed), ("acceleration", "m/s^2", self.acceleration), ("jerk", "m/s^3", self.jerk)];
        along_path(profiles, limits)
    }
}

/// Largest acceleration, m/s², of a coordinate alone that steppers move to the end of its travel and back, accelerating
/// over one half and braking over the other, within the pull-out torque at each speed less this `reserve`, from 0 to 1;
/// at low speeds if its travel is not limited. Zero if there is none, `None` for other motors.
pub fn within_pull_out(machine: &Machine, slide: usize, reserve: f64) -> Option<f64> {
    machine.stepper()?;
    let travels: Vec<[f64; 2]> =
        machine.travels().map(|(_, travel)| travel.map_or([0.0, SHORT_WAY], |own| [own.min, own.max])).collect();
    let start: Vec<f64> = travels.iter().map(|[min, _]| *min).collect();
    let mut there = start.clone();
    there[slide] = travels[slide][1];
    let way = there[slide] - start[slide];
    let is_within = |acceleration: f64| {
        let limits = Limits { speed: (acceleration * way).sqrt(), acceleration, jerk: None, snap: None };
        let legs = [Leg::To(there.clone(), limits), Leg::To(start.clone(), limits)];
        let Ok(profiles) = Profile::of_legs(&start, &legs) else { return false };
        let loads = loads(machine, Bounds::default(), &profiles, CLOSELY);
        loads.iter().filter(|load| load.limit == "pull_out").all(|load| load.share() <= 1.0 - reserve)
    };
    let [mut low, mut high] = ACCELERATIONS;
    if !is_within(low) {
        return Some(0.0);
    }
    for _ in 0..HALVINGS {
        let middle = (low * high).sqrt();
        *if is_within(middle) { &mut low } else { &mut high } = middle;
    }
    Some(low)
}

/// Lowest frequencies along the travel of the modes with held drive pulleys, Hz, in ascending order; for a gantry,
/// those that move the bridge or the cart. Empty for a rigid belt, or without oscillation.
pub fn modes(machine: &Machine) -> Vec<f64> {
    if machine.belt.model == BeltModel::Rigid {
        return Vec::new();
    }
    let of_slide = |slide| resonances(machine, Drive::Held, slide).map(|found| reaches(&found)).unwrap_or_default();
    let found = (0..machine.geometry().slides.len()).flat_map(of_slide);
    let mut lowest: Vec<f64> = found.map(|mode| mode.frequency[0]).collect();
    lowest.sort_by(f64::total_cmp);
    lowest.dedup_by(|next, last| (*next / *last - 1.0).abs() < SAME);
    lowest
}

/// Fractions of the limits of the machine of the file that the reference of a plan uses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// Of voltage, current and pull-out torque.
    pub motor: f64,
    /// Of slack, tension and teeth.
    pub belt: f64,
}

impl Share {
    /// The whole of each.
    pub const ALL: Self = Self { motor: 1.0, belt: 1.0 };

    /// That of the limit of this load.
    fn value(&self, load: &Load) -> f64 {
        if load.is_of_motor() { self.motor } else { self.belt }
    }
}

/// Path of a move from leg to leg, without its limits.
#[derive(Debug, Clone)]
pub struct MovePath {
    /// Start position of each coordinate, m.
    pub start: Vec<f64>,
    /// Its legs, with arbitrary limits.
    pub legs: Vec<Leg<Vec<f64>>>,
    /// The shortest and the longest leg, m.
    shortest: f64,
    longest: f64,
}

/// Limits of a slow move, which requires little more than friction.
pub const SLOW: Limits = Limits { speed: 1e-3, acceleration: 1e-2, jerk: None, snap: None };

/// Placeholder limits of a leg.
const ANY: Limits = Limits { speed: 1.0, acceleration: 1.0, jerk: None, snap: None };

impl MovePath {
    /// Legs of references on one clock; none if the references do not move.
    pub fn new(profiles: &[Profile]) -> Option<Self> {
        let mut rested = 0.0;
        let (mut legs, mut lengths) = (Vec::new(), Vec::new());
        for number in 0..profiles.first()?.passages().len() {
            let leg: Vec<&Passage> = profiles.iter().filter_map(|profile| profile.passages().get(number)).collect();
            let straight = || leg.iter().map(|passage| (passage.to - passage.from).powi(2)).sum::<f64>().sqrt();
            let turn = leg[0].turn;
            let length = turn.map_or_else(straight, |turn| turn.length);
            if length == 0.0 {
                continue;
            }
            let begin = leg.iter().map(|passage| passage.begin).fold(0.0, f64::max);
            // Rounding of the clock is not a rest.
            if begin - rested > 1e-12 {
                legs.push(Leg::Wait(begin - rested));
            }
            legs.push(match (turn, &leg[..]) {
                (Some(turn), [x, y]) => {
                    let center = [turn.center, y.turn.map_or(0.0, |turn| turn.center)];
                    Leg::Around(Arc { to: [x.to, y.to], center, clockwise: turn.per_length < 0.0 }, ANY)
                }
                _ => Leg::To(leg.iter().map(|passage| passage.to).collect(), ANY),
            });
            lengths.push(length);
            rested = begin + leg.iter().map(|passage| passage.duration()).fold(0.0, f64::max);
        }
        let start = profiles.iter().map(Profile::start).collect();
        let (shortest, longest) =
            (lengths.iter().copied().reduce(f64::min)?, lengths.iter().copied().reduce(f64::max)?);
        Some(Self { start, legs, shortest, longest })
    }

    /// Profiles over this path within these limits along it.
    pub fn within(&self, limits: &Limits) -> Result<Vec<Profile>> {
        let legs: Vec<_> = self.legs.iter().map(|leg| leg.within(limits)).collect();
        Profile::of_legs(&self.start, &legs)
    }
}

/// The search for the quickest move of an axis under a controller.
#[derive(Debug, Clone, Copy)]
pub struct Quickest<'a> {
    /// The axis.
    pub machine: &'a Machine,
    /// The controller, of which limit, sample time and shaper are used.
    pub design: &'a Design,
    /// Frequencies of the modes by [`modes`], Hz.
    pub modes: &'a [f64],
    /// Further limits.
    pub wanted: &'a Wanted,
}

impl Quickest<'_> {
    /// Errors: a path that is infeasible at any speed and acceleration, and one that nothing limits.
    pub fn check(&self, way: &MovePath) -> Result<()> {
        let references = self.design.shaped(&way.within(&SLOW)?);
        let short = shortfalls(self.machine, self.design.bounds(), &references);
        // A motor that cannot break the axis away needs no word about its voltage.
        let breakaway = short.iter().find(|short| short.limit == "breakaway");
        if let Some(short) = breakaway.or(short.first()) {
            return Err(Error::new(format!("there is no plan: {}", short.words)));
        }
        let (volts, amperes) = limits(self.machine, self.design.bounds());
        let is_limited = volts.is_some() || amperes.is_some() || self.machine.stepper().is_some();
        if !is_limited && (self.wanted.speed.is_none() || self.wanted.acceleration.is_none()) {
            return Err(Error::new("there is no plan: neither voltage nor current is limited")
                .next("give limit in [controller], amplifier.voltage_limit, or a speed and an acceleration"));
        }
        Ok(())
    }

    /// Jerk and snap time, s; none if the belt has no such mode.
    fn times(&self, periods: [u8; 2]) -> Option<[f64; 2]> {
        let mut times = SHORTEST.map(|samples| samples * self.design.every);
        for (k, (time, periods)) in times.iter_mut().zip(periods).enumerate() {
            if periods > 0 {
                *time = f64::from(periods) / self.modes.get(k)?;
            }
        }
        (times[1] <= times[0]).then_some(times)
    }

    /// Limits with these averaging times; the shortest jerk time is increased if a limit of jerk requires it.
    fn limits(&self, speed: f64, acceleration: f64, periods: [u8; 2], times: [f64; 2]) -> Limits {
        let mut jerk_time = times[0];
        if let (0, Some(jerk)) = (periods[0], self.wanted.jerk) {
            jerk_time = jerk_time.max(acceleration / jerk);
        }
        let jerk = acceleration / jerk_time;
        Limits { speed, acceleration, jerk: Some(jerk), snap: Some(jerk / times[1]) }
    }

    /// Limits of the quickest move within these fractions of the limits, those of the motor after the reserve; none if
    /// no move is. `others` returns the loads by a reference, shaper included, on other machines, which may use all of
    /// each limit.
    pub fn limits_for(
        &self,
        way: &MovePath,
        periods: [u8; 2],
        share: Share,
        others: &dyn Fn(&[Profile]) -> Vec<Load>,
    ) -> Result<Option<Limits>> {
        let wanted = Share { motor: share.motor * (1.0 - self.wanted.reserve), ..share };
        let mut share = wanted;
        for _ in 0..CORRECTIONS {
            let Some(limits) = self.searched(way, periods, share) else { return Ok(None) };
            let profiles = self.design.shaped(&way.within(&limits)?);
            // On the finer grid of instants, the axis needs slightly more than during the search.
            let closely = loads(self.machine, self.design.bounds(), &profiles, CLOSELY);
            let others = others(&profiles);
            let own = closely.iter().map(|load| (load, wanted.value(load)));
            let mut most = Share { motor: 0.0, belt: 0.0 };
            for (load, allowed) in own.chain(others.iter().map(|load| (load, Share::ALL.value(load)))) {
                let most = if load.is_of_motor() { &mut most.motor } else { &mut most.belt };
                *most = most.max(load.share() / allowed);
            }
            if most.motor <= 1.0 && most.belt <= 1.0 {
                return Ok(Some(limits));
            }
            for (share, most) in [(&mut share.motor, most.motor), (&mut share.belt, most.belt)] {
                if most > 1.0 {
                    *share *= 0.995 / most;
                }
            }
        }
        Ok(None)
    }

    /// Limits of the quickest move with these averaging times within a share of the machine's limits; none if no move
    /// is.
    fn searched(&self, way: &MovePath, periods: [u8; 2], share: Share) -> Option<Limits> {
        let times = self.times(periods)?;
        let both: f64 = times.iter().sum();
        // T₂ = v/a ≥ T_j + T_s and D ≥ 2 a (T_j + T_s)²: a shorter stroke would shorten the jerk time.
        let shortest = way.shortest / (2.0 * both * both);
        let mut most = shortest.min(self.wanted.acceleration.unwrap_or(f64::INFINITY));
        if let (true, Some(jerk)) = (periods[0] > 0, self.wanted.jerk) {
            most = most.min(jerk * times[0]);
        }
        let acceleration = |speed: f64| {
            let within = |a: f64| self.is_within(way, &self.limits(speed, a, periods, times), share);
            let most = most.min(speed / both);
            if within(most) {
                return Some(most);
            }
            let mut ends = [1e-4 * most, most];
            if !within(ends[0]) {
                return None;
            }
            for _ in 0..BISECTIONS {
                let middle = (ends[0] * ends[1]).sqrt();
                ends[usize::from(!within(middle))] = middle;
            }
            Some(ends[0])
        };
        let duration = |speed: f64| -> (f64, Option<Limits>) {
            let Some(a) = acceleration(speed) else { return (f64::INFINITY, None) };
            let limits = self.limits(speed, a, periods, times);
            (way.within(&limits).map_or(f64::INFINITY, |profiles| profiles[0].end()), Some(limits))
        };
        // At most the speed reached without cruising.
        let fastest = (way.longest * most).sqrt().min(self.wanted.speed.unwrap_or(f64::INFINITY));
        let grid = |k: usize| fastest * SLOWEST.powf(k as f64 / (SPEEDS - 1) as f64);
        let found: Vec<(f64, f64, Option<Limits>)> = (0..SPEEDS)
            .map(|k| {
                let (time, limits) = duration(grid(k));
                (time, grid(k), limits)
            })
            .collect();
        let best = (0..SPEEDS).min_by(|&a, &b| found[a].0.total_cmp(&found[b].0))?;
        let mut best_yet = (found[best].0, found[best].2);
        best_yet.1?;
        golden::top([grid((best + 1).min(SPEEDS - 1)), grid(best.saturating_sub(1))], NARROWED, |speed| {
            let (time, limits) = duration(speed);
            if time < best_yet.0 {
                best_yet = (time, limits);
            }
            -time
        });
        let limits = best_yet.1?;
        // If no stroke cruises, the largest speed of the longest one.
        let profiles = way.within(&limits).ok()?;
        let middles = profiles[0].passages().iter().map(|passage| passage.begin + 0.5 * passage.duration());
        let speed_at = |time: f64| match &profiles[..] {
            [profile] => profile.at(time).speed.abs(),
            _ => profiles.iter().map(|profile| profile.at(time).speed.powi(2)).sum::<f64>().sqrt(),
        };
        let peaks = middles.map(speed_at);
        let speed = peaks.fold(0.0, f64::max).min(limits.speed);
        Some(Limits { speed, ..limits })
    }

    /// True if a move within these limits uses at most these fractions of the limits of the machine.
    fn is_within(&self, way: &MovePath, limits: &Limits, share: Share) -> bool {
        let Ok(profiles) = way.within(limits) else { return false };
        let loads = loads(self.machine, self.design.bounds(), &self.design.shaped(&profiles), INSTANTS);
        loads.iter().all(|load| load.share() <= share.value(load))
    }
}
