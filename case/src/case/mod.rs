//! The case file: TOML in, a [`Case`] out, and every mistake told with its line.

mod bounds;
mod chosen;
mod controller;
mod drawn;
mod files;
mod fit;
mod friction;
mod gantry;
mod get;
mod input;
mod log;
mod machine;
mod measurement;
mod motion;
mod reader;
mod set;
mod sheet;
mod source;
mod stepper;
mod suggestion;
mod sweep;
mod template;
mod tree;
mod tune;

pub use crate::plan::{Experiment, file_name};
pub use bounds::LARGEST_FILE;
pub use drawn::{drawn, draws_are_of_one_machine, machines, parameters};
pub use files::{Files, InputFile, Unread};
pub use fit::{Nuisances, Per, Plan, Prior, Scope, matches};
pub use get::{Given, Number};
pub use motion::Move;
pub use stepper::needs_motors;
pub use sweep::{Kinds, Origin, Running, Sampling, Sweeping, Variation};
pub use template::{TEMPLATE, Template, gantry_template};
pub use tune::{Cost, EFFORTS, Known, Tuning};

use crate::design::Design;
use crate::error::{Error, Result};
use crate::log::Log;
use crate::machine::axis::{CART, LABELS};
use crate::machine::{Machine, MachineKind, Measurement};
use crate::mechanism::State;
use crate::reach::feasible::Shortfall;
use crate::signal::Signal;
use files::Folder;
use reader::{Field, Table};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// Most rows of a result.
const MOST_SAMPLES: f64 = 1e9;

/// Longest name of an experiment, in characters.
const LONGEST_NAME: usize = 100;

/// Everything needed to repeat a run.
#[derive(Debug, Clone)]
pub struct Case {
    /// The title of the file; its name where it has none.
    pub title: String,
    /// The machine.
    pub machine: Machine,
    /// How its runs are recorded, where the file says so.
    pub measurement: Option<Measurement>,
    /// The experiments, in the file's order.
    pub experiments: Vec<Experiment>,
    /// The experiments whose files were not read; none but where [`Case::read_for`] left them out.
    pub unread: Vec<Unread>,
    /// The controller, where the file has one.
    pub controller: Option<Design>,
    /// Where it should be, in the file's order.
    pub moves: Vec<Move>,
    /// The plan of a fit to their logs, where the file has one.
    pub fit: Option<Plan>,
    /// The tuning of the controller, where the file has one.
    pub tune: Option<Tuning>,
    /// The estimates of a fit, as it left them.
    pub known: Vec<Known>,
    /// The sweep, where the file has one.
    pub sweep: Option<Sweeping>,
    /// The text it was read from, with `--set` applied: read again, it gives the same case.
    pub text: String,
    /// The files that its inputs and logs name, in the text's order.
    pub files: Vec<InputFile>,
}

/// The machines that a command takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Accepted {
    /// All of them.
    All,
    /// Those with motors that are commanded by voltage or current.
    Motors,
}

impl Case {
    /// The limits that the reference of each move exceeds under the case's controller, with the name of the move; moves
    /// that can be followed are left out.
    pub fn shortfalls(&self) -> Vec<(&str, Vec<Shortfall>)> {
        let Some(design) = &self.controller else { return Vec::new() };
        let moves = self.moves.iter().map(|motion| (&*motion.name, motion.shortfalls(&self.machine, design)));
        moves.filter(|(_, short)| !short.is_empty()).collect()
    }

