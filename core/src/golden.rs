//! The golden section.

/// Position of the maximum of a unimodal function between two positions; each step leaves 0.62 of the interval.
pub fn top([mut low, mut high]: [f64; 2], steps: usize, mut of: impl FnMut(f64) -> f64) -> f64 {
    const SHARE: f64 = 0.618_033_988_749_894_8;
    for _ in 0..steps {
        let [a, b] = [high - SHARE * (high - low), low + SHARE * (high - low)];
        if of(a) < of(b) { low = a } else { high = b }
    }
    0.5 * (low + high)
}
