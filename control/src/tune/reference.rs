//! Comparison of a tuning with a long differential evolution of the same objective.

use super::edge::Edge;
use super::evolution::evolve;
use super::judged::{Judgement, Verdict};
use super::search::Optimum;
use super::tried::{Bars, Weighed};
use super::verdict::compare;
use super::work::{Finalist, Work};
use super::{HARD, Tuned};
use crate::case::{Case, Cost, Tuning};
use crate::chance::uniform;
use crate::error::Result;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

/// Number of members, and their scatter (natural logarithm of gains and frequencies).
const MEMBERS: usize = 20;
const SCATTER: f64 = 1.0;

/// Rounds, each with the machines that were worst for the best of the previous one, and generations between two looks
/// at the budget.
const ROUNDS: usize = 3;
const GENERATIONS: usize = 5;

/// Best verdict of a differential evolution over the gains and filters that a tuning chose, started independently of
/// it, on the same family, moves, limits and objective, with `times` the budget of a search. A design with no figure
/// worse than before is preferred, as the judgement shows. `None` if no design keeps the limits.
pub fn evolved(
    case: &Case,
    tuning: &Tuning,
    tuned: &Tuned,
    times: f64,
    stop: &dyn Fn() -> bool,
) -> Result<Option<(Verdict, Judgement)>> {
    let given = &tuned.before.design;
    let mut work = Work::new(case, &tuned.family, tuning, &tuned.moves, given, stop)?;
    let cost = tuning.cost.unwrap_or(Cost::Moves);
    let figures = tuned.before.at_worst();
    let bars = Some(Bars { figures: &figures, steep: HARD });
    let weighed = Weighed { cost, bars };
    let finalist = Finalist::at(&tuned.after.design, given.filters.len());
    let mut watch = tuned.before.watch(&work);
    let rank = |(verdict, judgement): &(Verdict, Judgement)| (*judgement == Judgement::Worse, verdict.objective);
    let mut best: Option<(Verdict, Judgement)> = None;
    for round in 0..ROUNDS {
        let mut random = Pcg64::seed_from_u64(97 + round as u64);
        let mut archive = Vec::new();
        work.grant(times / ROUNDS as f64);
        let mut of = |work: &mut Work, x: &[f64], bar: f64| {
            work.of_moves((&finalist, 0, x), &watch, &weighed, (Edge::Eased, bar), &mut archive)
        };
        let count = finalist.powers.len();
        let mut members: Vec<Optimum> = (0..MEMBERS)
            .map(|_| (0..count).map(|_| SCATTER * (2.0 * uniform(&mut random) - 1.0)).collect())
            .map(|x: Vec<f64>| Optimum { value: of(&mut work, &x, f64::INFINITY), x })
            .collect();
        let mut seed = 97 + round as u64;
        while !work.is_spent() && !stop() {
            members = evolve(members, GENERATIONS, seed, &mut |x, bar| of(&mut work, x, bar));
            seed += ROUNDS as u64;
        }
        let Some(design) = work.best_of(&archive, cost, &super::BALANCES[1], bars)? else { continue };
        let verdict = work.verdict(&design)?;
        watch.join(&verdict.watch(&work));
        let judgement = compare(&tuned.before, &verdict);
        let found = (verdict, judgement);
        if best.as_ref().is_none_or(|best| rank(&found) < rank(best)) {
            best = Some(found);
        }
    }
    Ok(best)
}
