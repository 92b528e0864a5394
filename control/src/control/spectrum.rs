//! Spectra of an axis' vibration: from a file, or from samples.

use super::shaper::Firmware;
use super::welch::power_spectral_density;
use crate::log::Accelerometer;

/// Frequencies below this are omitted, Hz: they belong to the motion of the test.
pub const LOWEST: f64 = 5.0;
/// Frequencies above this are omitted, Hz.
pub const HIGHEST: f64 = 200.0;
/// Minimum length of a segment of samples, s: frequencies are at most 2 Hz apart.
const SEGMENT: f64 = 0.5;
/// Least prominence of a peak, relative to the highest peak.
const PROMINENCE: f64 = 0.1;

/// An axis of the accelerometer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Axis {
    /// x.
    X,
    /// y.
    Y,
    /// z.
    Z,
    /// The sum of the three.
    #[default]
    All,
}

impl Axis {
    /// Its word.
    pub fn word(self) -> &'static str {
        ["x", "y", "z", "x + y + z"][self as usize]
    }
}

/// Power spectral density over frequency, divided by frequency.
///
/// A resonance test shakes more strongly at higher frequencies; divided by the frequency, the density represents better
/// what a move excites. Klipper chooses shapers on this scale.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Spectrum {
    /// Hz, ascending, at most [`HIGHEST`].
    pub frequency: Vec<f64>,
    /// Density of the selected axis; small or 0 below [`LOWEST`].
    pub density: Vec<f64>,
    /// Densities of x, y and z, for plots.
    pub axes: [Vec<f64>; 3],
    /// The axis of `density`.
    pub axis: Axis,
    /// Its origin, in a few words.
    pub origin: String,
}

impl Spectrum {
    /// Spectrum of the data, divided by frequency as in Klipper until 2025-08.
    pub fn new(data: &Accelerometer, axis: Axis) -> Self {
        Self::by(data, axis, Firmware::Klipper202508)
    }

    /// Spectrum divided by frequency as in a firmware.
    pub fn by(data: &Accelerometer, axis: Axis, firmware: Firmware) -> Self {
        match data {
            Accelerometer::Spectrum { frequency, density: [x, y, z, all], per_frequency } => {
                let origin = match per_frequency {
                    true => "a spectrum with shapers, already divided by frequency",
                    false => "a spectrum",
                };
                let parts = [x, y, z, all].map(|density| scaled(frequency, density, *per_frequency, firmware));
                Self::from_frequency(frequency, parts, axis, origin.to_string())
            }
            Accelerometer::Samples { time, acceleration } => {
                let span = time[time.len() - 1] - time[0];
                // Klipper's rate: samples, not intervals, over the time from first to last. Its segments are as many
                // samples as the least power of two above n = ⌊rate/2 − 1⌋.
                let rate = time.len() as f64 / span;
                let length = ((rate * SEGMENT - 1.0) as usize + 1).next_power_of_two();
                let [x, y, z] = acceleration.each_ref().map(|values| power_spectral_density(values, rate, length));
                let frequency = x.0;
                let all: Vec<f64> = x.1.iter().zip(&y.1).zip(&z.1).map(|((x, y), z)| x + y + z).collect();
                let parts = [x.1, y.1, z.1, all].map(|density| scaled(&frequency, &density, false, firmware));
                let origin = format!("{} samples in {span:.1} s, {rate:.0} a second, segments of {length}", time.len());
                Self::from_frequency(&frequency, parts, axis, origin)
            }
        }
    }

    fn from_frequency(frequency: &[f64], [x, y, z, all]: [Vec<f64>; 4], axis: Axis, origin: String) -> Self {
        let count = frequency.iter().take_while(|f| **f <= HIGHEST).count();
        let cut = |part: &[f64]| part[..count].to_vec();
        let density = match axis {
            Axis::X => cut(&x),
            Axis::Y => cut(&y),
            Axis::Z => cut(&z),
            Axis::All => cut(&all),
        };
        Self { frequency: cut(frequency), density, axes: [cut(&x), cut(&y), cut(&z)], axis, origin }
    }

    /// The greatest density.
    pub fn greatest(&self) -> f64 {
        self.density.iter().copied().fold(0.0, f64::max)
    }

    /// Peaks: frequency (Hz) and density, by frequency, with a prominence of at least a tenth of the highest.
    pub fn peaks(&self) -> Vec<(f64, f64)> {
        let d = &self.density;
        let wanted = PROMINENCE * self.greatest();
        let least = |values: &mut dyn Iterator<Item = &f64>, top: f64| {
            // Lowest value before a higher one, or up to the end.
            let mut low = top;
            for value in values {
                if *value > top {
                    return low;
                }
                low = low.min(*value);
            }
            low
        };
        let is_peak = |&k: &usize| {
            let before = k.checked_sub(1).map_or(0.0, |i| d[i]);
            let behind = d.get(k + 1).copied().unwrap_or(0.0);
            d[k] > before && d[k] >= behind && {
                let left = least(&mut d[..k].iter().rev(), d[k]);
                let right = least(&mut d[k + 1..].iter(), d[k]);
                d[k] - left.max(right) >= wanted
            }
        };
        (0..d.len()).filter(is_peak).map(|k| (self.frequency[k], d[k])).collect()
    }

    /// The axis of the accelerometer that vibrates most at one of the spectrum's frequencies, and its fraction of all
    /// three.
    pub fn main_axis(&self, frequency: f64) -> Option<(Axis, f64)> {
        let k = self.frequency.iter().position(|f| *f == frequency)?;
        let all: f64 = self.axes.iter().map(|axis| axis[k]).sum();
        let named = [Axis::X, Axis::Y, Axis::Z].into_iter().zip(&self.axes);
        let (axis, most) = named.map(|(axis, values)| (axis, values[k])).max_by(|a, b| a.1.total_cmp(&b.1))?;
        (all > 0.0).then_some((axis, most / all))
    }

    /// The density at a frequency, joined linearly; 0 outside.
    pub fn at(&self, f: f64) -> f64 {
        let above = self.frequency.partition_point(|x| *x < f);
        match (above.checked_sub(1), self.frequency.get(above)) {
            (_, None) => 0.0,
            (None, Some(first)) => {
                if *first == f {
                    self.density[0]
                } else {
                    0.0
                }
            }
            (Some(below), Some(high)) => {
                let low = self.frequency[below];
                let part = (f - low) / (high - low);
                self.density[below] * (1.0 - part) + self.density[above] * part
            }
        }
    }
}

/// P(f) / f; a tenth of a hertz keeps it from infinity. Until 2025-08 without the lowest frequencies; today those below
/// twice [`LOWEST`] are attenuated.
fn scaled(frequency: &[f64], density: &[f64], is_already: bool, firmware: Firmware) -> Vec<f64> {
    let one = |(f, p): (&f64, &f64)| match (*f, firmware) {
        (_, Firmware::Klipper) if is_already => *p,
        (f, Firmware::Klipper) if f < 2.0 * LOWEST => p / (f + 0.1) * (1.0 - (2.0 * LOWEST / (f + 0.1)).powi(2)).exp(),
        (f, Firmware::Klipper202508) if f < LOWEST => 0.0,
        (_, Firmware::Klipper202508) if is_already => *p,
        (f, Firmware::Klipper | Firmware::Klipper202508) => p / (f + 0.1),
    };
    frequency.iter().zip(density).map(one).collect()
}
