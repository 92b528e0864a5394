//! Feasibility of a reference: the requirements on motor, amplifier, belt and travel, and their limits.

use super::compensation::{Compensation, direction};
use super::course::{AtInstant, Course, Limit};
use super::forward::{Forward, Required};
use super::pull_out::Curve;
use crate::design::{Bounds, FeedForward, FeedForwardModel};
use crate::machine::rigid::Rigid;
use crate::machine::{AmplifierMode, Belt, BeltModel, Machine};
use crate::metrics::Peak;
use crate::number::engineering;
use crate::signal::profile::{Profile, Reference};

/// Time in which an acceleration jumps, relative to the reference, for the jerk of a message.
const JUMP: f64 = 1.0 / 4000.0;

/// Relative excess of a requested limit that rounding explains.
const ROUNDED: f64 = 1e-6;

/// Jump of an acceleration, relative to the largest, that the distance of instants on either side of a seam explains.
const SMOOTH: f64 = 1e-4;

/// Limit that stands for zero, of any unit.
const LEAST: f64 = 1e-100;

/// Share of the pretension that a run takes off a span without slack: a slack span has lost all of it, to rounding.
const TAUT: f64 = 1.0 - 1e-6;

/// A limit that a reference exceeds.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Shortfall {
    /// `voltage`, `current`, `pull_out`, `breakaway`, `travel`, `slack`, `tension` or `teeth`; of a requested limit
    /// `speed`, `acceleration` or `jerk`.
    pub limit: &'static str,
    /// Time of the largest requirement, s.
    pub time: f64,
    /// Reference position at that time, m; with several drives, along the belt of the drive.
    pub position: f64,
    /// Requirement, in `unit`.
    pub needed: f64,
    /// Limit.
    pub allowed: f64,
    /// V, A, N, N m or m.
    pub unit: &'static str,
    /// Complete description in a sentence.
    pub words: String,
}

/// A reference at one instant.
struct Instant {
    time: f64,
    y: Reference,
}

/// Requirements at one instant of a reference.
struct Need {
    at: Instant,
    /// Force of the motor at the belt, N; motor current, A; voltage at its terminals, V.
    force: f64,
    current: f64,
    voltage: f64,
    /// Forces in the spans relative to the pretension, N; zero for a rigid belt.
    spans: [f64; 3],
    /// Speed and acceleration of the reference and of the drive pulley; with several drives, of both slides and of the
    /// belt of the drive.
    motions: [[f64; 2]; 3],
}

impl AtInstant for Instant {
    fn time(&self) -> f64 {
        self.time
    }

    fn motions(&self) -> [[f64; 2]; 3] {
        motions(&[self.y])
    }
}

impl AtInstant for Need {
    fn time(&self) -> f64 {
        self.at.time
    }

    fn motions(&self) -> [[f64; 2]; 3] {
        self.motions
    }
}

/// Speed and acceleration of up to three references.
fn motions<'a>(references: impl IntoIterator<Item = &'a Reference>) -> [[f64; 2]; 3] {
    let mut references = references.into_iter();
    std::array::from_fn(|_| references.next().map_or([0.0; 2], |y| [y.speed, y.acceleration]))
}

/// Requirements at a time along references, s.
type AtTime<'a> = Box<dyn Fn(f64) -> Need + 'a>;

/// A quantity at one instant of a reference.
type Quantity = Box<dyn Fn(&Need) -> f64>;

/// A limit of the machine and the requirement that it bounds, with the words of its message before, between and after
/// the values.
struct Demand {
    limit: &'static str,
    unit: &'static str,
    allowed: Quantity,
    needed: Quantity,
    words: [&'static str; 3],
}

impl Demand {
    /// Requirement as a fraction of the limit; a limit may be zero.
    fn share(&self, need: &Need) -> f64 {
        (self.needed)(need) / (self.allowed)(need).max(LEAST)
    }

