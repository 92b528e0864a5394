//! Motor, amplifier, bodies, belt and travel of a random stage.

use super::{Draw, Feature, Random, Sizes, StageKind};
use crate::by::By;
use std::f64::consts::PI;
use std::fmt::Write;

/// The scale of forces: those that the motor needs to move the machine, and those that it has.
pub(super) struct Scale {
    /// Volts or amperes at the amplifier's input.
    pub(super) input: f64,
    /// Amperes of the current at the start, where it is a state.
    pub(super) current: Option<f64>,
    /// Force at the belt per unit of the input, at rest.
    pub(super) push: f64,
}

/// Motor and amplifier as far as they depend on each other.
struct Drive {
    resistance: f64,
    inductance: f64,
    current_mode: bool,
    bandwidth: Option<f64>,
    voltage_limit: bool,
    current_limit: bool,
}

impl Draw {
    pub(super) fn motor(&mut self, sizes: &Sizes) -> Scale {
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
        let current_mode = self.has(Feature::Current, 0.25);
        let bandwidth = (current_mode && self.random.chance(0.6)).then(|| self.decades(1.0, 2000.0) / sizes.time);
        let mut inductance = match self.has(Feature::Inductance, 0.35) {
            true => resistance * sizes.time / self.random.decades(1.0, 2000.0),
            false => 0.0,
        };
        let [mut voltage_limit, mut current_limit] = [(); 2].map(|()| self.random.chance(0.35));
        if self.is_by_recipe() {
            let limits = self.wants(Feature::Limit);
            // A voltage limit in current mode wants both, a bandwidth and an inductance, or none.
            let may = !current_mode || bandwidth.is_some() == (inductance > 0.0);
            (voltage_limit, current_limit) = (limits && voltage_limit && may, limits && current_limit);
            current_limit |= limits && !voltage_limit;
        } else if current_mode && voltage_limit && bandwidth.is_some() != (inductance > 0.0) {
            (voltage_limit, inductance) = (bandwidth.is_none(), 0.0);
        }
        if !voltage_limit && !current_limit && self.random.chance(0.1) && !self.is_by_recipe() {
            current_limit = true;
        }
        inductance = self.digits(inductance);
        let amperes = sizes.force * r / (n * kt);
        let drive = Drive { resistance, inductance, current_mode, bandwidth, voltage_limit, current_limit };
        self.table("motor");
        self.line("torque_constant", kt);
        self.line("back_emf_constant", ke);
        self.line("resistance", resistance);
        if inductance > 0.0 {
            self.kind(StageKind::Inductance);
            self.line("inductance", inductance);
            self.faster(resistance / inductance);
        }
        self.line("gear_ratio", n);
        self.gear(sizes, n);
        // How fast motor and drive pulley exchange energy, or the back-EMF brakes it.
        let exchange = kt * ke * n * n / (r * r * sizes.mass[0]);
        if inductance > 0.0 {
            self.faster((exchange / inductance).sqrt());
        } else if !current_mode {
            self.faster(exchange / resistance);
        }
        self.amplifier(&drive, amperes, n * kt / r)
    }

    fn amplifier(&mut self, drive: &Drive, amperes: f64, grip: f64) -> Scale {
        let volts = amperes * drive.resistance;
        self.table("amplifier");
        if drive.current_mode {
            self.kind(StageKind::Current);
            self.text.push_str("mode = \"current\"\n");
        }
        let gain = match self.random.chance(0.7) {
            true => 1.0,
            false => self.decades(0.1, 10.0) * if self.random.chance(0.3) { -1.0 } else { 1.0 },
        };
        self.line("gain", gain);
        if let Some(bandwidth) = drive.bandwidth {
            let bandwidth = self.digits((bandwidth / (2.0 * PI)).max(1e-8));
            self.line("bandwidth", bandwidth);
            self.faster(2.0 * PI * bandwidth);
        }
        let mut bound = f64::INFINITY;
        if drive.voltage_limit {
            self.kind(StageKind::Limits);
            let limit = volts * self.random.decades(0.05, 3.0);
            self.line("voltage_limit", limit.max(1e-14));
        }
        if drive.current_limit {
            self.kind(StageKind::Limits);
            let limit = amperes * self.random.decades(0.05, 3.0);
            bound = self.digits(limit.max(1e-14));
            self.line("current_limit", bound);
        }
        let moves = if drive.current_mode { drive.bandwidth.is_some() } else { drive.inductance > 0.0 };
        let current = moves.then(|| (amperes * self.random.even(-1.0, 1.0)).clamp(-0.99 * bound, 0.99 * bound));
        let push = grip * gain / if drive.current_mode { 1.0 } else { drive.resistance };
        Scale { input: if drive.current_mode { amperes } else { volts } / gain.abs(), current, push }
    }

