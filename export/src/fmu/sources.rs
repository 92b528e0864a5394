//! The machine of an FMU as sources in C, for platforms that the shared object is not for: the plant of `export c` with
//! inputs that rise at a rate, its variables as a table, and the functions of the standard around both, for
//! co-simulation.

use super::{BINARY, Causality, FmiType, Model, Role, Variability, Variable, Version};
use crate::STEP;
use crate::c;
use crate::error::{Error, Result};
use crate::mechanism::{Form, Mechanism, Shown, State};
use crate::solve::Quantity;
use crate::tables::{ElementKind, Tables};
use std::fmt::Write;

const INSTANCE: &str = include_str!("sources/instance.c");
const TWO: &str = include_str!("sources/fmi2.c");
const THREE: &str = include_str!("sources/fmi3.c");

/// The file that is compiled; it includes the others.
pub(super) fn compiled(version: Version) -> &'static str {
    match version {
        Version::Two => "fmi2.c",
        Version::Three => "fmi3.c",
    }
}

/// The files of the folder `sources`: names and texts. Errors: a machine that `export c` does not cover, or one with
/// its controller inside.
pub fn sources(model: &Model, version: Version) -> Result<Vec<(String, String)>> {
    if model.design.is_some() {
        return Err(Error::new("the controller inside is not written in C beside its machine"));
    }
    let mut tables = Tables::new(&model.mechanism(&model.defaults())?)?;
    let variables = Writer::new(model, &tables).text(&mut tables)?;
    let tables = tables.with_ramps();
    let step = STEP.min(c::longest_step(&tables));
    let [header, plant] = c::plant(&tables, (&model.title, "machine"), step, "LOCAL ")?;
    let title = c::plain(&model.title);
    let functions = match version {
        Version::Two => TWO,
        Version::Three => THREE,
    };
    let functions = functions.replace("@title@", &title).replace("@version@", env!("CARGO_PKG_VERSION"));
    let mut files = vec![
        (compiled(version).to_string(), functions),
        ("instance.c".into(), INSTANCE.replace("@variables@", variables.trim_end())),
        ("machine.c".into(), plant),
        ("machine.h".into(), header),
    ];
    if version == Version::Three {
        files.push(("buildDescription.xml".into(), build_description()));
    }
    Ok(files)
}

/// How the sources are compiled, of FMI 3.0; in 2.0 the description of the model lists the files.
fn build_description() -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription fmiVersion=\"3.0\">\n  \
         <BuildConfiguration modelIdentifier=\"{BINARY}\">\n    <SourceFileSet language=\"C99\">\n      \
         <SourceFile name=\"{}\"/>\n    </SourceFileSet>\n  </BuildConfiguration>\n</fmiBuildDescription>\n",
        compiled(Version::Three)
    )
}

/// A variable as the table has it: what it stands for, where that is found, by which factor and within which limit.
struct Entry {
    what: &'static str,
    index: usize,
    table: String,
    factor: f64,
    limit: f64,
}

impl Entry {
    fn new(what: &'static str, index: usize) -> Self {
        Self { what, index, table: "0U".into(), factor: 1.0, limit: 0.0 }
    }

    fn row(table: String) -> Self {
        Self { table, ..Self::new("IS_ROW", 0) }
    }
}

/// Writes the tables of variables.
struct Writer<'m> {
    model: &'m Model,
    mechanism: Mechanism,
    /// Places of the rates of speeds and of the currents.
    speed: Vec<usize>,
    current: Vec<Option<usize>>,
    first_input: usize,
    /// Records of bodies whose friction is shown, and of springs whose contact is.
    friction: Vec<String>,
    contact: Vec<String>,
}

impl<'m> Writer<'m> {
    fn new(model: &'m Model, tables: &Tables) -> Self {
        let mechanism = tables.mechanism.clone();
        Self {
            model,
            speed: tables.layout.speed[..mechanism.bodies.len()].to_vec(),
            current: tables.layout.current[..mechanism.drives.len()].to_vec(),
            first_input: tables.layout.states,
            mechanism,
            friction: Vec::new(),
            contact: Vec::new(),
        }
    }

