//! Tuning of gains and filters of a structure by simulated moves: worst-case settling, error and current over a family
//! of machines, subject to limits on the sensitivity of the sampled loop.
//!
//! The procedure is [`tune`]; [`evaluate`] judges without a search. Gains are rounded to four digits, and all results
//! hold for the rounded gains.

mod ahead;
mod by_moves;
mod by_steps;
mod certificate;
mod edge;
mod evolution;
mod family;
mod gains;
mod hunting;
mod judged;
mod loops;
mod margins;
mod moves;
mod objective;
mod plant;
mod reference;
mod rules;
mod search;
mod tried;
pub mod trouble;
mod unknown;
mod verdict;
mod watch;
mod way_back;
mod winding;
mod work;

pub use crate::design::placement::{first, place};
pub use ahead::Ahead;
pub use certificate::{Certificate, Violation};
pub use family::{Corner, Family, MACHINES, Source};
pub use gains::{Gain, gains};
pub use hunting::{Hunt, hunting};
pub use judged::{Figure, Forced, Judgement, Least, Limit, MoveVerdict, Standing, Verdict, Worse};
pub use loops::{Break, Broken, Loops, breaks, loops};
pub(crate) use loops::{from_commands, inverse, largest, over, smallest};
pub use margins::{Breaks, Margins, Peaks, Rough};
pub(crate) use objective::BALANCES;
pub use objective::{AtWorst, Balance, MoveFigures, look, objective};
pub use plant::Plant;
pub use reference::evolved;
pub use search::{Optimum, minimise};
pub use unknown::SPREAD;
pub use unknown::Unknown;

use crate::case::{Case, Cost, EFFORTS, Files, Move, Tuning};
use crate::control::feedback::Feedback;
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::BeltModel;
use by_moves::WIDE;
use std::path::Path;
use tried::{Bars, Tried, Weighed};
use verdict::{compare, forced_by_file, worse};
use watch::Watch;
use work::{Finalist, Work};

/// Maximum rounds of the constrained search, in which no figure may be worse.
const KEPT: usize = 6;

/// Number of these that search nearby with the simplex before differential evolution.
const NEARBY: usize = 2;

/// Penalty slopes d ln J / d ln(error/error_before), and with respect to a later settling relative to the duration of
/// the move: soft in the search, so that it does not end at a worse figure,
/// and hard if nothing may be worse.
const SOFT: f64 = 3.0;
const HARD: f64 = 30.0;

/// Factor on the integral action of a loop that hunts more than before, and its lower bound.
const CALMER: f64 = 0.4;
const CALMEST: f64 = 0.01;

/// Name of the chosen design if no balance selected it.
const CHOSEN: &str = "chosen";

/// The result of a tuning.
#[derive(Debug, Clone)]
pub struct Tuned {
    /// The loop with the gains of the file.
    pub before: Verdict,
    /// The tuned loop.
    pub after: Verdict,
    /// The judgement.
    pub judgement: Judgement,
    /// Advice if it is worse, if any.
    pub advice: Option<String>,
    /// Feed-forward that improves the moves beyond the gains alone, if any.
    pub ahead: Option<Ahead>,
    /// The limit that forces it to be worse; always present if it is worse.
    pub forced: Option<Forced>,
    /// If it is worse, the gains that deteriorate least.
    pub least: Option<Least>,
    /// Choices between stiff and gentle, with the selected one among them.
    pub choices: Vec<Choice>,
    /// Bandwidth at the start of the search, Hz; none if it began with weights, or without a search.
    pub placed: Option<f64>,
    /// The family of machines.
    pub family: Family,
    /// The moves, those of the file or a standard set.
    pub moves: Vec<Move>,
    /// True if the limits of sensitivity hold in the worst case.
    pub holds: bool,
    /// Number of rounds, and of tried designs; zero for an evaluation.
    pub work: (usize, usize),
    /// Samples of moves simulated by the search.
    pub samples: u64,
    /// First mode of a belt without any damping, Hz.
    pub undamped: Option<f64>,
    /// Modes excited by a command, each at the middle of its range along the travel, Hz.
    pub modes: Vec<f64>,
    /// True if gains were searched for, not only judged.
    pub searched: bool,
    /// Certificate of the tuned loop for every machine of the family, drawn or not.
    pub certificate: Certificate,
}

/// A design that is best by some balance between error and current.
#[derive(Debug, Clone)]
pub struct Choice {
    /// "stiff", "balanced" or "gentle".
    pub name: &'static str,
    /// The controller.
    pub design: Design,
    /// ln J by the balance of the search.
    pub objective: f64,
    /// Worst case of its moves.
    pub worst: Vec<AtWorst>,
    /// True for the selected design.
    pub chosen: bool,
}

