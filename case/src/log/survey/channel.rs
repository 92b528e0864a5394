//! One column of a log: its extent, steps, noise, and the samples that stand out.

use super::super::{Output, Quantity};
use super::timing::{GAP, Timing};
use super::{Note, Remedy, Severity, percent, quantile, shown};
use crate::chance::median;

/// Unit of an acceleration, which jumps by its nature.
const ACCELERATION: &str = "m/s^2";

/// An outlier is off by so many times the usual deviation from its neighbours.
const OUTLYING: f64 = 10.0;

/// A jump is this many times as large as any deviation of the neighbouring steps from their median; and the number of
/// those on either side.
const JUMP: f64 = 5.0;
const BESIDE: usize = 3;

/// Steps on either side of a zero that a magnitude turns at are so many times the resolution, are alike within this
/// factor, and end there within this factor of straight lines.
const FOLDED: f64 = 3.0;
const FOLD_ALIKE: f64 = 2.0;
const FOLD_SHARP: f64 = 1.7;

/// Samples from one value to the next that a zero of a magnitude is looked for in, for fast and slow crossings.
const FOLD_STRIDES: [usize; 3] = [1, 4, 16];

/// The mean speed over a held value is within this factor of the speeds before and behind it.
const CAUGHT_UP: f64 = 2.0;

/// Number of values that decide, on either side of a repeated value, whether noise would change it.
const NEAR: [usize; 2] = [20, 200];

/// The noise of a value that is repeated is at least this many times the resolution of its column.
const DITHERS: f64 = 3.0;

/// Correlation of neighbouring second differences below which they are noise and not the curve of a motion; that of
/// white noise is −2/3, of a random walk −1/2.
const ALTERNATE: f64 = -0.3;

/// Expected number of runs of equal values, as long as one that is reported, in a log with this noise.
const BY_CHANCE: f64 = 1e-6;

/// Steps differ by at least this share of the largest value, or by rounding alone.
const ROUNDING: f64 = 1e-6;

/// The shortest run at an extreme value that may be a limit, samples.
const CLIPPED: usize = 5;

/// The way before an extreme is reached abruptly if it is so many times that of an even turn.
const TURNS: f64 = 2.5;

/// Share of all samples from which on held values are a suspicion, however few there are in a row.
const HELD_MANY: f64 = 0.01;

/// Inputs of no more different values only switch.
const MOST_SWITCHED: usize = 30;

/// One column of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Key of a drive's input in a log, or the quantity's name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Least value.
    pub least: f64,
    /// Greatest value.
    pub greatest: f64,
    /// Samples without a value.
    pub missing: usize,
    /// The most samples without a value one after another.
    pub longest_missing: usize,
    /// Time at which those begin, s.
    pub missing_at: f64,
    /// Step of its values, where they are multiples of one.
    pub step: Option<f64>,
    /// Standard deviation of its noise, from third differences: the part that no smooth curve explains.
    pub noise: f64,
    /// Samples that stand out from their neighbours.
    pub outliers: Vec<Outlier>,
    /// The longest runs at the least and at the greatest value, where it reached that abruptly.
    pub clipped: Vec<Clipped>,
    /// Jumps by a full turn, where the column may be an angle that wraps.
    pub wraps: usize,
    /// Jumps of a position by any other amount.
    pub jumps: Vec<Jump>,
    /// Runs of a position that keep one value although the motion goes on, or although noise would change it.
    pub held: Vec<Held>,
    /// Runs of a position at rest that keep one value although noise would change it.
    pub frozen: Vec<Held>,
    /// Times at which a position or speed that is nowhere negative turns at zero without slowing down, s.
    pub folds: Vec<f64>,
    /// How many different values there are, counted up to 1000.
    pub levels: usize,
}

/// A sample that stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Outlier {
    /// Which sample, from 0.
    pub sample: usize,
    /// Its time, s.
    pub time: f64,
    /// Its value.
    pub value: f64,
    /// The value that its neighbours suggest.
    pub expected: f64,
}

/// A step from one sample to the next that the motion before and after it does not account for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// The first sample after it, from 0.
    pub sample: usize,
    /// The time of that sample, s.
    pub time: f64,
    /// Its size, beyond the usual step at that place.
    pub size: f64,
}

