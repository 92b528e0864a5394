//! Student's t and its limit, the normal distribution.

use crate::fit::limits::NORMAL;

/// Two-sided tail probability of Student's t beyond ± `t`, by a normalising transformation (D. L. Wallace 1959),
/// relative accuracy about 1e-3 from three degrees of freedom on.
pub(crate) fn student_share(t: f64, freedom: f64) -> f64 {
    let n = freedom.max(1.0);
    let z = (8.0 * n + 1.0) / (8.0 * n + 3.0) * (n * (t * t / n).ln_1p()).sqrt();
    libm::erfc(z / std::f64::consts::SQRT_2)
}

/// The 97.5 % quantile of Student's t for `freedom` degrees of freedom (Hill's expansion, to 1e-3 from 3 on).
pub fn student(freedom: usize) -> f64 {
    let (z, n) = (NORMAL, freedom.max(1) as f64);
    match freedom {
        0 | 1 => 12.706,
        2 => 4.303,
        _ => {
            let (z3, z5, z7) = (f64::powi(z, 3), f64::powi(z, 5), f64::powi(z, 7));
            z + (z3 + z) / (4.0 * n)
                + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * n * n)
                + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * n * n * n)
        }
    }
}
