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
            ("planned", &planned.profiles, Colour::Vermillion, Style::Solid),
            ("file", &planned.references, Colour::Blue, Style::Dashed),
        ];
        let geometry = plans.family.machine.geometry();
        let slides: Vec<&str> = geometry.slides.iter().map(|slide| geometry.label(slide.body).name).collect();
        let called = |name: &str, slide: &str| if slides.len() > 1 { format!("{slide}, {name}") } else { name.into() };
        let panel = |axis: Axis, of: fn(&Reference) -> f64| {
            let each = both.iter().flat_map(|(name, profiles, colour, style)| {
                let curves = profiles.iter().zip(&slides).enumerate();
                curves.map(move |(number, (profile, slide))| {
                    let (x, y) = points(profile, of);
                    let colour = if number == 0 { *colour } else { Colour::Green };
                    Series::new(called(name, slide), x, y).colour(colour).style(*style)
                })
            });
            each.fold(Panel::new(axis), Panel::series)
        };
        let figure = Figure::new(format!("{}: reference", planned.name), Axis::new("Time", "s"))
            .panel(panel(Axis::new("Position", "m").shown_as("mm", 1e3), |y| y.position))
            .panel(panel(Axis::new("Speed", "m/s"), |y| y.speed))
            .panel(panel(Axis::new("Acceleration", "m/s²"), |y| y.acceleration))
            .caption("The planned references, and those of the case file.");
        (format!("{}-reference", taut::plan::file_name(&planned.name)), figure)
    };
    plans.moves.iter().map(figure).collect()
}

fn points(profile: &Profile, of: fn(&Reference) -> f64) -> (Vec<f64>, Vec<f64>) {
    let time = |k: usize| profile.end() * k as f64 / POINTS as f64;
    (0..=POINTS).map(|k| (time(k), of(&profile.at(time(k))))).unzip()
}
