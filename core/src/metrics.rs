//! The key figures of a run: where it ended, how fast it went, the load on belt and motor, when it stopped, and how far
//! the encoder's pulley and the cart were apart.
//!
//! A [`Meter`] observes a run as it goes on and keeps nothing of it, so that a run of any length needs the same memory.
//! It sees the motion between rows, on both sides of every event and jump of the input: what it reports does not depend
//! on the output interval but for rounding. Of the paper's Table 3 it sees the steps.

mod gantry;
mod watch;

pub use gantry::{GantryMeter, GantryMetrics};
pub use watch::{Sum, Watch, Watched};

use crate::friction::Motion;
use crate::machine::Machine;
use crate::machine::axis::{BODIES, CART, DRIVE, ROTOR};
use crate::mechanism::{AmplifierMode, Mode, State};
use crate::plan::Experiment;
use crate::solve::{Closer, Curve, Event, Gap, Gaps, Observe, QUANTITIES, Reading, Stretch, reading};

/// Share of the run that a stretch of constant input has to last before a steady speed is sought in it.
const SHORTEST: f64 = 0.02;

/// The last part of such a stretch, in which the speed must have become steady.
const LATE: f64 = 0.1;

/// Share of its largest speed up to which a rotor that turns by itself counts as resting.
const RESTING: f64 = 1e-6;

/// The change of a steady speed that is allowed, relative to itself.
const STEADY: f64 = 0.01;

/// The share of that by which it may be off.
const NEGLIGIBLE: f64 = 1e-7;

/// The key figures of one run. SI units; r is the pulleys' pitch radius, φ₁ the drive pulley's angle, x the cart's
/// position.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Metrics {
    /// When the run ended, s.
    pub end: f64,
    /// φ₁ at the end, rad.
    pub final_drive_angle: f64,
    /// r φ₁ at the end, m: where an encoder at the drive pulley says the cart is.
    pub final_drive_travel: f64,
    /// x at the end, m: where the cart is.
    pub final_cart_position: f64,
    /// ẋ at the end, m/s.
    pub final_cart_speed: f64,
    /// φ̇_r at the end, rad/s: the rotor's speed seen from behind the gear, φ̇₁ where the gear is stiff.
    pub final_rotor_speed: f64,
    /// ẋ of largest magnitude, m/s.
    pub peak_cart_speed: Peak,
    /// r φ̇₁ of largest magnitude, m/s.
    pub peak_drive_speed: Peak,
    /// The speed that the cart settles at under constant input; none if no input but zero lasts a fiftieth of the run,
    /// or the run ended before that input did.
    pub steady_speed: Option<SteadySpeed>,
    /// Stretch of spans 1, 2, 3 of largest magnitude, m: r φ₁ − x, x − r φ₃, r φ₃ − r φ₁; negative where the span is
    /// shorter than at rest (an axis whose belt is tensioned by more than that is meant).
    pub peak_stretch: [Peak; 3],
    /// Force in spans 1, 2, 3 of largest magnitude, N, damping included.
    pub peak_force: [Peak; 3],
    /// Motor current of largest magnitude, A.
    pub peak_current: Peak,
    /// r φ₁ − x of largest magnitude, m: by how much an encoder at the drive pulley misses the cart.
    /// The same length as the stretch of span 1, seen as an error of measurement.
    pub peak_encoder_error: Peak,
    /// When everything came to rest, s, if it has: the time of the last event of a body, or when a rotor that turns by
    /// itself was last faster than a millionth of its largest speed, whichever is later; 0 if nothing ever moved. None
    /// while anything moves, where a body has no dry friction to stick by, and for a solver that locates no events
    /// (`table3` freezes speeds and creeps on).
    pub stop_time: Option<f64>,
    /// Whether everything is at rest at the end: bodies and rotor.
    pub settled: bool,
    /// Whether all three bodies are stuck at the end, at a speed of exactly zero.
    pub bodies_rest: bool,
    /// Whether the rotor is at rest at the end: that of a gear with play turns no faster than a millionth of its
    /// largest speed. True for a stiff gear, whose rotor is part of the drive pulley.
    pub rotor_rests: bool,
    /// Events of drive pulley, cart, idler pulley.
    pub events: [EventCount; 3],
}

/// The value of largest magnitude, with its sign, and when that was.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Peak {
    /// The value, in the unit of what was looked at.
    pub value: f64,
    /// When, s.
    pub time: f64,
}

