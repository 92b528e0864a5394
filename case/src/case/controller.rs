//! The controller's table.

use super::reader::{Field, Table};
use super::suggestion;
use crate::design::*;
use crate::error::Result;
use crate::machine::{AmplifierMode, EncoderPlace, Machine};

/// The structures by their keys; exactly one of them.
const STRUCTURES: [&str; 5] = ["pid", "cascade", "state_feedback", "sliding_mode", "fuzzy"];

/// Most samples that a delay may take.
const MOST_DELAY: f64 = 1000.0;

pub(super) fn controller(root: &Table, machine: &Machine) -> Result<Option<Design>> {
    let Some(field) = root.optional("controller") else { return Ok(None) };
    let input_unit = if machine.drives[0].amplifier.mode == AmplifierMode::Current { "A" } else { "V" };
    let field = Field { input_unit, ..field };
    let table = field.table()?;
    table.check_keys(&[], &[])?;
    let every = table.number("every")?;
    let delay = table.number("delay")?;
    if delay > MOST_DELAY * every
        && let Some(field) = table.optional("delay")
    {
        return Err(field
            .fail(format!("a delay of {} samples", (delay / every).round()))
            .allowed(format!("up to {MOST_DELAY} samples")));
    }
    let structure = structure(&table, machine, (every, delay))?;
    Ok(Some(Design {
        every,
        delay,
        limit: table.number_if_given("limit")?,
        feed_forward: feed_forward(&table, &structure, machine)?,
        structure,
        disturbance_observer: match table.optional("disturbance_observer") {
            None => None,
            Some(field) => {
                let table = field.table()?;
                table.check_keys(&[], &[])?;
                Some(DisturbanceObserver { bandwidth: table.number("bandwidth")? })
            }
        },
        filters: filters(&table)?,
        shaper: shaper(&table)?,
    }))
}

