//! Polynomials on 0..1: values, extremes, zeros, integrals.

use crate::solve::widest::widest;

/// Number of coefficients of a [`super::Curve`].
pub const TERMS: usize = 8;

/// Σ c_k sᵏ on 0..1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Polynomial<const T: usize = TERMS>(pub [f64; T]);

impl<const T: usize> Default for Polynomial<T> {
    fn default() -> Self {
        Self([0.0; T])
    }
}

/// The polynomial of degree 7 from its value and first three derivatives at 0, each over its order's factorial, and
/// their changes to 1.
#[inline(always)]
pub(super) fn hermite([a0, a1, a2, a3]: [f64; 4], [d0, d1, d2, d3]: [f64; 4]) -> [f64; TERMS] {
    // Remainder of the first four terms at the other end, by order.
    let (r0, r1, r2, r3) = (d0 - (a1 + a2 + a3), d1 - (2.0 * a2 + 3.0 * a3), d2 - 3.0 * a3, d3);
    [
        a0,
        a1,
        a2,
        a3,
        35.0 * r0 - 15.0 * r1 + 5.0 * r2 - r3,
        -84.0 * r0 + 39.0 * r1 - 14.0 * r2 + 3.0 * r3,
        70.0 * r0 - 34.0 * r1 + 13.0 * r2 - 3.0 * r3,
        -20.0 * r0 + 10.0 * r1 - 4.0 * r2 + r3,
    ]
}

/// Number of points at which a polynomial is evaluated first; they resolve its oscillation.
const LOOKS: usize = 8;

/// C(T − 1, k).
pub(super) const fn binomials<const T: usize>() -> [f64; T] {
    let (mut all, mut k) = ([1.0; T], 1);
    while k < T {
        all[k] = all[k - 1] * (T - k) as f64 / k as f64;
        k += 1;
    }
    all
}

impl<const T: usize> Polynomial<T> {
    /// Its coefficients in Bernstein's form, b_k = Σ_j C(k, j)/C(n, j) c_j: the values lie between the least and the
    /// greatest of them, and the first and the last are those at the ends.
    #[inline]
    fn bernstein(&self) -> [f64; T] {
        let binomial = const { binomials::<T>() };
        // Each step adds neighbours: Pascal's triangle.
        let mut b: [f64; T] = std::array::from_fn(|k| self.0[k] / binomial[k]);
        for i in 1..T {
            for k in (i..T).rev() {
                b[k] += b[k - 1];
            }
        }
        b
    }

    /// Bounds of its values on 0..1, from Bernstein's form.
    #[inline]
    pub fn range(&self) -> (f64, f64) {
        range_of(&self.bernstein())
    }

    /// A bound of its magnitude on 0..1, likewise.
    #[inline]
    pub fn bound(&self) -> f64 {
        let (low, high) = self.range();
        high.max(-low)
    }

    /// True if its magnitude on 0..1 may exceed `least`: Σ |c_k| decides most cases, Bernstein's form the others.
    #[inline]
    pub fn may_exceed(&self, least: f64) -> bool {
        self.0.iter().map(|c| c.abs()).sum::<f64>() > least && self.bound() > least
    }

    /// True if it certainly stays between `low` and `high` on 0..1, by c_0 ± Σ |c_k|.
    #[inline]
    pub fn stays_between(&self, low: f64, high: f64) -> bool {
        let away = self.0[1..].iter().map(|c| c.abs()).sum::<f64>();
        self.0[0] - away >= low && self.0[0] + away <= high
    }

    /// The value at `s`.
    #[inline(always)]
    pub fn at(&self, s: f64) -> f64 {
        self.0.iter().rev().fold(0.0, |sum, c| sum * s + c)
    }

    fn slope(&self, s: f64) -> f64 {
        (1..T).rev().fold(0.0, |sum, k| sum * s + k as f64 * self.0[k])
    }

    fn bend(&self, s: f64) -> f64 {
        (2..T).rev().fold(0.0, |sum, k| sum * s + (k * (k - 1)) as f64 * self.0[k])
    }

    /// True if it certainly has no zero.
    pub fn keeps_its_sign(&self) -> bool {
        self.0[0].abs() > self.0[1..].iter().map(|c| c.abs()).sum()
    }

    /// Position between `from` and `to` of the greatest value, and that value.
    pub fn greatest(&self, from: f64, to: f64) -> (f64, f64) {
        if (from, to) == (0.0, 1.0) {
            let b = self.bernstein();
            if let Some(s) = end_with(&b, range_of(&b).1) {
                return (s, self.at(s));
            }
        }
        let place = |k: usize| if k == LOOKS { to } else { from + (to - from) * k as f64 / LOOKS as f64 };
        let values: [f64; LOOKS + 1] = std::array::from_fn(|k| self.at(place(k)));
        let mut best = (from, values[0]);
        for (k, &value) in values.iter().enumerate().filter(|(_, value)| **value > values[0]) {
            if value > best.1 {
                best = (place(k), value);
            }
        }
        // A maximum lies between two points with different signs of the slope.
        let slopes: [f64; LOOKS + 1] = std::array::from_fn(|k| self.slope(place(k)));
        let mut top = best;
        for k in (0..LOOKS).filter(|&k| slopes[k] > 0.0 && slopes[k + 1] < 0.0) {
            let found = self.top([place(k), place(k + 1)]);
            if found.1 > top.1 {
                top = found;
            }
        }
        top
    }

