//! The readings of an observer in a mode, and how far they can be off straight lines.

use super::{ModeMatrices, Space};
use crate::friction::Motion;
use crate::mechanism::{BODIES, DRIVES, Mechanism};
use crate::solve::observe::{QUANTITIES, Reading, Readout};
use crate::solve::propagator::Matrix;
use crate::solve::widest::widest;

/// The least size of a rate: nothing next to any other.
const STILL: f64 = 1e-250;

/// Readings of one mode, and the norms of their forms.
pub(in crate::solve) struct Shown<const N: usize> {
    pub(in crate::solve) readout: Readout,
    /// The weight of each place of z in each reading.
    matrix: Matrix<QUANTITIES, N>,
    /// The norm dual to the energy, of what springs hold and speeds, and of currents.
    mechanical: Reading,
    magnetic: Reading,
    /// Dual norms of elongations that no spring holds, per unit of √(2V) of ż: these move as the masses do.
    unsprung: Reading,
    /// Magnitudes of the coefficients of the inputs.
    input: [Reading; DRIVES],
}

impl<const N: usize> Shown<N> {
    fn new(law: &ModeMatrices<N>, mechanism: &Mechanism, space: &Space) -> Self {
        let readout = Readout::new(mechanism, &law.mode);
        let mut matrix = Matrix::zero();
        for (q, form) in readout.forms.iter().enumerate() {
            for (place, weight) in space.row::<N>(form).into_iter().enumerate() {
                matrix.set(q, place, weight);
            }
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
        let input = std::array::from_fn(|drive| readout.forms.map(|form| form.input[drive].abs()));
        Self { readout, matrix, mechanical, magnetic, unsprung, input }
    }

    /// The readings in z, ways being counted from `origin`.
    #[inline]
    pub(in crate::solve) fn read(&self, z: &[f64; N], origin: &[f64; BODIES]) -> Reading {
        self.readout.placed(self.matrix.rate(z), origin)
    }

    widest! {
        /// Adds the reading of each of `rows` to `readings`.
        pub(in crate::solve) fn read_rows(&self, rows: &[[f64; N]], origin: &[f64; BODIES], readings: &mut Vec<Reading>)
            = read_rows_by_any, read_rows_by_avx2;
    }

    #[inline(always)]
    fn read_rows_by_any(&self, rows: &[[f64; N]], origin: &[f64; BODIES], readings: &mut Vec<Reading>) {
        // Not by an iterator's closure, which would not be compiled for the wider vectors.
        for z in rows {
            readings.push(self.readout.placed(self.matrix.times(z), origin));
        }
    }

    /// Reading of a change of z.
    #[inline]
    pub(in crate::solve) fn change(&self, change: &[f64; N]) -> Reading {
        self.matrix.rate(change)
    }
}

impl<const N: usize> ModeMatrices<N> {
    /// The readings of an observer, made ready when they are first wanted.
    pub(in crate::solve) fn shown(&self, mechanism: &Mechanism, space: &Space) -> &Shown<N> {
        self.shown.get_or_init(|| Box::new(Shown::new(self, mechanism, space)))
    }

    /// By how much readings can be off a straight line over any `interval` within the next `length`, `y` being ż now:
    /// with bounds of |u̇| and |ü| of each input, |q̈| interval²/8.
    pub(in crate::solve) fn bow(
        &self,
        shown: &Shown<N>,
        y: &[f64; N],
        rates: (&[f64; DRIVES], &[f64; DRIVES]),
        (interval, length): (f64, f64),
    ) -> Reading {
        self.change_of(shown, y, rates, length).map(|second| 0.125 * interval * interval * second)
    }

    /// Bounds of |q⁽ᵏ⁾| within the next `length`, `y` being z⁽ᵏ⁻¹⁾ now: with bounds of |u⁽ᵏ⁻¹⁾| and |u⁽ᵏ⁾| of each input
    /// on the way.
    pub(in crate::solve) fn change_of(
        &self,
        shown: &Shown<N>,
        y: &[f64; N],
        (rate, curvature): (&[f64; DRIVES], &[f64; DRIVES]),
        length: f64,
    ) -> Reading {
        let grow = self.growth_over(length);
        let (first, second) = (self.size(y), self.size(&self.rate(y)));
        let (first, push) = (first.whole() + self.push(rate) * length, self.push(curvature) * length);
        let (mechanical, magnetic) = self.parted(second, push);
        // What can change is never told to stand still, though rounding may have stopped it.
        let [mechanical, magnetic, first] = [mechanical, magnetic, first].map(|size| (grow * size).max(STILL));
        let mut change: Reading = std::array::from_fn(|q| {
            shown.mechanical[q] * mechanical + shown.magnetic[q] * magnetic + shown.unsprung[q] * first
        });
        for (input, curvature) in shown.input.iter().zip(curvature).filter(|(_, curvature)| **curvature > 0.0) {
            change.iter_mut().zip(input).for_each(|(change, input)| *change += input * curvature);
        }
        change
    }
}
