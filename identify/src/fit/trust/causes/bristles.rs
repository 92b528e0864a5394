//! Friction whose bristles bend before they slip (LuGre).
//!
//! With the Coulomb friction C and the breakaway F_b, bristles bend by F_b/σ₀ before the body slides:
//!
//! ```text
//! ż = v − σ₀ |v| z / g        g = C + (F_b − C) e^{−(v/v_s)²}        F = σ₀ z + σ₁ ż
//! ```

use super::extension::{Extended, Fitted, Rubs, Said, Site, Telling, friction_of, shown};
use crate::fit::limits::{CAUSE_AROUND, CAUSE_BENDS, CAUSE_MOST_CURVED, MOST_BREAKAWAY, STRIBECK_ABOVE, STRIBECK_FALL};
use crate::friction::Law;
use crate::machine::Machine;

/// Bristles that bend by several lengths.
pub(super) fn bend(site: &Site) -> Vec<Extended> {
    let first = site.rubs().into_iter().next();
    let (Some(Rubs { key, arm, friction, .. }), Some(length)) = (first, site.position_deviation()) else {
        return Vec::new();
    };
    let coulomb = friction.forward.coulomb.min(friction.backward.coulomb);
    let fastest = site.fastest("cart");
    let is_long = site.found.problem.counted() > CAUSE_MOST_CURVED;
    if friction.law != Law::Coulomb || coulomb <= 0.0 || fastest <= 0.0 || is_long {
        return Vec::new();
    }
    let breakaway = (1.0 + STRIBECK_ABOVE) * friction.forward.coulomb.max(friction.backward.coulomb);
    // Lengths and speeds of the body for those of the cart: φ = x/r.
    let (r, lever) = (site.machine.pulley_radius, 1.0 / arm);
    let inertia = site.inertia() * (arm / r).powi(2);
    let of = |share: &f64| {
        // σ₀ = C/δ,  σ₁ = √(σ₀ J)
        let stiffness = coulomb / (share * length * lever);
        let damping = (stiffness * inertia).sqrt();
        let velocity = STRIBECK_FALL * fastest * lever;
        let mut machine = site.machine.clone();
        let own = friction_of(&mut machine, key);
        own.law = Law::LuGre { stiffness, damping, velocity };
        for side in [&mut own.forward, &mut own.backward] {
            side.breakaway = breakaway;
        }
        let mut plan = site.plan.clone();
        let around = |value: f64| CAUSE_AROUND.map(|factor| factor * value);
        let telling = format!("{key}.friction.lugre.stiffness");
        let bounds = [
            (telling.clone(), around(stiffness)),
            (format!("{key}.friction.lugre.damping"), [0.0, CAUSE_AROUND[1] * damping]),
            (format!("{key}.friction.lugre.velocity"), around(velocity)),
            (format!("{key}.friction.static"), [coulomb, MOST_BREAKAWAY * coulomb]),
        ];
        plan.free.extend(bounds.iter().map(|(key, _)| key.clone()));
        plan.bounds.extend(bounds);
        Extended::new(site.with(machine), plan, Telling::Parameter(telling))
    };
    CAUSE_BENDS.iter().map(of).collect()
}

/// Bristles in words.
pub(super) fn words(site: &Site, _: &Extended, found: &Fitted) -> Said {
    let (key, arm) = site.rubs().first().map_or(("cart", 1.0), |body| (body.key, body.arm));
    let friction = *friction_of(&mut found.machine.clone(), key);
    let [stiffness, damping, velocity] = match friction.law {
        Law::LuGre { stiffness, damping, velocity } => [stiffness, damping, velocity],
        _ => [0.0; 3],
    };
    let bend = friction.forward.breakaway / stiffness * arm;
    let [load, speed] = if key == "cart" { ["N", "m/s"] } else { ["N m", "rad/s"] };
    let [stiff, calm] = if key == "cart" { ["N/m", "N s/m"] } else { ["N m/rad", "N m s/rad"] };
    let [breakaway, stiffness, damping, velocity] =
        [(friction.forward.breakaway, load), (stiffness, stiff), (damping, calm), (velocity, speed)]
            .map(|(value, unit)| shown(value, unit));
    Said {
        words: format!(
            "friction of the {} whose bristles bend by {} before they slip (LuGre)",
            key.replace('_', " "),
            shown(bend, "m")
        ),
        add: format!(
            "add static = \"{breakaway}\", lugre = {{ stiffness = \"{stiffness}\", damping = \"{damping}\", velocity = \
             \"{velocity}\" }} to {key}.friction"
        ),
    }
}

/// The machine with Coulomb friction.
pub(super) fn without(site: &Site, mut machine: Machine) -> Machine {
    if let Some(Rubs { key, friction, .. }) = site.rubs().into_iter().next() {
        let own = friction_of(&mut machine, key);
        own.law = friction.law;
        for (side, own) in [(friction.forward, &mut own.forward), (friction.backward, &mut own.backward)] {
            own.breakaway = side.breakaway.max(own.coulomb);
        }
    }
    machine
}
