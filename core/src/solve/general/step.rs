//! One step by exponential collocation.
//!
//! Within a step the forces f_j are quartics through their values at its beginning, which are known, and at the four
//! nodes of Radau's formula IIA, which are not. The arguments at the nodes follow from them by the linear equations,
//! and they from the arguments by the laws:
//!
//! ```text
//! v = E z + W f,   f = f(v)             E: what the state does to the arguments, W: what the forces do
//! z ← z + P z + G f                     the end of the step, once f is known
//! ```
//!
//! For flat laws the iteration f ← f(E z + W f) converges, each time by a factor of h F_s/(v_s m). For steep ones
//! (bristles, Simscape's smooth law, belts that follow) Newton's method does: with the slopes f′ of the laws, (I − f′
//! W) δ = f(v) − f.
//!
//! The error is estimated from the residual of the quartics. With a sixth value, from the previous step, the error of a
//! force is D ω(s), with ω zero at the five points; multiplied by W, it gives the error of the arguments. Radau's nodes
//! make this very small at the end of the step. Errors at the nodes count, too, since they act as forces, and rows may
//! be there. A first step is judged by the cubics through the nodes alone.

use super::bristles::{Bristle, Bristles};
use super::field::Field;
use super::linear::{Forcing, STATES, Series, Set, States};
use super::model::{MOST, MOST_GUARDS, Vector};
use super::newton::Newton;
use super::radau::{BACKWARD, C, FOUND, Lane, MONOMIALS, NODES, POINTS, POWER, POWERS, rest};
use super::sources::SOURCES;
use crate::mechanism::{BODIES, DRIVES, SPRINGS};
use crate::signal::DEGREE;

/// Largest number of arguments of forces: speeds, positions, lengths, currents, inputs, accelerations of a ride.
pub(super) const ARGUMENTS: usize = 2 * BODIES + SPRINGS + 2 * DRIVES + 3;

/// Most columns of what a step depends on.
const COLUMNS: usize = STATES + 1 + DRIVES * (DEGREE + 1) + SOURCES * POINTS;

/// Turns of the iteration at most.
const TURNS: usize = 12;

/// A contraction above which Newton's method is taken.
const SLOW: f64 = 0.2;

/// The error of the quartics, as a multiple of what cubics would be off by, where nothing else is known.
const OF_CUBIC: f64 = 1.0;

/// Factor on the residual of a force at a kink, which is estimated from few values.
const OF_KINK: f64 = 10.0;

/// The values of the forces at the points of a step.
pub(super) type Forces = [[f64; POINTS]; SOURCES];

/// Inputs by powers of the share of a step.
pub(super) type Inputs = [[f64; DEGREE + 1]; DRIVES];

/// A thing for each argument.
pub(super) type Lanes<T> = [T; ARGUMENTS];

/// The state that a step begins with, and the inputs along it.
#[derive(Clone, Copy)]
pub(super) struct Begin<'a> {
    pub(super) y: &'a Vector,
    /// Inputs by powers of the fraction of the step; valid for its length only.
    pub(super) input: Inputs,
    pub(super) degree: usize,
    /// One over what each argument may be off by.
    pub(super) strict: &'a Lanes<f64>,
}

/// A step to be solved.
pub(super) struct Step<'a> {
    pub(super) field: &'a Field,
    /// The number of its mode.
    pub(super) number: u64,
    pub(super) set: &'a Set,
    pub(super) begin: &'a Begin<'a>,
    /// True if it is taken by the columns of the whole step, or by its series.
    pub(super) whole: bool,
}

/// Room for what a step is solved by, and the step that was solved last.
#[derive(Clone)]
pub(super) struct StepBuffers {
    pub(super) forces: Forces,
    pub(super) arguments: Lanes<Lane>,
    /// The arguments without the forces at the nodes.
    base: Lanes<Lane>,
    pub(super) bristles: Bristles,
    pub(super) series: Box<Series>,
    pub(super) forcing: Forcing,
    pub(super) x: [f64; COLUMNS],
    /// The state at the end of the step.
    pub(super) end: Vector,
    newton: Newton,
    /// The length of the step before, where it ended as this one begins, and each force at its third node.
    past: Option<f64>,
    kept: [f64; SOURCES],
    /// Guards at the points of the step.
    pub(super) told: [[f64; POINTS]; MOST_GUARDS],
    pub(super) evaluations: u64,
}

