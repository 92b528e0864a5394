//! Rows of a quantity, combined into blocks if they are many or share a rounding error.

use crate::fit::asked::problem::Problem;
use crate::fit::limits::BLOCKS;
use crate::log::Quantity;
use nalgebra::DMatrix;

/// Blocks of rows of one output of one run. A block of n equally accurate rows is their sum over √n, so that white
/// noise has the same variance as in a row.
pub(super) struct Series {
    /// Columns of the Jacobian that are not zero here: those of the run alone first.
    pub moved: Vec<usize>,
    /// Number of columns that belong to the run alone.
    pub own: usize,
    /// Number of columns between these and the residual that are not of the Jacobian.
    pub more: usize,
    /// Block by block the moved columns, those that are not of the Jacobian, and the residual.
    pub rows: Vec<f64>,
    /// Gain of each block for a unit slow noise, √n.
    pub gain: Vec<f64>,
    /// Times, s.
    pub time: Vec<f64>,
    /// The value of the model.
    pub value: Vec<f64>,
    /// Its speed if it is a position, otherwise its magnitude.
    pub speed: Vec<f64>,
}

impl Series {
    /// Number of columns, including the residual.
    pub fn wide(&self) -> usize {
        self.moved.len() + self.more + 1
    }

    /// Removes the columns that are not of the Jacobian.
    pub fn take_back(&mut self) {
        let (wide, more) = (self.wide(), self.more);
        let mut place = 0;
        self.rows.retain(|_| {
            let column = place % wide;
            place += 1;
            column + 1 + more < wide || column + 1 == wide
        });
        self.more = 0;
    }

    /// Inserts further columns before the residual.
    pub fn append(&mut self, columns: &[Vec<f64>]) {
        let wide = self.wide();
        let mut rows = Vec::with_capacity(self.rows.len() + columns.len() * self.time.len());
        for (place, row) in self.rows.chunks(wide).enumerate() {
            rows.extend_from_slice(&row[..wide - 1]);
            rows.extend(columns.iter().map(|column| column[place]));
            rows.push(row[wide - 1]);
        }
        self.rows = rows;
        self.more += columns.len();
    }
}

#[cfg(test)]
impl Series {
    /// Residuals of one log at intervals of 1 ms, without a Jacobian, at these values of the model.
    pub fn residuals(rows: Vec<f64>, value: Vec<f64>) -> Self {
        let time = (0..rows.len()).map(|k| 1e-3 * k as f64).collect();
        let (gain, speed) = (vec![1.0; rows.len()], value.clone());
        Self { moved: Vec::new(), own: 0, more: 0, rows, gain, time, value, speed }
    }
}

/// The rows of a quantity, in blocks that share a rounding error and are at most [`BLOCKS`] in number; and the greatest
/// weight of a value. Columns from `globals` on concern one run.
pub(super) fn series(
    problem: &Problem,
    quantity: Quantity,
    residuals: &[f64],
    jacobian: &DMatrix<f64>,
    globals: usize,
) -> (Vec<Series>, f64) {
    let mut all = Vec::new();
    let outputs = || {
        problem.runs.iter().enumerate().flat_map(|(index, run)| {
            let own = run.seen.iter().enumerate().filter(|(_, seen)| seen.quantity == quantity);
            own.map(move |(output, seen)| (index, output, seen))
        })
    };
    let most = outputs().flat_map(|(_, _, seen)| &seen.weights).copied().fold(0.0, f64::max);
    let total: f64 = outputs().map(|(index, output, _)| problem.runs[index].independent(output)).sum();
    let enough = (total / BLOCKS as f64).max(1.0) - 1e-6;
    for (index, output, seen) in outputs() {
        let run = &problem.runs[index];
        let n = run.time.len();
        let first = problem.first_row(index) + output * n;
        let rows: Vec<usize> = (0..n).filter(|&k| seen.weights[k] > 0.0).collect();
        let is_moved = |c: &usize| rows.iter().any(|&k| jacobian[(first + k, *c)] != 0.0);
        let mut moved: Vec<usize> = (globals..jacobian.ncols()).filter(is_moved).collect();
        let own = moved.len();
        moved.extend((0..globals).filter(is_moved));
        let wide = moved.len() + 1;
        let mut series = Series {
            moved,
            own,
            more: 0,
            rows: Vec::new(),
            gain: Vec::new(),
            time: Vec::new(),
            value: Vec::new(),
            speed: Vec::new(),
        };
        let mut block = vec![0.0; wide];
        let (mut information, mut time, mut value, mut count) = (0.0, 0.0, 0.0, 0.0);
        for (place, &k) in rows.iter().enumerate() {
            let w = seen.weights[k] / most;
            for (sum, &c) in block.iter_mut().zip(&series.moved) {
                *sum += w * jacobian[(first + k, c)];
            }
            block[wide - 1] += w * residuals[first + k];
            information += w * w;
            time += run.time[k];
            // r = w (ŷ − y)
            value += seen.values[k] + residuals[first + k] / seen.weights[k];
            count += 1.0;
            if information >= enough || place + 1 == rows.len() {
                let scale = 1.0 / f64::sqrt(information);
                series.rows.extend(block.iter().map(|v| v * scale));
                series.gain.push(f64::sqrt(information));
                series.time.push(time / count);
                series.value.push(value / count);
                block.fill(0.0);
                (information, time, value, count) = (0.0, 0.0, 0.0, 0.0);
            }
        }
        let blocks = series.time.len();
        series.speed = match quantity.is_position() && blocks > 1 {
            true => (0..blocks)
                .map(|k| {
                    let (before, after) = (k.saturating_sub(1), (k + 1).min(blocks - 1));
                    let past = series.time[after] - series.time[before];
                    ((series.value[after] - series.value[before]) / past).abs()
                })
                .collect(),
            false => series.value.iter().map(|value| value.abs()).collect(),
        };
        all.push(series);
    }
    (all, most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::problem::tests::case;

    /// The filter takes time in proportion to the blocks: a log of any length has at most 700 and one that is not full,
    /// each with the sum of its residuals over the root of their number.
    #[test]
    fn a_long_log_has_a_bounded_number_of_blocks() {
        let (case, plan) = case(false);
        let mut problem = Problem::new(&case, &plan).unwrap();
        let n = 20_000;
        let run = &mut problem.runs[0];
        run.time = (0..n).map(|k| 1e-3 * k as f64).collect();
        run.seen.truncate(1);
        let seen = &mut run.seen[0];
        (seen.weights, seen.values) = (vec![2.0; n], vec![0.0; n]);
        (seen.repeats, seen.alike) = (vec![1.0; n], vec![1.0; n]);
        let quantity = seen.quantity;
        let (all, weight) = series(&problem, quantity, &vec![1.0; n], &DMatrix::zeros(n, 0), 0);
        let series = &all[0];
        assert_eq!((all.len(), weight), (1, 2.0));
        assert!((600..=701).contains(&series.time.len()), "{}", series.time.len());
        let rows = n as f64 / series.time.len() as f64;
        assert!(series.gain[..600].iter().all(|gain| (gain * gain - rows).abs() < 1.0), "{:?}", series.gain[0]);
        assert!(series.rows.iter().zip(&series.gain).all(|(row, gain)| (row - gain).abs() < 1e-9));
    }
}
