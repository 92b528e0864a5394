//! The plant in C: its tables, and the solver around them.

use super::{Writer, number, plain};
use crate::Real;
use crate::error::{Error, Result};
use crate::packed::Packed;
use crate::tables::{Element, ElementKind, Stepped, Tables, Then};
use std::f64::consts::PI;
use std::fmt::Write;

/// Events that a step may have before it is given up.
const EVENTS: usize = 16;

/// Largest ‖A‖ d of a series, and its order: what is left out is less than 3e-17 of the leading term, or 1e-9 of it in
/// single precision.
const DOUBLE: [(f64, usize); 4] = [(0.25, 12), (0.55, 15), (1.15, 19), (2.0, 23)];
const FLOAT: [(f64, usize); 4] = [(0.25, 7), (0.55, 9), (1.15, 12), (2.0, 16)];

/// Series that the step of a plant may be made of.
const MOST_SERIES: f64 = 1000.0;

/// Turns of Newton's method for a root, after which bisections follow.
const NEWTON: usize = 8;

/// Halvings that all series of a step may have.
const HALVINGS_OF_STEP: usize = 64;

/// No element, no guard, no note, no place; of what follows, the end of the run.
const NONE: usize = 255;

/// The type of its numbers, before the name is filled in.
const REAL: &str = "@name@_real";

/// Terms of sine and cosine in `stepper.c`.
const CIRCULAR: usize = 9;

/// Electrical turns that a command may be away from zero, and microsteps, which have to be whole numbers of 32 bits.
const TURNS: f64 = 1e6;
const MICROSTEPS: f64 = 2e9;

const HEADER: &str = include_str!("plant.h");
const SOURCE: &str = include_str!("plant.c");
const MOTOR: &str = include_str!("motor.c");
const STEPPER: &str = include_str!("stepper.c");

/// A number of a stepper.
type Figure<'f> = &'f dyn Fn(&Stepped) -> f64;

/// A plant with its step.
pub(super) struct Plant<'t> {
    tables: &'t Tables,
    step: f64,
    real: Real,
    /// Series of a step without an event, and their order.
    parts: usize,
    order: usize,
}

/// Products and quotients; sums and differences.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Work(usize, usize);

impl std::ops::Add for Work {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }
}

impl std::ops::Mul<usize> for Work {
    type Output = Self;

    fn mul(self, times: usize) -> Self {
        Self(self.0 * times, self.1 * times)
    }
}

impl<'t> Plant<'t> {
    /// Errors: a step that takes too many series.
    pub(super) fn new(tables: &'t Tables, step: f64, real: Real) -> Result<Self> {
        let orders = match real {
            Real::Float => FLOAT,
            Real::Double => DOUBLE,
        };
        let reach = tables.fastest * step + tables.turns();
        let parts = (reach / 2.0).ceil().max(1.0);
        if parts > MOST_SERIES || !(step > 0.0 && step.is_finite()) {
            // Rounded to six digits, and still short enough.
            let fits = crate::quantity::rounded((1.0 - 1e-5) * Self::longest_step(tables));
            return Err(Error::new(format!("a step of {step:?} s takes {parts} series of this machine"))
                .in_file("--step")
                .allowed(format!("steps of up to {fits} s"))
                .next("name a shorter --step"));
        }
        let reach = reach / parts;
        let order = orders.iter().find(|(most, _)| reach <= *most).map_or(orders[3].1, |(_, order)| *order);
        Ok(Self { tables, step, real, parts: parts as usize, order })
    }

    /// The longest step that it can have, s.
    pub(super) fn longest_step(tables: &Tables) -> f64 {
        (MOST_SERIES * 2.0 - tables.turns()) / tables.fastest
    }

    fn number(&self, value: f64) -> String {
        number(self.real, value)
    }

    /// Most series of a step: those of a step without an event, and two more for each event.
    fn series(&self) -> usize {
        self.parts + 2 * EVENTS
    }