/// Judges the controller of a case as it is.
pub fn evaluate(case: &Case, tuning: &Tuning) -> Result<Tuned> {
    let (design, family, moves) = beginning(case, tuning)?;
    let work = Work::new(case, &family, tuning, &moves, design, &|| false)?;
    let before = work.verdict(design)?;
    Ok(Tuned { searched: false, ..ended(&work, before.clone(), (before, None), Vec::new(), None)? })
}

/// Tunes the controller of a case; `stop` is called occasionally, and ends a search early with the best so far.
///
/// ```no_run
/// use taut::case::Case;
/// use taut::tune::tune;
///
/// let case = Case::read("stages/sollmann-jouaneh/controllers/pid.toml")?;
/// let tuned = tune(&case, &case.tune.clone().unwrap_or_default(), &|| false)?;
/// assert!(tuned.after.worst.sensitivity <= 1.8);
/// # Ok::<(), taut::Error>(())
/// ```
pub fn tune(case: &Case, tuning: &Tuning, stop: &dyn Fn() -> bool) -> Result<Tuned> {
    let (design, family, moves) = beginning(case, tuning)?;
    let mut work = Work::new(case, &family, tuning, &moves, design, stop)?;
    let before = work.verdict(design)?;
    let Some(cost) = tuning.cost else {
        let (swing, bandwidth) = (work.modes()?.1, tuning.bandwidth);
        let hertz = bandwidth.unwrap_or(first(design, swing));
        let placed = place(design, &case.machine, hertz, tuning.damping).unwrap_or(design.clone());
        let after = work.verdict(&gains::rounded(&placed))?;
        let forced = work.way_back(&before, after.clone())?.1;
        return ended(&work, before, (after, forced), Vec::new(), Some(hertz));
    };
    let is_good = work.excess(&before.worst) <= 1.0;
    let (finalists, placed) = work.screened(design, is_good)?;
    let Some(best) = finalists.first() else {
        return Err(Error::new(format!(
            "none of the tried gains of this structure keeps Ms within {} and Mt within {} over the family",
            tuning.sensitivity, tuning.complementary
        ))
        .next(match without_derivative(case, design) {
            Some(advice) => advice,
            None => {
                "allow a larger tune.sensitivity and tune.complementary, a smaller spread, or give it another structure"
                    .to_string()
            }
        }));
    };
    let (after, forced, choices) = match cost {
        Cost::Disturbance => {
            let after = work.verdict(&best.design)?;
            let forced = work.way_back(&before, after.clone())?.1;
            (after, forced, Vec::new())
        }
        Cost::Moves | Cost::Squares | Cost::Peak => {
            let figures = before.at_worst();
            let weighed = Weighed { cost, bars: Some(Bars { figures: &figures, steep: SOFT }) };
            let (mut archive, watch) = work.by_moves(&finalists, &weighed)?;
            let leading = work.best_of(&archive, cost, &BALANCES[1], weighed.bars)?;
            let leading = work.verdict(leading.as_ref().unwrap_or(&best.design))?;
            let (after, choices) = work.chosen(&archive, cost, &before, leading)?;
            let (after, choices) = match compare(&before, &after) {
                Judgement::Worse => work.kept(&finalists, &mut archive, watch, cost, &before, after)?,
                Judgement::Better | Judgement::Unchanged => (after, choices),
            };
            let (after, forced) = work.way_back(&before, after)?;
            let after = work.calmer(&before, after)?;
            (after.clone(), forced, marked(choices, &after))
        }
    };
    // Keeps the gains of the file unless the result is better.
    let after = if is_good && compare(&before, &after) != Judgement::Better { before.clone() } else { after };
    let tuned = ended(&work, before, (after, forced), choices, placed)?;
    Ok(Tuned { ahead: work.ahead(&tuned.after)?, ..tuned })
}

/// The controller, the family and the moves of a case.
fn beginning<'a>(case: &'a Case, tuning: &Tuning) -> Result<(&'a Design, Family, Vec<Move>)> {
    let design = case.controller.as_ref().ok_or_else(|| {
        Error::new("this case has no controller to tune")
            .next(format!("add [controller] with for example {}", case.suggested_controller()))
    })?;
    if design.is_open_loop() {
        return Err(Error::new("a stepper in open loop has no gains to tune: it follows its command without feedback")
            .next(format!(
                "choose its moves with `taut plan` and its input shaper with `taut shape`; or, with an encoder, add \
                 [controller] with for example {}",
                case.suggested_controller()
            )));
    }
    Feedback::new(design, &case.machine)?;
    if !EFFORTS.contains(&tuning.effort) {
        let (least, most) = (EFFORTS.start(), EFFORTS.end());
        return Err(
            Error::new(format!("an effort of {} is invalid", tuning.effort)).allowed(format!("from {least} to {most}"))
        );
    }
    Ok((design, Family::new(case, tuning)?, moves::moves(case, design)?))
}

