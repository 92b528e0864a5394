//! Resonance and anti-resonance along the travel.

use super::{Operation, Root, StateSpace};
use crate::error::Result;
use crate::friction::{Friction, Law, Side};
use crate::machine::axis::DRIVE;
use crate::machine::{Amplifier, AmplifierMode, Machine, SlideForces};

/// The resonances with the cart at one place. All frequencies in Hz, the lowest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// x, m.
    pub position: f64,
    /// k₁ and k₂ there, N/m.
    pub stiffness: [f64; 2],
    /// Resonances: the pairs among the poles.
    pub resonances: Vec<Root>,
    /// Anti-resonances of the drive angle: the pairs among the poles with the drive pulley held.
    pub antiresonances: Vec<Root>,
    /// Resonances of the same masses and springs without friction, damping and back-EMF.
    pub undamped_resonances: Vec<f64>,
    /// Anti-resonances of those.
    pub undamped_antiresonances: Vec<f64>,
}

/// Places spread evenly over the travel, or, where none is given, from a twentieth of span 2 before the idler pulley to
/// a twentieth of span 1 before the drive pulley; none where the stiffness does not depend on the place.
pub fn places(machine: &Machine, count: usize) -> Option<Vec<f64>> {
    let make = machine.belt.make.filter(|_| machine.belt.follows_cart)?;
    let [l1, l2, _] = make.spans.three();
    let (mut low, mut high) = (-0.95 * l2, 0.95 * l1);
    if let Some(travel) = machine.cart.travel {
        (low, high) = (low.max(travel.min), high.min(travel.max));
    }
    let steps = count.max(2) - 1;
    Some((0..=steps).map(|i| low + (high - low) * i as f64 / steps as f64).collect())
}

/// The stage with the cart at each of `positions`, m; all else as `operation` says.
pub fn travel(machine: &Machine, operation: Operation, positions: &[f64]) -> Result<Vec<Place>> {
    let bare = undamped(machine);
    let mut drive_held = operation;
    drive_held.held[DRIVE] = true;
    let place = |&position: &f64| {
        let pairs = |machine: &Machine, about: Operation| -> Result<Vec<Root>> {
            let poles = StateSpace::of(machine, Operation { position, ..about })?.poles()?;
            Ok(Root::of(&poles).into_iter().filter(|root| root.hertz().is_some()).collect())
        };
        let hertz = |roots: Vec<Root>| roots.into_iter().filter_map(Root::hertz).collect();
        let [k1, k2, _] = machine.belt.stiffness.three();
        let stiffness = match machine.belt.make {
            Some(make) if machine.belt.follows_cart => make.stiffness_at(position),
            _ => [k1, k2],
        };
        Ok(Place {
            position,
            stiffness,
            resonances: pairs(machine, operation)?,
            antiresonances: pairs(machine, drive_held)?,
            undamped_resonances: hertz(pairs(&bare, operation)?),
            undamped_antiresonances: hertz(pairs(&bare, drive_held)?),
        })
    };
    positions.iter().map(place).collect()
}

/// The same masses and springs and nothing that takes energy: no friction, no damping, no back-EMF, a motor that is
/// given its current.
pub fn undamped(machine: &Machine) -> Machine {
    let mut bare = machine.clone();
    let none = Friction { forward: Side::default(), backward: Side::default(), law: Law::Coulomb };
    (bare.drive_pulley.friction, bare.cart.friction, bare.idler_pulley.friction) = (none, none, none);
    (bare.cart.along, bare.cart.forces) = (None, SlideForces::default());
    bare.belt.damping = [0.0; 3].into();
    if let Some(play) = &mut bare.drives[0].motor.gear_play {
        play.damping = 0.0;
    }
    bare.drives[0].motor.gear_efficiency = 1.0;
    bare.drives[0].amplifier = Amplifier::ideal(AmplifierMode::Current, bare.drives[0].amplifier.gain);
    bare
}
