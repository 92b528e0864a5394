//! The cart's acceleration, as an accelerometer on it shows: of the forces in the rows of a run.

use crate::machine::Slide;
use crate::trajectory::Trajectory;

/// M·x″ = F₁ − F₂ − friction + what else pulls at the cart. Empty where the rows lack the forces, as with a rigid belt.
pub(crate) fn cart_acceleration(rows: &Trajectory, cart: &Slide) -> Vec<f64> {
    let column = |name: &str| rows.get(name).unwrap_or(&[]);
    let [first, second, friction] = ["span1_force", "span2_force", "cart_friction"].map(column);
    let others: Vec<&[f64]> =
        ["stop_force", "force_along", "force_by_speed"].iter().filter_map(|name| rows.get(name)).collect();
    let forces = first.iter().zip(second).zip(friction).enumerate();
    forces
        .map(|(k, ((first, second), friction))| {
            let other: f64 = others.iter().map(|force| force[k]).sum();
            (first - second - friction + other + cart.constant_force()) / cart.mass
        })
        .collect()
}
