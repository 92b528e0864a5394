//! Periodic components of a force along the travel, and the significance of its variation, judged by differences
//! between passes.
//!
//! With c_p(f) the Fourier coefficient of pass p at the wave number f, and A(f) that of the map, their mean over both
//! directions, the noise is the mean over passes and neighbouring wave numbers
//!
//! ```text
//! S(f) = Σ |c_p − A|²/(ν B)
//! ```
//!
//! for any spectrum. Without a force |A|²/(S w) has the F distribution with 2 and 2 ν B degrees of freedom,
//! P(> x) = (1 + x/(ν B))^(−ν B), and N wave numbers are tried.

use crate::fit::limits::{
    MAP_ERRORS, MAP_FALSE_ALARM, MAP_HALF, MAP_INFLATION, MAP_NEIGHBOURS, MAP_PERIODS, MAP_RASTER, MAP_ROUNDS,
    MAP_SECTIONS, MAP_WAVES,
};
use crate::fit::search::triangle::inverse_of_square;
use crate::golden;
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::PI;

/// A sine along the travel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wave {
    /// Periods per metre, and its standard error.
    pub number: [f64; 2],
    /// N, and its standard error.
    pub amplitude: [f64; 2],
    /// Probability of such an amplitude without a force, over all tried wave numbers.
    pub chance: f64,
}

/// Differences between passes.
pub(super) struct Noise<'a> {
    /// Residuals of each pass against the map, N.
    pub residuals: &'a [Vec<f64>],
    /// ν: degrees of freedom of a point.
    pub freedom: f64,
    /// w: variance of the map relative to that of a pass.
    pub weight: f64,
    /// Distance of the points, m.
    pub step: f64,
}

/// Result of the search.
pub(super) struct Waves {
    /// True if the force changes along the travel.
    pub changes: bool,
    /// The periodic components, the largest first.
    pub waves: Vec<Wave>,
    /// Least detectable amplitude of a sine, N.
    pub visible: f64,
}

impl Noise<'_> {
    fn count(&self) -> usize {
        self.residuals[0].len()
    }

    /// Length of the travel that the points represent, m.
    fn length(&self) -> f64 {
        self.step * self.count() as f64
    }

    /// S(f) and ν B.
    fn at(&self, number: f64) -> [f64; 2] {
        let bins = (-MAP_NEIGHBOURS..=MAP_NEIGHBOURS).map(|k| number + f64::from(k) / self.length());
        let bins: Vec<f64> = bins.filter(|f| *f >= 0.5 / self.length() && *f <= 0.5 / self.step).collect();
        let power = |f: &f64| self.residuals.iter().map(|own| coefficient(own, f * self.step).norm_sqr()).sum::<f64>();
        let freedom = self.freedom * bins.len() as f64;
        [bins.iter().map(power).sum::<f64>() / freedom, freedom]
    }
}

