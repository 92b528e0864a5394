//! A certificate of robustness: limits of |S| and |T| proven for every machine of a box of parameters, not for drawn
//! ones; and a machine outside of that box that violates them.
//!
//! The box has the half-widths of a family times a factor, and all its positions and loads. Its transfer functions are
//! polynomials in the parameters (`axis.rs`); their values over a part of the box and an interval of frequencies are
//! enclosed (`cells.rs`, `forms.rs`), and box and frequencies are divided until the limits hold everywhere, or the
//! budget is spent. If the closed loop of one machine of the box is stable and no machine has a pole on the unit
//! circle, all are stable.

mod axis;
mod cells;
mod forms;
mod jet;
mod tensor;

use super::family::{Corner, Family};
use super::loops::breaks;
use super::margins::{Margins, Peaks};
use crate::control::feedback::Feedback;
use crate::design::Design;
use crate::error::Result;
use axis::Axis;
use cells::{CellResult, Question, Table};
use tensor::Tensor;

/// Budget of one proof, in nodes of polynomials that are evaluated, and largest number of proofs.
const BUDGET: usize = 3_000_000;
const PROOFS: usize = 6;

/// First factor that is tried relative to the smallest known violation, and the accuracy of the factor.
const FIRST: f64 = 0.92;
const CLOSE: f64 = 0.02;

/// Factor on the largest uncertified factor if none is certified yet.
const FALLING: f64 = 0.4;

/// End of the first interval of frequencies relative to half the sampling rate; largest ratio and largest difference
/// of the ends of the others.
const LOWEST: f64 = 1e-4;
const RATIO: f64 = 1.33;
const WIDEST: f64 = 0.04;

/// Narrowest interval, relative to its end.
const NARROW: f64 = 1e-7;

/// Rounds of the search for the nearest violation, and steps of a bisection.
const ROUNDS: usize = 4;
const STEPS: usize = 12;

/// A guarantee on a loop over a box of machines.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Certificate {
    /// Certified part of the half-widths of the family: 1 for the whole family, 0 if nothing is certified.
    pub factor: f64,
    /// Upper bounds of M_s and M_t over the whole family, if it is certified.
    pub bounds: Option<[f64; 2]>,
    /// The machine nearest to the nominal one that is known to violate a limit; none if none was found in the family.
    pub violation: Option<Violation>,
    /// Why nothing is certified.
    pub reason: Option<String>,
}

/// A machine that violates a limit.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Violation {
    /// Its largest deviation relative to the half-widths of the family.
    pub factor: f64,
    /// The machine.
    pub corner: Corner,
    /// Its margins.
    pub margins: Margins,
}

impl Certificate {
    fn none(reason: impl Into<String>) -> Self {
        Self { factor: 0.0, bounds: None, violation: None, reason: Some(reason.into()) }
    }

    /// The certificate of a controller over a family of axes, with these limits of M_s and M_t. Deterministic; `stop`
    /// ends it early.
    pub fn new(family: &Family, design: &Design, limits: [f64; 2], stop: &dyn Fn() -> bool) -> Result<Self> {
        let feedback = Feedback::new(design, &family.machine)?;
        if family.machine.stepper().is_some() {
            return Ok(Self::none("the field of a stepper is not covered"));
        }
        if family.machine.drives.len() > 1 {
            return Ok(Self::none("several drives are not covered"));
        }
        if !feedback.is_linear() {
            return Ok(Self::none("a controller that is not linear is not covered"));
        }
        let violation = Search { family, design, feedback: &feedback, limits }.nearest(stop)?;
        if let Some(violation) = violation.as_ref().filter(|violation| violation.factor == 0.0) {
            let reason = match violation.margins.stable {
                true => "the limits do not hold for the machine of the file",
                false => "the loop is not stable for the machine of the file",
            };
            return Ok(Self { violation: Some(violation.clone()), ..Self::none(reason) });
        }
        let own = Self { violation, ..Self::none("search budget exhausted") };
        let because = |reason: &str| Ok(Self { reason: Some(reason.into()), ..own.clone() });
        if feedback.uses_current() {
            return because("a controller that uses the measured current is not covered");
        }
        let axis = match Axis::new(family, design, feedback.uses_scale(), stop)? {
            Ok(axis) => axis,
            Err(reason) => return because(&reason),
        };
        let question = |limits: [f64; 2]| Question {
            axis: &axis,
            feedback: &feedback,
            breaks: breaks(&feedback),
            limits,
            every: design.every,
            delay: design.delay,
        };
        let whole = own.violation.as_ref().map_or(1.0, |violation| violation.factor);
        let (mut low, mut high) = (0.0, whole);
        let mut next = if own.violation.is_some() { FIRST * whole } else { whole };
        for _ in 0..PROOFS {
            if stop() {
                break;
            }
            match proven(&question(limits), axis.narrowed(next), stop) {
                true => low = next,
                false => high = next,
            }
            if low == whole || low > 0.0 && high - low <= CLOSE * high {
                break;
            }
            next = if low > 0.0 { 0.5 * (low + high) } else { FALLING * high };
        }
        if low == 0.0 {
            return if stop() { because("interrupted") } else { Ok(own) };
        }
        let mut bounds = None;
        if low == 1.0 {
            // The least bounds that can be shown, each alone.
            let worst = Search { family, design, feedback: &feedback, limits }.worst(1.0, &family.nominal())?;
            let worst = Margins::new(&family.plant(&worst.0, design, &feedback.corners())?, &feedback);
            let bound = |place: usize, least: f64| {
                let (mut low, mut high) = (least.max(1.0).min(limits[place]), limits[place]);
                for _ in 0..PROOFS / 2 {
                    let middle = 0.5 * (low + high);
                    let mut asked = [f64::INFINITY; 2];
                    asked[place] = middle;
                    match proven(&question(asked), axis.narrowed(1.0), stop) {
                        true => high = middle,
                        false => low = middle,
                    }
                }
                high
            };
            bounds = Some([bound(0, worst.sensitivity), bound(1, worst.complementary)]);
        }
        Ok(Self { factor: low, bounds, reason: None, ..own })
    }
}

