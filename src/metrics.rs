//! What a run shows: where it ended, how fast it went, what it put on belt and motor, when it stopped, and how far the
//! encoder's pulley and the cart were apart.
//!
//! A [`Meter`] is fed with blocks of rows and keeps no row, so that a run of any length needs the same memory.
//! What it reports are values at rows: a peak between two rows is not seen, so the output interval should resolve it.
//! Events, which the exact solver locates by themselves, are exact.

use crate::friction::Motion;
use crate::solve::Event;
use crate::stage::{AmplifierMode, Stage};
use crate::trajectory::Trajectory;

/// Rows that a stretch of constant input needs before its last tenth says something.
const SHORTEST_STRETCH: u64 = 20;

/// What a steady speed may still change by, relative to itself.
const STEADY: f64 = 0.01;

/// The key figures of one run. SI units; r is the pulleys' pitch radius, φ₁ the drive pulley's angle, x the cart's position.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Metrics {
    /// Rows seen.
    pub rows: u64,
    /// Time of the last row, s.
    pub end: f64,
    /// φ₁ in the last row, rad.
    pub final_drive_angle: f64,
    /// r φ₁ in the last row, m: where an encoder at the drive pulley says the cart is.
    pub final_drive_travel: f64,
    /// x in the last row, m: where the cart is.
    pub final_cart_position: f64,
    /// ẋ in the last row, m/s.
    pub final_cart_speed: f64,
    /// ẋ of largest magnitude, m/s.
    pub peak_cart_speed: Peak,
    /// r φ̇₁ of largest magnitude, m/s.
    pub peak_drive_speed: Peak,
    /// What the cart's speed settles at under constant input; none if no input but zero stays for 20 rows.
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
    /// When the last body came to rest, s, if all three are stuck in the last row: the time of the last event; 0 if
    /// nothing ever moved. None while anything moves, where a body has no dry friction to stick by, and for a
    /// solver that locates no events (`table3` freezes speeds and creeps on).
    pub stop_time: Option<f64>,
    /// Whether all three bodies are stuck, at a speed of exactly zero, in the last row.
    pub settled: bool,
    /// Events of drive pulley, cart, idler pulley.
    pub events: [EventCount; 3],
}

/// The value of largest magnitude, with its sign, and the first time it was seen.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Peak {
    /// The value, in the unit of what was looked at.
    pub value: f64,
    /// When, s.
    pub time: f64,
}

/// The cart's speed at the end of the last stretch of time on which the input was constant and not zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadySpeed {
    /// Its speed in the last row of that stretch, m/s.
    pub value: f64,
    /// The difference of largest and least speed within the last tenth of that stretch, m/s.
    pub change: f64,
    /// Whether that change is at most 1 % of the speed; if not, there was no time to become steady.
    pub reached: bool,
    /// The speed at which all forces balance under that input, with everything sliding its way: [`balanced_speed`].
    pub analytic: Balance,
    /// The input, V or A.
    pub input: f64,
    /// Times of the first and last row of that stretch, s.
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
}

impl Peak {
    /// Looks at the next values.
    fn see(&mut self, times: &[f64], values: impl Iterator<Item = f64> + Clone) {
        // First how large any gets, which is quick; only if that is news, which one it was.
        let larger = |most: f64, value: f64| if value.abs() > most { value.abs() } else { most };
        let most = values.clone().fold(0.0, larger);
        if most > self.value.abs()
            && let Some((&time, value)) = times.iter().zip(values).find(|(_, value)| value.abs() == most)
        {
            *self = Peak { value, time };
        }
    }
}

/// Gathers [`Metrics`] from blocks of rows.
#[derive(Debug, Clone)]
pub struct Meter {
    stage: Stage,
    seen: Metrics,
    plateau: Plateau,
    /// The last plateau that was long enough, with its input.
    steady: Option<Plateau>,
    /// Whether everything was stuck in every row so far.
    never_moved: bool,
}

impl Meter {
    /// A meter for runs of `stage`.
    pub fn new(stage: &Stage) -> Self {
        Self {
            stage: stage.clone(),
            seen: Metrics::default(),
            plateau: Plateau::new(0.0),
            steady: None,
            never_moved: true,
        }
    }

