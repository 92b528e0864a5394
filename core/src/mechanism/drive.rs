//! A motor with its gear, and the amplifier that feeds it.

use std::f64::consts::{PI, SQRT_2};

/// A brushed DC motor with a gear, eq. (4) and beyond; or a stepper, with the parameters of one phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motor {
    /// Torque constant K_t, N m/A.
    pub torque_constant: f64,
    /// Back-EMF constant K_e, V s/rad.
    pub back_emf_constant: f64,
    /// Armature resistance R, Ω.
    pub resistance: f64,
    /// Armature inductance L, H.
    pub inductance: f64,
    /// Rotor inertia J_r, kg m², at the motor's own shaft.
    pub rotor_inertia: f64,
    /// Gear ratio n: motor turns per turn of the drive pulley.
    pub gear_ratio: f64,
    /// Gear efficiency η: transmitted fraction of the power in either direction.
    pub gear_efficiency: f64,
    /// A compliant gear, which makes the rotor a body of its own; none for a stiff gear without play.
    pub gear_play: Option<GearPlay>,
    /// True if it represents a drive given by force and drag, so that its own parameters have no meaning.
    pub is_simple: bool,
    /// The two phases of a stepper, whose command is a position; none for a brushed motor.
    pub stepper: Option<Stepper>,
}

impl Motor {
    /// A brushed motor at the drive pulley with a back-EMF constant equal to its torque constant (N m/A = V s/rad), and
    /// without inductance, rotor inertia and gear.
    pub fn brushed(torque_constant: f64, resistance: f64) -> Self {
        Self {
            torque_constant,
            back_emf_constant: torque_constant,
            resistance,
            inductance: 0.0,
            rotor_inertia: 0.0,
            gear_ratio: 1.0,
            gear_efficiency: 1.0,
            gear_play: None,
            is_simple: false,
            stepper: None,
        }
    }

    /// Holding torque of a stepper with both phases at rated current, N m: T_h = √2 K_m I.
    pub fn holding_torque(&self) -> Option<f64> {
        self.stepper.map(|stepper| self.torque_constant * stepper.amplitude())
    }

    /// Sets K_m = T_h/(√2 I), the torque and the back-EMF constant of each phase of a stepper.
    pub fn set_holding_torque(&mut self, torque: f64) {
        if let Some(stepper) = self.stepper {
            self.torque_constant = torque / stepper.amplitude();
            self.back_emf_constant = self.torque_constant;
        }
    }
}

/// The phases of a hybrid stepper with its driver, beyond what [`Motor`] and [`Amplifier`] have.
///
/// Two phases, a quarter of a tooth pitch apart; N = `steps_per_turn`/4 rotor teeth. The angle is zero where both
/// phases carry the rated current, a full step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stepper {
    /// Full steps per turn, 4 N.
    pub steps_per_turn: f64,
    /// Rated current I of each phase, A, with both phases on.
    pub rated_current: f64,
    /// Amplitude T_d of the detent torque, N m: four periods per tooth pitch.
    pub detent_torque: f64,
    /// Microsteps per full step.
    pub microsteps: f64,
    /// True if the driver interpolates between microsteps: its field then follows the command without steps.
    pub interpolate: bool,
}

impl Stepper {
    /// Full steps in a tooth pitch.
    pub const STEPS_PER_TOOTH: i32 = 4;

    /// Bandwidth of the chopper's current regulator, Hz: a third of a usual chopping frequency of 30 kHz.
    pub const CHOPPER_BANDWIDTH: f64 = 1e4;

    /// Number of rotor teeth N.
    pub fn teeth(&self) -> f64 {
        self.steps_per_turn / f64::from(Self::STEPS_PER_TOOTH)
    }

    /// The amplitude of the phase currents, A: √2 I, so that the copper loss is that of both phases at I at any angle.
    pub fn amplitude(&self) -> f64 {
        SQRT_2 * self.rated_current
    }

    /// Angle of a microstep, rad.
    pub fn microstep(&self) -> f64 {
        2.0 * PI / (self.steps_per_turn * self.microsteps)
    }
}

/// A gear with play and stiffness, seen from the drive pulley.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GearPlay {
    /// Backlash 2α, rad: angle by which the drive pulley can turn while the rotor is at rest.
    pub backlash: f64,
    /// Stiffness of a flank in contact k_g, N m/rad.
    pub stiffness: f64,
    /// Damping of a flank in contact c_g, N m s/rad.
    pub damping: f64,
}

/// The quantity that the input commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Amplifier {
    /// Voltage or current.
    pub mode: AmplifierMode,
    /// Output (V or A) per unit of input.
    pub gain: f64,
    /// Largest voltage V_max at the motor's terminals, V, either way.
    pub voltage_limit: Option<f64>,
    /// Largest current I_max, A, either way.
    pub current_limit: Option<f64>,
    /// Bandwidth f_b of the current loop, Hz; none for an ideal loop.
    pub bandwidth: Option<f64>,
}

impl Amplifier {
    /// An amplifier without limits.
    pub fn ideal(mode: AmplifierMode, gain: f64) -> Self {
        Self { mode, gain, voltage_limit: None, current_limit: None, bandwidth: None }
    }
}

/// Quantity that the amplifier commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AmplifierMode {
    /// The output is the motor's terminal voltage.
    Voltage,
    /// The output is the motor's current.
    Current,
    /// A stepper's driver: the input is the commanded position, m at the belt.
    Position,
}

impl AmplifierMode {
    /// The unit of what it commands.
    pub fn unit(self) -> &'static str {
        match self {
            AmplifierMode::Voltage => "V",
            AmplifierMode::Current => "A",
            AmplifierMode::Position => "m",
        }
    }
}
