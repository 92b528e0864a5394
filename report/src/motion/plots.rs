//! The plots of a move.

use super::Done;
use crate::simulate::{ColumnPair, Named, decimator};
use crate::{Axis, Colour, Decimator, Figure, Panel, Plane, Series, Style};
use taut::machine::{DriveAt, Machine};
use taut::mechanism::Label;
use taut::trajectory::Trajectory;

/// The curves of a move, thinned out as its rows come.
pub struct Curves {
    /// Columns, and what makes a value along the belt of theirs.
    columns: Vec<(String, f64)>,
    thinned: Vec<Decimator>,
    /// References along the belt minus their drives: each drive's column of its angle, and weights of the references.
    drives: Vec<(String, Vec<(String, f64)>)>,
    following: Vec<Decimator>,
    /// The path that was asked for and that of the cart, of a gantry.
    paths: Option<[ColumnPair; 2]>,
    scratch: Vec<f64>,
    radius: f64,
}

impl Curves {
    /// No points yet.
    pub fn new(machine: &Machine) -> Self {
        let (geometry, r) = (machine.geometry(), machine.pulley_radius);
        let loads: Vec<&str> = geometry.slides.iter().map(|slide| geometry.label(slide.body).key).collect();
        let reference = |key: &str| if loads.len() == 1 { "reference".into() } else { format!("{key}_reference") };
        let mut columns = Vec::new();
        let mut add = |name: String, factor: f64| columns.push((name, factor));
        for key in &loads {
            add(reference(key), 1.0);
            ["position", "error", "speed"].into_iter().for_each(|what| add(format!("{key}_{what}"), 1.0));
        }
        if loads.len() > 1 {
            add("contour_error".into(), 1.0);
        }
        for drive in geometry.drives {
            let pulley = geometry.label(drive.pulley).key;
            ["angle", "speed"].into_iter().for_each(|what| add(format!("{pulley}_{what}"), r));
            add(drive.voltage.key.into(), 1.0);
            add(drive.current_column.into(), 1.0);
        }
        geometry.spans.iter().for_each(|span| add(format!("{}_force", span.column), 1.0));
        let of_drive = |(drive, shares): (&DriveAt, &[f64])| {
            let angle = format!("{}_angle", geometry.label(drive.pulley).key);
            (angle, loads.iter().zip(shares).map(|(key, share)| (reference(key), *share)).collect())
        };
        let drives: Vec<_> = geometry.drives.iter().zip(machine.belt_shares()).map(of_drive).collect();
        Self {
            thinned: columns.iter().map(|_| decimator()).collect(),
            columns,
            following: drives.iter().map(|_| decimator()).collect(),
            drives,
            paths: match &loads[..] {
                [x, y] => {
                    let path = |of: &dyn Fn(&str) -> String| ColumnPair::new([of(x), of(y)]);
                    Some([path(&reference), path(&|key| format!("{key}_position"))])
                }
                _ => None,
            },
            scratch: Vec::new(),
            radius: r,
        }
    }

    /// Takes the next rows.
    pub fn take(&mut self, block: &Trajectory) {
        let column = |name: &str| block.get(name).unwrap_or(&[]);
        let time = column("time");
        for ((name, factor), thinned) in self.columns.iter().zip(&mut self.thinned) {
            self.scratch.clear();
            self.scratch.extend(column(name).iter().map(|value| factor * value));
            thinned.push(time, &self.scratch);
        }
        for ((angle, references), thinned) in self.drives.iter().zip(&mut self.following) {
            self.scratch.clear();
            self.scratch.extend(column(angle).iter().map(|angle| -self.radius * angle));
            for (name, share) in references {
                self.scratch.iter_mut().zip(column(name)).for_each(|(left, y)| *left += share * y);
            }
            thinned.push(time, &self.scratch);
        }
        if let Some(paths) = &mut self.paths {
            paths.iter_mut().for_each(|path| path.take(block));
        }
    }

    fn get(&self, name: &str) -> (Vec<f64>, Vec<f64>) {
        let place = self.columns.iter().position(|(column, _)| column == name);
        place.map_or_else(Default::default, |place| self.thinned[place].points())
    }

    fn seen(&self) -> usize {
        self.following.first().map_or(0, Decimator::seen)
    }
}

/// Lines of a panel: name and points.
type Lines = Vec<(String, (Vec<f64>, Vec<f64>))>;

