//! The gains of a design as numbers with names, for a search and for the case file.

use crate::design::placement::commanded_unit;
use crate::design::{Design, Filter};
use crate::machine::Machine;
use crate::parameter::{self, Parameter, Tuned, find, unit_for};

/// Digits of a gain after the first one.
const DIGITS: usize = 3;

/// Highest frequency of a filter in a search, relative to the sampling rate.
const HIGHEST: f64 = 0.45;

/// Range of the damping of a notch in a search, if its depth allows.
const NARROWEST: f64 = 0.05;
const WIDEST: f64 = 2.0;

/// A gain.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Gain {
    /// Its key in the case file.
    pub key: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
    /// True if a search changes it.
    pub searched: bool,
}

/// Locations of the gains in structures, in the order of the case file.
fn places() -> impl Iterator<Item = (&'static str, parameter::InStructure)> {
    let place = |row: &'static Parameter| row.gain.map(|gain| (row.key, gain));
    parameter::all().filter_map(place).filter(|(_, gain)| gain.tuned != Tuned::No)
}

/// True if a search changes a gain of this design: not if it, or the gain whose corner it is, is zero.
fn is_searched(design: &Design, gain: &parameter::InStructure) -> bool {
    let is_there = |gain: &parameter::InStructure| (gain.get)(&design.structure).is_some_and(|value| value != 0.0);
    is_there(gain)
        && match gain.tuned {
            Tuned::No => false,
            Tuned::Gain => true,
            Tuned::Corner(of) => find(of).and_then(|row| row.gain).is_some_and(|gain| is_there(&gain)),
        }
}

/// The gains of a design that are not zero, in the order of the case file.
pub fn gains(design: &Design, machine: &Machine) -> Vec<Gain> {
    let input = commanded_unit(design, machine);
    let gain = |(key, gain): (&'static str, parameter::InStructure)| {
        let value = (gain.get)(&design.structure).filter(|value| *value != 0.0)?;
        let unit = find(key).map_or("", |row| unit_for(row.unit, input));
        Some(Gain { key, unit, value, searched: is_searched(design, &gain) })
    };
    places().filter_map(gain).collect()
}

/// The design with its searched gains multiplied, in the order of [`gains`], by e to these powers. Changed corners are
/// limited below half the sampling rate.
pub fn scaled(design: &Design, powers: &[f64]) -> Design {
    let mut other = design.clone();
    let highest = HIGHEST / design.every;
    let searched = places().filter(|(_, gain)| is_searched(design, gain));
    for ((_, gain), power) in searched.zip(powers) {
        let most = if matches!(gain.tuned, Tuned::Corner(_)) && *power != 0.0 { highest } else { f64::INFINITY };
        if let Some(value) = (gain.get)(&design.structure) {
            (gain.set)(&mut other.structure, (value * power.exp()).min(most));
        }
    }
    other
}

/// The design with its searched gains, and frequencies and widths of its filters from number `own` on, multiplied by e
/// to these powers.
pub fn shaped(design: &Design, own: usize, powers: &[f64]) -> Design {
    let count = searched(design, own) - filter_knobs(design, own);
    let (gains, filters) = powers.split_at(count.min(powers.len()));
    let mut other = scaled(design, gains);
    let most = HIGHEST / design.every;
    let mut powers = filters.iter();
    for filter in other.filters.iter_mut().skip(own) {
        let mut times = |value: &mut f64, low: f64, high: f64| {
            *value = (*value * powers.next().copied().unwrap_or_default().exp()).clamp(low, high);
        };
        match filter {
            Filter::Notch { frequency, depth, damping } => {
                times(frequency, f64::MIN_POSITIVE, most);
                // Its gain at the notch is depth/damping; above 1 it would amplify.
                times(damping, NARROWEST.max(*depth), WIDEST.max(*depth));
            }
            Filter::LowPass { frequency, .. } => times(frequency, f64::MIN_POSITIVE, most),
        }
    }
    other
}

/// Number of powers for [`shaped`].
pub fn searched(design: &Design, own: usize) -> usize {
    places().filter(|(_, gain)| is_searched(design, gain)).count() + filter_knobs(design, own)
}

fn filter_knobs(design: &Design, own: usize) -> usize {
    let knobs = |filter: &Filter| match filter {
        Filter::Notch { .. } => 2,
        Filter::LowPass { .. } => 1,
    };
    design.filters.iter().skip(own).map(knobs).sum()
}

/// The design with gains and filters rounded to four digits, as written.
pub fn rounded(design: &Design) -> Design {
    let mut other = design.clone();
    for (_, gain) in places() {
        if let Some(value) = (gain.get)(&design.structure) {
            (gain.set)(&mut other.structure, four(value));
        }
    }
    for filter in &mut other.filters {
        match filter {
            Filter::Notch { frequency, depth, damping } => {
                (*frequency, *depth, *damping) = (four(*frequency), four(*depth), four(*damping));
            }
            Filter::LowPass { frequency, damping } => (*frequency, *damping) = (four(*frequency), four(*damping)),
        }
    }
    other
}

/// Rounds to four digits; through text, so that it is the number that will be read.
fn four(value: f64) -> f64 {
    if value.is_finite() { format!("{value:.DIGITS$e}").parse().unwrap_or(value) } else { value }
}

/// The filters in the notation of the case file.
pub(crate) fn filters_text(filters: &[Filter]) -> String {
    let one = |filter: &Filter| match filter {
        Filter::Notch { frequency, depth, damping } => {
            format!("{{ notch = \"{frequency} Hz\", depth = {depth}, damping = {damping} }}")
        }
        Filter::LowPass { frequency, damping } => format!("{{ low_pass = \"{frequency} Hz\", damping = {damping} }}"),
    };
    format!("[{}]", filters.iter().map(one).collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use crate::design::Structure;
    use std::path::Path;

    /// A search ended with a notch of damping 0.05 and depth 0.1, which amplifies by 6 dB, and with a corner of 15 kHz
    /// at 4 kHz.
    #[test]
    fn a_searched_filter_neither_amplifies_nor_passes_half_the_sampling_rate() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../stages/sollmann-jouaneh/controllers");
        let mut design = Case::read(folder.join("pid.toml")).unwrap().controller.unwrap();
        design.filters = vec![
            Filter::Notch { frequency: 100.0, depth: 0.1, damping: 0.7 },
            Filter::LowPass { frequency: 100.0, damping: 0.7 },
        ];
        let half = 0.5 / design.every;
        for power in [-9.0, -3.0, -0.1, 0.1, 3.0, 9.0] {
            let other = rounded(&shaped(&design, 0, &[power; 7]));
            let Structure::Pid(pid) = &other.structure else { panic!("not a PID") };
            assert!(pid.filter < half, "{pid:?}");
            for filter in &other.filters {
                match *filter {
                    Filter::Notch { frequency, depth, damping } => {
                        assert!(depth <= damping && frequency < half, "{filter:?}");
                    }
                    Filter::LowPass { frequency, .. } => assert!(frequency < half, "{filter:?}"),
                }
            }
        }
    }
}