    fn gear(&mut self, sizes: &Sizes, n: f64) {
        let r = sizes.radius;
        let play = self.has(Feature::Gear, 0.2);
        let mut rotor = 0.0;
        if play || self.random.chance(0.5) {
            rotor = sizes.mass[0] * self.random.decades(0.01, 10.0);
            self.line("rotor_inertia", rotor * r * r / (n * n));
        }
        if play {
            self.kind(StageKind::Play);
            let k = sizes.stiffness[self.random.below(3)] * self.random.decades(0.1, 10.0);
            let light = rotor.min(sizes.mass[0]);
            let c =
                if self.random.chance(0.5) { 0.0 } else { 2.0 * self.random.decades(1e-3, 1.0) * (k * light).sqrt() };
            let backlash = if self.random.chance(0.2) { 0.0 } else { sizes.way * self.random.decades(1e-4, 0.3) / r };
            self.line("gear_stiffness", k * r * r);
            self.line("gear_damping", c * r * r);
            self.line("backlash", backlash.min(6.0));
            self.faster((2.0 * k / light).sqrt().max(2.0 * c / light));
        } else if self.has(Feature::Losses, 0.35) {
            self.kind(StageKind::Losses);
            let efficiency = if self.random.chance(0.2) { self.even(0.1, 0.5) } else { self.even(0.5, 0.999) };
            self.line("gear_efficiency", efficiency);
        }
    }

    pub(super) fn bodies(&mut self, sizes: &Sizes) {
        let r = sizes.radius;
        let [m1, m2, m3] = sizes.mass;
        let curves = self.curves;
        let drive = self.friction(sizes, m1, r, curves[0], false);
        let alike = sizes.symmetric && curves[0] == curves[2];
        let idler = if alike { drive.clone() } else { self.friction(sizes, m3, r, curves[2], false) };
        let along = self.wants(Feature::Along);
        let cart = self.friction(sizes, m2, 1.0, curves[1], along);
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
        if self.random.chance(0.2) && !self.is_loop() {
            let load = sizes.force * self.random.even(-1.0, 1.0);
            self.line("load", load);
        }
        if self.random.chance(0.07) {
            let most = (sizes.force / (9.8 * m2)).min(1.0);
            let inclination = most * self.random.even(-1.0, 1.0);
            self.line("inclination", inclination);
        }
    }

    pub(super) fn belt(&mut self, sizes: &Sizes) {
        let [k1, k2, k3] = sizes.stiffness;
        let [c1, c2, c3] = if self.vibrates_without_cart(sizes) { self.some_damping(sizes) } else { sizes.damping };
        self.table("belt");
        if self.wants(Feature::Follows) {
            let rigidity = self.rigidity(sizes, &sizes.stiffness);
            let [l1, l2, l3] = sizes.stiffness.map(|k| self.digits(rigidity / k));
            let _ = writeln!(self.text, "modulus = {rigidity:e}\nsection = 1\nspans = [{l1:e}, {l2:e}, {l3:e}]");
            let _ = writeln!(self.text, "follows_cart = true\ndamping = [{c1:e}, {c2:e}, {c3:e}]");
        } else {
            let _ = writeln!(self.text, "stiffness = [{k1:e}, {k2:e}, {k3:e}]\ndamping = [{c1:e}, {c2:e}, {c3:e}]");
        }
        let _ = writeln!(self.text, "model = \"{}\"", sizes.model);
        if sizes.model != "rigid" && self.has(Feature::Slack, 0.25) {
            self.kind(StageKind::Slack);
            let pretension = sizes.force * self.random.decades(0.01, 10.0);
            self.line("pretension", pretension.max(1e-14));
        }
    }

    /// True if the pulleys of an axis with state feedback vibrate against each other for ever while the cart stands
    /// still. The weights of a regulator are those of the cart: there is none for such an axis, and taut refuses it.
    fn vibrates_without_cart(&self, sizes: &Sizes) -> bool {
        let pulleys = ["[drive_pulley]", "[idler_pulley]"];
        let is_smooth = |table: &str| {
            let rest = self.text.split_once(table).map_or("", |(_, rest)| rest);
            rest.split("\n[").next().is_some_and(|table| table.contains("{ viscous = 0e0,"))
        };
        self.wants(Feature::StateFeedback)
            && sizes.symmetric
            && sizes.model == "elastic"
            && sizes.damping == [0.0; 3]
            && pulleys.into_iter().all(is_smooth)
            && self.text.contains("mode = \"current\"")
            && !self.text.contains("rotor_inertia")
    }

