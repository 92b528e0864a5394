//! The choice of a solver by name.

use super::{Method, Solver};
use crate::error::{Error, Result};
use crate::machine::Machine;

/// The name of a solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SolverKind {
    /// [`Solver::Exact`]
    Exact,
    /// [`Solver::General`]
    General,
    /// [`Solver::Table3`]
    Table3,
}

/// The requested solver and its options; missing ones have defaults.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Choice {
    /// Default: the solver that the machine needs.
    pub solver: Option<SolverKind>,
    /// Position tolerance of the general solver, m.
    pub tolerance: Option<f64>,
    /// Step of Table 3, s.
    pub step: Option<f64>,
    /// Integration method of Table 3.
    pub method: Option<Method>,
}

impl Choice {
    /// The requested solver, or the one for this machine. Errors about options that do not apply to it use the names of
    /// the command line; Table 3 is for an axis only.
    pub fn solver(&self, machine: &Machine) -> Result<Solver> {
        let option = match (self.solver, self.step, self.method) {
            _ if machine.kind == crate::machine::MachineKind::Axis => {
                return self.instead_of(Solver::for_machine(machine));
            }
            (Some(SolverKind::Table3), _, _) => "--solver table3",
            (_, Some(_), _) => "--step",
            (_, _, Some(_)) => "--method",
            _ => return self.instead_of(Solver::for_machine(machine)),
        };
        Err(Error::new("the paper's Table 3, with its fixed step, is of a single axis")
            .in_file(option)
            .next("leave it out: a gantry is solved exactly, or by --solver general"))
    }

    fn instead_of(&self, usual: Solver) -> Result<Solver> {
        let solver = match (self.solver, usual) {
            (Some(SolverKind::Table3), _) => {
                Solver::Table3 { step: self.step.unwrap_or(1e-4), method: self.method.unwrap_or_default() }
            }
            (Some(SolverKind::Exact), _) => Solver::Exact,
            (Some(SolverKind::General), _) => Solver::GENERAL,
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
