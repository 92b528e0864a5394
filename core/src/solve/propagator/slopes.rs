//! Derivatives of matrix exponentials with respect to a parameter of the matrix.
//!
//! With z(t + h) = z + P z, P = e^{A h} − I, the derivative of z by a parameter moves by
//!
//! ```text
//! S ← S + P S + L z        L = ∂P/∂p, the Fréchet derivative of the exponential at A h along A_p h
//! L(2h) = 2 L + L P + P L
//! ```
//!
//! If A_p acts on constants only (dry friction, gravity, a held input), L has the columns of those constants alone:
//! l(2h) = 2 l + P l.

use super::{EXPONENTIAL_ORDER, EXPONENTIAL_REACH, Matrix, RECIPROCAL_FACTORIAL, Series};
use crate::solve::widest::widest;

/// The nonzero columns of a sparse matrix.
#[derive(Debug, Clone, Default)]
pub(crate) struct Columns<const N: usize>(pub(crate) Vec<(usize, [f64; N])>);

impl<const N: usize> Columns<N> {
    /// Slopes of a matrix.
    fn new(matrix: &Matrix<N, N>) -> Self {
        let columns = matrix.column.iter().enumerate();
        Self(columns.filter(|(_, column)| column.iter().any(|c| *c != 0.0)).map(|(at, c)| (at, *c)).collect())
    }

    fn matrix(&self) -> Matrix<N, N> {
        let mut matrix = Matrix::zero();
        self.0.iter().for_each(|(at, column)| matrix.column[*at] = *column);
        matrix
    }

    /// The product with a vector, added to `sum`.
    #[inline(always)]
    fn add_times(&self, z: &[f64; N], sum: &mut [f64; N]) {
        for (at, column) in &self.0 {
            let factor = z[*at];
            sum.iter_mut().zip(column).for_each(|(sum, c)| *sum += c * factor);
        }
    }
}

/// Change of a linear system and of its derivatives over one time.
pub(crate) struct SlopedStep<const N: usize> {
    step: Matrix<N, N>,
    /// L of each parameter.
    slopes: Vec<Columns<N>>,
    /// True if nothing moves.
    is_still: bool,
}

impl<const N: usize> Matrix<N, N> {
    /// e^{A d} − I with A = `self`, and its derivatives for the derivatives `slopes` of A; `speed` is a bound of ‖A‖.
    pub(crate) fn sloped_step(&self, slopes: &[Columns<N>], d: f64, speed: f64) -> SlopedStep<N> {
        let halvings = (speed * d / EXPONENTIAL_REACH).log2().ceil().clamp(0.0, 60.0) as i32;
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.sloped_step_by_avx2(slopes, d, halvings) };
        }
        self.sloped_step_by_any(slopes, d, halvings)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn sloped_step_by_avx2(&self, slopes: &[Columns<N>], d: f64, halvings: i32) -> SlopedStep<N> {
        self.sloped_step_by_any(slopes, d, halvings)
    }

    #[inline(always)]
    fn sloped_step_by_any(&self, slopes: &[Columns<N>], d: f64, halvings: i32) -> SlopedStep<N> {
        let h = d * 0.5_f64.powi(halvings);
        let powers = Powers::new(self.scaled(h));
        // P at h, 2h, 4h … d
        let mut steps = vec![powers.exponential()];
        for level in 0..halvings as usize {
            let doubled = steps[level].doubled_by_any();
            steps.push(doubled);
        }
        let (step, before) = steps.split_last().expect("at least one");
        let is_constant = |at: usize| self.column.iter().all(|column| column[at] == 0.0);
        let mut moved = Vec::with_capacity(slopes.len());
        // No closure, since those are not compiled for the vectors of the function that they are in.
        for of in slopes {
            let mut columns = Vec::with_capacity(of.0.len());
            if of.0.iter().all(|(at, _)| is_constant(*at)) {
                for (at, column) in &of.0 {
                    columns.push((*at, powers.constant(&column.map(|c| c * h), before)));
                }
                moved.push(Columns(columns));
                continue;
            }
            let mut slope = powers.slope(&of.matrix().scaled(h));
            for step in before {
                // L(2h) = 2 L + L P + P L
                let mut doubled = slope.scaled(2.0);
                doubled.add(&slope.product(step));
                doubled.add(&step.product(&slope));
                slope = doubled;
            }
            moved.push(Columns::new(&slope));
        }
        let is_still = step.column == [[0.0; N]; N] && moved.iter().all(|slope| slope.0.is_empty());
        SlopedStep { slopes: moved, step: step.clone(), is_still }
    }

    #[inline(always)]
    fn add(&mut self, other: &Self) {
        self.column.iter_mut().flatten().zip(other.column.iter().flatten()).for_each(|(own, other)| *own += other);
    }

    widest! {
        /// Advances each of `s` along `series` of length `distance`, up to its fraction `part`, with the derivatives
        /// `slopes` of A, which are zero beyond the last: T_k = d/k (A T_{k−1} + A_p z_{k−1}).
        pub(crate) fn add_slopes(&self, slopes: &[Columns<N>], along: (&Series<N>, f64, f64), s: &mut [[f64; N]])
            = add_slopes_by_any, add_slopes_by_avx2;
    }

    #[inline(always)]
    fn add_slopes_by_any(
        &self,
        slopes: &[Columns<N>],
        (series, distance, part): (&Series<N>, f64, f64),
        s: &mut [[f64; N]],
    ) {
        let mut terms = s.to_vec();
        // z_{k−1} partᵏ⁻¹, updated in each step
        let (mut power, d) = (1.0, distance * part);
        for (k, z) in series.terms[..=series.order].iter().enumerate() {
            let factor = d / (k + 1) as f64;
            // One term of each parameter after the other: none waits for the one before.
            for (j, (term, s)) in terms.iter_mut().zip(&mut *s).enumerate() {
                let mut next = self.times(term);
                let mut beside = [0.0; N];
                if let Some(slope) = slopes.get(j) {
                    slope.add_times(z, &mut beside);
                }
                for ((term, next), beside) in term.iter_mut().zip(&mut next).zip(beside) {
                    *term = factor * (*next + power * beside);
                }
                s.iter_mut().zip(&*term).for_each(|(s, term)| *s += term);
            }
            power *= part;
        }
    }
}

