//! The key figures of a move.

use crate::metrics::Peak;
use crate::signal::profile::Profile;

/// Share of the way out that a load has to go at least, or it has not made a move that returns.
const MADE: f64 = 0.5;

/// True if a load that goes as far as `reached` from its start, m, makes the move of its reference. A move that returns
/// to its start ends at its target without any motion, too: it is made by going half of the way out at least.
pub(super) fn is_made(profile: &Profile, window: f64, reached: f64) -> bool {
    let out = profile.excursion();
    let returns = (profile.target() - profile.start()).abs() <= window;
    !(returns && out > window && reached < MADE * out)
}

/// A difference over time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deviation {
    /// Its largest magnitude, with its sign, m.
    pub peak: Peak,
    /// Its root mean square over the time of the run, m.
    pub rms: f64,
    /// At the end, m.
    pub last: f64,
}

/// The key figures of a move, by the role of the parts: peaks over all instants and not only over rows, integrals over
/// time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figures {
    /// Of what slides: the cart of an axis, bridge and cart of a gantry.
    pub loads: Vec<LoadFigures>,
    /// Of the drives.
    pub drives: Vec<DriveFigures>,
    /// Distance from the path, to its left above zero, of a machine with two coordinates. Exact where the nearest leg
    /// is the same for a while; about corners its peak is sought between nine places of each piece of the motion.
    pub contour: Option<Deviation>,
    /// From the end of the profile, a shaper apart, until all that slides stays within the window around its target, s;
    /// none if it does not, or if the move returns to its start and it does not go half of the way out.
    pub settling: Option<f64>,
}

impl Figures {
    /// The figures of the cart.
    pub fn cart(&self) -> LoadFigures {
        self.loads.last().copied().unwrap_or_default()
    }

    /// Figures of the sliding part with the largest error.
    pub fn worst_load(&self) -> LoadFigures {
        let size = |load: &LoadFigures| load.error.peak.value.abs();
        let larger = |a: LoadFigures, b: LoadFigures| if size(&b) > size(&a) { b } else { a };
        self.loads.iter().copied().reduce(larger).unwrap_or_default()
    }

    /// The largest root mean square of all motors' currents, A.
    pub fn worst_current(&self) -> f64 {
        self.drives.iter().map(|drive| drive.current.1).fold(0.0, f64::max)
    }

    /// The figures of the first drive.
    pub fn drive(&self) -> DriveFigures {
        self.drives.first().copied().unwrap_or_default()
    }
}

/// Key figures of what slides.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LoadFigures {
    /// x − y: its difference from its reference.
    pub error: Deviation,
    /// By how much it passes its target after the beginning of the last stroke, m.
    pub overshoot: f64,
}

/// Key figures of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DriveFigures {
    /// r φ − y: its pulley from the reference of its part of the belt. A controller that compensates for the belt's
    /// elongation causes part of it on purpose.
    pub following: Deviation,
    /// Motor current: largest and root mean square, A.
    pub current: (Peak, f64),
    /// Motor voltage: largest and root mean square, V.
    pub voltage: (Peak, f64),
    /// Time during which the controller's own limit held its command back, s.
    pub limited: f64,
    /// Time during which the amplifier stood at its limit of voltage or current, s.
    pub amplifier_limited: f64,
    /// Electrical energy taken in and given back, J.
    pub energy: (f64, f64),
    /// Changes of direction of the command per second: what hunting sounds like.
    pub restlessness: f64,
}