    /// Instant with the largest use of the limit, its requirement, and the allowed value there.
    fn most(&self, course: &Course<Need>) -> (Need, [f64; 2]) {
        let need = course.most(|need| self.share(need));
        let both = [(self.needed)(&need), (self.allowed)(&need)];
        (need, both)
    }
}

/// Largest requirement of a reference, and its limit, both in `unit`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Load {
    /// `voltage`, `current`, `pull_out`, `slack`, `tension` or `teeth`.
    pub limit: &'static str,
    /// V, A, N or N m.
    pub unit: &'static str,
    /// Largest requirement.
    pub needed: f64,
    /// Limit.
    pub allowed: f64,
}

impl Load {
    /// Requirement divided by the limit.
    pub fn share(&self) -> f64 {
        self.needed / self.allowed
    }

    /// Adds it to loads with one entry per limit, keeping the larger use.
    pub fn join(self, all: &mut Vec<Self>) {
        match all.iter_mut().find(|known| known.limit == self.limit) {
            Some(known) if self.share() > known.share() => *known = self,
            Some(_) => (),
            None => all.push(self),
        }
    }

    /// True for limits of the motor or its supply, of which a loop, or the oscillation of a stepper, needs a reserve.
    pub fn is_of_motor(&self) -> bool {
        is_of_motor(self.limit)
    }
}

/// A limit of the tension in the spans of a belt, N.
#[derive(Clone, Copy)]
struct Tension {
    limit: &'static str,
    allowed: f64,
    /// Requirement of a span at rest, N, and per force relative to the pretension.
    line: [f64; 2],
    words: [&'static str; 3],
}

impl Tension {
    /// Those of this belt; none if it is rigid, since the forces in its spans are unknown.
    fn from_belt(belt: &Belt) -> Vec<Self> {
        let slack = belt.pretension.map(|allowed| Self {
            limit: "slack",
            allowed,
            line: [0.0, -1.0],
            words: ["takes", " off a span", ", which goes slack; the pretension is"],
        });
        let tension = belt.sheet.allowed_tension.map(|allowed| Self {
            limit: "tension",
            allowed,
            line: [belt.pretension.unwrap_or(0.0), 1.0],
            words: ["brings a span to", "", "; the belt may have"],
        });
        slack.into_iter().chain(tension).filter(|_| belt.model != BeltModel::Rigid).collect()
    }

    /// Requirement of a span with this force relative to the pretension, N.
    fn needed(&self, force: f64) -> f64 {
        let [at_rest, per_force] = self.line;
        at_rest + per_force * force
    }

    fn demand(self) -> Demand {
        let needed = move |need: &Need| need.spans.iter().map(|f| self.needed(*f)).fold(self.needed(0.0), f64::max);
        let Self { limit, allowed, words, .. } = self;
        Demand { limit, unit: "N", allowed: Box::new(move |_| allowed), needed: Box::new(needed), words }
    }

