//! Objective: the moves of a controller on all machines of the family, in one number.
//!
//! Each move contributes three figures, each in the worst case of the central 95 % of the machines: the largest error E
//! of the cart, the time S from the end of the profile until the cart stays within its window w, and the RMS current I.
//! Of several slides or motors, the worst counts. With the duration D of the profile, the current I₀ that it requires
//! on the nominal machine, and M moves
//!
//! ```text
//! ln J = 1/M Σ [ a_e ln(1 + E/w) + a_s ln(1 + S/D) + a_i ln(I/I₀) ]
//! ```
//!
//! If the cart is outside its window by e at the end of the run, t_end, S = (t_end − D)(1 + ln(1 + e/w)). If it is
//! within its window without having made the move (stuck during a reversal), e is its largest error.

use crate::case::{Cost, Move};
use crate::control::{
    AtSamples, Figures, LoadFigures, Loop, SampledPath, Standard, closed_loop_at_samples, closed_loop_briefly, each,
};
use crate::design::Design;
use crate::error::Result;
use crate::machine::Machine;
use crate::solve::{Ending, Solver};

/// Weights of the figures: a_e, a_s, a_i.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Balance {
    /// In a word.
    pub name: &'static str,
    /// Weight of the largest error.
    pub error: f64,
    /// Weight of the settling time.
    pub settling: f64,
    /// Weight of the current.
    pub current: f64,
}

/// The balances of the table of choices; the second is the objective.
pub(crate) const BALANCES: [Balance; 3] = [
    Balance { name: "stiff", error: 1.0, settling: 1.0, current: 0.1 },
    Balance { name: "balanced", error: 1.0, settling: 1.0, current: 1.0 },
    Balance { name: "gentle", error: 1.0, settling: 1.0, current: 10.0 },
];

/// Figures of a move on one machine.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct MoveFigures {
    /// Largest |y − x| of all slides, m; infinite if the run ends early.
    pub error: f64,
    /// RMS of y − x, m, largest of all slides.
    pub rms: f64,
    /// Settling time from the end of the profile, s.
    pub settling: Option<f64>,
    /// S, s.
    pub settles: f64,
    /// RMS current, A, largest of all motors.
    pub current: f64,
}

/// A move on one machine.
pub fn look(machine: &Machine, model: &Machine, design: &Design, motion: &Move) -> Result<MoveFigures> {
    Runner::new(model, design)?.look(machine, motion, &path(motion, design))
}

/// The shaped profiles of a move, and their references at the samples of a design.
pub(super) fn path(motion: &Move, design: &Design) -> SampledPath {
    SampledPath::new(motion.references(design), Loop::new(design), motion.until)
}

/// A controller made once and run through many moves.
pub(super) struct Runner {
    controllers: Vec<Standard>,
    timing: Loop,
}

impl Runner {
    /// Objective of a design for a model of the axis.
    pub fn new(model: &Machine, design: &Design) -> Result<Self> {
        Ok(Self { controllers: Standard::of_drives(design, model)?, timing: Loop::new(design) })
    }

    /// A move on one machine along its path.
    pub fn look(&mut self, machine: &Machine, motion: &Move, path: &SampledPath) -> Result<MoveFigures> {
        let seen = (motion.until, motion.window);
        let controllers = &mut each(&mut self.controllers);
        let (figures, ending) =
            closed_loop_briefly(machine, controllers, &self.timing, path, seen, Solver::for_machine(machine))?;
        Ok(figures_of(&figures, ending, motion))
    }

    /// Figures of a move at samples only, in a third of the time; cut short if `is_enough` says so of lower bounds.
    pub(crate) fn glance(
        &mut self,
        machine: &Machine,
        motion: &Move,
        path: &SampledPath,
        is_enough: &mut dyn FnMut(&MoveFigures) -> bool,
    ) -> Result<Glance> {
        let (seen, solver) = ((motion.until, motion.window), Solver::for_machine(machine));
        let is_enough = &mut |figures: &Figures| is_enough(&figures_of(figures, Ending::Complete, motion));
        let AtSamples { figures, ending, end } =
            closed_loop_at_samples(machine, &mut self.controllers, &self.timing, path, seen, solver, is_enough)?;
        let is_whole = ending.is_some();
        Ok(Glance { figures: figures_of(&figures, ending.unwrap_or(Ending::Complete), motion), is_whole, end })
    }
}

/// Figures of a move at samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Glance {
    /// The figures; lower bounds if the run was cut short.
    pub figures: MoveFigures,
    /// False if the run was cut short.
    pub is_whole: bool,
    /// End of the run, s.
    pub end: f64,
}

fn figures_of(figures: &Figures, ending: Ending, motion: &Move) -> MoveFigures {
    if ending != Ending::Complete {
        return MoveFigures {
            error: f64::INFINITY,
            rms: f64::INFINITY,
            settling: None,
            settles: f64::INFINITY,
            current: f64::INFINITY,
        };
    }
    let left = (motion.until - motion.end()).max(motion.end() * 1e-3);
    let worst = |of: fn(&LoadFigures) -> f64| figures.loads.iter().map(of).fold(0.0, f64::max);
    let (error, last) = (worst(|load| load.error.peak.value.abs()), worst(|load| load.error.last.abs()));
    let off = if last > motion.window { last } else { error };
    let away = left * (1.0 + (off / motion.window).ln_1p());
    MoveFigures {
        error,
        rms: worst(|load| load.error.rms),
        settling: figures.settling,
        settles: figures.settling.unwrap_or(away),
        current: figures.worst_current(),
    }
}

