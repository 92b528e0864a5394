//! The case file of a gantry: its drives, a bridge, a cart on it.

use super::friction::{friction, line};
use super::reader::{Field, Table};
use super::{input, machine, sheet, stepper};
use crate::error::{Error, Result};
use crate::friction::Friction;
use crate::machine::{
    Belt, BeltMake, BeltSheet, DriveAt, DriveUnit, Encoder, EncoderPlace, Machine, MachineKind, Pulley, Slide,
    SlideForces, Spans, Yaw,
};
use crate::mechanism::{STEPPERS, State};
use crate::signal::Signal;
use std::path::Path;

/// The kind of machine that the file describes.
pub(super) fn kind(root: &Table) -> Result<MachineKind> {
    let kinds = MachineKind::ALL.map(|kind| (kind.word(), kind));
    root.optional("kind").map_or(Ok(MachineKind::Axis), |field| field.choice(&kinds))
}

/// The tables of a gantry's case. Errors: one that belongs to an axis, or that is not there yet.
pub(super) fn tables(root: &Table, kind: MachineKind) -> Result<Vec<&'static str>> {
    for key in ["travel", "idler_pulley"] {
        if let Some(field) = root.optional(key) {
            return Err(field.fail("this belongs to an axis").next(match key {
                "travel" => "give the travel of each: bridge.travel and cart.travel",
                _ => "the idlers of a gantry have neither inertia nor friction here: leave it out",
            }));
        }
    }
    if let Some(field) = root.optional("measurement") {
        return Err(field.fail("this is not available yet for a gantry").next("leave it out for now"));
    }
    if let Some(field) = root.optional("stepper").filter(|_| kind.geometry().drives.len() > STEPPERS) {
        return Err(field
            .fail(format!(
                "a gantry of kind \"{}\" has three motors; steppers are available for machines with one or two",
                kind.word()
            ))
            .next("describe [motor] and [amplifier] instead, or a gantry with two motors"));
    }
    let drives = kind.geometry().drives.iter().map(|drive| drive.label.key);
    let before = ["title", "kind", "motor", "stepper", "drive", "amplifier"].into_iter();
    let behind = [
        "drive_pulley",
        "bridge",
        "cart",
        "belt",
        "encoder",
        "experiment",
        "controller",
        "move",
        "fit",
        "tune",
        "uncertainty",
        "sweep",
    ];
    Ok(before.chain(drives).chain(behind).collect())
}

/// The machine of the file `name`.
pub(super) fn machine(root: &Table, kind: MachineKind, name: &Path) -> Result<Machine> {
    let gantry = gantry(root, kind)?;
    gantry.check_gantry().map_err(|error| if error.place.is_none() { error.in_file(name) } else { error })?;
    Ok(gantry)
}

fn table<'a>(root: &Table<'a>, name: &str, holds: &str) -> Result<Table<'a>> {
    root.required(name, &format!("a table [{name}] with {holds}"))?.table()
}

fn gantry(root: &Table, kind: MachineKind) -> Result<Machine> {
    let drives = kind.geometry().drives.iter().map(|at| drive(root, at.label.key)).collect::<Result<Vec<_>>>()?;
    let pulley = table(root, "drive_pulley", "radius and inertia")?;
    pulley.check_keys(&[], &[])?;
    let belt = table(root, "belt", "stiffness")?;
    let belts = belts(&belt, kind)?;
    if let Some(field) = root.optional("drive") {
        return Err(field
            .fail("this belongs to an axis")
            .next("give the data of the gantry's motors in [motor], such as speed_constant and resistance"));
    }
    let yaw = yaw(root)?;
    let [bridge, cart] = [slide(root, "bridge")?, slide(root, "cart")?];
    if let Some(field) = belt.optional("follows_cart").filter(|_| belts.follows_cart) {
        for (name, slide) in [("bridge", &bridge), ("cart", &cart)] {
            if slide.travel.is_none() {
                return Err(field
                    .fail(format!(
                        "spans that follow bridge and cart need the travel of both, and {name}.travel is missing"
                    ))
                    .next(format!("add for example travel = {{ min = \"-0.2 m\", max = \"0.2 m\" }} to [{name}]")));
            }
        }
    }
    let encoder = root.optional("encoder").map(|field| encoder(&field.table()?)).transpose()?;
    let mut gantry = Machine {
        kind,
        drives,
        pulley_radius: machine::radius(&pulley, sheet::pitch(root)?)?,
        drive_pulley: machine::pulley(&pulley)?,
        idler_pulley: Pulley { inertia: 0.0, friction: Friction::default() },
        bridge: Some(bridge),
        yaw,
        cart,
        belt: belts,
        encoder,
        scale: None,
    };
    gantry.check_gears().map_err(|error| of_gears(root, &gantry, error))?;
    if let Some(proportion) = sheet::proportion(&belt, &gantry.mechanism())? {
        gantry.belt.damping = gantry.belt.stiffness.map(|stiffness| proportion * stiffness);
    }
    Ok(gantry)
}

