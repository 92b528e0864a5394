//! Verdict on a controller over the family, and comparison of two verdicts.

use super::family::{Corner, Family, modes_along};
use super::hunting::{self, Observed};
use super::judged::{Figure, Forced, Judgement, Least, Limit, MoveVerdict, Standing, Verdict, Worse};
use super::margins::Margins;
use super::objective::{AtWorst, BALANCES, MoveFigures, Runner, objective};
use super::watch::Watch;
use super::work::{Work, mode_at};
use crate::case::{Cost, Tuning};
use crate::control::{Setup, closed_loop};
use crate::design::Design;
use crate::error::Result;
use crate::solve::{Ending, Solver};

/// Relative difference of equal figures.
const SAME: f64 = 1e-6;

/// Smallest reference value for the relative increase of a settling time, s.
const SHORT: f64 = 0.05;

impl Verdict {
    /// Worst case of its moves.
    pub(super) fn at_worst(&self) -> Vec<AtWorst> {
        self.moves.iter().map(|one| one.at_worst).collect()
    }

    /// Its machines, those that are worst in some figure first.
    pub(super) fn badness(&self) -> Vec<usize> {
        let mut ranked: Vec<(usize, usize)> = Vec::new();
        for one in &self.moves {
            let figures: [fn(&MoveFigures) -> f64; 3] = [|seen| seen.error, |seen| seen.settles, |seen| seen.current];
            for figure in figures {
                let mut order: Vec<usize> = (0..one.seen.len()).collect();
                order.sort_by(|&a, &b| figure(&one.seen[b]).total_cmp(&figure(&one.seen[a])));
                ranked.extend(order.into_iter().enumerate());
            }
        }
        ranked.sort();
        let mut all = Vec::new();
        for (_, place) in ranked {
            if !all.contains(&place) {
                all.push(place);
            }
        }
        all
    }

    /// Machines that are worst in a figure, without a corner outside the list.
    pub(super) fn watch(&self, work: &Work) -> Watch {
        let count = work.stages.len();
        let seen: Vec<Vec<MoveFigures>> = self.moves.iter().map(|one| one.seen[..count].to_vec()).collect();
        Watch::new(&seen, work.family.left_out(count))
    }

    /// Machines on which a figure exceeds its previous worst case: for each move the two worst, and one more for each
    /// excluded one; among `count` machines, without a corner outside the list.
    pub(super) fn worse_on(&self, before: &Verdict, count: usize) -> Watch {
        let of_move = |(is, was): (&MoveVerdict, &MoveVerdict)| {
            let beyond = |seen: &MoveFigures| {
                let later = was.at_worst.later(seen.settles) / was.at_worst.settles.0.max(SHORT);
                let left = if seen.settling.is_none() && is.settled.0 < was.settled.0 { 1.0 } else { 0.0 };
                (seen.error / was.at_worst.error.0).ln().max(later).max(left)
            };
            let mut ranked: Vec<(f64, usize)> =
                is.seen.iter().take(count).map(beyond).enumerate().map(|(place, value)| (value, place)).collect();
            ranked.retain(|(value, _)| *value > 0.0);
            ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
            ranked.into_iter().take(3).map(|(_, place)| place).collect()
        };
        Watch { axes: self.moves.iter().zip(&before.moves).map(of_move).collect(), left_out: 0 }
    }
}

