//! A controller as data: its timing, its structure with its gains, and the parts around it.
//!
//! A command is in units of the amplifier's input (V in voltage mode, A in current mode; of a stepper, m that are added
//! to its reference), a position in m along the belt: r φ from an encoder at motor or pulley, x from one at the cart.
//! The crate `taut-control` steps it in time.

pub mod placement;
mod tunable;

pub use tunable::{InDrives, Tunable, TunedBy};

use crate::signal::profile::Profile;

/// A sampled controller.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// Sample time T, s.
    pub every: f64,
    /// Time from a sample to the command that follows from it, s; it may be longer than T.
    pub delay: f64,
    /// Largest magnitude of the command, V or A; none without a limit of its own.
    pub limit: Option<f64>,
    /// The structure of the feedback.
    pub structure: Structure,
    /// The feed-forward.
    pub feed_forward: FeedForward,
    /// The disturbance observer.
    pub disturbance_observer: Option<DisturbanceObserver>,
    /// Filters on the command of the structure, in this order.
    pub filters: Vec<Filter>,
    /// Impulses (time, s; amplitude) that the reference is convolved with; amplitudes add up to 1. Empty for none.
    pub shaper: Vec<[f64; 2]>,
}

/// Limits that a controller sets itself: of its command, V or A, and of the reference of its current loop, A.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bounds {
    /// Largest magnitude of the command, V or A.
    pub command: Option<f64>,
    /// Largest magnitude of the reference current, A.
    pub current: Option<f64>,
}

impl Design {
    /// This structure at a sample time in s, without delay, limit, feed-forward, observer, filters and shaper.
    pub fn new(every: f64, structure: Structure) -> Self {
        Self {
            every,
            delay: 0.0,
            limit: None,
            structure,
            feed_forward: FeedForward::NONE,
            disturbance_observer: None,
            filters: Vec::new(),
            shaper: Vec::new(),
        }
    }

    /// The design of steppers, which follow their references without feedback, through this shaper; `every` is the
    /// interval between rows, s.
    pub fn open_loop(every: f64, shaper: Vec<[f64; 2]>) -> Self {
        Self { shaper, ..Self::new(every, Structure::OpenLoop(OpenLoop)) }
    }

    /// True for steppers without feedback.
    pub fn is_open_loop(&self) -> bool {
        matches!(self.structure, Structure::OpenLoop(_))
    }

    /// The limits that it sets itself.
    pub fn bounds(&self) -> Bounds {
        let current = match &self.structure {
            Structure::Cascade(gains) => gains.current.and_then(|current| current.limit),
            _ => None,
        };
        Bounds { command: self.limit, current }
    }

    /// References after its shaper.
    pub fn shaped(&self, profiles: &[Profile]) -> Vec<Profile> {
        profiles.iter().map(|profile| profile.clone().shaped(&self.shaper)).collect()
    }

    /// Key of the first part that needs the model of a single axis, which a machine with several drives does not have;
    /// none without such a part.
    pub fn needs_axis(&self) -> Option<&'static str> {
        match self.structure {
            Structure::StateFeedback(_) | Structure::SlidingMode(_) => Some(self.structure.tunable().word()),
            _ => self.disturbance_observer.map(|_| "disturbance_observer"),
        }
    }
}

/// Defines the structures by one list for everything that iterates over them.
macro_rules! structures {
    ($($(#[$about:meta])* $name:ident),* $(,)?) => {
        /// The structure and its gains.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Structure {
            $($(#[$about])* $name($name)),*
        }

        impl Structure {
            /// One of each structure, without gains.
            pub fn each() -> Vec<Self> {
                vec![$(Self::$name($name::default())),*]
            }

            /// Its properties for tuning, limit cycles, the reader and reports.
            pub fn tunable(&self) -> &dyn Tunable {
                match self {
                    $(Self::$name(structure) => structure),*
                }
            }
        }
    };
}

structures! {
    /// u = K_p e + K_i ∫e dt + K_d ė, the derivative filtered.
    Pid,
    /// Position loop around speed loop, around a current loop if there is one.
    Cascade,
    /// Feedback of the states that a Kalman filter estimates.
    StateFeedback,
    /// Sliding mode with a boundary layer.
    SlidingMode,
    /// A table of rules.
    Fuzzy,
    /// None: a stepper follows its reference.
    OpenLoop,
}

impl Structure {
    /// Its name for people.
    pub fn name(&self) -> &'static str {
        self.tunable().name()
    }
}

/// Gains of a PID controller.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pid {
    /// K_p, V/m or A/m.
    pub proportional: f64,
    /// K_i, V/(m s) or A/(m s).
    pub integral: f64,
    /// K_d, V s/m or A s/m.
    pub derivative: f64,
    /// Corner of the derivative's filter, Hz.
    pub filter: f64,
    /// Weight of the reference in the derivative; 0 if it acts on the measurement alone.
    pub reference_speed: f64,
    /// Tracking time of the anti-windup, s.
    pub tracking: f64,
}

impl Pid {
    /// A proportional controller, V/m or A/m, with the defaults of a case file for the rest.
    pub fn new(proportional: f64) -> Self {
        Self { proportional, integral: 0.0, derivative: 0.0, filter: 200.0, reference_speed: 1.0, tracking: 0.05 }
    }
}

/// Gains of a cascade.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cascade {
    /// K_v, 1/s: reference speed per position error.
    pub position: f64,
    /// V s/m or A s/m; with a current loop A s/m.
    pub speed: f64,
    /// V/m or A/m; with a current loop A/m.
    pub speed_integral: f64,
    /// Corner of the filter of the measured speed, Hz.
    pub filter: f64,
    /// Weight of the reference speed in the speed loop's reference.
    pub reference_speed: f64,
    /// Tracking time of the anti-windup of both integrals, s.
    pub tracking: f64,
    /// The current loop; needs an amplifier in voltage mode.
    pub current: Option<CurrentLoop>,
}

