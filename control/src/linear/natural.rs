//! Natural modes of any sliding mechanism: rigid and elastic modes, their damping, and their dependence on position.
//!
//! ```text
//! M q̈ + C q̇ + K q = 0,   K = Aᵀ diag(k) A,   C = Aᵀ diag(c) A + B + n² K_t K_e / R
//! ```
//!
//! over the independent bodies; A has a row for each stepper, whose field is a spring to its commanded angle. M is
//! diagonal, except that a cart on a bridge that yaws adds m y to bridge and yaw and m y² to the yaw. Undamped modes
//! are the eigenvectors of M^(−½) K M^(−½), or of L⁻¹ K L⁻ᵀ with M = L Lᵀ; the number of rigid ones, whose frequency is
//! zero by construction, is the dimension of the null space of A.

use super::{Root, eigen};
use crate::error::{Error, Result};
use crate::friction::Motion;
use crate::mechanism::{AmplifierMode, BODIES, Mechanism, Mode, MotionKind, Phases, SpringLaw};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use std::f64::consts::PI;

/// Singular values of the spans' lever arms up to this fraction of the largest are zero.
const NOTHING: f64 = 1e-12;

/// Rigid and elastic modes of a mechanism at one position.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Natural {
    /// The independent bodies, by their numbers; shapes are in their order.
    pub bodies: Vec<usize>,
    /// Rigid modes, one for each freely sliding body if any.
    pub rigid: Vec<RigidMode>,
    /// Elastic modes, the slowest first.
    pub elastic: Vec<ElasticMode>,
    /// Poles of the damped mechanism, beginning with an integrator for each rigid mode.
    pub poles: Vec<Root>,
}

/// A rigid mode: a motion without elongation.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RigidMode {
    /// The chosen body, which it moves by one unit; other chosen bodies do not move.
    pub body: usize,
    /// Displacement of each body, in its own unit, rad or m.
    pub shape: Vec<f64>,
}

/// An elastic mode.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ElasticMode {
    /// Frequency without damping, rad/s.
    pub frequency: f64,
    /// Its pair of damped poles; none unless every mode has one.
    pub damped: Option<Root>,
    /// Displacement of each body at the belt (r φ if rotary), normalised to a maximum of 1.
    pub shape: Vec<f64>,
    /// Fraction of the kinetic energy of each body.
    pub energy: Vec<f64>,
}

impl ElasticMode {
    /// Frequency without damping, Hz.
    pub fn hertz(&self) -> f64 {
        self.frequency / (2.0 * PI)
    }

    /// Damping ratio.
    pub fn damping(&self) -> Option<f64> {
        match self.damped {
            Some(Root::Pair { damping, .. }) => Some(damping),
            _ => None,
        }
    }
}

/// Matrices of a mechanism in which everything slides, over the independent bodies.
struct Matrices {
    bodies: Vec<usize>,
    /// Diagonal of M.
    mass: DVector<f64>,
    /// Additional elements (row, column, value), of a cart that rides on a bridge that yaws.
    coupled: Vec<(usize, usize, f64)>,
    stiffness: DMatrix<f64>,
    damping: DMatrix<f64>,
    /// Number of motions that no spring restrains.
    free: usize,
}

impl Natural {
    /// Modes with the bodies at `position`, which determines the stiffness of following spans.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// use taut::linear::Natural;
    /// let case = Case::from_text("axis.toml", TEMPLATE)?;
    /// let modes = Natural::new(&case.machine.mechanism(), &[0.0; 6])?;
    /// // An axis moves as a whole, and swings in two ways.
    /// assert_eq!((modes.rigid.len(), modes.elastic.len()), (1, 2));
    /// assert!(modes.elastic[0].hertz() > 100.0);
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn new(mechanism: &Mechanism, position: &[f64; BODIES]) -> Result<Self> {
        let matrices = Matrices::new(mechanism, position);
        let (values, vectors) = matrices.modes()?;
        // q = Φ η with Φᵀ M Φ = 1, rigid modes first.
        let shapes = matrices.shapes(&vectors)?;
        let moved = matrices.mass() * &shapes;
        let Matrices { bodies, coupled, damping, free, .. } = matrices;
        // The share of a body of ½ q̇ᵀ M q̇, with half of what it has in common with another.
        let energy = |i: usize, k: usize| match coupled.is_empty() {
            true => vectors[(i, k)].powi(2),
            false => shapes[(i, k)] * moved[(i, k)],
        };
        let poles = poles(&values, &(shapes.transpose() * damping * &shapes), free)?;
        let pairs: Vec<Root> = poles.iter().filter(|root| matches!(root, Root::Pair { .. })).copied().collect();
        let is_complete = pairs.len() == values.len() - free;
        let elastic = (free..values.len())
            .map(|k| {
                let shape = shapes.column(k);
                let lever = |i: usize| mechanism.bodies[bodies[i]].kind.lever();
                let ways: Vec<f64> = (0..bodies.len()).map(|i| lever(i) * shape[i]).collect();
                // The first of the largest displacements, so that rounding does not exchange equal bodies.
                let farther = |most: f64, way: f64| if way.abs() > most.abs() * (1.0 + 1e-9) { way } else { most };
                let largest = ways.iter().copied().fold(0.0, farther);
                let share = |way: &f64| if way.abs() <= NOTHING * largest.abs() { 0.0 } else { way / largest };
                ElasticMode {
                    frequency: values[k].sqrt(),
                    damped: is_complete.then(|| pairs[k - free]),
                    shape: ways.iter().map(share).collect(),
                    energy: (0..bodies.len()).map(|i| energy(i, k)).collect(),
                }
            })
            .collect();
        let slides = |i: usize| mechanism.bodies[bodies[i]].kind == MotionKind::Linear;
        let rigid = rigid(&shapes.columns(0, free).into_owned(), &slides);
        let rigid = rigid.into_iter().map(|(i, shape)| RigidMode { body: bodies[i], shape }).collect();
        Ok(Self { rigid, elastic, poles, bodies })
    }

