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
//! Where the laws are flat, f ← f(E z + W f) finds it: each turn shrinks what is left to h F_s/(v_s m) of itself. Where
//! they are steep (bristles, Simscape's smooth law, belts that follow), Newton's method does: with the slopes f′ of the
//! laws, (I − f′ W) δ = f(v) − f.
//!
//! The error is estimated by the cubic through the nodes alone: what the arguments would be off by if it stood in the
//! place of the quartic. The error of the quartic is one order smaller.

use super::field::Field;
use super::linear::{Forcing, STATES, Series, Set, States};
use super::model::{MOST, Vector};
use super::radau::{BACKWARD, Lane, MONOMIALS, NODES, POINTS, POWER, POWERS};
use super::sources::Bristles;
use crate::mechanism::{BODIES, DRIVES, SPRINGS};
use crate::signal::DEGREE;

/// Most forces.
pub(super) const SOURCES: usize = BODIES + SPRINGS;

/// Most columns of what a step depends on.
const COLUMNS: usize = STATES + 1 + DRIVES * (DEGREE + 1) + SOURCES * POINTS;

/// Turns of the iteration at most.
const TURNS: usize = 12;

/// What is left of a change after which it counts as found, as a share of the tolerance.
const FOUND: f64 = 0.01;

/// A contraction above which Newton's method is taken.
const SLOW: f64 = 0.2;

/// The values of the forces at the points of a step.
pub(super) type Forces = [[f64; POINTS]; SOURCES];

/// Inputs by powers of the share of a step.
pub(super) type Inputs = [[f64; DEGREE + 1]; DRIVES];

/// What a step begins with.
pub(super) struct Begin<'a> {
    pub(super) y: &'a Vector,
    pub(super) input: &'a Inputs,
    pub(super) degree: usize,
    /// By how much each argument may be off.
    pub(super) allowed: &'a [f64],
}

/// Room for what a step is solved by, and the step that was solved last.
#[derive(Clone)]
pub(super) struct Room {
    pub(super) forces: Forces,
    pub(super) arguments: Vec<Lane>,
    base: Vec<Lane>,
    pub(super) bristles: Bristles,
    pub(super) series: Box<Series>,
    forcing: Forcing,
    x: [f64; COLUMNS],
    newton: Newton,
    pub(super) evaluations: u64,
}

/// The parted matrix of Newton's method, and the length of the step that it is of.
#[derive(Clone, Default)]
struct Newton {
    matrix: Vec<f64>,
    order: Vec<usize>,
    /// Of which mode and length it is.
    of: Option<(u64, f64)>,
    /// Whether steps of that length need it.
    wanted: bool,
}

/// Where a guess of the forces comes from; with the length of the step there, s, or with how many times as long the
/// next one is.
#[derive(Debug, Clone, Copy)]
pub(super) enum Guess {
    /// Those at the beginning.
    Constant,
    /// The quartics of the step before: this one begins where that one ended.
    After(f64),
    /// The quartics of a longer step from the same beginning.
    Within(f64),
}

impl Guess {
    /// The same for a step of length `h`: by the ratio of the lengths.
    pub(super) fn of(self, h: f64) -> Self {
        match self {
            Guess::Constant => Guess::Constant,
            Guess::After(length) => Guess::After(h / length),
            Guess::Within(length) => Guess::Within(h / length),
        }
    }
}

impl Room {
    pub(super) fn new() -> Self {
        Self {
            forces: [[0.0; POINTS]; SOURCES],
            arguments: Vec::new(),
            base: Vec::new(),
            bristles: [[0.0; NODES]; BODIES],
            series: Box::new(Series::room()),
            forcing: [[0.0; STATES]; POWERS],
            x: [0.0; COLUMNS],
            newton: Newton::default(),
            evaluations: 0,
        }
    }