    /// Reads a case file.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::read_with(path, &[])
    }

    /// Reads a case file with changes, each as `KEY=VALUE`.
    pub fn read_with(path: impl AsRef<Path>, changes: &[&str]) -> Result<Self> {
        let path = path.as_ref();
        Self::from_text_with(path, &read_text(path)?, changes)
    }

    /// Reads a case with the files of these experiments only. An experiment whose files are not read, or cannot be, is
    /// none of the case's experiments; [`Case::unread`] says why, and whoever asks for it is told.
    pub fn read_for(path: impl AsRef<Path>, changes: &[&str], files: Files) -> Result<Self> {
        let path = path.as_ref();
        Self::from_text_for(path, &read_text(path)?, changes, files)
    }

    /// Reads a case for what takes some machines alone; rejects all others.
    pub fn read_accepting(
        path: impl AsRef<Path>,
        changes: &[&str],
        (files, accepted): (Files, Accepted),
    ) -> Result<Self> {
        let path = path.as_ref();
        Self::from_text_accepting(path, &read_text(path)?, changes, (files, accepted))
    }

    /// Reads a case from text; `name` stands in messages, and paths in the text are relative to its folder.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// let case = Case::from_text("axis.toml", TEMPLATE)?;
    /// assert_eq!(case.machine.pulley_radius, 0.0194);
    ///
    /// let misspelt = TEMPLATE.replace("torque_constant", "torque_konstant");
    /// let error = Case::from_text("axis.toml", &misspelt).unwrap_err();
    /// assert!(error.to_string().contains("did you mean `torque_constant`?"));
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn from_text(name: impl AsRef<Path>, text: &str) -> Result<Self> {
        Self::from_text_with(name, text, &[])
    }

    /// Reads a case from text with changes, each as `KEY=VALUE`.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// let case = Case::from_text_with("axis.toml", TEMPLATE, &["cart.mass=0.5 kg", "experiment.0.until=2s"])?;
    /// assert_eq!(case.machine.cart.mass, 0.5);
    /// assert_eq!(case.experiments[0].until, 2.0);
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn from_text_with(name: impl AsRef<Path>, text: &str, changes: &[&str]) -> Result<Self> {
        let case = Self::from_text_for(name, text, changes, Files::All)?;
        case.complete()?;
        Ok(case)
    }

    /// Reads a case from text with the files of these experiments only, as [`Case::read_for`] does.
    pub fn from_text_for(name: impl AsRef<Path>, text: &str, changes: &[&str], files: Files) -> Result<Self> {
        Self::from_text_accepting(name, text, changes, (files, Accepted::All))
    }

    /// Reads a case from text for what takes some machines alone; rejects all others.
    pub fn from_text_accepting(
        name: impl AsRef<Path>,
        text: &str,
        changes: &[&str],
        (files, accepted): (Files, Accepted),
    ) -> Result<Self> {
        let name = name.as_ref();
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let source = set::apply(name, text, changes)?;
        let tree = source.tree()?;
        let root = Field::root(&source, &tree).table()?;
        if root.keys().next().is_none() {
            return Err(Error::new("this case file is empty")
                .in_file(name)
                .next("write a commented one to start from with `taut init`"));
        }
        let kind = gantry::kind(&root)?;
        if accepted != Accepted::All && root.optional("stepper").is_some() {
            return Err(stepper::no_motor(&root));
        }
        let tables = if kind == MachineKind::Axis { AXIS_TABLES.to_vec() } else { gantry::tables(&root, kind)? };
        root.check_keys(&tables, &[])?;

        let title = title(&root, name)?;
        let machine = match kind {
            MachineKind::Axis => machine::machine(&root)?,
            _ => gantry::machine(&root, kind, name)?,
        };
        let folder = Folder::new(name, files);
        let controller = controller::controller(&root, &machine)?;
        let moves = motion::moves(&root, &machine, controller.as_ref())?;
        // A machine alone can be shown, shaped, exported, and an experiment can be designed for it.
        let (experiments, unread) = match root.optional("experiment") {
            None => (Vec::new(), Vec::new()),
            Some(_) => experiments(&root, &machine, &folder)?,
        };
        let measurement = measurement::measurement(&root, &machine, &experiments)?;
        let fit = fit::plan(&root, &machine, &experiments, unread.is_empty())?;
        let tune = tune::tuning(&root, &machine, controller.as_ref(), &moves)?;
        let known = tune::known(&root)?;
        let context = sweep::Context {
            machine: &machine,
            experiments: experiments.iter().map(|experiment| (experiment.name.as_str(), experiment.until)).collect(),
            fit: fit.as_ref(),
            known: &known,
            folder: &folder,
        };
        let sweep = sweep::sweeping(&root, &context)?;
        let files = folder.files();
        let text = source.text.clone();
        Ok(Self {
            title,
            machine,
            measurement,
            experiments,
            unread,
            controller,
            moves,
            fit,
            tune,
            known,
            sweep,
            text,
            files,
        })
    }
}

/// The tables of a case of an axis.
const AXIS_TABLES: [&str; 21] = [
    "title",
    "kind",
    "motor",
    "stepper",
    "drive",
    "amplifier",
    "drive_pulley",
    "idler_pulley",
    "cart",
    "belt",
    "travel",
    "encoder",
    "scale",
    "measurement",
    "experiment",
    "controller",
    "move",
    "fit",
    "tune",
    // Values and intervals of fitted parameters.
    "uncertainty",
    "sweep",
];

/// The text of a case with other names for the files of its inputs; it is to lie where these names lead to them.
pub fn text_with(whole: &str, files: &[InputFile], name: impl Fn(&InputFile) -> String) -> String {
    let mut text = String::with_capacity(whole.len());
    let mut end = 0;
    for file in files {
        text.push_str(&whole[end..file.place.start]);
        text.push_str(&toml_edit::Value::from(name(file)).to_string());
        end = file.place.end;
    }
    text + &whole[end..]
}

