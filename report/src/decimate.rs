//! Fewer points for the same picture: the least and the greatest of every bucket stay, so no peak is lost.

/// At most `n` points (at least 4) of a curve, among them its first, its last, and each bucket's extremes.
///
/// Buckets hold equal numbers of samples. Both results have the same length, in the order of the input.
/// Samples whose y is not a number are passed over, unless a whole bucket has no other: then one stays,
/// so that a gap remains a gap.
///
/// ```
/// let x: Vec<f64> = (0..10_000).map(f64::from).collect();
/// let y: Vec<f64> = x.iter().map(|&x| if x == 7777.0 { 1.0 } else { 0.0 }).collect();
/// let (xs, ys) = taut_report::decimate(&x, &y, 200);
/// assert!(ys.len() <= 200 && ys.contains(&1.0));
/// ```
pub fn decimate(x: &[f64], y: &[f64], n: usize) -> (Vec<f64>, Vec<f64>) {
    let len = x.len().min(y.len());
    if len <= n.max(4) {
        return (x[..len].to_vec(), y[..len].to_vec());
    }
    // First and last, and two points from each bucket between.
    let buckets = (n.max(4) - 2) / 2;
    let inner = len - 2;
    let mut keep = vec![0];
    for b in 0..buckets {
        let range = 1 + inner * b / buckets..1 + inner * (b + 1) / buckets;
        let mut bucket = Bucket::default();
        range.for_each(|i| bucket.add(i, y[i]));
        keep.extend(bucket.indices());
    }
    keep.push(len - 1);
    (keep.iter().map(|&i| x[i]).collect(), keep.iter().map(|&i| y[i]).collect())
}

/// Least and greatest of a run of samples.
#[derive(Debug, Clone, Copy, Default)]
struct Bucket {
    least: Option<(usize, f64)>,
    greatest: Option<(usize, f64)>,
    gap: Option<usize>,
}

impl Bucket {
    fn add(&mut self, i: usize, y: f64) {
        if y.is_nan() {
            self.gap = self.gap.or(Some(i));
            return;
        }
        if self.least.is_none_or(|(_, least)| y < least) {
            self.least = Some((i, y));
        }
        if self.greatest.is_none_or(|(_, greatest)| y > greatest) {
            self.greatest = Some((i, y));
        }
    }

    /// One or two indices, in order.
    fn indices(&self) -> impl Iterator<Item = usize> {
        let (a, b) = match (self.least, self.greatest) {
            (Some((a, _)), Some((b, _))) => (Some(a.min(b)), (a != b).then_some(a.max(b))),
            _ => (self.gap, None),
        };
        a.into_iter().chain(b)
    }
}

/// Decimates a stream of unknown length in bounded memory.
///
/// It keeps each bucket's least and greatest sample; whenever there are too many buckets, neighbours
/// are joined and buckets twice as long begin. At any moment it holds between a half and all of the
/// points it was allowed.
#[derive(Debug, Clone)]
pub struct Decimator {
    /// Every sample, while there are few.
    whole: Option<Whole>,
    limit: usize,
    /// Samples per bucket.
    width: usize,
    seen: usize,
    first: Option<(f64, f64)>,
    last: Option<(f64, f64)>,
    buckets: Vec<Extremes>,
    open: Extremes,
    filled: usize,
}

/// Samples as they came, and how many there may be.
#[derive(Debug, Clone)]
struct Whole {
    most: usize,
    x: Vec<f64>,
    y: Vec<f64>,
}

/// A bucket that remembers the points themselves: (number, x, y).
#[derive(Debug, Clone, Copy, Default)]
struct Extremes {
    least: Option<(usize, f64, f64)>,
    greatest: Option<(usize, f64, f64)>,
    gap: Option<(usize, f64, f64)>,
}

impl Extremes {
    fn add(&mut self, point: (usize, f64, f64)) {
        if point.2.is_nan() {
            self.gap = self.gap.or(Some(point));
            return;
        }
        if self.least.is_none_or(|p| point.2 < p.2) {
            self.least = Some(point);
        }
        if self.greatest.is_none_or(|p| point.2 > p.2) {
            self.greatest = Some(point);
        }
    }

    fn join(&mut self, other: &Extremes) {
        [other.least, other.greatest, other.gap].into_iter().flatten().for_each(|p| self.add(p));
    }
}

impl Decimator {
    /// A decimator that gives at most `n` points (at least 8).
    pub fn new(n: usize) -> Self {
        Self {
            whole: None,
            limit: (n.max(8) - 2) / 2,
            width: 1,
            seen: 0,
            first: None,
            last: None,
            buckets: Vec::new(),
            open: Extremes::default(),
            filled: 0,
        }
    }

