//! Verdicts on a controller.

use super::family::Corner;
use super::hunting::Hunt;
use super::loops::Break;
use super::margins::Margins;
use super::objective::{AtWorst, MoveFigures};
use crate::control::Deviation;
use crate::design::Design;

/// The verdict on a controller: on the axis of the file, and at worst over the family.
#[derive(Debug, Clone)]
pub struct Verdict {
    /// The controller.
    pub design: Design,
    /// Its margins on the nominal axis.
    pub nominal: Margins,
    /// The axis on which its sensitivity is furthest beyond its limits, or nearest to them, once the bad end is left
    /// out.
    pub corner: Corner,
    /// The margins there.
    pub worst: Margins,
    /// Axes on which it is not stable, and all of them.
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
    /// x − y on the nominal axis.
    pub cart: Deviation,
    /// Until the cart settles, s, if it does.
    pub settling: Option<f64>,
    /// Root mean square of the current, A.
    pub current: f64,
    /// |x − y| at worst, m; and on which axis.
    pub worst: (f64, String),
    /// Axes on which it settles, and all of them.
    pub settled: (usize, usize),
    /// All figures at worst.
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
    /// It settles on fewer axes, later, or errs more, in some move.
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
    /// The bandwidth that gains are placed for, without a search.
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

/// A figure of a move at worst over the family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Figure {
    /// |x − y|, m.
    Error,
    /// Until the cart settles, s.
    Settling,
    /// Axes on which it settles.
    Settled,
    /// Half of what the cart goes to and fro at rest, m; no figure of a move.
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

/// The figure of all moves that is worse by most than before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Worse {
    /// The place of the move in the list; none of hunting.
    pub motion: Option<usize>,
    /// Which figure.
    pub figure: Figure,
    /// It, m, s or axes; 0 of an axis that rests, not a number of a slip that was not waited for.
    pub before: f64,
    /// It, m, s or axes; not a number of a slip that was not waited for.
    pub after: f64,
    /// By what share of what it was, of a settling below 50 ms of these, of the axes those on which it settles no more;
    /// infinite of hunting where it rested.
    pub by: f64,
}

/// Of all controllers within the limits that were judged on the whole family, that one whose worst figure is worse by
/// least than before: what the limits cost at least, as far as the search has seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Least {
    /// It.
    pub design: Design,
    /// Its worst figure.
    pub worse: Worse,
    /// ln J.
    pub objective: f64,
}

/// At which gains a limit stands that makes others worse than those of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// Where the way from what was found back to the file ends.
    WayBack,
    /// At the gains of the file themselves, which break it.
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

/// The limit that forces gains that are worse than those before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forced {
    /// The limit.
    pub limit: Limit,
    /// Where it stands.
    pub standing: Standing,
    /// Where the loop is broken for it.
    pub at: Break,
    /// Where, Hz: the mode of the axis that stands there, or the top itself.
    pub mode: f64,
    /// Cart position, m.
    pub place: f64,
}
