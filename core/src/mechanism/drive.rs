//! A motor with its gear, and the amplifier that feeds it.

/// A brushed DC motor with a gear, eq. (4) and beyond.
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
    /// Gear efficiency η: the part of the power that passes, whichever side drives.
    pub gear_efficiency: f64,
    /// A compliant gear, so that the rotor is an inertia of its own; none for one that is stiff and without play.
    pub gear_play: Option<GearPlay>,
    /// True if it only stands for a drive that is given by force and drag, so that its own numbers mean nothing.
    pub is_simple: bool,
}

/// A gear with play and stiffness, seen from the drive pulley.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GearPlay {
    /// Backlash 2α, rad: by how much the drive pulley can turn while the rotor stands.
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
    /// Bandwidth f_b of the current loop, Hz; none for one that is faster than anything else.
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
}

impl AmplifierMode {
    /// The unit of what it commands.
    pub fn unit(self) -> &'static str {
        match self {
            AmplifierMode::Voltage => "V",
            AmplifierMode::Current => "A",
        }
    }
}
