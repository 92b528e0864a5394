//! The search: many designs by the response to steps of command and reference within the limits, without runs; the best
//! of them by moves.

use super::family::{Family, modes_along};
use super::gains::{self, rounded, searched, shaped};
use super::hunting::Observed;
use super::judged::Verdict;
use super::margins::{Margins, Peaks, Rough};
use super::objective::path;
use super::plant::Plant;
use super::rules::{layouts, starts};
use crate::case::{Case, Move, Tuning};
use crate::control::SampledPath;
use crate::control::feedback::Feedback;
use crate::design::Design;
use crate::error::Result;
use crate::machine::Machine;
use std::cell::{Cell, RefCell};
use std::f64::consts::PI;

/// Fraction of the limits for a search on the grid; the rest covers maxima between its points and rounding.
pub(super) const WITHIN: f64 = 0.98;

/// Number of designs evaluated by moves as starts of the search.
pub(super) const FINALISTS: usize = 3;

/// Least relative reduction of the cost by added filters.
const PAYS: f64 = 0.02;

/// Step in the logarithm of a single gain of the file that is changed until the limits hold, and the maximum number of
/// steps.
const ALONE: f64 = 0.25;
const ALONE_STEPS: u8 = 16;

/// Weight of an excess over a limit in ln J.
pub(super) const STEEP: f64 = 30.0;

/// A tuning in progress.
pub(super) struct Work<'a> {
    pub case: &'a Case,
    pub family: &'a Family,
    pub tuning: &'a Tuning,
    pub moves: &'a [Move],
    /// I₀ of each move, A.
    pub asked: Vec<f64>,
    /// The paths of the shaped moves; a search does not change the shaper.
    pub paths: Vec<SampledPath>,
    /// All machines of the family, steppers without microsteps, and their frequency responses for a controller.
    pub stages: Vec<Machine>,
    pub plants: Vec<Plant>,
    /// Machines on which the limits have to hold during the search.
    set: Vec<usize>,
    /// Responses of a corner outside the list of machines.
    more: Vec<Plant>,
    pub tried: usize,
    pub rounds: usize,
    /// Simulated samples of moves, and the budget of a search.
    pub spent: Cell<u64>,
    pub most: u64,
    /// The least worst-case current of each move so far, A.
    pub least: RefCell<Vec<f64>>,
    /// Computed verdicts.
    pub known: RefCell<Vec<Verdict>>,
    /// Designs whose limit cycle was looked for, with what was observed.
    pub hunts: RefCell<Vec<(Design, Option<Observed>)>>,
    pub stop: &'a dyn Fn() -> bool,
}

/// A design found that keeps the limits.
#[derive(Debug, Clone)]
pub(super) struct Finalist {
    pub design: Design,
    /// The design that it was made from, the number of its filters, and its powers.
    pub start: Design,
    pub own: usize,
    pub powers: Vec<f64>,
    /// Powers of other designs of its layout that moves may prefer.
    pub others: Vec<Vec<f64>>,
    /// ln of the step response cost.
    pub value: f64,
}

impl Finalist {
    /// A design unchanged, with `own` filters that are not searched.
    pub fn at(design: &Design, own: usize) -> Self {
        let powers = vec![0.0; searched(design, own)];
        Self { design: design.clone(), start: design.clone(), own, powers, others: Vec::new(), value: f64::INFINITY }
    }
}

impl<'a> Work<'a> {
    pub fn new(
        case: &'a Case,
        family: &'a Family,
        tuning: &'a Tuning,
        moves: &'a [Move],
        design: &Design,
        stop: &'a dyn Fn() -> bool,
    ) -> Result<Self> {
        let corners = Feedback::new(design, &case.machine)?.corners();
        let plant = |corner| family.plant(corner, design, &corners);
        let plants = family.machines.iter().map(plant).collect::<Result<Vec<_>>>()?;
        let asked = moves.iter().map(|motion| super::moves::asked(&case.machine, motion)).collect();
        Ok(Self {
            case,
            family,
            tuning,
            moves,
            asked,
            paths: moves.iter().map(|motion| path(motion, design)).collect(),
            stages: family.machines.iter().map(|machine| family.stage_at(machine).interpolating()).collect(),
            plants,
            set: vec![0],
            more: Vec::new(),
            tried: 0,
            rounds: 0,
            spent: Cell::new(0),
            most: 0,
            least: RefCell::new(vec![0.0; moves.len()]),
            known: RefCell::default(),
            hunts: RefCell::default(),
            stop,
        })
    }

