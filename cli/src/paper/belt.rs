//! Section 2.3: stiffness from section, modulus and length; what the printed inertia and the belt's mass amount to.

use super::model::Sets;
use std::f64::consts::PI;
use taut::machine::{BeltMake, composite_modulus, cylinder_inertia, pitch_radius, toothed_section};

/// Cross-section A, m² (Tables 1 and 2).
pub const SECTION: f64 = 5.5626e-6;
/// Modulus E of Table 1, Pa.
pub const MODULUS_1: f64 = 16.67e9;
/// Modulus E of Table 2, Pa.
pub const MODULUS_2: f64 = 8.335e9;
/// Modulus of neoprene and of fibreglass, Pa (2.3.1).
pub const PARTS: [(f64, f64); 2] = [(2.0 / 3.0, 6e6), (1.0 / 3.0, 50e9)];
/// l₁ = l₂ and l₃ as printed, m (2.3.1).
pub const PRINTED: (f64, f64) = (0.349, 0.787);
/// The span lengths as 13.75 in and 31 in, m.
pub const INCHES: (f64, f64) = (0.34925, 0.7874);
/// Belt width, m (2.2).
pub const WIDTH: f64 = 9.53e-3;
/// Overall length of the stage, m (2.2).
pub const RAIL: f64 = 0.863;
/// Densities, kg/m³, that the paper does not give: aluminium, neoprene, glass.
pub const DENSITY: [f64; 3] = [2700.0, 1230.0, 2540.0];

/// One printed stiffness beside the computed ones, N/m.
pub struct Stiffness {
    /// `Table 1`.
    pub table: &'static str,
    /// `k₁, k₂`.
    pub symbol: &'static str,
    /// As printed.
    pub printed: f64,
    /// Half a unit of the last printed digit.
    pub half_digit: f64,
    /// From the printed E and the printed length.
    pub lengths: f64,
    /// From the printed E and the length in inches.
    pub inches: f64,
    /// From the composite modulus before rounding and the length in inches.
    pub unrounded: f64,
    /// Share by which half a unit in the last digit of the printed length changes the stiffness.
    pub length_rounding: f64,
}

/// Everything about the belt and the pulleys' make.
pub struct Belt {
    /// 2/3 neoprene and 1/3 fibreglass in parallel, Pa.
    pub composite: f64,
    /// k₁ and k₃ of Tables 1 and 2.
    pub stiffness: Vec<Stiffness>,
    /// Pitch radius of 60 grooves at 2.03 mm, m.
    pub radius: f64,
    /// Thickness that the printed section has at the printed width, m.
    pub thickness: f64,
    /// Length of a solid aluminium cylinder with the pulley's pitch diameter and the inertia of Table 1, m.
    pub cylinder_length: f64,
    /// Inertia of such a cylinder as wide as the belt, kg m².
    pub belt_wide_inertia: f64,
    /// Mass of the belt, kg, and its share of all that moves.
    pub mass: f64,
    /// The belt's share of the moving mass.
    pub mass_share: f64,
    /// Share that teeth of neoprene add to the stiffness of a span that is half toothed.
    pub neoprene_teeth: f64,
}

impl Belt {
    /// Computes it.
    pub fn new(sets: &Sets) -> Self {
        let composite = composite_modulus(&PARTS);
        let row = |table, symbol, printed: f64, half_digit, modulus: f64, share: f64, third: bool| {
            let of = |modulus: f64, (l1, l3): (f64, f64)| {
                let k = BeltMake { modulus, section: SECTION, spans: [l1, l1, l3].into() }.stiffness().three();
                if third { k[2] } else { k[0] }
            };
            let length = if third { PRINTED.1 } else { PRINTED.0 };
            Stiffness {
                table,
                symbol,
                printed,
                half_digit,
                lengths: of(modulus, PRINTED),
                inches: of(modulus, INCHES),
                unrounded: of(composite * share, INCHES),
                length_rounding: 0.5e-3 / length,
            }
        };
        let [k1, _, k3] = sets.table1.machine.belt.stiffness.three();
        let [m1, _, m3] = sets.table2.machine.belt.stiffness.three();
        let machine = &sets.table1.machine;
        let r = machine.pulley_radius;
        let inertia = machine.drive_pulley.inertia;
        let per_metre = cylinder_inertia(2.0 * r, 0.0, 1.0, DENSITY[0]);
        let length = 2.0 * PRINTED.1 + 2.0 * PI * r;
        let mass = SECTION * length * (PARTS[0].0 * DENSITY[1] + PARTS[1].0 * DENSITY[2]);
        let moving = machine.cart.mass + 2.0 * inertia / (r * r);
        // A stretch with teeth of plain neoprene carries A E as before plus the tooth's own section times 6e6 Pa.
        let tooth = 1.0 + PARTS[0].1 / composite;
        Self {
            composite,
            stiffness: vec![
                row("Table 1", "k₁, k₂", k1, 0.5e1, MODULUS_1, 1.0, false),
                row("Table 1", "k₃", k3, 0.5e1, MODULUS_1, 1.0, true),
                row("Table 2", "k₁, k₂", m1, 0.5e1, MODULUS_2, 0.5, false),
                row("Table 2", "k₃", m3, 0.5e0, MODULUS_2, 0.5, true),
            ],
            radius: pitch_radius(60.0, 2.03e-3),
            thickness: SECTION / WIDTH,
            cylinder_length: inertia / per_metre,
            belt_wide_inertia: per_metre * WIDTH,
            mass,
            mass_share: mass / (mass + moving),
            neoprene_teeth: toothed_section(1.0, tooth, 0.5) - 1.0,
        }
    }
}

/// Eq. (12) over eq. (13) with l the whole span, for a toothed section `ratio` times the plain one on `share` of the
/// length.
pub fn series_over_plain(ratio: f64, share: f64) -> f64 {
    toothed_section(1.0, ratio, share)
}

/// Eq. (12) over eq. (13) with l the plain stretches alone.
pub fn series_over_plain_stretches(ratio: f64, share: f64) -> f64 {
    toothed_section(1.0, ratio, share) * (1.0 - share)
}