    /// Bits of a number's mantissa.
    fn bits(&self) -> usize {
        match self.real {
            Real::Float => 24,
            Real::Double => 53,
        }
    }

    /// Conditions that are watched at once, at most.
    fn active(&self) -> usize {
        let guards = &self.tables.guards;
        let of = |place: Option<(usize, usize)>| guards.iter().filter(|guard| guard.of == place).count();
        let element = |(index, element): (usize, &Element)| {
            (0..element.states.len()).map(|state| of(Some((index, state)))).max().unwrap_or(0)
        };
        of(None) + self.tables.elements.iter().enumerate().map(element).sum::<usize>()
    }

    /// Products and quotients, and sums and differences, of one step at most, from the bounds of the loops in
    /// `plant.c`.
    fn work(&self) -> Work {
        let (n, z, o, g) = (self.tables.rates.len(), self.tables.size(), self.order, self.active());
        // Places that move, and products, whose terms are sums of two to o + 1 products.
        let (p, steppers) = (self.tables.products.len(), self.tables.steppers.len());
        let (m, cauchy) = (n + p, Work(p * o * (o + 3) / 2, p * o * (o + 3) / 2));
        let gears = self.tables.resting_torque.iter().flatten().count();
        let events = EVENTS;
        let (series, terms) = (self.series(), o + 1);
        // A row's value, and its rounding.
        let value = Work(z, z);
        let noise = Work(z + 1, z);
        let look = (value + noise + Work(1, 1)) * g;
        let expand = Work(o + n * (z + 1) + (o - 1) * n * (m + 1), n * z + (o - 1) * n * m) + cauchy;
        let sizes = Work(o * (1 + n * (z + 1)), o * n * z) + cauchy;
        let along = Work(z + o * m + 2 * terms, z + o * m);
        let first_term = Work(terms * (z + 2), terms * z);
        let hull = Work(4 * terms, 2 * terms + terms * terms);
        let fall = along + hull;
        let root = Work(1, 1) + Work(2 * terms + 3, 2 * terms + 3) * (NEWTON + self.bits());
        let add = Work(n * o + p, n * (o + 4));
        // Of each series: twice along each guard, and once more where it begins at zero.
        let advance = look + expand + sizes + (fall * 2 + along + first_term + Work(1, 0)) * g + add + Work(5, 4);
        // A series in which a guard falls ends with an event, or with the one that is too many.
        let roots = root * (g * (events + 1));
        let halvings = (fall + Work(1, 0)) * HALVINGS_OF_STEP;
        let resting = value * gears;
        let of_body = (resting + value + noise) * 3 + Work(3, 3);
        let of_element = (value + noise + Work(2, 1)) * g;
        let change = value + noise + Work(1 + p, 0) + of_body + of_element;
        let fallen = look + expand + sizes + (along + first_term) * g;
        // Settled at the input and after each event: a turn for each event, one at the edge, and the last of each time.
        let settle =
            fallen * (2 * events + 3) + (noise + Work(1, 0)) * g + (value + noise + Work(1, 0)) * (g * (events + 1));
        // Sine and cosine of each field, those of each rotor brought back to the circle, and its command.
        let commands = (Work(7, 6) * CIRCULAR + Work(16, 12)) * steppers + Work(p, 0);
        advance * series + roots + halvings + change * (events + 1) + settle + commands + Work(0, n + z)
    }

    pub(super) fn facts(&self) -> Vec<(String, String)> {
        let (series, Work(products, sums)) = (self.series(), self.work());
        vec![
            ("step".into(), format!("{:?} s", self.step)),
            ("states".into(), self.tables.rates.len().to_string()),
            ("modes".into(), self.tables.modes().to_string()),
            ("rows of equations".into(), self.tables.rows().to_string()),
            ("order of a Taylor series".into(), self.order.to_string()),
            ("series in a step without an event".into(), self.parts.to_string()),
            ("series in a step at most".into(), series.to_string()),
            ("products and quotients in a step at most".into(), products.to_string()),
            ("sums and differences in a step at most".into(), sums.to_string()),
        ]
    }

