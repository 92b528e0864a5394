//! Bounded non-linear least squares: Levenberg and Marquardt's method with an active set for the bounds.
//!
//! min ½ Σ ρ(rᵢ(x)) with l ≤ x ≤ u. Each step solves
//!
//! ```text
//! min ‖J d + r‖² + λ ‖D d‖²        D = greatest column norms of J so far (Moré 1978)
//! ```
//!
//! by QR, with variables that would leave the box held at its edge. Convergence requires the test of the projected
//! gradient: the Gauss-Newton step in the free variables predicts less than `tolerance` of a standard error, and no
//! variable at its bound is pushed inwards.
//!
//! With dry friction the cost has kinks where the order of sticks and slips changes. The search is therefore a ladder
//! of strategies. If no damped step helps (`damped.rs`) and the test is not passed, a bundle of exact gradients
//! continues (`bundle.rs`), which detects a minimum on kinks. If there are no gradients, or they make no progress, an
//! evolution strategy without gradients is tried (`evolved.rs`) before the search counts as stalled.

use super::bundle::Bundle;
use super::damped::Damped;
use super::evolved::Evolved;
use super::point::{Ending, Minimum, Options, Point, Strategy};
use super::rung::{Climb, Rung, Watch};
use crate::fit::asked::residuals::{Bounds, Residuals};
use crate::solve::Flow;
use nalgebra::DMatrix;

/// Minimises the cost from `start`. `watch` receives the best point and its cost after each step, and may end the
/// search.
pub fn minimise(
    problem: &mut dyn Residuals,
    start: &[f64],
    bounds: &Bounds,
    options: &Options,
    watch: &mut dyn FnMut(&[f64], f64) -> Flow,
) -> Minimum {
    let mut at = match Point::new(problem, start, bounds, options) {
        Ok(point) => point,
        Err(failed) => return *failed,
    };
    let (ending, strategy) = search(&mut ladder(options, None), &mut at, problem, watch);
    Minimum { ending, strategy: Some(strategy), ..at.best }
}

/// Continues a search of `problem` where an earlier one ended, or at a start that is linearised: its residuals and
/// derivatives are not computed again. `options.iterations` counts the Jacobians from there on, with that one.
pub(crate) fn resume(
    problem: &mut dyn Residuals,
    mut from: Minimum,
    bounds: &Bounds,
    options: &Options,
    watch: &mut dyn FnMut(&[f64], f64) -> Flow,
) -> Minimum {
    let rows = from.jacobian.nrows();
    let known = std::mem::replace(&mut from.jacobian, DMatrix::zeros(rows, 0));
    from.iterations = 0;
    let mut at = Point::at(from, bounds, options);
    let (ending, strategy) = search(&mut ladder(options, Some(known)), &mut at, problem, watch);
    Minimum { ending, strategy: Some(strategy), ..at.best }
}

/// The strategies, the first one tried first; with the Jacobian at the start, if it is known.
fn ladder(options: &Options, known: Option<DMatrix<f64>>) -> Vec<Box<dyn Rung>> {
    let mut rungs: Vec<Box<dyn Rung>> = vec![Box::new(Damped::new(options, known)), Box::new(Bundle::default())];
    rungs.push(Box::new(Evolved { most: options.evolutions }));
    rungs
}

