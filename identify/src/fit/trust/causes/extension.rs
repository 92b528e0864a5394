//! The elements that a model may lack, one row each.

use crate::case::{Case, Plan, Scope};
use crate::fit::limits::{
    CAUSE_AROUND, CAUSE_DELAYS, CAUSE_GAPS, CAUSE_SHARE, CAUSE_SPRINGS, FLANK_DAMPING, FLANK_FREQUENCY, KNOWN_SHARE,
    KNOWN_SHARES, SPRING_DAMPING,
};
use crate::fit::search::regression::suspected_delay;
use crate::fit::search::starts::Searched;
use crate::log::{Log, Quantity};
use crate::machine::{BeltModel, GearPlay, Machine};
use crate::number::engineering;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Where the fit without the element ended.
pub(super) struct Site<'s, 'a> {
    pub case: &'s Case,
    pub plan: &'s Plan,
    pub found: &'s Searched<'a>,
    /// The machine with the estimates.
    pub machine: Machine,
}

/// One element.
pub(super) struct Extension {
    key: &'static str,
    /// The case and the plan with it, once for each start; none where the case has it already.
    tries: fn(&Site) -> Vec<Extended>,
}

/// A case with one element more.
pub(super) struct Extended {
    /// The element.
    pub key: &'static str,
    pub case: Case,
    pub plan: Plan,
    /// The parameter that is zero, or stiff, where the element is not there; none for the delay.
    pub telling: Option<&'static str>,
    /// Where the delay begins, s, if it is the element.
    pub delay: Option<f64>,
    /// Whether the sensor is taken to be at the motor.
    pub at_motor: bool,
}

/// All of them.
pub(super) const EXTENSIONS: &[Extension] = &[
    Extension { key: "spring", tries: springs },
    Extension { key: "play", tries: plays },
    Extension { key: "delay", tries: delays },
];

impl Extension {
    /// The case with it, once for each start.
    pub fn tries(&self, site: &Site) -> Vec<Extended> {
        let mut tries = (self.tries)(site);
        tries.iter_mut().for_each(|extended| extended.key = self.key);
        tries
    }
}

impl<'s, 'a> Site<'s, 'a> {
    pub fn new(case: &'s Case, plan: &'s Plan, found: &'s Searched<'a>) -> Self {
        Self { case, plan, found, machine: found.problem.stage_at(&found.best.x) }
    }

    /// The standard deviation of the residuals of a quantity; of one that stands for another, as that has.
    pub fn deviation(&self, quantity: Quantity) -> f64 {
        let r = self.machine.pulley_radius;
        let of = |own: Quantity| self.found.noise.iter().find(|(other, _)| *other == own).map(|(_, sigma)| *sigma);
        let stands_for = match quantity {
            Quantity::RotorAngle => of(Quantity::DriveAngle).or(of(Quantity::CartPosition).map(|sigma| sigma / r)),
            Quantity::RotorSpeed => of(Quantity::DriveSpeed).or(of(Quantity::CartSpeed).map(|sigma| sigma / r)),
            _ => None,
        };
        of(quantity).or(stands_for).unwrap_or(1e-12)
    }

    /// n² J_r, the rotor's inertia at the drive pulley, kg m².
    fn rotor(&self) -> f64 {
        let motor = &self.machine.drives[0].motor;
        motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia
    }

    /// J₁ + J₃ + r² M + n² J_r, all that moves at the drive pulley, kg m².
    fn inertia(&self) -> f64 {
        let Machine { pulley_radius: r, drive_pulley, idler_pulley, cart, .. } = &self.machine;
        drive_pulley.inertia + idler_pulley.inertia + r * r * cart.mass + self.rotor()
    }

    /// The machine with a rotor of its own behind a gear, and whether its inertia was split off the cart; none where
    /// there is nothing to split, or no rotor.
    fn split(&self) -> Option<(Machine, bool)> {
        let mut machine = self.machine.clone();
        let (r, inertia) = (machine.pulley_radius, self.inertia());
        if self.rotor() > KNOWN_SHARE * inertia {
            return Some((machine, false));
        }
        let is_free = |key: &str| self.plan.free.iter().any(|own| own == key);
        // n² J_r := s J,  M := M − Δ(n² J_r)/r²
        let moved = CAUSE_SHARE * inertia - self.rotor();
        machine.cart.mass -= moved / (r * r);
        let motor = &mut machine.drives[0].motor;
        motor.rotor_inertia = CAUSE_SHARE * inertia / (motor.gear_ratio * motor.gear_ratio);
        (is_free("cart.mass") && machine.cart.mass > KNOWN_SHARE * self.machine.cart.mass).then_some((machine, true))
    }

