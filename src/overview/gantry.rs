//! Overview of a gantry.

use super::limits::{Power, most, safety};
use super::{Group, Note, Overview, Place, belt_mass, drive_at_belt, motor_rows, of_belt, of_constants};
use crate::case::Case;
use crate::error::Result;
use crate::linear::Natural;
use crate::machine::{AmplifierMode, BeltMake, DriveUnit, Machine, Travel};
use std::f64::consts::PI;

/// The directions that it moves in, and what moves then.
const WAYS: [(&str, &str); 2] = [("x", "bridge and cart along x"), ("y", "cart along y")];

pub(super) fn overview(case: &Case) -> Result<Overview> {
    let gantry = &case.machine;
    let mut notes = Vec::new();
    let corners = corners(gantry);
    let depends_on_place = corners.len() > 1;
    let places = corners.iter().map(|at| place(gantry, *at)).collect::<Result<Vec<_>>>()?;
    let mut groups =
        vec![drive(gantry, &mut notes), inertia(gantry, &mut notes), belt(gantry, &place(gantry, [0.0, 0.0])?)];
    groups.extend(limits(case, &mut notes));
    for (motor, side) in gantry.drives.iter().map(|unit| &unit.motor).zip(gantry.geometry().sides()) {
        of_constants(motor, &format!("{side} drive: "), &mut notes);
    }
    notes.dedup_by(|a, b| {
        a.code == b.code && a.text.split_once(": ").map(|t| t.1) == b.text.split_once(": ").map(|t| t.1)
    });
    of_belt(&gantry.belt.sheet, &gantry.belt.damping, gantry.pulley_radius, &mut notes);
    let (title, kind) = (case.title.clone(), gantry.kind.word());
    Ok(Overview { title, kind, groups, places, depends_on_place, notes })
}

/// The middle of the working area and its corners, where the place makes a difference; else the origin.
fn corners(gantry: &Machine) -> Vec<[f64; 2]> {
    let (Some(_), Some(x), Some(y)) = (gantry.belt.following(), gantry.first_slide().travel, gantry.cart.travel) else {
        return vec![[0.0, 0.0]];
    };
    let middle = |travel: Travel| 0.5 * (travel.min + travel.max);
    vec![[middle(x), middle(y)], [x.min, y.min], [x.min, y.max], [x.max, y.min], [x.max, y.max]]
}

fn drive(gantry: &Machine, notes: &mut Vec<Note>) -> Group {
    let mut group = Group::new("drive", "Drives");
    let r = gantry.pulley_radius;
    let alike = gantry.drives.iter().all(|unit| *unit == gantry.drives[0]);
    for (k, side) in gantry.geometry().sides().enumerate().take(if alike { 1 } else { gantry.drives.len() }) {
        let prefix = if alike { String::new() } else { format!("{side}_") };
        let before = group.rows.len();
        let (motor, amplifier) = (&gantry.drives[k].motor, &gantry.drives[k].amplifier);
        motor_rows(&mut group, &prefix, motor);
        let (force, drag) = drive_at_belt(motor, (amplifier.mode, amplifier.gain), r);
        let (per_input, input) = match amplifier.mode {
            AmplifierMode::Voltage => ("N/V", "V"),
            AmplifierMode::Current => ("N/A", "A"),
            // A gantry has no steppers yet.
            AmplifierMode::Position => continue,
        };
        group.add(format!("{prefix}force_per_input"), "force at the belt per input", force, per_input);
        if drag > 0.0 {
            group.add(format!("{prefix}drag"), "drag at the belt", drag, "N s/m").how("of the back-EMF");
        }
        group.add(
            format!("{prefix}travel_per_turn"),
            "belt per turn of the motor",
            2.0 * PI * r / motor.gear_ratio,
            "m",
        );
        if !alike {
            group.rows[before..].iter_mut().for_each(|row| row.name = format!("{side}: {}", row.name));
        }
        for (number, (way, _)) in WAYS.into_iter().enumerate().filter(|_| force > 0.0) {
            let movers = movers(gantry, number);
            if !alike && movers[0] != k {
                continue;
            }
            let input_of_each = breakaway(gantry, number) / (force * movers.len() as f64);
            let row =
                group.add(format!("breakaway_input_{way}"), format!("breakaway along {way}"), input_of_each, input);
            match movers[..] {
                [_] => row.how(format!("of the {} drive", gantry.geometry().drives[movers[0]].side())),
                _ if alike => row.how("of both drives alike"),
                _ => row.how(format!("of both drives, each with the {side} one's force")),
            };
        }
    }
    let _ = notes;
    group
}

