//! Data sheets: timing belts by their type, motors by their rating, a drive by its force.
//!
//! Every number of the table of belts comes from a catalogue, a data sheet or a published measurement, named beside it.
//! Missing numbers are left out.

use super::Motor;
use std::f64::consts::PI;

/// Largest number of teeth in mesh that counts (z_e max of the catalogue).
const MOST_TEETH: f64 = 12.0;

/// A timing belt as its maker sells it.
#[derive(Debug, PartialEq)]
#[non_exhaustive]
pub struct BeltType {
    /// Its name in the case file.
    pub name: &'static str,
    /// Tooth pitch, m.
    pub pitch: f64,
    /// Belts of the catalogue, by width; empty if no source gives a stiffness.
    pub widths: &'static [Width],
    /// Allowed tension per width, N/m, if a source gives it for all widths.
    pub tension_per_width: Option<f64>,
    /// Force that one tooth carries per width at rest, N/m.
    pub tooth_strength: Option<f64>,
    /// Source of the numbers.
    pub source: &'static str,
}

/// A belt of a certain width.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Width {
    /// Width b, m.
    pub width: f64,
    /// Force per unit strain, E A, N: "specific spring rate", C_spez.
    pub stiffness: f64,
    /// Allowed tension, N.
    pub tension: Option<f64>,
    /// Mass per length, kg/m.
    pub mass: Option<f64>,
}

const fn width(millimetres: f64, stiffness: f64, tension: f64, mass: f64) -> Width {
    Width { width: 1e-3 * millimetres, stiffness, tension: Some(tension), mass: Some(mass) }
}

const SDP_SI: &str =
    "SDP/SI, handbook of timing belts (D265), Fig. 19 and Table 3: allowed tension of neoprene belts per inch of width";

/// Pounds of force, and inches.
const LBF: f64 = 4.448_221_615_260_5;
const INCH: f64 = 0.0254;

/// 38 lbf stretch a belt of 9 mm by 0.58 %: E A = 29.1 kN.
const GT2: &[Width] = &[Width { width: 9e-3, stiffness: 38.0 * LBF / 0.0058, tension: None, mass: None }];

/// Table of belts.
pub const BELTS: &[BeltType] = &[
    BeltType {
        name: "GT2",
        pitch: 2e-3,
        widths: GT2,
        tension_per_width: Some(25.0 * LBF / INCH),
        tooth_strength: None,
        source: "pitch and allowed tension (25 lbf per inch of width): SDP/SI, handbook of timing belts (D265), Fig. 19 and Table 3; stiffness: \
                 measured on the 9 mm belt of a Shapeoko 3, 0.58 % under 38 lbf (community.carbide3d.com, topic 18480)",
    },
    BeltType {
        name: "GT2-3M",
        pitch: 3e-3,
        widths: &[],
        tension_per_width: Some(114.0 * LBF / INCH),
        tooth_strength: None,
        source: SDP_SI,
    },
    BeltType {
        name: "GT2-5M",
        pitch: 5e-3,
        widths: &[],
        tension_per_width: Some(160.0 * LBF / INCH),
        tooth_strength: None,
        source: SDP_SI,
    },
    BeltType {
        name: "MXL",
        pitch: 2.032e-3,
        widths: &[],
        tension_per_width: None,
        tooth_strength: None,
        source: "pitch: ISO 5296, as in Optibelt, technical manual of rubber timing belts, Table 1",
    },
    BeltType {
        name: "HTD-3M",
        pitch: 3e-3,
        widths: &[
            width(10.0, 80_000.0, 320.0, 0.02),
            width(15.0, 127_500.0, 510.0, 0.03),
            width(25.0, 225_000.0, 900.0, 0.05),
        ],
        tension_per_width: None,
        tooth_strength: None,
        source: "Elatech, data sheet of HTD3M",
    },
    BeltType {
        name: "HTD-5M",
        pitch: 5e-3,
        widths: &[
            width(10.0, 220_000.0, 880.0, 0.05),
            width(15.0, 330_000.0, 1320.0, 0.07),
            width(25.0, 632_500.0, 2530.0, 0.12),
            width(50.0, 1_265_000.0, 5060.0, 0.24),
            width(100.0, 2_530_000.0, 10_120.0, 0.48),
        ],
        tension_per_width: None,
        tooth_strength: Some(3680.0),
        source: ELATECH_HTD5M,
    },
    BeltType {
        name: "T5",
        pitch: 5e-3,
        widths: &[
            width(10.0, 90_000.0, 360.0, 0.021),
            width(16.0, 142_500.0, 570.0, 0.034),
            width(25.0, 225_000.0, 900.0, 0.053),
            width(32.0, 285_000.0, 1140.0, 0.067),
            width(50.0, 450_000.0, 1800.0, 0.105),
            width(75.0, 675_000.0, 2700.0, 0.158),
            width(100.0, 900_000.0, 3600.0, 0.210),
        ],
        tension_per_width: None,
        tooth_strength: Some(2470.0),
        source: ELATECH_T5,
    },
    BeltType {
        name: "AT5",
        pitch: 5e-3,
        widths: &[
            width(10.0, 140_000.0, 560.0, 0.03),
            width(16.0, 280_000.0, 1120.0, 0.05),
            width(25.0, 437_500.0, 1750.0, 0.09),
            width(32.0, 560_000.0, 2240.0, 0.11),
            width(50.0, 875_000.0, 3500.0, 0.17),
            width(75.0, 1_312_500.0, 5250.0, 0.26),
            width(100.0, 1_750_000.0, 7000.0, 0.34),
        ],
        tension_per_width: None,
        tooth_strength: Some(3640.0),
        source: ELATECH_AT5,
    },
    BeltType {
        name: "ATL5",
        pitch: 5e-3,
        widths: &[
            width(10.0, 275_000.0, 1100.0, 0.04),
            width(16.0, 440_000.0, 1760.0, 0.06),
            width(25.0, 632_500.0, 2530.0, 0.10),
            width(32.0, 770_000.0, 3080.0, 0.12),
            width(50.0, 1_265_000.0, 5060.0, 0.19),
            width(75.0, 1_897_500.0, 7590.0, 0.29),
            width(100.0, 2_530_000.0, 10_120.0, 0.38),
        ],
        tension_per_width: None,
        tooth_strength: Some(3640.0),
        source: ELATECH_ATL5,
    },
];

