//! Evaluation of one design at the boundary of the limits in a search by moves.

use super::gains::{rounded, shaped};
use super::objective::{AtWorst, BALANCES};
use super::tried::{Bars, Tried, Weighed};
use super::watch::Watch;
use super::work::{Finalist, STEEP, Work, slowing};
use super::{HARD, SOFT};

/// Treatment of limits in a search: an excess is penalised, or the loop is slowed down until they hold.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Edge {
    Beyond(f64),
    Eased,
}

/// ln of the slowest factor on the speed of a loop, halvings in the search for the fastest loop within the limits, and
/// repetitions with further machines.
const SLOWEST: f64 = -0.7;
const HALVINGS: usize = 5;
const EASED: usize = 3;

impl Work<'_> {
    /// ln J of a finalist with these powers, by moves on the watched machines; designs below the bar that keep the
    /// limits on the set join the archive. Infinite once the search has to end.
    pub fn of_moves(
        &mut self,
        (finalist, layout, powers): (&Finalist, usize, &[f64]),
        watch: &Watch,
        weighed: &Weighed,
        (edge, bar): (Edge, f64),
        archive: &mut Vec<Tried>,
    ) -> f64 {
        let slack = match edge {
            Edge::Eased => return self.of_eased((finalist, layout, powers), watch, weighed, bar, archive),
            Edge::Beyond(slack) => slack,
        };
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
            archive.push(Tried { design, worst, layout, powers: powers.to_vec() });
        }
        value + STEEP * beyond
    }

    /// Cost of the design slowed down until the limits hold; below the bar, they hold on all axes.
    fn of_eased(
        &mut self,
        (finalist, layout, powers): (&Finalist, usize, &[f64]),
        watch: &Watch,
        weighed: &Weighed,
        bar: f64,
        archive: &mut Vec<Tried>,
    ) -> f64 {
        let mut powers = powers.to_vec();
        for _ in 0..EASED {
            if (self.stop)() || self.is_spent() {
                return f64::INFINITY;
            }
            powers = match self.eased(finalist, &powers) {
                Ok(powers) => powers,
                Err(beyond) => return 1e3 + beyond.min(1e6),
            };
            let design = rounded(&shaped(&finalist.start, finalist.own, &powers));
            let (worst, value) = self.run(&design, watch, weighed, bar);
            if value >= bar {
                return value;
            }
            if !self.is_best_by_any(&worst, archive, weighed) {
                return value;
            }
            // A design worth keeping has to keep the limits on all machines; one that violates them joins the set.
            match self.passes(&design) {
                Ok(false) => {
                    archive.push(Tried { design, worst, layout, powers });
                    return value;
                }
                Ok(true) => {}
                Err(_) => return f64::INFINITY,
            }
        }
        f64::INFINITY
    }

    /// True if no design run so far is better by the weights of the search, or by one of the balances.
    fn is_best_by_any(&self, worst: &[AtWorst], archive: &[Tried], weighed: &Weighed) -> bool {
        let [strict, soft] = [HARD, SOFT].map(|steep| weighed.bars.map(|bars| Bars { steep, ..bars }));
        [(1, strict), (1, soft), (1, None), (0, None), (2, None)].into_iter().any(|(place, bars)| {
            let value = |worst: &[AtWorst]| self.valued(weighed.cost, &BALANCES[place], worst, bars);
            value(worst) < archive.iter().map(|tried| value(&tried.worst)).fold(f64::INFINITY, f64::min)
        })
    }

    /// These powers with the loop slowed down until the limits hold on the set; if half the speed is not slow enough,
    /// the excess over the limits.
    fn eased(&mut self, finalist: &Finalist, powers: &[f64]) -> std::result::Result<Vec<f64>, f64> {
        let slowing = slowing(&finalist.start, finalist.own, &self.case.machine);
        let at = |log: f64| -> Vec<f64> { powers.iter().zip(&slowing).map(|(x, slow)| x + log * slow).collect() };
        let mut beyond = |x: &[f64]| self.on_set(&rounded(&shaped(&finalist.start, finalist.own, x))).0;
        if beyond(powers) == 0.0 {
            return Ok(powers.to_vec());
        }
        let (mut slow, mut fast) = (SLOWEST, 0.0);
        let left = beyond(&at(slow));
        if left > 0.0 {
            return Err(left);
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (slow + fast);
            if beyond(&at(middle)) > 0.0 { fast = middle } else { slow = middle }
        }
        Ok(at(slow))
    }
}
