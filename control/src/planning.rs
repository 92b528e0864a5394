//! Fastest move of a machine: speed, acceleration and jerk within its limits, with jerk times on the zeros of the
//! belt's modes, chosen by the arrival in the window over a family of machines. [`Quickest`] defines the limits.

use crate::case::{Case, Files, Move};
use crate::control::{Figures, Loop, SampledPath, Setup, Standard, closed_loop, closed_loop_briefly, each};
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::rigid::Rigid;
use crate::machine::{Machine, SlideForces};
use crate::metrics::Peak;
use crate::reach::feasible::{
    Load, Shortfall, limits, loads, loads_of_run, shortfalls, shortfalls_of_run, without_reserve,
};
use crate::reach::quickest::{MovePath, Quickest, SLOW, Share, Wanted, modes};
use crate::signal::profile::{Leg, Limits, Profile};
use crate::solve::{Ending, Solver};
use crate::tune::Family;
use std::path::Path;

/// Jerk times in periods of the belt's lowest mode, and snap times in periods of its next; 0 is a few samples. Over a
/// long stroke, a long jerk time lets the acceleration fall while the speed uses up the voltage.
const PERIODS: [[u8; 2]; 7] = [[0, 0], [1, 0], [2, 0], [3, 0], [6, 0], [10, 0], [1, 1]];

/// Fractions of the limits that plans use, the quickest first.
const SHARES: [f64; 8] = [1.0, 0.85, 0.72, 0.6, 0.5, 0.4, 0.3, 0.2];

/// Number of fractions tried between that of the first plan to arrive and the next larger one.
const NARROWED: usize = 4;

/// Maximum number of times that a plan is slowed down because its run exceeds a limit of the belt, and the fraction of
/// the limit that the next one aims at.
const SLOWED: usize = 5;
const AIMED: f64 = 0.98;

/// Shortest observed time at rest, s, and a time longer than any move, s.
const WATCHED: f64 = 0.3;
const NEVER: f64 = 1e12;

/// Arrival: time from the start of the move until the cart stays in its window, in closed loop.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Arrival {
    /// Duration of the reference, s.
    pub duration: f64,
    /// Arrival on the nominal machine, s; none if it does not stay there.
    pub nominal: Option<f64>,
    /// Arrival on the slowest machine of the family, s; none if one of them does not stay there, or if the family was
    /// not run.
    pub worst: Option<f64>,
    /// Number of machines that stay in the window.
    pub settled: usize,
    /// Number of machines run.
    pub axes: usize,
    /// Largest error of a sliding part on the machine of the file, m.
    pub cart_error: f64,
    /// Longest time for which the command or the amplifier of a drive is at its limit on the machine of the file, s.
    pub saturated: f64,
}

/// A tried plan.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Tried {
    /// Limits of its strokes.
    pub limits: Limits,
    /// Jerk and snap time in periods of the belt's modes; 0 is none.
    pub periods: [u8; 2],
    /// Fraction of the machine's limits that it uses.
    pub share: f64,
    /// Arrival of the cart.
    pub arrival: Arrival,
}

/// The plan of a move.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Planned {
    /// Index of the move in the case.
    pub place: usize,
    /// The move's name.
    pub name: String,
    /// Half the width of the window, m.
    pub window: f64,
    /// The best plan.
    pub best: Tried,
    /// Its references.
    pub profiles: Vec<Profile>,
    /// True if the limits of the file are kept because no plan arrives sooner.
    pub is_kept: bool,
    /// Arrival with the limits of the file.
    pub given: Arrival,
    /// Limits that the move of the file exceeds, requested ones and the reserve among them, and those of the belt that
    /// its run exceeds.
    pub shortfalls: Vec<Shortfall>,
    /// The references of the file.
    pub references: Vec<Profile>,
    /// Use of each limit of the machine, worst case over the references on the family and the run on the machine of the
    /// file.
    pub loads: Vec<Load>,
    /// Minimum time of the rigid axis within voltage and current, s; none if nothing limits it, with several drives, or
    /// with forces that depend on position or speed.
    pub bound: Option<f64>,
    /// All tried plans, in order.
    pub tried: Vec<Tried>,
}

/// The plans of a case.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Plans {
    /// The family of machines.
    pub family: Family,
    /// Frequencies of the belt with the drive pulley held, lowest along the travel, Hz.
    pub modes: Vec<f64>,
    /// Plan of each requested move.
    pub moves: Vec<Planned>,
}

