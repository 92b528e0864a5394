//! Piecewise linear functions.

use crate::calculator::{Calculator, at_least};

/// Maximum number of points of a line of a machine.
pub const MOST_POINTS: usize = 100;

/// Piecewise linear function of x (position or speed) through points, constant beyond the first and the last.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline {
    points: Vec<[f64; 2]>,
}

impl Polyline {
    /// From points (x, value) with increasing x; `None` if x does not increase, or without points.
    pub fn new(points: Vec<[f64; 2]>) -> Option<Self> {
        let line = Self { points };
        let is_finite = line.points.iter().flatten().all(|number| number.is_finite());
        (!line.points.is_empty() && line.grows() && is_finite).then_some(line)
    }

    /// True if x increases, as required.
    pub(crate) fn grows(&self) -> bool {
        self.points.windows(2).all(|pair| pair[0][0] < pair[1][0])
    }

    /// Sets x (`part` 0) or the value (1) of a point. The result is checked with the machine.
    pub(crate) fn set(&mut self, point: usize, part: usize, value: f64) {
        if let Some(number) = self.points.get_mut(point).and_then(|point| point.get_mut(part)) {
            *number = value;
        }
    }

    /// The points.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// The value at `x`.
    pub fn value(&self, x: f64) -> f64 {
        let [constant, slope] = self.piece(self.piece_at(x));
        constant + slope * x
    }

    /// As [`Polyline::value`], for any calculator.
    pub(crate) fn value_by<C: Calculator>(&self, c: &mut C, x: C::N) -> C::N {
        let first = c.number(self.piece(0)[0]);
        let numbered = self.points.iter().enumerate();
        numbered.fold(first, |before, (number, point)| {
            let [constant, slope] = self.piece(number + 1);
            c.choose(at_least(x, point[0]), x * slope + constant, before)
        })
    }

    /// Index of the piece at `x`: 0 before the first point, one more after each point.
    pub fn piece_at(&self, x: f64) -> usize {
        self.points.partition_point(|point| point[0] <= x)
    }

    /// A piece: its value at x = 0, and its slope; computed symmetrically, so that the pieces of a mirrored line are
    /// exact mirror images.
    ///
    /// ```text
    /// y = (y₀ x₁ − y₁ x₀)/(x₁ − x₀) + (y₁ − y₀)/(x₁ − x₀) x
    /// ```
    pub fn piece(&self, piece: usize) -> [f64; 2] {
        match (piece.checked_sub(1).and_then(|i| self.points.get(i)), self.points.get(piece)) {
            (Some(&[x0, y0]), Some(&[x1, y1])) => [(y0 * x1 - y1 * x0) / (x1 - x0), (y1 - y0) / (x1 - x0)],
            (Some(&[_, y]), None) | (None, Some(&[_, y])) => [y, 0.0],
            (None, None) => [0.0; 2],
        }
    }

    /// Magnitude of the terms whose difference is the value of a piece at x = 0, including the rounding of the points'
    /// distance: 2 (|y₀ x₁| + |y₁ x₀|)/(x₁ − x₀).
    pub(crate) fn size_of_constant(&self, piece: usize) -> f64 {
        match (piece.checked_sub(1).and_then(|i| self.points.get(i)), self.points.get(piece)) {
            (Some(&[x0, y0]), Some(&[x1, y1])) => 2.0 * ((y0 * x1).abs() + (y1 * x0).abs()) / (x1 - x0),
            _ => self.piece(piece)[0].abs(),
        }
    }

    /// Ends of a piece; the first and the last have one end.
    pub fn ends(&self, piece: usize) -> [Option<f64>; 2] {
        let x = |point: Option<&[f64; 2]>| point.map(|point| point[0]);
        [x(piece.checked_sub(1).and_then(|i| self.points.get(i))), x(self.points.get(piece))]
    }

    /// The function times `factor`.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self { points: self.points.iter().map(|[x, value]| [*x, factor * value]).collect() }
    }

    /// The function of x − `shift`.
    pub(crate) fn shifted(&self, shift: f64) -> Self {
        Self { points: self.points.iter().map(|[x, value]| [x - shift, *value]).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calculator::Evaluation;

    #[test]
    fn lines_between_points_and_held_beyond() {
        let line = Polyline::new(vec![[0.0, 1.0], [0.1, 2.0], [0.2, 0.5]]).unwrap();
        for (x, value) in [(-1.0, 1.0), (0.0, 1.0), (0.05, 1.5), (0.1, 2.0), (0.15, 1.25), (0.2, 0.5), (9.0, 0.5)] {
            assert!((line.value(x) - value).abs() < 1e-15, "{x}");
            assert_eq!(line.value_by(&mut Evaluation::plain(), x), line.value(x), "{x}");
            assert!((line.shifted(0.3).value(x - 0.3) - value).abs() < 1e-14, "{x}");
            let [begin, end] = line.ends(line.piece_at(x));
            assert!(begin.is_none_or(|begin| begin <= x) && end.is_none_or(|end| x < end), "{x}");
        }
        assert_eq!(Polyline::new(vec![[0.0, 1.0], [0.0, 2.0]]), None);
        assert_eq!(Polyline::new(vec![[0.0, f64::NAN]]), None);
        assert_eq!(Polyline::new(vec![]), None);
    }
}