    /// The machine without the element, all of its inertia where the case has it.
    pub fn without(&self, mut machine: Machine) -> Machine {
        let r = machine.pulley_radius;
        let motor = &mut machine.drives[0].motor;
        let own = self.machine.drives[0].motor;
        let moved = motor.gear_ratio * motor.gear_ratio * (motor.rotor_inertia - own.rotor_inertia);
        (motor.rotor_inertia, motor.gear_play) = (own.rotor_inertia, own.gear_play);
        machine.cart.mass += moved / (r * r);
        machine
    }

    /// Whether a rotor of its own can stand behind a gear: the case has neither that nor a belt that stretches.
    fn is_stiff(&self) -> bool {
        self.machine.drives[0].motor.gear_play.is_none() && self.machine.belt.model == BeltModel::Rigid
    }

    /// The case with this gear and these parameters, with the sensor as logged and at the motor.
    fn geared(&self, machine: &Machine, play: GearPlay, keys: &[&str], telling: &'static str) -> Vec<Extended> {
        let mut machine = machine.clone();
        machine.drives[0].motor.gear_play = Some(play);
        let mut plan = Plan { starts: 1, ..self.plan.clone() };
        plan.free.extend(keys.iter().map(|key| key.to_string()));
        // What is far off takes long to simulate, and is not what was tried.
        let n = machine.drives[0].motor.gear_ratio;
        let around = |key: &str| match key {
            "motor.rotor_inertia" => KNOWN_SHARES.map(|share| share * self.inertia() / (n * n)),
            "motor.gear_stiffness" => CAUSE_AROUND.map(|factor| factor * play.stiffness),
            "motor.gear_damping" => [0.0, CAUSE_AROUND[1] * play.damping],
            _ => [0.0, CAUSE_AROUND[1] * play.backlash],
        };
        plan.bounds.extend(keys.iter().map(|key| (key.to_string(), around(key))));
        let case = Case { machine, ..self.case.clone() };
        let extended = |case: Case, at_motor: bool| Extended {
            key: "",
            case,
            plan: plan.clone(),
            telling: Some(telling),
            delay: None,
            at_motor,
        };
        let other = at_motor(&case);
        std::iter::once(extended(case, false)).chain(other.map(|case| extended(case, true))).collect()
    }
}

/// The case with positions and speeds read at the motor, whatever they were called; none where no log has one.
fn at_motor(case: &Case) -> Option<Case> {
    let mut case = case.clone();
    let (r, mut any) = (case.machine.pulley_radius, false);
    for experiment in &mut case.experiments {
        let Some(log) = experiment.log.as_mut() else { continue };
        let log: &mut Log = Arc::make_mut(log);
        let places = log.outputs.iter().filter(|output| output.quantity.name().starts_with("rotor")).count();
        if places > 0 {
            return None;
        }
        for output in &mut log.outputs {
            let (quantity, arm) = match output.quantity {
                Quantity::CartPosition => (Quantity::RotorAngle, r),
                Quantity::CartSpeed => (Quantity::RotorSpeed, r),
                Quantity::DriveAngle => (Quantity::RotorAngle, 1.0),
                Quantity::DriveSpeed => (Quantity::RotorSpeed, 1.0),
                _ => continue,
            };
            output.quantity = quantity;
            output.values.iter_mut().for_each(|value| *value /= arm);
            any = true;
        }
        // Two sensors at one body would be compared with one column.
        let twice = |quantity: Quantity| log.outputs.iter().filter(|output| output.quantity == quantity).count() > 1;
        if twice(Quantity::RotorAngle) || twice(Quantity::RotorSpeed) {
            return None;
        }
    }
    any.then_some(case)
}

/// A spring between motor and cart, at several frequencies.
fn springs(site: &Site) -> Vec<Extended> {
    let Some((machine, is_split)) = site.split().filter(|_| site.is_stiff()) else { return Vec::new() };
    let mut keys = vec!["motor.gear_stiffness", "motor.gear_damping"];
    keys.extend(is_split.then_some("motor.rotor_inertia"));
    let of = |frequency: &f64| {
        let [stiffness, damping] = flank(site, &machine, *frequency, SPRING_DAMPING);
        let play = GearPlay { backlash: 0.0, stiffness, damping };
        site.geared(&machine, play, &keys, "motor.gear_stiffness")
    };
    CAUSE_SPRINGS.iter().flat_map(of).collect()
}

