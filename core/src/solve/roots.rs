//! The first point in (0, 1] at which a polynomial becomes negative.
//!
//! Most cases follow from the coefficients: if c₀ plus all negative ones is not negative, Σ c_k sᵏ does not fall; if
//! the coefficients change their sign once, there is one positive root (Descartes), and the sign at the end shows if it
//! is in the interval. Otherwise the first fall is approached in steps that cannot pass it, and near contacts with zero
//! are resolved by Bernstein coefficients.

use super::propagator::SERIES_TERMS;
use crate::solve::widest::widest;

/// Value and derivative of Σ c_k sᵏ = E(s²) + s O(s²), with independent chains of even and odd powers.
#[inline(always)]
fn value_and_slope(c: &[f64], s: f64) -> (f64, f64) {
    let q = s * s;
    let (mut even, mut even_slope, mut odd, mut odd_slope) = (0.0, 0.0, 0.0, 0.0);
    let pairs = c.chunks_exact(2);
    if let [last] = pairs.remainder() {
        even = *last;
    }
    for pair in pairs.rev() {
        (even_slope, even) = (even_slope * q + even, even * q + pair[0]);
        (odd_slope, odd) = (odd_slope * q + odd, odd * q + pair[1]);
    }
    // p = E + s O, p′ = 2 s E′ + O + 2 s² O′
    (even + s * odd, 2.0 * s * even_slope + odd + 2.0 * q * odd_slope)
}

/// The first s in (0, 1] at which Σ c_k sᵏ, not negative at 0, becomes negative; `None` if there is none.
pub(crate) fn first_fall(c: &[f64]) -> Option<f64> {
    let (&c0, rest) = c.split_first()?;
    if c0 < 0.0 {
        return Some(0.0);
    }
    if c0 + least(rest) >= 0.0 {
        return None;
    }
    if c0 > 0.0 {
        let (mut changes, mut negative) = (0, false);
        for &c in rest {
            let changed = if negative { c > 0.0 } else { c < 0.0 };
            changes += u32::from(changed);
            negative ^= changed;
        }
        if changes == 1 {
            let end: f64 = c.iter().sum();
            return (end < 0.0).then(|| polish(c, (0.0, c0), (1.0, end)));
        }
    }
    if c0 > 0.0
        && let Some(told) = by_steps(c)
    {
        return told;
    }
    // Bernstein coefficients, b_i = Σ_{k ≤ i} C(i,k)/C(n,k) c_k: the polynomial lies within their hull.
    match c.len() {
        0..=12 => by_bernstein(c, &RATIOS_12),
        13..=16 => by_bernstein(c, &RATIOS_16),
        17..=20 => by_bernstein(c, &RATIOS_20),
        _ => by_bernstein(c, &RATIOS_24),
    }
}

/// Σ min(c_k, 0), in four sums side by side.
#[inline(always)]
fn least(c: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (fours, rest) = c.as_chunks::<4>();
    for four in fours {
        sums.iter_mut().zip(four).for_each(|(sum, &c)| *sum += if c < 0.0 { c } else { 0.0 });
    }
    sums.iter_mut().zip(rest).for_each(|(sum, &c)| *sum += if c < 0.0 { c } else { 0.0 });
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}

/// Steps after which a polynomial that nearly touches zero is passed to Bernstein coefficients.
const MOST_STEPS: usize = 12;

/// The first fall of Σ c_k sᵏ, positive at 0, by steps that cannot pass it; `None` if that takes too many.
///
/// With |p″| ≤ B = Σ k (k − 1) |c_k|, p(s + δ) ≥ p + p′ δ − ½ B δ² stays positive up to
///
/// ```text
/// δ = 2p/(√(p′² + 2 B p) − p′) = (√(p′² + 2 B p) + p′)/B
/// ```
///
/// of which the first is accurate where p falls, the second where it rises. Near a fall these are Newton steps.
fn by_steps(c: &[f64]) -> Option<Option<f64>> {
    let mut bends = [0.0; 4];
    for (c, weights) in c.chunks(4).zip(&BENDS) {
        bends.iter_mut().zip(c).zip(weights).for_each(|((bend, c), weight)| *bend += weight * c.abs());
    }
    let bend = (bends[0] + bends[2]) + (bends[1] + bends[3]);
    let mut s = 0.0;
    for _ in 0..MOST_STEPS {
        let (p, slope) = value_and_slope(c, s);
        if p <= 0.0 {
            return Some(Some(s));
        }
        let root = (slope * slope + 2.0 * bend * p).sqrt();
        let by = if slope > 0.0 { (root + slope) / bend } else { 2.0 * p / (root - slope) };
        if by <= 0.5 * f64::EPSILON * s {
            return Some(Some(s));
        }
        s += by;
        // The sign at the end decides about a fall just there.
        if s >= 1.0 {
            return Some((c.iter().sum::<f64>() < 0.0).then_some(1.0));
        }
    }
    None
}

