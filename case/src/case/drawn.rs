//! The machines that draws from a posterior stand for.

use super::{Case, Plan};
use crate::error::{Error, Result};
use crate::log::read_columns;
use crate::machine::Machine;
use crate::parameter::{self, Free};
use crate::trajectory::Column;
use std::path::Path;

/// The machine of `case` with each row of a file of draws: a column for everything that `plan` searches for, such as
/// `cart.mass_kg`.
///
/// Numbers that are none of the machine, a log's delay say, are passed over. Errors: a column that is not there, values
/// that are missing.
pub fn machines(case: &Case, plan: &Plan, file: &Path) -> Result<Vec<Machine>> {
    let (parameters, columns) = drawn(case, plan, &[], file)?;
    let machine = |row: usize| {
        let mut stage = case.machine.clone();
        parameter::set(&mut stage, parameters.iter().zip(columns.iter().map(|column| column[row])));
        stage
    };
    Ok((0..columns.first().map_or(0, Vec::len)).map(machine).collect())
}

/// The draws themselves: what is free, and its values by draw. Keys that are set by others do not go along with any of
/// it.
pub fn drawn(case: &Case, plan: &Plan, others: &[&str], file: &Path) -> Result<(Vec<Free>, Vec<Vec<f64>>)> {
    let parameters = parameters(&case.machine, plan, others)?;
    if parameters.is_empty() {
        return Err(Error::new("there are no free parameters").next("add free = [\"cart.mass\"] to [fit]"));
    }
    if !plan.separate.is_empty() {
        return Err(draws_are_of_one_machine());
    }
    let headings: Vec<String> =
        parameters.iter().map(|parameter| Column::new(parameter.name.clone(), parameter.unit).heading()).collect();
    let names: Vec<&str> = headings.iter().map(String::as_str).collect();
    let columns = read_columns(file, &names)?;
    if columns.first().is_none_or(Vec::is_empty) {
        return Err(Error::new("there are no draws in it")
            .in_file(file)
            .next("write them with `taut fit --posterior`"));
    }
    // The first wrong draw is told, whichever column it stands in.
    let wrong = parameters.iter().zip(&columns).zip(&names).filter_map(|((parameter, column), heading)| {
        let row = column.iter().position(|value| !(parameter.low..=parameter.high).contains(value))?;
        Some((row, parameter, column[row], heading))
    });
    if let Some((row, parameter, value, heading)) = wrong.min_by_key(|(row, ..)| *row) {
        return Err(Error::new(format!("draw {} of {heading} is {value}, outside its bounds", row + 1))
            .in_file(file)
            .allowed(format!("from {} to {}", parameter.low, parameter.high))
            .next("use the draws of this case's own fit"));
    }
    Ok((parameters, columns))
}

/// The free parameters of `plan` in a machine of which `others` are set, too.
pub fn parameters(machine: &Machine, plan: &Plan, others: &[&str]) -> Result<Vec<Free>> {
    let own = plan.free.iter().chain(plan.tied.iter().flatten()).map(String::as_str);
    let all: Vec<&str> = own.chain(others.iter().copied()).collect();
    plan.names().map(|name| Free::new(machine, &name, &all, &plan.bounds)).collect()
}

/// There is one machine for each campaign, and draws are of one.
pub fn draws_are_of_one_machine() -> Error {
    Error::new("draws are of one machine, and `separate` makes one for each campaign")
        .next("leave `separate` out of [fit], and hold out the logs of the other campaigns")
}
