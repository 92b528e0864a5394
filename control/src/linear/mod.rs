//! Linear analysis of a machine.
//!
//! [`StateSpace::new`] gives the equations of a sliding machine as ẋ = A x + b u, y = C x + d u, from the forms that the
//! solvers use. From these follow [poles](StateSpace::poles), [zeros](StateSpace::zeros), [`Response`] over frequency,
//! resonance and anti-resonance [along the travel](travel), and [`Discrete`] models for a sample time.
//!
//! [`Natural`] contains rigid and elastic modes of any mechanism, [`ResonanceMap`] those of a gantry over its working
//! area, [`Analysis`] everything.
//!
//! Dry friction that does not depend on speed drops out while everything slides; stuck bodies are named in
//! [`Operation::held`].

mod analysis;
mod area;
mod discrete;
pub(crate) mod eigen;
mod frame;
mod model;
mod natural;
mod response;
mod travel;
mod words;
mod zeros;

pub use analysis::{Analysis, ByInput, Question, within_travel};
pub use area::ResonanceMap;
pub use discrete::{Discrete, Hold};
pub use frame::Variable;
pub use model::{Operation, StateSpace, System, placed};
pub use natural::{ElasticMode, Natural, RigidMode};
pub use response::{Range, Response, Transfer};
pub use travel::{ResonancesAt, place, places, travel, undamped};
pub(crate) use words::assumptions;
pub use words::sticks;
pub use zeros::Zeros;

use crate::error::Result;
use nalgebra::{Complex, DMatrix};
use std::f64::consts::PI;

impl StateSpace {
    /// Poles: eigenvalues of A, 1/s, conjugates side by side, the slowest first. An integrator is exactly zero.
    pub fn poles(&self) -> Result<Vec<Complex<f64>>> {
        eigen::eigenvalues(&self.inner.a)
    }

    /// Invariant zeros of an output, 1/s, and its gain. If an output does not depend on the axis' position, one of its
    /// zeros is 0 and cancels the integrator. None for an unknown output.
    pub fn zeros(&self, output: usize) -> Option<Result<Zeros>> {
        let d = *self.d.get(output)?;
        let row = |c: &DMatrix<f64>| c.row(output).transpose();
        let degree = zeros::relative_degree(&self.a, &self.b, &row(&self.c), d);
        Some(zeros::zeros(&self.inner.a, &self.inner.b, &row(&self.inner.c), d, degree))
    }
}

/// A pole or a zero in engineering terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Root {
    /// At zero: an integrator, or as a zero a differentiator.
    Zero,
    /// Real: e^{s t} with this s, 1/s.
    Real(f64),
    /// A conjugate pair.
    Pair {
        /// Undamped natural frequency |s|, rad/s.
        frequency: f64,
        /// Damping ratio −Re s/|s|; negative for a growing mode.
        damping: f64,
    },
}

impl Root {
    /// Roots for each real value and each pair, in the order given.
    pub fn from_values(values: &[Complex<f64>]) -> Vec<Root> {
        let one = |value: &Complex<f64>| match *value {
            v if v.im > 0.0 => Some(Root::Pair { frequency: v.norm(), damping: -v.re / v.norm() }),
            v if v.im < 0.0 => None,
            v if v.re == 0.0 => Some(Root::Zero),
            v => Some(Root::Real(v.re)),
        };
        values.iter().filter_map(one).collect()
    }

    /// Time in which it decays (or grows) by the factor e, s; infinite if it does neither.
    pub fn time_constant(self) -> f64 {
        match self {
            Root::Zero => f64::INFINITY,
            Root::Real(s) => 1.0 / s.abs(),
            // 1/|Re s| = 1/(ζ ω)
            Root::Pair { frequency, damping } => 1.0 / (damping * frequency).abs(),
        }
    }

    /// Undamped natural frequency in Hz, of a pair.
    pub fn hertz(self) -> Option<f64> {
        match self {
            Root::Pair { frequency, .. } => Some(frequency / (2.0 * PI)),
            _ => None,
        }
    }

    /// Damped frequency, Hz: |Im s|/2π.
    pub fn damped_hertz(self) -> Option<f64> {
        match self {
            Root::Pair { frequency, damping } => Some(frequency * (1.0 - damping * damping).sqrt() / (2.0 * PI)),
            _ => None,
        }
    }
}
