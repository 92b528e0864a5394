//! Overview of a machine from the numbers of its case: masses, stiffnesses, frequencies, limits and the reserve to
//! them. `taut show` prints it.
//!
//! Each answer is a [`Row`]: a key, a name, a value in SI and its unit. Terminal, page, JSON and Python show the same
//! rows.

mod axis;
mod gantry;
mod limits;
mod stepper;

use crate::case::Case;
use crate::error::Result;
use crate::machine::{AmplifierMode, BeltSheet, Motor};
use crate::number::engineering;

/// Typical damping ratios of belts, and where they are from.
pub const TYPICAL_DAMPING: &str = "0.013 to 0.019 follow from the tables of Sollmann and Jouaneh (2011), and 0.1 is what Klipper's input \
                                   shapers assume of a whole printer";

/// K_t and K_e of one motor are one number; beyond this factor one of them is doubtful.
const APART: f64 = 1.25;

/// A pulley whose teeth are so far from a whole number has a doubtful radius.
const NOT_WHOLE: f64 = 0.1;

/// Share of the moved mass above which a belt's own mass shows.
const HEAVY: f64 = 0.1;

/// Keys of the rows that answer the first questions about a machine; those of a direction continue with its name.
const MAIN: [&str; 10] = [
    "breakaway_input",
    "total_mass",
    "stretch_per_force",
    "resonance1",
    "held_resonance",
    "largest_force",
    "largest_acceleration",
    "largest_speed",
    "tooth_safety",
    "tension_safety",
];

/// Masses, stiffnesses, frequencies and limits of a machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Overview {
    /// The title of the case.
    pub title: String,
    /// `axis`, `h-frame`, `core-xy` or `dual-belt`.
    pub kind: &'static str,
    /// The rows, by what they are about.
    pub groups: Vec<Group>,
    /// With the cart at several places, where the place makes a difference; else at one.
    pub places: Vec<Place>,
    /// True if the place makes a difference.
    pub depends_on_place: bool,
    /// Notes.
    pub notes: Vec<Note>,
}

/// Rows about one thing.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// In a word for programs.
    pub key: &'static str,
    /// For people.
    pub name: &'static str,
    /// Its rows.
    pub rows: Vec<Row>,
}

/// One answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Unique within an overview.
    pub key: String,
    /// For people.
    pub name: String,
    /// In SI.
    pub value: f64,
    /// Its SI unit; empty for a pure number.
    pub unit: &'static str,
    /// How it comes about; empty where the name says it.
    pub how: String,
}

/// The machine with cart (and bridge) at one place.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// x of the cart of an axis; x of the bridge and y of the cart of a gantry, m.
    pub position: Vec<f64>,
    /// Stiffness of each span there, N/m.
    pub stiffness: Vec<f64>,
    /// By how much the load gives way per force on it, the motors held, m/N; in each direction that it moves in.
    pub stretch: Vec<f64>,
    /// Elastic modes, the slowest first: Hz without damping, and the damping ratio with everything sliding.
    pub modes: Vec<(f64, Option<f64>)>,
    /// Frequency with the drive pulley held, Hz, the slowest; none for a gantry.
    pub held: Option<f64>,
}

/// Something to be known.
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    /// In a word for programs.
    pub code: &'static str,
    /// In a sentence, with what to do.
    pub text: String,
}

impl Overview {
    /// That of a case of either kind.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// use taut::overview::Overview;
    /// let case = Case::from_text_with("axis.toml", TEMPLATE, &[])?;
    /// let overview = Overview::of(&case)?;
    /// // M + (J₁ + J₂)/r² = 0.362 kg + 2 · 6.3e-5 kg m² / (19.4 mm)²
    /// assert!((overview.value("total_mass").unwrap() - 0.69679).abs() < 1e-5);
    /// assert!(overview.notes.iter().any(|note| note.code == "no-damping"));
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn of(case: &Case) -> Result<Self> {
        match case.is_axis() {
            true => axis::overview(case),
            false => gantry::overview(case),
        }
    }

    /// The value of a row, SI.
    pub fn value(&self, key: &str) -> Option<f64> {
        self.rows().find(|row| row.key == key).map(|row| row.value)
    }

    /// All rows.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.groups.iter().flat_map(|group| &group.rows)
    }
}

impl Group {
    fn new(key: &'static str, name: &'static str) -> Self {
        Self { key, name, rows: Vec::new() }
    }

    fn add(&mut self, key: impl Into<String>, name: impl Into<String>, value: f64, unit: &'static str) -> &mut Row {
        self.rows.push(Row { key: key.into(), name: name.into(), value, unit, how: String::new() });
        let last = self.rows.len() - 1;
        &mut self.rows[last]
    }
}

