//! Play between the machine and the sensor of a position. The motion has none of it.

use super::extension::{Extended, Fitted, Said, Site, Telling, shown};
use crate::fit::asked::run::Nuisance;
use crate::fit::limits::CAUSE_WIDTHS;
use crate::log::Quantity;

/// Play of the sensor of each position, of several widths.
pub(super) fn plays(site: &Site) -> Vec<Extended> {
    if site.plan.nuisance.sensor_play.is_some() {
        return Vec::new();
    }
    let positions = site.found.problem.quantities().into_iter().filter(|quantity| quantity.is_position());
    let of = |quantity: Quantity| {
        let mut plan = site.plan.clone();
        plan.nuisance.sensor_play = Some(quantity);
        let deviation = site.deviation(quantity);
        let with = move |times: &f64| {
            let telling = Telling::Nuisance(Nuisance::SensorPlay(quantity), times * deviation);
            Extended::new(site.with(site.machine.clone()), plan.clone(), telling)
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
