//! The frequencies at which a stage vibrates, along its travel, from its masses and springs.

use crate::error::{Error, Result};
use crate::machine::{AmplifierMode, BeltModel, Machine, Spans};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use std::f64::consts::PI;

/// Places along the travel at which modes are looked for.
const PLACES: usize = 21;
/// Modes that move the cart less than this part of the strongest are left out.
const LEAST: f64 = 1e-3;

/// The state of the drive pulley.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Drive {
    /// A position loop or a stepper motor makes it follow its command: what vibrates is the cart on its belt.
    #[default]
    Held,
    /// The motor's torque is commanded and the pulley gives way: the resonance of the open loop.
    Free,
}

/// A mode of vibration at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonance {
    /// Cart position, m.
    pub position: f64,
    /// Undamped natural frequency, Hz.
    pub frequency: f64,
    /// Damping ratio.
    pub damping: f64,
    /// How far it moves the cart after a step of the command, of what the strongest mode at that place does: 0 to 1.
    pub share: f64,
}

/// A mode along the travel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Its lowest and highest frequency, Hz.
    pub frequency: [f64; 2],
    /// Its least and most damping ratio.
    pub damping: [f64; 2],
    /// The most of its shares.
    pub share: f64,
    /// Its frequency at the last place, Hz.
    last: f64,
}

/// Step of a mode's frequency from one place to the next up to which it is the same mode, as part of it.
const SAME: f64 = 0.2;

/// Each mode over all places, the strongest first: from place to place a mode is the one of the nearest frequency.
pub fn reaches(modes: &[Resonance]) -> Vec<Reach> {
    let mut all: Vec<Reach> = Vec::new();
    for mode in modes {
        let off = |reach: &Reach| (mode.frequency / reach.last).ln().abs();
        let near = all.iter_mut().filter(|reach| off(reach) < SAME).min_by(|a, b| off(a).total_cmp(&off(b)));
        match near {
            Some(reach) => {
                let [low, high] = reach.frequency;
                reach.frequency = [low.min(mode.frequency), high.max(mode.frequency)];
                let [low, high] = reach.damping;
                reach.damping = [low.min(mode.damping), high.max(mode.damping)];
                (reach.share, reach.last) = (reach.share.max(mode.share), mode.frequency);
            }
            None => all.push(Reach {
                frequency: [mode.frequency; 2],
                damping: [mode.damping; 2],
                share: mode.share,
                last: mode.frequency,
            }),
        }
    }
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all
}

impl Reach {
    /// Whether a mode at some place is this one.
    pub fn has(&self, mode: &Resonance) -> bool {
        (self.frequency[0]..=self.frequency[1]).contains(&mode.frequency)
    }
}

/// The modes of a stage that move its cart: at every place along the travel if the spans follow the cart, else at one.
///
/// The masses, springs and dampers are those of the sliding stage: M q̈ + C q̇ + K q = 0 with the viscous friction, the
/// belt's damping and, where a free motor is fed by a voltage, its back-EMF. Frequencies are of K and M alone; damping
/// ratios ζ = φᵀ C φ / (2 ω φᵀ M φ) hold for light damping. Modes that are damped so much that they do not vibrate are
/// left out.
pub fn resonances(machine: &Machine, drive: Drive) -> Result<Vec<Resonance>> {
    if machine.belt.model == BeltModel::Rigid {
        let error = Error::new("a rigid belt has no resonance").allowed("belt.model = \"elastic\" or \"two-mass\"");
        return Err(error.next("describe the belt's stiffness, or give a measured spectrum"));
    }
    let places = match (&machine.cart.travel, machine.belt.follows_cart) {
        (Some(travel), true) => {
            let part = |k: usize| k as f64 / (PLACES - 1) as f64;
            (0..PLACES).map(|k| travel.min + part(k) * (travel.max - travel.min)).collect()
        }
        _ => vec![0.0],
    };
    let mut all = Vec::new();
    for position in places {
        let mut here = at(machine, drive, position);
        let most = here.iter().map(|mode| mode.share).fold(0.0, f64::max);
        here.retain(|mode| mode.share > LEAST * most);
        for mode in &mut here {
            mode.share /= most;
        }
        all.extend(here);
    }
    if all.is_empty() {
        let error = Error::new("this stage is damped so much that nothing vibrates");
        return Err(error.next("check the damping of the belt and the viscous friction in the case file"));
    }
    Ok(all)
}

