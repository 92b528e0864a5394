//! Files of an accelerometer, in the forms that Klipper writes: spectra and raw samples.

use super::formats;
use super::lines::{Lines, open};
use super::sheet::{ColumnId, Request, Sheet};
use crate::error::{Error, Result, SourceLocation};
use crate::quantity::rounded;
use std::path::Path;

/// The columns of a spectrum.
const SPECTRUM: [&str; 5] = ["freq", "psd_x", "psd_y", "psd_z", "psd_xyz"];
/// The columns of samples.
const SAMPLES: [&str; 4] = ["time", "accel_x", "accel_y", "accel_z"];

const FORMS: &str = "a spectrum, freq,psd_x,psd_y,psd_z,psd_xyz (Hz), or samples, time,accel_x,accel_y,accel_z (s)";
const WHICH: &str =
    "give a resonances_*.csv, calibration_data_*.csv or raw_data_*.csv as Klipper writes them, or a case file .toml";

/// Fewest rows of a spectrum.
const FEWEST: usize = 20;
/// The spectrum must reach this far, Hz.
const REACH: f64 = 50.0;
/// Fewest samples a second.
const RATE: f64 = 200.0;
/// The shortest recording, s.
const SHORTEST: f64 = 1.0;
/// The longest pause within a recording, s.
const PAUSE: f64 = 0.05;

/// The content of an accelerometer's file.
#[derive(Debug, Clone, PartialEq)]
pub enum Accelerometer {
    /// Power spectral densities over frequency.
    Spectrum {
        /// Hz, ascending.
        frequency: Vec<f64>,
        /// Of x, y and z, and their sum; in the file's unit, (mm/s²)²/Hz.
        density: [Vec<f64>; 4],
        /// True if they are already divided by the frequency, as in files that name shapers.
        per_frequency: bool,
    },
    /// Accelerations over time.
    Samples {
        /// s, ascending and as good as even.
        time: Vec<f64>,
        /// Of x, y and z; in the file's unit, mm/s².
        acceleration: [Vec<f64>; 3],
    },
}

/// Reads a file of an accelerometer; which form it has is told by the names of its columns.
pub fn read_accelerometer(file: &Path) -> Result<Accelerometer> {
    let heading = Heading::read(file)?;
    let names = heading.text.to_lowercase();
    let (spectrum, samples) = (names.contains("psd"), names.contains("accel"));
    if spectrum && samples {
        let error = Error::new("these columns mix a spectrum with samples").at(heading.place);
        return Err(error.allowed(FORMS).next("keep the columns of one of them"));
    }
    if spectrum {
        heading.check(&SPECTRUM)?;
        let shapers = ["shapers", "zv"].iter().any(|word| names.contains(word));
        return read_spectrum(file, shapers);
    }
    if samples {
        heading.check(&SAMPLES)?;
        return read_samples(file);
    }
    let numbers = heading.text.split([',', ';', '\t', ' ']).any(|field| field.trim().parse::<f64>().is_ok());
    let what = match numbers {
        true => "the columns have no names, so their content is unknown",
        false => "these are not the columns of a spectrum or of accelerometer samples",
    };
    let next = match numbers {
        true => "put the row of names above the numbers",
        false => WHICH,
    };
    Err(Error::new(what).at(heading.place).allowed(FORMS).next(next))
}

/// The line that names the columns.
struct Heading {
    text: String,
    place: SourceLocation,
}

impl Heading {
    fn read(file: &Path) -> Result<Self> {
        let mut lines = Lines::new(file, open(file)?);
        let there = lines.advance()?;
        let names = |text: &str| ["accel", "psd"].iter().any(|word| text.to_lowercase().contains(word));
        // A remark names them where the first line has numbers already.
        if there && !names(&lines.text) && names(&lines.remark) {
            return Ok(Self { text: lines.remark.clone(), place: SourceLocation::file(file) });
        }
        if !there {
            let what = if lines.number == 0 { "the file is empty" } else { "the file has no rows" };
            let error = lines.error(what).allowed(FORMS);
            return Err(error.next("check that the test ran to its end and that its file was copied whole"));
        }
        Ok(Self { text: lines.text.clone(), place: lines.place(0..lines.text.len()) })
    }
}

impl Heading {
    /// Checks that all of these columns exist.
    fn check(&self, names: &[&str]) -> Result<()> {
        let fields: Vec<&str> = self.text.split([',', ';', '\t', ' ']).map(|f| f.trim().trim_matches('"')).collect();
        let Some(missing) = names.iter().find(|name| !fields.contains(*name)) else { return Ok(()) };
        let error = Error::new(format!("there is no column {missing}")).at(self.place.clone());
        let next = "name the columns exactly so; if one was not measured, measure again with all of them";
        Err(error.allowed(names.join(", ")).next(next))
    }
}

fn sheet(file: &Path, names: &[&str]) -> Result<Sheet> {
    let ids: Vec<ColumnId> = names.iter().map(|name| ColumnId::from(*name)).collect();
    formats::read(file, &Request::complete(&ids))
}