/// The title of the file; its name where it has none.
fn title(root: &Table, name: &Path) -> Result<String> {
    match root.optional("title") {
        Some(field) => Ok(field.text()?.to_string()),
        None => Ok(name.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()),
    }
}

/// The text of a case file.
fn read_text(path: &Path) -> Result<String> {
    let fail = |what: String| Error::new(what).in_file(path);
    // A little more than a case may have: what is too long is told with the rest.
    let bytes = crate::files::read(path, bounds::LARGEST_FILE + 1).map_err(|e| {
        let error = fail(format!("this case file cannot be read: {}", told(&e)));
        match e.kind() {
            std::io::ErrorKind::NotFound => error.next("check the path, or write a new case with `taut init`"),
            std::io::ErrorKind::TimedOut => error.next("write the case to a file, or to standard input: -"),
            _ => error,
        }
    })?;
    String::from_utf8(bytes).map_err(|e| {
        fail(format!("this is not a text file: byte {} is not UTF-8", e.utf8_error().valid_up_to() + 1))
            .next("give the path of a case file in TOML, saved as UTF-8")
    })
}

/// The system's error on a file, in our words.
fn told(error: &std::io::Error) -> String {
    use std::io::ErrorKind as MachineKind;
    match error.kind() {
        MachineKind::NotFound => "there is no such file".to_string(),
        MachineKind::PermissionDenied => "permission is denied".to_string(),
        MachineKind::IsADirectory => "it is a folder".to_string(),
        _ => error.to_string(),
    }
}

/// The tables of the experiments.
fn listed<'a>(root: &Table<'a>) -> Result<Vec<Field<'a>>> {
    let such_as = "[[experiment]] with name, input, until and every";
    let field = root.required("experiment", such_as)?;
    if field.is_table() {
        return Err(field
            .fail("expected a list of tables")
            .next("write [[experiment]] with double brackets: there can be several"));
    }
    let list = field.list()?;
    if list.is_empty() {
        return Err(field.fail("the list is empty").next(format!("add {such_as}")));
    }
    Ok(list)
}

fn experiments(root: &Table, machine: &Machine, folder: &Folder) -> Result<(Vec<Experiment>, Vec<Unread>)> {
    let (mut experiments, mut unread) = (Vec::new(), Vec::new());
    let mut files = HashMap::new();
    for (place, field) in listed(root)?.into_iter().enumerate() {
        let own = field.clone().named("experiment");
        let table = own.table()?;
        let name = named(&table)?;
        let initial = || initial(&table, machine);
        match folder.experiment((place, &name), &table, || experiment(&own, machine, folder), initial)? {
            Ok(runs) => {
                for run in runs {
                    unique(&field, &run.name, &mut files)?;
                    experiments.push(run);
                }
            }
            Err(left) => {
                unique(&field, &name, &mut files)?;
                unread.push(left);
            }
        }
    }
    Ok((experiments, unread))
}

/// The name of an experiment.
fn named(table: &Table) -> Result<String> {
    let name = table.required("name", "for example name = \"5 V pulse\"")?;
    check_name(&name)?;
    Ok(name.text()?.to_string())
}

/// Refuses a name that another experiment has, or that leads to the same files; `files` are those so far and whose they
/// are.
fn unique(field: &Field, name: &str, files: &mut HashMap<String, String>) -> Result<()> {
    let file = file_name(name);
    let Some(other) = files.insert(file.clone(), name.to_string()) else { return Ok(()) };
    let what = match name == other {
        true => format!("\"{name}\" is the name of two experiments"),
        false => format!("\"{other}\" and \"{name}\" would both be written to {file}.csv"),
    };
    let field = field.table()?.required("name", "a name")?;
    Err(field.fail(what).next("give each experiment a name of its own"))
}

