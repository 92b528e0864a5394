//! Inputs: step, pulse, ramp, triangle, square, sine, chirp, multisine, PRBS, tables, and sums and sequences of them.
//!
//! Every signal is a chain of polynomial pieces; the solver stops at each seam, so no edge is ever stepped over.
//! [`Signal::piece`] gives the piece at a time, [`Signal::value`] the value by the direct formula.
//!
//! Two rules hold for all of them:
//! - Times closer than eight roundings (1.8e-15 t) are one instant, and a seam belongs to the piece that begins there.
//!   So seams that should coincide do, whichever way they were computed, and no piece is as short as a rounding.
//! - A periodic signal too fast for the clock to tell its seams apart reads as its mean, for ever: a bit of 1 ns after
//!   ten hours, say.

pub mod arc;
mod clock;
mod edges;
pub mod gcode;
mod prbs;
pub mod profile;
mod reference;
mod smooth;
#[cfg(test)]
mod tests;

use clock::Now;
pub use clock::Sequence;
use profile::Profile;

/// Highest power of time in a [`Piece`].
pub const DEGREE: usize = 7;

/// Highest power of time in a reference: its snap is constant.
const POWERS_OF_A_REFERENCE: usize = 4;

/// A stretch of time on which the input is a polynomial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Start time, s, from which powers count.
    pub start: f64,
    /// End time, s, from which the next piece holds; `f64::INFINITY` for the last.
    pub end: f64,
    /// u(t) = Σ c_k (t − start)ᵏ.
    pub coefficients: [f64; DEGREE + 1],
}

impl Piece {
    /// u at time `t`, s; sensible from `start` to `end`.
    pub fn value(&self, t: f64) -> f64 {
        let tau = t - self.start;
        self.coefficients.iter().rev().fold(0.0, |sum, c| sum * tau + c)
    }

    /// The highest power of time whose coefficient is not zero; 0 for a held value.
    pub fn degree(&self) -> usize {
        self.coefficients.iter().rposition(|&c| c != 0.0).unwrap_or(0)
    }
}

/// Coefficients in powers of (τ − `by`) of Σ c_k τᵏ: Horner's rule, again and again.
#[doc(hidden)]
pub fn shifted<const POWERS: usize>(coefficients: &[f64; POWERS], by: f64) -> [f64; POWERS] {
    let mut shifted = *coefficients;
    if by != 0.0 && coefficients[1..].iter().any(|&c| c != 0.0) {
        for i in 0..POWERS - 1 {
            for k in (i..POWERS - 1).rev() {
                shifted[k] += by * shifted[k + 1];
            }
        }
    }
    shifted
}

impl Signal {
    /// The first jump, s and by how much, that is farther than `most` from `begin` on and before `until`.
    pub(crate) fn first_jump(&self, begin: f64, most: f64, until: f64) -> Option<(f64, f64)> {
        let (mut time, mut before) = (0.0, begin);
        while time < until {
            let piece = self.piece(time);
            let jump = piece.value(piece.start) - before;
            if jump.abs() > most * (1.0 + 1e-9) {
                return Some((time, jump));
            }
            before = piece.value(piece.end.min(until));
            time = piece.end;
        }
        None
    }
}

/// An input over time, in units of the amplifier's input. Times in s, frequencies in Hz, phases in rad.
///
/// Before time zero and outside its own extent a signal is zero, but for ramps and tables, which hold their last value.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Signal {
    /// `value` from `at` on.
    Step {
        /// Height.
        value: f64,
        /// Time of the edge.
        at: f64,
    },
    /// `value` from `at` for `duration`.
    Pulse {
        /// Height.
        value: f64,
        /// Length.
        duration: f64,
        /// Time of the first edge.
        at: f64,
    },
    /// From zero at `at` to `value` in `over`, then held.
    Ramp {
        /// Value reached.
        value: f64,
        /// Time taken.
        over: f64,
        /// Time of the start.
        at: f64,
    },
    /// From zero, rising first, between ±`amplitude`.
    Triangle {
        /// Peak.
        amplitude: f64,
        /// Periods per second.
        frequency: f64,
    },
    /// +`amplitude` for the share `duty` of each period, −`amplitude` for the rest.
    Square {
        /// Height.
        amplitude: f64,
        /// Periods per second.
        frequency: f64,
        /// Share of the period spent high, between 0 and 1.
        duty: f64,
    },
    /// `offset` + `amplitude` sin(2π `frequency` t + `phase`).
    Sine {
        /// Peak.
        amplitude: f64,
        /// Periods per second.
        frequency: f64,
        /// Phase at time zero.
        phase: f64,
        /// Mean.
        offset: f64,
    },
    /// A sine whose frequency goes linearly `from`–`to` in `over`; zero afterwards.
    Chirp {
        /// Peak.
        amplitude: f64,
        /// Frequency at time zero.
        from: f64,
        /// Frequency at the end.
        to: f64,
        /// Time taken.
        over: f64,
    },
    /// A sum of sines.
    Multisine {
        /// The sines.
        tones: Vec<Tone>,
    },
    /// ±`amplitude`, a pseudo-random binary sequence.
    Prbs {
        /// Height.
        amplitude: f64,
        /// Length of one bit.
        bit: f64,
        /// Seed of the sequence.
        seed: u64,
    },
    /// Straight lines between points (time, value) of increasing time; zero before the first, held after the last.
    Table {
        /// The points.
        points: Vec<[f64; 2]>,
    },
    /// Sampled values, as a converter would put them out; zero before the first, held after the last.
    Sampled {
        /// Increasing times.
        times: Vec<f64>,
        /// A value for each.
        values: Vec<f64>,
        /// The input between samples.
        hold: Hold,
    },
    /// References of what slides, each with its weight: the position along the belt that a stepper is commanded.
    References {
        /// One of each coordinate.
        profiles: Vec<Profile>,
        /// A weight for each.
        weights: Vec<f64>,
    },
    /// All of these added.
    Sum(Vec<Signal>),
    /// One after another, each on its own clock; the last goes on.
    Sequence(Sequence),
}

