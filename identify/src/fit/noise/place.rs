//! Errors that repeat with position in both directions: eccentric pulleys or encoders, teeth, cogging of a motor.
//!
//! ```text
//! r(t) = J(t) δ + a cos κ ŷ(t) + b sin κ ŷ(t) + noise
//! ```
//!
//! They are not noise: they shift the estimates regardless of the length of the logs, and repeat with the same input.
//! Wave numbers κ from two waves in the travel to one in two blocks are tried.

use super::Slow;
use super::filter::{Numbers, innovations};
use super::series::Series;
use crate::fit::limits::{BOTH_WAYS, FEWEST_WAVES, MOST_WAVE_NUMBERS, WAVE_CLEAR, WAVE_HALVINGS, WAVE_STEP};
use std::f64::consts::TAU;

/// An error that is periodic in position.
pub(super) struct PeriodicError {
    /// Its wave number, rad in the quantity's unit.
    pub kappa: f64,
    /// Least increase of the log-likelihood by it.
    pub gain: f64,
    /// Amplitude, in standard deviations of the value with the largest weight, and range of the quantity in its unit.
    pub amplitude: f64,
    pub travel: f64,
    /// Number of wave numbers tried.
    pub tried: usize,
}

/// The wave that reduces the residuals most, after subtraction of the waves in the rows with these amplitudes.
pub(super) fn wave(all: &[Series], amplitudes: &[f64], slow: &[Slow], white: f64) -> Option<PeriodicError> {
    let values = || all.iter().flat_map(|series| &series.value).copied();
    let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let travel = high - low;
    // A quarter of the blocks moves faster than this.
    let steps = || all.iter().flat_map(|series| series.value.windows(2)).map(|v| v[1] - v[0]);
    let mut sizes: Vec<f64> = steps().map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    let coarse = *sizes.get(sizes.len() * 3 / 4)?;
    if !(travel > 0.0 && coarse > 0.0) {
        return None;
    }
    let way = |sign: f64| steps().map(|step| (sign * step).max(0.0)).sum::<f64>();
    if way(1.0).min(way(-1.0)) < BOTH_WAYS * travel {
        return None;
    }
    let once = TAU / travel;
    let first = FEWEST_WAVES * once;
    let count = (((TAU / (2.0 * coarse) - first) / (WAVE_STEP * once)).max(0.0) as usize).min(MOST_WAVE_NUMBERS);
    let of = |kappa: f64| gain(all, amplitudes, slow, kappa);
    let tried = (0..count).map(|k| first + WAVE_STEP * once * k as f64).map(|kappa| (kappa, of(kappa)));
    let (mut kappa, mut most) = tried.max_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    if most.0 >= WAVE_CLEAR * white {
        let mut step = 0.5 * WAVE_STEP * once;
        for _ in 0..WAVE_HALVINGS {
            for near in [(kappa - step).max(first), kappa + step] {
                let gain = of(near);
                if gain.0 > most.0 {
                    (kappa, most) = (near, gain);
                }
            }
            step *= 0.5;
        }
    }
    Some(PeriodicError { kappa, gain: most.0 / white, amplitude: most.1, travel, tried: count })
}

/// Increase of the log-likelihood by a wave, times the variance of white noise; and its amplitude.
fn gain(all: &[Series], amplitudes: &[f64], slow: &[Slow], kappa: f64) -> (f64, f64) {
    // Σ c c, c s, s s, c r, s r of the innovations.
    let mut sums = [0.0; 5];
    for series in all {
        let waves = columns(series, kappa);
        let wide = series.wide();
        let before = wide - 1 - series.more;
        let left =
            |row: &[f64]| row[wide - 1] - row[before..wide - 1].iter().zip(amplitudes).map(|(c, a)| c * a).sum::<f64>();
        let own = series.rows.chunks(wide).enumerate();
        let rows: Vec<f64> = own.flat_map(|(k, row)| [waves[0][k], waves[1][k], left(row)]).collect();
        innovations(series, &rows, 3, &[slow], |v: &[Numbers<1>], f: f64| {
            let [c, s, r] = [v[0].0[0], v[1].0[0], v[2].0[0]];
            for (sum, product) in sums.iter_mut().zip([c * c, c * s, s * s, c * r, s * r]) {
                *sum += product / f;
            }
        });
    }
    let [cc, cs, ss, cr, sr] = sums;
    let determinant = cc * ss - cs * cs;
    if determinant <= 1e-6 * cc * ss {
        return (0.0, 0.0);
    }
    let (a, b) = ((cr * ss - sr * cs) / determinant, (sr * cc - cr * cs) / determinant);
    (0.5 * (a * cr + b * sr), f64::hypot(a, b))
}

