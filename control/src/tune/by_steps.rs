//! Search without runs: designs of a filter layout by their worst-case responses to steps of command and reference.
//!
//! What limits a loop, M_s and M_t, costs a thirtieth of a move on all watched machines. The designs between which
//! these limits leave a choice are therefore found first, by an evolution; moves then decide between them.

use super::evolution::evolve;
use super::gains::{rounded, searched, shaped};
use super::margins::Rough;
use super::search::{Optimum, minimise_below};
use super::work::{Finalist, STEEP, WITHIN, Work};
use crate::chance::uniform;
use crate::design::Design;
use crate::error::Result;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

/// Rounds of a search, each with the machine that exceeded a limit in the previous one.
const ROUNDS: usize = 5;

/// Edge of the first simplex, its evaluations, plus a number for each gain; half as many in later rounds.
const FIRST: f64 = 0.3;
const VALUES: usize = 40;
const MORE: usize = 24;

/// Number of layouts in which an evolution follows, its members and generations, and the scatter of the members about
/// the design of the simplex (natural logarithm of gains).
const WIDENED: usize = 2;
const MEMBERS: usize = 20;
const GENERATIONS: usize = 60;
const SCATTER: f64 = 0.7;

/// Seeds of the first scatter and of the first evolution.
const SCATTERED: u64 = 3;
const EVOLVED: u64 = 5;

/// Exponents λ of an evolution each.
const LEANS: [f64; 2] = [-0.3, 0.3];

/// Edge and evaluations of the simplex after an evolution.
const EDGE: f64 = 0.1;
const FINAL: usize = 150;

/// Size of a simplex at its end.
const ACCURACY: f64 = 1e-3;

/// Largest excess in ln of the response over the best of an evolution, and the number of such designs left to moves.
const CLOSE: f64 = 0.2;
const LEFT: usize = 16;