/// One sine of a multisine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tone {
    /// Peak.
    pub amplitude: f64,
    /// Periods per second.
    pub frequency: f64,
    /// Phase at time zero.
    pub phase: f64,
}

/// A sampled input between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// Holds the last sample (zero-order hold).
    Zero,
    /// Joins the samples by straight lines (first-order hold).
    Linear,
}

/// A signal's turn in a sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct Slot {
    /// The signal; its time zero is the start of its turn.
    pub signal: Signal,
    /// Duration of this part, s.
    pub lasts: f64,
}

/// A piece on a signal's own clock: where it ends there, and its powers of time since the moment asked for.
#[derive(Debug, Clone, Copy)]
struct Part {
    end: f64,
    coefficients: [f64; DEGREE + 1],
}

impl Part {
    /// `value` until `end`.
    fn held(value: f64, end: f64) -> Self {
        Self::line(value, 0.0, end)
    }

    /// From `value`, rising by `slope` per second, until `end`.
    fn line(value: f64, slope: f64, end: f64) -> Self {
        let mut coefficients = [0.0; DEGREE + 1];
        coefficients[0] = value;
        coefficients[1] = slope;
        Self { end, coefficients }
    }
}

impl Signal {
    /// One after another, each on its own clock; the last goes on.
    pub fn sequence(slots: Vec<Slot>) -> Self {
        Self::Sequence(Sequence::new(slots))
    }

    /// The piece that holds at time `t`, s, from `t` on; at a seam, the one that begins there.
    ///
    /// `piece(0.0)`, then `piece(previous.end)` and so on visits every seam once; `end` is later than `t`, and infinite
    /// for the last piece. Held signals have degree 0, straight ones degree 1. Smooth ones (sine, chirp, multisine)
    /// are interpolated on a fixed lattice, 26 stretches to the shortest period, to about 1e-14 of their amplitude.
    pub fn piece(&self, t: f64) -> Piece {
        let part =
            if t >= 0.0 { self.part(Now::at(t)) } else { Part::held(0.0, if t < 0.0 { 0.0 } else { f64::INFINITY }) };
        // Points out of order could name a seam that has passed; nobody may be sent back.
        let end = if part.end > t { part.end } else { f64::INFINITY };
        Piece { start: t, end, coefficients: part.coefficients }
    }

    /// The value at time `t`, s, by the direct formula; at an edge, the value after it.
    pub fn value(&self, t: f64) -> f64 {
        if t >= 0.0 { self.value_at(Now::at(t)) } else { 0.0 }
    }

    /// When the signal has run its course, s: the end of a pulse, ramp or chirp, the last point or sample, the latest
    /// end of a sum, the turns of a sequence together. None where there is no such moment: steps and periodic signals.
    pub fn duration(&self) -> Option<f64> {
        match self {
            Self::Step { .. }
            | Self::Triangle { .. }
            | Self::Square { .. }
            | Self::Sine { .. }
            | Self::Multisine { .. }
            | Self::Prbs { .. } => None,
            &Self::Pulse { duration, at, .. } => Some((at + duration.max(0.0)).max(0.0)),
            &Self::Ramp { over, at, .. } => Some((at + over.max(0.0)).max(0.0)),
            &Self::Chirp { over, .. } => Some(over.max(0.0)),
            Self::Table { points } => Some(points.last().map_or(0.0, |p| p[0].max(0.0))),
            Self::Sampled { times, .. } => Some(times.last().map_or(0.0, |t| t.max(0.0))),
            Self::References { profiles, .. } => Some(Profile::last_rest(profiles)),
            Self::Sum(signals) => signals.iter().try_fold(0.0, |end: f64, s| Some(end.max(s.duration()?))),
            Self::Sequence(turns) => turns.duration(),
        }
    }