    /// All of it; rows that it needs are added to the tables.
    fn text(mut self, tables: &mut Tables) -> Result<String> {
        let mut rows = Vec::new();
        for variable in &self.model.variables {
            let entry = self.entry(variable, tables)?;
            rows.push(record(variable, &entry));
        }
        let quantity = |wanted: Quantity| self.model.quantities.iter().position(|(own, _)| *own == wanted);
        let places = |list: &[Option<usize>]| list.iter().map(|place| byte(*place)).collect::<Vec<_>>().join(", ");
        let drives = 0..self.mechanism.drives.len();
        let currents: Vec<Option<usize>> = drives.map(|drive| quantity(Quantity::Current(drive))).collect();
        let starts: Vec<String> = self.model.quantities.iter().map(|(_, start)| format!("{start:?}")).collect();
        let mut text = format!(
            "#define TOKEN \"{}\"\n#define BODIES MACHINE_BODIES\n#define DRIVES MACHINE_DRIVES\n#define INPUTS {}U\n\
             #define QUANTITIES {}U\n/* Place of the first input in z; behind all of them stand their rates. */\n\
             #define FIRST_INPUT {}U\n#define VARIABLE_COUNT {}U\n\n",
            self.model.token,
            self.inputs().len(),
            starts.len(),
            self.first_input,
            rows.len(),
        );
        let _ = writeln!(text, "/* The drive that takes each input. */");
        let _ = writeln!(text, "static const uint8_t INPUT_DRIVE[] = {{{}}};", places(&self.inputs()));
        let _ =
            writeln!(text, "/* Currents that are states: their places, and which integrated quantities they are. */");
        let _ = writeln!(text, "static const uint8_t CURRENT_PLACE[] = {{{}}};", places(&self.current));
        let _ = writeln!(text, "static const uint8_t CURRENT_OF[] = {{{}}};", places(&currents));
        let _ = writeln!(text, "static const double QUANTITY_START[] = {{{}}};\n", starts.join(", "));
        text += "/* Where bodies start: from where what they go along with is counted, and by which ratio. */\n\
                 typedef struct {\n    double position;\n    double speed;\n    double from;\n    double ratio;\n    \
                 uint8_t position_of; /* quantities */\n    uint8_t speed_of;\n    uint8_t is_leader;\n} body_start;\n\n";
        let bodies = (0..self.mechanism.bodies.len()).map(|body| self.body(body, &quantity)).collect::<Vec<_>>();
        text += &records("body_start", "BODY_START", &bodies, "");
        text += "/* Friction: by speed, forward and backward; of a body at rest that of its load, by so many tables. */\n\
                 typedef struct {\n    double viscous[2];\n    double coulomb[2];\n    uint16_t load;\n    uint8_t loads;\n    \
                 uint8_t body;\n} friction;\n\n";
        text += &records("friction", "FRICTION", &self.friction, "{{0.0, 0.0}, {0.0, 0.0}, 0U, 0U, 0U}");
        text += "/* Springs that are slack or push: their element, and what is shown of each thing it does. */\n\
                 typedef struct {\n    uint8_t element;\n    int8_t code[5];\n} contact;\n\n";
        text += &records("contact", "CONTACT", &self.contact, "{255U, {0}}");
        text += &records("variable", "VARIABLE", &rows, "");
        Ok(text)
    }

    /// The drive of each input: those of the machine, then the forces.
    fn inputs(&self) -> Vec<Option<usize>> {
        let forces = 0..self.model.loads.len();
        (0..self.model.drives()).map(Some).chain(forces.map(|load| self.model.force_input(load))).collect()
    }

    fn body(&self, body: usize, quantity: &dyn Fn(Quantity) -> Option<usize>) -> String {
        let State { position, speed, .. } = *self.model.start();
        let leader = self.mechanism.leader(body);
        let of = [Quantity::Position(leader), Quantity::Speed(leader)].map(|wanted| byte(quantity(wanted)));
        format!(
            "{{{:?}, {:?}, {:?}, {:?}, {}, {}, {}U}}",
            position[body],
            speed[body],
            position[leader],
            self.mechanism.ratio(body),
            of[0],
            of[1],
            u8::from(leader == body)
        )
    }

    fn entry(&mut self, variable: &Variable, tables: &mut Tables) -> Result<Entry> {
        let quantity = |index: usize| self.model.quantities[index].0;
        Ok(match variable.role {
            Role::Time => Entry::new("IS_TIME", 0),
            Role::Input(drive) => Entry::new("IS_INPUT", drive),
            Role::Force(load) => Entry::new("IS_INPUT", self.model.drives() + load),
            Role::Parameter(..) => Entry::new("IS_FIXED", 0),
            Role::Output(column) => self.column(self.mechanism.columns[column].shown, tables)?,
            Role::Quantity(index) => match quantity(index) {
                Quantity::Position(body) => Entry::new("IS_POSITION", body),
                Quantity::Speed(body) => Entry::new("IS_SPEED", body),
                Quantity::Current(drive) => Entry::new("IS_STATE", self.current[drive].unwrap_or(0)),
                Quantity::Bristle(_) => return Err(curved(variable)),
            },
            // Tables of rates stand by the places of states.
            Role::Rate(index) => match quantity(index) {
                Quantity::Position(body) => Entry::new("IS_SPEED", body),
                Quantity::Speed(body) => Entry::row(format!("{}U", self.speed[body])),
                Quantity::Current(drive) => Entry::row(format!("{}U", self.current[drive].unwrap_or(0))),
                Quantity::Bristle(_) => return Err(curved(variable)),
            },
            Role::Condition(_) => Entry::new("IS_HIDDEN", 0),
            Role::Reference(_) | Role::Ahead(_) | Role::Error(_) | Role::Command(_) => return Err(curved(variable)),
        })
    }