/// Source of the first guess of the forces, with the length of that step, s, or the ratio of the next length to it.
#[derive(Debug, Clone, Copy)]
pub(super) enum Guess {
    /// The forces at the beginning of the step, held constant.
    Constant,
    /// The quartics of the step before: this one begins where that one ended.
    After(f64),
    /// The quartics of a longer step from the same beginning.
    Within(f64),
}

impl Guess {
    /// This guess for a step of length `h`, scaled by the ratio of the lengths.
    pub(super) fn predict(self, h: f64) -> Self {
        match self {
            Guess::Constant => Guess::Constant,
            Guess::After(length) => Guess::After(h / length),
            Guess::Within(length) => Guess::Within(h / length),
        }
    }
}

impl StepBuffers {
    pub(super) fn new() -> Self {
        Self {
            forces: [[0.0; POINTS]; SOURCES],
            arguments: [[0.0; NODES]; ARGUMENTS],
            base: [[0.0; NODES]; ARGUMENTS],
            bristles: [Bristle::default(); BODIES],
            series: Box::new(Series::room()),
            forcing: [[0.0; STATES]; POWERS],
            x: [0.0; COLUMNS],
            end: [0.0; MOST],
            newton: Newton::default(),
            past: None,
            kept: [0.0; SOURCES],
            told: [[0.0; POINTS]; MOST_GUARDS],
            evaluations: 0,
        }
    }

    /// Restarts with these forces, without values of previous steps.
    pub(super) fn begin(&mut self, forces: &[f64]) {
        self.forces.iter_mut().zip(forces).for_each(|(force, value)| force[0] = *value);
        self.past = None;
    }

    /// The step of length `h` that was solved is taken, and the next one begins at its end.
    pub(super) fn keep(&mut self, h: f64, sources: usize) {
        self.past = Some(h);
        self.kept.iter_mut().zip(&self.forces[..sources]).for_each(|(kept, force)| *kept = force[POINTS - 2]);
    }

    /// Guesses the forces at the nodes.
    #[inline(always)]
    fn guess(&mut self, sources: usize, guess: Guess) {
        let (from, ratio) = match guess {
            Guess::Constant => {
                self.forces[..sources].iter_mut().for_each(|force| *force = [force[0]; POINTS]);
                return;
            }
            Guess::After(ratio) => (1.0, ratio),
            Guess::Within(ratio) => (0.0, ratio),
        };
        let basis = basis(C.map(|place| from + place * ratio));
        for force in &mut self.forces[..sources] {
            let mut along = [0.0; NODES];
            for (value, weight) in force.iter().zip(&basis) {
                along.iter_mut().zip(weight).for_each(|(along, weight)| *along += value * weight);
            }
            if from == 1.0 {
                force[0] = force[POINTS - 1];
            }
            let begin = force[0];
            for (value, along) in force[1..].iter_mut().zip(along) {
                *value = if along.is_finite() { along } else { begin };
            }
        }
    }