    /// Takes the next rows; columns that are missing count as zero.
    pub fn take(&mut self, block: &Trajectory) {
        let Some(last) = block.len().checked_sub(1) else { return };
        let column = |name: &str| block.get(name).unwrap_or(&[]);
        let r = self.stage.pulley_radius;
        let time = column("time");
        let [drive, cart, idler] = ["drive_angle", "cart_position", "idler_angle"].map(column);
        let [drive_speed, cart_speed, idler_speed] = ["drive_speed", "cart_speed", "idler_speed"].map(column);
        let input = block.get("input").unwrap_or(column("voltage"));
        let states = ["drive_state", "cart_state", "idler_state"].map(column);

        let seen = &mut self.seen;
        seen.peak_cart_speed.see(time, cart_speed.iter().copied());
        seen.peak_drive_speed.see(time, drive_speed.iter().map(|w| r * w));
        seen.peak_stretch[0].see(time, drive.iter().zip(cart).map(|(p1, x)| r * p1 - x));
        seen.peak_stretch[1].see(time, cart.iter().zip(idler).map(|(x, p3)| x - r * p3));
        seen.peak_stretch[2].see(time, idler.iter().zip(drive).map(|(p3, p1)| r * p3 - r * p1));
        seen.peak_encoder_error = seen.peak_stretch[0];
        for (peak, name) in seen.peak_force.iter_mut().zip(["span1_force", "span2_force", "span3_force"]) {
            peak.see(time, column(name).iter().copied());
        }
        seen.peak_current.see(time, column("motor_current").iter().copied());

        let stuck = |row: usize| states.iter().all(|state| state.get(row) == Some(&f64::from(Motion::Stuck.code())));
        self.never_moved = self.never_moved && (0..=last).all(stuck);
        let at = |values: &[f64]| values.get(last).copied().unwrap_or(0.0);
        seen.rows += block.len() as u64;
        seen.end = at(time);
        seen.final_drive_angle = at(drive);
        seen.final_drive_travel = r * at(drive);
        seen.final_cart_position = at(cart);
        seen.final_cart_speed = at(cart_speed);
        seen.settled = stuck(last) && [drive_speed, cart_speed, idler_speed].iter().all(|speed| at(speed) == 0.0);

        let mut row = 0;
        for alike in input.chunk_by(|a, b| a.to_bits() == b.to_bits()) {
            if alike[0].to_bits() != self.plateau.input.to_bits() {
                self.close_plateau(alike[0]);
            }
            let rows = row..row + alike.len();
            // Of a stretch without input nothing is asked.
            if alike[0] != 0.0 {
                for (&time, &speed) in time.iter().zip(cart_speed).take(rows.end).skip(rows.start) {
                    self.plateau.add(time, speed);
                }
            }
            row = rows.end;
        }
    }

    fn close_plateau(&mut self, next_input: f64) {
        let done = std::mem::replace(&mut self.plateau, Plateau::new(next_input));
        if done.input != 0.0 && done.rows >= SHORTEST_STRETCH {
            self.steady = Some(done);
        }
    }

    /// The metrics of the run whose rows were taken and whose events these are.
    pub fn finish(mut self, events: &[Event]) -> Metrics {
        self.close_plateau(0.0);
        let mut metrics = self.seen;
        metrics.steady_speed = self.steady.map(|plateau| plateau.steady_speed(&self.stage));
        for event in events {
            let Some(body) = event.body() else { continue };
            let count = &mut metrics.events[body.index()];
            if event.to == Motion::Stuck {
                count.stops += 1;
            } else if event.from == Motion::Stuck {
                count.starts += 1;
            } else {
                count.reversals += 1;
            }
        }
        metrics.stop_time = match events.iter().rfind(|event| event.body().is_some()) {
            Some(last) => Some(last.time).filter(|_| metrics.settled),
            None => Some(0.0).filter(|_| metrics.settled && self.never_moved),
        };
        metrics
    }
}

/// A stretch of constant input, remembered as least and greatest speeds of up to 1024 parts of equal length.
#[derive(Debug, Clone)]
struct Plateau {
    input: f64,
    rows: u64,
    begin: f64,
    end: f64,
    last: f64,
    /// Rows in each part; doubles whenever there are too many parts.
    width: u64,
    /// Rows that the last part still takes.
    room: u64,
    parts: Vec<Part>,
}