/// The modes with the cart at one place; `share` is not yet relative.
fn at(machine: &Machine, drive: Drive, position: f64) -> Vec<Resonance> {
    let (m, c, k) = matrices(machine, drive, position);
    // With the drive pulley held it is no coordinate, but what it does is felt through its column of K.
    let first = if drive == Drive::Held { 1 } else { 0 };
    let size = m.nrows() - first;
    let part = |a: &DMatrix<f64>| a.view((first, first), (size, size)).into_owned();
    let root = m.diagonal().rows(first, size).map(|mass| mass.sqrt().recip());
    // M^(−½) K M^(−½) u = ω² u, φ = M^(−½) u
    let scaled = DMatrix::from_fn(size, size, |i, j| part(&k)[(i, j)] * root[i] * root[j]);
    let eigen = SymmetricEigen::new(scaled);
    let force = match drive {
        // A step of φ₁ pulls with −K's first column; the cart ends at r φ₁.
        Drive::Held => -k.view((1, 0), (size, 1)).column(0).into_owned(),
        Drive::Free => DVector::from_fn(size, |i, _| if i == 0 { 1.0 } else { 0.0 }),
    };
    let cart = 1 - first;
    let stiffest = eigen.eigenvalues.max();
    let mode = |i: usize| {
        let squared = eigen.eigenvalues[i];
        // Moving as a whole is no vibration.
        if squared <= 1e-12 * stiffest {
            return None;
        }
        let omega = squared.sqrt();
        let shape = eigen.eigenvectors.column(i).component_mul(&root);
        let damping = (shape.transpose() * part(&c) * &shape)[(0, 0)] / (2.0 * omega);
        let share = (shape[cart] * shape.dot(&force) / squared).abs();
        (damping < 1.0).then_some(Resonance { position, frequency: omega / (2.0 * PI), damping, share })
    };
    let mut modes: Vec<Resonance> = (0..size).filter_map(mode).collect();
    modes.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    modes
}

/// M, C and K over φ₁, x and φ₃; over φ₁ and x where both pulleys are one.
fn matrices(machine: &Machine, drive: Drive, position: f64) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
    let motor = &machine.drives[0].motor;
    let n = motor.gear_ratio;
    let [mut stiffness, damping] = [machine.belt.stiffness, machine.belt.damping].map(Spans::three);
    if let (true, Some(make)) = (machine.belt.follows_cart, &machine.belt.make) {
        let [k1, k2] = make.stiffness_at(position);
        stiffness = [k1, k2, stiffness[2]];
    }
    let mechanism = machine.mechanism();
    let arm = |span: usize, body: usize| mechanism.stretch_rate(span).speed[body];
    // Σ k dᵀ d over the spans' stretches d
    let sum = |values: [f64; 3]| {
        DMatrix::from_fn(3, 3, |i, j| (0..3).map(|s| values[s] * arm(s, i) * arm(s, j)).sum::<f64>())
    };
    let rotor = n * n * motor.rotor_inertia;
    let masses = [machine.drive_pulley.inertia + rotor, machine.cart.mass, machine.idler_pulley.inertia];
    let frictions = [machine.drive_pulley.friction, machine.cart.friction, machine.idler_pulley.friction];
    let mut resisting = frictions.map(|friction| 0.5 * (friction.forward.viscous + friction.backward.viscous));
    if drive == Drive::Free && machine.drives[0].amplifier.mode == AmplifierMode::Voltage {
        // n² K_t K_e / R, of an armature without inductance
        resisting[0] += n * n * motor.torque_constant * motor.back_emf_constant / motor.resistance;
    }
    let diagonal = |values: &[f64]| DMatrix::from_diagonal(&DVector::from_column_slice(values));
    if machine.belt.model == BeltModel::TwoMass {
        // Spans 2 and 3 in series between the cart and both pulleys, which turn as one.
        let r = machine.pulley_radius;
        let [[k1, k2, k3], [c1, c2, c3]] = [stiffness, damping];
        let all = k2 + k3;
        let (k, c) = (k1 + k2 * k3 / all, c1 + (c2 * k3 * k3 + c3 * k2 * k2) / (all * all));
        let both = |value: f64| DMatrix::from_row_slice(2, 2, &[r * r * value, -r * value, -r * value, value]);
        let two = |values: [f64; 3]| diagonal(&[values[0] + values[2], values[1]]);
        return (two(masses), both(c) + two(resisting), both(k));
    }
    // A pulley without inertia follows at once; the smallest weight keeps the matrix of masses regular.
    let tiny = 1e-9 * machine.cart.mass * machine.pulley_radius * machine.pulley_radius;
    let masses = masses.map(|mass| mass.max(tiny));
    (diagonal(&masses), sum(damping) + diagonal(&resisting), sum(stiffness))
}
