//! Input shapers: a command is sent as several smaller ones, so timed that the vibrations they excite cancel.
//!
//! Sources: ZV and ZVD by N. Singer, W. Seering, "Preshaping command inputs to reduce system vibration", *J. Dynamic Systems,
//! Measurement, and Control* 112, 1990; EI by W. Singhose, W. Seering, N. Singer, "Residual vibration reduction using vector
//! diagrams to generate shaped inputs", *J. Mechanical Design* 116, 1994; two- and three-hump EI by W. Singhose, L. Porter,
//! T. Tuttle, N. Singer, "Vibration reduction using multi-hump input shapers", same journal as the first, 119, 1997. MZV is
//! Klipper's: three impulses within three quarters of a period (its documentation, "Resonance Compensation").

use crate::error::{Error, Result};
use std::f64::consts::{PI, SQRT_2};

/// Vibration that the EI shapers leave where they are designed for, of that without a shaper.
pub const TOLERANCE: f64 = 0.05;

/// The damping ratio that is assumed where none is known.
pub const USUAL_DAMPING: f64 = 0.1;

/// Which shaper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
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

impl Kind {
    /// All of them, the shorter ones first.
    pub const ALL: [Kind; 6] = [Kind::Zv, Kind::Mzv, Kind::Zvd, Kind::Ei, Kind::TwoHumpEi, Kind::ThreeHumpEi];

    /// Its name, as in Klipper's configuration.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Zv => "zv",
            Kind::Mzv => "mzv",
            Kind::Zvd => "zvd",
            Kind::Ei => "ei",
            Kind::TwoHumpEi => "2hump_ei",
            Kind::ThreeHumpEi => "3hump_ei",
        }
    }

    /// Time between impulses, in damped periods.
    pub fn spacing(self) -> f64 {
        if self == Kind::Mzv { 0.375 } else { 0.5 }
    }

    /// Amplitudes of the impulses for a mode without damping; their sum is 1.
    pub fn amplitudes(self) -> Vec<f64> {
        let v = TOLERANCE;
        match self {
            Kind::Zv => vec![0.5, 0.5],
            // A₁ + A₂ e^{3πi/4} + A₁ e^{3πi/2} = 0 and 2 A₁ + A₂ = 1
            Kind::Mzv => vec![1.0 - 1.0 / SQRT_2, SQRT_2 - 1.0, 1.0 - 1.0 / SQRT_2],
            Kind::Zvd => vec![0.25, 0.5, 0.25],
            // V at the design frequency, zero at two frequencies beside it                     (Singhose 1994)
            Kind::Ei => vec![(1.0 + v) / 4.0, (1.0 - v) / 2.0, (1.0 + v) / 4.0],
            Kind::TwoHumpEi => {
                // X = ∛(V² (√(1 − V²) + 1)), A₁ = (3 X² + 2 X + 3 V²) / (16 X), A₂ = ½ − A₁     (Singhose 1997)
                let x = (v * v * ((1.0 - v * v).sqrt() + 1.0)).cbrt();
                let a = (3.0 * x * x + 2.0 * x + 3.0 * v * v) / (16.0 * x);
                vec![a, 0.5 - a, 0.5 - a, a]
            }
            Kind::ThreeHumpEi => {
                // A₁ = (1 + 3 V + 2 √(2 (V² + V))) / 16, A₂ = (1 − V) / 4, A₃ = 1 − 2 (A₁ + A₂)  (Singhose 1997)
                let a = (1.0 + 3.0 * v + 2.0 * (2.0 * (v * v + v)).sqrt()) / 16.0;
                let b = (1.0 - v) / 4.0;
                vec![a, b, 1.0 - 2.0 * (a + b), b, a]
            }
        }
    }

    /// The shaper of this name.
    pub fn from_name(name: &str) -> Option<Kind> {
        Kind::ALL.into_iter().find(|kind| kind.name().eq_ignore_ascii_case(name.trim()))
    }
}

