//! The table `[stepper]`: a motor that is commanded a position, with its driver.

use super::reader::{Field, Table};
use crate::error::{Error, Result};
use crate::machine::{Amplifier, AmplifierMode, DriveUnit, Machine, Motor, Stepper};
use crate::mechanism::State;
use crate::quantity::show;
use crate::signal::Signal;
use crate::solve::{Jump, first_jump};

/// The error where a motor that is commanded by voltage or current is needed: message, and sections to add.
const NO_MOTOR: [&str; 3] = [
    "this needs a motor that is commanded by voltage or current, and the case describes a stepper",
    "[motor] and [amplifier]",
    "log moves of the stepper, with long ramps at several speeds and changes of speed in between: `taut check` reports \
     what they determine, `taut fit` fits it; `taut plan` and `taut shape` choose its moves",
];

/// Refuses a stepper where a motor that is commanded by voltage or current is needed.
pub fn needs_motors(machine: &Machine) -> Result<()> {
    let [what, allowed, next] = NO_MOTOR;
    machine.stepper().map_or(Ok(()), |_| Err(Error::new(what).allowed(allowed).next(next)))
}

/// The same where a file has the table of a stepper.
pub(super) fn no_motor(root: &Table) -> Error {
    let ([what, allowed, next], field) = (NO_MOTOR, root.optional("stepper").unwrap_or_else(|| root.field.clone()));
    field.fail(what).allowed(allowed).next(next)
}

/// The stepper of an axis and its driver; none where there is no table of that name.
pub(super) fn drive(root: &Table) -> Result<Option<DriveUnit>> {
    let Some(field) = root.optional("stepper") else { return Ok(None) };
    if let Some(other) = ["motor", "drive", "amplifier"].iter().find_map(|key| root.optional(key)) {
        return Err(other
            .fail("a stepper is a motor with its driver: this would be a second one")
            .next("give either [stepper], or [motor] and [amplifier]"));
    }
    let table = field.table()?;
    table.check_keys(&["drive", "interpolate"], &[])?;
    let stepper = Stepper {
        steps_per_turn: steps_per_turn(&table)?,
        rated_current: table.number("rated_current")?,
        detent_torque: table.number("detent_torque")?,
        microsteps: table.number("microsteps")?,
        interpolate: table.optional("interpolate").map_or(Ok(false), |field| field.truth())?,
    };
    let drives = [("chopper", true), ("voltage", false)];
    let is_chopper = table.optional("drive").map_or(Ok(true), |field| field.choice(&drives))?;
    let mut motor = Motor {
        inductance: table.number("inductance")?,
        rotor_inertia: table.number("rotor_inertia")?,
        stepper: Some(stepper),
        ..Motor::brushed(0.0, table.number("resistance")?)
    };
    let torque = table.number("holding_torque")?;
    motor.set_holding_torque(torque);
    if stepper.detent_torque >= 0.25 * torque
        && let Some(field) = table.optional("detent_torque")
    {
        return Err(field
            .fail("with such a detent torque the motor also comes to rest between the commanded steps")
            .allowed(format!("below a quarter of the holding torque, {}", show(0.25 * torque, "N m"))));
    }
    let supply = table.number("supply")?;
    let most = motor.resistance * stepper.amplitude();
    if !is_chopper
        && supply > most * (1.0 + 1e-6)
        && let Some(field) = table.optional("supply")
    {
        return Err(field
            .fail(format!("a phase would carry {} at rest", show(supply / motor.resistance, "A")))
            .allowed(format!("up to {}: √2 times rated current and resistance", show(most, "V")))
            .next("lower the supply, add a resistor to the phases, or set drive = \"chopper\""));
    }
    let amplifier = Amplifier {
        voltage_limit: Some(supply),
        bandwidth: is_chopper.then_some(Stepper::CHOPPER_BANDWIDTH),
        ..Amplifier::ideal(AmplifierMode::Position, 1.0)
    };
    Ok(Some(DriveUnit { motor, amplifier }))
}

fn steps_per_turn(table: &Table) -> Result<f64> {
    let steps = table.number("steps_per_turn")?;
    match table.optional("steps_per_turn") {
        Some(field) if steps % f64::from(Stepper::STEPS_PER_TOOTH) != 0.0 => {
            Err(field.fail("a rotor tooth is four full steps").allowed("a multiple of four, such as 200 or 400"))
        }
        _ => Ok(steps),
    }
}

/// The error about a current at the start.
pub(super) fn begins_energised(current: &Field) -> Error {
    current.fail("the phases of a stepper begin with the currents that hold it where it is").next("leave it out")
}

/// Refuses commands that jump farther than a rotor follows; `field` is the input.
pub(super) fn check_commands(
    field: &Field,
    machine: &Machine,
    inputs: &[Signal],
    (initial, until): (&State, f64),
) -> Result<()> {
    let mechanism = machine.mechanism();
    // A rotor begins where its pulley does.
    let start = mechanism.begun(initial);
    let Some(Jump { drive, time, by, most }) = first_jump(&mechanism, inputs, &start, until) else { return Ok(()) };
    let motor = mechanism.drives[drive].label.name;
    let whose = if inputs.len() > 1 { format!(" of the {motor}") } else { String::new() };
    Err(field
        .fail(format!("the command{whose} jumps by {} at {}", show(by, "m"), show(time, "s")))
        .allowed(format!("up to {} at once, two full steps: a rotor does not follow more", show(most, "m")))
        .next("let it grow, with ramp, table or sine"))
}
