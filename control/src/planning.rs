//! The fastest move of an axis: speed, acceleration and jerk that its limits allow, with jerk times on the zeros of the
//! belt's modes, chosen by how soon the cart stays in its window over a family of machines.

use crate::case::{Case, Files, Move};
use crate::control::feasible::{Load, Shortfall, limits, loads as loads_of, shortfalls};
use crate::control::resonance::{Drive, reaches, resonances};
use crate::control::{MoveRun, Setup, closed_loop};
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::rigid::Rigid;
use crate::machine::{BeltModel, Machine};
use crate::signal::profile::{Leg, Limits, Profile};
use crate::solve::{Ending, Solver};
use crate::tune::Family;
use std::path::Path;

/// Instants of a reference that are looked at during the search, and at its end.
const INSTANTS: usize = 160;
const CLOSELY: usize = 4000;

/// Cruising speeds that are tried, by a grid and then by golden section, and bisections of the acceleration.
const SPEEDS: usize = 10;
const NARROWED: usize = 8;
const BISECTIONS: usize = 14;

/// Jerk times in periods of the belt's lowest mode, and snap times in periods of its next; 0 is [`SHORTEST`].
const PERIODS: [[u8; 2]; 5] = [[0, 0], [1, 0], [2, 0], [3, 0], [1, 1]];

/// Jerk and snap time that are on no mode, in samples of the controller.
const SHORTEST: [f64; 2] = [4.0, 1.0];

/// Shares of the limits that plans take, the quickest first.
const SHARES: [f64; 8] = [1.0, 0.85, 0.72, 0.6, 0.5, 0.4, 0.3, 0.2];

/// Shortest time at rest that is watched, s, and a time that is longer than any move, s.
const WATCHED: f64 = 0.3;
const NEVER: f64 = 1e12;

/// Times that a plan is made slower because an axis of the family needs more than there is.
const CORRECTIONS: usize = 6;

/// Smallest cruising speed that is tried, as a share of the largest that the way allows.
const SLOWEST: f64 = 0.02;

/// Limits of a plan besides those of the machine, and the share of voltage and current that it leaves to the loop.
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
    /// Each limit is above zero and finite, and the reserve a share up to 90 %.
    pub fn check(&self) -> Result<()> {
        let limits = [("speed", self.speed), ("acceleration", self.acceleration), ("jerk", self.jerk)];
        for (name, value) in limits {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
                return Err(Error::new(format!("{value} is no limit of {name}")).allowed("above 0"));
            }
        }
        match (0.0..=0.9).contains(&self.reserve) {
            true => Ok(()),
            false => Err(Error::new(format!("a reserve of {}", self.reserve)).allowed("from 0 to 0.9")),
        }
    }
}

/// How soon the cart stays in its window, from the beginning of the move, in closed loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrival {
    /// Duration of the reference, s.
    pub duration: f64,
    /// Of the axis as the file has it, s; none if it does not stay there.
    pub nominal: Option<f64>,
    /// Of the slowest axis of the family, s; none if one of them does not stay there, or if the family was not run.
    pub worst: Option<f64>,
    /// Axes that stay in the window, of how many that were run.
    pub settled: usize,
    /// How many were run.
    pub axes: usize,
    /// Largest distance of the cart from its reference on the axis as the file has it, m.
    pub cart_error: f64,
}

/// A plan that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// Limits of its strokes.
    pub limits: Limits,
    /// Jerk and snap time in periods of the belt's modes; 0 is none.
    pub periods: [u8; 2],
    /// Share of the machine's limits that it takes.
    pub share: f64,
    /// When the cart arrives.
    pub arrival: Arrival,
}

