//! The linear part of a mode, and what a step of some length makes of it.
//!
//! ```text
//! ẏ = A y + g + B u + Σ_j b_j f_j
//! ```
//!
//! The forces f_j are what friction laws and springs add; each is a quartic within a step, told by its values at the
//! five points of [`super::radau`]. All else is exact. An *output* is a quantity that is wanted at the nodes: the
//! arguments of the forces, then the guards. With r_m = c Aᵐ, c being an output's row,
//!
//! ```text
//! c y(c_i h) = Σ_m (c_i h)ᵐ/m! r_m y + Σ_m hᵐ⁺¹ r_m b_j ∫ (c_i − σ)ᵐ/m! f_j(σ) dσ
//! ```
//!
//! so that a [`Set`] for a step's length takes no products of matrices: the r_m are made once for a mode, and the
//! integrals are tables.

use super::radau::{self, DRIVEN, FORCED, FREE, Lane, NODES, POINTS, POWER, POWERS, TERMS};
use crate::mechanism::{BODIES, DRIVES};
use std::sync::OnceLock;

/// Room for coordinates, speeds and currents, a multiple of four.
pub(super) const STATES: usize = (2 * BODIES + DRIVES).next_multiple_of(4);

/// One number for each of them.
pub(super) type States = [f64; STATES];

/// A quantity that is wanted at the nodes of a step.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Output {
    pub(super) row: States,
    pub(super) input: [f64; DRIVES],
    pub(super) constant: f64,
    /// What the forces add to it at once.
    pub(super) source: Vec<f64>,
}

/// The equations, by columns and by rows.
pub(super) struct Linear {
    /// Places that are computed with: a multiple of four.
    pub(super) size: usize,
    columns: Vec<States>,
    rows: Vec<States>,
    pub(super) constant: States,
    pub(super) input: [States; DRIVES],
    /// How many inputs there are.
    pub(super) inputs: usize,
    pub(super) source: Vec<States>,
    pub(super) outputs: Vec<Output>,
    /// How many of them are arguments of forces.
    pub(super) arguments: usize,
    /// ν: a bound of ‖A‖, 1/s.
    pub(super) norm: f64,
    /// r_m/νᵐ of the arguments, and of the guards.
    series: [OnceLock<Vec<[States; TERMS]>>; 2],
    /// (A/ν)ᵐ b_j.
    moved: OnceLock<Vec<[States; TERMS]>>,
    /// r_m b_j/νᵐ of the arguments: `[argument][source]`.
    moments: OnceLock<Vec<[f64; TERMS]>>,
    /// The same of all outputs with all that drives them: `[output][one, inputs, sources]`.
    driven: OnceLock<Vec<[f64; TERMS]>>,
}

/// A known force: powers of the share of the step.
pub(super) type Forcing = [States; POWERS];

impl Linear {
    /// That of these columns of A, with nothing wanted yet.
    pub(super) fn new(size: usize, columns: Vec<States>, constant: States, input: [States; DRIVES]) -> Self {
        let mut rows = vec![[0.0; STATES]; size];
        for (column, values) in columns.iter().enumerate() {
            rows.iter_mut().zip(values).for_each(|(row, value)| row[column] = *value);
        }
        let norm = norm(size, &columns).max(f64::MIN_POSITIVE);
        let series = [const { OnceLock::new() }; 2];
        let (source, outputs, arguments) = (Vec::new(), Vec::new(), 0);
        let (moved, moments, driven) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
        let inputs = DRIVES;
        Self {
            size,
            columns,
            rows,
            constant,
            input,
            inputs,
            source,
            outputs,
            arguments,
            norm,
            series,
            moved,
            moments,
            driven,
        }
    }

    /// c A/ν, then c (A/ν)², and so on, for each of `outputs`.
    fn rows_of(&self, outputs: &[Output]) -> Vec<[States; TERMS]> {
        let of = |output: &Output| powers(self.size, &self.rows, &output.row, self.norm);
        outputs.iter().map(of).collect()
    }

