//! Elements between the logged input and the torque of the motor: a limit of the amplifier, and the inductance of the
//! motor.

use super::extension::{Extended, Fitted, Said, Site, Telling, shown};
use crate::fit::limits::{CAUSE_AROUND, CAUSE_LAGS, CAUSE_LEAST_LIMIT, CAUSE_LIMITS};
use crate::machine::{AmplifierMode, DriveUnit, Machine};

/// Cases of these machines with one more free parameter.
fn with_parameter(site: &Site, key: &str, bounds: [f64; 2], machines: Vec<Machine>) -> Vec<Extended> {
    let mut plan = site.plan.clone();
    plan.free.push(key.into());
    plan.bounds.push((key.into(), bounds));
    let of = |machine| Extended::new(site.with(machine), plan.clone(), Telling::Parameter(key.into()));
    machines.into_iter().map(of).collect()
}

/// The limit of what the amplifier commands, its key and its unit.
fn limit_of(drive: &mut DriveUnit) -> (&'static str, &'static str, &mut Option<f64>) {
    let amplifier = &mut drive.amplifier;
    match amplifier.mode {
        AmplifierMode::Voltage | AmplifierMode::Position => {
            ("amplifier.voltage_limit", "V", &mut amplifier.voltage_limit)
        }
        AmplifierMode::Current => ("amplifier.current_limit", "A", &mut amplifier.current_limit),
    }
}

/// The greatest voltage or current that the logs ask of the amplifier.
fn asked(site: &Site) -> f64 {
    site.machine.drives[0].amplifier.gain.abs() * site.greatest_input()
}

/// A limit below what the logs ask for.
pub(super) fn limits(site: &Site) -> Vec<Extended> {
    let (mut drive, most) = (site.machine.drives[0], asked(site));
    let (key, _, own) = limit_of(&mut drive);
    if site.is_free(key) || own.is_some_and(|limit| limit < most) || most <= 0.0 {
        return Vec::new();
    }
    let limited = |share: &f64| {
        let mut machine = site.machine.clone();
        *limit_of(&mut machine.drives[0]).2 = Some(share * most);
        machine
    };
    with_parameter(site, key, [CAUSE_LEAST_LIMIT * most, most], CAUSE_LIMITS.iter().map(limited).collect())
}

pub(super) fn limit_words(site: &Site, _: &Extended, found: &Fitted) -> Said {
    let mut drive = site.machine.drives[0];
    let (key, unit, _) = limit_of(&mut drive);
    let (limit, most) = (shown(found.value, unit), shown(asked(site), unit));
    let words = format!("an amplifier that gives at most {limit} where the logs ask for up to {most}");
    Said { words, add: format!("add {key} = \"{limit}\", or log what the amplifier gives") }
}

/// The machine with the limit of the case.
pub(super) fn without_limit(site: &Site, mut machine: Machine) -> Machine {
    let mut own = site.machine.drives[0];
    *limit_of(&mut machine.drives[0]).2 = *limit_of(&mut own).2;
    machine
}

/// An inductance of all motors, with which the current follows the voltage late.
pub(super) fn inductances(site: &Site) -> Vec<Extended> {
    const KEY: &str = "motor.inductance";
    let lacks = |DriveUnit { amplifier, motor, .. }: &DriveUnit| {
        motor.inductance == 0.0 && amplifier.mode == AmplifierMode::Voltage && motor.resistance > 0.0
    };
    let machine = site.begins();
    if site.is_free(KEY) || !machine.drives.iter().all(lacks) {
        return Vec::new();
    }
    // L = R τ
    let inductances = CAUSE_LAGS.map(|lag| machine.drives[0].motor.resistance * lag);
    let with = |inductance: &f64| {
        let mut machine = machine.clone();
        machine.drives.iter_mut().for_each(|drive| drive.motor.inductance = *inductance);
        machine
    };
    let bounds = [CAUSE_AROUND[0] * inductances[0], CAUSE_AROUND[1] * inductances[CAUSE_LAGS.len() - 1]];
    with_parameter(site, KEY, bounds, inductances.iter().map(with).collect())
}

pub(super) fn inductance_words(site: &Site, _: &Extended, found: &Fitted) -> Said {
    let (inductance, lag) = (shown(found.value, "H"), found.value / site.machine.drives[0].motor.resistance);
    let words = format!("an inductance of {inductance}, with which the current lags by {}", shown(lag, "s"));
    Said { words, add: format!("add inductance = \"{inductance}\" to [motor], and motor.inductance to `free`") }
}

/// The machine without inductance.
pub(super) fn without_inductance(_: &Site, mut machine: Machine) -> Machine {
    machine.drives.iter_mut().for_each(|drive| drive.motor.inductance = 0.0);
    machine
}
