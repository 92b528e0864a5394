//! Spectra of the segments of logs, and responses at each line.

use super::{Cut, Point};
use crate::error::{Error, Result};
use crate::log::Log;
use crate::machine::Quantity;
use crate::signal::Hold;
use nalgebra::{Complex, DMatrix};
use rustfft::FftPlanner;
use std::f64::consts::PI;

/// Default number of segments of a record.
const SEGMENTS: f64 = 16.0;

/// Least number of segments or periods for a single input; one more for each further input.
const FEWEST: usize = 4;

/// Longest and shortest segment, samples.
const LONGEST: usize = 1 << 16;
const SHORTEST: usize = 16;

/// Fraction of independent segments with 50 % overlap under Hann's window.
const INDEPENDENT: f64 = 0.947;

/// Fraction of the second difference over the lines that is subtracted from sums over segments: half of the second
/// moment of the power of Hann's window, 1/3 of a line squared.
const SMEARED: f64 = 1.0 / 6.0;

/// Effect on the variance: the correlation of neighbouring lines is 4/9, of the next 1/36, so
/// (1 + 2/6)² + 2/36 − 4 (4/3) (1/6) (4/9) + 2/36² = 1.44.
const NOISIER: f64 = 1.44;

/// Largest coherence β² of an input with the others at which its response is determined: the variance is then 1/(1 −
/// β²) = 20 times that of independent inputs.
pub const ALIKE: f64 = 0.95;

/// An input rests if its power is at most this fraction of that of the strongest one: a thousandth of its amplitude.
const RESTS: f64 = 1e-6;

/// Relative singular values of the inputs below this do not count as excitation.
const SINGULAR: f64 = 1e-9;

/// Transforms of a signal by segment and line.
type Signal = Vec<Vec<Complex<f64>>>;

/// Spectra of combined logs.
pub(super) struct Spectra {
    /// The names of the logs.
    pub name: String,
    /// Sample interval, s.
    pub every: f64,
    /// Number of samples in a segment.
    pub length: usize,
    /// True if segments are periods.
    pub periodic: bool,
    /// The inputs between samples.
    pub hold: Hold,
    inputs: Vec<Signal>,
    /// Logged references that replace the inputs, if any.
    references: Option<Vec<Signal>>,
    outputs: Vec<(Quantity, Signal)>,
    lines: Vec<Line>,
}

/// The inputs at a line.
struct Line {
    /// Its index among the lines above zero.
    number: usize,
    /// The inputs excited there.
    excited: Vec<usize>,
    /// S_rr⁻¹ of these, and S_ur⁻¹ without the second moment of the window.
    power: DMatrix<Complex<f64>>,
    cross: DMatrix<Complex<f64>>,
    /// [S_ur⁻ᴴ S_rr S_ur⁻¹]_jj of each.
    wide: Vec<f64>,
    /// β² of each.
    alike: Vec<f64>,
}

/// The response of an output to an input.
pub(super) struct Row {
    /// The number of the input.
    pub drive: usize,
    pub quantity: Quantity,
    /// By frequency.
    pub points: Vec<Point>,
}

