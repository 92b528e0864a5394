//! The curves of a run, thinned out as its rows come, so that a plot of any run needs the same memory.

use taut::report::Decimator;
use taut::stage::Stage;
use taut::trajectory::Trajectory;

/// Points that a curve keeps: more than a plot has pixels.
const POINTS: usize = 3000;

/// What a curve shows.
#[derive(Debug, Clone, Copy)]
enum Source {
    /// A column as it is.
    Column(&'static str),
    /// An angle or its rate at the belt: r times it.
    Arc(&'static str),
    /// The stretch of a span: difference of two positions, angles at the belt.
    Stretch(&'static str, &'static str),
}

/// Every curve that a report can show.
const SOURCES: [(&str, Source); 21] = [
    ("input", Source::Column("input")),
    ("voltage", Source::Column("voltage")),
    ("current", Source::Column("motor_current")),
    ("drive", Source::Arc("drive_angle")),
    ("cart", Source::Column("cart_position")),
    ("idler", Source::Arc("idler_angle")),
    ("drive speed", Source::Arc("drive_speed")),
    ("cart speed", Source::Column("cart_speed")),
    ("idler speed", Source::Arc("idler_speed")),
    ("stretch 1", Source::Stretch("drive_angle", "cart_position")),
    ("stretch 2", Source::Stretch("cart_position", "idler_angle")),
    ("stretch 3", Source::Stretch("idler_angle", "drive_angle")),
    ("force 1", Source::Column("span1_force")),
    ("force 2", Source::Column("span2_force")),
    ("force 3", Source::Column("span3_force")),
    ("drive friction", Source::Column("drive_friction")),
    ("cart friction", Source::Column("cart_friction")),
    ("idler friction", Source::Column("idler_friction")),
    ("drive state", Source::Column("drive_state")),
    ("cart state", Source::Column("cart_state")),
    ("idler state", Source::Column("idler_state")),
];

/// What a log can show over the curves: the column, and whether it is an angle at the drive pulley, or its rate.
const LOGGED: [(&str, bool); 6] = [
    ("drive_angle", true),
    ("cart_position", false),
    ("drive_speed", true),
    ("cart_speed", false),
    ("motor_current", false),
    ("motor_voltage", false),
];

/// The samples of one log, thinned out like the curves.
pub struct Samples {
    radius: f64,
    thinned: Vec<Decimator>,
}

impl Samples {
    /// No samples yet.
    pub fn new(stage: &Stage) -> Self {
        Self { radius: stage.pulley_radius, thinned: LOGGED.iter().map(|_| Decimator::new(POINTS)).collect() }
    }

    /// Takes the next rows of the log.
    pub fn take(&mut self, block: &Trajectory) {
        let time = block.get("time").unwrap_or(&[]);
        for (&(name, turns), thinned) in LOGGED.iter().zip(&mut self.thinned) {
            let factor = if turns { self.radius } else { 1.0 };
            let values: Vec<f64> = block.get(name).unwrap_or(&[]).iter().map(|value| factor * value).collect();
            thinned.push(time, &values);
        }
    }

    /// Times and values of what was logged under `name`, angles at the belt; none if it was not.
    pub fn get(&self, name: &str) -> Option<(Vec<f64>, Vec<f64>)> {
        let place = LOGGED.iter().position(|(n, _)| *n == name)?;
        Some(self.thinned[place].points()).filter(|(times, _)| !times.is_empty())
    }
}

/// The curves of one run.
pub struct Curves {
    radius: f64,
    thinned: Vec<Decimator>,
    scratch: Vec<f64>,
}

impl Curves {
    /// No points yet.
    pub fn new(stage: &Stage) -> Self {
        let thinned = SOURCES.iter().map(|_| Decimator::new(POINTS)).collect();
        Self { radius: stage.pulley_radius, thinned, scratch: Vec::new() }
    }

    /// Takes the next rows.
    pub fn take(&mut self, block: &Trajectory) {
        let r = self.radius;
        let time = block.get("time").unwrap_or(&[]);
        let column = |name: &str| block.get(name).unwrap_or(&[]);
        let at_belt = |name: &str| if name.ends_with("_angle") { r } else { 1.0 };
        for (&(_, source), thinned) in SOURCES.iter().zip(&mut self.thinned) {
            self.scratch.clear();
            match source {
                Source::Column(name) => {
                    thinned.push(time, column(name));
                    continue;
                }
                Source::Arc(name) => self.scratch.extend(column(name).iter().map(|angle| r * angle)),
                Source::Stretch(a, b) => {
                    let (fa, fb) = (at_belt(a), at_belt(b));
                    self.scratch.extend(column(a).iter().zip(column(b)).map(|(a, b)| fa * a - fb * b));
                }
            }
            thinned.push(time, &self.scratch);
        }
    }

    /// Times and values of the curve called `name`; none if the run has no such quantity.
    pub fn get(&self, name: &str) -> Option<(Vec<f64>, Vec<f64>)> {
        let place = SOURCES.iter().position(|(n, _)| *n == name)?;
        Some(self.thinned[place].points()).filter(|(times, _)| !times.is_empty())
    }
}
