//! Random stages over wide ranges, each from a seed and a number, as the text of a case file.

use std::f64::consts::PI;
use std::fmt::Write;

/// Random numbers by SplitMix64 (Steele, Lea, Flood 2014): the same everywhere.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// The sequence of a seed and a number.
    pub fn new(seed: u64, number: u64) -> Self {
        let mut random = Self(seed ^ 0x7461_7574);
        random.0 = random.next() ^ number.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        random.next();
        random
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Evenly between 0 and 1.
    pub fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Evenly between `low` and `high`.
    pub fn even(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    /// Its logarithm evenly between those of `low` and `high`.
    pub fn decades(&mut self, low: f64, high: f64) -> f64 {
        self.even(low.ln(), high.ln()).exp().clamp(low, high)
    }

    /// True so often.
    pub fn chance(&mut self, share: f64) -> bool {
        self.share() < share
    }

    /// One of `0..count`.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.share() * count as f64) as usize).min(count - 1)
    }
}

/// What is counted by itself in the table of a hunt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Inertias and stiffnesses far apart.
    Wide,
    /// Equal pulleys between equal spans.
    Symmetric,
    /// Two-mass or rigid belt.
    Reduced,
    /// The friction of some body holds more at rest.
    Static,
    /// The friction of some body differs by direction.
    Asymmetric,
    /// The armature has an inductance.
    Inductance,
    /// Current mode.
    Current,
    /// A limit of voltage or current.
    Limits,
    /// A gear that loses power.
    Losses,
    /// A gear that gives way.
    Play,
    /// Spans that go slack.
    Slack,
    /// Ends of the travel.
    Travel,
    /// A start beyond 1 m from the origin.
    Far,
}

impl Kind {
    /// All of them.
    pub const ALL: [Kind; 13] = [
        Kind::Wide,
        Kind::Symmetric,
        Kind::Reduced,
        Kind::Static,
        Kind::Asymmetric,
        Kind::Inductance,
        Kind::Current,
        Kind::Limits,
        Kind::Losses,
        Kind::Play,
        Kind::Slack,
        Kind::Travel,
        Kind::Far,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Wide => "inertias and stiffnesses over all decades",
            Kind::Symmetric => "equal pulleys, equal spans 1 and 2",
            Kind::Reduced => "two-mass and rigid belts",
            Kind::Static => "static above Coulomb friction",
            Kind::Asymmetric => "friction that differs by direction",
            Kind::Inductance => "inductance",
            Kind::Current => "current mode",
            Kind::Limits => "limits of voltage and current",
            Kind::Losses => "gear with losses",
            Kind::Play => "gear that gives way, backlash",
            Kind::Slack => "spans that go slack",
            Kind::Travel => "end stops and ends of the travel",
            Kind::Far => "starts 1 m to 1 km from the origin",
        }
    }
}

/// A case.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// The case file.
    pub text: String,
    /// What it has.
    pub kinds: Vec<Kind>,
}

/// The stage of this number.
pub fn stage(seed: u64, number: u64) -> Drawn {
    let mut draw = Draw::new(seed, number);
    let title = format!("seed {seed}, stage {number}");
    let sizes = draw.sizes();
    draw.machine(title, sizes)
}

/// Inertias as masses at the belt, stiffnesses and what follows from them.
struct Sizes {
    radius: f64,
    mass: [f64; 3],
    stiffness: [f64; 3],
    damping: [f64; 3],
    model: &'static str,
    symmetric: bool,
    /// Length of the run, s, before the rest of the machine is known.
    time: f64,
    /// How far things go, m, and what moves them so far, N.
    way: f64,
    force: f64,
}

struct Draw {
    random: Random,
    /// Whether numbers have four digits instead of all.
    short: bool,
    kinds: Vec<Kind>,
    text: String,
    /// Fastest rate so far, 1/s.
    fastest: f64,
}

