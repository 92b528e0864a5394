//! Parts of mechanisms for tests.

use super::{Body, Label, MotionKind, Spring, SpringLaw};
use crate::friction::Friction;

pub(crate) const PART: Label = Label { key: "part", name: "part" };

/// The body with this number, which slides without friction; its mass in kg.
pub(crate) fn body(number: usize, mass: f64) -> Body {
    Body {
        label: PART,
        kind: MotionKind::Linear,
        inertia: mass,
        friction: Friction::default(),
        force: 0.0,
        along: None,
        leader: (number, 1.0),
        is_rotor: false,
    }
}

/// An undamped spring that acts on bodies with these arms; its stiffness in N/m.
pub(crate) fn spring(arms: &[(usize, f64)], stiffness: f64) -> Spring {
    Spring { label: PART, arms: arms.to_vec(), stiffness, damping: 0.0, law: SpringLaw::TwoSided, follows: None }
}