impl Work<'_> {
    /// The best design by the objective over all machines, preferring one that makes no move worse; and the choices of
    /// other balances.
    fn chosen(
        &mut self,
        archive: &[Tried],
        cost: Cost,
        before: &Verdict,
        leading: Verdict,
    ) -> Result<(Verdict, Vec<Choice>)> {
        if (self.stop)() {
            return Ok((leading, Vec::new()));
        }
        let figures = before.at_worst();
        let bars = Some(Bars { figures: &figures, steep: HARD });
        let rank = |verdict: &Verdict| (compare(before, verdict) == Judgement::Worse, verdict.objective);
        let is_better = |one: &Verdict, other: &Verdict| rank(one) < rank(other);
        let mut after = leading;
        let mut choices: Vec<Choice> = Vec::new();
        for (place, bars) in [(1, bars), (1, None), (0, None), (2, None)] {
            let balance = &BALANCES[place];
            let Some(design) = self.best_of(archive, cost, balance, bars)? else { continue };
            let known = choices.iter().find(|choice| choice.design == design).map(|c| (c.objective, c.worst.clone()));
            let (value, worst) = match known {
                Some(known) => known,
                None if design == after.design => (after.objective, after.at_worst()),
                None => {
                    let verdict = self.verdict(&design)?;
                    let own = (verdict.objective, verdict.at_worst());
                    if is_better(&verdict, &after) {
                        after = verdict;
                    }
                    own
                }
            };
            choices.push(Choice { name: balance.name, design, objective: value, worst, chosen: false });
        }
        // The last choice of each balance, without bars.
        choices.reverse();
        let mut names = Vec::new();
        choices.retain(|choice| {
            let is_new = !names.contains(&choice.name);
            names.push(choice.name);
            is_new
        });
        choices.sort_by_key(|choice| BALANCES.iter().position(|balance| balance.name == choice.name));
        let own = before.design.filters.len();
        let whole = after.design.clone();
        let after = self.pruned(after, own, &|was, is| !rank(is).0 || rank(was).0)?;
        // Adopts the design without superfluous filters.
        if whole != after.design {
            choices.retain(|choice| choice.design != whole);
        }
        let choices = marked(choices, &after);
        Ok((after, choices))
    }
}

impl Work<'_> {
    /// The best design with no figure worse than before, by differential evolution in the nearest filter layouts; each
    /// round also uses the machines on which a figure was worse.
    fn kept(
        &mut self,
        finalists: &[Finalist],
        archive: &mut Vec<Tried>,
        mut watch: Watch,
        cost: Cost,
        before: &Verdict,
        mut after: Verdict,
    ) -> Result<(Verdict, Vec<Choice>)> {
        let figures = before.at_worst();
        let bars = Some(Bars { figures: &figures, steep: HARD });
        let weighed = Weighed { cost, bars };
        let mut latest = after.clone();
        // This search gets the budget once more.
        self.grant(1.0);
        for round in 0..KEPT {
            if (self.stop)() || self.is_spent() {
                break;
            }
            watch.join(&latest.worse_on(before, self.stages.len()));
            for layout in self.nearest(archive, &weighed) {
                self.again(archive, layout, &watch, &weighed);
                match round < NEARBY {
                    true => self.onward(finalists, Some(layout), &watch, &weighed, archive)?,
                    false => self.evolved(finalists, (layout, WIDE), &watch, &weighed, archive)?,
                }
            }
            let Some(design) = self.best_of(archive, cost, &BALANCES[1], bars)? else { break };
            if design == latest.design && round >= NEARBY {
                break;
            }
            latest = self.verdict(&design)?;
            let rank = |verdict: &Verdict| (compare(before, verdict) == Judgement::Worse, verdict.objective);
            if rank(&latest) < rank(&after) {
                after = latest.clone();
            }
            if compare(before, &after) != Judgement::Worse {
                break;
            }
        }
        self.chosen(archive, cost, before, after)
    }
}

/// Advice for a PID controller without derivative whose gains do not suffice.
fn without_derivative(case: &Case, design: &Design) -> Option<String> {
    if !design.structure.tunable().lacks_damping() {
        return None;
    }
    let such_as = case.suggested_derivative(design);
    Some(format!("add a derivative to controller.pid, for example {such_as}: nothing else damps this loop"))
}

