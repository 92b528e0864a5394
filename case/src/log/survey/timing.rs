//! The clock of a log: interval, jitter, gaps.

use super::{Note, Severity, percent, shown};
use crate::chance::median;

/// Steps longer than so many intervals are gaps.
pub(super) const GAP: f64 = 1.75;

/// Steps closer than this, as a share of the interval, are the same.
const SAME: f64 = 1e-6;

/// The clock of a log.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Timing {
    /// How many samples there are.
    pub samples: usize,
    /// From the first to the last, s.
    pub duration: f64,
    /// The usual interval, s: the median.
    pub interval: f64,
    /// Standard deviation of the intervals that are not gaps, s.
    pub jitter: f64,
    /// Shortest interval, s.
    pub shortest: f64,
    /// Step of the clock, s, where its intervals are few multiples of one: a clock that counts whole milliseconds.
    pub tick: Option<f64>,
    /// Where samples are missing, by the clock.
    pub gaps: Vec<Gap>,
}

/// A stretch without samples.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Gap {
    /// Time of the sample before it, s.
    pub at: f64,
    /// Until the next sample, s.
    pub length: f64,
    /// How many samples would have been there.
    pub missing: usize,
}

impl Timing {
    pub(super) fn new(time: &[f64]) -> Self {
        let steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let interval = median(&mut steps.clone());
        let gaps: Vec<Gap> = steps
            .iter()
            .zip(time)
            .filter(|(step, _)| **step > GAP * interval)
            .map(|(&length, &at)| Gap { at, length, missing: ((length / interval).round() as usize).saturating_sub(1) })
            .collect();
        let usual: Vec<f64> = steps.iter().copied().filter(|step| *step <= GAP * interval).collect();
        let n = usual.len().max(1) as f64;
        let mean = usual.iter().sum::<f64>() / n;
        Self {
            samples: time.len(),
            duration: time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first),
            interval,
            jitter: (usual.iter().map(|step| (step - mean).powi(2)).sum::<f64>() / n).sqrt(),
            shortest: steps.iter().copied().fold(f64::INFINITY, f64::min).min(interval),
            tick: tick(&usual, interval),
            gaps,
        }
    }

    pub(super) fn notes(&self) -> Vec<Note> {
        let mut notes = Vec::new();
        let interval = shown(self.interval, "s");
        if self.samples < 50 {
            let text = format!("there are {} samples only; intervals of a fit will be wide", self.samples);
            notes.push(Note::new("few-samples", Severity::Warning, text));
        }
        if self.interval > 0.5 {
            let text = format!(
                "a sample every {interval} is slow for a drive: are the times in ms? then set units = {{ time = \"ms\" }}"
            );
            notes.push(Note::new("time-unit", Severity::Suspicion, text));
        } else if self.interval > 0.05 {
            let text = format!("a sample every {interval} is too slow to resolve starts and stops");
            notes.push(Note::new("slow-sampling", Severity::Warning, text));
        } else if self.interval < 5e-6 {
            let text = format!(
                "a sample every {interval} is fast for a drive: are the times in a larger unit? then set units"
            );
            notes.push(Note::new("time-unit", Severity::Suspicion, text));
        }
        let jitter = self.jitter / self.interval;
        if let Some(tick) = self.tick {
            let text = format!(
                "the clock counts steps of {}, which is coarse for a sample every {interval}: if the recorder was even, say time = {{ every = \"...\" }}",
                shown(tick, "s")
            );
            notes.push(Note::new("coarse-clock", Severity::Warning, text));
        } else if jitter > 0.01 {
            let severity = if jitter > 0.1 { Severity::Warning } else { Severity::Fact };
            let text = format!(
                "intervals differ by {} of {interval} (standard deviation {})",
                percent(jitter),
                shown(self.jitter, "s")
            );
            notes.push(Note::new("jitter", severity, text));
        }
        if let Some(longest) = self.gaps.iter().max_by(|a, b| a.length.total_cmp(&b.length)) {
            let missing = self.gaps.iter().fold(0_usize, |sum, gap| sum.saturating_add(gap.missing));
            let share = missing as f64 / (missing as f64 + self.samples as f64);
            let (at, length) = (shown(longest.at, "s"), shown(longest.length, "s"));
            let text = match self.gaps.len() {
                1 => format!("one gap of {length} after {at}, where {missing} samples are missing"),
                n => format!(
                    "{n} gaps, where {missing} samples ({}) are missing; the longest is {length} after {at}",
                    percent(share)
                ),
            };
            let severity = if share > 0.01 { Severity::Warning } else { Severity::Fact };
            notes.push(Note::new("gaps", severity, text));
        }
        notes
    }
}

/// The step of a clock that is coarse for its samples.
fn tick(steps: &[f64], interval: f64) -> Option<f64> {
    let mut kinds: Vec<f64> = Vec::new();
    for &step in steps {
        if kinds.iter().all(|kind| (kind - step).abs() > SAME * interval) {
            kinds.push(step);
        }
        if kinds.len() > 6 {
            return None;
        }
    }
    kinds.sort_by(f64::total_cmp);
    let tick = kinds.windows(2).map(|pair| pair[1] - pair[0]).min_by(f64::total_cmp)?;
    let whole = |step: &f64| (step / tick - (step / tick).round()).abs() < 1e-3;
    (tick > 0.05 * interval && kinds.iter().all(whole)).then_some(tick)
}
