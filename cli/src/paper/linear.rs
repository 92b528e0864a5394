//! The linear model as matrices: eq. (5)-(10) as printed and as they must be, their poles, and their response.

use super::model::{PULSE, UNTIL};
use nalgebra::{Complex, SMatrix, SVector, linalg::Schur};
use taut::machine::Machine;
use taut::mechanism::Mode;

/// A of eq. (5), with the state of eq. (6).
pub type Matrix = SMatrix<f64, 6, 6>;

/// A and b of the equations that run, without dry friction: φ₁, φ₁′, x, x′, φ₃, φ₃′.
pub fn matrices(machine: &Machine) -> (Matrix, SVector<f64, 6>) {
    let mechanism = machine.mechanism();
    let equations = mechanism.equations(Mode::new([]));
    let mut a = Matrix::zeros();
    let mut b = SVector::<f64, 6>::zeros();
    for body in 0..3 {
        let row = 2 * body + 1;
        let form = equations.acceleration[body];
        let state = form.on_state(&mechanism);
        for other in 0..3 {
            (a[(row, 2 * other)], a[(row, 2 * other + 1)]) = (state.position[other], state.speed[other]);
        }
        a[(row - 1, row)] = 1.0;
        b[row] = form.input[0];
    }
    (a, b)
}

/// A of eq. (7), entry by entry as printed, or with −b/M where +b/M is printed.
pub fn printed(machine: &Machine, sign_corrected: bool) -> Matrix {
    let r2 = machine.pulley_radius.powi(2);
    let [k1, k2, k3] = machine.belt.stiffness.three();
    let (j1, j2, m) = (machine.drive_pulley.inertia, machine.idler_pulley.inertia, machine.cart.mass);
    let viscous = |law: &taut::friction::Friction| law.forward.viscous;
    let (b1, b2) = (viscous(&machine.drive_pulley.friction), viscous(&machine.idler_pulley.friction));
    let b = viscous(&machine.cart.friction) * if sign_corrected { -1.0 } else { 1.0 };
    let motor = &machine.drives[0].motor;
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
        .map(|p| Oscillation { frequency: p.norm() / (2.0 * std::f64::consts::PI), damping: -p.re / p.norm() })
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

/// The linear model beside the printed matrix: its poles and its modes.
pub struct Linear {
    /// Modes of Table 1, of Table 2, and of Table 2 with the viscous friction of Table 4.
    pub modes: [Vec<Oscillation>; 3],
    /// The slow pole of the same three, 1/s, and what a rigid belt gives: −B_tot/J_tot.
    pub slow: [(f64, f64); 3],
    /// Largest real part among the poles of (7) as printed: Table 1 and Table 2, 1/s.
    pub printed_pole: [f64; 2],
    /// The pole with −b/M.
    pub corrected_pole: [f64; 2],
    /// r φ₁ at the end of the 5 V run with (7) as printed, Table 1, m.
    pub printed_end: f64,
    /// x₃ at the end of the 5 V run with (7) but −b/M, Table 1: what eq. (6) calls the cart's position, m.
    pub corrected_x3: f64,
    /// Its x₁ there times r, m.
    pub corrected_end: f64,
    /// Final position by the matrices of eq. (1)-(4) and the matrix exponential, m: an independent path to the same
    /// number.
    pub by_exponential: f64,
    /// r K_t/R · V · T/(B₁ + B₂ + b r² + K_t K_e/R) for 5 V and Table 1, m: where every linear set must end.
    pub closed_form: f64,
    /// Cart at a distance l₁ from the drive pulley, m; frequencies of the two modes of Table 2 there, Hz.
    pub travel: Vec<(f64, [f64; 2])>,
}

/// Nearest that the cart comes to a pulley in the sweep along the travel, m.
pub const NEAREST: f64 = 0.05;

impl Linear {
    /// Computes it.
    pub fn new(sets: &super::model::Sets) -> Self {
        let stages = [&sets.table1.machine, &sets.table2.machine, &sets.table4.machine];
        let all = stages.map(|machine| poles(&matrices(machine).0));
        let slowest = |poles: &[Complex<f64>]| {
            poles.iter().filter(|p| p.im == 0.0 && p.re < -1e-3).map(|p| p.re).fold(f64::NEG_INFINITY, f64::max)
        };
        let rigid = |machine: &Machine| {
            let r2 = machine.pulley_radius.powi(2);
            let inertia = machine.drive_pulley.inertia + machine.idler_pulley.inertia + machine.cart.mass * r2;
            -total_viscous(machine) / inertia
        };
        let rightmost = |a: &Matrix| poles(a).first().map_or(f64::NAN, |p| p.re);
        let both = |signed: bool| [stages[0], stages[1]].map(|machine| rightmost(&printed(machine, signed)));
        let first = stages[0];
        let r = first.pulley_radius;
        let (a, b) = matrices(first);
        let corrected = after_pulse(&printed(first, true), &b, 5.0);
        let motor = &first.drives[0].motor;
        let impulse = motor.torque_constant / motor.resistance * 5.0 * PULSE;
        Self {
            modes: [0, 1, 2].map(|i| oscillations(&all[i])),
            slow: [0, 1, 2].map(|i| (slowest(&all[i]), rigid(stages[i]))),
            printed_pole: both(false),
            corrected_pole: both(true),
            printed_end: r * after_pulse(&printed(first, false), &b, 5.0)[0],
            corrected_x3: corrected[2],
            corrected_end: r * corrected[0],
            by_exponential: r * after_pulse(&a, &b, 5.0)[0],
            closed_form: r * impulse / total_viscous(first),
            travel: travel(stages[1]),
        }
    }
}

/// B₁ + B₂ + b r² + K_t K_e/R, N m s: all that resists in proportion to speed.
fn total_viscous(machine: &Machine) -> f64 {
    let b = |law: &taut::friction::Friction| law.forward.viscous;
    let motor = &machine.drives[0].motor;
    b(&machine.drive_pulley.friction)
        + b(&machine.idler_pulley.friction)
        + b(&machine.cart.friction) * machine.pulley_radius.powi(2)
        + motor.torque_constant * motor.back_emf_constant / motor.resistance
}

/// The modes with spans 1 and 2 as long as the cart's place makes them; their stiffness times length stays.
fn travel(machine: &Machine) -> Vec<(f64, [f64; 2])> {
    let middle = super::belt::INCHES.0;
    let product = machine.belt.stiffness[0] * middle;
    let count = 120;
    (0..=count)
        .map(|i| {
            let l1 = NEAREST + (middle - NEAREST) * 2.0 * f64::from(i) / f64::from(count);
            let mut moved = machine.clone();
            moved.belt.stiffness[0] = product / l1;
            moved.belt.stiffness[1] = product / (2.0 * middle - l1);
            let modes = oscillations(&poles(&matrices(&moved).0));
            let frequency = |i: usize| modes.get(i).map_or(f64::NAN, |m| m.frequency);
            (l1, [frequency(0), frequency(1)])
        })
        .collect()
}