/// A value that is repeated although the motion goes on, and the next value has caught up with it; or although noise
/// would change it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Held {
    /// The first repeated sample, from 0.
    pub sample: usize,
    /// The time of that sample, s.
    pub time: f64,
    /// How many samples repeat the value.
    pub samples: usize,
    /// From the value to the next one.
    pub travel: f64,
}

impl Held {
    /// Its samples by their numbers in the log, from 1.
    fn words(&self) -> String {
        match self.samples {
            1 => format!("sample {}", self.sample + 1),
            n => format!("samples {} to {}", self.sample + 1, self.sample + n),
        }
    }
}

/// A run of equal values at an extreme.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Clipped {
    /// The extreme value.
    pub value: f64,
    /// Time at which it begins, s.
    pub at: f64,
    /// How long it lasts, samples.
    pub samples: usize,
}

impl Channel {
    pub(super) fn new(name: &'static str, unit: &'static str, values: &[f64], time: &[f64]) -> Self {
        let present: Vec<f64> = values.iter().copied().filter(|x| !x.is_nan()).collect();
        let least = present.iter().copied().fold(f64::INFINITY, f64::min);
        let greatest = present.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (longest_missing, first_missing) = longest_run(values, |x| x.is_nan());
        let mut sorted = present.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.dedup();
        let mut channel = Self {
            name,
            unit,
            least,
            greatest,
            missing: values.len() - present.len(),
            longest_missing,
            missing_at: time.get(first_missing).copied().unwrap_or_default(),
            step: step(&sorted, present.len()),
            noise: noise(values),
            outliers: Vec::new(),
            clipped: Vec::new(),
            wraps: 0,
            jumps: Vec::new(),
            held: Vec::new(),
            frozen: Vec::new(),
            folds: Vec::new(),
            levels: sorted.len().min(1000),
        };
        channel.clipped = channel.find_clipped(values, time);
        channel.wraps = channel.count_wraps(values);
        if channel.wraps == 0 {
            channel.held = channel.find_held(values, time);
            channel.find_frozen(values, time);
            channel.jumps = channel.find_jumps(values, time);
        }
        channel.folds = channel.find_folds(values, time);
        channel.outliers = channel.find_outliers(values, time);
        channel
    }

    /// From the least to the greatest value.
    pub fn span(&self) -> f64 {
        self.greatest - self.least
    }

    /// The resolution: the noise, or the rounding error of a step, whichever is more.
    pub fn resolution(&self) -> f64 {
        // A rounding error is evenly distributed: q / √12.
        self.noise.max(self.step.map_or(0.0, |q| q / 12f64.sqrt()))
    }

    /// True if there is one value only.
    pub fn is_constant(&self) -> bool {
        self.levels <= 1
    }

    fn count_wraps(&self, values: &[f64]) -> usize {
        let Some(turn) = self.turn() else { return 0 };
        let jumps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let usual = quantile(&jumps.clone().collect::<Vec<_>>(), 0.95);
        jumps.filter(|jump| (jump - turn).abs() < 0.1 * turn && *jump > 5.0 * usual).count()
    }

    /// True if it is the input of a drive.
    fn is_input(&self) -> bool {
        self.name.ends_with("input")
    }

    fn quantity(&self) -> Option<Quantity> {
        Quantity::all().find(|quantity| quantity.name() == self.name)
    }

    fn is_position(&self) -> bool {
        self.quantity().is_some_and(|quantity| quantity.is_position())
    }