impl Work<'_> {
    /// A verdict with its limit cycle at rest and the causes of it.
    pub fn watched(&self, verdict: Verdict) -> Result<Verdict> {
        let found = if verdict.nominal.stable && !(self.stop)() { self.hunt(&verdict.design)? } else { None };
        let whole = |found| hunting::with_causes(&self.case.machine, &verdict.design, found);
        let hunt = found.map(whole).transpose()?;
        Ok(Verdict { hunt, ..verdict })
    }

    /// The limit cycle of a design on the nominal machine, observed once.
    fn hunt(&self, design: &Design) -> Result<Option<Observed>> {
        if let Some((_, known)) = self.hunts.borrow().iter().find(|(known, _)| known == design) {
            return Ok(known.clone());
        }
        let found = hunting::observed(&self.case.machine, design)?;
        self.hunts.borrow_mut().push((design.clone(), found.clone()));
        Ok(found)
    }

    /// The verdict on a design, computed once.
    pub fn verdict(&self, design: &Design) -> Result<Verdict> {
        if let Some(known) = self.known.borrow().iter().find(|known| known.design == *design) {
            return Ok(known.clone());
        }
        let all: Vec<usize> = (0..=self.family.machines.len()).collect();
        let verdict = self.judged(design, (f64::INFINITY, &all))?;
        let verdict = self.hunted(verdict.expect("without a bar there is a verdict"))?;
        self.known.borrow_mut().push(verdict.clone());
        Ok(verdict)
    }

    /// The verdict on a design whose ln J is at most `bar`; none otherwise, which is reported as soon as the machines
    /// run so far, in this order, show it.
    pub(crate) fn verdict_below(&self, design: &Design, bar: f64, order: &[usize]) -> Result<Option<Verdict>> {
        if let Some(known) = self.known.borrow().iter().find(|known| known.design == *design) {
            return Ok(Some(known.clone()).filter(|known| known.objective <= bar));
        }
        let verdict = self.judged(design, (bar, order))?.map(|verdict| self.hunted(verdict)).transpose()?;
        self.known.borrow_mut().extend(verdict.clone());
        Ok(verdict)
    }

    /// A verdict with its limit cycle at rest, which is computed if no figure is worse than in the first verdict.
    fn hunted(&self, verdict: Verdict) -> Result<Verdict> {
        let is_worse = self.known.borrow().first().is_some_and(|first| worse(first, &verdict).is_some());
        if is_worse || !verdict.nominal.stable || (self.stop)() {
            return Ok(verdict);
        }
        Ok(Verdict { hunt: self.hunt(&verdict.design)?.map(|(hunt, _)| hunt), ..verdict })
    }

    fn judged(&self, design: &Design, (bar, order): (f64, &[usize])) -> Result<Option<Verdict>> {
        let feedback = self.feedback(design)?;
        let corners = feedback.corners();
        let nominal = Margins::new(&self.family.plant(&self.family.nominal(), design, &corners)?, &feedback);
        let (place, excess, unstable) = self.worst(&feedback);
        let mut at_corner = None;
        let mut machines = self.family.machines.clone();
        let mut corner = machines[place].clone();
        if self.family.corners {
            let (found, margins) = self.family.worst(design, &feedback, &|margins| self.excess(margins))?;
            if self.excess(&margins) >= excess {
                corner = found.clone();
            }
            at_corner = Some(margins);
            machines.push(found);
        }
        let left_out = self.family.left_out(machines.len());
        let Some(all) = self.seen(design, &machines, (bar, order, left_out))? else { return Ok(None) };
        let Some(worst) = self.margins_at_worst(&feedback, at_corner) else { return Ok(None) };
        let mut moves = Vec::new();
        for (motion, seen) in self.moves.iter().zip(all) {
            let (machine, until, window) = (&self.case.machine, motion.until, motion.window);
            let (profiles, solver) = (&motion.profiles, Solver::for_machine(machine));
            let own = closed_loop(&Setup { machine, model: machine, design, profiles, until, window, solver })?;
            let at_worst = AtWorst::new(&seen, left_out);
            moves.push(MoveVerdict {
                name: motion.name.clone(),
                window: motion.window,
                cart: own.figures.worst_load().error,
                settling: own.figures.settling.filter(|_| own.outcome.ending == Ending::Complete),
                current: own.figures.worst_current(),
                worst: (at_worst.error.0, self.family.words(&machines[at_worst.error.1])),
                settled: (at_worst.settled, machines.len()),
                at_worst,
                seen,
            });
        }
        let figures: Vec<AtWorst> = moves.iter().map(|one| one.at_worst).collect();
        let cost = self.tuning.cost.unwrap_or(Cost::Moves);
        let value = objective(cost, &BALANCES[1], self.moves, &self.asked, &figures);
        let unstable = (unstable, self.family.machines.len());
        let design = design.clone();
        Ok(Some(Verdict { design, nominal, corner, worst, unstable, objective: value, moves, hunt: None }))
    }

    /// Figures of each move on all machines; none as soon as ln J exceeds the bar, since further machines cannot reduce
    /// a worst-case figure.
    fn seen(
        &self,
        design: &Design,
        machines: &[Corner],
        (bar, order, left_out): (f64, &[usize], usize),
    ) -> Result<Option<Vec<Vec<MoveFigures>>>> {
        let cost = self.tuning.cost.unwrap_or(Cost::Moves);
        let mut runner = Runner::new(&self.case.machine, design)?;
        let mut found: Vec<(usize, Vec<MoveFigures>)> = Vec::with_capacity(machines.len());
        let of = |found: &[(usize, Vec<MoveFigures>)], k: usize| -> Vec<MoveFigures> {
            found.iter().map(|(_, figures)| figures[k]).collect()
        };
        for place in order.iter().copied().filter(|place| *place < machines.len()) {
            // A corner outside the list of machines is not prepared.
            let corner;
            let machine = match self.stages.get(place) {
                Some(machine) => machine,
                None => {
                    corner = self.family.stage_at(&machines[place]).interpolating();
                    &corner
                }
            };
            // Without a spread machines are equal, and so are their runs.
            let equal = |(other, _): &&(usize, Vec<MoveFigures>)| self.stages.get(*other) == Some(machine);
            let figures = match found.iter().find(equal) {
                Some((_, figures)) => figures.clone(),
                None => self.looked(&mut runner, design, machine)?,
            };
            found.push((place, figures));
            if bar.is_finite() && found.len() > left_out {
                let worst: Vec<AtWorst> =
                    (0..self.moves.len()).map(|k| AtWorst::new(&of(&found, k), left_out)).collect();
                if objective(cost, &BALANCES[1], self.moves, &self.asked, &worst) > bar {
                    return Ok(None);
                }
            }
        }
        found.sort_by_key(|(place, _)| *place);
        Ok(Some((0..self.moves.len()).map(|k| of(&found, k)).collect()))
    }
}

