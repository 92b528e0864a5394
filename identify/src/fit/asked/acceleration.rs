//! The acceleration of what slides, as an accelerometer on it shows: of the forces in the rows of a run.

use crate::log::Quantity;
use crate::machine::{Lever, Machine};
use crate::trajectory::Trajectory;

/// m·x″ = −Σ a_s F_s − friction + other forces along the travel, a_s being the lever arms of the slide at the spans.
/// Empty where the rows lack the forces, as with a rigid belt.
pub(crate) fn acceleration(rows: &Trajectory, machine: &Machine, quantity: Quantity) -> Vec<f64> {
    let (geometry, mechanism) = (machine.geometry(), machine.mechanism());
    let name = quantity.body().unwrap_or_default();
    let Some((at, slide)) =
        geometry.slides.iter().zip(machine.slides()).find(|(at, _)| geometry.label(at.body).key == name)
    else {
        return Vec::new();
    };
    let mut forces: Vec<(f64, &[f64])> = Vec::new();
    for span in geometry.spans {
        for (_, arm) in span.arms.iter().filter(|(body, _)| *body == at.body) {
            let Lever::One(arm) = arm else { continue };
            let Some(force) = rows.get(&format!("{}_force", span.column)) else { return Vec::new() };
            forces.push((-arm, force));
        }
    }
    let Some(friction) = rows.get(&format!("{name}_friction")) else { return Vec::new() };
    forces.push((-1.0, friction));
    let others = [format!("{}_force", at.stop.key), at.force_along.key.into(), at.force_by_speed.key.into()];
    forces.extend(others.iter().filter_map(|name| Some((1.0, rows.get(name)?))));
    let mass = mechanism.bodies[at.body].inertia;
    let sum = |k: usize| forces.iter().map(|(sign, force)| sign * force[k]).sum::<f64>();
    (0..friction.len()).map(|k| (sum(k) + slide.constant_force()) / mass).collect()
}
