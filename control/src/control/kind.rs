//! The kinds of input shapers and their amplitudes; `shaper.rs` names the sources.

use std::f64::consts::SQRT_2;

/// Relative vibration that EI shapers leave at their design frequency.
pub const TOLERANCE: f64 = 0.05;

/// Kind of shaper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ShaperKind {
    /// Zero vibration.
    Zv,
    /// Zero vibration with three impulses within three quarters of a period.
    Mzv,
    /// Zero vibration and derivative.
    Zvd,
    /// Extra-insensitive.
    Ei,
    /// Two-hump extra-insensitive.
    TwoHumpEi,
    /// Three-hump extra-insensitive.
    ThreeHumpEi,
}

impl ShaperKind {
    /// All kinds, the shorter ones first.
    pub const ALL: [ShaperKind; 6] = [
        ShaperKind::Zv,
        ShaperKind::Mzv,
        ShaperKind::Zvd,
        ShaperKind::Ei,
        ShaperKind::TwoHumpEi,
        ShaperKind::ThreeHumpEi,
    ];

    /// Its name, as in Klipper's configuration.
    pub fn name(self) -> &'static str {
        match self {
            ShaperKind::Zv => "zv",
            ShaperKind::Mzv => "mzv",
            ShaperKind::Zvd => "zvd",
            ShaperKind::Ei => "ei",
            ShaperKind::TwoHumpEi => "2hump_ei",
            ShaperKind::ThreeHumpEi => "3hump_ei",
        }
    }

    /// Time between impulses, in damped periods.
    pub(crate) fn spacing(self) -> f64 {
        if self == ShaperKind::Mzv { 0.375 } else { 0.5 }
    }

    /// Amplitudes of the impulses for a mode without damping; their sum is 1.
    pub fn amplitudes(self) -> Vec<f64> {
        let v = TOLERANCE;
        match self {
            ShaperKind::Zv => vec![0.5, 0.5],
            // A₁ + A₂ e^{3πi/4} + A₁ e^{3πi/2} = 0 and 2 A₁ + A₂ = 1
            ShaperKind::Mzv => vec![1.0 - 1.0 / SQRT_2, SQRT_2 - 1.0, 1.0 - 1.0 / SQRT_2],
            ShaperKind::Zvd => vec![0.25, 0.5, 0.25],
            // V at the design frequency, zero at two frequencies beside it                     (Singhose 1994)
            ShaperKind::Ei => vec![(1.0 + v) / 4.0, (1.0 - v) / 2.0, (1.0 + v) / 4.0],
            ShaperKind::TwoHumpEi => {
                // X = ∛(V² (√(1 − V²) + 1)), A₁ = (3 X² + 2 X + 3 V²) / (16 X), A₂ = ½ − A₁     (Singhose 1997)
                let x = (v * v * ((1.0 - v * v).sqrt() + 1.0)).cbrt();
                let a = (3.0 * x * x + 2.0 * x + 3.0 * v * v) / (16.0 * x);
                vec![a, 0.5 - a, 0.5 - a, a]
            }
            ShaperKind::ThreeHumpEi => {
                // A₁ = (1 + 3 V + 2 √(2 (V² + V))) / 16, A₂ = (1 − V) / 4, A₃ = 1 − 2 (A₁ + A₂)  (Singhose 1997)
                let a = (1.0 + 3.0 * v + 2.0 * (2.0 * (v * v + v)).sqrt()) / 16.0;
                let b = (1.0 - v) / 4.0;
                vec![a, b, 1.0 - 2.0 * (a + b), b, a]
            }
        }
    }

    /// The shaper of this name.
    pub fn from_name(name: &str) -> Option<ShaperKind> {
        ShaperKind::ALL.into_iter().find(|kind| kind.name().eq_ignore_ascii_case(name.trim()))
    }

    /// Largest damping ratio that Klipper accepts in its configuration.
    pub(super) fn most_damping(self) -> f64 {
        match self {
            ShaperKind::Zv | ShaperKind::Mzv | ShaperKind::Zvd => 0.99,
            ShaperKind::Ei => 0.4,
            ShaperKind::TwoHumpEi => 0.3,
            ShaperKind::ThreeHumpEi => 0.2,
        }
    }
}
