//! The curves of a run, thinned out as its rows come, so that a plot of any run needs the same memory.

use crate::Decimator;
use taut::machine::{DriveAt, Machine, MachineKind};
use taut::mechanism::Heading;
use taut::trajectory::Trajectory;

/// Points that a curve keeps: more than a plot has pixels.
const POINTS: usize = 3000;

/// Rows up to which a curve keeps every one of them: evenly spaced they weigh half, and a zoom finds them all.
const WHOLE: usize = 12_000;

/// Thins out one curve as its rows come.
pub fn decimator() -> Decimator {
    Decimator::new(POINTS).whole_up_to(WHOLE)
}

/// A curve: its name, and the columns that it is a sum of, each with its weight.
type Source = (String, Vec<(String, f64)>);

/// Every curve that a report can show.
fn sources(machine: &Machine) -> Vec<Source> {
    match machine.kind {
        MachineKind::Axis => of_axis(machine.pulley_radius),
        _ => in_plane(machine),
    }
}

/// All columns, and x and y as the drives say minus what they are, as `Machine::by_drives` has it, term by term.
fn in_plane(machine: &Machine) -> Vec<Source> {
    let alone = |heading: &Heading| (heading.name.to_string(), vec![(heading.name.to_string(), 1.0)]);
    let mut sources: Vec<Source> = machine.mechanism().columns.iter().map(alone).collect();
    let geometry = machine.geometry();
    for (name, slide) in ["x error", "y error"].into_iter().zip(geometry.slides) {
        let angle = |drive: &DriveAt| format!("{}_angle", geometry.label(drive.pulley).key);
        let drives = geometry.drives.iter().zip(slide.by_drives);
        let mut terms: Vec<_> = drives.map(|(drive, weight)| (angle(drive), weight * machine.pulley_radius)).collect();
        terms.push((format!("{}_position", geometry.label(slide.body).key), -1.0));
        sources.push((name.into(), terms));
    }
    sources
}

/// Of an axis.
fn of_axis(r: f64) -> Vec<Source> {
    let column = |name: &'static str, column: &'static str| (name, vec![(column, 1.0)]);
    let arc = |name, angle: &'static str| (name, vec![(angle, r)]);
    let at_belt = |column: &str| if column.ends_with("_angle") { r } else { 1.0 };
    let stretch = |name, a: &'static str, b: &'static str| (name, vec![(a, at_belt(a)), (b, -at_belt(b))]);
    let sources = [
        column("input", "input"),
        column("voltage", "voltage"),
        column("current", "motor_current"),
        arc("drive", "drive_angle"),
        column("cart", "cart_position"),
        arc("idler", "idler_angle"),
        arc("drive speed", "drive_speed"),
        column("cart speed", "cart_speed"),
        arc("idler speed", "idler_speed"),
        stretch("stretch 1", "drive_angle", "cart_position"),
        stretch("stretch 2", "cart_position", "idler_angle"),
        stretch("stretch 3", "idler_angle", "drive_angle"),
        column("force 1", "span1_force"),
        column("force 2", "span2_force"),
        column("force 3", "span3_force"),
        column("drive friction", "drive_friction"),
        column("cart friction", "cart_friction"),
        column("idler friction", "idler_friction"),
        column("drive state", "drive_state"),
        column("cart state", "cart_state"),
        column("idler state", "idler_state"),
    ];
    let owned = |terms: Vec<(&str, f64)>| terms.into_iter().map(|(name, weight)| (name.to_string(), weight)).collect();
    sources.into_iter().map(|(name, terms)| (name.to_string(), owned(terms))).collect()
}

/// Columns of a log that are shown over the curves, and whether it is an angle at the drive pulley, or its rate.
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
    pub fn new(machine: &Machine) -> Self {
        Self { radius: machine.pulley_radius, thinned: LOGGED.iter().map(|_| decimator()).collect() }
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
    sources: Vec<Source>,
    thinned: Vec<Decimator>,
    scratch: Vec<f64>,
    /// The way of the cart in its plane, where it has one.
    way: Option<ColumnPair>,
}

impl Curves {
    /// No points yet.
    pub fn new(machine: &Machine) -> Self {
        let sources = sources(machine);
        let thinned = sources.iter().map(|_| decimator()).collect();
        let way = (machine.kind != MachineKind::Axis)
            .then(|| ColumnPair::new(["cart_position", "bridge_position"].map(String::from)));
        Self { sources, thinned, scratch: Vec::new(), way }
    }

    /// The cart's positions in its plane, y and x, where it has one.
    pub fn way(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        self.way.as_ref().map(ColumnPair::points)
    }

    /// Takes the next rows.
    pub fn take(&mut self, block: &Trajectory) {
        let column = |name: &str| block.get(name).unwrap_or(&[]);
        let time = column("time");
        for ((_, terms), thinned) in self.sources.iter().zip(&mut self.thinned) {
            let sum = match &terms[..] {
                [(name, 1.0)] => column(name),
                [(first, weight), rest @ ..] => {
                    self.scratch.clear();
                    self.scratch.extend(column(first).iter().map(|value| weight * value));
                    for (name, weight) in rest {
                        self.scratch.iter_mut().zip(column(name)).for_each(|(sum, value)| *sum += weight * value);
                    }
                    &self.scratch
                }
                [] => &[],
            };
            thinned.push(time, sum);
        }
        if let Some(way) = &mut self.way {
            way.take(block);
        }
    }

    /// Rows that the curves stand for.
    pub fn rows(&self) -> usize {
        self.thinned.iter().map(Decimator::seen).max().unwrap_or(0)
    }

    /// Times and values of the curve called `name`; none if the run has no such quantity.
    pub fn get(&self, name: &str) -> Option<(Vec<f64>, Vec<f64>)> {
        let place = self.sources.iter().position(|(n, _)| n == name)?;
        Some(self.thinned[place].points()).filter(|(times, _)| !times.is_empty())
    }
}

/// Where two columns go together, one over the other, thinned out by leaving out every second row as often as needed.
pub struct ColumnPair {
    columns: [String; 2],
    stride: usize,
    rows: usize,
    points: Vec<[f64; 2]>,
    last: [f64; 2],
}

impl ColumnPair {
    /// No points yet.
    pub fn new(columns: [String; 2]) -> Self {
        Self { columns, stride: 1, rows: 0, points: Vec::new(), last: [0.0; 2] }
    }

    /// Takes the next rows.
    pub fn take(&mut self, block: &Trajectory) {
        let [a, b] = [0, 1].map(|k| block.get(&self.columns[k]).unwrap_or(&[]));
        for (a, b) in a.iter().zip(b) {
            self.last = [*a, *b];
            if self.rows.is_multiple_of(self.stride) {
                self.points.push(self.last);
            }
            self.rows += 1;
            if self.points.len() > 2 * POINTS {
                let mut keep = false;
                self.points.retain(|_| {
                    keep = !keep;
                    keep
                });
                self.stride *= 2;
            }
        }
    }

    /// Values of both columns, the last row among them.
    pub fn points(&self) -> (Vec<f64>, Vec<f64>) {
        let last = Some(self.last).filter(|_| self.rows > 0);
        self.points.iter().copied().chain(last).map(|[a, b]| (a, b)).unzip()
    }
}
