//! Numbers from data sheets: a motor's rating, a belt's type, a drive's force, damping as a ratio.

use super::reader::{Field, Table, nearest};
use super::tree::NodeValue;
use crate::error::Result;
use crate::machine::{BELTS, BeltSheet, BeltType, Rating, SimpleDrive, slowest_swing};
use crate::mechanism::Mechanism;
use crate::parameter::{Parameter, Range};
use crate::quantity::{self, Dimension, show};

/// K_t, K_e and R of a motor: as they are given, else from its speed constant, else from its rating.
pub(super) fn constants(motor: &Table) -> Result<[f64; 3]> {
    let given = ["torque_constant", "back_emf_constant", "resistance"].map(|key| motor.number_if_given(key));
    let [torque, emf, resistance] = given;
    let (torque, emf, resistance) = (torque?, emf?, resistance?);
    // K_t = K_e = 1/K_v
    let constant = motor.number_if_given("speed_constant")?.map(|speed| 1.0 / speed);
    let rated = motor.optional("rated");
    let rating = rated.as_ref().map(rating).transpose()?;
    let of_load = rating.map(|rating| rating.torque_constant());
    let missing = |key: &str| {
        motor.number(key).map(|_| [0.0; 3]).map_err(|error| {
            let next = error.next.clone().unwrap_or_default();
            error.next(format!("{next} Or give what the data sheet has: speed_constant, or rated = {{ voltage, speed, torque, current }}"))
        })
    };
    let Some(torque) = torque.or(constant).or(of_load) else { return missing("torque_constant") };
    let of_rest = || Some(rating?.back_emf_constant(resistance?));
    let of_rating = rating.is_some().then_some(torque);
    let Some(emf) = emf.or(constant).or_else(of_rest).or(of_rating) else {
        return missing("back_emf_constant");
    };
    let Some(resistance) = resistance.or_else(|| Some(rating?.resistance(emf))) else {
        return missing("resistance");
    };
    if let (Some(field), Some(rating)) = (rated, rating) {
        consistent(&field, &rating, emf, resistance)?;
    }
    Ok([torque, emf, resistance])
}

fn rating(field: &Field) -> Result<Rating> {
    let table = field.table()?;
    table.check_keys(&[], &[])?;
    let [voltage, speed, torque, current, no_load_current] =
        ["voltage", "speed", "torque", "current", "no_load_current"].map(|key| table.number(key));
    let rating = Rating {
        voltage: voltage?,
        speed: speed?,
        torque: torque?,
        current: current?,
        no_load_current: no_load_current?,
    };
    if let Some(field) = table.optional("no_load_current")
        && rating.no_load_current >= rating.current
    {
        return Err(field
            .fail(format!("{} without load is not less than under load", show(rating.no_load_current, "A")))
            .allowed(format!("below `current`, {}", show(rating.current, "A"))));
    }
    Ok(rating)
}

/// Refuses a rating of which no motor is possible.
fn consistent(field: &Field, rating: &Rating, emf: f64, resistance: f64) -> Result<()> {
    let [given, taken] = [rating.voltage * rating.current, rating.torque * rating.speed];
    if resistance <= 0.0 {
        let back = emf * rating.speed;
        return Err(field
            .fail(format!(
                "the back-EMF at {} is {}, which leaves nothing of {} for a resistance",
                show(rating.speed, "rpm"),
                show(back, "V"),
                show(rating.voltage, "V")
            ))
            .allowed(format!(
                "a rating that takes more power than it gives: V I = {}, M w = {}",
                show(given, "W"),
                show(taken, "W")
            ))
            .next("check the units (rpm, mN m), and that all of it is of the same point: rated torque with rated current, not the stall torque"));
    }
    if emf <= 0.0 {
        return Err(field
            .fail(format!(
                "{} at {} use up all of {}, which leaves nothing for a back-EMF",
                show(resistance, "ohm"),
                show(rating.current, "A"),
                show(rating.voltage, "V")
            ))
            .next("check the resistance, of which some data sheets give that of two phases, and the rated current"));
    }
    Ok(())
}

/// A drive that is given by its force: the table [drive] instead of [motor].
pub(super) fn simple_drive(root: &Table) -> Result<Option<SimpleDrive>> {
    let Some(field) = root.optional("drive") else { return Ok(None) };
    let table = field.table()?;
    table.check_keys(&[], &[])?;
    if let Some(motor) = root.optional("motor") {
        return Err(motor
            .fail("there is already a [drive], which replaces motor and gear")
            .next("give [motor] if its data are known, or [drive] with force_per_input and drag if not"));
    }
    if let Some(mode) = root.optional("amplifier").and_then(|field| field.table().ok()?.optional("mode"))
        && mode.text()? == "current"
    {
        return Err(mode
            .fail("a [drive] has no current that could be commanded")
            .next("leave mode out, and give force_per_input per unit of the input"));
    }
    Ok(Some(SimpleDrive { force: table.number("force_per_input")?, drag: table.number("drag")? }))
}

/// The belt's data sheet: the keys beside stiffness and damping.
pub(super) fn belt(table: &Table) -> Result<BeltSheet> {
    let kind = table.optional("type").map(|field| belt_type(&field)).transpose()?;
    let width = table.number_if_given("width")?;
    if let (Some(field), None) = (table.optional("type"), width) {
        return Err(field
            .fail("the numbers of a type are those of a width")
            .next("add the belt's width, for example width = \"10 mm\""));
    }
    let of = |value: fn(&BeltType, f64) -> Option<f64>| value(kind?, width?);
    Ok(BeltSheet {
        kind,
        width,
        mass_per_length: table.number_if_given("mass_per_length")?.or_else(|| of(BeltType::mass)),
        allowed_tension: table.number_if_given("allowed_tension")?.or_else(|| of(BeltType::tension)),
        is_specific: false,
    })
}

