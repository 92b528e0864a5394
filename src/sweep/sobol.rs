//! Sobol' points by their index, scrambled as Owen does it.
//!
//! Direction numbers: S. Joe and F. Y. Kuo, "Constructing Sobol sequences with better two-dimensional projections",
//! SIAM J. Sci. Comput. 30 (2008), their table `new-joe-kuo-6.21201`, its first 64 dimensions. Scrambling: A. B. Owen,
//! "Randomly permuted (t, m, s)-nets and (t, s)-sequences" (1995): every bit is flipped by chance, and the chance
//! depends on all bits before it.

use super::chance::mixed;

/// Bits of a coordinate: as many as a double from 0 to 1 holds.
const BITS: u32 = 53;

/// Bits that are scrambled one by one; those behind them together, by a chance that depends on all of these.
const NESTED: u32 = 32;

/// Dimensions that there are direction numbers for.
pub const DIMENSIONS: usize = 64;

/// The sequence in so many dimensions.
#[derive(Debug, Clone)]
pub struct Sobol {
    /// By dimension and bit of the index: which bits of the coordinate it turns, the highest being one half.
    directions: Vec<[u64; BITS as usize]>,
    /// The seeds of the scrambling of each dimension.
    keys: Vec<u64>,
}

impl Sobol {
    /// The sequence with the scrambling that `seed` stands for, in at most [`DIMENSIONS`] dimensions.
    pub fn new(dimensions: usize, seed: u64) -> Self {
        let dimensions = dimensions.min(DIMENSIONS);
        let directions = (0..dimensions).map(directions).collect();
        let key = |dimension: usize| mixed(seed ^ mixed(dimension as u64 + 1));
        Self { directions, keys: (0..dimensions).map(key).collect() }
    }

    /// Coordinate `dimension` of point `index`, unscrambled: from 0, below 1.
    pub fn plain(&self, index: u64, dimension: usize) -> f64 {
        share(self.bits(index, dimension))
    }

    /// Coordinate `dimension` of point `index`: above 0, below 1.
    pub fn coordinate(&self, index: u64, dimension: usize) -> f64 {
        let bits = self.bits(index, dimension);
        let key = self.keys[dimension];
        let mut flips = 0;
        for place in 0..NESTED {
            // The bits before this one, with a one in front that tells how many they are.
            let before = (1 << place) | (bits >> (BITS - place));
            flips |= (mixed(key ^ before) >> 63) << (BITS - 1 - place);
        }
        let lowest = BITS - NESTED;
        flips |= mixed(key ^ (1 << NESTED) ^ (bits >> lowest)) >> (64 - lowest);
        // In the middle of the last bit: never 0, nor 1.
        share(bits ^ flips) + 0.5 * share(1)
    }

    fn bits(&self, mut index: u64, dimension: usize) -> u64 {
        let mut bits = 0;
        let directions = &self.directions[dimension];
        while index != 0 {
            let place = index.trailing_zeros();
            bits ^= directions.get(place as usize).copied().unwrap_or(0);
            index &= index - 1;
        }
        bits
    }
}

fn share(bits: u64) -> f64 {
    bits as f64 * 2f64.powi(-(BITS as i32))
}

/// v_k = m_k 2^(53 − k)
fn directions(dimension: usize) -> [u64; BITS as usize] {
    let Some((a, initial)) = dimension.checked_sub(1).map(|row| NUMBERS[row]) else {
        return std::array::from_fn(|k| 1 << (BITS as usize - 1 - k));
    };
    let s = initial.len();
    let mut m = [0u64; BITS as usize];
    m[..s].copy_from_slice(initial);
    for k in s..m.len() {
        // m_k = 2 a₁ m_(k−1) ⊕ 2² a₂ m_(k−2) ⊕ … ⊕ 2^(s−1) a_(s−1) m_(k−s+1) ⊕ 2^s m_(k−s) ⊕ m_(k−s)
        m[k] = (m[k - s] << s) ^ m[k - s];
        for j in 1..s {
            if a >> (s - 1 - j) & 1 == 1 {
                m[k] ^= m[k - j] << j;
            }
        }
    }
    std::array::from_fn(|k| m[k] << (BITS as usize - 1 - k))
}