/// The cart's speed at the end of the last stretch of time on which the input was constant and not zero, and that
/// lasted at least a fiftieth of the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadySpeed {
    /// Its speed at the end of that stretch, m/s.
    pub value: f64,
    /// The difference of largest and least speed within the last tenth of that stretch, m/s.
    pub change: f64,
    /// Whether that change is at most 1 % of the speed; if not, there was no time to become steady.
    pub reached: bool,
    /// The speed at which all forces balance under that input, with everything sliding its way: [`balanced_speed`].
    pub analytic: Balance,
    /// The input, V or A.
    pub input: f64,
    /// Where that stretch begins and ends, s.
    pub stretch: (f64, f64),
}

/// How often a body changed what it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EventCount {
    /// It came to rest.
    pub stops: u64,
    /// It started to slide.
    pub starts: u64,
    /// It turned back without a rest.
    pub reversals: u64,
}

impl EventCount {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.stops + self.starts + self.reversals
    }

    /// Counts an event of the body.
    fn add(&mut self, event: &Event) {
        if event.to == Motion::Stuck {
            self.stops += 1;
        } else if event.from == Motion::Stuck {
            self.starts += 1;
        } else {
            self.reversals += 1;
        }
    }
}

impl Peak {
    /// Takes a value that is larger, and its time where it is larger by more than [`NEWS`].
    fn take(&mut self, value: f64, time: f64) {
        let (new, old) = (value.abs(), self.value.abs());
        if new > old {
            *self = Peak { value, time: if new > old * (1.0 + NEWS) { time } else { self.time } };
        }
    }

    /// Takes the value that something has come to: of values that are the same to [`NEWS`], the last one counts. On the
    /// way to a steady value only rounding tells where it is largest, and it is largest at its end.
    fn come_to(&mut self, value: f64, time: f64) {
        let (new, old) = (value.abs(), self.value.abs());
        if new > old * (1.0 + NEWS) {
            *self = Peak { value, time };
        } else if new > 0.0 && new >= old * (1.0 - NEWS) {
            *self = Peak { value: if new > old { value } else { self.value }, time: self.time.max(time) };
        }
    }

    /// Takes the values at both ends of an interval; `holds` says that a limit holds the value on all of it.
    fn pass(&mut self, [from, to]: [f64; 2], (begin, end): (f64, f64), holds: bool) {
        self.take(from, begin);
        if !holds {
            self.come_to(to, end);
        }
    }
}

/// Quantities of a reading that peaks are sought of: the first ones.
const PEAKS: usize = reading::CURRENT + 1;

/// A bound that passes a peak by no more than this share of it is no reason to look closer, and values that differ by no
/// more are one. The peak itself is the top of a polynomial that is good to 1e-9 of the largest value, the share that
/// peaks are stated to; its time is off by the square root of that, as a share of the time in which the quantity bends.
const NEWS: f64 = 1e-12;

/// A figure, or some of them, that a [`Meter`] has to follow the motion for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sought {
    /// The peak of a quantity, by its place in a [`reading`].
    Peak(usize),
    /// The steady speed.
    SteadySpeed,
    /// When everything came to rest.
    StopTime,
}

/// Gathers [`Metrics`] from a run that it observes.
#[derive(Debug, Clone)]
pub struct Meter {
    machine: Machine,
    /// The peaks that are sought, and whether the motion has to be followed at all.
    sought: [bool; PEAKS],
    follows: bool,
    /// The body that the motor's shaft turns with.
    shaft: usize,
    peaks: [Peak; PEAKS],
    seen: Metrics,
    plateau: Option<Plateau>,
    /// Whether any body slid or was free.
    moved: bool,
    /// The rotor, where it is an inertia of its own.
    rotor: Option<Rotor>,
}

impl Meter {
    /// A meter for a run of `experiment` on `stage`.
    pub fn new(machine: &Machine, experiment: &Experiment) -> Self {
        Self::with(machine, Held::last(experiment))
    }

    /// The same where the last stretch of constant input is known.
    pub fn with(machine: &Machine, held: Option<Held>) -> Self {
        Self {
            machine: machine.clone(),
            sought: [true; PEAKS],
            follows: true,
            shaft: if machine.drives[0].motor.gear_play.is_some() { ROTOR } else { DRIVE },
            peaks: [Peak::default(); PEAKS],
            seen: Metrics::default(),
            plateau: held.map(Plateau::new),
            moved: false,
            rotor: machine.drives[0].motor.gear_play.map(|_| Rotor::new(reading::ROTOR_SPEED)),
        }
    }

