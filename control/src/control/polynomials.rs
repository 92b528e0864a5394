//! Extra-insensitive shapers for a damped mode, as polynomials in its damping ratio.
//!
//! Singhose and others publish fits to the solutions of the equations that define these shapers (zero vibration between
//! the humps, the tolerance V with zero slope at each hump); Klipper has evaluated them since 2025-09-16. The numbers
//! are those that Klipper executes, read in its `shaper_defs.py`; `tests/shape.rs` measures how well they satisfy the
//! equations. The amplitudes of two humps add up to 1.0005 without damping: they are divided by their sum.
//!
//! W. Singhose, L. Porter, T. Tuttle, N. Singer, "Vibration reduction using multi-hump input shapers", *J. Dynamic
//! Systems, Measurement, and Control* 119 (1997) 320-326.

use super::kind::ShaperKind;

/// Coefficients over the damping ratio, constant first.
type Cubic = [f64; 4];

/// Time in undamped periods and amplitude of each impulse of two humps, for V = 5 %.
const TWO_HUMPS: [(Cubic, Cubic); 4] = [
    ([0.0, 0.0, 0.0, 0.0], [0.16054, 0.76699, 2.26560, -1.22750]),
    ([0.49890, 0.16270, -0.54262, 6.16180], [0.33911, 0.45081, -2.58080, 1.73650]),
    ([0.99748, 0.18382, -1.58270, 8.17120], [0.34089, -0.61533, -0.68765, 0.42261]),
    ([1.49920, -0.09297, -0.28338, 1.85710], [0.15997, -0.60246, 1.00280, -0.93145]),
];

/// Time in undamped periods and amplitude of each impulse of three humps, for V = 5 %.
const THREE_HUMPS: [(Cubic, Cubic); 5] = [
    ([0.0, 0.0, 0.0, 0.0], [0.11275, 0.76632, 3.29160, -1.44380]),
    ([0.49974, 0.23834, 0.44559, 12.4720], [0.23698, 0.61164, -2.57850, 4.85220]),
    ([0.99849, 0.29808, -2.36460, 23.3990], [0.30008, -0.19062, -2.14560, 0.13744]),
    ([1.49870, 0.10306, -2.01390, 17.0320], [0.23775, -0.73297, 0.46885, -2.08650]),
    ([1.99960, -0.28231, 0.61536, 5.40450], [0.11244, -0.45439, 0.96382, -1.46000]),
];

/// Value of a polynomial at x, constant first.
fn at(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Impulses (time in undamped periods, amplitude) of an extra-insensitive shaper of tolerance V (of EI; the others have
/// 5 %) for a damping ratio ζ; the amplitudes sum to 1. None if an amplitude is not positive or the times are not in
/// order, and for other kinds.
pub(super) fn impulses(kind: ShaperKind, tolerance: f64, damping: f64) -> Option<Vec<(f64, f64)>> {
    let (v, zeta) = (tolerance, damping);
    let of = |table: &[(Cubic, Cubic)]| table.iter().map(|(t, a)| (at(t, zeta), at(a, zeta))).collect::<Vec<_>>();
    let all = match kind {
        ShaperKind::Zv | ShaperKind::Mzv | ShaperKind::Zvd => return None,
        ShaperKind::Ei => {
            let a1 = at(&[0.24968 + 0.24961 * v, 0.80008 + 1.23328 * v, 0.49599 + 3.17316 * v], zeta);
            let a3 = at(&[0.25149 + 0.21474 * v, -0.83249 + 1.41498 * v, 0.85181 - 4.90094 * v], zeta);
            // t₂ is in damped periods; the last impulse is after one period.
            let [linear, square, cube] =
                [[0.46159, 8.57843], [4.26169, -108.644], [1.75601, 336.989]].map(|[one, two]| one * v + two * v * v);
            let t2 = at(&[0.4999, linear, square, cube], zeta);
            let period = 1.0 / (1.0 - zeta * zeta).sqrt();
            vec![(0.0, a1), (t2 * period, 1.0 - a1 - a3), (period, a3)]
        }
        ShaperKind::TwoHumpEi => of(&TWO_HUMPS),
        ShaperKind::ThreeHumpEi => of(&THREE_HUMPS),
    };
    let sum: f64 = all.iter().map(|impulse| impulse.1).sum();
    let is_ordered = all.windows(2).all(|pair| pair[0].0 < pair[1].0);
    (is_ordered && all.iter().all(|impulse| impulse.1 > 0.0))
        .then(|| all.into_iter().map(|(t, a)| (t, a / sum)).collect())
}
