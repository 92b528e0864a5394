//! The readings of an observer in a mode, and bounds of their deviation from straight lines.

use super::{ModeMatrices, Space};
use crate::friction::Motion;
use crate::mechanism::{BODIES, DRIVES, Mechanism};
use crate::solve::observe::{Curve, FEW, QUANTITIES, Reading, Readout, reading_of};
use crate::solve::polynomial::{TERMS, hermite};
use crate::solve::propagator::Matrix;
use crate::solve::widest::widest;
use std::sync::OnceLock;

/// Readings behind the first ones.
const MORE: usize = QUANTITIES - FEW;

/// Smallest norm of a rate, negligible beside any other.
const STILL: f64 = 1e-250;

/// Weight of each element of z in each of the first readings, and in further ones if there are any.
struct Weights<const N: usize> {
    first: Matrix<FEW, N>,
    more: Option<Box<Matrix<MORE, N>>>,
}

impl<const N: usize> Weights<N> {
    fn zero(few: bool) -> Self {
        Self { first: Matrix::zero(), more: (!few).then(|| Box::new(Matrix::zero())) }
    }

    fn set_row(&mut self, q: usize, weights: &[f64; N]) {
        for (place, weight) in weights.iter().enumerate() {
            match (q.checked_sub(FEW), &mut self.more) {
                (None, _) => self.first.set(q, place, *weight),
                (Some(q), Some(more)) => more.set(q, place, *weight),
                (Some(_), None) => {}
            }
        }
    }

    /// The readings of a vector.
    #[inline(always)]
    fn times(&self, z: &[f64; N]) -> Reading {
        joined(&self.first.times(z), self.more.as_ref().map(|more| more.times(z)))
    }
}

/// The curve of the readings over an interval as a linear function of z at its beginning: the coefficients of all
/// powers but that of order zero, which is the reading itself.
struct CurveWeights<const N: usize>([Weights<N>; TERMS - 1]);

impl<const N: usize> CurveWeights<N> {
    /// Over h, where z becomes z + P z.
    fn new(shown: &Shown<N>, rate: &Matrix<N, N>, step: &Matrix<N, N>, h: f64) -> Self {
        let mut weights = CurveWeights(std::array::from_fn(|_| Weights::zero(shown.readout.few)));
        let count = if shown.readout.few { FEW } else { QUANTITIES };
        for q in 0..count {
            // q⁽ᵏ⁾ hᵏ/k! = c (A h)ᵏ/k! z for the reading c z, and its change over h, c (A h)ᵏ/k! P z
            let mut orders = [shown.row(q); 4];
            for k in 1..4 {
                orders[k] = rate.times_from_left(&orders[k - 1]).map(|weight| weight * (h / k as f64));
            }
            let changes = orders.each_ref().map(|order| step.times_from_left(order));
            let at = |rows: &[[f64; N]; 4], place: usize| rows.map(|row| row[place]);
            let curves: [_; N] = std::array::from_fn(|place| hermite(at(&orders, place), at(&changes, place)));
            for (k, weights) in weights.0.iter_mut().enumerate() {
                weights.set_row(q, &curves.map(|curve| curve[k + 1]));
            }
        }
        weights
    }

    widest! {
        /// Writes the coefficients of the curve that begins in `z`, but for that of order zero.
        fn write(&self, z: &[f64; N], terms: &mut [Reading; TERMS]) = write_by_any, write_by_avx2;
    }

    #[inline(always)]
    fn write_by_any(&self, z: &[f64; N], terms: &mut [Reading; TERMS]) {
        for (term, weights) in terms[1..].iter_mut().zip(&self.0) {
            *term = weights.times(z);
        }
    }
}

/// Readings of one mode, and the norms of their forms.
pub(in crate::solve) struct Shown<const N: usize> {
    pub(in crate::solve) readout: Readout,
    weights: Weights<N>,
    /// The curves over the intervals of each level.
    curves: Box<[OnceLock<Box<CurveWeights<N>>>]>,
    /// Norm dual to the energy, of elongations held by springs and speeds, and of currents.
    mechanical: Reading,
    magnetic: Reading,
    /// Dual norms of elongations without a spring, per unit of √(2V) of ż, which follow from the masses.
    unsprung: Reading,
    /// Magnitudes of the coefficients of the inputs.
    input: [Reading; DRIVES],
}