    /// The same for these figures, and for what is known at the end: peaks and speeds that are not among them stay as
    /// they are where nothing has moved, and cost nothing.
    pub fn seeking(mut self, sought: &[Sought]) -> Self {
        self.sought = std::array::from_fn(|q| sought.contains(&Sought::Peak(q)));
        if !sought.contains(&Sought::SteadySpeed) {
            self.plateau = None;
        }
        self.follows = !sought.is_empty() || self.rotor.is_some();
        self
    }

    /// The magnitudes above which there is a peak of each quantity.
    #[inline]
    fn heights(&self) -> Reading {
        let mut heights = [f64::INFINITY; QUANTITIES];
        for ((height, peak), sought) in heights.iter_mut().zip(&self.peaks).zip(self.sought) {
            *height = if sought { peak.value.abs() } else { f64::INFINITY };
        }
        heights
    }

    /// The metrics of the run that was observed and whose events these are.
    pub fn finish(self, events: &[Event]) -> Metrics {
        let mut metrics = self.seen;
        let peak = |q: usize| self.peaks[q];
        metrics.peak_cart_speed = peak(reading::CART_SPEED);
        metrics.peak_drive_speed = peak(reading::DRIVE_SPEED);
        metrics.peak_stretch = std::array::from_fn(|span| peak(reading::STRETCH + span));
        metrics.peak_force = std::array::from_fn(|span| peak(reading::FORCE + span));
        metrics.peak_current = peak(reading::CURRENT);
        metrics.peak_encoder_error = metrics.peak_stretch[0];
        metrics.steady_speed = self.plateau.and_then(|plateau| plateau.steady_speed(&self.machine));
        for event in events {
            if let Some(body) = event.body() {
                metrics.events[body].add(event);
            }
        }
        metrics.rotor_rests = self.rotor.is_none_or(|rotor| rotor.rests);
        let bodies = match events.iter().rfind(|event| event.body().is_some()) {
            Some(last) => Some(last.time),
            None => Some(0.0).filter(|_| !self.moved),
        };
        let rotor = self.rotor.map_or(0.0, |rotor| rotor.turned);
        metrics.settled = metrics.bodies_rest && metrics.rotor_rests;
        metrics.stop_time = bodies.map(|time| time.max(rotor)).filter(|_| metrics.settled);
        metrics
    }
}

impl Observe for Meter {
    fn stretch(&mut self, stretch: &Stretch) -> Closer {
        // When a rotor was last fast depends on how fast it had been by then.
        if self.rotor.is_some() {
            return Closer::Now;
        }
        self.moved |= stretch.interval > 0.0 && slides(stretch.mode);
        for (q, peak) in self.peaks.iter_mut().enumerate().filter(|(q, _)| self.sought[*q]) {
            if stretch.most[q] > peak.value.abs() * (1.0 - NEWS) {
                let (value, time) = stretch.largest(q, NEWS);
                // What it begins with is what the last one ended with.
                if time > stretch.begin { peak.come_to(value, time) } else { peak.take(value, time) }
            }
        }
        Closer::Later(match &self.plateau {
            Some(plateau) if plateau.meets(stretch) => Gaps::first(stretch.readings.len() - 1),
            _ => stretch.rising_above(&self.heights(), 1.0 + NEWS),
        })
    }

    fn pass(&mut self, gap: &Gap) -> bool {
        let end = gap.begin + gap.length;
        let (news, mut closer) = gap.rises_above(&self.heights(), [1.0 - NEWS, 1.0 + NEWS]);
        if news {
            for (q, peak) in self.peaks.iter_mut().enumerate().filter(|(q, _)| self.sought[*q]) {
                peak.pass([gap.from[q], gap.to[q]], (gap.begin, end), gap.holds(q));
            }
            // What its ends have told is no reason to look between them, where a bound says what is there.
            closer = gap.rises_above(&self.heights(), [1.0, 1.0 + NEWS]).1;
        }
        if let Some(plateau) = &mut self.plateau {
            closer |= plateau.pass(gap);
        }
        if let Some(rotor) = &mut self.rotor {
            closer |= rotor.pass(gap);
        }
        self.moved |= gap.length > 0.0 && slides(gap.mode);
        closer && gap.length > 0.0
    }

