//! The command after the profile.

/// Amplitude of the command's oscillation after the profile.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Swing {
    /// In the first half of the rest, V or A.
    pub early: f64,
    /// In the second half.
    pub late: f64,
    /// In the second half, Hz; 0 without oscillation.
    pub frequency: f64,
    /// Number of cycles in the second half.
    pub cycles: f64,
}

/// Gathers a [`Swing`], sample by sample.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rest {
    from: f64,
    middle: f64,
    early: (f64, f64),
    late: (f64, f64),
    below: bool,
    upward: (f64, f64, u64),
}

impl Rest {
    pub fn new(from: f64, until: f64) -> Self {
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        Self { from, middle: 0.5 * (from + until), early: none, late: none, below: false, upward: (0.0, 0.0, 0) }
    }

    /// A command that was given at a sample.
    pub fn see(&mut self, time: f64, given: f64) {
        if time < self.from {
            return;
        }
        let wider = |(low, high): (f64, f64)| (low.min(given), high.max(given));
        if time < self.middle {
            self.early = wider(self.early);
            return;
        }
        self.late = wider(self.late);
        // Upward crossing of the middle of its earlier range, with a hysteresis band.
        let (low, high) = self.early;
        let (level, band) = (0.5 * (low + high), 0.2 * 0.5 * (high - low));
        if given < level - band {
            self.below = true;
        } else if given > level + band && self.below {
            self.below = false;
            let (first, _, count) = self.upward;
            self.upward = (if count == 0 { time } else { first }, time, count + 1);
        }
    }

    pub fn swing(&self) -> Swing {
        let half = |(low, high): (f64, f64)| if high > low { 0.5 * (high - low) } else { 0.0 };
        let (first, last, count) = self.upward;
        let cycles = count.saturating_sub(1) as f64;
        let frequency = if last > first { cycles / (last - first) } else { 0.0 };
        Swing { early: half(self.early), late: half(self.late), frequency, cycles }
    }
}
