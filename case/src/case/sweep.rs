//! The table of the sweep: what is varied, how, and in how many runs.

use super::fit::{free, pair, plain, prior_of};
use super::reader::{Field, Table};
use super::tree::{Entry, Node, NodeValue};
use super::{Folder, Known, Plan, Prior};
use crate::error::Result;
use crate::machine::Machine;
use crate::parameter::{Parameter, Range};
use std::path::PathBuf;

/// Most values of a grid, of one parameter.
const MOST_VALUES: usize = 100_000;

/// The plan of `taut sweep`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Sweeping {
    /// How many machines are run; none where the design says it.
    pub runs: Option<u64>,
    /// Which ones.
    pub design: Sampling,
    /// Seed of what is drawn.
    pub seed: u64,
    /// Interval between the rows that metrics are taken from, s; the experiment's where there is none.
    pub interval: Option<f64>,
    /// The parameters that are varied by themselves, by name: several tied by ` = `, groups, or `all`.
    pub vary: Vec<(String, Variation)>,
    /// The fit that parameters are drawn from.
    pub from: Option<Origin>,
    /// True if the runs are those that Sobol' indices need.
    pub indices: bool,
    /// The figures that are told, by name; all where nothing is said.
    pub figures: Option<Vec<String>>,
    /// How machines are run.
    pub solver: Running,
}

impl Sweeping {
    /// True if this figure is told.
    pub fn tells(&self, name: &str) -> bool {
        self.figures.as_ref().is_none_or(|figures| figures.iter().any(|figure| figure == name))
    }
}

impl Default for Sweeping {
    /// Random draws of nothing.
    fn default() -> Self {
        Self {
            runs: None,
            design: Sampling::Random,
            seed: 1,
            interval: None,
            vary: Vec::new(),
            from: None,
            indices: false,
            figures: None,
            solver: Running::Beside,
        }
    }
}

/// How the machines are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// Each by itself.
    Random,
    /// Each parameter's distribution is cut into as many equal parts as there are runs, and every part is met once.
    LatinHypercube,
    /// Points of a Sobol' sequence, scrambled.
    Sobol,
    /// Every value of one with every value of the others.
    Grid,
    /// The machine as it is, then one parameter off at a time.
    OneAtATime,
}

impl Sampling {
    /// All of them, with their words.
    pub const ALL: [(&str, Sampling); 5] = [
        ("random", Sampling::Random),
        ("latin-hypercube", Sampling::LatinHypercube),
        ("sobol", Sampling::Sobol),
        ("grid", Sampling::Grid),
        ("one-at-a-time", Sampling::OneAtATime),
    ];

    /// Its name in the case file.
    pub fn word(self) -> &'static str {
        Self::ALL.iter().find(|(_, sampling)| *sampling == self).map_or("", |(word, _)| word)
    }

    /// True if the runs are drawn, as many as one wants.
    pub(crate) fn is_drawn(self) -> bool {
        !matches!(self, Sampling::Grid | Sampling::OneAtATime)
    }
}

/// How the machines of a sweep are run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Running {
    /// Side by side where that is faster, the others one by one.
    Beside,
    /// One by one, with the same bits as a single run.
    Exact,
}

impl Running {
    /// All of them, with their words.
    pub const ALL: [(&str, Running); 2] = [("lanes", Running::Beside), ("exact", Running::Exact)];

    /// Its name in the case file.
    pub fn word(self) -> &'static str {
        Self::ALL.iter().find(|(_, running)| *running == self).map_or("", |(word, _)| word)
    }
}

/// How a parameter varies; SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Variation {
    /// The values that it takes.
    pub kind: Kinds,
    /// Where it is cut off, beside what the parameter may be at all.
    pub within: Option<[f64; 2]>,
}

/// The values that a parameter takes.
#[derive(Debug, Clone, PartialEq)]
pub enum Kinds {
    /// Equally likely within this share of its value on either side.
    Share(f64),
    /// By a density.
    Drawn(Prior),
    /// These.
    Values(Vec<f64>),
    /// Its value times these.
    Factors(Vec<f64>),
}

/// The result of a fit that machines are drawn from.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Origin {
    /// Draws from its posterior, in this file.
    Posterior(PathBuf),
    /// The standard errors in the table `[uncertainty]`.
    Uncertainty,
}

/// Other parts of the case that count.
pub(super) struct Context<'a> {
    pub machine: &'a Machine,
    /// Name of each experiment, and when it ends, s.
    pub experiments: Vec<(&'a str, f64)>,
    pub fit: Option<&'a Plan>,
    pub known: &'a [Known],
    pub folder: &'a Folder<'a>,
}