/// Plans the moves with these indices of the case; `stop` ends the search early, with the best so far.
///
/// ```no_run
/// use taut::case::Case;
/// use taut::planning::plan;
/// use taut::reach::quickest::Wanted;
///
/// let case = Case::read("axis.toml")?; // with [controller] and [[move]]
/// let wanted = Wanted { speed: Some(0.5), acceleration: None, jerk: None, reserve: 0.1 };
/// let plans = plan(&case, &[0], &wanted, &|| false)?;
/// println!("{} of {} machines", plans.moves.len(), plans.family.machines.len());
/// # Ok::<(), taut::Error>(())
/// ```
pub fn plan(case: &Case, places: &[usize], wanted: &Wanted, stop: &dyn Fn() -> bool) -> Result<Plans> {
    let Some(design) = &case.controller else {
        return Err(Error::new("there is no controller that could follow a move").next("add [controller]"));
    };
    let family = Family::new(case, &case.tune.clone().unwrap_or_default())?;
    let modes = modes(&case.machine);
    let mut machines: Vec<(Machine, usize)> = Vec::new();
    for machine in family.machines.iter().map(|corner| family.stage_at(corner)) {
        match machines.iter_mut().find(|(known, _)| *known == machine) {
            Some((_, count)) => *count += 1,
            None => machines.push((machine, 1)),
        }
    }
    let planner = Planner { design, family: &family, machines, modes: &modes, wanted, stop };
    let moves: Result<Vec<_>> = places.iter().map(|&place| planner.planned(&case.moves[place], place)).collect();
    let moves = moves?;
    Ok(Plans { family, modes, moves })
}

impl Plans {
    /// The case text with the planned limits; comments are kept except in moves that have a plan in the file. `name` is
    /// used in messages.
    pub fn case_text(&self, case: &Case, name: &Path) -> Result<String> {
        let mut changes = Vec::new();
        let is_written = |planned: &&Planned| !planned.is_kept && !case.moves[planned.place].is_planned;
        for planned in self.moves.iter().filter(is_written) {
            let limits = &planned.best.limits;
            let mut set = |key: &str, value: f64, unit: &str| {
                changes.push(format!("move.{}.{key}={value:?} {unit}", planned.place));
            };
            set("speed", limits.speed, "m/s");
            set("acceleration", limits.acceleration, "m/s^2");
            [("jerk", limits.jerk, "m/s^3"), ("snap", limits.snap, "m/s^4")]
                .into_iter()
                .for_each(|(key, value, unit)| value.into_iter().for_each(|value| set(key, value, unit)));
            let end = Profile::last_rest(&planned.profiles);
            if case.moves[planned.place].until < end {
                set("until", end, "s");
            }
        }
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        Ok(Case::from_text_for(name, &case.text, &changes, Files::Nothing)?.text)
    }
}

/// The machine with spans that can also push, which shows by how much a slack span lacks tension.
fn two_sided(machine: &Machine) -> Machine {
    let mut machine = machine.clone();
    machine.belt.pretension = None;
    machine
}

/// Tolerance of the runs of a search on machines with steppers, as a part of the window.
const ROUGHLY: f64 = 1e-2;

/// Solver of the runs of a search: steppers need the general one, whose steps grow with its tolerance.
fn roughly(machine: &Machine, motion: &Move) -> Solver {
    match Solver::for_machine(machine) {
        Solver::General { tolerance } if machine.stepper().is_some() => {
            Solver::General { tolerance: (ROUGHLY * motion.window).clamp(tolerance, 1e-6) }
        }
        solver => solver,
    }
}

/// End of the runs of a move along shaped profiles, s.
fn watched_until(motion: &Move, shaped: &[Profile]) -> f64 {
    Profile::last_rest(shaped) + (motion.until - motion.end()).max(WATCHED)
}

/// Time of arrival of the cart in a run, s; none if it does not stay in its window.
fn arrives(profiles: &[Profile], figures: &Figures, ending: Ending) -> Option<f64> {
    let settling = figures.settling.filter(|_| ending == Ending::Complete);
    settling.map(|settling| Profile::last_end(profiles) + settling)
}