    /// The largest requirement of a run, N, and its time, s.
    fn in_run(&self, spans: &[[Peak; 2]]) -> (f64, f64) {
        let needs = spans.iter().flatten().map(|peak| (self.needed(peak.value), peak.time));
        needs.fold((self.needed(0.0), 0.0), |most, need| if need.0 > most.0 { need } else { most })
    }
}

/// Use of the belt's limits by a run with these least and greatest forces of each span relative to the pretension.
pub fn loads_of_run(machine: &Machine, spans: &[[Peak; 2]]) -> Vec<Load> {
    let load = |tension: Tension| {
        let Tension { limit, allowed, .. } = tension;
        Load { limit, unit: "N", needed: tension.in_run(spans).0, allowed }
    };
    Tension::from_belt(&machine.belt).into_iter().map(load).collect()
}

/// The limits of the belt that such a run along `profile` exceeds.
pub fn shortfalls_of_run(machine: &Machine, spans: &[[Peak; 2]], profile: &Profile) -> Vec<Shortfall> {
    let exceeded = |tension: Tension| {
        let Tension { limit, allowed, words: [comes_by, behind, there], .. } = tension;
        let (needed, time) = tension.in_run(spans);
        let at = Instant { time, y: profile.at(time) };
        let words = || {
            format!("its run {comes_by} {}{behind} ({}){there} {}", told(needed, "N"), at.when(), told(allowed, "N"))
        };
        (needed > TAUT * allowed).then(|| at.beyond(limit, [needed, allowed], "N", words()))
    };
    Tension::from_belt(&machine.belt).into_iter().filter_map(exceeded).collect()
}

/// Limits of this machine under a controller with these limits.
fn demands(machine: &Machine, bounds: Bounds) -> Vec<Demand> {
    let belt = &machine.belt;
    let carried = belt.sheet.mesh(machine.pulley_radius).and_then(|(_, carried)| carried);
    let teeth = carried.map(|carried| Demand {
        limit: "teeth",
        unit: "N",
        allowed: Box::new(move |_| carried),
        needed: Box::new(|need| need.force.abs()),
        words: ["takes", " at the drive pulley", "; the teeth in mesh carry"],
    });
    let of_belt = Tension::from_belt(belt).into_iter().map(Tension::demand).chain(teeth);
    of_motor(machine, 0, bounds).into_iter().chain(of_belt).collect()
}

/// Demands on a motor under a controller with these limits.
fn of_motor(machine: &Machine, drive: usize, bounds: Bounds) -> Vec<Demand> {
    let (volts, amperes) = limits_of(machine, drive, bounds);
    electrical(volts, amperes).into_iter().chain(pull_out(machine, drive)).collect()
}

/// Demand on a stepper; none for other motors.
fn pull_out(machine: &Machine, drive: usize) -> Option<Demand> {
    let (curve, r) = (Curve::from_unit(&machine.drives[drive])?, machine.pulley_radius);
    Some(Demand {
        limit: "pull_out",
        unit: "N m",
        allowed: Box::new(move |need| curve.torque(need.at.y.speed / r)),
        needed: Box::new(move |need| (r * need.force).abs()),
        words: ["needs", " from the motor", "; its pull-out torque at that speed is"],
    })
}

/// The demands on a motor with these limits of voltage and current.
fn electrical(volts: Option<f64>, amperes: Option<f64>) -> Vec<Demand> {
    let words = ["needs", "", "; the limit is"];
    let voltage = volts.map(|allowed| {
        let needed = Box::new(|need: &Need| need.voltage.abs());
        Demand { limit: "voltage", unit: "V", allowed: Box::new(move |_| allowed), needed, words }
    });
    let current = amperes.map(|allowed| {
        let needed = Box::new(|need: &Need| need.current.abs());
        Demand { limit: "current", unit: "A", allowed: Box::new(move |_| allowed), needed, words }
    });
    voltage.into_iter().chain(current).collect()
}

/// Limits of a machine under a controller, those of each drive with its requirements along references; with several
/// drives, those of the motors.
fn demanded<'a>(
    machine: &'a Machine,
    bounds: Bounds,
    profiles: &'a [Profile],
) -> impl Iterator<Item = (AtTime<'a>, Vec<Demand>)> {
    (0..machine.drives.len()).map(move |drive| match profiles {
        [profile] => (needs(machine, profile), demands(machine, bounds)),
        _ => (needs_of_drive(machine, drive, profiles), of_motor(machine, drive, bounds)),
    })
}

/// Requirements along references, shapers included.
fn course<'a>(machine: &Machine, profiles: &[Profile], needs: AtTime<'a>) -> Course<'a, Need> {
    Course::new(profiles, has_lines(machine), needs)
}

/// Largest use of each limit by references, shapers included; of several drives, the most loaded one.
pub fn loads(machine: &Machine, bounds: Bounds, profiles: &[Profile]) -> Vec<Load> {
    let mut all: Vec<Load> = Vec::new();
    for (needs, demands) in demanded(machine, bounds, profiles) {
        let course = course(machine, profiles, needs);
        for demand in demands {
            let (_, [needed, allowed]) = demand.most(&course);
            Load { limit: demand.limit, unit: demand.unit, needed: needed.max(0.0), allowed }.join(&mut all);
        }
    }
    all
}

