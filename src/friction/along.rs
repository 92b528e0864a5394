//! Friction that changes along the travel.

/// A factor on the cart's dry friction (Coulomb, breakaway and what lies between), over the cart's position: straight
/// lines between points, the first and the last value held beyond them.
#[derive(Debug, Clone, PartialEq)]
pub struct Along {
    points: Vec<[f64; 2]>,
}

impl Along {
    /// From points (x in m, factor), x growing from point to point; `None` where they do not grow, or there are none.
    pub fn new(points: Vec<[f64; 2]>) -> Option<Self> {
        let good = |p: &[f64; 2]| p[0].is_finite() && p[1].is_finite() && p[1] >= 0.0;
        let along = Self { points };
        (!along.points.is_empty() && along.grows() && along.points.iter().all(good)).then_some(along)
    }

    /// Whether x grows from point to point, as it must.
    pub(crate) fn grows(&self) -> bool {
        self.points.windows(2).all(|pair| pair[0][0] < pair[1][0])
    }

    /// Sets the position (`part` 0) or the factor (1) of a point. What it makes is checked with the stage.
    pub(crate) fn set(&mut self, point: usize, part: usize, value: f64) {
        if let Some(number) = self.points.get_mut(point).and_then(|point| point.get_mut(part)) {
            *number = value;
        }
    }

    /// The points.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// The factor at position `x`, m.
    pub fn factor(&self, x: f64) -> f64 {
        let after = self.points.partition_point(|p| p[0] <= x);
        match (after.checked_sub(1).map(|i| self.points[i]), self.points.get(after)) {
            (Some([x0, f0]), Some(&[x1, f1])) => f0 + (f1 - f0) * (x - x0) / (x1 - x0),
            (Some([_, f]), None) | (None, Some(&[_, f])) => f,
            (None, None) => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_between_points_and_held_beyond() {
        let along = Along::new(vec![[0.0, 1.0], [0.1, 2.0], [0.2, 0.5]]).unwrap();
        for (x, factor) in [(-1.0, 1.0), (0.0, 1.0), (0.05, 1.5), (0.1, 2.0), (0.15, 1.25), (0.2, 0.5), (9.0, 0.5)] {
            assert!((along.factor(x) - factor).abs() < 1e-15, "{x}");
        }
        assert_eq!(Along::new(vec![[0.0, 1.0], [0.0, 2.0]]), None);
        assert_eq!(Along::new(vec![]), None);
    }
}
