//! Resonances and anti-resonances along the travel.

use super::model::placed;
use super::{Operation, Root, StateSpace};
use crate::error::Result;
use crate::friction::{Friction, Law, Side};
use crate::machine::{Amplifier, AmplifierMode, BeltModel, Machine, SlideAt, SlideForces, Spans, Stepper};
use crate::mechanism::Phases;
use nalgebra::{DMatrix, DVector};

/// Damping ratio above which a pair of poles of a stepper is not a resonance.
const STILL: f64 = 0.98;

/// Resonances at one position. All frequencies in Hz, the lowest first.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ResonancesAt {
    /// Position of the cart, m.
    pub position: f64,
    /// Position of the bridge, m, if any.
    pub bridge: Option<f64>,
    /// Stiffness of each span there, N/m.
    pub stiffness: Spans,
    /// Compliance of each slide with held drive pulleys, m/N.
    pub compliance: Vec<f64>,
    /// Resonances: the pairs among the poles, without those of regulated currents of a stepper.
    pub resonances: Vec<Root>,
    /// Resonances with the drive pulleys held: the anti-resonances of the drive angle of an axis.
    pub antiresonances: Vec<Root>,
    /// Resonances of the same masses and springs without friction, damping and back-EMF.
    pub undamped_resonances: Vec<f64>,
    /// Anti-resonances without losses.
    pub undamped_antiresonances: Vec<f64>,
}

/// Evenly spaced positions over the travel, or without a travel from a twentieth of span 2 before the idler pulley to a
/// twentieth of span 1 before the drive pulley; none if the stiffness does not depend on the cart's position alone.
pub fn places(machine: &Machine, count: usize) -> Option<Vec<f64>> {
    let make = machine.belt.following().filter(|_| machine.bridge.is_none())?;
    let [l1, l2, _] = make.spans.three();
    let (mut low, mut high) = (-0.95 * l2, 0.95 * l1);
    if let Some(travel) = machine.cart.travel {
        (low, high) = (low.max(travel.min), high.min(travel.max));
    }
    let steps = count.max(2) - 1;
    Some((0..=steps).map(|i| low + (high - low) * i as f64 / steps as f64).collect())
}

/// Resonances with the cart at each of `positions`, m, otherwise at `operation`.
pub fn travel(machine: &Machine, operation: Operation, positions: &[f64]) -> Result<Vec<ResonancesAt>> {
    let bare = undamped(machine);
    let mut drives_held = operation;
    machine.geometry().drives.iter().for_each(|drive| drives_held.held[drive.pulley] = true);
    // Regulated currents that turn with a rotor decay in a hundredth of a period or less.
    let has_stepper = machine.stepper().is_some();
    let is_of_currents = |root: &Root| matches!(root, Root::Pair { damping, .. } if has_stepper && *damping > STILL);
    let place = |&position: &f64| {
        let pairs = |machine: &Machine, about: Operation| -> Result<Vec<Root>> {
            let poles = StateSpace::new(machine, Operation { position, ..about })?.poles()?;
            Ok(Root::from_values(&poles)
                .into_iter()
                .filter(|root| root.hertz().is_some() && !is_of_currents(root))
                .collect())
        };
        let hertz = |roots: Vec<Root>| roots.into_iter().filter_map(Root::hertz).collect();
        let held = placed(machine, Operation { position, ..operation })?;
        Ok(ResonancesAt {
            position,
            bridge: machine.bridge.as_ref().map(|_| operation.bridge),
            stiffness: held.belt.stiffness,
            compliance: compliance(&held),
            resonances: pairs(machine, operation)?,
            antiresonances: pairs(machine, drives_held)?,
            undamped_resonances: hertz(pairs(&bare, operation)?),
            undamped_antiresonances: hertz(pairs(&bare, drives_held)?),
        })
    };
    positions.iter().map(place).collect()
}

/// The diagonal of K⁻¹ at the slides, m/N: K = Σ k a aᵀ over the spans and the bridge's bearings, with their arms a on
/// the bodies that neither are drive pulleys nor follow one.
fn compliance(machine: &Machine) -> Vec<f64> {
    let (geometry, mechanism) = (machine.geometry(), machine.mechanism());
    if machine.belt.model == BeltModel::Rigid {
        return vec![0.0; geometry.slides.len()];
    }
    let is_held = |body: usize| geometry.drives.iter().any(|drive| mechanism.leader(drive.pulley) == body);
    let free: Vec<usize> =
        mechanism.held_bodies().filter(|&body| mechanism.leader(body) == body && !is_held(body)).collect();
    let mut stiffness = DMatrix::zeros(free.len(), free.len());
    for &span in mechanism.roles.spans.iter().chain(&machine.yaw_spring()) {
        let arms = mechanism.leading_arms(span);
        let arms = DVector::from_iterator(free.len(), free.iter().map(|body| arms[*body]));
        stiffness.ger(mechanism.springs[span].stiffness, &arms, &arms, 1.0);
    }
    let inverse = stiffness.try_inverse();
    let of_slide = |slide: &SlideAt| {
        let row = free.iter().position(|body| *body == slide.body)?;
        Some(inverse.as_ref()?[(row, row)])
    };
    geometry.slides.iter().map(|slide| of_slide(slide).unwrap_or(f64::INFINITY)).collect()
}

/// Resonances at the position of `operation`.
pub fn place(machine: &Machine, operation: Operation) -> Result<ResonancesAt> {
    Ok(travel(machine, operation, &[operation.position])?.swap_remove(0))
}

/// The machine without losses: no friction, damping or back-EMF, and commanded motor currents; of steppers, regulated
/// phase currents.
pub fn undamped(machine: &Machine) -> Machine {
    let mut bare = machine.clone();
    let none = Friction { forward: Side::default(), backward: Side::default(), law: Law::Coulomb };
    (bare.drive_pulley.friction, bare.idler_pulley.friction) = (none, none);
    for slide in bare.bridge.iter_mut().chain([&mut bare.cart]) {
        (slide.friction, slide.along, slide.forces) = (none, None, SlideForces::default());
    }
    bare.belt.damping = bare.belt.damping.map(|_| 0.0);
    if let Some(yaw) = &mut bare.yaw {
        yaw.bearing_damping = 0.0;
    }
    for unit in &mut bare.drives {
        if let Some(play) = &mut unit.motor.gear_play {
            play.damping = 0.0;
        }
        unit.motor.gear_efficiency = 1.0;
        let gain = unit.amplifier.gain;
        let phases = Phases::of_motor(&unit.motor, &unit.amplifier);
        unit.amplifier = match (phases, &mut unit.motor.stepper) {
            (Some(phases), Some(stepper)) => {
                // The same currents at rest, from regulators with voltage to spare.
                stepper.rated_current = phases.at_rest(0.0)[0];
                let bandwidth = Some(Stepper::CHOPPER_BANDWIDTH);
                Amplifier { bandwidth, ..Amplifier::ideal(AmplifierMode::Position, gain) }
            }
            _ => Amplifier::ideal(AmplifierMode::Current, gain),
        };
    }
    bare
}