    pub fn feedback(&self, design: &Design) -> Result<Feedback> {
        Feedback::new(design, &self.case.machine)
    }

    pub fn excess(&self, margins: &Margins) -> f64 {
        margins.excess(self.tuning.sensitivity, self.tuning.complementary)
    }

    /// The worst machine for a design, without the excluded ones, its excess over the limits, and the number of
    /// unstable machines.
    pub fn worst(&self, feedback: &Feedback) -> (usize, f64, usize) {
        let (ms, mt) = (self.tuning.sensitivity, self.tuning.complementary);
        let peaks = self.plants.iter().map(|plant| Peaks::new(plant, feedback));
        let mut all: Vec<(usize, f64)> = peaks.map(|peaks| peaks.excess(ms, mt)).enumerate().collect();
        let unstable = all.iter().filter(|(_, excess)| excess.is_infinite()).count();
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        let (place, excess) = all[self.family.left_out(all.len())];
        (place, excess, unstable)
    }

    /// Each margin of a controller at its worst: without the excluded machines, and on the worst corner, if that is
    /// known.
    pub fn margins_at_worst(&self, feedback: &Feedback, corner: Option<Margins>) -> Option<Margins> {
        let all: Vec<Margins> = self.plants.iter().map(|plant| Margins::new(plant, feedback)).collect();
        let drawn = Margins::at_worst(&all, self.family.left_out(all.len()))?;
        Margins::at_worst(&[Some(drawn), corner].into_iter().flatten().collect::<Vec<_>>(), 0)
    }

