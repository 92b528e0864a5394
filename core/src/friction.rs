//! Friction laws: resistance of a sliding body, and breakaway of a body at rest.

mod law;

pub(crate) use law::decay_of_velocity;
pub use law::{Law, Shape, velocity_of_decay};

/// Friction with breakaway, separate values for each direction, and the law between breakaway and Coulomb friction.
///
/// By the paper's law, sliding forward: F_f = b v + F_c, sliding backward: F_f = b v − F_c (eq. 15); at rest: whatever
/// holds the body, up to the breakaway. Units: for a cart N s/m and N, for a pulley N m s and N m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Friction {
    /// While moving in the positive direction.
    pub forward: Side,
    /// While moving in the negative direction; its values are positive, too.
    pub backward: Side,
    /// Its law between breakaway and Coulomb friction.
    pub law: Law,
}

/// Friction in one direction.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Side {
    /// Viscous coefficient b (cart, N s/m) or B (pulley, N m s), eq. (1)-(3).
    pub viscous: f64,
    /// Coulomb force F_c (N) or torque τ_c (N m), eq. (15).
    pub coulomb: f64,
    /// Breakaway: friction that a body at rest overcomes before it slides in this direction; at least `coulomb`.
    pub breakaway: f64,
}

impl Friction {
    /// Friction that is equal in both directions, with a breakaway equal to Coulomb friction: eq. (15).
    pub fn symmetric(viscous: f64, coulomb: f64) -> Self {
        let side = Side { viscous, coulomb, breakaway: coulomb };
        Self { forward: side, backward: side, law: Law::Coulomb }
    }

    /// Friction that is equal in both directions, with a higher breakaway.
    pub fn with_breakaway(viscous: f64, coulomb: f64, breakaway: f64) -> Self {
        let side = Side { viscous, coulomb, breakaway };
        Self { forward: side, backward: side, law: Law::Coulomb }
    }

    /// Each direction with its own values, after the paper's law.
    pub fn sided(forward: Side, backward: Side) -> Self {
        Self { forward, backward, law: Law::Coulomb }
    }

    /// These values with another law.
    pub fn following(self, law: Law) -> Self {
        Self { law, ..self }
    }

    /// Adds the friction of another body that moves `ratio` times as far.
    pub fn add(&mut self, other: &Friction, ratio: f64) {
        for (side, other) in [(&mut self.forward, other.forward), (&mut self.backward, other.backward)] {
            // Power is conserved: F = ρ τ, and τ = B ρ v
            side.viscous += ratio * ratio * other.viscous;
            side.coulomb += ratio * other.coulomb;
            side.breakaway += ratio * other.breakaway;
        }
    }

    /// True if it is b v alone, so that nothing sticks and the direction makes no difference.
    pub fn is_linear(&self) -> bool {
        self.forward == self.backward && self.forward.breakaway == 0.0 && self.forward.coulomb == 0.0
    }

    /// True if it is piecewise linear, as the exact solver requires.
    pub fn is_piecewise_linear(&self) -> bool {
        self.law == Law::Coulomb || self.is_linear()
    }

    /// True if a body can be held at rest by it, so that its motion has modes.
    pub fn sticks(&self) -> bool {
        !self.law.never_sticks() && !self.is_linear()
    }

    /// The values for this direction.
    pub fn side(&self, forward: bool) -> Side {
        if forward { self.forward } else { self.backward }
    }
}

/// The motion of a body, as far as friction is concerned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Motion {
    /// Sliding in the negative direction.
    Backward,
    /// At rest, held by friction.
    Stuck,
    /// Sliding in the positive direction.
    Forward,
    /// Without dry friction: nothing to distinguish.
    Free,
}

impl Motion {
    /// As in the result files: −1 backward, 0 stuck, 1 forward, 2 free.
    pub fn code(self) -> i8 {
        match self {
            Motion::Backward => -1,
            Motion::Stuck => 0,
            Motion::Forward => 1,
            Motion::Free => 2,
        }
    }

    /// The word for it.
    pub fn word(self) -> &'static str {
        match self {
            Motion::Backward => "backward",
            Motion::Stuck => "stuck",
            Motion::Forward => "forward",
            Motion::Free => "free",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_drag_that_is_the_same_in_both_directions_is_linear() {
        let side = |viscous, coulomb, breakaway| Side { viscous, coulomb, breakaway };
        let is_linear = |forward, backward| Friction { forward, backward, ..Friction::default() }.is_linear();
        assert!(is_linear(side(2.0, 0.0, 0.0), side(2.0, 0.0, 0.0)));
        assert!(!is_linear(side(2.0, 0.0, 0.0), side(3.0, 0.0, 0.0)));
        assert!(!is_linear(side(2.0, 0.0, 1.0), side(2.0, 0.0, 1.0)));
        assert!(!is_linear(side(2.0, 1.0, 1.0), side(2.0, 1.0, 1.0)));
    }
}
