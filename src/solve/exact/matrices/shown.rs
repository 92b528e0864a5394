//! The readings of an observer in a mode, and how far they can be off straight lines.

use super::{ModeMatrices, Size, Space};
use crate::friction::Motion;
use crate::mechanism::{BODIES, DRIVES, Mechanism};
use crate::solve::observe::{QUANTITIES, Reading, Readout};
use crate::solve::propagator::Matrix;

/// Readings of one mode, and the norms of their forms.
pub(in crate::solve) struct Shown<const N: usize> {
    pub(in crate::solve) readout: Readout,
    /// The weight of each place of z in each reading.
    matrix: Matrix<QUANTITIES, N>,
    /// The norm dual to the energy, of what springs hold, speeds and current.
    dual: [Size; QUANTITIES],
    /// √(mechanical² + magnetic²) of those.
    whole: Reading,
    /// The same for the stretches that no spring holds, per unit of √(2V) of ż: these move as the masses do.
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
        let (mut dual, mut unsprung) = ([Size::ZERO; QUANTITIES], [0.0; QUANTITIES]);
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
                    let light: f64 = free.map(|b| arms[b].powi(2) / mechanism.mass(b, &law.inertia)).sum();
                    unsprung[q] += factor.abs() * light.sqrt();
                }
            }
            for i in (0..BODIES).filter(|&i| form.speed[i] != 0.0 && !stuck[i]) {
                held += form.speed[i] * form.speed[i] / law.inertia[i];
            }
            let weight = |drive: usize| law.weight_of_current[drive];
            let currents = (0..DRIVES).filter(|&drive| form.current[drive] != 0.0);
            let magnetic = currents.fold(0.0, |sum: f64, drive| sum.hypot(form.current[drive] / weight(drive).sqrt()));
            dual[q] = Size { mechanical: held.sqrt(), magnetic };
        }
        let input = std::array::from_fn(|drive| readout.forms.map(|form| form.input[drive].abs()));
        let whole = dual.map(|dual| dual.mechanical.hypot(dual.magnetic));
        Self { readout, matrix, dual, whole, unsprung, input }
    }

    /// The readings in z, ways being counted from `origin`.
    #[inline]
    pub(in crate::solve) fn read(&self, z: &[f64; N], origin: &[f64; BODIES]) -> Reading {
        self.readout.placed(self.matrix.rate(z), origin)
    }

    /// The same of a change of z.
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
    /// with bounds of |u̇| and
    /// |ü| of each input, |q̈| interval²/8.
    pub(in crate::solve) fn bow(
        &self,
        shown: &Shown<N>,
        y: &[f64; N],
        (rate, curvature): (&[f64; DRIVES], &[f64; DRIVES]),
        (interval, length): (f64, f64),
    ) -> Reading {
        let grow = self.growth_over(length);
        let (first, second) = (self.size(y), self.size(&self.rate(y)));
        let (first, push) = (first.whole() + self.push(rate) * length, self.push(curvature) * length);
        // As `steepness` has it.
        let (mechanical, magnetic) = match (self.coupled, self.is_magnetic) {
            (true, _) => (second.whole() + push, 0.0),
            (false, true) => (second.mechanical, second.magnetic + push),
            (false, false) => (second.mechanical + push, 0.0),
        };
        let eighth = 0.125 * interval * interval;
        std::array::from_fn(|q| {
            let springs = match self.coupled {
                true => shown.whole[q] * mechanical,
                false => shown.dual[q].mechanical * mechanical + shown.dual[q].magnetic * magnetic,
            };
            let at_once: f64 = shown.input.iter().zip(curvature).map(|(input, curvature)| input[q] * curvature).sum();
            eighth * (grow * (springs + shown.unsprung[q] * first) + at_once)
        })
    }
}
