//! The search by moves, on the axes that are worst for what it finds and at the samples of the controller; whatever is
//! told of a design comes from whole runs on all axes.

use super::evolution::evolve;
use super::objective::{AtWorst, BALANCES, Balance, MoveFigures, Runner, objective};
use super::search::{Found, minimise_below};
use super::work::{FINALISTS, Finalist, STEEP, Work};
use crate::case::{Cost, Move};
use crate::chance::uniform;
use crate::design::Design;
use crate::error::Result;
use crate::signal::profile::Profile;
use crate::stage::Stage;
use crate::tune::gains::{rounded, shaped};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

/// Values that a simplex may ask for.
const MOVES: usize = 60;

/// Edge of the simplex at first and where it goes on.
const FIRST: f64 = 0.25;
const FURTHER: f64 = 0.12;

/// Members and generations of differential evolution, how far members are scattered about the best (natural logarithm
/// of gains), and how often it is done again with an axis more.
pub(super) const MEMBERS: usize = 12;
const GENERATIONS: usize = 12;
const SCATTER: f64 = 0.4;
const EVOLVED: usize = 2;

/// How much worse than the best (ln J) a finalist may be and still be searched from.
const NEAR: f64 = 0.3;

/// Samples of moves that a search may simulate: a few seconds of a processor.
const SAMPLES: u64 = 6_000_000;

/// How often a search goes on with the axes that are worst for what it found.
const POLISHED: usize = 4;

/// Axes that are watched for each figure, beside those that a figure at worst leaves out.
const WATCHED: usize = 2;

/// Share of a figure before by which one at samples has to be less: a peak between them may be that much higher.
const BETWEEN: f64 = 2e-3;

/// What is beyond the limits at least where they are passed on an axis between the points of the grid.
const LEAST_BEYOND: f64 = 1e-3;

/// Weight of an axis on which the cart settles no more, as a share of that of an error.
const LOST: f64 = 0.2;

/// A design that was run.
#[derive(Debug, Clone)]
pub(super) struct Tried {
    pub design: Design,
    pub worst: Vec<AtWorst>,
    /// The finalist that it was made from, and the powers that lead to it.
    pub layout: usize,
    powers: Vec<f64>,
}

/// By what a search by moves weighs a design.
pub(super) struct Weighed<'a> {
    pub cost: Cost,
    /// Figures that none may be worse than.
    pub bars: Option<Bars<'a>>,
}

/// Figures before, and how steeply ln J grows with what a figure is worse.
#[derive(Clone, Copy)]
pub(super) struct Bars<'a> {
    pub figures: &'a [AtWorst],
    pub steep: f64,
}

/// Of each move the axes on which a search runs it, the worst first.
#[derive(Debug, Clone, Default)]
pub(super) struct Watch {
    pub axes: Vec<Vec<usize>>,
}

impl Watch {
    /// Those that are worst in a figure, of each so many more than it leaves out.
    pub fn of(seen: &[Vec<MoveFigures>], left_out: usize) -> Self {
        let of_move = |seen: &Vec<MoveFigures>| {
            let mut axes: Vec<usize> = Vec::new();
            let figures: [fn(&MoveFigures) -> f64; 2] = [|seen| seen.error, |seen| seen.settles];
            let orders = figures.map(|figure| {
                let mut order: Vec<usize> = (0..seen.len()).collect();
                order.sort_by(|&a, &b| figure(&seen[b]).total_cmp(&figure(&seen[a])));
                order
            });
            for rank in 0..(left_out + WATCHED).min(seen.len()) {
                for order in &orders {
                    if !axes.contains(&order[rank]) {
                        axes.push(order[rank]);
                    }
                }
            }
            axes
        };
        Self { axes: seen.iter().map(of_move).collect() }
    }

    /// Those of another first, too; whether any is new.
    pub fn join(&mut self, other: &Self) -> bool {
        self.axes.resize(self.axes.len().max(other.axes.len()), Vec::new());
        let mut is_new = false;
        for (own, other) in self.axes.iter_mut().zip(&other.axes) {
            is_new |= other.iter().any(|axis| !own.contains(axis));
            let mut all = other.clone();
            all.extend(own.iter().filter(|axis| !other.contains(axis)));
            *own = all;
        }
        is_new
    }
}

