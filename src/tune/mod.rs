//! Gains for a structure: from bandwidth and damping, then by a search that makes a cost small while the sensitivity of the sampled loop
//! stays within its limits on the worst axis that parameters, loads and places along the travel can make.
//!
//! The recipe is [`tune`]. What it finds is rounded to four digits, and everything it says holds for the rounded gains.

mod family;
mod gains;
mod hunting;
mod margins;
mod placement;
mod search;

pub use family::{Corner, Family, SPREAD, Source, Unknown};
pub use gains::{Gain, gains};
pub use hunting::{Hunt, hunting};
pub use margins::{Margins, Open, Plant, loops};
pub use placement::{first, place};
pub use search::{Found, minimise};

use crate::case::{Case, Cost, Move, Tuning};
use crate::control::feedback::Feedback;
use crate::control::{Deviation, Setup, closed_loop, tracking};
use crate::design::Design;
use crate::error::{Error, Result};
use crate::linear::{Operation, travel};
use crate::solve::{Ending, Solver};
use crate::stage::Stage;
use std::path::Path;

/// Rounds of search, each with the worst axis for the gains of the one before.
const ROUNDS: usize = 6;

/// Values that a round may ask for.
const VALUES: usize = 160;

/// Share of the limits that a search keeps to, so that rounding does not pass them.
const WITHIN: f64 = 0.995;

/// What a tuning found.
#[derive(Debug, Clone)]
pub struct Tuned {
    /// The loop as the file has it.
    pub before: Verdict,
    /// As it was tuned.
    pub after: Verdict,
    /// Bandwidth that the search began with, Hz; none where it began with weights.
    pub placed: Option<f64>,
    /// The axes that were looked at.
    pub family: Family,
    /// Whether the limits of sensitivity hold on the worst of them.
    pub holds: bool,
    /// Rounds, and designs that were tried.
    pub work: (usize, usize),
}

/// What a controller does on the axis and on the worst of its family.
#[derive(Debug, Clone)]
pub struct Verdict {
    /// The controller.
    pub design: Design,
    /// Its margins on the axis as it is taken for.
    pub nominal: Margins,
    /// The axis on which its sensitivity is furthest beyond its limits, or nearest to them.
    pub corner: Corner,
    /// The margins there.
    pub worst: Margins,
    /// Its moves.
    pub moves: Vec<MoveVerdict>,
    /// Its limit cycle at rest, if there is one.
    pub hunt: Option<Hunt>,
}

/// What a controller does in a move.
#[derive(Debug, Clone, PartialEq)]
pub struct MoveVerdict {
    /// Its name.
    pub name: String,
    /// x − y on the axis as it is taken for.
    pub cart: Deviation,
    /// Until the cart settles, s, if it does.
    pub settling: Option<f64>,
    /// Largest |x − y| on any of the axes with one thing off, with a load, or at the worst corner, m; and which.
    pub worst: (f64, String),
    /// Axes on which it settles, and all of them.
    pub settled: (usize, usize),
}

/// Tunes the controller of a case; `stop` is asked now and then, and ends a search early with the best so far.
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
    let design = case.controller.as_ref().ok_or_else(|| {
        Error::new("this case has no controller to tune")
            .next("add [controller] with every and for example pid = { proportional = \"2 V/mm\" }")
    })?;
    Feedback::new(design, &case.stage)?;
    let mut tuning = tuning.clone();
    if case.moves.is_empty() && tuning.cost.is_some() {
        tuning.cost = Some(Cost::Bandwidth);
    }
    let family = Family::of(case, &tuning)?;
    let mut work = Work { case, family: &family, tuning: &tuning, set: Vec::new(), axes: Vec::new(), tried: 0, stop };
    let before = work.verdict(design)?;
    let (start, placed) = work.start(design)?;
    let (found, rounds) = match tuning.cost {
        Some(cost) => work.search(start, cost)?,
        None => (gains::rounded(&start), 0),
    };
    let after = work.verdict(&found)?;
    let holds = after.worst.excess(tuning.sensitivity, tuning.complementary) <= 1.0;
    let work = (rounds, work.tried);
    Ok(Tuned { before, after, placed, holds, work, family })
}