impl<const N: usize> Shown<N> {
    fn new(law: &ModeMatrices<N>, mechanism: &Mechanism, space: &Space) -> Self {
        let readout = Readout::new(mechanism, &law.mode);
        let mut weights = Weights::zero(readout.few);
        for (q, form) in readout.forms.iter().enumerate() {
            weights.set_row(q, &space.row(form));
        }
        let stuck = law.mode.motion.map(|motion| motion == Motion::Stuck);
        let (mut mechanical, mut magnetic) = ([0.0; QUANTITIES], [0.0; QUANTITIES]);
        let mut unsprung = [0.0; QUANTITIES];
        for (q, form) in readout.forms.iter().enumerate() {
            let mut held = 0.0;
            for (index, spring) in mechanism.springs.iter().enumerate() {
                let factor = form.stretch[index];
                if factor == 0.0 || spring.arms.iter().all(|&(body, _)| stuck[body]) {
                    continue;
                }
                if law.stiffness[index] > 0.0 {
                    held += factor * factor / law.stiffness[index];
                } else {
                    let arms = mechanism.leading_arms(index);
                    let free = (0..BODIES).filter(|&body| arms[body] != 0.0 && !stuck[body]);
                    let light: f64 = free.map(|b| arms[b] * arms[b] / mechanism.mass(b, &law.inertia)).sum();
                    unsprung[q] += factor.abs() * light.sqrt();
                }
            }
            for i in (0..BODIES).filter(|&i| form.speed[i] != 0.0 && !stuck[i]) {
                held += form.speed[i] * form.speed[i] / law.inertia[i];
            }
            let weight = |drive: usize| law.weight_of_current[drive];
            let currents = (0..DRIVES).filter(|&drive| form.current[drive] != 0.0);
            magnetic[q] = currents.fold(0.0, |sum: f64, drive| sum.hypot(form.current[drive] / weight(drive).sqrt()));
            mechanical[q] = held.sqrt();
            if law.coupled {
                // Motion and current pass energy to each other: only their sum is bounded.
                (mechanical[q], magnetic[q]) = (mechanical[q].hypot(magnetic[q]), 0.0);
            }
        }
        let input = std::array::from_fn(|drive| std::array::from_fn(|q: usize| readout.forms[q].input[drive].abs()));
        let curves = law.steps.iter().map(|_| OnceLock::new()).collect();
        Self { readout, weights, curves, mechanical, magnetic, unsprung, input }
    }

    /// The readings at z, with positions relative to `origin`.
    #[inline]
    pub(in crate::solve) fn read(&self, z: &[f64; N], origin: &[f64; BODIES]) -> Reading {
        self.readout.placed(self.change(z), origin)
    }

    widest! {
        /// Adds the reading of each of `rows` to `readings`.
        pub(in crate::solve) fn read_rows(&self, rows: &[[f64; N]], origin: &[f64; BODIES], readings: &mut Vec<Reading>)
            = read_rows_by_any, read_rows_by_avx2;
    }

    #[inline(always)]
    fn read_rows_by_any(&self, rows: &[[f64; N]], origin: &[f64; BODIES], readings: &mut Vec<Reading>) {
        // Not with an iterator's closure, which would not be compiled for the wider vectors.
        for z in rows {
            readings.push(self.readout.placed(self.weights.times(z), origin));
        }
    }

    /// A quantity as weights of the places of z.
    pub(in crate::solve::exact) fn row(&self, q: usize) -> [f64; N] {
        std::array::from_fn(|place| match (q.checked_sub(FEW), &self.weights.more) {
            (None, _) => self.weights.first.at(q, place),
            (Some(q), Some(more)) => more.at(q, place),
            (Some(_), None) => 0.0,
        })
    }

    /// Largest rate of a quantity per unit of √(2V) of ż with constant inputs; infinite if no spring holds it.
    pub(in crate::solve::exact) fn dual(&self, q: usize) -> f64 {
        if self.unsprung[q] > 0.0 { f64::INFINITY } else { self.mechanical[q].hypot(self.magnetic[q]) }
    }

