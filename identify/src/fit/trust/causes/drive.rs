//! A number of one of several drives that is not that of the case: the constants of its motor, its resistance, or the
//! gain of its amplifier.
//!
//! In voltage mode the torque on the pulley is
//!
//! ```text
//! τ = n K_t (g u − n K_e φ̇)/R
//! ```
//!
//! A factor f on both constants multiplies the part of u by f and that of φ̇ by f², a factor f on K_t alone, or 1/f on
//! R, both parts by f, and a factor f on the gain only the part of u. The logs thus tell these three apart as far as
//! they tell the parts apart, but never K_t alone from R. In current mode, τ = n K_t g u, they tell none apart.

use super::extension::{Extended, Fitted, Said, Site, Telling, shown};
use crate::fit::limits::DRIVE_FACTORS;
use crate::machine::{AmplifierMode, DriveAt};
use crate::parameter::{self, Free};

const TORQUE: &str = "motor.torque_constant";
const BACK: &str = "motor.back_emf_constant";
const RESISTANCE: &str = "motor.resistance";
const GAIN: &str = "amplifier.gain";

/// Each of these numbers of each drive, with the others as in the case.
pub(super) fn numbers(site: &Site) -> Vec<Extended> {
    let machine = site.begins();
    let drives = machine.geometry().drives.iter().zip(&machine.drives);
    let of = |(at, unit): (&DriveAt, &crate::machine::DriveUnit)| {
        let sets: &[&[&str]] = match unit.amplifier.mode {
            AmplifierMode::Voltage => &[&[TORQUE, BACK], &[RESISTANCE], &[GAIN]],
            AmplifierMode::Current => &[&[TORQUE]],
            AmplifierMode::Position => &[],
        };
        let with = |set: &&[&str]| with(site, set.iter().map(|number| format!("{}{number}", at.key)).collect());
        sets.iter().filter(|set| !set.iter().any(|own| site.is_free(own))).filter_map(with).collect::<Vec<_>>()
    };
    drives.flat_map(of).collect()
}

/// The case with these keys free, which keep their ratio; `None` if one of them is free already, or zero.
fn with(site: &Site, keys: Vec<String>) -> Option<Extended> {
    let machine = site.begins();
    let is_open = |key: &String| !site.is_free(key) && parameter::value(machine, key).is_some_and(|value| value != 0.0);
    if !keys.iter().all(is_open) {
        return None;
    }
    let (mut plan, name) = (site.plan.clone(), keys.join(" = "));
    let start = Free::new(machine, &name, &[], &[]).ok()?.start;
    plan.bounds.push((name.clone(), DRIVE_FACTORS.map(|factor| factor * start)));
    match &keys[..] {
        [key] => plan.free.push(key.clone()),
        _ => plan.tied.push(keys),
    }
    Some(Extended::new(site.with(machine.clone()), plan, Telling::Differs(name)))
}

/// The number in words, as a multiple of that of the case.
pub(super) fn words(site: &Site, extended: &Extended, found: &Fitted) -> Said {
    let name = match &extended.telling {
        Telling::Differs(name) => name.as_str(),
        _ => "",
    };
    let drives = site.case.machine.geometry().drives;
    let label = drives.iter().find(|at| name.starts_with(at.key)).map_or("drive", |at| at.label.name);
    let given = Free::new(&site.case.machine, name, &[], &[]).map_or(found.value, |free| free.start);
    let factor = found.value / given;
    let times = shown(factor, "");
    let of_case = "that of the case";
    let words = match () {
        () if name.contains(BACK) => {
            format!("a motor of the {label} whose constants K_t and K_e are {times} times those of the case")
        }
        () if name.contains(RESISTANCE) => format!(
            "a resistance of the motor of the {label} that is {times} times {of_case} (or K_t alone that is {} times \
             {of_case})",
            shown(1.0 / factor, "")
        ),
        () if name.contains(GAIN) => {
            format!("a gain of the amplifier of the {label} that is {times} times {of_case}")
        }
        () => format!("K_t, or the gain of the amplifier, of the {label} that is {times} times {of_case}"),
    };
    let keys: Vec<String> = name.split(" = ").map(|key| format!("\"{key}\"")).collect();
    let add = match keys.len() {
        1 => format!("check this drive, and add {name} to `free`"),
        _ => format!("check this drive, and add [{}] to `tied`", keys.join(", ")),
    };
    Said { words, add }
}
