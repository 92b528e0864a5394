//! The machine's tables: motor, amplifier, pulleys, belt, cart, encoder.

use super::friction::{along, friction, line};
use super::reader::{Field, Table};
use super::{sheet, stepper};
use crate::error::Result;
use crate::machine::*;
use crate::quantity::{rounded, show};

pub(super) fn machine(root: &Table) -> Result<Machine> {
    let table = |name: &str, holds: &str| root.required(name, &format!("a table [{name}] with {holds}"))?.table();
    let simple = sheet::simple_drive(root)?;
    let stepper = stepper::drive(root)?;
    let motor = match simple {
        Some(_) => None,
        None if stepper.is_some() => None,
        None => {
            Some(table("motor", "torque_constant, back_emf_constant and resistance; or [drive] with force_per_input")?)
        }
    };
    let amplifier = root.optional("amplifier").map(|field| field.table()).transpose()?;
    let drive = table("drive_pulley", "radius and inertia")?;
    let idler = table("idler_pulley", "inertia")?;
    let cart = table("cart", "mass")?;
    let belt = table("belt", "stiffness")?;
    let travel = root.optional("travel").map(|field| field.table()).transpose()?;
    let encoder = root.optional("encoder").map(|field| field.table()).transpose()?;
    let scale = root.optional("scale");

    drive.check_keys(&[], &[])?;
    idler.check_keys(&[], &[])?;
    cart.check_keys(&[], &[])?;
    let pulley_radius = radius(&drive, sheet::pitch(root)?)?;
    let unit = stepper.map_or_else(|| brushed(root, (motor, simple, amplifier), pulley_radius), Ok)?;
    let mut machine = Machine {
        kind: MachineKind::Axis,
        drives: vec![unit],
        pulley_radius,
        drive_pulley: pulley(&drive)?,
        bridge: None,
        yaw: None,
        cart: Slide {
            mass: cart.number("mass")?,
            friction: friction(&cart)?,
            along: along(&cart)?,
            forces: SlideForces {
                along: cart.optional("force_along").map(|field| line(&field, ["position", "force"])).transpose()?,
                by_speed: cart.optional("force_by_speed").map(|field| line(&field, ["speed", "force"])).transpose()?,
            },
            load: cart.number("load")?,
            inclination: cart.number("inclination")?,
            travel: None,
        },
        idler_pulley: pulley(&idler)?,
        belt: self::belt(&belt, travel.as_ref())?,
        encoder: encoder.map(|table| self::encoder(&table)).transpose()?,
        scale: None,
    };
    machine.cart.travel = travel.as_ref().map(self::travel).transpose()?;
    machine.scale = scale.map(|field| self::scale(&field, machine.encoder)).transpose()?;
    if let Some(proportion) = sheet::proportion(&belt, &machine.mechanism())? {
        machine.belt.damping = machine.belt.stiffness.map(|stiffness| proportion * stiffness);
    }
    Ok(machine)
}

/// A brushed motor, or a drive that is given by force and drag, with its amplifier.
fn brushed(
    root: &Table,
    (motor, simple, amplifier): (Option<Table>, Option<SimpleDrive>, Option<Table>),
    pulley_radius: f64,
) -> Result<DriveUnit> {
    Ok(DriveUnit {
        motor: match (&motor, simple) {
            (Some(motor), _) => self::motor(motor)?,
            (None, Some(simple)) => simple.motor(pulley_radius),
            (None, None) => return Err(root.missing("motor", "a table [motor], or [drive], or [stepper]")),
        },
        amplifier: self::amplifier(amplifier.as_ref(), motor.as_ref())?,
    })
}

pub(super) fn motor(table: &Table) -> Result<Motor> {
    table.check_keys(&[], &[])?;
    let [torque_constant, back_emf_constant, resistance] = sheet::constants(table)?;
    Ok(Motor {
        torque_constant,
        back_emf_constant,
        resistance,
        inductance: table.number("inductance")?,
        rotor_inertia: table.number("rotor_inertia")?,
        gear_ratio: table.number("gear_ratio")?,
        gear_efficiency: table.number("gear_efficiency")?,
        gear_play: gear_play(table)?,
        is_simple: false,
        stepper: None,
    })
}