    fn of_arguments(&self) -> &[[States; TERMS]] {
        self.series[0].get_or_init(|| self.rows_of(&self.outputs[..self.arguments]))
    }

    fn moments(&self) -> &[[f64; TERMS]] {
        let of = |rows: &[States; TERMS], source: &States| rows.each_ref().map(|row| dot(self.size, row, source));
        let all = || self.of_arguments().iter().flat_map(|rows| self.source.iter().map(move |source| of(rows, source)));
        self.moments.get_or_init(|| all().collect())
    }

    /// r_m/νᵐ times the column of each drive of an output: of one, of the inputs, of the forces.
    fn driven(&self, output: usize) -> &[[f64; TERMS]] {
        let drives = 1 + self.inputs + self.source.len();
        let columns = || std::iter::once(&self.constant).chain(&self.input[..self.inputs]).chain(&self.source);
        let rows = || self.of_arguments().iter().chain(self.of_guards());
        let of = |rows: &[States; TERMS], column: &States| rows.each_ref().map(|row| dot(self.size, row, column));
        let all = || rows().flat_map(|rows| columns().map(move |column| of(rows, column)));
        &self.driven.get_or_init(|| all().collect())[output * drives..][..drives]
    }

    fn of_guards(&self) -> &[[States; TERMS]] {
        self.series[1].get_or_init(|| self.rows_of(&self.outputs[self.arguments..]))
    }

    fn moved(&self) -> &[[States; TERMS]] {
        let of = |column: &States| powers(self.size, &self.columns, column, self.norm);
        self.moved.get_or_init(|| self.source.iter().map(of).collect())
    }

    /// ẏ under these inputs and forces.
    pub(super) fn rate(&self, y: &[f64], input: &[f64; DRIVES], forces: &[f64]) -> States {
        let mut rate = self.constant;
        let columns =
            self.columns.iter().zip(y).chain(self.input.iter().zip(input)).chain(self.source.iter().zip(forces));
        for (column, factor) in columns {
            rate.iter_mut().zip(column).for_each(|(rate, value)| *rate += factor * value);
        }
        rate
    }

    /// The series of y over `h` under `forcing`, which is in powers of the share of h: t_{k+1} = (A t_k + F_k) h/(k+1).
    pub(super) fn series(&self, y: &States, h: f64, forcing: &[States], terms: &mut Series) {
        terms.order = radau::order(self.norm * h);
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.series_by_avx2(y, h, forcing, terms) };
        }
        self.series_by_any(y, h, forcing, terms);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn series_by_avx2(&self, y: &States, h: f64, forcing: &[States], terms: &mut Series) {
        self.series_by_any(y, h, forcing, terms);
    }

    #[inline(always)]
    fn series_by_any(&self, y: &States, h: f64, forcing: &[States], terms: &mut Series) {
        match self.size {
            8 => self.series_of::<8>(y, h, forcing, terms),
            12 => self.series_of::<12>(y, h, forcing, terms),
            _ => self.series_of::<STATES>(y, h, forcing, terms),
        }
    }

    #[inline(always)]
    fn series_of<const N: usize>(&self, y: &States, h: f64, forcing: &[States], terms: &mut Series) {
        let mut now: [f64; N] = std::array::from_fn(|i| y[i]);
        terms.terms[0][..N].copy_from_slice(&now);
        for k in 0..terms.order {
            let mut sum: [f64; N] = match forcing.get(k) {
                Some(forcing) => std::array::from_fn(|i| forcing[i]),
                None => [0.0; N],
            };
            for (column, factor) in self.columns[..N].iter().zip(now) {
                for (sum, value) in sum.iter_mut().zip(column) {
                    *sum += value * factor;
                }
            }
            let factor = h / (k + 1) as f64;
            now = sum.map(|sum| sum * factor);
            terms.terms[k + 1][..N].copy_from_slice(&now);
        }
    }
}

