//! The linear part of a mode, and its propagation over a step.
//!
//! ```text
//! ẏ = A y + g + B u + Σ_j b_j f_j
//! ```
//!
//! The forces f_j are the nonlinear parts of friction laws and springs; each is a quartic within a step, through its
//! values at the five points of [`super::radau`]. Everything else is exact. An *output* is a quantity that is needed at
//! the nodes: the arguments of the forces, then the guards. With r_m = c Aᵐ for the row c of an output,
//!
//! ```text
//! c y(c_i h) = Σ_m (c_i h)ᵐ/m! r_m y + Σ_m hᵐ⁺¹ r_m b_j ∫ (c_i − σ)ᵐ/m! f_j(σ) dσ
//! ```
//!
//! so that a [`Set`] for a step's length needs no products of matrices: the r_m are computed once for a mode, and the
//! integrals are tables.

use super::radau::{self, DRIVEN, FORCED, FREE, Lane, NODES, POINTS, POWER, POWERS, TERMS};
use crate::mechanism::{BODIES, CURRENTS, DRIVES};
use crate::solve::widest::widest;
use std::sync::OnceLock;

/// Room for coordinates, speeds and currents, a multiple of four.
pub(super) const STATES: usize = (2 * BODIES + CURRENTS).next_multiple_of(4);

/// One number for each of them.
pub(super) type States = [f64; STATES];

/// A quantity that is wanted at the nodes of a step.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Output {
    pub(super) row: States,
    pub(super) input: [f64; DRIVES],
    pub(super) constant: f64,
    /// Value that the forces add to it at once.
    pub(super) source: Vec<f64>,
}

impl Output {
    /// Its value.
    pub(super) fn value(&self, y: &[f64], input: &[f64; DRIVES], forces: &[f64]) -> f64 {
        fn add(sum: f64, weights: &[f64], values: &[f64]) -> f64 {
            weights.iter().zip(values).fold(sum, |sum, (weight, value)| sum + weight * value)
        }
        add(add(add(self.constant, &self.row, y), &self.input, input), &self.source, forces)
    }

    /// Adds what the constant and the inputs add to it at once to the columns of what is known.
    fn put_at_once(&self, size: usize, degree: usize, base: &mut [Lane]) {
        base[size].iter_mut().for_each(|lane| *lane += self.constant);
        for (lanes, at_once) in base[size + 1..].chunks_mut(degree + 1).zip(&self.input) {
            for (lane, power) in lanes.iter_mut().zip(&POWER) {
                lane.iter_mut().zip(power).for_each(|(lane, at)| *lane += at_once * at);
            }
        }
    }
}

/// The equations, by columns and by rows.
pub(super) struct Linear {
    /// Places that are computed with: a multiple of four.
    pub(super) size: usize,
    columns: Vec<States>,
    rows: Vec<States>,
    pub(super) constant: States,
    pub(super) input: [States; DRIVES],
    /// Number of inputs.
    pub(super) inputs: usize,
    pub(super) source: Vec<States>,
    pub(super) outputs: Vec<Output>,
    /// Number of outputs that are arguments of forces.
    pub(super) arguments: usize,
    /// ν: a bound of ‖A‖, 1/s.
    pub(super) norm: f64,
    /// r_m/νᵐ of the arguments, and of the guards.
    series: [OnceLock<Vec<[States; TERMS]>>; 2],
    /// (A/ν)ᵐ b_j.
    moved: OnceLock<Vec<[States; TERMS]>>,
    /// r_m/νᵐ times what drives them, of the arguments, and of the guards: `[output][one, inputs, forces]`.
    moments: [OnceLock<Vec<[f64; TERMS]>>; 2],
}

/// Outputs of one kind.
#[derive(Clone, Copy)]
enum Which {
    Arguments,
    Guards,
}

/// A known force: powers of the share of the step.
pub(super) type Forcing = [States; POWERS];

