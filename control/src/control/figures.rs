//! Key figures of a move.

use crate::metrics::Peak;
use crate::signal::profile::Profile;

/// Least fraction of the outward stroke that a load has to reach in a move that returns to its start.
const MADE: f64 = 0.5;

/// True if a load that moves at most `reached` from its start, m, makes the move of its reference. A load that does not
/// move also ends at the target of a move that returns to its start, so at least half of the outward stroke is
/// required.
pub(super) fn is_made(profile: &Profile, window: f64, reached: f64) -> bool {
    let out = profile.excursion();
    let returns = (profile.target() - profile.start()).abs() <= window;
    !(returns && out > window && reached < MADE * out)
}

/// A difference over time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Deviation {
    /// Its largest magnitude, with its sign, m.
    pub peak: Peak,
    /// Its root mean square over the time of the run, m.
    pub rms: f64,
    /// Final value, m.
    pub last: f64,
}

/// Key figures of a move, by the role of the parts: peaks over all instants, not only rows, and integrals over time.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Figures {
    /// Figures of the slides: the cart of an axis, bridge and cart of a gantry.
    pub loads: Vec<LoadFigures>,
    /// Figures of the drives.
    pub drives: Vec<DriveFigures>,
    /// Least and greatest force in each span relative to the pretension, N; none for a rigid belt.
    pub spans: Vec<[Peak; 2]>,
    /// Contour error of a machine with two coordinates, positive to the left of the path. Exact while the nearest leg
    /// does not change; near corners its peak is searched among nine points of each piece of the motion.
    pub contour: Option<Deviation>,
    /// Settling time from the end of the profile, without shaper, until all slides stay within the window around their
    /// targets, s; none if one does not settle, or does not reach half of the outward stroke of a move that returns to
    /// its start.
    pub settling: Option<f64>,
}

impl Figures {
    /// The figures of the cart.
    pub fn cart(&self) -> LoadFigures {
        self.loads.last().copied().unwrap_or_default()
    }

    /// Figures of the sliding part with the largest error.
    pub(crate) fn worst_load(&self) -> LoadFigures {
        let size = |load: &LoadFigures| load.error.peak.value.abs();
        let larger = |a: LoadFigures, b: LoadFigures| if size(&b) > size(&a) { b } else { a };
        self.loads.iter().copied().reduce(larger).unwrap_or_default()
    }

    /// Largest RMS current of all motors, A.
    pub(crate) fn worst_current(&self) -> f64 {
        self.drives.iter().map(|drive| drive.current.1).fold(0.0, f64::max)
    }

    /// Longest time for which the amplifier of a drive was at its limit, s.
    pub fn amplifier_limited(&self) -> f64 {
        self.drives.iter().map(|drive| drive.amplifier_limited).fold(0.0, f64::max)
    }

    /// Longest time for which the command or the amplifier of a drive was at its limit, s.
    pub fn saturated(&self) -> f64 {
        self.drives.iter().map(|drive| drive.limited).fold(self.amplifier_limited(), f64::max)
    }

    /// The figures of the first drive.
    pub fn drive(&self) -> DriveFigures {
        self.drives.first().copied().unwrap_or_default()
    }
}

/// Key figures of a slide.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct LoadFigures {
    /// Its error y − x: reference minus position.
    pub error: Deviation,
    /// Overshoot beyond its target after the start of the last stroke, m.
    pub overshoot: f64,
}

/// Key figures of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct DriveFigures {
    /// y − r φ: reference of its part of the belt minus the travel of its pulley. A controller that compensates for the
    /// belt's elongation causes part of it on purpose.
    pub following: Deviation,
    /// Motor current: peak and RMS, A.
    pub current: (Peak, f64),
    /// Motor voltage: peak and RMS, V.
    pub voltage: (Peak, f64),
    /// Time during which the controller's own limit was active, s.
    pub limited: f64,
    /// Time during which the amplifier's voltage or current limit was active, s.
    pub amplifier_limited: f64,
    /// Electrical energy taken in and given back, J.
    pub energy: (f64, f64),
    /// Sign changes of the command's increments per second, a measure of audible hunting.
    pub restlessness: f64,
}