/// Searches wave numbers up to `highest` (1/m) in the values of a map.
pub(super) fn search(values: &[f64], noise: &Noise, highest: f64) -> Waves {
    let (length, step) = (noise.length(), 1.0 / (MAP_RASTER * noise.length()));
    let raster: Vec<f64> = (MAP_RASTER as usize..).map(|k| k as f64 * step).take_while(|f| *f <= highest).collect();
    let tried = raster.len().max(1) as f64;
    // Probability of such an |A|² without a force.
    let chance = |f: f64, square: f64| {
        let [power, freedom] = noise.at(f);
        let x = square / (power * noise.weight).max(f64::MIN_POSITIVE);
        (tried * (-freedom * (x / freedom).ln_1p()).exp()).min(1.0)
    };
    // Among significant ones the largest, not the least probable: where passes differ less, a side lobe of a large sine
    // is less probable than the sine.
    let strongest = |left: &[f64], from: f64| {
        let squares = raster.iter().filter(|f| **f >= from).map(|f| (*f, coefficient(left, f * noise.step).norm_sqr()));
        let judged = squares.map(|(f, square)| (f, square, chance(f, square)));
        let significant = judged.filter(|(.., chance)| *chance < MAP_FALSE_ALARM);
        significant.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(f, _, chance)| (f, chance))
    };
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let whole: Vec<f64> = values.iter().map(|value| value - mean).collect();
    let mut changes = strongest(&whole, 0.0).is_some();
    let least = MAP_PERIODS / length;
    let (mut numbers, mut found): (Vec<f64>, Vec<(bool, f64)>) = (Vec::new(), Vec::new());
    for _ in 0..MAP_WAVES {
        let Some(left) = without(values, &numbers, noise.step) else { break };
        let Some((first, chance)) = strongest(&left, least) else { break };
        changes = true;
        let power = |f: f64| coefficient(&left, f * noise.step).norm_sqr();
        let number = golden::top([first - step, first + step], MAP_SECTIONS, power);
        if numbers.iter().any(|other| (other - number).abs() < 0.5 / length) {
            break;
        }
        // A component in only one half is not periodic.
        let size = coefficient(&left, number * noise.step).norm();
        let is_periodic = left
            .chunks(left.len().div_ceil(2))
            .all(|half| coefficient(half, number * noise.step).norm() > MAP_HALF * size);
        let before = numbers.clone();
        numbers.push(number);
        refine(values, &mut numbers, noise.step, step);
        // Sines that cancel each other are not in the force.
        if errors(values, &numbers, noise.step).is_none_or(|all| all.iter().any(|own| own.inflation > MAP_INFLATION)) {
            numbers = before;
            break;
        }
        found.push((is_periodic, chance));
    }
    let errors = errors(values, &numbers, noise.step).unwrap_or_default();
    let wave = |(k, (is_periodic, chance)): (usize, (bool, f64))| {
        // σ² = n S w/4 of each point
        let deviation = (0.25 * noise.count() as f64 * noise.at(numbers[k])[0] * noise.weight).sqrt();
        let own = errors.get(k)?;
        let number = [numbers[k], deviation * own.number];
        let amplitude = [own.size, deviation * own.amplitude];
        let is_clear = amplitude[0] > MAP_ERRORS * amplitude[1];
        // The flank of a slower one is significant, too.
        let repeats = numbers[k] > least - step;
        (is_periodic && is_clear && repeats).then_some(Wave { number, amplitude, chance })
    };
    let mut waves: Vec<Wave> = found.into_iter().enumerate().filter_map(wave).collect();
    waves.sort_by(|a, b| b.amplitude[0].total_cmp(&a.amplitude[0]));
    let needed = |f: &f64| {
        let [power, freedom] = noise.at(*f);
        let x = freedom * ((MAP_FALSE_ALARM / tried).powf(-freedom.recip()) - 1.0);
        (x * power * noise.weight).sqrt()
    };
    Waves { changes, waves, visible: raster.iter().map(needed).fold(0.0, f64::max) }
}

/// Refines each wave number to the least residual of all sines together, since a single sine is displaced by the
/// others.
fn refine(values: &[f64], numbers: &mut [f64], step: f64, raster: f64) {
    for _ in 0..MAP_ROUNDS {
        for k in 0..numbers.len() {
            let mut all = numbers.to_vec();
            let explained = |number: f64| {
                all[k] = number;
                let left = without(values, &all, step);
                left.map_or(f64::NEG_INFINITY, |left| -left.iter().map(|y| y * y).sum::<f64>())
            };
            let ends = [numbers[k] - 0.5 * raster, numbers[k] + 0.5 * raster];
            numbers[k] = golden::top(ends, MAP_SECTIONS, explained);
        }
    }
}

/// c = (2/n) Σ_j y_j e^(−2πi f j), f in periods per point.
fn coefficient(values: &[f64], number: f64) -> Complex<f64> {
    let sum: Complex<f64> =
        values.iter().enumerate().map(|(j, y)| Complex::from_polar(*y, -2.0 * PI * number * j as f64)).sum();
    sum * (2.0 / values.len() as f64)
}

