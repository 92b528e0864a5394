//! Search by moves, on the machines that are worst for its designs and at the samples of the controller; reported
//! results come from complete runs on all machines.

use super::edge::Edge;
use super::evolution::evolve;
use super::gains::{rounded, shaped};
use super::objective::{AtWorst, BALANCES, Balance, Glance, MoveFigures, Runner, objective};
use super::search::{Optimum, minimise_below};
use super::tried::{Bars, Tried, Weighed};
use super::watch::Watch;
use super::work::{Finalist, Work};
use crate::case::{Cost, Move};
use crate::chance::uniform;
use crate::control::SampledPath;
use crate::design::Design;
use crate::error::Result;
use crate::machine::Machine;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

/// Maximum number of evaluations of a simplex.
const MOVES: usize = 60;

/// Edge of the simplex.
const EDGE: f64 = 0.12;

/// Members of differential evolution, and its repetitions with further machines.
const MEMBERS: usize = 12;
const EVOLVED: u64 = 2;

/// A differential evolution: generations, scatter of the members about the best (natural logarithm of gains), its
/// treatment of limits, and its seed.
#[derive(Clone, Copy)]
pub(super) struct Spread {
    generations: usize,
    scatter: f64,
    edge: Edge,
    seed: u64,
}

/// The first one, and later ones if no other machine is worst for the result.
pub(super) const WIDE: Spread = Spread { generations: 12, scatter: 0.4, edge: Edge::Beyond(0.0), seed: 15 };
const NARROW: Spread = Spread { generations: 8, scatter: 0.3, edge: Edge::Eased, seed: 16 };

/// Excess over the limits allowed for the simplex, which moves along their boundary.
const SLACK: f64 = 0.05;

/// Samples of moves that a search of default effort may simulate, plus a fixed charge per evaluated design: a few
/// processor seconds.
const SAMPLES: u64 = 4_000_000;

/// Duration of a sample of a stepper, which needs the general solver, relative to that of other machines.
const OF_STEPPER: f64 = 10.0;

/// Maximum number of continuations with the machines that are worst for the result.
const POLISHED: usize = 8;

/// Relative margin of a figure from samples below its previous value, since a peak between samples may be higher by
/// that.
const BETWEEN: f64 = 2e-3;

/// Maximum number of designs checked for each balance.
const TRIES: usize = 20;

/// Weight of a machine on which the cart no longer settles, relative to that of an error.
const LOST: f64 = 0.2;

