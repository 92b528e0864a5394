//! The axis with each of its parameters wrong by some share.

use super::{Loop, Rows, Standard, stream};
use crate::case::Move;
use crate::design::Design;
use crate::error::{Error, Result};
use crate::solve::{Ending, Flow, Solver};
use crate::stage::Stage;
use crate::trajectory::Trajectory;

/// Multiplies a parameter of a stage by a factor.
pub type Change = fn(&mut Stage, f64);

/// What can be wrong, one at a time, with its name.
pub const PARAMETERS: [(&str, Change); 14] = [
    ("torque constant", |s, f| s.motor.torque_constant *= f),
    ("back-EMF constant", |s, f| s.motor.back_emf_constant *= f),
    ("resistance", |s, f| s.motor.resistance *= f),
    ("inductance", |s, f| s.motor.inductance *= f),
    ("rotor inertia", |s, f| s.motor.rotor_inertia *= f),
    ("drive pulley's inertia", |s, f| s.drive_pulley.inertia *= f),
    ("idler pulley's inertia", |s, f| s.idler_pulley.inertia *= f),
    ("mass", |s, f| s.cart.mass *= f),
    ("cart's viscous friction", |s, f| viscous(&mut s.cart.friction, f)),
    ("cart's dry friction", |s, f| dry(&mut s.cart.friction, f)),
    ("pulleys' viscous friction", |s, f| {
        viscous(&mut s.drive_pulley.friction, f);
        viscous(&mut s.idler_pulley.friction, f);
    }),
    ("pulleys' dry friction", |s, f| {
        dry(&mut s.drive_pulley.friction, f);
        dry(&mut s.idler_pulley.friction, f);
    }),
    ("belt's stiffness", |s, f| {
        s.belt.stiffness = s.belt.stiffness.map(|k| k * f);
        if let Some(make) = &mut s.belt.make {
            make.modulus *= f;
        }
    }),
    ("belt's damping", |s, f| s.belt.damping = s.belt.damping.map(|c| c * f)),
];

/// `stage` with one parameter at a time, those above zero, times 1 + `share` and times 1 − `share`, and what was changed.
pub fn spread(stage: &Stage, share: f64) -> Vec<(String, Stage)> {
    let mut axes = Vec::new();
    for (name, change) in PARAMETERS {
        for (word, factor) in [("more", 1.0 + share), ("less", 1.0 - share)] {
            let mut other = stage.clone();
            change(&mut other, factor);
            if other != *stage {
                axes.push((format!("{name} {} % {word}", crate::quantity::rounded(100.0 * share)), other));
            }
        }
    }
    axes
}

/// The worst of axes whose parameters are off.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Worst {
    /// Largest |x − y|, m; infinite where a run does not reach its end.
    pub error: f64,
    /// What is wrong with that axis.
    pub axis: String,
    /// Largest |x − y| at the end, m.
    pub last: f64,
    /// Axes on which the cart settles.
    pub settled: usize,
    /// All of them.
    pub axes: usize,
}

/// The same controller, made for `stage`, on axes of which each parameter is off by a `share`. None where `stop` said so, which is
/// asked with every block of rows.
pub fn worst(
    stage: &Stage,
    design: &Design,
    motion: &Move,
    share: f64,
    solver: Solver,
    stop: &dyn Fn() -> bool,
) -> Result<Option<Worst>> {
    if !(share > 0.0 && share < 1.0) {
        return Err(Error::new(format!("parameters cannot be off by a share of {share:?}"))
            .allowed("above 0, below 1")
            .next("write 0.2 for 20 %"));
    }
    let mut worst = Worst::default();
    let profile = motion.profile.clone().shaped(&design.shaper);
    let timing = Loop::of(design);
    let rows = Rows { until: motion.until, every: timing.every.min(motion.until), window: motion.window };
    for (axis, other) in spread(stage, share) {
        let mut controller = Standard::new(design, stage)?;
        let mut sink = |_: &Trajectory| if stop() { Flow::Stop } else { Flow::Continue };
        let run = stream(&other, &mut controller, &timing, &profile, &rows, solver, false, &mut sink)?;
        if stop() {
            return Ok(None);
        }
        worst.axes += 1;
        worst.settled += usize::from(run.figures.settling.is_some() && run.outcome.ending == Ending::Complete);
        let error = match run.outcome.ending {
            Ending::Complete => run.figures.cart.peak.value.abs(),
            _ => f64::INFINITY,
        };
        if error > worst.error {
            (worst.error, worst.axis) = (error, axis);
        }
        worst.last = worst.last.max(run.figures.final_cart_error.abs());
    }
    Ok(Some(worst))
}

fn viscous(friction: &mut crate::friction::Friction, factor: f64) {
    friction.forward.viscous *= factor;
    friction.backward.viscous *= factor;
}

fn dry(friction: &mut crate::friction::Friction, factor: f64) {
    for side in [&mut friction.forward, &mut friction.backward] {
        side.coulomb *= factor;
        side.breakaway *= factor;
    }
}