impl Draw {
    fn new(seed: u64, number: u64) -> Self {
        let mut random = Random::new(seed, number);
        let short = random.chance(0.5);
        Self { random, short, kinds: Vec::new(), text: String::new(), fastest: 0.0 }
    }

    /// As many digits as numbers of this stage have.
    fn digits(&self, value: f64) -> f64 {
        if self.short { format!("{value:.3e}").parse().unwrap_or(value) } else { value }
    }

    fn decades(&mut self, low: f64, high: f64) -> f64 {
        let value = self.random.decades(low, high);
        self.digits(value)
    }

    fn even(&mut self, low: f64, high: f64) -> f64 {
        let value = self.random.even(low, high);
        self.digits(value)
    }

    fn kind(&mut self, kind: Kind) {
        if !self.kinds.contains(&kind) {
            self.kinds.push(kind);
        }
    }

    fn faster(&mut self, rate: f64) {
        self.fastest = self.fastest.max(rate);
    }

    fn table(&mut self, name: &str) {
        let _ = writeln!(self.text, "\n[{name}]");
    }

    fn line(&mut self, key: &str, value: f64) {
        let value = self.digits(value);
        let _ = writeln!(self.text, "{key} = {value:e}");
    }

    fn sizes(&mut self) -> Sizes {
        let wide = self.random.chance(0.5);
        let (mass, stiffness) = match wide {
            true => {
                self.kind(Kind::Wide);
                ([0; 3].map(|_| self.decades(1e-3, 1e3)), [0; 3].map(|_| self.decades(1e2, 1e8)))
            }
            false => {
                let (m, k) = (self.random.decades(1e-2, 1e2), self.random.decades(1e3, 1e7));
                ([0; 3].map(|_| self.decades(0.1 * m, 10.0 * m)), [0; 3].map(|_| self.decades(0.1 * k, 10.0 * k)))
            }
        };
        let (mut mass, mut stiffness) = (mass, stiffness);
        let symmetric = self.random.chance(0.15);
        if symmetric {
            self.kind(Kind::Symmetric);
            (mass[2], stiffness[1]) = (mass[0], stiffness[0]);
        }
        let damped = self.random.chance(0.5);
        let mut damping = [0.0; 3];
        for (damping, k) in damping.iter_mut().zip(stiffness) {
            let ratio = self.random.decades(1e-4, 1.0);
            let lightest = mass.iter().copied().fold(f64::MAX, f64::min);
            if damped && self.random.chance(0.9) {
                *damping = self.digits(2.0 * ratio * (k * lightest).sqrt());
            }
        }
        if symmetric {
            damping[1] = damping[0];
        }
        let model = match self.random.below(8) {
            0 => "two-mass",
            1 => "rigid",
            _ => "elastic",
        };
        if model != "elastic" {
            self.kind(Kind::Reduced);
        }
        let [k1, k2, k3] = stiffness;
        let [c1, c2, c3] = damping;
        for (k, c, m) in [(k1 + k3, c1 + c3, mass[0]), (k1 + k2, c1 + c2, mass[1]), (k2 + k3, c2 + c3, mass[2])] {
            self.faster((2.0 * k / m).sqrt().max(2.0 * c / m));
        }
        if model == "rigid" {
            self.fastest *= self.random.decades(1e-3, 1.0);
        }
        let time = self.random.decades(100.0, 5000.0) / self.fastest;
        let all: f64 = mass.iter().sum();
        let softest = stiffness.iter().copied().fold(f64::MAX, f64::min);
        let way = self.random.decades(1e-6, 0.3);
        // What moves everything so far in that time, as long as it strains no span too far.
        let force = (all * way / (time * time)).min(softest * 0.05);
        Sizes { radius: self.decades(2e-3, 0.3), mass, stiffness, damping, model, symmetric, time, way, force }
    }

    fn machine(mut self, title: String, sizes: Sizes) -> Drawn {
        let _ = writeln!(self.text, "title = \"{title}\"");
        let scale = self.motor(&sizes);
        self.bodies(&sizes);
        self.belt(&sizes);
        let start = self.place();
        self.travel(&sizes, start);
        self.experiment(&sizes, start, &scale);
        self.kinds.sort();
        Drawn { text: self.text, kinds: self.kinds }
    }
}

