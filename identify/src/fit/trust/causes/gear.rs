//! A spring or play between motor and cart.

use super::extension::{Extended, Fitted, Said, Site, Telling, shown};
use crate::case::{Case, Plan};
use crate::fit::limits::{
    CAUSE_AROUND, CAUSE_GAPS, CAUSE_SHARE, CAUSE_SPRINGS, FLANK_DAMPING, FLANK_FREQUENCY, KNOWN_SHARE, KNOWN_SHARES,
    SPRING_DAMPING,
};
use crate::log::{Log, Quantity};
use crate::machine::{BeltModel, GearPlay, Machine};
use std::f64::consts::TAU;
use std::sync::Arc;

impl Site<'_, '_> {
    /// n² J_r, the rotor's inertia at the drive pulley, kg m².
    fn rotor(&self) -> f64 {
        rotor(&self.machine)
    }

    /// The machine with a rotor behind a gear, and true if its inertia was taken from the cart; `None` if there is
    /// nothing to split, or no rotor.
    fn split(&self) -> Option<(Machine, bool)> {
        let mut machine = self.machine.clone();
        let (r, inertia) = (machine.pulley_radius, self.inertia());
        if self.rotor() > KNOWN_SHARE * inertia {
            return Some((machine, false));
        }
        // n² J_r := s J,  M := M − Δ(n² J_r)/r²
        let moved = CAUSE_SHARE * inertia - self.rotor();
        machine.cart.mass -= moved / (r * r);
        let motor = &mut machine.drives[0].motor;
        motor.rotor_inertia = CAUSE_SHARE * inertia / (motor.gear_ratio * motor.gear_ratio);
        (self.is_free("cart.mass") && machine.cart.mass > KNOWN_SHARE * self.machine.cart.mass)
            .then_some((machine, true))
    }

    /// True if an independent rotor can be added: the case has neither one nor an elastic belt.
    fn is_stiff(&self) -> bool {
        self.machine.drives[0].motor.gear_play.is_none() && self.machine.belt.model == BeltModel::Rigid
    }

    /// The case with this gear and these parameters, with the sensor as logged and at the motor.
    fn geared(&self, machine: &Machine, play: GearPlay, keys: &[&str], telling: &'static str) -> Vec<Extended> {
        let mut machine = machine.clone();
        machine.drives[0].motor.gear_play = Some(play);
        let mut plan: Plan = self.plan.clone();
        plan.free.extend(keys.iter().map(|key| key.to_string()));
        plan.bounds.extend(keys.iter().map(|key| (key.to_string(), around(self, &machine, play, key))));
        let case = self.with(machine);
        let extended = |case: Case, at_motor: bool| Extended {
            at_motor,
            ..Extended::new(case, plan.clone(), Telling::Parameter(telling.into()))
        };
        let other = at_motor(&case);
        std::iter::once(extended(case, false)).chain(other.map(|case| extended(case, true))).collect()
    }
}

/// Bounds of a parameter of the gear: a distant value takes long to simulate, and is another than the one tried.
fn around(site: &Site, machine: &Machine, play: GearPlay, key: &str) -> [f64; 2] {
    let n = machine.drives[0].motor.gear_ratio;
    match key {
        "motor.rotor_inertia" => KNOWN_SHARES.map(|share| share * site.inertia() / (n * n)),
        "motor.gear_stiffness" => CAUSE_AROUND.map(|factor| factor * play.stiffness),
        "motor.gear_damping" => [0.0, CAUSE_AROUND[1] * play.damping],
        _ => [0.0, CAUSE_AROUND[1] * play.backlash],
    }
}

