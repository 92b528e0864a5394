//! The steady speed of a machine with one drive: at the end of a constant input, and by the balance of forces.

use crate::machine::Machine;
use crate::mechanism::AmplifierMode;
use crate::plan::Experiment;
use crate::solve::Stretch;

/// Shortest interval of constant input with a steady speed, as a fraction of the run.
const SHORTEST: f64 = 0.02;

/// Last fraction of such an interval, in which the speed must be steady.
const LATE: f64 = 0.1;

/// Allowed relative change of a steady speed.
const STEADY: f64 = 0.01;

/// Relative error of that change.
const NEGLIGIBLE: f64 = 1e-7;

/// Cart speed at the end of the last interval of at least a fiftieth of the run with a constant input other than zero.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SteadySpeed {
    /// Speed at the end of that interval, m/s.
    pub value: f64,
    /// Range of the speed within the last tenth of that interval, m/s.
    pub change: f64,
    /// True if that change is at most 1 % of the speed; otherwise the interval was too short.
    pub reached: bool,
    /// Speed of steady sliding under that input, [`balanced_speed`].
    pub analytic: Balance,
    /// The input, V or A.
    pub input: f64,
    /// Begin and end of the interval of steady speed, s.
    pub stretch: (f64, f64),
}

/// An interval of constant input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    input: f64,
    begin: f64,
    end: f64,
}

impl Held {
    /// The last interval of an experiment with a non-zero input and at least a fiftieth of the run.
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

/// Cart speed at the end of an interval of constant input.
#[derive(Debug, Clone)]
pub(super) struct Plateau {
    held: Held,
    /// Start of its last fraction.
    late: f64,
    /// Times closer than this are equal.
    near: f64,
    /// Least and largest speed there.
    range: (f64, f64),
    /// Speed at its end, if reached.
    last: Option<f64>,
}

impl Plateau {
    pub fn new(held: Held) -> Self {
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

    /// True if an interval is long enough for a steady speed.
    pub fn meets(&self, stretch: &Stretch) -> bool {
        stretch.end() >= self.late - self.near && stretch.begin <= self.held.end + self.near
    }

    /// Where it is watched, s.
    pub fn watched(&self) -> (f64, f64) {
        (self.late - self.near, self.held.end + self.near)
    }

    /// Takes an interval: its ends, the speeds there, and bounds of those between; says whether it wants to see closer.
    pub fn pass(&mut self, (begin, end): (f64, f64), [from, to]: [f64; 2], (low, high): (f64, f64)) -> bool {
        if end < self.late - self.near || end > self.held.end + self.near {
            return false;
        }
        self.take(to);
        if begin >= self.late - self.near {
            self.take(from);
        }
        if end >= self.held.end - self.near {
            self.last = Some(to);
        }
        let news = STEADY * NEGLIGIBLE * low.abs().max(high.abs());
        begin < self.late - self.near || low < self.range.0 - news || high > self.range.1 + news
    }

    /// Takes the course of the speed in an interval: the least and the greatest one from a fraction of it on.
    pub fn see(&mut self, (begin, end): (f64, f64), range: &dyn Fn(f64) -> (f64, f64)) {
        if end < self.late || end > self.held.end + self.near {
            return;
        }
        let (least, greatest) = range(((self.late - begin) / (end - begin)).clamp(0.0, 1.0));
        self.take(greatest);
        self.take(least);
    }

    pub fn steady_speed(&self, machine: &Machine) -> Option<SteadySpeed> {
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

/// Cart speed at which all forces balance under a constant input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Balance {
    /// This speed, m/s; zero if the input cannot keep the axis sliding.
    At(f64),
    /// No speed: nothing limits it (commanded current without viscous friction).
    Never,
    /// No single speed: friction, belt or a force changes along the travel, or a force with speed.
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

/// Cart speed at which a constant `input` (V or A) balances all losses, with constant elongation of the belt.
///
/// Everything slides in the direction of the input, by its friction law, and limits of voltage and current hold. If a
/// friction curve allows several such speeds, it is the one that the axis reaches from `near`, m/s.
pub fn balanced_speed(machine: &Machine, input: f64, near: f64) -> Balance {
    let is_stepper = machine.drives[0].motor.stepper.is_some();
    if machine.changes_along_travel() || machine.cart.forces.by_speed.is_some() || is_stepper {
        return Balance::Changing;
    }
    let (motor, amplifier) = (&machine.drives[0].motor, &machine.drives[0].amplifier);
    let (r, n, eta) = (machine.pulley_radius, motor.gear_ratio, motor.gear_efficiency);
    let output = amplifier.gain * input;
    let forward = output >= 0.0;
    let direction = if forward { 1.0 } else { -1.0 };

    // Motor torque as lines τ = a − s φ̇ of which the least counts: the command, and the limit of the other quantity.
    let least = |a: f64, b: Option<f64>| b.map_or(a, |b| a.min(b));
    // τ_M = η n K_t i
    let at_current = |current: f64| (eta * n * motor.torque_constant * current, 0.0);
    // τ_M = η n K_t (V_in − K_e n φ̇) / R                                          (4) with a gear
    let at_voltage = |voltage: f64| {
        let per_volt = eta * n * motor.torque_constant / motor.resistance;
        (per_volt * voltage, per_volt * motor.back_emf_constant * n)
    };
    let (command, bound) = match amplifier.mode {
        AmplifierMode::Current | AmplifierMode::Position => {
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

    // Upper bound: the speed without dry friction.
    let fastest = |(a, s): (f64, f64)| if s + viscous > 0.0 { r * (a + load) / (s + viscous) } else { f64::INFINITY };
    let fastest = bound.map_or(f64::INFINITY, fastest).min(fastest(command));
    let scales: Vec<f64> = bodies.iter().filter_map(|(law, radius)| law.law.velocity().map(|v| radius * v)).collect();
    let slowest = scales.iter().copied().fold(f64::INFINITY, f64::min) / SLOWER;
    let past = scales.iter().copied().fold(0.0, f64::max) * FASTER;
    let top = if fastest.is_finite() { 2.0 * fastest.max(0.0) } else { past.max(direction * near) };

    // Between adjacent speeds the excess changes its sign at most once.
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

/// Speeds at which a friction curve is evaluated: from this fraction to this multiple of its own speed, in this ratio.
const SLOWER: f64 = 1e4;
const FASTER: f64 = 50.0;
const FINER: f64 = 1.05;
