//! Files of Klipper's `data_logger.py`: messages of JSON, each ended by a byte 3, packed by gzip; all on the printer's
//! clock.
//!
//! | column | what it is |
//! |---|---|
//! | `time` | print time, s |
//! | `angle:NAME` | an angle sensor, turns of the motor's shaft: 65536 counts each |
//! | `adxl345:NAME:x`, `:y`, `:z`; also lis2dw, mpu9250, icm20948 | an accelerometer, mm/s² |
//! | `trapq:NAME:x`, `:y`, `:z`, and each with `_velocity`, `_accel` | what was commanded, mm, mm/s, mm/s² |
//!
//! Sensors have samples at times of their own. Rows are those of the sensor that is wanted first; other sensors are
//! read between their samples on straight lines, as `readlog.py` does, and where one of them has none yet or no more
//! there is no row. What was commanded is exact at any time.

use super::sheet::{ColumnId, Request, Sheet};
use crate::error::{Error, Result};
use flate2::read::MultiGzDecoder;
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Most bytes that a file may be unpacked.
const MOST_BYTES: u64 = 1 << 30;
/// Longest message, bytes.
const LONGEST: u64 = 16 << 20;
/// Counts of a turn.
const COUNTS: f64 = 65536.0;

const FORM: &str = "messages of Klipper's data_logger.py: LOG.json.gz";

/// One sensor's samples: times, and a column for each of its values.
#[derive(Default)]
struct Sensor {
    time: Vec<f64>,
    values: Vec<Vec<f64>>,
}

/// A move: print time, duration, speed, acceleration, start, direction.
struct Motion {
    begin: f64,
    lasts: f64,
    speed: f64,
    acceleration: f64,
    from: [f64; 3],
    along: [f64; 3],
}

/// All that a file holds.
#[derive(Default)]
struct Recording {
    sensors: BTreeMap<String, Sensor>,
    moves: BTreeMap<String, Vec<Motion>>,
}

/// The names of the columns that a file has.
pub(super) fn names(file: &Path) -> Result<Vec<String>> {
    Recording::read(file).map(|recording| recording.names())
}

/// Reads the wanted columns.
pub(super) fn read(file: &Path, request: &Request<'_>) -> Result<Sheet> {
    let recording = Recording::read(file)?;
    let there = recording.names();
    let wanted: Vec<&ColumnId> = request.all_columns().collect();
    let mut names = Vec::new();
    for id in &wanted {
        let name = id.name().filter(|name| there.iter().any(|there| there == name)).map(str::to_string);
        names.push(name.ok_or_else(|| {
            Error::new(format!("there is no column {}", id.shown())).in_file(file).allowed(there.join(", ")).next(
                "name one of these; what was not recorded has to be configured in Klipper before data_logger.py starts",
            )
        })?);
    }
    let leading = names.iter().find(|name| recording.sensor(name).is_some()).ok_or_else(|| {
        Error::new("no sensor is named, at whose times there could be rows")
            .in_file(file)
            .allowed(
                there.iter().filter(|name| recording.sensor(name).is_some()).cloned().collect::<Vec<_>>().join(", "),
            )
            .next("name the column of an angle sensor or an accelerometer")
    })?;
    let mut time = recording.sensor(leading).map(|(sensor, _)| sensor.time.clone()).unwrap_or_default();
    for (sensor, _) in names.iter().filter_map(|name| recording.sensor(name)) {
        let (first, last) = (sensor.time.first().copied(), sensor.time.last().copied());
        time.retain(|t| first.is_some_and(|first| *t >= first) && last.is_some_and(|last| *t <= last));
    }
    if time.is_empty() {
        return Err(Error::new("the sensors have no time in common")
            .in_file(file)
            .next("record again with all of them on, or name one sensor"));
    }
    let units = names.iter().map(|name| Some(unit(name).to_string())).collect();
    let columns = names.iter().map(|name| recording.column(name, &time)).collect();
    let mut sheet = Sheet::from_columns(file, names, columns, request)?;
    sheet.units = units;
    sheet.units.truncate(request.columns.len());
    Ok(sheet)
}

fn unit(name: &str) -> &'static str {
    match name {
        "time" => "s",
        name if name.starts_with("angle:") => "rev",
        name if name.ends_with("_velocity") => "mm/s",
        name if name.starts_with("trapq:") && !name.ends_with("_accel") => "mm",
        _ => "mm/s^2",
    }
}

impl Recording {
    fn read(file: &Path) -> Result<Self> {
        let opened = crate::files::open(file).map_err(|error| super::lines::unreadable(file, &error))?;
        let mut input = BufReader::new(MultiGzDecoder::new(opened).take(MOST_BYTES));
        let mut recording = Self::default();
        let (mut message, mut count, mut bytes) = (Vec::new(), 0, 0);
        loop {
            message.clear();
            let read = (&mut input).take(LONGEST).read_until(3, &mut message);
            let length = match read {
                Ok(0) => break,
                Ok(length) => length,
                // A logger that was killed leaves the end of the file unwritten: what is there counts.
                Err(_) if count > 0 => break,
                Err(_) => return Err(wrong(file, "this is a compressed file that cannot be unpacked")),
            };
            bytes += length as u64;
            if message.pop() != Some(3) {
                // The last message was cut off, or this is something else.
                if count > 0 && bytes < MOST_BYTES {
                    break;
                }
                return Err(wrong(file, "this is a compressed file, and holds no messages"));
            }
            let Ok(value) = serde_json::from_slice::<Value>(&message) else {
                return Err(wrong(file, &format!("message {} of this file is no JSON", count + 1)));
            };
            count += 1;
            recording.take(&value);
        }
        match count {
            0 => Err(wrong(file, "this file holds no messages")),
            _ => recording.checked(file),
        }
    }

