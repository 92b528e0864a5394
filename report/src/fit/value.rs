//! Numbers of a fit with their units.

use taut::number;

/// A number with its unit and as many digits as make sense.
pub fn value(value: f64, unit: &str, digits: usize) -> String {
    match unit {
        _ if value == 0.0 => format!("0 {unit}").trim().to_string(),
        // Prefixes where the unit takes one.
        "m" | "s" | "N" | "V" | "A" | "H" | "rad" | "N m" | "m/s" | "rad/s" => {
            number::engineering_typed(value, unit, digits)
        }
        "" => taut::quantity::rounded(value),
        _ => format!("{} {unit}", significant(value, digits)),
    }
}

fn significant(value: f64, digits: usize) -> String {
    let size = value.abs();
    if (1e-3..1e5).contains(&size) {
        let decimals = (digits as i32 - 1 - size.log10().floor() as i32).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.*e}", digits - 1)
    }
}