fn structure(table: &Table, machine: &Machine, (every, delay): (f64, f64)) -> Result<Structure> {
    let given: Vec<Field> = STRUCTURES.iter().filter_map(|key| table.optional(key)).collect();
    let field = match &given[..] {
        [field] => field.clone(),
        [] => {
            return Err(table
                .field
                .fail("the structure is not said")
                .allowed(STRUCTURES.join(", "))
                .next(format!("add for example {}", suggestion::pid(machine, every, delay))));
        }
        [first, second, ..] => {
            return Err(second
                .fail(format!("the structure is {} already", first.key()))
                .next("keep one of the two; each controller has a case of its own"));
        }
    };
    let own = field.table()?;
    let others: &[&'static str] = if field.key() == "fuzzy" { &["rules"] } else { &[] };
    own.check_keys(others, &[])?;
    Ok(match field.key() {
        "pid" => Structure::Pid(Pid {
            proportional: match own.number_if_given("proportional")? {
                Some(value) => value,
                None => {
                    let such_as = || format!("add for example {}", suggestion::proportional(machine, every, delay));
                    own.number("proportional").map_err(|error| error.next(such_as()))?
                }
            },
            integral: own.number("integral")?,
            derivative: own.number("derivative")?,
            filter: own.number("filter")?,
            reference_speed: own.number("reference_speed")?,
            tracking: own.number("tracking")?,
        }),
        "cascade" => Structure::Cascade(cascade(&field, machine)?),
        "state_feedback" => Structure::StateFeedback(StateFeedback {
            position: own.number("position")?,
            speed: own.number_if_given("speed")?,
            integral: own.number_if_given("integral")?,
            command: own.number("command")?,
            disturbance: own.number("disturbance")?,
            noise: own.number("noise")?,
        }),
        "sliding_mode" => Structure::SlidingMode(SlidingMode {
            bandwidth: own.number("bandwidth")?,
            reaching: own.number("reaching")?,
            boundary: own.number("boundary")?,
            integral: own.number("integral")?,
            filter: own.number("filter")?,
        }),
        "fuzzy" => Structure::Fuzzy(fuzzy(&own)?),
        _ => return Err(field.unread()),
    })
}

fn cascade(field: &Field, machine: &Machine) -> Result<Cascade> {
    let current = match field.table()?.optional("current") {
        None => None,
        Some(current) if machine.drives[0].amplifier.mode == AmplifierMode::Current => {
            return Err(current
                .fail("the amplifier commands the current itself: there is no loop to close")
                .next("leave it out, or set amplifier.mode = \"voltage\""));
        }
        Some(current) => {
            let table = current.table()?;
            table.check_keys(&[], &[])?;
            Some(CurrentLoop {
                proportional: table.number("proportional")?,
                integral: table.number("integral")?,
                limit: table.number_if_given("limit")?,
            })
        }
    };
    // With a current loop the speed loop asks for a current.
    let input_unit = if current.is_some() { "A" } else { field.input_unit };
    let table = Field { input_unit, ..field.clone() }.table()?;
    Ok(Cascade {
        position: table.number("position")?,
        speed: table.number("speed")?,
        speed_integral: table.number("speed_integral")?,
        filter: table.number("filter")?,
        reference_speed: table.number("reference_speed")?,
        tracking: table.number("tracking")?,
        current,
    })
}

fn fuzzy(table: &Table) -> Result<Fuzzy> {
    let (command, slope) = (table.optional("command"), table.optional("slope"));
    let (value, incremental) = match (&command, &slope) {
        (Some(command), None) => (command.number()?, false),
        (None, Some(slope)) => (slope.number()?, true),
        (Some(_), Some(slope)) => {
            return Err(slope
                .fail("a rule gives the command, or its change, not both")
                .next("keep command (PD) or slope (PI)"));
        }
        (None, None) => return Err(table.missing("command", "for example command = \"5 V\" (PD), or slope (PI)")),
    };
    let field = table.required("rules", "for example rules = [[-1, -0.5, 0], [-0.5, 0, 0.5], [0, 0.5, 1]]")?;
    let rows = field.filled_list()?;
    let size = rows.len();
    let allowed = "3, 5, 7 or 9 rows of as many values: by error, and in each row by its rate";
    if !(3..=9).contains(&size) || size.is_multiple_of(2) {
        return Err(field.fail(format!("the table has {size} rows")).allowed(allowed));
    }
    let mut rules = Vec::with_capacity(size);
    for row in &rows {
        let values = row.filled_list()?;
        if values.len() != size {
            return Err(row.fail(format!("this row has {} values", values.len())).allowed(allowed));
        }
        let value = |field: &Field| field.clone().named("controller.fuzzy.rule").number();
        rules.push(values.iter().map(value).collect::<Result<Vec<_>>>()?);
    }
    Ok(Fuzzy {
        error: table.number("error")?,
        rate: table.number("rate")?,
        command: value,
        incremental,
        rules,
        filter: table.number("filter")?,
    })
}

fn feed_forward(table: &Table, structure: &Structure, machine: &Machine) -> Result<FeedForward> {
    let Some(field) = table.optional("feed_forward") else {
        // A sliding mode's equivalent control is that of the model; state feedback has its states from it.
        let model = match structure {
            Structure::SlidingMode(_) => FeedForwardModel::Rigid,
            Structure::StateFeedback(_) => FeedForwardModel::Elastic,
            Structure::Pid(_) | Structure::Cascade(_) | Structure::Fuzzy(_) => FeedForwardModel::None,
        };
        return Ok(FeedForward { model, ..FeedForward::NONE });
    };
    let table = field.table()?;
    table.check_keys(&["model", "compensate_stretch"], &[])?;
    let models = FeedForwardModel::ALL.map(|model| (model.word(), model));
    let model = table.required("model", "model = \"rigid\" or \"elastic\"")?.choice(&models)?;
    let compensate = table.optional("compensate_stretch");
    let compensate_stretch = compensate.as_ref().map_or(Ok(false), Field::truth)?;
    if let (true, Some(field), Some(EncoderPlace::Cart)) =
        (compensate_stretch, compensate, machine.encoder.map(|encoder| encoder.at))
    {
        return Err(field
            .fail("an encoder at the cart sees no stretch of the belt")
            .next("leave it out: it is for an encoder at motor or drive pulley"));
    }
    if let (true, Some(field), Structure::Cascade(_), Some(_)) =
        (compensate_stretch, table.optional("compensate_stretch"), structure, machine.scale)
    {
        return Err(field
            .fail("with a scale the cascade closes its position loop at the cart, where no stretch is seen")
            .next("leave it out, or leave [scale] out"));
    }
    Ok(FeedForward {
        model,
        inertia: table.number("inertia")?,
        friction: table.number("friction")?,
        compensate_stretch,
        lead: table.number_if_given("lead")?,
    })
}

fn filters(table: &Table) -> Result<Vec<Filter>> {
    let Some(field) = table.optional("filters") else { return Ok(Vec::new()) };
    let filter = |field: &Field| {
        let table = field.clone().named("controller.filters").table()?;
        table.check_keys(&[], &[])?;
        let damping = table.number("damping")?;
        match (table.optional("notch"), table.optional("low_pass")) {
            (Some(notch), None) => {
                Ok(Filter::Notch { frequency: notch.number()?, depth: table.number("depth")?, damping })
            }
            (None, Some(low)) => match table.optional("depth") {
                Some(depth) => Err(depth.fail("a low-pass has no depth").next("leave it out")),
                None => Ok(Filter::LowPass { frequency: low.number()?, damping }),
            },
            (Some(_), Some(low)) => {
                Err(low.fail("this is a notch already").next("write each filter as a table of its own"))
            }
            (None, None) => Err(field
                .fail("the kind of filter is not said")
                .allowed("notch or low_pass")
                .next("write for example { notch = \"180 Hz\" }")),
        }
    };
    field.list()?.iter().map(filter).collect()
}

fn shaper(table: &Table) -> Result<Vec<[f64; 2]>> {
    let Some(field) = table.optional("shaper") else { return Ok(Vec::new()) };
    let mut impulses: Vec<[f64; 2]> = Vec::new();
    for impulse in field.filled_list()? {
        let pair = impulse.list()?;
        let [time, amplitude] = &pair[..] else {
            return Err(impulse
                .fail(format!("the impulse has {} values", pair.len()))
                .allowed("two values: [time, amplitude]"));
        };
        let named = |field: &Field, key: &str| field.clone().named(format!("controller.shaper.{key}")).number();
        let next = [named(time, "time")?, named(amplitude, "amplitude")?];
        if impulses.last().is_some_and(|last| next[0] <= last[0]) {
            return Err(time.fail("the times do not grow").allowed("after the one before"));
        }
        impulses.push(next);
    }
    let sum: f64 = impulses.iter().map(|impulse| impulse[1]).sum();
    if (sum - 1.0).abs() > 1e-6 {
        let told = crate::quantity::rounded(sum);
        return Err(field
            .fail(format!("the amplitudes add up to {told}: the cart would not get where it should"))
            .allowed("1")
            .next(format!("divide each of them by {told}")));
    }
    // To the last bit, so that the target is the target.
    impulses.iter_mut().for_each(|impulse| impulse[1] /= sum);
    Ok(impulses)
}
