//! Feed-forward gains for drives and controllers of other makers, with their units.
//!
//! The axis is one mass along the belt, M ÿ + b ẏ + F sgn ẏ = κ η i with κ = n K_t/r, fed by V = R i + L di/dt + n K_e
//! ẏ/r ([`Rigid`]). So, forward,
//!
//! | system | gain | unit | value |
//! |---|---|---|---|
//! | WPILib, in metres | kS, kV, kA | V, V/(m/s), V/(m/s²) | R F/(κ η), R b/(κ η) + n K_e/r, R M/(κ η) |
//! | LinuxCNC, mm, output in V | FF1, FF2, FF3 | V s/mm, V s²/mm, V s³/mm | kV, kA and L M/(κ η), over 1000 |
//! | LinuxCNC, mm, output in A | FF1, FF2 | A s/mm, A s²/mm | b and M over κ η, over 1000 |
//! | ODrive | `config.inertia` | N m/(turn/s²) | 2π M (r/n)²/η |
//! | ODrive | torque with the speed; against dry friction | N m/(turn/s), N m | 2π b (r/n)²/η, F r/(n η) |
//! | Beckhoff AX8000 3140:07, TwinCAT CNC P-AXIS-00391 | load inertia | kg m² | M (r/n)² less the rotor's; with it |
//!
//! Sources: docs.wpilib.org, "Feedforward Control in WPILib", `SimpleMotorFeedforward`: V = kS sgn v + kV v + kA a.
//! LinuxCNC, pid(9): FF1, FF2, FF3 times the first three derivatives of the command. ODrive's firmware, velocity ramp
//! of the controller: the torque is `inertia` times the change of the speed in turn/s per second, in N m. Beckhoff
//! Information System, AX8xxx object 3140:07 "Load inertia/mass", TF5200 P-AXIS-00391 "Load inertia": the total at the
//! motor shaft.

use crate::machine::rigid::Rigid;
use crate::machine::{AmplifierMode, Machine};
use crate::signal::profile::Reference;
use std::f64::consts::PI;

/// A gain of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct DriveGain {
    /// Whose.
    pub system: &'static str,
    /// Name in the manual of the drive.
    pub name: &'static str,
    /// Value in `unit`.
    pub value: f64,
    /// Unit of the value.
    pub unit: &'static str,
}

/// Gains for an axis moving forward; in volts in voltage mode. None for several drives, or for a stepper, whose command
/// is a position.
pub fn drive_gains(machine: &Machine) -> Vec<DriveGain> {
    if machine.drives.len() > 1 || machine.stepper().is_some() {
        return Vec::new();
    }
    let rigid = Rigid::new(machine);
    let motor = &machine.drives[0].motor;
    // Voltage or current at the motor, without the amplifier's gain, which belongs to the drive.
    let gain = machine.drives[0].amplifier.gain;
    let friction = rigid.coulomb[0];
    let command = |force: f64, rate: f64, motion: Reference| rigid.command(force, rate, &motion) * gain;
    let (s, v) = (command(friction, 0.0, Reference::default()), command(rigid.viscous[0], 0.0, Reference::steady(1.0)));
    let a = command(rigid.mass, 0.0, Reference { acceleration: 1.0, ..Reference::default() });
    let one = |system, name, value, unit| DriveGain { system, name, value, unit };
    let mut all = match machine.drives[0].amplifier.mode {
        AmplifierMode::Voltage => {
            let jerk = command(0.0, rigid.mass, Reference { jerk: 1.0, ..Reference::default() });
            vec![
                one("WPILib", "kS", s, "V"),
                one("WPILib", "kV", v, "V/(m/s)"),
                one("WPILib", "kA", a, "V/(m/s^2)"),
                one("LinuxCNC", "FF1", 1e-3 * v, "V/(mm/s)"),
                one("LinuxCNC", "FF2", 1e-3 * a, "V/(mm/s^2)"),
                one("LinuxCNC", "FF3", 1e-3 * jerk, "V/(mm/s^3)"),
            ]
        }
        _ => {
            vec![one("LinuxCNC", "FF1", 1e-3 * v, "A/(mm/s)"), one("LinuxCNC", "FF2", 1e-3 * a, "A/(mm/s^2)")]
        }
    };
    // At the motor's shaft: a displacement x is an angle n x/r.
    let arm = machine.pulley_radius / motor.gear_ratio;
    let loss = motor.gear_efficiency;
    let total = rigid.mass * arm * arm;
    all.extend([
        // What the rotor takes does not pass through the gear.
        one(
            "ODrive",
            "config.inertia",
            2.0 * PI * ((total - motor.rotor_inertia) / loss + motor.rotor_inertia),
            "Nm/(turn/s^2)",
        ),
        one("ODrive", "input_torque per input_vel", 2.0 * PI * rigid.viscous[0] * arm * arm / loss, "Nm/(turn/s)"),
        one("ODrive", "input_torque against dry friction", friction * arm / loss, "Nm"),
        one("Beckhoff", "3140:07 load inertia", total - motor.rotor_inertia, "kg m^2"),
        one("Beckhoff", "P-AXIS-00391 load", total, "kg m^2"),
    ]);
    all
}
