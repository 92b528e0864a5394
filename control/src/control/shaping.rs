//! Which shaper, and at which frequency: the criterion by which Klipper chooses, on a spectrum or on the modes of a
//! model.
//!
//! For every frequency of a grid a shaper leaves some vibration and costs some smoothing. Of each kind the frequency is
//! taken that leaves the least vibration or hardly more, with the best score; and of all kinds the one with the clearly
//! best score.

use super::pairs::{Pair, pairs};
use super::resonance::Resonance;
use super::shaper::{Corner, Firmware, Form, Kind, Pattern, Shaper, TOLERANCE, USUAL_DAMPING, check_damping};
use super::spectrum::Spectrum;
use crate::error::{Error, Result};
use crate::quantity::rounded;

/// The highest frequency of a shaper for a spectrum, Hz; it is not reached.
const HIGHEST: f64 = 150.0;
/// Steps of a shaper's frequency within one hertz.
const STEPS: f64 = 5.0;
/// Smoothing that is not too much, m: what the greatest acceleration is suggested for.
pub const ALLOWED_SMOOTHING: f64 = 0.12e-3;

/// Where within the uncertainty of its frequency a mode is looked at.
const PARTS: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];

/// The vibration that a shaper is chosen for.
#[derive(Debug, Clone, Copy)]
pub enum Target<'a> {
    /// Density over frequency; damping is not known.
    Spectrum(&'a Spectrum),
    /// Several of them: what remains of the one of which most does counts.
    Spectra(&'a [Spectrum]),
    /// Modes of known damping, each at its own time: the one that keeps the most counts.
    Modes {
        /// At all places of the travel.
        modes: &'a [Resonance],
        /// By which part their true frequencies may be higher or lower.
        uncertainty: f64,
    },
}

/// By what shapers are chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Criterion {
    /// Damping ratio that shapers are designed for.
    pub damping: f64,
    /// Damping ratios of the machine at which a spectrum's vibration is looked at; the worst counts.
    pub tested: Vec<f64>,
    /// The corner at which smoothing is compared.
    pub corner: Corner,
    /// Most smoothing that is allowed, m.
    pub max_smoothing: Option<f64>,
    /// Most vibration that is wanted, of that without a shaper.
    pub max_vibrations: Option<f64>,
    /// Whose definitions and rule.
    pub firmware: Firmware,
    /// Forms that are fitted.
    pub forms: Vec<Form>,
    /// Those of them that may be recommended.
    pub candidates: Vec<Form>,
    /// Whether pairs of them, convolved, are looked at, too.
    pub pairs: bool,
}

impl Default for Criterion {
    /// As Klipper's: designed for a damping ratio of 0.1, looked at from 0.075 to 0.15. ZVD is fitted, but not a
    /// candidate: it is as long as EI and covers less.
    fn default() -> Self {
        let forms: Vec<Form> = Kind::ALL.map(Form::from).to_vec();
        let candidates = forms.iter().copied().filter(|form| form.kind() != Kind::Zvd).collect();
        let mut criterion = Self {
            damping: 0.0,
            tested: Vec::new(),
            corner: Corner::default(),
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
    /// Designs for a damping ratio ζ, and looks at ¾ ζ, ζ and 1½ ζ.
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

/// A shaper at its best frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// The shaper.
    pub shaper: Shaper,
    /// Vibration that remains, of that without a shaper: 0 to 1, see [`Target::remaining`].
    pub vibration: f64,
    /// Smoothing at the criterion's corner, m.
    pub smoothing: f64,
    /// Greatest acceleration with at most [`ALLOWED_SMOOTHING`], m/s².
    pub max_acceleration: f64,
    /// The score that is compared, smaller is better: smoothing in mm times a measure of the vibration.
    pub score: f64,
    /// Whether it may be recommended.
    pub is_candidate: bool,
    /// Whether its frequency is the lowest that is tried: a lower one might leave less, and would smooth more.
    pub is_lowest: bool,
}

/// All kinds at their best, and the one to take.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// In the order of the criterion's forms, without those that `max_smoothing` excludes and those that there are not
    /// for its damping ratio.
    pub fitted: Vec<Fitted>,
    /// The place of the recommended one among them.
    pub recommended: usize,
    /// Why that one.
    pub reason: String,
    /// Pairs of shapers, convolved, the best first; empty unless they were asked for.
    pub pairs: Vec<Pair>,
    /// Whether the first of them is clearly better than the recommended shaper.
    pub is_pair_better: bool,
}

impl Choice {
    /// The recommended one.
    pub fn best(&self) -> &Fitted {
        &self.fitted[self.recommended]
    }
}

impl Target<'_> {
    /// Vibration that a shaper leaves, of that without one: 0 to 1; of a spectrum what is above a twentieth of the
    /// highest peak.
    pub fn remaining(&self, shaper: &Shaper, dampings: &[f64]) -> f64 {
        self.weighed(dampings, &mut |f, zeta| shaper.residual_vibration(f, zeta))
    }

