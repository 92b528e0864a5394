//! Draws from a density that is known up to a factor, by the No-U-Turn sampler or a random walk, with convergence
//! diagnostics.
//!
//! `chain.rs` has the sampler, `walk.rs` the walk, `adaptation.rs` the adaptation of both before draws are kept,
//! `mixing.rs` the diagnostics.

mod adaptation;
mod chain;
mod mixing;
mod walk;

use crate::error::{Error, Result};
use crate::fit::limits::{MOST_CHAINS, MOST_DRAWS};
use adaptation::{Steps, Windows, factor};
use chain::Chain;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Number of draws and chains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Chains, each from its own start.
    pub chains: usize,
    /// Draws of each chain that only tune it.
    pub tune: usize,
    /// Draws of each chain that are kept.
    pub draws: usize,
    /// Seed; the same one gives the same draws.
    pub seed: u64,
}

impl Default for Effort {
    fn default() -> Self {
        Self { chains: 4, tune: 500, draws: 500, seed: 1 }
    }
}

impl Effort {
    /// Rejects invalid numbers.
    pub fn check(&self) -> Result<()> {
        let &Self { chains, tune, draws, .. } = self;
        if !(1..=MOST_CHAINS).contains(&chains) {
            return Err(Error::new(format!("{chains} chains cannot be")).allowed(format!("from 1 to {MOST_CHAINS}")));
        }
        let most = MOST_DRAWS / chains;
        if !(1..=most).contains(&draws) || tune > most {
            let chains = if chains == 1 { "one chain".into() } else { format!("each of {chains} chains") };
            return Err(Error::new(format!("{draws} draws of {chains} cannot be")).allowed(format!("from 1 to {most}")));
        }
        Ok(())
    }
}

/// The draws.
#[derive(Debug, Clone, PartialEq)]
pub struct Draws {
    /// Values by chain, draw and parameter.
    pub chains: Vec<Vec<Vec<f64>>>,
    /// Divergent transitions among the kept draws: a density too curved for the step. More than a few make the rest
    /// doubtful.
    pub divergences: u64,
    /// Evaluations of the density and its gradient.
    pub evaluations: u64,
    /// True if it was stopped before all draws were made.
    pub interrupted: bool,
}

/// The logarithm of the density at a point, and its gradient into the second argument; `None` if the density is zero.
pub type LogDensity<'a> = dyn Fn(&[f64], &mut [f64]) -> Option<f64> + Sync + 'a;

/// The logarithm of the density at a point alone; `None` if the density is zero.
pub type Plain<'a> = dyn Fn(&[f64]) -> Option<f64> + Sync + 'a;

/// Called at each evaluation of the density with the number of draws of all chains so far, including tuning; returns
/// true to continue.
pub type Watch<'a> = dyn Fn(usize) -> bool + Sync + 'a;

/// Draws from `log`, with a thread for each chain, which begins at one of `starts` in turn. `watch` receives the
/// progress, and may end the sampling early: each chain then keeps as many draws as the shortest has.
///
/// Uncorrelated variables of about unit width save draws for tuning, but are not required.
pub fn sample(log: &LogDensity, starts: &[Vec<f64>], effort: Effort, watch: &Watch) -> Result<Draws> {
    chains(starts, effort, watch, &|job, start, random| job.chain(log, start, random))
}

/// Samples by a random walk, which needs no gradients: for densities with kinks.
pub fn walk(log: &Plain, starts: &[Vec<f64>], effort: Effort, watch: &Watch) -> Result<Draws> {
    chains(starts, effort, watch, &|job, start, random| walk::chain(job, log, start, random))
}

/// A chain from a start, with random numbers of its own.
type MakeChain<'a> = dyn Fn(&Job, &[f64], Pcg64) -> Result<Drawn> + Sync + 'a;

/// Runs all chains in parallel.
fn chains(starts: &[Vec<f64>], effort: Effort, watch: &Watch, chain: &MakeChain) -> Result<Draws> {
    effort.check()?;
    let dimension = starts.first().map_or(0, Vec::len);
    if dimension == 0 || starts.iter().any(|start| start.len() != dimension) {
        return Err(Error::new("a sampler needs points of one or more dimensions to start from"));
    }
    let job = Job { effort, watch, made: AtomicUsize::new(0), stopped: AtomicBool::new(false) };
    let one = |number: usize| {
        // Each chain has a stream of its own.
        let own = effort.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(number as u64);
        let drawn = chain(&job, &starts[number % starts.len()], Pcg64::seed_from_u64(own));
        // The observer is also notified of the end.
        job.goes_on();
        drawn
    };
    let all: Vec<Result<Drawn>> = std::thread::scope(|scope| {
        let one = &one;
        let threads: Vec<_> = (0..effort.chains).map(|k| scope.spawn(move || one(k))).collect();
        threads
            .into_iter()
            .map(|thread| thread.join().unwrap_or_else(|_| Err(Error::new("a chain broke off"))))
            .collect()
    });
    let mut draws = Draws { chains: Vec::new(), divergences: 0, evaluations: 0, interrupted: false };
    for chain in all {
        let chain = chain?;
        draws.interrupted |= chain.draws.len() < effort.draws;
        draws.chains.push(chain.draws);
        draws.divergences += chain.divergences;
        draws.evaluations += chain.evaluations;
    }
    let shortest = draws.chains.iter().map(Vec::len).min().unwrap_or(0);
    draws.chains.iter_mut().for_each(|chain| chain.truncate(shortest));
    Ok(draws)
}