    fn see(&mut self, curve: &Curve) {
        let (lows, highs) = curve.ranges();
        for (q, peak) in self.peaks.iter_mut().enumerate().filter(|(q, _)| self.sought[*q]) {
            if highs[q] > peak.value.abs() {
                let (s, value) = curve.of(q).greatest(0.0, 1.0);
                peak.take(value, curve.begin + s * curve.length);
            }
            if -lows[q] > peak.value.abs() {
                let (s, value) = curve.of(q).negative().greatest(0.0, 1.0);
                peak.take(-value, curve.begin + s * curve.length);
            }
        }
        if let Some(plateau) = &mut self.plateau {
            plateau.see(curve);
        }
        if let Some(rotor) = &mut self.rotor {
            rotor.see(curve);
        }
    }

    fn follows(&self) -> bool {
        self.follows
    }

    fn end(&mut self, time: f64, state: &State, mode: &Mode) {
        let seen = &mut self.seen;
        seen.end = time;
        seen.final_drive_angle = state.position[DRIVE];
        seen.final_drive_travel = self.machine.pulley_radius * state.position[DRIVE];
        seen.final_cart_position = state.position[CART];
        seen.final_cart_speed = state.speed[CART];
        seen.final_rotor_speed = state.speed[self.shaft];
        seen.bodies_rest = mode.motion[..BODIES] == [Motion::Stuck; BODIES] && state.speed[..BODIES] == [0.0; BODIES];
        if let Some(rotor) = &mut self.rotor {
            rotor.end(state.speed[self.shaft]);
        }
    }
}

/// Whether any body slides or is free.
fn slides(mode: &Mode) -> bool {
    mode.motion[..BODIES].iter().any(|motion| *motion != Motion::Stuck)
}

/// A rotor that is an inertia of its own: nothing holds it, so it comes to rest as what swings does, by and by.
#[derive(Debug, Clone, Copy)]
struct Rotor {
    /// Its speed's number among the readings.
    reading: usize,
    /// Its largest speed so far, rad/s.
    fastest: f64,
    /// When it last turned faster than a share [`RESTING`] of that, s.
    turned: f64,
    rests: bool,
}

impl Rotor {
    fn new(reading: usize) -> Self {
        Self { reading, fastest: 0.0, turned: 0.0, rests: false }
    }

    fn end(&mut self, speed: f64) {
        self.rests = speed.abs() <= RESTING * self.fastest;
    }

    fn pass(&mut self, gap: &Gap) -> bool {
        let (q, end) = (self.reading, gap.begin + gap.length);
        let (from, to) = (gap.from[q].abs(), gap.to[q].abs());
        self.fastest = self.fastest.max(from).max(to);
        let slow = RESTING * self.fastest;
        if to > slow {
            self.turned = self.turned.max(end);
        } else if from > slow {
            self.turned = self.turned.max(gap.begin);
        }
        let bound = gap.bound(q);
        bound > self.fastest * (1.0 + NEWS) || (to <= slow && bound > slow)
    }

    fn see(&mut self, curve: &Curve) {
        let speed = curve.of(self.reading);
        self.fastest = self.fastest.max(speed.largest(0.0, 1.0).1.abs());
        let slow = RESTING * self.fastest;
        let shifted = |by: f64| {
            let mut shifted = speed;
            shifted.0[0] += by;
            shifted.zeros(0.0, 1.0).last().copied()
        };
        if let Some(s) = shifted(slow).into_iter().chain(shifted(-slow)).reduce(f64::max) {
            self.turned = self.turned.max(curve.begin + s * curve.length);
        }
    }
}

/// A stretch of time on which the input is constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    input: f64,
    begin: f64,
    end: f64,
}

impl Held {
    /// The last one of an experiment that is not zero and no shorter than a fiftieth of the run.
    pub fn last(experiment: &Experiment) -> Option<Self> {
        let until = experiment.until;
        let long = |held: &Held| held.input != 0.0 && held.end - held.begin >= SHORTEST * until * (1.0 - 1e-9);
        let (mut last, mut held, mut time) = (None, Held { input: 0.0, begin: 0.0, end: 0.0 }, 0.0);
        while time < until {
            let piece = experiment.inputs[0].piece(time);
            let input = if piece.degree() == 0 { piece.coefficients[0] } else { 0.0 };
            if input.to_bits() != held.input.to_bits() {
                last = Some(held).filter(long).or(last);
                held = Held { input, begin: time, end: time };
            }
            time = piece.end.min(until);
            held.end = time;
        }
        Some(held).filter(long).or(last)
    }
}

