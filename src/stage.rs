//! What the machine is: motor, amplifier, pulleys, belt, cart, encoder. Everything in SI units.

use crate::friction::{Along, Friction};
use std::f64::consts::PI;

/// A single-axis belt drive (paper, Fig. 1 and 2).
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// The DC motor and its gear.
    pub motor: Motor,
    /// What stands between the input and the motor.
    pub amplifier: Amplifier,
    /// Pitch radius r of both pulleys, m.
    pub pulley_radius: f64,
    /// The pulley at the motor; its angle is φ₁.
    pub drive_pulley: Pulley,
    /// The cart; its position is x (the paper's x₂′).
    pub cart: Cart,
    /// The pulley at the far end; its angle is φ₃.
    pub idler_pulley: Pulley,
    /// The belt's three spans.
    pub belt: Belt,
    /// How far the cart may go, if that is known.
    pub travel: Option<Travel>,
    /// How the motion is measured, if it is.
    pub encoder: Option<Encoder>,
}

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
}

/// What the input commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Amplifier {
    /// Voltage or current.
    pub mode: AmplifierMode,
    /// Output (V or A) per unit of input.
    pub gain: f64,
}

/// Whether the amplifier imposes a voltage or a current.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AmplifierMode {
    /// The output is the motor's terminal voltage.
    Voltage,
    /// The output is the motor's current.
    Current,
}

/// A pulley that turns with friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulley {
    /// Moment of inertia J, kg m².
    pub inertia: f64,
    /// Friction torque, N m over rad/s.
    pub friction: Friction,
}

/// The cart.
#[derive(Debug, Clone, PartialEq)]
pub struct Cart {
    /// Mass M with its load, kg.
    pub mass: f64,
    /// Friction force, N over m/s.
    pub friction: Friction,
    /// How its dry friction changes along the travel, if it does.
    pub along: Option<Along>,
}

/// Three spans: 1 drive pulley to cart, 2 cart to idler pulley, 3 idler pulley back to drive pulley.
#[derive(Debug, Clone, PartialEq)]
pub struct Belt {
    /// Span stiffness k₁, k₂, k₃, N/m.
    pub stiffness: [f64; 3],
    /// Span damping c₁, c₂, c₃, N s/m.
    pub damping: [f64; 3],
    /// What the stiffness was computed from, where it was not given as such.
    pub make: Option<BeltMake>,
    /// Whether spans 1 and 2 get shorter and longer, and so stiffer and softer, as the cart moves; needs `make`.
    pub follows_cart: bool,
}

/// What a belt is made of; gives its stiffness by eq. (11).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeltMake {
    /// Modulus E, Pa.
    pub modulus: f64,
    /// Cross-section A that carries the load, m².
    pub section: f64,
    /// Span lengths l₁, l₂, l₃, m.
    pub spans: [f64; 3],
}

impl BeltMake {
    /// Stiffness of each span.
    pub fn stiffness(&self) -> [f64; 3] {
        let &BeltMake { modulus: e, section: a, spans } = self;
        // k = A E / l                                                              (11)
        spans.map(|l| a * e / l)
    }

    /// Stiffness of spans 1 and 2 with the cart at `x`, m: the drive pulley is at the positive end.
    pub fn stiffness_at(&self, x: f64) -> [f64; 2] {
        let &BeltMake { modulus: e, section: a, spans: [l1, l2, _] } = self;
        // k₁ = A E / (l₁ − x), k₂ = A E / (l₂ + x)                                (11)
        [a * e / (l1 - x), a * e / (l2 + x)]
    }
}

/// How far the cart may go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Travel {
    /// Least position, m.
    pub min: f64,
    /// Greatest position, m.
    pub max: f64,
}

impl Stage {
    /// Whether its equations are linear but for stick, slip and other changes of mode: what the exact solver takes.
    pub fn is_piecewise_linear(&self) -> bool {
        let laws = [self.drive_pulley.friction, self.cart.friction, self.idler_pulley.friction];
        laws.iter().all(Friction::is_piecewise_linear) && self.cart.along.is_none() && !self.belt.follows_cart
    }
}

/// Modulus of a composite whose parts, given as (share of the section, modulus in Pa), act as springs in parallel (2.3.1).
pub fn composite_modulus(parts: &[(f64, f64)]) -> f64 {
    parts.iter().map(|&(share, modulus)| share * modulus).sum()
}

/// The uniform section that is as stiff as a toothed belt: toothed and plain stretches in series.
///
/// `toothed_share` is the part of the length on which the section is `toothed`; sections in m².
pub fn toothed_section(plain: f64, toothed: f64, toothed_share: f64) -> f64 {
    // 1/k_eff = 1/k_t + 1/k_nt, with k = A E / l of each share of the length        (12)
    1.0 / (toothed_share / toothed + (1.0 - toothed_share) / plain)
}

/// Moment of inertia, kg m², of a hollow cylinder about its axis; lengths in m, density in kg/m³.
pub fn cylinder_inertia(outer_diameter: f64, bore_diameter: f64, width: f64, density: f64) -> f64 {
    // J = π ρ w (d_o⁴ − d_i⁴) / 32
    PI * density * width * (outer_diameter.powi(4) - bore_diameter.powi(4)) / 32.0
}

/// Pitch radius, m, of a pulley with so many teeth (grooves) at a pitch in m.
pub fn pitch_radius(teeth: f64, pitch: f64) -> f64 {
    // 2 π r = z p
    teeth * pitch / (2.0 * PI)
}

/// An incremental encoder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encoder {
    /// Where it sits.
    pub at: EncoderPlace,
    /// Lines per turn (per metre at the cart); in quadrature four counts each.
    pub lines: f64,
}

/// The shaft or slide that an encoder watches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EncoderPlace {
    /// The motor's own shaft, before the gear.
    Motor,
    /// The drive pulley, after the gear.
    DrivePulley,
    /// The cart, on a linear scale.
    Cart,
}