/// All chains together.
struct Job<'a> {
    effort: Effort,
    watch: &'a Watch<'a>,
    made: AtomicUsize,
    stopped: AtomicBool,
}

/// One chain's share.
#[derive(Default)]
struct Drawn {
    draws: Vec<Vec<f64>>,
    divergences: u64,
    evaluations: u64,
}

impl Job<'_> {
    /// True to continue.
    fn goes_on(&self) -> bool {
        let goes_on = !self.stopped.load(Ordering::Relaxed) && (self.watch)(self.made.load(Ordering::Relaxed));
        if !goes_on {
            self.stopped.store(true, Ordering::Relaxed);
        }
        goes_on
    }

    /// Counts a draw.
    fn count(&self) {
        self.made.fetch_add(1, Ordering::Relaxed);
    }

    /// The draws after tuning, each with true if it diverged, up to the first that is `None`.
    fn keep(&self, next: &mut dyn FnMut() -> Option<(Vec<f64>, bool)>) -> Drawn {
        let mut drawn = Drawn::default();
        while drawn.draws.len() < self.effort.draws
            && let Some((draw, diverged)) = next()
        {
            drawn.divergences += u64::from(diverged);
            drawn.draws.push(draw);
            self.count();
        }
        drawn
    }

    fn chain(&self, log: &LogDensity, start: &[f64], random: Pcg64) -> Result<Drawn> {
        let watch = || self.goes_on();
        let mut chain = Chain::new(log, &watch, start, random).ok_or_else(walk::nowhere)?;
        let mut drawn = Drawn::default();
        if self.tune(&mut chain, self.effort.tune) {
            drawn = self.keep(&mut || {
                chain.draw()?;
                Some((chain.position().to_vec(), chain.diverged))
            });
        }
        drawn.evaluations = chain.evaluations;
        Ok(drawn)
    }

    /// Makes draws for step and covariance; false if interrupted.
    fn tune(&self, chain: &mut Chain, tune: usize) -> bool {
        let Windows { begin, ends } = Windows::new(tune);
        chain.find_step();
        let (mut steps, mut window) = (Steps::new(chain.step), Vec::new());
        for k in 1..=tune {
            let Some(acceptance) = chain.draw() else { return false };
            self.count();
            chain.step = steps.next(acceptance);
            if k > begin {
                window.push(chain.position().to_vec());
            }
            if ends.contains(&k) {
                if let Some(factor) = factor(&window) {
                    chain.set_factor(factor);
                    chain.step = 1.0;
                    chain.find_step();
                    steps = Steps::new(chain.step);
                }
                window.clear();
            }
        }
        chain.step = steps.last();
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn draw(log: &LogDensity, dimension: usize, effort: Effort) -> Draws {
        let starts: Vec<Vec<f64>> = (0..4).map(|k| vec![0.5 * f64::from(k) - 0.7; dimension]).collect();
        sample(log, &starts, effort, &|_| true).unwrap()
    }

    /// Two correlated normal variables with known moments.
    #[test]
    fn a_normal_distribution_has_its_moments() {
        let (rho, effort) = (0.8, Effort { draws: 2000, ..Effort::default() });
        // Precision of a unit covariance with correlation ρ; means 3 and −1, the second ten times as wide.
        let log = |x: &[f64], gradient: &mut [f64]| {
            let (u, v) = (x[0] - 3.0, (x[1] + 1.0) / 10.0);
            let scale = 1.0 / (1.0 - rho * rho);
            gradient[0] = -scale * (u - rho * v);
            gradient[1] = -scale * (v - rho * u) / 10.0;
            Some(-0.5 * scale * (u * u - 2.0 * rho * u * v + v * v))
        };
        let draws = draw(&log, 2, effort);
        assert!((draws.mean(0) - 3.0).abs() < 0.1 && (draws.mean(1) + 1.0).abs() < 1.0, "{}", draws.mean(0));
        assert!((draws.deviation(0) - 1.0).abs() < 0.06 && (draws.deviation(1) - 10.0).abs() < 0.6);
        assert!((draws.quantile(0, 0.975) - (3.0 + 1.96)).abs() < 0.2);
        assert!(draws.r_hat(0) < 1.01 && draws.effective(0) > 1000.0, "{} {}", draws.r_hat(0), draws.effective(0));
    }

    /// Ten correlated normal variables of widths from a thousandth to ten thousand: means and covariances to five
    /// standard errors of the draws, in terms of the underlying standard normal variables.
    #[test]
    fn ten_correlated_normal_variables_of_all_sizes_have_their_moments() {
        const N: usize = 10;
        // x = m + A y, y standard normal
        let a = DMatrix::from_fn(N, N, |i, j| {
            let size = 10f64.powf(-3.0 + 7.0 * i as f64 / 9.0);
            size * if i == j { 1.0 } else { 0.7 * ((3 * i + 5 * j) as f64).sin() }
        });
        let inverse = a.clone().try_inverse().unwrap();
        let mean = DVector::from_fn(N, |i, _| 5.0 - i as f64);
        let log = |x: &[f64], gradient: &mut [f64]| {
            let y = &inverse * (DVector::from_column_slice(x) - &mean);
            gradient.copy_from_slice((-inverse.tr_mul(&y)).as_slice());
            Some(-0.5 * y.norm_squared())
        };
        let draws = draw(&log, N, Effort { tune: 1000, draws: 2000, ..Effort::default() });
        let count = 8000.0;
        let standard: Vec<DVector<f64>> =
            draws.chains.iter().flatten().map(|x| &inverse * (DVector::from_column_slice(x) - &mean)).collect();
        for i in 0..N {
            let effective = draws.effective(i);
            assert!(draws.r_hat(i) < 1.01 && effective > 2000.0, "{} {effective}", draws.r_hat(i));
            let average = standard.iter().map(|y| y[i]).sum::<f64>() / count;
            assert!(average.abs() < 5.0 / 2000f64.sqrt(), "mean of {i}: {average}");
            for j in 0..=i {
                let moment = standard.iter().map(|y| y[i] * y[j]).sum::<f64>() / count;
                let want = if i == j { 1.0 } else { 0.0 };
                assert!((moment - want).abs() < 5.0 * (1.0 + want).sqrt() / 2000f64.sqrt(), "{i} {j}: {moment}");
            }
        }
        assert_eq!(draws.divergences, 0);
    }

    /// A banana, y about x² − 2 with x normal: quantiles of y against quadrature.
    #[test]
    fn a_banana_has_the_marginal_of_quadrature() {
        const WIDTH: f64 = 0.7;
        let log = |q: &[f64], gradient: &mut [f64]| {
            let (x, off) = (q[0], (q[1] - q[0] * q[0] + 2.0) / WIDTH);
            gradient[0] = -x + 2.0 * x * off / WIDTH;
            gradient[1] = -off / WIDTH;
            Some(-0.5 * (x * x + off * off))
        };
        let draws = draw(&log, 2, Effort { tune: 1000, draws: 5000, ..Effort::default() });
        // P(y < c) = ∫ φ(x) Φ((c − x² + 2)/w) dx, both by sums over many x.
        let normal = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
        let below = |c: f64| -> f64 {
            let (h, k) = (0.01, 0.02);
            (-600..=600)
                .map(|i| {
                    let x = h * f64::from(i);
                    let z = (c - x * x + 2.0) / WIDTH;
                    let inner: f64 = (0..)
                        .map(|j| -8.0 + k * (f64::from(j) + 0.5))
                        .take_while(|t| *t < z.min(8.0))
                        .map(normal)
                        .sum();
                    h * normal(x) * k * inner
                })
                .sum()
        };
        let effective = draws.effective(1);
        assert!(draws.r_hat(1) < 1.01 && effective > 1000.0, "{} {effective}", draws.r_hat(1));
        for share in [0.05, 0.25, 0.5, 0.75, 0.95] {
            let want = below(draws.quantile(1, share));
            // Five standard errors of a fraction, plus the error of the sums.
            let allowed = 5.0 * (share * (1.0 - share) / effective).sqrt() + 0.005;
            assert!((want - share).abs() < allowed, "{share}: {want}, {effective} effective");
        }
        assert!((draws.mean(0)).abs() < 5.0 / draws.effective(0).sqrt());
    }

    /// A funnel is too narrow at its neck for one step, which is reported.
    #[test]
    fn a_funnel_shows_divergent_transitions() {
        // v normal with deviation 3, nine x with deviation e^(v/2)
        let log = |q: &[f64], gradient: &mut [f64]| {
            let (v, square) = (q[0], q[1..].iter().map(|x| x * x).sum::<f64>());
            gradient[0] = -v / 9.0 - 4.5 + 0.5 * square * (-v).exp();
            for (slope, x) in gradient[1..].iter_mut().zip(&q[1..]) {
                *slope = -x * (-v).exp();
            }
            Some(-v * v / 18.0 - 4.5 * v - 0.5 * square * (-v).exp())
        };
        let draws = draw(&log, 10, Effort::default());
        assert!(draws.divergences > 0);
        assert!(draws.r_hat(0) > 1.01 || draws.effective(0) < 400.0, "{} {}", draws.r_hat(0), draws.effective(0));
    }

    fn standard(x: &[f64], gradient: &mut [f64]) -> Option<f64> {
        gradient.iter_mut().zip(x).for_each(|(slope, x)| *slope = -x);
        Some(-0.5 * x.iter().map(|x| x * x).sum::<f64>())
    }

    #[test]
    fn a_seed_says_which_draws_come() {
        let of = |seed| draw(&standard, 3, Effort { tune: 100, draws: 50, seed, ..Effort::default() });
        let one = of(1);
        assert_eq!(one, of(1));
        assert_ne!(one.chains, of(2).chains);
        assert_ne!(one.chains[0], one.chains[1]);
    }

    /// A path of the sampler may have a thousand steps of a second each, so it can be interrupted.
    #[test]
    fn an_interruption_ends_a_path() {
        let (calls, stop) = (AtomicUsize::new(0), AtomicUsize::new(usize::MAX));
        let log = |x: &[f64], gradient: &mut [f64]| {
            calls.fetch_add(1, Ordering::Relaxed);
            // One variable so narrow that paths along the other have a thousand steps.
            (gradient[0], gradient[1]) = (-1e10 * x[0], -x[1]);
            Some(-0.5 * (1e10 * x[0] * x[0] + x[1] * x[1]))
        };
        let watch = |_: usize| {
            let so_far = calls.load(Ordering::Relaxed);
            let goes_on = so_far < 700;
            if !goes_on {
                stop.fetch_min(so_far, Ordering::Relaxed);
            }
            goes_on
        };
        let effort = Effort { chains: 1, tune: 0, draws: 1000, seed: 1 };
        let draws = sample(&log, &[vec![0.0, 0.1]], effort, &watch).unwrap();
        assert!(draws.interrupted && draws.chains[0].len() < 10, "{}", draws.chains[0].len());
        assert!(calls.load(Ordering::Relaxed) <= stop.load(Ordering::Relaxed) + 1);
    }

    #[test]
    fn an_observer_sees_the_last_draw() {
        let seen = AtomicUsize::new(0);
        let watch = |made: usize| {
            seen.fetch_max(made, Ordering::Relaxed);
            true
        };
        let effort = Effort { chains: 2, tune: 30, draws: 20, seed: 1 };
        sample(&standard, &[vec![0.3, 0.1]], effort, &watch).unwrap();
        assert_eq!(seen.into_inner(), 2 * (30 + 20));
    }

    #[test]
    fn a_start_without_density_is_refused() {
        let told = sample(&|_, _| None, &[vec![0.0]], Effort::default(), &|_| true).unwrap_err().to_string();
        assert_eq!(told, "the density is zero where a chain would start\n  next: start from a fit that has converged");
    }

    /// A half-normal distribution ends at zero, its interval does not.
    #[test]
    fn a_density_that_ends_is_not_left() {
        // In y = ln x, with the change of variables in the density.
        let log = |y: &[f64], gradient: &mut [f64]| {
            let x = y[0].exp();
            gradient[0] = 1.0 - x * x;
            Some(y[0] - 0.5 * x * x)
        };
        let draws = draw(&log, 1, Effort { draws: 2000, ..Effort::default() });
        let median = draws.quantile(0, 0.5).exp();
        assert!((median - 0.6745).abs() < 0.05, "{median}");
    }

    /// A chain is a thread and a draw is memory: a million chains ended the process.
    #[test]
    fn an_effort_that_cannot_be_is_refused() {
        let told = |chains, draws| Effort { chains, draws, ..Effort::default() }.check().map_err(|e| e.to_string());
        assert_eq!(told(4, 500), Ok(()));
        assert_eq!(told(100, 100_000), Ok(()));
        assert_eq!(told(0, 500), Err("0 chains cannot be\n  allowed: from 1 to 100".into()));
        assert_eq!(told(1_000_000, 500), Err("1000000 chains cannot be\n  allowed: from 1 to 100".into()));
        assert_eq!(told(4, 0), Err("0 draws of each of 4 chains cannot be\n  allowed: from 1 to 2500000".into()));
        assert_eq!(
            told(1, usize::MAX),
            Err(format!("{} draws of one chain cannot be\n  allowed: from 1 to 10000000", usize::MAX))
        );
    }
}