/// Results of a run.
struct Ran {
    /// Time of arrival of the cart, s.
    arrives: Option<f64>,
    /// Largest error of a sliding part, m.
    error: f64,
    /// Longest time for which the command or the amplifier of a drive is at its limit, s.
    saturated: f64,
    /// Least and greatest force in each span relative to the pretension, N; none for several drives, whose belts are
    /// not limited.
    spans: Vec<[Peak; 2]>,
}

/// The path of a move and its quickest way.
struct Search<'a> {
    quickest: Quickest<'a>,
    way: MovePath,
    motion: &'a Move,
}

/// Data shared by the plans of a case.
struct Planner<'a> {
    design: &'a Design,
    family: &'a Family,
    /// The distinct machines of the family, and the number of each.
    machines: Vec<(Machine, usize)>,
    modes: &'a [f64],
    wanted: &'a Wanted,
    stop: &'a dyn Fn() -> bool,
}

impl Planner<'_> {
    fn planned(&self, motion: &Move, place: usize) -> Result<Planned> {
        let impossible = |what: String| Error::new(format!("the move \"{}\": there is no plan: {what}", motion.name));
        let way = MovePath::new(&motion.profiles).ok_or_else(|| impossible("it has no stroke".into()))?;
        let machine = &self.family.machine;
        let mut short = motion.shortfalls(machine, self.design);
        let quickest = Quickest { machine, design: self.design, modes: self.modes, wanted: self.wanted };
        quickest
            .check(&way)
            .map_err(|error| Error { what: format!("the move \"{}\": {}", motion.name, error.what), ..error })?;
        let search = Search { quickest, way, motion };
        let (mut tried, refused) = self.tried(&search)?;
        if tried.is_empty() {
            let short = refused.or_else(|| self.short_of_reserve(&search.way));
            return Err(impossible(match short {
                Some(short) => short.words,
                None => "after the reserve, the limits of motor and belt leave none on all axes of the family".into(),
            }));
        }
        let (mut best, slowest) = self.best(&search, &mut tried)?;
        let mut profiles = search.way.within(&best.limits)?;
        let mut ran;
        (best.arrival, ran) = self.finished(motion, &profiles, best.arrival, slowest)?;
        // A stepper's microsteps shake the belt more than the search has shown.
        if !self.beyond(&profiles, &ran).is_empty() && !(self.stop)() {
            (best.limits, _) = self
                .slowed(&search, best.periods, best.share, best.limits, (machine, Solver::for_machine(machine)))?
                .map_err(|short| impossible(short.words))?;
            profiles = search.way.within(&best.limits)?;
            let (arrival, slowest) = self.of_family(motion, &profiles, &best.arrival, (f64::INFINITY, &mut 0))?;
            (best.arrival, ran) = self.finished(
                motion,
                &profiles,
                Arrival { duration: Profile::last_end(&profiles), ..arrival },
                slowest,
            )?;
        }
        let given = self.arrival(motion, &motion.profiles)?;
        let (given, slowest) = self.of_family(motion, &motion.profiles, &given, (f64::INFINITY, &mut 0))?;
        let (given, ran_given) = self.finished(motion, &motion.profiles, given, slowest)?;
        short.extend(self.beyond(&motion.profiles, &ran_given));
        short.extend(self.wanted.exceeded_by(&motion.profiles));
        let shaped = self.design.shaped(&motion.profiles);
        let used = without_reserve(machine, self.design.bounds(), &shaped, self.wanted.reserve);
        let is_new = |one: &Shortfall| short.iter().all(|known| known.limit != one.limit);
        let used: Vec<Shortfall> = used.into_iter().filter(is_new).collect();
        short.extend(used);
        let is_sooner = short.is_empty() && Tried::rank_of(&given) <= best.rank();
        let mut loads = self.loads(&self.design.shaped(&profiles));
        loads_of_run(machine, &ran.spans).into_iter().for_each(|load| load.join(&mut loads));
        Ok(Planned {
            is_kept: is_sooner,
            place,
            name: motion.name.clone(),
            window: motion.window,
            loads,
            bound: self.bound(&search.way),
            given,
            references: motion.profiles.clone(),
            shortfalls: short,
            best,
            profiles,
            tried,
        })
    }

    /// What a slow move lacks: reserve on the machine of the file, or a limit of another machine of the family.
    fn short_of_reserve(&self, way: &MovePath) -> Option<Shortfall> {
        let profiles = self.design.shaped(&way.within(&SLOW).ok()?);
        let bounds = self.design.bounds();
        let own = without_reserve(&self.family.machine, bounds, &profiles, self.wanted.reserve);
        let others = self.machines.iter().flat_map(|(machine, _)| shortfalls(machine, bounds, &profiles));
        let others = others.map(|mut short| {
            short.words = format!("on an axis of the family, {}", short.words);
            short
        });
        own.into_iter().chain(others).next()
    }

    /// Plans for each jerk time and fraction of the limits, with their arrival on the nominal machine, and what a run
    /// exceeded for which there is none.
    fn tried(&self, search: &Search) -> Result<(Vec<Tried>, Option<Shortfall>)> {
        let (mut tried, mut refused) = (Vec::new(), None);
        let machine = self.family.machine.interpolating();
        let runs = (&machine, roughly(&machine, search.motion));
        for periods in PERIODS {
            let mut seen: Vec<Limits> = Vec::new();
            for share in SHARES {
                if (self.stop)() {
                    return Ok((tried, refused));
                }
                let within = Share { motor: share, ..Share::ALL };
                let Some(limits) = self.limits(search, periods, within)? else { continue };
                // Where the belt is the limit, a smaller share of the motor's changes nothing.
                if seen.contains(&limits) {
                    continue;
                }
                seen.push(limits);
                match self.tried_at(search, periods, share, limits, runs)? {
                    Ok(one) => tried.push(one),
                    Err(short) => refused = Some(short),
                }
            }
        }
        self.narrow(search, &mut tried, runs)?;
        Ok((tried, refused))
    }

    /// Plan within these limits or slower ones, with its arrival on this machine by this solver, or what its run
    /// exceeds.
    fn tried_at(
        &self,
        search: &Search,
        periods: [u8; 2],
        share: f64,
        limits: Limits,
        runs: (&Machine, Solver),
    ) -> Result<std::result::Result<Tried, Shortfall>> {
        let (limits, ran) = match self.slowed(search, periods, share, limits, runs)? {
            Ok(slowed) => slowed,
            Err(short) => return Ok(Err(short)),
        };
        let duration = Profile::last_end(&search.way.within(&limits)?);
        Ok(Ok(Tried { limits, periods, share, arrival: Arrival::new(duration, &ran) }))
    }

    /// Adds plans by bisection between the fraction of the first to arrive and the next larger one, at which the cart
    /// leaves its window once more.
    fn narrow(&self, search: &Search, tried: &mut Vec<Tried>, runs: (&Machine, Solver)) -> Result<()> {
        let Some(mut best) = tried.iter().min_by(|a, b| a.rank().total_cmp(&b.rank())).cloned() else { return Ok(()) };
        let Some(mut above) = SHARES.into_iter().rev().find(|share| *share > best.share) else { return Ok(()) };
        for _ in 0..NARROWED {
            let share = 0.5 * (best.share + above);
            let Some(limits) = self.limits(search, best.periods, Share { motor: share, ..Share::ALL })? else { break };
            if (self.stop)() || tried.iter().any(|one| one.limits == limits) {
                break;
            }
            let Ok(one) = self.tried_at(search, best.periods, share, limits, runs)? else { break };
            if one.rank() < best.rank() {
                best = one.clone()
            } else {
                above = share
            }
            tried.push(one);
        }
        Ok(())
    }

    /// Limits of the quickest move within these fractions of the limits, and within those of the family.
    fn limits(&self, search: &Search, periods: [u8; 2], share: Share) -> Result<Option<Limits>> {
        search.quickest.limits_for(&search.way, periods, share, &|profiles| self.loads(profiles))
    }

    /// The limits of a plan, reduced until its run on this machine keeps the limits of the belt, and that run; or what
    /// it exceeds. The belt vibrates, so that its spans take more than the reference requires.
    fn slowed(
        &self,
        search: &Search,
        periods: [u8; 2],
        motor: f64,
        mut limits: Limits,
        (machine, solver): (&Machine, Solver),
    ) -> Result<std::result::Result<(Limits, Ran), Shortfall>> {
        let of_belt =
            |loads: &[Load]| loads.iter().filter(|load| !load.is_of_motor()).map(Load::share).fold(0.0, f64::max);
        let (mut belt, mut slowed) = (1.0, 0);
        loop {
            let profiles = search.way.within(&limits)?;
            let ran = self.run(search.motion, &profiles, (machine, solver))?;
            let Some(short) = self.beyond(&profiles, &ran).into_iter().next() else { return Ok(Ok((limits, ran))) };
            if slowed == SLOWED {
                return Ok(Err(short));
            }
            slowed += 1;
            let shaped = self.design.shaped(&profiles);
            let required = of_belt(&loads(&self.family.machine, self.design.bounds(), &shaped));
            let taken = self.run(search.motion, &profiles, (&two_sided(machine), solver))?;
            belt = AIMED * required.min(belt) / of_belt(&loads_of_run(&self.family.machine, &taken.spans)).max(1.0);
            limits = match self.limits(search, periods, Share { motor, belt })? {
                Some(limits) => limits,
                None => return Ok(Err(short)),
            };
        }
    }

    /// The limits of the belt of the file that a run exceeds.
    fn beyond(&self, profiles: &[Profile], ran: &Ran) -> Vec<Shortfall> {
        match &self.design.shaped(profiles)[..] {
            [profile] => shortfalls_of_run(&self.family.machine, &ran.spans, profile),
            _ => Vec::new(),
        }
    }

    /// The best of the plans on the whole family, and its slowest machine.
    fn best(&self, search: &Search, tried: &mut [Tried]) -> Result<(Tried, Option<&Machine>)> {
        tried.sort_by(|a, b| a.rank().total_cmp(&b.rank()));
        let (mut best, mut slowest, mut is_run) = (tried[0].clone(), None, false);
        // Runs of steppers take long: those of a plan end at a machine that arrives too late, unless all plans have
        // one.
        let is_slow = self.family.machine.stepper().is_some();
        let mut first = 0;
        for is_cut in [is_slow, false] {
            for one in &mut *tried {
                // The slowest machine of a family does not arrive before any of its members.
                if (self.stop)() || is_run && best.rank() <= one.rank() {
                    break;
                }
                let bar = match is_cut {
                    true if is_run => best.rank().min(NEVER),
                    true => NEVER,
                    false => f64::INFINITY,
                };
                let profiles = search.way.within(&one.limits)?;
                let late;
                (one.arrival, late) = self.of_family(search.motion, &profiles, &one.arrival, (bar, &mut first))?;
                if !is_run || one.rank() < best.rank() {
                    (best, slowest, is_run) = (one.clone(), late, true);
                }
            }
            if !is_cut || best.rank() < NEVER || (self.stop)() {
                break;
            }
            is_run = false;
            tried.iter_mut().for_each(|one| one.arrival = one.arrival.alone());
        }
        Ok((best, slowest))
    }

    /// Largest use of each limit by references with their shaper, over the family.
    fn loads(&self, profiles: &[Profile]) -> Vec<Load> {
        let mut all: Vec<Load> = Vec::new();
        for (machine, _) in &self.machines {
            loads(machine, self.design.bounds(), profiles).into_iter().for_each(|load| load.join(&mut all));
        }
        all
    }

    /// A run in closed loop, or as steppers take the cart along the references.
    fn run(&self, motion: &Move, profiles: &[Profile], (machine, solver): (&Machine, Solver)) -> Result<Ran> {
        let run = closed_loop(&Setup {
            machine,
            model: &self.family.machine,
            design: self.design,
            profiles,
            until: watched_until(motion, &self.design.shaped(profiles)),
            window: motion.window,
            solver,
        })?;
        Ok(Ran {
            arrives: arrives(profiles, &run.figures, run.outcome.ending),
            error: run.figures.worst_load().error.peak.value.abs(),
            saturated: run.figures.saturated(),
            spans: if machine.drives.len() == 1 { run.figures.spans } else { Vec::new() },
        })
    }

    /// Arrival on the machine of the file alone.
    fn arrival(&self, motion: &Move, profiles: &[Profile]) -> Result<Arrival> {
        let machine = self.family.machine.interpolating();
        let ran = self.run(motion, profiles, (&machine, roughly(&machine, motion)))?;
        Ok(Arrival::new(Profile::last_end(profiles), &ran))
    }

    /// Arrival on the whole family, and the machine that arrives last; only up to a machine that arrives later than
    /// the bar, s, which is then the first one of the next family.
    fn of_family(
        &self,
        motion: &Move,
        profiles: &[Profile],
        own: &Arrival,
        (bar, first): (f64, &mut usize),
    ) -> Result<(Arrival, Option<&Machine>)> {
        let mut arrival = Arrival { settled: 0, axes: 0, ..own.clone() };
        let mut slowest: Option<(f64, &Machine)> = None;
        let begin = *first;
        let others = (0..self.machines.len()).filter(|number| *number != begin);
        let mut controllers = Standard::of_drives(self.design, &self.family.machine)?;
        let (mut controllers, timing) = (each(&mut controllers), Loop::new(self.design));
        let shaped = self.design.shaped(profiles);
        let until = watched_until(motion, &shaped);
        let path = SampledPath::new(shaped, timing, until);
        for number in std::iter::once(begin).chain(others) {
            if (self.stop)() {
                return Ok((arrival, None));
            }
            let (machine, count) = &self.machines[number];
            let (smooth, solver) = (machine.interpolating(), roughly(machine, motion));
            let seen = (until, motion.window);
            let (figures, ending) = closed_loop_briefly(&smooth, &mut controllers, &timing, &path, seen, solver)?;
            let time = arrives(profiles, &figures, ending);
            arrival.settled += if time.is_some() { *count } else { 0 };
            arrival.axes += count;
            let late = time.unwrap_or(f64::INFINITY);
            if slowest.is_none_or(|(latest, _)| late > latest) {
                slowest = Some((late, machine));
            }
            if late > bar {
                *first = number;
                break;
            }
        }
        arrival.worst = slowest.map(|(latest, _)| latest).filter(|latest| latest.is_finite());
        Ok((arrival, slowest.map(|(_, machine)| machine)))
    }

    /// The same with the run on the machine of the file; steppers move it and the slowest one in microsteps.
    fn finished(
        &self,
        motion: &Move,
        profiles: &[Profile],
        mut arrival: Arrival,
        slowest: Option<&Machine>,
    ) -> Result<(Arrival, Ran)> {
        let closely = |machine| (machine, Solver::for_machine(machine));
        let ran = self.run(motion, profiles, closely(&self.family.machine))?;
        arrival = Arrival { nominal: ran.arrives, cart_error: ran.error, saturated: ran.saturated, ..arrival };
        if let (true, Some(worst), Some(machine)) =
            (self.family.machine.mechanism().is_stepped(), arrival.worst, slowest)
        {
            arrival.worst = self.run(motion, profiles, closely(machine))?.arrives.map(|stepped| worst.max(stepped));
        }
        Ok((arrival, ran))
    }

    /// Minimum time of all legs of the rigid axis, with their rests; none with forces that depend on position or speed.
    fn bound(&self, way: &MovePath) -> Option<f64> {
        let [mut from] = way.start[..] else { return None };
        if self.family.machine.cart.forces != SlideForces::default() {
            return None;
        }
        let limits = limits(&self.family.machine, self.design.bounds());
        let rigid = Rigid::new(&self.family.machine);
        let mut time = 0.0;
        for leg in &way.legs {
            match leg {
                Leg::Wait(rest) => time += rest,
                Leg::To(to, _) => {
                    time += rigid.quickest(to[0] - from, limits)?;
                    from = to[0];
                }
                Leg::Around(..) => return None,
            }
        }
        Some(time)
    }
}

impl Arrival {
    /// On the nominal machine alone.
    fn alone(&self) -> Self {
        Self { worst: None, settled: usize::from(self.nominal.is_some()), axes: 1, ..self.clone() }
    }

    /// That of a run on the machine of the file alone.
    fn new(duration: f64, ran: &Ran) -> Self {
        Self {
            duration,
            nominal: ran.arrives,
            worst: None,
            settled: usize::from(ran.arrives.is_some()),
            axes: 1,
            cart_error: ran.error,
            saturated: ran.saturated,
        }
    }
}

impl Tried {
    fn rank(&self) -> f64 {
        Self::rank_of(&self.arrival)
    }

    /// Rank, smaller is better: the arrival if all machines arrive; others come last.
    fn rank_of(arrival: &Arrival) -> f64 {
        let Arrival { duration, nominal, worst, settled, axes, .. } = arrival;
        let missed = (axes - settled) as f64 / (*axes).max(1) as f64;
        let arrives = if *axes > 1 { worst.or(*nominal) } else { *nominal };
        arrives.unwrap_or(*duration) + if missed > 0.0 { NEVER * (1.0 + missed) } else { 0.0 }
    }
}