/// Judges a controller against the one before: worse if any figure of a move is worse.
pub(super) fn compare(before: &Verdict, after: &Verdict) -> Judgement {
    if before.design == after.design {
        return Judgement::Unchanged;
    }
    if worse(before, after).is_some() {
        return Judgement::Worse;
    }
    let rests = before.hunt.is_some() && after.hunt.is_none();
    let holds_more = rests || after.worst.sensitivity < before.worst.sensitivity * (1.0 - SAME);
    if after.objective < before.objective - SAME || holds_more { Judgement::Better } else { Judgement::Unchanged }
}

/// The figure with the largest deterioration, if any.
pub(super) fn worse(before: &Verdict, after: &Verdict) -> Option<Worse> {
    let of_move = |(motion, (was, is)): (usize, (&MoveVerdict, &MoveVerdict))| {
        let axes = is.settled.1 as f64;
        let (was, is) = (&was.at_worst, &is.at_worst);
        let lost = was.settled.saturating_sub(is.settled) as f64;
        let finite = |share: f64| if share.is_nan() { f64::INFINITY } else { share };
        let figures = [
            (
                is.error.0 > was.error.0 * (1.0 + SAME) || !is.error.0.is_finite() && was.error.0.is_finite(),
                (Figure::Error, was.error.0, is.error.0, finite(is.error.0 / was.error.0 - 1.0)),
            ),
            (
                was.later(is.settles.0) > SAME * (was.settles.0 + 1.0),
                (
                    Figure::Settling,
                    was.settles.0,
                    is.settles.0,
                    finite(was.later(is.settles.0) / was.settles.0.max(SHORT)),
                ),
            ),
            (lost > 0.0, (Figure::Settled, was.settled as f64, is.settled as f64, lost / axes)),
        ];
        let told = figures.into_iter().filter(|(is_worse, _)| *is_worse);
        told.map(move |(_, (figure, before, after, by))| Worse { motion: Some(motion), figure, before, after, by })
            .collect::<Vec<_>>()
    };
    let all = before.moves.iter().zip(&after.moves).enumerate().flat_map(of_move);
    // A cart that never reached a target cannot hunt about one.
    let came_to_rest = before.moves.iter().any(|one| one.at_worst.settled > 0);
    let window = after.moves.iter().map(|one| one.window).fold(f64::INFINITY, f64::min);
    let hunts = after.hunt.as_ref().filter(|hunt| came_to_rest && hunt.is_more_than(before.hunt.as_ref(), window));
    let hunts = hunts.map(|hunt| {
        let was = before.hunt.as_ref().map_or(0.0, |hunt| hunt.amplitude);
        let by = if was > 0.0 { hunt.amplitude / was - 1.0 } else { f64::INFINITY };
        Worse { motion: None, figure: Figure::Hunting, before: was, after: hunt.amplitude, by }
    });
    all.chain(hunts).max_by(|a, b| a.by.total_cmp(&b.by))
}

