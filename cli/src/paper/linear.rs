//! The linear model as matrices: eq. (5)-(10) as printed and as they must be, their poles, and their response.

use super::model::{PULSE, UNTIL};
use nalgebra::{Complex, SMatrix, SVector, linalg::Schur};
use taut::friction::Motion;
use taut::plant::{Mode, Plant};
use taut::stage::Stage;

/// A of eq. (5), with the state of eq. (6).
pub type Matrix = SMatrix<f64, 6, 6>;

/// A and b of the equations that run, without dry friction: φ₁, φ₁′, x, x′, φ₃, φ₃′.
pub fn matrices(stage: &Stage) -> (Matrix, SVector<f64, 6>) {
    let plant = Plant::new(stage);
    let equations = plant.equations(Mode { motion: [Motion::Free; 3], gear_torque_positive: true });
    let mut a = Matrix::zeros();
    let mut b = SVector::<f64, 6>::zeros();
    for body in 0..3 {
        let row = 2 * body + 1;
        let form = equations.acceleration[body];
        for (column, value) in form.on_state(stage.pulley_radius).into_iter().take(6).enumerate() {
            a[(row, column)] = value;
        }
        a[(row - 1, row)] = 1.0;
        b[row] = form.input;
    }
    (a, b)
}

/// A of eq. (7), entry by entry as printed, or with −b/M where +b/M is printed.
pub fn printed(stage: &Stage, sign_corrected: bool) -> Matrix {
    let r2 = stage.pulley_radius.powi(2);
    let [k1, k2, k3] = stage.belt.stiffness;
    let (j1, j2, m) = (stage.drive_pulley.inertia, stage.idler_pulley.inertia, stage.cart.mass);
    let viscous = |law: &taut::friction::Friction| law.forward.viscous;
    let (b1, b2) = (viscous(&stage.drive_pulley.friction), viscous(&stage.idler_pulley.friction));
    let b = viscous(&stage.cart.friction) * if sign_corrected { -1.0 } else { 1.0 };
    let motor = &stage.motor;
    let back_emf = motor.torque_constant * motor.back_emf_constant / (motor.resistance * j1);
    #[rustfmt::skip]
    let a = Matrix::from_row_slice(&[
        0.0, 1.0, 0.0, 0.0, 0.0, 0.0,
        -(k1 + k3) * r2 / j1, -b1 / j1 - back_emf, k1 * r2 / j1, 0.0, k3 * r2 / j1, 0.0,
        0.0, 0.0, 0.0, 1.0, 0.0, 0.0,
        k1 / m, 0.0, -(k1 + k2) / m, b / m, k2 / m, 0.0,
        0.0, 0.0, 0.0, 0.0, 0.0, 1.0,
        k3 * r2 / j2, 0.0, k2 * r2 / j2, 0.0, -(k2 + k3) * r2 / j2, -b2 / j2,
    ]);
    a
}

/// The eigenvalues of `a`, 1/s, those with the largest real part first.
///
/// Speeds are measured in units of a thousand per second first, so that the entries are of one size.
pub fn poles(a: &Matrix) -> Vec<Complex<f64>> {
    const RATE: f64 = 1e3;
    let scale = Matrix::from_diagonal(&SVector::from([1.0, RATE, 1.0, RATE, 1.0, RATE]));
    let unscale = Matrix::from_diagonal(&SVector::from([1.0, 1.0 / RATE, 1.0, 1.0 / RATE, 1.0, 1.0 / RATE]));
    let scaled = unscale * a * scale;
    // The iteration is bounded; where it does not settle, a rotated copy, which has the same eigenvalues, does.
    for turn in 0..8 {
        let (s, c) = (0.1 + 0.37 * f64::from(turn)).sin_cos();
        let mut rotation = Matrix::identity();
        if turn > 0 {
            (rotation[(0, 0)], rotation[(0, 3)], rotation[(3, 0)], rotation[(3, 3)]) = (c, s, -s, c);
        }
        let copy = rotation * scaled * rotation.transpose();
        if let Some(schur) = Schur::try_new(copy, f64::EPSILON, 10_000) {
            let mut all: Vec<_> = schur.complex_eigenvalues().iter().copied().collect();
            all.sort_by(|p, q| q.re.total_cmp(&p.re).then(q.im.total_cmp(&p.im)));
            return all;
        }
    }
    Vec::new()
}

/// An oscillation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillation {
    /// Undamped natural frequency |λ|/2π, Hz.
    pub frequency: f64,
    /// Damping ratio −Re λ/|λ|.
    pub damping: f64,
}

/// The oscillations among the poles, the slowest first.
pub fn oscillations(poles: &[Complex<f64>]) -> Vec<Oscillation> {
    let mut all: Vec<_> = poles
        .iter()
        .filter(|p| p.im > 1e-6 * p.norm())
        .map(|p| Oscillation {
            frequency: p.norm() / (2.0 * std::f64::consts::PI),
            damping: -p.re / p.norm(),
        })
        .collect();
    all.sort_by(|p, q| p.frequency.total_cmp(&q.frequency));
    all
}

/// The state of x′ = A x + b u after a pulse of `volts` and the rest of the run, by the matrix exponential over 1 ms.
pub fn after_pulse(a: &Matrix, b: &SVector<f64, 6>, volts: f64) -> SVector<f64, 6> {
    const STEP: f64 = 1e-3;
    let mut whole = SMatrix::<f64, 7, 7>::zeros();
    whole.fixed_view_mut::<6, 6>(0, 0).copy_from(&(a * STEP));
    whole.fixed_view_mut::<6, 1>(0, 6).copy_from(&(b * STEP));
    let propagator = whole.exp();
    let mut state = SVector::<f64, 7>::zeros();
    for step in 0..(UNTIL / STEP).round() as usize {
        state[6] = if step < (PULSE / STEP).round() as usize { volts } else { 0.0 };
        state = propagator * state;
    }
    state.fixed_rows::<6>(0).into_owned()
}
