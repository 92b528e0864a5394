//! The plots of a move.

use super::Done;
use crate::simulate::{Named, decimator};
use crate::{Axis, Colour, Decimator, Figure, Panel, Series, Style};
use taut::machine::Machine;
use taut::trajectory::Trajectory;

/// Columns that are shown; what ends on an angle or its speed is shown at the belt.
const COLUMNS: [&str; 11] = [
    "reference",
    "cart_position",
    "cart_error",
    "drive_angle",
    "cart_speed",
    "drive_speed",
    "voltage",
    "motor_current",
    "span1_force",
    "span2_force",
    "span3_force",
];

/// The curves of a move, thinned out as its rows come.
pub struct Curves {
    radius: f64,
    thinned: Vec<Decimator>,
    following: Decimator,
    scratch: Vec<f64>,
}

impl Curves {
    /// No points yet.
    pub fn new(machine: &Machine) -> Self {
        let thinned = COLUMNS.iter().map(|_| decimator()).collect();
        Self { radius: machine.pulley_radius, thinned, following: decimator(), scratch: Vec::new() }
    }

    /// Takes the next rows.
    pub fn take(&mut self, block: &Trajectory) {
        let column = |name: &str| block.get(name).unwrap_or(&[]);
        let time = column("time");
        for (name, thinned) in COLUMNS.into_iter().zip(&mut self.thinned) {
            let factor = if name.starts_with("drive") { self.radius } else { 1.0 };
            self.scratch.clear();
            self.scratch.extend(column(name).iter().map(|value| factor * value));
            thinned.push(time, &self.scratch);
        }
        let pairs = column("drive_angle").iter().zip(column("reference"));
        self.scratch.clear();
        self.scratch.extend(pairs.map(|(angle, y)| self.radius * angle - y));
        self.following.push(time, &self.scratch);
    }

    fn get(&self, name: &str) -> (Vec<f64>, Vec<f64>) {
        match COLUMNS.iter().position(|column| *column == name) {
            Some(place) => self.thinned[place].points(),
            None => self.following.points(),
        }
    }
}

/// Every plot of a move; none if its curves were not kept.
pub fn figures(done: &Done) -> Vec<Named> {
    let Some(curves) = &done.curves else { return Vec::new() };
    let figure = |name: &str| Figure::new(format!("{}: {name}", done.motion.name), Axis::new("Time", "s"));
    let panel = |axis: Axis, lines: &[(&str, &str)]| {
        let looks = [(Colour::Blue, Style::Solid), (Colour::Vermillion, Style::Solid), (Colour::Green, Style::Dashed)];
        lines.iter().zip(looks).fold(Panel::new(axis), |panel, (&(column, name), (colour, style))| {
            let (x, y) = curves.get(column);
            let name = if lines.len() > 1 { name } else { "" };
            panel.series(Series::new(name, x, y).colour(colour).style(style).thinned_from(curves.following.seen()))
        })
    };
    let millimetres = |name: &'static str| Axis::new(name, "m").shown_as("mm", 1e3);
    let micrometres = |name: &'static str| Axis::new(name, "m").shown_as("µm", 1e6);
    let motion = figure("position and error")
        .panel(panel(
            millimetres("Position"),
            &[("cart_position", "cart x"), ("drive_angle", "drive pulley r φ₁"), ("reference", "reference y")],
        ))
        .panel(panel(micrometres("Error"), &[("cart_error", "cart x − y"), ("following", "drive pulley r φ₁ − y")]))
        .caption("Where the cart should be and is, and by how much cart and drive pulley are off.");
    let speed = figure("speed")
        .panel(panel(
            Axis::new("Speed", "m/s").shown_as("mm/s", 1e3),
            &[("cart_speed", "cart"), ("drive_speed", "drive pulley")],
        ))
        .caption("Speeds along the belt.");
    let effort = figure("effort")
        .panel(panel(Axis::new("Voltage", "V"), &[("voltage", "")]))
        .panel(panel(Axis::new("Current", "A"), &[("motor_current", "")]))
        .panel(panel(
            Axis::new("Force", "N"),
            &[("span1_force", "span 1"), ("span2_force", "span 2"), ("span3_force", "span 3")],
        ))
        .caption("What the motor gets, and the forces in the spans without the belt's pretension.");
    vec![("motion", motion), ("speed", speed), ("effort", effort)]
}
