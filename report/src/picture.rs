//! Whatever can be drawn: a figure over one axis, a plane, a drawing.

use super::{Figure, Plane, png};
use taut::error::Result;

/// Pixels of a PNG for each of the SVG's: sharp on paper and on dense screens.
const SCALE: f32 = 2.0;

/// One picture of a report.
#[derive(Debug, Clone)]
pub enum Picture {
    /// Curves over a common axis.
    Figure(Figure),
    /// A plane: a map, or points with equal axes.
    Plane(Plane),
    /// An SVG as it is.
    Drawing(String),
}

impl Picture {
    /// As an SVG that stands alone.
    pub fn svg(&self) -> String {
        match self {
            Self::Figure(figure) => figure.svg(),
            Self::Plane(plane) => plane.svg(),
            Self::Drawing(svg) => svg.clone(),
        }
    }

    /// The picture as a PNG, at twice the size on white.
    ///
    /// # Errors
    ///
    /// A picture of more than 16384 pixels to a side.
    pub fn png(&self) -> Result<Vec<u8>> {
        png(&self.svg(), SCALE)
    }
}

impl From<Figure> for Picture {
    fn from(figure: Figure) -> Self {
        Self::Figure(figure)
    }
}

impl From<Plane> for Picture {
    fn from(plane: Plane) -> Self {
        Self::Plane(plane)
    }
}