/// True if references, shapers included, use at most this fraction of each limit: of those of the motors, and of the
/// others.
pub(super) fn are_within(machine: &Machine, bounds: Bounds, profiles: &[Profile], [motor, belt]: [f64; 2]) -> bool {
    demanded(machine, bounds, profiles).all(|(needs, demands)| {
        let shares: Vec<_> = demands.iter().map(|demand| |need: &Need| demand.share(need)).collect();
        let of = |demand: &Demand| if is_of_motor(demand.limit) { motor } else { belt };
        let limits: Vec<Limit<Need>> =
            demands.iter().zip(&shares).map(|(demand, share)| (of(demand), share as _)).collect();
        !Course::exceeds((profiles, has_lines(machine)), needs, &limits)
    })
}

/// True for limits of a motor or its supply.
fn is_of_motor(limit: &str) -> bool {
    ["voltage", "current", "pull_out"].contains(&limit)
}

/// Limits that `profile`, shaper included, exceeds on this machine under a controller with these limits;
/// none if the reference can be followed. Friction is taken as viscous plus Coulomb, the idler's own mode as
/// quasi-static.
///
/// With several drives, voltage and current of each are checked with rigid belts.
pub fn shortfalls(machine: &Machine, bounds: Bounds, profiles: &[Profile]) -> Vec<Shortfall> {
    let of_drives: Vec<Shortfall> = match profiles {
        [profile] => of_axis(machine, bounds, profile),
        _ => (0..machine.drives.len()).flat_map(|drive| of_drive(machine, bounds, drive, profiles)).collect(),
    };
    let slides = profiles.iter().enumerate();
    let of_slides = slides.flat_map(|(number, profile)| of_slide(machine, bounds, number, profile));
    of_drives.into_iter().chain(of_slides).collect()
}

/// Limits exceeded at one drive of a machine with several.
fn of_drive(machine: &Machine, bounds: Bounds, drive: usize, profiles: &[Profile]) -> Vec<Shortfall> {
    let needs = course(machine, profiles, needs_of_drive(machine, drive, profiles));
    let name = machine.geometry().drives[drive].label.name;
    let exceeded = of_motor(machine, drive, bounds).into_iter().filter_map(|demand| exceeded(&needs, &demand));
    exceeded.map(|short| Shortfall { words: format!("{name}: {}", short.words), ..short }).collect()
}

/// Requirements of one of several drives, with rigid belts.
fn needs_of_drive<'a>(machine: &Machine, drive: usize, profiles: &'a [Profile]) -> AtTime<'a> {
    let all = FeedForward { model: FeedForwardModel::Rigid, ..FeedForward::NONE };
    let forward = Forward::new(all, machine, drive).expect("a machine with several drives");
    Box::new(move |time| {
        let slides: [Reference; 2] = std::array::from_fn(|slide| profiles[slide].at(time));
        let Required { along, force, current, voltage } = forward.required(&slides);
        let motions = motions(slides.iter().chain([&along]));
        Need { at: Instant { time, y: along }, force, current, voltage, spans: [0.0; 3], motions }
    })
}

/// True if the force on a slide depends on its position or speed.
fn has_lines(machine: &Machine) -> bool {
    machine.slides().any(|slide| slide.forces.along.is_some() || slide.forces.by_speed.is_some())
}

fn of_axis(machine: &Machine, bounds: Bounds, profile: &Profile) -> Vec<Shortfall> {
    let needs = course(machine, std::slice::from_ref(profile), needs(machine, profile));
    let (volts, _) = limits(machine, bounds);
    let mut found: Vec<Shortfall> = Vec::new();
    for demand in demands(machine, bounds) {
        let by_speed = if demand.limit == "voltage" { of_speed(machine, volts, &needs) } else { None };
        found.extend(by_speed.or_else(|| exceeded(&needs, &demand)));
    }
    found
}

