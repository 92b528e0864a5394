//! The table of the fit: what is searched for, within which bounds, from which logs.

use super::Experiment;
use super::reader::{Field, Table, nearest};
use super::tree::Kind;
use crate::error::Result;
use crate::parameter;

/// What a fit may turn, and how it is done.
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
    /// What is fitted along with each log.
    pub nuisance: Nuisances,
    /// Whether residuals beyond 1.345 standard deviations count linearly.
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
}

impl Default for Plan {
    /// Nothing is searched for, from one start.
    fn default() -> Self {
        Self {
            free: Vec::new(),
            tied: Vec::new(),
            lumped: Vec::new(),
            bounds: Vec::new(),
            nuisance: Nuisances::default(),
            huber: false,
            starts: 1,
            seed: 1,
            held_out: Vec::new(),
            until: None,
            windows: None,
        }
    }
}

/// What is fitted along with the logs, and is no number of the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Nuisances {
    /// The input acts later than logged.
    pub delay: Scope,
    /// A factor on the input.
    pub input_gain: Scope,
    /// Something added to the input.
    pub input_offset: Scope,
    /// Position and speed at the start.
    pub initial_state: bool,
    /// Something added to each output that is no position, and to positions where the start is not fitted.
    pub bias: bool,
}

/// For which logs a number holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scope {
    /// It is not fitted.
    #[default]
    Off,
    /// Each log has its own.
    Each,
    /// All logs have the same.
    Shared,
}

pub(super) fn plan(root: &Table, experiments: &[Experiment]) -> Result<Option<Plan>> {
    let Some(field) = root.optional("fit") else { return Ok(None) };
    let table = field.table()?;
    let known = ["free", "tied", "lumped", "bounds", "nuisance", "loss", "held_out"];
    table.check_keys(&known, &[])?;
    let free = table.optional("free").map_or(Ok(Vec::new()), |field| words(&field))?;
    let tied = match table.optional("tied") {
        Some(field) => field.filled_list()?.iter().map(words).collect::<Result<Vec<_>>>()?,
        None => Vec::new(),
    };
    if let (Some(field), Some(_)) = (table.optional("tied"), tied.iter().find(|keys| keys.len() < 2)) {
        return Err(field.fail("a single parameter has nothing to be tied to").allowed("two and more in each list"));
    }
    let lumped = table.optional("lumped").map_or(Ok(Vec::new()), |field| words(&field))?;
    if free.is_empty() && tied.is_empty() && lumped.is_empty() {
        return Err(field
            .fail("nothing is searched for")
            .next("add for example free = [\"cart.mass\", \"cart.friction.viscous\"]"));
    }
    let mut seen: Vec<&str> = Vec::new();
    for key in free.iter().chain(tied.iter().flatten()).chain(&lumped) {
        if seen.contains(&key.as_str()) {
            return Err(field.fail(format!("`{key}` stands in it twice")).next("name each parameter once"));
        }
        seen.push(key);
    }
    let held_out = table.optional("held_out").map_or(Ok(Vec::new()), |field| words(&field))?;
    for name in &held_out {
        let of_file = |experiment: &&Experiment| experiment.log.is_some() && matches(&experiment.name, name);
        if let (None, Some(field)) = (experiments.iter().find(of_file), table.optional("held_out")) {
            let names: Vec<String> =
                experiments.iter().filter(|e| e.log.is_some()).take(10).map(|e| format!("\"{}\"", e.name)).collect();
            return Err(field
                .fail(format!("there is no experiment \"{name}\" with a log"))
                .allowed(names.join(", "))
                .next("name experiments, or the beginning of their names and a *"));
        }
    }
    let huber =
        table.optional("loss").map_or(Ok(false), |field| field.choice(&[("squares", false), ("huber", true)]))?;
    Ok(Some(Plan {
        bounds: bounds(&table, &seen)?,
        nuisance: nuisances(&table)?,
        huber,
        starts: table.number("starts")? as usize,
        seed: table.number("seed")? as u64,
        held_out,
        until: table.number_if_given("until")?,
        windows: table.number_if_given("windows")?,
        free: free.clone(),
        tied: tied.clone(),
        lumped: lumped.clone(),
    }))
}

/// Whether a name is meant by a pattern: the name itself, or its beginning and a `*`.
pub fn matches(name: &str, pattern: &str) -> bool {
    pattern.strip_suffix('*').map_or(name == pattern, |start| name.starts_with(start))
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
        if !names.contains(&key) {
            let error = field.fail(format!("`{key}` is not searched for")).allowed(names.join(", "));
            return Err(match nearest(key, names) {
                Some(near) => error.next(format!("did you mean `{near}`?")),
                None => error,
            });
        }
        let row = parameter::find(key).or_else(|| parameter::find(key.rsplit_once('.')?.0));
        let ends = field.list()?;
        let [low, high] = &ends[..] else {
            return Err(field
                .fail(format!("the list has {} values", ends.len()))
                .allowed("two: the least and the most"));
        };
        let value = |end: &Field| match row {
            Some(row) => end.number_of(row),
            None => match &end.node.kind {
                Kind::Float(value) => Ok(*value),
                Kind::Integer(value) => Ok(*value as f64),
                other => Err(end.fail(format!("{} stands where a number in SI units is wanted", other.word()))),
            },
        };
        let (low, high) = (value(low)?, value(high)?);
        if low >= high {
            return Err(field.fail(format!("{low} is not below {high}")).allowed("the least value, then the most"));
        }
        bounds.push((key.to_string(), [low, high]));
    }
    Ok(bounds)
}

fn nuisances(table: &Table) -> Result<Nuisances> {
    let Some(field) = table.optional("nuisance") else { return Ok(Nuisances::default()) };
    let table = field.table()?;
    table.check_keys(&["delay", "input_gain", "input_offset", "initial_state", "bias"], &[])?;
    let flag = |key: &str| match table.optional(key) {
        None => Ok(false),
        Some(field) => match &field.node.kind {
            Kind::Bool(value) => Ok(*value),
            other => Err(field.fail(format!("{} stands where true or false is wanted", other.word()))),
        },
    };
    let scope = |key: &str| match table.optional(key) {
        None => Ok(Scope::Off),
        Some(field) => match &field.node.kind {
            Kind::Bool(true) => Ok(Scope::Each),
            Kind::Bool(false) => Ok(Scope::Off),
            Kind::Text(text) if text == "shared" => Ok(Scope::Shared),
            other => Err(field
                .fail(format!("{} stands where true, false or \"shared\" is wanted", other.word()))
                .next("true gives each log its own, \"shared\" all of them the same")),
        },
    };
    Ok(Nuisances {
        delay: scope("delay")?,
        input_gain: scope("input_gain")?,
        input_offset: scope("input_offset")?,
        initial_state: flag("initial_state")?,
        bias: flag("bias")?,
    })
}
