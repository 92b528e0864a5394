//! Criteria for choosing shapers: residual vibration, smoothing, and the score of both.

use super::kind::{ShaperKind, TOLERANCE};
use super::shaper::{Corner, Firmware, Form, Shaper, USUAL_DAMPING, check_damping, max_acceleration};
use super::spectrum::Spectrum;
use crate::error::Result;
use crate::reach::resonance::Resonance;

/// Steps of a shaper's frequency within one hertz.
const STEPS: f64 = 5.0;
/// Allowed smoothing, m, for which the maximum acceleration is suggested.
pub const ALLOWED_SMOOTHING: f64 = 0.12e-3;

/// Fractions of the frequency uncertainty at which a mode is evaluated.
const PARTS: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];

/// The vibration that a shaper is chosen for.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum Target<'a> {
    /// Density over frequency; damping is not known.
    Spectrum(&'a Spectrum),
    /// Several of them: the worst one counts.
    Spectra(&'a [Spectrum]),
    /// Modes of known damping, each taken alone: the worst one counts.
    Modes {
        /// Modes at all positions of the travel.
        modes: &'a [Resonance],
        /// Relative uncertainty of their frequencies.
        uncertainty: f64,
    },
}

/// Criterion for the choice of shapers.
#[derive(Debug, Clone, PartialEq)]
pub struct Criterion {
    /// Damping ratio that shapers are designed for.
    pub damping: f64,
    /// Damping ratios of the machine at which a spectrum's vibration is evaluated; the worst counts.
    pub tested: Vec<f64>,
    /// The corner at which smoothing is compared.
    pub corner: Corner,
    /// Largest acceleration that the motors give, m/s²; suggested ones are not above it.
    pub motor_acceleration: Option<f64>,
    /// Largest allowed smoothing, m.
    pub max_smoothing: Option<f64>,
    /// Largest desired vibration relative to that without a shaper.
    pub max_vibrations: Option<f64>,
    /// Firmware whose definitions and rule apply.
    pub firmware: Firmware,
    /// Forms that are fitted.
    pub forms: Vec<Form>,
    /// The forms that may be recommended.
    pub candidates: Vec<Form>,
    /// True if convolved pairs are also tried.
    pub pairs: bool,
}

impl Default for Criterion {
    /// As in Klipper: designed for a damping ratio of 0.1, evaluated from 0.075 to 0.15. ZVD is fitted, but not a
    /// candidate: it is as long as EI and covers less.
    fn default() -> Self {
        let forms: Vec<Form> = ShaperKind::ALL.map(Form::from).to_vec();
        let candidates = forms.iter().copied().filter(|form| form.kind() != ShaperKind::Zvd).collect();
        let mut criterion = Self {
            damping: 0.0,
            tested: Vec::new(),
            corner: Corner::default(),
            motor_acceleration: None,
            max_smoothing: None,
            max_vibrations: None,
            firmware: Firmware::default(),
            forms,
            candidates,
            pairs: false,
        };
        criterion.assume(USUAL_DAMPING);
        criterion
    }
}

impl Criterion {
    /// Largest acceleration to suggest with these impulses, m/s²: smoothing stays within [`ALLOWED_SMOOTHING`], and the
    /// motors give it.
    pub(super) fn max_acceleration(&self, impulses: &[(f64, f64)]) -> f64 {
        let smoothed = max_acceleration(impulses, ALLOWED_SMOOTHING, self.corner.speed);
        self.motor_acceleration.map_or(smoothed, |most| smoothed.min(most))
    }

    /// Designs for a damping ratio ζ; a spectrum is still evaluated at the usual ratios, as Klipper does.
    pub fn designed_for(mut self, damping: f64) -> Result<Self> {
        check_damping(damping)?;
        self.damping = damping;
        Ok(self)
    }

    /// Designs for a damping ratio ζ that is known of the machine, and evaluates ¾ ζ, ζ and 1½ ζ.
    pub fn with_damping(mut self, damping: f64) -> Result<Self> {
        check_damping(damping)?;
        self.assume(damping);
        Ok(self)
    }

    /// Fits these forms alone; each may be recommended.
    pub fn with_forms(mut self, forms: &[Form]) -> Self {
        self.forms = forms.to_vec();
        self.candidates = forms.to_vec();
        self
    }

    fn assume(&mut self, damping: f64) {
        self.damping = damping;
        self.tested = vec![0.75 * damping, damping, (1.5 * damping).min(0.999)];
        self.tested.dedup();
    }
}

impl Target<'_> {
    /// Remaining vibration relative to that without a shaper, 0 to 1; for a spectrum, above a twentieth of the highest
    /// peak.
    pub fn remaining(&self, shaper: &Shaper, dampings: &[f64]) -> f64 {
        self.weighed(dampings, &mut |f, zeta| shaper.residual_vibration(f, zeta))
    }

    /// Weighed vibration of any residual V(f, ζ), which is evaluated in a fixed order.
    pub(super) fn weighed(&self, dampings: &[f64], left: &mut dyn FnMut(f64, f64) -> f64) -> f64 {
        match self {
            Target::Spectrum(spectrum) => of_spectrum(spectrum, left, dampings),
            Target::Spectra(spectra) => {
                spectra.iter().map(|spectrum| of_spectrum(spectrum, left, dampings)).fold(0.0, f64::max)
            }
            // max V w / w_max over modes and over f (1 − u) to f (1 + u); no threshold, since a model has no noise
            Target::Modes { modes, uncertainty } => {
                let most = modes.iter().map(|mode| mode.share).fold(0.0, f64::max);
                let mut at = |mode: &Resonance, part: f64| {
                    let f = mode.frequency * (1.0 + part * uncertainty);
                    left(f, mode.damping) * mode.share / most
                };
                let mut worst = |mode: &Resonance| PARTS.iter().map(|part| at(mode, *part)).fold(0.0, f64::max);
                modes.iter().map(&mut worst).fold(0.0, f64::max)
            }
        }
    }

    /// Spectrum after a shaper, at the worst of the damping ratios.
    pub fn left(spectrum: &Spectrum, shaper: &Shaper, dampings: &[f64]) -> Vec<f64> {
        let worst = |f: f64| dampings.iter().map(|z| shaper.residual_vibration(f, *z)).fold(0.0, f64::max);
        spectrum.frequency.iter().zip(&spectrum.density).map(|(f, p)| worst(*f) * p).collect()
    }

    /// Frequencies tried for a kind, ascending.
    pub(super) fn grid(&self, kind: ShaperKind, firmware: Firmware) -> Vec<f64> {
        match self {
            Target::Spectrum(_) | Target::Spectra(_) => {
                let first = lowest(kind) * STEPS;
                let count = (highest(firmware) * STEPS - first) as usize;
                (0..count).map(|k| (first + k as f64) / STEPS).collect()
            }
            Target::Modes { modes, .. } => {
                let low = modes.iter().map(|mode| mode.frequency).fold(f64::INFINITY, f64::min);
                let high = modes.iter().map(|mode| mode.frequency).fold(0.0, f64::max);
                let step = low / 200.0;
                let count = ((3.0 * high - 0.5 * low) / step) as usize;
                (0..count.min(20_000)).map(|k| 0.5 * low + k as f64 * step).collect()
            }
        }
    }
}

