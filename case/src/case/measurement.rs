//! The table of the recorder.

use super::reader::{Field, Table};
use super::{Experiment, MOST_SAMPLES};
use crate::error::Result;
use crate::machine::{Channel, EncoderPlace, Machine, Measurement, Quantity};
use crate::parameter;
use crate::quantity::{rounded, show};

/// Largest jitter, as a share of the interval: samples keep their order.
const MOST_JITTER: f64 = 0.25;

pub(super) fn measurement(root: &Table, machine: &Machine, experiments: &[Experiment]) -> Result<Option<Measurement>> {
    let Some(field) = root.optional("measurement") else { return Ok(None) };
    let table = field.table()?;
    table.check_keys(&[], &[])?;
    let mut channels = Vec::new();
    for &quantity in machine.quantities() {
        if let Some(field) = table.optional(quantity.name()) {
            channels.push(channel(&field, quantity, machine)?);
        }
    }
    if channels.is_empty() && machine.encoder.is_none() {
        return Err(field
            .fail("without [encoder] and without a quantity nothing is recorded")
            .next("add [encoder], or a quantity such as motor_current = { step = \"10 mA\", noise = \"5 mA\" }"));
    }
    let measurement = Measurement {
        every: table.number_if_given("every")?,
        delay: table.number("delay")?,
        jitter: table.number("jitter")?,
        seed: table.seed()?,
        channels,
    };
    for experiment in experiments {
        fits(&table, &measurement, experiment)?;
    }
    Ok(Some(measurement))
}

/// A quantity and its converter.
fn channel(field: &Field, quantity: Quantity, machine: &Machine) -> Result<Channel> {
    let table = field.table()?;
    table.check_keys(&[], &[])?;
    let counted = machine.encoder.map(|encoder| match encoder.at {
        EncoderPlace::Motor | EncoderPlace::DrivePulley => Quantity::DriveAngle,
        EncoderPlace::Cart => Quantity::CartPosition,
    });
    if counted == Some(quantity) {
        let others = parameter::names_in("measurement");
        let others =
            machine.quantities().iter().map(|q| q.name()).filter(|q| *q != quantity.name() && others.contains(q));
        return Err(field
            .fail("the encoder gives this quantity already")
            .allowed(others.collect::<Vec<_>>().join(", "))
            .next("leave it out, or put the encoder elsewhere"));
    }
    let step = table.number_if_given("step")?;
    let range = table.number_if_given("range")?;
    if let (Some(step), Some(range), Some(field)) = (step, range, table.optional("range"))
        && range < step
    {
        let (step, range) = (show(step, quantity.unit()), show(range, quantity.unit()));
        return Err(field
            .fail(format!("a range of {range} is less than one step"))
            .allowed(format!("at least the step of {step}"))
            .next("check the two values: most converters have hundreds of steps on each side of zero"));
    }
    Ok(Channel { quantity, step, noise: table.number("noise")?, range })
}

/// Checks that an experiment can be recorded like this.
fn fits(table: &Table, measurement: &Measurement, experiment: &Experiment) -> Result<()> {
    let Experiment { name, until, .. } = experiment;
    let at = |key: &str| table.optional(key).unwrap_or_else(|| table.field.clone());
    let every = measurement.every.unwrap_or(experiment.every);
    if every > *until {
        let what = format!("an interval of {} is longer than the run \"{name}\"", show(every, "s"));
        return Err(at("every").fail(what).allowed(format!("up to {}", show(*until, "s"))));
    }
    if until / every > MOST_SAMPLES {
        return Err(at("every")
            .fail(format!("this makes {} samples of the run \"{name}\"", rounded(until / every)))
            .allowed(format!("up to {} samples", rounded(MOST_SAMPLES)))
            .next("take a longer interval"));
    }
    if measurement.delay > *until {
        return Err(at("delay")
            .fail(format!(
                "a delay of {} is longer than the run \"{name}\": all its samples would be older than the motion",
                show(measurement.delay, "s")
            ))
            .allowed(format!("up to {}", show(*until, "s"))));
    }
    if measurement.jitter > MOST_JITTER * every {
        let what = format!(
            "a jitter of {} is too large for samples every {}",
            show(measurement.jitter, "s"),
            show(every, "s")
        );
        return Err(at("jitter")
            .fail(what)
            .allowed(format!("up to a quarter of the interval: {}", show(MOST_JITTER * every, "s")))
            .next("it is a standard deviation; a constant lag is a delay"));
    }
    Ok(())
}