pub(super) fn sweeping(root: &Table, context: &Context) -> Result<Option<Sweeping>> {
    let Some(field) = root.optional("sweep") else { return Ok(None) };
    let table = field.table()?;
    table.check_keys(&["design", "vary", "from", "indices", "figures", "solver"], &[])?;
    let design = table.optional("design").map_or(Ok(Sampling::Random), |field| field.choice(&Sampling::ALL))?;
    let indices = table.optional("indices").map_or(Ok(false), |field| field.truth())?;
    let runs = table.number_if_given("runs")?.map(|runs| runs as u64);
    let mut vary = Vec::new();
    if let Some(field) = table.optional("vary") {
        let given = field.table()?;
        for key in given.keys() {
            let Some(field) = given.optional(key) else { continue };
            vary.push((key.to_string(), variation(&field, key, design, context.machine)?));
        }
    }
    let from = table.optional("from").map(|field| origin(&field, context)).transpose()?;
    if vary.is_empty() && from.is_none() {
        return Err(field.fail("nothing is varied").next("add [sweep.vary] with for example \"cart.mass\" = \"20 %\""));
    }
    if let (Some(field), true) = (table.optional("from"), !design.is_drawn() || indices) {
        let what =
            if indices { "sensitivity indices need parameters that vary by themselves" } else { "a fit is drawn from" };
        return Err(field.fail(what).allowed("design = \"random\", \"latin-hypercube\" or \"sobol\", without indices"));
    }
    if let (Some(field), true) = (table.optional("indices"), indices && !design.is_drawn()) {
        return Err(field
            .fail(format!("sensitivity indices are not available for design = \"{}\"", design.word()))
            .allowed("design = \"random\", \"latin-hypercube\" or \"sobol\""));
    }
    match (table.optional("runs"), design.is_drawn()) {
        (None, true) => {
            return Err(table.missing("runs", "runs = 10000, or give --runs"));
        }
        (Some(field), false) => {
            return Err(field
                .fail(format!("the number of runs follows from design = \"{}\"", design.word()))
                .next("leave runs out, or take design = \"random\""));
        }
        _ => {}
    }
    let interval = table.number_if_given("interval")?;
    for &(name, until) in &context.experiments {
        if let (Some(interval), Some(field)) = (interval, table.optional("interval"))
            && (interval > until || until / interval > super::MOST_SAMPLES)
        {
            return Err(field
                .fail(format!("an interval of {interval} s does not suit \"{name}\""))
                .allowed(format!("up to {until} s, and no more than 1e9 rows")));
        }
    }
    let name = |field: &Field| field.text().map(str::to_string);
    let names = |field: Field| field.filled_list()?.iter().map(name).collect::<Result<_>>();
    let figures = table.optional("figures").map(names).transpose()?;
    let solver = table.optional("solver").map_or(Ok(Running::Beside), |field| field.choice(&Running::ALL))?;
    Ok(Some(Sweeping { runs, design, seed: table.seed()?, interval, vary, from, indices, figures, solver }))
}

fn origin(field: &Field, context: &Context) -> Result<Origin> {
    let text = field.text()?;
    if context.machine.bridge.is_some() {
        return Err(field
            .fail("gantries are not fitted yet, so the uncertainty of their parameters is unknown")
            .next("leave it out, and say in [sweep.vary] how each parameter varies"));
    }
    if text != "uncertainty" {
        if context.fit.is_none() {
            return Err(field
                .fail("draws of a posterior belong to the parameters of a table [fit], which is missing")
                .next("sweep the fitted.toml that lies beside the draws"));
        }
        let path = context.folder.join(text);
        if !path.is_file() {
            return Err(field
                .fail(format!("there is no file {}", path.display()))
                .allowed("\"uncertainty\", or the file posterior.csv that `taut fit --posterior --out DIR` writes"));
        }
        return context.folder.name(field).map(Origin::Posterior);
    }
    match context.known {
        [] => Err(field
            .fail("this case has no table [uncertainty]")
            .next("sweep the fitted.toml that `taut fit --out DIR` writes")),
        _ => Ok(Origin::Uncertainty),
    }
}

const KINDS: &str = "\"20 %\", uniform = [least, most], normal = [mean, deviation], log_normal = [median, deviation of the logarithm], \
                     values = [...], grid = [from, to, count], factors = [...]";

