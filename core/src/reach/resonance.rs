//! Natural frequencies of a machine along its travel, from its masses and springs; a bridge that yaws has the mass
//! matrix of the cart's position.

use crate::error::{Error, Result};
use crate::machine::{AmplifierMode, BeltModel, DriveAt, EncoderPlace, Machine, Travel};
use crate::mechanism::{self, Body, Mechanism, Phases, Spring};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use std::f64::consts::PI;

/// Number of positions along the travel at which modes are computed.
const PLACES: usize = 21;
/// Number of positions of another coordinate.
const OTHERS: usize = 5;
/// Modes that move the cart less than this fraction of the strongest are omitted.
const LEAST: f64 = 1e-3;

/// The state of the drive pulley.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Drive {
    /// A position loop makes it follow its command: the cart vibrates on its belt. With an encoder before a compliant
    /// gear, the rotor follows, and the cart vibrates on gear and belt. A stepper holds its rotor by the stiffness of
    /// its field, so that vibrates too.
    #[default]
    Held,
    /// The motor's torque is commanded and the pulley moves: resonance of the open loop.
    Free,
}

/// A mode of vibration at one position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonance {
    /// Position of the coordinate, m: of the cart of an axis.
    pub position: f64,
    /// Undamped natural frequency, Hz.
    pub frequency: f64,
    /// Damping ratio.
    pub damping: f64,
    /// Displacement of the coordinate after a command step, relative to the strongest mode at that position: 0 to 1.
    pub share: f64,
}

/// A mode along the travel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Its lowest and highest frequency, Hz.
    pub frequency: [f64; 2],
    /// Its smallest and largest damping ratio.
    pub damping: [f64; 2],
    /// Its largest share.
    pub share: f64,
    /// Its frequency at the last position, Hz.
    last: f64,
}

/// Largest relative step of a mode's frequency from one position to the next.
const SAME: f64 = 0.2;

/// Each mode over all positions, the strongest first: between positions, modes are matched by the nearest frequency.
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
    /// True if this mode contains a mode at one position.
    pub fn has(&self, mode: &Resonance) -> bool {
        (self.frequency[0]..=self.frequency[1]).contains(&mode.frequency)
    }
}