/// Whether the limits of a question hold over the whole box of these polynomials and at all frequencies.
fn proven(question: &Question, polynomials: Tensor, stop: &dyn Fn() -> bool) -> bool {
    let mut intervals = vec![[0.0, LOWEST]];
    while let Some(&[_, low]) = intervals.last().filter(|[_, high]| *high < 1.0) {
        intervals.push([low, (RATIO * low).min(low + WIDEST).min(1.0)]);
    }
    let mut boxes = vec![(polynomials, intervals)];
    let mut budget = BUDGET;
    while let Some((polynomials, mut waiting)) = boxes.pop() {
        let table = Table::new(&polynomials, question.axis);
        let mut votes = vec![0.0; polynomials.shape.len()];
        let mut left = Vec::new();
        budget = budget.saturating_sub(polynomials.values.len() / 8);
        while let Some([low, high]) = waiting.pop() {
            if budget < table.effort() || stop() {
                return false;
            }
            budget -= table.effort();
            match question.look(&table, low, high) {
                CellResult::Holds => {}
                CellResult::Violated => return false,
                CellResult::TooLarge(parameter) => {
                    votes[parameter] += (high - low) / high;
                    left.push([low, high]);
                }
                CellResult::TooWide if high - low < NARROW * high => return false,
                CellResult::TooWide => {
                    let middle = if low > 0.0 { 0.5 * (low + high) } else { 0.125 * high };
                    waiting.extend([[low, middle], [middle, high]]);
                }
            }
        }
        if left.is_empty() {
            continue;
        }
        let most = (0..votes.len()).max_by(|&a, &b| votes[a].total_cmp(&votes[b])).unwrap_or_default();
        for side in [-0.5, 0.5] {
            let mut half = polynomials.clone();
            half.narrow(most, side, 0.5);
            boxes.push((half, left.clone()));
        }
    }
    true
}

/// A search for the nearest violation.
struct Search<'a> {
    family: &'a Family,
    design: &'a Design,
    feedback: &'a Feedback,
    limits: [f64; 2],
}