/// Of every dimension but the first: the inner coefficients of its primitive polynomial as bits, and m₁, m₂, …
#[rustfmt::skip]
const NUMBERS: [(u64, &[u64]); DIMENSIONS - 1] = [
    (0, &[1]),
    (1, &[1, 3]),
    (1, &[1, 3, 1]),
    (2, &[1, 1, 1]),
    (1, &[1, 1, 3, 3]),
    (4, &[1, 3, 5, 13]),
    (2, &[1, 1, 5, 5, 17]),
    (4, &[1, 1, 5, 5, 5]),
    (7, &[1, 1, 7, 11, 19]),
    (11, &[1, 1, 5, 1, 1]),
    (13, &[1, 1, 1, 3, 11]),
    (14, &[1, 3, 5, 5, 31]),
    (1, &[1, 3, 3, 9, 7, 49]),
    (13, &[1, 1, 1, 15, 21, 21]),
    (16, &[1, 3, 1, 13, 27, 49]),
    (19, &[1, 1, 1, 15, 7, 5]),
    (22, &[1, 3, 1, 15, 13, 25]),
    (25, &[1, 1, 5, 5, 19, 61]),
    (1, &[1, 3, 7, 11, 23, 15, 103]),
    (4, &[1, 3, 7, 13, 13, 15, 69]),
    (7, &[1, 1, 3, 13, 7, 35, 63]),
    (8, &[1, 3, 5, 9, 1, 25, 53]),
    (14, &[1, 3, 1, 13, 9, 35, 107]),
    (19, &[1, 3, 1, 5, 27, 61, 31]),
    (21, &[1, 1, 5, 11, 19, 41, 61]),
    (28, &[1, 3, 5, 3, 3, 13, 69]),
    (31, &[1, 1, 7, 13, 1, 19, 1]),
    (32, &[1, 3, 7, 5, 13, 19, 59]),
    (37, &[1, 1, 3, 9, 25, 29, 41]),
    (41, &[1, 3, 5, 13, 23, 1, 55]),
    (42, &[1, 3, 7, 3, 13, 59, 17]),
    (50, &[1, 3, 1, 3, 5, 53, 69]),
    (55, &[1, 1, 5, 5, 23, 33, 13]),
    (56, &[1, 1, 7, 7, 1, 61, 123]),
    (59, &[1, 1, 7, 9, 13, 61, 49]),
    (62, &[1, 3, 3, 5, 3, 55, 33]),
    (14, &[1, 3, 1, 15, 31, 13, 49, 245]),
    (21, &[1, 3, 5, 15, 31, 59, 63, 97]),
    (22, &[1, 3, 1, 11, 11, 11, 77, 249]),
    (38, &[1, 3, 1, 11, 27, 43, 71, 9]),
    (47, &[1, 1, 7, 15, 21, 11, 81, 45]),
    (49, &[1, 3, 7, 3, 25, 31, 65, 79]),
    (50, &[1, 3, 1, 1, 19, 11, 3, 205]),
    (52, &[1, 1, 5, 9, 19, 21, 29, 157]),
    (56, &[1, 3, 7, 11, 1, 33, 89, 185]),
    (67, &[1, 3, 3, 3, 15, 9, 79, 71]),
    (70, &[1, 3, 7, 11, 15, 39, 119, 27]),
    (84, &[1, 1, 3, 1, 11, 31, 97, 225]),
    (97, &[1, 1, 1, 3, 23, 43, 57, 177]),
    (103, &[1, 3, 7, 7, 17, 17, 37, 71]),
    (115, &[1, 3, 1, 5, 27, 63, 123, 213]),
    (122, &[1, 1, 3, 5, 11, 43, 53, 133]),
    (8, &[1, 3, 5, 5, 29, 17, 47, 173, 479]),
    (13, &[1, 3, 3, 11, 3, 1, 109, 9, 69]),
    (16, &[1, 1, 1, 5, 17, 39, 23, 5, 343]),
    (22, &[1, 3, 1, 5, 25, 15, 31, 103, 499]),
    (25, &[1, 1, 1, 11, 11, 17, 63, 105, 183]),
    (44, &[1, 1, 5, 11, 9, 29, 97, 231, 363]),
    (47, &[1, 1, 5, 15, 19, 45, 41, 7, 383]),
    (52, &[1, 3, 7, 7, 31, 19, 83, 137, 221]),
    (55, &[1, 1, 1, 3, 23, 15, 111, 223, 83]),
    (59, &[1, 1, 5, 13, 31, 15, 55, 25, 161]),
    (62, &[1, 1, 3, 13, 25, 47, 39, 87, 257]),
];