/// Worst case of a move over several machines.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct AtWorst {
    /// E, m, and the index of its machine.
    pub error: (f64, usize),
    /// RMS error, m.
    pub rms: f64,
    /// S, s; and true if the cart settles on that machine.
    pub settles: (f64, bool),
    /// I, A.
    pub current: f64,
    /// Number of machines on which the cart settles.
    pub settled: usize,
    /// Number of machines on which it does not.
    pub unsettled: usize,
}

impl AtWorst {
    /// Lower bound of all figures with this current, A.
    pub(super) fn at_least(current: f64) -> Self {
        Self { error: (0.0, 0), rms: 0.0, settles: (0.0, true), current, settled: 0, unsettled: 0 }
    }

    /// At least these figures, too, on a further machine.
    pub(super) fn and(&self, least: &MoveFigures) -> Self {
        Self {
            error: (self.error.0.max(least.error), self.error.1),
            rms: self.rms.max(least.rms),
            settles: (self.settles.0.max(least.settles), self.settles.1),
            current: self.current.max(least.current),
            ..*self
        }
    }

    /// Time by which S is later than here, s; zero if the cart settles on no machine here, since S then depends on its
    /// position at the end of the run.
    pub(super) fn later(&self, settles: f64) -> f64 {
        if self.settled > 0 { (settles - self.settles.0).max(0.0) } else { 0.0 }
    }

    /// With this number of machines excluded from each figure.
    pub fn new(seen: &[MoveFigures], left_out: usize) -> Self {
        let worst = |of: &dyn Fn(&MoveFigures) -> f64| {
            let mut all: Vec<(f64, usize)> = seen.iter().map(of).enumerate().map(|(i, v)| (sure(v), i)).collect();
            all.sort_by(|a, b| b.0.total_cmp(&a.0));
            all.get(left_out.min(all.len().saturating_sub(1))).copied().unwrap_or((f64::INFINITY, 0))
        };
        let settles = worst(&|one| one.settles);
        Self {
            error: worst(&|one| one.error),
            rms: worst(&|one| one.rms).0,
            settles: (settles.0, seen.get(settles.1).is_some_and(|one| one.settling.is_some())),
            current: worst(&|one| one.current).0,
            settled: seen.iter().filter(|one| one.settling.is_some()).count(),
            unsettled: seen.iter().filter(|one| one.settling.is_none()).count(),
        }
    }
}

/// NaN counts as infinite.
fn sure(value: f64) -> f64 {
    if value.is_nan() { f64::INFINITY } else { value }
}

/// ln J of moves with the currents I₀ in `asked`.
pub fn objective(cost: Cost, balance: &Balance, moves: &[Move], asked: &[f64], worst: &[AtWorst]) -> f64 {
    let of = |((motion, asked), worst): ((&Move, &f64), &AtWorst)| {
        let error = (worst.error.0 / motion.window).ln_1p();
        match cost {
            Cost::Squares => (worst.rms / motion.window).ln_1p(),
            Cost::Peak => error,
            Cost::Moves | Cost::Disturbance => {
                let duration = motion.end().max(f64::MIN_POSITIVE);
                balance.error * error
                    + balance.settling * (worst.settles.0 / duration).ln_1p()
                    + balance.current * (worst.current / asked).ln()
            }
        }
    };
    let sum: f64 = moves.iter().zip(asked).zip(worst).map(of).sum();
    sure(sum / moves.len().max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use std::path::Path;

    /// A search evaluates moves at samples; figures far from those of the complete run would mislead it.
    #[test]
    fn a_glance_is_nearly_a_whole_run() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../stages/sollmann-jouaneh/controllers");
        for name in ["pid-elastic.toml", "cascade-current.toml", "lqi.toml"] {
            let case = Case::read(folder.join(name)).unwrap();
            let design = case.controller.as_ref().unwrap();
            let mut runner = Runner::new(&case.machine, design).unwrap();
            for motion in &case.moves {
                let path = path(motion, design);
                let whole = runner.look(&case.machine, motion, &path).unwrap();
                let glance = runner.glance(&case.machine, motion, &path, &mut |_| false).unwrap().figures;
                let told = format!("{name}: {}: {whole:?} {glance:?}", motion.name);
                assert!(glance.error <= whole.error && glance.error > 0.98 * whole.error, "{told}");
                assert!((glance.rms / whole.rms - 1.0).abs() < 0.02, "{told}");
                assert!((glance.current / whole.current - 1.0).abs() < 0.02, "{told}");
                assert_eq!(glance.settling.is_some(), whole.settling.is_some(), "{told}");
                assert!((glance.settles - whole.settles).abs() <= 2.0 * design.every, "{told}");
            }
        }
    }
}