/// A compliant gear: `gear_stiffness`, and `backlash` and `gear_damping` with it.
fn gear_play(table: &Table) -> Result<Option<GearPlay>> {
    let Some(stiffness) = table.optional("gear_stiffness") else {
        return match ["backlash", "gear_damping"].into_iter().find_map(|key| table.optional(key)) {
            None => Ok(None),
            Some(field) => Err(field
                .fail("this needs a compliant gear, so that rotor and drive pulley can turn against each other")
                .next("add for example gear_stiffness = \"300 N m/rad\"")),
        };
    };
    if table.number("rotor_inertia")? == 0.0 {
        return Err(stiffness
            .fail("a rotor that turns by itself needs an inertia")
            .next("add for example rotor_inertia = \"4.2e-6 kg m^2\""));
    }
    Ok(Some(GearPlay {
        backlash: table.number("backlash")?,
        stiffness: stiffness.number()?,
        damping: table.number("gear_damping")?,
    }))
}

pub(super) fn travel(table: &Table) -> Result<Travel> {
    table.check_keys(&[], &[])?;
    let (min, max) = (table.number("min")?, table.number("max")?);
    if min >= max
        && let Some(field) = table.optional("max")
    {
        return Err(field.fail("the travel ends before it begins").allowed("above min"));
    }
    let damping = table.number("stop_damping")?;
    let stop = table.number_if_given("stop_stiffness")?.map(|stiffness| EndStop { stiffness, damping });
    match table.optional("stop_damping") {
        Some(field) if stop.is_none() => Err(field
            .fail("this is the damping of end stops, and there are none")
            .next("add for example stop_stiffness = \"20 kN/m\"")),
        _ => Ok(Travel { min, max, stop }),
    }
}

pub(super) fn amplifier(table: Option<&Table>, motor: Option<&Table>) -> Result<Amplifier> {
    let Some(table) = table else {
        return Ok(Amplifier::ideal(AmplifierMode::Voltage, 1.0));
    };
    table.check_keys(&["mode"], &[])?;
    let modes = [("voltage", AmplifierMode::Voltage), ("current", AmplifierMode::Current)];
    let mode = table.optional("mode").map_or(Ok(AmplifierMode::Voltage), |field| field.choice(&modes))?;
    let inductance = motor.map_or(Ok(0.0), |motor| motor.number("inductance"))?;
    match (mode, table.optional("bandwidth"), table.optional("voltage_limit")) {
        (AmplifierMode::Voltage, Some(bandwidth), _) => {
            return Err(bandwidth
                .fail("an amplifier that commands the voltage has no current loop")
                .next("leave it out, or set mode = \"current\""));
        }
        (AmplifierMode::Current, None, Some(limit)) if inductance > 0.0 => {
            return Err(limit.fail("a step of current needs an infinite voltage at an inductance").next(
                "add the current loop's bandwidth, for example bandwidth = \"1 kHz\", or leave motor.inductance out",
            ));
        }
        (AmplifierMode::Current, Some(_), Some(limit)) if inductance == 0.0 => {
            return Err(limit
                .fail("without inductance the voltage does not limit how fast the current changes")
                .next("add motor.inductance, or leave amplifier.bandwidth out"));
        }
        _ => {}
    }
    Ok(Amplifier {
        mode,
        gain: table.number("gain")?,
        voltage_limit: table.number_if_given("voltage_limit")?,
        current_limit: table.number_if_given("current_limit")?,
        bandwidth: table.number_if_given("bandwidth")?,
    })
}

/// `radius`, or `teeth` and `pitch`, which may be that of the belt's type.
pub(super) fn radius(table: &Table, belt_pitch: Option<f64>) -> Result<f64> {
    let [radius, teeth, pitch] = ["radius", "teeth", "pitch"].map(|key| table.optional(key));
    match (radius, teeth, pitch) {
        (None, Some(teeth), None) if let Some(pitch) = belt_pitch => {
            table.computed("radius", &teeth, pitch_radius(teeth.number()?, pitch))
        }
        (None, Some(_), Some(pitch))
            if belt_pitch.is_some_and(|belt| !same_pitch(belt, pitch.number().unwrap_or(belt))) =>
        {
            let belt = belt_pitch.unwrap_or_default();
            Err(pitch
                .fail(format!("the belt's type has a pitch of {}", show(belt, "mm")))
                .next("leave the pitch out, or correct the one or the other"))
        }
        (Some(radius), None, None) => radius.number(),
        (Some(_), Some(other), _) | (Some(_), None, Some(other)) => {
            Err(other.fail("the radius is given already").next("give either radius, or teeth and pitch"))
        }
        (None, Some(teeth), Some(pitch)) => {
            table.computed("radius", &pitch, pitch_radius(teeth.number()?, pitch.number()?))
        }
        (None, Some(_), None) => Err(table.missing("pitch", "for example pitch = \"2.03 mm\"")),
        (None, None, Some(_)) => Err(table.missing("teeth", "for example teeth = 60")),
        (None, None, None) => Err(table.missing("radius", "for example radius = \"19.4 mm\", or teeth and pitch")),
    }
}