    /// Where |x| turns at zero, if x passes it: samples a, b, c at b's minimum with steps of s on both sides have a + c
    /// = 2 s, of which a smooth turn has a fifth. Steps are taken over more samples only where those over fewer do not
    /// exceed the noise: a quick turn looks sharp in them.
    fn find_folds(&self, values: &[f64], time: &[f64]) -> Vec<f64> {
        let resolution = self.resolution();
        let is_signed = |quantity: Quantity| quantity.is_position() || quantity.is_speed();
        if !self.quantity().is_some_and(is_signed) || self.least < -FOLDED * resolution {
            return Vec::new();
        }
        let is_fold = |k: usize, (stride, most): (usize, f64)| {
            let reach = (BESIDE + 1) * stride;
            let step = |from: usize, to: usize| (values[from] - values[to]) / BESIDE as f64;
            let (fall, rise) = (step(k - reach, k - stride), step(k + reach, k + stride));
            let both = fall + rise;
            let apart = values[k - stride] + values[k + stride];
            let is_least = values[k] <= values[k - stride] && values[k] < values[k + stride];
            is_least
                && (FOLDED * resolution..most).contains(&fall.min(rise))
                && (1.0 / FOLD_ALIKE..FOLD_ALIKE).contains(&(fall / rise))
                && (1.0 / FOLD_SHARP..FOLD_SHARP).contains(&(apart / both))
                && values[k] < both
        };
        let mut folds: Vec<usize> = Vec::new();
        let mut finer: Option<usize> = None;
        for stride in FOLD_STRIDES {
            let reach = (BESIDE + 1) * stride;
            let most = finer.map_or(f64::INFINITY, |finer| FOLDED * resolution * (stride / finer) as f64);
            finer = Some(stride);
            for k in reach..values.len().saturating_sub(reach) {
                if is_fold(k, (stride, most)) && folds.iter().all(|fold| fold.abs_diff(k) > reach) {
                    folds.push(k);
                }
            }
        }
        folds.sort_unstable();
        folds.into_iter().map(|k| time[k]).collect()
    }

    /// Runs of equal values of a position that moves on both sides of them, and whose next value is where the motion
    /// has come to.
    fn find_held(&self, values: &[f64], time: &[f64]) -> Vec<Held> {
        if !self.is_position() {
            return Vec::new();
        }
        // Noise without the repeated values, which hide it.
        let mut distinct = values.to_vec();
        distinct.dedup();
        let least = OUTLYING * noise(&distinct).max(self.step.map_or(0.0, |q| q / 12f64.sqrt()));
        let speed = |a: usize, b: usize| (values[b] - values[a]) / (time[b] - time[a]);
        let mut held = Vec::new();
        let mut first = 0;
        for run in values.chunk_by(|a, b| a == b) {
            let (n, next) = (run.len(), first + run.len());
            // A whole number of such runs: of a sensor that is slower than the recorder all others are as long.
            let beside = n * BESIDE.div_ceil(n);
            if n > 1 && first >= beside && next + beside < values.len() {
                let (before, across, after) =
                    (speed(first - beside, first), speed(first, next), speed(next, next + beside));
                let [slow, fast] = [before.abs().min(after.abs()), before.abs().max(after.abs())];
                let goes_on = before * across > 0.0
                    && after * across > 0.0
                    && (slow / CAUGHT_UP..CAUGHT_UP * fast).contains(&across.abs());
                if goes_on && slow * (time[next - 1] - time[first]) > least {
                    let travel = values[next] - values[first];
                    held.push(Held { sample: first + 1, time: time[first + 1], samples: n - 1, travel });
                }
            }
            first = next;
        }
        held
    }