/// What the motor takes to move the machine, and what it has.
struct Scale {
    /// Volts or amperes at the amplifier's input.
    input: f64,
    /// Amperes of the current at the start, where it is a state.
    current: Option<f64>,
}

impl Draw {
    fn motor(&mut self, sizes: &Sizes) -> Scale {
        let r = sizes.radius;
        let all: f64 = sizes.mass.iter().sum();
        let n = if self.random.chance(0.5) { 1.0 } else { self.decades(0.1, 30.0) };
        let kt = self.decades(1e-3, 1.0);
        let ke = match self.random.below(20) {
            0 => 0.0,
            1 => self.decades(1e-9 * kt, kt),
            2..7 => self.decades(0.3 * kt, 3.0 * kt),
            _ => kt,
        };
        let brake = self.random.decades(1e-3, 30.0) / sizes.time;
        // K_t K_e n²/(R r² m) is how fast the back-EMF brakes everything.
        let resistance = match ke > 1e-3 * kt {
            true => (kt * ke * n * n / (r * r * all * brake)).clamp(1e-6, 1e9),
            false => self.random.decades(0.1, 10.0),
        };
        let resistance = self.digits(resistance);
        let current_mode = self.random.chance(0.25);
        let bandwidth = (current_mode && self.random.chance(0.6)).then(|| self.decades(1.0, 2000.0) / sizes.time);
        let mut inductance = match self.random.chance(0.35) {
            true => resistance * sizes.time / self.random.decades(1.0, 2000.0),
            false => 0.0,
        };
        let [mut voltage_limit, mut current_limit] = [(); 2].map(|()| self.random.chance(0.35));
        if current_mode && voltage_limit && bandwidth.is_some() != (inductance > 0.0) {
            (voltage_limit, inductance) = (bandwidth.is_none(), 0.0);
        }
        if !voltage_limit && !current_limit && self.random.chance(0.1) {
            current_limit = true;
        }
        inductance = self.digits(inductance);
        let amperes = sizes.force * r / (n * kt);
        let volts = amperes * resistance;

        self.table("motor");
        self.line("torque_constant", kt);
        self.line("back_emf_constant", ke);
        self.line("resistance", resistance);
        if inductance > 0.0 {
            self.kind(Kind::Inductance);
            self.line("inductance", inductance);
            self.faster(resistance / inductance);
        }
        self.line("gear_ratio", n);
        self.gear(sizes, n);
        if inductance == 0.0 && !current_mode {
            self.faster(kt * ke * n * n / (resistance * r * r * sizes.mass[0]));
        }
        self.faster(
            (kt * ke * n * n / (r * r * sizes.mass[0] * inductance.max(1e-300))).sqrt().min(1e300)
                * f64::from(u8::from(inductance > 0.0)),
        );

        self.table("amplifier");
        if current_mode {
            self.kind(Kind::Current);
            self.text.push_str("mode = \"current\"\n");
        }
        let gain = if self.random.chance(0.7) {
            1.0
        } else {
            self.decades(0.1, 10.0) * if self.random.chance(0.3) { -1.0 } else { 1.0 }
        };
        self.line("gain", gain);
        if let Some(bandwidth) = bandwidth {
            let bandwidth = self.digits((bandwidth / (2.0 * PI)).max(1e-8));
            self.line("bandwidth", bandwidth);
            self.faster(2.0 * PI * bandwidth);
        }
        let mut bound = f64::INFINITY;
        if voltage_limit {
            self.kind(Kind::Limits);
            let limit = volts * self.random.decades(0.05, 3.0);
            self.line("voltage_limit", limit.max(1e-14));
        }
        if current_limit {
            self.kind(Kind::Limits);
            let limit = amperes * self.random.decades(0.05, 3.0);
            bound = self.digits(limit.max(1e-14));
            self.line("current_limit", bound);
        }
        let moves = if current_mode { bandwidth.is_some() } else { inductance > 0.0 };
        let current = moves.then(|| (amperes * self.random.even(-1.0, 1.0)).clamp(-0.99 * bound, 0.99 * bound));
        Scale { input: if current_mode { amperes } else { volts } / gain.abs(), current }
    }

