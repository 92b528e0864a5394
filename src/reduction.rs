//! The error of a reduced model: the same experiments on the elastic model of the same machine, side by side.

use crate::case::Experiment;
use crate::error::Result;
use crate::machine::{Belt, BeltModel, Machine};
use crate::metrics::{Meter, Peak};
use crate::solve::{Ending, Flow, Solver, stream_observed};
use crate::trajectory::Trajectory;

/// How far a reduced model is from the elastic one on one experiment.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Reduction {
    /// x of the reduced model − x of the elastic one, where it is largest, m.
    pub cart: Peak,
    /// The same of r φ₁, m: what an encoder at the drive pulley would show.
    pub drive: Peak,
    /// x of the reduced model − x of the elastic one in the last row, m.
    pub final_cart: f64,
    /// r φ₁ − x of the elastic model, where it is largest, m: what a rigid model assumes to be zero.
    pub encoder_error: Peak,
    /// The largest stretch of any span in the elastic model, m.
    pub stretch: Peak,
}

impl Reduction {
    /// Runs `experiment` on the reduced `stage` and on its elastic model; none where there is nothing to compare: the
    /// stage is not reduced, no stiffness is given, or one of the runs does not reach its end.
    pub fn new(machine: &Machine, experiment: &Experiment, solver: Solver) -> Result<Option<Self>> {
        let known = machine.belt.stiffness.iter().all(|k| k.is_finite());
        if machine.belt.model == BeltModel::Elastic || !known {
            return Ok(None);
        }
        let elastic = Machine { belt: Belt { model: BeltModel::Elastic, ..machine.belt.clone() }, ..machine.clone() };
        let (Some(ours), Some(theirs)) = (travel(machine, experiment, solver)?, travel(&elastic, experiment, solver)?)
        else {
            return Ok(None);
        };
        let apart = |column: fn(&Travel) -> &Vec<f64>| {
            let mut peak = Peak::default();
            for ((&time, a), b) in ours.time.iter().zip(column(&ours)).zip(column(&theirs)) {
                if (a - b).abs() > peak.value.abs() {
                    peak = Peak { value: a - b, time };
                }
            }
            peak
        };
        let end = |travel: &Travel| travel.cart.last().copied().unwrap_or(0.0);
        Ok(Some(Self {
            cart: apart(|travel| &travel.cart),
            drive: apart(|travel| &travel.drive),
            final_cart: end(&ours) - end(&theirs),
            encoder_error: theirs.encoder_error,
            stretch: theirs.stretch,
        }))
    }
}

/// Where cart and drive pulley went.
struct Travel {
    time: Vec<f64>,
    cart: Vec<f64>,
    drive: Vec<f64>,
    encoder_error: Peak,
    stretch: Peak,
}

fn travel(machine: &Machine, experiment: &Experiment, solver: Solver) -> Result<Option<Travel>> {
    let (mut time, mut cart, mut drive) = (Vec::new(), Vec::new(), Vec::new());
    let mut meter = Meter::new(machine, experiment);
    let outcome = stream_observed(machine, experiment, solver, &mut meter, &mut |rows: &Trajectory| {
        let column = |name| rows.get(name).unwrap_or(&[]);
        time.extend(column("time"));
        cart.extend(column("cart_position"));
        drive.extend(column("drive_angle").iter().map(|phi| machine.pulley_radius * phi));
        Flow::Continue
    })?;
    let metrics = meter.finish(&outcome.events);
    let (_, stretch) = metrics.largest_stretch();
    let complete = outcome.ending == Ending::Complete;
    Ok(complete.then_some(Travel { time, cart, drive, encoder_error: metrics.cart().peak_error, stretch }))
}
