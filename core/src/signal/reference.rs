//! A reference at an instant, and what limits it.

use crate::calculator::{Calculator, Number};

/// Limits of a move. SI units; all above zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Speed, m/s.
    pub speed: f64,
    /// Acceleration, m/s².
    pub acceleration: f64,
    /// Jerk, m/s³; without it the acceleration jumps.
    pub jerk: Option<f64>,
    /// Snap, m/s⁴; needs a jerk limit. Without it the jerk jumps.
    pub snap: Option<f64>,
}

impl Limits {
    /// Limits of a trapezoid: neither jerk nor snap is limited.
    pub fn new(speed: f64, acceleration: f64) -> Self {
        Self { speed, acceleration, jerk: None, snap: None }
    }
}

/// Reference position of the cart and its first four derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reference<N = f64> {
    /// y, m.
    pub position: N,
    /// y′, m/s.
    pub speed: N,
    /// y″, m/s².
    pub acceleration: N,
    /// y‴, m/s³; zero for a trapezoid, whose acceleration jumps.
    pub jerk: N,
    /// y⁗, m/s⁴; zero where the jerk jumps.
    pub snap: N,
}

impl Reference {
    /// At rest there.
    pub fn at(position: f64) -> Self {
        Self { position, ..Self::default() }
    }

    /// At this speed, m/s.
    pub fn steady(speed: f64) -> Self {
        Self { speed, ..Self::default() }
    }

    /// Σ y⁽ᵏ⁾ tᵏ/k!: the reference a time `t` later, s, with a constant snap.
    pub fn after(&self, t: f64) -> Self {
        if t == 0.0 {
            return *self;
        }
        let Self { position, speed, acceleration, jerk, snap } = *self;
        Self {
            position: position + t * (speed + t * (acceleration / 2.0 + t * (jerk / 6.0 + t * snap / 24.0))),
            speed: speed + t * (acceleration + t * (jerk / 2.0 + t * snap / 6.0)),
            acceleration: acceleration + t * (jerk + t * snap / 2.0),
            jerk: jerk + t * snap,
            snap,
        }
    }
}

impl<N: Number> Reference<N> {
    /// Itself and `weight` times another.
    pub fn plus(self, weight: f64, other: Self) -> Self {
        Self {
            position: self.position + other.position * weight,
            speed: self.speed + other.speed * weight,
            acceleration: self.acceleration + other.acceleration * weight,
            jerk: self.jerk + other.jerk * weight,
            snap: self.snap + other.snap * weight,
        }
    }

    /// Σ w_s q_s, such as the position of a drive along its belt from those of all slides.
    pub fn weighed<C: Calculator<N = N>>(c: &mut C, weights: impl Iterator<Item = f64>, slides: &[Self]) -> Self {
        let zero = c.number(0.0);
        let none = Self { position: zero, speed: zero, acceleration: zero, jerk: zero, snap: zero };
        let moving = weights.zip(slides).filter(|(weight, _)| *weight != 0.0);
        moving.fold(none, |sum, (weight, slide)| sum.plus(weight, *slide))
    }
}
