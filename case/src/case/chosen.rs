//! Parts of a case that are asked for by name; where one is missing, the error names the command line's option.

use super::{Case, Experiment, Move, Plan, Unread, suggestion};
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::MachineKind;
use std::path::Path;

impl Case {
    /// Something of the first experiment of the text, whether or not its files were read.
    pub fn first<T>(&self, of: impl Fn(&Experiment) -> T, left: impl Fn(&Unread) -> Option<T>) -> Option<T> {
        match self.unread.first().filter(|one| one.place == 0) {
            Some(one) => left(one),
            None => self.experiments.first().map(of),
        }
    }

    /// True if its machine is a single axis.
    pub fn is_axis(&self) -> bool {
        self.machine.kind == MachineKind::Axis
    }

    /// Refuses a case of which a file was not read, with the line that names it.
    pub fn complete(&self) -> Result<()> {
        self.unread.first().map_or(Ok(()), |one| Err(one.error.clone()))
    }

    /// The experiments that were left out because a file of theirs could not be read, each with why.
    pub fn left_out(&self) -> Vec<(&str, &Error)> {
        self.unread.iter().map(|one| (one.name.as_str(), &one.error)).collect()
    }

    /// The experiments of these names, in the case's order; all if none is named. `path` is the case's own.
    pub fn experiments_named(&self, path: &Path, names: &[String]) -> Result<Vec<&Experiment>> {
        if self.experiments.is_empty() && self.unread.is_empty() {
            let has = if self.moves.is_empty() { "neither experiments nor moves" } else { "moves, and no experiments" };
            return Err(Error::new(format!("\"{}\" has {has}", self.title))
                .in_file(path)
                .next("run its moves with `taut move`, or add an [[experiment]]"));
        }
        let asked = |one: &&Unread| names.is_empty() || names.iter().any(|name| one.holds(name));
        if let Some(one) = self.unread.iter().find(asked) {
            return Err(one.error.clone());
        }
        let left_out = self.unread.iter().map(|one| one.name.as_str());
        let known = || self.experiments.iter().map(|one| one.name.as_str()).chain(left_out.clone());
        if let Some(name) = names.iter().find(|name| known().all(|other| other != **name)) {
            return Err(Error::new(format!("there is no experiment \"{name}\""))
                .in_file("--experiment")
                .allowed(quoted(known()))
                .next("name one of these, or leave --experiment out to run them all"));
        }
        let is_asked = |one: &&Experiment| names.is_empty() || names.contains(&one.name);
        Ok(self.experiments.iter().filter(is_asked).collect())
    }

    /// The controller, and the moves of these names in the case's order; all if none is named. `path` is the case's
    /// own.
    pub fn moves_named(&self, path: &Path, names: &[String]) -> Result<(&Design, Vec<&Move>)> {
        let Some(design) = self.controller.as_ref().filter(|_| !self.moves.is_empty()) else {
            let to = match self.machine.geometry().slides.len() {
                1 => "to = \"20 mm\"",
                _ => "to = [\"20 mm\", \"0 mm\"]",
            };
            let motion = format!("[[move]] with name, {to}, speed, acceleration and until");
            if self.machine.stepper().is_some() || self.controller.is_some() {
                return Err(Error::new("this case has no move").in_file(path).next(format!("add {motion}")));
            }
            return Err(Error::new("this case has no move and no controller to run it").in_file(path).next(format!(
                "add [controller] with for example {}, and {motion}",
                suggestion::controller(&self.machine)
            )));
        };
        let known = || self.moves.iter().map(|m| m.name.as_str());
        if let Some(name) = names.iter().find(|name| known().all(|other| other != **name)) {
            return Err(Error::new(format!("there is no move \"{name}\"")).in_file("--move").allowed(quoted(known())));
        }
        Ok((design, self.moves.iter().filter(|m| names.is_empty() || names.contains(&m.name)).collect()))
    }

    /// The plan of its fit. `path` is the case's own.
    pub fn fit_plan(&self, path: &Path) -> Result<Plan> {
        self.fit.clone().ok_or_else(|| {
            Error::new("this case has no free parameters").in_file(path).next(
                "add a table [fit] with for example free = [\"cart.friction.viscous\", \"cart.friction.coulomb\"]",
            )
        })
    }
}

impl Case {
    /// Keys of `[controller]` that run on this axis, in its unit.
    pub fn suggested_controller(&self) -> String {
        suggestion::controller(&self.machine)
    }

    /// The derivative of a PID controller that is sampled as `design` is.
    pub fn suggested_derivative(&self, design: &Design) -> String {
        suggestion::derivative(&self.machine, design.every, design.delay)
    }
}

fn quoted<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
}