/// A shaper for one frequency and damping ratio.
#[derive(Debug, Clone, PartialEq)]
pub struct Shaper {
    /// Which.
    pub kind: Kind,
    /// Undamped natural frequency of the mode it is designed for, Hz.
    pub frequency: f64,
    /// Damping ratio ζ of that mode.
    pub damping: f64,
    impulses: Vec<(f64, f64)>,
}

impl Shaper {
    /// The shaper for a mode of undamped natural `frequency` (Hz, above 0) and `damping` ratio (0 to below 1).
    pub fn new(kind: Kind, frequency: f64, damping: f64) -> Result<Self> {
        if !(frequency > 0.0 && frequency.is_finite()) {
            let error = Error::new(format!("a shaper cannot be designed for {frequency} Hz"));
            return Err(error.allowed("a frequency above 0 Hz").next("give the frequency of a resonance"));
        }
        check_damping(damping)?;
        Ok(Self::of(kind, frequency, damping))
    }

    /// As [`Shaper::new`], of values that were checked.
    pub(crate) fn of(kind: Kind, frequency: f64, damping: f64) -> Self {
        let (f, zeta) = (frequency, damping);
        let root = (1.0 - zeta * zeta).sqrt();
        // t_i = i s T_d, T_d = 1 / (f √(1 − ζ²))
        let period = 1.0 / (f * root);
        // A_i = a_i e^{−ζ ω t_i} / Σ: at the last impulse all vibrations then weigh as they do without damping. Which
        // impulses cancel is thereby kept; an EI shaper leaves a little less than its tolerance.
        let weight = |i: usize| (-2.0 * PI * zeta / root * kind.spacing() * i as f64).exp();
        let amplitudes: Vec<f64> = kind.amplitudes().iter().enumerate().map(|(i, a)| a * weight(i)).collect();
        let sum: f64 = amplitudes.iter().sum();
        let impulses = amplitudes.iter().enumerate().map(|(i, a)| (i as f64 * kind.spacing() * period, a / sum));
        Self { kind, frequency, damping, impulses: impulses.collect() }
    }

    /// Time (s, from 0, ascending) and amplitude of each impulse; the amplitudes are positive and sum to 1.
    pub fn impulses(&self) -> &[(f64, f64)] {
        &self.impulses
    }

    /// How much later a shaped move ends, s.
    pub fn duration(&self) -> f64 {
        self.impulses.last().map_or(0.0, |impulse| impulse.0)
    }

    /// The amplitude-weighted middle of its impulses, s: by how much it delays a slow command.
    pub fn delay(&self) -> f64 {
        // Σ A_i t_i
        self.impulses.iter().map(|(t, a)| a * t).sum()
    }

    /// Vibration that is left of a mode of that undamped natural `frequency` (Hz) and `damping` ratio, as part of what an
    /// unshaped step leaves, both after the last impulse: see [`residual_vibration`].
    pub fn residual_vibration(&self, frequency: f64, damping: f64) -> f64 {
        residual_vibration(&self.impulses, frequency, damping)
    }

    /// How far a shaped path leaves a corner, m: see [`Corner`].
    pub fn smoothing(&self, corner: &Corner) -> f64 {
        let (quarter, half) = self.corner_moments();
        // 90°: the way √2 Σ A_i (v u_i + a u_i²/2) over impulses later than the middle.  180°: Σ A_i a u_i²/2 over all
        let right = SQRT_2 * (corner.speed * quarter.0 + 0.5 * corner.acceleration * quarter.1);
        right.max(0.5 * corner.acceleration * half)
    }

    /// The greatest acceleration, m/s², at which [`Shaper::smoothing`] stays within `limit` (m) at a corner speed in m/s;
    /// 0 if there is none.
    pub fn max_acceleration(&self, limit: f64, corner_speed: f64) -> f64 {
        let (quarter, half) = self.corner_moments();
        let right = 2.0 * (limit / SQRT_2 - corner_speed * quarter.0) / quarter.1;
        right.min(2.0 * limit / half).max(0.0)
    }

