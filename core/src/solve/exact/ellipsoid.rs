//! A bound of rounding errors for a run whose errors can grow.
//!
//! With linear springs alone errors do not grow ([`crate::solve::rounding`]). A force line can feed the motion, and a
//! flank, a stop or a slack span turns a small error of its contact time into a larger one of the motion. For such
//! machines the errors of the state are bounded by an ellipsoid {C^½ u, |u| ≤ 1}:
//!
//! ```text
//! within a mode        C ← F C Fᵀ ⊕ Q,   F = e^{A τ}
//! where a guard falls  C ← S C Sᵀ ⊕ q,   S = I + (f⁺ − f⁻) wᵀ/(w·f⁻)      f = ż before and after, w the guard
//! what is added        Q = diag(d²),     d = c ε ((N + Φ) |z|_max + τ (|A| |z|_max + K))
//!                      q = (f⁺ − f⁻)(f⁺ − f⁻)ᵀ δt²,   δt = δg/|w·f⁻|, δg the rounding of the guard
//! the sum ⊕            C₁ ⊕ C₂ = (1 + 1/p) C₁ + (1 + p) C₂,   p = √(tr C₁/tr C₂): the ellipsoid of least trace around
//!                      all sums of two errors
//! ```
//!
//! N is the number of steps, Φ the phase of the fastest vibration in radians, K the constant forces of a mode before
//! summation: near an unstable equilibrium they cancel, and their rounding is the error from which all others grow. A
//! guard that only grazes falls by its curvature: |w·f⁻| is taken as at least √(½ |w·f̈| δg), the slope at which it
//! leaves its rounding. The error of a belt position w·z is at most √(wᵀ C w).

use super::Core;
use super::matrices::Watch;
use crate::friction::Motion;
use crate::mechanism::Transition;
use crate::solve::propagator::{EXPONENTIAL_REACH, Matrix};
use crate::solve::saved::{Pass, Passed};

/// c: roundings of a step or of a radian.
const UNITS: f64 = 2.0;

/// The error of a sine's polynomials over ε, both relative to the peak.
const OF_SINES: f64 = 45.0;

/// The error is evaluated this often within a mode.
const PARTS: u32 = 4;

/// Halvings of the time in a mode, at most.
const HALVINGS: i32 = 60;

/// Change of a rate, in roundings, that does not count as a jump.
const NO_JUMP: f64 = 40.0;

/// Entries beyond this are not squared any more.
const BEYOND: f64 = 1e280;

/// The errors of a state.
#[derive(Clone)]
pub(super) struct Ellipsoid<const N: usize> {
    /// C, of the states alone.
    c: [[f64; N]; N],
    states: usize,
    /// The largest magnitudes of the state so far.
    size: [f64; N],
    /// Time up to which errors are accounted for, s, and the number of steps until then.
    since: f64,
    steps: u64,
    /// The largest error of a position at the belt so far, m.
    largest: f64,
}

/// A guard that falls, before the change of mode.
pub(super) struct Crossing<const N: usize> {
    /// w.
    guard: [f64; N],
    /// f⁻, and its rounding.
    before: [f64; N],
    noise: [f64; N],
    /// w·f⁻ and w·f̈.
    fall: f64,
    bend: f64,
    /// δg by the rounding of the state alone.
    rounding: f64,
}

impl<const N: usize> Ellipsoid<N> {
    pub(super) fn new(states: usize) -> Self {
        Self { c: [[0.0; N]; N], states, size: [0.0; N], since: 0.0, steps: 0, largest: 0.0 }
    }

    /// This ellipsoid for a kernel of another size.
    pub(super) fn resized<const M: usize>(&self) -> Ellipsoid<M> {
        let mut new = Ellipsoid::<M>::new(self.states);
        for (new, own) in new.c.iter_mut().zip(&self.c).take(self.states) {
            new[..self.states].copy_from_slice(&own[..self.states]);
        }
        new.size[..self.states].copy_from_slice(&self.size[..self.states]);
        (new.since, new.steps, new.largest) = (self.since, self.steps, self.largest);
        new
    }

    /// As plain numbers.
    pub(super) fn pass(&mut self, pass: &mut Pass) -> Passed {
        let states = self.states;
        self.c.iter_mut().take(states).try_for_each(|row| pass.numbers(&mut row[..states]))?;
        pass.numbers(&mut self.size[..states])?;
        pass.number(&mut self.since)?;
        pass.bits(&mut self.steps)?;
        pass.number(&mut self.largest)
    }

