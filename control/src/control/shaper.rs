//! Input shapers: a command is split into several smaller ones, timed so that the vibrations they excite cancel.
//!
//! Sources: ZV and ZVD by N. Singer, W. Seering, "Preshaping command inputs to reduce system vibration", *J. Dynamic
//! Systems, Measurement, and Control* 112, 1990; EI by W. Singhose, W. Seering, N. Singer, "Residual vibration
//! reduction using vector diagrams to generate shaped inputs", *J. Mechanical Design* 116, 1994; two- and three-hump EI
//! by W. Singhose, L. Porter, T. Tuttle, N. Singer, "Vibration reduction using multi-hump input shapers", same journal
//! as the first, 119, 1997. MZV is Klipper's: three impulses within three quarters of a period (its documentation,
//! "Resonance Compensation").

pub use super::kind::{ShaperKind, TOLERANCE};
use super::polynomials;
use crate::error::{Error, Result};
use nalgebra::Complex;
use std::f64::consts::{PI, SQRT_2};

/// Default damping ratio.
pub(crate) const USUAL_DAMPING: f64 = 0.1;

/// Firmware whose definitions and rule of choice apply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Firmware {
    /// Klipper of 2026 (commit 034cb673): extra-insensitive shapers for a damped mode (2025-09-16), choice (2025-10),
    /// parameters of MZV and EI (2026-03-22), frequencies up to 200 Hz (2026).
    #[default]
    Klipper,
    /// Klipper until 2025-08.
    Klipper202508,
}

impl Firmware {
    /// All of them.
    pub const ALL: [Firmware; 2] = [Firmware::Klipper, Firmware::Klipper202508];

    /// As on the command line.
    pub fn word(self) -> &'static str {
        match self {
            Firmware::Klipper => "klipper",
            Firmware::Klipper202508 => "klipper-2025-08",
        }
    }
}

/// A kind with its parameters, in the notation of Klipper's configuration: `ei`, `mzv(n=4,t=0.9)`, `ei(v_tol=0.1)`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Form {
    /// With the usual parameters.
    Usual(ShaperKind),
    /// Zero vibration with equidistant impulses, the last after a number of damped periods.
    Mzv {
        /// 3 to 20.
        pulses: usize,
        /// In damped periods; 0.5 to below (n − 1)/2.
        duration: f64,
    },
    /// Extra-insensitive with another tolerance.
    Ei {
        /// Relative vibration at the design frequency.
        tolerance: f64,
    },
}

impl From<ShaperKind> for Form {
    fn from(kind: ShaperKind) -> Self {
        Form::Usual(kind)
    }
}

impl Form {
    /// Its kind.
    pub fn kind(self) -> ShaperKind {
        match self {
            Form::Usual(kind) => kind,
            Form::Mzv { .. } => ShaperKind::Mzv,
            Form::Ei { .. } => ShaperKind::Ei,
        }
    }

    /// As in Klipper's configuration.
    pub fn name(self) -> String {
        match self {
            Form::Usual(kind) => kind.name().into(),
            Form::Mzv { pulses, duration } => format!("mzv(n={pulses},t={duration})"),
            Form::Ei { tolerance } => format!("ei(v_tol={tolerance})"),
        }
    }

