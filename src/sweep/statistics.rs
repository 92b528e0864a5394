//! Statistics of a column of many runs: shares, histogram, and which parameters it depends on.

use crate::chance::quantile;

/// How the values of one column are spread; those that are NaN apart.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
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
    pub fn new(values: &[f64]) -> Option<Self> {
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

/// A column with the rank of each value, for Spearman's correlations with other columns of the same runs; sorted only
/// once.
#[derive(Debug, Clone)]
pub struct Ranked {
    /// Places of the values that are numbers, by value; equal ones have the same second number.
    order: Vec<(usize, usize)>,
    /// By place, whether there is a number, and its rank less the mean of all ranks; 0 where there is none.
    is_number: Vec<bool>,
    ranks: Vec<f64>,
}

impl Ranked {
    /// Ranks these values.
    pub fn new(values: &[f64]) -> Self {
        let mut sorted: Vec<usize> = (0..values.len()).filter(|place| values[*place].is_finite()).collect();
        sorted.sort_unstable_by(|a, b| values[*a].total_cmp(&values[*b]));
        let mut order: Vec<(usize, usize)> = Vec::with_capacity(sorted.len());
        for place in sorted {
            let class = match order.last() {
                Some(&(before, class)) if values[before] == values[place] => class,
                Some(&(_, class)) => class + 1,
                None => 0,
            };
            order.push((place, class));
        }
        let ranks = centred(&order, values.len());
        Self { order, is_number: values.iter().map(|value| value.is_finite()).collect(), ranks }
    }

    /// Spearman's rank correlation of the pairs that are both numbers; 0 where one of them does not vary.
    ///
    /// # Panics
    ///
    /// Where the columns are not equally long.
    pub fn correlation(&self, other: &Self) -> f64 {
        assert_eq!(self.ranks.len(), other.ranks.len(), "columns of the same runs are equally long");
        if self.is_number == other.is_number {
            return normed(&self.ranks, &other.ranks);
        }
        let among = |column: &Self, other: &Self| {
            let both = column.order.iter().copied().filter(|&(place, _)| other.is_number[place]);
            centred(&both.collect::<Vec<_>>(), column.ranks.len())
        };
        normed(&among(self, other), &among(other, self))
    }
}

/// Σ x y / √(Σ x² Σ y²); 0 where one of them does not vary.
fn normed(x: &[f64], y: &[f64]) -> f64 {
    let size = (dot(x, x) * dot(y, y)).sqrt();
    if size > 0.0 { dot(x, y) / size } else { 0.0 }
}

/// Σ x y of ranks: twice a rank is a whole number, so that the sum is exact in any order, and four are kept.
fn dot(x: &[f64], y: &[f64]) -> f64 {
    let ((x, x_rest), (y, y_rest)) = (x.as_chunks::<4>(), y.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (x, y) in x.iter().zip(y) {
        sums.iter_mut().zip(x).zip(y).for_each(|((sum, x), y)| *sum += x * y);
    }
    sums.iter().sum::<f64>() + x_rest.iter().zip(y_rest).map(|(x, y)| x * y).sum::<f64>()
}

/// By place, the rank of each among these less the mean of all ranks, equal ones sharing the mean of theirs; 0 at other
/// places.
fn centred(order: &[(usize, usize)], count: usize) -> Vec<f64> {
    let mean = (order.len() as f64 - 1.0) / 2.0;
    let mut ranks = vec![0.0; count];
    let mut begin = 0;
    for equal in order.chunk_by(|a, b| a.1 == b.1) {
        let middle = begin as f64 + (equal.len() as f64 - 1.0) / 2.0;
        equal.iter().for_each(|(place, _)| ranks[*place] = middle - mean);
        begin += equal.len();
    }
    ranks
}