/// The drives that move what slides along the coordinate of this number, as much as it moves.
fn movers(gantry: &Machine, number: usize) -> Vec<usize> {
    let shares = gantry.belt_shares();
    (0..shares.len()).filter(|drive| shares[*drive][number] != 0.0).collect()
}

/// Breakaway along x or y, N at what moves: that of the pulleys that turn, and of the bridge or the cart.
fn breakaway(gantry: &Machine, number: usize) -> f64 {
    let count = movers(gantry, number).len() as f64;
    let pulleys = count * gantry.drive_pulley.friction.forward.breakaway / gantry.pulley_radius;
    pulleys + gantry.slide(number).map_or(0.0, |slide| slide.friction.forward.breakaway)
}

/// The mass at the belt of the pulleys and rotors that turn with a coordinate, kg.
fn turning(gantry: &Machine, number: usize) -> f64 {
    let r = gantry.pulley_radius;
    let movers = movers(gantry, number);
    let rotor = |unit: &DriveUnit| unit.motor.rotor_inertia * unit.motor.gear_ratio.powi(2);
    let rotors: f64 = movers.iter().map(|drive| rotor(&gantry.drives[*drive])).sum();
    (movers.len() as f64 * gantry.drive_pulley.inertia + rotors) / (r * r)
}

/// Moved mass along x and along y, kg: of bridge and cart, of the cart, and of the pulleys that turn then.
fn masses(gantry: &Machine) -> [f64; 2] {
    let sliding = [gantry.first_slide().mass + gantry.cart.mass, gantry.cart.mass];
    std::array::from_fn(|number| sliding[number] + turning(gantry, number))
}

fn inertia(gantry: &Machine, notes: &mut Vec<Note>) -> Group {
    let mut group = Group::new("inertia", "Moved mass");
    // With the same pulleys along both coordinates there is one mass that turns, else one for each.
    let turns_alike = movers(gantry, 0) == movers(gantry, 1);
    if turns_alike {
        let words = "both pulleys and rotors, at the belt";
        group.add("turning_mass", words, turning(gantry, 0), "kg").how("(2 J + n² J_r of both)/r²");
    }
    for (number, ((way, words), mass)) in WAYS.into_iter().zip(masses(gantry)).enumerate() {
        let turning = turning(gantry, number);
        if !turns_alike {
            let words = format!("pulleys and rotors that turn along {way}, at the belt");
            group.add(format!("turning_mass_{way}"), words, turning, "kg").how("(Σ J + n² J_r)/r²");
        }
        group.add(format!("total_mass_{way}"), words, mass, "kg");
        group.add(format!("reflected_share_{way}"), "share of rotating parts", turning / mass, "");
    }
    let length = gantry.belt.make.as_ref().map(|make| make.spans.iter().sum::<f64>());
    belt_mass(&mut group, notes, &gantry.belt.sheet, length, masses(gantry)[0]);
    group
}

fn belt(gantry: &Machine, place: &Place) -> Group {
    let mut group = Group::new("belt", "Belt, with bridge and cart at zero");
    if let Some(make) = &gantry.belt.make {
        group.add("specific_stiffness", "specific stiffness E A", make.rigidity(), "N");
    }
    for (label, stiffness) in gantry.kind.geometry().span_labels().zip(&gantry.belt.stiffness) {
        group.add(format!("{}_stiffness", label.key), format!("stiffness, {}", label.name), *stiffness, "N/m");
    }
    for ((way, _), stretch) in WAYS.into_iter().zip(&place.stretch) {
        let row =
            group.add(format!("stretch_per_force_{way}"), format!("stretch per newton along {way}"), *stretch, "m/N");
        row.how("the drive pulleys held");
    }
    for (k, (hertz, ratio)) in place.modes.iter().enumerate() {
        let number = k + 1;
        group.add(format!("resonance{number}"), format!("elastic mode {number}"), *hertz, "Hz");
        if let Some(ratio) = ratio {
            let row = group.add(format!("resonance{number}_damping"), "its damping ratio", *ratio, "");
            row.how("belt, viscous friction and back-EMF, everything sliding");
        }
    }
    group
}

