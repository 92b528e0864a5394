//! Directions of motion of the load: moving masses, drives and friction.

use crate::machine::{DriveUnit, Machine};

/// A direction of the load: that of the cart, on a gantry also that of the bridge.
pub(super) struct Direction {
    /// The number of what slides.
    pub number: usize,
    /// The drives that turn then.
    pub movers: Vec<usize>,
    /// The mass that slides, kg.
    pub sliding: f64,
    /// That of the pulleys and rotors that turn then, at the belt, kg.
    pub turning: f64,
    /// Mass of the rotors that a gear's loss leaves out, at the belt, kg.
    unfelt: f64,
    /// `_x` or `_y` at the end of keys; empty where there is one direction.
    suffix: &'static str,
    /// ` along x` or ` along y` at the end of names.
    words: &'static str,
    /// Moving part, in words.
    pub name: &'static str,
}

/// Friction at what slides, N and N s/m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Resistance {
    pub coulomb: f64,
    pub viscous: f64,
}

impl Direction {
    /// All of a machine, in the order of what slides.
    pub fn all(machine: &Machine) -> Vec<Self> {
        let words: &[_] = match machine.bridge {
            Some(_) => &[("_x", " along x", "bridge and cart along x"), ("_y", " along y", "the cart along y")],
            None => &[("", "", "the axis")],
        };
        let r = machine.pulley_radius;
        let rotor = |unit: &DriveUnit| unit.motor.rotor_inertia * unit.motor.gear_ratio.powi(2);
        let direction = |(number, &(suffix, words, name)): (usize, &(&'static str, &'static str, &'static str))| {
            let movers: Vec<usize> = machine.movers(number).map(|(drive, _)| drive).collect();
            let rotors: f64 = movers.iter().map(|drive| rotor(&machine.drives[*drive])).sum();
            let pulleys = movers.len() as f64 * machine.drive_pulley.inertia + machine.idler_pulley.inertia;
            let unfelt = |unit: &DriveUnit| (1.0 - unit.motor.gear_efficiency) * rotor(unit);
            let unfelt: f64 = movers.iter().map(|drive| unfelt(&machine.drives[*drive])).sum();
            // (Σ J + n² J_r)/r²
            let turning = (pulleys + rotors) / (r * r);
            Self {
                number,
                movers,
                sliding: machine.sliding_mass(number),
                turning,
                unfelt: unfelt / (r * r),
                suffix,
                words,
                name,
            }
        };
        words.iter().enumerate().map(direction).collect()
    }

    /// The key of a row of this direction.
    pub fn key(&self, key: &str) -> String {
        format!("{key}{}", self.suffix)
    }

    /// The name of a row of this direction.
    pub fn words(&self, name: &str) -> String {
        format!("{name}{}", self.words)
    }

    /// All that moves, at what slides, kg.
    pub fn mass(&self) -> f64 {
        self.sliding + self.turning
    }

    /// The mass that the motors' force, less the loss of their gears, accelerates, at what slides, kg.
    pub fn accelerated(&self) -> f64 {
        self.mass() - self.unfelt
    }

    /// Friction of all that moves, at what slides; `side` is the sign of its speed.
    pub fn resistance(&self, machine: &Machine, side: f64) -> Resistance {
        let r = machine.pulley_radius;
        let drives = machine.movers(self.number).map(|(_, sign)| machine.drive_pulley.friction.side(side * sign > 0.0));
        let idler = machine.idler_pulley.friction.side(side > 0.0);
        let slide = machine.slide(self.number).map(|slide| slide.friction.side(side > 0.0));
        let slide = slide.map_or((0.0, 0.0), |friction| (friction.coulomb, friction.viscous));
        let (coulomb, viscous) =
            drives.chain([idler]).fold((0.0, 0.0), |(c, b), pulley| (c + pulley.coulomb, b + pulley.viscous));
        Resistance { coulomb: slide.0 + coulomb / r, viscous: slide.1 + viscous / (r * r) }
    }

    /// True if its drives must pull alike, since each also moves something else.
    pub fn is_alike(&self, machine: &Machine) -> bool {
        let others = machine.geometry().slides.iter().enumerate().filter(|(number, _)| *number != self.number);
        others
            .flat_map(|(_, slide)| self.movers.iter().map(|drive| slide.by_drives[*drive]))
            .any(|weight| weight != 0.0)
    }

    /// True if backward it moves otherwise than forward.
    pub fn is_one_sided(&self, machine: &Machine) -> bool {
        machine.force_at(self.number, 0.0) != 0.0 || self.resistance(machine, 1.0) != self.resistance(machine, -1.0)
    }
}
