//! Candidate inputs, each described by a few numbers.

use crate::fit::limits::{MOST_BITS, MOST_CYCLES, MULTISINE_TONES, REST_AT_END, SWEEP_SINES};
use crate::signal::{Signal, Slot, Tone};
use std::f64::consts::PI;

/// A kind of input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Excitation {
    /// Trapezoids there and back, every second one smaller.
    Trapezoid,
    /// Sines in succession, whole periods of each.
    Sweep,
    /// A sine whose frequency changes linearly.
    Chirp,
    /// A sum of sines.
    Multisine,
    /// A pseudo-random binary sequence.
    Prbs,
}

impl Excitation {
    /// All kinds.
    pub const ALL: [Excitation; 5] =
        [Excitation::Trapezoid, Excitation::Sweep, Excitation::Chirp, Excitation::Multisine, Excitation::Prbs];

    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Trapezoid => "trapezoid",
            Self::Sweep => "sweep",
            Self::Chirp => "chirp",
            Self::Multisine => "multisine",
            Self::Prbs => "prbs",
        }
    }

    /// Number of variables of a search, the amplitude first.
    pub(super) fn numbers(self) -> usize {
        match self {
            Self::Trapezoid | Self::Sweep => 5,
            Self::Multisine => 4,
            Self::Chirp | Self::Prbs => 3,
        }
    }
}

/// Limits of a search.
pub(super) struct SearchLimits {
    /// Greatest input, V or A.
    pub input: f64,
    /// Length, s.
    pub duration: f64,
    /// Interval between samples, s: corners and steps lie on it, so that a log describes them exactly.
    pub every: f64,
    /// Lowest and highest frequency, Hz.
    pub frequencies: [f64; 2],
}

/// An input of a kind, with its numbers rounded as written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// From zero in `ramp` to ± `amplitude`, held for `hold`, back in `ramp`, zero for `rest`; forward, then backward,
    /// repeated.
    Trapezoid {
        /// Greatest value.
        amplitude: f64,
        /// s.
        ramp: f64,
        /// s.
        hold: f64,
        /// s.
        rest: f64,
        /// Amplitude of every second repetition, relative to the first.
        ratio: f64,
        /// Number of repetitions there and back.
        cycles: usize,
    },
    /// Sines from one frequency to the other, evenly spaced logarithmically.
    Sweep {
        /// Amplitude of the greatest sine.
        amplitude: f64,
        /// Hz.
        from: f64,
        /// Hz.
        to: f64,
        /// Number of sines.
        sines: usize,
        /// Amplitude ∝ frequency to this power.
        tilt: f64,
        /// Approximate duration of each, s.
        each: f64,
    },
    /// A sine whose frequency changes linearly.
    Chirp {
        /// Peak.
        amplitude: f64,
        /// Hz.
        from: f64,
        /// Hz.
        to: f64,
        /// s.
        over: f64,
    },
    /// Equal sines with Schroeder's phases.
    Multisine {
        /// Amplitude of each sine.
        amplitude: f64,
        /// Hz.
        from: f64,
        /// Hz.
        to: f64,
        /// Number of sines.
        tones: usize,
        /// s.
        lasts: f64,
    },
    /// ± `amplitude`.
    Prbs {
        /// Height.
        amplitude: f64,
        /// Length of a bit, s.
        bit: f64,
        /// Seed of the sequence.
        seed: u64,
        /// s.
        lasts: f64,
    },
}

