//! Loops of a controller at one frequency, broken at different points.
//!
//! With the commands u, the measured positions y, a scale x and the currents i, the equal controllers of all drives are
//! D u = −(N_y y + N_x x + N_i i) and the machine y = G_y u, x = G_x u, i = G_i u: numbers for one drive, matrices for
//! several. With P_k = N_k G_k,
//!
//! ```text
//! Δ = D + Σ P_k
//! broken at the commands:       L = D⁻¹ Σ P_k,            S = D Δ⁻¹
//! broken at measurements k:     L = P_k (Δ − P_k)⁻¹,      S = (Δ − P_k) Δ⁻¹
//! ```
//!
//! All have the same closed loop, det Δ = 0, but different margins. With a single measurement of a single drive both
//! are the same loop. For several drives |S| and |T| are the largest singular values, and the loop of one drive with
//! the others closed is L_j = T_jj/S_jj.

use super::plant::{Answer, Plant, Sampled, Square, by_drives};
use crate::control::feedback::{Feedback, Turn};
use crate::mechanism::DRIVES;
use nalgebra::{Complex, SMatrix};

/// Point at which a loop is broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Break {
    /// At the command.
    Command,
    /// At the position measured by the encoder.
    Position,
    /// At the scale beside the encoder.
    Scale,
    /// At the measured current.
    Current,
}

impl Break {
    /// In a word, as in `tune.json`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Command => "command",
            Self::Position => "encoder",
            Self::Scale => "scale",
            Self::Current => "current",
        }
    }
}

/// The points at which the loop of a controller differs: the command and every measurement that it uses; the command
/// alone for a single measurement.
pub fn breaks(feedback: &Feedback) -> &'static [Break] {
    match (feedback.uses_scale(), feedback.uses_current()) {
        (false, false) => &[Break::Command],
        (true, false) => &[Break::Command, Break::Position, Break::Scale],
        (false, true) => &[Break::Command, Break::Position, Break::Current],
        (true, true) => &[Break::Command, Break::Position, Break::Scale, Break::Current],
    }
}

/// The loops at one frequency.
#[derive(Debug, Clone, Copy)]
pub(super) struct Open<const N: usize> {
    /// D.
    own: Complex<f64>,
    /// P_y, P_x, P_i.
    parts: [Square<N>; 3],
    /// The adjugate of Δ, and det Δ: det (1 + L), times what has stable poles.
    adjugate: Square<N>,
    pub difference: Complex<f64>,
    /// True if the position loop is closed at a scale.
    has_scale: bool,
    /// Measured positions per reference without the controller: of steppers, which follow it. None for other motors.
    fed: Option<Square<N>>,
    /// Slide positions per position that follows the reference, and per disturbance at the command.
    slides: Square<N>,
    pub pushed: Square<N>,
    /// Travel of each drive's part of the belt per travel of each sliding part.
    shares: Square<N>,
}

impl<const N: usize> Open<N> {
    pub fn new(sampled: &Sampled<N>, answer: &Answer<N>, feedback: &Feedback, turn: &Turn) -> Self {
        let terms = feedback.at_turn(turn);
        let own = terms.own;
        let parts = [answer.position * terms.position, answer.slides * terms.scale, answer.current * terms.current];
        // Δ = D + P_y + P_x + P_i
        let whole = diagonal(own) + parts[0] + parts[1] + parts[2];
        let (adjugate, difference) = inverse(&whole);
        // x = G_x D Δ⁻¹ v for a disturbance v at the command
        let pushed = over(&(answer.slides * own), &adjugate, difference);
        let has_scale = feedback.uses_scale();
        // With a scale, the cart itself follows the reference.
        let follows = if has_scale { answer.slides } else { answer.position };
        let (turned, size) = inverse(&follows);
        let slides = over(&answer.slides, &turned, size);
        let fed = sampled.is_fed.then_some(answer.position);
        Self { own, parts, adjugate, difference, has_scale, fed, slides, pushed, shares: sampled.shares }
    }

    /// The two parts of Δ: the loops closed inside the broken one, and the broken loop itself.
    fn parted(&self, at: Break) -> [Square<N>; 2] {
        let (own, [y, x, i]) = (diagonal(self.own), self.parts);
        match at {
            Break::Command => [own, y + x + i],
            Break::Position => [own + x + i, y],
            Break::Scale => [own + y + i, x],
            Break::Current => [own + y + x, i],
        }
    }