/// The plan of a move.
#[derive(Debug, Clone)]
pub struct Planned {
    /// The move's place in the case, and its name.
    pub place: usize,
    /// The move's name.
    pub name: String,
    /// Half the width of the window, m.
    pub window: f64,
    /// The best that was tried.
    pub best: Tried,
    /// Its reference.
    pub profile: Profile,
    /// True if the limits of the file stay because nothing that was tried arrives sooner.
    pub is_kept: bool,
    /// When the cart arrives with the limits of the file.
    pub given: Arrival,
    /// Limits that the move of the file exceeds.
    pub shortfalls: Vec<Shortfall>,
    /// The reference of the file.
    pub reference: Profile,
    /// What the plan needs of each limit of the machine, at worst over the family.
    pub loads: Vec<Load>,
    /// The least time in which the rigid axis could do it within voltage and current, s; none where nothing limits it.
    pub bound: Option<f64>,
    /// All plans that were tried, in order.
    pub tried: Vec<Tried>,
}

/// The plans of a case.
#[derive(Debug, Clone)]
pub struct Plans {
    /// The family of machines.
    pub family: Family,
    /// Frequencies of the belt with the drive pulley held, lowest along the travel, Hz.
    pub modes: Vec<f64>,
    /// One for each move that was asked for.
    pub moves: Vec<Planned>,
}

/// Plans the moves at these places of the case; `stop` ends the search early, with what was found so far.
pub fn plan(case: &Case, places: &[usize], wanted: &Wanted, stop: &dyn Fn() -> bool) -> Result<Plans> {
    let Some(design) = &case.controller else {
        return Err(Error::new("there is no controller that could follow a move").next("add [controller]"));
    };
    let family = Family::of(case, &case.tune.clone().unwrap_or_default())?;
    let modes = modes(&case.machine);
    let planner = Planner { design, family: &family, modes: &modes, wanted, stop };
    let moves: Result<Vec<_>> = places.iter().map(|&place| planner.planned(&case.moves[place], place)).collect();
    let moves = moves?;
    Ok(Plans { family, modes, moves })
}

impl Plans {
    /// The text of the case with the planned limits, its remarks left alone; `name` stands in messages.
    pub fn case_text(&self, case: &Case, name: &Path) -> Result<String> {
        let mut changes = Vec::new();
        for planned in self.moves.iter().filter(|planned| !planned.is_kept) {
            let limits = &planned.best.limits;
            let mut set = |key: &str, value: f64, unit: &str| {
                changes.push(format!("move.{}.{key}={value:?} {unit}", planned.place));
            };
            set("speed", limits.speed, "m/s");
            set("acceleration", limits.acceleration, "m/s^2");
            [("jerk", limits.jerk, "m/s^3"), ("snap", limits.snap, "m/s^4")]
                .into_iter()
                .for_each(|(key, value, unit)| value.into_iter().for_each(|value| set(key, value, unit)));
            let end = planned.profile.rest();
            if case.moves[planned.place].until < end {
                set("until", end, "s");
            }
        }
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        Ok(Case::from_text_for(name, &case.text, &changes, Files::Nothing)?.text)
    }
}

/// Lowest frequencies along the travel of the modes with the drive pulley held, Hz, the lowest first; none of a rigid
/// belt, or of one that does not swing.
fn modes(machine: &Machine) -> Vec<f64> {
    if machine.belt.model == BeltModel::Rigid {
        return Vec::new();
    }
    let Ok(found) = resonances(machine, Drive::Held) else { return Vec::new() };
    let mut lowest: Vec<f64> = reaches(&found).iter().map(|mode| mode.frequency[0]).collect();
    lowest.sort_by(f64::total_cmp);
    lowest
}

/// What the plans of a case have in common.
struct Planner<'a> {
    design: &'a Design,
    family: &'a Family,
    modes: &'a [f64],
    wanted: &'a Wanted,
    stop: &'a dyn Fn() -> bool,
}

/// A move from stroke to stroke, without its limits.
struct Way {
    start: f64,
    /// Rest before each stroke (s), and its target (m).
    strokes: Vec<(f64, f64)>,
    /// The shortest and the longest stroke, m.
    shortest: f64,
    longest: f64,
}