/// Σ max(V P − P_max/20, 0) / Σ max(P − P_max/20, 0), at the worst of the damping ratios.
fn of_spectrum(spectrum: &Spectrum, v: &mut dyn FnMut(f64, f64) -> f64, dampings: &[f64]) -> f64 {
    let floor = TOLERANCE * spectrum.greatest();
    let above = |p: f64| (p - floor).max(0.0);
    let lines = || spectrum.frequency.iter().zip(&spectrum.density).filter(|(_, p)| **p > floor);
    let whole: f64 = lines().map(|(_, p)| above(*p)).sum();
    let left = |zeta: &f64| -> f64 { lines().map(|(f, p)| above(v(*f, *zeta) * p)).sum() };
    dampings.iter().map(left).fold(0.0, f64::max) / whole
}

/// Upper limit of the frequencies tried on a spectrum, Hz.
fn highest(firmware: Firmware) -> f64 {
    match firmware {
        Firmware::Klipper => 200.0,
        Firmware::Klipper202508 => 150.0,
    }
}

/// Lowest frequency tried on a spectrum, Hz: a lower one would allow less than about 1500 mm/s².
fn lowest(kind: ShaperKind) -> f64 {
    match kind {
        ShaperKind::Zv => 21.0,
        ShaperKind::Mzv => 23.0,
        ShaperKind::Zvd | ShaperKind::Ei => 29.0,
        ShaperKind::TwoHumpEi => 39.0,
        ShaperKind::ThreeHumpEi => 48.0,
    }
}

/// Smoothing in mm times (v^1.5 + 0.2 v + 0.01): with little remaining vibration v, smoothing decides.
pub(super) fn score(smoothing: f64, v: f64) -> f64 {
    smoothing * 1e3 * (v.powf(1.5) + 0.2 * v + 0.01)
}
