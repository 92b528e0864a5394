//! Newton's method for the forces of a step: (I − f′ W) δ = f(v) − f.

use super::bristles::Bristles;
use super::field::Field;
use super::linear::Set;
use super::radau::{Lane, NODES, POINTS};

/// The parted matrix of Newton's method, and the length of the step that it is of.
#[derive(Clone, Default)]
pub(super) struct Newton {
    matrix: Vec<f64>,
    order: Vec<usize>,
    /// The mode and step length that it belongs to.
    pub(super) of: Option<(u64, f64)>,
    /// True if steps of that length need it.
    pub(super) wanted: bool,
}

impl Newton {
    /// Makes I − f′ W ready where the arguments are.
    pub(super) fn prepare(&mut self, field: &Field, number: u64, set: &Set, arguments: &[Lane], bristles: &Bristles) {
        let sources = field.sources.len();
        let size = sources * NODES;
        self.matrix.clear();
        self.matrix.resize(size * size, 0.0);
        for (number, source) in field.sources.iter().enumerate() {
            let matrix = &mut self.matrix;
            source.slopes(&field.model, set.h, arguments, bristles, &mut |argument, slopes| {
                for other in 0..sources {
                    let weights = set.weights(argument, other, sources);
                    for (i, slopes) in slopes.iter().enumerate() {
                        for (p, weight) in weights[1..POINTS].iter().enumerate() {
                            let change: f64 = slopes.iter().zip(weight).fold(0.0, |sum, (a, b)| sum + a * b);
                            matrix[(number * NODES + i) * size + other * NODES + p] -= change;
                        }
                    }
                }
            });
        }
        (0..size).for_each(|i| self.matrix[i * size + i] += 1.0);
        self.decompose(size);
        self.of = Some((number, set.h));
    }

    /// Parts the matrix in two triangles, with exchange of rows.
    fn decompose(&mut self, size: usize) {
        let m = &mut self.matrix;
        self.order.clear();
        for k in 0..size {
            let best =
                (k..size).fold(k, |best, i| if m[i * size + k].abs() > m[best * size + k].abs() { i } else { best });
            self.order.push(best);
            if best != k {
                (0..size).for_each(|j| m.swap(k * size + j, best * size + j));
            }
            let (above, below) = m.split_at_mut((k + 1) * size);
            let pivot = &above[k * size..];
            for row in below.chunks_mut(size) {
                let factor = row[k] / pivot[k];
                row[k] = factor;
                if factor != 0.0 {
                    row[k + 1..].iter_mut().zip(&pivot[k + 1..]).for_each(|(entry, pivot)| *entry -= factor * pivot);
                }
            }
        }
    }

    pub(super) fn solve(&self, change: &mut [Lane]) {
        let x = change.as_flattened_mut();
        let size = x.len();
        // Rows are exchanged whole, so all exchanges come first.
        for (k, &best) in self.order.iter().enumerate() {
            x.swap(k, best);
        }
        for i in 0..size {
            let row = &self.matrix[i * size..][..i];
            x[i] -= row.iter().zip(&x[..i]).fold(0.0, |sum, (entry, x)| sum + entry * x);
        }
        for i in (0..size).rev() {
            let row = &self.matrix[i * size..][..size];
            let rest = row[i + 1..].iter().zip(&x[i + 1..]).fold(0.0, |sum, (entry, x)| sum + entry * x);
            x[i] = (x[i] - rest) / row[i];
        }
    }
}