/// k (k − 1), four by four.
static BENDS: [[f64; 4]; SERIES_TERMS / 4] = {
    let (mut bends, mut k) = ([[0.0; 4]; SERIES_TERMS / 4], 1);
    while k < SERIES_TERMS {
        bends[k / 4][k % 4] = (k * (k - 1)) as f64;
        k += 1;
    }
    bends
};

static RATIOS_12: [[f64; 12]; 12] = ratios();
static RATIOS_16: [[f64; 16]; 16] = ratios();
static RATIOS_20: [[f64; 20]; 20] = ratios();
static RATIOS_24: [[f64; SERIES_TERMS]; SERIES_TERMS] = ratios();

/// C(i,k)/C(n,k), by k and i; zero for k above i. A shorter polynomial is padded with zeros to N.
const fn ratios<const N: usize>() -> [[f64; N]; N] {
    let (n, mut table, mut i) = (N - 1, [[0.0; N]; N], 0);
    while i < N {
        let (mut ratio, mut k) = (1.0, 0);
        while k <= i {
            table[k][i] = ratio;
            ratio *= (i - k) as f64 / if n > k { (n - k) as f64 } else { 1.0 };
            k += 1;
        }
        i += 1;
    }
    table
}

fn by_bernstein<const N: usize>(c: &[f64], ratios: &[[f64; N]; N]) -> Option<f64> {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return search(c, &unsafe { bernstein_by_avx2(c, ratios) }, 0.0, 1.0);
    }
    search(c, &bernstein(c, ratios), 0.0, 1.0)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn bernstein_by_avx2<const N: usize>(c: &[f64], ratios: &[[f64; N]; N]) -> [f64; N] {
    bernstein(c, ratios)
}

#[inline(always)]
fn bernstein<const N: usize>(c: &[f64], ratios: &[[f64; N]; N]) -> [f64; N] {
    let mut b = [0.0; N];
    for (c, ratios) in c.iter().zip(ratios) {
        b.iter_mut().zip(ratios).for_each(|(b, ratio)| *b += ratio * c);
    }
    b
}

/// Length at which a contact counts as a point: 2⁻⁴⁰ of an interval that is itself a fraction of an oscillation.
const NARROWEST: f64 = 1e-12;

/// The first fall within [low, high], on which the Bernstein coefficients are `b`.
fn search<const N: usize>(c: &[f64], b: &[f64; N], low: f64, high: f64) -> Option<f64> {
    // Descartes: no more zeros than changes of sign, and one if there is one change.
    let mut changes = 0;
    let mut before = 0.0;
    for &b in b.iter().filter(|b| **b != 0.0) {
        changes += u32::from(before * b < 0.0);
        before = b.signum();
    }
    let ends_below = b[N - 1] < 0.0;
    if changes == 0 && !ends_below {
        return None;
    }
    if changes <= 1 || high - low < NARROWEST {
        // The sign at the end decides about a contact within one point.
        return ends_below.then(|| polish(c, (low, b[0]), (high, b[N - 1])));
    }
    let (left, right) = halves(b);
    let middle = 0.5 * (low + high);
    search(c, &left, low, middle).or_else(|| search(c, &right, middle, high))
}

widest! {
    /// The coefficients on both halves, by de Casteljau's scheme.
    fn halves [const N: usize](b: &[f64; N]) -> ([f64; N], [f64; N]) = halves_by_any, halves_by_avx2;
}

#[inline(always)]
fn halves_by_any<const N: usize>(b: &[f64; N]) -> ([f64; N], [f64; N]) {
    let (mut left, mut right) = ([0.0; N], *b);
    for (i, left) in left.iter_mut().enumerate() {
        *left = right[0];
        for j in 0..N - 1 - i {
            right[j] = 0.5 * (right[j] + right[j + 1]);
        }
    }
    // The left part is in order from the middle outwards.
    (left, right)
}

/// The only extremum of Σ c_k sᵏ in (0, 1), where the slope times `side` falls from positive to negative, and the value
/// there. `ends` are the slopes at 0 and 1.
pub(super) fn only_extremum<const T: usize>(c: &[f64; T], side: f64, ends: [f64; 2]) -> (f64, f64) {
    let mut slope = [0.0; T];
    for k in 1..T {
        slope[k - 1] = side * k as f64 * c[k];
    }
    let s = only_zero(&slope, ends[0] / (ends[0] - ends[1]));
    (s, value_and_slope(c, s).0)
}

/// The only fall of Σ c_k sᵏ in (0, 1], positive at 0 and negative, `end`, at 1.
pub(super) fn only_fall(c: &[f64], end: f64) -> f64 {
    only_zero(c, c[0] / (c[0] - end))
}

