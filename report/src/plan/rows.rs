//! Plans in words.

use crate::motion::length;
use crate::simulate::{time, value};
use taut::planning::{Arrival, Planned, Plans};

/// The family and its modes in a line.
pub fn belt(plans: &Plans) -> String {
    let axes = match plans.family.machines.len() {
        1 => "one axis".to_string(),
        count => format!("{count} axes"),
    };
    let modes: Vec<String> = plans.modes.iter().map(|mode| value(*mode, "Hz")).collect();
    let held = match plans.family.machine.stepper() {
        Some(_) => "rotor held by its field",
        None => "drive pulley held",
    };
    match modes.is_empty() {
        true => format!("over {axes}; no mode of the belt"),
        false => format!("over {axes}; modes with the {held}: {}", modes.join(", ")),
    }
}

/// The answer in a line.
pub fn head(planned: &Planned) -> String {
    let (best, given) = (&planned.best.arrival, &planned.given);
    let within = length(planned.window);
    if planned.is_kept {
        return match given.worst {
            Some(given) => format!("within {within} after {} at worst, with the limits of the file", time(given)),
            None => format!("not within {within} on all axes, with the limits of the file"),
        };
    }
    match (best.worst, given.worst) {
        (Some(best), Some(given)) => {
            format!("within {within} after {} at worst, {} with the limits of the file", time(best), time(given))
        }
        (Some(best), None) => {
            format!("within {within} after {} at worst, not on all axes with the limits of the file", time(best))
        }
        _ => format!("not within {within} on all axes"),
    }
}

/// Planned limits, arrival and loads with their names.
pub fn lines(planned: &Planned) -> Vec<(&'static str, String)> {
    let limits = &planned.best.limits;
    let [jerk, snap] = planned.best.periods;
    let on = |periods: u8, mode: &str| match periods {
        0 => String::new(),
        1 => format!(", over one period of the {mode} mode"),
        count => format!(", over {count} periods of the {mode} mode"),
    };
    let mut lines = vec![
        ("speed", value(limits.speed, "m/s")),
        ("acceleration", value(limits.acceleration, "m/s^2")),
        ("jerk", format!("{}{}", value(limits.jerk.unwrap_or(f64::INFINITY), "m/s^3"), on(jerk, "lowest"))),
        ("snap", format!("{}{}", value(limits.snap.unwrap_or(f64::INFINITY), "m/s^4"), on(snap, "next"))),
        ("arrives", arrival(planned, &planned.best.arrival)),
        ("file", arrival(planned, &planned.given)),
    ];
    if let Some(bound) = planned.bound {
        lines.push(("at least", format!("{}, the axis as one mass at full voltage and current", time(bound))));
    }
    for load in &planned.loads {
        let needed = [value(load.needed, load.unit), value(load.allowed, load.unit)];
        lines.push((load.limit, format!("{} of {} at worst", needed[0], needed[1])));
    }
    for short in &planned.shortfalls {
        lines.push(("file exceeds", short.words.clone()));
    }
    lines
}

fn arrival(planned: &Planned, arrival: &Arrival) -> String {
    let sliding = if planned.profiles.len() > 1 { "bridge or cart" } else { "cart" };
    let told = |at: Option<f64>| at.map_or("not".into(), time);
    format!(
        "{}, {} at worst ({} of {} axes); reference {}, {sliding} error {}",
        told(arrival.nominal),
        told(arrival.worst),
        arrival.settled,
        arrival.axes,
        time(arrival.duration),
        length(arrival.cart_error)
    )
}
