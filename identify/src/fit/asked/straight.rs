//! A Stribeck curve as straight lines, for fits that are only compared: runs of the exact solver, with its derivatives,
//! in place of differences of runs that take a hundred times as long.

use crate::fit::limits::STRIBECK_POINTS;
use crate::friction::{Friction, Law, Shape};
use crate::machine::{BeltModel, Machine};
use crate::polyline::Polyline;

/// The machine with the Stribeck curve of its cart, or of its drive pulley on a belt that does not stretch, as Coulomb
/// friction at its breakaway and a force of straight lines over the speed, F_b − F_f(v) at its points:
///
/// ```text
/// F_b − F_c − (F_b − F_c) e^{−(v/v_s)²}
/// ```
///
/// Between the points it is off by at most 1.5 % of F_b − F_c. None where the machine has another curve, or has such a
/// force already.
pub(super) fn straightened(machine: &Machine) -> Option<Machine> {
    let r = machine.pulley_radius;
    let is_gaussian = |friction: &Friction| matches!(friction.law, Law::Stribeck { shape: Shape::Gaussian, .. });
    let mut own = machine.clone();
    let (friction, lever) = match () {
        () if is_gaussian(&machine.cart.friction) => (&mut own.cart.friction, 1.0),
        () if is_gaussian(&machine.drive_pulley.friction) && machine.belt.model == BeltModel::Rigid => {
            (&mut own.drive_pulley.friction, r)
        }
        () => return None,
    };
    let curve = *friction;
    let velocity = curve.law.velocity()?;
    for side in [&mut friction.forward, &mut friction.backward] {
        side.coulomb = side.breakaway;
    }
    friction.law = Law::Coulomb;
    // A force over the speed of the cart: ẋ = r φ̇, F = τ/r
    let point = |forward: bool, q: f64| {
        let (sign, v) = (if forward { 1.0 } else { -1.0 }, q * velocity);
        [sign * lever * v, sign * (curve.side(forward).breakaway - curve.dry(forward, v)) / lever]
    };
    let mut points: Vec<[f64; 2]> = STRIBECK_POINTS.iter().rev().map(|&q| point(false, q)).collect();
    points.push([0.0, 0.0]);
    points.extend(STRIBECK_POINTS.iter().map(|&q| point(true, q)));
    if own.cart.forces.by_speed.replace(Polyline::new(points)?).is_some() {
        return None;
    }
    own.is_piecewise_linear().then_some(own)
}
