//! The machine's tables: motor, amplifier, pulleys, belt, cart, encoder.

use super::reader::{Field, Table};
use crate::error::Result;
use crate::friction::{Friction, Side};
use crate::quantity::{rounded, show};
use crate::stage::*;

/// Keys that stand in the plan and not yet in the program.
const PLANNED_AMPLIFIER: &[&str] = &["voltage_limit", "current_limit"];
const PLANNED_BELT: &[&str] = &["follows_cart", "model"];
const PLANNED_FRICTION: &[&str] = &["stribeck", "lugre"];

pub(super) fn stage(root: &Table) -> Result<Stage> {
    let table = |name: &str, holds: &str| root.required(name, &format!("a table [{name}] with {holds}"))?.table();
    let motor = table("motor", "torque_constant, back_emf_constant and resistance")?;
    let amplifier = root.optional("amplifier").map(|field| field.table()).transpose()?;
    let drive = table("drive_pulley", "radius and inertia")?;
    let idler = table("idler_pulley", "inertia")?;
    let cart = table("cart", "mass")?;
    let belt = table("belt", "stiffness")?;
    let encoder = root.optional("encoder").map(|field| field.table()).transpose()?;

    drive.check_keys(&[], &[])?;
    idler.check_keys(&[], &[])?;
    cart.check_keys(&[], &[])?;
    Ok(Stage {
        motor: self::motor(&motor)?,
        amplifier: self::amplifier(amplifier.as_ref())?,
        pulley_radius: radius(&drive)?,
        drive_pulley: pulley(&drive)?,
        cart: Cart { mass: cart.number("mass")?, friction: friction(&cart)? },
        idler_pulley: pulley(&idler)?,
        belt: self::belt(&belt)?,
        encoder: encoder.map(|table| self::encoder(&table)).transpose()?,
    })
}

fn motor(table: &Table) -> Result<Motor> {
    table.check_keys(&[], &[])?;
    Ok(Motor {
        torque_constant: table.number("torque_constant")?,
        back_emf_constant: table.number("back_emf_constant")?,
        resistance: table.number("resistance")?,
        inductance: table.number("inductance")?,
        rotor_inertia: table.number("rotor_inertia")?,
        gear_ratio: table.number("gear_ratio")?,
        gear_efficiency: table.number("gear_efficiency")?,
    })
}

fn amplifier(table: Option<&Table>) -> Result<Amplifier> {
    let Some(table) = table else {
        return Ok(Amplifier { mode: AmplifierMode::Voltage, gain: 1.0 });
    };
    table.check_keys(&["mode"], PLANNED_AMPLIFIER)?;
    let modes = [("voltage", AmplifierMode::Voltage), ("current", AmplifierMode::Current)];
    let mode = table.optional("mode").map_or(Ok(AmplifierMode::Voltage), |field| field.choice(&modes))?;
    Ok(Amplifier { mode, gain: table.number("gain")? })
}

/// `radius`, or `teeth` and `pitch`.
fn radius(table: &Table) -> Result<f64> {
    let [radius, teeth, pitch] = ["radius", "teeth", "pitch"].map(|key| table.optional(key));
    match (radius, teeth, pitch) {
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

fn pulley(table: &Table) -> Result<Pulley> {
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

/// The friction of a body; all zero where the table says nothing.
fn friction(body: &Table) -> Result<Friction> {
    let Some(field) = body.optional("friction") else { return Ok(Friction::default()) };
    let table = field.table()?;
    table.check_keys(&[], PLANNED_FRICTION)?;
    let viscous = table.number("viscous")?;
    let coulomb = table.number("coulomb")?;
    let coulomb_backward = table.number_if_given("coulomb_backward")?.unwrap_or(coulomb);
    let breakaway = table.number_if_given("static")?;
    let breakaway_backward = table.number_if_given("static_backward")?.or(breakaway);

    // At rest a body holds at least what it resists with in motion.
    let unit = if body.field.section == "cart" { "N" } else { "N m" };
    let at_least = |key: &str, breakaway: Option<f64>, allowed: &str, coulomb: f64| match breakaway {
        Some(value) if value < coulomb => {
            let field = table.optional(key).unwrap_or_else(|| table.field.clone());
            let (value, coulomb) = (show(value, unit), show(coulomb, unit));
            Err(field
                .fail(format!("a breakaway of {value} is less than the Coulomb friction of {coulomb}"))
                .allowed(allowed))
        }
        _ => Ok(()),
    };
    at_least("static", breakaway, "at least coulomb", coulomb)?;
    let (backward, allowed) = match table.optional("static_backward") {
        Some(_) => ("static_backward", "at least coulomb_backward, which is coulomb where it is not given"),
        None => ("static", "at least coulomb_backward, unless static_backward is given"),
    };
    at_least(backward, breakaway_backward, allowed, coulomb_backward)?;

    let viscous_backward = table.number_if_given("viscous_backward")?.unwrap_or(viscous);
    Ok(Friction {
        forward: Side { viscous, coulomb, breakaway: breakaway.unwrap_or(coulomb) },
        backward: Side {
            viscous: viscous_backward,
            coulomb: coulomb_backward,
            breakaway: breakaway_backward.unwrap_or(coulomb_backward),
        },
    })
}

fn belt(table: &Table) -> Result<Belt> {
    table.check_keys(&[], PLANNED_BELT)?;
    let make = ["modulus", "section", "spans"];
    let damping = table.optional("damping").map_or(Ok([0.0; 3]), |field| field.three())?;
    if let Some(stiffness) = table.optional("stiffness") {
        if let Some(other) = make.iter().find_map(|key| table.optional(key)) {
            return Err(other
                .fail("the stiffness is given already")
                .next("give either stiffness, or modulus, section and spans"));
        }
        return Ok(Belt { stiffness: stiffness.three()?, damping, make: None });
    }
    if make.iter().all(|key| table.optional(key).is_none()) {
        return Err(table.missing(
            "stiffness",
            "for example stiffness = [\"132.76 kN/m\", \"132.76 kN/m\", \"58.885 kN/m\"], or modulus, section and spans",
        ));
    }
    let make = BeltMake {
        modulus: modulus(&table.required("modulus", "for example modulus = \"8.335 GPa\"")?)?,
        section: section(&table.required("section", "for example section = \"5.5626 mm^2\"")?)?,
        spans: table.required("spans", "for example spans = [\"0.34925 m\", \"0.34925 m\", \"0.7874 m\"]")?.three()?,
    };
    let stiffness = make.stiffness();
    for k in stiffness {
        table.computed("stiffness", &table.field, k)?;
    }
    Ok(Belt { stiffness, damping, make: Some(make) })
}

/// One modulus, or the parts of a composite.
fn modulus(field: &Field) -> Result<f64> {
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
fn section(field: &Field) -> Result<f64> {
    if !field.is_table() {
        return field.number();
    }
    let table = field.table()?;
    table.check_keys(&[], &[])?;
    Ok(toothed_section(table.number("plain")?, table.number("toothed")?, table.number("toothed_share")?))
}

fn encoder(table: &Table) -> Result<Encoder> {
    table.check_keys(&["at"], &[])?;
    let places =
        [("motor", EncoderPlace::Motor), ("drive_pulley", EncoderPlace::DrivePulley), ("cart", EncoderPlace::Cart)];
    let at = table.required("at", "for example at = \"motor\"")?.choice(&places)?;
    let lines = table.number("lines")?;
    Ok(Encoder { at, lines })
}