impl Work<'_> {
    /// Worst case on the set of ln(d^(1+λ) f^(1−λ)), with the responses d to a step of the command and f to one of the
    /// reference, and a penalty beyond the limits; at least `bar` if it is not below. The first alone could be
    /// optimised without a position gain.
    fn by_steps(&mut self, design: &Design, lean: f64, bar: f64) -> f64 {
        if (self.stop)() {
            return f64::INFINITY;
        }
        self.tried += 1;
        let Ok(feedback) = self.feedback(design) else { return f64::INFINITY };
        let (mut most, mut slow, mut value) = (0.0_f64, f64::NEG_INFINITY, f64::INFINITY);
        // The machines that joined last are the worst.
        for plant in self.on_set_plants() {
            let Rough { peaks, disturbance, following } = Rough::new(plant, &feedback);
            most = most.max(peaks.excess(self.tuning.sensitivity, self.tuning.complementary));
            slow = slow.max((1.0 + lean) * disturbance.ln() + (1.0 - lean) * following.ln());
            let beyond = (most / WITHIN - 1.0).max(0.0);
            value = if beyond > 0.5 { 1e3 + beyond.min(1e6) } else { slow + STEEP * beyond };
            if value >= bar {
                break;
            }
        }
        value
    }

    /// The best design from a start within the limits, by the simplex.
    pub(super) fn improved(&mut self, start: Design, own: usize) -> Result<Finalist> {
        let count = searched(&start, own);
        let (from, most) = (vec![0.0; count], VALUES + MORE * count);
        let powers = self.within_limits((&start, own), (&from, from.clone()), 0.0, FIRST, [most, most / 2])?;
        self.finalist(start, own, powers)
    }

    /// Powers at the end of the simplex from `powers`, repeated with machines that exceed a limit until none does, or
    /// drawn back towards those of `from`, which keep the limits. `most` are the evaluations of the first simplex and
    /// of further ones.
    fn within_limits(
        &mut self,
        (start, own): (&Design, usize),
        (from, mut powers): (&[f64], Vec<f64>),
        lean: f64,
        edge: f64,
        most: [usize; 2],
    ) -> Result<Vec<f64>> {
        for round in 0..ROUNDS {
            self.rounds += 1;
            let mut value = |x: &[f64], bar: f64| self.by_steps(&shaped(start, own, x), lean, bar);
            powers = minimise_below(&powers, edge, ACCURACY, most[round.min(1)], &mut value).x;
            if !self.passes(&rounded(&shaped(start, own, &powers)))? {
                return Ok(powers);
            }
        }
        self.pulled(start, own, from, &powers)
    }

    fn finalist(&mut self, start: Design, own: usize, powers: Vec<f64>) -> Result<Finalist> {
        let design = rounded(&shaped(&start, own, &powers));
        let value = self.on_set(&design).1.ln();
        Ok(Finalist { design, start, own, powers, others: Vec::new(), value })
    }

    /// These finalists, the best first, of which the first ones are replaced by what an evolution finds.
    pub(super) fn widened(&mut self, finalists: Vec<Finalist>) -> Result<Vec<Finalist>> {
        let one = |(rank, one)| if rank < WIDENED { self.evolved_finalist(one) } else { Ok(one) };
        finalists.into_iter().enumerate().map(one).collect()
    }

    /// The best design of a finalist's layout by an evolution for each λ; other good ones stay beside it.
    fn evolved_finalist(&mut self, mut best: Finalist) -> Result<Finalist> {
        let (start, own) = (best.start.clone(), best.own);
        for (number, lean) in LEANS.into_iter().enumerate() {
            let (powers, close) = self.evolved_by_steps((&start, own), &best.powers, lean, number as u64)?;
            best.others.extend(close);
            best.value = self.on_set(&best.design).1.ln();
            let found = self.finalist(start.clone(), own, powers)?;
            if found.value < best.value {
                best.others.push(best.powers);
                best = Finalist { others: best.others, ..found };
            } else {
                best.others.push(found.powers);
            }
        }
        Ok(best)
    }

    /// Powers of the best design by an evolution about one within the limits, and those of others close to it.
    fn evolved_by_steps(
        &mut self,
        (start, own): (&Design, usize),
        from: &[f64],
        lean: f64,
        number: u64,
    ) -> Result<(Vec<f64>, Vec<Vec<f64>>)> {
        let mut seen: Vec<Optimum> = Vec::new();
        let mut value = |x: &[f64], bar: f64| {
            let value = self.by_steps(&shaped(start, own, x), lean, bar);
            if value < bar {
                seen.push(Optimum { x: x.to_vec(), value });
            }
            value
        };
        let mut random = Pcg64::seed_from_u64(SCATTERED + number);
        let members = (0..MEMBERS).map(|member| {
            let scatter = if member == 0 { 0.0 } else { SCATTER };
            let x: Vec<f64> = from.iter().map(|x| x + scatter * (2.0 * uniform(&mut random) - 1.0)).collect();
            Optimum { value: value(&x, f64::INFINITY), x }
        });
        let members = evolve(members.collect(), GENERATIONS, EVOLVED + number, &mut value);
        let best = members.into_iter().next().map_or_else(|| from.to_vec(), |best| best.x);
        let powers = self.within_limits((start, own), (from, best), lean, EDGE, [FINAL; 2])?;
        let close = spread(&powers, seen);
        Ok((powers, close))
    }
}

/// The points nearly as good as the best that are farthest from each other and from `first`.
fn spread(first: &[f64], mut seen: Vec<Optimum>) -> Vec<Vec<f64>> {
    let least = seen.iter().map(|one| one.value).fold(f64::INFINITY, f64::min);
    seen.retain(|one| one.value <= least + CLOSE);
    let mut all = vec![first.to_vec()];
    while all.len() <= LEFT {
        let square = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let apart = |one: &Optimum| all.iter().map(|x| square(x, &one.x)).fold(f64::INFINITY, f64::min);
        let farthest = seen.iter().map(|one| (apart(one), one)).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, one)) = farthest.filter(|(apart, _)| *apart > 0.0) else { break };
        all.push(one.x.clone());
    }
    all.split_off(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_left_to_moves_are_close_in_value_and_far_apart() {
        let one = |x: f64, value: f64| Optimum { x: vec![x], value };
        let seen = vec![one(0.1, 1.0), one(1.0, 1.1), one(0.5, 1.15), one(9.0, 1.3), one(0.9, 1.05), one(0.0, 1.0)];
        // The one at 9 is worse by more than allowed, that at 0 is the first.
        assert_eq!(spread(&[0.0], seen), [[1.0], [0.5], [0.1], [0.9]]);
        let many = (0..100).map(|k| one(f64::from(k), 0.0)).collect();
        assert_eq!(spread(&[0.0], many).len(), LEFT);
        assert!(spread(&[0.0], Vec::new()).is_empty());
    }
}
