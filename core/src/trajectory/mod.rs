//! Named columns with units over time, of simulations and logs.

mod grid;

pub use grid::Grid;
pub use grid::Interval;

/// One quantity over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name, in lower case with underscores: `cart_position`.
    pub name: String,
    /// Its unit as printed: `m`, `rad/s`, `N m`; empty for a pure number.
    pub unit: String,
    /// One value per row, in that unit.
    pub values: Vec<f64>,
}

impl Column {
    /// A column without rows.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into(), values: Vec::new() }
    }

    /// The heading in a file: name and unit, as in `cart_speed_m_s`.
    pub fn heading(&self) -> String {
        if self.unit.is_empty() {
            self.name.clone()
        } else {
            format!("{}_{}", self.name, self.unit.replace(['/', ' '], "_"))
        }
    }
}

/// Columns of equal length; the first is `time` in seconds.
///
/// Long results are passed on in blocks of rows, each of which is a trajectory.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    /// The columns, time first.
    pub columns: Vec<Column>,
}

impl Trajectory {
    /// No rows, the headings of `columns`, and capacity for this number of rows.
    pub fn with_capacity(columns: &[Column], rows: usize) -> Self {
        let room = |column: &Column| Column {
            name: column.name.clone(),
            unit: column.unit.clone(),
            values: Vec::with_capacity(rows.min(1 << 20)),
        };
        Self { columns: columns.iter().map(room).collect() }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, |c| c.values.len())
    }

    /// True if there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The values of the column called `name` (without its unit), if there is one.
    pub fn get(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }

    /// Appends the rows of `block`, which has the same columns. An empty trajectory adopts the columns.
    pub fn append(&mut self, block: &Trajectory) {
        if self.columns.is_empty() {
            self.columns.clone_from(&block.columns);
            return;
        }
        for (mine, theirs) in self.columns.iter_mut().zip(&block.columns) {
            debug_assert_eq!(mine.name, theirs.name);
            mine.values.extend_from_slice(&theirs.values);
        }
    }
}
