//! Tests whether the noise varies with speed or along the logs.
//!
//! The innovations v of white noise beside slow ones are independent, of one variance. Their blocks are put into K
//! classes, of speed or of time; with the mean squares s_k² of n_k each and s² of all n, the classes raise the
//! logarithm of the likelihood by
//!
//! ```text
//! Σ n_k ln(s/s_k) − (K − 1)/2 ln n           (G. Schwarz 1978)
//! ```
//!
//! If that is enough, D Σ D with the s_k/s on the diagonal of D is a second covariance of the noise beside Σ. The
//! larger of both variances counts: errors of a wrong model are also small at rest and large in motion, which does not
//! improve the accuracy of a parameter that is determined at rest.

use super::Slow;
use super::filter::innovations;
use super::series::Series;
use crate::fit::limits::{BLOCK_AT_REST, CLASSES_CLEAR, FEWEST_BLOCKS, LEAST_SIZE, SPEED_CLASSES};

/// The size of the noise in each block of each series; `None` if the residuals show no difference.
pub(super) fn scales(all: &[Series], slow: &[Slow]) -> Option<Vec<Vec<f64>>> {
    let mut squares: Vec<f64> = Vec::new();
    for series in all {
        let wide = series.wide();
        let residuals: Vec<f64> = series.rows.chunks(wide).map(|row| row[wide - 1]).collect();
        innovations(series, &residuals, 1, slow, |v, f| squares.push(v[0] * v[0] / f));
    }
    let n = squares.len() as f64;
    let mean = squares.iter().sum::<f64>() / n;
    let raised = |classes: &[usize]| {
        let (mut sums, mut counts) = ([0.0; SPEED_CLASSES], [0.0; SPEED_CLASSES]);
        for (&class, square) in classes.iter().zip(&squares) {
            sums[class] += square;
            counts[class] += 1.0;
        }
        // Values that are exact at rest get a minimum noise.
        sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum = sum.max(LEAST_SIZE * LEAST_SIZE * mean * count));
        let there = (0..SPEED_CLASSES).filter(|&k| counts[k] > 0.0);
        let gain: f64 = there.clone().map(|k| 0.5 * counts[k] * (mean * counts[k] / sums[k]).ln()).sum();
        let sizes: [f64; SPEED_CLASSES] = std::array::from_fn(|k| (sums[k] / (counts[k] * mean)).sqrt());
        (gain - 0.5 * (there.count() as f64 - 1.0) * n.ln(), sizes)
    };
    let best = [by_speed(all), by_time(all)]
        .into_iter()
        .flatten()
        .map(|classes| {
            let (gain, sizes) = raised(&classes);
            (gain, classes, sizes)
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    let (gain, classes, sizes) = best;
    if gain.is_nan() || gain < CLASSES_CLEAR {
        return None;
    }
    let mut sizes = classes.into_iter().map(|class| sizes[class]);
    Some(all.iter().map(|series| sizes.by_ref().take(series.time.len()).collect()).collect())
}

/// Classes of speed: blocks at rest, and the others in equal numbers; `None` if a class has too few blocks.
fn by_speed(all: &[Series]) -> Option<Vec<usize>> {
    let speeds: Vec<f64> = all.iter().flat_map(|series| &series.speed).copied().collect();
    let rest = BLOCK_AT_REST * speeds.iter().copied().fold(0.0, f64::max);
    let mut moving: Vec<f64> = speeds.iter().copied().filter(|v| *v > rest).collect();
    let resting = speeds.len() - moving.len();
    if moving.len() < (SPEED_CLASSES - 1) * FEWEST_BLOCKS {
        return None;
    }
    moving.sort_by(f64::total_cmp);
    let edges: Vec<f64> = (1..SPEED_CLASSES - 1).map(|k| moving[k * moving.len() / (SPEED_CLASSES - 1)]).collect();
    let class = |v: f64| match v > rest || resting < FEWEST_BLOCKS {
        true => 1 + edges.iter().filter(|edge| v >= **edge).count(),
        false => 0,
    };
    Some(speeds.into_iter().map(class).collect())
}

/// Classes of time: parts of one log, or logs.
fn by_time(all: &[Series]) -> Option<Vec<usize>> {
    let blocks: usize = all.iter().map(|series| series.time.len()).sum();
    let parts = (SPEED_CLASSES / all.len()).max(1);
    if blocks < SPEED_CLASSES * FEWEST_BLOCKS {
        return None;
    }
    let mut classes = Vec::with_capacity(blocks);
    for (index, series) in all.iter().enumerate() {
        let n = series.time.len();
        classes.extend((0..n).map(|k| match all.len() > SPEED_CLASSES {
            true => index * SPEED_CLASSES / all.len(),
            false => index * parts + k * parts / n,
        }));
    }
    Some(classes)
}