    /// Damping of each span of 1 % of what is critical for a pulley.
    fn some_damping(&self, sizes: &Sizes) -> [f64; 3] {
        sizes.stiffness.map(|k| self.digits(0.02 * (k * sizes.mass[0]).sqrt()))
    }

    /// E A that makes every span longer than what the cart may take of it.
    pub(super) fn rigidity(&self, sizes: &Sizes, stiffness: &[f64]) -> f64 {
        let stiffest = stiffness.iter().copied().fold(0.0, f64::max);
        self.digits(stiffest * 9.0 * sizes.way)
    }

    /// Where the cart starts.
    pub(super) fn place(&mut self) -> f64 {
        // Spans are as long as they are about the origin; a varied radius would strain a belt far from there.
        let near = [Feature::Follows, Feature::Along, Feature::Asked(By::Sweep)];
        if self.is_loop() || near.into_iter().any(|one| self.wants(one)) {
            return 0.0;
        }
        match self.random.below(20) {
            0..11 => 0.0,
            11..16 => self.even(-1.0, 1.0),
            _ => {
                self.kind(StageKind::Far);
                self.decades(1.0, 1000.0) * if self.random.chance(0.5) { -1.0 } else { 1.0 }
            }
        }
    }

    /// Forces on the cart over its way and its speed, now and then; drawn from a sequence of their own.
    pub(super) fn lines(&mut self, sizes: &Sizes, start: f64, mut random: Random) {
        let drawn = random.chance(0.15);
        let by_recipe = self.is_by_recipe();
        if (by_recipe && !self.wants(Feature::Line)) || (!by_recipe && !drawn) {
            return;
        }
        self.kind(StageKind::Lines);
        let mut text = String::from("[cart]\n");
        for (key, middle, reach) in [("force_along", start, sizes.way), ("force_by_speed", 0.0, sizes.way / sizes.time)]
        {
            if !(random.chance(0.7) || by_recipe && key == "force_along") {
                continue;
            }
            let count = 1 + random.below(5);
            let mut x = middle - reach * random.even(0.0, 0.5);
            let mut points = Vec::new();
            for _ in 0..count {
                let force = 0.3 * sizes.force * random.even(-1.0, 1.0);
                points.push(format!("[{:e}, {:e}]", x, self.digits(force)));
                let step = reach * random.decades(0.03, 1.0);
                x += step.max(1e-12 * x.abs());
                // The steepest line between two points
                let slope = 0.6 * sizes.force / step / sizes.mass[1];
                self.faster(if key == "force_along" { slope.sqrt() } else { slope });
            }
            let _ = writeln!(text, "{key} = [{}]", points.join(", "));
        }
        self.text = self.text.replacen("[cart]\n", &text, 1);
    }

    pub(super) fn travel(&mut self, sizes: &Sizes, start: f64) {
        let stops = self.has(Feature::Stop, 0.25);
        if !stops && !self.wants(Feature::Follows) {
            return;
        }
        self.kind(StageKind::Travel);
        let shortest = if stops { 0.01 } else { 2.0 };
        let [low, high] = [(); 2].map(|()| sizes.way * self.random.decades(shortest, if stops { 2.0 } else { 4.0 }));
        let (low, high) = (self.digits(start - low), self.digits(start + high));
        // A move wants both of its ends within the travel, and may go a little farther.
        let (low, high) = match self.is_loop() {
            true => [-1.0, 1.0].map(|side| side * sizes.way * (1.0 + 0.1 * self.random.share())).into(),
            false => (low, high),
        };
        let margin = 1e-9 * start.abs().max(1e-6);
        self.table("travel");
        let _ = writeln!(self.text, "min = {:e}\nmax = {:e}", low.min(start - margin), high.max(start + margin));
        if self.random.chance(0.85) && !self.is_by_recipe() || self.wants(Feature::Stop) {
            let k = sizes.stiffness[self.random.below(3)] * self.random.decades(0.1, 10.0);
            let m = sizes.mass[1];
            let c = if self.random.chance(0.5) { 0.0 } else { 2.0 * self.random.decades(1e-3, 1.0) * (k * m).sqrt() };
            self.line("stop_stiffness", k);
            self.line("stop_damping", c);
            self.faster((2.0 * k / m).sqrt().max(2.0 * c / m));
        }
    }
}
