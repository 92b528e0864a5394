//! Answers of taut about a case, by each of its interfaces.

use crate::answer::{Answer, TOLERANCE, is_piecewise_linear, solved};
use crate::subject::Subject;
use crate::{c, exchange, steps, swept};
use std::panic::{AssertUnwindSafe, catch_unwind};
use taut::solve::Solver;

/// A way of asking taut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum By {
    /// The exact solver.
    Exact,
    /// The general one.
    General,
    /// An FMU for co-simulation.
    CoSimulation,
    /// An FMU for model exchange, with an integrator of the hunt.
    ModelExchange,
    /// Exported C, compiled by gcc.
    C,
    /// A row of a sweep.
    Sweep,
}

impl By {
    /// All of them.
    pub const ALL: [By; 6] = [By::Exact, By::General, By::CoSimulation, By::ModelExchange, By::C, By::Sweep];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            By::Exact => "exact solver",
            By::General => "general solver",
            By::CoSimulation => "FMU, co-simulation",
            By::ModelExchange => "FMU, model exchange",
            By::C => "C",
            By::Sweep => "row of a sweep",
        }
    }

    /// True if it is the general solver or answers by it where a machine has curves.
    pub fn is_general(self, subject: &Subject) -> bool {
        self == By::General || (self != By::Exact && self != By::C && !is_piecewise_linear(subject))
    }

    /// The tolerance of positions with which an integrator answers, m; `None` where an answer has only rounding.
    pub fn tolerance(self, subject: &Subject) -> Option<f64> {
        let Solver::General { tolerance } = Solver::GENERAL else { return None };
        match self {
            By::General => Some(TOLERANCE),
            By::ModelExchange => Some(exchange::POSITIONS),
            By::CoSimulation | By::Sweep if !is_piecewise_linear(subject) => Some(tolerance),
            By::Exact | By::C | By::CoSimulation | By::Sweep => None,
        }
    }
}

/// The answer to a subject. Errors: a refusal or a panic, in words.
pub fn ask(subject: &Subject, by: By) -> Result<Answer, String> {
    let asked = catch_unwind(AssertUnwindSafe(|| match by {
        By::Exact => solved(subject, Solver::Exact),
        By::General => solved(subject, Solver::General { tolerance: TOLERANCE }),
        By::CoSimulation => steps::run(subject),
        By::ModelExchange => exchange::run(subject),
        By::C => c::run(subject),
        By::Sweep => swept::run(subject),
    }));
    asked.unwrap_or_else(|_| Err("it panics".into()))
}
