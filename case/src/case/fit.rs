//! The table of the fit: what is searched for, within which bounds, from which logs.

use super::Experiment;
use super::reader::{Field, Table, nearest};
use super::tree::NodeValue;
use crate::error::Result;
use crate::log::Quantity;
use crate::machine::Machine;
use crate::parameter::{self, Free, INPUT, Parameter, Range};

/// The free parameters of a fit, and how it is done.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Parameters by themselves.
    pub free: Vec<String>,
    /// Parameters that keep their present ratio, or are equal where one of them is zero.
    pub tied: Vec<Vec<String>>,
    /// Sums of which the parts keep their ratios: `total.viscous` and its kind.
    pub lumped: Vec<String>,
    /// Bounds that are given, SI, by name.
    pub bounds: Vec<(String, [f64; 2])>,
    /// Which of these each campaign, or each log, has for itself.
    pub separate: Vec<String>,
    /// The groups of logs that have values of their own.
    pub per: Per,
    /// The campaigns: names, and the experiments of each, as patterns of their names.
    pub campaigns: Vec<(String, Vec<String>)>,
    /// Prior knowledge, by name; counts for draws from the posterior alone.
    pub priors: Vec<(String, Prior)>,
    /// The nuisances that are fitted along with each log.
    pub nuisance: Nuisances,
    /// True if residuals beyond 1.345 standard deviations count linearly.
    pub huber: bool,
    /// From how many points the search starts.
    pub starts: usize,
    /// Which points.
    pub seed: u64,
    /// Experiments that are only compared.
    pub held_out: Vec<String>,
    /// Time in each log after which it is only compared, s.
    pub until: Option<f64>,
    /// Length of the windows into which logs are cut, s.
    pub windows: Option<f64>,
    /// True if the case's controller follows the logged reference again; otherwise the input is what was logged.
    pub closed_loop: bool,
}

impl Default for Plan {
    /// Nothing is searched for, from one start.
    fn default() -> Self {
        Self {
            free: Vec::new(),
            tied: Vec::new(),
            lumped: Vec::new(),
            bounds: Vec::new(),
            separate: Vec::new(),
            per: Per::Campaign,
            campaigns: Vec::new(),
            priors: Vec::new(),
            nuisance: Nuisances::default(),
            huber: false,
            starts: 1,
            seed: 1,
            held_out: Vec::new(),
            until: None,
            windows: None,
            closed_loop: false,
        }
    }
}

/// The groups that have a value of a separate parameter for themselves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Per {
    /// The experiments of a campaign together.
    #[default]
    Campaign,
    /// Each experiment.
    Log,
}

/// Prior knowledge of a number; SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prior {
    /// Normally distributed.
    Normal {
        /// Its mean.
        mean: f64,
        /// Its standard deviation.
        deviation: f64,
    },
    /// Its logarithm is normally distributed.
    LogNormal {
        /// Its median.
        median: f64,
        /// Standard deviation of its logarithm.
        deviation: f64,
    },
    /// Equally likely everywhere between two values, and nowhere else.
    Uniform {
        /// The least.
        low: f64,
        /// The greatest.
        high: f64,
    },
}

impl Plan {
    /// Names of the free parameters: keys, those of a tie joined by ` = `, and sums.
    pub fn names(&self) -> impl Iterator<Item = String> {
        let tied = self.tied.iter().map(|keys| keys.join(" = "));
        self.free.iter().cloned().chain(tied).chain(self.lumped.iter().cloned())
    }

    /// The group of the experiment of this name, as far as separate parameters go: its campaign, or itself.
    pub fn part<'a>(&'a self, experiment: &'a str) -> &'a str {
        match self.per {
            Per::Log => experiment,
            Per::Campaign => {
                let own = |names: &[String]| names.iter().any(|pattern| matches(experiment, pattern));
                self.campaigns.iter().find(|(_, names)| own(names)).map_or("", |(campaign, _)| campaign)
            }
        }
    }
}

