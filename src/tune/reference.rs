//! How far a tuning is from what a long differential evolution of the same objective finds: for tables, and for those
//! who doubt it.

use super::by_moves::{Bars, Edge, Weighed};
use super::evolution::evolve;
use super::search::Found;
use super::verdict::{Judgement, Verdict, compare};
use super::work::{Finalist, Work};
use super::{HARD, Tuned};
use crate::case::{Case, Cost, Tuning};
use crate::chance::uniform;
use crate::error::Result;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

/// Members, and how far they are scattered (natural logarithm of gains and frequencies).
const MEMBERS: usize = 20;
const SCATTER: f64 = 1.0;

/// Rounds, each with the axes that were worst for the best of the one before.
const ROUNDS: usize = 3;

/// The best verdict of a differential evolution over the gains and filters that a tuning chose, begun without it: on
/// the same family, moves, limits and objective, and with no figure worse than before where the tuning has none. `None`
/// where nothing keeps the limits.
pub fn evolved(
    case: &Case,
    tuning: &Tuning,
    tuned: &Tuned,
    generations: usize,
    stop: &dyn Fn() -> bool,
) -> Result<Option<Verdict>> {
    let given = &tuned.before.design;
    let mut work = Work::new(case, &tuned.family, tuning, &tuned.moves, given, stop)?;
    work.most = u64::MAX;
    let cost = tuning.cost.unwrap_or(Cost::Moves);
    let figures = tuned.before.at_worst();
    let is_worse = compare(&tuned.before, &tuned.after) == Judgement::Worse;
    let bars = (!is_worse).then_some(Bars { figures: &figures, steep: HARD });
    let weighed = Weighed { cost, bars };
    let finalist = Finalist::at(&tuned.after.design, given.filters.len());
    let mut watch = tuned.before.watch(&work);
    let mut best: Option<Verdict> = None;
    for round in 0..ROUNDS {
        let mut random = Pcg64::seed_from_u64(97 + round as u64);
        let mut archive = Vec::new();
        let mut value =
            |x: &[f64], bar: f64| work.of_moves((&finalist, 0, x), &watch, &weighed, (Edge::Eased, bar), &mut archive);
        let count = finalist.powers.len();
        let members = (0..MEMBERS).map(|_| {
            let x: Vec<f64> = (0..count).map(|_| SCATTER * (2.0 * uniform(&mut random) - 1.0)).collect();
            Found { value: value(&x, f64::INFINITY), x }
        });
        let members = members.collect();
        evolve(members, generations, 97 + round as u64, &mut value);
        let Some(design) = work.best_of(&archive, cost, &super::BALANCES[1], bars)? else { continue };
        let verdict = work.verdict(&design)?;
        watch.join(&verdict.watch(&work));
        let is_allowed = bars.is_none() || compare(&tuned.before, &verdict) != Judgement::Worse;
        if is_allowed && best.as_ref().is_none_or(|best| verdict.objective < best.objective) {
            best = Some(verdict);
        }
    }
    Ok(best)
}