/// Tries rung after rung until one of them ends the search, or none is left. If a rung lowers the cost, the previous
/// rung continues.
fn search(
    ladder: &mut [Box<dyn Rung>],
    at: &mut Point,
    problem: &mut dyn Residuals,
    watch: &mut Watch,
) -> (Ending, Strategy) {
    let (mut rung, mut below) = (0, 0);
    while rung < ladder.len() {
        let own = &mut ladder[rung];
        if !own.applies(at) {
            rung += 1;
            continue;
        }
        match own.climb(at, problem, watch) {
            Climb::Converged => return (Ending::Converged, own.strategy()),
            Climb::Ended(ending) => return (ending, own.strategy()),
            Climb::Lowered => rung = below,
            Climb::Passed => (below, rung) = (rung, rung + 1),
        }
    }
    (Ending::Stalled, ladder[below].strategy())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::residuals::Differences;
    use crate::fit::limits::KINK;
    use std::cell::RefCell;
    use std::rc::Rc;

    /// A valley with a kink along x₁ = x₀², whose lowest point is (1, 1).
    struct Kinked {
        is_exact: bool,
    }

    impl Residuals for Kinked {
        fn rows(&self) -> usize {
            30
        }

        fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
            r.fill(1.0);
            (r[0], r[1]) = (10.0 + 4.0 * (x[1] - x[0] * x[0]).abs(), 3.0 * (1.0 - x[0]));
            true
        }

        fn is_exact(&self) -> bool {
            self.is_exact
        }

        fn jacobian(&mut self, x: &[f64], r: &[f64], bounds: &Bounds, how: &Differences) -> Option<DMatrix<f64>> {
            if !self.is_exact {
                return Differenced.jacobian(x, r, bounds, how);
            }
            let mut jacobian = DMatrix::zeros(30, 2);
            let side = 4.0 * (x[1] - x[0] * x[0]).signum();
            (jacobian[(0, 0)], jacobian[(0, 1)], jacobian[(1, 0)]) = (-2.0 * side * x[0], side, -3.0);
            Some(jacobian)
        }
    }

    /// The problem above with derivatives by differences.
    struct Differenced;

    impl Residuals for Differenced {
        fn rows(&self) -> usize {
            30
        }

        fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
            Kinked { is_exact: false }.evaluate(x, r)
        }
    }

    const START: [f64; 2] = [0.6, 0.9];

    /// The result of one rung alone in the valley, from a point with known derivatives: its end and its minimum.
    fn alone(rung: &mut dyn Rung, start: &[f64], is_exact: bool) -> (Climb, Minimum) {
        let (bounds, options) = (Bounds::none(2), Options::default());
        let mut toy = Kinked { is_exact };
        let mut at = Point::new(&mut toy, start, &bounds, &options).unwrap();
        assert!(at.linearise(&mut toy, &Differences::Central, None) && rung.applies(&at));
        let end = rung.climb(&mut at, &mut toy, &mut |_, _| Flow::Continue);
        (end, at.best)
    }

    fn cost(x: &[f64]) -> f64 {
        let mut r = vec![0.0; 30];
        Kinked { is_exact: true }.evaluate(x, &mut r);
        0.5 * r.iter().map(|r| r * r).sum::<f64>()
    }

    #[test]
    fn damped_steps_are_stuck_on_a_kink() {
        let (end, found) = alone(&mut Damped::new(&Options::default(), None), &START, true);
        assert_eq!(end, Climb::Passed);
        let aside = found.x[1] - found.x[0] * found.x[0];
        assert!(found.cost < cost(&START) && aside.abs() < 0.1 && found.decrement > KINK, "{found:?}");
    }

    #[test]
    fn a_bundle_goes_along_a_kink_to_its_minimum_once() {
        // On the kink, where damped steps are stuck.
        let (_, stuck) = alone(&mut Damped::new(&Options::default(), None), &START, true);
        let mut bundle = Bundle::default();
        let (end, found) = alone(&mut bundle, &stuck.x, true);
        assert_eq!(end, Climb::Converged);
        // A standard error along the valley is 0.9.
        assert!(found.pieces > 1 && (found.x[0] - 1.0).abs() < 0.18 && found.cost < stuck.cost, "{found:?}");
        let (bounds, options) = (Bounds::none(2), Options::default());
        let at = Point::new(&mut Kinked { is_exact: true }, &START, &bounds, &options).unwrap();
        assert!(!bundle.applies(&at), "a second time");
    }

    #[test]
    fn evolution_needs_no_derivatives() {
        let (end, found) = alone(&mut Evolved { most: 1 }, &START, false);
        assert_eq!((end, found.evolved), (Climb::Lowered, 1));
        assert!(found.cost < cost(&START) && (found.cost - 64.0).abs() < 1.0, "{found:?}");
        let (bounds, options) = (Bounds::none(2), Options::default());
        let mut at = Point::new(&mut Differenced, &START, &bounds, &options).unwrap();
        at.best = found;
        assert!(!Evolved { most: 1 }.applies(&at), "a second time");
    }

    #[test]
    fn the_result_says_which_strategy_ended_the_search() {
        for (is_exact, strategies) in
            [(true, &[Strategy::Bundle] as &[Strategy]), (false, &[Strategy::Damped, Strategy::Evolution])]
        {
            let (bounds, options) = (Bounds::none(2), Options::default());
            let toy = &mut Kinked { is_exact };
            let found = minimise(toy, &START, &bounds, &options, &mut |_, _| Flow::Continue);
            assert!(found.strategy.is_some_and(|own| strategies.contains(&own)), "{:?}", found.strategy);
        }
    }

    /// A smooth valley that records the kind of its derivatives.
    struct Recorded(Vec<Differences>);

    impl Residuals for Recorded {
        fn rows(&self) -> usize {
            30
        }

        fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
            let noise = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            let value = |k: usize| (x[0] * k as f64 / 30.0).exp() + x[1] * k as f64 - noise(k);
            r.iter_mut().enumerate().for_each(|(k, r)| *r = value(k));
            true
        }

        fn jacobian(&mut self, x: &[f64], r: &[f64], bounds: &Bounds, how: &Differences) -> Option<DMatrix<f64>> {
            struct Plain<'a>(&'a mut Recorded);
            impl Residuals for Plain<'_> {
                fn rows(&self) -> usize {
                    self.0.rows()
                }

                fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
                    self.0.evaluate(x, r)
                }
            }
            self.0.push(how.clone());
            Plain(self).jacobian(x, r, bounds, how)
        }
    }

    /// A search to a tenth of a standard error measured central derivatives, which cost twice as much, from ten
    /// standard errors on.
    #[test]
    fn a_rough_search_measures_central_derivatives_at_its_end_only() {
        let (bounds, options) = (Bounds::none(2), Options { tolerance: 0.1, ..Options::default() });
        let mut valley = Recorded(Vec::new());
        let found = minimise(&mut valley, &[4.0, 3.0], &bounds, &options, &mut |_, _| Flow::Continue);
        assert_eq!(found.ending, Ending::Converged);
        let central = valley.0.iter().filter(|how| **how == Differences::Central).count();
        assert!(central == 1 && valley.0.last() == Some(&Differences::Central), "{:?}", valley.0);
        assert!(valley.0.len() > 3 && valley.0[0] == Differences::Forward, "{:?}", valley.0);
    }

    /// A rung with a given end that records its use.
    struct RecordingRung {
        ends: Vec<Climb>,
        own: Strategy,
        climbed: Rc<RefCell<Vec<Strategy>>>,
    }

    impl Rung for RecordingRung {
        fn strategy(&self) -> Strategy {
            self.own
        }

        fn applies(&self, _: &Point) -> bool {
            !self.ends.is_empty()
        }

        fn climb(&mut self, _: &mut Point, _: &mut dyn Residuals, _: &mut Watch) -> Climb {
            self.climbed.borrow_mut().push(self.own);
            self.ends.remove(0)
        }
    }

    #[test]
    fn what_is_lowered_goes_on_from_the_rung_below() {
        use Climb::{Converged, Lowered, Passed};
        use Strategy::{Bundle, Damped, Evolution};
        let (bounds, options) = (Bounds::none(2), Options::default());
        let climbed = Rc::new(RefCell::new(Vec::new()));
        let ended = |ends: [Vec<Climb>; 3]| {
            let mut names = [Damped, Bundle, Evolution].into_iter();
            let mut ladder = ends.map(|ends| {
                let own = names.next().unwrap();
                Box::new(RecordingRung { ends, own, climbed: climbed.clone() }) as Box<dyn Rung>
            });
            let toy = &mut Differenced;
            let mut at = Point::new(toy, &START, &bounds, &options).unwrap();
            let end = search(&mut ladder, &mut at, toy, &mut |_, _| Flow::Continue);
            (end, climbed.take())
        };
        // The second one no longer applies when the first one passes again.
        let (end, order) = ended([vec![Passed, Passed], vec![Lowered], vec![Lowered, Converged]]);
        assert_eq!((end, order), ((Ending::Converged, Evolution), vec![Damped, Bundle, Damped, Evolution, Evolution]));
        let (end, order) = ended([vec![Passed], vec![Passed], vec![Converged]]);
        assert_eq!((end, order), ((Ending::Converged, Evolution), vec![Damped, Bundle, Evolution]));
        let (end, order) = ended([vec![Passed], vec![Passed], vec![Passed]]);
        assert_eq!((end, order), ((Ending::Stalled, Evolution), vec![Damped, Bundle, Evolution]));
    }
}