/// The only zero in (0, 1) of Σ c_k sᵏ, which is positive before it, by Newton's method from `s` within a bracket.
fn only_zero(c: &[f64], mut s: f64) -> f64 {
    let mut bracket = Bracket { low: 0.0, high: 1.0 };
    for _ in 0..100 {
        let newton = bracket.newton(c, s);
        // The next step would be the square of this one: less than the last bit.
        if (newton - s).abs() <= 1e-9 * s {
            return newton.clamp(bracket.low, bracket.high);
        }
        s = bracket.inside(newton);
        if bracket.high - bracket.low <= f64::EPSILON * s {
            break;
        }
    }
    s
}

/// Newton's method within a bracket whose upper end is negative; bisection if it would leave the bracket. It begins at
/// the zero of the straight line between the ends.
fn polish(c: &[f64], (low, above): (f64, f64), (high, below): (f64, f64)) -> f64 {
    let mut bracket = Bracket { low, high };
    let mut s = bracket.inside(low + (high - low) * (above / (above - below)));
    for _ in 0..100 {
        let newton = bracket.newton(c, s);
        if (newton - s).abs() <= f64::EPSILON * s {
            return newton.clamp(0.0, 1.0);
        }
        s = bracket.inside(newton);
    }
    s
}

/// Places between which Σ c_k sᵏ falls below zero.
struct Bracket {
    low: f64,
    high: f64,
}

impl Bracket {
    /// Newton's step from `s`, which becomes an end of the bracket.
    fn newton(&mut self, c: &[f64], s: f64) -> f64 {
        let (p, slope) = value_and_slope(c, s);
        if p < 0.0 {
            self.high = s;
        } else {
            self.low = s;
        }
        s - p / slope
    }