impl Work<'_> {
    /// If gains are worse by hunting alone, the same gains with less integral action, if no figure is worse with them.
    fn calmer(&mut self, before: &Verdict, after: Verdict) -> Result<Verdict> {
        let is_calm = worse(before, &after).is_none_or(|worse| worse.figure != Figure::Hunting);
        let mut factor = CALMER;
        while !is_calm && factor >= CALMEST && !(self.stop)() {
            let Some(design) = hunting::integral_times(&after.design, factor) else { break };
            let design = gains::rounded(&design);
            if !self.passes(&design)? {
                let verdict = self.verdict(&design)?;
                if compare(before, &verdict) != Judgement::Worse {
                    return Ok(verdict);
                }
            }
            factor *= CALMER;
        }
        Ok(after)
    }
}

/// The choices with the selected one marked, which gets its own row if it is none of them.
fn marked(mut choices: Vec<Choice>, after: &Verdict) -> Vec<Choice> {
    for choice in &mut choices {
        choice.chosen = choice.design == after.design;
    }
    choices.retain(|choice| choice.chosen || choice.name != CHOSEN);
    if !choices.is_empty() && choices.iter().all(|choice| !choice.chosen) {
        let (design, worst) = (after.design.clone(), after.at_worst());
        choices.push(Choice { name: CHOSEN, design, objective: after.objective, worst, chosen: true });
    }
    choices
}

/// The complete result, with the limit that forces it to be worse, if any.
fn ended(
    work: &Work,
    before: Verdict,
    (after, forced): (Verdict, Option<Forced>),
    choices: Vec<Choice>,
    placed: Option<f64>,
) -> Result<Tuned> {
    let judgement = compare(&before, &after);
    let reason = || forced_by_file(work.family, &before, work.tuning, placed);
    let forced = forced.or_else(|| (judgement == Judgement::Worse).then(reason));
    let least = if judgement == Judgement::Worse { work.least(&before) } else { None };
    let before = work.watched(before)?;
    let after = if before.design == after.design { before.clone() } else { work.watched(after)? };
    let belt = &work.case.machine.belt;
    let modes = work.modes().map(|(modes, _)| modes).unwrap_or_default();
    let is_undamped = belt.model != BeltModel::Rigid && belt.damping.iter().all(|damping| *damping == 0.0);
    let advice = (judgement == Judgement::Worse).then(|| without_derivative(work.case, &before.design)).flatten();
    let limits = [work.tuning.sensitivity, work.tuning.complementary];
    let certificate = Certificate::new(work.family, &after.design, limits, work.stop)?;
    Ok(Tuned {
        judgement,
        advice,
        ahead: None,
        forced,
        least,
        choices,
        placed,
        family: work.family.clone(),
        moves: work.moves.to_vec(),
        holds: work.excess(&after.worst) <= 1.0,
        work: (work.rounds, work.tried),
        samples: work.spent.get(),
        undamped: modes.first().copied().filter(|_| is_undamped),
        modes,
        before,
        after,
        searched: true,
        certificate,
    })
}

impl Tuned {
    /// Gains before and after, by key; the same unit.
    pub fn changes(&self) -> Vec<(Gain, f64)> {
        let after = gains(&self.after.design, &self.family.machine);
        let now = |key: &str| after.iter().find(|gain| gain.key == key).map_or(0.0, |gain| gain.value);
        gains(&self.before.design, &self.family.machine).into_iter().map(|gain| (gain.clone(), now(gain.key))).collect()
    }

    /// Filters of the command in the notation of the case file, before and after, if they differ.
    pub fn filters(&self) -> Option<[String; 2]> {
        let [before, after] = [&self.before, &self.after].map(|verdict| &verdict.design.filters);
        (before != after).then(|| [before, after].map(|filters| gains::filters_text(filters)))
    }

    /// The case text with the tuned gains, comments unchanged; `name` is used in messages.
    pub fn case_text(&self, case: &Case, name: &Path) -> Result<String> {
        let mut changes: Vec<String> =
            self.changes().into_iter().map(|(gain, value)| format!("{}={value} {}", gain.key, gain.unit)).collect();
        if let Some([_, after]) = self.filters() {
            changes.push(format!("controller.filters={after}"));
        }
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let read = Case::from_text_for(name, &case.text, &changes, Files::Nothing)?;
        match read.controller.as_ref() == Some(&self.after.design) {
            true => Ok(read.text),
            false => Err(Error::new("the tuned gains do not read back as they were written").in_file(name)),
        }
    }
}