impl Search<'_> {
    /// Largest peak relative to its limit.
    fn excess(&self, corner: &Corner) -> Result<f64> {
        let plant = self.family.plant(corner, self.design, &self.feedback.corners())?;
        Ok(Peaks::new(&plant, self.feedback).excess(self.limits[0], self.limits[1]))
    }

    /// A corner whose largest deviation is `factor` instead.
    fn scaled(&self, corner: &Corner, factor: f64) -> Corner {
        let size = corner.off.iter().fold(0.0_f64, |most, off| most.max(off.abs()));
        let share = if size > 0.0 { factor / size } else { 0.0 };
        Corner { off: corner.off.iter().map(|off| off * share).collect(), ..corner.clone() }
    }

    /// The worst corner that deviates at most by `factor`, one parameter after the other from `start`.
    fn worst(&self, factor: f64, start: &Corner) -> Result<(Corner, f64)> {
        let mut best = (start.clone(), self.excess(start)?);
        for _ in 0..2 {
            let before = best.1;
            let mut tried: Vec<Corner> = Vec::new();
            for unknown in self.family.leading() {
                tried.clear();
                for off in [-factor, factor] {
                    let mut corner = best.0.clone();
                    self.family.put(&mut corner, unknown, off);
                    tried.push(corner);
                }
                self.take(&mut best, &tried)?;
            }
            tried = self.family.places.iter().map(|&place| Corner { place, ..best.0.clone() }).collect();
            self.take(&mut best, &tried)?;
            tried = self.family.loads.iter().map(|&load| Corner { load, ..best.0.clone() }).collect();
            self.take(&mut best, &tried)?;
            if best.1 <= before * (1.0 + 1e-6) || best.1 == f64::INFINITY {
                break;
            }
        }
        Ok(best)
    }

    /// Takes the worst of these if it is worse.
    fn take(&self, best: &mut (Corner, f64), tried: &[Corner]) -> Result<()> {
        for corner in tried.iter().filter(|corner| **corner != best.0).cloned().collect::<Vec<_>>() {
            let excess = self.excess(&corner)?;
            if excess > best.1 {
                *best = (corner, excess);
            }
        }
        Ok(())
    }

    /// The violation with the smallest deviation that was found.
    fn nearest(&self, stop: &dyn Fn() -> bool) -> Result<Option<Violation>> {
        // Positions and loads alone.
        let nominal = self.worst(0.0, &self.family.nominal())?;
        if nominal.1 > 1.0 {
            return self.violation(nominal.0, 0.0);
        }
        let gentle = self.worst(0.1, &nominal.0)?;
        let mut best: Option<(Corner, f64)> = None;
        // What is bad for small deviations alone is not found from the ends of the box.
        for (factor, start) in [
            (1.0, &self.scaled(&gentle.0, 1.0)),
            (1.0, &nominal.0),
            (0.3, &nominal.0),
            (0.1, &nominal.0),
            (0.03, &nominal.0),
        ] {
            let found = self.worst(factor, start)?;
            if found.1 > 1.0 {
                best = self.nearer(best, &found.0)?;
            }
            if stop() {
                break;
            }
        }
        for drawn in &self.family.machines {
            best = self.nearer(best, drawn)?;
        }
        for _ in 0..ROUNDS {
            let Some((corner, factor)) = &best else { break };
            if stop() {
                break;
            }
            let found = self.worst(*factor, corner)?;
            let nearer = self.nearer(best.clone(), &found.0)?;
            let is_done = nearer.as_ref().zip(best.as_ref()).is_some_and(|(new, old)| new.1 > 0.995 * old.1);
            best = nearer;
            if is_done {
                break;
            }
        }
        match best {
            Some((corner, factor)) => self.violation(corner, factor),
            None => Ok(None),
        }
    }

    /// The nearest violation on the line from the nominal machine to a corner, if it is nearer than `best`.
    fn nearer(&self, best: Option<(Corner, f64)>, corner: &Corner) -> Result<Option<(Corner, f64)>> {
        let own = corner.off.iter().fold(0.0_f64, |most, off| most.max(off.abs()));
        let mut high = best.as_ref().map_or(own.min(1.0), |(_, factor)| *factor);
        if own == 0.0 || self.excess(&self.scaled(corner, high))? <= 1.0 {
            return Ok(best);
        }
        let mut low = 0.0;
        for _ in 0..STEPS {
            let middle = 0.5 * (low + high);
            if self.excess(&self.scaled(corner, middle))? > 1.0 { high = middle } else { low = middle }
        }
        Ok(Some((self.scaled(corner, high), high)))
    }

    fn violation(&self, corner: Corner, factor: f64) -> Result<Option<Violation>> {
        let plant = self.family.plant(&corner, self.design, &self.feedback.corners())?;
        let margins = Margins::new(&plant, self.feedback);
        Ok(Some(Violation { factor, corner, margins }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use crate::tune::Tuning;

    /// The worst axis of a family is worse than the nominal one, and than each with one parameter at an end.
    #[test]
    fn a_search_finds_a_worse_axis_than_the_nominal_one() {
        let folder = format!("{}/../stages/sollmann-jouaneh/controllers", env!("CARGO_MANIFEST_DIR"));
        let case = Case::read_with(format!("{folder}/pid.toml"), &[]).unwrap();
        let design = case.controller.as_ref().unwrap();
        let feedback = Feedback::new(design, &case.machine).unwrap();
        let family = Family::new(&case, &Tuning::default()).unwrap();
        let search = Search { family: &family, design, feedback: &feedback, limits: [2.0, 2.0] };
        let nominal = family.nominal();
        let (corner, worst) = search.worst(1.0, &nominal).unwrap();
        assert!(
            corner.off.iter().any(|off| *off != 0.0) && corner.off.iter().all(|off| off.abs() <= 1.0),
            "{corner:?}"
        );
        assert!(worst > search.excess(&nominal).unwrap());
        for unknown in family.leading() {
            for off in [-1.0, 1.0] {
                let mut other = nominal.clone();
                family.put(&mut other, unknown, off);
                let excess = search.excess(&other).unwrap();
                assert!(worst >= excess, "{unknown} {off}: {excess} {worst}");
            }
        }
    }
}