const ELATECH_HTD5M: &str =
    "Elatech polyurethane belts with steel cords, catalogue of Goodyear Rubber Products 2012, p. 36";
const ELATECH_T5: &str =
    "Elatech polyurethane belts with steel cords, catalogue of Goodyear Rubber Products 2012, p. 8";
const ELATECH_AT5: &str =
    "Elatech polyurethane belts with steel cords, catalogue of Goodyear Rubber Products 2012, p. 14";
const ELATECH_ATL5: &str =
    "Elatech polyurethane belts with steel cords, catalogue of Goodyear Rubber Products 2012, p. 20";

impl BeltSheet {
    /// Teeth in mesh at a pulley of this radius, m, and the force that they carry at rest, N; for a belt of known type
    /// and width.
    pub fn mesh(&self, radius: f64) -> Option<(f64, Option<f64>)> {
        let (kind, width) = (self.kind?, self.width?);
        let teeth = 2.0 * PI * radius / kind.pitch;
        // The belt lies on half of the pulley.
        let in_mesh = (0.5 * teeth).floor();
        Some((in_mesh, kind.teeth(width, in_mesh)))
    }
}

impl BeltType {
    /// The type of this name in any spelling: `HTD 5M` is `HTD-5M`.
    pub fn named(name: &str) -> Option<&'static BeltType> {
        let plain = |name: &str| name.to_lowercase().replace([' ', '-', '_'], "");
        BELTS.iter().find(|belt| plain(belt.name) == plain(name))
    }

    /// E A of a belt of this width, N.
    pub fn stiffness(&self, width: f64) -> Option<f64> {
        self.at(width, |row| Some(row.stiffness))
    }

    /// Mass per length, kg/m.
    pub fn mass(&self, width: f64) -> Option<f64> {
        self.at(width, |row| row.mass)
    }

    /// Allowed tension, N.
    pub fn tension(&self, width: f64) -> Option<f64> {
        self.at(width, |row| row.tension).or(self.tension_per_width.map(|tension| tension * width))
    }

    /// Force that the teeth carry with this number in mesh, N.
    pub fn teeth(&self, width: f64, in_mesh: f64) -> Option<f64> {
        self.tooth_strength.map(|strength| strength * width * in_mesh.min(MOST_TEETH))
    }

    /// Linear interpolation between the widths of the catalogue, proportional beyond them.
    fn at(&self, width: f64, value: impl Fn(&Width) -> Option<f64>) -> Option<f64> {
        let (first, last) = (self.widths.first()?, self.widths.last()?);
        let above = self.widths.iter().position(|row| row.width >= width);
        match above {
            Some(0) => Some(value(first)? * width / first.width),
            None => Some(value(last)? * width / last.width),
            Some(k) => {
                let (low, high) = (&self.widths[k - 1], &self.widths[k]);
                let share = (width - low.width) / (high.width - low.width);
                Some(value(low)? + share * (value(high)? - value(low)?))
            }
        }
    }
}

/// Data sheet of a belt, without stiffness and damping.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BeltSheet {
    /// Its type, if it is in the table.
    pub kind: Option<&'static BeltType>,
    /// Width b, m.
    pub width: Option<f64>,
    /// Mass per length, kg/m.
    pub mass_per_length: Option<f64>,
    /// Allowed tension, N.
    pub allowed_tension: Option<f64>,
    /// True if E A was given itself: a modulus with a section of 1 m².
    pub is_specific: bool,
}