    /// Reading of a change of z.
    #[inline]
    pub(in crate::solve) fn change(&self, change: &[f64; N]) -> Reading {
        let Weights { first, more } = &self.weights;
        joined(&first.rate(change), more.as_ref().map(|more| more.rate(change)))
    }
}

/// The first readings, and further ones.
#[inline(always)]
fn joined(first: &[f64; FEW], more: Option<[f64; MORE]>) -> Reading {
    let mut all = [0.0; QUANTITIES];
    all[..FEW].copy_from_slice(first);
    if let Some(more) = more {
        all[FEW..].copy_from_slice(&more);
    }
    all
}

impl<const N: usize> ModeMatrices<N> {
    /// Readings of an observer, prepared at their first use.
    pub(in crate::solve) fn shown(&self, mechanism: &Mechanism, space: &Space) -> &Shown<N> {
        self.shown.get_or_init(|| Box::new(Shown::new(self, mechanism, space)))
    }

    /// The curve of the readings over an interval of a level, from `z` and the reading there; its matrices are computed
    /// at their first use.
    pub(in crate::solve) fn curve(
        &self,
        shown: &Shown<N>,
        z: &[f64; N],
        reading: &Reading,
        begin: f64,
        level: usize,
    ) -> Curve {
        let length = self.length(level);
        let weights = shown.curves[level]
            .get_or_init(|| Box::new(CurveWeights::new(shown, &self.rate, self.step(level), length)));
        let mut curve = Curve { begin, length, terms: [[0.0; QUANTITIES]; TERMS], few: shown.readout.few };
        curve.terms[0] = *reading;
        weights.write(z, &mut curve.terms);
        curve
    }

    /// Largest deviation of readings from a straight line over any `interval` within the next `length`, with `y` = ż
    /// now and bounds of |u̇| and |ü| of each input: |q̈| interval²/8.
    pub(in crate::solve) fn bow(
        &self,
        shown: &Shown<N>,
        y: &[f64; N],
        rates: (&[f64; DRIVES], &[f64; DRIVES]),
        (interval, length): (f64, f64),
    ) -> Reading {
        self.change_by(shown, y, rates, length, |second| 0.125 * interval * interval * second)
    }

    /// Bounds of |q⁽ᵏ⁾| within the next `length`, with `y` = z⁽ᵏ⁻¹⁾ now and bounds of |u⁽ᵏ⁻¹⁾| and |u⁽ᵏ⁾| of each
    /// input.
    pub(in crate::solve) fn change_of(
        &self,
        shown: &Shown<N>,
        y: &[f64; N],
        (rate, curvature): (&[f64; DRIVES], &[f64; DRIVES]),
        length: f64,
    ) -> Reading {
        self.change_by(shown, y, (rate, curvature), length, |change| change)
    }

    /// These bounds, each multiplied by `factor`.
    #[inline(always)]
    fn change_by(
        &self,
        shown: &Shown<N>,
        y: &[f64; N],
        (rate, curvature): (&[f64; DRIVES], &[f64; DRIVES]),
        length: f64,
        factor: impl Fn(f64) -> f64,
    ) -> Reading {
        let grow = self.growth_over(length);
        let (first, second) = (self.size(y), self.size(&self.rate(y)));
        let (first, push) = (first.whole() + self.push(rate) * length, self.push(curvature) * length);
        let (mechanical, magnetic) = self.parted(second, push);
        // A quantity that can change is never taken to be constant, although rounding may have stopped it.
        let [mechanical, magnetic, first] = [mechanical, magnetic, first].map(|size| (grow * size).max(STILL));
        let few = shown.readout.few;
        let mut change = reading_of(few, |q| {
            shown.mechanical[q] * mechanical + shown.magnetic[q] * magnetic + shown.unsprung[q] * first
        });
        for (input, curvature) in shown.input.iter().zip(curvature).filter(|(_, curvature)| **curvature > 0.0) {
            change.iter_mut().zip(input).for_each(|(change, input)| *change += input * curvature);
        }
        reading_of(few, |q| factor(change[q]))
    }
}
