//! Friction over speed: a figure for each body.

use taut::case::Case;
use taut::friction::Friction;
use taut_report::{Axis, Colour, Figure, Page, Panel, Series, Style};

/// Points of a curve on each side of rest.
const POINTS: usize = 400;

/// A section with the curve of each body, up to `speed`, m/s, of what slides.
pub fn page(case: &Case, speed: f64) -> Page {
    let rotary = (Axis::new("Speed", "rad/s"), Axis::new("Friction torque", "N m").shown_as("mN m", 1e3));
    let linear = (Axis::new("Speed", "m/s").shown_as("mm/s", 1e3), Axis::new("Friction force", "N"));
    let (radius, bodies) = match case {
        case if case.is_axis() => {
            let machine = &case.machine;
            let bodies = vec![
                ("Drive pulley", &machine.drive_pulley.friction, true),
                ("Cart", &machine.cart.friction, false),
                ("Idler pulley", &machine.idler_pulley.friction, true),
            ];
            (machine.pulley_radius, bodies)
        }
        case => {
            let gantry = &case.machine;
            let bodies = vec![
                ("Drive pulleys", &gantry.drive_pulley.friction, true),
                ("Bridge", &gantry.first_slide().friction, false),
                ("Cart", &gantry.cart.friction, false),
            ];
            (gantry.pulley_radius, bodies)
        }
    };
    let mut page = Page::new("Friction");
    page.section("Friction over speed");
    page.prose("What resists while a body slides steadily; dots are what it holds at rest before it slides.");
    for (name, friction, turns) in bodies {
        let ((x, y), speed) = if turns { (rotary.clone(), speed / radius) } else { (linear.clone(), speed) };
        page.figure(&figure(name, friction, (x, y), speed));
    }
    page
}

/// The curve of one body; at zero speed it is broken.
fn figure(name: &str, friction: &Friction, (x, y): (Axis, Axis), speed: f64) -> Figure {
    // Close to rest there is more to see where friction falls with speed.
    let place = |k: usize| speed * (k as f64 / POINTS as f64).powi(2);
    let side = |sign: f64| -> (Vec<f64>, Vec<f64>) {
        let speeds = (0..=POINTS).map(|k| sign * place(k).max(1e-9 * speed));
        speeds.map(|v| (v, friction.sliding(v))).unzip()
    };
    let mut panel = Panel::new(y);
    for sign in [1.0, -1.0] {
        let (speeds, loads) = side(sign);
        panel = panel.series(Series::new("", speeds, loads).colour(Colour::Blue));
    }
    let held = [friction.breakaway(true), -friction.breakaway(false)];
    if held != [0.0, -0.0] {
        panel = panel.series(Series::new("", [0.0; 2], held).colour(Colour::Vermillion).style(Style::Points));
    }
    Figure::new(name, x).panel(panel)
}