/// The cart's speed at the end of a stretch of constant input.
#[derive(Debug, Clone)]
struct Plateau {
    held: Held,
    /// Where its last part begins.
    late: f64,
    /// Times as near as this are one.
    near: f64,
    /// The least and greatest speed there.
    range: (f64, f64),
    /// The speed at its end, where that was reached.
    last: Option<f64>,
}

impl Plateau {
    fn new(held: Held) -> Self {
        Self {
            held,
            late: held.end - LATE * (held.end - held.begin),
            near: 16.0 * f64::EPSILON * held.end,
            range: (f64::INFINITY, f64::NEG_INFINITY),
            last: None,
        }
    }

    fn take(&mut self, speed: f64) {
        self.range = (self.range.0.min(speed), self.range.1.max(speed));
    }

    /// Whether a stretch may tell of it.
    fn meets(&self, stretch: &Stretch) -> bool {
        stretch.end() >= self.late - self.near && stretch.begin <= self.held.end + self.near
    }

    fn pass(&mut self, gap: &Gap) -> bool {
        let (begin, end) = (gap.begin, gap.begin + gap.length);
        if end < self.late - self.near || end > self.held.end + self.near {
            return false;
        }
        let (from, to) = (gap.from[reading::CART_SPEED], gap.to[reading::CART_SPEED]);
        self.take(to);
        if begin >= self.late - self.near {
            self.take(from);
        }
        if end >= self.held.end - self.near {
            self.last = Some(to);
        }
        let (low, high) = gap.range(reading::CART_SPEED);
        let news = STEADY * NEGLIGIBLE * low.abs().max(high.abs());
        begin < self.late - self.near || low < self.range.0 - news || high > self.range.1 + news
    }

    fn see(&mut self, curve: &Curve) {
        let end = curve.begin + curve.length;
        if end < self.late || end > self.held.end + self.near {
            return;
        }
        let speed = curve.of(reading::CART_SPEED);
        let from = ((self.late - curve.begin) / curve.length).clamp(0.0, 1.0);
        self.take(speed.greatest(from, 1.0).1);
        self.take(-speed.negative().greatest(from, 1.0).1);
    }

    fn steady_speed(&self, machine: &Machine) -> Option<SteadySpeed> {
        let (value, change) = (self.last?, self.range.1 - self.range.0);
        Some(SteadySpeed {
            value,
            change,
            reached: change <= STEADY * value.abs(),
            analytic: balanced_speed(machine, self.held.input, value),
            input: self.held.input,
            stretch: (self.held.begin, self.held.end),
        })
    }
}

/// At which speed of the cart all forces balance under a constant input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Balance {
    /// At this one, m/s; zero where that input cannot keep the axis sliding.
    At(f64),
    /// At none: nothing limits the speed (a commanded current, and no viscous friction).
    Never,
    /// At no single one: friction, the belt or a force changes along the travel, or a force with the speed.
    Changing,
}

impl Balance {
    /// The speed, if there is one.
    pub fn speed(self) -> Option<f64> {
        match self {
            Balance::At(speed) => Some(speed),
            Balance::Never | Balance::Changing => None,
        }
    }
}

