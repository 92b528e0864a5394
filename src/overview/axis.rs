//! Overview of an axis.

use super::limits::{Most, Power, most, safety};
use super::{Group, Note, Overview, Place, belt_mass, drive_at_belt, motor_rows, of_belt, of_constants, stepper, told};
use crate::case::Case;
use crate::error::Result;
use crate::linear::{Operation, Root, places, travel};
use crate::machine::{AmplifierMode, BeltModel, Machine};
use crate::reach::feasible::sentence;
use std::f64::consts::PI;

/// Places along the travel.
const PLACES: usize = 7;

pub(super) fn overview(case: &Case) -> Result<Overview> {
    let machine = &case.machine;
    let mut notes = Vec::new();
    let masses = masses(machine);
    let inputs = case.experiments.iter().map(|experiment| (&experiment.inputs[0], experiment.until));
    let most = most(case.controller.as_ref().and_then(|design| design.limit), inputs);
    let along = places(machine, PLACES);
    let positions = along.clone().unwrap_or_else(|| vec![0.0]);
    let found = match machine.stepper() {
        // The motor as a free inertia: its field holds it by a sine, not by a stiffness.
        Some(_) => travel(&stepper::without_field(machine), Operation::default(), &positions)?,
        None => travel(machine, Operation::default(), &positions)?,
    };
    let places: Vec<Place> = found.iter().map(|place| self::place(machine, place)).collect();
    let mut groups = vec![drive(machine, &mut notes), inertia(machine, &masses, &mut notes)];
    groups.extend(belt(machine, &places));
    if machine.stepper().is_some() {
        groups.extend(stepper::limits(machine));
    } else {
        groups.extend(limits(machine, &masses, most.as_ref(), &mut notes));
        of_constants(&machine.drives[0].motor, "", &mut notes);
    }
    if machine.belt.model != BeltModel::Rigid {
        of_belt(&machine.belt.sheet, &machine.belt.damping, machine.pulley_radius, &mut notes);
    }
    notes.extend(
        case.shortfalls().iter().map(|(name, short)| Note { code: "move-out-of-reach", text: sentence(name, short) }),
    );
    groups.retain(|group| !group.rows.is_empty());
    let (title, kind, depends_on_place) = (case.title.clone(), "axis", along.is_some());
    Ok(Overview { title, kind, groups, places, depends_on_place, notes })
}

/// Masses at the cart, kg.
struct Masses {
    drive: f64,
    idler: f64,
    rotor: f64,
    total: f64,
}

fn masses(machine: &Machine) -> Masses {
    let r = machine.pulley_radius;
    let [drive, idler] = [&machine.drive_pulley, &machine.idler_pulley].map(|pulley| pulley.inertia / (r * r));
    // n² J_r / r²
    let rotor = machine.drives[0].motor.rotor_inertia * (machine.drives[0].motor.gear_ratio / r).powi(2);
    Masses { drive, idler, rotor, total: machine.cart.mass + drive + idler + rotor }
}

fn drive(machine: &Machine, notes: &mut Vec<Note>) -> Group {
    let mut group = Group::new("drive", "Drive");
    motor_rows(&mut group, "", &machine.drives[0].motor);
    let r = machine.pulley_radius;
    let amplifier = (machine.drives[0].amplifier.mode, machine.drives[0].amplifier.gain);
    let (force, drag) = drive_at_belt(&machine.drives[0].motor, amplifier, r);
    let (per_input, input) = match machine.drives[0].amplifier.mode {
        AmplifierMode::Voltage => ("N/V", "V"),
        AmplifierMode::Current => ("N/A", "A"),
        AmplifierMode::Position => return stepper::drive(machine),
    };
    group.add("force_per_input", "force at the belt per input", force, per_input);
    if drag > 0.0 {
        group.add("drag", "drag of the drive at the cart", drag, "N s/m").how(
            match machine.drives[0].motor.is_simple {
                true => "",
                false => "of the back-EMF",
            },
        );
    }
    group.add(
        "travel_per_turn",
        "travel per turn of the motor",
        2.0 * PI * r / machine.drives[0].motor.gear_ratio,
        "m",
    );
    if force > 0.0 {
        let [forward, backward] = [1.0, -1.0].map(|side| machine.breakaway(side, 0.0) / force);
        let row = group.add("breakaway_input", breakaway_name(input), forward, input);
        row.how("of all bodies together");
        if (backward - forward).abs() > 1e-3 * forward.abs() {
            group.add("breakaway_input_backward", "the same backward", backward, input);
        }
        if forward < 0.0 || backward < 0.0 {
            let text = "friction does not hold the load on the cart: at rest the axis begins to slide".to_string();
            notes.push(Note { code: "load-slides", text });
        }
    }
    group
}