/// Least and greatest speed from one row to another.
#[derive(Debug, Clone, Copy)]
struct Part {
    end: f64,
    least: f64,
    greatest: f64,
}

impl Plateau {
    const PARTS: usize = 1024;

    fn new(input: f64) -> Self {
        Self { input, rows: 0, begin: 0.0, end: 0.0, last: 0.0, width: 1, room: 0, parts: Vec::new() }
    }

    fn add(&mut self, time: f64, speed: f64) {
        if self.rows == 0 {
            self.begin = time;
        }
        if self.room == 0 {
            if self.parts.len() == Self::PARTS {
                let join = |pair: &[Part]| Part {
                    end: pair[1].end,
                    least: pair[0].least.min(pair[1].least),
                    greatest: pair[0].greatest.max(pair[1].greatest),
                };
                self.parts = self.parts.chunks_exact(2).map(join).collect();
                self.width *= 2;
            }
            self.parts.push(Part { end: time, least: speed, greatest: speed });
            self.room = self.width;
        } else if let Some(part) = self.parts.last_mut() {
            *part = Part { end: time, least: part.least.min(speed), greatest: part.greatest.max(speed) };
        }
        self.room -= 1;
        self.rows += 1;
        (self.end, self.last) = (time, speed);
    }

    fn steady_speed(&self, stage: &Stage) -> SteadySpeed {
        // The part in which the last tenth begins counts whole.
        let from = self.end - 0.1 * (self.end - self.begin);
        let late = self.parts.iter().filter(|part| part.end >= from);
        let (least, greatest) = late.fold((self.last, self.last), |(a, b), p| (a.min(p.least), b.max(p.greatest)));
        SteadySpeed {
            value: self.last,
            change: greatest - least,
            reached: greatest - least <= STEADY * self.last.abs(),
            analytic: balanced_speed(stage, self.input, self.last),
            input: self.input,
            stretch: (self.begin, self.end),
        }
    }
}

/// At which speed of the cart all forces balance under a constant input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Balance {
    /// At this one, m/s; zero where that input cannot keep the axis sliding.
    At(f64),
    /// At none: nothing limits the speed (a commanded current, and no viscous friction).
    Never,
    /// At no single one: friction or the belt changes along the travel.
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

/// The cart's speed at which a constant `input` (V or A) just makes up for all losses; the belt's stretch is constant then.
///
/// Everything slides in the direction of the input, by its friction law, and limits of voltage and current hold. Where a law's curve
/// lets the forces balance at several speeds, it is the one that the axis comes to from `near`, m/s.
pub fn balanced_speed(stage: &Stage, input: f64, near: f64) -> Balance {
    if stage.cart.along.is_some() || stage.belt.follows_cart {
        return Balance::Changing;
    }
    let (motor, amplifier) = (&stage.motor, &stage.amplifier);
    let (r, n, eta) = (stage.pulley_radius, motor.gear_ratio, motor.gear_efficiency);
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

    // Sum of (16), r (17) and (18) without accelerations, with v = ẋ = r φ̇₁ = r φ̇₃ and the constant force F on the cart:
    //   excess(v) = τ_M + r F − τ_f1 − τ_f2 − r F_f
    let bodies = [(stage.drive_pulley.friction, r), (stage.cart.friction, 1.0), (stage.idler_pulley.friction, r)];
    let load = direction * r * stage.cart.constant_force();
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

/// Speeds at which a friction curve is looked at: from this share of its own speed, to this many times it, each so many times the last.
const SLOWER: f64 = 1e4;
const FASTER: f64 = 50.0;
const FINER: f64 = 1.05;

/// The three peaks' largest, with the number (1 to 3) of its span.
pub fn largest(peaks: &[Peak; 3]) -> (usize, Peak) {
    let mut largest = (1, peaks[0]);
    for (number, peak) in (1..).zip(*peaks) {
        if peak.value.abs() > largest.1.value.abs() {
            largest = (number, peak);
        }
    }
    largest
}
