//! The axis with each of its parameters wrong by some share.

use crate::stage::Stage;

/// `stage` with one parameter at a time, those above zero, times 1 + `share` and times 1 − `share`, and what was changed.
pub fn spread(stage: &Stage, share: f64) -> Vec<(String, Stage)> {
    type Change = fn(&mut Stage, f64);
    let changes: [(&str, Change); 14] = [
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
    let mut axes = Vec::new();
    for (name, change) in changes {
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