fn belt_type(field: &Field) -> Result<&'static BeltType> {
    let name = field.text()?;
    BeltType::named(name).ok_or_else(|| {
        let names: Vec<&str> = BELTS.iter().map(|belt| belt.name).collect();
        let error = field.fail(format!("there are no numbers for a belt \"{name}\"")).allowed(names.join(", "));
        match nearest(name, &names) {
            Some(near) => error.next(format!("did you mean \"{near}\"?")),
            None => error.next("give specific_stiffness from its data sheet instead, and mass_per_length and allowed_tension if they are known"),
        }
    })
}

/// The pitch that the type of a belt has.
pub(super) fn pitch(root: &Table) -> Result<Option<f64>> {
    let kind = root.optional("belt").and_then(|field| field.table().ok()?.optional("type"));
    kind.map(|field| belt_type(&field).map(|kind| kind.pitch)).transpose()
}

/// E A, N: as given, per width where it is in N/m, or of the type; none where neither is there.
pub(super) fn specific_stiffness(table: &Table, sheet: &BeltSheet) -> Result<Option<f64>> {
    const PER_WIDTH: Parameter = Parameter::unwritten("N/m", Range::new(1e-15, 1e15), "14 kN/mm");
    let Some(field) = table.optional("specific_stiffness") else { return of_type(table, sheet) };
    let is_per_width = match &field.node.kind {
        NodeValue::Text(text) => {
            quantity::parse(text).is_ok_and(|given| given.dimension == Dimension::new(1, 0, -2, 0, 0))
        }
        NodeValue::Integer(_) | NodeValue::Float(_) | NodeValue::Bool(_) | NodeValue::Date => false,
        NodeValue::List(_) | NodeValue::Tables(_) | NodeValue::Table(_) => false,
    };
    if !is_per_width {
        return field.number().map(Some);
    }
    let per_width = field.number_of(&PER_WIDTH)?;
    match sheet.width {
        Some(width) => table.computed("specific_stiffness", &field, per_width * width).map(Some),
        None => Err(field
            .fail("this is a stiffness per width, and the width is missing")
            .next("add width, for example width = \"10 mm\", or give that of the whole belt, in N")),
    }
}

fn of_type(table: &Table, sheet: &BeltSheet) -> Result<Option<f64>> {
    let (Some(kind), Some(width), Some(field)) = (sheet.kind, sheet.width, table.optional("type")) else {
        return Ok(None);
    };
    match kind.stiffness(width) {
        Some(stiffness) => table.computed("specific_stiffness", &field, stiffness).map(Some),
        // Then what is there instead is asked for, if nothing is.
        None if ["stiffness", "modulus", "section"].iter().any(|key| table.optional(key).is_some()) => Ok(None),
        None => {
            let known = BELTS.iter().filter(|belt| !belt.widths.is_empty()).map(|belt| belt.name);
            Err(field
                .fail(format!("no source has the stiffness of a belt {}", kind.name))
                .allowed(format!("{}; or any type with a stiffness of your own", known.collect::<Vec<_>>().join(", ")))
                .next("add specific_stiffness from its data sheet (E A in N, or per width in N/mm), or stiffness, or modulus and section"))
        }
    }
}

/// β of c = β k, s: damping that is given by a ratio or a loss factor; none where it is not.
pub(super) fn proportion(table: &Table, mechanism: &Mechanism) -> Result<Option<f64>> {
    let [ratio, loss] = ["damping_ratio", "loss_factor"].map(|key| table.optional(key));
    let (field, zeta) = match (ratio, loss) {
        (None, None) => return Ok(None),
        (Some(_), Some(loss)) => {
            return Err(loss
                .fail("the damping ratio is given already")
                .next("give the one or the other: a loss factor is twice the ratio"));
        }
        (Some(ratio), None) => (ratio.clone(), ratio.number()?),
        // η = 2 ζ
        (None, Some(loss)) => (loss.clone(), 0.5 * loss.number()?),
    };
    if table.optional("damping").is_some() {
        return Err(field
            .fail("the damping is given already")
            .next("give either damping, or damping_ratio or loss_factor"));
    }
    match slowest_swing(mechanism) {
        // c = 2 ζ k / ω₀
        Some(frequency) => Ok(Some(2.0 * zeta / frequency)),
        None => Err(field
            .fail("a rigid belt has no vibration to damp")
            .next("leave it out, or set model = \"elastic\" or \"two-mass\"")),
    }
}

/// Lines of an encoder: `lines`, or a quarter of `counts`.
pub(super) fn lines(table: &Table) -> Result<f64> {
    match (table.optional("lines"), table.optional("counts")) {
        (Some(lines), None) => lines.number(),
        (None, Some(counts)) => Ok(counts.number()? / 4.0),
        (Some(_), Some(counts)) => Err(counts
            .fail("the lines are given already")
            .next("give either lines, or counts, of which a line has four")),
        (None, None) => {
            let example =
                "for example lines = 512  # Lines per turn, or at the cart per metre; or counts, four to a line.";
            Err(table.missing("lines", example))
        }
    }
}