fn breakaway_name(input: &str) -> &'static str {
    if input == "V" { "breakaway voltage" } else { "breakaway current" }
}

fn inertia(machine: &Machine, masses: &Masses, notes: &mut Vec<Note>) -> Group {
    let mut group = Group::new("inertia", "Moved mass, at the cart");
    group.add("cart_mass", "cart", machine.cart.mass, "kg");
    group.add("drive_pulley_mass", "drive pulley", masses.drive, "kg").how("J/r²");
    group.add("idler_pulley_mass", "idler pulley", masses.idler, "kg").how("J/r²");
    if masses.rotor > 0.0 {
        group.add("rotor_mass", "rotor", masses.rotor, "kg").how("n² J/r²");
    }
    group.add("total_mass", "total", masses.total, "kg");
    let reflected = masses.total - machine.cart.mass;
    group.add("reflected_share", "share of rotating parts", reflected / masses.total, "");
    let length = machine.belt.make.map(|make| make.spans.iter().sum::<f64>() + 2.0 * PI * machine.pulley_radius);
    belt_mass(&mut group, notes, &machine.belt.sheet, length, masses.total);
    group
}

fn belt(machine: &Machine, places: &[Place]) -> Option<Group> {
    if machine.belt.model == BeltModel::Rigid {
        return None;
    }
    let mut group = Group::new("belt", "Belt, with the cart at x = 0");
    if let Some(make) = machine.belt.make {
        group.add("specific_stiffness", "specific stiffness E A", make.modulus * make.section, "N");
    }
    for (span, stiffness) in machine.belt.stiffness.iter().enumerate() {
        group.add(format!("span{}_stiffness", span + 1), format!("stiffness of span {}", span + 1), *stiffness, "N/m");
    }
    let stretch = compliance(machine, 0.0);
    group
        .add("stiffness_at_cart", "stiffness at the cart", 1.0 / stretch, "N/m")
        .how("the drive pulley held: k1 + k2 k3/(k2 + k3)");
    group.add("stretch_per_force", "stretch per newton", stretch, "m/N");
    if machine.belt.damping.iter().any(|c| *c > 0.0) {
        for (span, damping) in machine.belt.damping.iter().enumerate() {
            group.add(format!("span{}_damping", span + 1), format!("damping of span {}", span + 1), *damping, "N s/m");
        }
    }
    // At x = 0, or where the travel comes nearest to it.
    let nearest = places.iter().min_by(|a, b| a.position[0].abs().total_cmp(&b.position[0].abs()))?;
    for (k, (hertz, ratio)) in nearest.modes.iter().enumerate() {
        let number = k + 1;
        group.add(format!("resonance{number}"), format!("resonance {number}"), *hertz, "Hz");
        if let Some(ratio) = ratio {
            let row = group.add(format!("resonance{number}_damping"), "its damping ratio", *ratio, "");
            row.how("belt, viscous friction and back-EMF, everything sliding");
        }
    }
    if let Some(hertz) = nearest.held {
        group
            .add("held_resonance", "resonance with the drive held", hertz, "Hz")
            .how("anti-resonance of the drive angle");
    }
    Some(group)
}

/// By how much the cart gives way per force, the drive pulley held, m/N: the idler pulley turns freely between spans 2
/// and 3.
fn compliance(machine: &Machine, x: f64) -> f64 {
    let [mut k1, mut k2, k3] = machine.belt.stiffness.three();
    if let Some(make) = machine.belt.make.filter(|_| machine.belt.follows_cart) {
        [k1, k2] = make.stiffness_at(x);
    }
    1.0 / (k1 + k2 * k3 / (k2 + k3))
}

