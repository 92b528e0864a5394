//! Elements between the logged input and the torque of the motor: a limit of the amplifier, and the inductance of the
//! motor.

use super::extension::{Extended, Fitted, Said, Site, Telling, shown};
use crate::fit::limits::{CAUSE_AROUND, CAUSE_LAGS, CAUSE_LEAST_LIMIT, CAUSE_LIMITS, LEVEL_LEAST, LEVEL_MOST};
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

/// The greatest voltage or current that the logs ask of the amplifier of a drive.
fn asked(site: &Site, drive: usize) -> f64 {
    site.machine.drives[drive].amplifier.gain.abs() * site.greatest_input(drive)
}

/// True if the input of a drive has values well below its greatest one: otherwise a limit is a factor on all of them.
fn has_levels(site: &Site, drive: usize) -> bool {
    let most = site.greatest_input(drive);
    let values = site.found.problem.runs.iter().flat_map(|run| &run.logged[drive]);
    values.map(|input| input.abs()).any(|input| input > LEVEL_LEAST * most && input < LEVEL_MOST * most)
}

/// The drives whose amplifiers have the limit with this key: one of several, or all.
fn limited(site: &Site, key: &str) -> Vec<usize> {
    let geometry = site.machine.geometry();
    let own = geometry.drives.iter().position(|at| geometry.drives.len() > 1 && key.starts_with(at.key));
    own.map_or_else(|| (0..geometry.drives.len()).collect(), |drive| vec![drive])
}

/// A limit below what the logs ask for: of each drive, and of all together.
pub(super) fn limits(site: &Site) -> Vec<Extended> {
    let machine = site.begins();
    let drives = machine.geometry().drives;
    let key_of = |drive: usize| limit_of(&mut machine.drives[drive].clone()).0;
    let mut keys = vec![key_of(0).to_string()];
    if drives.len() > 1 {
        let is_common = (0..drives.len()).all(|drive| key_of(drive) == keys[0]);
        keys.retain(|_| is_common);
        keys.extend(drives.iter().enumerate().map(|(drive, at)| format!("{}{}", at.key, key_of(drive))));
    }
    keys.iter().flat_map(|key| limits_of(site, key)).collect()
}

/// Several limits with this key; none if they are free or given, or nothing else than a factor.
fn limits_of(site: &Site, key: &str) -> Vec<Extended> {
    let (machine, drives) = (site.begins(), limited(site, key));
    let most = drives.iter().map(|&drive| asked(site, drive)).fold(0.0, f64::max);
    let is_given = |&drive: &usize| limit_of(&mut machine.drives[drive].clone()).2.is_some_and(|limit| limit < most);
    let is_factor = |&drive: &usize| !machine.has_one_coordinate() && !has_levels(site, drive);
    let is_free = drives.iter().any(|&drive| {
        let [own, common] = [machine.geometry().drives[drive].key, ""];
        let name = limit_of(&mut machine.drives[drive].clone()).0;
        site.is_free(&format!("{own}{name}")) || site.is_free(&format!("{common}{name}"))
    });
    if is_free || most <= 0.0 || drives.iter().any(is_given) || drives.iter().all(is_factor) {
        return Vec::new();
    }
    let with = |share: &f64| {
        let mut machine = machine.clone();
        drives.iter().for_each(|&drive| *limit_of(&mut machine.drives[drive]).2 = Some(share * most));
        machine
    };
    with_parameter(site, key, [CAUSE_LEAST_LIMIT * most, most], CAUSE_LIMITS.iter().map(with).collect())
}

pub(super) fn limit_words(site: &Site, extended: &Extended, found: &Fitted) -> Said {
    let Telling::Parameter(key) = &extended.telling else { return Said::default() };
    let drives = limited(site, key);
    let unit = limit_of(&mut site.machine.drives[drives[0]].clone()).1;
    let most = drives.iter().map(|&drive| asked(site, drive)).fold(0.0, f64::max);
    let (limit, most) = (shown(found.value, unit), shown(most, unit));
    let whose = match (site.machine.drives.len(), &drives[..]) {
        (1, _) => "an amplifier that gives".to_string(),
        (_, [drive]) => {
            format!("an amplifier of the {} that gives", site.machine.geometry().drives[*drive].label.name)
        }
        _ => "amplifiers of all drives that give".to_string(),
    };
    let words = format!("{whose} at most {limit} where the logs ask for up to {most}");
    Said { words, add: format!("add {key} = \"{limit}\", or log what the amplifier gives") }
}

/// The machine with the limits of the case.
pub(super) fn without_limit(site: &Site, mut machine: Machine) -> Machine {
    for (unit, own) in machine.drives.iter_mut().zip(&site.machine.drives) {
        *limit_of(unit).2 = *limit_of(&mut own.clone()).2;
    }
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
