//! The damping ratio of the highest peak of a spectrum, by a curve of one mode through it.
//!
//! A spectrum by Welch's method is the true one seen through the window of a segment: with bins Δ apart and the Kaiser
//! window of form β,
//!
//! ```text
//! P(f) = A ∫ K((f − f′)/Δ) g(f′) df′ + c,  g(f) = f (f₀² + (2 ζ f)²) / ((f₀² − f²)² + (2 ζ f₀ f)²)
//! K(δ) ∝ (sinh √(β² − π²δ²) / √(β² − π²δ²))²
//! ```
//!
//! g is the acceleration of a mode whose frame is shaken more strongly with increasing frequency, divided by the
//! frequency as the spectrum is. A and c follow from f₀ and ζ by least squares of relative errors; f₀ and ζ are
//! searched for. Without the window, a light damping would be estimated too large: at 1.6 Hz between bins a mode of 47
//! Hz seems to have 0.02 more.

use super::spectrum::Spectrum;
use super::welch::BETA;
use std::f64::consts::PI;

/// Range of bins around the peak, as a factor on its frequency, and their least number.
const ABOUT: f64 = 1.3;
const FEWEST: usize = 8;

/// Points of the grid for each unknown, and the number of its refinements.
const GRID: i32 = 12;
const FINER: usize = 7;

/// Least and most damping ratio.
const LEAST: f64 = 1e-3;
const MOST: f64 = 0.5;

/// Distances in bins at which the window counts.
pub(super) const REACH: f64 = 3.0;
const PARTS: i32 = 30;

/// A mode fitted to a spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct FittedMode {
    /// Undamped natural frequency, Hz.
    pub frequency: f64,
    /// Damping ratio.
    pub damping: f64,
    /// Central 95 % of the damping ratio.
    pub interval: [f64; 2],
    /// Root mean square of the relative errors of the curve.
    pub error: f64,
}

/// Mode fitted to the highest peak; none with too few bins around it, or if no mode fits.
pub fn fitted(spectrum: &Spectrum) -> Option<FittedMode> {
    let (top, _) = spectrum.peaks().into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    // Half way to the next peak on either side.
    let (mut low, mut high) = (top / ABOUT, top * ABOUT);
    for (f, _) in spectrum.peaks() {
        if f < top {
            low = low.max(0.5 * (f + top));
        } else if f > top {
            high = high.min(0.5 * (f + top));
        }
    }
    let pairs = spectrum.frequency.iter().copied().zip(spectrum.density.iter().copied());
    let bins: Vec<(f64, f64)> = pairs.filter(|(f, p)| (low..=high).contains(f) && *p > 0.0).collect();
    let width = spectrum.frequency.get(1)? - spectrum.frequency[0];
    if bins.len() < FEWEST || width.is_nan() || width <= 0.0 {
        return None;
    }
    let kernel = kernel(PARTS);
    let at = |f: f64, zeta: f64| squares(&bins, &kernel, width, f, zeta);
    let (mut best, mut steps): ((f64, f64), (f64, f64)) =
        ((top, 0.05), (0.06 * top / f64::from(GRID) * 2.0, (MOST / LEAST).ln() / f64::from(GRID)));
    let mut least = f64::INFINITY;
    for _ in 0..FINER {
        let centre = best;
        for i in -GRID / 2..=GRID / 2 {
            for k in -GRID / 2..=GRID / 2 {
                let f = centre.0 + f64::from(i) * steps.0;
                let zeta = (centre.1.ln() + f64::from(k) * steps.1).exp().clamp(LEAST, MOST);
                let value = at(f, zeta);
                if value < least {
                    (least, best) = (value, (f, zeta));
                }
            }
        }
        steps = (0.35 * steps.0, 0.35 * steps.1);
    }
    if !least.is_finite() {
        return None;
    }
    // Limits where the least squares over the frequency exceed their 95 % threshold.
    let freedom = bins.len() as f64 - 4.0;
    let bound = least * (1.0 + 3.84 / freedom.max(1.0));
    let along = |zeta: f64| {
        let near = |k: i32| at(best.0 * (1.0 + 0.002 * f64::from(k)), zeta);
        (-10..=10).map(near).fold(f64::INFINITY, f64::min)
    };
    let edge = |direction: f64| {
        let mut zeta = best.1;
        while (LEAST..MOST).contains(&zeta) && along(zeta) <= bound {
            zeta *= (0.04 * direction).exp();
        }
        zeta.clamp(LEAST, MOST)
    };
    let error = (least / bins.len() as f64).sqrt();
    Some(FittedMode { frequency: best.0, damping: best.1, interval: [edge(-1.0), edge(1.0)], error })
}

