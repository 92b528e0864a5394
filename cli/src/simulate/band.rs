//! Runs of the machines drawn from a posterior: the band that 95 % of them stay in, at every time for itself.

use super::setting::RunSettings;
use rayon::prelude::*;
use taut::case::Experiment;
use taut::chance::quantile;
use taut::machine::Machine;
use taut::solve::{self, Ending, Flow};
use taut::trajectory::{Column, CsvWriter, Trajectory};
use taut::{Error, Result};
use taut_report::simulate::Band;

/// Rows that a band has at most: of longer runs every second one, every third, …
const ROWS: u64 = 10_000;

/// Below, in the middle and above: shares of the machines.
const SHARES: [f64; 3] = [0.025, 0.5, 0.975];

/// Which quantities: name, unit, and how they are made of drive angle, cart position and the pulley's radius.
type Quantity = (&'static str, &'static str, fn(f64, f64, f64) -> f64);

const QUANTITIES: [Quantity; 3] = [
    ("drive_angle", "rad", |angle, _, _| angle),
    ("cart_position", "m", |_, position, _| position),
    ("drive_travel_minus_cart", "m", |angle, position, r| r * angle - position),
];

/// Evenly chosen ones of all machines.
pub fn chosen(mut machines: Vec<Machine>, count: usize) -> Vec<Machine> {
    let all = machines.len();
    if count >= all {
        return machines;
    }
    let mut place = 0;
    machines.retain(|_| {
        let taken = (place + 1) * count / all > place * count / all;
        place += 1;
        taken
    });
    machines
}

/// Runs the experiment with each machine, on all processors; none where it was interrupted.
pub fn band(setting: &RunSettings, machines: &[Machine], experiment: &Experiment) -> Result<Option<Band>> {
    let every = experiment.samples().div_ceil(ROWS).max(1) as usize;
    let runs: Vec<Option<[Vec<f64>; 4]>> =
        machines.par_iter().map(|machine| run(setting, machine, experiment, every)).collect::<Result<_>>()?;
    if setting.interrupt.signal().is_some() {
        return Ok(None);
    }
    let whole: Vec<[Vec<f64>; 4]> = runs.into_iter().flatten().collect();
    let failed = machines.len() - whole.len();
    let Some(first) = whole.first() else {
        return Err(Error::new(format!("no machine of the draws reaches the end of \"{}\"", experiment.name))
            .next("run `taut simulate` without --draws to see what the case does"));
    };
    let time = first[0].clone();
    let values = std::array::from_fn(|q| quantiles(&whole, q + 1, time.len()));
    Ok(Some(Band { time, values, machines: whole.len(), failed }))
}

/// Writes it; returns the file's name.
pub fn write(band: &Band, setting: &RunSettings, experiment: &Experiment) -> Result<Option<String>> {
    let Some(folder) = setting.folder else { return Ok(None) };
    let mut columns = vec![Column { values: band.time.clone(), ..Column::new("time", "s") }];
    for ((name, unit, _), values) in QUANTITIES.iter().zip(&band.values) {
        for (end, values) in ["low", "median", "high"].iter().zip(values) {
            columns.push(Column { values: values.clone(), ..Column::new(format!("{name}_{end}"), *unit) });
        }
    }
    let name = format!("{}.band.csv", experiment.file_name());
    let mut writer = CsvWriter::create(folder.path(&name))?;
    writer.write(&Trajectory { columns })?;
    writer.finish()?;
    Ok(Some(name))
}

/// Time and quantities of one machine, every so many rows; none where it does not reach the end.
fn run(
    setting: &RunSettings,
    machine: &Machine,
    experiment: &Experiment,
    every: usize,
) -> Result<Option<[Vec<f64>; 4]>> {
    let mut columns: [Vec<f64>; 4] = Default::default();
    let mut row = 0;
    let outcome = solve::stream(machine, experiment, setting.solver, &mut |block| {
        let column = |name: &str| block.get(name).unwrap_or(&[]);
        let (time, angle, position) = (column("time"), column("drive_angle"), column("cart_position"));
        for ((t, angle), position) in time.iter().zip(angle).zip(position) {
            if row % every == 0 {
                columns[0].push(*t);
                for ((_, _, value), column) in QUANTITIES.iter().zip(&mut columns[1..]) {
                    column.push(value(*angle, *position, machine.pulley_radius));
                }
            }
            row += 1;
        }
        if setting.interrupt.signal().is_some() { Flow::Stop } else { Flow::Continue }
    })?;
    Ok((outcome.ending == Ending::Complete).then_some(columns))
}

/// The shares of one column over all runs, at each time.
fn quantiles(runs: &[[Vec<f64>; 4]], column: usize, rows: usize) -> [Vec<f64>; 3] {
    let mut result: [Vec<f64>; 3] = std::array::from_fn(|_| Vec::with_capacity(rows));
    let mut values = Vec::with_capacity(runs.len());
    for row in 0..rows {
        values.clear();
        values.extend(runs.iter().filter_map(|run| run[column].get(row)));
        values.sort_by(f64::total_cmp);
        for (result, share) in result.iter_mut().zip(SHARES) {
            result.push(quantile(&values, share));
        }
    }
    result
}