    /// Keeps every sample as long as there are no more than `most`: evenly spaced ones are smaller on a page than the
    /// uneven rest of a thinned curve, and finer.
    pub fn whole_up_to(mut self, most: usize) -> Self {
        self.whole = Some(Whole { most, x: Vec::new(), y: Vec::new() });
        self
    }

    /// The next samples.
    pub fn push(&mut self, x: &[f64], y: &[f64]) {
        let coming = x.len().min(y.len());
        match self.whole.take() {
            Some(mut whole) if whole.x.len() + coming <= whole.most => {
                whole.x.extend_from_slice(&x[..coming]);
                whole.y.extend_from_slice(&y[..coming]);
                self.whole = Some(whole);
            }
            Some(whole) => {
                self.thin(&whole.x, &whole.y);
                self.thin(x, y);
            }
            None => self.thin(x, y),
        }
    }

    fn thin(&mut self, x: &[f64], y: &[f64]) {
        for (&x, &y) in x.iter().zip(y) {
            self.first.get_or_insert((x, y));
            self.last = Some((x, y));
            self.open.add((self.seen, x, y));
            self.seen += 1;
            self.filled += 1;
            if self.filled == self.width {
                self.buckets.push(std::mem::take(&mut self.open));
                self.filled = 0;
            }
            // The open bucket counts as one.
            if self.buckets.len() >= self.limit {
                self.halve();
            }
        }
    }

    fn halve(&mut self) {
        // An odd bucket at the end is half of the next: it opens again.
        let odd = (self.buckets.len() % 2 == 1).then(|| self.buckets.pop()).flatten();
        let joined = self.buckets.chunks(2).map(|pair| {
            let mut sum = pair[0];
            sum.join(&pair[1]);
            sum
        });
        self.buckets = joined.collect();
        if let Some(mut odd) = odd {
            odd.join(&self.open);
            self.open = odd;
            self.filled += self.width;
        }
        self.width *= 2;
    }

    /// How many samples came in.
    pub fn seen(&self) -> usize {
        self.whole.as_ref().map_or(self.seen, |whole| whole.x.len())
    }

    /// The points so far: all, or first, last, and every bucket's extremes.
    pub fn points(&self) -> (Vec<f64>, Vec<f64>) {
        if let Some(whole) = &self.whole {
            return (whole.x.clone(), whole.y.clone());
        }
        let mut points: Vec<(usize, f64, f64)> = Vec::with_capacity(2 * self.buckets.len() + 4);
        points.extend(self.first.map(|(x, y)| (0, x, y)));
        for bucket in self.buckets.iter().chain([&self.open]) {
            match (bucket.least, bucket.greatest) {
                (Some(a), Some(b)) => points.extend(if a.0 <= b.0 { [a, b] } else { [b, a] }),
                _ => points.extend(bucket.gap),
            }
        }
        points.extend(self.last.map(|(x, y)| (self.seen - 1, x, y)));
        points.dedup_by_key(|p| p.0);
        points.into_iter().map(|(_, x, y)| (x, y)).unzip()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn extremes(y: &[f64]) -> (f64, f64) {
        y.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &v| (lo.min(v), hi.max(v)))
    }

    proptest! {
        #[test]
        fn peaks_stay(y in prop::collection::vec(prop_oneof![9 => -1e3..1e3f64, 1 => Just(f64::NAN)], 0..600),
                      n in 8usize..80, block in 1usize..50) {
            let x: Vec<f64> = (0..y.len()).map(|i| i as f64).collect();
            let (xs, ys) = decimate(&x, &y, n);
            let mut stream = Decimator::new(n);
            x.chunks(block).zip(y.chunks(block)).for_each(|(x, y)| stream.push(x, y));
            let (xt, yt) = stream.points();
            let mut patient = Decimator::new(n).whole_up_to(200);
            x.chunks(block).zip(y.chunks(block)).for_each(|(x, y)| patient.push(x, y));
            let bits = |v: &[f64]| -> Vec<u64> { v.iter().map(|v| v.to_bits()).collect() };
            let (xw, yw) = patient.points();
            let whole = if y.len() <= 200 { (&x, &y) } else { (&xt, &yt) };
            prop_assert_eq!((bits(&xw), bits(&yw)), (bits(whole.0), bits(whole.1)));
            prop_assert_eq!(patient.seen(), y.len());
            for (xs, ys) in [(&xs, &ys), (&xt, &yt)] {
                prop_assert!(xs.len() <= n && xs.len() == ys.len());
                prop_assert_eq!(extremes(ys), extremes(&y));
                prop_assert!(xs.windows(2).all(|w| w[0] < w[1]));
                prop_assert_eq!(xs.first(), x.first());
                prop_assert_eq!(xs.last(), x.last());
                prop_assert!(xs.iter().zip(ys).all(|(&x, v)| v.to_bits() == y[x as usize].to_bits()));
            }
        }
    }
}