    /// This place, or the middle of the bracket if it lies outside.
    fn inside(&self, s: f64) -> f64 {
        if s > self.low && s < self.high { s } else { 0.5 * (self.low + self.high) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_first_of_two() {
        // (s − 0.3)(s − 0.31) falls at 0.3
        let root = first_fall(&[0.3 * 0.31, -0.61, 1.0]).unwrap();
        assert!((root - 0.3).abs() < 1e-14, "{root}");
    }

    #[test]
    fn the_extremum_of_a_parabola_is_its_vertex() {
        // 1 + 3 s − 5 s²: 1.45 at 0.3
        let (s, value) = only_extremum(&[1.0, 3.0, -5.0], 1.0, [3.0, -7.0]);
        assert!((s - 0.3).abs() < 1e-15 && (value - 1.45).abs() < 1e-15, "{value} at {s}");
        let (s, value) = only_extremum(&[-1.0, -3.0, 5.0], -1.0, [3.0, -7.0]);
        assert!((s - 0.3).abs() < 1e-15 && (value + 1.45).abs() < 1e-15, "{value} at {s}");
    }

    /// Oscillations with a slow part, like guards: the steps find the same zeros as the hulls of Bernstein
    /// coefficients.
    #[test]
    fn steps_find_the_same_falls_as_hulls() {
        let mut random = rand_pcg::Pcg64::new(7, 1);
        let mut draw = || 2.0 * crate::chance::uniform(&mut random) - 1.0;
        let (mut falls, mut stays, mut left) = (0, 0, 0);
        for _ in 0..20_000 {
            let (swing, a, b, slow, above) = (2.0 * draw().abs(), draw(), draw(), 0.3 * draw(), 0.3 * draw().abs());
            let (mut c, mut power) = ([0.0; SERIES_TERMS], 1.0);
            for (k, c) in c.iter_mut().enumerate() {
                power *= if k > 0 { swing / k as f64 } else { 1.0 };
                *c = [a, b, -a, -b][k % 4] * power;
            }
            (c[0], c[1]) = (above + 1e-9, c[1] + slow);
            let hulls = by_bernstein(&c, &RATIOS_24);
            match by_steps(&c) {
                None => left += 1,
                Some(None) => {
                    assert_eq!(hulls, None, "{c:?}");
                    stays += 1;
                }
                Some(Some(s)) => {
                    let near = |hull: f64| (s - hull).abs() <= 1e-12 * hull;
                    assert!(hulls.is_some_and(near), "{s} {hulls:?} {c:?}");
                    falls += 1;
                }
            }
        }
        assert!(falls > 5000 && stays > 1000 && left < 200, "{falls} {stays} {left}");
    }

    /// A condition that begins close above zero, rises and comes back falls there: s³ − 1.5 s² + 0.5 s + ε at 0.5 + 4
    /// ε.
    #[test]
    fn what_rises_from_all_but_zero_comes_back() {
        for above in [1e-9, 1e-14, 1e-17, 1e-20, 1e-30, 1e-300] {
            let root = first_fall(&[above, 0.5, -1.5, 1.0]).unwrap();
            assert!((root - 0.5 - 4.0 * above).abs() < 1e-14, "{above:e}: {root}");
        }
    }

    /// Wider vectors do the same operations in the same order.
    #[cfg(target_arch = "x86_64")]
    #[test]
    fn wider_vectors_give_the_same_bits() {
        if !std::arch::is_x86_feature_detected!("avx2") {
            return;
        }
        let c: [f64; 24] = std::array::from_fn(|k| (1.7 * k as f64).sin() / (1.0 + k as f64));
        let b = bernstein(&c, &RATIOS_24);
        // SAFETY: the processor has AVX2.
        assert_eq!(unsafe { bernstein_by_avx2(&c, &RATIOS_24) }.map(f64::to_bits), b.map(f64::to_bits));
        let (left, right) = halves(&b);
        let (plain_left, plain_right) = halves_by_any(&b);
        assert_eq!(left.map(f64::to_bits), plain_left.map(f64::to_bits));
        assert_eq!(right.map(f64::to_bits), plain_right.map(f64::to_bits));
        // Both halves meet in the middle: Σ c_k 2⁻ᵏ.
        let middle = value_and_slope(&c, 0.5).0;
        assert!((left[23] - middle).abs() < 1e-14 && (right[0] - middle).abs() < 1e-14);
    }

    /// Polynomials of each number of coefficients, against a fine grid.
    #[test]
    fn all_lengths_are_searched_alike() {
        let mut seed = 1_u64;
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let (mut falls, mut stays) = (0, 0);
        for length in (2..=24).cycle().take(23 * 40) {
            let mut scale = 1.0;
            let mut c: Vec<f64> = (0..length)
                .map(|k| {
                    scale *= 2.0 / f64::from(k.max(1));
                    scale * next()
                })
                .collect();
            c[0] = 0.2 * next().abs();
            let fine = (1..=20_000).map(|j| f64::from(j) / 20_000.0);
            let below = fine.clone().find(|&s| value_and_slope(&c, s).0 < 0.0);
            match (first_fall(&c), below) {
                (Some(root), Some(below)) => {
                    assert!(root <= below && root > below - 1e-4, "{c:?}: {root} {below}");
                    falls += 1;
                }
                (None, None) => stays += 1,
                // A dip between the points of the grid.
                (Some(root), None) => assert!(value_and_slope(&c, root).0.abs() < 1e-9, "{c:?}: {root}"),
                (None, Some(below)) => panic!("{c:?}: it falls before {below}"),
            }
        }
        assert!(falls > 200 && stays > 200, "{falls} {stays}");
    }

    #[test]
    fn one_change_of_sign_is_one_root() {
        // e⁻ˢ − 0.5 by its series falls at ln 2, and e⁻ˢ − 0.3 not before 1.
        let series = |down: f64| -> [f64; 24] {
            let mut term = 1.0;
            std::array::from_fn(|k| {
                let now = if k == 0 { 1.0 - down } else { term };
                term *= -1.0 / (k + 1) as f64;
                now
            })
        };
        let root = first_fall(&series(0.5)).unwrap();
        assert!((root - std::f64::consts::LN_2).abs() < 1e-15, "{root}");
        assert_eq!(first_fall(&series(0.3)), None);
        // 1 − 3 s + s⁵: one root in the interval, another beyond it
        let root = first_fall(&[1.0, -3.0, 0.0, 0.0, 0.0, 1.0]).unwrap();
        assert!((1.0 - 3.0 * root + root.powi(5)).abs() < 1e-15, "{root}");
        // 2 − s: at the end it is 1.
        assert_eq!(first_fall(&[2.0, -1.0]), None);
        assert_eq!(first_fall(&[0.5, -1.0]), Some(0.5));
    }

    #[test]
    fn a_touch_from_above_is_no_crossing() {
        // (s − 0.5)² + 1e-12
        assert_eq!(first_fall(&[0.25 + 1e-12, -1.0, 1.0]), None);
        assert_eq!(first_fall(&[1.0, 0.0, 0.0]), None);
        assert_eq!(first_fall(&[0.0, 0.0, 1.0]), None);
        assert_eq!(first_fall(&[0.0; 13]), None);
    }

    #[test]
    fn flat_crossings_are_found_quickly() {
        // −(s − 0.3)³ and −(s − 0.3)⁵, whose roots are as flat as rounding
        let root = first_fall(&[0.027, -0.27, 0.9, -1.0]).unwrap();
        assert!((root - 0.3).abs() < 1e-5, "{root}");
        let root = first_fall(&[0.00243, -0.0405, 0.27, -0.9, 1.5, -1.0]).unwrap();
        assert!((root - 0.3).abs() < 1e-3, "{root}");
    }
}