    /// Undamped frequencies of the elastic modes alone, Hz, the lowest first.
    pub fn frequencies(mechanism: &Mechanism, position: &[f64; BODIES]) -> Result<Vec<f64>> {
        let matrices = Matrices::new(mechanism, position);
        let (values, _) = matrices.modes()?;
        Ok(values[matrices.free..].iter().map(|value| value.sqrt() / (2.0 * PI)).collect())
    }
}

impl Matrices {
    fn new(mechanism: &Mechanism, position: &[f64; BODIES]) -> Self {
        let bodies: Vec<usize> = mechanism.leaders().collect();
        let n = bodies.len();
        let free = Mode::new([Motion::Free; BODIES]);
        let inertia = mechanism.equations(free).inertia;
        let mass = |&leader: &usize| {
            mechanism.followers(leader).map(|body| mechanism.ratio(body).powi(2) * inertia[body]).sum::<f64>()
        };
        let mut damping = DMatrix::zeros(n, n);
        for (i, body) in bodies.iter().enumerate() {
            damping[(i, i)] = mechanism.friction(*body).forward.viscous;
        }
        for drive in &mechanism.drives {
            // K_t K_e / R at the motor's own shaft, n² of it at the pulley                   (4)
            let motor = &drive.motor;
            if drive.amplifier.mode == AmplifierMode::Voltage && motor.inductance == 0.0 {
                let i = bodies.iter().position(|body| *body == mechanism.leader(drive.shaft)).unwrap_or(0);
                let way = motor.gear_ratio * mechanism.ratio(drive.shaft);
                // A lossy stiff gear transmits this fraction.
                let passed = if drive.has_rotor() { 1.0 } else { motor.gear_efficiency };
                let emf = motor.torque_constant * motor.back_emf_constant / motor.resistance;
                damping[(i, i)] += passed * way * way * emf;
            }
        }
        let field = |drive: usize| {
            let (angle, _) = mechanism.angle_of(drive)?;
            Some((angle, Phases::new(&mechanism.drives[drive])?.stiffness()))
        };
        let fields: Vec<(usize, f64)> = (0..mechanism.drives.len()).filter_map(field).collect();
        let mut stiffness = DMatrix::zeros(n, n);
        let mut rows = Vec::new();
        for (spring, part) in mechanism.springs.iter().enumerate() {
            let holds = match part.law {
                SpringLaw::TwoSided | SpringLaw::Tension { .. } => true,
                // The flank of a gear is in contact; an end stop is not.
                SpringLaw::Gap { .. } => part.arms.len() > 1,
                // The field of a stepper holds its rotor.
                SpringLaw::Angle { .. } => true,
                SpringLaw::Line { .. } | SpringLaw::Bounds { .. } | SpringLaw::None => false,
            };
            let arms = mechanism.leading_arms(spring);
            let row = DVector::from_fn(n, |i, _| arms[bodies[i]]);
            if !holds || row.amax() == 0.0 {
                continue;
            }
            let own = fields.iter().find(|(angle, _)| *angle == spring).map_or(part.stiffness, |(_, field)| *field);
            let k = part.follows.as_ref().map_or(own, |follows| follows.stiffness(|body| position[body]));
            stiffness += &row * row.transpose() * k;
            damping += &row * row.transpose() * part.damping;
            rows.push(row);
        }
        let mass = DVector::from_iterator(n, bodies.iter().map(mass));
        let coupled = mechanism.ridden_mass(&bodies, position);
        // Number of independent rows, with displacements measured at the belt.
        let rank = if rows.is_empty() {
            0
        } else {
            let lever = |i: usize| mechanism.bodies[bodies[i]].kind.lever();
            let a = DMatrix::from_fn(rows.len(), n, |j, i| rows[j][i] / lever(i));
            let values = a.singular_values();
            values.iter().filter(|value| **value > NOTHING * values.max()).count()
        };
        Self { free: n - rank, bodies, mass, coupled, stiffness, damping }
    }

    /// M.
    fn mass(&self) -> DMatrix<f64> {
        let mut mass = DMatrix::from_diagonal(&self.mass);
        self.coupled.iter().for_each(|&(i, j, own)| mass[(i, j)] += own);
        mass
    }