/// The experiment of a table; several, if its log is split into runs.
fn experiment(field: &Field, machine: &Machine, folder: &Folder) -> Result<Vec<Experiment>> {
    let field = Field { input_unit: machine.drives[0].amplifier.mode.unit(), ..field.clone() };
    let table = field.table()?;
    table.check_keys(&["name", "input", "log", "campaign"], &[])?;
    let name = named(&table)?;
    let Some(log) = table.optional("log") else {
        let (until, every) = times(&table, None)?;
        let inputs = inputs(&table, machine, &input::Context::new(machine, folder, until))?;
        let initial = initial(&table, machine)?;
        if let Some(field) = table.optional("input").filter(|_| machine.stepper().is_some()) {
            stepper::check_commands(&field, machine, &inputs, (&initial, until))?;
        }
        return Ok(vec![Experiment { name, inputs, until, every, initial, log: None }]);
    };
    let (initial, driven) = (initial(&table, machine)?, table.optional("input").is_some());
    let runs = log::logs(&log, machine, folder, driven)?;
    let of_run = |(run, mut log): (Option<String>, Log)| {
        let (until, every) = times(&table, Some(&log))?;
        let inputs = match driven {
            true => {
                let signals = inputs(&table, machine, &input::Context::new(machine, folder, until))?;
                let values = |signal: &Signal| log.time.iter().map(|&t| signal.value(t)).collect();
                log.inputs = signals.iter().map(values).collect();
                signals
            }
            false => log.signals(),
        };
        log.name = run.map_or(name.clone(), |run| format!("{name}/{run}"));
        Ok(Experiment { name: log.name.clone(), inputs, until, every, initial, log: Some(Arc::new(log)) })
    };
    runs.into_iter().map(of_run).collect()
}

/// The input of each drive of an experiment.
fn inputs(table: &Table, machine: &Machine, context: &input::Context) -> Result<Vec<Signal>> {
    if machine.drives.len() > 1 {
        return gantry::inputs(table, machine, context);
    }
    let unit = machine.drives[0].amplifier.mode.unit();
    let such_as = match unit {
        "m" => "for example input = { ramp = \"100 mm\", over = \"1 s\" }".into(),
        _ => format!("for example input = {{ pulse = \"5 {unit}\", for = \"0.25 s\" }}"),
    };
    Ok(vec![input::signal(&table.required("input", &such_as)?, context)?])
}

/// `until` and `every`; those of the log where the table does not say.
fn times(table: &Table, log: Option<&Log>) -> Result<(f64, f64)> {
    let of_log = |key: &str, value: fn(&Log) -> f64| match (table.optional(key), log) {
        (None, Some(log)) => Ok(value(log)),
        _ => table.number(key),
    };
    let until = of_log("until", |log| log.time.last().copied().unwrap_or_default())?;
    let every = of_log("every", Log::interval)?;
    let at = |key: &str| table.optional(key).unwrap_or_else(|| table.field.clone());
    if every > until {
        return Err(at("every")
            .fail(format!("an interval of {every} s is longer than the run of {until} s"))
            .allowed(format!("up to {until} s")));
    }
    if until / every > MOST_SAMPLES {
        return Err(at("every")
            .fail(format!("this makes {} rows", crate::quantity::rounded(until / every)))
            .allowed(format!("up to {} rows", crate::quantity::rounded(MOST_SAMPLES)))
            .next("take a longer interval: it does not affect the accuracy"));
    }
    Ok((until, every))
}

fn check_name(field: &Field) -> Result<()> {
    let name = field.text()?;
    let usable = "letters, digits, spaces and signs other than / and \\";
    if !name.chars().any(char::is_alphanumeric) {
        return Err(field.fail(format!("\"{}\" holds no letter and no digit", name.escape_debug())).allowed(usable));
    }
    if let Some(c) = name.chars().find(|c| matches!(c, '/' | '\\') || c.is_control()) {
        return Err(field
            .fail(format!("a name with `{}` would leave the output folder", c.escape_debug()))
            .allowed(usable));
    }
    match name.chars().count() {
        n if n > LONGEST_NAME => {
            Err(field.fail(format!("the name has {n} characters")).allowed(format!("up to {LONGEST_NAME}")))
        }
        _ => Ok(()),
    }
}

/// The state at the start of an experiment, at rest at the origin where its table does not say.
fn initial(experiment: &Table, machine: &Machine) -> Result<State> {
    let Some(field) = experiment.optional("initial") else { return Ok(State::default()) };
    if machine.kind != MachineKind::Axis {
        return gantry::initial(&field.named("gantry.initial").table()?, machine);
    }
    let table = field.table()?;
    table.check_keys(&[], &[])?;
    if let Some(current) = table.optional("motor_current").filter(|_| machine.stepper().is_some()) {
        return Err(stepper::begins_energised(&current));
    }
    if let Some(current) = table.optional("motor_current")
        && !machine.mechanism().drives.iter().any(|drive| drive.has_current_state())
    {
        return Err(current.fail("this current would have no effect").next(
            "it needs motor.inductance above zero in voltage mode, or amplifier.bandwidth in current mode; or leave it out",
        ));
    }
    let mut state = State::default();
    for (body, label) in LABELS.into_iter().enumerate() {
        let way = if body == CART { "position" } else { "angle" };
        state.position[body] = table.number(&format!("{}_{way}", label.key))?;
        state.speed[body] = table.number(&format!("{}_speed", label.key))?;
    }
    state.current[0] = table.number("motor_current")?;
    Ok(state)
}