impl Work<'_> {
    /// The figures of all moves on one axis.
    pub fn looked(&self, runner: &mut Runner, design: &Design, stage: &Stage) -> Result<Vec<MoveFigures>> {
        let one = |(motion, shaped): (&Move, &Profile)| {
            self.spend(design, motion);
            runner.look(stage, motion, shaped)
        };
        self.moves.iter().zip(&self.shaped).map(one).collect()
    }

    /// The figures of each move on all axes, at samples.
    pub fn glanced(&self, design: &Design) -> Result<Vec<Vec<MoveFigures>>> {
        let mut runner = Runner::new(&self.case.stage, design)?;
        let mut of_move = |(motion, shaped): (&Move, &Profile)| {
            let one = |stage: &Stage| {
                self.spend(design, motion);
                runner.glance(stage, motion, shaped)
            };
            self.stages.iter().map(one).collect::<Result<Vec<_>>>()
        };
        self.moves.iter().zip(&self.shaped).map(&mut of_move).collect()
    }

    /// The figures at worst of a design on the axes that are watched, at samples, and ln J by the balance of the
    /// search; as soon as it is at least `bar` those of what was run until then: another axis makes no figure at worst
    /// smaller.
    fn run(&self, design: &Design, watch: &Watch, weighed: &Weighed, bar: f64) -> (Vec<AtWorst>, f64) {
        let nothing = (Vec::new(), f64::INFINITY);
        let Ok(mut runner) = Runner::new(&self.case.stage, design) else { return nothing };
        let left_out = self.family.left_out(self.stages.len());
        let mut seen: Vec<Vec<MoveFigures>> = vec![Vec::new(); self.moves.len()];
        let mut worst: Vec<AtWorst> = self.least.borrow().iter().map(|&current| AtWorst::at_least(current)).collect();
        let most = watch.axes.iter().map(Vec::len).max().unwrap_or_default();
        let mut value = f64::INFINITY;
        for rank in 0..most {
            for (k, (motion, shaped)) in self.moves.iter().zip(&self.shaped).enumerate() {
                let Some(&axis) = watch.axes[k].get(rank) else { continue };
                self.spend(design, motion);
                let Ok(one) = runner.glance(&self.stages[axis], motion, shaped) else { return nothing };
                seen[k].push(one);
                if seen[k].len() <= left_out && seen[k].len() < watch.axes[k].len() {
                    continue;
                }
                worst[k] = AtWorst::of(&seen[k], left_out);
                value = self.valued(weighed.cost, &BALANCES[1], &worst, weighed.bars);
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

    /// Searches by moves: with the simplex from each of the best finalists, then with differential evolution about the
    /// best, and on with the simplex as long as other axes are worst for what is found. All that was run and keeps the
    /// limits on the set, and the axes that are watched.
    pub fn by_moves(&mut self, finalists: &[Finalist], weighed: &Weighed) -> Result<(Vec<Tried>, Watch)> {
        self.most = self.spent.get() + SAMPLES;
        let mut watch = Watch::default();
        let mut archive: Vec<Tried> = Vec::new();
        if let Some(first) = finalists.first() {
            self.watched_by(&first.design, &mut watch)?;
        }
        let mut ranked: Vec<(f64, usize)> = Vec::new();
        for (layout, finalist) in finalists.iter().enumerate() {
            let (worst, _) = self.run(&finalist.design, &watch, weighed, f64::INFINITY);
            // Where a search begins need not be good in every figure.
            ranked.push((self.valued(weighed.cost, &BALANCES[1], &worst, None), layout));
            archive.push(Tried { design: finalist.design.clone(), worst, layout, powers: finalist.powers.clone() });
        }
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut best: Option<(f64, usize)> = None;
        let least = ranked.first().map_or(f64::INFINITY, |(value, _)| *value);
        ranked.retain(|(value, _)| *value <= least + NEAR);
        for (_, layout) in ranked.into_iter().take(FINALISTS) {
            let from = finalists[layout].powers.clone();
            let (value, _) = self.moved(finalists, layout, &from, (&watch, FIRST), weighed, &mut archive)?;
            if best.is_none_or(|(least, _)| value < least) {
                best = Some((value, layout));
            }
        }
        if let Some((_, layout)) = best {
            self.evolved(finalists, layout, &watch, weighed, &mut archive)?;
        }
        for _ in 0..POLISHED {
            if (self.stop)() || self.is_spent() {
                break;
            }
            let Some(design) = self.best_of(&archive, weighed.cost, &BALANCES[1], weighed.bars)? else { break };
            if !self.watched_by(&design, &mut watch)? {
                break;
            }
            for layout in self.nearest(&archive, weighed) {
                self.again(&mut archive, (layout, FINALISTS), &watch, weighed);
            }
            self.onward(finalists, None, &watch, weighed, &mut archive)?;
        }
        Ok((archive, watch))
    }

    /// Joins the axes that are worst for a design to those that are watched; whether any is new.
    fn watched_by(&self, design: &Design, watch: &mut Watch) -> Result<bool> {
        let seen = self.glanced(design)?;
        Ok(watch.join(&Watch::of(&seen, self.family.left_out(self.stages.len()))))
    }

    /// ln J of a finalist with these powers, by moves on the axes that are watched, and what it is beyond the limits on
    /// the set, of which `slack` is allowed; what keeps them and is below the bar joins the archive. Infinite once the
    /// search is to end.
    pub fn of_moves(
        &mut self,
        (finalist, layout, powers): (&Finalist, usize, &[f64]),
        watch: &Watch,
        weighed: &Weighed,
        (slack, bar): (f64, f64),
        archive: &mut Vec<Tried>,
    ) -> f64 {
        if (self.stop)() || self.is_spent() {
            return f64::INFINITY;
        }
        let design = rounded(&shaped(&finalist.start, finalist.own, powers));
        let beyond = self.on_set(&design).0;
        if beyond > slack {
            return 1e3 + beyond.min(1e6);
        }
        let (worst, value) = self.run(&design, watch, weighed, bar - STEEP * beyond);
        if beyond == 0.0 && value < bar {
            // What is worth keeping has to keep the limits on all axes; the one on which it does not joins the set.
            match self.passes(&design) {
                Ok(false) => archive.push(Tried { design, worst, layout, powers: powers.to_vec() }),
                Ok(true) => {
                    let beyond = self.on_set(&design).0.max(LEAST_BEYOND);
                    return if beyond > slack { 1e3 + beyond.min(1e6) } else { value + STEEP * beyond };
                }
                Err(_) => return f64::INFINITY,
            }
        }
        value + STEEP * beyond
    }

    /// Counts the samples of a move.
    pub fn spend(&self, design: &Design, motion: &Move) {
        self.spent.set(self.spent.get() + (motion.until / design.every) as u64);
    }

    /// Whether the samples of moves that a search may ask for are used up.
    pub fn is_spent(&self) -> bool {
        self.spent.get() >= self.most
    }

    /// One search with the simplex; its value, and the powers.
    fn moved(
        &mut self,
        finalists: &[Finalist],
        layout: usize,
        from: &[f64],
        (watch, step): (&Watch, f64),
        weighed: &Weighed,
        archive: &mut Vec<Tried>,
    ) -> Result<(f64, Vec<f64>)> {
        let finalist = &finalists[layout];
        let (start, own) = (&finalist.start, finalist.own);
        // A simplex goes along the edge of the limits: a little beyond is allowed, and costs.
        let mut value =
            |x: &[f64], bar: f64| self.of_moves((finalist, layout, x), watch, weighed, (0.05, bar), archive);
        let found = minimise_below(from, step, 1e-3, MOVES, &mut value);
        let (mut value, mut powers) = (found.value, found.x);
        if self.passes(&rounded(&shaped(start, own, &powers)))? {
            powers = self.pulled(start, own, from, &powers)?;
            let design = rounded(&shaped(start, own, &powers));
            let (worst, now) = self.run(&design, watch, weighed, f64::INFINITY);
            value = now;
            archive.push(Tried { design, worst, layout, powers: powers.clone() });
        }
        Ok((value, powers))
    }

    /// Differential evolution about the best designs of a layout that were run, once more where what it finds passes a
    /// limit on an axis that was not looked at.
    pub fn evolved(
        &mut self,
        finalists: &[Finalist],
        layout: usize,
        watch: &Watch,
        weighed: &Weighed,
        archive: &mut Vec<Tried>,
    ) -> Result<()> {
        let finalist = &finalists[layout];
        let (start, own) = (&finalist.start, finalist.own);
        for round in 0..EVOLVED {
            if self.is_spent() {
                return Ok(());
            }
            let mut known: Vec<Found> = Vec::new();
            for tried in archive.iter().filter(|tried| tried.layout == layout) {
                let value = self.worth(tried, weighed);
                known.push(Found { x: tried.powers.clone(), value });
            }
            known.sort_by(|a, b| a.value.total_cmp(&b.value));
            let Some(best) = known.first().cloned() else { return Ok(()) };
            known.truncate(MEMBERS / 2);
            let mut random = Pcg64::seed_from_u64(15 + round as u64);
            while known.len() < MEMBERS {
                let x = best.x.iter().map(|x| x + SCATTER * (2.0 * uniform(&mut random) - 1.0)).collect();
                known.push(Found { x, value: f64::INFINITY });
            }
            // Members of a population are told apart by moves alone: what is beyond the limits is none.
            let mut value =
                |x: &[f64], bar: f64| self.of_moves((finalist, layout, x), watch, weighed, (0.0, bar), archive);
            for member in &mut known {
                member.value = value(&member.x, f64::INFINITY);
            }
            let found = evolve(known, GENERATIONS, 15 + round as u64, &mut value);
            let Some(best) = found.first() else { break };
            if (self.stop)() || !self.passes(&rounded(&shaped(start, own, &best.x)))? {
                break;
            }
        }
        Ok(())
    }

    /// ln J of a design that was run, by what a search weighs.
    fn worth(&self, tried: &Tried, weighed: &Weighed) -> f64 {
        self.valued(weighed.cost, &BALANCES[1], &tried.worst, weighed.bars)
    }

    /// With the simplex from the best design that was run, of a layout if one is named.
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
        if let Some((layout, powers)) = best.map(|tried| (tried.layout, tried.powers.clone())) {
            self.moved(finalists, layout, &powers, (watch, FURTHER), weighed, archive)?;
        }
        Ok(())
    }

    /// The two layouts with a design that is best by what a search weighs.
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

    /// Runs the best designs of a layout, at most so many, again, on other axes, and forgets the rest of it.
    pub fn again(&self, archive: &mut Vec<Tried>, (layout, most): (usize, usize), watch: &Watch, weighed: &Weighed) {
        let (mut own, other): (Vec<Tried>, Vec<Tried>) = archive.drain(..).partition(|tried| tried.layout == layout);
        own.sort_by(|a, b| self.worth(a, weighed).total_cmp(&self.worth(b, weighed)));
        own.truncate(most);
        for tried in &mut own {
            tried.worst = self.run(&tried.design, watch, weighed, f64::INFINITY).0;
        }
        archive.extend(other);
        archive.extend(own);
    }

    /// ln J, and what figures are worse than before.
    pub fn valued(&self, cost: Cost, balance: &Balance, worst: &[AtWorst], bars: Option<Bars>) -> f64 {
        if worst.len() != self.moves.len() {
            return f64::INFINITY;
        }
        let mut value = objective(cost, balance, self.moves, &self.asked, worst);
        let (figures, steep) = bars.map_or((&[][..], 0.0), |bars| (bars.figures, bars.steep));
        for ((is, was), motion) in worst.iter().zip(figures).zip(self.moves) {
            value += steep * (is.error.0 / (was.error.0 * (1.0 - BETWEEN))).ln().max(0.0);
            // As a share of the profile's duration, as J counts it.
            let duration = motion.profile.end().max(f64::MIN_POSITIVE);
            value += steep * (is.settles.0 - was.settles.0).max(0.0) / duration;
            value += steep * LOST * is.unsettled.saturating_sub(was.unsettled) as f64;
        }
        if value.is_nan() { f64::INFINITY } else { value }
    }

    /// The design of an archive that is best by a balance and keeps the limits; a few are looked at.
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

/// Designs of each balance that are looked at before none is taken.
const TRIES: usize = 20;
