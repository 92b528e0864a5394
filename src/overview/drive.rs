//! Drives: their motors, the force per input, and the input at which the load begins to move.

use super::direction::Direction;
use super::{Group, Note, stepper, told};
use crate::machine::{AmplifierMode, Machine, Motor};
use std::f64::consts::PI;

/// K_t and K_e of one motor are one number; beyond this factor one of them is doubtful.
const APART: f64 = 1.25;

/// Beyond this share the breakaway backward differs from that forward.
const DIFFERS: f64 = 1e-3;

pub(super) fn drives(machine: &Machine, directions: &[Direction], notes: &mut Vec<Note>) -> Group {
    if machine.stepper().is_some() {
        return stepper::drive(machine);
    }
    let one = machine.drives.len() == 1;
    let mut group = Group::new("drive", if one { "Drive" } else { "Drives" });
    let alike = machine.drives.iter().all(|unit| *unit == machine.drives[0]);
    for (unit, side) in machine.drives.iter().zip(machine.geometry().sides()).take(if alike { 1 } else { usize::MAX }) {
        let prefix = if alike { String::new() } else { format!("{side}_") };
        let before = group.rows.len();
        motor_rows(&mut group, &prefix, &unit.motor);
        let amplifier = (unit.amplifier.mode, unit.amplifier.gain);
        let (force, drag) = drive_at_belt(&unit.motor, amplifier, machine.pulley_radius);
        let per_input = if unit.amplifier.mode == AmplifierMode::Voltage { "N/V" } else { "N/A" };
        group.add(format!("{prefix}force_per_input"), "force at the belt per input", force, per_input);
        if drag > 0.0 {
            let name = if one { "drag of the drive at the cart" } else { "drag at the belt" };
            let how = if unit.motor.is_simple { "" } else { "of the back-EMF" };
            group.add(format!("{prefix}drag"), name, drag, "N s/m").how(how);
        }
        let travel = 2.0 * PI * machine.pulley_radius / unit.motor.gear_ratio;
        let name = if one { "travel per turn of the motor" } else { "belt per turn of the motor" };
        group.add(format!("{prefix}travel_per_turn"), name, travel, "m");
        if !alike {
            group.rows[before..].iter_mut().for_each(|row| row.name = format!("{side}: {}", row.name));
        }
    }
    for direction in directions {
        breakaway(&mut group, machine, direction, notes);
    }
    group
}

/// The input at which all that moves in a direction breaks away, given to all drives that move it.
fn breakaway(group: &mut Group, machine: &Machine, direction: &Direction, notes: &mut Vec<Note>) {
    let movers: Vec<_> = direction.movers.iter().map(|drive| &machine.drives[*drive]).collect();
    let mode = movers[0].amplifier.mode;
    let force = |unit: &&crate::machine::DriveUnit| {
        drive_at_belt(&unit.motor, (unit.amplifier.mode, unit.amplifier.gain), machine.pulley_radius).0
    };
    let force: f64 = movers.iter().map(force).sum();
    if force <= 0.0 || movers.iter().any(|unit| unit.amplifier.mode != mode) {
        return;
    }
    let (name, unit) = match mode {
        AmplifierMode::Voltage => ("breakaway voltage", "V"),
        _ => ("breakaway current", "A"),
    };
    let [forward, backward] = [1.0, -1.0].map(|side| machine.breakaway(direction.number, side, 0.0) / force);
    let row = group.add(direction.key("breakaway_input"), direction.words(name), forward, unit);
    match direction.movers[..] {
        [_] if machine.drives.len() == 1 => row.how("of all bodies together"),
        [drive] => row.how(format!("of the {} drive", machine.geometry().drives[drive].side())),
        _ => row.how("of both drives alike"),
    };
    if (backward - forward).abs() > DIFFERS * forward.abs() {
        let name = direction.words("the same backward");
        group.add(direction.key("breakaway_input") + "_backward", name, backward, unit);
    }
    if forward < 0.0 || backward < 0.0 {
        let text = format!("friction does not hold the load: at rest {} begins to slide", direction.name);
        notes.push(Note { code: "load-slides", text });
    }
}

/// Rows of a motor's constants, whose keys begin with `prefix`.
fn motor_rows(group: &mut Group, prefix: &str, motor: &Motor) {
    if motor.is_simple {
        return;
    }
    group.add(format!("{prefix}torque_constant"), "torque constant", motor.torque_constant, "N m/A");
    group.add(format!("{prefix}back_emf_constant"), "back-EMF constant", motor.back_emf_constant, "V s/rad");
    group.add(format!("{prefix}resistance"), "resistance", motor.resistance, "ohm");
}

/// Force per unit of input at the belt, and force per speed that the back-EMF takes, N per V or A, and N s/m.
fn drive_at_belt(motor: &Motor, amplifier: (AmplifierMode, f64), r: f64) -> (f64, f64) {
    let (mode, gain) = amplifier;
    let n = motor.gear_ratio;
    let per_ampere = motor.gear_efficiency * n * motor.torque_constant / r;
    match mode {
        AmplifierMode::Current => (gain.abs() * per_ampere, 0.0),
        AmplifierMode::Position => (0.0, 0.0),
        AmplifierMode::Voltage => {
            // F = η n K_t / (R r) (u − K_e n v / r)
            let per_volt = per_ampere / motor.resistance;
            (gain.abs() * per_volt, per_volt * n * motor.back_emf_constant / r)
        }
    }
}

/// Notes about K_t and K_e that are no one motor's, once for motors that are alike.
pub(super) fn constants(machine: &Machine, notes: &mut Vec<Note>) {
    let mut before: Vec<[f64; 2]> = Vec::new();
    for (unit, side) in machine.drives.iter().zip(machine.geometry().sides()) {
        let Motor { torque_constant: k_t, back_emf_constant: k_e, is_simple, .. } = unit.motor;
        let is_doubtful = !is_simple && k_t > 0.0 && k_e > 0.0 && !(1.0 / APART..APART).contains(&(k_t / k_e));
        if !is_doubtful || before.contains(&[k_t, k_e]) {
            continue;
        }
        before.push([k_t, k_e]);
        let whose = if machine.drives.len() == 1 { String::new() } else { format!("{side} drive: ") };
        let text = format!(
            "{whose}K_t = {} and K_e = {} of one motor must be equal in SI units: one of them, or its unit, is doubtful",
            told(k_t, "N m/A"),
            told(k_e, "V s/rad")
        );
        notes.push(Note { code: "motor-constants", text });
    }
}