    /// Takes up a message of a subscription: `{"q": "angle:x", "params": {"data": [[...], ...]}}`.
    fn take(&mut self, message: &Value) {
        let (Some(name), Some(data)) = (message["q"].as_str(), message["params"]["data"].as_array()) else { return };
        let numbers = |row: &Value| -> Option<Vec<f64>> { row.as_array()?.iter().map(Value::as_f64).collect() };
        if name.starts_with("trapq:") {
            let moves = self.moves.entry(name.to_string()).or_default();
            moves.extend(data.iter().filter_map(Motion::read));
            return;
        }
        let width = if name.starts_with("angle:") { 1 } else { 3 };
        let is_accelerometer =
            ["adxl345:", "lis2dw:", "mpu9250:", "icm20948:"].iter().any(|kind| name.starts_with(kind));
        if width == 3 && !is_accelerometer {
            return;
        }
        let sensor = self.sensors.entry(name.to_string()).or_default();
        sensor.values.resize(width, Vec::new());
        for row in data.iter().filter_map(numbers).filter(|row| row.len() > width) {
            sensor.time.push(row[0]);
            for (column, value) in sensor.values.iter_mut().zip(&row[1..]) {
                column.push(if width == 1 { value / COUNTS } else { *value });
            }
        }
    }

    /// Refuses clocks that go back.
    fn checked(self, file: &Path) -> Result<Self> {
        for (name, sensor) in &self.sensors {
            if let Some(pair) = sensor.time.windows(2).find(|pair| pair[1] <= pair[0]) {
                let what = format!("the clock of {name} goes back: from {} s to {} s", pair[0], pair[1]);
                return Err(Error::new(what).in_file(file).next("record again: two recordings may be in this file"));
            }
        }
        Ok(self)
    }

    fn names(&self) -> Vec<String> {
        let mut names = vec!["time".to_string()];
        for (name, sensor) in self.sensors.iter().filter(|(_, sensor)| !sensor.time.is_empty()) {
            match sensor.values.len() {
                1 => names.push(name.clone()),
                _ => names.extend(["x", "y", "z"].map(|axis| format!("{name}:{axis}"))),
            }
        }
        for (name, _) in self.moves.iter().filter(|(_, moves)| !moves.is_empty()) {
            for axis in ["x", "y", "z"] {
                names.extend(["", "_velocity", "_accel"].map(|of| format!("{name}:{axis}{of}")));
            }
        }
        names
    }

    /// The sensor of a column, and which of its values that is.
    fn sensor(&self, name: &str) -> Option<(&Sensor, usize)> {
        if let Some(sensor) = self.sensors.get(name) {
            return Some((sensor, 0));
        }
        let (sensor, axis) = name.rsplit_once(':')?;
        Some((self.sensors.get(sensor)?, ["x", "y", "z"].iter().position(|known| *known == axis)?))
    }

    fn column(&self, name: &str, time: &[f64]) -> Vec<f64> {
        if name == "time" {
            return time.to_vec();
        }
        if let Some((sensor, value)) = self.sensor(name) {
            return time.iter().map(|t| between(&sensor.time, &sensor.values[value], *t)).collect();
        }
        let (queue, of) = name.rsplit_once(':').unwrap_or((name, ""));
        let (axis, rate) = of.split_once('_').unwrap_or((of, ""));
        let axis = ["x", "y", "z"].iter().position(|known| *known == axis).unwrap_or(0);
        let moves = self.moves.get(queue).map_or(&[][..], |moves| &moves[..]);
        time.iter().map(|t| commanded(moves, *t, axis, rate)).collect()
    }
}

impl Motion {
    /// `[print_time, move_t, start_v, accel, [x, y, z], [x, y, z]]`
    fn read(row: &Value) -> Option<Self> {
        let three = |value: &Value| Some([value[0].as_f64()?, value[1].as_f64()?, value[2].as_f64()?]);
        Some(Self {
            begin: row[0].as_f64()?,
            lasts: row[1].as_f64()?,
            speed: row[2].as_f64()?,
            acceleration: row[3].as_f64()?,
            from: three(&row[4])?,
            along: three(&row[5])?,
        })
    }
}

/// Position, velocity or acceleration of what was commanded; before the first move its start, between moves the end of
/// the last one.
fn commanded(moves: &[Motion], t: f64, axis: usize, rate: &str) -> f64 {
    let index = moves.partition_point(|motion| motion.begin <= t).saturating_sub(1);
    let Some(motion) = moves.get(index) else { return f64::NAN };
    let is_within = (motion.begin..=motion.begin + motion.lasts).contains(&t);
    let tau = (t - motion.begin).clamp(0.0, motion.lasts);
    match rate {
        "velocity" if is_within => motion.along[axis] * (motion.speed + motion.acceleration * tau),
        "accel" if is_within => motion.along[axis] * motion.acceleration,
        "velocity" | "accel" => 0.0,
        _ => motion.from[axis] + motion.along[axis] * (motion.speed + 0.5 * motion.acceleration * tau) * tau,
    }
}

/// The value at `t` on the straight line between two samples.
fn between(time: &[f64], values: &[f64], t: f64) -> f64 {
    let above = time.partition_point(|own| *own < t).min(time.len().saturating_sub(1));
    let (Some(&end), Some(&value)) = (time.get(above), values.get(above)) else { return f64::NAN };
    if above == 0 || end == t {
        return value;
    }
    let (begin, before) = (time[above - 1], values[above - 1]);
    before + (value - before) * (t - begin) / (end - begin)
}

fn wrong(file: &Path, what: &str) -> Error {
    Error::new(what)
        .in_file(file)
        .allowed(FORM)
        .next("give the .json.gz that data_logger.py wrote, or export the data as CSV, in UTF-8")
}