impl<const N: usize> SlopedStep<N> {
    /// S ← S + P S + L z for each of `s`, with z at the beginning of the step; those beyond the last L have no L.
    pub(crate) fn advance(&self, z: &[f64; N], s: &mut [[f64; N]]) {
        if !self.is_still {
            self.move_on(z, s);
        }
    }

    widest! {
        /// [`SlopedStep::advance`] where something moves.
        fn move_on(&self, z: &[f64; N], s: &mut [[f64; N]]) = move_on_by_any, move_on_by_avx2;
    }

    #[inline(always)]
    fn move_on_by_any(&self, z: &[f64; N], s: &mut [[f64; N]]) {
        for (j, s) in s.iter_mut().enumerate() {
            let mut change = self.step.times(s);
            if let Some(slope) = self.slopes.get(j) {
                slope.add_times(z, &mut change);
            }
            s.iter_mut().zip(change).for_each(|(s, change)| *s += change);
        }
    }
}

/// X, X² and X³ of a matrix with ‖X‖ ≤ [`EXPONENTIAL_REACH`], and partial sums of e^X − I.
struct Powers<const N: usize> {
    powers: [Matrix<N, N>; 3],
    /// Sums of the series from X¹⁰, X⁷ and X⁴ on, each divided by the power before: the factors of X³.
    rests: [Matrix<N, N>; 3],
}

impl<const N: usize> Powers<N> {
    #[inline(always)]
    fn new(x: Matrix<N, N>) -> Self {
        let x2 = x.product(&x);
        let x3 = x.product(&x2);
        let powers = [&x, &x2, &x3];
        let fourth = Matrix::gathered(powers, 10, None);
        let third = Matrix::gathered(powers, 7, Some(&fourth));
        let second = Matrix::gathered(powers, 4, Some(&third));
        Self { powers: [x, x2, x3], rests: [fourth, third, second] }
    }

    /// e^X − I
    #[inline(always)]
    fn exponential(&self) -> Matrix<N, N> {
        Matrix::gathered(self.powers.each_ref(), 1, Some(&self.rests[2]))
    }

