//! Which solver, as it is asked for by name.

use super::{Method, Solver};
use crate::error::{Error, Result};
use crate::machine::Machine;

/// The name of a solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// [`Solver::Exact`]
    Exact,
    /// [`Solver::General`]
    General,
    /// [`Solver::Table3`]
    Table3,
}

/// The solver that is asked for; the rest is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Choice {
    /// By default the one for the stage.
    pub solver: Option<Kind>,
    /// Of the general solver.
    pub tolerance: Option<f64>,
    /// Of the fixed steps of Table 3, s.
    pub step: Option<f64>,
    /// Of the fixed steps of Table 3.
    pub method: Option<Method>,
}

impl Choice {
    /// The solver that is asked for, or else the one for this machine. Options that do not go with it are told by the
    /// names of the command line; Table 3 is of an axis alone.
    pub fn solver(&self, machine: &Machine) -> Result<Solver> {
        let option = match (self.solver, self.step, self.method) {
            _ if machine.kind == crate::machine::Kind::Axis => return self.instead_of(Solver::of(machine)),
            (Some(Kind::Table3), _, _) => "--solver table3",
            (_, Some(_), _) => "--step",
            (_, _, Some(_)) => "--method",
            _ => return self.instead_of(Solver::of(machine)),
        };
        Err(Error::new("the paper's Table 3, with its fixed step, is of a single axis")
            .in_file(option)
            .next("leave it out: a gantry is solved exactly, or by --solver general"))
    }

    fn instead_of(&self, usual: Solver) -> Result<Solver> {
        let solver = match (self.solver, usual) {
            (Some(Kind::Table3), _) => {
                Solver::Table3 { step: self.step.unwrap_or(1e-4), method: self.method.unwrap_or_default() }
            }
            (Some(Kind::Exact), _) => Solver::Exact,
            (Some(Kind::General), _) => Solver::GENERAL,
            (None, solver) => solver,
        };
        let misplaced = |option: &str, what: &str, other: &str| {
            Err(Error::new(what).in_file(option).next(format!("leave {option} out, or add --solver {other}")))
        };
        let fixed = match (self.step, self.method) {
            (Some(_), _) => Some("--step"),
            (None, Some(_)) => Some("--method"),
            (None, None) => None,
        };
        match (solver, fixed, self.tolerance) {
            (Solver::Exact, Some(option), _) => {
                misplaced(option, "the exact solver has no step and no formula to choose", "table3")
            }
            (Solver::General { .. }, Some(option), _) => {
                misplaced(option, "the general solver chooses its own steps, by one formula", "table3")
            }
            (Solver::General { .. }, None, Some(tolerance)) => Ok(Solver::General { tolerance }),
            (Solver::Exact | Solver::Table3 { .. }, _, Some(_)) => {
                misplaced("--tolerance", "only the general solver has a tolerance", "general")
            }
            _ => Ok(solver),
        }
    }
}