    /// Solves a step from a guess of the forces, those at its beginning being known. Its error as a multiple of what is
    /// allowed; nothing where it cannot be found.
    pub(super) fn solve(&mut self, step: &Step, guess: Guess) -> Option<f64> {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.solve_by_avx2(step, guess) };
        }
        self.solve_by_any::<false>(step, guess)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn solve_by_avx2(&mut self, step: &Step, guess: Guess) -> Option<f64> {
        self.solve_by_any::<true>(step, guess)
    }

    #[inline(always)]
    fn solve_by_any<const AVX2: bool>(&mut self, step: &Step, guess: Guess) -> Option<f64> {
        let sources = step.field.sources.len();
        self.guess(sources, guess);
        self.set_out(step);
        // The usual numbers of arguments and forces are known to the compiler.
        let error = match (step.field.linear.arguments, sources) {
            (0, 0) => Some(0.0),
            (1, 1) => self.find::<1, 1, AVX2>(step),
            (2, 2) => self.find::<2, 2, AVX2>(step),
            (3, 3) => self.find::<3, 3, AVX2>(step),
            (6, 2) => self.find::<6, 2, AVX2>(step),
            _ => self.find::<ARGUMENTS, SOURCES, AVX2>(step),
        };
        if error.is_some() {
            self.go_to_end(step);
        }
        error
    }

    /// The arguments at the nodes by what is known: the state, inputs, forces at the beginning.
    #[inline(always)]
    fn set_out(&mut self, step: &Step) {
        let &Step { field, set, begin, .. } = step;
        let (linear, sources) = (&field.linear, field.sources.len());
        let known = self.fill(field, begin);
        for (argument, base) in self.base[..linear.arguments].iter_mut().enumerate() {
            *base = set.base(argument, &self.x[..known]);
        }
        for (argument, base) in self.base[..linear.arguments].iter_mut().enumerate() {
            for (source, force) in self.forces[..sources].iter().enumerate() {
                let weight = &set.weights(argument, source, sources)[0];
                base.iter_mut().zip(weight).for_each(|(base, weight)| *base += weight * force[0]);
            }
        }
    }

    /// The forces at the nodes, and the error of the step.
    #[inline(always)]
    fn find<const A: usize, const S: usize, const AVX2: bool>(&mut self, step: &Step) -> Option<f64> {
        self.iterate::<A, S, AVX2>(step)?;
        let error = self.error::<A, S>(step);
        error.is_finite().then_some(error)
    }

    /// The arguments at the nodes that the forces there lead to.
    #[inline(always)]
    fn led<const A: usize, const S: usize>(&self, set: &Set, counts: (usize, usize), forces: &[Lane; S]) -> [Lane; A] {
        let (arguments, sources) = counts;
        let mut to = [[0.0; NODES]; A];
        for (argument, lane) in to[..arguments].iter_mut().enumerate() {
            *lane = self.base[argument];
            for (source, force) in forces[..sources].iter().enumerate() {
                let weights = set.weights(argument, source, sources);
                for (weight, force) in weights[1..POINTS].iter().zip(force) {
                    lane.iter_mut().zip(weight).for_each(|(lane, weight)| *lane += weight * force);
                }
            }
        }
        to
    }

    /// The values of the forces at the arguments.
    #[inline(always)]
    fn values<const AVX2: bool>(&mut self, step: &Step, values: &mut [Lane]) {
        #[cfg(target_arch = "x86_64")]
        if AVX2 {
            // SAFETY: the caller has checked the processor.
            return unsafe { self.values_by_avx2(step, values) };
        }
        self.values_by_any(step, values);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    #[inline(never)]
    fn values_by_avx2(&mut self, step: &Step, values: &mut [Lane]) {
        self.values_by_any(step, values);
    }

    #[inline(always)]
    fn values_by_any(&mut self, step: &Step, values: &mut [Lane]) {
        for (source, value) in step.field.sources.iter().zip(values) {
            let (model, y) = (&step.field.model, step.begin.y);
            *value = source.at_nodes(model, step.set.h, y, &self.arguments, &mut self.bristles);
        }
    }

    #[inline(always)]
    fn iterate<const A: usize, const S: usize, const AVX2: bool>(&mut self, step: &Step) -> Option<()> {
        let &Step { field, number, set, begin, .. } = step;
        let counts = counts::<A, S>(field);
        let (arguments, sources) = counts;
        if self.newton.of != Some((number, set.h)) {
            self.newton.of = None;
        }
        for source in &field.sources {
            source.set_out(&field.model, set.h, begin.y, &mut self.bristles);
        }
        let mut newton = self.newton.of.is_some() && self.newton.wanted;
        let (mut before, mut fresh) = (f64::INFINITY, false);
        let mut forces: [Lane; S] = std::array::from_fn(|source| nodes(&self.forces[source]));
        let mut now: [Lane; A] = self.led(set, counts, &forces);
        self.arguments[..arguments].copy_from_slice(&now[..arguments]);
        for turn in 0..TURNS {
            self.evaluations += 1;
            let mut next = [[0.0; NODES]; S];
            self.values::<AVX2>(step, &mut next[..sources]);
            if newton {
                for (next, force) in next[..sources].iter_mut().zip(&forces) {
                    next.iter_mut().zip(force).for_each(|(next, force)| *next -= force);
                }
                self.newton.solve(&mut next[..sources]);
                for (next, force) in next[..sources].iter_mut().zip(&forces) {
                    next.iter_mut().zip(force).for_each(|(next, force)| *next += force);
                }
            }
            let then: [Lane; A] = self.led(set, counts, &next);
            let most = farthest(&then[..arguments], &now[..arguments], begin.strict)?;
            let contraction = most / before;
            // Divergent iterations are not continued.
            if contraction <= 1.0 || turn == 0 || newton {
                (forces, now) = (next, then);
                self.arguments[..arguments].copy_from_slice(&now[..arguments]);
            }
            // One change alone does not predict the next.
            if most <= FOUND || (before.is_finite() && most * contraction <= FOUND && contraction < 1.0) {
                for (own, force) in self.forces[..sources].iter_mut().zip(&forces) {
                    own[1..].copy_from_slice(force);
                }
                return Some(());
            }
            before = most;
            if turn > 0 && contraction > SLOW && !fresh {
                // With the slopes at the present values; a divergent iteration starts again.
                self.newton.prepare(field, number, set, &self.arguments, &self.bristles);
                (newton, fresh, before) = (true, true, f64::INFINITY);
                self.newton.wanted = true;
            } else {
                fresh = false;
            }
        }
        None
    }

    /// The share of the step at which one of its forces first has a kink.
    pub(super) fn kink(&self, step: &Step) -> Option<f64> {
        let shares = (0..step.field.sources.len()).filter_map(|source| self.kink_of(step, source));
        shares.reduce(f64::min)
    }

    /// Bodies whose friction reverses at the end of the step.
    pub(super) fn reversing(&self, field: &Field) -> [bool; BODIES] {
        let mut reversing = [false; BODIES];
        let bodies = field.sources.iter().filter_map(|source| source.reversing(&field.model, &self.arguments));
        bodies.for_each(|body| reversing[body] = true);
        reversing
    }

    #[inline(always)]
    fn kink_of(&self, step: &Step, source: usize) -> Option<f64> {
        let Begin { y, input, strict, .. } = step.begin;
        let begin = (*y, &input.map(|powers| powers[0]));
        step.field.sources[source].kink(&step.field.model, begin, &self.arguments, &strict[..])
    }

    /// Error of the arguments at the end of the step, as a multiple of the allowed one.
    #[inline(always)]
    fn error<const A: usize, const S: usize>(&self, step: &Step) -> f64 {
        let &Step { field, set, begin, .. } = step;
        let (arguments, sources) = counts::<A, S>(field);
        // The place of the sixth value, on this step: the third node of the one before.
        let sixth = self.past.map(|past| -(1.0 - C[NODES - 2]) * past / set.h);
        let there = sixth.map(|s| (basis([s]), rest(s)));
        let cubic = |force: &[f64; POINTS]| {
            force[0] - BACKWARD.iter().zip(&force[1..]).fold(0.0, |sum, (weight, force)| sum + weight * force)
        };
        // Each as the weights that it is led by, and their factor.
        let mut off = [(0, 0.0); S];
        for (source, off) in off[..sources].iter_mut().enumerate() {
            let force = &self.forces[source];
            let missed =
                field.sources[source].missed((&field.model, set.h, begin.y), &self.arguments, (force, &self.bristles));
            *off = match &there {
                // A kink leaves as much to a quartic as to a cubic.
                _ if self.kink_of(step, source).is_some() => (0, OF_KINK * cubic(force)),
                Some((basis, rest)) => {
                    let quartic = basis.iter().zip(force).fold(0.0, |sum, ([weight], value)| sum + weight * value);
                    (POINTS, (self.kept[source] - quartic) / rest)
                }
                None => (0, OF_CUBIC * cubic(force)),
            };
            if let Some([deviation, missed]) = missed {
                let is_more = if off.0 == POINTS { missed > off.1.abs() } else { deviation > off.1.abs() };
                *off = if is_more { (POINTS, missed) } else { *off };
            }
        }
        let mut most: f64 = 0.0;
        for argument in 0..arguments {
            let mut lane = [0.0; NODES];
            for (source, (point, off)) in off[..sources].iter().enumerate() {
                let weight = &set.weights(argument, source, sources)[*point];
                lane.iter_mut().zip(weight).for_each(|(lane, weight)| *lane += weight * off);
            }
            let within = lane.iter().fold(0.0, |most: f64, off| most.max(off.abs()));
            let own = (lane[NODES - 1].abs() + within) * begin.strict[argument];
            // `max` would ignore NaN.
            most = if lane.iter().sum::<f64>().is_finite() { most.max(own) } else { f64::INFINITY };
        }
        most
    }
}