impl Spectra {
    /// Spectra of these logs combined. Errors: uneven samples, missing values, too few segments, logs that differ.
    pub fn new(logs: &[&Log], cut: &Cut) -> Result<Self> {
        let name = logs.iter().map(|log| log.name.as_str()).collect::<Vec<_>>().join(", ");
        let place = format!("log \"{name}\"");
        let wrong = |what: String| Error::new(what).in_file(&place);
        for log in logs {
            even(log).map_err(|error| error.in_file(format!("log \"{}\"", log.name)))?;
        }
        let every = logs[0].interval();
        if let Some(log) = logs.iter().find(|log| (log.interval() / every - 1.0).abs() > 1e-6) {
            let (own, first) = (log.interval(), &logs[0].name);
            return Err(wrong(format!(
                "\"{first}\" has a sample every {every:.6} s, \"{}\" every {own:.6} s",
                log.name
            ))
            .next("log with the same interval: these logs are taken together, for none moves all motors"));
        }
        let hold = logs[0].hold;
        if let Some(log) = logs.iter().find(|log| log.hold != hold) {
            return Err(wrong(format!("\"{}\" and \"{}\" have another `hold`", logs[0].name, log.name))
                .next("give these logs the same `hold`: they are taken together, for none moves all motors"));
        }
        let shortest = logs.iter().map(|log| log.len()).min().unwrap_or_default();
        let (length, step) = segments(shortest, every, cut).map_err(|error| error.in_file(&place))?;
        let periodic = cut.period.is_some();
        // The first period contains the transient.
        let first = if periodic { length } else { 0 };
        let all = |values: &dyn Fn(&Log) -> Vec<f64>| -> Signal {
            let one = |log: &&Log| transforms(&differences(&values(log)), first, length, step, periodic);
            logs.iter().flat_map(one).collect()
        };
        let inputs: Vec<Signal> =
            (0..logs[0].inputs.len()).map(|drive| all(&|log: &Log| log.inputs[drive].clone())).collect();
        let (count, fewest) = (inputs[0].len(), FEWEST + inputs.len() - 1);
        let mut outputs = Vec::new();
        for quantity in logs[0].outputs.iter().map(|output| output.quantity) {
            let signed = |log: &&Log| log.output(quantity).filter(|output| !output.absolute).cloned();
            let Some(seen) = logs.iter().map(signed).collect::<Option<Vec<_>>>() else { continue };
            for (log, output) in logs.iter().zip(&seen) {
                if let Some(place) = output.values.iter().position(|value| !value.is_finite()) {
                    return Err(wrong(format!("{} has no value at {:.6} s", quantity.name(), log.time[place]))
                        .next("cut the log where values are missing"));
                }
            }
            if count < fewest {
                return Err(wrong(format!("{count} segments of {length} samples"))
                    .allowed(format!("at least {fewest}"))
                    .next("give a shorter --segment, or log for longer"));
            }
            let values = |log: &Log| log.output(quantity).map(|output| output.values.clone()).unwrap_or_default();
            outputs.push((quantity, all(&values)));
        }
        if outputs.is_empty() {
            return Err(match logs {
                [_] => wrong("no output has a sign".into()).next("log a position or a speed"),
                _ => wrong("they have no output in common".into())
                    .next("log the same outputs: these logs are taken together, for none moves all motors"),
            });
        }
        let references = logs[0].reference.is_some();
        let references = references.then(|| vec![all(&|log: &Log| log.reference.clone().unwrap_or_default())]);
        let mut spectra = Self { name, every, length, periodic, hold, inputs, references, outputs, lines: Vec::new() };
        spectra.lines = spectra.excited();
        Ok(spectra)
    }

    /// Number of segments or periods.
    pub fn segments(&self) -> usize {
        self.inputs[0].len()
    }

    /// Number of inputs.
    pub fn drives(&self) -> usize {
        self.inputs.len()
    }

    /// The first measured quantity.
    pub(crate) fn first_output(&self) -> Quantity {
        self.outputs[0].0
    }

    /// True if references are used.
    pub fn closed(&self) -> bool {
        self.references.is_some()
    }

    /// β² of an input at the lines at which it is excited.
    pub fn alike(&self, drive: usize) -> Vec<f64> {
        let of_line = |line: &Line| Some(line.alike[line.excited.iter().position(|own| *own == drive)?]);
        self.lines.iter().filter_map(of_line).collect()
    }

    /// True if a response to that input exists.
    pub fn tells(&self, drive: usize) -> bool {
        self.alike(drive).into_iter().any(|alike| alike <= ALIKE)
    }

    /// Excitation: the references, or the inputs.
    fn excitations(&self) -> &[Signal] {
        self.references.as_deref().unwrap_or(&self.inputs)
    }

    /// Lines at which an input is excited.
    fn excited(&self) -> Vec<Line> {
        let (u, r) = (&self.inputs, self.excitations());
        let count = u[0].first().map_or(0, Vec::len);
        // The attenuation of a line by differencing, |1 − e^{−jωT}|², is not a lack of excitation.
        let plain = |signal: &Signal, k: usize| {
            power(signal, k) / (2.0 * (PI * (k + 1) as f64 / self.length as f64).sin()).powi(2)
        };
        let most: Vec<f64> = r.iter().map(|one| (0..count).map(|k| plain(one, k)).fold(0.0, f64::max)).collect();
        let strongest = most.iter().copied().fold(0.0, f64::max);
        // Lines of a multisine stand out; noise excites every line.
        let share = if self.periodic { 1e-4 } else { 1e-12 };
        let cross = sharpened((0..count).map(|k| crossed(u, r, k)).collect(), self.periodic);
        // Hann's window spreads the removed mean over the first two lines.
        let first = if self.periodic { 0 } else { 2 };
        let line = |k: usize| {
            let is_excited = |j: &usize| {
                let plain = plain(&r[*j], k);
                plain > share * most[*j] && most[*j] > RESTS * strongest && cross[k][(*j, *j)] != Complex::ZERO
            };
            let excited: Vec<usize> = (0..r.len()).filter(is_excited).collect();
            if excited.is_empty() {
                return None;
            }
            let of_excited = |all: &DMatrix<Complex<f64>>| all.select_rows(&excited).select_columns(&excited);
            let (rr, ur) = (of_excited(&crossed(r, r, k)), of_excited(&cross[k]));
            let (power, cross) = (inverse(&rr), inverse(&ur));
            let widened = cross.adjoint() * &rr * &cross;
            let wide = widened.diagonal().iter().map(|value| value.re).collect();
            let alike = (0..excited.len()).map(|j| alike(&rr, j)).collect();
            Some(Line { number: k, excited, power, cross, wide, alike })
        };
        (first..count).filter_map(line).collect()
    }