/// Rounds to four digits.
fn round(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// Rounds a time, s, to what is written of it.
fn rounded(time: f64) -> f64 {
    format!("{time:.9}").parse().unwrap_or(time)
}

/// Between two positive numbers, on a logarithmic scale.
fn between(share: f64, low: f64, high: f64) -> f64 {
    low * (high / low).max(1.0).powf(share)
}

impl Shape {
    /// Candidate of a kind at a point of the unit cube.
    pub(super) fn at(kind: Excitation, share: &[f64], room: &SearchLimits) -> Self {
        let &SearchLimits { input, duration, every, frequencies: [low, high] } = room;
        // A whole number of intervals.
        let whole = |time: f64, least: f64| rounded(every * (time / every).round().max(least));
        let busy = whole(duration * (1.0 - REST_AT_END), 1.0);
        let amplitude = round(between(share[0], 0.05 * input, input));
        let frequency = |share: f64| round(between(share, low, high));
        let apart = |a: f64, b: f64| if a < b { (a, b) } else { (b, round(a.max(b * 1.05))) };
        match kind {
            Excitation::Trapezoid => {
                let cycles = between(share[1], 1.0, MOST_CYCLES).round();
                let half = busy / (2.0 * cycles);
                let (ramp, rest) = (0.45 * between(share[2], 0.002, 1.0), 0.6 * share[3]);
                let [ramp, rest] = [whole(ramp * half * (1.0 - rest), 1.0), whole(rest * half, 0.0)];
                let hold = whole(half - rest - 2.0 * ramp - 0.5 * every, 0.0);
                let ratio = round(0.2 + 0.8 * share[4]);
                Self::Trapezoid { amplitude, ramp, hold, rest, ratio, cycles: cycles as usize }
            }
            Excitation::Sweep => {
                let sines = between(share[3], 1.0, SWEEP_SINES).round();
                let (from, to) = (frequency(share[1]), frequency(share[2]));
                let each = round(busy / sines);
                Self::Sweep { amplitude, from, to, sines: sines as usize, tilt: round(share[4]), each }
            }
            Excitation::Chirp => {
                Self::Chirp { amplitude, from: frequency(share[1]), to: frequency(share[2]), over: busy }
            }
            Excitation::Multisine => {
                let (from, to) = apart(frequency(share[1]), frequency(share[2]));
                let tones = between(share[3], 2.0, MULTISINE_TONES).round() as usize;
                Self::Multisine { amplitude, from, to, tones, lasts: busy }
            }
            Excitation::Prbs => {
                let least = (0.5 / high).max(duration / MOST_BITS);
                let bit = whole(between(share[1], least, 0.25 * duration), 1.0);
                let seed = 1 + (share[2] * 9.0).floor() as u64;
                Self::Prbs { amplitude, bit, seed, lasts: busy }
            }
        }
    }

    /// Its kind.
    pub fn kind(&self) -> Excitation {
        match self {
            Self::Trapezoid { .. } => Excitation::Trapezoid,
            Self::Sweep { .. } => Excitation::Sweep,
            Self::Chirp { .. } => Excitation::Chirp,
            Self::Multisine { .. } => Excitation::Multisine,
            Self::Prbs { .. } => Excitation::Prbs,
        }
    }

    /// True if the input jumps to zero at its end from any value in between.
    pub(super) fn ends_with_a_jump(&self) -> bool {
        matches!(self, Self::Chirp { .. } | Self::Multisine { .. })
    }

    /// This candidate with another amplitude.
    pub(super) fn scaled(mut self, factor: f64) -> Self {
        match &mut self {
            Self::Trapezoid { amplitude, .. }
            | Self::Sweep { amplitude, .. }
            | Self::Chirp { amplitude, .. }
            | Self::Multisine { amplitude, .. }
            | Self::Prbs { amplitude, .. } => *amplitude = round(*amplitude * factor),
        }
        self
    }

    /// Times and values of the corners of a trapezoid.
    pub(super) fn corners(&self) -> Vec<[f64; 2]> {
        let &Self::Trapezoid { amplitude, ramp, hold, rest, ratio, cycles } = self else { return Vec::new() };
        let (mut points, mut t) = (vec![[0.0, 0.0]], 0.0);
        for half in 0..2 * cycles {
            let size = if half / 2 % 2 == 0 { amplitude } else { round(amplitude * ratio) };
            let value = if half % 2 == 0 { size } else { -size };
            for (takes, next) in [(ramp, value), (hold, value), (ramp, 0.0), (rest, 0.0)] {
                if takes > 0.0 {
                    t = rounded(t + takes);
                    points.push([t, next]);
                }
            }
        }
        points
    }

    /// The sines of a sweep: amplitude, frequency, duration.
    pub(super) fn sines(&self) -> Vec<[f64; 3]> {
        let &Self::Sweep { amplitude, from, to, sines, tilt, each } = self else { return Vec::new() };
        let most = from.max(to);
        let one = |k: usize| {
            let share = if sines > 1 { k as f64 / (sines - 1) as f64 } else { 0.0 };
            let frequency = round(from * (to / from).powf(share));
            let periods = (each * frequency).round().max(1.0);
            [round(amplitude * (frequency / most).powf(tilt)), frequency, round(periods / frequency)]
        };
        let mut left = each * sines as f64 * 1.02;
        let mut all = (0..sines).map(one).collect::<Vec<_>>();
        // Slow sines that last longer than their share displace the last ones.
        all.retain(|[_, _, lasts]| {
            left -= lasts;
            left >= 0.0
        });
        all
    }

    /// As an input of the solver.
    pub fn signal(&self) -> Signal {
        let ended = |signal: Signal, lasts: f64| {
            let nothing = Slot { signal: Signal::Step { value: 0.0, at: 0.0 }, lasts: f64::INFINITY };
            Signal::sequence(vec![Slot { signal, lasts }, nothing])
        };
        match *self {
            Self::Trapezoid { .. } => Signal::Table { points: self.corners() },
            Self::Sweep { .. } => {
                let slot = |[amplitude, frequency, lasts]: [f64; 3]| Slot {
                    signal: Signal::Sine { amplitude, frequency, phase: 0.0, offset: 0.0 },
                    lasts,
                };
                let mut slots: Vec<Slot> = self.sines().into_iter().map(slot).collect();
                slots.push(Slot { signal: Signal::Step { value: 0.0, at: 0.0 }, lasts: f64::INFINITY });
                Signal::sequence(slots)
            }
            Self::Chirp { amplitude, from, to, over } => Signal::Chirp { amplitude, from, to, over },
            Self::Multisine { amplitude, from, to, tones, lasts } => {
                let n = tones as f64;
                let tone = |i: usize| {
                    let k = (i + 1) as f64;
                    let frequency = from + (to - from) * i as f64 / (n - 1.0);
                    // φ_k = −π k (k − 1) / N, as the case file has them
                    Tone { amplitude, frequency, phase: -PI * k * (k - 1.0) / n }
                };
                ended(Signal::Multisine { tones: (0..tones).map(tone).collect() }, lasts)
            }
            Self::Prbs { amplitude, bit, seed, lasts } => ended(Signal::Prbs { amplitude, bit, seed }, lasts),
        }
    }

    /// In the notation of the case file; `unit` is that of the amplifier's input.
    pub fn toml(&self, unit: &str) -> String {
        match *self {
            Self::Trapezoid { .. } => {
                let points: Vec<String> = self.corners().iter().map(|[t, u]| format!("[{t}, {u}]")).collect();
                let lines: Vec<String> = points.chunks(5).map(|points| format!("    {}", points.join(", "))).collect();
                format!("{{ table = [\n{},\n] }}", lines.join(",\n"))
            }
            Self::Sweep { .. } => {
                let one = |[amplitude, frequency, lasts]: [f64; 3]| {
                    format!(
                        "    {{ sine = \"{amplitude} {unit}\", frequency = \"{frequency} Hz\", lasts = \"{lasts} s\" }},\n"
                    )
                };
                format!("{{ sequence = [\n{}] }}", self.sines().into_iter().map(one).collect::<String>())
            }
            Self::Chirp { amplitude, from, to, over } => format!(
                "{{ chirp = \"{amplitude} {unit}\", from = \"{from} Hz\", to = \"{to} Hz\", over = \"{over} s\" }}"
            ),
            Self::Multisine { amplitude, from, to, tones, lasts } => format!(
                "{{ sequence = [\n    {{ multisine = \"{amplitude} {unit}\", from = \"{from} Hz\", to = \"{to} Hz\", \
                 tones = {tones}, lasts = \"{lasts} s\" }},\n] }}"
            ),
            Self::Prbs { amplitude, bit, seed, lasts } => format!(
                "{{ sequence = [\n    {{ prbs = \"{amplitude} {unit}\", bit = \"{bit} s\", seed = {seed}, lasts = \"{lasts} s\" }},\n] }}"
            ),
        }
    }

    /// In words.
    pub fn words(&self, unit: &str) -> String {
        let shown = |value: f64, unit: &str| crate::number::engineering_typed(value, unit, 3);
        match *self {
            Self::Trapezoid { amplitude, ramp, hold, ratio, cycles, .. } => {
                let times = if cycles == 1 { "once".to_string() } else { format!("{cycles} times") };
                let other = match cycles {
                    1 => String::new(),
                    _ => format!(", every other one with {:.0} % of it", 100.0 * ratio),
                };
                format!(
                    "trapezoids there and back, {times}: {} in {}, held for {}{other}",
                    shown(amplitude, unit),
                    shown(ramp, "s"),
                    shown(hold, "s")
                )
            }
            Self::Sweep { amplitude, .. } => {
                let sines: Vec<String> = self.sines().iter().map(|[_, f, _]| shown(*f, "Hz")).collect();
                format!("sines one after another, {} at most: {}", shown(amplitude, unit), sines.join(", "))
            }
            Self::Chirp { amplitude, from, to, over } => format!(
                "a sine of {} from {} to {} in {}",
                shown(amplitude, unit),
                shown(from, "Hz"),
                shown(to, "Hz"),
                shown(over, "s")
            ),
            Self::Multisine { amplitude, from, to, tones, .. } => format!(
                "{tones} sines of {} at once, from {} to {}",
                shown(amplitude, unit),
                shown(from, "Hz"),
                shown(to, "Hz")
            ),
            Self::Prbs { amplitude, bit, .. } => {
                format!("a pseudo-random binary sequence of ± {}, {} a bit", shown(amplitude, unit), shown(bit, "s"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Candidates of 4 s at these points of the unit cube.
    fn candidates(shares: [f64; 5]) -> [Shape; 5] {
        let room = SearchLimits { input: 5.0, duration: 4.0, every: 1e-3, frequencies: [0.25, 200.0] };
        Excitation::ALL.map(|kind| Shape::at(kind, &shares, &room))
    }

    /// How the axis comes to rest is observed, too.
    #[test]
    fn every_input_lasts_nearly_to_the_end_and_leaves_time_to_come_to_rest() {
        for shape in candidates([1.0, 0.5, 0.7, 0.0, 1.0]) {
            let signal = shape.signal();
            let values: Vec<f64> = (0..4000).map(|k| signal.value(1e-3 * f64::from(k))).collect();
            let last = values.iter().rposition(|value| value.abs() > 1e-9).unwrap();
            assert!((3400..3800).contains(&last), "{shape:?}: {last}");
        }
    }

    /// They are written in a case file, to be read there.
    #[test]
    fn an_input_consists_of_a_limited_number_of_parts() {
        let [trapezoid, sweep, _, multisine, _] = candidates([1.0, 1.0, 1.0, 1.0, 1.0]);
        let Shape::Multisine { tones, .. } = multisine else { panic!("{multisine:?}") };
        assert_eq!((trapezoid.corners().len(), sweep.sines().len(), tones), (65, 8, 20));
        let Shape::Prbs { bit, lasts, .. } = candidates([1.0, 0.0, 0.0, 0.0, 0.0])[4] else { panic!() };
        assert!((300.0..=400.0).contains(&(lasts / bit)), "{bit} {lasts}");
    }
}