/// The machine with the bridge at x and the cart at y.
fn place(gantry: &Machine, [x, y]: [f64; 2]) -> Result<Place> {
    let mechanism = gantry.mechanism();
    let modes = Natural::of(&mechanism, &gantry.without_strain(&[x, y], &[]).position)?;
    let modes = modes.elastic.iter().map(|mode| (mode.hertz(), mode.damping())).collect();
    let lengths = gantry.span_lengths(&[x, y]).zip(gantry.belt.make);
    let stiffness =
        lengths.map_or(gantry.belt.stiffness, |(lengths, make)| BeltMake { spans: lengths, ..make }.stiffness());

    // K = Σ k a aᵀ over what bridge and cart do to the spans, the pulleys held; its inverse says by how much they give
    // way.
    let mut k = [[0.0; 2]; 2];
    for (&span, stiffness) in mechanism.roles.spans.iter().zip(&stiffness) {
        let arms = mechanism.leading_arms(span);
        let a = [0, 1].map(|number: usize| arms[gantry.geometry().slides[number].body]);
        for (row, left) in k.iter_mut().zip(a) {
            for (entry, right) in row.iter_mut().zip(a) {
                *entry += stiffness * left * right;
            }
        }
    }
    let determinant = k[0][0] * k[1][1] - k[0][1] * k[1][0];
    let stretch = vec![k[1][1] / determinant, k[0][0] / determinant];
    Ok(Place { position: vec![x, y], stiffness: stiffness.to_vec(), stretch, modes, held: None })
}

fn limits(case: &Case, notes: &mut Vec<Note>) -> Option<Group> {
    let gantry = &case.machine;
    let r = gantry.pulley_radius;
    let inputs = case.experiments.iter().flat_map(|done| done.inputs.iter().map(|input| (input, done.until)));
    let most = most(None, inputs);
    let power = |k: usize| Power::of(&gantry.drives[k].motor, &gantry.drives[k].amplifier, r, most.as_ref());
    let Some(powers) = (0..gantry.drives.len()).map(power).collect::<Option<Vec<_>>>() else {
        let text = "the inputs are unlimited: give amplifier.voltage_limit or current_limit for the largest speeds and accelerations";
        notes.push(Note { code: "no-limit", text: text.to_string() });
        return None;
    };
    let name = if powers.len() == 2 { "Limits, both drives pulling alike" } else { "Limits" };
    let mut group = Group::new("limits", name);
    let force = powers.iter().map(|(power, _)| power.force).fold(f64::INFINITY, f64::min);
    group.add("largest_force", "largest force of a motor at the belt", force, "N").how(format!("by {}", powers[0].1));
    let pulleys = &gantry.drive_pulley.friction.forward;
    let slides = [&gantry.first_slide().friction.forward, &gantry.cart.friction.forward];
    for (number, (((way, _), mass), slide)) in WAYS.into_iter().zip(masses(gantry)).zip(slides).enumerate() {
        let movers: Vec<Power> = movers(gantry, number).into_iter().map(|drive| powers[drive].0).collect();
        let count = movers.len() as f64;
        let coulomb = slide.coulomb + count * pulleys.coulomb / r;
        let viscous = slide.viscous + count * pulleys.viscous / (r * r);
        let both = Power {
            force: count * movers.iter().map(|power| power.force).fold(f64::INFINITY, f64::min),
            voltage: movers[0].voltage,
            per_volt: movers.iter().map(|power| power.per_volt).sum(),
            brake: movers.iter().map(|power| power.brake).sum(),
        };
        let acceleration = ((both.force - coulomb) / mass).max(0.0);
        let row = group.add(
            format!("largest_acceleration_{way}"),
            format!("largest acceleration along {way}"),
            acceleration,
            "m/s^2",
        );
        row.how("at low speed, against friction");
        if let Some(speed) = both.speed(coulomb, viscous, 0.0) {
            group
                .add(format!("largest_speed_{way}"), format!("largest speed along {way}"), speed, "m/s")
                .how("at steady state");
        }
    }
    safety(&mut group, notes, &gantry.belt.sheet, gantry.belt.pretension, r, force);
    Some(group)
}
