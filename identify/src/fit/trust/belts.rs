//! Comparison of the belts of two drives: the looser one, and the ratio of stiffness.
//!
//! With the sum K_d of the stiffnesses of the spans pulled by drive d alone, ln(K₂/K₁) is a function of the free
//! parameters. With its derivatives g with respect to their relative changes, its standard error is that of g along the
//! determined directions; if g has a component along others, it is not determined.

use super::directions::Directions;
use crate::fit::asked::problem::Problem;
use crate::fit::limits::{NORMAL, SHARE_LOST};
use crate::machine::{Machine, Spans};
use crate::number::significant;
use nalgebra::DMatrix;

/// The stiffness of the spans at the second drive over that of those at the first.
#[derive(Debug, Clone, PartialEq)]
pub struct Belts {
    /// Names of both drives.
    pub drives: [&'static str; 2],
    /// K₂/K₁
    pub ratio: f64,
    /// Standard error of ln(K₂/K₁); infinite if the logs do not determine it.
    pub error: f64,
    /// Derivatives of ln(K₂/K₁) with respect to the variables of the search.
    slopes: Vec<f64>,
}

/// ln(K₂/K₁) of a machine.
fn logarithm(machine: &Machine) -> f64 {
    let stiffness: Spans = machine.belt.following().map_or(machine.belt.stiffness, |make| make.stiffness());
    let of_drive = |drive| machine.geometry().spans_of(drive).map(|span| stiffness[span]).sum::<f64>();
    (of_drive(1) / of_drive(0)).ln()
}

impl Belts {
    /// The comparison at `x`; `None` for a machine with one drive, or if no free parameter changes the ratio. `of` is
    /// the standard error along a combination of directions, of which `lost` are not determined.
    pub(super) fn compared(
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
        Some(Self {
            drives: [first.label.name, second.label.name],
            ratio: logarithm(&problem.stage_at(x)).exp(),
            error: if is_known { of(&kept) } else { f64::INFINITY },
            slopes,
        })
    }

    /// Adds an addition to the covariance of the variables to the error.
    pub(super) fn widen(&mut self, added: &DMatrix<f64>) {
        let n = added.nrows().min(self.slopes.len());
        let sum: f64 = (0..n)
            .flat_map(|i| (0..n).map(move |j| (i, j)))
            .map(|(i, j)| self.slopes[i] * self.slopes[j] * added[(i, j)])
            .sum();
        self.error = self.error.hypot(sum.max(0.0).sqrt());
    }

    /// 95 % interval of the ratio; from zero to infinity if it is not determined.
    pub fn interval(&self) -> [f64; 2] {
        let reach = (NORMAL * self.error).exp();
        [self.ratio / reach, self.ratio * reach]
    }

    /// Index of the drive with less stiff spans; `None` if the interval does not decide.
    pub fn looser(&self) -> Option<usize> {
        match self.interval() {
            [_, high] if high < 1.0 => Some(1),
            [low, _] if low > 1.0 => Some(0),
            _ => None,
        }
    }

    /// The comparison in a sentence.
    pub fn words(&self) -> String {
        let [low, high] = self.interval();
        let percent = |ratio: f64| significant(100.0 * (1.0 - ratio), 3);
        let [first, second] = self.drives;
        if !self.error.is_finite() {
            return format!(
                "the logs do not determine which spans are looser, those at the {first} or at the {second}"
            );
        }
        match self.looser() {
            Some(1) => format!(
                "the spans at the {second} are looser than those at the {first}: {} % less stiff (95 %: {} to {} %)",
                percent(self.ratio),
                percent(high),
                percent(low)
            ),
            Some(_) => format!(
                "the spans at the {first} are looser than those at the {second}: {} % less stiff (95 %: {} to {} %)",
                percent(1.0 / self.ratio),
                percent(1.0 / low),
                percent(1.0 / high)
            ),
            None => format!(
                "the logs do not tell which spans are looser: the stiffness of those at the {second} is {} to {} times that \
                 at the {first} (95 %)",
                significant(low, 3),
                significant(high, 3)
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn belts(ratio: f64, error: f64) -> Belts {
        Belts { drives: ["left drive", "right drive"], ratio, error, slopes: vec![1.0] }
    }

    #[test]
    fn the_looser_belt_is_named_where_the_interval_says_so() {
        assert_eq!(belts(0.8, 0.01).looser(), Some(1));
        assert_eq!(belts(1.25, 0.01).looser(), Some(0));
        assert_eq!(belts(1.02, 0.02).looser(), None);
        assert_eq!(belts(0.5, f64::INFINITY).looser(), None);
        let words = belts(0.8, 0.01).words();
        assert!(words.contains("right drive are looser") && words.contains("20.0 % less stiff"), "{words}");
        // The other side.
        let words = belts(1.25, 0.01).words();
        assert!(words.contains("left drive are looser") && words.contains("20.0 % less stiff"), "{words}");
    }

    #[test]
    fn what_is_added_to_a_covariance_is_in_the_error() {
        let mut own = belts(0.8, 0.03);
        own.widen(&DMatrix::from_element(1, 1, 0.04 * 0.04));
        assert!((own.error - 0.05).abs() < 1e-12);
    }
}