/// Weights of the window at distances up to [`REACH`] bins, which have `parts` steps.
pub(super) fn kernel(parts: i32) -> Vec<(f64, f64)> {
    let at = |delta: f64| {
        let inside = BETA * BETA - (PI * delta).powi(2);
        let root = inside.abs().sqrt();
        let w = match inside {
            _ if root < 1e-9 => 1.0,
            i if i > 0.0 => root.sinh() / root,
            _ => root.sin() / root,
        };
        w * w
    };
    let all: Vec<(f64, f64)> =
        (-parts..=parts).map(|k| REACH * f64::from(k) / f64::from(parts)).map(|delta| (delta, at(delta))).collect();
    let sum: f64 = all.iter().map(|one| one.1).sum();
    all.into_iter().map(|(delta, w)| (delta, w / sum)).collect()
}

/// Σ ((P − A g − c)/P)² at the best A and c that are not negative.
fn squares(bins: &[(f64, f64)], kernel: &[(f64, f64)], width: f64, f0: f64, zeta: f64) -> f64 {
    let g =
        |f: f64| f * (f0 * f0 + (2.0 * zeta * f).powi(2)) / ((f0 * f0 - f * f).powi(2) + (2.0 * zeta * f0 * f).powi(2));
    let seen: Vec<f64> =
        bins.iter().map(|(f, _)| kernel.iter().map(|(delta, w)| w * g((f + delta * width).max(1e-3))).sum()).collect();
    // Normal equations of (A, c), weighted by 1/P².
    let (mut gg, mut gc, mut cc, mut gp, mut cp) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for ((_, p), g) in bins.iter().zip(&seen) {
        (gg, gc, cc) = (gg + (g / p).powi(2), gc + g / (p * p), cc + 1.0 / (p * p));
        (gp, cp) = (gp + g / p, cp + 1.0 / p);
    }
    let determinant = gg * cc - gc * gc;
    let (mut a, mut c) = ((gp * cc - cp * gc) / determinant, (cp * gg - gp * gc) / determinant);
    if c.is_nan() || c < 0.0 {
        (a, c) = (gp / gg, 0.0);
    }
    if a.is_nan() || a <= 0.0 {
        return f64::INFINITY;
    }
    bins.iter().zip(&seen).map(|((_, p), g)| ((p - a * g - c) / p).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Acceleration of a vibration excited at its base by white noise of its speed, with a constant floor.
    #[test]
    fn the_vibration_of_a_spectrum_leaves_nothing_of_it() {
        let transmitted = |f: f64, f0: f64, zeta: f64| {
            let u = f / f0;
            f * (1.0 + (2.0 * zeta * u).powi(2)) / ((1.0 - u * u).powi(2) + (2.0 * zeta * u).powi(2)) / (f0 * f0)
        };
        let bin = |f: f64| (f, 3.0 * transmitted(f, 48.5, 0.05) * 48.5_f64.powi(2) + 2.0);
        let bins: Vec<(f64, f64)> = (30..70).map(|f| bin(f64::from(f))).collect();
        let left = |f0: f64, zeta: f64| squares(&bins, &[(0.0, 1.0)], 1.0, f0, zeta);
        assert!(left(48.5, 0.05) < 1e-20, "{}", left(48.5, 0.05));
        for (f0, zeta) in [(48.0, 0.05), (49.0, 0.05), (48.5, 0.04), (48.5, 0.06)] {
            assert!(left(f0, zeta) > 1e-3, "{f0} {zeta}: {}", left(f0, zeta));
        }
    }

    /// No other amplitude and floor leave less.
    #[test]
    fn amplitude_and_floor_have_the_least_squares() {
        let bins: Vec<(f64, f64)> = (30..60)
            .map(|f| (f64::from(f), 2.0 + (0.9 * f64::from(f)).sin() + 40.0 / f64::from(1 + (f - 44) * (f - 44))))
            .collect();
        let (f0, zeta) = (44.0_f64, 0.03_f64);
        let own = squares(&bins, &[(0.0, 1.0)], 1.0, f0, zeta);
        let g = |f: f64| {
            f * (f0 * f0 + (2.0 * zeta * f).powi(2)) / ((f0 * f0 - f * f).powi(2) + (2.0 * zeta * f0 * f).powi(2))
        };
        let left = |a: f64, c: f64| -> f64 { bins.iter().map(|(f, p)| ((p - a * g(*f) - c) / p).powi(2)).sum() };
        // A search by halving its range, which needs no normal equations.
        let (mut best, mut range) = ([10.0, 2.0], [10.0, 2.0]);
        for _ in 0..60 {
            let near = (0..25).map(|k| [0, 1].map(|j| best[j] + 0.5 * range[j] * f64::from([k % 5, k / 5][j] - 2)));
            let least = near.min_by(|a, b| left(a[0], a[1]).total_cmp(&left(b[0], b[1]))).unwrap();
            (best, range) = (least, range.map(|range| 0.7 * range));
        }
        let least = left(best[0], best[1]);
        assert!(best[0] > 0.0 && best[1] > 0.0 && (own / least - 1.0).abs() < 1e-9, "{best:?}: {own} {least}");
    }
}
