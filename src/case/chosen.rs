//! Parts of a case that are asked for by name; where one is missing, the error names the command line's option.

use super::{Case, Experiment, GantryCase, GantryExperiment, Move, Plan};
use crate::design::Design;
use crate::error::{Error, Result};
use std::path::Path;

impl Case {
    /// The experiments of these names, in the case's order; all if none is named. `path` is the case's own.
    pub fn experiments_named(&self, path: &Path, names: &[String]) -> Result<Vec<&Experiment>> {
        if self.experiments.is_empty() {
            let has = if self.moves.is_empty() { "neither experiments nor moves" } else { "moves, and no experiments" };
            return Err(Error::new(format!("\"{}\" has {has}", self.title))
                .in_file(path)
                .next("run its moves with `taut move`, or add an [[experiment]]"));
        }
        experiments_named(&self.experiments, |experiment| &experiment.name, names)
    }

    /// The controller, and the moves of these names in the case's order; all if none is named. `path` is the case's
    /// own.
    pub fn moves_named(&self, path: &Path, names: &[String]) -> Result<(&Design, Vec<&Move>)> {
        let Some(design) = self.controller.as_ref().filter(|_| !self.moves.is_empty()) else {
            return Err(Error::new("this case has no move and no controller to run it").in_file(path).next(
                "add [controller] with every and for example pid = { proportional = \"2 V/mm\" }, \
                 and [[move]] with name, to, speed, acceleration and until",
            ));
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
            Error::new("this case does not say what is searched for").in_file(path).next(
                "add a table [fit] with for example free = [\"cart.friction.viscous\", \"cart.friction.coulomb\"]",
            )
        })
    }
}

impl GantryCase {
    /// The experiments of these names, in the case's order; all if none is named.
    pub fn experiments_named(&self, names: &[String]) -> Result<Vec<&GantryExperiment>> {
        experiments_named(&self.experiments, |experiment| &experiment.name, names)
    }
}

fn experiments_named<'a, E>(all: &'a [E], name: fn(&E) -> &String, names: &[String]) -> Result<Vec<&'a E>> {
    let known = || all.iter().map(|experiment| name(experiment).as_str());
    if let Some(name) = names.iter().find(|name| known().all(|other| other != **name)) {
        return Err(Error::new(format!("there is no experiment \"{name}\""))
            .in_file("--experiment")
            .allowed(quoted(known()))
            .next("name one of these, or leave --experiment out to run them all"));
    }
    Ok(all.iter().filter(|experiment| names.is_empty() || names.contains(name(experiment))).collect())
}

fn quoted<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
}