impl Way {
    /// The strokes of a reference; none of one that has none.
    fn of(profile: &Profile) -> Option<Self> {
        let mut rested = 0.0;
        let mut strokes = Vec::new();
        for (begin, from, distance, duration) in profile.strokes().filter(|(_, _, distance, _)| *distance != 0.0) {
            strokes.push((begin - rested, from + distance));
            rested = begin + duration;
        }
        let lengths = || profile.strokes().map(|(_, _, distance, _)| distance.abs()).filter(|length| *length > 0.0);
        let (shortest, longest) = (lengths().reduce(f64::min)?, lengths().reduce(f64::max)?);
        Some(Self { start: profile.start(), strokes, shortest, longest })
    }

    /// The same way within these limits.
    fn within(&self, limits: &Limits) -> Result<Profile> {
        let legs = self.strokes.iter().flat_map(|&(rest, to)| {
            let wait = (rest > 1e-12).then_some(Leg::Wait(rest));
            wait.into_iter().chain([Leg::To(to, *limits)])
        });
        Profile::new(self.start, &legs.collect::<Vec<_>>())
    }
}

impl Planner<'_> {
    fn planned(&self, motion: &Move, place: usize) -> Result<Planned> {
        let impossible = |what: String| Error::new(format!("the move \"{}\" has no plan: {what}", motion.name));
        let way = Way::of(&motion.profile).ok_or_else(|| impossible("it has no stroke".into()))?;
        let machine = &self.family.machine;
        let reference = motion.reference(self.design);
        let short = shortfalls(machine, self.design.limit, &reference);
        // What no speed and no acceleration can mend.
        if let Some(short) = short.iter().find(|short| ["breakaway", "travel"].contains(&short.limit)) {
            return Err(impossible(short.words.clone()));
        }
        let (volts, amperes) = limits(machine, self.design.limit);
        if volts.is_none() && amperes.is_none() && (self.wanted.speed.is_none() || self.wanted.acceleration.is_none()) {
            let error = impossible("neither voltage nor current is limited".into());
            return Err(error.next("give limit in [controller], amplifier.voltage_limit or --speed and --acceleration"));
        }
        let mut tried = self.tried(&way, motion)?;
        if tried.is_empty() {
            return Err(impossible(self.unmoved(&way, motion)));
        }
        tried.sort_by(|a, b| a.rank().total_cmp(&b.rank()));
        let mut best = tried[0].clone();
        let mut is_run = false;
        for one in &mut tried {
            // No axis arrives sooner than the slowest of a family that it is in.
            if (self.stop)() || is_run && best.rank() <= one.rank() {
                break;
            }
            one.arrival = self.arrival(motion, &way.within(&one.limits)?, true)?;
            if !is_run || one.rank() < best.rank() {
                (best, is_run) = (one.clone(), true);
            }
        }
        let profile = way.within(&best.limits)?;
        let given = self.arrival(motion, &motion.profile, true)?;
        let is_sooner = short.is_empty() && Tried::rank_of(&given) <= best.rank();
        Ok(Planned {
            is_kept: is_sooner,
            place,
            name: motion.name.clone(),
            window: motion.window,
            loads: self.loads(&profile.clone().shaped(&self.design.shaper), CLOSELY),
            bound: self.bound(&way),
            given,
            reference: motion.profile.clone(),
            shortfalls: short,
            best,
            profile,
            tried,
        })
    }

    /// Plans for each jerk time and share of the limits, with their arrival on the axis as the file has it.
    fn tried(&self, way: &Way, motion: &Move) -> Result<Vec<Tried>> {
        let mut tried = Vec::new();
        for periods in PERIODS {
            for share in SHARES {
                if (self.stop)() {
                    return Ok(tried);
                }
                let Some(limits) = self.quickest_of_all(way, periods, share)? else { continue };
                let arrival = self.arrival(motion, &way.within(&limits)?, false)?;
                tried.push(Tried { limits, periods, share, arrival });
            }
        }
        Ok(tried)
    }

    /// Jerk and snap time, s; none where the belt has no such mode.
    fn times(&self, periods: [u8; 2]) -> Option<[f64; 2]> {
        let mut times = SHORTEST.map(|samples| samples * self.design.every);
        for (k, (time, periods)) in times.iter_mut().zip(periods).enumerate() {
            if periods > 0 {
                *time = f64::from(periods) / self.modes.get(k)?;
            }
        }
        (times[1] <= times[0]).then_some(times)
    }

    /// Limits with these averaging times, the shortest jerk time grown where a limit of jerk asks for it.
    fn limits(&self, speed: f64, acceleration: f64, periods: [u8; 2], times: [f64; 2]) -> Limits {
        let mut jerk_time = times[0];
        if let (0, Some(jerk)) = (periods[0], self.wanted.jerk) {
            jerk_time = jerk_time.max(acceleration / jerk);
        }
        let jerk = acceleration / jerk_time;
        Limits { speed, acceleration, jerk: Some(jerk), snap: Some(jerk / times[1]) }
    }

    /// The limits of the quickest move that takes no more than this share of what is left of voltage and current, and no
    /// axis of the family more than there is; none where there is none.
    fn quickest_of_all(&self, way: &Way, periods: [u8; 2], share: f64) -> Result<Option<Limits>> {
        let wanted = share * (1.0 - self.wanted.reserve);
        let mut share = wanted;
        for _ in 0..CORRECTIONS {
            let Some(limits) = self.quickest(way, periods, share) else { return Ok(None) };
            let profile = way.within(&limits)?.shaped(&self.design.shaper);
            let mut loads = self.loads(&profile, INSTANTS);
            // Looked at more closely, the axis of the file needs a little more than during the search.
            loads.extend(loads_of(&self.family.machine, self.design.limit, &profile, CLOSELY).into_iter().map(
                |load| {
                    let allowed = if load.is_electrical() { wanted * load.allowed } else { load.allowed };
                    Load { allowed, ..load }
                },
            ));
            let most = loads.iter().map(|load| load.needed / load.allowed).fold(0.0, f64::max);
            if most <= 1.0 {
                return Ok(Some(limits));
            }
            share *= 0.995 / most;
        }
        Ok(None)
    }

    /// The limits of the quickest move with these averaging times that takes no more than a share of the machine's; none
    /// where there is none.
    fn quickest(&self, way: &Way, periods: [u8; 2], share: f64) -> Option<Limits> {
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
            (way.within(&limits).map_or(f64::INFINITY, |profile| profile.end()), Some(limits))
        };
        // No faster than a way without any cruise reaches.
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
        let (mut low, mut high) = (grid((best + 1).min(SPEEDS - 1)), grid(best.saturating_sub(1)));
        const GOLDEN: f64 = 0.618_033_988_749_895;
        for _ in 0..NARROWED {
            let inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
            let [a, b] = inner.map(duration);
            for (time, limits) in [a, b] {
                if time < best_yet.0 {
                    best_yet = (time, limits);
                }
            }
            if a.0 <= b.0 { high = inner[1] } else { low = inner[0] }
        }
        let limits = best_yet.1?;
        // Where no stroke cruises, the largest speed of the longest.
        let profile = way.within(&limits).ok()?;
        let peaks = profile.strokes().map(|(begin, _, _, duration)| profile.at(begin + 0.5 * duration).speed.abs());
        let speed = peaks.fold(0.0, f64::max).min(limits.speed);
        Some(Limits { speed, ..limits })
    }

    /// Whether a move within these limits takes no more than this share of each limit of the machine.
    fn is_within(&self, way: &Way, limits: &Limits, share: f64) -> bool {
        let Ok(profile) = way.within(limits) else { return false };
        let profile = profile.shaped(&self.design.shaper);
        let loads = loads_of(&self.family.machine, self.design.limit, &profile, INSTANTS);
        loads.iter().all(|load| load.needed <= load.allowed * if load.is_electrical() { share } else { 1.0 })
    }

    /// What a reference, shaper included, needs of each limit at most, over the family.
    fn loads(&self, profile: &Profile, instants: usize) -> Vec<Load> {
        let mut all: Vec<Load> = Vec::new();
        for corner in &self.family.machines {
            for load in loads_of(&self.family.stage_at(corner), self.design.limit, profile, instants) {
                match all.iter_mut().find(|known| known.limit == load.limit) {
                    Some(known) if load.needed / load.allowed > known.needed / known.allowed => *known = load,
                    Some(_) => (),
                    None => all.push(load),
                }
            }
        }
        all
    }

    /// Why nothing moves, in words: what the slowest move that is tried needs.
    fn unmoved(&self, way: &Way, motion: &Move) -> String {
        let slow = Limits { speed: 1e-3, acceleration: 1e-2, jerk: None, snap: None };
        let found = way.within(&slow).map(|profile| shortfalls(&self.family.machine, self.design.limit, &profile));
        match found.as_deref() {
            Ok([first, ..]) => first.words.clone(),
            _ => format!("{} leaves too little to accelerate with", motion.name),
        }
    }

    /// When the cart arrives, in closed loop.
    fn arrival(&self, motion: &Move, profile: &Profile, whole: bool) -> Result<Arrival> {
        let watched = (motion.until - motion.profile.end()).max(WATCHED);
        let run = |machine: &Machine| -> Result<MoveRun> {
            closed_loop(&Setup {
                machine,
                model: &self.family.machine,
                design: self.design,
                profile,
                until: profile.clone().shaped(&self.design.shaper).rest() + watched,
                window: motion.window,
                solver: Solver::of(machine),
            })
        };
        let end = profile.end();
        let time = |run: &MoveRun| run.figures.settling.filter(|_| run.outcome.ending == Ending::Complete);
        let own = run(&self.family.machine)?;
        let nominal = time(&own).map(|settling| end + settling);
        let mut arrival = Arrival {
            duration: end,
            nominal,
            worst: None,
            settled: usize::from(nominal.is_some()),
            axes: 1,
            cart_error: own.figures.cart.peak.value.abs(),
        };
        if whole {
            let mut worst = Some(0.0_f64);
            (arrival.settled, arrival.axes) = (0, 0);
            for corner in &self.family.machines {
                if (self.stop)() {
                    worst = None;
                    break;
                }
                let one = time(&run(&self.family.stage_at(corner))?).map(|settling| end + settling);
                worst = worst.zip(one).map(|(worst, one)| worst.max(one));
                (arrival.settled, arrival.axes) = (arrival.settled + usize::from(one.is_some()), arrival.axes + 1);
            }
            arrival.worst = worst;
        }
        Ok(arrival)
    }

    /// The least time of all strokes of the rigid axis, with their rests.
    fn bound(&self, way: &Way) -> Option<f64> {
        let limits = limits(&self.family.machine, self.design.limit);
        let rigid = Rigid::of(&self.family.machine);
        let (mut from, mut time) = (way.start, 0.0);
        for &(rest, to) in &way.strokes {
            time += rest + rigid.quickest(to - from, limits)?;
            from = to;
        }
        Some(time)
    }
}

impl Tried {
    fn rank(&self) -> f64 {
        Self::rank_of(&self.arrival)
    }

    /// The smaller the better: the arrival, where all arrive; those that do not, behind all that do.
    fn rank_of(arrival: &Arrival) -> f64 {
        let Arrival { duration, nominal, worst, settled, axes, .. } = arrival;
        let missed = (axes - settled) as f64 / (*axes).max(1) as f64;
        let arrives = if *axes > 1 { worst.or(*nominal) } else { *nominal };
        arrives.unwrap_or(*duration) + if missed > 0.0 { NEVER * (1.0 + missed) } else { 0.0 }
    }
}