    fn part(&self, now: Now) -> Part {
        match self {
            &Self::Step { value, at } => edges::step(now, value, at),
            &Self::Pulse { value, duration, at } => edges::pulse(now, value, duration, at),
            &Self::Ramp { value, over, at } => edges::ramp(now, value, over, at),
            &Self::Triangle { amplitude, frequency } => edges::triangle(now, amplitude, frequency),
            &Self::Square { amplitude, frequency, duty } => edges::square(now, amplitude, frequency, duty),
            &Self::Sine { amplitude, frequency, phase, offset } => {
                let mut part = smooth::multisine(now, &[Tone { amplitude, frequency, phase }]);
                part.coefficients[0] += offset;
                part
            }
            &Self::Chirp { amplitude, from, to, over } => smooth::Chirp { amplitude, from, to, over }.part(now),
            Self::Multisine { tones } => smooth::multisine(now, tones),
            &Self::Prbs { amplitude, bit, seed } => prbs::part(now, amplitude, bit, seed),
            Self::Table { points } => edges::Points::of_table(points).part(now),
            Self::Sampled { times, values, hold } => edges::Points::of_samples(times, values, *hold).part(now),
            Self::References { profiles, weights } => {
                let mut sum = Part::held(0.0, f64::INFINITY);
                for (profile, weight) in profiles.iter().zip(weights) {
                    let (powers, end) = profile.piece_beyond(now.t, now.slack);
                    sum.end = sum.end.min(end);
                    sum.coefficients.iter_mut().zip(powers).for_each(|(sum, power)| *sum += weight * power);
                }
                sum
            }
            Self::Sum(signals) => {
                let mut sum = Part::held(0.0, f64::INFINITY);
                for part in signals.iter().map(|signal| signal.part(now)) {
                    sum.end = sum.end.min(part.end);
                    sum.coefficients.iter_mut().zip(part.coefficients).for_each(|(sum, c)| *sum += c);
                }
                sum
            }
            Self::Sequence(turns) => {
                let Some(turn) = turns.turn(now) else { return Part::held(0.0, f64::INFINITY) };
                let part = turn.signal.part(turn.now);
                Part { end: turn.outside(part.end).min(turn.end), ..part }
            }
        }
    }

    fn value_at(&self, now: Now) -> f64 {
        match self {
            // Held signals are their own formula.
            Self::Step { .. } | Self::Pulse { .. } | Self::Square { .. } | Self::Prbs { .. } => {
                self.part(now).coefficients[0]
            }
            &Self::Ramp { value, over, at } => edges::ramp_value(now, value, over, at),
            &Self::Triangle { amplitude, frequency } => edges::triangle_value(now, amplitude, frequency),
            &Self::Sine { amplitude, frequency, phase, offset } => {
                smooth::multisine_value(now, &[Tone { amplitude, frequency, phase }]) + offset
            }
            &Self::Chirp { amplitude, from, to, over } => smooth::Chirp { amplitude, from, to, over }.value(now),
            Self::Multisine { tones } => smooth::multisine_value(now, tones),
            Self::Table { points } => edges::Points::of_table(points).value(now),
            Self::Sampled { times, values, hold } => edges::Points::of_samples(times, values, *hold).value(now),
            Self::References { profiles, weights } => {
                profiles.iter().zip(weights).map(|(profile, weight)| weight * profile.at(now.t).position).sum()
            }
            Self::Sum(signals) => signals.iter().map(|signal| signal.value_at(now)).sum::<f64>() + 0.0,
            Self::Sequence(turns) => turns.turn(now).map_or(0.0, |turn| turn.signal.value_at(turn.now)),
        }
    }
}

impl Signal {
    /// The highest power of time in any of its pieces: 0 for held values, 1 for straight lines, [`DEGREE`] for sines.
    pub fn degree(&self) -> usize {
        match self {
            Signal::Step { .. } | Signal::Pulse { .. } | Signal::Square { .. } | Signal::Prbs { .. } => 0,
            Signal::Ramp { .. } | Signal::Triangle { .. } | Signal::Table { .. } => 1,
            Signal::Sampled { hold: Hold::Zero, .. } => 0,
            Signal::Sampled { hold: Hold::Linear, .. } => 1,
            Signal::Sine { .. } | Signal::Chirp { .. } | Signal::Multisine { .. } => DEGREE,
            Signal::References { .. } => POWERS_OF_A_REFERENCE,
            Signal::Sum(parts) => parts.iter().map(Signal::degree).max().unwrap_or(0),
            Signal::Sequence(turns) => turns.slots().iter().map(|slot| slot.signal.degree()).max().unwrap_or(0),
        }
    }
}
