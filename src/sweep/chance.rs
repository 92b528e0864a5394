//! Chance by number: the same for the same (seed, run, parameter), whoever asks and in which order.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// A number of 64 bits from another, each of whose bits depends on all of its: the finaliser of SplitMix64 (Steele,
/// Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014).
pub fn mixed(number: u64) -> u64 {
    let z = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Uniform numbers above 0 and below 1: those of run `index`, of which each run takes `each`.
pub struct Uniform(Pcg64);

impl Uniform {
    /// The stream of `seed`, at the place of that run.
    pub fn of_run(seed: u64, index: u64, each: usize) -> Self {
        let mut random = Pcg64::seed_from_u64(seed);
        random.advance(u128::from(index) * each as u128);
        Self(random)
    }

    /// The next one.
    pub fn next(&mut self) -> f64 {
        ((self.0.next_u64() >> 11) as f64 + 0.5) * 2f64.powi(-53)
    }
}

/// Place `index` of a permutation of 0, 1, …, `count` − 1 that `key` stands for: a Feistel network on the next power of
/// four, walked along its cycle until it is below `count` (J. Black, P. Rogaway, "Ciphers with arbitrary finite
/// domains", CT-RSA 2002).
pub fn permuted(index: u64, count: u64, key: u64) -> u64 {
    const ROUNDS: u64 = 6;
    let half = (64 - count.saturating_sub(1).leading_zeros()).div_ceil(2).max(1);
    let mask = (1 << half) - 1;
    let mut value = index;
    loop {
        let (mut left, mut right) = (value >> half, value & mask);
        for round in 0..ROUNDS {
            (left, right) = (right, left ^ (mixed(key ^ mixed(round << 40 ^ right)) & mask));
        }
        value = left << half | right;
        if value < count {
            return value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_permutation_takes_every_place_once() {
        for count in [1, 2, 3, 5, 64, 1000, 4097] {
            let mut seen = vec![false; count as usize];
            for index in 0..count {
                let place = permuted(index, count, 7) as usize;
                assert!(!std::mem::replace(&mut seen[place], true), "{count}: {place} twice");
            }
        }
        let moved = (0..1000).filter(|&i| permuted(i, 1000, 1) != permuted(i, 1000, 2)).count();
        assert!(moved > 980, "{moved}");
    }

    #[test]
    fn numbers_of_a_run_are_those_of_the_stream() {
        let mut whole = Uniform::of_run(3, 0, 5);
        let all: Vec<f64> = (0..50).map(|_| whole.next()).collect();
        let mut seventh = Uniform::of_run(3, 7, 5);
        assert_eq!((0..5).map(|_| seventh.next()).collect::<Vec<_>>(), all[35..40]);
    }
}
