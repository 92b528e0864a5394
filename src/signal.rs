//! Inputs: step, pulse, ramp, triangle, square, sine, chirp, multisine, PRBS, tables, and sums and sequences of them.
//!
//! Every signal is a chain of polynomial pieces; the solver stops at each seam, so no edge is ever stepped over.

/// Highest power of time in a [`Piece`].
pub const DEGREE: usize = 7;

/// A stretch of time on which the input is a polynomial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Where it begins, s; powers count from here.
    pub start: f64,
    /// Where it ends, s; the next piece holds from there on. `f64::INFINITY` for the last.
    pub end: f64,
    /// u(t) = Σ c_k (t − start)ᵏ.
    pub coefficients: [f64; DEGREE + 1],
}

/// An input over time, in units of the amplifier's input. Times in s, frequencies in Hz, phases in rad.
///
/// Before time zero and outside its own extent a signal is zero, but for ramps and tables, which hold their last value.
#[derive(Debug, Clone, PartialEq)]
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
        /// Which sequence; the same seed gives the same one.
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
        /// What happens between samples.
        hold: Hold,
    },
    /// All of these added.
    Sum(Vec<Signal>),
    /// One after another, each on its own clock; the last goes on.
    Sequence(Vec<Slot>),
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

/// What a sampled input does between its samples.
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
    /// How long its turn lasts, s.
    pub lasts: f64,
}
