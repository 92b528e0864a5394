//! Rest on bent bristles.
//!
//! Bristles never stick: a body that they hold comes to rest by an oscillation that decays, but never ends. Once what
//! is left of it moves no body by more than a small part of the tolerance, until the input changes, bodies count as at
//! rest.
//!
//! With bristles of stiffness σ at each body that moves, the stiffness matrix is at least diag(σ), and with damping c
//! of each, the energy of an oscillation decays at least as fast as e^{−2λt}:
//!
//! ```text
//! E ≤ ½ Σ m v² + ½ Σ (m a)²/σ          λ = ½ min(c/m, σ/c)
//! |x − x∞| ≤ √(2E/σ) + ∫ |v| dt        ∫ |v| dt ≤ √(2E/m)/λ
//! ```
//!
//! The integral bounds how far bristles slip meanwhile.

use super::linear::States;
use super::model::{Model, Vector};
use super::sources::Source;
use crate::friction::{Law, Motion};
use crate::mechanism::{BODIES, Equations, Mode};

/// How far bodies and currents may be from rest, as a share of the tolerance.
const SHARE: f64 = 0.1;

/// Least value of a guard that an oscillation so small cannot bring to zero, as a share of its parts.
pub(super) const FAR: f64 = 1e-6;

/// A body that bristles hold, with all that moves with it.
struct Held {
    /// The places of its coordinate and speed, and of the speeds that go with it.
    coordinate: usize,
    speed: usize,
    followers: Vec<usize>,
    /// m, and σ of its bristles.
    mass: f64,
    stiffness: f64,
}

/// The bodies of a mode in which bristles hold whatever moves.
pub(super) struct Calm {
    held: Vec<Held>,
    /// λ, 1/s.
    decay: f64,
    /// The places of currents, and R/L of each, 1/s.
    currents: Vec<(usize, f64)>,
}

impl Calm {
    /// None if something moves that no bristles hold, or that nothing damps.
    pub(super) fn new(
        (model, mode): (&Model, &Mode),
        sources: &[Source],
        equations: &Equations,
        mass: &[f64; BODIES],
    ) -> Option<Self> {
        let mechanism = &*model.mechanism;
        let mut held = Vec::new();
        let mut decay = f64::INFINITY;
        if !sources.iter().all(|source| matches!(source, Source::Friction { .. })) {
            return None;
        }
        for leader in mechanism.leaders().filter(|&leader| mode.motion[leader] != Motion::Stuck) {
            // σ and b + σ₁ of all bristles that move with it, at its own speed.
            let (mut stiffness, mut damping) = (0.0, 0.0);
            for curved in model.curved.iter().filter(|curved| curved.leader == leader) {
                let Law::LuGre { stiffness: own, damping: of_bristles, .. } = curved.friction.law else { return None };
                let viscous = curved.friction.forward.viscous.min(curved.friction.backward.viscous);
                stiffness += curved.ratio * curved.ratio * own;
                damping += curved.ratio * curved.ratio * (viscous + of_bristles);
            }
            let mass = mass[leader];
            let most = damping + mass * equations.acceleration[leader].speed[leader].abs();
            if mode.motion[leader] != Motion::Free || stiffness <= 0.0 || damping <= 0.0 {
                return None;
            }
            decay = decay.min(0.5 * (damping / mass).min(stiffness / most));
            let followers = mechanism.followers(leader).map(|body| model.speed(body)).collect();
            let (coordinate, speed) = (model.coordinate(leader), model.speed(leader));
            held.push(Held { coordinate, speed, followers, mass, stiffness });
        }
        let own = |(drive, place): (usize, &Option<usize>)| {
            place.map(|place| (place, equations.current_rate[drive].current[drive].abs()))
        };
        let currents = model.current.iter().enumerate().filter_map(own).collect();
        (!held.is_empty()).then_some(Self { held, decay, currents })
    }

    /// True if nothing moves by more than its share of `absolute` any more; `rate` is asked for where speeds are small.
    pub(super) fn holds(&self, y: &Vector, absolute: &Vector, rate: impl FnOnce() -> States) -> bool {
        let is_small = |twice: f64| {
            self.held.iter().all(|body| {
                let far = (twice / body.stiffness).sqrt() + (twice / body.mass).sqrt() / self.decay;
                far <= SHARE * absolute[body.coordinate]
            })
        };
        let kinetic: f64 = self.held.iter().map(|body| body.mass * y[body.speed] * y[body.speed]).sum();
        if !is_small(kinetic) {
            return false;
        }
        let rate = rate();
        let of_force = |body: &Held| (body.mass * rate[body.speed]).powi(2) / body.stiffness;
        let decayed = |&(place, decay): &(usize, f64)| rate[place].abs() <= SHARE * absolute[place] * decay;
        is_small(kinetic + self.held.iter().map(of_force).sum::<f64>()) && self.currents.iter().all(decayed)
    }

    /// The places of the speeds of the bodies.
    pub(super) fn speeds(&self) -> impl Iterator<Item = usize> {
        self.held.iter().flat_map(|body| body.followers.iter().copied())
    }
}
