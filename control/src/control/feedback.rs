//! A controller as a linear filter of its measurements, for margins and stability: within its limit, without reference
//! and counts.
//!
//! The derivatives of its law at rest, by dual numbers, are s⁺ = A s + B (y, x, i, u), and C s + D (y, x, i, u) for the
//! requested command, where u is the command that the axis gets. States are ordered by dependence; those with mutual
//! dependence are transformed so that A is lower triangular except for a pair of rows for each two complex poles (real
//! Schur form). An integral stays as it is: its A − 1 is exactly zero, and z − 1 is known without the loss of a
//! difference.

use super::filter::Biquad;
use super::law::Law;
use super::sampled::Observation;
use super::standard::Text;
use crate::calculator::{Dual, Evaluation, Slope};
use crate::design::Design;
use crate::error::Result;
use crate::linear::eigen::{balance, scaled};
use crate::machine::Machine;
use crate::signal::profile::Reference;
use nalgebra::{Complex, DMatrix, Schur};
use std::ops::{Add, Mul, Sub};

/// Maximum number of QR steps for the Schur form of mutually dependent states; a few for each state suffice.
const TURNS: usize = 1000;

/// Least distance of a pole outside of the unit circle to count.
const OUTSIDE: f64 = 1e-9;

/// Inputs of a controller: encoder, scale, current, and the command that the axis gets.
const INPUTS: usize = 4;
const SCALE: usize = 1;
const CURRENT: usize = 2;
const COMMAND: usize = 3;

/// The controller of a design as D u = −(N_y y + N_x x + N_i i), with the measured position y, the cart x on an
/// additional scale and the measured current i at a sample.
#[derive(Debug, Clone)]
pub struct Feedback {
    every: f64,
    /// The states, the last of which depend on those before.
    parts: Vec<Part>,
    /// C.
    row: Vec<f64>,
    /// B, state by state, and D.
    inputs: Vec<[f64; INPUTS]>,
    direct: [f64; INPUTS],
    corners: Vec<f64>,
    is_linear: bool,
}

/// Rows of A − I for one pole, or for two complex ones: the diagonal block, and the earlier states that it depends on,
/// with their coefficients.
#[derive(Debug, Clone)]
enum Part {
    One { pole: f64, of: Vec<(usize, f64)> },
    Two { block: [[f64; 2]; 2], of: Vec<(usize, [f64; 2])> },
}

/// N_y, N_x, N_i and D at one frequency, over poles of the controller of which [`Feedback::unstable`] are outside of
/// the unit circle.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Terms {
    /// N_y, V/m or A/m.
    pub position: Complex<f64>,
    /// N_x, V/m or A/m; zero without a scale.
    pub scale: Complex<f64>,
    /// N_i, V/A; zero without a current loop.
    pub current: Complex<f64>,
    /// D.
    pub own: Complex<f64>,
}

/// Precomputed terms of a frequency in a sampled loop.
#[derive(Debug, Clone, Copy)]
pub struct Turn {
    /// z = e^{jωT}.
    z: Complex<f64>,
    /// z − 1, without the loss of a difference.
    change: Complex<f64>,
}

impl Turn {
    /// Terms of the frequency ω, rad/s, at a sample time T, s.
    pub fn new(omega: f64, t: f64) -> Self {
        let half = Complex::new(0.0, 0.5 * omega * t).exp();
        let change = Complex::new(0.0, 2.0 * half.im) * half;
        Self { z: Complex::new(0.0, omega * t).exp(), change }
    }

    /// (1 − 1/z)/|1 − 1/z| = j e^{−jωT/2}, for the angle of 1 − 1/z.
    pub(crate) fn lag(&self) -> Complex<f64> {
        let whole = self.change / self.z;
        whole / whole.norm()
    }
}

impl Feedback {
    /// Linear feedback of a design for a model of the axis.
    pub fn new(design: &Design, model: &Machine) -> Result<Self> {
        let text = Text::new(design, model)?;
        let mut system = System::new(&text, model.scale.is_some());
        system.reduce();
        let parts = system.order();
        Ok(Self {
            every: design.every,
            parts,
            row: system.c.iter().copied().collect(),
            inputs: (0..system.b.nrows()).map(|i| std::array::from_fn(|k| system.b[(i, k)])).collect(),
            direct: system.d,
            corners: text.filters.iter().map(|filter: &Biquad| filter.frequency(design.every)).collect(),
            is_linear: text.law.is_linear(),
        })
    }

