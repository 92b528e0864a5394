//! Slowest elastic mode of a machine on its belt, to which a damping ratio or a loss factor refers.

use crate::friction::Motion;
use crate::mechanism::{BODIES, Mechanism, Mode};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Eigenvalues up to this fraction of the largest count as zero.
const NOTHING: f64 = 1e-9;

/// Frequency of the slowest elastic mode on the spans of the belt and the bearings of the bridge, rad/s, at the origin
/// and without damping; rotors turn with their pulleys. None for a machine whose belt does not stretch.
///
/// M q̈ + K q = 0 with K = Σ k a aᵀ over the spans: the least eigenvalue of M^(−½) K M^(−½) above zero is ω₀².
pub fn slowest_swing(mechanism: &Mechanism) -> Option<f64> {
    let bodies: Vec<usize> = mechanism.leaders().filter(|&body| !mechanism.bodies[body].is_rotor).collect();
    let n = bodies.len();
    let inertia = mechanism.equations(Mode::new([Motion::Free; BODIES])).inertia;
    let mut mass = DVector::from_iterator(
        n,
        bodies.iter().map(|&leader| {
            mechanism.followers(leader).map(|body| mechanism.ratio(body).powi(2) * inertia[body]).sum::<f64>()
        }),
    );
    for drive in mechanism.drives.iter().filter(|drive| drive.has_rotor()) {
        let leader = mechanism.leader(drive.pulley);
        if let Some(place) = bodies.iter().position(|body| *body == leader) {
            mass[place] += mechanism.ratio(drive.pulley).powi(2) * mechanism.bodies[drive.shaft].inertia;
        }
    }
    let mut stiffness = DMatrix::zeros(n, n);
    // The bearings of a bridge that yaws hold it as a span does.
    let yaws = |spring: &usize| mechanism.ride.is_some_and(|ride| mechanism.springs[*spring].arms == [(ride.yaw, 1.0)]);
    let bearings: Vec<usize> = (0..mechanism.springs.len()).filter(yaws).collect();
    for &span in mechanism.roles.spans.iter().chain(&bearings) {
        let arms = mechanism.leading_arms(span);
        let row = DVector::from_fn(n, |i, _| arms[bodies[i]]);
        stiffness += &row * row.transpose() * mechanism.springs[span].stiffness;
    }
    let scaled = DMatrix::from_fn(n, n, |i, j| stiffness[(i, j)] / (mass[i] * mass[j]).sqrt());
    if scaled.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let values = SymmetricEigen::try_new(scaled, f64::EPSILON, 10_000)?.eigenvalues;
    let largest = values.max();
    let swings = values.iter().copied().filter(|value| *value > NOTHING * largest && *value > 0.0);
    swings.min_by(f64::total_cmp).map(f64::sqrt)
}