/// Rating of a motor at nominal voltage and load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rating {
    /// V_n, V.
    pub voltage: f64,
    /// ω_n, rad/s.
    pub speed: f64,
    /// M_n, N m.
    pub torque: f64,
    /// I_n, A.
    pub current: f64,
    /// I_0, A.
    pub no_load_current: f64,
}

impl Rating {
    /// K_t = M_n / (I_n − I_0): the no-load current covers the motor's own losses.
    pub fn torque_constant(&self) -> f64 {
        self.torque / (self.current - self.no_load_current)
    }

    /// K_e = (V_n − R I_n) / ω_n
    pub fn back_emf_constant(&self, resistance: f64) -> f64 {
        (self.voltage - resistance * self.current) / self.speed
    }

    /// R = (V_n − K_e ω_n) / I_n
    pub fn resistance(&self, back_emf_constant: f64) -> f64 {
        (self.voltage - back_emf_constant * self.speed) / self.current
    }
}

/// A drive that is known only by its force at the belt: F = k_F u − d v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimpleDrive {
    /// Force per input k_F, N/V.
    pub force: f64,
    /// Drag d, N s/m.
    pub drag: f64,
}

impl SimpleDrive {
    /// The equivalent motor at a pulley of radius `r`, with 1 ohm, so that its current equals the voltage less
    /// back-EMF.
    ///
    /// With R = 1 ohm, K_t = k_F r and K_e = d r / k_F, the force K_t (u − K_e v / r) / (R r) is k_F u − d v.
    pub fn motor(self, r: f64) -> Motor {
        let back_emf_constant = self.drag * r / self.force;
        Motor { back_emf_constant, is_simple: true, ..Motor::brushed(self.force * r, 1.0) }
    }

    /// The simple drive that `motor` represents, if any.
    pub fn new(motor: &Motor, r: f64) -> Option<Self> {
        let force = motor.torque_constant / r;
        motor.is_simple.then(|| Self { force, drag: motor.back_emf_constant * force / r })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_grow_and_so_do_belts() {
        for belt in BELTS {
            for pair in belt.widths.windows(2) {
                assert!(pair[0].width < pair[1].width && pair[0].stiffness < pair[1].stiffness, "{}", belt.name);
                assert!(pair[0].tension <= pair[1].tension && pair[0].mass <= pair[1].mass, "{}", belt.name);
            }
            assert!(!belt.source.is_empty());
        }
    }

    #[test]
    fn a_width_of_the_catalogue_is_that_of_the_catalogue() {
        let belt = BeltType::named("at 5").unwrap();
        assert_eq!(belt.stiffness(16e-3), Some(280_000.0));
        assert_eq!(belt.mass(25e-3), Some(0.09));
        assert_eq!(belt.tension(10e-3), Some(560.0));
        // Half as wide as the narrowest: half of it.
        assert_eq!(belt.stiffness(5e-3), Some(70_000.0));
        assert!((belt.stiffness(13e-3).unwrap() - 210_000.0).abs() < 1e-6);
        assert!((belt.stiffness(0.2).unwrap() - 3.5e6).abs() < 1e-3);
        // 10 teeth in mesh of 36.4 N per cm of width each, and no more than 12 count.
        assert!((belt.teeth(10e-3, 10.0).unwrap() - 364.0).abs() < 1e-9);
        assert_eq!(belt.teeth(10e-3, 30.0), belt.teeth(10e-3, 12.0));
    }

    #[test]
    fn a_belt_of_printers_is_as_stiff_as_was_measured() {
        let belt = BeltType::named("GT2").unwrap();
        // 38 lbf on 9 mm: 0.58 %.
        assert!((belt.stiffness(9e-3).unwrap() * 0.0058 / 4.4482216152605 - 38.0).abs() < 1e-9);
        // No less than what an acceptance test asks of 6 mm: 1 % under 10 kg.
        assert!(belt.stiffness(6e-3).unwrap() > 9806.65);
        assert_eq!(belt.mass(6e-3), None);
    }

    #[test]
    fn a_simple_drive_is_the_motor_that_it_stands_for() {
        let drive = SimpleDrive { force: 0.65, drag: 12.0 };
        let motor = drive.motor(0.015);
        let back = SimpleDrive::new(&motor, 0.015).unwrap();
        assert!((back.force - 0.65).abs() < 1e-15 && (back.drag - 12.0).abs() < 1e-13);
        let [u, v, r] = [3.0, 0.1, 0.015];
        let current = (u - motor.back_emf_constant * v / r) / motor.resistance;
        assert!((motor.torque_constant * current / r - (0.65 * u - 12.0 * v)).abs() < 1e-12);
    }
}
