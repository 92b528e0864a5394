//! Progress of a run: whether it will end, and when to ask the receiver to continue.

use super::Ending;

/// Number of steps or examined intervals after which the receiver is asked to continue, with or without new rows.
pub(super) const STEPS_BETWEEN_QUESTIONS: u64 = 4096;

/// Steps before a forecast is made, and the most that a run may need: some minutes to an hour.
const STEPS_BEFORE_FORECAST: u64 = 1 << 20;
pub(super) const MOST_STEPS: f64 = 1e10;

/// Events allowed at once, per simulated second, and in all: more is an accumulation, not a machine, or fills the
/// memory.
const EVENTS_AT_LEAST: f64 = 1e5;
const EVENTS_PER_SECOND: f64 = 1e7;
const EVENTS_AT_MOST: f64 = 2e7;

/// Most events of a run up to `time`, s.
pub(super) fn most_events(time: f64) -> f64 {
    f64::min(EVENTS_AT_LEAST + EVENTS_PER_SECOND * time, EVENTS_AT_MOST)
}

/// Progress of a run at the last check.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pace {
    steps: u64,
    time: f64,
}

impl Pace {
    /// Starts at this number of steps and this time.
    pub(super) fn since(steps: u64, time: f64) -> Self {
        Self { steps, time }
    }

    /// The ending of a run that, at its pace since the last check, would need more than [`MOST_STEPS`] steps.
    pub(super) fn too_stiff(&mut self, steps: u64, time: f64, end: f64) -> Option<Ending> {
        if steps - self.steps < STEPS_BEFORE_FORECAST {
            return None;
        }
        let per_second = (steps - self.steps) as f64 / (time - self.time);
        let forecast = steps as f64 + per_second * (end - time);
        *self = Self { steps, time };
        // If no time has passed, the forecast is infinite or NaN.
        (forecast.is_nan() || forecast > MOST_STEPS).then_some(Ending::TooStiff { time, steps: forecast })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_that_crawls_is_told() {
        let mut pace = Pace::default();
        assert_eq!(pace.too_stiff(1 << 19, 0.1, 1.0), None);
        assert_eq!(pace.too_stiff(1 << 20, 0.1, 1.0), None);
        let ending = pace.too_stiff(1 << 21, 0.1 + 1e-6, 1.0);
        assert!(matches!(ending, Some(Ending::TooStiff { steps, .. }) if steps > 9e11 && steps < 1e12), "{ending:?}");
        assert!(matches!(pace.too_stiff(1 << 22, 0.1 + 1e-6, 1.0), Some(Ending::TooStiff { .. })));
    }
}
