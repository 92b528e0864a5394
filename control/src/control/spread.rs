//! Variations of an axis, each with one parameter changed.

use super::{Deviation, Figures, Loop, Rows, Standard, each, stream};
use crate::case::Move;
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::parameter::{Free, kinds};
use crate::solve::{Ending, Flow, Solver};
use crate::trajectory::Trajectory;

/// `machine` with one uncertain parameter at a time, and everything physically linked to it, times 1 + `share` and
/// times 1 − `share`; with a description.
pub fn spread(machine: &Machine, share: f64) -> Vec<(String, Machine)> {
    let axis = |kind: &Free, word: &str, factor: f64| {
        let mut other = machine.clone();
        kind.set(&mut other, factor);
        (format!("{} {} % {word}", kind.name, crate::quantity::rounded(100.0 * share)), other)
    };
    let both = |kind: &Free| [axis(kind, "more", 1.0 + share), axis(kind, "less", 1.0 - share)];
    kinds(machine).iter().flat_map(both).collect()
}

/// Worst case over varied axes.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Worst {
    /// Largest |y − x|, m; infinite if a run ends early.
    pub error: f64,
    /// The parameter changed on that axis, and its change.
    pub axis: String,
    /// Largest |y − x| at the end, m.
    pub last: f64,
    /// Axes on which the cart settles.
    pub settled: usize,
    /// Number of axes.
    pub axes: usize,
}

/// The controller made for `machine` on axes with each parameter changed by a relative `share`. None if `stop`, called
/// with every block of rows, ends it.
pub fn worst(
    machine: &Machine,
    design: &Design,
    motion: &Move,
    share: f64,
    solver: Solver,
    stop: &dyn Fn() -> bool,
) -> Result<Option<Worst>> {
    if !(share > 0.0 && share < 1.0) {
        return Err(Error::new(format!("a relative error of parameters cannot be {share:?}"))
            .allowed("above 0, below 1")
            .next("write 0.2 for 20 %"));
    }
    let mut worst = Worst::default();
    let profiles = motion.references(design);
    let timing = Loop::new(design);
    let rows = Rows { until: motion.until, every: timing.every.min(motion.until), window: motion.window };
    for (axis, other) in spread(machine, share) {
        let mut controllers = Standard::of_drives(design, machine)?;
        let mut sink = |_: &Trajectory| if stop() { Flow::Stop } else { Flow::Continue };
        let run = stream(&other, &mut each(&mut controllers), &timing, &profiles, &rows, solver, false, &mut sink)?;
        if stop() {
            return Ok(None);
        }
        worst.axes += 1;
        worst.settled += usize::from(run.figures.settling.is_some() && run.outcome.ending == Ending::Complete);
        let error = match run.outcome.ending {
            Ending::Complete => largest(&run.figures, |error| error.peak.value),
            _ => f64::INFINITY,
        };
        if error > worst.error {
            (worst.error, worst.axis) = (error, axis);
        }
        worst.last = worst.last.max(largest(&run.figures, |error| error.last));
    }
    Ok(Some(worst))
}

/// Largest magnitude of an error of the slides.
fn largest(figures: &Figures, of: fn(&Deviation) -> f64) -> f64 {
    figures.loads.iter().map(|load| of(&load.error).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, TEMPLATE};

    #[test]
    fn each_axis_of_a_spread_differs_in_what_it_is_called_after() {
        let machine = Case::from_text("axis.toml", TEMPLATE).unwrap().machine;
        let all = spread(&machine, 0.1);
        assert_eq!(all.len(), 2 * kinds(&machine).len());
        assert!(all.iter().all(|(name, other)| *other != machine && !name.is_empty()));
        for (factor, word) in [(1.1, "more"), (0.9, "less")] {
            let heavier = all.iter().find(|(name, _)| *name == format!("mass 10 % {word}"));
            let mass = heavier.unwrap_or_else(|| panic!("{all:?}")).1.cart.mass;
            assert!((mass / machine.cart.mass - factor).abs() < 1e-12, "{mass}");
        }
    }
}
