//! What machines drawn from a posterior do: the band that 95 % of them stay in, at every time for itself.

use super::run::Setting;
use rayon::prelude::*;
use taut::case::Experiment;
use taut::chance::quantile;
use taut::solve::{self, Ending, Flow};
use taut::stage::Stage;
use taut::trajectory::{Column, CsvWriter, Trajectory};
use taut::{Error, Result};
use taut_report::{Axis, Colour, Figure, Panel, Series, Style};

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

/// The band of one experiment.
pub struct Band {
    /// Times, s.
    pub time: Vec<f64>,
    /// By quantity and share: values at these times.
    pub values: [[Vec<f64>; 3]; 3],
    /// Machines that it is made of.
    pub machines: usize,
    /// Machines that did not reach the end, and are left out.
    pub failed: usize,
}

/// Evenly chosen ones of all machines.
pub fn chosen(mut machines: Vec<Stage>, count: usize) -> Vec<Stage> {
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

impl Band {
    /// Runs the experiment with each machine, on all processors; none where it was interrupted.
    pub fn of(setting: &Setting, machines: &[Stage], experiment: &Experiment) -> Result<Option<Self>> {
        let every = experiment.samples().div_ceil(ROWS).max(1) as usize;
        let runs: Vec<Option<[Vec<f64>; 4]>> =
            machines.par_iter().map(|stage| run(setting, stage, experiment, every)).collect::<Result<_>>()?;
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
        Ok(Some(Self { time, values, machines: whole.len(), failed }))
    }

    /// Writes it; returns the file's name.
    pub fn write(&self, setting: &Setting, experiment: &Experiment) -> Result<Option<String>> {
        let Some(folder) = setting.folder else { return Ok(None) };
        let mut columns = vec![Column { values: self.time.clone(), ..Column::new("time", "s") }];
        for ((name, unit, _), values) in QUANTITIES.iter().zip(&self.values) {
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

    /// Below, middle and above of a quantity at the end.
    pub fn end(&self, quantity: usize) -> [f64; 3] {
        std::array::from_fn(|share| self.values[quantity][share].last().copied().unwrap_or(f64::NAN))
    }

    /// Its picture.
    pub fn figure(&self, experiment: &Experiment) -> Figure {
        let line = |name: &str, y: Vec<f64>, colour, style| {
            Series::new(name, self.time.clone(), y).colour(colour).style(style)
        };
        let [_, cart, left] = &self.values;
        let off = |share: usize| cart[share].iter().zip(&cart[1]).map(|(v, middle)| v - middle).collect::<Vec<f64>>();
        let band = |panel: Panel, low: Vec<f64>, high: Vec<f64>| {
            panel.series(line("97.5 %", high, Colour::Vermillion, Style::Solid)).series(line(
                "2.5 %",
                low,
                Colour::Green,
                Style::Solid,
            ))
        };
        let middle = |values: &[Vec<f64>; 3]| line("median", values[1].clone(), Colour::Blue, Style::Dashed);
        let position = Axis::new("Cart x", "m").shown_as("mm", 1e3);
        let width = Axis::new("x − median", "m").shown_as("mm", 1e3);
        let stretch = Axis::new("r φ₁ − x", "m").shown_as("µm", 1e6);
        Figure::new(format!("{}: band", experiment.name), Axis::new("Time", "s"))
            .panel(band(Panel::new(position).weight(2.0), cart[0].clone(), cart[2].clone()).series(middle(cart)))
            .panel(band(Panel::new(width), off(0), off(2)))
            .panel(band(Panel::new(stretch), left[0].clone(), left[2].clone()).series(middle(left)))
            .caption(format!(
                "Between the lines are 95 % of {} machines drawn from the posterior, at every time for itself.",
                self.machines
            ))
    }
}

/// Time and quantities of one machine, every so many rows; none where it does not reach the end.
fn run(setting: &Setting, stage: &Stage, experiment: &Experiment, every: usize) -> Result<Option<[Vec<f64>; 4]>> {
    let mut columns: [Vec<f64>; 4] = Default::default();
    let mut row = 0;
    let outcome = solve::stream(stage, experiment, setting.solver, &mut |block| {
        let column = |name: &str| block.get(name).unwrap_or(&[]);
        let (time, angle, position) = (column("time"), column("drive_angle"), column("cart_position"));
        for ((t, angle), position) in time.iter().zip(angle).zip(position) {
            if row % every == 0 {
                columns[0].push(*t);
                for ((_, _, value), column) in QUANTITIES.iter().zip(&mut columns[1..]) {
                    column.push(value(*angle, *position, stage.pulley_radius));
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
