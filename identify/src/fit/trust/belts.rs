//! Comparison of the belts of two drives: the ratio of their stiffness, with its standard error.
//!
//! With the sum K_d of the stiffnesses of the spans pulled by drive d alone, ln(K₂/K₁) is a function of the free
//! parameters. With its derivatives g with respect to their relative changes, its standard error is that of g along the
//! determined directions; if g has a component along others, it is not determined.

use super::directions::Directions;
use crate::control::belts::{Belts, Sides};
use crate::fit::asked::problem::Problem;
use crate::fit::limits::SHARE_LOST;
use crate::machine::{Machine, Spans};
use nalgebra::DMatrix;

/// The comparison of two drives, and its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared {
    /// The statement.
    pub belts: Belts,
    /// Derivatives of ln(K₂/K₁) with respect to the variables of the search.
    slopes: Vec<f64>,
}

/// ln(K₂/K₁) of a machine.
fn logarithm(machine: &Machine) -> f64 {
    let stiffness: Spans = machine.belt.following().map_or(machine.belt.stiffness, |make| make.stiffness());
    let of_drive = |drive| machine.geometry().spans_of(drive).map(|span| stiffness[span]).sum::<f64>();
    (of_drive(1) / of_drive(0)).ln()
}

impl Compared {
    /// The comparison at `x`; `None` for a machine with one drive, or if no free parameter changes the ratio. `of` is
    /// the standard error along a combination of directions, of which `lost` are not determined.
    pub(super) fn new(
        problem: &Problem,
        directions: &Directions,
        lost: &[usize],
        x: &[f64],
        of: &dyn Fn(&[f64]) -> f64,
    ) -> Option<Self> {
        let geometry = problem.machine.geometry();
        let [first, second] = geometry.drives else { return None };
        let n = directions.v.nrows();
        let slope = |j: usize| {
            let h = 1e-4 * (1.0 + x[j].abs());
            let at = |by: f64| {
                let mut moved = x.to_vec();
                moved[j] += by;
                logarithm(&problem.stage_at(&moved))
            };
            (at(h) - at(-h)) / (2.0 * h)
        };
        let slopes: Vec<f64> = (0..n).map(|j| if j < problem.parameters.len() { slope(j) } else { 0.0 }).collect();
        let relative: Vec<f64> = slopes.iter().zip(&directions.whole).map(|(slope, whole)| slope * whole).collect();
        let size: f64 = relative.iter().map(|c| c * c).sum();
        if size.is_nan() || size <= 1e-20 {
            return None;
        }
        let along = |i: usize| relative.iter().enumerate().map(|(j, c)| c * directions.v[(j, i)]).sum::<f64>();
        let hidden: f64 = lost.iter().map(|&i| along(i).powi(2)).sum();
        let kept: Vec<f64> = (0..directions.alive).map(|i| if lost.contains(&i) { 0.0 } else { along(i) }).collect();
        let is_known = hidden <= SHARE_LOST * SHARE_LOST * size;
        let belts = Belts {
            sides: Sides::Drives([first.label.name, second.label.name]),
            ratio: logarithm(&problem.stage_at(x)).exp(),
            error: if is_known { of(&kept) } else { f64::INFINITY },
        };
        Some(Self { belts, slopes })
    }

    /// Adds an addition to the covariance of the variables to the error.
    pub(super) fn widen(&mut self, added: &DMatrix<f64>) {
        let n = added.nrows().min(self.slopes.len());
        let sum: f64 = (0..n)
            .flat_map(|i| (0..n).map(move |j| (i, j)))
            .map(|(i, j)| self.slopes[i] * self.slopes[j] * added[(i, j)])
            .sum();
        self.belts.error = self.belts.error.hypot(sum.max(0.0).sqrt());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_added_to_a_covariance_is_in_the_error() {
        let belts = Belts { sides: Sides::Drives(["left drive", "right drive"]), ratio: 0.8, error: 0.03 };
        let mut own = Compared { belts, slopes: vec![1.0] };
        own.widen(&DMatrix::from_element(1, 1, 0.04 * 0.04));
        assert!((own.belts.error - 0.05).abs() < 1e-12);
    }
}
