//! Runs of all logs at a point: residuals and their derivatives, side by side.

use super::problem::Problem;
use super::residuals::{Bounds, Differences, Residuals, Step};
use crate::fit::limits::ROWS_BESIDE;
use crate::machine::Machine;
use crate::solve::Bench;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::ops::Range;

impl Problem<'_> {
    /// Runs that are computed one after the other, and share the modes of machines that are made ready for them: those
    /// that follow each other and have up to [`ROWS_BESIDE`] residuals together. Groups are computed side by side.
    fn groups(&self) -> Vec<Range<usize>> {
        let mut groups: Vec<Range<usize>> = Vec::new();
        let mut rows = 0;
        for (index, run) in self.runs.iter().enumerate() {
            rows += run.rows();
            match groups.last_mut().filter(|_| rows <= ROWS_BESIDE) {
                Some(last) => last.end = index + 1,
                None => {
                    groups.push(index..index + 1);
                    rows = run.rows();
                }
            }
        }
        groups
    }

    /// What `one` makes of each run; `None` if it fails for one. It gets the bench of the run's group, the index of the
    /// run, and the count of simulations.
    fn each_run<T: Send>(
        &mut self,
        one: impl Fn(&Self, &mut Bench, usize, &mut u64) -> Option<T> + Sync,
    ) -> Option<Vec<T>> {
        let this = &*self;
        let group = |runs: Range<usize>| {
            let (mut bench, mut simulations) = (Bench::default(), 0);
            let found: Option<Vec<T>> = runs.map(|index| one(this, &mut bench, index, &mut simulations)).collect();
            (simulations, found)
        };
        let done: Vec<_> = this.groups().into_par_iter().map(group).collect();
        self.simulations += done.iter().map(|(simulations, _)| simulations).sum::<u64>();
        let found: Option<Vec<Vec<T>>> = done.into_iter().map(|(_, found)| found).collect();
        Some(found?.into_iter().flatten().collect())
    }

    /// Residuals of all runs.
    pub(super) fn residuals(&mut self, x: &[f64], r: &mut [f64]) -> bool {
        let stages = self.all_simulated(x);
        let shown = self.each_run(|this, bench, index, simulations| {
            let run = &this.runs[index];
            let mut own = vec![0.0; run.rows()];
            *simulations += 1;
            this.one(bench, index, &stages[run.part], x, &mut own).then_some(own)
        });
        let Some(shown) = shown else { return false };
        r.copy_from_slice(&shown.concat());
        true
    }

    /// Steps of the solver for one simulation of all runs; `None` if one cannot be simulated, or if they are more than
    /// `most`, as soon as that is known.
    pub(crate) fn steps(&mut self, x: &[f64], most: u64) -> Option<u64> {
        let (stages, mut bench) = (self.all_simulated(x), Bench::default());
        let mut residuals = Vec::new();
        for index in 0..self.runs.len() {
            let (rows, own) = (self.runs[index].rows(), self.runs[index].part);
            residuals.resize(rows, 0.0);
            self.simulations += 1;
            if !self.one(&mut bench, index, &stages[own], x, &mut residuals) || bench.steps() > most {
                return None;
            }
        }
        Some(bench.steps())
    }

    /// The columns of what only shifts the outputs of a run.
    fn shifts(&self, machine: &Machine, index: usize, jacobian: &mut DMatrix<f64>) {
        let run = &self.runs[index];
        let mut shift = vec![0.0; run.rows()];
        for (j, extra) in self.own_shifts(index, machine) {
            run.shift(machine, &extra, &mut shift);
            jacobian.column_mut(j).copy_from_slice(&shift);
        }
    }

    /// The exact part of the Jacobian; the remaining runs, each with the index of its first residual and the variables
    /// that affect it; and the residuals of all runs, if requested. `None` if a run cannot be computed.
    pub(super) fn blocks(
        &mut self,
        x: &[f64],
        mut residuals: Option<&mut [f64]>,
        bounds: &Bounds,
        how: &Differences,
    ) -> Option<(DMatrix<f64>, Vec<Left>)> {
        let stages = self.all_simulated(x);
        let is_exact = !matches!(how, Differences::Coarse(_));
        let asked = Asked { x, bounds, is_exact, shows: residuals.is_some() };
        let blocks =
            self.each_run(|this, bench, index, simulations| this.block((bench, &stages), index, &asked, simulations))?;
        let mut jacobian = DMatrix::zeros(self.rows(), x.len());
        let (mut first, mut left) = (0, Vec::new());
        for (index, block) in blocks.into_iter().enumerate() {
            let rows = block.jacobian.nrows();
            jacobian.rows_mut(first, rows).copy_from(&block.jacobian);
            if let Some(residuals) = &mut residuals {
                residuals[first..first + rows].copy_from_slice(&block.residuals);
            }
            left.extend(block.left.map(|columns| (index, first, columns)));
            first += rows;
        }
        self.differences = left.len();
        Some((jacobian, left))
    }

    /// The part of a run; `None` if it cannot be computed.
    fn block(
        &self,
        (bench, stages): (&mut Bench, &[Machine]),
        index: usize,
        asked: &Asked,
        simulations: &mut u64,
    ) -> Option<Block> {
        if self.is_stopped() {
            return None;
        }
        let Asked { x, bounds, is_exact, shows } = *asked;
        let (machine, rows) = (&stages[self.runs[index].part], self.runs[index].rows());
        let mut jacobian = DMatrix::zeros(rows, x.len());
        let mut residuals = vec![0.0; if shows { rows } else { 0 }];
        self.shifts(machine, index, &mut jacobian);
        let columns = self.movers(index, machine, bounds);
        let out = (&mut jacobian, shows.then_some(&mut residuals[..]));
        if is_exact && self.exact_block((bench, machine), index, (x, bounds), &columns, out) {
            *simulations += 1;
            return Some(Block { jacobian, residuals, left: None });
        }
        *simulations += u64::from(shows);
        let is_there = !shows || self.one(bench, index, machine, x, &mut residuals);
        is_there.then_some(Block { jacobian, residuals, left: Some(columns) })
    }

    /// The columns of `left`, runs with where their residuals begin and the variables that move them, by differences,
    /// side by side; false where a run cannot be computed.
    pub(super) fn by_differences(
        &mut self,
        left: &[Left],
        (x, r): (&[f64], &[f64]),
        bounds: &Bounds,
        how: &Differences,
        jacobian: &mut DMatrix<f64>,
    ) -> bool {
        let moves = |j: &usize| left.iter().any(|(.., columns)| columns.contains(j));
        let all: Vec<usize> = (0..x.len()).filter(moves).collect();
        let column = |&j: &usize| self.column(j, left, (x, r), &Step::new(x, bounds, j, how));
        let columns: Vec<_> = all.par_iter().map(column).collect();
        self.simulations += columns.iter().map(|(simulations, _)| simulations).sum::<u64>();
        for (j, (_, slopes)) in all.into_iter().zip(columns) {
            let Some(slopes) = slopes else { return false };
            for (first, own) in slopes {
                jacobian.view_mut((first, j), (own.len(), 1)).copy_from_slice(&own);
            }
        }
        true
    }

    /// The derivatives by variable `j` of those runs that it moves, each with the index of its first residual, and the
    /// number of simulations; `None` where a run cannot be computed.
    fn column(&self, j: usize, left: &[Left], (x, r): (&[f64], &[f64]), step: &Step) -> (u64, Option<Vec<Slopes>>) {
        let (mut simulations, mut moved) = (0, x.to_vec());
        let mut at = |to: f64| {
            moved[j] = to;
            // Runs of one machine share what it has made ready.
            let (stages, mut bench) = (self.all_simulated(&moved), Bench::default());
            let mut shown = Vec::new();
            for (index, ..) in left.iter().filter(|(.., columns)| columns.contains(&j)) {
                let run = &self.runs[*index];
                let mut own = vec![0.0; run.rows()];
                simulations += 1;
                if !self.one(&mut bench, *index, &stages[run.part], &moved, &mut own) {
                    return None;
                }
                shown.push(own);
            }
            Some(shown)
        };
        let both = at(step.first).and_then(|first| Some((first, step.second.map_or(Some(Vec::new()), at)?)));
        let slopes = both.map(|(first, second)| {
            let moved = left.iter().filter(|(.., columns)| columns.contains(&j)).map(|(_, first, _)| *first);
            let own = moved.zip(first).enumerate().map(|(run, (from, first))| {
                let second = second.get(run);
                let slope = |k: usize| step.slope(r[from + k], first[k], second.map_or(0.0, |second| second[k]));
                (from, (0..first.len()).map(slope).collect())
            });
            own.collect()
        });
        (simulations, slopes)
    }

    /// The residuals of a run; false where it cannot be computed, or the search is stopped.
    fn one(&self, bench: &mut Bench, index: usize, machine: &Machine, x: &[f64], out: &mut [f64]) -> bool {
        !self.is_stopped() && self.runs[index].residuals(bench, machine, &self.extras_of(index, x), out)
    }
}

