//! The plots of planned moves.

use crate::{Axis, Colour, Figure, Panel, Series, Style};
use taut::planning::Plans;
use taut::signal::profile::{Profile, Reference};

/// Points of a reference.
const POINTS: usize = 600;

/// Speed and acceleration of each reference, planned and of the file.
pub fn figures(plans: &Plans) -> Vec<(String, Figure)> {
    let figure = |planned: &taut::planning::Planned| {
        let both = [
            ("planned", &planned.profile, Colour::Vermillion, Style::Solid),
            ("file", &planned.reference, Colour::Blue, Style::Dashed),
        ];
        let panel = |axis: Axis, of: fn(&Reference) -> f64| {
            both.iter().fold(Panel::new(axis), |panel, (name, profile, colour, style)| {
                let (x, y) = points(profile, of);
                panel.series(Series::new(*name, x, y).colour(*colour).style(*style))
            })
        };
        let figure = Figure::new(format!("{}: reference", planned.name), Axis::new("Time", "s"))
            .panel(panel(Axis::new("Position", "m").shown_as("mm", 1e3), |y| y.position))
            .panel(panel(Axis::new("Speed", "m/s"), |y| y.speed))
            .panel(panel(Axis::new("Acceleration", "m/s²"), |y| y.acceleration))
            .caption("The planned reference of the cart, and that of the case file.");
        (format!("{}-reference", taut::plan::file_name(&planned.name)), figure)
    };
    plans.moves.iter().map(figure).collect()
}

fn points(profile: &Profile, of: fn(&Reference) -> f64) -> (Vec<f64>, Vec<f64>) {
    let time = |k: usize| profile.end() * k as f64 / POINTS as f64;
    (0..=POINTS).map(|k| (time(k), of(&profile.at(time(k))))).unzip()
}
