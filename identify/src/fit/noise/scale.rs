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
use super::filter::{Numbers, innovations};
use super::series::Series;
use crate::fit::limits::{BLOCK_AT_REST, CLASSES_CLEAR, FEWEST_BLOCKS, LEAST_SIZE, SPEED_CLASSES};

/// The size of the noise in each block of each series; `None` if the residuals show no difference.
pub(super) fn scales(all: &[Series], slow: &[Slow]) -> Option<Vec<Vec<f64>>> {
    let mut squares: Vec<f64> = Vec::new();
    for series in all {
        let wide = series.wide();
        let residuals: Vec<f64> = series.rows.chunks(wide).map(|row| row[wide - 1]).collect();
        let take = |v: &[Numbers<1>], f: f64| squares.push(v[0].0[0] * v[0].0[0] / f);
        innovations(series, &residuals, 1, &[slow], take);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::normal;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    /// Noise of this deviation at each of `n` speeds, evenly from 0 to 1 m/s and in no order along the log.
    fn noise(seed: u64, n: usize, deviation: impl Fn(f64) -> f64) -> Series {
        let mut random = Pcg64::seed_from_u64(seed);
        let speeds: Vec<f64> = (0..n).map(|k| (k * 37 % n) as f64 / n as f64).collect();
        Series::residuals(speeds.iter().map(|v| deviation(*v) * normal(&mut random)).collect(), speeds)
    }

    fn found(series: Series) -> Option<Vec<f64>> {
        scales(&[series], &[]).map(|mut all| all.remove(0))
    }

    /// Noise that grows with speed has five classes, whose sizes are those of their noise.
    #[test]
    fn noise_that_grows_with_speed_has_its_size_in_each_class() {
        let series = noise(1, 1000, |v| 0.2 + 2.0 * v);
        let square = |from: f64, to: f64| ((0.2 + 2.0 * to).powi(3) - (0.2 + 2.0 * from).powi(3)) / (6.0 * (to - from));
        let speeds = series.speed.clone();
        let mut sizes = found(series).unwrap();
        // Classes have equal numbers of blocks that move; those at their edges are left out.
        for (v, size) in speeds.iter().zip(&sizes).filter(|(v, _)| (0.05..0.95).contains(&(5.0 * **v).fract())) {
            let class = (5.0 * v).floor() / 5.0;
            let own = (square(class, class + 0.2) / square(0.0, 1.0)).sqrt();
            // Two hundred blocks determine a size to 5 %.
            assert!((size / own - 1.0).abs() < 0.2, "{v}: {size} {own}");
        }
        sizes.sort_by(f64::total_cmp);
        sizes.dedup();
        assert_eq!(sizes.len(), 5);
    }

    /// Classes that are there by chance would widen intervals for nothing; noise 1.7 times as large in the faster half
    /// is seen in most logs of 300 blocks.
    #[test]
    fn even_noise_has_no_classes() {
        let seen = |logs: u64, faster: f64| {
            let deviation = |v: f64| if v > 0.5 { faster } else { 1.0 };
            (0..logs).filter(|seed| found(noise(*seed, 300, deviation)).is_some()).count()
        };
        let (by_chance, most) = (seen(400, 1.0), seen(100, 1.7));
        assert!(by_chance <= 4 && most >= 70, "{by_chance} of 400, {most} of 100");
    }

    /// Of few blocks nothing can be said.
    #[test]
    fn classes_have_a_dozen_blocks() {
        let steep = |v: f64| if v > 0.5 { 20.0 } else { 1.0 };
        assert!(found(noise(1, 50, steep)).is_none());
        assert!(found(noise(1, 80, steep)).is_some());
    }

    /// A log whose first half is exact, as one at rest before an encoder counts: its size there is not zero, which
    /// would decide for classes whatever the rest is.
    #[test]
    fn values_that_are_exact_have_a_hundredth_of_the_noise() {
        let sizes = found(noise(1, 300, |v| if v > 0.5 { 1.0 } else { 0.0 })).unwrap();
        let least = sizes.iter().copied().fold(f64::INFINITY, f64::min);
        assert!((least - 0.01).abs() < 1e-12, "{least}");
    }
}
