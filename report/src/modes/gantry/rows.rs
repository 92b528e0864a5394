//! The modes of a gantry in words.

use taut::linear::{ElasticMode, GantryAnalysis, RigidMode, Root};
use taut::mechanism::Mechanism;
use taut::number::{engineering_typed, fixed};

/// The name of a rigid mode, and how the pulleys turn in it.
pub fn rigid(analysis: &GantryAnalysis, mechanism: &Mechanism, mode: &RigidMode) -> (&'static str, String) {
    let ways =
        analysis.modes.bodies.iter().zip(&mode.shape).filter(|(body, _)| **body != mode.body).map(|(body, way)| {
            let body = &mechanism.bodies[*body];
            let unit = body.kind.units()[0];
            match way {
                0.0 => format!("{} 0", body.label.name),
                way => format!("{} {} {unit}", body.label.name, fixed(*way, 2)),
            }
        });
    let body = &mechanism.bodies[mode.body];
    let ways: Vec<String> = ways.collect();
    (body.label.name, format!("per {}: {}", body.kind.units()[0], ways.join(", ")))
}

/// The damping of the rigid modes: the poles that do not swing, integrators apart.
pub fn slow(analysis: &GantryAnalysis) -> impl Iterator<Item = Root> {
    analysis.modes.poles.iter().copied().filter(|root| matches!(root, Root::Real(_)))
}

/// Frequency, damping, shape and energy of an elastic mode.
pub fn elastic(analysis: &GantryAnalysis, mechanism: &Mechanism, mode: &ElasticMode) -> [String; 4] {
    let damping = match mode.damped {
        Some(root @ Root::Pair { damping, .. }) => format!(
            "damping {}, time constant {}, damped frequency {} Hz",
            engineering_typed(damping, "", 4),
            engineering_typed(root.time_constant(), "s", 4),
            engineering_typed(root.damped_hertz().unwrap_or(0.0), "", 5)
        ),
        _ => "damped so much that not every mode swings".into(),
    };
    let name = |body: usize| mechanism.bodies[body].label.name;
    let bodies = || analysis.modes.bodies.iter().copied();
    let shape: Vec<String> =
        bodies().zip(&mode.shape).map(|(body, way)| format!("{} {}", name(body), fixed(*way, 3))).collect();
    let mut shares: Vec<(usize, f64)> = bodies().zip(mode.energy.iter().copied()).collect();
    // Alike ones stay in the order of the bodies.
    shares.sort_by(|a, b| (b.1 * 1e6).round().total_cmp(&(a.1 * 1e6).round()));
    let shares = shares.iter().filter(|(_, share)| *share >= 0.005);
    let energy: Vec<String> =
        shares.map(|(body, share)| format!("{} {} %", name(*body), fixed(100.0 * share, 0))).collect();
    [
        format!("{} Hz", engineering_typed(mode.hertz(), "", 5)),
        damping,
        format!("ways at the belt: {}", shape.join(", ")),
        format!("energy: {}", energy.join(", ")),
    ]
}

/// Whether the resonances depend on the place, in words.
pub fn over_the_area(analysis: &GantryAnalysis) -> &'static str {
    match &analysis.map {
        Some(_) => "the spans follow bridge and cart: k = A E / l with the length that is left",
        None => {
            "the same everywhere: in this file the spans' stiffness does not depend on the place \
             (belt.modulus, section, spans and follows_cart = true make the spans follow bridge and cart)"
        }
    }
}