/// A value for a sentence.
fn told(value: f64, unit: &str) -> String {
    engineering(value, unit, 3)
}

impl Instant {
    /// Time and position, for a sentence.
    fn when(&self) -> String {
        format!("at {}, {}", told(self.time, "s"), told(self.y.position, "m"))
    }

    /// The limit that it exceeds.
    fn beyond(&self, limit: &'static str, [needed, allowed]: [f64; 2], unit: &'static str, words: String) -> Shortfall {
        Shortfall { limit, time: self.time, position: self.y.position, needed, allowed, unit, words }
    }
}

/// Instant of the largest requirement, if it exceeds the limit.
fn most<T: AtInstant>(course: &Course<T>, allowed: f64, needed: impl Fn(&T) -> f64) -> Option<T> {
    let most = course.most(&needed);
    (needed(&most) - allowed > 1e-9 * allowed.abs().max(1.0)).then_some(most)
}

/// The limit, if the motion exceeds it.
fn exceeded(needs: &Course<Need>, demand: &Demand) -> Option<Shortfall> {
    let &Demand { limit, unit, words: [comes_by, behind, there], .. } = demand;
    let (need, [needed, allowed]) = demand.most(needs);
    if needed - allowed <= 1e-9 * allowed.abs().max(1.0) {
        return None;
    }
    let (speed, acceleration) = (told(need.at.y.speed.abs(), "m/s"), told(need.at.y.acceleration.abs(), "m/s^2"));
    let words = format!(
        "{acceleration} at {speed} {comes_by} {}{behind} ({}){there} {}",
        told(needed, unit),
        need.at.when(),
        told(allowed, unit)
    );
    Some(need.at.beyond(limit, [needed, allowed], unit, words))
}

/// The voltage limit, if the largest speed alone exceeds it without acceleration.
fn of_speed(machine: &Machine, volts: Option<f64>, needs: &Course<Need>) -> Option<Shortfall> {
    let (volts, rigid) = (volts?, Rigid::new(machine));
    most(needs, volts, |need| need.voltage.abs())?;
    let steady = |speed: f64| {
        let (viscous, dry) = rigid.friction(speed, speed.signum());
        rigid.electrical(viscous + dry - rigid.constant, 0.0, &Reference::steady(speed)).1.abs()
    };
    let fastest = needs.most(|need| need.at.y.speed.abs());
    let speed = fastest.at.y.speed;
    let (at_rest, needed) = (steady(1e-9 * speed), steady(speed));
    if needed <= volts {
        return None;
    }
    // Voltage is linear in speed.
    let reached = speed.abs() * ((volts - at_rest) / (needed - at_rest)).max(0.0);
    let words = format!(
        "{} needs {} ({}); {} reach {}",
        told(speed.abs(), "m/s"),
        told(needed, "V"),
        fastest.at.when(),
        told(volts, "V"),
        told(reached, "m/s")
    );
    Some(fastest.at.beyond("voltage", [needed, volts], "V", words))
}

/// Limits that the reference of one slide exceeds; with several slides the message names it.
fn of_slide(machine: &Machine, bounds: Bounds, number: usize, profile: &Profile) -> Vec<Shortfall> {
    let at = |time: f64| Instant { time, y: profile.at(time) };
    let instants = Course::new(std::slice::from_ref(profile), has_lines(machine), at);
    let found = [of_breakaway(machine, bounds, number, &instants), of_travel(machine, number, &instants)];
    let body = machine.geometry().slides[number].body;
    let name = machine.bridge.as_ref().map(|_| machine.geometry().label(body).name);
    let named = |short: Shortfall| match name {
        Some(name) => Shortfall { words: format!("{name}: {}", short.words), ..short },
        None => short,
    };
    found.into_iter().flatten().map(named).collect()
}

