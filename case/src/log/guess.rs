//! A first look at a file: which columns it has, and what they seem to be.
//!
//! A guess is by names, and by how values go on from row to row. It is there to be corrected: nothing is read by it.

use super::mapping::suspected;
use super::presets::{In, PRESETS, Preset};
use super::sheet::{ColumnId, Request};
use super::{Quantity, formats};
use crate::error::{Error, Result};
use crate::quantity::conversion;
use std::path::Path;

/// Columns that are looked at.
const MOST: usize = 64;

/// The columns of a file, and their likely meaning.
#[derive(Debug, Clone)]
pub struct Looked {
    /// Its columns, in the file's order.
    pub columns: Vec<FileColumn>,
    /// Their likely meaning.
    pub guess: Guess,
}

/// A column of a file.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct FileColumn {
    /// By its name, or by its place where nothing names it.
    pub id: ColumnId,
    /// The unit that the file states.
    pub unit: Option<String>,
    /// Its numbers as they stand, NaN where one is missing; none where they are words.
    pub values: Vec<f64>,
}

/// Likely meaning of columns.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Guess {
    /// The recorder that made the file, where its columns are called as those of one.
    pub preset: Option<&'static str>,
    /// Key of a log's table, the place of its column, and the unit by its name.
    pub columns: Vec<(&'static str, usize, Option<String>)>,
    /// The place of the column that tells runs apart.
    pub split: Option<usize>,
}

impl Guess {
    /// The place of the column under a key.
    pub fn column(&self, key: &str) -> Option<usize> {
        self.columns.iter().find(|(own, ..)| *own == key).map(|(_, place, _)| *place)
    }
}

/// Parts of names by which columns are known, the most telling first: lower case, by key of a log's table.
const NAMES: &[(&str, &[&str])] = &[
    ("input", &["voltage", "volt", "pwm", "command", "control", "duty", "input", "u", "vir", "effort"]),
    ("cart_position", &["cart_position", "cart", "carriage", "position", "pos", "x", "y"]),
    ("cart_speed", &["cart_speed", "velocity", "vel", "speed"]),
    ("drive_angle", &["drive_angle", "angle", "theta", "phi", "encoder", "qm", "steps"]),
    ("drive_speed", &["drive_speed", "omega", "rpm"]),
    ("motor_current", &["motor_current", "current", "amps", "ampere", "iq", "i"]),
    ("motor_voltage", &["motor_voltage"]),
    ("cart_acceleration", &["acceleration", "accel", "acc"]),
    ("reference", &["reference", "setpoint", "target", "desired", "ref"]),
];

/// Names of clocks.
const CLOCKS: &[&str] = &["time", "timestamp", "t", "clock", "seconds", "millis", "micros"];

/// Reads all columns of a file, and guesses what they are.
pub fn look(file: &Path) -> Result<Looked> {
    let mut ids = formats::names(file)?;
    ids.truncate(MOST);
    if ids.is_empty() {
        return Err(Error::new("this file has no columns of numbers").in_file(file));
    }
    let columns = match read(file, &ids) {
        Ok(columns) => columns,
        // One of them holds words, or has another length: each by itself.
        Err(_) => {
            let one = |id: &ColumnId| {
                let alone = read(file, std::slice::from_ref(id)).ok().and_then(|mut read| read.pop());
                alone.unwrap_or(FileColumn { id: id.clone(), unit: None, values: Vec::new() })
            };
            ids.iter().map(one).collect()
        }
    };
    if columns.iter().all(|column| column.values.is_empty()) {
        // What is wrong with them all is told of the first.
        read(file, &ids[..1])?;
    }
    let guess = guess(file, &columns);
    Ok(Looked { columns, guess })
}

fn read(file: &Path, ids: &[ColumnId]) -> Result<Vec<FileColumn>> {
    let preset = PRESETS.iter().find(|preset| preset.is_messages);
    let request = Request { complete: 0, units_row: true, preset, ..Request::complete(ids) };
    let mut sheet = formats::read(file, &request)?;
    let columns = std::mem::take(&mut sheet.columns);
    let all = ids.iter().zip(sheet.units).zip(columns);
    Ok(all.map(|((id, unit), values)| FileColumn { id: id.clone(), unit, values }).collect())
}

