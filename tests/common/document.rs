//! The whole numbers and the generator of `docs/random.md`, made from its text.
#![allow(dead_code)]

/// The finaliser of SplitMix64, from `docs/random.md`.
pub fn mix(x: u64) -> u64 {
    let z = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// PCG XSL RR 128/64, begun from a number of 64 bits.
pub struct Pcg {
    state: u128,
    increment: u128,
}

impl Pcg {
    const M: u128 = 47_026_247_687_942_121_848_144_207_491_837_523_525;

    /// Begun from `h`.
    pub fn new(mut h: u64) -> Self {
        let words: Vec<u128> = (0..8)
            .map(|_| {
                h = h.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(11_634_580_027_462_260_723);
                u128::from(((((h >> 18) ^ h) >> 27) as u32).rotate_right((h >> 59) as u32))
            })
            .collect();
        let joined = |w: &[u128]| w[0] + (w[1] << 32) + (w[2] << 64) + (w[3] << 96);
        let (a, c) = (joined(&words[..4]), joined(&words[4..]) | 1);
        Self { state: a.wrapping_add(c).wrapping_mul(Self::M).wrapping_add(c), increment: c }
    }

    /// The next number.
    pub fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_mul(Self::M).wrapping_add(self.increment);
        let (high, low) = ((self.state >> 64) as u64, self.state as u64);
        (high ^ low).rotate_right((self.state >> 122) as u32)
    }

    /// The next normal number.
    pub fn normal(&mut self) -> f64 {
        loop {
            let mut side = || (self.next() >> 11) as f64 * 2f64.powi(-52) - 1.0;
            let (u, v) = (side(), side());
            let s = u * u + v * v;
            if 0.0 < s && s < 1.0 {
                return u * (-2.0 * s.ln() / s).sqrt();
            }
        }
    }
}
