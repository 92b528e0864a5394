//! Straight path from tuned gains back to those of the file, which violate the limits.
//!
//! With the powers p_j = ln(k_j/K_j) from the tuned gains K to the gains k of the file, with added filters unchanged,
//! the path is K_j e^(t p_j) for t from 0 to 1. Its last design that keeps the limits is the closest one on it to the
//! controller of the file; if that is also worse than the file, the limits force it: no design on this path closer to
//! the file keeps them.

use super::Judgement;
use super::gains::{gains, rounded, shaped};
use super::judged::{Forced, Verdict};
use super::verdict::{compare, forced};
use super::work::Work;
use crate::design::Design;
use crate::error::Result;
use crate::machine::Machine;

/// Intervals of the path checked from the file on, and halvings of the last one.
const STRETCHES: usize = 16;
const HALVINGS: usize = 8;

impl Work<'_> {
    /// The best verdict of the tuned gains and of the end of their path back to the file; and the limit that forces it
    /// to be worse, if any.
    pub(crate) fn way_back(&mut self, before: &Verdict, after: Verdict) -> Result<(Verdict, Option<Forced>)> {
        let is_kept = self.excess(&before.worst) <= 1.0 || self.excess(&after.worst) > 1.0;
        if compare(before, &after) != Judgement::Worse || is_kept || (self.stop)() {
            return Ok((after, None));
        }
        let Some(powers) = powers(&after.design, &before.design, &self.case.machine) else { return Ok((after, None)) };
        let at = |part: f64| {
            let powers: Vec<f64> = powers.iter().map(|power| part * power).collect();
            rounded(&shaped(&after.design, after.design.filters.len(), &powers))
        };
        // Includes the file's gains with the added filters, which may keep the limits.
        let Some(first) = self.first_kept(&at)? else { return Ok((after, None)) };
        let edge = self.edge(&at, first)?;
        let edge = self.verdict(&at(edge))?;
        if compare(before, &edge) != Judgement::Worse {
            return Ok((edge, None));
        }
        let limit = forced(self.family, &edge, self.tuning);
        Ok((if edge.objective < after.objective { edge } else { after }, limit))
    }

    /// The first end of an interval, from the file on, that keeps the limits.
    fn first_kept(&mut self, at: &dyn Fn(f64) -> Design) -> Result<Option<usize>> {
        for stretch in (0..=STRETCHES).rev() {
            if !self.passes(&at(stretch as f64 / STRETCHES as f64))? {
                return Ok(Some(stretch));
            }
        }
        Ok(None)
    }

    /// Boundary of the limits within the interval that begins there.
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

/// Factors from the gains of a design to those of another; none if a gain is zero in only one of them.
fn powers(from: &Design, to: &Design, machine: &Machine) -> Option<Vec<f64>> {
    let [from, to] = [from, to].map(|design| gains(design, machine));
    let pairs = from.iter().zip(&to).filter(|(from, _)| from.searched);
    let all = from.len() == to.len() && from.iter().zip(&to).all(|(a, b)| a.key == b.key && a.value * b.value > 0.0);
    all.then(|| pairs.map(|(from, to)| (to.value / from.value).ln()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use crate::design::Structure;
    use crate::tune::family::Family;
    use std::path::Path;

    fn pid() -> Case {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../stages/sollmann-jouaneh/controllers");
        Case::read(folder.join("pid-elastic.toml")).unwrap()
    }

    /// The file's proportional gain and its filter's corner, and the other two gains times a half.
    fn calmer(design: &Design) -> Design {
        let mut other = design.clone();
        let Structure::Pid(pid) = &mut other.structure else { panic!("not a PID") };
        (pid.integral, pid.derivative) = (0.5 * pid.integral, 0.5 * pid.derivative);
        other
    }

    #[test]
    fn the_way_ends_at_the_gains_of_the_file() {
        let case = pid();
        let file = case.controller.clone().unwrap();
        let powers = powers(&calmer(&file), &file, &case.machine).unwrap();
        assert_eq!(rounded(&shaped(&calmer(&file), file.filters.len(), &powers)), rounded(&file));
        assert!((powers[1] - 2f64.ln()).abs() < 1e-12 && powers[0] == 0.0, "{powers:?}");
        // A zero gain cannot be reached in logarithms.
        let mut without = file.clone();
        let Structure::Pid(pid) = &mut without.structure else { panic!("not a PID") };
        pid.integral = 0.0;
        assert_eq!(super::powers(&file, &without, &case.machine), None);
    }

    /// The design on the path keeps the limits, and slightly closer to the file they are violated.
    #[test]
    fn its_edge_is_where_the_limits_begin_to_hold() {
        let case = pid();
        let tuning = case.tune.clone().unwrap_or_default();
        let file = case.controller.clone().unwrap();
        let family = Family::new(&case, &tuning).unwrap();
        let mut work = Work::new(&case, &family, &tuning, &case.moves, &file, &|| false).unwrap();
        assert!(work.passes(&file).unwrap());
        // Slow enough to keep the limits: a third of the speed.
        let powers: Vec<f64> = [2.0, 3.0, 1.0, 0.0].iter().map(|power| power * 3f64.ln()).collect();
        let slow: Vec<f64> = powers.iter().map(|power| -power).collect();
        let slow = shaped(&file, file.filters.len(), &slow);
        let at = |part: f64| {
            let powers: Vec<f64> = powers.iter().map(|power| part * power).collect();
            rounded(&shaped(&slow, file.filters.len(), &powers))
        };
        let first = work.first_kept(&at).unwrap().expect("a third of the speed keeps the limits");
        assert!(first < STRETCHES);
        let edge = work.edge(&at, first).unwrap();
        assert!(!work.passes(&at(edge)).unwrap());
        let step = 1.0 / (STRETCHES << HALVINGS) as f64;
        assert!(work.passes(&at(edge + 1.01 * step)).unwrap(), "{edge}");
    }
}
