//! Scales: the range that is shown, the ticks on it, and what is written at them.

/// True if a value can be shown at all.
pub(crate) fn in_range(value: f64) -> bool {
    value.abs() < 1e300
}

/// Values to coordinates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    pub lo: f64,
    pub hi: f64,
    pub log: bool,
    /// An angle in degrees, whose ticks are parts of a turn.
    pub degrees: bool,
}

impl Scale {
    /// A scale that shows all `values`; `tight` ends at the outermost ones, otherwise there is some air.
    pub fn covering(values: impl Iterator<Item = f64>, log: bool, tight: bool) -> Self {
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in values.filter(|v| in_range(*v) && (!log || *v > 0.0)) {
            lo = lo.min(v);
            hi = hi.max(v);
        }
        if lo > hi {
            (lo, hi) = if log { (1.0, 10.0) } else { (0.0, 1.0) };
        }
        if log {
            if hi / lo < 1.001 {
                (lo, hi) = (lo / 2.0, hi * 2.0);
            }
            let air = if tight { 1.0 } else { (hi / lo).powf(0.05) };
            return Self { lo: lo / air, hi: hi * air, log, degrees: false };
        }
        if hi - lo <= 1e-12 * lo.abs().max(hi.abs()) {
            let half = if lo == 0.0 { 1.0 } else { 0.05 * lo.abs() };
            (lo, hi) = (lo - half, hi + half);
        } else if !tight {
            // Zero belongs to the picture where it is near; a curve that ends at zero may touch the frame.
            if lo > 0.0 && lo < 0.3 * hi {
                lo = 0.0;
            }
            if hi < 0.0 && hi > 0.3 * lo {
                hi = 0.0;
            }
            let air = 0.06 * (hi - lo);
            (lo, hi) = (if lo == 0.0 { 0.0 } else { lo - air }, if hi == 0.0 { 0.0 } else { hi + air });
        }
        Self { lo, hi, log, degrees: false }
    }

    /// Where `value` lies, 0 at the lower end and 1 at the upper.
    pub fn place(&self, value: f64) -> f64 {
        if self.log {
            (value.max(f64::MIN_POSITIVE) / self.lo).ln() / (self.hi / self.lo).ln()
        } else {
            (value - self.lo) / (self.hi - self.lo)
        }
    }

    /// About `wanted` round values, each with its text.
    pub fn ticks(&self, wanted: usize) -> Vec<(f64, String)> {
        let wanted = wanted.max(2) as f64;
        let decades = if self.log { (self.hi / self.lo).log10() } else { 0.0 };
        if decades >= 1.0 {
            let factors: &[f64] = if decades * 3.0 <= wanted + 1.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
            let every = ((decades / wanted).ceil() as i32).max(1);
            let first = self.lo.log10().floor() as i32;
            let last = self.hi.log10().ceil() as i32;
            return (first..=last)
                .filter(|d| d.rem_euclid(every) == 0)
                .flat_map(|d| factors.iter().map(move |f| f * 10f64.powi(d)))
                .filter(|&v| v >= self.lo * (1.0 - 1e-9) && v <= self.hi * (1.0 + 1e-9))
                .map(|v| (v, power(v)))
                .collect();
        }
        let rough = (self.hi - self.lo) / wanted;
        let step = if self.degrees { round_angle(rough) } else { round_step(rough) };
        let (first, last) = ((self.lo / step - 1e-6).ceil(), (self.hi / step + 1e-6).floor());
        if !(step > 0.0 && last - first < 100.0) {
            return Vec::new();
        }
        let count = (last - first) as i64;
        let largest = self.lo.abs().max(self.hi.abs());
        (0..=count).map(|i| (first + i as f64) * step).map(|v| (v, label(v, step, largest))).collect()
    }
}

/// The text of a tick on a logarithmic axis: 10⁻⁴, 2×10⁵, or the number itself where it is short.
fn power(value: f64) -> String {
    let text = taut::number::engineering(value, "", 3);
    text.strip_prefix("1×").map_or(text.clone(), str::to_string)
}

/// 1, 2 or 5 times a power of ten, at least about `rough`.
fn round_step(rough: f64) -> f64 {
    let power = 10f64.powf(rough.log10().floor());
    let mantissa = rough / power;
    let round = [1.0, 2.0, 5.0, 10.0].into_iter().find(|m| mantissa <= m * 1.0001).unwrap_or(10.0);
    round * power
}

/// Parts of a turn, and whole turns; below 15° as for any other number.
fn round_angle(rough: f64) -> f64 {
    if rough <= 10.0 {
        return round_step(rough);
    }
    let part = [15.0, 30.0, 45.0, 90.0, 180.0].into_iter().find(|part| rough <= part * 1.0001);
    part.unwrap_or_else(|| 360.0 * round_step(rough / 360.0).max(1.0))
}

/// A tick's text: as many decimals as the step needs, powers of ten beyond comfortable lengths.
fn label(value: f64, step: f64, largest: f64) -> String {
    let value = if value.abs() < 1e-9 * step { 0.0 } else { value };
    if !(1e-4..1e6).contains(&largest) {
        let digits = (largest / step).log10().ceil().clamp(0.0, 15.0) as usize + 1;
        return taut::number::engineering(value, "", digits);
    }
    taut::number::fixed(value, (-(step * 1.0001).log10().floor()).clamp(0.0, 17.0) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(lo: f64, hi: f64, log: bool) -> String {
        Scale { lo, hi, log, degrees: false }.ticks(5).into_iter().map(|t| t.1).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(words(0.0, 1.0, false), "0.0 0.2 0.4 0.6 0.8 1.0");
        assert_eq!(words(-57.0, 60.0, false), "−50 0 50");
        assert_eq!(words(0.053744, 0.053746, false), "0.0537440 0.0537445 0.0537450 0.0537455 0.0537460");
        assert_eq!(words(1.0, 1000.0, true), "1 10 100 1000");
        assert_eq!(words(1e-5, 1.0, true), "10⁻⁵ 10⁻⁴ 0.001 0.01 0.1 1");
        assert_eq!(words(0.0, 2.5e-7, false), "0 5×10⁻⁸ 1×10⁻⁷ 1.5×10⁻⁷ 2×10⁻⁷ 2.5×10⁻⁷");
    }

    /// Phases stood at every 200°, where no engineer looks for them.
    #[test]
    fn ticks_of_phases_are_parts_of_a_turn() {
        let steps = |lo: f64, wanted| -> Vec<f64> {
            let scale = Scale { lo, hi: 0.0, log: false, degrees: true };
            scale.ticks(wanted).into_iter().map(|tick| tick.0).collect()
        };
        assert_eq!(steps(-800.0, 4), [-720.0, -360.0, 0.0]);
        assert_eq!(steps(-560.0, 4), [-540.0, -360.0, -180.0, 0.0]);
        assert_eq!(steps(-270.0, 4), [-270.0, -180.0, -90.0, 0.0]);
        assert_eq!(steps(-100.0, 4), [-90.0, -60.0, -30.0, 0.0]);
        assert_eq!(steps(-20.0, 4), [-20.0, -15.0, -10.0, -5.0, 0.0]);
    }

    #[test]
    fn nothing_to_show_is_shown_as_nothing() {
        for values in [vec![], vec![f64::NAN], vec![0.0], vec![3.0, 3.0], vec![f64::MAX, f64::MIN]] {
            for log in [false, true] {
                let scale = Scale::covering(values.iter().copied(), log, false);
                assert!(scale.lo < scale.hi && scale.place(scale.lo) == 0.0, "{values:?}");
                assert!(scale.ticks(5).len() < 20);
            }
        }
    }
}