impl Cascade {
    /// Gains of the position loop, 1/s, and of the speed loop, V s/m or A s/m, with the defaults of a case file for the
    /// rest.
    pub fn new(position: f64, speed: f64) -> Self {
        let (filter, reference_speed, tracking) = (200.0, 1.0, 0.02);
        Self { position, speed, speed_integral: 0.0, filter, reference_speed, tracking, current: None }
    }
}

/// A sampled current loop inside a cascade.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CurrentLoop {
    /// V/A.
    pub proportional: f64,
    /// V/(A s).
    pub integral: f64,
    /// Limit of the reference current, A.
    pub limit: Option<f64>,
}

/// Weights of a linear-quadratic regulator and noise of its Kalman filter; each weight is a deviation of equal cost.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StateFeedback {
    /// Error of the cart's position, m.
    pub position: f64,
    /// Error of its speed, m/s, if that counts.
    pub speed: Option<f64>,
    /// Integral of the measured error, m s, if there is one.
    pub integral: Option<f64>,
    /// Command, V or A.
    pub command: f64,
    /// Standard deviation of the process noise at the command, V or A, drawn anew at each sample.
    pub disturbance: f64,
    /// Standard deviation of a measured position, m.
    pub noise: f64,
}

/// Parameters of a sliding-mode controller, σ = ė + λ e.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SlidingMode {
    /// λ, 1/s: decay rate of the error on the sliding surface.
    pub bandwidth: f64,
    /// K, m/s²: reaching acceleration.
    pub reaching: f64,
    /// Φ, m/s: boundary layer, |σ| below which the reaching acceleration is proportional to σ.
    pub boundary: f64,
    /// 1/s²: gain of an integral of the error in σ; 0 for none.
    pub integral: f64,
    /// Corner of the filter of the measured speed, Hz.
    pub filter: f64,
}

/// Fuzzy controller: triangular sets, the same for error and rate, and a singleton for each pair.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fuzzy {
    /// Error at the outermost sets, m.
    pub error: f64,
    /// Its rate at the outermost sets, m/s.
    pub rate: f64,
    /// Command of a rule of 1, V or A; of an incremental one, V/s or A/s.
    pub command: f64,
    /// True if rules change the command (PI) instead of giving it (PD).
    pub incremental: bool,
    /// `rules[i][j]` from −1 to 1 for set i of the error and set j of its rate, both from negative to positive; a
    /// square of odd size.
    pub rules: Vec<Vec<f64>>,
    /// Corner of the filter of the rate, Hz.
    pub filter: f64,
}

/// No feedback: a stepper's command is its reference.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OpenLoop;

/// Feed-forward from the reference alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedForward {
    /// Model of the feed-forward.
    pub model: FeedForwardModel,
    /// Factor on the inertia force.
    pub inertia: f64,
    /// Factor on the friction force.
    pub friction: f64,
    /// True if an encoder at the motor is given the cart's reference with the belt's stretch added.
    pub compensate_stretch: bool,
    /// Lead of the reference over the sample, s; delay + T/2 by default.
    pub lead: Option<f64>,
}

impl FeedForward {
    /// No feed-forward.
    pub const NONE: Self =
        Self { model: FeedForwardModel::None, inertia: 1.0, friction: 1.0, compensate_stretch: false, lead: None };
}

/// Model of the axis in the feed-forward.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FeedForwardModel {
    /// Nothing.
    None,
    /// One mass with its friction (Li & Rehani 1996).
    Rigid,
    /// Rigid model plus the belt's elongation; complete only with a fourth-order reference.
    Elastic,
}

impl FeedForwardModel {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::None, Self::Rigid, Self::Elastic];

    /// Its name in the case file.
    pub fn word(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Rigid => "rigid",
            Self::Elastic => "elastic",
        }
    }
}

/// Disturbance observer for a disturbance at the command: one mass, its friction, and a third pole for the disturbance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DisturbanceObserver {
    /// Frequency of all three poles, Hz.
    pub bandwidth: f64,
}

/// Second-order filter, discretised by Tustin's rule with frequency prewarping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filter {
    /// (s² + 2 ζ_z ω s + ω²)/(s² + 2 ζ_p ω s + ω²)
    Notch {
        /// Hz.
        frequency: f64,
        /// ζ_z: numerator damping; the gain at the frequency is ζ_z/ζ_p.
        depth: f64,
        /// ζ_p: denominator damping, which sets the width.
        damping: f64,
    },
    /// ω²/(s² + 2 ζ ω s + ω²)
    LowPass {
        /// Hz.
        frequency: f64,
        /// ζ.
        damping: f64,
    },
}
