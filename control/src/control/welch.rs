//! The power spectral density of evenly sampled values, by Welch's method.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Form of the Kaiser window: its side lobes are 44 dB below the main one.
pub(super) const BETA: f64 = 6.0;

/// One-sided power spectral density of `values`, sampled `rate` times a second, in their unit squared per Hz:
/// frequencies (Hz) and densities.
///
/// Segments of `length` samples with 50 % overlap, less their mean and with a Kaiser window, are transformed, and their
/// periodograms averaged. The densities times the frequency step sum to the variance, except for losses at the ends of
/// the record. Empty without a complete segment.
///
/// P. Welch, "The use of fast Fourier transform for the estimation of power spectra", *IEEE Trans. Audio and
/// Electroacoustics* 15, 1967.
pub fn power_spectral_density(values: &[f64], rate: f64, length: usize) -> (Vec<f64>, Vec<f64>) {
    if length < 2 || values.len() < length {
        return (Vec::new(), Vec::new());
    }
    let window = kaiser(length);
    let transform = FftPlanner::new().plan_fft_forward(length);
    let mut density = vec![0.0; length / 2 + 1];
    let mut segments = 0.0;
    let mut buffer = vec![Complex::new(0.0, 0.0); length];
    for segment in values.windows(length).step_by((length / 2).max(1)) {
        let mean = segment.iter().sum::<f64>() / length as f64;
        for (place, (value, weight)) in buffer.iter_mut().zip(segment.iter().zip(&window)) {
            *place = Complex::new((value - mean) * weight, 0.0);
        }
        transform.process(&mut buffer);
        for (sum, value) in density.iter_mut().zip(&buffer) {
            *sum += value.norm_sqr();
        }
        segments += 1.0;
    }
    // P(f) = 2 |X(f)|² / (f_s Σ w²), without the factor 2 for f = 0 and f_s/2
    let power: f64 = window.iter().map(|w| w * w).sum();
    let alone = |k: usize| k == 0 || 2 * k == length;
    for (k, value) in density.iter_mut().enumerate() {
        *value *= if alone(k) { 1.0 } else { 2.0 } / (rate * power * segments);
    }
    (density.iter().enumerate().map(|(k, _)| k as f64 * rate / length as f64).collect(), density)
}

/// w_n = I₀(β √(1 − (2n/(N−1) − 1)²)) / I₀(β).
fn kaiser(length: usize) -> Vec<f64> {
    let at = |n: usize| 2.0 * n as f64 / (length - 1) as f64 - 1.0;
    (0..length).map(|n| bessel(BETA * (1.0 - at(n) * at(n)).max(0.0).sqrt()) / bessel(BETA)).collect()
}

/// I₀(x) = Σ ((x/2)^k / k!)², which converges quickly for such small x.
fn bessel(x: f64) -> f64 {
    let (mut sum, mut term) = (1.0, 1.0);
    for k in 1..60 {
        term *= (x / (2.0 * f64::from(k))).powi(2);
        sum += term;
    }
    sum
}