    pub(super) fn header(&self, writer: &Writer, title: &str) -> String {
        let mechanism = &self.tables.mechanism;
        let name = writer.name.to_uppercase();
        let mut numbers = String::new();
        let mut list = |what: &str, keys: Vec<&str>| {
            let _ = writeln!(numbers, "#define {name}_{what} {}U", keys.len().max(1));
            for (index, key) in keys.iter().enumerate() {
                let key = super::identifier(key).to_uppercase();
                let _ = writeln!(
                    numbers,
                    "#define {name}_{}_{key} {index}U",
                    what.trim_end_matches("IES").trim_end_matches('S')
                );
            }
        };
        list("BODIES", mechanism.bodies.iter().map(|body| body.label.key).collect());
        list("DRIVES", mechanism.drives.iter().map(|drive| drive.label.key).collect());
        list("SPRINGS", mechanism.springs.iter().map(|spring| spring.label.key).collect());
        let numbers = numbers.replace("_BOD_", "_BODY_");
        let Work(products, sums) = self.work();
        let [outputs, more, statuses, idle, currents] = match self.tables.steppers.is_empty() {
            true => ["", " ", "", "no voltage or current commanded", "currents zero"],
            false => [
                "    @name@_real second_current[@NAME@_DRIVES]; /* A in the second phase; `current` is that in the first */\n    \
                 @name@_real second_voltage[@NAME@_DRIVES]; /* V at the second phase; `voltage` is that at the first */\n    \
                 int32_t lost_steps[@NAME@_DRIVES];         /* full steps by which the rotor is behind its field */\n",
                ",",
                "    @NAME@_TOO_FAR = 4          /* a command more than two full steps from the last one: nothing was done */\n",
                "the positions zero commanded",
                "currents those that hold the rotors there",
            ],
        };
        let header = HEADER.replace("@outputs@", outputs).replace("@statuses@", statuses);
        writer.fill(
            &header,
            &[
                ("@more@", more),
                ("@idle@", idle),
                ("@currents@", currents),
                ("@title@", &plain(title)),
                ("@numbers@", numbers.trim_end()),
                ("@events@", &EVENTS.to_string()),
                ("@series@", &self.series().to_string()),
                ("@products@", &products.to_string()),
                ("@sums@", &sums.to_string()),
                ("@step@", &self.number(self.step)),
            ],
        )
    }

    pub(super) fn source(&self, writer: &Writer) -> String {
        // Electrical turns of as many microsteps.
        let farthest = |own: &Stepped| own.microstep.map(|microstep| MICROSTEPS * microstep / (2.0 * own.farthest));
        let turns = self.tables.steppers.iter().filter_map(farthest).fold(TURNS, f64::min);
        let limits = [
            ("@halvings@", &*HALVINGS_OF_STEP.to_string()),
            ("@newton@", &*NEWTON.to_string()),
            ("@circular@", &*CIRCULAR.to_string()),
            ("@turns@", &*self.number(turns)),
        ];
        let [commands, told, hold, read] = match self.tables.steppers.is_empty() {
            true => [MOTOR, "", "", ""],
            false => [
                STEPPER,
                "    @name@_real told[@NAME@_DRIVES]; /* positions that the fields are told, m */\n",
                "    hold_rotors(position);\n",
                "    read_steppers(out);\n",
            ],
        };
        let source = SOURCE.replace("@tables@", self.tables().trim_end()).replace("@commands@", commands.trim_end());
        let source = source.replace("@told@", told).replace("@hold@", hold).replace("@read@", read);
        writer.fill(&source, &limits)
    }