/// Modes of a machine that move one of its coordinates: the cart of an axis, bridge or cart of a gantry; at every
/// position along the travel if the spans follow the slides or the bridge yaws, otherwise at one.
///
/// For the sliding machine, M q̈ + C q̇ + K q = 0 with viscous friction, belt damping and, for a free motor in voltage
/// mode, back-EMF. Frequencies follow from K and M alone; damping ratios ζ = φᵀ C φ / (2 ω φᵀ M φ) hold for light
/// damping. Overdamped modes are left out.
pub fn resonances(machine: &Machine, drive: Drive, coordinate: usize) -> Result<Vec<Resonance>> {
    if machine.belt.model == BeltModel::Rigid {
        let error = Error::new("a rigid belt has no resonance").allowed("belt.model = \"elastic\" or \"two-mass\"");
        return Err(error.next("describe the belt's stiffness, or give a measured spectrum"));
    }
    let mut all = Vec::new();
    for slides in places(machine, coordinate) {
        let mut here = at(machine, (drive, coordinate), &slides);
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

/// Positions of the slides, m: along the travel of the coordinate, back and forth at a few positions of another.
fn places(machine: &Machine, coordinate: usize) -> Vec<Vec<f64>> {
    let travels: Vec<Option<Travel>> = machine.travels().map(|(_, travel)| travel).collect();
    let along = |travel: &Option<Travel>, count: usize| -> Vec<f64> {
        let changes = machine.belt.follows_cart || machine.yaw.is_some();
        let Some(travel) = travel.filter(|_| changes) else { return vec![0.0] };
        let part = |k: usize| k as f64 / (count - 1) as f64;
        (0..count).map(|k| travel.min + part(k) * (travel.max - travel.min)).collect()
    };
    let mut all = vec![vec![0.0; travels.len()]];
    for (number, travel) in travels.iter().enumerate() {
        let is_own = number == coordinate;
        if !is_own {
            let others = along(travel, OTHERS);
            all = others.iter().flat_map(|place| all.iter().map(move |at| with(at, number, *place))).collect();
        }
    }
    let own = along(&travels[coordinate], PLACES);
    let line = |(turn, at): (usize, &Vec<f64>)| -> Vec<Vec<f64>> {
        let one = |place: &f64| with(at, coordinate, *place);
        // Starts where the last line ended, so that modes change little between positions.
        if turn.is_multiple_of(2) { own.iter().map(one).collect() } else { own.iter().rev().map(one).collect() }
    };
    all.iter().enumerate().flat_map(line).collect()
}

/// Positions with another one of a coordinate.
fn with(at: &[f64], number: usize, place: f64) -> Vec<f64> {
    let mut all = at.to_vec();
    all[number] = place;
    all
}

/// Modes at one position; `share` is not yet relative.
fn at(machine: &Machine, (drive, coordinate): (Drive, usize), slides: &[f64]) -> Vec<Resonance> {
    let (geometry, mechanism) = (machine.geometry(), machine.mechanism());
    let (m, c, k) = matrices(machine, &mechanism, drive, slides);
    let fields: Option<Vec<f64>> = mechanism.drives.iter().map(field).collect();
    // Held bodies are not coordinates, but act through their columns of K.
    let is_read_before = machine.encoder.is_some_and(|encoder| encoder.at == EncoderPlace::Motor);
    let held: Vec<usize> = match (drive, &fields) {
        (Drive::Held, None) => {
            mechanism.drives.iter().map(|own| if is_read_before { own.shaft } else { own.pulley }).collect()
        }
        _ => Vec::new(),
    };
    let kept: Vec<usize> = mechanism.leaders().filter(|body| !held.contains(body)).collect();
    let size = kept.len();
    let place = |body: usize| kept.iter().position(|own| *own == body);
    let part = |a: &DMatrix<f64>| a.select_rows(&kept).select_columns(&kept);
    let root = part(&m).diagonal().map(|mass| mass.sqrt().recip());
    // L⁻¹ with M = L Lᵀ, of a bridge that yaws
    let lower = machine.yaw.and_then(|_| part(&m).cholesky()?.l().try_inverse());
    let scaled = match &lower {
        Some(lower) => lower * part(&k) * lower.transpose(),
        // M^(−½) K M^(−½) u = ω² u, φ = M^(−½) u
        None => DMatrix::from_fn(size, size, |i, j| part(&k)[(i, j)] * root[i] * root[j]),
    };
    let eigen = SymmetricEigen::new(scaled);
    let slide = &geometry.slides[coordinate];
    let share = |at: &DriveAt| geometry.bodies[at.pulley].by_slides[coordinate];
    let mut force = DVector::zeros(size);
    for (number, (at, own)) in geometry.drives.iter().zip(&mechanism.drives).enumerate() {
        match (drive, &fields) {
            // A command step acts on the rotors by the stiffness of their fields.
            (Drive::Held, Some(fields)) => {
                place(own.shaft).into_iter().for_each(|i| force[i] = fields[number] * share(at))
            }
            // A step of the drives for a unit step of the coordinate acts by their columns of −K.
            (Drive::Held, None) => force -= k.column(held[number]).select_rows(&kept) * share(at),
            // The torques that push the coordinate: Σ τ_k dφ_k = F dq
            (Drive::Free, _) => place(own.shaft).into_iter().for_each(|i| force[i] = slide.by_drives[number]),
        }
    }
    let load = place(slide.body).unwrap_or_default();
    let stiffest = eigen.eigenvalues.max();
    let mode = |i: usize| {
        let squared = eigen.eigenvalues[i];
        // A rigid-body mode is not a vibration.
        if squared <= 1e-12 * stiffest {
            return None;
        }
        let omega = squared.sqrt();
        let shape = match &lower {
            Some(lower) => lower.tr_mul(&eigen.eigenvectors.column(i)),
            None => eigen.eigenvectors.column(i).component_mul(&root),
        };
        let damping = (shape.transpose() * part(&c) * &shape)[(0, 0)] / (2.0 * omega);
        let share = (shape[load] * shape.dot(&force) / squared).abs();
        let (position, frequency) = (slides[coordinate], omega / (2.0 * PI));
        (damping < 1.0).then_some(Resonance { position, frequency, damping, share })
    };
    let mut modes: Vec<Resonance> = (0..size).filter_map(mode).collect();
    modes.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    modes
}

/// Stiffness of the field of a stepper, N m/rad.
fn field(drive: &mechanism::Drive) -> Option<f64> {
    Phases::of_motor(&drive.motor, &drive.amplifier).map(|phases| phases.stiffness())
}

/// M, C and K over all bodies; the rows of a pulley that follows another, as in a two-mass belt, are in those of the
/// other.
fn matrices(
    machine: &Machine,
    mechanism: &Mechanism,
    drive: Drive,
    slides: &[f64],
) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
    let (geometry, count) = (machine.geometry(), mechanism.bodies.len());
    let mut stiffness: Vec<f64> = machine.belt.stiffness.into_iter().collect();
    let mut damping: Vec<f64> = machine.belt.damping.into_iter().collect();
    if let (Some(lengths), Some(make)) = (machine.span_lengths(slides), &machine.belt.make) {
        for ((k, length), span) in stiffness.iter_mut().zip(lengths).zip(geometry.spans) {
            *k = if span.follows.is_empty() { *k } else { make.rigidity() / length };
        }
    }
    // The bearings of a bridge that yaws stand behind the spans.
    stiffness.extend(machine.yaw.map(|yaw| yaw.stiffness()));
    damping.extend(machine.yaw.map(|yaw| yaw.damping()));
    let arm = |spring: usize, body: usize| mechanism.stretch_rate(spring).speed[body];
    let gears: Vec<usize> = (0..mechanism.drives.len()).filter_map(|drive| mechanism.gear_spring(drive)).collect();
    // Σ k dᵀ d over the stretches d of spans and gears
    let sum = |values: &[f64], of_gear: fn(&Spring) -> f64| {
        let gears = gears.iter().map(|&gear| (gear, of_gear(&mechanism.springs[gear])));
        let all: Vec<(usize, f64)> = values.iter().copied().enumerate().chain(gears).collect();
        let term = |i: usize, j: usize| all.iter().map(|&(s, k)| k * arm(s, i) * arm(s, j)).sum::<f64>();
        DMatrix::from_fn(count, count, term)
    };
    let mut masses: Vec<f64> = mechanism.bodies.iter().map(|body| body.inertia).collect();
    let viscous = |body: &Body| 0.5 * (body.friction.forward.viscous + body.friction.backward.viscous);
    let mut resisting: Vec<f64> = mechanism.bodies.iter().map(viscous).collect();
    let mut fields = vec![0.0; count];
    for own in &mechanism.drives {
        let (motor, n) = (&own.motor, own.motor.gear_ratio);
        // J₁ + η n² J_r while the motor drives; a rotor behind a compliant gear feels 1/η of its torque
        match own.has_rotor() {
            true => masses[own.shaft] *= motor.gear_efficiency,
            false => masses[own.shaft] += motor.gear_efficiency * n * n * motor.rotor_inertia,
        }
        if drive == Drive::Free && own.amplifier.mode == AmplifierMode::Voltage {
            // η n² K_t K_e / R, of an armature without inductance
            let passed = motor.gear_efficiency * motor.torque_constant;
            resisting[own.shaft] += n * n * passed * motor.back_emf_constant / motor.resistance;
        }
        if drive == Drive::Held {
            fields[own.shaft] = field(own).unwrap_or(0.0);
        }
    }
    for body in (0..count).filter(|&body| mechanism.leader(body) != body) {
        let leader = mechanism.leader(body);
        masses[leader] += masses[body];
        resisting[leader] += resisting[body];
    }
    let [of_gear_k, of_gear_c]: [fn(&Spring) -> f64; 2] = [|gear| gear.stiffness, |gear| gear.damping];
    let (k, c) = match (machine.belt.model, &stiffness[..], &damping[..]) {
        (BeltModel::TwoMass, [k1, k2, k3], [c1, c2, c3]) => {
            // Spans 2 and 3 in series between the cart and both pulleys, which turn as one.
            let (r, all) = (machine.pulley_radius, k2 + k3);
            let (k, c) = (k1 + k2 * k3 / all, c1 + (c2 * k3 * k3 + c3 * k2 * k2) / (all * all));
            let both = |value: f64| {
                let own = DMatrix::from_row_slice(2, 2, &[r * r * value, -r * value, -r * value, value]);
                own.resize(count, count, 0.0)
            };
            (both(k) + sum(&[], of_gear_k), both(c) + sum(&[], of_gear_c))
        }
        _ => (sum(&stiffness, of_gear_k), sum(&damping, of_gear_c)),
    };
    let diagonal = |values: &[f64]| DMatrix::from_diagonal(&DVector::from_column_slice(values));
    // A pulley without inertia follows at once; a tiny inertia keeps the mass matrix regular.
    let tiny = 1e-9 * machine.cart.mass * machine.pulley_radius * machine.pulley_radius;
    masses.iter_mut().for_each(|mass| *mass = mass.max(tiny));
    let mut mass = diagonal(&masses);
    let bodies: Vec<usize> = (0..count).collect();
    let position = machine.without_strain(slides, &[]).position;
    mechanism.ridden_mass(&bodies, &position).into_iter().for_each(|(i, j, own)| mass[(i, j)] += own);
    (mass, c + diagonal(&resisting), k + diagonal(&fields))
}