/// True if two pitches are the same but for rounding in print.
fn same_pitch(a: f64, b: f64) -> bool {
    (a - b).abs() <= 0.01 * a
}

pub(super) fn pulley(table: &Table) -> Result<Pulley> {
    let inertia = match table.optional("inertia") {
        Some(field) if field.is_table() => {
            let shape = field.table()?;
            shape.check_keys(&[], &[])?;
            let [outer, bore, width, density] =
                ["outer_diameter", "bore_diameter", "width", "density"].map(|key| shape.number(key));
            let (outer, bore) = (outer?, bore?);
            if let Some(field) = shape.optional("bore_diameter")
                && bore >= outer
            {
                return Err(field.fail("the bore is not smaller than the outside").allowed("below outer_diameter"));
            }
            table.computed("inertia", &field, cylinder_inertia(outer, bore, width?, density?))?
        }
        _ => table.number("inertia")?,
    };
    Ok(Pulley { inertia, friction: friction(table)? })
}

fn belt(table: &Table, travel: Option<&Table>) -> Result<Belt> {
    table.check_keys(&["model", "follows_cart", "type"], &[])?;
    let sheet = sheet::belt(table)?;
    let models = [BeltModel::Elastic, BeltModel::TwoMass, BeltModel::Rigid].map(|model| (model.word(), model));
    let model = table.optional("model").map_or(Ok(BeltModel::Elastic), |field| field.choice(&models))?;
    let pretension = table.number_if_given("pretension")?;
    if let Some(field) = table.optional("pretension")
        && model == BeltModel::Rigid
    {
        return Err(field
            .fail("a rigid belt has no tension, so it cannot go slack")
            .next("leave it out, or set model = \"two-mass\" or \"elastic\""));
    }
    let follows_cart = table.optional("follows_cart").map_or(Ok(false), |field| field.truth())?;
    let follows = table.optional("follows_cart").filter(|_| follows_cart);
    let make = ["modulus", "section", "specific_stiffness", "spans"];
    let damping = table.optional("damping").map_or(Ok([0.0; 3]), |field| field.three())?;
    let given = |stiffness: Spans| Belt { pretension, model, sheet, ..Belt::given(stiffness, damping) };
    if let Some(stiffness) = table.optional("stiffness") {
        if let Some(other) = make.iter().find_map(|key| table.optional(key)) {
            return Err(other.fail("the stiffness is given already").next(match other.key() {
                "specific_stiffness" => "give either stiffness, or specific_stiffness and spans",
                _ => "give either stiffness, or modulus, section and spans",
            }));
        }
        if let Some(field) = follows {
            return Err(field
                .fail("a given stiffness does not say how it changes with the length of a span")
                .next("give modulus, section and spans instead of stiffness"));
        }
        return Ok(given(stiffness.three()?.into()));
    }
    let none = make.iter().all(|key| table.optional(key).is_none());
    if none && model == BeltModel::Rigid {
        return Ok(given(Spans::all(3, f64::INFINITY)));
    }
    if none && sheet.kind.is_none() {
        return Err(table.missing(
            "stiffness",
            "for example stiffness = [\"132.76 kN/m\", \"132.76 kN/m\", \"58.885 kN/m\"], or modulus, section and spans",
        ));
    }
    let (modulus, section, is_specific) = rigidity(table, &sheet)?;
    let spans =
        table.required("spans", "for example spans = [\"0.34925 m\", \"0.34925 m\", \"0.7874 m\"]")?.three()?.into();
    let make = BeltMake { modulus, section, spans };
    let stiffness = make.stiffness();
    for k in stiffness {
        table.computed("stiffness", &table.field, k)?;
    }
    if let Some(field) = follows {
        spans_left(&field, &make, travel)?;
    }
    let sheet = BeltSheet { is_specific, ..sheet };
    Ok(Belt { make: Some(make), follows_cart, sheet, ..given(stiffness) })
}

