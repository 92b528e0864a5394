//! Linear equations (1 − d A) x = b, by elimination with exchange of rows.

/// The triangles of 1 − d A.
pub struct Factors {
    rows: Vec<Vec<f64>>,
    order: Vec<usize>,
}

impl Factors {
    /// Of A by its columns.
    pub fn new(columns: &[Vec<f64>], d: f64) -> Self {
        let count = columns.len();
        let one = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
        let mut rows: Vec<Vec<f64>> = (0..count)
            .map(|i| columns.iter().enumerate().map(|(j, column)| one(i, j) - d * column[i]).collect())
            .collect();
        let mut order: Vec<usize> = (0..count).collect();
        for k in 0..count {
            let best = (k..count).fold(k, |best, i| if rows[i][k].abs() > rows[best][k].abs() { i } else { best });
            rows.swap(k, best);
            order.swap(k, best);
            let lead = rows[k].clone();
            for row in &mut rows[k + 1..] {
                let factor = row[k] / lead[k];
                row[k] = factor;
                row[k + 1..].iter_mut().zip(&lead[k + 1..]).for_each(|(own, lead)| *own -= factor * lead);
            }
        }
        Self { rows, order }
    }

    /// x.
    pub fn solve(&self, right: Vec<f64>) -> Vec<f64> {
        let mut x: Vec<f64> = self.order.iter().map(|&row| right[row]).collect();
        for (i, row) in self.rows.iter().enumerate() {
            x[i] -= (0..i).fold(0.0, |sum, j| sum + row[j] * x[j]);
        }
        for (i, row) in self.rows.iter().enumerate().rev() {
            let rest = (i + 1..row.len()).fold(x[i], |rest, j| rest - row[j] * x[j]);
            x[i] = rest / row[i];
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_are_solved() {
        let columns = [vec![1.0, 2.0, -3.0], vec![4.0, 0.5, 1.0], vec![-2.0, 7.0, 0.1]];
        let (d, right) = (0.7, vec![1.0, -2.0, 5.0]);
        let x = Factors::new(&columns, d).solve(right.clone());
        for (i, right) in right.iter().enumerate() {
            let left = x[i] - d * columns.iter().zip(&x).map(|(column, x)| column[i] * x).sum::<f64>();
            assert!((left - right).abs() < 1e-13, "{left} and {right}");
        }
    }
}
