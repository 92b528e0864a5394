//! Lines through points.

use crate::calculator::{Calculator, at_least};

/// Points that a line of a machine may have.
pub const MOST_POINTS: usize = 100;

/// A value over x by straight lines between points, the first and the last value held beyond them: what changes along
/// the travel, or with the speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline {
    points: Vec<[f64; 2]>,
}

impl Polyline {
    /// From points (x, value), x growing from point to point; `None` where they do not grow, or there are none.
    pub fn new(points: Vec<[f64; 2]>) -> Option<Self> {
        let line = Self { points };
        let is_finite = line.points.iter().flatten().all(|number| number.is_finite());
        (!line.points.is_empty() && line.grows() && is_finite).then_some(line)
    }

    /// True if x grows from point to point, as it must.
    pub(crate) fn grows(&self) -> bool {
        self.points.windows(2).all(|pair| pair[0][0] < pair[1][0])
    }

    /// Sets x (`part` 0) or the value (1) of a point. What it makes is checked with the stage.
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
    pub fn value_by<C: Calculator>(&self, c: &mut C, x: C::N) -> C::N {
        let first = c.number(self.piece(0)[0]);
        let numbered = self.points.iter().enumerate();
        numbered.fold(first, |before, (number, point)| {
            let [constant, slope] = self.piece(number + 1);
            c.choose(at_least(x, point[0]), x * slope + constant, before)
        })
    }

    /// The piece that `x` is on: 0 before the first point, behind each point the next one.
    pub fn piece_at(&self, x: f64) -> usize {
        self.points.partition_point(|point| point[0] <= x)
    }

    /// A piece: its value where x is 0, and its slope; the same numbers from either end, so that the image of a line
    /// has the images of its pieces.
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

    /// Where a piece begins and ends; the first and the last have one end.
    pub fn ends(&self, piece: usize) -> [Option<f64>; 2] {
        let x = |point: Option<&[f64; 2]>| point.map(|point| point[0]);
        [x(piece.checked_sub(1).and_then(|i| self.points.get(i))), x(self.points.get(piece))]
    }

    /// The same with values times `factor`.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self { points: self.points.iter().map(|[x, value]| [*x, factor * value]).collect() }
    }

    /// The same values over x − `shift`.
    pub(crate) fn shifted(&self, shift: f64) -> Self {
        Self { points: self.points.iter().map(|[x, value]| [x - shift, *value]).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calculator::Run;

    #[test]
    fn lines_between_points_and_held_beyond() {
        let line = Polyline::new(vec![[0.0, 1.0], [0.1, 2.0], [0.2, 0.5]]).unwrap();
        for (x, value) in [(-1.0, 1.0), (0.0, 1.0), (0.05, 1.5), (0.1, 2.0), (0.15, 1.25), (0.2, 0.5), (9.0, 0.5)] {
            assert!((line.value(x) - value).abs() < 1e-15, "{x}");
            assert_eq!(line.value_by(&mut Run::plain(), x), line.value(x), "{x}");
            assert!((line.shifted(0.3).value(x - 0.3) - value).abs() < 1e-14, "{x}");
            let [begin, end] = line.ends(line.piece_at(x));
            assert!(begin.is_none_or(|begin| begin <= x) && end.is_none_or(|end| x < end), "{x}");
        }
        assert_eq!(Polyline::new(vec![[0.0, 1.0], [0.0, 2.0]]), None);
        assert_eq!(Polyline::new(vec![[0.0, f64::NAN]]), None);
        assert_eq!(Polyline::new(vec![]), None);
    }
}