    /// All tables.
    fn tables(&self) -> String {
        let tables = self.tables;
        let packed = Packed::new(tables);
        let [currents, voltages, forces] = packed.outputs;
        let others = packed.others;

        let mut text = String::new();
        let mut define = |word: &str, value: String| {
            let _ = writeln!(text, "#define {word} {value}");
        };
        define("STATES", format!("{}U", tables.rates.len()));
        define("SIZE", format!("{}U", tables.size()));
        define("ORDER", format!("{}U", self.order));
        define("ROOM_ELEMENTS", format!("{}U", tables.elements.len() + 1));
        define("ROOM_GUARDS", format!("{}U", tables.guards.len() + 1));
        define("ROOM_SLOTS", format!("{}U", tables.slots + 1));
        define("CURRENT_TABLE", format!("{currents}U"));
        define("VOLTAGE_TABLE", format!("{voltages}U"));
        define("FORCE_TABLE", format!("{forces}U"));
        if !tables.others.is_empty() {
            define("OTHER_TABLE", format!("{others}U"));
        }
        let (epsilon, rounding) = match self.real {
            Real::Float => (f64::from(f32::EPSILON), 2.7e-6),
            Real::Double => (f64::EPSILON, crate::mechanism::ROUNDING),
        };
        let reach = self.step / self.parts as f64;
        define("EPSILON", self.number(epsilon));
        define("ROUNDING", self.number(rounding));
        define("BITS", format!("{}U", self.bits()));
        define("REACH", self.number(reach));
        define("SOON", self.number(1e-6 * 0.125 * reach));
        define("MOMENT", self.number(1e-12 * 0.125 * reach));
        let _ = writeln!(text);
        let layout = &tables.layout;
        for (word, count) in [
            ("ELEMENTS", tables.elements.len()),
            ("GUARDS", tables.guards.len()),
            ("SLOTS", tables.slots),
            ("RESTINGS", packed.resting.len()),
            ("PRODUCTS", tables.products.len()),
            ("REPLACED", layout.replaced.len()),
        ] {
            let _ = writeln!(text, "static const uint32_t {word} = {count}U;");
        }
        let _ = writeln!(text, "\n/* 1/k */");
        let reciprocal = (0..=self.order).map(|k| self.number(1.0 / k.max(1) as f64));
        text += &list(REAL, "RECIPROCAL", reciprocal);
        let _ = writeln!(text, "\n/* Rows of weights on z, and which of them each table has: see row_of. */");
        let _ = writeln!(text, "static const {REAL} WEIGHT[][SIZE] = {{");
        for weights in &packed.weights {
            let row: Vec<String> = weights.iter().map(|w| self.number(*w)).collect();
            let _ = writeln!(text, "    {{{}}},", row.join(", "));
        }
        let _ = writeln!(text, "}};");
        let whole = |values: &[usize]| values.iter().map(|v| format!("{v}U")).collect::<Vec<_>>();
        let counted = |values: &[i64]| values.iter().map(|v| format!("{v}U")).collect::<Vec<_>>();
        text += &list("uint16_t", "ENTRY", counted(&packed.entry));
        text += &list("uint16_t", "ENTRY_FIRST", counted(&packed.entry_first));
        text += &list("uint16_t", "DEPENDS_FIRST", counted(&packed.depends_first));
        text += &list("uint8_t", "DEPENDS", counted(&packed.depends));
        text += &self.elements(&packed, &whole);
        text += &self.guards(&packed);
        text += &self.places(&whole);
        text += "\n/* Products of two places of z. */\nstatic const struct {\n    uint8_t one;\n    uint8_t other;\n} PRODUCT[] = ";
        let products = tables.products.iter().map(|[one, other]| format!("{{{one}U, {other}U}}"));
        text += &records(&products.collect::<Vec<_>>(), "{0U, 0U}");
        if !tables.steppers.is_empty() {
            text += &self.steppers(&whole);
        }
        text
    }

