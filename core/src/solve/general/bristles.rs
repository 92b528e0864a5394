//! The bristles of LuGre friction in a step.
//!
//! Bristles are solved at the nodes of a step together with their force. With a_i = σ₀ |v_i|/g(v_i) and the matrix R
//! that integrates a polynomial to the nodes, ż = v − a z is a linear system for the deflections there, whatever a is:
//!
//! ```text
//! z_i + h Σ_j R_ij a_j z_j = z₀ + h Σ_j R_ij v_j
//! ```
//!
//! If bristles slip within a step, R is Radau's: z follows g(v) without oscillation. If they bend, the rate at the
//! beginning is a fifth value, which makes its quartic as accurate as that of the force.

use super::model::{Curved, Sliding};
use super::radau::{Lane, NODES, QUARTIC, RADAU, Slopes};
use crate::friction::Law;
use crate::mechanism::BODIES;

/// Bristles that slip by more than this share of their deflection within a step are stiff.
pub(super) const STIFF: f64 = 2.0;

/// The bristles of a body in a step.
#[derive(Clone, Copy, Default)]
pub(super) struct Bristle {
    /// Their deflections at the nodes.
    pub(super) bent: Lane,
    /// ż at the beginning.
    pub(super) rate: f64,
    /// True if they slip by more than [`STIFF`] of their deflection.
    pub(super) is_stiff: bool,
}

/// Bristles of all bodies.
pub(super) type Bristles = [Bristle; BODIES];

/// The matrix of the deflections at the nodes, I + h R diag(a), parted in two triangles.
pub(super) struct Bent {
    parts: Slopes,
    order: [usize; NODES],
    is_stiff: bool,
}

impl Bent {
    pub(super) fn new(h: f64, laws: &[Sliding; NODES], is_stiff: bool) -> Self {
        let mut parts: Slopes = std::array::from_fn(|i| {
            std::array::from_fn(|j| h * weight(is_stiff, i, j) * laws[j].slip + if i == j { 1.0 } else { 0.0 })
        });
        let order = decompose(&mut parts);
        Self { parts, order, is_stiff }
    }

    pub(super) fn solve(&self, right: &Lane) -> Lane {
        let mut x: Lane = self.order.map(|row| right[row]);
        for i in 1..NODES {
            for j in 0..i {
                x[i] -= self.parts[i][j] * x[j];
            }
        }
        for i in (0..NODES).rev() {
            for j in i + 1..NODES {
                x[i] -= self.parts[i][j] * x[j];
            }
            x[i] /= self.parts[i][i];
        }
        x
    }

    pub(super) fn deflections(&self, h: f64, begin: f64, rate: f64, v: &Lane) -> Lane {
        let right = |i: usize| {
            let known = if self.is_stiff { 0.0 } else { QUARTIC[i][0] * rate };
            begin + h * v.iter().enumerate().fold(known, |sum, (j, v)| sum + weight(self.is_stiff, i, j) * v)
        };
        self.solve(&std::array::from_fn(right))
    }

    /// Slopes of the force if the rate of the bristles at node q changes by `by`(q) in addition to the effect of their
    /// deflection; `direct` is true if b v changes, too.
    pub(super) fn slopes(
        &self,
        h: f64,
        curved: &Curved,
        laws: &[Sliding; NODES],
        by: impl Fn(usize) -> f64,
        direct: f64,
    ) -> Slopes {
        let Law::LuGre { stiffness, damping, .. } = curved.friction.law else { return [[0.0; NODES]; NODES] };
        let mut slopes = [[0.0; NODES]; NODES];
        for q in 0..NODES {
            let by = by(q);
            let bent = self.solve(&std::array::from_fn(|i| h * weight(self.is_stiff, i, q) * by));
            for (i, slopes) in slopes.iter_mut().enumerate() {
                let own = if i == q { by } else { 0.0 };
                let rate = own - laws[i].slip * bent[i];
                slopes[q] = stiffness * bent[i] + damping * rate + if i == q { direct * laws[i].slope } else { 0.0 };
            }
        }
        slopes
    }
}

/// Deflection at node i by a rate at node j.
#[inline(always)]
pub(super) fn weight(is_stiff: bool, i: usize, j: usize) -> f64 {
    if is_stiff { RADAU[i][j] } else { QUARTIC[i][j + 1] }
}

/// Parts a matrix in two triangles with exchange of rows; what was where.
pub(super) fn decompose(matrix: &mut Slopes) -> [usize; NODES] {
    let mut order: [usize; NODES] = std::array::from_fn(|i| i);
    for k in 0..NODES {
        let best = (k..NODES).fold(k, |best, i| if matrix[i][k].abs() > matrix[best][k].abs() { i } else { best });
        matrix.swap(k, best);
        order.swap(k, best);
        let lead = matrix[k];
        for row in &mut matrix[k + 1..] {
            let factor = row[k] / lead[k];
            row[k] = factor;
            for (own, lead) in row[k + 1..].iter_mut().zip(&lead[k + 1..]) {
                *own -= factor * lead;
            }
        }
    }
    order
}