/// The series of the states over a step.
#[derive(Clone)]
pub(super) struct Series {
    pub(super) terms: [States; TERMS],
    pub(super) order: usize,
}

impl Series {
    pub(super) fn room() -> Self {
        Self { terms: [[0.0; STATES]; TERMS], order: 0 }
    }

    /// The states at the share `s` of the step.
    pub(super) fn at(&self, size: usize, s: f64) -> States {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.at_by_avx2(size, s) };
        }
        self.at_by_any(size, s)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn at_by_avx2(&self, size: usize, s: f64) -> States {
        self.at_by_any(size, s)
    }

    #[inline(always)]
    fn at_by_any(&self, size: usize, s: f64) -> States {
        match size {
            8 => self.at_of::<8>(s),
            12 => self.at_of::<12>(s),
            _ => self.at_of::<STATES>(s),
        }
    }

    /// Σ t_k sᵏ = t_0 + s (O(s²) + s E(s²)): the chains of odd and even powers do not wait for each other.
    #[inline(always)]
    fn at_of<const N: usize>(&self, s: f64) -> States {
        let (mut odd, mut even, square) = ([0.0; N], [0.0; N], s * s);
        let pairs = self.terms[1..=self.order].chunks_exact(2);
        if let [last] = pairs.remainder() {
            odd.copy_from_slice(&last[..N]);
        }
        for pair in pairs.rev() {
            for i in 0..N {
                odd[i] = odd[i] * square + pair[0][i];
                even[i] = even[i] * square + pair[1][i];
            }
        }
        let mut sum = self.terms[0];
        for i in 0..N {
            sum[i] += s * (odd[i] + s * even[i]);
        }
        sum
    }

    /// A linear form of the states along it: coefficients of the powers of s, from the first on.
    pub(super) fn along(&self, size: usize, row: &States, coefficients: &mut [f64; TERMS]) {
        coefficients.fill(0.0);
        for (place, weight) in row[..size].iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
            for (coefficient, term) in coefficients[..=self.order].iter_mut().zip(&self.terms) {
                *coefficient += weight * term[place];
            }
        }
    }
}

/// x, M x/ν, (M/ν)² x, …, M given by columns.
fn powers(size: usize, columns: &[States], x: &States, norm: f64) -> [States; TERMS] {
    match size {
        8 => powers_of::<8>(columns, x, norm),
        12 => powers_of::<12>(columns, x, norm),
        _ => powers_of::<STATES>(columns, x, norm),
    }
}

fn powers_of<const N: usize>(columns: &[States], x: &States, norm: f64) -> [States; TERMS] {
    let mut list = [[0.0; STATES]; TERMS];
    let factor = 1.0 / norm;
    list[0] = *x;
    let mut now: [f64; N] = std::array::from_fn(|i| x[i]);
    for to in &mut list[1..] {
        let mut sum = [0.0; N];
        for (column, value) in columns.iter().zip(now) {
            sum.iter_mut().zip(column).for_each(|(sum, entry)| *sum += entry * value);
        }
        now = sum.map(|sum| sum * factor);
        to[..N].copy_from_slice(&now);
    }
    list
}

/// ‖A⁶⁴‖^(1/64): so high a power does not know the units of what it couples.
fn norm(size: usize, columns: &[States]) -> f64 {
    match size {
        8 => norm_of::<8>(columns),
        12 => norm_of::<12>(columns),
        _ => norm_of::<STATES>(columns),
    }
}