fn place(machine: &Machine, found: &crate::linear::Place) -> Place {
    let damped = |k: usize| match found.resonances.get(k) {
        // Where damping makes fewer pairs, which is which cannot be told.
        Some(Root::Pair { damping, .. }) if found.resonances.len() == found.undamped_resonances.len() => Some(*damping),
        _ => None,
    };
    let modes = found.undamped_resonances.iter().enumerate().map(|(k, hertz)| (*hertz, damped(k))).collect();
    Place {
        position: vec![found.position],
        stiffness: found.stiffness.to_vec(),
        stretch: vec![compliance(machine, found.position)],
        modes,
        held: found.undamped_antiresonances.first().copied(),
    }
}

fn limits(machine: &Machine, masses: &Masses, most: Option<&Most>, notes: &mut Vec<Note>) -> Option<Group> {
    let r = machine.pulley_radius;
    let Some((power, from)) = Power::of(&machine.drives[0].motor, &machine.drives[0].amplifier, r, most) else {
        let text = "nothing bounds the input: give amplifier.voltage_limit or current_limit to see the largest speed and \
                    acceleration";
        notes.push(Note { code: "no-limit", text: text.to_string() });
        return None;
    };
    let mut group = Group::new("limits", "Limits");
    group.add("largest_force", "largest force of the motor at the belt", power.force, "N").how(format!("by {from}"));
    for (side, end) in [(1.0, ""), (-1.0, "_backward")] {
        let side_of = |forward: bool| {
            let pulleys = [&machine.drive_pulley, &machine.idler_pulley].map(|pulley| pulley.friction.side(forward));
            let cart = machine.cart.friction.side(forward);
            let coulomb = cart.coulomb + pulleys.iter().map(|side| side.coulomb).sum::<f64>() / r;
            let viscous = cart.viscous + pulleys.iter().map(|side| side.viscous).sum::<f64>() / (r * r);
            (coulomb, viscous)
        };
        let (coulomb, viscous) = side_of(side > 0.0);
        if side < 0.0 && machine.cart.constant_force() == 0.0 && side_of(true) == side_of(false) {
            break;
        }
        let against = -side * machine.cart.constant_force();
        let words = if end.is_empty() { "" } else { " backward" };
        let left = (power.force - coulomb - against) / masses.total;
        group
            .add(format!("largest_acceleration{end}"), format!("largest acceleration{words}"), left.max(0.0), "m/s^2")
            .how("at low speed, against friction");
        match power.speed(coulomb, viscous, against) {
            Some(speed) => {
                group
                    .add(format!("largest_speed{end}"), format!("largest speed{words}"), speed, "m/s")
                    .how("at steady state");
            }
            None => notes.push(Note {
                code: "no-largest-speed",
                text: "the speed is unlimited: in current mode give amplifier.voltage_limit".to_string(),
            }),
        }
        if left <= 0.0 {
            let text =
                format!("the largest force of the motor, {}, does not move the axis{words}", told(power.force, "N"));
            notes.push(Note { code: "does-not-move", text });
        }
    }
    if machine.belt.model != BeltModel::Rigid {
        group
            .add("largest_stretch", "stretch of the belt under this force", power.force * compliance(machine, 0.0), "m")
            .how("at the cart, the drive held");
        safety(&mut group, notes, &machine.belt.sheet, machine.belt.pretension, r, power.force);
        notes.extend(little_pretension(machine, power.force));
    }
    Some(group)
}

/// Of a belt that the largest force makes slack.
fn little_pretension(machine: &Machine, force: f64) -> Option<Note> {
    let pretension = machine.belt.pretension.filter(|pretension| *pretension < 0.5 * force)?;
    let text = format!(
        "a pretension of {} is less than half of the largest force, {}: a span may go slack",
        told(pretension, "N"),
        told(force, "N")
    );
    Some(Note { code: "little-pretension", text })
}
