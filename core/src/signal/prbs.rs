//! Pseudo-random binary sequences, from a maximum-length shift register.

use super::Part;
use super::clock::Now;
use std::sync::OnceLock;

/// Stages of the register.
const ORDER: u32 = 20;

/// Bits before it repeats: every state but zero, once.
pub(super) const PERIOD: u64 = (1 << ORDER) - 1;

/// Bit k, from k·bit on; the seed says where in the sequence it starts.
///
/// All seeds give one sequence, b_k = b_k−3 ⊕ b_k−20 (the polynomial x²⁰ + x³ + 1 of ITU-T O.153), entered at different
/// places. A period has one high bit more than low ones, so its mean is `amplitude`/1048575.
pub(super) fn part(now: Now, amplitude: f64, bit: f64, seed: u64) -> Part {
    if !now.resolves(bit) {
        return Part::held(0.0, f64::INFINITY);
    }
    let seam = |k: f64| k * bit;
    let k = now.cell(now.t / bit, seam);
    Part::held(if high(seed, k as u64) { amplitude } else { -amplitude }, seam(k + 1.0))
}

/// Bit k of the sequence that `seed` selects.
pub(super) fn high(seed: u64, k: u64) -> bool {
    let i = (scatter(seed) % PERIOD + k % PERIOD) % PERIOD;
    period()[(i / 64) as usize] >> (i % 64) & 1 == 1
}

/// One period, 64 bits to a word, computed once (128 KiB, about a millisecond).
fn period() -> &'static [u64] {
    static BITS: OnceLock<Vec<u64>> = OnceLock::new();
    BITS.get_or_init(|| {
        let mut bits = vec![0; PERIOD as usize / 64 + 1];
        // The state holds b_k−1 in its lowest bit up to b_k−20 in its highest.
        let mut state: u32 = 1;
        for i in 0..PERIOD {
            let bit = (state >> 2 ^ state >> 19) & 1;
            bits[(i / 64) as usize] |= u64::from(bit) << (i % 64);
            state = (state << 1 | bit) & PERIOD as u32;
        }
        bits
    })
}

/// Spreads neighbouring seeds over the whole range (the finaliser of SplitMix64, Steele, Lea and Flood 2014).
fn scatter(seed: u64) -> u64 {
    let z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}
