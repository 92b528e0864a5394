//! Overview of a stepper: its constants, the torque that its field loses it at, and the largest acceleration.

use super::{Group, Note};
use crate::machine::rigid::Rigid;
use crate::machine::{Amplifier, AmplifierMode, Machine, Motor};
use crate::number::engineering;
use crate::reach::pull_out::{PullOut, short_supply};
use crate::reach::quickest::within_pull_out;
use std::f64::consts::PI;

/// Speeds at the belt that pull-out torques are given at, m/s.
const SPEEDS: [f64; 7] = [0.01, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2];

/// The machine with a motor that nothing holds.
pub(super) fn without_field(machine: &Machine) -> Machine {
    let mut free = machine.clone();
    for unit in &mut free.drives {
        unit.motor = Motor { back_emf_constant: 0.0, stepper: None, ..unit.motor };
        unit.amplifier = Amplifier::ideal(AmplifierMode::Current, 1.0);
    }
    free
}

pub(super) fn drive(machine: &Machine) -> Group {
    let mut group = Group::new("drive", "Stepper");
    let (motor, r) = (&machine.drives[0].motor, machine.pulley_radius);
    let (Some(stepper), Some(torque)) = (&motor.stepper, motor.holding_torque()) else { return group };
    group.add("holding_torque", "holding torque", torque, "N m").how("both phases at rated current");
    group.add("holding_force", "holding force at the belt", torque / r, "N");
    group.add("torque_constant", "torque constant of a phase", motor.torque_constant, "N m/A").how("T_h/(√2 I)");
    group.add("resistance", "resistance of a phase", motor.resistance, "ohm");
    group.add("time_constant", "time constant of a phase", motor.inductance / motor.resistance, "s").how("L/R");
    group.add("travel_per_turn", "travel per turn of the motor", 2.0 * PI * r, "m");
    group.add("travel_per_step", "travel per full step", 2.0 * PI * r / stepper.steps_per_turn, "m");
    group.add("travel_per_microstep", "travel per microstep", stepper.microstep() * r, "m");
    let stiffness = stepper.teeth() * (torque - 4.0 * stepper.detent_torque) / (r * r);
    group.add("field_stiffness", "stiffness of the field at the belt", stiffness, "N/m").how("N (T_h − 4 T_d)/r²");
    let hertz = (stiffness / Rigid::new(machine).mass).sqrt() / (2.0 * PI);
    group.add("field_resonance", "resonance of all on the field", hertz, "Hz").how("as one mass");
    group
}

/// A supply that does not suffice for the rated current.
pub(super) fn supply(machine: &Machine) -> Option<Note> {
    short_supply(machine).map(|text| Note { code: Note::SUPPLY, text })
}

pub(super) fn limits(machine: &Machine) -> Option<Group> {
    let pull_out = PullOut::new(machine)?;
    let mut group = Group::new("limits", "Pull-out torque");
    let r = machine.pulley_radius;
    for (number, speed) in SPEEDS.into_iter().enumerate() {
        let name = format!("at {}", engineering(speed, "m/s", 4));
        let row = group.add(format!("pull_out_torque{number}"), name, pull_out.torque(speed / r), "N m");
        row.how(format!("{:.0} full steps/s", pull_out.steps_per_second(speed / r)));
    }
    let slides = machine.travels().enumerate().filter_map(|(slide, (_, travel))| {
        travel.and_then(|travel| Some((within_pull_out(machine, slide, 0.0)?, travel.max - travel.min)))
    });
    if let Some((most, way)) = slides.min_by(|a, b| a.0.total_cmp(&b.0)) {
        group
            .add("largest_acceleration", "largest acceleration over the travel", most, "m/s^2")
            .how("half of it up, half down, against friction, as one mass");
        group.add("largest_acceleration_speed", "peak speed", (most * way).sqrt(), "m/s");
    }
    Some(group)
}