    fn column(&mut self, shown: Shown, tables: &mut Tables) -> Result<Entry> {
        let amplifier = |drive: usize| &self.mechanism.drives[drive].amplifier;
        Ok(match shown {
            Shown::Time => Entry::new("IS_TIME", 0),
            Shown::Input(drive) => Entry::new("IS_TAKEN", drive),
            Shown::Voltage(drive) => {
                let limit = amplifier(drive).voltage_limit.unwrap_or(0.0);
                Entry { limit, ..Entry::row(format!("VOLTAGE_TABLE + {drive}U")) }
            }
            Shown::Current(drive) => {
                let limit = amplifier(drive).current_limit.unwrap_or(0.0);
                Entry { limit, ..Entry::row(format!("CURRENT_TABLE + {drive}U")) }
            }
            Shown::Position(body, factor) => Entry { factor, ..Entry::new("IS_POSITION", body) },
            Shown::Speed(body, factor) => Entry { factor, ..Entry::new("IS_SPEED", body) },
            Shown::Stretch(spring) => {
                let row = tables.ask(&|_, _| Form::stretch(spring))?;
                Entry::row(format!("OTHER_TABLE + {row}U"))
            }
            Shown::Force(spring, factor) => Entry { factor, ..Entry::row(format!("FORCE_TABLE + {spring}U")) },
            Shown::Friction(body) => Entry::new("IS_FRICTION", self.friction(body, tables)?),
            Shown::Motion(body) => Entry::new("IS_MOTION", body),
            Shown::Contact(spring) => Entry::new("IS_CONTACT", self.contact(spring, tables)),
            Shown::Counts(body, factor) => Entry { factor, ..Entry::new("IS_COUNTS", body) },
            Shown::SecondPhase(_) => return Err(Error::new("a stepper is not linear between events")),
            Shown::Bristle(_) => return Err(Error::new("bristles are not linear between events")),
        })
    }

    /// Adds what the friction on a body is made of, and says where.
    fn friction(&mut self, body: usize, tables: &mut Tables) -> Result<usize> {
        let law = self.mechanism.friction(body);
        let (mut load, mut loads) = (0, 0);
        if self.mechanism.leader(body) == body {
            let loses = self.mechanism.drives.iter().any(|drive| drive.loses());
            let ways = [(true, true), (true, false), (false, true), (false, false)];
            for (positive, forward) in ways.into_iter().take(if loses { 4 } else { 1 }) {
                let row = tables.ask(&|mechanism, mode| mechanism.load(body, forward, &mode.with_torque(positive)))?;
                load = if loads == 0 { row } else { load };
                loads += 1;
            }
        }
        let sides = [law.forward, law.backward];
        let [viscous, coulomb] = [sides.map(|side| side.viscous), sides.map(|side| side.coulomb)]
            .map(|[forward, backward]| format!("{{{forward:?}, {backward:?}}}"));
        let table = if loads == 0 { "0U".to_string() } else { format!("OTHER_TABLE + {load}U") };
        self.friction.push(format!("{{{viscous}, {coulomb}, {table}, {loads}U, {body}U}}"));
        Ok(self.friction.len() - 1)
    }

    /// Adds what is shown of a spring, and says where.
    fn contact(&mut self, spring: usize, tables: &Tables) -> usize {
        let is_own = |kind: ElementKind| kind == ElementKind::Span(spring) || kind == ElementKind::Gap(spring);
        let element = tables.elements.iter().position(|element| is_own(element.kind));
        let codes: Vec<String> = element.map_or(Vec::new(), |element| {
            tables.elements[element].states.iter().map(|does| Tables::shown_code(*does).to_string()).collect()
        });
        let codes = if codes.is_empty() { "0".to_string() } else { codes.join(", ") };
        self.contact.push(format!("{{{}, {{{codes}}}}}", byte(element)));
        self.contact.len() - 1
    }
}

fn curved(variable: &Variable) -> Error {
    Error::new(format!("{} is none of a machine that is linear between its events", variable.name))
}

/// A number of something, or the one that stands for none.
fn byte(number: Option<usize>) -> String {
    format!("{}U", number.unwrap_or(255))
}

fn record(variable: &Variable, entry: &Entry) -> String {
    let role = match variable.causality() {
        Causality::Input => "INPUT",
        Causality::Parameter => "PARAMETER",
        Causality::Output => "OUTPUT",
        Causality::Independent | Causality::Local => "INNER",
    };
    let is_whole = match variable.kind {
        FmiType::Real => 0,
        FmiType::Whole => 1,
    };
    format!(
        "{{{}U, {is_whole}U, {}U, {role}, {}, {}U, {}, {}, {:?}, {:?}, {:?}}}",
        variable.reference,
        u8::from(variable.variability() == Variability::Continuous),
        entry.what,
        entry.index,
        entry.table,
        byte(variable.quantity),
        entry.factor,
        entry.limit,
        variable.start.unwrap_or(0.0)
    )
}

/// A table of records; the one that stands for none where there are none.
fn records(kind: &str, name: &str, rows: &[String], none: &str) -> String {
    let rows = if rows.is_empty() { none.to_string() } else { rows.join(",\n    ") };
    format!("static const {kind} {name}[] = {{\n    {rows},\n}};\n\n")
}