/// The cart's speed at which a constant `input` (V or A) just makes up for all losses; the belt's stretch is constant
/// then.
///
/// Everything slides in the direction of the input, by its friction law, and limits of voltage and current hold. Where
/// a law's curve lets the forces balance at several speeds, it is the one that the axis comes to from `near`, m/s.
pub fn balanced_speed(machine: &Machine, input: f64, near: f64) -> Balance {
    if machine.changes_along_travel() || machine.cart.forces.by_speed.is_some() {
        return Balance::Changing;
    }
    let (motor, amplifier) = (&machine.drives[0].motor, &machine.drives[0].amplifier);
    let (r, n, eta) = (machine.pulley_radius, motor.gear_ratio, motor.gear_efficiency);
    let output = amplifier.gain * input;
    let forward = output >= 0.0;
    let direction = if forward { 1.0 } else { -1.0 };

    // What drives, as lines τ = a − s φ̇ of which the least counts: the command, and the limit on the other quantity.
    let least = |a: f64, b: Option<f64>| b.map_or(a, |b| a.min(b));
    // τ_M = η n K_t i
    let at_current = |current: f64| (eta * n * motor.torque_constant * current, 0.0);
    // τ_M = η n K_t (V_in − K_e n φ̇) / R                                          (4) with a gear
    let at_voltage = |voltage: f64| {
        let per_volt = eta * n * motor.torque_constant / motor.resistance;
        (per_volt * voltage, per_volt * motor.back_emf_constant * n)
    };
    let (command, bound) = match amplifier.mode {
        AmplifierMode::Current => {
            (at_current(least(output.abs(), amplifier.current_limit)), amplifier.voltage_limit.map(at_voltage))
        }
        AmplifierMode::Voltage => {
            (at_voltage(least(output.abs(), amplifier.voltage_limit)), amplifier.current_limit.map(at_current))
        }
    };

    // Sum of (16), r (17) and (18) without accelerations, with v = ẋ = r φ̇₁ = r φ̇₃ and the constant force F on the
    // cart:
    //   excess(v) = τ_M + r F − τ_f1 − τ_f2 − r F_f
    let bodies = [(machine.drive_pulley.friction, r), (machine.cart.friction, 1.0), (machine.idler_pulley.friction, r)];
    let load = direction * r * machine.cart.constant_force();
    let viscous: f64 = bodies.iter().map(|(law, radius)| r / radius * (r / radius) * law.side(forward).viscous).sum();
    let dry = |v: f64| bodies.iter().map(|(law, radius)| r / radius * law.dry(forward, v / radius)).sum::<f64>();
    let excess = |v: f64| {
        let drive = [Some(command), bound].into_iter().flatten().map(|(a, s)| a - s * v / r);
        drive.fold(f64::INFINITY, f64::min) + load - viscous * v / r - dry(v)
    };

    // Without dry friction it would go this fast, and with it no faster.
    let fastest = |(a, s): (f64, f64)| if s + viscous > 0.0 { r * (a + load) / (s + viscous) } else { f64::INFINITY };
    let fastest = bound.map_or(f64::INFINITY, fastest).min(fastest(command));
    let scales: Vec<f64> = bodies.iter().filter_map(|(law, radius)| law.law.velocity().map(|v| radius * v)).collect();
    let slowest = scales.iter().copied().fold(f64::INFINITY, f64::min) / SLOWER;
    let past = scales.iter().copied().fold(0.0, f64::max) * FASTER;
    let top = if fastest.is_finite() { 2.0 * fastest.max(0.0) } else { past.max(direction * near) };

    // Between neighbours of these speeds the excess changes its sign no more than once.
    let curve = std::iter::successors(Some(slowest), |v| Some(v * FINER)).take_while(|v| *v < past.min(top));
    let near = (direction * near).clamp(0.0, top);
    let mut speeds: Vec<f64> = curve.chain([0.0, near, top]).collect();
    speeds.sort_by(f64::total_cmp);
    let from = speeds.partition_point(|v| *v < near);
    let drives = |v: &f64| excess(*v) > 0.0;
    let (mut low, mut high) = if drives(&near) {
        let Some(beyond) = speeds[from..].iter().position(|v| !drives(v)) else { return Balance::Never };
        (speeds[from + beyond - 1], speeds[from + beyond])
    } else {
        let Some(below) = speeds[..from].iter().rposition(drives) else { return Balance::At(0.0) };
        (speeds[below], speeds[below + 1])
    };
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return Balance::At(direction * middle);
        }
        if drives(&middle) { low = middle } else { high = middle }
    }
}

/// Speeds at which a friction curve is looked at: from this share of its own speed, to this many times it, each so many
/// times the last.
const SLOWER: f64 = 1e4;
const FASTER: f64 = 50.0;
const FINER: f64 = 1.05;

/// The largest of the spans' peaks, with the number (from 1 on) of its span.
pub fn largest(peaks: &[Peak]) -> (usize, Peak) {
    let mut largest = (1, peaks.first().copied().unwrap_or_default());
    for (number, peak) in (1..).zip(peaks.iter().copied()) {
        if peak.value.abs() > largest.1.value.abs() {
            largest = (number, peak);
        }
    }
    largest
}
