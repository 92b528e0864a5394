//! The belt: stiffness and damping of its spans, how far the load gives way, and its resonances along the travel.

use super::direction::Direction;
use super::{FiguresAt, Group, Note, TYPICAL_DAMPING, stepper, told};
use crate::error::Result;
use crate::linear::{self, Operation, Root};
use crate::machine::{BeltModel, Machine, Travel};
use crate::number::engineering;
use std::f64::consts::TAU;

/// Places along the travel of an axis.
const PLACES: usize = 7;

/// A pulley whose teeth are so far from a whole number has a doubtful radius.
const NOT_WHOLE: f64 = 0.1;

/// The machine with what slides at several places, where the place makes a difference; else at the origin.
pub(super) fn places(machine: &Machine) -> Result<Vec<FiguresAt>> {
    along(machine).iter().map(|at| place(machine, at)).collect()
}

/// Places over the travel of an axis; of a gantry the middle of its working area and the corners.
fn along(machine: &Machine) -> Vec<Vec<f64>> {
    if machine.bridge.is_none() {
        let along = linear::places(machine, PLACES).unwrap_or_else(|| vec![0.0]);
        return along.into_iter().map(|x| vec![x]).collect();
    }
    let changes = machine.belt.following().is_some() || machine.yaw.is_some();
    let (true, Some(x), Some(y)) = (changes, machine.first_slide().travel, machine.cart.travel) else {
        return vec![vec![0.0, 0.0]];
    };
    let middle = |travel: Travel| 0.5 * (travel.min + travel.max);
    let corners = [x.min, x.max].into_iter().flat_map(|x| [y.min, y.max].map(|y| vec![x, y]));
    [vec![middle(x), middle(y)]].into_iter().chain(corners).collect()
}

pub(super) fn place(machine: &Machine, at: &[f64]) -> Result<FiguresAt> {
    // A stepper as a free inertia: its field holds it by a sine, not by a stiffness.
    let free = machine.stepper().map(|_| stepper::without_field(machine));
    let found = linear::place(free.as_ref().unwrap_or(machine), Operation::at(at))?;
    let damped = |k: usize| match found.resonances.get(k) {
        // Where damping makes fewer pairs, which is which cannot be told.
        Some(Root::Pair { damping, .. }) if found.resonances.len() == found.undamped_resonances.len() => Some(*damping),
        _ => None,
    };
    let modes = found.undamped_resonances.iter().enumerate().map(|(k, hertz)| (*hertz, damped(k))).collect();
    let held = found.undamped_antiresonances.first().copied();
    let (stiffness, stretch) = (found.stiffness.to_vec(), found.compliance);
    Ok(FiguresAt { position: at.to_vec(), stiffness, stretch, modes, held })
}

pub(super) fn belt(
    machine: &Machine,
    directions: &[Direction],
    (origin, places): (&FiguresAt, &[FiguresAt]),
) -> Option<Group> {
    if machine.belt.model == BeltModel::Rigid {
        return None;
    }
    let is_axis = machine.bridge.is_none();
    let name = if is_axis { "Belt, with the cart at x = 0" } else { "Belt, with bridge and cart at zero" };
    let mut group = Group::new("belt", name);
    if let Some(make) = machine.belt.make {
        group.add("specific_stiffness", "specific stiffness E A", make.rigidity(), "N");
    }
    let spans = || machine.geometry().spans.iter();
    // Keys of an axis are those of its columns.
    let key = |span: &crate::machine::SpanAt| if is_axis { span.column } else { span.label.key };
    for (span, stiffness) in spans().zip(&machine.belt.stiffness) {
        let name = format!("stiffness of {}", span.label.name);
        group.add(format!("{}_stiffness", key(span)), name, *stiffness, "N/m");
    }
    for (direction, stretch) in directions.iter().zip(&origin.stretch) {
        if is_axis {
            group
                .add("stiffness_at_cart", "stiffness at the cart", 1.0 / stretch, "N/m")
                .how("the drive pulley held: k1 + k2 k3/(k2 + k3)");
        }
        let row = group.add(direction.key("stretch_per_force"), direction.words("stretch per newton"), *stretch, "m/N");
        if !is_axis {
            row.how("the drive pulleys held");
        }
    }
    if machine.belt.damping.iter().any(|c| *c > 0.0) {
        for (span, damping) in spans().zip(&machine.belt.damping) {
            let name = format!("damping of {}", span.label.name);
            group.add(format!("{}_damping", key(span)), name, *damping, "N s/m");
        }
    }
    resonances(&mut group, is_axis, nearest(origin, places));
    Some(group)
}

/// The place at the origin, or where the travel of an axis comes nearest to it.
fn nearest<'a>(origin: &'a FiguresAt, places: &'a [FiguresAt]) -> &'a FiguresAt {
    let far = |place: &FiguresAt| place.position.iter().map(|x| x * x).sum::<f64>();
    match origin.position.len() {
        1 => places.iter().min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(origin),
        _ => origin,
    }
}

fn resonances(group: &mut Group, is_axis: bool, place: &FiguresAt) {
    for (k, (hertz, ratio)) in place.modes.iter().enumerate() {
        let number = k + 1;
        let name = if is_axis { "resonance" } else { "elastic mode" };
        group.add(format!("resonance{number}"), format!("{name} {number}"), *hertz, "Hz");
        if let Some(ratio) = ratio {
            let row = group.add(format!("resonance{number}_damping"), "its damping ratio", *ratio, "");
            row.how("belt, viscous friction and back-EMF, everything sliding");
        }
    }
    if let Some(hertz) = place.held {
        let [name, how] = match is_axis {
            true => ["resonance with the drive held", "anti-resonance of the drive angle"],
            false => ["resonance with the drives held", "the lowest"],
        };
        group.add("held_resonance", name, hertz, "Hz").how(how);
    }
}

/// Notes about a belt: without damping, of doubtful teeth, and where its numbers are from.
pub(super) fn notes(machine: &Machine, notes: &mut Vec<Note>) {
    if machine.belt.model == BeltModel::Rigid {
        return;
    }
    let (sheet, r) = (&machine.belt.sheet, machine.pulley_radius);
    if machine.belt.damping.iter().all(|c| *c == 0.0) {
        let text = format!(
            "the belt has no damping, so only friction and the motor damp its vibration; of damping ratios, \
             {TYPICAL_DAMPING}: give belt.damping_ratio, or measure it"
        );
        notes.push(Note { code: "no-damping", text });
    }
    let Some(kind) = sheet.kind else { return };
    let teeth = TAU * r / kind.pitch;
    if (teeth - teeth.round()).abs() > NOT_WHOLE {
        let text = format!(
            "a pitch radius of {} makes {} teeth of the {} of a belt {}: is it the outer radius? give teeth instead",
            told(r, "m"),
            engineering(teeth, "", 4),
            told(kind.pitch, "m"),
            kind.name
        );
        notes.push(Note { code: "teeth", text });
    }
    notes.push(Note { code: "belt-source", text: format!("the numbers of a belt {}: {}", kind.name, kind.source) });
}