    /// True if it is linear except for its limit; otherwise results hold for small motions around rest.
    pub fn is_linear(&self) -> bool {
        self.is_linear
    }

    /// At z = e^{jωT}; ω in rad/s, above zero.
    pub fn at(&self, omega: f64) -> Terms {
        self.at_turn(&Turn::new(omega, self.every))
    }

    /// Terms of the feedback for the precomputed terms of a frequency.
    pub(crate) fn at_turn(&self, turn: &Turn) -> Terms {
        let mut sums = self.direct.map(|direct| Complex::new(direct, 0.0));
        self.resolve(turn.change, &mut |state, value| {
            for (sum, input) in sums.iter_mut().zip(&self.inputs[state]) {
                *sum += value * *input;
            }
        });
        // u = H_y y + H_x x + H_i i + H_u u
        let [position, scale, current, command] = sums;
        Terms { position: -position, scale: -scale, current: -current, own: -command + 1.0 }
    }

    /// The row C (z I − A)⁻¹, state by state from the last one; NaN on a pole.
    fn resolve(&self, change: Complex<f64>, each: &mut impl FnMut(usize, Complex<f64>)) {
        const FEW: usize = 24;
        let mut few = [Complex::ZERO; FEW];
        let mut many = Vec::new();
        let n = self.row.len();
        let row = match few.get_mut(..n) {
            Some(few) => few,
            None => {
                many.resize(n, Complex::ZERO);
                &mut many[..]
            }
        };
        row.iter_mut().zip(&self.row).for_each(|(row, c)| row.re = *c);
        let mut end = n;
        for part in self.parts.iter().rev() {
            match part {
                Part::One { pole, of } => {
                    let x = row[end - 1] / (change - pole);
                    of.iter().for_each(|&(j, a)| row[j] += x * a);
                    each(end - 1, x);
                    end -= 1;
                }
                Part::Two { block: [[a, b], [c, d]], of } => {
                    let (first, second) = (row[end - 2], row[end - 1]);
                    // (z I − block)⁻¹ by its adjugate
                    let scale = ((change - a) * (change - d) - b * c).inv();
                    let x = ((change - d) * first + second * *c) * scale;
                    let y = (first * *b + (change - a) * second) * scale;
                    of.iter().for_each(|&(j, [s, t])| row[j] += x * s + y * t);
                    each(end - 2, x);
                    each(end - 1, y);
                    end -= 2;
                }
            }
        }
    }

    /// N_y, N_x, N_i and D, each times ∏ (z − λ) over the poles λ of the controller, without a division: at `change`, z
    /// − 1, and `one` in numbers of any kind.
    pub(crate) fn over_poles<N>(&self, change: N, one: N) -> [N; INPUTS]
    where
        N: Copy + Add<Output = N> + Sub<Output = N> + Mul<Output = N> + Mul<f64, Output = N>,
    {
        // As `resolve`, with everything multiplied by the factors so far.
        let mut sums = self.direct.map(|direct| one * direct);
        let mut row: Vec<N> = self.row.iter().map(|c| one * *c).collect();
        let mut product = one;
        for part in self.parts.iter().rev() {
            let (factor, values) = match part {
                Part::One { pole, .. } => (change - one * *pole, vec![row[row.len() - 1]]),
                Part::Two { block: [[a, b], [c, d]], .. } => {
                    let [.., first, second] = row[..] else { break };
                    let (from_a, from_d) = (change - one * *a, change - one * *d);
                    (from_a * from_d - one * (b * c), vec![from_d * first + second * *c, first * *b + from_a * second])
                }
            };
            let rest = row.len() - values.len();
            sums.iter_mut().for_each(|sum| *sum = *sum * factor);
            for (value, inputs) in values.iter().zip(&self.inputs[rest..]) {
                sums.iter_mut().zip(inputs).for_each(|(sum, input)| *sum = *sum + *value * *input);
            }
            row.truncate(rest);
            row.iter_mut().for_each(|row| *row = *row * factor);
            match part {
                Part::One { of, .. } => of.iter().for_each(|&(j, a)| row[j] = row[j] + values[0] * a),
                Part::Two { of, .. } => {
                    of.iter().for_each(|&(j, [s, t])| row[j] = row[j] + values[0] * s + values[1] * t);
                }
            }
            product = product * factor;
        }
        let [position, scale, current, command] = sums;
        [position * -1.0, scale * -1.0, current * -1.0, product - command]
    }