    /// Runs of equal values of a position that noise would change: of those around them it does, and they are too many
    /// for chance. Noise may grow with speed, so that a run in motion is a suspicion only.
    fn find_frozen(&mut self, values: &[f64], time: &[f64]) {
        if !self.is_position() {
            return;
        }
        let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        // Steps of a converter or of a printed number are no larger than the least difference of two values.
        let rounding = f64::EPSILON * self.least.abs().max(self.greatest.abs());
        let gaps = sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > 4.0 * rounding);
        let resolution = gaps.fold(f64::INFINITY, f64::min).max(self.step.unwrap_or_default());
        let by_chance = |n: usize, alike: f64| values.len() as f64 * alike.powf(n as f64 - 1.0);
        let mut first = 0;
        for run in values.chunk_by(|a, b| a == b) {
            let (start, n) = (first, run.len());
            first += n;
            let near = n.clamp(NEAR[0], NEAR[1]);
            let is_known = self.held.iter().any(|held| held.sample == start + 1)
                || self.clipped.iter().any(|clipped| clipped.value == run[0] && clipped.samples == n);
            // Shorter runs are no surprise, whatever is beside them.
            if n < 2 || is_known || by_chance(n, 1.0 / (near + 1) as f64) >= BY_CHANCE {
                continue;
            }
            let sides = [&values[start.saturating_sub(near)..start], &values[first..(first + near).min(values.len())]];
            let sides: Vec<Side> = sides.into_iter().filter(|side| side.len() >= NEAR[0]).map(Side::new).collect();
            let sigma = sides.iter().map(|side| side.noise).fold(f64::INFINITY, f64::min);
            if sides.is_empty() || sigma <= DITHERS * resolution || !sides.iter().all(Side::alternates) {
                continue;
            }
            // Two values of normal noise are rounded to one step: Δ/(2 √π σ).
            let alike = resolution / (2.0 * std::f64::consts::PI.sqrt() * sigma);
            let alike = sides.iter().map(|side| side.repeats).fold(alike, f64::max);
            if by_chance(n, alike) >= BY_CHANCE {
                continue;
            }
            let travel = values.get(first).map_or(0.0, |next| next - run[0]);
            let held = Held { sample: start + 1, time: time[start + 1], samples: n - 1, travel };
            let rests = |side: &Side| side.is_at_rest() && (side.mean - run[0]).abs() < BESIDE as f64 * sigma;
            match sides.iter().all(rests) {
                true => self.frozen.push(held),
                false => self.held.push(held),
            }
        }
    }

    /// Steps of a position that differ from the steps on both sides by far more than these do among each other, and do
    /// not catch up with a value that was held.
    fn find_jumps(&self, values: &[f64], time: &[f64]) -> Vec<Jump> {
        if !self.is_position() {
            return Vec::new();
        }
        let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let usual_interval = median(&mut time.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<_>>());
        // The step beyond the median of those beside it, and the largest such deviation of these themselves.
        let beyond = |k: usize| {
            let beside = [&steps[k - BESIDE..k], &steps[k + 1..=k + BESIDE]].concat();
            let middle = median(&mut beside.clone());
            let apart = beside.iter().map(|step| (step - middle).abs()).fold(0.0, f64::max);
            let is_regular = (k - BESIDE..=k + BESIDE).all(|k| time[k + 1] - time[k] < GAP * usual_interval);
            let is_known = steps[k - BESIDE..=k + BESIDE].iter().all(|step| step.is_finite());
            (is_regular && is_known).then_some((steps[k] - middle, apart))
        };
        let inner = BESIDE..steps.len().saturating_sub(BESIDE);
        let all: Vec<(usize, f64, f64)> =
            inner.filter_map(|k| beyond(k).map(|(size, apart)| (k, size, apart))).collect();
        let usual = 1.4826 * median(&mut all.iter().map(|(_, size, _)| size.abs()).collect::<Vec<_>>());
        // Counts make steps that differ by whole counts, which few samples show where it moves evenly.
        let largest =
            values.iter().filter(|value| value.is_finite()).fold(0.0, |most: f64, value| most.max(value.abs()));
        let sizes = all.iter().map(|(_, size, _)| size.abs()).filter(|size| *size > ROUNDING * largest);
        let count = sizes.fold(f64::INFINITY, f64::min);
        let count = if count.is_finite() { count } else { 0.0 };
        let least = OUTLYING * usual.max(self.resolution()).max(count);
        let caught_up = |k: usize| self.held.iter().any(|held| held.sample + held.samples == k + 1);
        let found = all.into_iter().filter(|(k, size, apart)| size.abs() > least.max(JUMP * apart) && !caught_up(*k));
        found.map(|(k, size, _)| Jump { sample: k + 1, time: time[k + 1], size }).collect()
    }

    /// Single samples that are far from both neighbours, on the same side; at an end of the log, from the only one.
    fn find_outliers(&self, values: &[f64], time: &[f64]) -> Vec<Outlier> {
        if self.is_input() || self.unit == ACCELERATION || values.len() < 10 {
            return Vec::new();
        }
        let off = |k: usize| values[k] - 0.5 * (values[k - 1] + values[k + 1]);
        let mut usual: Vec<f64> = (1..values.len() - 1).map(|k| off(k).abs()).filter(|x| x.is_finite()).collect();
        let usual = 1.4826 * median(&mut usual);
        let least = (OUTLYING * usual.max(self.resolution()))
            .max(0.02 * quantile(values, 0.99) - 0.02 * quantile(values, 0.01));
        let far = |k: &usize| {
            let (before, after) = (values[k - 1] - values[*k], values[k + 1] - values[*k]);
            before * after > 0.0 && before.abs().min(after.abs()) > least
        };
        let outlier =
            |sample: usize, expected: f64| Outlier { sample, time: time[sample], value: values[sample], expected };
        // The first or last position, where the step to it is far beyond those that follow, or came before. Currents
        // and speeds may begin with a step.
        let is_position = matches!(self.unit, "m" | "rad");
        let end = |sample: usize, beside: [usize; 3]| {
            let [a, b, c] = beside.map(|k| values[k]);
            let usual = (a - b).abs().max((b - c).abs());
            let off = (values[sample] - a).abs();
            (is_position && off > least.max(OUTLYING * usual)).then(|| outlier(sample, a))
        };
        let last = values.len() - 1;
        let first = end(0, [1, 2, 3]).into_iter();
        let inner = (1..last).filter(far).map(|k| outlier(k, values[k] - off(k)));
        first.chain(inner).chain(end(last, [last - 1, last - 2, last - 3])).collect()
    }

    /// The longest run at each extreme that was reached abruptly: by counts, and without slowing down before it.
    fn find_clipped(&self, values: &[f64], time: &[f64]) -> Vec<Clipped> {
        const REACH: usize = 5;
        if self.is_input() {
            return self.find_flat(values, time);
        }
        if self.levels < 10 || values.len() <= REACH {
            return Vec::new();
        }
        let slope = |k: usize| (values[k] - values[k - REACH]).abs();
        let steepest = quantile(&(REACH..values.len()).map(slope).collect::<Vec<_>>(), 0.95);
        let tolerance = 1e-9 * self.span();
        let count = self.step.unwrap_or_default().max(self.resolution());
        // The step to the extreme itself may be a part of one; the step before it is as long as those before.
        let is_sudden = |first: usize| {
            let last = (values[first - 1] - values[first - 2]).abs();
            last > 0.0 && last + count >= 0.7 * slope(first - 1) / REACH as f64
        };
        let at = |value: f64| {
            let (samples, first) = longest_run(values, |x| (x - value).abs() <= tolerance);
            // A turn with an even acceleration a stays n = 2 √(2 c/a)/h samples within a count c, and before that moves
            // by a (n + 5)/2 · 5 h² = c (20/n + 100/n²) in five samples.
            let n = samples as f64;
            let turning = count * (20.0 / n + 100.0 / (n * n));
            let least = (0.3 * steepest).max(6.0 * count).max(TURNS * turning);
            let abrupt = first > REACH && slope(first) > least && is_sudden(first);
            (samples >= CLIPPED && abrupt).then(|| Clipped { value, at: time[first], samples })
        };
        [self.least, self.greatest].into_iter().filter_map(at).collect()
    }

    /// Where an input that takes many values stays at its extreme, far longer than anywhere else: one that only
    /// switches does so by nature.
    fn find_flat(&self, values: &[f64], time: &[f64]) -> Vec<Clipped> {
        let tolerance = 1e-9 * self.span();
        let is_extreme = |x: f64| (x - self.least).abs() <= tolerance || (x - self.greatest).abs() <= tolerance;
        let (mut held, mut usual) = (0, 0);
        for same in values.chunk_by(|a, b| (a - b).abs() <= tolerance) {
            if same.len() >= CLIPPED && !is_extreme(same[0]) {
                held += same.len();
            } else if !is_extreme(same[0]) {
                usual += same.len();
            }
        }
        // A staircase, or a sequence of levels.
        if self.levels < MOST_SWITCHED || held * 4 > usual {
            return Vec::new();
        }
        let at = |value: f64| {
            let (samples, first) = longest_run(values, |x| (x - value).abs() <= tolerance);
            (samples >= CLIPPED && value != 0.0).then(|| Clipped { value, at: time[first], samples })
        };
        [self.least, self.greatest].into_iter().filter_map(at).collect()
    }

    /// Its extent in a line.
    pub(super) fn line(&self) -> String {
        let (least, greatest) = (shown(self.least, self.unit), shown(self.greatest, self.unit));
        if self.is_constant() {
            return format!("{}: {least} throughout", self.name);
        }
        let mut line = format!("{}: {least} to {greatest}", self.name);
        if let Some(step) = self.step {
            line += &format!(", in steps of {}", shown(step, self.unit));
        }
        if !self.is_input() && self.noise > 1e-4 * self.span() {
            line += &format!(", noise {}", shown(self.noise, self.unit));
        }
        line
    }

    pub(super) fn notes(&self, output: Option<&Output>, timing: &Timing) -> Vec<Note> {
        let mut notes = Vec::new();
        let mut note = |code, severity, text: String| notes.push(Note::new(code, severity, text).on(self.name));
        let value = |x: f64| shown(x, self.unit);
        let seconds = |t: f64| shown(t, "s");
        let samples = timing.samples as f64;
        if self.is_constant() {
            let text = format!("it is {} throughout", value(self.least));
            match output {
                None if self.least == 0.0 => note("constant", Severity::Warning, format!("{text}: nothing was fed in")),
                None => {
                    note("constant", Severity::Fact, "it never changes: the log shows one start and one speed".into());
                }
                Some(_) => note(
                    "constant",
                    Severity::Suspicion,
                    format!("{text}: is this the right column, and was it connected?"),
                ),
            }
            return notes;
        }
        if self.missing > 0 {
            let share = percent(self.missing as f64 / samples);
            let (run, at) = (self.longest_missing, seconds(self.missing_at));
            let severity = if self.missing as f64 > 0.05 * samples { Severity::Warning } else { Severity::Fact };
            note(
                "missing",
                severity,
                format!("{} samples have no value ({share}), at most {run} in a row, from {at} on", self.missing),
            );
        }
        // A commanded position stands where it is for as long as it likes.
        let is_position = output.is_none() && self.unit == "m";
        for &Clipped { value: limit, at, samples } in self.clipped.iter().filter(|_| !is_position) {
            let what = match output {
                Some(output) if output.quantity.is_position() => "an end stop, or the end of its sensor",
                Some(_) => "the limit of its sensor, perhaps",
                None => "it was limited there, and the motor may have received another value than the logged one",
            };
            let reached = if output.is_some() { ", reached abruptly" } else { "" };
            note(
                "saturation",
                Severity::Warning,
                format!(
                    "it stays at its extreme of {} for {samples} samples from {} on{reached}: {what}",
                    value(limit),
                    seconds(at)
                ),
            );
        }
        if self.wraps > 0 {
            let turn = if self.unit == "rad" { "a full turn" } else { "65536 steps" };
            note(
                "wraps",
                Severity::Suspicion,
                format!("it jumps by {turn} {} times: a counter that wraps; unwrap it before use", self.wraps),
            );
        }
        if let Some(output) = output.filter(|output| !output.absolute)
            && let Some(first) = self.folds.first()
        {
            let times = match self.folds.len() {
                1 => String::new(),
                n => format!(", and {} more times", n - 1),
            };
            let text = format!(
                "it is nowhere negative and turns at zero without slowing down, at {}{times}, as a magnitude does; log \
                 it with its sign, or set absolute = [\"{}\"]",
                seconds(*first),
                output.quantity.name()
            );
            note("magnitude", Severity::Suspicion, text);
        }
        if let Some(longest) = self.held.iter().max_by_key(|held| held.samples) {
            let n: usize = self.held.iter().map(|held| held.samples).sum();
            let (travel, at) = (value(longest.travel.abs()), seconds(longest.time));
            let many = if n == 1 { "one sample repeats".to_string() } else { format!("{n} samples repeat") };
            let text = format!(
                "{many} the value before although it moves on, at most {} in a row ({}), from {at} on, while it moves \
                 by {travel}: a sensor or recorder that holds its last value; leave these cells empty",
                longest.samples,
                longest.words()
            );
            let is_bad = longest.samples >= CLIPPED || n as f64 > HELD_MANY * samples;
            note("held", if is_bad { Severity::Suspicion } else { Severity::Warning }, text);
        }
        if let Some(longest) = self.frozen.iter().max_by_key(|held| held.samples) {
            let text = format!(
                "{} samples repeat the value before exactly ({}, from {} on), although its noise of \
                 {} changes it from one sample to the next everywhere else: a sensor or recorder that holds its last \
                 value; leave these cells empty",
                longest.samples,
                longest.words(),
                seconds(longest.time),
                value(self.noise),
            );
            note("frozen", Severity::Suspicion, text);
        }
        if !self.jumps.is_empty() {
            note("jumps", Severity::Suspicion, jumps_text(&self.jumps, self.unit));
        }
        if let Some(first) = self.outliers.first().filter(|_| self.wraps == 0) {
            let n = self.outliers.len();
            let (is, expected, at) = (value(first.value), value(first.expected), seconds(first.time));
            let text = match n {
                1 => format!("one sample stands out: {is} at {at}, between neighbours of {expected}"),
                n => format!(
                    "{n} samples stand out from their neighbours; the first is {is} at {at}, where {expected} would be usual"
                ),
            };
            note(
                "outliers",
                Severity::Warning,
                format!("{text}; leave such cells empty, or make the fit less sensitive to them (loss = \"huber\")"),
            );
        }
        if let Some(step) = self.step
            && output.is_some()
        {
            let steps = self.span() / step;
            if steps < 20.0 {
                note(
                    "quantisation",
                    Severity::Warning,
                    format!("its whole span of {} is {steps:.0} steps of {}", value(self.span()), value(step)),
                );
            }
        }
        if output.is_some() && self.noise > 0.05 * self.span() {
            let share = percent(self.noise / self.span());
            note("noise", Severity::Warning, format!("its noise, {}, is {share} of its span", value(self.noise)));
        }
        if let Some(output) = output.filter(|output| output.absolute)
            && self.least < -3.0 * self.resolution()
        {
            let negative = output.values.iter().filter(|x| **x < 0.0).count();
            note(
                "negative",
                Severity::Warning,
                format!("it is declared absolute, but {negative} samples are negative, down to {}", value(self.least)),
            );
        }
        if let Some(output) = output {
            notes.iter_mut().for_each(|note| note.remedy = self.remedy(note.code, output));
        }
        notes
    }

    /// The remedy for a note on an output, as far as samples show it.
    fn remedy(&self, code: &str, output: &Output) -> Option<Remedy> {
        match code {
            "wraps" => self.turn().map(|turn| Remedy::Unwrap(output.quantity, turn)),
            "magnitude" => Some(Remedy::Magnitude(output.quantity)),
            "jumps" => Some(Remedy::Step(output.quantity, self.jumps.clone())),
            "held" => {
                let samples = self.held.iter().flat_map(|held| held.sample..held.sample + held.samples).collect();
                Some(Remedy::Leave(output.quantity, samples))
            }
            "outliers" => {
                let samples = self.outliers.iter().map(|outlier| outlier.sample).collect();
                Some(Remedy::Leave(output.quantity, samples))
            }
            _ => None,
        }
    }

    /// The size of the jumps that a counter makes where it wraps.
    fn turn(&self) -> Option<f64> {
        match (self.unit, self.step) {
            (ACCELERATION, _) => None,
            ("rad", _) => Some(std::f64::consts::TAU),
            (_, step) => step.map(|step| 65536.0 * step),
        }
    }
}