    /// True if a design exceeds a limit on some machine; the worst one then joins the set.
    pub fn passes(&mut self, design: &Design) -> Result<bool> {
        let feedback = self.feedback(design)?;
        let (place, excess, _) = self.worst(&feedback);
        if excess > 1.0 {
            if !self.set.contains(&place) {
                self.set.push(place);
            }
            return Ok(true);
        }
        if self.family.corners {
            let (corner, margins) = self.family.worst(design, &feedback, &|margins| self.excess(margins))?;
            if self.excess(&margins) > 1.0 {
                self.more.push(self.family.plant(&corner, design, &feedback.corners())?);
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Excess of a design over the limits on the set, and its worst-case response to steps of command and reference.
    pub(crate) fn on_set(&mut self, design: &Design) -> (f64, f64) {
        self.tried += 1;
        let Ok(feedback) = self.feedback(design) else { return (f64::INFINITY, f64::INFINITY) };
        let (mut most, mut slow) = (0.0_f64, 0.0_f64);
        for plant in self.on_set_plants() {
            let rough = Rough::new(plant, &feedback);
            most = most.max(rough.peaks.excess(self.tuning.sensitivity, self.tuning.complementary));
            slow = slow.max(rough.disturbance * rough.following);
        }
        ((most / WITHIN - 1.0).max(0.0), slow)
    }

    /// Frequency responses of the machines on which the limits have to hold, those that joined last first.
    pub(super) fn on_set_plants(&self) -> impl Iterator<Item = &Plant> {
        self.more.iter().rev().chain(self.set.iter().rev().map(|&place| &self.plants[place]))
    }

    /// Modes excited by a command, each at the middle of its range along the travel, Hz; and the first anti-resonance.
    pub fn modes(&self) -> Result<(Vec<f64>, Option<f64>)> {
        let places = modes_along(&self.case.machine, self.family.nominal().bridge, &self.family.places)?;
        let swing = places.iter().filter_map(|place| place.undamped_antiresonances.first().copied()).reduce(f64::min);
        let most = 0.4 / self.design().every;
        let mut modes = Vec::new();
        for number in 0.. {
            let all: Vec<f64> =
                places.iter().filter_map(|place| place.undamped_resonances.get(number).copied()).collect();
            let (Some(low), Some(high)) = (all.iter().copied().reduce(f64::min), all.iter().copied().reduce(f64::max))
            else {
                break;
            };
            let middle = (low * high).sqrt();
            if middle < most {
                modes.push(middle);
            }
        }
        Ok((modes, swing))
    }

    fn design(&self) -> &Design {
        self.case.controller.as_ref().expect("a tuning has a controller")
    }

    /// The best designs without a run, in order: for each filter layout the best of its starts.
    pub fn screened(&mut self, given: &Design, is_given_good: bool) -> Result<(Vec<Finalist>, Option<f64>)> {
        let (modes, swing) = self.modes()?;
        let mut found: Vec<Finalist> = Vec::new();
        let mut placed = None;
        for layout in layouts(given, &modes) {
            let mut best: Option<(f64, Design)> = None;
            let mut all = starts(&layout, &self.case.machine, swing, self.tuning.bandwidth, self.tuning.damping);
            all.push((layout.clone(), None));
            // Also starts from the best gains with fewer filters.
            let least = found.iter().min_by(|a, b| a.value.total_cmp(&b.value));
            all.extend(least.map(|one| (Design { structure: one.design.structure.clone(), ..layout.clone() }, None)));
            for (start, hertz) in all {
                let Some((design, factor)) = self.softened(&start, layout.filters.len())? else { continue };
                let value = self.on_set(&design).1.ln();
                placed = placed.or(hertz.map(|hertz| hertz * factor));
                if best.as_ref().is_none_or(|(least, _)| value < *least) {
                    best = Some((value, design));
                }
                if (self.stop)() {
                    break;
                }
            }
            if let Some((_, start)) = best {
                found.push(self.improved(start, given.filters.len())?);
            }
            if (self.stop)() && !found.is_empty() {
                break;
            }
        }
        // Filters are kept if they reduce the cost.
        let plain = found.iter().find(|one| one.design.filters.len() == given.filters.len()).map(|one| one.value);
        if let Some(plain) = plain {
            let pays = |one: &Finalist| one.design.filters.len() == given.filters.len() || one.value < plain - PAYS;
            found.retain(pays);
        }
        found.sort_by(|a, b| a.value.total_cmp(&b.value));
        found.truncate(FINALISTS);
        let mut found = self.widened(found)?;
        found.sort_by(|a, b| a.value.total_cmp(&b.value));
        found.extend(self.of_file(given, is_given_good)?);
        Ok((found, placed))
    }

    /// The gains of the file; if they violate the limits, all slowed down until they hold, and each gain changed alone.
    fn of_file(&mut self, given: &Design, is_good: bool) -> Result<Vec<Finalist>> {
        let own = given.filters.len();
        let mut found = Vec::new();
        let together = if is_good { Some(given.clone()) } else { self.softened(given, own)?.map(|(design, _)| design) };
        if let Some(design) = together {
            let value = self.on_set(&design).1.ln();
            found.push(Finalist { value, ..Finalist::at(&design, own) });
        }
        if is_good {
            return Ok(found);
        }
        let slowing = slowing(given, own, &self.case.machine);
        for (j, power) in slowing.iter().enumerate() {
            // For a slower loop, weights of state feedback grow and gains decrease.
            let step = if *power < 0.0 { ALONE } else { -ALONE };
            for count in 1..=ALONE_STEPS {
                let powers: Vec<f64> =
                    (0..slowing.len()).map(|k| if k == j { step * f64::from(count) } else { 0.0 }).collect();
                let design = rounded(&shaped(given, own, &powers));
                let (beyond, slow) = self.on_set(&design);
                if beyond == 0.0 && !self.passes(&design)? {
                    let value = slow.ln();
                    found.push(Finalist { design, powers, value, ..Finalist::at(given, own) });
                    break;
                }
                if (self.stop)() {
                    return Ok(found);
                }
            }
        }
        Ok(found)
    }

    /// A start slowed down until it keeps the limits on all machines, and the factor on its speed.
    fn softened(&mut self, start: &Design, own: usize) -> Result<Option<(Design, f64)>> {
        let mut factor = 1.0;
        while factor > 1e-3 && !(self.stop)() {
            let design = rounded(&slower(start, own, &self.case.machine, factor));
            if self.on_set(&design).0 == 0.0 && !self.passes(&design)? {
                return Ok(Some((design, factor)));
            }
            factor *= 0.8;
        }
        Ok(None)
    }

    /// Moves from a design that keeps the limits towards one that does not, as far as they allow.
    pub fn pulled(&mut self, start: &Design, own: usize, from: &[f64], to: &[f64]) -> Result<Vec<f64>> {
        let between = |part: f64| -> Vec<f64> { from.iter().zip(to).map(|(a, b)| a + part * (b - a)).collect() };
        let (mut near, mut far) = (0.0, 1.0);
        for _ in 0..7 {
            let part = 0.5 * (near + far);
            if self.passes(&rounded(&shaped(start, own, &between(part))))? { far = part } else { near = part }
        }
        Ok(between(near))
    }

    /// A design without added filters, from number `own` on, that are not needed for the limits and do not improve it;
    /// `is_as_good` compares before and after.
    pub(crate) fn pruned(
        &mut self,
        mut verdict: Verdict,
        own: usize,
        is_as_good: &dyn Fn(&Verdict, &Verdict) -> bool,
    ) -> Result<Verdict> {
        for place in (own..verdict.design.filters.len()).rev() {
            if (self.stop)() {
                break;
            }
            let mut design = verdict.design.clone();
            design.filters.remove(place);
            if self.passes(&design)? {
                continue;
            }
            let other = self.verdict_below(&design, verdict.objective + PAYS, &verdict.badness())?;
            if let Some(other) = other.filter(|other| is_as_good(&verdict, other)) {
                verdict = other;
            }
        }
        Ok(verdict)
    }
}

/// A design with a loop slower by this factor.
fn slower(design: &Design, own: usize, stage: &Machine, factor: f64) -> Design {
    if factor == 1.0 {
        return design.clone();
    }
    let powers: Vec<f64> = slowing(design, own, stage).iter().map(|power| power * factor.ln()).collect();
    shaped(design, own, &powers)
}

/// Exponents of the loop speed for each gain, and each number of filters from number `own` on: time scaling for a PID
/// or a cascade, weights for state feedback.
pub(super) fn slowing(design: &Design, own: usize, stage: &Machine) -> Vec<f64> {
    let power = |key: &str| match key {
        "controller.pid.proportional" => 2.0,
        "controller.pid.integral" => 3.0,
        "controller.pid.derivative" | "controller.cascade.position" | "controller.cascade.speed" => 1.0,
        "controller.cascade.speed_integral" => 2.0,
        "controller.cascade.current.proportional" | "controller.cascade.current.integral" => 0.5,
        // About the square root of the bandwidth; a higher power for the integral, which contains a time.
        key if key.ends_with(".integral") => -2.0,
        "controller.state_feedback.position" | "controller.state_feedback.speed" => -1.0,
        _ => 0.0,
    };
    let gains = gains::gains(design, stage).into_iter().filter(|gain| gain.searched);
    let mut all: Vec<f64> = gains.map(|gain| power(gain.key)).collect();
    all.resize(searched(design, own), 0.0);
    all
}

/// Frequency of a peak in Hz: that of the mode within a fifth of it, or its own.
pub(super) fn mode_at(omega: f64, modes: &[f64]) -> f64 {
    let hertz = omega / (2.0 * PI);
    let near = modes.iter().copied().min_by(|a, b| (a / hertz).ln().abs().total_cmp(&(b / hertz).ln().abs()));
    near.filter(|mode| (mode / hertz).ln().abs() < 0.2).unwrap_or(hertz)
}