    /// S and T of the loop broken there, times det Δ.
    fn closed(&self, at: Break) -> [Square<N>; 2] {
        self.parted(at).map(|part| times(&part, &self.adjugate))
    }

    /// The break of the loop that follows the reference: the scale, or the measured position without one.
    pub fn outer(&self) -> Break {
        if self.has_scale { Break::Scale } else { Break::Position }
    }

    /// L of a drive broken there, with the loops of the others closed.
    pub fn broken_at(&self, at: Break, drive: usize) -> Complex<f64> {
        let [inner, outer] = self.closed(at);
        outer[(drive, drive)] / inner[(drive, drive)]
    }

    /// |S| of the loop broken there.
    pub fn sensitivity(&self, at: Break) -> f64 {
        largest(&(self.closed(at)[0] / self.difference))
    }

    /// |T| of the loop broken there.
    pub fn complementary(&self, at: Break) -> f64 {
        largest(&(self.closed(at)[1] / self.difference))
    }

    /// |S|² and |T|², each at the worst of these breaks.
    pub fn squares(&self, breaks: &[Break]) -> [f64; 2] {
        let least = self.difference.norm_sqr().recip();
        let mut most = [0.0_f64; 2];
        for &at in breaks {
            for (most, part) in most.iter_mut().zip(self.closed(at)) {
                *most = most.max(largest_square(&part) * least);
            }
        }
        most
    }

    /// Error of the loop per reference: |S|, and |S (1 − G)| if the command is the reference with a correction.
    pub fn following(&self) -> f64 {
        let Some(fed) = self.fed else { return self.sensitivity(self.outer()) };
        let sensitivity = self.closed(self.outer())[0] / self.difference;
        largest(&(sensitivity * (Square::<N>::identity() - fed)))
    }

    /// T x/y: from the references of the sliding parts to their positions, without feed-forward; (T + S G) x/y if the
    /// command is the reference with a correction. 1 for parts that the machine does not have.
    pub fn reference_to_slides(&self) -> Square<N> {
        let [inner, outer] = self.closed(self.outer());
        let followed = self.fed.map_or(outer, |fed| outer + inner * fed);
        let mut all = self.slides * (followed / self.difference) * self.shares;
        for slide in (0..N).filter(|&slide| self.shares.column(slide).iter().all(|share| *share == Complex::ZERO)) {
            all[(slide, slide)] = Complex::ONE;
        }
        all
    }

    /// True if the phase of `other` differs by more than `most` from this in any of the loops.
    pub fn turns(&self, other: &Self, breaks: &[Break], most: f64) -> bool {
        let turns = |a: Complex<f64>, b: Complex<f64>| (b / a).arg().abs() > most;
        turns(self.difference, other.difference)
            || breaks.iter().any(|&at| (0..N).any(|drive| turns(self.broken_at(at, drive), other.broken_at(at, drive))))
    }
}

/// A number on the diagonal.
fn diagonal<const N: usize>(value: Complex<f64>) -> Square<N> {
    Square::from_diagonal_element(value)
}

/// A product with an adjugate, which is 1 for a single drive.
fn times<const N: usize>(a: &Square<N>, adjugate: &Square<N>) -> Square<N> {
    if N == 1 { *a } else { a * adjugate }
}

/// A product with an inverse: the adjugate over the determinant.
pub(crate) fn over<const N: usize>(a: &Square<N>, adjugate: &Square<N>, determinant: Complex<f64>) -> Square<N> {
    times(a, adjugate) / determinant
}

/// Adjugate and determinant.
pub(crate) fn inverse<const N: usize>(a: &Square<N>) -> (Square<N>, Complex<f64>) {
    let mut adjugate = diagonal(Complex::ONE);
    if N == 1 {
        return (adjugate, a[(0, 0)]);
    }
    if N == 3 {
        // Rows of the adjugate are cross products of columns: its entry (i, j) is a cofactor of a at (j, i).
        let next = |k: usize| [(k + 1) % 3, (k + 2) % 3];
        for (row, column) in (0..9).map(|entry| (entry / 3, entry % 3)) {
            let ([i, j], [k, l]) = (next(column), next(row));
            adjugate[(row, column)] = a[(i, k)] * a[(j, l)] - a[(i, l)] * a[(j, k)];
        }
        return (adjugate, (0..3).map(|k| a[(0, k)] * adjugate[(k, 0)]).sum());
    }
    for (row, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let own = if row == column { a[(1 - row, 1 - column)] } else { -a[(row, column)] };
        adjugate[(row, column)] = own;
    }
    (adjugate, a[(0, 0)] * a[(1, 1)] - a[(0, 1)] * a[(1, 0)])
}

