//! Verdicts on a controller.

use super::family::Corner;
use super::hunting::Hunt;
use super::loops::Break;
use super::margins::Margins;
use super::objective::{AtWorst, MoveFigures};
use crate::control::Deviation;
use crate::design::Design;

/// The verdict on a controller: on the nominal machine, and in the worst case over the family.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Verdict {
    /// The controller.
    pub design: Design,
    /// Its margins on the nominal machine.
    pub nominal: Margins,
    /// The machine with the largest sensitivity relative to the limits, without the excluded ones.
    pub corner: Corner,
    /// Margins on that machine.
    pub worst: Margins,
    /// Number of unstable machines, and of all machines.
    pub unstable: (usize, usize),
    /// ln J.
    pub objective: f64,
    /// Its moves.
    pub moves: Vec<MoveVerdict>,
    /// Its limit cycle at rest, if there is one.
    pub hunt: Option<Hunt>,
}

/// The verdict on a move.
#[derive(Debug, Clone, PartialEq)]
pub struct MoveVerdict {
    /// Its name.
    pub name: String,
    /// Distance from the target within which the cart counts as settled, m.
    pub window: f64,
    /// y − x on the nominal machine.
    pub cart: Deviation,
    /// Settling time, s, if the cart settles.
    pub settling: Option<f64>,
    /// RMS current, A.
    pub current: f64,
    /// Worst-case |y − x|, m, and its machine.
    pub worst: (f64, String),
    /// Number of machines on which it settles, and of all machines.
    pub settled: (usize, usize),
    /// All worst-case figures.
    pub at_worst: AtWorst,
    pub(super) seen: Vec<MoveFigures>,
}

/// The judgement on a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Judgement {
    /// No figure of its moves is worse, and the objective or the limits are better.
    Better,
    /// It is the same.
    Unchanged,
    /// It settles on fewer machines, later, or with a larger error in some move.
    Worse,
}

impl Judgement {
    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Better => "better",
            Self::Unchanged => "unchanged",
            Self::Worse => "worse",
        }
    }
}

/// A limit of the margins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// M_s.
    Sensitivity,
    /// M_t.
    Complementary,
    /// The bandwidth of the pole placement, without a search.
    Bandwidth,
}

impl Limit {
    /// Its name in the case file.
    pub fn word(self) -> &'static str {
        match self {
            Self::Sensitivity => "sensitivity",
            Self::Complementary => "complementary",
            Self::Bandwidth => "bandwidth",
        }
    }
}

/// A worst-case figure of a move over the family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Figure {
    /// |y − x|, m.
    Error,
    /// Settling time, s.
    Settling,
    /// Number of machines on which it settles.
    Settled,
    /// Amplitude of the cart's oscillation at rest, m; not a figure of a move.
    Hunting,
}

impl Figure {
    /// Its name in `tune.json`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Error => "cart_error_m",
            Self::Settling => "settling_s",
            Self::Settled => "settled",
            Self::Hunting => "hunting_m",
        }
    }
}

/// The figure of all moves with the largest deterioration.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Worse {
    /// Index of the move; none for hunting.
    pub motion: Option<usize>,
    /// The figure.
    pub figure: Figure,
    /// Its value before, m, s or machines; 0 for an axis at rest, NaN for a slip that was not observed.
    pub before: f64,
    /// Its value after, m, s or machines; NaN for a slip that was not observed.
    pub after: f64,
    /// Relative deterioration; of a settling time below 50 ms relative to 50 ms, of machines the lost ones; infinite
    /// for hunting after rest.
    pub by: f64,
}

/// The controller within the limits, among those judged on the complete family, whose worst figure deteriorates least:
/// the least cost of the limits found by the search.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Least {
    /// It.
    pub design: Design,
    /// Its worst figure.
    pub worse: Worse,
    /// ln J.
    pub objective: f64,
}

/// Gains at which a limit that forces a deterioration is active.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// At the end of the path from the result back to the gains of the file.
    WayBack,
    /// At the gains of the file themselves, which violate it.
    File,
}

impl Standing {
    /// Its name in `tune.json`.
    pub fn word(self) -> &'static str {
        match self {
            Self::WayBack => "way_back",
            Self::File => "file",
        }
    }
}

/// The limit that forces gains worse than before.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Forced {
    /// The limit.
    pub limit: Limit,
    /// Gains at which it is active.
    pub standing: Standing,
    /// Its loop break.
    pub at: Break,
    /// Its frequency, Hz: of the mode there, or of the peak itself.
    pub mode: f64,
    /// Cart position, m.
    pub place: f64,
}
