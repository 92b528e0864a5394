//! Output times, rounded to the numbers that a person would write.

/// Output times: 0, `every`, 2 `every`, … and `until`, possibly after a shorter last interval.
///
/// A time is the number nearest to k times the interval as it was written: with 1 ms row 3 is at 0.003, where 3 × 0.001
/// in floating point need not be 0.003, and with 1/3 s row 3 is at 1.
///
/// ```
/// use taut::trajectory::Grid;
/// let grid = Grid::new(0.3, 1.0);
/// let times: Vec<f64> = (0..=grid.intervals()).map(|k| grid.time(k)).collect();
/// assert_eq!(times, [0.0, 0.3, 0.6, 0.9, 1.0]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    until: f64,
    /// Number of intervals.
    intervals: u64,
    /// Intervals of equal length from the beginning: all, or all but the last.
    even: u64,
    interval: Interval,
}

/// Largest distance of `until` from a row without a row of its own, relative to the interval.
const NEAR: f64 = 1e-6;

impl Grid {
    /// Rows from zero to `until` at the interval `every`; both in s and positive.
    pub fn new(every: f64, until: f64) -> Self {
        let interval = Interval::new(every);
        let ratio = until / every;
        let nearest = ratio.round();
        let whole = (ratio - nearest).abs() <= NEAR && nearest >= 1.0;
        // A float that is too large becomes the largest integer.
        let intervals = if whole { nearest } else { ratio.ceil() } as u64;
        let off = interval.times(intervals) - until;
        let fits = off.abs() <= 8.0 * f64::EPSILON * until;
        Self { until, intervals, even: intervals - u64::from(!fits && intervals > 0), interval }
    }

    /// Time of row `k`, s.
    #[inline]
    pub fn time(&self, k: u64) -> f64 {
        if k >= self.intervals { self.until } else { self.interval.times(k) }
    }

    /// Times of the rows from `first` on, s.
    pub(crate) fn times(&self, first: u64, out: &mut [f64]) {
        let (last, Interval { over, under, exact, .. }) = (first + out.len() as u64, self.interval);
        if last > exact.min(self.intervals) {
            (first..).zip(out).for_each(|(k, time)| *time = self.time(k));
            return;
        }
        // Row numbers are integers far below 2⁵³.
        let first = first as f64;
        out.iter_mut().enumerate().for_each(|(j, time)| *time = (first + f64::from(j as u32)) * over / under);
    }

    /// Number of intervals; there is one row more.
    pub fn intervals(&self) -> u64 {
        self.intervals
    }

    /// Length of an interval, s; the last may differ.
    pub fn interval(&self) -> f64 {
        self.interval.length
    }

    /// The row up to which all intervals have equal length: the last, or the one before it.
    pub fn even(&self) -> u64 {
        self.even
    }

    /// Length of the last interval if it differs, otherwise 0, s.
    pub fn rest(&self) -> f64 {
        if self.even < self.intervals { self.until - self.interval.times(self.even) } else { 0.0 }
    }

    /// Time of the last row, the end of the run, s.
    pub fn end(&self) -> f64 {
        self.until
    }

    /// This grid without a last, shorter interval.
    pub(crate) fn beats(&self) -> Self {
        let near = (self.rest() / self.interval() - 1.0).abs() <= 2.0 * NEAR;
        if near || self.even == self.intervals {
            return *self;
        }
        Self { until: self.interval.times(self.even), intervals: self.even, ..*self }
    }
}

/// An interval as a fraction, so that multiples of it are rounded once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    length: f64,
    /// The fraction p/q.
    over: f64,
    under: f64,
    /// Largest k for which k p is exact.
    exact: u64,
    /// p/q − length.
    rest: f64,
}

/// 2⁵³: integers up to it are exact.
const WHOLE: f64 = 9_007_199_254_740_992.0;

/// Largest numerator and denominator of a fraction that may have been meant.
const LARGEST: f64 = 1e6;

impl Interval {
    /// The interval of this length, s.
    pub fn new(length: f64) -> Self {
        let (over, under) = decimal(length).or_else(|| fraction(length)).unwrap_or((length, 1.0));
        let exact = if over.fract() == 0.0 { (WHOLE / over) as u64 } else { 0 };
        Self { length, over, under, exact, rest: length.mul_add(-under, over) / under }
    }

    /// k p/q, rounded.
    #[inline]
    pub fn times(&self, k: u64) -> f64 {
        if k <= self.exact {
            return k as f64 * self.over / self.under;
        }
        // k·length, the error of that product, and the error of the length.
        let (k, h) = (k as f64, self.length);
        let product = k * h;
        product + (k.mul_add(h, -product) + k * self.rest)
    }
}