    /// The response to each distinguishable input, by input and output.
    pub fn rows(&self) -> Vec<Row> {
        let of_output = |(quantity, y): &(Quantity, Signal)| {
            let rows = self.points(y).into_iter().enumerate();
            rows.map(|(drive, points)| Row { drive, quantity: *quantity, points }).collect::<Vec<_>>()
        };
        let mut rows: Vec<Row> = self.outputs.iter().flat_map(of_output).collect();
        rows.retain(|row| !row.points.is_empty());
        rows.sort_by_key(|row| row.drive);
        rows
    }

    /// G, coherence and interval of an output at every line, by input.
    fn points(&self, y: &Signal) -> Vec<Vec<Point>> {
        let (u, r) = (&self.inputs, self.excitations());
        let y = std::slice::from_ref(y);
        let raw: Vec<DMatrix<Complex<f64>>> = (0..y[0][0].len()).map(|k| crossed(y, r, k)).collect();
        let sharp = sharpened(raw.clone(), self.periodic);
        let count = self.segments() as f64 * if self.periodic { 1.0 } else { INDEPENDENT };
        let noisier = if self.periodic { 1.0 } else { NOISIER };
        let mut all = vec![Vec::new(); self.drives()];
        for line in &self.lines {
            let k = line.number;
            let free = count - line.excited.len() as f64;
            let freedom = 2.0 * free;
            // F of 2 and ν degrees of freedom at 95 %: (ν/2) (0.05^(−2/ν) − 1)
            let quantile = 0.5 * freedom * (0.05f64.powf(-2.0 / freedom) - 1.0);
            // G = S_yr S_ur⁻¹
            let g = sharp[k].select_columns(&line.excited) * &line.cross;
            let explained = |segment: usize| -> Complex<f64> {
                line.excited.iter().zip(g.iter()).map(|(&drive, g)| g * u[drive][segment][k]).sum()
            };
            let left: f64 = y[0].iter().enumerate().map(|(segment, y)| (y[k] - explained(segment)).norm_sqr()).sum();
            // H = S_yr S_rr⁻¹, and the rest of S_yy
            let seen = raw[k].select_columns(&line.excited);
            let h = &seen * &line.power;
            let unseen = (power(&y[0], k) - (&h * seen.adjoint())[(0, 0)].re).max(0.0);
            for (j, &drive) in line.excited.iter().enumerate().filter(|(j, _)| line.alike[*j] <= ALIKE) {
                let variance = noisier * left * line.wide[j] / free;
                let own = h[(0, j)].norm_sqr() / line.power[(j, j)].re;
                all[drive].push(Point {
                    omega: 2.0 * PI * (k + 1) as f64 / (self.length as f64 * self.every),
                    value: g[(0, j)],
                    radius: (variance * quantile).sqrt(),
                    deviation: variance.sqrt(),
                    coherence: if own > 0.0 { own / (own + unseen) } else { 0.0 },
                });
            }
        }
        all
    }
}

/// Rejects samples that are not evenly spaced.
fn even(log: &Log) -> Result<()> {
    let every = log.interval();
    let uneven = log.time.windows(2).find(|pair| ((pair[1] - pair[0]) / every - 1.0).abs() > 0.01);
    let Some(pair) = uneven else { return Ok(()) };
    Err(Error::new(format!("the samples at {:.6} s and {:.6} s are not {every:.6} s apart", pair[0], pair[1]))
        .allowed("even samples, to 1 %")
        .next("resample the log, or cut it where samples are missing"))
}

/// Σ |S|² of a line.
fn power(signal: &Signal, k: usize) -> f64 {
    signal.iter().map(|segment| segment[k].norm_sqr()).sum()
}