impl Prior {
    /// The logarithm of its density at `p`, but for a constant, and the derivative of that.
    pub fn log(self, p: f64) -> (f64, f64) {
        match self {
            // −½ ((p − m)/s)²
            Prior::Normal { mean, deviation } => {
                let off = (p - mean) / deviation;
                (-0.5 * off * off, -off / deviation)
            }
            // −½ (ln(p/m)/s)² − ln p
            Prior::LogNormal { median, deviation } => {
                let off = (p / median).ln() / deviation;
                (-0.5 * off * off - p.ln(), -(off / deviation + 1.0) / p)
            }
            Prior::Uniform { .. } => (0.0, 0.0),
        }
    }
}

/// Numbers that are fitted along with the logs, and are none of the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Nuisances {
    /// The input acts later than logged.
    pub delay: Scope,
    /// The drive of a gantry whose input alone acts later than logged, in all logs.
    pub drive_delay: Option<usize>,
    /// A factor on the input.
    pub input_gain: Scope,
    /// Something added to the input.
    pub input_offset: Scope,
    /// Position and speed at the start.
    pub initial_state: bool,
    /// Something added to each output that is no position, and to positions where the start is not fitted.
    pub bias: bool,
    /// The position whose sensor has play: its reading follows the motion only when the play is used up.
    pub sensor_play: Option<Quantity>,
    /// The quantity whose readings have a factor: no key of the case, whose logs have `scale`, but an element that a
    /// fit tries.
    pub sensor_scale: Option<Quantity>,
}

/// For which logs a number holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Scope {
    /// It is not fitted.
    #[default]
    Off,
    /// Each log has its own.
    Each,
    /// All logs have the same.
    Shared,
}

/// The plan of a fit; `whole` is false where not all files were read: which experiments have a log is
/// not known then.
pub(super) fn plan(root: &Table, stage: &Machine, experiments: &[Experiment], whole: bool) -> Result<Option<Plan>> {
    let Some(field) = root.optional("fit") else { return Ok(None) };
    let table = field.table()?;
    let known =
        ["free", "tied", "lumped", "bounds", "priors", "nuisance", "loss", "held_out", "loop", "separate", "per"];
    table.check_keys(&known, &[])?;
    let free = match table.optional("free") {
        // An empty list asks for the errors of the case as it is.
        Some(field) => field.list()?.iter().map(|field| field.text().map(str::to_string)).collect::<Result<_>>()?,
        None => Vec::new(),
    };
    let tied = match table.optional("tied") {
        Some(field) => field.filled_list()?.iter().map(words).collect::<Result<Vec<_>>>()?,
        None => Vec::new(),
    };
    if let (Some(field), Some(_)) = (table.optional("tied"), tied.iter().find(|keys| keys.len() < 2)) {
        return Err(field.fail("a single parameter has nothing to be tied to").allowed("two and more in each list"));
    }
    let lumped = table.optional("lumped").map_or(Ok(Vec::new()), |field| words(&field))?;
    if free.is_empty() && tied.is_empty() && lumped.is_empty() && table.optional("free").is_none() {
        return Err(field
            .fail("there are no free parameters")
            .next("add for example free = [\"cart.mass\", \"cart.friction.viscous\"], or free = [] for the errors of the case as it is"));
    }
    let mut seen: Vec<&str> = Vec::new();
    for key in free.iter().chain(tied.iter().flatten()).chain(&lumped) {
        if seen.contains(&key.as_str()) {
            return Err(field.fail(format!("`{key}` is listed twice")).next("name each parameter once"));
        }
        seen.push(key);
    }
    for list in ["free", "lumped", "tied"] {
        for field in table.optional(list).map_or(Ok(Vec::new()), |field| field.list())? {
            let name = if list == "tied" { words(&field)?.join(" = ") } else { field.text()?.to_string() };
            self::free(&field, &name, stage)?;
        }
    }
    let held_out = table.optional("held_out").map_or(Ok(Vec::new()), |field| words(&field))?;
    for name in held_out.iter().filter(|_| whole) {
        let of_file = |experiment: &&Experiment| experiment.log.is_some() && matches(&experiment.name, name);
        if let (None, Some(field)) = (experiments.iter().find(of_file), table.optional("held_out")) {
            let names: Vec<String> =
                experiments.iter().filter(|e| e.log.is_some()).map(|e| format!("\"{}\"", e.name)).collect();
            let shown = match names.len() {
                all if all > MOST_NAMES => format!("{} and {} more", names[..MOST_NAMES].join(", "), all - MOST_NAMES),
                _ => names.join(", "),
            };
            return Err(field
                .fail(format!("there is no experiment \"{name}\" with a log"))
                .allowed(shown)
                .next("name experiments, with * for any part of a name, as in \"april-*-fast\""));
        }
    }
    let names: Vec<String> =
        Plan { free: free.clone(), tied: tied.clone(), lumped: lumped.clone(), ..Plan::default() }.names().collect();
    let separate = separate(&table, &names)?;
    let per = table
        .optional("per")
        .map_or(Ok(Per::Campaign), |field| field.choice(&[("campaign", Per::Campaign), ("log", Per::Log)]))?;
    let campaigns = campaigns(root)?;
    if let (Some(field), true, Per::Campaign) = (table.optional("separate"), campaigns.len() < 2, per) {
        return Err(field
            .fail("there are no campaigns that could have their own values")
            .allowed("two campaigns or more")
            .next("say campaign = \"april\" in [[experiment]], or per = \"log\""));
    }
    let of_none = |experiment: &&Experiment| {
        let own = |names: &[String]| names.iter().any(|pattern| matches(&experiment.name, pattern));
        experiment.log.is_some() && !campaigns.iter().any(|(_, names)| own(names))
    };
    if let (Some(field), Per::Campaign) = (table.optional("separate"), per)
        && let Some(experiment) = experiments.iter().find(of_none)
    {
        return Err(field
            .fail(format!("\"{}\" is of no campaign, so these parameters have no value for it", experiment.name))
            .next("say campaign = \"...\" in its [[experiment]], too"));
    }
    let huber =
        table.optional("loss").map_or(Ok(false), |field| field.choice(&[("squares", false), ("huber", true)]))?;
    let nuisance = nuisances(&table, stage, experiments, whole)?;
    let closed_loop =
        table.optional("loop").map_or(Ok(false), |field| field.choice(&[("logged", false), ("closed", true)]))?;
    if let (true, Some(field)) = (closed_loop, table.optional("loop")) {
        closed(&field, &table, (root, stage), experiments, nuisance)?;
    }
    Ok(Some(Plan {
        bounds: bounds(&table, &seen)?,
        priors: priors(&table, &seen, nuisance)?,
        nuisance,
        huber,
        starts: table.number("starts")? as usize,
        seed: table.seed()?,
        held_out,
        until: table.number_if_given("until")?,
        windows: table.number_if_given("windows")?,
        closed_loop,
        free: free.clone(),
        tied: tied.clone(),
        lumped: lumped.clone(),
        separate,
        per,
        campaigns,
    }))
}