/// Breakaway force of a slide with everything that turns with it, if the motors give less at standstill.
fn of_breakaway(machine: &Machine, bounds: Bounds, number: usize, instants: &Course<Instant>) -> Option<Shortfall> {
    let at_standstill = |drive: usize| {
        if let Some(curve) = Curve::from_unit(&machine.drives[drive]) {
            return Some(curve.torque(0.0) / machine.pulley_radius);
        }
        let (volts, amperes) = limits_of(machine, drive, bounds);
        let (current, voltage) = Rigid::of_pulley(machine, drive).electrical(1.0, 0.0, &Reference::default());
        let force = [volts.map(|volts| volts / voltage), amperes.map(|amperes| amperes / current)];
        force.into_iter().flatten().reduce(f64::min)
    };
    let force = machine.movers(number).map(|(drive, _)| at_standstill(drive)).sum::<Option<f64>>()?;
    instants.values().find_map(|at| {
        let side = direction(&at.y);
        let needed = machine.breakaway(number, side, at.y.position);
        let provides = if machine.movers(number).count() == 1 { "the motor provides" } else { "the motors provide" };
        let words = || format!("breakaway requires {}; {provides} {}", told(needed, "N"), told(force, "N"));
        (side != 0.0 && needed > force).then(|| at.beyond("breakaway", [needed, force], "N", words()))
    })
}

/// References of all slides at one instant.
struct OnPath {
    time: f64,
    slides: Vec<Reference>,
}

impl OnPath {
    /// Length of the vector with these components.
    fn norm(&self, of: fn(&Reference) -> f64) -> f64 {
        self.slides.iter().map(|y| of(y).powi(2)).sum::<f64>().sqrt()
    }
}

impl AtInstant for OnPath {
    fn time(&self) -> f64 {
        self.time
    }

    fn motions(&self) -> [[f64; 2]; 3] {
        motions(&self.slides)
    }
}

/// A requested limit: its name, its unit, and the value, if there is one.
pub(super) type Requested = (&'static str, &'static str, Option<f64>);

/// Those of these limits of speed, acceleration and jerk along a path that references exceed. An acceleration that
/// jumps exceeds any jerk; on arcs, only the speed counts.
pub(super) fn along_path(profiles: &[Profile], limits: [Requested; 3]) -> Vec<Shortfall> {
    let arcs: Vec<[f64; 2]> = (profiles.iter().flat_map(Profile::passages))
        .filter(|passage| passage.turn.is_some())
        .map(|passage| [passage.begin, passage.begin + passage.duration()])
        .collect();
    let at = |time: f64| OnPath { time, slides: profiles.iter().map(|profile| profile.at(time)).collect() };
    let course = Course::new(profiles, false, at);
    let of: [fn(&Reference) -> f64; 3] = [|y| y.speed, |y| y.acceleration, |y| y.jerk];
    let is_straight = |at: &OnPath| !arcs.iter().any(|[begin, end]| (*begin..=*end).contains(&at.time));
    let mut most: [(f64, f64); 3] = std::array::from_fn(|k| {
        let value = |at: &OnPath| if k == 0 || is_straight(at) { at.norm(of[k]) } else { 0.0 };
        let at = course.most(value);
        (value(&at), at.time)
    });
    // |a(t₂) − a(t₁)| ≤ ∫ |j| dt
    let within = JUMP * Profile::last_rest(profiles);
    for (before, after) in course.seams().filter(|(before, after)| is_straight(before) && is_straight(after)) {
        let jump = |(a, b): (&Reference, &Reference)| (b.acceleration - a.acceleration).powi(2);
        let jump = before.slides.iter().zip(&after.slides).map(jump).sum::<f64>().sqrt();
        if jump > most[1].0 * SMOOTH && jump / within > most[2].0 {
            most[2] = (jump / within, after.time);
        }
    }
    let exceeded = |((limit, unit, allowed), (needed, time)): (Requested, (f64, f64))| {
        let allowed = allowed.filter(|allowed| needed > allowed * (1.0 + ROUNDED))?;
        let at = Instant { time, y: profiles[0].at(time) };
        let words = format!("reaches {} ({}); {} is requested", told(needed, unit), at.when(), told(allowed, unit));
        Some(at.beyond(limit, [needed, allowed], unit, words))
    };
    limits.into_iter().zip(most).filter_map(exceeded).collect()
}

