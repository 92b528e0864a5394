//! Global search by differential evolution (R. Storn, K. Price, "Differential evolution – a simple and efficient
//! heuristic for global optimization over continuous spaces", Journal of Global Optimization 11, 1997), with the
//! mutation "current to p-best" of J. Zhang, A. C. Sanderson, "JADE: adaptive differential evolution with optional
//! external archive", IEEE Trans. Evolutionary Computation 13, 2009.

use super::search::Optimum;
use crate::chance::uniform;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

/// Fraction p of best members as targets of a mutation, and crossover probability CR.
const BEST: f64 = 0.2;
const CROSSOVER: f64 = 0.9;

/// Range of the mutation factor F.
const FACTORS: [f64; 2] = [0.4, 0.9];

/// Returns the members after this number of generations, the best first. `function` gets a point and the value to beat;
/// if it is not better, it may return any value that is not below that.
pub(crate) fn evolve(
    mut members: Vec<Optimum>,
    generations: usize,
    seed: u64,
    function: &mut dyn FnMut(&[f64], f64) -> f64,
) -> Vec<Optimum> {
    let mut random = Pcg64::seed_from_u64(seed);
    let count = members.len();
    let sort = |members: &mut Vec<Optimum>| members.sort_by(|a, b| a.value.total_cmp(&b.value));
    sort(&mut members);
    if count < 4 {
        return members;
    }
    let best = ((BEST * count as f64).ceil() as usize).max(1);
    for _ in 0..generations {
        for i in 0..count {
            let mut pick = |of: usize| (uniform(&mut random) * of as f64) as usize;
            let (p, mut a, mut b) = (pick(best), pick(count), pick(count));
            while a == i {
                a = pick(count);
            }
            while b == i || b == a {
                b = pick(count);
            }
            let dimension = members[i].x.len();
            let sure = pick(dimension.max(1));
            let factor = FACTORS[0] + (FACTORS[1] - FACTORS[0]) * uniform(&mut random);
            // v = x_i + F (x_p − x_i) + F (x_a − x_b), each coordinate with chance CR
            let trial: Vec<f64> = (0..dimension)
                .map(|j| {
                    let x = |k: usize| members[k].x[j];
                    let is_taken = j == sure || uniform(&mut random) < CROSSOVER;
                    if is_taken { x(i) + factor * (x(p) - x(i)) + factor * (x(a) - x(b)) } else { x(i) }
                })
                .collect();
            let value = function(&trial, members[i].value);
            if value < members[i].value {
                members[i] = Optimum { x: trial, value };
            }
        }
        sort(&mut members);
    }
    members
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_the_nearest_valley_for_one_of_the_deepest() {
        // Rastrigin's function, 0 at the origin, with a local minimum at every integer.
        let mut hills = |x: &[f64], _: f64| -> f64 {
            x.iter().map(|x| x * x + 10.0 * (1.0 - (2.0 * std::f64::consts::PI * x).cos())).sum()
        };
        let start = (0..24)
            .map(|k| vec![3.0 + 0.5 * f64::from(k % 5), -4.0 + 0.4 * f64::from(k / 3)])
            .map(|x| Optimum { value: hills(&x, f64::INFINITY), x });
        let start: Vec<Optimum> = start.collect();
        // The nearest minimum has a value of 25, those beside the deepest have 1 and 2.
        let found = (1..=20).map(|seed| evolve(start.clone(), 120, seed, &mut hills)[0].value);
        let found: Vec<f64> = found.collect();
        assert!(found.iter().all(|value| *value < 5.0), "{found:?}");
        assert!(found.iter().filter(|value| **value < 1.0).count() >= 10, "{found:?}");
    }

    #[test]
    fn the_same_seed_gives_the_same_members() {
        let mut bowl = |x: &[f64], _: f64| (x[0] - 1.0).powi(2) + (x[1] + 2.0).powi(2);
        let start: Vec<Optimum> = (0..8)
            .map(|k| vec![f64::from(k), 1.0 - f64::from(k)])
            .map(|x| Optimum { value: bowl(&x, 0.0), x })
            .collect();
        assert_eq!(evolve(start.clone(), 20, 7, &mut bowl), evolve(start, 20, 7, &mut bowl));
    }
}