    /// Guesses the forces at the nodes.
    pub(super) fn guess(&mut self, sources: usize, guess: Guess) {
        for force in &mut self.forces[..sources] {
            let (from, ratio) = match guess {
                Guess::Constant => {
                    *force = [force[0]; POINTS];
                    continue;
                }
                Guess::After(ratio) => (1.0, ratio),
                Guess::Within(ratio) => (0.0, ratio),
            };
            let powers = monomials(force);
            if from == 1.0 {
                force[0] = force[POINTS - 1];
            }
            let begin = force[0];
            for (value, place) in force[1..].iter_mut().zip(super::radau::C) {
                let s = from + place * ratio;
                let along = powers.iter().rev().fold(0.0, |sum, power| sum * s + power);
                *value = if along.is_finite() { along } else { begin };
            }
        }
    }

    /// Solves a step from a guess of the forces, those at its beginning being known. Its error as a multiple of what is
    /// allowed, that of the cubic; nothing where it cannot be found.
    pub(super) fn solve(&mut self, field: &Field, number: u64, set: &Set, begin: &Begin, whole: bool) -> Option<f64> {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.solve_by_avx2(field, number, set, begin, whole) };
        }
        self.solve_by_any(field, number, set, begin, whole)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn solve_by_avx2(&mut self, field: &Field, number: u64, set: &Set, begin: &Begin, whole: bool) -> Option<f64> {
        self.solve_by_any(field, number, set, begin, whole)
    }

    #[inline(always)]
    fn solve_by_any(&mut self, field: &Field, number: u64, set: &Set, begin: &Begin, whole: bool) -> Option<f64> {
        let (linear, sources) = (&field.linear, field.sources.len());
        let full = set.full(linear, whole);
        self.base.clear();
        match full {
            Some(full) => {
                self.fill(field, begin);
                let known = linear.size + 1 + DRIVES * (begin.degree + 1);
                self.base.extend((0..linear.arguments).map(|argument| full.output(argument, &self.x[..known])));
            }
            None => {
                self.forcing(field, begin, 0);
                linear.series(&states(begin.y), set.h, &self.forcing, &mut self.series);
                for output in &linear.outputs[..linear.arguments] {
                    let mut coefficients = [0.0; super::radau::TERMS];
                    self.series.along(linear.size, &output.row, &mut coefficients);
                    self.base.push(at_nodes(&coefficients, self.series.order));
                }
            }
        }
        for (argument, base) in self.base.iter_mut().enumerate() {
            for (source, force) in self.forces[..sources].iter().enumerate() {
                let weight = &set.weights(argument, source, sources)[0];
                base.iter_mut().zip(weight).for_each(|(base, weight)| *base += weight * force[0]);
            }
        }
        self.iterate(field, number, set, begin)?;
        let error = self.error(field, set, begin);
        error.is_finite().then_some(error)
    }

    /// The arguments at the nodes that the forces lead to.
    #[inline(always)]
    fn arguments(&mut self, set: &Set, sources: usize) {
        self.arguments.clone_from(&self.base);
        for (argument, lane) in self.arguments.iter_mut().enumerate() {
            for (source, force) in self.forces[..sources].iter().enumerate() {
                let weights = set.weights(argument, source, sources);
                for (weight, force) in weights[1..].iter().zip(&force[1..]) {
                    lane.iter_mut().zip(weight).for_each(|(lane, weight)| *lane += weight * force);
                }
            }
        }
    }

    #[inline(always)]
    fn iterate(&mut self, field: &Field, number: u64, set: &Set, begin: &Begin) -> Option<()> {
        let sources = field.sources.len();
        if self.newton.of != Some((number, set.h)) {
            self.newton.of = None;
        }
        let mut newton = self.newton.of.is_some() && self.newton.wanted;
        let (mut before, mut fresh) = (f64::INFINITY, false);
        for turn in 0..TURNS {
            self.arguments(set, sources);
            self.evaluations += 1;
            let mut change = [[0.0; NODES]; SOURCES];
            for ((source, change), force) in field.sources.iter().zip(&mut change).zip(&self.forces) {
                let value = source.at_nodes(&field.model, set.h, begin.y, &self.arguments, &mut self.bristles);
                change.iter_mut().zip(value).zip(&force[1..]).for_each(|((c, value), force)| *c = value - force);
            }
            if newton {
                self.newton.solve(&mut change[..sources]);
            }
            let mut most: f64 = 0.0;
            for (argument, allowed) in begin.allowed.iter().enumerate() {
                let mut moved = [0.0; NODES];
                for (source, change) in change[..sources].iter().enumerate() {
                    for (weight, change) in set.weights(argument, source, sources)[1..].iter().zip(change) {
                        moved.iter_mut().zip(weight).for_each(|(moved, weight)| *moved += weight * change);
                    }
                }
                most = moved.iter().fold(most, |most, moved| most.max(moved.abs() / allowed));
                if moved.iter().any(|moved| moved.is_nan()) {
                    return None;
                }
            }
            let contraction = most / before;
            // What runs away is not followed.
            if contraction <= 1.0 || turn == 0 || newton {
                for (force, change) in self.forces[..sources].iter_mut().zip(&change) {
                    force[1..].iter_mut().zip(change).for_each(|(force, change)| *force += change);
                }
            }
            // One change alone tells nothing of the next.
            if most <= FOUND || (before.is_finite() && most * contraction <= FOUND && contraction < 1.0) {
                return Some(());
            }
            before = most;
            if turn > 0 && contraction > SLOW && !fresh {
                // By the slopes where it stands; what has run away begins anew.
                self.arguments(set, sources);
                self.newton.prepare(field, number, set, &self.arguments, &self.bristles);
                (newton, fresh, before) = (true, true, f64::INFINITY);
                self.newton.wanted = true;
            } else {
                fresh = false;
            }
        }
        None
    }

    /// What the arguments at the nodes would be off by if the forces were cubics, as a multiple of what is allowed.
    #[inline(always)]
    fn error(&self, field: &Field, set: &Set, begin: &Begin) -> f64 {
        let sources = field.sources.len();
        let mut most: f64 = 0.0;
        for (argument, allowed) in begin.allowed.iter().enumerate() {
            let mut off = [0.0; NODES];
            for (source, force) in self.forces[..sources].iter().enumerate() {
                let cubic = BACKWARD.iter().zip(&force[1..]).fold(0.0, |sum, (weight, force)| sum + weight * force);
                let defect = force[0] - cubic;
                let weight = &set.weights(argument, source, sources)[0];
                off.iter_mut().zip(weight).for_each(|(off, weight)| *off += weight * defect);
            }
            for off in off {
                // What is no number counts as no error at all in `max`.
                most = if off.is_finite() { most.max(off.abs() / allowed) } else { f64::INFINITY };
            }
        }
        most
    }

    /// The numbers that a step depends on, by their columns.
    fn fill(&mut self, field: &Field, begin: &Begin) {
        let size = field.linear.size;
        self.x[..size].copy_from_slice(&begin.y[..size]);
        self.x[size] = 1.0;
        for (drive, powers) in begin.input.iter().enumerate() {
            let place = size + 1 + drive * (begin.degree + 1);
            self.x[place..=place + begin.degree].copy_from_slice(&powers[..=begin.degree]);
        }
    }

    /// Known forces, and those of the first `sources` laws, by powers of the share of the step.
    fn forcing(&mut self, field: &Field, begin: &Begin, sources: usize) {
        let (linear, size) = (&field.linear, field.linear.size);
        self.forcing.iter_mut().for_each(|power| power[..size].fill(0.0));
        self.forcing[0][..size].copy_from_slice(&linear.constant[..size]);
        let forcing = &mut self.forcing;
        let mut add = |power: usize, column: &States, factor: f64| {
            if factor != 0.0 {
                forcing[power][..size].iter_mut().zip(column).for_each(|(sum, value)| *sum += factor * value);
            }
        };
        for (column, powers) in linear.input.iter().zip(begin.input) {
            powers[..=begin.degree].iter().enumerate().for_each(|(power, value)| add(power, column, *value));
        }
        for (column, force) in linear.source[..sources].iter().zip(&self.forces) {
            if *force != [0.0; POINTS] {
                monomials(force).into_iter().enumerate().for_each(|(power, value)| add(power, column, value));
            }
        }
    }

    /// The series of the states over the step that was solved.
    pub(super) fn expand(&mut self, field: &Field, h: f64, begin: &Begin) {
        self.forcing(field, begin, field.sources.len());
        field.linear.series(&states(begin.y), h, &self.forcing, &mut self.series);
    }

    /// The state at the end of the step that was solved; without its columns, from its series.
    pub(super) fn end(&mut self, field: &Field, set: &Set, begin: &Begin) -> Vector {
        let linear = &field.linear;
        let mut end = states(begin.y);
        match set.full(linear, false) {
            Some(full) => {
                let known = linear.size + 1 + DRIVES * (begin.degree + 1);
                for (source, force) in self.forces[..field.sources.len()].iter().enumerate() {
                    self.x[known + source * POINTS..][..POINTS].copy_from_slice(force);
                }
                let x = &self.x[..full.end.len()];
                match linear.size {
                    8 => full.advance::<8>(&mut end, x),
                    12 => full.advance::<12>(&mut end, x),
                    _ => full.advance::<STATES>(&mut end, x),
                }
            }
            None => {
                self.expand(field, set.h, begin);
                end = self.series.at(linear.size, 1.0);
            }
        }
        self.with_bristles(field, begin.y, &end, 1.0)
    }

    /// A whole state at the share `s` of the step.
    pub(super) fn with_bristles(&self, field: &Field, begin: &Vector, states: &States, s: f64) -> Vector {
        let mut y = *begin;
        let count = field.model.layout.states;
        y[..count].copy_from_slice(&states[..count]);
        for source in &field.sources {
            let super::sources::Source::Friction { curved, .. } = source else { continue };
            let curved = &field.model.curved[*curved];
            if let Some(place) = curved.bristle {
                let [a, b, c, d] = self.bristles[curved.body];
                y[place] = match s {
                    1.0 => d,
                    s => monomials(&[begin[place], a, b, c, d]).iter().rev().fold(0.0, |sum, power| sum * s + power),
                };
            }
        }
        y
    }

    /// A guard's output at the points of the step that was solved, where its columns are there.
    pub(super) fn guard_at_points(
        &self,
        field: &Field,
        set: &Set,
        begin: &Begin,
        index: usize,
    ) -> Option<[f64; POINTS]> {
        let full = set.full(&field.linear, false)?;
        let output = field.output[index];
        let lane = match output < field.linear.arguments {
            true => self.arguments[output],
            false => full.output(output, &self.x[..full.end.len()]),
        };
        let begin = self.output_at_begin(field, begin, output);
        Some([begin, lane[0], lane[1], lane[2], lane[3]])
    }

    fn output_at_begin(&self, field: &Field, begin: &Begin, output: usize) -> f64 {
        let output = &field.linear.outputs[output];
        let size = field.linear.size;
        let on_state = output.row[..size].iter().zip(begin.y).fold(0.0, |sum, (weight, y)| sum + weight * y);
        let on_input = output.input.iter().zip(begin.input).fold(0.0, |sum, (weight, powers)| sum + weight * powers[0]);
        let forces = output.source.iter().zip(&self.forces);
        forces.fold(on_state + on_input + output.constant, |sum, (weight, force)| sum + weight * force[0])
    }

    /// A guard's output along the series of the step, by powers of its share.
    pub(super) fn guard_along(&self, field: &Field, begin: &Begin, index: usize, c: &mut [f64; super::radau::TERMS]) {
        let output = &field.linear.outputs[field.output[index]];
        self.series.along(field.linear.size, &output.row, c);
        for (weight, powers) in output.input.iter().zip(begin.input).filter(|(weight, _)| **weight != 0.0) {
            c.iter_mut().zip(powers).for_each(|(c, power)| *c += weight * power);
        }
        for (weight, force) in output.source.iter().zip(&self.forces).filter(|(weight, _)| **weight != 0.0) {
            c.iter_mut().zip(monomials(force)).for_each(|(c, power)| *c += weight * power);
        }
        c[0] += output.constant;
    }

    /// The same at the points.
    pub(super) fn at_points(c: &[f64; super::radau::TERMS], order: usize) -> [f64; POINTS] {
        let lane = at_nodes(c, order);
        [c[0], lane[0], lane[1], lane[2], lane[3]]
    }
}

