//! The straight way from gains that were found back to those of the file, which break the limits.
//!
//! With the powers p_j = ln(k_j/K_j) that lead from the gains K that were found to the gains k of the file, filters that
//! were added left as they are, the way is K_j e^(t p_j) for t from 0 to 1. Its last design that keeps the limits is the
//! nearest there is on it to the controller of the file; where that is worse than the file, too, the limits stand
//! between the two: no design of this way that is nearer to the file keeps them.

use super::Judgement;
use super::gains::{gains, rounded, shaped};
use super::verdict::{Forced, Verdict, compare, forced};
use super::work::Work;
use crate::design::Design;
use crate::error::Result;
use crate::stage::Stage;

/// Stretches of the way that are looked at from the file on, and halvings of the last of them.
const STRETCHES: usize = 16;
const HALVINGS: usize = 8;

impl Work<'_> {
    /// The verdict that is best of what was found and of what stands on its way back to the file; and the limit that
    /// forces it to be worse, where one does.
    pub fn way_back(&mut self, before: &Verdict, after: Verdict) -> Result<(Verdict, Option<Forced>)> {
        let is_kept = self.excess(&before.worst) <= 1.0 || self.excess(&after.worst) > 1.0;
        if compare(before, &after) != Judgement::Worse || is_kept || (self.stop)() {
            return Ok((after, None));
        }
        let Some(powers) = powers(&after.design, &before.design, &self.case.stage) else { return Ok((after, None)) };
        let at = |part: f64| {
            let powers: Vec<f64> = powers.iter().map(|power| part * power).collect();
            rounded(&shaped(&after.design, after.design.filters.len(), &powers))
        };
        // Of the file's gains with the filters that were added, too, for these may keep the limits.
        let Some(first) = self.first_kept(&at)? else { return Ok((after, None)) };
        let edge = self.edge(&at, first)?;
        let edge = self.verdict(&at(edge))?;
        if compare(before, &edge) != Judgement::Worse {
            return Ok((edge, None));
        }
        let limit = forced(self.family, &edge, self.tuning);
        Ok((after, limit))
    }

    /// The last of the ends of stretches, from the file on, that keeps the limits.
    fn first_kept(&mut self, at: &dyn Fn(f64) -> Design) -> Result<Option<usize>> {
        for stretch in (0..=STRETCHES).rev() {
            if !self.passes(&at(stretch as f64 / STRETCHES as f64))? {
                return Ok(Some(stretch));
            }
        }
        Ok(None)
    }

    /// How far the limits are kept within the stretch that begins there.
    fn edge(&mut self, at: &dyn Fn(f64) -> Design, first: usize) -> Result<f64> {
        let mut near = first as f64 / STRETCHES as f64;
        if first == STRETCHES {
            return Ok(near);
        }
        let mut far = near + 1.0 / STRETCHES as f64;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (near + far);
            if self.passes(&at(middle))? { far = middle } else { near = middle }
        }
        Ok(near)
    }
}

/// What leads from the gains of a design to those of another; none where one of them is zero in one of the two.
fn powers(from: &Design, to: &Design, stage: &Stage) -> Option<Vec<f64>> {
    let [from, to] = [from, to].map(|design| gains(design, stage));
    let pairs = from.iter().zip(&to).filter(|(from, _)| from.searched);
    let all = from.len() == to.len() && from.iter().zip(&to).all(|(a, b)| a.key == b.key && a.value * b.value > 0.0);
    all.then(|| pairs.map(|(from, to)| (to.value / from.value).ln()).collect())
}