/// The terms of a cubic and sines with these wave numbers at `n` points.
fn terms(n: usize, numbers: &[f64], step: f64) -> DMatrix<f64> {
    DMatrix::from_fn(n, 4 + 2 * numbers.len(), |j, column| match column {
        0..4 => (2.0 * j as f64 / (n - 1) as f64 - 1.0).powi(column as i32),
        _ => {
            let angle = 2.0 * PI * numbers[(column - 4) / 2] * step * j as f64;
            if column % 2 == 0 { angle.cos() } else { angle.sin() }
        }
    })
}

/// Residuals of a least-squares fit of a cubic and sines with these wave numbers.
fn without(values: &[f64], numbers: &[f64], step: f64) -> Option<Vec<f64>> {
    let matrix = terms(values.len(), numbers, step);
    let values = DVector::from_column_slice(values);
    let found = inverse_of_square(&matrix)? * matrix.tr_mul(&values);
    let left = values - &matrix * &found;
    Some(left.as_slice().to_vec())
}

/// One of several sines with a cubic, and its errors for points with a standard deviation of 1.
struct Errors {
    /// Its amplitude.
    size: f64,
    /// Standard error of the wave number, 1/m.
    number: f64,
    /// Standard error of the amplitude.
    amplitude: f64,
    /// Ratio of that to √(2/n) of a sine by itself.
    inflation: f64,
}