fn read_spectrum(file: &Path, per_frequency: bool) -> Result<Accelerometer> {
    let mut sheet = sheet(file, &SPECTRUM)?;
    ascending(&sheet, "frequency", "sort the rows by frequency, and keep one row of each")?;
    let frequency = &sheet.columns[0];
    if frequency[0] < 0.0 {
        let error = sheet.error(0, 0, format!("a frequency of {} Hz is below zero", frequency[0]));
        return Err(error.allowed("frequencies from 0 Hz on").next("keep the rows of a one-sided spectrum"));
    }
    for (i, column) in sheet.columns.iter().enumerate().skip(1) {
        if let Some(row) = column.iter().position(|value| *value < 0.0) {
            let what = format!("a power spectral density of {} in {} is below zero", column[row], SPECTRUM[i]);
            let error = sheet.error(i, row, what).allowed("densities of 0 and above");
            return Err(error.next("export the density itself, not its logarithm or decibels"));
        }
    }
    let last = frequency[frequency.len() - 1];
    if last < REACH {
        let error = sheet.error(0, frequency.len() - 1, format!("the spectrum ends at {} Hz", rounded(last)));
        let error = error.allowed(format!("frequencies up to {REACH} Hz and better 200 Hz"));
        return Err(error.next(match last < 10.0 {
            true => "if the first column is time, name it so and the others accel_x, accel_y, accel_z",
            false => "give the whole file: Klipper writes it up to 200 Hz",
        }));
    }
    if frequency.len() < FEWEST {
        let error = Error::new(format!("the spectrum has {} rows", frequency.len())).in_file(file);
        let allowed = format!("at least {FEWEST}, from 5 Hz to {REACH} Hz and beyond");
        return Err(error.allowed(allowed).next("give the whole file, in steps of one or two hertz"));
    }
    let counts = |f: &f64| (5.0..=200.0).contains(f);
    let seen = frequency.iter().zip(&sheet.columns[4]).any(|(f, density)| counts(f) && *density > 0.0);
    if !seen {
        let error = sheet.heading_error(4, "psd_xyz is zero from 5 to 200 Hz: nothing was measured");
        return Err(error.allowed("a density above 0 somewhere").next("check the accelerometer, and measure again"));
    }
    let mut columns = sheet.columns.drain(..);
    let mut take = || columns.next().unwrap_or_default();
    let frequency = take();
    let density = [take(), take(), take(), take()];
    Ok(Accelerometer::Spectrum { frequency, density, per_frequency })
}

fn read_samples(file: &Path) -> Result<Accelerometer> {
    let mut sheet = sheet(file, &SAMPLES)?;
    ascending(&sheet, "time", "cut the file where a second recording begins, and keep one row of each time")?;
    let time = &sheet.columns[0];
    let rows = time.len();
    let length = time[rows - 1] - time[0];
    let rate = if rows > 1 { (rows - 1) as f64 / length } else { 0.0 };
    let few = rows < 2;
    if few || length < SHORTEST {
        let what = format!("the recording has {rows} samples and lasts {} s", rounded(length));
        let error = Error::new(what).in_file(file).allowed(format!("at least {SHORTEST} s"));
        return Err(error.next("record a whole resonance test, which takes one or two minutes"));
    }
    if rate < RATE {
        let error = sheet.error(0, 1, format!("{} samples a second are too few", rounded(rate)));
        let error = error.allowed(format!("at least {RATE}, which show frequencies up to {}", RATE / 2.0));
        return Err(error.next(match rate < 10.0 {
            true => "give times in seconds; if the first column is frequency, name it freq and the others psd_x, psd_y, psd_z, psd_xyz",
            false => "give times in seconds; if they are, raise the accelerometer's rate",
        }));
    }
    if let Some(row) = (1..rows).find(|&row| time[row] - time[row - 1] > PAUSE) {
        let pause = rounded(time[row] - time[row - 1]);
        let error = sheet.error(0, row, format!("{pause} s are missing before this row"));
        let error = error.allowed(format!("pauses of at most {PAUSE} s"));
        return Err(error.next("keep the longer of the two parts, or record again"));
    }
    if sheet.columns[1..].iter().all(|column| column.iter().all(|value| *value == column[0])) {
        let error = sheet.heading_error(1, "the accelerations never change: nothing was measured");
        return Err(error.allowed("accelerations in mm/s²").next("check the accelerometer, and record again"));
    }
    let mut columns = sheet.columns.drain(..);
    let mut take = || columns.next().unwrap_or_default();
    let time = take();
    Ok(Accelerometer::Samples { time, acceleration: [take(), take(), take()] })
}

fn ascending(sheet: &Sheet, noun: &str, next: &str) -> Result<()> {
    let column = &sheet.columns[0];
    let Some(row) = (1..column.len()).find(|&row| column[row] <= column[row - 1]) else { return Ok(()) };
    let (value, before) = (column[row], column[row - 1]);
    let word = if value == before { "repeats that" } else { "is below the one" };
    let what = format!("{noun} {value} in {} {word} in {}, {before}", sheet.row(row), sheet.row(row - 1));
    Err(sheet.error(0, row, what).allowed(format!("a {noun} that increases from row to row")).next(next))
}