    /// Tables of the steppers.
    fn steppers(&self, whole: &dyn Fn(&[usize]) -> Vec<String>) -> String {
        let steppers = &self.tables.steppers;
        let mut text = String::from(
            "\n/* Steppers: the body of the rotor and the place of its sine; electrical turns per m, m per rad, a microstep and \
             the farthest jump, m; what a phase is commanded, at most; what it carries at rest, and what the supply allows. */\n",
        );
        text += &list("uint8_t", "SHAFT", whole(&steppers.iter().map(|own| own.shaft).collect::<Vec<_>>()));
        text += &list("uint8_t", "SINE", whole(&steppers.iter().map(|own| own.sine).collect::<Vec<_>>()));
        let columns: [(&str, Figure); 7] = [
            ("TURNS", &|own| own.phases.teeth * own.per_input / (2.0 * PI)),
            ("WAY", &|own| 1.0 / own.per_input),
            ("MICROSTEP", &|own| own.microstep.unwrap_or(0.0)),
            // With what rounding may add.
            ("FARTHEST", &|own| own.farthest * (1.0 + 1e-6)),
            ("FIELD", &|own| own.phases.commanded()),
            ("HOLDING", &|own| own.phases.holding_current()),
            ("MOST", &|own| own.phases.supply / own.phases.resistance),
        ];
        for (name, of) in columns {
            text += &list(REAL, name, steppers.iter().map(|own| self.number(of(own))));
        }
        text
    }

    /// Elements, and gears that lose power.
    fn elements(&self, packed: &Packed, whole: &dyn Fn(&[usize]) -> Vec<String>) -> String {
        let tables = self.tables;
        let states: Vec<usize> = tables.elements.iter().map(|element| element.states.len()).collect();
        let speed = |element: &Element| match element.kind {
            ElementKind::Body(body) => tables.layout.speed[body],
            _ => NONE,
        };
        let speeds: Vec<usize> = tables.elements.iter().map(speed).collect();
        let mut text = String::from(
            "\n/* Elements: how many things each can do, what it does at rest, and the place of the speed whose sign says \
             how a body moves. */\n",
        );
        text += &list("uint8_t", "ELEMENT_STATES", whole(&states));
        text += &list("uint8_t", "AT_REST", whole(&tables.at_rest()));
        text += &list("uint8_t", "ELEMENT_SPEED", whole(&speeds));
        text += "\n/* Gears that lose power: element, and table of the torque at rest. */\nstatic const struct {\n    \
                 uint16_t table;\n    uint8_t element;\n} RESTING[] = ";
        let resting = packed.resting.iter().map(|[element, table]| format!("{{{table}U, {element}U}}"));
        text += &records(&resting.collect::<Vec<_>>(), "{0U, 0U}");
        text
    }