/// Σ c_k sᵏ at the nodes.
fn at_nodes(c: &[f64; super::radau::TERMS], order: usize) -> Lane {
    let mut lane = [0.0; NODES];
    for (c, power) in c[..=order].iter().zip(&POWER) {
        lane.iter_mut().zip(power).for_each(|(lane, power)| *lane += c * power);
    }
    lane
}

/// The powers of the quartic through five values.
#[inline(always)]
pub(super) fn monomials(values: &[f64; POINTS]) -> [f64; POINTS] {
    let mut powers = [0.0; POINTS];
    for (power, row) in powers.iter_mut().zip(&MONOMIALS) {
        for (weight, value) in row.iter().zip(values) {
            *power += weight * value;
        }
    }
    powers
}

/// Coordinates, speeds and currents of a whole state; what stands behind them does not count.
fn states(y: &Vector) -> States {
    const LEAST: usize = if MOST < STATES { MOST } else { STATES };
    let mut states = [0.0; STATES];
    states[..LEAST].copy_from_slice(&y[..LEAST]);
    states
}

impl Newton {
    /// Makes I − f′ W ready where the arguments are.
    fn prepare(&mut self, field: &Field, number: u64, set: &Set, arguments: &[Lane], bristles: &Bristles) {
        let sources = field.sources.len();
        let size = sources * NODES;
        self.matrix.clear();
        self.matrix.resize(size * size, 0.0);
        for (number, source) in field.sources.iter().enumerate() {
            let matrix = &mut self.matrix;
            source.slopes(&field.model, set.h, arguments, bristles, &mut |argument, slopes| {
                for other in 0..sources {
                    let weights = set.weights(argument, other, sources);
                    for (i, slopes) in slopes.iter().enumerate() {
                        for (p, weight) in weights[1..].iter().enumerate() {
                            let change: f64 = slopes.iter().zip(weight).fold(0.0, |sum, (a, b)| sum + a * b);
                            matrix[(number * NODES + i) * size + other * NODES + p] -= change;
                        }
                    }
                }
            });
        }
        (0..size).for_each(|i| self.matrix[i * size + i] += 1.0);
        self.decompose(size);
        self.of = Some((number, set.h));
    }

