//! Overview of a machine from the numbers of its case: masses, stiffnesses, frequencies, limits and the reserve to
//! them. `taut show` prints it.
//!
//! Each answer is a [`Row`]: a key, a name, a value in SI and its unit. Terminal, page, JSON and Python show the same
//! rows.

mod belt;
mod direction;
mod drive;
mod inertia;
mod limits;
mod stepper;

use crate::case::Case;
use crate::error::Result;
use crate::number::engineering;
use crate::reach::feasible::sentence;
use direction::Direction;

/// Typical damping ratios of belts, and where they are from.
pub const TYPICAL_DAMPING: &str = "0.013 to 0.019 follow from the tables of Sollmann and Jouaneh (2011), and 0.1 is what Klipper's input \
                                   shapers assume of a whole printer";

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
#[non_exhaustive]
pub struct Overview {
    /// The title of the case.
    pub title: String,
    /// `axis`, `h-frame`, `core-xy` or `dual-belt`.
    pub kind: &'static str,
    /// The rows, by what they are about.
    pub groups: Vec<Group>,
    /// With the cart at several places, where the place makes a difference; else at one.
    pub places: Vec<FiguresAt>,
    /// True if the place makes a difference.
    pub depends_on_place: bool,
    /// Notes.
    pub notes: Vec<Note>,
}

/// Rows about one thing.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
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
#[non_exhaustive]
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
#[non_exhaustive]
pub struct FiguresAt {
    /// x of the cart of an axis; x of the bridge and y of the cart of a gantry, m.
    pub position: Vec<f64>,
    /// Stiffness of each span there, N/m.
    pub stiffness: Vec<f64>,
    /// By how much the load gives way per force on it, the drive pulleys held, m/N; in each direction that it moves in.
    pub stretch: Vec<f64>,
    /// Elastic modes, the slowest first: Hz without damping, and the damping ratio with everything sliding.
    pub modes: Vec<(f64, Option<f64>)>,
    /// Frequency with the drive pulleys held, Hz, the slowest.
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

impl Note {
    /// The code of a supply that is below what the rated current of a stepper needs.
    const SUPPLY: &str = "low-supply";

    /// True if figures of the machine do not hold, rather than being incomplete.
    pub fn is_warning(&self) -> bool {
        self.code == Self::SUPPLY
    }
}

impl Overview {
    /// Of the machine of a case. Errors: a machine whose linear system does not exist at its places.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// use taut::overview::Overview;
    /// let case = Case::from_text_with("axis.toml", TEMPLATE, &[])?;
    /// let overview = Overview::new(&case)?;
    /// // M + (J₁ + J₂)/r² = 0.362 kg + 2 · 6.3e-5 kg m² / (19.4 mm)²
    /// assert!((overview.value("total_mass").unwrap() - 0.69679).abs() < 1e-5);
    /// assert!(overview.notes.iter().any(|note| note.code == "no-damping"));
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn new(case: &Case) -> Result<Self> {
        let machine = &case.machine;
        let directions = Direction::all(machine);
        let places = belt::places(machine)?;
        let origin = belt::place(machine, &vec![0.0; directions.len()])?;
        let mut notes = Vec::new();
        let mut groups = vec![drive::drives(machine, &directions, &mut notes)];
        groups.push(inertia::inertia(machine, &directions, &mut notes));
        groups.extend(belt::belt(machine, &directions, (&origin, &places)));
        groups.extend(limits::limits(case, &directions, &origin, &mut notes));
        notes.extend(stepper::supply(machine));
        drive::constants(machine, &mut notes);
        belt::notes(machine, &mut notes);
        notes.extend(case.shortfalls().iter().map(|(name, short)| {
            let text = sentence(name, short);
            Note { code: "move-out-of-reach", text }
        }));
        groups.retain(|group| !group.rows.is_empty());
        let (title, kind, depends_on_place) = (case.title.clone(), machine.kind.word(), places.len() > 1);
        Ok(Self { title, kind, groups, places, depends_on_place, notes })
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
