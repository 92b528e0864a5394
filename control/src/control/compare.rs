//! Comparison of two spectra: belts A and B, or before and after a change.

use super::spectrum::{Axis, LOWEST, Spectrum};

/// Relative difference of frequency up to which two peaks are paired.
const NEAR: f64 = 0.25;

/// Frequencies in files are rounded to this, Hz.
const ROUNDING: f64 = 0.1;

/// A peak of the first spectrum and the matching one of the second.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Pair {
    /// Frequency (Hz) and density in the first.
    pub first: (f64, f64),
    /// Frequency (Hz) and density in the second.
    pub second: (f64, f64),
}

impl Pair {
    /// Stiffness over mass of the second relative to the first, if both are the same mode: f = √(k/m) / 2π.
    pub fn stiffness_per_mass(&self) -> f64 {
        (self.second.0 / self.first.0).powi(2)
    }
}

/// The comparison of two spectra.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Comparison {
    /// 1 for equal shape, 0 for no common content: Σ ab / √(Σ a² Σ b²).
    pub similarity: f64,
    /// Total vibration of the second relative to the first: Σ b / Σ a.
    pub level: f64,
    /// The highest peaks of both.
    pub main: Option<Pair>,
    /// Axes of strongest vibration at those peaks, if the spectra sum all axes.
    pub main_axes: Option<(Axis, Axis)>,
    /// Peaks that are in both, by frequency.
    pub pairs: Vec<Pair>,
    /// Peaks of the first alone: Hz and density.
    pub only_first: Vec<(f64, f64)>,
    /// Peaks of the second alone.
    pub only_second: Vec<(f64, f64)>,
    /// Frequency resolution, Hz: the coarser step of both.
    pub resolution: f64,
}

/// Compares two spectra, from 5 Hz to the end of the shorter one.
pub fn compare(first: &Spectrum, second: &Spectrum) -> Comparison {
    let end = |spectrum: &Spectrum| spectrum.frequency.last().copied().unwrap_or_default();
    let resolution = step(first).max(step(second));
    let count = ((end(first).min(end(second)) - LOWEST) / resolution).max(0.0) as usize;
    let grid = (0..=count).map(|k| LOWEST + k as f64 * resolution);
    let (mut aa, mut bb, mut ab, mut a_all, mut b_all) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for f in grid {
        let (a, b) = (first.at(f), second.at(f));
        (aa, bb, ab) = (aa + a * a, bb + b * b, ab + a * b);
        (a_all, b_all) = (a_all + a, b_all + b);
    }
    let (mine, theirs) = (first.peaks(), second.peaks());
    let highest = |peaks: &[(f64, f64)]| peaks.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
    let main = highest(&mine).zip(highest(&theirs)).map(|(first, second)| Pair { first, second });
    let along = |spectrum: &Spectrum, f: f64| match spectrum.axis {
        Axis::All => spectrum.main_axis(f).map(|(axis, _)| axis),
        _ => None,
    };
    let main_axes = main.and_then(|main| along(first, main.first.0).zip(along(second, main.second.0)));
    let nearest = |f: f64, peaks: &[(f64, f64)]| {
        let far = |peak: &(f64, f64)| (peak.0 / f).ln().abs();
        let near = peaks.iter().copied().min_by(|a, b| far(a).total_cmp(&far(b)))?;
        (far(&near) < NEAR).then_some(near)
    };
    // Each is the nearest of the other.
    let pair = |peak: &(f64, f64)| {
        let second = nearest(peak.0, &theirs)?;
        (nearest(second.0, &mine)? == *peak).then_some(Pair { first: *peak, second })
    };
    let pairs: Vec<Pair> = mine.iter().filter_map(pair).collect();
    let alone = |peaks: &[(f64, f64)], of: fn(&Pair) -> (f64, f64)| -> Vec<(f64, f64)> {
        peaks.iter().copied().filter(|peak| pairs.iter().all(|pair| of(pair) != *peak)).collect()
    };
    let (only_first, only_second) = (alone(&mine, |pair| pair.first), alone(&theirs, |pair| pair.second));
    let similarity = if aa > 0.0 && bb > 0.0 { ab / (aa * bb).sqrt() } else { 0.0 };
    Comparison { similarity, level: b_all / a_all, main, main_axes, pairs, only_first, only_second, resolution }
}

fn step(spectrum: &Spectrum) -> f64 {
    let f = &spectrum.frequency;
    if f.len() < 2 { 1.0 } else { (f[f.len() - 1] - f[0]) / (f.len() - 1) as f64 }
}

impl Comparison {
    /// Suggestions of the two in sentences, and their limits.
    pub fn suggestions(&self) -> Vec<String> {
        let mut told = Vec::new();
        let alike = match self.similarity {
            s if s >= 0.9 => "nearly the same form",
            s if s >= 0.7 => "much in common",
            s if s >= 0.4 => "something in common",
            _ => "little in common",
        };
        told.push(format!("The spectra have {alike}: similarity {:.2} of 1.", self.similarity));
        if let Some(main) = &self.main {
            let (f, g) = (main.first.0, main.second.0);
            let same = self.pairs.iter().any(|pair| pair == main);
            let change = 100.0 * (main.stiffness_per_mass() - 1.0);
            told.push(if (g - f).abs() <= self.resolution + ROUNDING {
                format!(
                    "The highest peaks, {f:.1} and {g:.1} Hz, are not separate at steps of {:.1} Hz.",
                    self.resolution
                )
            } else if same {
                let word = if g > f { "stiffer, or moves less mass" } else { "softer, or moves more mass" };
                let belt = if g > f { "a tighter or shorter belt" } else { "a looser or longer belt" };
                format!(
                    "The highest peak goes from {f:.1} to {g:.1} Hz. If it is one mode, stiffness over mass differs by \
                     {change:+.0} %: the second is {word}. With the same mass that suggests {belt}; a frame or a \
                     fastening would show the same."
                )
            } else {
                format!(
                    "The highest peaks, {f:.1} and {g:.1} Hz, are too far apart to be taken for one mode: another mode \
                     is excited most, which says nothing about the tension."
                )
            });
        }
        if let Some((one, other)) = self.main_axes {
            let along = match one == other {
                true => format!("Both are mostly along {}", one.word()),
                false => format!("The first is mostly along {}, the second along {}", one.word(), other.word()),
            };
            told.push(format!("{along}; a belt acts along its own axis, which --axis selects."));
        }
        let vibration = 100.0 * (self.level - 1.0);
        if vibration.abs() >= 10.0 {
            told.push(format!(
                "The second has {vibration:+.0} % of vibration power, if both tests shook equally hard."
            ));
        }
        let list =
            |peaks: &[(f64, f64)]| peaks.iter().map(|peak| format!("{:.1}", peak.0)).collect::<Vec<_>>().join(", ");
        for (peaks, word) in [(&self.only_first, "first"), (&self.only_second, "second")] {
            if !peaks.is_empty() {
                told.push(format!("Only the {word} has a peak at {} Hz.", list(peaks)));
            }
        }
        told
    }
}