    /// Maximum between two points, with a positive slope at the lower and a negative one at the higher: bracketed
    /// Newton's method on the slope.
    fn top(&self, [mut low, mut high]: [f64; 2]) -> (f64, f64) {
        let mut s = 0.5 * (low + high);
        for _ in 0..60 {
            let slope = self.slope(s);
            if slope > 0.0 {
                low = s;
            } else {
                high = s;
            }
            let newton = s - slope / self.bend(s);
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            let done = (next - s).abs() <= 1e-13;
            s = next;
            if done {
                break;
            }
        }
        (s, self.at(s))
    }

    /// Position between `from` and `to` of the largest magnitude, and the value there.
    pub fn largest(&self, from: f64, to: f64) -> (f64, f64) {
        if (from, to) == (0.0, 1.0) {
            let b = self.bernstein();
            let (low, high) = range_of(&b);
            if let Some(s) = end_with(&b, if -low > high { low } else { high }) {
                return (s, self.at(s));
            }
        }
        let (high, low) = (self.greatest(from, to), self.negative().greatest(from, to));
        if low.1 > high.1 { (low.0, -low.1) } else { high }
    }

    /// The least and the greatest value between `from` and `to`.
    pub fn extremes(&self, from: f64, to: f64) -> (f64, f64) {
        (-self.negative().greatest(from, to).1, self.greatest(from, to).1)
    }

    /// Adds another one, times `weight`.
    pub fn add(&mut self, other: &Self, weight: f64) {
        self.0.iter_mut().zip(other.0).for_each(|(own, other)| *own += weight * other);
    }

    /// This reading with the opposite sign.
    pub fn negative(&self) -> Self {
        Self(self.0.map(|c| -c))
    }

    /// Positions between `from` and `to` of its sign changes, in order.
    pub fn zeros(&self, from: f64, to: f64) -> Vec<f64> {
        let place = |k: usize| if k == LOOKS { to } else { from + (to - from) * k as f64 / LOOKS as f64 };
        let mut zeros = Vec::new();
        let (mut before, mut value) = (from, self.at(from));
        for k in 1..=LOOKS {
            let (here, next) = (place(k), self.at(place(k)));
            if (value < 0.0) != (next < 0.0) {
                zeros.push(self.zero(before, here, value < 0.0));
            }
            (before, value) = (here, next);
        }
        zeros
    }

    /// The zero between `low` and `high`, where the sign differs; `rising` if it is negative at `low`.
    fn zero(&self, mut low: f64, mut high: f64, rising: bool) -> f64 {
        let mut s = 0.5 * (low + high);
        for _ in 0..60 {
            let value = self.at(s);
            if (value < 0.0) == rising {
                low = s
            } else {
                high = s
            }
            // Newton's step if it stays inside, otherwise bisection.
            let newton = s - value / self.slope(s);
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if (next - s).abs() <= 1e-15 || high - low <= 1e-15 {
                return next;
            }
            s = next;
        }
        s
    }
}

/// The least and the greatest of Bernstein's coefficients.
#[inline]
fn range_of<const T: usize>(b: &[f64; T]) -> (f64, f64) {
    b.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &b| (low.min(b), high.max(b)))
}

/// The end of 0..1 at which Bernstein's form has this one of its extreme coefficients, if any: the extreme value
/// itself.
#[inline]
fn end_with<const T: usize>(b: &[f64; T], extreme: f64) -> Option<f64> {
    if b[0] == extreme {
        return Some(0.0);
    }
    (b[T - 1] == extreme).then_some(1.0)
}

/// Nodes and weights of the Gauss-Legendre rule with eight nodes on −1..1, one half of them: exact to degree 15, while
/// products of two [`Polynomial`]s have degree 14.
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Powers of the nodes of that rule on 0..1, by power and node; and the weights.
const POWERS: [[f64; NODES]; TERMS] = {
    let (mut powers, mut k) = ([[1.0; NODES]; TERMS], 1);
    while k < TERMS {
        let mut j = 0;
        while j < NODES {
            let (x, _) = GAUSS[j / 2];
            let place = if j % 2 == 0 { 0.5 - 0.5 * x } else { 0.5 + 0.5 * x };
            powers[k][j] = powers[k - 1][j] * place;
            j += 1;
        }
        k += 1;
    }
    powers
};

/// Number of nodes of that rule.
pub const NODES: usize = 2 * GAUSS.len();

