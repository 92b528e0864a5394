//! What an observer is shown of a mode: readings, and how far they can be off straight lines.

use super::{Law, Size};
use crate::friction::Motion;
use crate::plant::{Body, Plant, SPEEDS};
use crate::solve::observe::{QUANTITIES, Reading, Readout, leading_arms};

/// Readings of one mode, and the norms of their forms.
pub(in crate::solve) struct Shown {
    pub(in crate::solve) readout: Readout,
    /// The norm dual to the energy, of what springs hold, speeds and current.
    dual: [Size; QUANTITIES],
    /// √(mechanical² + magnetic²) of those.
    whole: Reading,
    /// The same for the stretches that no spring holds, per unit of √(2V) of ż: these move as the masses do.
    unsprung: Reading,
    /// Coefficients of the input.
    input: Reading,
}

impl Shown {
    fn new<const R: usize, const C: usize>(law: &Law<R, C>, plant: &Plant) -> Self {
        let readout = Readout::new(plant, &law.mode);
        let stuck = law.mode.motion.map(|motion| motion == Motion::Stuck);
        let at_rest = [stuck[0] && stuck[1], stuck[1] && stuck[2], stuck[2] && stuck[0]];
        let mass = |leader: Body| -> f64 {
            plant.followers(leader).map(|b| plant.ratio(b).powi(2) * law.inertia[b.index()]).sum()
        };
        let (mut dual, mut unsprung) = ([Size::ZERO; QUANTITIES], [0.0; QUANTITIES]);
        for (q, form) in readout.forms.iter().enumerate() {
            let mut held = 0.0;
            for (span, at_rest) in at_rest.into_iter().enumerate() {
                let factor = form.stretch[span];
                if factor == 0.0 || at_rest {
                    continue;
                }
                if law.stiffness[span] > 0.0 {
                    held += factor * factor / law.stiffness[span];
                } else {
                    let arms = leading_arms(plant, span);
                    let free = |body: &Body| arms[body.index()] != 0.0 && !stuck[body.index()];
                    let light: f64 =
                        Body::ALL.iter().filter(|b| free(b)).map(|b| arms[b.index()].powi(2) / mass(*b)).sum();
                    unsprung[q] += factor.abs() * light.sqrt();
                }
            }
            if form.stretch[crate::plant::POSITION] != 0.0 && !stuck[1] {
                unsprung[q] += form.stretch[crate::plant::POSITION].abs() / law.inertia[1].sqrt();
            }
            for i in (0..SPEEDS).filter(|&i| form.speed[i] != 0.0 && !(i < 3 && stuck[i])) {
                held += form.speed[i] * form.speed[i] / law.inertia[i];
            }
            let magnetic = if form.current == 0.0 { 0.0 } else { form.current.abs() / law.magnetic.sqrt() };
            dual[q] = Size { mechanical: held.sqrt(), magnetic };
        }
        let input = readout.forms.map(|form| form.input.abs());
        let whole = dual.map(|dual| dual.mechanical.hypot(dual.magnetic));
        Self { readout, dual, whole, unsprung, input }
    }
}

impl<const R: usize, const C: usize> Law<R, C> {
    /// What an observer is shown, made ready when it is first wanted.
    pub(in crate::solve) fn shown(&self, plant: &Plant) -> &Shown {
        self.shown.get_or_init(|| Box::new(Shown::new(self, plant)))
    }

    /// By how much readings can be off a straight line over any `interval` within the next `length`, `y` being ż now: with bounds of |u̇| and
    /// |ü|, |q̈| interval²/8.
    pub(in crate::solve) fn bow(
        &self,
        shown: &Shown,
        y: &[f64; R],
        (rate, curvature): (f64, f64),
        (interval, length): (f64, f64),
    ) -> Reading {
        let grow = self.growth_over(length);
        let (first, second) = (self.size(y), self.size(&self.rate_of_rate(y)));
        let whole = |size: Size| (size.mechanical * size.mechanical + size.magnetic * size.magnetic).sqrt();
        let (first, push) = (whole(first) + self.forcing * rate * length, self.forcing * curvature * length);
        // As `steepness` has it.
        let (mechanical, magnetic) = match (self.coupled, self.magnetic > 0.0) {
            (true, _) => (whole(second) + push, 0.0),
            (false, true) => (second.mechanical, second.magnetic + push),
            (false, false) => (second.mechanical + push, 0.0),
        };
        let eighth = 0.125 * interval * interval;
        std::array::from_fn(|q| {
            let springs = match self.coupled {
                true => shown.whole[q] * mechanical,
                false => shown.dual[q].mechanical * mechanical + shown.dual[q].magnetic * magnetic,
            };
            eighth * (grow * (springs + shown.unsprung[q] * first) + shown.input[q] * curvature)
        })
    }
}