/// The errors of all sines together: (JᵀJ)⁻¹ with the derivatives by the coefficients of the cubic, a and b of each
/// a cos 2πfx + b sin 2πfx, and f.
fn errors(values: &[f64], numbers: &[f64], step: f64) -> Option<Vec<Errors>> {
    let n = values.len();
    let linear = terms(n, numbers, step);
    let found = inverse_of_square(&linear)? * linear.tr_mul(&DVector::from_column_slice(values));
    let pair = |k: usize| [found[4 + 2 * k], found[5 + 2 * k]];
    let first = linear.ncols();
    let mut whole = linear.resize_horizontally(first + numbers.len(), 0.0);
    for k in 0..numbers.len() {
        let [a, b] = pair(k);
        for j in 0..n {
            let x = step * j as f64;
            let (sin, cos) = (2.0 * PI * numbers[k] * x).sin_cos();
            whole[(j, first + k)] = 2.0 * PI * x * (b * cos - a * sin);
        }
    }
    let inverse = inverse_of_square(&whole)?;
    let of = |k: usize| {
        let ([a, b], i) = (pair(k), 4 + 2 * k);
        let size = a.hypot(b).max(f64::MIN_POSITIVE);
        let (a, b) = (a / size, b / size);
        let square = a * a * inverse[(i, i)] + 2.0 * a * b * inverse[(i, i + 1)] + b * b * inverse[(i + 1, i + 1)];
        let amplitude = square.max(0.0).sqrt();
        let number = inverse[(first + k, first + k)].max(0.0).sqrt();
        Errors { size, number, amplitude, inflation: amplitude / (2.0 / n as f64).sqrt() }
    };
    Some((0..numbers.len()).map(of).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::normal;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    const STEP: f64 = 4e-3;

    /// 3 N at 25.3/m and 1 N at 62.7/m on a slope, at 250 points.
    fn force(j: usize) -> f64 {
        let x = STEP * j as f64;
        5.0 + 2.0 * x + 3.0 * (2.0 * PI * 25.3 * x).sin() + (2.0 * PI * 62.7 * x + 0.4).cos()
    }

    #[test]
    fn amplitudes_of_two_sines_are_both_found() {
        let values: Vec<f64> = (0..250).map(force).collect();
        let all = errors(&values, &[25.3, 62.7], STEP).unwrap();
        assert!((all[0].size - 3.0).abs() < 1e-9 && (all[1].size - 1.0).abs() < 1e-9);
        // √(2/n) of each by itself; neighbours and the cubic add little.
        assert!(all.iter().all(|own| (0.9..1.1).contains(&own.inflation)));
        // Cramér and Rao's bound of a wave number, √6/(π a n^{3/2} h), for noise of deviation 1.
        for (own, size) in all.iter().zip([3.0, 1.0]) {
            let bound = 6f64.sqrt() / (PI * size * 250f64.powf(1.5) * STEP);
            assert!((own.number / bound - 1.0).abs() < 0.1, "{} {bound}", own.number);
        }
    }

    #[test]
    fn sines_are_found_with_their_wave_numbers_and_errors() {
        let mut random = Pcg64::seed_from_u64(3);
        let mut noise = || (0..250).map(|_| 0.1 * normal(&mut random)).collect::<Vec<f64>>();
        let values: Vec<f64> = noise().iter().enumerate().map(|(j, noise)| force(j) + noise).collect();
        let residuals: Vec<Vec<f64>> = (0..8).map(|_| noise()).collect();
        let noise = Noise { residuals: &residuals, freedom: 8.0, weight: 1.0, step: STEP };
        let found = search(&values, &noise, 100.0);
        assert!(found.changes && found.waves.len() == 2);
        for (wave, (number, amplitude)) in found.waves.iter().zip([(25.3, 3.0), (62.7, 1.0)]) {
            assert!((wave.number[0] - number).abs() < 4.0 * wave.number[1], "{wave:?}");
            assert!((wave.amplitude[0] - amplitude).abs() < 4.0 * wave.amplitude[1], "{wave:?}");
            // σ √(2/n) = 0.0089 N
            assert!((wave.amplitude[1] / 0.0089 - 1.0).abs() < 0.5, "{wave:?}");
        }
        // A tenth of a newton is clear only at its own wave number, not a period per length away.
        let weak: Vec<f64> = residuals[0]
            .iter()
            .enumerate()
            .map(|(j, own)| own + 0.1 * (2.0 * PI * 26.0 * STEP * j as f64).sin())
            .collect();
        let found = search(&weak, &noise, 100.0).waves;
        assert!(found.len() == 1 && (found[0].number[0] - 26.0).abs() < 4.0 * found[0].number[1], "{found:?}");
        let none = search(&residuals[0], &noise, 100.0);
        assert!(!none.changes && none.waves.is_empty() && none.visible < 0.1);
    }

    /// Sines three halves of a period per length apart, each begun where the other displaces it to.
    #[test]
    fn sines_close_together_are_refined_to_their_own_wave_numbers() {
        let x = |j: usize| STEP * j as f64;
        let value = |j| 3.0 * (2.0 * PI * 25.3 * x(j)).sin() + (2.0 * PI * 26.8 * x(j) + 0.4).cos();
        let values: Vec<f64> = (0..250).map(value).collect();
        for off in [-0.11, 0.11] {
            let mut numbers = [25.3 + off, 26.8 - off];
            refine(&values, &mut numbers, STEP, 0.25);
            assert!((numbers[0] - 25.3).abs() < 5e-3 && (numbers[1] - 26.8).abs() < 5e-3, "{off}: {numbers:?}");
        }
    }

    #[test]
    fn of_many_sines_the_eight_largest_are_named() {
        let sine = |k: usize, x: f64| (2.0 * PI * (10.0 + 7.0 * k as f64) * x).sin() * (2.0 - 0.1 * k as f64);
        let values: Vec<f64> = (0..250).map(|j| (0..11).map(|k| sine(k, STEP * j as f64)).sum()).collect();
        let residuals: Vec<Vec<f64>> =
            (0..4).map(|seed| (0..250).map(|j| 1e-3 * ((j * j + seed * j) as f64).sin()).collect()).collect();
        let noise = Noise { residuals: &residuals, freedom: 4.0, weight: 1.0, step: STEP };
        let found = search(&values, &noise, 100.0).waves;
        assert_eq!(found.len(), 8);
        for (k, wave) in found.iter().enumerate() {
            assert!((wave.number[0] - (10.0 + 7.0 * k as f64)).abs() < 0.2, "{k}: {wave:?}");
        }
    }
}
