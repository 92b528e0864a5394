//! The machines that draws from a posterior stand for.

use super::problem::knobs;
use crate::case::{Case, Plan};
use crate::error::{Error, Result};
use crate::log::read_columns;
use crate::stage::Stage;
use crate::trajectory::Column;
use std::path::Path;

/// The machine of `case` with each row of a file of draws: a column for everything that `plan` turns, such as `cart.mass_kg`.
///
/// What is no number of the machine, a log's delay say, is passed over. Errors: a column that is not there, values that are missing.
pub fn machines(case: &Case, plan: &Plan, file: &Path) -> Result<Vec<Stage>> {
    let (knobs, breakaways) = knobs(&case.stage, plan)?;
    let headings: Vec<String> = knobs.iter().map(|knob| Column::new(knob.name.clone(), knob.unit).heading()).collect();
    let names: Vec<&str> = headings.iter().map(String::as_str).collect();
    let columns = read_columns(file, &names)?;
    let rows = columns.first().map_or(0, Vec::len);
    if rows == 0 {
        return Err(Error::new("there are no draws in it")
            .in_file(file)
            .next("write them with `taut fit --posterior`"));
    }
    let machine = |row: usize| {
        let mut stage = case.stage.clone();
        for (knob, (column, heading)) in knobs.iter().zip(columns.iter().zip(&names)) {
            let value = column[row];
            if !(knob.low..=knob.high).contains(&value) {
                return Err(Error::new(format!("draw {} of {heading} is {value}, outside its bounds", row + 1))
                    .in_file(file)
                    .allowed(format!("from {} to {}", knob.low, knob.high))
                    .next("use the draws of this case's own fit"));
            }
            knob.set(&mut stage, value);
        }
        breakaways.follow(&mut stage);
        Ok(stage)
    };
    (0..rows).map(machine).collect()
}