    fn gear(&mut self, sizes: &Sizes, n: f64) {
        let r = sizes.radius;
        let play = self.random.chance(0.2);
        let mut rotor = 0.0;
        if play || self.random.chance(0.5) {
            rotor = sizes.mass[0] * self.random.decades(0.01, 10.0);
            self.line("rotor_inertia", rotor * r * r / (n * n));
        }
        if play {
            self.kind(Kind::Play);
            let k = sizes.stiffness[self.random.below(3)] * self.random.decades(0.1, 10.0);
            let light = rotor.min(sizes.mass[0]);
            let c =
                if self.random.chance(0.5) { 0.0 } else { 2.0 * self.random.decades(1e-3, 1.0) * (k * light).sqrt() };
            let backlash = if self.random.chance(0.2) { 0.0 } else { sizes.way * self.random.decades(1e-4, 0.3) / r };
            self.line("gear_stiffness", k * r * r);
            self.line("gear_damping", c * r * r);
            self.line("backlash", backlash.min(6.0));
            self.faster((2.0 * k / light).sqrt().max(2.0 * c / light));
        } else if self.random.chance(0.35) {
            self.kind(Kind::Losses);
            let efficiency = if self.random.chance(0.2) { self.even(0.1, 0.5) } else { self.even(0.5, 0.999) };
            self.line("gear_efficiency", efficiency);
        }
    }

    /// `friction = { … }` of a body that counts as `mass` at the belt; `arm` makes a force a torque.
    fn friction(&mut self, sizes: &Sizes, mass: f64, arm: f64) -> String {
        let side = |draw: &mut Self| {
            let slow = mass * draw.random.decades(1e-3, 30.0) / sizes.time;
            let viscous = match draw.random.below(12) {
                0..3 => 0.0,
                3 => mass * draw.fastest * draw.random.decades(0.05, 3.0),
                _ => slow,
            };
            let common = sizes.force * draw.random.decades(1e-3, 3.0);
            let coulomb = match draw.random.below(20) {
                0..4 => 0.0,
                4 => common * draw.random.decades(1e3, 1e6),
                _ => common,
            };
            let over = match draw.random.below(10) {
                0..4 => 1.0,
                4..8 => draw.random.even(1.0, 2.0),
                _ => draw.random.decades(2.0, 10.0),
            };
            // Breakaway alone, too.
            let coulomb_or_less = if draw.random.chance(0.05) { 0.0 } else { coulomb };
            [viscous * arm * arm, coulomb_or_less * arm, coulomb * over * arm].map(|value| draw.digits(value))
        };
        let forward = side(self);
        let backward = if self.random.chance(0.25) { side(self) } else { forward };
        self.faster(2.0 * forward[0].max(backward[0]) / (arm * arm * mass));
        if forward[2] > forward[1] || backward[2] > backward[1] {
            self.kind(Kind::Static);
        }
        let [viscous, coulomb, at_rest] = forward;
        let mut text = format!("viscous = {viscous:e}, coulomb = {coulomb:e}, static = {:e}", at_rest.max(coulomb));
        if backward != forward {
            self.kind(Kind::Asymmetric);
            let [viscous, coulomb, at_rest] = backward;
            let _ = write!(
                text,
                ", viscous_backward = {viscous:e}, coulomb_backward = {coulomb:e}, static_backward = {:e}",
                at_rest.max(coulomb)
            );
        }
        format!("friction = {{ {text} }}\n")
    }

