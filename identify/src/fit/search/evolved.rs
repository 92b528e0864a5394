//! Evolution strategy around a kink, for costs whose derivatives make no progress.

use super::cmaes;
use super::point::{Point, Strategy, cost_of};
use super::rung::{Climb, Rung, Watch};
use crate::fit::asked::residuals::Residuals;
use crate::fit::limits::{BARREN, MOST_EVOLVED};
use nalgebra::DMatrix;

/// CMA-ES in coordinates in which the smooth part of the cost is a sphere in units of the standard error, at most this
/// number of times in a search.
pub(crate) struct Evolved {
    pub most: usize,
}

impl Rung for Evolved {
    fn strategy(&self) -> Strategy {
        Strategy::Evolution
    }

    fn applies(&self, at: &Point) -> bool {
        at.best.decrement > 1.0 && at.best.evolved < self.most
    }

    fn climb(&mut self, at: &mut Point, problem: &mut dyn Residuals, _: &mut Watch) -> Climb {
        if !evolve(at, problem) {
            return Climb::Passed;
        }
        at.best.evolved += 1;
        Climb::Lowered
    }
}

/// Searches around the point; true if that lowered the cost by more than rounding.
fn evolve(at: &mut Point, problem: &mut dyn Residuals) -> bool {
    let (free, shows) = (at.free(), at.shows());
    let n = free.len();
    if n == 0 || n > MOST_EVOLVED {
        return false;
    }
    let r = at.model.r.select_columns(&free).qr().unpack_r();
    let Some(unit) = r.solve_upper_triangular(&DMatrix::identity(n, n)) else { return false };
    let unit = unit * at.deviation;
    let (best, bounds, huber) = (&mut at.best, at.bounds, at.options.huber);
    let before = best.cost;
    let centre = best.x.clone();
    let sigma = best.decrement.clamp(0.3, 10.0) / (n as f64).sqrt();
    let mut trial = vec![0.0; best.residuals.len()];
    cmaes::search(n, sigma, BARREN, &mut |point| {
        let step = &unit * point;
        let mut x = centre.clone();
        for (i, &j) in free.iter().enumerate() {
            x[j] = (x[j] + step[i]).clamp(bounds.low[j], bounds.high[j]);
        }
        best.evaluations += 1;
        let good = problem.evaluate(&x, &mut trial);
        let cost = if good { cost_of(&trial, huber) } else { f64::INFINITY };
        let is_better = cost < best.cost;
        let is_fruitful = is_better && best.cost - cost > shows;
        if is_better {
            best.cost = cost;
            best.x = x;
            best.residuals.copy_from_slice(&trial);
        }
        (cost, is_fruitful)
    });
    best.cost < before * (1.0 - 1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::residuals::{Bounds, Differences};
    use crate::fit::search::point::Options;
    use crate::solve::Flow;

    /// A bowl of so many variables.
    struct Bowl(usize);

    impl Residuals for Bowl {
        fn rows(&self) -> usize {
            2 * self.0
        }

        fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
            r.fill(1.0);
            r[..self.0].copy_from_slice(x);
            true
        }
    }

    /// An evolution takes up to 60 points for each variable, and 60 more: those of 16 variables are a thousand.
    #[test]
    fn many_variables_do_not_evolve() {
        let evolved = |n: usize| {
            let (bounds, options) = (Bounds::none(n), Options::default());
            let mut at = Point::new(&mut Bowl(n), &vec![3.0; n], &bounds, &options).unwrap();
            assert!(at.linearise(&mut Bowl(n), &Differences::Central, None));
            let end = Evolved { most: 1 }.climb(&mut at, &mut Bowl(n), &mut |_, _| Flow::Continue);
            (end, at.best.evaluations - 1)
        };
        let (end, points) = evolved(16);
        assert!(end == Climb::Lowered && (100..=1020).contains(&points), "{end:?} {points}");
        assert_eq!(evolved(17), (Climb::Passed, 0));
    }
}