/// The parameters that campaigns have for themselves, of those that are searched for.
fn separate(table: &Table, names: &[String]) -> Result<Vec<String>> {
    let Some(field) = table.optional("separate") else { return Ok(Vec::new()) };
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut separate = Vec::new();
    for field in field.filled_list()? {
        let name = field.text()?.to_string();
        searched(&field, &name, &names)?;
        separate.push(name);
    }
    Ok(separate)
}

/// The campaigns that experiments name, in their order, with the names of their experiments; those of a log that is
/// split begin with it.
fn campaigns(root: &Table) -> Result<Vec<(String, Vec<String>)>> {
    let mut campaigns: Vec<(String, Vec<String>)> = Vec::new();
    let experiments = root.optional("experiment").map_or(Ok(Vec::new()), |field| field.list())?;
    for experiment in experiments {
        let table = experiment.table()?;
        let (Some(field), Some(name)) = (table.optional("campaign"), table.optional("name")) else { continue };
        let (campaign, name) = (field.text()?, name.text()?);
        if campaign.is_empty() || campaign.contains(['[', ']']) {
            return Err(field.fail(format!("\"{campaign}\" is no name of a campaign")).allowed("text without [ and ]"));
        }
        let own = [name.to_string(), format!("{name}/*")];
        match campaigns.iter_mut().find(|(known, _)| known == campaign) {
            Some((_, names)) => names.extend(own),
            None => campaigns.push((campaign.to_string(), own.to_vec())),
        }
    }
    Ok(campaigns)
}