/// The point at which blocks are computed, if exact derivatives count, and if residuals are wanted.
struct Asked<'x> {
    x: &'x [f64],
    bounds: &'x Bounds,
    is_exact: bool,
    shows: bool,
}

/// The rows of a run.
struct Block {
    jacobian: DMatrix<f64>,
    /// Empty if they are not wanted.
    residuals: Vec<f64>,
    /// The variables that move it, if it has no exact derivatives.
    left: Option<Vec<usize>>,
}

/// Where the residuals of a run begin, and their derivatives by a variable.
type Slopes = (usize, Vec<f64>);

/// A run, where its residuals begin, and the variables that move them.
pub(super) type Left = (usize, usize, Vec<usize>);

#[cfg(test)]
mod tests {
    use super::super::problem::tests::case;
    use super::*;
    use crate::case::Experiment;

    /// Bristles on a stiff belt take so many steps that a Jacobian by differences lasted minutes: a limit ends the
    /// count as soon as it is exceeded.
    #[test]
    fn steps_are_counted_up_to_a_limit() {
        let (mut case, plan) = case(false);
        case.experiments.push(Experiment { name: "again".into(), ..case.experiments[0].clone() });
        let mut problem = Problem::new(&case, &plan).unwrap();
        let at = problem.start();
        let all = problem.steps(&at, u64::MAX).unwrap();
        assert!(all > 0 && problem.simulations == 2);
        assert_eq!(problem.steps(&at, all), Some(all));
        assert_eq!(problem.steps(&at, all - 1), None);
        let before = problem.simulations;
        assert_eq!(problem.steps(&at, 0), None);
        assert_eq!(problem.simulations, before + 1);
    }

