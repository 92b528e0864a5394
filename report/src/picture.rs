//! Pictures: a figure over one axis, a plane, a drawing.

use super::{Figure, Plane};

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