/// Refuses what a loop that is closed again cannot have.
fn closed(
    field: &Field,
    table: &Table,
    (root, machine): (&Table, &Machine),
    experiments: &[Experiment],
    nuisance: Nuisances,
) -> Result<()> {
    if !machine.has_one_coordinate() {
        return Err(field
            .fail("a loop is closed again on a single axis only, and this is a gantry")
            .next("leave out `loop`: the inputs are then those that were logged"));
    }
    if root.optional("controller").is_none() {
        return Err(field.fail("there is no controller that could close the loop").next("add [controller]"));
    }
    let without = experiments.iter().find(|e| e.log.as_ref().is_some_and(|log| log.reference.is_none()));
    if let Some(experiment) = without {
        return Err(field
            .fail(format!("the log of \"{}\" has no reference", experiment.name))
            .next("add reference = \"...\" with the name of that column to the log, or leave out `loop`"));
    }
    if table.optional("windows").is_some() {
        return Err(field
            .fail("a controller begins with the log, not in the middle of it")
            .next("leave out `windows` or `loop`"));
    }
    if nuisance.sensor_play.is_some() {
        return Err(field
            .fail(
                "the controller of a loop that is closed again receives exact positions, without the play of a sensor",
            )
            .next("leave `sensor_play` out of `nuisance`, or leave out `loop`"));
    }
    if nuisance.delay != Scope::Off || nuisance.input_offset != Scope::Off {
        return Err(field
            .fail("a delay or an offset of the input is the controller's own here")
            .next("leave `delay` and `input_offset` out of `nuisance`; controller.delay is the delay of the loop"));
    }
    Ok(())
}

/// Refuses a name that is no parameter of this machine.
pub(super) fn free(field: &Field, name: &str, machine: &Machine) -> Result<()> {
    Free::new(machine, name, &[], &[]).map(|_| ()).map_err(|error| {
        let mut told = field.fail(error.what);
        (told.allowed, told.next) = (error.allowed, error.next);
        told
    })
}

/// Names that an error lists at most.
const MOST_NAMES: usize = 10;

/// True if a name is meant by a pattern: the name itself, where each `*` stands for anything, nothing too.
pub fn matches(name: &str, pattern: &str) -> bool {
    let Some((start, rest)) = pattern.split_once('*') else { return name == pattern };
    let Some(mut left) = name.strip_prefix(start) else { return false };
    let mut parts: Vec<&str> = rest.split('*').collect();
    let end = parts.pop().unwrap_or_default();
    // The first place that fits leaves the most for those behind it.
    for part in parts {
        match left.find(part) {
            Some(at) => left = &left[at + part.len()..],
            None => return false,
        }
    }
    left.ends_with(end)
}

/// A list of texts.
fn words(field: &Field) -> Result<Vec<String>> {
    field.filled_list()?.iter().map(|field| field.text().map(str::to_string)).collect()
}

fn bounds(table: &Table, names: &[&str]) -> Result<Vec<(String, [f64; 2])>> {
    let Some(field) = table.optional("bounds") else { return Ok(Vec::new()) };
    let mut bounds = Vec::new();
    let given = field.table()?;
    for key in given.keys() {
        let Some(field) = given.optional(key) else { continue };
        searched(&field, key, names)?;
        bounds.push((key.to_string(), ends(&field, key)?));
    }
    Ok(bounds)
}

/// Refuses a name that is not searched for.
fn searched(field: &Field, key: &str, names: &[&str]) -> Result<()> {
    if names.contains(&key) {
        return Ok(());
    }
    let error = field.fail(format!("`{key}` is not searched for")).allowed(names.join(", "));
    Err(match nearest(key, names) {
        Some(near) => error.next(format!("did you mean `{near}`?")),
        None => error,
    })
}

/// The least and the greatest value of the parameter `key`.
fn ends(field: &Field, key: &str) -> Result<[f64; 2]> {
    let [low, high] = pair(field, "two: the least and the most")?;
    let (low, high) = (value(&low, key)?, value(&high, key)?);
    if low >= high {
        return Err(field.fail(format!("{low} is not below {high}")).allowed("the least value, then the most"));
    }
    Ok([low, high])
}

