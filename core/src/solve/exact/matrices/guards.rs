//! Guards of a mode: individually as sparse rows, and side by side for vector instructions.

use super::Size;
use crate::mechanism::{BODIES, Cause, DRIVES, ROUNDING, SPRINGS, Transition};
use crate::solve::propagator::{SERIES_TERMS, Series};

/// A linear form of the vector z.
#[derive(Clone, Copy)]
pub(in crate::solve) struct Row<const N: usize> {
    /// Its terms: places in z in ascending order, and their weights. Most others are zero.
    places: [u8; N],
    weights: [f64; N],
    count: usize,
}

impl<const N: usize> Row<N> {
    pub(super) const NONE: Self = Self { places: [0; N], weights: [0.0; N], count: 0 };

    pub(super) fn new(row: &[f64; N]) -> Self {
        let (mut places, mut weights, mut count) = ([0; N], [0.0; N], 0);
        for (place, weight) in row.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
            (places[count], weights[count]) = (place as u8, *weight);
            count += 1;
        }
        Self { places, weights, count }
    }

    pub(in crate::solve::exact) fn terms(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.places.iter().zip(&self.weights).take(self.count).map(|(place, weight)| (usize::from(*place), *weight))
    }

    /// True if this is the negative of another one but for the last place, that of constants.
    pub(in crate::solve::exact) fn is_opposite(&self, other: &Self) -> bool {
        let moving =
            |row: &'_ Self| row.count - usize::from(row.count > 0 && usize::from(row.places[row.count - 1]) == N - 1);
        let count = moving(self);
        let opposite = |(a, b): (&f64, &f64)| *a == -*b;
        count == moving(other)
            && self.places[..count] == other.places[..count]
            && self.weights[..count].iter().zip(&other.weights[..count]).all(opposite)
    }

    /// Σ w_j z_j, in the order of the places.
    pub(in crate::solve::exact) fn value(&self, z: &[f64; N]) -> f64 {
        self.terms().fold(0.0, |sum, (place, weight)| sum + weight * z[place])
    }

    /// Rounding error of its value for these magnitudes of z.
    pub(in crate::solve::exact) fn noise(&self, sizes: &[f64; N]) -> f64 {
        ROUNDING * self.size(sizes)
    }

    /// Σ |w_j| |z_j|.
    fn size(&self, sizes: &[f64; N]) -> f64 {
        self.terms().fold(0.0, |sum, (place, weight)| sum + (weight * sizes[place]).abs())
    }

    /// All of its weights.
    pub(in crate::solve::exact) fn whole(&self) -> [f64; N] {
        let mut row = [0.0; N];
        self.terms().for_each(|(place, weight)| row[place] = weight);
        row
    }

    /// Its coefficients along a series, one for each term.
    pub(in crate::solve::exact) fn along<'c>(
        &self,
        series: &Series<N>,
        room: &'c mut [f64; SERIES_TERMS],
    ) -> &'c mut [f64] {
        let coefficients = &mut room[..=series.order];
        coefficients.fill(0.0);
        for (place, weight) in self.terms() {
            for (coefficient, term) in coefficients.iter_mut().zip(&series.terms) {
                *coefficient += weight * term[place];
            }
        }
        coefficients
    }
}

/// A condition of the mode on the vector z.
pub(in crate::solve) struct Watch<const N: usize> {
    pub(in crate::solve::exact) row: Row<N>,
    pub(in crate::solve::exact) transition: Transition,
    /// Index of its tolerance; the speed of a stopping body has none.
    pub(in crate::solve::exact) tolerance: usize,
}

impl<const N: usize> Watch<N> {
    pub(super) fn new(row: &[f64; N], transition: Transition) -> Self {
        let cause = transition.cause;
        let tolerance = if matches!(cause, Cause::Stop(_)) { Cause::KINDS } else { cause.kind() };
        Self { row: Row::new(row), transition, tolerance }
    }

    pub(in crate::solve::exact) fn value(&self, z: &[f64; N]) -> f64 {
        self.row.value(z)
    }

    /// True if its value is zero within rounding.
    pub(in crate::solve::exact) fn is_zero(&self, z: &[f64; N]) -> bool {
        self.value(z).abs() <= 2.0 * self.noise(z)
    }

    /// The rounding error of its value.
    pub(in crate::solve::exact) fn noise(&self, z: &[f64; N]) -> f64 {
        self.row.noise(z)
    }

    /// Magnitude of its terms for these magnitudes of z.
    pub(in crate::solve::exact) fn size(&self, sizes: &[f64; N]) -> f64 {
        self.row.size(sizes)
    }
}

/// Linear forms side by side, by the places of z.
pub(super) type Lanes<const N: usize> = [[f64; LANES]; N];

/// Forms that are computed side by side.
pub(super) const LANES: usize = 8;

/// Maximum number of guards of a mode: two for each body, five for each drive, two for each spring.
const GUARDS: usize = (2 * BODIES + 5 * DRIVES + 2 * SPRINGS).next_multiple_of(LANES);

/// One number for each guard of a mode.
pub(in crate::solve::exact) type Values = [f64; GUARDS];

/// Buffers for evaluations of the guards.
#[derive(Clone)]
pub(in crate::solve::exact) struct GuardBuffers<const N: usize> {
    /// ż and its size at the last evaluation.
    pub(in crate::solve::exact) rate: [f64; N],
    pub(in crate::solve::exact) size: Size,
    pub(in crate::solve::exact) value: Values,
    pub(in crate::solve::exact) steepness: Values,
    pub(in crate::solve::exact) slope: Values,
    pub(in crate::solve::exact) bend: Values,
    pub(in crate::solve::exact) series: Series<N>,
    pub(in crate::solve::exact) coefficients: [f64; SERIES_TERMS],
}

impl<const N: usize> GuardBuffers<N> {
    pub(in crate::solve::exact) fn new() -> Self {
        let none = [0.0; GUARDS];
        let (series, coefficients) = (Series::room(), [0.0; SERIES_TERMS]);
        let (rate, size) = ([0.0; N], Size::ZERO);
        Self { rate, size, value: none, steepness: none, slope: none, bend: none, series, coefficients }
    }
}

/// Guards side by side.
#[derive(Clone)]
pub(super) struct Beside<const N: usize> {
    pub(super) rows: Lanes<N>,
    /// Largest rates of their values: per unit of √(2V), mechanical and magnetic, and of the inputs' rates.
    pub(super) mechanical: [f64; LANES],
    pub(super) magnetic: [f64; LANES],
    pub(super) at_once: [[f64; LANES]; DRIVES],
}

impl<const N: usize> Beside<N> {
    pub(super) const NONE: Self = {
        let none = [0.0; LANES];
        Self { rows: [none; N], mechanical: none, magnetic: none, at_once: [none; DRIVES] }
    };
}

/// The values of forms side by side.
#[inline(always)]
pub(super) fn side_by_side<const N: usize>(lanes: &Lanes<N>, z: &[f64; N]) -> [f64; LANES] {
    let mut sum = [0.0; LANES];
    for (weights, factor) in lanes.iter().zip(z) {
        for (sum, weight) in sum.iter_mut().zip(weights) {
            *sum += weight * factor;
        }
    }
    sum
}
