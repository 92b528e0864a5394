//! The evolution strategy CMA-ES, which needs no derivatives (N. Hansen, "The CMA Evolution Strategy: A Tutorial",
//! 2016), in Hansen's names and with his default constants:
//!
//! ```text
//! λ, μ          offspring of a generation, and those that count, with weights w; μ_eff = 1/Σ w²
//! m, σ, C       mean, step size and covariance of the offspring: x ~ m + σ N(0, C)
//! p_σ, p_c      evolution paths of the step size and of the covariance
//! c_σ, d_σ      how fast the step size learns, and its damping
//! c_c, c_1, c_μ how fast the path of the covariance, its rank-one and its rank-μ update learn
//! ```

use crate::chance::normal;
use crate::fit::limits::SMALLEST_STEP;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

/// Searches around zero in `n` dimensions with the first step size `sigma`, until `barren` generations in a row have
/// not improved. `evaluate` returns the cost of a point, infinite if there is none, and true if it is an improvement.
pub fn search(n: usize, mut sigma: f64, barren: usize, evaluate: &mut dyn FnMut(&DVector<f64>) -> (f64, bool)) {
    let size = n as f64;
    let lambda = 4 + (3.0 * size.ln()).floor() as usize;
    let mu = lambda / 2;
    let raw: Vec<f64> = (0..mu).map(|i| (lambda as f64 / 2.0 + 0.5).ln() - (i as f64 + 1.0).ln()).collect();
    let sum: f64 = raw.iter().sum();
    let weights: Vec<f64> = raw.iter().map(|w| w / sum).collect();
    let mu_eff = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
    let c_c = (4.0 + mu_eff / size) / (size + 4.0 + 2.0 * mu_eff / size);
    let c_sigma = (mu_eff + 2.0) / (size + mu_eff + 5.0);
    let c_1 = 2.0 / ((size + 1.3).powi(2) + mu_eff);
    let c_mu = f64::min(1.0 - c_1, 2.0 * (mu_eff - 2.0 + 1.0 / mu_eff) / ((size + 2.0).powi(2) + mu_eff));
    let d_sigma = 1.0 + 2.0 * f64::max(0.0, ((mu_eff - 1.0) / (size + 1.0)).sqrt() - 1.0) + c_sigma;
    // E‖N(0, I)‖
    let chi = size.sqrt() * (1.0 - 1.0 / (4.0 * size) + 1.0 / (21.0 * size * size));

    let mut m = DVector::zeros(n);
    let mut c = DMatrix::<f64>::identity(n, n);
    let (mut p_sigma, mut p_c) = (DVector::<f64>::zeros(n), DVector::<f64>::zeros(n));
    let mut random = Pcg64::seed_from_u64(1);
    let generations = (60 * n + 60) / lambda;
    let mut fruitful = 0;
    for generation in 1..=generations {
        // C = B D² Bᵀ
        let Some(eigen) = SymmetricEigen::try_new(c.clone(), 1e-14, 1000) else { break };
        let (b, d) = (&eigen.eigenvectors, eigen.eigenvalues.map(|value| value.max(1e-20).sqrt()));
        if sigma * d.max() < SMALLEST_STEP || generation > fruitful + barren {
            break;
        }
        let mut offspring: Vec<(f64, DVector<f64>)> = Vec::with_capacity(lambda);
        for _ in 0..lambda {
            let z = DVector::from_fn(n, |_, _| normal(&mut random));
            let y = b * z.component_mul(&d);
            let (cost, shows) = evaluate(&(&m + &y * sigma));
            if shows {
                fruitful = generation;
            }
            offspring.push((cost, y));
        }
        if offspring.iter().all(|(cost, _)| cost.is_infinite()) {
            break;
        }
        offspring.sort_by(|a, b| a.0.total_cmp(&b.0));
        // y_w = Σ w y,   m += σ y_w
        let y_w = weights.iter().zip(&offspring).fold(DVector::zeros(n), |sum, (w, (_, y))| sum + y * *w);
        m += &y_w * sigma;
        // p_σ = (1 − c_σ) p_σ + √(c_σ (2 − c_σ) μ_eff) C^(−1/2) y_w
        let white = b * (b.tr_mul(&y_w)).component_div(&d);
        p_sigma = p_sigma * (1.0 - c_sigma) + white * (c_sigma * (2.0 - c_sigma) * mu_eff).sqrt();
        // h_σ: whether the path is no longer than it may be by chance
        let h_sigma = p_sigma.norm() / (1.0 - (1.0 - c_sigma).powi(2 * generation as i32)).sqrt()
            < (1.4 + 2.0 / (size + 1.0)) * chi;
        // p_c = (1 − c_c) p_c + h_σ √(c_c (2 − c_c) μ_eff) y_w
        p_c = p_c * (1.0 - c_c) + if h_sigma { y_w * (c_c * (2.0 - c_c) * mu_eff).sqrt() } else { DVector::zeros(n) };
        // C = (1 − c_1 − c_μ + (1 − h_σ) c_1 c_c (2 − c_c)) C + c_1 p_c p_cᵀ + c_μ Σ w y yᵀ
        c *= 1.0 - c_1 - c_mu + if h_sigma { 0.0 } else { c_1 * c_c * (2.0 - c_c) };
        c += &p_c * p_c.transpose() * c_1;
        for (w, (_, y)) in weights.iter().zip(&offspring) {
            c += y * y.transpose() * (c_mu * w);
        }
        // σ = σ exp((c_σ/d_σ) (‖p_σ‖/E‖N(0, I)‖ − 1))
        sigma *= ((c_sigma / d_sigma) * (p_sigma.norm() / chi - 1.0)).exp();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lowest_point_of_a_long_valley_is_found() {
        // Rosenbrock's valley about (1, 1), begun at zero.
        let mut best = (f64::INFINITY, DVector::zeros(2));
        let mut valley = |x: &DVector<f64>| {
            let cost = (1.0 - x[0]).powi(2) + 10.0 * (x[1] - x[0] * x[0]).powi(2);
            let shows = cost < 0.9 * best.0;
            if cost < best.0 {
                best = (cost, x.clone());
            }
            (cost, shows)
        };
        search(2, 0.5, 30, &mut valley);
        assert!((best.1[0] - 1.0).abs() < 0.2 && (best.1[1] - 1.0).abs() < 0.4, "{best:?}");
    }

    /// E‖p_σ‖ = E‖N(0, I)‖ where costs are chance: the step length then neither grows nor shrinks.
    #[test]
    fn the_step_length_stays_where_costs_are_chance() {
        let (n, lambda, searches) = (4, 8, 20);
        let mut growth = 0.0;
        for seed in 0..searches {
            let mut random = Pcg64::seed_from_u64(seed);
            let mut all = Vec::new();
            search(n, 1.0, 1000, &mut |x| {
                all.push(x.clone());
                (normal(&mut random), true)
            });
            let spread = |points: &[DVector<f64>]| {
                let mean = points.iter().sum::<DVector<f64>>() / points.len() as f64;
                points.iter().map(|x| (x - &mean).norm_squared()).sum::<f64>().sqrt()
            };
            growth += (spread(&all[all.len() - lambda..]) / spread(&all[..lambda])).ln() / searches as f64;
        }
        assert!(growth.abs() < 1.0, "e^{growth}");
    }

    #[test]
    fn a_search_ends_where_nothing_has_a_cost() {
        let mut count = 0;
        search(3, 1.0, 8, &mut |_| {
            count += 1;
            (f64::INFINITY, false)
        });
        assert_eq!(count, 7);
    }
}