/// The two values of a list.
pub(super) fn pair<'a>(field: &Field<'a>, wanted: &str) -> Result<[Field<'a>; 2]> {
    let list = field.list()?;
    let count = list.len();
    list.try_into().map_err(|_| field.fail(format!("the list has {count} values")).allowed(wanted))
}

/// A number of the parameter `key`: in its range; in SI units, where it is a group's.
fn value(field: &Field, key: &str) -> Result<f64> {
    match row_of(key) {
        Some(row) => field.number_of(&row),
        None => plain(field, "a number in SI units"),
    }
}

/// A number without a unit.
pub(super) fn plain(field: &Field, wanted: &str) -> Result<f64> {
    match &field.node.kind {
        NodeValue::Float(value) if value.is_finite() => Ok(*value),
        NodeValue::Integer(value) => Ok(*value as f64),
        NodeValue::Float(value) => Err(field.fail(format!("expected {wanted}, found {value}"))),
        other => Err(field.fail(format!("expected {wanted}, found {}", other.word()))),
    }
}

/// The row of the table of parameters, of the table of the fit's nuisances too.
fn row_of(key: &str) -> Option<Parameter> {
    let unit = match key {
        "delay" => "s",
        "input_offset" => INPUT,
        "input_gain" => "",
        _ => return parameter::named(key).copied(),
    };
    let example = match key {
        "delay" => "2 ms",
        "input_offset" => "0.1 V",
        _ => "1",
    };
    Some(Parameter::unwritten(unit, Range::ANY, example))
}

fn priors(table: &Table, names: &[&str], nuisance: Nuisances) -> Result<Vec<(String, Prior)>> {
    let Some(field) = table.optional("priors") else { return Ok(Vec::new()) };
    let own = [("delay", nuisance.delay), ("input_gain", nuisance.input_gain), ("input_offset", nuisance.input_offset)];
    let mut names = names.to_vec();
    names.extend(own.iter().filter(|(_, scope)| *scope != Scope::Off).map(|(name, _)| *name));
    let given = field.table()?;
    let mut priors = Vec::new();
    for key in given.keys() {
        let Some(field) = given.optional(key) else { continue };
        searched(&field, key, &names)?;
        priors.push((key.to_string(), prior(&field, key)?));
    }
    Ok(priors)
}

const PRIORS: &str =
    "normal = [mean, deviation], log_normal = [median, deviation of the logarithm], uniform = [least, most]";

fn prior(field: &Field, key: &str) -> Result<Prior> {
    let table = field.table()?;
    table.check_keys(&["normal", "log_normal", "uniform"], &[])?;
    let mut kinds = table.keys();
    let (Some(kind), None) = (kinds.next(), kinds.next()) else {
        let count = table.keys().count();
        return Err(field.fail(format!("expected one prior, found {count}")).allowed(format!("one of {PRIORS}")));
    };
    let Some(field) = table.optional(kind) else { return Err(field.fail("this prior is empty")) };
    prior_of(kind, &field, key)
}

/// The prior of a kind (`normal`, `log_normal`, else uniform) for the parameter `key`.
pub(super) fn prior_of(kind: &str, field: &Field, key: &str) -> Result<Prior> {
    let positive = |deviation: &Field, value: f64| match value > 0.0 {
        true => Ok(value),
        false => Err(deviation
            .fail(format!("a deviation of {value} leaves nothing to draw"))
            .allowed("above zero")
            .next("leave out a parameter that is known exactly")),
    };
    match kind {
        "normal" => {
            let [mean, deviation] = pair(field, "two: the mean and the standard deviation")?;
            // A deviation has the parameter's unit and not its range.
            let wide = match row_of(key) {
                Some(row) => deviation.number_of(&Parameter { range: Range::ANY, ..row })?,
                None => plain(&deviation, "a number in SI units")?,
            };
            Ok(Prior::Normal { mean: value(&mean, key)?, deviation: positive(&deviation, wide)? })
        }
        "log_normal" => {
            let [median, deviation] = pair(field, "two: the median and the standard deviation of the logarithm")?;
            let wide = plain(&deviation, "a number without a unit, 0.05 for about 5 %")?;
            let middle = value(&median, key)?;
            if middle <= 0.0 {
                return Err(median.fail(format!("{middle} has no logarithm")).allowed("above zero"));
            }
            Ok(Prior::LogNormal { median: middle, deviation: positive(&deviation, wide)? })
        }
        _ => ends(field, key).map(|[low, high]| Prior::Uniform { low, high }),
    }
}