    /// Reads `ei`, `mzv(n=4,t=0.9)`, `mzv(n=4,tau=1)` or `ei(v_tol=0.1)`.
    pub fn read(text: &str) -> Result<Form> {
        let wrong = |what: String| {
            Error::new(what)
                .allowed("zv, mzv, zvd, ei, 2hump_ei, 3hump_ei, mzv(n=4,t=0.9), mzv(n=4,tau=1) and ei(v_tol=0.1)")
                .next("name one of these")
        };
        let text = text.trim();
        let (name, given) = match text.split_once('(') {
            None => (text, None),
            Some((name, rest)) => match rest.trim_end().strip_suffix(')') {
                Some(inside) => (name, Some(inside)),
                None => return Err(wrong(format!("the parenthesis of \"{text}\" is not closed"))),
            },
        };
        let kind =
            ShaperKind::from_name(name).ok_or_else(|| wrong(format!("there is no shaper \"{}\"", name.trim())))?;
        let Some(given) = given else { return Ok(Form::Usual(kind)) };
        let mut values: Vec<(&str, f64)> = Vec::new();
        for one in given.split(',') {
            let (key, value) = one.split_once('=').unwrap_or((one, ""));
            let number = value.trim().parse::<f64>().ok().filter(|value| value.is_finite());
            let Some(number) = number else {
                return Err(wrong(format!("\"{}\" in \"{text}\" is no number", one.trim())));
            };
            values.push((key.trim(), number));
        }
        let value = |key: &str| values.iter().find(|(known, _)| *known == key).map(|(_, value)| *value);
        let known: &[&str] = match kind {
            ShaperKind::Mzv => &["n", "t", "tau"],
            ShaperKind::Ei => &["v_tol"],
            ShaperKind::Zv | ShaperKind::Zvd | ShaperKind::TwoHumpEi | ShaperKind::ThreeHumpEi => &[],
        };
        if let Some((key, _)) = values.iter().find(|(key, _)| !known.contains(key)) {
            return Err(wrong(format!("{} has no parameter \"{key}\"", kind.name())));
        }
        let form = match kind {
            ShaperKind::Mzv => {
                let n = value("n").unwrap_or(3.0);
                if !(3.0..=20.0).contains(&n) || n.fract() != 0.0 {
                    return Err(wrong(format!("mzv with n = {n} impulses")).allowed("whole numbers from 3 to 20"));
                }
                // tau is the duration as the number of impulses goes to infinity.
                let duration = match (value("t"), value("tau")) {
                    (Some(_), Some(_)) => return Err(wrong("mzv takes either t or tau".into())),
                    (Some(t), None) => t,
                    (None, Some(tau)) => tau * (n - 1.0) / (n + 2.0 * tau - 2.0),
                    (None, None) => 0.75,
                };
                Form::Mzv { pulses: n as usize, duration }
            }
            ShaperKind::Ei => Form::Ei { tolerance: value("v_tol").unwrap_or(TOLERANCE) },
            ShaperKind::Zv | ShaperKind::Zvd | ShaperKind::TwoHumpEi | ShaperKind::ThreeHumpEi => Form::Usual(kind),
        };
        Pattern::new(form, Firmware::Klipper, USUAL_DAMPING).map(|_| form)
    }
}

/// The impulses of a shaper for a damping ratio, at any frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    /// Which.
    pub form: Form,
    /// Damping ratio ζ of the mode it is designed for.
    pub damping: f64,
    /// Time in undamped periods, amplitude.
    impulses: Vec<(f64, f64)>,
}

impl Pattern {
    /// Shaper of a form as a firmware defines it, for a damping ratio from 0 to below 1.
    pub fn new(form: Form, firmware: Firmware, damping: f64) -> Result<Self> {
        check_damping(damping)?;
        let kind = form.kind();
        if firmware == Firmware::Klipper202508 {
            let Form::Usual(kind) = form else {
                let error = Error::new(format!("klipper-2025-08 has no {}", form.name()));
                return Err(error.next("leave its parameters out, or take --firmware klipper"));
            };
            return Ok(Self { form, damping, impulses: weighted(&kind.amplitudes(), kind.spacing(), damping) });
        }
        let most = kind.most_damping();
        if damping > most {
            let error = Error::new(format!("{} for a damping ratio of {damping}", form.name()));
            return Err(error
                .allowed(format!("0 to {most}"))
                .next("take a shorter shaper, or a smaller damping ratio"));
        }
        let impulses = match form {
            Form::Usual(ShaperKind::Zv | ShaperKind::Mzv | ShaperKind::Zvd) => {
                weighted(&kind.amplitudes(), kind.spacing(), damping)
            }
            Form::Usual(_) => extra_insensitive(form, TOLERANCE, damping)?,
            Form::Ei { tolerance } => extra_insensitive(form, tolerance, damping)?,
            Form::Mzv { pulses, duration } => {
                let amplitudes = modified(pulses, duration).ok_or_else(|| {
                    let most = 0.5 * (pulses - 1) as f64;
                    Error::new(format!("{} has no impulses that are all positive", form.name()))
                        .allowed(format!("t from 0.5 to below {most}"))
                        .next("take another duration, or more impulses")
                })?;
                weighted(&amplitudes, duration / (pulses - 1) as f64, damping)
            }
        };
        Ok(Self { form, damping, impulses })
    }

    /// The shaper for a mode of this undamped natural frequency, Hz.
    pub fn at(&self, frequency: f64) -> Shaper {
        let impulses = self.impulses.iter().map(|&(t, a)| (t / frequency, a)).collect();
        Shaper { kind: self.form.kind(), form: self.form, frequency, damping: self.damping, impulses }
    }
}