    /// The largest error of a position at the belt so far, m.
    pub(super) fn largest(&self) -> f64 {
        self.largest
    }

    /// Adds errors, another ellipsoid.
    fn add(&mut self, other: &[[f64; N]; N]) {
        let weights = self.weights();
        add(&mut self.c, other, &weights, self.states);
    }

    /// Weights that make errors of all states comparable: one over the squares of their sizes.
    fn weights(&self) -> [f64; N] {
        self.size.map(|size| if size > 0.0 { 1.0 / (size * size) } else { 0.0 })
    }

    /// Updates the largest error of positions.
    fn evaluate(&mut self, positions: &[[f64; N]]) {
        for row in positions {
            let square = self.variance(row);
            // NaN means that it has overflowed.
            self.largest = self.largest.max(if square.is_nan() { f64::INFINITY } else { square.sqrt() });
        }
    }

    /// wᵀ C w.
    fn variance(&self, row: &[f64; N]) -> f64 {
        let n = self.states;
        let mut sum = 0.0;
        for (i, own) in row.iter().enumerate().take(n).filter(|(_, own)| **own != 0.0) {
            sum += own * self.c[i][..n].iter().zip(row).map(|(c, other)| c * other).sum::<f64>();
        }
        sum.max(0.0)
    }

    /// Parts at rest, or held, have no error.
    fn settle(&mut self, place: usize) {
        self.c[place] = [0.0; N];
        self.c.iter_mut().for_each(|row| row[place] = 0.0);
    }
}

/// C₁ ← C₁ ⊕ C₂.
fn add<const N: usize>(c: &mut [[f64; N]; N], other: &[[f64; N]; N], weights: &[f64; N], states: usize) {
    let trace = |c: &[[f64; N]; N]| (0..states).map(|i| c[i][i] * weights[i]).sum::<f64>();
    let (own, added) = (trace(c), trace(other));
    let (first, second) = match own > 0.0 && added > 0.0 {
        true => (1.0 + (added / own).sqrt(), 1.0 + (own / added).sqrt()),
        // The ratio is unknown for sizes of zero, and not needed.
        false if own == 0.0 && added == 0.0 => (2.0, 2.0),
        false => (1.0, 1.0),
    };
    for (own, other) in c.iter_mut().zip(other).take(states) {
        own[..states].iter_mut().zip(other).for_each(|(own, other)| *own = first * *own + second * other);
    }
}

/// (I + P) C (I + P)ᵀ.
fn carried<const N: usize>(step: &Matrix<N, N>, c: &[[f64; N]; N], states: usize) -> [[f64; N]; N] {
    // T = C + P C; C is symmetric, so that its rows are its columns.
    let mut moved = *c;
    for row in moved.iter_mut().take(states) {
        step.advance(row);
    }
    // The rows of `moved` are the columns of T; those of its transpose are moved likewise.
    let mut out = transposed(&moved, states);
    for row in out.iter_mut().take(states) {
        step.advance(row);
    }
    // Averaged with its transpose, so that rounding does not make it asymmetric.
    let other = transposed(&out, states);
    for (row, column) in out.iter_mut().zip(&other).take(states) {
        row.iter_mut().zip(column).for_each(|(a, b)| *a = 0.5 * (*a + b));
        row[states..].fill(0.0);
    }
    out
}

fn transposed<const N: usize>(c: &[[f64; N]; N], states: usize) -> [[f64; N]; N] {
    let mut out = [[0.0; N]; N];
    for (i, row) in c.iter().enumerate().take(states) {
        row.iter().enumerate().take(states).for_each(|(j, value)| out[j][i] = *value);
    }
    out
}

impl<const N: usize> Core<N> {
    /// Carries the errors to the present time, in the present mode.
    pub(super) fn carry_errors(&mut self) {
        let Some(mut errors) = self.errors.take() else { return };
        self.see();
        let (time, steps) = (self.time(), self.common.cost.steps + self.common.cost.series);
        let (length, taken) = (time - errors.since, (steps - errors.steps) as f64);
        (errors.since, errors.steps) = (time, steps);
        let states = errors.states;
        errors.size[..states].iter_mut().zip(&self.largest).for_each(|(size, z)| *size = size.max(*z));
        if length > 0.0 && errors.largest < BEYOND {
            self.carry_errors_by(&mut errors, length, taken);
        }
        self.errors = Some(errors);
    }