/// The numbers that are fitted along.
fn nuisances(table: &Table, machine: &Machine, experiments: &[Experiment], whole: bool) -> Result<Nuisances> {
    let Some(field) = table.optional("nuisance") else { return Ok(Nuisances::default()) };
    let table = field.table()?;
    table.check_keys(
        &["delay", "drive_delay", "input_gain", "input_offset", "initial_state", "bias", "sensor_play"],
        &[],
    )?;
    let flag = |key: &str| match table.optional(key) {
        None => Ok(false),
        Some(field) => match &field.node.kind {
            NodeValue::Bool(value) => Ok(*value),
            other => Err(field.fail(format!("expected true or false, found {}", other.word()))),
        },
    };
    let scope = |key: &str| match table.optional(key) {
        None => Ok(Scope::Off),
        Some(field) => match &field.node.kind {
            NodeValue::Bool(true) => Ok(Scope::Each),
            NodeValue::Bool(false) => Ok(Scope::Off),
            NodeValue::Text(text) if text == "shared" => Ok(Scope::Shared),
            other => Err(field
                .fail(format!("expected true, false or \"shared\", found {}", other.word()))
                .next("true gives each log its own, \"shared\" all of them the same")),
        },
    };
    let logs = whole.then_some(experiments);
    Ok(Nuisances {
        delay: scope("delay")?,
        drive_delay: table.optional("drive_delay").map_or(Ok(None), |field| drive(&field, machine).map(Some))?,
        input_gain: scope("input_gain")?,
        input_offset: scope("input_offset")?,
        initial_state: flag("initial_state")?,
        bias: flag("bias")?,
        sensor_play: table.optional("sensor_play").map_or(Ok(None), |field| logged_position(&field, machine, logs))?,
        sensor_scale: None,
    })
}

/// The drive of a gantry that a field names by its side.
fn drive(field: &Field, machine: &Machine) -> Result<usize> {
    if machine.has_one_coordinate() {
        return Err(field
            .fail("this names one of several drives, and an axis has one")
            .next("write delay = \"shared\", or delay = true for a delay of each log"));
    }
    field.choice(&machine.geometry().sides().zip(0..).collect::<Vec<_>>())
}

/// The position of a machine that a field names; one that a log has, if the logs of these experiments were read.
fn logged_position(field: &Field, machine: &Machine, logs: Option<&[Experiment]>) -> Result<Option<Quantity>> {
    let positions = machine.quantities().iter().filter(|quantity| quantity.is_position());
    let choices: Vec<(&str, Quantity)> = positions.map(|quantity| (quantity.name(), *quantity)).collect();
    let quantity = field.choice(&choices)?;
    let has = |experiment: &Experiment| {
        experiment.log.iter().flat_map(|log| &log.outputs).any(|output| output.quantity == quantity)
    };
    let logged: Vec<&Experiment> = logs.into_iter().flatten().filter(|experiment| experiment.log.is_some()).collect();
    match logged.is_empty() || logged.into_iter().any(has) {
        true => Ok(Some(quantity)),
        false => Err(field
            .fail(format!("no log has an output `{}`", quantity.name()))
            .next("name the position whose sensor has play as the logs have it")),
    }
}

#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn a_star_stands_for_any_part_of_a_name() {
        for (name, pattern, meant) in [
            ("april 3", "april 3", true),
            ("april 3", "april", false),
            ("april 3", "april*", true),
            ("april 3", "*3", true),
            ("april 3", "a*l*3", true),
            ("april 3", "*", true),
            ("april 3", "*april 3*", true),
            ("april 3", "a*a*", false),
            ("aa", "a*a", true),
            ("a", "a*a", false),
            ("€1", "*1", true),
        ] {
            assert_eq!(matches(name, pattern), meant, "{name} {pattern}");
        }
    }
}