/// p and q = 10ⁿ with p/q = `value` to the last bit and at most fifteen digits in p.
fn decimal(value: f64) -> Option<(f64, f64)> {
    let powers = (0..=22).map(|n| 10_f64.powi(n));
    powers.map(|q| ((value * q).round(), q)).find(|&(p, q)| (1.0..1e15).contains(&p) && p / q == value)
}

/// Small p and q with p/q = `value` to the last bit, by its continued fraction: 1/3 of a second, 1/44100.
fn fraction(value: f64) -> Option<(f64, f64)> {
    let (mut before, mut now) = ((0.0, 1.0), (1.0, 0.0));
    let mut rest = value;
    for _ in 0..40 {
        let whole = rest.floor();
        (before, now) = (now, (whole * now.0 + before.0, whole * now.1 + before.1));
        if now.0.max(now.1) > LARGEST {
            return None;
        }
        if now.0 / now.1 == value {
            return Some(now);
        }
        rest = 1.0 / (rest - whole);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn times(every: f64, until: f64) -> Vec<f64> {
        let grid = Grid::new(every, until);
        (0..=grid.intervals()).map(|k| grid.time(k)).collect()
    }

    /// Times were k·until/n: 0.0029999999999999996 and the like for 95 of 301 rows.
    #[test]
    fn times_are_what_a_person_would_write() {
        for (every, text) in
            [(1e-3, "0.001"), (2e-3, "0.002"), (0.3, "0.3"), (0.37e-3, "0.00037"), (2.5e-5, "0.000025")]
        {
            let (whole, digits) = (text.trim_start_matches("0."), text.len() - 2);
            let p: u64 = whole.trim_start_matches('0').parse().unwrap();
            let grid = Grid::new(every, 5000.0 * every);
            for k in 0..5000 {
                // k p as a decimal number with this number of digits, parsed as by any program.
                let number = k * p;
                let scale = 10_u64.pow(digits as u32);
                let written: f64 = format!("{}.{:0digits$}", number / scale, number % scale).parse().unwrap();
                assert_eq!(grid.time(k).to_bits(), written.to_bits(), "row {k} of {text} s: {}", grid.time(k));
            }
        }
    }

    #[test]
    fn fractions_come_back_to_whole_numbers() {
        for n in [3_u64, 7, 60, 44_100] {
            let grid = Grid::new(1.0 / n as f64, 100.0);
            assert_eq!(grid.intervals(), 100 * n);
            for k in 0..100 {
                assert_eq!(grid.time(k * n), k as f64, "1/{n} s");
                assert_eq!(grid.time(k * n + 1), (k * n + 1) as f64 / n as f64, "1/{n} s");
            }
        }
        assert_eq!(times(2.0 / 3.0, 2.0), [0.0, 2.0 / 3.0, 4.0 / 3.0, 2.0]);
    }

    /// A run of 1 s with rows every 0.3 s ended silently at 0.9 s.
    #[test]
    fn the_last_row_is_at_the_end() {
        assert_eq!(times(0.3, 1.0), [0.0, 0.3, 0.6, 0.9, 1.0]);
        assert_eq!(times(0.4, 0.3), [0.0, 0.3]);
        assert_eq!(times(0.1, 0.3), [0.0, 0.1, 0.2, 0.3]);
        // Ten digits of a third are a third.
        assert_eq!(times(0.333_333_333_3, 1.0), [0.0, 0.333_333_333_3, 0.666_666_666_6, 1.0]);
        let grid = Grid::new(0.3, 1.0);
        assert_eq!((grid.intervals(), grid.even(), grid.rest()), (4, 3, 1.0 - 0.9));
        let beats = grid.beats();
        assert_eq!((beats.intervals(), beats.end(), beats.rest()), (3, 0.9, 0.0));
        let grid = Grid::new(1e-3, 1.0);
        assert_eq!((grid.intervals(), grid.even(), grid.rest(), grid.beats()), (1000, 1000, 0.0, grid));
    }

    proptest! {
        #[test]
        fn rows_rise_to_the_end(every in 1e-7..10.0f64, share in 1e-3..3000.0f64) {
            let until = every * share;
            let times = times(every, until);
            prop_assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
            prop_assert_eq!(times[times.len() - 1], until);
            for (k, time) in times[..times.len() - 1].iter().enumerate() {
                prop_assert!((time - k as f64 * every).abs() <= 1e-15 * until);
            }
            prop_assert!(times.windows(2).all(|pair| pair[1] - pair[0] <= every * (1.0 + 3e-6)));
        }
    }
}
