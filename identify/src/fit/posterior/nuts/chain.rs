//! One chain: Hoffman & Gelman, "The No-U-Turn Sampler", JMLR 15 (2014), with the draw taken along the whole path in
//! proportion to the density and the criterion of Betancourt, "A Conceptual Introduction to Hamiltonian Monte Carlo",
//! arXiv:1701.02434 (2017).
//!
//! With π the density, Σ an estimate of its covariance (the inverse of the mass matrix), p the momentum, Σ = L Lᵀ and r
//! = Lᵀ p:
//!
//! ```text
//! H = −ln π(q) + ½ pᵀ Σ p = −ln π(q) + ½ rᵀ r          r is drawn from the standard normal distribution
//! q̇ = Σ p = L r           ṙ = Lᵀ ∇ln π(q)
//! ```

use super::LogDensity;
use crate::chance::{normal, uniform};
use crate::fit::limits::{ACCEPTANCE, LARGEST_ERROR, MOST_DOUBLINGS};
use libm::{exp, log, log1p};
use nalgebra::{DMatrix, DVector};
use rand_pcg::Pcg64;

/// A point of a path.
#[derive(Clone)]
struct Point {
    /// q
    position: DVector<f64>,
    /// r
    momentum: DVector<f64>,
    /// Lᵀ ∇ln π(q)
    force: DVector<f64>,
    /// ln π(q)
    log: f64,
}

impl Point {
    /// H
    fn energy(&self) -> f64 {
        0.5 * self.momentum.norm_squared() - self.log
    }
}

/// A segment of a path.
struct Stretch {
    /// Its first and its last point in time.
    ends: [Point; 2],
    /// Σ r over its points.
    momenta: DVector<f64>,
    /// ln Σ exp(H₀ − H) over its points.
    weight: f64,
    /// One of its points, drawn with probability proportional to exp(−H).
    chosen: Point,
}

/// Direction in which a path is extended.
#[derive(Clone, Copy, PartialEq)]
enum PathDirection {
    Back,
    Forth,
}

/// The path must not be extended: it turned back, diverged, or was interrupted.
struct Ended;

/// A chain at its present draw.
pub struct Chain<'a> {
    density: &'a LogDensity<'a>,
    /// True if to go on.
    watch: &'a (dyn Fn() -> bool + 'a),
    random: Pcg64,
    /// L
    factor: DMatrix<f64>,
    /// ε
    pub step: f64,
    at: Point,
    /// True if the last path diverged.
    pub diverged: bool,
    /// Evaluations of the density so far.
    pub evaluations: u64,
    /// Probability of acceptance over the points of the last path: their sum and their number.
    accepted: [f64; 2],
    interrupted: bool,
}