/// Every plot of a move; none if its curves were not kept.
pub fn figures(machine: &Machine, done: &Done) -> Vec<Named> {
    let Some(curves) = &done.curves else { return Vec::new() };
    let geometry = machine.geometry();
    let several = geometry.slides.len() > 1;
    let figure = |name: &str| Figure::new(format!("{}: {name}", done.motion.name), Axis::new("Time", "s"));
    let panel = |axis: Axis, lines: Lines| {
        let looks = [
            (Colour::Blue, Style::Solid),
            (Colour::Vermillion, Style::Solid),
            (Colour::Green, Style::Dashed),
            (Colour::Purple, Style::Dashed),
        ];
        let named = lines.len() > 1;
        lines.into_iter().zip(looks.into_iter().cycle()).fold(
            Panel::new(axis),
            |panel, ((name, (x, y)), (colour, style))| {
                let name = if named { name } else { String::new() };
                panel.series(Series::new(name, x, y).colour(colour).style(style).thinned_from(curves.seen()))
            },
        )
    };
    let line = |column: &str, name: &str| (name.to_string(), curves.get(column));
    let millimetres = |name: &'static str| Axis::new(name, "m").shown_as("mm", 1e3);
    let micrometres = |name: &'static str| Axis::new(name, "m").shown_as("µm", 1e6);
    let loads = || geometry.slides.iter().map(|slide| geometry.label(slide.body));
    let drives = || geometry.drives.iter().zip(&curves.following);
    let side = |drive: &DriveAt| drive.label.name.trim_end_matches(" drive").to_string();
    let (position, error) = match several {
        false => {
            let position = vec![
                line("cart_position", "cart x"),
                line("drive_angle", "drive pulley r φ₁"),
                line("reference", "reference y"),
            ];
            (
                position,
                vec![line("cart_error", "cart y − x"), ("drive pulley y − r φ₁".into(), curves.following[0].points())],
            )
        }
        true => {
            let position = loads().flat_map(|Label { key, name }| {
                [
                    line(&format!("{key}_position"), name),
                    line(&format!("{key}_reference"), &format!("{name}, reference")),
                ]
            });
            let error = loads().map(|Label { key, name }| line(&format!("{key}_error"), name));
            (position.collect(), error.chain([line("contour_error", "from the path")]).collect())
        }
    };
    let mut motion = figure("position and error")
        .panel(panel(millimetres("Position"), position))
        .panel(panel(micrometres("Error"), error))
        .caption(match several {
            false => "Where the cart should be and is, and by how much cart and drive pulley are off.",
            true => {
                "Where bridge and cart should be and are, by how much they are off, and the distance from the path."
            }
        });
    if several {
        let following = drives().map(|(drive, following)| (side(drive), following.points())).collect();
        motion = motion.panel(panel(micrometres("Drives"), following));
    }
    let mut speeds: Lines = loads().map(|Label { key, name }| line(&format!("{key}_speed"), name)).collect();
    speeds.extend(geometry.drives.iter().map(|drive| {
        let Label { key, name } = geometry.label(drive.pulley);
        line(&format!("{key}_speed"), name)
    }));
    let speed = figure("speed")
        .panel(panel(Axis::new("Speed", "m/s").shown_as("mm/s", 1e3), speeds))
        .caption("Speeds along the belt.");
    let of_drives = |column: fn(&DriveAt) -> &'static str| -> Lines {
        geometry.drives.iter().map(|drive| line(column(drive), &side(drive))).collect()
    };
    let forces = geometry.spans.iter().map(|span| line(&format!("{}_force", span.column), span.label.name)).collect();
    let mut effort = figure("effort");
    if machine.stepper().is_none() {
        // The phases of a stepper have voltages of their own.
        effort = effort.panel(panel(Axis::new("Voltage", "V"), of_drives(|drive| drive.voltage.key)));
    }
    let effort = effort
        .panel(panel(Axis::new("Current", "A"), of_drives(|drive| drive.current_column)))
        .panel(panel(Axis::new("Force", "N"), forces))
        .caption(match several {
            false => "What the motor gets, and the forces in the spans without the belt's pretension.",
            true => "What the motors get, and the forces in the spans without the belts' pretension.",
        });
    vec![("motion", motion), ("speed", speed), ("effort", effort)]
}

/// Path of the cart in the plane, with its distance from the requested path magnified; none for an axis, or without
/// curves.
pub fn path(done: &Done) -> Option<Plane> {
    let [asked, gone] = done.curves.as_ref()?.paths.as_ref()?;
    let (asked, gone) = (asked.points(), gone.points());
    let size = [&asked.0, &asked.1].map(|values| extent(values)).into_iter().fold(0.0, f64::max);
    let most = done.run.figures.contour.map_or(0.0, |contour| contour.peak.value.abs());
    let times = magnification(most, size);
    let off = |(asked, gone): (&f64, &f64)| asked + times * (gone - asked);
    let magnified = [(&asked.0, &gone.0), (&asked.1, &gone.1)];
    let [x, y] = magnified.map(|(asked, gone)| asked.iter().zip(gone).map(off).collect::<Vec<f64>>());
    let millimetres = |name: &str| Axis::new(name, "m").shown_as("mm", 1e3);
    Some(
        Plane::new(format!("{}: path", done.motion.name), millimetres("Cart y"), millimetres("Bridge x"))
            .path(Series::new("asked for", asked.1, asked.0).colour(Colour::Vermillion))
            .path(Series::new("gone", y, x).colour(Colour::Blue))
            .caption(format!(
                "The path that is asked for, in red, and that of the cart, in blue: its difference from where it should be \
                 at that moment is drawn {times} times as large. Seen as the drawing is: x upward, y to the right."
            )),
    )
}

/// The greatest of 1, 2, 5, 10, … by which a deviation is a tenth of the size of a path at most.
fn magnification(deviation: f64, size: f64) -> f64 {
    let room = if deviation > 0.0 { 0.1 * size / deviation } else { 1.0 };
    let decade = 10_f64.powf(room.max(1.0).log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|step| step * decade).find(|times| *times <= room).unwrap_or(1.0).min(1e6)
}

/// The greatest minus the least of some values.
fn extent(values: &[f64]) -> f64 {
    let ends = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
    (ends.1 - ends.0).max(0.0)
}