    /// C ← F C Fᵀ ⊕ Q over a time of `taken` steps.
    fn carry_errors_by(&self, errors: &mut Ellipsoid<N>, length: f64, taken: f64) {
        let (law, states) = (&self.matrices, errors.states);
        let part = length / f64::from(PARTS);
        let halvings = ((law.speed() * part / EXPONENTIAL_REACH).log2().ceil() as i32).clamp(0, HALVINGS);
        let first = part * 0.5_f64.powi(halvings);
        // d = c ε ((N + Φ) |z|_max + τ (|A| |z|_max + K))
        let mut sizes = self.largest;
        let space = &self.common.space;
        if space.highest > 1 {
            (0..space.layout.inputs).for_each(|drive| sizes[space.chain(drive, 0)] *= OF_SINES);
        }
        let rates = law.rates().absolute().rate(&sizes);
        let shares = (taken / length + law.swing) * first;
        let mut added = [[0.0; N]; N];
        for i in 0..states {
            let error = UNITS * f64::EPSILON * (shares * errors.size[i] + first * (rates[i] + law.crude[i]));
            added[i][i] = error * error;
        }
        let weights = errors.weights();
        let mut step = law.rates().exponential(first);
        for _ in 0..halvings {
            let earlier = carried(&step, &added, states);
            add(&mut added, &earlier, &weights, states);
            step = step.doubled();
        }
        let positions = self.positions();
        for _ in 0..PARTS {
            errors.c = carried(&step, &errors.c, states);
            errors.add(&added);
            errors.evaluate(&positions);
        }
    }

    /// The positions at the belt as weights of the state.
    fn positions(&self) -> Vec<[f64; N]> {
        let (layout, mechanism) = (&self.common.space.layout, &self.common.mechanism);
        let row = |body: usize| {
            let (weights, _) = self.common.coordinates.way(layout, body);
            let lever = mechanism.bodies[body].kind.lever();
            let mut row = [0.0; N];
            (0..layout.bodies()).for_each(|other| row[layout.coordinate[other]] = lever * weights[other]);
            row
        };
        mechanism.held_bodies().map(row).collect()
    }

    /// The effect of an event on the errors depends on the state before it.
    pub(super) fn crossing(&self, fallen: Transition) -> Option<Crossing<N>> {
        let errors = self.errors.as_ref()?;
        let law = &self.matrices;
        let watch: &Watch<N> = law.guards.iter().find(|guard| guard.transition.cause == fallen.cause)?;
        let before = law.rate(&self.z);
        let guard = watch.row.whole();
        let mut sizes = self.z;
        // A speed that falls to zero is as uncertain as those that it had.
        sizes[..errors.states].copy_from_slice(&errors.size[..errors.states]);
        Some(Crossing {
            guard,
            before,
            noise: law.noise_of_rate(&self.z),
            fall: watch.value(&before),
            bend: watch.value(&law.rate(&before)),
            rounding: f64::EPSILON * watch.size(&sizes),
        })
    }

    /// Carries the errors through an event: C ← S C Sᵀ ⊕ q. The state is already in the next mode.
    pub(super) fn cross(&mut self, crossing: Option<Crossing<N>>) {
        let (Some(crossing), Some(mut errors)) = (crossing, self.errors.take()) else { return };
        let states = errors.states;
        let Crossing { guard, before, noise, fall, bend, rounding } = crossing;
        let (after, law) = (self.matrices.rate(&self.z), &self.matrices);
        let noise_after = law.noise_of_rate(&self.z);
        let mut jump = [0.0; N];
        for k in 0..states {
            let change = before[k] - after[k];
            jump[k] = if change.abs() <= NO_JUMP * (noise[k] + noise_after[k]) { 0.0 } else { change };
        }
        if jump != [0.0; N] {
            let error = errors.variance(&guard).sqrt() + rounding;
            // The guard leaves its rounding by its slope or its curvature.
            let slope = fall.abs().max((0.5 * bend.abs() * error).sqrt());
            if slope > 0.0 {
                // δz⁺ = δz⁻ + (f⁻ − f⁺) δt,   δt = w·δz/|w·f⁻|
                let mut matrix = Matrix::zero();
                for (row, own) in jump.iter().enumerate().take(states) {
                    (0..states).for_each(|column| matrix.set(row, column, own * guard[column] / slope));
                }
                errors.c = carried(&matrix, &errors.c, states);
                let time = rounding / slope;
                let mut added = [[0.0; N]; N];
                for (row, own) in added.iter_mut().zip(jump).take(states) {
                    (0..states).for_each(|column| row[column] = own * jump[column] * time * time);
                }
                errors.add(&added);
            }
        }
        let (mode, layout) = (&self.common.rules.mode, &self.common.space.layout);
        for body in (0..layout.bodies()).filter(|&body| mode.motion[body] == Motion::Stuck) {
            errors.settle(layout.speed[body]);
        }
        self.errors = Some(errors);
    }