/// The values beside a run of equal ones.
struct Side {
    /// Standard deviation of their noise.
    noise: f64,
    mean: f64,
    /// Difference of the means of their halves.
    drift: f64,
    /// Correlation of neighbouring second differences.
    memory: f64,
    /// Share of values that repeat the one before, as of a few more of them.
    repeats: f64,
}

impl Side {
    fn new(values: &[f64]) -> Self {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let (early, late) = values.split_at(values.len() / 2);
        let bends: Vec<f64> = values.windows(3).map(|y| y[0] - 2.0 * y[1] + y[2]).collect();
        let square: f64 = bends.iter().map(|bend| bend * bend).sum();
        let equal = values.windows(2).filter(|pair| pair[0] == pair[1]).count();
        Self {
            noise: noise(values),
            mean: mean(values),
            drift: mean(late) - mean(early),
            memory: bends.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / square,
            repeats: (equal as f64 + 1.0) / (values.len() as f64 + 1.0),
        }
    }

    fn alternates(&self) -> bool {
        self.memory < ALTERNATE
    }

    fn is_at_rest(&self) -> bool {
        self.drift.abs() < self.noise
    }
}

/// The note on jumps of a position in this unit; there is at least one.
pub fn jumps_text(jumps: &[Jump], unit: &str) -> String {
    let first = jumps.first().map(|jump| format!("{} at {}", shown(jump.size, unit), shown(jump.time, "s")));
    let more = match jumps.len() {
        0 | 1 => String::new(),
        2 => ", and once more".into(),
        n => format!(", and {} more times", n - 1),
    };
    format!(
        "it jumps by {}{more}, which is not motion: lost counts, a counter that was reset, a belt that skipped teeth, or \
         samples that were dropped without a gap in time; take the jumps out, or split the log there",
        first.unwrap_or_default()
    )
}

