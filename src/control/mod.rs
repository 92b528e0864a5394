//! Control of an axis: input shapers, the spectra that they are chosen from, and how one is chosen.

pub mod compare;
pub mod resonance;
pub mod shaper;
pub mod shaping;
pub mod spectrum;
mod welch;

pub use welch::power_spectral_density;