    /// Derivative of e^X along E, by the product rule X′Y + X Y′.
    #[inline(always)]
    fn slope(&self, e: &Matrix<N, N>) -> Matrix<N, N> {
        let [x, x2, x3] = &self.powers;
        let mut e2 = x.product(e);
        e2.add(&e.product(x));
        let mut e3 = x.product(&e2);
        e3.add(&e.product(x2));
        let own = [e, &e2, &e3];
        let mut slope = Matrix::gathered(own, 10, None);
        for (k, rest) in [7, 4, 1].into_iter().zip(&self.rests) {
            slope = Matrix::gathered(own, k, None).plus(&e3.product(rest)).plus(&x3.product(&slope));
        }
        slope
    }

    /// Change after the last of the steps by a constant rate `e` over the first: Σ Xᵏ⁻¹ e/k!, doubled.
    #[inline(always)]
    fn constant(&self, e: &[f64; N], steps: &[Matrix<N, N>]) -> [f64; N] {
        let x = &self.powers[0];
        let mut sum = [0.0; N];
        for k in (1..=EXPONENTIAL_ORDER).rev() {
            // Horner's rule: X (… ) + e/k!
            sum = x.times(&sum);
            sum.iter_mut().zip(e).for_each(|(sum, e)| *sum += e * RECIPROCAL_FACTORIAL[k]);
        }
        for step in steps {
            let change = step.times(&sum);
            sum.iter_mut().zip(change).for_each(|(sum, change)| *sum = 2.0 * *sum + change);
        }
        sum
    }
}

impl<const N: usize> Matrix<N, N> {
    #[inline(always)]
    fn plus(mut self, other: &Self) -> Self {
        self.add(other);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 8;

    fn drawn(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }

    /// A matrix with an input and a constant behind six states, and a change of it.
    fn matrices(seed: u64) -> (Matrix<N, N>, Columns<N>) {
        let mut seed = seed;
        let mut a = Matrix::zero();
        let mut slope = Columns::default();
        for column in 0..N {
            let mut entries = [0.0; N];
            for (row, entry) in entries.iter_mut().enumerate().take(6) {
                a.set(row, column, 3.0 * drawn(&mut seed));
                *entry = drawn(&mut seed);
            }
            if column % 3 == 1 {
                slope.0.push((column, entries));
            }
        }
        (a, slope)
    }

    fn moved(a: &Matrix<N, N>, slope: &Columns<N>, by: f64) -> Matrix<N, N> {
        let mut moved = slope.matrix().scaled(by);
        moved.add(a);
        moved
    }

    /// Compares with central differences of the exponential, extrapolated by Richardson, for all columns and for
    /// constant columns only.
    #[test]
    fn slopes_are_what_differences_tend_to() {
        for seed in 1..30 {
            let (a, mut slope) = matrices(seed);
            if seed % 3 == 0 {
                slope.0.retain(|(at, _)| *at >= 6);
            }
            let z: [f64; N] = std::array::from_fn(|k| 1.0 / (1.0 + k as f64));
            let s = [0.3; N];
            let (d, speed) = (0.37, 20.0);
            let at = |by: f64| {
                let step = moved(&a, &slope, by).sloped_step(&[Columns::default()], d, speed);
                let mut end = [std::array::from_fn::<f64, N, _>(|k| z[k] + by * s[k])];
                step.advance(&[0.0; N], &mut end);
                end[0]
            };
            let difference = |by: f64| {
                let (up, down) = (at(by), at(-by));
                std::array::from_fn::<f64, N, _>(|k| (up[k] - down[k]) / (2.0 * by))
            };
            let (wide, narrow) = (difference(2e-3), difference(1e-3));
            let mut own = [s];
            a.sloped_step(std::slice::from_ref(&slope), d, speed).advance(&z, &mut own);
            let mut by_series = [s];
            let mut series = Series::room();
            a.series(&z, d / 8.0, 23, &mut series);
            let mut now = z;
            for _ in 0..8 {
                a.series(&now, d / 4.0, 23, &mut series);
                // Half of the series' range.
                a.add_slopes(std::slice::from_ref(&slope), (&series, d / 4.0, 0.5), &mut by_series);
                series.add_to(&mut now, 0.5);
            }
            for k in 0..N {
                let known = (4.0 * narrow[k] - wide[k]) / 3.0;
                assert!((own[0][k] - known).abs() < 1e-10, "{seed} {k}: {} {known}", own[0][k]);
                assert!((own[0][k] - by_series[0][k]).abs() < 1e-13, "{seed} {k}: {} {}", own[0][k], by_series[0][k]);
            }
        }
    }
}