    /// Ends the present mode at a negative guard and enters the next.
    pub(super) fn go_through(&mut self, fallen: Transition) {
        let crossing = self.crossing(fallen);
        self.change(fallen);
        self.resolve();
        self.cross(crossing);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::Friction;
    use crate::mechanism::{Body, Cause, Label, Mechanism, MotionKind, Spring, SpringLaw, State};
    use crate::solve::exact::Space;
    use std::sync::Arc;

    /// A cart of 1 kg that slides at a speed, m/s, against 1 N; 1 m before a stop with damping, N s/m.
    fn sliding(speed: f64, damping: f64) -> Core<16> {
        let label = Label { key: "cart", name: "cart" };
        let cart = Body {
            label,
            kind: MotionKind::Linear,
            inertia: 1.0,
            friction: Friction::symmetric(0.0, 1.0),
            force: 0.0,
            along: None,
            leader: (0, 1.0),
            is_rotor: false,
        };
        let law = SpringLaw::Gap { low: -1.0, high: 1.0 };
        let stop = Spring { label, arms: vec![(0, 1.0)], stiffness: 1e4, damping, law, follows: None };
        let mechanism = Mechanism::new(vec![cart], vec![stop], Vec::new());
        let mut start = State::default();
        start.speed[0] = speed;
        let space = Arc::new(Space::new(&mechanism, 0));
        Core::new(Arc::new(mechanism), space, &start, (1e-3, f64::INFINITY), Vec::new())
    }

    /// The speed that falls to zero was assumed to have no rounding error.
    #[test]
    fn a_stop_is_as_uncertain_as_the_speeds_before_it() {
        let mut core = sliding(0.3, 0.0);
        (1..=29).for_each(|row| core.go_on_to(1e-2 * f64::from(row), &mut Vec::new()).unwrap());
        core.carry_errors();
        let place = core.common.space.layout.speed[0];
        assert!((core.z[place] - 0.01).abs() < 1e-12, "{}", core.z[place]);
        core.z[place] = 0.0;
        let stops = |cause| matches!(cause, Cause::Stop(0));
        let guard = core.matrices.guards.iter().find(|guard| stops(guard.transition.cause)).unwrap();
        let crossing = core.crossing(guard.transition).unwrap();
        let rounding = f64::EPSILON * 0.3;
        assert!((0.9..10.0).contains(&(crossing.rounding / rounding)), "{:e}", crossing.rounding);
    }

    /// S of a damped contact, whose force jumps, and F on both of its sides are the derivatives of runs.
    #[test]
    fn errors_go_through_a_contact_as_differences_of_runs_do() {
        let (off, at) = (1e-6, 0.6);
        for place in 0..2 {
            let run = |off: f64| {
                let mut core = sliding(2.0, 40.0);
                let layout = &core.common.space.layout;
                let places = [layout.coordinate[0], layout.speed[0]];
                core.z[places[place]] += off;
                if let Some(errors) = &mut core.errors {
                    errors.c[places[place]][places[place]] = off * off;
                }
                core.go_on_to(at, &mut Vec::new()).unwrap();
                core.carry_errors();
                let errors = core.errors.as_ref().unwrap();
                places.map(|place| (core.z[place], errors.c[place][place].sqrt()))
            };
            let (more, less) = (run(off), run(-off));
            for ((more, error), (less, _)) in more.into_iter().zip(less) {
                let moved = (more - less).abs() / 2.0;
                assert!((error - moved).abs() < 1e-3 * (moved + off), "{error:e}, {moved:e}");
            }
        }
    }
}