/// Σ A Bᴴ of a line, over the segments.
fn crossed(a: &[Signal], b: &[Signal], k: usize) -> DMatrix<Complex<f64>> {
    DMatrix::from_fn(a.len(), b.len(), |i, j| a[i].iter().zip(&b[j]).map(|(a, b)| a[k] * b[k].conj()).sum())
}

/// Pseudo-inverse of sums of products; for dependent inputs, on their common part.
fn inverse(sums: &DMatrix<Complex<f64>>) -> DMatrix<Complex<f64>> {
    if sums.nrows() == 1 {
        return sums.map(|sum| sum.inv());
    }
    let size: Vec<f64> = sums.diagonal().iter().map(|sum| sum.norm().sqrt()).collect();
    let scaled = DMatrix::from_fn(sums.nrows(), sums.ncols(), |i, j| sums[(i, j)] / (size[i] * size[j]));
    let inverse = scaled.pseudo_inverse(SINGULAR).unwrap_or_else(|_| DMatrix::zeros(sums.nrows(), sums.ncols()));
    DMatrix::from_fn(sums.nrows(), sums.ncols(), |i, j| inverse[(i, j)] / (size[i] * size[j]))
}

/// β² of an input with the others: S_jo S_oo⁻¹ S_oj/S_jj.
fn alike(power: &DMatrix<Complex<f64>>, j: usize) -> f64 {
    let others: Vec<usize> = (0..power.nrows()).filter(|other| *other != j).collect();
    if others.is_empty() {
        return 0.0;
    }
    let of_others = power.select_rows(&others).select_columns(&others);
    let common = power.select_rows(&[j]).select_columns(&others);
    let known = (&common * inverse(&of_others) * common.adjoint())[(0, 0)].re;
    (known / power[(j, j)].re).clamp(0.0, 1.0)
}

/// Samples of a segment, and the step from one to the next.
fn segments(samples: usize, every: f64, cut: &Cut) -> Result<(usize, usize)> {
    if let Some(period) = cut.period {
        let length = (period / every).round() as usize;
        let is_whole = ((length as f64 * every) / period - 1.0).abs() <= 1e-4;
        if !is_whole || !(SHORTEST..=LONGEST).contains(&length) {
            return Err(Error::new(format!("a period of {period} s is no whole number of samples of {every} s"))
                .allowed(format!("{SHORTEST} to {LONGEST} samples"))
                .next("give the period of the input exactly"));
        }
        return Ok((length, length));
    }
    let wanted = cut.segment.map_or(2.0 * samples as f64 / (SEGMENTS + 1.0), |segment| segment / every);
    let length = match cut.segment {
        // The longest power of two with at least this number of segments.
        None => 1 << (wanted.max(1.0).log2().floor() as usize),
        Some(_) => wanted.round() as usize,
    };
    let length = length & !1;
    if !(SHORTEST..=LONGEST).contains(&length) {
        return Err(Error::new(format!("segments of {length} samples"))
            .allowed(format!("{SHORTEST} to {LONGEST}"))
            .next("give --segment, or a longer log"));
    }
    Ok((length, length / 2))
}