    /// L⁻¹ X with M = L Lᵀ.
    fn solved(&self, x: &DMatrix<f64>) -> Result<DMatrix<f64>> {
        let lower = self.mass().cholesky().map(|parts| parts.l());
        lower.and_then(|lower| lower.solve_lower_triangular(x)).ok_or_else(no_modes)
    }

    /// Displacements of the modes with these eigenvectors: M^(−½) v, or L⁻ᵀ v.
    fn shapes(&self, vectors: &DMatrix<f64>) -> Result<DMatrix<f64>> {
        let n = self.bodies.len();
        match self.coupled.is_empty() {
            true => Ok(DMatrix::from_fn(n, n, |i, j| vectors[(i, j)] / self.mass[i].sqrt())),
            false => Ok(self.solved(&DMatrix::identity(n, n))?.transpose() * vectors),
        }
    }

    /// Eigenvalues of M^(−½) K M^(−½) in ascending order, zero for rigid modes, and its eigenvectors.
    fn modes(&self) -> Result<(Vec<f64>, DMatrix<f64>)> {
        let n = self.bodies.len();
        let root = self.mass.map(f64::sqrt);
        let scaled = match self.coupled.is_empty() {
            true => DMatrix::from_fn(n, n, |i, j| self.stiffness[(i, j)] / (root[i] * root[j])),
            false => {
                // L⁻¹ K L⁻ᵀ with M = L Lᵀ, made symmetric to the last bit
                let half = self.solved(&self.stiffness)?.transpose();
                let whole = self.solved(&half)?;
                (&whole + whole.transpose()) * 0.5
            }
        };
        let eigen = SymmetricEigen::try_new(scaled, f64::EPSILON, 10_000).ok_or_else(no_modes)?;
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
        let value = |(k, &index): (usize, &usize)| if k < self.free { 0.0 } else { eigen.eigenvalues[index].max(0.0) };
        let values = order.iter().enumerate().map(value).collect();
        Ok((values, DMatrix::from_fn(n, n, |i, k| eigen.eigenvectors[(i, order[k])])))
    }
}

fn no_modes() -> Error {
    Error::new("the natural modes cannot be found: the iteration does not settle")
        .next("check the units of stiffness and inertia")
}

/// Poles of η̈ + Ĉ η̇ + Ω² η = 0 of which the first `free` have no stiffness.
fn poles(values: &[f64], damping: &DMatrix<f64>, free: usize) -> Result<Vec<Root>> {
    let n = values.len();
    let elastic = n - free;
    // States: speeds of all modes, then displacements of the elastic ones. Rigid displacements are integrators on which
    // nothing depends.
    let a = DMatrix::from_fn(n + elastic, n + elastic, |i, j| match (i < n, j < n) {
        (true, true) => -damping[(i, j)],
        (true, false) => {
            if j - n + free == i {
                -values[i]
            } else {
                0.0
            }
        }
        (false, true) => f64::from(u8::from(i - n + free == j)),
        (false, false) => 0.0,
    });
    let mut poles = vec![Root::Zero; free];
    poles.extend(Root::from_values(&eigen::eigenvalues(&a)?));
    Ok(poles)
}

/// Rigid modes as sums of `shapes`, each of which moves one chosen body by one unit and the other chosen ones not at
/// all; sliding bodies are chosen first.
fn rigid(shapes: &DMatrix<f64>, slides: &dyn Fn(usize) -> bool) -> Vec<(usize, Vec<f64>)> {
    let mut left = shapes.clone();
    let count = left.ncols();
    let mut chosen = Vec::new();
    for k in 0..count {
        let rest = left.columns(k, count - k).into_owned();
        // The body with the largest motion in the remaining shapes, among slides if any of these moves.
        let size = |i: &usize| rest.row(*i).norm();
        let most = |only: bool| {
            let bodies = (0..left.nrows()).filter(|i| !chosen.contains(i) && (!only || slides(*i)));
            bodies.filter(|i| size(i) > 1e-9 * rest.norm()).max_by(|a, b| size(a).total_cmp(&size(b)))
        };
        let Some(body) = most(true).or_else(|| most(false)) else { break };
        let column = (k..count).max_by(|a, b| left[(body, *a)].abs().total_cmp(&left[(body, *b)].abs())).unwrap_or(k);
        left.swap_columns(k, column);
        let pivot = left.column(k) / left[(body, k)];
        left.set_column(k, &pivot);
        for other in (0..count).filter(|other| *other != k) {
            let less = left.column(other) - &pivot * left[(body, other)];
            left.set_column(other, &less);
        }
        chosen.push(body);
    }
    let largest = left.amax();
    let clean = |v: f64| if v.abs() <= 1e-12 * largest { 0.0 } else { v };
    let mut modes: Vec<(usize, Vec<f64>)> = chosen
        .iter()
        .enumerate()
        .map(|(k, body)| (*body, left.column(k).iter().map(|v| clean(*v)).collect()))
        .collect();
    modes.sort_by_key(|(body, _)| *body);
    modes
}