    /// Sixty logs of 102 values are in three groups.
    #[test]
    fn logs_beside_each_other_have_the_jacobian_of_each() {
        let (mut case, plan) = case(false);
        let one = case.experiments.remove(0);
        let mut problem_of = |logs: usize| {
            case.experiments = (0..logs).map(|k| Experiment { name: format!("log {k}"), ..one.clone() }).collect();
            let mut problem = Problem::new(&case, &plan).unwrap();
            let (x, bounds, mut residuals) = (problem.start(), problem.bounds(), vec![0.0; problem.rows()]);
            let jacobian = problem.linearised(&x, &mut residuals, &bounds, &Differences::Central).unwrap();
            let mut again = vec![0.0; problem.rows()];
            assert!(problem.evaluate(&x, &mut again) && problem.simulations == 2 * logs as u64);
            let apart = residuals.iter().zip(&again).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-9, "{apart:e}");
            (problem.groups().len(), jacobian, residuals)
        };
        let ((alone, of_one, residuals), (groups, all, of_all)) = (problem_of(1), problem_of(60));
        let rows = residuals.len();
        assert_eq!([alone, groups], [1, (60 * rows).div_ceil(ROWS_BESIDE / rows * rows)]);
        assert_eq!(groups, 3);
        for log in 0..60 {
            let own = all.view((log * rows, 0), (rows, 1));
            assert!((own - of_one.columns(0, 1)).amax() < 1e-9 * of_one.column(0).amax(), "{log}");
            let beside = residuals.iter().zip(&of_all[log * rows..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(beside < 1e-9, "{log}: {beside:e}");
        }
    }
}