impl Work<'_> {
    /// The design within the limits, among those judged on the complete family, whose worst figure deteriorates least.
    pub fn least(&self, before: &Verdict) -> Option<Least> {
        let known = self.known.borrow();
        let within = known.iter().filter(|one| one.design != before.design && self.excess(&one.worst) <= 1.0);
        let judged = within.filter_map(|one| Some((one, worse(before, one)?)));
        let (one, worse) = judged.min_by(|(_, a), (_, b)| a.by.total_cmp(&b.by))?;
        Some(Least { design: one.design.clone(), worse, objective: one.objective })
    }
}

/// Fraction of a limit above which it is active: gains are rounded, and a search on the grid keeps 2 % away.
const ACTIVE: f64 = 0.96;

/// The active limit at a design, if any: a search that merely failed to find better gains proves nothing.
pub(super) fn forced(family: &Family, after: &Verdict, tuning: &Tuning) -> Option<Forced> {
    let is_active = after.worst.excess(tuning.sensitivity, tuning.complementary) >= ACTIVE;
    is_active.then(|| limiting(family, after, tuning, Standing::WayBack))
}

/// The limit that forces gains to be worse if none is active: the one that the gains of the file violate, or the
/// requested bandwidth if they violate none.
pub(super) fn forced_by_file(family: &Family, before: &Verdict, tuning: &Tuning, placed: Option<f64>) -> Forced {
    let own = limiting(family, before, tuning, Standing::File);
    match before.worst.excess(tuning.sensitivity, tuning.complementary) <= 1.0 {
        true => Forced { limit: Limit::Bandwidth, mode: placed.unwrap_or(own.mode), ..own },
        false => own,
    }
}

/// The nearest limit at a design.
fn limiting(family: &Family, after: &Verdict, tuning: &Tuning, standing: Standing) -> Forced {
    let worst = &after.worst;
    let is_sensitivity = worst.sensitivity / tuning.sensitivity >= worst.complementary / tuning.complementary;
    let (limit, omega, at) = match is_sensitivity || !worst.stable {
        true => (Limit::Sensitivity, worst.at, worst.breaks.sensitivity),
        false => (Limit::Complementary, worst.complementary_at, worst.breaks.complementary),
    };
    let there =
        modes_along(&family.stage_at(&after.corner), after.corner.bridge, &[after.corner.place]).unwrap_or_default();
    let modes: Vec<f64> = there.iter().flat_map(|place| place.undamped_resonances.iter().copied()).collect();
    Forced { limit, standing, at, mode: mode_at(omega, &modes), place: after.corner.place }
}
