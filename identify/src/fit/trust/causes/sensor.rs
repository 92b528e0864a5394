//! Play between the machine and the sensor of a position, and a factor on its readings. The motion has none of them.

use super::extension::{Extended, Fitted, Said, Site, Telling, shown};
use crate::fit::asked::run::Nuisance;
use crate::fit::limits::CAUSE_WIDTHS;
use crate::log::Quantity;
use crate::number::significant;

/// Play of the sensor of each position, of several widths.
pub(super) fn plays(site: &Site) -> Vec<Extended> {
    if site.plan.nuisance.sensor_play.is_some() {
        return Vec::new();
    }
    let positions = site.found.problem.quantities().into_iter().filter(|quantity| quantity.is_position());
    let of = |quantity: Quantity| {
        let mut plan = site.plan.clone();
        plan.nuisance.sensor_play = Some(quantity);
        let deviation = site.deviation_at_start(quantity);
        let with = move |times: &f64| {
            let telling = Telling::Nuisance(Nuisance::SensorPlay(quantity), times * deviation);
            Extended::new(site.with(site.begins().clone()), plan.clone(), telling)
        };
        CAUSE_WIDTHS.iter().map(with).collect::<Vec<_>>()
    };
    positions.flat_map(of).collect()
}

/// The play in words.
pub(super) fn words(_: &Site, extended: &Extended, found: &Fitted) -> Said {
    let quantity = extended.plan.nuisance.sensor_play.unwrap_or(Quantity::DriveAngle);
    let (name, width) = (quantity.name(), shown(found.value, quantity.unit()));
    let words = format!("play of {width} between the machine and the sensor of {name}, whose reading lags behind it");
    Said { words, add: format!("add nuisance = {{ sensor_play = \"{name}\" }} to [fit]") }
}

/// A factor on the readings of one of several sensors of positions: on those of all, masses and friction depend.
pub(super) fn scales(site: &Site) -> Vec<Extended> {
    let positions = site.found.problem.quantities().into_iter().filter(|quantity| quantity.is_position());
    let positions: Vec<Quantity> = positions.collect();
    let with = |&quantity: &Quantity| {
        let mut plan = site.plan.clone();
        plan.nuisance.sensor_scale = Some(quantity);
        let telling = Telling::Nuisance(Nuisance::SensorScale(quantity), 0.0);
        Extended::new(site.with(site.begins().clone()), plan, telling)
    };
    if positions.len() > 1 { positions.iter().map(with).collect() } else { Vec::new() }
}

/// The factor in words.
pub(super) fn scale_words(_: &Site, extended: &Extended, found: &Fitted) -> Said {
    let name = extended.plan.nuisance.sensor_scale.map_or("", Quantity::name);
    let factor = 1.0 + found.value;
    let words =
        format!("a sensor of {name} that reads {} times its motion, relative to the others", significant(factor, 4));
    let scale = significant(1.0 / factor, 4);
    Said { words, add: format!("check its counts and its radius, or set scale = {{ {name} = {scale} }} in the log") }
}