    /// Poles outside of the unit circle.
    pub fn unstable(&self) -> usize {
        let is_outside = |size: f64| size > 1.0 + OUTSIDE;
        let of = |part: &Part| match part {
            Part::One { pole, .. } => usize::from(is_outside((1.0 + pole).abs())),
            Part::Two { block: [[a, b], [c, d]], .. } => {
                let (half, product) = (0.5 * (a + d), a * d - b * c);
                let root = Complex::new(half * half - product, 0.0).sqrt();
                [root, -root].into_iter().filter(|root| is_outside((root + half + 1.0).norm())).count()
            }
        };
        self.parts.iter().map(of).sum()
    }

    /// True if it uses the scale beside the encoder: N_x is not zero.
    pub(crate) fn uses_scale(&self) -> bool {
        self.uses(SCALE)
    }

    /// True if it closes a current loop: N_i is not zero.
    pub fn uses_current(&self) -> bool {
        self.uses(CURRENT)
    }

    fn uses(&self, input: usize) -> bool {
        self.direct[input] != 0.0 || self.inputs.iter().any(|inputs| inputs[input] != 0.0)
    }

    /// Corner frequencies at which it changes quickly, rad/s.
    pub fn corners(&self) -> Vec<f64> {
        self.corners.clone()
    }
}

/// Linearised law of a controller, with A − I.
struct System {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: [f64; INPUTS],
}

impl System {
    /// Linearises at rest, after the first sample.
    fn new(text: &Text, has_scale: bool) -> Self {
        let n = text.slots.count();
        let rest = text.at_rest(has_scale);
        let mut memory = vec![0.0; n];
        let run = &mut Evaluation::on(&mut memory);
        let given = text.step(run, &rest);
        text.moved(run, 0.0, given);
        let zero = Dual::constant(0.0);
        let still = Reference { position: zero, speed: zero, acceleration: zero, jerk: zero, snap: zero };
        // Direction of one of the states or, after these, of the inputs.
        let along = |direction: usize| {
            let dual = |value: f64, place: usize| Dual { value, slope: f64::from(u8::from(place == direction)) };
            let mut slope = Slope { memory: memory.iter().enumerate().map(|(j, value)| dual(*value, j)).collect() };
            let seen = Observation {
                time: 0.0,
                reference: still,
                ahead: still,
                position: dual(rest.position, n),
                scale: rest.scale.map(|scale| dual(scale, n + SCALE)),
                current: dual(rest.current, n + CURRENT),
            };
            let asked = text.step(&mut slope, &seen);
            // Within the limit the command is unchanged; the command that the axis gets is an input.
            text.moved(&mut slope, Dual::constant(0.0), dual(asked.value, n + COMMAND));
            (asked.slope, slope.memory)
        };
        let mut system =
            Self { a: DMatrix::zeros(n, n), b: DMatrix::zeros(n, INPUTS), c: DMatrix::zeros(1, n), d: [0.0; INPUTS] };
        for direction in 0..n + INPUTS {
            let (asked, memory) = along(direction);
            let column = memory.iter().map(|next| next.slope);
            match direction.checked_sub(n) {
                None => {
                    system.c[direction] = asked;
                    column.enumerate().for_each(|(i, slope)| {
                        system.a[(i, direction)] = if i == direction { slope - 1.0 } else { slope };
                    });
                }
                Some(input) => {
                    system.d[input] = asked;
                    column.enumerate().for_each(|(i, slope)| system.b[(i, input)] = slope);
                }
            }
        }
        system
    }

    /// Removes states that no input affects, and those that do not affect the command.
    fn reduce(&mut self) {
        let n = self.a.nrows();
        let mut moved: Vec<bool> = (0..n).map(|i| self.b.row(i).iter().any(|b| *b != 0.0)).collect();
        let mut shown: Vec<bool> = self.c.iter().map(|c| *c != 0.0).collect();
        let is_tied = |i: usize, j: usize| i != j && self.a[(i, j)] != 0.0;
        spread(&mut moved, &|from, to| is_tied(to, from));
        spread(&mut shown, &|from, to| is_tied(from, to));
        let kept: Vec<usize> = (0..n).filter(|&i| moved[i] && shown[i]).collect();
        self.take(&kept);
    }

    /// Keeps these states only, in this order.
    fn take(&mut self, kept: &[usize]) {
        self.a = self.a.select_rows(kept).select_columns(kept);
        self.b = self.b.select_rows(kept);
        self.c = self.c.select_columns(kept);
    }