impl Tuned {
    /// Gains before and after, by key; the same unit.
    pub fn changes(&self) -> Vec<(Gain, f64)> {
        let after = gains(&self.after.design, &self.family.stage);
        let now = |key: &str| after.iter().find(|gain| gain.key == key).map_or(0.0, |gain| gain.value);
        gains(&self.before.design, &self.family.stage).into_iter().map(|gain| (gain.clone(), now(gain.key))).collect()
    }

    /// The text of the case with the tuned gains, its remarks left alone; `name` stands in messages.
    pub fn case_text(&self, case: &Case, name: &Path) -> Result<String> {
        let changes: Vec<String> =
            self.changes().into_iter().map(|(gain, value)| format!("{}={value} {}", gain.key, gain.unit)).collect();
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        Ok(Case::from_text_with(name, &case.text, &changes)?.text)
    }
}

/// A tuning on its way.
struct Work<'a> {
    case: &'a Case,
    family: &'a Family,
    tuning: &'a Tuning,
    /// Axes on which the limits have to hold while searching.
    set: Vec<Plant>,
    /// Axes that moves are run on.
    axes: Vec<Stage>,
    tried: usize,
    stop: &'a dyn Fn() -> bool,
}

impl Work<'_> {
    fn feedback(&self, design: &Design) -> Result<Feedback> {
        Feedback::new(design, &self.case.stage)
    }

    fn excess(&self, margins: &Margins) -> f64 {
        margins.excess(self.tuning.sensitivity, self.tuning.complementary)
    }

    /// The worst corner for a design, and its margins.
    fn worst(&self, design: &Design) -> Result<(Corner, Margins)> {
        self.family.worst(design, &self.feedback(design)?, &|margins| self.excess(margins))
    }

    /// Largest share of the limits on the axes of the search.
    fn on_set(&self, feedback: &Feedback) -> f64 {
        self.set.iter().map(|plant| self.excess(&Margins::of(plant, feedback))).fold(0.0, f64::max)
    }

    /// Gains to begin with, which keep the limits where there is a search to follow.
    fn start(&mut self, design: &Design) -> Result<(Design, Option<f64>)> {
        let nominal = self.family.nominal();
        let corners = self.feedback(design)?.corners();
        for &place in [self.family.places.first(), self.family.places.last()].into_iter().flatten() {
            for &load in &self.family.loads {
                let corner = Corner { place, load, ..nominal.clone() };
                self.set.push(self.family.plant(&corner, design, &corners)?);
            }
        }
        let mut stage = self.case.stage.clone();
        stage.belt.follows_cart |= stage.belt.make.is_some();
        let swings = travel(&stage, Operation::default(), &self.family.places)?;
        let swing = swings.iter().filter_map(|place| place.undamped_antiresonances.first().copied()).reduce(f64::min);
        let mut bandwidth = self.tuning.bandwidth.unwrap_or(first(design, swing));
        let placed = |bandwidth: f64| place(design, &self.case.stage, bandwidth, self.tuning.damping);
        let asked = bandwidth;
        if self.tuning.cost.is_none() {
            return Ok((placed(bandwidth).unwrap_or(design.clone()), Some(bandwidth)));
        }
        loop {
            // Weights that count less make a softer loop.
            let soft = bandwidth / asked;
            let weights = || gains::softer(design, &self.case.stage, soft);
            let trial = placed(bandwidth).unwrap_or_else(weights);
            self.tried += 1;
            let fits = match self.feedback(&trial) {
                Ok(feedback) if self.on_set(&feedback) <= WITHIN => {
                    let (corner, margins) = self.worst(&trial)?;
                    let fits = self.excess(&margins) <= 1.0;
                    if !fits {
                        self.set.push(self.family.plant(&corner, design, &corners)?);
                    }
                    fits
                }
                Ok(_) => false,
                // At first the weights of the file: what is wrong with them is to be told.
                Err(error) if soft == 1.0 => return Err(error),
                Err(_) => false,
            };
            if fits {
                let bandwidth = placed(bandwidth).map(|_| bandwidth);
                return Ok((trial, bandwidth));
            }
            bandwidth *= 0.85;
            if bandwidth < 1e-4 * asked || (self.stop)() {
                return Err(Error::new(format!(
                    "no gains of this structure keep Ms within {} and Mt within {} on every axis",
                    self.tuning.sensitivity, self.tuning.complementary
                ))
                .next("allow a larger tune.sensitivity and tune.complementary, a smaller spread, or give it another structure"));
            }
        }
    }

    /// Makes the cost small from gains that keep the limits; returns what keeps them too, and the rounds.
    fn search(&mut self, start: Design, cost: Cost) -> Result<(Design, usize)> {
        self.axes = self.run_axes(&start)?;
        let corners = self.feedback(&start)?.corners();
        let dimension = gains(&start, &self.case.stage).iter().filter(|gain| gain.searched).count();
        let (mut x, mut safe) = (vec![0.0; dimension], vec![0.0; dimension]);
        let mut rounds = 0;
        let keeps = |work: &Self, x: &[f64]| -> Result<Option<Corner>> {
            let (corner, margins) = work.worst(&gains::rounded(&gains::scaled(&start, x)))?;
            Ok((work.excess(&margins) > 1.0).then_some(corner))
        };
        while rounds < ROUNDS && !(self.stop)() {
            rounds += 1;
            if rounds == 1 {
                x = self.scan(&start, dimension, cost);
            }
            // Again from where it ended, with a smaller simplex: it may have collapsed at a limit.
            for (step, most) in [(0.3, VALUES), (0.1, VALUES / 2)] {
                let mut value = |x: &[f64]| self.value(&gains::scaled(&start, x), cost);
                x = minimise(&x, step, 1e-3, most, &mut value).x;
            }
            match keeps(self, &x)? {
                None => {
                    safe = x;
                    break;
                }
                Some(corner) => self.set.push(self.family.plant(&corner, &start, &corners)?),
            }
            if rounds == ROUNDS {
                // As far towards it as the limits allow.
                let (mut near, mut far) = (0.0, 1.0);
                for _ in 0..8 {
                    let part = 0.5 * (near + far);
                    let between: Vec<f64> = x.iter().map(|x| part * x).collect();
                    if keeps(self, &between)?.is_none() {
                        near = part;
                    } else {
                        far = part;
                    }
                }
                safe = x.iter().map(|x| near * x).collect();
            }
        }
        Ok((gains::rounded(&gains::scaled(&start, &safe)), rounds))
    }

    /// The best of a coarse grid about `start`: a simplex that runs into a limit goes no further along it.
    fn scan(&mut self, start: &Design, dimension: usize, cost: Cost) -> Vec<f64> {
        let steps = [-0.6, 0.0, 0.6];
        let point = |number: usize| (0..dimension).map(|j| steps[number / 3usize.pow(j as u32) % 3]).collect();
        let points = (0..3usize.pow(dimension as u32)).map(point);
        let valued = points.map(|x: Vec<f64>| (self.value(&gains::scaled(start, &x), cost), x)).collect::<Vec<_>>();
        let best = valued.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        best.map_or(vec![0.0; dimension], |(_, x)| x)
    }

    /// What the search makes small: the logarithm of the cost, and what goes beyond the limits.
    fn value(&mut self, design: &Design, cost: Cost) -> f64 {
        if (self.stop)() {
            return f64::INFINITY;
        }
        self.tried += 1;
        let Ok(feedback) = self.feedback(design) else { return f64::INFINITY };
        let beyond = (self.on_set(&feedback) / WITHIN - 1.0).max(0.0);
        if beyond > 0.3 {
            // Too far for moves to say anything.
            return 1e3 + beyond.min(1e6);
        }
        let cost = match cost {
            Cost::Bandwidth => {
                let least = |plant: &Plant| Margins::of(plant, &feedback).bandwidth;
                1.0 / self.set.iter().map(least).fold(f64::INFINITY, f64::min)
            }
            cost => self.axes.iter().map(|axis| self.error(axis, design, cost)).fold(0.0, f64::max),
        };
        // Steep enough that no cost is worth it.
        let value = cost.ln() + 30.0 * beyond;
        if value.is_nan() { f64::INFINITY } else { value }
    }

    /// The cart's error over all moves on an axis, m.
    fn error(&self, axis: &Stage, design: &Design, cost: Cost) -> f64 {
        let (mut peak, mut squares, mut time) = (0.0_f64, 0.0, 0.0);
        for motion in &self.case.moves {
            let Ok((Ending::Complete, cart)) = tracking(&self.setup(axis, design, motion)) else {
                return f64::INFINITY;
            };
            peak = peak.max(cart.peak.value.abs());
            squares += cart.rms.powi(2) * motion.until;
            time += motion.until;
        }
        if cost == Cost::Peak { peak } else { (squares / time).sqrt() }
    }

    fn setup<'s>(&'s self, stage: &'s Stage, design: &'s Design, motion: &'s Move) -> Setup<'s> {
        let (until, window, solver) = (motion.until, motion.window, Solver::of(stage));
        Setup { stage, model: &self.case.stage, design, profile: &motion.profile, until, window, solver }
    }

    /// The axes that moves are run on while searching: each load, and the one with a single thing off that is worst for `design`.
    fn run_axes(&self, design: &Design) -> Result<Vec<Stage>> {
        let singles = self.family.singles();
        let (loads, others) = singles.split_at(self.family.loads.len());
        let mut axes: Vec<Stage> = loads.iter().map(|corner| self.family.stage_at(corner)).collect();
        let errors = others.iter().map(|corner| {
            let stage = self.family.stage_at(corner);
            let error = self.error(&stage, design, Cost::Squares);
            (stage, error)
        });
        axes.extend(errors.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(stage, _)| stage));
        Ok(axes)
    }

    /// What a design does.
    fn verdict(&self, design: &Design) -> Result<Verdict> {
        let feedback = self.feedback(design)?;
        let nominal = Margins::of(&self.family.plant(&self.family.nominal(), design, &feedback.corners())?, &feedback);
        let (corner, worst) = self.worst(design)?;
        let mut axes = self.family.singles();
        axes.push(corner.clone());
        let mut moves = Vec::new();
        for motion in &self.case.moves {
            let own = closed_loop(&self.setup(&self.case.stage, design, motion))?;
            let mut most = (own.figures.cart.peak.value.abs(), "as the file has it".to_string());
            let mut settled = 0;
            for corner in &axes {
                let run = closed_loop(&self.setup(&self.family.stage_at(corner), design, motion))?;
                let complete = run.outcome.ending == Ending::Complete;
                settled += usize::from(complete && run.figures.settling.is_some());
                let error = if complete { run.figures.cart.peak.value.abs() } else { f64::INFINITY };
                if error > most.0 {
                    most = (error, self.family.words(corner));
                }
            }
            moves.push(MoveVerdict {
                name: motion.name.clone(),
                cart: own.figures.cart,
                settling: own.figures.settling.filter(|_| own.outcome.ending == Ending::Complete),
                worst: most,
                settled: (settled, axes.len()),
            });
        }
        let hunt = if nominal.stable { hunting(&self.case.stage, design)? } else { None };
        Ok(Verdict { design: design.clone(), nominal, corner, worst, moves, hunt })
    }
}