fn norm_of<const N: usize>(columns: &[States]) -> f64 {
    let most = |columns: &[[f64; N]; N]| columns.iter().flatten().fold(0.0, |most: f64, entry| most.max(entry.abs()));
    let mut power = [[0.0; N]; N];
    for (own, column) in power.iter_mut().zip(columns) {
        own.copy_from_slice(&column[..N]);
    }
    let scale = most(&power);
    if scale == 0.0 || !scale.is_finite() {
        return scale;
    }
    // Each square by its own scale, so that nothing overflows: A⁴ = ((A/a)²/b)² a⁴ b²
    power = power.map(|column| column.map(|entry| entry / scale));
    let (mut logarithm, mut share) = (scale.ln(), 1.0);
    for _ in 0..6 {
        let mut squared = [[0.0; N]; N];
        for (to, column) in squared.iter_mut().zip(&power) {
            for (other, factor) in power.iter().zip(column).filter(|(_, factor)| **factor != 0.0) {
                to.iter_mut().zip(other).for_each(|(sum, entry)| *sum += entry * factor);
            }
        }
        share *= 0.5;
        let own = most(&squared);
        if own == 0.0 {
            // A chain that ends: its few powers are all that there is.
            return scale.sqrt();
        }
        logarithm += share * own.ln();
        power = squared.map(|column| column.map(|entry| entry / own));
    }
    // The largest row is as long as it has places, at most.
    (logarithm + share * (N as f64).ln()).exp()
}

/// What a step of one length makes of a mode.
pub(super) struct Set {
    pub(super) h: f64,
    /// The highest power of the inputs.
    pub(super) degree: usize,
    /// What the values of the forces at the points do to the arguments at the nodes, and behind them what ω does:
    /// `[argument][source][point]`.
    weights: Vec<[Lane; POINTS + 1]>,
    full: OnceLock<Full>,
}

/// What a step makes of all that it depends on, column by column: states, one, inputs and their powers, then the values
/// of the forces at the points.
pub(super) struct Full {
    /// `[output][column]`
    nodes: Vec<Lane>,
    pub(super) end: Vec<States>,
    columns: usize,
    /// How many of them there are without the forces.
    pub(super) known: usize,
}

impl Set {
    /// That of a step of length `h` under inputs of this degree.
    pub(super) fn new(linear: &Linear, h: f64, degree: usize) -> Self {
        let order = radau::order(linear.norm * h);
        let weights = linear.moments().iter().map(|moments| driven(moments, h, linear.norm * h, order)).collect();
        Self { h, degree, weights, full: OnceLock::new() }
    }

    /// What the forces' values at the points do to an argument at the nodes.
    #[inline(always)]
    pub(super) fn weights(&self, argument: usize, source: usize, sources: usize) -> &[Lane; POINTS + 1] {
        &self.weights[argument * sources + source]
    }

    /// The rest of it, where it is there already, or `wanted`.
    pub(super) fn full(&self, linear: &Linear, wanted: bool) -> Option<&Full> {
        match wanted {
            true => Some(self.full.get_or_init(|| Full::new(linear, self.h, self.degree))),
            false => self.full.get(),
        }
    }
}

/// The lanes of c y that the five values of a force add, and ω, by the moments r_m b/νᵐ.
fn driven(moments: &[f64; TERMS], h: f64, reach: f64, order: usize) -> [Lane; POINTS + 1] {
    let mut lanes = [[0.0; NODES]; POINTS + 1];
    let mut factor = h;
    for (moment, tables) in moments.iter().zip(&DRIVEN).take(order) {
        // hᵐ⁺¹ c Aᵐ b
        let moment = factor * moment;
        for (lane, table) in lanes.iter_mut().zip(tables) {
            lane.iter_mut().zip(table).for_each(|(lane, value)| *lane += moment * value);
        }
        factor *= reach;
    }
    lanes
}