/// Impulses (time in undamped periods, amplitude) at this spacing in damped periods: A_i = a_i e^{−ζ ω t_i} / Σ. At the
/// last impulse all vibrations then have the same weights as without damping, so that they cancel likewise.
fn weighted(amplitudes: &[f64], spacing: f64, zeta: f64) -> Vec<(f64, f64)> {
    let root = (1.0 - zeta * zeta).sqrt();
    let weight = |i: usize| (-2.0 * PI * zeta / root * spacing * i as f64).exp();
    let amplitudes: Vec<f64> = amplitudes.iter().enumerate().map(|(i, a)| a * weight(i)).collect();
    let sum: f64 = amplitudes.iter().sum();
    let all = amplitudes.iter().enumerate().filter(|(_, a)| **a != 0.0);
    all.map(|(i, a)| (i as f64 * spacing / root, a / sum)).collect()
}

/// An EI shaper of present Klipper.
fn extra_insensitive(form: Form, tolerance: f64, damping: f64) -> Result<Vec<(f64, f64)>> {
    let kind = form.kind();
    let known = (1e-4..=0.3).contains(&tolerance);
    let found = known.then(|| polynomials::impulses(kind, tolerance, damping));
    found.flatten().ok_or_else(|| {
        Error::new(format!("{} has no positive impulses for a damping ratio of {damping}", form.name()))
            .allowed("v_tol from 0.0001 to 0.3")
            .next("take another tolerance, or a smaller damping ratio")
    })
}

/// Undamped amplitudes of n impulses over t periods with zeros at the design frequency and at as many evenly spaced
/// others as possible: Σ A_i z^i = Π (z − e^{jθ_k}), θ_k = 2π/(n − 1) (t + k (n − 1 − 2t)/(n − 2)), k = 0 … n − 2. None
/// if one is negative.
fn modified(pulses: usize, duration: f64) -> Option<Vec<f64>> {
    let (n, t) = (pulses as f64, duration);
    if !(t >= 0.5 - 1e-9 && 2.0 * t < n - 1.0 - 1e-7) {
        return None;
    }
    let mut product = vec![Complex::new(1.0, 0.0)];
    for k in 0..pulses - 1 {
        let angle = 2.0 * PI / (n - 1.0) * (t + k as f64 * (n - 1.0 - 2.0 * t) / (n - 2.0));
        let zero = Complex::new(0.0, angle).exp();
        let mut next = vec![Complex::ZERO; product.len() + 1];
        for (i, a) in product.iter().enumerate() {
            next[i + 1] += a;
            next[i] -= a * zero;
        }
        product = next;
    }
    let sum: f64 = product.iter().map(|a| a.re).sum();
    // An amplitude of rounding size is zero.
    let sure = |a: f64| if a.abs() < 1e-12 { 0.0 } else { a };
    let amplitudes: Vec<f64> = product.iter().map(|a| sure(a.re / sum)).collect();
    amplitudes.iter().all(|a| *a >= 0.0).then_some(amplitudes)
}

/// A shaper for one frequency and damping ratio.
#[derive(Debug, Clone, PartialEq)]
pub struct Shaper {
    /// Which.
    pub kind: ShaperKind,
    /// Kind and parameters.
    pub form: Form,
    /// Undamped natural frequency of the mode it is designed for, Hz.
    pub frequency: f64,
    /// Damping ratio ζ of that mode.
    pub damping: f64,
    impulses: Vec<(f64, f64)>,
}

impl Shaper {
    /// The shaper for a mode of undamped natural `frequency` (Hz, above 0) and `damping` ratio (0 to below 1), damped
    /// as Klipper did until 2025-08; [`Shaper::formed`] has today's definitions.
    pub fn new(kind: ShaperKind, frequency: f64, damping: f64) -> Result<Self> {
        Self::formed(kind.into(), Firmware::Klipper202508, frequency, damping)
    }

    /// The shaper of a form by the definitions of a firmware.
    pub fn formed(form: Form, firmware: Firmware, frequency: f64, damping: f64) -> Result<Self> {
        if !(frequency > 0.0 && frequency.is_finite()) {
            let error = Error::new(format!("a shaper cannot be designed for {frequency} Hz"));
            return Err(error.allowed("a frequency above 0 Hz").next("give the frequency of a resonance"));
        }
        Ok(Pattern::new(form, firmware, damping)?.at(frequency))
    }

    /// Time (s, from 0, ascending) and amplitude of each impulse; the amplitudes are positive and sum to 1.
    pub fn impulses(&self) -> &[(f64, f64)] {
        &self.impulses
    }