/// By a preset whose columns are there, else by names.
fn guess(file: &Path, columns: &[FileColumn]) -> Guess {
    let mut guess =
        PRESETS.iter().find_map(|preset| of_preset(preset, file, columns)).unwrap_or_else(|| by_name(columns));
    guess.split = guess.column("time").and_then(|time| split(&columns[time].values, time, columns));
    guess
}

/// The mapping of a preset, where the file has its clock and something that it measures.
fn of_preset(preset: &'static Preset, file: &Path, columns: &[FileColumn]) -> Option<Guess> {
    let place = |id: &ColumnId| columns.iter().position(|column| column.id == *id);
    let mut known = Vec::new();
    for (key, id, of) in preset.columns_of(file).ok()? {
        let unit = match of {
            In::Unit(unit) => Some(unit.to_string()),
            In::Own | In::MotorTurns | In::MotorSteps => None,
        };
        known.push((key, place(&id)?, unit));
    }
    let is_measured = |key: &str| Quantity::all().any(|quantity| quantity.name() == key);
    let found = known.iter().any(|(key, ..)| is_measured(key)) && known.iter().any(|(key, ..)| *key == "time");
    found.then_some(Guess { preset: Some(preset.name), columns: known, split: None })
}

fn by_name(columns: &[FileColumn]) -> Guess {
    let mut guess = Guess::default();
    let clock = |column: &FileColumn| rises(&column.values) && rank(&words(column), CLOCKS).is_some();
    let first = columns.iter().position(clock).or_else(|| columns.iter().position(|column| rises(&column.values)));
    if let Some(place) = first {
        guess.columns.push(("time", place, unit(&columns[place], "s").or_else(|| by_step(&columns[place]))));
    }
    for (key, names) in NAMES {
        let wanted = match *key {
            "input" => "V",
            "reference" => "m",
            key => Quantity::all().find(|quantity| quantity.name() == key).map_or("", |one| one.unit()),
        };
        let free = |place: &usize| !guess.columns.iter().any(|(_, taken, _)| taken == place);
        let ranked = (0..columns.len()).filter(free).filter_map(|place| {
            let column = &columns[place];
            let can_be = !column.values.is_empty() && (*key == "input" || is_of(column, wanted));
            Some((rank(&words(column), names)?, place)).filter(|_| can_be)
        });
        if let Some((_, place)) = ranked.min() {
            guess.columns.push((key, place, unit(&columns[place], wanted)));
        }
    }
    guess
}

/// True if a column can be of a quantity with this unit: the unit that its file states, if one, has the same dimension.
fn is_of(column: &FileColumn, wanted: &str) -> bool {
    let dimension = |unit: &str| conversion(unit).map(|(dimension, _)| dimension.without_angle()).ok();
    column.unit.as_deref().and_then(dimension).is_none_or(|own| Some(own) == dimension(wanted))
}

/// The unit that a column's name ends in, where the file states none.
fn unit(column: &FileColumn, wanted: &str) -> Option<String> {
    let name = column.id.name().filter(|_| column.unit.is_none())?;
    suspected(name, wanted).map(str::to_string)
}

/// Unit of a clock whose header names none, from the step between rows: recorders sample every 10 µs to 0.1 s.
fn by_step(column: &FileColumn) -> Option<String> {
    if column.unit.is_some() {
        return None;
    }
    match usual_step(&column.values)? {
        step if step > 500.0 => Some("us".into()),
        step if step >= 0.5 => Some("ms".into()),
        _ => None,
    }
}

/// A name in lower case, what is between brackets left out, and the words that it is made of.
fn words(column: &FileColumn) -> Vec<String> {
    let name = column.id.name().unwrap_or_default().to_lowercase();
    let name = name.split(['[', '(']).next().unwrap_or_default().trim().to_string();
    let mut words: Vec<String> = name.split(|c: char| !c.is_alphanumeric()).map(str::to_string).collect();
    words.insert(0, name);
    words
}

/// The first of these that is a word of a name, or several in a row: the less, the more telling.
fn rank(words: &[String], known: &[&str]) -> Option<usize> {
    let has = |known: &&str| {
        let parts: Vec<&str> = known.split('_').collect();
        words.iter().any(|word| word == known) || words.windows(parts.len()).any(|some| some == parts)
    };
    known.iter().position(has)
}

/// True if nearly all rows are above the one before: a clock may begin anew with each run.
fn rises(values: &[f64]) -> bool {
    let up = values.windows(2).filter(|pair| pair[1] > pair[0]).count();
    values.len() > 2 && up as f64 >= 0.97 * (values.len() - 1) as f64
}

