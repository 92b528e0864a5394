//! Verifies predicted errors: noisy logs of the experiment on machines that differ from the case, each fitted from a
//! wrong start.

use super::{Designed, Request, Task};
use crate::case::{Case, parameters};
use crate::chance::uniform;
use crate::error::{Error, Result};
use crate::fit::asked::problem::Stop;
use crate::fit::fit;
use crate::fit::limits::{PROMISE_BROKEN, START_OFF};
use crate::fit::search::point::Ending;
use crate::log::Quantity;
use crate::solve::Flow;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

/// Findings of the fits of simulated logs for a parameter.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Verified {
    /// Its name.
    pub name: String,
    /// RMS of estimate − truth, relative to the predicted standard error of an exact model.
    pub ratio: f64,
    /// Mean of estimate − truth, relative to the same.
    pub bias: f64,
    /// Fraction of the fits whose own 95 % interval contains the truth.
    pub coverage: f64,
    /// Number of fits that determined it.
    pub fits: usize,
}

impl Verified {
    /// RMS of estimate − truth relative to the promise, which includes the error of the model, if that is broken: the
    /// fits end far from the truth, in other minima or with residuals that the promise does not know.
    pub fn broken(&self, found: &Designed) -> Option<f64> {
        let promise = found.promises.iter().find(|promise| promise.name == self.name && promise.wanted)?;
        let times = self.ratio * promise.random / promise.error;
        (times > PROMISE_BROKEN).then_some(times)
    }
}

/// Simulates a log of a designed experiment on each of `logs` machines and fits it; returns the errors of the estimates
/// for every determined parameter. The first machine is that of the case; on the others each free parameter is changed
/// by up to `request.doubt`.
pub fn verify(case: &Case, request: &Request, found: &Designed, logs: usize, stop: Stop) -> Result<Vec<Verified>> {
    let task = Task::new(case, request, stop)?;
    let frees = parameters(&case.machine, &task.plan, &[])?;
    let mut seen: Vec<Vec<(f64, bool)>> = vec![Vec::new(); frees.len()];
    let mut random = Pcg64::seed_from_u64(task.seed);
    for k in 0..logs {
        if stop() {
            break;
        }
        // A random position within a step of a converter, so that rounding differs each time.
        let mut initial = found.initial;
        let off: Vec<f64> = found.reached.positions.iter().map(|_| uniform(&mut random) * step(&task)).collect();
        let moved = case.machine.without_strain(&off, &[]).position;
        initial.position.iter_mut().zip(moved).for_each(|(place, off)| *place += off);
        let noise = task.seed.wrapping_add(1 + k as u64);
        let mut symmetric = |share: f64| 1.0 + share * (2.0 * uniform(&mut random) - 1.0);
        let mut machine = case.machine.clone();
        let doubt = if k == 0 { 0.0 } else { task.doubt };
        let mut truths = Vec::with_capacity(frees.len());
        for free in &frees {
            let truth = (free.start * symmetric(doubt)).clamp(free.low, free.high);
            free.set(&mut machine, truth);
            truths.push(truth);
        }
        let experiment = task
            .on(machine)
            .experiment(&found.name, &found.driven.inputs(&found.shape), initial, noise)
            .ok_or_else(|| Error::new("the designed experiment cannot be simulated"))?;
        let mut own = Case { experiments: vec![experiment], ..task.case.clone() };
        for (free, truth) in frees.iter().zip(&truths) {
            free.set(&mut own.machine, (truth * symmetric(START_OFF)).clamp(free.low, free.high));
        }
        let fit = fit(&own, &task.plan, Some(stop), &mut |_| Flow::Continue)?;
        if fit.ending == Ending::Interrupted {
            break;
        }
        for (((seen, free), promise), truth) in seen.iter_mut().zip(&frees).zip(&found.promises).zip(&truths) {
            let Some(estimate) = fit.estimates.iter().find(|estimate| estimate.name == free.name) else { continue };
            if let (true, Some([low, high])) = (promise.is_determined() && estimate.is_determined(), estimate.interval)
            {
                seen.push(((estimate.value - truth) / promise.random, (low..=high).contains(truth)));
            }
        }
    }
    let told = |(free, seen): (&crate::parameter::Free, Vec<(f64, bool)>)| {
        let n = seen.len().max(1) as f64;
        Verified {
            name: free.name.clone(),
            ratio: (seen.iter().map(|(z, _)| z * z).sum::<f64>() / n).sqrt(),
            bias: seen.iter().map(|(z, _)| z).sum::<f64>() / n,
            coverage: seen.iter().filter(|(_, holds)| *holds).count() as f64 / n,
            fits: seen.len(),
        }
    };
    Ok(frees.iter().zip(seen).map(told).filter(|one| one.fits > 0).collect())
}

/// The coarsest step of a recorded position, m along the belt.
fn step(task: &Task) -> f64 {
    let arm = |quantity: Quantity| if quantity.is_linear() { 1.0 } else { task.case.machine.pulley_radius };
    let positions = task.measured.iter().filter(|channel| channel.quantity.is_position());
    positions.map(|channel| arm(channel.quantity) * channel.step.unwrap_or(0.0)).fold(0.0, f64::max)
}