    /// Conditions and what follows them.
    fn guards(&self, packed: &Packed) -> String {
        let tables = self.tables;
        let mut resets = Vec::new();
        let mut rows = Vec::new();
        for (guard, [table, ..]) in tables.guards.iter().zip(&packed.guards) {
            let (element, state) = guard.of.unwrap_or((NONE, 0));
            let (then, decides) = match guard.then {
                Then::Become(code) => (code, 0),
                Then::Decide(code) => (code, 1),
                Then::Leave => (NONE, 0),
            };
            let slot = guard.slot.unwrap_or(tables.slots);
            let [forward, backward] = guard.breakaways.unwrap_or([NONE; 2]);
            let (first, gently) = (resets.len(), guard.gently.unwrap_or(NONE));
            resets.extend(guard.resets.iter().map(|(place, value)| format!("{{{}, {place}U}}", self.number(*value))));
            let (drop, rank, fresh, end) = (self.number(guard.drop), guard.rank, guard.fresh, resets.len());
            rows.push(format!(
                "{{{drop}, {table}U, {element}U, {state}U, {then}U, {decides}U, {rank}U, {slot}U, {fresh}U, {forward}U, \
                 {backward}U, {gently}U, {first}U, {end}U}}"
            ));
        }
        let mut text = format!(
            "\n/* What changes set in z. */\nstatic const struct {{\n    {REAL} value;\n    uint8_t place;\n}} RESET[] = "
        );
        text += &records(&resets, "{0, 0U}");
        text += &format!(
            "\n/* Guards, and what follows where one falls. */\nstatic const struct {{\n    {REAL} drop; /* breakaway \
             above Coulomb friction */\n    uint16_t table; /* its row */\n    uint8_t element; /* it is one on this */\n    \
             uint8_t state;   /* while it does this */\n    uint8_t then;    /* what the element does next */\n    \
             uint8_t decides; /* whether the load on a body decides whether it does */\n    uint8_t rank;    /* which \
             is settled first */\n    uint8_t slot;    /* its tolerance */\n    uint8_t fresh;   /* its note of a fresh \
             start */\n    uint8_t forward; /* guards of a body's breakaway */\n    uint8_t backward;\n    uint8_t \
             gently;  /* note of what starts with no slope */\n    uint8_t resets_first;\n    uint8_t resets_end;\n}} \
             GUARD[] = "
        );
        text += &records(&rows, "{0, 0U, 255U, 0U, 0U, 0U, 0U, 0U, 0U, 255U, 255U, 255U, 0U, 0U}");
        text
    }

    /// Where bodies stand in z, and lengths in the places of angles.
    fn places(&self, whole: &dyn Fn(&[usize]) -> Vec<String>) -> String {
        let tables = self.tables;
        let (layout, mechanism) = (&tables.layout, &tables.mechanism);
        let bodies = mechanism.bodies.len();
        let motion = |body: usize| {
            let leader = mechanism.leader(body);
            tables.elements.iter().position(|e| e.kind == ElementKind::Body(leader)).unwrap_or(NONE)
        };
        let mut text = String::from("\n/* Places of the bodies in z, and lengths of the belt in those of angles. */\n");
        text += &list("uint8_t", "COORDINATE", whole(&layout.coordinate[..bodies]));
        text += &list("uint8_t", "SPEED", whole(&layout.speed[..bodies]));
        text += &list("uint8_t", "MOTION_OF", whole(&(0..bodies).map(motion).collect::<Vec<_>>()));
        let replaced = &layout.replaced;
        let (mut ends, mut others, mut arms) = (vec![0], Vec::new(), Vec::new());
        for one in replaced {
            others.extend(one.others.iter().map(|(other, _)| *other));
            arms.extend(one.others.iter().map(|(_, arm)| self.number(*arm)));
            ends.push(others.len());
        }
        text += &list("uint8_t", "REPLACED_BODY", whole(&replaced.iter().map(|one| one.body).collect::<Vec<_>>()));
        text += &list(REAL, "REPLACED_ARM", replaced.iter().map(|one| self.number(one.own)));
        text += &list("uint8_t", "OTHERS_FIRST", whole(&ends));
        text += &list("uint8_t", "OTHERS", whole(&others));
        text += &list(REAL, "OTHERS_ARM", arms);
        text
    }
}

/// A table of numbers; one zero where there are none.
fn list(kind: &str, name: &str, values: impl IntoIterator<Item = String>) -> String {
    let mut values: Vec<String> = values.into_iter().collect();
    if values.is_empty() {
        values.push("0".into());
    }
    let mut text = format!("static const {kind} {name}[] = {{");
    for (k, value) in values.iter().enumerate() {
        text += match (k, k % 16) {
            (0, _) => "",
            (_, 0) => ",\n    ",
            _ => ", ",
        };
        text += value;
    }
    text + "};\n"
}

/// A table of records; an empty one where there are none.
fn records(rows: &[String], none: &str) -> String {
    let rows = if rows.is_empty() { vec![none.to_string()] } else { rows.to_vec() };
    format!("{{\n    {},\n}};\n", rows.join(",\n    "))
}