    fn bodies(&mut self, sizes: &Sizes) {
        let r = sizes.radius;
        let [m1, m2, m3] = sizes.mass;
        let drive = self.friction(sizes, m1, r);
        let idler = if sizes.symmetric { drive.clone() } else { self.friction(sizes, m3, r) };
        let cart = self.friction(sizes, m2, 1.0);
        self.table("drive_pulley");
        self.line("radius", r);
        self.line("inertia", m1 * r * r);
        self.text.push_str(&drive);
        self.table("idler_pulley");
        self.line("inertia", m3 * r * r);
        self.text.push_str(&idler);
        self.table("cart");
        self.line("mass", m2);
        self.text.push_str(&cart);
        if self.random.chance(0.2) {
            let load = sizes.force * self.random.even(-1.0, 1.0);
            self.line("load", load);
        }
        if self.random.chance(0.07) {
            let most = (sizes.force / (9.8 * m2)).min(1.0);
            let inclination = most * self.random.even(-1.0, 1.0);
            self.line("inclination", inclination);
        }
    }

    fn belt(&mut self, sizes: &Sizes) {
        let [k1, k2, k3] = sizes.stiffness;
        let [c1, c2, c3] = sizes.damping;
        self.table("belt");
        let _ = writeln!(self.text, "stiffness = [{k1:e}, {k2:e}, {k3:e}]\ndamping = [{c1:e}, {c2:e}, {c3:e}]");
        let _ = writeln!(self.text, "model = \"{}\"", sizes.model);
        if sizes.model != "rigid" && self.random.chance(0.25) {
            self.kind(Kind::Slack);
            let pretension = sizes.force * self.random.decades(0.01, 10.0);
            self.line("pretension", pretension.max(1e-14));
        }
    }

    /// Where the cart starts.
    fn place(&mut self) -> f64 {
        match self.random.below(20) {
            0..11 => 0.0,
            11..16 => self.even(-1.0, 1.0),
            _ => {
                self.kind(Kind::Far);
                self.decades(1.0, 1000.0) * if self.random.chance(0.5) { -1.0 } else { 1.0 }
            }
        }
    }

    fn travel(&mut self, sizes: &Sizes, start: f64) {
        if !self.random.chance(0.25) {
            return;
        }
        self.kind(Kind::Travel);
        let [low, high] = [(); 2].map(|()| sizes.way * self.random.decades(0.01, 2.0));
        let (low, high) = (self.digits(start - low), self.digits(start + high));
        let margin = 1e-9 * start.abs().max(1e-6);
        self.table("travel");
        let _ = writeln!(self.text, "min = {:e}\nmax = {:e}", low.min(start - margin), high.max(start + margin));
        if self.random.chance(0.85) {
            let k = sizes.stiffness[self.random.below(3)] * self.random.decades(0.1, 10.0);
            let m = sizes.mass[1];
            let c = if self.random.chance(0.5) { 0.0 } else { 2.0 * self.random.decades(1e-3, 1.0) * (k * m).sqrt() };
            self.line("stop_stiffness", k);
            self.line("stop_damping", c);
            self.faster((2.0 * k / m).sqrt().max(2.0 * c / m));
        }
    }

    fn experiment(&mut self, sizes: &Sizes, start: f64, scale: &Scale) {
        let most = 5000.0 / self.fastest;
        let until = self.digits(sizes.time.min(0.99 * most));
        let rows = 20.0 + self.random.below(30) as f64;
        let every = self.digits(until / rows).min(until);
        let input = self.input(until, scale.input, 0);
        let initial = self.initial(sizes, start, until, scale);
        self.text.push_str("\n[[experiment]]\nname = \"run\"\n");
        let _ = writeln!(self.text, "input = {input}\nuntil = {until:e}\nevery = {every:e}\ninitial = {{ {initial} }}");
    }