/// The largest singular value.
pub(crate) fn largest<const N: usize>(a: &Square<N>) -> f64 {
    if N == 1 { a[(0, 0)].norm() } else { largest_square(a).sqrt() }
}

/// Its square: for two rows (‖A‖² + √(‖A‖⁴ − 4 |det A|²))/2 with the sum ‖A‖² of all squares.
fn largest_square<const N: usize>(a: &Square<N>) -> f64 {
    if N == 1 {
        return a[(0, 0)].norm_sqr();
    }
    if N == 3 {
        return largest_of_three(&Square::from_fn(|i, j| a[(i, j)]));
    }
    let sum: f64 = a.iter().map(Complex::norm_sqr).sum();
    let [first, second] = [0, 1].map(|row| a[(row, 0)].norm_sqr() + a[(row, 1)].norm_sqr());
    let inner = a[(0, 0)] * a[(1, 0)].conj() + a[(0, 1)] * a[(1, 1)].conj();
    // The same root without cancellation.
    0.5 * (sum + ((first - second).powi(2) + 4.0 * inner.norm_sqr()).sqrt())
}

/// The largest eigenvalue of H = A Aᴴ of three rows: with q = tr H/3, p² = tr (H − q)²/6 and r = det ((H − q)/p)/2 it
/// is q + 2 p cos (acos(r)/3).
fn largest_of_three(a: &Square<3>) -> f64 {
    let mut h = a * a.adjoint();
    let q = h.trace().re / 3.0;
    (0..3).for_each(|k| h[(k, k)] -= q);
    let p = (h.iter().map(Complex::norm_sqr).sum::<f64>() / 6.0).sqrt();
    // Three equal ones, or NaN.
    if p.is_nan() || p <= f64::MIN_POSITIVE {
        return q + p;
    }
    let r = 0.5 * inverse(&(h / Complex::new(p, 0.0))).1.re;
    q + 2.0 * p * (r.clamp(-1.0, 1.0).acos() / 3.0).cos()
}

/// The smallest singular value: |det A| over the largest of the adjugate.
pub(crate) fn smallest<const N: usize>(a: &Square<N>) -> f64 {
    if N == 1 {
        return a[(0, 0)].norm();
    }
    let (adjugate, determinant) = inverse(a);
    determinant.norm() / largest(&adjugate)
}

/// The loops broken at one point, at one frequency.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Broken {
    /// Where.
    pub at: Break,
    /// |S|.
    pub sensitivity: f64,
    /// |T|.
    pub complementary: f64,
    /// L of each drive, with the loops of the others closed.
    pub drives: [Complex<f64>; DRIVES],
}

/// The loops at one frequency: at each of [`breaks`], and from the reference of each slide to its position, without
/// feed-forward.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Loops {
    /// In the order of [`breaks`].
    pub broken: Vec<Broken>,
    /// In the order of the slides.
    pub reference_to_slides: [Complex<f64>; DRIVES],
}

impl Loops {
    /// L of a drive broken there, with the loops of the others closed.
    ///
    /// # Panics
    ///
    /// If the controller's loop is not broken there.
    pub fn broken_at(&self, at: Break, drive: usize) -> Complex<f64> {
        self.broken.iter().find(|broken| broken.at == at).expect("a break of this controller").drives[drive]
    }

    /// |S| at the worst break.
    pub fn sensitivity(&self) -> f64 {
        self.broken.iter().map(|broken| broken.sensitivity).fold(0.0, f64::max)
    }

    /// |T| at the worst break.
    pub fn complementary(&self) -> f64 {
        self.broken.iter().map(|broken| broken.complementary).fold(0.0, f64::max)
    }
}