    /// Σ A u and Σ A u² over impulses later than the middle, and Σ A u² over all; u is the time from the middle.
    fn corner_moments(&self) -> ((f64, f64), f64) {
        let middle = self.delay();
        let (mut later, mut all) = ((0.0, 0.0), 0.0);
        for (t, a) in &self.impulses {
            let u = t - middle;
            all += a * u * u;
            if u > 0.0 {
                later = (later.0 + a * u, later.1 + a * u * u);
            }
        }
        (later, all)
    }

    /// The frequencies about the shaper's own at which no mode with one of these damping ratios keeps more than `level` of
    /// its vibration, as parts of the shaper's frequency; none if its own is not among them.
    pub fn insensitivity(&self, level: f64, dampings: &[f64]) -> Option<(f64, f64)> {
        const STEP: f64 = 1e-3;
        let f = self.frequency;
        let rounding = 1e-9;
        let worst = |x: f64| dampings.iter().map(|z| self.residual_vibration(x * f, *z)).fold(0.0, f64::max);
        let within = |x: f64| worst(x) <= level + rounding;
        let edge = |direction: f64| {
            let mut x = 1.0;
            while within(x + direction * STEP) && x > 2.0 * STEP && x < 5.0 {
                x += direction * STEP;
            }
            let (mut inside, mut outside) = (x, x + direction * STEP);
            for _ in 0..40 {
                let middle = 0.5 * (inside + outside);
                if within(middle) { inside = middle } else { outside = middle }
            }
            inside
        };
        within(1.0).then(|| (edge(-1.0), edge(1.0)))
    }
}

/// A corner of a path, by which shapers are compared: how fast it is taken, and how hard the axis accelerates before and after.
///
/// A shaper replaces a motion x(t) by Σ A_i x(t − u_i), u_i counted from the middle of its impulses; where x(t) is straight
/// that changes nothing, at a corner it cuts. At a right angle each axis has come with v t + a t²/2, and the way from the tip
/// is √2 of one axis'; at a reversal the axis turns back with a t²/2. The greater of both is called smoothing. It compares
/// shapers; what a workpiece shows depends on its real path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// m/s².
    pub acceleration: f64,
    /// Speed at a right angle, m/s.
    pub speed: f64,
}

impl Default for Corner {
    /// 5 m/s² and 5 mm/s, as Klipper compares.
    fn default() -> Self {
        Self { acceleration: 5.0, speed: 5e-3 }
    }
}

/// Vibration of a mode after a sequence of impulses (time in s, amplitude), as part of that after one impulse of their sum
/// at the time of the last: undamped natural frequency in Hz, damping ratio from 0 to below 1.
pub fn residual_vibration(impulses: &[(f64, f64)], frequency: f64, damping: f64) -> f64 {
    let (omega, zeta) = (2.0 * PI * frequency, damping);
    let omega_d = omega * (1.0 - zeta * zeta).sqrt();
    let last = impulses.last().map_or(0.0, |impulse| impulse.0);
    // V = √(C² + S²) / Σ A_i, C = Σ A_i e^{−ζω(t_n − t_i)} cos ω_d t_i, S likewise        (Singer & Seering 1990)
    let (mut c, mut s, mut sum) = (0.0, 0.0, 0.0);
    for &(t, a) in impulses {
        let weight = a * (-zeta * omega * (last - t)).exp();
        let (sin, cos) = (omega_d * t).sin_cos();
        (c, s, sum) = (c + weight * cos, s + weight * sin, sum + a);
    }
    c.hypot(s) / sum
}

/// Whether a damping ratio is one of a mode that vibrates.
pub fn check_damping(damping: f64) -> Result<()> {
    if (0.0..1.0).contains(&damping) {
        return Ok(());
    }
    let error = Error::new(format!("a damping ratio of {damping} is not that of a vibration"));
    Err(error.allowed("0 up to below 1; most machines have 0.01 to 0.2").next("correct the damping ratio"))
}