impl Work<'_> {
    /// Figures of all moves on one machine.
    pub fn looked(&self, runner: &mut Runner, design: &Design, machine: &Machine) -> Result<Vec<MoveFigures>> {
        let one = |(motion, path): (&Move, &SampledPath)| {
            self.spend(design, motion.until);
            runner.look(machine, motion, path)
        };
        self.moves.iter().zip(&self.paths).map(one).collect()
    }

    /// Figures of each move on all machines, from samples.
    pub fn glanced(&self, design: &Design) -> Result<Vec<Vec<MoveFigures>>> {
        let mut runner = Runner::new(&self.case.machine, design)?;
        let mut of_move = |k: usize| {
            let one = |axis: usize| Ok(self.glanced_at(&mut runner, design, (k, axis), |_| false)?.figures);
            (0..self.stages.len()).map(one).collect::<Result<Vec<_>>>()
        };
        (0..self.moves.len()).map(&mut of_move).collect()
    }

    /// Figures of the move of a number on the machine of a number, from samples.
    fn glanced_at(
        &self,
        runner: &mut Runner,
        design: &Design,
        (k, axis): (usize, usize),
        mut is_enough: impl FnMut(&MoveFigures) -> bool,
    ) -> Result<Glance> {
        let one = runner.glance(&self.stages[axis], &self.moves[k], &self.paths[k], &mut is_enough)?;
        self.spend(design, one.end);
        Ok(one)
    }

    /// Worst-case figures of a design on the watched machines, from samples, and ln J by the balance of the search.
    /// Stops as soon as ln J reaches `bar`, since neither further machines nor the rest of a run can reduce a worst-case
    /// figure.
    pub fn run(&self, design: &Design, watch: &Watch, weighed: &Weighed, bar: f64) -> (Vec<AtWorst>, f64) {
        let nothing = (Vec::new(), f64::INFINITY);
        let Ok(mut runner) = Runner::new(&self.case.machine, design) else { return nothing };
        let mut seen: Vec<Vec<(usize, Glance)>> = vec![Vec::new(); self.moves.len()];
        let mut worst: Vec<AtWorst> = self.least.borrow().iter().map(|&current| AtWorst::at_least(current)).collect();
        let most = watch.axes.iter().map(Vec::len).max().unwrap_or_default();
        let valued = |worst: &[AtWorst]| self.valued(weighed.cost, &BALANCES[1], worst, weighed.bars);
        let mut value = f64::INFINITY;
        for rank in 0..most {
            for k in 0..self.moves.len() {
                let Some(&axis) = watch.axes[k].get(rank) else { continue };
                let so_far = worst[k];
                // A run ends where its figures alone lose, if they count: which is known once others have been seen.
                let loses = |least: &MoveFigures| {
                    worst[k] = so_far.and(least);
                    valued(&worst) >= bar
                };
                let Ok(one) = self.glanced_at(&mut runner, design, (k, axis), loses) else { return nothing };
                worst[k] = so_far;
                seen[k].push((axis, one));
                if seen[k].len() <= watch.left_out && seen[k].len() < watch.axes[k].len() {
                    continue;
                }
                worst[k] = watch.worst(&seen[k]);
                value = valued(&worst);
                if value >= bar {
                    return (worst, value);
                }
            }
        }
        // A design that does not lose is judged by whole runs.
        for k in 0..self.moves.len() {
            for place in 0..seen[k].len() {
                let (axis, one) = seen[k][place];
                if one.is_whole {
                    continue;
                }
                let Ok(whole) = self.glanced_at(&mut runner, design, (k, axis), |_| false) else { return nothing };
                seen[k][place].1 = whole;
                worst[k] = watch.worst(&seen[k]);
                value = valued(&worst);
                if value >= bar {
                    return (worst, value);
                }
            }
        }
        for (least, worst) in self.least.borrow_mut().iter_mut().zip(&worst) {
            *least = if *least == 0.0 { worst.current } else { least.min(worst.current) };
        }
        (worst, value)
    }

    /// Searches by moves: with the simplex from the best design, then with differential evolution about the best, then
    /// again with the simplex as long as other machines are worst for the result. Returns all designs run that keep
    /// the limits on the set, and the watched machines.
    pub fn by_moves(&mut self, finalists: &[Finalist], weighed: &Weighed) -> Result<(Vec<Tried>, Watch)> {
        self.grant(1.0);
        let mut watch = Watch::default();
        let mut archive: Vec<Tried> = Vec::new();
        if let Some(first) = finalists.first() {
            self.watched_by(&first.design, &mut watch)?;
        }
        for (layout, finalist) in finalists.iter().enumerate() {
            if (self.stop)() && !archive.is_empty() {
                return Ok((archive, watch));
            }
            let (worst, _) = self.run(&finalist.design, &watch, weighed, f64::INFINITY);
            archive.push(Tried { design: finalist.design.clone(), worst, layout, powers: finalist.powers.clone() });
            for powers in &finalist.others {
                let best = archive.iter().map(|tried| self.worth(tried, weighed)).fold(f64::INFINITY, f64::min);
                self.of_moves((finalist, layout, powers), &watch, weighed, (Edge::Eased, best), &mut archive);
            }
        }
        self.renewed(&mut archive, &mut watch, weighed)?;
        self.onward(finalists, None, &watch, weighed, &mut archive)?;
        if let Some(&layout) = self.nearest(&archive, weighed).first() {
            self.evolved(finalists, (layout, WIDE), &watch, weighed, &mut archive)?;
        }
        for round in 0..POLISHED {
            if (self.stop)() || self.is_spent() {
                break;
            }
            match (self.renewed(&mut archive, &mut watch, weighed)?, self.nearest(&archive, weighed).first()) {
                (Some(true), _) => self.onward(finalists, None, &watch, weighed, &mut archive)?,
                (Some(false), Some(&layout)) => {
                    let spread = Spread { seed: NARROW.seed + round as u64, ..NARROW };
                    self.evolved(finalists, (layout, spread), &watch, weighed, &mut archive)?;
                }
                _ => break,
            }
        }
        Ok((archive, watch))
    }

    /// Adds the machines that are worst for the best design, and reruns the best designs of the nearest layouts if any
    /// is new, which is returned; `None` if no design keeps the limits.
    fn renewed(&mut self, archive: &mut Vec<Tried>, watch: &mut Watch, weighed: &Weighed) -> Result<Option<bool>> {
        let best = self.best_of(archive, weighed.cost, &BALANCES[1], weighed.bars)?;
        let Some(design) = best else { return Ok(None) };
        let layouts = self.nearest(archive, weighed);
        let is_new = self.watched_by(&design, watch)?;
        for &layout in layouts.iter().filter(|_| is_new) {
            self.again(archive, layout, watch, weighed);
        }
        Ok(Some(is_new))
    }

    /// Adds the machines that are worst for a design to the watched ones; true if any is new.
    fn watched_by(&self, design: &Design, watch: &mut Watch) -> Result<bool> {
        let seen = self.glanced(design)?;
        Ok(watch.join(&Watch::new(&seen, self.family.left_out(self.stages.len()))))
    }

    /// Counts the samples of a run until `end`, s.
    pub fn spend(&self, design: &Design, end: f64) {
        self.spent.set(self.spent.get() + (end / design.every) as u64);
    }

    /// Grants a search this many times the budget.
    pub fn grant(&mut self, times: f64) {
        let duration = if self.case.machine.stepper().is_some() { OF_STEPPER } else { 1.0 };
        self.most = self.charged() + (times * self.tuning.effort * SAMPLES as f64 / duration) as u64;
    }

    /// True if the budget of samples of moves is spent.
    pub fn is_spent(&self) -> bool {
        self.charged() >= self.most
    }

    /// Simulated samples, plus the charge for evaluated designs.
    fn charged(&self) -> u64 {
        self.spent.get() + self.tried as u64 * self.design_costs()
    }

    /// Charge of a design: samples that take as long as its limits on the set.
    fn design_costs(&self) -> u64 {
        self.case.controller.as_ref().map_or(0, |design| design.structure.tunable().costs())
    }

    /// Differential evolution about the best designs of a layout, repeated if its result exceeds a limit on a machine
    /// outside the set.
    pub fn evolved(
        &mut self,
        finalists: &[Finalist],
        (layout, spread): (usize, Spread),
        watch: &Watch,
        weighed: &Weighed,
        archive: &mut Vec<Tried>,
    ) -> Result<()> {
        let finalist = &finalists[layout];
        for seed in spread.seed..spread.seed + EVOLVED {
            if self.is_spent() {
                break;
            }
            let own = archive.iter().filter(|tried| tried.layout == layout);
            let mut known: Vec<(f64, Vec<f64>)> =
                own.map(|tried| (self.worth(tried, weighed), tried.powers.clone())).collect();
            known.sort_by(|a, b| a.0.total_cmp(&b.0));
            known.truncate(MEMBERS / 2);
            let mut all: Vec<Vec<f64>> = known.into_iter().map(|(_, x)| x).collect();
            let Some(best) = all.first().cloned() else { break };
            let mut random = Pcg64::seed_from_u64(seed);
            while all.len() < MEMBERS {
                all.push(best.iter().map(|x| x + spread.scatter * (2.0 * uniform(&mut random) - 1.0)).collect());
            }
            let mut value =
                |x: &[f64], bar: f64| self.of_moves((finalist, layout, x), watch, weighed, (spread.edge, bar), archive);
            let members = all.into_iter().map(|x| Optimum { value: value(&x, f64::INFINITY), x }).collect();
            let found = evolve(members, spread.generations, seed, &mut value);
            let Some(best) = found.first() else { break };
            let design = rounded(&shaped(&finalist.start, finalist.own, &best.x));
            // An eased design keeps the limits.
            if spread.edge == Edge::Eased || (self.stop)() || !self.passes(&design)? {
                break;
            }
        }
        Ok(())
    }

    /// ln J of a design that was run, by the weights of a search.
    fn worth(&self, tried: &Tried, weighed: &Weighed) -> f64 {
        self.valued(weighed.cost, &BALANCES[1], &tried.worst, weighed.bars)
    }

    /// Continues with the simplex from the best design that was run, of a layout if one is named.
    pub fn onward(
        &mut self,
        finalists: &[Finalist],
        layout: Option<usize>,
        watch: &Watch,
        weighed: &Weighed,
        archive: &mut Vec<Tried>,
    ) -> Result<()> {
        let own = archive.iter().filter(|tried| layout.is_none_or(|layout| tried.layout == layout));
        let best = own.min_by(|a, b| self.worth(a, weighed).total_cmp(&self.worth(b, weighed)));
        let Some((layout, from)) = best.map(|tried| (tried.layout, tried.powers.clone())) else { return Ok(()) };
        let finalist = &finalists[layout];
        let mut value = |x: &[f64], bar: f64| {
            self.of_moves((finalist, layout, x), watch, weighed, (Edge::Beyond(SLACK), bar), archive)
        };
        let found = minimise_below(&from, EDGE, 1e-3, MOVES, &mut value);
        let (start, own) = (&finalist.start, finalist.own);
        if self.passes(&rounded(&shaped(start, own, &found.x)))? {
            let powers = self.pulled(start, own, &from, &found.x)?;
            let design = rounded(&shaped(start, own, &powers));
            let worst = self.run(&design, watch, weighed, f64::INFINITY).0;
            archive.push(Tried { design, worst, layout, powers });
        }
        Ok(())
    }

    /// The two layouts with the best designs by the weights of a search.
    pub fn nearest(&self, archive: &[Tried], weighed: &Weighed) -> Vec<usize> {
        let mut ranked: Vec<(f64, usize)> =
            archive.iter().map(|tried| (self.worth(tried, weighed), tried.layout)).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut layouts: Vec<usize> = Vec::new();
        for (_, layout) in ranked {
            if !layouts.contains(&layout) && layouts.len() < 2 {
                layouts.push(layout);
            }
        }
        layouts
    }

    /// Reruns the best designs of a layout, the initial population size of them, on other machines and discards the
    /// rest.
    pub fn again(&self, archive: &mut Vec<Tried>, layout: usize, watch: &Watch, weighed: &Weighed) {
        let (mut own, other): (Vec<Tried>, Vec<Tried>) = archive.drain(..).partition(|tried| tried.layout == layout);
        own.sort_by(|a, b| self.worth(a, weighed).total_cmp(&self.worth(b, weighed)));
        own.truncate(MEMBERS / 2);
        for tried in &mut own {
            tried.worst = self.run(&tried.design, watch, weighed, f64::INFINITY).0;
        }
        archive.extend(other);
        archive.extend(own);
    }

    /// ln J, with penalties for figures that are worse than before.
    pub fn valued(&self, cost: Cost, balance: &Balance, worst: &[AtWorst], bars: Option<Bars>) -> f64 {
        if worst.len() != self.moves.len() {
            return f64::INFINITY;
        }
        let mut value = objective(cost, balance, self.moves, &self.asked, worst);
        let (figures, steep) = bars.map_or((&[][..], 0.0), |bars| (bars.figures, bars.steep));
        for ((is, was), motion) in worst.iter().zip(figures).zip(self.moves) {
            value += steep * (is.error.0 / (was.error.0 * (1.0 - BETWEEN))).ln().max(0.0);
            // Relative to the profile's duration, as in J.
            let duration = motion.profile().end().max(f64::MIN_POSITIVE);
            value += steep * was.later(is.settles.0) / duration;
            value += steep * LOST * is.unsettled.saturating_sub(was.unsettled) as f64;
        }
        if value.is_nan() { f64::INFINITY } else { value }
    }

    /// The best design of an archive by a balance that keeps the limits; a few are checked.
    pub fn best_of(
        &mut self,
        archive: &[Tried],
        cost: Cost,
        balance: &Balance,
        bars: Option<Bars>,
    ) -> Result<Option<Design>> {
        let mut ranked: Vec<(f64, &Tried)> =
            archive.iter().map(|tried| (self.valued(cost, balance, &tried.worst, bars), tried)).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (value, tried) in ranked.into_iter().take(TRIES) {
            if value.is_finite() && !self.passes(&tried.design)? {
                return Ok(Some(tried.design.clone()));
            }
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, Tuning};
    use crate::tune::family::Family;
    use crate::tune::gains::searched;
    use std::path::Path;

    /// Runs end as soon as a design loses; that changes neither which designs win nor their figures, and saves samples.
    #[test]
    fn runs_that_are_cut_short_lose_as_whole_ones_do() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../stages");
        for name in ["sollmann-jouaneh/controllers/pid-elastic.toml", "sollmann-jouaneh/controllers/lqi.toml"] {
            let case = Case::read(folder.join(name)).unwrap();
            let (design, tuning) = (case.controller.as_ref().unwrap(), Tuning::default());
            let family = Family::new(&case, &tuning).unwrap();
            let work = Work::new(&case, &family, &tuning, &case.moves, design, &|| false).unwrap();
            let weighed = Weighed { cost: Cost::Moves, bars: None };
            let own = design.filters.len();
            let mut random = Pcg64::seed_from_u64(4);
            let powers = vec![0.0; searched(design, own)];
            let mut scattered = || -> Design {
                let powers: Vec<f64> = powers.iter().map(|x| x + 0.4 * (2.0 * uniform(&mut random) - 1.0)).collect();
                shaped(design, own, &powers)
            };
            let mut watch = Watch::new(&work.glanced(design).unwrap(), 1);
            watch.join(&Watch::new(&work.glanced(&scattered()).unwrap(), 1));
            let of = |design: &Design, bar: f64| {
                let before = work.spent.get();
                let (worst, value) = work.run(design, &watch, &weighed, bar);
                (worst, value, work.spent.get() - before)
            };
            let (mut won, mut lost, mut whole_took, mut took) = (0, 0, 0, 0);
            for _ in 0..12 {
                let (one, other) = (scattered(), scattered());
                let bar = of(&one, f64::INFINITY).1;
                let (worst, value, whole) = of(&other, f64::INFINITY);
                let (cut_worst, cut, short) = of(&other, bar);
                assert_eq!(value < bar, cut < bar, "{name}: {value} {cut} {bar}");
                if value < bar {
                    assert_eq!((worst, value), (cut_worst, cut), "{name}");
                    won += 1;
                } else {
                    (lost, whole_took, took) = (lost + 1, whole_took + whole, took + short);
                }
            }
            assert!(won >= 2 && lost >= 2 && 10 * took < 9 * whole_took, "{name}: {won} {lost} {took} {whole_took}");
        }
    }
}