/// Steps of a clock of so many usual ones part two runs.
const PAUSE: f64 = 10.0;

/// The column that changes where the clock goes back or pauses, and nowhere else.
fn split(time: &[f64], clock: usize, columns: &[FileColumn]) -> Option<usize> {
    let pause = PAUSE * usual_step(time)?;
    let parts = |k: usize| time[k] <= time[k - 1] || time[k] - time[k - 1] > pause;
    let seams: Vec<usize> = (1..time.len()).filter(|&k| parts(k)).collect();
    let tells = |column: &FileColumn| {
        let values = &column.values;
        let changes = (1..values.len()).filter(|&k| values[k].to_bits() != values[k - 1].to_bits());
        values.len() == time.len() && changes.eq(seams.iter().copied())
    };
    (0..columns.len()).find(|&place| place != clock && !seams.is_empty() && tells(&columns[place]))
}

/// The median of the steps forward.
fn usual_step(time: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    let middle = steps.len() / 2;
    (!steps.is_empty()).then(|| *steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn looked(name: &str, text: &str) -> Looked {
        let file = std::env::temp_dir().join(format!("taut-guess-{}-{name}", std::process::id()));
        std::fs::write(&file, text).unwrap();
        let found = look(&file).unwrap();
        std::fs::remove_file(file).unwrap();
        found
    }

    #[test]
    fn runs_of_one_file_are_told_apart_by_the_column_that_changes_with_them() {
        // The clock begins anew with each run, or goes on after a pause.
        for pause in [0, 1_000_000] {
            let mut text = "pwm, time_us, position\n".to_string();
            for (run, pwm) in [50, -50, 60].into_iter().enumerate() {
                let begin = pause * run;
                (0..40).for_each(|k| text += &format!("{pwm}, {}, {}\n", begin + 5000 * k, 0.01 * k as f64));
            }
            let found = looked("runs.csv", &text);
            let guess = &found.guess;
            assert_eq!(found.columns[2].values.len(), 120);
            assert_eq!(guess.columns[0], ("time", 1, Some("us".into())));
            assert_eq!(
                (guess.column("input"), guess.column("cart_position"), guess.split),
                (Some(0), Some(2), Some(0))
            );
        }
    }

    #[test]
    fn units_and_words_of_names_are_used() {
        let text =
            "# made by hand\nTime [ms]; Motor Current (mA); u; angle_deg\n0;1;0;0\n1;2;5;0.1\n2;3;5;0.3\n3;3;5;0.6\n";
        let found = looked("units.csv", text);
        assert_eq!(found.columns[0].unit.as_deref(), Some("ms"));
        let guess = &found.guess;
        assert_eq!(guess.column("motor_current"), Some(1));
        assert_eq!(guess.column("input"), Some(2));
        assert!(guess.columns.contains(&("drive_angle", 3, Some("deg".into()))));
        assert_eq!(guess.split, None);
    }

    /// The drive speed was taken for the cart speed, as the first column named a speed, and the log was refused for its
    /// unit.
    #[test]
    fn columns_of_our_own_results_are_what_they_are_called() {
        let text = "time_s,voltage_V,drive_angle_rad,drive_speed_rad_s,cart_position_m,cart_speed_m_s,motor_current_A\n\
                    0,5,0,0,0,0,7\n0.001,5,1e-3,2,1e-5,0.02,6.9\n0.002,5,5e-3,4,6e-5,0.05,6.8\n";
        let guess = looked("own.csv", text).guess;
        let keys = ["time", "input", "drive_angle", "drive_speed", "cart_position", "cart_speed", "motor_current"];
        assert_eq!(keys.map(|key| guess.column(key)), [0, 1, 2, 3, 4, 5, 6].map(Some));
        // A speed in rad/s is none of a cart, whichever its name.
        let guess = looked("speed.csv", "t [s], u [V], speed [rad/s]\n0,1,0\n0.1,1,1\n0.2,1,2\n").guess;
        assert_eq!(guess.column("cart_speed"), None);
    }

    #[test]
    fn columns_without_names_go_by_their_places() {
        let found = looked("bare.csv", "0 5 0\n1 5 0.1\n2 5 0.3\n3 5 0.5\n");
        assert_eq!(found.columns[1].id, ColumnId::Number(2));
        assert_eq!(found.guess.columns, [("time", 0, Some("ms".into()))]);
    }
}
