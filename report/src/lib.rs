//! Figures, drawings, diagrams and the report page that holds them.
//!
//! A [`Figure`] is described once and shown three ways: as SVG, as PNG (that very SVG, rasterised
//! with a font that is part of the program), and on a [`Page`], where a small script redraws it as the
//! reader zooms. Everything is a pure function of its input until a `write` is called.
//!
//! ```
//! use taut_report::{Axis, Callout, Figure, Page, Panel};
//!
//! let time: Vec<f64> = (0..=100).map(|i| 0.01 * i as f64).collect();
//! let position: Vec<f64> = time.iter().map(|t| 0.05 * (1.0 - (-5.0 * t).exp())).collect();
//! let figure = Figure::new("Cart position", Axis::new("Time", "s"))
//!     .caption("A first-order approach.")
//!     .panel(Panel::new(Axis::new("Position", "m").shown_as("mm", 1e3)).line("x", &time, &position));
//! let mut page = Page::new("A stage");
//! page.section("Motion");
//! page.prose("The cart settles after a second.");
//! page.figure(&figure);
//! page.callout(Callout::Holds, "It settles", "within 0.1 mm");
//! assert!(page.html().starts_with("<!DOCTYPE html>"));
//! ```

mod axis;
pub mod check;
pub mod decimate;
pub mod design;
pub mod diagram;
pub mod drawing;
mod embed;
pub mod equations;
pub mod figure;
pub mod fit;
pub mod frf;
mod gantry;
mod layout;
pub mod learn;
pub mod modes;
pub mod motion;
pub mod page;
mod picture;
pub mod plan;
mod plane;
mod plot;
#[cfg(feature = "png")]
mod raster;
pub mod shape;
pub mod show;
pub mod simulate;
mod svg;
pub mod sweep;
mod together;
pub mod tune;

pub use decimate::{Decimator, decimate};
pub use equations::{BodyEquation, FrictionTerm, Inertia, MotorEquation, Term, axis_diagram, body_diagram};
pub use figure::{Axis, Figure, Marker, Panel, Series, Style};
pub use page::{Callout, Cell, Page, Table};
pub use picture::Picture;
pub use plane::{Map, Plane};
#[cfg(feature = "png")]
pub use raster::png;
pub use svg::Colour;

/// The drawing of a machine, with its values and positive directions. Works in light and dark.
pub fn machine_drawing(machine: &taut::machine::Machine) -> String {
    match machine.kind {
        taut::machine::MachineKind::Axis => drawing::stage_drawing(machine),
        _ => gantry::gantry_drawing(machine),
    }
}

/// Puts the drawing of a machine on a page, says what it leaves out, and returns it.
pub fn drawn(page: &mut Page, machine: &taut::machine::Machine) -> String {
    let drawing = machine_drawing(machine);
    let caption = match machine.bridge.is_some() {
        false => "Symbols, values and positive directions.",
        true if machine.yaw.is_some() => {
            "In plan view with positive directions; lengths are not to scale. The bridge yaws on its bearings, positive if \
             its right end leads; idlers have neither inertia nor friction."
        }
        true => {
            "In plan view with positive directions; lengths are not to scale. In the model the bridge does not yaw, and \
             idlers have neither inertia nor friction."
        }
    };
    page.drawing(&drawing, caption);
    drawing
}