fn differences(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

/// Transforms of the segments from `first` on, at frequencies above zero up to half the sampling rate.
fn transforms(values: &[f64], first: usize, length: usize, step: usize, periodic: bool) -> Vec<Vec<Complex<f64>>> {
    let transform = FftPlanner::new().plan_fft_forward(length);
    let window = |k: usize| match periodic {
        true => 1.0,
        false => 0.5 - 0.5 * (2.0 * PI * k as f64 / length as f64).cos(),
    };
    let window: Vec<f64> = (0..length).map(window).collect();
    let mut all = Vec::new();
    let mut begin = first;
    while begin + length <= values.len() {
        let segment = &values[begin..begin + length];
        let mean = if periodic { 0.0 } else { segment.iter().sum::<f64>() / length as f64 };
        let mut buffer: Vec<Complex<f64>> =
            segment.iter().zip(&window).map(|(value, w)| Complex::new((value - mean) * w, 0.0)).collect();
        transform.process(&mut buffer);
        all.push(buffer[1..length / 2].to_vec());
        begin += step;
    }
    all
}

/// Sums over segments without the second moment of the window; unchanged for whole periods.
fn sharpened(sums: Vec<DMatrix<Complex<f64>>>, periodic: bool) -> Vec<DMatrix<Complex<f64>>> {
    let mut sharp = sums.clone();
    for k in (1..sums.len().saturating_sub(1)).filter(|_| !periodic) {
        sharp[k] -= (&sums[k + 1] - &sums[k] * Complex::new(2.0, 0.0) + &sums[k - 1]) * Complex::new(SMEARED, 0.0);
    }
    sharp
}

#[cfg(test)]
mod tests {
    use super::super::fit;
    use super::*;
    use crate::chance::normal;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    /// Spectra of white noise.
    fn noise(random: &mut Pcg64, signals: usize) -> Vec<Signal> {
        let mut white = || -> Vec<f64> { (0..4096).map(|_| normal(random)).collect() };
        (0..signals).map(|_| transforms(&white(), 0, 256, 128, false)).collect()
    }

    /// Spectra of these inputs and an output.
    fn spectra(inputs: Vec<Signal>, output: Signal) -> Spectra {
        let outputs = vec![(Quantity::DriveAngle, output)];
        let name = String::new();
        let mut spectra = Spectra {
            name,
            every: 1e-3,
            length: 256,
            periodic: false,
            hold: Hold::Zero,
            inputs,
            references: None,
            outputs,
            lines: vec![],
        };
        spectra.lines = spectra.excited();
        spectra
    }

    /// 95 % intervals of the delay covered 92.5 %: the fit assumed independent noise at neighbouring lines.
    #[test]
    fn noise_at_neighbouring_lines_is_alike_by_what_the_fit_takes() {
        let mut random = Pcg64::seed_from_u64(6);
        let mut sums = [0.0; 4];
        for _ in 0..100 {
            let mut signals = noise(&mut random, 2);
            let y = signals.pop().unwrap();
            let points = spectra(signals, y.clone()).points(&y).remove(0);
            for (distance, sum) in sums.iter_mut().enumerate() {
                let pairs = points.iter().zip(&points[distance..]);
                *sum += pairs.map(|(a, b)| (a.value / a.deviation * (b.value / b.deviation).conj()).re).sum::<f64>()
                    / (points.len() - distance) as f64;
            }
        }
        for (distance, rho) in [(1, fit::ALIKE[0]), (2, fit::ALIKE[1]), (3, 0.0)] {
            let seen = sums[distance] / sums[0];
            assert!((seen - rho).abs() < 0.02, "{distance}: {seen} {rho}");
        }
    }

    /// With y = 2 u₁ − 3 u₂ and noise, circles of both contain the true value in 95 of 100 cases, for any correlation
    /// of the inputs.
    #[test]
    fn circles_of_inputs_that_have_something_in_common_hold_the_truth() {
        let mut random = Pcg64::seed_from_u64(9);
        for common in [0.0, 1.0, 2.0] {
            let (mut holds, mut all, mut wide) = (0, 0, 0.0);
            for _ in 0..60 {
                let signals = noise(&mut random, 4);
                let with = |a: &Signal, b: &Signal, by: f64| -> Signal {
                    let of = |(a, b): (&Vec<Complex<f64>>, &Vec<Complex<f64>>)| {
                        a.iter().zip(b).map(|(a, b)| a + b * by).collect()
                    };
                    a.iter().zip(b).map(of).collect()
                };
                let inputs = [0, 1].map(|drive| with(&signals[drive], &signals[2], common));
                let clean = with(&with(&signals[3], &inputs[0], 2.0), &inputs[1], -3.0);
                for (points, truth) in spectra(inputs.to_vec(), clean.clone()).points(&clean).iter().zip([2.0, -3.0]) {
                    holds += points.iter().filter(|point| (point.value - truth).norm() <= point.radius).count();
                    wide += points.iter().map(|point| point.radius).sum::<f64>();
                    all += points.len();
                }
            }
            let share = holds as f64 / all as f64;
            assert!((0.935..0.975).contains(&share), "{common}: {share} of {all}, radius {}", wide / all as f64);
        }
    }

    #[test]
    fn an_input_that_is_its_own_is_told_beside_two_that_are_alike() {
        let mut random = Pcg64::seed_from_u64(2);
        let signals = noise(&mut random, 2);
        let own = spectra(vec![signals[0].clone(), signals[1].clone(), signals[0].clone()], signals[1].clone());
        assert!(!own.tells(0) && own.tells(1) && !own.tells(2));
        let rows = own.rows();
        assert!(rows.len() == 1 && rows[0].drive == 1);
        assert!(rows[0].points.iter().all(|point| (point.value - 1.0).norm() < 1e-9 && point.coherence > 0.999));
    }
}
