//! The machines that draws from a posterior stand for.

use super::problem::knobs;
use crate::case::{Case, Plan};
use crate::error::{Error, Result};
use crate::knob::{Breakaways, Knob};
use crate::log::read_columns;
use crate::stage::Stage;
use crate::trajectory::Column;
use std::path::Path;

/// The machine of `case` with each row of a file of draws: a column for everything that `plan` turns, such as `cart.mass_kg`.
///
/// What is no number of the machine, a log's delay say, is passed over. Errors: a column that is not there, values that are missing.
pub fn machines(case: &Case, plan: &Plan, file: &Path) -> Result<Vec<Stage>> {
    let (knobs, columns, breakaways) = drawn(case, plan, file)?;
    let machine = |row: usize| {
        let mut stage = case.stage.clone();
        for (knob, column) in knobs.iter().zip(&columns) {
            knob.set(&mut stage, column[row]);
        }
        breakaways.follow(&mut stage);
        stage
    };
    Ok((0..columns.first().map_or(0, Vec::len)).map(machine).collect())
}

/// The draws themselves: what is turned, its values by draw, and which breakaways go along.
pub fn drawn(case: &Case, plan: &Plan, file: &Path) -> Result<(Vec<Knob>, Vec<Vec<f64>>, Breakaways)> {
    let (knobs, breakaways) = knobs(&case.stage, plan)?;
    let headings: Vec<String> = knobs.iter().map(|knob| Column::new(knob.name.clone(), knob.unit).heading()).collect();
    let names: Vec<&str> = headings.iter().map(String::as_str).collect();
    let columns = read_columns(file, &names)?;
    if columns.first().is_none_or(Vec::is_empty) {
        return Err(Error::new("there are no draws in it")
            .in_file(file)
            .next("write them with `taut fit --posterior`"));
    }
    // The first wrong draw is told, whichever column it stands in.
    let wrong = knobs.iter().zip(&columns).zip(&names).filter_map(|((knob, column), heading)| {
        let row = column.iter().position(|value| !(knob.low..=knob.high).contains(value))?;
        Some((row, knob, column[row], heading))
    });
    if let Some((row, knob, value, heading)) = wrong.min_by_key(|(row, ..)| *row) {
        return Err(Error::new(format!("draw {} of {heading} is {value}, outside its bounds", row + 1))
            .in_file(file)
            .allowed(format!("from {} to {}", knob.low, knob.high))
            .next("use the draws of this case's own fit"));
    }
    Ok((knobs, columns, breakaways))
}