/// The error about compliant gears where the first of them is given.
fn of_gears(root: &Table, gantry: &Machine, error: Error) -> Error {
    let of_all = std::iter::once(root.optional("motor"));
    let tables = gantry.geometry().drives.iter().map(|at| root.optional(at.label.key)?.table().ok()?.optional("motor"));
    match of_all.chain(tables).find_map(gear) {
        Some(field) => Error { place: field.fail("").place, ..error },
        None => error,
    }
}

/// First key of a motor that makes its gear compliant.
fn gear<'a>(motor: Option<Field<'a>>) -> Option<Field<'a>> {
    let motor = motor?.table().ok()?;
    ["gear_stiffness", "backlash", "gear_damping"].iter().find_map(|key| motor.optional(key))
}

/// Motor and amplifier of a side: those of all, with what its own table says; or the stepper of all sides.
fn drive(root: &Table, side: &str) -> Result<DriveUnit> {
    let own = root.optional(side).map(|field| field.table()).transpose()?;
    if let Some(stepper) = stepper::drive(root)? {
        return match own {
            Some(own) => Err(own.field.fail("both motors are the stepper of [stepper]").next("leave this table out")),
            None => Ok(stepper),
        };
    }
    if let Some(own) = &own {
        own.check_keys(&["motor", "amplifier"], &[])?;
    }
    let part = |name: &str| -> Result<Option<Table>> {
        let both = root.optional(name).map(|field| field.table()).transpose()?;
        let own = own.as_ref().and_then(|own| own.optional(name));
        match own {
            None => Ok(both),
            Some(own) => {
                let own = own.named(name).table()?;
                own.check_keys(if name == "amplifier" { &["mode"] } else { &[] }, &[])?;
                Ok(Some(own.over(both)))
            }
        }
    };
    let motor = match part("motor")? {
        Some(motor) => motor,
        None => table(root, "motor", "torque_constant, back_emf_constant and resistance")?,
    };
    let amplifier = machine::amplifier(part("amplifier")?.as_ref(), Some(&motor))?;
    Ok(DriveUnit { motor: machine::motor(&motor)?, amplifier })
}

/// The bridge, or the cart on it: both have the same keys.
fn slide(root: &Table, name: &str) -> Result<Slide> {
    let field = root.required(name, &format!("a table [{name}] with mass"))?.named("bridge");
    let table = field.table()?;
    // A key of the bridge's table alone.
    table.check_keys(&[], if name == "cart" { &["yaw"] } else { &[] })?;
    let travel = table.optional("travel").map(|field| machine::travel(&field.table()?)).transpose()?;
    let by_speed = table.optional("force_by_speed").map(|field| line(&field, ["speed", "force"])).transpose()?;
    let forces = SlideForces { along: None, by_speed };
    let load = table.number("load")?;
    Ok(Slide { travel, forces, load, ..Slide::new(table.number("mass")?, friction(&table)?) })
}

/// Yaw of the bridge, if the file describes it.
fn yaw(root: &Table) -> Result<Option<Yaw>> {
    let of = |name: &str| root.optional(name).map(|field| field.named("bridge").table()).transpose();
    if let Some(field) = of("cart")?.and_then(|cart| cart.optional("yaw")) {
        return Err(field.fail("only the bridge yaws").next("move it to [bridge.yaw]"));
    }
    let Some(field) = of("bridge")?.and_then(|bridge| bridge.optional("yaw")) else { return Ok(None) };
    let table = field.table()?;
    table.check_keys(&[], &[])?;
    Ok(Some(Yaw {
        inertia: table.number("inertia")?,
        belt_spacing: table.number("belt_spacing")?,
        bearing_spacing: table.number("bearing_spacing")?,
        bearing_stiffness: table.number("bearing_stiffness")?,
        bearing_damping: table.number("bearing_damping")?,
    }))
}

fn belts(table: &Table, kind: MachineKind) -> Result<Belt> {
    table.check_keys(&["follows_cart", "type"], &[])?;
    let sheet = sheet::belt(table)?;
    let labels: Vec<&str> = kind.geometry().span_labels().map(|span| span.name.trim_end_matches(" span")).collect();
    let count = labels.len();
    let per_span = format!("{count} values: {}", labels.join(", "));
    let pretension = table.number_if_given("pretension")?;
    let per_span_of = |field: &Field| -> Result<Spans> { Ok(field.numbers(count, &per_span)?.into_iter().collect()) };
    let damping = table.optional("damping").map_or(Ok(Spans::all(count, 0.0)), |field| per_span_of(&field))?;
    let follows = table.optional("follows_cart").map_or(Ok(false), |field| field.truth())?;
    let make = ["modulus", "section", "specific_stiffness", "spans"];
    if let Some(stiffness) = table.optional("stiffness") {
        if let Some(other) = make.iter().find_map(|key| table.optional(key)) {
            return Err(other.fail("the stiffness is given already").next(match other.key() {
                "specific_stiffness" => "give either stiffness, or specific_stiffness and spans",
                _ => "give either stiffness, or modulus, section and spans",
            }));
        }
        if let Some(field) = table.optional("follows_cart").filter(|_| follows) {
            return Err(field
                .fail("a given stiffness does not say how it changes with the length of a span")
                .next("give modulus, section and spans instead of stiffness"));
        }
        return Ok(Belt { pretension, sheet, ..Belt::given(per_span_of(&stiffness)?, damping) });
    }
    if make.iter().all(|key| table.optional(key).is_none()) && sheet.kind.is_none() {
        let example = vec!["\"100 kN/m\""; count].join(", ");
        let what = format!("for example stiffness = [{example}], or modulus, section and spans");
        return Err(table.missing("stiffness", &what));
    }
    let (modulus, section, is_specific) = machine::rigidity(table, &sheet)?;
    let spans = vec!["\"0.5 m\""; count].join(", ");
    let spans = per_span_of(&table.required("spans", &format!("for example spans = [{spans}]"))?)?;
    let make = BeltMake { modulus, section, spans };
    let stiffness = make.stiffness();
    for k in &stiffness {
        table.computed("stiffness", &table.field, *k)?;
    }
    let sheet = BeltSheet { is_specific, ..sheet };
    Ok(Belt { pretension, make: Some(make), follows_cart: follows, sheet, ..Belt::given(stiffness, damping) })
}