    /// The same of anything that leaves V(f, ζ), which is asked for always in the same order.
    pub(super) fn weighed(&self, dampings: &[f64], left: &mut dyn FnMut(f64, f64) -> f64) -> f64 {
        match self {
            Target::Spectrum(spectrum) => of_spectrum(spectrum, left, dampings),
            Target::Spectra(spectra) => {
                spectra.iter().map(|spectrum| of_spectrum(spectrum, left, dampings)).fold(0.0, f64::max)
            }
            // max V w / w_max over modes and over f (1 − u) to f (1 + u); nothing is taken off, as a model has no noise
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

    /// The spectrum that is left behind a shaper, at the worst of the damping ratios.
    pub fn left(spectrum: &Spectrum, shaper: &Shaper, dampings: &[f64]) -> Vec<f64> {
        let worst = |f: f64| dampings.iter().map(|z| shaper.residual_vibration(f, *z)).fold(0.0, f64::max);
        spectrum.frequency.iter().zip(&spectrum.density).map(|(f, p)| worst(*f) * p).collect()
    }

    /// Frequencies that are tried for a kind, ascending.
    pub(super) fn grid(&self, kind: Kind) -> Vec<f64> {
        match self {
            Target::Spectrum(_) | Target::Spectra(_) => {
                let first = lowest(kind) * STEPS;
                let count = (HIGHEST * STEPS - first) as usize;
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

/// The lowest frequency that is tried on a spectrum, Hz: below, hardly 1500 mm/s² would be left.
fn lowest(kind: Kind) -> f64 {
    match kind {
        Kind::Zv => 21.0,
        Kind::Mzv => 23.0,
        Kind::Zvd | Kind::Ei => 29.0,
        Kind::TwoHumpEi => 39.0,
        Kind::ThreeHumpEi => 48.0,
    }
}

/// Fits every form, and recommends one.
pub fn choose(target: Target<'_>, criterion: &Criterion) -> Result<Choice> {
    if let Target::Modes { modes: [], .. } = target {
        return Err(Error::new("there is no mode to shape for").next("give a model whose belt stretches"));
    }
    let (mut fitted, mut refused) = (Vec::new(), None);
    for form in &criterion.forms {
        match Pattern::new(*form, criterion.firmware, criterion.damping) {
            Ok(pattern) => fitted.extend(Tried::all(target, &pattern, criterion)),
            Err(error) => refused = Some(error),
        }
    }
    let candidates: Vec<usize> =
        (0..fitted.len()).filter(|&i| criterion.candidates.contains(&fitted[i].pattern.form)).collect();
    let Some(&first) = candidates.first() else {
        if let (Some(error), true) = (refused, fitted.is_empty()) {
            return Err(error);
        }
        let limit = rounded(criterion.max_smoothing.unwrap_or_default() * 1e3);
        let error = Error::new(format!("no shaper has so little smoothing as {limit} mm"));
        return Err(error.next("allow more smoothing, or more kinds of shapers"));
    };
    let recommended = match criterion.firmware {
        Firmware::Klipper202508 => candidates.iter().copied().skip(1).fold(first, |best, i| {
            if is_clearly_better(fitted[i].taken().rank(), fitted[best].taken().rank()) { i } else { best }
        }),
        Firmware::Klipper => {
            let is_measured = !matches!(target, Target::Modes { .. });
            recommended(&mut fitted, &candidates, criterion.max_vibrations, is_measured)
        }
    };
    let fitted: Vec<Fitted> = fitted.iter().map(|one| one.fitted(criterion)).collect();
    let reason = reason(&fitted, recommended);
    let pairs = if criterion.pairs { pairs(target, criterion) } else { Vec::new() };
    let best = &fitted[recommended];
    let is_pair_better = pairs.first().is_some_and(|pair| {
        let quieter = criterion.max_vibrations.is_some_and(|most| best.vibration > most);
        is_clearly_better((pair.score, pair.smoothing), (best.score, best.smoothing))
            || quieter && pair.vibration < best.vibration
    });
    Ok(Choice { fitted, recommended, reason, pairs, is_pair_better })
}

/// A shaper at one frequency.
#[derive(Debug, Clone)]
struct Point {
    shaper: Shaper,
    vibration: f64,
    smoothing: f64,
    score: f64,
}

impl Point {
    /// Score and smoothing.
    fn rank(&self) -> (f64, f64) {
        (self.score, self.smoothing)
    }
}

/// Smoothing in mm times (v^1.5 + 0.2 v + 0.01): with little vibration v left it is smoothing that counts.
pub(super) fn score(smoothing: f64, v: f64) -> f64 {
    smoothing * 1e3 * (v.powf(1.5) + 0.2 * v + 0.01)
}

/// A form at all frequencies, ascending, and the one that is taken.
struct Tried {
    pattern: Pattern,
    points: Vec<Point>,
    taken: usize,
    lowest: Option<f64>,
}

/// By score and smoothing; a longer shaper must be clearly better: by a fifth, or by a twentieth with a tenth less
/// smoothing.
fn is_clearly_better(one: (f64, f64), other: (f64, f64)) -> bool {
    1.2 * one.0 < other.0 || 1.05 * one.0 < other.0 && 1.1 * one.1 < other.1
}

/// The rule since 2025-10: as before from shorter to longer; a longer one, too, where the best so far leaves more than
/// is wanted and it leaves less; each is moved to where it leaves less and smooths less than the best so far, if there
/// is such a frequency; and a ZV gives way to the first that leaves a tenth less, unless what vibrates is known from a
/// model.
fn recommended(fitted: &mut [Tried], candidates: &[usize], wanted: Option<f64>, is_measured: bool) -> usize {
    let mut best = candidates[0];
    for &i in candidates {
        let (one, other) = (fitted[i].taken().clone(), fitted[best].taken().clone());
        let quieter = wanted.is_some_and(|most| other.vibration > most) && one.vibration < other.vibration;
        if i != best && (is_clearly_better(one.rank(), other.rank()) || quieter) {
            best = i;
        }
        let mut least = (fitted[best].taken().vibration, fitted[best].taken().smoothing);
        for place in 0..fitted[i].points.len() {
            let point = &fitted[i].points[place];
            if point.vibration < least.0 && point.smoothing < least.1 {
                least = (point.vibration, point.smoothing);
                (best, fitted[i].taken) = (i, place);
            }
        }
    }
    if is_measured && fitted[best].pattern.form.kind() == Kind::Zv {
        let left = fitted[best].taken().vibration;
        let other = candidates
            .iter()
            .copied()
            .find(|&i| fitted[i].pattern.form.kind() != Kind::Zv && 1.1 * fitted[i].taken().vibration < left);
        best = other.unwrap_or(best);
    }
    best
}

impl Tried {
    /// A form at every frequency; none if it always smooths too much.
    fn all(target: Target<'_>, pattern: &Pattern, criterion: &Criterion) -> Option<Self> {
        let grid = target.grid(pattern.form.kind());
        let point = |frequency: f64| {
            let shaper = pattern.at(frequency);
            let smoothing = shaper.smoothing(&criterion.corner);
            if criterion.max_smoothing.is_some_and(|most| smoothing > most) {
                return None;
            }
            let v = target.remaining(&shaper, &criterion.tested);
            let score = score(smoothing, v);
            Some(Point { shaper, vibration: v, smoothing, score })
        };
        let points: Vec<Point> = grid.iter().copied().filter_map(point).collect();
        // The least vibration; of equals the highest frequency, which smooths least.
        let (mut taken, least) =
            points.iter().enumerate().rev().min_by(|a, b| a.1.vibration.total_cmp(&b.1.vibration))?;
        let least = least.vibration;
        // What leaves hardly more is as good, and may have the better score.
        let (more, is_loud) = match criterion.firmware {
            Firmware::Klipper202508 => (0.0, false),
            Firmware::Klipper => (0.0005, criterion.max_vibrations.is_some_and(|most| least > most)),
        };
        // Where too much was left out to smooth less, the least vibration is what is wanted.
        let is_cut = criterion.firmware == Firmware::Klipper && points.len() < grid.len();
        if !is_cut {
            for (place, point) in points.iter().enumerate() {
                if point.vibration < 1.1 * least + more && (point.score < points[taken].score || is_loud) {
                    taken = place;
                }
            }
        }
        Some(Self { pattern: pattern.clone(), points, taken, lowest: grid.first().copied() })
    }

    fn taken(&self) -> &Point {
        &self.points[self.taken]
    }

    fn fitted(&self, criterion: &Criterion) -> Fitted {
        let point = self.taken();
        Fitted {
            shaper: point.shaper.clone(),
            vibration: point.vibration,
            smoothing: point.smoothing,
            max_acceleration: point.shaper.max_acceleration(ALLOWED_SMOOTHING, criterion.corner.speed),
            score: point.score,
            is_candidate: criterion.candidates.contains(&self.pattern.form),
            is_lowest: self.lowest == Some(point.shaper.frequency),
        }
    }
}

fn reason(fitted: &[Fitted], recommended: usize) -> String {
    let best = &fitted[recommended];
    let told = |one: &Fitted| {
        format!("leaves {:.1} % of the vibration and smooths by {:.3} mm", 100.0 * one.vibration, 1e3 * one.smoothing)
    };
    let name = |one: &Fitted| one.shaper.form.name();
    let other = |i: &usize| *i != recommended && fitted[*i].is_candidate;
    let next = (0..fitted.len()).filter(other).min_by(|a, b| fitted[*a].score.total_cmp(&fitted[*b].score));
    let Some(next) = next.map(|i| &fitted[i]) else {
        return format!("{} {}; no other is a candidate", name(best), told(best));
    };
    let ratio = next.score / best.score;
    let words = match ratio {
        r if r >= 1.2 => {
            format!("the next best, {}, {}, and its score is {r:.2} times as high", name(next), told(next))
        }
        r if r >= 1.0 => {
            format!("{} is nearly as good: it {}, and its score is {r:.2} times as high", name(next), told(next))
        }
        r => format!(
            "{} {}, and its score is {r:.2} of that: too little gained for a longer one",
            name(next),
            told(next)
        ),
    };
    format!("{} {}; {words}", name(best), told(best))
}