    /// Orders states after those that they depend on, transforms mutually dependent ones, and returns the parts.
    fn order(&mut self) -> Vec<Part> {
        let circles = circles(&self.a);
        self.take(&circles.concat());
        let mut begin = 0;
        for circle in &circles {
            if circle.len() > 2 {
                self.turn(begin, circle.len());
            }
            begin += circle.len();
        }
        let a = &self.a;
        let n = a.nrows();
        let mut parts = Vec::new();
        let mut i = 0;
        while i < n {
            if i + 1 < n && a[(i, i + 1)] != 0.0 {
                let before = (0..i).map(|j| (j, [a[(i, j)], a[(i + 1, j)]])).filter(|(_, pair)| *pair != [0.0; 2]);
                let block = [[a[(i, i)], a[(i, i + 1)]], [a[(i + 1, i)], a[(i + 1, i + 1)]]];
                parts.push(Part::Two { block, of: before.collect() });
                i += 2;
            } else {
                let before = (0..i).map(|j| (j, a[(i, j)])).filter(|(_, a)| *a != 0.0);
                parts.push(Part::One { pole: a[(i, i)], of: before.collect() });
                i += 1;
            }
        }
        parts
    }

    /// Transforms `size` mutually dependent states so that their block is lower triangular except for pairs: with S = D
    /// Q, where D balances it by powers of two and (D⁻¹ A D)ᵀ = Q T Qᵀ is the Schur form, S⁻¹ A S = Tᵀ.
    fn turn(&mut self, begin: usize, size: usize) {
        let block = self.a.view((begin, begin), (size, size)).into_owned();
        let scales = balance(&block);
        let block = scaled(&block, &scales);
        let is_finite = block.iter().all(|v| v.is_finite());
        let schur = is_finite.then(|| Schur::try_new(block.transpose(), f64::EPSILON, TURNS)).flatten();
        // NaN if there is no Schur form.
        let none = || (DMatrix::identity(size, size), DMatrix::from_element(size, size, f64::NAN));
        let (q, t) = schur.map_or_else(none, Schur::unpack);
        let scale = DMatrix::from_fn(size, size, |i, j| if i == j { scales[i] } else { 0.0 });
        let back = DMatrix::from_fn(size, size, |i, j| if i == j { 1.0 / scales[i] } else { 0.0 });
        let (there, back) = (scale * &q, q.transpose() * back);
        let columns = self.a.columns(begin, size) * &there;
        self.a.columns_mut(begin, size).copy_from(&columns);
        let rows = &back * self.a.rows(begin, size);
        self.a.rows_mut(begin, size).copy_from(&rows);
        for (i, j) in (0..size).flat_map(|i| (0..size).map(move |j| (i, j))) {
            // Above the diagonal, only pairs are not zero.
            let is_part = j <= i || j == i + 1 && t[(j, i)] != 0.0;
            self.a[(begin + i, begin + j)] = if is_part { t[(j, i)] } else { 0.0 };
        }
        let rows = &back * self.b.rows(begin, size);
        self.b.rows_mut(begin, size).copy_from(&rows);
        let columns = self.c.columns(begin, size) * &there;
        self.c.columns_mut(begin, size).copy_from(&columns);
    }
}

/// Marks everything that can be reached from marked states.
fn spread(marked: &mut [bool], leads: &dyn Fn(usize, usize) -> bool) {
    let mut waiting: Vec<usize> = (0..marked.len()).filter(|&i| marked[i]).collect();
    while let Some(from) = waiting.pop() {
        for (to, mark) in marked.iter_mut().enumerate() {
            if !*mark && leads(from, to) {
                *mark = true;
                waiting.push(to);
            }
        }
    }
}

/// Groups of mutually dependent states, each after those that it depends on.
fn circles(a: &DMatrix<f64>) -> Vec<Vec<usize>> {
    let n = a.nrows();
    let reached = |from: usize| {
        let mut all: Vec<bool> = (0..n).map(|i| i == from).collect();
        spread(&mut all, &|j, i| a[(i, j)] != 0.0);
        all
    };
    let reach: Vec<Vec<bool>> = (0..n).map(reached).collect();
    let mut done = vec![false; n];
    let mut all = Vec::new();
    while let Some(first) = (0..n).find(|&i| !done[i] && (0..n).all(|j| done[j] || !reach[j][i] || reach[i][j])) {
        let circle: Vec<usize> = (0..n).filter(|&j| reach[first][j] && reach[j][first]).collect();
        circle.iter().for_each(|&j| done[j] = true);
        all.push(circle);
    }
    all
}
