//! The band that 95 % of the machines drawn from a posterior stay in, at every time for itself.

use crate::{Axis, Colour, Figure, Panel, Series, Style};
use taut::case::Experiment;

/// The band of one experiment.
pub struct Band {
    /// Times, s.
    pub time: Vec<f64>,
    /// Of drive angle, cart position, and drive travel minus cart: below, middle and above at these times.
    pub values: [[Vec<f64>; 3]; 3],
    /// Machines that it is made of.
    pub machines: usize,
    /// Machines that did not reach the end, and are left out.
    pub failed: usize,
}

impl Band {
    /// Below, middle and above of a quantity at the end.
    pub fn end(&self, quantity: usize) -> [f64; 3] {
        std::array::from_fn(|share| self.values[quantity][share].last().copied().unwrap_or(f64::NAN))
    }

    /// Its picture.
    pub fn figure(&self, experiment: &Experiment) -> Figure {
        let line = |name: &str, y: Vec<f64>, colour, style| {
            Series::new(name, self.time.clone(), y).colour(colour).style(style)
        };
        let [_, cart, left] = &self.values;
        let off = |share: usize| cart[share].iter().zip(&cart[1]).map(|(v, middle)| v - middle).collect::<Vec<f64>>();
        let band = |panel: Panel, low: Vec<f64>, high: Vec<f64>| {
            panel.series(line("97.5 %", high, Colour::Vermillion, Style::Solid)).series(line(
                "2.5 %",
                low,
                Colour::Green,
                Style::Solid,
            ))
        };
        let middle = |values: &[Vec<f64>; 3]| line("median", values[1].clone(), Colour::Blue, Style::Dashed);
        let position = Axis::new("Cart x", "m").shown_as("mm", 1e3);
        let width = Axis::new("x − median", "m").shown_as("mm", 1e3);
        let stretch = Axis::new("r φ₁ − x", "m").shown_as("µm", 1e6);
        Figure::new(format!("{}: band", experiment.name), Axis::new("Time", "s"))
            .panel(band(Panel::new(position).weight(2.0), cart[0].clone(), cart[2].clone()).series(middle(cart)))
            .panel(band(Panel::new(width), off(0), off(2)))
            .panel(band(Panel::new(stretch), left[0].clone(), left[2].clone()).series(middle(left)))
            .caption(format!(
                "Between the lines are 95 % of {} machines drawn from the posterior, at every time for itself.",
                self.machines
            ))
    }
}
