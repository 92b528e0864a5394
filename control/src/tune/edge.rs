//! Questions of a search by moves to one design at the edge of the limits.

use super::gains::{rounded, shaped};
use super::objective::{AtWorst, BALANCES};
use super::tried::{Bars, Tried, Weighed};
use super::watch::Watch;
use super::work::{Finalist, STEEP, Work, slowing};
use super::{HARD, SOFT};

/// The limits to a search: it may go so far beyond them, which costs, or a loop that passes them is made slower.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Edge {
    Beyond(f64),
    Eased,
}

/// ln of the slowest loop that limits make of one that passes them, halvings on the way to the fastest that does not,
/// and how often that is done for axes that were not looked at.
const SLOWEST: f64 = -0.7;
const HALVINGS: usize = 5;
const EASED: usize = 3;

impl Work<'_> {
    /// ln J of a finalist with these powers, by moves on the axes that are watched; what keeps the limits on the set
    /// and is below the bar joins the archive. Infinite once the search is to end.
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
            // What is worth keeping has to keep the limits on all axes; one on which it does not joins the set.
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

    /// True if no design that was run is better by what a search weighs, or by a balance that designs are chosen by.
    fn is_best_by_any(&self, worst: &[AtWorst], archive: &[Tried], weighed: &Weighed) -> bool {
        let [strict, soft] = [HARD, SOFT].map(|steep| weighed.bars.map(|bars| Bars { steep, ..bars }));
        [(1, strict), (1, soft), (1, None), (0, None), (2, None)].into_iter().any(|(place, bars)| {
            let value = |worst: &[AtWorst]| self.valued(weighed.cost, &BALANCES[place], worst, bars);
            value(worst) < archive.iter().map(|tried| value(&tried.worst)).fold(f64::INFINITY, f64::min)
        })
    }

    /// These powers with the loop as much slower as the limits make it on the set; where half as fast is not enough,
    /// how far it is beyond them.
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