impl Linear {
    /// Linear part with these columns of A, without outputs.
    pub(super) fn new(size: usize, columns: Vec<States>, constant: States, input: [States; DRIVES]) -> Self {
        let mut rows = vec![[0.0; STATES]; size];
        for (column, values) in columns.iter().enumerate() {
            rows.iter_mut().zip(values).for_each(|(row, value)| row[column] = *value);
        }
        let norm = norm(size, &columns).max(f64::MIN_POSITIVE);
        let (series, moments) = ([const { OnceLock::new() }; 2], [const { OnceLock::new() }; 2]);
        let (source, outputs, arguments) = (Vec::new(), Vec::new(), 0);
        let (moved, inputs) = (OnceLock::new(), DRIVES);
        Self { size, columns, rows, constant, input, inputs, source, outputs, arguments, norm, series, moved, moments }
    }

    /// x, M x/ν, (M/ν)² x, … of several, M being A by its columns or by its rows.
    fn chains<'x>(&self, columns: &[States], list: impl ExactSizeIterator<Item = &'x States>) -> Vec<[States; TERMS]> {
        let mut chains = vec![[[0.0; STATES]; TERMS]; list.len()];
        chains.iter_mut().zip(list).for_each(|(chain, x)| powers(self.size, columns, x, self.norm, chain));
        chains
    }

    /// Rows of the arguments, or of the guards.
    fn rows(&self, which: Which) -> &[[States; TERMS]] {
        let outputs = match which {
            Which::Arguments => &self.outputs[..self.arguments],
            Which::Guards => &self.outputs[self.arguments..],
        };
        let rows = outputs.iter().map(|output| &output.row);
        self.series[which as usize].get_or_init(|| self.chains(&self.rows, rows))
    }

    /// Their moments, each as many as there are drives.
    fn moments(&self, which: Which) -> &[[f64; TERMS]] {
        let columns = std::iter::once(&self.constant).chain(&self.input[..self.inputs]).chain(&self.source);
        // Most of their places are zero.
        let terms = |column: &States| -> Vec<(usize, f64)> {
            column.iter().copied().enumerate().filter(|(_, value)| *value != 0.0).collect()
        };
        let all = || {
            let columns: Vec<_> = columns.map(terms).collect();
            let mut all = vec![[0.0; TERMS]; self.rows(which).len() * columns.len()];
            let each = self.rows(which).iter().flat_map(|rows| columns.iter().map(move |terms| (rows, terms)));
            for (moments, (rows, terms)) in all.iter_mut().zip(each) {
                for &(place, value) in terms {
                    moments.iter_mut().zip(rows).for_each(|(moment, row)| *moment += row[place] * value);
                }
            }
            all
        };
        self.moments[which as usize].get_or_init(all)
    }

    /// Number of driving terms: one, inputs, forces.
    fn drives(&self) -> usize {
        1 + self.inputs + self.source.len()
    }

    fn moved(&self) -> &[[States; TERMS]] {
        self.moved.get_or_init(|| self.chains(&self.columns, self.source.iter()))
    }

    /// Columns of what a step depends on without forces: states, one, inputs and their powers.
    pub(super) fn known(&self, degree: usize) -> usize {
        self.size + 1 + self.inputs * (degree + 1)
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

    widest! {
        /// The states at the share `s` of the step.
        pub(super) fn at(&self, size: usize, s: f64) -> States = at_by_any, at_by_avx2;
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

widest! {
    /// x, M x/ν, (M/ν)² x, …, M given by columns.
    fn powers(size: usize, columns: &[States], x: &States, norm: f64, chain: &mut [States; TERMS])
        = powers_by_any, powers_by_avx2;
}

#[inline(always)]
fn powers_by_any(size: usize, columns: &[States], x: &States, norm: f64, chain: &mut [States; TERMS]) {
    match size {
        8 => powers_of::<8>(columns, x, norm, chain),
        12 => powers_of::<12>(columns, x, norm, chain),
        _ => powers_of::<STATES>(columns, x, norm, chain),
    }
}

#[inline(always)]
fn powers_of<const N: usize>(columns: &[States], x: &States, norm: f64, chain: &mut [States; TERMS]) {
    let factor = 1.0 / norm;
    chain[0] = *x;
    let mut now: [f64; N] = std::array::from_fn(|i| x[i]);
    for to in &mut chain[1..] {
        let mut sum = [0.0; N];
        for (column, value) in columns.iter().zip(now) {
            sum.iter_mut().zip(column).for_each(|(sum, entry)| *sum += entry * value);
        }
        now = sum.map(|sum| sum * factor);
        to[..N].copy_from_slice(&now);
    }
}

/// ‖A⁶⁴‖^(1/64), which hardly depends on the units of the states.
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

/// The matrices of one mode for steps of one length.
pub(super) struct Set {
    pub(super) h: f64,
    /// The highest power of the inputs.
    pub(super) degree: usize,
    /// Change of the arguments at the nodes by the values of the forces at the points, and behind them by ω:
    /// `[argument][source][point]`.
    weights: Vec<[Lane; POINTS + 1]>,
    /// Their change by all else: `[argument][column]`.
    base: Vec<Lane>,
    full: OnceLock<Full>,
}

/// The results of a step by all that it depends on, column by column: states, one, inputs and their powers, then the
/// values of the forces at the points.
pub(super) struct Full {
    /// Rows of the guards: `[guard][column]`.
    guards: Vec<Lane>,
    /// Changes of the states over the whole step.
    pub(super) end: Vec<States>,
    /// Matrices up to each eighth of the step.
    inner: [OnceLock<Vec<States>>; EIGHTHS - 1],
    columns: usize,
    /// Number of columns without the forces.
    pub(super) known: usize,
}

/// Shares of a step at which it is known column by column.
pub(super) const EIGHTHS: usize = 8;

impl Set {
    /// Matrices of a step of length `h` for inputs of this degree.
    pub(super) fn new(linear: &Linear, h: f64, degree: usize) -> Self {
        let (known, drives) = (linear.known(degree), linear.drives());
        let mut base = vec![[0.0; NODES]; linear.arguments * known];
        let mut weights = Vec::with_capacity(linear.arguments * linear.source.len());
        let rows = linear.rows(Which::Arguments).iter().zip(linear.moments(Which::Arguments).chunks(drives));
        for (((rows, moments), base), output) in rows.zip(base.chunks_mut(known)).zip(&linear.outputs) {
            lead(linear, rows, moments, (h, degree), base);
            output.put_at_once(linear.size, degree, base);
            let reach = linear.norm * h;
            let begin = weights.len();
            weights.extend(moments[1 + linear.inputs..].iter().map(|m| driven(m, h, reach, radau::order(reach))));
            for (lanes, at_once) in weights[begin..].iter_mut().zip(&output.source).filter(|(_, by)| **by != 0.0) {
                lanes[1..POINTS].iter_mut().enumerate().for_each(|(node, lane)| lane[node] += at_once);
            }
        }
        Self { h, degree, weights, base, full: OnceLock::new() }
    }

    /// Change of an argument at the nodes by the forces' values at the points.
    #[inline(always)]
    pub(super) fn weights(&self, argument: usize, source: usize, sources: usize) -> &[Lane; POINTS + 1] {
        &self.weights[argument * sources + source]
    }

    /// An argument at the nodes without forces, from the columns of what is known.
    #[inline(always)]
    pub(super) fn base(&self, argument: usize, x: &[f64]) -> Lane {
        sum_of(&self.base[argument * x.len()..][..x.len()], x)
    }

    /// The remaining matrices, computed on first use: the caller has taken enough steps of this length for them to pay.
    pub(super) fn full(&self, linear: &Linear) -> &Full {
        self.full.get_or_init(|| Full::new(linear, self.h, self.degree))
    }
}

/// Σ x_k times column k.
#[inline(always)]
fn sum_of(columns: &[Lane], x: &[f64]) -> Lane {
    let mut sum = [0.0; NODES];
    for (lane, x) in columns.iter().zip(x) {
        sum.iter_mut().zip(lane).for_each(|(sum, lane)| *sum += lane * x);
    }
    sum
}

widest! {
    /// The lanes of c y that states, one, and inputs add, by the rows r_m and their moments.
    fn lead(linear: &Linear, rows: &[States; TERMS], moments: &[[f64; TERMS]], step: (f64, usize), base: &mut [Lane])
        = lead_by_any, lead_by_avx2;
}

#[inline(always)]
fn lead_by_any(
    linear: &Linear,
    rows: &[States; TERMS],
    moments: &[[f64; TERMS]],
    (h, degree): (f64, usize),
    base: &mut [Lane],
) {
    let (reach, order) = (linear.norm * h, radau::order(linear.norm * h));
    let (free, forced) = base.split_at_mut(linear.size);
    for (place, lane) in free.iter_mut().enumerate() {
        let mut factor = 1.0;
        for (row, table) in rows[..=order].iter().zip(&FREE) {
            let weight = factor * row[place];
            lane.iter_mut().zip(table).for_each(|(lane, value)| *lane += weight * value);
            factor *= reach;
        }
    }
    let force = |moments: &[f64; TERMS], power: usize, lane: &mut Lane| {
        let mut factor = h;
        for (moment, table) in moments[..order].iter().zip(&FORCED[power]) {
            let moment = factor * moment;
            lane.iter_mut().zip(table).for_each(|(lane, value)| *lane += moment * value);
            factor *= reach;
        }
    };
    let (one, inputs) = forced.split_at_mut(1);
    force(&moments[0], 0, &mut one[0]);
    for (lanes, moments) in inputs.chunks_mut(degree + 1).zip(&moments[1..]) {
        lanes.iter_mut().enumerate().for_each(|(power, lane)| force(moments, power, lane));
    }
}

widest! {
    /// The lanes of c y that the five values of a force add, and ω, by the moments r_m b/νᵐ.
    fn driven(moments: &[f64; TERMS], h: f64, reach: f64, order: usize) -> [Lane; POINTS + 1]
        = driven_by_any, driven_by_avx2;
}

#[inline(always)]
fn driven_by_any(moments: &[f64; TERMS], h: f64, reach: f64, order: usize) -> [Lane; POINTS + 1] {
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

impl Full {
    fn new(linear: &Linear, h: f64, degree: usize) -> Self {
        let (reach, order) = (linear.norm * h, radau::order(linear.norm * h));
        let (known, drives) = (linear.known(degree), linear.drives());
        let columns = known + linear.source.len() * POINTS;
        let outputs = &linear.outputs[linear.arguments..];
        let mut guards = vec![[0.0; NODES]; outputs.len() * columns];
        let rows = linear.rows(Which::Guards).iter().zip(linear.moments(Which::Guards).chunks(drives));
        for ((output, (rows, moments)), lanes) in outputs.iter().zip(rows).zip(guards.chunks_mut(columns)) {
            let (base, forces) = lanes.split_at_mut(known);
            lead(linear, rows, moments, (h, degree), base);
            output.put_at_once(linear.size, degree, base);
            let forces = forces.as_chunks_mut::<POINTS>().0;
            for ((lanes, moments), at_once) in forces.iter_mut().zip(&moments[1 + linear.inputs..]).zip(&output.source)
            {
                lanes.copy_from_slice(&driven(moments, h, reach, order)[..POINTS]);
                for (node, lane) in lanes[1..].iter_mut().enumerate() {
                    lane[node] += at_once;
                }
            }
        }
        let inner = [const { OnceLock::new() }; EIGHTHS - 1];
        Self { guards, end: Self::ends(linear, h, degree, columns), inner, columns, known }
    }

    /// The states after `eighth` eighths of a step of this length, from those at its beginning.
    pub(super) fn at_eighth(&self, linear: &Linear, (h, degree): (f64, usize), eighth: usize, x: &[f64]) -> States {
        let columns = self.inner[eighth - 1].get_or_init(|| self.inner(linear, (h, degree), eighth));
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { moved_by_avx2(linear.size, columns, x) };
        }
        moved(linear.size, columns, x)
    }

    fn inner(&self, linear: &Linear, (h, degree): (f64, usize), eighth: usize) -> Vec<States> {
        let (share, mut series) = (eighth as f64 / EIGHTHS as f64, Series::room());
        let mut change = |y: &States, forcing: &[States]| {
            linear.series(y, h, forcing, &mut series);
            let mut sum = series.at(linear.size, share);
            sum.iter_mut().zip(y).for_each(|(sum, y)| *sum -= y);
            sum
        };
        let mut columns = Vec::with_capacity(self.columns);
        for place in 0..linear.size {
            let mut y = [0.0; STATES];
            y[place] = 1.0;
            columns.push(change(&y, &[]));
        }
        let zero = [0.0; STATES];
        columns.push(change(&zero, &[linear.constant]));
        for column in &linear.input[..linear.inputs] {
            for power in 0..=degree {
                let mut forcing: Forcing = [zero; POWERS];
                forcing[power] = *column;
                columns.push(change(&zero, &forcing[..=power]));
            }
        }
        for column in &linear.source {
            for point in 0..POINTS {
                columns.push(change(&zero, &radau::MONOMIALS.map(|row| column.map(|value| row[point] * value))));
            }
        }
        columns
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

    /// A guard at the nodes.
    #[inline(always)]
    pub(super) fn guard(&self, guard: usize, x: &[f64]) -> Lane {
        sum_of(&self.guards[guard * self.columns..][..self.columns], x)
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

/// States moved on by the columns of a place within a step.
#[inline(always)]
fn moved(size: usize, columns: &[States], x: &[f64]) -> States {
    let mut sum = [0.0; STATES];
    sum[..size].copy_from_slice(&x[..size]);
    for (column, x) in columns.iter().zip(x) {
        sum[..size].iter_mut().zip(column).for_each(|(sum, value)| *sum += value * x);
    }
    sum
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn moved_by_avx2(size: usize, columns: &[States], x: &[f64]) -> States {
    match size {
        8 => moved(8, columns, x),
        12 => moved(12, columns, x),
        _ => moved(size, columns, x),
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
        let full = set.full(&linear);
        let mut x = vec![0.0; full.end.len()];
        (x[0], x[1], x[8]) = (y[0], y[1], 1.0);
        x[9..12].copy_from_slice(&u);
        // Behind the three powers of each input.
        let forced = 9 + 3 * DRIVES;
        x[forced..forced + POINTS].copy_from_slice(&f);
        let mut end = y;
        full.advance::<8>(&mut end, &x);
        for node in 0..NODES {
            let at = series.at(8, radau::C[node]);
            let (want, c) = (0.7 * at[0] + at[1], radau::C[node]);
            let forces = (0..POINTS).fold(0.0, |sum, p| sum + set.weights(0, 0, 1)[p][node] * f[p]);
            assert!((set.base(0, &x[..forced])[node] + forces - want).abs() < 1e-14, "node {node}");
            let guard = want + 0.1 * (u[0] + c * (u[1] + c * u[2])) + 0.2 + 0.5 * f[node + 1];
            assert!((full.guard(0, &x)[node] - guard).abs() < 1e-14, "node {node}");
            if node == NODES - 1 {
                assert!((end[0] - at[0]).abs() < 1e-14 && (end[1] - at[1]).abs() < 1e-14);
            }
        }
        let quarter = full.at_eighth(&linear, (h, 2), 2, &x);
        let want = series.at(8, 0.25);
        assert!((quarter[0] - want[0]).abs() < 1e-14 && (quarter[1] - want[1]).abs() < 1e-14);
    }

    /// A vibration of 1000/s and a decay of 3000/s that it drives, with lengths in any unit; and a chain.
    #[test]
    fn the_norm_is_about_the_fastest_rate_in_any_unit() {
        for unit in [1.0, 1e-3, 1e3] {
            let mut columns = vec![[0.0; STATES]; 8];
            (columns[1][0], columns[0][1], columns[1][1]) = (1.0 / unit, -1e6 * unit, -2.0);
            (columns[1][2], columns[2][2]) = (5.0, -3000.0);
            let found = norm(8, &columns);
            assert!((3000.0..4000.0).contains(&found), "{unit}: {found}");
        }
        let mut columns = vec![[0.0; STATES]; 8];
        columns[1][0] = 4.0;
        assert_eq!(norm(8, &columns), 2.0);
    }
}