/// Number of arguments and forces, if unknown to the compiler.
#[inline(always)]
fn counts<const A: usize, const S: usize>(field: &Field) -> (usize, usize) {
    let arguments = if A < ARGUMENTS { A } else { field.linear.arguments };
    (arguments, if S < SOURCES { S } else { field.sources.len() })
}

/// Largest difference of two lists of arguments, as a multiple of the allowed one; `None` for NaN.
#[inline(always)]
fn farthest(a: &[Lane], b: &[Lane], strict: &Lanes<f64>) -> Option<f64> {
    let (mut most, mut sum) = ([0.0; NODES], [0.0; NODES]);
    for ((a, b), strict) in a.iter().zip(b).zip(strict) {
        for i in 0..NODES {
            let own = (a[i] - b[i]).abs() * strict;
            most[i] = if own > most[i] { own } else { most[i] };
            sum[i] += own;
        }
    }
    let most = most.iter().fold(0.0, |most: f64, own| most.max(*own));
    (!sum.iter().sum::<f64>().is_nan()).then_some(most)
}

/// A force at the nodes.
#[inline(always)]
fn nodes(force: &[f64; POINTS]) -> Lane {
    [force[1], force[2], force[3], force[4]]
}

/// Σ c_k sᵏ at the nodes.
pub(super) fn at_nodes(c: &[f64; super::radau::TERMS], order: usize) -> Lane {
    let mut lane = [0.0; NODES];
    for (c, power) in c[..=order].iter().zip(&POWER) {
        lane.iter_mut().zip(power).for_each(|(lane, power)| *lane += c * power);
    }
    lane
}

/// ℓ_p at several places side by side.
#[inline(always)]
fn basis<const N: usize>(places: [f64; N]) -> [[f64; N]; POINTS] {
    let mut values = [[0.0; N]; POINTS];
    for (point, values) in values.iter_mut().enumerate() {
        *values = [MONOMIALS[POINTS - 1][point]; N];
        for power in MONOMIALS[..POINTS - 1].iter().rev() {
            values.iter_mut().zip(places).for_each(|(value, s)| *value = *value * s + power[point]);
        }
    }
    values
}

/// Coordinates, speeds and currents of a whole state; the elements after them do not count.
pub(super) fn states(y: &Vector) -> States {
    const LEAST: usize = if MOST < STATES { MOST } else { STATES };
    let mut states = [0.0; STATES];
    states[..LEAST].copy_from_slice(&y[..LEAST]);
    states
}