/// The variation at a key of `[sweep.vary]`.
fn variation(field: &Field, key: &str, design: Sampling, machine: &Machine) -> Result<Variation> {
    let row = machine.row(key.split(" = ").next().unwrap_or(key));
    check_key(field, key, machine)?;
    let node = match &field.node.kind {
        NodeValue::Text(text) => short(field, text)?,
        NodeValue::List(_) => table_of(field.node, "values", field.node.kind.clone()),
        _ => field.node.clone(),
    };
    let field = &Field { node: &node, ..field.clone() };
    let table = field.table()?;
    table.check_keys(&["share", "uniform", "normal", "log_normal", "values", "grid", "factors", "within"], &[])?;
    let mut kinds = table.keys().filter(|kind| *kind != "within");
    let (Some(kind), None) = (kinds.next(), kinds.next()) else {
        let count = table.keys().filter(|kind| *kind != "within").count();
        return Err(field.fail(format!("expected one distribution, found {count}")).allowed(format!("one of {KINDS}")));
    };
    let Some(at) = table.optional(kind) else { return Err(field.fail("this is empty")) };
    if key == "all" && !matches!(kind, "share" | "factors") {
        return Err(at
            .fail("parameters of different kinds have no values in common")
            .allowed("a share such as \"20 %\", or factors = [2, 0.5]"));
    }
    if !design.is_drawn() && design == Sampling::Grid && !matches!(kind, "values" | "grid" | "factors") {
        return Err(at
            .fail(format!("{} is a density, without values for a grid", kind.replace('_', "-")))
            .allowed("values = [...], grid = [from, to, count] or factors = [...]")
            .next("or take design = \"sobol\""));
    }
    let number = |field: &Field| match row {
        Some(row) => field.number_of(row),
        None => plain(field, "a number in SI units"),
    };
    let within = match table.optional("within") {
        None => None,
        Some(field) => {
            let [low, high] = pair(&field, "two: the least and the most")?;
            let ends = [number(&low)?, number(&high)?];
            if ends[0] >= ends[1] {
                return Err(field
                    .fail(format!("{} is not below {}", ends[0], ends[1]))
                    .allowed("the least, then the most"));
            }
            Some(ends)
        }
    };
    let kind = match kind {
        "share" => Kinds::Share(at.number_of(&SHARE)?),
        "values" => Kinds::Values(at.filled_list()?.iter().map(number).collect::<Result<_>>()?),
        "factors" => Kinds::Factors(at.filled_list()?.iter().map(|f| f.number_of(&FACTOR)).collect::<Result<_>>()?),
        "grid" => {
            let list = at.list()?;
            let [from, to, count] = &list[..] else {
                return Err(at
                    .fail(format!("the list has {} values", list.len()))
                    .allowed("three: from, to and how many"));
            };
            let count = count.number_of(&COUNT)? as usize;
            let (from, to) = (number(from)?, number(to)?);
            Kinds::Values((0..count).map(|k| from + (to - from) * k as f64 / (count - 1) as f64).collect())
        }
        kind => Kinds::Drawn(prior_of(kind, &at, row.map_or(key, |row| row.key))?),
    };
    if let (Kinds::Values(_) | Kinds::Factors(_), Some(field)) = (&kind, table.optional("within")) {
        return Err(field.fail("given values cannot be truncated").next("leave `within` out"));
    }
    Ok(Variation { kind, within })
}

const SHARE: Parameter = Parameter::unwritten("", Range { above: true, below: true, ..Range::new(0.0, 1.0) }, "20 %");
const FACTOR: Parameter = Parameter::unwritten("", Range::new(1e-6, 1e6), "2");
const COUNT: Parameter = Parameter::unwritten("", Range::whole(2.0, MOST_VALUES as f64), "11");

/// Refuses names that are no parameter of this machine.
fn check_key(field: &Field, key: &str, machine: &Machine) -> Result<()> {
    match key {
        "all" => Ok(()),
        _ => free(field, key, machine),
    }
}

/// A short form as the table that it stands for: `20 %`, `uniform(1 kg, 2 kg)`.
fn short(field: &Field, text: &str) -> Result<Node> {
    let plain = text.trim().trim_start_matches(['±', '+', '-']).trim_start_matches(['/', '-']);
    if plain.ends_with('%') && plain.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
        return Ok(table_of(field.node, "share", NodeValue::Text(plain.to_string())));
    }
    let wrong = || {
        field.fail(format!("\"{}\" is not a distribution of a parameter", text.trim())).allowed(
            "a share such as 20 %, uniform(least, most), normal(mean, deviation), log-normal(median, deviation), values(a, b, …), \
             grid(from, to, count) or factors(a, b, …)",
        )
    };
    let (name, rest) = text.split_once('(').ok_or_else(wrong)?;
    let inside = rest.trim_end().strip_suffix(')').ok_or_else(wrong)?;
    let name = name.trim().replace('-', "_");
    let known = ["uniform", "normal", "log_normal", "values", "grid", "factors"];
    if !known.contains(&name.as_str()) {
        return Err(wrong());
    }
    let of = |part: &str| {
        let part = part.trim();
        let kind = part.parse::<f64>().map_or_else(|_| NodeValue::Text(part.to_string()), NodeValue::Float);
        Node { span: field.node.span.clone(), kind }
    };
    let values = inside.split(',').filter(|part| !part.trim().is_empty()).map(of).collect();
    Ok(table_of(field.node, &name, NodeValue::List(values)))
}

/// A table of one entry where `node` stands.
fn table_of(node: &Node, key: &str, kind: NodeValue) -> Node {
    let span = node.span.clone();
    let entry = Entry { key: key.to_string(), key_span: span.clone(), node: Node { span: span.clone(), kind } };
    Node { span, kind: NodeValue::Table(vec![entry]) }
}