impl<'a> Chain<'a> {
    /// A chain that starts at `start`, where the density is above zero, with Σ = 1.
    pub fn new(
        density: &'a LogDensity<'a>,
        watch: &'a (dyn Fn() -> bool + 'a),
        start: &[f64],
        random: Pcg64,
    ) -> Option<Self> {
        let n = start.len();
        let zero = DVector::zeros(n);
        let at = Point { position: zero.clone(), momentum: zero.clone(), force: zero, log: f64::NEG_INFINITY };
        let factor = DMatrix::identity(n, n);
        let mut chain = Self {
            density,
            watch,
            random,
            factor,
            step: 1.0,
            at,
            diverged: false,
            evaluations: 0,
            accepted: [0.0; 2],
            interrupted: false,
        };
        let at = chain.point(DVector::from_column_slice(start));
        chain.at = at;
        chain.at.log.is_finite().then_some(chain)
    }

    /// The present draw.
    pub fn position(&self) -> &[f64] {
        self.at.position.as_slice()
    }

    /// Sets L, where L Lᵀ is an estimate of the density's covariance.
    pub fn set_factor(&mut self, factor: DMatrix<f64>) {
        self.factor = factor;
        self.at = self.point(self.at.position.clone());
    }

    /// A point at rest.
    fn point(&mut self, position: DVector<f64>) -> Point {
        let n = position.len();
        let mut slope = DVector::zeros(n);
        let mut log = None;
        if position.iter().all(|q| q.is_finite()) {
            self.evaluations += 1;
            log = (self.density)(position.as_slice(), slope.as_mut_slice());
        }
        let log = log.filter(|log| log.is_finite()).unwrap_or(f64::NEG_INFINITY);
        Point { position, momentum: DVector::zeros(n), force: self.factor.tr_mul(&slope), log }
    }

    /// A step of the leapfrog integrator.
    fn leap(&mut self, from: &Point, way: PathDirection) -> Point {
        let step = if way == PathDirection::Forth { self.step } else { -self.step };
        // r½ = r + ½ ε Lᵀ ∇ln π(q);  q′ = q + ε L r½;  r′ = r½ + ½ ε Lᵀ ∇ln π(q′)
        let half = &from.momentum + 0.5 * step * &from.force;
        let mut to = self.point(&from.position + step * &self.factor * &half);
        to.momentum = half + 0.5 * step * &to.force;
        to
    }

    /// Draws r.
    fn kick(&mut self) {
        let random = &mut self.random;
        self.at.momentum.iter_mut().for_each(|r| *r = normal(random));
    }

    /// Halves or doubles ε until one step changes the energy by about the target (Hoffman & Gelman, algorithm 4).
    pub fn find_step(&mut self) {
        let mut grows = None;
        for _ in 0..50 {
            self.kick();
            let error = self.at.energy() - self.leap(&self.at.clone(), PathDirection::Forth).energy();
            let grow = error > log(ACCEPTANCE);
            if *grows.get_or_insert(grow) != grow {
                return;
            }
            self.step *= if grow { 2.0 } else { 0.5 };
        }
    }

    /// Advances to the next draw, and returns the mean probability of acceptance along the path; `None` if it was
    /// interrupted, without a change.
    pub fn draw(&mut self) -> Option<f64> {
        (self.diverged, self.accepted) = (false, [0.0; 2]);
        self.kick();
        let energy = self.at.energy();
        let mut path = Stretch::new(self.at.clone(), 0.0);
        for doublings in 0..MOST_DOUBLINGS {
            let way = if uniform(&mut self.random) < 0.5 { PathDirection::Back } else { PathDirection::Forth };
            let Ok(more) = self.extended(&path.ends[way as usize].clone(), way, doublings, energy) else { break };
            // The newer half is preferred: min(1, w′/w).
            let share = exp((more.weight - path.weight).min(0.0));
            let turned = path.join(more, way, uniform(&mut self.random) < share);
            if turned {
                break;
            }
        }
        if self.interrupted {
            return None;
        }
        self.at = path.chosen;
        Some(self.accepted[0] / self.accepted[1])
    }

    /// 2 to the number of `doublings` steps from `from` on.
    fn extended(&mut self, from: &Point, way: PathDirection, doublings: usize, energy: f64) -> Result<Stretch, Ended> {
        if doublings > 0 {
            let mut stretch = self.extended(from, way, doublings - 1, energy)?;
            let more = self.extended(&stretch.ends[way as usize].clone(), way, doublings - 1, energy)?;
            // w′/(w + w′)
            let share = exp(more.weight - sum_of_logs(stretch.weight, more.weight));
            let turned = stretch.join(more, way, uniform(&mut self.random) < share);
            return if turned { Err(Ended) } else { Ok(stretch) };
        }
        self.interrupted |= !(self.watch)();
        if self.interrupted {
            return Err(Ended);
        }
        let point = self.leap(from, way);
        let gain = energy - point.energy();
        self.accepted[0] += if gain.is_nan() { 0.0 } else { exp(gain.min(0.0)) };
        self.accepted[1] += 1.0;
        self.diverged |= gain.is_nan() || gain <= -LARGEST_ERROR;
        if self.diverged { Err(Ended) } else { Ok(Stretch::new(point, gain)) }
    }
}

