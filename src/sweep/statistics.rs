//! Statistics of a column of many runs: shares, histogram, and which parameters it depends on.

use crate::chance::quantile;

/// How the values of one column are spread; those that are NaN apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Values that are numbers.
    pub count: usize,
    /// Values that are not: runs that failed, and runs without this figure.
    pub missing: usize,
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation.
    pub deviation: f64,
    /// Least, 5 %, 50 %, 95 % and greatest.
    pub quantiles: [f64; 5],
    /// Ends of the histogram's bins: one more than there are counts.
    pub edges: Vec<f64>,
    /// Values in each bin.
    pub counts: Vec<usize>,
}

/// Shares of [`Spread::quantiles`].
pub const SHARES: [f64; 5] = [0.0, 0.05, 0.5, 0.95, 1.0];

/// Most bins of a histogram.
const BINS: f64 = 60.0;

impl Spread {
    /// That of these values; none where there is no number among them.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let (count, missing) = (sorted.len(), values.len() - sorted.len());
        let (first, last) = (*sorted.first()?, *sorted.last()?);
        let mean = sorted.iter().sum::<f64>() / count as f64;
        let squares: f64 = sorted.iter().map(|value| (value - mean) * (value - mean)).sum();
        let deviation = if count > 1 { (squares / (count as f64 - 1.0)).sqrt() } else { 0.0 };
        let bins = if first == last { 1.0 } else { (count as f64).sqrt().clamp(1.0, BINS).floor() };
        let edges: Vec<f64> = (0..=bins as usize).map(|k| first + (last - first) * k as f64 / bins).collect();
        let below = |edge: f64| sorted.partition_point(|value| *value < edge);
        let mut counts: Vec<usize> = edges.windows(2).map(|pair| below(pair[1]) - below(pair[0])).collect();
        // The last bin has both of its ends.
        if let Some(counted) = counts.last_mut() {
            *counted += count - below(last);
        }
        Some(Self {
            count,
            missing,
            mean,
            deviation,
            quantiles: SHARES.map(|share| quantile(&sorted, share)),
            edges,
            counts,
        })
    }
}

/// Spearman's rank correlation of the pairs that are both numbers; 0 where one of them does not vary.
pub fn rank_correlation(x: &[f64], y: &[f64]) -> f64 {
    let pairs: Vec<(f64, f64)> =
        x.iter().copied().zip(y.iter().copied()).filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    let (x, y) = (ranks(pairs.iter().map(|pair| pair.0)), ranks(pairs.iter().map(|pair| pair.1)));
    let middle = (pairs.len() as f64 - 1.0) / 2.0;
    let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - middle) * (b - middle)).sum::<f64>();
    let size = (sum(&x, &x) * sum(&y, &y)).sqrt();
    if size > 0.0 { sum(&x, &y) / size } else { 0.0 }
}

/// The place of each value among all of them; equal ones share the mean of their places.
fn ranks(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let values: Vec<f64> = values.collect();
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut begin = 0;
    for equal in order.chunk_by(|a, b| values[*a] == values[*b]) {
        let middle = begin as f64 + (equal.len() as f64 - 1.0) / 2.0;
        equal.iter().for_each(|place| ranks[*place] = middle);
        begin += equal.len();
    }
    ranks
}