    /// Parts the matrix in two triangles, with exchange of rows.
    fn decompose(&mut self, size: usize) {
        let m = &mut self.matrix;
        self.order.clear();
        for k in 0..size {
            let best =
                (k..size).fold(k, |best, i| if m[i * size + k].abs() > m[best * size + k].abs() { i } else { best });
            self.order.push(best);
            if best != k {
                (0..size).for_each(|j| m.swap(k * size + j, best * size + j));
            }
            let (above, below) = m.split_at_mut((k + 1) * size);
            let pivot = &above[k * size..];
            for row in below.chunks_mut(size) {
                let factor = row[k] / pivot[k];
                row[k] = factor;
                if factor != 0.0 {
                    row[k + 1..].iter_mut().zip(&pivot[k + 1..]).for_each(|(entry, pivot)| *entry -= factor * pivot);
                }
            }
        }
    }

    fn solve(&self, change: &mut [Lane]) {
        let x = change.as_flattened_mut();
        let size = x.len();
        // Rows are exchanged whole, so all exchanges come first.
        for (k, &best) in self.order.iter().enumerate() {
            x.swap(k, best);
        }
        for i in 0..size {
            let row = &self.matrix[i * size..][..i];
            x[i] -= row.iter().zip(&x[..i]).fold(0.0, |sum, (entry, x)| sum + entry * x);
        }
        for i in (0..size).rev() {
            let row = &self.matrix[i * size..][..size];
            let rest = row[i + 1..].iter().zip(&x[i + 1..]).fold(0.0, |sum, (entry, x)| sum + entry * x);
            x[i] = (x[i] - rest) / row[i];
        }
    }
}