fn encoder(table: &Table) -> Result<Encoder> {
    table.check_keys(&["at"], &[])?;
    let places = [("motor", EncoderPlace::Motor), ("drive_pulley", EncoderPlace::DrivePulley)];
    let at = table.required("at", "for example at = \"motor\"")?.choice(&places)?;
    Ok(Encoder { at, lines: sheet::lines(table)? })
}

/// The input of each drive.
pub(super) fn inputs(experiment: &Table, gantry: &Machine, context: &input::Context) -> Result<Vec<Signal>> {
    let such_as = "for example input = { left = { pulse = \"5 V\", for = \"0.25 s\" }, right = { step = \"0 V\" } }";
    let inputs = experiment.required("input", such_as)?.table()?;
    let sides: Vec<&str> = gantry.geometry().sides().collect();
    if let Some(key) = inputs.keys().find(|key| !sides.contains(key)) {
        let field = inputs.optional(key).unwrap_or_else(|| inputs.field.clone());
        let what = format!("`{key}` is not an input of this gantry");
        return Err(field.fail(what).allowed(sides.join(", ")).next(such_as));
    }
    let signal = |(side, unit): (&str, &DriveUnit)| match inputs.optional(side) {
        None => Ok(Signal::Step { value: 0.0, at: 0.0 }),
        Some(field) => input::signal(&Field { input_unit: unit.amplifier.mode.unit(), ..field }, context),
    };
    sides.into_iter().zip(&gantry.drives).map(signal).collect()
}

/// Where bridge and cart are; the pulleys where the belt is without strain, unless they are given.
pub(super) fn initial(table: &Table, gantry: &Machine) -> Result<State> {
    table.check_keys(&[], &[])?;
    let geometry = gantry.geometry();
    let own = |key: &str| {
        let of_drive = |at: &DriveAt| {
            let rest = key.strip_prefix(geometry.label(at.pulley).key);
            matches!(rest, Some("_angle" | "_speed")) || key == at.current_column
        };
        let is_of_slide = geometry.slides.iter().any(|slide| {
            key.strip_prefix(geometry.label(slide.body).key).is_some_and(|rest| ["_position", "_speed"].contains(&rest))
        });
        is_of_slide || geometry.drives.iter().any(of_drive)
    };
    if let Some(field) = table.keys().find(|key| !own(key)).and_then(|key| table.optional(key)) {
        let what = format!("a gantry of kind \"{}\" has no such coordinate", geometry.word);
        return Err(field.fail(what).next("leave it out"));
    }
    let two = |of: [&str; 2]| -> Result<[f64; 2]> { Ok([table.number(of[0])?, table.number(of[1])?]) };
    let (positions, speeds) = (["bridge_position", "cart_position"], ["bridge_speed", "cart_speed"]);
    let mut state = gantry.without_strain(&two(positions)?, &two(speeds)?);
    for (index, (drive, at)) in gantry.mechanism().drives.iter().zip(geometry.drives).enumerate() {
        let (body, pulley) = (drive.pulley, geometry.label(at.pulley).key);
        if let Some(angle) = table.number_if_given(&format!("{pulley}_angle"))? {
            state.position[body] = angle;
        }
        if let Some(speed) = table.number_if_given(&format!("{pulley}_speed"))? {
            state.speed[body] = speed;
        }
        // The rotor in the middle of its play.
        (state.position[drive.shaft], state.speed[drive.shaft]) = (state.position[body], state.speed[body]);
        if let Some(field) = table.optional(at.current_column) {
            if drive.motor.stepper.is_some() {
                return Err(stepper::begins_energised(&field));
            }
            if !drive.has_current_state() {
                return Err(field.fail("this current would have no effect").next(
                    "it needs an inductance above zero in voltage mode, or a bandwidth in current mode; or leave it out",
                ));
            }
            state.current[index] = field.number()?;
        }
    }
    Ok(state)
}