impl Row {
    /// True for the rows that `taut show` prints without `--verbose`.
    pub fn is_main(&self) -> bool {
        MAIN.iter().any(|key| self.key.starts_with(key))
    }

    fn how(&mut self, words: impl Into<String>) {
        self.how = words.into();
    }
}

/// A value in a sentence.
fn told(value: f64, unit: &str) -> String {
    engineering(value, unit, 4)
}

/// Rows of a motor's constants, whose keys begin with `prefix`.
fn motor_rows(group: &mut Group, prefix: &str, motor: &Motor) {
    if motor.is_simple {
        return;
    }
    group.add(format!("{prefix}torque_constant"), "torque constant", motor.torque_constant, "N m/A");
    group.add(format!("{prefix}back_emf_constant"), "back-EMF constant", motor.back_emf_constant, "V s/rad");
    group.add(format!("{prefix}resistance"), "resistance", motor.resistance, "ohm");
}

/// Force per unit of input at the belt, and force per speed that the back-EMF takes, N per V or A, and N s/m.
fn drive_at_belt(motor: &Motor, amplifier: (AmplifierMode, f64), r: f64) -> (f64, f64) {
    let (mode, gain) = amplifier;
    let n = motor.gear_ratio;
    // A compliant gear has no efficiency in its equations; its losses are those of the flanks.
    let per_ampere = motor.gear_efficiency * n * motor.torque_constant / r;
    match mode {
        AmplifierMode::Current => (gain.abs() * per_ampere, 0.0),
        AmplifierMode::Position => (0.0, 0.0),
        AmplifierMode::Voltage => {
            // F = η n K_t / (R r) (u − K_e n v / r)
            let per_volt = per_ampere / motor.resistance;
            (gain.abs() * per_volt, per_volt * n * motor.back_emf_constant / r)
        }
    }
}

/// K_t and K_e that are no one motor's.
fn of_constants(motor: &Motor, whose: &str, notes: &mut Vec<Note>) {
    let (k_t, k_e) = (motor.torque_constant, motor.back_emf_constant);
    if motor.is_simple || k_t <= 0.0 || k_e <= 0.0 || (1.0 / APART..APART).contains(&(k_t / k_e)) {
        return;
    }
    let text = format!(
        "{whose}K_t = {} and K_e = {} of one motor are equal in SI units: one of them, or its unit, is doubtful",
        told(k_t, "N m/A"),
        told(k_e, "V s/rad")
    );
    notes.push(Note { code: "motor-constants", text });
}

/// Notes about a belt: without damping, of doubtful teeth.
fn of_belt(sheet: &BeltSheet, damping: &[f64], r: f64, notes: &mut Vec<Note>) {
    if damping.iter().all(|c| *c == 0.0) {
        let text = format!(
            "the belt has no damping, so only friction and the motor damp its vibration; of damping ratios, \
             {TYPICAL_DAMPING}: give belt.damping_ratio, or measure it"
        );
        notes.push(Note { code: "no-damping", text });
    }
    let Some(kind) = sheet.kind else { return };
    let teeth = std::f64::consts::TAU * r / kind.pitch;
    if (teeth - teeth.round()).abs() > NOT_WHOLE {
        let text = format!(
            "a pitch radius of {} makes {} teeth of the {} of a belt {}: is it the outer radius? give teeth instead",
            told(r, "m"),
            engineering(teeth, "", 4),
            told(kind.pitch, "m"),
            kind.name
        );
        notes.push(Note { code: "teeth", text });
    }
    notes.push(Note { code: "belt-source", text: format!("the numbers of a belt {}: {}", kind.name, kind.source) });
}

/// The mass of the belt, kg, of this length, and its share of `moved`.
fn belt_mass(group: &mut Group, notes: &mut Vec<Note>, sheet: &BeltSheet, length: Option<f64>, moved: f64) {
    let (Some(per_length), Some(length)) = (sheet.mass_per_length, length) else { return };
    let mass = per_length * length;
    group
        .add("belt_mass", "mass of the belt", mass, "kg")
        .how(format!("{} long; not in the equations", told(length, "m")));
    group.add("belt_mass_share", "its share of the moved mass", mass / moved, "");
    if mass > HEAVY * moved {
        let text = format!(
            "the belt weighs {}, {} % of all that moves, and is not in the equations: add about that much to cart.mass",
            told(mass, "kg"),
            engineering(100.0 * mass / moved, "", 2)
        );
        notes.push(Note { code: "heavy-belt", text });
    }
}