    fn input(&mut self, until: f64, peak: f64, depth: u32) -> String {
        let mut size = peak * self.random.decades(0.1, 10.0) * if self.random.chance(0.4) { -1.0 } else { 1.0 };
        if self.random.chance(0.04) {
            size = 0.0;
        }
        let size = self.digits(size);
        let at = match self.random.chance(0.5) {
            true => String::new(),
            false => format!(", at = {:e}", self.even(0.0, 0.3 * until)),
        };
        let frequency = self.decades(0.7, 20.0) / until;
        let frequency = self.digits(frequency.max(1e-8));
        match self.random.below(if depth == 0 { 9 } else { 6 }) {
            0 => format!("{{ step = {size:e}{at} }}"),
            1 => format!("{{ pulse = {size:e}, for = {:e}{at} }}", self.even(0.05, 0.7) * until),
            2 => format!("{{ ramp = {size:e}, over = {:e}{at} }}", self.even(0.05, 1.2) * until),
            3 => format!("{{ triangle = {:e}, frequency = {frequency:e} }}", size),
            4 => format!("{{ square = {size:e}, frequency = {frequency:e}, duty = {:e} }}", self.even(0.2, 0.8)),
            5 => {
                let phase = if self.random.chance(0.4) { 0.0 } else { self.even(-3.0, 3.0) };
                let offset = if self.random.chance(0.6) { 0.0 } else { self.even(-0.5, 0.5) * size };
                format!("{{ sine = {size:e}, frequency = {frequency:e}, phase = {phase:e}, offset = {offset:e} }}")
            }
            6 => {
                let (mut time, mut points) = (0.0, Vec::new());
                for i in 0..3 + self.random.below(8) {
                    if i > 0 || self.random.chance(0.5) {
                        time += until * self.random.even(0.01, 0.2);
                    }
                    points.push(format!("[{:e}, {:e}]", self.digits(time), self.even(-1.0, 1.0) * size));
                }
                format!("{{ table = [{}] }}", points.join(", "))
            }
            7 => {
                let parts = [(); 2].map(|()| self.input(until, peak, depth + 1));
                format!("{{ sum = [{}] }}", parts.join(", "))
            }
            _ => {
                let parts = [(); 3].map(|()| {
                    let lasts = self.even(0.1, 0.4) * until;
                    let part = self.input(lasts, peak, depth + 1);
                    format!("{}, lasts = {lasts:e} }}", part.trim_end_matches('}').trim_end())
                });
                format!("{{ sequence = [{}] }}", parts.join(", "))
            }
        }
    }

    fn initial(&mut self, sizes: &Sizes, start: f64, until: f64, scale: &Scale) -> String {
        let r = self.digits(sizes.radius);
        let mut ways = [start; 3];
        let mut speeds = [0.0; 3];
        let strained = self.random.chance(0.35);
        if self.random.chance(0.3) {
            speeds = [sizes.way / until * self.random.even(-1.0, 1.0); 3];
        }
        if strained && sizes.model != "rigid" {
            let softest = sizes.stiffness.iter().copied().fold(f64::MAX, f64::min);
            let strain = (sizes.force / softest).min(0.01) * self.random.decades(0.01, 3.0);
            for body in [0, 2] {
                ways[body] += strain * self.random.even(-1.0, 1.0);
                speeds[body] += strain * self.fastest * 0.1 * self.random.even(-1.0, 1.0);
            }
            if sizes.model == "two-mass" {
                (ways[2], speeds[2]) = (ways[0], speeds[0]);
            } else if sizes.symmetric && self.random.chance(0.5) {
                // A mirror image: both pulleys do the same.
                (ways[2], speeds[2]) = (ways[0], speeds[0]);
            }
        }
        let mut keys = vec![("cart_position", ways[1]), ("cart_speed", speeds[1])];
        keys.extend([("drive_angle", ways[0] / r), ("drive_speed", speeds[0] / r)]);
        keys.extend([("idler_angle", ways[2] / r), ("idler_speed", speeds[2] / r)]);
        if let Some(current) = scale.current.filter(|_| self.random.chance(0.3)) {
            keys.push(("motor_current", current));
        }
        let given = keys.into_iter().filter(|(_, value)| *value != 0.0);
        let given: Vec<String> = given.map(|(key, value)| format!("{key} = {value:e}")).collect();
        given.join(", ")
    }
}