    /// Delay of the end of a shaped move, s.
    pub fn duration(&self) -> f64 {
        self.impulses.last().map_or(0.0, |impulse| impulse.0)
    }

    /// Amplitude-weighted mean time of its impulses, s: its delay of a slow command.
    pub fn delay(&self) -> f64 {
        middle(&self.impulses)
    }

    /// Residual vibration of a mode of this undamped natural `frequency` (Hz) and `damping` ratio relative to an
    /// unshaped step, both after the last impulse: see [`residual_vibration`].
    pub fn residual_vibration(&self, frequency: f64, damping: f64) -> f64 {
        residual_vibration(&self.impulses, frequency, damping)
    }

    /// Distance of a shaped path from a corner, m: see [`Corner`].
    pub fn smoothing(&self, corner: &Corner) -> f64 {
        smoothing(&self.impulses, corner)
    }

    /// The greatest acceleration, m/s², at which [`Shaper::smoothing`] stays within `limit` (m) at a corner speed in
    /// m/s; 0 if there is none.
    pub fn max_acceleration(&self, limit: f64, corner_speed: f64) -> f64 {
        max_acceleration(&self.impulses, limit, corner_speed)
    }

    /// Range of relative frequencies around the shaper's own within which no mode with one of these damping ratios
    /// keeps more than `level` of its vibration; none if its own exceeds it.
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

/// A corner of a path for the comparison of shapers: its speed, and the acceleration before and after it.
///
/// A shaper replaces a motion x(t) by Σ A_i x(t − u_i), u_i counted from the mean time of its impulses; this does not
/// change a straight x(t), but cuts corners. At a right angle each axis moves by v t + a t²/2, and the distance from
/// the tip is √2 times that of one axis; at a reversal the axis returns with a t²/2. The larger of both is called
/// smoothing. It compares shapers; the effect on a workpiece depends on its real path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// m/s².
    pub acceleration: f64,
    /// Speed at a right angle, m/s.
    pub speed: f64,
}

impl Default for Corner {
    /// 5 m/s² and 5 mm/s, as in Klipper.
    fn default() -> Self {
        Self { acceleration: 5.0, speed: 5e-3 }
    }
}

/// Amplitude-weighted mean time of impulses, s.
fn middle(impulses: &[(f64, f64)]) -> f64 {
    // Σ A_i t_i
    impulses.iter().map(|(t, a)| a * t).sum()
}

/// Distance of a path after these impulses from a corner, m: see [`Corner`].
pub fn smoothing(impulses: &[(f64, f64)], corner: &Corner) -> f64 {
    let (quarter, half) = corner_moments(impulses);
    // 90°: the way √2 Σ A_i (v u_i + a u_i²/2) over impulses later than the middle.  180°: Σ A_i a u_i²/2 over all
    let right = SQRT_2 * (corner.speed * quarter.0 + 0.5 * corner.acceleration * quarter.1);
    right.max(0.5 * corner.acceleration * half)
}

/// Largest acceleration, m/s², for which [`smoothing`] stays within `limit` (m) at a corner speed in m/s; 0 if none
/// does.
pub fn max_acceleration(impulses: &[(f64, f64)], limit: f64, corner_speed: f64) -> f64 {
    let (quarter, half) = corner_moments(impulses);
    let right = 2.0 * (limit / SQRT_2 - corner_speed * quarter.0) / quarter.1;
    right.min(2.0 * limit / half).max(0.0)
}

/// Σ A u and Σ A u² over impulses later than the mean time, and Σ A u² over all; u is the time from the mean.
fn corner_moments(impulses: &[(f64, f64)]) -> ((f64, f64), f64) {
    let middle = middle(impulses);
    let (mut later, mut all) = ((0.0, 0.0), 0.0);
    for (t, a) in impulses {
        let u = t - middle;
        all += a * u * u;
        if u > 0.0 {
            later = (later.0 + a * u, later.1 + a * u * u);
        }
    }
    (later, all)
}

/// Residual vibration of a mode after a sequence of impulses (time in s, amplitude) relative to one impulse of their
/// sum at the time of the last; undamped natural frequency in Hz, damping ratio from 0 to below 1.
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

/// Checks that a damping ratio is at least 0 and below 1.
pub(crate) fn check_damping(damping: f64) -> Result<()> {
    if (0.0..1.0).contains(&damping) {
        return Ok(());
    }
    let error = Error::new(format!("a damping ratio of {damping} is not that of a vibration"));
    Err(error.allowed("0 up to below 1; most machines have 0.01 to 0.2").next("correct the damping ratio"))
}