impl Stretch {
    fn new(point: Point, weight: f64) -> Self {
        Self { ends: [point.clone(), point.clone()], momenta: point.momentum.clone(), weight, chosen: point }
    }

    /// Adds the continuation in this direction, and its chosen point if `take` is true; returns true if the whole path
    /// makes a U-turn.
    fn join(&mut self, more: Stretch, way: PathDirection, take: bool) -> bool {
        let [first, last] = if way == PathDirection::Forth { [&*self, &more] } else { [&more, &*self] };
        let momenta = &first.momenta + &last.momenta;
        let [begin, end] = [&first.ends[0].momentum, &last.ends[1].momentum];
        let [seam_before, seam_after] = [&first.ends[1].momentum, &last.ends[0].momentum];
        // A path continues as long as p♯·Σp > 0 at both ends, where p♯ = M⁻¹ p (Betancourt, A.4.2); so must each half
        // with the point beyond the seam. In r: rᵀ Σr.
        let goes_on = |a: &DVector<f64>, b: &DVector<f64>, sum: &DVector<f64>| a.dot(sum) > 0.0 && b.dot(sum) > 0.0;
        let turned = !(goes_on(begin, end, &momenta)
            && goes_on(begin, seam_after, &(&first.momenta + seam_after))
            && goes_on(seam_before, end, &(&last.momenta + seam_before)));
        self.weight = sum_of_logs(self.weight, more.weight);
        self.momenta = momenta;
        let [begin, end] = more.ends;
        match way {
            PathDirection::Back => self.ends[0] = begin,
            PathDirection::Forth => self.ends[1] = end,
        }
        if take {
            self.chosen = more.chosen;
        }
        turned
    }
}

/// ln(eᵃ + eᵇ)
fn sum_of_logs(a: f64, b: f64) -> f64 {
    a.max(b) + log1p(exp(-(a - b).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::rand_core::SeedableRng;

    fn standard(x: &[f64], gradient: &mut [f64]) -> Option<f64> {
        gradient.iter_mut().zip(x).for_each(|(slope, x)| *slope = -1e4 * x);
        Some(-0.5 * x.iter().map(|x| 1e4 * x * x).sum::<f64>())
    }

    /// Leapfrog steps are symmetric in time, and nearly keep the energy.
    #[test]
    fn a_step_back_ends_where_the_step_forth_began() {
        let mut chain = Chain::new(&standard, &|| true, &[3e-3, -1e-2], Pcg64::seed_from_u64(2)).unwrap();
        chain.step = 1e-3;
        chain.kick();
        let from = chain.at.clone();
        let to = chain.leap(&from, PathDirection::Forth);
        let back = chain.leap(&to, PathDirection::Back);
        assert!((&to.position - &from.position).norm() > 1e-4 && (to.energy() - from.energy()).abs() < 0.02);
        assert!((back.position - &from.position).norm() < 1e-14 && (back.momentum - &from.momentum).norm() < 1e-12);
    }

    /// A normal distribution of deviation 0.01 takes steps of about that, whatever the first one was.
    #[test]
    fn the_first_step_is_of_the_size_of_the_distribution() {
        for begun in [1e-6, 1.0, 1e4] {
            let mut chain = Chain::new(&standard, &|| true, &[3e-3, -1e-2], Pcg64::seed_from_u64(2)).unwrap();
            chain.step = begun;
            chain.find_step();
            assert!((1e-3..0.1).contains(&chain.step), "{begun}: {}", chain.step);
        }
    }

    /// Steps of a ten thousandth of the width of the distribution; one evaluation is that of the start.
    #[test]
    fn a_path_that_does_not_turn_ends_after_a_thousand_steps() {
        let mut chain = Chain::new(&standard, &|| true, &[3e-3, -1e-2], Pcg64::seed_from_u64(2)).unwrap();
        chain.step = 1e-6;
        assert!(chain.draw().is_some() && !chain.diverged);
        assert_eq!(chain.evaluations, 1 + 1023);
    }
}