impl Polynomial {
    widest! {
        /// Values at the nodes of the Gauss-Legendre rule on 0..1, for [`integral_of_product`].
        pub fn at_nodes(&self) -> [f64; NODES] = at_nodes_by_any, at_nodes_by_avx2;
    }

    #[inline(always)]
    fn at_nodes_by_any(&self) -> [f64; NODES] {
        let mut values = [0.0; NODES];
        for (c, powers) in self.0.iter().zip(&POWERS) {
            values.iter_mut().zip(powers).for_each(|(value, power)| *value += c * power);
        }
        values
    }
}

/// Integral over 0..1 of the product of two polynomials with these values at the nodes.
pub fn integral_of_product(a: &[f64; NODES], b: &[f64; NODES]) -> f64 {
    let weighted = |(j, (_, w)): (usize, &(f64, f64))| w * (a[2 * j] * b[2 * j] + a[2 * j + 1] * b[2 * j + 1]);
    0.5 * GAUSS.iter().enumerate().map(weighted).sum::<f64>()
}

/// The integral of a function over a part of 0..1, exact for polynomials up to degree 15.
pub fn integral((from, to): (f64, f64), value: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    GAUSS.iter().map(|(x, w)| w * (value(middle - half * x) + value(middle + half * x))).sum::<f64>() * half
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::uniform;
    use rand_pcg::Pcg64;

    /// The product of (s − root) over all roots, times a factor.
    fn with_roots(roots: &[f64], factor: f64) -> Polynomial {
        let mut c = [0.0; TERMS];
        c[0] = factor;
        for root in roots {
            for k in (0..TERMS).rev() {
                c[k] = if k > 0 { c[k - 1] } else { 0.0 } - root * c[k];
            }
        }
        Polynomial(c)
    }

    /// Each root between adjacent points at which the sign is asked for is a zero, to the last digits.
    #[test]
    fn zeros_are_the_roots() {
        let mut random = Pcg64::new(7, 1);
        let mut even = |low: f64, high: f64| low + (high - low) * uniform(&mut random);
        for _ in 0..20_000 {
            let mut roots: Vec<f64> = (0..5).map(|_| even(-0.5, 1.5)).collect();
            roots.sort_by(f64::total_cmp);
            if roots.windows(2).any(|pair| pair[1] - pair[0] < 1.1 / LOOKS as f64) {
                continue;
            }
            let zeros = with_roots(&roots, even(-1.0, 1.0)).zeros(0.0, 1.0);
            let inside: Vec<f64> = roots.into_iter().filter(|root| (0.0..=1.0).contains(root)).collect();
            assert_eq!(zeros.len(), inside.len());
            zeros.iter().zip(&inside).for_each(|(zero, root)| assert!((zero - root).abs() < 1e-9, "{zero} {root}"));
        }
    }

    /// If the best of nine points was on a convex part, Newton's method gave up there, and the peak was too low by a
    /// relative 9e-8.
    #[test]
    fn a_top_beside_an_upward_bend_was_missed() {
        let mut random = Pcg64::new(5, 1);
        let mut even = |low: f64, high: f64| low + (high - low) * uniform(&mut random);
        let mut bent_upwards = 0;
        for _ in 0..20_000 {
            let roots: Vec<f64> = (0..6).map(|_| even(-0.5, 1.5)).collect();
            // The slope has these roots.
            let slope = with_roots(&roots, even(-1.0, 1.0));
            let mut c = [0.0; TERMS];
            (1..TERMS).for_each(|k| c[k] = slope.0[k - 1] / k as f64);
            let course = Polynomial(c);
            let (place, value) = course.greatest(0.0, 1.0);
            assert!((0.0..=1.0).contains(&place) && course.at(place) == value);
            // A maximum is at a root of the slope, or at an end.
            let inside = roots.iter().copied().filter(|root| (0.0..=1.0).contains(root));
            let known = inside.chain([0.0, 1.0]).map(|s| course.at(s)).fold(f64::NEG_INFINITY, f64::max);
            let size = c.iter().map(|c| c.abs()).sum::<f64>();
            // Two roots of the slope between adjacent points may hide a maximum of at most this height.
            let near = (0..roots.len()).any(|i| (0..i).any(|j| (roots[i] - roots[j]).abs() < 1.0 / LOOKS as f64));
            if !near {
                assert!(
                    (known - value).abs() <= 1e-14 * size,
                    "{roots:?}: {value:e} at {place}, and there is {known:e}"
                );
                let best =
                    (0..=LOOKS).map(|k| k as f64 / LOOKS as f64).max_by(|a, b| course.at(*a).total_cmp(&course.at(*b)));
                bent_upwards += usize::from(course.bend(best.unwrap()) >= 0.0 && known > course.at(best.unwrap()));
            }
        }
        assert!(bent_upwards > 5, "{bent_upwards}");
    }
}