/// Limits of the motors of which references, shaper included, leave less than this reserve, 0 to 1.
pub fn without_reserve(machine: &Machine, bounds: Bounds, profiles: &[Profile], reserve: f64) -> Vec<Shortfall> {
    let mut found = Vec::new();
    for (needs, demands) in demanded(machine, bounds, profiles) {
        let course = course(machine, profiles, needs);
        for demand in demands.into_iter().filter(|demand| is_of_motor(demand.limit)) {
            let (need, [needed, allowed]) = demand.most(&course);
            let left = (1.0 - reserve) * allowed;
            if needed <= left * (1.0 + ROUNDED) {
                continue;
            }
            let [needs, leaves] = [needed, left].map(|value| told(value, demand.unit));
            let words = format!("needs {needs} ({}); the reserve leaves {leaves}", need.at.when());
            found.push(need.at.beyond(demand.limit, [needed, left], demand.unit, words));
        }
    }
    found
}

/// The end of a slide's travel, if its reference exceeds it.
fn of_travel(machine: &Machine, number: usize, instants: &Course<Instant>) -> Option<Shortfall> {
    let travel = machine.slide(number)?.travel?;
    let beyond = |at: &Instant| (at.y.position - travel.max).max(travel.min - at.y.position);
    let at = most(instants, 0.0, beyond)?;
    let position = at.y.position;
    let end = if position > travel.max { travel.max } else { travel.min };
    let words = format!(
        "the reference goes to {} (at {}); the travel ends at {}",
        told(position, "m"),
        told(at.time, "s"),
        told(end, "m")
    );
    Some(at.beyond("travel", [position, end], "m", words))
}

/// All limits exceeded by a move, in a sentence.
pub fn sentence(name: &str, short: &[Shortfall]) -> String {
    let words: Vec<&str> = short.iter().map(|short| &*short.words).collect();
    format!("the move \"{name}\" cannot be followed: {}", words.join("; "))
}

/// The tightest limits of voltage and current, V and A, of the first drive.
pub fn limits(machine: &Machine, bounds: Bounds) -> (Option<f64>, Option<f64>) {
    limits_of(machine, 0, bounds)
}

/// Tightest limits of voltage and current of any drive, V and A.
fn limits_of(machine: &Machine, drive: usize, bounds: Bounds) -> (Option<f64>, Option<f64>) {
    let amplifier = &machine.drives[drive].amplifier;
    let commanded = bounds.command.map(|limit| limit * amplifier.gain.abs());
    let least = |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b).reduce(f64::min);
    match amplifier.mode {
        AmplifierMode::Voltage => {
            (least(amplifier.voltage_limit, commanded), least(amplifier.current_limit, bounds.current))
        }
        // Its limit is the pull-out torque.
        AmplifierMode::Position => (None, None),
        AmplifierMode::Current => (amplifier.voltage_limit, least(amplifier.current_limit, commanded)),
    }
}

/// Requirements of an axis.
fn needs<'a>(machine: &'a Machine, profile: &'a Profile) -> AtTime<'a> {
    let compensation = Compensation::new(machine, &FeedForward::NONE);
    Box::new(move |time| {
        let y = profile.at(time);
        // It contains a force along the travel, but not one by speed.
        let needed = compensation.needed(&y);
        let by_speed = machine.cart.forces.by_speed.as_ref().map_or(0.0, |line| line.value(y.speed));
        let force = needed.force[0] - by_speed;
        let (current, voltage) = compensation.rigid.electrical(force, needed.force[1], &needed.drive);
        let (at, motions) = (Instant { time, y }, motions(&[y, needed.drive]));
        Need { at, force, current, voltage, spans: needed.spans, motions }
    })
}