fn dot(size: usize, a: &States, b: &States) -> f64 {
    a[..size].iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

impl Full {
    fn new(linear: &Linear, h: f64, degree: usize) -> Self {
        let (size, reach, order) = (linear.size, linear.norm * h, radau::order(linear.norm * h));
        let known = size + 1 + linear.inputs * (degree + 1);
        let columns = known + linear.source.len() * POINTS;
        let mut nodes = vec![[0.0; NODES]; linear.outputs.len() * columns];
        let rows = linear.of_arguments().iter().chain(linear.of_guards());
        for (index, (rows, nodes)) in rows.zip(nodes.chunks_mut(columns)).enumerate() {
            let (output, moments) = (&linear.outputs[index], linear.driven(index));
            let (free, forced) = nodes.split_at_mut(size);
            let mut factor = 1.0;
            for (row, table) in rows.iter().zip(&FREE).take(order + 1) {
                for (lane, weight) in free.iter_mut().zip(row) {
                    let weight = factor * weight;
                    lane.iter_mut().zip(table).for_each(|(lane, value)| *lane += weight * value);
                }
                factor *= reach;
            }
            let force = |moments: &[f64; TERMS], power: usize, lane: &mut Lane| {
                let mut factor = h;
                for (moment, table) in moments.iter().zip(&FORCED[power]).take(order) {
                    let moment = factor * moment;
                    lane.iter_mut().zip(table).for_each(|(lane, value)| *lane += moment * value);
                    factor *= reach;
                }
            };
            force(&moments[0], 0, &mut forced[0]);
            forced[0].iter_mut().for_each(|lane| *lane += output.constant);
            for drive in 0..linear.inputs {
                for power in 0..=degree {
                    let lane = &mut forced[1 + drive * (degree + 1) + power];
                    force(&moments[1 + drive], power, lane);
                    lane.iter_mut().zip(&POWER[power]).for_each(|(lane, at)| *lane += output.input[drive] * at);
                }
            }
            let forces = forced[known - size..].as_chunks_mut::<POINTS>().0;
            for ((lanes, moments), at_once) in forces.iter_mut().zip(&moments[1 + linear.inputs..]).zip(&output.source)
            {
                lanes.copy_from_slice(&driven(moments, h, reach, order)[..POINTS]);
                for (node, lane) in lanes[1..].iter_mut().enumerate() {
                    lane[node] += at_once;
                }
            }
        }
        Self { nodes, end: Self::ends(linear, h, degree, columns), columns, known }
    }

    /// The changes of the states over the whole step.
    fn ends(linear: &Linear, h: f64, degree: usize, columns: usize) -> Vec<States> {
        let size = linear.size;
        let mut end = Vec::with_capacity(columns);
        let mut series = Series::room();
        let mut change = |y: &States, forcing: &[States]| {
            linear.series(y, h, forcing, &mut series);
            let mut sum = [0.0; STATES];
            for term in series.terms[1..=series.order].iter().rev() {
                sum[..size].iter_mut().zip(term).for_each(|(sum, term)| *sum += term);
            }
            sum
        };
        let none: Forcing = [[0.0; STATES]; POWERS];
        for place in 0..size {
            let mut y = [0.0; STATES];
            y[place] = 1.0;
            end.push(change(&y, &[]));
        }
        let zero = [0.0; STATES];
        let mut forced = |column: &States, power: usize| {
            let mut forcing = none;
            forcing[power] = *column;
            change(&zero, &forcing[..=power])
        };
        end.push(forced(&linear.constant, 0));
        for column in &linear.input[..linear.inputs] {
            end.extend((0..=degree).map(|power| forced(column, power)));
        }
        let (reach, order) = (linear.norm * h, radau::order(linear.norm * h));
        for moved in linear.moved() {
            let (mut sums, mut factor) = ([[0.0; STATES]; POINTS], h);
            for (moved, tables) in moved.iter().zip(&DRIVEN).take(order) {
                for (sum, table) in sums.iter_mut().zip(tables) {
                    let weight = factor * table[NODES - 1];
                    sum[..size].iter_mut().zip(moved).for_each(|(sum, moved)| *sum += weight * moved);
                }
                factor *= reach;
            }
            end.extend(sums);
        }
        end
    }

    /// An output at the nodes, from the first `columns` columns.
    #[inline(always)]
    pub(super) fn output(&self, output: usize, x: &[f64]) -> Lane {
        let begin = output * self.columns;
        let mut sum = [0.0; NODES];
        for (lane, x) in self.nodes[begin..begin + self.columns].iter().zip(x) {
            sum.iter_mut().zip(lane).for_each(|(sum, lane)| *sum += lane * x);
        }
        sum
    }

    /// The states at the end.
    #[inline(always)]
    pub(super) fn advance<const N: usize>(&self, y: &mut States, x: &[f64]) {
        let mut sum = [0.0; N];
        for (column, x) in self.end.iter().zip(x) {
            sum.iter_mut().zip(column).for_each(|(sum, value)| *sum += value * x);
        }
        y.iter_mut().zip(sum).for_each(|(y, sum)| *y += sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mass on a spring, driven: a step of any length gives what the series gives.
    #[test]
    fn a_set_and_a_series_are_the_same_step() {
        let mut columns = vec![[0.0; STATES]; 8];
        (columns[1][0], columns[0][1], columns[1][1]) = (1.0, -9.0, -0.4);
        let (mut constant, mut input) = ([0.0; STATES], [[0.0; STATES]; DRIVES]);
        (constant[1], input[0][1]) = (0.3, 2.0);
        let mut linear = Linear::new(8, columns, constant, input);
        assert!((3.0..4.5).contains(&linear.norm), "{}", linear.norm);
        let mut source = [0.0; STATES];
        source[1] = -1.5;
        linear.source = vec![source];
        let mut row = [0.0; STATES];
        (row[0], row[1]) = (0.7, 1.0);
        let mut on_input = [0.0; DRIVES];
        on_input[0] = 0.1;
        linear.outputs = vec![
            Output { row, input: [0.0; DRIVES], constant: 0.0, source: vec![0.0] },
            Output { row, input: on_input, constant: 0.2, source: vec![0.5] },
        ];
        linear.arguments = 1;
        let h = 0.9;
        let (mut y, u, f) = ([0.0; STATES], [0.4, -0.2, 0.7], [0.1, 0.3, -0.2, 0.5, 0.9]);
        (y[0], y[1]) = (0.2, -1.0);
        let monomial = |k: usize| (0..POINTS).fold(0.0, |sum, p| sum + radau::MONOMIALS[k][p] * f[p]);
        let mut forcing = [[0.0; STATES]; POWERS];
        forcing[0][1] = 0.3;
        for (k, forcing) in forcing.iter_mut().enumerate().take(POINTS) {
            forcing[1] += 2.0 * u.get(k).unwrap_or(&0.0) - 1.5 * monomial(k);
        }
        let mut series = Series::room();
        linear.series(&y, h, &forcing, &mut series);
        let set = Set::new(&linear, h, 2);
        let full = set.full(&linear, true).unwrap();
        let mut x = vec![0.0; full.end.len()];
        (x[0], x[1], x[8]) = (y[0], y[1], 1.0);
        x[9..12].copy_from_slice(&u);
        x[15..20].copy_from_slice(&f);
        let mut end = y;
        full.advance::<8>(&mut end, &x);
        for node in 0..NODES {
            let at = series.at(8, radau::C[node]);
            let (want, c) = (0.7 * at[0] + at[1], radau::C[node]);
            assert!((full.output(0, &x)[node] - want).abs() < 1e-14, "node {node}");
            let guard = want + 0.1 * (u[0] + c * (u[1] + c * u[2])) + 0.2 + 0.5 * f[node + 1];
            assert!((full.output(1, &x)[node] - guard).abs() < 1e-14, "node {node}");
            if node == NODES - 1 {
                assert!((end[0] - at[0]).abs() < 1e-14 && (end[1] - at[1]).abs() < 1e-14);
            }
        }
        let own: f64 = (0..POINTS).map(|p| set.weights(0, 0, 1)[p][2] * f[p]).sum();
        let without: f64 = full.output(0, &x)[2] - full.output(0, &x[..15])[2];
        assert!((own - without).abs() < 1e-15);
    }
}