/// E and A of a belt; of one that is given by E A itself that and 1 m², and that it is so.
pub(super) fn rigidity(table: &Table, sheet: &BeltSheet) -> Result<(f64, f64, bool)> {
    let material = ["modulus", "section"].iter().find_map(|key| table.optional(key));
    if let (Some(material), Some(_)) = (&material, table.optional("specific_stiffness")) {
        return Err(material
            .fail("the specific stiffness is given already, and is E A")
            .next("give either specific_stiffness, or modulus and section"));
    }
    if material.is_none()
        && let Some(specific) = sheet::specific_stiffness(table, sheet)?
    {
        return Ok((specific, 1.0, true));
    }
    let modulus = modulus(&table.required("modulus", "for example modulus = \"8.335 GPa\"")?)?;
    let section = section(&table.required("section", "for example section = \"5.5626 mm^2\"")?)?;
    Ok((modulus, section, false))
}

/// Within its travel the cart must leave something of the spans on either side: −l₂ < min, max < l₁.
fn spans_left(follows: &Field, make: &BeltMake, travel: Option<&Table>) -> Result<()> {
    let Some(table) = travel else {
        return Err(follows
            .fail("the travel of the cart is missing")
            .next("add a table [travel] with min and max, such as min = \"-0.3 m\" and max = \"0.3 m\""));
    };
    let Travel { min, max, .. } = self::travel(table)?;
    let [l1, l2, _] = make.spans.three();
    let (key, what, allowed) = match (min > -l2, max < l1) {
        (true, true) => return Ok(()),
        (false, _) => ("min", "span 2 would have no length left", format!("above {}", show(-l2, "m"))),
        (true, false) => ("max", "span 1 would have no length left", format!("below {}", show(l1, "m"))),
    };
    let field = table.optional(key).unwrap_or_else(|| table.field.clone());
    Err(field.fail(what).allowed(format!("{allowed}, the length of the span at x = 0")))
}

/// One modulus, or the parts of a composite.
pub(super) fn modulus(field: &Field) -> Result<f64> {
    const ROUNDING: f64 = 1e-6;
    if !field.is_list() {
        return field.number();
    }
    let parts = field
        .filled_list()?
        .iter()
        .map(|part| {
            let part = part.table()?;
            part.check_keys(&[], &[])?;
            Ok((part.number("share")?, part.number("modulus")?))
        })
        .collect::<Result<Vec<_>>>()?;
    let whole: f64 = parts.iter().map(|(share, _)| share).sum();
    if (whole - 1.0).abs() > ROUNDING {
        return Err(field.fail(format!("the shares add up to {}", rounded(whole))).allowed("shares that add up to 1"));
    }
    Ok(composite_modulus(&parts))
}

/// One cross-section, or that of a toothed belt.
pub(super) fn section(field: &Field) -> Result<f64> {
    if !field.is_table() {
        return field.number();
    }
    let table = field.table()?;
    table.check_keys(&[], &[])?;
    Ok(toothed_section(table.number("plain")?, table.number("toothed")?, table.number("toothed_share")?))
}

/// A scale at the cart beside an encoder that is elsewhere.
fn scale(field: &Field, encoder: Option<Encoder>) -> Result<Encoder> {
    let table = field.table()?;
    table.check_keys(&[], &[])?;
    let scale = Encoder { at: EncoderPlace::Cart, lines: sheet::lines(&table)? };
    match encoder.map(|encoder| encoder.at) {
        Some(EncoderPlace::Motor | EncoderPlace::DrivePulley) => Ok(scale),
        Some(EncoderPlace::Cart) => {
            Err(field.fail("the encoder of this case is already at the cart").next("leave one of them out"))
        }
        None => Err(field
            .fail("a scale is a second sensor, and this case has no first one")
            .next("add [encoder] at the motor or the drive pulley, or write [encoder] with at = \"cart\" instead")),
    }
}

fn encoder(table: &Table) -> Result<Encoder> {
    table.check_keys(&["at"], &[])?;
    let places =
        [("motor", EncoderPlace::Motor), ("drive_pulley", EncoderPlace::DrivePulley), ("cart", EncoderPlace::Cart)];
    let at = table.required("at", "for example at = \"motor\"")?.choice(&places)?;
    Ok(Encoder { at, lines: sheet::lines(table)? })
}
