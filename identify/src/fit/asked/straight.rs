//! A Stribeck curve as straight lines, for fits that are only compared: runs of the exact solver, with its derivatives,
//! in place of differences of runs that take a hundred times as long.

use crate::fit::limits::STRIBECK_POINTS;
use crate::friction::{Friction, Law, Shape};
use crate::machine::{BeltModel, Machine};
use crate::polyline::Polyline;

/// True if fits to this machine that are compared have exact derivatives: others take twenty times as long, with one or
/// two runs for each variable.
pub(crate) fn has_exact_derivatives(machine: &Machine) -> bool {
    machine.is_piecewise_linear() || straightened(machine).is_some()
}

/// The machine with the Stribeck curve of its cart, or of its drive pulley on a belt that does not stretch, as Coulomb
/// friction at its breakaway and a force of straight lines over the speed, F_b − F_f(v) at its points:
///
/// ```text
/// F_b − F_c − (F_b − F_c) e^{−(v/v_s)²}
/// ```
///
/// Between the points it is off by at most 1.6 % of F_b − F_c. None where the machine has another curve, or has such a
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, TEMPLATE};

    /// Coulomb friction at the breakaway and the force over the speed together, beside the curve.
    #[test]
    fn lines_resist_as_their_curve_does() {
        let curve =
            "{ viscous = 19, coulomb = 0.2, coulomb_backward = 0.25, stribeck = { force = 0.1, velocity = 0.02 } }";
        let rigid = "belt = { model = \"rigid\" }";
        for (change, own, is_pulley) in
            [(format!("cart.friction={curve}"), "", false), (format!("drive_pulley.friction={curve}"), rigid, true)]
        {
            let changes: Vec<&str> = [change.as_str(), own].into_iter().filter(|change| !change.is_empty()).collect();
            let machine = Case::from_text_with("axis.toml", TEMPLATE, &changes).unwrap().machine;
            let straight = straightened(&machine).unwrap();
            assert!(straight.is_piecewise_linear() && has_exact_derivatives(&machine));
            let r = machine.pulley_radius;
            let (friction, lever, lines) = match is_pulley {
                true => (machine.drive_pulley.friction, r, straight.drive_pulley.friction),
                false => (machine.cart.friction, 1.0, straight.cart.friction),
            };
            let line = straight.cart.forces.by_speed.as_ref().unwrap();
            for k in (-400..=400).filter(|k| *k != 0) {
                let v = 0.0002 * f64::from(k);
                let own = lines.sliding(v) - lever * line.value(lever * v);
                assert!((own - friction.sliding(v)).abs() < 0.016 * 0.1, "{v}: {own} {}", friction.sliding(v));
            }
            assert_eq!(lines.breakaway(true), friction.breakaway(true));
        }
        // On a belt that stretches the cart does not move as the pulley does.
        let elastic = format!("drive_pulley.friction={curve}");
        assert_eq!(straightened(&Case::from_text_with("axis.toml", TEMPLATE, &[&elastic]).unwrap().machine), None);
    }
}