/// Length and first sample of the longest run that satisfies `holds`.
fn longest_run(values: &[f64], holds: impl Fn(f64) -> bool) -> (usize, usize) {
    let (mut best, mut run) = ((0, 0), 0);
    for (k, &value) in values.iter().enumerate() {
        run = if holds(value) { run + 1 } else { 0 };
        if run > best.0 {
            best = (run, k + 1 - run);
        }
    }
    best
}

/// Step of an encoder or converter: all values are multiples of it, but for their rounding in print. None where they
/// are not, or where there are too few.
///
/// ```
/// use taut::log::step_of;
/// let counts: Vec<f64> = (0..40).map(|k| f64::from(k * k % 17) * 0.25).collect();
/// assert_eq!(step_of(&counts), Some(0.25));
/// ```
pub fn step_of(values: &[f64]) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let samples = sorted.len();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    step(&sorted, samples)
}

/// The step of which all values are multiples, give or take their rounding in print; `sorted` has each once.
fn step(sorted: &[f64], samples: usize) -> Option<f64> {
    if sorted.len() < 3 || samples < 10 {
        return None;
    }
    let gaps: Vec<f64> = sorted.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let largest = sorted[0].abs().max(sorted[sorted.len() - 1].abs());
    let rounding = 1e-12 * largest;
    let least = gaps.iter().copied().filter(|gap| *gap > rounding).fold(f64::INFINITY, f64::min);
    let mut q =
        median(&mut gaps.iter().copied().filter(|gap| *gap > rounding && *gap < 1.5 * least).collect::<Vec<_>>());
    if !q.is_finite() || q <= 0.0 {
        return None;
    }
    // From one value to the next, the multiple counted so far refines the step.
    let (mut count, mut off, mut short) = (0.0, 0, 0);
    for (gap, value) in gaps.iter().zip(&sorted[1..]) {
        let steps = (gap / q).round();
        short += usize::from(steps < 20.0);
        off += usize::from((gap / q - steps).abs() > 0.25 && steps < 20.0);
        count += steps;
        if count >= 10.0 {
            q = (value - sorted[0]) / count;
        }
    }
    // Values of any size have gaps of any size, most of them far longer than the shortest.
    (off * 50 <= gaps.len() && short * 2 >= gaps.len()).then_some(q)
}

/// Standard deviation of what is not smooth.
fn noise(values: &[f64]) -> f64 {
    // d = y₀ − 3 y₁ + 3 y₂ − y₃ of white noise has the variance (1 + 9 + 9 + 1) σ²
    let mut thirds: Vec<f64> =
        values.windows(4).map(|y| (y[0] - 3.0 * y[1] + 3.0 * y[2] - y[3]).abs()).filter(|x| x.is_finite()).collect();
    1.4826 * median(&mut thirds) / 20f64.sqrt()
}