/// The case with positions and speeds assumed at the motor; `None` if no log has one.
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
pub(super) fn springs(site: &Site) -> Vec<Extended> {
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
pub(super) fn plays(site: &Site) -> Vec<Extended> {
    let Some((machine, is_split)) = site.split().filter(|_| site.is_stiff()) else { return Vec::new() };
    let mut keys = vec!["motor.backlash"];
    keys.extend(is_split.then_some("motor.rotor_inertia"));
    let Some(length) = site.position_deviation() else { return Vec::new() };
    let angle = length / machine.pulley_radius;
    let of = |gap: &f64| {
        let [stiffness, damping] = flank(site, &machine, FLANK_FREQUENCY, FLANK_DAMPING);
        let play = GearPlay { backlash: gap * angle, stiffness, damping };
        // Flanks that are too stiff or too soft leave residuals behind each crossing of the gap; free from the start
        // they end in other minima.
        let mut all = site.geared(&machine, play, &keys, "motor.backlash");
        for extended in &mut all {
            extended.later = ["motor.gear_stiffness", "motor.gear_damping"]
                .map(|key| (key.to_string(), around(site, &machine, play, key)))
                .to_vec();
        }
        all
    };
    CAUSE_GAPS.iter().flat_map(of).collect()
}

/// Stiffness and damping of a gear for this frequency, Hz, and damping ratio.
fn flank(site: &Site, machine: &Machine, frequency: f64, ratio: f64) -> [f64; 2] {
    let rotor = rotor(machine);
    // 1/J = 1/(n² J_r) + 1/(J − n² J_r),  k = ω² J,  c = 2 ζ √(k J)
    let reduced = rotor * (site.inertia() - rotor) / site.inertia();
    let stiffness = (TAU * frequency).powi(2) * reduced;
    [stiffness, 2.0 * ratio * (stiffness * reduced).sqrt()]
}

/// The machine without spring and play, with the inertia assigned as in the case.
pub(super) fn without(site: &Site, mut machine: Machine) -> Machine {
    let r = machine.pulley_radius;
    let motor = &mut machine.drives[0].motor;
    let own = site.machine.drives[0].motor;
    let moved = motor.gear_ratio * motor.gear_ratio * (motor.rotor_inertia - own.rotor_inertia);
    (motor.rotor_inertia, motor.gear_play) = (own.rotor_inertia, own.gear_play);
    machine.cart.mass += moved / (r * r);
    machine
}

/// n² J_r of a machine, kg m².
fn rotor(machine: &Machine) -> f64 {
    let motor = &machine.drives[0].motor;
    motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia
}

/// A spring in words.
pub(super) fn spring_words(site: &Site, extended: &Extended, found: &Fitted) -> Said {
    let Fitted { machine, .. } = found;
    let (r, rotor) = (machine.pulley_radius, rotor(machine));
    let stiffness = machine.drives[0].motor.gear_play.map_or(0.0, |play| play.stiffness);
    let reduced = rotor * (site.inertia() - rotor) / site.inertia();
    let frequency = (stiffness / reduced).sqrt() / TAU;
    let stiffness = shown(stiffness / (r * r), "N/m");
    let words = format!("a spring of {stiffness} between motor and cart ({})", shown(frequency, "Hz"));
    parted(extended, machine, words)
}

/// Play in words.
pub(super) fn play_words(_: &Site, extended: &Extended, found: &Fitted) -> Said {
    let gap = found.machine.drives[0].motor.gear_play.map_or(0.0, |play| play.backlash);
    let words = format!("play of {} between motor and cart", shown(gap * found.machine.pulley_radius, "m"));
    parted(extended, &found.machine, words)
}

/// Description of the gear with the split of the mass, the place of the sensor, and the keys to add.
fn parted(extended: &Extended, machine: &Machine, mut words: String) -> Said {
    let r = machine.pulley_radius;
    let motor = &machine.drives[0].motor;
    let is_parted = extended.plan.free.iter().any(|key| key == "motor.rotor_inertia");
    if is_parted {
        words.push_str(&format!(", {} of the mass before it", shown(rotor(machine) / (r * r), "kg")));
    }
    if extended.at_motor {
        words.push_str(", with the position read at the motor");
    }
    let mut keys = Vec::new();
    if let Some(play) = motor.gear_play {
        keys.push(format!("motor.gear_stiffness = \"{}\"", shown(play.stiffness, "N m/rad")));
        if play.backlash > 0.0 {
            keys.push(format!("motor.backlash = \"{}\"", shown(play.backlash, "rad")));
        }
    }
    if is_parted {
        keys.push(format!("motor.rotor_inertia = \"{}\"", shown(motor.rotor_inertia, "kg m^2")));
    }
    if extended.at_motor {
        keys.push("rotor_angle in place of the logged position".into());
    }
    Said { words, add: format!("add {}", keys.join(", ")) }
}