/// Closed-loop response to disturbances at the commands, m per V or A, at ω, rad/s. A column for the commands of all
/// drives in proportion to the travel of their belts when one slide moves alone; rows for the positions of all slides,
/// true and by the drives' measurements. M is the number of slides.
pub(crate) fn from_commands<const M: usize>(
    plant: &Plant,
    feedback: &Feedback,
    omega: f64,
) -> [SMatrix<Complex<f64>, M, M>; 2] {
    by_drives!(plant, |sampled| pushed(plant, sampled, feedback, omega))
}

fn pushed<const N: usize, const M: usize>(
    plant: &Plant,
    sampled: &Sampled<N>,
    feedback: &Feedback,
    omega: f64,
) -> [SMatrix<Complex<f64>, M, M>; 2] {
    let answer = sampled.at(omega);
    let open = Open::new(sampled, &answer, feedback, &Turn::new(omega, plant.every));
    // y = G_y D Δ⁻¹ v
    let measured = over(&(answer.position * open.own), &open.adjugate, open.difference);
    let slides = plant.kind.geometry().slides;
    let along = |matrix: &Square<N>, row: usize, slide: usize| -> Complex<f64> {
        (0..N).map(|drive| matrix[(row, drive)] * sampled.shares[(drive, slide)]).sum()
    };
    let by_drives = |slide: usize, column: usize| -> Complex<f64> {
        let drives = slides[slide].by_drives.iter().enumerate();
        drives.map(|(drive, weight)| along(&measured, drive, column) * *weight).sum()
    };
    [SMatrix::from_fn(|row, column| along(&open.pushed, row, column)), SMatrix::from_fn(by_drives)]
}

/// The loops at all frequencies of the machine.
pub fn loops(plant: &Plant, feedback: &Feedback) -> Vec<Loops> {
    by_drives!(plant, |sampled| all(plant, sampled, feedback))
}

fn all<const N: usize>(plant: &Plant, sampled: &Sampled<N>, feedback: &Feedback) -> Vec<Loops> {
    let filled =
        |of: &dyn Fn(usize) -> Complex<f64>| std::array::from_fn(|k| if k < N { of(k) } else { Complex::ZERO });
    let one = |open: Open<N>| {
        let broken = |&at: &Break| Broken {
            at,
            sensitivity: open.sensitivity(at),
            complementary: open.complementary(at),
            drives: filled(&|drive| open.broken_at(at, drive)),
        };
        let slides = open.reference_to_slides();
        Loops {
            broken: breaks(feedback).iter().map(broken).collect(),
            reference_to_slides: filled(&|slide| slides[(slide, slide)]),
        }
    };
    plant.seen(sampled).map(|(_, answer, turn)| one(Open::new(sampled, answer, feedback, turn))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    fn check<const N: usize>() {
        let entry = |i: usize, j: usize| Complex::new(1.0 / (1 + i + j) as f64, (i * j) as f64 - 0.5);
        let a = Square::<N>::from_fn(entry);
        let (adjugate, determinant) = inverse(&a);
        let unit = over(&a, &adjugate, determinant);
        // For one drive the adjugate is 1: A · 1/det A is 1, too.
        assert!((unit - diagonal::<N>(Complex::ONE)).iter().all(|z| z.norm() < 1e-12), "{N}");
    }

    #[test]
    fn a_matrix_times_its_inverse_is_one() {
        check::<1>();
        check::<2>();
        check::<3>();
    }

    fn check_singular_values<const N: usize>() {
        for seed in 0..20 {
            let entry = |i: usize, j: usize, part: usize| ((7 * seed + 5 * i + 3 * j + part) as f64).sin();
            let a = Square::<N>::from_fn(|i, j| Complex::new(entry(i, j, 0), entry(i, j, 1)));
            let known = DMatrix::from_fn(N, N, |i, j| a[(i, j)]).singular_values();
            let (most, least) = (known.max(), known.min());
            assert!((largest(&a) - most).abs() < 1e-12 * most, "{N} {seed}: {} {most}", largest(&a));
            assert!((smallest(&a) - least).abs() < 1e-9 * most, "{N} {seed}: {} {least}", smallest(&a));
        }
    }

    #[test]
    fn singular_values_are_those_of_the_decomposition() {
        check_singular_values::<1>();
        check_singular_values::<2>();
        check_singular_values::<3>();
    }
}
