//! The controller's table.

use super::reader::{Field, Table};
use super::suggestion;
use crate::design::{CurrentLoop, Design, DisturbanceObserver, FeedForward, FeedForwardModel, Filter, Structure};
use crate::error::Result;
use crate::machine::{AmplifierMode, EncoderPlace, Machine};
use crate::parameter::{self, Fallback};

/// Most samples that a delay may take.
const MOST_DELAY: f64 = 1000.0;

pub(super) fn controller(root: &Table, machine: &Machine) -> Result<Option<Design>> {
    if machine.stepper().is_some()
        && let Some(design) = open_loop(root)?
    {
        return Ok(Some(design));
    }
    let Some(field) = root.optional("controller") else { return Ok(None) };
    let field = Field { input_unit: machine.drives[0].amplifier.mode.unit(), ..field };
    let table = field.table()?;
    if machine.stepper().is_none() {
        table.check_keys(&[], &[])?;
    }
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
    let design = Design {
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
    };
    if let Some(part) = design.needs_axis().filter(|_| machine.drives.len() > 1) {
        let field = table.optional(part).unwrap_or_else(|| table.field.clone());
        return Err(field
            .fail(format!("`{part}` needs a single axis, and the case describes a gantry ({})", machine.kind.name()))
            .next("leave it out: a gantry takes pid, cascade or fuzzy, with feed_forward and filters"));
    }
    Ok(Some(design))
}

/// Interval between the rows of a stepper's move where none is given, s.
const EVERY: f64 = 1e-3;

/// Keys of a stepper's controller, the first ones also without feedback.
const OF_STEPPER: [&str; 6] = ["shaper", "every", "pid", "delay", "limit", "filters"];
const OF_OPEN_LOOP: usize = 2;

/// The design of a stepper without feedback, which has an input shaper at most. None with feedback, and where the file
/// has no move and no controller.
fn open_loop(root: &Table) -> Result<Option<Design>> {
    let Some(field) = root.optional("controller") else {
        let asks = ["move", "tune"].iter().find_map(|key| root.optional(key));
        return Ok(asks.map(|_| Design::open_loop(EVERY, Vec::new())));
    };
    let table = field.table()?;
    if let Some(field) = table.first_beyond(&OF_STEPPER) {
        return Err(field
            .fail("the controller of a stepper corrects the position that its driver is commanded")
            .allowed("pid, with every, delay, limit, filters and shaper; in open loop shaper and every alone")
            .next("leave it out"));
    }
    if table.optional("pid").is_some() {
        return Ok(None);
    }
    if let Some(field) = table.first_beyond(&OF_STEPPER[..OF_OPEN_LOOP]) {
        return Err(field
            .fail("without pid a stepper follows its reference in open loop, which has no command to correct")
            .allowed("shaper, and every for the interval between rows")
            .next("leave it out, or add pid, which corrects the position by an encoder"));
    }
    let every = table.number_if_given("every")?.unwrap_or(EVERY);
    Ok(Some(Design::open_loop(every, shaper(&table)?)))
}

fn structure(table: &Table, machine: &Machine, (every, delay): (f64, f64)) -> Result<Structure> {
    let is_fed_back = |one: &Structure| !matches!(one, Structure::OpenLoop(_));
    let known: Vec<Structure> = Structure::each().into_iter().filter(is_fed_back).collect();
    let words: Vec<&str> = known.iter().map(|one| one.tunable().word()).collect();
    // Exactly one of them.
    let given: Vec<Field> = words.iter().filter_map(|key| table.optional(key)).collect();
    let field = match &given[..] {
        [field] => field.clone(),
        [] => {
            return Err(table
                .field
                .fail("the structure of the controller is missing")
                .allowed(if machine.drives.len() == 1 { words.join(", ") } else { "pid, cascade, fuzzy".into() })
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
    let Some(mut structure) = known.into_iter().find(|one| one.tunable().word() == field.key()) else {
        return Err(field.unread());
    };
    match &mut structure {
        Structure::Pid(_) => {
            if own.optional("proportional").is_none() {
                let such_as = || format!("add for example {}", suggestion::proportional(machine, every, delay));
                own.number("proportional").map_err(|error| error.next(such_as()))?;
            }
            gains(&own, &mut structure)?;
        }
        Structure::Cascade(cascade) => {
            let Some(current) = own.optional("current") else {
                gains(&own, &mut structure)?;
                return Ok(structure);
            };
            if machine.drives[0].amplifier.mode == AmplifierMode::Current {
                return Err(current
                    .fail("the amplifier commands the current itself: there is no loop to close")
                    .next("leave it out, or set amplifier.mode = \"voltage\""));
            }
            cascade.current = Some(CurrentLoop::default());
            let inner = current.table()?;
            inner.check_keys(&[], &[])?;
            gains(&inner, &mut structure)?;
            // With a current loop the speed loop asks for a current.
            gains(&Field { input_unit: "A", ..field.clone() }.table()?, &mut structure)?;
        }
        Structure::Fuzzy(rules) => {
            (rules.command, rules.incremental, rules.rules) = fuzzy(&own)?;
            gains(&own, &mut structure)?;
        }
        Structure::StateFeedback(_) | Structure::SlidingMode(_) | Structure::OpenLoop(_) => {
            gains(&own, &mut structure)?;
        }
    }
    Ok(structure)
}

/// The numbers of a table that are its rows.
fn gains(table: &Table, structure: &mut Structure) -> Result<()> {
    let section = &table.field.section;
    for row in parameter::all() {
        let name = row.key.strip_prefix(section.as_str()).and_then(|rest| rest.strip_prefix('.'));
        let (Some(name), Some(gain)) = (name.filter(|name| !name.contains('.')), row.gain) else { continue };
        let value = match row.default {
            Fallback::Words(_) => table.number_if_given(name)?,
            Fallback::Required | Fallback::Value(_) => Some(table.number(name)?),
        };
        if let Some(value) = value {
            (gain.set)(structure, value);
        }
    }
    Ok(())
}

/// The command of a rule, whether rules change it, and the rules.
fn fuzzy(table: &Table) -> Result<(f64, bool, Vec<Vec<f64>>)> {
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
    Ok((value, incremental, rules))
}

fn feed_forward(table: &Table, structure: &Structure, machine: &Machine) -> Result<FeedForward> {
    let Some(field) = table.optional("feed_forward") else {
        return Ok(FeedForward { model: structure.tunable().feed_forward(), ..FeedForward::NONE });
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
            .fail("an encoder at the cart does not measure the stretch of the belt")
            .next("leave it out: it is for an encoder at motor or drive pulley"));
    }
    if let (true, Some(field), true, Some(_)) =
        (compensate_stretch, table.optional("compensate_stretch"), structure.tunable().follows_scale(), machine.scale)
    {
        return Err(field
            .fail("with a scale the cascade closes its position loop at the cart, where there is no stretch to compensate")
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
                .fail("the kind of filter is missing")
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
            .fail(format!("the amplitudes add up to {told}: the cart would not reach its target"))
            .allowed("1")
            .next(format!("divide each of them by {told}")));
    }
    // To the last bit, so that the target is the target.
    impulses.iter_mut().for_each(|impulse| impulse[1] /= sum);
    Ok(impulses)
}