/// Play between motor and cart, of several sizes.
fn plays(site: &Site) -> Vec<Extended> {
    let Some((machine, is_split)) = site.split().filter(|_| site.is_stiff()) else { return Vec::new() };
    let mut keys = vec!["motor.backlash"];
    keys.extend(is_split.then_some("motor.rotor_inertia"));
    let r = machine.pulley_radius;
    let angle = site.found.noise.iter().find_map(|(quantity, sigma)| match quantity {
        Quantity::CartPosition => Some(sigma / r),
        Quantity::DriveAngle => Some(*sigma),
        _ => None,
    });
    let Some(angle) = angle else { return Vec::new() };
    let of = |gap: &f64| {
        let [stiffness, damping] = flank(site, &machine, FLANK_FREQUENCY, FLANK_DAMPING);
        let play = GearPlay { backlash: gap * angle, stiffness, damping };
        site.geared(&machine, play, &keys, "motor.backlash")
    };
    CAUSE_GAPS.iter().flat_map(of).collect()
}

/// Stiffness and damping of a gear for this frequency, Hz, and damping ratio.
fn flank(site: &Site, machine: &Machine, frequency: f64, ratio: f64) -> [f64; 2] {
    let motor = &machine.drives[0].motor;
    let rotor = motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia;
    // 1/J = 1/(n² J_r) + 1/(J − n² J_r),  k = ω² J,  c = 2 ζ √(k J)
    let reduced = rotor * (site.inertia() - rotor) / site.inertia();
    let stiffness = (TAU * frequency).powi(2) * reduced;
    [stiffness, 2.0 * ratio * (stiffness * reduced).sqrt()]
}

/// Inputs that act late, or samples that are taken later than their stamps.
fn delays(site: &Site) -> Vec<Extended> {
    if site.plan.nuisance.delay != Scope::Off {
        return Vec::new();
    }
    let mut plan = Plan { starts: 1, ..site.plan.clone() };
    plan.nuisance.delay = Scope::Shared;
    let interval = site.found.problem.runs[0].interval();
    let case = Case { machine: site.machine.clone(), ..site.case.clone() };
    let suspected = suspected_delay(&site.found.problem);
    let starts = CAUSE_DELAYS.iter().map(|share| share * interval).chain(suspected);
    let of = |delay: f64| Extended {
        key: "",
        case: case.clone(),
        plan: plan.clone(),
        telling: None,
        delay: Some(delay),
        at_motor: false,
    };
    starts.map(of).collect()
}

/// A value in three digits.
fn shown(value: f64, unit: &str) -> String {
    engineering(value, unit, 3).replace(['\u{a0}', '\u{202f}'], " ").replace('−', "-")
}

impl Extended {
    /// The element in words, with its size, and the change of the case file that adds it.
    pub fn words(&self, site: &Site, machine: &Machine, delay: f64) -> (String, String) {
        let r = machine.pulley_radius;
        let motor = &machine.drives[0].motor;
        let rotor = motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia;
        let mut words = match (self.key, motor.gear_play) {
            ("spring", Some(play)) => {
                let reduced = rotor * (site.inertia() - rotor) / site.inertia();
                let frequency = (play.stiffness / reduced).sqrt() / TAU;
                let stiffness = shown(play.stiffness / (r * r), "N/m");
                format!("a spring of {stiffness} between motor and cart ({})", shown(frequency, "Hz"))
            }
            ("play", Some(play)) => format!("play of {} between motor and cart", shown(play.backlash * r, "m")),
            _ if delay < 0.0 => format!("samples that are taken {} after their time stamps", shown(-delay, "s")),
            _ => format!("an input that acts {} late", shown(delay, "s")),
        };
        if self.plan.free.iter().any(|key| key == "motor.rotor_inertia") {
            words.push_str(&format!(", {} of the mass before it", shown(rotor / (r * r), "kg")));
        }
        if self.at_motor {
            words.push_str(", with the position read at the motor");
        }
        let mut keys = Vec::new();
        if let Some(play) = motor.gear_play {
            keys.push(format!("motor.gear_stiffness = \"{}\"", shown(play.stiffness, "N m/rad")));
            if play.backlash > 0.0 {
                keys.push(format!("motor.backlash = \"{}\"", shown(play.backlash, "rad")));
            }
            if self.plan.free.iter().any(|key| key == "motor.rotor_inertia") {
                keys.push(format!("motor.rotor_inertia = \"{}\"", shown(motor.rotor_inertia, "kg m^2")));
            }
            if self.at_motor {
                keys.push("rotor_angle in place of the logged position".into());
            }
        }
        if self.delay.is_some() {
            keys.push("nuisance = { delay = \"shared\" } to [fit]".into());
        }
        (words, keys.join(", "))
    }
}