/// cos κ ŷ and sin κ ŷ as columns of rows.
pub(super) fn columns(series: &Series, kappa: f64) -> [Vec<f64>; 2] {
    let of = |wave: fn(f64) -> f64| {
        series.value.iter().zip(&series.gain).map(|(value, gain)| gain * wave(kappa * value)).collect()
    };
    [of(f64::cos), of(f64::sin)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_is_found_with_its_amplitude_and_likelihood() {
        let (kappa, n) = (40.0, 200);
        let value: Vec<f64> = (0..n).map(|k| 0.002 * f64::from(k)).collect();
        let rows: Vec<f64> = value.iter().map(|x| 0.3 * (kappa * x).cos() - 0.4 * (kappa * x).sin()).collect();
        let square: f64 = rows.iter().map(|r| r * r).sum();
        let series = Series::residuals(rows, value);
        let (gained, amplitude) = gain(&[series], &[], &[], kappa);
        assert!((amplitude - 0.5).abs() < 1e-12, "{amplitude}");
        // It explains all: ½ Σ r²
        assert!((gained - 0.5 * square).abs() < 1e-9 * square, "{gained}");
    }

    /// There and back, with a wave and a little of another one: in any unit the same wave, of as many that are tried.
    #[test]
    fn a_wave_is_found_in_any_unit() {
        let found = [1e-3, 1.0, 1e3].map(|unit| {
            let ways: Vec<f64> = (0..100).map(|k| 0.004 * f64::from(k)).collect();
            let value: Vec<f64> = ways.iter().chain(ways.iter().rev()).map(|way| unit * way).collect();
            let row = |x: &f64| 0.3 * (40.0 * x / unit).cos() + 0.01 * (123.0 * x / unit).sin();
            let found = wave(&[Series::residuals(value.iter().map(row).collect(), value)], &[], &[], 1e-4).unwrap();
            assert!((found.kappa * unit / 40.0 - 1.0).abs() < 0.02, "{unit}: {}", found.kappa);
            assert!((found.travel / unit - 0.396).abs() < 1e-9 && (found.amplitude - 0.3).abs() < 0.02);
            found.tried
        });
        assert!(found[0] > 10 && found.iter().all(|tried| tried.abs_diff(found[0]) <= 1), "{found:?}");
    }

    /// Residuals of 0.3 cos κx at places x, with the wave that is found in them.
    fn found(kappa: f64, places: Vec<f64>) -> Option<PeriodicError> {
        let rows = places.iter().map(|x| 0.3 * (kappa * x).cos()).collect();
        wave(&[Series::residuals(rows, places)], &[], &[], 1e-4)
    }

    /// There and back over `travel`, with this many rows each way.
    fn both_ways(travel: f64, rows: u32) -> Vec<f64> {
        let there = || (0..=rows).map(|k| travel * f64::from(k) / f64::from(rows));
        there().chain(there().rev()).collect()
    }

    /// Wave numbers are tried half a wave in the travel apart, and then around the best: one in the middle between two
    /// is found to a thirtieth of a wave.
    #[test]
    fn a_wave_between_those_that_are_tried_is_found() {
        for waves in [4.34, 6.22, 9.66] {
            let found = found(TAU * waves, both_ways(1.0, 200)).unwrap();
            assert!((found.kappa / TAU - waves).abs() < 0.03, "{waves}: {}", found.kappa / TAU);
        }
    }

    /// The search takes time in proportion to the wave numbers that are tried.
    #[test]
    fn a_long_travel_has_a_bounded_number_of_waves() {
        assert_eq!(found(TAU * 40.0, both_ways(1.0, 1000)).unwrap().tried, 200);
    }

    /// An error that was seen in one direction is one of a law as well.
    #[test]
    fn a_wave_must_be_seen_in_both_directions() {
        let places = |back: f64| {
            let all = both_ways(1.0, 200).into_iter().enumerate();
            all.filter(|(k, x)| *k <= 200 || *x > 1.0 - back).map(|(_, x)| x).collect()
        };
        assert!(found(60.0, places(0.4)).is_none() && found(60.0, places(0.6)).is_some());
    }
}
